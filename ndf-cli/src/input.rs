//! From a file to a surface that can be learned.

use std::path::Path;

use ndf_core::io::MeshFile;
use ndf_core::mesh::repair;
use ndf_core::model::ModelError;
use ndf_core::{ManifoldMesh, Model, Surface};
use ndf_meshing::{BaseMesh, BaseMeshError, BaseMeshOptions, base_mesh, base_mesh_of_manifold};
use ndf_surfaces::MeshSurface;

use crate::commands::info::kind_of;
use crate::commands::read_faces;
use crate::context::Context;
use crate::output::Failure;
use crate::progress::ShownProgress;

/// The share of the area that one component must have to stand for the whole mesh.
const LARGEST_COMPONENT: f64 = 0.5;

/// A mesh file as a surface.
pub struct MeshInput {
    /// What is learned.
    pub surface: MeshSurface,
    /// The mesh as read.
    pub file: MeshFile,
    /// The mesh as a clean manifold, or why it is none.
    pub manifold: Result<ManifoldMesh, String>,
}

impl MeshInput {
    /// Reads a mesh of any quality; what had to be mended is told as warnings.
    ///
    /// # Errors
    /// If the file is no mesh, or has no face to stand on.
    pub fn read(path: &Path, context: &Context) -> Result<Self, Failure> {
        let name = path.display();
        if begins_as_model(path) {
            let failure = Failure::new(format!("{name} is a model already"));
            return Err(failure.try_instead("`ndf extract` makes a mesh of it"));
        }
        let file = read_faces(path, context)?;
        let kind = kind_of(&file);
        if kind != "mesh" {
            return Err(Failure::new(format!(
                "{name} is of the kind {kind}; only meshes can be used here so far"
            )));
        }
        let usable = |surface: Result<MeshSurface, ndf_surfaces::EmptyMesh>| {
            surface.map_err(|e| Failure::new(format!("{name}: {e}")))
        };
        let cleaned = repair::without_unusable_faces(&file.mesh);
        if cleaned.area() == 0.0 {
            return Err(Failure::new(format!("{name}: all faces are without area, or not finite")));
        }
        match repair::mended(&file.mesh) {
            // Where no component has most of the area, the mesh means the union of its pieces.
            Ok(mended) if mended.kept_area >= LARGEST_COMPONENT => {
                mended.notes.iter().for_each(|note| context.warn(&format!("{name}: {note}")));
                let surface = usable(MeshSurface::new(mended.mesh.as_triangle_mesh()))?;
                Ok(Self { surface, file, manifold: Ok(mended.mesh) })
            }
            other => {
                let reason = match other {
                    Ok(mended) => format!(
                        "it is in pieces, the largest with {:.0} % of the area",
                        100.0 * mended.kept_area
                    ),
                    Err(reason) => reason.to_string(),
                };
                let surface = usable(MeshSurface::new(&repair::oriented(&cleaned)))?;
                Ok(Self { surface, file, manifold: Err(reason) })
            }
        }
    }

    /// A base mesh of the surface: decimated from a clean mesh, or else from its isosurface.
    ///
    /// # Errors
    /// If the mesh is neither a manifold nor has an inside.
    pub fn base_mesh(
        &self,
        path: &Path,
        options: &BaseMeshOptions,
        context: &Context,
        progress: &ShownProgress,
    ) -> Result<BaseMesh, Failure> {
        let name = path.display();
        let result = match &self.manifold {
            Ok(mesh) => base_mesh_of_manifold(mesh, Some(&self.surface), options, progress),
            Err(reason) => {
                let answer = base_mesh(&self.surface, options, progress);
                if answer.is_ok() {
                    let what = "the base mesh is made from the isosurface of its winding number";
                    context.warn(&format!("{name}: {reason}; {what}"));
                }
                answer
            }
        };
        let base = result.map_err(|error| match (&error, &self.manifold) {
            (BaseMeshError::NoField | BaseMeshError::Isosurface(_), Err(reason)) => Failure::new(format!(
                "{name}: {reason}, and it encloses no volume from which a base mesh could be made"
            ))
            .try_instead("repair the mesh, or bring a base mesh with --base"),
            _ => Failure::new(format!("{name}: {error}")),
        })?;
        let report = &base.report;
        if report.components_dropped > 0 {
            let share = 100.0 * report.area_dropped;
            let parts = report.components_dropped;
            context.warn(&format!("{name}: {parts} smaller parts ({share:.1} % of the area) are left out"));
        }
        if !report.reached {
            let faces = report.faces;
            context.warn(&format!(
                "{name}: the topology needs {faces} faces, more than {} asked for",
                options.faces
            ));
        } else if report.faces_before <= options.faces && report.grid.is_none() {
            let faces = report.faces;
            let what = if faces == 1 { "face" } else { "faces" };
            context.warn(&format!("{name} has no more than {faces} {what}; all of it is the base mesh"));
        }
        Ok(base)
    }

    /// The surface as the trainer sees it.
    pub fn surface(&self) -> &dyn Surface {
        &self.surface
    }
}

/// Whether a file begins as a model does. A pipe is not looked into: what is read of it is gone.
pub fn begins_as_model(path: &Path) -> bool {
    use std::io::Read;
    if !path.is_file() {
        return false;
    }
    let mut beginning = [0; 8];
    let read = std::fs::File::open(path).and_then(|mut f| f.read_exact(&mut beginning));
    read.is_ok() && Model::is_model(&beginning)
}

/// Reads a model.
///
/// # Errors
/// If it cannot be read or is damaged.
pub fn read_model(path: &Path) -> Result<Model, Failure> {
    Model::read(path).map_err(|e| {
        let name = path.display();
        match e {
            ModelError::Io(_) => Failure::new(format!("cannot read {name}: {e}")),
            ModelError::Magic => Failure::new(format!("{name}: {e}")).try_instead("`ndf fit` makes models"),
            _ => Failure::new(format!("{name}: {e}")),
        }
    })
}

//! Base meshes of inputs.

use ndf_core::Surface;
use ndf_mesh::ManifoldMesh;
use ndf_meshing::{BaseMesh, BaseMeshError, BaseMeshOptions, base_mesh, base_mesh_of_manifold};
use serde_json::{Value, json};

use super::Input;
use crate::context::Context;
use crate::output::Failure;
use crate::progress::ShownProgress;

/// Where the base mesh of an input comes from.
pub enum BaseSource {
    /// A clean mesh, which is decimated.
    Manifold(ManifoldMesh),
    /// The isosurface of a field.
    Isosurface {
        /// The surface with that field, where it is not the input's surface itself.
        scaffold: Option<Box<dyn Surface>>,
        /// Why a mesh cannot be decimated instead, where the input is one.
        reason: Option<String>,
    },
}

/// The base mesh of a training run.
pub struct Base {
    /// The mesh, in the input's units.
    pub mesh: ManifoldMesh,
    /// How it came about, for the JSON of `fit`; null where it was brought.
    pub report: Value,
    /// The same in words.
    pub remark: Option<String>,
}

impl Input {
    /// The surface whose scalar field gives isosurfaces, if the input has one.
    pub fn field_surface(&self) -> Option<&dyn Surface> {
        let surface = match &self.base {
            BaseSource::Isosurface { scaffold: Some(scaffold), .. } => &**scaffold,
            _ => &*self.surface,
        };
        surface.as_field().map(|_| surface)
    }

    /// A base mesh of the surface: decimated from a clean mesh, or else from an isosurface. What was left out is
    /// told as warnings.
    ///
    /// # Errors
    /// If there is neither.
    pub fn base_mesh(
        &self,
        name: &str,
        options: &BaseMeshOptions,
        context: &Context,
        progress: &ShownProgress,
    ) -> Result<Base, Failure> {
        let made = match &self.base {
            BaseSource::Manifold(mesh) => {
                base_mesh_of_manifold(mesh, Some(&*self.surface), options, progress)
            }
            BaseSource::Isosurface { .. } => match self.field_surface() {
                Some(surface) => base_mesh(surface, options, progress),
                None => Err(BaseMeshError::NoField),
            },
        };
        let BaseMesh { mesh, report } = made.map_err(|error| self.without_base(name, &error))?;
        if let BaseSource::Isosurface { reason: Some(reason), .. } = &self.base {
            let what = "the base mesh is made from the isosurface of its winding number";
            context.warn(&format!("{name}: {reason}; {what}"));
        }
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
        let seconds = &report.seconds;
        let json = json!({
            "from": if report.grid.is_some() { "isosurface" } else { "mesh" },
            "grid": report.grid,
            "evaluations": report.evaluations,
            "components_dropped": report.components_dropped,
            "area_dropped": report.area_dropped,
            "euler_characteristic": report.euler_characteristic,
            "boundary_edges": report.boundary_edges,
            "seconds": seconds.isosurface + seconds.decimation + seconds.final_pass,
        });
        let remark = report.grid.map(|_| {
            let rim = match report.boundary_edges {
                0 => "closed: the field spans holes of the input".to_owned(),
                edges => format!("open, with {edges} boundary edges"),
            };
            format!(
                "largest component of the isosurface, Euler characteristic {}, {rim}",
                report.euler_characteristic
            )
        });
        Ok(Base { mesh, report: json, remark })
    }

    fn without_base(&self, name: &str, error: &BaseMeshError) -> Failure {
        if !matches!(error, BaseMeshError::NoField | BaseMeshError::Isosurface(_)) {
            return Failure::new(format!("{name}: {error}"));
        }
        // Other commands come here, too.
        match &self.base {
            BaseSource::Isosurface { reason: Some(reason), .. } => Failure::new(format!(
                "{name}: {reason}, and it encloses no volume from which a base mesh could be made"
            ))
            .try_instead("repair the mesh, or bring a base mesh of your own: `ndf fit --base`"),
            _ => Failure::new(format!("{name}: {error}"))
                .try_instead("bring a base mesh of your own: `ndf fit --base`"),
        }
    }
}

//! Triangle meshes of any quality.

use std::path::Path;

use ndf_core::{Progress, Surface};
use ndf_mesh::io::{MeshFile, ReadError, parse_mesh};
use ndf_mesh::{TriangleMesh, repair};
use ndf_surfaces::MeshSurface;

use super::{Content, OpenError, OpenOptions, Representation};
use crate::describe::{Described, Description, MeshDescription};
use crate::kind::Kind;
use crate::note::{NotDecimated, Note};
use crate::opened::{BaseSource, Opened};
use crate::presets::LARGEST_COMPONENT;

/// Mesh files.
pub(super) struct Meshes;

impl Representation for Meshes {
    fn kinds(&self) -> &'static [Kind] {
        &[Kind::Mesh]
    }

    fn open(&self, content: &Content, options: &OpenOptions, _: &dyn Progress) -> Result<Opened, OpenError> {
        let MeshFile { mesh, notes, .. } = parse(content, options)?;
        let mut opened = opened(mesh, &content.name())?;
        opened.notes.splice(0..0, notes.into_iter().map(Note::from));
        Ok(opened)
    }

    fn describe(&self, content: &Content, options: &OpenOptions) -> Result<Described, OpenError> {
        let file = parse(content, options)?;
        let notes = file.notes.iter().copied().map(Note::from).collect();
        Ok(Described { description: Description::Mesh(MeshDescription::of(&file)), notes })
    }
}

fn parse(content: &Content, options: &OpenOptions) -> Result<MeshFile, OpenError> {
    parse_mesh(&content.bytes, &content.path).map_err(|error| match error {
        // Files of no known kind come here, too, and need not be meshes.
        ReadError::Unrecognised { reason, .. } if options.kind.is_none() => {
            OpenError::Unrecognised { name: content.name(), reason: by_name(&content.path).unwrap_or(reason) }
        }
        error => OpenError::MeshFile(error),
    })
}

/// What is to be said of a file of no known format by its name alone: these formats have no magic number.
fn by_name(path: &Path) -> Option<&'static str> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "ksplat" => Some("it is named as packed splats of GaussianSplats3D; convert it to .ply or .splat"),
        "onnx" => Some("it is named as a network of ONNX; save its weights as .pth or .safetensors"),
        "pkl" | "pickle" => {
            Some("it is named as a pickle; save its arrays as .npz, or its network with torch.save")
        }
        "3ds" | "max" | "igs" | "iges" | "dxf" | "dwg" => {
            Some("it is named as a scene or drawing; export it as OBJ, PLY or STL")
        }
        _ => None,
    }
}

/// A mesh as a surface: repaired to a manifold, or, where that cannot be, the boundary of what its winding number encloses.
pub(super) fn opened(mesh: TriangleMesh, name: &str) -> Result<Opened, OpenError> {
    let name = || name.to_owned();
    if mesh.face_count() == 0 {
        return Err(OpenError::NoFaces { name: name(), vertices: mesh.vertex_count() });
    }
    if let Some(vertex) = mesh.beyond_reach() {
        return Err(OpenError::TooFar { name: name(), vertex });
    }
    let cleaned = repair::without_unusable_faces(&mesh);
    if cleaned.area() == 0.0 {
        return Err(OpenError::NoArea { name: name() });
    }
    let mut notes = Vec::new();
    let (surface, base) = match repair::repaired(&mesh) {
        // Where no component has most of the area, the mesh means the union of its pieces.
        Ok(repaired) if repaired.kept_area >= LARGEST_COMPONENT => {
            notes.extend(repaired.notes.into_iter().map(Note::from));
            (MeshSurface::new(&repaired.mesh), BaseSource::Manifold(repaired.mesh))
        }
        other => {
            let reason = match other {
                Ok(repaired) => NotDecimated::InPieces { largest: repaired.kept_area },
                Err(defects) => defects.into(),
            };
            let base = BaseSource::Isosurface { scaffold: None, reason: Some(reason) };
            (MeshSurface::new(&repair::oriented(&cleaned)), base)
        }
    };
    let surface: Box<dyn Surface> =
        Box::new(surface.map_err(|source| OpenError::EmptyMesh { name: name(), source })?);
    Ok(Opened { base, mesh: Some(mesh), notes, ..Opened::from_surface(surface, Kind::Mesh) })
}

//! Triangle meshes of any quality.

use ndf_core::Surface;
use ndf_mesh::io::{MeshFile, ReadError, parse_mesh, ply_elements, sniff};
use ndf_mesh::repair;
use ndf_surfaces::MeshSurface;

use super::{BaseSource, Content, Family, Input, Kind, Reading};
use crate::commands::info;
use crate::context::Context;
use crate::output::{Failure, Outcome};

/// The share of the area that one component must have to stand for the whole mesh.
const LARGEST_COMPONENT: f64 = 0.5;

/// What can be read, for files that nobody recognises.
const KINDS: &str = "known are meshes from OBJ, PLY, STL and OFF, clouds from PLY, XYZ, PWN, PTS, PCD, E57, LAS and LAZ, \
                     networks from PyTorch, safetensors, NumPy, HDF5 and MessagePack, splats from PLY, SPZ and .splat";

/// Mesh files.
pub(super) const FAMILY: Family = Family { kinds: &[Kind::Mesh], recognises, open, describe };

/// Whether a file is of a mesh format. PLY counts if it announces faces.
fn recognises(content: &Content) -> bool {
    match ply_elements(&content.bytes) {
        Some(elements) => {
            elements.iter().any(|e| e.count > 0 && matches!(e.name.as_str(), "face" | "tristrips"))
        }
        None => sniff(&content.bytes).is_some(),
    }
}

fn describe(content: &Content, reading: &Reading, context: &Context) -> Result<Outcome, Failure> {
    let name = content.name();
    let file = parse(content, reading, context)?;
    Ok(info::describe_mesh(&name, &file))
}

fn parse(content: &Content, reading: &Reading, context: &Context) -> Result<MeshFile, Failure> {
    let file = parse_mesh(&content.bytes, &content.path).map_err(|error| match error {
        // What nobody recognises comes here, too, and need not have been meant for a mesh.
        ReadError::Unrecognised { reason, .. } if reading.kind.is_none() => {
            Failure::new(format!("{} is of no known kind: {reason}", content.name())).try_instead(KINDS)
        }
        _ => Failure::from(error),
    })?;
    file.notes.iter().for_each(|note| context.warn(&format!("{}: {note}", content.name())));
    Ok(file)
}

fn open(content: &Content, reading: &Reading, context: &Context) -> Result<Input, Failure> {
    let name = content.name();
    let file = parse(content, reading, context)?;
    if file.mesh.face_count() == 0 {
        let what =
            if file.mesh.vertex_count() > 0 { "is a point set without faces" } else { "is an empty mesh" };
        let failure = Failure::new(format!("{name} {what}"));
        return Err(failure.try_instead("a mesh with at least one face is needed here"));
    }
    let cleaned = repair::without_unusable_faces(&file.mesh);
    if cleaned.area() == 0.0 {
        return Err(Failure::new(format!("{name}: all faces are without area, or not finite")));
    }
    let (surface, base) = match repair::mended(&file.mesh) {
        // Where no component has most of the area, the mesh means the union of its pieces.
        Ok(mended) if mended.kept_area >= LARGEST_COMPONENT => {
            mended.notes.iter().for_each(|note| context.warn(&format!("{name}: {note}")));
            (MeshSurface::new(&mended.mesh), BaseSource::Manifold(mended.mesh))
        }
        other => {
            let reason = match other {
                Ok(mended) => {
                    format!("it is in pieces, the largest with {:.0} % of the area", 100.0 * mended.kept_area)
                }
                Err(reason) => reason.to_string(),
            };
            let base = BaseSource::Isosurface { scaffold: None, reason: Some(reason) };
            (MeshSurface::new(&repair::oriented(&cleaned)), base)
        }
    };
    let surface: Box<dyn Surface> = Box::new(surface.map_err(|e| Failure::new(format!("{name}: {e}")))?);
    Ok(Input { kind: Kind::Mesh, surface, base, mesh: Some(file.mesh), level: None, cached: None })
}

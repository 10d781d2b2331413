//! Connectivity of a manifold mesh in a few bits a vertex: the mesh is visited face by face, and at every step
//! the coder says what lies across the *gate*, an edge between visited faces and those to come.
//!
//! This is the cut-border machine of Gumhold & Straßer (1998) with the order of Touma & Gotsman (1998): faces around
//! one vertex, the *pivot*, are visited before its neighbour's. Whether a face closes the fan around the pivot is
//! coded in the light of how many faces it has already, which costs as much as coding the valences of the vertices.
//! What needs offsets, fronts that meet themselves (genus 0: a few, by chance) or one another (handles), is rare in this
//! order. Edges of the boundary are told when they become gates.
//!
//! Encoder and decoder are one machine; only where it takes its steps from differs.

mod machine;
mod order;
#[cfg(test)]
mod tests;
mod writing;

pub use self::order::BaseOrder;

use self::machine::{Guide, Machine, Step};
use self::writing::Writing;
use super::range_coder::Coder;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::io::FileDefect;

/// More faces than any base mesh has; so much may be allocated before a hostile file is found out.
const MAX_FACES: usize = 1 << 21;

pub(super) fn too_many_faces() -> FileDefect {
    FileDefect::truncated("it announces more faces than its bytes can hold")
}

/// Steps are read; there is nothing to know.
struct Reading;

impl Guide for Reading {
    fn begin(&mut self) {}

    fn across(&mut self, _: &Machine, _: u32) -> Step {
        Step::Border
    }
}

/// Writes the connectivity of a mesh; the order in which it will be read. `None` for meshes beyond what will be read.
///
/// Deterministic, and the order of what has been read is the identity.
pub(super) fn encode(coder: &mut impl Coder, mesh: &ManifoldMesh) -> Option<BaseOrder> {
    if mesh.face_count() > MAX_FACES {
        return None;
    }
    let mut writing = Writing::new(mesh);
    Machine::new().run(coder, &mut writing, mesh.face_count()).ok()?;
    Some(writing.order)
}

/// Faces of a mesh of `face_count` faces, and how many vertices it has. Whether it is a manifold is still to be seen.
///
/// # Errors
/// If the stream ends early or does not make sense. O(faces) memory, of the faces that are really there.
pub(super) fn decode(
    coder: &mut impl Coder,
    face_count: usize,
) -> Result<(Vec<[u32; 3]>, usize), FileDefect> {
    if face_count > MAX_FACES {
        return Err(FileDefect::too_large(format!(
            "it announces {face_count} faces; at most {MAX_FACES} are read"
        )));
    }
    let mut machine = Machine::new();
    machine.run(coder, &mut Reading, face_count).map_err(|text| match coder.is_exhausted() {
        true => FileDefect::truncated(text),
        false => FileDefect::value(text),
    })?;
    Ok((machine.faces, machine.degrees.len()))
}

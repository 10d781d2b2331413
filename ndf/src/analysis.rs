//! Points of surfaces, and modes as scalars.

use ndf_core::{DVec3, Hint};
use ndf_mesh::io::VertexScalars;
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleTree};
use ndf_spectral::Modes;

/// Points this near to a vertex or edge, in barycentric coordinates, are taken to be on it.
pub(crate) const SNAP: f64 = 1e-9;

/// The surface's point closest to a position, on a vertex or an edge if it is next to it; `None` if the surface has no
/// faces, or the position is not finite. O(log n).
pub fn closest_point(mesh: &ManifoldMesh, tree: &TriangleTree, position: DVec3) -> Option<SurfacePoint> {
    let foot = tree.closest_point(position, Hint::NONE)?;
    Some(SurfacePoint::snapped(mesh, foot.at, SNAP))
}

/// Modes as scalars `mode_00`, `mode_01`, …
pub fn mode_scalars(modes: &Modes) -> Vec<VertexScalars> {
    let scalar = |k: usize| VertexScalars {
        name: format!("mode_{k:02}"),
        values: modes.mode(k).iter().map(|&x| x as f32).collect(),
    };
    (0..modes.len()).map(scalar).collect()
}

//! An order of faces in which neighbours in space are near each other: what is near in memory costs less to reach.

use ndf_core::{BoundingBox, DVec3};
use rayon::prelude::*;

use crate::intrinsic_mesh::IntrinsicMesh;
use ndf_mesh::{Face, Z_CURVE_DIGITS, z_curve_place};

/// Faces along a curve that fills space.
pub(super) fn curve_order(mesh: &IntrinsicMesh, points: &[DVec3]) -> Vec<Face> {
    let bounds = BoundingBox::of_points(points);
    let mut order: Vec<(u64, Face)> = mesh
        .par_faces()
        .map(|f| {
            let corners = mesh.face_vertices(f).map(|v| points[v.index()]);
            (place((corners.iter().sum::<DVec3>() / 3.0 - bounds.min) / bounds.diagonal()), f)
        })
        .collect();
    order.par_sort_unstable();
    order.into_iter().map(|(_, f)| f).collect()
}

/// Where a point of the unit cube lies along the curve.
fn place(p: DVec3) -> u64 {
    z_curve_place(p.to_array().map(|x| (x.clamp(0.0, 1.0) * f64::from((1_u32 << Z_CURVE_DIGITS) - 1)) as u64))
}

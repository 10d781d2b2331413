//! An order of faces in which neighbours in space are near each other: what is near in memory costs less to reach.

use ndf_core::{BoundingBox, DVec3};
use rayon::prelude::*;

use crate::intrinsic_mesh::IntrinsicMesh;
use ndf_mesh::Face;

/// Faces along a curve that fills space.
pub(super) fn curve_order(mesh: &IntrinsicMesh, points: &[DVec3]) -> Vec<Face> {
    let bounds = BoundingBox::of_points(points);
    let mut order: Vec<(u64, Face)> = mesh
        .par_faces()
        .map(|f| {
            let corners = mesh.face_vertices(f).map(|v| points[v.index()]);
            (morton((corners.iter().sum::<DVec3>() / 3.0 - bounds.min) / bounds.diagonal()), f)
        })
        .collect();
    order.par_sort_unstable();
    order.into_iter().map(|(_, f)| f).collect()
}

/// Where a point of the unit cube lies along the Z curve (Morton 1966), to 21 binary digits an axis.
fn morton(p: DVec3) -> u64 {
    let digits = p.to_array().map(|x| (x.clamp(0.0, 1.0) * f64::from((1_u32 << 21) - 1)) as u64);
    // Digits are spread to every third place by halves, quarters and so on.
    let spread = |x: u64| {
        [(32, 0x001f_0000_0000_ffff), (16, 0x001f_0000_ff00_00ff), (8, 0x100f_00f0_0f00_f00f)]
            .into_iter()
            .chain([(4, 0x10c3_0c30_c30c_30c3), (2, 0x1249_2492_4924_9249)])
            .fold(x, |x, (shift, mask)| (x | x << shift) & mask)
    };
    spread(digits[0]) | spread(digits[1]) << 1 | spread(digits[2]) << 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_interleaved() {
        let unit = f64::from((1_u32 << 21) - 1);
        for [x, y, z] in [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0x1a_5b3c, 0x0f_0f0f, 0x15_5555]] {
            let code = morton((DVec3::new(f64::from(x), f64::from(y), f64::from(z)) + 0.25) / unit);
            let digit = |n: u32, bit: u32| u64::from(n >> bit & 1);
            let expected = (0..21).fold(0, |code, bit| {
                code | (digit(x, bit) | digit(y, bit) << 1 | digit(z, bit) << 2) << (3 * bit)
            });
            assert_eq!(code, expected, "{x:x} {y:x} {z:x}");
        }
    }
}

//! Eigenvectors of symmetric matrices of three rows.

use ndf_core::DVec3;

/// Rounds of rotations; the off-diagonal part falls quadratically.
const ROUNDS: usize = 12;

/// Eigenvalues in ascending order and their unit eigenvectors, of the symmetric matrix with these columns (Jacobi
/// 1846).
pub(super) fn symmetric_eigen(columns: [DVec3; 3]) -> ([f64; 3], [DVec3; 3]) {
    let mut a = columns.map(|c| c.to_array());
    let mut v = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..ROUNDS {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            // The rotation by which a[p][q] vanishes; the smaller of the two angles.
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for k in 0..3 {
                let (x, y) = (a[k][p], a[k][q]);
                (a[k][p], a[k][q]) = (c * x - s * y, s * x + c * y);
            }
            for k in 0..3 {
                let (x, y) = (a[p][k], a[q][k]);
                (a[p][k], a[q][k]) = (c * x - s * y, s * x + c * y);
            }
            for row in &mut v {
                let (x, y) = (row[p], row[q]);
                (row[p], row[q]) = (c * x - s * y, s * x + c * y);
            }
        }
    }
    let mut order = [0, 1, 2];
    order.sort_by(|&i, &j| a[i][i].total_cmp(&a[j][j]));
    (order.map(|i| a[i][i]), order.map(|i| DVec3::new(v[0][i], v[1][i], v[2][i])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_and_values_belong_together() {
        let mut x = 0.3_f64;
        let mut next = || {
            x = (x * 997.0 + 0.123).fract();
            x - 0.5
        };
        for _ in 0..200 {
            let (a, b, c, d, e, f) = (next(), next(), next(), next(), next(), next());
            let columns = [DVec3::new(a, d, e), DVec3::new(d, b, f), DVec3::new(e, f, c)];
            let (values, vectors) = symmetric_eigen(columns);
            assert!(values[0] <= values[1] && values[1] <= values[2]);
            for (value, v) in values.into_iter().zip(vectors) {
                let image = columns[0] * v.x + columns[1] * v.y + columns[2] * v.z;
                assert!((image - value * v).length() < 1e-12 && (v.length() - 1.0).abs() < 1e-12);
            }
        }
        let (values, vectors) = symmetric_eigen([DVec3::ZERO; 3]);
        assert_eq!(values, [0.0; 3]);
        assert!(vectors.iter().all(|v| v.length() == 1.0));
    }
}

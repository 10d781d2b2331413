//! Orthonormal bases in the inner product of a mass matrix.

use faer::linalg::triangular_inverse::invert_upper_triangular;
use faer::{Mat, Par};

use crate::csr::CsrMatrix;
use crate::dense;
use crate::panel::{Panel, products_through, transform};

/// Makes the first `count` functions orthonormal, `W = Q R`, and returns the upper triangle R; `None` where they are
/// dependent to half the digits. Cholesky QR, repeated where angles are small (Yamamoto, Nakatsukasa, Yanagisawa and
/// Fukaya 2015).
pub(crate) fn orthonormalise(mass: &CsrMatrix, functions: &mut Vec<Panel>, count: usize) -> Option<Mat<f64>> {
    let mut triangle = Mat::identity(count, count);
    for pass in 0..2 {
        let gram = products_through(mass, functions, functions);
        let norms: Vec<f64> = (0..count).map(|i| gram[(i, i)].sqrt()).collect();
        // With unit columns the pivots are sines of angles, whatever the lengths.
        let mut factor = Mat::from_fn(count, count, |i, j| gram[(i, j)] / (norms[i] * norms[j]));
        dense::cholesky(&mut factor)?;
        let smallest = (0..count).map(|i| factor[(i, i)]).fold(1.0, f64::min);
        if pass == 0 && smallest <= 1e-6 {
            return None;
        }
        let upper = Mat::from_fn(count, count, |i, j| if i <= j { factor[(j, i)] * norms[j] } else { 0.0 });
        let mut inverse = Mat::zeros(count, count);
        invert_upper_triangular(inverse.as_mut(), upper.as_ref(), Par::Seq);
        transform(functions, &inverse);
        triangle = dense::product(&upper, triangle.as_ref());
        // The error is that of rounding divided by the square of the smallest sine.
        if smallest > 0.1 {
            break;
        }
    }
    Some(triangle)
}

/// Numbers in [-1, 1) that are the same in every run (SplitMix64; Steele, Lea and Flood 2014).
#[derive(Default)]
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

//! Positional encoding: `(sin, cos)(2ᵏ π x)` of every coordinate for k = 0 … octaves − 1
//! (Mildenhall et al. 2020, eq. 4).

use pulp::Simd;

/// Most octaves a point is encoded with: beyond, single precision has nothing left to tell.
pub const MAX_OCTAVES: usize = 20;

/// Sine and cosine of `π t`, to about 3e-7. Range reduction is exact in `f32`.
#[inline(always)]
pub(crate) fn sin_cos_pi<S: Simd>(simd: S, t: S::f32s) -> (S::f32s, S::f32s) {
    // 1.5·2²³: adding and subtracting it rounds to the nearest integer for |t| < 2²².
    let round = simd.splat_f32s(12_582_912.0);
    let rounded = |x| simd.sub_f32s(simd.add_f32s(x, round), round);
    let half_turns = rounded(t);
    let pairs = rounded(simd.mul_f32s(simd.splat_f32s(0.5), half_turns));
    let is_odd = simd.mul_add_e_f32s(simd.splat_f32s(-2.0), pairs, half_turns); // -1, 0 or 1
    let one = simd.splat_f32s(1.0);
    let sign = simd.mul_add_e_f32s(simd.mul_f32s(simd.splat_f32s(-2.0), is_odd), is_odd, one);
    let r = simd.sub_f32s(t, half_turns); // in [-1/2, 1/2]
    let r2 = simd.mul_f32s(r, r);
    let polynomial = |coefficients: &[f32]| {
        let (last, others) = coefficients.split_last().expect("a polynomial has a coefficient");
        let horner = |sum, &c: &f32| simd.mul_add_e_f32s(sum, r2, simd.splat_f32s(c));
        others.iter().rev().fold(simd.splat_f32s(*last), horner)
    };
    // Through Chebyshev nodes; the error is below 1e-10.
    let s = polynomial(&[
        std::f32::consts::PI,
        -5.167_712_8,
        2.550_163_3,
        -0.599_252_2,
        0.082_050_35,
        -0.007_028_304,
    ]);
    let c = polynomial(&[
        1.0,
        -4.934_802,
        4.058_712,
        -1.335_262_3,
        0.235_325_44,
        -0.025_776_316,
        0.001_839_989_4,
    ]);
    (simd.mul_f32s(simd.mul_f32s(sign, r), s), simd.mul_f32s(sign, c))
}

/// Width of the encoding of a point.
pub const fn width(octaves: usize) -> usize {
    6 * octaves
}

/// Writes the encoding of `x`: the sines of all octaves, three an octave, then their cosines.
///
/// # Panics
/// If there are more than [`MAX_OCTAVES`].
#[doc(hidden)]
#[inline(always)]
pub fn encode<S: Simd>(simd: S, x: [f32; 3], octaves: usize, row: &mut [f32]) {
    let width = row.len();
    encode_rows(simd, &[x], octaves, row, width);
}

/// [`encode`] for many points: point i goes to `rows[i stride ..]`.
#[doc(hidden)]
#[inline(always)]
pub fn encode_rows<S: Simd>(simd: S, points: &[[f32; 3]], octaves: usize, rows: &mut [f32], stride: usize) {
    /// Points at a time: what is stored in small pieces must have reached the cache before whole vectors are loaded.
    const GROUP: usize = 8;
    const ROOM: usize = GROUP * (3 * MAX_OCTAVES).next_multiple_of(super::LANES);
    let angles = 3 * octaves;
    if angles == 0 {
        return;
    }
    let padded = super::padded(angles);
    let (mut sines, mut cosines) = ([0.0; ROOM], [0.0; ROOM]);
    for (points, rows) in points.chunks(GROUP).zip(rows.chunks_mut(GROUP * stride)) {
        for (x, angles) in points.iter().zip(sines.chunks_exact_mut(padded)) {
            let mut scaled = *x;
            for angles in angles[..3 * octaves].as_chunks_mut::<3>().0 {
                *angles = scaled;
                scaled = [2.0 * scaled[0], 2.0 * scaled[1], 2.0 * scaled[2]];
            }
        }
        let (sine_vectors, _) = S::as_mut_simd_f32s(&mut sines[..points.len() * padded]);
        let (cosine_vectors, _) = S::as_mut_simd_f32s(&mut cosines[..points.len() * padded]);
        for (sine, cosine) in sine_vectors.iter_mut().zip(cosine_vectors) {
            (*sine, *cosine) = sin_cos_pi(simd, *sine);
        }
        let values = sines.chunks_exact(padded).zip(cosines.chunks_exact(padded));
        for (row, (sines, cosines)) in rows.chunks_mut(stride).zip(values).take(points.len()) {
            let (to_sines, to_cosines) = row[..2 * angles].split_at_mut(angles);
            copy_row(to_sines, sines);
            copy_row(to_cosines, cosines);
        }
    }
}

/// Copies the beginning of `from`, short rows without a call.
#[inline(always)]
fn copy_row(to: &mut [f32], from: &[f32]) {
    let from = &from[..to.len()];
    let (to, to_rest) = to.as_chunks_mut::<8>();
    let (from, from_rest) = from.as_chunks::<8>();
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
    to_rest.iter_mut().zip(from_rest).for_each(|(to, from)| *to = *from);
}

/// The derivative of the encoding, whose values are in `row`, in the direction `dx`.
#[doc(hidden)]
#[inline(always)]
pub fn encode_tangent(row: &[f32], dx: [f32; 3], octaves: usize, tangent: &mut [f32]) {
    let (sines, cosines) = row[..width(octaves)].split_at(3 * octaves);
    let (dsines, dcosines) = tangent[..width(octaves)].split_at_mut(3 * octaves);
    let mut frequency = std::f32::consts::PI;
    for k in (0..3 * octaves).step_by(3) {
        for c in 0..3 {
            dsines[k + c] = frequency * cosines[k + c] * dx[c];
            dcosines[k + c] = -frequency * sines[k + c] * dx[c];
        }
        frequency *= 2.0;
    }
}

/// The gradient by `x` of a function whose gradient by the encoding is `gradient`.
#[doc(hidden)]
#[inline(always)]
pub fn encode_backward(row: &[f32], gradient: &[f32], octaves: usize) -> [f32; 3] {
    let (sines, cosines) = row[..width(octaves)].split_at(3 * octaves);
    let (by_sines, by_cosines) = gradient[..width(octaves)].split_at(3 * octaves);
    let mut products = [0.0; 3 * MAX_OCTAVES];
    let derivatives = cosines.iter().zip(by_sines).zip(sines.iter().zip(by_cosines));
    for (product, ((cos, by_sin), (sin, by_cos))) in products.iter_mut().zip(derivatives) {
        *product = cos * by_sin - sin * by_cos;
    }
    let mut frequency = std::f32::consts::PI;
    let mut dx = [0.0; 3];
    for octave in products[..3 * octaves].as_chunks::<3>().0 {
        for c in 0..3 {
            dx[c] += frequency * octave[c];
        }
        frequency *= 2.0;
    }
    dx
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_and_cosine_are_accurate() {
        for i in -40_000..40_000 {
            let t = i as f32 * 0.007_31;
            let (s, c) = sin_cos_pi(pulp::Scalar::new(), t);
            let (ts, tc) = (std::f64::consts::PI * f64::from(t)).sin_cos();
            assert!(
                (f64::from(s) - ts).abs() < 4e-7 && (f64::from(c) - tc).abs() < 4e-7,
                "{t}: {s} {ts} {c} {tc}"
            );
        }
    }

    #[test]
    fn derivatives_agree_with_each_other_and_with_differences() {
        let (x, dx) = ([0.3, -1.2, 0.71], [0.4, 0.2, -0.9]);
        let octaves = 5;
        let mut row = vec![0.0; width(octaves)];
        let (mut tangent, mut up, mut down) = (row.clone(), row.clone(), row.clone());
        let simd = pulp::Scalar::new();
        encode(simd, x, octaves, &mut row);
        encode_tangent(&row, dx, octaves, &mut tangent);
        let h = 1e-4;
        encode(simd, [0, 1, 2].map(|c| x[c] + h * dx[c]), octaves, &mut up);
        encode(simd, [0, 1, 2].map(|c| x[c] - h * dx[c]), octaves, &mut down);
        for i in 0..row.len() {
            assert!((tangent[i] - (up[i] - down[i]) / (2.0 * h)).abs() < 2e-2, "{i}");
        }
        let gradient: Vec<f32> = (0..row.len()).map(|i| (i as f32 * 0.37).sin()).collect();
        let back = encode_backward(&row, &gradient, octaves);
        let a: f32 = tangent.iter().zip(&gradient).map(|(t, g)| t * g).sum();
        let b: f32 = back.iter().zip(dx).map(|(g, d)| g * d).sum();
        assert!((a - b).abs() < 1e-4 * a.abs().max(1.0));
    }
}

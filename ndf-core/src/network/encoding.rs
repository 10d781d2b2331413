//! Positional encoding: `(sin, cos)(2ᵏ π x)` of every coordinate for k = 0 … octaves − 1
//! (Mildenhall et al. 2020, eq. 4).

/// Sine and cosine of `π t`, to about 2e-7, without branches. Range reduction is exact in `f32`.
#[inline(always)]
pub fn sin_cos_pi(t: f32) -> (f32, f32) {
    // 1.5·2²³: adding and subtracting it rounds to the nearest integer for |t| < 2²².
    const ROUND: f32 = 12_582_912.0;
    let shifted = t * 2.0 + ROUND;
    let quarter = shifted - ROUND;
    let r = t - 0.5 * quarter; // in [-1/4, 1/4]
    let r2 = r * r;
    // Taylor coefficients of sin(πr) and cos(πr); the first term left out is below 1e-8 on [-1/4, 1/4].
    let s = r
        * (std::f32::consts::PI
            + r2 * (-5.167_713 + r2 * (2.550_164 + r2 * (-0.599_264_5 + r2 * 0.082_145_89))));
    let c = 1.0
        + r2 * (-4.934_802
            + r2 * (4.058_712 + r2 * (-1.335_262_8 + r2 * (0.235_330_63 - r2 * 0.025_806_89))));
    // Which quarter turn: the low bits of the shifted mantissa.
    let turns = shifted.to_bits();
    let swap = turns & 1 == 1;
    let (sin, cos) = if swap { (c, s) } else { (s, c) };
    let sin_sign = (turns & 2) << 30;
    let cos_sign = (turns.wrapping_add(1) & 2) << 30;
    (f32::from_bits(sin.to_bits() ^ sin_sign), f32::from_bits(cos.to_bits() ^ cos_sign))
}

/// Width of the encoding of a point.
pub const fn width(octaves: usize) -> usize {
    6 * octaves
}

/// Writes the encoding of `x`: the sines of all octaves, three an octave, then their cosines.
#[inline(always)]
pub fn encode(x: [f32; 3], octaves: usize, row: &mut [f32]) {
    let (sines, cosines) = row[..width(octaves)].split_at_mut(3 * octaves);
    let mut frequency = 1.0;
    for angles in sines.chunks_exact_mut(3) {
        for c in 0..3 {
            angles[c] = frequency * x[c];
        }
        frequency *= 2.0;
    }
    // In blocks of constant size, which become whole vectors.
    let (sine_blocks, sine_rest) = sines.as_chunks_mut::<8>();
    let (cosine_blocks, cosine_rest) = cosines.as_chunks_mut::<8>();
    for (sines, cosines) in sine_blocks.iter_mut().zip(cosine_blocks) {
        for k in 0..8 {
            (sines[k], cosines[k]) = sin_cos_pi(sines[k]);
        }
    }
    for (sine, cosine) in sine_rest.iter_mut().zip(cosine_rest) {
        (*sine, *cosine) = sin_cos_pi(*sine);
    }
}

/// The derivative of the encoding, whose values are in `row`, in the direction `dx`.
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
#[inline(always)]
pub fn encode_backward(row: &[f32], gradient: &[f32], octaves: usize) -> [f32; 3] {
    let (sines, cosines) = row[..width(octaves)].split_at(3 * octaves);
    let (by_sines, by_cosines) = gradient[..width(octaves)].split_at(3 * octaves);
    let mut frequency = std::f32::consts::PI;
    let mut dx = [0.0; 3];
    for k in (0..3 * octaves).step_by(3) {
        for c in 0..3 {
            dx[c] += frequency * (cosines[k + c] * by_sines[k + c] - sines[k + c] * by_cosines[k + c]);
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
            let (s, c) = sin_cos_pi(t);
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
        encode(x, octaves, &mut row);
        encode_tangent(&row, dx, octaves, &mut tangent);
        let h = 1e-4;
        encode([0, 1, 2].map(|c| x[c] + h * dx[c]), octaves, &mut up);
        encode([0, 1, 2].map(|c| x[c] - h * dx[c]), octaves, &mut down);
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

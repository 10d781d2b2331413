//! Places along the Z curve (Morton 1966): what is near in space is mostly near along it.

/// Binary digits of a coordinate that a place is made of.
pub const Z_CURVE_DIGITS: u32 = 21;

/// The place of a point with these coordinates along the curve: their lower 21 binary digits, in turns, those of the last one
/// first.
///
/// ```
/// use ndf_mesh::z_curve_place;
///
/// assert_eq!(z_curve_place([0b11, 0b00, 0b01]), 0b001_101);
/// ```
pub fn z_curve_place(coordinates: [u64; 3]) -> u64 {
    // Digits are spread to every third place by halves, quarters and so on.
    let steps = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    let spread = |x: u64| {
        let digits = x & ((1 << Z_CURVE_DIGITS) - 1);
        steps.into_iter().fold(digits, |x, (shift, mask)| (x | (x << shift)) & mask)
    };
    let [x, y, z] = coordinates.map(spread);
    x | (y << 1) | (z << 2)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_are_interleaved() {
        let digit = |n: u64, bit: u32| (n >> bit) & 1;
        for [x, y, z] in [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0x1a_5b3c, 0x0f_0f0f, 0x15_5555], [0x1f_ffff; 3]]
        {
            let expected = (0..Z_CURVE_DIGITS).fold(0, |code, bit| {
                code | ((digit(x, bit) | (digit(y, bit) << 1) | (digit(z, bit) << 2)) << (3 * bit))
            });
            assert_eq!(z_curve_place([x, y, z]), expected, "{x:x} {y:x} {z:x}");
        }
    }
}

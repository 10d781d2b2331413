//! A bar of colours with its values, drawn beside a picture.

use ndf_mesh::ColourMap;

use super::lines::coverage;
use super::{Image, shading};
use crate::output::readable;

/// Height of a glyph in units of its grid, which is four wide.
const CAP: f64 = 6.0;

/// Width of strokes in the same units.
const STROKE: f64 = 0.72;

/// Width of the strip a legend takes of a picture of this size, in pixels; less than half of it.
pub fn strip_width(width: usize, height: usize) -> usize {
    let unit = unit(height);
    ((19.0 + 9.0 * 5.4) * unit).ceil().min(0.4 * width as f64) as usize
}

/// Size of a unit of the glyphs' grid, in pixels.
fn unit(height: usize) -> f64 {
    (height as f64 / 62.0).max(9.0) / CAP
}

/// The picture, with a legend of the map in a strip of this width at its right. Depth, normals and scalar
/// of the strip are those of the background.
#[must_use]
pub fn with_legend(image: &Image, map: &ColourMap, strip: usize) -> Image {
    let (width, height) = (image.width + strip, image.height);
    let mut wide = Image {
        width,
        height,
        colour: widened(&image.colour, image.width, strip, [0.0; 4]),
        depth: widened(&image.depth, image.width, strip, f32::INFINITY),
        normal: widened(&image.normal, image.width, strip, [0.0; 3]),
        scalar: widened(&image.scalar, image.width, strip, f32::NAN),
    };
    let unit = unit(height);
    let (top, bottom) = (0.2 * height as f64, 0.8 * height as f64);
    let (left, right) = (image.width as f64 + 2.0 * unit, image.width as f64 + 10.0 * unit);
    let (low, high) = map.range();
    let value = |y: f64| high + (low - high) * ((y - top) / (bottom - top)).clamp(0.0, 1.0);
    for y in 0..height {
        for x in image.width..width {
            let (cx, cy) = (x as f64 + 0.5, y as f64 + 0.5);
            // Distance outside the bar, whose corners are a little rounded.
            let radius = 1.2 * unit;
            let aside = (left + radius - cx).max(cx - right + radius).max(0.0);
            let above = (top + radius - cy).max(cy - bottom + radius).max(0.0);
            let [r, g, b] = map.colour(value(cy));
            blend(&mut wide.colour[y * width + x], [r, g, b], coverage(aside.hypot(above), radius));
        }
    }
    let ticks = if high > low { 5 } else { 1 };
    for k in 0..ticks {
        let share = if ticks > 1 { f64::from(k) / f64::from(ticks - 1) } else { 0.5 };
        let middle = bottom + (top - bottom) * share;
        write(
            &mut wide,
            &readable(low + (high - low) * share),
            right + 3.5 * unit,
            middle - 0.5 * CAP * unit,
            unit,
        );
    }
    wide
}

fn widened<T: Copy>(pixels: &[T], width: usize, strip: usize, background: T) -> Vec<T> {
    let row =
        |row: &[T]| row.iter().copied().chain(std::iter::repeat_n(background, strip)).collect::<Vec<T>>();
    pixels.chunks_exact(width).flat_map(row).collect()
}

/// Writes a number with its upper left corner at a place; parts beyond the picture are left out.
fn write(image: &mut Image, text: &str, mut left: f64, top: f64, unit: f64) {
    for c in text.chars() {
        let (strokes, advance) = glyph(c);
        let margin = STROKE * unit + 1.0;
        let columns =
            (left - margin).max(0.0) as usize..((left + 4.0 * unit + margin) as usize).min(image.width);
        let rows = (top - margin).max(0.0) as usize..((top + CAP * unit + margin) as usize).min(image.height);
        for y in rows {
            for x in columns.clone() {
                let p = [(x as f64 + 0.5 - left) / unit, (y as f64 + 0.5 - top) / unit];
                let distance =
                    strokes.windows(2).map(|s| distance(p, s[0], s[1])).fold(f64::INFINITY, f64::min);
                let covered = coverage(distance * unit, 0.5 * STROKE * unit);
                blend(&mut image.colour[y * image.width + x], shading::INK, 0.9 * covered);
            }
        }
        left += advance * unit;
    }
}

fn blend(pixel: &mut [f32; 4], colour: [f32; 3], share: f32) {
    let over = [colour[0], colour[1], colour[2], 1.0];
    pixel.iter_mut().zip(over).for_each(|(p, c)| *p += (c - *p) * share);
}

/// Distance of a point from a segment.
fn distance([x, y]: [f64; 2], [ax, ay]: [f64; 2], [bx, by]: [f64; 2]) -> f64 {
    let (dx, dy) = (bx - ax, by - ay);
    let t = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy).max(1e-12)).clamp(0.0, 1.0);
    (x - ax - t * dx).hypot(y - ay - t * dy)
}

/// The stroke of a character that numbers have, on a grid of 4 × 6 with y downwards, and the step to the next.
fn glyph(c: char) -> (&'static [[f64; 2]], f64) {
    const ZERO: [[f64; 2]; 9] = [
        [1.2, 0.0],
        [2.8, 0.0],
        [3.8, 1.2],
        [3.8, 4.8],
        [2.8, 6.0],
        [1.2, 6.0],
        [0.2, 4.8],
        [0.2, 1.2],
        [1.2, 0.0],
    ];
    const ONE: [[f64; 2]; 3] = [[0.6, 1.2], [2.2, 0.0], [2.2, 6.0]];
    const TWO: [[f64; 2]; 8] =
        [[0.2, 1.4], [0.5, 0.5], [1.4, 0.0], [2.7, 0.0], [3.7, 0.9], [3.6, 2.1], [0.2, 6.0], [3.9, 6.0]];
    const THREE: [[f64; 2]; 9] = [
        [0.3, 0.0],
        [3.7, 0.0],
        [1.9, 2.4],
        [2.8, 2.5],
        [3.8, 3.4],
        [3.8, 4.8],
        [2.8, 6.0],
        [1.2, 6.0],
        [0.2, 5.0],
    ];
    const FOUR: [[f64; 2]; 4] = [[3.0, 6.0], [3.0, 0.0], [0.0, 4.2], [4.1, 4.2]];
    const FIVE: [[f64; 2]; 10] = [
        [3.6, 0.0],
        [0.7, 0.0],
        [0.4, 2.7],
        [1.3, 2.2],
        [2.7, 2.2],
        [3.8, 3.3],
        [3.8, 4.8],
        [2.7, 6.0],
        [1.2, 6.0],
        [0.2, 5.1],
    ];
    const SIX: [[f64; 2]; 12] = [
        [3.4, 0.2],
        [2.3, 0.0],
        [0.9, 1.0],
        [0.2, 3.0],
        [0.2, 4.7],
        [1.2, 6.0],
        [2.8, 6.0],
        [3.8, 4.9],
        [3.8, 3.7],
        [2.8, 2.6],
        [1.3, 2.6],
        [0.2, 3.8],
    ];
    const SEVEN: [[f64; 2]; 3] = [[0.2, 0.0], [3.8, 0.0], [1.5, 6.0]];
    const EIGHT: [[f64; 2]; 16] = [
        [1.2, 2.8],
        [0.4, 2.0],
        [0.4, 0.9],
        [1.3, 0.0],
        [2.7, 0.0],
        [3.6, 0.9],
        [3.6, 2.0],
        [2.8, 2.8],
        [1.2, 2.8],
        [0.2, 3.8],
        [0.2, 5.0],
        [1.2, 6.0],
        [2.8, 6.0],
        [3.8, 5.0],
        [3.8, 3.8],
        [2.8, 2.8],
    ];
    const NINE: [[f64; 2]; 12] = [
        [0.6, 5.8],
        [1.7, 6.0],
        [3.1, 5.0],
        [3.8, 3.0],
        [3.8, 1.3],
        [2.8, 0.0],
        [1.2, 0.0],
        [0.2, 1.1],
        [0.2, 2.3],
        [1.2, 3.4],
        [2.7, 3.4],
        [3.8, 2.2],
    ];
    const E: [[f64; 2]; 9] = [
        [0.4, 4.0],
        [3.7, 4.0],
        [3.6, 3.2],
        [2.8, 2.3],
        [1.2, 2.3],
        [0.3, 3.3],
        [0.3, 4.9],
        [1.2, 6.0],
        [3.3, 5.9],
    ];
    match c {
        '0' => (&ZERO, 5.4),
        '1' => (&ONE, 4.4),
        '2' => (&TWO, 5.4),
        '3' => (&THREE, 5.4),
        '4' => (&FOUR, 5.4),
        '5' => (&FIVE, 5.4),
        '6' => (&SIX, 5.4),
        '7' => (&SEVEN, 5.4),
        '8' => (&EIGHT, 5.4),
        '9' => (&NINE, 5.4),
        'e' => (&E, 5.4),
        '-' => (&[[0.3, 3.2], [3.2, 3.2]], 4.8),
        '.' => (&[[0.4, 5.95], [0.5, 6.0]], 2.1),
        _ => (&[], 3.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_legend_is_beside_the_picture_and_only_there() {
        let n = 40 * 300;
        let image = Image {
            width: 40,
            height: 300,
            colour: vec![[0.5, 0.5, 0.5, 1.0]; n],
            depth: vec![1.0; n],
            normal: vec![[0.0, 0.0, 1.0]; n],
            scalar: vec![2.0; n],
        };
        for values in [[-1.0_f32, 1.0], [0.0, 12345.0], [3.0, 3.0], [f32::NAN, f32::INFINITY]] {
            let map = ColourMap::of(&values);
            let wide = with_legend(&image, &map, 100);
            assert_eq!(wide.width, 140);
            assert!(strip_width(400, 300) < 200 && strip_width(1, 1) == 0);
            assert_eq!(wide.colour.len(), wide.width * 300);
            for (row, before) in wide.colour.chunks_exact(wide.width).zip(image.colour.chunks_exact(40)) {
                assert_eq!(row[..40], *before);
            }
            let drawn = wide
                .colour
                .chunks_exact(wide.width)
                .flat_map(|row| &row[40..])
                .filter(|p| p[3] > 0.0)
                .count();
            assert!(drawn > 100);
        }
    }
}

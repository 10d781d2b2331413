//! Values to colours.

use colorous::Gradient;

/// Colour of values that are not finite, linear.
const NO_VALUE: [f32; 3] = [0.3, 0.3, 0.3];

/// A perceptually even scale of colours over a range of values: viridis, or, where values lie on both sides of
/// zero, blue and red with white at zero.
#[derive(Clone, Copy, Debug)]
pub struct ColourMap {
    low: f64,
    high: f64,
    is_diverging: bool,
}

/// What a colour map shows, for a legend: stops as 8-bit sRGB from the low end to the high.
#[derive(Clone, Debug, PartialEq)]
pub struct Legend {
    /// Value of the first stop.
    pub low: f64,
    /// Value of the last stop.
    pub high: f64,
    /// Colours, evenly spaced.
    pub stops: Vec<[u8; 3]>,
}

impl ColourMap {
    /// The map over the finite ones of these values. A range well to both sides of zero is made symmetric.
    pub fn of(values: &[f32]) -> Self {
        let finite = values.iter().filter(|v| v.is_finite()).map(|&v| f64::from(v));
        let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            return Self { low: 0.0, high: 0.0, is_diverging: false };
        }
        let is_diverging = low < 0.0 && high > 0.0 && low.abs().min(high) > 0.1 * low.abs().max(high);
        let greatest = high.max(-low);
        let (low, high) = if is_diverging { (-greatest, greatest) } else { (low, high) };
        Self { low, high, is_diverging }
    }

    /// Least and greatest value of the scale.
    pub fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// Linear colour of a value; grey if it is not finite.
    pub fn colour(&self, value: f64) -> [f32; 3] {
        if !value.is_finite() {
            return NO_VALUE;
        }
        let t = if self.high > self.low { (value - self.low) / (self.high - self.low) } else { 0.5 };
        // White in the middle would be lost against a white background.
        let share = if self.is_diverging { 0.82 } else { 1.0 };
        self.srgb(t).map(|x| share * linear(x))
    }

    /// Colours for a legend.
    pub fn legend(&self, stops: usize) -> Legend {
        let at =
            |i: usize| self.srgb(i as f64 / (stops.max(2) - 1) as f64).map(|x| (255.0 * x).round() as u8);
        Legend { low: self.low, high: self.high, stops: (0..stops).map(at).collect() }
    }

    /// sRGB, 0 to 1, at a position along the scale. Interpolated: 8 bits would show steps in dark shades.
    fn srgb(&self, t: f64) -> [f32; 3] {
        const STEPS: usize = 64;
        let (gradient, t): (Gradient, f64) =
            if self.is_diverging { (colorous::RED_BLUE, 1.0 - t) } else { (colorous::VIRIDIS, t) };
        let x = t.clamp(0.0, 1.0) * STEPS as f64;
        let i = (x.floor() as usize).min(STEPS - 1);
        let share = (x - i as f64) as f32;
        let colour =
            |i: usize| gradient.eval_rational(i, STEPS + 1).into_array().map(|c| f32::from(c) / 255.0);
        let (a, b) = (colour(i), colour(i + 1));
        [0, 1, 2].map(|c| a[c] + (b[c] - a[c]) * share)
    }
}

/// sRGB to linear (IEC 61966-2-1).
fn linear(x: f32) -> f32 {
    if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }
}

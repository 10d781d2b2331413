//! The functions between the layers of a network, with their first two derivatives.

use serde::{Deserialize, Serialize};

use super::encoding::sin_cos_pi;

/// What a hidden layer does to its sums.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Activation {
    /// max(x, 0).
    #[default]
    Relu,
    /// max(x, x/100): PyTorch's slope.
    LeakyRelu,
    /// x / (1 + e⁻ˣ) (Elfwing et al. 2018).
    Silu,
    /// sin x (Sitzmann et al. 2020, with the frequency left to the weights).
    Sine,
    /// tanh x.
    Tanh,
}

/// Value, slope and second derivative at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// f(x).
    pub value: f32,
    /// f′(x).
    pub slope: f32,
    /// f″(x).
    pub curvature: f32,
}

impl Activation {
    /// All of them, in the order of their codes.
    pub const ALL: [Self; 5] = [Self::Relu, Self::LeakyRelu, Self::Silu, Self::Sine, Self::Tanh];

    /// The number that stands for it in files.
    pub fn code(self) -> u8 {
        self as u8
    }

    /// The activation of a number in a file.
    pub fn from_code(code: u8) -> Option<Self> {
        Self::ALL.get(usize::from(code)).copied()
    }

    /// The slope on the negative side, where the function is linear on both. Such functions need no memory of the sums:
    /// their values tell the side.
    pub const fn negative_slope(self) -> Option<f32> {
        match self {
            Self::Relu => Some(0.0),
            Self::LeakyRelu => Some(0.01),
            Self::Silu | Self::Sine | Self::Tanh => None,
        }
    }

    /// Value and derivatives at `x`, to about 1e-6.
    #[inline(always)]
    pub fn jet(self, x: f32) -> Jet {
        match self {
            Self::Relu | Self::LeakyRelu => {
                let below = if let Self::LeakyRelu = self { 0.01 } else { 0.0 };
                let slope = if x > 0.0 { 1.0 } else { below };
                Jet { value: slope * x, slope, curvature: 0.0 }
            }
            Self::Silu => {
                let s = 1.0 / (1.0 + exponential(-x));
                let ds = s * (1.0 - s);
                Jet { value: x * s, slope: s + x * ds, curvature: ds * (2.0 + x * (1.0 - 2.0 * s)) }
            }
            Self::Sine => {
                let (sin, cos) = sin_cos_pi(pulp::Scalar::new(), x * std::f32::consts::FRAC_1_PI);
                Jet { value: sin, slope: cos, curvature: -sin }
            }
            Self::Tanh => {
                let t = 1.0 - 2.0 / (1.0 + exponential(2.0 * x));
                let slope = 1.0 - t * t;
                Jet { value: t, slope, curvature: -2.0 * t * slope }
            }
        }
    }
}

/// eˣ to about 2e-7 relative, without branches; arguments beyond ±87 are taken as ±87.
#[inline(always)]
fn exponential(x: f32) -> f32 {
    // Added and subtracted, it rounds to the nearest integer.
    const ROUND: f32 = 12_582_912.0;
    let x = x.clamp(-87.0, 87.0);
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let whole = shifted - ROUND;
    // ln 2 in two parts: the first has zeros at its end, so that its multiples are exact.
    let r = (x - whole * 0.693_359_4) + whole * 2.121_944_4e-4;
    let tail = 0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r * (1.0 / 720.0))));
    let power = f32::from_bits((shifted.to_bits().wrapping_add(127)) << 23);
    (1.0 + r + r * r * tail) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_is_accurate() {
        for i in -8_700..8_700 {
            let x = i as f32 * 0.01;
            let truth = f64::from(x).exp();
            assert!((f64::from(exponential(x)) - truth).abs() < 3e-7 * truth, "{x}");
        }
        assert!(exponential(1e9).is_finite() && exponential(-1e9) >= 0.0);
    }

    #[test]
    fn jets_agree_with_the_definitions() {
        let definition = |kind: Activation, x: f64| match kind {
            Activation::Relu => x.max(0.0),
            Activation::LeakyRelu => x.max(0.01 * x),
            Activation::Silu => x / (1.0 + (-x).exp()),
            Activation::Sine => x.sin(),
            Activation::Tanh => x.tanh(),
        };
        for kind in Activation::ALL {
            for i in -400..400 {
                let x = f64::from(i) * 0.0201 + 0.007;
                let (h, f) = (1e-4, |x| definition(kind, x));
                let jet = kind.jet(x as f32);
                let slope = (f(x + h) - f(x - h)) / (2.0 * h);
                let curvature = (f(x + h) - 2.0 * f(x) + f(x - h)) / (h * h);
                assert!((f64::from(jet.value) - f(x)).abs() < 2e-6, "{kind:?} {x}");
                assert!((f64::from(jet.slope) - slope).abs() < 2e-6, "{kind:?} {x}");
                assert!((f64::from(jet.curvature) - curvature).abs() < 1e-5, "{kind:?} {x}");
            }
        }
    }
}

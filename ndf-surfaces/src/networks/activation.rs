//! Activation functions and their derivatives on whole blocks.
//!
//! The standard library's `exp`, `ln` and `sin` work on one number at a time and would cost more than the matrix
//! products between them. These are polynomials without branches, which the compiler turns into SIMD
//! instructions of the processor at hand (dispatched by `pulp`), accurate to about 10⁻⁷.

use std::fmt;
use std::str::FromStr;

use pulp::Arch;

/// A function applied to every number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Activation {
    /// max(x, 0)
    Relu,
    /// x, or α (eˣ − 1) below 0
    Elu {
        /// α
        alpha: f32,
    },
    /// x, or a multiple of it below 0
    LeakyRelu {
        /// The slope below 0.
        slope: f32,
    },
    /// ln(1 + e^βx) / β
    Softplus {
        /// β
        beta: f32,
    },
    /// sin(ωx)
    Sine {
        /// ω
        frequency: f32,
    },
    /// cos(x)
    Cosine,
    /// tanh(x)
    Tanh,
    /// x / (1 + e^−x), also named swish
    Silu,
    /// x Φ(x), Φ the distribution function of the normal distribution
    Gelu,
}

/// A name that no activation has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "there is no activation named {0}; known are relu, leaky-relu:SLOPE, elu:ALPHA, softplus:BETA, sine:OMEGA, cosine, tanh, silu and gelu"
)]
pub struct UnknownActivation(pub String);

impl FromStr for Activation {
    type Err = UnknownActivation;

    /// A name, and after a colon its parameter, as PyTorch has it by default: `leaky-relu:0.01`, `elu:1`, `softplus:1`, `sine:30`.
    fn from_str(text: &str) -> Result<Self, UnknownActivation> {
        let unknown = || UnknownActivation(text.to_owned());
        let (name, parameter) = match text.split_once(':') {
            Some((name, number)) => {
                let number: f32 = number.parse().map_err(|_| unknown())?;
                (name, Some(number).filter(|x| x.is_finite() && *x > 0.0).ok_or_else(unknown)?.into())
            }
            None => (text, None),
        };
        let number = |default: f32| parameter.unwrap_or(default);
        match (name, parameter) {
            ("leaky-relu" | "leakyrelu", _) => Ok(Self::LeakyRelu { slope: number(0.01) }),
            ("softplus", _) => Ok(Self::Softplus { beta: number(1.0) }),
            ("sine" | "sin", _) => Ok(Self::Sine { frequency: number(30.0) }),
            ("relu", None) => Ok(Self::Relu),
            ("elu", _) => Ok(Self::Elu { alpha: number(1.0) }),
            ("cosine" | "cos", None) => Ok(Self::Cosine),
            ("tanh", None) => Ok(Self::Tanh),
            ("silu" | "swish", None) => Ok(Self::Silu),
            ("gelu", None) => Ok(Self::Gelu),
            _ => Err(unknown()),
        }
    }
}

impl fmt::Display for Activation {
    /// As [`FromStr`] reads it; the frequency of a sine is told apart.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Relu => f.write_str("relu"),
            Self::LeakyRelu { slope } => write!(f, "leaky-relu:{slope}"),
            Self::Elu { alpha: 1.0 } => f.write_str("elu"),
            Self::Elu { alpha } => write!(f, "elu:{alpha}"),
            Self::Softplus { beta } => write!(f, "softplus:{beta}"),
            Self::Sine { .. } => f.write_str("sine"),
            Self::Cosine => f.write_str("cosine"),
            Self::Tanh => f.write_str("tanh"),
            Self::Silu => f.write_str("silu"),
            Self::Gelu => f.write_str("gelu"),
        }
    }
}

impl Activation {
    /// Writes the function of every number.
    pub(super) fn apply(self, x: &[f32], y: &mut [f32]) {
        match self {
            Self::Relu => map(x, y, |x| x.max(0.0)),
            Self::LeakyRelu { slope } => map(x, y, move |x| if x > 0.0 { x } else { slope * x }),
            Self::Elu { alpha } => {
                map(x, y, move |x| if x > 0.0 { x } else { alpha * (exp_of_negative(x) - 1.0) });
            }
            Self::Softplus { beta } => {
                let scale = beta.recip();
                map(x, y, move |x| x.max(0.0) + scale * log_one_plus(exp_of_negative(-(beta * x).abs())));
            }
            Self::Sine { frequency } => map(x, y, move |x| sine(frequency * x)),
            Self::Cosine => map(x, y, cosine),
            Self::Tanh => map(x, y, tanh),
            Self::Silu => map(x, y, |x| x * sigmoid(x)),
            Self::Gelu => map(x, y, |x| x * normal_distribution(x)),
        }
    }

    /// Multiplies adjoints of the result by the derivative at every number.
    pub(super) fn pull_back(self, x: &[f32], adjoint: &mut [f32]) {
        match self {
            Self::Relu => scale(x, adjoint, |x| if x > 0.0 { 1.0 } else { 0.0 }),
            Self::LeakyRelu { slope } => scale(x, adjoint, move |x| if x > 0.0 { 1.0 } else { slope }),
            Self::Elu { alpha } => {
                scale(x, adjoint, move |x| if x > 0.0 { 1.0 } else { alpha * exp_of_negative(x) });
            }
            Self::Softplus { beta } => scale(x, adjoint, move |x| {
                let e = exp_of_negative(-(beta * x).abs());
                (if x > 0.0 { 1.0 } else { e }) / (1.0 + e)
            }),
            Self::Sine { frequency } => scale(x, adjoint, move |x| frequency * cosine(frequency * x)),
            Self::Cosine => scale(x, adjoint, |x| -sine(x)),
            Self::Tanh => scale(x, adjoint, |x| {
                let t = tanh(x);
                1.0 - t * t
            }),
            Self::Silu => scale(x, adjoint, |x| {
                let s = sigmoid(x);
                s * (1.0 + x * (1.0 - s))
            }),
            Self::Gelu => scale(x, adjoint, |x| {
                let density = exp_of_negative(-0.5 * x * x) * FRAC_1_SQRT_TAU;
                normal_distribution(x) + x * density
            }),
        }
    }
}

fn map(x: &[f32], y: &mut [f32], f: impl Fn(f32) -> f32) {
    Arch::new().dispatch(
        #[inline(always)]
        || x.iter().zip(&mut *y).for_each(|(&x, y)| *y = f(x)),
    );
}

fn scale(x: &[f32], adjoint: &mut [f32], derivative: impl Fn(f32) -> f32) {
    Arch::new().dispatch(
        #[inline(always)]
        || x.iter().zip(&mut *adjoint).for_each(|(&x, a)| *a *= derivative(x)),
    );
}

/// 1.5 · 2²³: adding it rounds to a whole number, whose low bits are then those of the sum.
const ROUND: f32 = 12_582_912.0;

/// eˣ for x ≤ 0: 2ᵏ times a polynomial on [−½ ln 2, ½ ln 2].
#[inline(always)]
fn exp_of_negative(x: f32) -> f32 {
    let x = x.max(-87.0);
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    // ln 2 in two parts, the first exact in products with k.
    let r = (x - k * 0.693_359_4) + k * 2.121_944_4e-4;
    let p = 1.0 + r * (1.0 + r * (0.5 + r * (1.0 / 6.0 + r * (1.0 / 24.0 + r * (1.0 / 120.0 + r / 720.0)))));
    p * f32::from_bits((shifted.to_bits() << 23).wrapping_add(127 << 23))
}

/// ln(1 + x) for 0 ≤ x ≤ 1: twice the area tangent of x / (2 + x).
#[inline(always)]
fn log_one_plus(x: f32) -> f32 {
    let s = x / (2.0 + x);
    let t = s * s;
    let p = 1.0 / 9.0 + t * (1.0 / 11.0 + t * (1.0 / 13.0));
    2.0 * s * (1.0 + t * (1.0 / 3.0 + t * (0.2 + t * (1.0 / 7.0 + t * p))))
}

/// sin x for |x| up to about 10⁴: a polynomial on [−π/2, π/2].
#[inline(always)]
pub(super) fn sine(x: f32) -> f32 {
    let shifted = x * std::f32::consts::FRAC_1_PI + ROUND;
    let k = shifted - ROUND;
    f32::from_bits(sine_of_small(less_pi_times(x, k)).to_bits() ^ (shifted.to_bits() << 31))
}

/// cos x for |x| up to about 10⁴.
#[inline(always)]
fn cosine(x: f32) -> f32 {
    let shifted = (x * std::f32::consts::FRAC_1_PI - 0.5) + ROUND;
    let k = shifted - ROUND;
    // cos(r + kπ + π/2) = −(−1)ᵏ sin r
    let r = less_pi_times(x, k + 0.5);
    f32::from_bits(sine_of_small(r).to_bits() ^ (shifted.to_bits() << 31) ^ (1 << 31))
}

/// x − kπ, π in three parts, of which the products with k are exact (Cody and Waite 1980).
#[inline(always)]
fn less_pi_times(x: f32, k: f32) -> f32 {
    ((x - k * 3.140_625) - k * 9.675_026e-4) - k * 1.509_958e-7
}

#[inline(always)]
fn sine_of_small(r: f32) -> f32 {
    let t = r * r;
    let p = -1.0 / 5040.0 + t * (1.0 / 362_880.0 + t * (-1.0 / 39_916_800.0));
    r * (1.0 + t * (-1.0 / 6.0 + t * (1.0 / 120.0 + t * p)))
}

/// 1 / √(2π)
const FRAC_1_SQRT_TAU: f32 = 0.398_942_3;

#[inline(always)]
fn sigmoid(x: f32) -> f32 {
    let e = exp_of_negative(-x.abs());
    (if x > 0.0 { 1.0 } else { e }) / (1.0 + e)
}

/// Φ(x), with erf of Abramowitz and Stegun (1964, 7.1.26), which is accurate to 1.5 · 10⁻⁷.
#[inline(always)]
fn normal_distribution(x: f32) -> f32 {
    let z = x.abs() * std::f32::consts::FRAC_1_SQRT_2;
    let t = 1.0 / (1.0 + 0.327_591_1 * z);
    let p = t * (0.254_829_6 + t * (-0.284_496_74 + t * (1.421_413_7 + t * (-1.453_152 + t * 1.061_405_4))));
    let rest = 0.5 * p * exp_of_negative(-z * z);
    if x > 0.0 { 1.0 - rest } else { rest }
}

#[inline(always)]
fn tanh(x: f32) -> f32 {
    let e = exp_of_negative(-2.0 * x.abs());
    ((1.0 - e) / (1.0 + e)).copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [Activation; 11] = [
        Activation::Relu,
        Activation::LeakyRelu { slope: 0.1 },
        Activation::Silu,
        Activation::Gelu,
        Activation::Elu { alpha: 1.0 },
        Activation::Elu { alpha: 0.5 },
        Activation::Softplus { beta: 100.0 },
        Activation::Softplus { beta: 1.0 },
        Activation::Sine { frequency: 30.0 },
        Activation::Cosine,
        Activation::Tanh,
    ];

    fn truth(f: Activation, x: f64) -> f64 {
        match f {
            Activation::Relu => x.max(0.0),
            Activation::LeakyRelu { slope } => x.max(0.0) + f64::from(slope) * x.min(0.0),
            Activation::Silu => x / (1.0 + (-x).exp()),
            Activation::Gelu => x * distribution(x),
            Activation::Elu { alpha } => x.max(0.0) + f64::from(alpha) * x.min(0.0).exp_m1(),
            Activation::Softplus { beta } => {
                let t = f64::from(beta) * x;
                (t.max(0.0) + (-t.abs()).exp().ln_1p()) / f64::from(beta)
            }
            // The argument as single precision has it.
            Activation::Sine { frequency } => f64::from(frequency * x as f32).sin(),
            Activation::Cosine => x.cos(),
            Activation::Tanh => x.tanh(),
        }
    }

    /// Φ by its Taylor series at 0, which ends where Φ is 0 or 1.
    fn distribution(x: f64) -> f64 {
        if x.abs() > 7.0 {
            return if x > 0.0 { 1.0 } else { 0.0 };
        }
        let (mut sum, mut term) = (x, x);
        for n in 1..200 {
            term *= x * x / f64::from(2 * n + 1);
            sum += term;
        }
        0.5 + sum * (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt()
    }

    #[test]
    fn names_lead_back_to_activations() {
        for activation in ALL {
            let name = activation.to_string();
            match (activation, name.parse()) {
                (Activation::Sine { .. }, found) => assert_eq!(found, Ok(activation)),
                (_, found) => assert_eq!(found, Ok(activation)),
            }
        }
        assert_eq!("softplus:100".parse(), Ok(Activation::Softplus { beta: 100.0 }));
        assert_eq!("sine:15".parse(), Ok(Activation::Sine { frequency: 15.0 }));
        for unknown in ["", "relu:2", "softplus:", "softplus:-1", "sine:inf", "step"] {
            assert!(unknown.parse::<Activation>().is_err(), "{unknown}");
        }
    }

    #[test]
    fn functions_agree_with_the_standard_library() {
        let x: Vec<f32> = (-4000..4000).map(|i| 0.001 * i as f32 * (1.0 + (i % 7) as f32)).collect();
        let mut y = vec![0.0; x.len()];
        for f in ALL {
            f.apply(&x, &mut y);
            for (&x, &y) in x.iter().zip(&y) {
                let expected = truth(f, f64::from(x));
                assert!(
                    (f64::from(y) - expected).abs() < 4e-7 * (1.0 + expected.abs()),
                    "{f:?} at {x}: {y}, {expected}"
                );
            }
        }
        assert!((sine(5000.0) - 5000.0_f64.sin() as f32).abs() < 1e-6);
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let x: Vec<f32> = (-300..300).map(|i| 0.00917 * i as f32 + 0.001).collect();
        for f in ALL {
            let mut adjoint = vec![2.0; x.len()];
            f.pull_back(&x, &mut adjoint);
            for (&x, &a) in x.iter().zip(&adjoint) {
                let (h, x) = (1e-6, f64::from(x));
                let smooth = |x: f64| match f {
                    Activation::Sine { frequency } => (f64::from(frequency) * x).sin(),
                    _ => truth(f, x),
                };
                let expected = 2.0 * (smooth(x + h) - smooth(x - h)) / (2.0 * h);
                // The argument of a sine is rounded.
                let allowed = if let Activation::Sine { .. } = f { 1e-3 } else { 2e-5 };
                assert!(
                    (f64::from(a) - expected).abs() < allowed * (1.0 + expected.abs()),
                    "{f:?} at {x}: {a}, {expected}"
                );
            }
        }
    }

    #[test]
    fn extremes_stay_finite_and_nan_stays_nan() {
        let x = [f32::MAX, -f32::MAX, 0.0, f32::NAN];
        let mut y = [0.0; 4];
        let is_periodic = |f: &Activation| matches!(f, Activation::Sine { .. } | Activation::Cosine);
        for f in ALL.into_iter().filter(|f| !is_periodic(f)) {
            f.apply(&x, &mut y);
            assert!(y[1].is_finite() && y[2].is_finite(), "{f:?}: {y:?}");
        }
    }
}

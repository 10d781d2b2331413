//! A small tape for reverse-mode differentiation in `f64`: for gradients of a term of the objective that nobody derives
//! by hand, and for tests of those that somebody did.
//!
//! ```
//! use ndf_train::tape::Tape;
//! let tape = Tape::default();
//! let (x, y) = (tape.variable(3.0), tape.variable(4.0));
//! let length = (x * x + y * y).sqrt();
//! let by = length.gradient();
//! assert_eq!(length.value(), 5.0);
//! assert!((by.by(x) - 0.6).abs() < 1e-15 && (by.by(y) - 0.8).abs() < 1e-15);
//! ```

use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// What was computed, in order: of every value, what it was computed from, and its derivatives by that.
#[derive(Debug, Default)]
pub struct Tape(RefCell<Vec<[(usize, f64); 2]>>);

/// A value on a tape, or a constant.
#[derive(Clone, Copy, Debug)]
pub struct Var<'t> {
    tape: Option<&'t Tape>,
    index: usize,
    value: f64,
}

/// The derivatives of a value by all on its tape.
#[derive(Clone, Debug)]
pub struct Derivatives(Vec<f64>);

impl Tape {
    /// A value by which can be differentiated.
    pub fn variable(&self, value: f64) -> Var<'_> {
        self.push(value, [(0, 0.0); 2])
    }

    fn push(&self, value: f64, from: [(usize, f64); 2]) -> Var<'_> {
        let mut steps = self.0.borrow_mut();
        steps.push(from);
        Var { tape: Some(self), index: steps.len() - 1, value }
    }
}

impl Derivatives {
    /// The derivative by a value; 0 by constants.
    pub fn by(&self, x: Var<'_>) -> f64 {
        x.tape.and_then(|_| self.0.get(x.index)).copied().unwrap_or(0.0)
    }
}

impl<'t> Var<'t> {
    /// The value.
    pub fn value(self) -> f64 {
        self.value
    }

    /// Its derivatives by all values that were on the tape before it. One pass over the tape.
    pub fn gradient(self) -> Derivatives {
        let Some(tape) = self.tape else { return Derivatives(Vec::new()) };
        let mut by = vec![0.0; self.index + 1];
        by[self.index] = 1.0;
        for (i, from) in tape.0.borrow()[..=self.index].iter().enumerate().rev() {
            for &(j, derivative) in from {
                by[j] += derivative * by[i];
            }
        }
        Derivatives(by)
    }

    /// A function of one value, by its value and derivative there.
    #[must_use]
    pub fn map(self, value: f64, derivative: f64) -> Self {
        self.join(self, value, [derivative, 0.0])
    }

    /// A function of two values, by its value and derivatives there.
    fn join(self, other: Self, value: f64, [by_self, by_other]: [f64; 2]) -> Self {
        let from = |x: Self, by: f64| if x.tape.is_some() { (x.index, by) } else { (0, 0.0) };
        match self.tape.or(other.tape) {
            Some(tape) => tape.push(value, [from(self, by_self), from(other, by_other)]),
            None => value.into(),
        }
    }

    /// √x.
    #[must_use]
    pub fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.map(root, 0.5 / root)
    }

    /// eˣ.
    #[must_use]
    pub fn exp(self) -> Self {
        let power = self.value.exp();
        self.map(power, power)
    }

    /// ln(1 + x).
    #[must_use]
    pub fn ln_1p(self) -> Self {
        self.map(self.value.ln_1p(), 1.0 / (1.0 + self.value))
    }

    /// sin x.
    #[must_use]
    pub fn sin(self) -> Self {
        self.map(self.value.sin(), self.value.cos())
    }

    /// cos x.
    #[must_use]
    pub fn cos(self) -> Self {
        self.map(self.value.cos(), -self.value.sin())
    }
}

impl From<f64> for Var<'_> {
    fn from(value: f64) -> Self {
        Self { tape: None, index: 0, value }
    }
}

impl Neg for Var<'_> {
    type Output = Self;

    fn neg(self) -> Self {
        self.map(-self.value, -1.0)
    }
}

/// A binary operation of values, and of a value and a constant.
macro_rules! operation {
    ($trait:ident, $method:ident, |$a:ident, $b:ident| $value:expr, $derivatives:expr) => {
        impl $trait for Var<'_> {
            type Output = Self;

            fn $method(self, other: Self) -> Self {
                let ($a, $b) = (self.value, other.value);
                self.join(other, $value, $derivatives)
            }
        }

        impl $trait<f64> for Var<'_> {
            type Output = Self;

            fn $method(self, other: f64) -> Self {
                self.$method(Self::from(other))
            }
        }
    };
}

operation!(Add, add, |a, b| a + b, [1.0, 1.0]);
operation!(Sub, sub, |a, b| a - b, [1.0, -1.0]);
operation!(Mul, mul, |a, b| a * b, [b, a]);
operation!(Div, div, |a, b| a / b, [1.0 / b, -a / (b * b)]);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_agree_with_differences() {
        fn f<'t>(x: Var<'t>, y: Var<'t>) -> Var<'t> {
            let a = (x * y - x / y).sin() + (x * x + 1.0).sqrt() * 3.0;
            -(a - y.cos() * (x * -0.5).exp()) / ((y * y).ln_1p() + 2.0)
        }
        let value = |x: f64, y: f64| f(x.into(), y.into()).value();
        for (x, y) in [(0.3, 0.7), (-1.2, 2.0), (2.5, -0.4)] {
            let tape = Tape::default();
            let (u, v) = (tape.variable(x), tape.variable(y));
            let result = f(u, v);
            assert_eq!(result.value(), value(x, y));
            let (by, h) = (result.gradient(), 1e-6);
            let truth = [
                (value(x + h, y) - value(x - h, y)) / (2.0 * h),
                (value(x, y + h) - value(x, y - h)) / (2.0 * h),
            ];
            assert!((by.by(u) - truth[0]).abs() < 1e-8 && (by.by(v) - truth[1]).abs() < 1e-8);
            assert_eq!(by.by(Var::from(x)), 0.0);
        }
    }
}

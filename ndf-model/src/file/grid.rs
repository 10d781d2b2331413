//! Numbers on grids of powers of two: an integer times 2ᵉ is exact in single precision and the same on every machine.

/// Integers on a grid are of at most so many bits, so that sums and differences of a few of them fit 32.
const MAX_BITS: u32 = 24;

/// The numbers q · 2ᵉ for integers q.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    exponent: i8,
}

impl Grid {
    /// The grid of spacing 2ᵉ.
    pub(super) fn new(exponent: i8) -> Self {
        Self { exponent }
    }

    /// The finest grid on which integers of `bits` bits and a sign reach as far as `largest`.
    pub(super) fn reaching(largest: f32, bits: u32) -> Self {
        let most = ((1_u64 << bits) - 1) as f64;
        let exponent = (f64::from(largest) / most).log2().ceil();
        Self::new(if largest > 0.0 { exponent.clamp(-100.0, 100.0) as i8 } else { 0 })
    }

    /// The coarsest grid on which all the values lie, if there is one on which they are integers of moderate size. A
    /// negative zero lies on none.
    pub(super) fn of(values: impl IntoIterator<Item = f32> + Clone) -> Option<Self> {
        let mut exponent = i32::MAX;
        for x in values.clone() {
            if !x.is_finite() || (x == 0.0 && x.is_sign_negative()) {
                return None;
            }
            exponent = exponent.min(lowest_bit(x).unwrap_or(i32::MAX));
        }
        let grid = Self::new(if exponent == i32::MAX { 0 } else { i8::try_from(exponent).ok()? });
        let most = f64::from(1 << MAX_BITS);
        values.into_iter().all(|x| (f64::from(x) / grid.spacing()).abs() < most).then_some(grid)
    }

    pub(super) fn exponent(self) -> i8 {
        self.exponent
    }

    fn spacing(self) -> f64 {
        f64::from(self.exponent).exp2()
    }

    /// The integer of a number on the grid; of another, the nearest.
    pub(super) fn integer(self, x: f32) -> i32 {
        (f64::from(x) / self.spacing()).round_ties_even() as i32
    }

    /// The number of an integer.
    pub(super) fn number(self, q: i32) -> f32 {
        (f64::from(q) * self.spacing()) as f32
    }

    /// Takes every number to the nearest on the grid, halves to even ones. Exact for numbers of less than 2²² spacings.
    pub(super) fn round(self, numbers: &mut [f32], first: usize, stride: usize) {
        // The sum has no bits for fractions: scaling by powers of two loses nothing, and the addition rounds.
        const SHIFT: f32 = 1.5 * (1 << 23) as f32;
        let (to, from) = (self.number(1).recip(), self.number(1));
        for x in numbers.iter_mut().skip(first).step_by(stride) {
            let rounded = (*x * to + SHIFT - SHIFT) * from;
            // The largest floats stay finite. A sum with +0 has no negative zero.
            *x = rounded.clamp(f32::MIN, f32::MAX) + 0.0;
        }
    }
}

/// The exponent e of the lowest bit of `x`: the largest with x an integer times 2ᵉ. `None` for 0.
fn lowest_bit(x: f32) -> Option<i32> {
    let bits = x.to_bits();
    let (biased, fraction) = ((bits >> 23 & 0xff) as i32, bits & 0x007f_ffff);
    let (exponent, mantissa) =
        if biased == 0 { (-149, fraction) } else { (biased - 150, fraction | 0x0080_0000) };
    (mantissa != 0).then(|| exponent + mantissa.trailing_zeros() as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_coarsest_grid_is_found_and_nothing_is_lost_on_it() {
        for (values, exponent) in [
            (vec![0.0, 1.5, -2.25], Some(-2)),
            (vec![96.0, -32.0], Some(5)),
            (vec![0.0], Some(0)),
            (vec![], Some(0)),
            (vec![0.1, 1000.0], None),
            (vec![-0.0], None),
            (vec![f32::NAN], None),
            (vec![1e-40], None),
        ] {
            let grid = Grid::of(values.iter().copied());
            assert_eq!(grid.map(Grid::exponent), exponent, "{values:?}");
            let grid = grid.unwrap_or(Grid::new(0));
            for &x in values.iter().filter(|_| exponent.is_some()) {
                assert_eq!(grid.number(grid.integer(x)).to_bits(), x.to_bits());
            }
        }
    }

    #[test]
    fn a_grid_reaches_its_largest_number() {
        for bits in 2..16 {
            for largest in [0.013_f32, 1.0, 7.3, 1e-9] {
                let grid = Grid::reaching(largest, bits);
                assert!(grid.integer(largest).unsigned_abs() < 1 << bits);
                assert!(grid.integer(largest).unsigned_abs() >= (1 << (bits - 1)) - 1);
                let mut rounded = [largest, -0.3 * largest, -1e-30];
                grid.round(&mut rounded, 0, 1);
                assert!(Grid::of(rounded).is_some_and(|g| g.exponent() >= grid.exponent()));
                assert_eq!(
                    rounded.map(|x| grid.integer(x)),
                    [largest, -0.3 * largest, 0.0].map(|x| grid.integer(x))
                );
            }
        }
    }

    #[test]
    fn the_largest_numbers_stay_finite() {
        for bits in [2, 7, 14] {
            let mut numbers = [f32::MAX, f32::MIN, 1.0];
            Grid::reaching(f32::MAX, bits).round(&mut numbers, 0, 1);
            assert!(numbers.iter().all(|x| x.is_finite()), "{numbers:?}");
        }
    }
}

//! Numbers that matrices and their factors hold.

use std::borrow::Cow;
use std::iter::Sum;
use std::ops::{AddAssign, Mul, SubAssign};

use faer::c64;
use faer::traits::ComplexField;
use pulp::Simd;

use crate::simd::{self, Row, WIDTH};

/// Real and complex numbers in double precision: `f64` and [`c64`].
pub trait Scalar:
    Entry + ComplexField + Copy + Default + PartialEq + Sum + AddAssign + SubAssign + Mul<Output = Self>
{
}

impl Scalar for f64 {}
impl Scalar for c64 {}

/// What the solver needs of the entries of a factor. Functions with complex values take two numbers of a [`Row`] each.
pub trait Entry: Sized {
    /// Functions in a row.
    const FUNCTIONS: usize;

    /// Rows or columns whose sums fit the registers.
    const TILE: usize;

    /// The sum of products of entries with rows.
    type Products<S: Simd, const V: usize>: Copy;

    /// As many consecutive entries as a register holds.
    type Vector<S: Simd>: Copy;

    /// The conjugate number.
    #[must_use]
    fn conjugate(self) -> Self;

    /// The conjugate numbers.
    fn conjugates(values: &[Self]) -> Cow<'_, [Self]>
    where
        Self: Clone;

    /// The value of a function of a row.
    fn of_row(row: &Row, function: usize) -> Self;

    /// Sets the value of a function of a row.
    fn put(self, row: &mut Row, function: usize);

    /// No products.
    fn none<S: Simd, const V: usize>(simd: S) -> Self::Products<S, V>;

    /// Adds the product of an entry with a row.
    fn add_product<S: Simd, const V: usize>(
        self,
        simd: S,
        sum: Self::Products<S, V>,
        row: [S::f64s; V],
    ) -> Self::Products<S, V>;

    /// The sum, of the conjugates of the entries if `conjugate`.
    fn total<S: Simd, const V: usize>(simd: S, sum: Self::Products<S, V>, conjugate: bool) -> [S::f64s; V];

    /// Cuts a slice into vectors and a rest.
    fn vectors<S: Simd>(values: &[Self]) -> (&[Self::Vector<S>], &[Self]);

    /// Cuts a slice into vectors and a rest.
    fn vectors_mut<S: Simd>(values: &mut [Self]) -> (&mut [Self::Vector<S>], &mut [Self]);

    /// A vector of equal entries.
    fn splat<S: Simd>(simd: S, value: Self) -> Self::Vector<S>;

    /// `a b + c`, entry by entry.
    fn mul_add<S: Simd>(
        simd: S,
        a: Self::Vector<S>,
        b: Self::Vector<S>,
        c: Self::Vector<S>,
    ) -> Self::Vector<S>;

    /// `ā b + c`, entry by entry.
    fn conj_mul_add<S: Simd>(
        simd: S,
        a: Self::Vector<S>,
        b: Self::Vector<S>,
        c: Self::Vector<S>,
    ) -> Self::Vector<S>;

    /// The sum of the entries of a vector.
    fn reduce<S: Simd>(simd: S, vector: Self::Vector<S>) -> Self;
}

/// Operations on vectors of entries, which pulp has under a name for each type.
macro_rules! vector_operations {
    ($cut:ident, $cut_mut:ident, $splat:ident, $mul_add:ident, $conj_mul_add:ident, $reduce:ident) => {
        #[inline(always)]
        fn vectors<S: Simd>(values: &[Self]) -> (&[Self::Vector<S>], &[Self]) {
            S::$cut(values)
        }

        #[inline(always)]
        fn vectors_mut<S: Simd>(values: &mut [Self]) -> (&mut [Self::Vector<S>], &mut [Self]) {
            S::$cut_mut(values)
        }

        #[inline(always)]
        fn splat<S: Simd>(simd: S, value: Self) -> Self::Vector<S> {
            simd.$splat(value)
        }

        #[inline(always)]
        fn mul_add<S: Simd>(
            simd: S,
            a: Self::Vector<S>,
            b: Self::Vector<S>,
            c: Self::Vector<S>,
        ) -> Self::Vector<S> {
            simd.$mul_add(a, b, c)
        }

        #[inline(always)]
        fn conj_mul_add<S: Simd>(
            simd: S,
            a: Self::Vector<S>,
            b: Self::Vector<S>,
            c: Self::Vector<S>,
        ) -> Self::Vector<S> {
            simd.$conj_mul_add(a, b, c)
        }

        #[inline(always)]
        fn reduce<S: Simd>(simd: S, vector: Self::Vector<S>) -> Self {
            simd.$reduce(vector)
        }
    };
}

impl Entry for f64 {
    const FUNCTIONS: usize = WIDTH;
    const TILE: usize = 8;
    type Products<S: Simd, const V: usize> = [S::f64s; V];
    type Vector<S: Simd> = S::f64s;

    #[inline(always)]
    fn conjugate(self) -> Self {
        self
    }

    fn conjugates(values: &[Self]) -> Cow<'_, [Self]> {
        Cow::Borrowed(values)
    }

    fn of_row(row: &Row, function: usize) -> Self {
        row.0[function]
    }

    fn put(self, row: &mut Row, function: usize) {
        row.0[function] = self;
    }

    #[inline(always)]
    fn none<S: Simd, const V: usize>(simd: S) -> Self::Products<S, V> {
        simd::zero::<S, V>(simd)
    }

    #[inline(always)]
    fn add_product<S: Simd, const V: usize>(
        self,
        simd: S,
        sum: Self::Products<S, V>,
        row: [S::f64s; V],
    ) -> Self::Products<S, V> {
        simd::add(simd, sum, self, row)
    }

    #[inline(always)]
    fn total<S: Simd, const V: usize>(_: S, sum: Self::Products<S, V>, _: bool) -> [S::f64s; V] {
        sum
    }

    vector_operations!(
        as_simd_f64s,
        as_mut_simd_f64s,
        splat_f64s,
        mul_add_e_f64s,
        mul_add_e_f64s,
        reduce_sum_f64s
    );
}

impl Entry for c64 {
    const FUNCTIONS: usize = WIDTH / 2;
    const TILE: usize = 4;
    /// Those of the real parts and those of the imaginary ones: the latter are turned once, in the end.
    type Products<S: Simd, const V: usize> = [[S::f64s; V]; 2];
    type Vector<S: Simd> = S::c64s;

    #[inline(always)]
    fn conjugate(self) -> Self {
        self.conj()
    }

    fn conjugates(values: &[Self]) -> Cow<'_, [Self]> {
        values.iter().map(Self::conj).collect()
    }

    fn of_row(row: &Row, function: usize) -> Self {
        Self::new(row.0[2 * function], row.0[2 * function + 1])
    }

    fn put(self, row: &mut Row, function: usize) {
        [row.0[2 * function], row.0[2 * function + 1]] = [self.re, self.im];
    }

    #[inline(always)]
    fn none<S: Simd, const V: usize>(simd: S) -> Self::Products<S, V> {
        [simd::zero::<S, V>(simd); 2]
    }

    #[inline(always)]
    fn add_product<S: Simd, const V: usize>(
        self,
        simd: S,
        [re, im]: Self::Products<S, V>,
        row: [S::f64s; V],
    ) -> Self::Products<S, V> {
        [simd::add(simd, re, self.re, row), simd::add(simd, im, self.im, row)]
    }

    #[inline(always)]
    fn total<S: Simd, const V: usize>(
        simd: S,
        [re, im]: Self::Products<S, V>,
        conjugate: bool,
    ) -> [S::f64s; V] {
        let mut row = Row::default();
        simd::store::<S, V>(&mut row, im);
        // i (a + ib) = −b + ia.
        let turned = Row([-row.0[1], row.0[0], -row.0[3], row.0[2]]);
        simd::add(simd, re, if conjugate { -1.0 } else { 1.0 }, simd::load::<S, V>(simd, &turned))
    }

    vector_operations!(
        as_simd_c64s,
        as_mut_simd_c64s,
        splat_c64s,
        mul_add_e_c64s,
        conj_mul_add_e_c64s,
        reduce_sum_c64s
    );
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Kernel;

    /// The sum of entries times rows, of their conjugates if so asked.
    struct Products<'a, T>(&'a [(T, Row)], bool);

    impl<T: Scalar> Kernel for Products<'_, T> {
        type Output = Row;

        #[inline(always)]
        fn run<S: Simd, const V: usize>(self, simd: S) -> Row {
            let mut sum = T::none::<S, V>(simd);
            for (entry, row) in self.0 {
                sum = entry.add_product(simd, sum, simd::load::<S, V>(simd, row));
            }
            let mut total = Row::default();
            simd::store::<S, V>(&mut total, T::total(simd, sum, self.1));
            total
        }
    }

    #[test]
    fn complex_products_are_those_of_numbers() {
        let row = |k: f64| Row([0.3 + k, -1.1, 0.7 * k, 2.0]);
        let terms = [1.0, 2.0, -0.5].map(|k| (c64::new(k, 1.0 - k * k), row(k)));
        for conjugate in [false, true] {
            let found = simd::run(Products(&terms, conjugate));
            for function in 0..c64::FUNCTIONS {
                let entry = |z: c64| if conjugate { z.conj() } else { z };
                let exact: c64 = terms.iter().map(|(z, row)| entry(*z) * c64::of_row(row, function)).sum();
                assert!((c64::of_row(&found, function) - exact).norm() < 1e-14);
            }
        }
    }
}

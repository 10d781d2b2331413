//! The grid of corners a field is sampled on.

use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside};
use rayon::prelude::*;

use super::{IsosurfaceError, LARGEST_GRID};

/// Cubic cells around a box, with a margin of at least one cell on every side.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// The corner with the smallest coordinates.
    pub origin: DVec3,
    /// Side of a cell.
    pub cell: f64,
    /// Number of cells along each axis.
    pub cells: [u32; 3],
}

impl Grid {
    /// The grid of a field: `count` cells along the longest side of `bounds`, or of the field's own, then the margin.
    ///
    /// # Errors
    /// If the box is empty or not finite, or `count` is not from 1 to [`LARGEST_GRID`].
    pub fn of_field(
        field: &dyn ImplicitField,
        bounds: Option<BoundingBox>,
        count: u32,
    ) -> Result<Self, IsosurfaceError> {
        if !(1..=LARGEST_GRID).contains(&count) {
            return Err(IsosurfaceError::GridSize(count));
        }
        let bounds = bounds.unwrap_or_else(|| field.bounds());
        let sides = bounds.extent();
        if bounds.is_empty()
            || !sides.is_finite()
            || !bounds.center().is_finite()
            || sides.max_element() <= 0.0
        {
            return Err(IsosurfaceError::Bounds(bounds));
        }
        Ok(Self::around(&bounds, count))
    }

    /// `count` cells along the longest side of `bounds`, then the margin.
    pub fn around(bounds: &BoundingBox, count: u32) -> Self {
        let cell = bounds.extent().max_element() / f64::from(count);
        // A side that is a whole number of cells long up to rounding must not get one more.
        let cells = bounds.extent().to_array().map(|side| (side / cell - 1e-6).ceil().max(0.0) as u32 + 2);
        let half = 0.5 * cell * DVec3::from_array(cells.map(f64::from));
        Self { origin: bounds.center() - half, cell, cells }
    }

    /// Position of a corner.
    pub fn corner(&self, [x, y, z]: [u32; 3]) -> DVec3 {
        self.origin + self.cell * DVec3::new(f64::from(x), f64::from(y), f64::from(z))
    }
}

/// A field seen so that zero is the level and inside is above it.
#[derive(Clone, Copy)]
pub(crate) struct Oriented<'a> {
    pub(crate) field: &'a dyn ImplicitField,
    level: f64,
    sign: f64,
}

impl<'a> Oriented<'a> {
    pub(crate) fn new(field: &'a dyn ImplicitField) -> Self {
        let sign = match field.inside() {
            Inside::Below => -1.0,
            Inside::Above => 1.0,
        };
        Self { field, level: field.level(), sign }
    }

    /// How many points a call should have.
    pub(crate) fn batch(&self) -> usize {
        self.field.batch().max(1)
    }

    /// Values at some points, on the calling thread.
    pub(crate) fn values(&self, points: &[DVec3], values: &mut [f64]) {
        self.field.values(points, values);
        for value in values {
            *value = self.sign * (*value - self.level);
        }
    }

    /// Values at many points, in batches over all threads.
    pub(crate) fn values_of(&self, points: &[DVec3]) -> Vec<f64> {
        let mut values = vec![0.0; points.len()];
        let batches = points.par_chunks(self.batch()).zip(values.par_chunks_mut(self.batch()));
        batches.for_each(|(p, v)| self.values(p, v));
        values
    }
}

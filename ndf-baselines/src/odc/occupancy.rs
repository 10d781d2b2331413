//! Looking at a field for no more than inside and outside, many points at a time, and counting.

use std::sync::atomic::{AtomicU64, Ordering};

use ndf_core::{DVec3, ImplicitField, Inside};
use rayon::prelude::*;

/// Points handed to a field, and rays searched, at a time.
const BATCH: usize = 512;

/// The inside of a field.
pub(crate) struct Occupancy<'a> {
    field: &'a dyn ImplicitField,
    queries: AtomicU64,
}

/// A point from which to look for a change of side.
#[derive(Clone, Copy)]
pub(crate) struct Ray {
    pub(crate) origin: DVec3,
    /// A unit vector.
    pub(crate) direction: DVec3,
    /// Whether the origin is inside.
    pub(crate) starts_inside: bool,
}

impl Ray {
    fn at(&self, t: f64) -> DVec3 {
        self.origin + t * self.direction
    }
}

impl<'a> Occupancy<'a> {
    pub(crate) fn new(field: &'a dyn ImplicitField) -> Self {
        Self { field, queries: AtomicU64::new(0) }
    }

    /// How many points were looked at.
    pub(crate) fn queries(&self) -> u64 {
        self.queries.load(Ordering::Relaxed)
    }

    /// Which of the points are inside, on the calling thread. A value at the level is outside, as is NaN.
    fn inside_of_batch(&self, points: &[DVec3]) -> Vec<bool> {
        let mut values = vec![0.0; points.len()];
        self.field.values(points, &mut values);
        self.queries.fetch_add(points.len() as u64, Ordering::Relaxed);
        let level = self.field.level();
        match self.field.inside() {
            Inside::Below => values.into_iter().map(|v| v < level).collect(),
            Inside::Above => values.into_iter().map(|v| v > level).collect(),
        }
    }

    /// Which of the points are inside, over all threads.
    pub(crate) fn inside(&self, points: &[DVec3]) -> Vec<bool> {
        points.par_chunks(BATCH).flat_map_iter(|batch| self.inside_of_batch(batch)).collect()
    }

    /// Between which of `steps` equal steps up to `reach` each ray first changes sides.
    pub(crate) fn stepped(&self, rays: &[Ray], reach: f64, steps: u32) -> Vec<Option<[f64; 2]>> {
        let step = reach / f64::from(steps);
        let search = |batch: &[Ray]| {
            let mut brackets = vec![None; batch.len()];
            for k in 0..steps {
                let span = [f64::from(k) * step, f64::from(k + 1) * step];
                let open: Vec<usize> = (0..batch.len()).filter(|&i| brackets[i].is_none()).collect();
                let points: Vec<DVec3> = open.iter().map(|&i| batch[i].at(span[1])).collect();
                for (&i, inside) in open.iter().zip(self.inside_of_batch(&points)) {
                    brackets[i] = (inside != batch[i].starts_inside).then_some(span);
                }
            }
            brackets
        };
        rays.par_chunks(BATCH).flat_map_iter(search).collect()
    }

    /// Where each ray changes sides within its bracket, by so many bisections.
    pub(crate) fn bisected(
        &self,
        rays: &[Ray],
        mut brackets: Vec<Option<[f64; 2]>>,
        bisections: u32,
    ) -> Vec<Option<f64>> {
        rays.par_chunks(BATCH).zip(brackets.par_chunks_mut(BATCH)).for_each(|(rays, brackets)| {
            let (rays, mut open): (Vec<&Ray>, Vec<&mut [f64; 2]>) =
                rays.iter().zip(brackets).filter_map(|(ray, bracket)| Some((ray, bracket.as_mut()?))).unzip();
            for _ in 0..bisections {
                let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
                let points: Vec<DVec3> = rays.iter().zip(&open).map(|(r, b)| r.at(middle(**b))).collect();
                for ((ray, bracket), inside) in rays.iter().zip(&mut open).zip(self.inside_of_batch(&points))
                {
                    bracket[usize::from(inside != ray.starts_inside)] = middle(**bracket);
                }
            }
        });
        brackets.into_iter().map(|bracket| bracket.map(|[a, b]| 0.5 * (a + b))).collect()
    }
}

//! A field that is cheap near a mesh: sampled once on an adaptive grid, interpolated ever after.
//!
//! Training asks for a million projections, each of a dozen values. Where a value costs a network or thousands of
//! primitives, [`NarrowBand`] answers near the base mesh from cubes of values and gradients, which are halved until
//! the interpolant agrees with the field. Elsewhere the field itself answers.

mod agreement;
mod cubic;
mod filling;
#[cfg(test)]
mod tests;

use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside, Progress};
use ndf_mesh::TriangleMesh;

pub use agreement::{Agreement, agreement};
use cubic::Cubic;
use filling::Filling;

/// How finely a band is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandOptions {
    /// Where the level may be by the interpolant, a length: cubes that the level may cross are halved until it is
    /// closer than this to where the field has it.
    pub tolerance: f64,
    /// How far from the mesh the band reaches, a length.
    pub width: f64,
    /// Side of the largest cubes.
    pub coarsest: f64,
    /// How often a cube may be halved, at most 10.
    pub halvings: u32,
    /// The most cubes: where halving all that are too coarse would exceed it, none of them is halved.
    pub most_cubes: usize,
}

impl BandOptions {
    /// For a mesh of this size: a tolerance of 2·10⁻⁵ of the diagonal, cubes of 1/100 of it halved up to four times, a
    /// band of one of them on both sides, four million cubes (500 MB).
    pub fn for_mesh(mesh: &TriangleMesh) -> Self {
        let diagonal = mesh.bounds().diagonal();
        let coarsest = 0.01 * diagonal;
        Self { tolerance: 2e-5 * diagonal, width: coarsest, coarsest, halvings: 4, most_cubes: 4_000_000 }
    }
}

/// What a band consists of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandReport {
    /// Cubes that answer.
    pub cubes: usize,
    /// Side of the smallest of them.
    pub finest: f64,
    /// Values asked of the field.
    pub values: usize,
    /// Gradients asked of the field.
    pub gradients: usize,
    /// Share of the cubes which the level may cross that still exceeded the tolerance when they could be halved no
    /// more.
    pub unresolved: f64,
    /// Wall time of the sampling.
    pub seconds: f64,
}

/// Why there is no band.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum BandError {
    /// The mesh is empty, or not finite, or too large for the side of the cubes.
    #[error("the mesh is empty, not finite or too large for cubes of the given side")]
    Extent,
    /// The observer asked to stop.
    #[error("cancelled")]
    Cancelled,
}

/// No cube.
const ABSENT: u32 = u32::MAX;
/// Marks nodes that are cubes; the other bits are its number. Those of other nodes are the first of eight children.
const CUBE: u32 = 1 << 31;

/// A field with a sampled band around a mesh. Interpolation is by tricubic polynomials through values and gradients
/// at the corners of a cube (Adini's element, 32 coefficients): exact for cubics, continuous between cubes of a
/// size. Values and gradients in the band cost about a tenth of a microsecond; 128 bytes a cube.
#[derive(Clone, Debug)]
pub struct NarrowBand<F> {
    field: F,
    origin: DVec3,
    /// Side of the largest cubes.
    side: f64,
    /// Number of them along each axis.
    counts: [u32; 3],
    /// Root of each of them, x fastest.
    roots: Vec<u32>,
    nodes: Vec<u32>,
    cubes: Vec<Cubic>,
    report: BandReport,
}

impl<F: ImplicitField> NarrowBand<F> {
    /// Samples the field around a mesh, over all threads. The result does not depend on their number.
    ///
    /// # Errors
    /// See [`BandError`].
    pub fn around(
        field: F,
        mesh: &TriangleMesh,
        options: &BandOptions,
        progress: &dyn Progress,
    ) -> Result<Self, BandError> {
        Filling::new(&field, mesh, options)?.fill(progress).map(|filled| filled.with_field(field))
    }

    /// What the band consists of.
    pub fn report(&self) -> &BandReport {
        &self.report
    }

    /// The field itself.
    pub fn field(&self) -> &F {
        &self.field
    }

    /// The cube around a point and the coordinates of the point in it, in `[0, 1]`.
    fn cube_at(&self, p: DVec3) -> Option<(&Cubic, DVec3)> {
        let t = (p - self.origin) / self.side;
        let cell = t.floor();
        // NaN compares false.
        let in_grid = |k: usize| cell[k] >= 0.0 && cell[k] < f64::from(self.counts[k]);
        if !(in_grid(0) && in_grid(1) && in_grid(2)) {
            return None;
        }
        let [x, y, z] = cell.to_array().map(|c| c as usize);
        let (nx, ny) = (self.counts[0] as usize, self.counts[1] as usize);
        let mut node = self.roots[x + nx * (y + ny * z)];
        let mut local = t - cell;
        while node != ABSENT {
            let entry = self.nodes[node as usize];
            if entry & CUBE != 0 {
                return Some((&self.cubes[(entry & !CUBE) as usize], local));
            }
            local *= 2.0;
            let upper = local.cmpge(DVec3::ONE);
            local -= DVec3::select(upper, DVec3::ONE, DVec3::ZERO);
            node = entry + upper.bitmask();
        }
        None
    }

    /// Answers from the band where it can; the points where it cannot are left in the list that is returned.
    fn split(&self, points: &[DVec3], mut answer: impl FnMut(usize, &Cubic, DVec3) -> bool) -> Vec<usize> {
        let open = |i: &usize| match self.cube_at(points[*i]) {
            Some((cube, local)) => !answer(*i, cube, local),
            None => true,
        };
        (0..points.len()).filter(open).collect()
    }
}

impl<F: ImplicitField> ImplicitField for NarrowBand<F> {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        let outside = self.split(points, |i, cube, local| {
            values[i] = cube.value(local);
            values[i].is_finite()
        });
        if !outside.is_empty() {
            let elsewhere: Vec<DVec3> = outside.iter().map(|&i| points[i]).collect();
            let mut found = vec![0.0; outside.len()];
            self.field.values(&elsewhere, &mut found);
            outside.iter().zip(found).for_each(|(&i, v)| values[i] = v);
        }
    }

    fn gradients(&self, points: &[DVec3], gradients: &mut [DVec3]) {
        let mut values = vec![0.0; points.len()];
        self.values_and_gradients(points, &mut values, gradients);
    }

    fn values_and_gradients(&self, points: &[DVec3], values: &mut [f64], gradients: &mut [DVec3]) {
        let outside = self.split(points, |i, cube, local| {
            (values[i], gradients[i]) = cube.value_and_gradient(local);
            values[i].is_finite() && gradients[i].is_finite()
        });
        if !outside.is_empty() {
            let elsewhere: Vec<DVec3> = outside.iter().map(|&i| points[i]).collect();
            let (mut found, mut slopes) = (vec![0.0; outside.len()], vec![DVec3::ZERO; outside.len()]);
            self.field.values_and_gradients(&elsewhere, &mut found, &mut slopes);
            for ((&i, v), g) in outside.iter().zip(found).zip(slopes) {
                (values[i], gradients[i]) = (v, g);
            }
        }
    }

    fn bounds(&self) -> BoundingBox {
        self.field.bounds()
    }

    fn level(&self) -> f64 {
        self.field.level()
    }

    fn inside(&self) -> Inside {
        self.field.inside()
    }

    fn lipschitz(&self) -> Option<f64> {
        self.field.lipschitz()
    }

    fn difference_step(&self) -> f64 {
        self.field.difference_step()
    }
}

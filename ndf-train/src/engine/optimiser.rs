//! Adam (Kingma & Ba 2015).

use ndf_mesh::Halfedge;
use rayon::prelude::*;

const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;
const EPSILON: f32 = 1e-8;

/// Moments of one group of parameters.
#[derive(Clone, Debug)]
pub(crate) struct Moments {
    first: Vec<f32>,
    second: Vec<f32>,
}

/// The factors of one step, bias corrections included.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdamStep {
    rate: f32,
    second_correction: f32,
}

impl AdamStep {
    /// Step number `step`, counted from 1, at this rate.
    pub(crate) fn new(step: usize, rate: f32) -> Self {
        let t = i32::try_from(step).unwrap_or(i32::MAX);
        Self { rate: rate / (1.0 - BETA_1.powi(t)), second_correction: (1.0 - BETA_2.powi(t)).recip() }
    }

    /// The same step at a multiple of the rate.
    pub(crate) fn scaled(self, factor: f32) -> Self {
        Self { rate: self.rate * factor, ..self }
    }

    /// Moves one parameter.
    #[inline(always)]
    pub(crate) fn update(self, parameter: &mut f32, first: &mut f32, second: &mut f32, gradient: f32) {
        *first += (1.0 - BETA_1) * (gradient - *first);
        *second += (1.0 - BETA_2) * (gradient * gradient - *second);
        *parameter -= self.rate * *first / ((*second * self.second_correction).sqrt() + EPSILON);
    }
}

impl Moments {
    pub(crate) fn new(parameters: usize) -> Self {
        Self { first: vec![0.0; parameters], second: vec![0.0; parameters] }
    }

    /// Moments saved earlier. Both have the same length.
    pub(crate) fn of_parts(first: Vec<f32>, second: Vec<f32>) -> Self {
        assert_eq!(first.len(), second.len());
        Self { first, second }
    }

    /// Forgets all steps.
    pub(crate) fn clear(&mut self) {
        self.first.fill(0.0);
        self.second.fill(0.0);
    }

    /// Both moments, to be saved.
    pub(crate) fn parts(&self) -> [&[f32]; 2] {
        [&self.first, &self.second]
    }

    /// Both moments, for parameters that are updated elsewhere.
    pub(crate) fn parts_mut(&mut self) -> (&mut [f32], &mut [f32]) {
        (&mut self.first, &mut self.second)
    }

    /// Moves all parameters of the group.
    pub(crate) fn apply(&mut self, step: AdamStep, parameters: &mut [f32], gradients: &[f32]) {
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((p, g), (m, v)) in parameters.iter_mut().zip(gradients).zip(moments) {
            step.update(p, m, v, *g);
        }
    }
}

/// A step for all features: gathers the gradients of every vertex from its corners and moves its features.
pub(crate) struct FeatureUpdate<'a> {
    pub(crate) step: AdamStep,
    /// Features a vertex.
    pub(crate) dimension: usize,
    /// Corners of every vertex: `3 f + c` for its corner c of face f.
    pub(crate) incident: &'a [Vec<Halfedge>],
    /// `dimension` floats a corner.
    pub(crate) corner_gradients: &'a [f32],
}

/// Vertices a thread takes at a time.
const VERTICES: usize = 256;

impl FeatureUpdate<'_> {
    /// Moves `features`, vertex-major; `first` and `second` are their moments.
    pub(crate) fn apply(&self, features: &mut [f32], first: &mut [f32], second: &mut [f32]) {
        let floats = VERTICES * self.dimension;
        let parts = features.par_chunks_mut(floats).zip(self.incident.par_chunks(VERTICES));
        let moments = first.par_chunks_mut(floats).zip(second.par_chunks_mut(floats));
        let arch = pulp::Arch::new();
        parts.zip(moments).for_each(|((features, incident), (first, second))| {
            arch.dispatch(|| {
                let d = self.dimension;
                let vertices = features.chunks_exact_mut(d).zip(incident);
                let moments = first.chunks_exact_mut(d).zip(second.chunks_exact_mut(d));
                for ((features, incident), (first, second)) in vertices.zip(moments) {
                    self.vertex(features, first, second, incident);
                }
            });
        });
    }

    /// Moves the features of one vertex, in groups of eight and single ones at the end.
    #[inline(always)]
    fn vertex(&self, features: &mut [f32], first: &mut [f32], second: &mut [f32], incident: &[Halfedge]) {
        let whole = self.dimension - self.dimension % 8;
        for k in (0..whole).step_by(8) {
            self.group::<8>(features, first, second, incident, k);
        }
        for k in whole..self.dimension {
            self.group::<1>(features, first, second, incident, k);
        }
    }

    #[inline(always)]
    fn group<const N: usize>(
        &self,
        features: &mut [f32],
        first: &mut [f32],
        second: &mut [f32],
        incident: &[Halfedge],
        k: usize,
    ) {
        let mut gradient = [0.0; N];
        for &corner in incident {
            let from = &self.corner_gradients[corner.index() * self.dimension + k..][..N];
            for (to, from) in gradient.iter_mut().zip(from) {
                *to += from;
            }
        }
        let moments = first[k..][..N].iter_mut().zip(&mut second[k..][..N]);
        for ((feature, gradient), (m, v)) in features[k..][..N].iter_mut().zip(gradient).zip(moments) {
            self.step.update(feature, m, v, gradient);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_step_has_the_length_of_the_rate_and_a_parabola_is_descended() {
        let mut moments = Moments::new(2);
        let mut x = [1.0, -3.0];
        moments.apply(AdamStep::new(1, 0.1), &mut x, &[5.0, -1e-3]);
        assert!((x[0] - 0.9).abs() < 1e-5 && (x[1] + 2.9).abs() < 1e-4);
        for step in 2..2000 {
            let gradient = x.map(|x| 2.0 * (x - 2.0));
            moments.apply(AdamStep::new(step, 0.05), &mut x, &gradient);
        }
        assert!(x.iter().all(|x| (x - 2.0).abs() < 1e-3), "{x:?}");
    }
}

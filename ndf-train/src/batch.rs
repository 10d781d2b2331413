//! The samples of an epoch and where their images come down on the surface.

use ndf_core::projection::project_all;
use ndf_core::sampling::{AreaSampler, FaceSample};
use ndf_core::{DVec3, Hint, Miss, Projection, Query, Similarity, Surface};

/// A point of the base mesh, in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) face: u32,
    pub(crate) barycentric: [f32; 3],
}

/// What the surface looks like near the image of a sample: its plane through `foot` with unit `normal`, or
/// nothing (`normal` zero) where the image has no foot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Target {
    pub(crate) foot: [f32; 3],
    pub(crate) normal: [f32; 3],
}

impl Target {
    const NONE: Self = Self { foot: [0.0; 3], normal: [0.0; 3] };
}

/// Samples, ordered by face, with their targets.
pub(crate) struct Batch {
    pub(crate) samples: Vec<Sample>,
    pub(crate) targets: Vec<Target>,
    /// Samples of face f are `face_starts[f] .. face_starts[f + 1]`.
    pub(crate) face_starts: Vec<u32>,
    queries: Vec<Query>,
    feet: Vec<Projection>,
}

impl Batch {
    pub(crate) fn new(samples: usize, faces: usize) -> Self {
        Self {
            samples: vec![Sample { face: 0, barycentric: [1.0, 0.0, 0.0] }; samples],
            targets: vec![Target::NONE; samples],
            face_starts: vec![0; faces + 1],
            queries: vec![Query::at(DVec3::ZERO); samples],
            feet: vec![Err(Miss::OutOfReach); samples],
        }
    }

    /// Draws new samples. Hints stay: sample i of a stratified batch is near sample i of the last.
    pub(crate) fn resample(&mut self, sampler: &AreaSampler, seed: u64, stream: u64) {
        let drawn = sampler.sample(self.samples.len(), seed, stream);
        for (sample, FaceSample { face, barycentric }) in self.samples.iter_mut().zip(drawn) {
            *sample = Sample { face, barycentric: barycentric.map(|b| b as f32) };
        }
        let faces = self.face_starts.len() as u32 - 1;
        let mut next = 0;
        for f in 0..=faces {
            while next < self.samples.len() && self.samples[next].face < f {
                next += 1;
            }
            self.face_starts[f as usize] = next as u32;
        }
    }

    /// Projects the images `y` of the samples (normalised) with normals `n` onto the surface.
    pub(crate) fn project(
        &mut self,
        surface: &dyn Surface,
        similarity: &Similarity,
        images: &[(DVec3, DVec3)],
    ) {
        for ((query, foot), &(y, n)) in self.queries.iter_mut().zip(&self.feet).zip(images) {
            let hint = foot.map_or(Hint::NONE, |f| f.hint);
            *query = Query { point: similarity.to_world(y), normal: (n != DVec3::ZERO).then_some(n), hint };
        }
        project_all(surface, &self.queries, &mut self.feet);
        for ((target, foot), &(y, _)) in self.targets.iter_mut().zip(&self.feet).zip(images) {
            *target = foot.map_or(Target::NONE, |foot| {
                let p = similarity.to_normalised(foot.point);
                // The distance's own gradient is exact also where the foot is on an edge or a vertex; the
                // surface's normal serves where the distance is too short to have a direction.
                let away = y - p;
                let normal = if away.length_squared() > 1e-12 { away.normalize() } else { foot.normal };
                Target { foot: p.as_vec3().to_array(), normal: normal.as_vec3().to_array() }
            });
        }
    }

    /// Share of the samples that have a target.
    pub(crate) fn hit_share(&self) -> f64 {
        let hits = self.feet.iter().filter(|f| f.is_ok()).count();
        hits as f64 / self.feet.len() as f64
    }
}

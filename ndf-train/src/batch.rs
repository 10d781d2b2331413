//! The samples of an epoch and where their images come down on the surface.

use ndf_core::project_all;
use ndf_core::{Answer, DVec3, Hint, Miss, Query, Surface};
use ndf_mesh::FacePoint;
use ndf_mesh::sampling::AreaSampler;
use ndf_model::Similarity;

use crate::origin::Origin;
use crate::terms::Target;

/// A point of the base mesh, in single precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) face: u32,
    pub(crate) barycentric: [f32; 3],
}

impl Sample {
    pub(crate) fn new(sample: &FacePoint) -> Self {
        Self { face: sample.face, barycentric: sample.barycentric.map(|b| b as f32) }
    }

    pub(crate) fn on_face(&self) -> FacePoint {
        FacePoint { face: self.face, barycentric: self.barycentric.map(f64::from) }
    }
}

/// Chunks a batch is cut into, whatever the number of threads, so that sums come out the same.
pub(crate) const CHUNKS: usize = 32;

/// Samples, ordered by face, with their targets.
pub(crate) struct Batch {
    pub(crate) samples: Vec<Sample>,
    pub(crate) targets: Vec<Target>,
    /// Samples of face f are `face_starts[f] .. face_starts[f + 1]`.
    face_starts: Vec<u32>,
    /// Chunk k has the faces `chunk_faces[k] .. chunk_faces[k + 1]`: whole faces, about as many samples in each.
    pub(crate) chunk_faces: [u32; CHUNKS + 1],
    /// Where the images come from, where the reverse map asks for it; else none.
    pub(crate) origins: Vec<Origin>,
    /// Hint of the last foot of every sample.
    pub(crate) hints: Vec<Hint>,
    queries: Vec<Query>,
    feet: Vec<Answer>,
}

impl Batch {
    pub(crate) fn new(samples: usize, faces: usize) -> Self {
        Self {
            samples: vec![Sample { face: 0, barycentric: [1.0, 0.0, 0.0] }; samples],
            targets: vec![Target::NONE; samples],
            face_starts: vec![0; faces + 1],
            chunk_faces: [0; CHUNKS + 1],
            origins: Vec::new(),
            hints: vec![Hint::NONE; samples],
            queries: vec![Query::at(DVec3::ZERO); samples],
            feet: vec![Err(Miss::OutOfReach); samples],
        }
    }

    /// Draws new samples. Hints stay: sample i of a stratified batch is near sample i of the last.
    pub(crate) fn resample(&mut self, sampler: &AreaSampler, seed: u64, stream: u64) {
        for (sample, drawn) in self.samples.iter_mut().zip(sampler.sample(self.targets.len(), seed, stream)) {
            *sample = Sample::new(&drawn);
        }
        let faces = self.face_starts.len() as u32 - 1;
        let mut next = 0;
        for f in 0..=faces {
            while next < self.samples.len() && self.samples[next].face < f {
                next += 1;
            }
            self.face_starts[f as usize] = next as u32;
        }
        for (k, first) in self.chunk_faces.iter_mut().enumerate() {
            let sample = (k * self.samples.len() / CHUNKS) as u32;
            *first = self.face_starts.partition_point(|&start| start < sample) as u32;
        }
        self.chunk_faces[CHUNKS] = faces;
    }

    /// Whether samples have been drawn.
    pub(crate) fn is_drawn(&self) -> bool {
        self.face_starts.last() != Some(&0)
    }

    /// Samples of these faces.
    pub(crate) fn samples_of(&self, faces: std::ops::Range<u32>) -> std::ops::Range<usize> {
        self.face_starts[faces.start as usize] as usize..self.face_starts[faces.end as usize] as usize
    }

    /// Takes the samples' own places as targets.
    pub(crate) fn stay(&mut self, images: impl Iterator<Item = DVec3>) {
        for (target, x) in self.targets.iter_mut().zip(images) {
            // Any unit normals: only points are compared.
            let up = [0.0, 0.0, 1.0];
            *target = Target { foot: x.as_vec3().to_array(), normal: up, surface_normal: up };
        }
    }

    /// Projects the images (normalised) with their guiding normals onto the surface.
    pub(crate) fn project(
        &mut self,
        surface: &dyn Surface,
        similarity: &Similarity,
        images: impl Iterator<Item = (DVec3, DVec3)>,
    ) {
        for ((query, &hint), (y, n)) in self.queries.iter_mut().zip(&self.hints).zip(images) {
            *query = Query { point: y, normal: (n != DVec3::ZERO).then_some(n), hint };
        }
        for query in &mut self.queries {
            query.point = similarity.to_world(query.point);
        }
        project_all(surface, &self.queries, &mut self.feet);
        let answers = self.feet.iter().zip(&self.queries);
        for ((target, hint), (foot, query)) in self.targets.iter_mut().zip(&mut self.hints).zip(answers) {
            *hint = foot.map_or(Hint::NONE, |f| f.hint);
            *target = foot.map_or(Target::NONE, |foot| {
                let p = similarity.to_normalised(foot.point);
                // The distance's own gradient is exact also where the foot is on an edge or a vertex; the
                // surface's normal serves where the distance is too short to have a direction.
                let away = similarity.to_normalised(query.point) - p;
                let normal = if away.length_squared() > 1e-12 { away.normalize() } else { foot.normal };
                let single = |v: DVec3| v.as_vec3().to_array();
                Target { foot: single(p), normal: single(normal), surface_normal: single(foot.normal) }
            });
        }
    }

    /// Share of the samples that have a target.
    pub(crate) fn hit_share(&self) -> f64 {
        let hits = self.feet.iter().filter(|f| f.is_ok()).count();
        hits as f64 / self.feet.len() as f64
    }
}

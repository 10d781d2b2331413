//! The samples of an epoch and where their images come down on the surface.

use ndf_core::project_all;
use ndf_core::{Answer, DVec3, Hint, Miss, Query, Surface};
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::{Face, FacePoint};
use ndf_model::Similarity;

use crate::engine::{CHUNKS, Chunks};
use crate::objective::{Place, Target};

/// Samples, ordered by face, with their targets.
pub(crate) struct Batch {
    pub(crate) places: Vec<Place>,
    pub(crate) targets: Vec<Target>,
    pub(crate) chunks: Chunks,
    /// Hint of the last foot of every sample.
    pub(crate) hints: Vec<Hint>,
    queries: Vec<Query>,
    feet: Vec<Answer>,
}

impl Batch {
    pub(crate) fn new(samples: usize) -> Self {
        Self {
            places: vec![Place { face: Face(0), barycentric: [1.0, 0.0, 0.0] }; samples],
            targets: vec![Target::NONE; samples],
            chunks: Chunks::default(),
            hints: vec![Hint::NONE; samples],
            queries: vec![Query::at(DVec3::ZERO); samples],
            feet: vec![Err(Miss::OutOfReach); samples],
        }
    }

    /// Draws new samples. Hints stay: sample i of a stratified batch is near sample i of the last.
    pub(crate) fn resample(&mut self, sampler: &AreaSampler, face_count: usize, seed: u64, stream: u64) {
        for (place, drawn) in self.places.iter_mut().zip(sampler.sample(self.targets.len(), seed, stream)) {
            *place = Place::new(&drawn);
        }
        self.chunks = Chunks::new(&self.places, face_count, CHUNKS);
    }

    /// Whether samples have been drawn.
    pub(crate) fn is_drawn(&self) -> bool {
        !self.chunks.is_empty()
    }

    /// Where the samples are on the base mesh.
    pub(crate) fn on_faces(&self) -> Vec<FacePoint> {
        self.places.iter().map(Place::on_face).collect()
    }

    /// Takes the samples' own places as targets.
    pub(crate) fn stay(&mut self, images: impl Iterator<Item = DVec3>) {
        for (target, x) in self.targets.iter_mut().zip(images) {
            *target = Target::point(x.as_vec3());
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
                let surface_normal = foot.normal.as_vec3();
                Target { foot: p.as_vec3(), normal: normal.as_vec3(), surface_normal }
            });
        }
    }

    /// Share of the samples that have a target.
    pub(crate) fn hit_share(&self) -> f64 {
        let hits = self.feet.iter().filter(|f| f.is_ok()).count();
        hits as f64 / self.feet.len() as f64
    }
}

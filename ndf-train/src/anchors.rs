//! Anchors: points of the base mesh that must go to given places (supplement, Eq. 3).

use std::sync::Arc;

use ndf_core::network::Packed;
use ndf_core::sampling::FaceSample;
use ndf_core::{DVec3, DisplacementField, Hint, TriangleTree};

use crate::batch::Sample;
use crate::objective::Objective;
use crate::step::{Chunk, Model, Step};
use crate::terms::{PointTarget, Target};

/// Anchors with the memory for their gradients.
pub(crate) struct Anchors {
    samples: Vec<Sample>,
    targets: Vec<Target>,
    corners: Vec<[u32; 3]>,
    objective: Objective,
    chunk: Chunk,
    encoding_gradients: Vec<f32>,
    feature_gradients: Vec<f32>,
}

impl Anchors {
    /// Anchors of normalised points near the base mesh and the places of their images. Pairs that are not finite are
    /// left out.
    pub(crate) fn new(
        field: &DisplacementField,
        pairs: &[(DVec3, DVec3)],
        weight: f32,
        packed: &(Packed, Packed),
    ) -> Self {
        let tree = TriangleTree::new(field.base().as_triangle_mesh());
        let found: Vec<(Sample, Target)> = pairs
            .iter()
            .filter(|(_, q)| q.is_finite())
            .filter_map(|&(p, q)| {
                let closest = tree.closest_point(p, Hint::NONE)?;
                let sample = FaceSample { face: closest.face, barycentric: closest.barycentric };
                let up = [0.0, 0.0, 1.0];
                let foot = q.as_vec3().to_array();
                Some((Sample::new(&sample), Target { foot, normal: up, surface_normal: up }))
            })
            .collect();
        let (samples, targets): (Vec<Sample>, Vec<Target>) = found.into_iter().unzip();
        let objective =
            Objective { terms: vec![(weight, Arc::new(PointTarget))], lambda_c: 0.0, is_identity: false };
        Self {
            corners: samples.iter().map(|s| field.base().faces()[s.face as usize]).collect(),
            encoding_gradients: vec![0.0; samples.len() * field.shape().features],
            feature_gradients: vec![0.0; field.features().len()],
            chunk: Chunk::new(&packed.0, &packed.1, &objective),
            objective,
            samples,
            targets,
        }
    }

    /// Adds the gradients of the network; those of the features can then be had.
    pub(crate) fn accumulate(&mut self, model: Model<'_>, to_theta: &mut [f32]) {
        let d = model.encoding.dimension;
        pulp::Arch::new().dispatch(Step {
            model,
            objective: &self.objective,
            share: 1.0,
            chunk: &mut self.chunk,
            samples: &self.samples,
            targets: &self.targets,
            encoding_gradients: &mut self.encoding_gradients,
        });
        self.chunk.theta_gradients.add_to(to_theta);
        self.feature_gradients.fill(0.0);
        if d == 0 {
            return;
        }
        let anchors = self.samples.iter().zip(&self.corners);
        for ((sample, corners), dz) in anchors.zip(self.encoding_gradients.chunks_exact(d)) {
            for (&v, b) in corners.iter().zip(sample.barycentric) {
                let gradient = &mut self.feature_gradients[v as usize * d..][..d];
                gradient.iter_mut().zip(dz).for_each(|(g, dz)| *g += b * dz);
            }
        }
    }

    /// Gradients by all features, vertex-major.
    pub(crate) fn feature_gradients(&self) -> &[f32] {
        &self.feature_gradients
    }
}

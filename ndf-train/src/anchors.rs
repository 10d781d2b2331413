//! Anchors: points of the base mesh that must go to given places (supplement, Eq. 3).

use std::sync::Arc;

use ndf_core::{DVec3, Hint};
use ndf_mesh::TriangleTree;
use ndf_model::DisplacementField;
use ndf_network::Packed;

use crate::batch::Sample;
use crate::objective::Objective;
use crate::step::{Chunk, Model, Step};
use crate::terms::{PointTarget, Target};

/// Anchors with the memory for their gradients.
pub(crate) struct Anchors {
    samples: Vec<Sample>,
    targets: Vec<Target>,
    objective: Objective,
    chunk: Chunk,
}

impl Anchors {
    /// Anchors of normalised points near the base mesh and the places of their images. Pairs that are not finite are
    /// left out.
    pub(crate) fn new(
        field: &DisplacementField,
        pairs: &[(DVec3, DVec3)],
        weight: f32,
        theta: &Packed,
    ) -> Self {
        let tree = TriangleTree::new(field.base());
        let found: Vec<(Sample, Target)> = pairs
            .iter()
            .filter(|(_, q)| q.is_finite())
            .filter_map(|&(p, q)| {
                let closest = tree.closest_point(p, Hint::NONE)?;
                let up = [0.0, 0.0, 1.0];
                let foot = q.as_vec3().to_array();
                Some((Sample::new(&closest.at), Target { foot, normal: up, surface_normal: up }))
            })
            .collect();
        let (samples, targets): (Vec<Sample>, Vec<Target>) = found.into_iter().unzip();
        let objective =
            Objective { terms: vec![(weight, Arc::new(PointTarget))], lambda_c: 0.0, is_identity: false };
        Self { chunk: Chunk::new(theta, None, &objective), objective, samples, targets }
    }

    /// Adds the gradients of the network, and those of the features per corner of a base face.
    pub(crate) fn accumulate(&mut self, model: Model<'_>, to_theta: &mut [f32], to_corners: &mut [f32]) {
        pulp::Arch::new().dispatch(Step {
            model,
            objective: &self.objective,
            share: 1.0,
            chunk: &mut self.chunk,
            samples: &self.samples,
            targets: &self.targets,
            origins: &[],
            first_face: 0,
            corner_gradients: to_corners,
        });
        self.chunk.theta_gradients.add_to(to_theta);
    }
}

//! What the images of points are compared with.

use ndf_core::glam::Vec3;
use ndf_core::{DVec3, Hint};
use ndf_mesh::TriangleTree;
use ndf_model::file::StoredBase;

use super::place::Place;

/// What is known of the surface near the image of a sample: the answer of the last projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The foot.
    pub foot: Vec3,
    /// Unit gradient of the distance at the image when it was projected: the surface is taken as the plane through
    /// the foot with this normal. Zero where the image had no foot.
    pub normal: Vec3,
    /// Unit outward normal of the surface at the foot. Zero where the image had no foot.
    pub surface_normal: Vec3,
}

impl Target {
    /// No foot was found.
    pub const NONE: Self = Self { foot: Vec3::ZERO, normal: Vec3::ZERO, surface_normal: Vec3::ZERO };

    /// A point that an image should come to. Its normals are any: only points are compared.
    pub fn point(foot: Vec3) -> Self {
        Self { foot, normal: Vec3::Z, surface_normal: Vec3::Z }
    }

    /// Whether there is a foot.
    pub fn is_found(&self) -> bool {
        self.normal != Vec3::ZERO
    }
}

/// Points of the base mesh that a term brings along, with what their images are compared with.
#[derive(Clone, Debug, Default)]
pub struct FixedPoints {
    pub(crate) places: Vec<Place>,
    pub(crate) targets: Vec<Target>,
}

impl FixedPoints {
    /// The points of the base mesh closest to the first of each pair; the second is the foot of the target. Both are in the
    /// coordinates of the surface. Pairs that are not finite are left out.
    pub fn new(base: &StoredBase, pairs: &[(DVec3, DVec3)]) -> Self {
        let (tree, similarity) = (TriangleTree::new(&base.mesh), &base.similarity);
        let mut points = Self::default();
        for &(p, q) in pairs.iter().filter(|(_, q)| q.is_finite()) {
            if let Some(closest) = tree.closest_point(similarity.to_normalised(p), Hint::NONE) {
                points.places.push(Place::new(&closest.at));
                points.targets.push(Target::point(similarity.to_normalised(q).as_vec3()));
            }
        }
        points
    }
}

//! What the images of points are compared with.

use ndf_core::glam::Vec3;

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

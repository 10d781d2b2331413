//! Where samples are.

use ndf_mesh::{Face, FacePoint};

/// A point of the stored base mesh, in single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Place {
    pub(crate) face: Face,
    pub(crate) barycentric: [f32; 3],
}

impl Place {
    pub(crate) fn new(sample: &FacePoint) -> Self {
        Self { face: sample.face, barycentric: sample.barycentric.map(|b| b as f32) }
    }

    pub(crate) fn on_face(&self) -> FacePoint {
        FacePoint { face: self.face, barycentric: self.barycentric.map(f64::from) }
    }
}

//! Lines on the surface, as wide as they are on the screen.

use ndf_core::DVec3;

use super::{Camera, Scene, Surfel};

/// Changes of a function that is linear on a face, from one pixel to the next.
pub(super) struct ScreenFrame {
    across: DVec3,
    upward: DVec3,
    gradients: [DVec3; 3],
}

impl ScreenFrame {
    /// The frame at a point of a face.
    pub(super) fn at(scene: &Scene<'_>, camera: &Camera, surfel: &Surfel) -> Self {
        let size = camera.pixel_size(surfel.hit.t);
        // One pixel aside, the ray meets the plane of the face at this offset.
        let slope = surfel.direction.dot(surfel.face_normal).min(-0.03);
        let step = |side: DVec3| size * (side - surfel.direction * (side.dot(surfel.face_normal) / slope));
        let corners = scene.mesh.corner_positions(surfel.hit.at.face);
        let cross = scene.mesh.face_cross(surfel.hit.at.face);
        let opposite = |k: usize| corners[(k + 2) % 3] - corners[(k + 1) % 3];
        let gradients = [0, 1, 2].map(|k| cross.cross(opposite(k)) / cross.length_squared());
        Self { across: step(camera.right()), upward: step(camera.up()), gradients }
    }

    /// Change a pixel of the function with this gradient.
    fn slope(&self, gradient: DVec3) -> f64 {
        gradient.dot(self.across).hypot(gradient.dot(self.upward))
    }

    /// How much of a pixel the nearest edge of the face covers, for lines of this width in pixels.
    pub(super) fn edge_coverage(&self, barycentric: [f64; 3], width: f64) -> f32 {
        let distances = [0, 1, 2].map(|k| barycentric[k] / self.slope(self.gradients[k]));
        // Where faces are as small as lines are wide, lines would cover everything.
        let height = [0, 1, 2].map(|k| self.slope(self.gradients[k]).recip()).into_iter().fold(0.0, f64::max);
        coverage(distances.into_iter().fold(f64::INFINITY, f64::min), 0.5 * width)
            * fade(height / (4.0 * width))
    }

    /// How much of a pixel the nearest of the lines at `low + k · spacing`, 0 < k ≤ `count`, covers.
    pub(super) fn isoline_coverage(
        &self,
        corners: [f64; 3],
        value: f64,
        (low, spacing, count): (f64, f64, u32),
        width: f64,
    ) -> f32 {
        let gradient: DVec3 = self.gradients.iter().zip(corners).map(|(&g, v)| g * v).sum();
        let k = ((value - low) / spacing).round().clamp(1.0, f64::from(count));
        let slope = self.slope(gradient);
        coverage((value - low - k * spacing).abs() / slope, 0.5 * width)
            * fade(spacing / slope / (2.0 * width))
    }
}

/// Share of a pixel at `distance` from the middle of a line; 0 for NaN.
pub(super) fn coverage(distance: f64, half_width: f64) -> f32 {
    let share = (half_width + 0.5 - distance).clamp(0.0, 1.0);
    if share.is_nan() { 0.0 } else { share as f32 }
}

/// From 0 at 0.5 and below to 1 at 1.5 and above: lines vanish gently where they crowd.
fn fade(room: f64) -> f32 {
    let x = (room - 0.5).clamp(0.0, 1.0);
    if x.is_nan() { 0.0 } else { (x * x * (3.0 - 2.0 * x)) as f32 }
}

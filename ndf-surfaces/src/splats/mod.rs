//! 3D Gaussian splats (Kerbl, Kopanas, Leimkühler and Drettakis 2023): clouds of translucent Gaussians.

mod density;
mod files;
#[cfg(any(test, feature = "samples"))]
pub mod samples;
#[cfg(test)]
mod tests;

use ndf_core::DVec3;

pub use density::{DensityOptions, SplatDensity, SplatReport};
pub use files::{SplatError, SplatFormat, parse_splats, splat_format, write_splats};

/// A Gaussian: opacity times exp(−½ ρ²), ρ the distance in units of its standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Splat {
    /// Its centre.
    pub center: [f32; 3],
    /// Standard deviations along its own axes.
    pub scales: [f32; 3],
    /// From its own axes to those of space: a quaternion w, x, y, z, of any length but zero.
    pub rotation: [f32; 4],
    /// Opacity at the centre, in `[0, 1]`.
    pub opacity: f32,
}

impl Splat {
    /// Whether everything is finite and the scales are not negative.
    pub fn is_sound(&self) -> bool {
        let numbers = self.center.iter().chain(&self.scales).chain(&self.rotation).chain([&self.opacity]);
        numbers.clone().all(|x| x.is_finite())
            && self.scales.iter().all(|&s| s >= 0.0)
            && self.rotation.iter().any(|&q| q != 0.0)
    }

    /// Its axes in space, columns of a rotation.
    fn axes(&self) -> [DVec3; 3] {
        let [w, x, y, z] = self.rotation.map(f64::from);
        let rotation = ndf_core::glam::DQuat::from_xyzw(x, y, z, w).normalize();
        DVec3::AXES.map(|axis| rotation * axis)
    }
}

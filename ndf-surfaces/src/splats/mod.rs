//! 3D Gaussian splats (Kerbl, Kopanas, Leimkühler and Drettakis 2023): clouds of translucent Gaussians.

mod density;
mod merging;
#[cfg(test)]
mod tests;

pub use density::{DensityOptions, NoSplats, SplatDensity, SplatReport, SplatRule};

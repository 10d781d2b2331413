//! Surfaces of every representation, behind [`ndf_core::Surface`]: one module each.

mod crossings;
pub mod level_set;
pub mod levels;
pub mod mesh_surface;
pub mod narrow_band;
#[cfg(feature = "networks")]
pub mod networks;
pub mod point_cloud;
pub mod pseudonormals;
pub mod sheets;
pub mod splats;
pub mod winding_number;

pub use level_set::{LevelSearch, LevelSetSurface};
pub use mesh_surface::{EmptyMesh, MeshSurface};
pub use narrow_band::{BandOptions, NarrowBand};
pub use winding_number::{PointWindingNumber, WindingNumber};

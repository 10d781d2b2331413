//! Neural displacement fields: open a surface of any representation, learn it, extract meshes and compute on them.
//!
//! This crate does what the program `ndf` does, with the same defaults and the same bytes.

pub mod analysis;
pub mod band;
pub mod base;
pub mod describe;
pub mod figures;
pub mod files;
mod fit;
mod kind;
mod model;
mod note;
pub mod open;
pub mod presets;
pub mod scalars;
pub mod text;
mod triangulated;

pub use describe::describe;
pub use files::{begins_as_model, read_mesh, read_model};
pub use fit::{Fit, FitError, Fitted};
pub use kind::{Kind, UnknownKind};
pub use model::{EdgeLength, Extracted, ModelExt};
pub use note::Note;
pub use open::{
    Level, LevelRule, OpenError, OpenOptions, Opened, open, open_bytes, open_cloud, open_mesh, open_with,
};
pub use presets::Preset;
pub use scalars::{store_scalars, stored_scalars};
pub use triangulated::{
    DistanceError, DistanceMethod, DistanceOptions, Distances, NoTriangulation, Place, Triangles,
    Triangulated,
};

pub use ndf_core::{DVec3, NoProgress, Progress, Surface};
pub use ndf_mesh::{ManifoldMesh, TriangleMesh};
pub use ndf_model::Model;
pub use ndf_train::{Checkpoint, FitReport, Settings};

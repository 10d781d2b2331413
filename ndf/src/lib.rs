//! Neural displacement fields: open a surface of any representation, learn it, extract meshes and compute on them. This
//! crate does what the program `ndf` does, with the same defaults and the same bytes.
//!
//! ```no_run
//! use ndf::{DistanceOptions, EdgeLength, Fit, ModelExt, NoProgress, OpenOptions, Place, Triangulated, Vertex};
//!
//! // A mesh, a scan, a checkpoint or splats: the content decides.
//! let scan = ndf::open("scan.e57", &OpenOptions::default())?;
//! let model = Fit::new(&scan).base_faces(4000).run()?.model;
//! std::fs::write("scan.ndf", model.to_bytes())?;
//!
//! // Lengths are in the units of the scan.
//! let mesh = Triangulated::from_model(&model, EdgeLength::World(0.5), &NoProgress)?;
//! let distances = mesh.distances(&[Place::Vertex(Vertex(0))], &DistanceOptions::default(), &NoProgress)?;
//! println!("vertex 1 is {} away", distances.values[1]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! - **Opening**: [`open()`], [`open_mesh`], [`open_cloud`], [`Opened::from_surface`]; [`describe()`] says what a file
//!   holds.
//! - **Learning**: [`Fit`], with the [defaults of every kind](presets).
//! - **Models**: [`ModelExt`] extracts meshes; [`store_scalars_on_levels`] and [`store_scalars`] keep
//!   scalars on them.
//! - **Analysis**: [`Triangulated`] has distances, paths, eigenmodes, tangent fields and heat of a mesh or a model; [`evaluate`] has how far they
//!   are from those of another mesh.
//!
//! What was left out, changed or is doubtful is a [`Note`]. Nothing is printed. Long work takes a [`Progress`] and can
//! be stopped.

pub mod analysis;
pub mod band;
pub mod base;
pub mod describe;
pub mod deviations;
mod error;
pub mod evaluate;
pub mod figures;
pub mod files;
mod fit;
mod kind;
pub mod left_out;
mod model;
mod note;
pub mod open;
mod opened;
pub mod presets;
pub mod range;
pub mod scalars;
mod size_search;
pub mod text;
mod triangulated;

pub use error::Error;
pub use files::{begins_as_model, read_mesh, read_model};
pub use fit::{Field, Fit, FitError, Fitted, Record};
pub use kind::{Kind, UnknownKind};
pub use model::{EdgeLength, Extracted, MAX_FACES, MAX_FACES_32_BIT, ModelExt};
pub use note::{NotDecimated, Note};
pub use open::{OpenError, OpenOptions, describe, open, open_bytes, open_cloud, open_mesh, open_with};
pub use opened::{BaseSource, Level, LevelRule, NoReference, Opened};
pub use presets::Preset;
pub use scalars::{store_scalars, store_scalars_on_levels, stored_scalars};
pub use triangulated::{
    Alignment, Directions, DistanceError, DistanceMethod, DistanceOptions, DistanceSolver, Distances, Heat,
    HeatOptions, HeatReport, InitialHeat, LogMap, NoTriangulation, Place, SignedDistance,
    SignedDistanceOptions, Singularity, StraightPath, SurfaceCentre, SurfaceFieldError, SurfaceFields,
    SurfacePath, Transported, Triangles, Triangulated,
};

pub use ndf_core::{DVec3, NoProgress, Progress, Surface};
pub use ndf_fields::{CentreKind, DirectionField, FieldError, ZeroSet};
pub use ndf_formats::point_cloud::CloudOptions;
pub use ndf_geodesic::{GeodesicError, ThroughOptions};
pub use ndf_intrinsic::{ExtractionError, ExtractionReport};
pub use ndf_mesh::repair::{Parts, RepairOptions};
pub use ndf_mesh::{ManifoldMesh, TriangleMesh, Vertex};
pub use ndf_model::file::ModelError;
pub use ndf_model::{LengthFactors, Model};
pub use ndf_surfaces::networks::{Activation, NetworkOptions};
pub use ndf_train::{Checkpoint, FitReport, MetricReport, Settings};

/// The examples of the repository's README are tests.
#[cfg(doctest)]
#[doc = include_str!("../../README.md")]
struct Readme;

//! The model: a displacement field on a base mesh, scalar fields on it, the similarity to the user's units, and the
//! `.ndf` file that holds them.
//!
//! [`IntrinsicNetwork`] is the heart of both kinds of field: a perceptron fed by features at the vertices of a base mesh.
//! Networks are `f32`, geometry is `f64`; the conversion happens in one place, [the displacement
//! field](displacement_field).
//!
//! ```
//! use ndf_mesh::sampling::AreaSampler;
//! use ndf_mesh::{ManifoldMesh, shapes};
//! use ndf_model::{DisplacementField, FieldShape, Model, Similarity};
//!
//! // A field that was not trained is the identity of its base mesh.
//! let base = ManifoldMesh::try_from(shapes::torus(24, 12, 1.0, 0.4))?;
//! let similarity = Similarity::from_bounds(&base.bounds());
//! let positions = base.positions().iter().map(|&p| similarity.to_normalised(p)).collect();
//! let field = DisplacementField::untrained(base.with_positions(positions), FieldShape::default(), 0)?;
//! let model = Model { field, similarity, metric: None, scalars: vec![], provenance: String::new() };
//!
//! let read = Model::from_bytes(&model.to_bytes())?;
//! let points = AreaSampler::new(read.field.base()).ok_or("no area")?.sample(100, 0, 0);
//! for (image, point) in read.field.map(&points).into_iter().zip(&points) {
//!     assert_eq!(image, point.position(read.field.base()));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod displacement_field;
pub mod file;
pub mod intrinsic_network;
pub mod levels;
mod mapped;
mod metric;
mod model;
pub mod scalars;
mod similarity;

pub use displacement_field::{DisplacementField, FieldShape};
pub use intrinsic_network::{ChannelIndex, IntrinsicNetwork, NetworkError, NetworkShape};
pub use mapped::Mapped;
pub use metric::{LengthFactors, Metric, MetricError};
pub use model::Model;
pub use scalars::SurfaceScalars;
pub use similarity::{BOX_HALF_SIDE, Similarity, SimilarityError};

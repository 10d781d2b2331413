//! Arguments that several commands share, and the values of the library they stand for.

mod boundary;
mod edge_length;
mod mesh_to_mesh;
mod numbers;
mod parts;
mod reading;
mod sources;
mod training;
mod triangulation;
mod up;

pub use boundary::Boundary;
pub use edge_length::EdgeLength;
pub use mesh_to_mesh::MeshToMesh;
pub use numbers::{Vertices, angle, bits, crease, length, point, seconds, share, vertices};
pub use parts::PartArguments;
pub use reading::Reading;
pub use sources::Sources;
pub use training::{PresetName, Training};
pub use triangulation::TriangulationArguments;
pub use up::UpArgument;

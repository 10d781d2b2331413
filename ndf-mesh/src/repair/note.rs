//! What a repair changed.

use std::fmt;

use serde::Serialize;

use crate::Vertex;

/// Something that was changed to make a manifold of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "note", rename_all = "snake_case")]
#[non_exhaustive]
pub enum RepairNote {
    /// Faces that name a vertex twice, repeat another or are not finite were left out.
    UnusableFaces {
        /// How many.
        faces: usize,
    },
    /// Vertices of borders were merged with others in the same place, or nearly so.
    VerticesMerged {
        /// How many.
        vertices: usize,
        /// Whether all had exactly the same positions as others.
        exactly: bool,
    },
    /// Fans of faces that met in one vertex got vertices of their own.
    FansSeparated,
    /// Some faces were turned to agree with the others, or outward.
    FacesTurned {
        /// How many.
        faces: usize,
    },
    /// All faces were turned outward.
    AllFacesTurned,
    /// Components were left out.
    ComponentsLeftOut {
        /// How many.
        components: usize,
        /// Faces they have.
        faces: usize,
        /// Their share of the area, from 0 to 1.
        area: f64,
    },
    /// No face that was kept uses these vertices.
    VerticesUnused {
        /// How many.
        vertices: usize,
        /// The first of them.
        first: Vertex,
    },
}

impl fmt::Display for RepairNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = |n: usize| if n == 1 { "" } else { "s" };
        match *self {
            Self::UnusableFaces { faces } => write!(f, "{faces} unusable face{} left out", plural(faces)),
            Self::VerticesMerged { vertices, exactly } => {
                let how = if exactly { "in the same place" } else { "nearly in the same place" };
                let what = if vertices == 1 { "vertex" } else { "vertices" };
                write!(f, "{vertices} {what} {how} as others merged with them")
            }
            Self::FansSeparated => f.write_str("fans of faces that met in one vertex were separated"),
            Self::FacesTurned { faces } => write!(f, "{faces} face{} turned to agree", plural(faces)),
            Self::AllFacesTurned => f.write_str("all faces turned outward"),
            Self::ComponentsLeftOut { components, faces, area } => write!(
                f,
                "{components} component{} of {faces} face{} left out, {:.1} % of the area",
                plural(components),
                plural(faces),
                100.0 * area
            ),
            Self::VerticesUnused { vertices: 1, first } => {
                write!(f, "vertex {first} is on no face that is used")
            }
            Self::VerticesUnused { vertices, first } => {
                write!(f, "{vertices} vertices, first {first}, are on no face that is used")
            }
        }
    }
}

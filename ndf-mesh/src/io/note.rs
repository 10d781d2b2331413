//! What readers tell of a file beside its content.

use std::fmt;

use serde::Serialize;

/// Something a reader changed or left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "note", rename_all = "snake_case")]
#[non_exhaustive]
pub enum ReadNote {
    /// Faces with more than three corners were cut into triangles.
    PolygonsCut {
        /// How many.
        faces: usize,
    },
    /// Faces with fewer than three corners were left out.
    FacesTooSmall {
        /// How many.
        faces: usize,
    },
    /// Bytes follow the last triangle that a binary STL announces.
    TrailingBytes {
        /// How many.
        bytes: usize,
    },
}

impl fmt::Display for ReadNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = |n: usize| if n == 1 { "" } else { "s" };
        match *self {
            Self::PolygonsCut { faces } => {
                write!(f, "{faces} face{} with more than three corners cut into triangles", plural(faces))
            }
            Self::FacesTooSmall { faces } => {
                write!(f, "{faces} face{} with fewer than three corners left out", plural(faces))
            }
            Self::TrailingBytes { bytes } => {
                write!(f, "{bytes} bytes after the last announced triangle were passed over")
            }
        }
    }
}

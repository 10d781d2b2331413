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
    /// Of these, some were not convex, or had several corners in a line, and were cut in their plane by Delaunay's rule.
    PolygonsNotConvex {
        /// How many.
        faces: usize,
    },
    /// Of these, some cross themselves in their plane, so that no cut has their area; they were cut into fans.
    PolygonsCrossed {
        /// How many.
        faces: usize,
    },
    /// Faces with more than three corners that are not flat: their surface depends on how they are cut.
    PolygonsNotFlat {
        /// How many.
        faces: usize,
    },
    /// Rows of a text file of PLY hold more than the header announces, which was passed over.
    LongRows {
        /// How many.
        rows: usize,
    },
    /// A binary STL announces no triangles, or as many as can be; those that its size tells were read.
    CountBySize {
        /// What it announces.
        announced: u32,
        /// How many there are.
        triangles: usize,
    },
    /// Vertices of a scene of glTF, which repeats them wherever normals or pictures change, were joined with others of their
    /// mesh in exactly the same place.
    SeamsJoined {
        /// How many are one with others now.
        vertices: usize,
    },
    /// Parts of a scene of glTF that are not made of triangles, or nowhere, were left out.
    PartsLeftOut {
        /// How many.
        parts: usize,
    },
    /// Meshes of a scene of glTF that a skeleton or morph targets move are in the pose in which they were made.
    BasePose {
        /// How many.
        meshes: usize,
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
            Self::PolygonsNotConvex { faces: 1 } => {
                f.write_str("1 of these faces is not convex, and was cut within its outline")
            }
            Self::PolygonsNotConvex { faces } => {
                write!(f, "{faces} of these faces are not convex, and were cut within their outlines")
            }
            Self::PolygonsCrossed { faces } => {
                write!(f, "the outline{} of {faces} of these faces cross themselves", plural(faces))
            }
            Self::PolygonsNotFlat { faces } => {
                write!(f, "{faces} of these faces are not flat; their surface depends on how they were cut")
            }
            Self::LongRows { rows } => {
                write!(
                    f,
                    "{rows} row{} hold more than the header announces, which was passed over",
                    plural(rows)
                )
            }
            Self::CountBySize { announced, triangles } => {
                write!(f, "it announces {announced} triangles; the {triangles} that its size tells were read")
            }
            Self::SeamsJoined { vertices } => {
                write!(
                    f,
                    "{vertices} vert{} joined with others in the same place, as glTF repeats them at seams",
                    if vertices == 1 { "ex" } else { "ices" }
                )
            }
            Self::PartsLeftOut { parts } => {
                write!(f, "{parts} part{} of points or lines left out", plural(parts))
            }
            Self::BasePose { meshes } => {
                write!(
                    f,
                    "{meshes} mesh{} that a skeleton or morph targets move read in the pose in which {} made",
                    if meshes == 1 { "" } else { "es" },
                    if meshes == 1 { "it was" } else { "they were" }
                )
            }
            Self::TrailingBytes { bytes } => {
                write!(f, "{bytes} bytes after the last announced triangle were passed over")
            }
        }
    }
}

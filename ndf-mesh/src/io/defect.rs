//! What is wrong with the content of a file.

use std::borrow::Cow;

use crate::manifold::NotManifold;
use crate::triangle_mesh::FaceIndexOutOfRange;

/// A clause for people, without the name of the file.
type Text = Cow<'static, str>;

/// What is wrong with the content of a file whose format is known.
///
/// All readers share these kinds: those of meshes here, and those of clouds, splats, tensors, networks and models in the
/// crates above. A program reacts to the variant or its [`code`](Self::code), a person reads the sentence.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FileDefect {
    /// The file holds fewer items than it announces: it was cut off.
    #[error("it ends after {found} of {expected} {items}")]
    EndsEarly {
        /// What was counted.
        items: &'static str,
        /// How many are announced.
        expected: u64,
        /// How many there are.
        found: u64,
    },
    /// The data ends too early, or announces more than there is: the file was cut off, or its header is wrong.
    #[error("{0}")]
    Truncated(Text),
    /// Data follows where the file should end.
    #[error("there are bytes after {0}")]
    TrailingBytes(&'static str),
    /// This checksum does not match.
    #[error("{0} does not match")]
    Checksum(&'static str),
    /// A line of a text file is not what the format has there.
    #[error("line {line}: {problem}")]
    Syntax {
        /// The line, from 1.
        line: usize,
        /// What is expected or wrong.
        problem: Text,
    },
    /// A line names a vertex that does not exist.
    #[error("line {line}: a face names vertex {index}, but there are {vertices} vertices")]
    LineIndex {
        /// The line, from 1.
        line: usize,
        /// The index, as in the file.
        index: i64,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A face names a vertex that does not exist.
    #[error(transparent)]
    FaceIndex(#[from] FaceIndexOutOfRange),
    /// Something that is needed is not there: an element, a property, a field, a tensor.
    #[error("{0}")]
    Missing(Text),
    /// Counts, sizes or shapes contradict each other.
    #[error("{0}")]
    Mismatch(Text),
    /// A value is out of its range, or of another kind than the format has.
    #[error("{0}")]
    Value(Text),
    /// A value is NaN or infinite.
    #[error("{0} is not finite")]
    NotFinite(&'static str),
    /// More than a reader takes on, whether or not the file has it.
    #[error("{0}")]
    TooLarge(Text),
    /// The format has it, but it is not read here: a variant, a version, a coding.
    #[error("{0}")]
    Unsupported(Text),
    /// The decoder of a container or a compression refuses the data, in its own words.
    #[error("{0}")]
    Undecodable(Text),
    /// The triangles are no oriented manifold, where one is needed.
    #[error(transparent)]
    NotManifold(#[from] NotManifold),
}

impl FileDefect {
    /// [`Truncated`](Self::Truncated), in these words.
    pub fn truncated(text: impl Into<Cow<'static, str>>) -> Self {
        Self::Truncated(text.into())
    }

    /// [`Missing`](Self::Missing), in these words.
    pub fn missing(text: impl Into<Cow<'static, str>>) -> Self {
        Self::Missing(text.into())
    }

    /// [`Mismatch`](Self::Mismatch), in these words.
    pub fn mismatch(text: impl Into<Cow<'static, str>>) -> Self {
        Self::Mismatch(text.into())
    }

    /// [`Value`](Self::Value), in these words.
    pub fn value(text: impl Into<Cow<'static, str>>) -> Self {
        Self::Value(text.into())
    }

    /// [`TooLarge`](Self::TooLarge), in these words.
    pub fn too_large(text: impl Into<Cow<'static, str>>) -> Self {
        Self::TooLarge(text.into())
    }

    /// [`Unsupported`](Self::Unsupported), in these words.
    pub fn unsupported(text: impl Into<Cow<'static, str>>) -> Self {
        Self::Unsupported(text.into())
    }

    /// [`Undecodable`](Self::Undecodable), in these words.
    pub fn undecodable(text: impl Into<Cow<'static, str>>) -> Self {
        Self::Undecodable(text.into())
    }

    /// A name of the kind of defect that stays the same between versions, for programs in other languages.
    pub fn code(&self) -> &'static str {
        match self {
            Self::EndsEarly { .. } | Self::Truncated(_) => "truncated",
            Self::TrailingBytes(_) => "trailing_bytes",
            Self::Checksum(_) => "checksum",
            Self::Syntax { .. } => "syntax",
            Self::LineIndex { .. } | Self::FaceIndex(_) => "index_out_of_range",
            Self::Missing(_) => "missing",
            Self::Mismatch(_) => "mismatch",
            Self::Value(_) => "invalid_value",
            Self::NotFinite(_) => "not_finite",
            Self::TooLarge(_) => "too_large",
            Self::Unsupported(_) => "unsupported",
            Self::Undecodable(_) => "undecodable",
            Self::NotManifold(_) => "not_manifold",
        }
    }
}

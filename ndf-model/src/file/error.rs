//! Why a file is not a model.

use ndf_mesh::io::FileDefect;
use safetensors::tensor::SafeTensorError;

use crate::intrinsic_network::{NetworkError, ShapeError};
use crate::levels::LevelsError;
use crate::metric::MetricError;
use crate::scalars::ScalarsError;
use crate::similarity::SimilarityError;

/// The version of files with levels, of the field or of scalars, or a metric. All up to it are read.
pub(super) const VERSION: u32 = 3;
/// The version of other files, which programs before version 3 read.
pub(super) const WITHOUT_LEVELS: u32 = 2;

/// Why bytes are not a model.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file cannot be read or written.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// Not a `.ndf` file.
    #[error("not an .ndf model: the file does not begin with the magic number")]
    Magic,
    /// Made by a later version.
    #[error("the model has format version {0}; this program reads up to version {newest}", newest = VERSION)]
    Version(u32),
    /// The header or the section table is damaged.
    #[error("the model is damaged: {0}")]
    Header(#[source] FileDefect),
    /// The checksum of a section does not match.
    #[error("the model is damaged: the checksum of section {0} does not match")]
    Checksum(String),
    /// A required section is not there.
    #[error("the model has no section {0}")]
    Missing(&'static str),
    /// A section does not make sense.
    #[error("section {section} of the model: {defect}")]
    Section {
        /// Its tag.
        section: &'static str,
        /// What is wrong.
        defect: PartDefect,
    },
}

/// What is wrong with a part of a model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PartDefect {
    /// Its data.
    #[error(transparent)]
    Data(#[from] FileDefect),
    /// The similarity.
    #[error(transparent)]
    Similarity(#[from] SimilarityError),
    /// The sizes of a network.
    #[error(transparent)]
    Shape(#[from] ShapeError),
    /// Features or parameters of a network.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// Levels of displacements.
    #[error(transparent)]
    Levels(#[from] LevelsError),
    /// The metric of the true surface.
    #[error(transparent)]
    Metric(#[from] MetricError),
    /// Scalar fields.
    #[error(transparent)]
    Scalars(#[from] ScalarsError),
}

impl PartDefect {
    /// A name of the kind of defect that stays the same between versions: see [`FileDefect::code`].
    pub fn code(&self) -> &'static str {
        match self {
            Self::Data(defect) => defect.code(),
            Self::Similarity(_) | Self::Metric(_) => "invalid_value",
            Self::Shape(_) | Self::Network(NetworkError::Shape(_)) => "too_large",
            Self::Scalars(ScalarsError::Network(error)) => Self::Network(error.clone()).code(),
            Self::Scalars(ScalarsError::TooMany(_) | ScalarsError::Nodes | ScalarsError::Irregular) => {
                "too_large"
            }
            Self::Scalars(ScalarsError::NotFinite) => "not_finite",
            Self::Scalars(ScalarsError::Integers) => "mismatch",
            Self::Scalars(_) => "invalid_value",
            Self::Network(NetworkError::Count { .. } | NetworkError::NoNetwork) => "mismatch",
            Self::Levels(
                LevelsError::Count(_) | LevelsError::Large(_) | LevelsError::Faces | LevelsError::Position,
            ) => "too_large",
            Self::Levels(LevelsError::Step(_) | LevelsError::Spacing) => "invalid_value",
            Self::Levels(LevelsError::Displacements { .. } | LevelsError::Control { .. }) => "mismatch",
            Self::Levels(LevelsError::NotFinite) => "not_finite",
            Self::Network(NetworkError::NotFinite(_) | NetworkError::BaseVertex(_)) => "not_finite",
        }
    }
}

/// Why tensors are not a model.
#[derive(Debug, thiserror::Error)]
pub enum TensorsError {
    /// The file is no `.safetensors`, or a damaged one.
    #[error("not a usable .safetensors file: {0}")]
    File(#[from] SafeTensorError),
    /// The file holds something else.
    #[error("the file has no model metadata, so it was not exported from a model")]
    NotAModel,
    /// The metadata cannot be read.
    #[error("the metadata of the model: {0}")]
    Metadata(#[from] serde_json::Error),
    /// A tensor has another type or shape.
    #[error("tensor {name}: {defect}")]
    Tensor {
        /// Its name.
        name: String,
        /// What is wrong with it.
        defect: FileDefect,
    },
    /// The parts do not fit together.
    #[error("the parts do not form a model: {0}")]
    Parts(PartDefect),
}

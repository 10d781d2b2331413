//! One error for all that this crate does, with codes for programs in other languages.

use ndf_formats::point_cloud;
use ndf_formats::splats::SplatError;
use ndf_formats::tensors::{PickleError, TensorError};
use ndf_geodesic::GeodesicError;
use ndf_intrinsic::ExtractionError;
use ndf_mesh::io::gltf::NotGlb;
use ndf_mesh::io::{ReadError, WriteError};
use ndf_meshing::{BaseMeshError, IsosurfaceError};
use ndf_model::file::{ModelError, PartDefect};
use ndf_spectral::SpectralError;
use ndf_surfaces::narrow_band::BandError;
use ndf_surfaces::networks::LayoutError;
use ndf_train::levels::LevelFitError;
use ndf_train::scalars::ScalarError;
use ndf_train::{CheckpointError, TrainError};

use crate::base::NoBaseMesh;
use crate::files::{NoMesh, NoModel};
use crate::scalars::ScalarsError;
use crate::{DistanceError, FitError, NoReference, NoTriangulation, OpenError};

/// Anything that can go wrong here. Every error of the crate converts into it; the message is that of its source.
#[derive(Debug, thiserror::Error)]
#[error(transparent)]
#[non_exhaustive]
pub enum Error {
    /// A surface could not be opened.
    Open(#[from] OpenError),
    /// A file is no usable mesh.
    Mesh(#[from] NoMesh),
    /// A file is no usable model.
    Model(#[from] NoModel),
    /// A file gives no triangulation.
    Triangulation(#[from] NoTriangulation),
    /// There is no base mesh.
    BaseMesh(#[from] NoBaseMesh),
    /// Nothing was learned.
    Fit(#[from] FitError),
    /// A checkpoint cannot be used.
    Checkpoint(#[from] CheckpointError),
    /// No mesh was extracted.
    Extraction(#[from] ExtractionError),
    /// There are no distances.
    Distances(#[from] DistanceError),
    /// There are no eigenmodes.
    Modes(#[from] SpectralError),
    /// No scalars were stored.
    Scalars(#[from] ScalarsError),
    /// No mesh stands for the surface.
    Reference(#[from] NoReference),
    /// A mesh file could not be written.
    Write(#[from] WriteError),
}

impl Error {
    /// All codes, each with what it says.
    pub const CODES: [(&str, &str); 43] = [
        // Files.
        ("io", "the system cannot read or write the file"),
        ("unrecognised", "the content is of no known format, or not of the one asked for"),
        ("newer_version", "the file was written by a later version"),
        ("not_built", "the reader of the format was left out of this build"),
        ("truncated", "the file was cut off, or announces more than it has"),
        ("trailing_bytes", "data follows where the file should end"),
        ("checksum", "a checksum does not match"),
        ("syntax", "a line of a text file is malformed"),
        ("index_out_of_range", "a face names a vertex that does not exist"),
        ("missing", "an element, property, tensor or section is missing"),
        ("mismatch", "counts, sizes or shapes contradict each other"),
        ("invalid_value", "a value in the file is out of range"),
        ("not_finite", "a value is NaN or infinite"),
        ("too_large", "more than is supported"),
        ("unsupported", "a variant of the format that is not read"),
        ("undecodable", "a decoder refuses the data"),
        ("not_manifold", "the triangles are no oriented manifold"),
        ("left_out", "too much of the area would be left out"),
        ("unwritable_name", "a file or property cannot have this name"),
        // Surfaces.
        ("is_model", "the file is a model, where a surface or a mesh is needed"),
        ("no_mesh", "the file is a surface of another kind, where a mesh is needed"),
        ("no_faces", "the mesh has no faces"),
        ("no_area", "nothing of the mesh has an area"),
        ("too_few_points", "the cloud has too few usable points"),
        ("no_normals", "normals were asked for, and there are none"),
        ("no_splats", "no splat is usable"),
        ("unknown_layout", "the tensors are of no known network"),
        ("no_latent", "the file has no such code of a shape"),
        ("wrong_kind", "the surface is of another kind than was asked for"),
        ("no_field", "there is no field of which an isosurface could be made"),
        ("no_isosurface", "the field has no usable isosurface"),
        // Options.
        ("invalid_option", "an option is out of range"),
        ("no_such_point", "a place is not on the mesh"),
        // Computations.
        ("out_of_reach", "the base mesh or the values are not near the surface"),
        ("other_terms", "the checkpoint is of a run with other terms"),
        ("diverged", "training diverged"),
        ("name_taken", "another scalar has the name"),
        ("unreached", "no source reaches the point"),
        ("path_lost", "a path could not be followed"),
        ("not_converged", "an iteration did not converge"),
        ("ill_conditioned", "the mesh is too distorted for double precision"),
        ("out_of_memory", "there is not enough memory"),
        ("cancelled", "the observer asked to stop"),
    ];

    /// What kind of error it is: one of [`CODES`](Self::CODES). Codes stay the same between versions, messages need not.
    pub fn code(&self) -> &'static str {
        match self {
            Self::Open(error) => open(error),
            Self::Mesh(error) => no_mesh(error),
            Self::Model(error) => model(&error.source),
            Self::Triangulation(error) => match error {
                NoTriangulation::Mesh(error) => no_mesh(error),
                NoTriangulation::Model(error) => model(&error.source),
                NoTriangulation::Extraction { source, .. } => extraction(source),
                NoTriangulation::LeftOut { .. } => "left_out",
                NoTriangulation::Range { .. } => "too_large",
            },
            Self::BaseMesh(error) => no_base_mesh(error),
            Self::Fit(error) => match error {
                FitError::NoBaseMesh(error) => no_base_mesh(error),
                FitError::Band(BandError::Extent) => "too_large",
                FitError::Band(BandError::Cancelled) | FitError::Cancelled => "cancelled",
                FitError::Training(error) => training(error),
                FitError::BaseFar { .. } => "out_of_reach",
                FitError::NotOfLevels(_) => "invalid_option",
                FitError::OtherSurface => "mismatch",
                FitError::Levels(error) => match error {
                    LevelFitError::Cancelled(_) => "cancelled",
                    LevelFitError::Option(_) => "invalid_option",
                    LevelFitError::Levels(error) => PartDefect::Levels(*error).code(),
                    LevelFitError::NoArea => "no_area",
                    LevelFitError::OutOfReach => "out_of_reach",
                },
            },
            Self::Checkpoint(error) => checkpoint(error),
            Self::Extraction(error) => extraction(error),
            Self::Distances(error) => match error {
                DistanceError::NotManifold(_) => "not_manifold",
                DistanceError::NoVertex { .. }
                | DistanceError::Unused { .. }
                | DistanceError::NoFace(_)
                | DistanceError::NoPoint(_) => "no_such_point",
                DistanceError::Geodesic(error) => geodesic(error),
            },
            Self::Modes(error) => spectral(error),
            Self::Scalars(error) => match error {
                ScalarsError::Learning(error) => scalars(error),
                ScalarsError::Cancelled { .. } => "cancelled",
                ScalarsError::Taken { .. } => "name_taken",
            },
            Self::Reference(error) => match error {
                NoReference::NoField => "no_field",
                NoReference::Isosurface(error) => isosurface(error),
            },
            Self::Write(error) => match error {
                WriteError::Io { .. } => "io",
                WriteError::UnknownExtension { .. }
                | WriteError::NoLines { .. }
                | WriteError::ScalarName { .. }
                | WriteError::ScalarTwice { .. } => "unwritable_name",
                WriteError::ScalarLength { .. } => "mismatch",
                WriteError::Glb { source, .. } => match source {
                    NotGlb::NotFinite { .. } => "not_finite",
                    NotGlb::TooLarge { .. } => "too_large",
                    NotGlb::ScalarLength { .. } => "mismatch",
                },
            },
        }
    }
}

fn checkpoint(error: &CheckpointError) -> &'static str {
    match error {
        CheckpointError::Io(_) => "io",
        CheckpointError::Magic => "unrecognised",
        CheckpointError::Content(defect) => defect.code(),
        CheckpointError::Model(error) => model(error),
        CheckpointError::Settings(_) | CheckpointError::Levels(_) => "invalid_value",
    }
}

fn open(error: &OpenError) -> &'static str {
    match error {
        OpenError::Io { .. } | OpenError::Shard { .. } => "io",
        OpenError::Model { .. } => "is_model",
        OpenError::ModelFile { source, .. } => model(source),
        OpenError::CheckpointFile { source, .. } => checkpoint(source),
        OpenError::Unrecognised { .. }
        | OpenError::Foreign { .. }
        | OpenError::NoNetwork { .. }
        | OpenError::Table { .. } => "unrecognised",
        OpenError::MeshFile(error) => mesh_file(error),
        OpenError::NoFaces { .. } => "no_faces",
        OpenError::TooFar { .. } | OpenError::Range { .. } => "too_large",
        OpenError::OneSided { .. } => "not_manifold",
        OpenError::LeftOut { .. } => "left_out",
        OpenError::NoArea { .. } | OpenError::EmptyMesh { .. } => "no_area",
        OpenError::CloudFile(error) => match error {
            point_cloud::ReadError::Io { .. } => "io",
            point_cloud::ReadError::Unrecognised { .. } | point_cloud::ReadError::Foreign { .. } => {
                "unrecognised"
            }
            point_cloud::ReadError::Malformed { defect, .. } => defect.code(),
            point_cloud::ReadError::NotBuilt { .. } => "not_built",
            point_cloud::ReadError::Mesh(error) => mesh_file(error),
            point_cloud::ReadError::TooFewPoints { .. } => "too_few_points",
        },
        OpenError::NoNormals { .. } => "no_normals",
        OpenError::Tensors { source, .. } => match source {
            TensorError::Magic => "unrecognised",
            TensorError::NotBuilt { .. } => "not_built",
            TensorError::Damaged(defect) => defect.code(),
            TensorError::Pickle(PickleError::CutOff) => "truncated",
            TensorError::Pickle(_) => "undecodable",
            TensorError::Kind { .. } => "unsupported",
            TensorError::Empty { .. } => "missing",
        },
        OpenError::Layout { source, .. } => match source {
            LayoutError::Unknown { .. } => "unknown_layout",
            LayoutError::Broken { defect, .. } => defect.code(),
            LayoutError::NotFinite => "not_finite",
            LayoutError::Latent { .. } | LayoutError::ActivationStated | LayoutError::NoSines { .. } => {
                "mismatch"
            }
            LayoutError::Framework(_) => "unsupported",
            LayoutError::Partial { .. } => "missing",
        },
        OpenError::NoCode { .. } => "no_latent",
        OpenError::OtherKind { .. } => "wrong_kind",
        OpenError::SplatFile { source, .. } => match source {
            SplatError::Unknown => "unrecognised",
            SplatError::Damaged(defect) => defect.code(),
            SplatError::NotBuilt { .. } => "not_built",
            SplatError::MissingProperty(_) => "missing",
            SplatError::Version(_) => "unsupported",
            SplatError::Empty => "no_splats",
        },
        OpenError::NoSplats { .. } => "no_splats",
        OpenError::Cancelled { .. } => "cancelled",
    }
}

fn mesh_file(error: &ReadError) -> &'static str {
    match error {
        ReadError::Io { .. } => "io",
        ReadError::Unrecognised { .. } | ReadError::Foreign { .. } => "unrecognised",
        ReadError::Malformed { defect, .. } => defect.code(),
    }
}

fn no_mesh(error: &NoMesh) -> &'static str {
    match error {
        NoMesh::Read(error) => mesh_file(error),
        NoMesh::Model { .. } => "is_model",
        NoMesh::Other { .. } => "no_mesh",
        NoMesh::NoFaces { .. } => "no_faces",
    }
}

fn model(error: &ModelError) -> &'static str {
    match error {
        ModelError::Io(_) => "io",
        ModelError::Magic => "unrecognised",
        ModelError::Version(_) => "newer_version",
        ModelError::Header(defect) => defect.code(),
        ModelError::Checksum(_) => "checksum",
        ModelError::Missing(_) => "missing",
        ModelError::Section { defect, .. } => defect.code(),
    }
}

fn no_base_mesh(error: &NoBaseMesh) -> &'static str {
    match error {
        NoBaseMesh::LeftOut(_) => "left_out",
        NoBaseMesh::NoVolume { .. } | NoBaseMesh::Making(BaseMeshError::NoField) => "no_field",
        NoBaseMesh::Making(BaseMeshError::Isosurface(error)) => isosurface(error),
        NoBaseMesh::Making(BaseMeshError::Cancelled) => "cancelled",
    }
}

fn isosurface(error: &IsosurfaceError) -> &'static str {
    match error {
        IsosurfaceError::GridSize(_) => "invalid_option",
        IsosurfaceError::TooLarge => "too_large",
        IsosurfaceError::Cancelled => "cancelled",
        IsosurfaceError::Bounds(_)
        | IsosurfaceError::NoCrossing { .. }
        | IsosurfaceError::WrongLipschitzBound(_) => "no_isosurface",
    }
}

fn training(error: &TrainError) -> &'static str {
    match error {
        TrainError::Settings(_) => "invalid_option",
        TrainError::NoArea => "no_area",
        TrainError::Field(error) => PartDefect::from(error.clone()).code(),
        TrainError::OtherTerms { .. } | TrainError::OtherTerm(_) => "other_terms",
        TrainError::Diverged { .. } => "diverged",
        TrainError::OutOfReach { .. } => "out_of_reach",
    }
}

fn extraction(error: &ExtractionError) -> &'static str {
    match error {
        ExtractionError::EdgeLength(_) => "invalid_option",
        ExtractionError::TooManyFaces(_) => "too_large",
        ExtractionError::NotFinite(_) => "not_finite",
        ExtractionError::Cancelled(_) => "cancelled",
    }
}

fn geodesic(error: &GeodesicError) -> &'static str {
    match error {
        GeodesicError::NoSource | GeodesicError::NotOnMesh { .. } => "no_such_point",
        GeodesicError::Cancelled(_) => "cancelled",
        GeodesicError::Unreached { .. } => "unreached",
        GeodesicError::PathLost { .. } => "path_lost",
        GeodesicError::TooManyWindows { .. } => "ill_conditioned",
        GeodesicError::Matrices(error) => spectral(error),
        // Options of the library beneath.
        _ => "invalid_option",
    }
}

fn spectral(error: &SpectralError) -> &'static str {
    match error {
        SpectralError::NoArea(_) | SpectralError::NoSurface => "no_area",
        SpectralError::NotFinite(_) => "not_finite",
        SpectralError::NotPositiveDefinite | SpectralError::Degenerate => "ill_conditioned",
        SpectralError::OutOfMemory(_) => "out_of_memory",
        SpectralError::NotConverged { .. } | SpectralError::SolveNotConverged(_) => "not_converged",
        SpectralError::Cancelled(_) => "cancelled",
        // Too many modes, a shift or another number that is not positive.
        _ => "invalid_option",
    }
}

fn scalars(error: &ScalarError) -> &'static str {
    match error {
        ScalarError::Settings(_) => "invalid_option",
        ScalarError::Length { .. } => "mismatch",
        ScalarError::NotFinite { .. } | ScalarError::FieldNotFinite(_) => "not_finite",
        ScalarError::NoArea | ScalarError::NoBaseArea => "no_area",
        ScalarError::Far { .. } => "out_of_reach",
        ScalarError::Diverged { .. } => "diverged",
        ScalarError::Cancelled(_) => "cancelled",
        ScalarError::Stored(error) => PartDefect::from(error.clone()).code(),
    }
}

#[cfg(test)]
mod tests;

//! Reading files: notes become warnings, and errors failures that say what to try.

use std::path::Path;

use ndf::files::{NoMesh, NoModel};
use ndf::{Model, NoTriangulation, OpenError, OpenOptions, Opened, Triangulated};
use ndf_mesh::io::MeshFile;
use ndf_model::file::ModelError;

use crate::arguments::TriangulationArguments;
use crate::context::Context;
use crate::output::Failure;

/// What to do where much would be left out.
pub const LARGEST: &str = "--largest-component allows it";

/// Opens a surface of any kind.
///
/// # Errors
/// If the file is of no known kind, is malformed, or holds no usable surface.
pub fn open(path: &Path, options: &OpenOptions, context: &Context) -> Result<Opened, Failure> {
    let opened = ndf::open_with(path, options, &context.progress()).map_err(|e| not_opened(&e))?;
    opened.notes.iter().for_each(|note| context.warn_of(&path.display(), note));
    Ok(opened)
}

/// The failure of opening a surface, with advice where there is some.
pub fn not_opened(error: &OpenError) -> Failure {
    let failure = Failure::new(error.to_string());
    match error {
        OpenError::Model { .. } => failure.try_instead("`ndf extract` makes a mesh of it"),
        OpenError::LeftOut { .. } => failure.try_instead(LARGEST),
        OpenError::OneSided { .. } => {
            failure.try_instead("`ndf geodesic` and `ndf spectrum` take it as it is")
        }
        OpenError::NoNormals { .. } => failure.try_instead("--as cloud finds normals"),
        OpenError::Table { .. } => {
            failure.try_instead("fit the decoder they are for, and give the codes with --latent")
        }
        _ => failure,
    }
}

/// Reads a model.
///
/// # Errors
/// If it cannot be read or is damaged.
pub fn read_model(path: &Path) -> Result<Model, Failure> {
    ndf::read_model(path).map_err(|error| no_model(&error))
}

/// The failure of reading a model.
fn no_model(error: &NoModel) -> Failure {
    let failure = Failure::new(error.to_string());
    match error.source {
        ModelError::Magic if error.what == Some("a checkpoint") => {
            failure.try_instead("`ndf fit --resume` makes a model of it")
        }
        ModelError::Magic if error.what.is_some() => failure.try_instead("`ndf fit` makes one of it"),
        ModelError::Magic => failure.try_instead("`ndf fit` makes models"),
        _ => failure,
    }
}

/// Reads a mesh file that must have faces; its notes are told as warnings.
///
/// # Errors
/// If it cannot be read or has no faces.
pub fn read_faces(path: &Path, context: &Context) -> Result<MeshFile, Failure> {
    let file = ndf::read_mesh(path).map_err(|error| no_mesh(&error))?;
    file.notes.iter().for_each(|&note| context.warn_of(&path.display(), &note.into()));
    Ok(file)
}

/// The failure of reading a mesh.
fn no_mesh(error: &NoMesh) -> Failure {
    let failure = Failure::new(error.to_string());
    match error {
        NoMesh::Other { what: "a checkpoint", .. } => {
            failure.try_instead("`ndf fit --resume` makes a model of it")
        }
        NoMesh::Other { .. } => failure.try_instead("`ndf mesh` makes one of it, and `ndf fit` a model"),
        NoMesh::Model { .. } => {
            failure.try_instead("`ndf extract` makes a mesh of it, and `ndf convert` one of its base mesh")
        }
        _ => failure,
    }
}

/// Reads what geodesics and spectra are computed on: a mesh, repaired to a manifold, or, where that cannot be, its usable
/// triangles; or the mesh of a model.
///
/// # Errors
/// If the input cannot be read, or is a model without an edge length.
pub fn read_triangulation(
    arguments: &TriangulationArguments,
    context: &Context,
) -> Result<Triangulated, Failure> {
    let path = &arguments.input;
    let opened = Triangulated::open(path, arguments.edge_length(), &arguments.repair(), &context.progress());
    let mut found = opened.map_err(|error| match error {
        NoTriangulation::Mesh(error) => no_mesh(&error),
        NoTriangulation::Model(error) => no_model(&error),
        NoTriangulation::NoEdgeLength { .. } => {
            Failure::new(error.to_string()).try_instead("say how fine with --edge-length")
        }
        NoTriangulation::LeftOut { .. } => Failure::new(error.to_string()).try_instead(LARGEST),
        error => error.into(),
    })?;
    found.notes.iter().for_each(|note| context.warn_of(&path.display(), note));
    if arguments.no_metric {
        found.factors = None;
    }
    Ok(found)
}

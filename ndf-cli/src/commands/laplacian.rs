//! `ndf laplacian`: the matrices of the Laplace–Beltrami operator, for those who compute elsewhere.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};
use ndf_formats::sparse::SymmetricMatrix;
use ndf_mesh::io::{atomic_write, format_to_write};
use ndf_spectral::{CsrMatrix, Mass, OperatorOptions};
use serde_json::json;

use crate::arguments::TriangulationArguments;
use crate::context::Context;
use crate::output::{Failure, Outcome, check_output, grouped, table};
use crate::streams::output_file;
use crate::triangulation::read_triangulation;

/// Arguments of `ndf laplacian`.
#[derive(Args, Debug)]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The stiffness matrix to write, positive semidefinite: for scipy.sparse.load_npz (.npz), or in Matrix Market's form (.mtx).
    #[arg(short, long, value_name = "MATRIX", value_parser = output_file("npz"))]
    output: PathBuf,
    /// Write the mass matrix, too, in squared units of length (.npz, .mtx).
    #[arg(long, value_name = "MATRIX")]
    mass: Option<PathBuf>,
    /// Write the mesh whose vertices are the rows, too.
    #[arg(long, value_name = "MESH")]
    mesh: Option<PathBuf>,
    /// The mass matrix.
    #[arg(long, value_enum, default_value_t)]
    masses: MassName,
    /// Use the triangles as they are, without flips to the intrinsic Delaunay triangulation.
    #[arg(long)]
    no_flips: bool,
}

/// Mass matrices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum MassName {
    /// Diagonal: a third of every triangle to each corner.
    #[default]
    Barycentric,
    /// Diagonal: what is nearest to each corner.
    Voronoi,
    /// That of linear finite elements.
    Consistent,
}

impl From<MassName> for Mass {
    fn from(name: MassName) -> Self {
        match name {
            MassName::Barycentric => Self::Barycentric,
            MassName::Voronoi => Self::MixedVoronoi,
            MassName::Consistent => Self::Consistent,
        }
    }
}

/// Forms in which matrices are written.
enum Form {
    Npz,
    MatrixMarket,
}

impl Form {
    fn of(path: &Path) -> Result<Self, Failure> {
        match path.extension().map(std::ffi::OsStr::to_ascii_lowercase) {
            Some(extension) if extension == "npz" => Ok(Self::Npz),
            Some(extension) if extension == "mtx" => Ok(Self::MatrixMarket),
            _ => Err(Failure::new(format!("{}: matrices are written as .npz or .mtx", path.display()))
                .try_instead("give the file one of these endings")),
        }
    }
}

/// Writes the matrices.
///
/// # Errors
/// If the input is no usable triangulation, or a file cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Arguments { triangulation, output, mass, mesh, masses, no_flips } = arguments;
    let form = Form::of(output)?;
    let mass = mass.as_ref().map(|path| Ok::<_, Failure>((path, Form::of(path)?))).transpose()?;
    mesh.as_deref().map(format_to_write).transpose()?;
    let outputs =
        || [Some(output), mass.as_ref().map(|(path, _)| *path), mesh.as_ref()].into_iter().flatten();
    for (i, path) in outputs().enumerate() {
        let earlier: Vec<&Path> = outputs().take(i).map(PathBuf::as_path).collect();
        check_output(path, &[&[triangulation.input.as_path()], earlier.as_slice()].concat())?;
    }
    let name = triangulation.input.display();
    context.expect(&["extraction"]);
    let found = read_triangulation(triangulation, None, context)?;
    let surface = &found.surface;
    let started = Instant::now();
    let options = OperatorOptions { mass: Mass::from(*masses), delaunay: !no_flips };
    let operator = surface.operator(options).map_err(|error| Failure::new(format!("{name}: {error}")))?;
    write(output, &form, operator.laplacian())?;
    if let Some((path, form)) = &mass {
        write(path, form, operator.mass())?;
    }
    if let Some(path) = mesh {
        context.write_mesh(path, surface.triangles.mesh(), &[])?;
    } else if !surface.has_vertices_of_mesh() {
        context.warn(&format!(
            "{name}: the rows are not the vertices of the file, of which some were joined, divided or left out; --mesh FILE writes \
             the mesh whose vertices they are"
        ));
    }
    let seconds = started.elapsed().as_secs_f64();
    let (vertices, entries) = (operator.vertex_count(), operator.laplacian().values().len());
    let mut json = json!({
        "seconds": seconds,
        "vertices": vertices,
        "entries": entries,
        "area": operator.area(),
        "components": operator.components().count(),
        "vertices_of_file": surface.has_vertices_of_mesh(),
        "area_left_out": surface.area_left_out,
    });
    let mut rows = vec![
        ("rows", grouped(vertices)),
        ("entries", grouped(entries)),
        ("parts", grouped(operator.components().count())),
        ("time", format!("{seconds:.2} s")),
    ];
    found.tell_metric(|factors| factors.operators, &mut json, &mut rows);
    found.tell(triangulation, &mut json, &mut rows);
    Ok(Outcome::new(json, format!("{}\n{}", output.display(), table(&rows))))
}

/// Writes a matrix.
fn write(path: &Path, form: &Form, matrix: &CsrMatrix) -> Result<(), Failure> {
    let matrix =
        SymmetricMatrix { offsets: matrix.offsets(), columns: matrix.columns(), values: matrix.values() };
    let written = atomic_write(path, |out| match form {
        Form::Npz => matrix.write_npz(out),
        Form::MatrixMarket => matrix.write_matrix_market(out),
    });
    written.map_err(|error| Failure::new(format!("{}: {error}", path.display())))
}

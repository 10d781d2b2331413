//! The commands, one file each.

pub mod batch;
pub mod centre;
pub mod completions;
pub mod convert;
pub mod decimate;
pub mod demo;
pub mod directions;
pub mod extract;
pub mod fit;
pub mod geodesic;
pub mod heat;
pub mod info;
pub mod laplacian;
pub mod logmap;
pub mod man;
pub mod measure;
pub mod mesh;
pub mod path;
pub mod remesh;
pub mod render;
pub mod repair;
pub mod sample;
pub mod scalars;
pub mod signed_distance;
pub mod spectrum;
pub mod stripes;
pub mod transport;
pub mod view;

use clap::Subcommand;

use crate::context::{Context, Options};
use crate::output::{Failure, Outcome};

/// What the program can be asked to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Fit an input or a built-in shape, extract, compute, and write a report with pictures
    Demo(demo::Arguments),
    /// Give a command to many inputs, a process each, with a row of what became of every one
    #[command(subcommand)]
    Batch(batch::Arguments),
    /// Find the mean or the median of points of a surface
    #[command(visible_alias = "center")]
    Centre(centre::Arguments),
    /// Write a model in another form: smaller, as plain arrays, or only its base mesh
    Convert(convert::Arguments),
    /// Print what a shell needs to complete the command line
    Completions(completions::Arguments),
    /// Make a mesh of fewer faces, as many as are wanted or as a distance allows
    Decimate(decimate::Arguments),
    /// Learn a surface and write a model of some ten kilobytes
    Fit(fit::Arguments),
    /// Extract a mesh from a model at any edge length
    Extract(extract::Arguments),
    /// Compute a smooth field of vectors, lines or crosses
    Directions(directions::Arguments),
    /// Compute geodesic distances and shortest paths
    Geodesic(geodesic::Arguments),
    /// Let heat flow over a surface
    Heat(heat::Arguments),
    /// Describe a file: counts, topology, defects
    Info(info::Arguments),
    /// Write the matrices of the Laplacian, for SciPy and others
    Laplacian(laplacian::Arguments),
    /// Compute how to get from a vertex to all others: the logarithmic map
    Logmap(logmap::Arguments),
    /// Write manual pages
    Man(man::Arguments),
    /// Mesh a surface directly, without learning
    Mesh(mesh::Arguments),
    /// Measure the distance between a mesh and a reference, in both directions
    Measure(measure::Arguments),
    /// Find a geodesic that winds as a chain of places does, or a closed one
    Path(path::Arguments),
    /// Make a mesh of another edge length
    Remesh(remesh::Arguments),
    /// Make a manifold of an imperfect mesh, and say which vertices are which
    Repair(repair::Arguments),
    /// Render a picture of a mesh, a model, points or a field
    Render(render::Arguments),
    /// Scalar fields stored in a model
    #[command(subcommand)]
    Scalars(scalars::Arguments),
    /// Compute signed distances from curves
    SignedDistance(signed_distance::Arguments),
    /// Compute the smallest eigenvalues and eigenfunctions of the Laplacian
    Spectrum(spectrum::Arguments),
    /// Compute evenly spaced stripes
    Stripes(stripes::Arguments),
    /// Carry a tangent vector from a vertex to all others
    Transport(transport::Arguments),
    /// Write a built-in shape
    Sample(sample::Arguments),
    /// Write a page that shows a model or a mesh in the browser, and computes on it there
    View(view::Arguments),
}

impl Command {
    /// Whether what the parser could not see is right.
    ///
    /// # Errors
    /// As the parser's.
    pub fn check(&self, options: &Options) -> Result<(), clap::Error> {
        match self {
            Self::Batch(arguments) => arguments.check(options),
            _ => Ok(()),
        }
    }

    /// Runs the command.
    ///
    /// # Errors
    /// With one sentence, if the work failed.
    pub fn run(&self, context: &Context) -> Result<Outcome, Failure> {
        match self {
            Self::Batch(arguments) => batch::run(arguments, context),
            Self::Centre(arguments) => centre::run(arguments, context),
            Self::Convert(arguments) => convert::run(arguments, context),
            Self::Completions(arguments) => completions::run(arguments, context),
            Self::Decimate(arguments) => decimate::run(arguments, context),
            Self::Demo(arguments) => demo::run(arguments, context),
            Self::Fit(arguments) => fit::run(arguments, context),
            Self::Extract(arguments) => extract::run(arguments, context),
            Self::Directions(arguments) => directions::run(arguments, context),
            Self::Geodesic(arguments) => geodesic::run(arguments, context),
            Self::Heat(arguments) => heat::run(arguments, context),
            Self::Info(arguments) => info::run(arguments, context),
            Self::Laplacian(arguments) => laplacian::run(arguments, context),
            Self::Logmap(arguments) => logmap::run(arguments, context),
            Self::Man(arguments) => man::run(arguments, context),
            Self::Mesh(arguments) => mesh::run(arguments, context),
            Self::Measure(arguments) => measure::run(arguments, context),
            Self::Path(arguments) => path::run(arguments, context),
            Self::Remesh(arguments) => remesh::run(arguments, context),
            Self::Repair(arguments) => repair::run(arguments, context),
            Self::Render(arguments) => render::run(arguments, context),
            Self::Scalars(arguments) => scalars::run(arguments, context),
            Self::SignedDistance(arguments) => signed_distance::run(arguments, context),
            Self::Spectrum(arguments) => spectrum::run(arguments, context),
            Self::Sample(arguments) => sample::run(arguments, context),
            Self::Stripes(arguments) => stripes::run(arguments, context),
            Self::Transport(arguments) => transport::run(arguments, context),
            Self::View(arguments) => view::run(arguments, context),
        }
    }
}

//! `ndf batch`: a command for many inputs, from a few to a hundred thousand, on one machine or on many.
//!
//! Every input is an item, which a process of its own does within its limits, and whose end is a row, however it ended. The
//! folder of a batch has a plan, so that those who work on parts (shards) of it do the same; rows are added as items end, so
//! that a batch that is killed goes on where it was. What merges and reports reads the rows of all parts.

mod arguments;
mod child;
mod flags;
mod gathered;
mod items;
mod merge;
mod plan;
mod recipe;
mod report;
mod rows;
mod run;
mod shard;
mod work;

use clap::Subcommand;

use crate::context::{Context, Options};
use crate::output::{Failure, Outcome};

use recipe::Recipe;

/// Arguments of `ndf batch`.
#[derive(Debug, Subcommand)]
pub enum Arguments {
    /// Learn every input: a model each
    Fit(arguments::Arguments),
    /// Extract a mesh from every model
    Extract(arguments::Arguments),
    /// Mesh every input directly
    Mesh(arguments::Arguments),
    /// Compute geodesic distances on every input
    Geodesic(arguments::Arguments),
    /// Compute signed distances from curves on every input
    SignedDistance(arguments::Arguments),
    /// Find the mean or the median of points on every input
    #[command(visible_alias = "center")]
    Centre(arguments::Arguments),
    /// Compute eigenvalues and eigenfunctions of every input
    Spectrum(arguments::Arguments),
    /// Compute a direction field on every input
    Directions(arguments::Arguments),
    /// Compute stripes on every input
    Stripes(arguments::Arguments),
    /// Carry a tangent vector over every input
    Transport(arguments::Arguments),
    /// Write the matrices of the Laplacian of every input
    Laplacian(arguments::Arguments),
    /// Compute the logarithmic map of every input
    Logmap(arguments::Arguments),
    /// Let heat flow over every input
    Heat(arguments::Arguments),
    /// Write every model in another form
    Convert(arguments::Arguments),
    /// Make a mesh of fewer faces of every input
    Decimate(arguments::Arguments),
    /// Make a mesh of another edge length of every input
    Remesh(arguments::Arguments),
    /// Make a manifold of every input
    Repair(arguments::Arguments),
    /// Render a picture of every input
    Render(arguments::Arguments),
    /// Describe every input
    Info(arguments::Arguments),
    /// Measure every input against one reference, which follows `--`
    Measure(arguments::Arguments),
    /// Put the rows of all parts together, in the order of the inputs
    Merge(merge::Arguments),
    /// Write tables and a page of what became of all inputs
    Report(report::Arguments),
}

impl Arguments {
    /// Whether the command that items are given to takes its options.
    ///
    /// # Errors
    /// As the command's own.
    pub fn check(&self, options: &Options) -> Result<(), clap::Error> {
        match self.part() {
            Part::Work(recipe, arguments) => arguments.check(recipe, options),
            Part::Merge(_) | Part::Report(_) => Ok(()),
        }
    }

    fn part(&self) -> Part<'_> {
        match self {
            Self::Fit(arguments) => Part::Work(&recipe::FIT, arguments),
            Self::Extract(arguments) => Part::Work(&recipe::EXTRACT, arguments),
            Self::Mesh(arguments) => Part::Work(&recipe::MESH, arguments),
            Self::Geodesic(arguments) => Part::Work(&recipe::GEODESIC, arguments),
            Self::SignedDistance(arguments) => Part::Work(&recipe::SIGNED_DISTANCE, arguments),
            Self::Centre(arguments) => Part::Work(&recipe::CENTRE, arguments),
            Self::Spectrum(arguments) => Part::Work(&recipe::SPECTRUM, arguments),
            Self::Directions(arguments) => Part::Work(&recipe::DIRECTIONS, arguments),
            Self::Stripes(arguments) => Part::Work(&recipe::STRIPES, arguments),
            Self::Transport(arguments) => Part::Work(&recipe::TRANSPORT, arguments),
            Self::Laplacian(arguments) => Part::Work(&recipe::LAPLACIAN, arguments),
            Self::Logmap(arguments) => Part::Work(&recipe::LOGMAP, arguments),
            Self::Heat(arguments) => Part::Work(&recipe::HEAT, arguments),
            Self::Convert(arguments) => Part::Work(&recipe::CONVERT, arguments),
            Self::Decimate(arguments) => Part::Work(&recipe::DECIMATE, arguments),
            Self::Remesh(arguments) => Part::Work(&recipe::REMESH, arguments),
            Self::Repair(arguments) => Part::Work(&recipe::REPAIR, arguments),
            Self::Render(arguments) => Part::Work(&recipe::RENDER, arguments),
            Self::Info(arguments) => Part::Work(&recipe::INFO, arguments),
            Self::Measure(arguments) => Part::Work(&recipe::MEASURE, arguments),
            Self::Merge(arguments) => Part::Merge(arguments),
            Self::Report(arguments) => Part::Report(arguments),
        }
    }
}

/// What there is to do.
enum Part<'a> {
    Work(&'static Recipe, &'a arguments::Arguments),
    Merge(&'a merge::Arguments),
    Report(&'a report::Arguments),
}

/// Does a part of a batch, or looks at all of it.
///
/// # Errors
/// If the folder of the batch is of another one, cannot be read or written, or lacks rows; or if the batch is interrupted. An
/// item that fails is a row and no error.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    match arguments.part() {
        Part::Work(recipe, arguments) => run::run(recipe, arguments, context),
        Part::Merge(arguments) => merge::run(arguments),
        Part::Report(arguments) => report::run(arguments, context),
    }
}

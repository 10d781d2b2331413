//! `ndf centre`: the mean or the median of points of a surface.

use std::time::Instant;

use clap::{Args, ValueEnum};
use ndf::{CentreKind, FieldError, GeodesicError, SurfaceFieldError};
use serde_json::json;

use crate::arguments::{Sources, TriangulationArguments, length};
use crate::context::Context;
use crate::output::{Failure, Outcome, grouped, readable, table};
use crate::triangulation::{no_field, read_triangulation};

/// Arguments of `ndf centre`.
#[derive(Args, Debug)]
#[command(group(Sources::required()))]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    #[command(flatten)]
    sources: Sources,
    /// The weight of a source: as many as there are sources, those of --source-vertex before those of --source [default: 1 each].
    #[arg(long, value_name = "W", allow_negative_numbers = true, value_parser = length)]
    weight: Vec<f64>,
    /// Which centre.
    #[arg(long = "kind", value_enum, default_value_t)]
    centre: Kind,
}

/// Kinds of centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Kind {
    /// The sum of squared distances is least (Karcher's mean, Fréchet's).
    #[default]
    Mean,
    /// The sum of distances is least.
    Median,
}

impl From<Kind> for CentreKind {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Mean => Self::Mean,
            Kind::Median => Self::Median,
        }
    }
}

/// Finds a centre.
///
/// # Errors
/// If the input is no usable triangulation, or sources are not on it, not joined, or not as many as their weights.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Arguments { triangulation, sources, weight, centre: kind } = arguments;
    let input = &triangulation.input;
    let places = sources.places();
    if !weight.is_empty() && weight.len() != places.len() {
        return Err(Failure::new(format!("{} weights for {} sources", weight.len(), places.len()))
            .try_instead("give --weight once for every source"));
    }
    context.expect(&["extraction", "distances", "centre"]);
    let read = read_triangulation(triangulation, sources.only_of_meshes(), context)?;
    let started = Instant::now();
    let weights = weight.iter().copied().chain(std::iter::repeat(1.0));
    let weighted: Vec<_> = places.iter().copied().zip(weights).collect();
    let fields = read.surface.fields().map_err(|error| no_field(input, error))?;
    let found = fields.centre(&weighted, (*kind).into(), &context.progress());
    let found = found.map_err(|error| match error {
        SurfaceFieldError::Field(FieldError::Distances(GeodesicError::Unreached { .. })) => {
            Failure::new(format!("{}: the sources are on several components", input.display()))
                .try_instead("a centre takes sources that paths join")
        }
        error => no_field(input, error),
    })?;
    let seconds = started.elapsed().as_secs_f64();
    let name = input.display();
    found.notes.iter().for_each(|note| context.warn_of(&name, note));
    if !found.has_converged {
        context.warn(&format!("{name}: the centre was not found in {} steps, and what is told is the last one; sources that lie closer together \
             have a centre that is",
            found.iterations));
    }
    let mesh = read.surface.mesh();
    let corners = mesh.faces()[found.point.face.index()];
    let barycentric = found.point.barycentric;
    let nearest = (0..3).max_by(|&a, &b| barycentric[a].total_cmp(&barycentric[b])).unwrap_or(0);
    let mut json = json!({
        "seconds": seconds,
        "position": found.position.to_array(),
        "face": found.point.face,
        "barycentric": barycentric,
        "vertex": corners[nearest],
        "variance": found.variance,
        "mean_distance": found.mean_distance,
        "max_distance": found.max_distance,
        "sources": places.len(),
        "iterations": found.iterations,
        "converged": found.has_converged,
        "area_left_out": read.surface.area_left_out,
    });
    let [x, y, z] = found.position.to_array().map(readable);
    let mut rows = vec![
        ("position", format!("({x}, {y}, {z})")),
        ("vertex", grouped(corners[nearest] as usize)),
        ("variance", readable(found.variance)),
        ("mean distance", readable(found.mean_distance)),
        ("farthest", readable(found.max_distance)),
        ("steps", grouped(found.iterations)),
        ("time", format!("{seconds:.2} s")),
    ];
    read.tell_metric(|factors| factors.distances, &mut json, &mut rows);
    read.tell(triangulation, &mut json, &mut rows);
    let what = match kind {
        Kind::Mean => "mean",
        Kind::Median => "median",
    };
    Ok(Outcome::new(json, format!("{name}: a local {what} of {} sources\n{}", places.len(), table(&rows))))
}

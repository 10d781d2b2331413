//! `ndf geodesic`: distances over a surface.

use std::path::PathBuf;
use std::time::Instant;

use clap::{Args, ValueEnum};
use ndf_core::{DVec3, Hint};
use ndf_geodesic::{ExactOptions, GeodesicError, HeatSolver, Path, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::io::{VertexScalars, format_to_write, write_mesh};
use ndf_mesh::{FacePoint, ManifoldMesh, SurfacePoint, TriangleTree};
use serde_json::{Value, json};

use crate::context::Context;
use crate::output::{Failure, Outcome, check_place, grouped, readable, table};
use crate::progress::ShownProgress;
use crate::triangulation::TriangulationArguments;

/// Points this near to a vertex or edge, in barycentric coordinates, are taken to be on it.
const SNAP: f64 = 1e-9;

/// Arguments of `ndf geodesic`.
#[derive(Args, Debug)]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The mesh to write, with the vertex scalar `distance` (.ply; .obj and .stl have no scalars).
    #[arg(short, long, value_name = "MESH")]
    output: PathBuf,
    #[command(flatten)]
    sources: Sources,
    /// How.
    #[arg(long, value_enum, default_value_t)]
    method: Method,
    /// Also find the shortest path from the nearest source to the surface's point closest to this one.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    path_to: Option<DVec3>,
}

/// Where distances are measured from; the nearest of all counts.
#[derive(Args, Debug)]
#[group(required = true, multiple = true)]
struct Sources {
    /// From the surface's point closest to this one; may be given several times.
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = point)]
    source: Vec<DVec3>,
    /// From the vertex of this number, counted from 0; may be given several times.
    #[arg(long, value_name = "I")]
    source_vertex: Vec<u32>,
}

/// Ways to measure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Exact distances on the triangles.
    #[default]
    Exact,
    /// The heat method: smooth, within about one per cent.
    Heat,
}

/// Measures distances over a surface.
///
/// # Errors
/// If the input cannot be read, a source is not on it, or the output cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    format_to_write(&arguments.output)?;
    check_place(&arguments.output)?;
    let name = arguments.triangulation.input.display();
    let mesh = arguments.triangulation.read(context)?;
    let started = Instant::now();
    let tree = TriangleTree::new(&mesh);
    let vertices = mesh.vertex_count();
    let mut sources = Vec::new();
    for &vertex in &arguments.sources.source_vertex {
        if vertex as usize >= vertices {
            let failure = Failure::new(format!("{name} has no vertex {vertex}"));
            return Err(failure.try_instead(&format!("its vertices are 0 to {}", vertices - 1)));
        }
        sources.push(SurfacePoint::Vertex(vertex));
    }
    for &position in &arguments.sources.source {
        sources.push(closest(&mesh, &tree, position)?);
    }
    let target = arguments.path_to.map(|position| closest(&mesh, &tree, position)).transpose()?;
    let intrinsic = IntrinsicMesh::of_mesh(&mesh);
    let progress = context.progress();
    let (distances, path) = measured(&intrinsic, &sources, arguments.method, target, &progress)
        .map_err(|e| Failure::new(format!("{name}: {e}")))?;
    drop(progress);
    let seconds = started.elapsed().as_secs_f64();
    let scalars =
        VertexScalars { name: "distance".to_owned(), values: distances.iter().map(|&d| d as f32).collect() };
    write_mesh(&arguments.output, &mesh, &[scalars])?;
    let unreached = distances.iter().filter(|d| d.is_infinite()).count();
    let max = distances.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
    let mut json = json!({
        "seconds": seconds,
        "vertices": vertices,
        "max_distance": max,
        "unreached": unreached,
    });
    let mut rows = vec![
        ("vertices", grouped(vertices)),
        ("farthest", readable(max)),
        ("unreached", grouped(unreached)),
        ("time", format!("{seconds:.3} s")),
    ];
    if let Some(path) = path {
        rows.push(("path", format!("{} in {} pieces", readable(path.length), path.points.len() - 1)));
        json["path"] = described(&path, &mesh);
    }
    let output = arguments.output.display();
    Ok(Outcome::new(json, format!("{output}: distances from {}\n{}", counted(sources.len()), table(&rows))))
}

fn counted(sources: usize) -> String {
    if sources == 1 { "1 source".to_owned() } else { format!("{} sources", grouped(sources)) }
}

/// Distances at all vertices, and the path to the target.
fn measured(
    mesh: &IntrinsicMesh,
    sources: &[SurfacePoint],
    method: Method,
    target: Option<SurfacePoint>,
    progress: &ShownProgress,
) -> Result<(Vec<f64>, Option<Path>), GeodesicError> {
    let options = ExactOptions::default();
    let distances = match method {
        Method::Exact if target.is_none() => {
            exact_distances(mesh, sources, &options, progress)?.distances().to_vec()
        }
        Method::Exact => {
            let geodesics =
                exact_distances(mesh, sources, &ExactOptions { keep_windows: true, ..options }, progress)?;
            let path = target.map(|t| geodesics.path_to(t)).transpose()?;
            return Ok((geodesics.distances().to_vec(), path));
        }
        Method::Heat => HeatSolver::new(mesh)?.distances(sources)?,
    };
    let path = match target {
        // The heat method has no paths of its own; the exact one need go no farther than the target.
        Some(target) => {
            let options = ExactOptions { keep_windows: true, targets: vec![target], ..options };
            Some(exact_distances(mesh, sources, &options, progress)?.path_to(target)?)
        }
        None => None,
    };
    Ok((distances, path))
}

/// The surface's point closest to a position, on a vertex or an edge if it is next to it.
///
/// # Errors
/// If the surface has no faces, or the position is not finite.
pub fn closest(mesh: &ManifoldMesh, tree: &TriangleTree, position: DVec3) -> Result<SurfacePoint, Failure> {
    let foot = tree
        .closest_point(position, Hint::NONE)
        .ok_or_else(|| Failure::new(format!("the surface has no point closest to {position}")))?;
    Ok(SurfacePoint::snapped(mesh, foot.at, SNAP))
}

/// A path as positions and as faces with barycentric coordinates, from the source on.
fn described(path: &Path, mesh: &ManifoldMesh) -> Value {
    let corner = |point: &SurfacePoint| {
        let FacePoint { face, barycentric } = point.in_some_face(mesh);
        json!({"face": face, "barycentric": barycentric, "position": point.position(mesh).to_array()})
    };
    let points: Vec<Value> = path.points.iter().rev().map(corner).collect();
    json!({"length": path.length, "source": path.source, "points": points})
}

/// Three numbers with commas between them.
fn point(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text.split(',').filter_map(|w| w.trim().parse().ok()).collect();
    match numbers[..] {
        [x, y, z] if text.split(',').count() == 3 && DVec3::new(x, y, z).is_finite() => {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err("three numbers like 0.5,-1,2 are expected".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_three_numbers() {
        assert_eq!(point("1,-2.5, 3e2"), Ok(DVec3::new(1.0, -2.5, 300.0)));
        for bad in ["", "1,2", "1,2,3,4", "1,2,x", "1,2,x,3", "1,2,inf"] {
            assert!(point(bad).is_err(), "{bad}");
        }
    }
}

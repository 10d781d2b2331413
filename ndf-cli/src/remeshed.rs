//! What the commands share that make a mesh of a mesh.

use std::path::Path;

use ndf::figures::ExtractionFigures;
use ndf::left_out::check_left_out;
use ndf::{Note, Parts};
use ndf_core::{DVec3, Hint};
use ndf_mesh::io::{MeshFile, VertexScalars};
use ndf_mesh::metrics::{MeasureError, MeasureOptions, Measurement, measure_with};
use ndf_mesh::repair::{Repaired, repaired};
use ndf_mesh::{ClosestPoint, ManifoldMesh, TriangleMesh, TriangleTree, Vertex};
use ndf_meshing::WithinError;
use serde_json::{Value, json};

use crate::arguments::MeshToMesh;
use crate::context::Context;
use crate::files::{LARGEST, read_faces};
use crate::output::{Failure, grouped, passes, readable};

/// Labels and values of a table.
pub type Rows = Vec<(&'static str, String)>;

/// Reads a mesh file and mends it to a manifold, and tells what was changed.
///
/// # Errors
/// If the file cannot be read, or the mesh is no manifold that can be had without inventing geometry.
pub fn read_manifold(meshes: &MeshToMesh, context: &Context) -> Result<(MeshFile, Repaired), Failure> {
    let name = meshes.input.display();
    let file = read_faces(&meshes.input, context)?;
    let options = meshes.parts.options(Parts::All);
    let mended = repaired(&file.mesh, &options).map_err(|error| {
        Failure::new(format!("{name} is {error}"))
            .try_instead("`ndf mesh` makes a manifold around what it encloses")
    })?;
    mended.notes.iter().for_each(|&note| context.warn_of(&name, &Note::from(note)));
    check_left_out(mended.area_left_out, options.parts)
        .map_err(|error| Failure::new(format!("{name}: {error}")).try_instead(LARGEST))?;
    Ok((file, mended))
}

/// The scalars of a file at the vertices of its mended mesh.
pub fn mended_scalars(file: &MeshFile, mended: &Repaired) -> Vec<VertexScalars> {
    let mut of = vec![None; mended.mesh.vertex_count()];
    for v in (0..file.mesh.vertex_count()).map(Vertex::new) {
        mended.origins.of_vertex(v).iter().for_each(|w| of[w.index()] = of[w.index()].or(Some(v)));
    }
    let at_vertices = |values: &[f32]| of.iter().map(|v| v.map_or(f32::NAN, |v| values[v.index()])).collect();
    let scalars = file.scalars.iter();
    scalars.map(|s| VertexScalars { name: s.name.clone(), values: at_vertices(&s.values) }).collect()
}

/// The scalars of a mended mesh at other points: those of the closest ones, linear over faces.
pub fn carried_scalars(mended: &ManifoldMesh, scalars: &[VertexScalars], to: &[DVec3]) -> Vec<VertexScalars> {
    if scalars.is_empty() {
        return Vec::new();
    }
    let tree = TriangleTree::new(mended);
    let places: Vec<_> = to.iter().map(|&p| tree.closest_point(p, Hint::NONE)).collect();
    let carried = |scalars: &VertexScalars| {
        let value = |place: &Option<ClosestPoint>| {
            let Some(place) = place else { return f32::NAN };
            let corners =
                mended.faces()[place.at.face.index()].map(|v| f64::from(scalars.values[v as usize]));
            place.at.interpolate(corners) as f32
        };
        VertexScalars { name: scalars.name.clone(), values: places.iter().map(value).collect() }
    };
    scalars.iter().map(carried).collect()
}

/// How far a mesh is from what it was made of, in both directions.
///
/// # Errors
/// If one of them has no area.
pub fn measured(
    name: &Path,
    from: &TriangleMesh,
    to: &TriangleMesh,
    context: &Context,
) -> Result<Measurement, Failure> {
    measure_with(from, to, &sampling(context), &context.progress()).map_err(|error| not_measured(name, error))
}

/// The samples by which distances are told, those of `ndf measure`.
pub fn sampling(context: &Context) -> MeasureOptions {
    MeasureOptions { seed: context.seed(), ..MeasureOptions::default() }
}

/// Why there is no mesh within a distance.
pub fn not_within(name: &Path, error: WithinError) -> Failure {
    match error {
        WithinError::Measure(error) => not_measured(name, error),
        WithinError::Edges(_) => {
            Failure::new(format!("{}: {error}", name.display())).try_instead("allow a larger --error")
        }
        error => Failure::new(format!("{}: {error}", name.display())),
    }
}

fn not_measured(name: &Path, error: MeasureError) -> Failure {
    let what = match error {
        MeasureError::Reference => "it has no area, or coordinates that are not finite",
        MeasureError::Mesh => "what is left of it has no area",
        MeasureError::NoSamples => "no samples were asked for",
        MeasureError::Cancelled(cancelled) => return Failure::new(cancelled.to_string()),
    };
    Failure::new(format!("{}: {what}", name.display())).try_instead("ndf info lists what is wrong with it")
}

/// What is told of a mesh that was made of another.
pub fn told(
    mesh: &ManifoldMesh,
    measured: &Measurement,
    seconds: f64,
    context: &Context,
) -> Result<(Value, Rows), Failure> {
    let figures = ExtractionFigures::of(mesh, None, &context.progress())?;
    let mut json = serde_json::to_value(&figures)?;
    json["seconds"] = seconds.into();
    json["hausdorff"] = measured.hausdorff.into();
    json["diagonal"] = measured.diagonal.into();
    json["distances"] = json!({
        "input_to_mesh": measured.reference_to_mesh,
        "mesh_to_input": measured.mesh_to_reference,
    });
    let mut rows = rows_of(&figures);
    let share = 100.0 * measured.hausdorff / measured.diagonal;
    rows.push((
        "farthest from the input",
        format!("{} ({share:.4} % of the diagonal)", readable(measured.hausdorff)),
    ));
    rows.push(("time", format!("{seconds:.3} s")));
    Ok((json, rows))
}

/// A mesh in words.
pub fn rows_of(figures: &ExtractionFigures) -> Rows {
    let (length, angle) = (&figures.edge_length, &figures.min_angle_deg);
    let plural = if figures.components == 1 { "" } else { "s" };
    vec![
        ("vertices", grouped(figures.vertices)),
        (
            "topology",
            format!(
                "{} component{plural}, Euler characteristic {}, {} boundary edges",
                figures.components,
                figures.euler_characteristic,
                grouped(figures.boundary_edges)
            ),
        ),
        (
            "edge length",
            format!("{} to {}, mean {}", readable(length.min), readable(length.max), readable(length.mean)),
        ),
        (
            "smallest angles",
            format!("{:.1}° at least, {:.1}° for all but 5 % of the faces", angle.min, angle.p5),
        ),
        ("self-intersections", passes(figures.self_intersections)),
        ("Delaunay edges", format!("{:.2} %", 100.0 * figures.delaunay_embedded_fraction)),
    ]
}

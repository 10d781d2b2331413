//! `ndf stripes`: evenly spaced stripes.

use std::path::PathBuf;
use std::time::Instant;

use clap::Args;
use ndf::{Alignment, DVec3};
use ndf_mesh::io::{VertexScalars, format_to_write, read_mesh};
use serde_json::json;

use super::directions::PROPERTIES;
use crate::arguments::{TriangulationArguments, angle, length};
use crate::context::Context;
use crate::output::{Failure, Outcome, check_output, grouped, readable, table};
use crate::streams::output_file;
use crate::triangulation::{no_field, read_triangulation};

/// Stripes that have fewer edges from one to the next are no longer seen.
const EDGES_FOR_A_STRIPE: f64 = 4.0;

/// Arguments of `ndf stripes`.
#[derive(Args, Debug)]
pub struct Arguments {
    #[command(flatten)]
    triangulation: TriangulationArguments,
    /// The mesh to write, with the vertex scalar `stripes`: 1 in the middle of stripes, -1 between them (.ply, .glb; other formats hold no
    /// scalars).
    #[arg(short, long, value_name = "MESH", value_parser = output_file("ply"))]
    output: PathBuf,
    /// Stripes for a unit of length.
    #[arg(long, value_name = "F", allow_negative_numbers = true, value_parser = length)]
    frequency: f64,
    /// Turn the lines that stripes cross by so many degrees to the left.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true, value_parser = angle)]
    angle: f64,
    /// A mesh of the same vertices with the lines that stripes cross, as `ndf directions` writes it [default: the smoothest lines].
    #[arg(long, value_name = "FILE.ply")]
    directions: Option<PathBuf>,
}

/// Computes a pattern of stripes.
///
/// # Errors
/// If the input is no usable triangulation, the directions are of another, the pattern is not found, or the mesh cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Arguments { triangulation, output, frequency, angle, directions } = arguments;
    let input = &triangulation.input;
    format_to_write(output)?;
    let mut inputs = vec![input.as_path()];
    inputs.extend(directions.as_deref());
    check_output(output, &inputs)?;
    context.expect(&["extraction", "factoring", "smoothest field", "factoring", "smoothest field"]);
    let read = read_triangulation(triangulation, None, context)?;
    let started = Instant::now();
    let mesh = read.surface.mesh();
    let fields = read.surface.fields().map_err(|error| no_field(input, error))?;
    let lines = match directions {
        Some(path) => fields.directions_of(2, &vectors_of(path, mesh.vertex_count())?),
        None => fields.directions(2, &Alignment::Free, &context.progress()),
    };
    let lines = lines.map_err(|error| no_field(input, error))?.field.turned(angle.to_radians());
    let (values, ends) =
        fields.stripes(&lines, *frequency, &context.progress()).map_err(|error| no_field(input, error))?;
    let seconds = started.elapsed().as_secs_f64();
    let per_stripe = 1.0 / (frequency * mean_edge(mesh));
    if per_stripe < EDGES_FOR_A_STRIPE {
        context.warn(&format!(
            "{}: from one stripe to the next there are {} edges only; take fewer stripes or smaller triangles",
            input.display(),
            readable(per_stripe)
        ));
    }
    let values = values.iter().map(|&x| x as f32).collect();
    context.write_mesh(output, mesh, &[VertexScalars { name: "stripes".to_owned(), values }])?;
    let mut json = json!({
        "seconds": seconds,
        "vertices": mesh.vertex_count(),
        "frequency": frequency,
        "stripe_ends": ends,
        "edges_per_stripe": per_stripe,
        "area_left_out": read.surface.area_left_out,
    });
    let mut rows = vec![
        ("vertices", grouped(mesh.vertex_count())),
        ("stripes begin or end", format!("in {} faces", grouped(ends))),
        ("edges a stripe", readable(per_stripe)),
        ("time", format!("{seconds:.2} s")),
    ];
    read.tell_metric(|factors| factors.distances, &mut json, &mut rows);
    read.tell(triangulation, &mut json, &mut rows);
    let what = format!("stripes, {} for a unit of length", readable(*frequency));
    Ok(Outcome::new(json, format!("{}: {what}\n{}", output.display(), table(&rows))))
}

/// The directions in a file for so many vertices.
fn vectors_of(path: &std::path::Path, vertices: usize) -> Result<Vec<DVec3>, Failure> {
    let file = read_mesh(path)?;
    let name = path.display();
    let found = file.mesh.vertex_count();
    if found != vertices {
        let both = format!("{name} has {} vertices, the surface {}", grouped(found), grouped(vertices));
        return Err(Failure::new(both).try_instead(
            "take the mesh that `ndf directions` wrote as the input, or the same --edge-length",
        ));
    }
    let column = |property: &str| {
        let found = file.scalars.iter().find(|scalars| scalars.name == property);
        found.map(|scalars| &scalars.values).ok_or_else(|| {
            Failure::new(format!("{name} has no property {property}"))
                .try_instead("`ndf directions --symmetry 2` writes such files")
        })
    };
    let [x, y, z] = PROPERTIES.map(column);
    let (x, y, z) = (x?, y?, z?);
    Ok((0..vertices).map(|v| DVec3::new(x[v].into(), y[v].into(), z[v].into())).collect())
}

/// Mean length of the sides of the triangles.
fn mean_edge(mesh: &ndf::TriangleMesh) -> f64 {
    let p = mesh.positions();
    let around =
        |f: &[u32; 3]| (0..3).map(|c| p[f[c] as usize].distance(p[f[(c + 1) % 3] as usize])).sum::<f64>();
    mesh.faces().iter().map(around).sum::<f64>() / (3 * mesh.face_count().max(1)) as f64
}

//! `ndf repair`: a manifold made of an imperfect mesh.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use ndf::figures::ExtractionFigures;
use ndf_mesh::Vertex;
use ndf_mesh::io::atomic_write;
use ndf_mesh::repair::Origins;

use crate::arguments::MeshToMesh;
use crate::context::Context;
use crate::output::{Failure, Outcome, check_output, grouped, is_same, table};
use crate::remeshed::{mended_scalars, read_manifold, rows_of};

/// Arguments of `ndf repair`.
#[derive(Args, Debug)]
pub struct Arguments {
    #[command(flatten)]
    meshes: MeshToMesh,
    /// Also write which vertices of the input those of the mesh are: a table (CSV) with a line for every pair. A vertex of the
    /// input that was merged with another has the same one, one whose faces were separated several, one that is left out none.
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
}

/// Mends a mesh.
///
/// # Errors
/// If the input is no mesh that can be mended, or a file cannot be written.
pub fn run(arguments: &Arguments, context: &Context) -> Result<Outcome, Failure> {
    let Arguments { meshes, map } = arguments;
    let MeshToMesh { input, output, .. } = meshes;
    meshes.check()?;
    if let Some(map) = map {
        check_output(map, &[input])?;
        if is_same(map, output) {
            let failure = Failure::new(format!("{} is the name of two outputs", map.display()));
            return Err(failure.try_instead("give each its own"));
        }
    }
    let started = Instant::now();
    let (file, mended) = read_manifold(meshes, context)?;
    let seconds = started.elapsed().as_secs_f64();
    context.write_mesh(output, &mended.mesh, &mended_scalars(&file, &mended))?;
    if let Some(map) = map {
        write_map(map, &mended.origins)
            .map_err(|e| Failure::new(format!("cannot write {}: {e}", map.display())))?;
    }
    let figures = ExtractionFigures::of(&mended.mesh, None, &context.progress())?;
    let mut json = serde_json::to_value(&figures)?;
    json["seconds"] = seconds.into();
    json["vertices_before"] = file.mesh.vertex_count().into();
    json["faces_before"] = file.mesh.face_count().into();
    json["notes"] = mended.notes.iter().map(ToString::to_string).collect::<Vec<_>>().into();
    json["area_left_out"] = mended.area_left_out.into();
    let mut rows = rows_of(&figures);
    let changed = match &mended.notes[..] {
        [] => "nothing: it is a manifold as it is".to_owned(),
        notes => notes.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "),
    };
    rows.push(("changed", changed));
    let text = format!(
        "{}: {} of {} faces\n{}",
        output.display(),
        grouped(figures.faces),
        grouped(file.mesh.face_count()),
        table(&rows)
    );
    Ok(Outcome::new(json, text))
}

/// Writes the pairs of vertices that are one, by those of the input.
fn write_map(path: &Path, origins: &Origins) -> std::io::Result<()> {
    atomic_write(path, |out| {
        writeln!(out, "input_vertex,vertex")?;
        for v in 0..origins.vertex_count() {
            origins.of_vertex(Vertex::new(v)).iter().try_for_each(|w| writeln!(out, "{v},{}", w.index()))?;
        }
        Ok(())
    })
}

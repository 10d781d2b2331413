//! The mesh that is drawn of a file, whatever it holds: a mesh itself, the mesh of a model, discs of points, or the isosurface
//! of a field.

use std::path::Path;

use ndf::files::NoMesh;
use ndf::open::{cloud_notes, unused};
use ndf::{Kind, Note, OpenOptions, TriangleMesh, stored_scalars};
use ndf_formats::point_cloud::{CloudFormat, read_cloud};
use ndf_mesh::io::{MeshFormat, VertexScalars};

use crate::arguments::{EdgeLength, Reading};
use crate::context::Context;
use crate::files::{model_mesh, no_mesh, open, told_faces};
use crate::output::{Failure, grouped};
use crate::render::{MAX_POINTS, Up, discs};

/// Cells along the longest side of an isosurface that is drawn: as many as `ndf mesh` takes.
const GRID: u32 = 128;

/// What is drawn of a file.
pub struct Drawn {
    /// `mesh`, `model`, `points` or `isosurface`.
    pub what: &'static str,
    /// Its triangles.
    pub mesh: TriangleMesh,
    /// Values at their vertices.
    pub scalars: Vec<VertexScalars>,
    /// Whether their sides mean nothing.
    pub two_sided: bool,
    /// What mostly points up in files of this kind.
    pub usual_up: Up,
}

/// Reads what is to be drawn. What is not drawn as it is, is told.
///
/// # Errors
/// If the file cannot be read, or there is nothing to be drawn.
pub fn read_drawn(
    path: &Path,
    reading: &Reading,
    length: EdgeLength,
    context: &Context,
) -> Result<Drawn, Failure> {
    let options = reading.options()?;
    let tell = |notes: Vec<Note>| notes.iter().for_each(|note| context.warn_of(&path.display(), note));
    if let Some(found) = model_mesh(path, length, context)? {
        tell(unused(&options, &[]));
        let scalars = stored_scalars(&found.model, &found.extracted);
        let mesh = found.extracted.mesh.into_triangle_mesh();
        return Ok(Drawn { what: "model", mesh, scalars, two_sided: false, usual_up: Up::Y });
    }
    match reading.kind {
        None | Some(Kind::Mesh) => match ndf::read_mesh(path) {
            Ok(file) => {
                tell(unused(&options, &[Kind::Mesh]));
                let file = told_faces(path, file, context);
                let usual_up = if file.format == MeshFormat::Stl { Up::Z } else { Up::Y };
                let (mesh, scalars) = (file.mesh, file.scalars);
                Ok(Drawn { what: "mesh", mesh, scalars, two_sided: false, usual_up })
            }
            Err(NoMesh::Other { what: "a point cloud", .. }) => of_cloud(path, &options, context),
            Err(NoMesh::Other { what, .. }) if what != "a checkpoint" => of_field(path, &options, context),
            Err(error) => Err(no_mesh(&error)),
        },
        Some(Kind::Cloud | Kind::OrientedCloud) => of_cloud(path, &options, context),
        Some(_) => of_field(path, &options, context),
    }
}

fn of_cloud(path: &Path, options: &OpenOptions, context: &Context) -> Result<Drawn, Failure> {
    let file = read_cloud(path, &options.cloud)?;
    let notes = cloud_notes(&file, options).into_iter().chain(unused(options, &[Kind::Cloud]));
    notes.for_each(|note| context.warn_of(&path.display(), &note));
    let cloud = &file.cloud;
    let normals = cloud.normals().filter(|_| options.kind != Some(Kind::Cloud));
    let mesh = discs(cloud.positions(), normals);
    let points = cloud.positions().len();
    let every = points.div_ceil(MAX_POINTS);
    let of = if every > 1 {
        format!("one in {every} of its {} points", grouped(points))
    } else {
        "every point".into()
    };
    let facing = if normals.is_some() { "its normal" } else { "a plane through its neighbours" };
    context.tell(&format!("{} is a point cloud: {of} is drawn as a disc along {facing}", path.display()));
    let is_survey =
        matches!(file.format, CloudFormat::Las | CloudFormat::E57 | CloudFormat::Pts | CloudFormat::Ptx);
    let usual_up = if is_survey { Up::Z } else { Up::Y };
    Ok(Drawn { what: "points", mesh, scalars: Vec::new(), two_sided: normals.is_none(), usual_up })
}

fn of_field(path: &Path, options: &OpenOptions, context: &Context) -> Result<Drawn, Failure> {
    let opened = open(path, options, context)?;
    let mesh = opened.reference(GRID, &context.progress())?;
    let name = path.display();
    context.tell(&format!(
        "{name} is drawn as its isosurface on a grid of {GRID} cells (`ndf mesh` writes one)"
    ));
    Ok(Drawn {
        what: "isosurface",
        mesh,
        scalars: Vec::new(),
        two_sided: false,
        usual_up: usual_up(opened.kind),
    })
}

/// What mostly points up in files of a kind: in captured scenes z, as in Blender, of whose scenes most that are synthetic are
/// made.
pub fn usual_up(kind: Kind) -> Up {
    if matches!(kind, Kind::Nerf | Kind::Splats) { Up::Z } else { Up::Y }
}

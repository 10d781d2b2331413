//! Triangle meshes of any quality.

use std::path::Path;

use ndf_core::{Hint, Progress, Surface};
use ndf_mesh::io::{MeshFile, ReadError, parse_mesh};
use ndf_mesh::repair::{self, Components, Irreparable, Parts, RepairOptions};
use ndf_mesh::{Face, ManifoldMesh, TriangleMesh, TriangleTree};
use ndf_surfaces::MeshSurface;
use ndf_surfaces::sheets::facing_out;

use super::{Content, OpenError, OpenOptions, Representation};
use crate::describe::{Described, Description, MeshDescription};
use crate::kind::Kind;
use crate::left_out::check_left_out;
use crate::note::{NotDecimated, Note};
use crate::opened::{BaseSource, Opened};
use crate::presets::{APART, SIDE_BY_SIDE};

/// Mesh files.
pub(super) struct Meshes;

impl Representation for Meshes {
    fn kinds(&self) -> &'static [Kind] {
        &[Kind::Mesh]
    }

    fn open(&self, content: Content, options: &OpenOptions, _: &dyn Progress) -> Result<Opened, OpenError> {
        let MeshFile { mesh, notes, .. } = parse(&content, options)?;
        let name = content.name();
        drop(content);
        let mut opened = opened(mesh, &options.repair, &name)?;
        opened.notes.splice(0..0, notes.into_iter().map(Note::from));
        Ok(opened)
    }

    fn describe(&self, content: &Content, options: &OpenOptions) -> Result<Described, OpenError> {
        let file = parse(content, options)?;
        let notes = file.notes.iter().copied().map(Note::from);
        let too_far = file.mesh.beyond_reach().map(|vertex| Note::BeyondReach { vertex: vertex.index() });
        let notes = notes.chain(too_far).collect();
        Ok(Described { description: Description::Mesh(MeshDescription::of(&file)), notes })
    }
}

fn parse(content: &Content, options: &OpenOptions) -> Result<MeshFile, OpenError> {
    parse_mesh(&content.bytes, &content.path).map_err(|error| match error {
        // Files of no known kind come here, too, and need not be meshes.
        ReadError::Unrecognised { reason, .. } if options.kind.is_none() => {
            OpenError::Unrecognised { name: content.name(), reason: by_name(&content.path).unwrap_or(reason) }
        }
        error => OpenError::MeshFile(error),
    })
}

/// What is to be said of a file of no known format by its name alone: these formats have no magic number.
fn by_name(path: &Path) -> Option<&'static str> {
    match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
        "onnx" => Some("it is named as a network of ONNX; save its weights as .pth or .safetensors"),
        "pkl" | "pickle" => {
            Some("it is named as a pickle; save its arrays as .npz, or its network with torch.save")
        }
        "csv" | "tsv" | "txt" | "asc" | "xyz" | "pts" => {
            Some("its lines are not three numbers or more each; --columns says which of them are x, y and z")
        }
        "3ds" | "max" | "igs" | "iges" | "dxf" | "dwg" => {
            Some("it is named as a scene or drawing; export it as OBJ, PLY, STL or glTF")
        }
        _ => None,
    }
}

/// A mesh as a surface: repaired to a manifold, or, where that cannot be or its pieces mean one solid, the boundary of what
/// its winding number encloses.
pub(super) fn opened(mesh: TriangleMesh, options: &RepairOptions, name: &str) -> Result<Opened, OpenError> {
    let name = || name.to_owned();
    if mesh.face_count() == 0 {
        return Err(OpenError::NoFaces { name: name(), vertices: mesh.vertex_count() });
    }
    if let Some(vertex) = mesh.beyond_reach() {
        return Err(OpenError::TooFar { name: name(), vertex });
    }
    let has_area =
        |face| mesh.corner_positions(face).iter().all(|p| p.is_finite()) && mesh.face_area(face) > 0.0;
    if !mesh.face_indices().any(has_area) {
        return Err(OpenError::NoArea { name: name() });
    }
    let empty = |source| OpenError::EmptyMesh { name: name(), source };
    let reason = match repair::repaired(&mesh, options) {
        Ok(repaired) => {
            check_left_out(repaired.area_left_out, options.parts)
                .map_err(|source| OpenError::LeftOut { name: name(), source })?;
            let surface = MeshSurface::new(&repaired.mesh).map_err(empty)?;
            match pieces_of_one_solid(&repaired.mesh, &surface) {
                None => {
                    let notes = repaired.notes.into_iter().map(Note::from).collect();
                    let (base, area_left_out) = (BaseSource::Manifold(repaired.mesh), repaired.area_left_out);
                    let surface = Opened::from_surface(Box::new(surface), Kind::Mesh);
                    return Ok(Opened { base, mesh: Some(mesh), notes, area_left_out, ..surface });
                }
                Some(reason) => reason,
            }
        }
        Err(Irreparable::OneSided) => return Err(OpenError::OneSided { name: name() }),
        Err(Irreparable::NotManifold(defects)) => defects.into(),
    };
    let base = BaseSource::Isosurface { scaffold: None, reason: Some(reason) };
    let (_, mut area_left_out) = repair::finite_part(&mesh);
    let parts = if options.parts == Parts::Largest {
        let usable = repair::usable_triangles(&mesh, options);
        area_left_out = usable.area_left_out;
        usable.mesh
    } else {
        repair::without_unusable_faces(&mesh)
    };
    check_left_out(area_left_out, options.parts)
        .map_err(|source| OpenError::LeftOut { name: name(), source })?;
    let surface = MeshSurface::new(&facing_out(&repair::oriented(&parts))).map_err(empty)?;
    Ok(Opened {
        base,
        mesh: Some(mesh),
        area_left_out,
        ..Opened::from_surface(Box::new(surface), Kind::Mesh)
    })
}

/// Why the components of a manifold mean one solid, whose boundary they are only together: some are inside of others, or
/// their borders lie side by side, as where the faces of a solid were not sewn together. `None` where each is a surface of its own.
fn pieces_of_one_solid(mesh: &ManifoldMesh, surface: &MeshSurface) -> Option<NotDecimated> {
    let components = Components::of_manifold(mesh);
    if components.len() < 2 {
        return None;
    }
    let (pieces, largest) = (components.len(), components.largest_share());
    let has_inside = surface.as_field().is_some();
    if has_inside && surface.parting_share() < APART {
        return Some(NotDecimated::Overlapping { pieces, largest });
    }
    // The share of the border, by length, that is next to another piece.
    let topology = mesh.topology();
    let tree = TriangleTree::new(mesh);
    let reach = SIDE_BY_SIDE * mesh.bounds().diagonal();
    let (mut next_to_others, mut all) = (0.0, 0.0);
    for h in topology.halfedges().filter(|&h| topology.twin(h).is_none()) {
        let [p, q] = [topology.tail(h), topology.tip(h)].map(|v| mesh.positions()[v.index()]);
        let own = components.of_face[h.face().index()];
        let is_other = |face: Face| components.of_face[face.index()] != own;
        let closest = tree.closest_point_within(p.midpoint(q), reach * reach, Hint::NONE, is_other);
        all += p.distance(q);
        next_to_others += if closest.is_some() { p.distance(q) } else { 0.0 };
    }
    let faces_out = || MeshSurface::new(&facing_out(mesh)).is_ok_and(|surface| surface.as_field().is_some());
    (2.0 * next_to_others > all && (has_inside || faces_out()))
        .then_some(NotDecimated::InPieces { pieces, largest })
}

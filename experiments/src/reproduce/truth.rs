//! Truths: meshes with their faces divided, and isosurfaces of fields, remeshed finely. They are kept beside the build, since a truth of
//! a network takes minutes.

use std::borrow::Cow;
use std::cell::OnceCell;
use std::collections::HashMap;
use std::fs;
use std::path::Path;

use ndf::evaluate::{Averaging, DistanceProtocol, ProtocolOptions, Truth};
use ndf::{BaseSource, Opened};
use ndf_core::{BoundingBox, ImplicitField, NoProgress};
use ndf_mesh::repair::{RepairOptions, repaired};
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_meshing::{
    IsotropicOptions, MarchingCubesOptions, marching_cubes, remesh_isotropically, split_edges,
};

use super::Setup;
use super::shapes::{Role, Shape};
use crate::performance::process::{read_mesh, write_mesh};

/// Cells along the box of a field in which its surface is found first.
const FINDING: u32 = 64;
/// Rounds of remeshing, as many as the supplement's program has.
const ROUNDS: u32 = 10;
/// Edges of meshes are split until none is longer than so many times the length of remeshed edges: those of both come out alike.
const SPLIT: f64 = 2.0;

/// A shape with what others are compared with, which is made when it is first needed.
pub(super) struct Subject<'a> {
    pub(super) shape: &'a Shape,
    setup: &'a Setup,
    parts: OnceCell<Parts>,
}

/// What is made of a shape.
pub(super) struct Parts {
    pub(super) opened: Opened,
    /// Isosurface on the finest grid: what methods get that start from a mesh.
    pub(super) isosurface: ManifoldMesh,
    pub(super) truth: Truth,
    /// What spectral simplification starts from.
    pub(super) remeshed: ManifoldMesh,
    /// How the truth was made.
    pub(super) made: String,
}

impl<'a> Subject<'a> {
    pub(super) fn new(shape: &'a Shape, setup: &'a Setup) -> Self {
        Self { shape, setup, parts: OnceCell::new() }
    }

    /// What is made of it.
    pub(super) fn parts(&self) -> Result<&Parts, String> {
        match self.parts.get() {
            Some(parts) => Ok(parts),
            None => {
                let parts = Parts::new(self.shape, self.setup)?;
                Ok(self.parts.get_or_init(|| parts))
            }
        }
    }
}

impl Parts {
    fn new(shape: &Shape, setup: &Setup) -> Result<Self, String> {
        let opened = shape.open()?;
        let scale = &setup.scale;
        let grid = if shape.role == Role::Mesh { scale.mesh_grid } else { scale.field_grid };
        let say = |e: String| format!("{}: {e}", shape.name);
        let isosurface = || -> Result<ManifoldMesh, String> {
            let field = field(&opened)?;
            isosurface(field, surface_bounds(field)?, grid)
        };
        eprintln!("{}: making the truth", shape.name);
        let stem = format!("{}-{:?}-{grid}", shape.name, shape.role).to_lowercase();
        let isosurface = kept(&setup.cache, &stem, isosurface).map_err(say)?;
        let (start, source) = match (shape.role, &opened.base) {
            (Role::Mesh, BaseSource::Manifold(mesh)) => {
                (Cow::Owned(largest_component(mesh)?), "the input".to_owned())
            }
            _ => (Cow::Borrowed(&isosurface), format!("marching cubes on {grid} cells")),
        };
        let edge_length = scale.truth_edge * unit(&start.bounds());
        let remesh = || {
            let options = IsotropicOptions { rounds: ROUNDS, ..IsotropicOptions::with_edges_of(edge_length) };
            remesh_isotropically(&start, None, &options, &NoProgress).map_err(|e| e.to_string())
        };
        let remeshed = kept(&setup.cache, &format!("{stem}-{}-remeshed", scale.truth_edge), remesh);
        let remeshed = remeshed.map_err(say)?;
        // Of a mesh the truth is the mesh itself: an isosurface lacks what is smaller than its cells, and remeshing cuts creases off,
        // which takes more from eigenvalues than the errors of the models are.
        let (fine, averaging, made) = if shape.role == Role::Mesh {
            let most = SPLIT * scale.truth_edge;
            let divided =
                split_edges(&start, SPLIT * edge_length, &NoProgress).map_err(|e| say(e.to_string()))?;
            (divided, Averaging::Area, format!("{source}, edges split to at most {most}"))
        } else {
            let made = format!("{source}, remeshed isotropically to {}", scale.truth_edge);
            (remeshed.clone(), Averaging::Vertices, made)
        };
        let made = format!("{made}: {} faces", fine.face_count());
        eprintln!("{}: the truth is {made}", shape.name);
        let distances = DistanceProtocol { averaging, ..DistanceProtocol::default() };
        let options = ProtocolOptions { distances, ..ProtocolOptions::default() };
        let truth = Truth::new(fine, &options, &NoProgress).map_err(|e| say(e.to_string()))?;
        Ok(Self { opened, isosurface, truth, remeshed, made })
    }

    /// A length of the box in units of the shape.
    pub(super) fn unit(&self) -> f64 {
        unit(&self.truth.mesh().bounds())
    }

    /// The box of the surface, with room for it.
    pub(super) fn bounds(&self) -> BoundingBox {
        let bounds = self.truth.mesh().bounds();
        bounds.padded(0.01 * bounds.extent().max_element())
    }

    /// The field whose level set the surface is.
    pub(super) fn field(&self) -> Result<&dyn ImplicitField, String> {
        field(&self.opened)
    }
}

/// One unit of the box [-1.5, 1.5]³ that bounds fill.
fn unit(bounds: &BoundingBox) -> f64 {
    bounds.extent().max_element() / 3.0
}

fn field(opened: &Opened) -> Result<&dyn ImplicitField, String> {
    let surface = opened.field_surface().and_then(|surface| surface.as_field());
    surface.ok_or_else(|| "it has no field".to_owned())
}

/// Where the surface of a field is, within the bounds of the field.
fn surface_bounds(field: &dyn ImplicitField) -> Result<BoundingBox, String> {
    let found = isosurface(field, field.bounds(), FINDING)?.bounds();
    Ok(found.padded(field.bounds().extent().max_element() / f64::from(FINDING)))
}

/// The largest component of an isosurface.
fn isosurface(field: &dyn ImplicitField, bounds: BoundingBox, grid: u32) -> Result<ManifoldMesh, String> {
    let options = MarchingCubesOptions { grid, bounds: Some(bounds), ..MarchingCubesOptions::default() };
    let found = marching_cubes(field, &options, &NoProgress).map_err(|e| e.to_string())?;
    largest_component(&found.mesh)
}

/// The largest component alone (supplement, §2.1), as a manifold. Meshes that touch themselves along an edge are cut there.
pub(super) fn largest_component(mesh: &TriangleMesh) -> Result<ManifoldMesh, String> {
    let found = repaired(mesh, &RepairOptions::LARGEST).or_else(|_| {
        let options = RepairOptions { keep_seams: true, ..RepairOptions::LARGEST };
        repaired(&cut_at_edges_of_many_faces(mesh), &options)
    });
    found.map(|found| found.mesh).map_err(|e| e.to_string())
}

/// The same faces, joined across edges of two faces alone.
fn cut_at_edges_of_many_faces(mesh: &TriangleMesh) -> TriangleMesh {
    // Corners of faces by the edges that begin in them, either way round.
    let mut edges: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
    for (f, face) in mesh.faces().iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_default().push(3 * f + k);
        }
    }
    let corners: Vec<u32> = mesh.faces().as_flattened().to_vec();
    // Corners that are one, as a forest.
    let mut parents: Vec<usize> = (0..corners.len()).collect();
    let root = |parents: &mut Vec<usize>, mut corner: usize| {
        while parents[corner] != corner {
            parents[corner] = parents[parents[corner]];
            corner = parents[corner];
        }
        corner
    };
    let next = |corner: usize| corner - corner % 3 + (corner + 1) % 3;
    for sides in edges.values().filter(|sides| sides.len() == 2) {
        for a in [sides[0], next(sides[0])] {
            for b in [sides[1], next(sides[1])] {
                if corners[a] == corners[b] {
                    let (a, b) = (root(&mut parents, a), root(&mut parents, b));
                    parents[a.max(b)] = a.min(b);
                }
            }
        }
    }
    let mut numbers: Vec<Option<u32>> = vec![None; corners.len()];
    let mut positions = Vec::new();
    let mut faces = vec![[0; 3]; mesh.face_count()];
    for corner in 0..corners.len() {
        let of = root(&mut parents, corner);
        let number = *numbers[of].get_or_insert_with(|| {
            positions.push(mesh.positions()[corners[of] as usize]);
            positions.len() as u32 - 1
        });
        faces[corner / 3][corner % 3] = number;
    }
    TriangleMesh::new(positions, faces).expect("all corners have vertices")
}

/// A mesh of the folder, made first where it is not there.
fn kept(
    folder: &Path,
    stem: &str,
    make: impl FnOnce() -> Result<ManifoldMesh, String>,
) -> Result<ManifoldMesh, String> {
    if let Ok(mesh) = read_mesh(folder, stem) {
        return ManifoldMesh::try_from(mesh).map_err(|e| format!("{}: {e}", folder.join(stem).display()));
    }
    let mesh = make()?;
    fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    write_mesh(folder, stem, &mesh)?;
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use ndf_core::DVec3;
    use ndf_mesh::shapes;

    use super::*;

    #[test]
    fn cubes_that_touch_along_an_edge_are_cut_there() {
        let cube = shapes::cube(1);
        let moved =
            cube.map_positions(|p| p + DVec3::new(cube.bounds().extent().x, cube.bounds().extent().y, 0.0));
        // Vertices in one place are one.
        let mut positions = cube.positions().to_vec();
        let mut place = |p: DVec3| {
            let near = |q: &DVec3| q.distance(p) < 1e-9;
            positions.iter().position(near).unwrap_or_else(|| {
                positions.push(p);
                positions.len() - 1
            }) as u32
        };
        let numbers: Vec<u32> = moved.positions().iter().map(|&p| place(p)).collect();
        let others = moved.faces().iter().map(|face| face.map(|v| numbers[v as usize]));
        let faces: Vec<[u32; 3]> = cube.faces().iter().copied().chain(others).collect();
        let both = TriangleMesh::new(positions, faces).unwrap();
        assert!(ManifoldMesh::try_from(both.clone()).is_err());
        assert_eq!(cut_at_edges_of_many_faces(&both).vertex_count(), both.vertex_count() + 2);
        let largest = largest_component(&both).unwrap();
        assert_eq!(largest.face_count(), cube.face_count());
        assert_eq!(largest.topology().boundary_edge_count(), 0);
    }
}

//! Joins what lies in the same place and is apart in the file: seams of textures, triangle soups, pieces side by side.

use std::collections::HashMap;

use ndf_core::DVec3;

use super::{Components, usable_faces};
use crate::validation::DisjointSets;
use crate::{Sides, TriangleMesh, ValidationReport, first_in_place};

/// Vertices closer than this many diagonals are taken as one where that closes a mesh.
const NEAR: f64 = 1e-6;

/// A mesh whose borders were joined.
pub(super) struct Joined {
    /// The mesh, with vertices and faces that are no longer used.
    pub(super) mesh: TriangleMesh,
    /// Vertices that are now others.
    pub(super) vertices: usize,
    /// Whether these were in exactly the same places.
    pub(super) exactly: bool,
}

/// Joins the borders of a mesh: all vertices in one place, or else where two borders lie on each other, or else vertices
/// nearly in one place. The first of these is taken that leaves less boundary and makes no edge of three faces; near
/// vertices are only worth it where that closes the mesh. `None` where nothing is.
pub(super) fn joined(mesh: &TriangleMesh) -> Option<Joined> {
    let sides = Sides::of(mesh.vertex_count(), mesh.face_indices().zip(mesh.faces().iter().copied()));
    if sides.edges().all(|(_, edge)| edge.len() > 1) {
        return None;
    }
    drop(sides);
    let before = ValidationReport::of(mesh);
    let usable = |mesh: &TriangleMesh| {
        let faces = mesh.faces().iter().zip(usable_faces(mesh));
        let faces = faces.filter_map(|(face, usable)| usable.then_some(*face)).collect();
        TriangleMesh::from_parts(mesh.positions().to_vec(), faces)
    };
    let has_copies = before.duplicate_vertices.count > 0;
    let ways: [(bool, &dyn Fn() -> TriangleMesh); 3] = [
        (true, &|| welded(mesh, 0.0)),
        (true, &|| {
            // First where two borders are, then, where several pieces touch, the two of each piece.
            let once = stitched(mesh, &vec![0; mesh.face_count()]);
            stitched(&once, &Components::of(&once).of_face)
        }),
        (false, &|| welded(mesh, NEAR * mesh.bounds().diagonal())),
    ];
    for (exactly, way) in ways.into_iter().filter(|(exactly, _)| has_copies || !exactly) {
        let joined = way();
        let after = ValidationReport::of(&usable(&joined));
        let better = after.faces > 0
            && after.boundary_edges < before.boundary_edges
            && after.nonmanifold_edges.count <= before.nonmanifold_edges.count;
        if better && (exactly || after.boundary_edges == 0) {
            let used = |report: &ValidationReport| report.vertices - report.unreferenced_vertices.count;
            let vertices = used(&before) - used(&ValidationReport::of(&joined));
            return Some(Joined { mesh: joined, vertices, exactly });
        }
    }
    None
}

/// Merges vertices no further apart than `tolerance` (0: exactly equal positions) into the first of them.
/// Faces that collapse stay, naming a vertex twice; see [`without_unusable_faces`](super::without_unusable_faces). Chains of close vertices
/// are merged only with vertices close to the first. A vertex that is not finite is close to none. O(n).
pub fn welded(mesh: &TriangleMesh, tolerance: f64) -> TriangleMesh {
    if tolerance <= 0.0 {
        return merged(mesh);
    }
    // Kept vertices by grid cell; the map is only looked into, never iterated.
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let cell_of = |p: DVec3| (p / tolerance).to_array().map(|x| x.floor() as i64);
    let mut kept: Vec<DVec3> = Vec::new();
    let merged: Vec<u32> = mesh
        .positions()
        .iter()
        .map(|&p| {
            let cell = cell_of(p);
            let near = (-1..=1_i64)
                .flat_map(|x| (-1..=1).map(move |y| (x, y)))
                .flat_map(|(x, y)| (-1..=1).map(move |z| [x, y, z]))
                .filter_map(|d| cells.get(&[0, 1, 2].map(|k| cell[k].wrapping_add(d[k]))))
                .flatten()
                .copied()
                .filter(|&v| kept[v as usize].distance_squared(p) <= tolerance * tolerance)
                .min();
            near.unwrap_or_else(|| {
                let v = kept.len() as u32;
                kept.push(p);
                if p.is_finite() {
                    cells.entry(cell).or_default().push(v);
                }
                v
            })
        })
        .collect();
    let faces = mesh.faces().iter().map(|f| f.map(|v| merged[v as usize])).collect();
    TriangleMesh::from_parts(kept, faces)
}

/// Merges vertices at exactly equal positions into the first of them. O(n).
fn merged(mesh: &TriangleMesh) -> TriangleMesh {
    let places = places(mesh);
    if (0..).zip(&places).all(|(v, &place)| v == place) {
        return mesh.clone();
    }
    let mut kept = Vec::new();
    let mut number = vec![0; places.len()];
    for (v, &place) in places.iter().enumerate() {
        // The first of a place comes before the others.
        number[v] = if place as usize == v { kept.len() as u32 } else { number[place as usize] };
        if place as usize == v {
            kept.push(mesh.positions()[v]);
        }
    }
    let faces = mesh.faces().iter().map(|f| f.map(|v| number[v as usize])).collect();
    TriangleMesh::from_parts(kept, faces)
}

/// Joins pairs of boundary edges of one piece that lie on each other, where no third does: their ends become one vertex. All
/// vertices stay; some are no longer used. O(n log n).
fn stitched(mesh: &TriangleMesh, pieces: &[u32]) -> TriangleMesh {
    let places = places(mesh);
    let mut sides: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * mesh.face_count());
    for (f, &[a, b, c]) in mesh.faces().iter().enumerate() {
        sides.extend([(a, b), (b, c), (c, a)].map(|(p, q)| (p.min(q), p.max(q), f as u32)));
    }
    sides.sort_unstable();
    // By place and piece: the ends of every boundary edge, and its face.
    let mut open: Vec<([u32; 3], [u32; 2], u32)> = sides
        .chunk_by(|x, y| (x.0, x.1) == (y.0, y.1))
        .filter_map(|edge| match *edge {
            [(p, q, f)] => {
                let ([at_p, at_q], piece) = ([p, q].map(|v| places[v as usize]), pieces[f as usize]);
                Some(if at_p < at_q {
                    ([at_p, at_q, piece], [p, q], f)
                } else {
                    ([at_q, at_p, piece], [q, p], f)
                })
            }
            _ => None,
        })
        .filter(|([at_p, at_q, _], ..)| at_p != at_q)
        .collect();
    open.sort_unstable();
    let mut joined = DisjointSets::new(mesh.vertex_count());
    for edge in open.chunk_by(|x, y| x.0 == y.0) {
        if let [(_, first, f), (_, second, g)] = *edge
            && f != g
        {
            first.iter().zip(second).for_each(|(&v, w)| joined.join(v as usize, w as usize));
        }
    }
    let faces = mesh.faces().iter().map(|face| face.map(|v| joined.root(v as usize) as u32)).collect();
    TriangleMesh::from_parts(mesh.positions().to_vec(), faces)
}

/// For every vertex the first vertex in the same place.
fn places(mesh: &TriangleMesh) -> Vec<u32> {
    let place = |((v, p), first): ((u32, &DVec3), u32)| if p.is_finite() { first } else { v };
    (0..).zip(mesh.positions()).zip(first_in_place(mesh.positions())).map(place).collect()
}

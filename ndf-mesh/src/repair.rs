//! Small, separate repairs of an imperfect mesh. Each returns a new mesh; none changes the geometry beyond what
//! its name says, and all keep the order of what remains.

use std::collections::HashMap;
use std::fmt;

use ndf_core::DVec3;
use serde::Serialize;

use super::validation::DisjointSets;
use super::{ManifoldMesh, NotManifold, TriangleMesh, ValidationReport};
use crate::Face;

/// Vertices closer than this many diagonals are taken as one where that closes a mesh.
const NEAR: f64 = 1e-6;

/// A manifold made of an imperfect mesh, and what was done to it.
#[derive(Clone, Debug)]
pub struct Repaired {
    /// The largest component of the repaired mesh.
    pub mesh: ManifoldMesh,
    /// What was changed; empty if nothing.
    pub notes: Vec<RepairNote>,
    /// The share of the whole area that the largest component has.
    pub kept_area: f64,
}

/// Something that was changed to make a manifold of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "note", rename_all = "snake_case")]
#[non_exhaustive]
pub enum RepairNote {
    /// Faces that name a vertex twice, repeat another or are not finite were left out.
    UnusableFaces {
        /// How many.
        faces: usize,
    },
    /// Vertices were merged with others in the same place, or nearly so.
    VerticesMerged {
        /// How many.
        vertices: usize,
        /// Whether all had exactly the same positions as others.
        exactly: bool,
    },
    /// Fans of faces that met in one vertex got vertices of their own.
    FansSeparated,
    /// Some faces were turned to agree with the others.
    FacesTurned {
        /// How many.
        faces: usize,
    },
    /// All faces were turned outward.
    AllFacesTurned,
    /// All components but the largest were left out.
    ComponentsLeftOut {
        /// Components there were, the largest included.
        components: usize,
        /// Faces that were left out.
        faces: usize,
    },
}

impl fmt::Display for RepairNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = |n: usize| if n == 1 { "" } else { "s" };
        match *self {
            Self::UnusableFaces { faces } => write!(f, "{faces} unusable face{} left out", plural(faces)),
            Self::VerticesMerged { vertices, exactly } => {
                let how = if exactly { "in the same place" } else { "nearly in the same place" };
                write!(f, "{vertices} vertices {how} merged")
            }
            Self::FansSeparated => f.write_str("fans of faces that met in one vertex were separated"),
            Self::FacesTurned { faces } => write!(f, "{faces} face{} turned to agree", plural(faces)),
            Self::AllFacesTurned => f.write_str("all faces turned outward"),
            Self::ComponentsLeftOut { components, faces } => {
                write!(f, "only the largest of {components} components is used; {faces} faces left out")
            }
        }
    }
}

/// Repairs what can be repaired without inventing geometry, and keeps the largest component: unusable faces and
/// unreferenced vertices go, vertices in one place are merged where the mesh has boundary there, faces are turned
/// to agree and outward, fans are separated.
///
/// # Errors
/// With the report of what is left, if the result is not an oriented manifold.
pub fn repaired(mesh: &TriangleMesh) -> Result<Repaired, NotManifold> {
    let mut notes = Vec::new();
    let before = ValidationReport::of(mesh);
    let mut current = without_unusable_faces(mesh);
    let dropped = mesh.face_count() - current.face_count();
    if dropped > 0 {
        notes.push(RepairNote::UnusableFaces { faces: dropped });
    }
    current = without_unreferenced_vertices(&current).0;
    if before.boundary_edges > 0 {
        current = closed_by_welding(current, &mut notes);
    }
    if ValidationReport::of(&current).nonmanifold_vertices.count > 0 {
        current = split_fans(&current);
        notes.push(RepairNote::FansSeparated);
    }
    let turned = oriented(&current);
    let changed = turned.faces().iter().zip(current.faces()).filter(|(a, b)| a != b).count();
    if changed > 0 {
        let all = changed == current.face_count();
        notes.push(if all { RepairNote::AllFacesTurned } else { RepairNote::FacesTurned { faces: changed } });
    }
    let (largest, components) = largest_component(&turned);
    if components > 1 {
        let rest = turned.face_count() - largest.face_count();
        notes.push(RepairNote::ComponentsLeftOut { components, faces: rest });
    }
    let kept_area = if components > 1 { largest.area() / turned.area() } else { 1.0 };
    Ok(Repaired { mesh: ManifoldMesh::try_from(largest)?, notes, kept_area })
}

/// The mesh with coinciding, or else nearly coinciding, vertices merged, if that leaves fewer boundary edges and
/// makes none non-manifold.
fn closed_by_welding(mesh: TriangleMesh, notes: &mut Vec<RepairNote>) -> TriangleMesh {
    let before = ValidationReport::of(&mesh);
    for tolerance in [0.0, NEAR * mesh.bounds().diagonal()] {
        let merged = without_unreferenced_vertices(&without_unusable_faces(&welded(&mesh, tolerance))).0;
        let after = ValidationReport::of(&merged);
        let better = after.boundary_edges < before.boundary_edges
            && after.nonmanifold_edges.count <= before.nonmanifold_edges.count;
        // Near vertices are only worth merging where it closes the mesh.
        if better && (tolerance == 0.0 || after.boundary_edges == 0) {
            let vertices = mesh.vertex_count() - merged.vertex_count();
            notes.push(RepairNote::VerticesMerged { vertices, exactly: tolerance == 0.0 });
            return merged;
        }
    }
    mesh
}

/// Merges vertices no further apart than `tolerance` (0: exactly equal positions) into the first of them.
/// Faces that collapse stay, naming a vertex twice; see [`without_unusable_faces`]. Chains of close vertices
/// are merged only with vertices close to the first. A vertex that is not finite is close to none. O(n).
pub fn welded(mesh: &TriangleMesh, tolerance: f64) -> TriangleMesh {
    // Kept vertices by grid cell; the map is only looked into, never iterated.
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    let exact = tolerance <= 0.0;
    let cell_of = |p: DVec3| {
        if exact {
            (p + DVec3::ZERO).to_array().map(|x| x.to_bits().cast_signed())
        } else {
            (p / tolerance).to_array().map(|x| x.floor() as i64)
        }
    };
    let mut kept: Vec<DVec3> = Vec::new();
    let merged: Vec<u32> = mesh
        .positions()
        .iter()
        .map(|&p| {
            let cell = cell_of(p);
            let neighbours = if exact { 0..=0 } else { -1..=1_i64 };
            let near = neighbours
                .clone()
                .flat_map(|x| neighbours.clone().map(move |y| (x, y)))
                .flat_map(|(x, y)| neighbours.clone().map(move |z| [x, y, z]))
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

/// Drops faces no topology can be made of: those that name a vertex twice, repeat the corners of an earlier
/// face, or have a vertex that is not finite.
pub fn without_unusable_faces(mesh: &TriangleMesh) -> TriangleMesh {
    let mut seen = std::collections::HashSet::new();
    let usable = |face: &&[u32; 3]| {
        let [a, b, c] = **face;
        let mut key = **face;
        key.sort_unstable();
        let finite = face.iter().all(|&v| mesh.positions()[v as usize].is_finite());
        finite && a != b && b != c && c != a && seen.insert(key)
    };
    let faces = mesh.faces().iter().filter(usable).copied().collect();
    TriangleMesh::from_parts(mesh.positions().to_vec(), faces)
}

/// Drops vertices that no face uses. The second value gives the old index of every vertex that is left.
pub fn without_unreferenced_vertices(mesh: &TriangleMesh) -> (TriangleMesh, Vec<u32>) {
    let mut new_index = vec![u32::MAX; mesh.vertex_count()];
    mesh.faces().iter().flatten().for_each(|&v| new_index[v as usize] = 0);
    let old_index: Vec<u32> =
        (0..mesh.vertex_count() as u32).filter(|&v| new_index[v as usize] == 0).collect();
    for (new, &old) in old_index.iter().enumerate() {
        new_index[old as usize] = new as u32;
    }
    let positions = old_index.iter().map(|&v| mesh.positions()[v as usize]).collect();
    let faces = mesh.faces().iter().map(|f| f.map(|v| new_index[v as usize])).collect();
    (TriangleMesh::from_parts(positions, faces), old_index)
}

/// Turns faces so that neighbours across edges with two faces agree, then turns every closed component outward
/// (positive volume). Of an open component the majority of its faces keep their side. Components that cannot
/// be oriented (Möbius strips) stay inconsistent somewhere; the report of the result says so.
pub fn oriented(mesh: &TriangleMesh) -> TriangleMesh {
    let mut sides: Vec<(u32, u32, u32, bool)> = Vec::with_capacity(3 * mesh.face_count());
    for (f, &[a, b, c]) in mesh.faces().iter().enumerate() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            sides.push((p.min(q), p.max(q), f as u32, p < q));
        }
    }
    sides.sort_unstable();
    // Neighbours across manifold edges: (face, other face, whether they disagree).
    let mut adjacent: Vec<(u32, u32, bool)> = Vec::with_capacity(sides.len());
    let mut open = Vec::new();
    for edge in sides.chunk_by(|x, y| (x.0, x.1) == (y.0, y.1)) {
        match edge {
            [first, second] => {
                adjacent.push((first.2, second.2, first.3 == second.3));
                adjacent.push((second.2, first.2, first.3 == second.3));
            }
            _ => open.extend(edge.iter().map(|side| side.2)),
        }
    }
    adjacent.sort_unstable();
    let mut is_open = vec![false; mesh.face_count()];
    open.iter().for_each(|&f| is_open[f as usize] = true);

    let mut turned: Vec<Option<bool>> = vec![None; mesh.face_count()];
    let mut faces = mesh.faces().to_vec();
    for start in 0..mesh.face_count() {
        if turned[start].is_some() {
            continue;
        }
        turned[start] = Some(false);
        let mut component = vec![start as u32];
        let mut next = 0;
        while let Some(&f) = component.get(next) {
            next += 1;
            let begin = adjacent.partition_point(|side| side.0 < f);
            for &(_, other, disagree) in adjacent[begin..].iter().take_while(|side| side.0 == f) {
                if turned[other as usize].is_none() {
                    turned[other as usize] = turned[f as usize].map(|t| t != disagree);
                    component.push(other);
                }
            }
        }
        let is_turned = |f: u32| turned[f as usize] == Some(true);
        let center = mesh.positions()[mesh.faces()[start][0] as usize];
        let six_volumes = |&f: &u32| {
            let [a, b, c] = mesh.corner_positions(Face(f)).map(|p| p - center);
            a.dot(b.cross(c)) * if is_turned(f) { -1.0 } else { 1.0 }
        };
        let turn_all = if component.iter().any(|&f| is_open[f as usize]) {
            2 * component.iter().filter(|&&f| is_turned(f)).count() > component.len()
        } else {
            component.iter().map(six_volumes).sum::<f64>() < 0.0
        };
        for &f in &component {
            if is_turned(f) != turn_all {
                faces[f as usize].swap(1, 2);
            }
        }
    }
    TriangleMesh::from_parts(mesh.positions().to_vec(), faces)
}

/// Gives every fan of faces at a vertex a vertex of its own, so that no vertex joins several fans.
pub fn split_fans(mesh: &TriangleMesh) -> TriangleMesh {
    let mut sides: Vec<(u32, u32, u32, u32)> = Vec::with_capacity(3 * mesh.face_count());
    for (f, face) in mesh.faces().iter().enumerate() {
        for c in 0..3 {
            let (h, next) = (3 * f as u32 + c as u32, 3 * f as u32 + (c as u32 + 1) % 3);
            let (p, q) = (face[c], face[(c + 1) % 3]);
            sides.push(if p < q { (p, q, h, next) } else { (q, p, next, h) });
        }
    }
    sides.sort_unstable();
    let mut fans = DisjointSets::new(3 * mesh.face_count());
    for pair in sides.windows(2) {
        if (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1) {
            fans.join(pair[0].2 as usize, pair[1].2 as usize);
            fans.join(pair[0].3 as usize, pair[1].3 as usize);
        }
    }
    let mut positions = mesh.positions().to_vec();
    let mut faces = mesh.faces().to_vec();
    // The first fan keeps the vertex; roots come before the other corners of their fan.
    let mut taken = vec![false; mesh.vertex_count()];
    let mut vertex_of_fan = vec![u32::MAX; 3 * mesh.face_count()];
    for corner in 0..3 * mesh.face_count() {
        let v = mesh.faces()[corner / 3][corner % 3];
        let root = fans.root(corner);
        if root == corner {
            vertex_of_fan[corner] = if taken[v as usize] {
                positions.push(mesh.positions()[v as usize]);
                positions.len() as u32 - 1
            } else {
                taken[v as usize] = true;
                v
            };
        }
        faces[corner / 3][corner % 3] = vertex_of_fan[root];
    }
    TriangleMesh::from_parts(positions, faces)
}

/// The component (joined through edges) with the largest area, and how many components there were.
pub fn largest_component(mesh: &TriangleMesh) -> (TriangleMesh, usize) {
    let mut sides: Vec<(u32, u32, u32)> = Vec::with_capacity(3 * mesh.face_count());
    for (f, &[a, b, c]) in mesh.faces().iter().enumerate() {
        for (p, q) in [(a, b), (b, c), (c, a)] {
            sides.push((p.min(q), p.max(q), f as u32));
        }
    }
    sides.sort_unstable();
    let mut joined = DisjointSets::new(mesh.face_count());
    for pair in sides.windows(2) {
        if (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1) {
            joined.join(pair[0].2 as usize, pair[1].2 as usize);
        }
    }
    let mut areas = vec![0.0; mesh.face_count()];
    let roots: Vec<usize> = (0..mesh.face_count()).map(|f| joined.root(f)).collect();
    for (f, &root) in mesh.face_indices().zip(&roots) {
        areas[root] += mesh.face_area(f);
    }
    let components = roots.iter().enumerate().filter(|(f, r)| f == *r).count();
    let Some(largest) = (0..mesh.face_count()).max_by(|&a, &b| areas[a].total_cmp(&areas[b]).then(b.cmp(&a)))
    else {
        return (mesh.clone(), 0);
    };
    let faces = mesh.faces().iter().zip(&roots).filter(|(_, r)| **r == largest).map(|(f, _)| *f).collect();
    let mesh = TriangleMesh::from_parts(mesh.positions().to_vec(), faces);
    (without_unreferenced_vertices(&mesh).0, components)
}

#[cfg(test)]
mod tests {
    use super::super::{ManifoldMesh, ValidationReport, shapes};
    use super::*;

    #[test]
    fn everything_mendable_is_mended() {
        let mesh = shapes::torus(20, 12, 1.0, 0.3);
        let clean = repaired(&mesh).unwrap();
        assert!(clean.notes.is_empty() && *clean.mesh == mesh);

        let (mut positions, mut faces) = soup(&mesh).into_parts();
        faces.iter_mut().step_by(2).for_each(|f| f.swap(0, 1));
        faces.push([0, 0, 1]);
        positions.push(DVec3::ZERO);
        let last = positions.len() as u32;
        positions.extend([DVec3::X, DVec3::Y, DVec3::Z].map(|p| 1.5 * p));
        faces.push([last, last + 1, last + 2]);
        let result = repaired(&TriangleMesh::new(positions, faces).unwrap()).unwrap();
        assert_eq!(result.mesh.topology().euler_characteristic(), 0);
        assert_eq!(result.mesh.topology().boundary_edge_count(), 0);
        assert!(result.mesh.signed_volume() > 0.0);
        assert_eq!(result.notes.len(), 4, "{:?}", result.notes);
    }

    #[test]
    fn three_faces_at_an_edge_are_reported() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_Y];
        let mesh = TriangleMesh::new(positions, vec![[0, 1, 2], [1, 0, 3], [0, 1, 4]]).unwrap();
        assert!(repaired(&mesh).unwrap_err().to_string().contains("1 edge with 3 faces"));
    }

    /// Every face with three vertices of its own, as in an STL file.
    fn soup(mesh: &TriangleMesh) -> TriangleMesh {
        let positions = mesh.face_indices().flat_map(|f| mesh.corner_positions(f)).collect();
        let faces = (0..mesh.face_count() as u32).map(|f| [3 * f, 3 * f + 1, 3 * f + 2]).collect();
        TriangleMesh::from_parts(positions, faces)
    }

    #[test]
    fn welding_a_soup_gives_the_mesh_back() {
        let mesh = shapes::torus(20, 12, 1.0, 0.3);
        let exact = welded(&soup(&mesh), 0.0);
        assert_eq!(exact.vertex_count(), mesh.vertex_count());
        assert!(ManifoldMesh::try_from(exact).is_ok());

        let mut k = 0.0;
        let (positions, faces) = soup(&mesh).into_parts();
        let noisy = positions.into_iter().map(|p| {
            k += 1.0;
            p + 1e-9 * DVec3::new((k * 1.3_f64).sin(), (k * 2.1_f64).cos(), (k * 0.7_f64).sin())
        });
        let noisy = TriangleMesh::new(noisy.collect(), faces).unwrap();
        assert!(
            ManifoldMesh::try_from(welded(&noisy, 0.0)).is_ok_and(|m| m.topology().boundary_edge_count() > 0)
        );
        let near = welded(&noisy, 1e-7);
        assert_eq!(near.vertex_count(), mesh.vertex_count());
        assert!(ManifoldMesh::try_from(near).is_ok());
    }

    #[test]
    fn vertices_that_are_not_finite_stay_apart_in_linear_time() {
        // Were they gathered in one cell, these would be compared with each other: tens of seconds.
        let positions = vec![DVec3::NAN; 200_000];
        let mesh = TriangleMesh::from_parts(positions, Vec::new());
        for tolerance in [0.0, 1e-3] {
            assert_eq!(welded(&mesh, tolerance).vertex_count(), mesh.vertex_count());
        }
    }

    #[test]
    fn orientation_is_restored_and_turned_outward() {
        let mesh = shapes::icosphere(2);
        let (positions, mut faces) = mesh.clone().into_parts();
        for f in faces.iter_mut().step_by(3) {
            f.swap(0, 1);
        }
        let mixed = TriangleMesh::new(positions.clone(), faces).unwrap();
        let repaired = oriented(&mixed);
        assert!((repaired.signed_volume() - mesh.signed_volume()).abs() < 1e-12);
        assert!(ManifoldMesh::try_from(repaired).is_ok());

        let inward = mesh.faces().iter().map(|&[a, b, c]| [a, c, b]).collect();
        let inward = TriangleMesh::new(positions, inward).unwrap();
        assert!(oriented(&inward).signed_volume() > 0.0);
    }

    #[test]
    fn unusable_faces_go_and_vertices_follow() {
        let (positions, mut faces) = shapes::cube(1).into_parts();
        let count = faces.len();
        faces.push([0, 0, 1]);
        faces.push([faces[3][1], faces[3][0], faces[3][2]]);
        let mut positions = positions;
        positions.push(DVec3::NAN);
        faces.push([0, 1, 8]);
        let repaired = without_unusable_faces(&TriangleMesh::new(positions, faces).unwrap());
        assert_eq!(repaired.face_count(), count);
        let (repaired, kept) = without_unreferenced_vertices(&repaired);
        assert_eq!(kept, (0..8).collect::<Vec<_>>());
        assert!(ManifoldMesh::try_from(repaired).is_ok());
    }

    #[test]
    fn fans_are_separated() {
        // Two tetrahedra that share a vertex.
        let p = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
        let positions = vec![
            p(0.0, 0.0, 0.0),
            p(1.0, 0.0, 0.0),
            p(0.0, 1.0, 0.0),
            p(0.0, 0.0, 1.0),
            p(-1.0, 0.0, 0.0),
            p(0.0, -1.0, 0.0),
            p(0.0, 0.0, -1.0),
        ];
        let tetrahedron = |a: u32, b: u32, c: u32, d: u32| [[a, c, b], [a, b, d], [b, c, d], [c, a, d]];
        let faces = [tetrahedron(0, 1, 2, 3), tetrahedron(0, 4, 5, 6)].concat();
        let mesh = TriangleMesh::new(positions, faces).unwrap();
        assert_eq!(ValidationReport::of(&mesh).nonmanifold_vertices.count, 1);
        let split = split_fans(&mesh);
        assert_eq!(split.vertex_count(), 8);
        assert!(ManifoldMesh::try_from(oriented(&split)).is_ok());
        let (largest, components) = largest_component(&split);
        assert_eq!((largest.face_count(), components), (4, 2));
    }
}

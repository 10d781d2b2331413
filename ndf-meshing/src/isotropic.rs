//! Isotropic remeshing (Botsch and Kobbelt 2004): edges of nearly one length and vertices of nearly six.
//!
//! Each round splits long edges, collapses short ones, flips towards regular valence, and relaxes the vertices
//! tangentially with projection back onto the surface. The topology does not change. Creases that are not kept come out
//! rounded by up to about an edge length.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use ndf_core::projected;
use ndf_core::{Cancelled, DVec3, Progress, Query, Sparingly, Surface};
use ndf_mesh::NO_HALFEDGE;
use ndf_mesh::{Halfedge, ManifoldMesh, Vertex};

use crate::editable_mesh::{Constraint, EditableMesh};
use crate::original::OriginalMesh;
use crate::remeshing::quality_around;
use crate::triangle_shape::{agree, cross, quality};

/// What length and how many rounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsotropicOptions {
    /// Length the edges should have, in the units of the mesh.
    pub edge_length: f64,
    /// Number of rounds.
    pub rounds: u32,
    /// Keep creases: edges at which the normals of the faces are farther apart than this angle, in radians. They are split,
    /// and collapsed along themselves; where they end or meet a vertex stays.
    pub crease_angle: Option<f64>,
}

impl IsotropicOptions {
    /// The usual options for edges of this length: ten rounds, and no creases.
    pub fn with_edges_of(edge_length: f64) -> Self {
        Self { edge_length, rounds: 10, crease_angle: None }
    }
}

/// Why a mesh was not remeshed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum IsotropicError {
    /// The edge length is not a positive number, or so small that the mesh would not fit indices.
    #[error("the edge length {0} is not positive, or would make more than a hundred million faces")]
    EdgeLength(f64),
    /// The observer asked to stop.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Edges longer than this share of the length are split.
const LONG: f64 = 4.0 / 3.0;
/// Edges shorter than this share are collapsed.
const SHORT: f64 = 4.0 / 5.0;
/// A face may turn by the angle with this cosine in one flip or collapse.
const TURN: f64 = 0.5;
/// Flips and collapses make no face worse than this, unless it was.
const LEAST_QUALITY: f64 = 0.2;
const MOST_FACES: f64 = 1e8;

/// Remeshes isotropically, on `surface` or on the mesh itself where that is `None`. Vertices of the boundary
/// stay; boundary edges are only split. Deterministic.
///
/// # Errors
/// See [`IsotropicError`].
pub fn remesh_isotropically(
    mesh: &ManifoldMesh,
    surface: Option<&dyn Surface>,
    options: &IsotropicOptions,
    progress: &dyn Progress,
) -> Result<ManifoldMesh, IsotropicError> {
    let length = options.edge_length;
    let expected = mesh.area() / (0.25 * 3.0_f64.sqrt() * length * length);
    if !length.is_finite() || length <= 0.0 || expected > MOST_FACES {
        return Err(IsotropicError::EdgeLength(length));
    }
    let original = surface.is_none().then(|| OriginalMesh::new(mesh));
    let surface = surface.or(original.as_ref().map(|mesh| mesh as &dyn Surface));
    let mut work = EditableMesh::new(mesh);
    if let Some(angle) = options.crease_angle {
        work.mark_creases(angle);
    }
    for round in 0..options.rounds {
        progress.check()?;
        progress.report("isotropic remeshing", f64::from(round) / f64::from(options.rounds));
        split_long(&mut work, LONG * length, progress)?;
        collapse_short(&mut work, SHORT * length, LONG * length);
        progress.check()?;
        flip_to_regular(&mut work);
        progress.check()?;
        if let Some(surface) = surface {
            relax(&mut work, surface);
        }
    }
    progress.report("isotropic remeshing", 1.0);
    Ok(work.into_manifold())
}

/// Splits edges in the middle until none is longer than `most`. No point of the surface moves. Faces come out with edges between
/// half of it and all of it, where theirs were longer. O(n log n) for the n faces that there are in the end.
///
/// # Errors
/// See [`IsotropicError`].
pub fn split_edges(
    mesh: &ManifoldMesh,
    most: f64,
    progress: &dyn Progress,
) -> Result<ManifoldMesh, IsotropicError> {
    if !(most > 0.0 && mesh.area() / (most * most) < 0.25 * MOST_FACES) {
        return Err(IsotropicError::EdgeLength(most));
    }
    let mut work = EditableMesh::new(mesh);
    split_long(&mut work, most, progress)?;
    Ok(work.into_manifold())
}

fn length_squared(mesh: &EditableMesh, h: Halfedge) -> f64 {
    mesh.position(mesh.tail(h)).distance_squared(mesh.position(mesh.tip(h)))
}

fn is_edge(mesh: &EditableMesh, h: Halfedge) -> bool {
    !mesh.is_hole(h) && mesh.canonical(h) == h
}

/// Splits edges in the middle until none is longer than `most`, always the longest: splitting the longest
/// side of a face makes no new edge longer than it, so that this ends (Rivara 1984).
fn split_long(mesh: &mut EditableMesh, most: f64, progress: &dyn Progress) -> Result<(), Cancelled> {
    let mut asked = Sparingly::new(progress, 4096);
    // Not negative, so the bits order like the numbers.
    let entry = |mesh: &EditableMesh, h: Halfedge| {
        let h = mesh.canonical(h);
        let square = length_squared(mesh, h);
        (square > most * most).then(|| (square.to_bits(), Reverse(h)))
    };
    let edges = mesh.halfedges().filter(|&h| is_edge(mesh, h));
    let mut queue: BinaryHeap<_> = edges.filter_map(|h| entry(mesh, h)).collect();
    while let Some((bits, Reverse(h))) = queue.pop() {
        asked.check()?;
        // The half-edge may name half of the edge it was queued for, which has its own entry.
        if length_squared(mesh, h).to_bits() == bits {
            let middle = mesh.position(mesh.tail(h)).midpoint(mesh.position(mesh.tip(h)));
            let vertex = mesh.split(h, middle);
            // The edges at the new vertex, and those opposite it, whose half-edges may have changed.
            let sides = mesh.outgoing(vertex).map(Halfedge::next).chain(mesh.edges_at(vertex));
            queue.extend(sides.filter_map(|h| entry(mesh, h)));
        }
    }
    Ok(())
}

/// Collapses interior edges shorter than `least` where that makes none longer than `most`.
fn collapse_short(mesh: &mut EditableMesh, least: f64, most: f64) {
    for h in mesh.halfedges() {
        if !is_edge(mesh, h) || mesh.raw_twin(h) == NO_HALFEDGE || length_squared(mesh, h) >= least * least {
            continue;
        }
        let (a, b) = (mesh.tail(h), mesh.tip(h));
        let Some(anchor) = mesh.anchor(h) else { continue };
        let place = match anchor {
            Some(anchor) => mesh.position(anchor),
            // A vertex of a crease, as curved as it may be, is on it.
            None if mesh.is_crease(h) || mesh.is_boundary_vertex(a) => mesh.position(a),
            None => mesh.position(a).midpoint(mesh.position(b)),
        };
        let near = |v: Vertex| mesh.ring(v).all(|w| mesh.position(w).distance_squared(place) <= most * most);
        if near(a) && near(b) && mesh.is_collapsible(h) && collapse_is_sound(mesh, h, place) {
            mesh.collapse(h, place);
        }
    }
}

/// Whether the faces around the edge that stay keep their side and shape.
fn collapse_is_sound(mesh: &EditableMesh, h: Halfedge, place: DVec3) -> bool {
    let gone = [h, mesh.raw_twin(h)].map(Halfedge::face);
    [mesh.tail(h), mesh.tip(h)].into_iter().all(|v| {
        mesh.outgoing(v).filter(|o| !gone.contains(&o.face())).all(|o| {
            let [x, y] = [mesh.tip(o), mesh.tail(o.previous())].map(|w| mesh.position(w));
            let (old, new) = ([mesh.position(v), x, y], [place, x, y]);
            agree(cross(old), cross(new), TURN) && quality(new) >= quality(old).min(LEAST_QUALITY)
        })
    })
}

/// Flips edges that bring the valences of their four vertices closer to six, or four on the boundary.
fn flip_to_regular(mesh: &mut EditableMesh) {
    let mut excess: Vec<i32> = mesh
        .vertices()
        .map(|v| {
            let regular = |v| if mesh.is_boundary_vertex(v) { 4 } else { 6 };
            if mesh.is_vertex_hole(v) { 0 } else { mesh.ring(v).count() as i32 - regular(v) }
        })
        .collect();
    for h in mesh.halfedges() {
        if !is_edge(mesh, h) || mesh.raw_twin(h) == NO_HALFEDGE || mesh.is_crease(h) {
            continue;
        }
        let t = mesh.raw_twin(h);
        let corners = [mesh.tail(h), mesh.tail(t), mesh.tail(h.previous()), mesh.tail(t.previous())];
        let changes = [-1, -1, 1, 1];
        let deviation = |share: i32| -> i32 {
            corners.iter().zip(changes).map(|(&v, change)| (excess[v.index()] + share * change).pow(2)).sum()
        };
        if deviation(1) >= deviation(0) || !mesh.is_flippable(h) {
            continue;
        }
        let [a, b, c, d] = corners.map(|v| mesh.position(v));
        let (old, new) = ([[a, b, c], [b, a, d]], [[a, d, c], [d, b, c]]);
        let worst = |faces: [[DVec3; 3]; 2]| quality(faces[0]).min(quality(faces[1]));
        let stays = old.iter().all(|&o| new.iter().all(|&n| agree(cross(o), cross(n), TURN)));
        if stays && worst(new) >= worst(old).min(LEAST_QUALITY) {
            mesh.flip(h);
            corners.iter().zip(changes).for_each(|(&v, change)| excess[v.index()] += change);
        }
    }
}

/// Moves every interior vertex that is on no crease to the mean of its ring within its tangent plane, weighted by area so that large
/// faces shrink, then onto the surface; a move that would turn or spoil a face is left out.
fn relax(mesh: &mut EditableMesh, surface: &dyn Surface) {
    let is_free = |v: &Vertex| !mesh.is_vertex_hole(*v) && mesh.constraint(*v) == Constraint::Free;
    let interior: Vec<Vertex> = mesh.vertices().filter(is_free).collect();
    let queries: Vec<Query> = interior
        .iter()
        .map(|&v| {
            let (mut normal, mut sum, mut total) = (DVec3::ZERO, DVec3::ZERO, 0.0);
            for o in mesh.outgoing(v) {
                let [p, x, y] =
                    [mesh.tail(o), mesh.tail(o.next()), mesh.tail(o.previous())].map(|w| mesh.position(w));
                let cross = cross([p, x, y]);
                let area = cross.length();
                normal += cross;
                sum += area * (p + x + y) / 3.0;
                total += area;
            }
            let (p, normal) = (mesh.position(v), normal.normalize_or_zero());
            let step = if total > 0.0 { sum / total - p } else { DVec3::ZERO };
            let guide = (normal != DVec3::ZERO).then_some(normal);
            Query { normal: guide, ..Query::at(p + step - normal * normal.dot(step)) }
        })
        .collect();
    for (&v, foot) in interior.iter().zip(projected(surface, &queries)) {
        let Ok(foot) = foot else { continue };
        let before = quality_around(mesh, v, mesh.position(v)).unwrap_or(0.0);
        if quality_around(mesh, v, foot.point).is_some_and(|after| after >= before.min(LEAST_QUALITY)) {
            mesh.positions[v.index()] = foot.point;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::triangle_shape::smallest_angles;
    use ndf_core::analytic::{Sphere, Torus};
    use ndf_core::{Hint, NoProgress};
    use ndf_mesh::shapes;
    use ndf_mesh::{TriangleMesh, TriangleTree, ValidationReport};

    fn remeshed(shape: TriangleMesh, surface: Option<&dyn Surface>, edge_length: f64) -> [ManifoldMesh; 2] {
        let mesh = ManifoldMesh::try_from(shape).unwrap();
        let options = IsotropicOptions::with_edges_of(edge_length);
        let result = remesh_isotropically(&mesh, surface, &options, &NoProgress).unwrap();
        [mesh, result]
    }

    #[test]
    fn edges_get_one_length_and_the_topology_stays() {
        let torus = Torus { center: DVec3::ZERO, ring: 1.0, tube: 0.4 };
        let cases: [(TriangleMesh, Option<&dyn Surface>, f64); 4] = [
            (shapes::icosphere(2), Some(&Sphere::UNIT), 0.1),
            (shapes::torus(200, 20, 1.0, 0.4), Some(&torus), 0.12),
            (shapes::trefoil_knot(300, 30, 0.2), None, 0.08),
            (shapes::grid(30, 4), None, 0.06),
        ];
        for (shape, surface, length) in cases {
            let [before, after] = remeshed(shape, surface, length);
            let report = ValidationReport::of(&after);
            assert_eq!(before.topology().euler_characteristic(), report.euler_characteristic);
            assert_eq!(report.degenerate_faces.count, 0);
            let edges = after.topology().edges();
            let lengths = edges.map(|e| {
                let [a, b] = after.topology().edge_vertices(e).map(|v| after.positions()[v.index()]);
                a.distance(b)
            });
            let mean = lengths.sum::<f64>() / after.topology().edge_count() as f64;
            assert!((0.8..1.2).contains(&(mean / length)), "{}", mean / length);
            let angles = smallest_angles(&after);
            let low = angles[angles.len() / 20].to_degrees();
            assert!(low > 25.0, "{low}° with edges of {length}");
        }
    }

    #[test]
    fn vertices_stay_on_the_surface_and_the_boundary() {
        let [_, sphere] = remeshed(shapes::icosphere(3), Some(&Sphere::UNIT), 0.15);
        let off = sphere.positions().iter().map(|p| (p.length() - 1.0).abs()).fold(0.0, f64::max);
        assert!(off < 0.02, "{off}");
        let [_, grid] = remeshed(shapes::grid(7, 3), None, 0.05);
        assert!((grid.area() - 1.0).abs() < 1e-9);
    }

    /// A cube stays one, with edges of one length on its edges, too.
    #[test]
    fn creases_are_kept() {
        let cube = ManifoldMesh::try_from(shapes::cube(3)).unwrap();
        for length in [0.31, 0.11] {
            let options =
                IsotropicOptions { crease_angle: Some(0.5), ..IsotropicOptions::with_edges_of(length) };
            let found = remesh_isotropically(&cube, None, &options, &NoProgress).unwrap();
            assert!((found.area() - cube.area()).abs() < 1e-9 * cube.area());
            assert!(ValidationReport::of(&found).is_oriented_manifold());
            let mut round = options;
            round.crease_angle = None;
            let rounded = remesh_isotropically(&cube, None, &round, &NoProgress).unwrap();
            assert!(rounded.area() < 0.999 * cube.area());
            let mut marked = EditableMesh::new(&found);
            marked.mark_creases(0.5);
            let creases = marked.halfedges().filter(|&h| marked.is_crease(h) && h < marked.raw_twin(h));
            let lengths: Vec<f64> = creases.map(|h| length_squared(&marked, h).sqrt() / length).collect();
            assert!(lengths.iter().all(|x| (0.5..1.4).contains(x)), "{lengths:?}");
        }
    }

    #[test]
    fn splitting_moves_no_point() {
        for mesh in [shapes::cube(3), shapes::icosphere(2), shapes::grid(7, 3)] {
            let mesh = ManifoldMesh::try_from(mesh).unwrap();
            let length = |mesh: &EditableMesh, h: Halfedge| length_squared(mesh, h).sqrt();
            let lengths = |mesh: &ManifoldMesh| -> Vec<f64> {
                let mesh = EditableMesh::new(mesh);
                mesh.halfedges().filter(|&h| !mesh.is_hole(h)).map(|h| length(&mesh, h)).collect()
            };
            let shortest = lengths(&mesh).into_iter().fold(f64::INFINITY, f64::min);
            for most in [2.0 * shortest, 0.7 * shortest, 0.1 * shortest] {
                let found = split_edges(&mesh, most, &NoProgress).unwrap();
                assert!(lengths(&found).into_iter().all(|x| x <= most));
                assert!((found.area() / mesh.area() - 1.0).abs() < 1e-10);
                assert!(ValidationReport::of(&found).is_oriented_manifold());
                assert_eq!(found.positions()[..mesh.vertex_count()], *mesh.positions());
                let tree = TriangleTree::new(&mesh);
                let off = |p: &DVec3| tree.closest_point(*p, Hint::NONE).unwrap().distance_squared.sqrt();
                assert!(found.positions().iter().all(|p| off(p) < 1e-14));
            }
        }
    }

    #[test]
    fn impossible_lengths_are_refused() {
        let mesh = ManifoldMesh::try_from(shapes::icosphere(1)).unwrap();
        for edge_length in [0.0, -1.0, f64::NAN, 1e-9] {
            assert!(split_edges(&mesh, edge_length, &NoProgress).is_err());
            let options = IsotropicOptions::with_edges_of(edge_length);
            assert!(remesh_isotropically(&mesh, None, &options, &NoProgress).is_err());
        }
    }
}

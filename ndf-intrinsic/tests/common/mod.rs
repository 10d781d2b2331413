//! Meshes made by code, and the laws every intrinsic triangulation obeys.
#![allow(dead_code, reason = "each test file uses its own share")]
#![allow(clippy::unwrap_used, reason = "these are tests")]

pub(crate) mod signposts;

use std::collections::BTreeMap;

use ndf_core::DVec3;
use ndf_intrinsic::IntrinsicTriangulation;
use ndf_intrinsic::normal_coordinates::Arcs;
use ndf_mesh::shapes;
use ndf_mesh::{Edge, Face, FacePoint, ManifoldMesh, SurfacePoint, TriangleMesh, Vertex};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

pub(crate) fn rng(seed: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(seed)
}

pub(crate) fn manifold(mesh: TriangleMesh) -> ManifoldMesh {
    ManifoldMesh::try_from(mesh).unwrap()
}

/// Moves every vertex by up to `amount` along each axis.
pub(crate) fn jittered(mesh: TriangleMesh, amount: f64, seed: u64) -> TriangleMesh {
    let mut rng = rng(seed);
    let (positions, faces) = mesh.into_parts();
    let mut random = || rng.random_range(-amount..=amount);
    let moved = positions.into_iter().map(|p| p + DVec3::new(random(), random(), random())).collect();
    TriangleMesh::new(moved, faces).unwrap()
}

/// The surface of a plate of unit cubes with `holes` square holes: genus `holes`.
pub(crate) fn plate_with_holes(holes: i32) -> TriangleMesh {
    let filled = |x: i32, y: i32, z: i32| {
        let inside = (0..2 * holes + 1).contains(&x) && (0..3).contains(&y) && z == 0;
        inside && !(y == 1 && x % 2 == 1)
    };
    let mut ids = BTreeMap::new();
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for x in 0..2 * holes + 1 {
        for y in 0..3 {
            if !filled(x, y, 0) {
                continue;
            }
            for axis in 0..3 {
                for sign in [-1, 1] {
                    let mut normal = [0; 3];
                    normal[axis] = sign;
                    if filled(x + normal[0], y + normal[1], normal[2]) {
                        continue;
                    }
                    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                    let mut corner = |a: i32, b: i32| {
                        let mut p = [x, y, 0];
                        p[axis] += i32::from(sign > 0);
                        p[u] += a;
                        p[v] += b;
                        *ids.entry(p).or_insert_with(|| {
                            positions.push(DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2])));
                            positions.len() as u32 - 1
                        })
                    };
                    let mut q = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                    if sign < 0 {
                        q.reverse();
                    }
                    faces.extend([[q[0], q[1], q[2]], [q[0], q[2], q[3]]]);
                }
            }
        }
    }
    TriangleMesh::new(positions, faces).unwrap()
}

/// Small meshes of all kinds, different for every seed.
pub(crate) fn random_meshes(seed: u64) -> Vec<(&'static str, ManifoldMesh)> {
    let stretched =
        jittered(shapes::icosphere(1), 0.05, seed).map_positions(|p| p * DVec3::new(30.0, 1.0, 1.0));
    vec![
        ("sphere", manifold(jittered(shapes::icosphere(1), 0.1, seed))),
        ("torus", manifold(jittered(shapes::torus(7, 5, 1.0, 0.4), 0.08, seed))),
        ("genus 6", manifold(jittered(plate_with_holes(6), 0.2, seed))),
        ("boundary", manifold(jittered(shapes::grid(4, 3), 0.05, seed))),
        ("tiny angles", manifold(stretched)),
        ("tetrahedron", manifold(jittered(tetrahedron(), 0.1, seed))),
    ]
}

pub(crate) fn tetrahedron() -> TriangleMesh {
    let p = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    TriangleMesh::new(p.map(DVec3::from).to_vec(), vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]).unwrap()
}

/// A random point strictly inside a random face or edge.
pub(crate) fn random_point(triangulation: &IntrinsicTriangulation<'_>, rng: &mut ChaCha8Rng) -> SurfacePoint {
    let mesh = triangulation.mesh();
    if rng.random_range(0..3) == 0 {
        let edge = Edge(rng.random_range(0..mesh.edge_count() as u32));
        return SurfacePoint::Edge { edge, t: rng.random_range(0.1..0.9) };
    }
    let face = Face(rng.random_range(0..mesh.face_count() as u32));
    let w: [f64; 3] = [0, 1, 2].map(|_| rng.random_range(0.1..1.0));
    SurfacePoint::Face(FacePoint { face, barycentric: w.map(|x| x / w.iter().sum::<f64>()) })
}

/// Flips, insertions and removals at random.
pub(crate) fn random_edits(
    triangulation: &mut IntrinsicTriangulation<'_>,
    edits: usize,
    rng: &mut ChaCha8Rng,
) {
    for _ in 0..edits {
        match rng.random_range(0..10) {
            0 | 1 => {
                let point = random_point(triangulation, rng);
                triangulation.insert(point).unwrap();
            }
            2 => {
                let v = Vertex(rng.random_range(0..triangulation.mesh().vertex_count() as u32));
                // The input's vertices refuse; so may others.
                let _ = triangulation.remove(v);
            }
            _ => {
                let e = Edge(rng.random_range(0..triangulation.mesh().edge_count() as u32));
                let _ = triangulation.flip(e);
            }
        }
    }
}

/// Every law that ties the integers, the lengths and the input together.
pub(crate) fn assert_sound(triangulation: &IntrinsicTriangulation<'_>) {
    let (mesh, coordinates) = (triangulation.mesh(), triangulation.coordinates());
    let input = triangulation.input();
    mesh.check().unwrap();
    assert_eq!(mesh.euler_characteristic(), input.topology().euler_characteristic());
    assert!(mesh.lengths().iter().all(|l| l.is_finite() && *l >= 0.0));
    for f in mesh.faces() {
        let normal = mesh.face_edges(f).map(|e| coordinates.normal_coordinate(e));
        assert!(Arcs::checked(normal).is_some(), "face {f}: {normal:?}");
    }
    // Crossings met along the intrinsic edges…
    let mut crossings = BTreeMap::new();
    for e in mesh.edges() {
        let trace = triangulation.trace_edge(e);
        assert_eq!(trace.len() as i32, coordinates.normal_coordinate(e).max(0));
        for pair in trace.windows(2) {
            assert!(pair[0].along <= pair[1].along + 1e-9);
            assert_eq!(
                input.topology().twin(pair[0].input_halfedge).unwrap().face(),
                pair[1].input_halfedge.face()
            );
        }
        for crossing in trace {
            *crossings.entry((e, input.topology().halfedge_edge(crossing.input_halfedge))).or_insert(0) += 1;
        }
    }
    // … are those met along the input's edges.
    for e in input.topology().edges() {
        if input.topology().twin(input.topology().edge_halfedge(e)).is_none() {
            continue;
        }
        let forward = coordinates.trace_input(input.topology().edge_halfedge(e));
        let mut backward =
            coordinates.trace_input(input.topology().twin(input.topology().edge_halfedge(e)).unwrap());
        backward.reverse();
        assert_eq!(forward.len(), backward.len());
        for (&(h, q), &(back, p)) in forward.iter().zip(&backward) {
            assert_eq!(mesh.twin(h), Some(back));
            assert_eq!(q + p + 1, coordinates.normal_coordinate(mesh.halfedge_edge(h)));
            *crossings.entry((mesh.halfedge_edge(h), e)).or_insert(0) -= 1;
        }
    }
    assert!(crossings.values().all(|&n| n == 0), "crossings differ: {crossings:?}");
}

/// Whether every edge, laid out over the input as its integers say, is as long as its length says.
pub(crate) fn assert_lengths_agree(triangulation: &IntrinsicTriangulation<'_>, tolerance: f64) {
    let mesh = triangulation.mesh();
    let unit = mesh.lengths().iter().copied().fold(0.0, f64::max);
    for e in mesh.edges() {
        let laid_out = triangulation.laid_out_length(e);
        let error = (laid_out - mesh.length(e)).abs();
        assert!(error <= tolerance * unit, "edge {e}: {laid_out} laid out, length {}", mesh.length(e));
    }
}

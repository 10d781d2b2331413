use super::*;
use crate::{ManifoldMesh, shapes};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

fn topology(mesh: crate::TriangleMesh) -> Topology {
    ManifoldMesh::try_from(mesh).unwrap().topology().clone()
}

fn small_shapes() -> [Topology; 3] {
    [shapes::icosphere(1), shapes::torus(5, 4, 1.0, 0.4), shapes::grid(3, 2)].map(topology)
}

#[test]
fn shapes_have_their_topology() {
    for (mesh, euler, boundary) in [
        (shapes::icosphere(3), 2, 0),
        (shapes::torus(24, 12, 1.0, 0.4), 0, 0),
        (shapes::cube(4), 2, 0),
        (shapes::grid(5, 3), 1, 16),
    ] {
        let complex = topology(mesh);
        complex.check().unwrap();
        assert!(complex.is_simplicial());
        assert_eq!(complex.euler_characteristic(), euler);
        assert_eq!(complex.boundary_edge_count(), boundary);
    }
}

#[test]
fn boundary_fans_are_complete() {
    let grid = topology(shapes::grid(2, 2));
    assert_eq!(
        grid.vertices().filter(|&v| grid.is_boundary_vertex(v)).map(|v| v.0).collect::<Vec<_>>(),
        [0, 1, 2, 3, 5, 6, 7, 8]
    );
    let (inner, outer) = (Vertex(4), Vertex(1));
    assert_eq!(grid.ring(inner).count(), grid.outgoing(inner).count());
    assert_eq!(grid.ring(outer).count(), grid.outgoing(outer).count() + 1);
    assert!(grid.ring(outer).zip(grid.edges_at(outer)).all(|(v, h)| v == grid.tip(h) || v == grid.tail(h)));
}

#[test]
fn gluings_are_checked() {
    let torus = Topology::<()>::from_gluing(1, &[0; 6], &[3, 4, 5, 0, 1, 2].map(Halfedge)).unwrap();
    torus.check().unwrap();
    assert_eq!(torus.euler_characteristic(), 0);
    assert!(!torus.is_simplicial());
    let pillow =
        Topology::<()>::from_gluing(3, &[0, 1, 2, 0, 2, 1], &[5, 4, 3, 2, 1, 0].map(Halfedge)).unwrap();
    assert!(!pillow.is_simplicial(), "both faces have the same corners");
    let error = |vertices, tails: &[u32], twins: &[Halfedge]| {
        Topology::<()>::from_gluing(vertices, tails, twins).unwrap_err()
    };
    const OPEN: [Halfedge; 3] = [NO_HALFEDGE; 3];
    assert_eq!(error(3, &[0, 1], &[NO_HALFEDGE; 2]), TopologyError::Counts { tails: 2, twins: 2 });
    assert_eq!(error(3, &[0, 1, 3], &OPEN), TopologyError::Tail(Halfedge(2)));
    assert_eq!(
        error(3, &[0, 1, 2], &[Halfedge(0), NO_HALFEDGE, NO_HALFEDGE]),
        TopologyError::Twin(Halfedge(0))
    );
    assert_eq!(
        error(3, &[0, 1, 2], &[Halfedge(1), Halfedge(0), NO_HALFEDGE]),
        TopologyError::Ends(Halfedge(0))
    );
    assert_eq!(error(4, &[0, 1, 2], &OPEN), TopologyError::Fan(Vertex(3)));
    assert_eq!(error(1, &[0, 0, 0], &OPEN), TopologyError::Fan(Vertex(0)));
}

#[test]
fn random_edits_keep_a_complex_sound() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for mut complex in small_shapes() {
        let (euler, inputs) = (complex.euler_characteristic(), complex.vertex_count());
        for _ in 0..1500 {
            random_edit(&mut complex, inputs, &mut rng);
            complex.check().unwrap();
            assert_eq!(complex.euler_characteristic(), euler);
        }
    }
}

/// A flip, split or removal of a vertex that was inserted, where the complex admits it.
fn random_edit(complex: &mut Topology, inputs: usize, rng: &mut ChaCha8Rng) {
    let edge = Edge(rng.random_range(0..complex.edge_count() as u32));
    let h = complex.edge_halfedge(edge);
    match rng.random_range(0..6) {
        0 => {
            complex.insert_in_face(Face(rng.random_range(0..complex.face_count() as u32)));
        }
        1 => {
            complex.split_edge(complex.twin(h).filter(|&t| t == h.previous()).unwrap_or(h));
        }
        2 | 3 if complex.twin(h).is_some_and(|t| t.face() != h.face()) => {
            complex.flip(h);
        }
        _ => {
            let v = Vertex(rng.random_range(0..complex.vertex_count() as u32));
            let faces: Vec<Face> = complex.outgoing(v).map(Halfedge::face).collect();
            let simple = faces.iter().all(|f| faces.iter().filter(|g| f == *g).count() == 1);
            match (v.index() >= inputs && simple, complex.is_boundary_vertex(v), faces.len()) {
                (true, true, 2) => drop(complex.remove_boundary_degree_two(v)),
                (true, false, 3) => drop(complex.remove_degree_three(v)),
                _ => {}
            }
        }
    }
}

#[test]
fn random_edits_keep_a_complex_simplicial() {
    for seed in 0..6 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        for shape in
            [shapes::icosphere(2), shapes::torus(12, 8, 1.0, 0.4), shapes::grid(6, 5), shapes::cube(2)]
        {
            let mut complex = topology(shape);
            let loops = boundary_loops(&complex);
            let euler = complex.euler_characteristic();
            for _ in 0..400 {
                let h = Halfedge(rng.random_range(0..complex.halfedge_count() as u32));
                match rng.random_range(0..4) {
                    0 => drop(complex.split_edge(h)),
                    1 if complex.is_flippable(h) => drop(complex.flip(h)),
                    _ if complex.is_collapsible(h) => {
                        complex.collapse(h);
                        complex.compact();
                    }
                    _ => {}
                }
                complex.check().unwrap();
                assert!(complex.is_simplicial());
                assert_eq!(complex.euler_characteristic(), euler);
                assert_eq!(boundary_loops(&complex), loops);
            }
        }
    }
}

fn boundary_loops(complex: &Topology) -> usize {
    let mut seen = vec![false; complex.vertex_count()];
    let mut loops = 0;
    for v in complex.vertices().filter(|&v| complex.is_boundary_vertex(v)) {
        loops += usize::from(!seen[v.index()]);
        let mut at = v;
        while !std::mem::replace(&mut seen[at.index()], true) {
            at = complex.tip(complex.vertex_halfedge(at));
        }
    }
    loops
}

/// What [`Topology::is_collapsible`] must say: whether the complex without the edge is a surface of the same kind.
#[test]
fn the_link_condition_is_exact() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut asked = [0; 2];
    for shape in [shapes::icosphere(0), shapes::torus(4, 4, 1.0, 0.4), shapes::grid(3, 3), shapes::cube(1)] {
        let start = topology(shape);
        for _ in 0..40 {
            let mut complex = start.clone();
            loop {
                let edges: Vec<Halfedge> = complex.halfedges().collect();
                for &h in &edges {
                    let allowed = complex.is_collapsible(h);
                    assert_eq!(allowed, collapse_is_simplicial(&complex, h), "half-edge {h}");
                    asked[usize::from(allowed)] += 1;
                }
                let allowed: Vec<Halfedge> =
                    edges.into_iter().filter(|&h| complex.is_collapsible(h)).collect();
                if allowed.is_empty() {
                    break;
                }
                complex.collapse(allowed[rng.random_range(0..allowed.len())]);
                complex.compact();
            }
        }
    }
    assert!(asked.iter().all(|&n| n > 1000), "{asked:?}");
}

/// Collapses by renaming corners, and asks validation.
fn collapse_is_simplicial(complex: &Topology, h: Halfedge) -> bool {
    let (i, j) = (complex.tail(h), complex.tip(h));
    let faces = complex.faces().map(|f| complex.face_vertices(f));
    let merged: Vec<[Vertex; 3]> = faces
        .filter(|f| !(f.contains(&i) && f.contains(&j)))
        .map(|f| f.map(|v| if v == j { i } else { v }))
        .collect();
    let mut used: Vec<Vertex> = merged.concat();
    used.sort_unstable();
    used.dedup();
    let faces = merged.into_iter().map(|f| f.map(|v| used.binary_search(&v).unwrap() as u32)).collect();
    let positions = vec![ndf_core::DVec3::ZERO; used.len()];
    let loops = boundary_loops(complex);
    let mesh = crate::TriangleMesh::new(positions, faces).unwrap();
    ManifoldMesh::try_from(mesh).is_ok_and(|mesh| {
        mesh.topology().euler_characteristic() == complex.euler_characteristic()
            && used.len() + 1 == complex.vertex_count()
            && boundary_loops(mesh.topology()) == loops
    })
}

#[test]
fn rotated_faces_keep_a_complex_sound() {
    for mut complex in small_shapes() {
        let euler = complex.euler_characteristic();
        for h in complex.halfedges() {
            let corners = complex.face_vertices(h.face());
            complex.rotate_face(h.face());
            complex.check().unwrap();
            assert_eq!(complex.face_vertices(h.face()), [corners[1], corners[2], corners[0]]);
        }
        assert_eq!(complex.euler_characteristic(), euler);
    }
}

//! Meshes that are known to break intrinsic triangulations, and the errors that are due.

mod common;

use common::{assert_lengths_agree, assert_sound, manifold, random_meshes, rng};
use ndf_core::{DVec3, NoProgress};
use ndf_intrinsic::{
    ExtractionOptions, FlipError, InsertError, IntrinsicTriangulation, RefinementOptions, RemoveError,
    extract,
};
use ndf_mesh::shapes;
use ndf_mesh::{Edge, Face, FacePoint, ManifoldMesh, SurfacePoint, TriangleMesh, Vertex};
use ndf_model::DisplacementField;
use ndf_model::FieldShape;
use rand::RngExt;

/// Flips, refines and subdivides; everything must hold afterwards.
fn survives(mesh: &ManifoldMesh, refine: bool) {
    let mut triangulation = IntrinsicTriangulation::new(mesh);
    let report = triangulation.flip_to_delaunay();
    assert!(!report.stopped);
    assert!(triangulation.mesh().is_delaunay(), "{report:?}");
    assert_sound(&triangulation);
    let mut done = String::new();
    if refine {
        let report = triangulation.refine_delaunay(&RefinementOptions::default());
        assert!(!report.reached_cap && report.unrefined_faces == 0, "{report:?}");
        assert!(report.min_angle.to_degrees() >= 25.0 - 1e-9, "{report:?}");
        assert!(triangulation.mesh().is_delaunay());
        assert_sound(&triangulation);
        done = format!("{report:?}");
    }
    assert_lengths_agree(&triangulation, 1e-8);
    let subdivision = triangulation.common_subdivision();
    let positions = subdivision.positions(mesh);
    let total: f64 = subdivision
        .faces
        .iter()
        .map(|f| {
            let [a, b, c] = f.map(|v| positions[v as usize]);
            0.5 * (b - a).cross(c - a).length()
        })
        .sum();
    let expected = mesh.area();
    assert!((total - expected).abs() <= 1e-9 * expected, "{total} of {expected}; {done}");
}

#[test]
fn a_subdivided_cube() {
    survives(&manifold(shapes::cube(8)), true);
}

#[test]
fn a_flat_plate_with_boundary() {
    survives(&manifold(shapes::grid(12, 7)), true);
    survives(&manifold(shapes::grid(9, 9).map_positions(|p| p * DVec3::new(1.0, 0.05, 1.0))), true);
}

#[test]
fn a_sphere_stretched_sixty_times() {
    survives(&manifold(shapes::icosphere(3).map_positions(|p| p * DVec3::new(60.0, 1.0, 1.0))), true);
}

#[test]
fn slivers_as_of_marching_cubes() {
    // Vertices pushed almost onto their neighbours, as where an isosurface passes grid points closely.
    let mesh = shapes::icosphere(3);
    let (mut positions, faces) = mesh.into_parts();
    let mut rng = rng(4);
    for face in faces.iter().step_by(5) {
        let [a, b, _] = face.map(|v| v as usize);
        let t = 10.0_f64.powf(rng.random_range(-6.0..-2.0));
        positions[a] = positions[b].lerp(positions[a], t);
    }
    survives(&manifold(TriangleMesh::new(positions, faces).unwrap()), false);
}

#[test]
fn decimated_meshes() {
    for mesh in [shapes::torus(60, 30, 1.0, 0.4), shapes::cube(16), shapes::icosphere(4)] {
        let field = DisplacementField::untrained(manifold(mesh), FieldShape::default(), 1).unwrap();
        // Collapses only: vertices stay where they are.
        let options = ExtractionOptions { relaxations: 0, ..ExtractionOptions::new(0.5) };
        let decimated = extract(&field, &options, &NoProgress).unwrap().mesh;
        assert!(decimated.face_count() * 8 < field.base().face_count(), "{} faces", decimated.face_count());
        survives(&decimated, true);
    }
}

#[test]
fn random_meshes_reach_the_angle() {
    for seed in 0..10 {
        for (name, mesh) in random_meshes(seed) {
            eprintln!("{name}, seed {seed}");
            survives(&mesh, true);
        }
    }
}

#[test]
fn faces_without_area_are_mollified_and_the_report_says_so() {
    let p = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0]].map(DVec3::from);
    let mesh = TriangleMesh::new(p.to_vec(), vec![[0, 1, 2], [0, 3, 1]]).unwrap();
    let mesh = manifold(mesh);
    let mut triangulation = IntrinsicTriangulation::new(&mesh);
    let report = triangulation.mollification();
    assert_eq!(report.faces, 1);
    assert!(report.added > 0.0 && report.relative < 1e-9);
    triangulation.flip_to_delaunay();
    assert!(triangulation.mesh().is_delaunay());
    assert!(triangulation.mesh().lengths().iter().all(|l| l.is_finite()));
}

#[test]
fn zero_length_edges_survive() {
    let (mut positions, faces) = shapes::icosphere(1).into_parts();
    let [a, b, _] = faces[0].map(|v| v as usize);
    positions[a] = positions[b];
    let mesh = manifold(TriangleMesh::new(positions, faces).unwrap());
    let mut triangulation = IntrinsicTriangulation::new(&mesh);
    assert!(triangulation.mollification().added > 0.0);
    triangulation.flip_to_delaunay();
    assert!(triangulation.mesh().lengths().iter().all(|l| l.is_finite()));
    triangulation.mesh().check().unwrap();
}

#[test]
fn self_edges_come_about_and_insertions_beside_them_are_exact() {
    // A long thin tetrahedron: Delaunay flips join vertices to themselves around its sharp ends.
    let mut met = 0;
    for seed in 0..200 {
        let mut rng = rng(seed);
        let p = [0, 1, 2, 3].map(|_| {
            DVec3::new(rng.random_range(-1.0..1.0), rng.random_range(-0.1..0.1), rng.random_range(-0.1..0.1))
        });
        let faces = vec![[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
        let mesh = manifold(TriangleMesh::new(p.to_vec(), faces).unwrap());
        let mut triangulation = IntrinsicTriangulation::new(&mesh);
        triangulation.flip_to_delaunay();
        let loops = |t: &IntrinsicTriangulation<'_>| {
            t.mesh()
                .edges()
                .filter(|&e| {
                    let [a, b] = t.mesh().edge_vertices(e);
                    a == b
                })
                .count()
        };
        // Flips at random make loops where Delaunay ones do not.
        for _ in 0..30 {
            let _ = triangulation.flip(Edge(rng.random_range(0..6)));
        }
        if loops(&triangulation) == 0 {
            continue;
        }
        met += 1;
        for face in [0, 1, 2, 3].map(Face) {
            triangulation.insert_in_face(FacePoint { face, barycentric: [0.3, 0.3, 0.4] }).unwrap();
        }
        for e in (0..6).map(Edge) {
            triangulation.split_edge(e, 0.4).unwrap();
        }
        assert_sound(&triangulation);
        assert_lengths_agree(&triangulation, 1e-9);
    }
    assert!(met > 10, "{met} triangulations with self-edges");
}

#[test]
fn needles_are_left_alone_and_counted() {
    // A cone whose angles at the tip sum to far less than 60°.
    let n = 8;
    let ring = (0..n).map(|i| {
        let a = f64::from(i) * std::f64::consts::TAU / f64::from(n);
        DVec3::new(0.05 * a.cos(), 0.05 * a.sin(), 0.0)
    });
    let mut positions: Vec<DVec3> = ring.collect();
    positions.extend([DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO]);
    let n = n as u32;
    let faces = (0..n).flat_map(|i| [[i, (i + 1) % n, n], [(i + 1) % n, i, n + 1]]).collect();
    let mesh = manifold(TriangleMesh::new(positions, faces).unwrap());
    let mut triangulation = IntrinsicTriangulation::new(&mesh);
    let report = triangulation.refine_delaunay(&RefinementOptions::default());
    assert!(!report.reached_cap && report.unrefined_faces == 0, "{report:?}");
    assert!(report.needle_faces > 0);
}

#[test]
fn the_cap_ends_refinement_with_a_report() {
    let mesh = manifold(shapes::icosphere(2));
    let mut triangulation = IntrinsicTriangulation::new(&mesh);
    let options = RefinementOptions { max_circumradius: 1e-3, max_insertions: 100, ..Default::default() };
    let report = triangulation.refine_delaunay(&options);
    assert!(report.reached_cap);
    assert_eq!(report.insertions, 100);
    assert!(report.unrefined_faces > 0);
    assert!(triangulation.mesh().is_delaunay());
}

#[test]
fn radii_are_bounded_where_asked() {
    for mesh in [shapes::icosphere(1), shapes::grid(3, 2)] {
        let mesh = manifold(mesh);
        let mut triangulation = IntrinsicTriangulation::new(&mesh);
        let options = RefinementOptions { max_circumradius: 0.1, ..Default::default() };
        let report = triangulation.refine_delaunay(&options);
        assert_eq!(report.unrefined_faces, 0, "{report:?}");
        assert_sound(&triangulation);
    }
}

#[test]
fn embedded_triangulations_lie_on_their_input_and_converge_to_it() {
    // In the plane nothing is cut off.
    let refined = |mesh: &ManifoldMesh, max_circumradius| {
        let mut triangulation = IntrinsicTriangulation::new(mesh);
        triangulation.refine_delaunay(&RefinementOptions { max_circumradius, ..Default::default() });
        triangulation.embedded().unwrap()
    };
    let flat = manifold(shapes::grid(3, 2));
    assert!((refined(&flat, 0.1).area() / flat.area() - 1.0).abs() < 1e-12);
    // Of triangles that are smaller than the input's, those on its edges cut corners off: a share that shrinks with them.
    let bent = manifold(shapes::torus(60, 5, 1.0, 0.4));
    let missing = [0.02, 0.01].map(|radius| 1.0 - refined(&bent, radius).area() / bent.area());
    assert!(missing[0] > 0.0 && missing[1] < 0.7 * missing[0] && missing[1] < 1e-2, "{missing:?}");
}

#[test]
fn what_cannot_be_done_is_an_error() {
    let mesh = manifold(shapes::grid(3, 3));
    let mut triangulation = IntrinsicTriangulation::new(&mesh);
    assert_eq!(triangulation.remove(Vertex(3)), Err(RemoveError::OfInput(Vertex(3))));
    let boundary = mesh.topology().edges().find(|&e| triangulation.mesh().is_boundary_edge(e)).unwrap();
    assert_eq!(triangulation.flip(boundary), Err(FlipError::NotTwoFaces(boundary)));
    assert_eq!(triangulation.insert(SurfacePoint::Vertex(Vertex(1))), Err(InsertError::IsVertex(Vertex(1))));
    assert_eq!(
        triangulation.insert_in_face(FacePoint { face: Face(0), barycentric: [0.5, 0.5, 0.0] }),
        Err(InsertError::NotInside)
    );
    assert_eq!(
        triangulation.insert_in_face(FacePoint { face: Face(0), barycentric: [0.5, f64::NAN, 0.5] }),
        Err(InsertError::NotInside)
    );
    assert_eq!(triangulation.split_edge(Edge(0), 1.0), Err(InsertError::NotInside));
    let before = triangulation.mesh().vertex_count();
    let v = triangulation.insert_in_face(FacePoint { face: Face(0), barycentric: [0.2, 0.3, 0.5] }).unwrap();
    triangulation
        .move_vertex(v, SurfacePoint::Face(FacePoint { face: Face(5), barycentric: [0.3, 0.3, 0.4] }))
        .unwrap();
    assert_sound(&triangulation);
    triangulation.remove(v).unwrap();
    assert_eq!(triangulation.mesh().vertex_count(), before);
    assert_sound(&triangulation);
}

#[test]
fn sample_meshes_become_delaunay_and_reach_the_angle() {
    let Some(folder) = ndf_testing::data_path("mesh") else { return };
    for path in std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()) {
        let name = path.display();
        let file = ndf_mesh::io::read_mesh(&path).unwrap_or_else(|e| panic!("{e}"));
        let mesh = ManifoldMesh::try_from(file.mesh).unwrap_or_else(|e| panic!("{name}: {e}"));
        let mut triangulation = IntrinsicTriangulation::new(&mesh);
        let report = triangulation.flip_to_delaunay();
        assert!(!report.stopped && triangulation.mesh().is_delaunay(), "{name}: {report:?}");
        let report = triangulation.refine_delaunay(&RefinementOptions::default());
        assert!(triangulation.mesh().is_delaunay(), "{name}");
        assert!(!report.reached_cap && report.unrefined_faces == 0, "{name}: {report:?}");
        assert!(report.min_angle.to_degrees() >= 25.0 - 1e-9, "{name}: {report:?}");
        triangulation.mesh().check().unwrap();
    }
}

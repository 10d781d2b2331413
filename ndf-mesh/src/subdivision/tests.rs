//! Laws of subdivision.

use super::*;
use crate::shapes;

fn shapes() -> Vec<ManifoldMesh> {
    let shapes = [shapes::icosphere(1), shapes::torus(9, 6, 1.0, 0.4), shapes::grid(5, 3), shapes::cube(2)];
    shapes.into_iter().map(|mesh| ManifoldMesh::try_from(mesh).unwrap()).collect()
}

#[test]
fn levels_are_manifolds_with_the_numbers_their_faces_give() {
    for mesh in shapes() {
        let mut level = Refinement::from_mesh(&mesh);
        let mut positions = mesh.positions().to_vec();
        for _ in 0..3 {
            positions = level.subdivide(&positions);
            level = level.refined();
            let faces = level.faces().to_vec();
            let finer =
                ManifoldMesh::try_from(crate::TriangleMesh::new(positions.clone(), faces).unwrap()).unwrap();
            let anew = Refinement::from_mesh(&finer);
            assert_eq!(anew.edges, level.edges);
            assert_eq!(anew.face_edges, level.face_edges);
            assert_eq!(finer.topology().euler_characteristic(), mesh.topology().euler_characteristic());
            for (face, sides) in level.faces.iter().zip(&level.face_edges) {
                for c in 0..3 {
                    let mut ends = level.edges[sides[c] as usize].ends;
                    let mut side = [face[c], face[(c + 1) % 3]];
                    ends.sort_unstable();
                    side.sort_unstable();
                    assert_eq!(ends, side);
                }
            }
        }
    }
}

#[test]
fn the_limit_is_where_subdivision_goes() {
    for mesh in shapes() {
        let mut level = Refinement::from_mesh(&mesh);
        let mut positions = mesh.positions().to_vec();
        let limit = level.limit(&positions);
        for _ in 0..4 {
            // The limit of a vertex does not depend on the level at which it is taken.
            positions = level.subdivide(&positions);
            level = level.refined();
            for (a, b) in limit.iter().zip(level.limit(&positions)) {
                assert!((*a - b).length() < 1e-13);
            }
        }
    }
}

#[test]
fn limits_and_normals_need_no_connectivity_of_the_next_level() {
    for (mesh, angle) in shapes().into_iter().flat_map(|mesh| [(mesh.clone(), 9.0), (mesh, 0.7)]) {
        let creases = Creases::by_angle(&mesh, angle, 0.9);
        let level = Refinement::from_mesh(&mesh).with_creases(&creases);
        let (finer, next) = (level.subdivide(mesh.positions()), level.refined());
        assert_eq!(level.refined_faces(), next.faces());
        let pairs = [
            (level.refined_limit(&finer), next.limit(&finer)),
            (level.refined_normals(&finer), next.normals(&finer)),
        ];
        for (found, expected) in pairs {
            assert_eq!(found.len(), expected.len());
            assert!(found.iter().zip(&expected).all(|(a, b)| a.distance(*b) < 1e-14));
        }
    }
}

/// A plane stays a plane, and a regular mesh over it stays where it is: the rules reproduce linear functions.
#[test]
fn planes_are_kept() {
    let mesh = ManifoldMesh::try_from(shapes::grid(6, 6)).unwrap();
    let finer = Refinement::from_mesh(&mesh).subdivide(mesh.positions());
    assert!(finer.iter().all(|p| p.z.abs() < 1e-15));
}

/// A mesh whose edges are all creases stays where it is, however often it is subdivided.
#[test]
fn creases_everywhere_keep_the_mesh() {
    for mesh in shapes() {
        let mut level = Refinement::from_mesh(&mesh).with_creases(&Creases::everywhere(&mesh));
        let mut positions = mesh.positions().to_vec();
        for _ in 0..2 {
            let middles = level.edges().iter().map(|side| {
                let [a, b] = side.ends.map(|v| positions[v as usize]);
                0.5 * (a + b)
            });
            let expected: Vec<DVec3> = positions.iter().copied().chain(middles).collect();
            positions = level.subdivide(&positions);
            assert!(positions.iter().zip(&expected).all(|(a, b)| a.distance(*b) < 1e-15));
            level = level.refined();
            let limit = level.limit(&positions);
            assert!(limit.iter().zip(&positions).all(|(a, b)| a.distance(*b) < 1e-15));
        }
    }
}

/// The sides of a cube meet in creases and corners: sides stay flat and corners stay.
#[test]
fn a_cube_has_twelve_creases_and_eight_corners() {
    let cube = ManifoldMesh::try_from(shapes::cube(3)).unwrap();
    let creases = Creases::by_angle(&cube, 0.7, 0.9);
    assert_eq!(creases.edges().count(), 12 * 3);
    assert_eq!(creases.corners().count(), 0, "three creases make a corner by themselves");
    let mut level = Refinement::from_mesh(&cube).with_creases(&creases);
    let mut positions = cube.positions().to_vec();
    let bounds = cube.bounds();
    for _ in 0..3 {
        positions = level.subdivide(&positions);
        level = level.refined();
    }
    positions = level.limit(&positions);
    let on_side = |p: DVec3| {
        let away = (p - bounds.min).abs().min((p - bounds.max).abs());
        away.min_element() < 1e-12
    };
    assert!(positions.iter().all(|&p| on_side(p)));
    let sharp = level.edges().iter().filter(|side| side.is_sharp).count();
    assert_eq!(sharp, 12 * 3 * 8);
}

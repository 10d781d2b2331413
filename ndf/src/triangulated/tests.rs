use std::borrow::Cow;

use ndf_core::{DVec3, NoProgress};
use ndf_fields::CentreKind;
use ndf_mesh::{FacePoint, shapes};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

fn triangulated(mesh: TriangleMesh) -> Triangulated {
    Triangulated::from_mesh(mesh, &RepairOptions::default()).unwrap()
}

fn distances(mesh: &Triangulated, sources: &[Place]) -> Distances {
    mesh.distances(sources, &DistanceOptions::default(), &NoProgress).unwrap()
}

/// Bodies side by side.
fn side_by_side(bodies: &[TriangleMesh]) -> TriangleMesh {
    let (mut positions, mut faces) = (Vec::new(), Vec::new());
    for (k, body) in bodies.iter().enumerate() {
        let first = positions.len() as u32;
        positions.extend(body.positions().iter().map(|&p| p + 4.0 * k as f64 * DVec3::X));
        faces.extend(body.faces().iter().map(|f| f.map(|v| v + first)));
    }
    TriangleMesh::new(positions, faces).unwrap()
}

/// A mesh as files have it: seams, vertices that no face uses, faces turned, all in a random order; and which vertex of the mesh each is.
fn as_in_a_file(mesh: &TriangleMesh, random: &mut ChaCha8Rng) -> (TriangleMesh, Vec<Option<usize>>) {
    let mut places: Vec<Option<usize>> = (0..mesh.vertex_count()).map(Some).collect();
    let mut faces = mesh.faces().to_vec();
    for face in &mut faces {
        for corner in face.iter_mut() {
            if random.random_bool(0.1) {
                places.push(Some(*corner as usize));
                *corner = places.len() as u32 - 1;
            }
        }
        if random.random_bool(0.3) {
            face.swap(0, 1);
        }
    }
    let used: Vec<bool> = (0..places.len() as u32).map(|v| faces.as_flattened().contains(&v)).collect();
    places.iter_mut().zip(used).filter(|(_, used)| !used).for_each(|(place, _)| *place = None);
    places.extend([None; 10]);
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.shuffle(random);
    let mut new_place = vec![0; order.len()];
    order.iter().enumerate().for_each(|(new, &old)| new_place[old] = new as u32);
    let places: Vec<Option<usize>> = order.into_iter().map(|old| places[old]).collect();
    let position = |place: &Option<usize>| place.map_or(DVec3::splat(9.0), |v| mesh.positions()[v]);
    let positions = places.iter().map(position).collect();
    let faces = faces.into_iter().map(|face| face.map(|v| new_place[v as usize])).collect();
    (TriangleMesh::new(positions, faces).unwrap(), places)
}

/// What a solver says of pairs, points and paths is what distances of all vertices say, on clean meshes and on files.
#[test]
fn a_solver_agrees_with_distances() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let clean = side_by_side(&[shapes::torus(12, 8, 1.0, 0.4), shapes::grid(4, 4)]);
    let (file, _) = as_in_a_file(&clean, &mut random);
    for mesh in [clean, file] {
        let surface = triangulated(mesh.clone());
        let solver = DistanceSolver::new(Cow::Borrowed(&surface)).unwrap();
        let used = mesh.faces().as_flattened().iter().step_by(41).map(|&v| Vertex(v));
        let vertices: Vec<Vertex> = used.collect();
        let matrix = solver.matrix(&vertices, &NoProgress).unwrap();
        for (i, &vertex) in vertices.iter().enumerate() {
            let source = [Place::Vertex(vertex)];
            let all = distances(&surface, &source).values;
            for (j, &other) in vertices.iter().enumerate() {
                let (found, expected) = (matrix[i * vertices.len() + j], all[other.index()]);
                assert!(found == expected || (found - expected).abs() < 1e-12, "{found} {expected}");
                assert_eq!(found, matrix[j * vertices.len() + i]);
            }
            let corners: Vec<FacePoint> =
                (0..9).map(|h| FacePoint::at_corner(ndf_mesh::Halfedge::new(h))).collect();
            let options = DistanceOptions::default();
            let at = solver.distances_at(&source, &corners, &options, &NoProgress).unwrap();
            for (&found, &v) in at.iter().zip(mesh.faces().as_flattened()) {
                let expected = all[v as usize];
                assert!(found == expected || (found - expected).abs() < 1e-12, "{found} {expected}");
            }
            match solver.path(source[0], Place::Vertex(vertices[0]), &NoProgress) {
                Ok(path) => assert!((path.length - all[vertices[0].index()]).abs() < 1e-12),
                Err(_) => assert!(all[vertices[0].index()].is_infinite()),
            }
        }
    }
}

#[test]
fn distances_and_modes_of_a_file_are_those_of_the_clean_mesh() {
    let clean = side_by_side(&[shapes::torus(14, 8, 1.0, 0.4), shapes::icosphere(2), shapes::grid(6, 5)]);
    let truth = triangulated(clean.clone());
    assert!(truth.notes.is_empty() && truth.original.is_none());
    let options = ModeOptions { count: 7, ..ModeOptions::default() };
    let true_modes = truth.modes(&options, &NoProgress).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(5);
    for _ in 0..6 {
        let (file, places) = as_in_a_file(&clean, &mut random);
        let mesh = triangulated(file);
        let unused: Vec<Vertex> =
            places.iter().enumerate().filter(|(_, p)| p.is_none()).map(|(v, _)| Vertex::new(v)).collect();
        assert_eq!(mesh.unused_vertices(), unused);
        let source = places.iter().position(|place| *place == Some(20)).unwrap();
        let options_to = DistanceOptions {
            paths_to: vec![Place::Near(clean.positions()[3])],
            ..DistanceOptions::default()
        };
        let found = mesh.distances(&[Place::Vertex(Vertex::new(source))], &options_to, &NoProgress).unwrap();
        let expected = distances(&truth, &[Place::Vertex(Vertex(20))]).values;
        assert_eq!(found.values.len(), places.len());
        for (value, place) in found.values.iter().zip(&places) {
            let expected = place.map_or(f64::INFINITY, |v| expected[v]);
            assert!(*value == expected || (value - expected).abs() < 1e-12, "{value} {expected}");
        }
        let path = found.paths[0].as_ref().unwrap();
        let positions: Vec<DVec3> = path.points.iter().map(|p| p.position(mesh.mesh())).collect();
        assert!(positions[0].distance(clean.positions()[20]) < 1e-12);
        let length: f64 = positions.windows(2).map(|p| p[0].distance(p[1])).sum();
        assert!((length - expected[3]).abs() < 1e-9 && path.source == 0);

        let modes = mesh.modes(&options, &NoProgress).unwrap();
        for (found, expected) in modes.eigenvalues.iter().zip(&true_modes.eigenvalues) {
            assert!((found - expected).abs() < 1e-6 * (1.0 + expected), "{found} {expected}");
        }
        for scalar in mesh.mode_scalars(&modes) {
            assert!(scalar.values.iter().zip(&places).all(|(x, place)| x.is_nan() == place.is_none()));
            // Vertices that are one have one value.
            for (x, place) in scalar.values.iter().zip(&places).filter(|(_, place)| place.is_some()) {
                let first = places.iter().position(|other| other == place).unwrap();
                assert_eq!(*x, scalar.values[first]);
            }
        }
    }
}

#[test]
fn sources_count_in_the_numbers_of_the_file() {
    let (mut positions, faces) = shapes::grid(4, 3).into_parts();
    positions.insert(0, DVec3::splat(7.0));
    let faces = faces.into_iter().map(|face| face.map(|v| v + 1)).collect();
    let mesh = triangulated(TriangleMesh::new(positions, faces).unwrap());
    let last = Vertex::new(mesh.mesh().vertex_count() - 1);
    assert_eq!(distances(&mesh, &[Place::Vertex(last)]).values[last.index()], 0.0);
    let error = |v| {
        let place = [Place::Vertex(Vertex(v))];
        mesh.distances(&place, &DistanceOptions::default(), &NoProgress).unwrap_err().to_string()
    };
    assert!(error(0).starts_with("vertex 0 is on no face"), "{}", error(0));
    assert!(error(last.0 + 1).starts_with("there is no vertex"));
}

#[test]
fn places_off_the_surface_are_noted() {
    let mesh = triangulated(shapes::icosphere(3));
    let notes = |x: f64| distances(&mesh, &[Place::Near(DVec3::X * x)]).notes;
    assert!(notes(1.0).is_empty() && notes(1.001).is_empty());
    assert!(matches!(notes(3.5)[..], [Note::PlaceOff { distance, .. }] if (distance - 2.5).abs() < 1e-2));
}

#[test]
fn paths_pass_a_vertex_where_fans_meet() {
    let positions =
        [[0.0, 0.0], [-1.0, 0.0], [-1.0, 1.0], [1.0, 0.0], [1.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.0));
    let bow_tie = TriangleMesh::new(positions.to_vec(), vec![[0, 2, 1], [0, 3, 4]]).unwrap();
    let mesh = triangulated(bow_tie);
    let options = DistanceOptions { paths_to: vec![Place::Vertex(Vertex(4))], ..DistanceOptions::default() };
    let found = mesh.distances(&[Place::Vertex(Vertex(1))], &options, &NoProgress).unwrap();
    let truth = [1.0, 0.0, 1.0, 2.0, 1.0 + 2.0_f64.sqrt()];
    assert!(found.values.iter().zip(truth).all(|(d, truth)| (d - truth).abs() < 1e-12), "{:?}", found.values);
    assert!((found.paths[0].as_ref().unwrap().length - truth[4]).abs() < 1e-12);
}

/// Distances on a Möbius strip: symmetric, no shorter than straight lines, nowhere steeper than 1.
#[test]
fn surfaces_of_one_side_are_measured_on_their_cover() {
    let strip = shapes::moebius_strip(48, 6);
    let mesh = triangulated(strip.clone());
    assert!(matches!(mesh.manifold(), Err(Irreparable::OneSided)));
    let from = |v| distances(&mesh, &[Place::Vertex(Vertex(v))]).values;
    let all: Vec<Vec<f64>> = [0, 3, 100, 200].map(from).into();
    for (i, v) in [0, 3, 100, 200].into_iter().enumerate() {
        assert_eq!(all[i][v], 0.0);
        for (j, w) in [0, 3, 100, 200].into_iter().enumerate() {
            assert!((all[i][w] - all[j][v]).abs() < 1e-12);
        }
        let straight = |w: usize| strip.positions()[v].distance(strip.positions()[w]);
        assert!((0..strip.vertex_count()).all(|w| all[i][w] >= straight(w) - 1e-12 && all[i][w] < 4.0));
    }
    // Edge by edge, a vertex is no farther than its neighbour and the edge.
    for face in strip.faces() {
        let [a, b, _] = face.map(|v| v as usize);
        let edge = strip.positions()[a].distance(strip.positions()[b]);
        assert!((all[0][a] - all[0][b]).abs() <= edge + 1e-12);
    }
    let mesh = triangulated(shapes::moebius_strip(160, 16));
    let heat = DistanceOptions { method: DistanceMethod::Heat, ..DistanceOptions::default() };
    let heat = mesh.distances(&[Place::Vertex(Vertex(0))], &heat, &NoProgress).unwrap().values;
    let exact = distances(&mesh, &[Place::Vertex(Vertex(0))]).values;
    let off: f64 = heat.iter().zip(&exact).map(|(h, d)| (h - d).abs()).sum();
    assert!(off < 0.04 * exact.iter().sum::<f64>(), "{off}");
}

#[test]
fn more_than_a_twentieth_is_not_left_out_silently() {
    let (mut positions, faces) = shapes::icosphere(1).into_parts();
    positions[0] = DVec3::NAN;
    let mesh = TriangleMesh::new(positions, faces).unwrap();
    let error = Triangulated::from_mesh(mesh.clone(), &RepairOptions::default()).unwrap_err();
    assert!((error.share - 5.0 / 80.0).abs() < 1e-12);
    let found = Triangulated::from_mesh(mesh, &RepairOptions::LARGEST).unwrap();
    assert_eq!((found.area_left_out, found.unused_vertices()), (error.share, vec![Vertex(0)]));
}

/// What is told at the vertices of a file does not depend on how the file has them.
#[test]
fn signed_distances_and_centres_are_those_of_the_file() {
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let plain = shapes::torus(40, 20, 1.0, 0.4);
    let (file, places) = as_in_a_file(&plain, &mut random);
    let around =
        |f: &dyn Fn(usize) -> Vertex| vec![(0..=40).map(|k| Place::Vertex(f(k % 40 * 20))).collect()];
    let in_file = |v: usize| Vertex::new(places.iter().position(|place| *place == Some(v)).unwrap());
    let surface = triangulated(plain.clone());
    let other = triangulated(file);
    let signed = |surface: &Triangulated, curves| {
        let options = SignedDistanceOptions { curves, ..SignedDistanceOptions::default() };
        surface.fields().unwrap().signed_distance(&options, &NoProgress).unwrap()
    };
    let found = signed(&surface, around(&Vertex::new));
    let again = signed(&other, around(&in_file));
    assert!((found.curve_length - again.curve_length).abs() < 1e-9);
    // The repaired mesh may have turned all faces, and sides with them.
    let turned = |x: f64, y: f64| (x - y).abs().min((x + y).abs());
    for (v, place) in places.iter().enumerate() {
        match place {
            Some(place) => assert!(turned(again.values[v], found.values[*place]) < 1e-6, "{v}"),
            None => assert!(again.values[v].is_infinite()),
        }
    }
    let centre = |surface: &Triangulated, f: &dyn Fn(usize) -> Vertex| {
        let places = [3, 45, 110].map(|v| (Place::Vertex(f(v)), 1.0));
        surface.fields().unwrap().centre(&places, CentreKind::Mean, &NoProgress).unwrap()
    };
    let (found, again) = (centre(&surface, &Vertex::new), centre(&other, &in_file));
    assert!(found.position.distance(again.position) < 1e-3, "{found:?} {again:?}");
    assert_eq!(again.position, again.point.position(other.mesh()));
}

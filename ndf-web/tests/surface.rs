//! What a surface gives, natively: its laws, and that it is what the library gives.

#![allow(clippy::unwrap_used, reason = "tests fail by panicking")]

use ndf::{EdgeLength, Model, ModelExt};
use ndf_mesh::io::{VertexScalars, parse_mesh};
use ndf_web::{Surface, SurfaceError};

const LEVELS: &[u8] = include_bytes!("../../ndf-model/tests/golden/levels_version_3.ndf");
const SCALARS: &[u8] = include_bytes!("../../ndf-model/tests/golden/scalars_version_3.ndf");

#[test]
fn a_model_is_extracted_as_the_library_does() {
    let mut surface = Surface::open(LEVELS, "a.ndf").unwrap();
    let model = Model::from_bytes(LEVELS).unwrap();
    let length = EdgeLength::OfBase(0.4);
    surface.extract(length).unwrap();
    let expected = model.extract(length).unwrap();
    assert_eq!(*surface.mesh(), *expected.mesh);
    let report = surface.report();
    assert_eq!(report["faces"], expected.mesh.face_count());
    assert_eq!(report["target_edge_length"], length.world(&model));
    let described = surface.describe();
    assert_eq!((described.kind, described.bytes), ("model", LEVELS.len()));
    assert_eq!(described.default_edge_length, Some(EdgeLength::default().world(&model)));
}

#[test]
fn distances_are_a_metric_and_paths_are_as_long() {
    let mut surface = Surface::open(LEVELS, "a.ndf").unwrap();
    let vertices = surface.mesh().vertex_count();
    let [a, b, c] = [0, vertices / 3, vertices - 1];
    let [from_a, from_b] = [a, b].map(|v| surface.distances(v as u32).unwrap());
    let near = |x: f32, y: f32| (x - y).abs() <= 1e-5 * x.max(y);
    assert!(from_a[a] == 0.0 && near(from_a[b], from_b[a]));
    assert!(from_a[c] <= from_a[b] + from_b[c] + 1e-5 * from_a[c]);
    let path = surface.path(a as u32, b as u32).unwrap();
    assert!(near(path.length as f32, from_a[b]));
    let ends = [&path.points[..3], &path.points[path.points.len() - 3..]];
    for (end, vertex) in ends.into_iter().zip([a, b]) {
        let place = surface.mesh().positions()[vertex].to_array();
        assert!(end.iter().zip(place).all(|(x, y)| (x - y).abs() < 1e-9));
    }
}

#[test]
fn the_first_mode_is_constant_and_values_rise() {
    let mut surface = Surface::open(LEVELS, "a.ndf").unwrap();
    let (values, functions) = surface.modes(6).unwrap();
    let vertices = surface.mesh().vertex_count();
    assert_eq!((values.len(), functions.len()), (6, 6 * vertices));
    assert!(values.is_sorted() && values[0].abs() < 1e-6 * values[1]);
    let constant = &functions[..vertices];
    assert!(constant.iter().all(|x| (x - constant[0]).abs() < 1e-3 * constant[0].abs()));
}

#[test]
fn scalars_follow_the_mesh_and_go_into_files() {
    let mut surface = Surface::open(SCALARS, "a.ndf").unwrap();
    let name = surface.describe().scalars[0].name.clone();
    surface.extract(EdgeLength::OfBase(0.7)).unwrap();
    let values = surface.scalar(&name).unwrap().to_vec();
    assert_eq!(values.len(), surface.mesh().vertex_count());
    assert!(matches!(surface.scalar("none"), Err(SurfaceError::NoScalar { .. })));
    let ones = VertexScalars { name: "one".into(), values: vec![1.0; values.len()] };
    let file = parse_mesh(&surface.to_ply(vec![ones.clone()]).unwrap(), "a.ply".as_ref()).unwrap();
    assert!(file.scalars.contains(&ones) && file.scalars.contains(&VertexScalars { name, values }));
    let file = parse_mesh(&surface.to_glb(vec![ones.clone()]).unwrap(), "a.glb".as_ref()).unwrap();
    assert!(file.scalars.contains(&ones) && file.mesh.face_count() == surface.mesh().face_count());
}

#[test]
fn the_shortest_edges_are_foretold() {
    let mut surface = Surface::open_with(LEVELS, "a.ndf", EdgeLength::OfBase(0.5)).unwrap();
    let shortest = surface.describe().min_edge_length.unwrap();
    let error = surface.extract(EdgeLength::World(1e-3 * shortest)).unwrap_err();
    assert!(matches!(error, SurfaceError::TooFine { shortest: told, .. } if told == shortest), "{error}");
    let unit = surface.describe().scale.unwrap();
    let error = surface.extract(EdgeLength::Relative(1e-3 * shortest / unit)).unwrap_err();
    assert!(
        matches!(error, SurfaceError::TooFine { shortest: told, .. } if told == shortest / unit),
        "{error}"
    );
}

#[test]
fn modes_that_fill_the_memory_are_refused() {
    let mut surface = Surface::open_with(LEVELS, "a.ndf", EdgeLength::OfBase(0.03)).unwrap();
    let vertices = surface.mesh().vertex_count();
    assert!(vertices > 1 << 13, "{vertices}");
    assert!(matches!(surface.modes(vertices), Err(SurfaceError::TooManyModes { .. })));
    assert!(matches!(surface.modes(vertices + 1), Err(SurfaceError::Spectrum(_))));
}

#[test]
fn what_is_wrong_is_said_and_changes_nothing() {
    let mut surface = Surface::open(LEVELS, "a.ndf").unwrap();
    let before = surface.mesh().clone();
    let error = surface.extract(EdgeLength::World(-1.0)).unwrap_err();
    assert!(error.to_string().ends_with("not -1"), "{error}");
    assert_eq!(*surface.mesh(), before);
    assert!(matches!(surface.distances(u32::MAX), Err(SurfaceError::Distances(_))));
    assert!(matches!(Surface::open(&LEVELS[..100], "a.ndf"), Err(SurfaceError::Model { .. })));
    assert!(matches!(Surface::open(b"v 0 0 0\n", "a.obj"), Err(SurfaceError::NoFaces { .. })));
    let triangle = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let mut mesh = Surface::open(triangle, "a.obj").unwrap();
    assert!(matches!(mesh.extract(EdgeLength::default()), Err(SurfaceError::NoModel { .. })));
}

//! Laws of scalar fields on levels of nodes.

use super::*;
use crate::{DisplacementField, FieldShape, Model, Similarity};
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::{TriangleMesh, Vertex, shapes};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

fn field(mesh: TriangleMesh) -> DisplacementField {
    DisplacementField::untrained(ManifoldMesh::try_from(mesh).unwrap(), FieldShape::default(), 1).unwrap()
}

fn channels(count: usize) -> Vec<Channel> {
    let named = |k| Channel { name: format!("u{k}"), range: [-1e6, 1e6], mean: 0.0, deviation: 1.0 };
    (0..count).map(named).collect()
}

/// The fields whose integers are these, by level, rank and channel.
fn fields(
    field: &DisplacementField,
    splits: u32,
    count: usize,
    mut integer: impl FnMut(&NodeMesh, usize, usize, usize) -> i32,
) -> SurfaceScalars {
    let mesh = NodeMesh::on(field, splits).unwrap();
    let extensions = mesh.extensions(field).unwrap();
    let mut integers = Vec::new();
    for level in 0..mesh.nesting.levels() {
        for rank in mesh.nesting.level(level) {
            integers.extend((0..count).map(|k| integer(&mesh, level, rank, k)));
        }
    }
    let numbers = ScalarNumbers { step: 0.125, rises: vec![0; mesh.nesting.levels()], integers };
    SurfaceScalars::levelled(channels(count), Arc::new(mesh), &extensions, numbers).unwrap()
}

/// Small random integers, fewer on finer levels.
fn random(on: &DisplacementField, splits: u32, count: usize) -> SurfaceScalars {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    fields(on, splits, count, |_, level, _, _| {
        if rng.random_bool(1.0 / (1 << level) as f64) { rng.random_range(-40..40) } else { 0 }
    })
}

/// A model of a torus with fields of two channels on it.
pub(crate) fn model() -> Model {
    let field = field(shapes::torus(9, 6, 1.0, 0.4));
    let scalars = vec![random(&field, 1, 2)];
    let similarity = Similarity::from_bounds(&field.base().bounds());
    Model { field, similarity, metric: None, scalars, provenance: "{}".to_owned() }
}

fn samples(field: &DisplacementField) -> Vec<FacePoint> {
    AreaSampler::new(field.base()).unwrap().sample(500, 0, 0)
}

#[test]
fn constants_are_constant_and_linear_functions_of_a_plane_are_linear_away_from_its_boundary() {
    let torus = field(shapes::torus(16, 9, 1.0, 0.4));
    let constant = fields(&torus, 1, 1, |_, level, _, _| if level == 0 { 24 } else { 0 });
    for value in constant.evaluate(torus.base(), &samples(&torus)) {
        assert!((value - 3.0).abs() < 1e-5, "{value}");
    }
    let plane = field(shapes::grid(12, 12));
    let width = plane.base().bounds().max.x - plane.base().bounds().min.x;
    let x = |point: &FacePoint| (point.position(plane.base()).x / width + 2.0) * 12.0;
    let linear = fields(
        &plane,
        0,
        1,
        |mesh, level, rank, _| {
            if level == 0 { x(&mesh.points()[rank]).round() as i32 } else { 0 }
        },
    );
    let points = samples(&plane);
    for (value, point) in linear.evaluate(plane.base(), &points).iter().zip(&points) {
        // Thin plates are level at the boundary, which the nearest nodes feel.
        let p = point.position(plane.base()) / width;
        let is_inside = p.x.min(p.y).min(1.0 - p.x).min(1.0 - p.y) > 0.3;
        let error = (f64::from(*value) - x(point) / 8.0).abs();
        assert!(!is_inside || error < 0.03, "{value} {}", x(point) / 8.0);
    }
}

#[test]
fn values_are_continuous_across_base_edges() {
    for mesh in [shapes::torus(9, 6, 1.0, 0.4), shapes::grid(5, 4)] {
        let field = field(mesh);
        let scalars = random(&field, 2, 3);
        let topology = field.base().topology();
        for (h, twin) in topology.halfedges().filter_map(|h| Some((h, topology.twin(h)?))) {
            for t in [0.0, 0.1, 0.5, 0.77] {
                let at = |h: ndf_mesh::Halfedge, t: f64| {
                    let mut barycentric = [0.0; 3];
                    let corner = h.index() % 3;
                    (barycentric[corner], barycentric[(corner + 1) % 3]) = (1.0 - t, t);
                    scalars.evaluate(field.base(), &[FacePoint { face: h.face(), barycentric }])
                };
                for (a, b) in at(h, t).iter().zip(at(twin, 1.0 - t)) {
                    assert!((a - b).abs() < 1e-4, "{a} {b}");
                }
            }
        }
    }
}

/// The energy of what is extended is the least: moving a finer node raises it, and given nodes keep their values.
#[test]
fn integers_move_the_nodes_of_their_level_and_finer_ones_alone() {
    let field = field(shapes::torus(9, 6, 1.0, 0.4));
    let zero = fields(&field, 1, 1, |_, _, _, _| 0);
    assert!(zero.evaluate(field.base(), &samples(&field)).iter().all(|x| *x == 0.0));
    let mesh = zero.levels().unwrap().mesh().clone();
    for level in 0..mesh.nesting.levels() {
        let chosen = mesh.nesting.level(level).start;
        let one = fields(&field, 1, 1, |_, _, rank, _| 8 * i32::from(rank == chosen));
        let values = one.evaluate(field.base(), mesh.points());
        for rank in 0..mesh.nesting.level(level).end {
            let expected = if rank == chosen { 1.0 } else { 0.0 };
            assert!((values[rank] - expected).abs() < 1e-6, "{rank} {}", values[rank]);
        }
    }
}

#[test]
fn files_and_tensors_keep_every_integer() {
    for model in [model(), {
        let base = ManifoldMesh::try_from(shapes::torus(9, 6, 1.0, 0.4)).unwrap();
        let mut model = crate::levels::tests::model(&base, crate::levels::tests::levels(&base, 1, 3));
        model.scalars = vec![random(&model.field, 1, 3)];
        model
    }] {
        let bytes = model.to_bytes();
        assert_eq!(bytes[8], 3);
        let again = Model::from_bytes(&bytes).unwrap();
        assert_eq!(again.to_bytes(), bytes);
        let numbers = |model: &Model| model.scalars[0].levels().unwrap().numbers().clone();
        assert_eq!(numbers(&again), numbers(&model));
        assert_eq!(again.section_sizes().scalars, model.scalars[0].stored_bytes());
        let tensors = again.to_safetensors().unwrap();
        assert_eq!(Model::from_safetensors(&tensors).unwrap().to_bytes(), bytes);
    }
}

/// The file holds the base mesh in another order; the fields are the same functions of the surface.
#[test]
fn the_order_of_the_base_mesh_does_not_matter() {
    let model = model();
    let again = Model::from_bytes(&model.to_bytes()).unwrap();
    assert_ne!(again.field.base().faces(), model.field.base().faces());
    let corners = |model: &Model| {
        let base = model.field.base();
        let mut found = Vec::new();
        for v in 0..base.vertex_count() {
            let h = base.topology().outgoing(Vertex::new(v)).next().unwrap();
            let at = FacePoint::at_corner(h);
            let value = model.scalars[0].evaluate(base, &[at]);
            found.push((base.positions()[v].to_array(), value));
        }
        found.sort_by(|a, b| a.0.partial_cmp(&b.0).unwrap());
        found
    };
    for (a, b) in corners(&model).iter().zip(corners(&again)) {
        assert_eq!(a.0, b.0);
        assert!(a.1.iter().zip(&b.1).all(|(x, y)| (x - y).abs() < 1e-4), "{a:?} {b:?}");
    }
}

#[test]
fn numbers_that_do_not_fit_are_named() {
    let field = field(shapes::torus(9, 6, 1.0, 0.4));
    let mesh = Arc::new(NodeMesh::on(&field, 0).unwrap());
    let extensions = mesh.extensions(&field).unwrap();
    let levels = mesh.nesting.levels();
    let good = ScalarNumbers { step: 1.0, rises: vec![0; levels], integers: vec![0; mesh.nesting.len()] };
    let made = |change: &dyn Fn(&mut ScalarNumbers)| {
        let mut numbers = good.clone();
        change(&mut numbers);
        SurfaceScalars::levelled(channels(1), Arc::clone(&mesh), &extensions, numbers).map(|_| ())
    };
    assert_eq!(made(&|_| ()), Ok(()));
    assert_eq!(made(&|n| n.step = 0.0), Err(ScalarsError::Step));
    assert_eq!(made(&|n| n.step = f32::NAN), Err(ScalarsError::Step));
    assert_eq!(made(&|n| n.rises.push(0)), Err(ScalarsError::Integers));
    assert_eq!(made(&|n| n.integers.truncate(3)), Err(ScalarsError::Integers));
    let huge = |n: &mut ScalarNumbers| (n.step, n.integers[0]) = (f32::MAX, 1 << 30);
    assert_eq!(made(&huge), Err(ScalarsError::NotFinite));
    for splits in [MAX_SPLITS + 1, 32, u32::MAX] {
        assert_eq!(NodeMesh::on(&field, splits).map(|_| ()), Err(ScalarsError::Nodes));
    }
}

/// Vertices that all others share make no factor of absurd size, only an error.
#[test]
fn absurd_meshes_are_refused() {
    let count = 6000_u32;
    let ring = |i: u32| f64::from(i) * std::f64::consts::TAU / f64::from(count);
    let mut positions: Vec<_> =
        (0..count).map(|i| ndf_core::DVec3::new(ring(i).cos(), ring(i).sin(), 0.0)).collect();
    positions.extend([ndf_core::DVec3::Z, -ndf_core::DVec3::Z]);
    let faces = (0..count).flat_map(|i| {
        let j = (i + 1) % count;
        [[i, j, count], [j, i, count + 1]]
    });
    let spindle = field(TriangleMesh::new(positions, faces.collect()).unwrap());
    let extensions = NodeMesh::on(&spindle, 0).unwrap().extensions(&spindle);
    assert_eq!(extensions.map(|_| ()), Err(ScalarsError::Irregular));
}

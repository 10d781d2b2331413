use super::learning::gradient;
use super::*;
use ndf_core::NoProgress;
use ndf_mesh::metrics::{MeasureOptions, measure};
use ndf_mesh::shapes;

fn bumpy(levels: u32) -> ManifoldMesh {
    let bump = |p: DVec3| {
        let waves = (5.0 * p.x + 1.0).sin() * (4.0 * p.y).sin() + 0.5 * (9.0 * p.z + p.x).sin();
        DVec3::new(3.0, -1.0, 0.5) + 2.0 * p * (1.0 + 0.1 * waves)
    };
    ManifoldMesh::try_from(shapes::icosphere(levels).map_positions(bump)).unwrap()
}

fn small() -> NgfOptions {
    NgfOptions { features: 8, tessellations: vec![4, 8], iterations: 60, ..NgfOptions::with_quads(60) }
}

#[test]
fn the_surface_comes_closer_than_its_coarse_mesh() {
    let mesh = bumpy(4);
    let options = NgfOptions { iterations: 200, ..small() };
    let LearnedNgf { field, triangles, loss, .. } =
        NeuralGeometryField::learn(&mesh, &options, &NoProgress).unwrap();
    assert!(triangles <= 4 && (60..=64).contains(&field.quad_count()) && loss.is_finite());
    let fine = field.tessellated(8);
    let coarse = decimate(&mesh, &DecimationOptions::to_faces(120), &NoProgress).mesh;
    let options = MeasureOptions { samples: 10_000, seed: 0 };
    let [ours, theirs] = [&fine, &coarse].map(|m| measure(&mesh, m, &options).unwrap());
    assert!(ours.reference_to_mesh.mean < 0.5 * theirs.reference_to_mesh.mean, "{ours:?} {theirs:?}");
    assert!(ours.normal_angle_mean < theirs.normal_angle_mean, "{ours:?} {theirs:?}");
    assert!(ManifoldMesh::try_from(fine).unwrap().topology().boundary_edge_count() == 0);
}

#[test]
fn gradients_of_all_parts_agree_with_differences() {
    let mesh = bumpy(2);
    let options = NgfOptions { iterations: 1, ..small() };
    let mut field = NeuralGeometryField::learn(&mesh, &options, &NoProgress).unwrap().field;
    // Off the start, where the last layer is zero.
    for (i, p) in field.network.parameters_mut().iter_mut().enumerate() {
        *p += 0.02 * (i as f32 * 0.7).sin();
    }
    let tessellation = Tessellation::new(field.points.len(), &field.quads, 3);
    let by_place: Vec<Vec3> = (0..tessellation.samples.len())
        .map(|i| Vec3::new((i as f32).sin(), (2.0 * i as f32).cos(), (0.3 * i as f32).sin()))
        .collect();
    let loss = |field: &NeuralGeometryField| -> f64 {
        let places = learning::places(field, &Packed::new(&field.network), &tessellation);
        places.iter().zip(&by_place).map(|(p, g)| f64::from(p.dot(*g))).sum()
    };
    let found = gradient(&field, &Packed::new(&field.network), &tessellation, &by_place);
    // Steps are small, because the activations have kinks and the encoding is steep.
    let check = |name: &str, change: &dyn Fn(&mut NeuralGeometryField, f32), exact: f32, h: f32| {
        let at = |h: f32| {
            let mut moved = field.clone();
            change(&mut moved, h);
            loss(&moved)
        };
        let slope = (at(h) - at(-h)) / (2.0 * f64::from(h));
        let exact = f64::from(exact);
        assert!((slope - exact).abs() < 0.05 * exact.abs().max(0.2), "{name}: {slope} {exact}");
    };
    for i in [0, 7, 20] {
        check("point", &|f, h| f.points[i].y += h, found.points[i].y, 1e-5);
        check("feature", &|f, h| f.features[5 * i + 3] += h, found.features[5 * i + 3], 1e-4);
    }
    for i in (0..found.network.len()).step_by(found.network.len() / 11) {
        check("weight", &|f, h| f.network.parameters_mut()[i] += h, found.network[i], 1e-4);
    }
}

#[test]
fn bytes_are_those_that_are_counted_and_lead_back() {
    let mesh = bumpy(2);
    let options = NgfOptions { iterations: 1, ..small() };
    let field = NeuralGeometryField::learn(&mesh, &options, &NoProgress).unwrap().field;
    let bytes = field.to_bytes();
    let layers = [(8 + 48, 64), (64, 64), (64, 64), (64, 3)];
    let network: usize = layers.iter().map(|(i, o)| (i + 1) * o).sum();
    let words = 7 + field.points.len() * (3 + 8) + 4 * field.quads.len() + network;
    assert_eq!(bytes.len(), 4 * words);
    assert_eq!(NeuralGeometryField::from_bytes(&bytes).unwrap(), field);

    for length in (0..bytes.len()).step_by(97) {
        assert!(NeuralGeometryField::from_bytes(&bytes[..length]).is_err());
    }
    for place in (0..bytes.len()).step_by(13) {
        let mut damaged = bytes.clone();
        damaged[place] ^= 1 << (place % 8);
        if let Ok(other) = NeuralGeometryField::from_bytes(&damaged) {
            other.tessellated(2);
        }
    }
    let mut not_a_number = bytes;
    not_a_number[HEADER_OF_TEST..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(NeuralGeometryField::from_bytes(&not_a_number), Err(NgfFileError::NotFinite));
}

/// Where the first place begins.
const HEADER_OF_TEST: usize = 28;

#[test]
fn threads_change_nothing_and_work_can_be_cancelled() {
    struct Stop;
    impl Progress for Stop {
        fn report(&self, _: &str, _: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let mesh = bumpy(2);
    let options = NgfOptions { iterations: 3, ..small() };
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| NeuralGeometryField::learn(&mesh, &options, &NoProgress).unwrap().field)
    };
    assert_eq!(on(1), on(3));
    assert!(NeuralGeometryField::learn(&mesh, &options, &Stop).is_err());
}

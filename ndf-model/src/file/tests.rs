//! Laws of the model file.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::bytes::Writer;
use super::{ModelError, Precision, StoredBase, container, scalars};
use crate::scalars::{Channel, ScalarShape, SurfaceScalars};
use crate::{DisplacementField, FieldShape, Metric, Model, NetworkShape, Similarity};
use ndf_core::DVec3;
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::shapes;
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_network::Activation;

/// A model with random features over a mesh, in the mesh's own order.
fn model_on(base: TriangleMesh) -> Model {
    let base = ManifoldMesh::try_from(base).unwrap();
    let network = NetworkShape { features: 2, octaves: 1, hidden: vec![3], activation: Activation::Silu };
    let shape = FieldShape::from(network);
    let field = DisplacementField::untrained(base, shape, 5).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let mut random = |n: usize| (0..n).map(|_| rng.random_range(-2.0..2.0)).collect::<Vec<f32>>();
    let network = field.network().unwrap();
    let (features, parameters) = (network.features().len(), network.mlp().parameters().len());
    let field = field.with_parameters(random(features), random(parameters)).unwrap();
    let vertices = field.base().vertex_count();
    let mut shape = ScalarShape::default();
    shape.network = NetworkShape { features: 1, hidden: vec![2], ..shape.network };
    let channel = Channel { name: "u".to_owned(), range: [-1.0, 1.0], mean: 0.0, deviation: 1.0 };
    let parameters = vec![0.25; shape.mlp(1).parameter_count()];
    let fields = SurfaceScalars::new(vec![channel], shape, vertices, random(vertices), parameters).unwrap();
    let similarity = Similarity::new(0.1 + 0.2, DVec3::new(1.0, 2.0 / 3.0, 3e-7 / 7.0)).unwrap();
    let scalars = vec![fields.clone(), fields];
    Model { field, similarity, metric: None, scalars, provenance: "{\"seed\": 5}".to_owned() }
}

pub(super) fn model() -> Model {
    model_on(shapes::icosphere(0))
}

/// Single precision, and rounded: plain and coded arrays.
fn both() -> [Model; 2] {
    let model = model();
    let rounded = model.rounded(Precision::from_bits(5));
    [model, rounded]
}

/// The same points of the surface, wherever in the list of vertices they are.
fn images(model: &Model) -> Vec<[u64; 3]> {
    let base = model.field.base();
    let mut samples = AreaSampler::new(base).unwrap().sample(1, 0, 0);
    let mut images = Vec::new();
    for face in base.face_indices() {
        // Corners and the centre, in the order of their places.
        for barycentric in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            samples[0].face = face;
            samples[0].barycentric = barycentric.map(|b: f64| b as _);
            images.extend(model.field.map(&samples));
        }
    }
    let mut images: Vec<[u64; 3]> = images.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
    images.sort_unstable();
    images
}

#[test]
fn round_trip_keeps_every_bit_and_the_order_settles() {
    for model in both() {
        let bytes = model.to_bytes();
        let again = Model::from_bytes(&bytes).unwrap();
        assert_eq!(again.to_bytes(), bytes);
        assert_eq!(again.similarity, model.similarity);
        assert_eq!(images(&again), images(&model));
        assert_eq!(again.provenance, model.provenance);
        assert_eq!(again.scalars.len(), 2);
        let write = |fields: &SurfaceScalars| scalars::write(fields.channels(), fields.network().unwrap());
        let payload = write(&again.scalars[0]);
        assert_eq!(payload, write(&again.scalars[1]));
        let sizes = model.section_sizes();
        assert_eq!(sizes.total, bytes.len());
        assert_eq!(sizes.scalars, 2 * payload.len());
    }
}

#[test]
fn a_base_mesh_made_ready_keeps_its_order_and_its_bits() {
    for shape in [shapes::torus(20, 12, 1.0, 0.4), shapes::grid(9, 7), shapes::icosphere(2)] {
        let raw = ManifoldMesh::try_from(shape).unwrap();
        for precision in [None, Some(Precision::default())] {
            let base = StoredBase::new(&raw, precision, 0.0).mesh;
            let model = model_on(TriangleMesh::clone(&base));
            let again = Model::from_bytes(&model.to_bytes()).unwrap();
            assert_eq!(again.field.base().positions(), base.positions());
            assert_eq!(again.field.base().faces(), base.faces());
            assert_eq!(again.field.network().unwrap().features(), model.field.network().unwrap().features());
            let size = again.section_sizes().base;
            let positions = 12 * base.vertex_count();
            assert!(precision.is_none() || size < positions / 2, "{size} of {positions}");
        }
    }
}

/// Rounding moves a position by less than the mesh is away from its surface, and saves bytes the farther that is.
#[test]
fn positions_are_the_coarser_the_farther_the_surface() {
    let raw = ManifoldMesh::try_from(shapes::torus(40, 24, 1.0, 0.4)).unwrap();
    let exact = StoredBase::new(&raw, None, 0.0);
    let mut last = usize::MAX;
    for distance in [0.0, 5e-4, 1e-3, 2e-3] {
        let StoredBase { mesh, similarity, .. } = StoredBase::new(&raw, Some(Precision::default()), distance);
        assert_eq!((mesh.faces(), similarity), (exact.mesh.faces(), exact.similarity));
        let moves =
            mesh.positions().iter().zip(exact.mesh.positions()).map(|(p, q)| (*p - *q).abs().max_element());
        let most = (similarity.scale() * distance).max(5e-4);
        assert!(moves.fold(0.0, f64::max) <= 1.001 * most, "{distance}");
        let size = model_on(TriangleMesh::clone(&mesh)).section_sizes().base;
        assert!(size < last, "{distance}: {size} bytes, {last} before");
        last = size;
    }
}

/// A grid moves a number by half its spacing at most.
#[test]
fn rounding_is_as_fine_as_it_says_and_rounds_once() {
    let model = model_on(shapes::torus(60, 40, 1.0, 0.4));
    let mut last = f32::INFINITY;
    for bits in [4, 8, 12] {
        let rounded = model.rounded(Precision::from_bits(bits));
        let pairs =
            model.field.network().unwrap().features().iter().zip(rounded.field.network().unwrap().features());
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(worst <= 2.0 / (1_u32 << (bits - 1)) as f32 && worst < last / 4.0, "{bits} bits: {worst}");
        last = worst;
        let (size, count) =
            (rounded.section_sizes().features, model.field.network().unwrap().features().len());
        assert!(8 * size < (bits as usize + 2) * count, "{bits} bits: {size} bytes for {count}");
        let twice = rounded.rounded(Precision::from_bits(bits));
        assert_eq!(twice.field.network().unwrap().features(), rounded.field.network().unwrap().features());
        let coded = Model::from_bytes(&rounded.to_bytes()).unwrap();
        assert_eq!(images(&coded), images(&rounded));
    }
}

#[test]
fn every_truncation_and_every_flipped_byte_is_noticed() {
    for model in both() {
        let bytes = model.to_bytes();
        for length in 0..bytes.len() {
            assert!(Model::from_bytes(&bytes[..length]).is_err(), "{length} bytes");
        }
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(Model::from_bytes(&damaged).is_err(), "byte {at}");
        }
    }
}

/// Damages one of these payloads and repairs the checksums, so that the section readers themselves are tried; some damage
/// leaves a model.
fn hostile(
    good: &Model,
    version: u32,
    payloads: &[usize],
    rng: &mut ChaCha8Rng,
    mut read: impl FnMut(Model),
) {
    let sections = good.sections();
    for round in 0..3000 {
        let mut sections = sections.clone();
        let payload = &mut sections[payloads[round % payloads.len()]].1;
        for _ in 0..rng.random_range(1..4) {
            // The headers of the sections are the interesting part.
            let reach = if rng.random_bool(0.5) { 24 } else { payload.len() };
            let at = rng.random_range(0..payload.len().min(reach));
            payload[at] = rng.random();
        }
        if rng.random_bool(0.2) {
            payload.truncate(rng.random_range(0..payload.len()));
        }
        if let Ok(model) = Model::from_bytes(&container::join(version, &sections)) {
            read(model);
        }
    }
}

#[test]
fn hostile_payloads_give_errors_or_models_but_no_panic() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    for good in both() {
        hostile(&good, 2, &[0, 1, 2, 3, 5], &mut rng, |_| {});
    }
}

#[test]
fn hostile_levels_give_errors_or_models_but_no_panic() {
    let base = ManifoldMesh::try_from(shapes::torus(9, 6, 1.0, 0.4)).unwrap();
    let good = crate::levels::tests::model(&base, crate::levels::tests::levels(&base, 2, 3));
    let bytes = good.to_bytes();
    for length in 0..bytes.len() {
        assert!(Model::from_bytes(&bytes[..length]).is_err());
    }
    let mut read = 0;
    hostile(&good, 3, &[1, 2], &mut ChaCha8Rng::seed_from_u64(2), |model| {
        assert_eq!(Model::from_bytes(&model.to_bytes()).unwrap().to_bytes(), model.to_bytes());
        read += 1;
    });
    assert!(read > 50, "{read}");
    // Levels need version 3.
    assert!(Model::from_bytes(&container::join(2, &good.sections())).is_err());
}

#[test]
fn hostile_scalars_on_levels_give_errors_or_models_but_no_panic() {
    let good = crate::scalars::level_tests::model();
    let bytes = good.to_bytes();
    for length in 0..bytes.len() {
        assert!(Model::from_bytes(&bytes[..length]).is_err());
    }
    let last = good.sections().len() - 1;
    let mut read = 0;
    hostile(&good, 3, &[last], &mut ChaCha8Rng::seed_from_u64(3), |model| {
        assert_eq!(Model::from_bytes(&model.to_bytes()).unwrap().to_bytes(), model.to_bytes());
        read += 1;
    });
    assert!(read > 50, "{read}");
    // They need version 3; before it their section is one that is not known.
    assert!(Model::from_bytes(&container::join(2, &good.sections())).unwrap().scalars.is_empty());
}

#[test]
fn unknown_sections_are_skipped_and_later_versions_named() {
    let model = model();
    let mut later = model.to_bytes();
    later[8] = 9;
    assert!(matches!(Model::from_bytes(&later), Err(ModelError::Version(9))));
    assert!(matches!(Model::from_bytes(b"solid cube"), Err(ModelError::Magic)));
    let mut sections = model.sections();
    sections.insert(2, ("NEWS", b"something new".to_vec()));
    assert!(Model::from_bytes(&container::join(2, &sections)).is_ok());
    sections.retain(|(tag, _)| *tag != "FEAT");
    assert!(matches!(Model::from_bytes(&container::join(2, &sections)), Err(ModelError::Missing("FEAT"))));
}

#[test]
fn a_damaged_section_is_named() {
    let mut bytes = model().to_bytes();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    let error = Model::from_bytes(&bytes).unwrap_err().to_string();
    assert!(error.contains("checksum of section SCAL"), "{error}");
}

/// A metric makes a file one of version 3, of networks too, and comes back.
#[test]
fn a_metric_comes_back_and_a_damaged_one_is_refused() {
    let base = ManifoldMesh::try_from(shapes::torus(9, 6, 1.0, 0.4)).unwrap();
    let levels = crate::levels::tests::model(&base, crate::levels::tests::levels(&base, 1, 3));
    for mut model in [model(), levels] {
        let without = model.to_bytes();
        model.metric = Some(Metric::new(7.25, 0.875).unwrap());
        let bytes = model.to_bytes();
        assert_eq!((bytes[8], bytes.len() - without.len()), (3, 9 + 16));
        assert_eq!(model.section_sizes().metric, 9);
        let again = Model::from_bytes(&bytes).unwrap();
        assert_eq!(again.metric, model.metric);
        assert_eq!(again.to_bytes(), bytes);
        let tensors = model.to_safetensors().unwrap();
        assert_eq!(Model::from_safetensors(&tensors).unwrap().metric, model.metric);
        let sections = model.sections();
        let place = sections.iter().position(|(tag, _)| *tag == "METR").unwrap();
        let error = |payload: &[u8]| {
            let mut sections = sections.clone();
            sections[place].1 = payload.to_vec();
            Model::from_bytes(&container::join(3, &sections)).unwrap_err().to_string()
        };
        let good = &sections[place].1;
        assert!(error(&good[..8]).contains("ends too early"));
        assert!(error(&[&good[..], &[0]].concat()).contains("after its end"));
        assert!(error(&[&[1], &good[1..]].concat()).contains("coding 1 is not known"));
        let numbers = |area: f32, exponent: f32| {
            error(&[&[0][..], &area.to_le_bytes(), &exponent.to_le_bytes()].concat())
        };
        for area in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert!(numbers(area, 1.0).contains("section METR of the model: the area"));
        }
        for exponent in [-0.5, 3.0, f32::NAN] {
            assert!(numbers(1.0, exponent).contains("section METR of the model: the exponent"));
        }
    }
}

/// A file of version 1: plain arrays, and no byte that says so.
#[test]
fn version_1_is_read() {
    let model = model();
    let base = model.field.base();
    let mut sections = model.sections();
    sections.truncate(5);
    let mut w = Writer::default();
    w.u32(base.vertex_count() as u32);
    w.u32(base.face_count() as u32);
    w.f32s(base.positions().iter().flat_map(|p| p.as_vec3().to_array()));
    base.faces().iter().flatten().for_each(|&v| w.u16(v as u16));
    sections[1].1 = w.0;
    let mut w = Writer::default();
    w.u32(2);
    w.f32s(model.field.network().unwrap().features().iter().copied());
    sections[2].1 = w.0;
    let mut w = Writer::default();
    [2, 1, 1, 1].into_iter().for_each(|byte| w.u8(byte));
    w.u32(3);
    w.f32s(model.field.network().unwrap().mlp().parameters().iter().copied());
    sections[3].1 = w.0;
    let mut bytes = container::join(2, &sections);
    bytes[8] = 1;
    let table = 16 + 16 * sections.len();
    let sum = crc32fast::hash(&bytes[..table]);
    bytes[table..table + 4].copy_from_slice(&sum.to_le_bytes());
    let read = Model::from_bytes(&bytes).unwrap();
    assert_eq!(read.field.base().positions(), base.positions());
    assert_eq!(read.field.base().faces(), base.faces());
    assert_eq!(read.field.network().unwrap().features(), model.field.network().unwrap().features());
    assert_eq!(read.field.network().unwrap().mlp(), model.field.network().unwrap().mlp());
    assert_eq!(read.field.shape(), model.field.shape());
}

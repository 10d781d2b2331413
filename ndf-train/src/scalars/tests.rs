//! Laws of learning scalar fields, and gradients against central differences of the loss.

use ndf_core::DVec3;
use ndf_core::progress::NoProgress;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::shapes;
use ndf_model::ChannelIndex;
use ndf_model::scalars::{ScalarShape, ScalarsError};
use ndf_model::{DisplacementField, FieldShape, NetworkShape, Similarity};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use super::*;
use crate::Schedule;

/// A sphere of radius 10 around (1, 2, 3) as its own base mesh: the field is the identity.
fn model() -> Model {
    let base = ManifoldMesh::try_from(shapes::icosphere(2)).unwrap();
    let field = DisplacementField::untrained(base, FieldShape::default(), 1).unwrap();
    let similarity = Similarity::new(0.1, DVec3::new(1.0, 2.0, 3.0)).unwrap();
    Model { field, similarity, metric: None, scalars: Vec::new(), provenance: String::new() }
}

/// The finer mesh of that sphere, and the function whose values are learned there.
fn mesh() -> TriangleMesh {
    shapes::icosphere(4).map_positions(|p| DVec3::new(1.0, 2.0, 3.0) + 10.0 * p)
}

fn scalars(mesh: &TriangleMesh, name: &str, f: impl Fn(DVec3) -> f64) -> VertexScalars {
    VertexScalars { name: name.to_owned(), values: mesh.positions().iter().map(|&p| f(p) as f32).collect() }
}

fn three(mesh: &TriangleMesh) -> [VertexScalars; 3] {
    [
        scalars(mesh, "height", |p| p.z),
        scalars(mesh, "constant", |_| 0.3),
        scalars(mesh, "saddle", |p| 1e3 * (p.x - 1.0) * (p.y - 2.0)),
    ]
}

fn quick() -> ScalarSettings {
    ScalarSettings { epochs: 400, samples: 1_000, ..ScalarSettings::default() }
}

fn bits(fit: &ScalarFit) -> Vec<u32> {
    let network = fit.fields.network().unwrap();
    network.features().iter().chain(network.mlp().parameters()).map(|x| x.to_bits()).collect()
}

#[test]
fn smooth_fields_are_learned_in_their_own_units_and_constant_ones_exactly() {
    let (model, mesh) = (model(), mesh());
    // A network that is told the channel learns more slowly.
    for (index, rms, max) in [(ChannelIndex::Output, 0.01, 0.06), (ChannelIndex::Input, 0.1, 0.3)] {
        let settings = ScalarSettings { shape: ScalarShape { index, ..ScalarShape::default() }, ..quick() };
        let ScalarFit { fields, report } = fit(&model, &mesh, &three(&mesh), &settings, &NoProgress).unwrap();
        assert_eq!((report.epochs, report.interrupted), (400, false));
        assert!(report.overall().rms < rms && report.overall().max < max, "{index:?} {report:?}");
        assert_eq!(report.channels[1], ChannelError::default());
        // The reported error is that at points of the base mesh, in the units of the values.
        let base = model.field.base();
        let points = AreaSampler::new(base).unwrap().sample(2_000, 5, 0);
        let columns = fields.columns(base, &points);
        let mut squares = 0.0;
        for (i, point) in points.iter().enumerate() {
            let p = model.similarity.to_world(point.position(base));
            // The closest point of the finer sphere is nearly that in the direction of the centre.
            let z = 3.0 + 10.0 * (p - DVec3::new(1.0, 2.0, 3.0)).normalize().z;
            squares += (f64::from(columns[0].values[i]) - z).powi(2);
            assert_eq!(columns[1].values[i], 0.3);
        }
        let rms = (squares / 2_000.0).sqrt() / 20.0;
        assert!(
            (rms - report.channels[0].rms).abs() < 0.3 * report.channels[0].rms + 1e-3,
            "{rms} {report:?}"
        );
        // The coarse sphere lies inside the fine one, by up to 3 % of the radius.
        assert!(report.distance_rms < report.distance_max && report.distance_max < 0.4, "{report:?}");
    }
}

#[test]
fn the_seed_decides_every_bit_and_the_threads_none() {
    let (model, mesh) = (model(), mesh());
    let run = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let settings = ScalarSettings { epochs: 40, seed, ..quick() };
        bits(&pool.install(|| fit(&model, &mesh, &three(&mesh), &settings, &NoProgress)).unwrap())
    };
    let first = run(1, 0);
    assert!(first == run(3, 0));
    assert!(first != run(1, 1));
}

#[test]
fn what_cannot_be_learned_is_named() {
    let (model, mesh) = (model(), mesh());
    let error = |mesh: &TriangleMesh, scalars: &[VertexScalars], settings: &ScalarSettings| {
        fit(&model, mesh, scalars, settings, &NoProgress).unwrap_err()
    };
    let [height, ..] = three(&mesh);
    let mut short = height.clone();
    short.values.pop();
    assert!(matches!(error(&mesh, &[short], &quick()), ScalarError::Length { values: 2561, .. }));
    let mut holes = height.clone();
    holes.values[7] = f32::NAN;
    holes.values[8] = f32::INFINITY;
    let found = error(&mesh, &[holes], &quick());
    assert!(matches!(found, ScalarError::NotFinite { count: 2, .. }), "{found}");
    assert!(matches!(error(&mesh, &[], &quick()), ScalarError::Stored(ScalarsError::Empty)));
    let away = mesh.map_positions(|p| p + DVec3::X);
    assert!(fit(&model, &away, std::slice::from_ref(&height), &quick(), &NoProgress).is_ok());
    let far = mesh.map_positions(|p| p + 10.0 * DVec3::X);
    let found = error(&far, std::slice::from_ref(&height), &quick());
    assert!(matches!(found, ScalarError::Far { distance } if distance > 1.5 && distance < 10.0), "{found}");
    let flat = mesh.map_positions(|_| DVec3::ZERO);
    assert_eq!(error(&flat, std::slice::from_ref(&height), &quick()), ScalarError::NoArea);
    for settings in [
        ScalarSettings { epochs: 0, ..quick() },
        ScalarSettings { samples: 0, ..quick() },
        ScalarSettings { rate: Schedule::constant(f32::NAN), ..quick() },
        ScalarSettings {
            shape: ScalarShape {
                network: NetworkShape { hidden: vec![0], ..NetworkShape::default() },
                ..ScalarShape::default()
            },
            ..quick()
        },
    ] {
        assert!(matches!(error(&mesh, std::slice::from_ref(&height), &settings), ScalarError::Settings(_)));
    }
    let wild = ScalarSettings { rate: Schedule::constant(1e30), ..quick() };
    assert!(matches!(error(&mesh, &[height], &wild), ScalarError::Diverged { .. }));
}

#[test]
fn a_cancelled_run_ends_with_what_it_has() {
    struct Cancelled;
    impl Progress for Cancelled {
        fn report(&self, _stage: &str, _fraction: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let (model, mesh) = (model(), mesh());
    let fit = fit(&model, &mesh, &three(&mesh), &quick(), &Cancelled).unwrap();
    assert!(fit.report.interrupted && fit.report.epochs == 0);
}

/// All gradients of an epoch against central differences of its loss, which is evaluated through [`SurfaceScalars`] in the
/// values' own units.
#[test]
fn gradients_agree_with_differences() {
    let (model, mesh) = (model(), mesh());
    let base = model.field.base();
    let [height, _, saddle] = three(&mesh);
    let values = Values::new(&mesh, &[height, saddle]).unwrap();
    let samples = AreaSampler::new(base).unwrap().sample(333, 3, 0);
    let drawn = || values.draw(&model, &samples).unwrap();
    // Training does not know of the clamping.
    let mut channels = values.channels.clone();
    channels.iter_mut().for_each(|c| c.range = [-1e9, 1e9]);
    let default = NetworkShape { hidden: vec![16, 8], ..ScalarShape::default().network };
    let with = |network: NetworkShape, index| ScalarShape { network, index };
    let (output, input) = (ChannelIndex::Output, ChannelIndex::Input);
    for shape in [
        with(default.clone(), output),
        with(default.clone(), input),
        with(NetworkShape { features: 9, octaves: 1, ..default.clone() }, input),
        with(NetworkShape { features: 0, octaves: 3, ..default }, output),
    ] {
        let settings = ScalarSettings { shape: shape.clone(), ..quick() };
        let mut trainer = Trainer::new(base, 2, &settings);
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        trainer.learned.features.iter_mut().for_each(|f| *f = rng.random_range(-1.0..1.0));
        let batch = Batch::new(drawn(), base.face_count());
        let loss = trainer.accumulate(&batch, &values);
        let mut by_features = vec![0.0_f32; trainer.learned.features.len()];
        let corners = trainer.engine.by_corners.chunks_exact(shape.network.features.max(1));
        for (&v, gradient) in base.faces().iter().flatten().zip(corners) {
            let to = &mut by_features[v as usize * shape.network.features..];
            to.iter_mut().zip(gradient).for_each(|(to, g)| *to += g);
        }

        let feet = drawn().feet;
        let evaluate = |[features, parameters]: [Vec<f32>; 2]| -> f64 {
            let (channels, shape) = (channels.clone(), shape.clone());
            let fields =
                SurfaceScalars::new(channels, shape, base.vertex_count(), features, parameters).unwrap();
            let found = fields.evaluate(base, &samples);
            let mut wanted = [0.0; 2];
            let mut sum = 0.0;
            for (found, foot) in found.chunks_exact(2).zip(&feet) {
                values.outputs_at(foot, &mut wanted);
                for ((found, wanted), channel) in found.iter().zip(wanted).zip(fields.channels()) {
                    sum += f64::from(channel.output(*found) - wanted).powi(2);
                }
            }
            sum / (2.0 * samples.len() as f64)
        };
        let start = [trainer.learned.features.clone(), trainer.learned.mlp.parameters().to_vec()];
        assert!((loss - evaluate(start.clone())).abs() < 1e-5 * loss, "{shape:?}");
        for (which, gradients) in [by_features, trainer.engine.by_parameters.clone()].iter().enumerate() {
            let largest = gradients.iter().fold(0.0_f64, |m, g| m.max(f64::from(g.abs())));
            for i in (0..gradients.len()).step_by(17) {
                let at = |h: f32| {
                    let mut parts = start.clone();
                    parts[which][i] += h;
                    (f64::from(parts[which][i]), evaluate(parts))
                };
                let (up, down) = (at(1e-2), at(-1e-2));
                let slope = (up.1 - down.1) / (up.0 - down.0);
                let error = (slope - f64::from(gradients[i])).abs();
                assert!(error < 5e-3 * largest, "{shape:?} {which} {i}: {slope} {} {largest}", gradients[i]);
            }
        }
    }
}

fn on_levels(budget: ScalarBudget) -> ScalarFit {
    let mesh = mesh();
    let options = ScalarLevelOptions { budget, ..ScalarLevelOptions::default() };
    fit_levels(&model(), &mesh, &three(&mesh), &options, &NoProgress).unwrap()
}

#[test]
fn smooth_fields_take_few_bytes_on_levels_and_constant_ones_come_back_exactly() {
    let found = on_levels(ScalarLevelOptions::default().budget);
    assert!(found.report.overall().rms < 2e-3, "{:?}", found.report);
    assert_eq!(found.report.channels[1], ChannelError::default());
    assert!(found.fields.stored_bytes() < 700, "{}", found.fields.stored_bytes());
    // The figures are those of the file.
    let mut model = model();
    model.scalars = vec![found.fields];
    let read = Model::from_bytes(&model.to_bytes()).unwrap();
    let (mesh, base) = (mesh(), read.field.base());
    let values = Values::new(&mesh, &three(&mesh)).unwrap().in_ranges();
    let samples = AreaSampler::new(base).unwrap().sample(20_000, 5, 5);
    let drawn = values.draw(&read, &samples).unwrap();
    let again = errors(&read.scalars[0], &read, &values, &drawn);
    for (a, b) in again.iter().zip(&found.report.channels) {
        assert!((a.rms - b.rms).abs() <= 0.1 * b.rms, "{a:?} {b:?}");
    }
}

#[test]
fn more_bytes_never_mean_more_error_and_budgets_are_kept() {
    let prices = [1e-5, 1e-6, 1e-7, 1e-8, 1e-9].map(|price| on_levels(ScalarBudget::Price(price)));
    for pair in prices.windows(2) {
        assert!(pair[0].fields.stored_bytes() <= pair[1].fields.stored_bytes());
        assert!(pair[0].report.overall().rms >= pair[1].report.overall().rms);
    }
    let small = on_levels(ScalarBudget::Bytes(300));
    assert!((240..=300).contains(&small.fields.stored_bytes()), "{}", small.fields.stored_bytes());
    let close = on_levels(ScalarBudget::Error(4e-3)).report.overall().rms;
    assert!((2.5e-3..4.1e-3).contains(&close), "{close}");
}

#[test]
fn levels_do_not_depend_on_threads_and_stop_when_asked() {
    struct Stopped;
    impl Progress for Stopped {
        fn report(&self, _: &str, _: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let mesh = mesh();
    let options = ScalarLevelOptions { budget: ScalarBudget::Price(1e-6), splits: Some(1), seed: 3 };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| fit_levels(&model(), &mesh, &three(&mesh), &options, &NoProgress));
        found.unwrap().fields.levels().unwrap().numbers().clone()
    };
    assert_eq!(run(1), run(3));
    let stopped = fit_levels(&model(), &mesh, &three(&mesh), &options, &Stopped);
    assert!(matches!(stopped, Err(ScalarError::Cancelled(_))));
    let none = ScalarLevelOptions { budget: ScalarBudget::Bytes(0), ..options };
    assert!(matches!(
        fit_levels(&model(), &mesh, &three(&mesh), &none, &NoProgress),
        Err(ScalarError::Settings(_))
    ));
}

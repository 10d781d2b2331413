//! Training on a surface known by formula.

use ndf_core::analytic::Sphere;
use ndf_core::progress::{NoProgress, Progress};
use ndf_core::{Answer, BoundingBox, DVec3, Miss, Query, Surface};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::shapes;
use ndf_train::{Settings, TrainError, Trainer, fit, train};

const CENTER: DVec3 = DVec3::new(5.0, 0.0, 0.0);
const RADIUS: f64 = 2.0;
const SPHERE: Sphere = Sphere { center: CENTER, radius: RADIUS };

fn base() -> ManifoldMesh {
    let ball = shapes::icosphere(1).map_positions(|p| CENTER + RADIUS * p);
    ManifoldMesh::try_from(ball).expect("an icosphere is a manifold")
}

fn quick() -> Settings {
    Settings { epochs: 1_500, samples: 1_000, ..Settings::default() }
}

#[test]
fn the_field_leaves_the_polyhedron_for_the_sphere() {
    let untrained = fit(&SPHERE, &base(), &Settings { epochs: 0, ..quick() }, &NoProgress).unwrap().report;
    let trained = fit(&SPHERE, &base(), &quick(), &NoProgress).unwrap();
    let report = trained.report;
    assert!(untrained.projection_rms > 0.05, "{untrained:?}");
    assert!(report.projection_rms < 0.1 * untrained.projection_rms, "{report:?}");
    assert!(report.flipped_fraction == 0.0 && report.missed_fraction == 0.0 && !report.interrupted);
    assert!(report.cycle_loss.is_some_and(|loss| loss > 0.0 && loss < 1e-3), "{report:?}");
    assert_eq!(untrained.cycle_loss, None);
    assert_eq!(report.epochs, 1_500);
}

#[test]
fn the_number_of_threads_and_the_run_change_no_bit() {
    let run = |threads: usize, settings: &Settings| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let fit = pool.install(|| fit(&SPHERE, &base(), settings, &NoProgress)).unwrap();
        let bits = |x: &[f32]| x.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        (bits(fit.field.network().unwrap().features()), bits(fit.field.network().unwrap().mlp().parameters()))
    };
    let settings = Settings { epochs: 40, ..quick() };
    let one = run(1, &settings);
    assert_eq!(one, run(1, &settings));
    assert_eq!(one, run(3, &settings));
    assert_ne!(one, run(1, &Settings { seed: 1, ..settings }));
}

#[test]
fn odd_shapes_and_numbers_of_samples_train_too() {
    use ndf_model::{FieldShape, NetworkShape};
    for field in [
        NetworkShape { features: 0, octaves: 4, ..NetworkShape::default() }.into(),
        NetworkShape { features: 5, octaves: 1, hidden: vec![17], ..NetworkShape::default() }.into(),
        FieldShape { network: NetworkShape { features: 2, ..NetworkShape::default() }, residual: false },
    ] {
        let settings = Settings { field, samples: 777, lambda_c: 0.0, ..quick() };
        let report = fit(&SPHERE, &base(), &settings, &NoProgress).unwrap().report;
        assert!(report.projection_rms < 0.06, "{settings:?}: {report:?}");
        assert_eq!(report.cycle_loss, None);
    }
    let report = fit(&SPHERE, &base(), &Settings { samples: 3, epochs: 5, ..quick() }, &NoProgress).unwrap();
    assert_eq!(report.report.epochs, 5);
}

#[test]
fn cancelling_gives_what_is_there() {
    struct Impatient;
    impl Progress for Impatient {
        fn report(&self, _stage: &str, _fraction: f64) {}
        fn cancelled(&self) -> bool {
            true
        }
    }
    let report = fit(&SPHERE, &base(), &quick(), &Impatient).unwrap().report;
    assert!(report.interrupted && report.epochs == 0);
}

#[test]
fn unusable_settings_and_hopeless_surfaces_are_refused() {
    let refuse = |settings: Settings| fit(&SPHERE, &base(), &settings, &NoProgress).unwrap_err();
    assert!(matches!(refuse(Settings { samples: 0, ..quick() }), TrainError::Settings(_)));
    assert!(matches!(refuse(Settings { lambda_p: f32::NAN, ..quick() }), TrainError::Settings(_)));
    assert!(matches!(
        refuse(Settings { lambda_p: f32::MAX, epochs: 3, ..quick() }),
        TrainError::Diverged { .. }
    ));

    struct Nothing;
    impl Surface for Nothing {
        fn bounds(&self) -> BoundingBox {
            SPHERE.bounds()
        }
        fn project(&self, _queries: &[Query], feet: &mut [Answer]) {
            feet.fill(Err(Miss::OutOfReach));
        }
    }
    let error = fit(&Nothing, &base(), &quick(), &NoProgress).unwrap_err();
    assert!(matches!(error, TrainError::OutOfReach { .. }));
}

/// The sphere, 2 % too small.
struct Rough;

impl Surface for Rough {
    fn bounds(&self) -> BoundingBox {
        SPHERE.bounds()
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        SPHERE.project(queries, feet);
        for foot in feet.iter_mut().flatten() {
            foot.point = CENTER + 0.98 * (foot.point - CENTER);
        }
    }
}

#[test]
fn the_last_epochs_and_the_measurement_see_the_truth() {
    let run = |epochs: usize| {
        let mut trainer = Trainer::new(&Rough, &base(), &quick()).unwrap().finished_on(&SPHERE, epochs);
        train(&mut trainer, None, &NoProgress).unwrap().0.report.projection_rms
    };
    // In the box of side 3 the radius is about 1.5.
    let (never, last_third) = (run(0), run(500));
    assert!((never - 0.02 * 1.5).abs() < 0.005, "{never}");
    assert!(last_third < 0.3 * never, "{last_third} against {never}");
}

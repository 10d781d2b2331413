use std::cell::RefCell;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use super::*;
use crate::{Checkpoint, CheckpointError, Learning};
use ndf_core::analytic::{Sphere, Torus};
use ndf_core::{Answer, BoundingBox, DVec3, Foot, Hint, NoProgress, Query};
use ndf_mesh::shapes;
use ndf_model::file::LevelCoder;

fn manifold(mesh: ndf_mesh::TriangleMesh) -> ManifoldMesh {
    ManifoldMesh::try_from(mesh).unwrap()
}

fn in_box(mesh: &ManifoldMesh) -> (Similarity, ManifoldMesh) {
    let similarity = Similarity::from_bounds(&mesh.bounds());
    let positions = mesh.positions().iter().map(|&p| similarity.to_normalised(p)).collect();
    (similarity, mesh.with_positions(positions))
}

fn fitted(surface: &dyn Surface, mesh: &ManifoldMesh, settings: &LevelOptions) -> LevelFit {
    let (similarity, base) = in_box(mesh);
    fit_levels(surface, surface, similarity, &base, settings, &NoProgress).unwrap()
}

/// Loop's surface of a few hundred faces comes within a ten-thousandth of a sphere, of which the facets are fifty times as
/// far away.
#[test]
fn a_sphere_is_learned_by_few_numbers() {
    let base = manifold(shapes::icosphere(2));
    let settings = LevelOptions { budget: Budget::Bytes(1500), ..LevelOptions::default() };
    let fit = fitted(&Sphere::UNIT, &base, &settings);
    // The box has the sphere's diameter as 3.
    assert!(fit.report.projection_rms < 3e-4 * 3.0, "{:?}", fit.report);
    assert!(fit.report.flipped_fraction == 0.0 && fit.report.missed_fraction == 0.0);
}

/// More bytes bring the surface closer, and the size is what was asked for.
#[test]
fn sizes_are_kept_and_distances_fall_with_them() {
    let surface = Torus { center: DVec3::ZERO, ring: 1.0, tube: 0.4 };
    let base = manifold(shapes::torus(18, 10, 0.97, 0.35));
    let distances: Vec<f64> = [600, 1000]
        .into_iter()
        .map(|bytes| {
            let settings = LevelOptions { budget: Budget::Bytes(bytes), ..LevelOptions::default() };
            let fit = fitted(&surface, &base, &settings);
            let coder = LevelCoder::new(fit.field.base(), 3);
            let size: usize = coder.sizes(fit.field.levels().unwrap()).iter().sum();
            assert!(size.abs_diff(bytes) * 8 < bytes, "{size} bytes for {bytes}");
            fit.report.projection_rms
        })
        .collect();
    assert!(distances[1] < 0.8 * distances[0], "{distances:?}");
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let base = manifold(shapes::icosphere(1));
    let with_threads = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let settings = LevelOptions { iterations: [4, 6], ..LevelOptions::default() };
        pool.install(|| fitted(&Sphere::UNIT, &base, &settings).field.levels().unwrap().clone())
    };
    assert_eq!(with_threads(1), with_threads(3));
}

/// Similarities move the surface and nothing else.
#[test]
fn units_do_not_matter() {
    let levels = |scale: f64| {
        let base = manifold(shapes::icosphere(1));
        let base = base.with_positions(base.positions().iter().map(|&p| p * scale).collect());
        let surface = Sphere { center: DVec3::ZERO, radius: scale };
        let settings = LevelOptions { iterations: [6, 6], ..LevelOptions::default() };
        fitted(&surface, &base, &settings).report.projection_rms
    };
    let (one, other) = (levels(1.0), levels(1024.0));
    assert!((one - other).abs() < 1e-9 * one, "{one} {other}");
}

/// What lies on the surface already needs no bits, and what is flat stays flat.
#[test]
fn a_plane_is_its_base_mesh() {
    let base = manifold(shapes::grid(6, 6));
    struct Plane;
    impl Surface for Plane {
        fn bounds(&self) -> BoundingBox {
            BoundingBox { min: DVec3::ZERO, max: DVec3::new(1.0, 1.0, 0.0) }
        }

        fn project(&self, queries: &[Query], feet: &mut [Answer]) {
            for (query, foot) in queries.iter().zip(feet) {
                let point = DVec3 { z: 0.0, ..query.point };
                *foot = Ok(Foot { point, normal: DVec3::Z, hint: Hint::NONE });
            }
        }
    }
    let fit = fitted(&Plane, &base, &LevelOptions::default());
    assert!(fit.report.projection_max < 1e-4, "{:?}", fit.report);
    let size = fit.field.base().bounds().diagonal();
    assert!(size > 3.0, "{size}");
}

#[test]
fn what_cannot_be_done_is_said_before_it_is_tried() {
    let (similarity, base) = in_box(&manifold(shapes::icosphere(1)));
    let fit = |options: LevelOptions| {
        fit_levels(&Sphere::UNIT, &Sphere::UNIT, similarity, &base, &options, &NoProgress).unwrap_err()
    };
    let default = LevelOptions::default();
    for budget in [Budget::Bytes(0), Budget::Price(f64::NAN), Budget::PerFace(-1.0)] {
        assert!(matches!(fit(LevelOptions { budget, ..default }), LevelFitError::Option(_)));
    }
    assert!(matches!(fit(LevelOptions { levels: Some(20), ..default }), LevelFitError::Levels(_)));
    struct Stop;
    impl Progress for Stop {
        fn report(&self, _: &str, _: f64) {}

        fn cancelled(&self) -> bool {
            true
        }
    }
    let stopped = fit_levels(&Sphere::UNIT, &Sphere::UNIT, similarity, &base, &default, &Stop);
    assert!(matches!(stopped, Err(LevelFitError::Cancelled(_))));
}

/// Asks to stop once: after the report, or at the question, of this number since it was armed.
#[derive(Default)]
struct StopAt {
    report: Option<usize>,
    question: Option<usize>,
    is_armed: AtomicBool,
    made: [AtomicUsize; 2],
}

impl StopAt {
    fn report(report: usize) -> Self {
        Self { report: Some(report), ..Self::default() }
    }

    fn question(question: usize) -> Self {
        Self { question: Some(question), ..Self::default() }
    }
}

impl Progress for StopAt {
    fn report(&self, _: &str, fraction: f64) {
        assert!((0.0..=1.0).contains(&fraction));
        self.made[0].fetch_add(1, Ordering::Relaxed);
    }

    fn cancelled(&self) -> bool {
        if !self.is_armed.load(Ordering::Relaxed) {
            return false;
        }
        let asked = self.made[1].fetch_add(1, Ordering::Relaxed);
        Some(self.made[0].load(Ordering::Relaxed)) == self.report || Some(asked) == self.question
    }
}

/// Part of a torus that is learned with all that there is: several runs, a finer level, a grid, a boundary, and at the end
/// another surface.
struct Example {
    surface: Torus,
    truth: Torus,
    base: ManifoldMesh,
    similarity: Similarity,
    options: LevelOptions,
    project_every: usize,
}

impl Example {
    fn new() -> Self {
        let all = shapes::torus(16, 8, 0.97, 0.35);
        let faces = all.faces()[..200].to_vec();
        let used = faces.as_flattened().iter().max().unwrap() + 1;
        let positions = all.positions()[..used as usize].to_vec();
        let base = manifold(ndf_mesh::TriangleMesh::new(positions, faces).unwrap());
        let (similarity, base) = in_box(&base);
        let torus = |tube| Torus { center: DVec3::ZERO, ring: 1.0, tube };
        let options = LevelOptions { levels: Some(2), iterations: [8, 5], ..LevelOptions::default() };
        Self { surface: torus(0.401), truth: torus(0.4), base, similarity, options, project_every: 1 }
    }

    fn trainer<'a>(&'a self, progress: &'a dyn Progress) -> LevelTrainer<'a> {
        let trainer = LevelTrainer::new(&self.surface, self.similarity, &self.base, &self.options, progress);
        trainer.unwrap().finished_on(&self.truth).projecting_every(self.project_every)
    }

    /// What a run becomes that goes on from a checkpoint.
    fn resumed(&self, checkpoint: LevelCheckpoint) -> LevelFit {
        let trainer = LevelTrainer::resumed(&self.surface, checkpoint, &NoProgress).unwrap();
        trainer.finished_on(&self.truth).projecting_every(self.project_every).train().unwrap().0
    }
}

fn written_and_read(checkpoint: LevelCheckpoint) -> LevelCheckpoint {
    let bytes = Checkpoint::from(checkpoint).to_bytes();
    match Checkpoint::from_bytes(&bytes).unwrap().learning {
        Learning::Levels(levels) => *levels,
        other @ Learning::Network(_) => panic!("{other:?}"),
    }
}

fn assert_same(a: &LevelFit, b: &LevelFit, what: &str) {
    assert!(a.field.levels() == b.field.levels(), "{what}");
    let timeless = |report: FitReport| FitReport { seconds: 0.0, ..report };
    assert_eq!(timeless(a.report), timeless(b.report), "{what}");
    assert_eq!((a.price, a.mean, a.bytes), (b.price, b.mean, b.bytes), "{what}");
}

/// Wherever a run is stopped, between iterations or within one, before or after the trial, the finest level and the grid: it
/// has a model, and goes on from its file to the same numbers.
#[test]
fn an_interrupted_run_is_resumed_without_a_trace() {
    resumed_without_a_trace(&Example::new());
}

#[test]
fn an_interrupted_run_that_keeps_its_feet_is_resumed_without_a_trace() {
    resumed_without_a_trace(&Example { project_every: 3, ..Example::new() });
}

/// Where feet are kept for some iterations, what is learned is about as close.
#[test]
fn kept_feet_lead_as_close() {
    let rms = |project_every| {
        let options = LevelOptions { iterations: [20, 40], ..Example::new().options };
        let example = Example { project_every, options, ..Example::new() };
        example.trainer(&NoProgress).train().unwrap().0.report.projection_rms
    };
    let (kept, anew) = (rms(5), rms(1));
    assert!(kept < 1.1 * anew, "{kept} {anew}");
}

fn resumed_without_a_trace(example: &Example) {
    let (whole, end) = example.trainer(&NoProgress).train().unwrap();
    assert!(!whole.report.interrupted && whole.report.epochs == 13);
    assert_same(&example.resumed(written_and_read(end)), &whole, "from the end");
    let reports = [0, 1, 4, 5, 6, 7, 8, 9, 11, 12].map(StopAt::report);
    let questions = [1, 4, 9, 16, 25, 33].map(StopAt::question);
    for stop in reports.into_iter().chain(questions) {
        let trainer = example.trainer(&stop);
        stop.is_armed.store(true, Ordering::Relaxed);
        let (broken, checkpoint) = trainer.train().unwrap();
        let what = format!("{} {:?} {:?}", checkpoint.iterations()[0], stop.report, stop.question);
        assert!(broken.report.interrupted, "{what}");
        assert!(stop.report.is_none_or(|report| report == broken.report.epochs), "{what}");
        assert!(broken.report.projection_rms < 0.2 && broken.report.missed_fraction < 0.1, "{what}");
        assert_same(&example.resumed(written_and_read(checkpoint)), &whole, &what);
    }
}

/// Checkpoints of a running run are as good, and its log tells of every run and iteration.
#[test]
fn checkpoints_on_the_way_and_the_log() {
    let example = Example::new();
    let (kept, told) = (RefCell::new(Vec::new()), RefCell::new(Vec::new()));
    let trainer = example.trainer(&NoProgress);
    let trainer =
        trainer.keeping(Duration::ZERO, Instant::now(), |checkpoint| kept.borrow_mut().push(checkpoint));
    let (whole, _) = trainer.logging(|record| told.borrow_mut().push(*record)).train().unwrap();
    let (kept, told) = (kept.take(), told.take());
    assert_eq!(kept.len(), 13);
    assert_same(&example.resumed(written_and_read(kept[6].clone())), &whole, "on the way");
    assert!(told.iter().filter(|record| record.iteration == 0).count() > 1);
    let last = told.last().unwrap();
    assert_eq!((last.iteration, last.bytes, last.distance_mean), (12, whole.bytes, whole.mean));
    assert!(told.is_sorted_by_key(|record| record.iteration));
}

/// A run whose time is up has a model that is on its grid, and goes on as if it had not been limited.
#[test]
fn a_run_whose_time_is_up_ends_well() {
    let example = Example::new();
    let (whole, _) = example.trainer(&NoProgress).train().unwrap();
    let options = LevelOptions { time_limit: Some(Duration::ZERO), ..example.options };
    let limited = Example { options, ..Example::new() };
    let (limited, checkpoint) = limited.trainer(&NoProgress).train().unwrap();
    assert!(limited.report.interrupted && limited.report.epochs == 0);
    assert!(limited.report.projection_rms < 0.02, "{:?}", limited.report);
    let unlimited = written_and_read(checkpoint).with_time_limit(None);
    assert_same(&example.resumed(unlimited), &whole, "without limit");
}

/// Whatever is wrong with a checkpoint whose checksum is right, it is refused.
#[test]
fn checkpoints_whose_parts_do_not_fit_are_refused() {
    let example = Example::new();
    let stop = StopAt { is_armed: true.into(), ..StopAt::report(9) };
    let (_, checkpoint) = example.trainer(&stop).train().unwrap();
    let search = Search {
        wanted: 1e-3,
        suits_base: true,
        attempts: vec![Attempt { asked: 900, bytes: 800, mean: 2e-3 }],
    };
    let checkpoint = LevelCheckpoint { search: Some(search), ..checkpoint };
    assert_eq!(written_and_read(checkpoint.clone()).search, checkpoint.search);
    let refused = |name: &str, change: &dyn Fn(&mut LevelCheckpoint)| {
        let mut changed = checkpoint.clone();
        change(&mut changed);
        let read = Checkpoint::from_bytes(&Checkpoint::from(changed).to_bytes());
        assert!(matches!(read, Err(CheckpointError::Content(_) | CheckpointError::Levels(_))), "{name}");
    };
    refused("no run", &|c| c.runs.clear());
    refused("iteration", &|c| c.iteration = 99);
    refused("before the grid", &|c| c.iteration = 8);
    refused("before the finest level", &|c| c.iteration = 2);
    refused("levels", &|c| c.options.levels = Some(20));
    refused("other levels", &|c| c.options.levels = Some(3));
    refused("budget", &|c| c.options.budget = Budget::Price(f64::NAN));
    refused("share", &|c| c.search.as_mut().unwrap().wanted = -1.0);
    refused("base", &|c| c.base = c.base.with_positions(vec![DVec3::splat(1e9); c.base.vertex_count()]));
    refused("other base", &|c| c.base = in_box(&manifold(shapes::icosphere(2))).1);
    refused("price", &|c| c.runs[0].lambda = 0.0);
    refused("control", &|c| c.runs[0].descent.state.control[5].x = f64::INFINITY);
    refused("grid", &|c| c.runs[0].descent.state.gridded.as_mut().unwrap()[0][1] = i32::MAX);
    refused("no grid", &|c| c.runs[0].descent.grid = None);
    refused("step", &|c| c.runs[0].descent.state.levels[0].0 = -1.0);
    refused("displacement", &|c| c.runs[0].descent.state.levels[1].1[3] = i32::MIN);
    refused("value", &|c| c.runs[0].descent.state.levels[1].2[3] = f64::NAN);
    refused("fewer", &|c| c.runs[0].descent.state.levels[1].2.truncate(9));
    refused("hints", &|c| c.runs[0].descent.hints.truncate(9));
}

#[test]
fn a_boundary_stays_one() {
    // The unit square bent to a sphere: the base mesh is the flat square below it.
    let base = manifold(shapes::grid(6, 6));
    let bounds = base.bounds();
    let surface = Sphere { center: bounds.center() - DVec3::Z * 2.0, radius: 2.3 };
    let fit = fitted(&surface, &base, &LevelOptions { iterations: [8, 8], ..LevelOptions::default() });
    assert!(fit.report.projection_rms < 0.01, "{:?}", fit.report);
    assert_eq!(fit.field.base().topology().boundary_edge_count(), 24);
}

/// The surface of a box.
struct Cuboid(BoundingBox);

impl Surface for Cuboid {
    fn bounds(&self) -> BoundingBox {
        self.0
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (query, foot) in queries.iter().zip(feet) {
            let inside = query.point.clamp(self.0.min, self.0.max);
            let sides = (0..3).flat_map(|c| [(c, self.0.min[c], -1.0), (c, self.0.max[c], 1.0)]);
            let away = |&(c, side, _): &(usize, f64, f64)| (inside[c] - side).abs();
            let (c, side, sign) = sides.min_by(|a, b| away(a).total_cmp(&away(b))).unwrap();
            let (mut point, mut normal) = (inside, DVec3::ZERO);
            (point[c], normal[c]) = (side, sign);
            *foot = Ok(Foot { point, normal, hint: Hint::NONE });
        }
    }
}

/// A box that is its own base mesh stays one, with its edges and corners.
#[test]
fn what_is_sharp_stays_sharp() {
    let base = manifold(shapes::cube(2));
    let fit = fitted(&Cuboid(base.bounds()), &base, &LevelOptions::default());
    assert!(fit.report.projection_max < 1e-4, "{:?}", fit.report);
    let surface = fit.field.level_surface().unwrap();
    let bounds = BoundingBox::of_points(surface.points());
    for corner in [bounds.min, bounds.max] {
        assert!((corner.abs() - 1.5).abs().max_element() < 1e-4, "{corner}");
        assert!(surface.points().iter().any(|p| p.distance(corner) < 1e-4));
    }
}

/// A flat disc.
struct Disc;

impl Surface for Disc {
    fn bounds(&self) -> BoundingBox {
        BoundingBox { min: DVec3::new(-1.0, -1.0, 0.0), max: DVec3::new(1.0, 1.0, 0.0) }
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (query, foot) in queries.iter().zip(feet) {
            let point = DVec3 { z: 0.0, ..query.point }.clamp_length_max(1.0);
            *foot = Ok(Foot { point, normal: DVec3::Z, hint: Hint::NONE });
        }
    }
}

/// Nothing pulls on a boundary inside the surface but what is missing there: without it, rounding and the price of bits let
/// it shrink.
#[test]
fn boundaries_reach_the_end_of_the_surface() {
    let square = manifold(shapes::grid(8, 8));
    let bounds = square.bounds();
    let round = |p: &DVec3| {
        let DVec3 { x, y, .. } = 2.0 * (*p - bounds.min) / bounds.extent().max_element() - DVec3::ONE;
        DVec3::new(x * (1.0 - 0.5 * y * y).sqrt(), y * (1.0 - 0.5 * x * x).sqrt(), 0.0)
    };
    let base = square.with_positions(square.positions().iter().map(round).collect());
    let fit = fitted(&Disc, &base, &LevelOptions { budget: Budget::Bytes(400), ..LevelOptions::default() });
    let surface = fit.field.level_surface().unwrap();
    let farthest = surface.points().iter().map(|p| p.length()).fold(0.0, f64::max);
    let area =
        ndf_mesh::TriangleMesh::new(surface.points().to_vec(), surface.faces().to_vec()).unwrap().area();
    // The box has the disc's diameter as 3.
    let disc = std::f64::consts::PI * 1.5 * 1.5;
    assert!((area / disc - 1.0).abs() < 3e-3 && farthest < 1.5 * 1.003, "{} {farthest}", area / disc);
}

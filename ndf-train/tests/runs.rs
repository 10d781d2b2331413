//! Runs that are interrupted, resumed, misled or held by anchors.

#![allow(clippy::unwrap_used, reason = "all of this file is test code")]

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use ndf_core::analytic::Sphere;
use ndf_core::progress::{NoProgress, Progress};
use ndf_core::{DVec3, Hint};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::shapes;
use ndf_model::FieldShape;
use ndf_train::{
    Checkpoint, CheckpointError, Fit, Learning, NetworkCheckpoint, ReverseMap, Schedule, Settings, Trainer,
    train,
};

fn base() -> ManifoldMesh {
    ManifoldMesh::try_from(shapes::icosphere(1)).expect("an icosphere is a manifold")
}

fn quick() -> Settings {
    Settings { epochs: 120, samples: 500, ..Settings::default() }
}

/// Cancels after it was asked so many times.
struct CancelAfter(AtomicUsize);

impl Progress for CancelAfter {
    fn report(&self, _stage: &str, _fraction: f64) {}
    fn cancelled(&self) -> bool {
        self.0.fetch_sub(1, Ordering::Relaxed) == 1
    }
}

fn run(trainer: &mut Trainer<'_>, progress: &dyn Progress) -> (Fit, NetworkCheckpoint) {
    train(trainer, None, progress).expect("the sphere can be learned")
}

fn network(checkpoint: Checkpoint) -> NetworkCheckpoint {
    match checkpoint.learning {
        Learning::Network(network) => *network,
        other @ Learning::Levels(_) => panic!("{other:?}"),
    }
}

fn bits(fit: &Fit) -> Vec<u32> {
    let all =
        fit.field.network().unwrap().features().iter().chain(fit.field.network().unwrap().mlp().parameters());
    all.map(|x| x.to_bits()).collect()
}

#[test]
fn a_resumed_run_equals_the_unbroken_one() {
    let paper_like = Settings {
        field: FieldShape { residual: false, ..FieldShape::default() },
        reverse_map: ReverseMap::Plain,
        identity_epochs: 35,
        ..quick()
    };
    let everything = Settings { lambda_d: 1.0, lambda_n: 10.0, lambda_f: 5.0, ..quick() };
    let encoding = Settings { reverse_map: ReverseMap::Encoding, ..quick() };
    for settings in [quick(), paper_like, everything, encoding] {
        let (unbroken, _) = run(&mut Trainer::new(&Sphere::UNIT, &base(), &settings).unwrap(), &NoProgress);
        for after in [1, 4, 9] {
            let cancel = CancelAfter(AtomicUsize::new(after));
            let (broken, checkpoint) =
                run(&mut Trainer::new(&Sphere::UNIT, &base(), &settings).unwrap(), &cancel);
            assert!(broken.report.interrupted && checkpoint.epoch() < 120);
            let path = std::env::temp_dir().join(format!("ndf-run-{}-{after}", std::process::id()));
            Checkpoint::from(checkpoint).write(&path).unwrap();
            let read = network(Checkpoint::read(&path).unwrap());
            std::fs::remove_file(&path).unwrap();
            let (resumed, _) = run(&mut Trainer::resumed(&Sphere::UNIT, read).unwrap(), &NoProgress);
            assert_eq!(bits(&resumed), bits(&unbroken), "after {after} batches of {settings:?}");
            assert_eq!(resumed.report.epochs, unbroken.report.epochs);
        }
    }
}

#[test]
fn damaged_checkpoints_are_refused() {
    let cancel = CancelAfter(AtomicUsize::new(2));
    let (_, checkpoint) = run(&mut Trainer::new(&Sphere::UNIT, &base(), &quick()).unwrap(), &cancel);
    let path = std::env::temp_dir().join(format!("ndf-damaged-{}", std::process::id()));
    Checkpoint::from(checkpoint).write(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    for at in [0, 9, 40, bytes.len() / 2, bytes.len() - 1] {
        let mut damaged = bytes.clone();
        damaged[at] ^= 4;
        std::fs::write(&path, &damaged).unwrap();
        assert!(Checkpoint::read(&path).is_err(), "byte {at}");
        std::fs::write(&path, &bytes[..at]).unwrap();
        assert!(Checkpoint::read(&path).is_err(), "{at} bytes");
    }
    std::fs::remove_file(&path).unwrap();
}

/// Reads a checkpoint after something in its header was replaced and bytes were put behind it; its checksum is right.
fn forged(
    checkpoint: &NetworkCheckpoint,
    name: &str,
    header: [&str; 2],
    more: &[u8],
) -> Result<NetworkCheckpoint, CheckpointError> {
    let path = std::env::temp_dir().join(format!("ndf-forged-{name}-{}", std::process::id()));
    Checkpoint::from(checkpoint.clone()).write(&path).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    // Magic and checksum, length of the header, header, numbers.
    let (length, rest) = bytes[12..].split_first_chunk::<8>().unwrap();
    let (old, numbers) = rest.split_at(u64::from_le_bytes(*length) as usize);
    let new = std::str::from_utf8(old).unwrap().replacen(header[0], header[1], 1);
    let rest = [&(new.len() as u64).to_le_bytes(), new.as_bytes(), numbers, more].concat();
    let sum = crc32fast::hash(&rest).to_le_bytes();
    std::fs::write(&path, [&bytes[..8], &sum, &rest].concat()).unwrap();
    let read = Checkpoint::read(&path);
    std::fs::remove_file(&path).unwrap();
    read.map(network)
}

#[test]
fn checkpoints_whose_parts_do_not_fit_are_refused() {
    let settings = Settings { reverse_map: ReverseMap::Encoding, ..quick() };
    let cancel = CancelAfter(AtomicUsize::new(2));
    let (_, checkpoint) = run(&mut Trainer::new(&Sphere::UNIT, &base(), &settings).unwrap(), &cancel);
    let samples = format!("\"samples\":{}", settings.samples);
    assert!(forged(&checkpoint, "same", ["", ""], &[]).is_ok());
    for (name, header, more, said) in [
        ("longer", ["", ""], &[0][..], "bytes after its end"),
        ("network", ["\"encoding\"", "\"inverse\""], &[], "reverse map"),
        ("samples", [&samples, "\"samples\":7"], &[], "different sizes"),
        ("none", [&samples, "\"samples\":0"], &[], "at least one sample"),
        ("kind", ["\"network\"", "\"nothing\""], &[], "another version"),
        ("other", ["\"network\"", "\"levels\""], &[], "another version"),
        ("negative", ["\"seconds\":", "\"seconds\":-1, \"before\":"], &[], "training took -1"),
        ("endless", ["\"seconds\":", "\"seconds\":7e30, \"before\":"], &[], "training took 7"),
    ] {
        let refusal = forged(&checkpoint, name, header, more).unwrap_err().to_string();
        assert!(refusal.contains(said), "{name}: {refusal}");
    }
    // The longest time there is leaves a run that can be resumed, and limited.
    let absurd = ["\"seconds\":", "\"seconds\":1.8e19, \"before\":"];
    let long = forged(&checkpoint, "long", absurd, &[]).unwrap().with_time_limit(Some(Duration::MAX));
    let (resumed, _) = run(&mut Trainer::resumed(&Sphere::UNIT, long).unwrap(), &NoProgress);
    assert!(resumed.report.seconds >= 1.8e19, "{:?}", resumed.report);
}

#[test]
fn a_run_that_diverges_comes_back_at_a_smaller_rate() {
    let settings = Settings { rate: Schedule::constant(1.0), epochs: 100, ..quick() };
    let (fit, _) = run(&mut Trainer::new(&Sphere::UNIT, &base(), &settings).unwrap(), &NoProgress);
    assert!(fit.report.retreats > 0 && fit.report.epochs == 100, "{:?}", fit.report);
    assert!(fit.report.projection_rms.is_finite());
}

#[test]
fn the_identity_stage_makes_both_networks_the_identity() {
    let settings = Settings {
        field: FieldShape { residual: false, ..FieldShape::default() },
        reverse_map: ReverseMap::Plain,
        identity_epochs: 600,
        epochs: 0,
        feature_rate: 1.0,
        ..quick()
    };
    let (fit, _) = run(&mut Trainer::new(&Sphere::UNIT, &base(), &settings).unwrap(), &NoProgress);
    let samples = ndf_mesh::sampling::AreaSampler::new(fit.field.base()).unwrap().sample(500, 5, 0);
    let base = fit.field.base();
    let moved =
        fit.field.map(&samples).into_iter().zip(&samples).map(|(y, s)| y.distance_squared(s.position(base)));
    let rms = (moved.sum::<f64>() / 500.0).sqrt();
    assert!(rms < 0.05, "{rms} {:?}", fit.report);
    assert!(fit.report.cycle_loss.is_some_and(|loss| loss < 0.01), "{:?}", fit.report);
}

/// The loss of every form of the reverse map falls below the square of how far g moves points, and that of the inverse
/// of g all but vanishes, though the sphere is far from its base mesh.
#[test]
fn the_way_back_is_found() {
    let cycle_loss = |reverse_map| {
        let settings = Settings { reverse_map, epochs: 600, ..quick() };
        let (fit, _) = run(&mut Trainer::new(&Sphere::UNIT, &base(), &settings).unwrap(), &NoProgress);
        fit.report.cycle_loss.unwrap()
    };
    let inverse = cycle_loss(ReverseMap::Inverse);
    assert!(inverse < 1e-5, "{inverse}");
    for map in [ReverseMap::Residual, ReverseMap::ClosestPoint, ReverseMap::Encoding] {
        let loss = cycle_loss(map);
        assert!(inverse < loss && loss < 1e-3, "{map:?}: {loss}");
    }
}

#[test]
fn anchors_turn_the_map() {
    // The sphere slides along itself freely; anchors turn it by a tenth about z.
    let turn = |p: DVec3| ndf_core::glam::DMat3::from_rotation_z(0.1) * p;
    let pairs: Vec<(DVec3, DVec3)> = base().positions().iter().step_by(5).map(|&p| (p, turn(p))).collect();
    let settings = Settings { epochs: 600, ..quick() };
    let apart = |fit: &Fit| {
        let tree = ndf_mesh::TriangleTree::new(fit.field.base());
        let distance = |&(p, q): &(DVec3, DVec3)| {
            let closest = tree.closest_point(fit.similarity.to_normalised(p), Hint::NONE).unwrap();
            fit.field.map(&[closest.at])[0].distance(fit.similarity.to_normalised(q))
        };
        pairs.iter().map(distance).sum::<f64>() / pairs.len() as f64
    };
    let (free, _) = run(&mut Trainer::new(&Sphere::UNIT, &base(), &settings).unwrap(), &NoProgress);
    let (held, _) =
        run(&mut Trainer::new(&Sphere::UNIT, &base(), &settings).unwrap().with_anchors(&pairs), &NoProgress);
    assert!(apart(&held) < 0.2 * apart(&free), "{} {}", apart(&held), apart(&free));
}

#[test]
fn alignment_of_normals_aligns_them_and_logs_tell() {
    let angle = |lambda_n: f32| {
        let settings = Settings { lambda_n, epochs: 3_000, samples: 1_000, ..quick() };
        let mut trainer = Trainer::new(&Sphere::UNIT, &base(), &settings).unwrap();
        let mut lines = 0;
        let mut log = |record: &ndf_train::LogRecord<'_>| {
            lines += 1;
            assert!(record.terms[0].0 == "projection" && record.losses.rate > 0.0);
        };
        let (fit, _) = train(&mut trainer, Some(&mut log), &NoProgress).unwrap();
        assert_eq!(lines, 299, "one for every batch but the first");
        let samples = ndf_mesh::sampling::AreaSampler::new(fit.field.base()).unwrap().sample(2000, 5, 0);
        let mapped = fit.field.map_with_tangents(&samples);
        mapped.iter().map(|m| 1.0 - m.normal().dot(m.point.normalize())).sum::<f64>() / 2000.0
    };
    let (free, aligned) = (angle(0.0), angle(1e3));
    assert!(aligned < 0.7 * free, "{aligned} {free}");
}

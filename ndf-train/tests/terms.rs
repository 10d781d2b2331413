//! Terms of one's own: what they are told, and what a checkpoint keeps of them.

#![allow(clippy::unwrap_used, reason = "all of this file is test code")]

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use ndf_core::DVec3;
use ndf_core::analytic::Sphere;
use ndf_core::glam::Vec3;
use ndf_core::progress::NoProgress;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::TriangleMesh;
use ndf_mesh::shapes;
use ndf_model::Similarity;
use ndf_train::objective::{Block, Gradients, Needs, Term};
use ndf_train::{Checkpoint, Learning, Settings, TrainError, Trainer, train};

/// An icosphere, its vertices in another order than any that a file would have.
fn base() -> ManifoldMesh {
    let sphere = shapes::icosphere(2);
    let n = sphere.vertex_count() as u32;
    let new = |v: u32| (v * 41 + 7) % n;
    let mut positions = vec![DVec3::ZERO; n as usize];
    (0..n).for_each(|v| positions[new(v) as usize] = sphere.positions()[v as usize]);
    let faces = sphere.faces().iter().map(|f| [new(f[2]), new(f[0]), new(f[1])]).collect();
    ManifoldMesh::try_from(TriangleMesh::new(positions, faces).unwrap()).unwrap()
}

fn quick() -> Settings {
    Settings { epochs: 30, samples: 300, precision: None, ..Settings::default() }
}

/// Compares what a block says of samples with the base mesh that training was given.
struct Witness {
    base: ManifoldMesh,
    to_box: Similarity,
    calls: AtomicUsize,
}

impl Term for Witness {
    fn name(&self) -> &str {
        "witness"
    }

    fn needs(&self) -> Needs {
        Needs::TANGENTS
    }

    fn accumulate(&self, block: &Block<'_>, _weight: f32, _gradients: &mut Gradients<'_>) -> f64 {
        self.calls.fetch_add(1, Ordering::Relaxed);
        let base = &self.base;
        let normalised = |p: DVec3| self.to_box.to_normalised(p).as_vec3();
        for i in 0..block.len() {
            let x = block.base[i];
            let near = |p: Vec3| assert!((p - x).length() < 1e-5, "{p} {x}");
            near(normalised(block.face_point(i).position(base)));
            near(Vec3::from([0, 1, 2].map(|c| {
                let coordinates: Vec<f32> = base.positions().iter().map(|&p| normalised(p)[c]).collect();
                block.interpolate(i, &coordinates)
            })));
            let [u, v] = block.frame(i);
            assert!(
                (u.length() - 1.0).abs() < 1e-4 && (v.length() - 1.0).abs() < 1e-4 && u.dot(v).abs() < 1e-4
            );
            let outward = base.face_normal(block.face_point(i).face).as_vec3();
            assert!((u.cross(v) - outward).length() < 1e-3);
            if block.epoch.number == 0 {
                // The field is still the identity.
                let [ju, jv] = block.tangents.map(|t| t[i]);
                assert!(
                    (ju - u).length() < 1e-4
                        && (jv - v).length() < 1e-4
                        && (block.images[i] - x).length() < 1e-5
                );
            }
        }
        0.0
    }
}

#[test]
fn terms_see_the_base_mesh_as_it_was_given() {
    let base = base();
    let witness = Arc::new(Witness {
        to_box: Similarity::from_bounds(&base.bounds()),
        base: base.clone(),
        calls: 0.into(),
    });
    let settings = Settings { epochs: 2, ..quick() };
    let mut trainer = Trainer::new(&Sphere::UNIT, &base, &settings).unwrap().with_term(1.0, witness.clone());
    // The order of the base mesh outlives a checkpoint.
    trainer.run_epoch().unwrap();
    let path = std::env::temp_dir().join(format!("ndf-terms-{}", std::process::id()));
    Checkpoint::from(trainer.checkpoint().unwrap()).write(&path).unwrap();
    let Ok(Checkpoint { learning: Learning::Network(checkpoint), .. }) = Checkpoint::read(&path) else {
        panic!("no network")
    };
    std::fs::remove_file(&path).unwrap();
    let before = witness.calls.load(Ordering::Relaxed);
    let mut resumed = Trainer::resumed(&Sphere::UNIT, *checkpoint).unwrap().with_term(1.0, witness.clone());
    resumed.run_epoch().unwrap();
    assert!(before > 0 && witness.calls.load(Ordering::Relaxed) > before);
}

/// ‖g(x)‖².
struct Shrink(&'static str);

impl Term for Shrink {
    fn name(&self) -> &str {
        "shrink"
    }

    fn accumulate(&self, block: &Block<'_>, weight: f32, gradients: &mut Gradients<'_>) -> f64 {
        let mut sum = 0.0;
        for (&y, dy) in block.images.iter().zip(gradients.images.iter_mut()) {
            sum += y.length_squared();
            *dy += 2.0 * weight * y;
        }
        f64::from(sum)
    }

    fn state(&self) -> ndf_train::serde_json::Value {
        self.0.into()
    }
}

#[test]
fn runs_are_resumed_with_the_terms_of_the_checkpoint_alone() {
    let pairs = [(DVec3::X, DVec3::Y)];
    let start = || Trainer::new(&Sphere::UNIT, &base(), &quick()).unwrap();
    let mut trainer = start().with_anchors(&pairs).with_term(0.5, Arc::new(Shrink("a")));
    (0..20).for_each(|_| {
        trainer.run_epoch().unwrap();
    });
    assert_eq!(
        trainer.term_means().iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(),
        ["projection", "cycle", "shrink", "anchors"]
    );
    let checkpoint = trainer.checkpoint().unwrap();
    let resumed = || Trainer::resumed(&Sphere::UNIT, checkpoint.clone()).unwrap();
    let refused = |mut trainer: Trainer<'_>| trainer.run_epoch().unwrap_err().to_string();
    for (trainer, said) in [
        (resumed(), "this run has projection, cycle"),
        (resumed().with_anchors(&pairs), "projection, cycle, anchors, shrink; this run has projection"),
        (resumed().with_anchors(&pairs).with_term(0.5, Arc::new(Shrink("b"))), "the term shrink"),
        (resumed().with_anchors(&pairs).with_term(0.6, Arc::new(Shrink("a"))), "the term shrink"),
        (
            resumed().with_anchors(&[(DVec3::X, DVec3::Z)]).with_term(0.5, Arc::new(Shrink("a"))),
            "the term anchors",
        ),
    ] {
        let refusal = refused(trainer);
        assert!(refusal.contains(said), "{refusal}");
    }
    let mut same = resumed().with_anchors(&pairs).with_term(0.5, Arc::new(Shrink("a")));
    let numbers = |trainer: &mut Trainer<'_>| {
        let (fit, _) = train(trainer, None, &NoProgress).unwrap();
        fit.field.network().unwrap().features().iter().map(|x| x.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(numbers(&mut same), numbers(&mut trainer));
    assert!(matches!(resumed().run_epoch(), Err(TrainError::OtherTerms { .. })));
}

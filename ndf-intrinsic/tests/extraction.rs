//! Extraction from fields: every guarantee, on closed and open bases, finer and coarser than the base.

#![allow(clippy::unwrap_used, reason = "these are tests")]

use ndf_core::NoProgress;
use ndf_intrinsic::{ExtractionError, ExtractionOptions, extract};
use ndf_mesh::shapes;
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_model::DisplacementField;
use ndf_model::FieldShape;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// A field that makes smooth waves of the base.
fn wavy(base: TriangleMesh, amplitude: f32) -> DisplacementField {
    let base = ManifoldMesh::try_from(base).unwrap();
    let field = DisplacementField::untrained(base, FieldShape::default(), 2).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let mut random = |n: usize| (0..n).map(|_| rng.random_range(-amplitude..amplitude)).collect::<Vec<f32>>();
    let (features, parameters) = (
        random(field.network().unwrap().features().len()),
        random(field.network().unwrap().mlp().parameters().len()),
    );
    field.with_parameters(features, parameters).unwrap()
}

#[test]
fn every_promise_is_kept() {
    for (name, base) in [
        ("sphere", shapes::icosphere(2)),
        ("torus", shapes::torus(24, 12, 1.0, 0.4)),
        ("plate", shapes::grid(6, 4)),
    ] {
        let field = wavy(base, 0.15);
        for h in [0.5, 0.1, 0.04] {
            let extraction = extract(&field, &ExtractionOptions::new(h), &NoProgress).unwrap();
            let report = extraction.report;
            eprintln!("{name}, h {h}: {report:?}");
            assert!(report.holds());
            assert_eq!(
                extraction.mesh.topology().euler_characteristic(),
                field.base().topology().euler_characteristic()
            );
            assert!(extraction.intrinsic.is_delaunay());
            assert_eq!(extraction.origins.len(), extraction.mesh.vertex_count());
            for (p, q) in extraction.mesh.positions().iter().zip(field.map(&extraction.origins)) {
                assert!(p.distance(q) < 1e-6, "vertices are images of their origins");
            }
            if h < 0.5 {
                assert!(report.delaunay_embedded_fraction > 0.999);
                assert!(report.min_angle.p5.to_degrees() > 30.0);
                assert!(report.longest_in_h < 1.7);
            }
        }
    }
}

#[test]
fn long_edges_make_meshes_coarser_than_the_base() {
    let field = wavy(shapes::icosphere(4), 0.05);
    let report = extract(&field, &ExtractionOptions::new(0.4), &NoProgress).unwrap().report;
    assert!(report.holds());
    assert!(report.faces < field.base().face_count() / 8, "{} faces", report.faces);
}

#[test]
fn the_same_field_gives_the_same_mesh_on_any_number_of_threads() {
    let field = wavy(shapes::icosphere(2), 0.15);
    let [a, b] = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| extract(&field, &ExtractionOptions::new(0.03), &NoProgress).unwrap())
    });
    assert_eq!(a.mesh.faces(), b.mesh.faces());
    assert_eq!(a.mesh.positions(), b.mesh.positions());
    assert_eq!(a.intrinsic.lengths(), b.intrinsic.lengths());
    assert_eq!(a.report, b.report);
}

#[test]
fn stretched_spots_leave_no_long_edges() {
    // Waves steeper than a fitted field is: chords see little of the base mesh' metric.
    for base in [shapes::icosphere(2), shapes::torus(24, 12, 1.0, 0.4)] {
        let report = extract(&wavy(base, 0.3), &ExtractionOptions::new(0.03), &NoProgress).unwrap().report;
        assert!(report.holds(), "{report:?}");
        eprintln!("{report:?}");
        assert!(report.longest_in_h < 2.0, "{report:?}");
    }
}

#[test]
fn absurd_lengths_are_refused() {
    let field = wavy(shapes::icosphere(1), 0.1);
    let error = |h: f64| {
        extract(&field, &ExtractionOptions { max_faces: 1000, ..ExtractionOptions::new(h) }, &NoProgress)
            .unwrap_err()
    };
    assert_eq!(error(-1.0), ExtractionError::EdgeLength(-1.0));
    assert!(matches!(error(f64::NAN), ExtractionError::EdgeLength(_)));
    for h in [1e-9, 1e-200, f64::MIN_POSITIVE] {
        assert_eq!(error(h), ExtractionError::TooManyFaces(1000));
    }
}

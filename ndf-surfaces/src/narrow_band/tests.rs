use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::LevelSetSurface;
use ndf_core::{Hint, NoProgress, Query};
use ndf_mesh::shapes;

/// A wavy torus that counts how often it is asked.
#[derive(Default)]
struct Wavy {
    values: AtomicUsize,
}

impl ImplicitField for Wavy {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        self.values.fetch_add(points.len(), Ordering::Relaxed);
        for (p, v) in points.iter().zip(values) {
            let waves = 0.01 * ((9.0 * p.x).sin() + (8.0 * p.y).sin() * (7.0 * p.z).cos());
            *v = DVec3::new(p.truncate().length() - 1.0, 0.0, p.z).length() - 0.4 + waves;
        }
    }
    fn bounds(&self) -> BoundingBox {
        BoundingBox { min: DVec3::new(-1.45, -1.45, -0.45), max: DVec3::new(1.45, 1.45, 0.45) }
    }
    fn level(&self) -> f64 {
        0.0
    }
    fn inside(&self) -> Inside {
        Inside::Below
    }
}

fn base() -> TriangleMesh {
    shapes::torus(60, 30, 1.0, 0.4)
}

fn band(options: &BandOptions) -> NarrowBand<Wavy> {
    NarrowBand::around(Wavy::default(), &base(), options, &NoProgress).unwrap()
}

fn usual() -> BandOptions {
    BandOptions::for_mesh(&base())
}

/// A band that only finds the level where the tolerance allows is a surface like any other, within that tolerance.
fn surface() -> LevelSetSurface<NarrowBand<Wavy>> {
    LevelSetSurface::new(band(&BandOptions { width: 0.12, ..usual() }))
}

ndf_core::surface_conformance!(cached, surface());

/// Points of the base mesh, a little off.
fn queries() -> Vec<Query> {
    let mesh = base();
    mesh.face_indices()
        .map(|f| {
            let [a, b, c] = mesh.corner_positions(f);
            let normal = Some(mesh.face_normal(f));
            Query { point: (a + b + c) / 3.0, normal, hint: Hint::NONE }
        })
        .collect()
}

#[test]
fn cached_feet_agree_with_true_ones_within_the_tolerance() {
    let truth = LevelSetSurface::new(Wavy::default());
    for tolerance in [1e-3, 1e-4, 1e-5] {
        let cached = LevelSetSurface::new(band(&BandOptions { tolerance, ..usual() }));
        assert_eq!(cached.field().report().unresolved, 0.0);
        let found = agreement(&cached, &truth, &queries());
        assert_eq!((found.feet, found.disagreeing), (base().face_count(), 0));
        assert!(found.rms < tolerance && found.max < 3.0 * tolerance, "{tolerance}: {found:?}");
    }
}

#[test]
fn finer_tolerances_take_more_cubes() {
    let cubes = |tolerance: f64| band(&BandOptions { tolerance, ..usual() }).report().cubes;
    assert!(cubes(1e-7) > 2 * cubes(1e-3));
}

#[test]
fn the_field_is_not_asked_again_in_the_band_and_answers_outside_it() {
    let band = band(&usual());
    let asked = band.field().values.load(Ordering::Relaxed);
    let near: Vec<DVec3> = queries().iter().map(|query| query.point).collect();
    let mut values = vec![0.0; near.len()];
    band.values(&near, &mut values);
    assert_eq!(band.field().values.load(Ordering::Relaxed), asked);
    let mut far = [0.0; 2];
    band.values(&[DVec3::ZERO, DVec3::splat(50.0)], &mut far);
    let mut truth = [0.0; 2];
    band.field().values(&[DVec3::ZERO, DVec3::splat(50.0)], &mut truth);
    assert_eq!(far, truth);
}

#[test]
fn cubes_stay_below_the_most() {
    let few = BandOptions { tolerance: 1e-9, most_cubes: 300_000, ..usual() };
    let band = band(&few);
    assert!(band.report().cubes <= few.most_cubes && band.report().unresolved > 0.0);
}

#[test]
fn values_that_are_not_finite_are_left_to_the_field() {
    struct Half;
    impl ImplicitField for Half {
        fn values(&self, points: &[DVec3], values: &mut [f64]) {
            points.iter().zip(values).for_each(|(p, v)| *v = if p.x < 0.2 { p.z } else { f64::NAN });
        }
        fn bounds(&self) -> BoundingBox {
            Wavy::default().bounds()
        }
        fn level(&self) -> f64 {
            0.0
        }
        fn inside(&self) -> Inside {
            Inside::Below
        }
    }
    let band = NarrowBand::around(Half, &base(), &usual(), &NoProgress).unwrap();
    let mut values = [0.0; 2];
    band.values(&[DVec3::new(-1.4, 0.0, 0.01), DVec3::new(1.4, 0.0, 0.01)], &mut values);
    assert!((values[0] - 0.01).abs() < 1e-7 && values[1].is_nan(), "{values:?}");
}

#[test]
fn meshes_without_extent_are_refused() {
    let refused = |mesh: &TriangleMesh, options: &BandOptions| {
        NarrowBand::around(Wavy::default(), mesh, options, &NoProgress).err()
    };
    assert_eq!(refused(&TriangleMesh::default(), &usual()), Some(BandError::Extent));
    let fine = BandOptions { coarsest: 1e-9, ..usual() };
    assert_eq!(refused(&base(), &fine), Some(BandError::Extent));
    let nowhere = base().map_positions(|_| DVec3::NAN);
    assert_eq!(refused(&nowhere, &usual()), Some(BandError::Extent));
}

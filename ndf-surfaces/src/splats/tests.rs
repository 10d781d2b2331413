//! From splats to densities and their level sets.

use ndf_core::{DVec3, ImplicitField};
use ndf_formats::splats::{Splat, parse_splats};
use ndf_mesh::shapes;
use ndf_testing::data_file;

use super::*;
use crate::LevelSetSurface;

fn real(name: &str) -> Option<Vec<Splat>> {
    let bytes = data_file(&format!("splat/{name}"))?;
    Some(parse_splats(&bytes).unwrap_or_else(|e| panic!("{name}: {e}")).1)
}

/// Flat splats on an icosphere.
fn ball() -> Vec<Splat> {
    let mesh = shapes::icosphere(4);
    mesh.positions()
        .iter()
        .map(|&p| {
            let turn = ndf_core::glam::DQuat::from_rotation_arc(DVec3::Z, p.normalize());
            Splat {
                center: p.as_vec3().as_dvec3().to_array(),
                scales: [0.04, 0.04, 0.001],
                rotation: [turn.w as f32, turn.x as f32, turn.y as f32, turn.z as f32],
                opacity: 0.9,
            }
        })
        .collect()
}

fn density() -> SplatDensity {
    SplatDensity::new(&ball(), &DensityOptions::default()).unwrap()
}

ndf_core::surface_conformance!(ball_of_splats, LevelSetSurface::new(density()));

#[test]
fn one_gaussian_is_its_formula() {
    let splat = Splat {
        center: [1.0, 2.0, 3.0],
        scales: [0.5, 0.3, 0.2],
        rotation: [0.8, 0.6, 0.0, 0.0],
        opacity: 0.7,
    };
    let options = DensityOptions { least_scale: 0.0, outliers: 0.0, ..DensityOptions::default() };
    // Two far corners make the box; they are too faint there to matter.
    let corner = |x: f64| Splat { center: [x, x, x], scales: [0.01; 3], ..splat };
    let density = SplatDensity::new(&[splat, corner(-9.0), corner(9.0)], &options).unwrap();
    let p = DVec3::new(1.2, 1.9, 3.1);
    let mut value = [0.0];
    density.values(&[p], &mut value);
    let turn = ndf_core::glam::DQuat::from_xyzw(0.6, 0.0, 0.0, 0.8);
    let u = turn.inverse() * (p - DVec3::new(1.0, 2.0, 3.0)) / DVec3::new(0.5, 0.3, 0.2);
    let expected = 0.7 * ((-0.5 * u.length_squared()).exp() - (-8.0_f64).exp());
    assert!((value[0] - expected).abs() < 1e-6, "{} {expected}", value[0]);
}

#[test]
fn splats_on_a_sphere_make_a_sphere() {
    let density = density();
    assert_eq!(density.report(), SplatReport { kept: 2562, merged: 2562, ..SplatReport::default() });
    let found = mean_radius(&density);
    // On the slope of the sheet, where the offset says.
    assert!((found - 1.0 - density.offset()).abs() < 0.1 * density.offset(), "{found}, {}", density.offset());
}

#[test]
fn the_level_of_an_even_sheet_does_not_depend_on_how_many_splats_overlap() {
    let offset = |copies: usize| {
        SplatDensity::new(&ball().repeat(copies), &DensityOptions::default()).unwrap().offset()
    };
    let sigma = density().bounds().diagonal() / 200.0;
    assert!((offset(5) - offset(1)).abs() < 1e-6 * sigma);
    assert!(offset(1) < 2.0 * sigma, "{} of {sigma}", offset(1));
}

/// Mean radius at which rays from outside meet the level.
fn mean_radius(density: &SplatDensity) -> f64 {
    let directions = shapes::icosphere(2);
    let radius = |&n: &DVec3| {
        let (mut inner, mut outer) = (1.0, 1.2);
        for _ in 0..40 {
            let middle = 0.5 * (inner + outer);
            let mut value = [0.0];
            density.values(&[middle * n.normalize()], &mut value);
            *(if value[0] > density.level() { &mut inner } else { &mut outer }) = middle;
        }
        inner
    };
    directions.positions().iter().map(radius).sum::<f64>() / directions.vertex_count() as f64
}

#[test]
fn floaters_faint_and_unsound_splats_are_left_out() {
    let mut splats = ball();
    let one = splats[0];
    splats.push(Splat { center: [500.0, 0.0, 0.0], ..one });
    splats.push(Splat { scales: [3.0; 3], ..one });
    splats.push(Splat { opacity: 0.01, ..one });
    splats.push(Splat { center: [f64::NAN, 0.0, 0.0], ..one });
    splats.push(Splat { rotation: [0.0; 4], ..one });
    let density = SplatDensity::new(&splats, &DensityOptions::default()).unwrap();
    assert_eq!(density.report(), SplatReport { kept: 2562, unsound: 2, faint: 1, floaters: 2, merged: 2562 });
    assert!(density.bounds().diagonal() < 4.5);
    assert!(SplatDensity::new(&splats[2564..], &DensityOptions::default()).is_err());
}

#[test]
fn real_objects_have_a_level_set() {
    for name in [
        "donut_fused_inria.ply",
        "chair_nerfsynth.splat",
        "biker.compressed.ply",
        "kacytran_iter7000_inria.ply",
    ] {
        let Some(splats) = real(name) else { continue };
        let density = SplatDensity::new(&splats, &DensityOptions::default()).unwrap();
        assert!(density.level() > 0.0 && density.level().is_finite());
    }
}

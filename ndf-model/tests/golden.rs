//! Files of every version of the format that was released are read, and stand for the surface that they stood for.
//!
//! `golden/` holds one model in versions 1 and 2, the latter with a scalar field, and in version 3 one of levels with
//! creases and one of levels with scalars on levels.
//! Their points were evaluated by `docs/read_ndf.py`, which shares no code with this crate.

#![allow(clippy::unwrap_used, reason = "all of this file is test code")]

use std::path::Path;

use ndf_core::DVec3;
use ndf_mesh::{Face, FacePoint};
use ndf_model::Model;

fn golden(version: u32) -> Model {
    read(&format!("sphere_version_{version}.ndf"))
}

fn read(name: &str) -> Model {
    Model::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name)).unwrap()
}

/// Points of the base mesh, with their images and scalars.
fn points() -> Vec<(FacePoint, DVec3, f32)> {
    let lines = include_str!("golden/points.txt").lines().filter(|line| !line.starts_with('#'));
    lines
        .map(|line| {
            let (face, numbers) = line.split_once(' ').unwrap();
            let n: Vec<f64> = numbers.split(' ').map(|word| word.parse().unwrap()).collect();
            let point = FacePoint { face: Face(face.parse().unwrap()), barycentric: [n[0], n[1], n[2]] };
            (point, DVec3::new(n[3], n[4], n[5]), n[6] as f32)
        })
        .collect()
}

#[test]
fn every_version_evaluates_to_the_same_points() {
    let truth = points();
    let samples: Vec<FacePoint> = truth.iter().map(|(sample, ..)| *sample).collect();
    for version in [1, 2] {
        let model = golden(version);
        assert_eq!(model.field.base().face_count(), truth.len());
        for (image, (sample, point, _)) in model.field.map(&samples).into_iter().zip(&truth) {
            let found = model.similarity.to_world(image);
            assert!(found.distance(*point) < 1e-6, "version {version}, {sample:?}: {found} {point}");
        }
    }
    let model = golden(2);
    let scalars = model.scalars[0].columns(model.field.base(), &samples);
    assert_eq!(scalars[0].name, "distance");
    for (found, (sample, _, value)) in scalars[0].values.iter().zip(&truth) {
        assert!((found - value).abs() < 1e-5, "{sample:?}: {found} {value}");
    }
}

/// What is read is written as it was found: a file of version 2 byte by byte, one of version 1 in version 2.
#[test]
fn files_are_written_again_as_they_were() {
    let file = include_bytes!("golden/sphere_version_2.ndf");
    assert_eq!(golden(2).to_bytes(), file);
    let [old, new] = [1, 2].map(|version| Model { scalars: Vec::new(), ..golden(version) });
    assert_eq!(old.to_bytes(), new.to_bytes());
}

#[test]
fn levels_evaluate_to_the_same_points() {
    let model = read("levels_version_3.ndf");
    assert_eq!(model.to_bytes(), include_bytes!("golden/levels_version_3.ndf"));
    let lines = include_str!("golden/level_points.txt").lines().filter(|line| !line.starts_with('#'));
    for line in lines {
        let n: Vec<f64> = line.split(' ').map(|word| word.parse().unwrap()).collect();
        let sample = FacePoint { face: Face(n[0] as u32), barycentric: [n[1], n[2], n[3]] };
        let found = model.similarity.to_world(model.field.map(&[sample])[0]);
        let point = DVec3::new(n[4], n[5], n[6]);
        assert!(found.distance(point) < 1e-9, "{sample:?}: {found} {point}");
    }
}

#[test]
fn scalars_on_levels_evaluate_to_the_same_values() {
    let model = read("scalars_version_3.ndf");
    assert_eq!(model.to_bytes(), include_bytes!("golden/scalars_version_3.ndf"));
    let lines = include_str!("golden/scalar_points.txt").lines().filter(|line| !line.starts_with('#'));
    for line in lines {
        let n: Vec<f64> = line.split(' ').map(|word| word.parse().unwrap()).collect();
        let sample = FacePoint { face: Face(n[0] as u32), barycentric: [n[1], n[2], n[3]] };
        let found = model.scalars[0].evaluate(model.field.base(), &[sample]);
        for (found, truth) in found.iter().zip(&n[7..]) {
            assert!((f64::from(*found) - truth).abs() < 1e-5, "{sample:?}: {found} {truth}");
        }
    }
}

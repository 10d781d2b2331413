//! Agreement with another implementation of MMP on the meshes of the optional data folder.
//!
//! `NDF_DATA` names the folder, `../shared/data` beside the workspace unless set; `peers/reference.json` lies
//! next to it. Reference values: exact distances from vertex 0.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

mod common;

use std::path::{Path, PathBuf};

use common::subdivided;
use ndf_core::NoProgress;
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::repair;
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleMesh};

fn data_folder() -> PathBuf {
    std::env::var_os("NDF_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from)
}

/// The mesh of a file as the reference has it: STL welded by exact position.
fn read(path: &Path) -> Option<TriangleMesh> {
    let mesh = ndf_mesh::io::read_mesh(path).ok()?.mesh;
    let stl = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("stl"));
    Some(if stl { repair::welded(&mesh, 0.0) } else { mesh })
}

#[test]
fn distances_agree_with_the_reference_on_every_mesh() {
    let folder = data_folder();
    let reference = folder.join("../peers/reference.json");
    let Ok(text) = std::fs::read_to_string(&reference) else {
        println!("skipped: no {}", reference.display());
        return;
    };
    let reference: serde_json::Value = serde_json::from_str(&text).unwrap();
    let mut worst: f64 = 0.0;
    for (name, entry) in reference.as_object().unwrap() {
        let expected = &entry["geodesic_from_vertex_0"];
        let Some(mesh) = read(&folder.join("mesh").join(name)) else {
            println!("{name}: skipped, cannot be read");
            continue;
        };
        if expected.is_null() {
            println!("{name}: skipped, no reference values");
            continue;
        }
        let mesh = match ManifoldMesh::try_from(mesh) {
            Ok(mesh) => IntrinsicMesh::of_mesh(&mesh),
            Err(error) => {
                println!("{name}: skipped, {error}");
                continue;
            }
        };
        let geodesics =
            exact_distances(&mesh, &[SurfacePoint::Vertex(0)], &ExactOptions::default(), &NoProgress)
                .unwrap();
        let d = geodesics.distances();
        let finite = || d.iter().copied().filter(|d| d.is_finite());
        let max = finite().fold(0.0, f64::max);
        let mut error = (max / expected["max"].as_f64().unwrap() - 1.0).abs();
        error = error.max((finite().sum::<f64>() / expected["sum"].as_f64().unwrap() - 1.0).abs());
        for (i, value) in expected["at_every_997th_vertex"].as_array().unwrap().iter().enumerate() {
            if let Some(value) = value.as_f64() {
                error = error.max((d[997 * i] - value).abs() / max);
            }
        }
        println!(
            "{name}: {} vertices, {error:.1e} unreached {} (theirs {})",
            mesh.vertex_count(),
            geodesics.unreached(),
            expected["unreached"]
        );
        worst = worst.max(error);
    }
    assert!(worst < 1e-8, "{worst:e}");
}

#[test]
fn subdivision_changes_no_distance() {
    let Ok(entries) = std::fs::read_dir(data_folder().join("mesh")) else {
        println!("skipped: no {}", data_folder().join("mesh").display());
        return;
    };
    let mut paths: Vec<PathBuf> = entries.map(|e| e.unwrap().path()).collect();
    paths.sort();
    let mut worst: f64 = 0.0;
    for path in paths {
        let Some(mesh) = read(&path) else { continue };
        if mesh.face_count() > 60_000 {
            continue;
        }
        let fine = subdivided(&mesh);
        let Ok(fine) = ManifoldMesh::try_from(fine) else { continue };
        let Ok(mesh) = ManifoldMesh::try_from(mesh) else { continue };
        let (mesh, fine) = (IntrinsicMesh::of_mesh(&mesh), IntrinsicMesh::of_mesh(&fine));
        let run = |m| {
            exact_distances(m, &[SurfacePoint::Vertex(0)], &ExactOptions::default(), &NoProgress).unwrap()
        };
        let (coarse, fine) = (run(&mesh), run(&fine));
        let error = coarse
            .distances()
            .iter()
            .zip(fine.distances())
            .map(|(a, b)| (a - b) / a.max(*b).max(1e-300))
            .fold(0.0, |m: f64, e| if e.abs() > m.abs() { e } else { m });
        println!("{}: {error:.1e}", path.display());
        worst = worst.max(error.abs());
    }
    assert!(worst < 1e-9, "{worst:e}");
}

//! Agreement with other implementations: always on meshes made by formulas, with the values of `peers/reference.json`, and
//! on the meshes of the optional data folder.
//!
//! `NDF_DATA` names the folder, `../shared/data` beside the workspace unless set; another `peers/reference.json` lies
//! next to it. Reference values: exact distances from vertex 0.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

#[path = "../../peers/meshes.rs"]
mod meshes;

mod common;

use std::path::{Path, PathBuf};

use common::subdivided;
use ndf_core::NoProgress;
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::repair;
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleMesh, Vertex};

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

/// Compares the distances that `find` gives for each set of sources of the reference with those of a `kind` there.
fn compare(
    named: &[(&str, TriangleMesh)],
    kind: &str,
    tolerance: f64,
    find: impl Fn(&IntrinsicMesh, &[SurfacePoint]) -> Vec<f64>,
) {
    let reference = meshes::reference();
    let stride = reference["stride"].as_u64().unwrap() as usize;
    for (name, mesh) in named {
        let mesh = IntrinsicMesh::from_mesh(&ManifoldMesh::try_from(mesh.clone()).unwrap());
        for entry in reference[name]["distances"].as_array().unwrap() {
            let sources: Vec<SurfacePoint> = meshes::numbers(&entry["sources"])
                .into_iter()
                .map(|v| SurfacePoint::Vertex(Vertex(v as u32)))
                .collect();
            let found = find(&mesh, &sources);
            let expected = &entry[kind];
            let max = expected["max"].as_f64().unwrap();
            let mut error = (found.iter().copied().fold(0.0, f64::max) - max).abs();
            if let Some(sum) = expected["sum"].as_f64() {
                error = error.max((found.iter().sum::<f64>() - sum).abs() / found.len() as f64);
            }
            for (i, value) in meshes::numbers(&expected["at"]).into_iter().enumerate() {
                error = error.max((found[stride * i] - value).abs());
            }
            println!("{name} {kind}: differs by {:.1e}", error / max);
            assert!(error <= tolerance * max, "{name}: {error:e}");
        }
    }
}

#[test]
fn exact_distances_agree_with_pygeodesic() {
    let named = [("torus", meshes::torus()), ("sheet", meshes::sheet())];
    compare(&named, "exact", 1e-12, |mesh, sources| {
        exact_distances(mesh, sources, &ExactOptions::default(), &NoProgress).unwrap().distances().to_vec()
    });
}

#[cfg(feature = "heat")]
#[test]
fn heat_distances_agree_with_geometry_central() {
    use ndf_geodesic::HeatSolver;

    // On a closed surface: at a boundary, their tufted cover is another surface than ours. The two agree to 2e-5, far
    // below the 1e-2 by which either misses exact distances.
    compare(&[("torus", meshes::torus())], "heat", 1e-4, |mesh, sources| {
        HeatSolver::new(mesh).unwrap().distances(sources).unwrap().values
    });
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
            Ok(mesh) => IntrinsicMesh::from_mesh(&mesh),
            Err(error) => {
                println!("{name}: skipped, {error}");
                continue;
            }
        };
        let geodesics =
            exact_distances(&mesh, &[SurfacePoint::Vertex(Vertex(0))], &ExactOptions::default(), &NoProgress)
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
        let (mesh, fine) = (IntrinsicMesh::from_mesh(&mesh), IntrinsicMesh::from_mesh(&fine));
        let run = |m| {
            exact_distances(m, &[SurfacePoint::Vertex(Vertex(0))], &ExactOptions::default(), &NoProgress)
                .unwrap()
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

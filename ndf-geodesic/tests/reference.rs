//! Agreement with another implementation of MMP on the meshes of the optional data folder.
//!
//! `NDF_DATA` names the folder, `../shared/data` beside the workspace unless set; `peers/reference.json` lies
//! next to it. Reference values: exact distances from vertex 0.

#![allow(clippy::unwrap_used, clippy::print_stdout)]

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use ndf_core::{DVec3, ManifoldMesh, SurfacePoint, TriangleMesh};
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;

fn data_folder() -> PathBuf {
    std::env::var_os("NDF_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from)
}

/// Vertices at the same position become one, in order of first appearance; faces keep their order.
fn welded(mesh: &TriangleMesh) -> TriangleMesh {
    let mut positions: Vec<DVec3> = Vec::new();
    let mut index = HashMap::new();
    let map: Vec<u32> = mesh
        .positions()
        .iter()
        .map(|p| {
            let key = p.to_array().map(|x| (x + 0.0).to_bits());
            *index.entry(key).or_insert_with(|| {
                positions.push(*p);
                positions.len() as u32 - 1
            })
        })
        .collect();
    let faces = mesh.faces().iter().map(|f| f.map(|v| map[v as usize])).collect();
    TriangleMesh::new(positions, faces).unwrap()
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
        let Ok(file) = ndf_core::io::read_mesh(folder.join("mesh").join(name)) else {
            println!("{name}: skipped, cannot be read");
            continue;
        };
        let mesh = if name.to_lowercase().ends_with("stl") { welded(&file.mesh) } else { file.mesh };
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
        let geodesics = exact_distances(&mesh, &[SurfacePoint::Vertex(0)], &ExactOptions::default()).unwrap();
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

/// Every face split into four by its edges' midpoints: the same surface with many flat vertices.
fn subdivided(mesh: &TriangleMesh) -> TriangleMesh {
    let mut positions = mesh.positions().to_vec();
    let mut midpoints = HashMap::new();
    let mut midpoint = |a: u32, b: u32| {
        *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
            positions.push(positions[a as usize].midpoint(positions[b as usize]));
            positions.len() as u32 - 1
        })
    };
    let mut faces = Vec::new();
    for &[a, b, c] in mesh.faces() {
        let (ab, bc, ca) = (midpoint(a, b), midpoint(b, c), midpoint(c, a));
        faces.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    TriangleMesh::new(positions, faces).unwrap()
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
        let name = path.file_name().unwrap().to_string_lossy().to_lowercase();
        let Ok(file) = ndf_core::io::read_mesh(&path) else { continue };
        let mesh = if name.ends_with("stl") { welded(&file.mesh) } else { file.mesh };
        if mesh.face_count() > 60_000 {
            continue;
        }
        let fine = subdivided(&mesh);
        let Ok(fine) = ManifoldMesh::try_from(fine) else { continue };
        let Ok(mesh) = ManifoldMesh::try_from(mesh) else { continue };
        let (mesh, fine) = (IntrinsicMesh::of_mesh(&mesh), IntrinsicMesh::of_mesh(&fine));
        let run = |m| exact_distances(m, &[SurfacePoint::Vertex(0)], &ExactOptions::default()).unwrap();
        let (coarse, fine) = (run(&mesh), run(&fine));
        let error = coarse
            .distances()
            .iter()
            .zip(fine.distances())
            .map(|(a, b)| (a - b) / a.max(*b).max(1e-300))
            .fold(0.0, |m: f64, e| if e.abs() > m.abs() { e } else { m });
        println!("{name}: {error:.1e}");
        worst = worst.max(error.abs());
    }
    assert!(worst < 1e-9, "{worst:e}");
}

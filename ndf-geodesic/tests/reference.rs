//! Agreement with another implementation of MMP on the meshes of the optional data folder.
//!
//! `NDF_DATA` names the folder, `../shared/data` beside the workspace unless set; `peers/reference.json` lies next to
//! it. Reference values: exact distances from vertex 0.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use ndf_core::{DVec3, ManifoldMesh, SurfacePoint, TriangleMesh};
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;

fn data_folder() -> PathBuf {
    std::env::var_os("NDF_DATA").map_or_else(
        || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
        PathBuf::from,
    )
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
        if error > 1e-12 { println!("max {:e} sum {:e}", max - expected["max"].as_f64().unwrap(), finite().sum::<f64>() - expected["sum"].as_f64().unwrap());
        for (i, value) in expected["at_every_997th_vertex"].as_array().unwrap().iter().enumerate() { println!("  {i} {:e}", d[997*i] - value.as_f64().unwrap()) } }
        println!("{name}: {} vertices, {error:.1e} unreached {} (theirs {})", mesh.vertex_count(), geodesics.unreached(), expected["unreached"]);
        worst = worst.max(error);
    }
    assert!(worst < 1e-8, "{worst:e}");
}

//! Decimated meshes, compressed by Draco.

use std::fs;
use std::path::Path;

use ndf_core::{DVec3, NoProgress};
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_meshing::{DecimationOptions, decimate};
use serde_json::Value;

use super::RivalRow;
use super::reference::{Errors, Reference};
use crate::performance::process::{PythonPeer, Scratch};
use crate::rows::Rows;

/// Faces of the decimated meshes; those of more faces than the mesh has are left out.
const FACES: [usize; 7] = [500, 1_000, 2_000, 4_000, 8_000, 16_000, 32_000];

pub(super) fn key(mesh: &str, faces: usize) -> String {
    format!("{mesh} {faces}")
}

/// Measures decimated meshes, or those that are not there yet.
pub(super) fn measured(
    name: &str,
    reference: &Reference,
    python: &Path,
    missing: bool,
    rows: &mut Rows<RivalRow>,
) -> Result<(), String> {
    let sizes = FACES.into_iter().filter(|&faces| faces < reference.mesh.face_count());
    let wanted: Vec<usize> = sizes.filter(|&faces| !(missing && rows.contains(&key(name, faces)))).collect();
    if wanted.is_empty() {
        return Ok(());
    }
    let scratch = Scratch::new()?;
    let mut draco = PythonPeer::start(python, "draco.py", &[scratch.path().display().to_string()])?;
    for faces in wanted {
        let mesh = decimate(&reference.mesh, &DecimationOptions::to_faces(faces), &NoProgress).mesh;
        scratch.write("mesh.f64", mesh.positions().iter().flat_map(DVec3::to_array).map(f64::to_le_bytes))?;
        scratch.write("mesh.u32", mesh.faces().iter().flatten().map(|v| v.to_le_bytes()))?;
        let sizes = draco.ask("mesh")?;
        let size = |key: &str| {
            let size = sizes.get(key).and_then(Value::as_u64).ok_or_else(|| format!("draco.py: no {key}"))?;
            Ok::<usize, String>(size as usize)
        };
        // What is compared is what comes out of the compressor, where that is still a manifold.
        let decoded = read_raw(scratch.path()).and_then(|mesh| ManifoldMesh::try_from(mesh).ok());
        let Errors { mean, max, geodesic, eigenvalues } =
            reference.errors(decoded.as_ref().unwrap_or(&mesh))?;
        let row = RivalRow {
            mesh: name.to_owned(),
            faces,
            edgebreaker: size("edgebreaker")?,
            sequential: size("sequential")?,
            plain: plain(&mesh).round() as usize,
            mean,
            max,
            geodesic,
            eigenvalues,
        };
        eprintln!("{row:?}");
        rows.put(row)?;
    }
    Ok(())
}

/// Bytes of a plain mesh (supplement, §2.3): 96 bits a vertex, 3 log₂|V| a face.
fn plain(mesh: &ManifoldMesh) -> f64 {
    let (vertices, faces) = (mesh.vertex_count() as f64, mesh.face_count() as f64);
    (32.0 * 3.0 * vertices + 3.0 * faces * vertices.log2()) / 8.0
}

fn read_raw(folder: &Path) -> Option<TriangleMesh> {
    let numbers = |name: &str| fs::read(folder.join(name)).ok();
    let positions = numbers("mesh.decoded.f64")?;
    let positions: Vec<f64> = positions.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
    let faces = numbers("mesh.decoded.u32")?;
    let faces: Vec<u32> = faces.as_chunks().0.iter().map(|b| u32::from_le_bytes(*b)).collect();
    let positions = positions.as_chunks().0.iter().map(|p: &[f64; 3]| DVec3::from_array(*p)).collect();
    TriangleMesh::new(positions, faces.as_chunks().0.to_vec()).ok()
}

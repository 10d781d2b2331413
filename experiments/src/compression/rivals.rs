//! Coarse meshes in few bytes: decimated meshes and base meshes, compressed by Draco, and base meshes in the file of a
//! model that has nothing else.

use std::ops::RangeInclusive;
use std::path::Path;

use ndf::{ModelExt, Opened, RepairOptions, Triangulated};
use ndf_core::NoProgress;
use ndf_mesh::subdivision::Creases;
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_meshing::{BaseMeshOptions, DecimationOptions, decimate};
use ndf_model::levels::Levels;
use ndf_model::{DisplacementField, Model, Similarity};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::CUBE;
use super::reference::{Errors, Reference};
use crate::performance::process::{PythonPeer, Scratch};
use crate::rows::{Row, Rows};

/// Faces of the meshes; those of more faces than the input has are left out.
const FACES: [usize; 7] = [500, 1_000, 2_000, 4_000, 8_000, 16_000, 32_000];

/// Draco's best level.
const DRACO_LEVEL: u32 = 10;

/// The faces that a cube needs.
const CUBE_FACES: usize = 12;

/// How a mesh is made of the input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Source {
    /// Decimated by fast-simplification.
    FastSimplification,
    /// Decimated by ndf-meshing, or the input itself.
    Decimated,
    /// As the base mesh of a model: decimated and fitted.
    Base,
}

/// How a mesh is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Coder {
    Draco,
    Ndf,
}

/// A mesh that is to be measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Job {
    source: Source,
    /// Faces that are asked for.
    faces: usize,
    coder: Coder,
    /// The longest side of the box has so many bits.
    bits: u32,
}

impl Job {
    pub(super) fn key(&self, mesh: &str) -> String {
        format!("{mesh} {self:?}")
    }
}

/// A mesh that comes out of a file, its bytes, and its errors as shares of 1.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct RivalRow {
    pub(super) mesh: String,
    pub(super) source: Source,
    faces: usize,
    pub(super) coder: Coder,
    bits: u32,
    decoded_faces: usize,
    pub(super) bytes: usize,
    pub(super) mean: f64,
    max: f64,
    normal_degrees: f64,
    area: f64,
    flipped: f64,
    pub(super) geodesic: f64,
    pub(super) eigenvalues: f64,
    /// With all lengths multiplied by one number, which makes the area right.
    pub(super) geodesic_corrected: f64,
    pub(super) eigenvalues_corrected: f64,
}

impl Row for RivalRow {
    fn key(&self) -> String {
        let Self { source, faces, coder, bits, .. } = *self;
        Job { source, faces, coder, bits }.key(&self.mesh)
    }
}

/// What there is to measure beside models of a mesh.
pub(super) fn jobs(name: &str, mesh: &ManifoldMesh) -> Vec<Job> {
    let all = mesh.face_count();
    let mut jobs = Vec::new();
    for source in [Source::FastSimplification, Source::Decimated, Source::Base] {
        let coders: &[Coder] =
            if source == Source::Base { &[Coder::Draco, Coder::Ndf] } else { &[Coder::Draco] };
        let mut sizes: Vec<usize> = FACES.into_iter().filter(|&faces| faces < all).collect();
        if source == Source::Decimated && all <= FACES[FACES.len() - 1] {
            sizes.push(all);
        }
        if name == CUBE {
            sizes.insert(0, CUBE_FACES);
        }
        for faces in sizes {
            for &coder in coders {
                jobs.extend(bits(faces).map(|bits| Job { source, faces, coder, bits }));
            }
        }
    }
    jobs
}

/// The bits that suit meshes of so many faces: the more there are, the finer their grid.
fn bits(faces: usize) -> RangeInclusive<u32> {
    let least = 7 + [2_000, 4_000, 8_000].into_iter().filter(|&few| faces > few).count() as u32;
    least..=least + 3
}

/// Measures meshes.
pub(super) fn measure(
    name: &str,
    opened: &Opened,
    reference: &Reference,
    python: &Path,
    jobs: &[Job],
    rows: &mut Rows<RivalRow>,
) -> Result<(), String> {
    if jobs.is_empty() {
        return Ok(());
    }
    let scratch = Scratch::new()?;
    let mut draco = PythonPeer::start(python, "draco.py", &[scratch.path().display().to_string()])?;
    scratch.write_mesh("input", &reference.mesh)?;
    for group in jobs.chunk_by(|a, b| (a.source, a.faces) == (b.source, b.faces)) {
        let Job { source, faces, .. } = group[0];
        let mesh = match source {
            Source::FastSimplification => {
                draco.ask(&format!("simplify input mesh {faces}"))?;
                scratch.read_mesh("mesh")?
            }
            Source::Decimated => {
                let options = DecimationOptions::to_faces(faces);
                decimate(&reference.mesh, &options, &NoProgress).mesh.into_triangle_mesh()
            }
            Source::Base => {
                let options = BaseMeshOptions { faces, ..BaseMeshOptions::default() };
                let (base, _) = opened.base_mesh(&options, &NoProgress).map_err(|e| e.to_string())?;
                base.mesh.into_triangle_mesh()
            }
        };
        scratch.write_mesh("mesh", &mesh)?;
        for job in group {
            let (bytes, decoded) = match job.coder {
                Coder::Draco => {
                    let answer = draco.ask(&format!("compress mesh decoded {} {DRACO_LEVEL}", job.bits))?;
                    let bytes = answer.get("bytes").and_then(Value::as_u64).ok_or("draco.py: no bytes")?;
                    (bytes as usize, scratch.read_mesh("decoded")?)
                }
                Coder::Ndf => as_model(&mesh, job.bits)?,
            };
            // What is compared is what comes out of the compressor. Decimated meshes may touch themselves.
            let decoded =
                Triangulated::from_mesh(decoded, &RepairOptions::default()).map_err(|e| e.to_string())?;
            let row = decoded.manifold().map_err(ToString::to_string).and_then(|decoded| {
                let errors = reference.errors(decoded, reference.factors(decoded))?;
                Ok(row(name, *job, decoded.face_count(), bytes, &errors))
            });
            let row = match row {
                Ok(row) => row,
                Err(error) => {
                    eprintln!("{name}: {job:?} is left out: {error}");
                    continue;
                }
            };
            eprintln!("{row:?}");
            rows.put(row)?;
        }
    }
    Ok(())
}

fn row(name: &str, job: Job, decoded_faces: usize, bytes: usize, errors: &Errors) -> RivalRow {
    let Job { source, faces, coder, bits } = job;
    let Errors { mean, max, normal_degrees, area, flipped, .. } = *errors;
    let [geodesic, geodesic_corrected] = errors.geodesic;
    let [eigenvalues, eigenvalues_corrected] = errors.eigenvalues;
    RivalRow {
        mesh: name.to_owned(),
        source,
        faces,
        coder,
        bits,
        decoded_faces,
        bytes,
        mean,
        max,
        normal_degrees,
        area,
        flipped,
        geodesic,
        eigenvalues,
        geodesic_corrected,
        eigenvalues_corrected,
    }
}

/// The bytes of a model that is this mesh and nothing else, and the mesh that they hold: one of levels that has none, and
/// creases everywhere.
fn as_model(mesh: &TriangleMesh, bits: u32) -> Result<(usize, TriangleMesh), String> {
    let mesh = ManifoldMesh::try_from(mesh.clone()).map_err(|e| e.to_string())?;
    let similarity = Similarity::from_bounds(&mesh.bounds());
    // The ends of the longest side are on the grid, which has its origin in the middle of the box.
    let half = 0.5 * similarity.length_to_normalised(mesh.bounds().extent().max_element());
    let spacing = (half / f64::from((1 << (bits - 1)) - 1)) as f32;
    let integer = |x: f64| (x / f64::from(spacing)).round() as i32;
    let control =
        mesh.positions().iter().map(|&p| similarity.to_normalised(p).to_array().map(integer)).collect();
    let levels = Levels { spacing, control, creases: Creases::everywhere(&mesh), levels: Vec::new() };
    let field = DisplacementField::levelled(&mesh, levels).map_err(|e| e.to_string())?;
    let model = Model { field, similarity, metric: None, scalars: Vec::new(), provenance: String::new() };
    let bytes = model.to_bytes();
    let read = Model::from_bytes(&bytes).map_err(|e| e.to_string())?;
    Ok((bytes.len(), read.base_in_world().into_triangle_mesh()))
}

#[cfg(test)]
mod tests {
    use ndf_mesh::shapes;

    use super::*;

    #[test]
    fn a_mesh_on_the_grid_comes_out_as_it_went_in() {
        let cube = shapes::cube(2);
        let (bytes, read) = as_model(&cube, 8).unwrap();
        assert!(bytes < 300, "{bytes}");
        assert_eq!((read.vertex_count(), read.face_count()), (cube.vertex_count(), cube.face_count()));
        assert!((read.area() - cube.area()).abs() < 1e-5);
    }
}

//! Methods that compress meshes (supplement, §2.3 and Fig. 10; §2.5 and Fig. 19), beside models.

use std::collections::HashMap;
use std::path::Path;

use ndf_baselines::{
    Micromesh, MicromeshOptions, NeuralGeometryField, NgfOptions, SmsError, SmsOptions,
    SpectralSimplification, micromesh,
};
use ndf_core::NoProgress;
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_meshing::{DecimationOptions, decimate};
use serde_json::Value;

use super::isosurfacing::{first_models, other_models, ours};
use super::measuring::{Made, measured, repeated};
use super::row::Run;
use super::truth::{Parts, Subject, largest_component};
use super::{Runs, Setup};
use crate::performance::process::{PythonPeer, Scratch, timed};

pub(super) const SMS: &str = "SMS";
pub(super) const NGF: &str = "NGF";
pub(super) const MICROMESH: &str = "micromesh";
pub(super) const EDGEBREAKER: &str = "Draco EB";
pub(super) const SEQUENTIAL: &str = "Draco MS";

/// Steps along the sides of quadrilaterals of neural geometry fields: the finest that they are learned on.
const NGF_STEPS: usize = 16;
/// Compression levels of Draco: the supplement's for Edgebreaker, and the one with which connectivity is sequential.
const LEVELS: [(&str, u32); 2] = [(EDGEBREAKER, 7), (SEQUENTIAL, 0)];

/// Bytes of a plain mesh (supplement, §2.3).
fn plain_bytes(mesh: &TriangleMesh) -> usize {
    let (vertices, faces) = (mesh.vertex_count() as f64, mesh.face_count() as f64);
    ((32.0 * 3.0 * vertices + 3.0 * faces * vertices.log2()) / 8.0).ceil() as usize
}

/// Models and what they are compared with.
pub(super) fn run(subject: &Subject<'_>, setup: &Setup, runs: &mut Runs) -> Result<(), String> {
    ours(subject, setup, &first_models(setup), runs)?;
    rivals(subject, setup, runs)?;
    ours(subject, setup, &other_models(subject, setup), runs)
}

/// Micromeshes, spectral simplification, and neural geometry fields.
pub(super) fn rivals(subject: &Subject<'_>, setup: &Setup, runs: &mut Runs) -> Result<(), String> {
    let scale = &setup.scale;
    for &(base_faces, micro_faces) in scale.micromeshes {
        let setting = format!("{base_faces} faces, {micro_faces} micro-faces");
        let options = MicromeshOptions { base_faces, micro_faces: Some(micro_faces) };
        let make = |parts: &Parts| {
            let (making, found) = timed(|| micromesh(&parts.isosurface, &options, &NoProgress));
            let bytes = found.map_err(|e| e.to_string())?.to_bytes();
            let (decoding, mesh) =
                repeated(scale.repeats, || Micromesh::from_bytes(&bytes).map(|found| found.tessellated()));
            Ok(Decoded { mesh: mesh.map_err(|e| e.to_string())?, bytes: bytes.len(), making, decoding })
        };
        of_file(subject, setup, (MICROMESH, &setting), runs, make)?;
    }
    for &quads in scale.ngf_quads {
        let setting = format!("{quads} quadrilaterals");
        let make = |parts: &Parts| {
            let options = NgfOptions { iterations: scale.ngf_iterations, ..NgfOptions::with_quads(quads) };
            let (making, found) =
                timed(|| NeuralGeometryField::learn(&parts.isosurface, &options, &NoProgress));
            let bytes = found.map_err(|e| e.to_string())?.field.to_bytes();
            let (decoding, mesh) = repeated(scale.repeats, || {
                NeuralGeometryField::from_bytes(&bytes).map(|field| field.tessellated(NGF_STEPS))
            });
            Ok(Decoded { mesh: mesh.map_err(|e| e.to_string())?, bytes: bytes.len(), making, decoding })
        };
        of_file(subject, setup, (NGF, &setting), runs, make)?;
    }
    // One simplification goes through all sizes; each run has the seconds from its beginning.
    let mut simplification: Option<SpectralSimplification> = None;
    let mut making = 0.0;
    for &faces in scale.sms_faces {
        let setting = format!("{faces} faces");
        let make = |parts: &Parts| {
            let (seconds, found) = timed(|| {
                let simplification = match &mut simplification {
                    Some(begun) => begun,
                    none => {
                        let modes = SmsOptions::to_faces(faces).modes;
                        none.insert(SpectralSimplification::new(&parts.remeshed, modes, &NoProgress)?)
                    }
                };
                Ok::<_, SmsError>(simplification.to_faces(faces, &NoProgress)?)
            });
            making += seconds;
            let mesh = found.map_err(|e| e.to_string())?.mesh.into_triangle_mesh();
            Ok(Decoded { bytes: plain_bytes(&mesh), mesh, making, decoding: 0.0 })
        };
        of_file(subject, setup, (SMS, &setting), runs, make)?;
    }
    Ok(())
}

/// What comes out of a file.
struct Decoded {
    mesh: TriangleMesh,
    bytes: usize,
    making: f64,
    decoding: f64,
}

/// A run of a method that writes a file, if it is wanted.
fn of_file(
    subject: &Subject<'_>,
    setup: &Setup,
    (method, setting): (&str, &str),
    runs: &mut Runs,
    make: impl FnOnce(&Parts) -> Result<Decoded, String>,
) -> Result<(), String> {
    if !runs.wants(subject.shape, method, setting) {
        return Ok(());
    }
    eprintln!("{}: {method}, {setting}", subject.shape.name);
    let decoded = make(subject.parts()?).and_then(|decoded| Ok((largest_component(&decoded.mesh)?, decoded)));
    let made = decoded
        .as_ref()
        .map(|(mesh, d)| Made::of_file(mesh, d.bytes, d.making, d.decoding))
        .map_err(String::clone);
    runs.put(measured(subject, setup.scale.repeats, (method, setting), made)?)
}

/// Decimated meshes, compressed by Draco. Meshes with more faces than the isosurface are left out.
pub(super) fn draco(subject: &Subject<'_>, setup: &Setup, runs: &mut Runs) -> Result<(), String> {
    let mut peer = Peer::start(setup.python.as_deref())?;
    let mut decimated: HashMap<usize, ManifoldMesh> = HashMap::new();
    for &faces in setup.scale.draco_faces {
        for &bits in setup.scale.draco_bits {
            let setting = format!("{faces} faces, {bits} bits");
            if !LEVELS.iter().any(|(method, _)| runs.wants(subject.shape, method, &setting)) {
                continue;
            }
            let isosurface = &subject.parts()?.isosurface;
            if faces >= isosurface.face_count() {
                let reason = format!("the isosurface has {} faces", isosurface.face_count());
                for (method, _) in LEVELS {
                    runs.put(measured(subject, 1, (method, &setting), Err(reason.clone()))?)?;
                }
                continue;
            }
            let mesh = decimated.entry(faces).or_insert_with(|| {
                decimate(isosurface, &DecimationOptions::to_faces(faces), &NoProgress).mesh
            });
            let mut earlier: Option<Run> = None;
            for (method, level) in LEVELS {
                let coded = peer.compressed(mesh, bits, level);
                let run = match (coded, earlier.take()) {
                    // Both decoders give the same mesh, in another order.
                    (Ok(coded), Some(same)) if same.left_out.is_empty() => Run {
                        method: method.to_owned(),
                        bytes: Some(coded.bytes),
                        seconds_making: Some(coded.making),
                        seconds_extraction: Some(coded.decoding),
                        ..same
                    },
                    (coded, _) => {
                        let coded = coded.and_then(|coded| Ok((largest_component(&coded.mesh)?, coded)));
                        let made = coded
                            .as_ref()
                            .map(|(mesh, c)| Made::of_file(mesh, c.bytes, c.making, c.decoding))
                            .map_err(String::clone);
                        measured(subject, setup.scale.repeats, (method, &setting), made)?
                    }
                };
                earlier = Some(run.clone());
                runs.put(run)?;
            }
        }
    }
    Ok(())
}

/// Draco, if there is a Python that has it.
struct Peer(Option<(PythonPeer, Scratch)>);

impl Peer {
    fn start(python: Option<&Path>) -> Result<Self, String> {
        let Some(python) = python else { return Ok(Self(None)) };
        let scratch = Scratch::new()?;
        let folder = scratch.path().display().to_string();
        Ok(Self(Some((PythonPeer::start(python, "draco.py", &[folder])?, scratch))))
    }

    fn compressed(&mut self, mesh: &TriangleMesh, bits: u32, level: u32) -> Result<Decoded, String> {
        let Self(Some((peer, scratch))) = self else {
            return Err("no Python with DracoPy was given (--python)".to_owned());
        };
        scratch.write_mesh("mesh", mesh)?;
        let answer = peer.ask(&format!("compress mesh decoded {bits} {level}"))?;
        let number = |key: &str| answer.get(key).and_then(Value::as_f64).ok_or(format!("draco.py: no {key}"));
        Ok(Decoded {
            mesh: scratch.read_mesh("decoded")?,
            bytes: number("bytes")? as usize,
            making: number("encoding")?,
            decoding: number("decoding")?,
        })
    }
}

#[cfg(test)]
mod tests {
    use ndf_mesh::shapes;

    use super::*;

    #[test]
    fn plain_meshes_have_the_bytes_of_the_supplement() {
        // (96 · 642 + 3 · 1280 · log₂ 642) / 8 for a sphere of three levels.
        let mesh = shapes::icosphere(3);
        assert_eq!((mesh.vertex_count(), mesh.face_count()), (642, 1280));
        assert_eq!(plain_bytes(&mesh), (7704.0 + 480.0 * 642.0_f64.log2()).ceil() as usize);
    }
}

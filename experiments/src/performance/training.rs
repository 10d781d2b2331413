//! What training holds in memory.

use std::path::PathBuf;

use clap::Args;
use ndf_core::progress::NoProgress;
use ndf_meshing::{BaseMeshOptions, base_mesh_of_manifold};
use ndf_surfaces::MeshSurface;
use ndf_train::{Settings, fit};
use serde_json::{Value, json};

use super::meshes::MeshName;
use super::process::{forget_peak, memory};
use super::{number, table, text};

/// The meshes of the table.
pub(super) const MESHES: &[&str] = &["armadillo_86k.obj"];

const BASE_FACES: usize = 32_000;

/// Memory does not grow from epoch to epoch: a few are enough.
const EPOCHS: usize = 50;

/// What to measure.
#[derive(Args)]
pub(crate) struct Arguments {
    mesh: MeshName,
    data: PathBuf,
}

/// Makes a base mesh and learns on it for a few epochs, with all terms and with both networks of the paper's preset.
pub(super) fn row(arguments: &Arguments) -> Result<Value, String> {
    let say = |e: &dyn std::fmt::Display| format!("{}: {e}", arguments.mesh);
    let mesh = arguments.mesh.build(&arguments.data)?;
    let surface = MeshSurface::new(&mesh).map_err(|e| say(&e))?;
    let paper = Settings::paper();
    let settings = Settings {
        epochs: EPOCHS,
        identity_epochs: EPOCHS,
        lambda_d: 1.0,
        lambda_n: 1.0,
        lambda_f: 1.0,
        ..paper
    };
    forget_peak();
    let before = memory();
    let options = BaseMeshOptions { faces: BASE_FACES, ..BaseMeshOptions::default() };
    let base = base_mesh_of_manifold(&mesh, Some(&surface), &options, &NoProgress).map_err(|e| say(&e))?.mesh;
    let with_base = memory();
    forget_peak();
    fit(&surface, &base, &settings, &NoProgress).map_err(|e| say(&e))?;
    let peak = memory();
    Ok(json!({
        "mesh": arguments.mesh.to_string(),
        "faces": mesh.face_count(),
        "base_faces": base.face_count(),
        "samples": settings.samples,
        "megabytes_before": before.map(|m| m.0),
        "megabytes_base": with_base.map(|m| m.1),
        "megabytes_between": with_base.map(|m| m.0),
        "megabytes_training": peak.map(|m| m.1),
        "megabytes_beyond": peak.zip(before).map(|(peak, before)| peak.1 - before.0),
    }))
}

/// The table.
pub(super) fn tables(rows: &[Value]) -> String {
    table(
        rows,
        &[
            ("mesh", &text("mesh")),
            ("faces", &number("faces", 0)),
            ("base faces", &number("base_faces", 0)),
            ("samples", &number("samples", 0)),
            ("MB with the input", &number("megabytes_before", 0)),
            ("MB at most, making the base mesh", &number("megabytes_base", 0)),
            ("MB before training", &number("megabytes_between", 0)),
            ("MB at most, training", &number("megabytes_training", 0)),
            ("of these beyond the input", &number("megabytes_beyond", 0)),
        ],
    )
}

//! What geodesic distances cost, beside VTP and pygeodesic.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use clap::Args;
use ndf_core::{DVec3, NoProgress};
use ndf_geodesic::{ExactOptions, HeatSolver, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::io::write_mesh;
use ndf_mesh::{ManifoldMesh, SurfacePoint, Vertex};
use serde_json::{Value, json};

use super::meshes::MeshName;
use super::process::{PythonPeer, Scratch, forget_peak, median, memory, timed};
use super::{Timing, number, ratio, small, table, text};

/// The meshes of the table.
pub(super) const MESHES: &[&str] = &[
    "spot.obj",
    "rocker-arm.obj",
    "armadillo_86k.obj",
    "skull_100k.obj",
    "rope-1000x50",
    "armadillo_86k.obj+1",
    "skull_100k.obj+1",
    "rope-5000x50",
];

/// Meshes of more faces are not given to pygeodesic, which takes minutes and gigabytes on them.
const PYGEODESIC_FACES: usize = 120_000;

/// What to measure.
#[derive(Args)]
pub(crate) struct Arguments {
    mesh: MeshName,
    data: PathBuf,
    #[command(flatten)]
    timing: Timing,
    #[arg(long)]
    vtp: Option<PathBuf>,
}

/// Measures a mesh; the source is vertex 0.
pub(super) fn row(arguments: &Arguments) -> Result<Value, String> {
    let manifold = arguments.mesh.build(&arguments.data)?;
    let mesh = IntrinsicMesh::from_mesh(&manifold);
    let mut row = json!({
        "mesh": arguments.mesh.to_string(),
        "vertices": mesh.vertex_count(),
        "faces": mesh.face_count(),
    });
    // The rivals read the mesh from files, written here before memory is measured.
    let scratch = Scratch::new()?;
    write_rival_files(&manifold, &scratch)?;
    drop(manifold);
    let source = [SurfacePoint::Vertex(Vertex(0))];
    let exact = |options: &ExactOptions| {
        exact_distances(&mesh, &source, options, &NoProgress).map_err(|e| format!("{}: {e}", arguments.mesh))
    };

    forget_peak();
    let before = memory();
    let mut seconds = Vec::new();
    let (first, geodesics) = timed(|| exact(&ExactOptions::default()));
    let geodesics = geodesics?;
    seconds.push(first);
    if let (Some((before, _)), Some((_, peak))) = (before, memory()) {
        row["megabytes_before"] = before.into();
        row["megabytes_peak"] = peak.into();
    }
    let report = geodesics.report();
    row["windows"] = report.windows.into();
    row["windows_at_once"] = report.peak_windows.into();
    row["unreached"] = geodesics.unreached().into();
    let distances = geodesics.distances().to_vec();
    drop(geodesics);

    forget_peak();
    let (kept, geodesics) = timed(|| exact(&ExactOptions::with_windows()));
    drop(geodesics?);
    row["seconds_kept"] = kept.into();
    row["megabytes_peak_kept"] = memory().map(|(_, peak)| peak).into();

    let mut python = match &arguments.timing.python {
        Some(python) if mesh.face_count() <= PYGEODESIC_FACES => {
            Some(PythonPeer::start(python, "mmp.py", &[scratch.path().display().to_string()])?)
        }
        _ => None,
    };
    let (mut vtp_seconds, mut mmp_seconds) = (Vec::new(), Vec::new());
    let farthest = distances.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
    for _ in 0..arguments.timing.repeat {
        let (again, result) = timed(|| exact(&ExactOptions::default()));
        result?;
        seconds.push(again);
        if let Some(program) = &arguments.vtp {
            let (theirs, their_distances) = vtp(program, scratch.path())?;
            vtp_seconds.push(theirs);
            let difference =
                |(a, b): (&f64, &f64)| if a.is_finite() { (a - b).abs() / farthest } else { 0.0 };
            let largest = distances.iter().zip(&their_distances).map(difference).fold(0.0, f64::max);
            row["vtp_difference"] = largest.into();
        }
        if let Some(python) = &mut python {
            let answer = python.ask("vertex 0")?;
            mmp_seconds.extend(answer["seconds"].as_f64());
            row["pygeodesic_difference"] =
                answer["max"].as_f64().map(|max| (max / farthest - 1.0).abs()).into();
        }
    }
    row["seconds"] = median(seconds).into();
    for (key, seconds) in [("seconds_vtp", vtp_seconds), ("seconds_pygeodesic", mmp_seconds)] {
        if !seconds.is_empty() {
            row[key] = median(seconds).into();
        }
    }
    heat(&mesh, &source, &distances, farthest, &mut row)?;
    Ok(row)
}

/// The heat method: factorisation, one set of sources, and how far off it is.
fn heat(
    mesh: &IntrinsicMesh,
    source: &[SurfacePoint],
    exact: &[f64],
    farthest: f64,
    row: &mut Value,
) -> Result<(), String> {
    let (factorisation, solver) = timed(|| HeatSolver::new(mesh));
    let solver = solver.map_err(|e| e.to_string())?;
    let (solve, heat) = timed(|| solver.distances(source));
    let heat = heat.map_err(|e| e.to_string())?.values;
    let errors: Vec<f64> =
        exact.iter().zip(&heat).filter(|(d, _)| d.is_finite()).map(|(a, b)| (a - b).abs()).collect();
    row["seconds_heat_factorisation"] = factorisation.into();
    row["seconds_heat_solve"] = solve.into();
    row["heat_error"] = (100.0 * errors.iter().sum::<f64>() / (farthest * errors.len() as f64)).into();
    Ok(())
}

const VTP_MESH: &str = "mesh.obj";

fn write_rival_files(mesh: &ManifoldMesh, scratch: &Scratch) -> Result<(), String> {
    let mesh = &mesh;
    write_mesh(scratch.path().join(VTP_MESH), mesh, &[]).map_err(|e| e.to_string())?;
    let coordinates = mesh.positions().iter().flat_map(DVec3::to_array);
    scratch.write("positions.f64", coordinates.map(f64::to_le_bytes))?;
    scratch.write("faces.u32", mesh.faces().iter().flatten().map(|v| v.to_le_bytes()))
}

/// Runs VTP as its authors published it (YipengQin/VTP_source_code, 2016): seconds of propagation alone, as it says
/// itself, without building its mesh, and distances of all vertices.
fn vtp(program: &Path, folder: &Path) -> Result<(f64, Vec<f64>), String> {
    let say = |e: &dyn std::fmt::Display| format!("{}: {e}", program.display());
    let distances = folder.join("vtp.txt");
    let output = Command::new(program)
        .args(["-m", VTP_MESH, "-s", "0", "-o", "vtp.txt"])
        .current_dir(folder)
        .output()
        .map_err(|e| say(&e))?;
    let report = String::from_utf8_lossy(&output.stdout);
    let seconds = report
        .split_once("propagation step took ")
        .and_then(|(_, rest)| rest.split_whitespace().next()?.parse().ok())
        .ok_or_else(|| say(&format!("no seconds in {report:?}")))?;
    let text = fs::read_to_string(distances).map_err(|e| say(&e))?;
    let distances: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    Ok((seconds, distances.map_err(|e| say(&e))?))
}

/// The tables of the document.
pub(super) fn tables(rows: &[Value]) -> String {
    let exact = table(
        rows,
        &[
            ("mesh", &text("mesh")),
            ("faces", &number("faces", 0)),
            ("windows", &number("windows", 0)),
            ("waiting at once", &number("windows_at_once", 0)),
            ("seconds", &number("seconds", 3)),
            ("MB before", &number("megabytes_before", 0)),
            ("MB at most", &number("megabytes_peak", 0)),
            ("seconds, windows kept", &number("seconds_kept", 3)),
            ("MB at most, windows kept", &number("megabytes_peak_kept", 0)),
        ],
    );
    let rivals = table(
        rows,
        &[
            ("mesh", &text("mesh")),
            ("faces", &number("faces", 0)),
            ("VTP, seconds", &number("seconds_vtp", 3)),
            ("ours / VTP", &ratio("seconds", "seconds_vtp")),
            ("VTP's largest deviation", &small("vtp_difference")),
            ("pygeodesic, seconds", &number("seconds_pygeodesic", 3)),
            ("pygeodesic / ours", &ratio("seconds_pygeodesic", "seconds")),
        ],
    );
    let heat = table(
        rows,
        &[
            ("mesh", &text("mesh")),
            ("faces", &number("faces", 0)),
            ("factorisations, seconds", &number("seconds_heat_factorisation", 3)),
            ("one set of sources, seconds", &number("seconds_heat_solve", 3)),
            ("mean error, % of the farthest", &number("heat_error", 2)),
        ],
    );
    format!("{exact}\nExact distances compared with rivals:\n\n{rivals}\nThe heat method:\n\n{heat}")
}

//! What modes cost, beside SciPy's eigsh.

use std::path::PathBuf;

use clap::Args;
use ndf_core::progress::NoProgress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_spectral::{Inversion, LaplaceBeltrami, ModeOptions, ScreenedPoisson};
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
    "rope-2000x50",
    "armadillo_86k.obj+1",
    "skull_100k.obj+1",
    "skull_100k.obj+2",
    "rope-10000x100",
];

/// The meshes of the table of many modes, how many, and whether without a factorisation.
pub(super) const MANY: &[(&str, usize, bool)] = &[
    ("skull_100k.obj", 100, false),
    ("skull_100k.obj", 300, false),
    ("skull_100k.obj", 1000, false),
    ("skull_100k.obj+1", 100, false),
    ("skull_100k.obj+2", 100, false),
    ("skull_100k.obj+1", 20, true),
    ("skull_100k.obj+2", 20, true),
];

/// Meshes of more vertices are measured once and not given to SciPy.
const RIVAL_VERTICES: usize = 250_000;

/// What to measure.
#[derive(Args)]
pub(crate) struct Arguments {
    mesh: MeshName,
    data: PathBuf,
    /// How many modes
    #[arg(long, default_value_t = 20)]
    modes: usize,
    /// Without a factorisation
    #[arg(long)]
    multigrid: bool,
    #[command(flatten)]
    timing: Timing,
}

/// Seconds of the parts of a computation.
struct Seconds {
    assembly: f64,
    factorisation: f64,
    iteration: f64,
}

/// Measures a mesh.
pub(super) fn row(arguments: &Arguments) -> Result<Value, String> {
    let mesh = IntrinsicMesh::from_mesh(&arguments.mesh.build(&arguments.data)?);
    let say = |e: &dyn std::fmt::Display| format!("{}: {e}", arguments.mesh);
    let inversion = if arguments.multigrid { Inversion::Multigrid } else { Inversion::Factorisation };
    let options = ModeOptions { count: arguments.modes, inversion, ..ModeOptions::default() };
    let operator = || LaplaceBeltrami::new(&mesh, options.operator).map_err(|e| say(&e));
    let run = || {
        let (assembly, operator) = timed(operator);
        let operator = operator?;
        if arguments.multigrid {
            let (iteration, modes) = timed(|| operator.modes(&options, &NoProgress));
            return Ok((Seconds { assembly, factorisation: 0.0, iteration }, modes.map_err(|e| say(&e))?, 0));
        }
        let shift = options.shift_for(&operator);
        let (factorisation, factored) = timed(|| ScreenedPoisson::new(&operator, shift));
        let factored = factored.map_err(|e| say(&e))?;
        let (iteration, modes) = timed(|| factored.modes(&options, &NoProgress));
        let modes = modes.map_err(|e| say(&e))?;
        let fill = factored.cholesky().symbolic().fill();
        Ok::<_, String>((Seconds { assembly, factorisation, iteration }, modes, fill))
    };

    forget_peak();
    let before = memory();
    let (first, modes, fill) = run()?;
    let peak = memory();
    let mut row = json!({
        "mesh": arguments.mesh.to_string(),
        "vertices": mesh.vertex_count(),
        "faces": mesh.face_count(),
        "modes": options.count,
        "inversion": if arguments.multigrid { "multigrid" } else { "factorisation" },
        "factor_entries": fill,
        "residual_max": modes.max_residual(),
        "verified": modes.verified,
        "megabytes_before": before.map(|(now, _)| now),
        "megabytes_peak": peak.map(|(_, peak)| peak),
    });

    let rivals = arguments
        .timing
        .python
        .as_ref()
        .filter(|_| mesh.vertex_count() <= RIVAL_VERTICES && !arguments.multigrid);
    let scratch = Scratch::new()?;
    let mut peer = None;
    if let Some(python) = rivals {
        let operator = operator()?;
        write_matrices(&operator, &scratch)?;
        let (count, shift) = (options.count.to_string(), options.shift_for(&operator).to_string());
        peer = Some(PythonPeer::start(
            python,
            "eigsh.py",
            &[scratch.path().display().to_string(), count, shift],
        )?);
    }
    let mut ours = vec![first];
    let solvers: Vec<String> = peer
        .iter()
        .flat_map(|peer| peer.greeting["solvers"].as_array().cloned().unwrap_or_default())
        .filter_map(|name| name.as_str().map(str::to_owned))
        .collect();
    let mut theirs: Vec<Vec<f64>> = vec![Vec::new(); solvers.len()];
    let repeat = if mesh.vertex_count() <= RIVAL_VERTICES { arguments.timing.repeat } else { 0 };
    // SuperLU's factor would only be slower: of many modes the fastest rival is asked.
    let is_asked = |solver: &str| options.count <= ModeOptions::default().count || solver == "cholmod";
    for _ in 0..repeat {
        ours.push(run()?.0);
        for (solver, seconds) in solvers.iter().zip(&mut theirs).filter(|(solver, _)| is_asked(solver)) {
            let answer = peer.as_mut().ok_or("no rival")?.ask(solver)?;
            seconds.extend(answer["seconds"].as_f64());
            // Relative to each eigenvalue, and to the first above zero where it is zero.
            let theirs = answer["eigenvalues"].as_array().cloned().unwrap_or_default();
            let scale = modes.eigenvalues.iter().copied().find(|x| *x > 0.0).unwrap_or(1.0);
            let difference =
                |(a, b): (&f64, &Value)| (a - b.as_f64().unwrap_or(f64::NAN)).abs() / a.max(scale);
            let largest = modes.eigenvalues.iter().zip(&theirs).map(difference).fold(0.0, f64::max);
            row[format!("difference_{solver}")] = largest.into();
        }
    }
    let part = |part: fn(&Seconds) -> f64| median(ours.iter().map(part).collect());
    row["seconds_assembly"] = part(|s| s.assembly).into();
    if !arguments.multigrid {
        row["seconds_factorisation"] = part(|s| s.factorisation).into();
    }
    row["seconds_iteration"] = part(|s| s.iteration).into();
    row["seconds"] = part(|s| s.assembly + s.factorisation + s.iteration).into();
    // What eigsh does, which is given the matrices.
    row["seconds_eigsh"] = part(|s| s.factorisation + s.iteration).into();
    for (solver, seconds) in solvers.iter().zip(theirs) {
        if !seconds.is_empty() {
            row[format!("seconds_{solver}")] = median(seconds).into();
        }
    }
    Ok(row)
}

fn write_matrices(operator: &LaplaceBeltrami, scratch: &Scratch) -> Result<(), String> {
    let laplacian = operator.laplacian();
    let integers = |numbers: &[usize]| numbers.iter().map(|&i| (i as i64).to_le_bytes()).collect::<Vec<_>>();
    scratch.write("offsets.i64", integers(laplacian.offsets()).into_iter())?;
    scratch.write("rows.i64", integers(laplacian.columns()).into_iter())?;
    scratch.write("entries.f64", laplacian.values().iter().map(|x| x.to_le_bytes()))?;
    // Lumped: one entry a row.
    scratch.write("mass.f64", operator.mass().values().iter().map(|x| x.to_le_bytes()))
}

/// Adds what the rivals took relative to ours in a run with all threads.
pub(super) fn add_all_threads(row: &mut Value, all_threads: &Value) {
    for rival in ["superlu", "cholmod"] {
        let theirs = all_threads[format!("seconds_{rival}")].as_f64();
        let ours = all_threads["seconds_eigsh"].as_f64();
        row[format!("all_threads_{rival}")] = theirs.zip(ours).map(|(theirs, ours)| theirs / ours).into();
    }
}

/// The table of many modes.
pub(super) fn table_of_many(rows: &[Value]) -> String {
    table(
        rows,
        &[
            ("mesh", &text("mesh")),
            ("vertices", &number("vertices", 0)),
            ("modes", &number("modes", 0)),
            ("by", &text("inversion")),
            ("factor, seconds", &number("seconds_factorisation", 3)),
            ("modes, seconds", &number("seconds_iteration", 3)),
            ("in all, seconds", &number("seconds", 3)),
            ("MB at most", &number("megabytes_peak", 0)),
            ("largest residual", &small("residual_max")),
            ("eigsh with CHOLMOD, seconds", &number("seconds_cholmod", 3)),
            ("CHOLMOD / ours", &ratio("seconds_cholmod", "seconds_eigsh")),
            ("largest difference", &small("difference_cholmod")),
        ],
    )
}

/// The tables of the document.
pub(super) fn tables(rows: &[Value]) -> String {
    let costs = table(
        rows,
        &[
            ("mesh", &text("mesh")),
            ("vertices", &number("vertices", 0)),
            ("entries of the factor", &number("factor_entries", 0)),
            ("operator, seconds", &number("seconds_assembly", 3)),
            ("factor, seconds", &number("seconds_factorisation", 3)),
            ("modes, seconds", &number("seconds_iteration", 3)),
            ("in all, seconds", &number("seconds", 3)),
            ("MB before", &number("megabytes_before", 0)),
            ("MB at most", &number("megabytes_peak", 0)),
            ("largest residual", &small("residual_max")),
        ],
    );
    let rivals = table(
        rows,
        &[
            ("mesh", &text("mesh")),
            ("vertices", &number("vertices", 0)),
            ("eigsh with SuperLU, seconds", &number("seconds_superlu", 3)),
            ("SuperLU / ours", &ratio("seconds_superlu", "seconds_eigsh")),
            ("… all threads", &number("all_threads_superlu", 2)),
            ("largest difference", &small("difference_superlu")),
            ("eigsh with CHOLMOD, seconds", &number("seconds_cholmod", 3)),
            ("CHOLMOD / ours", &ratio("seconds_cholmod", "seconds_eigsh")),
            ("… all threads", &number("all_threads_cholmod", 2)),
        ],
    );
    format!("{costs}\nCompared with SciPy:\n\n{rivals}")
}

//! Seconds, memory and fill of 20 modes: `cargo bench -p ndf-spectral --bench modes -- [--repeat N] [--plain] MESH…`
//!
//! Prints one JSON line a mesh: medians of wall seconds for assembly (with flips to intrinsic Delaunay, unless
//! `--plain`), factorization (ordering, structure, numbers) and iteration with verification; the total; processor
//! seconds of all but reading; entries of the factor; the peak of the process's memory. Threads: `RAYON_NUM_THREADS`.

use std::time::Instant;

use ndf_core::io;
use ndf_core::mesh::repair;
use ndf_core::progress::NoProgress;
use ndf_intrinsic::IntrinsicMesh;
use ndf_spectral::{LaplaceBeltrami, ModeOptions, OperatorOptions, ScreenedPoisson};

fn main() {
    let (mut repeat, mut delaunay, mut paths) = (3, true, Vec::new());
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--plain" => delaunay = false,
            "--repeat" => {
                repeat = arguments.next().and_then(|n| n.parse().ok()).expect("--repeat takes a number");
            }
            _ => paths.push(argument),
        }
    }
    for path in paths {
        let mesh = io::read_mesh(&path).unwrap_or_else(|e| panic!("{e}")).mesh;
        let mesh = repair::mended(&mesh).unwrap_or_else(|e| panic!("{path}: {e}")).mesh;
        let mesh = IntrinsicMesh::of_mesh(&mesh);
        let options = ModeOptions {
            operator: OperatorOptions { delaunay, ..Default::default() },
            ..Default::default()
        };
        let mut rows = Vec::new();
        let mut fill = 0;
        let mut residual = 0.0;
        for _ in 0..repeat {
            let (start, processor) = (Instant::now(), processor_seconds());
            let operator =
                LaplaceBeltrami::new(&mesh, options.operator).unwrap_or_else(|e| panic!("{path}: {e}"));
            let assembly = start.elapsed().as_secs_f64();
            let typical = operator.typical_eigenvalue();
            let shift = options.shift.clamp(1e-6 * typical, typical);
            let factored = ScreenedPoisson::new(&operator, shift).unwrap_or_else(|e| panic!("{path}: {e}"));
            let factorization = start.elapsed().as_secs_f64() - assembly;
            let modes = factored.modes(&options, &NoProgress).unwrap_or_else(|e| panic!("{path}: {e}"));
            let total = start.elapsed().as_secs_f64();
            rows.push([
                assembly,
                factorization,
                total - assembly - factorization,
                total,
                processor_seconds() - processor,
            ]);
            fill = factored.cholesky().analysis().fill();
            residual = modes.max_residual();
            assert!(modes.verified);
        }
        let median = |column: usize| {
            let mut values: Vec<f64> = rows.iter().map(|row| row[column]).collect();
            values.sort_by(f64::total_cmp);
            values[values.len() / 2]
        };
        let line = serde_json::json!({
            "mesh": path,
            "vertices": mesh.vertex_count(),
            "threads": std::env::var("RAYON_NUM_THREADS").unwrap_or_else(|_| "all".to_owned()),
            "delaunay": delaunay,
            "seconds_assembly": median(0),
            "seconds_factorization": median(1),
            "seconds_iteration": median(2),
            "seconds": median(3),
            "cpu_seconds": median(4),
            "factor_entries": fill,
            "residual_max": residual,
            "peak_mebibytes": peak_mebibytes(),
        });
        report(&line);
    }
}

#[expect(clippy::print_stdout, reason = "a benchmark's output")]
fn report(line: &serde_json::Value) {
    println!("{line}");
}

/// Seconds all threads of this process have run, to a hundredth; 0 where the system does not tell.
fn processor_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<f64> = stat
        .rsplit(')')
        .next()
        .unwrap_or_default()
        .split_whitespace()
        .map(|f| f.parse().unwrap_or(0.0))
        .collect();
    // The 14th and 15th fields of the line, user and system time in hundredths of a second; two stand before the `)`.
    fields.get(11..13).map_or(0.0, |ticks| ticks.iter().sum::<f64>() / 100.0)
}

/// The most memory this process has held; 0 where the system does not tell.
fn peak_mebibytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or_default();
    line.split_whitespace().next().and_then(|kib| kib.parse::<u64>().ok()).unwrap_or(0) / 1024
}

//! Extraction from a model at several edge lengths, as a table of times and peak memory:
//! `cargo bench -p ndf-intrinsic --bench extraction -- MODEL.ndf H…`. Every length is measured in a process of its own;
//! the least of three times is given. `RAYON_NUM_THREADS` sets the number of threads.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

use ndf_core::NoProgress;
use ndf_intrinsic::{ExtractionOptions, extract};
use ndf_model::Model;

const RUNS: usize = 3;

#[allow(clippy::print_stdout, reason = "a table is what it makes")]
fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with("--")).collect();
    match &arguments[..] {
        [path, h] => match measure(Path::new(path), h) {
            Ok(row) => println!("{row}"),
            Err(error) => {
                eprintln!("{error}");
                std::process::exit(1);
            }
        },
        [path, lengths @ ..] if !lengths.is_empty() => {
            println!(
                "| h | triangles | seconds | triangles a second | peak memory | Delaunay, intrinsic / embedded | p5 of the smallest angles | longest edge |"
            );
            println!("|--:|--:|--:|--:|--:|--:|--:|--:|");
            for h in lengths {
                let program = std::env::current_exe().expect("this program has a path");
                Command::new(program).args([path, h]).status().expect("this program runs");
            }
        }
        _ => eprintln!("give a model and edge lengths"),
    }
}

/// A row of the table.
fn measure(path: &Path, h: &str) -> Result<String, String> {
    let model = Model::read(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let h: f64 = h.parse().map_err(|_| format!("{h} is no edge length"))?;
    let mut seconds = f64::INFINITY;
    let mut report = None;
    for _ in 0..RUNS {
        let start = Instant::now();
        let extraction =
            extract(&model.field, &ExtractionOptions::new(h), &NoProgress).map_err(|e| e.to_string())?;
        seconds = seconds.min(start.elapsed().as_secs_f64());
        report = Some(extraction.report);
    }
    let r = report.expect("there are runs");
    let promises = if r.holds() { "" } else { "; A PROMISE IS BROKEN" };
    Ok(format!(
        "| {h} | {} | {seconds:.3} | {:.2} M | {} | {:.4} / {:.4} %{promises} | {:.1}° | {:.2} h |",
        r.faces,
        r.faces as f64 / seconds / 1e6,
        peak_memory(),
        100.0 * r.delaunay_intrinsic_fraction,
        100.0 * r.delaunay_embedded_fraction,
        r.min_angle.p5.to_degrees(),
        r.longest_in_h,
    ))
}

/// The most memory this process has held, where the system says so.
fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let kilobytes = status
        .lines()
        .find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.trim().parse::<f64>().ok());
    kilobytes.map_or_else(|| "?".to_owned(), |kilobytes| format!("{:.0} MB", kilobytes / 1e3))
}

//! Time of one training step beside the processor's peak, dfdx's tape and PyTorch:
//! `cargo bench -p ndf-train --bench step [-- --python PYTHON]`, PYTHON an interpreter that has torch.
//!
//! A step is an epoch of the paper's size without projection: 32,768 samples, 8 features, no encoding for g, 8 octaves
//! for the reverse map; without tangents, with their values, and with a term that has gradients by them. Arithmetic is
//! counted without padding. The peak is that of a bare loop of fused multiply-adds in registers, in the same run. Times
//! are the least of many, in turns with the peak: what the machine can do when nothing disturbs it.

#![allow(clippy::print_stdout, reason = "a benchmark prints its table")]

use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use ndf_core::analytic::Sphere;
use ndf_core::glam::Vec3;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::shapes;
use ndf_train::objective::{Block, Gradients, Needs, Term};
use ndf_train::{ReverseMap, Settings, Trainer};

#[path = "../../ndf-network/benches/peak/mod.rs"]
mod peak;
#[path = "peers/tape.rs"]
mod tape;

/// Measurements of each kind, in turns.
const ROUNDS: usize = 8;
const STEPS: usize = 12;

/// Multiply-adds of a network without padding: forward, or by each of the two products of the way back.
fn products(inputs: usize) -> f64 {
    (inputs * 32 + 32 * 32 + 32 * 3) as f64
}

/// A term that looks at the tangents and adds nothing.
struct Normals;

impl Term for Normals {
    fn name(&self) -> &str {
        "normals"
    }

    fn needs(&self) -> Needs {
        Needs::TANGENTS
    }

    fn accumulate(&self, block: &Block<'_>, _weight: f32, _gradients: &mut Gradients<'_>) -> f64 {
        let [u, v] = block.tangents;
        let across = |(u, v): (&Vec3, &Vec3)| u.y * v.z - u.z * v.y;
        std::hint::black_box(u.iter().zip(v).map(across).sum::<f32>());
        0.0
    }
}

/// Which tangents a step has.
#[derive(Clone, Copy, PartialEq)]
enum Tangents {
    None,
    Values,
    Gradients,
}

const STEPS_TIMED: [(&str, Tangents); 3] = [
    ("values", Tangents::None),
    ("values, tangents", Tangents::Values),
    ("values, tangents, normals", Tangents::Gradients),
];

/// Least and median seconds of a step, and its share of the peak.
fn time(tangents: Tangents, threads: usize) -> (f64, f64, f64, f64) {
    let base = ManifoldMesh::try_from(shapes::torus(50, 40, 1.0, 0.4)).expect("a torus is a manifold");
    let settings = Settings {
        samples: 32_768,
        epochs: 1_000_000,
        resample_every: 1_000_000,
        project_every: 1_000_000,
        reverse_map: ReverseMap::Residual,
        lambda_n: if tangents == Tangents::Gradients { 1.0 } else { 0.0 },
        ..Settings::default()
    };
    // Forward, and two products on the way back.
    let rows = match tangents {
        Tangents::None => 3.0,
        Tangents::Values => 3.0 + 2.0,
        Tangents::Gradients => 3.0 + 2.0 * 3.0,
    };
    let work = 2.0 * (rows * products(11) + 3.0 * products(51)) * settings.samples as f64;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be had");
    pool.install(|| {
        let mut trainer = Trainer::new(&Sphere::UNIT, &base, &settings).expect("settings are usable");
        if tangents == Tangents::Values {
            trainer = trainer.with_term(1.0, Arc::new(Normals));
        }
        let mut epoch = || {
            let started = Instant::now();
            trainer.run_epoch().expect("the sphere can be learned");
            started.elapsed()
        };
        (0..5).for_each(|_| {
            epoch();
        });
        let mut times: Vec<Duration> = Vec::new();
        let mut peak = 0.0_f64;
        for _ in 0..ROUNDS {
            times.extend((0..STEPS).map(|_| epoch()));
            peak = peak.max(peak::gflops(threads, 4_000_000));
        }
        times.sort_unstable();
        let (least, median) = (times[0].as_secs_f64(), times[times.len() / 2].as_secs_f64());
        (least, median, work / least / 1e9, peak)
    })
}

/// Median and least milliseconds that PyTorch takes for the same steps.
fn torch(python: &str, threads: usize) -> Vec<(f64, f64)> {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/step_torch.py");
    let output = Command::new(python)
        .args(["-W", "ignore", script, &threads.to_string()])
        .output()
        .expect("the interpreter runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let figures = text.lines().map(|line| {
        let mut words = line.split_whitespace().skip(1).map(|w| w.parse::<f64>().expect("a number"));
        (words.next().expect("the median"), words.next().expect("the least"))
    });
    figures.collect()
}

fn main() {
    let python = std::env::args().skip_while(|a| a != "--python").nth(1);
    println!(
        "| step | threads | median ms | least ms | GFLOP/s | peak | share | PyTorch median ms | least ms | ratio |"
    );
    println!("|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|");
    for threads in [1, 2] {
        let theirs = python.as_deref().map(|python| torch(python, threads)).unwrap_or_default();
        for (k, (name, tangents)) in STEPS_TIMED.into_iter().enumerate() {
            let (least, median, reached, peak) = time(tangents, threads);
            let peer = theirs.get(k).map_or_else(
                || "– | – | –".to_owned(),
                |(m, l)| format!("{m:.1} | {l:.1} | {:.1}", l / (1e3 * least)),
            );
            println!(
                "| {name} | {threads} | {:.2} | {:.2} | {reached:.0} | {peak:.0} | {:.0} % | {peer} |",
                1e3 * median,
                1e3 * least,
                100.0 * reached / peak,
            );
        }
    }
    println!("\ndfdx's tape, values, one thread: {:.0} ms", tape::milliseconds());
}

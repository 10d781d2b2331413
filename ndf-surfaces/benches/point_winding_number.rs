//! Winding numbers of point clouds on one thread, beside libigl's:
//! `cargo bench -p ndf-surfaces --bench point_winding_number -- [--python PYTHON] [MESH …]`.
//!
//! Clouds are 100,000 points uniform on the surface, with its normals; queries are 100,000 more plus normal noise of 1 %
//! of the box diagonal, in the order of the sampler. `error` is the difference from the direct sum over 500 queries,
//! relative to its root mean square: root mean square, and largest. With `--python`, a Python that has numpy and libigl,
//! both are timed in turn three times, and the shortest counts: libigl's with order 2 and β = 2 as ours.

#![allow(clippy::print_stdout)]

use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use ndf_core::DVec3;
use ndf_mesh::TriangleMesh;
use ndf_mesh::io::read_mesh;
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::shapes;
use ndf_surfaces::PointWindingNumber;
use ndf_surfaces::point_cloud::{Neighbours, areas};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const POINTS: usize = 100_000;
const QUERIES: usize = 100_000;
const CHECKED: usize = 500;
const ROUNDS: usize = 3;

fn main() {
    let mut python = None;
    let mut meshes = Vec::new();
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--python" => python = arguments.next().map(PathBuf::from),
            flag if flag.starts_with('-') => {}
            path => meshes.push(path.to_owned()),
        }
    }
    println!(
        "{:<20} {:>9} {:>9} {:>11} {:>17} | {:>9} {:>17} {:>6}",
        "mesh", "build ms", "value ns", "gradient ns", "error", "libigl ns", "its error", "ratio"
    );
    bench("trefoil knot", &shapes::trefoil_knot(1000, 50, 0.2), python.as_deref());
    for path in meshes {
        match read_mesh(&path) {
            Ok(file) => bench(path.rsplit('/').next().unwrap_or(&path), &file.mesh, python.as_deref()),
            Err(error) => println!("{path}: {error}"),
        }
    }
}

/// Points, unit normals, areas.
struct Cloud {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    areas: Vec<f64>,
}

fn bench(name: &str, mesh: &TriangleMesh, python: Option<&Path>) {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let noise = 0.01 * mesh.bounds().diagonal();
    let sampler = AreaSampler::new(mesh).expect("a mesh to measure has an area");
    let samples = sampler.sample(POINTS, 5, 0);
    let positions: Vec<DVec3> = samples.iter().map(|s| s.position(mesh)).collect();
    let normals: Vec<DVec3> = samples.iter().map(|s| mesh.face_normal(s.face)).collect();
    let areas = areas(&positions, &normals, &Neighbours::new(&positions));
    let cloud = Cloud { positions, normals, areas };
    let queries: Vec<DVec3> =
        sampler.sample(QUERIES, 7, 0).iter().map(|s| s.position(mesh) + normal(&mut rng) * noise).collect();
    let moments: Vec<DVec3> = cloud.normals.iter().zip(&cloud.areas).map(|(&n, &a)| a * n).collect();
    // A radius too small to matter: libigl sums the dipoles as they are.
    let radii = vec![1e-9; POINTS];
    let start = Instant::now();
    let winding = PointWindingNumber::new(&cloud.positions, &moments, &radii);
    let build = 1e3 * start.elapsed().as_secs_f64();

    let checked = || queries.iter().step_by(QUERIES / CHECKED);
    let truth: Vec<f64> = checked().map(|&q| direct(&cloud.positions, &moments, q)).collect();
    let ours: Vec<f64> = checked().map(|&q| winding.at(q)).collect();
    let theirs = python.map(|_| Exchange::new(&cloud, &queries));
    let (mut value, mut gradient, mut libigl) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    for _ in 0..ROUNDS {
        value = value.min(nanoseconds(|| queries.iter().map(|&q| winding.at(q)).sum::<f64>()));
        gradient =
            gradient.min(nanoseconds(|| queries.iter().map(|&q| winding.with_gradient(q).0).sum::<f64>()));
        if let (Some(python), Some(exchange)) = (python, &theirs) {
            libigl = libigl.min(exchange.run(python));
        }
    }
    let [rms, max] = errors(&ours, &truth);
    print!("{name:<20} {build:>9.1} {value:>9.0} {gradient:>11.0} {rms:>8.1e} {max:>8.1e} |");
    if let Some(exchange) = theirs {
        let all = exchange.values();
        let values: Vec<f64> = all.iter().step_by(QUERIES / CHECKED).copied().collect();
        let [rms, max] = errors(&values, &truth);
        print!(" {libigl:>9.0} {rms:>8.1e} {max:>8.1e} {:>6.2}", value / libigl);
    }
    println!();
}

fn direct(positions: &[DVec3], moments: &[DVec3], q: DVec3) -> f64 {
    let term = |(&p, m): (&DVec3, &DVec3)| m.dot(p - q) / (p - q).length().powi(3);
    positions.iter().zip(moments).map(term).sum::<f64>() / (4.0 * PI)
}

/// Root mean square and largest difference, relative to the root mean square of the truth.
fn errors(values: &[f64], truth: &[f64]) -> [f64; 2] {
    let rms = |squares: f64| (squares / truth.len() as f64).sqrt();
    let scale = rms(truth.iter().map(|t| t * t).sum());
    let differences = || values.iter().zip(truth).map(|(v, t)| (v - t).abs());
    [rms(differences().map(|d| d * d).sum()) / scale, differences().fold(0.0, f64::max) / scale]
}

/// A folder through which the script beside this file gets its input and gives its values.
struct Exchange(PathBuf);

impl Exchange {
    fn new(cloud: &Cloud, queries: &[DVec3]) -> Self {
        let folder = std::env::temp_dir().join(format!("ndf-point-winding-number-{}", std::process::id()));
        std::fs::create_dir_all(&folder).expect("the temporary folder can be written to");
        let exchange = Self(folder);
        let flat = |vectors: &[DVec3]| vectors.iter().flat_map(DVec3::to_array).collect::<Vec<f64>>();
        exchange.write("positions", &flat(&cloud.positions));
        exchange.write("normals", &flat(&cloud.normals));
        exchange.write("areas", &cloud.areas);
        exchange.write("queries", &flat(queries));
        exchange
    }

    fn write(&self, name: &str, numbers: &[f64]) {
        let bytes: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
        std::fs::write(self.0.join(name), bytes).expect("the temporary folder can be written to");
    }

    /// Nanoseconds a query takes libigl.
    fn run(&self, python: &Path) -> f64 {
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/libigl_point_winding_number.py");
        let output = Command::new(python).arg(script).arg(&self.0).output().expect("Python can be started");
        let text = String::from_utf8_lossy(&output.stdout);
        let complaint = String::from_utf8_lossy(&output.stderr);
        text.trim().parse().unwrap_or_else(|_| panic!("the script failed: {complaint}"))
    }

    fn values(&self) -> Vec<f64> {
        let bytes = std::fs::read(self.0.join("values")).expect("the script leaves its values");
        bytes.chunks_exact(8).map(|b| f64::from_le_bytes(b.try_into().expect("eight bytes"))).collect()
    }
}

impl Drop for Exchange {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Nanoseconds a query takes.
fn nanoseconds<T>(run: impl FnOnce() -> T) -> f64 {
    let start = Instant::now();
    std::hint::black_box(run());
    1e9 * start.elapsed().as_secs_f64() / QUERIES as f64
}

/// A standard normal vector (Box and Muller 1958).
fn normal(rng: &mut ChaCha8Rng) -> DVec3 {
    let mut component = || {
        let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
        radius * (TAU * rng.random::<f64>()).cos()
    };
    DVec3::new(component(), component(), component())
}

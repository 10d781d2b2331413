//! Winding numbers and signed distances on one thread: `cargo bench -p ndf-surfaces -- [MESH …]`.
//!
//! Queries are 100,000 points uniform on the surface plus normal noise of 1 % of the box diagonal, in the order
//! of the sampler; `error` is the largest difference from the direct sum over 200 of them.

#![allow(clippy::print_stdout)]

use std::f64::consts::{PI, TAU};
use std::time::Instant;

use ndf_core::{Answer, DVec3, ImplicitField, Query, Surface};
use ndf_mesh::io::read_mesh;
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::shapes;
use ndf_mesh::{Face, TriangleMesh};
use ndf_surfaces::{MeshSurface, WindingNumber};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const QUERIES: usize = 100_000;

fn main() {
    println!(
        "{:<22} {:>8} {:>9} {:>11} {:>9} {:>10} {:>10}",
        "mesh", "faces", "build ms", "winding ns", "error", "project ns", "signed ns"
    );
    bench("icosphere 6", &shapes::icosphere(6));
    bench("trefoil knot", &shapes::trefoil_knot(1000, 50, 0.2));
    for path in std::env::args().skip(1).filter(|arg| !arg.starts_with('-')) {
        match read_mesh(&path) {
            Ok(file) => bench(path.rsplit('/').next().unwrap_or(&path), &file.mesh),
            Err(error) => println!("{path}: {error}"),
        }
    }
}

fn bench(name: &str, mesh: &TriangleMesh) {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let noise = 0.01 * mesh.bounds().diagonal();
    let sampler = AreaSampler::new(mesh).expect("a mesh to measure has an area");
    let points: Vec<DVec3> =
        sampler.sample(QUERIES, 7, 0).iter().map(|s| s.position(mesh) + normal(&mut rng) * noise).collect();
    let build = 1e3 * least_seconds(|| WindingNumber::new(mesh));
    let winding = WindingNumber::new(mesh);
    let error = points
        .iter()
        .step_by(QUERIES / 200)
        .map(|&p| (winding.at(p) - direct(mesh, p)).abs())
        .fold(0.0, f64::max);
    let per_query = 1e9 / QUERIES as f64;
    let at = per_query * least_seconds(|| points.iter().map(|&p| winding.at(p)).sum::<f64>());

    let surface = MeshSurface::new(mesh).expect("a mesh to measure has faces");
    let mut queries: Vec<Query> = points.iter().map(|&p| Query::at(p)).collect();
    let mut feet: Vec<Answer> = vec![Err(ndf_core::Miss::OutOfReach); QUERIES];
    surface.project(&queries, &mut feet);
    for (query, foot) in queries.iter_mut().zip(&feet) {
        let foot = foot.expect("every finite point has a foot");
        (query.normal, query.hint) = (Some(foot.normal), foot.hint);
    }
    let project = per_query * least_seconds(|| surface.project(&queries, &mut feet));
    let mut values = vec![0.0; QUERIES];
    let signed = per_query * least_seconds(|| surface.values(&points, &mut values));
    println!(
        "{name:<22} {:>8} {build:>9.1} {at:>11.0} {error:>9.1e} {project:>10.0} {signed:>10.0}",
        mesh.face_count()
    );
}

fn direct(mesh: &TriangleMesh, p: DVec3) -> f64 {
    let angle = |f: Face| {
        let [a, b, c] = mesh.corner_positions(f).map(|x| x - p);
        let (la, lb, lc) = (a.length(), b.length(), c.length());
        let den = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
        2.0 * a.dot(b.cross(c)).atan2(den)
    };
    mesh.face_indices().map(angle).sum::<f64>() / (4.0 * PI)
}

/// The shortest of three runs.
fn least_seconds<T>(mut run: impl FnMut() -> T) -> f64 {
    (0..3)
        .map(|_| {
            let start = Instant::now();
            std::hint::black_box(run());
            start.elapsed().as_secs_f64()
        })
        .fold(f64::INFINITY, f64::min)
}

/// A standard normal vector (Box and Muller 1958).
fn normal(rng: &mut ChaCha8Rng) -> DVec3 {
    let mut component = || {
        let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
        radius * (TAU * rng.random::<f64>()).cos()
    };
    DVec3::new(component(), component(), component())
}

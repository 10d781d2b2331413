//! Closest-point and ray queries on one thread: `cargo bench -p ndf-core --bench closest_point -- [MESH …]`.
//!
//! Queries are 100,000 points uniform on the surface plus normal noise of 1 % of the box diagonal. `cold` asks
//! for them in random order, without hints. `warm` asks for the same points moved by a thousandth of the
//! diagonal, hinted with the answers from before the move, in the order of the sampler: what a training step
//! does. `ray` shoots from the queries, in random order, in random directions.

#![allow(clippy::print_stdout)]

use std::time::Instant;

use ndf_core::{DVec3, Hint};
use ndf_mesh::io::read_mesh;
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::shapes;
use ndf_mesh::{TriangleMesh, TriangleTree};
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const QUERIES: usize = 100_000;

fn main() {
    println!(
        "{:<22} {:>8} {:>9} {:>8} {:>8} {:>8}",
        "mesh", "faces", "build ms", "cold ns", "warm ns", "ray ns"
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
    let diagonal = mesh.bounds().diagonal();
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let sampler = AreaSampler::new(mesh).expect("a mesh to measure has an area");
    let queries: Vec<DVec3> = sampler
        .sample(QUERIES, 7, 0)
        .iter()
        .map(|s| s.position(mesh) + normal(&mut rng) * (0.01 * diagonal))
        .collect();
    let mut shuffled = queries.clone();
    shuffled.shuffle(&mut rng);
    let moved: Vec<DVec3> =
        queries.iter().map(|&p| p + normal(&mut rng).normalize() * (0.001 * diagonal)).collect();
    let directions: Vec<DVec3> = (0..QUERIES).map(|_| normal(&mut rng)).collect();

    let build = 1e3 * least_seconds(|| TriangleTree::new(mesh));
    let tree = TriangleTree::new(mesh);
    let ask = |p: DVec3, hint| tree.closest_point(p, hint).expect("the tree is not empty");
    let hints: Vec<Hint> = queries.iter().map(|&p| ask(p, Hint::NONE).hint()).collect();
    let per_query = 1e9 / QUERIES as f64;
    let cold = per_query
        * least_seconds(|| shuffled.iter().map(|&p| ask(p, Hint::NONE).distance_squared).sum::<f64>());
    let warm = per_query
        * least_seconds(|| moved.iter().zip(&hints).map(|(&p, &h)| ask(p, h).distance_squared).sum::<f64>());
    let ray = per_query
        * least_seconds(|| {
            shuffled.iter().zip(&directions).filter(|&(&o, &d)| tree.first_hit(o, d).is_some()).count()
        });
    println!("{name:<22} {:>8} {build:>9.1} {cold:>8.0} {warm:>8.0} {ray:>8.0}", mesh.face_count());
}

/// The shortest of five runs.
fn least_seconds<T>(mut run: impl FnMut() -> T) -> f64 {
    (0..5)
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
        radius * (std::f64::consts::TAU * rng.random::<f64>()).cos()
    };
    DVec3::new(component(), component(), component())
}

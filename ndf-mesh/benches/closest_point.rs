//! Closest-point and ray queries on one thread, beside parry3d's and bvh's trees:
//! `cargo bench -p ndf-mesh --bench closest_point -- [MESH …]`.
//!
//! Queries are 100,000 points uniform on the surface plus normal noise of 1 % of the box diagonal. `cold` asks
//! for them in random order, without hints. `warm` asks for the same points moved by a thousandth of the
//! diagonal, hinted with the answers from before the move, in the order of the sampler: what a training step
//! does. `ray` shoots from the queries, in random order, in random directions. All three trees answer in double precision
//! on the same queries in turn; ours and parry's must agree. bvh leaves the distance to a triangle to its user; parry's
//! is taken.

#![allow(clippy::print_stdout)]

use std::time::Instant;

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;

use bvh::point_query::PointDistance;
use nalgebra::Point3;
use ndf_core::{DVec3, Hint};
use ndf_mesh::io::read_mesh;
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::shapes;
use ndf_mesh::{TriangleMesh, TriangleTree};
use parry3d_f64::math::Vector;
use parry3d_f64::query::{PointQuery, Ray, RayCast};
use parry3d_f64::shape::{TriMesh, Triangle};
use rand::RngExt;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

const QUERIES: usize = 100_000;

fn main() {
    println!(
        "{:<22} {:>8} {:<6} {:>9} {:>8} {:>8} {:>8}",
        "mesh", "faces", "tree", "build ms", "cold ns", "warm ns", "ray ns"
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
    let row = |tree: &str, build: f64, cold: f64, warm: f64, ray: f64| {
        let faces = mesh.face_count();
        println!("{name:<22} {faces:>8} {tree:<6} {build:>9.1} {cold:>8.0} {warm:>8.0} {ray:>8.0}");
    };
    row("ours", build, cold, warm, ray);

    let vector = |p: DVec3| Vector::new(p.x, p.y, p.z);
    let parry = || {
        let vertices = mesh.positions().iter().map(|&p| vector(p)).collect();
        TriMesh::new(vertices, mesh.faces().to_vec()).expect("the mesh has faces")
    };
    let build = 1e3 * least_seconds(parry);
    let tree = parry();
    let distance = |p: DVec3| tree.distance_to_local_point(vector(p), false);
    for (p, q) in shuffled.iter().zip(&moved).step_by(97).flat_map(|(&p, &q)| [(p, p), (q, q)]) {
        let ours = ask(p, Hint::NONE).distance_squared.sqrt();
        assert!((ours - distance(q)).abs() < 1e-12 * diagonal.max(1.0), "{p}: {ours} and {}", distance(q));
    }
    let cold = per_query * least_seconds(|| shuffled.iter().map(|&p| distance(p)).sum::<f64>());
    let warm = per_query * least_seconds(|| moved.iter().map(|&p| distance(p)).sum::<f64>());
    let ray = per_query
        * least_seconds(|| {
            let hits = |&(&o, &d): &(&DVec3, &DVec3)| {
                tree.cast_local_ray(&Ray::new(vector(o), vector(d)), f64::INFINITY, false).is_some()
            };
            shuffled.iter().zip(&directions).filter(hits).count()
        });
    row("parry", build, cold, warm, ray);

    let shapes = || -> Vec<Shape> {
        let corners = mesh.face_indices().map(|f| mesh.corner_positions(f).map(vector));
        corners.map(|[a, b, c]| Shape { triangle: Triangle::new(a, b, c), node: 0 }).collect()
    };
    let build = 1e3 * least_seconds(|| Bvh::build(&mut shapes()));
    let mut shapes = shapes();
    let tree = Bvh::build(&mut shapes);
    let point = |p: DVec3| Point3::new(p.x, p.y, p.z);
    let squared = |p: DVec3| tree.nearest_to(point(p), &shapes).expect("the tree is not empty").1;
    let cold = per_query * least_seconds(|| shuffled.iter().map(|&p| squared(p)).sum::<f64>());
    let warm = per_query * least_seconds(|| moved.iter().map(|&p| squared(p)).sum::<f64>());
    row("bvh", build, cold, warm, f64::NAN);
}

/// A triangle in bvh's tree.
struct Shape {
    triangle: Triangle,
    node: usize,
}

impl Bounded<f64, 3> for Shape {
    fn aabb(&self) -> Aabb<f64, 3> {
        let corners = [self.triangle.a, self.triangle.b, self.triangle.c].map(|p| Point3::new(p.x, p.y, p.z));
        corners.iter().skip(1).fold(Aabb::with_bounds(corners[0], corners[0]), |all, corner| all.grow(corner))
    }
}

impl BHShape<f64, 3> for Shape {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl PointDistance<f64, 3> for Shape {
    fn distance_squared(&self, query: Point3<f64>) -> f64 {
        self.triangle.distance_to_local_point(Vector::new(query.x, query.y, query.z), false).powi(2)
    }
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

//! Exact distances and the heat method on one thread: `cargo bench -p ndf-geodesic --bench exact -- [MESH
//! …]`.
//!
//! Every mesh is measured as it is, and split into four once more while that gives at most 500,000 faces.
//! Source: vertex 0. `seconds` is the least of a few runs; connectivity and lengths are given. `peak` counts
//! the windows that waited at once, `front` the bytes of their buffers; `kept` is the time with all windows
//! kept. Heat: factorising once, then one set of sources.

#![allow(clippy::print_stdout)]

use std::collections::HashMap;
use std::time::Instant;

use ndf_core::io::read_mesh;
use ndf_core::mesh::{repair, shapes};
use ndf_core::{ManifoldMesh, SurfacePoint, TriangleMesh};
use ndf_geodesic::{ExactOptions, HeatSolver, exact_distances};
use ndf_intrinsic::IntrinsicMesh;

const MOST_FACES: usize = 500_000;

fn main() {
    println!(
        "{:<26} {:>8} {:>8} {:>10} {:>7} {:>9} {:>9} {:>9} {:>10} {:>10}",
        "mesh",
        "vertices",
        "faces",
        "windows",
        "peak",
        "front MB",
        "seconds",
        "kept s",
        "factors s",
        "heat s"
    );
    bench("icosphere", &shapes::icosphere(6));
    bench("trefoil knot", &shapes::trefoil_knot(1000, 50, 0.2));
    for path in std::env::args().skip(1).filter(|arg| !arg.starts_with('-')) {
        match read_mesh(&path) {
            Ok(file) => bench(path.rsplit('/').next().unwrap_or(&path), &file.mesh),
            Err(error) => println!("{path}: {error}"),
        }
    }
}

fn bench(name: &str, mesh: &TriangleMesh) {
    let mut mesh = match repair::mended(mesh) {
        Ok(mended) => mended.mesh.into_triangle_mesh(),
        Err(error) => return println!("{name}: {error}"),
    };
    let mut name = name.to_owned();
    while mesh.face_count() <= MOST_FACES {
        let manifold = ManifoldMesh::try_from(mesh.clone()).expect("a mended mesh is a manifold");
        measure(&name, &IntrinsicMesh::of_mesh(&manifold));
        mesh = subdivided(&mesh);
        name.push_str(" /4");
    }
}

fn measure(name: &str, mesh: &IntrinsicMesh) {
    let source = [SurfacePoint::Vertex(0)];
    let exact =
        |options: &ExactOptions<'_>| exact_distances(mesh, &source, options).expect("vertex 0 exists");
    let (seconds, geodesics) = least_seconds(3, || exact(&ExactOptions::default()));
    let (kept, _) = least_seconds(1, || exact(&ExactOptions::with_windows()));
    let (factors, solver) = least_seconds(1, || HeatSolver::new(mesh));
    let heat = match &solver {
        Ok(solver) => least_seconds(1, || solver.distances(&source)).0,
        Err(_) => f64::NAN,
    };
    let statistics = geodesics.statistics();
    println!(
        "{name:<26} {:>8} {:>8} {:>10} {:>7} {:>9.1} {seconds:>9.3} {kept:>9.3} {factors:>10.3} {heat:>10.3}",
        mesh.vertex_count(),
        mesh.face_count(),
        statistics.windows,
        statistics.peak_windows,
        statistics.front_bytes as f64 / 1e6,
    );
}

fn least_seconds<T>(runs: usize, mut work: impl FnMut() -> T) -> (f64, T) {
    let mut timed = || {
        let start = Instant::now();
        let result = work();
        (start.elapsed().as_secs_f64(), result)
    };
    let mut best = timed();
    for _ in 1..runs {
        let next = timed();
        if next.0 < best.0 {
            best = next;
        }
    }
    best
}

/// Every face split into four by its edges' midpoints.
fn subdivided(mesh: &TriangleMesh) -> TriangleMesh {
    let mut positions = mesh.positions().to_vec();
    let mut midpoints = HashMap::new();
    let mut midpoint = |a: u32, b: u32| {
        *midpoints.entry((a.min(b), a.max(b))).or_insert_with(|| {
            positions.push(positions[a as usize].midpoint(positions[b as usize]));
            positions.len() as u32 - 1
        })
    };
    let mut faces = Vec::with_capacity(4 * mesh.face_count());
    for &[a, b, c] in mesh.faces() {
        let (ab, bc, ca) = (midpoint(a, b), midpoint(b, c), midpoint(c, a));
        faces.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
    }
    TriangleMesh::new(positions, faces).expect("midpoints exist")
}

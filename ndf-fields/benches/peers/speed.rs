//! Processor times beside those of potpourri3d and geometry-central, which take turns with ours.

use std::path::Path;
use std::process::Command;
use std::time::Duration;

use ndf_core::{DVec3, NoProgress};
use ndf_fields::{
    Complex64, DirectionField, SignedHeatOptions, StripePattern, TangentBundle, VectorHeatSolver,
    signed_distances,
};
use ndf_geodesic::{HeatSolver, ThroughOptions, geodesic_through, straightest_geodesic};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{Face, FacePoint, ManifoldMesh, SurfacePoint, TriangleMesh, Vertex};

use crate::exchange::Exchange;
use crate::geometry_central::frequency;

/// Turns of all programs; medians count.
const TURNS: usize = 3;

/// Runs of what takes little time, in each turn.
const REPEATS: usize = 3;

/// What is timed, in the order in which peers write their seconds. A peer has no time for what it cannot do.
const TASKS: [&str; 12] = [
    "distances by heat: factorisations",
    "distances by heat: a source",
    "vector heat: factorisations",
    "vector heat: transport",
    "vector heat: extension",
    "vector heat: logarithm",
    "signed distances",
    "smoothest lines",
    "stripes",
    "geodesic by flips",
    "geodesic by flips, again",
    "straightest geodesic",
];

pub(crate) fn print(meshes: &[(String, ManifoldMesh)], python: Option<&Path>, program: Option<&Path>) {
    println!(
        "| mesh | faces | task | ours, ms | potpourri3d, ms | potpourri3d / ours | geometry-central, ms | geometry-central / ours | difference |"
    );
    println!("|---|--:|---|--:|--:|--:|--:|--:|--:|");
    for (name, mesh) in meshes {
        measure(name, mesh, python, program);
    }
}

fn measure(name: &str, mesh: &ManifoldMesh, python: Option<&Path>, program: Option<&Path>) {
    let work = Work::new(mesh);
    let exchange = Exchange::new(name);
    work.write(&exchange);
    let [mut ours, mut potpourri, mut central] = [const { Vec::new() }; 3];
    let mut found = None;
    for _ in 0..TURNS {
        let (seconds, results) = work.turn();
        ours.push(seconds.to_vec());
        found = Some(results);
        if let Some(python) = python {
            exchange.run_python(python, "potpourri_speed.py");
            potpourri.push(exchange.read("seconds"));
        }
        if let Some(program) = program {
            exchange.run(Command::new(program).arg("speed"));
            central.push(exchange.read("seconds"));
        }
    }
    let differences = python.and(found).map(|found| found.differences(&exchange));
    for (row, task) in TASKS.iter().enumerate() {
        let median = |turns: &[Vec<f64>]| median(turns.iter().filter_map(|turn| turn.get(row).copied()));
        let Some(mine) = median(&ours) else { continue };
        let peer = |turns: &[Vec<f64>]| match median(turns) {
            Some(theirs) => format!("{} | {:.2}", told(theirs), theirs / mine),
            None => "– | –".to_owned(),
        };
        let difference = differences.and_then(|d| d[row]).map_or("–".to_owned(), |d| format!("{d:.0e}"));
        println!(
            "| {name} | {} | {task} | {} | {} | {} | {difference} |",
            mesh.face_count(),
            told(mine),
            peer(&potpourri),
            peer(&central)
        );
    }
}

/// Milliseconds with three digits.
fn told(seconds: f64) -> String {
    let milliseconds = 1e3 * seconds;
    match milliseconds {
        x if x < 10.0 => format!("{x:.3}"),
        x if x < 100.0 => format!("{x:.1}"),
        x => format!("{x:.0}"),
    }
}

fn median(times: impl Iterator<Item = f64>) -> Option<f64> {
    let mut times: Vec<f64> = times.filter(|t| t.is_finite()).collect();
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied()
}

/// What is computed on a mesh.
struct Work {
    mesh: TriangleMesh,
    manifold: ManifoldMesh,
    source: Vertex,
    target: Vertex,
    /// Pieces of a closed curve, an edge each.
    curves: Vec<[u32; 2]>,
    start: FacePoint,
    /// In the plane of the face, and in space.
    direction: ([f64; 2], DVec3),
    frequency: f64,
}

impl Work {
    fn new(mesh: &ManifoldMesh) -> Self {
        let intrinsic = IntrinsicMesh::from_mesh(mesh);
        let source = Vertex(0);
        let solver = HeatSolver::new(&intrinsic).expect("meshes have area");
        let distances =
            solver.distances(&[SurfacePoint::Vertex(source)]).expect("the source is there").values;
        let finite = |v: &Vertex| distances[v.index()].is_finite();
        let farthest = |a: &Vertex, b: &Vertex| distances[a.index()].total_cmp(&distances[b.index()]);
        let target = intrinsic.vertices().filter(finite).max_by(farthest).expect("the source is near");
        let length = distances[target.index()];
        // The border of the faces around the source within half of that.
        let is_near =
            |face: Face| intrinsic.face_vertices(face).iter().all(|v| distances[v.index()] < 0.5 * length);
        let border = intrinsic
            .halfedges()
            .filter(|&h| is_near(h.face()) && intrinsic.twin(h).is_some_and(|twin| !is_near(twin.face())));
        let curves = border.map(|h| [intrinsic.tail(h).0, intrinsic.tip(h).0]).collect();
        let start = FacePoint { face: Face(0), barycentric: [1.0 / 3.0; 3] };
        let [a, b, _] = intrinsic.face_vertices(start.face).map(|v| mesh.positions()[v.index()]);
        let along = (b - a).normalize();
        let (sin, cos) = 0.7_f64.sin_cos();
        let in_space = length * (cos * along + sin * mesh.face_normal(start.face).cross(along));
        Self {
            mesh: TriangleMesh::clone(mesh),
            manifold: mesh.clone(),
            source,
            target,
            curves,
            start,
            direction: ([length * cos, length * sin], in_space),
            frequency: frequency(&TangentBundle::new(&intrinsic)),
        }
    }

    fn write(&self, exchange: &Exchange) {
        let bundle = TangentBundle::new(&IntrinsicMesh::from_mesh(&self.manifold));
        exchange.write_mesh(&self.manifold, &bundle);
        exchange.write_numbers("source", &[self.source.0]);
        exchange.write_numbers("target", &[self.target.0]);
        exchange.write_numbers("curves", &self.curves.concat());
        exchange.write("frequency", &[self.frequency]);
        exchange.write("direction", &self.direction.1.to_array());
    }

    /// Seconds of every task. What needs a mesh begins with positions and faces, as potpourri3d does.
    fn turn(&self) -> ([f64; TASKS.len()], Results) {
        let manifold = || ManifoldMesh::try_from(self.mesh.clone()).expect("it was one");
        let intrinsic = || IntrinsicMesh::from_mesh(&manifold());
        let source = [SurfacePoint::Vertex(self.source)];
        let (heat_factors, heat) = timed(|| HeatSolver::new(&intrinsic()).expect("meshes have area"));
        let (distance, distances) = repeated(|| heat.distances(&source).expect("the source is there").values);
        let (factors, solver) = timed(|| VectorHeatSolver::new(&intrinsic()).expect("meshes have area"));
        let vector = [(self.source, Complex64::ONE)];
        let (transport, _) = repeated(|| solver.transport(&vector).expect("the source is there"));
        let two = [(self.source, 1.0), (Vertex::new(self.mesh.vertex_count() - 1), 3.0)];
        let (extension, _) = repeated(|| solver.extend(&two).expect("the sources are there"));
        let (logarithm, _) = repeated(|| solver.log_map(self.source).expect("the source is there"));
        let curves: Vec<Vec<SurfacePoint>> =
            self.curves.iter().map(|ends| ends.map(|v| SurfacePoint::Vertex(Vertex(v))).to_vec()).collect();
        let options = SignedHeatOptions::default();
        let (signed, _) = timed(|| {
            signed_distances(&intrinsic(), &curves, &[], &options, &NoProgress).expect("the curves are on it")
        });
        let bundle = TangentBundle::new(&intrinsic());
        let (smoothest, lines) =
            timed(|| DirectionField::smoothest(&bundle, 2, &NoProgress).expect("it converges"));
        let (stripes, _) =
            timed(|| StripePattern::new(&bundle, &lines, self.frequency, &NoProgress).expect("it converges"));
        let ends = [self.source, self.target];
        let through = |mesh: &ManifoldMesh| {
            geodesic_through(mesh, &ends, ThroughOptions::default(), &NoProgress).expect("they are connected")
        };
        let (flips, path) = timed(|| through(&manifold()));
        let (flips_again, _) = repeated(|| through(&self.manifold));
        let mesh = intrinsic();
        let (straightest, end) = repeated(|| {
            straightest_geodesic(&mesh, self.start, self.direction.0).expect("it starts on the mesh")
        });
        let corners = mesh.face_vertices(end.end.face).map(|v| self.mesh.positions()[v.index()]);
        let end = corners.iter().zip(end.end.barycentric).map(|(p, b)| *p * b).sum();
        let seconds = [
            heat_factors,
            distance,
            factors,
            transport,
            extension,
            logarithm,
            signed,
            smoothest,
            stripes,
            flips,
            flips_again,
            straightest,
        ];
        (seconds, Results { distances, path: path.length, end })
    }
}

/// What of ours should be the same as potpourri3d's.
struct Results {
    distances: Vec<f64>,
    path: f64,
    end: DVec3,
}

impl Results {
    /// For each task the largest difference: of distances in parts of the largest, of a path's length in parts of it, of the end of a
    /// straightest geodesic in parts of the largest distance.
    fn differences(&self, exchange: &Exchange) -> [Option<f64>; TASKS.len()] {
        let largest = self.distances.iter().copied().filter(|d| d.is_finite()).fold(0.0, f64::max);
        let theirs = exchange.read("distances");
        let pairs = self.distances.iter().zip(&theirs).filter(|(ours, _)| ours.is_finite());
        let mut differences = [None; TASKS.len()];
        differences[1] = Some(pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / largest);
        differences[9] = Some((exchange.read("path")[0] / self.path - 1.0).abs());
        differences[11] = Some(exchange.vectors("end")[0].distance(self.end) / largest);
        differences
    }
}

fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = processor_time();
    let result = work();
    ((processor_time() - start).as_secs_f64(), result)
}

/// The processor time of all threads so far, which other programs on the machine do not lengthen as they do that of the clock.
#[cfg(unix)]
fn processor_time() -> Duration {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Duration::try_from(time).expect("time does not run backwards")
}

#[cfg(not(unix))]
fn processor_time() -> Duration {
    std::time::SystemTime::UNIX_EPOCH.elapsed().expect("it is past 1970")
}

fn repeated<T>(work: impl Fn() -> T) -> (f64, T) {
    let (first, result) = timed(&work);
    let rest = (1..REPEATS).map(|_| timed(&work).0);
    let median = median(std::iter::once(first).chain(rest)).expect("it ran");
    (median, result)
}

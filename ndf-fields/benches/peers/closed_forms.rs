//! Fields beside closed forms, and beside potpourri3d's.
//!
//! Two meshes are made here: a sphere, whose closed forms are known, and a torus, of whose logarithms the exact ones stand for the
//! truth. Every row has the mean error of this crate, the mean error of potpourri3d, and the mean difference of both: of unit vectors
//! in parts of their length, of logarithms and distances in parts of the largest distance. What is farther from the source than 0.7 of
//! that, close to the cut locus, does not count in transport and logarithms. `traces` is how far potpourri3d's straightest geodesics end from
//! the vertices to which our exact logarithms lead.

use std::path::Path;

use ndf_core::{DVec3, NoProgress};
use ndf_fields::{Complex64, Frames, SignedHeatOptions, VectorHeatSolver, exact_log_map, signed_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleMesh, Vertex, shapes};

use crate::exchange::Exchange;

/// Logarithms and transport count up to this part of the largest distance.
const NEAR: f64 = 0.7;

pub(crate) fn print(python: Option<&Path>) {
    let sphere = shapes::icosphere(5);
    let axis = sphere.positions()[0];
    let equator = ring(&sphere, |p| p.dot(axis).abs() < 1e-9, axis);
    let at = |p: DVec3| p.dot(axis).clamp(-1.0, 1.0).asin();
    compare("sphere", sphere, &[equator], &at, true, python);
    let (outer, tube) = (1.0, 0.4);
    let torus = shapes::torus(120, 60, outer, tube);
    // The parallels farthest from the axis and closest to it bound the upper half.
    let on = |p: DVec3, radius: f64| p.z.abs() < 1e-9 && (p.x.hypot(p.y) - radius).abs() < 1e-6;
    let far = ring(&torus, |p| on(p, outer + tube), DVec3::Z);
    let near = ring(&torus, |p| on(p, outer - tube), -DVec3::Z);
    let at = |p: DVec3| {
        let angle = p.z.atan2(p.x.hypot(p.y) - outer);
        tube * angle.signum() * angle.abs().min(std::f64::consts::PI - angle.abs())
    };
    compare("torus", torus, &[far, near], &at, false, python);
}

/// The vertices of a level set, around an axis so that the side of the axis is on the right, back to the first.
fn ring(mesh: &TriangleMesh, is_on: impl Fn(DVec3) -> bool, axis: DVec3) -> Vec<u32> {
    let first = axis.any_orthonormal_vector();
    let angle = |v: u32| {
        let p = mesh.positions()[v as usize];
        -p.dot(axis.normalize().cross(first)).atan2(p.dot(first))
    };
    let mut ring: Vec<u32> =
        (0..mesh.vertex_count() as u32).filter(|&v| is_on(mesh.positions()[v as usize])).collect();
    ring.sort_by(|&a, &b| angle(a).total_cmp(&angle(b)));
    ring.push(ring[0]);
    ring
}

fn compare(
    name: &str,
    mesh: TriangleMesh,
    curves: &[Vec<u32>],
    signed: &dyn Fn(DVec3) -> f64,
    is_sphere: bool,
    python: Option<&Path>,
) {
    let mesh = ManifoldMesh::try_from(mesh).expect("shapes are manifolds");
    let intrinsic = IntrinsicMesh::from_mesh(&mesh);
    let frames = Frames::of(&mesh);
    let source = Vertex(100);
    let two = [Vertex(100), Vertex::new(mesh.vertex_count() - 40)];
    let solver = VectorHeatSolver::new(&intrinsic).expect("shapes have area");
    let [x, y] = frames.axes()[source.index()];
    let at_source = |z: &Complex64| x * z.re + y * z.im;

    let exact: Vec<DVec3> = exact_log_map(&intrinsic, source, &NoProgress)
        .expect("the source is there")
        .iter()
        .map(at_source)
        .collect();
    let heat: Vec<DVec3> =
        solver.log_map(source).expect("the source is there").values.iter().map(at_source).collect();
    let carried = solver.transport(&[(source, Complex64::ONE)]).expect("the source is there");
    let carried = frames.embed(&carried.values);
    let extended = solver.extend(&[(two[0], 1.0), (two[1], 3.0)]).expect("the sources are there").values;
    let points = |curve: &Vec<u32>| curve.iter().map(|&v| SurfacePoint::Vertex(Vertex(v))).collect();
    let curves_on: Vec<Vec<SurfacePoint>> = curves.iter().map(points).collect();
    let options = SignedHeatOptions::default();
    let distances = signed_distances(&intrinsic, &curves_on, &[], &options, &NoProgress)
        .expect("the curves are on it")
        .values;

    let size = exact.iter().map(|v| v.length()).fold(0.0, f64::max);
    let is_near = |v: usize| exact[v].length() < NEAR * size;
    let vertices = mesh.vertex_count();
    let origin = mesh.positions()[source.index()];
    let log_truth: Vec<DVec3> = if is_sphere {
        mesh.positions()
            .iter()
            .map(|p| {
                (*p - origin * p.dot(origin)).normalize_or_zero() * p.dot(origin).clamp(-1.0, 1.0).acos()
            })
            .collect()
    } else {
        exact.clone()
    };
    let transport_truth: Option<Vec<DVec3>> =
        is_sphere.then(|| mesh.positions().iter().map(|p| along_great_circle(origin, *p, x)).collect());
    let signed_truth: Vec<f64> = mesh.positions().iter().map(|p| signed(*p)).collect();
    let largest = signed_truth.iter().fold(0.0_f64, |m, d| m.max(d.abs()));

    let theirs = python.map(|python| {
        let exchange = Exchange::new(name);
        let flat = |vectors: &[DVec3]| vectors.iter().flat_map(DVec3::to_array).collect::<Vec<f64>>();
        exchange.write("positions", &flat(mesh.positions()));
        exchange.write_numbers("faces", &mesh.faces().concat());
        exchange.write_numbers("source", &[source.0]);
        exchange.write("vector", &x.to_array());
        exchange.write_numbers("two", &two.map(|v| v.0));
        let counted =
            |curve: &Vec<u32>| std::iter::once(curve.len() as u32).chain(curve.iter().copied()).collect();
        exchange
            .write_numbers("curves", &curves.iter().flat_map::<Vec<u32>, _>(counted).collect::<Vec<u32>>());
        exchange.write("ends", &flat(&exact));
        let version = exchange.run_python(python, "potpourri.py");
        (exchange, version)
    });
    let version = theirs.as_ref().map_or("not run", |(_, version)| version);
    println!("{name}, {vertices} vertices; potpourri3d: {version}");
    println!("{:<22} {:>10} {:>12} {:>12}", "", "our error", "their error", "difference");
    let vectors = |name: &str| theirs.as_ref().map(|(exchange, _)| exchange.vectors(name));
    let row = |what: &str, ours: &[DVec3], truth: Option<&[DVec3]>, theirs: Option<Vec<DVec3>>, unit: f64| {
        let mean = |a: &[DVec3], b: &[DVec3]| {
            let near: Vec<f64> =
                (0..vertices).filter(|&v| is_near(v)).map(|v| (a[v] - b[v]).length() / unit).collect();
            near.iter().sum::<f64>() / near.len() as f64
        };
        print_row(what, ours, truth, theirs.as_deref(), mean);
    };
    row("transport", &carried, transport_truth.as_deref(), vectors("transport"), 1.0);
    row("logarithm, exact", &exact, Some(&log_truth), vectors("log"), size);
    row("logarithm, heat", &heat, Some(&log_truth), vectors("log"), size);
    let traces = vectors("traces");
    if let Some(traces) = traces {
        let near: Vec<f64> = (0..vertices)
            .filter(|&v| is_near(v))
            .map(|v| (traces[v] - mesh.positions()[v]).length() / size)
            .collect();
        println!(
            "{:<22} {:>10} {:>12} {:>12.1e}",
            "traces",
            "",
            "",
            near.iter().sum::<f64>() / near.len() as f64
        );
    }
    let row = |what: &str, ours: &[f64], truth: Option<&[f64]>, theirs: Option<Vec<f64>>, unit: f64| {
        let mean = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).map(|(a, b)| (a - b).abs() / unit).sum::<f64>() / vertices as f64
        };
        print_row(what, ours, truth, theirs.as_deref(), mean);
    };
    let scalars = |name: &str| theirs.as_ref().map(|(exchange, _)| exchange.read(name));
    row("extension of 1 and 3", &extended, None, scalars("extend"), 2.0);
    row("signed distance", &distances, Some(&signed_truth), scalars("signed"), largest);
}

/// The mean errors of ours and of theirs, and the mean difference of both, as far as there are any.
fn print_row<T>(
    what: &str,
    ours: &[T],
    truth: Option<&[T]>,
    theirs: Option<&[T]>,
    mean: impl Fn(&[T], &[T]) -> f64,
) {
    let told = |value: Option<f64>| value.map_or("—".to_owned(), |value| format!("{value:.1e}"));
    let our_error = truth.map(|truth| mean(ours, truth));
    let their_error = truth.zip(theirs).map(|(truth, theirs)| mean(theirs, truth));
    let difference = theirs.map(|theirs| mean(ours, theirs));
    println!("{what:<22} {:>10} {:>12} {:>12}", told(our_error), told(their_error), told(difference));
}

/// The rotation of space that takes one unit vector to another along their great circle, of a tangent vector.
fn along_great_circle(from: DVec3, to: DVec3, vector: DVec3) -> DVec3 {
    let axis = from.cross(to);
    let Some(unit) = axis.try_normalize() else { return vector };
    ndf_core::glam::DQuat::from_axis_angle(unit, axis.length().atan2(from.dot(to))) * vector
}

//! What is computed on the mesh of a method, and a field that counts and times its queries.

use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use ndf::evaluate::{Candidate, SolveSeconds, SourceRule, Truth};
use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside, NoProgress};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::{ManifoldMesh, SelfIntersections};
use ndf_model::LengthFactors;

use super::row::{Run, load};
use super::truth::Subject;
use crate::performance::process::{median, timed};

/// What takes longer is timed once.
const SHORT: f64 = 2.0;

/// The mesh that a method makes, and what it cost.
pub(super) struct Made<'a> {
    pub(super) mesh: &'a ManifoldMesh,
    /// Where operators are made, if not on the mesh.
    pub(super) operators_on: Option<&'a IntrinsicMesh>,
    pub(super) factors: LengthFactors,
    pub(super) bytes: Option<usize>,
    pub(super) evaluations: Option<u64>,
    pub(super) seconds_making: Option<f64>,
    pub(super) seconds_queries: Option<f64>,
    pub(super) seconds_extraction: f64,
}

impl<'a> Made<'a> {
    /// A mesh that came out of a file.
    pub(super) fn of_file(mesh: &'a ManifoldMesh, bytes: usize, making: f64, extraction: f64) -> Self {
        Self {
            mesh,
            operators_on: None,
            factors: LengthFactors::ONE,
            bytes: Some(bytes),
            evaluations: None,
            seconds_making: Some(making),
            seconds_queries: None,
            seconds_extraction: extraction,
        }
    }
}

/// A run without figures yet.
fn named(subject: &Subject<'_>, method: &str, setting: &str) -> Result<Run, String> {
    let parts = subject.parts()?;
    Ok(Run {
        shape: subject.shape.name.clone(),
        kind: parts.opened.kind.to_string(),
        method: method.to_owned(),
        setting: setting.to_owned(),
        truth: parts.made.clone(),
        load: load(),
        ..Run::default()
    })
}

/// A run with all figures, or with the reason why there are none.
pub(super) fn measured(
    subject: &Subject<'_>,
    repeats: usize,
    (method, setting): (&str, &str),
    made: Result<Made<'_>, String>,
) -> Result<Run, String> {
    let mut run = named(subject, method, setting)?;
    let truth = &subject.parts()?.truth;
    match made.and_then(|made| put(&mut run, truth, repeats, &made)) {
        Ok(()) => Ok(run),
        Err(reason) => Ok(Run { left_out: reason, ..named(subject, method, setting)? }),
    }
}

fn put(run: &mut Run, truth: &Truth, repeats: usize, made: &Made<'_>) -> Result<(), String> {
    let candidate = Candidate { mesh: made.mesh, operators_on: made.operators_on };
    let solve = || truth.solve(&candidate, &SourceRule::ALL, &NoProgress).map_err(|e| e.to_string());
    let solved = solve()?;
    let mut seconds = vec![solved.seconds];
    while seconds.len() < repeats && solved.seconds.distances + solved.seconds.spectrum < SHORT {
        seconds.push(solve()?.seconds);
    }
    let median_of = |stage: fn(&SolveSeconds) -> f64| Some(median(seconds.iter().map(stage).collect()));
    let [errors, plain] = [made.factors, LengthFactors::ONE].map(|f| truth.errors(&solved, f));
    run.put_errors(&errors, &plain);
    run.vertices = Some(made.mesh.vertex_count());
    run.faces = Some(made.mesh.face_count());
    run.self_intersections = SelfIntersections::of(made.mesh, &NoProgress).ok().map(|found| found.pairs);
    run.bytes = made.bytes;
    run.evaluations = made.evaluations;
    run.seconds_making = made.seconds_making;
    run.seconds_queries = made.seconds_queries;
    run.seconds_extraction = Some(made.seconds_extraction);
    run.seconds_geodesics = median_of(|s| s.distances);
    run.seconds_eigenvalues = median_of(|s| s.spectrum);
    run.seconds_transfer = median_of(|s| s.transfer);
    run.repeats = Some(seconds.len());
    Ok(())
}

/// The median seconds of some work, done once if that is long, and its result.
pub(super) fn repeated<T>(repeats: usize, work: impl Fn() -> T) -> (f64, T) {
    let (first, mut result) = timed(&work);
    let mut seconds = vec![first];
    while seconds.len() < repeats && first < SHORT {
        let again;
        (again, result) = timed(&work);
        seconds.push(again);
    }
    (median(seconds), result)
}

/// A field that counts its queries and the time they take, of all threads together.
pub(super) struct Timed<'a> {
    field: &'a dyn ImplicitField,
    count: AtomicU64,
    nanoseconds: AtomicU64,
}

impl<'a> Timed<'a> {
    pub(super) fn new(field: &'a dyn ImplicitField) -> Self {
        Self { field, count: AtomicU64::new(0), nanoseconds: AtomicU64::new(0) }
    }

    /// How many points were asked.
    pub(super) fn queries(&self) -> u64 {
        self.count.load(Ordering::Relaxed)
    }

    /// The wall seconds of queries within some wall seconds of work: the time of all threads, divided by their number.
    pub(super) fn seconds(&self, within: f64) -> f64 {
        let all = self.nanoseconds.load(Ordering::Relaxed) as f64 * 1e-9;
        (all / rayon::current_num_threads() as f64).min(within)
    }

    fn timed(&self, points: usize, work: impl FnOnce()) {
        let start = Instant::now();
        work();
        self.count.fetch_add(points as u64, Ordering::Relaxed);
        self.nanoseconds.fetch_add(start.elapsed().as_nanos() as u64, Ordering::Relaxed);
    }
}

impl ImplicitField for Timed<'_> {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        self.timed(points.len(), || self.field.values(points, values));
    }

    fn gradients(&self, points: &[DVec3], gradients: &mut [DVec3]) {
        self.timed(points.len(), || self.field.gradients(points, gradients));
    }

    fn bounds(&self) -> BoundingBox {
        self.field.bounds()
    }

    fn level(&self) -> f64 {
        self.field.level()
    }

    fn inside(&self) -> Inside {
        self.field.inside()
    }

    fn lipschitz(&self) -> Option<f64> {
        self.field.lipschitz()
    }

    fn difference_step(&self) -> f64 {
        self.field.difference_step()
    }
}

#[cfg(test)]
mod tests {
    use ndf_core::analytic::Sphere;

    use super::*;

    #[test]
    fn queries_are_counted_and_take_no_longer_than_all_work() {
        let field = Timed::new(&Sphere::UNIT);
        let mut values = [0.0; 3];
        field.values(&[DVec3::ZERO, DVec3::X, DVec3::ONE], &mut values);
        assert_eq!((values[0], field.queries()), (-1.0, 3));
        assert_eq!(field.seconds(0.0), 0.0);
        assert!(field.seconds(10.0) < 10.0);
    }
}

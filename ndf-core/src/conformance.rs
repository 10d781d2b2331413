//! The laws every [`Surface`] must keep, as functions and a macro that makes tests of them.
//!
//! A crate that brings a representation writes among its tests
//!
//! ```
//! use ndf_core::conformance::Facts;
//! use ndf_core::{DVec3, analytic::Sphere};
//!
//! ndf_core::surface_conformance!(ball, Sphere::UNIT, Facts::closed().through([DVec3::X, -DVec3::Z]));
//! # Facts::closed().through([DVec3::X]).hold_for(&Sphere::UNIT);
//! ```
//!
//! which makes a module `ball` with a test for each law. A law panics where the surface breaks it, and says how.
//!
//! A surface alone cannot tell whether it is the one that was meant: [`Facts`] say what is known of it. Without facts a
//! surface is taken to be closed, and nothing is known of where it lies.

use crate::project::projected;
use crate::{DVec3, Hint, Inside, Miss, Query, Surface};

/// Makes a module of tests, one for each law, of a surface given by an expression. The third argument, if there is
/// one, is what is known of the surface: its [`Facts`].
#[macro_export]
macro_rules! surface_conformance {
    ($name:ident, $surface:expr $(,)?) => {
        $crate::surface_conformance!($name, $surface, $crate::conformance::Facts::closed());
    };
    ($name:ident, $surface:expr, $facts:expr $(,)?) => {
        mod $name {
            use super::*;

            #[test]
            fn feet_lie_on_the_surface() {
                $crate::conformance::feet_lie_on_the_surface(&$surface);
            }
            #[test]
            fn facts_hold() {
                $facts.hold_for(&$surface);
            }
            #[test]
            fn projection_is_idempotent() {
                $crate::conformance::projection_is_idempotent(&$surface);
            }
            #[test]
            fn normals_are_unit_and_outward() {
                $crate::conformance::normals_are_unit_and_outward(&$surface);
            }
            #[test]
            fn batches_change_nothing() {
                $crate::conformance::batches_change_nothing(&$surface);
            }
            #[test]
            fn threads_change_nothing() {
                $crate::conformance::threads_change_nothing(&$surface);
            }
            #[test]
            fn hints_change_nothing() {
                $crate::conformance::hints_change_nothing(&$surface);
            }
            #[test]
            fn bad_queries_are_survived() {
                $crate::conformance::bad_queries_are_survived(&$surface);
            }
            #[test]
            fn gradients_agree_with_differences() {
                $crate::conformance::gradients_agree_with_differences(&$surface);
            }
        }
    };
}

/// What is known of a surface beside what it answers.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    open: bool,
    points: Vec<DVec3>,
}

/// Share of the points outside the bounds that must see the outside of a closed surface.
const REQUIRED_FACING: f64 = 0.95;

impl Facts {
    /// The surface encloses a volume: seen from outside its bounds, normals point to the viewer.
    pub fn closed() -> Self {
        Self::default()
    }

    /// The surface has a boundary, so that both of its sides can be seen from outside.
    pub fn open() -> Self {
        Self { open: true, ..Self::default() }
    }

    /// The surface passes through these points.
    #[must_use]
    pub fn through(mut self, points: impl IntoIterator<Item = DVec3>) -> Self {
        self.points.extend(points);
        self
    }

    /// A test: the surface is as these facts say.
    ///
    /// # Panics
    /// If normals of a closed surface point inward, or a known point is farther from its foot than twice the tolerance.
    pub fn hold_for(&self, surface: &dyn Surface) {
        let known: Vec<Query> = self.points.iter().map(|&p| Query::at(p)).collect();
        for (query, foot) in known.iter().zip(projected(surface, &known)) {
            let p = query.point;
            let foot = foot.unwrap_or_else(|miss| panic!("{p} of the surface has no foot: {miss}"));
            let off = foot.point.distance(p);
            assert!(off <= 2.0 * surface.tolerance(), "{p} of the surface has its foot {off} away: {foot:?}");
        }
        if self.open {
            return;
        }
        let bounds = surface.bounds();
        let mut outside = cloud(surface, 2000);
        outside.retain(|&p| bounds.distance_squared(p) > 0.0);
        let queries: Vec<Query> = outside.into_iter().map(Query::at).collect();
        let feet = projected(surface, &queries);
        let facing = queries.iter().zip(&feet).filter_map(|(query, foot)| {
            let foot = foot.ok()?;
            Some((query.point - foot.point).dot(foot.normal) > 0.0)
        });
        let (good, all) = facing.fold((0, 0), |(good, all), facing| (good + usize::from(facing), all + 1));
        let share = good as f64 / f64::from(all.max(1));
        assert!(
            all == 0 || share >= REQUIRED_FACING,
            "only {:.1} % of the normals seen from outside the bounds point outward; turn them, or say \
             `Facts::open()` if the surface encloses nothing",
            100.0 * share
        );
    }
}

/// Share of the queries near the surface that must find a foot.
const REQUIRED_HITS: f64 = 0.9;

/// A deterministic low-discrepancy cloud in the box of the surface, padded by a tenth of its diagonal
/// (R₃ sequence, Roberts 2018).
pub fn cloud(surface: &dyn Surface, count: usize) -> Vec<DVec3> {
    let bounds = surface.bounds();
    assert!(bounds.min.is_finite() && bounds.max.is_finite() && !bounds.is_empty(), "bounds: {bounds:?}");
    let bounds = bounds.padded(0.1 * bounds.diagonal());
    let g = 1.220_744_084_605_76_f64;
    let steps = DVec3::new(g.recip(), g.powi(-2), g.powi(-3));
    let point = |i: usize| bounds.min + bounds.extent() * (DVec3::splat(0.5) + steps * i as f64).fract();
    (0..count).map(point).collect()
}

/// Points within a fiftieth of the diagonal of the surface: feet of the cloud, moved a little.
pub fn near_queries(surface: &dyn Surface) -> Vec<Query> {
    let cloud = cloud(surface, 600);
    let queries: Vec<Query> = cloud.iter().map(|&p| Query::at(p)).collect();
    let feet = projected(surface, &queries);
    let radius = 0.02 * surface.bounds().diagonal();
    let center = surface.bounds().center();
    let near: Vec<Query> = feet
        .iter()
        .zip(&cloud)
        .filter_map(|(foot, p)| foot.ok().map(|f| (f, *p)))
        .map(|(foot, p)| {
            let away = (p - center).normalize_or_zero() * radius;
            Query { point: foot.point + away, normal: Some(foot.normal), hint: Hint::NONE }
        })
        .collect();
    assert!(near.len() >= 60, "only {} of 600 points of the box found a foot", near.len());
    near
}

fn hits(surface: &dyn Surface, queries: &[Query]) -> Vec<(Query, crate::Foot)> {
    let feet = projected(surface, queries);
    let hits: Vec<_> = queries.iter().zip(&feet).filter_map(|(q, f)| f.ok().map(|f| (*q, f))).collect();
    let share = hits.len() as f64 / queries.len() as f64;
    assert!(share >= REQUIRED_HITS, "only {:.1} % of the queries found a foot", 100.0 * share);
    hits
}

/// Feet are finite and inside the bounds; where the surface has a field, they are on its level within the
/// claimed tolerance.
pub fn feet_lie_on_the_surface(surface: &dyn Surface) {
    let tolerance = surface.tolerance();
    let hits = hits(surface, &near_queries(surface));
    let bounds = surface.bounds().padded(2.0 * tolerance);
    for (query, foot) in &hits {
        assert!(foot.point.is_finite(), "{query:?} → {foot:?}");
        assert_eq!(bounds.distance_squared(foot.point), 0.0, "{query:?} → {foot:?} outside the bounds");
    }
    if let Some(field) = surface.as_field() {
        // On the level within the tolerance: the field changes sign between both ends of a short segment along
        // the normal, or its value is within what its slope allows.
        let step = 4.0 * tolerance.max(1e-9 * bounds.diagonal());
        let ends: Vec<DVec3> =
            hits.iter().flat_map(|(_, f)| [f.point - f.normal * step, f.point + f.normal * step]).collect();
        let mut values = vec![0.0; ends.len()];
        field.values(&ends, &mut values);
        let inner_is_inside = |v: &[f64]| match field.inside() {
            Inside::Below => v[0] <= field.level() && v[1] >= field.level(),
            Inside::Above => v[0] >= field.level() && v[1] <= field.level(),
        };
        let good = values.chunks_exact(2).filter(|v| inner_is_inside(v)).count();
        let share = good as f64 / hits.len() as f64;
        assert!(share >= 0.95, "the field crosses its level at only {:.1} % of the feet", 100.0 * share);
    }
}

/// The foot of a foot is that foot.
pub fn projection_is_idempotent(surface: &dyn Surface) {
    let hits = hits(surface, &near_queries(surface));
    let again: Vec<Query> =
        hits.iter().map(|(_, f)| Query { point: f.point, normal: Some(f.normal), hint: f.hint }).collect();
    let tolerance = 2.0 * surface.tolerance();
    for ((_, first), second) in hits.iter().zip(projected(surface, &again)) {
        let second = second.unwrap_or_else(|miss| panic!("{first:?} has no foot: {miss}"));
        let moved = first.point.distance(second.point);
        assert!(moved <= tolerance, "{first:?} moved by {moved}");
    }
}

/// Normals have length 1 and, where the surface has a field, point to the outside.
pub fn normals_are_unit_and_outward(surface: &dyn Surface) {
    let hits = hits(surface, &near_queries(surface));
    for (query, foot) in &hits {
        assert!((foot.normal.length() - 1.0).abs() < 1e-6, "{query:?} → {foot:?}");
    }
    if let Some(field) = surface.as_field() {
        let step = (1e-3 * surface.bounds().diagonal()).max(4.0 * surface.tolerance());
        let ends: Vec<DVec3> =
            hits.iter().flat_map(|(_, f)| [f.point - f.normal * step, f.point + f.normal * step]).collect();
        let mut values = vec![0.0; ends.len()];
        field.values(&ends, &mut values);
        let outward = |v: &[f64]| match field.inside() {
            Inside::Below => v[0] < v[1],
            Inside::Above => v[0] > v[1],
        };
        let good = values.chunks_exact(2).filter(|v| outward(v)).count();
        let share = good as f64 / hits.len() as f64;
        assert!(share >= 0.95, "only {:.1} % of the normals point outward", 100.0 * share);
    }
}

/// An answer is the same alone and in a batch.
pub fn batches_change_nothing(surface: &dyn Surface) {
    let queries = near_queries(surface);
    let together = projected(surface, &queries);
    for (query, expected) in queries.iter().zip(together).step_by(7) {
        let mut alone = [Err(Miss::OutOfReach)];
        surface.project(std::slice::from_ref(query), &mut alone);
        assert_same(surface, &alone[0], &expected, query);
    }
}

/// An answer is the same on one thread and on several.
pub fn threads_change_nothing(surface: &dyn Surface) {
    let queries = near_queries(surface);
    let mut serial = vec![Err(Miss::OutOfReach); queries.len()];
    surface.project(&queries, &mut serial);
    for ((query, one), many) in queries.iter().zip(serial).zip(projected(surface, &queries)) {
        assert_same(surface, &one, &many, query);
    }
}

/// A hint, right or wrong, changes no distance.
pub fn hints_change_nothing(surface: &dyn Surface) {
    let queries = near_queries(surface);
    let cold = projected(surface, &queries);
    let hint_of = |i: usize| cold[i % cold.len()].map_or(Hint::NONE, |f| f.hint);
    for shift in [0, 1, 17] {
        let hinted: Vec<Query> =
            queries.iter().enumerate().map(|(i, q)| Query { hint: hint_of(i + shift), ..*q }).collect();
        let mut differing = 0;
        for (i, warm) in projected(surface, &hinted).iter().enumerate() {
            let distance = |foot: &crate::Answer| foot.map(|f| f.point.distance(queries[i].point)).ok();
            let same = match (distance(warm), distance(&cold[i])) {
                (Some(a), Some(b)) => (a - b).abs() <= 2.0 * surface.tolerance(),
                (a, b) => a == b,
            };
            differing += usize::from(!same);
        }
        assert_eq!(differing, 0, "hints shifted by {shift} changed {differing} of {} answers", queries.len());
    }
}

/// Queries with NaN or infinity miss; far ones answer or miss; none disturbs its neighbours.
pub fn bad_queries_are_survived(surface: &dyn Surface) {
    let good = near_queries(surface);
    let (a, b) = (good[0], good[good.len() / 2]);
    let far = surface.bounds().center() + DVec3::splat(1e6 * surface.bounds().diagonal());
    let bad = [
        a,
        Query::at(DVec3::NAN),
        Query::at(DVec3::new(0.0, f64::INFINITY, 0.0)),
        Query::at(far),
        Query { normal: Some(DVec3::ZERO), ..a },
        Query { normal: Some(DVec3::NAN), ..a },
        Query { hint: Hint(u32::MAX - 1), ..a },
        b,
    ];
    let feet = projected(surface, &bad);
    assert_eq!(feet[1], Err(Miss::NotFinite));
    assert_eq!(feet[2], Err(Miss::NotFinite));
    assert!(feet[3].is_err() || feet[3].is_ok_and(|f| f.point.is_finite()));
    for i in [4, 5, 6] {
        assert!(feet[i].is_err() || feet[i].is_ok_and(|f| f.point.is_finite() && f.normal.is_finite()));
    }
    for (i, query) in [(0, a), (7, b)] {
        assert_same(surface, &feet[i], &projected(surface, &[query])[0], &query);
    }
    surface.project(&[], &mut []);
}

/// Where the surface has a field, its gradients agree with central differences of its values.
pub fn gradients_agree_with_differences(surface: &dyn Surface) {
    let Some(field) = surface.as_field() else { return };
    let points: Vec<DVec3> = near_queries(surface).iter().map(|q| q.point).collect();
    let mut gradients = vec![DVec3::ZERO; points.len()];
    field.gradients(&points, &mut gradients);
    let h = field.difference_step();
    let mut agree = 0;
    for (&p, &g) in points.iter().zip(&gradients) {
        let stencil: Vec<DVec3> = DVec3::AXES.iter().flat_map(|&axis| [p + axis * h, p - axis * h]).collect();
        let mut v = [0.0; 6];
        field.values(&stencil, &mut v);
        let difference = DVec3::new(v[0] - v[1], v[2] - v[3], v[4] - v[5]) / (2.0 * h);
        agree += usize::from((g - difference).length() <= 1e-2 * difference.length().max(1e-9));
    }
    // A field may have creases (a distance field has them on the medial axis).
    let share = agree as f64 / points.len() as f64;
    assert!(share >= 0.9, "gradients agree with differences at only {:.1} % of the points", 100.0 * share);
}

fn assert_same(surface: &dyn Surface, a: &crate::Answer, b: &crate::Answer, query: &Query) {
    match (a, b) {
        (Ok(a), Ok(b)) => {
            let apart = a.point.distance(b.point);
            assert!(apart <= 2.0 * surface.tolerance(), "{query:?}: feet {apart} apart: {a:?}, {b:?}");
        }
        _ => assert_eq!(a.is_err(), b.is_err(), "{query:?}: {a:?} against {b:?}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::Torus;
    use crate::{Answer, BoundingBox};

    /// The answers of a torus under other normals, without its field.
    struct Turned(Torus, f64);

    impl Surface for Turned {
        fn bounds(&self) -> BoundingBox {
            Surface::bounds(&self.0)
        }

        fn project(&self, queries: &[Query], feet: &mut [Answer]) {
            self.0.project(queries, feet);
            feet.iter_mut().flatten().for_each(|foot| foot.normal *= self.1);
        }
    }

    const TORUS: Torus = Torus { center: DVec3::ZERO, ring: 1.0, tube: 0.3 };

    #[test]
    fn facts_hold_without_a_field() {
        Facts::closed().through([DVec3::new(1.3, 0.0, 0.0)]).hold_for(&Turned(TORUS, 1.0));
        Facts::open().hold_for(&Turned(TORUS, -1.0));
    }

    #[test]
    #[should_panic(expected = "point outward")]
    fn inward_normals_are_caught_without_a_field() {
        Facts::closed().hold_for(&Turned(TORUS, -1.0));
    }

    #[test]
    #[should_panic(expected = "has its foot")]
    fn a_wrong_radius_is_caught_without_a_field() {
        let thick = Torus { tube: 0.31, ..TORUS };
        Facts::closed().through([DVec3::new(1.3, 0.0, 0.0)]).hold_for(&Turned(thick, 1.0));
    }
}

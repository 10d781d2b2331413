//! The metric of the true surface, measured with the model that was learned from it.
//!
//! Only projections are asked of the surface. The corners of the model's triangles, projected, are those of triangles
//! between points of the true surface; the area over such a triangle is the area of the triangle over the cosine of the
//! angle between its normal and the true one, taken at a point of it that is as good as random: a fixed one is seldom
//! beyond an edge that the triangle straddles, and would miss the area there. That is exact in the mean where the surface
//! is a mesh of flat faces, and of second order in the triangles' size where it is curved, an error that four triangles
//! and the one they divide tell from each other (Richardson 1911). Where triangles are no smaller than faces, some
//! ten-thousandths of the area are missed; a surface that knows its area is asked for it.

use std::time::Instant;

use ndf_core::{DVec3, Hint, Query, Surface, projected};
use ndf_model::{Metric, Similarity};
use rayon::prelude::*;
use serde::Serialize;

/// The least cosine between a triangle and the true surface above it: areas over steeper ones are those of this one.
const MIN_COSINE: f64 = 0.25;

/// Feet of a triangle's corners are on different sheets of the surface if they span more than so many times its area, or are tilted
/// against it by more than an angle of this cosine. A handful of such triangles, as level sets have them, outweighs what all others
/// say.
const MAX_STRETCH: f64 = 4.0;
const MIN_TILT: f64 = 0.5;

/// An area that is known and the one that is measured differ by less, as shares, if they are those of the same surface.
const SAME: f64 = 1e-3;

/// The f-th point of a sequence that fills a triangle evenly, as barycentric coordinates (Roberts 2018, R₂).
fn spread(f: usize) -> [f64; 3] {
    // Powers of the reciprocal of the plastic number, the root of x³ = x + 1.
    let [x, y] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2].map(|a| (0.5 + a * f as f64).fract());
    if x + y < 1.0 { [1.0 - x - y, x, y] } else { [x + y - 1.0, 1.0 - x, 1.0 - y] }
}

/// The largest share of the model's area that may have no true area over it, of what the area is to be corrected by. Where
/// a model is folded, as thin walls are, one factor made all distances nearly three times worse. Where the area is known, what is
/// missed is no part of it, and may be as much as areas may differ.
const MAX_MISSED: f64 = 0.25;

/// How the metric was measured.
#[derive(Clone, Copy, Debug, Serialize)]
#[non_exhaustive]
pub struct MetricReport {
    /// Area of the true surface over that of the model.
    pub area_ratio: f64,
    /// Share of the model's area that was left out, since a corner or the point inside of triangles has no foot that
    /// faces the same way.
    pub missed_fraction: f64,
    /// Wall seconds.
    pub seconds: f64,
}

/// Measures the metric of `truth` over triangles of the model in the box, which should be as fine as the model's
/// details: faces 4 f, …, 4 f + 3 are one face divided as
/// [`Refinement::refined`](ndf_mesh::subdivision::Refinement::refined) does. `None` if they have no area or the surface
/// is out of reach, or so folded that what has no foot counts beside the correction. A projection for each vertex and each face.
pub fn measure_metric(
    truth: &dyn Surface,
    similarity: &Similarity,
    points: &[DVec3],
    faces: &[[u32; 3]],
) -> Option<(Metric, MetricReport)> {
    let started = Instant::now();
    let corners = |face: &[u32; 3], of: &[DVec3]| face.map(|v| of[v as usize]);
    let crosses: Vec<DVec3> = faces.par_iter().map(|face| cross(corners(face, points))).collect();
    let mut normals = vec![DVec3::ZERO; points.len()];
    for (face, cross) in faces.iter().zip(&crosses) {
        face.iter().for_each(|&v| normals[v as usize] += *cross);
    }
    let query =
        |point: DVec3, normal: DVec3, hint: Hint| Query { point, normal: normal.try_normalize(), hint };
    let queries = points.iter().zip(&normals).map(|(&p, &n)| query(similarity.to_world(p), n, Hint::NONE));
    let feet = projected(truth, &queries.collect::<Vec<_>>());
    let inside = faces.par_iter().zip(&crosses).enumerate().map(|(f, (face, &normal))| {
        let foot = |v: u32| feet[v as usize].ok().map(|foot| foot.point);
        let hint = feet[face[0] as usize].map_or(Hint::NONE, |foot| foot.hint);
        let at_feet = match face.map(foot) {
            [Some(a), Some(b), Some(c)] => [a, b, c],
            _ => corners(face, points).map(|p| similarity.to_world(p)),
        };
        query(at(spread(f), at_feet), normal, hint)
    });
    let inside = projected(truth, &inside.collect::<Vec<_>>());
    // The true area over a triangle, in the box: its corners, and the face that has its point inside.
    let scale = similarity.scale();
    let over = |corners: [u32; 3], point: usize| {
        let facing = |v: u32| {
            let foot = feet[v as usize].ok()?;
            (foot.normal.dot(normals[v as usize]) > 0.0).then_some(foot.point)
        };
        let [a, b, c] = corners.map(facing);
        let foot = inside[point].ok().filter(|foot| foot.normal.dot(crosses[point]) > 0.0)?;
        let triangle = scale * scale * cross([a?, b?, c?]);
        let own = cross(corners.map(|v| points[v as usize]));
        let (size, own_size) = (triangle.length(), own.length());
        if size > MAX_STRETCH * own_size || triangle.dot(own) < MIN_TILT * size * own_size {
            return None;
        }
        let cosine = triangle.normalize_or_zero().dot(foot.normal).max(MIN_COSINE);
        Some(0.5 * size / cosine)
    };
    // Of four triangles, their own area and the true one over them.
    let areas = faces.as_chunks::<4>().0.par_iter().enumerate().map(|(f, four)| {
        let own: f64 = (0..4).map(|c| 0.5 * crosses[4 * f + c].length()).sum();
        let fine: Option<f64> = (0..4).map(|c| over(four[c], 4 * f + c)).sum();
        // A point of any of the four is one of the face they divide.
        let coarse = over([four[0][0], four[1][1], four[2][2]], 4 * f + f % 4);
        // What is left of an error of second order.
        (own, fine.zip(coarse).map(|(fine, coarse)| fine + (fine - coarse) / 3.0))
    });
    let areas: Vec<(f64, Option<f64>)> = areas.collect();
    let (mut all, mut seen, mut true_area) = (0.0, 0.0, 0.0);
    for (own, truth) in areas {
        all += own;
        if let Some(truth) = truth {
            seen += own;
            true_area += truth;
        }
    }
    let measured = true_area / seen;
    // What is known exactly is used where it is the area of the same part of the surface.
    let known = truth.area().map(|area| scale * scale * area / all);
    let known = known.filter(|known| (known / measured - 1.0).abs() < SAME);
    let area_ratio = known.unwrap_or(measured);
    let missed_fraction = 1.0 - seen / all;
    // What rounding leaves of a sum is not missing.
    let may_miss = known.map_or(1e-9, |_| SAME).max(MAX_MISSED * (area_ratio - 1.0).abs());
    if missed_fraction > may_miss {
        return None;
    }
    let metric = Metric::new((all * area_ratio) as f32, Metric::EXPONENT).ok()?;
    let seconds = started.elapsed().as_secs_f64();
    Some((metric, MetricReport { area_ratio, missed_fraction, seconds }))
}

fn at([x, y, z]: [f64; 3], [a, b, c]: [DVec3; 3]) -> DVec3 {
    x * a + y * b + z * c
}

fn cross([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::analytic::Sphere;
    use ndf_core::glam::DMat3;
    use ndf_core::{Answer, BoundingBox, Foot};
    use ndf_mesh::subdivision::{Refinement, Side};
    use ndf_mesh::{ManifoldMesh, TriangleMesh, TriangleTree, shapes};
    use std::f64::consts::PI;

    /// Points of a sphere, and faces as they come from subdivision.
    fn sphere(radius: f64) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        divided_sphere(radius, 3)
    }

    fn divided_sphere(radius: f64, rounds: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let base = ManifoldMesh::try_from(shapes::icosphere(1)).unwrap();
        let (mut points, mut level) = (base.positions().to_vec(), Refinement::from_mesh(&base));
        for _ in 0..rounds {
            let middle = |side: &Side| side.ends.map(|v| points[v as usize]).into_iter().sum::<DVec3>();
            let new: Vec<DVec3> = level.edges().iter().map(|side| middle(side).normalize()).collect();
            points.extend(new);
            level = level.refined();
        }
        (points.into_iter().map(|p| radius * p).collect(), level.faces().to_vec())
    }

    /// A sphere of which only feet are known.
    struct Felt(Sphere);

    impl Surface for Felt {
        fn bounds(&self) -> BoundingBox {
            Surface::bounds(&self.0)
        }

        fn project(&self, queries: &[Query], feet: &mut [Answer]) {
            self.0.project(queries, feet);
        }
    }

    /// The triangles lack a thousandth of the sphere's area, the metric next to none of it.
    #[test]
    fn a_sphere_has_its_area() {
        let similarity = Similarity::new(1.5, DVec3::ONE).unwrap();
        let truth = Felt(Sphere { center: DVec3::ONE, radius: 1.0 });
        for radius in [1.5, 1.4, 1.55] {
            let (points, faces) = sphere(radius);
            let (metric, report) = measure_metric(&truth, &similarity, &points, &faces).unwrap();
            let exact = 4.0 * PI * 1.5 * 1.5;
            assert!((f64::from(metric.area()) / exact - 1.0).abs() < 1e-4, "{metric:?}");
            assert_eq!(report.missed_fraction, 0.0);
            let own = TriangleMesh::new(points, faces).unwrap().area();
            assert!((report.area_ratio * own / exact - 1.0).abs() < 1e-4);
            assert!((metric.factors(own).operators * radius / 1.5 - 1.0).abs() < 1e-3);
        }
    }

    /// A surface whose feet jump above a height.
    struct Jumping<S>(S, f64);

    impl<S: Surface> Surface for Jumping<S> {
        fn bounds(&self) -> BoundingBox {
            self.0.bounds()
        }

        fn project(&self, queries: &[Query], feet: &mut [Answer]) {
            self.0.project(queries, feet);
            for foot in feet.iter_mut().filter(|foot| foot.is_ok_and(|foot| foot.point.z > self.1)) {
                // Aside, and facing the same way.
                *foot = foot.map(|foot| Foot { point: foot.point + DVec3::X, ..foot });
            }
        }

        fn area(&self) -> Option<f64> {
            self.0.area()
        }
    }

    /// Feet that jump to another sheet are none.
    #[test]
    fn a_few_feet_elsewhere_change_no_area() {
        let (points, faces) = sphere(0.9);
        let truth = Jumping(Felt(Sphere::UNIT), 0.99);
        let (metric, report) = measure_metric(&truth, &Similarity::IDENTITY, &points, &faces).unwrap();
        assert!((f64::from(metric.area()) / (4.0 * PI) - 1.0).abs() < 1e-3, "{metric:?} {report:?}");
        assert!(report.missed_fraction > 0.0, "{report:?}");
    }

    /// A model that is the surface, but for its chords, has little to be corrected, which a few missing feet hide unless the area
    /// is known.
    #[test]
    fn a_known_area_needs_not_every_foot() {
        let (points, faces) = divided_sphere(0.9999, 5);
        let measure = |truth: &dyn Surface| measure_metric(truth, &Similarity::IDENTITY, &points, &faces);
        let (metric, report) = measure(&Jumping(Sphere::UNIT, 0.9999)).unwrap();
        assert_eq!(metric.area(), (4.0 * PI) as f32);
        let missed = report.missed_fraction;
        assert!(missed > MAX_MISSED * (report.area_ratio - 1.0) && missed < SAME, "{report:?}");
        assert!(measure(&Jumping(Felt(Sphere::UNIT), 0.9999)).is_none());
    }

    /// What a surface knows is believed, if it can be of the same part of it.
    #[test]
    fn known_areas_are_exact() {
        let (points, faces) = sphere(0.9);
        let area = |truth: &dyn Surface| {
            let (metric, _) = measure_metric(truth, &Similarity::IDENTITY, &points, &faces).unwrap();
            metric.area()
        };
        assert_eq!(area(&Sphere::UNIT), (4.0 * PI) as f32);
        /// Some of it is out of sight.
        struct Larger;
        impl Surface for Larger {
            fn bounds(&self) -> BoundingBox {
                Surface::bounds(&Sphere::UNIT)
            }

            fn project(&self, queries: &[Query], feet: &mut [Answer]) {
                Sphere::UNIT.project(queries, feet);
            }

            fn area(&self) -> Option<f64> {
                Some(1.005 * 4.0 * PI)
            }
        }
        assert_eq!(area(&Larger), area(&Felt(Sphere::UNIT)));
    }

    /// A mesh of flat faces.
    struct Polyhedron(TriangleMesh, TriangleTree);

    impl Surface for Polyhedron {
        fn bounds(&self) -> BoundingBox {
            self.0.bounds()
        }

        fn project(&self, queries: &[Query], feet: &mut [Answer]) {
            for (query, foot) in queries.iter().zip(feet) {
                let closest = self.1.closest_point(query.point, query.hint).unwrap();
                let face = self.0.faces()[closest.at.face.index()].map(|v| self.0.positions()[v as usize]);
                let normal = cross(face).normalize();
                *foot = Ok(Foot { point: closest.point, normal, hint: closest.hint() });
            }
        }
    }

    /// Triangles that straddle edges in all ways tell the area there, too, which the triangles themselves lack.
    #[test]
    fn a_polyhedron_has_its_area() {
        let mesh = shapes::icosphere(1);
        let truth = Polyhedron(mesh.clone(), TriangleTree::new(&mesh));
        let (mut points, faces) = sphere(0.96);
        let turned = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -2.0) / 3.0, 0.3);
        points.iter_mut().for_each(|p| *p = turned * *p);
        let (metric, _) = measure_metric(&truth, &Similarity::IDENTITY, &points, &faces).unwrap();
        let off = f64::from(metric.area()) / truth.0.area() - 1.0;
        assert!(off.abs() < 6e-4, "{off}");
    }

    /// A model turned inside out faces no part of the surface.
    #[test]
    fn without_feet_there_is_no_metric() {
        let (mut points, faces) = sphere(1.0);
        points.iter_mut().for_each(|p| p.x = -p.x);
        assert!(measure_metric(&Sphere::UNIT, &Similarity::IDENTITY, &points, &faces).is_none());
    }
}

//! The surface of a cloud with normals.

use ndf_core::{Answer, BoundingBox, DVec3, Foot, ImplicitField, Miss, Query, Surface};

use super::neighbours::{Neighbour, Neighbours};
use super::winding_field::{WindingField, WindingFieldOptions};
use crate::level_set::{LevelSearch, LevelSetSurface};
use ndf_formats::point_cloud::PointCloud;

/// How much farther than the nearest point a foot may be before another is looked for, in spacings.
const DETOUR: f64 = 2.0;

/// The level ½ of the winding number of a cloud with normals.
///
/// **Projection** is that of a [level set](LevelSetSurface), where the normal of the nearest point guides queries that
/// have no guide, or whose guide is wrong: within a spacing or two of the surface the field is rough, and its
/// gradient often shows no way. Where that normal is wrong too, as it may in a groove, gradient and axes are left.
/// The level is searched in steps of the points' spacing, to a tolerance of a thousandth of it.
pub struct OrientedCloud {
    level_set: LevelSetSurface<WindingField>,
    neighbours: Neighbours,
    normals: Vec<DVec3>,
}

impl OrientedCloud {
    /// Prepares a cloud. O(n log n) on all threads.
    ///
    /// # Panics
    /// If the cloud has no normals.
    pub fn new(cloud: &PointCloud, options: &WindingFieldOptions) -> Self {
        Self::with_neighbours(cloud, Neighbours::new(cloud.positions()), options)
    }

    /// As [`new`](Self::new), where the points are indexed already.
    ///
    /// # Panics
    /// If the cloud has no normals.
    pub fn with_neighbours(
        cloud: &PointCloud,
        neighbours: Neighbours,
        options: &WindingFieldOptions,
    ) -> Self {
        let field = WindingField::new(cloud, &neighbours, options);
        let sign = if field.is_turned() { -1.0 } else { 1.0 };
        let normals = cloud.normals().expect("the field has seen the normals");
        let normals = normals.iter().map(|&n| sign * n).collect();
        let usual = LevelSearch::within(&field.bounds());
        let spacing = field.spacing();
        let search = LevelSearch {
            step: (1.5 * spacing).min(usual.step),
            guide_reach: usual.guide_reach.max(4.0 * spacing),
            tolerance: 1e-3 * spacing,
            ..usual
        };
        let level_set = LevelSetSurface::new(field).with_search(search);
        Self { level_set, neighbours, normals }
    }

    /// The winding number.
    pub fn field(&self) -> &WindingField {
        self.level_set.field()
    }

    fn nearest(&self, point: DVec3) -> Neighbour {
        self.neighbours.nearest(point, 1)[0]
    }

    /// The query with the normal of the nearest point for its guide.
    fn guided(&self, query: &Query) -> Query {
        Query { normal: Some(self.normals[self.nearest(query.point).index as usize]), ..*query }
    }

    /// Whether a foot is missing, or so far that the nearest point tells of a nearer one.
    fn is_wrong(&self, query: &Query, foot: &Answer) -> bool {
        let detour = DETOUR * self.field().spacing();
        query.point.is_finite()
            && !foot.is_ok_and(|foot| {
                let distance = foot.point.distance(query.point);
                distance <= detour || distance <= self.nearest(query.point).distance_squared.sqrt() + detour
            })
    }

    /// Asks once more, with other guides, where feet are wrong, and takes what is nearer.
    fn project_again(
        &self,
        queries: &[Query],
        feet: &mut [Answer],
        with_other_guide: impl Fn(&Query) -> Query,
    ) {
        let wrong: Vec<usize> =
            (0..queries.len()).filter(|&i| self.is_wrong(&queries[i], &feet[i])).collect();
        let again: Vec<Query> = wrong.iter().map(|&i| with_other_guide(&queries[i])).collect();
        let mut others = vec![Err(Miss::NoCrossing); again.len()];
        self.level_set.project(&again, &mut others);
        for (i, other) in wrong.into_iter().zip(others) {
            let distance = |foot: &Foot| foot.point.distance(queries[i].point);
            if other.is_ok_and(|other| feet[i].map_or(true, |foot| distance(&other) < distance(&foot))) {
                feet[i] = other;
            }
        }
    }
}

impl Surface for OrientedCloud {
    fn bounds(&self) -> BoundingBox {
        self.level_set.bounds()
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        let is_usable = |query: &Query| query.normal.is_some_and(|n| n.is_finite() && n != DVec3::ZERO);
        let guided: Vec<Query> = queries
            .iter()
            .map(|q| if is_usable(q) || !q.point.is_finite() { *q } else { self.guided(q) })
            .collect();
        self.level_set.project(&guided, feet);
        self.project_again(queries, feet, |query| self.guided(query));
        self.project_again(queries, feet, |query| Query { normal: None, ..*query });
    }

    fn tolerance(&self) -> f64 {
        self.level_set.tolerance()
    }

    fn as_field(&self) -> Option<&dyn ImplicitField> {
        self.level_set.as_field()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::projected;
    use ndf_formats::point_cloud::RawCloud;
    use ndf_mesh::FacePoint;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::shapes;
    use ndf_mesh::{TriangleMesh, TriangleTree};
    use std::sync::LazyLock;

    fn cloud(mesh: &TriangleMesh, count: usize, sign: f64) -> PointCloud {
        let samples = AreaSampler::new(mesh).unwrap().sample(count, 9, 0);
        let positions = samples.iter().map(|s| s.position(mesh)).collect();
        let normals = samples.iter().map(|s| sign * mesh.face_normal(s.face)).collect();
        PointCloud::cleaned(RawCloud { positions, normals: Some(normals), ..RawCloud::default() }).unwrap().0
    }

    fn knot() -> TriangleMesh {
        shapes::trefoil_knot(300, 30, 0.24)
    }

    static KNOT: LazyLock<OrientedCloud> =
        LazyLock::new(|| OrientedCloud::new(&cloud(&knot(), 8000, 1.0), &WindingFieldOptions::default()));

    ndf_core::surface_conformance!(oriented_cloud_of_a_knot, *KNOT);

    /// Mean distance of the feet from the true surface, in spacings, and the number of misses.
    fn error_of(queries: &[Query]) -> (f64, usize) {
        let tree = TriangleTree::new(&knot());
        let feet = projected(&*KNOT, queries);
        let spacing = KNOT.field().spacing();
        let distances: Vec<f64> = feet
            .iter()
            .flatten()
            .map(|f| {
                tree.closest_point(f.point, ndf_core::Hint::NONE).unwrap().distance_squared.sqrt() / spacing
            })
            .collect();
        let misses = feet.iter().filter(|f| **f == Err(Miss::NoCrossing)).count();
        (distances.iter().sum::<f64>() / distances.len() as f64, misses)
    }

    #[test]
    fn feet_are_near_the_true_surface_with_and_without_guides() {
        let mesh = knot();
        let samples = AreaSampler::new(&mesh).unwrap().sample(2000, 4, 0);
        let query = |(i, s): (usize, &FacePoint)| {
            let n = mesh.face_normal(s.face);
            let height = 4.0 * ((i as f64 * 0.754_877_666).fract() - 0.5) * KNOT.field().spacing();
            Query { normal: Some(n), ..Query::at(s.position(&mesh) + height * n) }
        };
        let guided: Vec<Query> = samples.iter().enumerate().map(query).collect();
        let unguided: Vec<Query> = guided.iter().map(|q| Query { normal: None, ..*q }).collect();
        let wrong: Vec<Query> = guided.iter().map(|q| Query { normal: q.normal.map(|n| -n), ..*q }).collect();
        for (queries, tolerated) in [(guided, 0), (unguided, 0), (wrong, 0)] {
            let (mean, misses) = error_of(&queries);
            assert!(mean < 0.08 && misses <= tolerated, "{mean}, {misses} misses");
        }
    }

    #[test]
    fn feet_are_not_much_farther_than_the_nearest_points() {
        // The grooves of a rope, where the normal of the nearest point may lead to another strand.
        let rope = shapes::rope_knot(500, 50, 0.24);
        let surface = OrientedCloud::new(&cloud(&rope, 20_000, 1.0), &WindingFieldOptions::default());
        let spacing = surface.field().spacing();
        let samples = AreaSampler::new(&rope).unwrap().sample(20_000, 5, 0);
        let below = |s: &FacePoint| s.position(&rope) - 0.4 * spacing * rope.face_normal(s.face);
        let queries: Vec<Query> = samples.iter().map(|s| Query::at(below(s))).collect();
        for (query, foot) in queries.iter().zip(projected(&surface, &queries)) {
            let nearest = surface.nearest(query.point).distance_squared.sqrt();
            let distance = foot.unwrap().point.distance(query.point);
            assert!(distance <= nearest + DETOUR * spacing, "{query:?} → {foot:?}");
        }
    }

    #[test]
    fn inward_normals_are_turned() {
        let inward = OrientedCloud::new(&cloud(&knot(), 3000, -1.0), &WindingFieldOptions::default());
        assert!(inward.field().is_turned() && !KNOT.field().is_turned());
        let mut w = [0.0];
        inward.field().values(&[inner_point()], &mut w);
        assert!(w[0] > 0.5, "{}", w[0]);
        assert!(inward.bounds().diagonal() > 0.0);
    }

    /// A point inside the knot: the centroid of a ring of its vertices.
    fn inner_point() -> DVec3 {
        let mesh = knot();
        mesh.positions()[..30].iter().sum::<DVec3>() / 30.0
    }
}

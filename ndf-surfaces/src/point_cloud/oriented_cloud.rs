//! The surface of a cloud with normals.

use ndf_core::{BoundingBox, DVec3, Foot, Projection, Query, ScalarField, Surface};

use super::cleaning::PointCloud;
use super::neighbours::Neighbours;
use super::winding_field::{WindingField, WindingFieldOptions};
use crate::level_set::{LevelSearch, LevelSetSurface};

/// How much farther than the nearest point a foot may be before another is looked for, in spacings.
const DETOUR: f64 = 2.0;

/// The level ½ of the winding number of a cloud with normals.
///
/// **Projection** is that of a [level set](LevelSetSurface), where the normal of the nearest point guides queries that
/// have no guide, or whose guide leads astray: within a spacing or two of the surface the field is rough, and its
/// gradient shows no way. The level is searched in steps of the points' spacing, to a tolerance of a thousandth of it.
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
        let field = WindingField::new(cloud, options);
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
        Self { level_set, neighbours: Neighbours::new(cloud.positions()), normals }
    }

    /// The winding number.
    pub fn field(&self) -> &WindingField {
        self.level_set.field()
    }

    /// The query with the normal of the nearest point for its guide, and the distance to that point.
    fn guided(&self, query: &Query) -> (Query, f64) {
        let nearest = self.neighbours.nearest(query.point, 1)[0];
        let normal = Some(self.normals[nearest.index as usize]);
        (Query { normal, ..*query }, nearest.distance_squared.sqrt())
    }
}

impl Surface for OrientedCloud {
    fn bounds(&self) -> BoundingBox {
        self.level_set.bounds()
    }

    fn project(&self, queries: &[Query], feet: &mut [Projection]) {
        let usable = |query: &Query| query.normal.is_some_and(|n| n.is_finite() && n != DVec3::ZERO);
        let guided: Vec<Query> = queries
            .iter()
            .map(|q| if usable(q) || !q.point.is_finite() { *q } else { self.guided(q).0 })
            .collect();
        self.level_set.project(&guided, feet);
        let distance = |foot: &Foot, query: &Query| foot.point.distance(query.point);
        let detour = DETOUR * self.field().spacing();
        let mut astray = Vec::new();
        for (i, (query, foot)) in queries.iter().zip(&*feet).enumerate() {
            let is_near = foot.is_ok_and(|foot| distance(&foot, query) <= detour);
            if !is_near && usable(query) && query.point.is_finite() {
                let (query, nearest) = self.guided(query);
                if !foot.is_ok_and(|foot| distance(&foot, &query) <= nearest + detour) {
                    astray.push((i, query));
                }
            }
        }
        let again: Vec<Query> = astray.iter().map(|&(_, query)| query).collect();
        let mut others = vec![Err(ndf_core::Miss::NoCrossing); again.len()];
        self.level_set.project(&again, &mut others);
        for ((i, query), other) in astray.into_iter().zip(others) {
            let is_nearer =
                |other: &Foot| feet[i].map_or(true, |foot| distance(other, &query) < distance(&foot, &query));
            if let Some(other) = other.ok().filter(is_nearer) {
                feet[i] = Ok(other);
            }
        }
    }

    fn tolerance(&self) -> f64 {
        self.level_set.tolerance()
    }

    fn as_field(&self) -> Option<&dyn ScalarField> {
        self.level_set.as_field()
    }
}

#[cfg(test)]
mod tests {
    use super::super::cleaning::RawCloud;
    use super::*;
    use ndf_core::mesh::shapes;
    use ndf_core::projection::projected;
    use ndf_core::sampling::AreaSampler;
    use ndf_core::{Miss, TriangleMesh, TriangleTree};
    use std::sync::LazyLock;

    fn cloud(mesh: &TriangleMesh, count: usize, sign: f64) -> PointCloud {
        let samples = AreaSampler::new(mesh).unwrap().sample(count, 9, 0);
        let positions = samples.iter().map(|s| s.position(mesh)).collect();
        let normals = samples.iter().map(|s| sign * mesh.face_normal(s.face)).collect();
        PointCloud::cleaned(RawCloud { positions, normals: Some(normals) }).unwrap().0
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
        let query = |(i, s): (usize, &ndf_core::sampling::FaceSample)| {
            let n = mesh.face_normal(s.face);
            let height = 4.0 * ((i as f64 * 0.754_877_666).fract() - 0.5) * KNOT.field().spacing();
            Query { normal: Some(n), ..Query::at(s.position(&mesh) + height * n) }
        };
        let guided: Vec<Query> = samples.iter().enumerate().map(query).collect();
        let unguided: Vec<Query> = guided.iter().map(|q| Query { normal: None, ..*q }).collect();
        let astray: Vec<Query> =
            guided.iter().map(|q| Query { normal: q.normal.map(|n| -n), ..*q }).collect();
        for (queries, tolerated) in [(guided, 0), (unguided, 0), (astray, 0)] {
            let (mean, misses) = error_of(&queries);
            assert!(mean < 0.08 && misses <= tolerated, "{mean}, {misses} misses");
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

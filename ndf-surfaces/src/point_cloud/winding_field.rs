//! The winding number of a cloud as a scalar field, and its level ½ as a surface.

use ndf_core::{BoundingBox, DVec3, Inside, ScalarField};

use super::areas::areas;
use super::cleaning::PointCloud;
use super::local_planes::median;
use crate::level_set::{LevelSearch, LevelSetSurface};
use crate::winding_number::PointWindingNumber;

/// How to make a field of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindingFieldOptions {
    /// Radius of the regularisation of every point, in the square root of its area. ½ leaves the surface close to all
    /// points; larger ones smooth out noise.
    pub smoothing: f64,
}

impl Default for WindingFieldOptions {
    fn default() -> Self {
        Self { smoothing: 0.5 }
    }
}

/// Smallest and largest radius, in median ones: points that nearly coincide have hardly any area, those at the rim of a
/// cloud much.
const RADII: [f64; 2] = [0.25, 4.0];

/// How far the surface may bulge beyond the points, in diagonals of their box.
const MARGIN: f64 = 0.02;

/// The [winding number](PointWindingNumber) of a cloud with normals: level ½, near 1 inside, near 0 outside.
#[derive(Clone, Debug)]
pub struct WindingField {
    winding: PointWindingNumber,
    bounds: BoundingBox,
    spacing: f64,
    turned: bool,
}

/// The surface of a cloud with normals.
pub type OrientedCloud = LevelSetSurface<WindingField>;

impl WindingField {
    /// Prepares a cloud: [areas], then the hierarchy. Where the volume that points and normals enclose is negative, the
    /// normals are taken to point inward and are turned. O(n log n) on all threads.
    ///
    /// # Panics
    /// If the cloud has no normals.
    pub fn new(cloud: &PointCloud, options: &WindingFieldOptions) -> Self {
        let positions = cloud.positions();
        let normals = cloud.normals().expect("a winding number needs normals");
        let areas = areas(positions, normals);
        let center = cloud.bounds().center();
        let volume: f64 =
            positions.iter().zip(normals).zip(&areas).map(|((&p, n), a)| a * n.dot(p - center)).sum();
        let turned = volume < 0.0;
        let sign = if turned { -1.0 } else { 1.0 };
        let moments: Vec<DVec3> = normals.iter().zip(&areas).map(|(&n, a)| sign * a * n).collect();
        let spacings: Vec<f64> = areas.iter().map(|a| a.sqrt()).collect();
        let spacing = median(&mut spacings.clone()).max(1e-6 * cloud.bounds().diagonal());
        let radius = |s: &f64| options.smoothing * s.clamp(RADII[0] * spacing, RADII[1] * spacing);
        let radii: Vec<f64> = spacings.iter().map(radius).collect();
        let winding = PointWindingNumber::new(positions, &moments, &radii);
        let bounds = cloud.bounds();
        let bounds = bounds.padded(MARGIN * bounds.diagonal() + spacing);
        Self { winding, bounds, spacing, turned }
    }

    /// The winding number.
    pub fn winding(&self) -> &PointWindingNumber {
        &self.winding
    }

    /// The median distance of neighbouring points.
    pub fn spacing(&self) -> f64 {
        self.spacing
    }

    /// Whether the normals pointed inward and were turned.
    pub fn is_turned(&self) -> bool {
        self.turned
    }
}

impl ScalarField for WindingField {
    fn values(&self, points: &[DVec3], values: &mut [f64]) {
        for (&p, value) in points.iter().zip(values) {
            *value = self.winding.at(p);
        }
    }

    fn gradients(&self, points: &[DVec3], gradients: &mut [DVec3]) {
        for (&p, gradient) in points.iter().zip(gradients) {
            *gradient = self.winding.with_gradient(p).1;
        }
    }

    fn values_and_gradients(&self, points: &[DVec3], values: &mut [f64], gradients: &mut [DVec3]) {
        for ((&p, value), gradient) in points.iter().zip(values).zip(gradients) {
            (*value, *gradient) = self.winding.with_gradient(p);
        }
    }

    fn bounds(&self) -> BoundingBox {
        self.bounds
    }

    fn level(&self) -> f64 {
        0.5
    }

    fn inside(&self) -> Inside {
        Inside::Above
    }

    /// A thousandth of the spacing: the field changes over a spacing, whatever the size of the cloud.
    fn difference_step(&self) -> f64 {
        1e-3 * self.spacing
    }
}

/// The level ½ of the winding number of a cloud with normals. The level is searched in steps of the points' spacing, to
/// a tolerance of a thousandth of it.
///
/// # Panics
/// If the cloud has no normals.
pub fn oriented_cloud(cloud: &PointCloud, options: &WindingFieldOptions) -> OrientedCloud {
    let field = WindingField::new(cloud, options);
    let usual = LevelSearch::within(&field.bounds);
    let search =
        LevelSearch { step: (1.5 * field.spacing).min(usual.step), tolerance: 1e-3 * field.spacing, ..usual };
    LevelSetSurface::new(field).with_search(search)
}

#[cfg(test)]
mod tests {
    use super::super::cleaning::RawCloud;
    use super::*;
    use ndf_core::mesh::shapes;
    use ndf_core::projection::projected;
    use ndf_core::sampling::AreaSampler;
    use ndf_core::{Query, Surface, TriangleMesh, TriangleTree};
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
        LazyLock::new(|| oriented_cloud(&cloud(&knot(), 8000, 1.0), &WindingFieldOptions::default()));

    ndf_core::surface_conformance!(oriented_cloud_of_a_knot, *KNOT);

    #[test]
    fn feet_are_near_the_true_surface() {
        let tree = TriangleTree::new(&knot());
        let queries: Vec<Query> =
            ndf_core::conformance::near_queries(&*KNOT).into_iter().filter(|q| q.normal.is_some()).collect();
        let feet = projected(&*KNOT, &queries);
        let distances: Vec<f64> = feet
            .iter()
            .flatten()
            .map(|f| tree.closest_point(f.point, ndf_core::Hint::NONE).unwrap().distance_squared.sqrt())
            .collect();
        let mean = distances.iter().sum::<f64>() / distances.len() as f64;
        assert!(mean < 0.1 * KNOT.field().spacing(), "{mean} of {}", KNOT.field().spacing());
    }

    #[test]
    fn inward_normals_are_turned() {
        let inward = oriented_cloud(&cloud(&knot(), 3000, -1.0), &WindingFieldOptions::default());
        assert!(inward.field().is_turned() && !KNOT.field().is_turned());
        let mut w = [0.0];
        // The middle of the rope where it crosses the x axis in the middle of its course.
        inward.field().values(&[shapes_center()], &mut w);
        assert!(w[0] > 0.5, "{}", w[0]);
        assert!(inward.bounds().diagonal() > 0.0);
    }

    /// A point inside the knot: the centroid of a ring of its vertices.
    fn shapes_center() -> DVec3 {
        let mesh = knot();
        mesh.positions()[..30].iter().sum::<DVec3>() / 30.0
    }
}

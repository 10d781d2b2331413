//! The winding number of a cloud as a scalar field.

use ndf_core::{BoundingBox, DVec3, ImplicitField, Inside};

use super::areas::areas;
use super::local_planes::median;
use super::neighbours::Neighbours;
use crate::winding_number::PointWindingNumber;
use ndf_formats::point_cloud::PointCloud;

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

impl WindingField {
    /// Prepares a cloud, of which `neighbours` has the points: [areas], then the hierarchy. Where the volume that points and normals enclose is negative, the
    /// normals are taken to point inward and are turned. O(n log n) on all threads.
    ///
    /// # Panics
    /// If the cloud has no normals.
    pub fn new(cloud: &PointCloud, neighbours: &Neighbours, options: &WindingFieldOptions) -> Self {
        let positions = cloud.positions();
        let normals = cloud.normals().expect("a winding number needs normals");
        let areas = areas(positions, normals, neighbours);
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

impl ImplicitField for WindingField {
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

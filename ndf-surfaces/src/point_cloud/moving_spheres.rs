//! A smooth surface through or near points: at every place, a sphere fitted to the points around.

use ndf_core::{Answer, BoundingBox, DVec3, Foot, Hint, Miss, Query, Surface};
use rayon::prelude::*;

use super::local_planes::LocalPlanes;
use super::neighbours::{Neighbour, Neighbours};
use ndf_formats::point_cloud::PointCloud;

/// Radius of a point's influence, in spacings and in standard deviations of the noise, which add up.
const REACH_BY_SPACING: f64 = 3.0;
const REACH_BY_NOISE: f64 = 6.0;

/// How fast the radius of influence may change from point to point.
const SLOPE: f64 = 0.2;

/// How far a place may move before its neighbours are looked up again, in reaches.
const SLACK: f64 = 0.25;

/// Points farther from the surface than this count for little: in spacings and in standard deviations of the noise; the
/// larger counts.
const CLOSE_BY_SPACING: f64 = 1.0;
const CLOSE_BY_NOISE: f64 = 2.5;

/// Points this many times as far do not count at all. Its square is the power in their weight: 16.
const FARTHEST: f64 = 4.0;

/// The tolerance, in spacings.
const TOLERANCE: f64 = 1e-3;

/// Points nearest to a query among which one is looked for whose normal agrees with the guide.
const FIRST_POINTS: usize = 12;

/// Cosine of the angle from which a normal opposes the guide.
const OPPOSED: f64 = -0.25;

/// Most spheres fitted for a query; in the mean it takes five.
const FITS: usize = 60;

/// Fits after which a query that does not settle is drawn nearer to the surface.
const PATIENCE: usize = 8;

/// Algebraic point set surface (Guennebaud and Gross 2007): the places that lie on the sphere fitted to the points and
/// normals around them. Curvature does not make it shrink, as it does with planes.
///
/// **Robustness** (Öztireli, Guennebaud and Gross 2009): a point counts less the farther its tangent plane is from the
/// place, and the more its normal turns from that of the surface there; points whose normals oppose it, as on the other
/// side of a thin wall, do not count at all.
///
/// **Projection** looks for the place whose sphere the query comes down on there; it begins at the nearest point whose
/// normal does not oppose the guide. About 30 µs.
pub struct MovingSpheres {
    points: Vec<Influence>,
    /// Distance from a tangent plane at which a point's weight has fallen to about 1/e.
    close: f64,
    neighbours: Neighbours,
    bounds: BoundingBox,
    tolerance: f64,
}

impl MovingSpheres {
    /// The surface of a cloud with normals, with influences as wide as spacing and noise ask for. `planes` and
    /// `neighbours` are those of its points. O(n log n) on all threads.
    ///
    /// # Panics
    /// If the cloud has no normals, or not as many points as planes.
    pub fn new(cloud: &PointCloud, planes: &LocalPlanes, neighbours: Neighbours) -> Self {
        let positions = cloud.positions();
        let normals = cloud.normals().expect("spheres are fitted to normals");
        assert_eq!(positions.len(), planes.spacings.len());
        let (spacing, noise) = (planes.spacing(), planes.noise);
        let wanted = planes.spacings.iter().map(|s| REACH_BY_SPACING * s + REACH_BY_NOISE * noise).collect();
        let reaches = gently_changing(wanted, positions, &neighbours);
        let widest = reaches.iter().copied().fold(0.0, f64::max);
        let bounds = cloud.bounds().padded(widest);
        let close = (CLOSE_BY_SPACING * spacing).max(CLOSE_BY_NOISE * noise);
        let tolerance = (TOLERANCE * spacing).max(1e-12 * bounds.diagonal());
        let points = positions.iter().zip(normals).zip(&reaches);
        let points = points.map(|((&position, &normal), &reach)| Influence { position, normal, reach });
        Self { points: points.collect(), close, neighbours, bounds, tolerance }
    }

    /// The foot of one query.
    fn foot(&self, query: &Query) -> Answer {
        if !query.point.is_finite() {
            return Err(Miss::NotFinite);
        }
        let guide = query.normal.filter(|n| n.is_finite()).and_then(DVec3::try_normalize);
        let first = self.first(query.point, guide);
        let Influence { position: p, mut normal, reach } = self.points[first];
        let away = query.point - p;
        let beside = away - away.dot(normal) * normal;
        let mut place = p + beside.clamp_length_max(reach);
        let mut target = query.point;
        let mut around = Around::new(self, place);
        let mut last_step = f64::INFINITY;
        for fit in 0..FITS {
            if place.distance(around.center) > around.slack {
                around = Around::new(self, place);
            }
            let sphere = self.sphere(&around, place, normal).ok_or(Miss::OutOfReach)?;
            let (foot, direction) = sphere.project(target - place).ok_or(Miss::OutOfReach)?;
            // No fit is good farther away than where it was made.
            let step = foot.clamp_length_max(around.slack);
            (place, normal) = (place + step, direction);
            let length = step.length();
            if length <= 0.1 * self.tolerance {
                return Ok(Foot { point: place, normal, hint: Hint::NONE });
            }
            // Far queries have long levers: a little turn of the normal there moves the foot much here.
            if fit >= PATIENCE && length > 0.5 * last_step {
                target = target.midpoint(place);
            }
            last_step = length;
        }
        Err(Miss::NoCrossing)
    }

    /// The point to begin at: the nearest whose normal agrees with the guide, or else the nearest.
    fn first(&self, p: DVec3, guide: Option<DVec3>) -> usize {
        let near = self.neighbours.nearest(p, if guide.is_some() { FIRST_POINTS } else { 1 });
        let agrees =
            |n: &&Neighbour| guide.is_none_or(|g| self.points[n.index as usize].normal.dot(g) > OPPOSED);
        near.iter().find(agrees).unwrap_or(&near[0]).index as usize
    }

    /// The sphere fitted to the points around a place, relative to it; `None` if no point reaches it.
    fn sphere(&self, around: &Around, place: DVec3, normal: DVec3) -> Option<Sphere> {
        let mut fit = SphereFit::default();
        let per_height = (FARTHEST * self.close).recip();
        for point in &around.points {
            let q = point.position - place;
            let near = 1.0 - q.length_squared() / (point.reach * point.reach);
            let low = 1.0 - (per_height * point.normal.dot(q)).powi(2);
            let cosine = point.normal.dot(normal);
            if near > 0.0 && low > 0.0 && cosine > 0.0 {
                // The last factor is nearly exp(−(height / close)²), at a fraction of its cost.
                fit.add(near.powi(4) * cosine * cosine * low.powi(16), q, point.normal);
            }
        }
        fit.sphere()
    }
}

impl Surface for MovingSpheres {
    fn bounds(&self) -> BoundingBox {
        self.bounds
    }

    fn project(&self, queries: &[Query], feet: &mut [Answer]) {
        for (query, foot) in queries.iter().zip(feet) {
            *foot = self.foot(query);
        }
    }

    fn tolerance(&self) -> f64 {
        self.tolerance
    }
}

/// Radii that change by no more than [`SLOPE`] from a point to its neighbours.
fn gently_changing(mut radii: Vec<f64>, positions: &[DVec3], neighbours: &Neighbours) -> Vec<f64> {
    for _ in 0..4 {
        radii = (positions, &radii)
            .into_par_iter()
            .map(|(&p, &own)| {
                let limit = |n: &Neighbour| radii[n.index as usize] + SLOPE * n.distance_squared.sqrt();
                neighbours.nearest(p, 9).iter().map(limit).fold(own, f64::min)
            })
            .collect();
    }
    radii
}

/// The points that may count near a place.
struct Around {
    center: DVec3,
    /// How far the place may move before others count.
    slack: f64,
    points: Vec<Influence>,
}

/// A point, together in memory with what is asked of it.
#[derive(Clone, Copy)]
struct Influence {
    position: DVec3,
    normal: DVec3,
    /// Radius of its influence.
    reach: f64,
}

impl Around {
    fn new(spheres: &MovingSpheres, center: DVec3) -> Self {
        let nearest = spheres.neighbours.nearest(center, 1)[0];
        let reach = spheres.points[nearest.index as usize].reach;
        let slack = SLACK * reach;
        // A point at distance d counts only if d is under its reach, which is at most `reach` and the slope's share of the
        // way from the nearest point to it.
        let widest = (reach + SLOPE * (nearest.distance_squared.sqrt() + slack)) / (1.0 - SLOPE);
        // Their order is that of the tree, the same for the same place.
        let found = spheres.neighbours.within(center, widest + slack);
        let counting = found.iter().filter_map(|n| {
            let point = &spheres.points[n.index as usize];
            let limit = point.reach + slack;
            (n.distance_squared < limit * limit).then_some(*point)
        });
        Self { center, slack, points: counting.collect() }
    }
}

/// Sums over weighted points and normals.
#[derive(Default)]
struct SphereFit {
    weight: f64,
    position: DVec3,
    normal: DVec3,
    position_normal: f64,
    position_position: f64,
}

impl SphereFit {
    fn add(&mut self, weight: f64, q: DVec3, n: DVec3) {
        self.weight += weight;
        self.position += weight * q;
        self.normal += weight * n;
        self.position_normal += weight * q.dot(n);
        self.position_position += weight * q.length_squared();
    }

    /// The algebraic sphere whose gradients fit the normals best, and then its values zero (Guennebaud, Germann and
    /// Gross 2008, Eq. 4 and 5).
    fn sphere(&self) -> Option<Sphere> {
        // Weights this small come from the rims of influences, and are noise.
        if self.weight < 1e-12 {
            return None;
        }
        let spread = self.position_position - self.position.length_squared() / self.weight;
        let turning = self.position_normal - self.position.dot(self.normal) / self.weight;
        let square = if spread > 1e-12 * self.position_position { 0.5 * turning / spread } else { 0.0 };
        let linear = (self.normal - 2.0 * square * self.position) / self.weight;
        let constant = -(linear.dot(self.position) + square * self.position_position) / self.weight;
        Some(Sphere { constant, linear, square })
    }
}

/// The zero set of `constant + linear·y + square |y|²`: a sphere or a plane.
struct Sphere {
    constant: f64,
    linear: DVec3,
    square: f64,
}

impl Sphere {
    /// The point of the sphere nearest to `y`, on the side its gradient comes from, and the unit normal there.
    fn project(&self, y: DVec3) -> Option<(DVec3, DVec3)> {
        let value = self.constant + self.linear.dot(y) + self.square * y.length_squared();
        let gradient = self.linear + 2.0 * self.square * y;
        let slope2 = gradient.length_squared();
        // Along the gradient, which goes through the centre, the function is quadratic. Where y is beyond the centre the
        // gradient points to the far side.
        let discriminant = (1.0 - 4.0 * self.square * value / slope2).max(0.0).sqrt();
        let foot = y - 2.0 * value / (slope2 * (1.0 + discriminant)) * gradient;
        let normal = (self.linear + 2.0 * self.square * foot).try_normalize()?;
        foot.is_finite().then_some((foot, normal))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::projected;
    use ndf_formats::point_cloud::RawCloud;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::{TriangleMesh, shapes};
    use std::sync::LazyLock;

    fn spheres_of(positions: Vec<DVec3>, normals: Vec<DVec3>) -> MovingSpheres {
        let (cloud, _) =
            PointCloud::cleaned(RawCloud { positions, normals: Some(normals), ..RawCloud::default() })
                .unwrap();
        let neighbours = Neighbours::new(cloud.positions());
        let planes = LocalPlanes::new(cloud.positions(), &neighbours);
        MovingSpheres::new(&cloud, &planes, neighbours)
    }

    fn sampled(mesh: &TriangleMesh, count: usize, noise: f64) -> MovingSpheres {
        let samples = AreaSampler::new(mesh).unwrap().sample(count, 13, 0);
        let normals: Vec<DVec3> = samples.iter().map(|s| mesh.face_normal(s.face)).collect();
        let uniform = |i: usize| 12.0_f64.sqrt() * ((i as f64 * 0.754_877_666).fract() - 0.5);
        let place =
            |(i, s): (usize, &ndf_mesh::FacePoint)| s.position(mesh) + noise * uniform(i) * normals[i];
        spheres_of(samples.iter().enumerate().map(place).collect(), normals.clone())
    }

    static TORUS: LazyLock<MovingSpheres> =
        LazyLock::new(|| sampled(&shapes::torus(200, 80, 1.0, 0.4), 8000, 0.0));

    ndf_core::surface_conformance!(moving_spheres_of_a_torus, *TORUS);

    fn rms_from_unit_sphere(spheres: &MovingSpheres) -> f64 {
        let queries: Vec<Query> =
            (0..500).map(|i| Query::at(1.1 * shapes::icosphere(4).positions()[i])).collect();
        let feet = projected(spheres, &queries);
        let squares = feet.iter().map(|f| (f.unwrap().point.length() - 1.0).powi(2));
        (squares.sum::<f64>() / 500.0).sqrt()
    }

    #[test]
    fn a_sphere_is_found_exactly() {
        let points = shapes::icosphere(4).positions().to_vec();
        let spheres = spheres_of(points.clone(), points);
        assert!(rms_from_unit_sphere(&spheres) < 1e-9);
    }

    #[test]
    fn noise_is_smoothed() {
        let sigma = 0.02;
        let rms = rms_from_unit_sphere(&sampled(&shapes::icosphere(5), 20_000, sigma));
        // Weights fall off: about twenty of the hundred points within reach count.
        assert!(rms < 0.25 * sigma, "{rms}");
    }

    #[test]
    fn the_guide_tells_the_sides_of_a_thin_plate_apart() {
        let side = |z: f64| (0..900).map(move |i| DVec3::new(f64::from(i % 30), f64::from(i / 30), z));
        let positions: Vec<DVec3> = side(0.0).chain(side(0.5)).collect();
        let normals: Vec<DVec3> = (0..1800).map(|i| if i < 900 { -DVec3::Z } else { DVec3::Z }).collect();
        let plate = spheres_of(positions, normals);
        for (guide, height) in [(DVec3::Z, 0.5), (-DVec3::Z, 0.0)] {
            let query = Query { normal: Some(guide), ..Query::at(DVec3::new(14.3, 15.1, 0.25)) };
            let foot = projected(&plate, &[query])[0].unwrap();
            assert!((foot.point.z - height).abs() < 1e-9 && foot.normal.dot(guide) > 0.999, "{foot:?}");
        }
    }

    #[test]
    fn an_outlier_hardly_moves_the_surface() {
        let mut points: Vec<DVec3> =
            (0..900).map(|i| DVec3::new(f64::from(i % 30), f64::from(i / 30), 0.0)).collect();
        points.push(DVec3::new(15.2, 15.2, 2.0));
        let normals = vec![DVec3::Z; 901];
        let foot =
            projected(&spheres_of(points, normals), &[Query::at(DVec3::new(15.0, 15.0, 0.3))])[0].unwrap();
        assert!(foot.point.z.abs() < 0.02, "{foot:?}");
    }
}

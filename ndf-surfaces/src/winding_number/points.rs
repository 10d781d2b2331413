//! Points with normals and areas as sources of winding numbers.

use std::f64::consts::PI;

use ndf_core::{BoundingBox, DVec3};
use rayon::prelude::*;

use super::expansion::{BETA, Moments, ValuesAndGradients};
use super::tree::{GradientPacket, LANES, Packet, Tree};

/// Points a thread takes at a time.
const CHUNK: usize = 256;

/// The winding number of a cloud of points with normals and areas (Barill et al. 2018):
/// `w(q) = Σ aᵢ nᵢ·(pᵢ − q) / (4π |pᵢ − q|³)`.
///
/// **Regularisation.** A dipole is infinite at its own place. Within its radius ε the factor `1/r³` is therefore
/// replaced by `(35 − 42 t² + 15 t⁴) / 8ε³`, t = r/ε, which meets it with two continuous derivatives, so that the sum
/// is twice differentiable everywhere. Beyond ε nothing is changed. Where ε spans many points, the level ½ of a surface
/// of mean curvature κ moves inward by about ε²κ/8.
#[derive(Clone, Debug)]
pub struct PointWindingNumber {
    positions: Vec<DVec3>,
    tree: Tree<Dipoles>,
}

/// Eight dipoles, which may also be charged; spare places hold none.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Dipoles {
    position: [[f64; LANES]; 3],
    moment: [[f64; LANES]; 3],
    charge: [f64; LANES],
    inverse_radius: [f64; LANES],
}

impl PointWindingNumber {
    /// Prepares a cloud: `moments` are normals times areas, `radii` those of the regularisation, in units of length.
    /// Points that are not finite are left out. O(n log n) on all threads, about 300 bytes a point.
    ///
    /// # Panics
    /// If the slices differ in length or a radius is not positive.
    pub fn new(positions: &[DVec3], moments: &[DVec3], radii: &[f64]) -> Self {
        assert!(positions.len() == moments.len() && positions.len() == radii.len());
        assert!(radii.iter().all(|&r| r > 0.0), "the radii of a regularisation are positive");
        let boxes: Vec<BoundingBox> = positions.iter().map(|&p| BoundingBox { min: p, max: p }).collect();
        let pack = |points: &[u32]| {
            let mut packet = Dipoles::none(positions[points[0] as usize], radii[points[0] as usize]);
            for (lane, &i) in points.iter().enumerate() {
                packet.inverse_radius[lane] = radii[i as usize].recip();
                for axis in 0..3 {
                    packet.position[axis][lane] = positions[i as usize][axis];
                }
            }
            packet
        };
        let place = |points: &[u32]| {
            let origin = positions[points[0] as usize];
            let offsets = points.iter().map(|&i| positions[i as usize] - origin);
            let center = origin + offsets.sum::<DVec3>() / points.len() as f64;
            let radius = points.iter().map(|&i| positions[i as usize].distance(center)).fold(0.0, f64::max);
            // Expansions know nothing of the regularisation, so no point may be within its radius.
            let regular = points
                .iter()
                .map(|&i| positions[i as usize].distance(center) + radii[i as usize])
                .fold(0.0, f64::max);
            (center, regular.max(BETA * radius))
        };
        let tree = Tree::new(&boxes, pack, place);
        let mut this = Self { positions: positions.to_vec(), tree };
        this.set_moments(moments);
        this
    }

    /// Gives the points other moments. O(n log n) on all threads.
    ///
    /// # Panics
    /// If there is not one for each point.
    pub fn set_moments(&mut self, moments: &[DVec3]) {
        assert_eq!(moments.len(), self.positions.len());
        self.set_sources(|i| (0.0, moments[i]));
    }

    fn set_sources(&mut self, source: impl Fn(usize) -> (f64, DVec3) + Sync) {
        let positions = &self.positions;
        self.tree.repack(|packet, points| {
            for (lane, &i) in points.iter().enumerate() {
                let (charge, moment) = source(i as usize);
                packet.charge[lane] = charge;
                for axis in 0..3 {
                    packet.moment[axis][lane] = moment[axis];
                }
            }
        });
        self.tree.expand(|points, center| {
            let mut sum = Moments::default();
            for &i in points {
                let (charge, moment) = source(i as usize);
                let d = positions[i as usize] - center;
                sum.add_dipole(moment, d);
                sum.add_charge(charge, d);
            }
            sum
        });
    }

    /// The winding number around `p`; NaN if `p` is not finite.
    pub fn at(&self, p: DVec3) -> f64 {
        if p.is_finite() { self.tree.value(p) / (4.0 * PI) } else { f64::NAN }
    }

    /// The winding number around `p` and its gradient, which is exact for the sum of expansions that approximates
    /// the winding number near `p`; NaN if `p` is not finite.
    pub fn with_gradient(&self, p: DVec3) -> (f64, DVec3) {
        if !p.is_finite() {
            return (f64::NAN, DVec3::NAN);
        }
        let (value, gradient) = self.tree.value_and_gradient(p);
        (value / (4.0 * PI), gradient / (4.0 * PI))
    }

    /// The winding numbers around the points themselves. On all threads.
    pub fn at_points(&self) -> Vec<f64> {
        self.for_points(|p| self.at(p))
    }

    /// The gradients of the winding number at the points themselves. On all threads.
    pub fn gradients_at_points(&self) -> Vec<DVec3> {
        self.for_points(|p| self.with_gradient(p).1)
    }

    /// The transposed product: with w = A m the winding numbers around the points by their moments m, this is Aᵀ s,
    /// one vector for each point, where all radii are the same (else each pair is regularised by the radius of the
    /// other point). On all threads. Takes the moments away; they are to be set again.
    ///
    /// # Panics
    /// If there is not one weight for each point.
    pub fn transposed(&mut self, weights: &[f64]) -> Vec<DVec3> {
        assert_eq!(weights.len(), self.positions.len());
        self.set_sources(|i| (weights[i], DVec3::ZERO));
        // Point i pulls at j as j, were it a dipole, would pull at i, the other way round.
        self.for_points(|p| -self.with_gradient(p).1)
    }

    /// `f` at all points; neighbours are asked one after another. The default where a point is left out.
    fn for_points<T: Copy + Default + Send + Sync>(&self, f: impl Fn(DVec3) -> T + Sync) -> Vec<T> {
        let order = self.tree.order();
        let sorted: Vec<T> = order
            .par_chunks(CHUNK)
            .flat_map_iter(|chunk| chunk.iter().map(|&i| f(self.positions[i as usize])))
            .collect();
        let mut values = vec![T::default(); self.positions.len()];
        for (&i, value) in order.iter().zip(sorted) {
            values[i as usize] = value;
        }
        values
    }
}

impl Dipoles {
    fn none(position: DVec3, radius: f64) -> Self {
        Self {
            position: position.to_array().map(|x| [x; LANES]),
            moment: [[0.0; LANES]; 3],
            charge: [0.0; LANES],
            inverse_radius: [radius.recip(); LANES],
        }
    }
}

impl Packet for Dipoles {
    #[inline(always)]
    fn values(&self, p: DVec3) -> [f64; LANES] {
        let mut values = [0.0; LANES];
        let ([px, py, pz], [mx, my, mz]) = (&self.position, &self.moment);
        for i in 0..LANES {
            let (x, y, z) = (px[i] - p.x, py[i] - p.y, pz[i] - p.z);
            let (kernel, _) = kernel(x * x + y * y + z * z, self.inverse_radius[i]);
            values[i] = (mx[i] * x + my[i] * y + mz[i] * z) * kernel;
        }
        values
    }
}

impl GradientPacket for Dipoles {
    /// The value is that of the dipoles alone. Charges have a gradient only: `1/r³` regularised has no simple
    /// potential, and none is asked for.
    #[inline(always)]
    fn values_and_gradients(&self, p: DVec3) -> ValuesAndGradients {
        let mut out = [[0.0; LANES]; 4];
        let ([px, py, pz], [mx, my, mz]) = (&self.position, &self.moment);
        for i in 0..LANES {
            let (x, y, z) = (px[i] - p.x, py[i] - p.y, pz[i] - p.z);
            let (kernel, slope) = kernel(x * x + y * y + z * z, self.inverse_radius[i]);
            let along = mx[i] * x + my[i] * y + mz[i] * z;
            let radial = self.charge[i] * kernel - 2.0 * along * slope;
            out[0][i] = along * kernel;
            out[1][i] = radial * x - mx[i] * kernel;
            out[2][i] = radial * y - my[i] * kernel;
            out[3][i] = radial * z - mz[i] * kernel;
        }
        out
    }
}

/// `1/r³`, regularised, and its derivative by r².
#[inline(always)]
fn kernel(r2: f64, inverse_radius: f64) -> (f64, f64) {
    let inverse2 = inverse_radius * inverse_radius;
    let t2 = r2 * inverse2;
    let near = t2 < 1.0;
    let u = 1.0 / r2;
    let far_kernel = u * u.sqrt();
    let inverse3 = inverse2 * inverse_radius;
    let near_kernel = (35.0 - t2 * (42.0 - 15.0 * t2)) * (0.125 * inverse3);
    let near_slope = (30.0 * t2 - 42.0) * (0.125 * inverse3 * inverse2);
    if near { (near_kernel, near_slope) } else { (far_kernel, -1.5 * far_kernel * u) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::shapes;

    /// Points on a knot with their moments, all of the same area.
    fn knot(count: usize) -> (Vec<DVec3>, Vec<DVec3>, Vec<f64>) {
        let mesh = shapes::trefoil_knot(400, 36, 0.24);
        let samples = AreaSampler::new(&mesh).unwrap().sample(count, 3, 0);
        let area = mesh.area() / count as f64;
        let positions = samples.iter().map(|s| s.position(&mesh)).collect();
        let moments = samples.iter().map(|s| area * mesh.face_normal(s.face)).collect();
        (positions, moments, vec![0.5 * area.sqrt(); count])
    }

    fn queries(points: &[DVec3], count: usize) -> Vec<DVec3> {
        let bounds = BoundingBox::of_points(points).padded(0.3);
        let step = DVec3::new(0.819_172_51, 0.671_043_6, 0.549_700_5);
        (0..count).map(|i| bounds.min + bounds.extent() * (step * i as f64).fract()).collect()
    }

    fn direct(positions: &[DVec3], moments: &[DVec3], radii: &[f64], p: DVec3) -> f64 {
        let term = |i: usize| {
            let r = positions[i] - p;
            let t = r.length() / radii[i];
            let k = if t < 1.0 {
                (35.0 - 42.0 * t * t + 15.0 * t.powi(4)) / (8.0 * radii[i].powi(3))
            } else {
                r.length().powi(-3)
            };
            moments[i].dot(r) * k
        };
        (0..positions.len()).map(term).sum::<f64>() / (4.0 * PI)
    }

    #[test]
    fn expansions_agree_with_the_direct_sum() {
        let (positions, moments, radii) = knot(6000);
        let winding = PointWindingNumber::new(&positions, &moments, &radii);
        let errors: Vec<f64> = queries(&positions, 300)
            .into_iter()
            .map(|q| (winding.at(q) - direct(&positions, &moments, &radii, q)).abs())
            .collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        let max = errors.iter().copied().fold(0.0, f64::max);
        // Twice what triangles of the same size leave, whose centroids are weighted by area: points are not.
        assert!(mean < 2e-3 && max < 1.5e-2, "mean {mean}, max {max}");
    }

    #[test]
    fn inside_and_outside_are_told_apart() {
        let (positions, moments, radii) = knot(20_000);
        let winding = PointWindingNumber::new(&positions, &moments, &radii);
        let spacing = 2.0 * radii[0];
        for (p, m) in positions.iter().zip(&moments).step_by(37) {
            let n = m.normalize();
            assert!(winding.at(*p - 2.0 * spacing * n) > 0.7 && winding.at(*p + 2.0 * spacing * n) < 0.3);
            assert_abs_diff_eq!(winding.at(*p), 0.5, epsilon = 0.3);
        }
        assert_abs_diff_eq!(winding.at(DVec3::splat(1e7)), 0.0, epsilon = 1e-9);
        assert!(winding.at(DVec3::NAN).is_nan() && winding.with_gradient(DVec3::NAN).1.is_nan());
    }

    #[test]
    fn gradients_are_derivatives_of_the_values() {
        let (positions, moments, radii) = knot(3000);
        let winding = PointWindingNumber::new(&positions, &moments, &radii);
        // Far, near and within the radius of regularisation.
        let near = positions.iter().step_by(100).map(|&p| p + DVec3::new(0.3, -0.2, 0.4) * radii[0]);
        let mut wrong = 0;
        let all: Vec<DVec3> = queries(&positions, 100).into_iter().chain(near).collect();
        for &q in &all {
            let (value, gradient) = winding.with_gradient(q);
            assert_abs_diff_eq!(value, winding.at(q), epsilon = 1e-12);
            let h = 1e-5;
            let difference = DVec3::from_array(
                DVec3::AXES.map(|a| (winding.at(q + h * a) - winding.at(q - h * a)) / (2.0 * h)),
            );
            // Where an expansion begins to be used between the two ends, the difference has a jump.
            wrong += usize::from((gradient - difference).length() > 1e-5 * (1.0 + gradient.length()));
        }
        assert!(wrong <= 2, "{wrong} of {} gradients are wrong", all.len());
    }

    /// `sᵀ A m` by both products.
    fn bilinear(count: usize) -> [f64; 2] {
        let (positions, moments, radii) = knot(count);
        let mut winding = PointWindingNumber::new(&positions, &moments, &radii);
        let weights: Vec<f64> = (0..positions.len()).map(|i| (0.7 * i as f64).sin() + 1.0).collect();
        let expected: f64 = winding.at_points().iter().zip(&weights).map(|(w, s)| w * s).sum();
        let transposed = winding.transposed(&weights);
        winding.set_moments(&moments);
        let again: f64 = winding.at_points().iter().zip(&weights).map(|(w, s)| w * s).sum();
        assert_eq!(expected, again, "moments can be set again");
        [expected, transposed.iter().zip(&moments).map(|(v, m)| v.dot(*m)).sum()]
    }

    #[test]
    fn products_are_transposes_of_each_other() {
        // So few points are all near to each other.
        let [forward, backward] = bilinear(6);
        assert_abs_diff_eq!(forward, backward, epsilon = 1e-12 * forward.abs());
        let [forward, backward] = bilinear(3000);
        // Both truncate, but not alike.
        assert_abs_diff_eq!(forward, backward, epsilon = 1e-2 * forward.abs());
    }

    #[test]
    fn expansions_are_of_the_order_they_claim() {
        let (positions, moments, radii) = knot(40);
        let charges: Vec<f64> = (0..40).map(|i| 1.0 + (1.3 * f64::from(i)).sin()).collect();
        let mut winding = PointWindingNumber::new(&positions, &moments, &radii);
        let direction = DVec3::new(0.36, 0.48, 0.8);
        let dipole_error = |winding: &PointWindingNumber, distance: f64| {
            let q = distance * direction;
            let exact = direct(&positions, &moments, &radii, q);
            (winding.at(q) - exact).abs() * distance * distance
        };
        // Cut off before the third order in the distance: doubling it leaves an eighth of the relative error.
        let ratio = dipole_error(&winding, 60.0) / dipole_error(&winding, 30.0);
        assert!((0.08..0.18).contains(&ratio), "{ratio}");
        winding.set_sources(|i| (charges[i], DVec3::ZERO));
        let charge_error = |distance: f64| {
            let q = distance * direction;
            let term = |(&p, c): (&DVec3, &f64)| *c * (p - q) / (p - q).length().powi(3) / (4.0 * PI);
            let exact: DVec3 = positions.iter().zip(&charges).map(term).sum();
            (winding.with_gradient(q).1 - exact).length() * distance * distance
        };
        // Before the fourth: a sixteenth.
        let ratio = charge_error(60.0) / charge_error(30.0);
        assert!((0.04..0.09).contains(&ratio), "{ratio}");
    }

    #[test]
    fn coinciding_points_and_no_points_are_survived() {
        let same = vec![DVec3::ONE; 1000];
        let winding = PointWindingNumber::new(&same, &vec![DVec3::Z; 1000], &[0.1; 1000]);
        assert!(winding.at(DVec3::ONE).abs() < 1e-9 && winding.at(DVec3::ZERO).is_finite());
        assert_eq!(PointWindingNumber::new(&[], &[], &[]).at(DVec3::ONE), 0.0);
    }
}

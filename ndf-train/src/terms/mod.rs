//! Terms of the objective: functions of the mapped points, the tangents and the surface's answers.
//!
//! A [`LossTerm`] sees a block of samples and returns its value with the gradients by points and tangents; the
//! engine carries these through the network to features and weights. To add one: implement the trait and hand it to
//! [`Trainer::with_term`](crate::Trainer::with_term). Gradients may be written by hand, or left to any
//! differentiator: `examples/dfdx_term.rs` lets dfdx do it.

mod conformal;
mod dirichlet;
mod normal;
mod point;
mod projection;

pub use conformal::Conformal;
pub use dirichlet::Dirichlet;
pub use normal::NormalAlignment;
pub use point::PointTarget;
pub use projection::ProjectionDistance;

/// What is known of the surface near the image of a sample: the answer of the last projection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The foot.
    pub foot: [f32; 3],
    /// Unit gradient of the distance at the image when it was projected: the surface is taken as the plane through
    /// the foot with this normal. Zero where the image had no foot.
    pub normal: [f32; 3],
    /// Unit outward normal of the surface at the foot. Zero where the image had no foot.
    pub surface_normal: [f32; 3],
}

impl Target {
    /// No foot was found.
    pub const NONE: Self = Self { foot: [0.0; 3], normal: [0.0; 3], surface_normal: [0.0; 3] };
}

/// A block of samples as a term sees it. All slices have the same length, 32 or fewer.
#[derive(Clone, Copy, Debug)]
pub struct Samples<'a> {
    /// Points x of the base mesh, normalised.
    pub base: &'a [[f32; 3]],
    /// Their images g(x).
    pub points: &'a [[f32; 3]],
    /// J u and J v for an orthonormal, right-handed frame (u, v) of the base face. All zero unless a term
    /// [needs them](LossTerm::needs_tangents).
    pub tangents: [&'a [[f32; 3]]; 2],
    /// What is known of the surface near the images.
    pub targets: &'a [Target],
}

/// Gradients of the objective by what a term sees, to be added to.
#[derive(Debug)]
pub struct SampleGradients<'a> {
    /// By the images.
    pub points: &'a mut [[f32; 3]],
    /// By the two tangents.
    pub tangents: [&'a mut [[f32; 3]]; 2],
}

/// A term of the objective: a mean over samples.
pub trait LossTerm: Send + Sync {
    /// Its name in logs.
    fn name(&self) -> &'static str;

    /// Whether it looks at the tangents.
    fn needs_tangents(&self) -> bool {
        false
    }

    /// The sum of its values over the block; adds `weight` times their gradients.
    fn accumulate(&self, samples: &Samples<'_>, weight: f32, gradients: &mut SampleGradients<'_>) -> f64;
}

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `to += factor · from`.
pub(crate) fn add_scaled(to: &mut [f32; 3], factor: f32, from: [f32; 3]) {
    for (t, f) in to.iter_mut().zip(from) {
        *t += factor * f;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    /// Every gradient of every term against central differences. The terms are evaluated in f32, so differences
    /// are taken with a step that balances rounding and curvature.
    #[test]
    fn gradients_agree_with_differences() {
        let terms: [&dyn LossTerm; 5] =
            [&ProjectionDistance, &PointTarget, &NormalAlignment, &Conformal, &Dirichlet];
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut vector = || [0; 3].map(|_| rng.random_range(-1.0_f32..1.0));
        for term in terms {
            for _ in 0..50 {
                let unit = |v: [f32; 3]| v.map(|x| x / dot(v, v).sqrt());
                let target =
                    Target { foot: vector(), normal: unit(vector()), surface_normal: unit(vector()) };
                let values = [vector(), vector(), vector()];
                let evaluate = |values: &[[f32; 3]; 3]| {
                    let (mut point, mut u, mut v) = ([[0.0; 3]], [[0.0; 3]], [[0.0; 3]]);
                    let samples = Samples {
                        base: &[[0.0; 3]],
                        points: &values[..1],
                        tangents: [&values[1..2], &values[2..]],
                        targets: &[target],
                    };
                    let mut gradients = SampleGradients { points: &mut point, tangents: [&mut u, &mut v] };
                    let value = term.accumulate(&samples, 1.0, &mut gradients);
                    (value, [point[0], u[0], v[0]])
                };
                let area = cross(values[1], values[2]);
                if dot(area, area) < 0.05 {
                    continue; // Nearly parallel tangents: the normal changes too fast for differences.
                }
                let (_, gradient) = evaluate(&values);
                for (k, c) in (0..9).map(|i| (i / 3, i % 3)) {
                    let at = |h: f32| {
                        let mut moved = values;
                        moved[k][c] += h;
                        (evaluate(&moved).0, f64::from(moved[k][c]))
                    };
                    let (up, down) = (at(2e-3), at(-2e-3));
                    let slope = (up.0 - down.0) / (up.1 - down.1);
                    let error = (slope - f64::from(gradient[k][c])).abs();
                    assert!(
                        error < 2e-3 * slope.abs().max(1.0),
                        "{} {k} {c}: {slope} {gradient:?}",
                        term.name()
                    );
                }
            }
        }
    }

    #[test]
    fn terms_are_zero_where_they_should_be_and_leave_missed_samples_alone() {
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let value = |term: &dyn LossTerm, u: [f32; 3], v: [f32; 3], target: Target| {
            let samples = Samples { base: &[x], points: &[x], tangents: [&[u], &[v]], targets: &[target] };
            let (mut a, mut b, mut c) = ([[0.0; 3]], [[0.0; 3]], [[0.0; 3]]);
            let mut gradients = SampleGradients { points: &mut a, tangents: [&mut b, &mut c] };
            let value = term.accumulate(&samples, 1.0, &mut gradients);
            (value, a[0], b[0], c[0])
        };
        let there = Target { foot: x, normal: z, surface_normal: z };
        assert_eq!(value(&ProjectionDistance, x, y, there).0, 0.0);
        assert_eq!(value(&PointTarget, x, y, there).0, 0.0);
        assert_eq!(value(&NormalAlignment, x, y, there).0, 0.0);
        assert!((value(&NormalAlignment, y, x, there).0 - 4.0).abs() < 1e-6);
        // Conformal maps of any scale have the least value, log(1 + e⁻⁵)/10.
        let least = (1.0 + (-5.0_f64).exp()).ln() / 10.0;
        let conformal = |scale: f32| value(&Conformal, x.map(|c| scale * c), y.map(|c| scale * c), there).0;
        assert!((conformal(1.0) - least).abs() < 1e-7 && (conformal(30.0) - least).abs() < 1e-7);
        assert!(value(&Conformal, x, [0.3, 0.5, 0.0], there).0 > least);
        for term in [&ProjectionDistance as &dyn LossTerm, &PointTarget, &NormalAlignment, &Conformal] {
            assert_eq!(
                value(term, x, y, Target::NONE),
                (0.0, [0.0; 3], [0.0; 3], [0.0; 3]),
                "{}",
                term.name()
            );
        }
        // Tangents that vanish give no NaN.
        let flat = value(&NormalAlignment, [0.0; 3], y, there);
        assert!(flat.0.is_finite() && flat.2.iter().all(|g| g.is_finite()));
        assert!(value(&Conformal, [0.0; 3], [0.0; 3], there).2.iter().all(|g| g.is_finite()));
    }
}

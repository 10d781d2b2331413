//! The heat equation `∂u/∂t = Δu` on a surface.

use ndf_core::Progress;

use crate::csr::CsrMatrix;
use crate::error::SpectralError;
use crate::factorisation::SymbolicCholesky;
use crate::laplace_beltrami::LaplaceBeltrami;

/// The coefficient γ of the method of order two that damps what is fast (Alexander 1977).
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

/// Steps of the implicit Euler method, each γ of a step long, with which a flow begins: they damp what initial values have of high
/// frequencies, a point source's above all, without making them negative (Rannacher 1984).
const FIRST: usize = 4;

/// How heat flows.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatFlow {
    /// Vertices whose values are held (Dirichlet); no heat leaves over any other boundary (Neumann).
    pub held: Vec<bool>,
    /// Steps of order two from each time to the next.
    pub steps: usize,
}

impl HeatFlow {
    /// No heat gets in or out; 32 steps.
    pub fn insulated(vertices: usize) -> Self {
        Self { held: vec![false; vertices], steps: 32 }
    }

    /// The function at so many times, equally far from each other, from its values at time 0. Times are in squared units of length. The error
    /// falls with the square of the number of steps. Two factorisations, and two solves a step.
    ///
    /// # Errors
    /// If the time is not positive, there are no steps, the matrix is not positive definite to double precision, or the observer asks to
    /// stop.
    ///
    /// # Panics
    /// If there is not one value, and one mark, for every vertex.
    pub fn run(
        &self,
        operator: &LaplaceBeltrami,
        initial: &[f64],
        time: f64,
        frames: usize,
        progress: &dyn Progress,
    ) -> Result<Vec<Vec<f64>>, SpectralError> {
        assert!([self.held.len(), initial.len()] == [operator.vertex_count(); 2]);
        if !(time > 0.0 && time.is_finite()) {
            return Err(SpectralError::NotPositive { name: "the time", value: time });
        }
        if self.steps == 0 {
            return Err(SpectralError::NotPositive { name: "the number of steps", value: 0.0 });
        }
        let interval = time / frames.max(1) as f64;
        progress.report("factoring", 0.0);
        let symbolic = SymbolicCholesky::new(operator.laplacian())?;
        let mut u = initial.to_vec();
        let mut found = Vec::with_capacity(frames);
        let mut stepper = None;
        for frame in 0..frames {
            // The first interval has steps of its own length, since Euler's come before.
            if frame < 2 {
                let first = if frame == 0 { GAMMA * FIRST as f64 } else { 0.0 };
                let step = interval / (self.steps as f64 + first);
                stepper = Some(self.stepper(operator, &symbolic, step)?);
            }
            let Some(stepper) = &stepper else { continue };
            if frame == 0 {
                (0..FIRST).for_each(|_| stepper.euler(&mut u));
            }
            for step in 0..self.steps {
                stepper.advance(&mut u);
                progress.report("heat", (frame * self.steps + step) as f64 / (frames * self.steps) as f64);
                progress.check()?;
            }
            found.push(u.clone());
        }
        Ok(found)
    }

    fn stepper<'a>(
        &'a self,
        operator: &'a LaplaceBeltrami,
        symbolic: &SymbolicCholesky,
        step: f64,
    ) -> Result<Stepper<'a>, SpectralError> {
        let mut matrix = operator.laplacian().clone();
        matrix.values_mut().iter_mut().for_each(|x| *x *= GAMMA * step);
        let mut matrix = matrix.plus(1.0, operator.mass());
        hold(&mut matrix, &self.held);
        Ok(Stepper { operator, held: &self.held, cholesky: symbolic.cholesky(&matrix)?, step })
    }
}

/// Takes the rows and columns of held vertices out of a symmetric matrix; its pattern stays.
fn hold(matrix: &mut CsrMatrix, held: &[bool]) {
    for row in 0..matrix.row_count() {
        let entries = matrix.offsets()[row]..matrix.offsets()[row + 1];
        for slot in entries {
            let column = matrix.columns()[slot];
            if held[row] || held[column] {
                matrix.values_mut()[slot] = f64::from(u8::from(row == column));
            }
        }
    }
}

struct Stepper<'a> {
    operator: &'a LaplaceBeltrami,
    held: &'a [bool],
    /// Of `M + γ step L`.
    cholesky: crate::factorisation::Cholesky,
    step: f64,
}

impl Stepper<'_> {
    /// The rate `k` of `(M + γ step L) k = −L u`; zero where values are held.
    fn rate(&self, u: &[f64]) -> Vec<f64> {
        let mut rate = self.operator.laplacian().multiply(u);
        rate.iter_mut().zip(self.held).for_each(|(k, held)| *k = if *held { 0.0 } else { -*k });
        self.cholesky.solve(&mut [&mut rate]);
        rate
    }

    /// A step of the implicit Euler method, γ of a step long.
    fn euler(&self, u: &mut [f64]) {
        let rate = self.rate(u);
        u.iter_mut().zip(rate).for_each(|(u, k)| *u += GAMMA * self.step * k);
    }

    /// A step.
    fn advance(&self, u: &mut [f64]) {
        let first = self.rate(u);
        u.iter_mut().zip(first).for_each(|(u, k)| *u += (1.0 - GAMMA) * self.step * k);
        let second = self.rate(u);
        u.iter_mut().zip(second).for_each(|(u, k)| *u += GAMMA * self.step * k);
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use approx::assert_relative_eq;
    use ndf_core::NoProgress;
    use ndf_intrinsic::IntrinsicMesh;
    use ndf_mesh::{ManifoldMesh, shapes};

    use super::*;
    use crate::{ModeOptions, OperatorOptions};

    fn operator_of(mesh: &ManifoldMesh) -> LaplaceBeltrami {
        LaplaceBeltrami::new(&IntrinsicMesh::from_mesh(mesh), OperatorOptions::default()).unwrap()
    }

    #[test]
    fn modes_decay_at_their_rate_to_second_order() {
        let mesh = ManifoldMesh::try_from(shapes::torus(30, 14, 1.0, 0.4)).unwrap();
        let operator = operator_of(&mesh);
        let modes = operator.modes(&ModeOptions { count: 6, ..ModeOptions::default() }, &NoProgress).unwrap();
        let (lambda, mode) = (modes.eigenvalues[5], modes.mode(5));
        let time = 1.0 / lambda;
        let errors = [8, 16, 32].map(|steps| {
            let flow = HeatFlow { steps, ..HeatFlow::insulated(mesh.vertex_count()) };
            let found = flow.run(&operator, mode, time, 1, &NoProgress).unwrap();
            let differences = found[0].iter().zip(mode).map(|(u, m)| (u - m * (-1.0_f64).exp()).abs());
            differences.fold(0.0, f64::max)
        });
        assert!(errors[0] / errors[1] > 3.0 && errors[1] / errors[2] > 3.0, "{errors:?}");
        assert!(errors[2] < 1e-3 * mode.iter().fold(0.0, |m: f64, x| m.max(x.abs())), "{errors:?}");
    }

    #[test]
    fn heat_of_a_strip_held_at_its_ends_is_that_of_an_interval() {
        // sin πx decays as exp(−π² t); the sides are insulated, the ends held at 0.
        let mesh = ManifoldMesh::try_from(shapes::grid(64, 8)).unwrap();
        let operator = operator_of(&mesh);
        let held = mesh.positions().iter().map(|p| p.x == 0.0 || p.x == 1.0).collect();
        let initial: Vec<f64> = mesh.positions().iter().map(|p| (PI * p.x).sin()).collect();
        let flow = HeatFlow { held, steps: 32 };
        let time = 0.1;
        let frames = flow.run(&operator, &initial, time, 4, &NoProgress).unwrap();
        for (k, frame) in frames.iter().enumerate() {
            let decay = (-PI * PI * time * (k + 1) as f64 / 4.0).exp();
            for (u, start) in frame.iter().zip(&initial) {
                assert!((u - start * decay).abs() < 1e-3, "{u} {start}");
            }
        }
    }

    #[test]
    fn a_point_source_spreads_as_the_heat_kernel_and_loses_nothing() {
        let n = 60;
        let mesh = ManifoldMesh::try_from(shapes::grid(n, n)).unwrap();
        let operator = operator_of(&mesh);
        let center = (n / 2 * (n + 1) + n / 2) as usize;
        let mut initial = vec![0.0; mesh.vertex_count()];
        initial[center] = 1.0 / operator.mass().get(center, center).unwrap();
        let time = 0.004;
        let flow = HeatFlow::insulated(mesh.vertex_count());
        let found = flow.run(&operator, &initial, time, 1, &NoProgress).unwrap().remove(0);
        let total: f64 = operator.mass().multiply(&found).iter().sum();
        assert_relative_eq!(total, 1.0, max_relative = 1e-10);
        let highest = 1.0 / (2.0 * TAU * time);
        for (p, u) in mesh.positions().iter().zip(&found) {
            let squared = p.distance_squared(mesh.positions()[center]);
            let kernel = highest * (-squared / (4.0 * time)).exp();
            assert!((u - kernel).abs() < 0.02 * highest, "{p} {u} {kernel}");
            assert!(*u > -1e-3 * highest, "{u}");
        }
        let wrong = flow.run(&operator, &initial, f64::NAN, 1, &NoProgress);
        assert!(matches!(wrong, Err(SpectralError::NotPositive { .. })));
    }
}

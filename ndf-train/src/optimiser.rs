//! Adam (Kingma & Ba 2015).

const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;
const EPSILON: f32 = 1e-8;

/// Moments of one group of parameters.
#[derive(Clone, Debug)]
pub(crate) struct Moments {
    first: Vec<f32>,
    second: Vec<f32>,
}

/// The factors of one step, bias corrections included.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdamStep {
    rate: f32,
    second_correction: f32,
}

impl AdamStep {
    /// Step number `step`, counted from 1, at this rate.
    pub(crate) fn new(step: usize, rate: f32) -> Self {
        let t = i32::try_from(step).unwrap_or(i32::MAX);
        Self { rate: rate / (1.0 - BETA_1.powi(t)), second_correction: (1.0 - BETA_2.powi(t)).recip() }
    }

    /// The same step at a multiple of the rate.
    pub(crate) fn scaled(self, factor: f32) -> Self {
        Self { rate: self.rate * factor, ..self }
    }

    /// Moves one parameter.
    #[inline(always)]
    pub(crate) fn update(self, parameter: &mut f32, first: &mut f32, second: &mut f32, gradient: f32) {
        *first += (1.0 - BETA_1) * (gradient - *first);
        *second += (1.0 - BETA_2) * (gradient * gradient - *second);
        *parameter -= self.rate * *first / ((*second * self.second_correction).sqrt() + EPSILON);
    }
}

impl Moments {
    pub(crate) fn new(parameters: usize) -> Self {
        Self { first: vec![0.0; parameters], second: vec![0.0; parameters] }
    }

    /// Moments saved earlier. Both have the same length.
    pub(crate) fn of_parts(first: Vec<f32>, second: Vec<f32>) -> Self {
        assert_eq!(first.len(), second.len());
        Self { first, second }
    }

    /// Both moments, to be saved.
    pub(crate) fn parts(&self) -> [&[f32]; 2] {
        [&self.first, &self.second]
    }

    /// Both moments, for parameters that are updated elsewhere.
    pub(crate) fn parts_mut(&mut self) -> (&mut [f32], &mut [f32]) {
        (&mut self.first, &mut self.second)
    }

    /// Moves all parameters of the group.
    pub(crate) fn apply(&mut self, step: AdamStep, parameters: &mut [f32], gradients: &[f32]) {
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((p, g), (m, v)) in parameters.iter_mut().zip(gradients).zip(moments) {
            step.update(p, m, v, *g);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_step_has_the_length_of_the_rate_and_a_parabola_is_descended() {
        let mut moments = Moments::new(2);
        let mut x = [1.0, -3.0];
        moments.apply(AdamStep::new(1, 0.1), &mut x, &[5.0, -1e-3]);
        assert!((x[0] - 0.9).abs() < 1e-5 && (x[1] + 2.9).abs() < 1e-4);
        for step in 2..2000 {
            let gradient = x.map(|x| 2.0 * (x - 2.0));
            moments.apply(AdamStep::new(step, 0.05), &mut x, &gradient);
        }
        assert!(x.iter().all(|x| (x - 2.0).abs() < 1e-3), "{x:?}");
    }
}

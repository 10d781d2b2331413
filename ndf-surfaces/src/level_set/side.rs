//! A field seen as a height above its level, positive outside.

use ndf_core::{DVec3, ImplicitField, Inside};

/// The field, shifted and turned so that zero is the level, the outside is positive and gradients point outward.
pub(super) struct Side<'a, F> {
    field: &'a F,
    level: f64,
    sign: f64,
}

impl<'a, F: ImplicitField> Side<'a, F> {
    pub(super) fn of(field: &'a F) -> Self {
        let sign = match field.inside() {
            Inside::Below => 1.0,
            Inside::Above => -1.0,
        };
        Self { field, level: field.level(), sign }
    }

    pub(super) fn lipschitz(&self) -> Option<f64> {
        self.field.lipschitz().filter(|bound| bound.is_finite() && *bound > 0.0)
    }

    pub(super) fn values(&self, points: &[DVec3]) -> Vec<f64> {
        let mut values = vec![0.0; points.len()];
        if !points.is_empty() {
            self.field.values(points, &mut values);
        }
        values.iter_mut().for_each(|v| *v = self.sign * (*v - self.level));
        values
    }

    pub(super) fn values_and_gradients(&self, points: &[DVec3]) -> Vec<(f64, DVec3)> {
        let (mut values, mut gradients) = (vec![0.0; points.len()], vec![DVec3::ZERO; points.len()]);
        if !points.is_empty() {
            self.field.values_and_gradients(points, &mut values, &mut gradients);
        }
        let turned = |(v, g): (f64, DVec3)| (self.sign * (v - self.level), self.sign * g);
        values.into_iter().zip(gradients).map(turned).collect()
    }
}

/// Whether a height is inside. NaN is outside.
pub(super) fn is_inside(height: f64) -> bool {
    height < 0.0
}

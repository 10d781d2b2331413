//! What is minimised: a weighted sum of terms, and the cycle loss.

use std::sync::Arc;

use crate::settings::Settings;
use crate::terms::{Conformal, Dirichlet, LossTerm, NormalAlignment, PointTarget, ProjectionDistance};

/// Terms with their weights, and the weight of the cycle loss, which has a network of its own.
pub(crate) struct Objective {
    pub(crate) terms: Vec<(f32, Arc<dyn LossTerm>)>,
    pub(crate) lambda_c: f32,
    /// Whether g_φ is to map x itself to x, instead of g_θ(x), and g_θ hears nothing of it.
    pub(crate) is_identity: bool,
}

impl Objective {
    /// The terms with a weight in `settings`; the projection distance is always the first.
    pub(crate) fn of(settings: &Settings) -> Self {
        let mut terms: Vec<(f32, Arc<dyn LossTerm>)> =
            vec![(settings.lambda_p, Arc::new(ProjectionDistance))];
        if settings.lambda_d > 0.0 {
            terms.push((settings.lambda_d, Arc::new(Dirichlet)));
        }
        if settings.lambda_n > 0.0 {
            terms.push((settings.lambda_n, Arc::new(NormalAlignment)));
        }
        if settings.lambda_f > 0.0 {
            terms.push((settings.lambda_f, Arc::new(Conformal)));
        }
        Self { terms, lambda_c: settings.lambda_c, is_identity: false }
    }

    /// The objective of the identity stage (supplement, Eq. 1): g_θ, and g_φ where it is a network, map the base mesh to itself.
    pub(crate) fn identity(settings: &Settings) -> Self {
        let lambda_c = if settings.lambda_c > 0.0 { 1.0 } else { 0.0 };
        Self { terms: vec![(1.0, Arc::new(PointTarget))], lambda_c, is_identity: true }
    }

    pub(crate) fn needs_tangents(&self) -> bool {
        self.terms.iter().any(|(_, term)| term.needs_tangents())
    }
}

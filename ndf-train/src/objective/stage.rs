//! The stages of a run.

use std::sync::Arc;

use super::{Conformal, Cycle, Dirichlet, NormalAlignment, PointTarget, ProjectionDistance, Term};
use crate::settings::{Schedule, Settings};

/// What images are compared with in a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Images {
    /// The points of one batch, which they should not leave.
    Stay,
    /// The surface.
    Project,
}

/// Some epochs with one objective. A stage begins with fresh moments of the optimiser.
pub(crate) struct Stage {
    pub(crate) name: &'static str,
    pub(crate) epochs: usize,
    pub(crate) rate: Schedule,
    pub(crate) images: Images,
    pub(crate) terms: Vec<(f32, Arc<dyn Term>)>,
}

/// The stages that the settings ask for; the last is the main one.
pub(crate) fn stages(settings: &Settings) -> Vec<Stage> {
    let identity = (settings.identity_epochs > 0).then(|| identity(settings));
    identity.into_iter().chain([main(settings)]).collect()
}

/// The identity stage (supplement, Eq. 1): g_θ, and g_φ where it is a network, map the base mesh to itself.
fn identity(settings: &Settings) -> Stage {
    let mut terms: Vec<(f32, Arc<dyn Term>)> = vec![(1.0, Arc::new(PointTarget))];
    if settings.lambda_c > 0.0 {
        terms.push((1.0, Arc::new(Cycle::of_base(settings))));
    }
    let (epochs, rate) = (settings.identity_epochs, Schedule::constant(settings.rate.first));
    Stage { name: "identity", epochs, rate, images: Images::Stay, terms }
}

/// The terms with a weight in the settings; the projection distance is always the first.
fn main(settings: &Settings) -> Stage {
    let mut terms: Vec<(f32, Arc<dyn Term>)> = vec![(settings.lambda_p, Arc::new(ProjectionDistance))];
    let weighted: [(f32, Arc<dyn Term>); 4] = [
        (settings.lambda_d, Arc::new(Dirichlet)),
        (settings.lambda_n, Arc::new(NormalAlignment)),
        (settings.lambda_f, Arc::new(Conformal)),
        (settings.lambda_c, Arc::new(Cycle::new(settings))),
    ];
    terms.extend(weighted.into_iter().filter(|(weight, _)| *weight > 0.0));
    let (epochs, rate) = (settings.epochs, settings.rate);
    Stage { name: "main", epochs, rate, images: Images::Project, terms }
}

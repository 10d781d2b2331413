//! What is learned of a network. Numbers that will be stored on grids are learned by the straight-through estimator (Bengio,
//! Léonard & Courville 2013): losses see them rounded, and their gradients go to the numbers behind them.

use ndf_model::file::{Grids, Precision};
use ndf_network::Mlp;

use super::optimiser::Moments;

/// Epochs, of the last of so many, in which numbers are rounded, where they are at all.
pub(crate) fn rounded_epochs(epochs: usize, share: f32) -> usize {
    (f64::from(share) * epochs as f64).round() as usize
}

/// Features, a perceptron, and what the optimiser remembers of them.
#[derive(Clone, Debug)]
pub(crate) struct Learned {
    pub(crate) features: Vec<f32>,
    pub(crate) mlp: Mlp,
    /// Of features and parameters.
    pub(crate) moments: [Moments; 2],
    /// Where numbers are rounded to, from the first epoch in which they are.
    pub(crate) grids: Option<Grids>,
}

impl Learned {
    pub(crate) fn new(features: Vec<f32>, mlp: Mlp) -> Self {
        let moments = [features.len(), mlp.parameters().len()].map(Moments::new);
        Self { features, mlp, moments, grids: None }
    }

    /// Chooses the grids, unless they are chosen.
    pub(crate) fn choose_grids(&mut self, dimension: usize, precision: Precision) {
        let Self { features, mlp, grids, .. } = self;
        grids.get_or_insert_with(|| Grids::new(dimension, features, mlp, precision));
    }

    /// Features and parameters, on their grids where they have some.
    pub(crate) fn numbers(&self) -> (Vec<f32>, Vec<f32>) {
        let (mut features, mut mlp) = (self.features.clone(), self.mlp.clone());
        if let Some(grids) = &self.grids {
            grids.round(&mut features, &mut mlp);
        }
        (features, mlp.parameters().to_vec())
    }

    /// The precision to which these numbers are still to be rounded when they are stored. Where nothing was yet learned
    /// of the rounding, it is finer than asked for, so that it costs next to no accuracy.
    pub(crate) fn to_be_rounded(&self, precision: Option<Precision>) -> Option<Precision> {
        let finer = |p: Precision| Precision { features: p.features + 3, weights: p.weights + 3, ..p };
        precision.filter(|_| self.grids.is_none()).map(finer)
    }
}

/// Features and a perceptron as losses see them: rounded, or as they are.
#[derive(Default)]
pub(super) struct Rounded(Option<(Vec<f32>, Mlp)>);

impl Rounded {
    /// Takes what is learned to the grids, or leaves it as it is.
    pub(super) fn update(&mut self, learned: &Learned) {
        let Learned { features, mlp, grids: Some(grids), .. } = learned else {
            self.0 = None;
            return;
        };
        let (to_features, to_mlp) = self.0.get_or_insert_with(|| (features.clone(), mlp.clone()));
        to_features.copy_from_slice(features);
        to_mlp.parameters_mut().copy_from_slice(mlp.parameters());
        grids.round(to_features, to_mlp);
    }

    /// What losses see of what is learned.
    pub(super) fn seen<'a>(&'a self, learned: &'a Learned) -> (&'a [f32], &'a Mlp) {
        self.0.as_ref().map_or((&learned.features, &learned.mlp), |(features, mlp)| (features, mlp))
    }
}

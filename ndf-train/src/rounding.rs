//! Learning numbers that will be stored on grids: losses see them rounded, and what is learned goes to the numbers behind
//! them (the straight-through estimator; Bengio, Léonard & Courville 2013).

use ndf_model::file::Grids;
use ndf_network::Mlp;

/// Epochs, of the last of so many, in which numbers are rounded, where they are at all.
pub(crate) fn rounded_epochs(epochs: usize, share: f32) -> usize {
    (f64::from(share) * epochs as f64).round() as usize
}

/// Features and a network as losses see them: rounded, or as they are.
#[derive(Default)]
pub(crate) struct Rounded(Option<(Vec<f32>, Mlp)>);

impl Rounded {
    /// Takes what is learned to the grids, or leaves it as it is.
    pub(crate) fn update(&mut self, grids: Option<&Grids>, features: &[f32], network: &Mlp) {
        let Some(grids) = grids else {
            self.0 = None;
            return;
        };
        let (to_features, to_network) = self.0.get_or_insert_with(|| (features.to_vec(), network.clone()));
        to_features.copy_from_slice(features);
        to_network.parameters_mut().copy_from_slice(network.parameters());
        grids.round(to_features, to_network);
    }

    /// What losses see of what is learned.
    pub(crate) fn seen<'a>(&'a self, features: &'a [f32], network: &'a Mlp) -> (&'a [f32], &'a Mlp) {
        self.0.as_ref().map_or((features, network), |(features, network)| (features, network))
    }
}

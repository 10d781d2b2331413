//! The defaults: what each kind of surface is trained with, and the thresholds of opening one.
//!
//! A program built on this crate has the defaults of the program `ndf`.

use ndf_train::Settings;
use ndf_train::levels::{Budget, LevelOptions};
use ndf_train::scalars::ScalarSettings;

use crate::Kind;

/// Epochs at the end of training that project onto the true surface, where training has a cached copy of its field: they
/// remove what the cache is off by.
pub const TRUE_EPOCHS: usize = 100;

/// The share of neighbouring points whose normals point to the same side below which the normals of a cloud are not used.
pub const CONSISTENT: f64 = 0.8;

/// The same, below which normals that were found are doubted.
pub const DOUBTFUL: f64 = 0.9;

/// Points from which a cloud is thinned: more tell nothing that a model would keep, and take memory and time.
pub const MAX_POINTS: usize = 1 << 21;

/// The share of the area of a mesh below which a component of it is left out. That of an isosurface is
/// [`ndf_meshing::base_mesh::MIN_PART`].
pub const MIN_PART: f64 = 0.001;

/// The share of the faces of a mesh of several components that must part inside from outside. Where fewer do, components are
/// inside of others, and the mesh means the union of its pieces.
pub const APART: f64 = 0.95;

/// Borders nearer than this share of the diagonal to another component are next to it. Where most are, the mesh means the solid
/// of its pieces.
pub const SIDE_BY_SIDE: f64 = 0.005;

/// The share of the learned surface from which being turned against the input is worth a note.
pub const NOTABLY_FLIPPED: f64 = 0.01;

/// Faces of a base mesh.
pub const BASE_FACES: usize = 4000;

/// What of a size is set aside for the parts of a model file beside base mesh and levels: its table, the similarity, and how
/// it was made.
const BYTES_BESIDE: usize = 450;

/// The levels for a model file of about so many bytes.
pub fn levels_of_size(bytes: usize) -> LevelOptions {
    let budget = Budget::Bytes(bytes.saturating_sub(BYTES_BESIDE));
    LevelOptions { budget, ..LevelOptions::default() }
}

/// Iterations of levels that keep their feet: one, but for kinds of which projections are dear and feet jump.
pub(crate) fn project_every(kind: Kind) -> usize {
    match kind {
        Kind::Cloud | Kind::Nerf => 5,
        Kind::Mesh | Kind::OrientedCloud | Kind::NeuralSdf | Kind::Neus | Kind::Splats => 1,
    }
}

/// Sets of settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Preset {
    /// What reaches a given error soonest.
    #[default]
    Default,
    /// The training of the paper's supplement.
    Paper,
}

impl Preset {
    /// The settings for a kind of surface: those of the preset with the weight of the cycle loss that the kind needs.
    pub fn settings(self, kind: Kind) -> Settings {
        let settings = match self {
            Self::Default => Settings::default(),
            Self::Paper => Settings::paper(),
        };
        Settings { lambda_c: self.lambda_c(kind), ..settings }
    }

    /// Weight of the cycle loss. The paper's are those of the supplement's Table 2, where the weight of the projection loss
    /// and the learning rate are the same for all kinds. The default differs from it for meshes and distances, where the
    /// reverse map of the default costs nothing to follow and fewer places fold.
    pub fn lambda_c(self, kind: Kind) -> f32 {
        match (kind, self) {
            (Kind::Mesh | Kind::NeuralSdf | Kind::Neus, Self::Default) => 1e3,
            (Kind::Mesh | Kind::NeuralSdf | Kind::Neus, Self::Paper) => 1e2,
            (Kind::OrientedCloud | Kind::Nerf, _) => 1e4,
            (Kind::Cloud | Kind::Splats, _) => 1e5,
        }
    }

    /// The settings of learning scalar fields.
    pub fn scalar_settings(self) -> ScalarSettings {
        match self {
            Self::Default => ScalarSettings::default(),
            Self::Paper => ScalarSettings::paper(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meshes_have_the_settings_of_the_training_crate() {
        assert_eq!(Preset::Default.settings(Kind::Mesh), Settings::default());
        assert_eq!(Preset::Paper.settings(Kind::Mesh), Settings::paper());
    }
}

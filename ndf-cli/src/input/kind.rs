//! The representations of surfaces, by the names that `--as` takes.

use std::fmt;

use clap::ValueEnum;
use ndf_train::Settings;

/// Kinds of input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Kind {
    /// A triangle mesh of any quality, treated as a signed distance field.
    Mesh,
    /// Points with outward normals: the level ½ of their winding number.
    OrientedCloud,
    /// Points alone.
    Cloud,
    /// A network whose values are signed distances or occupancies.
    NeuralSdf,
    /// The network of signed distances of a NeuS checkpoint.
    Neus,
    /// The density of a radiance field.
    Nerf,
    /// Gaussian splats.
    Splats,
}

impl Kind {
    /// The name `--as` takes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::OrientedCloud => "oriented-cloud",
            Self::Cloud => "cloud",
            Self::NeuralSdf => "neural-sdf",
            Self::Neus => "neus",
            Self::Nerf => "nerf",
            Self::Splats => "splats",
        }
    }

    /// Weight of the cycle loss for this kind (supplement, Table 2); the weight of the projection loss and the
    /// learning rate are there the same for all.
    pub fn lambda_c(self) -> f32 {
        match self {
            Self::Mesh | Self::NeuralSdf | Self::Neus => 1e2,
            Self::OrientedCloud | Self::Nerf => 1e4,
            Self::Cloud | Self::Splats => 1e5,
        }
    }

    /// These settings with the weight of the cycle loss this kind asks for, if that is more.
    pub fn settings(self, preset: Settings) -> Settings {
        Settings { lambda_c: preset.lambda_c.max(self.lambda_c()), ..preset }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_the_command_line() {
        for kind in Kind::value_variants() {
            let value = kind.to_possible_value().expect("no kind is hidden");
            assert_eq!(value.get_name(), kind.name());
        }
    }
}

//! The representations of surfaces, by name.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

/// What represents a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
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

/// A name that no kind has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("there is no kind of surface named {0}")]
pub struct UnknownKind(pub String);

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 7] =
        [Self::Mesh, Self::OrientedCloud, Self::Cloud, Self::NeuralSdf, Self::Neus, Self::Nerf, Self::Splats];

    /// The name, `oriented-cloud` for instance.
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

    /// What it is, in a phrase.
    pub fn description(self) -> &'static str {
        match self {
            Self::Mesh => "A triangle mesh of any quality, treated as a signed distance field",
            Self::OrientedCloud => "Points with outward normals: the level ½ of their winding number",
            Self::Cloud => "Points alone",
            Self::NeuralSdf => "A network whose values are signed distances or occupancies",
            Self::Neus => "The network of signed distances of a NeuS checkpoint",
            Self::Nerf => "The density of a radiance field",
            Self::Splats => "Gaussian splats",
        }
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Kind {
    type Err = UnknownKind;

    fn from_str(name: &str) -> Result<Self, UnknownKind> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| UnknownKind(name.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_back_to_kinds() {
        for kind in Kind::ALL {
            assert_eq!(kind.name().parse(), Ok(kind));
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
        }
        assert!("nurbs".parse::<Kind>().is_err());
    }
}

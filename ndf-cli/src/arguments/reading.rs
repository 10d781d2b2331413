//! How an input is to be understood.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use ndf::{Activation, CloudOptions, DVec3, Kind, NetworkOptions, OpenOptions};
use ndf_core::BoundingBox;

use super::numbers::finite;
use crate::output::Failure;

/// How an input is to be understood.
#[derive(Args, Clone, Debug, Default)]
pub struct Reading {
    /// Kind of the input; overrides detection from its content.
    #[arg(long = "as", value_name = "KIND", value_parser = kinds())]
    pub kind: Option<Kind>,
    /// Level of the surface in a density, an occupancy or a distance [default: by rule].
    #[arg(long, value_name = "X", allow_negative_numbers = true, value_parser = finite)]
    pub iso: Option<f64>,
    /// File with the latent codes of a decoder of many shapes.
    #[arg(long, value_name = "FILE")]
    pub latent: Option<PathBuf>,
    /// Number of the code in that file, from 0.
    #[arg(long, value_name = "N", default_value_t = 0, requires = "latent")]
    pub latent_index: usize,
    /// Activation between the layers of a network whose file does not say it: relu, leaky-relu:SLOPE, elu, softplus:BETA,
    /// sine:OMEGA, cosine, tanh, silu, gelu [default: that of the layout; `ndf info` shows it].
    #[arg(long, value_name = "NAME")]
    pub activation: Option<Activation>,
    /// Frequency of the sines of a network: sin(OMEGA x) [default: 30].
    #[arg(long, value_name = "OMEGA", value_parser = finite)]
    pub omega: Option<f64>,
    /// Box of a network's surface, from one number to the other along all axes, or from three to three [default: that of
    /// the layout].
    #[arg(long = "box", value_name = "LO,HI", allow_hyphen_values = true, value_parser = bounding_box)]
    pub bounds: Option<BoundingBox>,
    /// What the columns of a text file of points are, in order; any other word passes a column over [default: told from
    /// the file].
    #[arg(
        long,
        value_name = "x,y,z,nx,ny,nz",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    pub columns: Option<Vec<String>>,
    /// Keeps points that a LAS file marks as withheld or as noise.
    #[arg(long)]
    pub keep_flagged: bool,
}

impl Reading {
    /// The same for the library.
    ///
    /// # Errors
    /// If the file of codes cannot be read or has no such code.
    pub fn options(&self) -> Result<OpenOptions, Failure> {
        let code = |path| ndf::open::read_latent(path, self.latent_index);
        let latent = self.latent.as_deref().map(code).transpose()?;
        let network = NetworkOptions {
            latent,
            activation: self.activation,
            omega: self.omega.map(|omega| omega as f32),
            bounds: self.bounds,
        };
        let cloud = CloudOptions { columns: self.columns.clone(), keep_flagged: self.keep_flagged };
        Ok(OpenOptions { kind: self.kind, level: self.iso, network, cloud, ..OpenOptions::default() })
    }
}

/// Two numbers, or two corners.
fn bounding_box(text: &str) -> Result<BoundingBox, String> {
    let numbers = text.split(',').map(|word| finite(word.trim())).collect::<Result<Vec<f64>, _>>()?;
    let corners = match *numbers {
        [low, high] => BoundingBox { min: DVec3::splat(low), max: DVec3::splat(high) },
        [a, b, c, d, e, f] => BoundingBox { min: DVec3::new(a, b, c), max: DVec3::new(d, e, f) },
        _ => return Err("two numbers are expected, or six".to_owned()),
    };
    let has_volume = (corners.max - corners.min).min_element() > 0.0;
    has_volume.then_some(corners).ok_or_else(|| "the first corner must be below the second".to_owned())
}

/// The names of kinds.
fn kinds() -> impl TypedValueParser<Value = Kind> {
    let value = |kind: Kind| PossibleValue::new(kind.name()).help(kind.description());
    PossibleValuesParser::new(Kind::ALL.map(value)).try_map(|name| name.parse::<Kind>())
}

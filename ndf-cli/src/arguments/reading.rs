//! How an input is to be understood.

use std::path::PathBuf;

use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use ndf::{CloudOptions, Kind, OpenOptions};

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
    /// What the columns of a text file of points are, in order; any other word passes a column over [default: told from
    /// the file].
    #[arg(long, value_name = "x,y,z,nx,ny,nz", value_delimiter = ',', num_args = 1)]
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
        let cloud = CloudOptions { columns: self.columns.clone(), keep_flagged: self.keep_flagged };
        Ok(OpenOptions { kind: self.kind, level: self.iso, latent, cloud })
    }
}

/// The names of kinds.
fn kinds() -> impl TypedValueParser<Value = Kind> {
    let value = |kind: Kind| PossibleValue::new(kind.name()).help(kind.description());
    PossibleValuesParser::new(Kind::ALL.map(value)).try_map(|name| name.parse::<Kind>())
}

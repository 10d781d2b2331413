//! What of a mesh is used.

use clap::Args;
use ndf::{OpenOptions, Parts, RepairOptions};

use super::Reading;
use crate::output::Failure;

/// What of a mesh is used.
#[derive(Args, Clone, Copy, Debug, Default)]
pub struct PartArguments {
    /// Use the component with the largest area alone, however much that leaves out.
    #[arg(long)]
    largest_component: bool,
    /// Leave vertices in the same place apart: what is not joined in the file is a border, as along seams of textures.
    #[arg(long)]
    keep_seams: bool,
}

impl PartArguments {
    /// The same for the library, with these parts kept unless the largest component is wanted.
    pub fn options(self, otherwise: Parts) -> RepairOptions {
        let parts = if self.largest_component { Parts::Largest } else { otherwise };
        RepairOptions { keep_seams: self.keep_seams, parts }
    }

    /// How a surface is opened of which these parts are used, by default those that are not too small to learn.
    ///
    /// # Errors
    /// See [`Reading::options`].
    pub fn opening(self, reading: &Reading) -> Result<OpenOptions, Failure> {
        let options = reading.options()?;
        Ok(OpenOptions { repair: self.options(options.repair.parts), ..options })
    }
}

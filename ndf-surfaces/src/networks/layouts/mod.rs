//! Which network a checkpoint holds, told by the names and shapes of its tensors.

mod bacon;
mod deepsdf;
mod geometric;
mod nerf;
mod sequential;
mod state;

use ndf_core::{BoundingBox, DVec3};

use super::graph::Graph;
use ndf_formats::tensors::{Tensor, TensorFile};
use ndf_mesh::io::FileDefect;
use state::State;

pub(super) use sequential::siren_of_flat_file;

/// The shape of a decoder that knows many: a code that stands for one of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Latent(pub Vec<f32>);

impl Latent {
    /// A row of the first table of codes in a file; `None` if there is none so long.
    pub fn from_tensors(file: &TensorFile, row: usize) -> Option<Self> {
        let tables = file.iter().filter(|(_, tensor)| tensor.shape().len() == 2);
        // PyTorch's own name for a table of codes first.
        let named = |name: &str| name.contains("latent") || name.contains("embedding");
        let mut tables: Vec<(&str, &Tensor)> = tables.collect();
        tables.sort_by_key(|(name, _)| !named(name));
        let (_, table) = tables.first()?;
        table.values().chunks_exact(table.shape()[1].max(1)).nth(row).map(|code| Self(code.to_vec()))
    }
}

/// Why no network could be made of tensors.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LayoutError {
    /// No known layout has such tensors.
    #[error("the tensors {found} match no known network; the known ones have {known}")]
    Unknown {
        /// Names found, shortened.
        found: String,
        /// Layouts and the names they have.
        known: &'static str,
    },
    /// The layout is known, but a tensor is missing, or has the wrong shape.
    #[error("it looks like a network of the layout {layout}, but {defect}")]
    Broken {
        /// The layout.
        layout: &'static str,
        /// What is wrong.
        defect: FileDefect,
    },
    /// A weight is NaN or infinite.
    #[error("weights of the network are not finite")]
    NotFinite,
    /// The code of a decoder has another length than the decoder takes.
    #[error("the decoder takes codes of {expected} numbers, this one has {found}")]
    Latent {
        /// Numbers that the decoder takes.
        expected: usize,
        /// Numbers of the code.
        found: usize,
    },
}

/// What is asked for if nothing fits.
const KNOWN: &str = "NeuS and IDR (lin0.weight_v, …), SDFStudio (glin0.weight_v, …), DeepSDF (decoder.lin0.weight or \
    net.0.0.weight_v, …), NeRF (pts_linears.0.weight or layers_xyz.0.weight, …), BACON (filters.0.linear.weight, …), \
    SIREN (net.net.0.0.weight or net.0.linear.weight, …), multilayer perceptrons (0000.dense.A, dense/kernel:0, \
    net.0.weight, …)";

/// What a network's output means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A signed distance, or an occupancy seen as one: the surface is at 0.
    Distance,
    /// A density, before it is cut off at 0: large inside.
    Density,
}

/// A network and what it means.
pub(super) struct Recognised {
    pub(super) graph: Graph,
    pub(super) layout: &'static str,
    pub(super) quantity: Quantity,
    pub(super) bounds: BoundingBox,
}

/// The cube of a half side around the origin.
fn cube(half: f64) -> BoundingBox {
    BoundingBox { min: DVec3::splat(-half), max: DVec3::splat(half) }
}

/// Finds the layout and builds the network.
pub(super) fn recognise(file: &TensorFile, latent: Option<&Latent>) -> Result<Recognised, LayoutError> {
    let state = State::new(file);
    // NeuS keeps a radiance field for the background beside its distance, which is the one meant.
    let found = geometric::read(&state)
        .or_else(|| nerf::read(&state))
        .or_else(|| bacon::read(&state))
        .or_else(|| deepsdf::read(&state, latent))
        .or_else(|| sequential::read(&state));
    found.unwrap_or_else(|| Err(LayoutError::Unknown { found: names(file), known: KNOWN }))
}

/// Names of tensors, a dozen at most.
fn names(file: &TensorFile) -> String {
    let mut names: Vec<&str> = file.iter().map(|(name, _)| name).collect();
    let more = names.len().saturating_sub(12);
    names.truncate(12);
    if more > 0 { format!("{} and {more} more", names.join(", ")) } else { names.join(", ") }
}

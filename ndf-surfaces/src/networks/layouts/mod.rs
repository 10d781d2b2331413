//! Which network a checkpoint holds, told by the names and shapes of its tensors.

mod bacon;
mod deepsdf;
mod frameworks;
mod geometric;
mod nerf;
mod sequential;
mod state;

use ndf_core::{BoundingBox, DVec3};

use super::activation::Activation;
use super::graph::Graph;
use ndf_formats::tensors::{Tensor, TensorFile};
use ndf_mesh::io::FileDefect;
use state::State;

pub(super) use sequential::siren_of_flat_file;

/// The shape of a decoder that knows many: a code that stands for one of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Latent(pub Vec<f32>);

impl Latent {
    /// A row of the first table of codes in a file, all sides but the last counted through; `None` if there is none so
    /// long. A single code is number 0.
    pub fn from_tensors(file: &TensorFile, row: usize) -> Option<Self> {
        let tables = file.iter().filter(|(_, tensor)| !tensor.shape().is_empty());
        // PyTorch's own name for a table of codes first.
        let named = |name: &str| name.contains("latent") || name.contains("embedding");
        let mut tables: Vec<(&str, &Tensor)> = tables.collect();
        tables.sort_by_key(|(name, _)| !named(name));
        let (_, table) = tables.first()?;
        let length = table.shape().last().copied().unwrap_or(0).max(1);
        table.values().chunks_exact(length).nth(row).map(|code| Self(code.to_vec()))
    }
}

/// What a file of weights does not say of its network.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NetworkOptions {
    /// The code of the shape, for a decoder of many; other networks ignore it.
    pub latent: Option<Latent>,
    /// The activation between layers. By the layout if `None`.
    pub activation: Option<Activation>,
    /// The frequency ω of sines: sin(ω x).
    pub omega: Option<f32>,
    /// The box in which the surface is. By the layout if `None`.
    pub bounds: Option<BoundingBox>,
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
    /// The file is of a framework whose networks are not read.
    #[error("it is {0}")]
    Framework(&'static str),
    /// Layers before the first one that is there are missing.
    #[error("it holds {first}, but not the layers before: part of a network, perhaps one of several shards")]
    Partial {
        /// The first layer.
        first: String,
    },
    /// An activation was asked for, but the file says which it has.
    #[error("the file says which activations its network has; they cannot be set")]
    ActivationStated,
    /// A frequency was asked for, but the network has no sines.
    #[error(
        "the network has no sines whose frequency could be set; it has {activation}, and --activation sine makes them"
    )]
    NoSines {
        /// What it has.
        activation: String,
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
    /// The activation that the layout has by convention; `None` where the file says all of them.
    pub(super) hidden: Option<Activation>,
}

impl Recognised {
    /// With what the caller says, or what is `told` of the activation.
    pub(super) fn with_options(
        mut self,
        options: &NetworkOptions,
        told: Option<Activation>,
    ) -> Result<Self, LayoutError> {
        self.bounds = options.bounds.unwrap_or(self.bounds);
        let put = |found: &mut Self, old, new| {
            found.graph.replace_activation(old, new);
            found.hidden = Some(new);
        };
        match (self.hidden, options.activation.or(told)) {
            (Some(old), Some(new)) => put(&mut self, old, new),
            (None, Some(_)) if options.activation.is_some() => return Err(LayoutError::ActivationStated),
            _ => {}
        }
        if let Some(frequency) = options.omega {
            let Some(old @ Activation::Sine { .. }) = self.hidden else {
                let activation =
                    self.hidden.or(self.graph.activation()).map_or_else(String::new, |a| a.to_string());
                return Err(LayoutError::NoSines { activation });
            };
            put(&mut self, old, Activation::Sine { frequency });
        }
        Ok(self)
    }
}

/// The cube of a half side around the origin.
fn cube(half: f64) -> BoundingBox {
    BoundingBox { min: DVec3::splat(-half), max: DVec3::splat(half) }
}

/// Finds the layout and builds the network.
pub(super) fn recognise(file: &TensorFile, latent: Option<&Latent>) -> Result<Recognised, LayoutError> {
    let state = State::new(file);
    // NeuS keeps a radiance field for the background beside its distance, which is the one meant.
    let found = geometric::read(&state, latent)
        .or_else(|| nerf::read(&state))
        .or_else(|| bacon::read(&state))
        .or_else(|| deepsdf::read(&state, latent))
        .or_else(|| frameworks::named(&state).map(|what| Err(LayoutError::Framework(what))))
        .or_else(|| sequential::read(&state));
    found.unwrap_or_else(|| match state.first_of_rest() {
        Some(first) => Err(LayoutError::Partial { first }),
        None => Err(LayoutError::Unknown { found: names(file), known: KNOWN }),
    })
}

/// The activation that the modules of a pickle name: the only one between layers, since tanh and sigmoid may stand at the end.
pub(super) fn told_by_modules(file: &TensorFile) -> Option<Activation> {
    let mut found: Vec<Activation> = Vec::new();
    let mut ends = 0;
    for module in file.modules() {
        let number =
            |names: &[&str]| names.iter().find_map(|name| module.numbers.get(*name)).map(|&x| x as f32);
        let frequency = number(&["omega_0", "omega0", "omega", "w0"]);
        let activation = match module.class.rsplit('.').next().unwrap_or_default() {
            "ReLU" => Activation::Relu,
            "LeakyReLU" | "Softplus" if module.numbers.is_empty() => continue,
            "LeakyReLU" => Activation::LeakyRelu { slope: number(&["negative_slope"])? },
            "ELU" => Activation::Elu { alpha: number(&["alpha"]).unwrap_or(1.0) },
            "Softplus" => Activation::Softplus { beta: number(&["beta"])? },
            "SiLU" => Activation::Silu,
            "GELU" => Activation::Gelu,
            "Tanh" => {
                ends += 1;
                continue;
            }
            _ => match frequency {
                Some(frequency) => Activation::Sine { frequency },
                None => continue,
            },
        };
        if !found.contains(&activation) {
            found.push(activation);
        }
    }
    match found.as_slice() {
        [] if ends > 1 => Some(Activation::Tanh),
        &[only] => Some(only),
        _ => None,
    }
}

/// Names of tensors, a dozen at most.
fn names(file: &TensorFile) -> String {
    let mut names: Vec<&str> = file.iter().map(|(name, _)| name).collect();
    let more = names.len().saturating_sub(12);
    names.truncate(12);
    if more > 0 { format!("{} and {more} more", names.join(", ")) } else { names.join(", ") }
}

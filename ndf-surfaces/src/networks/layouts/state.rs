//! Layers by name.

use std::borrow::Cow;

use super::super::graph::Dense;
use super::LayoutError;
use ndf_formats::tensors::{Tensor, TensorFile};
use ndf_mesh::io::FileDefect;

/// The tensors by which a layer is known: its weights, or their directions in weight normalisation, as
/// `torch.nn.utils.weight_norm` and its successor in `torch.nn.utils.parametrizations` name them.
const WEIGHTS: [&str; 3] = ["weight_v", "parametrizations.weight.original1", "weight"];
/// Layers that are looked for.
const MAX_LAYERS: usize = 64;

/// The tensors of a file, in which a network may lie under any prefix.
pub(super) struct State<'a> {
    file: &'a TensorFile,
}

/// A network's tensors: those under a prefix.
pub(super) struct Part<'a> {
    file: &'a TensorFile,
    prefix: String,
    layout: &'static str,
}

impl<'a> State<'a> {
    pub(super) fn new(file: &'a TensorFile) -> Self {
        Self { file }
    }

    pub(super) fn names(&self) -> impl Iterator<Item = &'a str> {
        self.file.iter().map(|(name, _)| name)
    }

    /// The first of numbered layers of which number 0 is missing.
    pub(super) fn first_of_rest(&self) -> Option<String> {
        let layer = |stem: &str, number: usize| format!("{stem}{number}");
        ["lin", "glin", "pts_linears.", "net.", "layers."].into_iter().find_map(|stem| {
            let has = |number| {
                WEIGHTS
                    .iter()
                    .any(|kind| self.part(&format!("{}.{kind}", layer(stem, number)), &[], "").is_some())
            };
            (1..MAX_LAYERS).find(|&number| has(number)).map(|number| layer(stem, number))
        })
    }

    /// The part in which there is a layer of a name, as [`Self::part`].
    pub(super) fn part_of_layer(
        &self,
        name: &str,
        preferred: &[&str],
        layout: &'static str,
    ) -> Option<Part<'a>> {
        WEIGHTS.iter().find_map(|kind| self.part(&format!("{name}.{kind}"), preferred, layout))
    }

    /// What comes before a name in the file, the best place first: one that contains the earliest of `preferred`.
    pub(super) fn part(&self, name: &str, preferred: &[&str], layout: &'static str) -> Option<Part<'a>> {
        let prefixes = self.names().filter_map(|full| {
            let prefix = full.strip_suffix(name)?;
            (prefix.is_empty() || prefix.ends_with('.')).then_some(prefix)
        });
        let rank = |prefix: &&str| {
            let place = preferred.iter().position(|word| prefix.contains(word));
            place.unwrap_or(preferred.len())
        };
        let prefix = prefixes.min_by_key(rank)?.to_owned();
        Some(Part { file: self.file, prefix, layout })
    }
}

impl<'a> Part<'a> {
    pub(super) fn prefix(&self) -> &str {
        &self.prefix
    }

    pub(super) fn tensor(&self, name: &str) -> Option<&'a Tensor> {
        self.file.get(&format!("{}{name}", self.prefix))
    }

    pub(super) fn broken(&self, defect: FileDefect) -> LayoutError {
        LayoutError::Broken { layout: self.layout, defect }
    }

    /// A tensor or an output is missing.
    pub(super) fn missing(&self, text: impl Into<Cow<'static, str>>) -> LayoutError {
        self.broken(FileDefect::missing(text))
    }

    /// Sizes or shapes contradict each other.
    pub(super) fn mismatch(&self, text: impl Into<Cow<'static, str>>) -> LayoutError {
        self.broken(FileDefect::mismatch(text))
    }

    /// Whether there is a layer of a name.
    pub(super) fn has(&self, name: &str) -> bool {
        WEIGHTS.iter().any(|kind| self.tensor(&format!("{name}.{kind}")).is_some())
    }

    /// A layer of PyTorch: `weight` (outputs × inputs), or `weight_g` and `weight_v` of weight normalisation
    /// (w = g v / ‖v‖, each row; Salimans and Kingma 2016), and `bias`, which may be missing.
    pub(super) fn layer(&self, name: &str) -> Result<Dense, LayoutError> {
        let tensor = |kind: &str| self.tensor(&format!("{name}.{kind}"));
        let missing = || self.missing(format!("{}{name}.weight is missing", self.prefix));
        let normalised = tensor("weight_g").zip(tensor("weight_v")).or_else(|| {
            tensor("parametrizations.weight.original0").zip(tensor("parametrizations.weight.original1"))
        });
        let (shape, weights) = match normalised {
            Some((g, v)) => {
                let columns = v.shape().get(1).copied().unwrap_or(0);
                if g.values().len() * columns != v.values().len() || columns == 0 {
                    return Err(self.mismatch(format!("{name}.weight_g and weight_v have different sizes")));
                }
                (v.shape(), weight_normalised(g.values(), v.values()))
            }
            None => {
                let weight = tensor("weight").ok_or_else(missing)?;
                (weight.shape(), weight.values().to_vec())
            }
        };
        let &[outputs, _] = shape else {
            return Err(
                self.mismatch(format!("{name}.weight has the shape {shape:?}, which is not a matrix"))
            );
        };
        let bias = tensor("bias").map_or_else(|| vec![0.0; outputs], |bias| bias.values().to_vec());
        let layer = (bias.len() == outputs).then(|| Dense::new(weights, bias)).flatten();
        layer.ok_or_else(|| self.mismatch(format!("weight and bias of {name} have different sizes")))
    }

    /// Layers `name(0)`, `name(1)`, … as far as there are. None must be missing between others.
    pub(super) fn layers(&self, name: impl Fn(usize) -> String) -> Result<Vec<Dense>, LayoutError> {
        let count = (0..).take_while(|&l| self.has(&name(l))).count();
        if let Some(later) = (count + 1..MAX_LAYERS).map(&name).find(|later| self.has(later)) {
            return Err(self.missing(format!("{} is missing before {later}", name(count))));
        }
        (0..count).map(|l| self.layer(&name(l))).collect()
    }

    /// A layer of Keras: a kernel (inputs × outputs) and a bias.
    pub(super) fn kernel_layer(&self, kernel: &str, bias: &str) -> Result<Dense, LayoutError> {
        let [kernel_tensor, bias_tensor] = [kernel, bias].map(|name| self.tensor(name));
        let (Some(k), Some(b)) = (kernel_tensor, bias_tensor) else {
            return Err(self.missing(format!("{kernel} or {bias} is missing")));
        };
        let &[inputs, outputs] = k.shape() else {
            return Err(
                self.mismatch(format!("{kernel} has the shape {:?}, which is not a matrix", k.shape()))
            );
        };
        let rows = (0..outputs).flat_map(|o| (0..inputs).map(move |i| k.values()[i * outputs + o])).collect();
        let layer = (b.values().len() == outputs).then(|| Dense::new(rows, b.values().to_vec())).flatten();
        layer.ok_or_else(|| self.mismatch(format!("{kernel} and {bias} have different sizes")))
    }
}

fn weight_normalised(g: &[f32], v: &[f32]) -> Vec<f32> {
    let columns = v.len() / g.len().max(1);
    let row = |(v, &g): (&[f32], &f32)| {
        let norm = v.iter().map(|&x| f64::from(x) * f64::from(x)).sum::<f64>().sqrt();
        let factor = f64::from(g) / norm;
        v.iter().map(|&x| (factor * f64::from(x)) as f32).collect::<Vec<f32>>()
    };
    v.chunks_exact(columns).zip(g).flat_map(row).collect()
}

//! Multilayer perceptrons of positions: lists of operations, Keras models, SIRENs.

use super::super::activation::Activation;
use super::super::graph::{Dense, Graph, NodeId};
use super::state::{Part, State};
use super::{LayoutError, Quantity, Recognised, cube};
use ndf_mesh::io::FileDefect;

/// ω₀ of SIREN (Sitzmann et al. 2020).
const SIREN: Activation = Activation::Sine { frequency: 30.0 };

pub(super) fn read(state: &State<'_>) -> Option<Result<Recognised, LayoutError>> {
    if let Some(part) = state.part("0000.dense.A", &[], "list of operations") {
        return Some(operations(&part, state));
    }
    if state.names().any(|name| name.ends_with("kernel:0")) {
        return keras(state);
    }
    siren(state).or_else(|| lucidrains(state)).or_else(|| relu(state))
}

/// nmwsharp/neural-implicit-queries (Sharp and Jacobson 2022): arrays `NNNN.operation.parameter`, in order.
fn operations(part: &Part<'_>, state: &State<'_>) -> Result<Recognised, LayoutError> {
    let mut steps: Vec<(&str, &str)> = state
        .names()
        .filter_map(|name| {
            let (number, rest) = name.strip_prefix(part.prefix())?.split_once('.')?;
            number.parse::<u32>().ok()?;
            Some((number, rest.split('.').next()?))
        })
        .collect();
    steps.sort_unstable();
    steps.dedup();
    let mut graph = Graph::new();
    let mut h = graph.position();
    for (number, operation) in steps {
        h = match operation {
            "dense" => {
                let [kernel, bias] = ["A", "b"].map(|p| format!("{number}.dense.{p}"));
                connect(part, &mut graph, part.kernel_layer(&kernel, &bias)?, h)?
            }
            "relu" => graph.map(Activation::Relu, h),
            "elu" => graph.map(Activation::Elu { alpha: 1.0 }, h),
            "sin" => graph.map(Activation::Sine { frequency: 1.0 }, h),
            "cos" => graph.map(Activation::Cosine, h),
            "tanh" => graph.map(Activation::Tanh, h),
            // The last side of length 1 goes.
            "squeeze_last" => h,
            other => {
                let text = format!("the operation {other} is not known");
                return Err(part.broken(FileDefect::unsupported(text)));
            }
        };
    }
    finished(part, graph, h, "multilayer perceptron", None)
}

/// Keras: `dense…/kernel:0`. The weight-encoded shapes of Davies, Nowrouzezahrai and Jacobson (2020) have ReLU, and
/// tanh at the end.
fn keras(state: &State<'_>) -> Option<Result<Recognised, LayoutError>> {
    // dense, dense_1, …, dense_10: by number, then by name.
    let order = |name: &str| {
        let parent = name.rsplit('.').nth(1).unwrap_or_default();
        parent.rsplit('_').next().and_then(|n| n.parse::<u32>().ok()).map_or(0, |n| n + 1)
    };
    let mut stems: Vec<&str> = state.names().filter_map(|name| name.strip_suffix("kernel:0")).collect();
    stems.sort_by_key(|stem| order(&format!("{stem}kernel:0")));
    let part = state.part(&format!("{}kernel:0", stems.first()?), &[], "Keras")?;
    let layers: Result<Vec<Dense>, LayoutError> = stems
        .iter()
        .map(|stem| part.kernel_layer(&format!("{stem}kernel:0"), &format!("{stem}bias:0")))
        .collect();
    Some(
        layers.and_then(|layers| {
            perceptron(&part, layers, [Activation::Relu; 2], Some(Activation::Tanh), "Keras")
        }),
    )
}

/// Sine layers: `net.net.i.0` of the authors' code, `net.i.linear` of their notebook.
fn siren(state: &State<'_>) -> Option<Result<Recognised, LayoutError>> {
    let (part, name): (_, fn(usize) -> String) =
        if let Some(part) = state.part_of_layer("net.net.0.0", &[], "SIREN") {
            (part, |l| format!("net.net.{l}.0"))
        } else {
            (state.part_of_layer("net.0.linear", &[], "SIREN")?, |l| format!("net.{l}.linear"))
        };
    let layers = part.layers(name).and_then(|mut layers| {
        // The last layer has no sine, hence another name in the notebook.
        let last = format!("net.{}", layers.len());
        if part.has(&last) {
            layers.push(part.layer(&last)?);
        }
        Ok(layers)
    });
    Some(layers.and_then(|layers| perceptron(&part, layers, [SIREN; 2], None, "SIREN")))
}

/// lucidrains/siren-pytorch: the first sine of 30 x, the others of x, the last layer by a name of its own.
fn lucidrains(state: &State<'_>) -> Option<Result<Recognised, LayoutError>> {
    let part = state.part_of_layer("last_layer", &[], "SIREN (lucidrains)")?;
    let build = || {
        let mut layers = part.layers(|l| format!("layers.{l}"))?;
        if layers.is_empty() {
            return Err(part.missing("layers.0 is missing"));
        }
        layers.push(part.layer("last_layer")?);
        let others = Activation::Sine { frequency: 1.0 };
        perceptron(&part, layers, [SIREN, others], None, "SIREN (lucidrains)")
    };
    Some(build())
}

/// Linear layers with ReLU between them, as `torch.nn.Sequential` numbers them.
fn relu(state: &State<'_>) -> Option<Result<Recognised, LayoutError>> {
    let (part, stem) = ["net.", "layers.", "model.", "mlp.", ""].iter().find_map(|stem| {
        let part = state.part_of_layer(&format!("{stem}0"), &[], "multilayer perceptron")?;
        Some((part, *stem))
    })?;
    let numbers = (0..64).map(|l| format!("{stem}{l}")).filter(|name| part.has(name));
    let layers: Result<Vec<Dense>, LayoutError> = numbers.map(|name| part.layer(&name)).collect();
    Some(
        layers.and_then(|layers| {
            perceptron(&part, layers, [Activation::Relu; 2], None, "multilayer perceptron")
        }),
    )
}

/// Layers with activations between them, the first of two after the first layer.
fn perceptron(
    part: &Part<'_>,
    layers: Vec<Dense>,
    between: [Activation; 2],
    last: Option<Activation>,
    layout: &'static str,
) -> Result<Recognised, LayoutError> {
    let mut graph = Graph::new();
    let mut h = graph.position();
    let end = layers.len() - 1;
    for (l, layer) in layers.into_iter().enumerate() {
        h = connect(part, &mut graph, layer, h)?;
        if let Some(activation) = if l < end { Some(between[l.min(1)]) } else { last } {
            h = graph.map(activation, h);
        }
    }
    finished(part, graph, h, layout, Some(between[0]))
}

fn connect(part: &Part<'_>, graph: &mut Graph, layer: Dense, from: NodeId) -> Result<NodeId, LayoutError> {
    let (wanted, given) = (layer.inputs(), graph.width(from));
    let defect = || part.mismatch(format!("a layer takes {wanted} inputs where {given} are given"));
    graph.dense(layer, from).ok_or_else(defect)
}

fn finished(
    part: &Part<'_>,
    graph: Graph,
    last: NodeId,
    layout: &'static str,
    hidden: Option<Activation>,
) -> Result<Recognised, LayoutError> {
    match graph.width(last) {
        1 => Ok(Recognised { graph, layout, quantity: Quantity::Distance, bounds: cube(1.0), hidden }),
        n => Err(part.mismatch(format!("its output has {n} numbers instead of 1"))),
    }
}

/// A SIREN as bare numbers: weights, then bias, of each layer, all hidden layers of one width. `None` if the count of
/// numbers fits no such network.
pub(in super::super) fn siren_of_flat_file(bytes: &[u8]) -> Option<Recognised> {
    let (numbers, rest) = bytes.as_chunks::<4>();
    let numbers: Vec<f32> = numbers.iter().map(|&b| f32::from_le_bytes(b)).collect();
    // Weights of a SIREN are below about 30; noise read as numbers is not.
    if !rest.is_empty() || numbers.is_empty() || !numbers.iter().all(|x| x.abs() < 1e3) {
        return None;
    }
    let count = |width: usize, squares: usize| 5 * width + 1 + squares * (width * width + width);
    let shapes = [16, 32, 64, 96, 128, 192, 256, 384, 512, 1024].into_iter();
    let (width, squares) =
        shapes.flat_map(|w| (1..=10).map(move |s| (w, s))).find(|&(w, s)| count(w, s) == numbers.len())?;
    let mut sizes = vec![(width, 3)];
    sizes.extend(vec![(width, width); squares]);
    sizes.push((1, width));
    let (mut graph, mut rest) = (Graph::new(), numbers.as_slice());
    let mut h = graph.position();
    for (l, &(outputs, inputs)) in sizes.iter().enumerate() {
        let (weights, after) = rest.split_at_checked(outputs * inputs)?;
        let (bias, after) = after.split_at_checked(outputs)?;
        rest = after;
        h = graph.dense(Dense::new(weights.to_vec(), bias.to_vec())?, h)?;
        if l + 1 < sizes.len() {
            h = graph.map(SIREN, h);
        }
    }
    Some(Recognised {
        graph,
        layout: "SIREN",
        quantity: Quantity::Distance,
        bounds: cube(1.0),
        hidden: Some(SIREN),
    })
}

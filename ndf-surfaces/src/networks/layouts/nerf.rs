//! Radiance fields (Mildenhall et al. 2020), of which the density alone is read; it does not depend on directions.

use super::super::activation::Activation;
use super::super::encoding::Encoding;
use super::super::graph::{Dense, Graph, NodeId};
use super::state::{Part, State};
use super::{LayoutError, Quantity, Recognised, cube};

/// The finer of two networks first.
const PREFERRED: [&str; 2] = ["fine", "fn"];
/// Scenes are seen from about 4, objects lie around the origin.
pub(super) const HALF_SIDE: f64 = 1.5;

pub(super) fn read(state: &State<'_>) -> Option<Result<Recognised, LayoutError>> {
    if let Some(part) = state.part_of_layer("pts_linears.0", &PREFERRED, "NeRF") {
        return Some(vanilla(&part));
    }
    if let Some(part) = state.part_of_layer("xyz_encoding_1.0", &PREFERRED, "NeRF (nerf_pl)") {
        return Some(nerf_pl(&part));
    }
    if let Some(part) = state.part("layers_xyz.0.weight", &PREFERRED, "NeRF (krrish94)") {
        return Some(krrish94(&part));
    }
    // bmild's list of kernels and biases, named 0 … 23 by their places.
    let part = state.part("22", &[], "NeRF (bmild)")?;
    let is_list =
        part.prefix().is_empty() && state.names().all(|name| name.parse::<u32>().is_ok_and(|n| n < 24));
    is_list.then(|| bmild(&part))
}

fn vanilla(part: &Part<'_>) -> Result<Recognised, LayoutError> {
    let layers = part.layers(|l| format!("pts_linears.{l}"))?;
    // With view directions the density has its own layer; without, it is the last of four outputs.
    let density = if part.has("alpha_linear") {
        part.layer("alpha_linear")?
    } else {
        let all = part.layer("output_linear")?;
        all.only_output(3).ok_or_else(|| part.missing("output_linear has no fourth output"))?
    };
    trunk(part, layers, density)
}

/// kwea123/nerf_pl: layers counted from 1, the density without a bound of its own.
fn nerf_pl(part: &Part<'_>) -> Result<Recognised, LayoutError> {
    let layers = part.layers(|l| format!("xyz_encoding_{}.0", l + 1))?;
    trunk(part, layers, part.layer("sigma")?)
}

fn bmild(part: &Part<'_>) -> Result<Recognised, LayoutError> {
    let layer = |l: usize| part.kernel_layer(&(2 * l).to_string(), &(2 * l + 1).to_string());
    let layers = (0..8).map(layer).collect::<Result<Vec<Dense>, LayoutError>>()?;
    trunk(part, layers, layer(11)?)
}

/// Layers with ReLU; one that is wider than what comes before also takes the input, before it.
fn trunk(part: &Part<'_>, layers: Vec<Dense>, density: Dense) -> Result<Recognised, LayoutError> {
    let mut graph = Graph::new();
    let input = encoded(part, &mut graph, &layers)?;
    let mut h = input;
    for (l, layer) in layers.into_iter().enumerate() {
        if l > 0 && layer.inputs() == graph.width(h) + graph.width(input) {
            h = graph.joined(&[input, h]);
        }
        h = connect(part, &mut graph, layer, h)?;
        h = graph.map(Activation::Relu, h);
    }
    end(part, graph, density, h)
}

/// krrish94/nerf-pytorch: a first layer without ReLU, then layers with.
fn krrish94(part: &Part<'_>) -> Result<Recognised, LayoutError> {
    let mut layers = vec![part.layer("layer1")?];
    layers.extend(part.layers(|l| format!("layers_xyz.{l}"))?);
    let mut graph = Graph::new();
    let input = encoded(part, &mut graph, &layers)?;
    let mut h = input;
    for (l, layer) in layers.into_iter().enumerate() {
        if l > 0 && layer.inputs() == graph.width(h) + graph.width(input) {
            h = graph.joined(&[h, input]);
        }
        h = connect(part, &mut graph, layer, h)?;
        if l > 0 {
            h = graph.map(Activation::Relu, h);
        }
    }
    end(part, graph, part.layer("fc_alpha")?, h)
}

fn encoded(part: &Part<'_>, graph: &mut Graph, layers: &[Dense]) -> Result<NodeId, LayoutError> {
    let inputs = layers.first().map_or(0, Dense::inputs);
    match inputs.checked_sub(3) {
        Some(0) => Ok(graph.position()),
        Some(code) if code % 6 == 0 && code <= 6 * 24 => {
            Ok(graph.encoding(Encoding::ByOctave { octaves: code / 6 }))
        }
        _ => Err(part.mismatch(format!("the first layer takes {inputs} inputs instead of 3 + 6 L"))),
    }
}

fn connect(part: &Part<'_>, graph: &mut Graph, layer: Dense, from: NodeId) -> Result<NodeId, LayoutError> {
    let (wanted, given) = (layer.inputs(), graph.width(from));
    let defect = || part.mismatch(format!("a layer takes {wanted} inputs, but the one before gives {given}"));
    graph.dense(layer, from).ok_or_else(defect)
}

fn end(part: &Part<'_>, mut graph: Graph, density: Dense, h: NodeId) -> Result<Recognised, LayoutError> {
    let density = density.only_output(0).expect("a layer has an output");
    connect(part, &mut graph, density, h)?;
    Ok(Recognised {
        graph,
        layout: "NeRF",
        quantity: Quantity::Density,
        bounds: cube(HALF_SIDE),
        hidden: Some(Activation::Relu),
    })
}

//! Decoders of many shapes (Park et al. 2019): a code and a position to a distance.

use super::super::activation::Activation;
use super::super::graph::{Dense, Graph};
use super::state::{Part, State};
use super::{Latent, LayoutError, Quantity, Recognised, cube};

pub(super) fn read(state: &State<'_>, latent: Option<&Latent>) -> Option<Result<Recognised, LayoutError>> {
    if let Some(part) = state.part_of_layer("lin0", &["decoder"], "DeepSDF") {
        let layers = part.layers(|l| format!("lin{l}"));
        return Some(layers.and_then(|layers| decoder(&part, layers, latent)));
    }
    let part = state.part_of_layer("skip_layer.0", &[], "DeepSDF (maurock)")?;
    Some(maurock_layers(&part).and_then(|layers| decoder(&part, layers, latent)))
}

/// Layers of maurock/DeepSDF: three, the one before the skip, three, the last.
fn maurock_layers(part: &Part<'_>) -> Result<Vec<Dense>, LayoutError> {
    let mut layers = part.layers(|l| format!("net.{l}.0"))?;
    if layers.len() < 3 {
        return Err(part.missing("net.2.0 is missing"));
    }
    let skip = part.layer("skip_layer.0")?;
    layers.insert(3, skip);
    layers.push(part.layer("final_layer.0")?);
    Ok(layers)
}

/// ReLU, a layer that also takes code and position, tanh at the end.
fn decoder(part: &Part<'_>, layers: Vec<Dense>, latent: Option<&Latent>) -> Result<Recognised, LayoutError> {
    let inputs = layers.first().map_or(0, Dense::inputs);
    let length =
        inputs.checked_sub(3).ok_or_else(|| part.mismatch("its first layer has no room for a position"))?;
    let zeros = Latent(vec![0.0; length]);
    let code = latent.unwrap_or(&zeros);
    if code.0.len() != length {
        let found = code.0.len();
        return Err(LayoutError::Latent { expected: length, found });
    }
    let last = layers.len() - 1;
    let mut graph = Graph::new();
    let position = graph.position();
    let mut h = position;
    for (l, layer) in layers.into_iter().enumerate() {
        let (wanted, given) = (layer.inputs(), graph.width(h));
        let mismatch =
            || part.mismatch(format!("layer {l} takes {wanted} inputs, but the one before gives {given}"));
        h = if l == 0 {
            // The code is the same at every point: its part of the layer goes into the bias.
            let layer = layer.with_inner_inputs(0, &code.0).ok_or_else(mismatch)?;
            graph.dense(layer, position).ok_or_else(mismatch)?
        } else if wanted == given + inputs {
            let layer = layer.with_inner_inputs(given, &code.0).ok_or_else(mismatch)?;
            let both = graph.joined(&[h, position]);
            graph.dense(layer, both).ok_or_else(mismatch)?
        } else {
            let layer = if l == last { layer.only_output(0) } else { Some(layer) };
            layer.and_then(|layer| graph.dense(layer, h)).ok_or_else(mismatch)?
        };
        h = graph.map(if l < last { Activation::Relu } else { Activation::Tanh }, h);
    }
    Ok(Recognised {
        graph,
        layout: "DeepSDF",
        quantity: Quantity::Distance,
        bounds: cube(1.0),
        hidden: Some(Activation::Relu),
    })
}

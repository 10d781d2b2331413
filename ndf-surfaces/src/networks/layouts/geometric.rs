//! Networks initialised to a sphere (Atzmon and Lipman 2020): IDR (Yariv et al. 2020), NeuS (Wang et al. 2021), and
//! SDFStudio's.
//!
//! Softplus of β = 100, one layer that also takes the input, divided by √2 together. The first output is the
//! distance, the others are features for colours.

use super::super::activation::Activation;
use super::super::encoding::Encoding;
use super::super::graph::{Dense, Graph, NodeId};
use super::super::hash_grid::{HashGrid, HashGridShape};
use super::state::{Part, State};
use super::{Latent, LayoutError, Quantity, Recognised, cube};

/// The activation between layers.
const SOFTPLUS: Activation = Activation::Softplus { beta: 100.0 };
/// Where the networks lie in checkpoints.
const PREFERRED: [&str; 4] = ["sdf_network_fine", "sdf_network", "implicit_network", "field"];
/// Octaves of SDFStudio's encoding.
const SDFSTUDIO_OCTAVES: usize = 6;

pub(super) fn read(state: &State<'_>, latent: Option<&Latent>) -> Option<Result<Recognised, LayoutError>> {
    if let Some(part) = state.part_of_layer("glin0", &PREFERRED, "SDFStudio") {
        return Some(sdfstudio(&part));
    }
    let part = state.part_of_layer("lin0", &PREFERRED, "NeuS")?;
    let layers = match part.layers(|l| format!("lin{l}")) {
        Ok(layers) => layers,
        Err(error) => return Some(Err(error)),
    };
    (!is_decoder(&part, &layers, latent)).then(|| neus(&part, layers))
}

/// Whether layers named as those of NeuS are DeepSDF's, whose decoder takes a code besides the position and has one output.
/// Its authors train it within `DataParallel`, which puts `module` before the names.
fn is_decoder(part: &Part<'_>, layers: &[Dense], latent: Option<&Latent>) -> bool {
    let code = layers.first().map_or(0, Dense::inputs).saturating_sub(3);
    let has_one_output = layers.last().is_some_and(|last| last.outputs() == 1);
    let is_named = part.prefix().contains("decoder") || part.prefix().ends_with("model_state_dict.module.");
    let takes_code = latent.is_some_and(|latent| latent.0.len() == code);
    is_named && part.prefix().contains("decoder")
        || (has_one_output && code > 0 && (is_named || takes_code || !code.is_multiple_of(6)))
}

fn neus(part: &Part<'_>, layers: Vec<Dense>) -> Result<Recognised, LayoutError> {
    let inputs = layers.first().map_or(0, Dense::inputs);
    let mut graph = Graph::new();
    let input = match inputs.checked_sub(3) {
        Some(0) => graph.position(),
        Some(code) if code % 6 == 0 && code <= 6 * 16 => {
            graph.encoding(Encoding::ByOctave { octaves: code / 6 })
        }
        _ => return Err(part.mismatch(format!("lin0 takes {inputs} inputs instead of 3 + 6 L"))),
    };
    chain(part, &mut graph, layers, input)?;
    Ok(Recognised {
        graph,
        layout: "NeuS",
        quantity: Quantity::Distance,
        bounds: cube(1.0),
        hidden: Some(SOFTPLUS),
    })
}

fn sdfstudio(part: &Part<'_>) -> Result<Recognised, LayoutError> {
    let layers = part.layers(|l| format!("glin{l}"))?;
    let code = 3 + 6 * SDFSTUDIO_OCTAVES;
    let inputs = layers.first().map_or(0, Dense::inputs);
    let features = inputs.checked_sub(code).ok_or_else(|| {
        part.mismatch(format!("glin0 takes {inputs} inputs instead of {code} and the features of a grid"))
    })?;
    let mut graph = Graph::new();
    let encoding = graph.encoding(Encoding::ByCoordinate { octaves: SDFSTUDIO_OCTAVES });
    let mut inputs = vec![graph.position(), encoding];
    if features > 0 {
        // A field without a grid puts zeros in its place.
        inputs.push(match part.tensor("encoding.params") {
            Some(grid) => {
                let shape = HashGridShape {
                    levels: features / 2,
                    features: 2,
                    log2_entries: 19,
                    coarsest: 16.0,
                    growth: (2048.0_f64 / 16.0).powf(1.0 / (features as f64 / 2.0 - 1.0)),
                    smooth: true,
                };
                let grid = HashGrid::new(shape, grid.values().to_vec(), cube(2.0)).ok_or_else(|| {
                    let (found, needed) = (grid.values().len(), shape.parameters().unwrap_or(0));
                    part.mismatch(format!("encoding.params has {found} numbers instead of {needed}"))
                })?;
                graph.grid(grid)
            }
            None => {
                let zeros = Dense::new(vec![0.0; 3 * features], vec![0.0; features]);
                let position = graph.position();
                zeros.and_then(|zeros| graph.dense(zeros, position)).expect("three inputs")
            }
        });
    }
    let input = graph.joined(&inputs);
    chain(part, &mut graph, layers, input)?;
    Ok(Recognised {
        graph,
        layout: "SDFStudio",
        quantity: Quantity::Distance,
        bounds: cube(1.0),
        hidden: Some(SOFTPLUS),
    })
}

/// The layers, one after the other; one that is wider than what comes before also takes the input.
fn chain(part: &Part<'_>, graph: &mut Graph, layers: Vec<Dense>, input: NodeId) -> Result<(), LayoutError> {
    let last = layers.len() - 1;
    // All layers but the last are of one width, or by the input narrower where the next one takes it as well; the last has
    // a distance, and features.
    let (width, end) = (layers[0].outputs(), layers[last].outputs());
    if last > 0 && end > 1 && (end == width || end + graph.width(input) == width) {
        return Err(part.missing(format!(
            "it ends with layer {last} of {end} outputs, which is the width of a layer within; those after it are missing"
        )));
    }
    let mut h = input;
    for (l, layer) in layers.into_iter().enumerate() {
        let (wanted, given) = (layer.inputs(), graph.width(h));
        let mut layer = layer;
        if wanted == given + graph.width(input) && l > 0 {
            h = graph.joined(&[h, input]);
            layer = layer.on_scaled_inputs(std::f32::consts::FRAC_1_SQRT_2);
        }
        if l == last {
            layer = layer.only_output(0).expect("a layer has an output");
        }
        h = graph.dense(layer, h).ok_or_else(|| {
            part.mismatch(format!("layer {l} takes {wanted} inputs, but the one before gives {given}"))
        })?;
        if l < last {
            h = graph.map(SOFTPLUS, h);
        }
    }
    Ok(())
}

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
use super::{LayoutError, Quantity, Recognised, cube};

/// Where the networks lie in checkpoints.
const PREFERRED: [&str; 4] = ["sdf_network_fine", "sdf_network", "implicit_network", "field"];
/// Octaves of SDFStudio's encoding.
const SDFSTUDIO_OCTAVES: usize = 6;

pub(super) fn read(state: &State<'_>) -> Option<Result<Recognised, LayoutError>> {
    let studio =
        ["glin0.weight_v", "glin0.weight"].iter().find_map(|name| state.part(name, &PREFERRED, "SDFStudio"));
    if let Some(part) = studio {
        return Some(sdfstudio(&part));
    }
    let part =
        ["lin0.weight_v", "lin0.weight"].iter().find_map(|name| state.part(name, &PREFERRED, "NeuS"))?;
    // The same names are DeepSDF's, whose decoder has codes for inputs and one output.
    if part.prefix().contains("decoder") {
        return None;
    }
    Some(neus(&part))
}

fn neus(part: &Part<'_>) -> Result<Recognised, LayoutError> {
    let layers = part.layers(|l| format!("lin{l}"))?;
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
    Ok(Recognised { graph, layout: "NeuS", quantity: Quantity::Distance, bounds: cube(1.0) })
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
    Ok(Recognised { graph, layout: "SDFStudio", quantity: Quantity::Distance, bounds: cube(1.0) })
}

/// The layers, one after the other; one that is wider than what comes before also takes the input.
fn chain(part: &Part<'_>, graph: &mut Graph, layers: Vec<Dense>, input: NodeId) -> Result<(), LayoutError> {
    let last = layers.len() - 1;
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
            h = graph.map(Activation::Softplus { beta: 100.0 }, h);
        }
    }
    Ok(())
}

//! BACON (Lindell et al. 2022): products of sine filters, with an output at several bandwidths, of which the widest
//! is read.

use super::super::activation::Activation;
use super::super::graph::Graph;
use super::state::{Part, State};
use super::{LayoutError, Quantity, Recognised, cube, nerf};

/// Which filter each layer of an eight-layer network uses: the authors' networks reuse them.
const REUSED: [usize; 9] = [2, 2, 2, 4, 4, 6, 6, 8, 8];

pub(super) fn read(state: &State<'_>) -> Option<Result<Recognised, LayoutError>> {
    let part = state.part("filters.0.linear.weight", &[], "BACON")?;
    Some(network(&part))
}

fn network(part: &Part<'_>) -> Result<Recognised, LayoutError> {
    let filters = part.layers(|l| format!("filters.{l}.linear"))?;
    let layers = part.layers(|l| format!("linear.{l}"))?;
    if layers.is_empty() || filters.len() != layers.len() + 1 {
        let (filters, layers) = (filters.len(), layers.len());
        return Err(
            part.mismatch(format!("it has {filters} filters and {layers} layers instead of one filter more"))
        );
    }
    let last = layers.len();
    let output = part.layer(&format!("output_linear.{last}"))?;
    let (quantity, bounds, output) = match output.outputs() {
        1 => (Quantity::Distance, cube(0.5), Some(output)),
        // Colours and density, of scenes like those of other radiance fields.
        4 => (Quantity::Density, cube(nerf::HALF_SIDE), output.only_output(3)),
        n => return Err(part.mismatch(format!("its output has {n} numbers instead of 1 or 4"))),
    };
    let filter_of = |l: usize| if last == 8 { REUSED[l] } else { l };
    let mut graph = Graph::new();
    let position = graph.position();
    let mismatch = |l: usize| part.mismatch(format!("layer {l} does not fit the one before"));
    let sine = Activation::Sine { frequency: 1.0 };
    let mut known = vec![None; filters.len()];
    let mut filtered = |graph: &mut Graph, l: usize| {
        let filter = filter_of(l);
        if let Some(node) = known[filter] {
            return Ok(node);
        }
        let dense = graph.dense(filters[filter].clone(), position).ok_or_else(|| mismatch(l))?;
        Ok(*known[filter].insert(graph.map(sine, dense)))
    };
    let mut h = filtered(&mut graph, 0)?;
    for (l, layer) in layers.into_iter().enumerate() {
        let filter = filtered(&mut graph, l + 1)?;
        let linear = graph.dense(layer, h).ok_or_else(|| mismatch(l))?;
        h = graph.product(filter, linear).ok_or_else(|| mismatch(l))?;
    }
    output.and_then(|output| graph.dense(output, h)).ok_or_else(|| mismatch(last))?;
    Ok(Recognised { graph, layout: "BACON", quantity, bounds, hidden: Some(sine) })
}

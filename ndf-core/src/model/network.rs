//! The `NETW` section: the shape of a network and its parameters, each layer's on a grid.

use super::bytes::{Reader, Writer};
use super::format::ModelError;
use super::grid::Grid;
use super::range_coder::{Coder, Decoder, Encoder, Integers};
use crate::field::FieldShape;
use crate::network::encoding::MOST_OCTAVES;
use crate::network::{Activation, Mlp, MlpShape};

/// In the order of their codes.
const ACTIVATIONS: [Activation; 5] = Activation::ALL;
/// Wider or deeper networks are refused: no model has them, and a hostile file must not cost memory.
const WIDEST_LAYER: usize = 4096;
const MOST_PARAMETERS: usize = 1 << 24;

const PLAIN: u8 = 0;
const CODED: u8 = 1;

/// The section.
pub(super) fn write(shape: &FieldShape, network: &Mlp) -> Vec<u8> {
    let mut w = Writer::default();
    let code = ACTIVATIONS.iter().position(|a| *a == shape.activation).unwrap_or_default();
    w.u8(code as u8);
    w.u8(u8::from(shape.residual));
    w.u8(shape.octaves as u8);
    w.u8(shape.hidden.len() as u8);
    shape.hidden.iter().for_each(|&width| w.u32(width as u32));
    write_parameters(&mut w, network);
    w.0
}

/// Reads the section: the shape, where vertices have so many features, and the parameters.
pub(super) fn read(
    mut r: Reader<'_>,
    features: usize,
    version: u32,
) -> Result<(FieldShape, Vec<f32>), ModelError> {
    let activation = r.u8()?;
    let Some(&activation) = ACTIVATIONS.get(usize::from(activation)) else {
        return Err(r.defect(format!("activation {activation} is not known")));
    };
    let residual = r.u8()? != 0;
    let octaves = r.u8()? as usize;
    if octaves > MOST_OCTAVES {
        return Err(r.defect(format!("{octaves} octaves are more than {MOST_OCTAVES}")));
    }
    let depth = r.u8()? as usize;
    let hidden: Vec<usize> = r.u32s(depth)?.into_iter().map(|w| w as usize).collect();
    if let Some(width) = hidden.iter().find(|&&w| w == 0 || w > WIDEST_LAYER) {
        return Err(r.defect(format!("a layer of {width} neurons is not possible")));
    }
    let shape = FieldShape { features, octaves, hidden, activation, residual };
    let network = shape.network();
    let parameters = if version == 1 {
        let parameters = r.f32s(network.parameter_count())?;
        r.end()?;
        parameters
    } else {
        read_parameters(&mut r, &network)?
    };
    Ok((shape, parameters))
}

/// Parameters of a network, to the end of a section: weights of a layer are on one grid, its biases on another.
pub(super) fn write_parameters(w: &mut Writer, network: &Mlp) {
    let groups = groups(network.shape(), network.parameters());
    let grids: Option<Vec<Grid>> = groups.iter().map(|values| Grid::of(values.iter().copied())).collect();
    let Some(grids) = grids else {
        w.u8(PLAIN);
        w.f32s(network.parameters().iter().copied());
        return;
    };
    w.u8(CODED);
    grids.iter().for_each(|grid| w.u8(grid.exponent() as u8));
    let mut coder = Encoder::new();
    for (values, grid) in groups.iter().zip(&grids) {
        let mut model = Integers::new();
        for &x in *values {
            model.code(&mut coder, grid.integer(x));
        }
    }
    w.0.extend(coder.finish());
}

/// Reads what [`write_parameters`] has written.
pub(super) fn read_parameters(r: &mut Reader<'_>, shape: &MlpShape) -> Result<Vec<f32>, ModelError> {
    let count = shape.parameter_count();
    match r.u8()? {
        PLAIN => {
            let parameters = r.f32s(count)?;
            r.end()?;
            Ok(parameters)
        }
        CODED if count > MOST_PARAMETERS => Err(r.defect("it has absurdly many parameters")),
        CODED => {
            let layers = shape.layers();
            let grids = r.take(2 * layers.len())?;
            let mut coder = Decoder::new(r.rest());
            let mut parameters = Vec::new();
            let sizes = layers.iter().flat_map(|&(inputs, outputs)| [inputs * outputs, outputs]);
            for (size, &exponent) in sizes.zip(grids) {
                let (mut model, grid) = (Integers::new(), Grid::new(exponent as i8));
                for _ in 0..size {
                    parameters.push(grid.number(model.code(&mut coder, 0)));
                    if coder.is_exhausted() {
                        return Err(r.defect("it ends too early"));
                    }
                }
            }
            Ok(parameters)
        }
        other => Err(r.defect(format!("coding {other} is not known"))),
    }
}

/// Parameters in groups that share a grid: for every layer the weights, then the biases.
pub(crate) fn groups<'a>(shape: &MlpShape, mut parameters: &'a [f32]) -> Vec<&'a [f32]> {
    let mut groups = Vec::new();
    for (inputs, outputs) in shape.layers() {
        for size in [inputs * outputs, outputs] {
            let (group, rest) = parameters.split_at(size);
            groups.push(group);
            parameters = rest;
        }
    }
    groups
}

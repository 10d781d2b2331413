//! The `NETW` section: the shape of the field's network and its parameters.

use super::bytes::{Reader, Writer};
use super::format::ModelError;
use super::numbers::{self, Groups};
use crate::field::FieldShape;
use ndf_network::{Activation, Mlp};

/// The section.
pub(super) fn write(shape: &FieldShape, network: &Mlp) -> Vec<u8> {
    let mut w = Writer::default();
    w.u8(shape.activation.code());
    w.u8(u8::from(shape.residual));
    w.u8(shape.octaves as u8);
    w.u8(shape.hidden.len() as u8);
    shape.hidden.iter().for_each(|&width| w.u32(width as u32));
    numbers::write(&mut w, Groups::Layers(network.shape()), network.parameters());
    w.0
}

/// Reads the section: the shape, where vertices have so many features, and the parameters.
pub(super) fn read(
    mut r: Reader<'_>,
    features: usize,
    version: u32,
) -> Result<(FieldShape, Vec<f32>), ModelError> {
    let activation = r.u8()?;
    let Some(activation) = Activation::from_code(activation) else {
        return Err(r.defect(format!("activation {activation} is not known")));
    };
    let residual = r.u8()? != 0;
    let octaves = r.u8()? as usize;
    let depth = r.u8()? as usize;
    let hidden: Vec<usize> = r.u32s(depth)?.into_iter().map(|w| w as usize).collect();
    let shape = FieldShape { features, octaves, hidden, activation, residual };
    if let Some(defect) = shape.defect() {
        return Err(r.defect(defect));
    }
    let network = shape.network();
    let count = network.parameter_count();
    let parameters = match version {
        1 => r.f32s(count)?,
        _ => numbers::read(&mut r, Groups::Layers(&network), count)?,
    };
    r.end()?;
    Ok((shape, parameters))
}

//! The parts of an [`IntrinsicNetwork`] in a section: those of the field are in `FEAT` and `NETW`, those of scalar fields in
//! their `SCAL`.

use super::bytes::{Reader, Writer};
use super::error::ModelError;
use super::numbers::{self, Groups};
use crate::intrinsic_network::{IntrinsicNetwork, MAX_FEATURES, NetworkShape};
use ndf_mesh::io::FileDefect;
use ndf_network::{Activation, MlpShape};

/// Writes the number of features a vertex.
pub(super) fn write_dimension(w: &mut Writer, network: &IntrinsicNetwork) {
    w.u32(network.shape().features as u32);
}

/// Writes the features.
pub(super) fn write_features(w: &mut Writer, network: &IntrinsicNetwork) {
    numbers::write(w, Groups::Interleaved(network.shape().features), network.features());
}

/// Writes the shape but for the number of features, with a byte that says what the network is for.
pub(super) fn write_shape(w: &mut Writer, network: &IntrinsicNetwork, purpose: u8) {
    let shape = network.shape();
    w.u8(shape.activation.code());
    w.u8(purpose);
    w.u8(shape.octaves as u8);
    w.u8(shape.hidden.len() as u8);
    shape.hidden.iter().for_each(|&width| w.u32(width as u32));
}

/// Writes the parameters of the perceptron.
pub(super) fn write_parameters(w: &mut Writer, network: &IntrinsicNetwork) {
    numbers::write(w, Groups::Layers(network.mlp().shape()), network.mlp().parameters());
}

/// Reads the number of features a vertex. Sizes that are absurd must not get as far as being multiplied.
pub(super) fn read_dimension(r: &mut Reader<'_>) -> Result<usize, ModelError> {
    let dimension = r.u32()? as usize;
    if dimension > MAX_FEATURES {
        let text = format!("{dimension} features a vertex are more than {MAX_FEATURES}");
        return Err(r.defect(FileDefect::too_large(text)));
    }
    Ok(dimension)
}

/// Reads the features of so many vertices.
pub(super) fn read_features(
    r: &mut Reader<'_>,
    dimension: usize,
    vertices: usize,
    version: u32,
) -> Result<Vec<f32>, ModelError> {
    array(r, Groups::Interleaved(dimension), vertices.saturating_mul(dimension), version)
}

/// Reads the shape, where vertices have so many features, and the byte that says what the network is for.
pub(super) fn read_shape(r: &mut Reader<'_>, features: usize) -> Result<(NetworkShape, u8), ModelError> {
    let code = r.u8()?;
    let Some(activation) = Activation::from_code(code) else {
        return Err(r.defect(FileDefect::unsupported(format!("activation {code} is not known"))));
    };
    let purpose = r.u8()?;
    let octaves = r.u8()? as usize;
    let depth = r.u8()? as usize;
    let hidden = r.u32s(depth)?.into_iter().map(|w| w as usize).collect();
    let shape = NetworkShape { features, octaves, hidden, activation };
    shape.validate().map_err(|e| r.defect(e))?;
    Ok((shape, purpose))
}

/// Reads the parameters of a perceptron.
pub(super) fn read_parameters(
    r: &mut Reader<'_>,
    mlp: &MlpShape,
    version: u32,
) -> Result<Vec<f32>, ModelError> {
    array(r, Groups::Layers(mlp), mlp.parameter_count(), version)
}

/// Reads an array of numbers. In version 1 it is always plain, without saying so.
fn array(r: &mut Reader<'_>, groups: Groups<'_>, count: usize, version: u32) -> Result<Vec<f32>, ModelError> {
    if version == 1 { r.f32s(count) } else { numbers::read(r, groups, count) }
}

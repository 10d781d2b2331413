//! Scalar fields as bytes. All numbers little-endian:
//!
//! | type | what |
//! |---|---|
//! | u32 | channels K |
//! | per channel | u8 length of the name, the name in ASCII, f32×4: least value, largest value, mean, deviation |
//! | u32 | features d per base vertex |
//! | u8 | activation (0 ReLU, 1 leaky ReLU, 2 SiLU, 3 sine, 4 tanh) |
//! | u8 | channel index (0: an output for each, 1: an input) |
//! | u8 | octaves |
//! | u8 | hidden layers, then a u32 width for each |
//! | array | parameters, layer by layer: weights row-major `outputs × inputs`, then biases |
//! | array | V · d features, vertex-major |
//!
//! Arrays are written as everywhere in the model file.

use super::{Channel, ChannelIndex, MOST_CHANNELS, ScalarShape, StoredScalars};
use crate::file::ModelError;
use crate::file::bytes::{Reader, Writer};
use crate::file::numbers::{self, Groups};
use ndf_network::Activation;

/// Tag of the section of a model file that holds the payload.
pub const TAG: &str = "SCAL";

impl StoredScalars {
    /// The bytes of these fields.
    pub fn to_payload(&self) -> Vec<u8> {
        let mut w = Writer::default();
        w.u32(self.channels.len() as u32);
        for Channel { name, range, mean, deviation } in &self.channels {
            w.u8(name.len() as u8);
            w.0.extend(name.as_bytes());
            w.f32s([range[0], range[1], *mean, *deviation]);
        }
        let shape = &self.shape;
        w.u32(shape.features as u32);
        w.u8(shape.activation.code());
        w.u8(u8::from(shape.index == ChannelIndex::Input));
        w.u8(shape.octaves as u8);
        w.u8(shape.hidden.len() as u8);
        shape.hidden.iter().for_each(|&width| w.u32(width as u32));
        numbers::write(&mut w, Groups::Layers(self.network.shape()), self.network.parameters());
        numbers::write(&mut w, Groups::Interleaved(shape.features), &self.features);
        w.0
    }

    /// The fields in these bytes, over a base mesh of so many vertices.
    ///
    /// # Errors
    /// If they are not whole fields for such a base mesh. Allocates no more than a small multiple of the bytes.
    pub fn from_payload(bytes: &[u8], base_vertices: usize) -> Result<Self, ModelError> {
        let mut r = Reader::new(TAG, bytes);
        let count = r.u32()? as usize;
        if count > MOST_CHANNELS {
            return Err(r.defect(format!("{count} scalar fields are more than {MOST_CHANNELS}")));
        }
        let channels: Vec<Channel> = (0..count).map(|_| read_channel(&mut r)).collect::<Result<_, _>>()?;
        let shape = read_shape(&mut r)?;
        // The parts are checked again as they are put together; here, that they are all there.
        let layers = shape.network(channels.len());
        let parameters = numbers::read(&mut r, Groups::Layers(&layers), layers.parameter_count())?;
        let count = base_vertices.saturating_mul(shape.features);
        let features = numbers::read(&mut r, Groups::Interleaved(shape.features), count)?;
        r.end()?;
        Self::new(channels, shape, base_vertices, features, parameters).map_err(|e| r.defect(e.to_string()))
    }
}

fn read_channel(r: &mut Reader<'_>) -> Result<Channel, ModelError> {
    let length = r.u8()? as usize;
    let name = String::from_utf8(r.u8s(length)?).map_err(|_| r.defect("a name is not ASCII"))?;
    let [least, most, mean, deviation] = [r.f32()?, r.f32()?, r.f32()?, r.f32()?];
    Ok(Channel { name, range: [least, most], mean, deviation })
}

fn read_shape(r: &mut Reader<'_>) -> Result<ScalarShape, ModelError> {
    let features = r.u32()? as usize;
    let code = r.u8()?;
    let Some(activation) = Activation::from_code(code) else {
        return Err(r.defect(format!("activation {code} is not known")));
    };
    let index = match r.u8()? {
        0 => ChannelIndex::Output,
        1 => ChannelIndex::Input,
        code => return Err(r.defect(format!("channel index {code} is not known"))),
    };
    let octaves = r.u8()? as usize;
    let depth = r.u8()? as usize;
    let hidden = r.u32s(depth)?.into_iter().map(|w| w as usize).collect();
    let shape = ScalarShape { features, octaves, hidden, activation, index };
    // Sizes that are absurd must not get as far as being multiplied.
    shape.defect().map_or(Ok(shape), |defect| Err(r.defect(defect)))
}

#[cfg(test)]
mod tests {
    use super::super::tests::random;
    use super::*;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    const VERTICES: usize = 12;

    fn examples() -> [StoredScalars; 2] {
        let small = ScalarShape { features: 2, hidden: vec![3], ..ScalarShape::default() };
        let coordinates =
            ScalarShape { features: 0, octaves: 2, index: ChannelIndex::Input, ..small.clone() };
        [small, coordinates].map(|shape| random(shape, VERTICES))
    }

    #[test]
    fn round_trip_keeps_every_bit() {
        for fields in examples() {
            let bytes = fields.to_payload();
            let again = StoredScalars::from_payload(&bytes, VERTICES).unwrap();
            assert_eq!(again.to_payload(), bytes);
            assert_eq!((again.channels(), again.shape()), (fields.channels(), fields.shape()));
            assert_eq!(again.features(), fields.features());
            assert_eq!(again.network(), fields.network());
        }
    }

    #[test]
    fn truncations_and_another_base_mesh_are_noticed() {
        for fields in examples() {
            let mut bytes = fields.to_payload();
            for length in 0..bytes.len() {
                assert!(StoredScalars::from_payload(&bytes[..length], VERTICES).is_err(), "{length} bytes");
            }
            if fields.shape().features > 0 {
                assert!(StoredScalars::from_payload(&bytes, VERTICES - 1).is_err());
                assert!(StoredScalars::from_payload(&bytes, usize::MAX).is_err());
            }
            bytes.push(0);
            let error = StoredScalars::from_payload(&bytes, VERTICES).unwrap_err();
            assert!(error.to_string().contains("SCAL") && error.to_string().contains("longer"), "{error}");
        }
    }

    #[test]
    fn hostile_bytes_give_errors_or_fields_but_no_panic() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for round in 0..4000 {
            let mut bytes = examples()[round % 2].to_payload();
            for _ in 0..rng.random_range(1..5) {
                let at = rng.random_range(0..bytes.len().min(110));
                bytes[at] = rng.random();
            }
            if rng.random_bool(0.2) {
                bytes.truncate(rng.random_range(0..bytes.len()));
            }
            if let Ok(fields) = StoredScalars::from_payload(&bytes, VERTICES) {
                assert!(fields.channels().iter().all(|c| c.value(f32::NAN).is_finite()));
            }
        }
    }
}

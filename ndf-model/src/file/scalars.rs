//! The `SCAL` section: scalar fields of a network as bytes. All numbers little-endian:
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

use super::bytes::{Reader, Writer};
use super::error::{ModelError, VERSION};
use super::network;
use crate::intrinsic_network::{ChannelIndex, IntrinsicNetwork};
use crate::scalars::{Channel, MAX_CHANNELS, ScalarShape, SurfaceScalars};
use ndf_mesh::io::FileDefect;

/// Tag of the section.
pub(super) const TAG: &str = "SCAL";

/// The section of fields of this network.
pub(super) fn write(channels: &[Channel], network: &IntrinsicNetwork) -> Vec<u8> {
    let mut w = Writer::default();
    write_channels(&mut w, channels);
    network::write_dimension(&mut w, network);
    network::write_shape(&mut w, network, u8::from(network.passes().index() == ChannelIndex::Input));
    network::write_parameters(&mut w, network);
    network::write_features(&mut w, network);
    w.0
}

/// Writes the channels.
pub(super) fn write_channels(w: &mut Writer, channels: &[Channel]) {
    w.u32(channels.len() as u32);
    for Channel { name, range, mean, deviation } in channels {
        w.u8(name.len() as u8);
        w.0.extend(name.as_bytes());
        w.f32s([range[0], range[1], *mean, *deviation]);
    }
}

/// Reads the channels.
pub(super) fn read_channels(r: &mut Reader<'_>) -> Result<Vec<Channel>, ModelError> {
    let count = r.u32()? as usize;
    if count > MAX_CHANNELS {
        let text = format!("{count} scalar fields announced; at most {MAX_CHANNELS} are supported");
        return Err(r.defect(FileDefect::too_large(text)));
    }
    (0..count).map(|_| read_channel(r)).collect()
}

/// Reads the section, over a base mesh of so many vertices. Allocates no more than a small multiple of the bytes.
pub(super) fn read(mut r: Reader<'_>, base_vertices: usize) -> Result<SurfaceScalars, ModelError> {
    let channels = read_channels(&mut r)?;
    let dimension = network::read_dimension(&mut r)?;
    let (network, index) = network::read_shape(&mut r, dimension)?;
    let index = match index {
        0 => ChannelIndex::Output,
        1 => ChannelIndex::Input,
        code => {
            let text = format!("channel index {code} is not known");
            return Err(r.defect(FileDefect::unsupported(text)));
        }
    };
    let shape = ScalarShape { network, index };
    // The parts are checked again as they are put together; here, that they are all there.
    let parameters = network::read_parameters(&mut r, &shape.mlp(channels.len()), VERSION)?;
    let features = network::read_features(&mut r, dimension, base_vertices, VERSION)?;
    r.end()?;
    SurfaceScalars::new(channels, shape, base_vertices, features, parameters).map_err(|e| r.defect(e))
}

fn read_channel(r: &mut Reader<'_>) -> Result<Channel, ModelError> {
    let length = r.u8()? as usize;
    let name = String::from_utf8(r.u8s(length)?);
    let name = name.map_err(|_| r.defect(FileDefect::value("a name is not ASCII")))?;
    let [least, most, mean, deviation] = [r.f32()?, r.f32()?, r.f32()?, r.f32()?];
    Ok(Channel { name, range: [least, most], mean, deviation })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::intrinsic_network::NetworkShape;
    use crate::scalars::tests::random;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    const VERTICES: usize = 12;

    fn write(fields: &SurfaceScalars) -> Vec<u8> {
        super::write(fields.channels(), fields.network().unwrap())
    }

    fn examples() -> [SurfaceScalars; 2] {
        let mut small = ScalarShape::default();
        small.network = NetworkShape { features: 2, hidden: vec![3], ..small.network };
        let mut coordinates = ScalarShape { index: ChannelIndex::Input, ..small.clone() };
        coordinates.network.features = 0;
        [small, coordinates].map(|shape| random(shape, VERTICES))
    }

    #[test]
    fn round_trip_keeps_every_bit() {
        for fields in examples() {
            let bytes = write(&fields);
            let again = read(Reader::new(TAG, &bytes), VERTICES).unwrap();
            assert_eq!(write(&again), bytes);
            assert_eq!((again.channels(), again.shape()), (fields.channels(), fields.shape()));
            let [again, network] = [&again, &fields].map(|f| f.network().unwrap());
            assert_eq!((again.features(), again.mlp()), (network.features(), network.mlp()));
        }
    }

    #[test]
    fn truncations_and_another_base_mesh_are_noticed() {
        for fields in examples() {
            let mut bytes = write(&fields);
            for length in 0..bytes.len() {
                assert!(read(Reader::new(TAG, &bytes[..length]), VERTICES).is_err(), "{length} bytes");
            }
            if fields.shape().unwrap().network.features > 0 {
                assert!(read(Reader::new(TAG, &bytes), VERTICES - 1).is_err());
                assert!(read(Reader::new(TAG, &bytes), usize::MAX).is_err());
            }
            bytes.push(0);
            let error = read(Reader::new(TAG, &bytes), VERTICES).unwrap_err();
            assert!(
                error.to_string().contains("SCAL") && error.to_string().contains("bytes after its end"),
                "{error}"
            );
        }
    }

    #[test]
    fn hostile_bytes_give_errors_or_fields_but_no_panic() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for round in 0..4000 {
            let mut bytes = write(&examples()[round % 2]);
            for _ in 0..rng.random_range(1..5) {
                let at = rng.random_range(0..bytes.len().min(110));
                bytes[at] = rng.random();
            }
            if rng.random_bool(0.2) {
                bytes.truncate(rng.random_range(0..bytes.len()));
            }
            if let Ok(fields) = read(Reader::new(TAG, &bytes), VERTICES) {
                assert!(fields.channels().iter().all(|c| c.value(f32::NAN).is_finite()));
            }
        }
    }
}

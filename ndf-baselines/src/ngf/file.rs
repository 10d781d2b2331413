//! Neural geometry fields as bytes.

use ndf_core::glam::Vec3;
use ndf_network::Mlp;

use super::{NeuralGeometryField, shape};

/// Why bytes are no neural geometry field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NgfFileError {
    /// The bytes end early, or go on.
    #[error("the file has {found} bytes, but its {quads} quadrilaterals need another number")]
    Length {
        /// How many bytes there are.
        found: usize,
        /// How many quadrilaterals the file announces.
        quads: u32,
    },
    /// A quadrilateral has a corner that does not exist, or less than three different ones in turn.
    #[error("quadrilateral {0} has a corner that does not exist, or less than three different ones")]
    Quad(u32),
    /// A corner is in no quadrilateral.
    #[error("corner {0} is in no quadrilateral")]
    Corner(u32),
    /// A number is not finite.
    #[error("a number of the file is not finite")]
    NotFinite,
}

/// Bytes before the places: three numbers, the centre and the scale.
const HEADER: usize = 28;

impl NeuralGeometryField {
    /// The file: see the [module](super).
    pub fn to_bytes(&self) -> Vec<u8> {
        let counts = [self.quads.len(), self.points.len(), self.feature_count()].map(|n| n as u32);
        let place = |p: &Vec3| p.to_array();
        let floats = self.center.to_array().into_iter().chain([self.scale]);
        let floats = floats.chain(self.points.iter().flat_map(place)).chain(self.features.iter().copied());
        let mut bytes: Vec<u8> = counts.iter().flat_map(|n| n.to_le_bytes()).collect();
        bytes.extend(floats.flat_map(f32::to_le_bytes));
        bytes.extend(self.quads.as_flattened().iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(self.network.parameters().iter().flat_map(|x| x.to_le_bytes()));
        bytes
    }

    /// Reads what [`to_bytes`](Self::to_bytes) wrote.
    ///
    /// # Errors
    /// See [`NgfFileError`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, NgfFileError> {
        let words: Vec<u32> =
            bytes.chunks_exact(4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        let length = NgfFileError::Length { found: bytes.len(), quads: words.first().copied().unwrap_or(0) };
        let &[quads, corners, features, ..] = &words[..] else { return Err(length) };
        let [quads, corners, features] = [quads, corners, features].map(u64::from);
        // Every count is at most that of the words, so that nothing overflows.
        if [quads, corners, features].iter().any(|&n| n > words.len() as u64) {
            return Err(length);
        }
        let shape = shape(features as usize);
        let needed =
            HEADER as u64 / 4 + corners * (3 + features) + 4 * quads + shape.parameter_count() as u64;
        if bytes.len() as u64 != 4 * needed {
            return Err(length);
        }
        let (header, rest) = words.split_at(HEADER / 4);
        let (places, rest) = rest.split_at(3 * corners as usize);
        let (features, rest) = rest.split_at((corners * features) as usize);
        let (quads, parameters) = rest.split_at(4 * quads as usize);
        let floats = |words: &[u32]| -> Result<Vec<f32>, NgfFileError> {
            let finite = |&w: &u32| Some(f32::from_bits(w)).filter(|x| x.is_finite());
            words.iter().map(finite).collect::<Option<_>>().ok_or(NgfFileError::NotFinite)
        };
        let quads: Vec<[u32; 4]> = quads.chunks_exact(4).map(|q| [q[0], q[1], q[2], q[3]]).collect();
        let mut is_used = vec![false; corners as usize];
        for (i, &quad) in (0..).zip(&quads) {
            let [a, b, c, d] = quad;
            let is_sound = a != b
                && b != c
                && c != a
                && d != a
                && d != b
                && quad.iter().all(|&v| u64::from(v) < corners);
            if !is_sound {
                return Err(NgfFileError::Quad(i));
            }
            quad.iter().for_each(|&v| is_used[v as usize] = true);
        }
        if let Some(unused) = is_used.iter().position(|used| !used) {
            return Err(NgfFileError::Corner(unused as u32));
        }
        let frame = floats(&header[3..])?;
        Ok(Self {
            points: floats(places)?.chunks_exact(3).map(Vec3::from_slice).collect(),
            features: floats(features)?,
            quads,
            network: Mlp::new(shape, floats(parameters)?).map_err(|_| length)?,
            center: Vec3::from_slice(&frame),
            scale: frame[3],
        })
    }
}

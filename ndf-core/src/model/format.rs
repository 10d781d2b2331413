//! The `.ndf` file, version 1. All numbers little-endian.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | magic `89 4E 44 46 0D 0A 1A 0A` (so that a transfer as text is noticed) |
//! | 4 | version, 1 |
//! | 4 | number of sections n |
//! | 16 n | per section: 4-byte tag, CRC-32 of its payload, 8-byte length |
//! | 4 | CRC-32 of everything so far |
//! | … | payloads, in the order of the table, without gaps |
//!
//! Sections (a reader skips tags it does not know; the first four are required):
//!
//! | tag | payload |
//! |---|---|
//! | `SIML` | f64 scale, f64×3 centre: `normalised = scale · (world − centre)` |
//! | `BASE` | u32 V, u32 F, f32×3 V positions, 3 F indices (u16 where V ≤ 65,536, else u32) |
//! | `FEAT` | u32 d, f32 V·d, vertex-major |
//! | `NETW` | u8 activation (0 ReLU, 1 leaky ReLU, 2 SiLU, 3 sine, 4 tanh), u8 residual, u8 octaves, u8 hidden layers, u32 widths of these, f32 parameters |
//! | `PROV` | UTF-8 JSON |

use std::fs;
use std::path::Path;

use super::Model;
use super::bytes::{Reader, Writer};
use crate::field::{DisplacementField, FieldShape};
use crate::network::Activation;
use crate::network::encoding::MOST_OCTAVES;
use crate::{DVec3, ManifoldMesh, Similarity, TriangleMesh};

const MAGIC: [u8; 8] = *b"\x89NDF\r\n\x1a\n";
const VERSION: u32 = 1;
/// In the order of their codes.
const ACTIVATIONS: [Activation; 5] = Activation::ALL;
/// Wider or deeper networks are refused: no model has them, and a hostile file must not cost memory.
const WIDEST_LAYER: usize = 4096;
const MOST_FEATURES: usize = 4096;
const MOST_SECTIONS: usize = 1024;

/// Why bytes are not a model.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    /// The file cannot be read or written.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// Not a `.ndf` file.
    #[error("not an .ndf model: the file does not begin with the magic number")]
    Magic,
    /// Made by a later version.
    #[error("the model has format version {0}; this program reads up to version {VERSION}")]
    Version(u32),
    /// The header or the section table is damaged.
    #[error("the model is damaged: {0}")]
    Header(&'static str),
    /// The checksum of a section does not match.
    #[error("the model is damaged: the checksum of section {0} does not match")]
    Checksum(String),
    /// A required section is not there.
    #[error("the model has no section {0}")]
    Missing(&'static str),
    /// A section does not make sense.
    #[error("section {section} of the model: {defect}")]
    Section {
        /// Its tag.
        section: &'static str,
        /// What is wrong.
        defect: String,
    },
}

/// Bytes of the parts of a model file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SectionSizes {
    /// Base mesh.
    pub base: usize,
    /// Features.
    pub features: usize,
    /// Network.
    pub network: usize,
    /// Scalar fields.
    pub scalars: usize,
    /// The whole file.
    pub total: usize,
}

impl Model {
    /// Whether a file that begins with these bytes means to be a model.
    pub fn is_model(beginning: &[u8]) -> bool {
        beginning.starts_with(&MAGIC)
    }

    /// The bytes of the file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let sections = self.sections();
        let mut file = Writer(MAGIC.to_vec());
        file.u32(VERSION);
        file.u32(sections.len() as u32);
        for (tag, payload) in &sections {
            file.0.extend(tag.as_bytes());
            file.u32(crc32fast::hash(payload));
            file.0.extend((payload.len() as u64).to_le_bytes());
        }
        file.u32(crc32fast::hash(&file.0));
        sections.iter().for_each(|(_, payload)| file.0.extend(payload));
        file.0
    }

    /// The model in these bytes.
    ///
    /// # Errors
    /// If they are not a whole, undamaged model. Allocates no more than a small multiple of the input.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelError> {
        let sections = split(bytes)?;
        let section = |tag: &'static str| {
            let found = sections.iter().find(|(t, _)| t == tag.as_bytes());
            found.map(|(_, payload)| Reader::new(tag, payload)).ok_or(ModelError::Missing(tag))
        };
        let similarity = read_similarity(section("SIML")?)?;
        let base = read_base(section("BASE")?)?;
        let (dimension, features) = read_features(section("FEAT")?, base.vertex_count())?;
        let (shape, parameters) = read_network(section("NETW")?, dimension)?;
        let field = DisplacementField::new(base, shape, features, parameters)
            .map_err(|e| ModelError::Section { section: "NETW", defect: e.to_string() })?;
        let provenance = sections.iter().find(|(tag, _)| tag == b"PROV");
        let provenance =
            provenance.map_or_else(String::new, |(_, p)| String::from_utf8_lossy(p).into_owned());
        Ok(Self { field, similarity, provenance })
    }

    /// Reads a model file.
    ///
    /// # Errors
    /// If the file cannot be read or is not a whole, undamaged model.
    pub fn read(path: &Path) -> Result<Self, ModelError> {
        Self::from_bytes(&fs::read(path)?)
    }

    /// Sizes of the parts of the file.
    pub fn section_sizes(&self) -> SectionSizes {
        let mut sizes = SectionSizes { total: self.to_bytes().len(), ..SectionSizes::default() };
        for (tag, payload) in self.sections() {
            match tag {
                "BASE" => sizes.base = payload.len(),
                "FEAT" => sizes.features = payload.len(),
                "NETW" => sizes.network = payload.len(),
                _ => {}
            }
        }
        sizes
    }

    fn sections(&self) -> Vec<(&'static str, Vec<u8>)> {
        vec![
            ("SIML", self.similarity_bytes()),
            ("BASE", self.base_bytes()),
            ("FEAT", self.feature_bytes()),
            ("NETW", self.network_bytes()),
            ("PROV", self.provenance.as_bytes().to_vec()),
        ]
    }

    fn similarity_bytes(&self) -> Vec<u8> {
        let mut w = Writer::default();
        w.f64(self.similarity.scale());
        self.similarity.center().to_array().into_iter().for_each(|x| w.f64(x));
        w.0
    }

    fn base_bytes(&self) -> Vec<u8> {
        let base = self.field.base();
        let mut w = Writer::default();
        w.u32(base.vertex_count() as u32);
        w.u32(base.face_count() as u32);
        // Exact: a field's base positions are f32 values.
        w.f32s(base.positions().iter().flat_map(|p| p.as_vec3().to_array()));
        for &v in base.faces().iter().flatten() {
            if base.vertex_count() <= 1 << 16 { w.u16(v as u16) } else { w.u32(v) }
        }
        w.0
    }

    fn feature_bytes(&self) -> Vec<u8> {
        let mut w = Writer::default();
        w.u32(self.field.shape().features as u32);
        w.f32s(self.field.features().iter().copied());
        w.0
    }

    fn network_bytes(&self) -> Vec<u8> {
        let shape = self.field.shape();
        let mut w = Writer::default();
        let code = ACTIVATIONS.iter().position(|a| *a == shape.activation).unwrap_or_default();
        w.u8(code as u8);
        w.u8(u8::from(shape.residual));
        w.u8(shape.octaves as u8);
        w.u8(shape.hidden.len() as u8);
        shape.hidden.iter().for_each(|&width| w.u32(width as u32));
        w.f32s(self.field.network().parameters().iter().copied());
        w.0
    }
}

/// Tag and payload.
type Section<'a> = ([u8; 4], &'a [u8]);

/// All sections, checksums verified.
fn split(bytes: &[u8]) -> Result<Vec<Section<'_>>, ModelError> {
    const ENTRY: usize = 16;
    let word = |at: usize| -> Option<u32> { bytes.get(at..)?.first_chunk().map(|b| u32::from_le_bytes(*b)) };
    if !Model::is_model(bytes) {
        return Err(ModelError::Magic);
    }
    let cut = ModelError::Header("the file is cut short");
    let (Some(version), Some(count)) = (word(8), word(12)) else { return Err(cut) };
    if version != VERSION {
        return Err(ModelError::Version(version));
    }
    if count as usize > MOST_SECTIONS {
        return Err(ModelError::Header("it claims an absurd number of sections"));
    }
    let table_end = 16 + ENTRY * count as usize;
    let Some(header_sum) = word(table_end) else { return Err(cut) };
    if crc32fast::hash(&bytes[..table_end]) != header_sum {
        return Err(ModelError::Header("the checksum of the header does not match"));
    }
    let mut rest = &bytes[table_end + 4..];
    let mut sections = Vec::with_capacity(count as usize);
    for entry in bytes[16..table_end].chunks_exact(ENTRY) {
        let (tag, entry) = entry.split_first_chunk::<4>().expect("an entry has 16 bytes");
        let (sum, length) = entry.split_first_chunk::<4>().expect("an entry has 16 bytes");
        let length = u64::from_le_bytes(*length.first_chunk().expect("an entry has 16 bytes"));
        let Some((payload, after)) = usize::try_from(length).ok().and_then(|l| rest.split_at_checked(l))
        else {
            return Err(cut);
        };
        if crc32fast::hash(payload) != u32::from_le_bytes(*sum) {
            return Err(ModelError::Checksum(String::from_utf8_lossy(tag).into_owned()));
        }
        rest = after;
        sections.push((*tag, payload));
    }
    if !rest.is_empty() {
        return Err(ModelError::Header("there is something behind the last section"));
    }
    Ok(sections)
}

fn read_similarity(mut r: Reader<'_>) -> Result<Similarity, ModelError> {
    let scale = r.f64()?;
    let center = DVec3::new(r.f64()?, r.f64()?, r.f64()?);
    r.end()?;
    Similarity::new(scale, center).ok_or_else(|| r.defect("the scale or the centre is not usable"))
}

fn read_base(mut r: Reader<'_>) -> Result<ManifoldMesh, ModelError> {
    let (vertices, faces) = (r.u32()? as usize, r.u32()? as usize);
    let positions = r.f32s(vertices.saturating_mul(3))?;
    let positions =
        positions.as_chunks().0.iter().map(|&p: &[f32; 3]| glam::Vec3::from(p).as_dvec3()).collect();
    let count = faces.saturating_mul(3);
    let indices = if vertices <= 1 << 16 {
        r.u16s(count)?.into_iter().map(u32::from).collect()
    } else {
        r.u32s(count)?
    };
    r.end()?;
    let mesh =
        TriangleMesh::new(positions, indices.as_chunks().0.to_vec()).map_err(|e| r.defect(e.to_string()))?;
    ManifoldMesh::try_from(mesh).map_err(|e| r.defect(e.to_string()))
}

fn read_features(mut r: Reader<'_>, vertices: usize) -> Result<(usize, Vec<f32>), ModelError> {
    let dimension = r.u32()? as usize;
    if dimension > MOST_FEATURES {
        return Err(r.defect(format!("{dimension} features a vertex are more than {MOST_FEATURES}")));
    }
    let features = r.f32s(vertices * dimension)?;
    r.end()?;
    Ok((dimension, features))
}

fn read_network(mut r: Reader<'_>, features: usize) -> Result<(FieldShape, Vec<f32>), ModelError> {
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
    let parameters = r.f32s(shape.network().parameter_count())?;
    r.end()?;
    Ok((shape, parameters))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::shapes;
    use rand::RngExt;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::SeedableRng;

    fn model() -> Model {
        let base = ManifoldMesh::try_from(shapes::icosphere(0)).unwrap();
        let shape = FieldShape {
            features: 2,
            octaves: 1,
            hidden: vec![3],
            activation: Activation::Silu,
            residual: true,
        };
        let field = DisplacementField::untrained(base, shape, 5).unwrap();
        let similarity = Similarity::new(0.3, DVec3::new(1.0, 2.0, 3.0)).unwrap();
        Model { field, similarity, provenance: "{\"seed\": 5}".to_owned() }
    }

    #[test]
    fn round_trip_keeps_every_bit() {
        let model = model();
        let bytes = model.to_bytes();
        let again = Model::from_bytes(&bytes).unwrap();
        assert_eq!(again.to_bytes(), bytes);
        assert_eq!(again.similarity, model.similarity);
        assert_eq!(again.field.base().positions(), model.field.base().positions());
        assert_eq!(again.field.base().faces(), model.field.base().faces());
        assert_eq!(again.provenance, model.provenance);
        let sizes = model.section_sizes();
        assert_eq!(sizes.total, bytes.len());
        assert_eq!(sizes.base, 8 + 12 * 12 + 2 * 60);
    }

    #[test]
    fn every_truncation_and_every_flipped_byte_is_noticed() {
        let bytes = model().to_bytes();
        for length in 0..bytes.len() {
            assert!(Model::from_bytes(&bytes[..length]).is_err(), "{length} bytes");
        }
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            assert!(Model::from_bytes(&damaged).is_err(), "byte {at}");
        }
    }

    /// Damages a payload and mends the checksums, so that the section readers themselves are tried.
    #[test]
    fn hostile_payloads_give_errors_or_models_but_no_panic() {
        let good = model();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for round in 0..3000 {
            let mut sections = good.sections();
            let which = round % 4;
            let payload = &mut sections[which].1;
            for _ in 0..rng.random_range(1..4) {
                // The headers of the sections are the interesting part.
                let at = rng.random_range(0..payload.len().min(64));
                payload[at] = rng.random();
            }
            if rng.random_bool(0.2) {
                payload.truncate(rng.random_range(0..payload.len()));
            }
            let mut file = Writer(MAGIC.to_vec());
            file.u32(VERSION);
            file.u32(sections.len() as u32);
            for (tag, payload) in &sections {
                file.0.extend(tag.as_bytes());
                file.u32(crc32fast::hash(payload));
                file.0.extend((payload.len() as u64).to_le_bytes());
            }
            file.u32(crc32fast::hash(&file.0));
            sections.iter().for_each(|(_, payload)| file.0.extend(payload));
            let _ = Model::from_bytes(&file.0);
        }
    }

    #[test]
    fn unknown_sections_are_skipped_and_later_versions_named() {
        let bytes = model().to_bytes();
        let mut later = bytes.clone();
        later[8] = 9;
        assert!(matches!(Model::from_bytes(&later), Err(ModelError::Version(9))));
        assert!(matches!(Model::from_bytes(b"solid cube"), Err(ModelError::Magic)));

        let payload = b"something new";
        let table_end = 16 + 16 * 5;
        let mut more = Writer(MAGIC.to_vec());
        more.u32(VERSION);
        more.u32(6);
        more.0.extend(&bytes[16..table_end]);
        more.0.extend(b"NEWS");
        more.u32(crc32fast::hash(payload));
        more.0.extend((payload.len() as u64).to_le_bytes());
        more.u32(crc32fast::hash(&more.0));
        more.0.extend(&bytes[table_end + 4..]);
        more.0.extend(payload);
        assert!(Model::from_bytes(&more.0).is_ok());
    }
}

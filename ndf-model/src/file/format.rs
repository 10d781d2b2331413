//! The `.ndf` file: a table of sections with checksums. `docs/format.md` specifies it for other programs.
//!
//! Writing loses nothing: arrays whose numbers lie on coarse grids are coded, others are written as they are. To make a
//! model small is another matter ([`Precision`](super::Precision)).

use std::fs;
use std::path::Path;

use super::bytes::{Reader, Writer};
use super::numbers::Groups;
use super::{Model, base, container, network, numbers};
use crate::field::DisplacementField;
use crate::{Similarity, StoredScalars, scalars};
use ndf_core::DVec3;
use ndf_network::encoding::MOST_FEATURES;

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
    #[error("the model has format version {0}; this program reads up to version {newest}", newest = container::VERSION)]
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
        container::is_model(beginning)
    }

    /// The bytes of the file.
    pub fn to_bytes(&self) -> Vec<u8> {
        container::join(&self.sections())
    }

    /// The model in these bytes.
    ///
    /// # Errors
    /// If they are not a whole, undamaged model. Allocates no more than a small multiple of the input.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelError> {
        let (version, sections) = container::split(bytes)?;
        let section = |tag: &'static str| {
            let found = sections.iter().find(|(t, _)| t == tag.as_bytes());
            found.map(|(_, payload)| Reader::new(tag, payload)).ok_or(ModelError::Missing(tag))
        };
        let similarity = read_similarity(section("SIML")?)?;
        let base = base::read(section("BASE")?, version)?;
        let (dimension, features) = read_features(section("FEAT")?, base.vertex_count(), version)?;
        let (shape, parameters) = network::read(section("NETW")?, dimension, version)?;
        let field = DisplacementField::new(base, shape, features, parameters)
            .map_err(|e| ModelError::Section { section: "NETW", defect: e.to_string() })?;
        let provenance = sections.iter().find(|(tag, _)| tag == b"PROV");
        let provenance =
            provenance.map_or_else(String::new, |(_, p)| String::from_utf8_lossy(p).into_owned());
        let scalars = sections.iter().filter(|(tag, _)| tag == scalars::TAG.as_bytes());
        let scalars = scalars.map(|(_, p)| StoredScalars::from_payload(p, field.base().vertex_count()));
        let scalars = scalars.collect::<Result<_, _>>()?;
        Ok(Self { field, similarity, scalars, provenance })
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
        let sections = self.sections();
        let mut sizes = SectionSizes { total: container::size(&sections), ..SectionSizes::default() };
        for (tag, payload) in &sections {
            match *tag {
                "BASE" => sizes.base = payload.len(),
                "FEAT" => sizes.features = payload.len(),
                "NETW" => sizes.network = payload.len(),
                scalars::TAG => sizes.scalars += payload.len(),
                _ => {}
            }
        }
        sizes
    }

    pub(super) fn sections(&self) -> Vec<(&'static str, Vec<u8>)> {
        let shape = self.field.shape();
        let d = shape.features;
        let (base, order) = base::write(self.field.base());
        let of_vertex = |&v: &u32| &self.field.features()[v as usize * d..][..d];
        let features: Vec<f32> = order.iter().flat_map(of_vertex).copied().collect();
        let mut sections = vec![
            ("SIML", self.similarity_bytes()),
            ("BASE", base),
            ("FEAT", feature_bytes(d, &features)),
            ("NETW", network::write(shape, self.field.network())),
            ("PROV", self.provenance.as_bytes().to_vec()),
        ];
        sections
            .extend(self.scalars.iter().map(|fields| (scalars::TAG, fields.reordered(&order).to_payload())));
        sections
    }

    fn similarity_bytes(&self) -> Vec<u8> {
        let mut w = Writer::default();
        w.f64(self.similarity.scale());
        self.similarity.center().to_array().into_iter().for_each(|x| w.f64(x));
        w.0
    }
}

fn feature_bytes(dimension: usize, features: &[f32]) -> Vec<u8> {
    let mut w = Writer::default();
    w.u32(dimension as u32);
    numbers::write(&mut w, Groups::Interleaved(dimension), features);
    w.0
}

fn read_features(mut r: Reader<'_>, vertices: usize, version: u32) -> Result<(usize, Vec<f32>), ModelError> {
    let dimension = r.u32()? as usize;
    if dimension > MOST_FEATURES {
        return Err(r.defect(format!("{dimension} features a vertex are more than {MOST_FEATURES}")));
    }
    let features = match version {
        1 => r.f32s(vertices * dimension)?,
        _ => numbers::read(&mut r, Groups::Interleaved(dimension), vertices * dimension)?,
    };
    r.end()?;
    Ok((dimension, features))
}

fn read_similarity(mut r: Reader<'_>) -> Result<Similarity, ModelError> {
    let scale = r.f64()?;
    let center = DVec3::new(r.f64()?, r.f64()?, r.f64()?);
    r.end()?;
    Similarity::new(scale, center).ok_or_else(|| r.defect("the scale or the centre is not usable"))
}

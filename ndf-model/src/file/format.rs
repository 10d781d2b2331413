//! The `.ndf` file: a table of sections with checksums. `docs/format.md` specifies it for other programs.
//!
//! Writing loses nothing: arrays whose numbers lie on coarse grids are coded, others are written as they are. To make a
//! model small is another matter ([`Precision`](super::Precision)).

use std::fs;
use std::path::Path;

use super::base::ReadBase;
use super::bytes::{Reader, Writer};
use super::error::{ModelError, VERSION, WITHOUT_LEVELS};
use super::levels::LevelCoder;
use super::{base, container, levels, metric, network, scalar_levels, scalars};
use crate::displacement_field::{DisplacementField, FieldShape};
use crate::levels::Levels;
use crate::model::Model;
use crate::scalars::{Form, SurfaceScalars};
use crate::similarity::Similarity;
use ndf_core::DVec3;

/// Bytes of the parts of a model file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SectionSizes {
    /// Base mesh.
    pub base: usize,
    /// Features.
    pub features: usize,
    /// Network.
    pub network: usize,
    /// Levels.
    pub levels: usize,
    /// Metric of the true surface.
    pub metric: usize,
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
        let has_levels =
            self.field.levels().is_some() || self.scalars.iter().any(|fields| fields.levels().is_some());
        let is_new = has_levels || self.metric.is_some();
        let version = if is_new { VERSION } else { WITHOUT_LEVELS };
        container::join(version, &self.sections())
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
        let ReadBase { mesh: base, control } = base::read(section("BASE")?, version)?;
        let vertices = base.vertex_count();
        let field = match control {
            None => {
                let mut r = section("FEAT")?;
                let dimension = network::read_dimension(&mut r)?;
                let features = network::read_features(&mut r, dimension, vertices, version)?;
                r.end()?;
                let mut r = section("NETW")?;
                let (network, residual) = network::read_shape(&mut r, dimension)?;
                let shape = FieldShape { network, residual: residual != 0 };
                let parameters = network::read_parameters(&mut r, &shape.mlp(), version)?;
                r.end()?;
                DisplacementField::new(base, shape, features, parameters)
                    .map_err(|e| ModelError::Section { section: "NETW", defect: e.into() })?
            }
            Some((spacing, control)) => {
                let (creases, levels) = levels::read(section(levels::TAG)?, &base)?;
                DisplacementField::levelled(&base, Levels { spacing, control, creases, levels })
                    .map_err(|e| ModelError::Section { section: levels::TAG, defect: e.into() })?
            }
        };
        let metric = sections.iter().find(|(tag, _)| tag == metric::TAG.as_bytes());
        let metric = metric.map(|(_, p)| metric::read(Reader::new(metric::TAG, p))).transpose()?;
        let provenance = sections.iter().find(|(tag, _)| tag == b"PROV");
        let provenance =
            provenance.map_or_else(String::new, |(_, p)| String::from_utf8_lossy(p).into_owned());
        let mut nodes = scalar_levels::Nodes::of(&field);
        let scalars = sections.iter().filter_map(|(tag, p)| match tag {
            _ if tag == scalars::TAG.as_bytes() => {
                Some(scalars::read(Reader::new(scalars::TAG, p), vertices))
            }
            _ if tag == scalar_levels::TAG.as_bytes() && version >= VERSION => {
                Some(scalar_levels::read(Reader::new(scalar_levels::TAG, p), &mut nodes))
            }
            _ => None,
        });
        let scalars = scalars.collect::<Result<_, _>>()?;
        Ok(Self { field, similarity, metric, scalars, provenance })
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
                levels::TAG => sizes.levels = payload.len(),
                metric::TAG => sizes.metric = payload.len(),
                scalars::TAG | scalar_levels::TAG => sizes.scalars += payload.len(),
                _ => {}
            }
        }
        sizes
    }

    pub(super) fn sections(&self) -> Vec<(&'static str, Vec<u8>)> {
        let mut sections = vec![("SIML", self.similarity_bytes())];
        let order = match self.field.levels() {
            None => {
                let (base, order) = base::write(self.field.base());
                sections.push(("BASE", base));
                order
            }
            Some(stored) => {
                let coder = LevelCoder::new(self.field.base(), stored.levels.len());
                let [base, levels] = coder.write(stored);
                sections.extend([("BASE", base), (levels::TAG, levels)]);
                coder.order().to_vec()
            }
        };
        if let Some((network, shape)) = self.field.network().zip(self.field.shape()) {
            let network = network.reordered(&order);
            let mut features = Writer::default();
            network::write_dimension(&mut features, &network);
            network::write_features(&mut features, &network);
            let mut perceptron = Writer::default();
            network::write_shape(&mut perceptron, &network, u8::from(shape.residual));
            network::write_parameters(&mut perceptron, &network);
            sections.extend([("FEAT", features.0), ("NETW", perceptron.0)]);
        }
        sections.extend(self.metric.map(|metric| (metric::TAG, metric::write(metric))));
        sections.push(("PROV", self.provenance.as_bytes().to_vec()));
        sections.extend(self.scalars.iter().map(|fields| section(&fields.reordered(&order))));
        sections
    }

    fn similarity_bytes(&self) -> Vec<u8> {
        let mut w = Writer::default();
        w.f64(self.similarity.scale());
        self.similarity.center().to_array().into_iter().for_each(|x| w.f64(x));
        w.0
    }
}

/// The section of scalars whose base vertices are in the order of the file.
fn section(fields: &SurfaceScalars) -> (&'static str, Vec<u8>) {
    match fields.form() {
        Form::Network(network) => (scalars::TAG, scalars::write(fields.channels(), network)),
        Form::Levels(levels) => (scalar_levels::TAG, scalar_levels::write(fields.channels(), levels)),
    }
}

impl SurfaceScalars {
    /// Bytes that these fields take in a model file.
    pub fn stored_bytes(&self) -> usize {
        section(self).1.len()
    }
}

fn read_similarity(mut r: Reader<'_>) -> Result<Similarity, ModelError> {
    let scale = r.f64()?;
    let center = DVec3::new(r.f64()?, r.f64()?, r.f64()?);
    r.end()?;
    Similarity::new(scale, center).map_err(|e| r.defect(e))
}

//! Cached copies of fields that are costly to evaluate.

use ndf_core::{ImplicitField, Progress, Query};
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::{FacePoint, ManifoldMesh, TriangleMesh};
use ndf_surfaces::narrow_band::{Agreement, BandError, BandReport, agreement};
use ndf_surfaces::{BandOptions, LevelSetSurface, NarrowBand};

use crate::Opened;

/// Points of the base mesh at which cached and true projections are compared.
const COMPARED: usize = 4096;

/// A surface that is projected onto instead of the true one while training.
pub struct Band<'a> {
    /// The level set of the cached field.
    pub surface: LevelSetSurface<NarrowBand<&'a dyn ImplicitField>>,
    /// Its figures.
    pub figures: BandFigures,
}

/// Size and accuracy of a cached field. Lengths are in the surface's units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BandFigures {
    /// What it consists of.
    pub report: BandReport,
    /// How far the feet of points of the base mesh on the cached and on the true surface are apart.
    pub agreement: Agreement,
    /// Diagonal of the base mesh.
    pub diagonal: f64,
}

impl Opened {
    /// A cached copy of the surface's field around a base mesh, where projecting onto the field itself is costly.
    ///
    /// # Errors
    /// If the base mesh is not where the field is, or the observer asks to stop.
    pub fn band(&self, base: &ManifoldMesh, progress: &dyn Progress) -> Result<Option<Band<'_>>, BandError> {
        let (Some(search), Some(field)) = (self.cached, self.surface.as_field()) else { return Ok(None) };
        let mesh: &TriangleMesh = base;
        let band = NarrowBand::around(field, mesh, &BandOptions::for_mesh(mesh), progress)?;
        let report = *band.report();
        let surface = LevelSetSurface::new(band).with_search(search);
        let samples = AreaSampler::new(base).map_or(Vec::new(), |s| s.sample(COMPARED, 0, 0));
        let query = |s: &FacePoint| {
            let normal = mesh.face_normal(s.face).try_normalize();
            Query { normal, ..Query::at(s.position(mesh)) }
        };
        let queries: Vec<Query> = samples.iter().map(query).collect();
        let agreement = agreement(&surface, &*self.surface, &queries);
        let figures = BandFigures { report, agreement, diagonal: mesh.bounds().diagonal() };
        Ok(Some(Band { surface, figures }))
    }
}

//! Cached copies of fields that are costly to evaluate.

use ndf_core::{ImplicitField, Progress, Query};
use ndf_mesh::ManifoldMesh;
use ndf_mesh::sampling::AreaSampler;
use ndf_model::Similarity;
use ndf_surfaces::narrow_band::{Agreement, BandReport, agreement};
use ndf_surfaces::{BandOptions, LevelSetSurface, NarrowBand};
use serde_json::{Value, json};

use super::Input;
use crate::output::{Failure, grouped};

/// Points of the base mesh at which cached and true projections are compared.
const COMPARED: usize = 4096;

/// A surface that is projected onto instead of an input while training.
pub struct Band<'a> {
    /// The level set of the cached field.
    pub surface: LevelSetSurface<NarrowBand<&'a dyn ImplicitField>>,
    /// Its figures.
    pub figures: BandFigures,
}

/// Size and accuracy of a cached field.
#[derive(Clone, Copy, Debug)]
pub struct BandFigures {
    report: BandReport,
    /// Between the feet of points of the base mesh on the cached and on the true surface, in the input's units.
    agreement: Agreement,
    /// Diagonal of the base mesh.
    diagonal: f64,
}

impl Input {
    /// A cached copy of the input's field around a base mesh, where projecting onto the field itself is costly.
    ///
    /// # Errors
    /// If the base mesh is not where the field is, or the user interrupts.
    pub fn band(
        &self,
        name: &str,
        base: &ManifoldMesh,
        progress: &dyn Progress,
    ) -> Result<Option<Band<'_>>, Failure> {
        let (Some(search), Some(field)) = (self.cached, self.surface.as_field()) else { return Ok(None) };
        let mesh = &base;
        let options = BandOptions::for_mesh(mesh);
        let band = NarrowBand::around(field, mesh, &options, progress).map_err(|e| {
            Failure::new(format!("{name}: the field around the base mesh cannot be sampled: {e}"))
        })?;
        let report = *band.report();
        let surface = LevelSetSurface::new(band).with_search(search);
        let samples = AreaSampler::new(base).map_or(Vec::new(), |s| s.sample(COMPARED, 0, 0));
        let query = |s: &ndf_mesh::FacePoint| {
            let normal = mesh.face_normal(s.face).try_normalize();
            Query { normal, ..Query::at(s.position(mesh)) }
        };
        let queries: Vec<Query> = samples.iter().map(query).collect();
        let agreement = agreement(&surface, &*self.surface, &queries);
        let figures = BandFigures { report, agreement, diagonal: mesh.bounds().diagonal() };
        Ok(Some(Band { surface, figures }))
    }
}

impl BandFigures {
    /// For `fit --json`, lengths in the normalised box.
    pub fn json(&self, similarity: &Similarity) -> Value {
        let Self { report, agreement, .. } = self;
        let normalised = |length: f64| similarity.length_to_normalised(length);
        json!({
            "seconds": report.seconds,
            "cubes": report.cubes,
            "finest": normalised(report.finest),
            "values": report.values,
            "gradients": report.gradients,
            "unresolved": report.unresolved,
            "projection_error_median": normalised(agreement.median),
            "projection_error_rms": normalised(agreement.rms),
            "projection_error_max": normalised(agreement.max),
            "feet_on_one_only": agreement.disagreeing,
        })
    }

    /// In words.
    pub fn sentence(&self) -> String {
        let Self { report, agreement, diagonal } = self;
        let relative = |length: f64| format!("{:.1e}", length / diagonal);
        format!(
            "{} cubes in {:.1} s; feet off by {} of the diagonal in the median, {} rms, {} at most",
            grouped(report.cubes),
            report.seconds,
            relative(agreement.median),
            relative(agreement.rms),
            relative(agreement.max)
        )
    }
}

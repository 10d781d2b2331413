//! Figures of results, serialised with the keys of the program's JSON.

use std::time::Instant;

use ndf_core::{Cancelled, DVec3, Progress};
use ndf_intrinsic::ExtractionReport;
use ndf_mesh::metrics::{Distances, MeasureError, MeasureOptions, measure_with};
use ndf_mesh::quality::{Quality, SmallestAngles, Spread};
use ndf_mesh::repair::finite_part;
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::{ManifoldMesh, SelfIntersections, TriangleMesh, ValidationReport};
use ndf_train::MetricReport;
use serde::Serialize;

use crate::band::BandFigures;
use crate::describe::{ModelBytes, in_words};
use crate::deviations::{deviations, deviations_from_points};
use crate::{Fitted, Kind, LevelRule};

/// Figures of [`Fitted`], as `ndf fit --json` has them.
///
/// Lengths of these keys are in the box [-1.5, 1.5]³ that the base mesh fills: `projection_mean`, `projection_rms`, `projection_max`, all
/// of `cache`, and `cycle_loss`, a mean of squared lengths. [`Model::similarity`](ndf_model::Model::similarity) leads to the
/// input's units.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct FitFigures {
    /// What represents the surface.
    pub kind: Kind,
    /// How the base mesh was made; `None` where it was brought.
    pub base: Option<BaseFigures>,
    /// The level of the field, where that was to be chosen.
    pub level: Option<f64>,
    /// How it was chosen, in words.
    #[serde(serialize_with = "words")]
    pub level_rule: Option<LevelRule>,
    /// The cached copy of the field, where there was one.
    pub cache: Option<CacheFigures>,
    /// Wall seconds of training.
    pub seconds: f64,
    /// Of these, spent on projecting.
    pub seconds_projecting: f64,
    /// Epochs made, or iterations where the field has levels.
    pub epochs: usize,
    /// Whether training ended before its last epoch.
    pub interrupted: bool,
    /// Mean distance to the surface.
    pub projection_mean: f64,
    /// Root of the mean squared distance to the surface.
    pub projection_rms: f64,
    /// Largest distance to the surface.
    pub projection_max: f64,
    /// The mean distance in the input's units.
    pub distance_mean: f64,
    /// The root of the mean squared distance in the input's units.
    pub distance_rms: f64,
    /// The largest distance in the input's units.
    pub distance_max: f64,
    /// Cycle loss of the last epoch.
    pub cycle_loss: Option<f64>,
    /// Share of the learned surface that is turned against the input.
    pub flipped_fraction: f64,
    /// Share of the learned surface that could not be projected.
    pub missed_fraction: f64,
    /// How the metric was measured, where the model has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metric: Option<MetricReport>,
    /// Vertices of the base mesh.
    pub base_vertices: usize,
    /// Faces of the base mesh.
    pub base_faces: usize,
    /// Connected components of the base mesh.
    pub components: usize,
    /// The share of the area of an isosurface that the base mesh leaves out; `None` where the base mesh was brought.
    pub area_left_out: Option<f64>,
    /// Bytes of the model file.
    pub model_bytes: usize,
    /// Bytes of its parts.
    pub bytes: ModelBytes,
}

/// How a base mesh was made.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct BaseFigures {
    /// `isosurface` or `mesh`.
    pub from: &'static str,
    /// Cells of the grid along each axis.
    pub grid: Option<[u32; 3]>,
    /// Evaluations of the field.
    pub evaluations: u64,
    /// Components that were left out.
    pub components_dropped: usize,
    /// Their share of the area.
    pub area_dropped: f64,
    /// V − E + F.
    pub euler_characteristic: i64,
    /// Edges with one face.
    pub boundary_edges: usize,
    /// Wall seconds.
    pub seconds: f64,
}

/// Size and accuracy of a cached field, lengths in the box.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct CacheFigures {
    /// Wall seconds of the sampling.
    pub seconds: f64,
    /// Cubes that answer.
    pub cubes: usize,
    /// Side of the smallest.
    pub finest: f64,
    /// Values asked of the field.
    pub values: usize,
    /// Gradients asked of the field.
    pub gradients: usize,
    /// Share of the cubes that exceed the tolerance.
    pub unresolved: f64,
    /// Median distance between cached and true feet.
    pub projection_error_median: f64,
    /// Root of the mean of its square.
    pub projection_error_rms: f64,
    /// The largest.
    pub projection_error_max: f64,
    /// Points with a foot on one of the two only.
    pub feet_on_one_only: usize,
}

fn words<S: serde::Serializer>(rule: &Option<LevelRule>, serializer: S) -> Result<S::Ok, S::Error> {
    match rule {
        Some(rule) => in_words(rule, serializer),
        None => serializer.serialize_none(),
    }
}

impl Fitted {
    /// The figures of the run. Encodes the model to tell its size.
    pub fn figures(&self) -> FitFigures {
        let report = &self.report;
        let base = self.base_report.as_ref().map(|report| BaseFigures {
            from: if report.grid.is_some() { "isosurface" } else { "mesh" },
            grid: report.grid,
            evaluations: report.evaluations,
            components_dropped: report.components_dropped,
            area_dropped: report.area_dropped,
            euler_characteristic: report.euler_characteristic,
            boundary_edges: report.boundary_edges,
            seconds: report.seconds.isosurface + report.seconds.decimation + report.seconds.final_pass,
        });
        let bytes = ModelBytes::of(&self.model);
        FitFigures {
            kind: self.kind,
            base,
            level: self.level.map(|level| level.value),
            level_rule: self.level.map(|level| level.rule),
            cache: self.band.as_ref().map(|band| self.cache(band)),
            seconds: report.seconds,
            seconds_projecting: report.seconds_projecting,
            epochs: report.epochs,
            interrupted: report.interrupted,
            projection_mean: report.projection_mean,
            projection_rms: report.projection_rms,
            projection_max: report.projection_max,
            distance_mean: self.distance_mean(),
            distance_rms: self.distance_rms(),
            distance_max: self.distance_max(),
            cycle_loss: report.cycle_loss,
            flipped_fraction: report.flipped_fraction,
            missed_fraction: report.missed_fraction,
            metric: self.metric_report,
            base_vertices: self.base.vertex_count(),
            base_faces: self.base.face_count(),
            components: ValidationReport::of(&self.base).components,
            area_left_out: self.base_report.as_ref().map(|report| report.area_dropped),
            model_bytes: bytes.total,
            bytes,
        }
    }

    fn cache(&self, BandFigures { report, agreement, .. }: &BandFigures) -> CacheFigures {
        let relative = |length: f64| self.model.similarity.length_to_normalised(length);
        CacheFigures {
            seconds: report.seconds,
            cubes: report.cubes,
            finest: relative(report.finest),
            values: report.values,
            gradients: report.gradients,
            unresolved: report.unresolved,
            projection_error_median: relative(agreement.median),
            projection_error_rms: relative(agreement.rms),
            projection_error_max: relative(agreement.max),
            feet_on_one_only: agreement.disagreeing,
        }
    }
}

/// Figures of an extracted mesh, as `ndf extract --json` has them: lengths in its units, angles in degrees.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct ExtractionFigures {
    /// Vertices.
    pub vertices: usize,
    /// Faces.
    pub faces: usize,
    /// Pieces.
    pub components: usize,
    /// V − E + F.
    pub euler_characteristic: i64,
    /// Edges with one face.
    pub boundary_edges: usize,
    /// Whether the faces around every edge and vertex form a surface.
    pub manifold: bool,
    /// Whether neighbouring faces are oriented alike.
    pub oriented: bool,
    /// Pairs of faces in which the mesh passes through itself; counting ends at [`SelfIntersections::ENOUGH`].
    pub self_intersections: u64,
    /// Whether all inner edges are Delaunay in the intrinsic metric.
    pub delaunay_intrinsic: bool,
    /// Share of the inner edges that are Delaunay as embedded.
    pub delaunay_embedded_fraction: f64,
    /// Lengths of the edges.
    pub edge_length: Spread,
    /// Smallest angles of the faces, in degrees.
    pub min_angle_deg: SmallestAngles,
}

impl ExtractionFigures {
    /// Examines a mesh of a model. Without the report of an extraction its own metric is the intrinsic one. O(n log n).
    ///
    /// # Errors
    /// [`Cancelled`], if the observer asks to stop.
    pub fn of(
        mesh: &ManifoldMesh,
        extraction: Option<&ExtractionReport>,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        progress.check()?;
        let report = ValidationReport::of(mesh);
        progress.check()?;
        let quality = Quality::of(mesh);
        Ok(Self {
            vertices: report.vertices,
            faces: report.faces,
            components: report.components,
            euler_characteristic: report.euler_characteristic,
            boundary_edges: report.boundary_edges,
            manifold: report.is_manifold(),
            oriented: report.inconsistent_edges.count == 0,
            self_intersections: SelfIntersections::of(mesh, progress)?.pairs,
            delaunay_intrinsic: extraction.map_or(quality.is_delaunay(), |e| e.delaunay_intrinsic),
            delaunay_embedded_fraction: quality.delaunay_fraction,
            edge_length: quality.edge_length,
            min_angle_deg: quality.min_angle.to_degrees(),
        })
    }
}

/// How far a mesh is from a reference, as `ndf measure --json` has it: lengths in their units.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct MeasureFigures {
    /// From samples of the reference to the mesh: large where the mesh lacks something.
    pub reference_to_mesh: Distances,
    /// From samples of the mesh to the reference: large where the mesh has something of its own.
    pub mesh_to_reference: Distances,
    /// The larger of both maxima.
    pub hausdorff: f64,
    /// Mean angle between the normals at samples and at the points closest to them, in degrees. `None` of points.
    pub normal_deg_mean: Option<f64>,
    /// Share of the samples of the mesh whose face normal opposes that of the reference. `None` of points.
    pub flipped_fraction: Option<f64>,
    /// Diagonal of the bounds of the reference.
    pub diagonal: f64,
    /// `input`: lengths are in the units of the meshes.
    pub unit: &'static str,
    /// What could not be measured.
    pub area_left_out: LeftOutFigures,
    /// Samples on each mesh.
    pub samples: usize,
    /// Wall seconds.
    pub seconds: f64,
}

/// Shares of faces with corners that are not finite, from 0 to 1.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct LeftOutFigures {
    /// Of the reference.
    pub reference: f64,
    /// Of the mesh.
    pub mesh: f64,
}

impl MeasureFigures {
    /// Measures what is finite of two meshes. O(s log n) for s samples.
    ///
    /// # Errors
    /// If one has no area, there are no samples, or the observer asks to stop.
    pub fn of(
        reference: &TriangleMesh,
        mesh: &TriangleMesh,
        options: &MeasureOptions,
        progress: &dyn Progress,
    ) -> Result<Self, MeasureError> {
        let (reference, reference_left_out) = finite_part(reference);
        let (mesh, mesh_left_out) = finite_part(mesh);
        let started = Instant::now();
        let found = measure_with(&reference, &mesh, options, progress)?;
        Ok(Self {
            reference_to_mesh: found.reference_to_mesh,
            mesh_to_reference: found.mesh_to_reference,
            hausdorff: found.hausdorff,
            normal_deg_mean: Some(found.normal_angle_mean.to_degrees()),
            flipped_fraction: Some(found.flipped_fraction),
            diagonal: found.diagonal,
            unit: "input",
            area_left_out: LeftOutFigures { reference: reference_left_out, mesh: mesh_left_out },
            samples: options.samples,
            seconds: started.elapsed().as_secs_f64(),
        })
    }

    /// Measures points, all of them, in place of a mesh: how far each is from the reference, and how far samples of the reference are
    /// from the nearest point. O((n + s) log n) for n points and s samples.
    ///
    /// # Errors
    /// If the reference has no area, there are no samples or no points, or the observer asks to stop.
    pub fn of_points(
        reference: &TriangleMesh,
        points: &[DVec3],
        options: &MeasureOptions,
        progress: &dyn Progress,
    ) -> Result<Self, MeasureError> {
        if options.samples == 0 {
            return Err(MeasureError::NoSamples);
        }
        if points.is_empty() {
            return Err(MeasureError::Mesh);
        }
        let started = Instant::now();
        let (reference, left_out) = finite_part(reference);
        let sampler = AreaSampler::new(&reference).ok_or(MeasureError::Reference)?;
        progress.report("measuring", 0.0);
        let mesh_to_reference = distances(deviations(&reference, points, progress)?);
        progress.report("measuring", 0.5);
        let samples = sampler.sample(options.samples, options.seed, 0);
        let samples: Vec<DVec3> = samples.iter().map(|sample| sample.position(&reference)).collect();
        let reference_to_mesh = distances(deviations_from_points(points, &samples, progress)?);
        progress.report("measuring", 1.0);
        Ok(Self {
            reference_to_mesh,
            mesh_to_reference,
            hausdorff: reference_to_mesh.max.max(mesh_to_reference.max),
            normal_deg_mean: None,
            flipped_fraction: None,
            diagonal: reference.bounds().diagonal(),
            unit: "input",
            area_left_out: LeftOutFigures { reference: left_out, mesh: 0.0 },
            samples: options.samples,
            seconds: started.elapsed().as_secs_f64(),
        })
    }
}

/// Mean, root of the mean square, and largest of distances; those that are not finite are passed over.
fn distances(all: Vec<f64>) -> Distances {
    let (mut count, mut sum, mut squares, mut max) = (0_usize, 0.0, 0.0, 0.0_f64);
    for distance in all.into_iter().filter(|distance| distance.is_finite()) {
        count += 1;
        sum += distance;
        squares += distance * distance;
        max = max.max(distance);
    }
    let count = count.max(1) as f64;
    Distances { mean: sum / count, rms: (squares / count).sqrt(), max }
}

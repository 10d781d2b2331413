//! Methods that extract meshes from fields (supplement, §2.2 and Fig. 8), on networks of distances and on winding numbers of
//! clouds (§2.2.1), beside meshes of models.

use ndf::{EdgeLength, Triangulated};
use ndf_baselines::{NdcOptions, NeuralDualContouring, OdcOptions, occupancy_dual_contouring};
use ndf_core::{BoundingBox, NoProgress};
use ndf_formats::tensors::TensorFile;
use ndf_intrinsic::{IntrinsicTriangulation, RefinementOptions};
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_meshing::{IsotropicOptions, MarchingCubesOptions, marching_cubes, remesh_isotropically};
use ndf_model::LengthFactors;

use super::fits::{Learned, model, read};
use super::measuring::{Made, Timed, measured, repeated};
use super::row::Run;
use super::shapes::Role;
use super::truth::{Parts, Subject, largest_component};
use super::{Runs, Setup};
use crate::performance::process::timed;

pub(super) const MC: &str = "MC";
pub(super) const REFINED: &str = "MC + iDR";
pub(super) const REMESHED: &str = "MC + isotropic";
pub(super) const ODC: &str = "ODC";
pub(super) const NDC: &str = "NDCx, trained here";

/// Rounds of isotropic remeshing.
const ROUNDS: u32 = 10;

/// All runs of a shape: models of one size, rivals, then all other models.
pub(super) fn run(subject: &Subject<'_>, setup: &Setup, runs: &mut Runs) -> Result<(), String> {
    ours(subject, setup, &first_models(setup), runs)?;
    rivals(subject, setup, runs)?;
    ours(subject, setup, &other_models(subject, setup), runs)
}

/// The models that are made first.
pub(super) fn first_models(setup: &Setup) -> Vec<Learned> {
    setup.scale.sizes.iter().take(1).map(|&bytes| Learned::Levels(bytes)).collect()
}

/// All others. In the quick subset, fields have the preset of the paper alone.
pub(super) fn other_models(subject: &Subject<'_>, setup: &Setup) -> Vec<Learned> {
    if setup.scale.is_quick && subject.shape.role != Role::Mesh {
        return vec![Learned::Paper];
    }
    let sizes = setup.scale.sizes.iter().skip(1).map(|&bytes| Learned::Levels(bytes));
    sizes.chain([Learned::Network, Learned::Paper]).collect()
}

fn rivals(subject: &Subject<'_>, setup: &Setup, runs: &mut Runs) -> Result<(), String> {
    let network = setup.ndc_weights.as_deref().map(|file| {
        let say = |e: &dyn std::fmt::Display| format!("{}: {e}", file.display());
        let bytes = std::fs::read(file).map_err(|e| say(&e))?;
        let tensors = TensorFile::parse(&bytes).map_err(|e| say(&e))?;
        NeuralDualContouring::from_tensors(&tensors).map_err(|e| say(&e))
    });
    let network = network.transpose()?;
    for &h in setup.scale.cells {
        let setting = format!("h = {h}");
        let is_wanted = |method: &str| runs.wants(subject.shape, method, &setting);
        if [MC, REFINED, REMESHED].into_iter().any(is_wanted) {
            for run in cubes(subject, setup, h, &setting)? {
                runs.put(run)?;
            }
        }
        let seen = Seen { subject, setup, h, setting: &setting };
        if runs.wants(subject.shape, ODC, &setting) {
            runs.put(seen.odc()?)?;
        }
        if runs.wants(subject.shape, NDC, &setting) {
            runs.put(seen.ndc(network.as_ref())?)?;
        }
    }
    Ok(())
}

/// A shape on a grid.
struct Seen<'a> {
    subject: &'a Subject<'a>,
    setup: &'a Setup,
    h: f64,
    setting: &'a str,
}

impl Seen<'_> {
    fn odc(&self) -> Result<Run, String> {
        let parts = self.subject.parts()?;
        let field = Timed::new(parts.field()?);
        let (grid, bounds) = grid(parts, self.h);
        let options = OdcOptions { grid, bounds: Some(bounds) };
        let (seconds, found) = timed(|| occupancy_dual_contouring(&field, &options, &NoProgress));
        let found = found.map(|found| found.mesh.into_triangle_mesh()).map_err(|e| e.to_string());
        self.of_field(ODC, &field, seconds, found)
    }

    fn ndc(&self, network: Option<&NeuralDualContouring>) -> Result<Run, String> {
        let parts = self.subject.parts()?;
        let field = Timed::new(parts.field()?);
        let (grid, bounds) = grid(parts, self.h);
        let options = NdcOptions { grid, bounds: Some(bounds) };
        let (seconds, found) = timed(|| match (network, self.subject.shape.role) {
            (_, Role::Cloud) => Err("it needs signed distances, and a winding number is none".to_owned()),
            (None, _) => Err("no weights were given (--ndc-weights)".to_owned()),
            (Some(network), _) => {
                network.contour(&field, &options, &NoProgress).map(|f| f.mesh).map_err(|e| e.to_string())
            }
        });
        self.of_field(NDC, &field, seconds, found)
    }

    /// A run of a method that makes a mesh of the field in so many seconds.
    fn of_field(
        &self,
        method: &str,
        field: &Timed<'_>,
        seconds: f64,
        mesh: Result<TriangleMesh, String>,
    ) -> Result<Run, String> {
        let mesh = mesh.and_then(|mesh| largest_component(&mesh));
        let made =
            mesh.as_ref().map(|mesh| of_field(self.subject, field, seconds, mesh)).map_err(String::clone);
        measured(self.subject, self.setup.scale.repeats, (method, self.setting), made)
    }
}

/// Marching cubes, and what is put after them: one isosurface serves all three.
fn cubes(subject: &Subject<'_>, setup: &Setup, h: f64, setting: &str) -> Result<Vec<Run>, String> {
    let repeats = setup.scale.repeats;
    let parts = subject.parts()?;
    let field = Timed::new(parts.field()?);
    let (grid, bounds) = grid(parts, h);
    let options = MarchingCubesOptions { grid, bounds: Some(bounds), ..MarchingCubesOptions::default() };
    let (seconds, found) = timed(|| marching_cubes(&field, &options, &NoProgress));
    let mesh = match found.map_err(|e| e.to_string()).and_then(|found| largest_component(&found.mesh)) {
        Ok(mesh) => mesh,
        Err(reason) => {
            let left_out = |method| measured(subject, repeats, (method, setting), Err(reason.clone()));
            return [MC, REFINED, REMESHED].into_iter().map(left_out).collect();
        }
    };
    let plain = of_field(subject, &field, seconds, &mesh);
    let mut runs = vec![measured(subject, repeats, (MC, setting), Ok(plain))?];

    let (refining, refined) = timed(|| {
        let mut triangulation = IntrinsicTriangulation::new(&mesh);
        triangulation.refine_delaunay(&RefinementOptions::default());
        triangulation.into_mesh()
    });
    // Exact distances do not depend on the triangulation: they are solved on the triangles of marching cubes.
    let made = Made { operators_on: Some(&refined), ..of_field(subject, &field, seconds + refining, &mesh) };
    runs.push(measured(subject, repeats, (REFINED, setting), Ok(made))?);

    let options = IsotropicOptions { rounds: ROUNDS, ..IsotropicOptions::with_edges_of(h * parts.unit()) };
    let (remeshing, remeshed) = timed(|| remesh_isotropically(&mesh, None, &options, &NoProgress));
    let remeshed = remeshed.map_err(|e| e.to_string());
    let made = remeshed
        .as_ref()
        .map(|mesh| of_field(subject, &field, seconds + remeshing, mesh))
        .map_err(String::clone);
    runs.push(measured(subject, repeats, (REMESHED, setting), made)?);
    Ok(runs)
}

/// Cells along the longest side of the bounds so that a cell is h in the box, and these bounds.
fn grid(parts: &Parts, h: f64) -> (u32, BoundingBox) {
    let bounds = parts.bounds();
    let cells = bounds.extent().max_element() / (h * parts.unit());
    (cells.round().max(1.0) as u32, bounds)
}

/// A mesh that was made of the field, which is what is sent.
fn of_field<'a>(subject: &Subject<'_>, field: &Timed<'_>, seconds: f64, mesh: &'a ManifoldMesh) -> Made<'a> {
    let queries = field.seconds(seconds);
    Made {
        mesh,
        operators_on: None,
        factors: LengthFactors::ONE,
        bytes: subject.shape.bytes(),
        evaluations: Some(field.queries()),
        seconds_making: None,
        seconds_queries: Some(queries),
        seconds_extraction: seconds - queries,
    }
}

/// Models, each extracted at all edge lengths.
pub(super) fn ours(
    subject: &Subject<'_>,
    setup: &Setup,
    models: &[Learned],
    runs: &mut Runs,
) -> Result<(), String> {
    for &learned in models {
        let name = learned.name(setup.scale.paper_epochs);
        for &h in setup.scale.edge_lengths {
            let setting = format!("h = {h}");
            if !runs.wants(subject.shape, &name, &setting) {
                continue;
            }
            let of_model = model(subject.shape, learned, setup).and_then(|(bytes, making)| {
                let (seconds, surface) = repeated(setup.scale.repeats, || {
                    Triangulated::from_model(&read(&bytes)?, EdgeLength::Relative(h), &NoProgress)
                        .map_err(|e| e.to_string())
                });
                Ok((bytes.len(), making, seconds, surface?))
            });
            let made =
                of_model.as_ref().map_err(String::clone).and_then(|(bytes, making, seconds, surface)| {
                    let factors = surface.factors.unwrap_or(LengthFactors::ONE);
                    let mesh = surface.manifold().map_err(ToString::to_string)?;
                    Ok(Made { factors, ..Made::of_file(mesh, *bytes, *making, *seconds) })
                });
            let run = measured(subject, setup.scale.repeats, (&name, &setting), made)?;
            runs.put(Run { seed: Some(0), ..run })?;
        }
    }
    Ok(())
}

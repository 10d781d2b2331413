//! Heat that flows over triangulated surfaces, told at the vertices of the file.

use std::sync::OnceLock;

use ndf_core::Progress;
use ndf_fields::FieldError;
use ndf_intrinsic::IntrinsicMesh;
use ndf_spectral::{HeatFlow, LaplaceBeltrami, OperatorOptions};

use super::fields::of_file;
use super::solver::working;
use super::{Place, SurfaceFieldError, Triangulated};
use crate::Note;

/// Where heat begins.
#[derive(Clone, Debug, PartialEq)]
pub enum InitialHeat {
    /// One unit of heat at each of these places.
    Sources(Vec<Place>),
    /// A temperature at every vertex of the [mesh](Triangulated::mesh).
    Values(Vec<f64>),
}

/// How heat flows on a surface.
#[derive(Clone, Debug, PartialEq)]
pub struct HeatOptions {
    /// How long, in squared units of length.
    pub time: f64,
    /// At how many times up to that, equally far from each other, temperatures are told.
    pub frames: usize,
    /// Whether the boundary keeps its initial temperatures (Dirichlet), or lets no heat through (Neumann).
    pub is_boundary_held: bool,
}

/// Temperatures over a surface.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Heat {
    /// The times.
    pub times: Vec<f64>,
    /// For every time a temperature at every vertex of the [mesh](Triangulated::mesh); NaN at those that no face uses.
    pub frames: Vec<Vec<f64>>,
    /// The integral of the temperature at the beginning and at every time.
    pub totals: Vec<f64>,
    /// What is doubtful: places far from the surface.
    pub notes: Vec<Note>,
}

impl Triangulated {
    /// Lets heat flow over the surface: `∂u/∂t = Δu`. See [`HeatFlow`].
    ///
    /// # Errors
    /// If the surface is no oriented manifold, a place is not on it, there is not one temperature for every vertex, one is not finite, the
    /// time is not positive, the surface is too distorted for double precision, or the observer asks to stop.
    pub fn heat(
        &self,
        initial: &InitialHeat,
        options: &HeatOptions,
        progress: &dyn Progress,
    ) -> Result<Heat, SurfaceFieldError> {
        let manifold = self.manifold().map_err(|reason| SurfaceFieldError::NotManifold(reason.clone()))?;
        let mesh = IntrinsicMesh::from_mesh(manifold).scaled(self.applied().operators);
        let operator = LaplaceBeltrami::new(&mesh, OperatorOptions::default())?;
        let mut notes = Vec::new();
        let vertices = manifold.vertex_count();
        let start = match initial {
            InitialHeat::Values(values) => {
                let expected = self.mesh().vertex_count();
                if values.len() != expected {
                    return Err(FieldError::Count { found: values.len(), expected }.into());
                }
                of_file(self, values)
            }
            InitialHeat::Sources(places) => {
                let tree = OnceLock::new();
                let working = working(self, None, &tree);
                let mut heat = vec![0.0; vertices];
                for &place in places {
                    let points = working.points(place, &mut notes)?;
                    for point in &points {
                        let point = point.in_some_face(manifold);
                        let corners = manifold.topology().face_vertices(point.face);
                        for (v, share) in corners.iter().zip(point.barycentric) {
                            heat[v.index()] += share / points.len() as f64;
                        }
                    }
                }
                let area = |v: usize| operator.mass().get(v, v).unwrap_or(1.0);
                heat.iter().enumerate().map(|(v, heat)| heat / area(v)).collect()
            }
        };
        if let Some(value) = start.iter().copied().find(|value| !value.is_finite()) {
            return Err(FieldError::NotFinite(value).into());
        }
        let topology = manifold.topology();
        let is_held = |v| options.is_boundary_held && topology.is_boundary_vertex(v);
        let flow =
            HeatFlow { held: topology.vertices().map(is_held).collect(), ..HeatFlow::insulated(vertices) };
        let found = flow.run(&operator, &start, options.time, options.frames, progress)?;
        let total = |u: &Vec<f64>| operator.mass().multiply(u).iter().sum();
        let totals = std::iter::once(&start).chain(&found).map(total).collect();
        let interval = options.time / options.frames.max(1) as f64;
        let times = (1..=options.frames).map(|frame| frame as f64 * interval).collect();
        let frames = found.iter().map(|u| self.at_vertices(u)).collect();
        Ok(Heat { times, frames, totals, notes })
    }
}

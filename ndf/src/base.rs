//! Base meshes of opened surfaces.

use ndf_core::{DVec3, Hint, ImplicitField, Progress, Surface};
use ndf_mesh::repair::{Components, Parts, welded, without_unusable_faces};
use ndf_mesh::sampling::AreaSampler;
use ndf_mesh::{FacePoint, ManifoldMesh, TriangleMesh, TriangleTree};
use ndf_meshing::{BaseMesh, BaseMeshError, BaseMeshOptions, base_mesh, base_mesh_of_manifold};

use crate::kind::Kind;
use crate::left_out::{LeftOut, check_left_out};
use crate::note::{NotDecimated, Note};
use crate::opened::{BaseSource, Opened};

/// Why there is no base mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoBaseMesh {
    /// The mesh cannot be decimated and has no isosurface.
    #[error("{reason}, and it encloses no volume from which a base mesh could be made")]
    NoVolume {
        /// Why it cannot be decimated.
        reason: NotDecimated,
    },
    /// Too much of the surface would be left out.
    #[error(transparent)]
    LeftOut(#[from] LeftOut),
    /// The base mesh could not be made.
    #[error(transparent)]
    Making(#[from] BaseMeshError),
}

impl Opened {
    /// A base mesh of the surface, in its units: decimated from a clean mesh, otherwise from an isosurface. The notes say
    /// what was left out.
    ///
    /// # Errors
    /// If the surface has neither, more than a twentieth of its area is in parts of less than a hundredth, or the observer asks
    /// to stop.
    pub fn base_mesh(
        &self,
        options: &BaseMeshOptions,
        progress: &dyn Progress,
    ) -> Result<(BaseMesh, Vec<Note>), NoBaseMesh> {
        let mut notes = Vec::new();
        let parts = if self.parts == Parts::Largest { self.parts } else { options.parts };
        // Densities are high on surfaces, and low inside.
        let is_density = matches!(self.kind, Kind::Nerf | Kind::Splats);
        let options = &BaseMeshOptions { parts, cavities: options.cavities && !is_density, ..*options };
        let mut made = match &self.base {
            BaseSource::Manifold(mesh) => {
                base_mesh_of_manifold(mesh, Some(&*self.surface), options, progress)?
            }
            BaseSource::Isosurface { reason, .. } => {
                let surface = self.field_surface().ok_or(BaseMeshError::NoField);
                let made = surface.and_then(|surface| base_mesh(surface, options, progress));
                match (made, reason) {
                    (Err(BaseMeshError::NoField | BaseMeshError::Isosurface(_)), Some(reason)) => {
                        return Err(NoBaseMesh::NoVolume { reason: reason.clone() });
                    }
                    (made, reason) => {
                        let made = made?;
                        notes.extend(reason.clone().map(|reason| Note::NotDecimated { reason }));
                        made
                    }
                }
            }
        };
        let (lost, told) = match made.report.grid {
            Some(_) => self.lost_by(&made.mesh),
            None => (self.area_left_out, Vec::new()),
        };
        notes.extend(told);
        let report = &mut made.report;
        report.area_dropped = report.area_dropped.max(lost);
        check_left_out(report.area_dropped, parts)?;
        if report.cavities_dropped > 0 {
            notes.push(Note::InnerWallsLeftOut { walls: report.cavities_dropped });
        }
        if report.components_dropped > 0 {
            notes.push(Note::PartsLeftOut { parts: report.components_dropped, area: report.area_dropped });
        }
        if !report.reached {
            notes.push(Note::FacesNeeded { faces: report.faces, asked: options.faces });
        } else if report.faces_before <= options.faces && report.grid.is_none() {
            notes.push(Note::NothingToDecimate { faces: report.faces });
        }
        Ok((made, notes))
    }

    /// The share of the area of the mesh that it is, from 0 to 1, that an isosurface of its field lost; and notes if much of it
    /// is inside, or if the isosurface is in more parts. What was left out before where it is no mesh.
    pub fn lost_by(&self, isosurface: &ManifoldMesh) -> (f64, Vec<Note>) {
        match (&self.mesh, self.field_surface().and_then(Surface::as_field)) {
            (Some(mesh), Some(field)) => {
                let (lost, walls) = uncovered(mesh, isosurface, field);
                let inside = (walls > NOTABLE_WALLS).then_some(Note::WallsInside { share: walls });
                let of = Components::of(&welded(&without_unusable_faces(mesh), 0.0)).len();
                let parts = solids(isosurface);
                let apart = (parts > of).then_some(Note::FallsApart { parts, of });
                (lost, inside.into_iter().chain(apart).collect())
            }
            _ => (self.area_left_out, Vec::new()),
        }
    }
}

/// Components that point outward: the others are walls of cavities.
fn solids(mesh: &TriangleMesh) -> usize {
    let components = Components::of(mesh);
    let mut volumes = vec![0.0; components.len()];
    let center = mesh.bounds().center();
    for (f, &component) in mesh.face_indices().zip(&components.of_face) {
        let [a, b, c] = mesh.corner_positions(f).map(|p| p - center);
        volumes[component as usize] += a.dot(b.cross(c));
    }
    volumes.into_iter().filter(|&volume| volume > 0.0).count()
}

/// The share of the area of a mesh from which walls inside are worth a note.
const NOTABLE_WALLS: f64 = 0.01;

/// The shares of the area of a mesh that are farther than a twentieth of its diagonal from a base mesh made of its field: what the
/// base mesh lost, and walls inside, which are no boundary of the solid.
fn uncovered(mesh: &TriangleMesh, by: &ManifoldMesh, field: &dyn ImplicitField) -> (f64, f64) {
    const SAMPLES: usize = 20_000;
    let mesh = &without_unusable_faces(mesh);
    let Some(sampler) = AreaSampler::new(mesh) else { return (0.0, 0.0) };
    let diagonal = mesh.bounds().diagonal();
    let (reach, aside) = (0.05 * diagonal, 1e-4 * diagonal);
    let tree = TriangleTree::new(by);
    let is_far = |sample: &FacePoint| {
        let place = sample.position(mesh);
        tree.closest_point_within(place, reach * reach, Hint::NONE, |_| true).is_none()
    };
    let mut far = sampler.sample(SAMPLES, 0, 0);
    far.retain(is_far);
    let sides = |sample: &FacePoint| {
        let offset = aside * mesh.face_normal(sample.face);
        [-1.0, 1.0].map(|side| sample.position(mesh) + side * offset)
    };
    let points: Vec<DVec3> = far.iter().flat_map(sides).collect();
    let mut values = vec![0.0; points.len()];
    field.values(&points, &mut values);
    let is_inside = |value: &f64| *value < field.level();
    let walls = values.chunks_exact(2).filter(|sides| sides.iter().all(is_inside)).count();
    let share = |count: usize| count as f64 / SAMPLES as f64;
    (share(far.len() - walls), share(walls))
}

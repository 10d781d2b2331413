//! Base meshes of opened surfaces.

use ndf_core::Progress;
use ndf_meshing::{BaseMesh, BaseMeshError, BaseMeshOptions, base_mesh, base_mesh_of_manifold};

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
    /// The base mesh could not be made.
    #[error(transparent)]
    Making(#[from] BaseMeshError),
}

impl Opened {
    /// A base mesh of the surface, in its units: decimated from a clean mesh, otherwise from an isosurface. The notes say
    /// what was left out.
    ///
    /// # Errors
    /// If the surface has neither, or the observer asks to stop.
    pub fn base_mesh(
        &self,
        options: &BaseMeshOptions,
        progress: &dyn Progress,
    ) -> Result<(BaseMesh, Vec<Note>), NoBaseMesh> {
        let mut notes = Vec::new();
        let made = match &self.base {
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
        let report = &made.report;
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
}

//! Where base meshes come from.

use std::fmt;

use ndf_core::{Progress, Surface};
use ndf_mesh::{ManifoldMesh, NotManifold, ValidationReport};
use ndf_meshing::{BaseMesh, BaseMeshError, BaseMeshOptions, base_mesh, base_mesh_of_manifold};
use serde::Serialize;

use crate::{Note, Opened};

/// Where the base mesh of a surface comes from.
#[non_exhaustive]
pub enum BaseSource {
    /// A clean mesh, which is decimated.
    Manifold(ManifoldMesh),
    /// The isosurface of a field.
    Isosurface {
        /// The surface with that field, where it is not the surface that is learned.
        scaffold: Option<Box<dyn Surface>>,
        /// Why a mesh cannot be decimated instead, where the input is one.
        reason: Option<NotDecimated>,
    },
}

impl BaseSource {
    /// The isosurface of the surface's own field.
    pub(crate) const OWN_FIELD: Self = Self::Isosurface { scaffold: None, reason: None };
}

/// Why a mesh cannot be decimated to a base mesh.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "reason", rename_all = "snake_case")]
#[non_exhaustive]
pub enum NotDecimated {
    /// No component has most of the area.
    InPieces {
        /// The share of the largest.
        largest: f64,
    },
    /// It cannot be mended to be a manifold.
    NotManifold {
        /// What is left wrong with it.
        report: Box<ValidationReport>,
    },
}

impl From<NotManifold> for NotDecimated {
    fn from(NotManifold(report): NotManifold) -> Self {
        Self::NotManifold { report }
    }
}

impl fmt::Display for NotDecimated {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::InPieces { largest } => {
                write!(f, "it is in pieces, the largest with {:.0} % of the area", 100.0 * largest)
            }
            Self::NotManifold { report } => NotManifold(report.clone()).fmt(f),
        }
    }
}

/// Why there is no base mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoBaseMesh {
    /// A mesh that can neither be decimated nor has an isosurface.
    #[error("{reason}, and it encloses no volume from which a base mesh could be made")]
    NoVolume {
        /// Why it cannot be decimated.
        reason: NotDecimated,
    },
    /// No base mesh can be made of this surface.
    #[error(transparent)]
    Making(#[from] BaseMeshError),
}

impl Opened {
    /// The surface whose field gives isosurfaces, if there is one.
    pub fn field_surface(&self) -> Option<&dyn Surface> {
        let surface = match &self.base {
            BaseSource::Isosurface { scaffold: Some(scaffold), .. } => &**scaffold,
            _ => &*self.surface,
        };
        surface.as_field().map(|_| surface)
    }

    /// A base mesh of the surface, in its units: decimated from a clean mesh, or else from an isosurface. The notes tell
    /// what was left out.
    ///
    /// # Errors
    /// If there is neither.
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

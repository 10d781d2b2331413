//! A surface that can be learned, wherever it comes from.

use std::path::PathBuf;

use ndf_core::{Progress, Surface};
use ndf_mesh::repair::Parts;
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_meshing::{IsosurfaceError, MarchingCubesOptions, marching_cubes};
use ndf_surfaces::LevelSearch;
use serde::Serialize;

use crate::kind::Kind;
use crate::note::{NotDecimated, Note};

/// A surface that can be learned: what [`Fit`](crate::Fit) takes.
#[non_exhaustive]
pub struct Opened {
    /// The file it comes from, if it comes from one.
    pub path: Option<PathBuf>,
    /// What represents it. Decides on the [defaults](crate::presets).
    pub kind: Kind,
    /// What is learned.
    pub surface: Box<dyn Surface>,
    /// Where its base mesh comes from.
    pub base: BaseSource,
    /// The mesh it is known by, where it is a mesh.
    pub mesh: Option<TriangleMesh>,
    /// The level of its field, where that was to be chosen.
    pub level: Option<Level>,
    /// How the level of a cached copy of the field is searched, where projecting onto the field itself is costly.
    pub cached: Option<LevelSearch>,
    /// What was left out, changed or is doubtful.
    pub notes: Vec<Note>,
    /// The share of the area of the mesh it is that was left out, from 0 to 1.
    pub area_left_out: f64,
    /// Which components of isosurfaces are kept for base meshes.
    pub parts: Parts,
}

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

/// The level of a field that is learned.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Level {
    /// Its value.
    pub value: f64,
    /// How it was chosen.
    pub rule: LevelRule,
}

/// How a level was chosen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum LevelRule {
    /// By [`OpenOptions::level`](crate::OpenOptions::level).
    Asked,
    /// The zero of a distance.
    Zero,
    /// That of the logarithm of the density, as instant-ngp meshes it.
    InstantNgp,
    /// Halves light within 1/100 of the box.
    HalvedLight,
    /// Parts the densities best (Otsu), at less than halves light within 1/100 of the box.
    Otsu,
    /// That of SuGaR's meshes.
    Sugar,
    /// Half the typical density of opaque splats, which is less than SuGaR's level.
    HalfTypical,
    /// About half the typical density of opaque splats, which form an even sheet.
    EvenSheet,
}

impl std::fmt::Display for LevelRule {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Asked => "as asked for",
            Self::Zero => "the zero of a distance",
            Self::InstantNgp => "of the logarithm of the density, as instant-ngp meshes it",
            Self::HalvedLight => "halves light within 1/100 of the box",
            Self::Otsu => {
                "parts the densities best (Otsu); less than what halves light within 1/100 of the box"
            }
            Self::Sugar => "as SuGaR's meshes",
            Self::HalfTypical => {
                "half the typical density of opaque splats; less than the level of SuGaR's meshes"
            }
            Self::EvenSheet => "about half the typical density of opaque splats, which form an even sheet",
        })
    }
}

impl Opened {
    /// A surface of one's own. It is learned with the defaults of the kind it is `like`; its base mesh is made of its field,
    /// if it has one, and is to be given to [`Fit`](crate::Fit) otherwise.
    pub fn from_surface(surface: Box<dyn Surface>, like: Kind) -> Self {
        Self {
            path: None,
            kind: like,
            surface,
            base: BaseSource::OWN_FIELD,
            mesh: None,
            level: None,
            cached: None,
            notes: Vec::new(),
            area_left_out: 0.0,
            parts: Parts::All,
        }
    }

    /// The surface whose field gives isosurfaces, if there is one.
    pub fn field_surface(&self) -> Option<&dyn Surface> {
        let surface = match &self.base {
            BaseSource::Isosurface { scaffold: Some(scaffold), .. } => &**scaffold,
            _ => &*self.surface,
        };
        surface.as_field().map(|_| surface)
    }

    /// A mesh that stands for the surface in comparisons and pictures: the mesh it is, or its isosurface on a grid of
    /// `cells` along the longest side.
    ///
    /// # Errors
    /// If it is no mesh and has no isosurface, or the observer asks to stop.
    pub fn reference(&self, cells: u32, progress: &dyn Progress) -> Result<TriangleMesh, NoReference> {
        match (&self.base, &self.mesh) {
            (BaseSource::Manifold(mesh), _) => Ok(TriangleMesh::clone(mesh)),
            (_, Some(mesh)) => Ok(mesh.clone()),
            _ => {
                let field = self.field_surface().and_then(Surface::as_field).ok_or(NoReference::NoField)?;
                let options = MarchingCubesOptions { grid: cells, ..MarchingCubesOptions::default() };
                Ok(marching_cubes(field, &options, progress)?.mesh.into_triangle_mesh())
            }
        }
    }
}

/// Why no mesh stands for a surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoReference {
    /// It is no mesh and has no field.
    #[error("the input has neither a mesh nor an isosurface to be compared with")]
    NoField,
    /// The isosurface failed.
    #[error(transparent)]
    Isosurface(#[from] IsosurfaceError),
}

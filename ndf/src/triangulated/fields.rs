//! Tangent fields and heat on triangulated surfaces, told at the vertices of the file.

use std::sync::OnceLock;

use ndf_core::{DVec3, Progress};
use ndf_fields::{
    Complex64, Diffused, DirectionField, FieldError, Frames, StripePattern, TangentBundle, VectorHeatSolver,
    exact_log_map, principal_directions,
};
use ndf_geodesic::{ExactOptions, exact_distances};
use ndf_intrinsic::IntrinsicMesh;
use ndf_mesh::repair::Irreparable;
use ndf_mesh::{ManifoldMesh, SurfacePoint, TriangleTree, Vertex};
use ndf_spectral::SpectralError;

use super::solver::{MAX_TIME_STEP, Working, working};
use super::{DistanceError, DistanceMethod, HeatReport, Original, Place, Triangulated};
use crate::Note;

/// Why there is no field.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceFieldError {
    /// The triangles are no oriented manifold.
    #[error("{0}, on which no tangent fields are defined")]
    NotManifold(Irreparable),
    /// A place is not on the surface.
    #[error(transparent)]
    Place(#[from] DistanceError),
    /// The field failed.
    #[error(transparent)]
    Field(#[from] FieldError),
}

impl From<SpectralError> for SurfaceFieldError {
    fn from(error: SpectralError) -> Self {
        Self::Field(error.into())
    }
}

/// What a direction field follows.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Alignment {
    /// Nothing: it is as smooth as can be.
    #[default]
    Free,
    /// The principal curvatures: lines follow the largest one. For an even symmetry.
    Curvature,
    /// The way from the nearest of these places.
    AwayFrom(Vec<Place>),
}

/// A direction field on a surface.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Directions {
    /// The field on the [manifold](Triangulated::manifold).
    pub field: DirectionField,
    /// One of the directions, of length 1, at every vertex of the [mesh](Triangulated::mesh); NaN at those that no face uses.
    pub vectors: Vec<DVec3>,
    /// Where it has no direction.
    pub singularities: Vec<Singularity>,
    /// The sum of all indices, and of what turns along the boundary: the Euler characteristic.
    pub index_sum: f64,
    /// What is doubtful: places far from the surface.
    pub notes: Vec<Note>,
}

/// A singular point of a direction field.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Singularity {
    /// The middle of its face.
    pub position: [f64; 3],
    /// How often the field turns around it, counter-clockwise, in turns.
    pub index: f64,
}

/// Vectors of the tangent plane of a vertex as numbers.
#[derive(Clone, Debug, PartialEq)]
pub struct LogMap {
    /// Of every vertex of the [mesh](Triangulated::mesh), the vector at the source that leads there; NaN at those that no face uses or no
    /// path reaches.
    pub coordinates: Vec<[f64; 2]>,
    /// The axes of the coordinates in space.
    pub axes: [DVec3; 2],
    /// What the vector heat method took, where it was used.
    pub heat: Option<HeatReport>,
}

/// A vector carried over a surface.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Transported {
    /// At every vertex of the [mesh](Triangulated::mesh); NaN at those that no face uses, zero where no path leads.
    pub vectors: Vec<DVec3>,
    /// How the heat method went.
    pub heat: HeatReport,
}

/// A surface with what tangent fields need, which is prepared once.
#[derive(Debug)]
pub struct SurfaceFields<'a> {
    pub(super) surface: &'a Triangulated,
    manifold: &'a ManifoldMesh,
    /// Lengths that the metric of a model has corrected.
    pub(super) mesh: IntrinsicMesh,
    bundle: TangentBundle,
    frames: Frames,
    tree: OnceLock<TriangleTree>,
}

impl Triangulated {
    /// Prepares tangent fields. O(n).
    ///
    /// # Errors
    /// If the surface is no oriented manifold.
    pub fn fields(&self) -> Result<SurfaceFields<'_>, SurfaceFieldError> {
        let manifold = self.manifold().map_err(|reason| SurfaceFieldError::NotManifold(reason.clone()))?;
        let mesh = IntrinsicMesh::from_mesh(manifold).scaled(self.applied().distances);
        let bundle = TangentBundle::new(&mesh);
        let frames = Frames::of(manifold);
        Ok(SurfaceFields { surface: self, manifold, mesh, bundle, frames, tree: OnceLock::new() })
    }
}

impl SurfaceFields<'_> {
    /// The smoothest field of a symmetry, or one that follows something.
    ///
    /// # Errors
    /// If the symmetry is not 1 to 16, or odd where curvature is followed, a place is not on the surface, the field is not found, or the
    /// observer asks to stop.
    pub fn directions(
        &self,
        symmetry: u32,
        alignment: &Alignment,
        progress: &dyn Progress,
    ) -> Result<Directions, SurfaceFieldError> {
        let mut notes = Vec::new();
        let field = match alignment {
            Alignment::Free => DirectionField::smoothest(&self.bundle, symmetry, progress)?,
            Alignment::Curvature if symmetry % 2 == 1 => return Err(FieldError::OddSymmetry(symmetry).into()),
            Alignment::Curvature => {
                let squares = principal_directions(self.manifold);
                let powers: Vec<Complex64> = squares.iter().map(|z| power(*z, symmetry / 2)).collect();
                DirectionField::aligned(&self.bundle, symmetry, &powers, progress)?
            }
            Alignment::AwayFrom(places) => {
                let sources = self.points(places, &mut notes)?;
                let exact = ExactOptions::default();
                let distances =
                    exact_distances(&self.mesh, &sources, &exact, progress).map_err(DistanceError::from)?;
                let away = self.bundle.gradient(distances.distances());
                let powers: Vec<Complex64> = away.iter().map(|z| power(*z, symmetry)).collect();
                DirectionField::aligned(&self.bundle, symmetry, &powers, progress)?
            }
        };
        Ok(self.told(field, notes))
    }

    /// A field of vectors in space, one for every vertex of the [mesh](Triangulated::mesh); only their directions count.
    ///
    /// # Errors
    /// If there is not one for every vertex, or the symmetry is not 1 to 16.
    pub fn directions_of(&self, symmetry: u32, vectors: &[DVec3]) -> Result<Directions, SurfaceFieldError> {
        let expected = self.surface.mesh().vertex_count();
        if vectors.len() != expected {
            return Err(FieldError::Count { found: vectors.len(), expected }.into());
        }
        let tangent = self.frames.project(&self.of_file(vectors));
        let powers = tangent.iter().map(|z| power(*z, symmetry)).collect();
        Ok(self.told(DirectionField::from_powers(symmetry, powers)?, Vec::new()))
    }

    fn told(&self, field: DirectionField, notes: Vec<Note>) -> Directions {
        let mesh = self.bundle.mesh();
        let symmetry = f64::from(field.symmetry());
        let singular = field.singularities(&self.bundle);
        let index_sum =
            singular.iter().map(|(_, index)| index).sum::<i32>() - field.boundary_index(&self.bundle);
        let position = |face| {
            let corners = mesh.face_vertices(face).map(|v| self.manifold.positions()[v.index()]);
            (corners.iter().sum::<DVec3>() / 3.0).to_array()
        };
        let singularity = |&(face, index): &(_, i32)| Singularity {
            position: position(face),
            index: f64::from(index) / symmetry,
        };
        let singularities = singular.iter().map(singularity).collect();
        let vectors = self.vectors(&field.directions());
        Directions { field, vectors, singularities, index_sum: f64::from(index_sum) / symmetry, notes }
    }

    /// Stripes across the lines of a field: 1 in their middle and −1 between, at the vertices of the [mesh](Triangulated::mesh), and how
    /// many begin or end somewhere.
    ///
    /// # Errors
    /// If the symmetry of the field is not 2, the frequency is not positive, the pattern is not found, or the observer asks to stop.
    pub fn stripes(
        &self,
        field: &DirectionField,
        frequency: f64,
        progress: &dyn Progress,
    ) -> Result<(Vec<f64>, usize), SurfaceFieldError> {
        let pattern = StripePattern::new(&self.bundle, field, frequency, progress)?;
        let ends = pattern.branches.iter().filter(|(_, index)| *index != 0).count();
        Ok((self.surface.at_vertices(&pattern.values()), ends))
    }

    /// A unit vector at a vertex carried to all others along shortest paths, by the vector heat method: at the vertices of the
    /// [mesh](Triangulated::mesh), NaN at those that no face uses. The angle is counted to the left from the first of the
    /// [axes](Self::axes). The time step is the least power of four with which heat reaches every vertex.
    ///
    /// # Errors
    /// If there is no such vertex, the surface is too distorted for double precision, or the observer asks to stop.
    pub fn transport(
        &self,
        source: Vertex,
        radians: f64,
        progress: &dyn Progress,
    ) -> Result<Transported, SurfaceFieldError> {
        let vector = (self.vertex(source)?, Complex64::cis(radians));
        let (vectors, heat) = self.carried(|solver| solver.transport(&[vector]), progress)?;
        Ok(Transported { vectors: self.vectors(&vectors), heat })
    }

    /// What the vector heat method finds with a time step that reaches every vertex.
    fn carried<T>(
        &self,
        find: impl Fn(&VectorHeatSolver) -> Result<Diffused<T>, FieldError>,
        progress: &dyn Progress,
    ) -> Result<(Vec<T>, HeatReport), FieldError> {
        let mut time_step = 1.0;
        loop {
            progress.check()?;
            let Diffused { values, out_of_reach, .. } =
                find(&VectorHeatSolver::with_time(&self.mesh, time_step)?)?;
            if out_of_reach == 0 || time_step >= MAX_TIME_STEP {
                return Ok((values, HeatReport { time_step, out_of_reach }));
            }
            time_step *= 4.0;
        }
    }

    /// The logarithmic map at a vertex, of shortest paths or by the vector heat method.
    ///
    /// # Errors
    /// If there is no such vertex, a path is lost, the surface is too distorted for double precision, or the observer asks to stop.
    pub fn log_map(
        &self,
        source: Vertex,
        method: DistanceMethod,
        progress: &dyn Progress,
    ) -> Result<LogMap, SurfaceFieldError> {
        let vertex = self.vertex(source)?;
        let (found, heat) = match method {
            DistanceMethod::Exact => (exact_log_map(&self.mesh, vertex, progress)?, None),
            DistanceMethod::Heat => {
                let (found, heat) = self.carried(|solver| solver.log_map(vertex), progress)?;
                (found, Some(heat))
            }
        };
        let is_reached = |(v, z): (usize, &Complex64)| v == vertex.index() || *z != Complex64::default();
        let pair = |(v, z)| if is_reached((v, z)) { [z.re, z.im] } else { [f64::NAN; 2] };
        let coordinates =
            self.to_file(&found.iter().enumerate().map(pair).collect::<Vec<_>>(), [f64::NAN; 2]);
        Ok(LogMap { coordinates, axes: self.frames.axes()[vertex.index()], heat })
    }

    /// The axes of the tangent plane of a vertex in space.
    ///
    /// # Errors
    /// If there is no such vertex, or no face uses it.
    pub fn axes(&self, vertex: Vertex) -> Result<[DVec3; 2], SurfaceFieldError> {
        Ok(self.frames.axes()[self.vertex(vertex)?.index()])
    }

    /// The vertex of the manifold that one of the file is.
    fn vertex(&self, vertex: Vertex) -> Result<Vertex, DistanceError> {
        match self.points(&[Place::Vertex(vertex)], &mut Vec::new())?.first() {
            Some(SurfacePoint::Vertex(found)) => Ok(*found),
            _ => Err(DistanceError::Unused { vertex }),
        }
    }

    pub(super) fn working(&self) -> Working<'_> {
        working(self.surface, None, &self.tree)
    }

    fn points(&self, places: &[Place], notes: &mut Vec<Note>) -> Result<Vec<SurfacePoint>, DistanceError> {
        let working = self.working();
        let mut points = Vec::new();
        for &place in places {
            points.extend(working.points(place, notes)?);
        }
        Ok(points)
    }

    fn vectors(&self, tangent: &[Complex64]) -> Vec<DVec3> {
        self.to_file(&self.frames.embed(tangent), DVec3::NAN)
    }

    pub(super) fn to_file<T: Copy>(&self, values: &[T], unused: T) -> Vec<T> {
        match &self.surface.original {
            Some(Original { origins, .. }) => origins.values(values, unused, |first, _| first),
            None => values.to_vec(),
        }
    }

    /// Values of the file's vertices at those of the manifold.
    fn of_file(&self, values: &[DVec3]) -> Vec<DVec3> {
        of_file(self.surface, values)
    }
}

/// Values of the vertices of the file at those of the triangles.
pub(super) fn of_file<T: Copy + Default>(surface: &Triangulated, values: &[T]) -> Vec<T> {
    let Some(Original { origins, .. }) = &surface.original else { return values.to_vec() };
    let mut found = vec![T::default(); surface.triangles.mesh().vertex_count()];
    for (v, value) in values.iter().enumerate() {
        origins.of_vertex(Vertex::new(v)).iter().for_each(|w| found[w.index()] = *value);
    }
    found
}

/// A power of the direction of a number, as long as the number.
fn power(z: Complex64, exponent: u32) -> Complex64 {
    let length = z.norm();
    if length > 0.0 { (z / length).powu(exponent) * length } else { z }
}

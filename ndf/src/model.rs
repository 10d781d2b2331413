//! What a model gives, in the units of the surface it was learned from.

use ndf_core::{NoProgress, Progress};
use ndf_intrinsic::extraction::tessellation::tessellate;
use ndf_intrinsic::{Extraction, ExtractionError, ExtractionOptions, ExtractionReport, extract};
use ndf_mesh::quality::Spread;
use ndf_mesh::{FacePoint, ManifoldMesh};
use ndf_model::{Model, Similarity};

/// More triangles than this are refused: their file would have over a gigabyte. Where addresses have 32 bits, memory ends
/// earlier.
const MAX_FACES: usize = if cfg!(target_pointer_width = "32") { 4_000_000 } else { 50_000_000 };

/// How long the edges of an extracted mesh should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum EdgeLength {
    /// In the units of the input.
    World(f64),
    /// In the box [-1.5, 1.5]³ that the base mesh fills: the paper's h.
    Relative(f64),
    /// A share of the mean edge length of the base mesh, or of the control mesh where the field is one of levels.
    OfBase(f64),
}

impl Default for EdgeLength {
    /// A quarter of the base mesh's, which makes about sixteen faces of each of its faces.
    fn default() -> Self {
        Self::OfBase(0.25)
    }
}

impl EdgeLength {
    /// The length in the box of a model. O(n) for a share, in the faces of the base mesh.
    pub fn relative(self, model: &Model) -> f64 {
        match self {
            Self::World(length) => model.similarity.length_to_normalised(length),
            Self::Relative(length) => length,
            Self::OfBase(share) => share * mean_edge(model.field.base()),
        }
    }

    /// The length in the units of a model's input. O(n) for a share, in the faces of the base mesh.
    pub fn world(self, model: &Model) -> f64 {
        match self {
            Self::World(length) => length,
            _ => model.similarity.length_to_world(self.relative(model)),
        }
    }
}

/// The mean length of the edges of a mesh, each counted once for every face it has.
fn mean_edge(mesh: &ManifoldMesh) -> f64 {
    let around = |f| {
        let [a, b, c] = mesh.corner_positions(f);
        a.distance(b) + b.distance(c) + c.distance(a)
    };
    mesh.face_indices().map(around).sum::<f64>() / (3 * mesh.face_count()) as f64
}

/// A mesh of a model, in the units of its input.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Extracted {
    /// The mesh: manifold, oriented, near to Delaunay.
    pub mesh: ManifoldMesh,
    /// Where on the base mesh every vertex lies.
    pub origins: Vec<FacePoint>,
    /// What is true of it.
    pub report: ExtractionReport,
}

/// Abilities of a [`Model`] in the units of its input.
pub trait ModelExt {
    /// A Delaunay mesh with edges of about this length. O(n log n) for n faces.
    ///
    /// # Errors
    /// If the length is not positive or asks for more than 50 million faces, or the field is not finite.
    fn extract(&self, edge_length: EdgeLength) -> Result<Extracted, ExtractionError> {
        self.extract_with(edge_length, &NoProgress)
    }

    /// As [`extract`](Self::extract), with an observer that can stop it.
    ///
    /// # Errors
    /// As [`extract`](Self::extract), and [`ExtractionError::Cancelled`].
    fn extract_with(
        &self,
        edge_length: EdgeLength,
        progress: &dyn Progress,
    ) -> Result<Extracted, ExtractionError>;

    /// The base faces cut by template until no edge is longer than this.
    ///
    /// # Errors
    /// As [`extract_with`](Self::extract_with).
    fn tessellate(
        &self,
        edge_length: EdgeLength,
        progress: &dyn Progress,
    ) -> Result<ManifoldMesh, ExtractionError>;

    /// The base mesh. Where the field is one of levels, that is the control mesh of a Loop surface, which lies around it.
    fn base_in_world(&self) -> ManifoldMesh;
}

impl ModelExt for Model {
    fn extract_with(
        &self,
        edge_length: EdgeLength,
        progress: &dyn Progress,
    ) -> Result<Extracted, ExtractionError> {
        let length = edge_length.relative(self);
        let options = ExtractionOptions { max_faces: MAX_FACES, ..ExtractionOptions::new(length) };
        let Extraction { mesh, origins, mut report, .. } =
            extract(&self.field, &options, progress).map_err(|error| as_given(error, edge_length))?;
        let Spread { min, mean, max } = &mut report.edge_length;
        for length in [min, mean, max, &mut report.target_edge_length, &mut report.mollification.added] {
            *length = self.similarity.length_to_world(*length);
        }
        Ok(Extracted { mesh: to_world(&mesh, &self.similarity), origins, report })
    }

    fn tessellate(
        &self,
        edge_length: EdgeLength,
        progress: &dyn Progress,
    ) -> Result<ManifoldMesh, ExtractionError> {
        let length = edge_length.relative(self);
        let found = tessellate(&self.field, length, MAX_FACES, progress)
            .map_err(|error| as_given(error, edge_length))?;
        Ok(to_world(&found.mesh, &self.similarity))
    }

    fn base_in_world(&self) -> ManifoldMesh {
        to_world(self.field.base(), &self.similarity)
    }
}

/// The error with the number that was given, rather than the one in the box.
fn as_given(error: ExtractionError, given: EdgeLength) -> ExtractionError {
    let (EdgeLength::World(length) | EdgeLength::Relative(length) | EdgeLength::OfBase(length)) = given;
    match error {
        ExtractionError::EdgeLength(_) => ExtractionError::EdgeLength(length),
        other => other,
    }
}

/// A mesh in the box, in the units of the input.
pub(crate) fn to_world(mesh: &ManifoldMesh, similarity: &Similarity) -> ManifoldMesh {
    mesh.with_positions(mesh.positions().iter().map(|&p| similarity.to_world(p)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_that_are_refused_are_those_that_were_given() {
        for length in [-2.0, 0.0, f64::NAN] {
            let given = [EdgeLength::World(length), EdgeLength::Relative(length), EdgeLength::OfBase(length)];
            for given in given {
                let error = as_given(ExtractionError::EdgeLength(7.0), given);
                assert!(matches!(error, ExtractionError::EdgeLength(x) if x.to_bits() == length.to_bits()));
            }
        }
    }
}

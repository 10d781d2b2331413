//! What a model gives, in the units of the surface it was learned from.

use ndf_core::{NoProgress, Progress};
use ndf_intrinsic::extraction::tessellation::tessellate;
use ndf_intrinsic::{Extraction, ExtractionError, ExtractionOptions, ExtractionReport, extract};
use ndf_mesh::quality::Spread;
use ndf_mesh::{FacePoint, ManifoldMesh};
use ndf_model::{Model, Similarity};

/// More triangles than this are not extracted: their file would have over a gigabyte. Where addresses have 32 bits, memory
/// ends earlier.
pub const MAX_FACES: usize = if cfg!(target_pointer_width = "32") { MAX_FACES_32_BIT } else { 50_000_000 };

/// [`MAX_FACES`] where addresses have 32 bits, as in WebAssembly.
pub const MAX_FACES_32_BIT: usize = 4_000_000;

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

    /// The number as it was given, which is what messages repeat.
    fn given(self) -> f64 {
        match self {
            Self::World(number) | Self::Relative(number) | Self::OfBase(number) => number,
        }
    }

    /// What to extract from a model, and what is wrong with it in the unit that was given.
    fn in_box(self, model: &Model) -> Result<f64, ExtractionError> {
        let is_length = self.given().is_finite() && self.given() > 0.0;
        if is_length { Ok(self.relative(model)) } else { Err(ExtractionError::EdgeLength(self.given())) }
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

impl Extracted {
    /// About how many faces the surface's mesh has with edges of another length, in the units of the input: they grow as the
    /// square of the fineness.
    pub fn foretold_faces(&self, edge_length: f64) -> f64 {
        self.mesh.face_count() as f64 * (self.report.target_edge_length / edge_length).powi(2)
    }

    /// About the shortest edges with which a mesh of the surface has at most so many faces, in the units of the input.
    pub fn min_edge_length(&self, max_faces: usize) -> f64 {
        self.report.target_edge_length * (self.mesh.face_count() as f64 / max_faces as f64).sqrt()
    }
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
        let length = edge_length.in_box(self)?;
        let options = ExtractionOptions { max_faces: MAX_FACES, ..ExtractionOptions::new(length) };
        let Extraction { mesh, origins, mut report, .. } = extract(&self.field, &options, progress)?;
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
        let length = edge_length.in_box(self)?;
        let found = tessellate(&self.field, length, MAX_FACES, progress)?;
        Ok(to_world(&found.mesh, &self.similarity))
    }

    fn base_in_world(&self) -> ManifoldMesh {
        to_world(self.field.base(), &self.similarity)
    }
}

/// A mesh in the box, in the units of the input.
pub(crate) fn to_world(mesh: &ManifoldMesh, similarity: &Similarity) -> ManifoldMesh {
    mesh.with_positions(mesh.positions().iter().map(|&p| similarity.to_world(p)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_core::DVec3;
    use ndf_mesh::shapes;
    use ndf_model::{DisplacementField, FieldShape};

    /// An icosphere, a hundred times as large as the box.
    fn large() -> Model {
        let base = ManifoldMesh::try_from(shapes::icosphere(2)).unwrap();
        let field = DisplacementField::untrained(base, FieldShape::default(), 1).unwrap();
        let similarity = Similarity::new(0.01, DVec3::ZERO).unwrap();
        Model { field, similarity, metric: None, scalars: Vec::new(), provenance: String::new() }
    }

    #[test]
    fn lengths_that_are_none_are_told_as_they_were_given() {
        let model = large();
        for length in [EdgeLength::World(-7.0), EdgeLength::Relative(-7.0), EdgeLength::OfBase(-7.0)] {
            assert_eq!(model.extract(length).unwrap_err(), ExtractionError::EdgeLength(-7.0));
            assert_eq!(model.tessellate(length, &NoProgress).unwrap_err(), ExtractionError::EdgeLength(-7.0));
        }
    }

    #[test]
    fn faces_are_foretold() {
        let coarse = large().extract(EdgeLength::Relative(0.2)).unwrap();
        let fine = large().extract(EdgeLength::Relative(0.05)).unwrap();
        let ratio = coarse.foretold_faces(5.0) / fine.mesh.face_count() as f64;
        assert!((0.8..1.25).contains(&ratio), "{ratio}");
        let shortest = fine.min_edge_length(1000);
        assert!((fine.foretold_faces(shortest) - 1000.0).abs() < 1e-6);
    }
}

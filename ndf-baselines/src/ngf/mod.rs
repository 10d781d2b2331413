//! Neural geometry fields (Edavamadathil Sivaram, Li and Ramamoorthi 2024): quadrilaterals with features at their corners,
//! and one small network that displaces them.
//!
//! A mesh is decimated by quadrics and its triangles are paired to quadrilaterals. Corners and features are interpolated
//! bilinearly; the surface is y = x + MLP([feature, PE(x)]) with three hidden layers of 64 and LeakyReLU. Corners, features and
//! network are learned on tessellations of 4, 8, 12 and 16 steps a side.
//!
//! What is ours: the paper compares images of normals, drawn by a differentiable renderer from many cameras. There is none
//! here. In its place stand the L¹ distance of normals of tessellated faces from those of the input at the closest points,
//! the L¹ distance of their centres from those points, and, as in the paper, a Laplacian. The rate falls to zero with each
//! tessellation. Triangles that pairing leaves over become
//! quadrilaterals with two corners in one place, so that any mesh can be learned; the authors' program failed on 43 of the
//! supplement's 105.
//!
//! A file has the numbers of quadrilaterals, corners and features, centre and scale; places, features, quadrilaterals; the
//! layers of the network, weights before biases; all in 32 bits. The order is the paper's; centre and scale are 16 bytes more.

mod file;
mod learning;
mod loss;
mod quads;
mod tessellation;
#[cfg(test)]
mod tests;

use ndf_core::glam::Vec3;
use ndf_core::{Cancelled, DVec3, Progress};
use ndf_mesh::{ManifoldMesh, TriangleMesh};
use ndf_meshing::{DecimationOptions, decimate};
use ndf_network::{Activation, Mlp, MlpShape, Packed, encoding};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

pub use file::NgfFileError;
use tessellation::Tessellation;

/// Octaves of the positional encoding.
const OCTAVES: usize = 8;
/// Widths of the hidden layers.
const HIDDEN: [usize; 3] = [64; 3];

/// What to learn, and how long.
#[derive(Clone, Debug, PartialEq)]
pub struct NgfOptions {
    /// Quadrilaterals wished for; a few more where triangles are left over.
    pub quads: usize,
    /// Features at each corner. The paper has 10 to 20.
    pub features: usize,
    /// Steps a side of the tessellations that are learned on, one after another.
    pub tessellations: Vec<usize>,
    /// Iterations on each.
    pub iterations: usize,
    /// Rate of Adam at the beginning of each tessellation, at whose end it is zero. That of features is ten times as large.
    pub rate: f32,
    /// Seed of the network and the features.
    pub seed: u64,
}

impl NgfOptions {
    /// The settings of the paper for so many quadrilaterals; the rate is ours.
    pub fn with_quads(quads: usize) -> Self {
        Self { quads, features: 20, tessellations: vec![4, 8, 12, 16], iterations: 100, rate: 3e-3, seed: 0 }
    }
}

/// A neural geometry field.
#[derive(Clone, Debug, PartialEq)]
pub struct NeuralGeometryField {
    /// Places of corners in the normalised box.
    points: Vec<Vec3>,
    /// Features of corners, one corner after another.
    features: Vec<f32>,
    /// Corners, counter-clockwise; the last two of a triangle are the same.
    quads: Vec<[u32; 4]>,
    network: Mlp,
    /// Where the centre of the box is, and how long its unit is.
    center: Vec3,
    scale: f32,
}

/// A field and what became of the mesh on the way.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct LearnedNgf {
    /// The field.
    pub field: NeuralGeometryField,
    /// Triangles that were not paired.
    pub triangles: usize,
    /// The loss at the last iteration, in the normalised box.
    pub loss: f64,
}

/// The shape of the network for so many features.
fn shape(features: usize) -> MlpShape {
    let inputs = features + encoding::width(OCTAVES);
    MlpShape { inputs, hidden: HIDDEN.to_vec(), outputs: 3, activation: Activation::LeakyRelu }
}

impl NeuralGeometryField {
    /// Learns the field of a mesh. Deterministic; minutes for 500 quadrilaterals with the settings of the paper, over all
    /// threads.
    ///
    /// # Errors
    /// [`Cancelled`], if the observer asks to stop.
    pub fn learn(
        mesh: &ManifoldMesh,
        options: &NgfOptions,
        progress: &dyn Progress,
    ) -> Result<LearnedNgf, Cancelled> {
        let bounds = mesh.bounds();
        let center = bounds.center().as_vec3();
        let scale = (0.5 * bounds.extent().max_element()) as f32;
        let normalised = mesh.with_positions(
            mesh.positions().iter().map(|&p| (p - center.as_dvec3()) / f64::from(scale)).collect(),
        );
        let base = decimate(&normalised, &DecimationOptions::to_faces(2 * options.quads), progress).mesh;
        progress.check()?;
        let paired = quads::paired(&base);
        let mut rng = ChaCha8Rng::seed_from_u64(options.seed);
        let mut field = Self {
            points: base.positions().iter().map(|p| p.as_vec3()).collect(),
            features: learning::first_features(base.vertex_count() * options.features, &mut rng),
            quads: paired.quads,
            network: Mlp::zero_at_birth(shape(options.features), &mut rng),
            center,
            scale,
        };
        let loss = learning::run(&mut field, &normalised, options, progress)?;
        Ok(LearnedNgf { field, triangles: paired.triangles, loss })
    }

    /// Number of quadrilaterals.
    pub fn quad_count(&self) -> usize {
        self.quads.len()
    }

    /// Number of features at each corner.
    pub fn feature_count(&self) -> usize {
        self.network.shape().inputs - encoding::width(OCTAVES)
    }

    /// The surface, with so many steps along each side of a quadrilateral.
    ///
    /// # Panics
    /// If there is not one step at least.
    pub fn tessellated(&self, steps: usize) -> TriangleMesh {
        let tessellation = Tessellation::new(self.points.len(), &self.quads, steps);
        let places = learning::places(self, &Packed::new(&self.network), &tessellation);
        let (center, scale) = (self.center.as_dvec3(), f64::from(self.scale));
        let positions: Vec<DVec3> = places.iter().map(|p| center + scale * p.as_dvec3()).collect();
        TriangleMesh::new(positions, tessellation.faces).expect("faces name samples")
    }
}

//! The neural displacement field `g : Ω′ → R³` of a base mesh Ω′.
//!
//! `g(x) = x + MLP([z(x), x, PE(x)])` (or without the leading `x`, see [`FieldShape::residual`]), where `z` is
//! the *intrinsic encoding*: a feature vector at every base vertex, interpolated by barycentric coordinates.
//! Everything here lives in the normalised box `[-1.5, 1.5]³`; [`crate::Similarity`] leads to the user's units.
//!
//! This is the one place where `f64` geometry meets `f32` networks: inputs are rounded on the way in, and the
//! displacement is added in `f64` on the way out.

mod evaluation;
pub mod sample_encoding;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

pub use evaluation::Mapped;
pub(crate) use evaluation::fill_block;
pub use sample_encoding::SampleEncoding;

use ndf_core::DVec3;
use ndf_mesh::ManifoldMesh;
use ndf_network::{Activation, Mlp, MlpShape, Packed, encoding};

/// The sizes of a field's parts.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct FieldShape {
    /// Features per base vertex: d of the method.
    pub features: usize,
    /// Octaves of positional encoding of x; 0 for none.
    pub octaves: usize,
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// What hidden layers do to their sums.
    #[serde(default)]
    pub activation: Activation,
    /// Whether the network gives the displacement from x (then it starts as the identity) or the point.
    pub residual: bool,
}

impl Default for FieldShape {
    /// d = 8 and two hidden layers of 32 with ReLU, without positional encoding, residual.
    fn default() -> Self {
        Self { features: 8, octaves: 0, hidden: vec![32, 32], activation: Activation::Relu, residual: true }
    }
}

impl FieldShape {
    /// Shape of the network.
    pub fn network(&self) -> MlpShape {
        let inputs = self.features + 3 + encoding::width(self.octaves);
        MlpShape { inputs, hidden: self.hidden.clone(), outputs: 3, activation: self.activation }
    }

    /// What is wrong with these sizes, if anything: no model is so large, and a hostile file must not cost memory.
    pub fn defect(&self) -> Option<&'static str> {
        encoding::defect(self.features, self.octaves, &self.hidden)
    }
}

/// Why parts do not make a field.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FieldError {
    /// Number of features or parameters.
    #[error("{what}: {found} values, {expected} expected")]
    Count {
        /// Features or network parameters.
        what: &'static str,
        /// How many there are.
        found: usize,
        /// How many the shape asks for.
        expected: usize,
    },
    /// A feature or parameter is NaN or infinite.
    #[error("{0}: a value is not finite")]
    NotFinite(&'static str),
    /// A base vertex cannot be rounded to `f32`.
    #[error("base vertex {0} does not fit single precision")]
    BaseVertex(usize),
}

/// A base mesh, its features and its network: all that is needed to evaluate `g`.
#[derive(Clone, Debug)]
pub struct DisplacementField {
    base: ManifoldMesh,
    shape: FieldShape,
    /// Vertex-major: `features[v · d + k]`.
    features: Vec<f32>,
    network: Mlp,
    packed: Packed,
}

impl DisplacementField {
    /// A field of these parts. Base positions are rounded to `f32`, so that a file that keeps them so gives the
    /// same field back.
    ///
    /// # Errors
    /// If numbers do not fit together or are not finite.
    pub fn new(
        base: ManifoldMesh,
        shape: FieldShape,
        features: Vec<f32>,
        parameters: Vec<f32>,
    ) -> Result<Self, FieldError> {
        let expected = base.vertex_count() * shape.features;
        if features.len() != expected {
            return Err(FieldError::Count { what: "features", found: features.len(), expected });
        }
        if !features.iter().all(|f| f.is_finite()) {
            return Err(FieldError::NotFinite("features"));
        }
        if !parameters.iter().all(|p| p.is_finite()) {
            return Err(FieldError::NotFinite("network"));
        }
        let (found, expected) = (parameters.len(), shape.network().parameter_count());
        let network = Mlp::new(shape.network(), parameters).ok_or(FieldError::Count {
            what: "network parameters",
            found,
            expected,
        })?;
        let rounded: Vec<DVec3> = base.positions().iter().map(|p| p.as_vec3().as_dvec3()).collect();
        if let Some(v) = rounded.iter().position(|p| !p.is_finite()) {
            return Err(FieldError::BaseVertex(v));
        }
        let packed = Packed::new(&network);
        Ok(Self { base: base.with_positions(rounded), shape, features, network, packed })
    }

    /// A field to be trained: features and the network's last layer are zero where the shape is residual
    /// (`g` is the identity); features zero and Kaiming's initialisation of the network where it is not.
    ///
    /// # Errors
    /// If a base vertex does not fit single precision.
    pub fn untrained(base: ManifoldMesh, shape: FieldShape, seed: u64) -> Result<Self, FieldError> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let network = if shape.residual {
            Mlp::zero_at_birth(shape.network(), &mut rng)
        } else {
            Mlp::kaiming(shape.network(), &mut rng)
        };
        let features = vec![0.0; base.vertex_count() * shape.features];
        Self::new(base, shape, features, network.parameters().to_vec())
    }

    /// The base mesh, in the normalised box. Positions are exact in `f32`.
    pub fn base(&self) -> &ManifoldMesh {
        &self.base
    }

    /// Sizes of the parts.
    pub fn shape(&self) -> &FieldShape {
        &self.shape
    }

    /// Features, vertex by vertex.
    pub fn features(&self) -> &[f32] {
        &self.features
    }

    /// The network.
    pub fn network(&self) -> &Mlp {
        &self.network
    }

    /// The same base mesh and shape with other features and network parameters.
    ///
    /// # Errors
    /// If numbers do not fit together or are not finite.
    pub fn with_parameters(&self, features: Vec<f32>, parameters: Vec<f32>) -> Result<Self, FieldError> {
        Self::new(self.base.clone(), self.shape.clone(), features, parameters)
    }
}

//! Features on a base mesh and the perceptron that they feed.

use super::encoding::IntrinsicEncoding;
use super::error::NetworkError;
use super::shape::{NetworkShape, Passes};
use ndf_mesh::ManifoldMesh;
use ndf_network::{Mlp, Packed};

/// A perceptron that is fed `[z(x), x, PE(x)]` at points x of a base mesh, with z the intrinsic encoding: features at
/// the base vertices, interpolated. The base mesh is given with the points.
///
/// ```
/// use ndf_mesh::sampling::AreaSampler;
/// use ndf_mesh::{ManifoldMesh, shapes};
/// use ndf_model::intrinsic_network::{ChannelIndex, IntrinsicNetwork, NetworkShape};
///
/// let base = ManifoldMesh::try_from(shapes::icosphere(2))?;
/// // Two features a vertex, no hidden layer: z₀ − z₁, and x.
/// let shape = NetworkShape { features: 2, hidden: vec![], ..NetworkShape::default() };
/// let features = (0..2 * base.vertex_count()).map(|i| (i % 2) as f32).collect();
/// let passes = shape.passes(2, ChannelIndex::Output);
/// let weights = vec![1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0];
/// let network = IntrinsicNetwork::new(base.vertex_count(), shape, passes, features, [weights, vec![0.0; 2]].concat())?;
/// let points = AreaSampler::new(&base).ok_or("no area")?.sample(10, 0, 0);
/// for (values, point) in network.evaluate(&base, &points).chunks_exact(2).zip(&points) {
///     assert!((values[0] + 1.0).abs() < 1e-6);
///     assert!((f64::from(values[1]) - point.position(&base).x).abs() < 1e-6);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[doc(alias = "intrinsic encoding")]
#[derive(Clone, Debug)]
pub struct IntrinsicNetwork {
    shape: NetworkShape,
    passes: Passes,
    /// Vertex-major: `features[v · d + k]`.
    features: Vec<f32>,
    mlp: Mlp,
    pub(super) packed: Packed,
}

impl IntrinsicNetwork {
    /// A network of these parts: features vertex by vertex, parameters in the order of [`Mlp::parameters`].
    ///
    /// # Errors
    /// If numbers do not fit together or are not finite.
    pub fn new(
        base_vertices: usize,
        shape: NetworkShape,
        passes: Passes,
        features: Vec<f32>,
        parameters: Vec<f32>,
    ) -> Result<Self, NetworkError> {
        shape.validate()?;
        let expected = base_vertices * shape.features;
        if features.len() != expected {
            return Err(NetworkError::Count { what: "features", found: features.len(), expected });
        }
        for (what, values) in [("features", &features), ("network", &parameters)] {
            if !values.iter().all(|x| x.is_finite()) {
                return Err(NetworkError::NotFinite(what));
            }
        }
        let mlp = Mlp::new(shape.mlp(passes), parameters).map_err(|e| NetworkError::Count {
            what: "network parameters",
            found: e.found,
            expected: e.expected,
        })?;
        let packed = Packed::new(&mlp);
        Ok(Self { shape, passes, features, mlp, packed })
    }

    /// Sizes of the parts.
    pub fn shape(&self) -> &NetworkShape {
        &self.shape
    }

    /// How values come out of the perceptron.
    pub fn passes(&self) -> Passes {
        self.passes
    }

    /// Features, vertex by vertex.
    pub fn features(&self) -> &[f32] {
        &self.features
    }

    /// The perceptron.
    pub fn mlp(&self) -> &Mlp {
        &self.mlp
    }

    /// The same network with other numbers.
    ///
    /// # Errors
    /// If they are not as many as before, or not finite.
    pub fn with_parameters(&self, features: Vec<f32>, parameters: Vec<f32>) -> Result<Self, NetworkError> {
        let base_vertices = self.features.len() / self.shape.features.max(1);
        Self::new(base_vertices, self.shape.clone(), self.passes, features, parameters)
    }

    /// The same network with the base vertices in another order: `order[v]` is the old number of vertex v.
    pub(crate) fn reordered(&self, order: &[u32]) -> Self {
        let d = self.shape.features;
        let of_vertex = |&v: &u32| &self.features[v as usize * d..][..d];
        Self { features: order.iter().flat_map(of_vertex).copied().collect(), ..self.clone() }
    }

    /// What writes the rows of input on a base mesh whose positions, rounded, are `positions`.
    pub(super) fn encoding<'a>(
        &'a self,
        base: &'a ManifoldMesh,
        positions: &'a [[f32; 3]],
    ) -> IntrinsicEncoding<'a> {
        assert_eq!(base.vertex_count() * self.shape.features, self.features.len(), "another base mesh");
        IntrinsicEncoding::new(base.faces(), positions, &self.features, &self.shape)
    }
}

//! The neural displacement field `g : Ω′ → R³` of a base mesh Ω′.
//!
//! `g(x) = x + MLP([z(x), x, PE(x)])` (or without the leading `x`, see [`FieldShape::residual`]): an
//! [`IntrinsicNetwork`] that gives the displacement. Or `g(x) = S(x)`, the [surface of levels](crate::levels) above the base
//! mesh, without a network. Everything here lives in the normalised box `[-1.5, 1.5]³`; [`crate::Similarity`] leads to the
//! user's units.
//!
//! This is the one place where `f64` geometry meets `f32` networks: inputs are rounded on the way in, and the
//! displacement is added in `f64` on the way out.

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use serde::{Deserialize, Serialize};

use crate::intrinsic_network::{ChannelIndex, IntrinsicNetwork, NetworkError, NetworkShape, Part, Passes};
use crate::levels::{LevelSurface, Levels, LevelsError};
use crate::mapped::Mapped;
use ndf_core::DVec3;
use ndf_mesh::ManifoldMesh;
use ndf_mesh::{Face, FacePoint};
use ndf_network::{Mlp, MlpShape};

/// The sizes of a field's parts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FieldShape {
    /// Sizes of the features and the network.
    #[serde(flatten)]
    pub network: NetworkShape,
    /// Whether the network gives the displacement from x (then it starts as the identity) or the point.
    pub residual: bool,
}

impl Default for FieldShape {
    /// d = 8 and two hidden layers of 32 with ReLU, without positional encoding, residual.
    fn default() -> Self {
        NetworkShape::default().into()
    }
}

impl From<NetworkShape> for FieldShape {
    /// A residual field.
    fn from(network: NetworkShape) -> Self {
        Self { network, residual: true }
    }
}

impl FieldShape {
    /// How g comes out of the network: in one pass.
    pub fn passes(&self) -> Passes {
        self.network.passes(3, ChannelIndex::Output)
    }

    /// Shape of the perceptron.
    pub fn mlp(&self) -> MlpShape {
        self.network.mlp(self.passes())
    }
}

/// A base mesh and what displaces it: all that is needed to evaluate `g`.
#[derive(Clone, Debug)]
pub struct DisplacementField {
    base: ManifoldMesh,
    displacement: Displacement,
}

#[derive(Clone, Debug)]
enum Displacement {
    Network { network: IntrinsicNetwork, residual: bool },
    Levels { levels: Levels, surface: LevelSurface },
}

/// Derivatives of the barycentric coordinates along the edges of a face from its corner 0 to corners 1 and 2.
const EDGES: [[f32; 3]; 2] = [[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]];

impl DisplacementField {
    /// A field of these parts: features vertex by vertex, parameters in the order of [`Mlp::parameters`]. Base positions
    /// are rounded to `f32`, so that a file that keeps them so gives the same field back.
    ///
    /// # Errors
    /// If numbers do not fit together or are not finite.
    pub fn new(
        base: ManifoldMesh,
        shape: FieldShape,
        features: Vec<f32>,
        parameters: Vec<f32>,
    ) -> Result<Self, NetworkError> {
        let (passes, FieldShape { network, residual }) = (shape.passes(), shape);
        let network = IntrinsicNetwork::new(base.vertex_count(), network, passes, features, parameters)?;
        let rounded: Vec<DVec3> = base.positions().iter().map(|p| p.as_vec3().as_dvec3()).collect();
        if let Some(v) = rounded.iter().position(|p| !p.is_finite()) {
            return Err(NetworkError::BaseVertex(v));
        }
        let displacement = Displacement::Network { network, residual };
        Ok(Self { base: base.with_positions(rounded), displacement })
    }

    /// The field of levels above a base mesh, whose positions become the control vertices of the levels.
    /// O(4^levels · faces).
    ///
    /// # Errors
    /// If the levels do not fit the mesh.
    pub fn levelled(base: &ManifoldMesh, levels: Levels) -> Result<Self, LevelsError> {
        let surface = levels.surface(base)?;
        Ok(Self {
            base: base.with_positions(levels.positions()),
            displacement: Displacement::Levels { levels, surface },
        })
    }

    /// A field to be trained: features and the network's last layer are zero where the shape is residual
    /// (`g` is the identity); features zero and Kaiming's initialisation of the network where it is not.
    ///
    /// # Errors
    /// If the sizes are not supported, or a base vertex does not fit single precision.
    pub fn untrained(base: ManifoldMesh, shape: FieldShape, seed: u64) -> Result<Self, NetworkError> {
        shape.network.validate()?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mlp = if shape.residual {
            Mlp::zero_at_birth(shape.mlp(), &mut rng)
        } else {
            Mlp::kaiming(shape.mlp(), &mut rng)
        };
        let features = vec![0.0; base.vertex_count() * shape.network.features];
        Self::new(base, shape, features, mlp.parameters().to_vec())
    }

    /// The base mesh, in the normalised box. Positions are exact in `f32`.
    pub fn base(&self) -> &ManifoldMesh {
        &self.base
    }

    /// Sizes of the network's parts, if the field has a network.
    pub fn shape(&self) -> Option<FieldShape> {
        match &self.displacement {
            Displacement::Network { network, residual } => {
                Some(FieldShape { network: network.shape().clone(), residual: *residual })
            }
            Displacement::Levels { .. } => None,
        }
    }

    /// The network, if the field has one: features and perceptron.
    pub fn network(&self) -> Option<&IntrinsicNetwork> {
        match &self.displacement {
            Displacement::Network { network, .. } => Some(network),
            Displacement::Levels { .. } => None,
        }
    }

    /// The levels, if the field has some.
    pub fn levels(&self) -> Option<&Levels> {
        match &self.displacement {
            Displacement::Network { .. } => None,
            Displacement::Levels { levels, .. } => Some(levels),
        }
    }

    /// The surface of the levels, if the field has some.
    pub fn level_surface(&self) -> Option<&LevelSurface> {
        match &self.displacement {
            Displacement::Network { .. } => None,
            Displacement::Levels { surface, .. } => Some(surface),
        }
    }

    /// The same base mesh and shape with other features and network parameters.
    ///
    /// # Errors
    /// If the field has no network, or the numbers do not fit together or are not finite.
    pub fn with_parameters(&self, features: Vec<f32>, parameters: Vec<f32>) -> Result<Self, NetworkError> {
        let network = self.network().ok_or(NetworkError::NoNetwork)?;
        Ok(self.with_network(network.with_parameters(features, parameters)?))
    }

    /// The same base mesh with another network, which takes the place of the one it has.
    pub(crate) fn with_network(&self, network: IntrinsicNetwork) -> Self {
        let residual = matches!(self.displacement, Displacement::Network { residual: true, .. });
        Self { base: self.base.clone(), displacement: Displacement::Network { network, residual } }
    }

    /// g at every point; about 3,000 floating-point operations each with the default shape, and far fewer with levels.
    ///
    /// # Panics
    /// If a face does not exist in the base mesh.
    pub fn map(&self, points: &[FacePoint]) -> Vec<DVec3> {
        let (network, residual) = match &self.displacement {
            Displacement::Network { network, residual } => (network, *residual),
            Displacement::Levels { surface, .. } => return surface.map(points),
        };
        let mut mapped = vec![DVec3::ZERO; points.len()];
        network.evaluate_into(&self.base, points, &[], &mut mapped, 1, |_, point, row, to| {
            to[0] = self.origin(residual, point) + vector(row);
        });
        mapped
    }

    /// g and its tangents at every point; three times the work of [`map`](Self::map) with a network, as much with levels.
    ///
    /// # Panics
    /// If a face does not exist in the base mesh.
    pub fn map_with_tangents(&self, points: &[FacePoint]) -> Vec<Mapped> {
        let (network, residual) = match &self.displacement {
            Displacement::Network { network, residual } => (network, *residual),
            Displacement::Levels { surface, .. } => return surface.map_with_tangents(points),
        };
        let mut mapped = vec![Mapped { point: DVec3::ZERO, tangents: [DVec3::ZERO; 2] }; points.len()];
        let take = |part: Part, point: &FacePoint, row: &[f32], to: &mut [Mapped]| match part {
            Part::Values(_) => to[0].point = self.origin(residual, point) + vector(row),
            Part::Tangent(k) => to[0].tangents[k] = self.edge(residual, point.face, k) + vector(row),
        };
        network.evaluate_into(&self.base, points, &EDGES, &mut mapped, 1, take);
        mapped
    }

    /// The displacement's starting point: x where the field is residual.
    fn origin(&self, residual: bool, point: &FacePoint) -> DVec3 {
        if residual { point.position(&self.base) } else { DVec3::ZERO }
    }

    /// The derivative of the starting point along edge k.
    fn edge(&self, residual: bool, face: Face, k: usize) -> DVec3 {
        if !residual {
            return DVec3::ZERO;
        }
        let corners = self.base.corner_positions(face);
        corners[k + 1] - corners[0]
    }
}

fn vector(row: &[f32]) -> DVec3 {
    DVec3::new(f64::from(row[0]), f64::from(row[1]), f64::from(row[2]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ndf_mesh::sampling::AreaSampler;
    use ndf_mesh::shapes;
    use rand::RngExt;

    fn random_field(shape: FieldShape) -> DisplacementField {
        let base = ManifoldMesh::try_from(shapes::icosphere(2)).unwrap();
        let field = DisplacementField::untrained(base, shape.clone(), 3).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let mut random = |n: usize| (0..n).map(|_| rng.random_range(-0.3..0.3)).collect::<Vec<f32>>();
        let (f, p) =
            (random(field.network().unwrap().features().len()), random(shape.mlp().parameter_count()));
        field.with_parameters(f, p).unwrap()
    }

    #[test]
    fn untrained_residual_field_is_the_identity() {
        let base = ManifoldMesh::try_from(shapes::torus(9, 6, 1.0, 0.4)).unwrap();
        let field = DisplacementField::untrained(base, FieldShape::default(), 1).unwrap();
        let samples = AreaSampler::new(field.base()).unwrap().sample(1001, 0, 0);
        for (sample, y) in samples.iter().zip(field.map(&samples)) {
            assert_eq!(y, sample.position(field.base()));
        }
    }

    #[test]
    fn field_is_continuous_across_edges() {
        let field = random_field(NetworkShape { octaves: 2, ..NetworkShape::default() }.into());
        let base = field.base();
        for e in base.topology().edges() {
            let h = base.topology().edge_halfedge(e);
            let twin = base.topology().twin(h).unwrap();
            let y = field.map(&[FacePoint::on_halfedge(h, 0.3), FacePoint::on_halfedge(twin, 0.7)]);
            assert!((y[0] - y[1]).length() < 1e-5);
        }
    }

    #[test]
    fn tangents_are_the_derivatives() {
        for shape in [
            FieldShape::default(),
            FieldShape { residual: false, ..FieldShape::default() },
            NetworkShape { features: 3, octaves: 2, hidden: vec![24], ..NetworkShape::default() }.into(),
        ] {
            let field = random_field(shape);
            let samples = AreaSampler::new(field.base()).unwrap().sample(517, 0, 0);
            let values = field.map(&samples);
            let h = 1e-3;
            let moved = |to: usize, h: f64| {
                let step = |s: &FacePoint| {
                    let mut barycentric = s.barycentric;
                    barycentric[0] -= h;
                    barycentric[to] += h;
                    FacePoint { barycentric, ..*s }
                };
                field.map(&samples.iter().map(step).collect::<Vec<_>>())
            };
            let mut agree = 0;
            for to in [1, 2] {
                let (up, down) = (moved(to, h), moved(to, -h));
                for (i, mapped) in field.map_with_tangents(&samples).iter().enumerate() {
                    assert!((mapped.point - values[i]).length() < 1e-6);
                    let slope = (up[i] - down[i]) / (2.0 * h);
                    // ReLU has kinks: a few samples lie within h of one.
                    agree += usize::from((mapped.tangents[to - 1] - slope).length() < 1e-3);
                }
            }
            assert!(agree as f64 > 0.95 * 2.0 * samples.len() as f64, "{agree}");
        }
    }
}

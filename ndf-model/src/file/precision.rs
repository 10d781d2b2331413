//! How finely the numbers of a model are kept. What is on a coarse grid takes few bytes in a file, which loses nothing of
//! it: to make a model smaller is to move its numbers to coarser grids, at best while it still learns.

use ndf_core::DVec3;
use serde::{Deserialize, Serialize};

use super::base::in_file_order;
use super::connectivity::BaseOrder;
use super::grid::Grid;
use super::numbers::Groups;
use crate::displacement_field::DisplacementField;
use crate::intrinsic_network::IntrinsicNetwork;
use crate::model::Model;
use crate::scalars::SurfaceScalars;
use crate::similarity::Similarity;
use ndf_mesh::ManifoldMesh;
use ndf_network::Mlp;

/// Bits of the numbers of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Precision {
    /// Bits of the largest of each feature, the sign aside.
    pub features: u32,
    /// Bits of the largest weight of a layer, and of its largest bias, the sign aside.
    pub weights: u32,
    /// Bits by which positions are finer than the mean edge of the base mesh is long, at most: the farther the mesh is from
    /// the surface, the coarser they are.
    pub positions: u32,
}

impl Default for Precision {
    fn default() -> Self {
        Self::from_bits(8)
    }
}

impl Precision {
    /// Precisions between these bits of features can be asked for.
    pub const BITS: std::ops::RangeInclusive<u32> = 3..=14;

    /// So many bits for features, and as many for the rest as keep its part in the error small: weights, of which there
    /// are few, four more.
    pub fn from_bits(features: u32) -> Self {
        Self { features, weights: features + 4, positions: 8 }
    }
}

/// The grids of features at base vertices and of the network that takes them.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Grids {
    features: Vec<i8>,
    /// Of every layer, those of its weights and its biases.
    network: Vec<i8>,
}

impl Grids {
    /// Grids on which features (vertex-major, `dimension` a vertex) and a network have this precision.
    pub fn new(dimension: usize, features: &[f32], network: &Mlp, precision: Precision) -> Self {
        let of_groups = |groups: Groups<'_>, numbers: &[f32], bits: u32| -> Vec<i8> {
            let largest = |group: Vec<f32>| group.into_iter().fold(0.0_f32, |m, x| m.max(x.abs()));
            let grid = |group| Grid::reaching(largest(group), bits).exponent();
            groups.split(numbers).into_iter().map(grid).collect()
        };
        Self {
            features: of_groups(Groups::Interleaved(dimension), features, precision.features),
            network: of_groups(Groups::Layers(network.shape()), network.parameters(), precision.weights),
        }
    }

    /// Takes all numbers to the nearest on their grids.
    pub fn round(&self, features: &mut [f32], network: &mut Mlp) {
        for (k, &exponent) in self.features.iter().enumerate() {
            Grid::new(exponent).round(features, k, self.features.len());
        }
        let layers = network.shape().layers();
        let sizes = layers.into_iter().flat_map(|(inputs, outputs)| [inputs * outputs, outputs]);
        let mut rest = network.parameters_mut();
        for (size, &exponent) in sizes.zip(&self.network) {
            let (group, behind) = rest.split_at_mut(size);
            Grid::new(exponent).round(group, 0, 1);
            rest = behind;
        }
    }
}

/// The base mesh of a model, as it is stored.
#[derive(Clone, Debug)]
pub struct StoredBase {
    /// The mesh in the box, its parts in the order of the file.
    pub mesh: ManifoldMesh,
    /// From the units of the mesh it was made from to the box.
    pub similarity: Similarity,
    /// Where its parts are in the mesh it was made from.
    pub order: BaseOrder,
}

impl StoredBase {
    /// `base`, in any units, taken to the box, its positions to a grid where a precision asks for one.
    ///
    /// `distance` is the root mean square of the distances of `base` from the surface that it stands for, in the same
    /// units, or 0 where they are not known: rounding moves vertices along the normal by at most 0.6 times as much, in the
    /// root mean square, or by the little that the finest grid does, so that there is not much more to learn than before.
    pub fn new(base: &ManifoldMesh, precision: Option<Precision>, distance: f64) -> Self {
        let similarity = Similarity::from_bounds(&base.bounds());
        let single = |p: DVec3| similarity.to_normalised(p).as_vec3().as_dvec3();
        let normalised = base.with_positions(base.positions().iter().map(|&p| single(p)).collect());
        let (mesh, order) = in_file_order(&normalised);
        let distance = if distance.is_finite() { similarity.scale() * distance } else { 0.0 };
        let rounded = precision.and_then(|precision| on_grid(&mesh, precision, distance));
        Self { mesh: rounded.unwrap_or(mesh), similarity, order }
    }
}

/// Finer grids than that of single precision in the box make no sense.
const FINEST_GRID: i8 = -20;

/// Bits by which positions are always finer than the mean edge is long: what coarser ones save, the creases of a bumpy mesh
/// cost.
const MIN_POSITION_BITS: u32 = 5;

/// The largest spacing of positions, as a multiple of the distance from the surface. Rounding moves a vertex along the
/// normal by the spacing divided by √12, in the root mean square.
const SPACING_BY_DISTANCE: f64 = 2.0;

/// The mesh with positions on a grid: as coarse as precision and distance from the surface allow and no face turns by
/// more than 60°. `None` if faces turn on any.
fn on_grid(base: &ManifoldMesh, precision: Precision, distance: f64) -> Option<ManifoldMesh> {
    let lengths = base.topology().edges().map(|e| {
        let [a, b] = base.topology().edge_vertices(e).map(|v| base.positions()[v.index()]);
        a.distance(b)
    });
    let mean = lengths.sum::<f64>() / base.topology().edge_count().max(1) as f64;
    let spacing = |bits: u32| mean / f64::from(bits).exp2();
    let finest = spacing(precision.positions.max(MIN_POSITION_BITS));
    let spacing = (SPACING_BY_DISTANCE * distance).clamp(finest, spacing(MIN_POSITION_BITS));
    let first = spacing.log2().floor();
    let normals = |mesh: &ManifoldMesh| -> Vec<DVec3> {
        let mesh = &mesh;
        mesh.face_indices().map(|f| mesh.face_normal(f)).collect()
    };
    let before = normals(base);
    let candidates = (FINEST_GRID..=first.clamp(f64::from(FINEST_GRID), 0.0) as i8).rev();
    candidates
        .map(|exponent| {
            let grid = Grid::new(exponent);
            let rounded = |p: &DVec3| {
                let mut p = p.as_vec3().to_array();
                grid.round(&mut p, 0, 1);
                ndf_core::glam::Vec3::from(p).as_dvec3()
            };
            base.with_positions(base.positions().iter().map(rounded).collect())
        })
        .find(|mesh| {
            let kept = |(a, b): (&DVec3, &DVec3)| *a == DVec3::ZERO || a.dot(*b) > 0.5;
            before.iter().zip(&normals(mesh)).all(kept)
        })
}

impl IntrinsicNetwork {
    /// The network with its numbers in this precision.
    #[must_use]
    pub fn rounded(&self, precision: Precision) -> Self {
        let (mut features, mut mlp) = (self.features().to_vec(), self.mlp().clone());
        Grids::new(self.shape().features, &features, &mlp, precision).round(&mut features, &mut mlp);
        let rounded = self.with_parameters(features, mlp.parameters().to_vec());
        rounded.expect("as many numbers as before, and finite where they were")
    }
}

impl DisplacementField {
    /// The field with features and network of this precision; the base mesh, on which they live, stays, and so do levels,
    /// which are integers.
    #[must_use]
    pub fn rounded(&self, precision: Precision) -> Self {
        match self.network() {
            Some(network) => self.with_network(network.rounded(precision)),
            None => self.clone(),
        }
    }
}

impl SurfaceScalars {
    /// The fields with features and network of this precision; ranges and names stay, and so does what is on levels.
    #[must_use]
    pub fn rounded(&self, precision: Precision) -> Self {
        self.network().map_or_else(|| self.clone(), |network| self.with_network(network.rounded(precision)))
    }
}

impl Model {
    /// The model with its field and its scalar fields [rounded](DisplacementField::rounded).
    #[must_use]
    pub fn rounded(&self, precision: Precision) -> Self {
        let field = self.field.rounded(precision);
        let scalars = self.scalars.iter().map(|fields| fields.rounded(precision).moved_to(&field)).collect();
        Self { field, scalars, ..self.clone() }
    }
}

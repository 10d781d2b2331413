//! How finely the numbers of a model are kept. What is on a coarse grid takes few bytes in a file, which loses nothing of
//! it: to make a model smaller is to move its numbers to coarser grids, at best while it still learns.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Model;
use super::base::in_file_order;
use super::grid::Grid;
use super::numbers::Groups;
use crate::network::Mlp;
use crate::{DisplacementField, ManifoldMesh, Similarity, StoredScalars};

/// Bits of the numbers of a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Precision {
    /// Bits of the largest of each feature, the sign aside.
    pub features: u32,
    /// Bits of the largest weight of a layer, and of its largest bias, the sign aside.
    pub weights: u32,
    /// Bits by which positions are finer than the mean edge of the base mesh is long.
    pub positions: u32,
}

impl Default for Precision {
    fn default() -> Self {
        Self::of_bits(7)
    }
}

impl Precision {
    /// Precisions between these bits of features can be asked for.
    pub const BITS: std::ops::RangeInclusive<u32> = 3..=14;

    /// So many bits for features, and as many for the rest as keep its part in the error small: weights, of which there
    /// are few, four more.
    pub fn of_bits(features: u32) -> Self {
        Self { features, weights: features + 4, positions: 6 }
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

/// Features and parameters of a network in this precision: finite where they were.
fn rounded(dimension: usize, features: &[f32], network: &Mlp, precision: Precision) -> (Vec<f32>, Vec<f32>) {
    let (mut features, mut network) = (features.to_vec(), network.clone());
    Grids::new(dimension, &features, &network, precision).round(&mut features, &mut network);
    (features, network.parameters().to_vec())
}

/// The base mesh of a model: `base`, in any units, taken to the box, its positions to a grid where a precision asks for
/// one, its parts in the order of the file. The similarity leads from those units to the box.
pub fn stored_base(base: &ManifoldMesh, precision: Option<Precision>) -> (ManifoldMesh, Similarity) {
    let similarity = Similarity::to_box(&base.bounds());
    let single = |p: DVec3| similarity.to_normalised(p).as_vec3().as_dvec3();
    let base = in_file_order(&base.with_positions(base.positions().iter().map(|&p| single(p)).collect()));
    let rounded = precision.and_then(|precision| on_grid(&base, precision));
    (rounded.unwrap_or(base), similarity)
}

/// Finer grids than that of single precision in the box make no sense.
const FINEST_GRID: i8 = -20;

/// The mesh with positions on a grid: as coarse as the precision allows and no face turns by more than 60°. `None` if
/// faces turn on any.
fn on_grid(base: &ManifoldMesh, precision: Precision) -> Option<ManifoldMesh> {
    let lengths = (0..base.edge_count() as u32).map(|e| {
        let [a, b] = base.edge_vertices(e).map(|v| base.positions()[v as usize]);
        a.distance(b)
    });
    let mean = lengths.sum::<f64>() / base.edge_count().max(1) as f64;
    let first = mean.log2().floor() - f64::from(precision.positions);
    let normals = |mesh: &ManifoldMesh| -> Vec<DVec3> {
        let mesh = mesh.as_triangle_mesh();
        (0..mesh.face_count() as u32).map(|f| mesh.face_normal(f)).collect()
    };
    let before = normals(base);
    let candidates = (FINEST_GRID..=first.clamp(f64::from(FINEST_GRID), 0.0) as i8).rev();
    candidates
        .map(|exponent| {
            let grid = Grid::new(exponent);
            let rounded = |p: &DVec3| {
                let mut p = p.as_vec3().to_array();
                grid.round(&mut p, 0, 1);
                glam::Vec3::from(p).as_dvec3()
            };
            base.with_positions(base.positions().iter().map(rounded).collect())
        })
        .find(|mesh| {
            let kept = |(a, b): (&DVec3, &DVec3)| *a == DVec3::ZERO || a.dot(*b) > 0.5;
            before.iter().zip(&normals(mesh)).all(kept)
        })
}

impl DisplacementField {
    /// The field with features and network of this precision; the base mesh, on which they live, stays.
    #[must_use]
    pub fn rounded(&self, precision: Precision) -> Self {
        let (features, parameters) =
            rounded(self.shape().features, self.features(), self.network(), precision);
        self.with_parameters(features, parameters).expect("as many numbers as before, and finite")
    }
}

impl StoredScalars {
    /// The fields with features and network of this precision; ranges and names stay.
    #[must_use]
    pub fn rounded(&self, precision: Precision) -> Self {
        let (features, parameters) =
            rounded(self.shape().features, self.features(), self.network(), precision);
        self.with_parameters(features, parameters)
    }
}

impl Model {
    /// The model with its field and its scalar fields [rounded](DisplacementField::rounded).
    #[must_use]
    pub fn rounded(&self, precision: Precision) -> Self {
        Self {
            field: self.field.rounded(precision),
            scalars: self.scalars.iter().map(|fields| fields.rounded(precision)).collect(),
            ..self.clone()
        }
    }
}

//! How finely the numbers of a model are kept. What is on a coarse grid takes few bytes in a file, which loses nothing of
//! it: to make a model smaller is to move its numbers to coarser grids, at best while it still learns.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::Model;
use super::base::in_file_order;
use super::grid::Grid;
use super::numbers::Groups;
use crate::field::{DisplacementField, FieldError, FieldShape};
use crate::{ManifoldMesh, Similarity};

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

/// The grids of a field's features and network.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Grids {
    features: Vec<i8>,
    /// Of every layer, those of its weights and its biases.
    network: Vec<i8>,
}

impl Grids {
    /// Grids on which features (vertex-major) and network parameters have this precision.
    pub fn new(shape: &FieldShape, features: &[f32], parameters: &[f32], precision: Precision) -> Self {
        let of_groups = |groups: Groups<'_>, numbers: &[f32], bits: u32| -> Vec<i8> {
            let largest = |group: Vec<f32>| group.into_iter().fold(0.0_f32, |m, x| m.max(x.abs()));
            let grid = |group| Grid::reaching(largest(group), bits).exponent();
            groups.split(numbers).into_iter().map(grid).collect()
        };
        Self {
            features: of_groups(Groups::Interleaved(shape.features), features, precision.features),
            network: of_groups(Groups::Layers(&shape.network()), parameters, precision.weights),
        }
    }

    /// Takes all numbers to the nearest on their grids.
    pub fn round(&self, shape: &FieldShape, features: &mut [f32], parameters: &mut [f32]) {
        for (k, &exponent) in self.features.iter().enumerate() {
            Grid::new(exponent).round(features, k, self.features.len());
        }
        let mut rest = parameters;
        let sizes =
            shape.network().layers().into_iter().flat_map(|(inputs, outputs)| [inputs * outputs, outputs]);
        for (size, &exponent) in sizes.zip(&self.network) {
            let (group, behind) = rest.split_at_mut(size);
            Grid::new(exponent).round(group, 0, 1);
            rest = behind;
        }
    }
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
    ///
    /// # Errors
    /// If a number is not finite then.
    pub fn rounded(&self, precision: Precision) -> Result<Self, FieldError> {
        let mut features = self.features().to_vec();
        let mut parameters = self.network().parameters().to_vec();
        let grids = Grids::new(self.shape(), &features, &parameters, precision);
        grids.round(self.shape(), &mut features, &mut parameters);
        self.with_parameters(features, parameters)
    }
}

impl Model {
    /// The model with a [rounded](DisplacementField::rounded) field.
    ///
    /// # Errors
    /// If a number is not finite then.
    pub fn rounded(&self, precision: Precision) -> Result<Self, FieldError> {
        Ok(Self { field: self.field.rounded(precision)?, ..self.clone() })
    }
}

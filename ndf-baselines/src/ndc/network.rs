//! The network, from a state of PyTorch's.

use ndf_formats::tensors::{Tensor, TensorFile};
use ndf_meshing::IsosurfaceError;

use super::convolution::{Convolution, Lattice, Local, Stage, Voxels};

/// Channels inside.
const WIDTH: usize = 64;

/// A network that places the vertices of dual contouring.
#[derive(Clone, Debug)]
pub struct NeuralDualContouring {
    stages: [Stage; 3],
    is_deep: bool,
}

/// Why tensors are no network of neural dual contouring.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NdcWeightsError {
    /// A tensor is missing.
    #[error(
        "there is no tensor {0}: expected a network for vertices from signed distances, such as weights_ndc_sdf_float.pth"
    )]
    Missing(String),
    /// A tensor has another shape.
    #[error("tensor {name} has the shape {found:?}, not {expected:?}")]
    Shape {
        /// Its name.
        name: String,
        /// Its shape.
        found: Vec<usize>,
        /// The shape that fits.
        expected: Vec<usize>,
    },
}

/// A convolution by the name of its layer.
fn layer(
    tensors: &TensorFile,
    name: &str,
    [before, after]: [usize; 2],
    side: usize,
) -> Result<Convolution, NdcWeightsError> {
    let tensor = |part: &str, expected: Vec<usize>| -> Result<&Tensor, NdcWeightsError> {
        let name = format!("{name}.{part}");
        let tensor = tensors.get(&name).ok_or_else(|| NdcWeightsError::Missing(name.clone()))?;
        if tensor.shape() != expected {
            return Err(NdcWeightsError::Shape { name, found: tensor.shape().to_vec(), expected });
        }
        Ok(tensor)
    };
    let weights = tensor("weight", vec![after, before, side, side, side])?;
    let bias = tensor("bias", vec![after])?;
    Ok(Convolution::new(weights.values(), bias.values(), side * side * side))
}

impl NeuralDualContouring {
    /// The network of a state with the authors' names. NDC has the layers `conv_0` to `conv_4`, those up to `conv_2` over
    /// 3³ places, and `conv_out_float`; NDCx also the residual blocks `res_1` to `res_8`, of which one follows each of the
    /// first two layers and the others the third.
    ///
    /// # Errors
    /// If a tensor is missing or has another shape.
    pub fn from_tensors(tensors: &TensorFile) -> Result<Self, NdcWeightsError> {
        let is_deep = tensors.get("res_1.conv_1.weight").is_some();
        let block = |i: usize| -> Result<Local, NdcWeightsError> {
            let part = |k: usize| layer(tensors, &format!("res_{i}.conv_{k}"), [WIDTH; 2], 1);
            Ok(Local::Residual([part(1)?, part(2)?]))
        };
        let blocks = |range: std::ops::RangeInclusive<usize>| -> Result<Vec<Local>, NdcWeightsError> {
            if is_deep { range.map(block).collect() } else { Ok(Vec::new()) }
        };
        let wide = |name: &str, before: usize| layer(tensors, name, [before, WIDTH], 3);
        let mut last = blocks(3..=8)?;
        for name in ["conv_3", "conv_4"] {
            last.push(Local::Dense(layer(tensors, name, [WIDTH; 2], 1)?));
        }
        last.push(Local::Last(layer(tensors, "conv_out_float", [WIDTH, 3], 1)?));
        let stages = [
            Stage { convolution: wide("conv_0", 1)?, then: blocks(1..=1)? },
            Stage { convolution: wide("conv_1", WIDTH)?, then: blocks(2..=2)? },
            Stage { convolution: wide("conv_2", WIDTH)?, then: last },
        ];
        Ok(Self { stages, is_deep })
    }

    /// Whether it is NDCx, with residual blocks.
    pub fn is_deep(&self) -> bool {
        self.is_deep
    }

    /// Where the vertices of cells are in them, by the distances at all places of a lattice. Cells are named by their
    /// corner with the lowest coordinates, at least three places inside the lattice.
    pub(crate) fn offsets(
        &self,
        lattice: Lattice,
        distances: &[f32],
        cells: &[u32],
        go_on: &dyn Fn(f64) -> Result<(), IsosurfaceError>,
    ) -> Result<Vec<[f32; 3]>, IsosurfaceError> {
        let near = Voxels::grown(lattice, cells);
        let far = Voxels::grown(lattice, &near.places);
        let [first, second, third] = &self.stages;
        let distance = |place: u32| &distances[place as usize..][..1];
        let rows = first.apply(lattice, &far.places, distance);
        go_on(0.2)?;
        let rows = second.apply(lattice, &near.places, |place| row(&far, &rows, place));
        go_on(0.7)?;
        let rows = third.apply(lattice, cells, |place| row(&near, &rows, place));
        go_on(1.0)?;
        Ok(rows.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect())
    }
}

/// The channels of a place among others.
fn row<'a>(voxels: &Voxels, rows: &'a [f32], place: u32) -> &'a [f32] {
    let number = voxels.number(place).expect("neighbours of what is wanted are there");
    &rows[number as usize * WIDTH..][..WIDTH]
}

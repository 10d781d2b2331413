//! Splats in the checkpoints of training: those of gsplat and of nerfstudio's splatfacto, and the tuples of the authors'
//! code. Logarithms of scales, logits of opacities, quaternions w, x, y, z.

use super::{Splat, sigmoid};
use crate::tensors::{Tensor, TensorFile};

/// Names of means, scales, quaternions and opacities: gsplat's and splatfacto's, and places in the authors' tuple.
const NAMES: [[&str; 4]; 2] = [["means", "scales", "quats", "opacities"], ["1", "4", "5", "6"]];

/// The splats of a checkpoint; `None` if it holds none.
pub fn splats_of_tensors(file: &TensorFile) -> Option<Vec<Splat>> {
    NAMES.iter().find_map(|names| {
        let prefix = file.iter().find_map(|(name, _)| {
            let prefix = name.strip_suffix(names[0])?;
            let has_all = names.iter().all(|name| file.get(&format!("{prefix}{name}")).is_some());
            ((prefix.is_empty() || prefix.ends_with('.')) && has_all).then_some(prefix)
        })?;
        let tensor = |i: usize| file.get(&format!("{prefix}{}", names[i]));
        splats(tensor(0)?, tensor(1)?, tensor(2)?, tensor(3)?)
    })
}

/// A splat for each row; `None` if the shapes are others. Two scales are those of flat splats (2DGS).
fn splats(means: &Tensor, scales: &Tensor, quaternions: &Tensor, opacities: &Tensor) -> Option<Vec<Splat>> {
    let &[count, 3] = means.shape() else { return None };
    let &[scaled, axes @ (2 | 3)] = scales.shape() else { return None };
    if scaled != count || *quaternions.shape() != [count, 4] || opacities.values().len() != count {
        return None;
    }
    let splat = |i: usize| {
        let number = |tensor: &Tensor, width: usize, k: usize| tensor.values()[i * width + k];
        Splat {
            center: [0, 1, 2].map(|k| f64::from(number(means, 3, k))),
            scales: [0, 1, 2].map(|k| if k < axes { number(scales, axes, k).exp() } else { 0.0 }),
            rotation: [0, 1, 2, 3].map(|k| number(quaternions, 4, k)),
            opacity: sigmoid(opacities.values()[i]),
        }
    };
    Some((0..count).map(splat).collect())
}

//! Keras' HDF5 files, through `hdf5-pure`.

use hdf5_pure::{File, Group};
use ndf_mesh::io::FileDefect;

use super::{Contents, Tensor, TensorError};

/// Groups in groups that are looked into.
const DEEPEST: usize = 16;
/// The most data sets; networks have a few dozen.
const MOST_SETS: usize = 10_000;

pub(super) fn read(bytes: &[u8]) -> Result<Contents, TensorError> {
    let file = File::from_bytes(bytes.to_vec()).map_err(bad)?;
    let mut contents = Contents::default();
    descend(&file.root(), "", 0, bytes.len() as u64, &mut contents)?;
    Ok(contents)
}

fn bad(error: hdf5_pure::Error) -> FileDefect {
    FileDefect::undecodable(format!("as HDF5: {error}"))
}

fn descend(
    group: &Group,
    path: &str,
    depth: usize,
    bytes: u64,
    contents: &mut Contents,
) -> Result<(), FileDefect> {
    let join = |name: &str| if path.is_empty() { name.to_owned() } else { format!("{path}.{name}") };
    for name in group.datasets().map_err(bad)? {
        let set = group.dataset(&name).map_err(bad)?;
        let shape = set.shape().map_err(bad)?;
        // Stored plain, no array is larger than the file; compressed weights are hardly smaller.
        let count = shape.iter().try_fold(1_u64, |n, &side| n.checked_mul(side));
        if count.is_none_or(|count| count > 16 * bytes) {
            let text = format!("data set {} is larger than the file", join(&name));
            return Err(FileDefect::truncated(text));
        }
        let shape = shape.iter().map(|&side| side as usize).collect();
        // Names of the optimiser and the like are no numbers.
        let Ok(values) = set.read_f32() else { continue };
        if let Some(tensor) = Tensor::new(shape, values) {
            contents.tensors.insert(join(&name), tensor);
        }
        if contents.tensors.len() > MOST_SETS {
            return Err(FileDefect::too_large("it has more than ten thousand data sets"));
        }
    }
    if depth < DEEPEST {
        for name in group.groups().map_err(bad)? {
            descend(&group.group(&name).map_err(bad)?, &join(&name), depth + 1, bytes, contents)?;
        }
    }
    Ok(())
}

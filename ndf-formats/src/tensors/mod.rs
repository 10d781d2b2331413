//! Named arrays of numbers from the files people keep networks in. Nothing in a file is executed.
//!
//! | file | known by |
//! |---|---|
//! | PyTorch `.pth`, `.pt`, `.tar`, `.ckpt` | a zip archive with a `data.pkl`, or the pickles of PyTorch before 1.6 |
//! | `.safetensors` | its length and JSON header |
//! | NumPy `.npz`, `.npy` | a zip archive of arrays, or the magic of one; arrays of objects too |
//! | Keras `.h5` | the magic of HDF5 |
//!
//! Tensors are named by their path, parts joined by dots: `sdf_network_fine.lin0.bias`. Reading takes memory of the
//! order of the file's size.

#[cfg(feature = "zip")]
mod archive;
mod array;
#[cfg(feature = "hdf5")]
mod hdf5;
pub mod made;
mod npy;
mod pickle;
#[cfg(any(all(test, feature = "full"), feature = "samples"))]
pub mod samples;
#[cfg(test)]
mod tests;
mod torch;

use std::collections::BTreeMap;

use ndf_mesh::io::FileDefect;

#[cfg(feature = "sog")]
pub(crate) use archive::Archive;
pub use pickle::PickleError;

/// An array of numbers in row-major order.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    shape: Vec<usize>,
    values: Vec<f32>,
}

impl Tensor {
    /// An array of a shape; `None` if the number of values is another.
    pub fn new(shape: Vec<usize>, values: Vec<f32>) -> Option<Self> {
        let count = shape.iter().try_fold(1_usize, |n, &side| n.checked_mul(side))?;
        (count == values.len()).then_some(Self { shape, values })
    }

    /// Lengths of its sides; empty for a single number.
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// The values, the last side fastest.
    pub fn values(&self) -> &[f32] {
        &self.values
    }
}

/// The containers tensors are read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// A zip archive written by `torch.save`.
    TorchZip,
    /// The pickles `torch.save` wrote before version 1.6.
    TorchLegacy,
    /// Safetensors.
    Safetensors,
    /// An archive of NumPy arrays.
    Npz,
    /// A NumPy array, or a pickled object instead of one.
    Npy,
    /// HDF5, as Keras writes it.
    Hdf5,
}

impl std::fmt::Display for Container {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::TorchZip => "PyTorch",
            Self::TorchLegacy => "PyTorch before 1.6",
            Self::Safetensors => "safetensors",
            Self::Npz => "npz",
            Self::Npy => "npy",
            Self::Hdf5 => "HDF5",
        })
    }
}

/// Why tensors could not be read.
#[derive(Debug, thiserror::Error)]
pub enum TensorError {
    /// The file begins like no known container.
    #[error("the file is not a PyTorch, safetensors, NumPy or HDF5 file")]
    Magic,
    /// The container is known, but its reader was left out of this build.
    #[error("{container} files are not read by this build; build with the feature {feature} of ndf-formats")]
    NotBuilt {
        /// The container.
        container: Container,
        /// The feature that reads it.
        feature: &'static str,
    },
    /// The file ends early, or contradicts itself.
    #[error("the file is damaged: {0}")]
    Damaged(#[from] FileDefect),
    /// Numbers of a kind that is not read.
    #[error("tensor {name} holds {kind}, which is not supported")]
    Kind {
        /// Its name.
        name: String,
        /// The kind as the file names it.
        kind: String,
    },
    /// A pickle is damaged or out of the ordinary.
    #[error(transparent)]
    Pickle(#[from] PickleError),
    /// The file is sound but holds no tensor.
    #[error("the file holds no tensors{}", foreign_note(.foreign))]
    Empty {
        /// Classes its pickle names, which are neither loaded nor run.
        foreign: Vec<String>,
    },
}

fn foreign_note(foreign: &[String]) -> String {
    if foreign.is_empty() {
        return String::new();
    }
    format!("; it names classes that are not run: {}", foreign.join(", "))
}

/// An object of a pickle whose class is not run.
#[derive(Clone, Debug, PartialEq)]
pub struct Module {
    /// Full name of its class.
    pub class: String,
    /// Its attributes that are numbers.
    pub numbers: BTreeMap<String, f64>,
}

/// The tensors of a file.
#[derive(Clone, Debug)]
pub struct TensorFile {
    modules: Vec<Module>,
    container: Container,
    tensors: BTreeMap<String, Tensor>,
    foreign: Vec<String>,
}

impl TensorFile {
    /// Reads all tensors of a file.
    ///
    /// # Errors
    /// See [`TensorError`].
    pub fn parse(bytes: &[u8]) -> Result<Self, TensorError> {
        let archive = || bytes.starts_with(b"PK\x03\x04").then_some(Container::Npz);
        let container = container_of(bytes).or_else(archive).ok_or(TensorError::Magic)?;
        let read = match container {
            #[cfg(feature = "zip")]
            Container::TorchZip => torch::read_zip(bytes),
            Container::TorchLegacy => torch::read_legacy(bytes),
            #[cfg(feature = "safetensors")]
            Container::Safetensors => read_safetensors(bytes),
            #[cfg(feature = "zip")]
            Container::Npz => archive::read_npz(bytes),
            Container::Npy => npy::read_file(bytes),
            #[cfg(feature = "hdf5")]
            Container::Hdf5 => hdf5::read(bytes),
            #[cfg(not(feature = "zip"))]
            Container::TorchZip | Container::Npz => Err(TensorError::NotBuilt { container, feature: "zip" }),
            #[cfg(not(feature = "safetensors"))]
            Container::Safetensors => Err(TensorError::NotBuilt { container, feature: "safetensors" }),
            #[cfg(not(feature = "hdf5"))]
            Container::Hdf5 => Err(TensorError::NotBuilt { container, feature: "hdf5" }),
        };
        let Contents { tensors, foreign, modules } = read?;
        if tensors.is_empty() {
            return Err(TensorError::Empty { foreign });
        }
        Ok(Self { modules, container, tensors, foreign })
    }

    /// Where the tensors come from.
    pub fn container(&self) -> Container {
        self.container
    }

    /// The tensor of a name.
    pub fn get(&self, name: &str) -> Option<&Tensor> {
        self.tensors.get(name)
    }

    /// Names and tensors, ordered by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Tensor)> {
        self.tensors.iter().map(|(name, tensor)| (name.as_str(), tensor))
    }

    /// The tensors of several files as those of one: shards of a network. `None` for no files.
    pub fn merged(files: impl IntoIterator<Item = Self>) -> Option<Self> {
        files.into_iter().reduce(|mut all, file| {
            all.tensors.extend(file.tensors);
            all.foreign.extend(file.foreign);
            all.modules.extend(file.modules);
            all
        })
    }

    /// Objects of the file's pickle whose classes are not run, such as modules of a network saved whole.
    pub fn modules(&self) -> &[Module] {
        &self.modules
    }

    /// Classes the file's pickle names that are neither loaded nor run; only the tensors in them are.
    pub fn foreign(&self) -> &[String] {
        &self.foreign
    }
}

/// Named tensors as a file of safetensors. Needs the feature `safetensors`.
///
/// # Errors
/// If names are not fit for one.
#[cfg(feature = "safetensors")]
pub fn to_safetensors(tensors: &[(String, Tensor)]) -> Result<Vec<u8>, TensorError> {
    use safetensors::tensor::{Dtype, TensorView};
    let bad = |e: safetensors::SafeTensorError| TensorError::from(FileDefect::undecodable(e.to_string()));
    let bytes: Vec<Vec<u8>> =
        tensors.iter().map(|(_, t)| t.values.iter().flat_map(|x| x.to_le_bytes()).collect()).collect();
    let views = tensors.iter().zip(&bytes).map(|((name, tensor), bytes)| {
        TensorView::new(Dtype::F32, tensor.shape.clone(), bytes).map(|view| (name.as_str(), view))
    });
    let views = views.collect::<Result<Vec<_>, _>>().map_err(bad)?;
    safetensors::serialize(views, None).map_err(bad)
}

/// Whether a file begins like one that holds tensors.
pub fn is_tensor_file(bytes: &[u8]) -> bool {
    container_of(bytes).is_some()
}

pub(crate) fn container_of(bytes: &[u8]) -> Option<Container> {
    match bytes {
        [b'P', b'K', 3, 4, ..] => archive_of(bytes),
        [0x93, b'N', b'U', b'M', b'P', b'Y', ..] => Some(Container::Npy),
        [0x89, b'H', b'D', b'F', ..] => Some(Container::Hdf5),
        _ if torch::is_legacy(bytes) => Some(Container::TorchLegacy),
        // Eight bytes of length, then a JSON object.
        [a, b, c, d, e, f, g, h, b'{', rest @ ..] => {
            let length = u64::from_le_bytes([*a, *b, *c, *d, *e, *f, *g, *h]);
            (length <= rest.len() as u64 + 1).then_some(Container::Safetensors)
        }
        _ => None,
    }
}

/// What holds tensors in an archive. Without the reader of archives this is not known.
#[cfg(feature = "zip")]
fn archive_of(bytes: &[u8]) -> Option<Container> {
    archive::container_of(bytes)
}

#[cfg(not(feature = "zip"))]
fn archive_of(_: &[u8]) -> Option<Container> {
    Some(Container::TorchZip)
}

/// Whether an archive is SOG: images of splats. Without the reader of archives this is not known.
pub(crate) fn is_sog(bytes: &[u8]) -> bool {
    #[cfg(feature = "zip")]
    return archive::is_sog(bytes);
    #[cfg(not(feature = "zip"))]
    return bytes.is_empty();
}

/// What an archive without tensors is, in words that complete "the file is …".
pub(crate) fn other_archive(bytes: &[u8]) -> &'static str {
    #[cfg(feature = "zip")]
    return archive::other(bytes);
    #[cfg(not(feature = "zip"))]
    return if bytes.is_empty() { "empty" } else { "a zip archive; unpack it first" };
}

/// What a reader finds.
#[derive(Default)]
struct Contents {
    tensors: BTreeMap<String, Tensor>,
    foreign: Vec<String>,
    modules: Vec<Module>,
}

/// Kinds of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Element {
    F16,
    Bf16,
    F32,
    F64,
    I8,
    U8,
    I16,
    I32,
    I64,
}

impl Element {
    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::F16 | Self::Bf16 | Self::I16 => 2,
            Self::F32 | Self::I32 => 4,
            Self::F64 | Self::I64 => 8,
        }
    }

    /// The number in the first bytes, in little-endian order.
    fn number(self, bytes: &[u8]) -> f32 {
        macro_rules! of {
            ($type:ty) => {
                <$type>::from_le_bytes(bytes[..size_of::<$type>()].try_into().expect("as long as the type"))
            };
        }
        match self {
            Self::F16 => of!(half::f16).to_f32(),
            Self::Bf16 => of!(half::bf16).to_f32(),
            Self::F32 => of!(f32),
            Self::F64 => of!(f64) as f32,
            Self::I8 => f32::from(of!(i8)),
            Self::U8 => f32::from(of!(u8)),
            Self::I16 => f32::from(of!(i16)),
            Self::I32 => of!(i32) as f32,
            Self::I64 => of!(i64) as f32,
        }
    }

    fn numbers(self, bytes: &[u8]) -> Vec<f32> {
        bytes.chunks_exact(self.size()).map(|b| self.number(b)).collect()
    }
}

#[cfg(feature = "safetensors")]
fn read_safetensors(bytes: &[u8]) -> Result<Contents, TensorError> {
    use safetensors::{Dtype, SafeTensors};
    let file = SafeTensors::deserialize(bytes).map_err(|e| FileDefect::undecodable(e.to_string()))?;
    let mut contents = Contents::default();
    for (name, view) in file.iter() {
        let element = match view.dtype() {
            Dtype::F16 => Element::F16,
            Dtype::BF16 => Element::Bf16,
            Dtype::F32 => Element::F32,
            Dtype::F64 => Element::F64,
            Dtype::I8 => Element::I8,
            Dtype::U8 | Dtype::BOOL => Element::U8,
            Dtype::I16 => Element::I16,
            Dtype::I32 => Element::I32,
            Dtype::I64 => Element::I64,
            other => return Err(TensorError::Kind { name: name.to_owned(), kind: format!("{other:?}") }),
        };
        let tensor = Tensor::new(view.shape().to_vec(), element.numbers(view.data()));
        let other = || FileDefect::mismatch(format!("tensor {name} has another size than its shape"));
        let tensor = tensor.ok_or_else(other)?;
        contents.tensors.insert(name.to_owned(), tensor);
    }
    Ok(contents)
}

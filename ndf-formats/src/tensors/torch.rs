//! What `torch.save` writes: pickles that name storages, and the storages.

use std::collections::HashMap;

#[cfg(feature = "zip")]
use super::Module;
#[cfg(feature = "zip")]
use super::archive::{Archive, is_pickle};
use super::pickle::unpickle;
use super::{Contents, FileDefect, TensorError};

/// How the files before version 1.6 begin: protocol 2, then the number 0x1950a86a20f9469cfc6c in ten bytes.
const LEGACY_MAGIC: [u8; 14] =
    [0x80, 2, 0x8a, 10, 0x6c, 0xfc, 0x9c, 0x46, 0xf9, 0x20, 0x6a, 0xa8, 0x50, 0x19];

/// Calls of a function that are looked at.
#[cfg(feature = "zip")]
const MAX_CALLS: usize = 64;

pub(super) fn is_legacy(bytes: &[u8]) -> bool {
    bytes.starts_with(&LEGACY_MAGIC)
}

/// A zip archive: `…/data.pkl`, and a storage in each `…/data/KEY`.
#[cfg(feature = "zip")]
pub(super) fn read_zip(bytes: &[u8]) -> Result<Contents, TensorError> {
    let mut archive = Archive::open(bytes)?;
    let names = archive.names();
    let none = || FileDefect::missing("it has no data.pkl");
    let pickle_name = names.iter().find(|name| is_pickle(name)).ok_or_else(none)?;
    let folder = pickle_name.strip_suffix("data.pkl").unwrap_or_default().to_owned();
    if archive.read(&format!("{folder}byteorder")).is_ok_and(|order| order.starts_with(b"big")) {
        let text = "its numbers are in big-endian order, which is not supported";
        return Err(FileDefect::unsupported(text).into());
    }
    let pickle_bytes = archive.read(pickle_name)?;
    let (pickle, _) = unpickle(&pickle_bytes)?;
    let mut storages = HashMap::new();
    for key in pickle.storage_keys() {
        storages.insert(key.clone(), archive.read(&format!("{folder}data/{key}"))?);
    }
    let mut contents = pickle.tensors("", &mut |key| storages.get(key).map(Vec::as_slice))?;
    let code = format!("{folder}code/");
    for name in names.iter().filter(|name| name.starts_with(&code) && name.ends_with(".py")) {
        contents.modules.extend(modules_of_code(&String::from_utf8_lossy(&archive.read(name)?)));
    }
    Ok(contents)
}

/// Activations that the code of a TorchScript archive calls, as the modules that PyTorch has for them: traced modules keep
/// no attributes, but their calls have parameters. The code is looked through, not run.
#[cfg(feature = "zip")]
fn modules_of_code(code: &str) -> Vec<Module> {
    let functions = [
        ("relu", "ReLU", ""),
        ("leaky_relu", "LeakyReLU", "negative_slope"),
        ("softplus", "Softplus", "beta"),
        ("elu", "ELU", "alpha"),
        ("silu", "SiLU", ""),
        ("gelu", "GELU", ""),
        ("tanh", "Tanh", ""),
    ];
    let calls = |(function, class, parameter): (&str, &str, &str)| -> Vec<Module> {
        let call = format!("torch.{function}(");
        let arguments = code.split(&call).skip(1);
        let second = |rest: &str| rest.split([',', ')']).nth(1)?.trim().parse::<f64>().ok();
        arguments
            .take(MAX_CALLS)
            .map(|rest| {
                let number = second(rest).filter(|_| !parameter.is_empty());
                let numbers = number.map(|number| (parameter.to_owned(), number)).into_iter().collect();
                Module { class: class.to_owned(), numbers }
            })
            .collect()
    };
    functions.into_iter().flat_map(calls).collect()
}

/// Five pickles (magic number, version, machine, object, keys of the storages), then for every key the number of
/// elements in eight bytes and the elements.
pub(super) fn read_legacy(bytes: &[u8]) -> Result<Contents, TensorError> {
    let mut rest = bytes;
    for _ in 0..3 {
        let (_, end) = unpickle(rest)?;
        rest = &rest[end..];
    }
    let (object, end) = unpickle(rest)?;
    rest = &rest[end..];
    let (keys, end) = unpickle(rest)?;
    rest = &rest[end..];
    let mut storages = HashMap::new();
    for key in keys.texts() {
        let cut_off = || FileDefect::truncated(format!("storage {key} is cut off"));
        let size = object.storage_element(&key).map_or(4, super::Element::size);
        let (count, after) = rest.split_first_chunk::<8>().ok_or_else(cut_off)?;
        let length = usize::try_from(u64::from_le_bytes(*count)).ok().and_then(|n| n.checked_mul(size));
        let length = length.filter(|&length| length <= after.len()).ok_or_else(cut_off)?;
        storages.insert(key, &after[..length]);
        rest = &after[length..];
    }
    object.tensors("", &mut |key| storages.get(key).copied())
}

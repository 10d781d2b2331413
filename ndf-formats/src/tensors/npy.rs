//! NumPy's `.npy`: a header that is a Python dictionary, then the array.

use super::array::{array, parse_kind};
use super::pickle::unpickle;
use super::{Contents, FileDefect, TensorError};

const MAGIC: usize = 6;

/// A file with one array, which is called `array`; objects in it are named by their keys and indices alone.
pub(super) fn read_file(bytes: &[u8]) -> Result<Contents, TensorError> {
    read(bytes, "")
}

/// An array of a name. Objects in it are named by their keys and indices after that.
pub(super) fn read(bytes: &[u8], name: &str) -> Result<Contents, TensorError> {
    let cut_off = || FileDefect::truncated("the header of an array is cut off");
    let (header, data) = split(bytes).ok_or_else(cut_off)?;
    let unknown = || FileDefect::value("the header of an array has an unknown form");
    let header = Header::parse(header).ok_or_else(unknown)?;
    if header.kind.ends_with('O') {
        let (pickle, _) = unpickle(data)?;
        return pickle.tensors(name, &mut |_| None);
    }
    let name = if name.is_empty() { "array" } else { name };
    let numbers = parse_kind(&header.kind);
    let (element, swapped) =
        numbers.ok_or_else(|| TensorError::Kind { name: name.to_owned(), kind: header.kind.clone() })?;
    let tensor = array(&header.shape, element, swapped, header.by_columns, data);
    let tensor = tensor.ok_or_else(|| FileDefect::truncated(format!("array {name} is cut off")))?;
    Ok(Contents { tensors: [(name.to_owned(), tensor)].into(), ..Contents::default() })
}

/// Header and data.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let [major, _minor] = *bytes.get(MAGIC..MAGIC + 2)? else { return None };
    let (start, length) = match major {
        1 => (10, usize::from(u16::from_le_bytes(bytes.get(8..10)?.try_into().ok()?))),
        2 | 3 => (12, usize::try_from(u32::from_le_bytes(bytes.get(8..12)?.try_into().ok()?)).ok()?),
        _ => return None,
    };
    let end = usize::checked_add(start, length)?;
    Some((std::str::from_utf8(bytes.get(start..end)?).ok()?, bytes.get(end..)?))
}

/// What the dictionary says.
struct Header {
    kind: String,
    by_columns: bool,
    shape: Vec<usize>,
}

impl Header {
    fn parse(text: &str) -> Option<Self> {
        let after = |key: &str| {
            let place = text.find(&format!("'{key}'"))? + key.len() + 2;
            Some(text[place..].trim_start().strip_prefix(':')?.trim_start())
        };
        let kind = after("descr")?.strip_prefix('\'')?.split('\'').next()?.to_owned();
        let by_columns = after("fortran_order")?.starts_with("True");
        let sides = after("shape")?.strip_prefix('(')?.split(')').next()?;
        let sides = sides.split(',').map(str::trim).filter(|side| !side.is_empty());
        let shape = sides.map(|side| side.parse().ok()).collect::<Option<Vec<usize>>>()?;
        Some(Self { kind, by_columns, shape })
    }
}

//! NumPy's arrays in bytes, which lie in files of their own and in pickles.

use super::{Element, Tensor};

/// The kind of numbers NumPy calls this, and whether their bytes are in big-endian order.
pub(super) fn parse_kind(kind: &str) -> Option<(Element, bool)> {
    let (order, code) = match kind.as_bytes().first()? {
        b'<' | b'|' | b'=' => (false, &kind[1..]),
        b'>' => (true, &kind[1..]),
        _ => (false, kind),
    };
    let element = match code {
        "f2" => Element::F16,
        "f4" => Element::F32,
        "f8" => Element::F64,
        "i1" => Element::I8,
        "u1" | "b1" => Element::U8,
        "i2" => Element::I16,
        "i4" => Element::I32,
        "i8" => Element::I64,
        _ => return None,
    };
    Some((element, order))
}

/// The array of a shape in some bytes; `None` if they are fewer than it needs.
pub(super) fn array(
    shape: &[usize],
    element: Element,
    swapped: bool,
    by_columns: bool,
    data: &[u8],
) -> Option<Tensor> {
    let count = shape.iter().try_fold(1_usize, |n, &side| n.checked_mul(side))?;
    let data = data.get(..count.checked_mul(element.size())?)?;
    let values = if swapped {
        let turned: Vec<u8> =
            data.chunks_exact(element.size()).flat_map(|b| b.iter().rev().copied()).collect();
        element.numbers(&turned)
    } else {
        element.numbers(data)
    };
    let values = if by_columns && shape.len() > 1 { by_rows(shape, &values) } else { values };
    Tensor::new(shape.to_vec(), values)
}

/// Values in column-major order, brought into row-major order.
fn by_rows(shape: &[usize], values: &[f32]) -> Vec<f32> {
    let at = |mut row_major: usize| {
        let mut index = 0;
        let mut stride = values.len();
        for &side in shape.iter().rev() {
            stride /= side;
            index += (row_major % side) * stride;
            row_major /= side;
        }
        index
    };
    (0..values.len()).map(|i| values[at(i)]).collect()
}

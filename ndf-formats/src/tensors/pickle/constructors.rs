//! The constructors of tensors and arrays, carried out by hand.

use std::borrow::Cow;

use super::super::Element;
use super::{Id, Object, Pickle};

/// What calling a class or function gives; `None` if its arguments are not what it takes.
pub(super) fn call<'a>(pickle: &mut Pickle<'a>, callee: Id, arguments: Id) -> Option<Object<'a>> {
    let Object::Global(name) = &pickle.objects[callee] else { return Some(Object::Opaque) };
    let Object::Tuple(arguments) = &pickle.objects[arguments] else { return None };
    let argument = |i: usize| arguments.get(i).map(|&id| &pickle.objects[id]);
    match name.as_str() {
        "collections.OrderedDict" => Some(match argument(0) {
            Some(Object::List(items)) => Object::Dictionary(pairs(pickle, items)?),
            _ => Object::Dictionary(Vec::new()),
        }),
        // Storage, offset, shape, strides.
        "torch._utils._rebuild_tensor" | "torch._utils._rebuild_tensor_v2" => {
            let storage = *arguments.first()?;
            let Object::Storage { .. } = pickle.objects[storage] else { return None };
            let offset = sizes(pickle, arguments.get(1..2)?)?[0];
            let [shape, strides] = [2, 3].map(|i| match argument(i) {
                Some(Object::Tuple(ids)) => sizes(pickle, ids),
                _ => None,
            });
            Some(Object::View { storage, offset, shape: shape?, strides: strides? })
        }
        // A parameter is its tensor.
        "torch._utils._rebuild_parameter" => argument(0).cloned(),
        "torch.Size" => argument(0).cloned(),
        "numpy.dtype" => match argument(0)? {
            Object::Text(code) => Some(Object::Kind { code: (*code).to_owned(), big_endian: false }),
            _ => Some(Object::Opaque),
        },
        "numpy.core.multiarray._reconstruct" | "numpy._core.multiarray._reconstruct" => {
            // Filled by what follows.
            Some(Object::Array { shape: vec![0], kind: callee, by_columns: false, data: callee })
        }
        // Numbers in the optimiser's state.
        "numpy.core.multiarray.scalar" | "numpy._core.multiarray.scalar" => Some(Object::Opaque),
        // Protocol 2 has no bytes: they are text of which every character is a byte.
        "_codecs.encode" => match argument(0)? {
            Object::Text(text) => {
                let bytes: Option<Vec<u8>> = text.chars().map(|c| u8::try_from(u32::from(c)).ok()).collect();
                Some(Object::Bytes(Cow::Owned(bytes?)))
            }
            _ => None,
        },
        name => {
            let class = name.to_owned();
            pickle.foreign.push(class.clone());
            Some(Object::Instance { class, state: None })
        }
    }
}

/// Gives a new object its state; `None` if that does not fit.
pub(super) fn build(pickle: &mut Pickle<'_>, target: Id, state: Id) -> Option<()> {
    let parts: &[Id] = match &pickle.objects[state] {
        Object::Tuple(parts) => parts,
        _ => &[],
    };
    let filled = match &pickle.objects[target] {
        // Version, shape, kind, order, data.
        Object::Array { .. } => {
            let &[_, shape, kind, order, data] = parts else { return None };
            let Object::Tuple(shape) = &pickle.objects[shape] else { return None };
            let by_columns = matches!(pickle.objects[order], Object::Integer(1));
            Object::Array { shape: sizes(pickle, shape)?, kind, by_columns, data }
        }
        // Version, order of bytes, …
        Object::Kind { code, .. } => {
            let order = parts.get(1).map(|&id| &pickle.objects[id]);
            Object::Kind { code: code.clone(), big_endian: matches!(order, Some(Object::Text(">"))) }
        }
        Object::Instance { class, .. } => Object::Instance { class: class.clone(), state: Some(state) },
        _ => return Some(()),
    };
    pickle.objects[target] = filled;
    Some(())
}

/// The storage a persistent name of PyTorch's means: `('storage', class, key, place, count)`.
pub(super) fn persistent<'a>(pickle: &Pickle<'a>, id: Id) -> Option<Object<'a>> {
    let Object::Tuple(parts) = &pickle.objects[id] else { return None };
    let &[what, class, key, ..] = parts.as_slice() else { return None };
    let (Object::Text("storage"), Object::Global(class), Object::Text(key)) =
        (&pickle.objects[what], &pickle.objects[class], &pickle.objects[key])
    else {
        return None;
    };
    let element = match class.strip_prefix("torch.")? {
        "HalfStorage" => Some(Element::F16),
        "BFloat16Storage" => Some(Element::Bf16),
        "FloatStorage" => Some(Element::F32),
        "DoubleStorage" => Some(Element::F64),
        "CharStorage" => Some(Element::I8),
        "ByteStorage" | "BoolStorage" => Some(Element::U8),
        "ShortStorage" => Some(Element::I16),
        "IntStorage" => Some(Element::I32),
        "LongStorage" => Some(Element::I64),
        _ => None,
    };
    Some(Object::Storage { key: (*key).to_owned(), element })
}

fn pairs(pickle: &Pickle<'_>, items: &[Id]) -> Option<Vec<(Id, Id)>> {
    let pair = |&id: &Id| match &pickle.objects[id] {
        Object::Tuple(pair) | Object::List(pair) if pair.len() == 2 => Some((pair[0], pair[1])),
        _ => None,
    };
    items.iter().map(pair).collect()
}

/// Numbers that are not negative.
fn sizes(pickle: &Pickle<'_>, ids: &[Id]) -> Option<Vec<usize>> {
    let size = |&id: &Id| match pickle.objects[id] {
        Object::Integer(n) => usize::try_from(n).ok(),
        _ => None,
    };
    ids.iter().map(size).collect()
}

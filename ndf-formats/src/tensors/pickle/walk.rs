//! From the graph of objects to named tensors.

use super::super::array::{array, parse_kind};
use super::super::{Contents, Element, FileDefect, Module, Tensor, TensorError};
use super::{Id, Object, Pickle};

/// Containers in containers that are looked into.
const DEEPEST: usize = 32;
/// The most objects that are looked at: a list may hold another many times, and so on.
const MOST_VISITS: usize = 1 << 20;
/// The most objects of classes that are remembered.
const MAX_MODULES: usize = 1 << 12;
/// The most numbers of all tensors, in sizes of the largest storage or array: views may share one.
const MOST_SHARING: usize = 64;

/// Finds the bytes of a storage.
type Storages<'s> = &'s mut dyn FnMut(&str) -> Option<&'s [u8]>;

impl Pickle<'_> {
    /// Keys of all storages that are named.
    #[cfg(feature = "zip")]
    pub(in super::super) fn storage_keys(&self) -> Vec<String> {
        let mut keys: Vec<String> = self
            .objects
            .iter()
            .filter_map(|object| match object {
                Object::Storage { key, element: Some(_) } => Some(key.clone()),
                _ => None,
            })
            .collect();
        keys.sort_unstable();
        keys.dedup();
        keys
    }

    /// What a storage holds.
    pub(in super::super) fn storage_element(&self, name: &str) -> Option<Element> {
        self.objects.iter().find_map(|object| match object {
            Object::Storage { key, element } if key == name => *element,
            _ => None,
        })
    }

    /// The texts of a list.
    pub(in super::super) fn texts(&self) -> Vec<String> {
        let Object::List(items) = &self.objects[self.root] else { return Vec::new() };
        let text = |&id: &Id| match self.objects[id] {
            Object::Text(text) => Some(text.to_owned()),
            _ => None,
        };
        items.iter().filter_map(text).collect()
    }

    /// All tensors, named by the keys and indices that lead to them, after `name`.
    pub(in super::super) fn tensors<'s>(
        &self,
        name: &str,
        storages: Storages<'s>,
    ) -> Result<Contents, TensorError> {
        let mut walk =
            Walk { pickle: self, storages, contents: Contents::default(), visits: 0, numbers: 0, largest: 0 };
        walk.visit(self.root, name, 0)?;
        walk.contents.foreign.clone_from(&self.foreign);
        Ok(walk.contents)
    }
}

struct Walk<'p, 's> {
    pickle: &'p Pickle<'p>,
    storages: Storages<'s>,
    contents: Contents,
    visits: usize,
    numbers: usize,
    largest: usize,
}

impl Walk<'_, '_> {
    fn visit(&mut self, id: Id, path: &str, depth: usize) -> Result<(), TensorError> {
        self.visits += 1;
        if self.visits > MOST_VISITS {
            return Err(FileDefect::too_large("it has too many objects").into());
        }
        if depth > DEEPEST {
            return Ok(());
        }
        let pickle = self.pickle;
        let join = |key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        match &pickle.objects[id] {
            Object::List(items) | Object::Tuple(items) => {
                for (i, &item) in items.iter().enumerate() {
                    self.visit(item, &join(&i.to_string()), depth + 1)?;
                }
            }
            Object::Dictionary(entries) => {
                for &(key, value) in entries {
                    let key = match &pickle.objects[key] {
                        Object::Text(text) => (*text).to_owned(),
                        Object::Integer(number) => number.to_string(),
                        _ => continue,
                    };
                    self.visit(value, &join(&key), depth + 1)?;
                }
            }
            Object::Instance { class, state: Some(state) } => self.instance(class, *state, path, depth)?,
            Object::View { storage, offset, shape, strides } => {
                self.view(*storage, *offset, shape, strides, path)?;
            }
            Object::Array { shape, kind, by_columns, data } => {
                self.array(shape, *kind, *by_columns, *data, path, depth)?;
            }
            _ => {}
        }
        Ok(())
    }

    /// What an object holds. A module of PyTorch has its tensors and modules in dictionaries of these names, which leave
    /// no trace in the names of a `state_dict`; other attributes of modules are of no use but as numbers.
    fn instance(&mut self, class: &str, state: Id, path: &str, depth: usize) -> Result<(), TensorError> {
        let pickle = self.pickle;
        let Object::Dictionary(entries) = &pickle.objects[state] else {
            return self.visit(state, path, depth + 1);
        };
        let named = |id: Id| match pickle.objects[id] {
            Object::Text(text) => Some(text),
            _ => None,
        };
        let is_part = |name: &str| matches!(name, "_parameters" | "_buffers" | "_modules");
        let is_module = entries.iter().any(|&(key, _)| named(key).is_some_and(is_part));
        let number = |&(key, value): &(Id, Id)| {
            let number = match pickle.objects[value] {
                Object::Integer(number) => number as f64,
                Object::Real(number) => number,
                _ => return None,
            };
            Some((named(key)?.to_owned(), number))
        };
        if self.contents.modules.len() < MAX_MODULES {
            let numbers = entries.iter().filter_map(number).collect();
            self.contents.modules.push(Module { class: class.to_owned(), numbers });
        }
        if !is_module {
            return self.visit(state, path, depth + 1);
        }
        for &(key, value) in entries {
            if named(key).is_some_and(is_part) {
                self.visit(value, path, depth + 1)?;
            }
        }
        Ok(())
    }

    fn view(
        &mut self,
        storage: Id,
        offset: usize,
        shape: &[usize],
        strides: &[usize],
        path: &str,
    ) -> Result<(), TensorError> {
        let Object::Storage { key, element } = &self.pickle.objects[storage] else { return Ok(()) };
        let Some(element) = *element else {
            let kind = "numbers of an unknown kind".to_owned();
            return Err(TensorError::Kind { name: path.to_owned(), kind });
        };
        let missing = || FileDefect::missing(format!("storage {key} is missing"));
        let bytes = (self.storages)(key).ok_or_else(missing)?;
        let stored = bytes.len() / element.size();
        let count = shape.iter().try_fold(1_usize, |n, &side| n.checked_mul(side));
        // The last element, for shapes without an empty side.
        let last = shape.iter().zip(strides).try_fold(offset, |at, (&side, &stride)| {
            side.saturating_sub(1).checked_mul(stride).and_then(|way| at.checked_add(way))
        });
        let fits = shape.len() == strides.len()
            && count.is_some_and(|n| n <= stored && (n == 0 || last.is_some_and(|last| last < stored)));
        let (Some(count), true) = (count, fits) else {
            return Err(FileDefect::truncated(format!("tensor {path} reaches beyond its storage")).into());
        };
        self.account(path, count, stored)?;
        let number = |i: usize| {
            let (mut rest, mut at) = (i, offset);
            for (&side, &stride) in shape.iter().zip(strides).rev() {
                at += rest % side * stride;
                rest /= side;
            }
            element.number(&bytes[at * element.size()..])
        };
        self.insert(path, Tensor::new(shape.to_vec(), (0..count).map(number).collect()));
        Ok(())
    }

    fn array(
        &mut self,
        shape: &[usize],
        kind: Id,
        by_columns: bool,
        data: Id,
        path: &str,
        depth: usize,
    ) -> Result<(), TensorError> {
        let Object::Kind { code, big_endian } = &self.pickle.objects[kind] else { return Ok(()) };
        match &self.pickle.objects[data] {
            // An array of objects.
            Object::List(_) => self.visit(data, path, depth + 1),
            Object::Bytes(bytes) => {
                let Some((element, _)) = parse_kind(code) else {
                    return Err(TensorError::Kind { name: path.to_owned(), kind: code.clone() });
                };
                let tensor = array(shape, element, *big_endian, by_columns, bytes);
                let tensor =
                    tensor.ok_or_else(|| FileDefect::truncated(format!("array {path} is cut off")))?;
                self.account(path, tensor.values.len(), tensor.values.len())?;
                self.insert(path, Some(tensor));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Refuses to make many copies of the same numbers.
    fn account(&mut self, path: &str, count: usize, stored: usize) -> Result<(), TensorError> {
        self.largest = self.largest.max(stored);
        self.numbers += count;
        if self.numbers > MOST_SHARING * self.largest.max(1 << 16) {
            let text = format!("its tensors repeat the same numbers too often, at {path}");
            return Err(FileDefect::too_large(text).into());
        }
        Ok(())
    }

    fn insert(&mut self, path: &str, tensor: Option<Tensor>) {
        if let Some(tensor) = tensor {
            self.contents.tensors.insert(path.to_owned(), tensor);
        }
    }
}

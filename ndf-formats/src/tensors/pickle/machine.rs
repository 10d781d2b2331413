//! The stack machine.

use std::borrow::Cow;
use std::collections::HashMap;

use super::constructors::{build, call, persistent};
use super::{Id, Object, Pickle, PickleError};

/// Reads one pickle; also returns where it ends.
pub(in super::super) fn unpickle(bytes: &[u8]) -> Result<(Pickle<'_>, usize), PickleError> {
    let mut machine = Machine {
        bytes,
        at: 0,
        stack: Vec::new(),
        marks: Vec::new(),
        memo: HashMap::new(),
        pickle: Pickle { objects: Vec::new(), root: 0, foreign: Vec::new() },
    };
    while !machine.step()? {}
    machine.pickle.root = machine.pop()?;
    machine.pickle.foreign.sort_unstable();
    machine.pickle.foreign.dedup();
    Ok((machine.pickle, machine.at))
}

struct Machine<'a> {
    bytes: &'a [u8],
    at: usize,
    stack: Vec<Id>,
    /// Heights of the stack.
    marks: Vec<usize>,
    memo: HashMap<u32, Id>,
    pickle: Pickle<'a>,
}

impl<'a> Machine<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], PickleError> {
        let end = self.at.checked_add(count).filter(|&end| end <= self.bytes.len());
        let end = end.ok_or(PickleError::CutOff)?;
        let taken = &self.bytes[self.at..end];
        self.at = end;
        Ok(taken)
    }

    /// An unsigned number of so many bytes, least first.
    fn unsigned(&mut self, count: usize) -> Result<usize, PickleError> {
        let bytes = self.take(count)?;
        let number = bytes.iter().rev().fold(0_u64, |n, &b| n << 8 | u64::from(b));
        usize::try_from(number).map_err(|_| PickleError::CutOff)
    }

    /// As many bytes as a number of `width` bytes says.
    fn counted(&mut self, width: usize) -> Result<&'a [u8], PickleError> {
        let count = self.unsigned(width)?;
        self.take(count)
    }

    fn text(&mut self, width: usize) -> Result<&'a str, PickleError> {
        let at = self.at;
        std::str::from_utf8(self.counted(width)?).map_err(|_| PickleError::Inconsistent(at))
    }

    fn line(&mut self) -> Result<&'a str, PickleError> {
        let at = self.at;
        let length = self.bytes[at..].iter().position(|&b| b == b'\n').ok_or(PickleError::CutOff)?;
        let line = self.take(length + 1)?;
        std::str::from_utf8(&line[..length]).map_err(|_| PickleError::Inconsistent(at))
    }

    fn wrong(&self) -> PickleError {
        PickleError::Inconsistent(self.at)
    }

    fn push(&mut self, object: Object<'a>) {
        self.stack.push(self.pickle.objects.len());
        self.pickle.objects.push(object);
    }

    fn pop(&mut self) -> Result<Id, PickleError> {
        self.stack.pop().ok_or_else(|| self.wrong())
    }

    fn top(&self) -> Result<Id, PickleError> {
        self.stack.last().copied().ok_or_else(|| self.wrong())
    }

    fn pop_some(&mut self, count: usize) -> Result<Vec<Id>, PickleError> {
        let from = self.stack.len().checked_sub(count).ok_or_else(|| self.wrong())?;
        Ok(self.stack.split_off(from))
    }

    /// What was pushed since the last mark.
    fn pop_marked(&mut self) -> Result<Vec<Id>, PickleError> {
        let from = self.marks.pop().filter(|&from| from <= self.stack.len());
        let from = from.ok_or_else(|| self.wrong())?;
        Ok(self.stack.split_off(from))
    }

    fn append(&mut self, items: Vec<Id>) -> Result<(), PickleError> {
        let list = self.top()?;
        match &mut self.pickle.objects[list] {
            Object::List(list) => list.extend(items),
            Object::Opaque | Object::Instance { .. } => {}
            _ => return Err(self.wrong()),
        }
        Ok(())
    }

    fn set_items(&mut self, items: &[Id]) -> Result<(), PickleError> {
        let dictionary = self.top()?;
        match &mut self.pickle.objects[dictionary] {
            Object::Dictionary(entries) => {
                entries.extend(items.chunks_exact(2).map(|pair| (pair[0], pair[1])));
            }
            Object::Opaque | Object::Instance { .. } => {}
            _ => return Err(self.wrong()),
        }
        Ok(())
    }

    fn memoize(&mut self, key: usize) -> Result<(), PickleError> {
        let (key, top) = (u32::try_from(key).map_err(|_| self.wrong())?, self.top()?);
        self.memo.insert(key, top);
        Ok(())
    }

    fn recall(&mut self, key: usize) -> Result<(), PickleError> {
        let found = u32::try_from(key).ok().and_then(|key| self.memo.get(&key));
        self.stack.push(*found.ok_or_else(|| self.wrong())?);
        Ok(())
    }

    /// Carries out an instruction; true at the end of the pickle.
    fn step(&mut self) -> Result<bool, PickleError> {
        let place = self.at;
        match self.take(1)?[0] {
            b'.' => return Ok(true),
            // Protocol and frames: nothing to do.
            0x80 => self.unsigned(1).map(drop)?,
            0x95 => self.unsigned(8).map(drop)?,
            b'(' => self.marks.push(self.stack.len()),
            b'0' => self.pop().map(drop)?,
            b'1' => self.pop_marked().map(drop)?,
            b'2' => self.stack.push(self.top()?),
            // Plain values.
            b'N' => self.push(Object::Opaque),
            0x88 => self.push(Object::Integer(1)),
            0x89 => self.push(Object::Integer(0)),
            b'J' => {
                let number = self.unsigned(4)? as u32;
                self.push(Object::Integer(i64::from(number.cast_signed())));
            }
            b'K' => {
                let number = self.unsigned(1)?;
                self.push(Object::Integer(number as i64));
            }
            b'M' => {
                let number = self.unsigned(2)?;
                self.push(Object::Integer(number as i64));
            }
            0x8a => {
                let bytes = self.counted(1)?;
                self.push(long(bytes));
            }
            b'G' => {
                let bytes = self.take(8)?.iter().fold(0, |n, &b| n << 8 | u64::from(b));
                self.push(Object::Real(f64::from_bits(bytes)));
            }
            code @ (b'X' | 0x8c | 0x8d) => {
                let text = self.text(width(code, b'X', 0x8c))?;
                self.push(Object::Text(text));
            }
            code @ (b'B' | b'C' | 0x8e | 0x96 | b'T' | b'U') => {
                let width = match code {
                    b'B' | b'T' => 4,
                    b'C' | b'U' => 1,
                    _ => 8,
                };
                let bytes = self.counted(width)?;
                self.push(Object::Bytes(Cow::Borrowed(bytes)));
            }
            // Containers.
            b']' => self.push(Object::List(Vec::new())),
            b'}' => self.push(Object::Dictionary(Vec::new())),
            b')' => self.push(Object::Tuple(Vec::new())),
            b't' => {
                let items = self.pop_marked()?;
                self.push(Object::Tuple(items));
            }
            b'l' => {
                let items = self.pop_marked()?;
                self.push(Object::List(items));
            }
            code @ (0x85..=0x87) => {
                let items = self.pop_some(usize::from(code - 0x84))?;
                self.push(Object::Tuple(items));
            }
            b'a' => {
                let item = self.pop()?;
                self.append(vec![item])?;
            }
            b'e' => {
                let items = self.pop_marked()?;
                self.append(items)?;
            }
            b's' => {
                let pair = self.pop_some(2)?;
                self.set_items(&pair)?;
            }
            b'u' => {
                let items = self.pop_marked()?;
                self.set_items(&items)?;
            }
            // Sets hold no tensors.
            0x8f => self.push(Object::Opaque),
            0x90 => self.pop_marked().map(drop)?,
            0x91 => {
                self.pop_marked()?;
                self.push(Object::Opaque);
            }
            // Memory.
            b'q' => self.unsigned(1).and_then(|key| self.memoize(key))?,
            b'r' => self.unsigned(4).and_then(|key| self.memoize(key))?,
            0x94 => self.memoize(self.memo.len())?,
            b'h' => self.unsigned(1).and_then(|key| self.recall(key))?,
            b'j' => self.unsigned(4).and_then(|key| self.recall(key))?,
            // What would call Python.
            b'c' => {
                let name = format!("{}.{}", self.line()?, self.line()?);
                self.push(Object::Global(name));
            }
            0x93 => {
                let names = self.pop_some(2)?;
                let [Object::Text(module), Object::Text(name)] =
                    [&self.pickle.objects[names[0]], &self.pickle.objects[names[1]]]
                else {
                    return Err(self.wrong());
                };
                let name = format!("{module}.{name}");
                self.push(Object::Global(name));
            }
            b'R' | 0x81 => {
                let parts = self.pop_some(2)?;
                let made = call(&mut self.pickle, parts[0], parts[1]).ok_or_else(|| self.wrong())?;
                self.push(made);
            }
            0x92 => {
                let parts = self.pop_some(3)?;
                let made = call(&mut self.pickle, parts[0], parts[1]).ok_or_else(|| self.wrong())?;
                self.push(made);
            }
            b'b' => {
                let state = self.pop()?;
                let target = self.top()?;
                build(&mut self.pickle, target, state).ok_or_else(|| self.wrong())?;
            }
            b'Q' => {
                let id = self.pop()?;
                let made = persistent(&self.pickle, id).ok_or_else(|| self.wrong())?;
                self.push(made);
            }
            other => return Err(PickleError::Instruction(other, place)),
        }
        Ok(false)
    }
}

/// Bytes of the length of a text: four, one or eight.
fn width(code: u8, four: u8, one: u8) -> usize {
    if code == four {
        4
    } else if code == one {
        1
    } else {
        8
    }
}

/// A whole number in two's complement, least byte first; a longer one than 64 bits stays bytes.
fn long(bytes: &[u8]) -> Object<'_> {
    if bytes.len() > 8 {
        return Object::Bytes(Cow::Borrowed(bytes));
    }
    let fill = if bytes.last().is_some_and(|b| b & 0x80 != 0) { 0xff } else { 0 };
    let mut all = [fill; 8];
    all[..bytes.len()].copy_from_slice(bytes);
    Object::Integer(i64::from_le_bytes(all))
}

//! Python's pickles, read without running anything.
//!
//! A pickle is a program for a stack machine that may call any function of Python. This machine knows the
//! instructions, but calls nothing: the few constructors that tensors and arrays are made of
//! ([`constructors`]) are carried out by hand, and everything else becomes an opaque object whose class is
//! remembered. PyTorch's own checkpoints hold such objects beside the weights (numbers of NumPy in the optimiser's
//! state, for one), so that refusing them would refuse the network.
//!
//! Crates that read PyTorch files exist (candle's, burn's `pytorch-reader`); the arrays of objects that the first
//! NeRF and others are kept in need a pickle of NumPy's, so that there would be two ways. This is one.

mod constructors;
mod machine;
mod walk;

use super::Element;
pub(super) use machine::unpickle;

/// What is wrong with a pickle.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum PickleError {
    /// It ends in the middle.
    #[error("the pickle is cut off")]
    CutOff,
    /// An instruction that no writer of tensors uses, or none at all.
    #[error("the pickle has an unknown instruction {0:#04x} at byte {1}")]
    Instruction(u8, usize),
    /// An instruction finds something else on the stack than it needs.
    #[error("the pickle is inconsistent at byte {0}")]
    Inconsistent(usize),
}

/// Number of an object of a pickle.
type Id = usize;

/// An object of a pickle.
#[derive(Clone, Debug)]
enum Object<'a> {
    Integer(i64),
    Real(f64),
    Text(&'a str),
    Bytes(std::borrow::Cow<'a, [u8]>),
    List(Vec<Id>),
    Tuple(Vec<Id>),
    Dictionary(Vec<(Id, Id)>),
    /// A class or function by its full name.
    Global(String),
    /// Numbers that PyTorch keeps beside the pickle.
    Storage {
        key: String,
        element: Option<Element>,
    },
    /// A view of a storage; strides in elements.
    View {
        storage: Id,
        offset: usize,
        shape: Vec<usize>,
        strides: Vec<usize>,
    },
    /// NumPy's name of a kind of numbers.
    Kind {
        code: String,
        big_endian: bool,
    },
    /// An array of NumPy.
    Array {
        shape: Vec<usize>,
        kind: Id,
        by_columns: bool,
        data: Id,
    },
    /// What a class that is not run would make, of which the state is known.
    Instance {
        class: String,
        state: Option<Id>,
    },
    /// Of no use here: a set, or what a class or function would make that is not known and not called.
    Opaque,
}

/// A pickle as a graph of objects.
#[derive(Clone, Debug)]
pub(super) struct Pickle<'a> {
    objects: Vec<Object<'a>>,
    root: Id,
    /// Full names of what would have been called and was not.
    foreign: Vec<String>,
}

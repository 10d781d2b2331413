//! Visitors through which `serde-ply` hands over the rows of one element, whatever their properties.

use std::fmt;

use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use serde_ply::ScalarType;

/// Bytes of a scalar in a binary file.
pub(super) fn size_of(kind: ScalarType) -> usize {
    match kind {
        ScalarType::I8 | ScalarType::U8 => 1,
        ScalarType::I16 | ScalarType::U16 => 2,
        ScalarType::I32 | ScalarType::U32 | ScalarType::F32 => 4,
        ScalarType::F64 => 8,
    }
}

/// One row: the scalars by the number of their property (0 for lists), and the list that was asked for.
#[derive(Default)]
pub(super) struct Row {
    pub(super) scalars: Vec<f64>,
    pub(super) list: Vec<f64>,
}

/// What is done with a row; the error says what is wrong with it.
type Each<'a> = &'a mut dyn FnMut(&Row) -> Result<(), String>;

/// What is wanted of the rows of an element; by default nothing.
#[derive(Default)]
pub(super) struct Columns<'a> {
    /// The property whose list is wanted.
    pub(super) list: Option<usize>,
    /// Called for every row.
    pub(super) each: Option<Each<'a>>,
}

/// Reads one element; `row` counts the rows that were read completely.
pub(super) struct Element<'a, 'b> {
    pub(super) columns: &'a mut Columns<'b>,
    pub(super) properties: usize,
    pub(super) row: &'a mut usize,
}

impl<'de> Visitor<'de> for Element<'_, '_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("an element")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        // The reader stands before the element; its name need not be asked for.
        map.next_value_seed(self)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut rows: A) -> Result<(), A::Error> {
        let mut row = Row { scalars: vec![0.0; self.properties], list: Vec::new() };
        while rows.next_element_seed(RowSeed { row: &mut row, list: self.columns.list })?.is_some() {
            if let Some(each) = &mut self.columns.each {
                each(&row).map_err(A::Error::custom)?;
            }
            *self.row += 1;
        }
        Ok(())
    }
}

impl<'de> DeserializeSeed<'de> for Element<'_, '_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, rows: D) -> Result<(), D::Error> {
        rows.deserialize_seq(self)
    }
}

struct RowSeed<'a> {
    row: &'a mut Row,
    list: Option<usize>,
}

impl<'de> DeserializeSeed<'de> for RowSeed<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, row: D) -> Result<(), D::Error> {
        row.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for RowSeed<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a row")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut properties: A) -> Result<(), A::Error> {
        for (i, scalar) in self.row.scalars.iter_mut().enumerate() {
            if properties.next_key::<IgnoredAny>()?.is_none() {
                break;
            }
            let list = (self.list == Some(i)).then_some(&mut self.row.list);
            properties.next_value_seed(Value { scalar, list })?;
        }
        // Ends the map: the visitor must have seen that there is nothing more.
        properties.next_key::<IgnoredAny>().map(|_| ())
    }
}

/// A property of a row: a number, or a list that is kept or skipped.
struct Value<'a> {
    scalar: &'a mut f64,
    list: Option<&'a mut Vec<f64>>,
}

impl<'de> DeserializeSeed<'de> for Value<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, value: D) -> Result<(), D::Error> {
        value.deserialize_any(self)
    }
}

/// Visits numbers of every type as `f64`, in which all of PLY's types fit.
macro_rules! visit_numbers {
    ($($visit:ident: $number:ty),*) => {
        $(fn $visit<E: Error>(self, number: $number) -> Result<(), E> {
            *self.scalar = f64::from(number);
            Ok(())
        })*
    };
}

impl<'de> Visitor<'de> for Value<'_> {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a number or a list of numbers")
    }

    visit_numbers!(
        visit_i8: i8, visit_u8: u8, visit_i16: i16, visit_u16: u16, visit_i32: i32, visit_u32: u32,
        visit_f32: f32, visit_f64: f64
    );

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<(), A::Error> {
        let Some(list) = self.list else {
            while items.next_element::<IgnoredAny>()?.is_some() {}
            return Ok(());
        };
        list.clear();
        let mut item = 0.0;
        while items.next_element_seed(Value { scalar: &mut item, list: None })?.is_some() {
            list.push(item);
        }
        Ok(())
    }
}

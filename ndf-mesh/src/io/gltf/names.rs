//! Names of scalars. Attributes of glTF that no specification names begin with an underscore and are in upper case; values
//! are finite. What is lost by that stands in the `extras` of a primitive: for each attribute that needs it the `name`, and
//! the values that stand for what is `missing` (NaN) and for what is `infinite`.

use std::collections::{BTreeMap, HashSet};

use serde_json::{Map, Value, json};

use super::super::VertexScalars;

/// Key of the extras of a primitive.
const EXTRAS: &str = "scalars";

/// What stands for values that are not finite: values beyond all others, but so near that tools which round a scalar to
/// parts of its range keep it.
pub(super) struct StandIns {
    /// For NaN, and for the infinity below.
    missing: f32,
    /// For infinity.
    infinite: f32,
}

impl StandIns {
    pub(super) fn of(values: &[f32]) -> Self {
        let finite = values.iter().copied().filter(|x| x.is_finite());
        let (low, high) = finite.fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        let (low, high) = if low > high { (0.0, 0.0) } else { (low, high) };
        let reach = (high - low).max(low.abs()).max(high.abs());
        let reach = if reach > 0.0 { reach } else { 1.0 };
        Self { missing: (low - reach).max(f32::MIN), infinite: (high + reach).min(f32::MAX) }
    }

    /// A value as a file may have it.
    pub(super) fn finite(&self, value: f32) -> f32 {
        match value {
            f32::INFINITY => self.infinite,
            value if value.is_finite() => value,
            _ => self.missing,
        }
    }
}

/// A scalar in a file.
#[derive(Debug)]
pub(super) struct Stored {
    pub(super) name: String,
    pub(super) accessor: u32,
    missing: Option<f32>,
    infinite: Option<f32>,
}

impl Stored {
    /// The value that is meant by one of the file.
    pub(super) fn value(&self, value: f32) -> f32 {
        match Some(value) {
            value if value == self.missing => f32::NAN,
            value if value == self.infinite => f32::INFINITY,
            _ => value,
        }
    }
}

/// The attributes of a primitive that may be scalars, in the order of their accessors.
pub(super) fn stored(attributes: &BTreeMap<String, u32>, extras: &Value) -> Vec<Stored> {
    let stored = |(attribute, &accessor): (&String, &u32)| {
        let bare = attribute.strip_prefix('_').filter(|bare| !bare.is_empty())?;
        let said = &extras[EXTRAS][attribute];
        let name = said["name"].as_str().map_or_else(|| bare.to_lowercase(), str::to_owned);
        let value = |key: &str| said[key].as_f64().map(|x| x as f32);
        Some(Stored { name, accessor, missing: value("missing"), infinite: value("infinite") })
    };
    let mut all: Vec<Stored> = attributes.iter().filter_map(stored).collect();
    all.sort_by_key(|stored| stored.accessor);
    all
}

/// The attribute of each scalar, and the extras of a primitive that has them.
pub(super) fn attributes(scalars: &[VertexScalars]) -> (Vec<String>, Option<Value>) {
    let mut taken = HashSet::new();
    let mut extras = Map::new();
    let attributes = scalars.iter().map(|scalar| {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c.to_ascii_uppercase() } else { '_' };
        let wanted: String = std::iter::once('_').chain(scalar.name.chars().map(plain)).collect();
        let numbered = (2_u64..).map(|i| format!("{wanted}_{i}"));
        let mut free = std::iter::once(wanted.clone()).chain(numbered).filter(|name| !taken.contains(name));
        let attribute = free.next().expect("there are more numbers than scalars");
        taken.insert(attribute.clone());
        let mut said = Map::new();
        if attribute[1..].to_lowercase() != scalar.name {
            said.insert("name".to_owned(), scalar.name.clone().into());
        }
        let stand_ins = StandIns::of(&scalar.values);
        for (key, stands_for) in [("missing", stand_ins.missing), ("infinite", stand_ins.infinite)] {
            if scalar.values.iter().any(|&x| !x.is_finite() && stand_ins.finite(x) == stands_for) {
                said.insert(key.to_owned(), f64::from(stands_for).into());
            }
        }
        if !said.is_empty() {
            extras.insert(attribute.clone(), said.into());
        }
        attribute
    });
    let attributes = attributes.collect();
    let extras = (!extras.is_empty()).then(|| json!({ EXTRAS: extras }));
    (attributes, extras)
}

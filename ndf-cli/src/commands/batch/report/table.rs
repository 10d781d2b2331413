//! All rows as a table: what they have in common, and every number, word and truth value of their results as a column.

use std::collections::BTreeMap;
use std::fs;
use std::path::PathBuf;

use ndf_mesh::io::atomic_write;
use serde_json::{Map, Value};

use super::super::plan::Places;
use super::super::recipe::Recipe;
use super::super::rows::{Row, Status};
use crate::output::Failure;

/// All rows.
#[derive(Debug)]
pub(super) struct Table {
    /// What they have in common.
    pub records: Vec<Record>,
    /// The columns of the results, by name, with their places in [`Record::values`].
    pub columns: BTreeMap<String, usize>,
}

/// A row without its result.
#[derive(Debug)]
pub(super) struct Record {
    /// The row, in which the result is not.
    pub row: Row,
    /// Bytes of the output.
    pub bytes: Option<u64>,
    /// How wrong the result is.
    pub error: Option<f64>,
    /// Values of the result, with the columns they are in.
    pub values: Vec<(usize, Value)>,
}

impl Table {
    /// The table of these lines.
    ///
    /// # Errors
    /// If a line is no row.
    pub(super) fn of<'a>(
        lines: impl Iterator<Item = &'a [u8]>,
        recipe: &Recipe,
        places: &Places,
    ) -> Result<Self, Failure> {
        let mut columns = BTreeMap::new();
        let mut records = Vec::new();
        for line in lines {
            let mut row: Row = serde_json::from_slice(line)?;
            let result = row.result.take().unwrap_or_default();
            let error = recipe.error.and_then(|(key, _)| result.get(key)?.as_f64());
            let output = row.output.as_ref().map(|name| places.folder().join(name));
            let bytes = output.and_then(|path| fs::metadata(path).ok()).map(|metadata| metadata.len());
            let mut values = Vec::new();
            flatten(result, "", &mut |name, value| {
                let next = columns.len();
                values.push((*columns.entry(name).or_insert(next), value));
            });
            records.push(Record { row, bytes, error, values });
        }
        Ok(Self { records, columns })
    }

    /// The values of a column, in its rows.
    #[cfg(any(test, feature = "parquet"))]
    pub(super) fn values(&self, column: usize) -> impl Iterator<Item = Option<&Value>> {
        let of = move |record: &'_ Record| record.values.iter().position(|(place, _)| *place == column);
        self.records.iter().map(move |record| of(record).map(|k| &record.values[k].1))
    }

    /// Writes the table as comma-separated values, and tells where. Columns of results begin with `result.`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub(super) fn write_csv(&self, path: PathBuf) -> Result<PathBuf, Failure> {
        let written = atomic_write(&path, |out| {
            let mut csv = csv::Writer::from_writer(out);
            let names = self.columns.keys().map(|name| format!("result.{name}"));
            csv.write_record(COMMON.iter().map(|(name, _)| (*name).to_owned()).chain(names))?;
            for record in &self.records {
                let common = COMMON.iter().map(|(_, value)| value(record));
                let mut cells: Vec<&Value> = vec![&Value::Null; self.columns.len()];
                record.values.iter().for_each(|(place, value)| cells[*place] = value);
                let own = self.columns.values().map(|&place| cells[place].clone());
                csv.write_record(common.chain(own).map(cell))?;
            }
            csv.flush()
        });
        match written {
            Ok(()) => Ok(path),
            Err(e) => Err(Failure::new(format!("cannot write {}: {e}", path.display()))),
        }
    }
}

/// A column that all rows have: its name and its value in a row.
type Common = (&'static str, fn(&Record) -> Value);

/// The columns that all rows have.
pub(super) const COMMON: [Common; 11] = [
    ("id", |record| record.row.id.clone().into()),
    ("input", |record| record.row.input.clone().into()),
    ("input_sha256", |record| record.row.input_sha256.clone().into()),
    ("status", |record| record.row.status.name().into()),
    ("message", |record| record.row.message.clone().into()),
    ("exit_code", |record| record.row.exit_code.into()),
    ("seconds", |record| record.row.seconds.into()),
    ("peak_bytes", |record| record.row.peak_bytes.into()),
    ("warnings", |record| record.row.warnings.len().into()),
    ("output", |record| record.row.output.clone().into()),
    ("output_bytes", |record| record.bytes.into()),
];

/// A value as the text of a cell.
fn cell(value: Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text,
        other => other.to_string(),
    }
}

/// Gives all values that are no arrays, with the keys that lead to them.
fn flatten(object: Map<String, Value>, above: &str, give: &mut dyn FnMut(String, Value)) {
    for (key, value) in object {
        let name = if above.is_empty() { key } else { format!("{above}.{key}") };
        match value {
            Value::Object(inner) => flatten(inner, &name, give),
            Value::Array(_) | Value::Null => {}
            value => give(name, value),
        }
    }
}

impl Record {
    /// Whether the work was done.
    pub(super) fn is_ok(&self) -> bool {
        self.row.status == Status::Ok
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn results_become_columns() {
        let line = |id: &str, status: &str, result: Value| {
            let row = json!({
                "id": id, "input": format!("{id}, x"), "input_sha256": null, "status": status, "message": null,
                "exit_code": 0, "seconds": 1.5, "peak_bytes": null, "warnings": ["w"], "output": null, "result": result,
            });
            row.to_string()
        };
        let lines = [
            line(
                "a",
                "ok",
                json!({"projection_rms": 0.25, "bytes": {"total": 7}, "list": [1], "none": null}),
            ),
            line("b", "crash", Value::Null),
            line("c", "ok", json!({"kind": "mesh", "bytes": {"total": 8}})),
        ];
        let recipe = Recipe::named("fit").unwrap();
        let places = Places::in_folder(std::path::Path::new("none"));
        let table = Table::of(lines.iter().map(String::as_bytes), recipe, &places).unwrap();
        assert_eq!(table.columns.keys().collect::<Vec<_>>(), ["bytes.total", "kind", "projection_rms"]);
        assert_eq!(table.records.iter().map(|r| r.error).collect::<Vec<_>>(), [Some(0.25), None, None]);
        let totals: Vec<_> = table.values(table.columns["bytes.total"]).collect();
        assert_eq!(totals, [Some(&json!(7)), None, Some(&json!(8))]);
        let path = std::env::temp_dir().join(format!("ndf-table-{}.csv", std::process::id()));
        let path = table.write_csv(path).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        let text: Vec<&str> = text.lines().collect();
        assert!(
            text[0].starts_with("id,input,")
                && text[0].ends_with("result.bytes.total,result.kind,result.projection_rms")
        );
        assert_eq!(text[1], "a,\"a, x\",,ok,,0,1.5,,1,,,7,,0.25");
        assert_eq!(text[2], "b,\"b, x\",,crash,,0,1.5,,1,,,,,");
        fs::remove_file(path).unwrap();
    }
}

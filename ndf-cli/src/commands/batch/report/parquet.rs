//! The table as a Parquet file: one group of rows, columns without compression, each optional.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use ::parquet::basic::{LogicalType, Repetition, Type as Physical};
use ::parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use ::parquet::errors::ParquetError;
use ::parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use ::parquet::schema::types::Type;
use ndf_mesh::io::atomic_write;
use serde_json::Value;

use super::table::{COMMON, Table};
use crate::output::Failure;

/// A column of values of one kind, or of words where kinds mix.
struct Column {
    name: String,
    kind: Physical,
    values: Vec<Value>,
}

/// Writes the table, and tells where.
///
/// # Errors
/// If the file cannot be written.
pub(super) fn write(table: &Table, path: PathBuf) -> Result<PathBuf, Failure> {
    let written = atomic_write(&path, |out| encode(&columns(table), out).map_err(io::Error::other));
    match written {
        Ok(()) => Ok(path),
        Err(e) => Err(Failure::new(format!("cannot write {}: {e}", path.display()))),
    }
}

fn columns(table: &Table) -> Vec<Column> {
    let common = COMMON
        .iter()
        .map(|(name, value)| Column::new((*name).to_owned(), table.records.iter().map(value).collect()));
    let own = table.columns.iter().map(|(name, &place)| {
        let values = table.values(place).map(|value| value.cloned().unwrap_or_default());
        Column::new(format!("result.{name}"), values.collect())
    });
    common.chain(own).collect()
}

impl Column {
    fn new(name: String, values: Vec<Value>) -> Self {
        let all = |is: fn(&Value) -> bool| values.iter().all(|value| value.is_null() || is(value));
        let kind = match () {
            // Of a column without values nothing is known.
            () if all(|_| false) => Physical::BYTE_ARRAY,
            () if all(Value::is_boolean) => Physical::BOOLEAN,
            () if all(|value| value.as_i64().is_some()) => Physical::INT64,
            () if all(Value::is_number) => Physical::DOUBLE,
            () => Physical::BYTE_ARRAY,
        };
        Self { name, kind, values }
    }

    fn schema(&self) -> Result<Type, ParquetError> {
        let words = (self.kind == Physical::BYTE_ARRAY).then_some(LogicalType::String);
        Type::primitive_type_builder(&self.name, self.kind)
            .with_repetition(Repetition::OPTIONAL)
            .with_logical_type(words)
            .build()
    }

    fn write(
        &self,
        group: &mut SerializedRowGroupWriter<'_, impl io::Write + Send>,
    ) -> Result<(), ParquetError> {
        match self.kind {
            Physical::BOOLEAN => self.write_as::<BoolType>(group, Value::as_bool),
            Physical::INT64 => self.write_as::<Int64Type>(group, Value::as_i64),
            Physical::DOUBLE => self.write_as::<DoubleType>(group, Value::as_f64),
            _ => self.write_as::<ByteArrayType>(group, |value| match value {
                Value::Null => None,
                Value::String(text) => Some(ByteArray::from(text.as_str())),
                other => Some(ByteArray::from(other.to_string().into_bytes())),
            }),
        }
    }

    fn write_as<D: DataType>(
        &self,
        group: &mut SerializedRowGroupWriter<'_, impl io::Write + Send>,
        value: impl Fn(&Value) -> Option<D::T>,
    ) -> Result<(), ParquetError> {
        let values: Vec<D::T> = self.values.iter().filter_map(&value).collect();
        let is_there: Vec<i16> = self.values.iter().map(|value| i16::from(!value.is_null())).collect();
        let Some(mut column) = group.next_column()? else { return Ok(()) };
        column.typed::<D>().write_batch(&values, Some(&is_there), None)?;
        column.close()
    }
}

fn encode(columns: &[Column], out: &mut dyn io::Write) -> Result<(), ParquetError> {
    let fields = columns.iter().map(|column| column.schema().map(Arc::new)).collect::<Result<_, _>>()?;
    let schema = Type::group_type_builder("rows").with_fields(fields).build()?;
    let mut bytes = Vec::new();
    let mut file = SerializedFileWriter::new(&mut bytes, Arc::new(schema), Arc::default())?;
    let mut group = file.next_row_group()?;
    columns.iter().try_for_each(|column| column.write(&mut group))?;
    group.close()?;
    file.close()?;
    out.write_all(&bytes)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::parquet::file::reader::{FileReader, SerializedFileReader};
    use serde_json::json;

    #[test]
    fn columns_have_the_kind_of_their_values() {
        let columns = [
            ("words", vec![json!("a"), Value::Null, json!("c")]),
            ("whole", vec![json!(1), json!(-2), Value::Null]),
            ("broken", vec![json!(1), json!(0.5), json!(2)]),
            ("is", vec![json!(true), json!(false), Value::Null]),
            ("mixed", vec![json!(true), json!(1), json!("x")]),
            ("none", vec![Value::Null; 3]),
        ];
        let columns: Vec<Column> =
            columns.into_iter().map(|(name, values)| Column::new(name.to_owned(), values)).collect();
        let path = std::env::temp_dir().join(format!("ndf-{}.parquet", std::process::id()));
        atomic_write(&path, |out| encode(&columns, out).map_err(io::Error::other)).unwrap();
        let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
        let rows: Vec<Value> =
            reader.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string()).map(Value::from).collect();
        assert_eq!(
            rows,
            [
                r#"{words: "a", whole: 1, broken: 1.0, is: true, mixed: "true", none: null}"#,
                r#"{words: null, whole: -2, broken: 0.5, is: false, mixed: "1", none: null}"#,
                r#"{words: "c", whole: null, broken: 2.0, is: null, mixed: "x", none: null}"#,
            ]
        );
        std::fs::remove_file(path).unwrap();
    }
}

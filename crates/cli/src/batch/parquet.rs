//! Tables as Parquet.

use super::columns::{Cell, cells};
use super::row::Row;
use super::work::guarded;
use anyhow::{Result, anyhow};
use parquet::basic::{Compression, ConvertedType, Repetition, Type as Physical};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::Result as Parquet;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::record::Field;
use parquet::schema::types::Type;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

/// Definition levels of an optional column.
const PRESENT: i16 = 1;
const ABSENT: i16 = 0;

/// Names of columns, and rows of as many fields; fields without a value are empty.
type Columns = (Vec<String>, Vec<Vec<String>>);

/// Reads those of the wanted columns that a file has, as text.
pub(super) fn read(path: &Path, wanted: &[String]) -> Result<Columns> {
    // The reader panics on some unusual types.
    guarded(|| read_columns(path, wanted).map_err(|error| format!("{error:#}")))
        .map_err(|message| anyhow!("cannot be read as Parquet: {message}; write it again, or as CSV"))
}

fn read_columns(path: &Path, wanted: &[String]) -> Result<Columns> {
    let reader = SerializedFileReader::new(File::open(path)?)?;
    let schema = reader.metadata().file_metadata().schema();
    let is_wanted = |field: &Arc<Type>| wanted.iter().any(|name| name == field.name());
    let fields: Vec<Arc<Type>> = schema.get_fields().iter().filter(|field| is_wanted(field)).cloned().collect();
    let names = fields.iter().map(|field| field.name().to_owned()).collect();
    let projection = Type::group_type_builder(schema.name()).with_fields(fields).build()?;
    let mut rows = Vec::new();
    for row in reader.get_row_iter(Some(projection))? {
        rows.push(row?.get_column_iter().map(|(_, field)| text(field)).collect());
    }
    Ok((names, rows))
}

fn text(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Str(text) => text.trim().to_owned(),
        Field::Bytes(bytes) => String::from_utf8_lossy(bytes.data()).trim().to_owned(),
        other => other.to_string(),
    }
}

/// Encodes all rows as a Parquet file.
pub(super) fn encode(rows: &[Row]) -> Result<Vec<u8>> {
    let header = cells(None);
    let fields = header.iter().map(|(name, cell)| column(name, cell)).collect::<Parquet<Vec<_>>>()?;
    let schema = Arc::new(Type::group_type_builder("pairs").with_fields(fields).build()?);
    let properties = Arc::new(WriterProperties::builder().set_compression(Compression::SNAPPY).build());
    let mut file = Vec::new();
    let mut writer = SerializedFileWriter::new(&mut file, schema, properties)?;
    let mut group = writer.next_row_group()?;
    let all: Vec<Vec<(String, Cell<'_>)>> = rows.iter().map(|row| cells(Some(row))).collect();
    for (at, (_, kind)) in header.iter().enumerate() {
        let values: Vec<Cell<'_>> = all.iter().map(|cells| cells[at].1).collect();
        match kind {
            Cell::Text(_) => write::<ByteArrayType>(&mut group, &values, |cell| match cell {
                Cell::Text(value) => value.map(ByteArray::from),
                _ => None,
            }),
            Cell::Number(_) => write::<DoubleType>(&mut group, &values, |cell| match cell {
                Cell::Number(value) => value,
                _ => None,
            }),
            Cell::Count(_) => write::<Int64Type>(&mut group, &values, |cell| match cell {
                Cell::Count(value) => value.and_then(|value| i64::try_from(value).ok()),
                _ => None,
            }),
        }?;
    }
    group.close()?;
    writer.close()?;
    Ok(file)
}

fn column(name: &str, cell: &Cell<'_>) -> Parquet<Arc<Type>> {
    let (physical, converted) = match cell {
        Cell::Text(_) => (Physical::BYTE_ARRAY, ConvertedType::UTF8),
        Cell::Number(_) => (Physical::DOUBLE, ConvertedType::NONE),
        Cell::Count(_) => (Physical::INT64, ConvertedType::NONE),
    };
    let builder = Type::primitive_type_builder(name, physical).with_repetition(Repetition::OPTIONAL);
    builder.with_converted_type(converted).build().map(Arc::new)
}

/// Writes the next column.
fn write<T: DataType>(
    group: &mut SerializedRowGroupWriter<'_, &mut Vec<u8>>,
    cells: &[Cell<'_>],
    value: impl Fn(Cell<'_>) -> Option<T::T>,
) -> Parquet<()> {
    let values: Vec<Option<T::T>> = cells.iter().map(|cell| value(*cell)).collect();
    let levels: Vec<i16> = values.iter().map(|value| if value.is_some() { PRESENT } else { ABSENT }).collect();
    let present: Vec<T::T> = values.into_iter().flatten().collect();
    if let Some(mut column) = group.next_column()? {
        column.typed::<T>().write_batch(&present, Some(&levels), None)?;
        column.close()?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::row::tests::broken;
    use super::*;

    #[test]
    fn what_is_written_is_a_table_of_pairs() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("results.parquet");
        std::fs::write(&path, encode(&[broken("a--b"), broken("#c")]).unwrap()).unwrap();
        let wanted = ["source", "id", "seed", "m00", "seconds", "r00"].map(str::to_owned);
        let (names, rows) = read(&path, &wanted).unwrap();
        assert_eq!(names, ["id", "source", "m00", "seed", "seconds"]);
        let row = |id: &str| [id, "a.ply", "", "7", "1.5"].map(str::to_owned).to_vec();
        assert_eq!(rows, [row("a--b"), row("#c")]);
        assert!(encode(&[]).is_ok());
    }

    #[test]
    fn what_is_no_parquet_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("t.parquet");
        std::fs::write(&path, "source,target\n").unwrap();
        let message = read(&path, &["source".to_owned()]).err().unwrap().to_string();
        assert!(message.contains("cannot be read as Parquet"), "{message}");
    }
}

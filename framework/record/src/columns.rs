//! Columns as Parquet: numbers as doubles, integers as 64-bit integers, texts as UTF-8.
use bytes::Bytes;
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::column::reader::ColumnReader;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::ParquetError;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::Type;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

/// The cells of one column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cells<'a> {
    /// Integers.
    Whole(&'a [u64]),
    /// Numbers, which may be NaN.
    Number(&'a [f64]),
    /// Numbers with empty cells.
    Sparse(&'a [Option<f64>]),
    /// Texts.
    Text(&'a [String]),
}

impl Cells<'_> {
    fn field(&self, name: &str) -> Result<Type, ParquetError> {
        let (physical, logical, repetition) = match self {
            Cells::Whole(_) => (Physical::INT64, None, Repetition::REQUIRED),
            Cells::Number(_) => (Physical::DOUBLE, None, Repetition::REQUIRED),
            Cells::Sparse(_) => (Physical::DOUBLE, None, Repetition::OPTIONAL),
            Cells::Text(_) => {
                (Physical::BYTE_ARRAY, Some(LogicalType::String), Repetition::REQUIRED)
            }
        };
        Type::primitive_type_builder(name, physical)
            .with_logical_type(logical)
            .with_repetition(repetition)
            .build()
    }
}

/// Returns the title of a column of numbers: `NAME [UNIT]`, or only the name for dimensionless numbers.
pub fn titled(name: &str, unit: &str) -> String {
    match unit {
        "" | "1" => name.to_string(),
        unit => format!("{name} [{unit}]"),
    }
}

/// A Parquet file that is being written: groups of rows, each with the same columns, not compressed.
pub struct ParquetFile<W: Write + Send>(SerializedFileWriter<W>);

impl<W: Write + Send> ParquetFile<W> {
    /// Creates a file. `like` contains the title and the kind of each column; its cells are not written. `about` becomes the file's metadata.
    ///
    /// # Errors
    /// Errors of the format or of `out`.
    pub fn new<'a>(
        out: W,
        table: &str,
        like: impl IntoIterator<Item = (&'a str, Cells<'a>)>,
        about: impl IntoIterator<Item = (String, String)>,
    ) -> Result<Self, String> {
        let fields: Result<Vec<_>, _> =
            like.into_iter().map(|(name, column)| column.field(name).map(Arc::new)).collect();
        let schema = Type::group_type_builder(table).with_fields(fields.map_err(fail)?).build();
        let about: Vec<KeyValue> =
            about.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
        let properties = WriterProperties::builder()
            .set_created_by(format!("linkwork {}", env!("CARGO_PKG_VERSION")))
            .set_key_value_metadata((!about.is_empty()).then_some(about))
            .build();
        let schema = Arc::new(schema.map_err(fail)?);
        SerializedFileWriter::new(out, schema, Arc::new(properties)).map(ParquetFile).map_err(fail)
    }

    /// Adds rows: the columns in the order of the file, all of equal length.
    ///
    /// # Errors
    /// Errors of the format or of the file.
    pub fn rows<'a>(&mut self, columns: impl IntoIterator<Item = Cells<'a>>) -> Result<(), String> {
        self.group(columns).map_err(fail)
    }

    fn group<'a>(
        &mut self,
        columns: impl IntoIterator<Item = Cells<'a>>,
    ) -> Result<(), ParquetError> {
        let mut group = self.0.next_row_group()?;
        for column in columns {
            let Some(mut w) = group.next_column()? else { break };
            match column {
                Cells::Whole(v) => {
                    let v: Vec<i64> = v.iter().map(|x| *x as i64).collect();
                    w.typed::<Int64Type>().write_batch(&v, None, None)?;
                }
                Cells::Number(v) => {
                    w.typed::<DoubleType>().write_batch(v, None, None)?;
                }
                Cells::Sparse(v) => {
                    let there: Vec<i16> = v.iter().map(|x| i16::from(x.is_some())).collect();
                    let values: Vec<f64> = v.iter().flatten().copied().collect();
                    w.typed::<DoubleType>().write_batch(&values, Some(&there), None)?;
                }
                Cells::Text(v) => {
                    let v: Vec<ByteArray> = v.iter().map(|t| ByteArray::from(t.as_str())).collect();
                    w.typed::<ByteArrayType>().write_batch(&v, None, None)?;
                }
            }
            w.close()?;
        }
        group.close()?;
        Ok(())
    }

    /// Completes the file and returns its writer.
    ///
    /// # Errors
    /// Errors of the format or of the file.
    pub fn finish(self) -> Result<W, String> {
        self.0.into_inner().map_err(fail)
    }
}

/// Reads the numbers of one column of a complete file of [`ParquetFile`]. Only the cells of this column are read.
///
/// # Errors
/// A message: the file cannot be read, is not a Parquet file, or does not have such a column of numbers without empty cells.
pub fn parquet_numbers(path: &Path, title: &str) -> Result<Vec<f64>, String> {
    let file = File::open(path).map_err(|e| e.to_string())?;
    numbers(&SerializedFileReader::new(file).map_err(fail)?, title)
}

/// Reads several columns, in the order of `titles`, from the bytes of a file.
///
/// # Errors
/// Like [`parquet_numbers`].
pub fn parquet_columns(bytes: Vec<u8>, titles: &[&str]) -> Result<Vec<Vec<f64>>, String> {
    let reader = SerializedFileReader::new(Bytes::from(bytes)).map_err(fail)?;
    titles.iter().map(|title| numbers(&reader, title)).collect()
}

fn numbers(reader: &impl FileReader, title: &str) -> Result<Vec<f64>, String> {
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let column = schema.columns().iter().position(|c| c.name() == title);
    let column = column.ok_or_else(|| format!("it does not have a column `{title}`"))?;
    if schema.column(column).max_def_level() > 0 {
        return Err(format!("its column `{title}` may have empty cells"));
    }
    let mut values = Vec::new();
    for group in 0..reader.num_row_groups() {
        let group = reader.get_row_group(group).map_err(fail)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
        let ColumnReader::DoubleColumnReader(mut cells) =
            group.get_column_reader(column).map_err(fail)?
        else {
            return Err(format!("its column `{title}` does not contain numbers"));
        };
        let before = values.len();
        cells.read_records(rows, None, None, &mut values).map_err(fail)?;
        if values.len() - before != rows {
            return Err(format!("its column `{title}` is incomplete"));
        }
    }
    Ok(values)
}

fn fail(e: ParquetError) -> String {
    format!("parquet: {e}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::record::Field;

    #[test]
    fn what_is_written_reads_back_bit_for_bit() {
        let texts = ["a, \"b\"", "", "é\nf"].map(String::from);
        let numbers = [1.0 / 3.0, f64::NAN, -0.0];
        let sparse = [Some(-0.0), None, Some(f64::NAN)];
        let all = [
            ("run", Cells::Whole(&[0, 1, 1 << 40])),
            ("y [m]", Cells::Number(&numbers)),
            ("z", Cells::Sparse(&sparse)),
            ("why", Cells::Text(&texts)),
        ];
        let about = [("seed".to_string(), "7".to_string())];
        let mut file = ParquetFile::new(Vec::new(), "t", all, about).unwrap();
        file.rows(all.map(|c| c.1)).unwrap();
        file.rows(all.map(|c| c.1)).unwrap();
        let path = tempfile::tempdir().unwrap();
        let path = path.path().join("t.parquet");
        std::fs::write(&path, file.finish().unwrap()).unwrap();
        let bits = |y: Vec<f64>| y.iter().map(|y| y.to_bits()).collect::<Vec<_>>();
        let twice = [numbers, numbers].concat();
        assert_eq!(bits(parquet_numbers(&path, "y [m]").unwrap()), bits(twice.clone()));
        let columns = parquet_columns(std::fs::read(&path).unwrap(), &["y [m]", "y [m]"]).unwrap();
        assert_eq!(
            columns.into_iter().map(bits).collect::<Vec<_>>(),
            [bits(twice.clone()), bits(twice)]
        );
        for (title, fact) in
            [("y", "not have a column"), ("why", "not contain numbers"), ("z", "empty cells")]
        {
            assert!(parquet_numbers(&path, title).unwrap_err().contains(fact), "{title}");
        }
        let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
        let about = reader.metadata().file_metadata().key_value_metadata().unwrap();
        assert!(about.iter().any(|kv| kv.key == "seed" && kv.value.as_deref() == Some("7")));
        let rows: Vec<Vec<Field>> = reader
            .get_row_iter(None)
            .unwrap()
            .map(|r| r.unwrap().get_column_iter().map(|(_, f)| f.clone()).collect())
            .collect();
        assert_eq!(rows.len(), 6);
        let whole = |f: &Field| if let Field::Long(x) = f { *x } else { panic!("{f}") };
        let bits = |f: &Field| match f {
            Field::Double(x) => Some(x.to_bits()),
            Field::Null => None,
            other => panic!("{other}"),
        };
        let text = |f: &Field| if let Field::Str(x) = f { x.clone() } else { panic!("{f}") };
        for rows in rows.chunks(3) {
            assert_eq!(rows.iter().map(|r| whole(&r[0])).collect::<Vec<_>>(), [0, 1, 1 << 40]);
            let wanted = numbers.map(|x| Some(x.to_bits()));
            assert_eq!(rows.iter().map(|r| bits(&r[1])).collect::<Vec<_>>(), wanted);
            let wanted = sparse.map(|x| x.map(f64::to_bits));
            assert_eq!(rows.iter().map(|r| bits(&r[2])).collect::<Vec<_>>(), wanted);
            assert_eq!(rows.iter().map(|r| text(&r[3])).collect::<Vec<_>>(), texts);
        }
    }

    #[test]
    fn a_table_without_rows_is_a_file_too() {
        let like = [("y", Cells::Number(&[]))];
        let mut file = ParquetFile::new(Vec::new(), "t", like, None).unwrap();
        file.rows(like.map(|c| c.1)).unwrap();
        assert!(file.finish().unwrap().starts_with(b"PAR1"));
    }
}

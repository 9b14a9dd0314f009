//! Tables of other programs, as CSV or Parquet: columns of numbers by their titles.
//!
//! A table is read completely. The first line of a CSV file contains the titles, cells are separated by commas, and an empty cell or `nan` is a
//! missing value. From Parquet files, integer and floating-point columns are read, with nulls as missing values; they must be uncompressed or
//! compressed with Snappy. A missing value is NaN.
use parquet::basic::Type as Physical;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::ParquetError;
use parquet::file::reader::{FileReader, SerializedFileReader};
use std::fs::File;
use std::path::Path;

/// A table, or a column of it, cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("table `{table}`: {fact}\n  help: {help}")]
pub struct TableError {
    /// The file.
    pub table: String,
    /// The fault, with its position.
    pub fact: String,
    /// The remedy.
    pub help: String,
}

/// Content of a column.
#[derive(Clone, Debug)]
enum Column {
    Numbers(Vec<f64>),
    /// Not numbers: the cell that shows this, in words.
    Other(String),
}

/// A table in memory.
#[derive(Clone, Debug)]
pub struct Table {
    name: String,
    columns: Vec<(String, Column)>,
    rows: usize,
}

/// Largest number of rows of a table.
const MOST_ROWS: usize = 1 << 28;

/// Largest table that is read (bytes).
const LARGEST: u64 = 1 << 31;

impl Table {
    /// Reads a `.csv` or `.parquet` file.
    ///
    /// # Errors
    /// It cannot be read, is of another kind, or its lines have different numbers of cells.
    pub fn read(path: &Path) -> Result<Table, TableError> {
        let name = path.display().to_string();
        let fail = |fact: String, help: &str| TableError {
            table: name.clone(),
            fact,
            help: help.to_string(),
        };
        let about = "give an existing .csv or .parquet file";
        let there = std::fs::metadata(path).map_err(|e| fail(e.to_string(), about))?;
        // Check before opening, because opening a pipe blocks.
        if !there.is_file() {
            return Err(fail("it is not a regular file".into(), about));
        }
        let size = there.len();
        if size > LARGEST {
            let help = "keep every tenth row, or only the columns that are used";
            return Err(fail(format!("it has {size} bytes, more than {LARGEST}"), help));
        }
        let (columns, rows) = match path.extension().and_then(|e| e.to_str()) {
            Some("csv") => {
                let bytes = std::fs::read(path).map_err(|e| fail(e.to_string(), about))?;
                let text = linkwork_runtime::text_of_bytes(bytes).map_err(|e| fail(e, about))?;
                let help = "write one line of titles, then one line per row, with cells separated by commas";
                csv_columns(&text).map_err(|fact| fail(fact, help))?
            }
            Some("parquet") => {
                let help = "write it with compression `none` or `snappy`";
                let file = File::open(path).map_err(|e| fail(e.to_string(), about))?;
                parquet_columns(file, size).map_err(|e| fail(format!("parquet: {e}"), help))?
            }
            _ => return Err(fail("its name must end in .csv or .parquet".into(), about)),
        };
        Ok(Table { name, columns, rows })
    }

    /// Returns the number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns the titles of the columns, in their order.
    pub fn titles(&self) -> Vec<&str> {
        self.columns.iter().map(|(title, _)| title.as_str()).collect()
    }

    /// Returns the numbers of the column with a title, one per row; missing values are NaN.
    ///
    /// # Errors
    /// The column does not exist, exists twice, or does not contain numbers.
    pub fn numbers(&self, title: &str) -> Result<&[f64], TableError> {
        let fail = |fact: String, help: String| TableError { table: self.name.clone(), fact, help };
        let mut found = self.columns.iter().filter(|(t, _)| t == title);
        let Some((_, column)) = found.next() else {
            let help = linkwork_runtime::remedy(title, "columns", &self.titles());
            return Err(fail(format!("it does not have a column `{title}`"), help));
        };
        if found.next().is_some() {
            let help = "give each column a unique title";
            return Err(fail(format!("it has two columns `{title}`"), help.into()));
        }
        match column {
            Column::Numbers(numbers) => Ok(numbers),
            Column::Other(fact) => {
                let help = "choose a column of numbers, or correct that cell; an empty cell is a missing value";
                Err(fail(format!("its column `{title}` holds {fact}"), help.into()))
            }
        }
    }
}

/// Reads a cell of a CSV file: NaN if it is empty.
fn cell(text: &str, decimal_comma: bool) -> Option<f64> {
    match text.parse() {
        Ok(number) => Some(number),
        Err(_) if text.is_empty() => Some(f64::NAN),
        Err(_) if decimal_comma => text.replacen(',', ".", 1).parse().ok(),
        Err(_) => None,
    }
}

fn csv_columns(text: &str) -> Result<(Vec<(String, Column)>, usize), String> {
    let records = linkwork_runtime::columns::Records::parse(text, None)?;
    let mut columns: Vec<(String, Column)> =
        records.titles.into_iter().map(|t| (t, Column::Numbers(Vec::new()))).collect();
    if columns.is_empty() {
        return Err("it is empty".into());
    }
    let rows = records.rows.len();
    for (line, cells) in &records.rows {
        for ((_, column), text) in columns.iter_mut().zip(cells) {
            let Column::Numbers(numbers) = column else { continue };
            match cell(text, records.decimal_comma) {
                Some(x) => numbers.push(x),
                None => *column = Column::Other(format!("`{text}` in line {line}")),
            }
        }
    }
    Ok((columns, rows))
}

/// Largest number of cells per byte of a Parquet file. A file that claims more is damaged or malicious.
const CELLS: u64 = 4096;

fn parquet_columns(file: File, size: u64) -> Result<(Vec<(String, Column)>, usize), ParquetError> {
    let reader = SerializedFileReader::new(file)?;
    let schema = reader.metadata().file_metadata().schema_descr_ptr();
    let mut columns = Vec::new();
    let rows = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or(0);
    let cells = (rows as u64).saturating_mul(schema.num_columns().max(1) as u64);
    if cells > CELLS.saturating_mul(size) || rows > MOST_ROWS {
        let fact = format!("a file of {size} bytes claims {rows} rows");
        return Err(ParquetError::General(fact));
    }
    for k in 0..schema.num_columns() {
        let about = schema.column(k);
        let kind = about.physical_type();
        let plain = about.max_rep_level() == 0 && about.max_def_level() <= 1;
        let numbers =
            [Physical::DOUBLE, Physical::FLOAT, Physical::INT32, Physical::INT64].contains(&kind);
        if !(plain && numbers) {
            let what = if plain { format!("{kind} instead of numbers") } else { "lists".into() };
            columns.push((about.path().string(), Column::Other(what)));
            continue;
        }
        let optional = about.max_def_level() == 1;
        let mut out = Vec::new();
        for group in 0..reader.num_row_groups() {
            let group = reader.get_row_group(group)?;
            let n = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            match group.get_column_reader(k)? {
                ColumnReader::DoubleColumnReader(mut r) => {
                    take(&mut r, n, optional, &mut out, |x| x)
                }
                ColumnReader::FloatColumnReader(mut r) => {
                    take(&mut r, n, optional, &mut out, f64::from)
                }
                ColumnReader::Int32ColumnReader(mut r) => {
                    take(&mut r, n, optional, &mut out, f64::from)
                }
                ColumnReader::Int64ColumnReader(mut r) => {
                    take(&mut r, n, optional, &mut out, |x| x as f64)
                }
                _ => Ok(()),
            }?;
        }
        if out.len() != rows {
            let fact = format!("column `{}` has {} cells of {rows}", about.path(), out.len());
            return Err(ParquetError::EOF(fact));
        }
        columns.push((about.path().string(), Column::Numbers(out)));
    }
    Ok((columns, rows))
}

/// Appends the cells of one row group; nulls become NaN.
fn take<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    rows: usize,
    optional: bool,
    out: &mut Vec<f64>,
    number: impl Fn(T::T) -> f64,
) -> Result<(), ParquetError> {
    let (mut there, mut values) = (Vec::new(), Vec::new());
    let mut read = 0;
    while read < rows {
        let there = optional.then_some(&mut there);
        let (records, ..) = reader.read_records(rows - read, there, None, &mut values)?;
        if records == 0 {
            return Err(ParquetError::EOF("a row group is incomplete".into()));
        }
        read += records;
    }
    let mut values = values.into_iter().map(number);
    if optional {
        let cells = there.iter().map(|there| if *there > 0 { values.next() } else { None });
        out.extend(cells.map(|x| x.unwrap_or(f64::NAN)));
    } else {
        out.extend(values);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{Cells, ParquetFile};

    fn written(name: &str, bytes: &[u8]) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        (folder, path)
    }

    fn same(a: &[f64], b: &[f64]) {
        let bits = |v: &[f64]| {
            v.iter().map(|x| if x.is_nan() { 1 } else { x.to_bits() }).collect::<Vec<_>>()
        };
        assert_eq!(bits(a), bits(b));
    }

    #[test]
    fn columns_of_csv_are_numbers_gaps_or_told() {
        let text =
            "time, x [ft], note, x [m]\n0, 1.5E3, start, 1\n0.1, , , nan\n\"0.2\",-2,end,-3e-1\n";
        let (_folder, path) = written("t.csv", text.as_bytes());
        let table = Table::read(&path).unwrap();
        assert_eq!((table.rows(), table.titles()), (3, vec!["time", "x [ft]", "note", "x [m]"]));
        same(table.numbers("time").unwrap(), &[0.0, 0.1, 0.2]);
        same(table.numbers("x [ft]").unwrap(), &[1500.0, f64::NAN, -2.0]);
        same(table.numbers("x [m]").unwrap(), &[1.0, f64::NAN, -0.3]);
        let e = table.numbers("note").unwrap_err().to_string();
        assert!(e.contains("column `note` holds `start` in line 2") && e.contains("help: "), "{e}");
        let e = table.numbers("tiem").unwrap_err().to_string();
        assert!(e.contains("not have a column `tiem`") && e.contains("did you mean `time`"), "{e}");
    }

    #[test]
    fn spreadsheets_of_other_countries_are_read() {
        let (_folder, path) = written("t.csv", "\u{feff}time;x [m]\n0;1,5\n0,1;\n".as_bytes());
        let table = Table::read(&path).unwrap();
        same(table.numbers("time").unwrap(), &[0.0, 0.1]);
        same(table.numbers("x [m]").unwrap(), &[1.5, f64::NAN]);
    }

    #[test]
    fn columns_of_parquet_are_the_same_numbers() {
        let (whole, number) = ([0, 1, 1 << 40], [1.0 / 3.0, f64::NAN, -0.0]);
        let sparse = [None, Some(2.5), None];
        let texts = ["a", "b", "c"].map(String::from);
        let all = [
            ("n", Cells::Whole(&whole)),
            ("y [m]", Cells::Number(&number)),
            ("z", Cells::Sparse(&sparse)),
            ("why", Cells::Text(&texts)),
        ];
        let mut file = ParquetFile::new(Vec::new(), "t", all, None).unwrap();
        file.rows(all.map(|c| c.1)).unwrap();
        file.rows(all.map(|c| c.1)).unwrap();
        let bytes = file.finish().unwrap();
        let (_folder, path) = written("t.parquet", &bytes);
        let table = Table::read(&path).unwrap();
        assert_eq!(table.rows(), 6);
        let whole = whole.map(|x| x as f64);
        same(table.numbers("n").unwrap(), &[whole, whole].concat());
        same(table.numbers("y [m]").unwrap(), &[number, number].concat());
        let sparse = sparse.map(|x| x.unwrap_or(f64::NAN));
        same(table.numbers("z").unwrap(), &[sparse, sparse].concat());
        let e = table.numbers("why").unwrap_err().to_string();
        assert!(e.contains("BYTE_ARRAY instead of numbers"), "{e}");
        // A truncated file is rejected without a panic.
        for at in [0, 3, 40, bytes.len() / 2, bytes.len() - 1] {
            let (_folder, path) = written("cut.parquet", &bytes[..at]);
            let e = Table::read(&path).unwrap_err().to_string();
            assert!(e.contains("cut.parquet") && e.contains("help: "), "{e}");
        }
    }

    #[test]
    fn what_is_no_table_is_refused() {
        for (name, text, fact) in [
            ("a.csv", "", "it is empty"),
            ("b.csv", "t,x\n0\n", "line 2 has 1 cells"),
            ("c.txt", "t,x\n0,1\n", "must end in .csv or .parquet"),
            ("d.parquet", "t,x\n0,1\n", "parquet: "),
        ] {
            let (_folder, path) = written(name, text.as_bytes());
            let e = Table::read(&path).unwrap_err().to_string();
            assert!(e.contains(name) && e.contains(fact) && e.contains("help: "), "{e}");
        }
        let e = Table::read(Path::new("nowhere.csv")).unwrap_err().to_string();
        assert!(e.contains("nowhere.csv") && e.contains("help: "), "{e}");
        let (_folder, path) = written("e.csv", b"t,x,x\n0,1,2\n");
        let e = Table::read(&path).unwrap().numbers("x").unwrap_err().to_string();
        assert!(e.contains("two columns `x`"), "{e}");
    }
}

//! Export of a log as a table: a row per instant, a column per variable.
use crate::columns::{Cells, ParquetFile, titled};
use crate::log::LogError;
use crate::read::{End, Entry, seconds, walk_log};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

/// Result of an export.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exported {
    /// Number of instants.
    pub rows: u64,
    /// Number of variables.
    pub variables: usize,
    /// End of the log.
    pub end: End,
}

/// A log cannot be converted to a table.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The log cannot be read.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The log does not contain variables.
    #[error(
        "log `{path}` does not contain variables\n  help: use a log whose run had patterns in `log`"
    )]
    Empty {
        /// The log.
        path: String,
    },
    /// The table cannot be written.
    #[error("`{path}` cannot be written: {why}\n  help: free disk space, or choose another file")]
    Write {
        /// The table.
        path: String,
        /// The reason.
        why: String,
    },
}

/// Largest number of values that are buffered before they are written.
const HELD: usize = 1 << 21;

/// Title of the column of times.
const TIME: &str = "time [s]";

/// Format of an exported table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TableFormat {
    /// Parquet, with configuration, seed and versions in the file's metadata, under `linkwork.configuration` and `linkwork.NAME`; null where an
    /// instant has no value.
    Parquet,
    /// CSV with one line of titles; an empty cell where an instant has no value. Numbers have all digits that are needed to read them exactly.
    Csv,
}

/// Writes the variables of a log as a table: `time [s]` and a column `PART.FIELD [UNIT]` for each variable, sorted by name. Poses, and
/// variables that were set from outside, are not exported. The log is read twice and never completely in memory.
///
/// # Errors
/// [`ExportError`]. No file is written then, and an existing file is not changed.
pub fn export_table(log: &Path, to: &Path, format: TableFormat) -> Result<Exported, ExportError> {
    let write = |why: String| ExportError::Write { path: to.display().to_string(), why };
    let head = Head::read(log)?;
    if head.units.is_empty() {
        return Err(ExportError::Empty { path: log.display().to_string() });
    }
    let folder = to.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // Write to a temporary file next to the target and rename it when it is complete.
    let mut beside = to.as_os_str().to_owned();
    beside.push(".part");
    let beside = Path::new(&beside);
    let made = File::create(beside).map_err(|e| write(e.to_string())).and_then(|file| {
        let done = head.table(log, BufWriter::new(file), format, &write)?;
        std::fs::rename(beside, to).map_err(|e| write(e.to_string()))?;
        // Systems on which folders cannot be opened make the rename durable themselves.
        if let Ok(folder) = File::open(folder) {
            folder.sync_all().map_err(|e| write(e.to_string()))?;
        }
        Ok(done)
    });
    if made.is_err() {
        let _ = std::fs::remove_file(beside);
    }
    made
}

/// Content of a log that is read before its rows.
struct Head {
    /// Variables and their units.
    units: BTreeMap<String, String>,
    about: BTreeMap<String, String>,
    /// Largest delay (ns) of a row relative to the newest row before it, because rows around an event are written after the event.
    late: u64,
}

impl Head {
    fn read(log: &Path) -> Result<Head, LogError> {
        let mut head = Head { units: BTreeMap::new(), about: BTreeMap::new(), late: 0 };
        let mut newest = 0;
        walk_log::<LogError>(log, |entry| {
            match entry {
                Entry::Configuration(text) => {
                    head.about.insert("configuration".into(), text);
                }
                Entry::About(about) => head.about.extend(about),
                Entry::Numbers { ns, values } => {
                    newest = newest.max(ns);
                    head.late = head.late.max(newest - ns);
                    for (variable, _) in values {
                        if !head.units.contains_key(&variable.path) {
                            head.units.insert(variable.path.clone(), variable.unit.clone());
                        }
                    }
                }
                Entry::Start(_)
                | Entry::Set(_)
                | Entry::Poses { .. }
                | Entry::Picture { .. }
                | Entry::Tile { .. }
                | Entry::Way { .. } => {}
            }
            Ok(())
        })?;
        Ok(head)
    }

    fn table(
        &self,
        log: &Path,
        out: BufWriter<File>,
        format: TableFormat,
        write: &dyn Fn(String) -> ExportError,
    ) -> Result<Exported, ExportError> {
        let titles: Vec<String> =
            self.units.iter().map(|(name, unit)| titled(name, unit)).collect();
        let mut file = match format {
            TableFormat::Parquet => {
                let like = titles.iter().map(|title| (title.as_str(), Cells::Sparse(&[])));
                let like = std::iter::once((TIME, Cells::Number(&[]))).chain(like);
                let about = self.about.iter().map(|(k, v)| (format!("linkwork.{k}"), v.clone()));
                TableFile::Parquet(ParquetFile::new(out, "log", like, about).map_err(write)?)
            }
            TableFormat::Csv => {
                let mut file = csv::Writer::from_writer(out);
                let line = std::iter::once(TIME).chain(titles.iter().map(String::as_str));
                file.write_record(line).map_err(|e| write(e.to_string()))?;
                TableFile::Csv(file)
            }
        };
        let of: BTreeMap<&str, usize> =
            self.units.keys().enumerate().map(|(k, name)| (name.as_str(), k)).collect();
        let mut held = RowBuffer { rows: BTreeMap::new(), width: titles.len() };
        let (mut rows, mut newest) = (0, 0);
        let end = walk_log::<ExportError>(log, |entry| {
            let Entry::Numbers { ns, values } = entry else { return Ok(()) };
            newest = newest.max(ns);
            if !held.rows.contains_key(&ns) {
                if held.rows.len() * titles.len() >= HELD {
                    rows += held
                        .give(&mut file, Some(newest - self.late.min(newest)))
                        .map_err(write)?;
                }
                held.rows.insert(ns, vec![None; titles.len()]);
            }
            let Some(row) = held.rows.get_mut(&ns) else { return Ok(()) };
            for (variable, value) in values {
                // The log is unchanged since the first pass, unless another process is writing it.
                let Some(k) = of.get(variable.path.as_str()) else {
                    return Err(write(format!(
                        "`{}` was added to the log during the export",
                        variable.path
                    )));
                };
                row[*k] = Some(value);
            }
            Ok(())
        })?;
        rows += held.give(&mut file, None).map_err(write)?;
        let out = file.finish().map_err(write)?;
        let file = out.into_inner().map_err(|e| write(e.to_string()))?;
        file.sync_all().map_err(|e| write(e.to_string()))?;
        Ok(Exported { rows, variables: titles.len(), end })
    }
}

/// A table that is being written.
enum TableFile {
    Parquet(ParquetFile<BufWriter<File>>),
    Csv(csv::Writer<BufWriter<File>>),
}

impl TableFile {
    /// Writes rows with their times (ns), each `width` cells.
    fn rows(&mut self, rows: &BTreeMap<u64, Vec<Option<f64>>>, width: usize) -> Result<(), String> {
        match self {
            TableFile::Parquet(file) => {
                let t: Vec<f64> = rows.keys().map(|ns| seconds(*ns)).collect();
                let column = |k: usize| rows.values().map(|row| row[k]).collect::<Vec<_>>();
                let columns: Vec<Vec<Option<f64>>> = (0..width).map(column).collect();
                let cells = columns.iter().map(|c| Cells::Sparse(c));
                file.rows(std::iter::once(Cells::Number(&t)).chain(cells))
            }
            TableFile::Csv(file) => {
                // The debug format has the fewest digits that give the same number, and an exponent for large and small ones.
                let cell = |x: &Option<f64>| x.map_or_else(String::new, |x| format!("{x:?}"));
                for (ns, row) in rows {
                    let line = std::iter::once(format!("{:?}", seconds(*ns)));
                    file.write_record(line.chain(row.iter().map(cell)))
                        .map_err(|e| e.to_string())?;
                }
                Ok(())
            }
        }
    }

    fn finish(self) -> Result<BufWriter<File>, String> {
        match self {
            TableFile::Parquet(file) => file.finish(),
            TableFile::Csv(file) => file.into_inner().map_err(|e| e.error().to_string()),
        }
    }
}

/// Buffered rows, by their times (ns).
struct RowBuffer {
    rows: BTreeMap<u64, Vec<Option<f64>>>,
    width: usize,
}

impl RowBuffer {
    /// Writes the rows before `until` (ns), or all rows; returns their number.
    fn give(&mut self, file: &mut TableFile, until: Option<u64>) -> Result<u64, String> {
        let later = until.map_or_else(BTreeMap::new, |until| self.rows.split_off(&until));
        let rows = std::mem::replace(&mut self.rows, later);
        if rows.is_empty() {
            return Ok(0);
        }
        file.rows(&rows, self.width)?;
        Ok(rows.len() as u64)
    }
}

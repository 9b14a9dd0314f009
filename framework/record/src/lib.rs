//! Writes logs (MCAP with protobuf on every channel), reads and compares them, makes plots and tables (Parquet, CSV), and reads tables of other programs.
mod ballast;
mod columns;
mod export;
mod log;
mod overlays;
mod pictures;
mod plot;
mod read;
mod replace;
mod schema;
mod table;

pub use columns::{Cells, ParquetFile, parquet_columns, parquet_numbers, titled};
pub use export::{ExportError, Exported, TableFormat, export_table};
pub use log::{Columns, Log, LogError, LogSpec, columns};
pub use plot::{Curve, Plot, PlotError, draw};
pub use read::{
    Difference, End, Entry, LogContents, Logged, Rows, Series, Tolerances, compare, log_begin,
    read_log, read_log_contents, read_log_with_poses, seconds, walk_log,
};
pub use replace::{Durable, replace};
pub use schema::{Schema, decode};
pub use table::{Table, TableError};

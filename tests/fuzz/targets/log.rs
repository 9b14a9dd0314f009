//! The readers of logs must not panic: rows, and the table of them.
#![no_main]

use libfuzzer_sys::fuzz_target;
use linkwork_record::{TableFormat, export_table, read_log_contents};

fuzz_target!(|bytes: &[u8]| {
    // The files are in memory if the system has such a folder.
    let folder = std::path::PathBuf::from("/dev/shm");
    let folder = if folder.is_dir() { folder } else { std::env::temp_dir() };
    let name = |end: &str| folder.join(format!("linkwork-fuzz-{}.{end}", std::process::id()));
    let (log, table) = (name("mcap"), name("parquet"));
    if std::fs::write(&log, bytes).is_ok() && read_log_contents(&log).is_ok() {
        let _ = export_table(&log, &table, TableFormat::Parquet);
    }
});

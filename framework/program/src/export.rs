//! `linkwork export`: a simulation as a co-simulation unit of FMI 3.0, a log as a table.
use crate::program::program;
use crate::recorders::same;
use crate::voice::report;
use crate::{exit, load};
use clap::Args;
use linkwork_assembly::Failure;
use linkwork_fmi::{Export, export as write, find_library};
use linkwork_record::{End, ExportError, Exported, LogError, TableFormat, export_table};
use std::path::{Path, PathBuf};

/// Options of an export.
#[derive(Args, Clone, Debug, Default)]
pub struct ExportOptions {
    /// Write a simulation as an FMI unit to this file, e.g. ball.fmu.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["parquet", "csv"])]
    pub fmu: Option<PathBuf>,
    /// Write a log as a Parquet table to this file, e.g. run.parquet: a row per instant, a column per variable.
    #[arg(long, value_name = "FILE")]
    pub parquet: Option<PathBuf>,
    /// Write a log as the same table in CSV to this file, e.g. run.csv.
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Inputs of the unit, by pattern (repeatable); they must be unconnected (default: all).
    #[arg(long = "input", value_name = "PATTERN", conflicts_with_all = ["parquet", "csv"])]
    pub inputs: Vec<String>,
    /// Outputs of the unit, by pattern (repeatable; default: the variables that the simulation logs).
    #[arg(long = "output", value_name = "PATTERN", conflicts_with_all = ["parquet", "csv"])]
    pub outputs: Vec<String>,
    /// Shared library of the unit (default: the one next to this program).
    #[arg(long, value_name = "FILE", conflicts_with_all = ["parquet", "csv"])]
    pub library: Option<PathBuf>,
    /// Set a parameter of the simulation (repeatable).
    #[arg(long = "set", value_name = "PATH=VALUE", conflicts_with_all = ["parquet", "csv"])]
    pub set: Vec<String>,
}

/// Writes the unit or the table.
pub fn export(from: &Path, options: &ExportOptions) -> u8 {
    if let Some(fmu) = &options.fmu {
        return unit(from, fmu, options);
    }
    let parquet = options.parquet.iter().map(|to| (to, TableFormat::Parquet));
    let csv = options.csv.iter().map(|to| (to, TableFormat::Csv));
    let codes = parquet.chain(csv).map(|(to, format)| table(from, to, format));
    codes.max().unwrap_or_else(|| {
        tell!(
            "error: the output format is missing\n  help: give --fmu FILE for a simulation, --parquet FILE or --csv FILE for a log"
        );
        exit::INPUT
    })
}

fn table(log: &Path, to: &Path, format: TableFormat) -> u8 {
    if same(log, to) {
        let log = log.display();
        tell!("error: `{log}` is the log itself\n  help: choose another file for the table");
        return exit::INPUT;
    }
    match export_table(log, to, format) {
        Ok(Exported { rows, variables, end }) => {
            if let End::Cut { at } = end {
                tell!(
                    "warning: `{}` is truncated after byte {at}: the table contains the data before",
                    log.display()
                );
            }
            say!("{}: {rows} rows of {variables} variables", to.display());
            exit::OK
        }
        Err(e) => {
            tell!("error: {e}");
            match e {
                ExportError::Write { .. } | ExportError::Log(LogError::Write { .. }) => {
                    exit::FAILED
                }
                ExportError::Log(_) | ExportError::Empty { .. } => exit::INPUT,
            }
        }
    }
}

fn unit(sim: &Path, fmu: &Path, options: &ExportOptions) -> u8 {
    let ready = match load::ready(sim, &options.set, None) {
        Ok(ready) => ready,
        Err(code) => return code,
    };
    load::warn(&ready);
    let library = match options.library.clone().map_or_else(|| find_library(program().unit), Ok) {
        Ok(library) => library,
        Err(fault) => {
            let sources = ready.loaded.sources;
            return report(&Failure { faults: vec![fault], sources });
        }
    };
    let stem = fmu.file_stem().map(|s| s.to_string_lossy().into_owned());
    let what = Export {
        name: stem.unwrap_or_else(|| "unit".into()),
        inputs: options.inputs.clone(),
        outputs: options.outputs.clone(),
        library,
    };
    match write(ready, &what, fmu) {
        Ok(done) => {
            for note in &done.notes {
                tell!("warning: {note}");
            }
            say!(
                "{}: FMI 3.0 co-simulation, {} inputs, {} outputs",
                fmu.display(),
                done.inputs.len(),
                done.outputs.len()
            );
            exit::OK
        }
        Err(failure) => report(&failure),
    }
}

//! `linkwork export`: a simulation as a co-simulation unit of FMI 3.0.
use crate::program::program;
use crate::voice::report;
use crate::{exit, load};
use clap::Args;
use linkwork_assembly::Failure;
use linkwork_fmi::{Export, export as write, find_library};
use std::path::{Path, PathBuf};

/// What an export may be told.
#[derive(Args, Clone, Debug, Default)]
pub struct ExportOptions {
    /// Where the unit goes, e.g. ball.fmu.
    #[arg(long, value_name = "FILE")]
    pub fmu: PathBuf,
    /// Inputs of the unit, by pattern (repeatable): inputs that nothing drives. All unless given.
    #[arg(long = "input", value_name = "PATTERN")]
    pub inputs: Vec<String>,
    /// Outputs of the unit, by pattern (repeatable). What the simulation logs unless given.
    #[arg(long = "output", value_name = "PATTERN")]
    pub outputs: Vec<String>,
    /// The shared library that goes into the unit; the one beside this program unless given.
    #[arg(long, value_name = "FILE")]
    pub library: Option<PathBuf>,
}

/// Writes the unit.
pub fn export(sim: &Path, options: &ExportOptions, set: &[String]) -> u8 {
    let ready = match load::ready(sim, set, None) {
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
    let stem = options.fmu.file_stem().map(|s| s.to_string_lossy().into_owned());
    let what = Export {
        name: stem.unwrap_or_else(|| "unit".into()),
        inputs: options.inputs.clone(),
        outputs: options.outputs.clone(),
        library,
    };
    match write(ready, &what, &options.fmu) {
        Ok(done) => {
            for note in &done.notes {
                tell!("warning: {note}");
            }
            say!(
                "{}: FMI 3.0 co-simulation, {} inputs, {} outputs",
                options.fmu.display(),
                done.inputs.len(),
                done.outputs.len()
            );
            exit::OK
        }
        Err(failure) => report(&failure),
    }
}

//! Import and export of FMI 2.0 and 3.0 units: units as parts of a simulation, and a simulation as a unit. Contains `unsafe`, because it calls
//! foreign machine code and is called by it.
//!
//! ```text
//! import:  .fmu → archive (bounded) → description → ports;  shared library → instance
//!          fmi.co_simulation: a sampled part      fmi.model_exchange: a continuous part
//! export:  simulation → description, configuration, shared library → .fmu
//!          importer → C functions of `export_unit!` → the simulation inside
//! ```
//! | module | content |
//! |---|---|
//! | `archive` | reading of the zip file, with checks because it is not trusted |
//! | `abi` | the C functions of FMI 2.0 and 3.0 |
//! | `unit` | description and shared library |
//! | `log` | messages of a unit |
//! | `instance` | an instance of a unit: one set of safe operations for both versions |
//! | `clocks` | ticks of the clocks of FMI 3.0 |
//! | `ports`, `slot`, `start` | ports and start values from the description |
//! | `part` | common parts of both kinds of units; the unit's state as bytes |
//! | `co_simulation`, `model_exchange` | the parts |
//! | `export` | export of a simulation as an archive |
//! | `provide`, `functions` | an exported unit, and its C functions |
mod abi;
mod archive;
mod clocks;
mod co_simulation;
mod export;
mod functions;
mod instance;
mod kind;
mod log;
mod model_exchange;
mod part;
mod ports;
#[doc(hidden)]
pub mod provide;
mod slot;
mod start;
mod unit;

pub use archive::write_archive;
pub use co_simulation::CoSimulation;
pub use export::{Export, Exported, export, find_library, library_name};
pub use model_exchange::ModelExchange;
pub use start::{Starts, UnitParams};

use linkwork_runtime::{BuildError, Entry};

/// Returns the models of this crate.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::foreign::<CoSimulation>(), Entry::foreign::<ModelExchange>()]
}

/// A rejected unit: fact and remedy.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Refusal {
    pub message: String,
    pub help: Option<String>,
}

impl Refusal {
    pub fn new(message: impl Into<String>) -> Self {
        Refusal { message: message.into(), help: None }
    }
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
    /// Converts an error of another crate.
    pub fn of(error: &dyn std::fmt::Display) -> Self {
        let (message, help) = linkwork_runtime::told(error);
        Refusal { message, help }
    }
}

impl From<BuildError> for Refusal {
    fn from(e: BuildError) -> Self {
        Refusal { message: e.message, help: e.help }
    }
}

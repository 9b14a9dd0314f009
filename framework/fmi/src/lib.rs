//! Foreign units by FMI 2.0 and 3.0, both ways: units as parts of a simulation, and a simulation as
//! a unit. With `unsafe`: it calls, and is called by, machine code of others.
//!
//! ```text
//! import:  .fmu → archive (bounded) → description → ports;  shared library → instance
//!          fmi.co_simulation: a sampled part      fmi.model_exchange: a continuous part
//! export:  simulation → description, configuration, shared library → .fmu
//!          importer → C functions of `export_unit!` → the simulation inside
//! ```
//! | module | what it holds |
//! |---|---|
//! | `archive` | the zip file, not trusted |
//! | `abi` | the C functions of both versions |
//! | `unit` | description and shared library |
//! | `log` | what a unit says |
//! | `instance` | a living instance, one set of safe operations for both versions |
//! | `ports`, `slot`, `start` | ports and start values from the description |
//! | `part` | what both kinds of parts share; the unit's state as bytes |
//! | `co_simulation`, `model_exchange` | the parts |
//! | `export` | a simulation into an archive |
//! | `provide`, `functions` | an exported unit, and its C functions |
mod abi;
mod archive;
mod co_simulation;
mod export;
mod functions;
mod instance;
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

/// The models of this crate.
pub fn catalogue() -> Vec<Entry> {
    vec![Entry::foreign::<CoSimulation>(), Entry::foreign::<ModelExchange>()]
}

/// Why a unit is refused: fact and remedy.
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
    /// What an error of another crate says.
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

//! Foreign units by FMI 2.0 and 3.0, both ways: units as parts of a simulation, and a simulation as
//! a unit. The only crate with `unsafe`: it calls, and is called by, machine code of others.
//!
//! ```text
//! import:  .fmu → archive (bounded) → description → ports;  shared library → instance
//!          fmi.co_simulation: a sampled part      fmi.model_exchange: a continuous part
//! ```
//! | module | what it holds |
//! |---|---|
//! | `archive` | the zip file, not trusted |
//! | `abi` | the C functions of both versions |
//! | `unit` | description and shared library |
//! | `instance` | a living instance, one set of safe operations for both versions |
//! | `ports`, `start` | ports and start values from the description |
//! | `part` | what both kinds of parts share; the unit's state as bytes |
//! | `co_simulation`, `model_exchange` | the parts |
mod abi;
mod archive;
mod co_simulation;
mod instance;
mod model_exchange;
mod part;
mod ports;
mod start;
mod unit;

pub use co_simulation::CoSimulation;
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
    /// From a text that may end in a line `  help: …`.
    pub fn of_text(text: &str) -> Self {
        match text.rsplit_once("\n  help: ") {
            Some((message, help)) => Refusal::new(message).help(help),
            None => Refusal::new(text),
        }
    }
}

impl From<BuildError> for Refusal {
    fn from(e: BuildError) -> Self {
        Refusal { message: e.message, help: e.help }
    }
}

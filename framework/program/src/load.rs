//! The catalogue of the program, and loading a simulation with it.
use crate::program::program;
use crate::voice::{MOST, report};
use linkwork_assembly::Loaded;
pub use linkwork_assembly::patterns::dotted;
use linkwork_runner::Library;
pub use linkwork_runner::{Ready, sim_file};
use linkwork_runtime::{Catalogue, Fault, Plan, Sources, Value};
use std::path::Path;

/// Returns all models and assemblies of this program.
pub fn library() -> Library {
    (program().library)()
}

/// Returns all models and services of this program.
pub fn catalogue() -> Catalogue {
    library().catalogue
}

/// Loads, compiles and places a simulation; prints all mistakes and returns the exit code if there are any.
pub fn ready(path: &Path, set: &[String], seed: Option<u64>) -> Result<Ready, u8> {
    library().file(path, set, seed).map_err(|failure| report(&failure))
}

/// Loads a simulation without compiling it: ground is not generated, and only text files are read.
pub fn loaded(path: &Path) -> Result<Loaded, u8> {
    let library = library();
    library
        .find(path)
        .and_then(|()| library.loaded(path, &[], None))
        .map_err(|failure| report(&failure))
}

/// Like [`ready`], from a resolved configuration (of a checkpoint).
pub fn ready_text(name: &str, text: &str) -> Result<Ready, u8> {
    ready_text_set(name, text, &[])
}

/// Like [`ready_text`], with `PATH=VALUE` overrides.
pub fn ready_text_set(name: &str, text: &str, set: &[String]) -> Result<Ready, u8> {
    library().text_with(name, text, set).map_err(|failure| report(&failure))
}

/// Prints the warnings of a simulation, each once.
pub fn warn(ready: &Ready) {
    warn_of(&ready.warnings(), &ready.loaded.sources);
}

/// Prints warnings that were collected before.
pub fn warn_of(warnings: &[Fault], sources: &Sources) {
    for fault in warnings.iter().take(MOST) {
        let place = sources.place(fault.origin);
        let at = place.map_or(String::new(), |(n, l, c)| format!("\n  --> {n}:{l}:{c}"));
        let help = fault.help.as_ref().map_or(String::new(), |h| format!("\n  help: {h}"));
        tell!("warning: {}{at}{help}", fault.message);
    }
    if warnings.len() > MOST {
        tell!("warning: and {} more warnings", warnings.len() - MOST);
    }
}

/// Returns the resolved parameters of a part, by path.
pub fn params_of<'a>(plan: &'a Plan, path: &str) -> Option<&'a Value> {
    plan.parts.iter().find(|p| p.path == path).map(|p| p.prototype.params())
}

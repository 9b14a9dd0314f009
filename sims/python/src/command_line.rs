//! `python -m linkwork`: the commands of the program `linkwork`, with models that are Python classes.
use crate::{package, parts};
use linkwork_cli::LINKWORK;
use linkwork_program::Program;
use linkwork_runner::Library;
use linkwork_runtime::Entry;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::ffi::OsString;
use std::sync::OnceLock;

/// The Python models of this process.
static MODELS: OnceLock<Vec<Entry>> = OnceLock::new();

/// Returns the library of the package with the Python models.
fn library() -> Library {
    let mut library = package::library();
    for entry in MODELS.get().into_iter().flatten() {
        // `_main` has checked that the names are free.
        let _ = library.catalogue.add(entry.clone());
    }
    library
}

/// Does what the command line says, and returns the exit code. A process can call this function once.
#[pyfunction]
pub fn _main(py: Python<'_>, arguments: Vec<OsString>, models: &Bound<'_, PyDict>) -> PyResult<u8> {
    let entries = parts::entries(Some(models))?;
    crate::files::library_with(entries.clone()).map_err(crate::error::refuse)?;
    MODELS.get_or_init(|| entries);
    let module = package::module();
    let package = module.rsplit_once('.').map_or(module, |(package, _)| package);
    let name = format!("python -m {package}");
    let examples = LINKWORK.examples.replace("  linkwork ", &format!("  {name} "));
    let examples = format!(
        "Models in Python: `{name} --models FILE.py COMMAND ..` reads the dictionary `models` = {{name: class}} of a Python file; repeatable.\n\n{examples}"
    );
    // The process ends after this call.
    let program = Program { name: name.leak(), examples: examples.leak(), library, ..LINKWORK };
    let all = std::iter::once(OsString::from(program.name)).chain(arguments).collect();
    Ok(py.detach(|| program.execute(all)))
}

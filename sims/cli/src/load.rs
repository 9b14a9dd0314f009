//! The catalogue of all component libraries, and loading a simulation with it.
use crate::exit;
use linkwork_assembly::{Failure, Loaded, Look, Options, load_file, load_text, put_down, tidy};
pub use linkwork_assembly::{dotted, numbers, only, texts};
use linkwork_runtime::{Catalogue, Fault, Files, Plan, Sources, Value, compile};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// Every model and service of the component libraries.
pub fn catalogue() -> Catalogue {
    Catalogue::new(linkwork_assemblies::libraries())
}

/// A simulation, compiled, with what else its file says.
pub struct Ready {
    /// As loaded.
    pub loaded: Loaded,
    /// As compiled.
    pub plan: Plan,
}

fn options<'a>(catalogue: &'a Catalogue, set: &[String], seed: Option<u64>) -> Options<'a> {
    let mut options = Options::new(catalogue);
    options.embedded = linkwork_assemblies::embedded();
    options.search = vec![PathBuf::from("assemblies")];
    options.overrides = set.to_vec();
    options.seed = seed;
    options
}

/// The sim.ron of a folder, or the file itself.
pub fn sim_file(path: &Path) -> PathBuf {
    if path.is_dir() { path.join("sim.ron") } else { path.to_path_buf() }
}

/// Loads, compiles and places; prints every mistake and gives the exit code when there are any.
pub fn ready(path: &Path, set: &[String], seed: Option<u64>) -> Result<Ready, u8> {
    let catalogue = catalogue();
    finish(read(path, &options(&catalogue, set, seed))?, &catalogue)
}

/// Loads without compiling: no ground is made, no file but the texts is read.
pub fn loaded(path: &Path) -> Result<Loaded, u8> {
    let catalogue = catalogue();
    read(path, &options(&catalogue, &[], None))
}

fn read(path: &Path, options: &Options<'_>) -> Result<Loaded, u8> {
    let file = sim_file(path);
    if !file.exists() && !options.embedded.contains_key(&file.display().to_string()) {
        eprintln!(
            "error: there is no simulation `{}`\n  help: name a sim.ron file or the folder that holds it, \
             from the folder you are in",
            file.display()
        );
        return Err(exit::INPUT);
    }
    load_file(file, options).map_err(|failure| report(&failure))
}

/// The same from a resolved configuration (of a checkpoint).
pub fn ready_text(name: &str, text: &str) -> Result<Ready, u8> {
    let catalogue = catalogue();
    let options = options(&catalogue, &[], None);
    let loaded = load_text(name, text, &options).map_err(|failure| report(&failure))?;
    finish(loaded, &catalogue)
}

fn finish(loaded: Loaded, catalogue: &Catalogue) -> Result<Ready, u8> {
    let files = Files::of(vec![PathBuf::from("."), PathBuf::from("assemblies")]);
    let faulty = |faults: Vec<Fault>, sources: &Sources| {
        report(&Failure { faults: tidy(faults), sources: sources.clone() })
    };
    let mut plan = compile(&loaded.spec, catalogue, &files)
        .map_err(|faults| faulty(faults.0, &loaded.sources))?;
    if let Some(place) = &loaded.simulation.place {
        put_down(&mut plan, place).map_err(|fault| faulty(vec![fault], &loaded.sources))?;
    }
    Ok(Ready { loaded, plan })
}

/// Prints a failure to standard error: drawn on a terminal, in three plain lines elsewhere.
pub fn report(failure: &Failure) -> u8 {
    let no_color = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    let look = match (std::io::stderr().is_terminal(), no_color) {
        (false, _) => Look::Plain,
        (true, true) => Look::Drawn,
        (true, false) => Look::Coloured,
    };
    eprint!("{}", failure.show(look));
    exit::INPUT
}

/// Names of all variables that may be logged or plotted.
pub fn names(plan: &Plan) -> Vec<&str> {
    plan.variables.keys().map(String::as_str).collect()
}

/// The parameters of a part as resolved, by path.
pub fn params_of<'a>(plan: &'a Plan, path: &str) -> Option<&'a Value> {
    plan.parts.iter().find(|p| p.path == path).map(|p| p.prototype.params())
}

/// A map for metadata.
pub type About = BTreeMap<String, String>;

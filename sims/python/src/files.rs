//! Reading mechanisms and simulations from files, with every model of the component libraries.
use linkwork_assembly::{Failure, Loaded, Options, load_file, load_text, put_down, tidy};
use linkwork_multibody::Multibody;
use linkwork_runtime::{Catalogue, Fault, Files, Plan, Sources, compile};
use std::path::{Path, PathBuf};

/// Every model and service of the component libraries.
pub fn catalogue() -> Catalogue {
    Catalogue::new([
        linkwork_basics::catalogue(),
        linkwork_actuators::catalogue(),
        linkwork_sensors::catalogue(),
        linkwork_mobility::catalogue(),
        linkwork_environment::catalogue(),
        linkwork_flight::catalogue(),
        linkwork_control::catalogue(),
        linkwork_power::catalogue(),
    ])
}

fn options(catalogue: &Catalogue) -> Options<'_> {
    let mut options = Options::new(catalogue);
    options.embedded = linkwork_assemblies::embedded();
    options.search = vec![PathBuf::from("assemblies")];
    options
}

/// The mechanism of a file.
pub fn multibody(path: &Path) -> Result<Multibody, String> {
    match path.extension().and_then(|e| e.to_str()) {
        Some("ron") | None => {
            let catalogue = catalogue();
            let loaded = read(path, &options(&catalogue))?;
            let none = || format!("`{}` has no mechanism\n  help: give it bodies", path.display());
            Ok((*loaded.spec.mechanism.ok_or_else(none)?.multibody).clone())
        }
        Some(other) => Err(format!(
            "`{}`: files of the kind `.{other}` cannot be read\n  help: give a .ron file, or the folder of a sim.ron",
            path.display()
        )),
    }
}

fn read(path: &Path, options: &Options<'_>) -> Result<Loaded, String> {
    let file = if path.is_dir() { path.join("sim.ron") } else { path.to_path_buf() };
    load_file(file, options).map_err(|f| f.to_string())
}

/// A simulation, compiled and put down.
pub struct Ready {
    /// As loaded.
    pub loaded: Loaded,
    /// As compiled.
    pub plan: Plan,
}

/// Loads and compiles a simulation with `PATH=VALUE` overrides.
pub fn simulation(path: &Path, set: &[String], seed: Option<u64>) -> Result<Ready, String> {
    let catalogue = catalogue();
    let mut options = options(&catalogue);
    options.overrides = set.to_vec();
    options.seed = seed;
    finish(read(path, &options)?, &catalogue)
}

/// The same from a text that needs no other file: the configuration in a checkpoint.
pub fn simulation_text(name: &str, text: &str) -> Result<Ready, String> {
    let catalogue = catalogue();
    let loaded = load_text(name, text, &options(&catalogue)).map_err(|f| f.to_string())?;
    finish(loaded, &catalogue)
}

fn finish(loaded: Loaded, catalogue: &Catalogue) -> Result<Ready, String> {
    let files = Files { folders: vec![PathBuf::from("."), PathBuf::from("assemblies")] };
    let faulty = |faults: Vec<Fault>, sources: &Sources| {
        Failure { faults: tidy(faults), sources: sources.clone() }.to_string()
    };
    let mut plan = compile(&loaded.spec, catalogue, &files)
        .map_err(|faults| faulty(faults.0, &loaded.sources))?;
    if let Some(place) = &loaded.simulation.place {
        put_down(&mut plan, place).map_err(|fault| faulty(vec![fault], &loaded.sources))?;
    }
    Ok(Ready { loaded, plan })
}

//! The rover of `sims/rover_traverse`, and small scenes with it, loaded as the command line does.
#![allow(dead_code, missing_docs)]
use linkwork_assembly::{Failure, Loaded, Options, load_file, load_text, put_down};
use linkwork_runtime::{Catalogue, Files, Program, Simulation};
use std::sync::Arc;

pub fn catalogue() -> Catalogue {
    Catalogue::new(linkwork_assemblies::libraries())
}

fn options<'a>(catalogue: &'a Catalogue, set: &[&str]) -> Options<'a> {
    let mut options = Options::new(catalogue);
    options.embedded = linkwork_assemblies::embedded();
    options.overrides = set.iter().map(|s| (*s).to_string()).collect();
    options
}

/// The finished program; every mistake in one text.
pub fn finish(loaded: Result<Loaded, Failure>, catalogue: &Catalogue) -> Result<Program, String> {
    let loaded = loaded.map_err(|f| f.render(false))?;
    let mut program = loaded.compile(catalogue, &Files::default()).map_err(|f| format!("{f:?}"))?;
    if let Some(place) = &loaded.simulation.place {
        let plan = Arc::get_mut(&mut program.phases[0].plan).ok_or("the plan is shared")?;
        put_down(plan, place).map_err(|f| format!("{f:?}"))?;
    }
    Ok(program)
}

/// A simulation of the repository, by its path below `sims`.
pub fn repository(path: &str, set: &[&str]) -> Result<Simulation, String> {
    let catalogue = catalogue();
    let file = linkwork_tests::root().join("sims").join(path);
    let program = finish(load_file(file, &options(&catalogue, set)), &catalogue)?;
    Ok(Simulation::of(Arc::new(program)))
}

/// `sims/rover_traverse` with parameters set from outside, at its start.
pub fn traverse(set: &[&str]) -> Result<Simulation, String> {
    let catalogue = catalogue();
    let file = linkwork_tests::root().join("sims/rover_traverse/sim.ron");
    let program = finish(load_file(file, &options(&catalogue, set)), &catalogue)?;
    Ok(Simulation::of(Arc::new(program)))
}

/// A simulation in RON.
pub fn scene(text: &str, set: &[&str]) -> Result<Simulation, String> {
    let catalogue = catalogue();
    let program = finish(load_text("scene.ron", text, &options(&catalogue, set)), &catalogue)?;
    Ok(Simulation::of(Arc::new(program)))
}

//! The behaviour of a model in a terminal: plots of the small simulation that a library contains for it.
use crate::picture::Picture;
use crate::{exit, load, run};
use linkwork_runtime::{RunError, Simulation};
use std::fmt::Write;
use std::sync::Arc;

/// Returns the path of the simulation of a model among the library's embedded files.
fn file(model: &str) -> String {
    format!("behaviours/{model}.ron")
}

/// Returns the behaviour of a model as text; empty if its library does not contain a simulation for it.
///
/// # Errors
/// The exit code, if the simulation cannot be loaded or fails. The error has been printed.
pub fn behaviour(model: &str) -> Result<String, u8> {
    let file = file(model);
    let Some(text) = load::library().embedded.get(&file).cloned() else { return Ok(String::new()) };
    let ready = load::ready_text(&file, &text)?;
    let doc = ready.loaded.simulation.doc.clone();
    let scene = run::prepare(&ready)?.scene.0;
    let Some(until) = ready.loaded.simulation.until else {
        tell!("error: `{file}` does not define when to stop\n  help: write `until` in it");
        return Err(exit::INPUT);
    };
    let mut sim = Simulation::of(Arc::new(ready.program));
    let mut picture = Picture::new(&sim, &scene, Some(until.times(1)));
    let failed = |e: RunError| {
        tell!("error: `{file}`: {e}");
        exit::FAILED
    };
    picture.sample(&sim);
    while sim.before(until) {
        sim.step().map_err(failed)?;
        picture.sample(&sim);
    }
    let mut out = String::from("\nbehaviour\n");
    let _ = writeln!(out, "{doc} It is `{file}`.\n{}", picture.text());
    Ok(out)
}

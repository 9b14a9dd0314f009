//! What a model does, in a terminal: the plots of the small simulation that a library keeps for it.
use crate::picture::Picture;
use crate::{exit, load, run};
use linkwork_runtime::{RunError, Simulation};
use std::fmt::Write;
use std::sync::Arc;

/// Where a library keeps the simulation of a model, among its embedded files.
fn file(model: &str) -> String {
    format!("behaviours/{model}.ron")
}

/// The behaviour of a model as text; empty where its library keeps none.
///
/// # Errors
/// The exit code, when the simulation does not load or run: the mistake has been told.
pub fn behaviour(model: &str) -> Result<String, u8> {
    let file = file(model);
    let Some(text) = load::library().embedded.get(&file).cloned() else { return Ok(String::new()) };
    let ready = load::ready_text(&file, &text)?;
    let doc = ready.loaded.simulation.doc.clone();
    let scene = run::prepare(&ready)?.scene.0;
    let Some(until) = ready.loaded.simulation.until else {
        tell!("error: nothing says when `{file}` is to stop\n  help: write `until` in it");
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

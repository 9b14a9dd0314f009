//! The rover of `sims/rover_traverse`, and small scenes with it, loaded as the command line does; files of the
//! reference data, and what flights are compared by.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]
use linkwork_assembly::form::Settings;
use linkwork_assembly::{Failure, Loaded, Options, load_file, load_text, place_machines};
use linkwork_runner::{Ended, Goal, Metrics, Pause, Runner, Watch, prepare};
use linkwork_runtime::{Catalogue, Entry, Files, Program, Seconds, Simulation};
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Quat, Vec3};
use serde_json::Value;
use std::collections::BTreeMap;
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
    let plan = Arc::get_mut(&mut program.phases[0].plan).ok_or("the plan is shared")?;
    place_machines(plan, &loaded.simulation.place).map_err(|f| format!("{f:?}"))?;
    Ok(program)
}

/// A simulation of the repository, by its path below `sims`.
pub fn repository(path: &str, set: &[&str]) -> Result<Simulation, String> {
    let catalogue = catalogue();
    let file = linkwork_tests::root().join("sims").join(path);
    let program = finish(load_file(file, &options(&catalogue, set)), &catalogue)?;
    Ok(Simulation::of(Arc::new(program)))
}

/// A simulation in a file of its own folder.
pub fn in_folder(file: &std::path::Path) -> Result<Simulation, String> {
    let catalogue = catalogue();
    let program = finish(load_file(file, &options(&catalogue, &[])), &catalogue)?;
    Ok(Simulation::of(Arc::new(program)))
}

/// Nobody watches.
struct Unwatched;

impl Watch for Unwatched {
    fn tick(&mut self, _: &Simulation) {}
}

/// What a simulation of the repository says of itself at its end: its metrics, in their units.
///
/// # Errors
/// What its file does not permit; a run that fails.
pub fn metrics(path: &str, set: &[&str]) -> Result<BTreeMap<String, f64>, String> {
    let catalogue = catalogue();
    let file = linkwork_tests::root().join("sims").join(path).join("sim.ron");
    figured(load_file(file, &options(&catalogue, set)), &catalogue)
}

/// The same of a text.
///
/// # Errors
/// As [`metrics`].
pub fn metrics_of(text: &str) -> Result<BTreeMap<String, f64>, String> {
    let catalogue = catalogue();
    figured(load_text("scene.ron", text, &options(&catalogue, &[])), &catalogue)
}

/// A program from a text, and what else the text says.
///
/// # Errors
/// What it does not permit.
pub fn program_of(text: &str) -> Result<(Program, Settings), String> {
    let catalogue = catalogue();
    let loaded = load_text("scene.ron", text, &options(&catalogue, &[]));
    let settings = loaded.as_ref().map(|l| l.simulation.clone()).ok();
    Ok((finish(loaded, &catalogue)?, settings.ok_or("no settings")?))
}

fn figured(
    loaded: Result<Loaded, Failure>,
    catalogue: &Catalogue,
) -> Result<BTreeMap<String, f64>, String> {
    let settings = loaded.as_ref().map(|l| l.simulation.clone()).ok();
    let program = finish(loaded, catalogue)?;
    let settings = settings.ok_or("no settings")?;
    let prepared = prepare(&program.phases[0].plan, &settings).map_err(|f| format!("{f:?}"))?;
    let (until, stop_when) = (settings.until, prepared.stop_when);
    let mut goal = Goal { until, stop_when, ..Goal::default() };
    let sim = Simulation::of(Arc::new(program));
    let mut runner = Runner::new(sim, Unwatched);
    runner.metric(prepared.metrics, None)?;
    match runner.go(&mut goal, u64::MAX) {
        Pause::Ended(Ended::Goal | Ended::StopWhen) => {}
        other => return Err(format!("{other:?}")),
    }
    let results = runner.metrics().into_iter().flat_map(Metrics::results);
    Ok(results.map(|(name, value, _)| (name.to_string(), value)).collect())
}

/// `sims/rover_traverse` with parameters set from outside, at its start.
pub fn traverse(set: &[&str]) -> Result<Simulation, String> {
    let catalogue = catalogue();
    let file = linkwork_tests::root().join("sims/rover_traverse/sim.ron");
    let program = finish(load_file(file, &options(&catalogue, set)), &catalogue)?;
    Ok(Simulation::of(Arc::new(program)))
}

/// The same with its resolved text, from which a checkpoint is rebuilt.
pub fn traverse_resolved(set: &[&str]) -> Result<(Simulation, String), String> {
    let catalogue = catalogue();
    let file = linkwork_tests::root().join("sims/rover_traverse/sim.ron");
    let loaded = load_file(file, &options(&catalogue, set));
    let text = loaded.as_ref().map_or(String::new(), |l| l.resolved.to_string());
    Ok((Simulation::of(Arc::new(finish(loaded, &catalogue)?)), text))
}

/// A simulation in RON.
pub fn scene(text: &str, set: &[&str]) -> Result<Simulation, String> {
    of_text(&catalogue(), text, set)
}

/// A simulation in RON with models of a test's own.
pub fn scene_with(own: Vec<Entry>, text: &str) -> Result<Simulation, String> {
    of_text(&Catalogue::new(linkwork_assemblies::libraries().into_iter().chain([own])), text, &[])
}

fn of_text(catalogue: &Catalogue, text: &str, set: &[&str]) -> Result<Simulation, String> {
    let program = finish(load_text("scene.ron", text, &options(catalogue, set)), catalogue)?;
    Ok(Simulation::of(Arc::new(program)))
}

/// A text of the reference data, by its path there. Without it the test says so and is skipped; with `CI=true` it fails.
pub fn reference_text(path: &str) -> Option<String> {
    let file = linkwork_tests::root().join("../shared/reference").join(path);
    match std::fs::read_to_string(file) {
        Ok(text) => Some(text),
        Err(e) if std::env::var("CI").is_ok_and(|v| v == "true") => panic!("{path}: {e}"),
        Err(_) => {
            println!("SKIPPED: no reference file {path}");
            None
        }
    }
}

/// A file of the reference flights, in the same way.
pub fn reference(name: &str) -> Option<Value> {
    reference_text(&format!("flight/{name}")).map(|text| serde_json::from_str(&text).unwrap())
}

pub fn seconds(x: f64) -> Seconds {
    Seconds::from_decimal(x).unwrap()
}

pub fn num(v: &Value) -> f64 {
    v.as_f64().unwrap()
}

pub fn row(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(num).collect()
}

pub fn rows(v: &Value) -> Vec<Vec<f64>> {
    v.as_array().unwrap().iter().map(row).collect()
}

pub fn vec3(v: &[f64]) -> Vec3 {
    Vec3::new(v[0], v[1], v[2])
}

/// In RON, no digit lost.
pub fn list(v: &[f64]) -> String {
    format!("[{}]", v.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", "))
}

/// Three variables x, y, z.
pub fn get(sim: &Simulation, name: &str) -> Vec3 {
    Vec3::from(["x", "y", "z"].map(|c| sim.get(&format!("{name}.{c}")).unwrap()))
}

/// Attitude of a free body, to W.
pub fn rotation(sim: &Simulation, body: &str) -> Quat {
    let [w, x, y, z] =
        ["w", "x", "y", "z"].map(|c| sim.get(&format!("{body}.rotation.{c}")).unwrap());
    Quat::from_quaternion(Quaternion::new(w, x, y, z))
}

/// Velocity of a free body in W: its rates are in body axes.
pub fn velocity(sim: &Simulation, body: &str) -> Vec3 {
    rotation(sim, body) * get(sim, &format!("{body}.velocity"))
}

/// The greatest of some errors; NaN is none of the small ones.
#[derive(Clone, Copy)]
pub struct Worst(pub f64);

impl Worst {
    pub fn take(&mut self, error: f64) {
        if !(error <= self.0) {
            self.0 = error;
        }
    }
    #[track_caller]
    pub fn below(self, limit: f64, what: &str) {
        println!("{what}: {:.3e} (at most {limit:.1e})", self.0);
        assert!(self.0 <= limit, "{what}: {:e}, more than {limit:e}", self.0);
    }
}

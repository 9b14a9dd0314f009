//! Runs of a campaign share texts and services; each is bit-identical with a run on its own.
use linkwork_assemblies::library;
use linkwork_campaign::{Campaign, LoadError};
use linkwork_runner::{Library, Ready};
use linkwork_runtime::Simulation;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn sims() -> PathBuf {
    linkwork_tests::root().join("sims")
}

fn read(path: &Path, library: &Library) -> Campaign {
    Campaign::read(path, library).unwrap_or_else(|f| panic!("{}", f.render(false)))
}

/// Everything that makes a run: its program, its configuration, the files that it read, and its state.
fn all(ready: Ready, steps: usize) -> (u64, String, String, Vec<u64>) {
    let (hash, text) = (ready.program.hash(), ready.loaded.resolved.to_string());
    let files = format!("{:?} {:?}", ready.files.prints(), ready.loaded.sources.files);
    let mut sim = Simulation::of(Arc::new(ready.program));
    let step = |_| {
        sim.step().unwrap();
        sim.hash()
    };
    (hash, text, files, (0..steps).map(step).collect())
}

/// Compares every run, in forward and reverse order after all others, with the same run loaded alone.
fn compare(campaign: &Campaign, library: &Library, steps: usize) {
    let runs = campaign.form().runs;
    for run in (0..runs).chain((0..runs).rev()) {
        let shared = match campaign.load(run, library) {
            Ok(ready) => ready,
            Err(LoadError::Refused(f)) => panic!("run {run}: {}", f.render(false)),
            Err(LoadError::Changed(file)) => panic!("run {run}: {file} has changed"),
        };
        let alone =
            library.file(campaign.simulation(), &campaign.overrides(run), campaign.seed(run));
        let alone = alone.unwrap_or_else(|f| panic!("run {run}: {}", f.render(false)));
        assert_eq!(all(shared, steps), all(alone, steps), "run {run}");
    }
}

/// A campaign over a supplied simulation.
fn of(simulation: &str, rest: &str, steps: usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("c.ron");
    let simulation = sims().join(simulation).display().to_string();
    std::fs::write(
        &path,
        format!("Campaign(simulation: {simulation:?}, runs: 4, seed: 7, {rest})"),
    )
    .unwrap();
    let library = library();
    compare(&read(&path, &library), &library, steps);
}

#[test]
fn parameters_of_parts_and_bodies_and_the_noise() {
    of(
        "attitude/sim.ron",
        r#"set: { "Software.Pointing.frequency": 0.3 }, vary: {
            "coils": Uniform(from: 300, to: 500),
            "craft.mass": Normal(mean: 600, deviation: 5),
            "craft.initial.angular": [Normal(mean: 0.001, deviation: 1e-4), 0, 0],
            "Wheel1.coulomb": Choice(of: [0.001, 0.002]),
        }"#,
        300,
    );
}

#[test]
fn services_that_are_drawn_and_services_that_are_not() {
    // Each run has a separate atmosphere; all share one gravity field.
    let library = library();
    let dispersions = read(&sims().join("ballistic_entry/dispersions.ron"), &library);
    let mut form = dispersions.form().clone();
    form.runs = 6;
    compare(&Campaign::new(form, &library).unwrap_or_else(|f| panic!("{f}")), &library, 50);
}

#[test]
fn parameters_of_the_simulation_that_services_follow() {
    // The degree of the harmonics is read from a file; other services keep theirs.
    of(
        "earth_orbit/sim.ron",
        r#"vary: { "degree": Choice(of: [4, 8]), "craft.mass": Uniform(from: 900, to: 1100) }"#,
        40,
    );
}

#[test]
fn phases() {
    of(
        "staging/sim.ron",
        r#"set: { "metrics": { "x": { "of": "booster.position.x", "take": "last" } } },
        vary: { "booster.mass": Uniform(from: 380, to: 420) }"#,
        300,
    );
}

#[test]
fn ground_that_is_drawn_and_ground_that_is_not() {
    of(
        "rover_traverse/sim.ron",
        r#"vary: {
            "Rover.Hardware.Wheels.Wheel1.Motor.resistance": Uniform(from: "0.5 ohm", to: "0.8 ohm"),
            "Rover.Environment.spacing": Choice(of: [0.5, 1]),
        }"#,
        20,
    );
}

const GRAVITY: &str = "earth_orbit/ggm03s_20.txt";

#[test]
fn files_that_are_drawn_and_files_that_change() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let field = std::fs::read_to_string(sims().join(GRAVITY)).unwrap();
    let other = field.replacen("E-0", "E-1", 40);
    assert_ne!(field, other);
    write("a.txt", &field);
    write("b.txt", &other);
    write(
        "sim.ron",
        &std::fs::read_to_string(sims().join("earth_orbit/full_force.ron"))
            .unwrap()
            .replace("ggm03s_20.txt", "a.txt"),
    );
    write(
        "c.ron",
        r#"Campaign(simulation: "sim.ron", runs: 6, seed: 1, vary: { "Environment.Gravity.file": Choice(of: ["a.txt", "b.txt"]) })"#,
    );
    let library = library();
    let campaign = read(&folder.path().join("c.ron"), &library);
    compare(&campaign, &library, 5);
    // Cached content of a file is not used for another file of the same name and length.
    write("a.txt", &field.replacen("E-0", "E-2", 1));
    let changed = (0..6).filter(|run| match campaign.load(*run, &library) {
        Err(LoadError::Changed(file)) => file.ends_with("a.txt"),
        Ok(_) => false,
        Err(LoadError::Refused(f)) => panic!("{f}"),
    });
    let drawn = (0..6).filter(|run| campaign.overrides(*run)[0].contains("a.txt"));
    assert_eq!(changed.collect::<Vec<_>>(), drawn.collect::<Vec<_>>());
    // The same holds for a text.
    write("a.txt", &field);
    let text = std::fs::read_to_string(folder.path().join("sim.ron")).unwrap();
    write("sim.ron", &text.replacen("until: ", "until:  ", 1));
    assert!(
        matches!(campaign.load(0, &library), Err(LoadError::Changed(file)) if file.ends_with("sim.ron"))
    );
}

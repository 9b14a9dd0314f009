//! FMUs in forks, snapshots and checkpoints; FMUs that cannot be copied.
use super::support::{Bench, Model, compiler, run, seconds};
use linkwork_runtime::{Checkpoint, Simulation, Snapshot};

fn text(kind: &str, file: &str) -> String {
    let (rate, sine) = match kind {
        "co_simulation" => ("rate: \"10 ms\", ", "Drive.y -> Unit.force"),
        _ => ("", "Drive.y -> Unit.force"),
    };
    let (wires, drive) = match file {
        "spring.fmu" => (
            sine,
            r#""Drive": (model: "basics.sine", params: { "amplitude": 1.0, "frequency": "2 Hz" }),"#,
        ),
        _ => ("", ""),
    };
    let wires = if wires.is_empty() { String::new() } else { format!("\"{wires}\"") };
    format!(
        r#"Simulation(
    parts: {{ {drive} "Unit": (model: "fmi.{kind}", {rate}params: {{ "file": "{file}" }}) }},
    wires: [{wires}], step: "10 ms", integrator: "dormand_prince_54", until: "2 s",
)"#
    )
}

#[test]
fn a_run_with_a_unit_may_be_cut_anywhere() {
    if !compiler() {
        return;
    }
    for version in [2, 3] {
        for (model, file) in [(Model::Spring, "spring.fmu"), (Model::Ball, "ball.fmu")] {
            for kind in ["co_simulation", "model_exchange"] {
                let bench = Bench::new();
                bench.unit(file, version, model, |t| t);
                let text = text(kind, file);
                cut(&bench, &text, &format!("FMI {version} {file} {kind}"));
            }
        }
    }
}

fn cut(bench: &Bench, text: &str, what: &str) {
    let mut straight = bench.sim(text).unwrap();
    run(&mut straight, 1.0);
    let end = straight.hash();
    // A checkpoint is loaded from its file into new objects, as in a new process, also after
    // events.
    let mut first = bench.sim(text).unwrap();
    let mut cuts = 0;
    while first.time() < 0.95 {
        first.step_event().unwrap();
        if cuts % 20 == 0 || first.state().since > 0.0 {
            let file = bench.path("state.lwck");
            first.checkpoint("").unwrap().write(&file).unwrap();
            let mut second = bench.sim(text).unwrap();
            second.restore(&Checkpoint::read(&file).unwrap()).unwrap();
            assert_eq!(second.hash(), first.hash(), "{what}");
            run(&mut second, 1.0);
            assert_eq!(second.hash(), end, "{what}: restored");
        }
        cuts += 1;
    }
    // Forks and snapshots continue as well, and parallel runs do not affect each other.
    let mut origin = bench.sim(text).unwrap();
    run(&mut origin, 0.43);
    let mut snapshot = Snapshot::default();
    origin.save_into(&mut snapshot);
    let mut fork = origin.fork();
    run(&mut origin, 0.7);
    run(&mut fork, 1.0);
    assert_eq!(fork.hash(), end, "{what}: fork");
    origin.load_from(&snapshot).unwrap();
    run(&mut origin, 1.0);
    assert_eq!(origin.hash(), end, "{what}: snapshot");
    // This fork is at the first instant, before any query of the FMU.
    let mut fork = bench.sim(text).unwrap().fork();
    run(&mut fork, 1.0);
    assert_eq!(fork.hash(), end, "{what}: fork of the start");
}

fn without(attribute: &'static str) -> impl Fn(String) -> String {
    move |t: String| t.replace(&format!("{attribute}=\"true\""), &format!("{attribute}=\"false\""))
}

#[test]
fn a_unit_that_cannot_save_refuses_with_its_path() {
    if !compiler() {
        return;
    }
    for (version, attribute) in [
        (2, "canGetAndSetFMUstate"),
        (2, "canSerializeFMUstate"),
        (3, "canGetAndSetFMUState"),
        (3, "canSerializeFMUState"),
    ] {
        for kind in ["co_simulation", "model_exchange"] {
            let bench = Bench::new();
            bench.unit("spring.fmu", version, Model::Spring, |t| t);
            let mut whole = bench.sim(&text(kind, "spring.fmu")).unwrap();
            run(&mut whole, 0.5);
            bench.unit("spring.fmu", version, Model::Spring, without(attribute));
            let mut sim = bench.sim(&text(kind, "spring.fmu")).unwrap();
            // The simulation runs, although the FMU cannot save its state.
            run(&mut sim, 0.3);
            let told = |e: String| {
                assert!(e.contains("`Unit`") && e.contains(attribute), "{e}");
            };
            told(sim.can_save().unwrap_err().to_string());
            told(sim.checkpoint("").unwrap_err().to_string());
            let mut snapshot = Snapshot::default();
            sim.save_into(&mut snapshot);
            told(sim.load_from(&snapshot).unwrap_err().to_string());
            let mut fork: Simulation = sim.fork();
            told(fork.run_until(seconds(0.5)).unwrap_err().to_string());
            // None of these errors affects the run.
            run(&mut sim, 0.5);
            assert_eq!(sim.get("Unit.x").unwrap(), whole.get("Unit.x").unwrap());
        }
    }
}

#[test]
fn a_unit_that_cannot_save_stays_in_one_phase() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    let phases = r#"Simulation(
    parts: { "Unit": (model: "fmi.co_simulation", rate: "10 ms", params: { "file": "spring.fmu" }) },
    step: "10 ms", until: "1 s", start: "one",
    phases: { "one": (to: { "two": "Unit.x < 0.9 m" }), "two": (step: "5 ms") },
)"#;
    bench.unit("spring.fmu", 2, Model::Spring, |t| t);
    let mut sim = bench.sim(phases).unwrap();
    run(&mut sim, 1.0);
    assert_eq!(sim.phase(), "two");
    let mut alone = bench.sim(&phases.replace("0.9 m", "-9 m")).unwrap();
    run(&mut alone, 1.0);
    assert_eq!(sim.get("Unit.x").unwrap(), alone.get("Unit.x").unwrap(), "it went over whole");
    bench.unit("spring.fmu", 2, Model::Spring, without("canSerializeFMUstate"));
    let told = bench.sim(phases).err().unwrap();
    assert!(
        told.contains("the state of `Unit` cannot be transferred from phase `one` to `two`"),
        "{told}"
    );
    assert!(told.contains("help"), "{told}");
}

#[test]
fn a_checkpoint_of_another_unit_is_refused() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    bench.unit("spring.fmu", 3, Model::Spring, |t| t);
    let text = text("co_simulation", "spring.fmu");
    let mut sim = bench.sim(&text).unwrap();
    run(&mut sim, 0.1);
    let saved = sim.checkpoint("").unwrap();
    // The file has changed since the checkpoint.
    bench.unit("spring.fmu", 3, Model::Spring, |t| t.replace("start=\"4\"", "start=\"5\""));
    let told = bench.sim(&text).unwrap().restore(&saved).unwrap_err().to_string();
    assert!(told.contains("files"), "{told}");
    // These bytes are not a state of the FMU.
    bench.unit("spring.fmu", 3, Model::Spring, |t| t);
    let mut damaged = saved.clone();
    for bytes in damaged.stores.values_mut() {
        bytes.truncate(bytes.len() - 9);
    }
    let told = bench.sim(&text).unwrap().restore(&damaged).unwrap_err().to_string();
    assert!(told.contains("`Unit`"), "{told}");
}

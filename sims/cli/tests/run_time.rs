//! Errors during a run: runaway states, Ctrl-C, full disks. Also the memory of long runs.
use crate::common;
use common::{Lab, Said, Small, edited, names, signal, wait_for};
use linkwork_record::read_log;
use std::process::Child;
use std::time::Duration;

/// A state that grows as exp(20 t): 1e15 at t = 34.5/20 = 1.727 s.
fn runaway() -> String {
    edited(&[
        (
            "\"Source\": (",
            "\"Blow\": (model: \"basics.integrator\", params: { \"k\": 20, \"start\": 1 }),\n\"Source\": (",
        ),
        ("wires: [", "wires: [\"Blow.y -> Blow.u\", "),
        ("until: \"1 s\"", "until: \"5 s\""),
        ("of: \"bob.rate\", take: \"max\", unit: \"rad/s\"", "of: \"Blow.y\", take: \"max\""),
    ])
}

/// A transition is one line; `--verbose` adds the parts, and momentum and energy, which a new hinge does not change here.
#[test]
fn a_transition_is_one_line_unless_details_are_asked_for() {
    let lab = Lab::new();
    let phases = "phases: { \"swings\": (to: { \"flies\": \"time > 0.5 s\" }), \
                  \"flies\": (remove: [\"Friction\"], bodies: { \"bob\": (hinge: Free, initial: None) }) },\n    start: \"swings\", until: \"0.6 s\"";
    let angle = "of: \"bob.rate\", take: \"max\", unit: \"rad/s\"";
    let text = edited(&[
        ("until: \"1 s\"", phases),
        (angle, "of: \"Lag.y\""),
        ("plots: [(title: \"Angle\", of: [\"bob.angle\"], unit: \"deg\")],", ""),
    ]);
    lab.write("sim.ron", &text);
    let line = "`swings` → `flies`: time > 0.5 s";
    let short = lab.run("sim.ron", "short", &[]).code(0).tells(&[line]);
    let long = lab.run("sim.ron", "long", &["--verbose"]).code(0).tells(&[
        line,
        "parts gone: Friction",
        "on another hinge: bob",
        " N s, unchanged; angular momentum (",
        " J, unchanged",
    ]);
    assert!(!short.err.contains("Friction") && !short.err.contains("momentum"), "{}", short.err);
    assert!(!long.err.contains("e0, "), "{}", long.err);
}

#[test]
fn a_runaway_stops_with_its_name_and_time() {
    let lab = Lab::new();
    lab.write("sim.ron", &runaway());
    let said = lab.run("sim.ron", "out", &[]).code(1).tells(&[
        "`Blow.state.x` became",
        "t = 1.7",
        "help: ",
    ]);
    assert_eq!(said.err.matches("error: ").count(), 1, "{}", said.err);
    assert_eq!(
        names(&lab.path("out")),
        ["before_failure.lwck", "plots.svg", "run.mcap", "summary.json"]
    );
    let summary = lab.summary("out");
    assert!(summary["ended"]["failed"].as_str().unwrap().contains("Blow.state.x"), "{summary}");
    let log = read_log(&lab.path("out/run.mcap")).unwrap();
    let blow = &log["Blow.y"];
    assert!(
        blow.t.last().unwrap() > &1.7 && blow.y.iter().all(|y| y.is_finite()),
        "{:?}",
        blow.t.last()
    );
    // The checkpoint is from an earlier time, and its metrics as well.
    lab.resume("out/before_failure.lwck", "before", &["--until", "1.5s"]).code(0);
    let largest = lab.summary("before")["metrics"]["largest speed"][0].as_f64().unwrap();
    assert!((largest - 30f64.exp()).abs() < 1e-2 * largest, "exp(30) against {largest}");
    lab.resume("out/before_failure.lwck", "again", &[]).code(1).tells(&["`Blow.state.x` became"]);
    assert_eq!(lab.hash("again"), lab.hash("out"), "the failure is not repeated bit by bit");
}

/// Reference-FMUs #612: a run that continues beyond its stop time.
#[test]
fn an_end_between_two_steps_is_told_and_a_condition_meets_it() {
    let lab = Lab::new();
    lab.write("sim.ron", &edited(&[]));
    let late = lab.run("sim.ron", "late", &["--until", "0.5003 s"]).code(0);
    let late =
        late.tells(&["`until`, 0.5003 s, is between two steps", "stop_when: \"time >= 0.5003 s\""]);
    assert!(
        late.err.contains(&format!("ended at {} s", lab.summary("late")["time"])),
        "{}",
        late.err
    );
    assert!(lab.summary("late")["time"].as_f64().unwrap() > 0.5003);
    let on = lab.run("sim.ron", "on", &["--until", "0.5 s"]).code(0);
    assert!(!on.err.contains("between two steps"), "{}", on.err);
    lab.write(
        "cut.ron",
        &edited(&[("until: \"1 s\"", "until: \"1 s\", stop_when: \"time >= 0.5003 s\"")]),
    );
    lab.run("cut.ron", "cut", &[]).code(0);
    let time = lab.summary("cut")["time"].as_f64().unwrap();
    assert!((time - 0.5003).abs() < 1e-9, "{time}");
}

#[test]
fn a_number_that_is_none_stops_too() {
    let lab = Lab::new();
    lab.write(
        "sim.ron",
        &edited(&[("\"value\": 1 ", "\"value\": 1e308 "), ("\"k\": 2", "\"k\": 1e10")]),
    );
    lab.run("sim.ron", "out", &[]).code(1).tells(&["Gain.y` became inf", "t = 0"]);
    assert!(read_log(&lab.path("out/run.mcap")).is_ok());
}

/// A satellite-like fall through the end of a canopy's table: the run ends at that instant with the part, the fault and the remedy; a run that
/// continues from before ends in the same way. A start there is rejected.
#[test]
fn a_model_stops_the_run_with_its_words() {
    let lab = Lab::new();
    let text = |speed: f64| {
        format!(
            r#"Simulation(
    bodies: {{ "pack": (parent: "world", hinge: Free, mass: 1e6, inertia: [10, 10, 10], initial: (position: [0, 0, 9000], velocity: [0, 0, -{speed}])) }},
    parts: {{
        "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -50] }}),
        "Air": (model: "environment.exponential_atmosphere", params: {{ "temperature": 210, "density": 0.020, "scale_height": 11100, "gas_constant": 191.8, "heat_ratio": 1.33, "heating_constant": 1.9027e-4 }}),
        "Canopy": (model: "flight.canopy", params: {{ "diameter": 1, "drag_coefficient": 0.67, "filling_time": 1, "packed": 0.1, "start": "90 s", "efficiency": [[0, 1], [1, 0.8]], "outside": stop }}, bind: {{ "canopy": "node:pack" }}),
    }},
    step: "10 ms", integrator: "rk4", until: "5 s",
    log: [(channels: ["Canopy.**"], rate: "10 Hz")],
)"#
        )
    };
    lab.write("sim.ron", &text(200.0));
    lab.linkwork(&["check", "sim.ron"]).code(0);
    let words = [
        "`Canopy`: Mach 1.0000 is beyond the rows of `efficiency`, which end at 1",
        "help: extend the rows, or write `outside: clamp`",
    ];
    let said = lab.run("sim.ron", "out", &[]).code(1).tells(&words).tells(&["t = 0.6"]);
    assert!(said.err.matches("error: ").count() == 1 && !said.err.contains("NaN"), "{}", said.err);
    assert!(said.err.matches("Mach 1.0000").count() == 1, "{}", said.err);
    let summary = lab.summary("out");
    assert!(summary["ended"]["failed"].as_str().unwrap().contains(words[0]), "{summary}");
    lab.resume("out/before_failure.lwck", "again", &[]).code(1).tells(&words);
    assert_eq!(lab.hash("again"), lab.hash("out"), "the end is not repeated bit by bit");
    lab.write("late.ron", &text(300.0));
    for verb in ["check", "run"] {
        let said = lab.linkwork(&[verb, "late.ron"]).code(1);
        said.tells(&["t = 0 s: `Canopy`: Mach 1.2", words[1]]);
    }
}

fn ended(child: Child) -> Said {
    child.wait_with_output().unwrap().into()
}

#[test]
fn ctrl_c_ends_in_order() {
    let lab = Lab::new();
    lab.write("sim.ron", common::BASE);
    let child = lab.spawn(&[
        "run",
        "sim.ron",
        "--out",
        "out",
        "--save-rrd",
        "off",
        "--until",
        "1000s",
        "--realtime",
    ]);
    wait_for(&lab.path("out/run.mcap"));
    std::thread::sleep(Duration::from_millis(500));
    signal(&child, "INT");
    ended(child).code(130);
    let summary = lab.summary("out");
    let t = summary["time"].as_f64().unwrap();
    assert_eq!(summary["ended"], "interrupted");
    assert!(t > 0.1 && t < 900.0, "{t}");
    let log = read_log(&lab.path("out/run.mcap")).unwrap();
    assert!((log["bob.angle"].t.last().unwrap() - t).abs() < 0.011, "the log ends before {t}");
    let until = format!("{}", t.ceil() + 1.0);
    lab.resume("out/interrupted.lwck", "rest", &["--until", &until]).code(0);
    lab.run("sim.ron", "straight", &["--until", &until]).code(0);
    assert_eq!(lab.hash("rest"), lab.hash("straight"));
    assert_eq!(
        names(&lab.path("out")),
        ["interrupted.lwck", "plots.svg", "run.mcap", "summary.json"]
    );
}

#[test]
fn a_full_disk_leaves_a_log_and_a_checkpoint() {
    let lab = Lab::new();
    lab.write("sim.ron", &edited(&[("rate: \"100 Hz\"", "rate: \"1 kHz\"")]));
    let Some(_small) = Small::mount(lab.path("small"), "8m") else {
        println!("skipped: a small file system cannot be mounted here");
        return;
    };
    let said = lab.run("sim.ron", "small/out", &["--until", "1000s"]).code(1);
    let said = said.tells(&["the disk is full", "help: "]);
    assert_eq!(said.err.matches("error: ").count(), 1, "{}", said.err);
    let summary = lab.summary("small/out");
    let t = summary["time"].as_f64().unwrap();
    let log = read_log(&lab.path("small/out/run.mcap")).unwrap();
    let last = *log["bob.angle"].t.last().unwrap();
    assert!(last > 1.0 && last <= t && t < 1000.0, "the log ends at {last} s, the run at {t} s");
    let until = format!("{}", t.ceil() + 1.0);
    lab.resume("small/out/interrupted.lwck", "rest", &["--until", &until]).code(0);
    lab.run("sim.ron", "straight", &["--until", &until, "--no-log"]).code(0);
    assert_eq!(lab.hash("rest"), lab.hash("straight"));
}

#[test]
fn a_folder_that_cannot_be_written_is_refused() {
    let lab = Lab::new();
    lab.write("sim.ron", common::BASE);
    lab.write("file", "no folder");
    lab.run("sim.ron", "file/out", &[]).code(2).tells(&["file/out", "cannot be created"]);
    let Some(_small) = Small::mount(lab.path("small"), "1m") else { return };
    let said = lab.run("sim.ron", "small/out", &[]);
    assert!(said.code == 1 || said.code == 2, "{said:?}");
    said.tells(&["run.mcap", "help: "]);
}

/// Returns the largest resident memory of a run (MB).
fn peak(lab: &Lab, until: &str) -> f64 {
    let mut child = lab.spawn(&[
        "run",
        "sim.ron",
        "--out",
        &format!("out{until}"),
        "--save-rrd",
        "off",
        "--until",
        until,
        "--quiet",
    ]);
    let status = format!("/proc/{}/status", child.id());
    let mut largest = 0.0f64;
    while child.try_wait().unwrap().is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|l| l.strip_prefix("VmHWM:"));
        let kb = line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok());
        largest = largest.max(kb.unwrap_or(0.0) / 1024.0);
        std::thread::sleep(Duration::from_millis(1));
    }
    assert!(child.wait().unwrap().success());
    largest
}

#[test]
fn long_runs_need_no_more_memory() {
    let lab = Lab::new();
    lab.write("sim.ron", &edited(&[("rate: \"100 Hz\"", "rate: \"1 kHz\"")]));
    if !std::path::Path::new("/proc/self/status").exists() {
        println!("skipped: no /proc here");
        return;
    }
    let (one, ten) = (peak(&lab, "60s"), peak(&lab, "600s"));
    println!("peak of 1 min {one:.1} MB, of 10 min {ten:.1} MB");
    assert!(one > 1.0 && ten < one + 20.0, "1 min: {one:.1} MB, 10 min: {ten:.1} MB");
}

/// The balances are printed at the end of a run, and are in the summary with their tolerance. A part whose balance is not closed is named in both.
#[test]
fn balances_are_printed_with_their_tolerance() {
    let lab = Lab::new();
    // A step of 15 ms on a motor with a time constant of 7 ms is stable but inaccurate.
    let motor = |step: &str| {
        format!(
            r#"Simulation(
        bodies: {{ "wheel": (parent: "world", hinge: Pin([0, 0, 1]), mass: 2, inertia: [0.1, 0.1, 0.01]) }}, gravity: "none",
        parts: {{
            "Supply": (model: "power.ideal_supply", params: {{ "voltage": 24 }}),
            "Volts": (model: "basics.sine", params: {{ "amplitude": 20, "frequency": 20 }}),
            "Motor": (model: "actuators.dc_motor", bind: {{ "shaft": "hinge:wheel" }}, params: {{ "resistance": 1, "torque_constant": 0.05, "gear": 20 }}),
        }},
        connect: [("Motor.supply", "Supply.terminal")], wires: ["Volts.y -> Motor.volts"],
        step: "{step}", integrator: "rk4", until: "3 s",
    )"#
        )
    };
    for (name, step, closed) in [("fine", "1 ms", true), ("coarse", "15 ms", false)] {
        lab.write("sim.ron", &motor(step));
        let said = lab.run("sim.ron", name, &[]).code(0);
        let printed = format!("{}{}", said.out, said.err);
        let energy = &lab.summary(name)["balances"]["energy"];
        let part = &energy["parts"]["Mechanism"];
        let [residual, tolerance] = ["residual", "tolerance"]
            .map(|key| part[key].as_f64().unwrap_or_else(|| panic!("{energy}")));
        assert_eq!(residual.abs() <= tolerance, closed, "{energy}");
        let line = |text: &str| printed.lines().any(|line| line.starts_with(text));
        if closed {
            assert!(line("balance of energy: closed, residual"), "{printed}");
            assert!(energy.get("not_closed").is_none() && !printed.contains("is not closed"));
        } else {
            assert!(line("balance of energy: not closed for `Mechanism`"), "{printed}");
            assert_eq!(energy["not_closed"], serde_json::json!(["Mechanism"]), "{energy}");
            assert!(
                printed.contains("the balance of energy of `Mechanism` is not closed"),
                "{printed}"
            );
        }
    }
}

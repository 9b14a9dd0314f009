//! Telemetry of other programs in the viewer: a table alone, and next to the log of a run, with the differences.
#![cfg(feature = "viewer")]
use crate::common::{Lab, sim};
use linkwork_viz::read_recording;
use std::fmt::Write;

/// A block that is thrown and rotates about z at 0.5 rad/s, with a flap. No body is followed: poses are in W.
const THROWN: &str = r#"Simulation(
    bodies: {
        "block": (
            parent: "world", hinge: Free, mass: 2, inertia: Sphere(0.1), shapes: [Box([0.4, 0.3, 0.2])],
            initial: (position: [1, 2, 30], velocity: [3, 0, 4], angular: [0, 0, 0.5]),
        ),
        "flap": (parent: "block", at: (position: [0.2, 0, 0]), hinge: Locked, shapes: [Box([0.1, 0.1, 0.01])]),
    },
    parts: { "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.80665] }) },
    step: "10 ms", until: "1 s", integrator: "dormand_prince_54",
    log: [(channels: ["block.**"], rate: "20 Hz")],
    view: (rate: "20 Hz", eye: [-4, -5, 33], trails: ["block"]),
)"#;

const FLOWN: &str = r#"Telemetry(
    doc: "Half a metre to the side, three degrees ahead.",
    simulation: "sim.ron",
    table: "flown.csv",
    time: (column: ["clock", "ms"], zero: "12 s"),
    bodies: {
        "block": (
            position: (axes: "world", x: ["x", "ft"], y: "y [cm]", z: "z"),
            attitude: (axes: "world", yaw: ["psi", "deg"], pitch: ["theta", "deg"], roll: ["phi", "deg"]),
        ),
    },
    curves: { "Climb": (column: ["climb", "km/h"], variable: "block.velocity.z"), "Battery": (column: ["volts", "V"]) },
)"#;

/// Returns rows every 100 ms from 0.2 to 0.8 s of the simulation.
fn table() -> String {
    let mut text = String::from("clock,x,y [cm],z,psi,theta,phi,climb,volts,note\n");
    for k in 2..=8 {
        let t = 0.1 * f64::from(k);
        let z = 30.0 + 4.0 * t - 0.5 * 9.80665 * t * t;
        let psi = (0.5 * t).to_degrees() + 3.0;
        let climb = (4.0 - 9.80665 * t + 0.25) * 3.6;
        let (clock, x) = (12000 + 100 * k, (1.0 + 3.0 * t) / 0.3048);
        let volts = if k == 5 { String::new() } else { format!("{}", 28.0 - t) };
        writeln!(text, "{clock},{x},250,{z},{psi},0,0,{climb},{volts},row {k}").unwrap();
    }
    text
}

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("sim.ron", THROWN);
    lab.write("flown.ron", FLOWN);
    lab.write("flown.csv", &table());
    lab
}

/// Returns the number after a word.
fn number(text: &str, after: &str) -> f64 {
    let rest =
        &text[text.find(after).unwrap_or_else(|| panic!("no `{after}`:\n{text}")) + after.len()..];
    rest.split_whitespace().next().unwrap().parse().unwrap_or_else(|e| panic!("{e}: {rest}"))
}

#[test]
fn a_flight_beside_its_simulation_with_the_differences() {
    let lab = lab();
    lab.linkwork(&["run", "sim.ron", "--out", "out"]).code(0);
    let args = ["view", "out/run.mcap", "--flown", "flown.ron", "--out", "both.rrd"];
    let said = lab.linkwork(&args).code(0);
    assert!(said.err.is_empty(), "{}", said.err);
    // The table has seven rows, all at instants of the log; they differ by half a metre in y and by
    // three degrees.
    assert!(said.out.contains("block: 7 rows of the table"), "{}", said.out);
    assert!((number(&said.out, "position: at most ") - 0.5).abs() < 1e-4, "{}", said.out);
    assert!((number(&said.out, "attitude: at most ") - 3.0).abs() < 1e-3, "{}", said.out);
    assert!((number(&said.out, "Climb: at most ") - 0.9).abs() < 1e-4, "{}", said.out);
    assert!(said.out.contains(" km/h apart"), "{}", said.out);
    let shown = read_recording(&lab.path("both.rrd")).unwrap();
    let series =
        |name: &str| shown.get(name).unwrap_or_else(|| panic!("{name}: {:#?}", shown.keys()));
    let (t, y) = series("tf#/flown/block Transform3D:translation[1]");
    let simulated = series("tf#/block Transform3D:translation[1]");
    for (t, y) in t.iter().zip(y).filter(|(t, _)| (0.199..0.801).contains(*t)) {
        assert!((y - 2.5).abs() < 1e-6, "{t}: {y}");
    }
    assert!(simulated.1.iter().all(|y| (y - 2.0).abs() < 1e-6));
    let (t, d) = series("/plots/block__flown_minus_simulated__m/y Scalars:scalars[0]");
    assert!(t.len() == 7 && (t[0] - 0.2).abs() < 1e-9, "{t:?}");
    assert!(d.iter().all(|d| (d - 0.5).abs() < 1e-9), "{d:?}");
    let (_, angle) =
        series("/plots/block__angle_between_flown_and_simulated__deg/angle Scalars:scalars[0]");
    assert!(angle.iter().all(|a| (a - 3.0).abs() < 1e-6), "{angle:?}");
    // The recording contains the curve in its own unit, the variable next to it, and the
    // difference.
    let (_, flown) = series("/plots/Climb/flown Scalars:scalars[0]");
    let (_, run) = series("/plots/Climb/simulated Scalars:scalars[0]");
    assert!((flown[0] - (4.25 - 1.96133) * 3.6).abs() < 1e-6 && (run[0] - 4.0 * 3.6).abs() < 1e-6);
    let (_, d) = series("/plots/Climb__flown_minus_simulated/difference Scalars:scalars[0]");
    assert!(d.iter().all(|d| (d - 0.9).abs() < 1e-6), "{d:?}");
    // The recording contains both trails, and the shapes of the recorded body with its attached
    // bodies.
    for entity in [
        "/trails/block ",
        "/trails/flown/block ",
        "/flown/block/shapes/block/",
        "/flown/block/shapes/flap/",
    ] {
        assert!(shown.keys().any(|k| k.starts_with(entity)), "{entity}: {:#?}", shown.keys());
    }
    // The view of the run itself does not change.
    lab.linkwork(&["view", "out/run.mcap", "--out", "alone.rrd"]).code(0);
    let alone = read_recording(&lab.path("alone.rrd")).unwrap();
    assert!(alone.iter().all(|(name, series)| shown.get(name) == Some(series)));
}

#[test]
fn a_table_drives_the_view_of_its_simulation() {
    let lab = lab();
    let said = lab.linkwork(&["view", "flown.ron", "--out", "flown.rrd"]).code(0);
    assert!(said.out.contains("`flown.rrd`: 7 instants"), "{}", said.out);
    let shown = read_recording(&lab.path("flown.rrd")).unwrap();
    let series =
        |name: &str| shown.get(name).unwrap_or_else(|| panic!("{name}: {:#?}", shown.keys()));
    let (t, x) = series("tf#/block Transform3D:translation[0]");
    assert_eq!(t.len(), 7);
    for (t, x) in t.iter().zip(x) {
        assert!((x - (1.0 + 3.0 * t)).abs() < 1e-6, "{t}: {x}");
    }
    // The flap moves with the block: it is 0.2 m ahead, along the block's x axis.
    let (_, y) = series("tf#/flap Transform3D:translation[1]");
    for (t, y) in t.iter().zip(y) {
        let psi = 0.5 * t + 3f64.to_radians();
        assert!((y - 2.5 - 0.2 * psi.sin()).abs() < 1e-6, "{t}: {y}");
    }
    // A gap stays a gap.
    let (t, volts) = series("/plots/Battery/flown Scalars:scalars[0]");
    assert!(t.len() == 7 && (volts[3] - 27.5).abs() < 1e-9, "between its neighbours: {volts:?}");
}

#[test]
fn a_table_of_linkwork_itself_is_no_different_from_its_log() {
    let lab = lab();
    lab.linkwork(&["run", "sim.ron", "--out", "out"]).code(0);
    lab.linkwork(&["export", "out/run.mcap", "--parquet", "own.parquet"]).code(0);
    let columns = |axis: &str| format!("\"block.position.{axis} [m]\"");
    let text = format!(
        "Telemetry(table: \"own.parquet\", time: (column: \"time [s]\"), bodies: {{ \"block\": (
            position: (axes: \"world\", x: {}, y: {}, z: {}),
            attitude: (axes: \"world\", w: \"block.rotation.w\", x: \"block.rotation.x\", y: \"block.rotation.y\", z: \"block.rotation.z\")) }})",
        columns("x"),
        columns("y"),
        columns("z")
    );
    lab.write("own.ron", &text);
    let said = lab.linkwork(&["view", "out/run.mcap", "--flown", "own.ron", "--out", "own.rrd"]);
    let said = said.code(0);
    assert!(said.out.contains("block: 21 rows of the table"), "{}", said.out);
    assert!(number(&said.out, "position: at most ") == 0.0, "{}", said.out);
    assert!(number(&said.out, "attitude: at most ") < 1e-12, "{}", said.out);
}

#[test]
fn mistakes_are_told_with_their_place_and_nothing_is_written() {
    let lab = lab();
    lab.linkwork(&["run", "sim.ron", "--out", "out"]).code(0);
    let refused = |from: &str, to: &str, tells: &[&str]| {
        assert!(FLOWN.contains(from), "{from}");
        lab.write("bad.ron", &FLOWN.replace(from, to));
        let args = ["view", "out/run.mcap", "--flown", "bad.ron", "--out", "bad.rrd"];
        lab.linkwork(&args).code(2).tells(tells).tells(&["help: "]);
        assert!(!lab.path("bad.rrd").exists());
    };
    refused(
        "\"block\": (",
        "\"blokc\": (",
        &["bad.ron:7:", "does not have a body `blokc`", "block"],
    );
    refused(
        "[\"x\", \"ft\"]",
        "[\"xx\", \"ft\"]",
        &["bad.ron:8:", "flown.csv", "does not have a column `xx`"],
    );
    refused(
        "[\"x\", \"ft\"]",
        "[\"x\", \"kg\"]",
        &["the unit of column `x` is not compatible with m"],
    );
    refused("[\"x\", \"ft\"]", "[\"x\", \"foot\"]", &["`foot` is not a unit"]);
    refused("[\"x\", \"ft\"]", "[\"note\", \"ft\"]", &["column `note` holds `row 2` in line 2"]);
    refused("axes: \"world\", x", "axes: \"wrold\", x", &["no axes `wrold`", "world"]);
    refused("axes: \"world\", x", "axes: \"planet\", x", &["the rotation of the planet", "rate"]);
    refused("pitch: [\"theta\", \"deg\"], ", "", &["lacks `pitch`"]);
    refused(
        "[\"clock\", \"ms\"]",
        "[\"clock\", \"deg\"]",
        &["the unit of column `clock` is not compatible with s"],
    );
    refused("[\"climb\", \"km/h\"]", "[\"climb\", \"m\"]", &["`block.velocity.z` is in m/s"]);
    refused("block.velocity.z", "block.velocity.w", &["no variable `block.velocity.w`"]);
    refused("\"flown.csv\"", "\"nowhere.csv\"", &["nowhere.csv"]);
    refused("table: ", "tabel: ", &["no field `tabel`", "lacks `table`"]);
    // The time of the table decreases.
    lab.write("flown.csv", &table().replace("12300,", "12100,"));
    refused("doc", "doc", &["does not increase from row 1 to row 2"]);
    // The table and the log have no common time: this gives a warning, and the view of the run is
    // complete.
    lab.write("flown.csv", &table());
    lab.write("late.ron", &FLOWN.replace("12 s", "100 s"));
    let args = ["view", "out/run.mcap", "--flown", "late.ron", "--out", "late.rrd"];
    lab.linkwork(&args)
        .code(0)
        .tells(&["warning: body `block`: the table extends from -87.8", "zero"]);
    lab.linkwork(&["view", "late.ron", "--out", "l.rrd"])
        .code(2)
        .tells(&["before the simulation begins"]);
    // `--flown` requires a log; without one, it requires a simulation.
    let args = ["view", "flown.ron", "--flown", "flown.ron", "--out", "x.rrd"];
    lab.linkwork(&args).code(2).tells(&["--flown requires a log"]);
    lab.write("none.ron", &FLOWN.replace("simulation: \"sim.ron\",", ""));
    lab.linkwork(&["view", "none.ron", "--out", "x.rrd"])
        .code(2)
        .tells(&["does not define a simulation"]);
    assert!(!lab.path("x.rrd").exists());
}

/// The example in the repository: NASA's simulator 04 in check case 2, next to ours (`sims/nesc/README.md`).
#[test]
fn nasas_trajectory_beside_ours() {
    let lab = Lab::new();
    let case = sim("nesc/case_02.ron");
    lab.linkwork(&["run", &case, "--out", "out", "--save-rrd", "off"]).code(0);
    let flown = sim("nesc/flown_02.ron");
    let said =
        lab.linkwork(&["view", "out/run.mcap", "--flown", &flown, "--out", "both.rrd"]).code(0);
    assert!(said.out.contains("brick: 31 rows of the table"), "{}", said.out);
    let position = number(&said.out, "position: at most ");
    let attitude = number(&said.out, "attitude: at most ");
    println!("{}", said.out);
    // The tolerances are 0.02 ft and 1e-3 deg; simulation 04 is within 4e-5 deg of the mean of 04
    // and 05.
    assert!(position < 0.02 * 0.3048, "{}", said.out);
    assert!(attitude < 1e-3 && attitude > 0.0, "{}", said.out);
    // The comparison is at the rows of the table: between two rows a straight line differs by 0.4
    // deg/s from the brick.
    assert!(number(&said.out, "Roll rate: at most ") < 1e-6, "{}", said.out);
}

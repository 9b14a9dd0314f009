//! Existing files are kept, forged files are rejected, unreadable files do not block; names in logs; metrics of forks.
use crate::common;
use common::{BASE, Lab, edited};
use linkwork_live::{Client, RequestKind, Ticket};
use linkwork_record::{Log, LogSpec, log_begin, read_log};
use linkwork_runtime::{Checkpoint, Consumer, Recorder, Sample, Seconds, Simulation};
use std::net::TcpStream;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Two balls on a floor; one is twice as heavy.
const BALLS: &str = r#"Simulation(
    bodies: {
        "top": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), initial: (position: [0, 0, 0.1]), shapes: [(shape: Sphere(0.1), collide: true, name: "s")]),
        "con": (parent: "world", hinge: Free, mass: 2, inertia: Sphere(0.1), initial: (position: [1, 0, 0.1]), shapes: [(shape: Sphere(0.1), collide: true, name: "s")]),
    },
    colliders: { "floor": (on: "world", shape: HalfSpace) }, contact: (),
    parts: { "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }) },
    until: "0.1 s", log: [(channels: ["**"])],
)"#;

#[test]
fn contact_forces_of_two_bodies_are_two_columns_of_a_log() {
    let lab = Lab::new();
    lab.write("balls.ron", BALLS);
    lab.run("balls.ron", "out", &[]).code(0);
    let log = read_log(&lab.path("out/run.mcap")).unwrap();
    for (body, weight) in [("top", 9.81), ("con", 2.0 * 9.81)] {
        let force = log[&format!("{body}.contact_force.z")].y.last().unwrap();
        assert!((force - weight).abs() < 1e-3 * weight, "{body}: {force}");
    }
    // The columns have exactly the names of `linkwork list`.
    let listed = lab.linkwork(&["list", "balls.ron"]).code(0).out;
    for name in log.keys() {
        assert!(listed.contains(name.as_str()), "{name} is not in\n{listed}");
    }
}

#[test]
fn a_run_that_is_resumed_into_its_folder_leaves_its_log() {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    lab.run("sim.ron", "r", &["--checkpoint-every", "0.5s"]).code(0);
    let before = std::fs::read(lab.path("r/run.mcap")).unwrap();
    let from = "r/checkpoint_0.5.lwck";
    let told = ["r/run.mcap", "from t = 0 s on", "begins at t = 0.5 s", "--out"];
    lab.resume(from, "r", &["--until", "2s"]).code(2).tells(&told);
    let fork = ["fork", from, "--out", "r", "--save-rrd", "off", "--set", "Friction.damping=1"];
    lab.linkwork(&fork).code(2).tells(&told);
    assert_eq!(std::fs::read(lab.path("r/run.mcap")).unwrap(), before);
    assert_eq!(log_begin(&lab.path("r/run.mcap")).unwrap(), Some(0.0));
    // A run may be resumed into its own folder without a log, and into another folder several times.
    lab.resume(from, "r", &["--until", "2s", "--no-log"]).code(0);
    assert_eq!(std::fs::read(lab.path("r/run.mcap")).unwrap(), before);
    lab.resume(from, "rest", &["--until", "2s"]).code(0);
    assert!(log_begin(&lab.path("rest/run.mcap")).unwrap().unwrap() > 0.5);
    lab.resume(from, "rest", &["--until", "2s"]).code(0);
    // Files that are not logs are not replaced either.
    lab.write("rest/run.mcap", "something else");
    lab.resume(from, "rest", &[]).code(2).tells(&["not a readable log"]);
}

/// The speed is greatest at the first swing; a fork from a later time once had 0.4 times this value.
#[test]
fn metrics_of_a_fork_and_of_a_resumed_run_are_of_the_whole() {
    let lab = Lab::new();
    let more = "unit: \"rad/s\"), \"mean\": (of: \"bob.rate\", take: \"mean\"), \"own\": (of: \"Lag.y\", take: \"max\") }";
    let text = edited(&[("unit: \"rad/s\") }", more), ("until: \"1 s\"", "until: \"3 s\"")]);
    lab.write("sim.ron", &text);
    lab.run("sim.ron", "whole", &["--checkpoint-every", "1.5s"]).code(0);
    lab.resume("whole/checkpoint_1.5.lwck", "rest", &[]).code(0);
    let args = [
        "fork",
        "whole/checkpoint_1.5.lwck",
        "--out",
        "fork",
        "--save-rrd",
        "off",
        "--set",
        "Friction.damping=0.05",
    ];
    lab.linkwork(&args).code(0);
    let metrics = |out: &str| lab.summary(out)["metrics"].clone();
    assert_eq!(metrics("rest"), metrics("whole"));
    assert_eq!(metrics("fork"), metrics("whole"));
    assert!(metrics("whole")["largest speed"][0].as_f64().unwrap() > 2.0);
}

/// Changes the time of the last row of the log.
struct Late(Log, u64);

impl Consumer for Late {
    fn row(&mut self, row: &Sample) -> Result<(), String> {
        let mut row = row.clone();
        if row.tick >= self.1 {
            row.ns = 1_000_000_000_000_000_000;
        }
        self.0.row(&row)
    }
    fn finish(&mut self) -> Result<(), String> {
        self.0.finish()
    }
}

#[test]
fn a_row_at_the_end_of_time_does_not_make_replay_simulate_until_then() {
    let lab = Lab::new();
    for around in [false, true] {
        let text = match around {
            false => BASE.to_string(),
            true => edited(&[("rate: \"100 Hz\"", "rate: \"100 Hz\", on_change: true")]),
        };
        let ready = linkwork_cli::library().text_with("sim.ron", &text, &[]);
        let ready = ready.map_err(|f| f.to_string()).unwrap();
        let program = Arc::new(ready.program);
        let mut sim = Simulation::of(program.clone());
        let prepared = linkwork_runner::prepare(sim.plan(), &ready.loaded.simulation).unwrap();
        let configuration = ready.loaded.resolved.to_string();
        let spec = LogSpec { groups: prepared.groups, configuration, ..LogSpec::default() };
        let (log, groups) = Log::create(&lab.path("late.mcap"), &program, &spec).unwrap();
        let mut recorder = Recorder::start(&sim, groups, 8, Box::new(Late(log, 200))).unwrap();
        recorder.sample(&sim).unwrap();
        while sim.before(Seconds::new(1, 5).unwrap()) {
            sim.step().unwrap();
            recorder.sample(&sim).unwrap();
        }
        recorder.finish().unwrap();
        let begin = Instant::now();
        let said = lab
            .command(&["replay", "late.mcap", "--verify"])
            .env("TMPDIR", "/nowhere/at/all")
            .output();
        let said = common::Said::from(said.unwrap()).code(1);
        assert!(begin.elapsed() < Duration::from_secs(20), "{:?}", begin.elapsed());
        said.tells(&["but the log does not"]);
    }
}

/// Writes a checkpoint of the base at 0.5 s, changed and with a new checksum.
fn forged(lab: &Lab, change: impl Fn(&mut Checkpoint)) {
    let mut c = Checkpoint::read(&lab.path("whole/checkpoint_0.5.lwck")).unwrap();
    change(&mut c);
    c.write(&lab.path("forged.lwck")).unwrap();
}

#[test]
fn checkpoints_that_no_run_writes_are_rejected() {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    lab.run("sim.ron", "whole", &["--checkpoint-every", "0.5s"]).code(0);
    let lane = |c: &mut Checkpoint, y: f64| c.lanes[..8].copy_from_slice(&y.to_le_bytes());
    type Change<'a> = Box<dyn Fn(&mut Checkpoint) + 'a>;
    let cases: Vec<(&str, Change<'_>)> = vec![
        ("is NaN", Box::new(|c| lane(c, f64::NAN))),
        ("is inf", Box::new(|c| lane(c, f64::INFINITY))),
        ("is 1e308", Box::new(|c| lane(c, 1e308))),
        ("its time is 1e300 s after a row", Box::new(|c| c.instant.since = 1e300)),
        ("but the checkpoint states 0.5 s", Box::new(|c| c.tick += 1)),
        ("but the checkpoint states NaN s", Box::new(|c| c.time = f64::NAN)),
        ("events at one instant", Box::new(|c| c.instant.micro = u32::MAX)),
        ("its next step is NaN s", Box::new(|c| c.instant.memory.0 = f64::NAN)),
        ("its next step is -1 s", Box::new(|c| c.instant.memory.0 = -1.0)),
        (
            "`Lag.y` is pinned to NaN",
            Box::new(|c| {
                c.pins.insert("Lag.y".into(), f64::NAN);
            }),
        ),
    ];
    for (wanted, change) in &cases {
        forged(&lab, change);
        let said = lab.resume("forged.lwck", "forged", &[]).code(2);
        said.tells(&[wanted, "values that no run writes", "help: "]);
    }
    // At this tick a double cannot represent the length of a row.
    forged(&lab, |c| {
        c.tick = 1 << 62;
        c.time = c.tick as f64 / 1000.0;
    });
    lab.resume("forged.lwck", "forged", &[]).code(2).tells(&["after the end at 1 s", "help: "]);
    // An instant that is not a number has no row.
    forged(&lab, |c| c.instant.since = f64::NAN);
    lab.resume("forged.lwck", "forged", &[]).code(2).tells(&["tick 500 is not at row", "help: "]);
    // An unchanged checkpoint is accepted, and one of another version is named.
    forged(&lab, |_| {});
    let said = lab.resume("forged.lwck", "same", &[]).code(0);
    assert!(!said.err.contains("version") && !said.err.contains("written by"), "{}", said.err);
    assert_eq!(lab.hash("same"), lab.hash("whole"));
    forged(&lab, |c| c.version = "0.0.7".into());
    let told = [
        "written by Linkwork 0.0.7",
        "states, parameters, files and wires are compared",
        "may have changed",
    ];
    lab.resume("forged.lwck", "other", &[]).code(0).tells(&told);
}

/// The two logs have equal numbers, but differ in the pose of a body and in their configurations.
#[test]
fn diff_sees_poses_and_configurations() {
    let lab = Lab::new();
    let logs = |angle: &str| edited(&[("\"**\"", "\"Lag.*\""), ("60 deg", angle)]);
    lab.write("a.ron", &logs("60 deg"));
    lab.write("b.ron", &logs("61 deg"));
    for name in ["a", "b"] {
        lab.run(&format!("{name}.ron"), name, &["--checkpoint-every", "0.5s"]).code(0);
    }
    lab.linkwork(&["diff", "a/run.mcap", "a/run.mcap"]).code(0);
    let said = lab.linkwork(&["diff", "a/run.mcap", "b/run.mcap"]).code(1).out;
    for wanted in ["pose of bob.rotation.y", "the configuration", "against"] {
        assert!(said.contains(wanted), "{wanted}: {said}");
    }
    // Only the numbers are compared if a tolerance is given, and the configuration is named.
    let loose = ["diff", "a/run.mcap", "b/run.mcap", "--abs", "1"];
    lab.linkwork(&loose).code(0).tells(&["the configurations differ in line"]);
    let said =
        lab.linkwork(&["diff", "a/checkpoint_0.5.lwck", "b/checkpoint_0.5.lwck"]).code(1).out;
    assert!(said.contains("the configuration") && said.contains("bob.angle"), "{said}");
}

#[cfg(unix)]
#[test]
fn nothing_waits_for_a_pipe() {
    let lab = Lab::new();
    for name in ["p.mcap", "p.lwck", "p.csv", "p.ron", "p.urdf"] {
        let made = std::process::Command::new("mkfifo").arg(lab.path(name)).status().unwrap();
        assert!(made.success());
    }
    lab.write(
        "import.ron",
        "Simulation(import: (file: \"p.urdf\", root: Free), until: \"1 s\", gravity: \"none\")",
    );
    let commands: [&[&str]; 9] = [
        &["diff", "p.mcap", "p.mcap"],
        &["replay", "p.mcap", "--verify"],
        &["export", "p.mcap", "--parquet", "t.parquet"],
        &["resume", "p.lwck"],
        &["fork", "p.lwck", "--set", "a.b=1"],
        &["run", "p.ron"],
        &["check", "p.ron"],
        &["check", "import.ron"],
        &["campaign", "p.ron"],
    ];
    for args in commands {
        let mut child = lab.spawn(args);
        let begin = Instant::now();
        let code = loop {
            if let Some(status) = child.try_wait().unwrap() {
                break status.code();
            }
            if begin.elapsed() > Duration::from_secs(20) {
                common::killed(&mut child);
                panic!("{args:?} waits");
            }
            std::thread::sleep(Duration::from_millis(10));
        };
        assert_eq!(code, Some(2), "{args:?}");
    }
}

#[cfg(unix)]
#[test]
fn names_that_are_no_text_are_rejected_before_anything_is_done() {
    use std::os::unix::ffi::OsStrExt;
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    let name = std::ffi::OsStr::from_bytes(b"out\xff");
    let mut command = lab.command(&["run", "sim.ron", "--out"]);
    let said = common::Said::from(command.arg(name).output().unwrap()).code(2);
    said.tells(&["is not UTF-8", "help: "]);
    assert_eq!(lab.files(), ["sim.ron"]);
}

#[test]
fn a_model_of_a_library_that_is_not_here_is_named_as_such() {
    let lab = Lab::new();
    lab.write("sim.ron", &edited(&[("basics.lag", "mine.lag")]));
    let told = [
        "there is no model `mine.lag`: this program has no library `mine`",
        "linkwork new library",
    ];
    lab.run("sim.ron", "out", &[]).code(2).tells(&told);
}

#[test]
fn silent_connections_keep_no_client_out() {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    let args = [
        "run",
        "sim.ron",
        "--out",
        "out",
        "--save-rrd",
        "off",
        "--serve",
        "--realtime",
        "--until",
        "1000s",
    ];
    let mut child = lab.spawn(&args);
    let file = lab.path("out").join(Ticket::FILE);
    common::wait_for(&file);
    let ticket = Ticket::read(&file).unwrap();
    let silent: Vec<TcpStream> =
        (0..200).map(|_| TcpStream::connect(&ticket.address).unwrap()).collect();
    let begin = Instant::now();
    let mut clients: Vec<Client> = (0..16).map(|_| Client::connect(&ticket).unwrap()).collect();
    assert!(begin.elapsed() < Duration::from_secs(3), "{:?}", begin.elapsed());
    // An additional client gets a reason.
    let full = Client::connect(&ticket).map(|_| ()).unwrap_err().to_string();
    assert!(full.contains("16 clients are connected"), "{full}");
    for client in &mut clients {
        client.ask(RequestKind::Pause).unwrap();
    }
    drop((silent, clients));
    common::killed(&mut child);
}

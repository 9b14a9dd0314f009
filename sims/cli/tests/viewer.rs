//! The viewer from the command line: it never stops a run, and never overwrites files of the run.
#![cfg(feature = "viewer")]
use crate::common;
use common::{BASE, Lab, Said, Small, edited, names, signal, wait_for};
use linkwork_record::read_log_contents;
use std::net::TcpListener;
use std::time::{Duration, Instant};

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    lab
}

/// A socket that accepts connections and never sends anything: a viewer that hangs.
fn silent() -> (TcpListener, String) {
    let socket = TcpListener::bind("127.0.0.1:0").unwrap();
    let url = format!("rerun+http://{}/proxy", socket.local_addr().unwrap());
    (socket, url)
}

#[test]
fn a_viewer_that_hangs_does_not_hold_up_the_run() {
    let (lab, (_socket, url)) = (lab(), silent());
    let clock = Instant::now();
    let args = ["run", "sim.ron", "--out", "out", "--until", "100s", "--rerun", &url];
    let said = lab.linkwork(&args).code(0).tells(&["warning: the viewer", "help: "]);
    assert!(clock.elapsed() < Duration::from_secs(60), "{:?}\n{}", clock.elapsed(), said.err);
    assert_eq!(names(&lab.path("out")), ["plots.svg", "run.mcap", "run.rrd", "summary.json"]);
    lab.run("sim.ron", "alone", &["--until", "100s"]).code(0);
    assert_eq!(lab.hash("out"), lab.hash("alone"));
    lab.linkwork(&["diff", "out/run.mcap", "alone/run.mcap"]).code(0);
}

#[test]
fn ctrl_c_with_a_viewer_that_hangs_leaves_a_checkpoint() {
    let (lab, (_socket, url)) = (lab(), silent());
    let args =
        ["run", "sim.ron", "--out", "out", "--until", "1000s", "--realtime", "--rerun", &url];
    let child = lab.spawn(&args);
    wait_for(&lab.path("out/run.mcap"));
    std::thread::sleep(Duration::from_millis(800));
    signal(&child, "INT");
    // The checkpoint does not wait for the viewer.
    let clock = Instant::now();
    wait_for(&lab.path("out/interrupted.lwck"));
    assert!(clock.elapsed() < Duration::from_millis(1500), "{:?}", clock.elapsed());
    let said: Said = child.wait_with_output().unwrap().into();
    said.code(130);
    let t = lab.summary("out")["time"].as_f64().unwrap();
    let log = read_log_contents(&lab.path("out/run.mcap")).unwrap();
    assert!((log.series["bob.angle"].t.last().unwrap() - t).abs() < 0.011);
}

#[test]
fn nobody_listens() {
    let lab = lab();
    let url = silent().1; // The socket is closed again.
    let clock = Instant::now();
    let args = ["run", "sim.ron", "--out", "out", "--rerun", &url];
    lab.linkwork(&args).code(0).tells(&["warning: the viewer"]);
    assert!(clock.elapsed() < Duration::from_secs(60), "{:?}", clock.elapsed());
    lab.linkwork(&["run", "sim.ron", "--out", "b", "--rerun", "nonsense"])
        .code(1)
        .tells(&["`nonsense` is not the address of a viewer"]);
}

#[test]
fn a_recording_overwrites_no_other_file_of_the_run() {
    let lab = lab();
    let refused = |more: &[&str]| {
        let head = ["run", "sim.ron", "--out", "out"];
        lab.linkwork(&[&head[..], more].concat()).code(2).tells(&["--save-rrd", "help: "]);
    };
    for taken in ["out/run.mcap", "./out/run.mcap", "out/../out/summary.json", "sim.ron"] {
        refused(&["--save-rrd", taken]);
    }
    refused(&["--save-rrd", "out/run.mcap", "--no-log"]);
    assert_eq!(std::fs::read_to_string(lab.path("sim.ron")).unwrap(), BASE);
    // A log is not overwritten under another name either.
    lab.run("sim.ron", "out", &[]).code(0);
    let before = std::fs::read(lab.path("out/run.mcap")).unwrap();
    std::fs::hard_link(lab.path("out/run.mcap"), lab.path("other.rrd")).unwrap();
    refused(&["--save-rrd", "other.rrd"]);
    assert_eq!(std::fs::read(lab.path("out/run.mcap")).unwrap(), before);
    // The checkpoint that the run resumes from is read, and is not overwritten.
    lab.run("sim.ron", "c", &["--checkpoint-every", "0.5s"]).code(0);
    let from = "c/checkpoint_0.5.lwck";
    let said = lab.linkwork(&["resume", from, "--out", "d", "--save-rrd", from]);
    said.code(2).tells(&["--save-rrd"]);
    lab.resume(from, "d", &[]).code(0);
}

#[test]
fn a_recording_that_cannot_be_written_is_told() {
    let lab = lab();
    lab.write("sim.ron", &edited(&[("rate: \"20 Hz\"", "rate: \"1 kHz\"")]));
    let Some(_small) = Small::mount(lab.path("small"), "100k") else {
        println!("skipped: a small file system cannot be mounted here");
        return;
    };
    let args = ["run", "sim.ron", "--out", "out", "--until", "20s", "--save-rrd", "small/run.rrd"];
    lab.linkwork(&args).code(1).tells(&["the recording", "small/run.rrd", "help: "]);
    let summary = lab.summary("out");
    assert_eq!(summary["ended"], "until", "the run is whole");
    assert!(summary["problems"][0].as_str().unwrap().contains("run.rrd"), "{summary}");
    read_log_contents(&lab.path("out/run.mcap")).unwrap();
}

/// A log at the rate of the view, with a trail, and axes on the bob.
fn viewed() -> String {
    edited(&[
        ("mass: \"1 kg\"", "nodes: { \"eye\": (position: [0, 0.2, -1]) }, mass: \"1 kg\""),
        ("rate: \"100 Hz\"", "rate: \"20 Hz\""),
        ("rate: \"20 Hz\"),", "rate: \"20 Hz\", trails: [\"bob\"], frames: [\"bob/eye\"]),"),
    ])
}

#[test]
fn a_recording_from_a_log_shows_row_for_row_what_that_of_the_run_does() {
    let lab = Lab::new();
    lab.write("sim.ron", &viewed());
    lab.linkwork(&["run", "sim.ron", "--out", "out"]).code(0);
    let said = lab.linkwork(&["view", "out/run.mcap", "--out", "view.rrd"]).code(0);
    assert!(said.out.contains("21 instants") && said.err.is_empty(), "{}{}", said.out, said.err);
    // The axes follow from the pose of their body in one recording, from the coordinates in the other.
    let args = ["diff", "out/run.rrd", "view.rrd", "--tol", "tf#/bob/eye/axes**=1e-7"];
    let said = lab.linkwork(&args).code(0);
    assert!(said.out.starts_with("equal: "), "{}", said.out);
    let shown = linkwork_viz::read_recording(&lab.path("view.rrd")).unwrap();
    for name in [
        "tf#/bob Transform3D:quaternion[1]",
        "tf#/bob/eye/axes Transform3D:translation[0]",
        "/plots/Angle__deg/angle Scalars:scalars[0]",
    ] {
        let (t, y) = shown.get(name).unwrap_or_else(|| panic!("{name}: {:#?}", shown.keys()));
        assert!(t.len() == 21 && y[0] != y[20], "{name}: {t:?} {y:?}");
    }
    // The configuration of another run differs, and the difference is named.
    lab.linkwork(&["run", "sim.ron", "--out", "b", "--set", "Friction.damping=0.2"]).code(0);
    let said = lab.linkwork(&["diff", "out/run.rrd", "b/run.rrd"]).code(1);
    assert!(said.out.contains("tf#/bob Transform3D:"), "{}", said.out);
}

#[test]
fn a_recording_from_a_log_has_arrows() {
    let lab = Lab::new();
    lab.linkwork(&["run", &common::sim("wheel_rig"), "--out", "out", "--until", "2s"]).code(0);
    lab.linkwork(&["view", "out/run.mcap", "--out", "view.rrd"]).code(0);
    let said = lab.linkwork(&["diff", "out/run.rrd", "view.rrd"]).code(0);
    assert!(said.out.starts_with("equal: "), "{}", said.out);
    let shown = linkwork_viz::read_recording(&lab.path("view.rrd")).unwrap();
    let arrow = shown.iter().find(|(name, _)| name.ends_with("Arrows3D:vectors[2]"));
    assert!(arrow.is_some_and(|(_, (t, _))| t.len() == 41), "{:#?}", shown.keys());
}

#[test]
fn a_recording_from_a_log_goes_through_phases_and_from_a_cut_log_as_far_as_that_goes() {
    let lab = Lab::new();
    // A checkpoint ends a chunk of the log.
    let staging = common::sim("staging");
    let args = ["run", &staging, "--out", "out", "--until", "12s", "--checkpoint-every", "2s"];
    lab.linkwork(&args).code(0);
    lab.linkwork(&["view", "out/run.mcap", "--out", "view.rrd"]).code(0);
    // Curves have the rows of the log, poses have the rows of the view.
    // A log does not contain phases: only the recording of the run colours paths by phase.
    let both = ["out/run.rrd", "view.rrd"];
    let [run, view] = both.map(|f| linkwork_viz::read_recording(&lab.path(f)).unwrap());
    let poses = view.iter().filter(|(name, _)| name.starts_with("tf#"));
    assert!(poses.clone().count() > 20);
    for (name, series) in poses {
        assert_eq!(run[name], *series, "{name}");
    }
    let said = lab.linkwork(&["diff", "out/run.rrd", "view.rrd", "--common"]).code(1);
    let differ: Vec<&str> = said.out.lines().filter(|l| l.contains("only in the")).collect();
    assert!(!differ.is_empty() && differ.iter().all(|l| l.contains(" /trails/")), "{}", said.out);
    let log = std::fs::read(lab.path("out/run.mcap")).unwrap();
    std::fs::write(lab.path("cut.mcap"), &log[..log.len() * 2 / 3]).unwrap();
    let said = lab.linkwork(&["view", "cut.mcap"]).code(0);
    assert!(said.out.contains("is truncated"), "{}", said.out);
    let whole = linkwork_viz::read_recording(&lab.path("view.rrd")).unwrap();
    let cut = linkwork_viz::read_recording(&lab.path("cut.rrd")).unwrap();
    let name = "tf#/booster Transform3D:translation[0]";
    let n = cut[name].0.len();
    assert!(n > 10 && n < whole[name].0.len());
    assert_eq!(cut[name].1[..], whole[name].1[..n]);
}

#[test]
fn what_a_view_cannot_show_is_said_and_what_is_there_is_not_overwritten() {
    let lab = Lab::new();
    lab.write("sim.ron", &edited(&[("channels: [\"**\"]", "channels: [\"Lag.**\"]")]));
    lab.linkwork(&["run", "sim.ron", "--out", "out"]).code(0);
    let before = std::fs::read(lab.path("out/run.rrd")).unwrap();
    let refused = |args: &[&str], tells: &[&str]| {
        lab.linkwork(&[&["view"], args].concat()).code(2).tells(tells);
    };
    refused(&["out/run.mcap"], &["`out/run.rrd` already exists", "--out"]);
    refused(&["out/run.mcap", "--out", "out/../out/run.mcap"], &["is the log itself", "help: "]);
    assert_eq!(std::fs::read(lab.path("out/run.rrd")).unwrap(), before);
    lab.linkwork(&["view", "out/run.mcap", "--out", "view.rrd"])
        .code(0)
        .tells(&["no samples of them: bob.angle", "help: "]);
    refused(&["none.mcap"], &["none.mcap", "help: "]);
    lab.write("no.mcap", "nothing");
    refused(&["no.mcap"], &["no.mcap", "help: "]);
    // A log with one flipped bit does not give a recording that seems complete.
    let mut log = std::fs::read(lab.path("out/run.mcap")).unwrap();
    let middle = log.len() * 2 / 3;
    log[middle] ^= 4;
    std::fs::write(lab.path("flipped.mcap"), &log).unwrap();
    refused(&["flipped.mcap"], &["is damaged at byte"]);
    assert!(!lab.path("flipped.rrd").exists());
    lab.linkwork(&["view", "out/run.mcap", "--out", "no/such/folder.rrd"])
        .code(1)
        .tells(&["no/such/folder.rrd", "help: "]);
}

/// A block falls into a line of 1 m, which is slack for 0.32 s, while an engine on it burns at a third of its thrust.
const TETHERED: &str = r#"Simulation(
    bodies: {
        "beam": (parent: "world", nodes: { "hook": (position: [0, 0.3, 2]) }),
        "block": (
            parent: "world", hinge: Free, mass: 2, inertia: Sphere(0.1),
            initial: (position: [0, 0.3, 1.5]),
            nodes: { "ring": (), "nozzle": (rotation: (rpy: [0, "90 deg", 0])) },
        ),
    },
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.80665] }),
        "Line": (model: "flight.line", params: { "length": 1, "stiffness": 2000, "damping": 10 }, bind: { "a": "node:beam/hook", "b": "node:block/ring" }),
        "Third": (model: "basics.constant", params: { "value": 0.333 }),
        "Engine": (model: "flight.engine", params: { "thrust": 3, "specific_impulse": 200 }, bind: { "nozzle": "node:block/nozzle" }),
        "Feed": (model: "flight.ideal_feed"),
    },
    wires: ["Third.y -> Engine.throttle"], connect: [("Engine.propellant", "Feed.outlet")],
    step: "10 ms", until: "1 s",
    log: [(channels: ["Line.**", "Engine.**"], rate: "20 Hz")],
    view: (
        rate: "20 Hz", follow: "block",
        lines: [(from: "beam/hook", to: "block/r*", pull: "Line.tension", color: [1, 0.5, 0.25, 0.8])],
        plumes: [(at: "block/nozzle", by: "Engine.thrust", scale: 0.5)],
    ),
)"#;

#[test]
fn a_line_is_bright_while_it_pulls_and_a_jet_as_long_as_its_thrust() {
    let lab = Lab::new();
    lab.write("sim.ron", TETHERED);
    lab.linkwork(&["run", "sim.ron", "--out", "out"]).code(0);
    let said = lab.linkwork(&["view", "out/run.mcap", "--out", "view.rrd"]).code(0);
    assert!(said.err.is_empty(), "{}", said.err);
    let said = lab.linkwork(&["diff", "out/run.rrd", "view.rrd"]).code(0);
    assert!(said.out.starts_with("equal: "), "{}", said.out);
    let shown = linkwork_viz::read_recording(&lab.path("view.rrd")).unwrap();
    let line = |what: &str| &shown[&format!("/lines/beam_hook_to_block_ring LineStrips3D:{what}")];
    // The positions are in the axes of the beam, which are W: the line goes from its hook to the
    // ring.
    let fixed = [(0, 0.0), (1, 0.3), (2, 2.0)];
    for (k, want) in fixed {
        let y = &line(&format!("strips[{k}]")).1;
        assert!(y.len() == 21 && y.iter().all(|y| (y - want).abs() < 1e-6), "{y:?}");
    }
    for k in 0..3 {
        // The view follows the block: the eye is at its position.
        let block = &shown[&format!("tf#/view/eye Transform3D:translation[{k}]")].1;
        assert_eq!(line(&format!("strips[{}]", k + 3)).1, *block);
    }
    let (t, colors) = line("colors[0]");
    let alpha: Vec<u32> = colors.iter().map(|c| *c as u32 & 0xff).collect();
    let slack = t.iter().zip(&alpha).filter(|(t, _)| **t < 0.34).all(|(_, a)| *a == 61);
    assert!(slack && alpha[7] == 204 && alpha.contains(&61), "{alpha:?}");
    let jet = |k: usize| &shown[&format!("/plumes/block_nozzle Arrows3D:vectors[{k}]")].1;
    // The force is opposite to the z axis of the nozzle, which is the x axis of the block.
    assert!((jet(0)[0] + 0.5 * 0.999).abs() < 1e-6 && jet(2)[0].abs() < 1e-6, "{:?}", jet(0));
}

#[test]
fn a_line_goes_with_its_phase() {
    let lab = Lab::new();
    let phases = r#"start: "hangs", phases: {
        "hangs": (to: { "falls": "time > 0.6 s" }),
        "falls": (like: "hangs", remove: ["Line"]),
    }, view: ("#;
    lab.write("sim.ron", &TETHERED.replace("view: (", phases));
    lab.linkwork(&["run", "sim.ron", "--out", "out"]).code(0);
    let shown = linkwork_viz::read_recording(&lab.path("out/run.rrd")).unwrap();
    let (t, _) = &shown["/lines/beam_hook_to_block_ring LineStrips3D:strips[0]"];
    let (told, colors) = &shown["/lines/beam_hook_to_block_ring LineStrips3D:colors[0]"];
    assert!((t.last().unwrap() - 0.6).abs() < 0.051, "{t:?}");
    assert!(told.len() == t.len() + 1 && *colors.last().unwrap() as u32 & 0xff == 0, "{told:?}");
}

#[test]
fn lines_and_jets_of_what_is_not_there_are_refused() {
    let lab = Lab::new();
    for (from, to, tells) in [
        (
            "\"beam/hook\"",
            "\"beam/hoko\"",
            ["`beam/hoko` matches no node, body or vector", "beam/hook"],
        ),
        (
            "\"Line.tension\"",
            "\"Line.tensoin\"",
            ["`Line.tensoin` matches no variable", "Line.tension"],
        ),
        (
            "at: \"block/nozzle\"",
            "at: \"block/nozzel\"",
            ["`block/nozzel` matches no node", "block/nozzle"],
        ),
        (
            "pull: \"Line.tension\"",
            "pull: \"Line.*\"",
            [
                "matches differ: `from` 1, `to` 1, `pull`",
                "equal numbers of matches, or with one match",
            ],
        ),
    ] {
        let text = TETHERED.replace(from, to);
        assert!(text != TETHERED);
        lab.write("sim.ron", &text);
        lab.linkwork(&["run", "sim.ron", "--out", "out"]).code(2).tells(&tells);
    }
}

//! The viewer from the command line: it never stops a run, and no file of the run is overwritten.
#![cfg(feature = "viewer")]
#![allow(clippy::unwrap_used, clippy::disallowed_methods)]
mod common;
use common::{BASE, Lab, Said, Small, edited, names, signal, wait_for};
use linkwork_record::read_log_contents;
use std::net::TcpListener;
use std::time::{Duration, Instant};

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    lab
}

/// A socket that takes connections and never says a word: a viewer that hangs.
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
        .tells(&["`nonsense` is no address"]);
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
    // By another name, too.
    lab.run("sim.ron", "out", &[]).code(0);
    let before = std::fs::read(lab.path("out/run.mcap")).unwrap();
    std::fs::hard_link(lab.path("out/run.mcap"), lab.path("other.rrd")).unwrap();
    refused(&["--save-rrd", "other.rrd"]);
    assert_eq!(std::fs::read(lab.path("out/run.mcap")).unwrap(), before);
    // The checkpoint that is resumed is read, and stays.
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

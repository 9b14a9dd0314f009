//! Guarantees for users: one run in a folder, correct exit codes, logs that are readable after any end of a run, and comparisons that never accept a
//! damaged file as equal.
use crate::common::{
    BASE, Lab, Said, Small, edited, killed, kills, names, signal, sim, size, wait_for,
};
use crate::splitmix::splitmix;
use linkwork_record::{End, read_log, read_log_contents};
use linkwork_runtime::Checkpoint;
use std::fs::OpenOptions;
use std::process::Stdio;
use std::time::{Duration, Instant};

const QUIET: [&str; 2] = ["--save-rrd", "off"];

fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    lab
}

#[test]
fn a_folder_has_one_run_at_a_time() {
    let lab = lab();
    let slow = ["run", "sim.ron", "--out", "out", "--until", "1000s", "--realtime"];
    let mut first = lab.spawn(&[&slow[..], &QUIET].concat());
    wait_for(&lab.path("out/run.mcap"));
    std::thread::sleep(Duration::from_millis(300));
    let before = names(&lab.path("out"));
    lab.run("sim.ron", "out", &[]).code(2).tells(&["another run is writing", "`out`", "--out"]);
    assert_eq!(names(&lab.path("out")), before, "it wrote something");
    // A run in another folder is possible.
    lab.run("sim.ron", "other", &[]).code(0);
    // However the first run ends, its folder is free then, and no lock remains.
    killed(&mut first);
    assert_eq!(names(&lab.path("out")), ["run.mcap"]);
    lab.run("sim.ron", "out", &[]).code(0);
    assert_eq!(names(&lab.path("out")), ["plots.svg", "run.mcap", "summary.json"]);
}

#[test]
fn checkpoints_of_another_run_are_put_aside() {
    let lab = lab();
    let every = ["--checkpoint-every", "0.5s"];
    lab.run("sim.ron", "out", &every).code(0);
    let found = ["checkpoint_0.5.lwck", "checkpoint_1.lwck"];
    let saved = |folder: &str| -> Vec<String> {
        names(&lab.path(folder)).into_iter().filter(|n| n.ends_with("lwck")).collect()
    };
    assert_eq!(saved("out"), found);
    // A repeated run gives bit-identical checkpoints, which are kept.
    let old = std::fs::read(lab.path("out/checkpoint_0.5.lwck")).unwrap();
    assert!(!lab.run("sim.ron", "out", &[]).code(0).err.contains("note:"));
    assert_eq!(saved("out"), found);
    // With another configuration none of the old checkpoints may count as checkpoints of the new run.
    lab.run("sim.ron", "out", &["--set", "Gain.k=3"])
        .code(0)
        .tells(&["2 checkpoints of another run", "out/earlier_1"]);
    assert_eq!(saved("out"), [""; 0]);
    assert_eq!(saved("out/earlier_1"), found);
    assert_eq!(std::fs::read(lab.path("out/earlier_1/checkpoint_0.5.lwck")).unwrap(), old);
    // A run with another seed is another run as well; files that were moved stay where they are.
    lab.run("sim.ron", "out", &every).code(0);
    lab.run("sim.ron", "out", &["--seed", "9"]).code(0).tells(&["out/earlier_2"]);
    assert_eq!(
        (saved("out/earlier_1"), saved("out/earlier_2")),
        (found.map(String::from).to_vec(), found.map(String::from).to_vec())
    );
    // The summary of an earlier run does not remain next to a killed run.
    let slow = ["run", "sim.ron", "--out", "out", "--until", "1000s", "--realtime"];
    let mut child = lab.spawn(&[&slow[..], &QUIET].concat());
    std::thread::sleep(Duration::from_millis(700));
    killed(&mut child);
    assert!(!lab.path("out/summary.json").exists() && !lab.path("out/plots.svg").exists());
}

/// Runs with standard output or standard error on a device that is always full.
fn full(lab: &Lab, args: &[&str], err: bool) -> Said {
    let device = || OpenOptions::new().write(true).open("/dev/full").unwrap();
    let mut command = lab.command(args);
    if err {
        command.stderr(device());
    } else {
        command.stdout(device()).stderr(Stdio::piped());
    }
    command.spawn().unwrap().wait_with_output().unwrap().into()
}

#[test]
fn nothing_that_cannot_be_said_is_a_success() {
    if !std::path::Path::new("/dev/full").exists() {
        println!("skipped: there is no /dev/full here");
        return;
    }
    let lab = lab();
    lab.run("sim.ron", "a", &[]).code(0);
    lab.run("sim.ron", "b", &["--set", "Gain.k=3"]).code(0);
    let lost = "standard output cannot be written";
    for args in [&["list"][..], &["--help"], &["check", "sim.ron"], &["graph", "sim.ron"]] {
        let said = full(&lab, args, false);
        assert_eq!(said.code, 1, "{args:?}: {said:?}");
        assert!(args[0] == "--help" || said.err.contains(lost), "{said:?}");
    }
    let run = ["run", "sim.ron", "--out", "c", "--save-rrd", "off"];
    full(&lab, &run, false).code(1).tells(&[lost]);
    assert!(lab.path("c/summary.json").exists(), "the run was whole");
    // Unequal and equal logs both give the exit code 1.
    full(&lab, &["diff", "a/run.mcap", "b/run.mcap"], false).code(1);
    full(&lab, &["diff", "a/run.mcap", "c/run.mcap"], false).code(1);
    // Mistakes that cannot be printed are still mistakes (101 is a panic).
    lab.write("bad.ron", &edited(&[("basics.gain", "basics.gian")]));
    full(&lab, &["check", "bad.ron"], true).code(2);
    full(&lab, &["diff", "a/run.mcap", "none.mcap"], true).code(2);
    full(&lab, &["run", "bad.ron"], true).code(2);
}

#[test]
fn a_reader_that_has_gone_hides_no_difference() {
    let lab = lab();
    lab.run("sim.ron", "a", &[]).code(0);
    lab.run("sim.ron", "b", &["--set", "Gain.k=3"]).code(0);
    let gone = |args: &[&str]| {
        let mut child = lab.command(args).stdout(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        child.wait().unwrap().code()
    };
    assert_eq!(gone(&["diff", "a/run.mcap", "b/run.mcap"]), Some(1));
    assert_eq!(gone(&["diff", "a/run.mcap", "a/run.mcap"]), Some(0));
    assert_eq!(gone(&["list"]), Some(0), "`linkwork list | head` is no failure");
}

#[test]
fn what_cannot_be_written_is_told_by_the_exit_code() {
    let lab = lab();
    let Some(_small) = Small::mount(lab.path("small"), "64k") else {
        println!("skipped: a small file system cannot be mounted here");
        return;
    };
    let args = ["--no-log", "--checkpoint-every", "0.02s"];
    let said = lab.run("sim.ron", "small/out", &args).code(1);
    let said = said.tells(&["checkpoint", "help: free disk space", "No space left"]);
    assert!(said.err.matches("error: ").count() <= 6, "one line for each period:\n{}", said.err);
    // The run reached its end, and its files are complete.
    assert!(said.out.contains("reached its end at t = 1.000 s"), "{}", said.out);
    let left = names(&lab.path("small/out"));
    assert!(left.iter().all(|n| !n.ends_with(".part")), "half-written: {left:?}");
    let last = left.iter().rfind(|n| n.ends_with("lwck")).expect("none was written");
    lab.resume(&format!("small/out/{last}"), "rest", &[]).code(0);
}

#[test]
fn after_kill_9_the_log_reaches_the_last_checkpoint() {
    let lab = lab();
    let args = ["run", "sim.ron", "--out", "out", "--until", "1000s", "--realtime"];
    let every = ["--checkpoint-every", "0.4s"];
    let mut child = lab.spawn(&[&args[..], &every, &QUIET].concat());
    wait_for(&lab.path("out/checkpoint_1.2.lwck"));
    killed(&mut child);
    let log = read_log_contents(&lab.path("out/run.mcap")).unwrap();
    let last = *log.series["bob.angle"].t.last().unwrap();
    assert!(matches!(log.end, End::Cut { .. }), "{:?}", log.end);
    assert!(last >= 1.2, "the checkpoint is at 1.2 s, the log ends at {last} s");
    let left = names(&lab.path("out"));
    assert!(left.iter().all(|n| n == "run.mcap" || n.ends_with(".lwck")), "{left:?}");
    // The rows are equal to the rows of a complete run.
    lab.run("sim.ron", "whole", &["--until", "3s"]).code(0);
    let whole = read_log_contents(&lab.path("whole/run.mcap")).unwrap();
    for (name, s) in &log.series {
        assert_eq!(s.y[..], whole.series[name].y[..s.y.len()], "{name}");
    }
}

#[test]
fn a_slow_run_that_is_killed_has_logged_all_but_the_last_seconds() {
    let lab = lab();
    let args = ["run", "sim.ron", "--out", "out", "--until", "1000s", "--realtime"];
    let mut child = lab.spawn(&[&args[..], &QUIET].concat());
    wait_for(&lab.path("out/run.mcap"));
    std::thread::sleep(Duration::from_millis(3500));
    killed(&mut child);
    let log = read_log_contents(&lab.path("out/run.mcap")).unwrap();
    let last = log.series.get("bob.angle").map_or(0.0, |s| *s.t.last().unwrap());
    assert!(last > 1.0, "after 3.5 s the log ends at {last} s");
}

#[test]
fn a_limit_on_the_size_of_files_leaves_a_log_and_a_checkpoint() {
    let lab = Lab::new();
    lab.write("sim.ron", &edited(&[("rate: \"100 Hz\"", "rate: \"1 kHz\"")]));
    // The limits are 6 MB and 1 MB, in units of 512 bytes.
    let limited = |blocks: u32, out: &str| -> Said {
        let inner = format!("ulimit -f {blocks}; exec \"$0\" \"$@\"");
        let mut sh = std::process::Command::new("sh");
        sh.args(["-c", &inner, env!("CARGO_BIN_EXE_linkwork")]);
        sh.args(["run", "sim.ron", "--out", out, "--until", "1000s", "--save-rrd", "off"]);
        sh.current_dir(lab.path(".")).stdin(Stdio::null()).output().unwrap().into()
    };
    let said = limited(12_288, "out").code(1).tells(&["ulimit -f", "help: "]);
    assert_eq!(said.err.matches("error: ").count(), 1, "{}", said.err);
    let log = read_log_contents(&lab.path("out/run.mcap")).unwrap();
    assert_eq!(log.end, End::Whole, "the log is truncated");
    let t = lab.summary("out")["time"].as_f64().unwrap();
    let last = *log.series["bob.angle"].t.last().unwrap();
    assert!(last > 1.0 && last <= t && t < 1000.0, "the log ends at {last} s, the run at {t} s");
    let until = format!("{}", t.ceil() + 1.0);
    lab.resume("out/interrupted.lwck", "rest", &["--until", &until]).code(0);
    lab.run("sim.ron", "straight", &["--until", &until, "--no-log"]).code(0);
    assert_eq!(lab.hash("rest"), lab.hash("straight"));
    // The limit is too small for any file, so the run is rejected at the start.
    limited(2048, "none").code(1).tells(&["none/run.mcap", "help: "]);
    assert!(!lab.path("none/run.mcap").exists());
}

#[test]
fn logs_that_are_no_logs_equal_nothing() {
    let lab = lab();
    lab.run("sim.ron", "a", &[]).code(0);
    let good = std::fs::read(lab.path("a/run.mcap")).unwrap();
    let diff = |bytes: &[u8], wanted: &[&str]| {
        std::fs::write(lab.path("b.mcap"), bytes).unwrap();
        for pair in [["a/run.mcap", "b.mcap"], ["b.mcap", "a/run.mcap"], ["b.mcap", "b.mcap"]] {
            let said = lab.linkwork(&["diff", pair[0], pair[1]]).code(2).tells(wanted);
            said.tells(&["b.mcap", "help: "]);
        }
    };
    diff(b"", &["size of 0 bytes is too small for a log"]);
    diff(b"\x89MCAP", &["bytes is too small for a log"]);
    diff(b"Simulation( until: 3 )", &["does not begin with the MCAP magic bytes"]);
    diff(&good[..good.len() / 2], &["is truncated", "t = "]);
    diff(&good[..good.len() - 1], &["is truncated"]);
    diff(&[&good[..], b"more"].concat(), &["is damaged"]);
    // This run does not log anything.
    lab.write("silent.ron", &edited(&[("log: [(channels: [\"**\"], rate: \"100 Hz\")],", "")]));
    lab.run("silent.ron", "silent", &[]).code(0);
    let poses = lab.linkwork(&["diff", "silent/run.mcap", "silent/run.mcap"]).code(0).out;
    assert!(poses.starts_with("equal: 7 series"), "{poses}");
    let nothing = "Simulation(parts: { \"S\": (model: \"basics.constant\", params: { \"value\": 1 }) }, until: \"1 s\")";
    lab.write("silent.ron", nothing);
    lab.run("silent.ron", "silent", &[]).code(0);
    lab.linkwork(&["diff", "silent/run.mcap", "silent/run.mcap"])
        .code(2)
        .tells(&["does not contain numbers", "help: "]);
    std::fs::create_dir(lab.path("empty")).unwrap();
    lab.linkwork(&["diff", "empty", "empty"]).code(2).tells(&["summary.json", "help: "]);
    lab.linkwork(&["diff", "/dev/zero.mcap", "a/run.mcap"]).code(2).tells(&["zero.mcap"]);
}

/// Every byte of a small log with one flipped bit: always an error, and soon.
#[test]
fn a_flipped_bit_anywhere_in_a_log_is_noticed() {
    let lab = lab();
    lab.run("sim.ron", "a", &["--until", "0.1s"]).code(0);
    let good = std::fs::read(lab.path("a/run.mcap")).unwrap();
    let path = lab.path("bad.mcap");
    let (mut damaged, mut cut) = (0, 0);
    let clock = Instant::now();
    // `.ci/verify damage` tests every byte.
    let stride = size(13, 1);
    for at in (0..good.len()).step_by(stride) {
        let mut bad = good.clone();
        bad[at] ^= 1 << (at % 8);
        std::fs::write(&path, &bad).unwrap();
        match read_log_contents(&path) {
            Err(_) => damaged += 1,
            // The damaged length points beyond the end of the file.
            Ok(log) if matches!(log.end, End::Cut { .. }) => cut += 1,
            Ok(_) => panic!("bit {} of byte {at} is not noticed", at % 8),
        }
    }
    println!("{damaged} damaged, {cut} cut of {} in {:?}", good.len(), clock.elapsed());
    assert!(damaged > 10 * cut, "{damaged} damaged, {cut} cut");
    // A log that is truncated anywhere is never complete, and never has more rows than before.
    for keep in (0..good.len()).step_by(7 * stride) {
        std::fs::write(&path, &good[..keep]).unwrap();
        match read_log_contents(&path) {
            Err(_) => assert!(keep < 8, "cut to {keep} bytes is an error"),
            Ok(log) => assert!(matches!(log.end, End::Cut { .. }), "{keep} bytes are called whole"),
        }
    }
}

#[test]
fn checkpoints_have_names_of_their_own() {
    let lab = lab();
    let fine = ["--set", "step=0.1 ms", "--until", "2 ms", "--checkpoint-every", "0.1 ms"];
    lab.run("sim.ron", "fine", &fine).code(0);
    let saved = |out: &str| names(&lab.path(out)).iter().filter(|n| n.ends_with("lwck")).count();
    assert_eq!(saved("fine"), 20, "{:?}", names(&lab.path("fine")));
    assert!(lab.path("fine/checkpoint_0.0013.lwck").exists(), "{:?}", names(&lab.path("fine")));
    // A third of a second is written in three forms, and fits three times in a second.
    for (out, third) in [("a", "1/3"), ("b", "0.3333333333333333"), ("c", "1/3 s")] {
        lab.run("sim.ron", out, &["--until", "4s", "--checkpoint-every", third]).code(0);
        assert_eq!(saved(out), 12, "{third}");
    }
    assert!(lab.path("a/checkpoint_0.334.lwck").exists());
}

#[test]
fn only_the_last_checkpoints_are_kept() {
    let lab = lab();
    let saved = |out: &str| -> Vec<String> {
        names(&lab.path(out)).into_iter().filter(|n| n.ends_with("lwck")).collect()
    };
    let every = ["--checkpoint-every", "0.1s"];
    lab.run("sim.ron", "out", &[&every[..], &["--keep", "3"]].concat()).code(0);
    assert_eq!(saved("out"), ["checkpoint_0.8.lwck", "checkpoint_0.9.lwck", "checkpoint_1.lwck"]);
    let files = lab.summary("out")["files"].to_string();
    assert!(!files.contains("checkpoint_0.7") && files.contains("checkpoint_0.8"), "{files}");
    // The remaining files are complete.
    lab.resume("out/checkpoint_0.8.lwck", "again", &[]).code(0);
    assert_eq!(lab.hash("again"), lab.hash("out"));
    lab.run("sim.ron", "all", &every).code(0);
    assert_eq!(saved("all").len(), 10);
    lab.run("sim.ron", "x", &[&every[..], &["--keep", "0"]].concat()).code(2);
    lab.run("sim.ron", "x", &["--keep", "2"]).code(2).tells(&["--checkpoint-every"]);
}

#[test]
fn real_time_with_long_steps_hears_ctrl_c() {
    let lab = Lab::new();
    // Only the pendulum moves: a step of a minute is one sleep.
    lab.write(
        "sim.ron",
        "Simulation(\n    parts: { \"Source\": (model: \"basics.constant\", params: { \"value\": 1 }) },\n    step: \
         \"60 s\",\n    until: \"1 h\",\n    log: [(channels: [\"**\"])],\n)\n",
    );
    let args = ["run", "sim.ron", "--out", "out", "--realtime", "--save-rrd", "off"];
    let child = lab.spawn(&args);
    wait_for(&lab.path("out/run.mcap"));
    std::thread::sleep(Duration::from_millis(300));
    let clock = Instant::now();
    signal(&child, "INT");
    let said: Said = child.wait_with_output().unwrap().into();
    assert!(clock.elapsed() < Duration::from_secs(10), "it slept on for {:?}", clock.elapsed());
    said.code(130);
    assert_eq!(lab.summary("out")["ended"], "interrupted");
    assert!(lab.path("out/interrupted.lwck").exists());
}

#[test]
fn a_plot_of_huge_numbers_ends_and_comes_last() {
    let lab = Lab::new();
    lab.write(
        "sim.ron",
        &edited(&[
            ("\"value\": 1 ", "\"value\": 1e307 "),
            ("\"k\": 2", "\"k\": 9"),
            ("of: [\"bob.angle\"], unit: \"deg\"", "of: [\"Gain.y\", \"bob.angle\"]"),
            ("\"Gain.y -> Lag.u\"", ""),
            ("\"Lag\": (model: \"basics.lag\", params: { \"time_constant\": \"1 s\" }),", ""),
        ]),
    );
    lab.write("none.ron", BASE);
    let clock = Instant::now();
    let said = lab.run("sim.ron", "out", &[]);
    assert!(clock.elapsed() < Duration::from_secs(60), "{:?}", clock.elapsed());
    said.code(0);
    let svg = std::fs::read_to_string(lab.path("out/plots.svg")).unwrap();
    assert!(svg.contains("beyond 1e30"), "the picture says nothing of what it leaves out");
    // If a plot cannot be drawn, all other files exist, and the exit code reports the failure.
    let Some(_small) = Small::mount(lab.path("small"), "24k") else { return };
    lab.run("none.ron", "small/out", &["--no-log"]).code(1).tells(&["plots.svg", "help: "]);
    assert_eq!(names(&lab.path("small/out")), ["summary.json"]);
    assert_eq!(lab.summary("small/out")["ended"], "until");
}

#[test]
fn files_cannot_give_orders_to_the_terminal() {
    let lab = Lab::new();
    let evil = "\u{1b}]0;owned\u{7}\u{1b}[8mhidden\u{9b}2J";
    lab.write("sim.ron", &edited(&[("\"largest speed\"", &format!("\"{evil}\""))]));
    let said = lab.run("sim.ron", "out", &[]).code(0);
    lab.write("bad.ron", &edited(&[("\"damping\"", &format!("\"{evil}\""))]));
    let bad = lab.linkwork(&["check", "bad.ron"]).code(2);
    for text in [&said.out, &said.err, &bad.err] {
        assert!(!text.contains(['\u{1b}', '\u{7}', '\u{9b}']), "{text:?}");
    }
    assert!(said.out.contains("\\u{1b}]0;owned"), "{}", said.out);
    assert!(bad.err.contains("\\u{1b}]0;owned"), "{}", bad.err);
    // A number of 300 digits is written as a power of ten.
    lab.write(
        "huge.ron",
        &edited(&[("\"value\": 1 ", "\"value\": 1e308 "), ("\"k\": 2", "\"k\": 1e10")]),
    );
    let said = lab.run("huge.ron", "huge", &[]).code(1);
    lab.write("big.ron", &edited(&[("mass: \"1 kg\"", "mass: \"-1e300 kg\"")]));
    let big = lab.linkwork(&["check", "big.ron"]).code(2);
    for err in [&said.err, &big.err] {
        let longest = err.split(|c: char| !c.is_ascii_digit()).map(str::len).max().unwrap_or(0);
        assert!(longest < 30, "a number of {longest} digits:\n{err}");
    }
}

/// Pseudorandom numbers, the same in every run (SplitMix64).
struct Dice(u64);

impl Dice {
    fn part(&mut self) -> f64 {
        (splitmix(&mut self.0) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// `kill -9` at random instants of a rover's run, after its begin: every checkpoint is complete and continues to the same hash, every log is readable
/// and contains the rows of a complete run.
#[test]
fn kills_at_random_instants_of_a_rover_leave_no_trace() {
    let (lab, rover) = (Lab::new(), sim("rover_traverse"));
    let args = ["--until", "4s", "--checkpoint-every", "0.25s"];
    fn run<'a>(rover: &'a str, out: &'a str, args: &[&'a str]) -> Vec<&'a str> {
        [&["run", rover, "--out", out][..], args, &QUIET].concat()
    }
    lab.linkwork(&run(&rover, "whole", &args)).code(0);
    // The process is killed between its first and last step; before the first step it loads.
    let steps = Duration::from_secs_f64(lab.summary("whole")["wall_time"].as_f64().unwrap());
    let (hash, whole) = (lab.hash("whole"), read_log(&lab.path("whole/run.mcap")).unwrap());
    let (wanted, mut done, mut dice) = (kills(3), 0, Dice(14));
    let (mut checkpoints, mut resumed, mut rows, mut half) = (0, 0, 0, 0);
    for tries in 0.. {
        assert!(tries < 10 * wanted + 10, "the run is too short for this test");
        let _ = std::fs::remove_dir_all(lab.path("killed"));
        let mut child = lab.spawn(&run(&rover, "killed", &args));
        wait_for(&lab.path("killed/run.mcap"));
        std::thread::sleep(steps.mul_f64(dice.part()));
        let ended = child.try_wait().unwrap().is_some();
        killed(&mut child);
        if ended {
            continue;
        }
        let left = if lab.path("killed").exists() { names(&lab.path("killed")) } else { vec![] };
        let mut newest: Option<(f64, String)> = None;
        for name in &left {
            let path = lab.path("killed").join(name);
            match name.rsplit('.').next().unwrap() {
                "lwck" => {
                    let time = Checkpoint::read(&path).unwrap_or_else(|e| panic!("{e}")).time;
                    checkpoints += 1;
                    // No time is left to simulate after the checkpoint at the end.
                    if time < 4.0 && newest.as_ref().is_none_or(|n| n.0 < time) {
                        newest = Some((time, format!("killed/{name}")));
                    }
                }
                // A file gets its final name only when it is complete.
                "part" => half += 1,
                "mcap" => {}
                // The process was killed after the last step: a file with the final name is
                // complete.
                "json" => assert_eq!(lab.hash("killed"), hash),
                "svg" => {
                    let text = std::fs::read_to_string(&path).unwrap();
                    assert!(text.trim_end().ends_with("</svg>"), "{name}");
                }
                _ => panic!("{left:?}"),
            }
        }
        let log = lab.path("killed/run.mcap");
        // The log does not exist before its first byte is written.
        if log.metadata().is_ok_and(|m| m.len() > 0) {
            let log = read_log_contents(&log).unwrap_or_else(|e| panic!("{e}"));
            for (name, s) in &log.series {
                let n = s.t.len();
                assert_eq!(
                    (&s.t[..], &s.y[..]),
                    (&whole[name].t[..n], &whole[name].y[..n]),
                    "{name}"
                );
                rows += n;
            }
            let last =
                log.series.values().filter_map(|s| s.t.last()).fold(-1.0f64, |m, t| m.max(*t));
            if let Some((time, _)) = &newest {
                assert!(
                    last >= time - 1e-9,
                    "the log ends at {last} s, the checkpoint is at {time} s"
                );
            }
        }
        match newest {
            Some((_, file)) => {
                let _ = std::fs::remove_dir_all(lab.path("rest"));
                lab.resume(&file, "rest", &["--until", "4s"]).code(0);
                assert_eq!(lab.hash("rest"), hash, "{file}");
                resumed += 1;
            }
            // The run starts again at its beginning, next to the files of the killed run.
            None => {
                lab.linkwork(&run(&rover, "killed", &args)).code(0);
                assert_eq!(lab.hash("killed"), hash);
                let left = names(&lab.path("killed"));
                assert!(left.iter().all(|n| !n.ends_with(".part")), "{left:?}");
            }
        }
        done += 1;
        if done == wanted {
            break;
        }
    }
    println!(
        "{done} kills of a rover: {resumed} resumed, {checkpoints} checkpoints whole, {half} not under their names \
         yet, {rows} numbers of logs as in the run that was not killed"
    );
}

//! Equal input gives equal bits: across processes, checkpoints, logs, folders and orders of a file.
use crate::common;
use common::{BASE, Lab, edited, root, sim};
use linkwork_record::read_log;
use std::path::Path;

/// Coarse ground: a run takes about a second.
const COARSE: [&str; 2] = ["--set", "Rover.Environment.Terrain.spacing=0.5"];

fn rover(lab: &Lab, out: &str, more: &[&str]) -> String {
    lab.run(&sim("rover_traverse"), out, &[&COARSE, more].concat()).code(0);
    lab.hash(out)
}

#[test]
fn a_resumed_rover_is_the_same_rover() {
    let (lab, far) = (Lab::new(), Lab::new());
    let whole = rover(&lab, "whole", &["--until", "20s"]);
    rover(&lab, "half", &["--until", "12s", "--checkpoint-every", "5s"]);
    assert!(lab.path("half/checkpoint_5.lwck").exists());
    std::fs::copy(lab.path("half/checkpoint_10.lwck"), far.path("at10.lwck")).unwrap();
    // The run continues in another folder without the simulation's folder: the checkpoint contains everything that it needs.
    far.resume("at10.lwck", "rest", &["--until", "20s", "--checkpoint-every", "5s"]).code(0);
    assert_eq!(far.hash("rest"), whole);
    // A resumed run can be resumed again.
    far.resume("rest/checkpoint_15.lwck", "again", &["--until", "20s"]).code(0);
    assert_eq!(far.hash("again"), whole);
    // The metrics continue: every sample counts once.
    let metrics = |l: &Lab, out: &str| l.summary(out)["metrics"].clone();
    assert_eq!(metrics(&lab, "whole"), metrics(&far, "rest"));
    assert_eq!(metrics(&lab, "whole"), metrics(&far, "again"));
    // The log continues as well.
    let (a, b) = (
        read_log(&lab.path("whole/run.mcap")).unwrap(),
        read_log(&far.path("rest/run.mcap")).unwrap(),
    );
    let name = "Rover.Hardware.Wheels.Wheel1.SurfaceContact.normal_force";
    let (x, y) = (&a[name], &b[name]);
    let tail = x.t.iter().position(|t| *t >= y.t[0]).unwrap();
    assert!(y.t[0] > 9.99 && y.t[0] < 10.06 && x.t.len() > 300, "{}", y.t[0]);
    assert_eq!((&x.t[tail..], &x.y[tail..]), (&y.t[..], &y.y[..]));
}

#[test]
fn what_is_written_has_no_influence() {
    let lab = Lab::new();
    let plain = rover(&lab, "plain", &["--until", "6s"]);
    assert_eq!(rover(&lab, "no_log", &["--until", "6s", "--no-log"]), plain);
    assert_eq!(rover(&lab, "deep/other", &["--until", "6s", "--checkpoint-every", "1.5s"]), plain);
    #[cfg(feature = "viewer")]
    {
        let head = ["run", &sim("rover_traverse"), "--out", "rrd", "--until", "6s"];
        lab.linkwork(&[&head[..], &COARSE].concat()).code(0);
        assert_eq!(lab.hash("rrd"), plain);
        let recording = std::fs::read(lab.path("rrd/run.rrd")).unwrap();
        assert!(
            recording.starts_with(b"RRF") && recording.len() > 100_000,
            "no recording was written"
        );
        lab.linkwork(&["diff", "plain/run.mcap", "rrd/run.mcap"]).code(0);
    }
    let other = rover(&lab, "seed", &["--until", "6s", "--seed", "43"]);
    assert_ne!(other, plain, "the noise of the sensors follows the seed");
    lab.linkwork(&["diff", "plain/run.mcap", "deep/other/run.mcap"]).code(0);
}

/// Reverses the order of lines that begin (after blanks) with one of `heads`.
fn reversed(text: &str, heads: &[&str]) -> String {
    let hit = |l: &str| heads.iter().any(|h| l.trim_start().starts_with(h));
    let mut back: Vec<&str> = text.lines().filter(|l| hit(l)).collect();
    assert!(back.len() > 1, "nothing to reverse: {heads:?}");
    let lines: Vec<&str> =
        text.lines().map(|l| if hit(l) { back.pop().unwrap() } else { l }).collect();
    lines.join("\n") + "\n"
}

#[test]
fn the_order_of_a_file_has_no_influence() {
    let lab = Lab::new();
    let until = ["--until", "6s"];
    let plain = rover(&lab, "plain", &until);
    let read = |p: &str| std::fs::read_to_string(root().join(p)).unwrap();
    let mut assembly = read("assemblies/rovers/rocker_bogie.ron");
    assembly = reversed(
        &assembly,
        &["\"StopLeft\"", "\"StopRight\"", "\"FrictionLeft\"", "\"FrictionRight\""],
    );
    assembly = reversed(&assembly, &["\"IMU\"", "\"SunSensor\"", "\"Pose\""]);
    assembly = reversed(
        &assembly,
        &["\"Hardware.Wheels", "\"LocomotionSoftware.Ackermann.", "\"Hardware.Sensors"],
    );
    lab.write("permuted/rover.ron", &assembly);
    let simulation =
        read("sims/rover_traverse/sim.ron").replace("rovers/rocker_bogie.ron", "rover.ron");
    lab.write("permuted/sim.ron", &simulation);
    lab.run("permuted", "other", &[&COARSE[..], &until].concat()).code(0);
    assert_eq!(lab.hash("other"), plain);
    lab.write("base.ron", BASE);
    lab.write(
        "turned.ron",
        &edited(&[(
            "\"Source.y -> Gain.u\", \"Gain.y -> Lag.u\"",
            "\"Gain.y -> Lag.u\", \"Source.y -> Gain.u\"",
        )]),
    );
    lab.run("base.ron", "base", &[]).code(0);
    lab.run("turned.ron", "turned", &[]).code(0);
    assert_eq!(lab.hash("base"), lab.hash("turned"));
}

#[test]
fn noise_follows_the_seed() {
    let lab = Lab::new();
    lab.write(
        "noisy.ron",
        &edited(&[(
            "\"Source\": (",
            "\"IMU\": (model: \"sensors.imu\", rate: \"100 Hz\", params: { \"grade\": \"mems\" }, bind: { \"mount\": \"node:bob\" }),\n\"Source\": (",
        )]),
    );
    let hash = |out: &str, more: &[&str]| {
        lab.run("noisy.ron", out, more).code(0);
        lab.hash(out)
    };
    let (a, b) = (hash("a", &["--seed", "1"]), hash("b", &["--seed", "2"]));
    assert_ne!(a, b);
    assert_eq!(hash("c", &["--seed", "1"]), a);
    assert_eq!(lab.summary("b")["seed"], 2);
}

#[test]
fn differences_are_named() {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    let run = |out: &str, more: &[&str]| {
        let all = [&["--until", "2s", "--checkpoint-every", "1s"], more].concat();
        lab.run("sim.ron", out, &all).code(0);
    };
    run("a", &[]);
    run("b", &[]);
    run("c", &["--set", "Gain.k=2.001"]);
    let diff = |file: &str, out: &str, more: &[&str]| {
        let (x, y) = (format!("a/{file}"), format!("{out}/{file}"));
        lab.linkwork(&[&["diff", &x, &y], more].concat())
    };
    for file in ["run.mcap", "checkpoint_1.lwck"] {
        let equal = diff(file, "b", &[]).code(0).out;
        assert!(equal.starts_with("equal: "), "{equal}");
        let other = diff(file, "c", &[]).code(1).out;
        for name in ["Gain.y", "Lag.state.x", "Lag.y"] {
            assert!(other.contains(&format!("  {name}: ")), "`{name}` is not named:\n{other}");
        }
        assert!(!other.contains("bob"), "{other}");
        diff(file, "c", &["--rel", "1e-2"]).code(0);
        diff(file, "c", &["--abs", "1e-2"]).code(0);
        diff(file, "c", &["--rel", "1e-9"]).code(1);
    }
    // The last matching pattern applies, and a pattern without a match is a mistake.
    let log = |more: &[&str]| diff("run.mcap", "c", more);
    log(&["--tol", "Gain.*=1e-2", "--tol", "Lag.**=0,1e-2"]).code(0);
    let other = log(&["--tol", "**=1e-2", "--tol", "Lag.*=0"]).code(1).out;
    assert!(other.contains("  Lag.y: ") && !other.contains("Gain.y"), "{other}");
    log(&["--tol", "Gian.*=1"]).code(2).tells(&["`Gian.*` matches nothing", "help: "]);
    log(&["--tol", "Gain.y=much"]).code(2).tells(&["is not a tolerance", "PATTERN=1e-6"]);
    log(&["--abs", "-1"]).code(2).tells(&["--abs is -1"]);
    // The log with another rate is unequal, unless only common rows are compared.
    lab.write("slow.ron", &BASE.replace("rate: \"100 Hz\"", "rate: \"40 Hz\""));
    lab.run("slow.ron", "slow", &["--until", "1.5s"]).code(0);
    let slow =
        |more: &[&str]| lab.linkwork(&[&["diff", "a/run.mcap", "slow/run.mcap"], more].concat());
    assert!(slow(&[]).code(1).out.contains("samples"));
    assert!(slow(&["--common"]).code(0).out.contains("at common samples"));
    let same = ["diff", "c/run.mcap", "slow/run.mcap", "--common"];
    assert!(lab.linkwork(&same).code(1).out.contains("Gain.y"));
    // Logs of unequal length are not equal.
    lab.run("sim.ron", "short", &["--until", "1s"]).code(0);
    assert!(
        lab.linkwork(&["diff", "a/run.mcap", "short/run.mcap"]).code(1).out.contains("samples")
    );
}

/// Two folders of runs: the changed setting and the metrics, with tolerances.
#[test]
fn runs_are_compared_by_settings_and_metrics() {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    let run = |out: &str, more: &[&str]| {
        lab.run("sim.ron", out, &[&["--until", "2s"], more].concat()).code(0);
    };
    run("a", &[]);
    run("b", &["--set", "Friction.damping=0.3"]);
    run("same", &[]);
    run("nolog", &["--no-log"]);
    let diff = |a: &str, b: &str, more: &[&str]| lab.linkwork(&[&["diff", a, b], more].concat());
    let equal = diff("a", "same", &[]).code(0).out;
    assert!(equal.contains("metrics: 0 of ") && !equal.contains("configuration"), "{equal}");
    let other = diff("a", "b", &[]).code(1).out;
    let names = |mark: &str, text: &str| {
        let mut lines = other.lines().map(str::trim);
        lines.any(|line| line.starts_with(mark) && line.contains(text))
    };
    assert!(
        names("- Friction: ", "\"damping\": 0.05") && names("+ Friction: ", "\"damping\": 0.3"),
        "{other}"
    );
    // The table has the numbers of the two summaries, and their difference.
    let value = |out: &str| lab.summary(out)["metrics"]["largest speed"][0].as_f64().unwrap();
    let (x, y) = (value("a"), value("b"));
    let share = format!("{:+.2} %", 100.0 * (y - x) / x.abs());
    assert!(x != y && names("largest speed", &share), "{share}: {other}");
    let far = format!("largest speed={}", 1.01 * (y - x).abs());
    let near = format!("largest speed={}", 0.99 * (y - x).abs());
    diff("a", "b", &["--tol", &far]).code(0);
    diff("a", "b", &["--tol", &near]).code(1);
    diff("a", "b", &["--tol", "None=1"]).code(2).tells(&["matches no metric"]);
    diff("a", "b", &["--common"]).code(2).tells(&["--common has no effect"]);
    // The configuration is in the log, so only metrics are compared without one.
    let summary = diff("a/summary.json", "nolog/summary.json", &[]).code(0).out;
    assert!(summary.contains("not compared, because a folder has no run.mcap"), "{summary}");
    diff("a", "nothing", &[]).code(2).tells(&["nothing", "help: "]);
    lab.write("x/summary.json", "{}");
    diff("a", "x", &[]).code(2).tells(&["is not the summary of a run"]);
}

#[test]
fn a_resumed_run_keeps_the_log_of_what_came_before() {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    lab.linkwork(&[
        "run",
        "sim.ron",
        "--until",
        "2s",
        "--checkpoint-every",
        "1s",
        "--save-rrd",
        "off",
    ])
    .code(0);
    let folder = common::names(&lab.path("runs"));
    let first = Path::new("runs").join(&folder[0]);
    let before = std::fs::read(lab.path(&first.join("run.mcap").display().to_string())).unwrap();
    let from = first.join("checkpoint_1.lwck").display().to_string();
    lab.linkwork(&["resume", &from, "--until", "3s", "--save-rrd", "off"]).code(0);
    assert_eq!(
        std::fs::read(lab.path(&first.join("run.mcap").display().to_string())).unwrap(),
        before
    );
    assert_eq!(common::names(&lab.path("runs")).len(), 2);
}

/// The program does not use mathematical functions of the C library, which has several versions and chooses by the processor.
#[cfg(target_os = "linux")]
#[test]
fn the_program_takes_no_mathematical_function_of_the_c_library() {
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_linkwork"));
    // The libraries of exported units and of the embedded robot model are checked as well.
    let folder = program.parent().unwrap();
    let places = [folder.to_path_buf(), folder.join("deps")];
    let library = |name: &str| {
        let built = |place: &std::path::PathBuf| {
            let file = place.join(name);
            Some((file.metadata().ok()?.modified().ok()?, file))
        };
        // An older one may be left from another build.
        let newest = places.iter().filter_map(built).max();
        newest.unwrap_or_else(|| panic!("{name} is built with the tests of the workspace")).1
    };
    let [unit, robot] = ["liblinkwork_unit.so", "liblinkwork_robot.so"].map(library);
    let names = [
        "sin", "cos", "sincos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh",
        "asinh", "acosh", "atanh", "exp", "exp2", "exp10", "expm1", "log", "log2", "log10",
        "log1p", "pow", "cbrt", "hypot", "tgamma", "lgamma", "lgamma_r", "erf", "erfc",
    ];
    for file in [program, &unit, &robot] {
        let Ok(listed) = std::process::Command::new("nm").arg("-D").arg(file).output() else {
            assert!(std::env::var_os("CI").is_none(), "there is no `nm`");
            println!("skipped: there is no `nm`");
            return;
        };
        let text = String::from_utf8(listed.stdout).unwrap();
        let taken: Vec<&str> = text
            .lines()
            .filter_map(|line| line.trim().strip_prefix("U "))
            .map(|name| name.split('@').next().unwrap_or(name))
            .collect();
        assert!(taken.contains(&"malloc"), "{}: nm lists what is taken", file.display());
        let bad: Vec<&&str> = taken
            .iter()
            .filter(|name| names.contains(name) || names.contains(&name.trim_end_matches('f')))
            .collect();
        assert!(bad.is_empty(), "{}: {bad:?}", file.display());
        // A program that is linked with the library of the robot model keeps the functions of the C library.
        let given = |line: &&str| names.iter().any(|name| line.ends_with(&format!(" T {name}")));
        let given: Vec<&str> = text.lines().filter(given).collect();
        assert!(*file != *robot || given.is_empty(), "{}: {given:?}", file.display());
    }
}

/// The last states of simulations are equal with glibc's functions for FMA and AVX2 and with those for any processor.
#[cfg(target_os = "linux")]
#[test]
fn other_functions_of_the_c_library_change_no_bits() {
    let lab = Lab::new();
    for (sim, until) in [
        ("pendulum", "5s"),
        ("mars_edl", "40s"),
        ("sol", "600s"),
        ("attitude", "20s"),
        ("rover_traverse", "2s"),
        ("earth_orbit", "6000s"),
    ] {
        let hash = |out: &str, tunables: &str| {
            let file = common::sim(sim);
            let args =
                ["run", &file, "--out", out, "--save-rrd", "off", "--no-log", "--until", until];
            let ran = lab.command(&args).env("GLIBC_TUNABLES", tunables).output().unwrap();
            common::Said::from(ran).code(0);
            lab.hash(out)
        };
        let usual = hash("usual", "");
        let other =
            hash("other", "glibc.cpu.hwcaps=-AVX2_Usable,-FMA_Usable,-AVX2,-FMA,-FMA4,-AVX512F");
        assert_eq!(usual, other, "{sim}");
    }
}

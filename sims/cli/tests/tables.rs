//! Tables of a run: its log as Parquet, and a profile of its time.
use crate::common::{BASE, Lab, sim};

#[test]
fn a_log_becomes_a_table_or_says_why_not() {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    lab.run("sim.ron", "run", &["--until", "1s"]).code(0);
    let log = "run/run.mcap";
    let said = lab.linkwork(&["export", log, "--parquet", "run.parquet"]).code(0).out;
    assert!(said.contains("run.parquet: ") && said.contains(" rows of "), "{said}");
    let table = std::fs::read(lab.path("run.parquet")).unwrap();
    assert!(table.starts_with(b"PAR1") && table.ends_with(b"PAR1"));
    // A second export gives the same bytes.
    lab.linkwork(&["export", log, "--parquet", "again.parquet"]).code(0);
    assert_eq!(std::fs::read(lab.path("again.parquet")).unwrap(), table);
    let before = std::fs::read(lab.path(log)).unwrap();
    lab.linkwork(&["export", log, "--parquet", log])
        .code(2)
        .tells(&["is the log itself", "help: "]);
    assert_eq!(std::fs::read(lab.path(log)).unwrap(), before);
    lab.linkwork(&["export", "sim.ron", "--parquet", "x.parquet"]).code(2).tells(&["help: "]);
    lab.linkwork(&["export", log]).code(2).tells(&["--fmu", "--parquet"]);
    let both = ["export", log, "--parquet", "x.parquet", "--fmu", "x.fmu"];
    lab.linkwork(&both).code(2).tells(&["cannot be used with"]);
    // Options for an FMU are valid with `--fmu`; here only the simulation is missing.
    let unit =
        ["export", "none.ron", "--fmu", "x.fmu", "--input", "a", "--output", "b", "--set", "p=1"];
    lab.linkwork(&unit).code(2).tells(&["there is no simulation `none.ron`"]);
    let set = ["export", log, "--parquet", "x.parquet", "--set", "Friction.damping=0.3"];
    lab.linkwork(&set).code(2).tells(&["--set"]);
    lab.linkwork(&["export", log, "--parquet", "no/x.parquet"])
        .code(1)
        .tells(&["cannot be written"]);
    assert!(!lab.path("x.parquet").exists());
}

/// Returns the stacks of a run, each with its microseconds.
fn stacks(lab: &Lab, out: &str) -> Vec<(String, u64)> {
    let text = std::fs::read_to_string(lab.path(&format!("{out}/profile.folded"))).unwrap();
    let line = |l: &str| {
        let (stack, count) = l.rsplit_once(' ').unwrap();
        (stack.to_string(), count.parse().unwrap())
    };
    text.lines().map(line).collect()
}

/// A run with and without a profile has equal bits, and the stacks add up to the elapsed time.
fn profiled(simulation: &str, until: &str, has: &[&str]) {
    let lab = Lab::new();
    let run = |out: &str, more: &[&str]| {
        let more = [&["--until", until], more].concat();
        lab.run(simulation, out, &more).code(0).out
    };
    run("plain", &[]);
    let said = run("timed", &["--profile"]);
    assert_eq!(lab.hash("plain"), lab.hash("timed"));
    assert!(!lab.path("plain/profile.folded").exists());
    let all = stacks(&lab, "timed");
    for stack in has {
        let found = all.iter().find(|(s, _)| s.ends_with(stack));
        assert!(found.is_some_and(|(_, us)| *us > 0), "{stack}: {all:#?}");
    }
    let summary = lab.summary("timed");
    assert!(summary["files"].to_string().contains("profile.folded"), "{summary}");
    let wall = summary["wall_time"].as_f64().unwrap();
    let sum: u64 = all.iter().map(|(_, us)| us).sum();
    // Each line is rounded to a microsecond.
    let rounded = all.len() as f64 * 0.5e-6;
    assert!((sum as f64 * 1e-6 - wall).abs() <= rounded, "{sum} us of {wall} s");
    // The longest line of the table is the longest stack.
    let longest =
        all.iter().filter(|(s, _)| !s.ends_with("(rest)")).max_by_key(|(_, us)| us).unwrap();
    let (part, operation) = longest.0.rsplit_once(';').unwrap();
    let part = part.split_once(';').unwrap().1.replace(';', ".");
    let first = said.lines().skip_while(|l| !l.contains("part, operation")).nth(1).unwrap();
    assert!(first.ends_with(&format!("{part} {operation}")), "{first}: {longest:?}");
}

#[test]
fn a_profile_changes_no_bits_and_adds_up() {
    profiled(&sim("attitude"), "20s", &["Software;Filter;update", "Mechanism;feedthrough"]);
}

#[test]
fn a_profile_goes_over_from_phase_to_phase() {
    profiled(&sim("staging"), "20s", &["Mechanism;feedthrough"]);
}

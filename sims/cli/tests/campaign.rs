//! `linkwork campaign`: equal results however it is run, repeated runs, bad files, failures and their files.
use crate::common;
use common::{BASE, Lab, edited, killed, kills, names, root, signal, wait_for};
use std::path::Path;
use std::time::Duration;

/// Sixty runs of the pendulum, of 0.2 s each.
pub const FILE: &str = r#"Campaign(
    doc: "A pendulum with unknown friction.",
    simulation: "sim.ron",
    runs: 60,
    seed: 5,
    set: { "until": "0.2 s", "Gravity.acceleration": [0, 0, -9.8] },
    vary: {
        "Friction.damping": Uniform(from: 0.01, to: 0.2),
        "bob.mass": Normal(mean: "1 kg", deviation: "50 g"),
        "bob.com": [0, 0, TruncatedNormal(mean: -1, deviation: 0.1, from: -1.3, to: -0.7)],
        "Gain.k": Choice(of: [1, 2, 5], weights: [1, 1, 2]),
    },
    correlate: [(of: ["bob.mass", "bob.com[2]"], matrix: [[1, -0.8], [-0.8, 1]])],
    retain: (of: ["bob.*"], every: "0.02 s"),
    scatter: [("bob.mass", "largest speed"), ("bob.com[2]", "Gain.k")],
)
"#;

pub fn lab() -> Lab {
    let lab = Lab::new();
    lab.write("sim.ron", BASE);
    lab.write("c.ron", FILE);
    lab
}

/// Returns the tables that must not depend on how a campaign was run.
fn tables(lab: &Lab, out: &str) -> Vec<Vec<u8>> {
    let history = |run| format!("{out}/histories/run_{run}.parquet");
    let histories = (0..60).map(history).filter(|f| lab.path(f).exists());
    ["results", "statistics", "sensitivity", "bands"]
        .iter()
        .flat_map(|t| ["csv", "parquet"].map(|e| format!("{out}/{t}.{e}")))
        .chain([format!("{out}/report.html")])
        .chain(histories)
        .map(|f| std::fs::read(lab.path(&f)).unwrap())
        .collect()
}

/// Column of results.csv by title; the values of these campaigns have no commas.
pub fn column(lab: &Lab, out: &str, title: &str) -> Vec<String> {
    let text = std::fs::read_to_string(lab.path(&format!("{out}/results.csv"))).unwrap();
    let mut lines = text.lines();
    let k = lines.next().unwrap().split(',').position(|t| t == title);
    let k = k.unwrap_or_else(|| panic!("no column `{title}`:\n{text}"));
    lines.map(|l| l.split(',').nth(k).unwrap().to_string()).collect()
}

pub fn numbers(lab: &Lab, out: &str, title: &str) -> Vec<f64> {
    column(lab, out, title).iter().map(|t| t.parse().unwrap()).collect()
}

/// The first run of every campaign in the repository: varied parameters exist, with valid ranges and units.
#[test]
fn campaigns_that_ship_run() {
    let (lab, sims) = (lab(), root().join("sims").canonicalize().unwrap());
    let mut found = 0;
    for folder in std::fs::read_dir(sims).unwrap().map(|e| e.unwrap().path()) {
        for file in std::fs::read_dir(&folder).into_iter().flatten().map(|e| e.unwrap().path()) {
            let is = |t: String| t.starts_with("Campaign(");
            if file.extension().is_some_and(|e| e == "ron")
                && std::fs::read_to_string(&file).is_ok_and(is)
            {
                found += 1;
                let (file, out) = (file.display().to_string(), format!("out{found}"));
                lab.linkwork(&["campaign", &file, "--run", "0", "--out", &out]).code(0);
            }
        }
    }
    assert!(found >= 3, "{found}");
}

#[test]
fn threads_kills_and_stops_leave_no_trace() {
    let lab = lab();
    let said = lab.linkwork(&["campaign", "c.ron", "--out", "one", "--threads", "1"]).code(0);
    assert!(said.out.contains("60 of 60 runs have ended"), "{}", said.out);
    lab.linkwork(&["campaign", "c.ron", "--out", "four", "--threads", "4"]).code(0);
    let wanted = tables(&lab, "one");
    assert_eq!(tables(&lab, "four"), wanted, "threads leave a trace");
    // The campaign is killed repeatedly, at instants that approach the end of a run's line.
    let journal = lab.path("killed/journal");
    let lines = || std::fs::read_to_string(&journal).unwrap_or_default().lines().count();
    let (least, mut kills) = (kills(2), 0);
    for k in 0u64.. {
        let before = lines();
        let mut child = lab.spawn(&["campaign", "c.ron", "--out", "killed", "--threads", "2"]);
        wait_for(&journal);
        for _ in 0..400 {
            if lines() > before.max(1) || child.try_wait().unwrap().is_some() {
                break;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        std::thread::sleep(Duration::from_micros(300 * (k % 40)));
        let ended = child.try_wait().unwrap().is_some();
        killed(&mut child);
        if ended {
            assert_eq!(tables(&lab, "killed"), wanted, "{kills} kills leave a trace");
            if kills >= least {
                break;
            }
            assert!(kills > 0 && k < 10 * least as u64, "the campaign is too short for this test");
            std::fs::remove_dir_all(lab.path("killed")).unwrap();
            continue;
        }
        kills += 1;
    }
    println!("{kills} kills of a campaign");
    lab.linkwork(&["campaign", "c.ron", "--out", "killed"]).code(0);
    assert_eq!(tables(&lab, "killed"), wanted, "{kills} kills leave a trace");
    assert_eq!(lines(), 61, "a run was made twice, or lost");
    // A repeated command runs no simulation, and writes equal files.
    std::fs::remove_file(lab.path("killed/results.csv")).unwrap();
    let said = lab.linkwork(&["campaign", "c.ron", "--out", "killed"]).code(0);
    assert!(said.out.contains("60 runs have ended already"), "{}", said.out);
    assert_eq!((tables(&lab, "killed"), lines()), (wanted.clone(), 61));
    // Histories that a power cut removed, truncated or corrupted are made again.
    std::fs::remove_file(lab.path("killed/histories/run_7.parquet")).unwrap();
    lab.write("killed/histories/run_9.parquet", "PAR1");
    let path = lab.path("killed/histories/run_11.parquet");
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(path, bytes).unwrap();
    let said = lab.linkwork(&["campaign", "c.ron", "--out", "killed"]).code(0);
    assert!(said.out.contains("57 runs have ended already"), "{}", said.out);
    assert_eq!((tables(&lab, "killed"), lines()), (wanted, 61));
}

/// A run that is repeated for its history but ends differently is rejected, also when the command is repeated.
#[test]
fn a_run_that_ends_otherwise_gives_no_history() {
    let lab = lab();
    lab.write("c.ron", &FILE.replace("runs: 60", "runs: 4"));
    lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    let journal = std::fs::read_to_string(lab.path("out/journal")).unwrap();
    let other = |line: &str| {
        let mut outcome: serde_json::Value = serde_json::from_str(&line[9..]).unwrap();
        if outcome["run"] != 2 {
            return line.to_string();
        }
        outcome["hash"] = 7.into();
        let text = outcome.to_string();
        format!("{:08x} {text}", crc32(text.as_bytes()))
    };
    let changed: Vec<String> = journal.lines().map(other).collect();
    assert_ne!(changed.join("\n") + "\n", journal);
    lab.write("out/journal", &(changed.join("\n") + "\n"));
    let history = lab.path("out/histories/run_2.parquet");
    std::fs::remove_file(&history).unwrap();
    for _ in 0..2 {
        let said = lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(1);
        said.tells(&["run 2 of the campaign", "0000000000000007"]);
        assert!(!history.exists(), "the history of another run is there");
    }
    // A file that cannot be written is named in the error, and written later when that is possible.
    lab.write("out/journal", &journal);
    std::fs::create_dir_all(lab.path("out/histories/run_2.parquet/in the way")).unwrap();
    let said = lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(1);
    said.tells(&["run_2.parquet", "cannot be written"]);
    std::fs::remove_dir_all(&history).unwrap();
    let said = lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    assert!(said.out.contains("3 runs have ended already"), "{}", said.out);
}

#[test]
fn ctrl_c_keeps_what_has_ended() {
    let lab = lab();
    lab.write("c.ron", &FILE.replace("\"0.2 s\"", "\"20 s\"").replace("runs: 60", "runs: 5000"));
    let child = lab.spawn(&["campaign", "c.ron", "--out", "out"]);
    let journal = lab.path("out/journal");
    wait_for(&journal);
    while std::fs::read_to_string(&journal).unwrap().lines().count() < 4 {
        std::thread::sleep(Duration::from_millis(5));
    }
    signal(&child, "INT");
    let said: common::Said = child.wait_with_output().unwrap().into();
    let said = said.code(130).tells(&["continue with: linkwork campaign c.ron --out out"]);
    let rows = column(&lab, "out", "run").len();
    assert!((3..5000).contains(&rows), "{rows}: {}", said.out);
    // A second campaign in the same folder is rejected.
    let mut first = lab.spawn(&["campaign", "c.ron", "--out", "out"]);
    std::thread::sleep(Duration::from_millis(400));
    lab.linkwork(&["campaign", "c.ron", "--out", "out"])
        .code(2)
        .tells(&["another campaign is writing", "choose another folder"]);
    killed(&mut first);
}

#[test]
fn draws_have_the_distributions_and_correlations_that_the_file_says() {
    let lab = lab();
    let file = FILE.replace("runs: 60", "runs: 800").replace("\"0.2 s\"", "\"0.01 s\"");
    lab.write("c.ron", &file);
    lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    let n = 800.0f64;
    let mass = numbers(&lab, "out", "draw:bob.mass [kg]");
    let com = numbers(&lab, "out", "draw:bob.com[2]");
    let damping = numbers(&lab, "out", "draw:Friction.damping");
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n;
    let moment = |x: &[f64], y: &[f64]| {
        let (a, b) = (mean(x), mean(y));
        x.iter().zip(y).map(|(x, y)| (x - a) * (y - b)).sum::<f64>() / n
    };
    let correlation = |x: &[f64], y: &[f64]| moment(x, y) / (moment(x, x) * moment(y, y)).sqrt();
    // The bounds are four standard errors.
    assert!((mean(&mass) - 1.0).abs() < 4.0 * 0.05 / n.sqrt(), "{}", mean(&mass));
    assert!((moment(&mass, &mass).sqrt() / 0.05 - 1.0).abs() < 4.0 / (2.0 * n).sqrt());
    assert!(com.iter().all(|x| (-1.3..=-0.7).contains(x)));
    assert!((correlation(&mass, &com) + 0.8).abs() < 4.0 * (1.0 - 0.64) / n.sqrt());
    assert!(correlation(&mass, &damping).abs() < 4.0 / n.sqrt());
    assert!((mean(&damping) - 0.105).abs() < 4.0 * 0.19 / 12f64.sqrt() / n.sqrt());
    let fives = numbers(&lab, "out", "draw:Gain.k").iter().filter(|k| **k == 5.0).count() as f64;
    assert!((fives / n - 0.5).abs() < 4.0 * 0.5 / n.sqrt(), "{fives}");
    // The values have effects: the noise of a part has a separate seed in each run.
    let seeds: std::collections::BTreeSet<String> =
        column(&lab, "out", "seed").into_iter().collect();
    assert_eq!(seeds.len(), 800);
    // A campaign with fewer runs equals the first runs of a larger one: draws do not depend on
    // other runs.
    lab.write("c.ron", &file.replace("runs: 800", "runs: 20"));
    lab.linkwork(&["campaign", "c.ron", "--out", "few"]).code(0);
    for title in ["draw:bob.mass [kg]", "state", "seed", "largest speed [rad/s]"] {
        assert_eq!(column(&lab, "few", title)[..], column(&lab, "out", title)[..20], "{title}");
    }
}

/// The checksum of a journal's lines (IEEE 802.3), bit by bit.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(crc ^ u32::from(*byte), |c, _| (c >> 1) ^ (0xedb8_8320 * (c & 1)))
    })
}

#[test]
fn a_run_made_again_has_the_same_bits_and_a_log() {
    let lab = lab();
    lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    let again = |more: &[&str]| {
        lab.linkwork(&[&["campaign", "c.ron", "--out", "out", "--run", "17"], more].concat())
    };
    again(&[]).code(0);
    for file in ["run.rrd", "run.mcap"] {
        assert!(!names(&lab.path("out/run_17")).contains(&file.into()), "{file}");
    }
    let said = again(&["--log"]).code(0);
    let state = column(&lab, "out", "state")[17].clone();
    assert!(said.out.contains(&format!("the same last state as in the campaign: {state}")));
    assert!(names(&lab.path("out/run_17")).contains(&"run.mcap".into()));
    assert_eq!(lab.hash("out/run_17"), state);
    // The run can also be repeated by hand, with the values of the table.
    let get = |title: &str| column(&lab, "out", title)[17].clone();
    let set = [
        "until=0.2 s".to_string(),
        "Gravity.acceleration=[0, 0, -9.8]".to_string(),
        format!("Friction.damping={}", get("draw:Friction.damping")),
        format!("bob.mass={} kg", get("draw:bob.mass [kg]")),
        format!("bob.com=[0, 0, {}]", get("draw:bob.com[2]")),
        format!("Gain.k={}", get("draw:Gain.k")),
    ];
    let set: Vec<&str> = set.iter().flat_map(|s| ["--set", s.as_str()]).collect();
    let seed = get("seed");
    lab.run("sim.ron", "hand", &[&set[..], &["--seed", &seed]].concat()).code(0);
    assert_eq!(lab.hash("hand"), state);
    // A journal with a different result gives an error.
    let journal = std::fs::read_to_string(lab.path("out/journal")).unwrap();
    let line = journal.lines().find(|l| l.contains("\"run\":17,")).unwrap();
    let text = line.split_once(' ').unwrap().1;
    let hash = text.split_once("\"hash\":").unwrap().1.split(',').next().unwrap();
    let other = text.replace(hash, "12345");
    let lied = journal.replace(line, &format!("{:08x} {other}", crc32(other.as_bytes())));
    assert_ne!(lied, journal);
    std::fs::write(lab.path("out/journal"), lied).unwrap();
    again(&[]).code(1).tells(&["in the campaign it was 0000000000003039"]);
    std::fs::write(lab.path("out/journal"), &journal).unwrap();
    again(&[]).code(0);
    lab.linkwork(&["campaign", "c.ron", "--out", "out", "--run", "60"])
        .code(2)
        .tells(&["there is no run 60", "0 to 59"]);
}

/// A state that grows as exp(k t): beyond 1e15 before the end for the larger k.
fn failing() -> Lab {
    let lab = Lab::new();
    let blow = "\"Blow\": (model: \"basics.integrator\", params: { \"k\": 1, \"start\": 1 }), \"Source\": (";
    let text = edited(&[
        ("\"Source\": (", blow),
        ("wires: [", "wires: [\"Blow.y -> Blow.u\", "),
        ("until: \"1 s\"", "until: \"3 s\""),
    ]);
    lab.write("sim.ron", &text);
    lab.write(
        "c.ron",
        "Campaign(simulation: \"sim.ron\", runs: 12, vary: {
            \"Blow.k\": Choice(of: [1, 20, \"a lot\"], weights: [2, 1, 1]),
        })",
    );
    lab
}

#[test]
fn failures_are_listed_by_cause_and_leave_what_it_takes_to_look_at_them() {
    let lab = failing();
    let said = lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(1);
    let ended = column_of_journal(&lab);
    let of = |cause: &str| -> Vec<u64> {
        ended.iter().filter(|(_, c)| c == cause).map(|(r, _)| *r).collect()
    };
    let (fine, failed, refused) = (of("until"), of("failed"), of("refused"));
    assert!(!fine.is_empty() && !failed.is_empty() && !refused.is_empty(), "{ended:?}");
    assert_eq!(fine.len() + failed.len() + refused.len(), 12);
    assert!(said.out.contains(&format!("{} failed by: failed: ", failed.len())), "{}", said.out);
    let folder = |run: u64| format!("out/failures/run_{run}");
    for run in &failed {
        let left = names(&lab.path(&folder(*run)));
        assert_eq!(left, ["before_failure.lwck", "cause.txt", "configuration.ron"], "run {run}");
        // The checkpoint continues to the same failure.
        let from = format!("{}/before_failure.lwck", folder(*run));
        lab.resume(&from, &format!("again_{run}"), &[]).code(1).tells(&["`Blow.state.x` became"]);
        lab.linkwork(&["check", &format!("{}/configuration.ron", folder(*run))]).code(0);
    }
    for run in &refused {
        assert_eq!(names(&lab.path(&folder(*run))), ["cause.txt"]);
        let text = std::fs::read_to_string(lab.path(&folder(*run)).join("cause.txt")).unwrap();
        assert!(text.contains("Blow.k=\"a lot\""), "{text}");
    }
    for run in &fine {
        assert!(!lab.path(&folder(*run)).exists());
    }
    let page = std::fs::read_to_string(lab.path("out/report.html")).unwrap();
    assert!(page.contains("Failures by cause"));
    // The repeated run fails at the same state.
    let run = failed[0].to_string();
    let said = lab.linkwork(&["campaign", "c.ron", "--out", "out", "--run", &run]).code(1);
    assert!(said.out.contains("the same last state as in the campaign"), "{said:?}");
}

/// Returns the runs and how they ended, from the journal.
fn column_of_journal(lab: &Lab) -> Vec<(u64, String)> {
    let text = std::fs::read_to_string(lab.path("out/journal")).unwrap();
    let mut found: Vec<(u64, String)> = text
        .lines()
        .skip(1)
        .map(|l| serde_json::from_str::<serde_json::Value>(&l[9..]).unwrap())
        .map(|v| (v["run"].as_u64().unwrap(), v["ended"].as_str().unwrap().to_string()))
        .collect();
    found.sort_unstable();
    found
}

#[test]
fn a_run_that_never_ends_is_ended() {
    let lab = lab();
    // The progress is measured by simulated time if the simulation does not limit it.
    lab.write(
        "endless.ron",
        &edited(&[
            ("    until: \"1 s\",\n", "    stop_when: \"Never.y\",\n"),
            ("\"Source\": (", "\"Never\": (model: \"basics.comparator\", params: { \"threshold\": 1e9 }), \"Source\": ("),
            ("wires: [", "wires: [\"Source.y -> Never.a\", \"Gain.y -> Never.b\", "),
        ]),
    );
    let file = |limits: &str| {
        format!(
            "Campaign(simulation: \"endless.ron\", runs: 3, {limits} vary: {{ \"Gain.k\": Uniform(from: 1, to: 2) }})"
        )
    };
    let model = lab.linkwork(&["check", "endless.ron"]);
    assert_eq!(model.code, 0, "{}", model.err);
    lab.write("c.ron", &file(""));
    lab.linkwork(&["campaign", "c.ron", "--out", "none"])
        .code(2)
        .tells(&["might never end", "limits: (time:"]);
    lab.write("c.ron", &file("limits: (time: \"0.5 s\"),"));
    lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    assert!(column_of_journal(&lab).iter().all(|(_, ended)| ended == "time_limit"));
    assert_eq!(numbers(&lab, "out", "time [s]"), [0.5; 3]);
    std::fs::remove_dir_all(lab.path("out")).unwrap();
    // The limit is the wall time.
    lab.write("c.ron", &file("limits: (time: \"1e7 s\", wall: \"200 ms\"),"));
    lab.linkwork(&["campaign", "c.ron", "--out", "out", "--threads", "3"]).code(1);
    assert!(column_of_journal(&lab).iter().all(|(_, ended)| ended == "wall_limit"));
    let left = names(&lab.path("out/failures/run_0"));
    assert_eq!(left, ["cause.txt", "configuration.ron", "interrupted.lwck"]);
}

#[test]
fn what_has_changed_is_noticed() {
    let lab = lab();
    lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    let other = "the journal `out/journal` belongs to another campaign";
    lab.write("c.ron", &FILE.replace("0.2)", "0.3)"));
    lab.linkwork(&["campaign", "c.ron", "--out", "out"])
        .code(2)
        .tells(&[other, "choose another folder"]);
    lab.write("c.ron", FILE);
    lab.write("sim.ron", &edited(&[("60 deg", "61 deg")]));
    lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(2).tells(&[other]);
    lab.linkwork(&["campaign", "c.ron", "--out", "out", "--run", "3"]).code(2).tells(&[other]);
    // The contents of the report and the order of the file do not change a run.
    lab.write("sim.ron", BASE);
    let line = "        \"Friction.damping\": Uniform(from: 0.01, to: 0.2),\n";
    let moved = FILE
        .replace(line, "")
        .replace("    },\n    correlate", &format!("{line}    }},\n    correlate"));
    assert_ne!(moved, FILE);
    lab.write("c.ron", &moved.replace("unknown friction", "another word"));
    lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    // The journal gets one wrong byte.
    let path = lab.path("out/journal");
    let mut bytes = std::fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 4;
    std::fs::write(&path, bytes).unwrap();
    // Only the run of that line is lost, and it is repeated.
    let again = lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    let again = again.tells(&["the checksum is wrong", "this run is repeated"]);
    assert!(again.out.contains("59 runs have ended already"), "{}", again.out);
}

#[test]
fn bad_files_are_refused_with_place_fact_and_remedy() {
    let lab = lab();
    let refused = |edits: &[(&str, &str)], wanted: &[&str]| {
        let text = edits.iter().fold(FILE.to_string(), |t, (from, to)| {
            assert!(t.contains(from), "`{from}`");
            t.replacen(from, to, 1)
        });
        lab.write("bad.ron", &text);
        let said = lab.linkwork(&["campaign", "bad.ron", "--out", "out"]).code(2).tells(wanted);
        assert!(said.err.contains("help: "), "no remedy: {}", said.err);
        assert!(!lab.path("out").exists(), "it wrote something");
    };
    refused(
        &[("Uniform(from: 0.01", "Uniform(from: 0.3")],
        &["bad.ron:8:", "runs from 0.3 to 0.2"],
    );
    refused(&[("deviation: \"50 g\"", "deviation: \"0 g\"")], &["bad.ron:9:", "deviation 0"]);
    refused(&[("\"50 g\"", "\"50 m\"")], &["`deviation` is in m, `mean` in kg"]);
    refused(&[("to: -0.7", "to: -1.4")], &["bad.ron:10:", "runs from -1.3 to -1.4"]);
    refused(&[("from: -1.3, to: -0.7", "from: 1, to: 2")], &["is empty: the normal distribution"]);
    refused(&[("weights: [1, 1, 2]", "weights: [1, 1]")], &["`weights` must be 3 numbers"]);
    refused(&[("of: [1, 2, 5], weights: [1, 1, 2]", "of: []")], &["values to choose from"]);
    refused(
        &[("[[1, -0.8], [-0.8, 1]]", "[[1, -1.8], [-1.8, 1]]")],
        &["bad.ron:13:", "entry (1, 2) is -1.8"],
    );
    refused(&[("[-0.8, 1]", "[-0.7, 1]")], &["symmetric"]);
    refused(&[("[[1, -0.8], [-0.8, 1]]", "[[1]]")], &["1 rows", "2 names"]);
    let three = "of: [\"bob.mass\", \"bob.com[2]\", \"Friction.damping\"], matrix: [[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]]";
    let two = "of: [\"bob.mass\", \"bob.com[2]\"], matrix: [[1, -0.8], [-0.8, 1]]";
    refused(&[(two, three)], &["not positive semi-definite", "row 3"]);
    refused(
        &[("of: [\"bob.mass\"", "of: [\"bob.mess\"")],
        &["`bob.mess` is not a sampled value", "did you mean `bob.mass`"],
    );
    refused(&[("of: [\"bob.mass\"", "of: [\"Gain.k\"")], &["`Gain.k` is a Choice"]);
    refused(
        &[("Uniform(", "Unifrom(")],
        &["bad.ron:8:", "there is no distribution `Unifrom`", "`Uniform`"],
    );
    refused(
        &[("Friction.damping", "Friction.dumping")],
        &["bad.ron:8:", "has no such parameter", "damping"],
    );
    refused(&[("\"Gain.k\"", "\"Gian.k\"")], &["bad.ron:11:", "`Gian.k` matches nothing", "Gain"]);
    refused(&[("runs: 60", "runs: 0")], &["bad.ron:4:", "`runs` is 0"]);
    refused(&[("runs: 60", "runs: 60, sampling: Sobel")], &["no sampling `Sobel`", "Sobol"]);
    refused(&[("runs: 60", "runs: 70000, sampling: Sobol")], &["65536 runs", "LatinHypercube"]);
    refused(&[("runs: 60", "rums: 60")], &["has no field `rums`", "lacks `runs`"]);
    refused(&[("\"sim.ron\"", "\"sum.ron\"")], &["there is no simulation"]);
    refused(
        &[("\"Friction.damping\": Uniform(from: 0.01, to: 0.2)", "\"Friction.damping\": 0.1")],
        &["does not contain a distribution", "`set`"],
    );
    refused(&[("\"until\": \"0.2 s\"", "\"seed\": 3")], &["noise: Own"]);
    refused(
        &[("(\"bob.mass\", \"largest speed\")", "(\"largest speed\", \"smallest\")")],
        &["`smallest` is neither a metric nor a sampled parameter"],
    );
    refused(&[("    correlate", "    limits: (wall: \"-1 s\"),\n    correlate")], &["`wall`"]);
    let kept = "of: [\"bob.*\"], every: \"0.02 s\"";
    refused(&[(kept, "every: \"1 s\"")], &["bad.ron:14:", "`retain` lacks `of`"]);
    refused(&[(kept, "of: [\"bob.*\"]")], &["`retain` lacks `every`"]);
    refused(&[(kept, "of: [\"bib.*\"], every: \"1 s\"")], &["bad.ron:14:", "`retain`", "`bib.*`"]);
    refused(&[(kept, "of: [], every: \"1 s\"")], &["`retain`: `of` is []"]);
    refused(&[(kept, "of: [\"bob.*\"], every: \"5 Hz\"")], &["`every` is"]);
    let drawn = "\"Gain.k\": Choice(of: [1, 2, 5], weights: [1, 1, 2])";
    refused(
        &[(drawn, "\"step\": Choice(of: [\"1 ms\", \"2 ms\"])")],
        &["bad.ron:11:", "`step` is sampled"],
    );
    refused(
        &[(kept, "of: [\"bob.*\"], every: \"1 ms\""), ("0.2 s", "24 h")],
        &["bad.ron:14:", "20000000 numbers"],
    );
    lab.write("bad.ron", "Campaign(simulation: \"sim.ron\", runs: 5, noise: Same)");
    lab.linkwork(&["campaign", "bad.ron"]).code(2).tells(&["all runs would be identical"]);
    lab.write("bad.ron", "Simulation()");
    lab.linkwork(&["campaign", "bad.ron"]).code(2).tells(&["bad.ron:1:1", "Campaign"]);
    lab.linkwork(&["campaign", "none.ron"]).code(2).tells(&["cannot be read"]);
    lab.linkwork(&["campaign", "c.ron", "--threads", "0"]).code(2).tells(&["--threads"]);
}

/// A history has the same rows as the log of the same run, and the bands are the percentiles of the histories.
#[test]
fn what_runs_keep_is_what_their_logs_say() {
    let lab = lab();
    lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    lab.linkwork(&["campaign", "c.ron", "--out", "out", "--run", "17", "--log"]).code(0);
    let log = linkwork_record::read_log(&lab.path("out/run_17/run.mcap")).unwrap();
    let numbers = |run: u64, title: &str| {
        let path = lab.path(&format!("out/histories/run_{run}.parquet"));
        linkwork_record::parquet_numbers(&path, title).unwrap()
    };
    let times = numbers(17, "time [s]");
    assert_eq!(times.len(), 11, "{times:?}");
    let angles = numbers(17, "bob.angle [rad]");
    let logged = &log["bob.angle"];
    for (t, angle) in times.iter().zip(&angles) {
        let at = logged.t.iter().position(|x| (x - t).abs() < 1e-9);
        let at = at.unwrap_or_else(|| panic!("the log has no row at {t} s"));
        assert_eq!(logged.y[at].to_bits(), angle.to_bits(), "at {t} s");
    }
    let text = std::fs::read_to_string(lab.path("out/bands.csv")).unwrap();
    let last = text.lines().rfind(|l| l.starts_with("bob.angle,")).unwrap();
    let cells: Vec<f64> = last.split(',').skip(2).map(|c| c.parse().unwrap()).collect();
    let mut ends: Vec<f64> =
        (0..60).map(|k| *numbers(k, "bob.angle [rad]").last().unwrap()).collect();
    ends.sort_by(f64::total_cmp);
    assert_eq!(cells[..3], [0.2, 60.0, ends[0]]);
    assert_eq!((cells[5], cells[8]), ((ends[29] + ends[30]) / 2.0, ends[59]));
    let page = std::fs::read_to_string(lab.path("out/report.html")).unwrap();
    assert!(page.contains("Over time") && page.contains("bob.angle [rad]"));
    // Drawn numbers are plotted against metrics and against each other, with their units.
    assert!(page.contains("largest speed against bob.mass") && page.contains("bob.mass [kg]"));
    assert!(page.contains("Gain.k against bob.com[2]") && !page.contains("class=\"ring\""));
}

#[test]
fn every_way_of_sampling_makes_a_campaign() {
    let lab = lab();
    for how in ["Random", "LatinHypercube", "Sobol"] {
        let file = FILE.replace("runs: 60", &format!("runs: 16, sampling: {how}"));
        lab.write("c.ron", &file);
        lab.linkwork(&["campaign", "c.ron", "--out", how]).code(0);
        let mut cells: Vec<usize> = numbers(&lab, how, "draw:Friction.damping")
            .iter()
            .map(|x| ((x - 0.01) / 0.19 * 16.0) as usize)
            .collect();
        cells.sort_unstable();
        let each_once = cells.into_iter().eq(0..16);
        assert_eq!(each_once, how != "Random", "{how}");
    }
}

/// Returns the first runs of a campaign of the repository, as `c.ron`.
pub fn first_runs(lab: &Lab, folder: &str, name: &str, runs: usize) {
    let folder = root().join("sims").join(folder);
    let text = std::fs::read_to_string(folder.join(name)).unwrap();
    let sim = folder.join("sim.ron").display().to_string();
    let few = text.replace("runs: 1000", &format!("runs: {runs}"));
    let few = few.replace("\"sim.ron\"", &format!("{sim:?}"));
    assert!(few != text && few.contains(&format!("runs: {runs},")));
    lab.write(name, &few);
}

/// Varied parts exist in some phases and not in others.
#[test]
fn runs_of_the_footprint_come_down_near_the_target_and_differ() {
    let lab = Lab::new();
    first_runs(&lab, "mars_edl", "footprint.ron", 3);
    let said = lab.linkwork(&["campaign", "footprint.ron", "--out", "out"]).code(0);
    assert!(said.out.contains("3 stop_when"), "{}", said.out);
    let (east, north) = (
        numbers(&lab, "out", "east of the target [m]"),
        numbers(&lab, "out", "north of the target [m]"),
    );
    for (x, y) in east.iter().zip(&north) {
        assert!(x.hypot(*y) < 6e3, "{x} {y}");
    }
    assert!((east[0] - east[1]).abs() > 1.0 && (east[1] - east[2]).abs() > 1.0, "{east:?}");
    // A name that does not exist in any phase is rejected, with the message of a phase that has its part.
    let text = std::fs::read_to_string(lab.path("footprint.ron")).unwrap();
    lab.write("footprint.ron", &text.replace("Aero.area", "Aero.aera"));
    lab.linkwork(&["campaign", "footprint.ron", "--out", "no"])
        .code(2)
        .tells(&["override `Aero.aera` matches nothing", "did you mean `area`"]);
}

#[test]
fn the_campaign_that_ships_is_right() {
    let lab = Lab::new();
    first_runs(&lab, "ballistic_entry", "dispersions.ron", 24);
    lab.linkwork(&["campaign", "dispersions.ron", "--out", "out"]).code(0);
    let page = std::fs::read_to_string(lab.path("out/report.html")).unwrap();
    assert!(page.matches("<svg").count() >= 4 * 3 + 2 + 2 && page.contains("class=\"ring\""));
    assert!(!page.contains("http") && !page.contains("<script"), "the page needs something else");
    let heating = numbers(&lab, "out", "peak heating [W/cm^2]");
    let least = heating.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(heating.iter().any(|h| *h > 1.02 * least), "nothing varies");
    assert!(Path::new(&lab.path("out/results.parquet")).exists());
}

#[test]
fn a_folder_in_place_of_a_campaign_is_told_which_it_has() {
    let lab = Lab::new();
    let folder = common::sim("mars_edl");
    let said = lab.linkwork(&["campaign", &folder]).code(2);
    let said = said.tells(&["cannot be read", "which begins with `Campaign(`, here `"]);
    assert!(said.err.contains("footprint.ron`"), "{}", said.err);
    assert!(!said.err.contains("sim.ron"), "{}", said.err);
    lab.write("empty/notes.txt", "nothing");
    let said = lab.linkwork(&["campaign", "empty"]).code(2);
    assert!(!said.err.contains("here `"), "{}", said.err);
}

/// The start time of each phase is a column, exact for each run, and a variable for metrics: a weight that falls 1 m reaches the ground after √(2
/// m/g).
#[test]
fn times_of_phases_are_columns_and_metrics() {
    let lab = Lab::new();
    lab.write(
        "drop.ron",
        r#"Simulation(
    bodies: { "weight": (parent: "world", hinge: Slider([0, 0, 1]), mass: 1, inertia: Sphere(0.1)) },
    parts: { "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -10] }) },
    step: "1 ms", integrator: "dormand_prince_54", until: "0.6 s",
    start: "high",
    phases: { "high": (to: { "low": "weight.displacement < -1 m" }), "low": () },
    metrics: { "low from": (of: "Phases.low", take: "last", unit: "s") },
)"#,
    );
    lab.write(
        "c.ron",
        r#"Campaign(simulation: "drop.ron", runs: 8, seed: 3, vary: { "Gravity.acceleration": [0, 0, Uniform(from: -12, to: -4)] })"#,
    );
    lab.linkwork(&["campaign", "c.ron", "--out", "out"]).code(0);
    let g = numbers(&lab, "out", "draw:Gravity.acceleration[2]");
    let (began, metric) =
        (column(&lab, "out", "phase:low [s]"), column(&lab, "out", "low from [s]"));
    assert_eq!(began, metric);
    assert_eq!(numbers(&lab, "out", "phase:high [s]"), [0.0; 8]);
    let mut late = 0;
    for (g, began) in g.iter().zip(&began) {
        let want = (2.0 / -g).sqrt();
        match began.parse::<f64>() {
            Ok(t) if !t.is_nan() => assert!((t - want).abs() < 1e-9, "{g}: {t} for {want}"),
            _ => {
                assert!(want > 0.6, "{g}: {began}");
                late += 1;
            }
        }
    }
    assert!((1..8).contains(&late), "{late}: the draws hold both cases");
}

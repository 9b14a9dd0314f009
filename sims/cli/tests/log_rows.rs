//! Rows of a log around events and on change: equal to those of the full log bit for bit, also after interruptions; and reproduced, compared,
//! exported and viewed like those of any log.
use crate::common;
use common::{Lab, Said};
use linkwork_record::{End, Series, read_log, read_log_contents};
use std::collections::BTreeMap;

type Rows = BTreeMap<String, Series>;

/// A ball that falls from 1 m at 9.80665 m/s² and bounces with restitution 0.8.
fn ball(log: &str) -> String {
    format!(
        r#"Simulation(
    parts: {{ "Ball": (model: "basics.bouncing_ball", params: {{ "height": "1 m", "restitution": 0.8, "gravity": 9.80665 }}) }},
    step: "1 ms", integrator: "dormand_prince_54", until: "2 s",
    log: {log},
)"#
    )
}

const ALL: &str = r#"[(channels: ["Ball.**"])]"#;
const NEAR: &str = r#"[(channels: ["Ball.**"], around: (when: "Ball.height < 1 cm", before: "20 ms", after: "30 ms"))]"#;

/// Returns the log of a run of `text`.
fn run(lab: &Lab, name: &str, text: &str, more: &[&str]) -> Rows {
    lab.write(&format!("{name}.ron"), text);
    lab.run(&format!("{name}.ron"), name, more).code(0);
    read_log(&lab.path(name).join("run.mcap")).unwrap()
}

/// Returns the rows of a log that `keep` selects by index and time.
fn picked(all: &Rows, keep: impl Fn(usize, f64) -> bool) -> Rows {
    let one = |s: &Series| {
        let kept = |k: &usize| keep(*k, s.t[*k]);
        let rows: Vec<usize> = (0..s.t.len()).filter(kept).collect();
        let of = |v: &[f64]| rows.iter().map(|k| v[*k]).collect();
        Series { t: of(&s.t), y: of(&s.y), unit: s.unit.clone() }
    };
    all.iter().map(|(name, s)| (name.clone(), one(s))).collect()
}

/// Asserts that two logs have the same rows, bit for bit; names the first difference.
#[track_caller]
fn same(a: &Rows, b: &Rows, what: &str) {
    assert!(a.keys().eq(b.keys()), "{what}: {:?} against {:?}", a.keys(), b.keys());
    for (name, x) in a {
        let y = &b[name];
        let row = |s: &Series, k: usize| {
            let (t, y) = (s.t.get(k)?, s.y.get(k)?);
            Some((t.to_bits(), y.to_bits()))
        };
        let apart = (0..x.t.len().max(y.t.len())).find(|&k| row(x, k) != row(y, k));
        if let Some(k) = apart {
            let told = |s: &Series| (s.t.get(k).copied(), s.y.get(k).copied());
            panic!("{what}: `{name}`: row {k} is {:?} against {:?}", told(x), told(y));
        }
    }
}

/// Returns the ticks of 1 ms at which the ball falls below 1 cm according to the full log.
fn events(all: &Rows) -> Vec<i64> {
    let low: Vec<bool> = all["Ball.height"].y.iter().map(|h| *h < 0.01).collect();
    (0..low.len()).filter(|&k| low[k] && (k == 0 || !low[k - 1])).map(|k| k as i64).collect()
}

fn verified(lab: &Lab, out: &str) -> Said {
    let said = lab.linkwork(&["replay", &format!("{out}/run.mcap"), "--verify"]).code(0);
    assert!(said.out.starts_with("verified: "), "{}", said.out);
    said
}

#[test]
fn windows_have_exactly_the_rows_of_the_full_log() {
    let lab = Lab::new();
    let all = run(&lab, "all", &ball(ALL), &[]);
    let near = run(&lab, "near", &ball(NEAR), &[]);
    let events = events(&all);
    // The ball passes 1 cm for the first time after √(2 · 0.99 / g).
    let first = (2.0_f64 * 0.99 / 9.80665).sqrt();
    assert_eq!(events[0], (first * 1e3).ceil() as i64);
    assert!(events.len() > 2, "{events:?}");
    let inside = |k: usize, _: f64| events.iter().any(|e| (-20..=30).contains(&(k as i64 - e)));
    same(&near, &picked(&all, inside), "near");
    assert!(near["Ball.height"].t.len() < all["Ball.height"].t.len() / 4);
    // At another rate the windows have the rows of this rate, also around events between two rows.
    let slow = NEAR.replace("around", "rate: \"7 ms\", around");
    let slow = run(&lab, "slow", &ball(&slow), &[]);
    let inside = |k: usize, t: f64| k.is_multiple_of(7) && inside(k, t);
    same(&slow, &picked(&all, inside), "slow");
    // Overlapping windows are merged.
    let wide = NEAR.replace("20 ms", "300 ms").replace("30 ms", "200 ms");
    let wide = run(&lab, "wide", &ball(&wide), &[]);
    let inside = |k: usize, _: f64| events.iter().any(|e| (-300..=200).contains(&(k as i64 - e)));
    let expected = picked(&all, inside);
    assert!(expected["Ball.height"].t.windows(2).all(|w| w[0] < w[1]));
    same(&wide, &expected, "wide");
    for out in ["near", "slow", "wide"] {
        verified(&lab, out);
        let same = ["diff", "all/run.mcap", &format!("{out}/run.mcap"), "--common"];
        lab.linkwork(&same).code(0);
        lab.linkwork(&["diff", "all/run.mcap", &format!("{out}/run.mcap")]).code(1);
    }
    // A condition that is true at the start counts as an event at the start. The last window ends with the run.
    let edges = r#"[(channels: ["Ball.height"], around: (when: "time < 0.5 s or time > 1.99 s", before: "5 ms", after: "50 ms"))]"#;
    let edges = run(&lab, "edges", &ball(edges), &[]);
    let inside = |k: usize, _: f64| k <= 50 || k >= 1986;
    let height =
        |rows: &Rows| BTreeMap::from([("Ball.height".to_string(), rows["Ball.height"].clone())]);
    same(&height(&edges), &height(&picked(&all, inside)), "edges");
}

#[test]
fn on_change_a_row_is_written_when_a_value_is_not_that_of_the_last() {
    let lab = Lab::new();
    let all = run(&lab, "all", &ball(ALL), &[]);
    let rule = r#"[(channels: ["Ball.impacts", "Ball.last_impact"], on_change: true)]"#;
    let few = run(&lab, "few", &ball(rule), &[]);
    let (impacts, last) = (&all["Ball.impacts"].y, &all["Ball.last_impact"].y);
    let changes = |k: usize, _: f64| {
        let other = |y: &[f64]| k == 0 || y[k].to_bits() != y[k - 1].to_bits();
        other(impacts) || other(last)
    };
    let mut expected = picked(&all, changes);
    expected.retain(|name, _| few.contains_key(name));
    same(&few, &expected, "few");
    assert_eq!(few["Ball.impacts"].y[..3], [0.0, 1.0, 2.0]);
    verified(&lab, "few");
    // The first row of a window with `on_change` is written when it differs from the last row of the window
    // before.
    let both = r#"[(channels: ["Ball.impacts"], on_change: true, around: (when: "Ball.height < 1 cm", before: "20 ms", after: "30 ms"))]"#;
    let both = run(&lab, "both", &ball(both), &[]);
    assert_eq!(both["Ball.impacts"].y[..3], [0.0, 1.0, 2.0]);
    verified(&lab, "both");
}

/// An interrupted and resumed run has the same rows as an uninterrupted one, wherever it is interrupted: during the time before an event, in a
/// window, or between two windows.
#[test]
fn a_run_that_is_cut_has_the_rows_of_a_straight_one() {
    let lab = Lab::new();
    let rules = r#"[
        (channels: ["Ball.**"], around: (when: "Ball.height < 1 cm", before: "20 ms", after: "30 ms")),
        (channels: ["Ball.impacts"], on_change: true),
        (channels: ["Ball.height"], rate: "50 ms"),
        (channels: ["Ball.speed"], rate: "3 ms", on_change: true, around: (when: "Ball.height < 5 cm", before: "0.3 s")),
    ]"#;
    let text = ball(rules);
    let straight = run(&lab, "straight", &text, &[]);
    let first = events(&run(&lab, "all", &ball(ALL), &[]))[0];
    for cut in [first - 15, first - 1, first, first + 1, first + 29, first + 31, first + 90, 7] {
        let name = format!("cut{cut}");
        lab.write(&format!("{name}.ron"), &text);
        let until = format!("{cut} ms");
        let every = ["--until", &until, "--checkpoint-every", &until];
        lab.run(&format!("{name}.ron"), &name, &every).code(0);
        let saved = common::names(&lab.path(&name)).into_iter().find(|f| f.ends_with(".lwck"));
        let rest = format!("rest{cut}");
        lab.resume(&format!("{name}/{}", saved.unwrap()), &rest, &["--until", "2 s"]).code(0);
        let mut both = read_log(&lab.path(&name).join("run.mcap")).unwrap();
        for (name, s) in read_log(&lab.path(&rest).join("run.mcap")).unwrap() {
            let one = both.entry(name).or_default();
            one.unit = s.unit;
            let mut rows: Vec<(f64, f64)> = one.t.drain(..).zip(one.y.drain(..)).collect();
            rows.extend(s.t.iter().copied().zip(s.y.iter().copied()));
            rows.sort_by(|a, b| a.0.total_cmp(&b.0));
            // At the cut both logs have a row at the same instant, each by another rule: one copy
            // is removed.
            rows.dedup_by(|b, a| a.0 == b.0 && a.1.to_bits() == b.1.to_bits());
            (one.t, one.y) = rows.into_iter().unzip();
        }
        same(&both, &straight, &format!("cut at {cut} ms"));
        verified(&lab, &rest);
        assert_eq!(lab.hash(&rest), lab.hash("straight"));
    }
}

/// The log of a killed process may end anywhere: it contains the first rows of each variable.
#[test]
fn a_log_that_is_cut_off_is_read_and_verified() {
    let lab = Lab::new();
    // The log has enough numbers for several chunks.
    let text = common::BASE.replace("until: \"1 s\"", "until: \"60 s\"").replace(
        "rate: \"100 Hz\"",
        "around: (when: \"bob.angle > 0 rad\", before: \"0.2 s\", after: \"0.3 s\")",
    );
    let whole = run(&lab, "whole", &text, &[]);
    let bytes = std::fs::read(lab.path("whole/run.mcap")).unwrap();
    let mut some = 0;
    for part in 1..8 {
        let cut = &bytes[..bytes.len() * part / 8];
        std::fs::write(lab.path("cut.mcap"), cut).unwrap();
        let log = read_log_contents(&lab.path("cut.mcap")).unwrap();
        assert!(matches!(log.end, End::Cut { .. }));
        for (name, s) in &log.series {
            assert_eq!(s.y[..], whole[name].y[..s.y.len()], "{name}");
        }
        if !log.series.is_empty() {
            some += 1;
            lab.linkwork(&["replay", "cut.mcap", "--verify"]).code(0);
        }
    }
    assert!(some > 2, "{some}");
}

#[test]
fn rows_written_late_stand_in_their_place_in_a_table_and_a_recording() {
    let lab = Lab::new();
    // The log has a row every 10 ms, and every millisecond around events: some instants appear
    // twice.
    let rules =
        format!("[(channels: [\"Ball.**\"], rate: \"10 ms\"), {}]", &NEAR[1..NEAR.len() - 1]);
    let rows = run(&lab, "both", &ball(&rules), &[]);
    let all = run(&lab, "all", &ball(ALL), &[]);
    let events = events(&all);
    let inside = |k: usize, _: f64| {
        k.is_multiple_of(10) || events.iter().any(|e| (-20..=30).contains(&(k as i64 - e)))
    };
    same(&rows, &picked(&all, inside), "rows");
    let said = lab.linkwork(&["export", "both/run.mcap", "--parquet", "both.parquet"]).code(0);
    assert!(said.out.contains(&format!("{} ", rows["Ball.height"].t.len())), "{}", said.out);
    let t = linkwork_record::parquet_numbers(&lab.path("both.parquet"), "time [s]").unwrap();
    assert_eq!(t, rows["Ball.height"].t);
    verified(&lab, "both");
}

/// A condition on a variable that only some phases have is an event when a phase begins in which it is true.
#[test]
fn events_of_phases_whose_variables_come_and_go() {
    let lab = Lab::new();
    let text = std::fs::read_to_string(common::sim("staging/sim.ron")).unwrap();
    let from = text.find("\n    log: ").unwrap();
    let to = from + 1 + text[from + 1..].find('\n').unwrap();
    let with = |log: &str| format!("{}\n    log: {log},{}", &text[..from], &text[to..]);
    let all = run(&lab, "all", &with(r#"[(channels: ["**"])]"#), &[]);
    let rule = r#"[(channels: ["**"], around: (when: "Spring1.force > 1 N or Spring2.force > 1 N", before: "0.1 s", after: "0.2 s"))]"#;
    let near = run(&lab, "near", &with(rule), &[]);
    let starts = |name: &str| all[name].y.iter().position(|y| *y > 1.0).unwrap() as i64;
    let events = [starts("Spring1.force"), starts("Spring2.force")];
    assert!(events[0] > 400 && events[1] > events[0] + 100, "{events:?}");
    let inside = |k: usize, _: f64| events.iter().any(|e| (-10..=20).contains(&(k as i64 - e)));
    same(&near, &picked(&all, inside), "near");
    verified(&lab, "near");
}

/// A fork is a separate run: earlier rows are in the log of the original run.
#[test]
fn a_fork_begins_its_own_log() {
    let lab = Lab::new();
    lab.write("near.ron", &ball(NEAR));
    lab.run("near.ron", "near", &["--until", "0.44 s", "--checkpoint-every", "0.44 s"]).code(0);
    let fork = ["fork", "near/checkpoint_0.44.lwck", "--set", "Ball.restitution=0.5"];
    let more = ["--out", "forked", "--until", "1 s", "--save-rrd", "off"];
    lab.linkwork(&[&fork[..], &more].concat()).code(0);
    let rows = read_log(&lab.path("forked/run.mcap")).unwrap();
    assert!(rows["Ball.height"].t[0] > 0.44, "{}", rows["Ball.height"].t[0]);
    verified(&lab, "forked");
}

#[test]
fn what_cannot_be_meant_is_refused_and_what_does_not_happen_is_told() {
    let lab = Lab::new();
    let said = |around: &str, wanted: &[&str]| {
        let log = format!("[(channels: [\"Ball.**\"], around: ({around}))]");
        lab.write("bad.ron", &ball(&log));
        lab.run("bad.ron", "bad", &[]).code(2).tells(&[wanted, &["help: ", "bad.ron:4"]].concat());
        assert!(!lab.path("bad").exists(), "something was written");
    };
    said("when: \"Ball.hight < 1 cm\"", &["there is no variable `Ball.hight`", "Ball.height"]);
    said("when: \"Ball.height < 1 s\"", &["different quantities"]);
    said("when: \"Ball.height\"", &["a test is missing"]);
    said("when: \"1 < 2\"", &["its value never changes"]);
    said("before: \"1 s\"", &["`when`"]);
    said("when: \"Ball.height < 1 cm\", befor: \"1 s\"", &["`befor`", "before"]);
    said("when: \"Ball.height < 1 cm\", before: \"-1 s\"", &["before"]);
    said(
        "when: \"Ball.height < 1 cm\", before: \"1 h\"",
        &["would be kept in memory", "the limit is 16 MiB", "use a shorter `before`"],
    );
    lab.write("bad.ron", &ball(r#"[(channels: ["Ball.**"], on_change: "yes")]"#));
    lab.run("bad.ron", "bad", &[]).code(2).tells(&["on_change", "help: "]);
    // The log has no rows if the event does not occur, and a message says this.
    let never = NEAR.replace("< 1 cm", "> 2 m");
    lab.write("never.ron", &ball(&never));
    let told = lab.run("never.ron", "never", &[]).code(0);
    told.tells(&["warning: the log does not have samples around `Ball.height > 2 m`"]);
}

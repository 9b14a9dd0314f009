//! Nanoseconds per call compared with Pinocchio, in one run.
//!
//! `LINKWORK_PINOCCHIO_BENCH=path cargo bench -p linkwork-dynamics [-- words]`: the path is the program that `tests/benches/peers/install.sh` builds;
//! words select mechanisms by part of their name; `--markdown` also prints the tables of the README. Without the path only our own times are printed.
//! Each number is the best of 15 repetitions over 64 random states. Both sides run the same loop, including poses or kinematics.
#![allow(non_snake_case)]

#[path = "../tests/support/mod.rs"]
mod support;

mod algorithms;
mod mechanisms;

use algorithms::{Run, STATES};
use linkwork_dynamics::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

const REPEATS: usize = 15;
/// Duration of one repetition, s.
const SLICE: f64 = 0.01;

/// Algorithms, with their target relative to the other library, and the target for a state of a batch.
const TARGETS: [(&str, f64); 10] = [
    ("kinematics", 0.6),
    ("inverse", 0.65),
    ("forward", 0.55),
    ("mass_matrix", 0.75),
    ("inverse_mass", 0.75),
    ("jacobian", 0.75),
    ("centroidal", 0.75),
    ("d_inverse", 0.5),
    ("d_forward", 0.5),
    ("compliance", 0.6),
];
const BATCH: f64 = 0.12;

/// One result: mechanism, algorithm, nanoseconds for a single state and for a state of a batch, and those of the other library.
struct Cell {
    mechanism: &'static str,
    key: &'static str,
    target: f64,
    ns: f64,
    batch: f64,
    peer: Option<f64>,
}

#[derive(Default)]
struct Times(BTreeMap<&'static str, f64>);

impl Run for Times {
    fn run(&mut self, key: &'static str, call: impl FnMut(usize)) {
        self.0.insert(key, best_ns(call));
    }
}

/// Returns nanoseconds per call, with one state per call.
fn ours(tree: &Tree) -> BTreeMap<&'static str, f64> {
    let mut times = Times::default();
    algorithms::ours(tree, &mut times);
    times.0
}

/// Returns nanoseconds per state, with one batch per call.
fn batch<L: Lane>(tree: &Tree) -> BTreeMap<&'static str, f64> {
    let mut times = Times::default();
    algorithms::batch::<L>(tree, &mut times);
    times.0.into_iter().map(|(k, x)| (k, x / L::WIDTH as f64)).collect()
}

fn main() {
    let peer = std::env::var_os("LINKWORK_PINOCCHIO_BENCH").map(PathBuf::from);
    if peer.is_none() {
        println!("LINKWORK_PINOCCHIO_BENCH is not set: no peer (tests/benches/peers/install.sh)");
    }
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    println!(
        "{:<10} {:<13} {:>9} {:>9} {:>6} {:>6} {:>9} {:>9} {:>6} {:>6}",
        "mechanism",
        "algorithm",
        "peer ns",
        "f64 ns",
        "ratio",
        "target",
        "x4 ns/st",
        "x8 ns/st",
        "batch",
        "target"
    );
    let mut cells = Vec::new();
    for (name, mbs) in mechanisms::all() {
        if words.is_empty() || words.iter().any(|w| name.contains(w.as_str())) {
            table(name, &Tree::new(&mbs), peer.as_deref(), &mut cells);
        }
    }
    if peer.is_some() {
        report_misses(&cells);
    }
    if std::env::args().any(|a| a == "--markdown") {
        grid(&cells, "one state, ns (× peer)", |c| c.ns, |c| c.target);
        grid(&cells, "state of a batch, ns (× peer)", |c| c.batch, |_| BATCH);
    }
}

fn report_misses(cells: &[Cell]) {
    let mut missed = Vec::new();
    for c in cells {
        let Some(p) = c.peer else { continue };
        for (what, x, target) in [("", c.ns, c.target), (", batch", c.batch, BATCH)] {
            if x > target * p {
                let ratio = x / p;
                missed.push(format!(
                    "{} {}{what}: {ratio:.2} × (target {target})",
                    c.mechanism, c.key
                ));
            }
        }
    }
    println!("cells above their target: {} of {}", missed.len(), 2 * cells.len());
    missed.iter().for_each(|m| println!("  {m}"));
}

/// Prints a Markdown table with a row for each algorithm and a column for each mechanism; numbers that miss their target are bold.
fn grid(cells: &[Cell], title: &str, ns: impl Fn(&Cell) -> f64, target: impl Fn(&Cell) -> f64) {
    let mut names: Vec<&str> = cells.iter().map(|c| c.mechanism).collect();
    names.dedup();
    println!("\n| {title} | target | {} |", names.join(" | "));
    println!("|---|---|{}", "---|".repeat(names.len()));
    for (key, _) in TARGETS {
        let row: Vec<&Cell> = cells.iter().filter(|c| c.key == key).collect();
        let Some(first) = row.first() else { continue };
        let cell = |name: &&str| {
            let Some(c) = row.iter().find(|c| c.mechanism == *name) else { return "–".into() };
            let (x, ratio) = (ns(c), c.peer.map(|p| ns(c) / p));
            let ratio_text = ratio.map_or("–".into(), |r| format!("{r:.2}"));
            let text = format!("{x:.0} ({ratio_text})");
            if ratio.is_some_and(|r| r > target(c)) { format!("**{text}**") } else { text }
        };
        let row_text: Vec<String> = names.iter().map(cell).collect();
        println!("| {key} | {:.2} | {} |", target(first), row_text.join(" | "));
    }
}

fn table(name: &'static str, tree: &Tree, peer: Option<&Path>, cells: &mut Vec<Cell>) {
    // Measure ours before and after the other library, because the clock speed of a busy machine drifts.
    let before = ours(tree);
    let theirs = peer.map(|p| run_peer(p, tree)).unwrap_or_default();
    let after = ours(tree);
    let (four, eight) = (batch::<f64x4>(tree), batch::<f64x8>(tree));
    for (key, target) in TARGETS {
        let Some(ns) = before.get(key).map(|x| x.min(after[key])) else { continue };
        let peer = theirs.get(key).copied();
        let per_state = four[key].min(eight[key]);
        let ratio = |x: f64| peer.map_or("-".into(), |p| format!("{:.2}", x / p));
        println!(
            "{name:<10} {key:<13} {:>9} {ns:>9.0} {:>6} {target:>6.2} {:>9.0} {:>9.0} {:>6} {BATCH:>6.2}",
            peer.map_or("-".into(), |p| format!("{p:.0}")),
            ratio(ns),
            four[key],
            eight[key],
            ratio(per_state)
        );
        cells.push(Cell { mechanism: name, key, target, ns, batch: per_state, peer });
    }
}

#[allow(clippy::disallowed_methods)] // A benchmark reads the clock.
fn best_ns(mut call: impl FnMut(usize)) -> f64 {
    let mut pass = |loops: usize| {
        let start = std::time::Instant::now();
        for _ in 0..loops {
            for i in 0..STATES {
                call(i);
            }
        }
        start.elapsed().as_secs_f64() / (loops * STATES) as f64
    };
    let loops = (SLICE / (pass(1) * STATES as f64)).max(1.0) as usize;
    1e9 * (0..REPEATS).map(|_| pass(loops)).fold(f64::INFINITY, f64::min)
}

/// Runs the other library on the same mechanism, which is written to a temporary file.
fn run_peer(program: &Path, tree: &Tree) -> BTreeMap<String, f64> {
    let path = std::env::temp_dir().join(format!("linkwork_peer_{}.txt", std::process::id()));
    std::fs::write(&path, algorithms::joints(tree.multibody())).expect("temporary file");
    let out = std::process::Command::new(program).arg(&path).output().expect("peer runs");
    std::fs::remove_file(&path).ok();
    assert!(out.status.success(), "peer failed: {}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).expect("text");
    let found: BTreeMap<String, f64> = text
        .lines()
        .filter_map(|l| l.split_once(' '))
        .map(|(k, x)| (k.to_owned(), x.parse().expect("number")))
        .collect();
    assert_eq!(found["dof"], tree.nv() as f64, "the peer read another mechanism");
    found
}

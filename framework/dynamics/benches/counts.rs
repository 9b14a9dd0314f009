//! Instructions per call beside Pinocchio's, counted by callgrind: the same on a loaded machine.
//!
//! `LINKWORK_PINOCCHIO_BENCH_V3=path cargo bench --profile counts --bench counts
//! -p linkwork-dynamics [-- words]`; the path is the program that `tests/benches/peers/install.sh`
//! builds for x86-64-v3, the instructions that Linkwork is built for too; words choose mechanisms
//! by part of their name. Needs `valgrind`.
//!
//! This program runs itself and the peer under callgrind. Both call each algorithm [`CALLS`] times
//! to warm up, then as often inside a function `counted`; callgrind collects only in there, and
//! dumps its sum after each. The loop and the indirect call in it, some ten instructions, are
//! counted on both sides. Where the peer has variants, the one with the fewest instructions counts.
//!
//! An instruction is not a nanosecond: wide vector instructions, divisions and cache misses take
//! longer than others. So the counts stand beside the times, and take no part in the targets.
//!
//! valgrind 3.19 does not know the short form of `vmovq` between two registers. The profile `counts`
//! keeps it out of what sets mechanisms up; should a kernel contain it, the mechanism's row says so.
#![allow(non_snake_case)]

#[path = "../tests/support/mod.rs"]
mod support;

mod algorithms;
#[allow(dead_code)]
mod mechanisms;

use algorithms::{Run, STATES};
use linkwork_dynamics::*;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Calls that are counted.
const CALLS: usize = 16;

/// The word that makes this program the one that is counted; then come mechanism and width.
const CHILD: &str = "--child";

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    match words.first().map(String::as_str) {
        Some(CHILD) => child(&words[1], &words[2]),
        _ => parent(&words),
    }
}

/// Prints the names of the algorithms in the order of their counts.
struct Counted;

impl Run for Counted {
    fn run(&mut self, key: &'static str, mut call: impl FnMut(usize)) {
        count(&mut call);
        println!("{key}");
    }
}

/// Warms up and lets itself be counted; callgrind dumps what it collected at each return.
#[inline(never)]
fn count(call: &mut dyn FnMut(usize)) {
    (0..CALLS).for_each(|i| call(i % STATES));
    counted(call);
}

/// What callgrind collects.
#[inline(never)]
fn counted(call: &mut dyn FnMut(usize)) {
    (0..CALLS).for_each(|i| call(i % STATES));
}

fn child(mechanism: &str, width: &str) {
    let found = mechanisms::all().into_iter().find(|(name, _)| *name == mechanism);
    let tree = Tree::new(&found.expect("a mechanism of the table").1);
    match width {
        "1" => algorithms::ours(&tree, &mut Counted),
        "4" => algorithms::batch::<f64x4>(&tree, &mut Counted),
        _ => algorithms::batch::<f64x8>(&tree, &mut Counted),
    }
}

fn parent(words: &[String]) {
    if let Err(e) = Command::new("valgrind").arg("--version").output() {
        println!("skipped: valgrind does not run ({e})");
        return;
    }
    let peer = std::env::var_os("LINKWORK_PINOCCHIO_BENCH_V3").map(PathBuf::from);
    if peer.is_none() {
        println!(
            "LINKWORK_PINOCCHIO_BENCH_V3 is not set: no peer (tests/benches/peers/install.sh)"
        );
    }
    let own = std::env::current_exe().expect("this program");
    println!(
        "{:<10} {:<13} {:>10} {:>10} {:>6} {:>10} {:>10} {:>6}",
        "mechanism", "algorithm", "peer", "f64", "ratio", "x4 / state", "x8 / state", "batch"
    );
    for (name, mbs) in mechanisms::all() {
        if !words.is_empty() && !words.iter().any(|w| name.contains(w.as_str())) {
            continue;
        }
        let ours = |width| callgrind(&own, &[CHILD, name, width]);
        let theirs = peer.as_deref().map(|p| count_peer(p, &algorithms::joints(&mbs)));
        table(name, ours("1"), [(4.0, ours("4")), (8.0, ours("8"))], theirs);
    }
}

/// Counts by algorithm, or why there are none.
type Counts = Result<BTreeMap<String, f64>, String>;

fn table(name: &str, ours: Counts, batches: [(f64, Counts); 2], theirs: Option<Counts>) {
    let ours = match ours {
        Ok(counts) => counts,
        Err(why) => return println!("{name:<10} {why}"),
    };
    for why in batches.iter().filter_map(|(_, c)| c.as_ref().err()) {
        println!("{name:<10} batch: {why}");
    }
    if let Some(Err(why)) = &theirs {
        println!("{name:<10} peer: {why}");
    }
    let of = |counts: &Counts, key: &str| counts.as_ref().ok().and_then(|c| c.get(key).copied());
    let number = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.0}"));
    for (key, count) in &ours {
        let peer = theirs.as_ref().and_then(|t| of(t, key));
        let [four, eight] = [0, 1].map(|i| of(&batches[i].1, key).map(|x| x / batches[i].0));
        let ratio =
            |x: Option<f64>| x.zip(peer).map_or("-".into(), |(x, peer)| format!("{:.2}", x / peer));
        let best = four.into_iter().chain(eight).reduce(f64::min);
        println!(
            "{name:<10} {key:<13} {:>10} {:>10} {:>6} {:>10} {:>10} {:>6}",
            number(peer),
            number(Some(*count)),
            ratio(Some(*count)),
            number(four),
            number(eight),
            ratio(best)
        );
    }
}

fn count_peer(program: &Path, joints: &str) -> Counts {
    let path = temporary("joints");
    std::fs::write(&path, joints).expect("temporary file");
    let calls = CALLS.to_string();
    let counts = callgrind(program, &[path.to_str().expect("path"), "--count", &calls]);
    std::fs::remove_file(&path).ok();
    counts
}

fn temporary(what: &str) -> PathBuf {
    std::env::temp_dir().join(format!("linkwork_counts_{}_{what}.txt", std::process::id()))
}

/// Runs a program under callgrind: instructions per call for each name that it prints, the fewest
/// where a name comes again.
fn callgrind(program: &Path, args: &[&str]) -> Counts {
    let path = temporary("callgrind");
    let out = Command::new("valgrind")
        .args(["--tool=callgrind", "--combine-dumps=yes"])
        .args(["--toggle-collect=counts::counted", "--dump-after=counts::count"])
        .args(["--toggle-collect=counted(*", "--dump-after=Measure::count(*"])
        .arg(format!("--callgrind-out-file={}", path.display()))
        .arg(program)
        .args(args)
        .output()
        .expect("valgrind runs");
    let found = std::fs::read_to_string(&path);
    std::fs::remove_file(&path).ok();
    let errors = String::from_utf8_lossy(&out.stderr);
    if !out.status.success() {
        let why = errors.lines().find(|l| l.contains("Unrecognised") || l.contains("unhandled"));
        return Err(why.unwrap_or("valgrind failed").to_owned());
    }
    let found = found.map_err(|e| e.to_string())?;
    let sums: Vec<f64> = found
        .lines()
        .filter_map(|l| l.strip_prefix("summary: "))
        .map(|x| x.trim().parse().expect("number"))
        .collect();
    let text = String::from_utf8_lossy(&out.stdout);
    let names = text.lines().filter(|l| !l.starts_with("dof "));
    let names: Vec<&str> = names.map(|l| l.split(' ').next().unwrap_or(l)).collect();
    if sums.len() < names.len() || sums[..names.len()].iter().any(|x| *x <= 0.0) {
        return Err(format!("{} sums for {} names: {sums:?}", sums.len(), names.len()));
    }
    let mut counts = BTreeMap::new();
    for (name, sum) in names.iter().zip(sums) {
        let count = sum / CALLS as f64;
        let best = counts.entry((*name).to_owned()).or_insert(count);
        *best = count.min(*best);
    }
    Ok(counts)
}

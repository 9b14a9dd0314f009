//! Instructions per call compared with Pinocchio, counted by callgrind. The counts do not depend on the load of the machine.
//!
//! `LINKWORK_PINOCCHIO_BENCH_V3=path cargo bench --profile counts --bench counts
//! -p linkwork-dynamics [-- words]`; the path is the program that `tests/benches/peers/install.sh`
//! builds for x86-64-v3, the instruction set for which Linkwork is also built; words select mechanisms
//! by part of their name. Needs `valgrind`.
//!
//! This program runs itself and the other library under callgrind, as `callgrind/mod.rs` describes. If the other library has several variants of an
//! algorithm, the one with the fewest instructions is used.
//!
//! Instruction counts are not proportional to time: wide vector instructions, divisions and cache misses take longer than other instructions.
//! Therefore the counts are printed next to the times and are not part of the targets.
#![allow(non_snake_case)]

#[path = "../tests/support/mod.rs"]
mod support;

mod algorithms;
mod callgrind;
mod mechanisms;

use algorithms::Run;
use callgrind::{CALLS, CHILD, Counts, callgrind};
use linkwork_dynamics::*;
use std::path::{Path, PathBuf};

/// The counted child process.
struct Counted;

impl Run for Counted {
    fn run(&mut self, key: &'static str, mut call: impl FnMut(usize)) {
        callgrind::run(key, &mut call);
    }
}

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    match words.first().map(String::as_str) {
        Some(CHILD) => child(&words[1], &words[2]),
        _ => parent(&words),
    }
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
    if !callgrind::is_here() {
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
    let path = callgrind::temporary("joints");
    std::fs::write(&path, joints).expect("temporary file");
    let calls = CALLS.to_string();
    let counts = callgrind(program, &[path.to_str().expect("path"), "--count", &calls]);
    std::fs::remove_file(&path).ok();
    counts
}

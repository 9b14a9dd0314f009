//! Compares heaps of 10 to 1000 boxes and chains of 10 to 10 000 links with MuJoCo in one run. Prints time per step and per contact or link, so that
//! growth is visible.
//!
//! `tests/benches/scale [heaps|chains [numbers]]`, or `LINKWORK_MUJOCO_STEPS=path cargo bench -p linkwork-solvers --bench scale [-- heaps 50 200]`
//!
//! The path is the program that `tests/benches/peers/install.sh --mujoco` builds. Both sides have the same boxes, friction (0.8), start and step (2
//! ms). Times are the best of three runs of Linkwork and five of MuJoCo, over fall and rest. `half` is the second half alone, `worst` the longest
//! single step, `sinks` the largest penetration in the second half. Chains fall freely. MuJoCo has chains of up to 300 links, because its
//! reader rejects XML that is nested as deeply as a chain of 1000 links.
#![allow(non_snake_case)]

#[path = "../../dynamics/tests/support/mod.rs"]
mod support;

#[allow(dead_code)]
#[path = "../../dynamics/benches/mechanisms/mod.rs"]
mod mechanisms;
mod mjcf;
#[allow(dead_code)]
mod scenes;
#[allow(dead_code)]
mod steps;

use linkwork_solvers::ContactSettings;
use std::path::{Path, PathBuf};
use steps::{ours, run_peer};

const RUNS: usize = 3;
const NUMBERS: [u32; 7] = [10, 20, 30, 50, 100, 200, 1000];
const LINKS: [u32; 5] = [10, 100, 300, 1000, 10_000];
const PEER_LINKS: u32 = 300;

fn main() {
    let peer = std::env::var_os("LINKWORK_MUJOCO_STEPS").map(PathBuf::from);
    if peer.is_none() {
        println!("LINKWORK_MUJOCO_STEPS is not set: no peer (tests/benches/peers/install.sh)");
    }
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let given: Vec<u32> = words.iter().filter_map(|a| a.parse().ok()).collect();
    let named = |name: &str| words.iter().any(|w| w == name);
    if named("heaps") || !named("chains") {
        heaps(peer.as_deref(), if given.is_empty() { &NUMBERS } else { &given });
    }
    if named("chains") || !named("heaps") && given.is_empty() {
        chains(peer.as_deref(), if given.is_empty() { &LINKS } else { &given });
    }
}

fn chains(peer: Option<&Path>, numbers: &[u32]) {
    println!(
        "{:>6} {:>11} {:>11} {:>6} {:>9} {:>9}",
        "links", "step µs", "MuJoCo µs", "ratio", "ns each", "MuJoCo ns"
    );
    for number in numbers {
        let (scene, n) = (scenes::falling_chain(*number as usize), f64::from(*number));
        let theirs = peer.filter(|_| *number <= PEER_LINKS).map(|p| run_peer(p, &scene));
        let f = ours(&scene, &ContactSettings::default(), RUNS);
        println!(
            "{number:>6} {:>11.1} {:>11} {:>6} {:>9.1} {:>9}",
            1e6 / f.rate,
            theirs.map_or(String::new(), |t| format!("{:.1}", 1e6 / t.rate)),
            theirs.map_or(String::new(), |t| format!("{:.2}", t.rate / f.rate)),
            1e9 / f.rate / n,
            theirs.map_or(String::new(), |t| format!("{:.1}", 1e9 / t.rate / n)),
        );
    }
}

fn heaps(peer: Option<&Path>, numbers: &[u32]) {
    println!(
        "{:>6} {:>11} {:>11} {:>6} {:>9} {:>8} {:>11} {:>10} {:>10} {:>10} {:>7} {:>7} {:>6}",
        "boxes",
        "step µs",
        "MuJoCo µs",
        "ratio",
        "contacts",
        "µs each",
        "half µs",
        "worst µs",
        "sinks m",
        "MuJoCo m",
        "sweeps",
        "Newton",
        "short"
    );
    for number in numbers {
        let scene = scenes::heap(*number);
        let theirs = peer.map(|p| run_peer(p, &scene));
        let f = ours(&scene, &ContactSettings::default(), RUNS);
        let (step, steps) = (1e6 / f.rate, scene.steps as f64);
        println!(
            "{number:>6} {step:>11.1} {:>11} {:>6} {:>9.1} {:>8.3} {:>11.1} {:>10.0} {:>10.1e} {:>10} {:>7.1} {:>7} {:>6}",
            theirs.map_or(String::new(), |t| format!("{:.1}", 1e6 / t.rate)),
            theirs.map_or(String::new(), |t| format!("{:.2}", t.rate / f.rate)),
            f.contacts,
            1e6 * f.half / f.contacts,
            1e6 * f.half,
            1e6 * f.worst,
            f.penetration,
            theirs.map_or(String::new(), |t| format!("{:.1e}", t.penetration)),
            f.iterations as f64 / steps,
            f.newton,
            f.short,
        );
    }
}

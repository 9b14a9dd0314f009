//! Compares heaps of 10 to 1000 boxes with MuJoCo in one run. Prints time per step and per contact, so that growth is visible.
//!
//! `tests/benches/scale [numbers]`, or `LINKWORK_MUJOCO_STEPS=path cargo bench -p linkwork-solvers --bench scale [-- 50 200]`
//!
//! The path is the program that `tests/benches/peers/install.sh --mujoco` builds. Both sides have the same boxes, friction (0.8), start and step (2
//! ms). Times are the best of three runs of Linkwork and five of MuJoCo, over fall and rest. `half` is the second half alone, `worst` the longest
//! single step, `sinks` the largest penetration in the second half.
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
use std::path::PathBuf;
use steps::{ours, run_peer};

const RUNS: usize = 3;
const NUMBERS: [u32; 7] = [10, 20, 30, 50, 100, 200, 1000];

fn main() {
    let peer = std::env::var_os("LINKWORK_MUJOCO_STEPS").map(PathBuf::from);
    if peer.is_none() {
        println!("LINKWORK_MUJOCO_STEPS is not set: no peer (tests/benches/peers/install.sh)");
    }
    let given: Vec<u32> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let numbers = if given.is_empty() { &NUMBERS[..] } else { &given };
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
        let theirs = peer.as_deref().map(|p| run_peer(p, &scene));
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

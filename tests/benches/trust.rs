//! What saving the rover of `sims/rover_traverse` costs: a checkpoint taken, written without waiting for the disk,
//! read and taken back.
//!
//! `cargo bench -p linkwork-tests --bench trust`; a watcher on the socket: tests/benches/watcher.
#![allow(missing_docs, clippy::disallowed_methods, clippy::unwrap_used)]
use linkwork_runtime::{Checkpoint, Seconds, Simulation};
use std::hint::black_box;
use std::time::Instant;

#[path = "../common/mod.rs"]
mod common;

/// Milliseconds: median and maximum of 200 calls.
fn measure(what: &str, mut call: impl FnMut()) {
    let mut all: Vec<f64> = (0..200)
        .map(|_| {
            let start = Instant::now();
            call();
            start.elapsed().as_secs_f64() * 1e3
        })
        .collect();
    all.sort_by(f64::total_cmp);
    println!("{what:48} {:7.3} ms, at most {:7.3}", all[all.len() / 2], all[all.len() - 1]);
}

fn main() -> Result<(), String> {
    let (mut sim, configuration) =
        common::traverse_resolved(&["Rover.contact=mobility.wheel_soil"])?;
    sim.run_until(Seconds { num: 10, den: 1 }).map_err(|e| e.to_string())?;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("c.lwck");
    let take = |sim: &Simulation| sim.checkpoint(&configuration).unwrap();
    let bytes = take(&sim).to_bytes().unwrap();
    println!("a checkpoint of the rover on soil with ruts: {} kB", bytes.len() / 1000);
    measure("taken and written without sync (goal 1 ms)", || {
        std::fs::write(&file, take(&sim).to_bytes().unwrap()).unwrap();
    });
    measure("taken and written with sync, under its name", || take(&sim).write(&file).unwrap());
    let hash = sim.hash();
    measure("read and taken back (goal 1 ms)", || {
        sim.restore(black_box(&Checkpoint::read(&file).unwrap())).unwrap();
    });
    assert_eq!(sim.hash(), hash);
    Ok(())
}

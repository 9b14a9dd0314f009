//! The rover of `sims/rover_traverse` without log and viewer: time per step, ratio to real time, and its profile.
//!
//! `cargo bench -p linkwork-tests --bench rover (-- seconds)`
#![allow(missing_docs, clippy::disallowed_methods)]
use linkwork_runtime::{Seconds, Simulation};
use std::time::Instant;

#[path = "../common/mod.rs"]
mod common;

/// Simulated seconds of one chunk; the best chunk counts, because the machine is shared.
const CHUNK: u64 = 2;

fn measure(name: &str, sim: &mut Simulation, until: u64) -> Result<(), String> {
    let (mut best, mut total) = (f64::INFINITY, 0.0);
    for k in 1..=until / CHUNK {
        let start = Instant::now();
        sim.run_until(Seconds { num: k * CHUNK, den: 1 }).map_err(|e| e.to_string())?;
        let took = start.elapsed().as_secs_f64();
        best = best.min(took);
        total += took;
    }
    let steps = CHUNK as f64 / sim.plan().step.seconds();
    println!(
        "{name}: best of {} chunks {:6.2} µs a step, {:5.1} x real time; mean {:6.2} µs, {:5.1} x",
        until / CHUNK,
        best / steps * 1e6,
        CHUNK as f64 / best,
        total / steps / (until / CHUNK) as f64 * 1e6,
        until as f64 / total,
    );
    Ok(())
}

fn main() -> Result<(), String> {
    let seconds = std::env::args().skip(1).find_map(|a| a.parse().ok()).unwrap_or(60);
    let only = std::env::args().find(|a| a == "rigid" || a == "soil");
    for (name, contact) in [("rigid", "mobility.wheel_rigid"), ("soil", "mobility.wheel_soil")] {
        if only.as_ref().is_some_and(|o| o != name) {
            continue;
        }
        let mut sim = common::traverse(&[&format!("Rover.contact={contact}")])?;
        measure(&format!("{name:5} wheels"), &mut sim, seconds)?;
    }
    Ok(())
}

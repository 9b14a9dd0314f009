//! `sims/sol`: a sol of a rover, with the figures of its page.
#![allow(clippy::unwrap_used)]
use linkwork_runtime::Simulation;

#[path = "../common/mod.rs"]
mod common;

fn get(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or_else(|e| panic!("{e}"))
}

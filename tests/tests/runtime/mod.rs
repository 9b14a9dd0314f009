//! Properties of every simulation: determinism, checkpoints, warnings, energy, allocation, repository rules.

mod allocation;
mod balance;
mod camera;
mod campaigns;
mod conditions;
mod corners;
mod determinism;
mod flows;
mod idle;
mod jumps;
mod linear;
mod many_machines;
mod masses;
mod metrics;
mod power;
mod prescribed;
mod rank;
mod sampled;
mod sharing;
mod splits;
mod springs;
mod tidy;
mod warnings;
mod wires;

//! An orbit around the Earth: a world, gravity of a point mass, an integrator with step size control. Compares the period and the
//! greatest distance with Kepler's laws.
//!
//!     cargo run --release -p linkwork --example orbit
//!
//! T = 2π √(a³/μ), r_max = a (1 + e).
use linkwork::components::environment::fields::PointMassGravity;
use linkwork::components::environment::world::{Centre, PlanetWorld};
use linkwork::prelude::*;
use std::error::Error;
use std::f64::consts::TAU;

const MU: f64 = 3.986_004_418e14; // m³/s², of the Earth
const AXIS: f64 = 8.0e6; // m, semi-major axis
const ECCENTRICITY: f64 = 0.1;

/// Returns the simulated period (s) and greatest distance (m).
pub fn simulated() -> Result<[f64; 2], Box<dyn Error>> {
    let mut orbit = Assembly::new();
    // Start at the pericentre, on the x axis.
    let start = AXIS * (1.0 - ECCENTRICITY);
    let speed = (MU * (2.0 / start - 1.0 / AXIS)).sqrt();
    let craft = Body::on("world").hinge(Hinge::free()).mass(500.0).inertia([100.0; 3]);
    orbit.body(
        "craft",
        craft.initial_position([start, 0.0, 0.0]).initial_velocity([0.0, speed, 0.0]),
    );
    orbit.part::<PlanetWorld>("world", |p| p.body(Centre::Earth).mu(MU));
    orbit.part::<PointMassGravity>("Gravity", |p| p);
    orbit.step(1.0).integrator(Integrator::Verner).accuracy(1e-12, 1e-9);

    let mut sim = orbit.simulation()?;
    let mut log = Recording::new(&sim, ["craft.position.*"], 1.0)?;
    log.run_until(&mut sim, "2 h")?;

    let (x, y) = (&log["craft.position.x"], &log["craft.position.y"]);
    let distance = x.iter().zip(y).map(|(x, y)| x.hypot(*y)).fold(0.0, f64::max);
    // Find the instant at which the orbit crosses the x axis upwards.
    let back = (1..y.len() - 1).find(|k| y[*k] < 0.0 && y[k + 1] >= 0.0).ok_or("no full orbit")?;
    let period = log.t()[back] + y[back] / (y[back] - y[back + 1]);
    Ok([period, distance])
}

/// Returns the period (s) and the greatest distance (m) by Kepler's laws.
pub fn kepler() -> [f64; 2] {
    [TAU * (AXIS.powi(3) / MU).sqrt(), AXIS * (1.0 + ECCENTRICITY)]
}

/// Prints both.
pub fn main() -> Result<(), Box<dyn Error>> {
    let ([period, distance], [period_0, distance_0]) = (simulated()?, kepler());
    println!("period: {period:.4} s simulated, {period_0:.4} s by Kepler");
    println!("greatest distance: {distance:.1} m simulated, {distance_0:.1} m by Kepler");
    Ok(())
}

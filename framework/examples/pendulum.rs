//! A pendulum with a large amplitude: builds it, records its angle, and compares its period with the closed form.
//!
//!     cargo run --release -p linkwork --example pendulum
//!
//! T = 2π √(J / m g l) / agm(1, cos(θ₀/2)), with J about the hinge and the arithmetic-geometric mean agm.
use linkwork::components::environment::fields::UniformGravity;
use linkwork::prelude::*;
use std::error::Error;
use std::f64::consts::TAU;

const MASS: f64 = 1.0; // kg
const LENGTH: f64 = 0.8; // m, from the hinge to the centre of mass
const INERTIA: f64 = 0.02; // kg m², about the centre of mass
const AMPLITUDE: f64 = 2.0; // rad
const GRAVITY: f64 = 9.81; // m/s²

/// Returns the simulated period (s).
pub fn simulated() -> Result<f64, Box<dyn Error>> {
    let mut pendulum = Assembly::new();
    let bob = Body::on("world")
        .hinge(Hinge::pin(Vec3::y()))
        .mass(MASS)
        .com([0.0, 0.0, -LENGTH])
        .inertia([INERTIA; 3])
        .initial_angle(AMPLITUDE);
    pendulum.body("bob", bob);
    pendulum.part::<UniformGravity>("Gravity", |p| p.acceleration([0.0, 0.0, -GRAVITY]));

    let mut sim = pendulum.simulation()?;
    let mut log = Recording::new(&sim, ["bob.angle"], 1e-3)?;
    log.run_until(&mut sim, 8.0)?;

    // Find the instants at which the angle decreases through zero.
    let (t, angle) = (log.t(), &log["bob.angle"]);
    let fall = |k: &usize| angle[*k] > 0.0 && angle[k + 1] <= 0.0;
    let zeros: Vec<f64> = (0..t.len() - 1)
        .filter(fall)
        .map(|k| t[k] + (t[k + 1] - t[k]) * angle[k] / (angle[k] - angle[k + 1]))
        .collect();
    Ok(zeros[1] - zeros[0])
}

/// Returns the period in closed form (s).
pub fn closed_form() -> f64 {
    let (mut a, mut b) = (1.0, (AMPLITUDE / 2.0).cos());
    for _ in 0..6 {
        (a, b) = ((a + b) / 2.0, f64::sqrt(a * b));
    }
    TAU * ((INERTIA + MASS * LENGTH * LENGTH) / (MASS * GRAVITY * LENGTH)).sqrt() / a
}

/// Prints both.
pub fn main() -> Result<(), Box<dyn Error>> {
    println!("period: {:.6} s simulated, {:.6} s in closed form", simulated()?, closed_form());
    Ok(())
}

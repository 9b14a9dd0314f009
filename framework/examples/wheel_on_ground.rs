//! A wheel spins, is put on the ground, and drives off with its carriage until it rolls. Compares the final speed with the balance of
//! angular momentum, which no friction law enters.
//!
//!     cargo run --release -p linkwork --example wheel_on_ground
//!
//! The ground's force acts on a line through the contact: J ω₀ = J ω + M r v about it, and v = r ω in the end.
use linkwork::components::environment::fields::UniformGravity;
use linkwork::components::environment::terrain::Flat;
use linkwork::components::mobility::wheel_rigid::WheelRigid;
use linkwork::prelude::*;
use std::error::Error;

const RADIUS: f64 = 0.25; // m
const SPIN: f64 = 20.0; // rad/s, at the start
const INERTIA: f64 = 0.5; // kg m², of the wheel about its axle
const MASSES: [f64; 3] = [5.0, 3.0, 12.0]; // kg: carriage, yoke, wheel

/// Returns the simulated speed (m/s) and slip after 5 s.
pub fn simulated() -> Result<[f64; 2], Box<dyn Error>> {
    let mut rig = Assembly::new();
    let body = |parent: &str, hinge: Hinge, mass: f64| {
        Body::on(parent).hinge(hinge).mass(mass).inertia([INERTIA; 3])
    };
    // The carriage moves along x, the yoke moves up and down in it, and the wheel rotates in the
    // yoke.
    let [carriage, yoke, wheel] = MASSES;
    let start = [0.0, 0.0, RADIUS];
    rig.body("carriage", body("world", Hinge::slider(Vec3::x()), carriage).at(start));
    rig.body("yoke", body("carriage", Hinge::slider(Vec3::z()), yoke));
    rig.body("wheel", body("yoke", Hinge::pin(Vec3::y()), wheel).initial_rate(SPIN));

    rig.part::<UniformGravity>("Gravity", |p| p.acceleration([0.0, 0.0, -9.81]));
    rig.part::<Flat>("Ground", |p| p.size(50.0));
    rig.part::<WheelRigid>("Contact", |p| {
        p.radius(RADIUS).width(0.1).friction(0.6).terrain("Ground")
    })
    .bind("hub", "node:wheel");
    rig.step(5e-4);

    let mut sim = rig.simulation()?;
    sim.run_until(5.0)?;
    Ok([sim.get("carriage.speed")?, sim.get("Contact.slip")?])
}

/// Returns the speed (m/s) at which the wheel rolls, by the balance of angular momentum.
pub fn balance() -> f64 {
    let mass: f64 = MASSES.iter().sum();
    INERTIA * SPIN * RADIUS / (INERTIA + mass * RADIUS * RADIUS)
}

/// Prints both.
pub fn main() -> Result<(), Box<dyn Error>> {
    let [speed, slip] = simulated()?;
    println!(
        "speed: {speed:.4} m/s simulated (slip {slip:.1e}), {:.4} m/s by the balance",
        balance()
    );
    Ok(())
}

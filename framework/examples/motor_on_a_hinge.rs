//! A DC motor with a gear spins up a flywheel: parts, a wire, a connector and a binding to a hinge. Compares the speed with the
//! closed form.
//!
//!     cargo run --release -p linkwork --example motor_on_a_hinge
//!
//! J ω̇ = n k (u − n k ω)/R, so ω = u/(n k) (1 − e^(−t/T)) with T = J R/(n k)².
use linkwork::components::actuators::dc_motor::DcMotor;
use linkwork::components::basics::sources::Constant;
use linkwork::components::power::supply::IdealSupply;
use linkwork::prelude::*;
use std::error::Error;

const INERTIA: f64 = 0.4; // kg m²
const RESISTANCE: f64 = 2.0; // ohm
const CONSTANT: f64 = 0.05; // N m/A
const GEAR: f64 = 20.0;
const VOLTS: f64 = 6.0; // V
const TIME: f64 = 0.5; // s

/// Returns the simulated speed after `TIME` (rad/s), and the current (A).
pub fn simulated() -> Result<[f64; 2], Box<dyn Error>> {
    let mut machine = Assembly::new();
    let flywheel = Body::on("world").hinge(Hinge::pin(Vec3::z())).mass(1.0).inertia([INERTIA; 3]);
    machine.body("flywheel", flywheel);

    machine.part::<IdealSupply>("Supply", |p| p.voltage(12.0));
    machine.part::<Constant>("Command", |p| p.value(VOLTS));
    machine
        .part::<DcMotor>("Motor", |p| p.resistance(RESISTANCE).torque_constant(CONSTANT).gear(GEAR))
        .bind("shaft", "hinge:flywheel");
    machine.wire("Command.y", "Motor.volts");
    machine.connect(["Motor.supply", "Supply.terminal"]);
    machine.set("gravity", "none");

    let mut sim = machine.simulation()?;
    sim.run_until(TIME)?;
    Ok([sim.get("flywheel.rate")?, sim.get("Motor.current")?])
}

/// Returns the speed (rad/s) and the current (A) in closed form.
pub fn closed_form() -> [f64; 2] {
    let constant = GEAR * CONSTANT;
    let rate =
        VOLTS / constant * (1.0 - (-TIME * constant * constant / (INERTIA * RESISTANCE)).exp());
    [rate, (VOLTS - constant * rate) / RESISTANCE]
}

/// Prints both.
pub fn main() -> Result<(), Box<dyn Error>> {
    let ([rate, current], [rate_0, current_0]) = (simulated()?, closed_form());
    println!("speed: {rate:.6} rad/s simulated, {rate_0:.6} rad/s in closed form");
    println!("current: {current:.6} A simulated, {current_0:.6} A in closed form");
    Ok(())
}

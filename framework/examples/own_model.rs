//! A model of your own: a torsion spring that acts on a hinge. Compares the period of a body on it with the closed form.
//!
//!     cargo run --release -p linkwork --example own_model
//!
//! T = 2π √(J/k).
use linkwork::model::prelude::*;
use linkwork::prelude::*;
use std::error::Error;
use std::f64::consts::TAU;
const INERTIA: f64 = 0.02; // kg m²
const STIFFNESS: f64 = 1.5; // N m/rad
/// Parameters. Their units, ranges and descriptions are checked and shown wherever the model is used.
#[derive(Params)]
struct SpringParams {
    /// Stiffness.
    #[param(unit = "N m/rad", range = 0.0..)]
    stiffness: f64,
}
#[derive(Ports)]
struct SpringIn {
    /// Angle and rate of the hinge that is bound to `shaft`.
    #[port(bind = "shaft")]
    shaft: HingeState,
}
#[derive(Ports)]
struct SpringOut {
    /// Torque on the same hinge.
    #[port(bind = "shaft")]
    torque: HingeTorque,
}
struct Spring {
    p: SpringParams,
}
/// A torsion spring on a hinge.
#[model("example.torsion_spring")]
impl Model for Spring {
    type Params = SpringParams;
    type FeedthroughInputs = SpringIn;
    type FeedthroughOutputs = SpringOut;
    fn feedthrough(&self, u: &SpringIn) -> SpringOut {
        SpringOut { torque: HingeTorque(-self.p.stiffness * u.shaft.angle) }
    }
}
/// Returns the angle after one period, started at 0.3 rad.
pub fn simulated() -> Result<f64, Box<dyn Error>> {
    let mut machine = Assembly::new();
    let disc = Body::on("world").hinge(Hinge::pin(Vec3::z())).mass(1.0).inertia([INERTIA; 3]);
    machine.body("disc", disc.initial_angle(0.3));
    machine.part::<Spring>("Spring", |p| p.stiffness(STIFFNESS)).bind("shaft", "hinge:disc");
    machine.set("gravity", "none");
    let mut sim = machine.simulation()?;
    sim.run_until(TAU * (INERTIA / STIFFNESS).sqrt())?;
    Ok(sim.get("disc.angle")?)
}

/// Prints it.
pub fn main() -> Result<(), Box<dyn Error>> {
    println!("angle after one period: {:.6} rad; it started at 0.3 rad", simulated()?);
    Ok(())
}

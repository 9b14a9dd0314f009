//! Inverse kinematics of an arm with two joints, with the robot model that autonomy software embeds. Compares the angles with the
//! closed form.
//!
//!     cargo run --release -p linkwork --example arm_inverse_kinematics
//!
//! The law of cosines gives cos q₂ = (d² − l₁² − l₂²)/(2 l₁ l₂) for a target at distance d.
use linkwork::embedded::{Effort, Frame, Goal, ModelSpec, PartSpec, Robot, RobotModel};
use linkwork::formats::Description;
use linkwork::plant::SpecExt;
use linkwork::prelude::*;
use std::error::Error;

const LENGTHS: [f64; 2] = [0.5, 0.3]; // m
const TARGET: [f64; 2] = [0.4, 0.35]; // m: x and y

/// Returns the angles (rad) that the search finds, and the distance that remains (m).
pub fn found() -> Result<([f64; 2], f64), Box<dyn Error>> {
    // The mechanism is built as in a simulation.
    let mut arm = Assembly::new();
    let link =
        |parent: &str| Body::on(parent).hinge(Hinge::pin(Vec3::z())).mass(1.0).inertia([0.01; 3]);
    arm.body("base", Body::on("world"));
    arm.body("upper", link("base"));
    arm.body("lower", link("upper").at([LENGTHS[0], 0.0, 0.0]));
    arm.body("tool", Body::on("lower").at([LENGTHS[1], 0.0, 0.0]));
    let loaded = arm.load()?;
    let mechanism = loaded.spec.mechanism().ok_or("no bodies")?;

    let mut spec = ModelSpec::from_description(&Description::from(&*mechanism.multibody))?;
    spec.parts.push(PartSpec::chain("arm", "base", "tool"));
    let model = RobotModel::new(&spec)?;
    let chain = model.part("arm").ok_or("no arm")?;
    let mut robot = Robot::new(&model);

    let mut q = [0.1, 0.5];
    let goal = Goal::position(Vec3::new(TARGET[0], TARGET[1], 0.0));
    robot.inverse_kinematics(chain, &goal, Frame::World, &Effort::kinematics(500), &mut q)?;
    robot.set_q(&q)?;
    let tip = robot.tip_pose(chain)?.position;
    Ok((q, (tip.x - TARGET[0]).hypot(tip.y - TARGET[1])))
}

/// Returns the angles in closed form, with the elbow bent to the same side (rad).
pub fn closed_form() -> [f64; 2] {
    let ([a, b], [x, y]) = (LENGTHS, TARGET);
    let elbow = ((x * x + y * y - a * a - b * b) / (2.0 * a * b)).acos();
    [y.atan2(x) - (b * elbow.sin()).atan2(a + b * elbow.cos()), elbow]
}

/// Prints both.
pub fn main() -> Result<(), Box<dyn Error>> {
    let (([q1, q2], error), [p1, p2]) = (found()?, closed_form());
    println!("angles: {q1:.9}, {q2:.9} rad found, {p1:.9}, {p2:.9} rad in closed form");
    println!("distance that remains: {error:.1e} m");
    Ok(())
}

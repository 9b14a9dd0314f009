//! Component library of actuators: DC motors with gear, friction and brake; torque drives, rate and position servos; springs,
//! dampers, stops and differentials on hinges; drives of ball hinges and belts; general actuators and tendons as in MuJoCo;
//! gravity compensation; struts and bushings between bodies; followers that prescribe the motion of a hinge.
//!
//! A program adds the library with its catalogue; a file then uses a model by its name (`model: "actuators.dc_motor"`):
//! ```
//! let catalogue = linkwork_runtime::Catalogue::new([linkwork_actuators::catalogue()]);
//! assert!(catalogue.get("actuators.dc_motor").is_some());
//! ```

pub mod ball_drive;
pub mod belt;
pub mod bushing;
pub mod dc_motor;
pub mod followers;
pub mod friction;
pub mod general_actuator;
pub mod gravity_compensation;
pub mod hinges;
pub mod servo;
pub mod strut;
pub mod tendon;
mod transmission;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::model::<dc_motor::DcMotor>(),
        Entry::model::<followers::RateFollower>(),
        Entry::model::<followers::AngleFollower>(),
        Entry::model::<hinges::SpringDamper>(),
        Entry::model::<hinges::SoftStop>(),
        Entry::model::<strut::Strut>(),
        Entry::model::<bushing::Bushing>(),
        Entry::model::<hinges::Differential>(),
        Entry::model::<servo::RateServo>(),
        Entry::model::<servo::TorqueDrive>(),
        Entry::model::<servo::PositionServo>(),
        Entry::model::<ball_drive::BallDrive>(),
        Entry::model::<belt::Belt>(),
        Entry::sized::<general_actuator::GeneralActuator>(),
        Entry::sized::<tendon::Tendon>(),
        Entry::model::<gravity_compensation::GravityCompensation>(),
    ]
}

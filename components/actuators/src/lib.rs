//! Component library: actuators. Motors, servos and passive elements on hinges.

pub mod dc_motor;
pub mod friction;
pub mod hinges;
pub mod servo;

use linkwork_runtime::prelude::Entry;

/// The models of this library.
pub fn catalogue() -> Vec<Entry> {
    vec![
        Entry::model::<dc_motor::DcMotor>(),
        Entry::model::<hinges::SpringDamper>(),
        Entry::model::<hinges::SoftStop>(),
        Entry::model::<hinges::Differential>(),
        Entry::model::<servo::RateServo>(),
        Entry::model::<servo::PositionServo>(),
    ]
}

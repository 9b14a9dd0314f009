//! Thrusters, solid motors, tanks that blow down or feed each other, and propellant that sloshes.

pub mod blow_down;
pub mod feed;
pub mod feed_line;
pub mod held_thruster;
pub mod plume;
pub mod slosh;
pub mod sloshing;
pub mod solid_motor;
pub mod thruster;
pub mod vector_thrust;

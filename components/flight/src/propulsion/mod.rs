//! Thrusters, solid motors, tanks that blow down, and propellant that sloshes.

pub mod blow_down;
pub mod held_thruster;
pub mod slosh;
pub mod solid_motor;
pub mod thruster;
pub mod vector_thrust;

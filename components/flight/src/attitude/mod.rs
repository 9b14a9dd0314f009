//! What turns a spacecraft: wheels, control moment gyros, magnetic torquers.

pub mod control_moment_gyro;
pub mod magnetic;
pub mod reaction_wheel;

//! What turns a spacecraft: wheels, control moment gyros, magnetic torquers, gimballed engines.

pub mod bank_control;
pub mod control_moment_gyro;
pub mod magnetic;
pub mod reaction_wheel;
pub mod thrust_vector;

//! Component library: actuators.

//! Component library: sensors.

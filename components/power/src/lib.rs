//! Component library: power.

//! Component library: control.

//! Component library: environment.

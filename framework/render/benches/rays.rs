//! Rays a second on generated ground.
fn main() {}

//! Explicit Euler, order 1.
use crate::tableau::Explicit;

/// x₊ = x + h f(t, x), with linear interpolation.
pub const EULER: Explicit = Explicit {
    name: "euler",
    order: 1,
    error_order: 0,
    dense_order: 1,
    stages: 1,
    a: &[&[]],
    b: &[1.0],
    c: &[0.0],
    error: &[],
    first_same_as_last: false,
    dense: &[&[1.0]],
};

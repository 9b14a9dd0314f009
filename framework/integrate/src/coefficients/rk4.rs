//! The classical Runge–Kutta method of order 4 (Kutta 1901; Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, section II.1), with
//! cubic Hermite interpolation.
use super::interpolation::hermite;
use crate::tableau::Explicit;

/// Weights, and a stage at the end for the interpolant.
const B: [f64; 5] = [1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0, 0.0];
const DENSE: [[f64; 3]; 5] = hermite(B, 4);

/// The classical method. Dense output needs one more evaluation, at the end of the step.
pub const RK4: Explicit = Explicit {
    name: "rk4",
    order: 4,
    error_order: 0,
    dense_order: 3,
    stages: 4,
    a: &[&[], &[0.5], &[0.0, 0.5], &[0.0, 0.0, 1.0], &[B[0], B[1], B[2], B[3]]],
    b: &[B[0], B[1], B[2], B[3]],
    c: &[0.0, 0.5, 0.5, 1.0, 1.0],
    error: &[],
    first_same_as_last: false,
    dense: &[&DENSE[0], &DENSE[1], &DENSE[2], &DENSE[3], &DENSE[4]],
};

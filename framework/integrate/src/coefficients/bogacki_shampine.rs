//! Bogacki, Shampine: A 3(2) pair of Runge–Kutta formulas. Applied Mathematics Letters 2 (1989) 321–325.
use super::interpolation::hermite;
use crate::tableau::Explicit;

const B: [f64; 4] = [2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0, 0.0];
const DENSE: [[f64; 3]; 4] = hermite(B, 3);

/// Order 3 with an error estimate of order 2; the authors' interpolant is cubic Hermite.
pub const BOGACKI_SHAMPINE: Explicit = Explicit {
    name: "bogacki-shampine-32",
    order: 3,
    error_order: 2,
    dense_order: 3,
    stages: 4,
    a: &[&[], &[0.5], &[0.0, 0.75], &[B[0], B[1], B[2]]],
    b: &B,
    c: &[0.0, 0.5, 0.75, 1.0],
    error: &[B[0] - 7.0 / 24.0, B[1] - 0.25, B[2] - 1.0 / 3.0, -0.125],
    first_same_as_last: true,
    dense: &[&DENSE[0], &DENSE[1], &DENSE[2], &DENSE[3]],
};

//! Dormand, Prince: A family of embedded Runge–Kutta formulae. Journal of Computational and Applied
//! Mathematics 6 (1980) 19–26; continuous extension of order 4 by Shampine (1986) as in DOPRI5 of
//! Hairer, Nørsett, Wanner, Solving Ordinary Differential Equations I, section II.6.
use super::interpolation::quartic;
use crate::tableau::Explicit;

const B: [f64; 7] =
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0];

const BUBBLE: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

const DENSE: [[f64; 4]; 7] = quartic(B, BUBBLE);

/// Order 5 with an error estimate of order 4.
pub const DORMAND_PRINCE: Explicit = Explicit {
    name: "dormand-prince-54",
    order: 5,
    error_order: 4,
    dense_order: 4,
    stages: 7,
    a: &[
        &[],
        &[0.2],
        &[3.0 / 40.0, 9.0 / 40.0],
        &[44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0],
        &[19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0],
        &[9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0],
        &[B[0], B[1], B[2], B[3], B[4], B[5]],
    ],
    b: &B,
    c: &[0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0],
    error: &[
        71.0 / 57600.0,
        0.0,
        -71.0 / 16695.0,
        71.0 / 1920.0,
        -17253.0 / 339200.0,
        22.0 / 525.0,
        -1.0 / 40.0,
    ],
    first_same_as_last: true,
    dense: &[&DENSE[0], &[], &DENSE[2], &DENSE[3], &DENSE[4], &DENSE[5], &DENSE[6]],
};

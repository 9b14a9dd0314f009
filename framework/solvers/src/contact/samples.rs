//! One cone of each kind, and numbers from a seed, for the unit tests of this folder.

use super::problem::Cone;

/// Returns a number in [−1, 1).
pub(crate) fn number(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// One cone of each kind.
pub(crate) const CONES: [Cone; 5] = [
    Cone::Coulomb { friction: 0.6 },
    Cone::Spinning { friction: 0.4, spin: 0.3 },
    Cone::Dry { bound: 0.5 },
    Cone::Unilateral,
    Cone::Equality { rows: 3 },
];

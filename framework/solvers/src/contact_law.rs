//! Equations of compliant contact: normal forces of Hunt and Crossley, and friction of elasto-plastic bristles. Bodies, wheels and shaft friction
//! share these functions.
//! ```text
//! normal     f = k δᵖ (1 + d δ̇)₊                                        δ: depth, m
//! bristle    ż = v − c z,  c = α (v·ẑ)₊/max(|z|, z_max) + (|z| − z_max)₊/(|z| T)
//!            α = 0 below |z| = 0.9 z_max, 1 above z_max, a cubic between;  T = 10 ms
//! friction   F = −k_t z − d_t v, cut to the limit μ f;  z_max = μ f/k_t
//! ```
//! z (m, or rad on a shaft) is the deflection of the contact and v the slip velocity. Below nine tenths of its limit a bristle is elastic, so that a
//! parked vehicle does not creep. A bristle beyond its limit, because the load decreased, relaxes.
//! Source: Hunt and Crossley (1975); Dupont, Hayward, Armstrong and Altpeter (2002).

/// Fraction of the largest deflection up to which bristles are elastic.
pub const BREAKAWAY: f64 = 0.9;
/// Time constant with which bristles relax without contact, and beyond their limit, s.
pub const RELAX: f64 = 0.01;

/// Computes Hunt and Crossley's normal force (N) at a depth (m, positive) that grows by `closing` (m/s): stiffness k (N/mᵖ), exponent p, damping d
/// (s/m). The force is never attractive.
#[inline]
pub fn normal_force(stiffness: f64, exponent: f64, damping: f64, depth: f64, closing: f64) -> f64 {
    elastic(stiffness, exponent, depth) * (1.0 + damping * closing).max(0.0)
}

/// Computes the elastic part k δᵖ of the normal force, N.
#[inline]
pub fn elastic(stiffness: f64, exponent: f64, depth: f64) -> f64 {
    stiffness
        * match exponent {
            1.0 => depth,
            1.5 => depth * depth.sqrt(),
            p => depth.powf(p),
        }
}

/// Returns the sliding fraction α of the motion: 0 while a bristle of length `size` is elastic, 1 at its limit `longest`.
#[inline]
pub fn plastic_share(size: f64, longest: f64) -> f64 {
    let start = BREAKAWAY * longest;
    if size <= start {
        return 0.0;
    }
    if size >= longest {
        return 1.0;
    }
    let t = (size - start) / (longest - start);
    t * t * (3.0 - 2.0 * t)
}

/// Returns the relaxation rate c (1/s) of a bristle of length `size` with limit `longest`, which is deflected further at the rate `toward` (v·ẑ, per
/// second).
#[inline]
pub fn gives_way(size: f64, toward: f64, longest: f64) -> f64 {
    let mut out = 0.0;
    if toward > 0.0 {
        out = plastic_share(size, longest) * toward / size.max(longest).max(1e-300);
    }
    if size > longest {
        out += (size - longest) / (size * RELAX);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bristle_that_is_dragged_ends_at_its_limit_and_one_that_is_held_stays() {
        let longest = 1e-3;
        for v in [1e-3, 0.1, -0.5_f64] {
            // Slip by forty limit lengths. Within each limit length, the distance to the limit decays by a factor
            // of e.
            let (mut z, dt) = (0.0_f64, 1e-3 * longest / v.abs());
            for _ in 0..40_000 {
                z += dt * (v - gives_way(z.abs(), v * z.signum(), longest) * z);
            }
            assert!((z.abs() / longest - 1.0).abs() < 1e-9 && z * v > 0.0, "{v}: {z}");
        }
        // Below nine tenths of its limit the bristle is elastic: a cycle leaves no deflection.
        let z = 0.89 * longest;
        assert_eq!(gives_way(z, 1.0, longest), 0.0);
        // Motion back to zero is elastic at any deflection up to the limit.
        assert_eq!(gives_way(longest, -1.0, longest), 0.0);
    }

    #[test]
    fn what_is_too_long_relaxes_to_the_limit() {
        let (longest, mut z) = (1e-3, 5e-3);
        for _ in 0..10_000 {
            z -= 1e-5 * gives_way(z, 0.0, longest) * z;
        }
        assert!((z / longest - 1.0).abs() < 1e-3, "{z}");
        // The deflection decays to zero if the limit is zero.
        assert!((gives_way(1.0, 0.0, 0.0) - 1.0 / RELAX).abs() < 1e-12);
    }

    #[test]
    fn the_share_that_slides_is_smooth_and_rises() {
        let mut last = 0.0;
        for k in 0..=2000 {
            let share = plastic_share(f64::from(k) * 1e-3, 1.0);
            assert!((0.0..=0.016).contains(&(share - last)), "{k}: {share} after {last}");
            last = share;
        }
        assert_eq!(last, 1.0);
    }

    #[test]
    fn the_normal_force_has_its_powers_and_never_pulls() {
        for p in [1.0, 1.5, 2.2] {
            let ratio = elastic(2e5, p, 2e-3) / elastic(2e5, p, 1e-3);
            assert!((ratio / f64::powf(2.0, p) - 1.0).abs() < 1e-12, "{p}: {ratio}");
        }
        assert_eq!(normal_force(2e5, 1.0, 3.0, 1e-3, -1.0), 0.0);
        assert!((normal_force(2e5, 1.0, 3.0, 1e-3, 0.1) - 260.0).abs() < 1e-9);
    }
}

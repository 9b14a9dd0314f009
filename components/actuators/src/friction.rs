//! Dry friction of a shaft that holds exactly: an elasto-plastic bristle (Dupont et al. 2002).
//! ```text
//! ż = s ω − c(s ω) z, c by the law of bristles (`linkwork_solvers::contact_law`),   z_max = τ_max(sign z)/k
//! s = min(1, max(k |z|, τ_max(sign ω))/(d |ω|))
//! τ = −k z − d ω, cut to −τ_max(+) ≤ τ ≤ τ_max(−)
//! ```
//! Below 0.9 z_max the bristle is a spring, so a loaded shaft at rest does not creep. The limit may differ between forward
//! and backward motion, as the friction of a loaded gear does. Power is only taken: −τ ω − k z ż ≥ 0.
//!
//! The share s is below 1 only where the damping alone exceeds the limit, so the torque is at its limit for any deflection. There the deflection
//! follows its limit within d/k. If s were 1, the deflection would follow within z_max/|ω|, which is far shorter than a step if a gear carries little torque.
//! Each step would then deflect the bristle by h |ω| beyond its limit, and the energy balance would lack ½ k (h ω)².

use linkwork_solvers::contact_law::gives_way;

/// A bristle on a shaft.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShaftFriction {
    /// Stiffness of the bristle, N m/rad.
    pub stiffness: f64,
    /// Damping of the bristle, N m s/rad.
    pub damping: f64,
    /// Greatest torque against forward and against backward motion, N m, neither negative.
    pub limits: [f64; 2],
}

impl ShaftFriction {
    /// Torque on the shaft (N m) at the deflection `z` (rad) and the rate (rad/s).
    pub fn torque(&self, z: f64, rate: f64) -> f64 {
        let [forward, backward] = self.limits;
        if forward.is_nan() || backward.is_nan() {
            return f64::NAN;
        }
        (-self.stiffness * z - self.damping * rate).clamp(-forward, backward)
    }

    /// Rate of the deflection, rad/s.
    pub fn deflection_rate(&self, z: f64, rate: f64) -> f64 {
        let longest = self.limits[usize::from(z < 0.0)] / self.stiffness;
        let against = self.limits[usize::from(rate < 0.0)];
        let (held, damped) = ((self.stiffness * z.abs()).max(against), self.damping * rate.abs());
        let rate = if damped > held { rate * (held / damped) } else { rate };
        rate - gives_way(z.abs(), rate * z.signum(), longest) * z
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(load: f64, seconds: f64) -> (f64, f64) {
        let f = ShaftFriction { stiffness: 2000.0, damping: 20.0, limits: [10.0; 2] };
        let (mut angle, mut rate, mut z) = (0.0, 0.0, 0.0);
        let (inertia, dt) = (0.5, 1e-3);
        for _ in 0..(seconds / dt) as usize {
            let torque = f.torque(z, rate) + load;
            z += dt * f.deflection_rate(z, rate);
            rate += dt * torque / inertia;
            angle += dt * rate;
        }
        (angle, rate)
    }

    #[test]
    fn below_the_limit_it_holds_without_creep() {
        let (a, _) = run(8.0, 5.0);
        let (b, rate) = run(8.0, 50.0);
        // The step load overshoots the limit once, which leaves a small permanent deflection.
        assert!(a < 0.02 && (a - b).abs() < 1e-12 && rate.abs() < 1e-12, "{a} {b} {rate}");
    }

    #[test]
    fn each_direction_has_its_own_limit() {
        let f = ShaftFriction { stiffness: 2000.0, damping: 20.0, limits: [3.0, 7.0] };
        for (rate, want) in [(0.5, -3.0), (-0.5, 7.0)] {
            let mut z = 0.0;
            for _ in 0..2000 {
                z += 1e-4 * f.deflection_rate(z, rate);
            }
            assert!((f.torque(z, rate) - want).abs() < 1e-12, "{rate}: {}", f.torque(z, rate));
        }
    }

    #[test]
    fn power_is_only_taken() {
        let f = ShaftFriction { stiffness: 2000.0, damping: 20.0, limits: [3.0, 7.0] };
        for i in -60..=60 {
            for k in -40..=40 {
                let (z, rate) = (1e-4 * f64::from(i), 0.01 * f64::from(k));
                let lost = -f.torque(z, rate) * rate - f.stiffness * z * f.deflection_rate(z, rate);
                assert!(lost >= -1e-12, "z {z}, rate {rate}: {lost} W");
            }
        }
    }

    /// The limit of a rotating shaft falls and rises, as the friction of a gear does with its load. The deflection keeps
    /// to the limit although steps are long compared with z_max/|ω|, and the torque is the limit.
    #[test]
    fn a_fast_shaft_does_not_bend_the_bristle_beyond_its_limit() {
        let (dt, rate, mut z) = (1e-3, 6.0, 0.0);
        for k in 0..3000 {
            let limit = 1.0 + (5e-3 * f64::from(k)).sin();
            let f = ShaftFriction { stiffness: 2000.0, damping: 20.0, limits: [limit; 2] };
            assert!((f.torque(z, rate) + limit).abs() < 1e-12, "{k}: {}", f.torque(z, rate));
            z += dt * f.deflection_rate(z, rate);
            // If the deflection followed the shaft at its full rate, it would grow by dt · rate = 6
            // mrad per step.
            assert!(z <= 1.02 * 2.0 / f.stiffness, "{k}: {z}");
        }
        // After a reversal, the bristle relaxes through zero and deflects in the other direction. Its rate must
        // not jump there.
        let f = ShaftFriction { stiffness: 2000.0, damping: 20.0, limits: [3.0, 7.0] };
        for rate in [6.0, -6.0] {
            let [a, b] = [-1e-15, 1e-15].map(|z| f.deflection_rate(z, rate));
            assert!((a - b).abs() < 1e-9 && a * rate > 0.0, "{rate}: {a} {b}");
        }
    }

    #[test]
    fn above_the_limit_the_rest_accelerates() {
        let (_, rate) = run(13.0, 2.0);
        assert!((rate - 3.0 / 0.5 * 2.0).abs() < 0.2, "{rate}");
    }
}

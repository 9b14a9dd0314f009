//! Soil with memory of earlier wheels: repeated loading as pure functions of the ground's state at a patch.
//! ```text
//! first        p = k zⁿ                                  z below the surface that nothing has pressed yet
//! again        p = p_u − k_u (z_u − z)₊                  z ≤ z_u;  k_u = k₀ + A_u z_u                 (Wong)
//! beyond       p = p_u + k (zⁿ − z_uⁿ)                   z > z_u: back on the curve of the first pass
//! rut          z_r = z_u − p_u/k_u                       what is left when the load is gone
//! ```
//! A wheel in a rut meets the ground at z_r, stiff up to z_u: `WheelSoil::pass` returns its forces and the state of the ground after it. Nothing is
//! kept here: `ruts` stores the states of a ground. The kink of the pressure at z_u costs the eight-node integrals about 1 % of the load.

/// Stiffness of pressed soil: `k_u = k₀ + A_u z_u`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unloading {
    /// `k₀`, N/m³.
    pub k0: f64,
    /// `A_u`, N/m⁴.
    pub growth: f64,
}

/// State of the ground at a patch: the deepest loading so far. The default is undisturbed ground.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Rut {
    /// Deepest sinkage `z_u` below the first surface, m.
    pub sinkage: f64,
    /// Pressure there `p_u`, Pa.
    pub pressure: f64,
    /// Stiffness of unloading and reloading `k_u`, N/m³.
    pub stiffness: f64,
}

impl Rut {
    /// Depth of the rut after unloading, m.
    pub fn depth(&self) -> f64 {
        if self.stiffness > 0.0 {
            (self.sinkage - self.pressure / self.stiffness).max(0.0)
        } else {
            0.0
        }
    }

    /// Pressure (Pa) at the sinkage `z` (m) below the first surface, for the modulus `k` (N/m^(n+2)) and the exponent `n`.
    pub fn pressure_at(&self, z: f64, k: f64, n: f64) -> f64 {
        let virgin = |z: f64| k * z.max(0.0).powf(n);
        if z > self.sinkage {
            self.pressure + virgin(z) - virgin(self.sinkage)
        } else {
            (self.pressure - self.stiffness * (self.sinkage - z)).max(0.0)
        }
    }

    /// Returns the state after loading to the sinkage `z` (m): unchanged unless this is the deepest.
    pub fn pressed(&self, z: f64, k: f64, n: f64, unloading: &Unloading) -> Rut {
        if z <= self.sinkage {
            return *self;
        }
        let pressure = self.pressure_at(z, k, n);
        // With a stiffness below the secant, the soil would rebound above its original surface.
        let stiffness = (unloading.k0 + unloading.growth * z).max(pressure / z);
        Rut { sinkage: z, pressure, stiffness }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::terramechanics::{Motion, WheelSoil};
    use crate::test_soils::{golden_wheel, lunar};
    use linkwork_surroundings::prelude::Soil;

    const STIFF: Unloading = Unloading { k0: 0.0, growth: 5.03e8 };

    /// Returns the depth below the first surface of a wheel that carries the load, and the state of the ground after it.
    fn roll(load: f64, slip: f64, rut: &Rut) -> (f64, Rut) {
        let m = Motion::rolling(slip, 0.0);
        let (mut low, mut high) = (0.0, 0.1);
        for _ in 0..60 {
            let z = 0.5 * (low + high);
            if golden_wheel().pass(z, &m, rut, &STIFF).0.fz < load {
                low = z;
            } else {
                high = z;
            }
        }
        let (_, left) = golden_wheel().pass(high, &m, rut, &STIFF);
        (high + rut.depth(), left)
    }

    #[test]
    fn a_press_follows_its_curve_there_and_back() {
        let (k, n) = (8.2e5, 1.1);
        let first = Rut::default().pressed(0.02, k, n, &STIFF);
        assert!((first.pressure - k * 0.02f64.powf(n)).abs() < 1e-9);
        assert!((first.stiffness - 5.03e8 * 0.02).abs() < 1e-3);
        // The depth of the rut is the sinkage minus the rebound.
        assert!((first.depth() - (0.02 - first.pressure / first.stiffness)).abs() < 1e-15);
        assert!(first.pressure_at(first.depth(), k, n).abs() < 1e-6);
        // Under the next wheel the soil is stiff up to z_u and then follows the first curve,
        // without a jump.
        assert!((first.pressure_at(0.02, k, n) - first.pressure).abs() < 1e-9);
        assert!((first.pressure_at(0.03, k, n) - k * 0.03f64.powf(n)).abs() < 1e-6);
        assert_eq!(first.pressed(0.019, k, n, &STIFF), first);
    }

    #[test]
    fn a_cycle_of_pressing_only_costs_work() {
        let (k, n) = (8.2e5, 0.9);
        let (mut rut, mut work) = (Rut::default(), 0.0);
        for round in 1..=5 {
            let deepest = 0.006 * f64::from(round);
            let at = |i: u32| {
                deepest * (1.0 - (std::f64::consts::TAU * f64::from(i) / 4000.0).cos()) / 2.0
            };
            let before = work;
            for i in 0..4000 {
                let (a, b) = (at(i), at(i + 1));
                rut = rut.pressed(b, k, n, &STIFF);
                work += rut.pressure_at(0.5 * (a + b), k, n) * (b - a);
            }
            assert!(work > before, "round {round} gives work back");
        }
    }

    #[test]
    fn fresh_ground_is_the_published_model() {
        let m = Motion::rolling(0.3, 0.0);
        let (f, rut) = golden_wheel().pass(0.02, &m, &Rut::default(), &STIFF);
        assert_eq!(f, golden_wheel().forces(0.02, &m));
        assert_eq!(rut.sinkage, 0.02);
    }

    #[test]
    fn the_second_wheel_sinks_less_and_spends_less_on_the_soil() {
        let (z1, rut) = roll(100.0, 0.1, &Rut::default());
        let (z2, again) = roll(100.0, 0.1, &rut);
        let (z3, ..) = roll(100.0, 0.1, &again);
        println!(
            "{:.2} {:.2} {:.2} mm, rut {:.2} mm",
            z1 * 1e3,
            z2 * 1e3,
            z3 * 1e3,
            rut.depth() * 1e3
        );
        // In soil without strength, compaction is the only loss, and it is smaller in the rut. (In other soil, the
        // shorter contact also shears less far, so at equal slip and modulus K the pull need not increase.)
        let slick = Soil { cohesion: 0.0, friction_angle: 0.0, ..lunar() };
        let w = WheelSoil { soil: slick, ..golden_wheel() };
        let m = Motion::rolling(0.1, 0.0);
        let first = w.pass(z1, &m, &Rut::default(), &STIFF).0;
        let second = w.pass(z2 - rut.depth(), &m, &rut, &STIFF).0;
        let (cost1, cost2) = (-first.fx / first.fz, -second.fx / second.fz);
        println!("resistance over load {cost1:.3} then {cost2:.3}");
        assert!(cost1 > 0.0 && cost2 < 0.8 * cost1);
        assert!(z2 - rut.depth() < 0.5 * z1);
        // Each pass deepens the rut less than the one before.
        assert!(z2 - z1 < 0.3 * z1 && z3 - z2 <= z2 - z1 + 1e-9);
        // A heavier wheel sinks deeper, along the curve of the first pass.
        let (heavy, ..) = roll(300.0, 0.1, &rut);
        let (fresh, ..) = roll(300.0, 0.1, &Rut::default());
        assert!(heavy > z1 && (heavy / fresh - 1.0).abs() < 0.25, "{heavy} {fresh}");
    }
}

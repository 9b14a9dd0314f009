//! Inflation of a canopy, and closed forms for it.
//! ```text
//! share of the area   f = f₀ + (f₁ − f₀) τⁿ,  τ = (t − t₀)/t_f in 0 … 1     n: 1 ribbon, 2–3 disk-gap-band, solid
//! filling time        t_f = 0.65 λ D₀/V       λ: geometric porosity in %, V: speed at line stretch (Greene)
//! Mach efficiency     η(M), of a disk-gap-band canopy: multiplies C_D
//! finite mass, no gravity, f = τⁿ, A = 2 m/(ρ C_D S v₁ t_f):
//!     v = v₁/(1 + τⁿ⁺¹/(A (n+1)))      F = ½ ρ v² C_D S τⁿ     greatest at τⁿ⁺¹ = A n (n+1)/(n+2), or at τ = 1
//! terminal speed      √(2 m g/(ρ C_D S))
//! wrist and pendulum mode of a body on a line:  ω₁² + ω₂² = (T a/I)(1 + a/l) + T/(m l),  ω₁² ω₂² = T² a/(I m l)
//! ```

/// Efficiency of a disk-gap-band canopy over Mach number; it multiplies C_D.
pub const DISK_GAP_BAND: [[f64; 2]; 20] = [
    [0.25, 1.0],
    [0.5, 1.0],
    [0.65, 1.0],
    [0.7, 0.98],
    [0.8, 0.9],
    [0.9, 0.72],
    [0.95, 0.66],
    [1.0, 0.76],
    [1.1, 0.9],
    [1.2, 0.96],
    [1.3, 0.99],
    [1.4, 0.999],
    [1.5, 0.992],
    [1.6, 0.98],
    [1.8, 0.9],
    [1.9, 0.85],
    [2.0, 0.82],
    [2.2, 0.75],
    [2.5, 0.65],
    [2.6, 0.62],
];

/// Fraction of the full drag area, between `from` and `to`, at the fraction `tau` of the filling time, and its derivative with respect to τ.
pub fn share(from: f64, to: f64, tau: f64, exponent: f64) -> (f64, f64) {
    let t = tau.clamp(0.0, 1.0);
    let slope = if tau > 0.0 && tau < 1.0 { exponent * t.powf(exponent - 1.0) } else { 0.0 };
    (from + (to - from) * t.powf(exponent), (to - from) * slope)
}

/// Filling time (s) after Greene; `porosity` in percent, `speed` at line stretch.
pub fn filling_time(porosity: f64, diameter: f64, speed: f64) -> f64 {
    0.65 * porosity * diameter / speed
}

/// Speed (m/s) at which drag equals the weight.
pub fn terminal_speed(mass: f64, gravity: f64, density: f64, drag_area: f64) -> f64 {
    (2.0 * mass * gravity / (density * drag_area)).sqrt()
}

/// Inflation of a canopy on a body of finite mass, without gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FiniteMass {
    /// Mass of all, kg.
    pub mass: f64,
    /// C_D S of the full canopy, m².
    pub drag_area: f64,
    /// Density, kg/m³.
    pub density: f64,
    /// Speed at the start, m/s.
    pub speed: f64,
    /// Filling time, s.
    pub filling: f64,
    /// Exponent n.
    pub exponent: f64,
}

impl FiniteMass {
    /// Ballistic parameter A; large values approach the case of infinite mass.
    pub fn ballistic(&self) -> f64 {
        2.0 * self.mass / (self.density * self.drag_area * self.speed * self.filling)
    }

    /// Speed at τ ≤ 1.
    pub fn speed_at(&self, tau: f64) -> f64 {
        let n1 = self.exponent + 1.0;
        self.speed / (1.0 + tau.powf(n1) / (self.ballistic() * n1))
    }

    /// Drag at τ ≤ 1.
    pub fn force_at(&self, tau: f64) -> f64 {
        let v = self.speed_at(tau);
        0.5 * self.density * v * v * self.drag_area * tau.powf(self.exponent)
    }

    /// τ of the greatest force.
    pub fn peak(&self) -> f64 {
        let n = self.exponent;
        (self.ballistic() * n * (n + 1.0) / (n + 2.0)).powf(1.0 / (n + 1.0)).min(1.0)
    }
}

/// Frequencies ω (rad/s), lower first, of a body on a line in uniform flow: wrist mode and pendulum mode.
///
/// `tension` and `length` of the line; `mass` of the body, its `inertia` about the centre of mass, and the `arm` from the centre of mass to the end
/// of the line.
pub fn wrist_modes(tension: f64, length: f64, mass: f64, inertia: f64, arm: f64) -> [f64; 2] {
    let sum = tension * arm / inertia * (1.0 + arm / length) + tension / (mass * length);
    let product = tension * tension * arm / (inertia * mass * length);
    let root = (sum * sum - 4.0 * product).max(0.0).sqrt();
    // Compute the lower frequency from the product, to avoid cancellation.
    let high = 0.5 * (sum + root);
    [(product / high).sqrt(), high.sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shocks_are_those_of_the_closed_form_and_of_an_integration() {
        // C_D S of MSL's parachute: C_D = 0.65, and S is the area of a disk of 21.35 m diameter. The golden numbers
        // were computed and integrated by another program.
        for (m, cds, rho, v, tf, n, a, tau, peak, end, infinite, factor) in [
            (
                2920.0,
                232.70140031790172,
                0.0065,
                405.0,
                0.635,
                2.0,
                15.013147285297082,
                1.0,
                118718.47360112572,
                396.2031948330804,
                124048.75335821744,
                0.957030767236335,
            ),
            (
                600.0,
                180.0,
                0.01,
                330.0,
                1.2,
                1.0,
                1.6835016835016836,
                1.0,
                58262.67722976158,
                254.43330763299923,
                98010.0,
                0.5944564557673868,
            ),
            (
                400.0,
                120.0,
                0.4,
                70.0,
                1.5,
                2.0,
                0.15873015873015872,
                0.6197980942410934,
                20078.22315052765,
                22.58064516129032,
                117600.0,
                0.17073319005550724,
            ),
        ] {
            let f = FiniteMass {
                mass: m,
                drag_area: cds,
                density: rho,
                speed: v,
                filling: tf,
                exponent: n,
            };
            for (found, want) in [
                (f.ballistic(), a),
                (f.peak(), tau),
                (f.force_at(f.peak()), peak),
                (f.speed_at(1.0), end),
                // The mass is so large that it does not slow down. The shock factor X₁ is relative
                // to the force on this mass.
                (FiniteMass { mass: 1e30, ..f }.force_at(1.0), infinite),
                (f.force_at(f.peak()) / FiniteMass { mass: 1e30, ..f }.force_at(1.0), factor),
            ] {
                assert!((found / want - 1.0).abs() < 1e-13, "{found} {want}");
            }
            // Integrate Newton's law in small steps.
            let (mut speed, steps) = (v, 20_000);
            let slope = |tau: f64, s: f64| -0.5 * rho * s * s * cds * tau.powf(n) / m * tf;
            for k in 0..steps {
                let h = 1.0 / f64::from(steps);
                let t = f64::from(k) * h;
                let middle = speed + 0.5 * h * slope(t, speed);
                speed += h * slope(t + 0.5 * h, middle);
            }
            assert!((speed / f.speed_at(1.0) - 1.0).abs() < 1e-8);
            assert!(f.force_at(f.peak()) >= f.force_at(f.peak() * 0.99));
        }
    }

    #[test]
    fn a_canopy_comes_to_its_terminal_speed() {
        let v = terminal_speed(2920.0, 3.71, 0.0115, 221.96133568784472);
        assert!((v - 92.13100176612646).abs() < 1e-12, "{v}");
    }

    #[test]
    fn filling_goes_from_end_to_end_without_a_jump() {
        assert_eq!(share(0.1, 0.6, -1.0, 2.0), (0.1, 0.0));
        assert_eq!(share(0.1, 0.6, 2.0, 2.0), (0.6, 0.0));
        let (f, d) = share(0.1, 0.6, 0.5, 2.0);
        assert!((f - 0.225).abs() < 1e-15 && (d - 0.5).abs() < 1e-15);
        assert!((filling_time(12.5, 15.96, 400.0) - 0.32419).abs() < 1e-4);
    }

    #[test]
    fn wrist_modes_solve_the_two_equations() {
        // The equations are m ÿ = −T (y + aθ)/l and I θ̈ = −T a θ − T a (y + aθ)/l.
        let (t, l, m, i, a) = (10_500.0, 50.0, 2850.0, 4600.0, 1.6);
        for omega in wrist_modes(t, l, m, i, a) {
            let w2 = omega * omega;
            let (k11, k12) = (t / l, t * a / l);
            let (k21, k22) = (t * a / l, t * a + t * a * a / l);
            let determinant = (k11 - m * w2) * (k22 - i * w2) - k12 * k21;
            assert!(determinant.abs() < 1e-9 * k22 * (k11 + m * w2), "{omega}: {determinant}");
        }
        let [low, high] = wrist_modes(t, l, m, i, a);
        assert!(low < high && (low / (t / (l * m)).sqrt() - 1.0).abs() < 0.1);
    }
}

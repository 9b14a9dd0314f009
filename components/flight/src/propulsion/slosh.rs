//! First slosh mode of propellant in an upright cylinder, as a pendulum or a mass on a spring.
//! ```text
//! k = 1.841184 (first zero of J₁′)     κ = k h/R
//! ω² = (k a/R) tanh κ                  a: acceleration along the axis
//! m₁/m = 2 tanh κ/(κ (k² − 1))         the share that swings
//! h₁ = h − (2R/k) tanh(κ/2)            height of a spring's mass over the bottom; a pendulum's pivot: h₁ + L
//! pendulum: L = a/ω² = R/(k tanh κ)    spring: k₁ = m₁ ω²
//! c = 2 ζ ω m₁ (spring)                c_θ = 2 ζ ω m₁ L² (pendulum)
//! ```
//! (Abramson, NASA SP-106.) A pendulum is a body on a `Pin` with a damping. A mass on springs that follows the level of a
//! tank is `flight.slosh`; at one level, a body on a `Slider` with stiffness and damping does.

/// First zero of the derivative of the Bessel function J₁.
const K: f64 = 1.841_183_781_340_659;

/// The first mode of a liquid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slosh {
    /// Radius of the tank R, m.
    pub radius: f64,
    /// Height of the liquid h, m.
    pub height: f64,
    /// Mass of the liquid, kg.
    pub mass: f64,
}

impl Slosh {
    fn depth(&self) -> f64 {
        (K * self.height / self.radius).tanh()
    }

    /// Frequency ω (rad/s) under an acceleration a (m/s²).
    pub fn frequency(&self, acceleration: f64) -> f64 {
        (acceleration * self.per_acceleration()).sqrt()
    }

    /// Mass that swings, kg.
    pub fn swinging(&self) -> f64 {
        let kappa = K * self.height / self.radius;
        self.mass * 2.0 * self.depth() / (kappa * (K * K - 1.0))
    }

    /// Height of the mass on a spring above the flat bottom, m: at this height spring force and weight of the displaced mass have the same moment as
    /// the pressure on wall and bottom.
    pub fn attachment(&self) -> f64 {
        self.height - 2.0 * self.radius / K * (0.5 * K * self.height / self.radius).tanh()
    }

    /// Ratio of ω² to the acceleration, 1/m: the reciprocal of the length of the pendulum.
    pub fn per_acceleration(&self) -> f64 {
        K / self.radius * self.depth()
    }

    /// Length of the pendulum, m: the same under every acceleration.
    pub fn pendulum(&self) -> f64 {
        1.0 / self.per_acceleration()
    }

    /// Stiffness of the spring, N/m.
    pub fn stiffness(&self, acceleration: f64) -> f64 {
        self.swinging() * self.frequency(acceleration).powi(2)
    }

    /// Damping coefficient of the spring (N s/m) for a damping ratio ζ.
    pub fn damping(&self, acceleration: f64, zeta: f64) -> f64 {
        2.0 * zeta * self.frequency(acceleration) * self.swinging()
    }
}

/// Frequency (Hz) of a pendulum with a length (m) under an acceleration (m/s²).
pub fn pendulum_frequency(length: f64, acceleration: f64) -> f64 {
    (acceleration / length).sqrt() / (2.0 * std::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pendulum_and_spring_have_the_frequency_of_the_mode() {
        assert!((pendulum_frequency(0.35, 3.0) - 0.46595796172050097).abs() < 1e-15);
        let s = Slosh { radius: 0.4, height: 0.9, mass: 300.0 };
        let omega = s.frequency(3.0);
        let hertz = pendulum_frequency(s.pendulum(), 3.0);
        assert!((hertz * 2.0 * std::f64::consts::PI - omega).abs() < 1e-14);
        assert!(((s.stiffness(3.0) / s.swinging()).sqrt() - omega).abs() < 1e-14);
        assert!((s.damping(3.0, 0.05) / (2.0 * s.swinging() * omega) - 0.05).abs() < 1e-15);
    }

    #[test]
    fn shallow_and_deep_liquids_have_their_limits() {
        // For a deep liquid, ω² = k a/R, and m₁ is the mass of a layer. For a shallow one, m₁/m →
        // 2/(k² − 1) = 0.837.
        let deep = Slosh { radius: 1.0, height: 20.0, mass: 1.0 };
        assert!((deep.frequency(9.81).powi(2) - K * 9.81).abs() < 1e-12);
        assert!((deep.swinging() - 2.0 / (K * 20.0 * (K * K - 1.0))).abs() < 1e-12);
        let shallow = Slosh { height: 1e-4, ..deep };
        assert!((shallow.swinging() - 2.0 / (K * K - 1.0)).abs() < 1e-6);
        // The slosh mass cannot exceed the mass of the liquid.
        assert!(shallow.swinging() < 1.0);
    }

    /// The pressure of the first mode, p ∝ J₁(k r/R) cosh(k z/R) cos θ, integrated over wall and bottom by quadrature: the ratio of its moment to its
    /// force is h₁ + L, where L is due to the weight of the displaced mass.
    #[test]
    fn the_height_of_the_mass_is_that_of_the_pressure() {
        // Evaluate J₁ by its series.
        let bessel = |x: f64| {
            let (mut term, mut sum) = (0.5 * x, 0.0);
            for n in 1..30 {
                sum += term;
                term *= -0.25 * x * x / f64::from(n * (n + 1));
            }
            sum
        };
        for height in [0.1, 0.6, 2.0] {
            let s = Slosh { radius: 0.7, height, mass: 1.0 };
            let n = 4000;
            let middle = |k: i32, length: f64| (f64::from(k) + 0.5) * length / f64::from(n);
            let (mut force, mut moment) = (0.0, 0.0);
            for k in 0..n {
                // The integrals of force and moment over the angle both give a factor π.
                let (z, dz) = (middle(k, height), height / f64::from(n));
                let wall = bessel(K) * (K * z / s.radius).cosh() * s.radius * dz;
                force += wall;
                moment += wall * z;
                let (r, dr) = (middle(k, s.radius), s.radius / f64::from(n));
                moment += bessel(K * r / s.radius) * r * r * dr;
            }
            let want = moment / force - s.pendulum();
            assert!((s.attachment() - want).abs() < 1e-6, "{height}: {} {want}", s.attachment());
        }
        assert_eq!(Slosh { radius: 0.7, height: 0.0, mass: 0.0 }.attachment(), 0.0);
    }
}

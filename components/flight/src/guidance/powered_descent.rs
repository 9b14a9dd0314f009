//! `flight.powered_descent`: polynomial guidance that brings a lander to its target at a given time.
//! ```text
//! t = t_go      quadratic: a = a_T + 12 (r_T − r)/t² − 6 (v_T + v)/t        (Klumpp, Apollo: position, velocity, acceleration)
//!               linear:    a = 6 (r_T − r)/t² − 2 (v_T + 2 v)/t             (E-guidance: position, velocity)
//! F = m (a − g), scaled into T_min … T_max with its direction; below `freeze` the last one is held
//! gravity turn: thrust against the velocity, V̇ = −T/m + g cos ψ, ψ̇ = −g sin ψ/V
//! ```
//! Without limits and lag both laws reproduce the exact polynomial, so that re-evaluation during the flight does not change it.

use linkwork_surroundings::prelude::*;

/// Target state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Position, m.
    pub position: Vec3,
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Acceleration, m/s²; for the quadratic law.
    pub acceleration: Vec3,
}

/// Returns the total acceleration (m/s²) of the quadratic law, which reaches position, velocity and acceleration of the target after `to_go` s.
pub fn quadratic(r: &Vec3, v: &Vec3, target: &Target, to_go: f64) -> Vec3 {
    target.acceleration + (target.position - r) * (12.0 / (to_go * to_go))
        - (target.velocity + v) * (6.0 / to_go)
}

/// Returns the total acceleration (m/s²) of the linear law, which reaches position and velocity of the target after `to_go` s.
pub fn linear(r: &Vec3, v: &Vec3, target: &Target, to_go: f64) -> Vec3 {
    (target.position - r) * (6.0 / (to_go * to_go)) - (target.velocity + v * 2.0) * (2.0 / to_go)
}

/// Returns the coefficients c₀, c₁, c₂ of a(t) = c₀ + c₁ t + c₂ t² of the quadratic law.
pub fn quadratic_coefficients(r: &Vec3, v: &Vec3, target: &Target, to_go: f64) -> [Vec3; 3] {
    let c0 = quadratic(r, v, target, to_go);
    // The velocity change gives one equation, and the final acceleration the other.
    let dv = target.velocity - v - c0 * to_go;
    let da = target.acceleration - c0;
    let t = to_go;
    // The equations are c₁ t²/2 + c₂ t³/3 = dv and c₁ t + c₂ t² = da.
    let c2 = (da * (0.5 * t) - dv) * (6.0 / (t * t * t));
    let c1 = da / t - c2 * t;
    [c0, c1, c2]
}

/// Returns the derivatives (V̇, ψ̇) of speed (m/s) and angle from the nadir (rad) under thrust opposite to the velocity.
pub fn gravity_turn(
    speed: f64,
    from_nadir: f64,
    thrust_over_mass: f64,
    gravity: f64,
) -> (f64, f64) {
    let (s, c) = from_nadir.sin_cos();
    (-thrust_over_mass + gravity * c, -gravity * s / speed)
}

/// Returns a force with its magnitude clamped to `low` … `high`; a zero force stays zero.
pub fn limited(force: &Vec3, low: f64, high: f64) -> Vec3 {
    let size = force.norm();
    if size > 0.0 { force * (size.clamp(low, high) / size) } else { Vec3::zeros() }
}

/// Returns the force F = m (a − g) within its limits, and whether it was limited.
pub(super) fn commanded(a: &Vec3, g: &Vec3, mass: f64, (low, high): (f64, f64)) -> (Vec3, bool) {
    let wanted = (a - g) * mass;
    let size = wanted.norm();
    (limited(&wanted, low, high), size < low || size > high)
}

/// Checks the limits of a thrust.
///
/// # Errors
/// `min` exceeds `max`.
pub(super) fn thrust_limits(min: f64, max: f64) -> Result<(), BuildError> {
    if min <= max {
        return Ok(());
    }
    let fact = format!("thrust_min {min} N is above thrust_max {max} N");
    Err(BuildError::new(fact).help("`thrust_min` must not exceed `thrust_max`").at("thrust_min"))
}

/// Polynomial of the guidance law.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// Position, velocity and acceleration at the end.
    Quadratic,
    /// Position and velocity at the end.
    Linear,
}

/// Target and limits.
#[derive(Params, Clone, Debug)]
pub struct DescentParams {
    /// Guidance law: quadratic or linear.
    #[param(default = Law::Quadratic)]
    pub law: Law,
    /// Target position, W.
    #[param(unit = "m", default = Vec3::zeros())]
    pub position: Vec3,
    /// Target velocity, W.
    #[param(unit = "m/s", default = Vec3::zeros())]
    pub velocity: Vec3,
    /// Target acceleration, W; for the quadratic law.
    #[param(unit = "m/s^2", default = Vec3::zeros(), needs = "law = quadratic")]
    pub acceleration: Vec3,
    /// Time of arrival.
    #[param(unit = "s")]
    pub arrival: f64,
    /// Time before the arrival from which the last force is held. After the arrival the force is zero.
    #[param(unit = "s", default = 1.0, range = 1e-3..)]
    pub freeze: f64,
    /// Least force.
    #[param(unit = "N", default = 0.0, range = 0.0..)]
    pub thrust_min: f64,
    /// Greatest force.
    #[param(unit = "N", range = 0.0..)]
    pub thrust_max: f64,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// State of the lander.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DescentIn {
    /// The lander, W.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Mass of the lander.
    #[port("kg")]
    pub mass: f64,
}

/// Force command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DescentOut {
    /// Commanded force, W.
    #[port("N")]
    pub force: Vec3,
    /// Time to go.
    #[port("s")]
    pub to_go: f64,
    /// The force was limited to its least or greatest value.
    #[port]
    pub limited: bool,
}

/// The last command.
#[derive(State, Clone, Copy, Debug)]
pub struct Last {
    /// Force, W.
    #[port("N")]
    pub force: Vec3,
}

/// Returns a warning if the arrival is in the past or within `freeze` at the start of the run or phase, because the guidance then has no effect.
pub(super) fn past(arrival: f64, freeze: f64, t: f64) -> Vec<BuildError> {
    let fact = format!(
        "`arrival` is {arrival} s, but the time is {t:.6} s: the guidance has no effect later than {freeze} s before the arrival"
    );
    let help = "write a later `arrival`; it is a time of the simulation, not of the phase";
    let late = || BuildError::new(fact).help(help).at("arrival");
    (arrival - t < freeze).then(late).into_iter().collect()
}

/// Powered descent.
pub struct PoweredDescent {
    p: DescentParams,
    target: Target,
}

/// Polynomial guidance of a powered descent; sampled, with limits, frozen just before the end.
#[model("flight.powered_descent")]
impl Model for PoweredDescent {
    type Params = DescentParams;
    type FeedthroughInputs = DescentIn;
    type FeedthroughOutputs = DescentOut;
    type DiscreteState = Last;
    fn build(p: DescentParams) -> Result<Self, BuildError> {
        thrust_limits(p.thrust_min, p.thrust_max)?;
        let target =
            Target { position: p.position, velocity: p.velocity, acceleration: p.acceleration };
        Ok(PoweredDescent { p, target })
    }
    fn feedthrough(&self, clock: &Clock, d: &Last, u: &DescentIn) -> DescentOut {
        let p = &self.p;
        let to_go = p.arrival - clock.t;
        if to_go < 1e-9 {
            return DescentOut { force: Vec3::zeros(), to_go, limited: false };
        }
        // The tolerance covers the round-off of sample times.
        if to_go < p.freeze - 1e-9 {
            return DescentOut { force: d.force, to_go, limited: false };
        }
        let (r, v) = (&u.body.position, &u.body.velocity);
        let a = match p.law {
            Law::Quadratic => quadratic(r, v, &self.target, to_go),
            Law::Linear => linear(r, v, &self.target, to_go),
        };
        let falls = p.gravity.free_fall(clock.t, *r, *v);
        let (force, limited) = commanded(&a, &falls, u.mass, (p.thrust_min, p.thrust_max));
        DescentOut { force, to_go, limited }
    }
    fn update(&self, clock: &Clock, d: &Last, u: &DescentIn) -> Last {
        Last { force: self.feedthrough(clock, d, u).force }
    }
    fn startup_warnings(&self, clock: &Clock) -> Vec<BuildError> {
        past(self.p.arrival, self.p.freeze, clock.t)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const R: [f64; 3] = [15_000.0, -2000.0, 2500.0];
    const V: [f64; 3] = [-180.0, 30.0, -45.0];

    fn target() -> Target {
        Target { position: Vec3::z() * 30.0, velocity: -Vec3::z(), acceleration: Vec3::z() * 0.2 }
    }

    #[test]
    fn the_quadratic_law_is_the_golden_one_and_its_own_polynomial() {
        let (r, v, t) = (Vec3::from(R), Vec3::from(V), 140.0);
        let a = quadratic(&r, &v, &target(), t);
        let want = Vec3::new(-1.4693877551020416, -0.061224489795918435, 0.6591836734693879);
        assert!((a - want).norm() < 1e-14);
        let [c0, c1, c2] = quadratic_coefficients(&r, &v, &target(), t);
        let want1 = Vec3::new(0.09708454810495627, -0.007434402332361511, -0.008221574344023335);
        let want2 = Vec3::new(-0.0006184922948771345, 5.622657226155766e-05, 3.529779258642239e-05);
        assert!((c1 - want1).norm() < 1e-15 && (c2 - want2).norm() < 1e-17);
        let position = |s: f64| {
            r + v * s + c0 * (s * s / 2.0) + c1 * (s.powi(3) / 6.0) + c2 * (s.powi(4) / 12.0)
        };
        let velocity = |s: f64| v + c0 * s + c1 * (s * s / 2.0) + c2 * (s.powi(3) / 3.0);
        assert!((position(70.0) - Vec3::new(3112.5, -362.5, 565.625)).norm() < 1e-9);
        assert!((position(t) - target().position).norm() < 1e-9);
        assert!((velocity(t) - target().velocity).norm() < 1e-11);
        // Re-evaluated along the trajectory, the law gives the same acceleration.
        let s = 50.0;
        let again = quadratic(&position(s), &velocity(s), &target(), t - s);
        assert!((again - (c0 + c1 * s + c2 * s * s)).norm() < 1e-12);
    }

    #[test]
    fn the_linear_law_is_the_golden_one_and_arrives() {
        let (mut r, mut v) = (Vec3::from(R), Vec3::from(V));
        let a = linear(&r, &v, &target(), 140.0);
        let want = Vec3::new(0.5510204081632653, -0.2448979591836734, 0.5438775510204082);
        assert!((a - want).norm() < 1e-15);
        let h = 1e-3;
        for k in 0..139_999 {
            let to_go = 140.0 - f64::from(k) * h;
            let a = linear(&r, &v, &target(), to_go);
            r += v * h + a * (0.5 * h * h);
            v += a * h;
        }
        assert!((r - target().position).norm() < 0.01 && (v - target().velocity).norm() < 0.05);
    }

    #[test]
    fn a_gravity_turn_ends_upright_with_its_speed() {
        // ψ decreases as V^(1/(n − 1)), so it is 0.8 · 0.01^0.7 at a hundredth of the speed.
        let (mut v, mut psi, h) = (500.0, 0.8, 1e-3);
        while v > 5.0 {
            let (dv, dpsi) = gravity_turn(v, psi, 9.0, 3.71);
            v += h * dv;
            psi += h * dpsi;
        }
        assert!(psi > 0.0 && psi < 0.04, "{psi}");
        // The closed form is V = V₀ (tan ψ/2 / tan ψ₀/2)^(n−1) (1 + tan²)/(1 + tan₀²) with n = T/(m
        // g).
        let n = 9.0 / 3.71;
        let (mut v, mut psi) = (500.0, 0.8);
        for _ in 0..20_000 {
            let (dv, dpsi) = gravity_turn(v, psi, 9.0, 3.71);
            let (dv, dpsi) = {
                let (a, b) = (v + 0.5 * h * dv, psi + 0.5 * h * dpsi);
                gravity_turn(a, b, 9.0, 3.71)
            };
            v += h * dv;
            psi += h * dpsi;
        }
        let z = |psi: f64| (0.5 * psi).tan();
        let form = |psi: f64| z(psi).powf(n - 1.0) * (1.0 + z(psi).powi(2));
        let want = 500.0 * form(psi) / form(0.8);
        assert!((v / want - 1.0).abs() < 1e-5, "{v} {want}");
    }

    #[test]
    fn forces_keep_their_direction_within_limits() {
        let f = Vec3::new(3.0, 0.0, 4.0);
        assert_eq!(limited(&f, 10.0, 20.0), Vec3::new(6.0, 0.0, 8.0));
        assert_eq!(limited(&f, 0.0, 2.5), Vec3::new(1.5, 0.0, 2.0));
        assert_eq!(limited(&f, 1.0, 9.0), f);
        assert_eq!(limited(&Vec3::zeros(), 1.0, 9.0), Vec3::zeros());
    }
}

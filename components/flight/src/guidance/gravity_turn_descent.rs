//! `flight.gravity_turn_descent`: braking against the velocity down to a place in the air over the ground, then slowly down.
//! ```text
//! V̇ = −N g + g cos ψ, ψ̇ = −g sin ψ/V        N g = T/m, ψ: velocity from straight down, z = tan(ψ/2)
//! with constant N:  V = C z^(N−1) (1 + z²);  V = 0 lies lower by  h = V²/(g (1 + z²)²) [1/(2N − 2) − z⁴/(2N + 2)]
//! solved for N:     N = [1 − z⁴ + √((1 − z⁴)² + 8 A (1 + z⁴ + 2 A))]/(4 A),  A = g h (1 + z²)²/V²
//! waits             until m N g ≥ `ignition` T_max: then T = m N g along −v, N anew at each sample, at most T_max
//! last              from where V ≤ `speed`:  F = m (−g + k (−`speed` up − v)),  k = 1/`settle`
//! ```
//! v is over the ground of the planet, which is at the origin of W and turns about z, or on which W is a site. g is that of the
//! place, and the ground is flat: for the last kilometres. Where on the ground it comes down is left open.

use super::planet::Frame;
use super::powered_descent::thrust_limits;
use linkwork_runtime::prelude::*;

/// Limits and the end.
#[derive(Params, Clone, Debug)]
pub struct GravityTurnDescentParams {
    /// Height over the ground at which the speed would be none.
    #[param(unit = "m", default = 20.0, range = 0.0..)]
    pub height: f64,
    /// Speed of the last part, downwards.
    #[param(unit = "m/s", default = 1.0, range = 1e-3..)]
    pub speed: f64,
    /// Share of the greatest force at which it ignites; the rest is kept for what is not foreseen.
    #[param(default = 0.8, range = 0.01..=1.0)]
    pub ignition: f64,
    /// Time constant of the last part.
    #[param(unit = "s", default = 2.0, range = 1e-3..)]
    pub settle: f64,
    /// Smallest force once it burns.
    #[param(unit = "N", default = 0.0, range = 0.0..)]
    pub thrust_min: f64,
    /// Greatest force.
    #[param(unit = "N", range = 0.0..)]
    pub thrust_max: f64,
    /// The world; without one the ground is level.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// What is measured.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GravityTurnDescentIn {
    /// The lander, W.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Height over the ground.
    #[port("m")]
    pub height: f64,
    /// Mass that the force carries.
    #[port("kg")]
    pub mass: f64,
}

/// What to do.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GravityTurnDescentOut {
    /// Force that is wanted, W; none before ignition.
    #[port("N")]
    pub force: Vec3,
    /// Force over weight that a constant one would need to the end, N; 1e6 where nothing of the height is left.
    #[port("1")]
    pub needed: f64,
    /// 0 falls, 1 brakes, 2 comes down slowly.
    #[port("1")]
    pub phase: f64,
    /// The force was outside the limits.
    #[port]
    pub limited: bool,
}

/// How far it is.
#[derive(State, Clone, Copy, Debug)]
pub struct Braking {
    /// 0 falls, 1 brakes, 2 comes down slowly.
    #[port("1")]
    pub phase: f64,
}

/// Greatest force over weight that is told: nothing of the height is left.
const MOST: f64 = 1e6;

/// Braking along the velocity.
pub struct GravityTurnDescent {
    p: GravityTurnDescentParams,
    frame: Frame,
}

/// Constant force over weight that brings a speed (m/s) whose direction has the cosine `down` with straight down to none after
/// falling by `height` (m) under `gravity` (m/s²); without end where nothing of the height is left.
pub fn force_over_weight(speed: f64, down: f64, height: f64, gravity: f64) -> f64 {
    if !(height > 0.0) {
        return f64::INFINITY;
    }
    if !(speed > 0.0) {
        return 1.0;
    }
    // tan²(ψ/2).
    let square = ((1.0 - down) / (1.0 + down).max(1e-12)).max(0.0);
    let fourth = square * square;
    let a = gravity * height * (1.0 + square).powi(2) / (speed * speed);
    let root = ((1.0 - fourth).powi(2) + 8.0 * a * (1.0 + fourth + 2.0 * a)).sqrt();
    (1.0 - fourth + root) / (4.0 * a)
}

impl GravityTurnDescent {
    fn decide(&self, c: &Clock, d: &Braking, u: &GravityTurnDescentIn) -> GravityTurnDescentOut {
        let p = &self.p;
        let v = self.frame.over_ground(&u.body);
        let pull = p.gravity.free_fall(c.t, u.body.position, u.body.velocity);
        let g = pull.norm();
        let (speed, up) = (v.norm(), if g > 0.0 { -pull / g } else { Vec3::z() });
        let down = if speed > 0.0 { -v.dot(&up) / speed } else { 1.0 };
        let needed = force_over_weight(speed, down, u.height - p.height, g).min(MOST);
        let ignites = u.mass * needed * g >= p.ignition * p.thrust_max;
        let phase = match d.phase {
            0.0 if !ignites => 0.0,
            x if x < 1.5 && speed > p.speed => 1.0,
            _ => 2.0,
        };
        let wanted = match phase {
            0.0 => Vec3::zeros(),
            1.0 => v * (-u.mass * needed * g / speed),
            _ => (-pull + (up * -p.speed - v) / p.settle) * u.mass,
        };
        let size = wanted.norm();
        let within = if phase > 0.0 { size.clamp(p.thrust_min, p.thrust_max) } else { 0.0 };
        let force = if size > 0.0 { wanted * (within / size) } else { up * within };
        GravityTurnDescentOut { force, needed, phase, limited: within != size }
    }
}

/// Brakes a lander along its velocity by constant force over weight, then brings it slowly down; sampled.
#[model("flight.gravity_turn_descent")]
impl Model for GravityTurnDescent {
    type Params = GravityTurnDescentParams;
    type FeedthroughInputs = GravityTurnDescentIn;
    type FeedthroughOutputs = GravityTurnDescentOut;
    type DiscreteState = Braking;
    fn build(p: GravityTurnDescentParams) -> Result<Self, BuildError> {
        thrust_limits(p.thrust_min, p.thrust_max)?;
        let frame = Frame::new(p.world.as_ref(), Some(&p.gravity))?;
        Ok(GravityTurnDescent { p, frame })
    }
    fn feedthrough(
        &self,
        clock: &Clock,
        d: &Braking,
        u: &GravityTurnDescentIn,
    ) -> GravityTurnDescentOut {
        self.decide(clock, d, u)
    }
    fn update(&self, clock: &Clock, d: &Braking, u: &GravityTurnDescentIn) -> Braking {
        Braking { phase: self.decide(clock, d, u).phase }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_runtime::testing;

    fn params() -> GravityTurnDescentParams {
        GravityTurnDescentParams {
            height: 20.0,
            speed: 1.0,
            ignition: 0.8,
            settle: 2.0,
            thrust_min: 0.0,
            thrust_max: 10_000.0,
            world: None,
            gravity: testing::gravity(|_, _| Vec3::z() * -1.62),
        }
    }

    /// EDL.md: V̇ = −T/m + g cos ψ, ψ̇ = −g sin ψ/V, by Runge and Kutta, until the speed is a hundred-thousandth.
    fn fall(speed: f64, psi: f64, n: f64) -> f64 {
        let g = 1.62;
        let rate = |[v, a, _]: [f64; 3]| [g * (a.cos() - n), -g * a.sin() / v, v * a.cos()];
        let (mut s, end) = ([speed, psi, 0.0], 1e-5 * speed);
        while s[0] > end {
            // Shorter towards the end, where the angle turns fast.
            let h = 2e-4 * s[0] / g;
            let step = |k: [f64; 3], w: f64| std::array::from_fn(|i| s[i] + w * h * k[i]);
            let k1 = rate(s);
            let k2 = rate(step(k1, 0.5));
            let k3 = rate(step(k2, 0.5));
            let k4 = rate(step(k3, 1.0));
            for i in 0..3 {
                s[i] += h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        s[2]
    }

    #[test]
    fn the_closed_form_is_the_integral() {
        for (speed, psi, n) in [(100.0, 0.0, 2.5), (300.0, 0.9, 3.0), (1700.0, 1.5, 4.0)] {
            let f: f64 = psi;
            let height = fall(speed, psi, n);
            let found = force_over_weight(speed, f.cos(), height, 1.62);
            assert!((found / n - 1.0).abs() < 1e-8, "{speed} {psi}: {found} for {n}");
        }
        assert!((force_over_weight(50.0, 1.0, 1250.0 / 1.62, 1.62) - 2.0).abs() < 1e-12);
        assert!(force_over_weight(50.0, 1.0, 0.0, 1.62).is_infinite());
    }

    /// From 200 m/s at 60° from the vertical: it waits, brakes with a force that hardly changes, comes down at 1 m/s.
    #[test]
    fn a_lander_comes_down_as_it_should() {
        let m = GravityTurnDescent::build(params()).unwrap();
        let (mut r, mut v) = (Vec3::z() * 9000.0, Vec3::new(170.0, 20.0, -100.0));
        let (mut d, mut mass) = (Braking::zero(), 1500.0);
        let (dt, mut held, mut lit) = (0.1, Vec::new(), None);
        let mut t = 0.0;
        while r.z > 0.0 {
            let body = NodeState { position: r, velocity: v, ..NodeState::identity() };
            let u = GravityTurnDescentIn { body, height: r.z, mass };
            let c = Clock::at(t, dt, 0);
            let y = m.feedthrough(&c, &d, &u);
            d = m.update(&c, &d, &u);
            if y.phase == 1.0 {
                lit.get_or_insert(r.z);
                held.push((y.force.norm() / mass / 1.62, v.norm()));
                assert!(y.force.dot(&v) < 0.0 && !y.limited);
            }
            let a = y.force / mass - Vec3::z() * 1.62;
            r += v * dt + a * (0.5 * dt * dt);
            v += a * dt;
            mass -= y.force.norm() / 3000.0 * dt;
            t += dt;
            assert!(t < 600.0);
        }
        println!("ignition at {lit:?} m, {} samples, {} kg", held.len(), mass);
        assert!((v + Vec3::z()).norm() < 0.01, "{v}");
        let first = held[0].0;
        // Held samples are no constant deceleration: near the end, where N turns fast, it may differ.
        assert!(held.iter().filter(|h| h.1 > 20.0).all(|h| (h.0 / first - 1.0).abs() < 0.02));
        assert!(lit.unwrap() < 8900.0 && held.len() > 200);
    }
}

//! `flight.gravity_turn_descent`: gravity-turn descent. The thrust is opposite to the velocity until a given height above the ground, followed by a
//! slow vertical descent.
//! ```text
//! V̇ = −N g + g cos ψ, ψ̇ = −g sin ψ/V        N g = T/m, ψ: velocity from straight down, z = tan(ψ/2)
//! with constant N:  V = C z^(N−1) (1 + z²);  V = 0 lies lower by  h = V²/(g (1 + z²)²) [1/(2N − 2) − z⁴/(2N + 2)]
//! solved for N:     N = [1 − z⁴ + √((1 − z⁴)² + 8 A (1 + z⁴ + 2 A))]/(4 A),  A = g h (1 + z²)²/V²
//! waits             until m N g ≥ `ignition` T_max: then T = m N g along −v, N anew at each sample, at most T_max
//! last              from where V ≤ `speed`:  F = m (−g + k (−`speed` up − v)),  k = 1/`settle`
//! ```
//! v is relative to the ground of the planet, which is at the origin of W and rotates about z, or on which W is a site. The law assumes flat ground
//! and constant g, and is valid for the last kilometres. The landing site is not controlled.

use super::planet::Frame;
use super::powered_descent::thrust_limits;
use linkwork_surroundings::prelude::*;

/// End conditions and limits.
#[derive(Params, Clone, Debug)]
pub struct GravityTurnDescentParams {
    /// Height above the ground at which the speed of the braking phase would reach zero.
    #[param(unit = "m", default = 20.0, range = 0.0..)]
    pub height: f64,
    /// Descent speed of the final phase.
    #[param(unit = "m/s", default = 1.0, range = 1e-3..)]
    pub speed: f64,
    /// Fraction of the greatest force at which braking begins; the rest is the control margin.
    #[param(default = 0.8, range = 0.01..=1.0)]
    pub ignition: f64,
    /// Time constant of the final phase.
    #[param(unit = "s", default = 2.0, range = 1e-3..)]
    pub settle: f64,
    /// Least force after ignition.
    #[param(unit = "N", default = 0.0, range = 0.0..)]
    pub thrust_min: f64,
    /// Greatest force.
    #[param(unit = "N", range = 0.0..)]
    pub thrust_max: f64,
    /// The world; without a world the ground is level.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// State of the lander.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GravityTurnDescentIn {
    /// The lander, W.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Height above the ground.
    #[port("m")]
    pub height: f64,
    /// Mass of the lander.
    #[port("kg")]
    pub mass: f64,
}

/// Force command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GravityTurnDescentOut {
    /// Commanded force, W; zero before ignition.
    #[port("N")]
    pub force: Vec3,
    /// Constant thrust-to-weight ratio N that brings the speed to zero at `height`; 1e6 at and below that height.
    #[port("1")]
    pub needed: f64,
    /// Phase: 0 free fall, 1 braking, 2 final descent.
    #[port("1")]
    pub phase: f64,
    /// The force was limited to its least or greatest value.
    #[port]
    pub limited: bool,
}

/// State of the guidance.
#[derive(State, Clone, Copy, Debug)]
pub struct Braking {
    /// Phase: 0 free fall, 1 braking, 2 final descent.
    #[port("1")]
    pub phase: f64,
}

/// Greatest value of the output `needed`, used at and below the final height.
const MOST: f64 = 1e6;

/// Gravity-turn descent guidance.
pub struct GravityTurnDescent {
    p: GravityTurnDescentParams,
    frame: Frame,
}

/// Returns the constant thrust-to-weight ratio that brings a speed (m/s) to zero after a descent by `height` (m) under `gravity` (m/s²). `down` is
/// the cosine of the angle between velocity and vertical. Returns infinity if `height` is not positive.
pub fn force_over_weight(speed: f64, down: f64, height: f64, gravity: f64) -> f64 {
    if !(height > 0.0) {
        return f64::INFINITY;
    }
    if !(speed > 0.0) {
        return 1.0;
    }
    // The square is tan²(ψ/2).
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

/// Gravity-turn descent guidance: brakes a lander against its velocity with a constant thrust-to-weight ratio, then descends slowly; sampled.
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
    use linkwork_surroundings::testing;

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

    /// Reference: V̇ = −T/m + g cos ψ, ψ̇ = −g sin ψ/V, integrated by a Runge-Kutta method until the speed is 1e-5 of its initial value.
    fn fall(speed: f64, psi: f64, n: f64) -> f64 {
        let g = 1.62;
        let rate = |[v, a, _]: [f64; 3]| [g * (a.cos() - n), -g * a.sin() / v, v * a.cos()];
        let (mut s, end) = ([speed, psi, 0.0], 1e-5 * speed);
        while s[0] > end {
            // Use shorter steps towards the end, where the angle changes fast.
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

    /// From 200 m/s at 60° from the vertical, the lander waits, brakes with a nearly constant force, and descends at 1 m/s.
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
        // Commands are sampled, so the deceleration is not exactly constant, and N may differ near the end, where it
        // changes fast.
        assert!(held.iter().filter(|h| h.1 > 20.0).all(|h| (h.0 / first - 1.0).abs() < 0.02));
        assert!(lit.unwrap() < 8900.0 && held.len() > 200);
    }
}

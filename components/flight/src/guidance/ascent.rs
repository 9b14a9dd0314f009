//! `flight.linear_tangent`: closed-loop guidance of an ascent: thrust direction with which height and speeds are reached at burnout.
//! ```text
//! flat, uniform gravity g, x along, z up; T/m = a(t) = v_e/(τ − t), τ = v_e/a₀ (time to burn everything)
//! direction  tan θ = A + B t: the fuel-optimal one                        sin θ ≈ A + B t for small angles
//! b₀ = ∫a = −v_e ln(1 − T/τ)       b₁ = ∫t a = b₀ τ − v_e T       c₀ = b₀ T − b₁       c₁ = c₀ τ − v_e T²/2
//! v_z(T) = v_z + A b₀ + B b₁ − g_eff T          z(T) = z + v_z T + A c₀ + B c₁ − g_eff T²/2
//! g_eff = μ/r² − v_x²/r, the mean of now and burnout; T: burn time left, such that b₀ cos θ gives the speed that is missing
//! ```
//! (Powered explicit guidance in its plane.) The law is solved again at each sample; in the last seconds A and B are held.

use super::planet::inertial;
use crate::orbit::{body_mu, orbital};
use linkwork_surroundings::prelude::*;

/// Steering that reaches a height and a vertical speed: sin θ = A + B t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// A of sin θ = A + B t.
    pub a: f64,
    /// B of sin θ = A + B t, 1/s.
    pub b: f64,
    /// Burn time left, s.
    pub to_go: f64,
}

/// The state in the plane of an ascent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    /// Distance from the planet's centre, m.
    pub radius: f64,
    /// Speed upwards, m/s.
    pub up: f64,
    /// Speed along, inertial, m/s.
    pub along: f64,
}

/// Integrals b₀, b₁, c₀, c₁ of the thrust over `t`.
fn integrals(exhaust: f64, tau: f64, t: f64) -> [f64; 4] {
    let b0 = -exhaust * (-t / tau).ln_1p();
    let b1 = b0 * tau - exhaust * t;
    let c0 = b0 * t - b1;
    let c1 = c0 * tau - 0.5 * exhaust * t * t;
    [b0, b1, c0, c1]
}

/// Steering from `now` to `end` under `acceleration` (m/s²) of engines of `exhaust` velocity, around a planet of μ; `guess`: burn time of the last
/// sample. `None` if the engines cannot reach the end state before all propellant is burnt.
pub fn linear_tangent(
    now: &Plane,
    end: &Plane,
    (acceleration, exhaust): (f64, f64),
    mu: f64,
    guess: f64,
) -> Option<Steering> {
    let tau = exhaust / acceleration;
    let mut t = guess.clamp(1e-3, 0.99 * tau);
    let mut steering = None;
    for _ in 0..50 {
        let [b0, b1, c0, c1] = integrals(exhaust, tau, t);
        // Use the mean of the present and the final gravity, reduced by the centrifugal
        // acceleration of the horizontal velocity.
        let weight = |p: &Plane| mu / (p.radius * p.radius) - p.along * p.along / p.radius;
        let g = 0.5 * (weight(now) + weight(end).max(0.0));
        let dv = end.up - now.up + g * t;
        let dz = end.radius - now.radius - now.up * t + 0.5 * g * t * t;
        let determinant = b0 * c1 - b1 * c0;
        if !(determinant.abs() > 0.0) {
            return None;
        }
        let a = (dv * c1 - b1 * dz) / determinant;
        let b = (b0 * dz - c0 * dv) / determinant;
        steering = Some(Steering { a, b, to_go: t });
        // The pitch θ reduces the horizontal acceleration by cos θ. Compute the mean of cos θ over
        // the burn by Simpson's rule.
        let cos = |s: f64| (1.0 - (a + b * s).clamp(-0.99, 0.99).powi(2)).sqrt();
        let mean = (cos(0.0) + 4.0 * cos(0.5 * t) + cos(t)) / 6.0;
        let missing = (end.along - now.along) / mean;
        let next = tau * -(-missing / exhaust).exp_m1();
        if !(next > 0.0 && next < tau) {
            return None;
        }
        if (next - t).abs() < 1e-9 * tau {
            return steering;
        }
        t = next;
    }
    steering
}

/// Orbit to reach, and engines.
#[derive(Params, Clone, Debug)]
pub struct TangentParams {
    /// Distance from the planet's centre at burnout.
    #[param(unit = "m", range = 1.0..)]
    pub radius: f64,
    /// Speed upwards at burnout.
    #[param(unit = "m/s", default = 0.0)]
    pub up: f64,
    /// Horizontal inertial speed at burnout.
    #[param(unit = "m/s", range = 0.0..)]
    pub along: f64,
    /// Thrust.
    #[param(unit = "N", range = 1e-9..)]
    pub thrust: f64,
    /// Specific impulse.
    #[param(unit = "s", range = 1e-3..)]
    pub specific_impulse: f64,
    /// Time before burnout from which on the steering is held.
    #[param(unit = "s", default = 5.0, range = 0.0..)]
    pub freeze: f64,
    /// The world, about whose body the orbit is.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// State and mass of the vehicle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TangentIn {
    /// The vehicle.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Its mass.
    #[port("kg")]
    pub mass: f64,
}

/// Commanded force and status.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TangentOut {
    /// Commanded force, W; zero after burnout.
    #[port("N")]
    pub force: Vec3,
    /// Angle of the thrust above the horizon.
    #[port("rad")]
    pub pitch: f64,
    /// Remaining burn time.
    #[port("s")]
    pub to_go: f64,
    /// The law has no solution, and the last steering continues.
    #[port]
    pub lost: bool,
}

/// The last solution.
#[derive(State, Clone, Copy, Debug)]
pub struct Solved {
    /// A of sin θ = A + B t, t from `since`.
    #[port("1")]
    pub a: f64,
    /// B of sin θ = A + B t.
    #[port("1/s")]
    pub b: f64,
    /// Time of burnout; 0: not solved yet.
    #[port("s")]
    pub burnout: f64,
    /// Time of the last solution.
    #[port("s")]
    pub since: f64,
    /// The last sample found no solution.
    #[port]
    pub lost: bool,
}

/// Closed-loop ascent.
pub struct LinearTangent {
    p: TangentParams,
    mu: f64,
    site: Option<Site>,
}

impl LinearTangent {
    /// The solution of this sample, or else the continued last one.
    fn solve(&self, c: &Clock, d: &Solved, u: &TangentIn) -> Solved {
        let p = &self.p;
        let left = d.burnout - c.t;
        if d.burnout > 0.0 && left < p.freeze {
            return *d;
        }
        let (r, v) = inertial(self.site.as_ref(), &u.body);
        let radius = r.norm();
        let up = r / radius;
        let rise = v.dot(&up);
        let along = (v - up * rise).norm();
        let now = Plane { radius, up: rise, along };
        let end = Plane { radius: p.radius, up: p.up, along: p.along };
        let engines = (p.thrust / u.mass, p.specific_impulse * 9.80665);
        let guess = if d.burnout > 0.0 { left } else { 0.5 * engines.1 / engines.0 };
        match linear_tangent(&now, &end, engines, self.mu, guess) {
            Some(s) => Solved { a: s.a, b: s.b, burnout: c.t + s.to_go, since: c.t, lost: false },
            None => Solved { lost: true, ..*d },
        }
    }
}

/// Linear tangent steering of an ascent in the plane of its inertial motion; sampled.
#[model("flight.linear_tangent")]
impl Model for LinearTangent {
    type Params = TangentParams;
    type FeedthroughInputs = TangentIn;
    type FeedthroughOutputs = TangentOut;
    type DiscreteState = Solved;
    fn build(p: TangentParams) -> Result<Self, BuildError> {
        let (mu, site) = (body_mu(&p.world)?, orbital(&p.world)?);
        Ok(LinearTangent { p, mu, site })
    }
    fn feedthrough(&self, clock: &Clock, d: &Solved, u: &TangentIn) -> TangentOut {
        let s = self.solve(clock, d, u);
        let (r, v) = inertial(self.site.as_ref(), &u.body);
        let up = r.normalize();
        let across = v - up * v.dot(&up);
        let to_go = s.burnout - clock.t;
        // A vehicle without horizontal velocity does not have an orbital plane yet, so it thrusts
        // straight up.
        let (sine, along) = if across.norm() > 1e-9 {
            ((s.a + s.b * (clock.t - s.since)).clamp(-1.0, 1.0), across.normalize())
        } else {
            (1.0, Vec3::zeros())
        };
        // Command no force before the first solution and after burnout.
        let over = s.burnout <= 0.0 || to_go <= 0.0;
        let direction = up * sine + along * (1.0 - sine * sine).max(0.0).sqrt();
        let force = if over { Vec3::zeros() } else { direction * self.p.thrust };
        TangentOut { force, pitch: sine.asin(), to_go: to_go.max(0.0), lost: s.lost }
    }
    fn update(&self, clock: &Clock, d: &Solved, u: &TangentIn) -> Solved {
        self.solve(clock, d, u)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::PlainWorld;

    const MU: f64 = 3.986_004_418e14;

    fn law(radius: f64, along: f64, site: Option<Site>) -> LinearTangent {
        let world = match site {
            Some(site) => PlainWorld::of_site(MU, 6_378_137.0, site),
            None => PlainWorld::inertial(MU, 6_378_137.0, 7.292e-5),
        };
        LinearTangent::build(TangentParams {
            radius,
            up: 0.0,
            along,
            thrust: 950e3,
            specific_impulse: 348.0,
            freeze: 5.0,
            world: world.handle(),
        })
        .unwrap()
    }

    #[test]
    fn it_pushes_alike_in_inertial_axes_and_from_a_site() {
        let turn = Quat::from_euler_angles(0.3, -0.8, 1.1);
        let pose = linkwork_spatial::Pose::new(turn, Vec3::new(3e6, -4e6, 3.9e6));
        let site = Site { pose, rate: 7.292e-5, start: Quat::identity() };
        let (radius, along) = (6_378_137.0 + 200e3, 7784.0);
        let body = NodeState {
            position: Vec3::new(4e5, 2e4, 9e4),
            velocity: Vec3::new(3500.0, 120.0, 700.0),
            ..NodeState::identity()
        };
        let p = site.to_planet(&body.position);
        let v = turn * body.velocity + (Vec3::z() * site.rate).cross(&p);
        let seen = NodeState { position: p, velocity: v, ..NodeState::identity() };
        let c = Clock::at(0.0, 1.0, 0);
        let push = |m: LinearTangent, body: NodeState| {
            let (u, d) = (
                TangentIn { body, mass: 92e3 },
                Solved { a: 0.0, b: 0.0, burnout: 0.0, since: 0.0, lost: false },
            );
            m.feedthrough(&c, &d, &u)
        };
        let here = push(law(radius, along, Some(site)), body);
        let there = push(law(radius, along, None), seen);
        assert!(!here.lost && here.force.norm() > 9e5);
        assert!(
            (turn * here.force - there.force).norm() < 1e-4
                && (here.to_go - there.to_go).abs() < 1e-8
        );
    }

    /// An upper stage guided every second, in the plane, around a round Earth: the orbit that it reaches.
    #[test]
    fn an_upper_stage_reaches_its_orbit() {
        let radius = 6_378_137.0 + 200e3;
        let along = (MU / radius).sqrt();
        let (isp, thrust) = (348.0, 950e3);
        let m = law(radius, along, None);
        let mut r = Vec3::new(0.0, 0.0, 6_378_137.0 + 120e3);
        let mut v = Vec3::new(4200.0, 0.0, 900.0);
        let mut mass = 92_000.0;
        let mut d = Solved { a: 0.0, b: 0.0, burnout: 0.0, since: 0.0, lost: false };
        let h = 0.02;
        let mut t = 0.0;
        let mut over = false;
        for k in 0..40_000 {
            let body = NodeState { position: r, velocity: v, ..NodeState::identity() };
            let u = TangentIn { body, mass };
            let c = Clock::at(t, h, 0);
            if k % 50 == 0 {
                d = m.update(&c, &d, &u);
                assert!(!d.lost, "{t} s");
            }
            let y = m.feedthrough(&c, &d, &u);
            if y.to_go <= 0.0 {
                over = true;
                break;
            }
            let step = h.min(y.to_go);
            // The force rotates slowly, so keep it constant within the step, and use a mean of
            // gravity.
            let a = |r: &Vec3| r * (-MU / r.norm().powi(3)) + y.force / mass;
            let half = r + v * (0.5 * step) + a(&r) * (0.125 * step * step);
            let mean = a(&half);
            r += v * step + mean * (0.5 * step * step);
            v += mean * step;
            mass -= thrust / (isp * 9.80665) * step;
            t += step;
        }
        assert!(over && mass > 14_000.0, "{t} s, {mass} kg");
        let up = r.normalize();
        let (height, rise) = (r.norm() - radius, v.dot(&up));
        let speed = (v - up * rise).norm() - along;
        println!("burnout at {t:.2} s: {height:.1} m, {rise:.3} m/s up, {speed:.3} m/s along");
        assert!(height.abs() < 300.0 && rise.abs() < 5.0 && speed.abs() < 3.0);
    }

    #[test]
    fn what_cannot_be_reached_is_told() {
        let now = Plane { radius: 6.5e6, up: 0.0, along: 1000.0 };
        let end = Plane { radius: 6.6e6, up: 0.0, along: 7800.0 };
        // With an exhaust velocity of 100 m/s, 6800 m/s cannot be gained before the last second of
        // the propellant.
        let s = linear_tangent(&now, &end, (10.0, 100.0), MU, 5.0);
        assert!(s.is_none_or(|s| s.to_go > 0.999 * 10.0), "{s:?}");
        assert_eq!(linear_tangent(&end, &now, (10.0, 3000.0), MU, 5.0), None, "braking");
    }

    #[test]
    fn integrals_are_those_of_a_rocket() {
        let (ve, tau, t) = (3400.0, 300.0, 120.0);
        let [b0, b1, c0, c1] = integrals(ve, tau, t);
        let n = 200_000;
        let h = t / f64::from(n);
        let (mut s, mut moment, mut way, mut lever, mut speed, mut gain) =
            (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for k in 0..n {
            let x = (f64::from(k) + 0.5) * h;
            let a = ve / (tau - x);
            s += a * h;
            moment += x * a * h;
            way += (speed + 0.5 * a * h) * h;
            lever += (gain + 0.5 * x * a * h) * h;
            speed += a * h;
            gain += x * a * h;
        }
        for (found, want) in [(b0, s), (b1, moment), (c0, way), (c1, lever)] {
            assert!((found / want - 1.0).abs() < 1e-7, "{found} {want}");
        }
    }
}

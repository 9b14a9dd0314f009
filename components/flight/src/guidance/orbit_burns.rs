//! `flight.orbit_burns`: executes a sequence of orbital maneuvers (finite burns).
//! ```text
//! when    at a time, or at the next periapsis, apoapsis, ascending or descending node; the burn is centred on it: it begins
//!         Δt/2 before, Δt = m v_g/F
//! what    `delta_v`      (radial, along the motion, normal) as it will stand in the middle, m/s
//!         `opposite`     radius r₂ of the apsis on the other side:  v_w = √(2 μ (1/r − 1/(r + r₂))) horizontally ahead
//!         `inclination`  the horizontal velocity turned about the vertical to i:  sin A = cos i/cos φ
//! v_g = v_w − v (closed loop), or Δv less what has been felt:  Δv_felt = v_k − v_(k−1) − g Δt, g in the middle
//! F along v_g, at most `thrust`; a sample in which less does is the last one of its burn:  F = min(`thrust`, m v_g/Δt)
//! ```
//! The planet is at the origin of W, or W is a site on it. Apsides and nodes refer to the osculating ellipse.

use super::planet::inertial;
use crate::orbit::{body_mu, orbital};
use linkwork_surroundings::prelude::*;
use std::f64::consts::TAU;

/// Point on the orbit.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Point closest to the planet.
    Periapsis,
    /// Point farthest from the planet.
    Apoapsis,
    /// Northward crossing of the equator.
    AscendingNode,
    /// Southward crossing of the equator.
    DescendingNode,
}

/// One burn. Write one of `time` and `at`, and one of `delta_v`, `opposite` and `inclination`.
#[derive(Params, Clone, Debug)]
pub struct Burn {
    /// Time of the middle of the burn.
    #[param(unit = "s")]
    pub time: Option<f64>,
    /// Point of the orbit at the middle of the burn.
    pub at: Option<Place>,
    /// Velocity change: radial, along the motion, normal to the orbit, in the axes at the middle of the burn.
    #[param(unit = "m/s")]
    pub delta_v: Option<Vec3>,
    /// Target radius of the opposite apsis.
    #[param(unit = "m", range = 1.0..)]
    pub opposite: Option<f64>,
    /// Target inclination.
    #[param(unit = "rad", range = 0.0..=3.15)]
    pub inclination: Option<f64>,
}

/// Burns and engine.
#[derive(Params, Clone, Debug)]
pub struct OrbitBurnParams {
    /// Burns in the order of execution.
    #[param(default = Vec::new())]
    pub burns: Vec<Burn>,
    /// Thrust of the engine.
    #[param(unit = "N", range = 1e-9..)]
    pub thrust: f64,
    /// The world, whose body the orbit is about.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// The spacecraft.
#[derive(Ports, Clone, Copy, Debug)]
pub struct OrbitBurnIn {
    /// Estimated state of the spacecraft from navigation, W.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Mass of the spacecraft.
    #[port("kg")]
    pub mass: f64,
}

/// Force command and status.
#[derive(Ports, Clone, Copy, Debug)]
pub struct OrbitBurnOut {
    /// Commanded force, W; zero between burns.
    #[port("N")]
    pub force: Vec3,
    /// Direction of the present or next burn for the present state, W; zero after the last burn.
    #[port("1")]
    pub direction: Vec3,
    /// A burn is in progress.
    #[port]
    pub burning: bool,
    /// Velocity to be gained v_g in the present or next burn.
    #[port("m/s")]
    pub to_gain: f64,
    /// Time until the next burn begins; 0 during a burn and after the last one.
    #[port("s")]
    pub to_go: f64,
    /// Number of completed burns.
    #[port("1")]
    pub done: f64,
}

/// Progress of the sequence.
#[derive(State, Clone, Copy, Debug)]
pub struct Plan {
    /// Number of completed burns.
    #[port("1")]
    pub done: f64,
    /// A burn is in progress.
    #[port]
    pub burning: bool,
    /// With `delta_v`: remaining velocity change, along non-rotating axes that coincide with W at this sample.
    #[port("m/s")]
    pub left: Vec3,
    /// Horizontal speed at the beginning of the burn.
    #[port("m/s")]
    pub level: f64,
    /// Inertial velocity at the last sample.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Gravity at the last sample.
    #[port("m/s^2")]
    pub pull: Vec3,
    /// Time until the next burn at the last sample.
    #[port("s")]
    pub to_go: f64,
}

/// Sequence of orbital maneuvers.
pub struct OrbitBurns {
    p: OrbitBurnParams,
    mu: f64,
    site: Option<Site>,
    /// Pole of the planet in W: at t = 0 if W is inertial, constant at a site.
    pole: Vec3,
}

/// Returns unit vectors: radial, along the motion (horizontal), normal; `None` for vertical motion.
fn axes(r: &Vec3, v: &Vec3) -> Option<[Vec3; 3]> {
    let h = r.cross(v);
    if !(h.norm() > 0.0) {
        return None;
    }
    let (x, z) = (r.normalize(), h.normalize());
    Some([x, z.cross(&x), z])
}

/// Returns the time (s) until a point of the osculating ellipse is reached; nodes are on the equator of a planet with the given `pole`. Returns
/// `None` on a parabola or hyperbola, and for nodes of an equatorial orbit.
pub fn time_to(place: Place, (r, v): (&Vec3, &Vec3), mu: f64, pole: &Vec3) -> Option<f64> {
    let h = r.cross(v);
    let energy = 0.5 * v.norm_squared() - mu / r.norm();
    if !(energy < 0.0) || !(h.norm() > 0.0) {
        return None;
    }
    let a = -0.5 * mu / energy;
    let eccentric = v.cross(&h) / mu - r / r.norm();
    let e = eccentric.norm();
    // On a circle every point is an apsis; use the present position.
    let toward = if e > 1e-12 { eccentric / e } else { r.normalize() };
    let across = h.normalize().cross(&toward);
    let mean = |direction: &Vec3| {
        let true_anomaly = direction.dot(&across).atan2(direction.dot(&toward));
        let half = ((1.0 - e) / (1.0 + e)).max(0.0).sqrt() * (0.5 * true_anomaly).tan();
        let anomaly = 2.0 * half.atan();
        anomaly - e * anomaly.sin()
    };
    let node = pole.cross(&h);
    let there = match place {
        Place::Periapsis => toward,
        Place::Apoapsis => -toward,
        Place::AscendingNode | Place::DescendingNode if !(node.norm() > 1e-12 * h.norm()) => {
            return None;
        }
        Place::AscendingNode => node,
        Place::DescendingNode => -node,
    };
    let rate = (mu / (a * a * a)).sqrt();
    // A small negative difference would give a whole revolution.
    let turn = mean(&there) - mean(r);
    let turn = if turn.abs() < 1e-13 { 0.0 } else { turn.rem_euclid(TAU) };
    Some(turn / rate)
}

impl OrbitBurns {
    /// Returns the velocity to be gained, m/s. `begun` is the horizontal speed (m/s) at the beginning of the burn; default: the present one.
    fn wanted(
        &self,
        burn: &Burn,
        (r, v, mass): (&Vec3, &Vec3, f64),
        begun: Option<f64>,
    ) -> Option<Vec3> {
        let [radial, ahead, normal] = axes(r, v)?;
        if let Some(dv) = burn.delta_v {
            let half = 0.5 * mass * dv.norm() / self.p.thrust;
            let (sine, cosine) = (ahead.dot(v) / r.norm() * half).sin_cos();
            let out = radial * cosine + ahead * sine;
            return Some(out * dv.x + normal.cross(&out) * dv.y + normal * dv.z);
        }
        let radius = r.norm();
        if let Some(other) = burn.opposite {
            let speed = (2.0 * self.mu * (1.0 / radius - 1.0 / (radius + other))).sqrt();
            return Some(ahead * speed - v);
        }
        let inclination = burn.inclination?;
        let rise = v.dot(&radial);
        let level = v - radial * rise;
        let east = self.pole.cross(&radial);
        if !(east.norm() > 1e-9) {
            return None;
        }
        let (east, north) = (east.normalize(), radial.cross(&east.normalize()));
        let cos_latitude = self.pole.cross(&radial).norm();
        let sine = (inclination.cos() / cos_latitude).clamp(-1.0, 1.0);
        let cosine = (1.0 - sine * sine).sqrt() * level.dot(&north).signum();
        Some((east * sine + north * cosine) * begun.unwrap_or(level.norm()) - level)
    }

    fn until(&self, burn: &Burn, t: f64, r: &Vec3, v: &Vec3) -> Option<f64> {
        match (burn.time, burn.at) {
            (Some(time), _) => Some(time - t),
            (_, Some(place)) => time_to(place, (r, v), self.mu, &self.pole),
            _ => None,
        }
    }

    fn decide(&self, c: &Clock, d: &Plan, u: &OrbitBurnIn) -> (Plan, OrbitBurnOut) {
        let p = &self.p;
        let (r, v) = inertial(self.site.as_ref(), &u.body);
        let place = &u.body.position;
        let turning = self.site.as_ref().map_or_else(Vec3::zeros, |s| s.centrifugal(place));
        let pull = p.gravity.acceleration(c.t, *place) - turning;
        let mut next = Plan { velocity: v, pull, to_go: 0.0, ..*d };
        let mut out = OrbitBurnOut {
            force: Vec3::zeros(),
            direction: Vec3::zeros(),
            burning: false,
            to_gain: 0.0,
            to_go: 0.0,
            done: d.done,
        };
        let Some(burn) = p.burns.get(d.done as usize) else {
            next.burning = false;
            return (next, out);
        };
        // Velocity change by thrust since the last sample; the axes of W have rotated in the meantime.
        if d.burning && burn.delta_v.is_some() {
            let back = self
                .site
                .as_ref()
                .map_or_else(Quat::identity, |s| Quat::from_scaled_axis(-s.omega() * c.dt));
            let felt = v - back * d.velocity - (pull + back * d.pull) * (0.5 * c.dt);
            next.left = back * d.left - felt;
        }
        let gain = match d.burning && burn.delta_v.is_some() {
            true => Some(next.left),
            false => self.wanted(burn, (&r, &v, u.mass), d.burning.then_some(d.level)),
        };
        let Some(gain) = gain else { return (next, out) };
        let size = gain.norm();
        (out.to_gain, out.direction) = (size, if size > 0.0 { gain / size } else { Vec3::zeros() });
        if !d.burning {
            let before = 0.5 * u.mass * size / p.thrust;
            let Some(until) = self.until(burn, c.t, &r, &v) else { return (next, out) };
            let go = until - before;
            next.to_go = go;
            // If the point has just been passed, the time to it jumps to a whole revolution, while the last time was short. The burn then begins at
            // once.
            let missed =
                burn.at.is_some() && go > d.to_go + 1.0 && d.to_go > 0.0 && d.to_go <= c.dt;
            if go > 0.5 * c.dt && !missed {
                out.to_go = go;
                return (next, out);
            }
            next.left = gain;
            next.level = (v - r * (v.dot(&r) / r.norm_squared())).norm();
        }
        let whole = u.mass * size / c.dt.max(1e-12);
        (out.burning, out.force) = (true, out.direction * whole.min(p.thrust));
        next.burning = whole > p.thrust;
        next.done = if next.burning { d.done } else { d.done + 1.0 };
        (next, out)
    }
}

/// Executes a sequence of orbital maneuvers at times, apsides and nodes as finite burns; sampled.
#[model("flight.orbit_burns")]
impl Model for OrbitBurns {
    type Params = OrbitBurnParams;
    type FeedthroughInputs = OrbitBurnIn;
    type FeedthroughOutputs = OrbitBurnOut;
    type DiscreteState = Plan;
    fn build(p: OrbitBurnParams) -> Result<Self, BuildError> {
        for (k, b) in p.burns.iter().enumerate() {
            let refuse = |fact: &str, help: &str| {
                Err(BuildError::new(format!("burn {}: {fact}", k + 1)).help(help).at("burns"))
            };
            if b.time.is_some() == b.at.is_some() {
                return refuse(
                    "exactly one of `time` and `at` must be written",
                    "remove or add one of them",
                );
            }
            let whats = [b.delta_v.is_some(), b.opposite.is_some(), b.inclination.is_some()];
            if whats.iter().filter(|w| **w).count() != 1 {
                return refuse(
                    "exactly one of `delta_v`, `opposite` and `inclination` must be written",
                    "remove or add one of them",
                );
            }
        }
        if p.burns
            .windows(2)
            .any(|w| matches!((w[0].time, w[1].time), (Some(a), Some(b)) if b <= a))
        {
            return Err(BuildError::new("burn times must be strictly increasing")
                .help("sort them by `time`")
                .at("burns"));
        }
        let (mu, site) = (body_mu(&p.world)?, orbital(&p.world)?);
        let pole = p.world.planet_axes(0.0) * Vec3::z();
        Ok(OrbitBurns { p, mu, site, pole })
    }
    fn feedthrough(&self, clock: &Clock, d: &Plan, u: &OrbitBurnIn) -> OrbitBurnOut {
        self.decide(clock, d, u).1
    }
    fn update(&self, clock: &Clock, d: &Plan, u: &OrbitBurnIn) -> Plan {
        self.decide(clock, d, u).0
    }
    fn startup_warnings(&self, clock: &Clock, d: &Plan, u: &OrbitBurnIn) -> Vec<BuildError> {
        let (r, v) = inertial(self.site.as_ref(), &u.body);
        let Some(burn) = self.p.burns.get(d.done as usize) else { return Vec::new() };
        let told = match (burn.time, burn.at) {
            (Some(time), _) if time < clock.t => Some((
                format!(
                    "burn {}: its time, {time} s, is before the present time {} s; the burn begins at once",
                    d.done + 1.0,
                    clock.t
                ),
                "write a later `time`",
            )),
            (_, Some(place)) if time_to(place, (&r, &v), self.mu, &self.pole).is_none() => Some((
                format!(
                    "burn {}: the orbit has no {place:?} at present; the burn waits until it has one",
                    d.done + 1.0
                ),
                "write a `time`, or begin on an inclined ellipse",
            )),
            _ => None,
        };
        told.map(|(fact, help)| BuildError::new(fact).help(help).at("burns")).into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::planet::tests::Point;
    use super::*;
    use linkwork_surroundings::PlainWorld;
    use std::sync::Arc;

    const MU: f64 = 3.986_004_418e14;

    fn plan(burns: Vec<Burn>, thrust: f64) -> Result<OrbitBurns, BuildError> {
        leaning(burns, thrust, Quat::identity())
    }

    /// World with a planet whose axes are rotated in W.
    fn leaning(burns: Vec<Burn>, thrust: f64, start: Quat) -> Result<OrbitBurns, BuildError> {
        let point = Point { mu: MU, site: None };
        OrbitBurns::build(OrbitBurnParams {
            burns,
            thrust,
            world: PlainWorld { start, ..PlainWorld::inertial(MU, 6_378_137.0, 7.292e-5) }.handle(),
            gravity: Handle::new("gravity", Arc::new(point) as Arc<dyn Gravity>),
        })
    }

    fn burn() -> Burn {
        Burn { time: None, at: None, delta_v: None, opposite: None, inclination: None }
    }

    /// Integrates a spacecraft of 1000 kg (constant mass) by a Runge-Kutta method until all burns are completed.
    fn fly(m: &OrbitBurns, mut r: Vec3, mut v: Vec3, dt: f64) -> (Vec3, Vec3, f64, f64) {
        let (mut d, mut t, mut spent) = (Plan::zero(), 0.0, 0.0);
        while (d.done as usize) < m.p.burns.len() {
            let body = NodeState { position: r, velocity: v, ..NodeState::identity() };
            let u = OrbitBurnIn { body, mass: 1000.0 };
            let c = Clock::at(t, dt, 0);
            let y = m.feedthrough(&c, &d, &u);
            d = m.update(&c, &d, &u);
            let push = y.force / 1000.0;
            spent += push.norm() * dt;
            let a = |r: &Vec3| r * (-MU / r.norm().powi(3)) + push;
            let (k1v, k1r) = (a(&r), v);
            let (k2v, k2r) = (a(&(r + k1r * (0.5 * dt))), v + k1v * (0.5 * dt));
            let (k3v, k3r) = (a(&(r + k2r * (0.5 * dt))), v + k2v * (0.5 * dt));
            let (k4v, k4r) = (a(&(r + k3r * dt)), v + k3v * dt);
            r += (k1r + (k2r + k3r) * 2.0 + k4r) * (dt / 6.0);
            v += (k1v + (k2v + k3v) * 2.0 + k4v) * (dt / 6.0);
            t += dt;
            assert!(t < 2e5, "burn {} never ends", d.done + 1.0);
        }
        (r, v, t, spent)
    }

    fn circular(radius: f64, inclination: f64) -> (Vec3, Vec3) {
        let along = Vec3::new(0.0, inclination.cos(), inclination.sin());
        (Vec3::x() * radius, along * (MU / radius).sqrt())
    }

    /// Transfer from a circular orbit at 300 km to the geostationary orbit: 2.4257 and 1.4668 km/s by impulses.
    #[test]
    fn two_burns_make_hohmanns_transfer() {
        let (low, high) = (6_678_137.0, 42_164_000.0);
        let first = Burn { time: Some(600.0), opposite: Some(high), ..burn() };
        let second = Burn { at: Some(Place::Apoapsis), opposite: Some(high), ..burn() };
        let m = plan(vec![first, second], 50_000.0).unwrap();
        let (r, v) = circular(low, 0.4);
        let (r, v, t, spent) = fly(&m, r, v, 0.5);
        let transfer = 0.5 * (low + high);
        let speed = |r: f64, a: f64| (MU * (2.0 / r - 1.0 / a)).sqrt();
        let impulses =
            speed(low, transfer) - speed(low, low) + speed(high, high) - speed(high, transfer);
        let half = std::f64::consts::PI * (transfer.powi(3) / MU).sqrt();
        println!("{spent} m/s for {impulses}, {t} s for {}", 600.0 + half);
        // An acceleration of 50 m/s² for 48 s is nearly an impulse. The faster spacecraft would
        // climb, but is kept horizontal.
        assert!((0.0..6e-3).contains(&(spent / impulses - 1.0)));
        assert!((t - 600.0 - half).abs() < 120.0);
        assert!((r.norm() / high - 1.0).abs() < 2e-3, "{}", r.norm());
        let e = (v.cross(&r.cross(&v)) / MU - r.normalize()).norm();
        assert!(e < 1e-5, "{e}");
    }

    #[test]
    fn an_inclination_is_turned_at_the_node() {
        let turn = Burn { at: Some(Place::DescendingNode), inclination: Some(0.2), ..burn() };
        let m = plan(vec![turn], 80_000.0).unwrap();
        let (r, v) = circular(7e6, 0.5);
        let (r, v, t, spent) = fly(&m, r, v, 0.5);
        let h = r.cross(&v);
        assert!(((h.z / h.norm()).acos() - 0.2).abs() < 1e-6);
        let impulse = 2.0 * (MU / 7e6f64).sqrt() * 0.15f64.sin();
        assert!((spent / impulse - 1.0).abs() < 2e-3, "{spent} for {impulse}");
        let half = std::f64::consts::PI * (7e6f64.powi(3) / MU).sqrt();
        assert!((t - half).abs() < 25.0, "{t}");
    }

    /// Inclinations and nodes refer to the equator of the planet: rotating planet and orbit together gives the same result.
    #[test]
    fn the_equator_is_that_of_the_planet() {
        let lean = Quat::from_euler_angles(0.4, -0.7, 1.2);
        let turn = || Burn { at: Some(Place::DescendingNode), inclination: Some(0.2), ..burn() };
        let (r, v) = circular(7e6, 0.5);
        let (r0, v0, t0, spent) = fly(&plan(vec![turn()], 8000.0).unwrap(), r, v, 0.5);
        let m = leaning(vec![turn()], 8000.0, lean).unwrap();
        let (r1, v1, t1, same) = fly(&m, lean * r, lean * v, 0.5);
        assert!((lean * r0 - r1).norm() < 1e-3 && (lean * v0 - v1).norm() < 1e-6, "{r1} {v1}");
        assert!(t0 == t1 && (spent - same).abs() < 1e-6, "{t0} {t1}");
        let h = r1.cross(&v1).normalize();
        assert!(
            (h.dot(&(lean * Vec3::z())).acos() - 0.2).abs() < 1e-5
                && (h.z.acos() - 0.2).abs() > 0.1
        );
        let go =
            |place, turn: Quat| time_to(place, (&(turn * r), &(turn * v)), MU, &(turn * Vec3::z()));
        let (a, b) = (go(Place::DescendingNode, Quat::identity()), go(Place::DescendingNode, lean));
        assert!((a.unwrap() - b.unwrap()).abs() < 1e-6);
    }

    /// Level ground is rejected, because burns need an orbit.
    #[test]
    fn level_ground_is_refused() {
        let site = Site {
            pose: linkwork_spatial::Pose::new(Quat::identity(), Vec3::z() * 6.4e6),
            rate: 7e-5,
            start: Quat::identity(),
        };
        let gravity = Arc::new(Point { mu: MU, site: None }) as Arc<dyn Gravity>;
        let level = PlainWorld { axes: Axes::Level(site), ..PlainWorld::inertial(MU, 6.4e6, 0.0) };
        let built = OrbitBurns::build(OrbitBurnParams {
            burns: vec![Burn { time: Some(9.0), opposite: Some(7e6), ..burn() }],
            thrust: 1.0,
            world: level.handle(),
            gravity: Handle::new("gravity", gravity),
        });
        let e = built.err().unwrap();
        assert!(e.message.contains("makes the ground level") && e.help.is_some(), "{}", e.message);
    }

    #[test]
    fn a_vector_is_gained_as_it_stands_in_the_middle() {
        let dv = Vec3::new(3.0, -20.0, 7.0);
        let m = plan(vec![Burn { time: Some(1000.0), delta_v: Some(dv), ..burn() }], 1000.0);
        let m = m.unwrap();
        let (r, v) = circular(7e6, 0.5);
        let (r1, v1, t, spent) = fly(&m, r, v, 1.0);
        assert!((spent - dv.norm()).abs() < 1e-3, "{spent}");
        // The energy equals the energy after an impulse at the middle of the burn, except for the curvature of the trajectory (20 s of 5829 s,
        // squared).
        let energy = |r: &Vec3, v: &Vec3| 0.5 * v.norm_squared() - MU / r.norm();
        let speed = (MU / 7e6f64).sqrt();
        let want = -20.0 * speed + 0.5 * dv.norm_squared();
        let got = energy(&r1, &v1) - energy(&r, &v);
        assert!((got / want - 1.0).abs() < 1e-4, "{got} {want}");
        assert!((t - 1000.0 - 0.5 * dv.norm()).abs() < 3.0, "{t}");
    }

    #[test]
    fn times_to_places_are_keplers() {
        // The orbit has e = 0.3, a true anomaly of 1 rad, an inclination of 0.6, and its periapsis
        // 0.5 after the node.
        let (a, e, f, w) = (9e6, 0.3, 1.0_f64, 0.5_f64);
        let p = a * (1.0 - e * e);
        let turn =
            Quat::from_axis_angle(&Vec3::x_axis(), 0.6) * Quat::from_axis_angle(&Vec3::z_axis(), w);
        let r = turn * Vec3::new(f.cos(), f.sin(), 0.0) * (p / (1.0 + e * f.cos()));
        let v = turn * Vec3::new(-f.sin(), e + f.cos(), 0.0) * (MU / p).sqrt();
        let mean = |f: f64| {
            let s = 2.0 * (((1.0 - e) / (1.0 + e)).sqrt() * (0.5 * f).tan()).atan();
            s - e * s.sin()
        };
        let n = (MU / (a * a * a)).sqrt();
        let pi = std::f64::consts::PI;
        for (place, turn) in [
            (Place::Periapsis, TAU - mean(f)),
            (Place::Apoapsis, pi - mean(f)),
            (Place::AscendingNode, TAU + mean(-w) - mean(f)),
            (Place::DescendingNode, mean(pi - w) - mean(f)),
        ] {
            let got = time_to(place, (&r, &v), MU, &Vec3::z()).unwrap();
            assert!((got - turn / n).abs() < 1e-6, "{place:?}: {got} {}", turn / n);
        }
        assert!(time_to(Place::Apoapsis, (&r, &(v * 2.0)), MU, &Vec3::z()).is_none());
        let (r, v) = circular(7e6, 0.0);
        assert!(time_to(Place::AscendingNode, (&r, &v), MU, &Vec3::z()).is_none());
    }

    #[test]
    fn burns_without_a_when_or_a_what_are_refused() {
        let whole = Burn { time: Some(9.0), opposite: Some(7e6), ..burn() };
        for (burns, word) in [
            (vec![Burn { time: None, ..whole.clone() }], "`at`"),
            (vec![Burn { at: Some(Place::Apoapsis), ..whole.clone() }], "`at`"),
            (vec![Burn { inclination: Some(0.1), ..whole.clone() }], "`inclination`"),
            (vec![whole.clone(), whole], "strictly increasing"),
        ] {
            let e = plan(burns, 10.0).err().unwrap();
            assert!(e.message.contains(word) && e.param.as_deref() == Some("burns"), "{e:?}");
        }
    }
}

//! `flight.terminal_descent`: guidance force that brings a lander from its initial state to a slow, vertical descent over a target on the ground. The
//! target is chosen at the first sample.
//! ```text
//! place     that which is told (`aimed`), on the ground there; else under the lander, moved by v_h Δ/2 (as a constant deceleration takes it) and by `divert`
//! approach  a = quadratic law to r_T = place at `height`, v_T = ω × r_T − `speed` up, at Δ = `duration`
//! last      a = ω × (ω × r) − k² e_h − 2 k (v − v_T),  k = 1/`settle`: e_h is the way off the place's vertical
//! F = m (a − g), scaled into T_min … T_max with its direction
//! ```
//! The planet is at the origin of W and rotates about z, or W is a site on it; the law works in the planet's axes. The final descent begins `freeze`
//! before the end of the approach and continues until the part is removed.

use super::ground_motion::over;
use super::planet::Frame;
use super::powered_descent::{Target, commanded, quadratic, thrust_limits};
use linkwork_surroundings::prelude::*;

/// Target, times and limits.
#[derive(Params, Clone, Debug)]
pub struct TerminalDescentParams {
    /// Duration of the approach.
    #[param(unit = "s", range = 1e-3..)]
    pub duration: f64,
    /// Height above the ground at the end of the approach.
    #[param(unit = "m", default = 20.0)]
    pub height: f64,
    /// Descent speed at the end of the approach and after it.
    #[param(unit = "m/s", default = 0.75, range = 0.0..)]
    pub speed: f64,
    /// Distance east and north by which the target is moved, m; without a commanded `place`.
    #[param(default = [0.0, 0.0])]
    pub divert: [f64; 2],
    /// Time before the end of the approach at which the final descent begins.
    #[param(unit = "s", default = 2.0, range = 1e-3..)]
    pub freeze: f64,
    /// Time constant of the final descent.
    #[param(unit = "s", default = 2.0, range = 1e-3..)]
    pub settle: f64,
    /// Smallest force.
    #[param(unit = "N", default = 0.0, range = 0.0..)]
    pub thrust_min: f64,
    /// Greatest force.
    #[param(unit = "N", range = 0.0..)]
    pub thrust_max: f64,
    /// Distance of the ground from the planet's centre; default: the distance of the origin of the site W, or the equatorial radius.
    #[param(unit = "m", range = 1.0..)]
    pub ground_radius: Option<f64>,
    /// The world; without a world the ground is level.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
    /// Gravity.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// State of the lander, and an optional target.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TerminalDescentIn {
    /// The lander, W.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Mass of the lander.
    #[port("kg")]
    pub mass: f64,
    /// Target on the ground, W; read at the first sample.
    #[port("m", default = Vec3::zeros())]
    pub place: Vec3,
    /// Use `place` as the target.
    #[port(default = false)]
    pub aimed: bool,
}

/// Force command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TerminalDescentOut {
    /// Commanded force, W.
    #[port("N")]
    pub force: Vec3,
    /// Time to the end of the approach; negative after it.
    #[port("s")]
    pub to_go: f64,
    /// Horizontal distance from the target.
    #[port("m")]
    pub off: f64,
    /// The force was limited to its least or greatest value.
    #[port]
    pub limited: bool,
}

/// Target that was chosen at the first sample.
#[derive(State, Clone, Copy, Debug)]
pub struct Chosen {
    /// A target has been chosen.
    #[port]
    pub chosen: bool,
    /// Time at which the approach ends.
    #[port("s")]
    pub arrival: f64,
    /// Unit vector from the planet's centre to the target, axes of the planet; on level ground the position in W without its height (m).
    #[port("1")]
    pub place: Vec3,
    /// Distance of the ground at the target from the planet's centre; on level ground its height.
    #[port("m")]
    pub ground: f64,
}

/// Terminal descent guidance.
pub struct TerminalDescent {
    p: TerminalDescentParams,
    frame: Frame,
    radius: f64,
}

impl TerminalDescent {
    fn turned(&self, t: f64) -> Quat {
        Quat::from_scaled_axis(Vec3::z() * (self.frame.rate * t))
    }

    fn choose(&self, c: &Clock, d: &Chosen, u: &TerminalDescentIn) -> Chosen {
        if d.chosen {
            return *d;
        }
        let p = &self.p;
        let arrival = c.t + p.duration;
        if self.frame.is_level() {
            let axes = self.frame.level_axes(c.t, &u.body.position);
            let up: Vec3 = axes.column(2).into();
            let v = u.body.velocity;
            let along = (v - up * v.dot(&up)) * (0.5 * p.duration);
            let [east, north] = p.divert;
            let there = match u.aimed {
                true => u.place,
                false => u.body.position + along + axes * Vec3::new(east, north, 0.0),
            };
            let ground = if u.aimed { there.dot(&up) } else { 0.0 };
            let place = there - up * there.dot(&up);
            return Chosen { chosen: true, arrival, place, ground };
        }
        let back = self.turned(c.t).inverse();
        if u.aimed {
            let there = NodeState { position: u.place, ..u.body };
            let there = back * self.frame.node(&there).position;
            let ground = there.norm();
            return Chosen { chosen: true, arrival, place: there / ground, ground };
        }
        let body = self.frame.node(&u.body);
        let o = over(&body, self.frame.rate);
        let up = body.position.normalize();
        let along = (o.velocity - up * o.velocity.dot(&up)) * (0.5 * p.duration);
        let divert = o.R_WE * Vec3::new(p.divert[0], p.divert[1], 0.0);
        let place = (back * (body.position + along + divert)).normalize();
        Chosen { chosen: true, arrival, place, ground: self.radius }
    }
}

/// Terminal descent guidance: brings a lander to a slow vertical descent over a target that is chosen at the first sample; sampled.
#[model("flight.terminal_descent")]
impl Model for TerminalDescent {
    type Params = TerminalDescentParams;
    type FeedthroughInputs = TerminalDescentIn;
    type FeedthroughOutputs = TerminalDescentOut;
    type DiscreteState = Chosen;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let aimed = wired("aimed");
        let place = (wired("place") && !aimed).then(|| {
            BuildError::new("`aimed` has no wire, so the target below the lander is used")
                .help("wire `aimed`, for example to `found` of a hazard map")
        });
        vec![(Judge::Input("place"), place)]
    }
    fn build(p: TerminalDescentParams) -> Result<Self, BuildError> {
        thrust_limits(p.thrust_min, p.thrust_max)?;
        let frame = Frame::new(p.world.as_ref(), Some(&p.gravity))?;
        frame.of_a_planet(p.ground_radius, "ground_radius")?;
        let radius = p.ground_radius.unwrap_or_else(|| frame.ground_radius());
        Ok(TerminalDescent { p, frame, radius })
    }
    fn init_d(&self) -> Chosen {
        Chosen { chosen: false, arrival: 0.0, place: Vec3::x(), ground: 0.0 }
    }
    fn feedthrough(&self, clock: &Clock, d: &Chosen, u: &TerminalDescentIn) -> TerminalDescentOut {
        let p = &self.p;
        let body = self.frame.node(&u.body);
        let d = self.choose(clock, d, u);
        let (to_go, omega) = (d.arrival - clock.t, Vec3::z() * self.frame.rate);
        let (r, v) = (body.position, body.velocity);
        let level = self.frame.is_level();
        // Vertical directions at the target, now and at the end of the approach, and the origin of
        // the height.
        let [vertical, up] = match level {
            true => [self.frame.up(clock.t, &u.body.position); 2],
            false => [self.turned(clock.t) * d.place, self.turned(d.arrival) * d.place],
        };
        let foot = if level { d.place } else { Vec3::zeros() };
        let off = r - foot;
        let sideways = off - vertical * off.dot(&vertical);
        let a = if to_go > p.freeze - 1e-9 {
            let position = foot + up * (d.ground + p.height);
            let target = Target {
                position,
                velocity: omega.cross(&position) - up * p.speed,
                acceleration: omega.cross(&omega.cross(&position)),
            };
            quadratic(&r, &v, &target, to_go)
        } else {
            let k = 1.0 / p.settle;
            let off = v - (omega.cross(&r) - vertical * p.speed);
            omega.cross(&omega.cross(&r)) - sideways * (k * k) - off * (2.0 * k)
        };
        let falls = p.gravity.free_fall(clock.t, u.body.position, u.body.velocity);
        let a = self.frame.to_W(&a);
        let (force, limited) = commanded(&a, &falls, u.mass, (p.thrust_min, p.thrust_max));
        TerminalDescentOut { force, to_go, off: sideways.norm(), limited }
    }
    fn update(&self, clock: &Clock, d: &Chosen, u: &TerminalDescentIn) -> Chosen {
        self.choose(clock, d, u)
    }
    fn startup_warnings(&self) -> Vec<BuildError> {
        let p = &self.p;
        let none = p.freeze >= p.duration;
        let fact = format!(
            "`freeze` is {} s and `duration` {} s: the final descent begins at once, without an approach",
            p.freeze, p.duration
        );
        let help = "`freeze` must be less than `duration`";
        none.then(|| BuildError::new(fact).help(help).at("freeze")).into_iter().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::ground_motion::east_north_up;
    use super::*;
    use linkwork_surroundings::PlainWorld;
    use linkwork_surroundings::testing;
    use std::sync::Arc;

    const MU: f64 = 4.282_837e13;
    struct Point;
    impl Gravity for Point {
        fn acceleration(&self, _: f64, p: Vec3) -> Vec3 {
            p * (-MU / p.norm().powi(3))
        }
    }

    fn params() -> TerminalDescentParams {
        TerminalDescentParams {
            duration: 40.0,
            height: 20.0,
            speed: 0.75,
            divert: [200.0, -100.0],
            freeze: 2.0,
            settle: 2.0,
            thrust_min: 0.0,
            thrust_max: 25e3,
            ground_radius: Some(3.39e6),
            world: Some(PlainWorld::inertial(MU, 3.39e6, 7.088_218_1e-5).handle()),
            gravity: Handle::new("gravity", Arc::new(Point) as Arc<dyn Gravity>),
        }
    }

    /// Inputs without a commanded target.
    fn free(body: NodeState, mass: f64) -> TerminalDescentIn {
        TerminalDescentIn { body, mass, place: Vec3::zeros(), aimed: false }
    }

    /// The lander goes to the commanded target, at the height of the ground there.
    #[test]
    fn it_goes_to_the_place_that_it_is_told() {
        use super::super::planet::tests::Point as Around;
        let pose = linkwork_spatial::Pose::new(
            Quat::from_scaled_axis(Vec3::new(0.2, 0.5, -0.1)),
            Vec3::new(3.0e6, 1.0e6, 4e5),
        );
        for site in [None, Some(Site { pose, rate: 0.0, start: Quat::identity() })] {
            let gravity = Arc::new(Around { mu: MU, site }) as Arc<dyn Gravity>;
            let p = TerminalDescentParams {
                world: Some(match site {
                    Some(site) => PlainWorld::of_site(MU, 3.39e6, site).handle(),
                    None => PlainWorld::inertial(MU, 3.39e6, 0.0).handle(),
                }),
                gravity: Handle::new("gravity", gravity),
                ..params()
            };
            let m = TerminalDescent::build(p).unwrap();
            let from = |v: Vec3| {
                site.map_or(v, |s| {
                    s.around_planet(&NodeState { position: v, ..NodeState::identity() }).position
                })
            };
            let place = Vec3::new(3.1e6, -1.2e6, 5e5) * if site.is_some() { 1e-4 } else { 1.0 };
            let up = from(place).normalize();
            let up_W = site.map_or(up, |s| s.from_planet_axes(&up));
            let side = up_W.cross(&Vec3::x()).normalize();
            // The expected acceleration is the quadratic law evaluated by hand for a target at rest.
            let body = NodeState {
                position: place + up_W * 900.0 + side * 120.0,
                velocity: up_W * -60.0,
                ..NodeState::identity()
            };
            let u = TerminalDescentIn { place, aimed: true, ..free(body, 1000.0) };
            let (c, d) = (Clock::at(3.0, 0.1, 0), m.init_d());
            let y = m.feedthrough(&c, &d, &u);
            let want = ((up_W * (20.0 - 900.0) - side * 120.0) * 12.0 / 1600.0)
                - (up_W * (-0.75 - 60.0)) * 6.0 / 40.0;
            let pull = m.p.gravity.free_fall(3.0, body.position, body.velocity);
            assert!((y.force / 1000.0 + pull - want).norm() < 2e-6, "{} {want}", y.force / 1000.0);
            assert!((y.off - 120.0).abs() < 1e-2, "{}", y.off);
            let d = m.update(&c, &d, &u);
            // The target of the first sample is kept; later inputs have no effect.
            let later = TerminalDescentIn { place: Vec3::zeros(), aimed: false, ..u };
            assert_eq!(m.feedthrough(&c, &d, &later).force, y.force);
            assert!((d.ground - from(place).norm()).abs() < 1e-6);
        }
    }

    #[test]
    fn it_comes_down_slowly_over_its_place_on_ground_that_turns() {
        let m = TerminalDescent::build(params()).unwrap();
        let (mass, dt, rate) = (2200.0, 0.01, 7.088_218_1e-5);
        let up = Vec3::new(0.3, -0.8, 0.4).normalize();
        let mut r = up * (3.39e6 + 1600.0);
        let start = r;
        let mut v = (Vec3::z() * rate).cross(&r) + east_north_up(&r) * Vec3::new(20.0, 6.0, -80.0);
        let mut d = m.init_d();
        for row in 0..6000_u32 {
            let c = Clock::at(f64::from(row) * dt, dt, u64::from(row));
            let body = NodeState { position: r, velocity: v, ..NodeState::identity() };
            let u = free(body, mass);
            let y = m.feedthrough(&c, &d, &u);
            assert!(!y.limited, "{row}: {y:?}");
            d = m.update(&c, &d, &u);
            let a = |r: Vec3| y.force / mass + Point.acceleration(0.0, r);
            let middle = r + v * (0.5 * dt);
            r += v * dt + a(r) * (0.5 * dt * dt);
            v += a(middle) * dt;
        }
        let t = 60.0;
        let body = NodeState { position: r, velocity: v, ..NodeState::identity() };
        let local = east_north_up(&r).transpose() * over(&body, rate).velocity;
        assert!((local - Vec3::z() * -0.75).norm() < 2e-3, "{local}");
        // The height is 20 m at 40 s, and then it decreases for 20 s at 0.75 m/s.
        assert!((r.norm() - 3.39e6 - 5.0).abs() < 0.3, "{}", r.norm() - 3.39e6);
        let back = Quat::from_scaled_axis(Vec3::z() * (rate * t)).inverse() * r;
        let moved = east_north_up(&start).transpose() * (back - start);
        let want = Vec3::new(20.0 * 20.0 + 200.0, 6.0 * 20.0 - 100.0, 0.0);
        assert!((moved - want).xy().norm() < 1.0, "{moved} {want}");
    }

    #[test]
    fn limits_hold_and_nonsense_is_told() {
        let m = TerminalDescent::build(TerminalDescentParams {
            thrust_max: 9e3,
            thrust_min: 8.5e3,
            ..params()
        })
        .unwrap();
        let body = NodeState {
            position: Vec3::x() * (3.39e6 + 1600.0),
            velocity: Vec3::x() * -150.0,
            ..NodeState::identity()
        };
        let c = Clock::at(0.0, 0.1, 0);
        let y = m.feedthrough(&c, &m.init_d(), &free(body, 2200.0));
        assert!(y.limited && (y.force.norm() - 9e3).abs() < 1e-9);
        let y = m.feedthrough(&c, &m.init_d(), &free(body, 20.0));
        assert!(y.limited && (y.force.norm() - 8.5e3).abs() < 1e-9);
        let p = TerminalDescentParams { thrust_min: 30e3, ..params() };
        let e = TerminalDescent::build(p).err().unwrap();
        assert!(e.param.as_deref() == Some("thrust_min") && e.help.is_some());
        let said = |freeze: f64| {
            let m = TerminalDescent::build(TerminalDescentParams { freeze, ..params() }).unwrap();
            m.startup_warnings()
        };
        assert!(said(2.0).is_empty() && said(40.0)[0].param.as_deref() == Some("freeze"));
    }

    /// Over level ground far from the origin of W, the lander descends as it does near the origin, with and without a target.
    #[test]
    fn on_level_ground_the_origin_does_not_matter() {
        let gravity = testing::gravity(|_, _| Vec3::z() * -1.62);
        let p = TerminalDescentParams { ground_radius: None, world: None, gravity, ..params() };
        let m = TerminalDescent::build(p).map_err(|e| e.message).unwrap();
        for aimed in [false, true] {
            let ends = [Vec3::zeros(), Vec3::new(1e5, -3e4, 0.0)].map(|foot| {
                let (mass, dt) = (2000.0, 0.02);
                let mut r = foot + Vec3::new(-400.0, 150.0, 1200.0);
                let mut v = Vec3::new(20.0, -8.0, -45.0);
                let place = foot + Vec3::new(30.0, 60.0, 5.0);
                let mut d = m.init_d();
                for k in 0..2000 {
                    let body = NodeState { position: r, velocity: v, ..NodeState::identity() };
                    let u = TerminalDescentIn { place, aimed, ..free(body, mass) };
                    let c = Clock::at(dt * f64::from(k), dt, 0);
                    let y = m.feedthrough(&c, &d, &u);
                    d = m.update(&c, &d, &u);
                    let a = y.force / mass - Vec3::z() * 1.62;
                    r += v * dt + a * (0.5 * dt * dt);
                    v += a * dt;
                }
                (r - foot, v)
            });
            assert!((ends[0].0 - ends[1].0).norm() < 1e-6 && (ends[0].1 - ends[1].1).norm() < 1e-9);
            let want =
                if aimed { Vec3::new(30.0, 60.0, 25.0) } else { Vec3::new(200.0, -110.0, 20.0) };
            assert!((ends[0].0 - want).norm() < 1.5, "{} {want}", ends[0].0);
            assert!((ends[0].1 + Vec3::z() * 0.75).norm() < 0.2, "{}", ends[0].1);
        }
    }
}

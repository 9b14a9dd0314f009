//! `flight.waypoints`: waypoint guidance in the axes of a rotating node: hover, descend, stop, back away.
//! ```text
//! ρ = Rᵀ (r − r_F)      ρ̇ = Rᵀ (v − v_F − ω × (r − r_F))       F: the node, R and ω its rotation and turn rate
//! leg     from the place before (at first: from where it is) to P along t̂;  d = (P − ρ)·t̂,  e = P − ρ
//!         s(d) = min(speed, √(v_P² + 2 b d), v_P + d/T)         v_P: speed `through` P, b: `braking`
//!         ρ̇_w = s t̂ + (e − d t̂)/T         a_w = s s′ t̂         T: `settle`
//!         at P: d ≤ 0 where it goes through; |e| < `reach` where it stops; then ρ̇_w = e/T for `hold`, and the next leg
//! a = a_w + 4 (ρ̇_w − ρ̇)/T             critically damped with the time constant T/2 at P
//! F = m (R a + ω × (v_F + ω × (r − r_F)) + 2 ω × R ρ̇ − g), cut off at F_max
//! ```
//! The spacecraft stays at the last waypoint. The term ω × v_F is the acceleration of a node on a body that rotates at a constant rate about an axis
//! at rest in W. W is inertial, or a site, where g includes the Coriolis acceleration.

use super::rendezvous::at_most;
use linkwork_surroundings::prelude::*;

/// A waypoint.
#[derive(Params, Clone, Debug)]
pub struct Waypoint {
    /// Position in the axes of the node.
    #[param(unit = "m")]
    pub position: Vec3,
    /// Greatest speed on the leg to this waypoint.
    #[param(unit = "m/s", range = 1e-6..)]
    pub speed: f64,
    /// Speed at this waypoint; 0: stop there.
    #[param(unit = "m/s", default = 0.0, range = 0.0..)]
    pub through: f64,
    /// Time to stay at a waypoint where the spacecraft stops.
    #[param(unit = "s", default = 0.0, range = 0.0..)]
    pub hold: f64,
}

/// Waypoints and parameters of the guidance law.
#[derive(Params, Clone, Debug)]
pub struct WaypointsParams {
    /// Waypoints in order.
    pub waypoints: Vec<Waypoint>,
    /// Braking deceleration b.
    #[param(unit = "m/s^2", default = 0.01, range = 1e-9..)]
    pub braking: f64,
    /// Time T for the decay of deviations from the leg.
    #[param(unit = "s", default = 20.0, range = 1e-3..)]
    pub settle: f64,
    /// Distance within which a waypoint with a stop is reached.
    #[param(unit = "m", default = 0.5, range = 1e-6..)]
    pub reach: f64,
    /// Greatest force F_max.
    #[param(unit = "N", default = f64::INFINITY, range = 0.0..)]
    pub force_max: f64,
    /// Gravity g.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// Spacecraft and reference node.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WaypointsIn {
    /// Node on the spacecraft.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Node whose axes the waypoints are in.
    #[port(bind = "frame")]
    pub frame: NodeState,
    /// Mass of the spacecraft.
    #[port("kg")]
    pub mass: f64,
}

/// Force command and relative state.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WaypointsOut {
    /// Commanded force, W.
    #[port("N")]
    pub force: Vec3,
    /// Position ρ, axes of the node.
    #[port("m")]
    pub position: Vec3,
    /// Velocity ρ̇ relative to the node, axes of the node.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Distance to the next waypoint.
    #[port("m")]
    pub distance: f64,
}

/// Progress through the waypoints.
#[derive(State, Clone, Copy, Debug)]
pub struct Leg {
    /// Number of waypoints passed; the last one is never passed.
    #[port("1")]
    pub passed: f64,
    /// Start of this leg, axes of the node.
    #[port("m")]
    pub from: Vec3,
    /// The first leg has begun.
    #[port]
    pub begun: bool,
    /// The spacecraft holds at the waypoint.
    #[port]
    pub there: bool,
    /// Start time of the hold.
    #[port("s")]
    pub since: f64,
}

/// Progress as outputs.
#[derive(Ports, Clone, Copy, Debug)]
pub struct Progress {
    /// Number of waypoints passed.
    #[port("1")]
    pub passed: f64,
    /// The spacecraft holds at a waypoint.
    #[port]
    pub there: bool,
}

/// Waypoint guidance.
pub struct Waypoints {
    p: WaypointsParams,
}

/// Returns position (m) and velocity (m/s) of the spacecraft relative to the rotating reference node, in its axes.
fn relative(u: &WaypointsIn) -> (Vec3, Vec3) {
    let (f, b) = (&u.frame, &u.body);
    let way = b.position - f.position;
    let back = f.rotation.inverse();
    (back * way, back * (b.velocity - f.velocity - f.angular.cross(&way)))
}

impl Waypoints {
    /// Returns the commanded speed (m/s) at the distance `d` (m) from a waypoint, and the acceleration (m/s²) along the speed profile.
    fn profile(&self, to: &Waypoint, d: f64) -> (f64, f64) {
        let settling = to.through + d / self.p.settle;
        let braking = (to.through * to.through + 2.0 * self.p.braking * d.max(0.0)).sqrt();
        if to.speed <= settling && to.speed <= braking {
            (to.speed, 0.0)
        } else if braking <= settling {
            (braking, -self.p.braking)
        } else {
            (settling, -settling / self.p.settle)
        }
    }

    /// Returns the commanded velocity and acceleration at a position, axes of the node.
    fn wanted(&self, d: &Leg, position: &Vec3) -> (Vec3, Vec3) {
        let to = &self.p.waypoints[d.passed as usize];
        let off = to.position - position;
        let leg = to.position - if d.begun { d.from } else { *position };
        let length = leg.norm();
        if d.there || !(length > 0.0) {
            return (at_most(off / self.p.settle, to.speed), Vec3::zeros());
        }
        let ahead = leg / length;
        let left = off.dot(&ahead);
        let (speed, slowing) = self.profile(to, left);
        let back = at_most((off - ahead * left) / self.p.settle, to.speed);
        (ahead * speed + back, ahead * slowing)
    }
}

/// Waypoint guidance in the axes of a rotating node, such as a site on a small body; sampled.
#[model("flight.waypoints")]
impl Model for Waypoints {
    type Params = WaypointsParams;
    type FeedthroughInputs = WaypointsIn;
    type Outputs = Progress;
    type FeedthroughOutputs = WaypointsOut;
    type DiscreteState = Leg;
    fn build(p: WaypointsParams) -> Result<Self, BuildError> {
        let wrong =
            |fact: String, help: &str| Err(BuildError::new(fact).help(help).at("waypoints"));
        let Some(last) = p.waypoints.last() else {
            let help = "write at least one, e.g. waypoints: [(position: [0, 0, 50], speed: 0.3)]";
            return wrong("`waypoints` is empty".into(), help);
        };
        if last.through > 0.0 {
            let fact =
                "the last waypoint has `through`, but the spacecraft stops there".to_string();
            return wrong(fact, "remove `through` from the last waypoint, or add a waypoint");
        }
        for (k, w) in p.waypoints.iter().enumerate() {
            if w.through > w.speed {
                let fact = format!(
                    "waypoint {k} has `through` {} m/s, which exceeds its `speed` {} m/s",
                    w.through, w.speed
                );
                return wrong(fact, "raise `speed` or lower `through`");
            }
            if w.through > 0.0 && w.hold > 0.0 {
                let fact =
                    format!("waypoint {k} has both `through` and `hold`, but `hold` needs a stop");
                return wrong(fact, "remove one of them");
            }
        }
        Ok(Waypoints { p })
    }
    fn init_d(&self) -> Leg {
        Leg { passed: 0.0, from: Vec3::zeros(), begun: false, there: false, since: 0.0 }
    }
    fn outputs(&self, d: &Leg) -> Progress {
        Progress { passed: d.passed, there: d.there }
    }
    fn feedthrough(&self, clock: &Clock, d: &Leg, u: &WaypointsIn) -> WaypointsOut {
        let (position, velocity) = relative(u);
        let (wanted, slowing) = self.wanted(d, &position);
        let a = slowing + (wanted - velocity) * (4.0 / self.p.settle);
        let (R, w) = (u.frame.rotation, u.frame.angular);
        let carried = u.frame.velocity + w.cross(&(u.body.position - u.frame.position));
        let turning = w.cross(&carried) + w.cross(&(R * velocity)) * 2.0;
        let falls = self.p.gravity.free_fall(clock.t, u.body.position, u.body.velocity);
        let to = self.p.waypoints[d.passed as usize].position;
        WaypointsOut {
            force: at_most((R * a + turning - falls) * u.mass, self.p.force_max),
            position,
            velocity,
            distance: (to - position).norm(),
        }
    }
    fn update(&self, clock: &Clock, d: &Leg, u: &WaypointsIn) -> Leg {
        let (position, _) = relative(u);
        let mut d = if d.begun { *d } else { Leg { from: position, begun: true, ..*d } };
        let places = &self.p.waypoints;
        let to = &places[d.passed as usize];
        let off = to.position - position;
        let there = off.norm() < self.p.reach;
        if to.through > 0.0 {
            let leg = to.position - d.from;
            if off.dot(&leg) <= 0.0 {
                d = Leg { passed: d.passed + 1.0, from: to.position, ..d };
            }
        } else if there && !d.there {
            d = Leg { there: true, since: clock.t, ..d };
        }
        // The tolerance covers the round-off of sample times.
        let stayed = d.there && clock.t - d.since > to.hold - 1e-9;
        if stayed && (d.passed as usize) + 1 < places.len() {
            d = Leg { passed: d.passed + 1.0, from: to.position, there: false, ..d };
        }
        d
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::testing;

    const MASS: f64 = 1300.0;
    const RATE: f64 = 4e-4;

    fn place(position: Vec3, speed: f64, through: f64, hold: f64) -> Waypoint {
        Waypoint { position, speed, through, hold }
    }

    fn params(waypoints: Vec<Waypoint>) -> WaypointsParams {
        let gravity = testing::gravity(move |_, p| p * (-4.89 / p.norm().powi(3)));
        WaypointsParams {
            waypoints,
            braking: 0.005,
            settle: 20.0,
            reach: 0.5,
            force_max: f64::INFINITY,
            gravity,
        }
    }

    /// Site on a sphere of radius 250 m that rotates about z.
    fn site(t: f64) -> NodeState {
        let turn = Quat::from_scaled_axis(Vec3::z() * (RATE * t));
        let position = turn * Vec3::new(170.0, 60.0, 150.0);
        let angular = Vec3::z() * RATE;
        let rotation = turn * Quat::from_scaled_axis(Vec3::new(-0.2, 0.7, 0.1));
        NodeState { position, rotation, angular, velocity: angular.cross(&position) }
    }

    /// Integrates the motion by semi-implicit Euler with step `dt` and one command per step until `end`; returns the outputs of each step.
    fn fly(m: &Waypoints, start: Vec3, end: f64, mut see: impl FnMut(f64, &Leg, &WaypointsOut)) {
        let (dt, first) = (0.1, site(0.0));
        let mut r = first.position + first.rotation * start;
        let mut v = first.angular.cross(&r);
        let mut d = m.init_d();
        for n in 0..(end / dt) as u64 {
            let t = n as f64 * dt;
            let c = Clock::at(t, dt, n);
            let body = NodeState { position: r, velocity: v, ..NodeState::identity() };
            let u = WaypointsIn { body, frame: site(t), mass: MASS };
            let y = m.feedthrough(&c, &d, &u);
            see(t, &d, &y);
            d = m.update(&c, &d, &u);
            let a = y.force / MASS + m.p.gravity.acceleration(t, r);
            r += v * dt + a * (0.5 * dt * dt);
            v += a * dt;
        }
    }

    #[test]
    fn it_hovers_descends_and_backs_away_in_the_axes_of_the_site() {
        let up = |z: f64| Vec3::z() * z;
        let m = Waypoints::build(params(vec![
            place(up(80.0), 0.5, 0.0, 30.0),
            place(up(40.0), 0.3, 0.1, 0.0),
            place(up(30.0), 0.1, 0.0, 10.0),
            place(up(90.0), 0.4, 0.0, 0.0),
        ]))
        .unwrap();
        let (mut passed, mut times, mut speeds) = (0.0, Vec::new(), Vec::new());
        let (mut across, mut last) = (0.0_f64, None);
        fly(&m, Vec3::new(12.0, -8.0, 80.0), 900.0, |t, d, y| {
            if d.passed > passed {
                (passed, last) = (d.passed, None);
                times.push(t);
                speeds.push(y.velocity.norm());
            }
            if d.passed > 0.0 {
                across = across.max(y.position.xy().norm());
            }
            last = Some((y.position, y.velocity));
        });
        println!("{times:?} {speeds:?}, off the vertical {across} m");
        assert_eq!(passed, 3.0);
        // The vehicle passed the second waypoint at the commanded speed, and stopped at the others.
        assert!((speeds[1] - 0.1).abs() < 2e-3 && speeds[0] < 0.02 && speeds[2] < 0.02);
        // The leg takes 40 m at 0.3 m/s, except for braking from 0.3 to 0.1 m/s at 5 mm/s² (40 s instead of 8/0.3 s)
        // and the start.
        let legs = times[1] - times[0];
        assert!((legs - (40.0 / 0.3 + 40.0 - 8.0 / 0.3 + 5.0)).abs() < 3.0, "{legs}");
        assert!(across < 0.6, "{across}");
        let (position, velocity) = last.unwrap();
        assert!((position - up(90.0)).norm() < 0.01 && velocity.norm() < 1e-3, "{position}");
    }

    #[test]
    fn at_rest_in_the_axes_the_force_holds_gravity_and_turning() {
        let m = Waypoints::build(params(vec![place(Vec3::zeros(), 0.1, 0.0, 0.0)])).unwrap();
        let frame = site(500.0);
        let u = WaypointsIn { body: frame, frame, mass: MASS };
        let y = m.feedthrough(&Clock::at(0.0, 1.0, 0), &m.init_d(), &u);
        let r = frame.position;
        let want =
            (r * (4.89 / r.norm().powi(3)) - Vec3::new(r.x, r.y, 0.0) * (RATE * RATE)) * MASS;
        assert!((y.force - want).norm() < 1e-12 && y.velocity.norm() < 1e-15, "{} {want}", y.force);
    }

    #[test]
    fn what_is_no_programme_is_refused() {
        let refused = |w| Waypoints::build(params(w)).err().unwrap();
        let z = Vec3::zeros();
        for (w, part) in [
            (vec![], "is empty"),
            (vec![place(z, 0.3, 0.1, 0.0)], "last"),
            (vec![place(z, 0.3, 0.4, 0.0), place(z, 0.3, 0.0, 0.0)], "waypoint 0"),
            (vec![place(z, 0.3, 0.1, 2.0), place(z, 0.3, 0.0, 0.0)], "hold"),
        ] {
            let e = refused(w);
            assert!(e.message.contains(part) && e.help.is_some(), "{}", e.message);
            assert_eq!(e.param.as_deref(), Some("waypoints"));
        }
    }
}

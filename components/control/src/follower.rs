//! `control.waypoint_follower`: pure pursuit through waypoints, with turns on the spot and reactive stops.
//! ```text
//! look-ahead point: on the leg from the last waypoint, at distance L beyond the projection of the rover
//! κ = 2 y_L/L²        y_L: its lateral offset in the rover's frame;   turn rate = v κ
//! ```
//! When the look-ahead point lies further off the heading than `spot_angle`, the rover turns on the spot until it
//! is within a fifth of it. Tilt or slip beyond its limit stops the rover permanently (until restarted).

use linkwork_runtime::prelude::*;

/// Path and limits.
#[derive(Params, Clone, Debug)]
pub struct FollowerParams {
    /// Waypoints, W, m; visited in turn.
    #[param(unit = "m")]
    pub waypoints: Vec<[f64; 2]>,
    /// Driving speed.
    #[param(unit = "m/s", range = 1e-4..)]
    pub speed: f64,
    /// Turn rate on the spot.
    #[param(unit = "rad/s", default = 0.05, range = 1e-4..)]
    pub spot_rate: f64,
    /// Heading error above which the rover turns on the spot.
    #[param(unit = "rad", default = 0.6, range = 0.05..=3.2)]
    pub spot_angle: f64,
    /// Look-ahead distance.
    #[param(unit = "m", default = 1.5, range = 0.01..)]
    pub look_ahead: f64,
    /// Distance at which a waypoint counts as reached.
    #[param(unit = "m", default = 0.3, range = 1e-3..)]
    pub tolerance: f64,
    /// Tilt at which the rover stops.
    #[param(unit = "rad", default = 0.6, range = 0.0..)]
    pub tilt_max: f64,
    /// Slip at which the rover stops (above 1: never).
    #[param(default = 2.0, range = 0.0..)]
    pub slip_max: f64,
}

/// Pose of the rover.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FollowerIn {
    /// x in W.
    #[port("m")]
    pub x: f64,
    /// y in W.
    #[port("m")]
    pub y: f64,
    /// Heading from x towards y.
    #[port("rad")]
    pub heading: f64,
    /// Angle of the deck to the horizontal.
    #[port("rad", default = 0.0)]
    pub tilt: f64,
    /// Slip, 0 to 1.
    #[port("1", default = 0.0)]
    pub slip: f64,
}

/// Drive command and progress.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FollowerOut {
    /// Commanded forward speed.
    #[port("m/s")]
    pub speed: f64,
    /// Commanded turn rate, to the left.
    #[port("rad/s")]
    pub turn_rate: f64,
    /// Index of the current waypoint.
    #[port("1")]
    pub waypoint: f64,
    /// Distance to the current waypoint.
    #[port("m")]
    pub distance: f64,
    /// All waypoints are reached.
    #[port("1")]
    pub done: bool,
    /// Stopped by tilt or slip.
    #[port("1")]
    pub stopped: bool,
}

/// Progress and command.
#[derive(State, Clone, Copy, Debug)]
pub struct FollowerState {
    /// Index of the current waypoint.
    #[port("1")]
    pub waypoint: f64,
    /// Start of the leg, W.
    #[port("m")]
    pub from: [f64; 2],
    /// Turning on the spot.
    #[port("1")]
    pub turning: bool,
    /// Stopped by a limit.
    #[port("1")]
    pub stopped: bool,
    /// The first sample has been seen.
    #[port("1")]
    pub started: bool,
    /// Speed command.
    #[port("m/s")]
    pub speed: f64,
    /// Turn rate command.
    #[port("rad/s")]
    pub turn_rate: f64,
    /// Distance to the waypoint.
    #[port("m")]
    pub distance: f64,
}

/// A waypoint follower.
pub struct Follower {
    p: FollowerParams,
}

fn wrapped(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * (angle / turn).round()
}

impl Follower {
    /// Returns the look-ahead point, in the rover's frame.
    fn target(&self, d: &FollowerState, u: &FollowerIn, goal: [f64; 2]) -> [f64; 2] {
        let leg = [goal[0] - d.from[0], goal[1] - d.from[1]];
        let length = leg[0].hypot(leg[1]);
        let point = if length > 1e-9 {
            let along = ((u.x - d.from[0]) * leg[0] + (u.y - d.from[1]) * leg[1]) / length;
            let at = ((along + self.p.look_ahead) / length).clamp(0.0, 1.0);
            [d.from[0] + at * leg[0], d.from[1] + at * leg[1]]
        } else {
            goal
        };
        let (dx, dy) = (point[0] - u.x, point[1] - u.y);
        let (sin, cos) = u.heading.sin_cos();
        [cos * dx + sin * dy, cos * dy - sin * dx]
    }
}

/// Follows waypoints by pure pursuit, turns on the spot at large heading errors, and stops on excessive tilt or slip.
#[model("control.waypoint_follower")]
impl Model for Follower {
    type Params = FollowerParams;
    type Inputs = FollowerIn;
    type Outputs = FollowerOut;
    type DiscreteState = FollowerState;
    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let stops = "the rover never stops at this limit";
        vec![
            (Judge::Param("tilt_max"), unwired(wired, "tilt", stops)),
            (Judge::Param("slip_max"), unwired(wired, "slip", stops)),
        ]
    }
    fn build(p: FollowerParams) -> Result<Self, BuildError> {
        if p.waypoints.is_empty() {
            return Err(BuildError::new("there is no waypoint")
                .at("waypoints")
                .help("write at least one: `waypoints: [(10.0, 0.0)]`"));
        }
        Ok(Follower { p })
    }
    fn outputs(&self, d: &FollowerState) -> FollowerOut {
        FollowerOut {
            speed: d.speed,
            turn_rate: d.turn_rate,
            waypoint: d.waypoint,
            distance: d.distance,
            done: d.waypoint >= self.p.waypoints.len() as f64,
            stopped: d.stopped,
        }
    }
    fn update(&self, d: &FollowerState, u: &FollowerIn) -> FollowerState {
        let p = &self.p;
        let mut out = *d;
        (out.speed, out.turn_rate) = (0.0, 0.0);
        if !d.started {
            (out.from, out.started) = ([u.x, u.y], true);
        }
        out.stopped |= u.tilt.abs() > p.tilt_max || u.slip > p.slip_max;
        let distance_to =
            |k: f64| p.waypoints.get(k as usize).map(|g| ((g[0] - u.x).hypot(g[1] - u.y), *g));
        while let Some((distance, goal)) = distance_to(out.waypoint) {
            if distance > p.tolerance {
                break;
            }
            out.waypoint += 1.0;
            out.from = goal;
            out.turning = false;
        }
        let Some((distance, goal)) = distance_to(out.waypoint) else {
            out.distance = 0.0;
            return out;
        };
        out.distance = distance;
        if out.stopped {
            return out;
        }
        let [ahead, left] = self.target(&out, u, goal);
        let off = wrapped(left.atan2(ahead));
        let bound = if out.turning { 0.2 * p.spot_angle } else { p.spot_angle };
        out.turning = off.abs() > bound;
        if out.turning {
            out.turn_rate = p.spot_rate * off.signum();
            return out;
        }
        out.speed = p.speed;
        let range2 = ahead * ahead + left * left;
        out.turn_rate = p.speed * 2.0 * left / range2.max(1e-6);
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn follower(waypoints: Vec<[f64; 2]>) -> Follower {
        Follower {
            p: FollowerParams {
                waypoints,
                speed: 0.1,
                spot_rate: 0.1,
                spot_angle: 0.6,
                look_ahead: 1.0,
                tolerance: 0.2,
                tilt_max: 0.5,
                slip_max: 0.8,
            },
        }
    }

    /// Drives a unicycle; returns the state, the pose and the greatest distance from the x axis before x = 3.
    fn drive(f: &Follower, mut pose: [f64; 3], seconds: f64) -> (FollowerState, [f64; 3]) {
        let (dt, mut d) = (0.1, FollowerState::zero());
        for _ in 0..(seconds / dt) as u64 {
            let u = FollowerIn { x: pose[0], y: pose[1], heading: pose[2], tilt: 0.0, slip: 0.0 };
            d = f.update(&d, &u);
            pose[0] += dt * d.speed * pose[2].cos();
            pose[1] += dt * d.speed * pose[2].sin();
            pose[2] += dt * d.turn_rate;
        }
        (d, pose)
    }

    #[test]
    fn visits_every_waypoint() {
        let f = follower(vec![[5.0, 0.0], [5.0, 4.0], [0.0, 4.0], [0.0, 0.5]]);
        let (d, pose) = drive(&f, [0.0, 0.0, 0.3], 400.0);
        assert_eq!(d.waypoint, 4.0);
        assert!(pose[0].hypot(pose[1] - 0.5) <= 0.2 + 0.02, "{pose:?}");
        assert!(f.outputs(&d).done && d.speed == 0.0);
    }

    #[test]
    fn faces_a_goal_behind_by_turning_on_the_spot() {
        let f = follower(vec![[-5.0, 0.1]]);
        let (d, pose) = drive(&f, [0.0, 0.0, 0.0], 5.0);
        assert!(d.turning && d.speed == 0.0 && d.turn_rate == 0.1 && pose[0] == 0.0);
        let (d, pose) = drive(&f, [0.0, 0.0, 0.0], 60.0);
        assert!(!d.turning && d.speed == 0.1 && pose[0] < -1.0);
    }

    #[test]
    fn returns_to_its_leg_after_a_push() {
        let f = follower(vec![[20.0, 0.0]]);
        let mut d = FollowerState::zero();
        d.started = true; // the leg starts at the origin, although the rover is at its side
        let mut pose = [0.0, 0.4, 0.0_f64];
        for _ in 0..1000 {
            let u = FollowerIn { x: pose[0], y: pose[1], heading: pose[2], tilt: 0.0, slip: 0.0 };
            d = f.update(&d, &u);
            pose[0] += 0.1 * d.speed * pose[2].cos();
            pose[1] += 0.1 * d.speed * pose[2].sin();
            pose[2] += 0.1 * d.turn_rate;
        }
        assert!(pose[1].abs() < 0.01 && pose[2].abs() < 0.02, "{pose:?}");
    }

    #[test]
    fn tilt_and_slip_stop_it_for_good() {
        let f = follower(vec![[5.0, 0.0]]);
        for (tilt, slip) in [(0.6, 0.0), (0.0, 0.9)] {
            let u = FollowerIn { x: 0.0, y: 0.0, heading: 0.0, tilt, slip };
            let d = f.update(&FollowerState::zero(), &u);
            assert!(d.stopped && d.speed == 0.0);
            let calm = FollowerIn { tilt: 0.0, slip: 0.0, ..u };
            assert!(f.update(&d, &calm).stopped);
        }
        assert!(Follower::build(FollowerParams { waypoints: vec![], ..f.p }).is_err());
    }
}

//! Jerk-limited motion from any state to any other in minimum time; all coordinates arrive at the same time.
//!
//! ```text
//! each coordinate    seven pieces of constant jerk (a double-S profile): q is a cubic of time in each
//! together           the slowest coordinate sets the duration; the others are stretched to it where possible,
//!                    otherwise to the next possible duration
//! ```
//! The motion is computed by the crate `rsruckig`, an implementation of Berscheid and Kröger (Jerk-limited real-time trajectory generation with
//! arbitrary target states, Robotics: Science and Systems 2021). A state that starts outside the limits is brought inside them first.

use super::timing::MotionLimits;
use super::{Robot, numbers};
use crate::error::RobotError;
use crate::model::RobotModel;
use rsruckig::prelude::{
    InputParameter, Profile, Ruckig, RuckigError, RuckigErrorHandler, Trajectory,
};
use std::sync::Arc;

/// State of a robot: configuration and motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionState<'a> {
    /// Configuration (nq).
    pub q: &'a [f64],
    /// Rates (nv).
    pub v: &'a [f64],
    /// Accelerations (nv).
    pub vdot: &'a [f64],
}

/// Result of planning a transfer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transferred {
    /// A motion was found. [`Transfer::at`] returns the robot's state at a time.
    Found {
        /// Duration of the motion, s.
        duration: f64,
    },
    /// The fastest motion leaves the position limits of a coordinate, because it starts too fast or overshoots. [`Transfer::at`] returns this motion.
    LeavesLimits {
        /// Index in β.
        dof: usize,
        /// Extreme value of the coordinate, rad or m.
        value: f64,
        /// Duration of the motion, s.
        duration: f64,
    },
}

/// Error handler that discards the texts of the crate, so that failures do not format strings.
#[derive(Debug)]
struct Quiet;

impl RuckigErrorHandler for Quiet {
    fn handle_validation_error(_: &str) -> Result<(), RuckigError> {
        Err(RuckigError::ValidationError(String::new()))
    }

    fn handle_calculator_error(_: &str) -> Result<(), RuckigError> {
        Err(RuckigError::CalculatorError(String::new()))
    }
}

/// Planner for transfers of one model, with its memory.
pub struct Transfer {
    model: Arc<RobotModel>,
    /// Indices in q and β of all hinges with one coordinate.
    moving: Vec<(usize, usize)>,
    solver: Ruckig<0, Quiet>,
    input: InputParameter<0>,
    found: Trajectory<0>,
    ready: bool,
    start: Vec<f64>,
}

impl std::fmt::Debug for Transfer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Transfer").field("duration", &self.duration()).finish_non_exhaustive()
    }
}

impl Transfer {
    /// Creates a planner. Allocates memory; later calls do not.
    #[must_use]
    pub fn new(robot: &Robot) -> Self {
        let limits = robot.model.limits.iter().enumerate();
        let moving: Vec<(usize, usize)> =
            limits.filter_map(|(v, l)| l.as_ref().map(|(q, _)| (*q, v))).collect();
        let n = Some(moving.len().max(1));
        Self {
            model: robot.model.clone(),
            moving,
            solver: Ruckig::new(n, 1e-3),
            input: InputParameter::new(n),
            found: Trajectory::new(n),
            ready: false,
            start: vec![0.0; robot.q.len()],
        }
    }

    /// Computes the fastest motion between two states of the robot. Effort limits are not considered. Coordinates of ball and free hinges must be
    /// equal in both states and at rest.
    ///
    /// # Errors
    /// [`RobotError::Length`]; [`RobotError::NotFinite`]; [`RobotError::OpensClosure`]; [`RobotError::OutOfRange`] for limits that are not positive,
    /// a moving coordinate without limits of rate, acceleration and jerk, ball and free hinges that move, and an end state that the limits exclude
    /// (|v| + v̇²/(2 jerk) above the rate limit, in the direction to which v̇ leads); [`RobotError::Singular`] when the search fails because of
    /// round-off. In this last case the crate formats a message, so only then this call allocates.
    pub fn plan(
        &mut self,
        from: &MotionState<'_>,
        to: &MotionState<'_>,
        limits: &MotionLimits,
    ) -> Result<Transferred, RobotError> {
        self.model.open_tree("a jerk-limited transfer")?;
        self.check(from, to, limits)?;
        self.ready = false;
        self.start.copy_from_slice(from.q);
        let input = &mut self.input;
        for (k, (q, v)) in self.moving.iter().enumerate() {
            input.current_position[k] = from.q[*q];
            input.current_velocity[k] = from.v[*v];
            input.current_acceleration[k] = from.vdot[*v];
            input.target_position[k] = to.q[*q];
            input.target_velocity[k] = to.v[*v];
            input.target_acceleration[k] = to.vdot[*v];
            input.max_velocity[k] = limits.rate[*v];
            input.max_acceleration[k] = limits.acceleration[*v];
            input.max_jerk[k] = limits.jerk[*v];
            input.enabled[k] = !still(from, to, *q, *v);
        }
        if self.moving.is_empty() {
            input.enabled[0] = false;
        }
        let help = "start from a slightly different state, or use other limits";
        let failed = RobotError::Singular { what: "the fastest motion between two states", help };
        self.solver.calculate(input, &mut self.found).map_err(|_| failed)?;
        self.ready = true;
        let duration = self.found.get_duration();
        if !duration.is_finite() {
            return Err(failed);
        }
        for (k, (q, v)) in self.moving.iter().enumerate() {
            let Some((_, l)) = &self.model.limits[*v] else { continue };
            let [least, greatest] = extrema(&self.found.profiles[0][k]);
            let most = [(least, l.lower, -1.0), (greatest, l.upper, 1.0)];
            let ends = [from.q[*q], to.q[*q]];
            for (value, limit, side) in most {
                // Ends outside the position limits were given by the caller and are accepted.
                let own = ends.iter().any(|e| side * (e - limit) >= side * (value - limit));
                if side * (value - limit) > 1e-9 && !own && self.input.enabled[k] {
                    return Ok(Transferred::LeavesLimits { dof: *v, value, duration });
                }
            }
        }
        Ok(Transferred::Found { duration })
    }

    fn check(
        &self,
        from: &MotionState<'_>,
        to: &MotionState<'_>,
        limits: &MotionLimits,
    ) -> Result<(), RobotError> {
        let (nq, nv) = (self.start.len(), self.model.nv());
        limits.check(nv)?;
        for state in [from, to] {
            self.model.configurations("q", state.q, 1)?;
            numbers("v", state.v, nv)?;
            numbers("vdot", state.vdot, nv)?;
        }
        for at in 0..nq {
            let own = self.moving.iter().any(|m| m.0 == at);
            if !own && from.q[at] != to.q[at] {
                let what = "change of a coordinate of a ball or free hinge";
                let (value, help) = (to.q[at] - from.q[at], "move only pins, sliders and screws");
                return Err(RobotError::OutOfRange { what, value, help });
            }
        }
        for dof in 0..nv {
            let own = self.moving.iter().any(|m| m.1 == dof);
            let moves = [from.v, from.vdot, to.v, to.vdot].into_iter().find(|x| x[dof] != 0.0);
            if let (false, Some(x)) = (own, moves) {
                let (what, help) =
                    ("motion of a ball or free hinge", "give it zero rates and accelerations");
                return Err(RobotError::OutOfRange { what, value: x[dof], help });
            }
        }
        for (q, v) in &self.moving {
            if still(from, to, *q, *v) {
                continue;
            }
            let help = "give every coordinate that moves a limit of rate, acceleration and jerk";
            let all = [
                ("rate limit of a moving coordinate", limits.rate[*v]),
                ("acceleration limit of a moving coordinate", limits.acceleration[*v]),
                ("jerk limit of a moving coordinate", limits.jerk[*v]),
            ];
            if let Some((what, value)) = all.into_iter().find(|x| !x.1.is_finite()) {
                return Err(RobotError::OutOfRange { what, value, help });
            }
            let (rate, jerk) = (limits.rate[*v], limits.jerk[*v]);
            let (end, push) = (to.v[*v], to.vdot[*v]);
            if push.abs() > limits.acceleration[*v] {
                let (what, help) = ("acceleration at the end", "end within the limits");
                return Err(RobotError::OutOfRange { what, value: push, help });
            }
            // The rate exceeds the end value by this much shortly before or after the end.
            let swing = push * push / (2.0 * jerk);
            if end.abs() > rate || end.abs() + if end * push < 0.0 { swing } else { 0.0 } > rate {
                let what =
                    "rate at the end, including the overshoot that its acceleration requires";
                let help = "reduce the rate or the acceleration at the end";
                return Err(RobotError::OutOfRange { what, value: end, help });
            }
        }
        Ok(())
    }

    /// Returns the duration of the last planned motion, s; zero when none was found.
    #[must_use]
    pub fn duration(&self) -> f64 {
        if self.ready { self.found.get_duration() } else { 0.0 }
    }

    /// Writes configuration (nq), rates and accelerations (nv) at `time`, s. After the end of the motion the rates there stay constant.
    ///
    /// # Errors
    /// [`RobotError::NotFinite`]; [`RobotError::Length`]; [`RobotError::NoSearch`] before a motion was planned.
    pub fn at(
        &self,
        time: f64,
        q: &mut [f64],
        v: &mut [f64],
        vdot: &mut [f64],
    ) -> Result<(), RobotError> {
        numbers("time", &[time], 1)?;
        let (nq, nv) = (self.start.len(), self.model.nv());
        let all = [("q", q.len(), nq), ("v", v.len(), nv), ("vdot", vdot.len(), nv)];
        if let Some((what, got, wanted)) = all.into_iter().find(|x| x.1 != x.2) {
            return Err(RobotError::Length { what, got, wanted });
        }
        if !self.ready {
            return Err(RobotError::NoSearch { part: 0 });
        }
        q.copy_from_slice(&self.start);
        v.fill(0.0);
        vdot.fill(0.0);
        let mut piece = 0;
        self.found.state_to_integrate_from(time.max(0.0), &mut piece, |k, t, p, r, a, j| {
            let Some((iq, iv)) = self.moving.get(k) else { return };
            if self.input.enabled[k] {
                q[*iq] = p + t * (r + t * (a / 2.0 + t * j / 6.0));
                v[*iv] = r + t * (a + t * j / 2.0);
                vdot[*iv] = a + t * j;
            }
        });
        Ok(())
    }
}

/// Returns the smallest and the largest position of a profile: at the ends of its pieces, and where its rate is zero. (`get_position_extrema` of the
/// crate, version 3.0.1, misses some of the latter.)
fn extrema(profile: &Profile) -> [f64; 2] {
    let mut out = [profile.pf; 2];
    let mut piece = |t: f64, p: f64, v: f64, a: f64, j: f64| {
        let mut at = |t: f64| {
            let x = p + t * (v + t * (a / 2.0 + t * j / 6.0));
            out = [out[0].min(x), out[1].max(x)];
        };
        at(0.0);
        // Solve v + a t + j t²/2 = 0 with a formula that avoids cancellation for both roots.
        let under = a * a - 2.0 * j * v;
        let w = -(a + under.max(0.0).sqrt().copysign(a));
        if under >= 0.0 {
            for root in [w / j, 2.0 * v / w] {
                if root > 0.0 && root < t {
                    at(root);
                }
            }
        }
    };
    let brake = &profile.brake;
    for i in 0..2 {
        if brake.t[i] > 0.0 {
            piece(brake.t[i], brake.p[i], brake.v[i], brake.a[i], brake.j[i]);
        }
    }
    for i in 0..7 {
        piece(profile.t[i], profile.p[i], profile.v[i], profile.a[i], profile.j[i]);
    }
    out
}

/// Returns true if a coordinate is at rest and equal at both ends.
fn still(from: &MotionState<'_>, to: &MotionState<'_>, q: usize, v: usize) -> bool {
    let rest = [from.v, from.vdot, to.v, to.vdot].iter().all(|x| x[v] == 0.0);
    rest && from.q[q] == to.q[q]
}

//! From any state to any other in the least time that limits of rate, acceleration and jerk allow, all coordinates arriving together.
//!
//! ```text
//! each coordinate    seven pieces of constant jerk (a double S): q is a cubic of time in each
//! together           the slowest says how long; the others are stretched to it, where that is possible, else all take the next time that is
//! ```
//! Found by the crate `rsruckig`, the algorithm of Berscheid and Kröger (Jerk-limited real-time trajectory generation with arbitrary target states, Robotics: Science and
//! Systems 2021). What stands outside limits at the start is brought inside first.

use super::timing::MotionLimits;
use super::{Robot, numbers};
use crate::error::RobotError;
use crate::model::RobotModel;
use rsruckig::prelude::{
    InputParameter, Profile, Ruckig, RuckigError, RuckigErrorHandler, Trajectory,
};
use std::sync::Arc;

/// Where a robot is, and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionState<'a> {
    /// Configuration (nq).
    pub q: &'a [f64],
    /// Rates (nv).
    pub v: &'a [f64],
    /// Accelerations (nv).
    pub vdot: &'a [f64],
}

/// What a transfer ends with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transferred {
    /// [`Transfer::at`] tells where the robot is meanwhile.
    Found {
        /// s.
        duration: f64,
    },
    /// The fastest motion, which [`Transfer::at`] tells, leaves the limits of a coordinate: it starts too fast to stay within, or swings too far.
    LeavesLimits {
        /// Place in β.
        dof: usize,
        /// How far it comes, rad or m.
        value: f64,
        /// s.
        duration: f64,
    },
}

/// Failures by value; texts of the crate are not kept.
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

/// Memory of transfers of one model.
pub struct Transfer {
    model: Arc<RobotModel>,
    /// Places in q and in β of all coordinates of their own.
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
    /// Allocates: once, at set-up.
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

    /// The fastest motion between two states of the robot; limits of effort do not count. Coordinates of ball and free hinges have to be the same in both, and at rest.
    ///
    /// # Errors
    /// [`RobotError::Length`], [`RobotError::NotFinite`], [`RobotError::OpensClosure`]; [`RobotError::OutOfRange`] for limits that are not above zero, a coordinate that moves without limits of
    /// rate, acceleration and jerk, an end that the limits forbid (|v| + v̇²/(2 jerk) beyond the rate, toward which v̇ leads), and for ball and free hinges that
    /// move; [`RobotError::Singular`] where the search fails by round-off, which the crate then puts into words (the one call here that allocates).
    pub fn plan(
        &mut self,
        from: &MotionState<'_>,
        to: &MotionState<'_>,
        limits: &MotionLimits,
    ) -> Result<Transferred, RobotError> {
        self.model.open_tree("a transfer")?;
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
        let help = "start from a state that differs by a little, or with other limits";
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
                // Ends outside are the caller's own.
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
                let what = "the change of a coordinate of a ball or free hinge";
                let (value, help) = (to.q[at] - from.q[at], "move pins, sliders and screws alone");
                return Err(RobotError::OutOfRange { what, value, help });
            }
        }
        for dof in 0..nv {
            let own = self.moving.iter().any(|m| m.1 == dof);
            let moves = [from.v, from.vdot, to.v, to.vdot].into_iter().find(|x| x[dof] != 0.0);
            if let (false, Some(x)) = (own, moves) {
                let (what, help) = ("the motion of a ball or free hinge", "let it rest");
                return Err(RobotError::OutOfRange { what, value: x[dof], help });
            }
        }
        for (q, v) in &self.moving {
            if still(from, to, *q, *v) {
                continue;
            }
            let help = "give every coordinate that moves a limit of rate, acceleration and jerk";
            let all = [
                ("rate of what moves", limits.rate[*v]),
                ("acceleration of what moves", limits.acceleration[*v]),
                ("jerk of what moves", limits.jerk[*v]),
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
            // Before and after the end the rate goes beyond it by this much.
            let swing = push * push / (2.0 * jerk);
            if end.abs() > rate || end.abs() + if end * push < 0.0 { swing } else { 0.0 } > rate {
                let what = "rate at the end, with what its acceleration takes before";
                let help = "end within the limits of rate: less rate, or less acceleration";
                return Err(RobotError::OutOfRange { what, value: end, help });
            }
        }
        Ok(())
    }

    /// How long the motion takes that was planned last, s; zero when none was found.
    #[must_use]
    pub fn duration(&self) -> f64 {
        if self.ready { self.found.get_duration() } else { 0.0 }
    }

    /// Configuration (nq), rates and accelerations (nv) at a time, s: after the end the rates there go on.
    ///
    /// # Errors
    /// [`RobotError::NotFinite`], [`RobotError::Length`]; [`RobotError::NoSearch`] when nothing was planned.
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

/// The least and the greatest place of a profile: at ends of its pieces, and where its rate is zero. (`get_position_extrema` of the crate, 3.0.1, misses
/// some of the latter.)
fn extrema(profile: &Profile) -> [f64; 2] {
    let mut out = [profile.pf; 2];
    let mut piece = |t: f64, p: f64, v: f64, a: f64, j: f64| {
        let mut at = |t: f64| {
            let x = p + t * (v + t * (a / 2.0 + t * j / 6.0));
            out = [out[0].min(x), out[1].max(x)];
        };
        at(0.0);
        // v + a t + j t²/2 = 0, both roots without a difference of near numbers.
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

/// Whether a coordinate stands still from one end to the other.
fn still(from: &MotionState<'_>, to: &MotionState<'_>, q: usize, v: usize) -> bool {
    let rest = [from.v, from.vdot, to.v, to.vdot].iter().all(|x| x[v] == 0.0);
    rest && from.q[q] == to.q[q]
}

//! Trajectories: time parameterization of a path within limits of rate, acceleration and effort, and jerk-limited transfers between two states.

use crate::call::calls;
use crate::edge::{Out, disjoint, numbers, numbers_mut, value};
use crate::path::{LwPath, told};
use crate::robot::{Instance, LwRobot};
use crate::status::Fault;
use crate::tool::{MANY, Tool, lend, room};
use linkwork_embedded::{
    MotionLimits, MotionState, RobotError, Timed, Timing, Transfer, Transferred,
};

/// Limits of a motion: one number for each degree of freedom, above zero, infinite for no limit. All arrays have the same length.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwMotionLimits {
    /// Rate limits, rad/s or m/s; NULL: those of the model.
    pub rate: *const f64,
    /// Acceleration limits, rad/s^2 or m/s^2; NULL: no limits.
    pub acceleration: *const f64,
    /// Jerk limits, rad/s^3 or m/s^3; NULL: no limits.
    pub jerk: *const f64,
    /// Effort limits, N m or N; NULL: those of the model. If all are infinite, no dynamics is computed.
    pub effort: *const f64,
    /// Length of the arrays, nv.
    pub n: usize,
}

/// State of a robot: configuration and motion.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwMotionState {
    /// Configuration.
    pub q: *const f64,
    /// Length of `q`, nq.
    pub nq: usize,
    /// Rates; NULL: at rest.
    pub v: *const f64,
    /// Accelerations; NULL: zero.
    pub vdot: *const f64,
    /// Length of `v` and `vdot`, nv.
    pub nv: usize,
}

/// Result of a time parameterization.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwTimed {
    /// Duration of the motion, s.
    pub duration: f64,
    /// If no motion keeps the limits: position on the path where they cannot be kept, as a fraction of its length (`lw_timing_place`).
    pub part: f64,
    /// If no motion keeps the limits: smallest factor for all limits of acceleration and effort with which a motion exists.
    pub share: f64,
    /// True if a motion keeps the limits. Fields that do not apply are zero.
    pub found: bool,
}

/// Result of planning a transfer.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwTransferred {
    /// Duration of the motion, s.
    pub duration: f64,
    /// If the motion leaves the position limits of a coordinate: its extreme value, rad or m.
    pub value: f64,
    /// If the motion leaves the position limits of a coordinate: index of that coordinate among the degrees of freedom.
    pub dof: usize,
    /// True if all coordinates stay within their limits. Fields that do not apply are zero.
    pub within_limits: bool,
}

/// Limits of a call, and the limits that are used for NULL.
struct Limits {
    own: MotionLimits,
    asked: MotionLimits,
    rest: Vec<f64>,
}

impl Limits {
    fn new(r: &Instance) -> Self {
        let own = MotionLimits::of(r.model());
        Self { asked: own.clone(), own, rest: vec![0.0; r.model().nv()] }
    }

    /// # Safety
    /// The conditions in the crate documentation apply.
    unsafe fn take(&mut self, p: *const LwMotionLimits) -> Result<(), Fault> {
        let nv = self.rest.len();
        let MotionLimits { rate, acceleration, jerk, effort } = &mut self.asked;
        rate.copy_from_slice(&self.own.rate);
        acceleration.copy_from_slice(&self.own.acceleration);
        jerk.copy_from_slice(&self.own.jerk);
        effort.copy_from_slice(&self.own.effort);
        if p.is_null() {
            return Ok(());
        }
        // SAFETY: guaranteed by the caller.
        let from = unsafe { value("limits", p) }?;
        for (what, from, to) in [
            ("rate", from.rate, rate),
            ("acceleration", from.acceleration, acceleration),
            ("jerk", from.jerk, jerk),
            ("effort", from.effort, effort),
        ] {
            if !from.is_null() {
                // SAFETY: as above.
                to.copy_from_slice(unsafe { numbers(what, from, p.read().n, nv) }?);
            }
        }
        Ok(())
    }

    /// # Safety
    /// The conditions in the crate documentation apply.
    unsafe fn state<'a>(
        &'a self,
        what: &'static str,
        p: *const LwMotionState,
        nq: usize,
    ) -> Result<MotionState<'a>, Fault> {
        let nv = self.rest.len();
        // SAFETY: guaranteed by the caller.
        unsafe {
            let LwMotionState { q, nq: n, v, vdot, nv: m } = value(what, p)?;
            let rest = &self.rest[..];
            let v = if v.is_null() { rest } else { numbers("v", v, m, nv)? };
            let vdot = if vdot.is_null() { rest } else { numbers("vdot", vdot, m, nv)? };
            Ok(MotionState { q: numbers("q", q, n, nq)?, v, vdot })
        }
    }
}

/// Memory of time parameterizations. Use it for robots of one model, with one call at a time.
pub struct LwTiming(Tool<(Timing, Limits)>);

/// Memory of transfers. Use it for robots of one model, with one call at a time.
pub struct LwTransfer(Tool<(Transfer, Limits)>);

/// Converts the error of a missing motion to a fault that names the call that must come first.
fn begun(call: &'static str) -> impl Fn(RobotError) -> Fault {
    move |e| match e {
        RobotError::NoSearch { .. } => Fault::NotBegun(call),
        e => e.into(),
    }
}

calls![
    /// Creates the memory of `lw_timing_plan` for paths of up to `configurations` configurations (at least 2) in up to `sections` sections (at least 8
    /// for each configuration, at most 1048576; 20 are coarse, 100 are fine) and writes it to `out`; free it with `lw_timing_free`. It works with every
    /// robot of the same model.
    fn lw_timing_new(
        r: &mut LwRobot,
        configurations: usize,
        sections: usize,
        out: Out<*mut LwTiming>,
    ) {
        let configurations = room("configurations", configurations, MANY)?;
        let timing = Timing::new(&r.robot, configurations, room("sections", sections, MANY)?)?;
        let tool = Tool::new(r, (timing, Limits::new(r)));
        out.set(Box::into_raw(Box::new(LwTiming(tool))));
    }

    /// Frees the memory; NULL has no effect.
    fn lw_timing_free(timing: *mut LwTiming);

    /// Computes the fastest motion along a path from rest to rest within limits, and writes the result to `out`. `path` (`n` numbers) contains whole
    /// configurations (nq numbers each) one after the other, as `lw_planner_path` writes them. With `round` = 0 the motion stops at each corner. Otherwise
    /// corners are rounded so that no point is farther than `round` from the path (Euclidean distance of coordinates, rad and m); call
    /// `lw_timing_path_free` afterwards. `limits`: NULL for those of the model; jerk limits are not considered. Held objects are included; the robot's
    /// own q has no effect. Joints that mimic others have no motor: their forces count at the joints that they follow. If no motion keeps the
    /// limits, this is a result, not an error. A call that fails may discard the previous motion.
    fn lw_timing_plan(
        r: &mut LwRobot,
        timing: *mut LwTiming,
        path: *const f64,
        n: usize,
        limits: *const LwMotionLimits,
        round: f64,
        out: Out<LwTimed>,
    ) {
        let mut timing = lend("timing", timing, |t| &t.0, r)?;
        let (timing, own) = &mut *timing;
        let nq = r.model().nq();
        let wanted = if nq == 0 { 0 } else { n.div_ceil(nq).saturating_mul(nq) };
        let path = numbers("path", path, n, wanted)?;
        own.take(limits)?;
        let told = match timing.plan(&mut r.robot, path, &own.asked, round)? {
            Timed::Found { duration } => LwTimed { duration, part: 0.0, share: 0.0, found: true },
            Timed::Infeasible { part, share } => {
                LwTimed { duration: 0.0, part, share, found: false }
            }
        };
        out.set(told);
    }

    /// Writes the configuration to `q` (`nq`), rates to `v` and accelerations to `vdot` (`nv` each) of the last motion at a time, s. Before its beginning
    /// and after its end the robot is at rest. Returns `LW_STATUS_NO_SEARCH` when there is no motion.
    fn lw_timing_at(
        r: &mut LwRobot,
        timing: *mut LwTiming,
        time: f64,
        q: *mut f64,
        nq: usize,
        v: *mut f64,
        vdot: *mut f64,
        nv: usize,
    ) {
        let mut timing = lend("timing", timing, |t| &t.0, r)?;
        disjoint(&[], &[("q", q, nq), ("v", v, nv), ("vdot", vdot, nv)])?;
        let (own_q, own_v) = (r.model().nq(), r.model().nv());
        let q = numbers_mut("q", q, nq, own_q)?;
        let v = numbers_mut("v", v, nv, own_v)?;
        let vdot = numbers_mut("vdot", vdot, nv, own_v)?;
        timing.0.at(time, q, v, vdot).map_err(begun("lw_timing_plan"))?;
    }

    /// Writes the configuration at a fraction (0 to 1) of the length of the last path to `q` (`n` = nq).
    fn lw_timing_place(r: &mut LwRobot, timing: *mut LwTiming, part: f64, q: *mut f64, n: usize) {
        let mut timing = lend("timing", timing, |t| &t.0, r)?;
        let q = numbers_mut("q", q, n, r.model().nq())?;
        timing.0.place(part, q)?;
    }

    /// Checks the last path, with its corners as they are rounded, for collisions and writes the result to `out`, as `lw_robot_path_free` does; `least`
    /// is a fraction of each piece, and the result is never unfinished.
    fn lw_timing_path_free(r: &mut LwRobot, timing: *mut LwTiming, least: f64, out: Out<LwPath>) {
        let mut timing = lend("timing", timing, |t| &t.0, r)?;
        out.set(told(timing.0.free(&mut r.robot, least))?);
    }

    /// Creates the memory of `lw_transfer_plan` and writes it to `out`; free it with `lw_transfer_free`. It works with every robot of the same model.
    fn lw_transfer_new(r: &mut LwRobot, out: Out<*mut LwTransfer>) {
        let tool = Tool::new(r, (Transfer::new(&r.robot), Limits::new(r)));
        out.set(Box::into_raw(Box::new(LwTransfer(tool))));
    }

    /// Frees the memory; NULL has no effect.
    fn lw_transfer_free(transfer: *mut LwTransfer);

    /// Computes the fastest motion between two states within limits of rate, acceleration and jerk, with all coordinates arriving at the same time, and
    /// writes the result to `out`. Effort limits are not considered, and collisions are not checked. Every coordinate that moves needs limits of rate,
    /// acceleration and jerk; those of ball and free hinges must be equal at both ends and at rest. Returns `LW_STATUS_SINGULAR` where the search fails
    /// by round-off (the only failure that allocates); the previous motion is then discarded, too.
    fn lw_transfer_plan(
        r: &mut LwRobot,
        transfer: *mut LwTransfer,
        from: *const LwMotionState,
        to: *const LwMotionState,
        limits: *const LwMotionLimits,
        out: Out<LwTransferred>,
    ) {
        let mut transfer = lend("transfer", transfer, |t| &t.0, r)?;
        let (transfer, own) = &mut *transfer;
        own.take(limits)?;
        let nq = r.model().nq();
        let (from, to) = (own.state("from", from, nq)?, own.state("to", to, nq)?);
        let told = match transfer.plan(&from, &to, &own.asked)? {
            Transferred::Found { duration } => {
                LwTransferred { duration, value: 0.0, dof: 0, within_limits: true }
            }
            Transferred::LeavesLimits { dof, value, duration } => {
                LwTransferred { duration, value, dof, within_limits: false }
            }
        };
        out.set(told);
    }

    /// Writes the configuration to `q` (`nq`), rates to `v` and accelerations to `vdot` (`nv` each) of the last transfer at a time, s. After its end the
    /// rates there stay constant. Returns `LW_STATUS_NO_SEARCH` when there is no transfer.
    fn lw_transfer_at(
        r: &mut LwRobot,
        transfer: *mut LwTransfer,
        time: f64,
        q: *mut f64,
        nq: usize,
        v: *mut f64,
        vdot: *mut f64,
        nv: usize,
    ) {
        let transfer = lend("transfer", transfer, |t| &t.0, r)?;
        disjoint(&[], &[("q", q, nq), ("v", v, nv), ("vdot", vdot, nv)])?;
        let (own_q, own_v) = (r.model().nq(), r.model().nv());
        let q = numbers_mut("q", q, nq, own_q)?;
        let v = numbers_mut("v", v, nv, own_v)?;
        let vdot = numbers_mut("vdot", vdot, nv, own_v)?;
        transfer.0.at(time, q, v, vdot).map_err(begun("lw_transfer_plan"))?;
    }
];

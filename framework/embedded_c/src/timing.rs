//! Motions in time: a way within limits of rate, acceleration and effort; a transfer between two states within limits of jerk.

use crate::edge::{self, Out, alone, disjoint, numbers, numbers_mut, value};
use crate::path::{LwPath, told};
use crate::robot::{Instance, LwRobot};
use crate::status::{Fault, LwStatus};
use crate::tool::{MANY, Tool, lend, room};
use linkwork_embedded::{
    MotionLimits, MotionState, RobotError, Timed, Timing, Transfer, Transferred,
};

/// Limits of a motion: a number for each degree of freedom, above zero, infinite for none. All arrays have the same length.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwMotionLimits {
    /// rad/s or m/s; NULL: those of the model.
    pub rate: *const f64,
    /// rad/s^2 or m/s^2; NULL: none.
    pub acceleration: *const f64,
    /// rad/s^3 or m/s^3; NULL: none.
    pub jerk: *const f64,
    /// N m or N; NULL: those of the model. Where all are infinite no dynamics is computed.
    pub effort: *const f64,
    /// nv.
    pub n: usize,
}

/// Where a robot is, and how it moves.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwMotionState {
    /// Configuration.
    pub q: *const f64,
    /// nq.
    pub nq: usize,
    /// Rates; NULL: at rest.
    pub v: *const f64,
    /// Accelerations; NULL: none.
    pub vdot: *const f64,
    /// nv.
    pub nv: usize,
}

/// What a timing ends with.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwTimed {
    /// s.
    pub duration: f64,
    /// When no motion keeps the limits: where on the way it becomes impossible, as a part of its length (`lw_timing_place`).
    pub part: f64,
    /// Then: the least number by which all limits of acceleration and effort would have to be multiplied.
    pub share: f64,
    /// Whether a motion keeps the limits. What does not apply is zero.
    pub found: bool,
}

/// What a transfer ends with.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwTransferred {
    /// s.
    pub duration: f64,
    /// When it leaves the limits of a coordinate: how far it comes, rad or m.
    pub value: f64,
    /// Then: the place of that coordinate among the degrees of freedom.
    pub dof: usize,
    /// Whether all coordinates stay within their limits. What does not apply is zero.
    pub within_limits: bool,
}

/// Limits of a call, and those that stand for NULL.
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
    /// The promises at the head of the crate.
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
        // SAFETY: the caller's promises.
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
    /// The promises at the head of the crate.
    unsafe fn state<'a>(
        &'a self,
        what: &'static str,
        p: *const LwMotionState,
        nq: usize,
    ) -> Result<MotionState<'a>, Fault> {
        let nv = self.rest.len();
        // SAFETY: the caller's promises.
        unsafe {
            let LwMotionState { q, nq: n, v, vdot, nv: m } = value(what, p)?;
            let rest = &self.rest[..];
            let v = if v.is_null() { rest } else { numbers("v", v, m, nv)? };
            let vdot = if vdot.is_null() { rest } else { numbers("vdot", vdot, m, nv)? };
            Ok(MotionState { q: numbers("q", q, n, nq)?, v, vdot })
        }
    }
}

/// Memory of timings. For robots of one model, and one call at a time.
pub struct LwTiming(Tool<(Timing, Limits)>);

/// Memory of transfers. For robots of one model, and one call at a time.
pub struct LwTransfer(Tool<(Transfer, Limits)>);

/// Nothing was planned.
fn begun(call: &'static str) -> impl Fn(RobotError) -> Fault {
    move |e| match e {
        RobotError::NoSearch { .. } => Fault::NotBegun(call),
        e => e.into(),
    }
}

/// Memory of `lw_timing_plan` for ways of so many configurations (at least 2) in so many sections (at least 8 for each, 1048576 at most; twenty are few, a hundred are many), into `out`; free it with
/// `lw_timing_free`. It serves every robot of the same model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_timing_new(
    robot: *mut LwRobot,
    configurations: usize,
    sections: usize,
    out: *mut *mut LwTiming,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let configurations = room("configurations", configurations, MANY)?;
            let timing = Timing::new(&r.robot, configurations, room("sections", sections, MANY)?)?;
            let tool = Tool::new(r, (timing, Limits::new(r)));
            out.set(Box::into_raw(Box::new(LwTiming(tool))));
            Ok(())
        })
    }
}

/// Frees it; NULL is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_timing_free(timing: *mut LwTiming) {
    // SAFETY: the caller's promises.
    unsafe { edge::free(timing) }
}

/// Times a way from rest to rest as fast as limits allow, into `out`: whole configurations (nq numbers each) one after the other in `way` (`n` numbers), as `lw_planner_path` gives them. Where `round` is
/// zero the motion stands still at each corner; else corners are rounded so that no point is farther than `round` from the way (root of the sum of squares of coordinates, rad and m): then
/// ask `lw_timing_path_free`. `limits`: NULL for those of the model; limits of jerk do not count. With what is held; the robot's own q does not matter. *No motion keeps the limits* is an answer,
/// not an error. A call that fails may forget the way that was timed before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_timing_plan(
    robot: *mut LwRobot,
    timing: *mut LwTiming,
    way: *const f64,
    n: usize,
    limits: *const LwMotionLimits,
    round: f64,
    out: *mut LwTimed,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let mut timing = lend("timing", timing, |t| &t.0, r)?;
            let (timing, own) = &mut *timing;
            let nq = r.model().nq();
            let wanted = if nq == 0 { 0 } else { n.div_ceil(nq).saturating_mul(nq) };
            let way = numbers("way", way, n, wanted)?;
            own.take(limits)?;
            let told = match timing.plan(&mut r.robot, way, &own.asked, round)? {
                Timed::Found { duration } => {
                    LwTimed { duration, part: 0.0, share: 0.0, found: true }
                }
                Timed::Infeasible { part, share } => {
                    LwTimed { duration: 0.0, part, share, found: false }
                }
            };
            out.set(told);
            Ok(())
        })
    }
}

/// Configuration into `q` (`nq`), rates into `v` and accelerations into `vdot` (`nv` each) at a time, s, of the way that was timed last: before its beginning and after its end it stands still.
/// `LW_STATUS_NO_SEARCH` when there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_timing_at(
    robot: *mut LwRobot,
    timing: *mut LwTiming,
    time: f64,
    q: *mut f64,
    nq: usize,
    v: *mut f64,
    vdot: *mut f64,
    nv: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let mut timing = lend("timing", timing, |t| &t.0, r)?;
            disjoint(&[], &[("q", q, nq), ("v", v, nv), ("vdot", vdot, nv)])?;
            let (own_q, own_v) = (r.model().nq(), r.model().nv());
            let q = numbers_mut("q", q, nq, own_q)?;
            let v = numbers_mut("v", v, nv, own_v)?;
            let vdot = numbers_mut("vdot", vdot, nv, own_v)?;
            timing.0.at(time, q, v, vdot).map_err(begun("lw_timing_plan"))
        })
    }
}

/// The configuration, into `q` (`n` = nq), at a part (0 to 1) of the length of the way that was given last.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_timing_place(
    robot: *mut LwRobot,
    timing: *mut LwTiming,
    part: f64,
    q: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let mut timing = lend("timing", timing, |t| &t.0, r)?;
            let q = numbers_mut("q", q, n, r.model().nq())?;
            Ok(timing.0.place(part, q)?)
        })
    }
}

/// Whether the way that was given last touches nothing, with its corners as they are rounded, into `out`: as `lw_robot_path_free`, whose `least` counts for each piece; never unfinished.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_timing_path_free(
    robot: *mut LwRobot,
    timing: *mut LwTiming,
    least: f64,
    out: *mut LwPath,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let mut timing = lend("timing", timing, |t| &t.0, r)?;
            out.set(told(timing.0.free(&mut r.robot, least))?);
            Ok(())
        })
    }
}

/// Memory of `lw_transfer_plan`, into `out`; free it with `lw_transfer_free`. It serves every robot of the same model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_transfer_new(
    robot: *mut LwRobot,
    out: *mut *mut LwTransfer,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let tool = Tool::new(r, (Transfer::new(&r.robot), Limits::new(r)));
            out.set(Box::into_raw(Box::new(LwTransfer(tool))));
            Ok(())
        })
    }
}

/// Frees it; NULL is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_transfer_free(transfer: *mut LwTransfer) {
    // SAFETY: the caller's promises.
    unsafe { edge::free(transfer) }
}

/// The fastest motion between two states within limits of rate, acceleration and jerk, all coordinates arriving together, into `out`; limits of effort do not count, and nothing is asked of
/// colliders. Every coordinate that moves needs limits of rate, acceleration and jerk; those of ball and free hinges have to be the same at both ends, and at rest.
/// `LW_STATUS_SINGULAR` where the search fails by round-off (the one failure that allocates): then, too, the motion of before is gone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_transfer_plan(
    robot: *mut LwRobot,
    transfer: *mut LwTransfer,
    from: *const LwMotionState,
    to: *const LwMotionState,
    limits: *const LwMotionLimits,
    out: *mut LwTransferred,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
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
            Ok(())
        })
    }
}

/// Configuration into `q` (`nq`), rates into `v` and accelerations into `vdot` (`nv` each) at a time, s, of the transfer that was planned last: after its end the rates there go on.
/// `LW_STATUS_NO_SEARCH` when there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_transfer_at(
    robot: *mut LwRobot,
    transfer: *mut LwTransfer,
    time: f64,
    q: *mut f64,
    nq: usize,
    v: *mut f64,
    vdot: *mut f64,
    nv: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let transfer = lend("transfer", transfer, |t| &t.0, r)?;
            disjoint(&[], &[("q", q, nq), ("v", v, nv), ("vdot", vdot, nv)])?;
            let (own_q, own_v) = (r.model().nq(), r.model().nv());
            let q = numbers_mut("q", q, nq, own_q)?;
            let v = numbers_mut("v", v, nv, own_v)?;
            let vdot = numbers_mut("vdot", vdot, nv, own_v)?;
            transfer.0.at(time, q, v, vdot).map_err(begun("lw_transfer_plan"))
        })
    }
}

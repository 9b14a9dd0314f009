//! Rates and forces for several objectives in order of priority.

use crate::edge::{self, Out, alone, disjoint, motion, numbers, numbers_mut, value, vec3};
use crate::robot::{Instance, LwRobot};
use crate::status::{Fault, LwStatus};
use crate::task::rows;
use crate::tool::{FEW, Tool, lend, room};
use linkwork_embedded::spatial::Vec3;
use linkwork_embedded::{
    Aim, Guards, Objective, Part, RateControl, RobotError, Touch, WholeBody, support_margin,
    support_polygon,
};

/// The tip of a chain moves, in the world.
pub const LW_WISH_TIP: u32 = 0;
/// The centre of mass of all that moves, with what is held, moves.
pub const LW_WISH_CENTER: u32 = 1;
/// All degrees of freedom move.
pub const LW_WISH_POSTURE: u32 = 2;

/// One thing that is asked, of rates (`lw_rate_control_solve`) or of accelerations (`lw_whole_body_solve`). What its kind does not use is not read.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwObjective {
    /// One of `LW_WISH_..`.
    pub kind: u32,
    /// Lower ones come first; those of one level are met together, in the sense of least squares.
    pub level: u32,
    /// What it counts within its level; above zero.
    pub weight: f64,
    /// Of a tip and of the centre of mass: angular (rad/s or rad/s^2), then linear (m/s or m/s^2), world axes; of a tip at its origin, of the centre the linear ones alone.
    pub motion: [f64; 6],
    /// Of a tip: what 1 rad counts, m, where all rows count.
    pub length: f64,
    /// Of a tip: the chain.
    pub part: u32,
    /// Of a tip: which rows count, one of `LW_ROWS_..`.
    pub rows: u32,
    /// Of a posture: rates or accelerations of all degrees of freedom.
    pub posture: *const f64,
    /// How many numbers the posture has: nv.
    pub posture_count: usize,
}

/// A chain whose manipulability is not to fall below a number.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwGuard {
    /// The least w (`lw_robot_manipulability` of all six rows with length 1 m).
    pub least: f64,
    /// The chain.
    pub part: u32,
}

/// A point of a tip that presses on something and does not slip.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwTouch {
    /// Where, in the tip's frame, m.
    pub at: [f64; 3],
    /// Normal of what it touches, towards the robot, of length 1, world axes.
    pub normal: [f64; 3],
    /// Friction coefficient, above zero.
    pub friction: f64,
    /// Greatest normal force, N, above zero; infinite for none.
    pub most: f64,
    /// The chain whose tip touches.
    pub part: u32,
}

/// How far a whole body could do what it was asked. All zero: it could.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwBalanced {
    /// What contacts cannot carry: root of the sum of squares of forces at degrees of freedom that nothing drives, N m and N.
    pub unbalanced: f64,
    /// Accelerations of what should stand still, m/s^2: contacts that contradict each other.
    pub slipping: f64,
    /// By which share all limits of effort and of normal forces would have to be larger.
    pub shortfall: f64,
}

/// Memory of rates for objectives. For robots of one model, and one call at a time.
pub struct LwRateControl(Tool<Rates>);

struct Rates {
    control: RateControl,
    objectives: Wishes,
    guards: Vec<(Part, f64)>,
    chains: usize,
    residuals: Vec<f64>,
}

/// Memory of forces for objectives with contacts. For robots of one model, and one call at a time.
pub struct LwWholeBody(Tool<Body>);

struct Body {
    body: WholeBody,
    objectives: Wishes,
    touches: Vec<Touch>,
    room: usize,
    forces: Vec<Vec3>,
}

/// Wishes of a call. Their postures are the caller's memory: the list is filled anew before it is read.
struct Wishes {
    all: Vec<Objective<'static>>,
    room: usize,
}

impl Wishes {
    fn new(room: usize) -> Self {
        Self { all: Vec::with_capacity(room), room }
    }

    /// # Safety
    /// The promises at the head of the crate.
    unsafe fn take(
        &mut self,
        r: &Instance,
        p: *const LwObjective,
        count: usize,
        written: &[(&'static str, *mut f64, usize)],
    ) -> Result<(), Fault> {
        self.all.clear();
        let room = self.room;
        if count > room {
            return Err(RobotError::NoRoom { what: "objectives", wanted: count, room }.into());
        }
        for k in 0..count {
            // SAFETY: the caller has `count` of them; one by one, since none of them may be there.
            let w = unsafe { value("objectives", p.wrapping_add(k)) }?;
            let aim = match w.kind {
                LW_WISH_TIP => {
                    let (part, rows) = (r.part(w.part)?, rows(w.rows, w.length)?);
                    Aim::Tip { part, motion: motion("motion", &w.motion)?, rows }
                }
                LW_WISH_CENTER => {
                    let [_, _, _, x, y, z] = w.motion;
                    Aim::Center(vec3("motion", &[x, y, z])?)
                }
                LW_WISH_POSTURE => {
                    let (what, nv) = ("posture", r.model().nv());
                    disjoint(&[(what, w.posture, w.posture_count)], written)?;
                    // SAFETY: the caller has it for the time of the call.
                    Aim::Posture(unsafe { numbers(what, w.posture, w.posture_count, nv) }?)
                }
                value => {
                    let (what, help) = ("kind", "one of LW_WISH_..");
                    return Err(Fault::Choice { what, value, help });
                }
            };
            self.all.push(Objective { level: w.level as usize, weight: w.weight, aim });
        }
        Ok(())
    }

    fn levels(&self) -> usize {
        let first = |k: usize| self.all[..k].iter().all(|w| w.level != self.all[k].level);
        (0..self.all.len()).filter(|k| first(*k)).count()
    }
}

/// Memory of `lw_rate_control_solve` with room for so many objectives and guarded chains (1024 each at most), into `out`; free it with `lw_rate_control_free`. It serves every robot of the same model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_rate_control_new(
    robot: *mut LwRobot,
    objectives: usize,
    guards: usize,
    out: *mut *mut LwRateControl,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let (objectives, chains) =
                (room("objectives", objectives, FEW)?, room("guards", guards, FEW)?);
            let rates = Rates {
                control: RateControl::new(&r.robot, objectives, chains),
                objectives: Wishes::new(objectives),
                guards: Vec::with_capacity(chains),
                chains,
                residuals: vec![0.0; objectives],
            };
            out.set(Box::into_raw(Box::new(LwRateControl(Tool::new(r, rates)))));
            Ok(())
        })
    }
}

/// Frees it; NULL is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_rate_control_free(control: *mut LwRateControl) {
    // SAFETY: the caller's promises.
    unsafe { edge::free(control) }
}

/// Rates, into `v` (`n` = nv), at the robot's q: within limits of rate, as near to each objective as those of lower levels allow, and of all such rates the least. A limit of a coordinate may be reached in
/// the time `horizon` (s, above zero: a few periods of the control) at the earliest; so may the least manipulability of each of the `guard_count` chains in `guards`: towards a singular
/// configuration a chain slows down. What is missing, |J v - asked| with weights, into `residuals`, a number for each level in their order (`levels`: how many different ones there are; NULL
/// and 0: not asked for). A coordinate outside its limits comes back as fast as it may.
/// `LW_STATUS_SINGULAR` when guards contradict each other.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_rate_control_solve(
    robot: *mut LwRobot,
    control: *mut LwRateControl,
    objectives: *const LwObjective,
    wish_count: usize,
    horizon: f64,
    guards: *const LwGuard,
    guard_count: usize,
    v: *mut f64,
    n: usize,
    residuals: *mut f64,
    levels: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let mut control = lend("control", control, |c| &c.0, r)?;
            let Rates { control, objectives: own, guards: chains, chains: room, residuals: left } =
                &mut *control;
            let written = [("v", v, n), ("residuals", residuals, levels)];
            disjoint(&[], &written)?;
            own.take(r, objectives, wish_count, &written)?;
            if guard_count > *room {
                let (what, wanted, room) = ("guards", guard_count, *room);
                return Err(RobotError::NoRoom { what, wanted, room }.into());
            }
            chains.clear();
            for k in 0..guard_count {
                let g = value("guards", guards.wrapping_add(k))?;
                edge::finite("least", &[g.least])?;
                chains.push((r.part(g.part)?, g.least));
            }
            let v = numbers_mut("v", v, n, r.model().nv())?;
            let asked = !residuals.is_null() || levels > 0;
            let wanted = if asked { own.levels() } else { 0 };
            let residuals = numbers_mut("residuals", residuals, levels, wanted)?;
            let guards = Guards { horizon, manipulable: chains };
            let done = control.solve(&mut r.robot, &own.all, &guards, v, left);
            own.all.clear();
            done?;
            residuals.copy_from_slice(&left[..wanted]);
            Ok(())
        })
    }
}

/// Memory of `lw_whole_body_solve` with room for so many touching points and objectives (1024 each at most), into `out`; free it with `lw_whole_body_free`. It serves every robot of the same model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_new(
    robot: *mut LwRobot,
    touches: usize,
    objectives: usize,
    out: *mut *mut LwWholeBody,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let (touches, objectives) =
                (room("touches", touches, FEW)?, room("objectives", objectives, FEW)?);
            let body = Body {
                body: WholeBody::new(&r.robot, touches, objectives),
                objectives: Wishes::new(objectives),
                touches: Vec::with_capacity(touches),
                room: touches,
                forces: vec![Vec3::zeros(); touches],
            };
            out.set(Box::into_raw(Box::new(LwWholeBody(Tool::new(r, body)))));
            Ok(())
        })
    }
}

/// Frees it; NULL is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_free(body: *mut LwWholeBody) {
    // SAFETY: the caller's promises.
    unsafe { edge::free(body) }
}

/// Forces into `tau`, accelerations into `vdot`, at the robot's q and rates `v`, and forces on the robot at the `touch_count` touching points into `forces` (3 numbers each, world axes, N):
/// first the balance of what nothing drives, then contacts that do not slip, then limits, then the objectives (accelerations) by levels, at last the least effort. `effort`: limits of force, N m
/// and N; zero where nothing drives, infinite for none. `v`, `effort`, `tau`, `vdot`: `n` = nv each. What could not be done is an answer, in `out`, with the best motion there is.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_whole_body_solve(
    robot: *mut LwRobot,
    body: *mut LwWholeBody,
    v: *const f64,
    effort: *const f64,
    n: usize,
    touches: *const LwTouch,
    touch_count: usize,
    objectives: *const LwObjective,
    wish_count: usize,
    tau: *mut f64,
    vdot: *mut f64,
    forces: *mut f64,
    out: *mut LwBalanced,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let mut body = lend("body", body, |b| &b.0, r)?;
            let Body { body, objectives: own, touches: points, room, forces: pressed } = &mut *body;
            if touch_count > *room {
                let (what, wanted, room) = ("touches", touch_count, *room);
                return Err(RobotError::NoRoom { what, wanted, room }.into());
            }
            let count = 3 * touch_count;
            let written = [("tau", tau, n), ("vdot", vdot, n), ("forces", forces, count)];
            disjoint(&[("v", v, n), ("effort", effort, n)], &written)?;
            own.take(r, objectives, wish_count, &written)?;
            points.clear();
            for k in 0..touch_count {
                let t = value("touches", touches.wrapping_add(k))?;
                points.push(Touch {
                    part: r.part(t.part)?,
                    at: vec3("at", &t.at)?,
                    normal: vec3("normal", &t.normal)?,
                    friction: t.friction,
                    most: t.most,
                });
            }
            let nv = r.model().nv();
            let (v, effort) = (numbers("v", v, n, nv)?, numbers("effort", effort, n, nv)?);
            let (tau, vdot) = (numbers_mut("tau", tau, n, nv)?, numbers_mut("vdot", vdot, n, nv)?);
            let forces = numbers_mut("forces", forces, count, count)?;
            let pressed = &mut pressed[..touch_count];
            let answer = (tau, vdot, &mut *pressed);
            let done = body.solve(&mut r.robot, v, points, &own.all, effort, answer);
            own.all.clear();
            let told = done?;
            for (to, f) in forces.chunks_exact_mut(3).zip(pressed) {
                to.copy_from_slice(f.as_slice());
            }
            let (unbalanced, slipping) = (told.unbalanced, told.slipping);
            out.set(LwBalanced { unbalanced, slipping, shortfall: told.shortfall });
            Ok(())
        })
    }
}

/// Where the centre of mass may be above `n` touching points (2 numbers each: x, y, m, in a level plane): the corners of their hull, counter-clockwise, into `hull` (room for n + 1 of them), and how
/// many there are into `count`: two for points on a line, one for points that are all the same. `points` are put in order meanwhile; those that are no numbers count as none.
/// No handle has a message of it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_support_polygon(
    points: *mut f64,
    n: usize,
    hull: *mut f64,
    room: usize,
    count: *mut usize,
) -> LwStatus {
    edge::plain(|| {
        // SAFETY: the caller's promises.
        unsafe {
            let count = Out::new("count", count)?;
            let [all, corners] = [n, room].map(|n| n.saturating_mul(2));
            disjoint(&[], &[("points", points, all), ("hull", hull, corners)])?;
            if room <= n {
                let (what, wanted) = ("corners", n.saturating_add(1));
                return Err(RobotError::NoRoom { what, wanted, room }.into());
            }
            let points = numbers_mut("points", points.cast::<[f64; 2]>(), n, n)?;
            let hull = numbers_mut("hull", hull.cast::<[f64; 2]>(), room, room)?;
            count.set(support_polygon(points, hull));
            Ok(())
        }
    })
}

/// How far a place `p` (2 numbers: x, y, m) is inside a polygon with `n` corners (2 numbers each, counter-clockwise), into `margin`: the distance to its nearest edge, m, negative outside. Of
/// no corner it is minus infinity. No handle has a message of it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_support_margin(
    hull: *const f64,
    n: usize,
    p: *const f64,
    margin: *mut f64,
) -> LwStatus {
    edge::plain(|| {
        // SAFETY: the caller's promises.
        unsafe {
            let margin = Out::new("margin", margin)?;
            let hull = numbers("hull", hull.cast::<[f64; 2]>(), n, n)?;
            let p = value("p", p.cast::<[f64; 2]>())?;
            edge::finite("p", &p)?;
            margin.set(support_margin(hull, p));
            Ok(())
        }
    })
}

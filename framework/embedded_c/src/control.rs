//! Rate control and whole-body control: rates and forces for several tasks in order of priority.

use crate::call::calls;
use crate::edge::{self, Out, disjoint, motion, numbers, numbers_mut, value, vec3};
use crate::robot::{Instance, LwRobot};
use crate::status::Fault;
use crate::task::rows;
use crate::tool::{FEW, Tool, lend, room};
use linkwork_embedded::spatial::Vec3;
use linkwork_embedded::{
    Aim, Guards, Objective, Part, RateControl, RobotError, Touch, WholeBody, support_margin,
    support_polygon,
};

/// Task: motion of the tip of a chain, in the world.
pub const LW_OBJECTIVE_TIP: u32 = 0;
/// Task: motion of the centre of mass of all moving bodies, including held objects.
pub const LW_OBJECTIVE_CENTER: u32 = 1;
/// Task: motion of all degrees of freedom.
pub const LW_OBJECTIVE_POSTURE: u32 = 2;

/// One task: desired rates (`lw_rate_control_solve`) or desired accelerations (`lw_whole_body_solve`). Fields that its kind does not use are not
/// read.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwObjective {
    /// One of `LW_OBJECTIVE_..`.
    pub kind: u32,
    /// Priority level. Lower levels come first; tasks of the same level are met together in the least-squares sense.
    pub level: u32,
    /// Weight within its level; above zero.
    pub weight: f64,
    /// Tip and centre of mass: desired angular (rad/s or rad/s^2), then linear motion (m/s or m/s^2), world axes; at the tip's origin. The centre of
    /// mass uses only the linear part.
    pub motion: [f64; 6],
    /// Tip: length that scales angular rows, m, if all rows are selected.
    pub length: f64,
    /// Tip: the chain.
    pub part: u32,
    /// Tip: selected rows, one of `LW_ROWS_..`.
    pub rows: u32,
    /// Posture: rates or accelerations of all degrees of freedom.
    pub posture: *const f64,
    /// Posture: number of values, nv.
    pub posture_count: usize,
}

/// A chain whose manipulability must not fall below a limit.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwGuard {
    /// Smallest permitted w (`lw_robot_manipulability` of all six rows with length 1 m).
    pub least: f64,
    /// The chain.
    pub part: u32,
}

/// A contact point of a tip that presses on a surface and does not slip.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwTouch {
    /// Point of application in the tip's frame, m.
    pub at: [f64; 3],
    /// Normal of the surface, towards the robot, of length 1, world axes.
    pub normal: [f64; 3],
    /// Friction coefficient, above zero.
    pub friction: f64,
    /// Largest normal force, N, above zero; infinite for no limit.
    pub most: f64,
    /// The chain whose tip is in contact.
    pub part: u32,
}

/// Residuals of a whole-body solution. All zero: all requirements are met.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwBalanced {
    /// Forces that the contacts cannot provide: Euclidean norm of the residual forces at degrees of freedom without an actuator, N m and N.
    pub unbalanced: f64,
    /// Residual acceleration of contact points, m/s^2; not zero if contacts contradict each other.
    pub slipping: f64,
    /// Fraction by which all effort and normal force limits would have to be larger.
    pub shortfall: f64,
}

/// Memory of a rate controller. Use it for robots of one model, with one call at a time.
pub struct LwRateControl(Tool<Rates>);

struct Rates {
    control: RateControl,
    objectives: Objectives,
    guards: Vec<(Part, f64)>,
    chains: usize,
    residuals: Vec<f64>,
}

/// Memory of a whole-body controller. Use it for robots of one model, with one call at a time.
pub struct LwWholeBody(Tool<Body>);

struct Body {
    body: WholeBody,
    objectives: Objectives,
    touches: Vec<Touch>,
    room: usize,
    forces: Vec<Vec3>,
}

/// Tasks of a call. Postures refer to the caller's memory, so the list is filled again before each use.
struct Objectives {
    all: Vec<Objective<'static>>,
    room: usize,
}

impl Objectives {
    fn new(room: usize) -> Self {
        Self { all: Vec::with_capacity(room), room }
    }

    /// # Safety
    /// The conditions in the crate documentation apply.
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
            // SAFETY: the caller has `count` of them; they are read one by one, because `count` may be zero.
            let w = unsafe { value("objectives", p.wrapping_add(k)) }?;
            let aim = match w.kind {
                LW_OBJECTIVE_TIP => {
                    let (part, rows) = (r.part(w.part)?, rows(w.rows, w.length)?);
                    Aim::Tip { part, motion: motion("motion", &w.motion)?, rows }
                }
                LW_OBJECTIVE_CENTER => {
                    let [_, _, _, x, y, z] = w.motion;
                    Aim::Center(vec3("motion", &[x, y, z])?)
                }
                LW_OBJECTIVE_POSTURE => {
                    let (what, nv) = ("posture", r.model().nv());
                    disjoint(&[(what, w.posture, w.posture_count)], written)?;
                    // SAFETY: the caller provides the array for the duration of the call.
                    Aim::Posture(unsafe { numbers(what, w.posture, w.posture_count, nv) }?)
                }
                value => {
                    let (what, help) = ("kind", "one of LW_OBJECTIVE_..");
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

calls![
    /// Creates the memory of `lw_rate_control_solve` for up to `objectives` tasks and `chains` guarded chains (at most 1024 each) and writes it to `out`;
    /// free it with `lw_rate_control_free`. It works with every robot of the same model.
    fn lw_rate_control_new(
        r: &mut LwRobot,
        objectives: usize,
        guards: usize,
        out: Out<*mut LwRateControl>,
    ) {
        let (objectives, chains) =
            (room("objectives", objectives, FEW)?, room("guards", guards, FEW)?);
        let rates = Rates {
            control: RateControl::new(&r.robot, objectives, chains),
            objectives: Objectives::new(objectives),
            guards: Vec::with_capacity(chains),
            chains,
            residuals: vec![0.0; objectives],
        };
        out.set(Box::into_raw(Box::new(LwRateControl(Tool::new(r, rates)))));
    }

    /// Frees the memory; NULL has no effect.
    fn lw_rate_control_free(control: *mut LwRateControl);

    /// Computes rates `v` (`n` = nv) at the robot's q: within rate limits, as near to each task as the tasks of lower levels allow, and the smallest of
    /// all such rates. Within `horizon` (s, above zero; use a few control periods) a limit of a coordinate, or the smallest manipulability of each of the
    /// `guard_count` chains in `guards`, may at most just be reached, so a chain slows down towards a singular configuration. Writes the weighted
    /// residual |J v - desired| of each level, in order, to `residuals` (`levels`: number of different levels; NULL and 0: not written). A coordinate
    /// outside its limits returns as fast as its rate limit allows. Returns `LW_STATUS_SINGULAR` when guards contradict each other.
    fn lw_rate_control_solve(
        r: &mut LwRobot,
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
    ) {
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
    }

    /// Creates the memory of `lw_whole_body_solve` for up to `touches` contact points and `objectives` tasks (at most 1024 each) and writes it to `out`; free
    /// it with `lw_whole_body_free`. It works with every robot of the same model.
    fn lw_whole_body_new(
        r: &mut LwRobot,
        touches: usize,
        objectives: usize,
        out: Out<*mut LwWholeBody>,
    ) {
        let (touches, objectives) =
            (room("touches", touches, FEW)?, room("objectives", objectives, FEW)?);
        let body = Body {
            body: WholeBody::new(&r.robot, touches, objectives),
            objectives: Objectives::new(objectives),
            touches: Vec::with_capacity(touches),
            room: touches,
            forces: vec![Vec3::zeros(); touches],
        };
        out.set(Box::into_raw(Box::new(LwWholeBody(Tool::new(r, body)))));
    }

    /// Frees the memory; NULL has no effect.
    fn lw_whole_body_free(body: *mut LwWholeBody);

    /// Computes forces `tau` and accelerations `vdot` at the robot's q and rates `v`, and forces on the robot at the `touch_count` contact points,
    /// `forces` (3 numbers each, world axes, N). Priorities are: balance of the degrees of freedom without an actuator, contacts that do not slip,
    /// limits, the tasks (accelerations) by levels, and minimum effort. `effort`: effort limits, N m and N; zero for no actuator, infinite for no limit.
    /// `v`, `effort`, `tau`, `vdot`: `n` = nv each. Requirements that cannot be met are not an error: `out` contains the residuals of the best solution.
    fn lw_whole_body_solve(
        r: &mut LwRobot,
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
        out: Out<LwBalanced>,
    ) {
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
    }

    /// Computes the support polygon of `n` contact points (2 numbers each: x, y, m, in a level plane), above which the centre of mass must be. Writes the
    /// corners of their convex hull, counter-clockwise, to `hull` (room for n + 1), and their number to `count`: two for points on a line, one for
    /// coincident points. Sorts `points`; points with NaN or infinity are ignored. There is no handle and no message.
    fn lw_support_polygon(
        points: *mut f64,
        n: usize,
        hull: *mut f64,
        room: usize,
        count: Out<usize>,
    ) {
        let [all, corners] = [n, room].map(|n| n.saturating_mul(2));
        disjoint(&[], &[("points", points, all), ("hull", hull, corners)])?;
        if room <= n {
            let (what, wanted) = ("corners", n.saturating_add(1));
            return Err(RobotError::NoRoom { what, wanted, room }.into());
        }
        let points = numbers_mut("points", points.cast::<[f64; 2]>(), n, n)?;
        let hull = numbers_mut("hull", hull.cast::<[f64; 2]>(), room, room)?;
        count.set(support_polygon(points, hull));
    }

    /// Writes the distance of a point `p` (2 numbers: x, y, m) from the nearest edge of a polygon with `n` corners (2 numbers each, counter-clockwise) to
    /// `margin`, m; negative outside, minus infinity without corners. There is no handle and no message.
    fn lw_support_margin(hull: *const f64, n: usize, p: *const f64, margin: Out<f64>) {
        let hull = numbers("hull", hull.cast::<[f64; 2]>(), n, n)?;
        let p = value("p", p.cast::<[f64; 2]>())?;
        edge::finite("p", &p)?;
        margin.set(support_margin(hull, p));
    }
];

//! Control of tips: manipulability, rates of one tip, operational space.

use crate::call::calls;
use crate::edge::{LwPose, Out, disjoint, motion, numbers, numbers_mut, value};
use crate::robot::LwRobot;
use crate::status::Fault;
use crate::tool::{Tool, lend};
use linkwork_embedded::{Impedance, Part, RobotError, Rows, TaskSpace};

/// All six rows of a Jacobian; the angular rows are multiplied by a length.
pub const LW_ROWS_ALL: u32 = 0;
/// The three linear rows.
pub const LW_ROWS_LINEAR: u32 = 1;
/// The three angular rows.
pub const LW_ROWS_ANGULAR: u32 = 2;

pub(crate) fn rows(rows: u32, length: f64) -> Result<Rows, Fault> {
    match rows {
        LW_ROWS_ALL => Ok(Rows::All { length }),
        LW_ROWS_LINEAR => Ok(Rows::Linear),
        LW_ROWS_ANGULAR => Ok(Rows::Angular),
        value => Err(Fault::Choice { what: "rows", value, help: "one of LW_ROWS_.." }),
    }
}

/// Manipulability of a tip at one configuration. For joint rates of length 1 the tip's speed along a unit vector u is at most 1 / sqrt(sum of (a_k .
/// u / s_k)^2). For joint forces of length 1 its force is at most 1 / sqrt(sum of (a_k . u)^2 s_k^2). Here a_k are the axes and s_k the singular
/// values.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwManipulability {
    /// The product of the singular values; 0 at a singular configuration.
    pub w: f64,
    /// Singular values, largest first; for three rows the last three are zero.
    pub singular_values: [f64; 6],
    /// Six rows of six, row after row. Column k is the axis of singular value k over the selected rows, angular ones first if there are six. For
    /// three rows only the upper left 3 by 3 block is used.
    pub axes: [f64; 36],
}

/// Impedance of a tip: a spring and a damper between the tip and its desired motion.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwImpedance {
    /// Desired pose of the tip in the world.
    pub pose: LwPose,
    /// Desired twist of the tip: angular (rad/s), linear (m/s), at its origin, world axes.
    pub twist: [f64; 6],
    /// Desired acceleration of the tip, rad/s^2 and m/s^2.
    pub acceleration: [f64; 6],
    /// Stiffness about world x, y, z (N m/rad), then along x, y, z (N/m); not negative.
    pub stiffness: [f64; 6],
    /// Damping in the same order (N m s/rad, N s/m); not negative.
    pub damping: [f64; 6],
}

impl LwImpedance {
    fn checked(&self) -> Result<Impedance, Fault> {
        Ok(Impedance {
            pose: self.pose.checked()?,
            twist: motion("twist", &self.twist)?,
            acceleration: motion("acceleration", &self.acceleration)?,
            stiffness: self.stiffness,
            damping: self.damping,
        })
    }
}

/// Operational space of some tips, with its memory. Use it for robots of one model, with one call at a time.
pub struct LwTaskSpace(Tool<Space>);

struct Space {
    space: TaskSpace,
    tips: usize,
    springs: Vec<Impedance>,
}

calls![
    /// Writes the pose of the base of a chain in the world at the robot's q. It is the frame of goals with `LW_GOAL_IN_BASE`.
    fn lw_robot_base_pose(r: &mut LwRobot, part: Part, out: Out<LwPose>) {
        out.set(r.robot.base_pose(part)?.into());
    }

    /// Writes the manipulability of a chain at the robot's q to `out`. `rows`: one of `LW_ROWS_..`; `length`: length that scales angular rows, m, if all
    /// six are selected (otherwise it is not read). Writes its gradient over the chain's degrees of freedom to `gradient` (`n`: `lw_model_part_size`;
    /// NULL and 0: not written); zero where the measure is zero.
    fn lw_robot_manipulability(
        r: &mut LwRobot,
        part: Part,
        rows: u32,
        length: f64,
        out: Out<LwManipulability>,
        gradient: *mut f64,
        n: usize,
    ) {
        let rows = self::rows(rows, length)?;
        let wanted = r.model().dofs(part)?.len();
        let asked = !gradient.is_null() || n > 0;
        let own = if asked { wanted } else { 0 };
        let gradient = numbers_mut("gradient", gradient, n, own)?;
        let told = r.robot.manipulability(part, rows, asked.then_some(gradient))?;
        let mut axes = [0.0; 36];
        for (k, x) in axes.iter_mut().enumerate() {
            *x = told.axes[(k / 6, k % 6)];
        }
        out.set(LwManipulability { w: told.w, singular_values: told.singular_values, axes });
    }

    /// Computes rates of a chain at the robot's q for which its tip moves with `twist` as closely as possible, and writes them to the chain's entries of
    /// `v` (`n` = nv; the others do not change). `twist` has 6 numbers: angular, rad/s, then linear, m/s; at the tip's origin, world axes, relative to
    /// the chain's base. Of all such rates the smallest are chosen, within rate limits, and not outward at a limit of a coordinate. Writes the residual
    /// to `residual` (2 numbers, rad/s and m/s; may be NULL). For several tasks, and guards, use `lw_rate_control_solve`.
    fn lw_robot_rates(
        r: &mut LwRobot,
        part: Part,
        twist: *const f64,
        v: *mut f64,
        n: usize,
        residual: *mut f64,
    ) {
        let twist = motion("twist", &value("twist", twist.cast::<[f64; 6]>())?)?;
        let residual = residual.cast::<[f64; 2]>();
        let residual =
            if residual.is_null() { None } else { Some(Out::new("residual", residual)?) };
        let v = numbers_mut("v", v, n, r.model().nv())?;
        let left = r.robot.rates(part, &twist, v)?;
        if let Some(residual) = residual {
            residual.set([left.orientation, left.position]);
        }
    }

    /// Creates the operational space of the tips of chains (`count` of them, at least one), in this order, and writes it to `out`; free it with
    /// `lw_task_space_free`. It works with every robot of the same model. It has six rows for each tip: angular, then linear, of the tip's origin, world
    /// axes.
    fn lw_task_space_new(
        r: &mut LwRobot,
        parts: *const u32,
        count: usize,
        out: Out<*mut LwTaskSpace>,
    ) {
        let parts = numbers("parts", parts, count, count)?;
        let parts = parts.iter().map(|p| r.part(*p)).collect::<Result<Vec<_>, _>>()?;
        let space = TaskSpace::new(&r.robot, &parts)?;
        let springs = Vec::with_capacity(count);
        let tool = Tool::new(r, Space { space, tips: count, springs });
        out.set(Box::into_raw(Box::new(LwTaskSpace(tool))));
    }

    /// Frees an operational space; NULL has no effect.
    fn lw_task_space_free(space: *mut LwTaskSpace);

    /// Writes the inverse of the task inertia at the robot's q, including held objects, to `out` (rows times rows, row after row; `n` = their product):
    /// accelerations of the tips for unit wrenches on them. Returns `LW_STATUS_SINGULAR` when a coordinate moves no mass.
    fn lw_task_space_compliance(r: &mut LwRobot, space: *mut LwTaskSpace, out: *mut f64, n: usize) {
        let mut space = lend("space", space, |s| &s.0, r)?;
        let rows = space.space.rows();
        let out = numbers_mut("out", out, n, rows * rows)?;
        out.copy_from_slice(space.space.compliance(&mut r.robot)?);
    }

    /// Writes the task inertia at the robot's q, including held objects, to `out` as in `lw_task_space_compliance`: kg m^2 and kg. Returns
    /// `LW_STATUS_SINGULAR` also where the tips cannot move independently.
    fn lw_task_space_inertia(r: &mut LwRobot, space: *mut LwTaskSpace, out: *mut f64, n: usize) {
        let mut space = lend("space", space, |s| &s.0, r)?;
        let rows = space.space.rows();
        let out = numbers_mut("out", out, n, rows * rows)?;
        space.space.inertia(&mut r.robot, out)?;
    }

    /// Computes forces `tau` (`n` = nv) at the robot's q and rates `v` (`n`) that give the tips the accelerations `a` (`rows` numbers: six for each tip,
    /// rad/s^2 and m/s^2), including gravity and held objects. The forces `rest` (`n`; may be NULL) are added in the null space, where they do not
    /// accelerate any tip. Returns `LW_STATUS_SINGULAR` where the tips cannot move independently.
    fn lw_task_space_forces(
        r: &mut LwRobot,
        space: *mut LwTaskSpace,
        v: *const f64,
        n: usize,
        a: *const f64,
        rows: usize,
        rest: *const f64,
        tau: *mut f64,
    ) {
        let mut space = lend("space", space, |s| &s.0, r)?;
        let rest_n = if rest.is_null() { 0 } else { n };
        disjoint(&[("v", v, n), ("a", a, rows), ("rest", rest, rest_n)], &[("tau", tau, n)])?;
        let nv = r.model().nv();
        let v = numbers("v", v, n, nv)?;
        let a = numbers("a", a, rows, space.space.rows())?;
        let own = numbers("rest", rest, rest_n, rest_n)?;
        let tau = numbers_mut("tau", tau, n, nv)?;
        let rest = (!rest.is_null()).then_some(own);
        space.space.forces(&mut r.robot, v, a, rest, tau)?;
    }

    /// Computes forces `tau` (`n` = nv) at the robot's q and rates `v` (`n`) that give each tip an impedance: `count` springs, one for each tip in the
    /// order of the parts. `rest` and `LW_STATUS_SINGULAR` as in `lw_task_space_forces`. Because no force is measured, the apparent inertia is that of
    /// the tips.
    fn lw_task_space_impedance(
        r: &mut LwRobot,
        space: *mut LwTaskSpace,
        v: *const f64,
        n: usize,
        springs: *const LwImpedance,
        count: usize,
        rest: *const f64,
        tau: *mut f64,
    ) {
        let mut space = lend("space", space, |s| &s.0, r)?;
        let rest_n = if rest.is_null() { 0 } else { n };
        disjoint(&[("v", v, n), ("rest", rest, rest_n)], &[("tau", tau, n)])?;
        let nv = r.model().nv();
        let v = numbers("v", v, n, nv)?;
        let Space { space, tips, springs: own } = &mut *space;
        if count != *tips {
            let (what, wanted) = ("springs", *tips);
            return Err(RobotError::Length { what, got: count, wanted }.into());
        }
        own.clear();
        for k in 0..count {
            own.push(value("springs", springs.wrapping_add(k))?.checked()?);
        }
        let still = numbers("rest", rest, rest_n, rest_n)?;
        let tau = numbers_mut("tau", tau, n, nv)?;
        let rest = (!rest.is_null()).then_some(still);
        space.impedance(&mut r.robot, v, own, rest, tau)?;
    }
];

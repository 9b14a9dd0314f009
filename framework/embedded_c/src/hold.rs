//! Objects in the hands.

use crate::call::calls;
use crate::edge::{LwPose, Out, apart, numbers, numbers_mut, value};
use crate::model::object_sizes;
use crate::robot::{Instance, LwPush, LwRobot, take_pushes};
use crate::status::Fault;
use linkwork_embedded::multibody::BodyId;
use linkwork_embedded::{Closing, ClosureRank, Grasp, Object, Part, RobotError};

/// Returns the given pose, or the object's current pose for NULL.
///
/// # Safety
/// The conditions in the crate documentation apply.
unsafe fn grasp(at: *const LwPose) -> Result<Grasp, Fault> {
    if at.is_null() {
        return Ok(Grasp::Here);
    }
    // SAFETY: guaranteed by the caller.
    Ok(Grasp::At(unsafe { value("at", at) }?.checked()?))
}

calls![
    /// Writes the pose of an object in the world: in the hand, on its carrier, or where it was placed or released last.
    fn lw_robot_object_pose(r: &mut LwRobot, object: Object, out: Out<LwPose>) {
        out.set(r.robot.object_pose(object)?.into());
    }

    /// Moves an object that no hand holds to a pose in the world.
    fn lw_robot_put(r: &mut LwRobot, object: Object, at: *const LwPose) {
        let at = value("at", at)?.checked()?;
        r.robot.put(object, at)?;
    }

    /// Grasps an object with a hand (the tip of a chain), at a pose in the tip's frame, or at its current pose (NULL). A second hand closes a loop and
    /// must be within 1e-6 m and rad of the pose that its grasp requires.
    fn lw_robot_grasp(r: &mut LwRobot, hand: Part, object: Object, at: *const LwPose) {
        r.robot.grasp(hand, object, grasp(at)?)?;
    }

    /// Changes the pose of a held object in the tip's frame of a hand that holds it, for example to the value of an estimator.
    fn lw_robot_update_grasp(r: &mut LwRobot, hand: Part, object: Object, at: *const LwPose) {
        let at = value("at", at)?.checked()?;
        r.robot.update_grasp(hand, object, at)?;
    }

    /// Releases an object from one hand. It stays in the other hand, or keeps its pose in the world.
    fn lw_robot_release(r: &mut LwRobot, hand: Part, object: Object) {
        r.robot.release(hand, object)?;
    }

    /// Releases an object from all hands. It keeps its pose in the world.
    fn lw_robot_ungrasp(r: &mut LwRobot, object: Object) {
        r.robot.ungrasp(object)?;
    }
];

/// Argument of `lw_robot_attach`: the object itself carries, not one of the bodies that hang on it.
pub const LW_ITSELF: u32 = u32::MAX;

calls![
    /// Attaches an object that no hand holds to another object, such as a battery to its driver or a wheel to its hub. `body`: the body of the other
    /// object that carries it, or `LW_ITSELF`. `at`: its pose in the frame of the carrier, or its current pose (NULL). It then moves with the carrier,
    /// and a hand that holds the carrier carries both.
    fn lw_robot_attach(r: &mut LwRobot, object: Object, on: Object, body: u32, at: *const LwPose) {
        let body = match body {
            LW_ITSELF => None,
            body => Some(self::body(r, on, body)?),
        };
        r.robot.attach(object, on, body, grasp(at)?)?;
    }

    /// Detaches an object. It keeps its pose in the world.
    fn lw_robot_detach(r: &mut LwRobot, object: Object) {
        r.robot.detach(object)?;
    }

    /// Writes the coordinates of an object's joints to `q` (`n`: their number), in the order of its bodies: depth first, siblings by name.
    fn lw_robot_object_q(r: &mut LwRobot, object: Object, q: *mut f64, n: usize) {
        let own = r.robot.object_q(object)?;
        numbers_mut("q", q, n, own.len())?.copy_from_slice(own);
    }

    /// Sets the coordinates of an object's joints, whether it is held or not: `q` (`n`: their number). Updates the load of the hand that carries it.
    fn lw_robot_set_object_q(r: &mut LwRobot, object: Object, q: *const f64, n: usize) {
        let q = numbers("q", q, n, r.robot.object_q(object)?.len())?;
        r.robot.set_object_q(object, q)?;
    }

    /// Like `lw_robot_feed_forward` (`v`, `vdot`, `tau`: `n` = nv each), while the joints of a held object move with `rates` and `accelerations`. Writes
    /// the forces at these joints to `forces` (`m` each: the object's degrees of freedom). Joints of other objects do not move.
    fn lw_robot_feed_forward_with_object(
        r: &mut LwRobot,
        v: *const f64,
        vdot: *const f64,
        n: usize,
        object: Object,
        rates: *const f64,
        accelerations: *const f64,
        m: usize,
        pushes: *const LwPush,
        push_count: usize,
        tau: *mut f64,
        forces: *mut f64,
    ) {
        for (what, p, len) in [
            ("v", v, n),
            ("vdot", vdot, n),
            ("rates", rates, m),
            ("accelerations", accelerations, m),
        ] {
            apart((what, p, len), ("tau", tau, n))?;
            apart((what, p, len), ("forces", forces, m))?;
        }
        apart(("tau", tau, n), ("forces", forces, m))?;
        let nv = r.model().nv();
        let (v, vdot) = (numbers("v", v, n, nv)?, numbers("vdot", vdot, n, nv)?);
        let own = r.robot.object_q(object)?.len();
        let rates = numbers("rates", rates, m, own)?;
        let accelerations = numbers("accelerations", accelerations, m, own)?;
        take_pushes(r, pushes, push_count)?;
        let tau = numbers_mut("tau", tau, n, nv)?;
        let forces = numbers_mut("forces", forces, m, own)?;
        let own = (rates, accelerations);
        r.robot.feed_forward_with_object((v, vdot), object, own, &r.pushes, tau, forces)?;
    }
];

/// Rank and mobility of a closed loop.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LwClosure {
    /// Number of equations of the loop.
    pub rows: u32,
    /// Number of independent equations in this configuration.
    pub rank: u32,
    /// Remaining degrees of freedom of the chains and joints in the loop.
    pub mobility: u32,
}

impl From<ClosureRank> for LwClosure {
    fn from(c: ClosureRank) -> Self {
        let [rows, rank, mobility] = [c.rows, c.rank, c.mobility].map(|n| n as u32);
        Self { rows, rank, mobility }
    }
}

/// Returns a body that hangs on an object, by index.
fn body(r: &Instance, object: Object, body: u32) -> Result<BodyId, RobotError> {
    let bodies = r.model().object_multibody(object).ok_or(RobotError::ForeignHandle)?;
    bodies.body_ids().nth(body as usize).ok_or(RobotError::ForeignHandle)
}

calls![
    /// Computes rank and mobility of the loop of two hands on an object at the robot's q.
    fn lw_robot_closure(r: &mut LwRobot, object: Object, out: Out<LwClosure>) {
        out.set(r.robot.closure(Closing::Hands(object))?.into());
    }

    /// Computes rank and mobility of the loop that a hand closes if it, or the object in it, is welded to a body of an object (`lw_model_object_body`) in
    /// the current configuration, such as a key in a lock. `free` (n: the object's degrees of freedom): 1 for joints of the object that may move, 0 for
    /// fixed ones.
    fn lw_robot_closure_onto(
        r: &mut LwRobot,
        hand: Part,
        object: Object,
        body: u32,
        free: *const u8,
        n: usize,
        out: Out<LwClosure>,
    ) {
        let own = object_sizes(r.model(), object)?.1;
        let flags = numbers("free", free, n, own)?;
        let body = self::body(r, object, body)?;
        r.free.clear();
        r.free.extend(flags.iter().map(|f| *f != 0));
        let onto = Closing::Onto { hand, object, body, free: &r.free };
        out.set(r.robot.closure(onto)?.into());
    }

    /// Writes the Jacobian of a body of an object (6 rows of its m degrees of freedom, row after row; `n` = 6 m). It maps rates of the object's joints to
    /// the angular, then linear velocity of the body relative to the object's base, at the body's origin, world axes.
    fn lw_robot_object_jacobian(r: &mut LwRobot, object: Object, body: u32, J: *mut f64, n: usize) {
        let body = self::body(r, object, body)?;
        let J = numbers_mut("J", J, n, 6 * object_sizes(r.model(), object)?.1)?;
        r.robot.object_jacobian(object, body, J)?;
    }

    /// Writes the pose in the world of a body that hangs on an object (`lw_model_object_body`).
    fn lw_robot_object_body_pose(r: &mut LwRobot, object: Object, body: u32, out: Out<LwPose>) {
        let id = self::body(r, object, body)?;
        out.set(r.robot.object_body_pose(object, id)?.into());
    }

    /// Writes the mass matrix at the robot's q, with the m joints of an object that it holds in the last rows and columns, to `M` (nv + m rows of nv + m,
    /// row after row; `n` = (nv + m)^2). Joints of other objects do not move.
    fn lw_robot_mass_matrix_with_object(r: &mut LwRobot, object: Object, M: *mut f64, n: usize) {
        let size = r.model().nv() + object_sizes(r.model(), object)?.1;
        let M = numbers_mut("M", M, n, size * size)?;
        r.robot.mass_matrix_with_object(object, M)?;
    }
];

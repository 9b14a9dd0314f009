//! What hands hold.

use crate::edge::{LwPose, Out, alone, apart, numbers, numbers_mut, value};
use crate::model::object_sizes;
use crate::robot::{Instance, LwPush, LwRobot, take_pushes};
use crate::status::{Fault, LwStatus};
use linkwork_embedded::multibody::BodyId;
use linkwork_embedded::{Closing, ClosureRank, Grasp, Object, RobotError};

/// The pose that is given, or where the object is now for NULL.
///
/// # Safety
/// The promises at the head of the crate.
unsafe fn grasp(at: *const LwPose) -> Result<Grasp, Fault> {
    if at.is_null() {
        return Ok(Grasp::Here);
    }
    // SAFETY: the caller's promises.
    Ok(Grasp::At(unsafe { value("at", at) }?.checked()?))
}

/// Where an object is in the world: in the hand, where it is attached, or where it was put or let go last.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_object_pose(
    robot: *mut LwRobot,
    object: u32,
    out: *mut LwPose,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, object) = (Out::new("out", out)?, r.object(object)?);
            out.set(r.robot.object_pose(object)?.into());
            Ok(())
        })
    }
}

/// Puts an object that nobody holds somewhere in the world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_put(
    robot: *mut LwRobot,
    object: u32,
    at: *const LwPose,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (object, at) = (r.object(object)?, value("at", at)?.checked()?);
            Ok(r.robot.put(object, at)?)
        })
    }
}

/// Takes an object with a hand (a chain: its tip), at a pose in the tip's frame, or where it is now (NULL). A second hand closes a loop, and has to
/// be where its grasp says within 1e-6 m and rad.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_grasp(
    robot: *mut LwRobot,
    hand: u32,
    object: u32,
    at: *const LwPose,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (hand, object) = (r.part(hand)?, r.object(object)?);
            Ok(r.robot.grasp(hand, object, grasp(at)?)?)
        })
    }
}

/// Another pose of a held object in the tip's frame of a hand that holds it, as an estimator found it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_update_grasp(
    robot: *mut LwRobot,
    hand: u32,
    object: u32,
    at: *const LwPose,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (hand, object) = (r.part(hand)?, r.object(object)?);
            let at = value("at", at)?.checked()?;
            Ok(r.robot.update_grasp(hand, object, at)?)
        })
    }
}

/// One hand lets go of an object: it stays in the other hand, or where it is in the world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_release(robot: *mut LwRobot, hand: u32, object: u32) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (hand, object) = (r.part(hand)?, r.object(object)?);
            Ok(r.robot.release(hand, object)?)
        })
    }
}

/// All hands let go of an object: it stays where it is in the world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_ungrasp(robot: *mut LwRobot, object: u32) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let object = r.object(object)?;
            Ok(r.robot.ungrasp(object)?)
        })
    }
}

/// Of `lw_robot_attach`: the object itself carries, none of its bodies.
pub const LW_ITSELF: u32 = u32::MAX;

/// Attaches an object that no hand holds to another one: a battery to its driver, a wheel to its hub. `body`: the body of that one that carries it, or `LW_ITSELF`. `at`: its pose in the frame
/// of what carries it, or where it is now (NULL). It then goes with that, and the hand that holds that carries both.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_attach(
    robot: *mut LwRobot,
    object: u32,
    on: u32,
    body: u32,
    at: *const LwPose,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (object, on) = (r.object(object)?, r.object(on)?);
            let body = match body {
                LW_ITSELF => None,
                body => Some(self::body(r, on, body)?),
            };
            Ok(r.robot.attach(object, on, body, grasp(at)?)?)
        })
    }
}

/// Takes an object off what it is attached to: it stays where it is in the world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_detach(robot: *mut LwRobot, object: u32) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let object = r.object(object)?;
            Ok(r.robot.detach(object)?)
        })
    }
}

/// Coordinates of the joints of an object into `q` (`n`: how many it has), in the order of its bodies: depth first, siblings by name.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_object_q(
    robot: *mut LwRobot,
    object: u32,
    q: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let object = r.object(object)?;
            let own = r.robot.object_q(object)?;
            numbers_mut("q", q, n, own.len())?.copy_from_slice(own);
            Ok(())
        })
    }
}

/// Other coordinates of the joints of an object, held or not: `q` (`n`: how many it has). The load of the hand that carries it follows.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_object_q(
    robot: *mut LwRobot,
    object: u32,
    q: *const f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let object = r.object(object)?;
            let q = numbers("q", q, n, r.robot.object_q(object)?.len())?;
            Ok(r.robot.set_object_q(object, q)?)
        })
    }
}

/// As `lw_robot_feed_forward` (`v`, `vdot`, `tau`: `n` = nv each) while the joints of a held object move: `rates` and `accelerations` of theirs, and into `forces` what they take
/// (`m` each: how many it has). Joints of other objects stand still.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_feed_forward_with_object(
    robot: *mut LwRobot,
    v: *const f64,
    vdot: *const f64,
    n: usize,
    object: u32,
    rates: *const f64,
    accelerations: *const f64,
    m: usize,
    pushes: *const LwPush,
    push_count: usize,
    tau: *mut f64,
    forces: *mut f64,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
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
            let (nv, object) = (r.model().nv(), r.object(object)?);
            let (v, vdot) = (numbers("v", v, n, nv)?, numbers("vdot", vdot, n, nv)?);
            let own = r.robot.object_q(object)?.len();
            let rates = numbers("rates", rates, m, own)?;
            let accelerations = numbers("accelerations", accelerations, m, own)?;
            take_pushes(r, pushes, push_count)?;
            let tau = numbers_mut("tau", tau, n, nv)?;
            let forces = numbers_mut("forces", forces, m, own)?;
            let own = (rates, accelerations);
            Ok(r.robot.feed_forward_with_object((v, vdot), object, own, &r.pushes, tau, forces)?)
        })
    }
}

/// What a closed loop leaves.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LwClosure {
    /// Rows of the loop's equations.
    pub rows: u32,
    /// How many of them are independent here.
    pub rank: u32,
    /// Degrees of freedom that are left to the chains and joints of the loop.
    pub mobility: u32,
}

impl From<ClosureRank> for LwClosure {
    fn from(c: ClosureRank) -> Self {
        let [rows, rank, mobility] = [c.rows, c.rank, c.mobility].map(|n| n as u32);
        Self { rows, rank, mobility }
    }
}

/// A body that hangs on an object.
fn body(r: &Instance, object: Object, body: u32) -> Result<BodyId, RobotError> {
    let bodies = r.model().object_multibody(object).ok_or(RobotError::ForeignHandle)?;
    bodies.body_ids().nth(body as usize).ok_or(RobotError::ForeignHandle)
}

/// What the loop of two hands on an object leaves at the robot's q.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_closure(
    robot: *mut LwRobot,
    object: u32,
    out: *mut LwClosure,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, object) = (Out::new("out", out)?, r.object(object)?);
            out.set(r.robot.closure(Closing::Hands(object))?.into());
            Ok(())
        })
    }
}

/// What is left when a hand, with what it holds, is welded to a body of an object (`lw_model_object_body`) as both stand: a key in a lock. `free` (n: the object's degrees of
/// freedom): which of its joints may move, 0 for those that stand.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_closure_onto(
    robot: *mut LwRobot,
    hand: u32,
    object: u32,
    body: u32,
    free: *const u8,
    n: usize,
    out: *mut LwClosure,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, hand, object) = (Out::new("out", out)?, r.part(hand)?, r.object(object)?);
            let own = object_sizes(r.model(), object)?.1;
            let flags = numbers("free", free, n, own)?;
            let body = self::body(r, object, body)?;
            r.free.clear();
            r.free.extend(flags.iter().map(|f| *f != 0));
            let onto = Closing::Onto { hand, object, body, free: &r.free };
            out.set(r.robot.closure(onto)?.into());
            Ok(())
        })
    }
}

/// The Jacobian of a body of an object (6 rows of its m degrees of freedom, row after row; `n` = 6 m): rates of the object's joints to the angular, then linear velocity of the body relative
/// to where the object is held or stands, at the body's origin, world axes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_object_jacobian(
    robot: *mut LwRobot,
    object: u32,
    body: u32,
    J: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let object = r.object(object)?;
            let body = self::body(r, object, body)?;
            let J = numbers_mut("J", J, n, 6 * object_sizes(r.model(), object)?.1)?;
            Ok(r.robot.object_jacobian(object, body, J)?)
        })
    }
}

/// Where a body that hangs on an object (`lw_model_object_body`) is in the world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_object_body_pose(
    robot: *mut LwRobot,
    object: u32,
    body: u32,
    out: *mut LwPose,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, object) = (Out::new("out", out)?, r.object(object)?);
            let id = self::body(r, object, body)?;
            out.set(r.robot.object_body_pose(object, id)?.into());
            Ok(())
        })
    }
}

/// The mass matrix at the robot's q with the m joints of an object that it holds in the last rows and columns, into `M` (nv + m rows of nv + m, row after row; `n` = their product). Joints of
/// other objects stand still.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_mass_matrix_with_object(
    robot: *mut LwRobot,
    object: u32,
    M: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let object = r.object(object)?;
            let size = r.model().nv() + object_sizes(r.model(), object)?.1;
            let M = numbers_mut("M", M, n, size * size)?;
            Ok(r.robot.mass_matrix_with_object(object, M)?)
        })
    }
}

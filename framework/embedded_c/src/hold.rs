//! What hands hold.

use crate::edge::{LwPose, Out, alone, value};
use crate::robot::LwRobot;
use crate::status::LwStatus;
use linkwork_embedded::Grasp;

/// Where an object is in the world: in the hand, or where it was put or let go last.
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
            let mut grasp = Grasp::Here;
            if !at.is_null() {
                grasp = Grasp::At(value("at", at)?.checked()?);
            }
            Ok(r.robot.grasp(hand, object, grasp)?)
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

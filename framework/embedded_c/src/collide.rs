//! Collisions at any configuration; the robot's own q does not matter.

use crate::edge::{Out, alone, numbers};
use crate::robot::{Instance, LwRobot};
use crate::status::{Fault, LwStatus};
use linkwork_embedded::{ColliderId, Occupancy, RobotError, Visibility};

/// The nearest pair of colliders.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwClosest {
    /// m, padding counted; negative when they overlap.
    pub distance: f64,
    /// On the first, world, m.
    pub point_a: [f64; 3],
    /// On the second, world, m.
    pub point_b: [f64; 3],
    /// The first collider.
    pub a: u32,
    /// The second collider.
    pub b: u32,
    /// Whether there is such a pair; else the rest is zero.
    pub found: bool,
}

/// Two colliders.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LwPair {
    /// The first.
    pub a: u32,
    /// The second.
    pub b: u32,
}

impl Instance {
    fn collider(&self, index: u32) -> Result<ColliderId, Fault> {
        let found = self.model().colliders().nth(index as usize).map(|c| c.0);
        Ok(found.ok_or(RobotError::ForeignHandle)?)
    }
}

/// Whether two colliders that meet touch or overlap at `q` (`n` = nq), padding counted, into `out`; what hands hold goes with them. A pair that touches into
/// `pair` (NULL: not asked for), where there is one.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_collides(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    out: *mut bool,
    pair: *mut LwPair,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let pair = if pair.is_null() { None } else { Some(Out::new("pair", pair)?) };
            let q = numbers("q", q, n, r.model().nq())?;
            let hit = r.robot.first_hit(q)?;
            out.set(hit.is_some());
            if let (Some((a, b)), Some(pair)) = (hit, pair) {
                pair.set(LwPair { a: a.index() as u32, b: b.index() as u32 });
            }
            Ok(())
        })
    }
}

/// The nearest pair of colliders that meet at `q` (`n` = nq), within `limit` (m, may be infinite), into `out`. Takes memory until that of contact points
/// has its size, and where cylinders overlap.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_clearance(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    limit: f64,
    out: *mut LwClosest,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let q = numbers("q", q, n, r.model().nq())?;
            let none = [0.0; 3];
            let mut told =
                LwClosest { distance: 0.0, point_a: none, point_b: none, a: 0, b: 0, found: false };
            if let Some(c) = r.robot.clearance(q, limit)? {
                told = LwClosest {
                    distance: c.distance.distance,
                    point_a: c.distance.point_a.into(),
                    point_b: c.distance.point_b.into(),
                    a: c.a.index() as u32,
                    b: c.b.index() as u32,
                    found: true,
                };
            }
            out.set(told);
            Ok(())
        })
    }
}

/// Thickness around a collider from now on, m.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_pad(
    robot: *mut LwRobot,
    collider: u32,
    padding: f64,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            Ok(r.robot.pad(id, padding)?)
        })
    }
}

/// Hides a collider from now on; `lw_robot_show` shows it again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_hide(robot: *mut LwRobot, collider: u32) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe { visible(robot, collider, Visibility::Hidden) }
}

/// Shows a collider from now on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_show(robot: *mut LwRobot, collider: u32) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe { visible(robot, collider, Visibility::Shown) }
}

/// # Safety
/// The promises at the head of the crate.
unsafe fn visible(robot: *mut LwRobot, collider: u32, visibility: Visibility) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            Ok(r.robot.show(id, visibility)?)
        })
    }
}

/// A pair is looked at from now on, whatever the rules and hands say.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_look_at(robot: *mut LwRobot, a: u32, b: u32) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe { look(robot, a, b, Some(true)) }
}

/// A pair is not looked at from now on, whatever the rules and hands say: the two may touch.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_allow(robot: *mut LwRobot, a: u32, b: u32) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe { look(robot, a, b, Some(false)) }
}

/// A pair is left to the rules and hands again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_by_rule(robot: *mut LwRobot, a: u32, b: u32) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe { look(robot, a, b, None) }
}

/// # Safety
/// The promises at the head of the crate.
unsafe fn look(robot: *mut LwRobot, a: u32, b: u32, look: Option<bool>) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (a, b) = (r.collider(a)?, r.collider(b)?);
            Ok(r.robot.look_at(a, b, look)?)
        })
    }
}

/// Other points of a cloud instead of those that it has: x, y, z, radius (m) of each of the `n`, one after the other, in the collider's frame. On a failure
/// those of before stay.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_points(
    robot: *mut LwRobot,
    collider: u32,
    points: *const f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            let points = numbers("points", points.cast::<[f64; 4]>(), n, n)?;
            Ok(r.robot.set_points(id, points)?)
        })
    }
}

/// Makes cells of a voxel map occupied: indices along x, y, z from 0 of each of the `n`, one after the other. On a failure nothing has changed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_cells(
    robot: *mut LwRobot,
    collider: u32,
    cells: *const u32,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe { change(robot, collider, cells, n, Occupancy::Occupied) }
}

/// Makes cells of a voxel map free: as `lw_robot_set_cells`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_free_cells(
    robot: *mut LwRobot,
    collider: u32,
    cells: *const u32,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe { change(robot, collider, cells, n, Occupancy::Free) }
}

/// # Safety
/// The promises at the head of the crate.
unsafe fn change(
    robot: *mut LwRobot,
    collider: u32,
    cells: *const u32,
    n: usize,
    to: Occupancy,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            let cells = numbers("cells", cells.cast::<[u32; 3]>(), n, n)?;
            Ok(r.robot.set_cells(id, cells, to)?)
        })
    }
}

/// Makes all cells of a voxel map free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_clear_cells(robot: *mut LwRobot, collider: u32) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            Ok(r.robot.clear_cells(id)?)
        })
    }
}

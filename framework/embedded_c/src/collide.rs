//! Collision queries at any configuration. The robot's own q has no effect.

use crate::edge::{Out, alone, list, numbers, numbers_mut, value};
use crate::robot::{Instance, LwRobot};
use crate::status::{Fault, LwStatus};
use linkwork_embedded::{Closest, ColliderId, Detail, Distance, Occupancy, RobotError, Visibility};
use std::mem::MaybeUninit;

/// Use the fine shapes of colliders.
pub const LW_DETAIL_FINE: u32 = 0;
/// Use the coarse shapes of colliders that have one.
pub const LW_DETAIL_COARSE: u32 = 1;

/// Distance of two colliders.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwClosest {
    /// Distance, m, including padding; negative for overlap.
    pub distance: f64,
    /// Closest point on the first collider, world, m.
    pub point_a: [f64; 3],
    /// Closest point on the second collider, world, m.
    pub point_b: [f64; 3],
    /// The first collider.
    pub a: u32,
    /// The second collider.
    pub b: u32,
    /// True if there is such a pair; otherwise all other fields are zero.
    pub found: bool,
}

impl LwClosest {
    const NONE: Self =
        Self { distance: 0.0, point_a: [0.0; 3], point_b: [0.0; 3], a: 0, b: 0, found: false };

    fn new(a: ColliderId, b: ColliderId, d: &Distance) -> Self {
        Self {
            distance: d.distance,
            point_a: d.point_a.into(),
            point_b: d.point_b.into(),
            a: a.index() as u32,
            b: b.index() as u32,
            found: true,
        }
    }
}

impl From<&Closest> for LwClosest {
    fn from(c: &Closest) -> Self {
        Self::new(c.a, c.b, &c.distance)
    }
}

/// Two colliders.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LwPair {
    /// The first collider.
    pub a: u32,
    /// The second collider.
    pub b: u32,
}

impl From<(ColliderId, ColliderId)> for LwPair {
    fn from((a, b): (ColliderId, ColliderId)) -> Self {
        Self { a: a.index() as u32, b: b.index() as u32 }
    }
}

impl Instance {
    fn collider(&self, index: u32) -> Result<ColliderId, Fault> {
        let found = self.model().colliders().nth(index as usize).map(|c| c.0);
        Ok(found.ok_or(RobotError::ForeignHandle)?)
    }
}

/// Writes to `out` whether two colliders of a checked pair touch or overlap at `q` (`n` = nq), including padding. Held objects move with the hands.
/// If there is a pair that touches, writes it to `pair` (may be NULL).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_collides(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    out: *mut bool,
    pair: *mut LwPair,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let pair = if pair.is_null() { None } else { Some(Out::new("pair", pair)?) };
            let q = numbers("q", q, n, r.model().nq())?;
            let hit = r.robot.first_hit(q)?;
            out.set(hit.is_some());
            if let (Some((a, b)), Some(pair)) = (hit, pair) {
                pair.set((a, b).into());
            }
            Ok(())
        })
    }
}

/// Writes to `out` (`rows` values) whether checked colliders touch or overlap at each of many configurations, `q` (`n` = rows · nq numbers, row after
/// row). Each result equals that of `lw_robot_collides`. Other threads may process part of the rows with clones of the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_collides_all(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    out: *mut bool,
    rows: usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let nq = r.model().nq();
            let q = numbers("q", q, n, rows.saturating_mul(nq))?;
            // The memory of a C program may not contain valid bools yet, so it is only written.
            let out = numbers_mut("out", out.cast::<MaybeUninit<bool>>(), rows, rows)?;
            if let Some(index) = q.iter().position(|x| !x.is_finite()) {
                return Err(RobotError::NotFinite { what: "q", index, value: q[index] }.into());
            }
            for (k, out) in out.iter_mut().enumerate() {
                out.write(r.robot.collides(&q[k * nq..(k + 1) * nq])?);
            }
            Ok(())
        })
    }
}

/// Writes the closest checked pair of colliders at `q` (`n` = nq) within `limit` (m, may be infinite) to `out`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_clearance(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    limit: f64,
    out: *mut LwClosest,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let q = numbers("q", q, n, r.model().nq())?;
            let told = r.robot.clearance(q, limit)?;
            out.set(told.as_ref().map_or(LwClosest::NONE, LwClosest::from));
            Ok(())
        })
    }
}

/// Writes the distance of two colliders at `q` (`n` = nq) with the closest points to `out`, including padding. It does not matter whether the pair is
/// checked or shown. `found` is false when one of them is an empty cloud or map, or both are unbounded.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_distance(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    a: u32,
    b: u32,
    out: *mut LwClosest,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let (a, b) = (r.collider(a)?, r.collider(b)?);
            let q = numbers("q", q, n, r.model().nq())?;
            let told = r.robot.distance(q, a, b)?;
            out.set(told.map_or(LwClosest::NONE, |d| LwClosest::new(a, b, &d)));
            Ok(())
        })
    }
}

/// Writes the distances of all checked pairs within `limit` (m, may be infinite) at `q` (`n` = nq) to `out`, sorted by colliders, and their number to
/// `count`. If there are more than `room`, returns `LW_STATUS_NO_ROOM` and writes only `count`. Allocates until the internal list of pairs has
/// reached its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_distances(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    limit: f64,
    out: *mut LwClosest,
    room: usize,
    count: *mut usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let count = Out::new("count", count)?;
            let q = numbers("q", q, n, r.model().nq())?;
            let out = numbers_mut("out", out, room, room)?;
            r.robot.distances(q, limit, &mut r.near)?;
            list("pairs", r.near.iter().map(LwClosest::from), out, count)
        })
    }
}

/// Writes all pairs that touch or overlap at `q` (`n` = nq), including padding, to `pairs`, and their number to `count`. If there are more than
/// `room`, returns `LW_STATUS_NO_ROOM` and writes only `count`. Allocates until the internal list of pairs has reached its size. `lw_robot_collides`
/// is faster if you only need to know whether there is a collision.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_hits(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    pairs: *mut LwPair,
    room: usize,
    count: *mut usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let count = Out::new("count", count)?;
            let q = numbers("q", q, n, r.model().nq())?;
            let pairs = numbers_mut("pairs", pairs, room, room)?;
            r.robot.hits(q, &mut r.hits)?;
            list("pairs", r.hits.iter().copied().map(LwPair::from), pairs, count)
        })
    }
}

/// Selects the shapes for all later collision queries: one of `LW_DETAIL_..`; default: fine.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_detail(robot: *mut LwRobot, detail: u32) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            r.robot.set_detail(shapes(detail)?);
            Ok(())
        })
    }
}

/// Like `lw_robot_set_detail`, for one collider.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_detail_of(
    robot: *mut LwRobot,
    collider: u32,
    detail: u32,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            Ok(r.robot.set_detail_of(id, shapes(detail)?)?)
        })
    }
}

fn shapes(detail: u32) -> Result<Detail, Fault> {
    match detail {
        LW_DETAIL_FINE => Ok(Detail::Fine),
        LW_DETAIL_COARSE => Ok(Detail::Coarse),
        value => {
            let (what, help) = ("detail", "one of LW_DETAIL_..");
            Err(Fault::Choice { what, value, help })
        }
    }
}

/// Writes to `out` whether a pair is checked for collisions while both colliders are shown.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_looks_at(
    robot: *mut LwRobot,
    a: u32,
    b: u32,
    out: *mut bool,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let (a, b) = (r.collider(a)?, r.collider(b)?);
            out.set(r.robot.looks_at(a, b)?);
            Ok(())
        })
    }
}

/// Sets the padding around a collider, m.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_pad(
    robot: *mut LwRobot,
    collider: u32,
    padding: f64,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            Ok(r.robot.pad(id, padding)?)
        })
    }
}

/// Like `lw_robot_pad`, for `n` colliders at once, for example those of a part (`lw_model_part_colliders`) or of an object. After an error no padding
/// has changed. Allocates if there are more names than colliders.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_pad_all(
    robot: *mut LwRobot,
    colliders: *const u32,
    n: usize,
    padding: f64,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let given = numbers("colliders", colliders, n, n)?;
            let mut all = std::mem::take(&mut r.padded);
            all.clear();
            let found = given.iter().try_for_each(|i| r.collider(*i).map(|id| all.push(id)));
            let done = found.and_then(|()| Ok(r.robot.pad_all(&all, padding)?));
            r.padded = all;
            done
        })
    }
}

/// Hides a collider, so that it is not checked; `lw_robot_show` shows it again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_hide(robot: *mut LwRobot, collider: u32) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { visible(robot, collider, Visibility::Hidden) }
}

/// Shows a hidden collider again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_show(robot: *mut LwRobot, collider: u32) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { visible(robot, collider, Visibility::Shown) }
}

/// # Safety
/// The conditions in the crate documentation apply.
unsafe fn visible(robot: *mut LwRobot, collider: u32, visibility: Visibility) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            Ok(r.robot.show(id, visibility)?)
        })
    }
}

/// Enables the collision check of a pair, regardless of the rules and of held objects.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_look_at(robot: *mut LwRobot, a: u32, b: u32) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { look(robot, a, b, Some(true)) }
}

/// Disables the collision check of a pair, regardless of the rules and of held objects, so that the two may touch.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_allow(robot: *mut LwRobot, a: u32, b: u32) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { look(robot, a, b, Some(false)) }
}

/// Removes the override of a pair, so that the rules and held objects decide again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_by_rule(robot: *mut LwRobot, a: u32, b: u32) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { look(robot, a, b, None) }
}

/// # Safety
/// The conditions in the crate documentation apply.
unsafe fn look(robot: *mut LwRobot, a: u32, b: u32, look: Option<bool>) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (a, b) = (r.collider(a)?, r.collider(b)?);
            Ok(r.robot.look_at(a, b, look)?)
        })
    }
}

/// Replaces the points of a cloud: x, y, z, radius (m) of each of the `n` points, one after the other, in the collider's frame. After an error the
/// points have not changed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_points(
    robot: *mut LwRobot,
    collider: u32,
    points: *const f64,
    n: usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            let points = numbers("points", points.cast::<[f64; 4]>(), n, n)?;
            Ok(r.robot.set_points(id, points)?)
        })
    }
}

/// Sets cells of a voxel map to occupied: indices along x, y, z from 0 of each of the `n` cells, one after the other. After an error nothing has
/// changed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_cells(
    robot: *mut LwRobot,
    collider: u32,
    cells: *const u32,
    n: usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { change(robot, collider, cells, n, Occupancy::Occupied) }
}

/// Sets cells of a voxel map to free; arguments as in `lw_robot_set_cells`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_free_cells(
    robot: *mut LwRobot,
    collider: u32,
    cells: *const u32,
    n: usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { change(robot, collider, cells, n, Occupancy::Free) }
}

/// # Safety
/// The conditions in the crate documentation apply.
unsafe fn change(
    robot: *mut LwRobot,
    collider: u32,
    cells: *const u32,
    n: usize,
    to: Occupancy,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            let cells = numbers("cells", cells.cast::<[u32; 3]>(), n, n)?;
            Ok(r.robot.set_cells(id, cells, to)?)
        })
    }
}

/// Sets all cells of a voxel map to free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_clear_cells(robot: *mut LwRobot, collider: u32) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let id = r.collider(collider)?;
            Ok(r.robot.clear_cells(id)?)
        })
    }
}

/// Writes to `out` whether a cell of a voxel map (3 indices along x, y, z from 0) is occupied.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_cell(
    robot: *mut LwRobot,
    collider: u32,
    cell: *const u32,
    out: *mut bool,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, id) = (Out::new("out", out)?, r.collider(collider)?);
            let cell = value("cell", cell.cast::<[u32; 3]>())?;
            out.set(r.robot.cell(id, cell)? == Occupancy::Occupied);
            Ok(())
        })
    }
}

/// Writes the number of points of a cloud, or of occupied cells of a voxel map, to `count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_count(
    robot: *mut LwRobot,
    collider: u32,
    count: *mut usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (count, id) = (Out::new("count", count)?, r.collider(collider)?);
            count.set(r.robot.count(id)?);
            Ok(())
        })
    }
}

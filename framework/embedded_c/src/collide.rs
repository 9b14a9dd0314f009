//! Collisions at any configuration; the robot's own q does not matter.

use crate::edge::{Out, alone, list, numbers, numbers_mut, value};
use crate::robot::{Instance, LwRobot};
use crate::status::{Fault, LwStatus};
use linkwork_embedded::{Closest, ColliderId, Detail, Distance, Occupancy, RobotError, Visibility};
use std::mem::MaybeUninit;

/// The shapes of colliders themselves.
pub const LW_DETAIL_FINE: u32 = 0;
/// Their coarse shapes, where they have one.
pub const LW_DETAIL_COARSE: u32 = 1;

/// How near two colliders are.
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
    /// The first.
    pub a: u32,
    /// The second.
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
                pair.set((a, b).into());
            }
            Ok(())
        })
    }
}

/// Whether two colliders that meet touch or overlap at each of many configurations, `q` (`n` = rows · nq numbers, row after row), into `out` (`rows`): each answer is that of
/// `lw_robot_collides`. Other threads may take part of the rows with clones of the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_collides_all(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    out: *mut bool,
    rows: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let nq = r.model().nq();
            let q = numbers("q", q, n, rows.saturating_mul(nq))?;
            // What C has there may be no bool yet: it is written and not read.
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

/// The nearest pair of colliders that meet at `q` (`n` = nq), within `limit` (m, may be infinite), into `out`.
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
            let told = r.robot.clearance(q, limit)?;
            out.set(told.as_ref().map_or(LwClosest::NONE, LwClosest::from));
            Ok(())
        })
    }
}

/// The distance of two colliders at `q` (`n` = nq), whether they meet, and are shown, or not, with the nearest points, into `out`; padding counted. Not `found` where one is a cloud or a map with nothing in it, or
/// both have no end.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_distance(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    a: u32,
    b: u32,
    out: *mut LwClosest,
) -> LwStatus {
    // SAFETY: the caller's promises.
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

/// The distances of all pairs that are looked at and within `limit` (m, may be infinite) at `q` (`n` = nq), in the order of colliders, into `out`, and how many there are into `count`. Where they are more
/// than `room`, `LW_STATUS_NO_ROOM`, and `count` alone is written. Takes memory until that of pairs has its size.
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
    // SAFETY: the caller's promises.
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

/// All pairs that touch or overlap at `q` (`n` = nq), into `pairs`, and how many there are into `count`; padding counted. Where they are more than `room`, `LW_STATUS_NO_ROOM`, and `count`
/// alone is written. Takes memory until that of pairs has its size. Whether there is any, `lw_robot_collides` tells sooner.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_hits(
    robot: *mut LwRobot,
    q: *const f64,
    n: usize,
    pairs: *mut LwPair,
    room: usize,
    count: *mut usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
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

/// Which shapes all questions of collisions take from now on: one of `LW_DETAIL_..`; the fine ones at first.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_detail(robot: *mut LwRobot, detail: u32) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            r.robot.set_detail(shapes(detail)?);
            Ok(())
        })
    }
}

/// As `lw_robot_set_detail`, of one collider.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_detail_of(
    robot: *mut LwRobot,
    collider: u32,
    detail: u32,
) -> LwStatus {
    // SAFETY: the caller's promises.
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

/// Whether a pair is looked at now when both are shown, into `out`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_looks_at(
    robot: *mut LwRobot,
    a: u32,
    b: u32,
    out: *mut bool,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let (a, b) = (r.collider(a)?, r.collider(b)?);
            out.set(r.robot.looks_at(a, b)?);
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

/// As `lw_robot_pad`, of `n` colliders at once: those of a part (`lw_model_part_colliders`) or of an object. All of them, or on a mistake none.
/// Takes memory for more names than there are colliders.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_pad_all(
    robot: *mut LwRobot,
    colliders: *const u32,
    n: usize,
    padding: f64,
) -> LwStatus {
    // SAFETY: the caller's promises.
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

/// Whether a cell of a voxel map (3 indices along x, y, z from 0) is occupied now, into `out`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_cell(
    robot: *mut LwRobot,
    collider: u32,
    cell: *const u32,
    out: *mut bool,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, id) = (Out::new("out", out)?, r.collider(collider)?);
            let cell = value("cell", cell.cast::<[u32; 3]>())?;
            out.set(r.robot.cell(id, cell)? == Occupancy::Occupied);
            Ok(())
        })
    }
}

/// How many points a cloud has now, or occupied cells a voxel map, into `count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_count(
    robot: *mut LwRobot,
    collider: u32,
    count: *mut usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (count, id) = (Out::new("count", count)?, r.collider(collider)?);
            count.set(r.robot.count(id)?);
            Ok(())
        })
    }
}

//! Collision queries at any configuration. The robot's own q has no effect.

use crate::call::calls;
use crate::edge::{Out, list, numbers, numbers_mut, value};
use crate::robot::LwRobot;
use crate::status::Fault;
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

calls![
    /// Writes to `out` whether two colliders of a checked pair touch or overlap at `q` (`n` = nq), including padding. Held objects move with the hands.
    /// If there is a pair that touches, writes it to `pair` (may be NULL).
    fn lw_robot_collides(
        r: &mut LwRobot,
        q: *const f64,
        n: usize,
        out: Out<bool>,
        pair: Option<Out<LwPair>>,
    ) {
        let q = numbers("q", q, n, r.model().nq())?;
        let hit = r.robot.first_hit(q)?;
        out.set(hit.is_some());
        if let (Some((a, b)), Some(pair)) = (hit, pair) {
            pair.set((a, b).into());
        }
    }

    /// Writes to `out` (`rows` values) whether checked colliders touch or overlap at each of many configurations, `q` (`n` = rows · nq numbers, row after
    /// row). Each result equals that of `lw_robot_collides`. Other threads may process part of the rows with clones of the robot.
    fn lw_robot_collides_all(
        r: &mut LwRobot,
        q: *const f64,
        n: usize,
        out: *mut bool,
        rows: usize,
    ) {
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
    }

    /// Writes the closest checked pair of colliders at `q` (`n` = nq) within `limit` (m, may be infinite) to `out`.
    fn lw_robot_clearance(
        r: &mut LwRobot,
        q: *const f64,
        n: usize,
        limit: f64,
        out: Out<LwClosest>,
    ) {
        let q = numbers("q", q, n, r.model().nq())?;
        let told = r.robot.clearance(q, limit)?;
        out.set(told.as_ref().map_or(LwClosest::NONE, LwClosest::from));
    }

    /// Writes the distance of two colliders at `q` (`n` = nq) with the closest points to `out`, including padding. It does not matter whether the pair is
    /// checked or shown. `found` is false when one of them is an empty cloud or map, or both are unbounded.
    fn lw_robot_distance(
        r: &mut LwRobot,
        q: *const f64,
        n: usize,
        a: ColliderId,
        b: ColliderId,
        out: Out<LwClosest>,
    ) {
        let q = numbers("q", q, n, r.model().nq())?;
        let told = r.robot.distance(q, a, b)?;
        out.set(told.map_or(LwClosest::NONE, |d| LwClosest::new(a, b, &d)));
    }

    /// Writes the distances of all checked pairs within `limit` (m, may be infinite) at `q` (`n` = nq) to `out`, sorted by colliders, and their number to
    /// `count`. If there are more than `room`, returns `LW_STATUS_NO_ROOM` and writes only `count`. Allocates until the internal list of pairs has
    /// reached its size.
    fn lw_robot_distances(
        r: &mut LwRobot,
        q: *const f64,
        n: usize,
        limit: f64,
        out: *mut LwClosest,
        room: usize,
        count: Out<usize>,
    ) {
        let q = numbers("q", q, n, r.model().nq())?;
        let out = numbers_mut("out", out, room, room)?;
        r.robot.distances(q, limit, &mut r.near)?;
        list("pairs", r.near.iter().map(LwClosest::from), out, count)?;
    }

    /// Writes all pairs that touch or overlap at `q` (`n` = nq), including padding, to `pairs`, and their number to `count`. If there are more than
    /// `room`, returns `LW_STATUS_NO_ROOM` and writes only `count`. Allocates until the internal list of pairs has reached its size. `lw_robot_collides`
    /// is faster if you only need to know whether there is a collision.
    fn lw_robot_hits(
        r: &mut LwRobot,
        q: *const f64,
        n: usize,
        pairs: *mut LwPair,
        room: usize,
        count: Out<usize>,
    ) {
        let q = numbers("q", q, n, r.model().nq())?;
        let pairs = numbers_mut("pairs", pairs, room, room)?;
        r.robot.hits(q, &mut r.hits)?;
        list("pairs", r.hits.iter().copied().map(LwPair::from), pairs, count)?;
    }

    /// Selects the shapes for all later collision queries: one of `LW_DETAIL_..`; default: fine.
    fn lw_robot_set_detail(r: &mut LwRobot, detail: u32) {
        r.robot.set_detail(shapes(detail)?);
    }

    /// Like `lw_robot_set_detail`, for one collider.
    fn lw_robot_set_detail_of(r: &mut LwRobot, collider: ColliderId, detail: u32) {
        r.robot.set_detail_of(collider, shapes(detail)?)?;
    }

    /// Writes to `out` whether a pair is checked for collisions while both colliders are shown.
    fn lw_robot_looks_at(r: &mut LwRobot, a: ColliderId, b: ColliderId, out: Out<bool>) {
        out.set(r.robot.looks_at(a, b)?);
    }

    /// Sets the padding around a collider, m.
    fn lw_robot_pad(r: &mut LwRobot, collider: ColliderId, padding: f64) {
        r.robot.pad(collider, padding)?;
    }

    /// Like `lw_robot_pad`, for `n` colliders at once, for example those of a part (`lw_model_part_colliders`) or of an object. After an error no padding
    /// has changed. Allocates if there are more names than colliders.
    fn lw_robot_pad_all(r: &mut LwRobot, colliders: *const u32, n: usize, padding: f64) {
        let given = numbers("colliders", colliders, n, n)?;
        let mut all = std::mem::take(&mut r.padded);
        all.clear();
        let found = given.iter().try_for_each(|i| r.collider(*i).map(|id| all.push(id)));
        let done = found.and_then(|()| Ok(r.robot.pad_all(&all, padding)?));
        r.padded = all;
        done?;
    }

    /// Hides a collider, so that it is not checked; `lw_robot_show` shows it again.
    fn lw_robot_hide(r: &mut LwRobot, collider: ColliderId) {
        r.robot.show(collider, Visibility::Hidden)?;
    }

    /// Shows a hidden collider again.
    fn lw_robot_show(r: &mut LwRobot, collider: ColliderId) {
        r.robot.show(collider, Visibility::Shown)?;
    }

    /// Enables the collision check of a pair, regardless of the rules and of held objects.
    fn lw_robot_look_at(r: &mut LwRobot, a: ColliderId, b: ColliderId) {
        r.robot.look_at(a, b, Some(true))?;
    }

    /// Disables the collision check of a pair, regardless of the rules and of held objects, so that the two may touch.
    fn lw_robot_allow(r: &mut LwRobot, a: ColliderId, b: ColliderId) {
        r.robot.look_at(a, b, Some(false))?;
    }

    /// Removes the override of a pair, so that the rules and held objects decide again.
    fn lw_robot_by_rule(r: &mut LwRobot, a: ColliderId, b: ColliderId) {
        r.robot.look_at(a, b, None)?;
    }

    /// Replaces the points of a cloud: x, y, z, radius (m) of each of the `n` points, one after the other, in the collider's frame. After an error the
    /// points have not changed.
    fn lw_robot_set_points(r: &mut LwRobot, collider: ColliderId, points: *const f64, n: usize) {
        let points = numbers("points", points.cast::<[f64; 4]>(), n, n)?;
        r.robot.set_points(collider, points)?;
    }

    /// Sets cells of a voxel map to occupied: indices along x, y, z from 0 of each of the `n` cells, one after the other. After an error nothing has
    /// changed.
    fn lw_robot_set_cells(r: &mut LwRobot, collider: ColliderId, cells: *const u32, n: usize) {
        let cells = numbers("cells", cells.cast::<[u32; 3]>(), n, n)?;
        r.robot.set_cells(collider, cells, Occupancy::Occupied)?;
    }

    /// Sets cells of a voxel map to free; arguments as in `lw_robot_set_cells`.
    fn lw_robot_free_cells(r: &mut LwRobot, collider: ColliderId, cells: *const u32, n: usize) {
        let cells = numbers("cells", cells.cast::<[u32; 3]>(), n, n)?;
        r.robot.set_cells(collider, cells, Occupancy::Free)?;
    }

    /// Sets all cells of a voxel map to free.
    fn lw_robot_clear_cells(r: &mut LwRobot, collider: ColliderId) {
        r.robot.clear_cells(collider)?;
    }

    /// Writes to `out` whether a cell of a voxel map (3 indices along x, y, z from 0) is occupied.
    fn lw_robot_cell(r: &mut LwRobot, collider: ColliderId, cell: *const u32, out: Out<bool>) {
        let cell = value("cell", cell.cast::<[u32; 3]>())?;
        out.set(r.robot.cell(collider, cell)? == Occupancy::Occupied);
    }

    /// Writes the number of points of a cloud, or of occupied cells of a voxel map, to `count`.
    fn lw_robot_count(r: &mut LwRobot, collider: ColliderId, count: Out<usize>) {
        count.set(r.robot.count(collider)?);
    }
];

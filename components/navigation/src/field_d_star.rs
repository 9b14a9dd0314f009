//! Field D*: cost to the goal from any point of a cost grid that changes as the ground is observed.
//! ```text
//! V(s)             minimum cost from a cell corner s to the goal, in cell edges: cost of a cell × length in it
//! on edges   V is linear between corners;  a path from s goes straight to a point of an opposite edge, or along an edge and then across
//! rhs(s)         minimum of these over the eight edges around s; corners of the goal's cell: also the straight line to the goal
//! g(s)             current value of V(s). Corners with g ≠ rhs are queued in order of min(g, rhs); the first is expanded:
//!            g > rhs:  g = rhs          g < rhs:  g = ∞          and rhs of its neighbours is recomputed
//! ```
//! Ferguson & Stentz, "Field D*: an interpolation-based path planner and replanner", ISRR 2005, figures 4 and 5; replanning as in Koenig &
//! Likhachev, "D* Lite", AAAI 2002. Unlike there, the queue order has no heuristic distance to the rover, because values
//! are needed all around the rover to compare its arcs; the queue then need not be reordered when the rover moves. Values are correct up to the
//! rover's own cost plus `beyond`. Farther corners may be unexpanded; their cost is then infinite.
//!
//! Linear interpolation on edges overestimates the cost in open terrain by up to 1 %. Paths may pass through a corner where two obstacles touch, so
//! obstacles must be grown by the size of the rover first.

use crate::tiles::{Index, cell_at};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Maximum number of cells of a region; each takes 40 bytes.
pub const CELLS_MAX: usize = 1 << 22;
/// A point within this fraction of a cell from an edge lies on the edge.
const ON: f64 = 1e-9;

/// A rectangle of cells.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Region {
    /// Edge of a cell, m.
    pub cell: f64,
    /// The cell of minimum x and y.
    pub first: Index,
    /// Cells along x and y.
    pub size: [usize; 2],
}

/// Error of a region.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RegionFault {
    /// A corner is not finite or too far away.
    #[error(
        "the corners {from:?} and {to:?} with cells of {cell} m are not a valid region\n help: give finite corners in order and a positive cell size"
    )]
    Corners {
        /// Edge of a cell, m.
        cell: f64,
        /// Least x and y, m.
        from: [f64; 2],
        /// Greatest x and y, m.
        to: [f64; 2],
    },
    /// Too many cells.
    #[error(
        "a region of {x} by {y} cells is too large\n help: the maximum is {CELLS_MAX} cells: make the region smaller or the cells larger"
    )]
    Cells {
        /// Along x.
        x: i64,
        /// Along y.
        y: i64,
    },
}

impl Region {
    /// Creates the region of all cells that overlap the rectangle between two corners (m).
    ///
    /// # Errors
    /// [`RegionFault`].
    pub fn new(cell: f64, from: [f64; 2], to: [f64; 2]) -> Result<Self, RegionFault> {
        let corners = (cell_at(cell, from), cell_at(cell, to));
        let ((Some(first), Some(last)), true) =
            (corners, cell > 0.0 && from[0] <= to[0] && from[1] <= to[1])
        else {
            return Err(RegionFault::Corners { cell, from, to });
        };
        let [x, y] = [0, 1].map(|k| i64::from(last[k]) - i64::from(first[k]) + 1);
        if x.saturating_mul(y) > CELLS_MAX as i64 {
            return Err(RegionFault::Cells { x, y });
        }
        Ok(Region { cell, first, size: [x as usize, y as usize] })
    }

    /// Returns its corners of minimum and maximum x and y, m.
    #[must_use]
    pub fn corners(&self) -> [[f64; 2]; 2] {
        let corner = |k: usize, more: usize| (f64::from(self.first[k]) + more as f64) * self.cell;
        [[corner(0, 0), corner(1, 0)], [0, 1].map(|k| corner(k, self.size[k]))]
    }

    /// Returns the index of a cell, row by row along x; `None` outside.
    #[must_use]
    pub fn place(&self, [i, j]: Index) -> Option<usize> {
        let at = [i64::from(i) - i64::from(self.first[0]), i64::from(j) - i64::from(self.first[1])];
        let inside = (0..2).all(|k| at[k] >= 0 && at[k] < self.size[k] as i64);
        inside.then(|| at[1] as usize * self.size[0] + at[0] as usize)
    }

    /// Converts a point (m) to cell edges from the region's corner; `None` outside.
    fn inside(&self, p: [f64; 2]) -> Option<[f64; 2]> {
        let at = [0, 1].map(|k| p[k] / self.cell - f64::from(self.first[k]));
        // The comparisons are false for NaN, so it counts as outside.
        let inside = (0..2).all(|k| at[k] >= 0.0 && at[k] <= self.size[k] as f64);
        inside.then_some(at)
    }

    /// Returns whether a point (m) is inside.
    #[must_use]
    pub fn contains(&self, p: [f64; 2]) -> bool {
        self.inside(p).is_some()
    }
}

/// Result of planning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathCost {
    /// A path exists, with this cost: metres at a cost of 1.
    Found(f64),
    /// Obstacles separate the rover from the goal.
    Closed,
    /// The rover is in an obstacle. Values around it are correct and show where to go once it is out.
    InObstacle,
    /// The goal is in an obstacle.
    GoalInObstacle,
    /// The rover is outside the region.
    Outside,
}

/// A planner with one goal. Costs of cells are positive, ∞ for an obstacle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Planner {
    region: Region,
    /// Goal in cell edges from the region's corner.
    goal: [f64; 2],
    cost: Vec<f64>,
    g: Vec<f64>,
    rhs: Vec<f64>,
    /// Queue: the bits of min(g, rhs), which have the order of the number, and the corner.
    open: BTreeSet<(u64, u32)>,
}

/// Returns the cost from a corner through the edge between two neighbours with values g₁ (adjacent) and g₂ (diagonal). c is the cost of their cell, b
/// the cost of the cell on the other side of the edge to the adjacent neighbour.
fn across(c: f64, b: f64, g1: f64, g2: f64) -> f64 {
    if c.is_infinite() || g1 <= g2 {
        return c.min(b) + g1;
    }
    let f = g1 - g2;
    if f <= b {
        if c <= f {
            return c * std::f64::consts::SQRT_2 + g2;
        }
        let y = (f / (c * c - f * f).sqrt()).min(1.0);
        return c * (1.0 + y * y).sqrt() + f * (1.0 - y) + g2;
    }
    if c <= b {
        return c * std::f64::consts::SQRT_2 + g2;
    }
    let rest = (b / (c * c - b * b).sqrt()).min(1.0);
    c * (1.0 + rest * rest).sqrt() + b * (1.0 - rest) + g2
}

/// Minimizes c |p − q| + V(q) over an edge from a to b with values g_a and g_b. Returns the total, q and V(q).
fn cross(c: f64, p: [f64; 2], a: [f64; 2], b: [f64; 2], ga: f64, gb: f64) -> (f64, [f64; 2], f64) {
    let e = [b[0] - a[0], b[1] - a[1]];
    let r = [p[0] - a[0], p[1] - a[1]];
    let (foot, off) = (r[0] * e[0] + r[1] * e[1], (r[0] * e[1] - r[1] * e[0]).abs());
    let at = |t: f64| {
        let value = if t == 0.0 {
            ga
        } else if t == 1.0 {
            gb
        } else {
            ga + (gb - ga) * t
        };
        let way = off.hypot(t - foot);
        (if way > 0.0 { c * way } else { 0.0 } + value, [a[0] + t * e[0], a[1] + t * e[1]], value)
    };
    let f = gb - ga;
    let mut best = at(0.0);
    let end = at(1.0);
    if end.0 < best.0 {
        best = end;
    }
    if f.abs() < c && c.is_finite() {
        let t = (foot - f * off / (c * c - f * f).sqrt()).clamp(0.0, 1.0);
        let inner = at(t);
        if inner.0 < best.0 {
            best = inner;
        }
    }
    best
}

impl Planner {
    /// Creates a planner over a region for a goal (m), with every cell at `cost`; `None` if the goal is outside the region.
    ///
    /// # Panics
    /// Panics if the cost is not positive.
    #[must_use]
    pub fn new(region: Region, goal: [f64; 2], cost: f64) -> Option<Self> {
        assert!(cost > 0.0, "costs must be positive");
        let goal = region.inside(goal)?;
        let [x, y] = region.size;
        let nodes = (x + 1) * (y + 1);
        let mut planner = Planner {
            region,
            goal,
            cost: vec![cost; x * y],
            g: vec![f64::INFINITY; nodes],
            rhs: vec![f64::INFINITY; nodes],
            open: BTreeSet::new(),
        };
        for node in planner.corners(planner.cell_of(goal)) {
            planner.reconsider(node);
        }
        Some(planner)
    }

    /// Returns the region.
    #[must_use]
    pub fn region(&self) -> &Region {
        &self.region
    }

    /// Returns the cost of a cell; `None` outside.
    #[must_use]
    pub fn cost(&self, cell: Index) -> Option<f64> {
        self.region.place(cell).map(|k| self.cost[k])
    }

    /// Changes the costs of cells; cells outside the region are ignored. Values are valid again after [`Planner::plan`].
    ///
    /// # Panics
    /// Panics if a cost is not positive.
    pub fn change(&mut self, cells: impl IntoIterator<Item = (Index, f64)>) {
        let mut nodes = BTreeSet::new();
        for (cell, cost) in cells {
            assert!(cost > 0.0, "costs must be positive");
            let Some(place) = self.region.place(cell) else { continue };
            if self.cost[place].to_bits() != cost.to_bits() {
                self.cost[place] = cost;
                nodes.extend(
                    self.corners([place % self.region.size[0], place / self.region.size[0]]),
                );
            }
        }
        nodes.into_iter().for_each(|node| self.reconsider(node));
    }

    /// Updates all values up to the value at the rover's position `from` (m) plus `beyond` (metres at a cost of 1).
    pub fn plan(&mut self, from: [f64; 2], beyond: f64) -> PathCost {
        let Some(p) = self.region.inside(from) else { return PathCost::Outside };
        let corners = self.corners(self.cell_of(p));
        let known = |s: &Self, n: usize| low(s.g[n], s.rhs[n]);
        // Bound the value at the rover's position: it is at most the value of the nearest corner
        // plus the cost of the path to it.
        let own = Some(self.at(self.cell_of(p))).filter(|c| c.is_finite()).unwrap_or(0.0);
        let more = own * std::f64::consts::SQRT_2 + beyond / self.region.cell;
        while let Some((bits, node)) = self.open.first().copied() {
            let nearest = corners.iter().map(|n| known(self, *n)).fold(f64::INFINITY, low);
            if f64::from_bits(bits) > nearest + more {
                break;
            }
            self.expand(node as usize);
        }
        let goal_is_free = self.at(self.cell_of(self.goal)).is_finite();
        match (goal_is_free, self.at(self.cell_of(p)).is_finite(), self.value(from)) {
            (false, ..) => PathCost::GoalInObstacle,
            (_, false, _) => PathCost::InObstacle,
            (.., v) if v.is_finite() => PathCost::Found(v),
            _ => PathCost::Closed,
        }
    }

    /// Returns the cost to the goal from a point (m), in metres at a cost of 1. It is ∞ in an obstacle, outside the region, where no path exists, and
    /// where [`Planner::plan`] has not expanded the corners.
    #[must_use]
    pub fn value(&self, p: [f64; 2]) -> f64 {
        let Some(p) = self.region.inside(p) else { return f64::INFINITY };
        let cell = self.cell_of(p);
        let c = self.at(cell);
        if c.is_infinite() {
            return f64::INFINITY;
        }
        let sides = self.sides(cell).map(|[a, b]| self.side(c, p, a, b).0);
        let straight = self.straight(cell, p).unwrap_or(f64::INFINITY);
        self.region.cell * sides.into_iter().fold(straight, low)
    }

    /// Returns the path from a point to the goal as a polyline, m, beginning with the point. It is truncated to `count` vertices. Without a path it
    /// contains only the point.
    #[must_use]
    pub fn path(&self, from: [f64; 2], count: usize) -> Vec<[f64; 2]> {
        let mut out = vec![from];
        let Some(mut p) = self.region.inside(from) else { return out };
        let mut value = f64::INFINITY;
        while out.len() < count {
            let Some((next, left)) = self.step(p, value) else { break };
            out.push(
                [0, 1].map(|k| (next[k] + f64::from(self.region.first[k])) * self.region.cell),
            );
            (p, value) = (next, left);
            if value == 0.0 {
                break;
            }
        }
        out
    }

    /// Returns the cheapest step from a point to the next edge among those that reach a smaller value than `value`.
    fn step(&self, p: [f64; 2], value: f64) -> Option<([f64; 2], f64)> {
        let mut best: Option<(f64, [f64; 2], f64)> = None;
        let mut offer = |(total, q, left): (f64, [f64; 2], f64)| {
            if total.is_finite() && left < value && best.is_none_or(|b| total < b.0) {
                best = Some((total, q, left));
            }
        };
        // A point on an edge belongs to both cells, and a corner to four.
        let around = |k: usize| {
            let (near, last) = (p[k].round(), self.region.size[k] as f64 - 1.0);
            let on = (p[k] - near).abs() < ON;
            let (low, high) = if on { (near - 1.0, near) } else { (p[k].floor(), p[k].floor()) };
            low.max(0.0) as usize..=high.min(last) as usize
        };
        for cell in around(1).flat_map(|j| around(0).map(move |i| [i, j])) {
            let c = self.at(cell);
            if c.is_infinite() {
                continue;
            }
            if let Some(total) = self.straight(cell, p) {
                offer((total, self.goal, 0.0));
            }
            self.sides(cell).into_iter().for_each(|[a, b]| offer(self.side(c, p, a, b)));
        }
        best.map(|(_, q, left)| (q, left))
    }

    /// Returns the cost of the straight line to the goal if it is in this cell.
    fn straight(&self, cell: [usize; 2], p: [f64; 2]) -> Option<f64> {
        let way = (p[0] - self.goal[0]).hypot(p[1] - self.goal[1]);
        (self.cell_of(self.goal) == cell).then(|| if way > 0.0 { self.at(cell) * way } else { 0.0 })
    }

    fn side(&self, c: f64, p: [f64; 2], a: usize, b: usize) -> (f64, [f64; 2], f64) {
        let wide = self.region.size[0] + 1;
        let place = |n: usize| [(n % wide) as f64, (n / wide) as f64];
        cross(c, p, place(a), place(b), self.g[a], self.g[b])
    }

    /// Returns the four edges of a cell as pairs of corners.
    fn sides(&self, cell: [usize; 2]) -> [[usize; 2]; 4] {
        let [a, b, c, d] = self.corners(cell);
        [[a, b], [b, d], [c, d], [a, c]]
    }

    /// Returns the corners of a cell: minimum x and y, then greater x, then greater y, then both.
    fn corners(&self, [i, j]: [usize; 2]) -> [usize; 4] {
        let wide = self.region.size[0] + 1;
        let n = j * wide + i;
        [n, n + 1, n + wide, n + wide + 1]
    }

    /// Returns the cell of an inside point, relative to the region's first cell.
    fn cell_of(&self, p: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|k| (p[k] as usize).min(self.region.size[k] - 1))
    }

    fn at(&self, [i, j]: [usize; 2]) -> f64 {
        self.cost[j * self.region.size[0] + i]
    }

    /// Returns the costs of the four cells around a corner, ∞ outside, counterclockwise from the cell of greater x and y; and the corner's indices.
    fn cells_around(&self, node: usize) -> ([f64; 4], [usize; 2]) {
        let wide = self.region.size[0] + 1;
        let at = [node % wide, node / wide];
        let cell = |[di, dj]: [usize; 2]| {
            let (i, j) = (at[0].wrapping_sub(di), at[1].wrapping_sub(dj));
            match i < self.region.size[0] && j < self.region.size[1] {
                true => self.at([i, j]),
                false => f64::INFINITY,
            }
        };
        ([[0, 0], [1, 0], [1, 1], [0, 1]].map(cell), at)
    }

    /// Recomputes rhs of a corner and updates its place in the queue.
    fn reconsider(&mut self, node: usize) {
        let (cells, [i, j]) = self.cells_around(node);
        // The neighbours are counterclockwise, starting at greater x. Even ones are adjacent and odd ones
        // are diagonal.
        const AROUND: [[isize; 2]; 8] =
            [[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1]];
        let [nx, ny] = self.region.size;
        let g = AROUND.map(|[di, dj]| {
            let (x, y) = (i.wrapping_add_signed(di), j.wrapping_add_signed(dj));
            if x <= nx && y <= ny { self.g[y * (nx + 1) + x] } else { f64::INFINITY }
        });
        let mut best = f64::INFINITY;
        for k in 0..4 {
            let (c, before, after) = (cells[k], cells[(k + 3) % 4], cells[(k + 1) % 4]);
            let corner = g[2 * k + 1];
            best = low(best, across(c, before, g[2 * k], corner));
            best = low(best, across(c, after, g[(2 * k + 2) % 8], corner));
        }
        let of_goal = self.cell_of(self.goal);
        if self.corners(of_goal).contains(&node)
            && let Some(way) = self.straight(of_goal, [i as f64, j as f64])
        {
            best = low(best, way);
        }
        self.leave(node);
        self.rhs[node] = best;
        self.wait(node);
    }

    fn key(&self, node: usize) -> (u64, u32) {
        (low(self.g[node], self.rhs[node]).to_bits(), node as u32)
    }

    fn leave(&mut self, node: usize) {
        if self.g[node] != self.rhs[node] {
            self.open.remove(&self.key(node));
        }
    }

    fn wait(&mut self, node: usize) {
        if self.g[node] != self.rhs[node] {
            self.open.insert(self.key(node));
        }
    }

    /// Expands the first corner of the queue.
    fn expand(&mut self, node: usize) {
        self.leave(node);
        let better = self.g[node] > self.rhs[node];
        self.g[node] = if better { self.rhs[node] } else { f64::INFINITY };
        self.wait(node);
        let wide = self.region.size[0] + 1;
        let (i, j) = (node % wide, node / wide);
        let [nx, ny] = self.region.size;
        for y in j.saturating_sub(1)..=(j + 1).min(ny) {
            for x in i.saturating_sub(1)..=(i + 1).min(nx) {
                if [x, y] != [i, j] {
                    self.reconsider(y * wide + x);
                }
            }
        }
    }
}

/// Returns the lesser of two numbers that are not NaN.
#[inline]
fn low(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

#[cfg(test)]
mod tests;

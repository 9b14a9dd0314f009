//! Navigation of a rover from observed points: mapping, terrain assessment, planning, arc votes, drive commands, and reasons for giving up.
//! ```text
//! picture     points in W, except points on the rover itself → map → goodness → costs of the planner's cells
//! cost        1 + w (1 − goodness/255) of the worst map cell inside; ∞ for a hazard; 1 + w u for unknown ground; three times as much where the outer discs
//! of the body would touch a hazard at some headings
//! sample      plan from here; votes of the arcs; the move with most votes; speed and turn rate
//! stops             permanently, if tilt or slip exceeds its limit, if there is no path or no open move for longer than `patience`,
//!             or if the cost to the goal has had no new minimum for `progress`
//! ```
//! The rover stops while no move is possible. A rover that has stopped permanently or has arrived stays in that state until it is restarted.

use crate::arcs::{Arcs, DriveRequest, Move, Place, Vote, end_of};
use crate::assess::{Assessor, BEST, Patch};
use crate::field_d_star::{PathCost, Planner, Region};
use crate::ground::{Disc, Ground, Sight};
use crate::map::{Grid, TerrainMap};
use crate::tiles::{Index, Tiles, middle_of};
use crate::trail::Trail;
use linkwork_spatial::Vec3;
use serde::{Deserialize, Serialize};

/// Map and plans of the rover: large, and saved with the state. Copies share unchanged tiles.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Knowledge {
    /// Map of the observed ground.
    pub map: TerrainMap,
    /// Terrain assessment of the map.
    pub patches: Tiles<Patch>,
    /// Planner of paths to the goal; created at the first sample.
    pub planner: Option<Planner>,
    /// Places that the rover has passed.
    pub trail: Trail,
    /// Places at which the rover failed to make progress, W, m.
    pub failed: Vec<[f64; 2]>,
    /// Number of points that were not finite or too far away for the map.
    pub lost: u64,
}

impl Knowledge {
    /// Returns the number of map cells with observations.
    #[must_use]
    pub fn seen(&self) -> usize {
        self.map.cells.iter().flat_map(|(_, cells)| cells).filter(|c| c.count > 0.0).count()
    }
}

/// Status of the drive.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// No picture has been processed yet.
    #[default]
    Blind,
    /// The rover drives, or waits for a path for at most `patience`.
    Driving,
    /// The goal is reached.
    Arrived,
    /// The tilt exceeded its limit.
    Tilted,
    /// The slip exceeded its limit.
    Slipping,
    /// The goal, or the rover, is outside the region.
    Outside,
    /// The goal is in an obstacle.
    GoalInObstacle,
    /// Obstacles enclose the rover or the goal: there is no path.
    NoWay,
    /// There is a path, but every move is blocked.
    NoMove,
    /// The cost to the goal did not decrease for longer than the limit.
    NoProgress,
    /// The rover started inside an obstacle.
    StartInObstacle,
}

impl Status {
    /// All states; the index in this list is the value at the port `status`.
    pub const ALL: [Status; 11] = [
        Status::Blind,
        Status::Driving,
        Status::Arrived,
        Status::Tilted,
        Status::Slipping,
        Status::Outside,
        Status::GoalInObstacle,
        Status::NoWay,
        Status::NoMove,
        Status::NoProgress,
        Status::StartInObstacle,
    ];

    /// Returns whether the drive continues.
    #[must_use]
    pub fn goes_on(self) -> bool {
        matches!(self, Status::Blind | Status::Driving)
    }
}

/// State from sample to sample, in addition to [`Knowledge`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Status of the drive.
    pub status: Status,
    /// Current move.
    pub doing: Option<Move>,
    /// Time since which the rover waits without a path or a move, s.
    pub stands_since: Option<f64>,
    /// Minimum cost to the goal so far, for the current map (m), and the time at which it was reached (s).
    pub nearest: Option<(f64, f64)>,
    /// Cost to the goal, m; ∞ if there is no path.
    pub left: f64,
    /// Position for which `left` was computed, m.
    pub from: [f64; 2],
    /// Time of the last recorded failure, s.
    pub failed_at: f64,
    /// If set, the rover drives back along its trail, at least until this number of places remains.
    pub back_to: Option<usize>,
    /// Vote of the current move.
    pub vote: f64,
}

/// Pose and state of the rover.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// x, y (m), heading (rad) in W.
    pub place: Place,
    /// Angle of the deck to the horizontal, rad.
    pub tilt: f64,
    /// Slip, 0 to 1.
    pub slip: f64,
}

/// Parameters of the navigation: limits, speeds and costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Rover {
    /// The goal, W, m.
    pub goal: [f64; 2],
    /// Distance at which the goal is reached, m.
    pub tolerance: f64,
    /// Driving speed, m/s.
    pub speed: f64,
    /// Turn rate on the spot, rad/s.
    pub spot_rate: f64,
    /// Tilt at which the rover stops, rad.
    pub tilt_max: f64,
    /// Slip at which the rover stops.
    pub slip_max: f64,
    /// Maximum waiting time without a path or a move, s.
    pub patience: f64,
    /// Maximum time without a new minimum of the cost to the goal, s.
    pub progress: f64,
    /// w: cost of the worst traversable ground, minus 1.
    pub weight: f64,
    /// u: cost of unknown ground as a fraction of w.
    pub unknown: f64,
    /// Cells of the map along the edge of a cell of the planner.
    pub coarse: i32,
    /// Initial margin of the planning region around rover and goal, m.
    pub margin: f64,
    /// Minimum x and y, maximum x and y (m) of the region that the rover's centre must not leave. ±∞: no limit.
    pub keep_in: [f64; 4],
    /// Distance along the path to the point that a turn on the spot faces, m.
    pub look_ahead: f64,
    /// Margin around the rover's rectangle in which points are ignored, because they lie on the rover itself, m.
    pub body_margin: f64,
    /// Maximum range of points; farther points are ignored, m.
    pub sight: f64,
    /// Discs that the rover must not enter.
    pub keep_out: Vec<Disc>,
    /// Discs that are assumed free, such as the start area, which the camera does not see.
    pub free: Vec<Disc>,
    /// The map.
    pub grid: Grid,
    /// The arcs.
    pub arcs: Arcs,
}

/// Number of headings that are tested for a cell of the planner.
const AROUND: usize = 12;
/// Cost factor of a cell in which some headings are blocked.
const NARROW: f64 = 3.0;
/// Cost factor of a cell for each failure nearby.
const FAILED: f64 = 3.0;
/// Minimum decrease of the cost to the goal that counts as progress, m.
const NEARER: f64 = 0.1;
/// Maximum margin of the planning region, relative to its initial value.
const GROWS: f64 = 4.0;

impl Rover {
    /// Adds points (m, W) that were observed from place `at` at a time (s).
    pub fn see(&self, judge: &Assessor, k: &mut Knowledge, points: &[Vec3], at: Place, time: f64) {
        let (sin, cos) = at[2].sin_cos();
        let half =
            [self.arcs.body.length, self.arcs.body.width].map(|l| 0.5 * l + self.body_margin);
        let wanted = |p: &&Vec3| {
            let (dx, dy) = (p.x - at[0], p.y - at[1]);
            let own =
                (cos * dx + sin * dy).abs() < half[0] && (cos * dy - sin * dx).abs() < half[1];
            !own && !(dx * dx + dy * dy > self.sight * self.sight)
        };
        let points: Vec<Vec3> = points.iter().filter(wanted).copied().collect();
        let (touched, lost) = self.grid.add(&mut k.map, &points, time);
        k.lost += lost as u64;
        judge.refresh(&k.map, &touched, &mut k.patches);
        let Some(planner) = &mut k.planner else { return };
        let ground = self.ground(judge, &k.patches);
        let turned = (self.arcs.body.offset() / self.grid.cell).ceil() as i32;
        let far = judge.depends_on() + turned;
        let outer = self.outer();
        for [i0, j0, i1, j1] in touched.rectangles() {
            let cell = |i: i32| i.div_euclid(self.coarse);
            let (x, y) = (cell(i0 - far)..=cell(i1 + far), cell(j0 - far)..=cell(j1 + far));
            let cells = y.flat_map(|j| x.clone().map(move |i| [i, j]));
            planner.change(cells.map(|c| (c, self.cost(&ground, &k.failed, &outer, c))));
        }
    }

    fn ground<'a>(&'a self, judge: &Assessor, patches: &'a Tiles<Patch>) -> Ground<'a> {
        let (keep_out, free) = (self.keep_out.as_slice(), self.free.as_slice());
        Ground { cell: self.grid.cell, patches, keep_out, free, radius: judge.limits().radius }
    }

    /// Returns the offset of the outer discs from the body's centre for each tested heading, m.
    fn outer(&self) -> [[f64; 2]; AROUND] {
        let offset = self.arcs.body.offset();
        std::array::from_fn(|k| {
            let (s, c) = (k as f64 * std::f64::consts::TAU / AROUND as f64).sin_cos();
            [offset * c, offset * s]
        })
    }

    /// Returns the cost of a cell of the planner, from the worst map cell inside it.
    fn cost(
        &self,
        ground: &Ground,
        failed: &[[f64; 2]],
        outer: &[[f64; 2]; AROUND],
        [i, j]: Index,
    ) -> f64 {
        let n = self.coarse;
        let mut cost = 1.0_f64;
        for [di, dj] in (0..n).flat_map(|dj| (0..n).map(move |di| [di, dj])) {
            let lack = match ground.of_cell([i * n + di, j * n + dj]) {
                Sight::Known(0) => return f64::INFINITY,
                Sight::Known(g) => 1.0 - f64::from(g) / f64::from(BEST),
                Sight::Unknown => self.unknown,
            };
            cost = cost.max(1.0 + self.weight * lack);
        }
        // The rover fits through here at some headings only.
        let [x, y] = middle_of(self.grid.cell * f64::from(n), [i, j]);
        let shut = |[dx, dy]: &[f64; 2]| ground.at([x + dx, y + dy]) == Sight::Known(0);
        let narrow = outer.iter().any(shut);
        let near = |f: &&[f64; 2]| (f[0] - x).hypot(f[1] - y) < self.failed_radius();
        let failures = failed.iter().filter(near).count() as i32;
        cost * if narrow { NARROW } else { 1.0 } * FAILED.powi(failures)
    }

    /// Returns the radius around a failure within which the ground costs more, m.
    fn failed_radius(&self) -> f64 {
        0.5 * self.arcs.body.width
    }

    /// Creates a planner whose region contains the rover, the goal and the previous region. Returns `None` if no region can contain the goal, or if
    /// the region would not grow.
    fn planner(&self, k: &Knowledge, judge: &Assessor, from: [f64; 2]) -> Option<Planner> {
        let edge = self.grid.cell * f64::from(self.coarse);
        let (mut low, mut high) = (from, from);
        let mut take = |p: [f64; 2]| {
            (0..2).for_each(|k| (low[k], high[k]) = (low[k].min(p[k]), high[k].max(p[k])));
        };
        take(self.goal);
        if let Some(old) = &k.planner {
            old.region().corners().into_iter().for_each(take);
        }
        let [x0, y0, x1, y1] = self.keep_in;
        for (k, (from, to)) in [(x0, x1), (y0, y1)].into_iter().enumerate() {
            low[k] = (low[k] - self.margin).max(from);
            high[k] = (high[k] + self.margin).min(to);
        }
        let region = Region::new(edge, low, high).ok()?;
        if k.planner.as_ref().is_some_and(|old| *old.region() == region) {
            return None;
        }
        let mut planner = Planner::new(region, self.goal, 1.0 + self.weight * self.unknown)?;
        let ground = self.ground(judge, &k.patches);
        let outer = self.outer();
        let ([i, j], [nx, ny]) = (region.first, region.size.map(|n| n as i32));
        let cells = (j..j + ny).flat_map(|j| (i..i + nx).map(move |i| [i, j]));
        planner.change(cells.map(|c| (c, self.cost(&ground, &k.failed, &outer, c))));
        Some(planner)
    }

    /// Plans a path from here in a region that is large enough. Returns `None` if no region can contain the goal.
    fn way(&self, judge: &Assessor, k: &mut Knowledge, from: [f64; 2]) -> Option<PathCost> {
        let beyond = 2.0 * self.arcs.length * (1.0 + self.weight);
        loop {
            if let Some(planner) = &mut k.planner {
                let way = planner.plan(from, beyond);
                let [low, high] = planner.region().corners();
                // These are the smallest and the largest margin of the region around rover and
                // goal.
                let over = |a: [f64; 2]| (0..2).flat_map(move |k| [a[k] - low[k], high[k] - a[k]]);
                let least = over(from).fold(f64::INFINITY, f64::min);
                let most = over(from).zip(over(self.goal)).map(|(a, b)| a.min(b));
                let close = least < 0.5 * self.margin || way == PathCost::Closed;
                if !close || most.fold(f64::NEG_INFINITY, f64::max) >= GROWS * self.margin {
                    return Some(way);
                }
            }
            match (self.planner(k, judge, from), &mut k.planner) {
                (Some(planner), _) => k.planner = Some(planner),
                // The region cannot grow: it has the maximum number of cells, or it is complete.
                (None, Some(planner)) => return Some(planner.plan(from, beyond)),
                (None, None) => return None,
            }
        }
    }

    /// Records a failure in the direction of the path and starts driving back. The distance grows with the number of failures around here.
    fn fail(&self, judge: &Assessor, k: &mut Knowledge, memory: &mut Memory, here: [f64; 2]) {
        let Some(planner) = &k.planner else { return };
        let length = self.arcs.body.length;
        let place = self.ahead(planner, here, 0.5 * length);
        let around = |f: &&[f64; 2]| (f[0] - here[0]).hypot(f[1] - here[1]) < 2.0 * length;
        let times = 1 + k.failed.iter().filter(around).count();
        let count = Trail::count(0.5 * length * times as f64);
        memory.back_to = Some(k.trail.len().saturating_sub(count));
        k.failed.push(place);
        let ground = self.ground(judge, &k.patches);
        let Some(planner) = &mut k.planner else { return };
        let outer = self.outer();
        let edge = self.grid.cell * f64::from(self.coarse);
        let cell = |v: f64| (v / edge).floor() as i32;
        let (low, high) = (-self.failed_radius(), self.failed_radius());
        let [x, y] = [0, 1].map(|k| cell(place[k] + low)..=cell(place[k] + high));
        let cells = y.flat_map(|j| x.clone().map(move |i| [i, j]));
        planner.change(cells.map(|c| (c, self.cost(&ground, &k.failed, &outer, c))));
    }

    /// Decides on the move at a time (s) and returns its speed (m/s) and turn rate (rad/s). `sees`: a picture has been received.
    pub fn decide(
        &self,
        judge: &Assessor,
        k: &mut Knowledge,
        memory: &mut Memory,
        pose: &Pose,
        time: f64,
        sees: bool,
    ) -> [f64; 2] {
        const STAND: [f64; 2] = [0.0; 2];
        let [x, y, _] = pose.place;
        if !memory.status.goes_on() {
            return STAND;
        }
        memory.doing = memory.doing.filter(|_| sees);
        let distance = (x - self.goal[0]).hypot(y - self.goal[1]);
        // The comparisons are written so that NaN stops the rover.
        let stop = match () {
            () if !(pose.tilt.abs() <= self.tilt_max) => Some(Status::Tilted),
            () if !(pose.slip <= self.slip_max) => Some(Status::Slipping),
            () if distance <= self.tolerance => Some(Status::Arrived),
            () => None,
        };
        if let Some(status) = stop {
            *memory = Memory { status, left: memory.left, ..Memory::default() };
            return STAND;
        }
        if !sees {
            return STAND;
        }
        memory.status = Status::Driving;
        let here = [x, y];
        let Some(way) = self.way(judge, k, here) else {
            memory.status = Status::Outside;
            return STAND;
        };
        self.progress(judge, k, memory, way, here, time);
        let trouble = match way {
            PathCost::Outside => Status::Outside,
            PathCost::GoalInObstacle => Status::GoalInObstacle,
            PathCost::InObstacle if k.trail.len() <= 1 => Status::StartInObstacle,
            PathCost::Closed => Status::NoWay,
            PathCost::Found(_) | PathCost::InObstacle => Status::NoMove,
        };
        let open = self.open(judge, k, memory, way, pose.place, distance);
        let since = *memory.stands_since.get_or_insert(time);
        let back = self.back(judge, k, memory, way, pose.place, open.is_some(), time - since);
        memory.doing = back.or(open.map(|v| v.mv));
        memory.vote = open.filter(|_| back.is_none()).map_or(0.0, |v| v.total);
        if memory.doing.is_some() {
            memory.stands_since = None;
        } else if time - since >= self.patience {
            memory.status = trouble;
        }
        let (_, when) = memory.nearest.unwrap_or((0.0, time));
        if time - when >= self.progress {
            memory.status = Status::NoProgress;
        }
        match memory.doing {
            Some(mv) if memory.status.goes_on() => self.command(mv),
            _ => STAND,
        }
    }

    /// Returns the move with the most votes; `None` if every move is blocked or there is no path.
    fn open(
        &self,
        judge: &Assessor,
        k: &Knowledge,
        memory: &Memory,
        way: PathCost,
        place: Place,
        distance: f64,
    ) -> Option<Vote> {
        let planner = k.planner.as_ref()?;
        if !matches!(way, PathCost::Found(_) | PathCost::InObstacle) {
            return None;
        }
        let ground = self.ground(judge, &k.patches);
        let [x, y, heading] = place;
        let ahead = self.ahead(planner, [x, y], self.look_ahead);
        let heading = if ahead == [x, y] { heading } else { (ahead[1] - y).atan2(ahead[0] - x) };
        let value = |p: [f64; 2]| planner.value(p);
        let last = memory.doing.filter(|_| memory.back_to.is_none());
        let wish = DriveRequest { value: &value, heading, distance, last };
        let votes = self.arcs.votes(&ground, place, &wish);
        self.arcs.choose(&votes, last)
    }

    /// Returns the move back along the trail while driving back; otherwise records the current place in the trail.
    #[allow(clippy::too_many_arguments)]
    fn back(
        &self,
        judge: &Assessor,
        k: &mut Knowledge,
        memory: &mut Memory,
        way: PathCost,
        place: Place,
        open: bool,
        stands: f64,
    ) -> Option<Move> {
        let here = [place[0], place[1]];
        let leads = |k: &Knowledge, p: Place| {
            k.planner.as_ref().is_some_and(|planner| planner.value([p[0], p[1]]).is_finite())
        };
        match memory.back_to {
            Some(least) if open && k.trail.len() <= least => memory.back_to = None,
            Some(_) => {}
            None if open => k.trail.add(place),
            None if stands >= 0.25 * self.patience => {
                // The rover drives back to a place from which a path exists.
                let some = match way {
                    PathCost::Found(_) | PathCost::InObstacle => !k.trail.is_empty(),
                    _ => way == PathCost::Closed && k.trail.places().any(|p| leads(k, p)),
                };
                if some {
                    self.fail(judge, k, memory, here);
                }
            }
            None => {}
        }
        memory.back_to?;
        let mv = k.trail.back(place, self.arcs.curvature_max);
        if mv.is_none() {
            memory.back_to = None;
        }
        mv
    }

    /// Updates the minimum cost to the goal, and records a failure if it has not decreased for long.
    fn progress(
        &self,
        judge: &Assessor,
        k: &mut Knowledge,
        memory: &mut Memory,
        way: PathCost,
        here: [f64; 2],
        time: f64,
    ) {
        let Some(planner) = &k.planner else { return };
        let news = planner.value(memory.from) - memory.left;
        memory.left = if let PathCost::Found(left) = way { left } else { f64::INFINITY };
        memory.from = here;
        let (least, when) = memory.nearest.get_or_insert((memory.left, time));
        if news.is_finite() {
            *least += news;
        }
        if memory.left < *least - NEARER {
            memory.nearest = Some((memory.left, time));
        } else if time - memory.failed_at.max(*when) >= 0.125 * self.progress {
            memory.failed_at = time;
            self.fail(judge, k, memory, here);
        }
    }

    fn command(&self, mv: Move) -> [f64; 2] {
        match mv {
            Move::Forward(kappa) => [self.speed, self.speed * kappa],
            Move::Backward(kappa) => [-self.speed, -self.speed * kappa],
            Move::Turn(angle) => [0.0, self.spot_rate.copysign(angle)],
        }
    }

    /// Returns the point of the path at a distance (m) from the rover.
    fn ahead(&self, planner: &Planner, from: [f64; 2], distance: f64) -> [f64; 2] {
        let count = 4 + (4.0 * distance / planner.region().cell) as usize;
        let path = planner.path(from, count);
        let far = |p: &&[f64; 2]| (p[0] - from[0]).hypot(p[1] - from[1]) >= distance;
        path.iter().find(far).or(path.last()).copied().unwrap_or(from)
    }

    /// Predicts the place after a time (s) for a move without slip.
    #[must_use]
    pub fn after(&self, at: Place, mv: Move, seconds: f64) -> Place {
        let rate = if matches!(mv, Move::Turn(_)) { self.spot_rate } else { self.speed };
        end_of(at, mv, rate * seconds)
    }
}

#[cfg(test)]
mod tests;

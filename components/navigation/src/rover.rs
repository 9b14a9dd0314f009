//! What a rover does with what it sees: map, judge, plan, vote, drive, and give up with a reason.
//! ```text
//! picture     points in W, without those on its own body → map → goodness → costs of the planner's cells
//! cost        1 + w (1 − goodness/255) of the worst cell inside; ∞ of a hazard; 1 + w u of unknown ground; three times as much where
//!             the outer discs of the body would be in a hazard with some headings
//! sample      plan from here; votes of the arcs; the move of most votes; speed and turn rate
//! stops       tilt or slip beyond its limit: for good.  No way, or no move that is open, for longer than `patience`: for good
//!             the cost to the goal has had no new least for `progress`: for good
//! ```
//! While no move is open it stands. A rover that has stopped for good, or has arrived, stays so until it is started anew.

use crate::arcs::{Arcs, DriveRequest, Move, Place, Vote, end_of};
use crate::assess::{Assessor, BEST, Patch};
use crate::field_d_star::{PathCost, Planner, Region};
use crate::ground::{Disc, Ground, Sight};
use crate::map::{Grid, TerrainMap};
use crate::tiles::{Index, Tiles, middle_of};
use crate::trail::Trail;
use linkwork_spatial::Vec3;
use serde::{Deserialize, Serialize};

/// What it knows: large, and saved with the state. A copy shares tiles that do not change.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Knowledge {
    /// The ground that was seen.
    pub map: TerrainMap,
    /// What was judged of it.
    pub patches: Tiles<Patch>,
    /// The way to the goal; made at the first sample.
    pub planner: Option<Planner>,
    /// Where it has been.
    pub trail: Trail,
    /// Where it failed, W, m.
    pub failed: Vec<[f64; 2]>,
    /// Points that had no place in the map.
    pub lost: u64,
}

impl Knowledge {
    /// Cells of which something is known.
    #[must_use]
    pub fn seen(&self) -> usize {
        self.map.cells.iter().flat_map(|(_, cells)| cells).filter(|c| c.count > 0.0).count()
    }
}

/// How it goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Status {
    /// It has seen nothing yet.
    #[default]
    Blind,
    /// It drives, or stands for as long as `patience` says.
    Driving,
    /// The goal is reached.
    Arrived,
    /// Its tilt is too large.
    Tilted,
    /// Its slip is too large.
    Slipping,
    /// The goal, or the rover, is outside the region.
    Outside,
    /// The goal is in an obstacle.
    GoalInObstacle,
    /// Obstacles lie all around the rover, or the goal.
    NoWay,
    /// There is a way, but every move is shut.
    NoMove,
    /// It has not come nearer for too long.
    NoProgress,
    /// It stands in an obstacle where it began.
    StartInObstacle,
}

impl Status {
    /// All of them; the place in this list is the number at a port.
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

    /// It goes on.
    #[must_use]
    pub fn goes_on(self) -> bool {
        matches!(self, Status::Blind | Status::Driving)
    }
}

/// What it remembers from sample to sample, beside its knowledge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// How it goes.
    pub status: Status,
    /// What it does.
    pub doing: Option<Move>,
    /// Since when it has stood for want of a way or a move, s.
    pub stands_since: Option<f64>,
    /// Least cost to the goal so far, as of the map of now (m), and when that was found (s).
    pub nearest: Option<(f64, f64)>,
    /// Cost to the goal, m; ∞ when there is none.
    pub left: f64,
    /// Where that was, m.
    pub from: [f64; 2],
    /// When it last took note of a place that it failed at, s.
    pub failed_at: f64,
    /// It goes back along its trail, at least until this many places of it are left.
    pub back_to: Option<usize>,
    /// Votes of the move.
    pub vote: f64,
}

/// Where it is and how it stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// x, y (m), heading (rad) in W.
    pub place: Place,
    /// Angle of the deck to the horizontal, rad.
    pub tilt: f64,
    /// Slip, 0 to 1.
    pub slip: f64,
}

/// Limits, speeds, costs.
#[derive(Clone, Debug, PartialEq)]
pub struct Rover {
    /// The goal, W, m.
    pub goal: [f64; 2],
    /// Distance at which it is reached, m.
    pub tolerance: f64,
    /// Driving speed, m/s.
    pub speed: f64,
    /// Turn rate on the spot, rad/s.
    pub spot_rate: f64,
    /// Tilt at which it stops, rad.
    pub tilt_max: f64,
    /// Slip at which it stops.
    pub slip_max: f64,
    /// So long it stands without a way or a move, s.
    pub patience: f64,
    /// So long it may be without a new least cost to the goal, s.
    pub progress: f64,
    /// w: cost of the worst ground that is no hazard, less 1.
    pub weight: f64,
    /// u: what of w unknown ground costs.
    pub unknown: f64,
    /// Cells of the map along the edge of a cell of the planner.
    pub coarse: i32,
    /// How far beyond rover and goal it plans at first, m.
    pub margin: f64,
    /// Least x and y, greatest x and y (m) of where it may plan: its middle does not leave that. ±∞: anywhere.
    pub keep_in: [f64; 4],
    /// Distance along the way to the point that a turn on the spot faces, m.
    pub look_ahead: f64,
    /// Points on the body are left out: this far around its rectangle, m.
    pub body_margin: f64,
    /// Points farther off are left out, m.
    pub sight: f64,
    /// Discs that are not to be entered.
    pub keep_out: Vec<Disc>,
    /// Discs that are known to be free: that in which it starts, for a camera that does not see it.
    pub free: Vec<Disc>,
    /// The map.
    pub grid: Grid,
    /// The arcs.
    pub arcs: Arcs,
}

/// Headings that are tried for a cell of the planner.
const AROUND: usize = 12;
/// A cell in which some of them are shut costs so many times as much.
const NARROW: f64 = 3.0;
/// A cell costs so many times as much for each failure nearby.
const FAILED: f64 = 3.0;
/// A cost to the goal that is less by so much counts as nearer, m.
const NEARER: f64 = 0.1;
/// The region's margin grows to so many times what it is at first.
const GROWS: f64 = 4.0;

impl Rover {
    /// Takes in points (m, W) that were seen from a place at a time (s).
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

    /// Where the middles of the outer discs are from that of the body, with the headings that are tried, m.
    fn outer(&self) -> [[f64; 2]; AROUND] {
        let offset = self.arcs.body.offset();
        std::array::from_fn(|k| {
            let (s, c) = (k as f64 * std::f64::consts::TAU / AROUND as f64).sin_cos();
            [offset * c, offset * s]
        })
    }

    /// Of a cell of the planner: the worst in it.
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
        // Here it fits through with some headings only.
        let [x, y] = middle_of(self.grid.cell * f64::from(n), [i, j]);
        let shut = |[dx, dy]: &[f64; 2]| ground.at([x + dx, y + dy]) == Sight::Known(0);
        let narrow = outer.iter().any(shut);
        let near = |f: &&[f64; 2]| (f[0] - x).hypot(f[1] - y) < self.failed_radius();
        let failures = failed.iter().filter(near).count() as i32;
        cost * if narrow { NARROW } else { 1.0 } * FAILED.powi(failures)
    }

    /// So far from a place that it failed at the ground costs more, m.
    fn failed_radius(&self) -> f64 {
        0.5 * self.arcs.body.width
    }

    /// A planner around the rover, its goal, and the region of the one before; `None` when the goal has no place in one, or it would
    /// be no larger.
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

    /// The way from here, in a region that is large enough for it; `None` when the goal has no place in one.
    fn way(&self, judge: &Assessor, k: &mut Knowledge, from: [f64; 2]) -> Option<PathCost> {
        let beyond = 2.0 * self.arcs.length * (1.0 + self.weight);
        loop {
            if let Some(planner) = &mut k.planner {
                let way = planner.plan(from, beyond);
                let [low, high] = planner.region().corners();
                // So far the region reaches beyond rover and goal, where it reaches least and most.
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
                // Too many cells, or all that there are.
                (None, Some(planner)) => return Some(planner.plan(from, beyond)),
                (None, None) => return None,
            }
        }
    }

    /// Takes note that it failed where its way leads, and goes back: the farther the more often it failed around here.
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

    /// What to do at a time (s), and the speed (m/s) and turn rate (rad/s) for it. `sees`: there was a picture.
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
        // Written so that NaN stops it.
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

    /// The move of most votes; `None` when every one is shut or there is no way.
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

    /// The move back along the trail, when it is to make one; else it takes note of where it is.
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
                // Whence a way leads on.
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

    /// Keeps the least cost to the goal, and takes note of where it failed when it had no new one for long.
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

    /// The point of the way at a distance (m) from the rover.
    fn ahead(&self, planner: &Planner, from: [f64; 2], distance: f64) -> [f64; 2] {
        let count = 4 + (4.0 * distance / planner.region().cell) as usize;
        let path = planner.path(from, count);
        let far = |p: &&[f64; 2]| (p[0] - from[0]).hypot(p[1] - from[1]) >= distance;
        path.iter().find(far).or(path.last()).copied().unwrap_or(from)
    }

    /// Where it will be after a time (s), when it does what it has chosen and slips nowhere.
    #[must_use]
    pub fn after(&self, at: Place, mv: Move, seconds: f64) -> Place {
        let rate = if matches!(mv, Move::Turn(_)) { self.spot_rate } else { self.speed };
        end_of(at, mv, rate * seconds)
    }
}

#[cfg(test)]
mod tests;

//! Candidate arcs of the rover and their votes.
//! ```text
//! arcs        curvature κ from −κ_max to κ_max in equal steps, forwards and backwards;  a turn on the spot to either side
//! body        n discs on its axis that cover length × width: centres x_k = (k + ½) l/n − l/2, radius √((w/2)² + (l/2n)²)
//! sweep       poses along an arc every `step`; at each the minimum goodness γ (0 … 1) under the n discs
//! obstacles   minimum of 1 − (1 − γ)(1 − s/2l) over the sweep of length l: obstacles at its end count half
//! goal        e^(−detour/scale);  detour = arc length + V(end) + turn to the path from there + cost of changing the kind of move − V(here);
//!             if V(here) is infinite, the minimum V(end) replaces it
//! vote        share · obstacles + (1 − share) · goal; 0 for a blocked arc
//! blocked     a hazard or unknown ground nearer than `near`, or anywhere in a turn on the spot
//! ```
//! After Goldberg, Maimone, Matthies 2002 (votes of arcs for obstacles and goal), with values of the global planner for the goal as in
//! Maimone et al. 2006. An arc ends at the first hazard or unknown ground beyond `near`, and is not longer than the distance of the goal. The last
//! arc is kept until the vote of another exceeds it by `hysteresis`.
//!
//! A rover whose discs touch a hazard now (it has drifted into the margin) may leave it: hazards within `leave` of the start of an arc do not block
//! it if there are none after that, at least up to `near`.

use crate::assess::BEST;
use crate::ground::{Ground, Sight};
use serde::{Deserialize, Serialize};

/// Smallest turn on the spot, rad: the rover does not stop for a smaller one.
const TURN_LEAST: f64 = 0.1;

/// Parameters of arcs and votes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arcs {
    /// Number of arcs in each direction; odd, so that the straight line is one of them.
    pub count: usize,
    /// Maximum curvature, 1/m.
    pub curvature_max: f64,
    /// Length of an arc, m.
    pub length: f64,
    /// Distance between the poses that are checked, m.
    pub step: f64,
    /// Distance ahead within which the ground must be known and free, m.
    pub near: f64,
    /// Distance within which the rover may leave a hazard, m.
    pub leave: f64,
    /// Weight of obstacles in a vote, 0 … 1.
    pub share: f64,
    /// Detour (m) at which the vote of the goal is 1/e.
    pub scale: f64,
    /// Cost of a turn, m/rad.
    pub turn_cost: f64,
    /// Cost of stopping to change between forwards, backwards and turning on the spot, m.
    pub stop_cost: f64,
    /// Cost of driving backwards, relative to driving forwards.
    pub back_cost: f64,
    /// Amount by which the vote of another arc must exceed that of the last one.
    pub hysteresis: f64,
    /// The body.
    pub body: Body,
}

/// Rectangle around the rover, centred on its pose, and the number of discs that cover it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Body {
    /// Length, m.
    pub length: f64,
    /// Width, m.
    pub width: f64,
    /// Number of discs on its axis.
    pub discs: usize,
}

/// Position x, y (m) and heading (rad) in W.
pub type Place = [f64; 3];

/// Candidate move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Move {
    /// Forwards on a circle of this curvature, to the left when positive, 1/m.
    Forward(f64),
    /// Backwards on a circle of this curvature.
    Backward(f64),
    /// On the spot by this angle, rad, to the left when positive.
    Turn(f64),
}

/// Vote of a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vote {
    /// The move.
    pub mv: Move,
    /// Vote of obstacles, 0 … 1.
    pub obstacles: f64,
    /// Vote of the goal, 0 … 1.
    pub goal: f64,
    /// Weighted sum; 0 if the move is blocked.
    pub total: f64,
}

/// Request for the next move of the rover.
pub struct DriveRequest<'a> {
    /// Cost to the goal from a point, m; ∞ where there is no path.
    pub value: &'a dyn Fn([f64; 2]) -> f64,
    /// Heading of the path at the rover, rad.
    pub heading: f64,
    /// Distance of the goal, m: arcs are not longer.
    pub distance: f64,
    /// Current move.
    pub last: Option<Move>,
}

impl Body {
    /// Returns the radius of the discs, m.
    #[must_use]
    pub fn radius(&self) -> f64 {
        (0.5 * self.width).hypot(0.5 * self.length / self.discs as f64)
    }

    /// Returns the distance of the outer discs from the centre, m.
    #[must_use]
    pub fn offset(&self) -> f64 {
        0.5 * self.length * (1.0 - 1.0 / self.discs as f64)
    }

    /// Returns the centres of the discs at a place, m.
    pub fn middles(&self, [x, y, heading]: Place) -> impl Iterator<Item = [f64; 2]> {
        let (s, c) = heading.sin_cos();
        let (each, length) = (self.length / self.discs as f64, self.length);
        (0..self.discs).map(move |k| {
            let along = (k as f64 + 0.5) * each - 0.5 * length;
            [x + along * c, y + along * s]
        })
    }

    /// Returns the worst assessment under the rover.
    #[must_use]
    pub fn sight(&self, ground: &Ground, at: Place) -> Sight {
        let mut least = Some(BEST);
        for p in self.middles(at) {
            match ground.at(p) {
                Sight::Known(0) => return Sight::Known(0),
                Sight::Known(g) => least = least.map(|l| l.min(g)),
                Sight::Unknown => least = None,
            }
        }
        least.map_or(Sight::Unknown, Sight::Known)
    }
}

/// Wraps an angle to −π … π.
#[must_use]
pub fn wrapped(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * (angle / turn).round()
}

/// Returns the place at the end of a move of length `s` (m; rad for a turn).
#[must_use]
pub fn end_of([x, y, heading]: Place, mv: Move, s: f64) -> Place {
    let (kappa, way) = match mv {
        Move::Forward(kappa) => (kappa, s),
        Move::Backward(kappa) => (kappa, -s),
        Move::Turn(angle) => return [x, y, heading + s.copysign(angle)],
    };
    // The chord of a circle has the length 2/κ sin(κ s/2) and the mean heading.
    let half = 0.5 * kappa * way;
    let chord = if half.abs() < 1e-8 { way } else { way * half.sin() / half };
    let (sin, cos) = (heading + half).sin_cos();
    [x + chord * cos, y + chord * sin, heading + 2.0 * half]
}

/// Result of a sweep.
struct Sweep {
    /// Length that is free and known, m or rad.
    open: f64,
    obstacles: f64,
}

/// End of a move.
struct End {
    sweep: Sweep,
    place: Place,
    /// Cost to the goal from there, m.
    left: f64,
}

impl Arcs {
    /// Returns all moves with their votes in a fixed order: forwards and backwards from right to left, then the turn.
    #[must_use]
    pub fn votes(&self, ground: &Ground, at: Place, wish: &DriveRequest) -> Vec<Vote> {
        let curvature = |k: usize| {
            let side = 2.0 * k as f64 / (self.count.max(2) - 1) as f64 - 1.0;
            side * self.curvature_max
        };
        let forward = (0..self.count).map(|k| Move::Forward(curvature(k)));
        let backward = (0..self.count).map(|k| Move::Backward(curvature(k)));
        // Rotate to the path in the shorter direction and in the other one, unless the angle is
        // small.
        let angle = wrapped(wish.heading - at[2]);
        let other = angle - std::f64::consts::TAU.copysign(angle);
        let turns = [Move::Turn(angle), Move::Turn(other)].into_iter();
        let turns = turns.filter(|_| angle.abs() >= TURN_LEAST);
        let sweeps: Vec<_> = forward
            .chain(backward)
            .chain(turns)
            .map(|mv| (mv, self.end(ground, at, wish, mv)))
            .collect();
        // In a hazard or outside the planned region, V(here) is infinite, so compare with the best
        // end instead.
        let here = (wish.value)([at[0], at[1]]);
        let ends = sweeps.iter().filter_map(|(_, end)| end.as_ref()).map(|end| end.left);
        let here = if here.is_finite() { here } else { ends.fold(here, f64::min) };
        sweeps.into_iter().map(|(mv, end)| self.vote(wish, mv, end, here)).collect()
    }

    /// Returns the end of a move; `None` if it is blocked.
    fn end(&self, ground: &Ground, at: Place, wish: &DriveRequest, mv: Move) -> Option<End> {
        let length = match mv {
            Move::Turn(angle) => angle.abs(),
            _ => self.length.min(wish.distance.max(self.step)),
        };
        let sweep = self.sweep(ground, at, mv, length)?;
        let place = end_of(at, mv, sweep.open);
        Some(End { left: (wish.value)([place[0], place[1]]), place, sweep })
    }

    /// Returns the vote of a move. `here`: cost to the goal with which the cost at the end is compared, m.
    fn vote(&self, wish: &DriveRequest, mv: Move, end: Option<End>, here: f64) -> Vote {
        let shut = Vote { mv, obstacles: 0.0, goal: 0.0, total: 0.0 };
        let Some(End { sweep, place, left }) = end else { return shut };
        if !left.is_finite() {
            // No path leads from this end to the goal. If the present position has none either,
            // any free move counts.
            let total = if here.is_finite() { 0.0 } else { self.share * sweep.obstacles };
            return Vote { obstacles: sweep.obstacles, total, ..shut };
        }
        let cost = match mv {
            Move::Turn(angle) => angle.abs() * self.turn_cost,
            Move::Forward(_) => sweep.open + self.turn_cost * self.way_from(wish, place),
            Move::Backward(_) => {
                sweep.open * self.back_cost + self.turn_cost * self.way_from(wish, place)
            }
        };
        let stop = match (mv, wish.last) {
            (Move::Forward(_), None | Some(Move::Forward(_)))
            | (Move::Backward(_), Some(Move::Backward(_)))
            | (Move::Turn(_), Some(Move::Turn(_))) => 0.0,
            _ => self.stop_cost,
        };
        let detour = cost + stop + left - here;
        let goal = (-detour.max(0.0) / self.scale).exp();
        let total = self.share * sweep.obstacles + (1.0 - self.share) * goal;
        Vote { mv, obstacles: sweep.obstacles, goal, total }
    }

    /// Returns the angle between the heading at the end of an arc and the direction of steepest descent of V there, rad.
    fn way_from(&self, wish: &DriveRequest, [x, y, heading]: Place) -> f64 {
        let h = 2.0 * self.step;
        let at = |dx: f64, dy: f64| (wish.value)([x + dx, y + dy]);
        let here = at(0.0, 0.0);
        let slope = |a: f64, b: f64| match (a.is_finite(), b.is_finite()) {
            (true, true) => 0.5 * (b - a),
            (true, false) => here - a,
            (false, true) => b - here,
            (false, false) => 0.0,
        };
        let (dx, dy) = (slope(at(-h, 0.0), at(h, 0.0)), slope(at(0.0, -h), at(0.0, h)));
        // At the goal V has no descent direction.
        if here <= h || dx.hypot(dy) <= 0.0 {
            return 0.0;
        }
        wrapped((-dy).atan2(-dx) - heading).abs()
    }

    /// Checks the ground along a move; `None` if it is blocked.
    fn sweep(&self, ground: &Ground, at: Place, mv: Move, length: f64) -> Option<Sweep> {
        // Check a rotation in steps of the arc length of the body's corners.
        let (scale, near) = match mv {
            Move::Turn(_) => (1.0 / (0.5 * self.body.length.hypot(self.body.width)), length),
            _ => (1.0, self.near.min(length)),
        };
        let leave = self.leave * scale;
        let steps = (length / (self.step * scale)).ceil().max(1.0) as usize;
        let mut leaving = self.body.sight(ground, at) == Sight::Known(0);
        let mut obstacles = 1.0_f64;
        let mut open = 0.0;
        for k in 1..=steps {
            let s = length * k as f64 / steps as f64;
            match self.body.sight(ground, end_of(at, mv, s)) {
                Sight::Known(0) if leaving && s <= leave => {}
                Sight::Known(0) | Sight::Unknown if s <= near * (1.0 + 1e-9) => return None,
                Sight::Known(0) => {
                    obstacles = obstacles.min(0.5 * s / length);
                    break;
                }
                Sight::Unknown => break,
                Sight::Known(goodness) => {
                    leaving = false;
                    let lack = 1.0 - f64::from(goodness) / f64::from(BEST);
                    obstacles = obstacles.min(1.0 - lack * (1.0 - 0.5 * s / length));
                }
            }
            open = s;
        }
        (open > 0.0 && !leaving).then_some(Sweep { open, obstacles })
    }

    /// Chooses the move with the most votes, or the last one unless another exceeds it by `hysteresis`. Returns `None` if every move is blocked.
    #[must_use]
    pub fn choose(&self, votes: &[Vote], last: Option<Move>) -> Option<Vote> {
        let mut best: Option<Vote> = None;
        for vote in votes.iter().filter(|v| v.total > 0.0) {
            if best.is_none_or(|b| vote.total > b.total) {
                best = Some(*vote);
            }
        }
        let kind = |a: Move, b: Move| match (a, b) {
            (Move::Turn(a), Move::Turn(b)) => (a > 0.0) == (b > 0.0),
            (a, b) => a == b,
        };
        let kept = last.and_then(|last| votes.iter().find(|v| kind(v.mv, last)));
        match (kept, best) {
            (Some(kept), Some(best)) if kept.total > 0.0 => {
                Some(if best.total > kept.total + self.hysteresis { best } else { *kept })
            }
            (_, best) => best,
        }
    }
}

#[cfg(test)]
mod tests;

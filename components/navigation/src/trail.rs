//! Past positions of the rover, along which it drives back if no other move is possible.
//! ```text
//! trail      a place each 0.2 m or 0.15 rad, the youngest 150 of them
//! back       to the youngest that is not reached: a circle that is tangent to the heading, κ = 2 y/(x² + y²) for x, y in the rover's
//!            axes, forwards or backwards as x says; a turn on the spot where it made one
//! reached    within 0.3 m with the same heading to 0.15 rad
//! ```
//! The rover can drive again over ground that it has driven over, so hazards close to the trail are not checked.

use crate::arcs::{Move, Place, wrapped};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Distance of places, m and rad.
const SPACING: [f64; 2] = [0.2, 0.15];
/// Places that are kept.
const MOST: usize = 150;
/// A place is reached within this distance (m) and this difference of heading (rad).
const REACHED: [f64; 2] = [0.3, 0.15];
/// Here it turns on the spot when the heading is another, m.
const ON_THE_SPOT: f64 = 0.1;

/// Places from the eldest to the youngest.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trail(VecDeque<Place>);

impl Trail {
    /// Returns the number of positions.
    #[must_use]
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns whether the trail is empty.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The places, eldest first.
    pub fn places(&self) -> impl Iterator<Item = Place> + '_ {
        self.0.iter().copied()
    }

    /// Places along `way` metres before the youngest.
    #[must_use]
    pub fn count(way: f64) -> usize {
        (way / SPACING[0]).ceil() as usize
    }

    /// Adds the present place.
    pub fn add(&mut self, at: Place) {
        let far = |p: &Place| {
            (at[0] - p[0]).hypot(at[1] - p[1]) >= SPACING[0]
                || wrapped(at[2] - p[2]).abs() >= SPACING[1]
        };
        if self.0.back().is_none_or(far) {
            self.0.push_back(at);
            if self.0.len() > MOST {
                self.0.pop_front();
            }
        }
    }

    /// The move towards the youngest place that is not reached, with curvatures up to `curvature_max` (1/m); those that are reached are
    /// forgotten. `None` when none is left.
    pub fn back(&mut self, [x, y, heading]: Place, curvature_max: f64) -> Option<Move> {
        loop {
            let [px, py, before] = *self.0.back()?;
            let (dx, dy) = (px - x, py - y);
            let (way, turn) = (dx.hypot(dy), wrapped(before - heading));
            if way < REACHED[0] && turn.abs() <= REACHED[1] {
                self.0.pop_back();
                continue;
            }
            let (s, c) = heading.sin_cos();
            let (ahead, left) = (c * dx + s * dy, c * dy - s * dx);
            if way <= ON_THE_SPOT || left.abs() > ahead.abs() {
                // No circle leads to a place at the side of the rover: the place is dropped if it does not
                // require a turn.
                if turn.abs() <= REACHED[1] {
                    self.0.pop_back();
                    continue;
                }
                return Some(Move::Turn(turn));
            }
            let kappa = (2.0 * left / (way * way)).clamp(-curvature_max, curvature_max);
            return Some(if ahead > 0.0 { Move::Forward(kappa) } else { Move::Backward(kappa) });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arcs::end_of;

    /// Moves and their lengths, in steps; places along the path.
    fn driven(moves: &[(Move, f64)]) -> Vec<Place> {
        let mut at = [1.0, -2.0, 0.4];
        let mut out = vec![at];
        for (mv, length) in moves {
            for _ in 0..(length / 0.05).round() as usize {
                at = end_of(at, *mv, 0.05);
                out.push(at);
            }
        }
        out
    }

    #[test]
    fn it_goes_back_where_it_came_from() {
        let way = driven(&[
            (Move::Forward(0.3), 3.0),
            (Move::Forward(-0.4), 2.0),
            (Move::Turn(-1.2), 1.2),
            (Move::Forward(0.0), 2.0),
            (Move::Backward(0.2), 1.5),
        ]);
        let mut trail = Trail::default();
        way.iter().for_each(|at| trail.add(*at));
        let mut at = *way.last().unwrap();
        let (mut off, mut steps) = (0.0_f64, 0);
        while let Some(mv) = trail.back(at, 0.4) {
            at = end_of(at, mv, 0.05);
            let to = |p: &Place| (p[0] - at[0]).hypot(p[1] - at[1]);
            let nearest = way.iter().map(to).fold(f64::INFINITY, f64::min);
            off = if nearest > off { nearest } else { off };
            steps += 1;
            assert!(steps < 1000, "{at:?}");
        }
        let left = (at[0] - 1.0).hypot(at[1] + 2.0);
        println!("{steps} steps, {off:.3} m off the way, {left:.3} m from its beginning");
        assert!(off < 0.2 && left < 0.3 && wrapped(at[2] - 0.4).abs() < 0.3);
    }

    #[test]
    fn only_the_youngest_places_are_kept() {
        let way = driven(&[(Move::Forward(0.0), 60.0)]);
        let mut trail = Trail::default();
        way.iter().for_each(|at| trail.add(*at));
        assert_eq!(trail.len(), MOST);
        let [x, y, _] = trail.places().last().unwrap();
        let end = way.last().unwrap();
        assert!((x - end[0]).hypot(y - end[1]) < 0.21);
        assert_eq!(Trail::default().back([0.0; 3], 0.4), None);
    }
}

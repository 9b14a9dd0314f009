//! Consistent initial state: coordinates and rates that satisfy all loops and couplings and keep given values.
//!
//! ```text
//! d(q) = 0          q ← q ⊕ Δ,  G Δ = −d       Newton's method over the coordinates that may move
//! ḋ(q, β) = 0       β ← β + Δ,  G Δ = −ḋ       once: rates are linear
//! Δ                 the least one: Σ Δ² over rad and m alike
//! ```
//! All constraints are rows here and masses have no influence, so that the initial state is the same for every [`ConstraintMethod`]. Kept coordinates are
//! left out of G. If only kept coordinates determine the branch of the mechanism, it is followed from the neutral configuration in small steps,
//! closed at each step. Otherwise Newton's method starts at the given configuration.
use crate::constrained::{ConstrainedSolver, greater, named};
use linkwork_dynamics::units::ConstraintMethod;
use linkwork_dynamics::{Tree, Workspace, kinematics};
use linkwork_multibody::{ConstraintId, LoopMotion};

/// Coordinates and rates of the initial state that are kept, by index in the rates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FixedValues {
    /// Coordinates that keep their values. Coordinates of a free or ball hinge are indexed by its rates: rotation, then position.
    pub positions: Vec<bool>,
    /// Rates that keep their values.
    pub rates: Vec<bool>,
}

/// The initial state cannot be closed with the kept values.
#[derive(Clone, Debug, PartialEq)]
pub struct StartError {
    /// The constraint with the largest error, as ``loop `NAME` ``, and its identifier.
    pub constraint: (String, ConstraintId),
    /// Whether rates are at fault instead of positions.
    pub rates: bool,
    /// Remaining error with the kept values: rad or m, or per second.
    pub left: f64,
    /// The nearest closed values if nothing is kept: coordinates, or rates. `None` if these do not exist either.
    pub nearest: Option<Vec<f64>>,
}

/// Errors below this count as closed, rad or m, and per second relative to the rates.
const CLOSED: f64 = 1e-12;
/// Maximum number of Newton steps.
const STEPS: usize = 50;
/// Longest step of a coordinate from the neutral configuration to a kept one, rad or m, and maximum number of such steps.
const PIECE: f64 = 0.1;
const PIECES: usize = 300;
/// Kept values within this distance of closed ones (rad, m, or relative for rates) count as rounded, and are moved.
pub const ROUNDED: f64 = 1e-3;

/// Closes an initial state: moves q (nq) and then β (nv) onto all loops and couplings. Values in `kept`, and prescribed coordinates and rates, stay
/// unchanged. Exception: kept values that miss by at most [`ROUNDED`] count as rounded and are moved, too.
///
/// The cost is cubic in the rows that share unknowns, plus one kinematics for each rate in a Newton step. If the state is already closed, only the
/// errors are evaluated.
///
/// # Errors
/// [`StartError`]; q and β then have their original values.
pub fn close_start(
    tree: &Tree,
    motions: &[LoopMotion],
    kept: &FixedValues,
    q: &mut [f64],
    v: &mut [f64],
) -> Result<(), StartError> {
    let mbs = tree.multibody();
    if mbs.constraints().next().is_none() {
        return Ok(());
    }
    let prescribed = mbs.prescribed();
    let held = |own: &[bool]| -> Vec<bool> {
        (prescribed.iter().enumerate()).map(|(k, p)| *p || own.get(k) == Some(&true)).collect()
    };
    let mut start = Start {
        tree,
        motions,
        ws: Workspace::new(tree),
        solver: ConstrainedSolver::new(tree, |_| ConstraintMethod::Augment),
    };
    let mut closed = q.to_vec();
    start.positions(&held(&kept.positions), &prescribed, &mut closed)?;
    let mut rates = v.to_vec();
    start.rates(&closed, &held(&kept.rates), &prescribed, &mut rates)?;
    q.copy_from_slice(&closed);
    v.copy_from_slice(&rates);
    Ok(())
}

struct Start<'a> {
    tree: &'a Tree,
    motions: &'a [LoopMotion],
    ws: Workspace,
    solver: ConstrainedSolver,
}

/// Rows of G, each with the range of its nonzero columns.
type Matrix = Vec<(Vec<f64>, [usize; 2])>;

impl Start<'_> {
    /// Computes d and ḋ of all rows.
    fn errors(&mut self, q: &[f64], v: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let Start { tree, motions, ws, solver } = self;
        kinematics(tree, ws, q, v);
        let (mut d, mut rate) = (Vec::new(), Vec::new());
        for which in 0..tree.multibody().loops().len() {
            solver.loop_errors(tree, ws, which, motions, |one, of| {
                d.push(one);
                rate.push(of);
            });
        }
        for c in tree.multibody().couplings() {
            d.push(c.error(q));
            rate.push(c.rate(q, v));
        }
        (d, rate)
    }

    /// Computes G at q: the columns of coordinates that are not held.
    fn matrix(&mut self, q: &[f64], held: &[bool]) -> Matrix {
        let mut unit = vec![0.0; held.len()];
        let (_, still) = self.errors(q, &unit);
        let empty = [usize::MAX, 0];
        let mut rows: Matrix = still.iter().map(|_| (vec![0.0; held.len()], empty)).collect();
        for k in (0..held.len()).filter(|k| !held[*k]) {
            unit[k] = 1.0;
            let (_, rate) = self.errors(q, &unit);
            unit[k] = 0.0;
            for ((row, range), (rate, still)) in rows.iter_mut().zip(rate.iter().zip(&still)) {
                row[k] = rate - still;
                if row[k] != 0.0 {
                    *range = [range[0].min(k), k];
                }
            }
        }
        rows
    }

    /// Runs Newton's method over coordinates that are not held. Returns the remaining error.
    fn newton(&mut self, held: &[bool], q: &mut [f64]) -> f64 {
        let still = vec![0.0; held.len()];
        let mut trial = q.to_vec();
        let mut d = self.errors(q, &still).0;
        let mut error = greatest(&d);
        let mut steps = 0;
        while !(error <= CLOSED) && steps < STEPS && error.is_finite() {
            let step = least(self.matrix(q, held), d.iter().map(|d| -d).collect());
            let mut scale = 1.0;
            loop {
                let part: Vec<f64> = step.iter().map(|s| scale * s).collect();
                self.tree.multibody().integrate(q, &part, &mut trial);
                let next = self.errors(&trial, &still).0;
                if greatest(&next) < error {
                    error = greatest(&next);
                    d = next;
                    q.copy_from_slice(&trial);
                    break;
                }
                scale *= 0.5;
                if scale < 1e-3 {
                    return error;
                }
            }
            steps += 1;
        }
        error
    }

    /// Follows the mechanism from the neutral configuration to the held values, closed at each step. Returns whether it arrived.
    fn follow(&mut self, held: &[bool], q: &mut [f64]) -> bool {
        let mbs = self.tree.multibody();
        let mut to = vec![0.0; held.len()];
        let mut at = q.to_vec();
        // Held coordinates start at neutral, the others at their given values.
        mbs.difference(q, &mbs.neutral_q(), &mut to);
        to.iter_mut().zip(held).filter(|(_, held)| !**held).for_each(|(x, _)| *x = 0.0);
        mbs.integrate(q, &to, &mut at);
        let longest = to.iter().fold(0.0, |m, x| greater(m, x.abs()));
        let pieces = (longest / PIECE).ceil().max(1.0);
        if !(pieces <= PIECES as f64) {
            return false;
        }
        let back: Vec<f64> = to.iter().map(|x| -x / pieces).collect();
        let mut next = at.clone();
        for piece in 0..=pieces as usize {
            if piece > 0 {
                mbs.integrate(&at, &back, &mut next);
                at.copy_from_slice(&next);
            }
            if !(self.newton(held, &mut at) <= CLOSED) {
                return false;
            }
        }
        // Restore the exact values of held coordinates.
        let mut off = vec![0.0; held.len()];
        mbs.difference(&at, q, &mut off);
        off.iter_mut().zip(held).filter(|(_, held)| !**held).for_each(|(x, _)| *x = 0.0);
        mbs.integrate(&at, &off, &mut next);
        q.copy_from_slice(&next);
        self.newton(held, q) <= CLOSED
    }

    fn positions(
        &mut self,
        held: &[bool],
        prescribed: &[bool],
        q: &mut [f64],
    ) -> Result<(), StartError> {
        let given = q.to_vec();
        let still = vec![0.0; held.len()];
        let left = greatest(&self.errors(q, &still).0);
        if left <= CLOSED {
            return Ok(());
        }
        // If the branch of the other coordinates is not determined, the closed start is followed from the
        // neutral configuration.
        let mut off = still;
        let mbs = self.tree.multibody();
        mbs.difference(&mbs.neutral_q(), q, &mut off);
        let guessed = off.iter().zip(held).any(|(x, held)| !held && *x != 0.0);
        let left = if !guessed && held.contains(&true) && self.follow(held, q) {
            return Ok(());
        } else {
            q.copy_from_slice(&given);
            self.newton(held, q)
        };
        if left <= CLOSED {
            return Ok(());
        }
        q.copy_from_slice(&given);
        if guessed && held.contains(&true) && self.follow(held, q) {
            return Ok(());
        }
        q.copy_from_slice(&given);
        let mut near = given.clone();
        let closes = self.newton(prescribed, &mut near) <= CLOSED;
        let mut moved = vec![0.0; held.len()];
        self.tree.multibody().difference(&given, &near, &mut moved);
        if closes && most(&moved, held) <= ROUNDED {
            q.copy_from_slice(&near);
            return Ok(());
        }
        let constraint = self.worst(&given, &vec![0.0; held.len()], false);
        let nearest = closes.then_some(near);
        Err(StartError { constraint, rates: false, left, nearest })
    }

    fn rates(
        &mut self,
        q: &[f64],
        held: &[bool],
        prescribed: &[bool],
        v: &mut [f64],
    ) -> Result<(), StartError> {
        let scale = v.iter().fold(1.0, |m, x| greater(m, x.abs()));
        let close = |start: &mut Self, held: &[bool], v: &mut [f64]| -> f64 {
            let mut left = greatest(&start.errors(q, v).1);
            // The second iteration removes round-off.
            for _ in 0..2 {
                if left <= CLOSED * scale {
                    break;
                }
                let rate = start.errors(q, v).1;
                let step = least(start.matrix(q, held), rate.iter().map(|d| -d).collect());
                v.iter_mut().zip(step).for_each(|(v, d)| *v += d);
                left = greatest(&start.errors(q, v).1);
            }
            left
        };
        let given = v.to_vec();
        // Round-off is proportional to the rates.
        let open = |left: f64| !(left <= 1e-9 * scale);
        let left = close(self, held, v);
        if !open(left) {
            return Ok(());
        }
        let mut near = given.clone();
        let closes = !open(close(self, prescribed, &mut near));
        let moved: Vec<f64> = given.iter().zip(&near).map(|(a, b)| b - a).collect();
        if closes && most(&moved, held) <= ROUNDED * scale {
            v.copy_from_slice(&near);
            return Ok(());
        }
        let constraint = self.worst(q, &given, true);
        v.copy_from_slice(&given);
        Err(StartError { constraint, rates: true, left, nearest: closes.then_some(near) })
    }

    /// Returns the constraint with the largest error, of positions or of rates.
    fn worst(&mut self, q: &[f64], v: &[f64], rates: bool) -> (String, ConstraintId) {
        let (d, rate) = self.errors(q, v);
        let all = if rates { rate } else { d };
        let mbs = self.tree.multibody();
        let (mut at, mut worst) = (0, (f64::NEG_INFINITY, None));
        for c in mbs.constraints() {
            let error = greatest(&all[at..at + mbs.rows(c)]);
            at += mbs.rows(c);
            if error > worst.0 || worst.1.is_none() {
                worst = (error, Some(c));
            }
        }
        let c = worst.1.unwrap_or(ConstraintId::Loop(0));
        (named(self.tree, c), c)
    }
}

/// Returns the largest magnitude; NaN has priority.
fn greatest(all: &[f64]) -> f64 {
    all.iter().fold(0.0, |m, x| greater(m, x.abs()))
}

/// Returns the largest motion of the held coordinates.
fn most(moved: &[f64], held: &[bool]) -> f64 {
    moved.iter().zip(held).filter(|(_, held)| **held).fold(0.0, |m, (x, _)| greater(m, x.abs()))
}

/// Returns the smallest x with G x = b in all independent rows. Makes rows orthogonal to each other, the largest first.
fn least(mut rows: Matrix, mut b: Vec<f64>) -> Vec<f64> {
    let n = rows.first().map_or(0, |(row, _)| row.len());
    let mut x = vec![0.0; n];
    let square = |row: &[f64]| row.iter().map(|a| a * a).sum::<f64>();
    let mut sizes: Vec<f64> = rows.iter().map(|(row, _)| square(row)).collect();
    let first = sizes.iter().copied().fold(0.0, f64::max);
    let mut left: Vec<usize> = (0..rows.len()).collect();
    while let Some(at) = (0..left.len()).max_by(|i, j| {
        let order = sizes[left[*i]].total_cmp(&sizes[left[*j]]);
        order.then(j.cmp(i))
    }) {
        let k = left.swap_remove(at);
        if !(sizes[k] > 1e-18 * first) {
            break;
        }
        let (mut q, range) = std::mem::replace(&mut rows[k], (Vec::new(), [usize::MAX, 0]));
        let norm = sizes[k].sqrt();
        q.iter_mut().for_each(|a| *a /= norm);
        let c = b[k] / norm;
        let span = range[0]..range[1] + 1;
        x[span.clone()].iter_mut().zip(&q[span.clone()]).for_each(|(x, q)| *x += c * q);
        for i in &left {
            let (row, other) = &mut rows[*i];
            if other[0] > range[1] || range[0] > other[1] {
                continue;
            }
            let f: f64 = row[span.clone()].iter().zip(&q[span.clone()]).map(|(a, q)| a * q).sum();
            if f != 0.0 {
                row[span.clone()].iter_mut().zip(&q[span.clone()]).for_each(|(a, q)| *a -= f * q);
                b[*i] -= f * c;
                *other = [other[0].min(range[0]), other[1].max(range[1])];
                sizes[*i] = square(row);
            }
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    fn matrix(rows: &[&[f64]]) -> Matrix {
        let of = |row: &&[f64]| {
            let at = |k: &usize| row[*k] != 0.0;
            let (first, last) = ((0..row.len()).find(at), (0..row.len()).rev().find(at));
            (row.to_vec(), [first.unwrap_or(usize::MAX), last.unwrap_or(0)])
        };
        rows.iter().map(of).collect()
    }

    /// Two rows and a third that is their sum: the least solution is Gᵀ (G Gᵀ)⁻¹ b, computed by hand.
    #[test]
    fn the_least_solution_is_found_with_rows_that_repeat_others() {
        let rows: [&[f64]; 3] = [&[2.0, -1.0, 0.0], &[0.0, 1.0, 3.0], &[2.0, 0.0, 3.0]];
        let x = least(matrix(&rows), vec![1.0, 2.0, 3.0]);
        // With G Gᵀ = [5 −1; −1 10] the multipliers are λ = (12, 11)/49.
        let want = [24.0 / 49.0, -1.0 / 49.0, 33.0 / 49.0];
        assert!(x.iter().zip(want).all(|(x, y)| (x - y).abs() < 1e-15), "{x:?}");
        assert_eq!(least(matrix(&[&[0.0, 0.0]]), vec![1.0]), [0.0, 0.0]);
    }
}

//! Inverse kinematics: configurations that bring nodes to their targets, and rates that move them as required.
//!
//! Nonlinear least squares over the targets. Each error is expressed in the frame in which the target is given (R, p: that frame; R₁, p₁: the node;
//! R_t, p_t: the target):
//! ```text
//! e = [ w_p (p_t − Rᵀ (p₁ − p));  w_o log(R_t (Rᵀ R₁)⁻¹) ]           minimise F = ½ eᵀ e
//! J = [ w_p Rᵀ (J₁ᵛ − Jᵛ + (p₁ − p)~ Jʷ);  w_o Rᵀ (J₁ʷ − Jʷ) ]       − Jᵀ e is the gradient of F
//! (Jᵀ J + c |e|² 1) h = Jᵀ e                                       q ← q ⊕ h on the manifold
//! ```
//! Levenberg–Marquardt: c decreases and increases with the ratio of the actual decrease of F to the one predicted by J. The factor |e|² gives
//! quadratic convergence where targets can be met, also at singular Jacobians. For poses in the world and hinges with one coordinate, convergence is
//! of third order: the curvature along the step is corrected with the same factors (geodesic acceleration, Transtrum and Sethna 2012), if the
//! correction is at most 3/8 of the step and J predicts most of F.
//! ```text
//! h ← h + b     (Jᵀ J + c |e|² 1) b = −½ Jᵀ a     a = J̇ h at the rates h: [Σ_i w_i' × w_i;  Σ_i (2 w_i' + w_i) × v_i]
//! ```
//! Here [w_i; v_i] = J_i h_i in the order of the chain, and w_i' is the sum of the previous w. Limits: a coordinate at a limit that the gradient
//! pushes outward is fixed (active set), and a step that crosses a limit is cut there. A pin with a full revolution between its limits continues at
//! the other end. Prescribed and kept coordinates do not move. If one start fails, others are tried, the same for each search, spread over the limits
//! (or one revolution, or 1 m).
//!
//! Rates: least squares of J v minus the required velocities, with the smallest norm (iterated Tikhonov), within the rate limits, and not outward at
//! a limit.
//!
//! The mechanism's own loops and couplings, and given closures, are rows in addition to those of targets. If not all can be met, closures have
//! priority (`search.rs`), so the *nearest* configuration is a configuration of the mechanism. Flexible bodies have the shape given by their modes in
//! q; modes do not move.
//!
//! A nonzero minimum may be a local one: *unreachable* means that no start led to the targets.

mod beyond;
mod closure;
mod improve;
mod rates;
mod search;
mod solve;
mod target;

pub use closure::Closure;
pub use improve::Improved;
pub use search::Progress;
pub use target::{
    Effort, Goal, InverseKinematicsError, Nearest, Place, Pointing, RateTarget, Residual,
    SearchStatistics, Target, Towards,
};

use crate::kinematics::check;
use crate::tree::{OnLink, Tree};
use crate::work::Workspace;
use linkwork_multibody::{Coordinate, Limits, NodeId, SubhingeKind};
use linkwork_spatial::{Mat3, Vec3, quat};
use std::f64::consts::TAU;
use std::ops::Range;

/// The curvature correction of a step is used up to this fraction of its length.
const BEND: f64 = 0.375;

/// Solver for inverse kinematics of one tree, with its memory, the coordinates that it may move, and its effort.
#[derive(Clone, Debug)]
pub struct InverseKinematics {
    /// Tolerances and limits of the work.
    pub effort: Effort,
    ws: Workspace,
    /// For each index in β: whether it may move, its index in q when it has one number, its limits.
    moves: Vec<bool>,
    place: Vec<Option<usize>>,
    limits: Vec<Limits>,
    /// Rows × nv; and the Jacobians of nodes, 6 × nv.
    J: Vec<f64>,
    /// Jacobian of the node of each target.
    J_node: Vec<f64>,
    J_base: Vec<f64>,
    e: Vec<f64>,
    /// Contribution of the curvature along the step to the error.
    bent: Vec<f64>,
    gradient: Vec<f64>,
    step: Vec<f64>,
    /// Coordinates that move now, and their matrix.
    free: Vec<usize>,
    A: Vec<f64>,
    x: Vec<f64>,
    start: Vec<f64>,
    tried: Vec<f64>,
    best: Vec<f64>,
    held: Vec<bool>,
    before: Vec<f64>,
    residuals: Vec<Residual>,
    /// A full revolution lies between the limits, so it never stops at one.
    turns: Vec<bool>,
    targets: Vec<Target>,
    /// The mechanism's loops and couplings.
    own: closure::TreeClosures,
    /// All goals: targets, the mechanism's loops, given closures. The rows of couplings come after theirs.
    asked: Vec<closure::FrameGoal>,
    /// Residual of each closure, and the weight of 1 m and 1 rad of it.
    closed: Vec<Residual>,
    closing: f64,
    /// Weight of closures in rate problems.
    rate_weight: f64,
    /// Shifts of the errors of closures by multipliers, if these are used.
    shift: Vec<f64>,
    multiplied: bool,
    /// Targets are ignored.
    alone: bool,
    rows: usize,
    /// For improvements: J D⁻¹ Jᵀ, gradients of the objective, a configuration.
    small: Vec<f64>,
    slope: Vec<f64>,
    slope_tried: Vec<f64>,
    before_q: Vec<f64>,
    /// JᵀJ of the free coordinates.
    squares: Vec<f64>,
    now: Vec<f64>,
    search: search::Search,
    /// Rates have overwritten the memory of a search.
    disturbed: bool,
    /// The curvature correction is used, because `bend` supports the kinds of all targets and coordinates.
    bends: bool,
}

impl InverseKinematics {
    /// Creates the memory for `tree`; use it only with this tree. Prescribed and modal coordinates are kept fixed.
    #[must_use]
    pub fn new(tree: &Tree) -> Self {
        let (nq, nv) = (tree.nq(), tree.nv());
        let (mut place, mut limits) = (vec![None; nv], vec![Limits::NONE; nv]);
        let (mut moves, mut turns) = (vec![true; nv], vec![false; nv]);
        for (_, s) in tree.multibody().subhinges() {
            if s.v.len() == 1 {
                (place[s.v.start], limits[s.v.start]) = (Some(s.q.start), s.subhinge.limits);
                let range = s.subhinge.limits.upper - s.subhinge.limits.lower;
                let pin = matches!(s.subhinge.kind, SubhingeKind::Pin { .. });
                turns[s.v.start] = pin && range >= TAU && range.is_finite();
            }
            moves[s.v.clone()].fill(s.subhinge.coordinate == Coordinate::Free);
        }
        for b in tree.multibody().bodies() {
            moves[b.modes_v()].fill(false);
        }
        Self {
            effort: Effort::default(),
            ws: Workspace::new(tree),
            moves,
            place,
            limits,
            J: Vec::new(),
            J_node: vec![0.0; 6 * nv],
            J_base: vec![0.0; 6 * nv],
            e: Vec::new(),
            bent: Vec::new(),
            gradient: vec![0.0; nv],
            step: vec![0.0; nv],
            free: Vec::with_capacity(nv),
            A: vec![0.0; nv * nv],
            x: vec![0.0; nv],
            start: vec![0.0; nq],
            tried: vec![0.0; nq],
            best: vec![0.0; nq],
            held: vec![false; nv],
            before: vec![0.0; nv],
            residuals: Vec::new(),
            turns,
            targets: Vec::new(),
            own: closure::TreeClosures::new(tree),
            asked: Vec::new(),
            closed: Vec::new(),
            closing: 1.0,
            rate_weight: 1.0,
            shift: Vec::new(),
            multiplied: false,
            alone: false,
            rows: 0,
            small: Vec::new(),
            slope: vec![0.0; nv],
            slope_tried: vec![0.0; nv],
            before_q: vec![0.0; nq],
            squares: vec![0.0; nv * nv],
            now: vec![0.0; nq],
            search: search::Search::NONE,
            disturbed: false,
            bends: false,
        }
    }

    /// Keeps coordinates (indices in β) fixed in later searches.
    #[track_caller]
    pub fn keep(&mut self, places: Range<usize>) {
        self.moves[places].fill(false);
    }

    /// Lets coordinates (indices in β) move in later searches, prescribed ones, too. If modes of flexible bodies are among them, a search returns an
    /// error.
    #[track_caller]
    pub fn release(&mut self, places: Range<usize>) {
        self.moves[places].fill(true);
    }

    /// Returns the residual of each target of the last solve.
    #[must_use]
    pub fn residuals(&self) -> &[Residual] {
        &self.residuals
    }

    /// Returns the indices in β of the coordinates that are at a limit at `q`.
    pub fn at_limit<'a>(&'a self, q: &'a [f64]) -> impl Iterator<Item = usize> + 'a {
        (0..self.place.len()).filter(|i| {
            let x = self.place[*i].map(|at| q[at]);
            x.is_some_and(|x| x <= self.limits[*i].lower || x >= self.limits[*i].upper)
        })
    }

    /// Reserves memory for targets and given closures: up to this total number no call allocates. A clone must reserve again.
    pub fn reserve(&mut self, targets: usize) {
        let nv = self.moves.len();
        self.free.reserve(nv);
        self.room(6 * targets + self.own.rows, targets, targets + self.own.loops.len(), nv);
        self.shift.resize(self.e.len(), 0.0);
        self.closed.reserve(targets + self.own.rows);
        self.targets.reserve(targets);
        self.asked.reserve(targets + self.own.loops.len());
        // Restore the sizes of the search in progress.
        self.shift.resize(self.rows, 0.0);
        self.room_again();
    }

    /// Resizes the memory for rows and frames; allocates only when they exceed the largest sizes so far.
    fn room(&mut self, rows: usize, targets: usize, frames: usize, nv: usize) {
        self.e.resize(rows, 0.0);
        self.bent.resize(rows, 0.0);
        self.J.resize(rows * nv, 0.0);
        self.J_node.resize(6 * nv * frames.max(1), 0.0);
        self.small.resize(rows * rows, 0.0);
        self.x.resize(rows.max(nv), 0.0);
        self.residuals.resize(targets, Residual::default());
    }

    /// Restores the sizes of the search after rates.
    fn room_again(&mut self) {
        self.room(self.rows, self.targets.len(), self.asked.len(), self.moves.len());
    }

    /// Returns rotation and origin of a frame in the world.
    fn frame(&self, at: Option<&OnLink>) -> (Mat3, Vec3) {
        at.map_or((Mat3::identity(), Vec3::zeros()), |at| self.ws.frame(at))
    }

    /// Computes the lower triangle of JᵀJ of the free coordinates.
    fn squares(&mut self, rows: usize, nv: usize) {
        let n = self.free.len();
        let (J, out) = (&self.J[..rows * nv], &mut self.squares[..n * n]);
        out.fill(0.0);
        // Usually all coordinates are free, and the columns are contiguous.
        if n == nv {
            return of_size(n, |n| add_squares(n, J, out));
        }
        for J in J.chunks_exact(nv.max(1)) {
            for (a, i) in self.free.iter().enumerate() {
                let (x, out) = (J[*i], &mut out[a * n..a * n + a + 1]);
                out.iter_mut().zip(&self.free).for_each(|(out, j)| *out += x * J[*j]);
            }
        }
    }

    /// Solves (JᵀJ + `damping` 1) h = Jᵀe on the free coordinates into `step`; returns false when it has no solution. Call [`squares`](Self::squares)
    /// first.
    fn damped_step(&mut self, damping: f64) -> bool {
        let n = self.free.len();
        self.A[..n * n].copy_from_slice(&self.squares[..n * n]);
        for (a, i) in self.free.iter().enumerate() {
            self.A[a * n + a] += damping;
            self.x[a] = self.gradient[*i];
        }
        if !solve_spd(&mut self.A[..n * n], &mut self.x[..n]) {
            return false;
        }
        self.step.fill(0.0);
        for (a, i) in self.free.iter().enumerate() {
            self.step[*i] = self.x[a];
        }
        true
    }

    /// Adds the correction for the curvature along the step (the documentation of this file has the equations) to `step`, unless it exceeds a
    /// fraction of the step. Uses the factors of [`damped_step`](Self::damped_step).
    fn bend(&mut self, nv: usize) {
        let n = self.free.len();
        let mut row = 0;
        for (t, J) in self.targets.iter().zip(self.J_node.chunks_exact(6 * nv)) {
            let (mut w, mut aw, mut av) = (Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
            for i in &self.free {
                let column = |from: usize| {
                    Vec3::new(J[from * nv + i], J[(from + 1) * nv + i], J[(from + 2) * nv + i])
                };
                let h = self.step[*i];
                let (dw, dv) = (column(0) * h, column(3) * h);
                aw += w.cross(&dw);
                av += (w * 2.0 + dw).cross(&dv);
                w += dw;
            }
            let parts = [
                (t.goal.position.is_some(), av * t.goal.weights[0]),
                (t.goal.orientation.is_some(), aw * t.goal.weights[1]),
            ];
            for (_, a) in parts.into_iter().filter(|p| p.0) {
                self.bent[row..row + 3].copy_from_slice((a * -0.5).as_slice());
                row += 3;
            }
        }
        self.x[..n].fill(0.0);
        for (J, bent) in self.J.chunks_exact(nv.max(1)).zip(&self.bent[..row]) {
            for (x, i) in self.x.iter_mut().zip(&self.free) {
                *x += J[*i] * bent;
            }
        }
        let solved = solve_factored(&self.A[..n * n], &mut self.x[..n]);
        let bend: f64 = self.x[..n].iter().map(|x| x * x).sum();
        let straight: f64 = self.free.iter().map(|i| self.step[*i].powi(2)).sum();
        if solved && bend <= BEND * BEND * straight {
            for (a, i) in self.free.iter().enumerate() {
                self.step[*i] += self.x[a];
            }
        }
    }

    /// Computes Jᵀ e.
    fn gradient_of(&mut self, rows: usize, nv: usize) {
        let (J, e, gradient) = (&self.J[..rows * nv], &self.e[..rows], &mut self.gradient[..nv]);
        gradient.fill(0.0);
        of_size(nv, |nv| {
            let gradient = &mut gradient[..nv];
            for (J, e) in J.chunks_exact(nv.max(1)).zip(e) {
                gradient.iter_mut().zip(J).for_each(|(g, x)| *g += x * e);
            }
        });
    }
}

/// Calls `f` with n. For arms with six and seven axes n is a compile-time constant, so that the compiler unrolls the loops. The operations and their
/// order are the same.
#[inline(always)]
fn of_size<R>(n: usize, f: impl FnOnce(usize) -> R) -> R {
    match n {
        6 => f(6),
        7 => f(7),
        n => f(n),
    }
}

/// Adds the lower triangle of JᵀJ; J has rows of n.
#[inline(always)]
fn add_squares(n: usize, J: &[f64], out: &mut [f64]) {
    let out = &mut out[..n * n];
    for J in J.chunks_exact(n.max(1)) {
        for a in 0..n {
            let (x, out) = (J[a], &mut out[a * n..a * n + a + 1]);
            out.iter_mut().zip(J).for_each(|(out, y)| *out += x * y);
        }
    }
}

/// Solves A x = b for a symmetric positive definite A (its lower triangle) in place; returns false if A is not. A becomes L of A = L Lᵀ with the
/// inverses of its diagonal entries, because divisions take several times as long as multiplications.
fn solve_spd(A: &mut [f64], b: &mut [f64]) -> bool {
    of_size(b.len(), |n| factor(n, &mut A[..n * n]) && solve_factored_of(n, A, b))
}

#[inline(always)]
fn factor(n: usize, A: &mut [f64]) -> bool {
    for j in 0..n {
        // These are the rows from j on, with the first one separate.
        let (first, rest) = A[j * n..].split_at_mut(n);
        let (left, at) = (&first[..j], j);
        let x = first[at] - left.iter().map(|x| x * x).sum::<f64>();
        if !(x > 0.0 && x.is_finite()) {
            return false;
        }
        let inverse = 1.0 / x.sqrt();
        for row in rest.chunks_exact_mut(n) {
            let dot: f64 = row[..j].iter().zip(left).map(|(x, y)| x * y).sum();
            row[at] = (row[at] - dot) * inverse;
        }
        first[at] = inverse;
    }
    true
}

/// Solves L Lᵀ x = b in place, with the L of [`solve_spd`]; returns false when x is not finite.
fn solve_factored(A: &[f64], b: &mut [f64]) -> bool {
    of_size(b.len(), |n| solve_factored_of(n, A, b))
}

#[inline(always)]
fn solve_factored_of(n: usize, A: &[f64], b: &mut [f64]) -> bool {
    let (A, b) = (&A[..n * n], &mut b[..n]);
    for i in 0..n {
        let row = &A[i * n..i * n + i + 1];
        let dot: f64 = row[..i].iter().zip(&*b).map(|(x, y)| x * y).sum();
        b[i] = (b[i] - dot) * row[i];
    }
    // The columns of Lᵀ are rows of L.
    for i in (0..n).rev() {
        let row = &A[i * n..i * n + i + 1];
        let x = b[i] * row[i];
        b[i] = x;
        b[..i].iter_mut().zip(row).for_each(|(b, y)| *b -= y * x);
    }
    b.iter().all(|x| x.is_finite())
}

/// Returns the rotation vector of a rotation matrix, rad.
fn log(R: &Mat3) -> Vec3 {
    quat(R).scaled_axis()
}

#[track_caller]
fn check_nodes(tree: &Tree, nodes: impl IntoIterator<Item = NodeId>) {
    let count = tree.multibody().nodes().len();
    assert!(nodes.into_iter().all(|n| n.index() < count), "a node of another mechanism");
}

#[track_caller]
fn check_state(ik: &InverseKinematics, tree: &Tree, q: &[f64]) {
    check(q.len(), tree.nq(), "q");
    assert_eq!(ik.moves.len(), tree.nv(), "inverse kinematics made for another tree");
}

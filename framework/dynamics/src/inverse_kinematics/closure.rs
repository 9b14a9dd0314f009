//! Closures of a search: the mechanism's own loops and couplings, and closures that the caller adds.
//!
//! A loop permits the motion of its hinge, so it is a goal of frame B relative to frame A, with one more row for conditions that no goal has:
//! ```text
//! sliders     none: a point;  one: a line;  two: a plane;  three: no condition    moved by Σ u of the prescribed ones
//! pins        none: an attitude;  one: an axis along itself, prescribed: an attitude;  two: across;  three, ball: no condition
//! across      cos − a · b                    the axes of two pins keep their angle
//! screw       pitch · angle − n · p          in addition to a line and an axis
//! coupling    c₀ − Σ cᵢ qᵢ
//! ```
//! Constraint rows of the dynamics are weaker: there an axis may have the opposite direction, because motion never leads from one to the other. A
//! search must distinguish them.

use super::{InverseKinematics, Place, Pointing, Residual, Target};
use crate::jacobian::frame_jacobian;
use crate::tree::{OnLink, Tree};
use linkwork_multibody::{ConstraintId, Coordinate, Loop, LoopRow, SubhingeKind};
use linkwork_spatial::nalgebra::Unit;
use linkwork_spatial::{Mat3, Quat, Vec3};
use std::f64::consts::TAU;

/// Weight of a metre and a radian of a closure relative to targets. It matters only if not all can be met at once, and then rounds of multipliers
/// correct for it.
pub(super) const WEIGHT: f64 = 10.0;

/// A closure of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Closure {
    /// A loop or a coupling of the mechanism.
    Constraint(ConstraintId),
    /// A closure that was given with the targets, by its index.
    Given(usize),
}

/// A frame on a link, and its goal relative to another frame or the world.
#[derive(Clone, Debug)]
pub(super) struct FrameGoal {
    pub end: OnLink,
    pub from: Option<OnLink>,
    pub goal: super::Goal,
    pub more: Option<More>,
}

/// A row that no goal has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum More {
    Across { a: Vec3, b: Vec3, cosine: f64 },
    Screw { axis: Vec3, reference: Vec3, pitch: f64 },
}

impl FrameGoal {
    pub fn of(tree: &Tree, t: &Target) -> Self {
        let from = t.relative_to.map(|n| tree.node(n).clone());
        Self { end: tree.node(t.node).clone(), from, goal: t.goal, more: None }
    }

    /// Returns the goal of a loop, with its prescribed subhinges at zero.
    fn of_loop(ends: &[OnLink; 2], l: &Loop) -> Self {
        let [a, b] = ends.clone();
        let goal = goal_of(l, &[]);
        let more = l.rows.iter().find_map(|row| match *row {
            LoopRow::Screw { axis, reference, pitch } => {
                Some(More::Screw { axis, reference, pitch })
            }
            LoopRow::Across { a, b, cosine } if !goal.turns() => {
                Some(More::Across { a, b, cosine })
            }
            _ => None,
        });
        Self { end: b, from: Some(a), goal, more }
    }

    pub fn rows(&self) -> usize {
        self.goal.rows() + usize::from(self.more.is_some())
    }
}

/// Returns the name of a constraint as ``loop `NAME` ``.
pub(super) fn name(tree: &Tree, c: ConstraintId) -> String {
    let kind = if matches!(c, ConstraintId::Loop(_)) { "loop" } else { "coupling" };
    format!("{kind} `{}`", tree.multibody().constraint_name(c))
}

/// Returns the goal of B relative to A for a loop, with the given motions of its prescribed subhinges; missing motions are zero.
fn goal_of(l: &Loop, motions: &[f64]) -> super::Goal {
    let mut goal = super::Goal::NOTHING;
    let mut given = l.motions.clone().map(|at| motions.get(at).copied().unwrap_or(0.0));
    let (mut at, mut free, mut pins, mut ball) = (Vec3::zeros(), [Vec3::zeros(); 3], 0, false);
    let (mut sliders, mut pin) = (0, None);
    for s in &l.closure.hinge.subhinges {
        let prescribed = s.coordinate == Coordinate::Prescribed;
        let u = if prescribed && s.kind != SubhingeKind::Locked { given.next() } else { None };
        match (s.kind, u) {
            (SubhingeKind::Slider { axis }, Some(u)) => at += axis * u,
            (SubhingeKind::Slider { axis }, None) => {
                free[sliders] = axis;
                sliders += 1;
            }
            (SubhingeKind::Screw { axis, .. }, _) => {
                (free[0], sliders) = (axis, 1);
                (pin, pins) = (Some((axis, None)), 1);
            }
            (SubhingeKind::Pin { axis }, u) => {
                (pin, pins) = (Some((axis, u)), pins + 1);
            }
            (SubhingeKind::Ball | SubhingeKind::Free, _) => ball = true,
            (SubhingeKind::Locked, _) => {}
        }
    }
    goal.position = (sliders < 3).then_some(at);
    goal.place = match sliders {
        1 => Place::Line(free[0]),
        2 => Place::Plane(free[0].cross(&free[1]).normalize()),
        _ => Place::Point,
    };
    match (pin, pins) {
        (None, _) if !ball => goal.orientation = Some(Quat::identity()),
        (Some((axis, Some(u))), 1) => {
            goal.orientation = Some(Quat::from_axis_angle(&Unit::new_normalize(axis), u));
        }
        (Some((axis, None)), 1) => goal.pointing = Some(Pointing::along(axis, axis)),
        _ => {}
    }
    goal
}

/// The closures of a tree itself.
#[derive(Clone, Debug)]
pub(super) struct TreeClosures {
    pub loops: Vec<FrameGoal>,
    pub rows: usize,
}

impl TreeClosures {
    pub fn new(tree: &Tree) -> Self {
        let mbs = tree.multibody();
        let loops = mbs.loops().iter().zip(&tree.anchors);
        let loops: Vec<FrameGoal> = loops.map(|(l, ends)| FrameGoal::of_loop(ends, l)).collect();
        let rows = loops.iter().map(FrameGoal::rows).sum::<usize>() + mbs.couplings().len();
        Self { loops, rows }
    }

    /// Returns the number of loops and couplings.
    pub fn count(&self, tree: &Tree) -> usize {
        self.loops.len() + tree.multibody().couplings().len()
    }
}

impl InverseKinematics {
    /// Sets the positions of the prescribed subhinges of the mechanism's loops, rad or m, in the order of its loop motions; initially zero. Gaps of
    /// loops have no effect: a search closes them.
    #[track_caller]
    pub fn set_loop_motions(&mut self, tree: &Tree, motions: &[f64]) {
        crate::kinematics::check(motions.len(), tree.multibody().motions(), "loop motions");
        for (own, l) in self.own.loops.iter_mut().zip(tree.multibody().loops()) {
            own.goal = goal_of(l, motions);
        }
    }

    /// Returns each closure of the last search and its residual: the mechanism's loops, the given closures, the mechanism's couplings.
    pub fn closures(&self) -> impl Iterator<Item = (Closure, Residual)> + '_ {
        let (loops, given) = (self.own.loops.len(), self.asked.len() - self.targets.len());
        self.closed.iter().enumerate().map(move |(i, r)| {
            let at = |i: usize| i as u32;
            let which = match i {
                i if i < loops => Closure::Constraint(ConstraintId::Loop(at(i))),
                i if i < given => Closure::Given(i - loops),
                i => Closure::Constraint(ConstraintId::Coupling(at(i - given))),
            };
            (which, *r)
        })
    }

    /// Returns the closure with the largest residual relative to the tolerances after the last search; `None` when all are closed.
    #[must_use]
    pub fn open(&self) -> Option<(Closure, Residual)> {
        let share = |r: &Residual| {
            let e = &self.effort;
            f64::max(r.position / e.position_tolerance, r.orientation / e.orientation_tolerance)
        };
        let worst = self.closures().max_by(|a, b| share(&a.1).total_cmp(&share(&b.1)));
        worst.filter(|(_, r)| !(share(r) <= 1.0))
    }

    /// Sets the weight of closures, which is larger than that of any target.
    pub(super) fn weigh_closures(&mut self) {
        let weights = self.targets.iter().flat_map(|t| t.goal.weights);
        let most = weights.fold(0.0, f64::max);
        let weight = WEIGHT * if most > 0.0 { most } else { 1.0 };
        self.closing = weight;
        for a in &mut self.asked[self.targets.len()..] {
            a.goal.weights = [weight; 2];
        }
    }

    /// Returns the error of an additional row and includes it in the residual. `R` is the attitude of B relative to A, `p` its origin there.
    pub(super) fn more_error(more: &More, R: &Mat3, p: &Vec3, residual: &mut Residual) -> f64 {
        match *more {
            More::Across { a, b, cosine } => {
                let d = cosine - a.dot(&(R * b));
                residual.orientation = residual.orientation.hypot(d);
                d
            }
            More::Screw { axis, reference, pitch } => {
                let to = R * reference;
                let angle = axis.dot(&reference.cross(&to)).atan2(reference.dot(&to));
                let turns = (axis.dot(p) / pitch - angle) / TAU;
                let d = -pitch * TAU * (turns - turns.round());
                residual.position = residual.position.hypot(d);
                d
            }
        }
    }

    /// Returns its rate, as factors of the angular and linear velocity of B relative to A.
    pub(super) fn more_factors(more: &More, R: &Mat3) -> (Vec3, Vec3) {
        match *more {
            More::Across { a, b, .. } => ((R * b).cross(&a), Vec3::zeros()),
            More::Screw { axis, pitch, .. } => (axis * -pitch, axis),
        }
    }

    /// Writes the errors of couplings from a row on; returns the row after them.
    pub(super) fn coupling_errors(&mut self, tree: &Tree, q: &[f64], mut row: usize) -> usize {
        let first = self.asked.len() - self.targets.len();
        for (k, c) in tree.multibody().couplings().iter().enumerate() {
            let d = -c.error(q);
            self.e[row] = self.closing * d;
            // The unit of the error is the unit of the first coordinate.
            let (body, which) = (c.bodies.first(), c.coupling.terms.first());
            let subhinge = body
                .zip(which)
                .and_then(|(b, t)| tree.multibody().get(*b).subhinges().get(t.coordinate.subhinge));
            let slides =
                subhinge.is_some_and(|s| matches!(s.subhinge.kind, SubhingeKind::Slider { .. }));
            let (position, orientation) = if slides { (d.abs(), 0.0) } else { (0.0, d.abs()) };
            self.closed[first + k] = Residual { position, orientation };
            row += 1;
        }
        row
    }

    /// Writes the rows of J of couplings.
    pub(super) fn coupling_rows(&mut self, tree: &Tree, q: &[f64], mut row: usize, weight: f64) {
        let nv = tree.nv();
        for c in tree.multibody().couplings() {
            let J = &mut self.J[row * nv..(row + 1) * nv];
            J.fill(0.0);
            for (k, (_, at, _)) in c.terms.iter().enumerate() {
                J[*at] += weight * c.factor(k, q);
            }
            row += 1;
        }
    }

    /// Writes the rows of J for the velocity of a frame relative to another: angular ones first, each six × nv in `J_node` from `at` on, in the axes
    /// of the other frame. `d` is p₁ − p in world axes.
    pub(super) fn relative_jacobian(
        &mut self,
        tree: &Tree,
        (end, from): (&OnLink, Option<&OnLink>),
        R: &Mat3,
        d: &Vec3,
        at: usize,
    ) {
        let nv = tree.nv();
        let J_node = &mut self.J_node[at..at + 6 * nv];
        frame_jacobian(tree, &self.ws, end, J_node);
        let Some(from) = from else { return };
        frame_jacobian(tree, &self.ws, from, &mut self.J_base);
        for i in 0..nv {
            let read = |J: &[f64], row: usize| {
                Vec3::new(J[row * nv + i], J[(row + 1) * nv + i], J[(row + 2) * nv + i])
            };
            let (w0, v0) = (read(&self.J_base, 0), read(&self.J_base, 3));
            let w = R.tr_mul(&(read(J_node, 0) - w0));
            let v = R.tr_mul(&(read(J_node, 3) - v0 - w0.cross(d)));
            for k in 0..3 {
                J_node[k * nv + i] = w[k];
                J_node[(k + 3) * nv + i] = v[k];
            }
        }
    }
}

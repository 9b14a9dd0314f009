//! All solutions of the inverse kinematics of six- and seven-axis arms whose geometry admits a closed form.
//!
//! ```text
//! X = E₁(q₁) … E₆(q₆) X₀         Eᵢ: rotation about axis hᵢ through pᵢ, both at zero angles; X₀: the tip there
//!
//! spherical wrist (4, 5, 6 meet in w):  q₁ q₂ q₃ position w; q₄ q₅ q₆ orient the tip
//! 2, 3, 4 parallel, 5 and 6 meet in c:  the height of c along the parallel axes gives q₁; their direction in the tip gives q₅ and q₆;
//!                                       the rest is planar
//! ```
//! Both cases also apply to the reversed arm, for example with a spherical shoulder. With a spherical wrist, two neighbours among the first three
//! axes must intersect or be parallel. For seven axes, one hinge is locked at its current value, and the other six form a six-axis arm.
//!
//! There are at most eight solutions. Each is refined with Newton's method and the arm's actual geometry, because files contain rounded axes, and is
//! checked against the pose.

mod geometry;
mod subproblems;

use crate::error::RobotError;
use crate::model::RobotModel;
use crate::part::{Chain, Part};
use geometry::{Arm, First, Form, Kind, held};
use linkwork_dynamics::{Workspace, node_jacobian, poses};
use linkwork_multibody::Limits;
use linkwork_spatial::nalgebra::Vector6;
use linkwork_spatial::{Pose, Vec3};
use std::f64::consts::TAU;
use subproblems::{Angles, distance, height, onto, through_both, turned};

/// Largest pose error of a solution, m and rad; equal to the tolerance of [`Effort::default`](crate::Effort).
const TOLERANCE: f64 = 1e-9;
/// Solutions that differ by less than this in each angle are the same solution, rad.
const APART: f64 = 1e-6;
/// Tolerance for round-off at a joint limit, rad.
const ROUNDING: f64 = 1e-9;
/// Maximum number of Newton steps.
const STEPS: usize = 8;

/// Order in which hinges of a seven-axis arm are tried as the locked hinge: first the third hinge of a spherical shoulder, then the last.
const HELD: [usize; 7] = [2, 6, 0, 1, 3, 4, 5];

/// The closed form of a chain, prepared once by [`RobotModel::closed_form`].
#[derive(Clone, Debug)]
pub struct ClosedForm {
    part: Part,
    form: Form,
    h: Vec<Vec3>,
    p: Vec<Vec3>,
    tip: Pose,
    /// For each hinge: its indices in the whole robot's q and β, and its limits.
    hinges: Vec<(usize, usize, Limits)>,
    held: Option<usize>,
    /// For a six-axis arm: its actual geometry, and the geometry that the closed form uses (with shifted points, reversed if needed).
    arms: Option<(Arm, Arm)>,
}

/// Solutions found so far, as angles of the six hinges.
#[derive(Default)]
struct Solutions {
    all: [[f64; 6]; ClosedForm::MOST],
    count: usize,
}

impl Solutions {
    fn add(&mut self, q: [f64; 6]) {
        if let Some(place) = self.all.get_mut(self.count) {
            *place = q;
            self.count += 1;
        }
    }

    fn iter(&self) -> impl Iterator<Item = &[f64; 6]> {
        self.all[..self.count].iter()
    }
}

fn arranged(arm: &Arm, form: Form) -> Arm {
    if form.reversed { arm.reversed().arranged(form.kind) } else { arm.arranged(form.kind) }
}

impl ClosedForm {
    /// Maximum number of solutions.
    pub const MOST: usize = 8;

    /// Returns the part.
    #[must_use]
    pub fn part(&self) -> Part {
        self.part
    }

    /// Returns the index in β of the locked hinge; `None` for six axes.
    #[must_use]
    pub fn held(&self) -> Option<usize> {
        self.held.map(|k| self.hinges[k].1)
    }

    /// Describes the geometry that makes the closed form possible.
    #[must_use]
    pub fn geometry(&self) -> &'static str {
        match (self.form.kind, self.form.reversed) {
            (Kind::Wrist(_), false) => "the last three axes meet in a point",
            (Kind::Wrist(_), true) => "the first three axes meet in a point",
            (Kind::Parallel, false) => "the second, third and fourth axis are parallel",
            (Kind::Parallel, true) => "the third, fourth and fifth axis are parallel",
        }
    }

    /// Prepares the closed form of a chain; `wanted` is an index in β. Allocates.
    pub(crate) fn new(
        part: Part,
        chain: &Chain,
        wanted: Option<usize>,
    ) -> Result<Self, RobotError> {
        let none = |why| RobotError::NoClosedForm { part: part.index(), why };
        let tree = &chain.tree;
        let zero = vec![0.0; tree.nq()];
        let single = chain.limits.iter().zip(&chain.v);
        let single = single.map(|(l, v)| l.map(|(at, limits)| (chain.q[at], *v, limits)));
        let hinges: Option<Vec<_>> = single.collect();
        let hinges = hinges.ok_or(none("it has hinges of more than one degree of freedom"))?;
        let n = hinges.len();
        let held_at = match (wanted, n) {
            (None, 6 | 7) => None,
            (Some(dof), 7) => {
                let at = chain.v.iter().position(|v| *v == dof);
                Some(at.ok_or(none("the hinge to be locked does not belong to the part"))?)
            }
            (Some(_), 6) => return Err(none("a six-axis arm has no hinge to lock")),
            _ => return Err(none("it has neither six nor seven hinges")),
        };
        let mut ws = Workspace::new(tree);
        poses(tree, &mut ws, &zero);
        let tip = ws.node_pose(tree, chain.tip);
        let mut J = vec![0.0; 6 * n];
        node_jacobian(tree, &ws, chain.tip, &mut J);
        let column = |r: usize, i: usize| Vec3::from_fn(|k, _| J[(r + k) * n + i]);
        let (h, v): (Vec<_>, Vec<_>) = (0..n).map(|i| (column(0, i), column(3, i))).unzip();
        let turns = |(h, v): (&Vec3, &Vec3)| {
            (h.norm() - 1.0).abs() < 1e-9 && h.dot(v).abs() < 1e-9 * (1.0 + v.norm())
        };
        if !h.iter().zip(&v).all(turns) {
            return Err(none("it has sliders or screws"));
        }
        let p: Vec<_> = h.iter().zip(&v).map(|(h, v)| tip.position + h.cross(v)).collect();
        let meets =
            "its axes do not intersect, and are not parallel, where a closed form requires it";
        let own = Self { part, form: NONE, h, p, tip, hinges, held: held_at, arms: None };
        if n == 6 {
            return own.six().ok_or(none(meets));
        }
        let all = held_at.as_ref().map_or(&HELD[..], std::slice::from_ref);
        let found = all.iter().find_map(|k| own.seven(*k).map(|form| (*k, form)));
        let (k, form) = found.ok_or(none(meets))?;
        Ok(Self { held: Some(k), form, ..own })
    }

    fn six(self) -> Option<Self> {
        let (h, p) = (self.h[..].try_into().ok()?, self.p[..].try_into().ok()?);
        let arm = Arm { h, p, tip: self.tip };
        let form = arm.form()?;
        Some(Self { form, arms: Some((arm, arranged(&arm, form))), ..self })
    }

    /// Returns the closed form of the six other hinges if they have the same one at every angle of the locked hinge. Two angles are tested.
    fn seven(&self, k: usize) -> Option<Form> {
        let at = |angle: f64| held(&self.h, &self.p, &self.tip, k, angle).form();
        let [a, b] = [0.7, -1.9].map(at);
        a.filter(|form| b == Some(*form))
    }

    /// Computes all solutions for the tip pose `X` relative to the base, near the angles `q` of all hinges. Calls `put` with the angles of all hinges
    /// for each solution, and returns their number.
    pub(crate) fn solve(&self, X: &Pose, q: &[f64], mut put: impl FnMut(&[f64; 7])) -> usize {
        let angle = |k: usize| q[self.hinges[k].0];
        let (arm, ready) = self.arms.unwrap_or_else(|| {
            let k = self.held.unwrap_or_default();
            let arm = held(&self.h, &self.p, &self.tip, k, angle(k));
            (arm, arranged(&arm, self.form))
        });
        let place = |i: usize| i + usize::from(self.held.is_some_and(|k| i >= k));
        let near: [f64; 6] = std::array::from_fn(|i| angle(place(i)));
        let mut raw = Solutions::default();
        if self.form.reversed {
            let mut back = near;
            back.reverse();
            candidates(&ready, self.form.kind, &(arm.tip * X.inverse()), &back, &mut raw);
            raw.all[..raw.count].iter_mut().for_each(|q| q.reverse());
        } else {
            candidates(&ready, self.form.kind, X, &near, &mut raw);
        }
        let mut kept = Solutions::default();
        for q in raw.iter() {
            let Some(mut q) = refined(&arm, X, *q) else { continue };
            let inside = (0..6).all(|i| match nearest(q[i], near[i], &self.hinges[place(i)].2) {
                Some(x) => {
                    q[i] = x;
                    true
                }
                None => false,
            });
            let known = kept.iter().any(|k| (0..6).all(|i| (k[i] - q[i]).abs() < APART));
            if inside && !known {
                kept.add(q);
            }
        }
        let far = |q: &[f64; 6]| (0..6).map(|i| (q[i] - near[i]).powi(2)).sum::<f64>();
        kept.all[..kept.count].sort_by(|a, b| far(a).total_cmp(&far(b)));
        for q in kept.iter() {
            let mut all = [0.0; 7];
            if let Some(k) = self.held {
                all[k] = angle(k);
            }
            (0..6).for_each(|i| all[place(i)] = q[i]);
            put(&all);
        }
        kept.count
    }

    /// Returns true if the closed form was made for this chain.
    pub(crate) fn is_of(&self, chain: &Chain) -> bool {
        self.hinges.iter().map(|h| h.1).eq(chain.v.iter().copied())
    }

    /// Checks that the locked hinge is within its limits.
    ///
    /// # Errors
    /// [`RobotError::OutsideLimits`].
    pub(crate) fn held_within(&self, q: &[f64]) -> Result<(), RobotError> {
        let Some((at, dof, limits)) = self.held.map(|k| &self.hinges[k]) else { return Ok(()) };
        let (value, lower, upper) = (q[*at], limits.lower, limits.upper);
        let within = value >= lower && value <= upper;
        within.then_some(()).ok_or(RobotError::OutsideLimits { dof: *dof, value, lower, upper })
    }

    /// Returns the index in the whole robot's q of each hinge.
    pub(crate) fn places(&self) -> impl Iterator<Item = usize> {
        self.hinges.iter().map(|h| h.0)
    }
}

/// Value before the form of an arm is determined.
const NONE: Form = Form { kind: Kind::Parallel, reversed: false };

impl RobotModel {
    /// Prepares the closed form of a chain with six or seven hinges. In a seven-axis chain, the hinge `held` (an index in β, from
    /// [`RobotModel::dofs`]) keeps its value in every solution. If `held` is `None`, it is the third hinge, or the first other hinge whose locking
    /// leaves an arm with a closed form.
    ///
    /// # Errors
    /// [`RobotError::ForeignHandle`], [`RobotError::NotAChain`], [`RobotError::NoClosedForm`].
    pub fn closed_form(&self, part: Part, held: Option<usize>) -> Result<ClosedForm, RobotError> {
        ClosedForm::new(part, self.chain(part)?, held)
    }
}

/// Returns the angle, shifted by whole revolutions, that is within the limits and nearest to `near`.
fn nearest(angle: f64, near: f64, limits: &Limits) -> Option<f64> {
    let turns = |x: f64| (x - angle) / TAU;
    let low = (turns(limits.lower) - ROUNDING).ceil();
    let high = (turns(limits.upper) + ROUNDING).floor();
    let k = turns(near).round().max(low).min(high);
    let x = angle + TAU * k;
    (low <= high).then(|| x.max(limits.lower).min(limits.upper))
}

/// Refines a candidate with Newton's method until it meets the pose; returns `None` if it does not.
fn refined(arm: &Arm, X: &Pose, mut q: [f64; 6]) -> Option<[f64; 6]> {
    let off = |q: &[f64; 6]| {
        let now = arm.pose(q);
        let turn = (X.rotation * now.rotation.inverse()).scaled_axis();
        let way = X.position - now.position;
        Vector6::new(turn.x, turn.y, turn.z, way.x, way.y, way.z)
    };
    let size = |e: &Vector6<f64>| e.fixed_rows::<3>(0).norm().max(e.fixed_rows::<3>(3).norm());
    let mut error = off(&q);
    for _ in 0..STEPS {
        if size(&error) < 1e-3 * TOLERANCE {
            break;
        }
        // The small damping keeps angles that have no effect in a singular configuration.
        let J = arm.jacobian(&q);
        let damped = J.transpose() * J + linkwork_spatial::nalgebra::Matrix6::identity() * 1e-12;
        let Some(step) = damped.cholesky().map(|c| c.solve(&(J.transpose() * error))) else {
            break;
        };
        let next: [f64; 6] = std::array::from_fn(|i| q[i] + step[i]);
        let after = off(&next);
        if size(&after) >= size(&error) {
            break;
        }
        (q, error) = (next, after);
    }
    (size(&error) < TOLERANCE).then_some(q)
}

/// Computes candidates for an arm whose points lie where the form requires them.
fn candidates(arm: &Arm, kind: Kind, X: &Pose, near: &[f64; 6], out: &mut Solutions) {
    match kind {
        Kind::Wrist(first) => wrist(arm, first, X, near, out),
        Kind::Parallel => parallel(arm, X, near, out),
    }
}

fn wrist(arm: &Arm, first: First, X: &Pose, near: &[f64; 6], out: &mut Solutions) {
    let Arm { h, p, tip } = arm;
    let R = X.rotation * tip.rotation.inverse();
    let at = X.position - R * (tip.position - p[3]);
    let mut orient = |q: [f64; 3]| {
        let back = |v: Vec3| (0..3).fold(v, |v, i| turned_back(&h[i], q[i], &v));
        // Compute the direction of the last axis before the rotations of the wrist; then solve for
        // q₅, q₄ and q₆.
        let out6 = back(R * h[5]);
        for q5 in height(&h[4], &h[3], &h[5], h[3].dot(&out6), near[4]).iter() {
            let bent = turned(&h[4], q5, &h[5]);
            let q4 = onto(&h[3], &bent, &out6, near[3]);
            // Any vector that is not parallel to h₆ determines q₆.
            let off = across(&h[5]);
            let seen = turned_back(&h[4], q5, &turned_back(&h[3], q4, &back(R * off)));
            out.add([q[0], q[1], q[2], q4, q5, onto(&h[5], &off, &seen, near[5])]);
        }
    };
    let upper = p[2] - p[1];
    let fore = p[3] - p[2];
    match first {
        First::Meet12 => {
            let to = at - p[0];
            for q3 in distance(&h[2], &fore, &upper, to.norm(), near[2]).iter() {
                let v = upper + turned(&h[2], q3, &fore);
                for [q1, q2] in through_both((&h[0], &h[1]), (&v, &to), [near[0], near[1]]) {
                    orient([q1, q2, q3]);
                }
            }
        }
        First::Parallel12 => {
            let to = at - p[0];
            let first = p[1] - p[0];
            let level = h[0].dot(&(to - first - upper));
            for q3 in height(&h[2], &h[0], &fore, level, near[2]).iter() {
                let v = upper + turned(&h[2], q3, &fore);
                for q2 in distance(&h[1], &v, &first, to.norm(), near[1]).iter() {
                    let q1 = onto(&h[0], &(first + turned(&h[1], q2, &v)), &to, near[0]);
                    orient([q1, q2, q3]);
                }
            }
        }
        First::Meet23 => {
            let (to, first) = (at - p[0], p[1] - p[0]);
            // The length |R₁ᵀ to − first| equals the length of the remaining link.
            for q1 in distance(&-h[0], &to, &-first, fore.norm(), near[0]).iter() {
                let left = turned_back(&h[0], q1, &to) - first;
                for [q2, q3] in through_both((&h[1], &h[2]), (&fore, &left), [near[1], near[2]]) {
                    orient([q1, q2, q3]);
                }
            }
        }
        First::Parallel23 => {
            let (to, first) = (at - p[0], p[1] - p[0]);
            let level = h[1].dot(&(first + upper + fore));
            for q1 in height(&-h[0], &h[1], &to, level, near[0]).iter() {
                let left = turned_back(&h[0], q1, &to) - first;
                for [q2, q3] in plane([&h[1], &h[2]], [&upper, &fore], &left, [near[1], near[2]]) {
                    orient([q1, q2, q3]);
                }
            }
        }
    }
}

fn parallel(arm: &Arm, X: &Pose, near: &[f64; 6], out: &mut Solutions) {
    let Arm { h, p, tip } = arm;
    let R = X.rotation * tip.rotation.inverse();
    let to = X.position - R * (tip.position - p[4]) - p[0];
    let (n, first) = (h[1], p[1] - p[0]);
    let (upper, fore, hand) = (p[2] - p[1], p[3] - p[2], p[4] - p[3]);
    for q1 in height(&-h[0], &n, &to, n.dot(&(p[4] - p[0])), near[0]).iter() {
        let back = |v: Vec3| turned_back(&h[0], q1, &v);
        for q5 in height(&h[4], &n, &h[5], n.dot(&back(R * h[5])), near[4]).iter() {
            // This is the direction n in the frame of the tip.
            let seen = R.inverse() * turned(&h[0], q1, &n);
            let q6 = onto(&-h[5], &turned_back(&h[4], q5, &n), &seen, near[5]);
            let off = across(&n);
            let inner = turned(&h[5], -q6, &turned(&h[4], -q5, &off));
            let all = onto(&n, &off, &back(R * inner), 0.0);
            let left = back(to) - first - turned(&n, all, &hand);
            for [q2, q3] in plane([&h[1], &h[2]], [&upper, &fore], &left, [near[1], near[2]]) {
                let so_far = q2 + q3 * h[2].dot(&n).signum();
                out.add([q1, q2, q3, (all - so_far) * h[3].dot(&n).signum(), q5, q6]);
            }
        }
    }
}

/// Solves two links in a plane: `R₂ (upper + R₃ fore) = to`, up to components along the axes.
fn plane(
    [h2, h3]: [&Vec3; 2],
    [upper, fore]: [&Vec3; 2],
    to: &Vec3,
    near: [f64; 2],
) -> impl Iterator<Item = [f64; 2]> + use<> {
    let flat = |v: &Vec3| v - h2 * h2.dot(v);
    let (upper, fore, to) = (flat(upper), flat(fore), flat(to));
    let (h2, h3) = (*h2, *h3);
    let bends: Angles = distance(&h3, &fore, &upper, to.norm(), near[1]);
    bends.iter().map(move |q3| [onto(&h2, &(upper + turned(&h3, q3, &fore)), &to, near[0]), q3])
}

fn turned_back(h: &Vec3, angle: f64, v: &Vec3) -> Vec3 {
    turned(h, -angle, v)
}

/// Returns a direction perpendicular to an axis.
fn across(h: &Vec3) -> Vec3 {
    h.cross(&Vec3::ith(h.iamin(), 1.0)).normalize()
}

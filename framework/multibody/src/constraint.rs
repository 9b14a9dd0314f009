//! Constraints: hinges that close loops, and relations between hinge coordinates.
//!
//! A loop closure is a hinge between two frames that the tree does not connect. Motions that it permits stay free; each other motion gives one scalar
//! equation. With p from A's origin to B's, and vectors a fixed in A and b in B:
//! ```text
//! slide    n · p − Σ c u = 0              along a direction n fixed in A; u are prescribed sliders
//! across   a · b − cos = 0                two directions keep their angle
//! turn     angle(A → B about n) − u = 0   a prescribed pin
//! screw    n · p − pitch · angle = 0
//! coupling Σ (cᵢ qᵢ + aᵢ qᵢ² + bᵢ qᵢ³ + dᵢ qᵢ⁴) − c₀ = 0
//! ```
//! In a loop with gaps ([`Builder::gaps`](crate::Builder::gaps)), each equation d = 0 becomes d = g with its own g, which the caller sets: the offset
//! between the ends.

use crate::{BodyId, Coordinate, Hinge, Limits, SubhingeKind};
use linkwork_spatial::{Mat3, Pose, Vec3};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A coordinate: a one-dof subhinge of a body's hinge.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct HingeCoordinate {
    /// The body.
    pub body: String,
    /// Index of the subhinge, counted from the parent's side.
    pub subhinge: usize,
}

/// One term of a coupling.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// The coordinate q.
    pub coordinate: HingeCoordinate,
    /// Its factor c.
    pub factor: f64,
}

/// Higher powers of a coordinate in a coupling: a q² + b q³ + d q⁴.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Powers {
    /// The coordinate q.
    pub coordinate: HingeCoordinate,
    /// The factors of q², q³ and q⁴.
    pub factors: [f64; 3],
}

/// A relation between coordinates: Σ cᵢ qᵢ = c₀, and with `powers` a sum of polynomials of one coordinate each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Coupling {
    /// Its name.
    pub name: String,
    /// The terms, at least one. Each coordinate in `powers` has a term, whose factor may be 0.
    pub terms: Vec<Term>,
    /// The right side c₀.
    pub constant: f64,
    /// Higher powers; empty for a linear relation.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub powers: Vec<Powers>,
}

impl Coupling {
    /// Returns Σ cᵢ qᵢ = c₀.
    #[must_use]
    pub fn linear(name: impl Into<String>, terms: Vec<Term>, constant: f64) -> Self {
        Self { name: name.into(), terms, constant, powers: Vec::new() }
    }

    /// Returns q_a = ratio q_b + offset, written as q_a − ratio q_b = offset.
    #[must_use]
    pub fn mimic(
        name: impl Into<String>,
        a: HingeCoordinate,
        b: HingeCoordinate,
        ratio: f64,
        offset: f64,
    ) -> Self {
        let terms =
            vec![Term { coordinate: a, factor: 1.0 }, Term { coordinate: b, factor: -ratio }];
        Self::linear(name, terms, offset)
    }

    /// Returns q_a + q_b = 0, for example the differential between the rockers of a rover.
    #[must_use]
    pub fn differential(name: impl Into<String>, a: HingeCoordinate, b: HingeCoordinate) -> Self {
        Self::mimic(name, a, b, -1.0, 0.0)
    }
}

/// A hinge between two frames that the tree does not connect: frame B moves relative to frame A as the hinge permits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LoopClosure {
    /// Its name.
    pub name: String,
    /// Body of frame A, or `world`.
    pub body_a: String,
    /// Frame A in its body.
    #[serde(default)]
    pub frame_a: Pose,
    /// Body of frame B, or `world`.
    pub body_b: String,
    /// Frame B in its body.
    #[serde(default)]
    pub frame_b: Pose,
    /// Motions that it permits. Prescribed sliders and pins move according to [`LoopMotion`].
    pub hinge: Hinge,
}

/// One scalar equation of a loop; directions are of unit length.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub enum LoopRow {
    /// n · p − Σ c u = 0.
    Slide {
        /// n, fixed in A.
        axis: Vec3,
        /// Prescribed sliders: index into the mechanism's loop motions, and c = n · slider axis.
        motions: Vec<(usize, f64)>,
    },
    /// a · b − cosine = 0.
    Across {
        /// Fixed in A.
        a: Vec3,
        /// Fixed in B.
        b: Vec3,
        /// Cosine of the angle between them.
        cosine: f64,
    },
    /// angle − u = 0. The angle is the rotation from `reference` in A to `reference` in B about `axis`.
    Turn {
        /// Axis, the same in A and B.
        axis: Vec3,
        /// A direction perpendicular to the axis.
        reference: Vec3,
        /// Index of u in the mechanism's loop motions.
        motion: usize,
    },
    /// n · p − pitch · angle = 0.
    Screw {
        /// Axis, the same in A and B.
        axis: Vec3,
        /// A direction perpendicular to the axis.
        reference: Vec3,
        /// Advance, m/rad.
        pitch: f64,
    },
}

/// A frame on a body or on the world.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Anchor {
    /// `None` is the world.
    pub body: Option<BodyId>,
    /// The frame in the body.
    pub pose: Pose,
}

/// A loop closure of a [`Multibody`](crate::Multibody).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Loop {
    /// Its description.
    pub closure: LoopClosure,
    /// Frame A.
    pub a: Anchor,
    /// Frame B.
    pub b: Anchor,
    /// Its scalar equations, at most six.
    pub rows: Vec<LoopRow>,
    /// Range of its prescribed subhinges in the loop motions.
    pub motions: std::ops::Range<usize>,
    /// Range of its gaps in the loop motions, one per row; empty without gaps.
    pub gaps: std::ops::Range<usize>,
}

/// A coupling of a [`Multibody`](crate::Multibody).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Coupled {
    /// Its description.
    pub coupling: Coupling,
    /// Terms: index in q, index in β, factor of q.
    pub terms: Vec<(usize, usize, f64)>,
    /// Factors of q², q³ and q⁴ of each term; empty for a linear relation.
    pub powers: Vec<[f64; 3]>,
    /// Bodies of the coordinates, in the order of the terms.
    pub bodies: Vec<BodyId>,
}

impl Coupled {
    /// Returns g(q): the left side of the relation minus its constant.
    #[must_use]
    pub fn error(&self, q: &[f64]) -> f64 {
        let sum: f64 = self.terms.iter().map(|(at, _, c)| c * q[*at]).sum();
        let higher = self.higher().map(|((at, ..), [a, b, d])| {
            let x = q[*at];
            x * x * (a + x * (b + x * d))
        });
        let error = sum - self.coupling.constant;
        higher.fold(error, |sum, x| sum + x)
    }

    /// Returns ∂g/∂q of a term.
    #[must_use]
    pub fn factor(&self, term: usize, q: &[f64]) -> f64 {
        let (at, _, c) = self.terms[term];
        let Some([a, b, d]) = self.powers.get(term) else { return c };
        let x = q[at];
        c + x * (2.0 * a + x * (3.0 * b + x * (4.0 * d)))
    }

    /// Returns ġ.
    #[must_use]
    pub fn rate(&self, q: &[f64], v: &[f64]) -> f64 {
        self.terms.iter().enumerate().map(|(k, (_, at, _))| self.factor(k, q) * v[*at]).sum()
    }

    /// Returns the part of g̈ that does not depend on accelerations: Σ ∂²g/∂q² v².
    #[must_use]
    pub fn bias(&self, q: &[f64], v: &[f64]) -> f64 {
        let bent = self.higher().map(|((at, rate, _), [a, b, d])| {
            let (x, v) = (q[*at], v[*rate]);
            (2.0 * a + x * (6.0 * b + x * (12.0 * d))) * v * v
        });
        bent.sum()
    }

    /// Returns whether the relation is linear.
    #[must_use]
    pub fn is_linear(&self) -> bool {
        self.powers.is_empty()
    }

    fn higher(&self) -> impl Iterator<Item = (&(usize, usize, f64), &[f64; 3])> {
        self.terms.iter().zip(&self.powers)
    }
}

/// Identifies a constraint: loops come first, then couplings, each kind by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum ConstraintId {
    /// Index into [`Multibody::loops`](crate::Multibody::loops).
    Loop(u32),
    /// Index into [`Multibody::couplings`](crate::Multibody::couplings).
    Coupling(u32),
}

/// Motion of a prescribed subhinge of a loop, or the gap of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoopMotion {
    /// u, rad or m.
    pub position: f64,
    /// u̇.
    pub rate: f64,
    /// ü.
    pub acceleration: f64,
}

/// Reason why a hinge cannot close a loop.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LoopFault {
    /// The hinge permits every motion.
    #[error("permits every motion, so the loop has no effect\n  help: remove the loop")]
    Nothing,
    /// Sliders after a rotation.
    #[error(
        "has a slider after a rotation\n  help: put the sliders first, or put half of the \
         hinge on a separate body"
    )]
    Order,
    /// Two axes permit the same motion.
    #[error("has axes that permit the same motion twice\n  help: leave one out")]
    Parallel,
    /// A prescribed subhinge does not correspond to a single equation.
    #[error(
        "may prescribe only sliders and one pin\n  help: prescribe a tree's hinge instead, or lock \
         the subhinge"
    )]
    Prescribed,
    /// A screw together with other subhinges.
    #[error("combines a screw with other subhinges\n  help: use the screw alone")]
    Screw,
    /// Inertia or limits on the hinge of a loop. They need a coordinate, which such a hinge lacks.
    #[error(
        "has armature or limits, which only hinges of the tree can have\n  help: make this hinge a \
         tree's hinge and close the loop elsewhere"
    )]
    Extras,
}

/// Returns the equations of a hinge. Loop motions of prescribed subhinges get indices from `first` on.
pub(crate) fn rows(hinge: &Hinge, first: usize) -> Result<Vec<LoopRow>, LoopFault> {
    let plain = |s: &crate::Subhinge| s.armature == 0.0 && s.limits == Limits::NONE;
    if !hinge.subhinges.iter().all(plain) {
        return Err(LoopFault::Extras);
    }
    let moving = || hinge.subhinges.iter().filter(|s| s.kind != SubhingeKind::Locked);
    if let Some(SubhingeKind::Screw { axis, pitch }) = moving().map(|s| s.kind).find(is_screw) {
        return match moving().count() {
            1 if moving().all(|s| s.coordinate == Coordinate::Free) => Ok(screw(axis, pitch)),
            1 => Err(LoopFault::Prescribed),
            _ => Err(LoopFault::Screw),
        };
    }
    let (mut sliders, mut turns, mut ball) = (Vec::new(), Vec::new(), false);
    let mut motion = first;
    for s in moving() {
        let given = (s.coordinate == Coordinate::Prescribed).then_some(motion);
        motion += usize::from(given.is_some());
        match s.kind {
            SubhingeKind::Slider { axis } => {
                let along = |t: &(Vec3, Option<usize>)| t.0.cross(&axis).norm() < 1e-12;
                if ball || !turns.iter().all(along) {
                    return Err(LoopFault::Order);
                }
                sliders.push((axis, given));
            }
            SubhingeKind::Pin { axis } => turns.push((axis, given)),
            SubhingeKind::Ball if given.is_none() => ball = true,
            SubhingeKind::Free if given.is_none() => return Err(LoopFault::Nothing),
            _ => return Err(LoopFault::Prescribed),
        }
    }
    let mut out = translations(&sliders)?;
    out.extend(rotations(&turns, ball)?);
    if out.is_empty() { Err(LoopFault::Nothing) } else { Ok(out) }
}

fn is_screw(k: &SubhingeKind) -> bool {
    matches!(k, SubhingeKind::Screw { .. })
}

/// Returns two unit vectors that are perpendicular to `n` and to each other.
fn across(n: &Vec3) -> [Vec3; 2] {
    let least = n.iamin();
    let mut e = Vec3::zeros();
    e[least] = 1.0;
    let x = n.cross(&e).normalize();
    [x, n.cross(&x)]
}

fn screw(axis: Vec3, pitch: f64) -> Vec<LoopRow> {
    let [x, y] = across(&axis);
    let mut out: Vec<LoopRow> =
        [x, y].map(|axis| LoopRow::Slide { axis, motions: Vec::new() }).into();
    out.extend([x, y].map(|a| LoopRow::Across { a, b: axis, cosine: 0.0 }));
    out.push(LoopRow::Screw { axis, reference: x, pitch });
    out
}

type Axis = (Vec3, Option<usize>);

/// Returns the equations perpendicular to the free sliders; prescribed sliders shift them.
fn translations(sliders: &[Axis]) -> Result<Vec<LoopRow>, LoopFault> {
    let of = |k: usize| sliders.get(k).map_or_else(Vec3::zeros, |s| s.0);
    let volume = match sliders.len() {
        0 | 1 => 1.0,
        2 => of(0).cross(&of(1)).norm(),
        3 => Mat3::from_columns(&[of(0), of(1), of(2)]).determinant().abs(),
        _ => 0.0,
    };
    if volume < 1e-9 {
        return Err(LoopFault::Parallel);
    }
    let free: Vec<Vec3> = sliders.iter().filter(|s| s.1.is_none()).map(|s| s.0).collect();
    let normals: Vec<Vec3> = match free[..] {
        [] => vec![Vec3::x(), Vec3::y(), Vec3::z()],
        [n] => across(&n).into(),
        [a, b] => vec![a.cross(&b).normalize()],
        _ => Vec::new(),
    };
    let row = |axis: Vec3| {
        let moved = sliders.iter().filter_map(|(d, given)| given.map(|m| (m, axis.dot(d))));
        LoopRow::Slide { axis, motions: moved.filter(|m| m.1 != 0.0).collect() }
    };
    Ok(normals.into_iter().map(row).collect())
}

fn rotations(turns: &[Axis], ball: bool) -> Result<Vec<LoopRow>, LoopFault> {
    let given = turns.iter().any(|t| t.1.is_some());
    let right = |a: Vec3, b: Vec3| LoopRow::Across { a, b, cosine: 0.0 };
    match (turns, ball) {
        ([], true) => Ok(Vec::new()),
        (_, true) => Err(if given { LoopFault::Prescribed } else { LoopFault::Parallel }),
        ([], false) => {
            let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
            Ok(vec![right(x, y), right(y, z), right(z, x)])
        }
        ([(axis, motion)], false) => {
            let [x, y] = across(axis);
            let mut out = vec![right(x, *axis), right(y, *axis)];
            if let Some(motion) = *motion {
                out.push(LoopRow::Turn { axis: *axis, reference: x, motion });
            }
            Ok(out)
        }
        _ if given => Err(LoopFault::Prescribed),
        ([(a, _), (b, _)], false) if a.cross(b).norm() > 1e-9 => {
            Ok(vec![LoopRow::Across { a: *a, b: *b, cosine: a.dot(b) }])
        }
        ([(a, _), (b, _), (c, _)], false)
            if a.cross(b).norm() > 1e-9 && b.cross(c).norm() > 1e-9 =>
        {
            Ok(Vec::new())
        }
        _ => Err(LoopFault::Parallel),
    }
}

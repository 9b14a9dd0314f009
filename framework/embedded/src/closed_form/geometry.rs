//! Six axes at zero joint angles, and which of them intersect or are parallel.

use super::subproblems::turned;
use linkwork_spatial::nalgebra::{Matrix6, Vector6};
use linkwork_spatial::{Pose, Quat, Vec3};

/// Tolerance for parallel axes (rad) and for intersecting axes (fraction of the arm's length). It is large because files contain values such as
/// 1.5708 for π/2. Solutions are refined afterwards with the arm's actual geometry.
const ALIKE: f64 = 1e-5;

/// An arm with six hinges: axes, points on the axes and the tip at zero angles, in the frame of its base.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arm {
    pub h: [Vec3; 6],
    pub p: [Vec3; 6],
    pub tip: Pose,
}

/// Relation of the first three axes that makes the position part solvable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum First {
    Meet12,
    Parallel12,
    Meet23,
    Parallel23,
}

/// Geometry of the axes that makes a closed form possible.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Axes 4, 5 and 6 intersect in a point.
    Wrist(First),
    /// Axes 2, 3 and 4 are parallel, and axes 5 and 6 intersect.
    Parallel,
}

/// A kind of geometry, of the arm itself or of the reversed arm.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Form {
    pub kind: Kind,
    pub reversed: bool,
}

fn rotation(h: &Vec3, angle: f64) -> Quat {
    Quat::from_scaled_axis(h * angle)
}

impl Arm {
    /// Returns the pose of the tip at the given angles.
    pub fn pose(&self, q: &[f64; 6]) -> Pose {
        let mut X = self.tip;
        for i in (0..6).rev() {
            let R = rotation(&self.h[i], q[i]);
            X = Pose::new(R * X.rotation, self.p[i] + R * (X.position - self.p[i]));
        }
        X
    }

    /// Returns the Jacobian, with columns [ω; v at the tip], at the given angles.
    pub fn jacobian(&self, q: &[f64; 6]) -> Matrix6<f64> {
        let (mut R, mut at) = (Quat::identity(), Vec3::zeros());
        let tip = self.pose(q).position;
        let mut J = Matrix6::zeros();
        for (i, angle) in q.iter().enumerate() {
            let (h, p) = (R * self.h[i], at + R * self.p[i]);
            let v = h.cross(&(tip - p));
            J.set_column(i, &Vector6::new(h.x, h.y, h.z, v.x, v.y, v.z));
            let turn = rotation(&self.h[i], *angle);
            at += R * (self.p[i] - turn * self.p[i]);
            R *= turn;
        }
        J
    }

    /// Returns the reversed arm, whose first axis is the last one of this arm. Its tip is the base of this arm, and its base is the tip of this arm
    /// at zero angles, with the axes of this arm's base.
    pub fn reversed(&self) -> Arm {
        let back = |i: usize| 5 - i;
        Arm {
            h: std::array::from_fn(|i| -self.h[back(i)]),
            p: std::array::from_fn(|i| self.p[back(i)]),
            tip: Pose::identity(),
        }
    }

    /// Returns the total length of the arm, m.
    pub fn length(&self) -> f64 {
        let pairs = self.p.windows(2).map(|w| (w[1] - w[0]).norm());
        pairs.sum::<f64>() + (self.tip.position - self.p[5]).norm()
    }

    /// Returns a copy whose points lie at the intersections that the closed form requires.
    pub fn arranged(mut self, kind: Kind) -> Arm {
        let last = if kind == Kind::Parallel { 4 } else { 3 };
        let at = self.meeting(last, last + 1).0;
        self.p[last..].fill(at);
        let first = match kind {
            Kind::Wrist(First::Meet12) => 0,
            Kind::Wrist(First::Meet23) => 1,
            Kind::Wrist(_) | Kind::Parallel => return self,
        };
        let at = self.meeting(first, first + 1).0;
        self.p[first..first + 2].fill(at);
        self
    }

    /// Returns the point closest to two non-parallel axes, and the distance of the axes.
    fn meeting(&self, i: usize, j: usize) -> (Vec3, f64) {
        let (a, b, d) = (&self.h[i], &self.h[j], self.p[j] - self.p[i]);
        let n = a.cross(b);
        let nn = n.norm_squared();
        let s = d.cross(b).dot(&n) / nn;
        let t = d.cross(a).dot(&n) / nn;
        let (x, y) = (self.p[i] + a * s, self.p[j] + b * t);
        ((x + y) * 0.5, (x - y).norm())
    }

    fn parallel(&self, i: usize, j: usize) -> bool {
        self.h[i].cross(&self.h[j]).norm() < ALIKE
    }

    fn meet(&self, i: usize, j: usize) -> bool {
        !self.parallel(i, j) && self.meeting(i, j).1 < ALIKE * self.length()
    }

    fn kind(&self) -> Option<Kind> {
        let apart = |i: usize, at: &Vec3| (at - self.p[i]).cross(&self.h[i]).norm();
        let wrist = self.meet(3, 4)
            && self.meet(4, 5)
            && apart(5, &self.meeting(3, 4).0) < ALIKE * self.length();
        if wrist {
            let first = match () {
                () if self.meet(0, 1) => First::Meet12,
                () if self.parallel(1, 2) => First::Parallel23,
                () if self.meet(1, 2) => First::Meet23,
                () if self.parallel(0, 1) => First::Parallel12,
                () => return None,
            };
            return Some(Kind::Wrist(first));
        }
        let three = self.parallel(1, 2) && self.parallel(2, 3) && !self.parallel(0, 1);
        (three && self.meet(4, 5)).then_some(Kind::Parallel)
    }

    /// Returns the closed form of the arm, or `None`.
    pub fn form(&self) -> Option<Form> {
        let forward = self.kind().map(|kind| Form { kind, reversed: false });
        forward.or_else(|| self.reversed().kind().map(|kind| Form { kind, reversed: true }))
    }
}

/// Returns the six-hinge arm that remains when one of seven hinges is locked.
pub(super) fn held(h: &[Vec3], p: &[Vec3], tip: &Pose, which: usize, angle: f64) -> Arm {
    let (axis, at) = (h[which], p[which]);
    let place = |i: usize| i + usize::from(i >= which);
    let beyond = |i: usize| place(i) > which;
    let turn = |x: &Vec3| at + turned(&axis, angle, &(x - at));
    Arm {
        h: std::array::from_fn(|i| match beyond(i) {
            true => turned(&axis, angle, &h[place(i)]),
            false => h[place(i)],
        }),
        p: std::array::from_fn(|i| if beyond(i) { turn(&p[place(i)]) } else { p[place(i)] }),
        tip: Pose::new(rotation(&axis, angle) * tip.rotation, turn(&tip.position)),
    }
}

//! Six axes in the configuration of zeros, and which of them meet or are parallel.

use super::subproblems::turned;
use linkwork_spatial::nalgebra::{Matrix6, Vector6};
use linkwork_spatial::{Pose, Quat, Vec3};

/// What counts as parallel (rad) and, of the arm's length, as meeting. Files round π/2 to 1.5708; each solution is brought onto
/// the arm as it is afterwards.
const ALIKE: f64 = 1e-5;

/// An arm of six hinges: axes and points on them with all angles zero, and its tip there; in the frame of its base.
#[derive(Clone, Copy, Debug)]
pub(super) struct Arm {
    pub h: [Vec3; 6],
    pub p: [Vec3; 6],
    pub tip: Pose,
}

/// Which two of the first three axes make their part solvable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum First {
    Meet12,
    Parallel12,
    Meet23,
    Parallel23,
}

/// Which axes make a closed form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// 4, 5, 6 meet in a point.
    Wrist(First),
    /// 2, 3, 4 are parallel, 5 and 6 meet.
    Parallel,
}

/// A kind, of the arm or of the arm seen from its tip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Form {
    pub kind: Kind,
    pub reversed: bool,
}

fn rotation(h: &Vec3, angle: f64) -> Quat {
    Quat::from_scaled_axis(h * angle)
}

impl Arm {
    /// The tip at these angles.
    pub fn pose(&self, q: &[f64; 6]) -> Pose {
        let mut X = self.tip;
        for i in (0..6).rev() {
            let R = rotation(&self.h[i], q[i]);
            X = Pose::new(R * X.rotation, self.p[i] + R * (X.position - self.p[i]));
        }
        X
    }

    /// Columns [ω; v at the tip] at these angles.
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

    /// The arm seen from its tip: the last axis is the first. Its tip is where the base of this one is, its base where the tip is with all
    /// angles zero, but in the same axes.
    pub fn reversed(&self) -> Arm {
        let back = |i: usize| 5 - i;
        Arm {
            h: std::array::from_fn(|i| -self.h[back(i)]),
            p: std::array::from_fn(|i| self.p[back(i)]),
            tip: Pose::identity(),
        }
    }

    /// Greatest distance between what it is made of, m.
    pub fn length(&self) -> f64 {
        let pairs = self.p.windows(2).map(|w| (w[1] - w[0]).norm());
        pairs.sum::<f64>() + (self.tip.position - self.p[5]).norm()
    }

    /// The same with points on the axes that its form asks for: where those that meet do.
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

    /// The point nearest to two axes that are not parallel, and how far they pass.
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

    /// Its closed form, where its axes have one.
    pub fn form(&self) -> Option<Form> {
        let forward = self.kind().map(|kind| Form { kind, reversed: false });
        forward.or_else(|| self.reversed().kind().map(|kind| Form { kind, reversed: true }))
    }
}

/// An arm of seven hinges with one of them held.
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

//! A frame relative to its parent frame: fixed, moved from outside, or moved by a subhinge.
//!
//! For a subhinge between the constant poses `before` and `after`: R₀ is the rotation of `before`, R = R₀ R(q), u = R₀ axis, and r = R p_after is the
//! vector from the subhinge's origin to the frame's:
//! ```text
//! pin     ω = u β                                α = u β̇
//! slider               w = u β                               c = u β̇
//! screw   ω = u β,     w = s u β                 α = u β̇,    c = s u β̇           s: pitch
//! ball    ω = R β                                α = R β̇
//! free    ω = R β_ω,   w = R β_v                 α = R β̇_ω,  c = R (β̇_v + β_ω × β_v)
//! V = [ω; w + ω × r]                             A = [α; c + α × r + ω × (ω × r)]
//! ```

use linkwork_multibody::SubhingeKind;
use linkwork_spatial::{Motion, Pose, Quat, Vec3};

/// Level of a term: a velocity depends on the pose, an acceleration on both.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Level {
    Pose = 0,
    Velocity = 1,
    Acceleration = 2,
}

/// Cause of the motion of a frame.
#[derive(Clone, Debug)]
pub(super) enum Mover {
    Fixed,
    Given,
    Subhinge(Box<Joint>),
}

/// A subhinge, its indices in the state of its mechanism, and its configuration terms.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub mechanism: usize,
    pub kind: SubhingeKind,
    pub q: usize,
    pub v: usize,
    pub before: Pose,
    pub after: Pose,
    /// R and r of the documentation of this file.
    R: Quat,
    r: Vec3,
}

impl Joint {
    pub fn new(mechanism: usize, kind: SubhingeKind, q: usize, v: usize, before: Pose) -> Self {
        let (R, r) = (Quat::identity(), Vec3::zeros());
        Self { mechanism, kind, q, v, before, after: Pose::identity(), R, r }
    }

    fn pose(&mut self, q: &[f64]) -> Pose {
        let X = self.before * self.kind.pose(&q[self.q..self.q + self.kind.nq()]);
        self.R = X.rotation;
        self.r = X.rotation * self.after.position;
        Pose::new(X.rotation * self.after.rotation, X.position + self.r)
    }

    /// Returns angular and linear rate at the subhinge's own origin, parent's axes.
    fn rates(&self, v: &[f64]) -> Motion {
        let o = Vec3::zeros();
        let (R0, v) = (&self.before.rotation, &v[self.v..]);
        match &self.kind {
            SubhingeKind::Pin { axis } => Motion::new(R0 * axis * v[0], o),
            SubhingeKind::Slider { axis } => Motion::new(o, R0 * axis * v[0]),
            SubhingeKind::Screw { axis, pitch } => {
                let u = R0 * axis * v[0];
                Motion::new(u, u * *pitch)
            }
            SubhingeKind::Ball => Motion::new(self.R * read(v), o),
            SubhingeKind::Free => Motion::new(self.R * read(v), self.R * read(&v[3..])),
            SubhingeKind::Locked => Motion::zero(),
        }
    }

    fn velocity(&self, v: &[f64]) -> Motion {
        self.rates(v).shift_to_child(&self.r)
    }

    fn acceleration(&self, v: &[f64], vdot: &[f64]) -> Motion {
        let (rate, mut own) = (self.rates(v), self.rates(vdot));
        if self.kind == SubhingeKind::Free {
            own.linear += rate.angular.cross(&rate.linear);
        }
        let mut A = own.shift_to_child(&self.r);
        A.linear += rate.angular.cross(&rate.angular.cross(&self.r));
        A
    }
}

fn read(s: &[f64]) -> Vec3 {
    Vec3::new(s[0], s[1], s[2])
}

/// The state of one mechanism.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub vdot: Vec<f64>,
}

/// A frame, its terms relative to its parent, and the times of their last change and computation.
#[derive(Clone, Debug)]
pub(super) struct Edge {
    pub parent: usize,
    pub mover: Mover,
    /// Pose and motion in the parent, parent's axes.
    pub X: Pose,
    pub V: Motion,
    pub A: Motion,
    /// Time of the last change that affects each level.
    pub changed: [u64; 3],
    /// Time of the last computation of each level.
    computed: [u64; 3],
}

impl Edge {
    pub fn new(parent: usize, mover: Mover, X: Pose) -> Self {
        let (V, A) = (Motion::zero(), Motion::zero());
        Self { parent, mover, X, V, A, changed: [1; 3], computed: [0; 3] }
    }

    /// Records a change of one level at `now`, and of the levels that depend on it.
    pub fn mark(&mut self, level: Level, now: u64) {
        self.changed[level as usize..].fill(now);
    }

    /// Computes one level if it is out of date (lower levels must be up to date); returns true if it was.
    pub fn refresh(&mut self, level: Level, states: &[State], now: u64) -> bool {
        let i = level as usize;
        let Mover::Subhinge(joint) = &mut self.mover else { return false };
        if self.computed[i] >= self.changed[i] {
            return false;
        }
        let state = &states[joint.mechanism];
        match level {
            Level::Pose => self.X = joint.pose(&state.q),
            Level::Velocity => self.V = joint.velocity(&state.v),
            Level::Acceleration => self.A = joint.acceleration(&state.v, &state.vdot),
        }
        self.computed[i] = now;
        true
    }
}

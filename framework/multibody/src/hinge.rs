//! Hinges: chains of subhinges from the parent body to the child body.

use crate::ball::BallLimits;
use crate::coordinates::quaternion;
use linkwork_spatial::nalgebra::Unit;
use linkwork_spatial::{Pose, Quat, Vec3};
use serde::{Deserialize, Serialize};

/// Whether the motion of a subhinge is computed or given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Coordinate {
    /// The force is given; dynamics computes the acceleration.
    #[default]
    Free,
    /// The acceleration is given; dynamics computes the force.
    Prescribed,
}

/// The motion that one subhinge allows. Axes are in the hinge frame. They need not have unit length, because building the mechanism normalizes them.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SubhingeKind {
    /// Rotation about an axis, rad.
    Pin {
        /// Axis of positive rotation.
        axis: Vec3,
    },
    /// Translation along an axis, m.
    Slider {
        /// Direction of positive displacement.
        axis: Vec3,
    },
    /// Rotation about an axis combined with translation along it.
    Screw {
        /// Axis of positive rotation.
        axis: Vec3,
        /// Translation per rotation, m/rad.
        pitch: f64,
    },
    /// Any rotation: quaternion and body rates.
    Ball,
    /// Any motion.
    Free,
    /// No motion: the child is welded to the parent.
    Locked,
}

impl SubhingeKind {
    /// Returns the number of elements in q.
    #[must_use]
    pub fn nq(&self) -> usize {
        match self {
            Self::Pin { .. } | Self::Slider { .. } | Self::Screw { .. } => 1,
            Self::Ball => 4,
            Self::Free => 7,
            Self::Locked => 0,
        }
    }

    /// Returns the number of degrees of freedom.
    #[must_use]
    pub fn nv(&self) -> usize {
        match self {
            Self::Pin { .. } | Self::Slider { .. } | Self::Screw { .. } => 1,
            Self::Ball => 3,
            Self::Free => 6,
            Self::Locked => 0,
        }
    }

    /// Returns the pose of the subhinge's child side in its parent side at the elements `q`. The axis must have unit length, as it has in a
    /// [`Multibody`](crate::Multibody).
    #[must_use]
    pub fn pose(&self, q: &[f64]) -> Pose {
        let turn = |axis: &Vec3| Quat::from_axis_angle(&Unit::new_unchecked(*axis), q[0]);
        match self {
            Self::Pin { axis } => Pose::rotation(turn(axis)),
            Self::Slider { axis } => Pose::new(Quat::identity(), axis * q[0]),
            Self::Screw { axis, pitch } => Pose::new(turn(axis), axis * (pitch * q[0])),
            Self::Ball => Pose::rotation(quaternion(q)),
            Self::Free => Pose::new(quaternion(&q[3..]), Vec3::new(q[0], q[1], q[2])),
            Self::Locked => Pose::identity(),
        }
    }

    /// Returns the axis of a one-dof subhinge, as given.
    #[must_use]
    pub fn axis(&self) -> Option<Vec3> {
        match self {
            Self::Pin { axis } | Self::Slider { axis } | Self::Screw { axis, .. } => Some(*axis),
            _ => None,
        }
    }
}

/// Limits of a one-dof subhinge. The dynamics kernels do not enforce them. Inverse kinematics stays within `lower … upper`, a simulation stops there
/// (see [`Stop`]), and motor models read the others.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Smallest coordinate, rad or m; −∞ if unlimited.
    pub lower: f64,
    /// Largest coordinate, rad or m; ∞ if unlimited.
    pub upper: f64,
    /// Largest speed, rad/s or m/s; ∞ if unlimited.
    pub rate: f64,
    /// Largest force, N m or N; ∞ if unlimited.
    pub effort: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self::NONE
    }
}

impl Limits {
    /// No limits.
    pub const NONE: Self = Self {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        rate: f64::INFINITY,
        effort: f64::INFINITY,
    };

    /// Returns limits on the coordinate only, rad or m.
    #[must_use]
    pub fn position(lower: f64, upper: f64) -> Self {
        Self { lower, upper, ..Self::NONE }
    }

    /// Returns whether `lower ≤ upper`, rate and effort are not negative, and nothing is NaN.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.lower <= self.upper && self.rate >= 0.0 && self.effort >= 0.0
    }
}

/// Force at `lower` and `upper` of a one-dof subhinge in a simulation that integrates the hinge. If the simulation steps the hinge together with
/// contact, the limits are rows of the contact problem and this force is unused.
///
/// ```text
/// F = max(0, k p (1 + min(1, c ṗ)))      p > 0: how far past the limit; inwards, never outwards
/// ```
/// This is Hunt and Crossley's law with the damping force limited to the spring force, so that a fast impact is at most twice as stiff as a slow one.
/// The coordinate leaves its stop at a speed of at most 1/c, provided that the step resolves the impact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Stop {
    /// A soft stop; its stiffness follows from the inertia at the coordinate and the step size.
    #[default]
    Usual,
    /// No stop: the coordinate may exceed its limit.
    Off,
    /// A soft stop.
    Soft {
        /// k: N m/rad or N/m.
        stiffness: f64,
        /// c: s/rad or s/m.
        damping: f64,
    },
}

/// Dry friction of a one-dof subhinge.
///
/// ```text
/// τ = −force · tanh(q̇ / rate)      where it is integrated, with rate > 0
/// |τ| ≤ force, sticking            where it is stepped with contact
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Friction {
    /// Largest force, N m or N.
    pub force: f64,
    /// Speed scale of the smooth form, rad/s or m/s. A coordinate that should stick creeps more slowly than this. 0: no smooth form; friction acts
    /// only in steps with contact.
    pub rate: f64,
}

impl Friction {
    /// No friction.
    pub const NONE: Self = Self { force: 0.0, rate: 0.0 };
}

/// Spring at a hinge: τ = −k (q − rest). On a ball: −k θ about the axis of the whole rotation θ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spring {
    /// k: N m/rad or N/m.
    pub stiffness: f64,
    /// Coordinate at which the force is zero, rad or m; 0 for a ball.
    pub rest: f64,
}

impl Spring {
    /// No spring.
    pub const NONE: Self = Self { stiffness: 0.0, rest: 0.0 };

    /// Returns the force at the coordinate `q`, N m or N: −k (q − rest).
    #[must_use]
    #[inline]
    pub fn force(&self, q: f64) -> f64 {
        -self.stiffness * (q - self.rest)
    }

    /// Returns the elastic energy at the coordinate `q`, J: ½ k (q − rest)².
    #[must_use]
    #[inline]
    pub fn energy(&self, q: f64) -> f64 {
        0.5 * self.stiffness * (q - self.rest) * (q - self.rest)
    }

    /// Returns the torque at the rotation of a ball, N m, body axes: −k θ about the axis of the rotation θ.
    #[must_use]
    #[inline]
    pub fn torque(&self, rotation: &Quat) -> Vec3 {
        rotation.scaled_axis() * -self.stiffness
    }

    /// Returns the elastic energy at the rotation of a ball, J: ½ k θ².
    #[must_use]
    #[inline]
    pub fn energy_of_ball(&self, rotation: &Quat) -> f64 {
        0.5 * self.stiffness * rotation.scaled_axis().norm_squared()
    }
}

/// One subhinge of a hinge.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Subhinge {
    /// The motion that it allows.
    pub kind: SubhingeKind,
    /// Free or prescribed.
    #[serde(default)]
    pub coordinate: Coordinate,
    /// Inertia of the rotor itself: kg m² (pin, screw, each ball rate), kg (slider). The coordinate feels [`Subhinge::reflected_inertia`]. Not for
    /// free subhinges.
    #[serde(default)]
    pub armature: f64,
    /// Rotor revolutions per hinge revolution (any sign, not 0).
    #[serde(default = "unity")]
    pub gear: f64,
    /// Limits; only on one-dof subhinges.
    #[serde(default)]
    pub limits: Limits,
    /// Behaviour at the limits of the coordinate.
    #[serde(default)]
    pub stop: Stop,
    /// Viscous damping d, N m s/rad (pin, screw, each ball rate) or N s/m (slider): τ = −d q̇. Not for free subhinges. A simulation adds this force;
    /// the dynamics kernels and their derivatives do not include it.
    #[serde(default)]
    pub damping: f64,
    /// Dry friction; only on one-dof subhinges. The dynamics kernels do not include it.
    #[serde(default)]
    pub friction: Friction,
    /// Spring; not on free subhinges. The dynamics kernels do not include it.
    #[serde(default)]
    pub spring: Spring,
    /// Limits of a ball.
    #[serde(default)]
    pub ball: BallLimits,
    /// Coefficient of restitution at the limits: rate after an impact divided by the rate before. `None`: 0 in steps with contact, otherwise as the
    /// stop's damping gives.
    #[serde(default)]
    pub restitution: Option<f64>,
}

fn unity() -> f64 {
    1.0
}

impl Subhinge {
    /// Returns the reflected inertia `gear² · armature`, which the rotor adds to the diagonal of the mass matrix, kg m² or kg.
    #[must_use]
    pub fn reflected_inertia(&self) -> f64 {
        self.gear * self.gear * self.armature
    }
}

impl From<SubhingeKind> for Subhinge {
    fn from(kind: SubhingeKind) -> Self {
        Self {
            kind,
            coordinate: Coordinate::Free,
            armature: 0.0,
            gear: 1.0,
            limits: Limits::NONE,
            stop: Stop::Usual,
            damping: 0.0,
            friction: Friction::NONE,
            spring: Spring::NONE,
            ball: BallLimits::NONE,
            restitution: None,
        }
    }
}

/// A hinge: subhinges in order from the parent's side.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hinge {
    /// The chain; empty means locked.
    pub subhinges: Vec<Subhinge>,
}

impl Default for Hinge {
    fn default() -> Self {
        Self::locked()
    }
}

impl Hinge {
    /// Returns a hinge of several subhinges, parent's side first.
    #[must_use]
    pub fn chain(kinds: impl IntoIterator<Item = SubhingeKind>) -> Self {
        Self { subhinges: kinds.into_iter().map(Subhinge::from).collect() }
    }

    /// Returns a pin: rotation about an axis.
    #[must_use]
    pub fn pin(axis: Vec3) -> Self {
        Self::chain([SubhingeKind::Pin { axis }])
    }

    /// Returns a slider: translation along an axis.
    #[must_use]
    pub fn slider(axis: Vec3) -> Self {
        Self::chain([SubhingeKind::Slider { axis }])
    }

    /// Returns a screw: rotation about an axis with `pitch` m/rad of translation.
    #[must_use]
    pub fn screw(axis: Vec3, pitch: f64) -> Self {
        Self::chain([SubhingeKind::Screw { axis, pitch }])
    }

    /// Returns a ball: any rotation.
    #[must_use]
    pub fn ball() -> Self {
        Self::chain([SubhingeKind::Ball])
    }

    /// Returns a free hinge: any motion.
    #[must_use]
    pub fn free() -> Self {
        Self::chain([SubhingeKind::Free])
    }

    /// Returns a locked hinge: no motion.
    #[must_use]
    pub fn locked() -> Self {
        Self { subhinges: Vec::new() }
    }

    /// Returns a universal joint: two intersecting pins.
    #[must_use]
    pub fn universal(first: Vec3, second: Vec3) -> Self {
        Self::chain([SubhingeKind::Pin { axis: first }, SubhingeKind::Pin { axis: second }])
    }

    /// Returns a cylindrical joint: a pin and a slider on one axis.
    #[must_use]
    pub fn cylindrical(axis: Vec3) -> Self {
        Self::chain([SubhingeKind::Slider { axis }, SubhingeKind::Pin { axis }])
    }

    /// Returns a gimbal: three pins about the moving x, y and z axes.
    #[must_use]
    pub fn gimbal() -> Self {
        Self::chain([Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| SubhingeKind::Pin { axis }))
    }

    /// Returns a planar joint: sliders along x and y of the hinge frame, then a pin about z.
    #[must_use]
    pub fn planar() -> Self {
        Self::chain([
            SubhingeKind::Slider { axis: Vec3::x() },
            SubhingeKind::Slider { axis: Vec3::y() },
            SubhingeKind::Pin { axis: Vec3::z() },
        ])
    }

    /// Returns the hinge with every subhinge prescribed.
    #[must_use]
    pub fn prescribed(mut self) -> Self {
        for s in &mut self.subhinges {
            s.coordinate = Coordinate::Prescribed;
        }
        self
    }

    /// Sets the same rotor inertia on every subhinge (see [`Subhinge::armature`]).
    #[must_use]
    pub fn armature(mut self, armature: f64) -> Self {
        for s in &mut self.subhinges {
            s.armature = armature;
        }
        self
    }

    /// Sets the same gear ratio on every subhinge (see [`Subhinge::gear`]).
    #[must_use]
    pub fn gear(mut self, gear: f64) -> Self {
        for s in &mut self.subhinges {
            s.gear = gear;
        }
        self
    }

    /// Sets the same limits on every subhinge (see [`Limits`]).
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        for s in &mut self.subhinges {
            s.limits = limits;
        }
        self
    }

    /// Sets the same stops on every subhinge (see [`Stop`]).
    #[must_use]
    pub fn stop(mut self, stop: Stop) -> Self {
        for s in &mut self.subhinges {
            s.stop = stop;
        }
        self
    }

    /// Sets the same viscous damping on every subhinge (see [`Subhinge::damping`]).
    #[must_use]
    pub fn damping(mut self, damping: f64) -> Self {
        for s in &mut self.subhinges {
            s.damping = damping;
        }
        self
    }

    /// Sets the same dry friction on every subhinge (see [`Friction`]).
    #[must_use]
    pub fn friction(mut self, friction: Friction) -> Self {
        for s in &mut self.subhinges {
            s.friction = friction;
        }
        self
    }

    /// Returns the number of elements in q.
    #[must_use]
    pub fn nq(&self) -> usize {
        self.subhinges.iter().map(|s| s.kind.nq()).sum()
    }

    /// Returns the number of degrees of freedom.
    #[must_use]
    pub fn nv(&self) -> usize {
        self.subhinges.iter().map(|s| s.kind.nv()).sum()
    }
}

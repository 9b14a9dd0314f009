//! Hinges: chains of subhinges from the parent body to the child body.

use crate::ball::BallLimits;
use crate::coordinates::quaternion;
use linkwork_spatial::nalgebra::Unit;
use linkwork_spatial::{Pose, Quat, Vec3};
use serde::{Deserialize, Serialize};

/// Who decides the motion of a subhinge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Coordinate {
    /// Its force is given; dynamics finds its acceleration.
    #[default]
    Free,
    /// Its acceleration is given; dynamics finds its force.
    Prescribed,
}

/// The motion that one subhinge allows. Axes are in the hinge frame, need not be unit length,
/// and are normalised at build.
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
    /// Rotation about an axis with advance along it.
    Screw {
        /// Axis of positive rotation.
        axis: Vec3,
        /// Advance, m/rad.
        pitch: f64,
    },
    /// Any rotation: quaternion and body rates.
    Ball,
    /// Any motion.
    Free,
    /// None: the child is welded to the parent.
    Locked,
}

impl SubhingeKind {
    /// Numbers of q.
    #[must_use]
    pub fn nq(&self) -> usize {
        match self {
            Self::Pin { .. } | Self::Slider { .. } | Self::Screw { .. } => 1,
            Self::Ball => 4,
            Self::Free => 7,
            Self::Locked => 0,
        }
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn nv(&self) -> usize {
        match self {
            Self::Pin { .. } | Self::Slider { .. } | Self::Screw { .. } => 1,
            Self::Ball => 3,
            Self::Free => 6,
            Self::Locked => 0,
        }
    }

    /// The pose across the subhinge (of its child side in its parent side) at its numbers of q.
    /// The axis must be of unit length, as it is in a [`Multibody`](crate::Multibody).
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

    /// The axis of a one-dof subhinge, as given.
    #[must_use]
    pub fn axis(&self) -> Option<Vec3> {
        match self {
            Self::Pin { axis } | Self::Slider { axis } | Self::Screw { axis, .. } => Some(*axis),
            _ => None,
        }
    }
}

/// What a one-dof subhinge may do. The kernels of dynamics do not enforce it: inverse kinematics stays
/// within `lower … upper`, a simulation stops there (see [`Stop`]), models of motors read the rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Least coordinate, rad or m; −∞ when there is none.
    pub lower: f64,
    /// Greatest coordinate, rad or m; ∞ when there is none.
    pub upper: f64,
    /// Greatest speed, rad/s or m/s; ∞ when there is none.
    pub rate: f64,
    /// Greatest force, N m or N; ∞ when there is none.
    pub effort: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self::NONE
    }
}

impl Limits {
    /// No limit at all.
    pub const NONE: Self = Self {
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        rate: f64::INFINITY,
        effort: f64::INFINITY,
    };

    /// Limits of the coordinate alone, rad or m.
    #[must_use]
    pub fn position(lower: f64, upper: f64) -> Self {
        Self { lower, upper, ..Self::NONE }
    }

    /// True when `lower ≤ upper`, speed and force are not negative, and nothing is NaN.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        self.lower <= self.upper && self.rate >= 0.0 && self.effort >= 0.0
    }
}

/// What a simulation does at `lower` and `upper` of a one-dof subhinge, where it is integrated. Where it
/// is stepped with contact, limits are rows of the contact problem and this is not used.
///
/// ```text
/// F = max(0, k p (1 + min(1, c ṗ)))      p > 0: how far past the limit; inwards, never outwards
/// ```
/// Hunt and Crossley's law, with its loss held to once the spring's force, so that a fast impact is no
/// stiffer than a slow one. A coordinate leaves its stop no faster than 1/c, where the step can follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub enum Stop {
    /// A soft stop whose stiffness follows from the inertia behind the coordinate and the step.
    #[default]
    Usual,
    /// Nothing: the coordinate may pass.
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
    /// Greatest force, N m or N.
    pub force: f64,
    /// Speed over which the smooth form rises, rad/s or m/s. A coordinate that should stick creeps at
    /// less than this. 0: there is no smooth form, and friction acts only together with contact.
    pub rate: f64,
}

impl Friction {
    /// No friction.
    pub const NONE: Self = Self { force: 0.0, rate: 0.0 };
}

/// A spring at a hinge: τ = −k (q − rest); of a ball −k θ about the axis of the whole rotation θ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Spring {
    /// k: N m/rad or N/m.
    pub stiffness: f64,
    /// Coordinate without force, rad or m; 0 of a ball.
    pub rest: f64,
}

impl Spring {
    /// No spring.
    pub const NONE: Self = Self { stiffness: 0.0, rest: 0.0 };
}

/// One link of the chain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Subhinge {
    /// What it allows.
    pub kind: SubhingeKind,
    /// Free or prescribed.
    #[serde(default)]
    pub coordinate: Coordinate,
    /// Rotor inertia at the rotor: kg m² (pin, screw, each ball rate), kg (slider). What reaches
    /// the coordinate is [`Subhinge::reflected_inertia`]. Not for free subhinges.
    #[serde(default)]
    pub armature: f64,
    /// Turns of the rotor per turn of the hinge (any sign, not 0).
    #[serde(default = "unity")]
    pub gear: f64,
    /// Limits; only for one-dof subhinges.
    #[serde(default)]
    pub limits: Limits,
    /// What happens at the limits of the coordinate.
    #[serde(default)]
    pub stop: Stop,
    /// Viscous damping d, N m s/rad (pin, screw, each ball rate) or N s/m (slider): τ = −d q̇. Not for
    /// free subhinges. A simulation adds it; the kernels of dynamics and their derivatives do not know it.
    #[serde(default)]
    pub damping: f64,
    /// Dry friction; only for one-dof subhinges. As with damping, the kernels do not know it.
    #[serde(default)]
    pub friction: Friction,
    /// Spring; not on free subhinges. As with damping, the kernels do not know it.
    #[serde(default)]
    pub spring: Spring,
    /// Limits of a ball.
    #[serde(default)]
    pub ball: BallLimits,
    /// Coefficient of restitution at the limits: the rate after an impact over that before. `None`: 0 with contact, and that of the
    /// stop without.
    #[serde(default)]
    pub restitution: Option<f64>,
}

fn unity() -> f64 {
    1.0
}

impl Subhinge {
    /// `gear² · armature`: what the rotor adds to the diagonal of the mass matrix, kg m² or kg.
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
    /// A chain of subhinges, parent's side first.
    #[must_use]
    pub fn chain(kinds: impl IntoIterator<Item = SubhingeKind>) -> Self {
        Self { subhinges: kinds.into_iter().map(Subhinge::from).collect() }
    }

    /// Rotation about an axis.
    #[must_use]
    pub fn pin(axis: Vec3) -> Self {
        Self::chain([SubhingeKind::Pin { axis }])
    }

    /// Translation along an axis.
    #[must_use]
    pub fn slider(axis: Vec3) -> Self {
        Self::chain([SubhingeKind::Slider { axis }])
    }

    /// Rotation about an axis with `pitch` m/rad of advance.
    #[must_use]
    pub fn screw(axis: Vec3, pitch: f64) -> Self {
        Self::chain([SubhingeKind::Screw { axis, pitch }])
    }

    /// Any rotation.
    #[must_use]
    pub fn ball() -> Self {
        Self::chain([SubhingeKind::Ball])
    }

    /// Any motion.
    #[must_use]
    pub fn free() -> Self {
        Self::chain([SubhingeKind::Free])
    }

    /// No motion.
    #[must_use]
    pub fn locked() -> Self {
        Self { subhinges: Vec::new() }
    }

    /// Two crossing pins.
    #[must_use]
    pub fn universal(first: Vec3, second: Vec3) -> Self {
        Self::chain([SubhingeKind::Pin { axis: first }, SubhingeKind::Pin { axis: second }])
    }

    /// A pin and a slider on one axis.
    #[must_use]
    pub fn cylindrical(axis: Vec3) -> Self {
        Self::chain([SubhingeKind::Slider { axis }, SubhingeKind::Pin { axis }])
    }

    /// Three pins about the moving x, y and z axes.
    #[must_use]
    pub fn gimbal() -> Self {
        Self::chain([Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| SubhingeKind::Pin { axis }))
    }

    /// Motion in the xy plane of the hinge frame: slides along x and y, then turns about z.
    #[must_use]
    pub fn planar() -> Self {
        Self::chain([
            SubhingeKind::Slider { axis: Vec3::x() },
            SubhingeKind::Slider { axis: Vec3::y() },
            SubhingeKind::Pin { axis: Vec3::z() },
        ])
    }

    /// Every subhinge prescribed.
    #[must_use]
    pub fn prescribed(mut self) -> Self {
        for s in &mut self.subhinges {
            s.coordinate = Coordinate::Prescribed;
        }
        self
    }

    /// The same rotor inertia on every subhinge (see [`Subhinge::armature`]).
    #[must_use]
    pub fn armature(mut self, armature: f64) -> Self {
        for s in &mut self.subhinges {
            s.armature = armature;
        }
        self
    }

    /// The same gear ratio on every subhinge (see [`Subhinge::gear`]).
    #[must_use]
    pub fn gear(mut self, gear: f64) -> Self {
        for s in &mut self.subhinges {
            s.gear = gear;
        }
        self
    }

    /// The same limits on every subhinge (see [`Limits`]).
    #[must_use]
    pub fn limits(mut self, limits: Limits) -> Self {
        for s in &mut self.subhinges {
            s.limits = limits;
        }
        self
    }

    /// The same stops on every subhinge (see [`Stop`]).
    #[must_use]
    pub fn stop(mut self, stop: Stop) -> Self {
        for s in &mut self.subhinges {
            s.stop = stop;
        }
        self
    }

    /// The same viscous damping on every subhinge (see [`Subhinge::damping`]).
    #[must_use]
    pub fn damping(mut self, damping: f64) -> Self {
        for s in &mut self.subhinges {
            s.damping = damping;
        }
        self
    }

    /// The same dry friction on every subhinge (see [`Friction`]).
    #[must_use]
    pub fn friction(mut self, friction: Friction) -> Self {
        for s in &mut self.subhinges {
            s.friction = friction;
        }
        self
    }

    /// Numbers of q.
    #[must_use]
    pub fn nq(&self) -> usize {
        self.subhinges.iter().map(|s| s.kind.nq()).sum()
    }

    /// Degrees of freedom.
    #[must_use]
    pub fn nv(&self) -> usize {
        self.subhinges.iter().map(|s| s.kind.nv()).sum()
    }
}

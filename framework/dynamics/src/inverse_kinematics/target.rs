//! Goals of inverse kinematics, and its results.

use linkwork_multibody::NodeId;
use linkwork_spatial::{Mat3, Motion, Pose, Quat, Vec3};
use thiserror::Error;

/// Goal of a frame: position, orientation or both, or parts of them. The frame itself, and the frame in which the goal is given, are not part of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Position of the frame's origin, m.
    pub position: Option<Vec3>,
    /// `R`: the axes of the frame in the reference axes.
    pub orientation: Option<Quat>,
    /// Weights of 1 m and 1 rad in the sum of squares; positive.
    pub weights: [f64; 2],
    /// Controlled part of the position.
    pub place: Place,
    /// Direction of an axis of the frame; an alternative to an orientation.
    pub pointing: Option<Pointing>,
}

/// Target of a node: a goal in the world or in another node's frame. Two nodes of one mechanism that must coincide close a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The node.
    pub node: NodeId,
    /// The frame in which the goal is given; `None` for the world.
    pub relative_to: Option<NodeId>,
    /// Its goal.
    pub goal: Goal,
}

/// Controlled part of a position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Place {
    /// The whole position.
    #[default]
    Point,
    /// The node's origin must lie in the plane through the position with this normal (length 1, in the target's frame).
    Plane(Vec3),
    /// The node's origin must lie on the line through the position along this direction (length 1, in the target's frame).
    Line(Vec3),
}

impl Place {
    /// Returns the controlled part of a vector.
    pub(super) fn part(self, d: Vec3) -> Vec3 {
        match self {
            Self::Point => d,
            Self::Plane(n) => n * n.dot(&d),
            Self::Line(u) => d - u * u.dot(&d),
        }
    }
}

/// Pointing direction of an axis of a node. The rotation about the axis is free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pointing {
    /// The axis (length 1, in the node's frame).
    pub axis: Vec3,
    /// Its target.
    pub to: Towards,
    /// Half of the opening angle of the cone about it in which every direction is accepted, rad; 0 for the direction itself.
    pub within: f64,
}

/// A direction, or a point at which the axis points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Towards {
    /// A direction (length 1, in the target's frame).
    Direction(Vec3),
    /// A point, m, in the target's frame.
    Point(Vec3),
}

impl Pointing {
    /// Creates an axis that points along a direction.
    #[must_use]
    pub fn along(axis: Vec3, direction: Vec3) -> Self {
        Self { axis, to: Towards::Direction(direction), within: 0.0 }
    }

    /// Creates an axis that points at a point.
    #[must_use]
    pub fn at(axis: Vec3, point: Vec3) -> Self {
        Self { axis, to: Towards::Point(point), within: 0.0 }
    }

    /// Accepts every direction in a cone with this half angle, rad.
    #[must_use]
    pub fn within(mut self, angle: f64) -> Self {
        self.within = angle;
        self
    }

    /// Returns the rotation error e, and two matrices that map rotations and translations of the node to changes of it. `d` is the current axis and
    /// `p` the node's origin, in the target's frame.
    /// ```text
    /// e = (θ − within)₊ n,  n = d × a/|d × a|                  a: required direction;  θ: angle between both
    /// ė = −P (ω + a × v/r)       P = 1 − d dᵀ; for a cone n nᵀ, inside it 0           r: distance of the point; ∞ for a direction
    /// ```
    pub(super) fn missing(&self, d: Vec3, p: Vec3) -> (Vec3, Mat3, Mat3) {
        let (a, near) = match self.to {
            Towards::Direction(a) => (a, 0.0),
            Towards::Point(x) => {
                let r = (x - p).norm();
                // At the point itself every direction points at it.
                if r > 0.0 { ((x - p) / r, 1.0 / r) } else { (d, 0.0) }
            }
        };
        let cross = d.cross(&a);
        let (sin, cos) = (cross.norm(), d.dot(&a));
        let n = match sin > 1e-12 {
            true => cross / sin,
            // The directions are parallel or antiparallel: every perpendicular rotation axis is
            // possible.
            false => {
                let mut least = Vec3::zeros();
                least[d.iamin()] = 1.0;
                d.cross(&least).normalize()
            }
        };
        let over = sin.atan2(cos) - self.within;
        let P = match (over > 0.0, self.within > 0.0) {
            (_, false) => Mat3::identity() - d * d.transpose(),
            (true, true) => n * n.transpose(),
            (false, true) => Mat3::zeros(),
        };
        (n * over.max(0.0), P, P * a.cross_matrix() * near)
    }
}

impl Goal {
    /// An empty goal, from which goals with some parts are built. Searches reject it.
    pub const NOTHING: Self = Self {
        position: None,
        orientation: None,
        weights: [1.0; 2],
        place: Place::Point,
        pointing: None,
    };

    /// Creates a goal for position and orientation.
    #[must_use]
    pub fn pose(X: Pose) -> Self {
        Self { orientation: Some(X.rotation), ..Self::position(X.position) }
    }

    /// Creates a goal for the position alone, m.
    #[must_use]
    pub fn position(p: Vec3) -> Self {
        Self { position: Some(p), ..Self::NOTHING }
    }

    /// Creates a goal for the orientation alone.
    #[must_use]
    pub fn orientation(R: Quat) -> Self {
        Self { orientation: Some(R), ..Self::NOTHING }
    }

    /// Creates a goal for the direction of an axis, without a position.
    #[must_use]
    pub fn pointing(pointing: Pointing) -> Self {
        Self::NOTHING.and_pointing(pointing)
    }

    /// Adds the direction of an axis to the goal, for example for welding and drilling. Replaces an orientation.
    #[must_use]
    pub fn and_pointing(mut self, pointing: Pointing) -> Self {
        (self.pointing, self.orientation) = (Some(pointing), None);
        self
    }

    /// Restricts the position to the given part.
    #[must_use]
    pub fn place(mut self, place: Place) -> Self {
        self.place = place;
        self
    }

    /// Sets the weights of 1 m and 1 rad.
    #[must_use]
    pub fn weights(mut self, position: f64, orientation: f64) -> Self {
        self.weights = [position, orientation];
        self
    }

    /// Transforms the goal to the frame in which its reference frame has the pose X.
    #[must_use]
    pub fn moved(&self, X: &Pose) -> Self {
        Self {
            position: self.position.map(|p| X.transform_point(&p)),
            orientation: self.orientation.map(|R| X.rotation * R),
            weights: self.weights,
            place: match self.place {
                Place::Point => Place::Point,
                Place::Plane(n) => Place::Plane(X.rotation * n),
                Place::Line(u) => Place::Line(X.rotation * u),
            },
            pointing: self.pointing.map(|p| Pointing {
                to: match p.to {
                    Towards::Direction(a) => Towards::Direction(X.rotation * a),
                    Towards::Point(x) => Towards::Point(X.transform_point(&x)),
                },
                ..p
            }),
        }
    }

    /// Returns the number of rows of its error.
    pub(super) fn rows(&self) -> usize {
        3 * (usize::from(self.position.is_some()) + usize::from(self.turns()))
    }

    /// Returns true if the goal includes an attitude.
    pub(super) fn turns(&self) -> bool {
        self.orientation.is_some() || self.pointing.is_some()
    }
}

impl Target {
    /// Creates a target in the world.
    #[must_use]
    pub fn new(node: NodeId, goal: Goal) -> Self {
        Self { node, relative_to: None, goal }
    }

    /// Returns a copy that is given in the frame of another node.
    #[must_use]
    pub fn relative_to(mut self, node: NodeId) -> Self {
        self.relative_to = Some(node);
        self
    }
}

/// Required velocity of a node, relative to the world or to another node, in the axes of that frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateTarget {
    /// The node.
    pub node: NodeId,
    /// The reference frame; `None` for the world.
    pub relative_to: Option<NodeId>,
    /// Angular (rad/s) and linear velocity (m/s, of the node's origin).
    pub velocity: Motion,
    /// Weight of 1 m/s in the sum of squares; 0 to ignore the linear part.
    pub linear_weight: f64,
    /// Weight of 1 rad/s; 0 to ignore the angular part.
    pub angular_weight: f64,
}

impl RateTarget {
    /// Creates a target for both parts, relative to the world.
    #[must_use]
    pub fn new(node: NodeId, velocity: Motion) -> Self {
        let (linear_weight, angular_weight) = (1.0, 1.0);
        Self { node, relative_to: None, velocity, linear_weight, angular_weight }
    }

    /// Returns a copy relative to another node.
    #[must_use]
    pub fn relative_to(mut self, node: NodeId) -> Self {
        self.relative_to = Some(node);
        self
    }

    /// Sets the weights of 1 m/s and 1 rad/s; 0 to ignore a part.
    #[must_use]
    pub fn weights(mut self, linear: f64, angular: f64) -> Self {
        (self.linear_weight, self.angular_weight) = (linear, angular);
        self
    }
}

/// Residual of a target; zero for a part that was not required.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Residual {
    /// Distance, m (for rates: m/s).
    pub position: f64,
    /// Angle, rad (for rates: rad/s).
    pub orientation: f64,
}

/// Tolerances and limits of the work of inverse kinematics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Largest error of position, m.
    pub position_tolerance: f64,
    /// Largest error of orientation, rad.
    pub orientation_tolerance: f64,
    /// Maximum number of steps from one start.
    pub iterations: usize,
    /// Number of additional starts (the same for each search) that are used when the given start fails. A quarter of them is used for a position in
    /// the world that is out of reach because of the link lengths.
    pub restarts: usize,
}

impl Default for Effort {
    /// 1e-9 m, 1e-9 rad, 100 steps, 64 additional starts. A target that cannot be reached costs about 700 evaluations of the kinematics in total, and
    /// 200 if the link lengths prove it.
    fn default() -> Self {
        let tolerance = 1e-9;
        Self {
            position_tolerance: tolerance,
            orientation_tolerance: tolerance,
            iterations: 100,
            restarts: 64,
        }
    }
}

/// Statistics of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SearchStatistics {
    /// Total number of steps, including those of failed starts.
    pub iterations: usize,
    /// Index of the start that led to the result; 0 is the given one.
    pub restarts: usize,
    /// Total number of kinematics evaluations.
    pub kinematics: usize,
}

/// The nearest configuration that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearest {
    /// The configuration (nq).
    pub q: Vec<f64>,
    /// Residual of each target.
    pub residuals: Vec<Residual>,
    /// Indices in β of coordinates at a limit.
    pub at_limit: Vec<usize>,
    /// Text with each target's node, its residual and the coordinates at their limits.
    pub text: String,
}

/// Reason why inverse kinematics failed.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum InverseKinematicsError {
    /// No start led to all targets at once.
    #[error(
        "not reached in {iterations} steps:{}\n  help: move the targets, widen limits or tolerances, \
         free kept coordinates, or start nearer",
        nearest.text
    )]
    Unreachable {
        /// Number of steps from all starts.
        iterations: usize,
        /// The nearest configuration.
        nearest: Box<Nearest>,
    },
    /// The closures cannot be closed, independent of the targets.
    #[error(
        "{closure} does not close in {iterations} steps: {:.3e} m and {:.3e} rad remain\n  help: check lengths, frames and limits of \
         what it closes, free kept coordinates, or start nearer to a closed configuration",
        residual.position, residual.orientation
    )]
    Open {
        /// Number of steps from all starts.
        iterations: usize,
        /// The closure with the largest residual, as ``loop `NAME` ``.
        closure: String,
        /// Its residual.
        residual: Residual,
        /// The configuration with the smallest closure error.
        nearest: Box<Nearest>,
    },
    /// Fixed rates, or limits, open a closure.
    #[error(
        "{closure} opens at {rate:.3e} rad/s or m/s\n  help: give kept and prescribed coordinates rates that are compatible with it, or let more coordinates move"
    )]
    Opens {
        /// The closure, as ``loop `NAME` ``.
        closure: String,
        /// Its largest rate.
        rate: f64,
    },
    /// Modes of a flexible body among the coordinates that may move. Forces bend a body, and a search does not compute forces.
    #[error(
        "the modes of body `{body}` cannot be moved by inverse kinematics\n  help: keep them (`InverseKinematics::keep`), and bend the body by dynamics or \
         from known loads"
    )]
    Flexible {
        /// The body.
        body: String,
    },
    /// NaN, infinity, or a weight that is negative or zero.
    #[error("{place} is {value}\n  help: {help}")]
    BadNumber {
        /// Location.
        place: String,
        /// The value.
        value: f64,
        /// The permitted range.
        help: &'static str,
    },
    /// An empty goal.
    #[error("{what} {target}: {fact}\n  help: {help}")]
    Empty {
        /// `target` or `closure`.
        what: &'static str,
        /// Index of the target, from 0.
        target: usize,
        /// The fault.
        fact: &'static str,
        /// The remedy.
        help: &'static str,
    },
}

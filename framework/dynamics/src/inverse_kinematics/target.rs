//! What inverse kinematics is to reach, and how near it came.

use linkwork_multibody::NodeId;
use linkwork_spatial::{Mat3, Motion, Pose, Quat, Vec3};
use thiserror::Error;

/// What is asked of a frame's place: position, orientation or both, or parts of them. Says neither which frame is meant nor from where it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    /// Of the frame's origin, m.
    pub position: Option<Vec3>,
    /// `R`: the frame's axes in those from which it is seen.
    pub orientation: Option<Quat>,
    /// What 1 m and 1 rad count in the sum of squares; positive.
    pub weights: [f64; 2],
    /// What of the position counts.
    pub place: Place,
    /// Where an axis of the frame points to; counts as orientation, and stands in for it.
    pub pointing: Option<Pointing>,
}

/// Where a node is to be: a goal, in the world or in another node's frame.
/// Two nodes of one mechanism that are to coincide close a loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The node that is to go there.
    pub node: NodeId,
    /// The frame in which it is to be there; `None` for the world.
    pub relative_to: Option<NodeId>,
    /// What is asked of it there.
    pub goal: Goal,
}

/// What of a position counts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Place {
    /// All of it.
    #[default]
    Point,
    /// The node's origin is to lie in the plane through the position with this normal (length 1, in the target's frame).
    Plane(Vec3),
    /// It is to lie on the line through the position along this direction (length 1, in the target's frame).
    Line(Vec3),
}

impl Place {
    /// The part of a vector that counts.
    pub(super) fn part(self, d: Vec3) -> Vec3 {
        match self {
            Self::Point => d,
            Self::Plane(n) => n * n.dot(&d),
            Self::Line(u) => d - u * u.dot(&d),
        }
    }
}

/// Where an axis of a node points to. The turn about the axis is free.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pointing {
    /// The axis (length 1, in the node).
    pub axis: Vec3,
    /// To where.
    pub to: Towards,
    /// Half of the angle of the cone about it within which any direction will do, rad; 0 for the direction itself.
    pub within: f64,
}

/// A direction, or a point that is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Towards {
    /// A direction (length 1, in the target's frame).
    Direction(Vec3),
    /// A point, m, in the target's frame.
    Point(Vec3),
}

impl Pointing {
    /// An axis along a direction.
    #[must_use]
    pub fn along(axis: Vec3, direction: Vec3) -> Self {
        Self { axis, to: Towards::Direction(direction), within: 0.0 }
    }

    /// An axis that looks at a point.
    #[must_use]
    pub fn at(axis: Vec3, point: Vec3) -> Self {
        Self { axis, to: Towards::Point(point), within: 0.0 }
    }

    /// Anywhere in a cone of this half angle, rad.
    #[must_use]
    pub fn within(mut self, angle: f64) -> Self {
        self.within = angle;
        self
    }

    /// The turn that is missing, and what maps turns and shifts of the node to changes of it: e, and two matrices. The axis as it is (`d`) and the
    /// node's origin `p`, in the target's frame.
    /// ```text
    /// e = (θ − within)₊ n,  n = d × a/|d × a|                  a: where to;  θ: angle between both
    /// ė = −P (ω + a × v/r)       P = 1 − d dᵀ; of a cone n nᵀ, inside it 0            r: distance of the point; ∞ for a direction
    /// ```
    pub(super) fn missing(&self, d: Vec3, p: Vec3) -> (Vec3, Mat3, Mat3) {
        let (a, near) = match self.to {
            Towards::Direction(a) => (a, 0.0),
            Towards::Point(x) => {
                let r = (x - p).norm();
                // At the point itself any direction looks at it.
                if r > 0.0 { ((x - p) / r, 1.0 / r) } else { (d, 0.0) }
            }
        };
        let cross = d.cross(&a);
        let (sin, cos) = (cross.norm(), d.dot(&a));
        let n = match sin > 1e-12 {
            true => cross / sin,
            // Along it or against it: any turn across will do.
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
    /// Nothing yet: what a goal of some parts begins with. No search takes it.
    pub const NOTHING: Self = Self {
        position: None,
        orientation: None,
        weights: [1.0; 2],
        place: Place::Point,
        pointing: None,
    };

    /// Position and orientation.
    #[must_use]
    pub fn pose(X: Pose) -> Self {
        Self { orientation: Some(X.rotation), ..Self::position(X.position) }
    }

    /// Position alone, m.
    #[must_use]
    pub fn position(p: Vec3) -> Self {
        Self { position: Some(p), ..Self::NOTHING }
    }

    /// Orientation alone.
    #[must_use]
    pub fn orientation(R: Quat) -> Self {
        Self { orientation: Some(R), ..Self::NOTHING }
    }

    /// An axis of the frame points somewhere; nothing is asked of its position.
    #[must_use]
    pub fn pointing(pointing: Pointing) -> Self {
        Self::NOTHING.and_pointing(pointing)
    }

    /// Beside the position an axis points somewhere: all that welding and drilling ask for. Takes the place of an orientation.
    #[must_use]
    pub fn and_pointing(mut self, pointing: Pointing) -> Self {
        (self.pointing, self.orientation) = (Some(pointing), None);
        self
    }

    /// Of the position only what this says.
    #[must_use]
    pub fn place(mut self, place: Place) -> Self {
        self.place = place;
        self
    }

    /// What 1 m and 1 rad count.
    #[must_use]
    pub fn weights(mut self, position: f64, orientation: f64) -> Self {
        self.weights = [position, orientation];
        self
    }

    /// The same goal seen from where the frame in which it is given lies at X.
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

    /// Numbers of its error.
    pub(super) fn rows(&self) -> usize {
        3 * (usize::from(self.position.is_some()) + usize::from(self.turns()))
    }

    /// Whether anything is asked of its attitude.
    pub(super) fn turns(&self) -> bool {
        self.orientation.is_some() || self.pointing.is_some()
    }
}

impl Target {
    /// A goal of a node in the world.
    #[must_use]
    pub fn new(node: NodeId, goal: Goal) -> Self {
        Self { node, relative_to: None, goal }
    }

    /// The same in the frame of another node.
    #[must_use]
    pub fn relative_to(mut self, node: NodeId) -> Self {
        self.relative_to = Some(node);
        self
    }
}

/// How a node is to move: as seen from the world or from another node, in that frame's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateTarget {
    /// The node.
    pub node: NodeId,
    /// From where it is seen; `None` for the world.
    pub relative_to: Option<NodeId>,
    /// Angular (rad/s) and linear (m/s, of the node's origin).
    pub velocity: Motion,
    /// What 1 m/s counts in the sum of squares; 0 when the linear part does not matter.
    pub linear_weight: f64,
    /// What 1 rad/s counts; 0 when the angular part does not matter.
    pub angular_weight: f64,
}

impl RateTarget {
    /// Both parts, seen from the world.
    #[must_use]
    pub fn new(node: NodeId, velocity: Motion) -> Self {
        let (linear_weight, angular_weight) = (1.0, 1.0);
        Self { node, relative_to: None, velocity, linear_weight, angular_weight }
    }

    /// The same seen from another node.
    #[must_use]
    pub fn relative_to(mut self, node: NodeId) -> Self {
        self.relative_to = Some(node);
        self
    }

    /// What 1 m/s and 1 rad/s count; 0 for a part that does not matter.
    #[must_use]
    pub fn weights(mut self, linear: f64, angular: f64) -> Self {
        (self.linear_weight, self.angular_weight) = (linear, angular);
        self
    }
}

/// How far a node is from its target; zero for a part that was not asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Residual {
    /// m (of rates: m/s).
    pub position: f64,
    /// rad (of rates: rad/s).
    pub orientation: f64,
}

/// When inverse kinematics is content, and how long it tries.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Greatest error of position, m.
    pub position_tolerance: f64,
    /// Greatest error of orientation, rad.
    pub orientation_tolerance: f64,
    /// Steps from one start.
    pub iterations: usize,
    /// Starts elsewhere (the same ones each time) when the given start does not lead there; a quarter of them for the nearest to a position in the world that is
    /// out of reach by the lengths of links.
    pub restarts: usize,
}

impl Default for Effort {
    /// 1e-9 m, 1e-9 rad, 100 steps, 64 other starts: a target that cannot be reached costs some 700 evaluations of
    /// the kinematics in all, and 200 where that is known from lengths.
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

/// How a solution was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Found {
    /// Steps in all, those of vain starts too.
    pub iterations: usize,
    /// Which start led there; 0 is the given one.
    pub restarts: usize,
    /// Evaluations of the kinematics in all.
    pub kinematics: usize,
}

/// The nearest that was reached.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearest {
    /// The configuration (nq).
    pub q: Vec<f64>,
    /// For each target.
    pub residuals: Vec<Residual>,
    /// Places in β of coordinates at a limit.
    pub at_limit: Vec<usize>,
    /// Each target's node, its residual and the coordinates at their limits, in words.
    pub text: String,
}

/// Why there is no configuration.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum InverseKinematicsError {
    /// No start led to all targets at once.
    #[error(
        "not reached in {iterations} steps:{}\n  help: move the targets, widen limits or tolerances, \
         free kept coordinates, or start nearer",
        nearest.text
    )]
    Unreachable {
        /// Steps from all starts.
        iterations: usize,
        /// The nearest configuration.
        nearest: Box<Nearest>,
    },
    /// The closures cannot be closed, whatever becomes of the targets.
    #[error(
        "{closure} does not close in {iterations} steps: {:.3e} m and {:.3e} rad are left\n  help: check lengths, frames and limits of \
         what it closes, free kept coordinates, or start nearer to a closed configuration",
        residual.position, residual.orientation
    )]
    Open {
        /// Steps from all starts.
        iterations: usize,
        /// The one that is farthest from closed, as ``loop `NAME` ``.
        closure: String,
        /// How far that is.
        residual: Residual,
        /// Where closures are least open.
        nearest: Box<Nearest>,
    },
    /// Rates that stay as given, or limits of others, open a closure.
    #[error(
        "{closure} opens at {rate:.3e} rad/s or m/s\n  help: give rates that fit it to what is kept or prescribed, or let more of it move"
    )]
    Opens {
        /// The closure, as ``loop `NAME` ``.
        closure: String,
        /// Its greatest rate.
        rate: f64,
    },
    /// Modes that are to move: what bends a body is its forces, which no search knows.
    #[error(
        "the modes of body `{body}` are to move\n  help: keep them (`InverseKinematics::keep`), and bend the body by dynamics or \
         by what its loads are known to be"
    )]
    Flexible {
        /// The body.
        body: String,
    },
    /// A NaN, an infinity, or a weight that is negative or nothing.
    #[error("{place} is {value}\n  help: {help}")]
    BadNumber {
        /// Where.
        place: String,
        /// What it is.
        value: f64,
        /// What it should be.
        help: &'static str,
    },
    /// A target that says nothing.
    #[error("{what} {target}: {fact}\n  help: {help}")]
    Empty {
        /// `target` or `closure`.
        what: &'static str,
        /// Which, from 0.
        target: usize,
        /// Why.
        fact: &'static str,
        /// What to do.
        help: &'static str,
    },
}

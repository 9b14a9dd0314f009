//! Errors: of a model, as text and all at once; of a call, as a value of fixed size.

use linkwork_collision::ShapeFault;
use thiserror::Error;

/// All faults of a model.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{}", .faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct ModelError {
    /// The faults.
    pub faults: Vec<ModelFault>,
}

/// One fault in the description of a model.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModelFault {
    /// A file cannot be read or its text is invalid.
    #[error("{text}")]
    File {
        /// Position in the file, fact and remedy.
        text: String,
    },
    /// The mechanism cannot be built.
    #[error("{text}")]
    Mechanism {
        /// Fact and remedy.
        text: String,
    },
    /// A name that does not exist.
    #[error("{place} refers to the {kind} `{name}`, which does not exist\n  help: {help}")]
    Unknown {
        /// The place that refers to it.
        place: String,
        /// `body`, `joint`, `part`.
        kind: &'static str,
        /// The name.
        name: String,
        /// The most similar name, or a remedy.
        help: String,
    },
    /// Two parts or two objects have the same name.
    #[error("there are two {kind}s with the name `{name}`\n  help: rename one of them")]
    Twice {
        /// `part` or `object`.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// The base of a chain does not lie between its tip and the world.
    #[error(
        "part `{part}`: `{base}` is not between `{tip}` and the world\n  help: name a body \
         that carries the tip, or `world`"
    )]
    NoPath {
        /// The part.
        part: String,
        /// Its base.
        base: String,
        /// Its tip.
        tip: String,
    },
    /// A part without bodies.
    #[error("part `{part}` has no bodies\n  help: name a chain, or at least one body")]
    Empty {
        /// The part.
        part: String,
    },
    /// A feature of the mechanism that the embedded model does not support.
    #[error("an embedded model does not support {what}\n  help: {help}")]
    Refused {
        /// The feature.
        what: String,
        /// The remedy.
        help: &'static str,
    },
    /// Two padded shapes would touch at every configuration.
    #[error(
        "shapes `{name}` and `{other}` are at most {most:.4} m apart, but their padding is {all:.4} m in total: they touch at every configuration\n  \
         help: reduce the padding, or add a rule that excludes this pair"
    )]
    Padding {
        /// One shape.
        name: String,
        /// The other.
        other: String,
        /// Total padding of both, m.
        all: f64,
        /// Their largest possible distance, m.
        most: f64,
    },
    /// Mass properties that no rigid body can have.
    #[error("object `{object}`: {text}")]
    Inertia {
        /// The object.
        object: String,
        /// Fact and remedy.
        text: String,
    },
}

/// A closed loop or a coupling that whole-body inverse kinematics keeps closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Closure {
    /// Two hands that hold one object.
    Hands {
        /// Index of the object.
        object: usize,
    },
    /// A loop of the mechanism.
    Loop {
        /// Index among [`Multibody::loops`](linkwork_multibody::Multibody::loops).
        index: usize,
    },
    /// A coupling of the mechanism.
    Coupling {
        /// Index among [`Multibody::couplings`](linkwork_multibody::Multibody::couplings).
        index: usize,
    },
}

impl std::fmt::Display for Closure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Hands { object } => write!(f, "the grasp of object {object} by two hands"),
            Self::Loop { index } => write!(f, "loop {index} of the mechanism"),
            Self::Coupling { index } => write!(f, "coupling {index} of the mechanism"),
        }
    }
}

/// Error of a call. It is `Copy` and does not allocate; its text is formatted only when it is displayed.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum RobotError {
    /// A handle that belongs to another model.
    #[error("this handle belongs to another model\n  help: get it by name from this robot's model")]
    ForeignHandle,
    /// A part that is not a chain.
    #[error(
        "part {part} is not a chain: its bodies do not follow one another\n  help: define it by a base \
         and a tip"
    )]
    NotAChain {
        /// Index of the part.
        part: usize,
    },
    /// A search that was not begun cannot be continued.
    #[error("part {part} has no search to continue\n  help: begin one with `inverse_kinematics`")]
    NoSearch {
        /// Index of the part.
        part: usize,
    },
    /// A chain without a supported closed form of its inverse kinematics.
    #[error(
        "part {part} has no closed form: {why}\n  help: chains of six or seven hinges have one if the last or first three axes intersect in a point (and two \
         neighbours of the others intersect or are parallel) or three axes in the middle are parallel; `inverse_kinematics` works for every chain"
    )]
    NoClosedForm {
        /// Index of the part.
        part: usize,
        /// The missing condition.
        why: &'static str,
    },
    /// A NaN or an infinity.
    #[error("number {index} of `{what}` is {value}\n  help: give finite numbers")]
    NotFinite {
        /// The argument.
        what: &'static str,
        /// Index in it.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A quaternion of length zero, such as zeros for a free body.
    #[error(
        "`{what}`: the quaternion at index {index} has length zero\n  help: give x y z w, with w = 1 for no rotation"
    )]
    ZeroQuaternion {
        /// The argument.
        what: &'static str,
        /// Index of its first number.
        index: usize,
    },
    /// A number outside its permitted range.
    #[error("`{what}` is {value}\n  help: {help}")]
    OutOfRange {
        /// The argument.
        what: &'static str,
        /// The value.
        value: f64,
        /// The permitted range.
        help: &'static str,
    },
    /// An argument of the wrong length.
    #[error("`{what}` has {got} numbers, expected {wanted}\n  help: give {wanted}")]
    Length {
        /// The argument.
        what: &'static str,
        /// Its length.
        got: usize,
        /// The expected length.
        wanted: usize,
    },
    /// The start of inverse kinematics is outside the limits.
    #[error(
        "coordinate {dof} starts at {value}, outside its limits {lower} … {upper}\n  help: start \
         within limits (`Robot::clamp` moves q there)"
    )]
    OutsideLimits {
        /// Index in β.
        dof: usize,
        /// Its value.
        value: f64,
        /// Its lower limit.
        lower: f64,
        /// Its upper limit.
        upper: f64,
    },
    /// More items than were reserved at set-up.
    #[error("{wanted} {what}, but memory is reserved for {room}\n  help: reserve more at set-up")]
    NoRoom {
        /// The kind of items.
        what: &'static str,
        /// The number given.
        wanted: usize,
        /// The number reserved.
        room: usize,
    },
    /// A hand already holds the object.
    #[error(
        "object {object} is already held\n  help: release it first, or grasp it with a second hand"
    )]
    Held {
        /// Index of the object.
        object: usize,
    },
    /// No hand holds the object.
    #[error("object {object} is not held\n  help: grasp it first")]
    NotHeld {
        /// Index of the object.
        object: usize,
    },
    /// The object is attached to another object.
    #[error(
        "object {object} is attached to object {on}\n  help: detach it first (`detach`), or grasp the other object"
    )]
    Attached {
        /// Index of the object.
        object: usize,
        /// Index of the other object.
        on: usize,
    },
    /// The object is not attached to another object.
    #[error("object {object} is not attached to another object\n  help: attach it first")]
    NotAttached {
        /// Index of the object.
        object: usize,
    },
    /// The object is rigid.
    #[error(
        "object {object} has no joints\n  help: add the bodies that are attached to it to `ModelSpec::linkages`"
    )]
    NoJoints {
        /// Index of the object.
        object: usize,
    },
    /// The hand does not hold the object.
    #[error("part {part} holds nothing\n  help: grasp an object first")]
    EmptyHand {
        /// Index of the part.
        part: usize,
    },
    /// The hand already holds an object.
    #[error("part {part} already holds an object\n  help: release it first")]
    HandFull {
        /// Index of the part.
        part: usize,
    },
    /// The second hand is not at the pose that its grasp requires.
    #[error(
        "the second hand, part {part}, is {position} m and {orientation} rad away from the pose that its grasp requires\n  \
         help: move it there first, or grasp at the current pose (`Grasp::Here`)"
    )]
    LoopOpen {
        /// The second hand.
        part: usize,
        /// Distance, m.
        position: f64,
        /// Angle, rad.
        orientation: f64,
    },
    /// A call that does not support loops, couplings or two hands on an object, and would open one.
    #[error(
        "{what} does not support {closure}\n  help: use `WholeBodyIk`, which keeps it closed; or remove it from the \
         model, or release one hand"
    )]
    OpensClosure {
        /// The call.
        what: &'static str,
        /// The closure that it would open.
        closure: Closure,
    },
    /// No configuration within limits closes a closure, independent of the goals.
    #[error(
        "{closure} cannot be closed: the residual is {position:.3e} m and {orientation:.3e} rad\n  help: q is the configuration with the smallest residual; check \
         the closure, let more degrees of freedom move, or release one hand"
    )]
    DoesNotClose {
        /// The closure.
        closure: Closure,
        /// Residual distance, m.
        position: f64,
        /// Residual angle, rad.
        orientation: f64,
    },
    /// Two padded colliders would touch at every configuration.
    #[error(
        "colliders {a} and {b} are at most {most} m apart, but their padding would be {padding} m in total: they would touch at every configuration\n  help: \
         reduce the padding, or exclude the pair with `look_at`"
    )]
    NeverFree {
        /// One collider.
        a: usize,
        /// The other.
        b: usize,
        /// Total padding of both, m.
        padding: f64,
        /// Their largest possible distance, m.
        most: f64,
    },
    /// Points or cells that are not valid for a collider.
    #[error(transparent)]
    Shape(#[from] ShapeFault),
    /// Equations without a unique solution.
    #[error("{what} has no solution here\n  help: {help}")]
    Singular {
        /// The quantity to be computed.
        what: &'static str,
        /// The remedy.
        help: &'static str,
    },
}

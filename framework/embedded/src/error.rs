//! What can go wrong: with a model, in words and all at once; with a call, as a value of fixed size.

use linkwork_collision::ShapeFault;
use thiserror::Error;

/// Everything that is wrong with a model.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{}", .faults.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))]
pub struct ModelError {
    /// Each fault.
    pub faults: Vec<ModelFault>,
}

/// One mistake in what a model was made of.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModelFault {
    /// A file or its text.
    #[error("{text}")]
    File {
        /// Place, fact and remedy.
        text: String,
    },
    /// The mechanism cannot be built.
    #[error("{text}")]
    Mechanism {
        /// Fact and remedy.
        text: String,
    },
    /// A name that nothing has.
    #[error("{place} names the {kind} `{name}`, which is not there\n  help: {help}")]
    Unknown {
        /// Who names it.
        place: String,
        /// `body`, `joint`, `part`.
        kind: &'static str,
        /// The name.
        name: String,
        /// The nearest name, or what to do.
        help: String,
    },
    /// Two parts or two objects of one name.
    #[error("there are two {kind}s `{name}`\n  help: give each its own name")]
    Twice {
        /// `part` or `object`.
        kind: &'static str,
        /// The name.
        name: String,
    },
    /// The base of a chain does not lie between its tip and the world.
    #[error(
        "part `{part}`: `{base}` is not on the way from `{tip}` to the world\n  help: name a body \
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
    /// A part of no bodies.
    #[error("part `{part}` has no bodies\n  help: name a chain, or at least one body")]
    Empty {
        /// The part.
        part: String,
    },
    /// Something of the mechanism that the embedded model would have to leave out.
    #[error("{what} is not part of an embedded model\n  help: {help}")]
    Refused {
        /// What.
        what: String,
        /// What to do.
        help: &'static str,
    },
    /// Padding with which two shapes touch at every configuration.
    #[error(
        "shapes `{name}` and `{other}` are never more than {most:.4} m apart, and are padded by {all:.4} m: they touch at every configuration\n  \
         help: less padding, or a rule by which they do not meet"
    )]
    Padding {
        /// One shape.
        name: String,
        /// The other.
        other: String,
        /// Padding of both, m.
        all: f64,
        /// How far apart they are at the most, m.
        most: f64,
    },
    /// Mass properties that no body has.
    #[error("object `{object}`: {text}")]
    Inertia {
        /// The object.
        object: String,
        /// Fact and remedy.
        text: String,
    },
}

/// What inverse kinematics of the whole keeps closed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Closure {
    /// Two hands on an object, by its place among the objects.
    Hands {
        /// The object.
        object: usize,
    },
    /// A loop of the mechanism, by its place among [`Multibody::loops`](linkwork_multibody::Multibody::loops).
    Loop {
        /// Its place.
        index: usize,
    },
    /// A coupling of the mechanism, by its place among [`Multibody::couplings`](linkwork_multibody::Multibody::couplings).
    Coupling {
        /// Its place.
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

/// Why a call did nothing. `Copy`, without memory of its own; the words are made when it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum RobotError {
    /// A handle of another model.
    #[error("this handle is of another model\n  help: ask this robot's model for it by name")]
    ForeignHandle,
    /// A part without a tip.
    #[error(
        "part {part} is no chain: its bodies do not follow one another\n  help: make it of a base \
         and a tip"
    )]
    NotAChain {
        /// Its place among the parts.
        part: usize,
    },
    /// A search is to go on, and none was begun.
    #[error("part {part} has no search to go on with\n  help: begin one with `reach`")]
    NoSearch {
        /// Its place among the parts.
        part: usize,
    },
    /// A chain whose inverse kinematics has no closed form that is known here.
    #[error(
        "part {part} has no closed form: {why}\n  help: six or seven hinges are solved when the last or first three axes meet in a point (and two \
         neighbours of the others meet or are parallel) or three in the middle are parallel; `reach` takes any chain"
    )]
    NoClosedForm {
        /// Its place among the parts.
        part: usize,
        /// What it lacks.
        why: &'static str,
    },
    /// A NaN or an infinity.
    #[error("number {index} of `{what}` is {value}\n  help: give finite numbers")]
    NotFinite {
        /// The argument.
        what: &'static str,
        /// Place in it.
        index: usize,
        /// What it is.
        value: f64,
    },
    /// A quaternion without a direction, such as zeros for a free body.
    #[error(
        "`{what}`: the quaternion at {index} has no length\n  help: give x y z w with w = 1 for no turn"
    )]
    ZeroQuaternion {
        /// The argument.
        what: &'static str,
        /// Place of its first number.
        index: usize,
    },
    /// A number out of its range.
    #[error("`{what}` is {value}\n  help: {help}")]
    OutOfRange {
        /// The argument.
        what: &'static str,
        /// What it is.
        value: f64,
        /// What it has to be.
        help: &'static str,
    },
    /// An argument of the wrong length.
    #[error("`{what}` has {got} numbers, not {wanted}\n  help: give {wanted}")]
    Length {
        /// The argument.
        what: &'static str,
        /// Its length.
        got: usize,
        /// What it has to be.
        wanted: usize,
    },
    /// The start of inverse kinematics lies outside the limits.
    #[error(
        "coordinate {dof} starts at {value}, outside its limits {lower} … {upper}\n  help: start \
         within limits (`Robot::clamp` moves q there)"
    )]
    OutsideLimits {
        /// Place in β.
        dof: usize,
        /// Where it is.
        value: f64,
        /// Its lower limit.
        lower: f64,
        /// Its upper limit.
        upper: f64,
    },
    /// Targets or memory that were not asked for at set-up.
    #[error("{wanted} {what}, room was reserved for {room}\n  help: reserve more at set-up")]
    NoRoom {
        /// What.
        what: &'static str,
        /// How many were given.
        wanted: usize,
        /// For how many there is room.
        room: usize,
    },
    /// The object is in a hand already.
    #[error(
        "object {object} is held already\n  help: let it go first, or grasp it as the second hand"
    )]
    Held {
        /// Its place among the objects.
        object: usize,
    },
    /// The object is in no hand.
    #[error("object {object} is not held\n  help: grasp it first")]
    NotHeld {
        /// Its place among the objects.
        object: usize,
    },
    /// The object is attached to another one.
    #[error(
        "object {object} is attached to object {on}\n  help: take it off first (`detach`), or take that one"
    )]
    Attached {
        /// Its place among the objects.
        object: usize,
        /// The other's.
        on: usize,
    },
    /// The object is attached to nothing.
    #[error("object {object} is attached to nothing\n  help: attach it first")]
    NotAttached {
        /// Its place among the objects.
        object: usize,
    },
    /// The object is rigid.
    #[error(
        "object {object} has no joints\n  help: give it bodies of its own in `ModelSpec::linkages`"
    )]
    NoJoints {
        /// Its place among the objects.
        object: usize,
    },
    /// The hand holds nothing.
    #[error("part {part} holds nothing\n  help: grasp something first")]
    EmptyHand {
        /// Its place among the parts.
        part: usize,
    },
    /// The hand already holds this object.
    #[error("part {part} holds an object already\n  help: let that go first")]
    HandFull {
        /// Its place among the parts.
        part: usize,
    },
    /// The hand is not where the grasp of the object says.
    #[error(
        "the second hand, part {part}, is {position} m and {orientation} rad from its grasp\n  \
         help: bring it there first, or grasp as it is (`Grasp::here`)"
    )]
    LoopOpen {
        /// The second hand.
        part: usize,
        /// m.
        position: f64,
        /// rad.
        orientation: f64,
    },
    /// A call that knows nothing of a loop or a coupling of the mechanism, or of two hands on an object, and would open it.
    #[error(
        "{what} knows nothing of {closure}\n  help: `WholeBodyIk` keeps it closed; where it does not count, leave it out of the \
         model, or let one hand go"
    )]
    OpensClosure {
        /// The call.
        what: &'static str,
        /// What it would open.
        closure: Closure,
    },
    /// No configuration within limits closes a closure, whatever becomes of the goals.
    #[error(
        "{closure} does not close: {position:.3e} m and {orientation:.3e} rad are left\n  help: q is where it is least open; check \
         what it closes, let more of the robot move, or let go with one hand"
    )]
    DoesNotClose {
        /// Which.
        closure: Closure,
        /// m.
        position: f64,
        /// rad.
        orientation: f64,
    },
    /// Padding with which two colliders touch at every configuration.
    #[error(
        "colliders {a} and {b} are never more than {most} m apart, and would be padded by {padding} m: they would touch at every configuration\n  help: \
         less padding, or `look_at` to let them pass"
    )]
    NeverFree {
        /// One collider.
        a: usize,
        /// The other.
        b: usize,
        /// Padding of both, m.
        padding: f64,
        /// How far apart they are at the most, m.
        most: f64,
    },
    /// Points or cells that a collider cannot have.
    #[error(transparent)]
    Shape(#[from] ShapeFault),
    /// Equations without a solution.
    #[error("{what} has no solution here\n  help: {help}")]
    Singular {
        /// What.
        what: &'static str,
        /// What to do.
        help: &'static str,
    },
}

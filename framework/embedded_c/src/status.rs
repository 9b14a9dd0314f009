//! Status codes, and the faults that they represent.

use linkwork_embedded::{ModelError, RobotError, ShapeFault};
use std::ffi::{CStr, c_char};
use std::fmt;

/// Result of a call. After every code except `LW_STATUS_OK` nothing has been changed or written, unless a function's documentation says otherwise.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LwStatus {
    /// The call succeeded.
    Ok,
    /// A pointer is NULL.
    Null,
    /// A pointer is not aligned to its type.
    Misaligned,
    /// Memory to read and memory to write overlap.
    Overlap,
    /// A text is not UTF-8.
    Text,
    /// An array, or memory for a text, does not have the required length.
    Length,
    /// A number is NaN or infinite.
    NotFinite,
    /// A number is outside its range.
    OutOfRange,
    /// The name does not exist.
    Unknown,
    /// The part, object, body or collider does not belong to this model.
    Foreign,
    /// The part is not a chain.
    NotAChain,
    /// There is no search, path or motion to continue or to read.
    NoSearch,
    /// The inverse kinematics of the chain has no closed form.
    NoClosedForm,
    /// The start of inverse kinematics is outside the limits.
    OutsideLimits,
    /// More items than were reserved.
    NoRoom,
    /// A hand already holds the object, or it is attached to another one.
    Held,
    /// No hand holds the object, or it is not attached to another one.
    NotHeld,
    /// The hand does not hold this object.
    EmptyHand,
    /// The hand already holds an object.
    HandFull,
    /// The second hand is not at the pose that its grasp requires.
    LoopOpen,
    /// No configuration within limits closes the loop of two hands, a loop or a coupling of the mechanism; or a call would open one.
    DoesNotClose,
    /// Equations have no unique solution.
    Singular,
    /// Files, parts, objects or shapes do not form a valid model.
    Model,
    /// Another thread is in a call with this handle. The handle's message does not change.
    Busy,
    /// A bug in this library: a call with this handle panicked. All later calls with this robot or builder return this code.
    Panicked,
}

/// All codes with their texts.
const WORDS: [(LwStatus, &CStr); 25] = [
    (LwStatus::Ok, c"success"),
    (LwStatus::Null, c"a pointer is NULL"),
    (LwStatus::Misaligned, c"a pointer is not aligned to its type"),
    (LwStatus::Overlap, c"memory to read and memory to write overlap"),
    (LwStatus::Text, c"a text is not UTF-8"),
    (LwStatus::Length, c"an array or memory for a text has the wrong length"),
    (LwStatus::NotFinite, c"a number is NaN or infinite"),
    (LwStatus::OutOfRange, c"a number is outside its range"),
    (LwStatus::Unknown, c"nothing has this name"),
    (LwStatus::Foreign, c"the model has no such part, object, body or collider"),
    (LwStatus::NotAChain, c"the part is not a chain"),
    (LwStatus::NoSearch, c"no search, path or motion to continue or to read"),
    (LwStatus::NoClosedForm, c"the chain's inverse kinematics has no closed form"),
    (LwStatus::OutsideLimits, c"the start is outside the limits"),
    (LwStatus::NoRoom, c"more items than were reserved"),
    (LwStatus::Held, c"a hand already holds the object, or it is attached to another one"),
    (LwStatus::NotHeld, c"no hand holds the object, or it is not attached to another one"),
    (LwStatus::EmptyHand, c"the hand does not hold this object"),
    (LwStatus::HandFull, c"the hand already holds an object"),
    (LwStatus::LoopOpen, c"the second hand is not at the pose that its grasp requires"),
    (
        LwStatus::DoesNotClose,
        c"a loop of two hands, a loop or a coupling cannot be closed, or would be opened",
    ),
    (LwStatus::Singular, c"equations have no unique solution"),
    (LwStatus::Model, c"files, parts, objects or shapes do not form a valid model"),
    (LwStatus::Busy, c"another thread is in a call with this handle"),
    (LwStatus::Panicked, c"a bug in the library: make a new handle"),
];

/// Returns the text of a code; do not free it. Returns "unknown code" for a number that is not a code.
#[unsafe(no_mangle)]
pub extern "C" fn lw_status_text(code: i32) -> *const c_char {
    let found = WORDS.iter().find(|(status, _)| *status as i32 == code);
    found.map_or(c"unknown code", |(_, words)| words).as_ptr()
}

/// Returns the version of this library as `major.minor.patch`; do not free it.
#[unsafe(no_mangle)]
pub extern "C" fn lw_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Reason why a call failed.
#[derive(Debug)]
pub(crate) enum Fault {
    /// Fault of the robot model. Does not allocate.
    Robot(RobotError),
    /// Fault of a pointer, with its name.
    Null(&'static str),
    Misaligned(&'static str),
    Overlap(&'static str, &'static str),
    Text(&'static str),
    /// Name of the text, its size in bytes with the terminating zero, and the available size.
    TextLength {
        what: &'static str,
        wanted: usize,
        room: usize,
    },
    /// A number that is not one of the permitted values: argument, value, permitted values.
    Choice {
        what: &'static str,
        value: u32,
        help: &'static str,
    },
    /// The call that must come first.
    NotBegun(&'static str),
    /// Faults at set-up, as text.
    Unknown(String),
    Model(String),
    Busy,
    Panicked,
}

impl From<RobotError> for Fault {
    fn from(e: RobotError) -> Self {
        Self::Robot(e)
    }
}

impl From<ModelError> for Fault {
    fn from(e: ModelError) -> Self {
        Self::Model(e.to_string())
    }
}

impl Fault {
    pub fn status(&self) -> LwStatus {
        match self {
            Self::Robot(e) => match e {
                RobotError::ForeignHandle => LwStatus::Foreign,
                RobotError::NotAChain { .. } => LwStatus::NotAChain,
                RobotError::NoSearch { .. } => LwStatus::NoSearch,
                RobotError::NoClosedForm { .. } => LwStatus::NoClosedForm,
                RobotError::NotFinite { .. } => LwStatus::NotFinite,
                RobotError::OutOfRange { .. }
                | RobotError::ZeroQuaternion { .. }
                | RobotError::NeverFree { .. } => LwStatus::OutOfRange,
                RobotError::Length { .. } => LwStatus::Length,
                RobotError::OutsideLimits { .. } => LwStatus::OutsideLimits,
                RobotError::NoRoom { .. } => LwStatus::NoRoom,
                RobotError::Held { .. } | RobotError::Attached { .. } => LwStatus::Held,
                RobotError::NotHeld { .. } | RobotError::NotAttached { .. } => LwStatus::NotHeld,
                RobotError::NoJoints { .. } => LwStatus::Foreign,
                RobotError::EmptyHand { .. } => LwStatus::EmptyHand,
                RobotError::HandFull { .. } => LwStatus::HandFull,
                RobotError::LoopOpen { .. } => LwStatus::LoopOpen,
                RobotError::DoesNotClose { .. } | RobotError::OpensClosure { .. } => {
                    LwStatus::DoesNotClose
                }
                RobotError::Singular { .. } => LwStatus::Singular,
                RobotError::Shape(e) => match e {
                    ShapeFault::Kind { .. } => LwStatus::Foreign,
                    ShapeFault::NotFinite { .. } => LwStatus::NotFinite,
                    ShapeFault::Points { .. } => LwStatus::NoRoom,
                    _ => LwStatus::OutOfRange,
                },
            },
            Self::Null(_) => LwStatus::Null,
            Self::Misaligned(_) => LwStatus::Misaligned,
            Self::Overlap(..) => LwStatus::Overlap,
            Self::Text(_) => LwStatus::Text,
            Self::TextLength { .. } => LwStatus::Length,
            Self::Choice { .. } => LwStatus::OutOfRange,
            Self::NotBegun(_) => LwStatus::NoSearch,
            Self::Unknown(_) => LwStatus::Unknown,
            Self::Model(_) => LwStatus::Model,
            Self::Busy => LwStatus::Busy,
            Self::Panicked => LwStatus::Panicked,
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Robot(e) => e.fmt(f),
            Self::Null(what) => write!(f, "`{what}` is NULL\n  help: give an address"),
            Self::Misaligned(what) => {
                write!(f, "`{what}` is not aligned\n  help: give the address of a value of the right type")
            }
            Self::Overlap(a, b) => {
                write!(f, "`{a}` and `{b}` overlap\n  help: use separate memory")
            }
            Self::Text(what) => write!(f, "`{what}` is not UTF-8\n  help: encode it in UTF-8"),
            Self::TextLength { what, wanted, room } => {
                write!(f, "`{what}` needs {wanted} bytes, got {room}\n  help: provide {wanted} bytes")
            }
            Self::Choice { what, value, help } => {
                write!(f, "`{what}` is {value}\n  help: give {help}")
            }
            Self::NotBegun(call) => {
                write!(f, "there is nothing to continue or to read\n  help: call `{call}` first")
            }
            Self::Unknown(text) | Self::Model(text) => f.write_str(text),
            Self::Busy => f.write_str("another thread is in a call with this handle"),
            Self::Panicked => f.write_str(
                "a call with this handle panicked, which is a bug in the library\n  help: make a new handle, and \
                 report the line that was printed",
            ),
        }
    }
}

/// The message of a handle.
#[derive(Debug)]
pub(crate) struct Message(String);

impl Message {
    /// Capacity for any message of a call that does not allocate.
    const ROOM: usize = 2048;

    pub fn new() -> Self {
        Self(String::with_capacity(Self::ROOM))
    }

    pub fn text(&self) -> &str {
        &self.0
    }

    /// Messages of set-up may be long and allocate; all others fit into the capacity.
    pub fn say(&mut self, fault: &Fault) {
        use fmt::Write;
        self.0.clear();
        let done = write!(self.0, "{fault}");
        debug_assert!(done.is_ok());
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn every_code_has_its_words() {
        for (k, (status, words)) in WORDS.iter().enumerate() {
            assert_eq!(*status as usize, k);
            // SAFETY: texts of the table end with a zero.
            assert_eq!(unsafe { CStr::from_ptr(lw_status_text(k as i32)) }, *words);
        }
        for none in [-1, WORDS.len() as i32, i32::MIN, i32::MAX] {
            // SAFETY: as above.
            assert_eq!(unsafe { CStr::from_ptr(lw_status_text(none)) }, c"unknown code");
        }
        // The last code of the enumeration is in the table.
        assert_eq!(LwStatus::Panicked as usize, WORDS.len() - 1);
    }

    #[test]
    fn the_longest_message_of_a_robot_fits() {
        // Numbers are printed with all their digits.
        let (tiny, great) = (-f64::MIN_POSITIVE * (1.0 - f64::EPSILON), f64::MIN);
        let far = RobotError::OutsideLimits { dof: 1 << 60, value: tiny, lower: tiny, upper: tiny };
        let open = RobotError::LoopOpen { part: 1 << 60, position: great, orientation: tiny };
        for e in [far, open] {
            let text = Fault::Robot(e).to_string();
            assert!(text.len() > 512 && text.len() <= Message::ROOM, "{}", text.len());
        }
    }
}

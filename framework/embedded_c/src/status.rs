//! Codes, and the faults that they stand for.

use linkwork_embedded::{ModelError, RobotError, ShapeFault};
use std::ffi::{CStr, c_char};
use std::fmt;

/// What came of a call. Everything but `LW_STATUS_OK` means that nothing was changed or written, except where a
/// function says otherwise.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LwStatus {
    /// Done.
    Ok,
    /// A pointer is NULL.
    Null,
    /// A pointer is not aligned to its type.
    Misaligned,
    /// Memory to read and memory to write overlap.
    Overlap,
    /// A text is not UTF-8.
    Text,
    /// An array, or memory for a text, has another length than it must have.
    Length,
    /// A number is NaN or infinite.
    NotFinite,
    /// A number is outside its range.
    OutOfRange,
    /// Nothing has this name.
    Unknown,
    /// A part, object, body or collider that this model has not.
    Foreign,
    /// The part is no chain.
    NotAChain,
    /// A search, a path or a motion is asked for that was not begun.
    NoSearch,
    /// The inverse kinematics of the chain has no closed form.
    NoClosedForm,
    /// The start of inverse kinematics is outside the limits.
    OutsideLimits,
    /// More than room was reserved for.
    NoRoom,
    /// The object is held already, or attached to another one.
    Held,
    /// The object is not held, or attached to nothing.
    NotHeld,
    /// The hand holds nothing, or not this object.
    EmptyHand,
    /// The hand holds this object already.
    HandFull,
    /// The second hand is not where its grasp says.
    LoopOpen,
    /// No configuration within limits closes what two hands hold, a loop or a coupling; or a call would open one.
    DoesNotClose,
    /// Equations have no solution.
    Singular,
    /// Files, parts, objects or shapes make no model.
    Model,
    /// Another thread is in a call with this handle. The handle's message stays as it is.
    Busy,
    /// A mistake in this library: a call with this handle panicked. A robot or builder answers nothing else from then on.
    Panicked,
}

/// All codes with their words.
const WORDS: [(LwStatus, &CStr); 25] = [
    (LwStatus::Ok, c"done"),
    (LwStatus::Null, c"a pointer is NULL"),
    (LwStatus::Misaligned, c"a pointer is not aligned to its type"),
    (LwStatus::Overlap, c"memory to read and memory to write overlap"),
    (LwStatus::Text, c"a text is not UTF-8"),
    (LwStatus::Length, c"an array or memory for a text has the wrong length"),
    (LwStatus::NotFinite, c"a number is NaN or infinite"),
    (LwStatus::OutOfRange, c"a number is outside its range"),
    (LwStatus::Unknown, c"nothing has this name"),
    (LwStatus::Foreign, c"the model has no such part, object, body or collider"),
    (LwStatus::NotAChain, c"the part is no chain"),
    (LwStatus::NoSearch, c"no search, path or motion was begun"),
    (LwStatus::NoClosedForm, c"the chain's inverse kinematics has no closed form"),
    (LwStatus::OutsideLimits, c"the start is outside the limits"),
    (LwStatus::NoRoom, c"more than room was reserved for"),
    (LwStatus::Held, c"the object is held already, or attached to another one"),
    (LwStatus::NotHeld, c"the object is not held, or attached to nothing"),
    (LwStatus::EmptyHand, c"the hand does not hold this object"),
    (LwStatus::HandFull, c"the hand holds this object already"),
    (LwStatus::LoopOpen, c"the second hand is not where its grasp says"),
    (
        LwStatus::DoesNotClose,
        c"what two hands hold, a loop or a coupling does not close, or would be opened",
    ),
    (LwStatus::Singular, c"equations have no solution"),
    (LwStatus::Model, c"files, parts, objects or shapes make no model"),
    (LwStatus::Busy, c"another thread is in a call with this handle"),
    (LwStatus::Panicked, c"a mistake in the library: make a new handle"),
];

/// The words of a code, for ever: do not free them. Any number may be asked for; "unknown code" where it is none.
#[unsafe(no_mangle)]
pub extern "C" fn lw_status_text(code: i32) -> *const c_char {
    let found = WORDS.iter().find(|(status, _)| *status as i32 == code);
    found.map_or(c"unknown code", |(_, words)| words).as_ptr()
}

/// The version of this library, as `major.minor.patch`, for ever: do not free it.
#[unsafe(no_mangle)]
pub extern "C" fn lw_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Why a call did nothing.
#[derive(Debug)]
pub(crate) enum Fault {
    /// Of the robot. Without memory of its own.
    Robot(RobotError),
    /// Of a pointer: its name.
    Null(&'static str),
    Misaligned(&'static str),
    Overlap(&'static str, &'static str),
    Text(&'static str),
    /// Which text, its bytes with the zero at the end, and for how many there is room.
    TextLength {
        what: &'static str,
        wanted: usize,
        room: usize,
    },
    /// A number that stands for nothing: which argument, what it is, what it may be.
    Choice {
        what: &'static str,
        value: u32,
        help: &'static str,
    },
    /// The call that has to come before.
    NotBegun(&'static str),
    /// At set-up: in words.
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
                write!(f, "`{what}` is not aligned\n  help: give the address of a value of its type")
            }
            Self::Overlap(a, b) => {
                write!(f, "`{a}` and `{b}` overlap\n  help: give each memory of its own")
            }
            Self::Text(what) => write!(f, "`{what}` is not UTF-8\n  help: encode it in UTF-8"),
            Self::TextLength { what, wanted, room } => {
                write!(f, "`{what}` takes {wanted} bytes, not {room}\n  help: give room for {wanted}")
            }
            Self::Choice { what, value, help } => {
                write!(f, "`{what}` is {value}\n  help: give {help}")
            }
            Self::NotBegun(call) => {
                write!(f, "there is nothing to go on with\n  help: call `{call}` before")
            }
            Self::Unknown(text) | Self::Model(text) => f.write_str(text),
            Self::Busy => f.write_str("another thread is in a call with this handle"),
            Self::Panicked => f.write_str(
                "a call with this handle panicked, which is a mistake in the library\n  help: make a new handle, and \
                 report the line that was printed",
            ),
        }
    }
}

/// The message of a handle.
#[derive(Debug)]
pub(crate) struct Message(String);

impl Message {
    /// Room for any message of a call that does not allocate.
    const ROOM: usize = 2048;

    pub fn new() -> Self {
        Self(String::with_capacity(Self::ROOM))
    }

    pub fn text(&self) -> &str {
        &self.0
    }

    /// Words of set-up may be long, and allocate; others are shorter than the room.
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
        // The last of the enumeration is in the table.
        assert_eq!(LwStatus::Panicked as usize, WORDS.len() - 1);
    }

    #[test]
    fn the_longest_message_of_a_robot_fits() {
        // Numbers are written with all their zeros.
        let (tiny, great) = (-f64::MIN_POSITIVE * (1.0 - f64::EPSILON), f64::MIN);
        let far = RobotError::OutsideLimits { dof: 1 << 60, value: tiny, lower: tiny, upper: tiny };
        let open = RobotError::LoopOpen { part: 1 << 60, position: great, orientation: tiny };
        for e in [far, open] {
            let text = Fault::Robot(e).to_string();
            assert!(text.len() > 512 && text.len() <= Message::ROOM, "{}", text.len());
        }
    }
}

//! Messages, and frames of them: `framework/live/PROTOCOL.md` in types.
use linkwork_runtime::Value;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::io::{Read, Write};

/// Version of the protocol; another one is refused.
pub const VERSION: u32 = 2;
/// Bytes of a request at most.
pub const LONGEST_REQUEST: usize = 1 << 16;
/// Bytes of a reply at most.
pub const LONGEST_REPLY: usize = 1 << 24;

/// What a client sends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Comes back with every reply to it.
    pub id: u64,
    /// What is wanted.
    pub ask: Ask,
}

/// What is wanted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Ask {
    /// The first message of a connection.
    Hello {
        /// [`VERSION`].
        version: u32,
        /// The token of the run.
        token: String,
    },
    /// Names and units of the variables that match any of the patterns.
    List {
        /// `Rover.**.torque`.
        patterns: Vec<String>,
    },
    /// Values now.
    Get {
        /// Variables.
        paths: Vec<String>,
    },
    /// Sets states and inputs without a wire, from the present tick on.
    Set {
        /// The variable, or a pattern with a star.
        path: String,
        /// To what.
        value: Amount,
    },
    /// Pins variables: they keep a value until they are unpinned.
    Pin {
        /// The variable, or a pattern with a star.
        path: String,
        /// To what; the present value of each when there is none.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        value: Option<Amount>,
    },
    /// Lets pinned variables go.
    Unpin {
        /// The variable, or a pattern with a star.
        path: String,
    },
    /// What is pinned.
    Pins,
    /// Rows of values as the run goes on, in place of those asked for before; none for no paths.
    Watch {
        /// Variables.
        paths: Vec<String>,
        /// Rows in a second of the wall clock, at most.
        rate: f64,
    },
    /// The run stands still after the present tick.
    Pause,
    /// So many steps, and then it stands still. Answered when they are done.
    Step {
        /// How many.
        steps: u64,
    },
    /// The run goes on.
    Go,
    /// Writes a checkpoint into the folder of the run.
    Checkpoint,
    /// The run ends as by Ctrl-C.
    Quit,
}

/// A value with or without a unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Amount {
    /// In SI.
    Number(f64),
    /// `"12 deg"`.
    Text(String),
}

impl From<Value> for Amount {
    /// What is no number is written down: the run says what it makes of it.
    fn from(value: Value) -> Amount {
        match value {
            Value::Number(x) => Amount::Number(x),
            Value::Text(text) => Amount::Text(text),
            other => Amount::Text(other.to_string()),
        }
    }
}

impl From<Amount> for Value {
    fn from(amount: Amount) -> Value {
        match amount {
            Amount::Number(x) => Value::Number(x),
            Amount::Text(text) => Value::Text(text),
        }
    }
}

/// What the run sends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reply {
    /// Of the request.
    pub id: u64,
    /// The answer.
    pub said: Said,
}

/// An answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Said {
    /// To [`Ask::Hello`].
    Welcome {
        /// [`VERSION`].
        version: u32,
        /// Name of the simulation.
        simulation: String,
    },
    /// It is done.
    Done {
        /// Simulated time (s).
        time: f64,
    },
    /// To [`Ask::Set`], [`Ask::Pin`] and [`Ask::Unpin`]: what was changed.
    Changed {
        /// Simulated time (s).
        time: f64,
        /// Path and value (SI).
        values: Vec<(String, f64)>,
    },
    /// To [`Ask::Pins`].
    Pins {
        /// Simulated time (s).
        time: f64,
        /// Path and value (SI).
        values: Vec<(String, f64)>,
    },
    /// To [`Ask::Get`], and again and again to [`Ask::Watch`].
    Values {
        /// Simulated time (s).
        time: f64,
        /// In the order of the paths, SI; `null` in a phase that has no such variable.
        values: Vec<Option<f64>>,
        /// Rows of this watch so far that the client was too slow for.
        lost: u64,
    },
    /// To [`Ask::List`].
    Names {
        /// Path and unit.
        names: Vec<(String, String)>,
    },
    /// To [`Ask::Checkpoint`].
    Checkpoint {
        /// The file that was written.
        file: String,
    },
    /// It is not done.
    Refused {
        /// Why.
        message: String,
        /// What to do about it.
        help: String,
    },
}

/// A frame cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// The connection has ended, between two frames.
    #[error("the connection has ended")]
    Ended,
    /// The connection failed, or ended inside a frame.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The frame claims to be longer than any may be.
    #[error("a message of {length} bytes is longer than the {most} that are allowed")]
    Long {
        /// What it claims.
        length: usize,
        /// What is allowed.
        most: usize,
    },
    /// Its contents are no message.
    #[error("it is no message: {0}")]
    Message(#[from] serde_json::Error),
}

/// Reads a frame: its length in bytes as a little-endian u32, then JSON. Memory grows with what has
/// arrived, not with the length that is claimed.
///
/// # Errors
/// [`FrameError`].
pub fn read_frame<T: DeserializeOwned>(from: &mut impl Read, most: usize) -> Result<T, FrameError> {
    let mut head = [0; 4];
    let mut have = 0;
    while have < head.len() {
        match from.read(&mut head[have..]) {
            Ok(0) if have == 0 => return Err(FrameError::Ended),
            Ok(0) => return Err(std::io::Error::from(std::io::ErrorKind::UnexpectedEof).into()),
            Ok(n) => have += n,
            Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
            Err(e) => return Err(e.into()),
        }
    }
    let length = u32::from_le_bytes(head) as usize;
    if length > most {
        return Err(FrameError::Long { length, most });
    }
    let mut body = Vec::new();
    from.take(length as u64).read_to_end(&mut body)?;
    if body.len() < length {
        return Err(std::io::Error::from(std::io::ErrorKind::UnexpectedEof).into());
    }
    Ok(serde_json::from_slice(&body)?)
}

/// A message as a frame.
///
/// # Errors
/// [`FrameError::Long`]; [`FrameError::Message`] when it cannot be written down.
pub fn frame(message: &impl Serialize, most: usize) -> Result<Vec<u8>, FrameError> {
    let body = serde_json::to_vec(message)?;
    let length = body.len();
    let head = u32::try_from(length).ok().filter(|_| length <= most);
    let head = head.ok_or(FrameError::Long { length, most })?;
    Ok([&head.to_le_bytes()[..], &body].concat())
}

/// Writes a frame.
///
/// # Errors
/// [`FrameError`].
pub fn write_frame(
    to: &mut impl Write,
    message: &impl Serialize,
    most: usize,
) -> Result<(), FrameError> {
    to.write_all(&frame(message, most)?)?;
    Ok(to.flush()?)
}

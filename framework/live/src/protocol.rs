//! Messages and their frames: the types of `framework/live/PROTOCOL.md`.
use linkwork_runtime::Value;
use serde::{Deserialize, Serialize, de::DeserializeOwned};
use std::io::{Read, Write};

/// Version of the protocol; other versions are rejected.
pub const VERSION: u32 = 2;
/// Largest size of a request, bytes.
pub const LONGEST_REQUEST: usize = 1 << 16;
/// Largest size of a reply, bytes.
pub const LONGEST_REPLY: usize = 1 << 24;

/// A message of a client.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Number of the request, which every reply to it contains.
    pub id: u64,
    /// The request.
    pub ask: RequestKind,
}

/// A request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum RequestKind {
    /// The first message of a connection.
    Hello {
        /// [`VERSION`].
        version: u32,
        /// The token of the run.
        token: String,
    },
    /// Names and units of the variables that match any of the patterns.
    List {
        /// Patterns such as `Rover.**.torque`.
        patterns: Vec<String>,
    },
    /// Present values.
    Get {
        /// Variables.
        paths: Vec<String>,
    },
    /// Sets states and unconnected inputs from the present tick on.
    Set {
        /// The variable, or a pattern with a star.
        path: String,
        /// The value.
        value: Amount,
    },
    /// Pins variables: they keep a value until they are unpinned.
    Pin {
        /// The variable, or a pattern with a star.
        path: String,
        /// The value; by default the present value of each variable.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        value: Option<Amount>,
    },
    /// Releases pinned variables.
    Unpin {
        /// The variable, or a pattern with a star.
        path: String,
    },
    /// The pinned variables.
    Pins,
    /// Samples of values while the run continues. It replaces an earlier watch; an empty list ends it.
    Watch {
        /// Variables.
        paths: Vec<String>,
        /// Largest number of samples per second of wall time.
        rate: f64,
    },
    /// Pauses the run after the present tick.
    Pause,
    /// Makes a number of steps, then pauses the run. The answer is sent after the steps.
    Step {
        /// The number.
        steps: u64,
    },
    /// Continues the run.
    Go,
    /// Writes a checkpoint into the folder of the run.
    Checkpoint,
    /// Stops the run like Ctrl-C.
    Quit,
}

/// A value with or without a unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Amount {
    /// A number in SI.
    Number(f64),
    /// `"12 deg"`.
    Text(String),
}

impl From<Value> for Amount {
    /// Values that are not numbers are kept as text, so that the run can report the error.
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

/// A message of the run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reply {
    /// Number of the request.
    pub id: u64,
    /// The answer.
    pub said: ReplyKind,
}

/// An answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ReplyKind {
    /// Answer to [`RequestKind::Hello`].
    Welcome {
        /// [`VERSION`].
        version: u32,
        /// Name of the simulation.
        simulation: String,
    },
    /// The request is done.
    Done {
        /// Simulated time (s).
        time: f64,
    },
    /// Answer to [`RequestKind::Set`], [`RequestKind::Pin`] and [`RequestKind::Unpin`]: the changed variables.
    Changed {
        /// Simulated time (s).
        time: f64,
        /// Path and value (SI).
        values: Vec<(String, f64)>,
    },
    /// Answer to [`RequestKind::Pins`].
    Pins {
        /// Simulated time (s).
        time: f64,
        /// Path and value (SI).
        values: Vec<(String, f64)>,
    },
    /// Answer to [`RequestKind::Get`], and each sample of [`RequestKind::Watch`].
    Values {
        /// Simulated time (s).
        time: f64,
        /// In the order of the paths, SI; `null` in a phase that does not have the variable.
        values: Vec<Option<f64>>,
        /// Number of samples of this watch that were lost because the client was too slow.
        lost: u64,
    },
    /// Answer to [`RequestKind::List`].
    Names {
        /// Path and unit.
        names: Vec<(String, String)>,
    },
    /// Answer to [`RequestKind::Checkpoint`].
    Checkpoint {
        /// The file that was written.
        file: String,
    },
    /// The request is rejected.
    Refused {
        /// The reason.
        message: String,
        /// The remedy.
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
    /// The length of the frame exceeds the largest length.
    #[error("a message of {length} bytes is longer than the {most} that are allowed")]
    Long {
        /// Its length.
        length: usize,
        /// The largest length.
        most: usize,
    },
    /// Its content is not a message.
    #[error("it is not a valid message: {0}")]
    Message(#[from] serde_json::Error),
}

/// Reads a frame: its length in bytes as a little-endian u32, then JSON. Memory is allocated for received bytes, not for the declared length.
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

/// Converts a message to a frame.
///
/// # Errors
/// [`FrameError::Long`]; [`FrameError::Message`] if it cannot be serialized.
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

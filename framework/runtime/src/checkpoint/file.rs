//! The file of a checkpoint: lanes are raw little-endian doubles (NaN, ±∞ and −0 survive); stores are MessagePack with names.
use crate::author::noise;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

const MAGIC: &[u8; 8] = b"LWCKPT03";
/// The earlier format without pins; otherwise it is the same.
const MAGIC_02: &[u8; 8] = b"LWCKPT02";

/// A state in a file, with all data that a new process needs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Checkpoint {
    /// Version of the program that wrote it.
    pub version: String,
    /// Hash of the plan.
    pub plan: u64,
    /// Tick of the common base.
    pub tick: u64,
    /// Row of the table.
    pub row: u32,
    /// Time after the tick (s), events at this instant, phase, memory of the integrator.
    pub instant: Instant,
    /// Guards: value, change, slack, side, due.
    pub guards: Vec<(f64, f64, f64, i8, i8)>,
    /// Simulated time (s), for readers.
    pub time: f64,
    /// Seed of all noise.
    pub seed: u64,
    /// Names of the lanes, for the message that lists the differences to a plan.
    pub layout: Vec<String>,
    /// Continuous, discrete, signal lanes: raw little-endian doubles.
    #[serde(with = "serde_bytes_vec")]
    pub lanes: Vec<u8>,
    /// Stores by path of the part.
    pub stores: BTreeMap<String, Vec<u8>>,
    /// Pinned variables and their values (SI), by path.
    #[serde(default)]
    pub pins: BTreeMap<String, f64>,
    /// The full resolved configuration, so that the run can be rebuilt.
    pub configuration: String,
    /// Further data of the program that runs the simulation, by name.
    pub extra: BTreeMap<String, Vec<u8>>,
}

/// Instant of a state between two rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instant {
    /// Time after the tick (s).
    pub since: f64,
    /// Events that have fired at this instant.
    pub micro: u32,
    /// Place of the phase in the program.
    pub phase: u32,
    /// Lists when each phase began last (s); infinite before it has begun.
    pub entered: Vec<f64>,
    /// The step that the integrator proposes (s), and the error of its last step.
    pub memory: (f64, f64),
}

pub(crate) mod serde_bytes_vec {
    use serde::{Deserializer, Serializer, de::Visitor};
    pub fn serialize<S: Serializer>(v: &[u8], s: S) -> Result<S::Ok, S::Error> {
        s.serialize_bytes(v)
    }
    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<u8>, D::Error> {
        struct Bytes;
        impl Visitor<'_> for Bytes {
            type Value = Vec<u8>;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("bytes")
            }
            fn visit_bytes<E>(self, v: &[u8]) -> Result<Vec<u8>, E> {
                Ok(v.to_vec())
            }
            fn visit_byte_buf<E>(self, v: Vec<u8>) -> Result<Vec<u8>, E> {
                Ok(v)
            }
        }
        d.deserialize_byte_buf(Bytes)
    }
}

/// Reason for which a checkpoint cannot be written, read or restored.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    /// The file cannot be written or read.
    #[error("checkpoint `{path}`: {source}")]
    Io {
        /// The file.
        path: String,
        /// The reason.
        source: std::io::Error,
    },
    /// The file is not a checkpoint, or is incomplete.
    #[error("`{path}` is not a readable checkpoint: {why}")]
    Format {
        /// The file.
        path: String,
        /// The reason.
        why: String,
    },
    /// The checkpoint belongs to another simulation.
    #[error(
        "the checkpoint does not fit this simulation: {why}\n  help: resume it with the configuration inside it"
    )]
    Mismatch {
        /// The difference.
        why: String,
    },
    /// It contains values that no run can have written.
    #[error(
        "the checkpoint contains values that no run writes: {why}\n  help: it was changed or damaged; use an intact \
        copy, or an earlier checkpoint"
    )]
    Impossible {
        /// The impossible value.
        why: String,
    },
    /// A model's store cannot be saved or restored.
    #[error("the store of `{part}`: {why}")]
    Store {
        /// The part.
        part: String,
        /// The reason.
        why: String,
    },
}

/// Resolves the file of a path: a checkpoint replaces only a regular file, never a link, folder, device or pipe.
fn target(path: &Path) -> Result<PathBuf, &'static str> {
    match std::fs::canonicalize(path) {
        Ok(there) if there.is_file() => Ok(there),
        Ok(_) => Err("it is not a regular file"),
        Err(_) if path.is_symlink() => Err("it is a link to a file that does not exist"),
        // The file or its folder does not exist; writing reports an error if necessary.
        Err(_) => Ok(path.to_owned()),
    }
}

impl Checkpoint {
    /// Writes a temporary file next to the target and renames it, so that a full disk does not destroy the old checkpoint. For a symbolic link the
    /// target is the file to which the link points; the link itself is kept.
    ///
    /// # Errors
    /// [`CheckpointError::Io`], also if the target exists and is not a regular file (a folder, a device, a pipe) or is a dangling link.
    pub fn write(&self, path: &Path) -> Result<(), CheckpointError> {
        let io = |source| CheckpointError::Io { path: path.display().to_string(), source };
        let own = target(path).map_err(|why| io(std::io::Error::other(why)))?;
        let path = own.as_path();
        let bytes = self.to_bytes().map_err(|why| {
            let path = path.display().to_string();
            CheckpointError::Format { path, why }
        })?;
        let temporary = path.with_extension("part");
        let write = || -> std::io::Result<()> {
            let mut file = std::fs::File::create(&temporary)?;
            file.write_all(&bytes)?;
            file.sync_all()?;
            std::fs::rename(&temporary, path)?;
            // The new name survives a power failure only if its folder is synchronized, too.
            let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
            std::fs::File::open(folder.unwrap_or(Path::new(".")))?.sync_all()
        };
        write().map_err(|e| {
            let _ = std::fs::remove_file(&temporary);
            io(e)
        })
    }

    /// Returns the contents of a checkpoint file: a magic number, a checksum, the data.
    ///
    /// # Errors
    /// The reason for which the checkpoint cannot be encoded.
    pub fn to_bytes(&self) -> Result<Vec<u8>, String> {
        let body = rmp_serde::to_vec_named(self).map_err(|e| e.to_string())?;
        let sum = noise::hash(body.iter().copied()).to_le_bytes();
        Ok([&MAGIC[..], &sum, &body].concat())
    }

    /// Reads one from [`Checkpoint::to_bytes`].
    ///
    /// # Errors
    /// The reason for which the bytes are not a checkpoint.
    pub fn from_bytes(bytes: &[u8]) -> Result<Checkpoint, String> {
        if bytes.len() < 16 || (&bytes[..8] != MAGIC && &bytes[..8] != MAGIC_02) {
            return Err("it does not begin with the signature of a checkpoint".into());
        }
        if noise::hash(bytes[16..].iter().copied()).to_le_bytes() != bytes[8..16] {
            return Err("its contents are damaged or cut short".into());
        }
        rmp_serde::from_slice(&bytes[16..]).map_err(|e| e.to_string())
    }

    /// Reads one.
    ///
    /// # Errors
    /// [`CheckpointError::Io`]; [`CheckpointError::Format`] if the file is not a checkpoint or is damaged.
    pub fn read(path: &Path) -> Result<Checkpoint, CheckpointError> {
        let name = path.display().to_string();
        let io = |source| CheckpointError::Io { path: name.clone(), source };
        // Reading a device or a pipe may never end.
        if !path.metadata().map_err(io)?.is_file() {
            return Err(io(std::io::Error::other("it is not a regular file")));
        }
        let bytes = std::fs::read(path).map_err(io)?;
        let format = |why| CheckpointError::Format { path: name.clone(), why };
        Checkpoint::from_bytes(&bytes).map_err(format)
    }
}

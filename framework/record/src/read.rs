//! Reading of logs: every number as a series, and comparison of two logs with tolerances.
//!
//! A log is read from its beginning to its end with all its checksums, one record at a time. A flipped bit anywhere is therefore an error with its
//! position, and a wrong length in a damaged file cannot cause a large allocation. A log without its end (of a killed run) is read as far as it is
//! complete.
use crate::log::{CONFIGURATION, LogError, PATH, SETS, START, SetMessage, TRANSFORMS, UNIT, why};
use crate::overlays::{self, PART, TILES, WAYS};
use crate::pictures::{PICTURES, picture};
use crate::schema::decode;
use foxglove::messages::FrameTransforms;
use linkwork_runtime::{OverlayTile, SetRow};
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Pose, Quat, Vec3};
use mcap::McapError;
use mcap::read::parse_record;
use mcap::records::{ChunkHeader, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use prost_types::FileDescriptorSet;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The numbers of one field of one channel over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Times (s).
    pub t: Vec<f64>,
    /// Values.
    pub y: Vec<f64>,
    /// Unit, if the log contains it.
    pub unit: String,
}

/// Kinds of ends of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Complete.
    Whole,
    /// Truncated after this number of bytes: the run was killed, or the copy is incomplete.
    Cut {
        /// Number of bytes that were read.
        at: u64,
    },
}

/// Content of a log.
#[derive(Clone, Debug)]
pub struct LogContents {
    /// All series, by `part.field`.
    pub series: BTreeMap<String, Series>,
    /// The configuration of the run; empty if the log does not contain one.
    pub configuration: String,
    /// Seed, hash of the plan, versions, by name.
    pub about: BTreeMap<String, String>,
    /// The checkpoint from which the run began; `None` if it began at the start of its configuration.
    pub start: Option<Vec<u8>>,
    /// Variables that were set, pinned or unpinned from outside, in order.
    pub sets: Vec<SetRow>,
    /// End of the log.
    pub end: End,
}

/// Reads all series of a log, by `part.field`. A log without its end (a killed run) is read as far as it is complete; [`read_log_contents`] returns
/// whether it has one.
///
/// # Errors
/// [`LogError::Read`] if it cannot be opened or is not MCAP, [`LogError::Damaged`].
pub fn read_log(path: &Path) -> Result<BTreeMap<String, Series>, LogError> {
    Ok(read_log_contents(path)?.series)
}

/// Number of bytes read at once, and largest accepted size of a record.
const READ: usize = 1 << 20;
const RECORD: usize = 1 << 30;

/// Maximum number of bytes that a byte of a compressed chunk may expand to, and maximum size of a chunk. Logs have chunks of a few
/// hundred kilobytes, or of one larger message.
const EXPANSION: u64 = 256;
const CHUNK: u64 = 256 << 20;

/// Reads all series of a log, and how it ends.
///
/// # Errors
/// [`LogError::Read`] if it cannot be opened or is not MCAP, [`LogError::Damaged`].
pub fn read_log_contents(path: &Path) -> Result<LogContents, LogError> {
    contents(path, Poses::Left)
}

/// Reads a log like [`read_log_contents`], with the poses of all bodies among the series: `pose of NAME.position.x` (m, W) to `.rotation.w`.
///
/// # Errors
/// Like [`read_log_contents`].
pub fn read_log_with_poses(path: &Path) -> Result<LogContents, LogError> {
    contents(path, Poses::Taken)
}

/// The components of a pose and their units.
const POSE: [(&str, &str); 7] = [
    ("position.x", "m"),
    ("position.y", "m"),
    ("position.z", "m"),
    ("rotation.x", ""),
    ("rotation.y", ""),
    ("rotation.z", ""),
    ("rotation.w", ""),
];

/// Whether the poses of bodies become series.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Poses {
    Left,
    Taken,
}

fn contents(path: &Path, with: Poses) -> Result<LogContents, LogError> {
    let mut contents = LogContents {
        series: BTreeMap::new(),
        configuration: String::new(),
        about: BTreeMap::new(),
        start: None,
        sets: Vec::new(),
        end: End::Whole,
    };
    contents.end = walk_log::<LogError>(path, |entry| {
        match entry {
            Entry::Configuration(text) => contents.configuration = text,
            Entry::Start(checkpoint) => contents.start = Some(checkpoint),
            Entry::About(about) => contents.about = about,
            Entry::Numbers { ns, values } => {
                for (variable, value) in values {
                    let series = match contents.series.get_mut(&variable.path) {
                        Some(series) => series,
                        None => contents.series.entry(variable.path.clone()).or_insert_with(|| {
                            Series { unit: variable.unit.clone(), ..Series::default() }
                        }),
                    };
                    series.t.push(seconds(ns));
                    series.y.push(value);
                }
            }
            Entry::Set(set) => contents.sets.push(set),
            Entry::Poses { ns, bodies } if with == Poses::Taken => {
                for (name, pose) in bodies {
                    let (p, q) = (pose.position, pose.rotation);
                    let numbers = [p.x, p.y, p.z, q.i, q.j, q.k, q.w];
                    for (y, (lane, unit)) in numbers.into_iter().zip(POSE) {
                        let series = contents.series.entry(format!("pose of {name}.{lane}"));
                        let series = series
                            .or_insert_with(|| Series { unit: unit.into(), ..Series::default() });
                        series.t.push(seconds(ns));
                        series.y.push(y);
                    }
                }
            }
            Entry::Poses { .. }
            | Entry::Picture { .. }
            | Entry::Tile { .. }
            | Entry::Way { .. } => {}
        }
        Ok(())
    })?;
    contents.series.values_mut().for_each(Series::in_order);
    Ok(contents)
}

impl Series {
    /// Sorts samples by time and removes duplicates: samples around an event are written after the event, and several rules can select the same
    /// instant. Samples of one instant with different values are all kept.
    fn in_order(&mut self) {
        if self.t.is_sorted_by(|a, b| a < b) {
            return;
        }
        let mut rows: Vec<(f64, f64)> =
            self.t.iter().copied().zip(self.y.iter().copied()).collect();
        rows.sort_by(|a, b| a.0.total_cmp(&b.0));
        rows.dedup_by(|b, a| {
            a.0 == b.0 && (a.1.to_bits() == b.1.to_bits() || (a.1.is_nan() && b.1.is_nan()))
        });
        (self.t, self.y) = rows.into_iter().unzip();
    }
}

/// A variable as a log names it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Logged {
    /// Path in the simulation; `part.field` for logs without paths.
    pub path: String,
    /// Unit; empty without one.
    pub unit: String,
}

/// Converts nanoseconds to seconds: the nearest double, so that 290 000 000 ns are 0.29 s.
pub fn seconds(ns: u64) -> f64 {
    ns as f64 / 1e9
}

/// Returns the simulated time (s) of the first row of a log; `None` without rows.
///
/// # Errors
/// [`LogError::Read`] when the log cannot be opened or is not MCAP, [`LogError::Damaged`] when it is damaged before its first row.
pub fn log_begin(path: &Path) -> Result<Option<f64>, LogError> {
    /// Ends the traversal.
    enum Found {
        At(u64),
        Not(LogError),
    }
    impl From<LogError> for Found {
        fn from(e: LogError) -> Found {
            Found::Not(e)
        }
    }
    let first = walk_log::<Found>(path, |entry| match entry {
        Entry::Numbers { ns, .. } | Entry::Poses { ns, .. } => Err(Found::At(ns)),
        _ => Ok(()),
    });
    match first {
        Ok(_) => Ok(None),
        Err(Found::At(ns)) => Ok(Some(seconds(ns))),
        Err(Found::Not(e)) => Err(e),
    }
}

/// An entry of a log.
#[derive(Clone, Debug)]
pub enum Entry<'a> {
    /// The configuration of the run.
    Configuration(String),
    /// The checkpoint from which the run began, if it did not begin at the start of its configuration.
    Start(Vec<u8>),
    /// Seed, hash of the plan, versions, by name.
    About(BTreeMap<String, String>),
    /// The values of a part at an instant.
    Numbers {
        /// Simulated time (ns).
        ns: u64,
        /// Variables and values (SI).
        values: Vec<(&'a Logged, f64)>,
    },
    /// A variable that was set, pinned or unpinned from outside, before the samples of its tick.
    Set(SetRow),
    /// Poses of the bodies of the present phase at an instant.
    Poses {
        /// Simulated time (ns).
        ns: u64,
        /// Name of each body, and X_WB (m).
        bodies: Vec<(String, Pose)>,
    },
    /// Image of a camera.
    Picture {
        /// Simulated time (ns).
        ns: u64,
        /// Path of the camera.
        camera: String,
        /// The image, a PNG file.
        png: Vec<u8>,
    },
    /// Overlay of a part on the ground from now on, where it changed.
    Tile {
        /// Simulated time (ns).
        ns: u64,
        /// Path of the part.
        part: &'a str,
        /// The squares.
        tile: OverlayTile,
    },
    /// Path that a part plans from now on; empty: none.
    Way {
        /// Simulated time (ns).
        ns: u64,
        /// Path of the part.
        part: &'a str,
        /// x and y of its corners (m, W).
        corners: Vec<[f64; 2]>,
    },
}

/// Reason for an early end of the traversal: an error in the file, or an error of the callback.
enum Halt<E> {
    Damaged(String),
    Told(E),
}

impl<E> From<String> for Halt<E> {
    fn from(why: String) -> Halt<E> {
        Halt::Damaged(why)
    }
}

/// Reads a log in the order in which it was written and calls `each` for each entry. This is the order of time, except for samples around an event,
/// which are written after the event. The configuration comes before the samples. At most one chunk is in memory.
///
/// # Errors
/// The first error of `each`; [`LogError::Read`] if the log cannot be opened or is not MCAP, [`LogError::Damaged`].
pub fn walk_log<E: From<LogError>>(
    path: &Path,
    each: impl FnMut(Entry<'_>) -> Result<(), E>,
) -> Result<End, E> {
    let name = path.display().to_string();
    let fail = |why: String| LogError::Read { path: name.clone(), why };
    // Check before opening, because opening a pipe blocks.
    if !path.metadata().map_err(|e| fail(e.to_string()))?.is_file() {
        return Err(fail("it is not a regular file".into()).into());
    }
    let mut file = File::open(path).map_err(|e| fail(e.to_string()))?;
    let options = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true)
        .with_record_length_limit(RECORD);
    let mut reader = LinearReader::new_with_options(options);
    let mut walk = Walk { schemas: BTreeMap::new(), channels: BTreeMap::new(), each };
    let mut at = mcap::MAGIC.len() as u64;
    let damaged = |at: u64, why: String| LogError::Damaged { path: name.clone(), at, why };
    while let Some(event) = reader.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(need)) => {
                let n = file
                    .read(reader.insert(need.clamp(1, READ)))
                    .map_err(|e| fail(e.to_string()))?;
                reader.notify_read(n);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => {
                walk.record(opcode, data).map_err(|halt| match halt {
                    Halt::Damaged(why) => damaged(at, why).into(),
                    Halt::Told(e) => e,
                })?;
                at += 9 + data.len() as u64;
            }
            Err(McapError::UnexpectedEof) => {
                let size = file.metadata().map_or(at, |m| m.len());
                if size < mcap::MAGIC.len() as u64 {
                    return Err(
                        fail(format!("its size of {size} bytes is too small for a log")).into()
                    );
                }
                return Ok(End::Cut { at });
            }
            Err(McapError::BadMagic) if at == mcap::MAGIC.len() as u64 => {
                return Err(fail("it does not begin with the MCAP magic bytes".into()).into());
            }
            Err(e) => return Err(damaged(at, why(&e)).into()),
        }
    }
    Ok(End::Whole)
}

/// Schemas and channels that were read so far.
struct Walk<F> {
    schemas: BTreeMap<u16, (String, FileDescriptorSet)>,
    channels: BTreeMap<u16, Channel>,
    each: F,
}

/// The content of a channel.
struct Channel {
    part: String,
    schema: u16,
    metadata: BTreeMap<String, String>,
    /// The variables of the fields that have occurred in messages so far.
    variables: BTreeMap<String, Logged>,
}

impl Channel {
    /// Resolves the name of a field.
    fn learn(&mut self, field: &str) {
        if !self.variables.contains_key(field) {
            let of = |kind: &str| self.metadata.get(&format!("{kind}{field}")).cloned();
            let path = of(PATH).unwrap_or_else(|| format!("{}.{field}", self.part));
            let unit = of(UNIT).unwrap_or_default();
            self.variables.insert(field.to_string(), Logged { path, unit });
        }
    }
}

impl<E, F: FnMut(Entry<'_>) -> Result<(), E>> Walk<F> {
    fn tell(&mut self, entry: Entry<'_>) -> Result<(), Halt<E>> {
        (self.each)(entry).map_err(Halt::Told)
    }

    fn record(&mut self, opcode: u8, data: &[u8]) -> Result<(), Halt<E>> {
        match parse_record(opcode, data).map_err(|e| why(&e))? {
            Record::Chunk { header, data: records } => {
                if header.compression.is_empty() {
                    tiled(&records)?;
                }
                self.chunk(&header, data)
            }
            // These records repeat data of earlier records.
            _ if opcode >= op::MESSAGE_INDEX
                && opcode != op::ATTACHMENT
                && opcode != op::METADATA =>
            {
                Ok(())
            }
            Record::Attachment { header, data, .. } => match header.name.as_str() {
                CONFIGURATION => {
                    let text = String::from_utf8_lossy(&data).into_owned();
                    self.tell(Entry::Configuration(text))
                }
                START => self.tell(Entry::Start(data.into_owned())),
                _ => Ok(()),
            },
            Record::Metadata(metadata) if metadata.name == "linkwork" => {
                self.tell(Entry::About(metadata.metadata))
            }
            record => self.take(record),
        }
    }

    /// Reads a chunk. `record` is its complete record; its checksum is verified first.
    fn chunk(&mut self, header: &ChunkHeader, record: &[u8]) -> Result<(), Halt<E>> {
        let size = record.len() as u64;
        let most = CHUNK.min(EXPANSION * (size + 1024));
        if header.uncompressed_size > most || header.compressed_size > size {
            let claim = header.uncompressed_size;
            return Err(format!("a chunk of {size} bytes cannot contain {claim}").into());
        }
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_prevalidate_chunk_crcs(true)
            .with_record_length_limit(header.uncompressed_size.max(size) as usize);
        let mut reader = LinearReader::new_with_options(options);
        let head = [&[op::CHUNK][..], &size.to_le_bytes()].concat();
        let mut rest = head.chain(record);
        while let Some(event) = reader.next_event() {
            match event.map_err(|e| why(&e))? {
                LinearReadEvent::ReadRequest(need) => {
                    let into = reader.insert(need.clamp(1, READ));
                    let n = rest.read(into).map_err(|e| e.to_string())?;
                    reader.notify_read(n);
                }
                LinearReadEvent::Record { data, opcode } => {
                    self.take(parse_record(opcode, data).map_err(|e| why(&e))?)?;
                }
            }
        }
        Ok(())
    }

    fn take(&mut self, record: Record<'_>) -> Result<(), Halt<E>> {
        match record {
            Record::Schema { header, .. } if header.name == SETS => {
                self.schemas.insert(header.id, (header.name, FileDescriptorSet::default()));
            }
            Record::Schema { header, data } if header.encoding == "protobuf" => {
                let set = prost::Message::decode(data.as_ref())
                    .map_err(|e| format!("schema `{}`: {e}", header.name))?;
                self.schemas.insert(header.id, (header.name, set));
            }
            Record::Channel(c) => {
                let part = c.topic.trim_start_matches('/').replace('/', ".");
                let (schema, metadata, variables) = (c.schema_id, c.metadata, BTreeMap::new());
                self.channels.insert(c.id, Channel { part, schema, metadata, variables });
            }
            Record::Message { header, data } => {
                self.message(header.channel_id, header.log_time, &data)?;
            }
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, channel: u16, ns: u64, data: &[u8]) -> Result<(), Halt<E>> {
        let Some(channel) = self.channels.get_mut(&channel) else { return Ok(()) };
        let Some((name, set)) = self.schemas.get(&channel.schema) else { return Ok(()) };
        let entry = if name == SETS {
            let bad = |e: String| format!("a set variable at {} s: {e}", seconds(ns));
            let set: SetMessage = serde_json::from_slice(data).map_err(|e| bad(e.to_string()))?;
            let bits = u64::from_str_radix(&set.bits, 16).map_err(|e| bad(e.to_string()))?;
            let (tick, path, value) = (set.tick, set.path, f64::from_bits(bits));
            let change = set.change.into();
            Entry::Set(SetRow { tick, ns, path, change, value })
        } else if name.starts_with("linkwork.") {
            let fields = decode(set, name, data);
            fields.iter().for_each(|(field, _)| channel.learn(field));
            let variables = &channel.variables;
            let values = fields.iter().filter_map(|(field, y)| Some((variables.get(field)?, *y)));
            Entry::Numbers { ns, values: values.collect() }
        } else if name == TRANSFORMS {
            let message: FrameTransforms = prost::Message::decode(data)
                .map_err(|e| format!("transforms at {} s: {e}", seconds(ns)))?;
            Entry::Poses { ns, bodies: message.transforms.into_iter().filter_map(pose).collect() }
        } else if name == PICTURES {
            let (camera, png) =
                picture(data).map_err(|e| format!("a picture at {} s: {e}", seconds(ns)))?;
            Entry::Picture { ns, camera, png }
        } else if let Some(part) =
            channel.metadata.get(PART).filter(|_| name == TILES || name == WAYS)
        {
            let bad = |e: String| format!("the ground of `{part}` at {} s: {e}", seconds(ns));
            if name == TILES {
                Entry::Tile { ns, part, tile: overlays::tile(data).map_err(bad)? }
            } else {
                Entry::Way { ns, part, corners: overlays::way(data).map_err(bad)? }
            }
        } else {
            return Ok(());
        };
        (self.each)(entry).map_err(Halt::Told)
    }
}

/// Returns an error if the records of a chunk do not end at its end; the library assumes this for uncompressed chunks.
fn tiled(mut records: &[u8]) -> Result<(), String> {
    while let Some((head, rest)) = records.split_first_chunk::<9>() {
        let [_, length @ ..] = *head;
        let length = u64::from_le_bytes(length);
        let end = usize::try_from(length).ok().filter(|n| *n <= rest.len());
        let end = end.ok_or_else(|| format!("a record of {length} bytes exceeds its chunk"))?;
        records = &rest[end..];
    }
    if records.is_empty() { Ok(()) } else { Err("a chunk ends inside a record".into()) }
}

/// Returns a body's name and X_WB, bit-identical to the written pose.
fn pose(of: foxglove::messages::FrameTransform) -> Option<(String, Pose)> {
    let (p, q) = (of.translation?, of.rotation?);
    let rotation = Quat::new_unchecked(Quaternion::new(q.w, q.x, q.y, q.z));
    Some((of.child_frame_id, Pose { rotation, position: Vec3::new(p.x, p.y, p.z) }))
}

/// A difference between two logs in one series.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// `part.field`.
    pub name: String,
    /// Description of the difference.
    pub what: String,
    /// Largest difference; ∞ if the series cannot be compared.
    pub largest: f64,
}

/// Tolerances of a comparison: those of the last pattern that matches a name, or the general ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tolerances {
    /// General absolute tolerance.
    pub absolute: f64,
    /// General relative tolerance.
    pub relative: f64,
    /// Pattern of names, absolute tolerance, relative tolerance.
    pub of: Vec<(String, f64, f64)>,
}

impl Tolerances {
    /// Returns the absolute and relative tolerance of a name; `matches` returns whether a pattern matches a name.
    pub fn at(&self, name: &str, matches: impl Fn(&str, &str) -> bool) -> (f64, f64) {
        let own = self.of.iter().rev().find(|(pattern, ..)| matches(pattern, name));
        own.map_or((self.absolute, self.relative), |(_, a, r)| (*a, *r))
    }
}

/// The samples of two series that are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rows {
    /// All samples: samples at different times are a difference.
    All,
    /// Samples whose times are equal to within a nanosecond; a series without any is a difference.
    Common,
}

/// Times of samples are integer nanoseconds, so half a nanosecond distinguishes two.
const SAME_TIME: f64 = 0.5e-9;

/// Returns the indices of samples that both series have, in order of time.
fn common(x: &Series, y: &Series) -> Vec<(usize, usize)> {
    let (mut i, mut j) = (0, 0);
    let mut out = Vec::new();
    while let (Some(s), Some(t)) = (x.t.get(i), y.t.get(j)) {
        // Beyond 2⁵³ ns, doubles do not resolve nanoseconds; times must then be equal to round-off.
        let near = SAME_TIME.max(2.0 * f64::EPSILON * s.abs());
        if (s - t).abs() <= near {
            out.push((i, j));
            (i, j) = (i + 1, j + 1);
        } else if s < t {
            i += 1;
        } else {
            j += 1;
        }
    }
    out
}

/// Returns the series that differ by more than `absolute + relative · max(|a|, |b|)`.
pub fn compare(
    a: &BTreeMap<String, Series>,
    b: &BTreeMap<String, Series>,
    rows: Rows,
    tolerance: impl Fn(&str) -> (f64, f64),
) -> Vec<Difference> {
    let mut out = Vec::new();
    let lone = |name: &str, which: &str| Difference {
        name: name.to_string(),
        what: format!("only in the {which}"),
        largest: f64::INFINITY,
    };
    for (name, x) in a {
        let Some(y) = b.get(name) else {
            out.push(lone(name, "first"));
            continue;
        };
        let apart = |what: String| Difference { name: name.clone(), what, largest: f64::INFINITY };
        let pairs: Vec<(usize, usize)> = match rows {
            Rows::All if x.t != y.t => {
                let what =
                    format!("{} samples against {}, or different times", x.t.len(), y.t.len());
                out.push(apart(what));
                continue;
            }
            Rows::All => (0..x.t.len()).map(|k| (k, k)).collect(),
            Rows::Common => common(x, y),
        };
        if pairs.is_empty() && !(x.t.is_empty() && y.t.is_empty()) {
            let what =
                format!("{} samples against {}, without a common time", x.t.len(), y.t.len());
            out.push(apart(what));
            continue;
        }
        let (absolute, relative) = tolerance(name);
        let mut worst: Option<(f64, (usize, usize))> = None;
        for (i, j) in pairs {
            let (p, q) = (x.y[i], y.y[j]);
            let limit = absolute + relative * p.abs().max(q.abs());
            let d = (p - q).abs();
            let same = p.to_bits() == q.to_bits() || (p.is_nan() && q.is_nan());
            if !same && !(d <= limit) && worst.is_none_or(|w| !(d <= w.0)) {
                worst = Some((d, (i, j)));
            }
        }
        if let Some((d, (i, j))) = worst {
            let what = format!("{:?} against {:?} at t = {} s", x.y[i], y.y[j], x.t[i]);
            out.push(Difference { name: name.clone(), what, largest: d });
        }
    }
    out.extend(b.keys().filter(|n| !a.contains_key(*n)).map(|n| lone(n, "second")));
    out.sort_by(|p, q| q.largest.total_cmp(&p.largest).then(p.name.cmp(&q.name)));
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(rate: u32, of: impl Fn(f64) -> f64) -> BTreeMap<String, Series> {
        let t: Vec<f64> = (0..=10 * rate).map(|k| f64::from(k) / f64::from(rate)).collect();
        let y = t.iter().map(|t| of(*t)).collect();
        [("a.y".to_string(), Series { t, y, unit: String::new() })].into()
    }

    #[test]
    fn logs_of_other_rates_are_compared_where_both_have_rows() {
        let none = |_: &str| (0.0, 0.0);
        let (fine, coarse) = (log(100, f64::sin), log(30, f64::sin));
        let strict = compare(&fine, &coarse, Rows::All, none);
        assert!(strict[0].what.contains("1001 samples against 301"), "{strict:?}");
        assert_eq!(compare(&fine, &coarse, Rows::Common, none), []);
        // At common times, one value differs. One more difference is at a time that only the finer
        // log has.
        let mut other = fine.clone();
        other.get_mut("a.y").unwrap().y[11] += 1.0;
        assert_eq!(compare(&other, &coarse, Rows::Common, none), []);
        other.get_mut("a.y").unwrap().y[20] += 0.25;
        let found = compare(&other, &coarse, Rows::Common, none);
        assert!(found.len() == 1 && (found[0].largest - 0.25).abs() < 1e-12, "{found:?}");
        assert!(found[0].what.ends_with("t = 0.2 s"), "{found:?}");
        // An earlier and a later part of a log are compared where they overlap. Logs without an
        // overlap are not equal.
        let part = |from: usize, to: usize| {
            let s = &fine["a.y"];
            let (t, y) = (s.t[from..to].to_vec(), s.y[from..to].to_vec());
            BTreeMap::from([("a.y".to_string(), Series { t, y, unit: String::new() })])
        };
        assert_eq!(compare(&part(0, 600), &part(500, 1001), Rows::Common, none), []);
        let apart = compare(&part(0, 400), &part(500, 1001), Rows::Common, none);
        assert!(apart[0].what.contains("without a common time"), "{apart:?}");
    }

    #[test]
    fn the_last_pattern_that_fits_gives_the_tolerance() {
        let of = [("a", 1.0, 0.0), ("b", 2.0, 0.0), ("a", 3.0, 0.5)];
        let of = of.map(|(p, a, r)| (p.to_string(), a, r)).to_vec();
        let t = Tolerances { absolute: 1e-3, relative: 1e-6, of };
        let at = |name: &str| t.at(name, |pattern, name| name.starts_with(pattern));
        assert_eq!((at("ax"), at("bx"), at("c")), ((3.0, 0.5), (2.0, 0.0), (1e-3, 1e-6)));
    }
}

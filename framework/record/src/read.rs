//! Reading a log back: every number as a series; comparing two logs with tolerances.
//!
//! A log is read from its beginning to its end with all its checksums, a record at a time, so that
//! a flipped bit anywhere is an error with its place, and no length in a damaged file decides how
//! much memory is taken. A log that only lacks its end (a killed run) is read as far as it goes.
use crate::log::{LogError, why};
use crate::schema::decode;
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
    /// Unit, when the log tells.
    pub unit: String,
}

/// How a log ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// As its writer finished it.
    Whole,
    /// After so many bytes, in the middle of something: the run was killed, or the copy is cut.
    Cut {
        /// Bytes that were read.
        at: u64,
    },
}

/// What a log holds.
#[derive(Clone, Debug)]
pub struct LogContents {
    /// All series, by `part.field`.
    pub series: BTreeMap<String, Series>,
    /// The configuration that the run was made from; empty when the log carries none.
    pub configuration: String,
    /// Seed, hash of the plan, versions: by name.
    pub about: BTreeMap<String, String>,
    /// How it ends.
    pub end: End,
}

/// All series of a log, by `part.field`. A log without its end (a killed run) is read as far as it
/// goes; [`read_log_contents`] says whether it has one.
///
/// # Errors
/// [`LogError::Read`] when it cannot be opened or is not MCAP, [`LogError::Damaged`].
pub fn read_log(path: &Path) -> Result<BTreeMap<String, Series>, LogError> {
    Ok(read_log_contents(path)?.series)
}

/// Bytes that are asked for at once, and the longest record that is believed.
const READ: usize = 1 << 20;
const RECORD: usize = 1 << 30;

/// A byte of a compressed chunk stands for at most so many.
const EXPANSION: u64 = 256;

/// All series of a log, and how it ends.
///
/// # Errors
/// [`LogError::Read`] when it cannot be opened or is not MCAP, [`LogError::Damaged`].
pub fn read_log_contents(path: &Path) -> Result<LogContents, LogError> {
    let name = path.display().to_string();
    let fail = |why: String| LogError::Read { path: name.clone(), why };
    let mut file = File::open(path).map_err(|e| fail(e.to_string()))?;
    if !file.metadata().map_err(|e| fail(e.to_string()))?.is_file() {
        return Err(fail("it is no file".into()));
    }
    let options = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true)
        .with_record_length_limit(RECORD);
    let mut reader = LinearReader::new_with_options(options);
    let mut gathered = Gathered::default();
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
                gathered.record(opcode, data).map_err(|e| damaged(at, e))?;
                at += 9 + data.len() as u64;
            }
            Err(McapError::UnexpectedEof) => {
                let size = file.metadata().map_or(at, |m| m.len());
                if size < mcap::MAGIC.len() as u64 {
                    return Err(fail(format!("its {size} bytes do not make a log")));
                }
                return Ok(gathered.contents(End::Cut { at }));
            }
            Err(McapError::BadMagic) if at == mcap::MAGIC.len() as u64 => {
                return Err(fail("it does not begin as an MCAP file".into()));
            }
            Err(e) => return Err(damaged(at, why(&e))),
        }
    }
    Ok(gathered.contents(End::Whole))
}

/// What has been read so far.
#[derive(Default)]
struct Gathered {
    schemas: BTreeMap<u16, (String, FileDescriptorSet)>,
    /// Part, schema and metadata.
    channels: BTreeMap<u16, (String, u16, BTreeMap<String, String>)>,
    series: BTreeMap<String, Series>,
    configuration: String,
    about: BTreeMap<String, String>,
}

impl Gathered {
    fn contents(self, end: End) -> LogContents {
        let Gathered { series, configuration, about, .. } = self;
        LogContents { series, configuration, about, end }
    }

    fn record(&mut self, opcode: u8, data: &[u8]) -> Result<(), String> {
        match parse_record(opcode, data).map_err(|e| why(&e))? {
            Record::Chunk { header, .. } => self.chunk(&header, data),
            // These repeat what stands before them.
            _ if opcode >= op::MESSAGE_INDEX
                && opcode != op::ATTACHMENT
                && opcode != op::METADATA =>
            {
                Ok(())
            }
            Record::Attachment { header, data, .. } => {
                if header.name == "configuration.ron" {
                    self.configuration = String::from_utf8_lossy(&data).into_owned();
                }
                Ok(())
            }
            Record::Metadata(metadata) if metadata.name == "linkwork" => {
                self.about = metadata.metadata;
                Ok(())
            }
            record => self.take(record),
        }
    }

    /// `record` is the whole record of a chunk. Its checksum is compared before any of it is read.
    fn chunk(&mut self, header: &ChunkHeader, record: &[u8]) -> Result<(), String> {
        let size = record.len() as u64;
        let most = EXPANSION * (size + 1024);
        if header.uncompressed_size > most || header.compressed_size > size {
            return Err(format!(
                "a chunk of {size} bytes cannot hold {}",
                header.uncompressed_size
            ));
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

    fn take(&mut self, record: Record<'_>) -> Result<(), String> {
        match record {
            Record::Schema { header, data } if header.encoding == "protobuf" => {
                let set = prost::Message::decode(data.as_ref())
                    .map_err(|e| format!("schema `{}`: {e}", header.name))?;
                self.schemas.insert(header.id, (header.name, set));
            }
            Record::Channel(c) => {
                let part = c.topic.trim_start_matches('/').replace('/', ".");
                self.channels.insert(c.id, (part, c.schema_id, c.metadata));
            }
            Record::Message { header, data } => {
                self.message(header.channel_id, header.log_time, &data)
            }
            _ => {}
        }
        Ok(())
    }

    fn message(&mut self, channel: u16, ns: u64, data: &[u8]) {
        let Some((part, schema, units)) = self.channels.get(&channel) else { return };
        let Some((name, set)) = self.schemas.get(schema) else { return };
        if !name.starts_with("linkwork.") {
            return;
        }
        for (field, value) in decode(set, name, data) {
            let series = self.series.entry(format!("{part}.{field}")).or_insert_with(|| Series {
                unit: units.get(&format!("unit.{field}")).cloned().unwrap_or_default(),
                ..Series::default()
            });
            series.t.push(ns as f64 * 1e-9);
            series.y.push(value);
        }
    }
}

/// How one series differs between two logs.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// `part.field`.
    pub name: String,
    /// What differs, in words.
    pub what: String,
    /// Largest difference; ∞ when they cannot be compared.
    pub largest: f64,
}

/// The series that differ by more than `absolute + relative · max(|a|, |b|)`.
pub fn compare(
    a: &BTreeMap<String, Series>,
    b: &BTreeMap<String, Series>,
    absolute: f64,
    relative: f64,
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
        if x.t != y.t {
            let what = format!("{} rows against {}, or other times", x.t.len(), y.t.len());
            out.push(Difference { name: name.clone(), what, largest: f64::INFINITY });
            continue;
        }
        let mut worst: Option<(f64, usize)> = None;
        for (k, (p, q)) in x.y.iter().zip(&y.y).enumerate() {
            let limit = absolute + relative * p.abs().max(q.abs());
            let d = (p - q).abs();
            let same = p.to_bits() == q.to_bits() || (p.is_nan() && q.is_nan());
            if !same && !(d <= limit) && worst.is_none_or(|w| !(d <= w.0)) {
                worst = Some((d, k));
            }
        }
        if let Some((d, k)) = worst {
            let what = format!("{:?} against {:?} at t = {} s", x.y[k], y.y[k], x.t[k]);
            out.push(Difference { name: name.clone(), what, largest: d });
        }
    }
    out.extend(b.keys().filter(|n| !a.contains_key(*n)).map(|n| lone(n, "second")));
    out.sort_by(|p, q| q.largest.total_cmp(&p.largest).then(p.name.cmp(&q.name)));
    out
}

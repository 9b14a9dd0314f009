//! The MCAP log: one protobuf channel per part, transforms of all bodies, and all data that a repeated run needs.
use crate::ballast::{Ballast, Gauge};
use crate::overlays::{self, Overlays};
use crate::pictures::{self, Camera};
use crate::schema::Schema;
use foxglove::Encode;
use foxglove::messages::{FrameTransform, FrameTransforms, Quaternion, Timestamp, Vector3};
use linkwork_dynamics::{Tree, Workspace, kinematics};
use linkwork_plant::{PlanExt, ProgramExt};
use linkwork_runtime::{
    Change, Consumer, Group, Place, Plan, PortKind, Program, Role, Rule, Sample, Seconds, SetRow,
    Variable,
};
use mcap::records::{MessageHeader, Metadata};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Content of a log.
#[derive(Clone, Debug, Default)]
pub struct LogSpec {
    /// Variables, and the rules that select their samples.
    pub groups: Vec<Rule>,
    /// Period of the transforms of all bodies; `None`: no transforms.
    pub transforms: Option<Seconds>,
    /// The full resolved configuration, attached as a file.
    pub configuration: String,
    /// Seed, versions, command line: metadata by name.
    pub about: BTreeMap<String, String>,
    /// The checkpoint from which the run begins, attached as a file; `None` if the run begins at the start of its configuration.
    pub start: Option<Vec<u8>>,
}

/// A log cannot be written or read.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The file cannot be written.
    #[error("log `{path}`: {why}")]
    Write {
        /// The file.
        path: String,
        /// The reason.
        why: String,
    },
    /// The file cannot be opened, or is not a log.
    #[error("log `{path}`: {why}\n  help: give a .mcap file that a run wrote")]
    Read {
        /// The file.
        path: String,
        /// The reason.
        why: String,
    },
    /// The file is damaged.
    #[error(
        "log `{path}` is damaged at byte {at}: {why}\n  help: use an intact copy, or repeat the run: its \
        configuration and seed reproduce the same samples"
    )]
    Damaged {
        /// The file.
        path: String,
        /// Position of the beginning of the record.
        at: u64,
        /// The kind of damage.
        why: String,
    },
}

/// Returns the message of an error of the log's format, with its causes.
pub(crate) fn why(e: &mcap::McapError) -> String {
    match std::error::Error::source(e) {
        Some(cause) => format!("{e}: {cause}"),
        None => e.to_string(),
    }
}

/// Samples are written to the file in chunks of about this number of bytes. A reader can only read complete chunks.
const PART: usize = 256 << 10;

/// Largest time for which samples of a slow run wait until their chunk is full. A killed process loses at most the samples of this interval.
const FRESH: Duration = Duration::from_secs(2);

/// Files attached to a log.
pub(crate) const CONFIGURATION: &str = "configuration.ron";
pub(crate) const START: &str = "start.lwck";

/// Keys in the metadata of a channel: path and unit of the variable of a field. The name of a field differs from the path if a schema does not permit
/// the path.
pub(crate) const PATH: &str = "path.";
pub(crate) const UNIT: &str = "unit.";

/// The schema of the poses of all bodies.
pub(crate) const TRANSFORMS: &str = "foxglove.FrameTransforms";

/// The schema of variables that were set, pinned or unpinned from outside.
pub(crate) const SETS: &str = "linkwork.Set";
const SETS_SCHEMA: &str = r#"{"type":"object","properties":{"tick":{"type":"integer"},"path":{"type":"string"},"change":{"enum":["set","pin","unpin"]},"value":{"type":"number"},"bits":{"type":"string"}}}"#;

/// Kind of a change of a variable in the log. Logs from before pins existed do not contain it.
#[derive(Serialize, Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Changed {
    #[default]
    Set,
    Pin,
    Unpin,
}

impl From<Change> for Changed {
    fn from(change: Change) -> Changed {
        match change {
            Change::Set => Changed::Set,
            Change::Pin => Changed::Pin,
            Change::Unpin => Changed::Unpin,
        }
    }
}

impl From<Changed> for Change {
    fn from(changed: Changed) -> Change {
        match changed {
            Changed::Set => Change::Set,
            Changed::Pin => Change::Pin,
            Changed::Unpin => Change::Unpin,
        }
    }
}

/// A variable that was changed from outside. `bits` is the value as IEEE 754 in hexadecimal digits.
#[derive(Serialize, Deserialize)]
pub(crate) struct SetMessage {
    pub tick: u64,
    pub path: String,
    #[serde(default)]
    pub change: Changed,
    pub value: f64,
    pub bits: String,
}

struct Channel {
    id: u16,
    sequence: u32,
    schema: Schema,
    /// First column of the group's sample that belongs to this channel.
    from: usize,
    to: usize,
}

struct Transforms {
    group: u32,
    id: u16,
    sequence: u32,
    /// For each phase: its mechanism, and the names of its bodies.
    phases: Vec<Option<(Arc<Tree>, Workspace, Vec<(String, String)>)>>,
}

/// Writes samples as MCAP, in the thread of a recorder.
pub struct Log {
    path: String,
    /// `None` after the log is complete.
    writer: Option<mcap::Writer<BufWriter<Ballast>>>,
    /// A second handle of the file, for synchronization with the disk.
    disk: File,
    /// Channels of each group.
    channels: Vec<Vec<Channel>>,
    transforms: Option<Transforms>,
    /// Group of the first camera. The other cameras follow, then the overlays.
    first_camera: usize,
    cameras: Vec<Camera>,
    overlays: Option<Overlays>,
    /// Channel and sequence number of the changed variables.
    sets: Option<(u16, u32)>,
    buffer: Vec<u8>,
    gauge: Arc<Gauge>,
    /// Bytes in the open chunk, and the time at which the last chunk was written.
    open: usize,
    last: Instant,
}

impl Log {
    /// Opens the file and writes the header, schemas and channels. The groups are for [`Recorder::start`](linkwork_runtime::Recorder::start).
    ///
    /// # Errors
    /// [`LogError::Write`].
    pub fn create(
        path: &Path,
        program: &Program,
        spec: &LogSpec,
    ) -> Result<(Log, Vec<Group>), LogError> {
        let plan = &*program.phases[0].plan;
        let name = path.display().to_string();
        let fail = |why: String| LogError::Write { path: name.clone(), why };
        let gauge = Arc::new(Gauge::default());
        let file = Ballast::create(path, gauge.clone()).map_err(|e| fail(e.to_string()))?;
        let disk = file.twin().map_err(|e| fail(e.to_string()))?;
        let mut writer = mcap::WriteOptions::new()
            .compression(Some(mcap::Compression::Lz4))
            .chunk_size(None) // Chunks are ended explicitly.
            .disable_seeking(true) // A chunk is written completely.
            .profile("linkwork")
            .library(format!("linkwork {}", env!("CARGO_PKG_VERSION")))
            .create(BufWriter::with_capacity(1 << 16, file))
            .map_err(|e| fail(why(&e)))?;
        let mut about = spec.about.clone();
        about.insert("seed".into(), plan.seed.to_string());
        about.insert("plan".into(), format!("{:016x}", plan.hash()));
        about.insert("linkwork".into(), env!("CARGO_PKG_VERSION").into());
        about.insert("step".into(), plan.step.to_string());
        writer
            .write_metadata(&Metadata { name: "linkwork".into(), metadata: about })
            .map_err(|e| fail(why(&e)))?;
        let configuration = (CONFIGURATION, "text/plain", spec.configuration.as_bytes());
        let start = spec.start.iter().map(|s| (START, "application/octet-stream", &s[..]));
        for (name, media_type, data) in std::iter::once(configuration).chain(start) {
            let attachment = mcap::Attachment {
                log_time: 0,
                create_time: 0,
                name: name.into(),
                media_type: media_type.into(),
                data: Cow::Borrowed(data),
            };
            writer.attach(&attachment).map_err(|e| fail(why(&e)))?;
        }
        let (mut groups, mut channels) = (Vec::new(), Vec::new());
        for rule in &spec.groups {
            let (group, list) = open_group(&mut writer, plan, rule).map_err(|e| fail(why(&e)))?;
            groups.push(group);
            channels.push(list);
        }
        let bodies = program.phases.iter().any(|p| p.plan.mechanism().is_some());
        let transforms = match spec.transforms {
            Some(period) if bodies => {
                let (t, group) = open_transforms(&mut writer, program, period, groups.len() as u32)
                    .map_err(|e| fail(why(&e)))?;
                groups.push(group);
                Some(t)
            }
            _ => None,
        };
        let first_camera = groups.len();
        let opened = pictures::open(&mut writer, program).map_err(|e| fail(why(&e)))?;
        let (of_cameras, cameras): (Vec<Group>, Vec<Camera>) = opened.into_iter().unzip();
        groups.extend(of_cameras);
        let opened = overlays::open(&mut writer, program, groups.len() as u32);
        let (of_overlays, overlays) = opened.map_err(|e| fail(why(&e)))?.unzip();
        groups.extend(of_overlays);
        // Write schemas and channels to the disk before the first sample, so that a killed run leaves a readable log.
        writer.flush().map_err(|e| fail(why(&e)))?;
        gauge.mark_whole();
        let writer = Some(writer);
        let (buffer, last) = (Vec::new(), now());
        let sets = None;
        let log = Log {
            path: name,
            writer,
            disk,
            channels,
            transforms,
            first_camera,
            cameras,
            overlays,
            sets,
            buffer,
            gauge,
            open: 0,
            last,
        };
        Ok((log, groups))
    }

    fn fault(&self, why: &str) -> String {
        format!("log `{}`: {why}", self.path)
    }

    fn write(&mut self, id: u16, sequence: u32, ns: u64) -> Result<(), String> {
        let header = MessageHeader { channel_id: id, sequence, log_time: ns, publish_time: ns };
        let Some(writer) = &mut self.writer else {
            return Err(self.fault("it is already complete"));
        };
        self.open += self.buffer.len() + 31;
        let written = writer.write_to_known_channel(&header, &self.buffer);
        written.map_err(|e| self.fault(&why(&e)))
    }

    /// Returns the channel of variables that were changed from outside. It is created on demand, because most logs do not need it.
    fn open_sets(&mut self) -> Result<u16, mcap::McapError> {
        let Some(writer) = &mut self.writer else { return Err(mcap::McapError::BadMagic) };
        let schema = writer.add_schema(SETS, "jsonschema", SETS_SCHEMA.as_bytes())?;
        writer.add_channel(schema, "/linkwork/set", "json", &BTreeMap::new())
    }

    /// Ends the open chunk and writes it to the file.
    fn end_part(&mut self) -> Result<(), String> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        let flushed = writer.flush();
        flushed.map_err(|e| self.fault(&why(&e)))?;
        self.gauge.mark_whole();
        (self.open, self.last) = (0, now());
        Ok(())
    }
}

/// The wall clock affects only where chunks end, never their samples.
#[allow(clippy::disallowed_methods)]
fn now() -> Instant {
    Instant::now()
}

/// Returns the message of each part that has variables among `paths`: part, variables in the order of columns, schema.
fn messages<'a>(
    plan: &'a Plan,
    paths: &'a [String],
) -> Vec<(&'a str, Vec<(&'a String, &'a Variable)>, Schema)> {
    let mut by_part: BTreeMap<&str, Vec<(&String, &Variable)>> = BTreeMap::new();
    for path in paths {
        if let Some(v) = plan.variables.get(path)
            && v.role != Role::Input
        {
            by_part.entry(&v.part).or_default().push((path, v));
        }
    }
    let message = |(part, mut list): (&'a str, Vec<(&'a String, &'a Variable)>)| {
        // Sort components in the order of the ports, so that vectors are x, y, z, and rate[10] follows
        // rate[9].
        list.sort_by_key(|(_, v)| match v.place {
            Place::X(k) => (1, k),
            Place::D(k) => (2, k),
            Place::Signal(k) | Place::Channel(k) | Place::Phase(k) => (0, k),
        });
        let columns: Vec<(String, bool)> = list
            .iter()
            .map(|(path, v)| (within(part, path).to_string(), v.kind == PortKind::Bool))
            .collect();
        let schema = Schema::new(part, &columns);
        (part, list, schema)
    };
    by_part.into_iter().map(message).collect()
}

/// Returns the path of a variable relative to its part.
fn within<'a>(part: &str, path: &'a str) -> &'a str {
    let rest = path.strip_prefix(part);
    rest.map_or(path, |rest| rest.strip_prefix('.').unwrap_or(rest))
}

/// The columns of a rule.
pub struct Columns {
    /// The variables, which are read together.
    pub group: Group,
    /// Path, and whether it is a truth value.
    pub variables: Vec<(String, bool)>,
}

/// Returns the columns of a rule, in the order of a log.
pub fn columns(plan: &Plan, rule: &Rule) -> Columns {
    let (mut places, mut variables) = (Vec::new(), Vec::new());
    for (_, list, _) in messages(plan, &rule.paths) {
        places.extend(list.iter().map(|(_, v)| v.place));
        let variable =
            |(path, v): &(&String, &Variable)| ((*path).clone(), v.kind == PortKind::Bool);
        variables.extend(list.iter().map(variable));
    }
    let Rule { period, on_change, around, .. } = rule.clone();
    Columns { group: Group { period, places, on_change, around, ..Group::default() }, variables }
}

fn open_group(
    writer: &mut mcap::Writer<BufWriter<Ballast>>,
    plan: &Plan,
    rule: &Rule,
) -> Result<(Group, Vec<Channel>), mcap::McapError> {
    let (mut from, mut channels) = (0, Vec::new());
    for (part, list, schema) in messages(plan, &rule.paths) {
        let to = from + list.len();
        let id = writer.add_schema(&schema.name, "protobuf", &schema.descriptor())?;
        let mut metadata = BTreeMap::new();
        for (column, field) in schema.columns() {
            let (path, v) = list[column];
            metadata.insert(format!("{PATH}{field}"), path.clone());
            metadata.insert(format!("{UNIT}{field}"), v.unit.to_string());
        }
        let topic = format!("/{}", part.replace('.', "/"));
        let id = writer.add_channel(id, &topic, "protobuf", &metadata)?;
        channels.push(Channel { id, sequence: 0, schema, from, to });
        from = to;
    }
    Ok((columns(plan, rule).group, channels))
}

fn open_transforms(
    writer: &mut mcap::Writer<BufWriter<Ballast>>,
    program: &Program,
    period: Seconds,
    group: u32,
) -> Result<(Transforms, Group), mcap::McapError> {
    let bad = || mcap::McapError::BadMagic;
    let schema = FrameTransforms::get_schema().ok_or_else(bad)?;
    let id = writer.add_schema(&schema.name, &schema.encoding, &schema.data)?;
    let id = writer.add_channel(id, "/tf", "protobuf", &BTreeMap::new())?;
    let name = |b: &linkwork_multibody::Body| ("world".to_string(), b.name().to_string());
    let phases = program.phases.iter().map(|p| {
        let m = p.plan.mechanism()?;
        let names = m.multibody.bodies().iter().map(name).collect();
        Some((m.tree.clone(), Workspace::new(&m.tree), names))
    });
    let t = Transforms { group, id, sequence: 0, phases: phases.collect() };
    let coordinates = program.coordinates();
    Ok((t, Group { period, coordinates, ..Group::default() }))
}

impl Transforms {
    fn message(&mut self, row: &Sample, out: &mut Vec<u8>) -> Result<(), String> {
        let phase = self.phases.get_mut(row.phase as usize).and_then(Option::as_mut);
        let Some((tree, ws, names)) = phase else { return Ok(()) };
        let nq = tree.nq();
        kinematics(tree, ws, &row.values[..nq], &row.values[nq..]);
        let timestamp =
            Timestamp::new((row.ns / 1_000_000_000) as u32, (row.ns % 1_000_000_000) as u32);
        let transforms = tree
            .multibody()
            .body_ids()
            .zip(&*names)
            .map(|(id, (parent, child))| {
                let pose = ws.body_pose(tree, id);
                let (p, q) = (pose.position, pose.rotation);
                FrameTransform {
                    timestamp: Some(timestamp),
                    parent_frame_id: parent.clone(),
                    child_frame_id: child.clone(),
                    translation: Some(Vector3 { x: p.x, y: p.y, z: p.z }),
                    rotation: Some(Quaternion { x: q.i, y: q.j, z: q.k, w: q.w }),
                }
            })
            .collect();
        let message = FrameTransforms { transforms };
        Encode::encode(&message, out).map_err(|e| e.to_string())
    }
}

impl Consumer for Log {
    fn row(&mut self, row: &Sample) -> Result<(), String> {
        if let Some(mut t) = self.transforms.take_if(|t| t.group == row.group) {
            self.buffer.clear();
            t.message(row, &mut self.buffer)?;
            self.write(t.id, t.sequence, row.ns)?;
            t.sequence = t.sequence.wrapping_add(1);
            self.transforms = Some(t);
        } else if let Some(mut overlays) = self.overlays.take_if(|o| o.group == row.group) {
            overlays.messages(row, |(id, sequence), encode| {
                self.buffer.clear();
                encode(&mut self.buffer)?;
                self.write(id, sequence, row.ns)
            })?;
            self.overlays = Some(overlays);
        } else if let Some(k) = (row.group as usize).checked_sub(self.first_camera) {
            self.buffer.clear();
            let camera = &mut self.cameras[k];
            if camera.message(row, &mut self.buffer)? {
                let (id, sequence) = (camera.id, camera.sequence);
                camera.sequence = sequence.wrapping_add(1);
                self.write(id, sequence, row.ns)?;
            }
        } else {
            let mut channels = std::mem::take(&mut self.channels[row.group as usize]);
            for c in &mut channels {
                self.buffer.clear();
                c.schema.encode(&row.values[c.from..c.to], &mut self.buffer);
                self.write(c.id, c.sequence, row.ns)?;
                c.sequence = c.sequence.wrapping_add(1);
            }
            self.channels[row.group as usize] = channels;
        }
        if self.open >= PART || self.last.elapsed() >= FRESH {
            self.end_part()?;
        }
        self.gauge.spent().map_or(Ok(()), |why| Err(self.fault(why)))
    }

    fn set(&mut self, set: &SetRow) -> Result<(), String> {
        let (id, sequence) = match self.sets {
            Some(known) => known,
            None => (self.open_sets().map_err(|e| self.fault(&why(&e)))?, 0),
        };
        let (tick, path, value) = (set.tick, set.path.clone(), set.value);
        let change = set.change.into();
        let bits = format!("{:016x}", value.to_bits());
        self.buffer.clear();
        serde_json::to_writer(&mut self.buffer, &SetMessage { tick, path, change, value, bits })
            .map_err(|e| self.fault(&e.to_string()))?;
        self.write(id, sequence, set.ns)?;
        self.sets = Some((id, sequence.wrapping_add(1)));
        Ok(())
    }

    /// Also synchronizes with the disk, because a checkpoint that follows refers to samples that must survive a power failure.
    fn flush(&mut self) -> Result<(), String> {
        self.end_part()?;
        sync(&self.disk).map_err(|e| self.fault(&e.to_string()))?;
        self.gauge.spent().map_or(Ok(()), |why| Err(self.fault(why)))
    }

    fn finish(&mut self) -> Result<(), String> {
        let Some(mut writer) = self.writer.take() else { return Ok(()) };
        let finished = writer.finish().map(|_| ()).map_err(|e| self.fault(&why(&e)));
        let (mut file, flushed) = match writer.into_inner().into_inner() {
            Ok(file) => (file, Ok(())),
            Err(e) => {
                let (e, buffered) = e.into_parts();
                (buffered.into_parts().0, Err(self.fault(&e.to_string())))
            }
        };
        let ended = finished.and(flushed);
        if ended.is_err() {
            // The file keeps its complete chunks but has no footer; readers accept this.
            file.cut().map_err(|e| self.fault(&e.to_string()))?;
        }
        ended.and(sync(&self.disk).map_err(|e| self.fault(&e.to_string())))
    }
}

/// Synchronizes a file with the disk. Pipes and devices are skipped.
fn sync(file: &File) -> std::io::Result<()> {
    if file.metadata()?.is_file() { file.sync_all() } else { Ok(()) }
}

impl Drop for Log {
    fn drop(&mut self) {
        let _ = self.finish();
    }
}

//! Rows as columns, in the order of time.
//!
//! A stream that batches by entity writes seconds of one body before the first instant of the
//! next, so that a recording that is still loading shows a machine torn apart. Here the poses of
//! one instant stand side by side: all of them are rows of one entity, `transforms`, each naming
//! the frame that it places. Forces and curves of the same stretch of time follow.
use crate::stream::Wrap;
use linkwork_spatial::Pose;
use re_sdk::log::TimeColumn;
use re_sdk::{EntityPath, RecordingStream};
use re_sdk_types::components::TransformFrameId;

/// The timeline of all that is shown: simulated time.
pub const TIMELINE: &str = "sim_time";

/// Instants in a batch, when they come fast.
pub const INSTANTS: usize = 64;

/// Moving frames: their names, and their poses over a stretch of time.
#[derive(Default)]
pub struct Frames {
    names: Vec<TransformFrameId>,
    t: Vec<i64>,
    translations: Vec<[f32; 3]>,
    rotations: Vec<re_sdk_types::datatypes::Quaternion>,
}

impl Frames {
    /// Of the entities that move.
    pub fn new(entities: &[EntityPath]) -> Frames {
        let names = entities.iter().map(TransformFrameId::from_entity_path).collect();
        Frames { names, ..Frames::default() }
    }

    /// Adds an instant (ns): a pose in W for each frame, in their order.
    pub fn push(&mut self, t: i64, poses: impl Iterator<Item = Pose>) {
        for pose in poses {
            let (p, q) = (pose.position, pose.rotation);
            self.t.push(t);
            self.translations.push([p.x as f32, p.y as f32, p.z as f32]);
            let q = [q.i as f32, q.j as f32, q.k as f32, q.w as f32];
            self.rotations.push(re_sdk_types::datatypes::Quaternion::from_xyzw(q));
        }
    }

    /// Sends what has been gathered.
    pub fn send(&mut self, rec: &RecordingStream) -> Result<(), Wrap> {
        if self.t.is_empty() {
            return Ok(());
        }
        let n = self.t.len();
        let root = TransformFrameId::from_entity_path(&EntityPath::root());
        let columns = re_sdk_types::archetypes::Transform3D::update_fields()
            .with_many_translation(self.translations.drain(..))
            .with_many_quaternion(self.rotations.drain(..))
            .with_many_child_frame(self.names.iter().cycle().take(n).cloned())
            .with_many_parent_frame(std::iter::repeat_n(root, n))
            .columns_of_unit_batches()?;
        rec.send_columns("transforms", [time(self.t.drain(..))], columns)?;
        Ok(())
    }
}

/// An arrow over a stretch of time. Colour and thickness do not change.
pub struct Arrows {
    entity: EntityPath,
    t: Vec<i64>,
    origins: Vec<[f32; 3]>,
    vectors: Vec<[f32; 3]>,
    /// Where it was pushed last, while it has a length.
    last: Option<[f32; 3]>,
}

impl Arrows {
    /// Of an entity whose origin and vector are in W, wherever it stands in the tree.
    pub fn open(rec: &RecordingStream, entity: EntityPath, color: [u8; 4]) -> Result<Arrows, Wrap> {
        let root = TransformFrameId::from_entity_path(&EntityPath::root());
        rec.log_static(entity.clone(), &re_sdk_types::archetypes::CoordinateFrame::new(root))?;
        let [r, g, b, a] = color;
        let look = re_sdk_types::archetypes::Arrows3D::update_fields()
            .with_colors([re_sdk_types::components::Color::from_unmultiplied_rgba(r, g, b, a)])
            .with_radii([0.02]);
        rec.log_static(entity.clone(), &look)?;
        Ok(Arrows { entity, t: Vec::new(), origins: Vec::new(), vectors: Vec::new(), last: None })
    }

    /// Adds an instant (ns).
    pub fn push(&mut self, t: i64, origin: [f32; 3], vector: [f32; 3]) {
        self.t.push(t);
        self.origins.push(origin);
        self.vectors.push(vector);
        self.last = (vector != [0.0; 3]).then_some(origin);
    }

    /// From an instant (ns) on it has no length: a viewer goes on showing what it was told last.
    pub fn shorten(&mut self, t: i64) {
        if let Some(origin) = self.last {
            self.push(t, origin, [0.0; 3]);
        }
    }

    /// Sends what has been gathered.
    pub fn send(&mut self, rec: &RecordingStream) -> Result<(), Wrap> {
        if self.t.is_empty() {
            return Ok(());
        }
        let columns = re_sdk_types::archetypes::Arrows3D::update_fields()
            .with_vectors(self.vectors.drain(..))
            .with_origins(self.origins.drain(..))
            .columns_of_unit_batches()?;
        rec.send_columns(self.entity.clone(), [time(self.t.drain(..))], columns)?;
        Ok(())
    }
}

/// A curve over a stretch of time.
pub struct Curve {
    entity: EntityPath,
    t: Vec<i64>,
    y: Vec<f64>,
}

impl Curve {
    /// Of an entity.
    pub fn new(entity: EntityPath) -> Curve {
        Curve { entity, t: Vec::new(), y: Vec::new() }
    }

    /// Adds an instant (ns).
    pub fn push(&mut self, t: i64, y: f64) {
        self.t.push(t);
        self.y.push(y);
    }

    /// Sends what has been gathered.
    pub fn send(&mut self, rec: &RecordingStream) -> Result<(), Wrap> {
        if self.t.is_empty() {
            return Ok(());
        }
        let columns = re_sdk_types::archetypes::Scalars::update_fields()
            .with_scalars(self.y.drain(..))
            .columns_of_unit_batches()?;
        rec.send_columns(self.entity.clone(), [time(self.t.drain(..))], columns)?;
        Ok(())
    }
}

/// Times in nanoseconds.
pub fn time(t: impl Iterator<Item = i64>) -> TimeColumn {
    TimeColumn::new_duration_nanos(TIMELINE, t)
}

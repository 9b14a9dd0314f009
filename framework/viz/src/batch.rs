//! Sends samples as columns, in the order of time.
//!
//! A stream that batches by entity writes seconds of one body before the first instant of the next. A recording that is still loading would then show
//! the parts of a machine at different times. Therefore all poses of one instant are rows of one entity, `transforms`, each with the name of the
//! frame that it places. Forces and curves of the same interval follow.
use crate::eye::Base;
use crate::shapes::f3;
use crate::stream::Wrap;
use linkwork_spatial::{Pose, Vec3};
use re_sdk::log::TimeColumn;
use re_sdk::{EntityPath, RecordingStream};
use re_sdk_types::components::{Radius, TransformFrameId};

/// The timeline of all data: simulated time.
pub const TIMELINE: &str = "sim_time";

/// Number of instants in a batch at high sample rates.
pub const INSTANTS: usize = 64;

/// Thickness of an arrow on the screen (points), independent of the size of the machine.
const THICK: f32 = 2.0;

/// Moving frames: their names, and their poses over an interval of time.
#[derive(Default)]
pub struct Frames {
    names: Vec<TransformFrameId>,
    /// The frame in which each pose is expressed.
    parents: Vec<TransformFrameId>,
    t: Vec<i64>,
    translations: Vec<[f32; 3]>,
    rotations: Vec<re_sdk_types::datatypes::Quaternion>,
}

impl Frames {
    /// Creates the frames of the moving entities, expressed in a base. The frame of the base itself, if it is not W, is the last.
    pub fn new(entities: impl Iterator<Item = EntityPath>, base: &Base) -> Frames {
        let mut names: Vec<TransformFrameId> =
            entities.map(|path| TransformFrameId::from_entity_path(&path)).collect();
        let mut parents = vec![base.frame(); names.len()];
        if let Base::Eye(_) = base {
            names.push(base.frame());
            parents.push(Base::World.frame());
        }
        Frames { names, parents, ..Frames::default() }
    }

    /// Adds an instant (ns): the pose of the base, and a pose in W for each frame, in their order.
    pub fn push(&mut self, t: i64, base: &Base, poses: impl Iterator<Item = Pose>) {
        for pose in poses {
            self.add(t, &base.pose(&pose));
        }
        if let Base::Eye(pose) = base {
            self.add(t, pose);
        }
    }

    fn add(&mut self, t: i64, pose: &Pose) {
        let q = pose.rotation;
        self.t.push(t);
        self.translations.push(f3(&pose.position));
        let q = [q.i as f32, q.j as f32, q.k as f32, q.w as f32];
        self.rotations.push(re_sdk_types::datatypes::Quaternion::from_xyzw(q));
    }

    /// Sends the collected data.
    pub fn send(&mut self, rec: &RecordingStream) -> Result<(), Wrap> {
        if self.t.is_empty() {
            return Ok(());
        }
        let n = self.t.len();
        let columns = re_sdk_types::archetypes::Transform3D::update_fields()
            .with_many_translation(self.translations.drain(..))
            .with_many_quaternion(self.rotations.drain(..))
            .with_many_child_frame(self.names.iter().cycle().take(n).cloned())
            .with_many_parent_frame(self.parents.iter().cycle().take(n).cloned())
            .columns_of_unit_batches()?;
        rec.send_columns("transforms", [time(self.t.drain(..))], columns)?;
        Ok(())
    }
}

/// An arrow over an interval of time, with constant colour and thickness.
pub struct Arrows {
    entity: EntityPath,
    t: Vec<i64>,
    origins: Vec<[f32; 3]>,
    vectors: Vec<[f32; 3]>,
    /// Origin of the last sample while the arrow has a length.
    last: Option<[f32; 3]>,
}

impl Arrows {
    /// Creates the arrow of an entity. Origin and vector are expressed in the base, wherever the entity is in the tree.
    pub fn open(
        rec: &RecordingStream,
        entity: EntityPath,
        [r, g, b, a]: [u8; 4],
        base: &Base,
    ) -> Result<Arrows, Wrap> {
        let frame = re_sdk_types::archetypes::CoordinateFrame::new(base.frame());
        rec.log_static(entity.clone(), &frame)?;
        let look = re_sdk_types::archetypes::Arrows3D::update_fields()
            .with_colors([re_sdk_types::components::Color::from_unmultiplied_rgba(r, g, b, a)])
            .with_radii([Radius::new_ui_points(THICK)]);
        rec.log_static(entity.clone(), &look)?;
        Ok(Arrows { entity, t: Vec::new(), origins: Vec::new(), vectors: Vec::new(), last: None })
    }

    /// Adds an instant (ns): origin (m) and vector in W, and the pose of the base.
    pub fn push(&mut self, t: i64, base: &Base, origin: &Vec3, vector: &Vec3) {
        self.add(t, f3(&base.point(origin)), f3(&base.vector(vector)));
    }

    fn add(&mut self, t: i64, origin: [f32; 3], vector: [f32; 3]) {
        self.t.push(t);
        self.origins.push(origin);
        self.vectors.push(vector);
        self.last = (vector != [0.0; 3]).then_some(origin);
    }

    /// Sets the length to zero from an instant (ns) on, because a viewer continues to show the last value.
    pub fn shorten(&mut self, t: i64) {
        if let Some(origin) = self.last {
            self.add(t, origin, [0.0; 3]);
        }
    }

    /// Sends the collected data.
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

/// A curve over an interval of time.
pub struct Curve {
    entity: EntityPath,
    t: Vec<i64>,
    y: Vec<f64>,
}

impl Curve {
    /// Creates the curve of an entity.
    pub fn new(entity: EntityPath) -> Curve {
        Curve { entity, t: Vec::new(), y: Vec::new() }
    }

    /// Adds an instant (ns).
    pub fn push(&mut self, t: i64, y: f64) {
        self.t.push(t);
        self.y.push(y);
    }

    /// Sends the collected data.
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

/// Converts times in nanoseconds to a column.
pub fn time(t: impl Iterator<Item = i64>) -> TimeColumn {
    TimeColumn::new_duration_nanos(TIMELINE, t)
}

//! Building a model from a file, parts, objects and shapes. Every fault is described in the builder's message.

use crate::call::calls;
use crate::edge::{self, LwPose, Out, text, value};
use crate::model::LwModel;
use crate::status::{Fault, LwStatus, Message};
use linkwork_embedded::formats::{
    Description, ReadOptions, Root, Srdf, Unphysical, read_file, read_srdf, read_srdf_file,
    read_text,
};
use linkwork_embedded::spatial::{InertiaCheck, Vec3};
use linkwork_embedded::{
    Closures, ColliderSpec, ModelSpec, ObjectSpec, PartSpec, RobotModel, Shape,
};
use std::ffi::c_char;
use std::path::PathBuf;
use std::sync::Mutex;

/// The roots of the file are connected to the world as its format defines (URDF: welded).
pub const LW_ROOT_AS_WRITTEN: u32 = 0;
/// The roots of the file are welded to the world.
pub const LW_ROOT_FIXED: u32 = 1;
/// The roots of the file move freely.
pub const LW_ROOT_FREE: u32 = 2;
/// The roots of the file move in the xy plane of the world.
pub const LW_ROOT_PLANAR: u32 = 3;
const ROOTS: [Root; 4] = [Root::AsWritten, Root::Fixed, Root::Free, Root::Planar];

/// Inertias that no rigid body can have are read: moments that violate the triangle inequality unchanged, negative moments as 0, and inertias without
/// mass are ignored. `lw_model_doubtful` lists them.
pub const LW_INERTIA_WARN: u32 = 0;
/// Inertias that no rigid body can have are errors.
pub const LW_INERTIA_PHYSICAL: u32 = 1;
/// Principal moments may violate the triangle inequality, as in some published data, but must not be negative.
pub const LW_INERTIA_POSITIVE_MOMENTS: u32 = 2;
const CHECKS: [(InertiaCheck, Unphysical); 3] = [
    (InertiaCheck::Physical, Unphysical::Read),
    (InertiaCheck::Physical, Unphysical::Refused),
    (InertiaCheck::PositiveMoments, Unphysical::Refused),
];

/// A sphere about the origin: `size` = radius, unused, unused.
pub const LW_SHAPE_SPHERE: u32 = 0;
/// A box about the origin: `size` = half of its edges along x, y, z.
pub const LW_SHAPE_BOX: u32 = 1;
/// A capsule along the z axis: `size` = radius, half of the length of its axis, unused.
pub const LW_SHAPE_CAPSULE: u32 = 2;
/// A cylinder along the z axis: `size` = radius, half of its length, unused.
pub const LW_SHAPE_CYLINDER: u32 = 3;
/// The half space z <= 0: `size` is unused.
pub const LW_SHAPE_HALF_SPACE: u32 = 4;
/// An ellipsoid about the origin: `size` = half of its axes along x, y, z.
pub const LW_SHAPE_ELLIPSOID: u32 = 5;

/// A shape in its own frame.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwShape {
    /// One of `LW_SHAPE_...`.
    pub kind: u32,
    /// Dimensions, m, as defined by the kind; unused ones are zero.
    pub size: [f64; 3],
}

impl LwShape {
    pub(crate) fn checked(&self) -> Result<Shape, Fault> {
        let [a, b, c] = self.size;
        let (shape, unused) = match self.kind {
            LW_SHAPE_SPHERE => (Shape::Sphere { radius: a }, &self.size[1..]),
            LW_SHAPE_BOX => (Shape::Box { half: Vec3::new(a, b, c) }, &[][..]),
            LW_SHAPE_CAPSULE => (Shape::Capsule { radius: a, half_length: b }, &self.size[2..]),
            LW_SHAPE_CYLINDER => (Shape::Cylinder { radius: a, half_length: b }, &self.size[2..]),
            LW_SHAPE_ELLIPSOID => (Shape::Ellipsoid { half: Vec3::new(a, b, c) }, &[][..]),
            LW_SHAPE_HALF_SPACE => (Shape::HalfSpace, &self.size[..]),
            value => return Err(Fault::Choice { what: "kind", value, help: "one of LW_SHAPE_.." }),
        };
        match unused.iter().all(|x| *x == 0.0) {
            true => Ok(shape),
            false => Err(Fault::Model(format!(
                "shape {} does not use all of `size`: {:?}\n  help: set the unused numbers to zero",
                self.kind, self.size
            ))),
        }
    }
}

#[derive(Default)]
pub(crate) struct Draft {
    /// Its `closures` must be set before the robot is read.
    pub spec: ModelSpec,
    options: ReadOptions,
    description: Option<Description>,
}

/// A model under construction. Use it from one thread at a time.
pub struct LwBuilder {
    draft: Mutex<Draft>,
    message: Mutex<Message>,
}

impl LwBuilder {
    pub(crate) fn parts(&self) -> (&Mutex<Draft>, &Mutex<Message>) {
        (&self.draft, &self.message)
    }
}

impl Draft {
    fn options(&self, root: u32, inertia: u32) -> Result<ReadOptions, Fault> {
        if self.description.is_some() {
            let text = "this builder already has a robot\n  help: use one builder for each robot";
            return Err(Fault::Model(text.into()));
        }
        let (what, help) = ("root", "one of LW_ROOT_..");
        let choice = Fault::Choice { what, value: root, help };
        let root = *ROOTS.get(root as usize).ok_or(choice)?;
        let (what, help) = ("inertia", "one of LW_INERTIA_..");
        let choice = Fault::Choice { what, value: inertia, help };
        let (inertia, unphysical) = *CHECKS.get(inertia as usize).ok_or(choice)?;
        Ok(ReadOptions { root, inertia, unphysical, ..self.options.clone() })
    }

    /// Adds a robot; parts and shapes that were added before remain.
    fn robot(&mut self, d: Description) -> Result<(), Fault> {
        if let Some(body) = self.spec.mechanism.bodies().first() {
            let text = format!(
                "body `{}` was added before the file\n  help: read the file first, then add bodies to it",
                body.name
            );
            return Err(Fault::Model(text));
        }
        let read = match self.spec.closures {
            Closures::Refused => ModelSpec::from_description(&d)?,
            Closures::Kept => ModelSpec::with_closures(&d),
        };
        let spec = &mut self.spec;
        (spec.mechanism, spec.joints) = (read.mechanism, read.joints);
        spec.unused.extend(read.unused);
        spec.doubtful.extend(read.doubtful);
        self.description = Some(d);
        Ok(())
    }

    /// Returns the description that was read from the robot's file.
    fn file(&self) -> Result<&Description, Fault> {
        let text = "this builder has no robot file yet\n  help: call lw_builder_robot_file first";
        self.description.as_ref().ok_or_else(|| Fault::Model(text.into()))
    }

    /// Checks that there is a mechanism.
    fn whole(&self) -> Result<(), Fault> {
        if self.description.is_some() || !self.spec.mechanism.bodies().is_empty() {
            return Ok(());
        }
        let text = "this builder has no robot yet\n  help: call lw_builder_robot_file or lw_builder_body first";
        Err(Fault::Model(text.into()))
    }

    fn groups(&mut self, srdf: &Srdf) -> Result<(), Fault> {
        self.spec = self.spec.clone().groups(srdf, self.file()?)?;
        Ok(())
    }

    /// # Safety
    /// The conditions in the crate documentation apply.
    pub unsafe fn collider(
        &mut self,
        name: &str,
        carrier: &str,
        at: *const LwPose,
        shape: Shape,
    ) -> Result<(), Fault> {
        let mut spec = ColliderSpec::new(name, carrier, shape);
        if !at.is_null() {
            // SAFETY: guaranteed by the caller.
            spec.pose = unsafe { value("at", at) }?.checked()?;
        }
        self.spec.colliders.push(spec);
        Ok(())
    }
}

fn model(e: impl ToString) -> Fault {
    Fault::Model(e.to_string())
}

calls![
    /// Creates an empty builder and writes it to `out`; free it with `lw_builder_free`.
    fn lw_builder_new(out: Out<*mut LwBuilder>) {
        let new = LwBuilder { draft: Mutex::default(), message: Mutex::new(Message::new()) };
        out.set(Box::into_raw(Box::new(new)));
    }

    /// Frees a builder; NULL has no effect. Models that it made remain valid.
    fn lw_builder_free(builder: *mut LwBuilder);
];

/// Copies the message of the last failed call with this builder, with its terminating zero, into `buffer` of `room` bytes: place, fact and remedy;
/// empty when no call failed. Writes the required size to `wanted` (may be NULL). Returns `LW_STATUS_LENGTH` when the message is cut.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_builder_message(
    builder: *const LwBuilder,
    buffer: *mut c_char,
    room: usize,
    wanted: *mut usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { edge::message(builder, |b| &b.message, buffer, room, wanted) }
}

calls![
    /// Adds a folder with packages, for `package://name/..` in files that are read afterwards.
    fn lw_builder_packages(d: &mut LwBuilder, folder: &str) {
        d.options.package_paths.push(PathBuf::from(folder));
    }

    /// Keeps the loops and couplings of the robot, such as joints that mimic others. Call it before the robot is read. `lw_whole_body_ik_solve` and
    /// `lw_whole_body_ik_best` keep them closed. Kinematics, collisions, masses and forces are those of the tree at the given q, as if every coordinate had
    /// its own motor. Functions that would open a loop return `LW_STATUS_DOES_NOT_CLOSE`: searches, rates and paths of a chain that takes part in one,
    /// paths between configurations, tasks, operational space, predictions and transfers. `lw_robot_path_free` and `lw_timing_plan` support linear
    /// couplings, such as joints that mimic others; in the latter these joints have no motor.
    fn lw_builder_keep_closures(d: &mut LwBuilder) {
        if d.description.is_some() {
            let text = "the robot was read without its loops and couplings\n  help: call lw_builder_keep_closures before lw_builder_robot_file";
            return Err(Fault::Model(text.into()));
        }
        d.spec.closures = Closures::Kept;
    }

    /// Reads the robot from a URDF, MJCF or SDF file. `root`: one of `LW_ROOT_...`; `inertia`: one of `LW_INERTIA_...`. Loops and couplings, such as
    /// joints that mimic others, are errors unless `lw_builder_keep_closures` was called. Call `lw_builder_file_shapes` to add the shapes of the file.
    fn lw_builder_robot_file(d: &mut LwBuilder, path: *const c_char, root: u32, inertia: u32) {
        let options = d.options(root, inertia)?;
        d.robot(read_file(text("path", path)?, &options).map_err(model)?)?;
    }

    /// Like `lw_builder_robot_file`, but reads the text of such a file.
    fn lw_builder_robot_text(d: &mut LwBuilder, xml: *const c_char, root: u32, inertia: u32) {
        let options = d.options(root, inertia)?;
        d.robot(read_text(text("xml", xml)?, &options).map_err(model)?)?;
    }

    /// Adds parts and disabled pairs of collisions from an SRDF file; each group is a part. Call it after the robot is read.
    fn lw_builder_groups_file(d: &mut LwBuilder, path: &str) {
        d.groups(&read_srdf_file(path).map_err(model)?)?;
    }

    /// Like `lw_builder_groups_file`, but reads the text of such a file.
    fn lw_builder_groups_text(d: &mut LwBuilder, xml: &str) {
        d.groups(&read_srdf(xml, &d.options).map_err(model)?)?;
    }

    /// Adds the collision shapes of the robot's file as colliders with their names, or `body/number`. Call it after the robot is read. Shapes that are
    /// not supported as colliders (meshes that are neither STL nor OBJ, ellipsoids) are errors: give such bodies shapes with `lw_builder_shape`,
    /// `lw_builder_hull` or `lw_builder_mesh`.
    fn lw_builder_file_shapes(d: &mut LwBuilder) {
        d.spec = d.spec.clone().shapes(d.file()?)?;
    }

    /// Adds a part: the chain of bodies after `base` (a body, or "world") up to `tip`.
    fn lw_builder_chain(d: &mut LwBuilder, name: &str, base: &str, tip: &str) {
        d.spec.parts.push(PartSpec::chain(name, base, tip));
    }

    /// Adds an object that hands may hold. It is rigid unless bodies hang on it (`lw_builder_object_body`). Mass (kg), centre of mass (3 numbers, m) and
    /// inertia about it (9 numbers, row after row, kg m^2) are in the object's axes.
    fn lw_builder_object(
        d: &mut LwBuilder,
        name: &str,
        mass: f64,
        center: *const f64,
        inertia: *const f64,
    ) {
        let mass = crate::mass_properties::mass_of(mass, center, inertia)?;
        d.spec.objects.push(ObjectSpec { name: name.to_owned(), mass });
    }

    /// Adds a collision shape at the pose `at` (NULL: at the origin) in the frame of `carrier`: a body, an object, a body that hangs on an object, or
    /// "world".
    fn lw_builder_shape(
        d: &mut LwBuilder,
        name: &str,
        carrier: &str,
        at: *const LwPose,
        shape: *const LwShape,
    ) {
        d.collider(name, carrier, at, value("shape", shape)?.checked()?)?;
    }

    /// Adds a point cloud for sensor data. Each point is a sphere with its own radius. It is empty at first and has memory for `room` points, which
    /// `lw_robot_set_points` sets. `at` and `carrier` as in `lw_builder_shape`.
    fn lw_builder_point_cloud(
        d: &mut LwBuilder,
        name: &str,
        carrier: &str,
        at: *const LwPose,
        room: usize,
    ) {
        let shape = Shape::PointCloud { points: Vec::new(), room };
        d.collider(name, carrier, at, shape)?;
    }

    /// Adds a voxel map: `cells` (3 numbers) cubes along x, y, z from the origin of its frame, with edge length `edge` (m). All cells are free at first;
    /// `lw_robot_set_cells` changes them. `at` and `carrier` as in `lw_builder_shape`.
    fn lw_builder_voxel_map(
        d: &mut LwBuilder,
        name: &str,
        carrier: &str,
        at: *const LwPose,
        cells: *const u32,
        edge: f64,
    ) {
        let cells = value("cells", cells.cast::<[u32; 3]>())?.map(|n| n as usize);
        let shape = Shape::VoxelMap { cells, edge, occupied: Vec::new() };
        d.collider(name, carrier, at, shape)?;
    }

    /// Checks everything, makes the model and writes it to `out`; free it with `lw_model_free`. The builder can be used again. The message lists all
    /// faults.
    fn lw_builder_model(d: &mut LwBuilder, out: Out<*mut LwModel>) {
        d.whole()?;
        out.set(LwModel::give(RobotModel::new(&d.spec)?));
    }
];

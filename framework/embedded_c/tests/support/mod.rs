//! A robot with two arms, made in Rust and through the C interface; both must give bit-identical results.
#![allow(dead_code, non_snake_case, clippy::unwrap_used)]

pub mod table;

use linkwork_embedded::formats::{ReadOptions, Root, read_text};
use linkwork_embedded::multibody::{BodySpec, Hinge};
use linkwork_embedded::spatial::{Force, MassProperties, Mat3, Motion, Pose, Quat, Vec3};
use linkwork_embedded::*;
use linkwork_robot::*;
use std::ffi::{CStr, CString};
use std::fmt::Write;
use std::ptr::{null, null_mut};
use std::sync::Arc;

/// Axis and offset of the six hinges of an arm.
const ARM: [(&str, [f64; 3]); 6] = [
    ("0 0 1", [0.05, 0.0, 0.5]),
    ("0 1 0", [0.0, 0.0, 0.05]),
    ("0 1 0", [0.35, 0.0, 0.0]),
    ("1 0 0", [0.1, 0.0, 0.02]),
    ("0 1 0", [0.25, 0.0, 0.0]),
    ("1 0 0", [0.08, 0.01, 0.0]),
];

/// A rotating torso with two arms: 13 hinges.
pub fn urdf() -> String {
    let mut text = String::from("<robot name='two'><link name='base'/>");
    let mut body = |name: &str, parent: &str, axis: &str, at: [f64; 3], mass: f64| {
        let [x, y, z] = at;
        let limit = "<limit lower='-2.6' upper='2.6' effort='80' velocity='2'/>";
        write!(
            text,
            "<link name='{name}'><inertial><origin xyz='0.1 0.01 0.02'/><mass value='{mass}'/>
            <inertia ixx='0.01' iyy='0.02' izz='0.025' ixy='0.001' ixz='0' iyz='0.002'/></inertial></link>
            <joint name='to_{name}' type='revolute'><parent link='{parent}'/><child link='{name}'/>
            <origin xyz='{x} {y} {z}'/><axis xyz='{axis}'/>{limit}</joint>"
        )
        .unwrap();
    };
    body("torso", "base", "0 0 1", [0.0, 0.0, 0.3], 6.0);
    for (side, y) in [("left", 0.25), ("right", -0.25)] {
        let mut parent = "torso".to_owned();
        for (k, (axis, mut at)) in ARM.into_iter().enumerate() {
            let name = if k == 5 { format!("{side}_hand") } else { format!("{side}{k}") };
            at[1] += if k == 0 { y } else { 0.0 };
            body(&name, &parent, axis, at, 2.0 - 0.2 * k as f64);
            parent = name;
        }
    }
    text + "</robot>"
}

/// A collision-free configuration.
pub const Q: [f64; 13] = [0.1, 0.2, -0.4, 0.9, 0.3, 0.5, -0.2, -0.1, -0.5, 1.0, -0.2, 0.4, 0.3];
/// Rates and accelerations.
pub const V: [f64; 13] = [0.3, -0.2, 0.5, 0.1, -0.4, 0.2, 0.6, -0.1, 0.3, -0.5, 0.2, 0.1, -0.3];
pub const VDOT: [f64; 13] = [-0.7, 0.4, 0.2, -0.9, 0.3, 0.8, -0.1, 0.5, -0.6, 0.2, 0.7, -0.2, 0.4];

const INERTIA: [f64; 9] = [0.02, 0.0, 0.001, 0.0, 0.03, 0.0, 0.001, 0.0, 0.025];
const CENTER: [f64; 3] = [0.01, -0.02, 0.03];
/// Corners of a wedge, and its triangles from outside.
pub const CORNERS: [[f64; 3]; 4] =
    [[-0.04, -0.03, -0.05], [0.06, -0.02, -0.04], [0.0, 0.05, -0.03], [0.01, 0.0, 0.07]];
pub const TRIANGLES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
const HEIGHTS: [f64; 9] = [0.0, 0.01, 0.0, 0.02, 0.05, 0.01, 0.0, 0.02, 0.03];

/// The same robot twice.
pub struct Two {
    pub model: Arc<RobotModel>,
    pub robot: Robot,
    pub m: *mut LwModel,
    pub r: *mut LwRobot,
    pub left: Part,
    pub right: Part,
    pub beam: Object,
    pub pliers: Object,
}

/// Indices of parts and objects in C.
pub const LEFT: u32 = 0;
pub const RIGHT: u32 = 1;
pub const BEAM: u32 = 0;
pub const PLIERS: u32 = 1;

impl Two {
    pub fn new() -> Self {
        let text = urdf();
        let model = in_rust(&text);
        let (m, r) = in_c(&text);
        let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
        let [beam, pliers] = ["beam", "pliers"].map(|o| model.object(o).unwrap());
        let mut two = Self { robot: Robot::new(&model), model, m, r, left, right, beam, pliers };
        two.go(&Q);
        two
    }

    /// Sets the configuration of both robots.
    pub fn go(&mut self, q: &[f64]) {
        self.robot.set_q(q).unwrap();
        // SAFETY: a handle of the library, an array of the length given.
        assert_eq!(unsafe { lw_robot_set_q(self.r, q.as_ptr(), q.len()) }, LwStatus::Ok);
    }

    /// Grasps the beam with both hands, in both robots.
    pub fn take_beam(&mut self) {
        let X = self.robot.tip_pose(self.left).unwrap() * Pose::translation(0.1, 0.02, 0.0);
        self.robot.put(self.beam, given(X)).unwrap();
        for hand in [self.left, self.right] {
            self.robot.grasp(hand, self.beam, Grasp::Here).unwrap();
        }
        // SAFETY: valid handles of the library, initialized values.
        unsafe {
            assert_eq!(lw_robot_put(self.r, BEAM, &X.into()), LwStatus::Ok);
            for hand in [LEFT, RIGHT] {
                assert_eq!(lw_robot_grasp(self.r, hand, BEAM, null()), LwStatus::Ok);
            }
        }
    }

    pub fn says(&self) -> String {
        let mut text = [0; 2048];
        // SAFETY: memory of the length given; the call ends the text with a zero.
        unsafe {
            let told = lw_robot_message(self.r, text.as_mut_ptr(), text.len(), null_mut());
            assert_eq!(told, LwStatus::Ok);
            CStr::from_ptr(text.as_ptr()).to_str().unwrap().to_owned()
        }
    }

    /// Checks that a call fails, and that its message contains `needle`.
    #[track_caller]
    pub fn refused(&self, status: LwStatus, wanted: LwStatus, needle: &str) {
        assert_eq!(status, wanted, "{}", self.says());
        assert!(self.says().contains(needle), "{needle}: {}", self.says());
    }
}

impl Drop for Two {
    fn drop(&mut self) {
        // SAFETY: each came from the library and is freed once.
        unsafe {
            lw_robot_free(self.r);
            lw_model_free(self.m);
        }
    }
}

fn in_rust(text: &str) -> Arc<RobotModel> {
    let options = ReadOptions { root: Root::Fixed, ..ReadOptions::default() };
    let mut spec = ModelSpec::from_description(&read_text(text, &options).unwrap()).unwrap();
    for (name, tip) in [("left", "left_hand"), ("right", "right_hand")] {
        spec.parts.push(PartSpec::chain(name, "torso", tip));
    }
    let mass = MassProperties::new(1.5, CENTER.into(), Mat3::from_row_slice(&INERTIA));
    for name in ["beam", "pliers"] {
        spec.objects.push(ObjectSpec { name: name.into(), mass });
    }
    let jaw = BodySpec::new("jaw", "pliers").hinge(Hinge::pin(Vec3::y())).mass(mass);
    spec.linkages.body(jaw.hinge_in_parent(Pose::translation(0.0, 0.0, 0.1)));
    let corners = || CORNERS.map(Vec3::from).to_vec();
    let hull = || Shape::ConvexHull { points: corners() };
    let mesh = Shape::Mesh { vertices: corners(), triangles: TRIANGLES.to_vec() };
    let ground =
        Shape::HeightField { x: 3, y: 3, spacing: [2.0, 2.0], heights: HEIGHTS.as_slice().into() };
    let fore = Shape::Capsule { radius: 0.04, half_length: 0.1 };
    let post = Shape::Box { half: Vec3::new(0.03, 0.04, 0.3) };
    let mut colliders = vec![
        ColliderSpec::new("left_fore", "left4", fore.clone()),
        ColliderSpec::new("right_fore", "right4", fore),
        ColliderSpec::new("left_palm", "left_hand", hull()),
        ColliderSpec::new("right_palm", "right_hand", mesh),
        ColliderSpec::new("ground", "world", ground).at(Pose::translation(0.0, 0.0, -1.0)),
        ColliderSpec::new("post", "world", post).at(Pose::translation(0.72, 0.2, 0.75)),
    ];
    let cells = [4, 4, 4];
    colliders.push(ColliderSpec::new(
        "map",
        "world",
        Shape::VoxelMap { cells, edge: 0.1, occupied: Vec::new() },
    ));
    colliders[2].coarse = Some(Shape::Sphere { radius: 0.12 });
    colliders[3].coarse = Some(hull());
    spec.colliders = colliders;
    RobotModel::new(&spec).unwrap()
}

fn in_c(text: &str) -> (*mut LwModel, *mut LwRobot) {
    let text = CString::new(text).unwrap();
    let (mut b, mut m, mut r) = (null_mut(), null_mut(), null_mut());
    let pose = |x, y, z| LwPose { position: [x, y, z], quaternion: [0.0, 0.0, 0.0, 1.0] };
    let fore = LwShape { kind: LW_SHAPE_CAPSULE, size: [0.04, 0.1, 0.0] };
    let (center, inertia) = (CENTER.as_ptr(), INERTIA.as_ptr());
    let corners = CORNERS.as_ptr().cast::<f64>();
    let world = c"world".as_ptr();
    // SAFETY: valid handles of the library, zero-terminated texts, arrays of the required lengths.
    let made = unsafe {
        assert_eq!(lw_builder_new(&mut b), LwStatus::Ok);
        [
            lw_builder_robot_text(b, text.as_ptr(), LW_ROOT_FIXED, 0),
            lw_builder_chain(b, c"left".as_ptr(), c"torso".as_ptr(), c"left_hand".as_ptr()),
            lw_builder_chain(b, c"right".as_ptr(), c"torso".as_ptr(), c"right_hand".as_ptr()),
            lw_builder_object(b, c"beam".as_ptr(), 1.5, center, inertia),
            lw_builder_object(b, c"pliers".as_ptr(), 1.5, center, inertia),
            lw_builder_object_body(
                b,
                c"jaw".as_ptr(),
                c"pliers".as_ptr(),
                &LwHinge {
                    kind: LW_HINGE_PIN,
                    axis: [0.0, 1.0, 0.0],
                    second: [0.0; 3],
                    pitch: 0.0,
                },
                &pose(0.0, 0.0, 0.1),
                1.5,
                center,
                inertia,
            ),
            lw_builder_shape(b, c"left_fore".as_ptr(), c"left4".as_ptr(), null(), &fore),
            lw_builder_shape(b, c"right_fore".as_ptr(), c"right4".as_ptr(), null(), &fore),
            lw_builder_hull(b, c"left_palm".as_ptr(), c"left_hand".as_ptr(), null(), corners, 4),
            lw_builder_mesh(
                b,
                c"right_palm".as_ptr(),
                c"right_hand".as_ptr(),
                null(),
                corners,
                4,
                TRIANGLES.as_ptr().cast(),
                4,
            ),
            lw_builder_height_field(
                b,
                c"ground".as_ptr(),
                world,
                &pose(0.0, 0.0, -1.0),
                3,
                3,
                [2.0, 2.0].as_ptr(),
                HEIGHTS.as_ptr(),
                9,
            ),
            lw_builder_shape(
                b,
                c"post".as_ptr(),
                world,
                &pose(0.72, 0.2, 0.75),
                &LwShape { kind: LW_SHAPE_BOX, size: [0.03, 0.04, 0.3] },
            ),
            lw_builder_voxel_map(b, c"map".as_ptr(), world, null(), [4, 4, 4].as_ptr(), 0.1),
            lw_builder_coarse(
                b,
                c"left_palm".as_ptr(),
                &LwShape { kind: LW_SHAPE_SPHERE, size: [0.12, 0.0, 0.0] },
            ),
            lw_builder_coarse_hull(b, c"right_palm".as_ptr(), corners, 4),
            lw_builder_model(b, &mut m),
            lw_robot_new(m, &mut r),
        ]
    };
    assert_eq!(made, [LwStatus::Ok; 17]);
    // SAFETY: it came from the library and is freed once.
    unsafe { lw_builder_free(b) };
    (m, r)
}

/// Null-space objectives and settings of a search, in C and in Rust.
pub fn likes(starts: usize) -> (LwPrefer, Prefer) {
    let prefer =
        Prefer { centred: 1.0, near: 0.2, manipulable: 0.3, length: 0.5, starts, steps: 60 };
    let Prefer { centred, near, manipulable, length, starts, steps } = prefer;
    (LwPrefer { centred, near, manipulable, length, starts, steps }, prefer)
}

/// Checks that a call succeeds and does not allocate.
#[track_caller]
pub fn quiet(call: impl FnOnce() -> LwStatus) {
    let mut status = LwStatus::Panicked;
    let counted = allocation_counter::measure(|| status = call());
    assert_eq!((status, counted.count_total), (LwStatus::Ok, 0));
}

/// Checks that a call succeeds, and does not allocate after its first call.
#[track_caller]
pub fn settled(mut call: impl FnMut() -> LwStatus) {
    assert_eq!(call(), LwStatus::Ok);
    quiet(call);
}

/// Checks that all codes report NULL.
#[track_caller]
pub fn all_null(codes: &[LwStatus]) {
    for (k, code) in codes.iter().enumerate() {
        assert_eq!(*code, LwStatus::Null, "call {k}");
    }
}

/// Returns the bits of numbers.
pub fn bits(x: &[f64]) -> Vec<u64> {
    x.iter().map(|x| x.to_bits()).collect()
}

/// Checks that numbers are bit-identical and not all zero.
#[track_caller]
pub fn same(c: &[f64], rust: &[f64]) {
    assert!(rust.iter().any(|x| *x != 0.0), "nothing to compare");
    assert_eq!(bits(c), bits(rust), "\n{c:?}\n{rust:?}");
}

pub fn same_pose(c: &LwPose, rust: &Pose) {
    let rust = LwPose::from(*rust);
    same(
        &[&c.position[..], &c.quaternion].concat(),
        &[&rust.position[..], &rust.quaternion].concat(),
    );
}

pub fn same_wrench(c: &LwWrench, rust: &Force) {
    let all = |m: &[f64], f: &[f64]| [m, f].concat();
    same(&all(&c.moment, &c.force), &all(rust.moment.as_slice(), rust.force.as_slice()));
}

/// Compares the wrenches of both hands.
pub fn same_wrenches(c: &[LwWrench; 2], rust: &[Force; 2]) {
    c.iter().zip(rust).for_each(|(c, rust)| same_wrench(c, rust));
}

pub fn six(x: &[f64; 6]) -> Motion {
    Motion::new(Vec3::new(x[0], x[1], x[2]), Vec3::new(x[3], x[4], x[5]))
}

/// Returns a pose as the interface receives it: with the quaternion normalized once more.
pub fn given(X: Pose) -> Pose {
    Pose::new(Quat::from_quaternion(X.rotation.into_inner()), X.position)
}

pub fn turned() -> Pose {
    Pose::new(Quat::from_euler_angles(0.2, 0.5, -0.3), Vec3::new(0.6, 0.3, 0.5))
}

//! The C interface: the header matches the functions, errors are codes with messages, and calls after set-up do not allocate.

use crate::support::table;
use linkwork_embedded::spatial::{Pose, Quat, nalgebra};
use linkwork_robot::*;
use std::ffi::{CStr, CString, c_char};
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};

/// A goal without any components.
const NOWHERE: LwGoal = LwGoal {
    pose: LwPose { position: [0.0; 3], quaternion: [0.0; 4] },
    weights: [1.0; 2],
    parts: 0,
    direction: [0.0; 3],
    axis: [0.0; 3],
    towards: [0.0; 3],
    within: 0.0,
};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn the_header_is_what_cbindgen_makes() {
    use cbindgen::{Builder, Config, DocumentationStyle, EnumConfig, Language, RenameRule};
    let config = Config {
        language: Language::C,
        header: Some(
            "/* The embedded robot model for C11: see README.md. Made of the Rust sources by cbindgen: a change here is lost. */"
                .into(),
        ),
        include_guard: Some("LINKWORK_ROBOT_H".into()),
        no_includes: true,
        sys_includes: ["stdbool.h", "stddef.h", "stdint.h"].map(String::from).to_vec(),
        cpp_compat: true,
        usize_is_size_t: true,
        documentation_style: DocumentationStyle::C99,
        enumeration: EnumConfig {
            rename_variants: RenameRule::QualifiedScreamingSnakeCase,
            ..EnumConfig::default()
        },
        ..Config::default()
    };
    let mut builder = Builder::new().with_config(config);
    let set_up = ["status", "edge", "builder", "mechanism", "shape", "rules", "model", "robot"];
    let calls = [
        "task",
        "control",
        "reach",
        "together",
        "hold",
        "dual",
        "mass",
        "collide",
        "path",
        "timing",
        "priorities",
    ];
    let scratch = tempfile::tempdir().unwrap();
    for file in set_up.into_iter().chain(calls) {
        let source = std::fs::read_to_string(folder().join(format!("src/{file}.rs"))).unwrap();
        let path = scratch.path().join(format!("{file}.rs"));
        std::fs::write(&path, table::expand(&source)).unwrap();
        builder = builder.with_src(path);
    }
    let mut made = Vec::new();
    builder.generate().unwrap().write(&mut made);
    let made = String::from_utf8(made).unwrap();
    let committed = std::fs::read_to_string(folder().join("include/linkwork/robot.h"));
    if committed.unwrap_or_default() != made {
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("robot.h");
        std::fs::write(&path, made).unwrap();
        panic!(
            "include/linkwork/robot.h is not what the sources say\n  help: cp {} {}",
            path.display(),
            folder().join("include/linkwork/robot.h").display()
        );
    }
}

fn c(text: &str) -> CString {
    CString::new(text).unwrap()
}

/// Returns a text of the library.
fn said(call: impl Fn(*mut c_char, usize, *mut usize) -> LwStatus) -> String {
    let mut wanted = 0;
    assert_eq!(call(null_mut(), 0, &mut wanted), LwStatus::Length);
    let mut short = vec![7; wanted];
    // If the buffer is one byte too short, the call writes the truncated text and a terminating zero, and nothing beyond the buffer.
    if wanted > 1 {
        assert_eq!(call(short.as_mut_ptr(), wanted - 1, null_mut()), LwStatus::Length);
        assert_eq!((short[wanted - 2], short[wanted - 1]), (0, 7));
    }
    assert_eq!(call(short.as_mut_ptr(), wanted, null_mut()), LwStatus::Ok);
    // SAFETY: the call ended the text with a zero.
    unsafe { CStr::from_ptr(short.as_ptr()) }.to_str().unwrap().to_owned()
}

/// Handles of the example's robot with a cup, freed when dropped.
struct Scene {
    builder: *mut LwBuilder,
    model: *mut LwModel,
    robot: *mut LwRobot,
}

impl Scene {
    fn new() -> Self {
        let mut s = Self { builder: null_mut(), model: null_mut(), robot: null_mut() };
        let file = |name: &str| c(folder().join("examples").join(name).to_str().unwrap());
        let (zero, inertia) = ([0.0; 3], [2e-3, 0.0, 0.0, 0.0, 2e-3, 0.0, 0.0, 0.0, 1e-3]);
        let can = LwShape { kind: LW_SHAPE_SPHERE, size: [0.05, 0.0, 0.0] };
        // SAFETY: valid handles of the library, zero-terminated texts, arrays of the required lengths.
        unsafe {
            let ok = LwStatus::Ok;
            assert_eq!(lw_builder_new(&mut s.builder), ok);
            let b = s.builder;
            assert_eq!(lw_builder_robot_file(b, file("arm.urdf").as_ptr(), LW_ROOT_FIXED, 0), ok);
            assert_eq!(lw_builder_groups_file(b, file("arm.srdf").as_ptr()), ok);
            assert_eq!(lw_builder_file_shapes(b), ok);
            let cup = c("cup");
            let made = lw_builder_object(b, cup.as_ptr(), 0.4, zero.as_ptr(), inertia.as_ptr());
            assert_eq!(made, ok);
            let name = c("can");
            assert_eq!(lw_builder_shape(b, name.as_ptr(), cup.as_ptr(), null(), &can), ok);
            assert_eq!(lw_builder_model(b, &mut s.model), ok, "{}", s.builder_says());
            assert_eq!(lw_robot_new(s.model, &mut s.robot), ok);
        }
        s
    }

    fn builder_says(&self) -> String {
        // SAFETY: `said` passes memory of the length that it states; the same applies below.
        said(|b, n, w| unsafe { lw_builder_message(self.builder, b, n, w) })
    }

    fn model_says(&self) -> String {
        // SAFETY: as above.
        said(|b, n, w| unsafe { lw_model_message(self.model, b, n, w) })
    }

    fn robot_says(&self) -> String {
        // SAFETY: as above.
        said(|b, n, w| unsafe { lw_robot_message(self.robot, b, n, w) })
    }
}

impl Drop for Scene {
    fn drop(&mut self) {
        // SAFETY: each came from the library and is freed once, in any order.
        unsafe {
            lw_model_free(self.model);
            lw_builder_free(self.builder);
            lw_robot_free(self.robot);
        }
    }
}

#[test]
fn null_is_a_code_wherever_it_is_given() {
    let s = Scene::new();
    let (r, m, b) = (s.robot, s.model, s.builder);
    let (mut x, mut id, mut n) = ([0.1; 18], 0_u32, 0_usize);
    let p = x.as_mut_ptr();
    let pose = LwPose { position: [0.0; 3], quaternion: [0.0, 0.0, 0.0, 1.0] };
    let goal = LwGoal { pose, weights: [1.0; 2], parts: LW_GOAL_POSITION, ..NOWHERE };
    let shape = LwShape { kind: 0, size: [1.0, 0.0, 0.0] };
    let a = c("arm");
    // SAFETY: every pointer that is not NULL is valid.
    let codes = unsafe {
        lw_builder_free(null_mut());
        lw_model_free(null_mut());
        lw_robot_free(null_mut());
        [
            lw_builder_new(null_mut()),
            lw_builder_message(null(), null_mut(), 0, null_mut()),
            lw_builder_message(b, null_mut(), 8, null_mut()),
            lw_builder_packages(b, null()),
            lw_builder_robot_file(null_mut(), a.as_ptr(), 0, 0),
            lw_builder_groups_file(b, null()),
            lw_builder_groups_text(b, null()),
            lw_builder_file_shapes(null_mut()),
            lw_builder_chain(b, a.as_ptr(), null(), a.as_ptr()),
            lw_builder_object(b, a.as_ptr(), 1.0, p, null()),
            lw_builder_object(b, a.as_ptr(), 1.0, null(), p),
            lw_builder_shape(b, a.as_ptr(), a.as_ptr(), null(), null()),
            lw_builder_shape(b, null(), a.as_ptr(), null(), &shape),
            lw_builder_ignore(b, null(), a.as_ptr()),
            lw_builder_collide(b, a.as_ptr(), null()),
            lw_builder_apart(b, null(), 1),
            lw_builder_apart(b, &null(), 1),
            lw_builder_body(b, a.as_ptr(), null(), null(), null(), 0.0, p, p),
            lw_builder_body(b, a.as_ptr(), a.as_ptr(), null(), null(), 0.0, null(), p),
            lw_builder_limits(b, null(), 0.0, 1.0, 1.0, 1.0),
            lw_builder_coarse_mesh(b, null(), p, 3, &0, 0),
            lw_builder_coarse_mesh(b, a.as_ptr(), null(), 3, &0, 0),
            lw_builder_coarse_voxel_map(b, a.as_ptr(), null(), 0.1, null(), 0),
            lw_builder_model(b, null_mut()),
            lw_builder_model(null_mut(), null_mut()),
            lw_model_clone(m, null_mut()),
            lw_model_clone(null(), null_mut()),
            lw_model_message(null(), null_mut(), 0, null_mut()),
            lw_model_unused(null(), null_mut(), 0, null_mut()),
            lw_model_doubtful(null(), null_mut(), 0, null_mut()),
            lw_model_hinge(m, 0, &mut n, null_mut(), &mut 0, &mut 0),
            lw_model_object_hinge(m, 0, 0, &mut n, &mut 0, &mut 0, null_mut()),
            lw_model_sizes(m, null_mut(), &mut n),
            lw_model_sizes(m, &mut n, null_mut()),
            lw_model_part(m, null(), &mut id),
            lw_model_part(m, a.as_ptr(), null_mut()),
            lw_model_object(null(), a.as_ptr(), &mut id),
            lw_model_body(m, null(), &mut id),
            lw_model_collider(m, a.as_ptr(), null_mut()),
            lw_model_collider_name(m, 0, null_mut(), 9, null_mut()),
            lw_model_joint(m, a.as_ptr(), &mut n, null_mut()),
            lw_model_part_size(m, 0, null_mut()),
            lw_model_part_dofs(m, 0, null_mut(), 3),
            lw_model_limits(m, null_mut(), p, 3),
            lw_robot_new(m, null_mut()),
            lw_robot_new(null(), null_mut()),
            lw_robot_clone(r, null_mut()),
            lw_robot_message(null(), null_mut(), 0, null_mut()),
            lw_robot_q(r, null_mut(), 3),
            lw_robot_set_q(r, null(), 3),
            lw_robot_set_q(null_mut(), p, 3),
            lw_robot_clamp(r, null_mut(), 3),
            lw_robot_set_gravity(r, null()),
            lw_robot_tip_pose(r, 0, null_mut()),
            lw_robot_body_pose(r, 0, null_mut()),
            lw_robot_jacobian(r, 0, null_mut(), 18),
            lw_robot_whole_jacobian(r, 0, null_mut(), 18),
            lw_effort_default(null_mut()),
            lw_robot_inverse_kinematics(r, 0, null(), null(), p, 3, null_mut()),
            lw_robot_inverse_kinematics(r, 0, &goal, null(), p, 3, null_mut()),
            lw_robot_resume_inverse_kinematics(r, 0, 1, p, 3, null_mut()),
            lw_robot_inverse_kinematics_all(r, 0, -1, null(), p, 3, p.add(3), 1, null_mut()),
            lw_robot_inverse_kinematics_all(r, 0, -1, &goal, null(), 3, p.add(3), 1, &mut 0),
            lw_robot_inverse_kinematics_all(r, 0, -1, &goal, p, 3, null_mut(), 1, &mut 0),
            lw_robot_feed_forward(r, null(), p, 3, null(), 0, p.add(3)),
            lw_robot_feed_forward(r, p, p, 3, null(), 0, null_mut()),
            lw_robot_feed_forward(r, p, p, 3, null(), 1, p.add(3)),
            lw_robot_held_still(r, null(), 0, null_mut(), 3),
            lw_robot_mass_matrix(r, null_mut(), 9),
            lw_robot_center_of_mass(r, p, null_mut()),
            lw_robot_object_pose(r, 0, null_mut()),
            lw_robot_put(r, 0, null()),
            lw_robot_grasp(null_mut(), 0, 0, null()),
            lw_robot_update_grasp(r, 0, 0, null()),
            lw_robot_release(null_mut(), 0, 0),
            lw_robot_ungrasp(null_mut(), 0),
            lw_robot_collides(r, p, 3, null_mut(), null_mut()),
            lw_robot_clearance(r, p, 3, 1.0, null_mut()),
            lw_robot_pad(null_mut(), 0, 0.0),
            lw_robot_hide(null_mut(), 0),
            lw_robot_show(null_mut(), 0),
            lw_robot_look_at(null_mut(), 0, 1),
            lw_robot_allow(null_mut(), 0, 1),
            lw_robot_by_rule(null_mut(), 0, 1),
        ]
    };
    for (k, code) in codes.into_iter().enumerate() {
        assert_eq!(code, LwStatus::Null, "call {k}");
    }
    assert_eq!(x, [0.1; 18], "nothing was written");
}

#[test]
fn mistakes_are_codes_with_messages() {
    let s = Scene::new();
    let (r, m, b) = (s.robot, s.model, s.builder);
    let mut x = [0.1; 18];
    let p = x.as_mut_ptr();
    let pose = |z, w| LwPose { position: [0.3, 0.0, z], quaternion: [0.0, 0.0, 0.0, w] };
    let goal = |parts, weight| {
        let (pose, weights) = (pose(0.3, 2.0), [weight, 1.0]);
        LwGoal { pose, weights, parts, ..NOWHERE }
    };
    let nan = [0.0, f64::NAN, 0.0];
    let (mut id, mut n, mut hit) = (9_u32, 0_usize, true);
    let mut answer = LwAnswer {
        position: 0.0,
        orientation: 0.0,
        kinematics: 0,
        restart: 0,
        outcome: LwOutcome::Met,
    };
    let mut effort = LwEffort { tolerances: [0.0; 2], steps: 0, restarts: 0, kinematics: 0 };
    let push = LwPush { moment: nan, force: [0.0; 3], at: [0.0; 3], part: 0 };
    let far = LwPush { part: 5, moment: [0.0; 3], ..push };
    let pushes = [far; 2];
    let mut closest = std::mem::MaybeUninit::uninit();
    let robot = |status, wanted, needles: &[&str]| {
        assert_eq!(status, wanted, "{}", s.robot_says());
        let text = s.robot_says();
        needles.iter().for_each(|n| assert!(text.contains(n), "{n}: {text}"));
    };
    // SAFETY: handles of the library; arrays have the lengths given, or the call rejects the length before it reads; unaligned addresses point to
    // existing memory.
    unsafe {
        use LwStatus::*;
        robot(lw_robot_set_q(r, p, 2), Length, &["`q` has 2 numbers, expected 3", "help"]);
        robot(lw_robot_set_q(r, p, usize::MAX), Length, &["`q`"]);
        robot(lw_robot_set_q(r, nan.as_ptr(), 3), NotFinite, &["number 1 of `q` is NaN"]);
        let odd = p.cast::<u8>().add(3).cast::<f64>();
        robot(lw_robot_set_q(r, odd, 3), Misaligned, &["`q` is not aligned"]);
        robot(lw_robot_q(r, odd, 3), Misaligned, &["`q`"]);
        robot(lw_robot_jacobian(r, 0, p, 17), Length, &["`J` has 17 numbers, expected 18"]);
        robot(lw_robot_jacobian(r, 1, p, 18), Foreign, &["handle"]);
        robot(lw_robot_mass_matrix(r, p, 3), Length, &["`M`"]);
        robot(lw_robot_set_gravity(r, nan.as_ptr()), NotFinite, &["`g`"]);
        robot(lw_robot_feed_forward(r, p, p, 3, null(), 0, p.add(2)), Overlap, &["`v` and `tau`"]);
        let one = p.add(6);
        let ff =
            |push: &[LwPush]| lw_robot_feed_forward(r, p, p, 3, push.as_ptr(), push.len(), one);
        robot(ff(&[push]), NotFinite, &["`moment`"]);
        robot(ff(&[far]), Foreign, &[]);
        robot(ff(&pushes), NoRoom, &["2 pushes", "memory is reserved for 1"]);
        let reach = |g: &LwGoal, e: *const LwEffort, a: *mut LwAnswer| {
            lw_robot_inverse_kinematics(r, 0, g, e, p, 3, a)
        };
        let (a, default) = (&raw mut answer, null());
        robot(reach(&goal(0, 1.0), default, a), OutOfRange, &["give a position"]);
        robot(reach(&goal(128, 1.0), default, a), OutOfRange, &["`parts` is 128", "LW_GOAL_"]);
        robot(reach(&goal(LW_GOAL_ORIENTATION, 1.0), default, a), OutOfRange, &["quaternion", "2"]);
        robot(reach(&goal(LW_GOAL_POSITION, 0.0), default, a), OutOfRange, &["weight"]);
        robot(reach(&goal(LW_GOAL_POSITION, 1.0), &effort, a), OutOfRange, &["tolerance"]);
        robot(
            lw_robot_resume_inverse_kinematics(r, 0, 5, p, 3, a),
            NoSearch,
            &["`inverse_kinematics`"],
        );
        p.write(3.5);
        let outside = reach(&goal(LW_GOAL_POSITION, 1.0), default, a);
        robot(outside, OutsideLimits, &["coordinate 0 starts at 3.5", "-3 … 3"]);
        p.write(0.1);
        robot(lw_robot_put(r, 0, &pose(f64::INFINITY, 1.0)), NotFinite, &["`position`"]);
        robot(lw_robot_grasp(r, 0, 0, &pose(0.0, 0.0)), OutOfRange, &["length 1"]);
        robot(lw_robot_ungrasp(r, 0), NotHeld, &[]);
        robot(lw_robot_ungrasp(r, 1), Foreign, &[]);
        assert_eq!(lw_robot_grasp(r, 0, 0, null()), Ok);
        robot(lw_robot_put(r, 0, &pose(0.0, 1.0)), Held, &["object 0"]);
        assert_eq!(lw_robot_ungrasp(r, 0), Ok);
        robot(lw_robot_collides(r, nan.as_ptr(), 3, &mut hit, null_mut()), NotFinite, &[]);
        robot(lw_robot_clearance(r, p, 3, f64::NAN, closest.as_mut_ptr()), OutOfRange, &["limit"]);
        robot(lw_robot_pad(r, 0, -1.0), OutOfRange, &["padding"]);
        robot(lw_robot_hide(r, 99), Foreign, &[]);
        robot(lw_robot_look_at(r, 0, 99), Foreign, &[]);
        assert_eq!(lw_effort_default(&mut effort), Ok);
        assert_eq!(reach(&goal(LW_GOAL_POSITION, 1.0), &effort, a), Ok);
        assert_eq!(answer.outcome, LwOutcome::Met);

        let model = |status, wanted, needles: &[&str]| {
            assert_eq!(status, wanted);
            let text = s.model_says();
            needles.iter().for_each(|n| assert!(text.contains(n), "{n}: {text}"));
        };
        let name = c("amr");
        let (name, out) = (name.as_ptr(), &raw mut id);
        model(lw_model_part(m, name, out), Unknown, &["no part `amr`", "one of: arm"]);
        model(lw_model_object(m, name, out), Unknown, &["one of: cup"]);
        model(lw_model_body(m, name, out), Unknown, &["one of: base"]);
        model(lw_model_collider(m, name, out), Unknown, &["can, foot"]);
        model(lw_model_joint(m, name, &mut n, &mut n), Unknown, &["no joint `amr`"]);
        model(lw_model_part(m, c"\xff".as_ptr(), out), Text, &["`name` is not UTF-8"]);
        model(lw_model_part_size(m, 7, &mut n), Foreign, &[]);
        model(lw_model_limits(m, p, p, 3), Overlap, &["`lower` and `upper`"]);
        assert_eq!(id, 9, "nothing was written");

        let builder = |status, wanted, needles: &[&str]| {
            assert_eq!(status, wanted);
            let text = s.builder_says();
            needles.iter().for_each(|n| assert!(text.contains(n), "{n}: {text}"));
        };
        let text = c"<robot/>".as_ptr();
        builder(lw_builder_robot_text(b, text, 0, 0), Model, &["already has a robot"]);
        let kind = |kind, size| LwShape { kind, size };
        let shape = |s: LwShape| lw_builder_shape(b, name, c"world".as_ptr(), null(), &s);
        builder(shape(kind(9, [1.0; 3])), OutOfRange, &["`kind` is 9", "LW_SHAPE_"]);
        builder(shape(kind(LW_SHAPE_SPHERE, [1.0; 3])), Model, &["to zero"]);
        let (mut other, mut made) = (null_mut(), null_mut());
        assert_eq!(lw_builder_new(&mut other), Ok);
        assert_eq!(lw_builder_file_shapes(other), Model);
        assert_eq!(lw_builder_robot_text(other, text, 4, 0), OutOfRange);
        assert_eq!(lw_builder_robot_text(other, text, 0, 3), OutOfRange);
        assert_eq!(lw_builder_robot_file(other, c"nowhere.urdf".as_ptr(), 0, 0), Model);
        assert_eq!(lw_builder_model(other, &mut made), Model);
        let says = said(|b, n, w| lw_builder_message(other, b, n, w));
        assert!(says.contains("no robot yet") && made.is_null(), "{says}");
        lw_builder_free(other);
        // The model build reports all errors at once.
        assert_eq!(lw_builder_chain(b, c"leg".as_ptr(), c"base".as_ptr(), c"foot".as_ptr()), Ok);
        assert_eq!(lw_builder_chain(b, c"arm".as_ptr(), c"base".as_ptr(), c"hand".as_ptr()), Ok);
        let needles = ["part `leg` refers to the body `foot`", "two parts with the name `arm`"];
        builder(lw_builder_model(b, &mut made), Model, &needles);
    }
}

/// Results of a Rust robot pass through the interface unchanged, and settings are returned as given.
#[test]
fn names_settings_and_handles_go_through() {
    let s = Scene::new();
    let (r, m) = (s.robot, s.model);
    // SAFETY: valid handles of the library, zero-terminated texts, arrays of the lengths given.
    unsafe {
        let version = CStr::from_ptr(lw_version()).to_str().unwrap();
        assert_eq!(version, env!("CARGO_PKG_VERSION"));
        let (mut nq, mut nv, mut part, mut body, mut elbow) = (0, 0, 9, 9, (9, 9));
        assert_eq!(lw_model_sizes(m, &mut nq, &mut nv), LwStatus::Ok);
        assert_eq!(lw_model_part(m, c"arm".as_ptr(), &mut part), LwStatus::Ok);
        assert_eq!(lw_model_body(m, c"hand".as_ptr(), &mut body), LwStatus::Ok);
        let joint = lw_model_joint(m, c"elbow".as_ptr(), &mut elbow.0, &mut elbow.1);
        assert_eq!((joint, nq, nv, elbow), (LwStatus::Ok, 3, 3, (2, 2)));
        let (mut count, mut dofs) = (0, [9; 3]);
        assert_eq!(lw_model_part_size(m, part, &mut count), LwStatus::Ok);
        assert_eq!(lw_model_part_dofs(m, part, dofs.as_mut_ptr(), count), LwStatus::Ok);
        assert_eq!(dofs, [0, 1, 2]);
        let (mut lower, mut upper) = ([0.0; 3], [0.0; 3]);
        let told = lw_model_limits(m, lower.as_mut_ptr(), upper.as_mut_ptr(), 3);
        assert_eq!((told, lower, upper), (LwStatus::Ok, [-3.0, -1.0, -2.5], [3.0, 2.0, 2.5]));
        // The tip and the body of the hand have one frame. A clone is an independent robot.
        let mut q = [5.0, 0.2, 0.4];
        assert_eq!(lw_robot_clamp(r, q.as_mut_ptr(), 3), LwStatus::Ok);
        assert_eq!(q, [3.0, 0.2, 0.4]);
        assert_eq!(lw_robot_set_q(r, q.as_ptr(), 3), LwStatus::Ok);
        let zero = LwPose { position: [0.0; 3], quaternion: [0.0; 4] };
        let (mut a, mut b, mut held, mut other) = (zero, zero, zero, null_mut());
        assert_eq!(lw_robot_tip_pose(r, part, &mut a), LwStatus::Ok);
        assert_eq!(lw_robot_body_pose(r, body, &mut b), LwStatus::Ok);
        let near = |x: &[f64], y: &[f64]| x.iter().zip(y).all(|(x, y)| (x - y).abs() < 1e-14);
        assert!(near(&a.position, &b.position) && near(&a.quaternion, &b.quaternion));
        let at = LwPose { position: [0.1, 0.0, 0.0], quaternion: [0.0, 0.6, 0.0, 0.8] };
        assert_eq!(lw_robot_grasp(r, part, 0, &at), LwStatus::Ok);
        assert_eq!(lw_robot_clone(r, &mut other), LwStatus::Ok);
        assert_eq!(lw_robot_ungrasp(r, 0), LwStatus::Ok);
        assert_eq!(lw_robot_set_q(r, [0.0; 3].as_ptr(), 3), LwStatus::Ok);
        assert_eq!(lw_robot_object_pose(other, 0, &mut held), LwStatus::Ok);
        let quat = |p: &LwPose| {
            let [x, y, z, w] = p.quaternion;
            Quat::from_quaternion(nalgebra::Quaternion::new(w, x, y, z))
        };
        let X = Pose::new(quat(&a), a.position.into()) * Pose::new(quat(&at), at.position.into());
        assert!(near(&held.position, X.position.as_slice()));
        assert!(near(&held.quaternion, X.rotation.coords.as_slice()));
        // The can in the palm is found if its pair is checked, and not found if it is hidden.
        let (mut can, mut palm, mut hit) = (9, 9, false);
        assert_eq!(lw_model_collider(m, c"can".as_ptr(), &mut can), LwStatus::Ok);
        assert_eq!(lw_model_collider(m, c"palm".as_ptr(), &mut palm), LwStatus::Ok);
        let close = LwPose { position: [0.08, 0.0, 0.0], quaternion: [0.0, 0.0, 0.0, 1.0] };
        assert_eq!(lw_robot_update_grasp(other, part, 0, &close), LwStatus::Ok);
        let mut asked = |wanted: bool, pair: Option<(u32, u32)>| {
            let mut found = LwPair { a: 9, b: 9 };
            let p = q.as_ptr();
            assert_eq!(lw_robot_collides(other, p, 3, &mut hit, &mut found), LwStatus::Ok);
            assert_eq!((hit, (found.a, found.b)), (wanted, pair.unwrap_or((9, 9))));
        };
        asked(false, None);
        assert_eq!(lw_robot_look_at(other, can, palm), LwStatus::Ok);
        asked(true, Some((can, palm)));
        assert_eq!(lw_robot_hide(other, can), LwStatus::Ok);
        asked(false, None);
        assert_eq!(lw_robot_show(other, can), LwStatus::Ok);
        asked(true, Some((can, palm)));
        assert_eq!(lw_robot_allow(other, can, palm), LwStatus::Ok);
        asked(false, None);
        assert_eq!(lw_robot_look_at(other, can, palm), LwStatus::Ok);
        assert_eq!(lw_robot_by_rule(other, can, palm), LwStatus::Ok);
        asked(false, None);
        assert_eq!(lw_robot_release(other, part, 0), LwStatus::Ok);
        asked(true, Some((can, palm)));
        lw_robot_free(other);
        // A clone of a model outlives the model, and has its own message.
        let mut twin = null_mut();
        assert_eq!(lw_model_clone(m, &mut twin), LwStatus::Ok);
        assert_eq!(lw_model_part(twin, c"leg".as_ptr(), &mut part), LwStatus::Unknown);
        assert_eq!(s.model_says(), "");
        lw_model_free(twin);
        let unused = said(|b, n, w| lw_model_unused(m, b, n, w));
        assert_eq!(unused, "");
    }
}

#[test]
fn no_call_allocates_after_set_up() {
    let s = Scene::new();
    let r = s.robot;
    let pose = LwPose { position: [0.5, 0.1, 0.5], quaternion: [0.0, 0.0, 0.0, 1.0] };
    let goal = LwGoal { pose, weights: [1.0; 2], parts: LW_GOAL_POSITION, ..NOWHERE };
    let push = LwPush { moment: [1.0; 3], force: [2.0; 3], at: [0.1; 3], part: 0 };
    let (mut q, mut x, mut out, mut hit) = ([0.1; 3], [0.0; 18], pose, false);
    let mut text = [0; 300];
    let [mut a, mut b, mut c, mut d] = [0; 4];
    // SAFETY: handles of the library; arrays have the lengths given; the calls write all outputs
    // before they are read.
    unsafe {
        let mut answer = std::mem::zeroed::<LwAnswer>();
        let mut closest = std::mem::zeroed::<LwClosest>();
        let p = x.as_mut_ptr();
        let far = LwGoal { pose: LwPose { position: [9.0; 3], ..pose }, ..goal };
        let v = [0.1; 3];
        // Contact points allocate their memory here, as documented.
        assert_eq!(lw_robot_clearance(r, q.as_ptr(), 3, 9.0, &mut closest), LwStatus::Ok);
        let mut codes = [LwStatus::Panicked; 25];
        let counted = allocation_counter::measure(|| {
            codes = [
                lw_robot_set_q(r, q.as_ptr(), 3),
                lw_robot_q(r, p, 3),
                lw_robot_clamp(r, q.as_mut_ptr(), 3),
                lw_robot_set_gravity(r, [0.0, 0.0, -3.7].as_ptr()),
                lw_robot_tip_pose(r, 0, &mut out),
                lw_robot_body_pose(r, 3, &mut out),
                lw_robot_jacobian(r, 0, p, 18),
                lw_robot_whole_jacobian(r, 0, p, 18),
                lw_robot_inverse_kinematics(r, 0, &goal, null(), q.as_mut_ptr(), 3, &mut answer),
                lw_robot_inverse_kinematics(r, 0, &far, null(), q.as_mut_ptr(), 3, &mut answer),
                lw_robot_resume_inverse_kinematics(r, 0, 9, q.as_mut_ptr(), 3, &mut answer),
                lw_robot_put(r, 0, &pose),
                lw_robot_object_pose(r, 0, &mut out),
                lw_robot_grasp(r, 0, 0, null()),
                lw_robot_update_grasp(r, 0, 0, &pose),
                lw_robot_feed_forward(r, v.as_ptr(), v.as_ptr(), 3, &push, 1, p),
                lw_robot_held_still(r, &push, 1, p, 3),
                lw_robot_mass_matrix(r, p, 9),
                lw_robot_center_of_mass(r, null_mut(), p),
                lw_robot_collides(r, q.as_ptr(), 3, &mut hit, null_mut()),
                lw_robot_clearance(r, q.as_ptr(), 3, 9.0, &mut closest),
                lw_robot_pad(r, 0, 0.01),
                lw_robot_release(r, 0, 0),
                lw_robot_allow(r, 0, 1),
                lw_model_hinge(s.model, 0, &mut a, &mut b, &mut c, &mut d),
            ];
            assert_eq!(lw_robot_set_q(r, p, 2), LwStatus::Length);
            assert_eq!(lw_robot_ungrasp(r, 0), LwStatus::NotHeld);
            assert_eq!(lw_robot_set_q(r, [f64::NAN; 3].as_ptr(), 3), LwStatus::NotFinite);
            assert_eq!(lw_robot_put(r, 9, &pose), LwStatus::Foreign);
            let told = lw_robot_message(r, text.as_mut_ptr(), text.len(), null_mut());
            assert_eq!(told, LwStatus::Ok);
        });
        assert_eq!(codes, [LwStatus::Ok; 25]);
        assert_eq!(counted.count_total, 0, "{counted:?}");
    }
}

#[test]
fn threads_share_a_model() {
    let s = Scene::new();
    let address = s.model.expose_provenance();
    let ask = |k: usize| {
        let model = std::ptr::with_exposed_provenance_mut::<LwModel>(address);
        let mut out = Vec::new();
        // SAFETY: the model lives longer than the threads; each has its own robot.
        unsafe {
            let mut robot = null_mut();
            assert_eq!(lw_robot_new(model, &mut robot), LwStatus::Ok);
            for i in 0..200 {
                let q = [0.01 * i as f64, 0.1 * k as f64, 0.5];
                let (mut M, mut id) = ([0.0; 9], 0);
                assert_eq!(lw_robot_set_q(robot, q.as_ptr(), 3), LwStatus::Ok);
                assert_eq!(lw_robot_mass_matrix(robot, M.as_mut_ptr(), 9), LwStatus::Ok);
                assert_eq!(lw_model_part(model, c"leg".as_ptr(), &mut id), LwStatus::Unknown);
                let text = said(|b, n, w| lw_model_message(model, b, n, w));
                assert!(text.starts_with("there is no part `leg`"), "{text}");
                out.extend(M.map(f64::to_bits));
            }
            lw_robot_free(robot);
        }
        out
    };
    let alone: Vec<_> = (0..4).map(ask).collect();
    let together = std::thread::scope(|s| {
        let threads: Vec<_> = (0..4).map(|k| s.spawn(move || ask(k))).collect();
        threads.into_iter().map(|t| t.join().unwrap()).collect::<Vec<_>>()
    });
    assert!(together == alone);
}

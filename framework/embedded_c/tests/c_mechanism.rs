//! Mechanisms without a file, collision rules, coarse shapes and warnings through the C interface: results bit-identical with Rust, errors as codes.

use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, HingeCoordinate, Limits};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use linkwork_robot::*;
use std::ffi::{CStr, CString};
use std::ptr::{null, null_mut};
use std::sync::Arc;

const CENTER: [f64; 3] = [0.02, 0.01, 0.05];
const INERTIA: [f64; 9] = [1e-2, 0.0, 0.0, 0.0, 2e-2, 0.0, 0.0, 0.0, 1e-2];
const OK: LwStatus = LwStatus::Ok;
const FREE: f64 = f64::INFINITY;

fn mass() -> MassProperties {
    MassProperties::new(0.4, CENTER.into(), Mat3::from_row_slice(&INERTIA))
}

fn hinge(kind: u32, axis: [f64; 3]) -> LwHinge {
    LwHinge { kind, axis, second: [0.0; 3], pitch: 0.0 }
}

/// Every kind of hinge, in both languages.
fn hinges() -> Vec<(LwHinge, Hinge)> {
    let (a, b) = ([0.0, 0.6, 0.8], [1.0, 0.0, 0.0]);
    let (x, y) = (Vec3::from(a), Vec3::from(b));
    vec![
        (hinge(LW_HINGE_LOCKED, [0.0; 3]), Hinge::locked()),
        (hinge(LW_HINGE_PIN, a), Hinge::pin(x)),
        (hinge(LW_HINGE_SLIDER, a), Hinge::slider(x)),
        (LwHinge { pitch: 0.03, ..hinge(LW_HINGE_SCREW, a) }, Hinge::screw(x, 0.03)),
        (hinge(LW_HINGE_CYLINDRICAL, a), Hinge::cylindrical(x)),
        (LwHinge { second: b, ..hinge(LW_HINGE_UNIVERSAL, a) }, Hinge::universal(x, y)),
        (hinge(LW_HINGE_GIMBAL, [0.0; 3]), Hinge::gimbal()),
        (hinge(LW_HINGE_PLANAR, [0.0; 3]), Hinge::planar()),
        (hinge(LW_HINGE_BALL, [0.0; 3]), Hinge::ball()),
        (hinge(LW_HINGE_FREE, [0.0; 3]), Hinge::free()),
    ]
}

/// A builder that is freed when dropped.
struct Own(*mut LwBuilder);

impl Own {
    fn new() -> Self {
        let mut b = null_mut();
        // SAFETY: valid memory for a handle.
        assert_eq!(unsafe { lw_builder_new(&mut b) }, OK);
        Self(b)
    }

    fn body(&self, name: &str, parent: &str, hinge: &LwHinge, up: f64) -> LwStatus {
        let [name, parent] = [name, parent].map(|t| CString::new(t).unwrap());
        let at = LwPose { position: [0.0, 0.0, up], quaternion: [0.0, 0.0, 0.0, 1.0] };
        let (c, i) = (CENTER.as_ptr(), INERTIA.as_ptr());
        // SAFETY: a valid handle of the library, zero-terminated texts, arrays of the required lengths; the same
        // applies below.
        unsafe { lw_builder_body(self.0, name.as_ptr(), parent.as_ptr(), hinge, &at, 0.4, c, i) }
    }

    fn says(&self) -> String {
        let mut text = [0; 2000];
        // SAFETY: as above.
        unsafe {
            lw_builder_message(self.0, text.as_mut_ptr(), text.len(), null_mut());
            CStr::from_ptr(text.as_ptr()).to_str().unwrap().to_owned()
        }
    }

    fn ball(&self, name: &CStr, carrier: &CStr, at: [f64; 3], radius: f64) {
        let shape = LwShape { kind: LW_SHAPE_SPHERE, size: [radius, 0.0, 0.0] };
        let at = LwPose { position: at, quaternion: [0.0, 0.0, 0.0, 1.0] };
        // SAFETY: as above.
        let done =
            unsafe { lw_builder_shape(self.0, name.as_ptr(), carrier.as_ptr(), &at, &shape) };
        assert_eq!(done, OK);
    }

    /// A model and a robot of it.
    fn robot(&self) -> Made {
        let (mut m, mut r) = (null_mut(), null_mut());
        // SAFETY: as above.
        unsafe {
            assert_eq!(lw_builder_model(self.0, &mut m), OK, "{}", self.says());
            assert_eq!(lw_robot_new(m, &mut r), OK);
        }
        Made { model: m, robot: r }
    }
}

impl Drop for Own {
    fn drop(&mut self) {
        // SAFETY: it came from the library and is freed once; the same applies below.
        unsafe { lw_builder_free(self.0) }
    }
}

struct Made {
    model: *mut LwModel,
    robot: *mut LwRobot,
}

impl Made {
    fn doubtful(&self) -> String {
        let mut text = [0; 2000];
        // SAFETY: as above.
        unsafe {
            assert_eq!(
                lw_model_doubtful(self.model, text.as_mut_ptr(), text.len(), null_mut()),
                OK
            );
            CStr::from_ptr(text.as_ptr()).to_str().unwrap().to_owned()
        }
    }

    fn collides(&self, q: &[f64]) -> bool {
        let mut hit = false;
        // SAFETY: as above.
        unsafe {
            let told = lw_robot_collides(self.robot, q.as_ptr(), q.len(), &mut hit, null_mut());
            assert_eq!(told, OK);
        }
        hit
    }
}

impl Drop for Made {
    fn drop(&mut self) {
        // SAFETY: as above.
        unsafe {
            lw_robot_free(self.robot);
            lw_model_free(self.model);
        }
    }
}

#[test]
fn a_mechanism_of_every_hinge_needs_no_file() {
    let own = Own::new();
    let mut builder = Builder::new();
    let mut parent = "world".to_owned();
    for (k, (in_c, in_rust)) in hinges().iter().enumerate() {
        let name = format!("b{k}");
        assert_eq!(own.body(&name, &parent, in_c, 0.1), OK, "{}", own.says());
        let body = BodySpec::new(&name, &parent).hinge(in_rust.clone()).mass(mass());
        builder.body(body.hinge_in_parent(Pose::translation(0.0, 0.0, 0.1)));
        parent = name;
    }
    let limits = Limits { lower: -1.0, upper: 2.0, rate: 3.0, effort: 4.0 };
    builder.bodies_mut()[1].hinge = hinges()[1].1.clone().limits(limits);
    let mut spec = ModelSpec { mechanism: builder, ..ModelSpec::default() };
    let joint =
        |k: usize| (format!("b{k}"), HingeCoordinate { body: format!("b{k}"), subhinge: 0 });
    spec.joints = [1, 2, 3].map(joint).into();
    let model: Arc<RobotModel> = RobotModel::new(&spec).unwrap();
    let (nq, nv) = (model.nq(), model.nv());
    // SAFETY: valid handles of the library, zero-terminated texts, arrays of the required lengths.
    unsafe {
        let name = |k: usize| CString::new(format!("b{k}")).unwrap();
        assert_eq!(lw_builder_limits(own.0, name(1).as_ptr(), -1.0, 2.0, 3.0, 4.0), OK);
        let made = own.robot();
        let (mut n, mut v) = (0, 0);
        assert_eq!(lw_model_sizes(made.model, &mut n, &mut v), OK);
        assert_eq!((n, v), (nq, nv));
        for (k, (_, hinge)) in hinges().iter().enumerate() {
            let (mut id, mut told) = (0, [0; 4]);
            assert_eq!(lw_model_body(made.model, name(k).as_ptr(), &mut id), OK);
            let [a, b, c, d] = &mut told;
            assert_eq!(lw_model_hinge(made.model, id, a, b, c, d), OK);
            let body = model.multibody().get(model.multibody().body(&format!("b{k}")).unwrap());
            assert_eq!(told, [body.q().start, hinge.nq(), body.v().start, hinge.nv()], "{k}");
            let (mut q, mut v) = (usize::MAX, usize::MAX);
            let found = lw_model_joint(made.model, name(k).as_ptr(), &mut q, &mut v);
            match hinge.nv() {
                1 => assert_eq!((found, q, v), (OK, body.q().start, body.v().start)),
                _ => assert_eq!(found, LwStatus::Unknown, "{k}"),
            }
        }
        assert_eq!(
            lw_model_hinge(made.model, 99, &mut 0, &mut 0, &mut 0, &mut 0),
            LwStatus::Foreign
        );
        let (mut lower, mut upper) = (vec![0.0; nv], vec![0.0; nv]);
        let (l, u) = (lower.as_mut_ptr(), upper.as_mut_ptr());
        assert_eq!(lw_model_limits(made.model, l, u, nv), OK);
        assert_eq!((lower[0], upper[0]), (-1.0, 2.0));
        assert!(lower[1..].iter().all(|x| *x == -FREE) && upper[1..].iter().all(|x| *x == FREE));
        // Configuration, masses and forces are bit-identical.
        let q = model.multibody().random_q(7);
        let mut robot = Robot::new(&model);
        robot.set_q(&q).unwrap();
        assert_eq!(lw_robot_set_q(made.robot, q.as_ptr(), nq), OK);
        let (mut ours, mut theirs) = (vec![0.0; nv * nv], vec![0.0; nv * nv]);
        robot.mass_matrix(&mut ours).unwrap();
        assert_eq!(lw_robot_mass_matrix(made.robot, theirs.as_mut_ptr(), nv * nv), OK);
        let bits = |x: &[f64]| x.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&ours), bits(&theirs));
        assert!(ours.iter().all(|x| x.is_finite()) && ours[0] > 0.0);
    }
}

#[test]
fn mistakes_in_mechanisms_are_told() {
    let own = Own::new();
    let mut m = null_mut();
    // SAFETY: as above.
    assert_eq!(unsafe { lw_builder_model(own.0, &mut m) }, LwStatus::Model);
    assert!(own.says().contains("lw_builder_body"), "{}", own.says());
    let y = [0.0, 1.0, 0.0];
    let bad = |hinge: LwHinge, code, words: &str| {
        assert_eq!(own.body("a", "world", &hinge, 0.0), code, "{words}");
        assert!(own.says().contains(words), "{}", own.says());
    };
    bad(hinge(10, y), LwStatus::OutOfRange, "LW_HINGE_");
    bad(hinge(LW_HINGE_BALL, y), LwStatus::Model, "`axis`");
    bad(LwHinge { second: y, ..hinge(LW_HINGE_PIN, y) }, LwStatus::Model, "`second`");
    bad(LwHinge { pitch: 0.1, ..hinge(LW_HINGE_PIN, y) }, LwStatus::Model, "`pitch`");
    // SAFETY: as above.
    unsafe {
        let limits = lw_builder_limits(own.0, c"a".as_ptr(), 0.0, 1.0, FREE, FREE);
        assert_eq!(limits, LwStatus::Unknown);
        assert!(own.says().contains("no body `a`"), "{}", own.says());
        assert_eq!(lw_builder_neighbours(own.0, 2), LwStatus::OutOfRange);
        let cells = [2, 2, 2];
        let coarse = lw_builder_coarse_voxel_map(
            own.0,
            c"a".as_ptr(),
            cells.as_ptr(),
            0.1,
            [0, 0, 0].as_ptr(),
            1,
        );
        assert_eq!(coarse, LwStatus::Unknown);
        assert!(own.says().contains("no collider `a`"), "{}", own.says());
    }
    assert_eq!(own.body("a", "world", &hinge(LW_HINGE_PIN, y), 0.0), OK);
    assert_eq!(own.body("a", "world", &hinge(LW_HINGE_PIN, y), 0.0), LwStatus::Model);
    assert!(own.says().contains("name of a joint"), "{}", own.says());
    // SAFETY: as above.
    let file = unsafe {
        lw_builder_robot_text(own.0, c"<robot name='r'><link name='l'/></robot>".as_ptr(), 0, 0)
    };
    assert_eq!(file, LwStatus::Model);
    assert!(own.says().contains("read the file first"), "{}", own.says());
    // The model reports a zero axis and limits in the wrong order.
    let bent = Own::new();
    assert_eq!(bent.body("a", "world", &hinge(LW_HINGE_PIN, [0.0; 3]), 0.0), OK);
    // SAFETY: as above.
    unsafe {
        assert_eq!(lw_builder_limits(bent.0, c"a".as_ptr(), 1.0, 0.0, FREE, FREE), OK);
        assert_eq!(lw_builder_model(bent.0, &mut m), LwStatus::Model);
    }
    assert!(bent.says().contains("`a`"), "{}", bent.says());
}

#[test]
fn objects_have_every_hinge() {
    let own = Own::new();
    assert_eq!(own.body("arm", "world", &hinge(LW_HINGE_PIN, [0.0, 1.0, 0.0]), 0.0), OK);
    let (c, i) = (CENTER.as_ptr(), INERTIA.as_ptr());
    let mut builder = Builder::new();
    let all = &hinges()[..9];
    // SAFETY: as above.
    unsafe {
        assert_eq!(
            lw_builder_chain(own.0, c"arm".as_ptr(), c"world".as_ptr(), c"arm".as_ptr()),
            OK
        );
        assert_eq!(lw_builder_object(own.0, c"toy".as_ptr(), 0.4, c, i), OK);
        for (k, (in_c, in_rust)) in all.iter().enumerate() {
            let name = CString::new(format!("t{k}")).unwrap();
            let at = LwPose { position: [0.1, 0.0, 0.0], quaternion: [0.0, 0.0, 0.0, 1.0] };
            let (n, p) = (name.as_ptr(), c"toy".as_ptr());
            assert_eq!(lw_builder_object_body(own.0, n, p, in_c, &at, 0.4, c, i), OK);
            let body = BodySpec::new(format!("t{k}"), "toy").hinge(in_rust.clone()).mass(mass());
            builder.body(body.hinge_in_parent(Pose::translation(0.1, 0.0, 0.0)));
        }
    }
    for (ball, body) in [(c"on arm", c"arm"), (c"on t3", c"t3"), (c"on toy", c"toy")] {
        own.ball(ball, body, [0.0; 3], 0.1);
    }
    let mut spec = ModelSpec { linkages: builder, ..ModelSpec::default() };
    let pin = BodySpec::new("arm", "world").hinge(Hinge::pin(Vec3::y())).mass(mass());
    spec.mechanism.body(pin);
    spec.parts.push(PartSpec::chain("arm", "world", "arm"));
    spec.objects.push(ObjectSpec { name: "toy".into(), mass: mass() });
    let model = RobotModel::new(&spec).unwrap();
    let toy = model.object("toy").unwrap();
    let bodies = model.object_multibody(toy).unwrap();
    let (n, made) = (bodies.nq() - 7, own.robot());
    let mut robot = Robot::new(&model);
    robot.grasp(model.part("arm").unwrap(), toy, Grasp::At(Pose::identity())).unwrap();
    let own_q = bodies.random_q(3)[7..].to_vec();
    robot.set_object_q(toy, &own_q).unwrap();
    let unit = LwPose { position: [0.0; 3], quaternion: [0.0, 0.0, 0.0, 1.0] };
    // SAFETY: as above.
    unsafe {
        assert_eq!(lw_robot_grasp(made.robot, 0, 0, &unit), OK);
        assert_eq!(lw_robot_set_object_q(made.robot, 0, own_q.as_ptr(), n), OK);
        for (k, (_, hinge)) in all.iter().enumerate() {
            let (name, mut id, mut told) = (CString::new(format!("t{k}")).unwrap(), 0, [0; 4]);
            assert_eq!(lw_model_object_body(made.model, 0, name.as_ptr(), &mut id), OK);
            let [a, b, c, d] = &mut told;
            assert_eq!(lw_model_object_hinge(made.model, 0, id, a, b, c, d), OK);
            let body = bodies.get(bodies.body(&format!("t{k}")).unwrap());
            let wanted = [body.q().start - 7, hinge.nq(), body.v().start - 6, hinge.nv()];
            assert_eq!(told, wanted, "{k}");
            let mut at = unit;
            assert_eq!(lw_robot_object_body_pose(made.robot, 0, id, &mut at), OK);
            let there =
                robot.object_body_pose(toy, bodies.body(&format!("t{k}")).unwrap()).unwrap();
            assert_eq!(at, LwPose::from(there), "{k}");
        }
        let (mut id, mut told) = (9, [9; 4]);
        let [a, b, c, d] = &mut told;
        assert_eq!(lw_model_object_body(made.model, 0, c"toy".as_ptr(), &mut id), OK);
        assert_eq!(lw_model_object_hinge(made.model, 0, id, a, b, c, d), OK);
        assert_eq!(told, [0; 4], "the object itself has no joint");
        let none = lw_model_object_hinge(made.model, 0, 99, &mut 0, &mut 0, &mut 0, &mut 0);
        assert_eq!(none, LwStatus::Foreign);
        // Find colliders by name: one on the arm, one on a body of the toy, and one on the toy
        // itself.
        let (mut ids, mut count) = ([9; 3], 9);
        let p = ids.as_mut_ptr();
        assert_eq!(lw_model_object_colliders(made.model, 0, p, 3, &mut count), OK);
        assert_eq!((count, ids), (2, [1, 2, 9]));
        assert_eq!(lw_model_part_colliders(made.model, 0, p, 3, &mut count), OK);
        assert_eq!((count, ids[0]), (1, 0));
    }
}

/// Three bodies in a row, each on a slider on the previous one, with one sphere each; each sphere overlaps both others.
fn row() -> Own {
    let own = Own::new();
    let slide = hinge(LW_HINGE_SLIDER, [1.0, 0.0, 0.0]);
    for (name, parent) in [("a", "world"), ("b", "a"), ("c", "b")] {
        assert_eq!(own.body(name, parent, &slide, 0.0), OK);
    }
    for (ball, body) in [(c"in a", c"a"), (c"in b", c"b"), (c"in c", c"c")] {
        own.ball(ball, body, [0.0; 3], 0.1);
    }
    own
}

#[test]
fn rules_of_groups_and_of_neighbours() {
    // q contains the distances from a to b and from b to c; a and c are apart by their sum.
    let (all_apart, b_on_a, c_on_a) = ([0.0, 1.0, 1.0], [0.0, 0.0, 1.0], [0.0, 1.0, -1.0]);
    let asked = |own: &Own, want: [bool; 2]| {
        let made = own.robot();
        assert!(!made.collides(&all_apart));
        assert_eq!([b_on_a, c_on_a].map(|q| made.collides(&q)), want);
    };
    asked(&row(), [false, true]); // neighbours do not collide
    // SAFETY: as above.
    unsafe {
        let own = row();
        assert_eq!(lw_builder_neighbours(own.0, LW_NEIGHBOURS_COLLIDE), OK);
        asked(&own, [true, true]);
        assert_eq!(lw_builder_neighbours(own.0, LW_NEIGHBOURS_PASS), OK);
        asked(&own, [false, true]);
        assert_eq!(lw_builder_collide(own.0, c"a".as_ptr(), c"b".as_ptr()), OK);
        asked(&own, [true, true]);
        let group = [c"a".as_ptr(), c"c".as_ptr()];
        assert_eq!(lw_builder_apart(own.0, group.as_ptr(), 2), OK);
        asked(&own, [true, false]);
        assert_eq!(lw_builder_collide(own.0, c"a".as_ptr(), c"in c".as_ptr()), OK);
        asked(&own, [true, true]); // `collide` has priority over the group
        assert_eq!(lw_builder_ignore(own.0, c"a".as_ptr(), c"c".as_ptr()), OK);
        asked(&own, [true, false]); // `ignore` has priority over `collide`
        let (group, mut m) = ([c"a".as_ptr(), c"nobody".as_ptr()], null_mut());
        assert_eq!(lw_builder_apart(own.0, group.as_ptr(), 2), OK);
        assert_eq!(lw_builder_model(own.0, &mut m), LwStatus::Model);
        assert!(own.says().contains("nobody"), "{}", own.says());
    }
}

#[test]
fn meshes_and_voxels_are_coarse_shapes() {
    // The coarse shapes are a tetrahedron around a sphere of 0.05, and a block of cubes around
    // another sphere.
    let corners = [[0.3, 0.3, 0.3], [0.3, -0.3, -0.3], [-0.3, 0.3, -0.3], [-0.3, -0.3, 0.3]];
    let triangles: [[u32; 3]; 4] = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
    let own = Own::new();
    let free = hinge(LW_HINGE_SLIDER, [1.0, 0.0, 0.0]);
    assert_eq!(own.body("probe", "world", &free, 0.0), OK);
    own.ball(c"tip", c"probe", [0.0; 3], 0.05);
    own.ball(c"stone", c"world", [0.0; 3], 0.05);
    own.ball(c"pillar", c"world", [2.0, 0.0, 0.0], 0.05);
    let cells: [u32; 3] = [3, 1, 1];
    // Of three cubes along x, the first and the last are occupied: from 2.0 to 2.2 and from 2.4 to 2.6, on the tip's path.
    let occupied: [[u32; 3]; 2] = [[0, 0, 0], [2, 0, 0]];
    // SAFETY: as above.
    unsafe {
        let (v, t) = (corners.as_ptr().cast(), triangles.as_ptr().cast());
        assert_eq!(lw_builder_coarse_mesh(own.0, c"stone".as_ptr(), v, 4, t, 4), OK);
        let some = occupied.as_ptr().cast();
        let name = c"pillar".as_ptr();
        assert_eq!(lw_builder_coarse_voxel_map(own.0, name, cells.as_ptr(), 0.2, some, 2), OK);
        // The parent of the probe is the world, so the two are neighbours.
        assert_eq!(lw_builder_neighbours(own.0, LW_NEIGHBOURS_COLLIDE), OK);
        let made = own.robot();
        let at = [0.28, 1.0, 2.0, 2.3, 2.5];
        let hits = || at.map(|x| made.collides(&[x]));
        assert_eq!(hits(), [false, false, true, false, false], "their own shapes");
        assert_eq!(lw_robot_set_detail(made.robot, LW_DETAIL_COARSE), OK);
        // An edge of the mesh crosses the path at 0.3.
        assert_eq!(hits(), [true, false, true, false, true], "the coarse ones");
    }
}

#[test]
fn moments_that_no_body_has_are_read_and_told_or_refused() {
    let text = c"<robot name='r'><link name='upper'><inertial><mass value='1'/>
        <inertia ixx='-3.5e-8' iyy='1e-3' izz='1e-3' ixy='0' ixz='0' iyz='0'/></inertial></link></robot>";
    let good = c"<robot name='r'><link name='upper'/></robot>";
    // SAFETY: as above.
    unsafe {
        let own = Own::new();
        assert_eq!(lw_builder_robot_text(own.0, text.as_ptr(), LW_ROOT_FREE, LW_INERTIA_WARN), OK);
        let told = own.robot().doubtful();
        assert!(told.contains("link `upper`") && told.contains("-0.000000035"), "{told}");
        assert_eq!(told.lines().count(), 1);
        for strict in [LW_INERTIA_PHYSICAL, LW_INERTIA_POSITIVE_MOMENTS] {
            let own = Own::new();
            let code = lw_builder_robot_text(own.0, text.as_ptr(), LW_ROOT_FREE, strict);
            assert_eq!(code, LwStatus::Model);
            assert!(own.says().contains("link `upper`"), "{}", own.says());
        }
        let own = Own::new();
        assert_eq!(lw_builder_robot_text(own.0, good.as_ptr(), LW_ROOT_FIXED, LW_INERTIA_WARN), OK);
        assert_eq!(own.robot().doubtful(), "");
        assert_eq!(lw_builder_robot_text(own.0, null(), LW_ROOT_FREE, 3), LwStatus::Model);
    }
}

//! Objects with joints through the C interface: results bit-identical with Rust, errors as codes.

use linkwork_embedded::formats::{ReadOptions, Root, read_text};
use linkwork_embedded::multibody::{BodySpec, Hinge};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use linkwork_robot::*;
use std::ffi::CStr;
use std::ptr::{null, null_mut};

const ROBOT: &CStr = c"<robot name='r'><link name='base'/><link name='upper'><inertial><origin xyz='0.2 0 0'/><mass value='2'/>
    <inertia ixx='0.01' iyy='0.03' izz='0.03' ixy='0' ixz='0' iyz='0'/></inertial></link>
    <link name='hand'><inertial><origin xyz='0.1 0 0'/><mass value='1'/>
    <inertia ixx='0.01' iyy='0.02' izz='0.02' ixy='0' ixz='0' iyz='0'/></inertial></link>
    <joint name='shoulder' type='continuous'><parent link='base'/><child link='upper'/><axis xyz='0 -1 0'/></joint>
    <joint name='elbow' type='continuous'><parent link='upper'/><child link='hand'/>
    <origin xyz='0.4 0 0'/><axis xyz='0 0 1'/></joint></robot>";

#[test]
fn pliers_in_c_are_those_in_rust() {
    let (center, inertia) = ([0.02, 0.01, 0.05], [1e-3, 0.0, 0.0, 0.0, 2e-3, 0.0, 0.0, 0.0, 1e-3]);
    let mass = MassProperties::new(0.4, center.into(), Mat3::from_row_slice(&inertia));
    let options = ReadOptions { root: Root::Fixed, ..ReadOptions::default() };
    let d = read_text(ROBOT.to_str().unwrap(), &options).unwrap();
    let mut spec = ModelSpec::from_description(&d).unwrap();
    spec.parts.push(PartSpec::chain("arm", "base", "hand"));
    spec.objects.push(ObjectSpec { name: "pliers".into(), mass });
    let jaw = BodySpec::new("jaw", "pliers").hinge(Hinge::pin(Vec3::y())).mass(mass);
    spec.linkages.body(jaw.hinge_in_parent(Pose::translation(0.0, 0.0, 0.1)));
    let screw = BodySpec::new("screw", "jaw").hinge(Hinge::slider(Vec3::new(0.6, 0.0, 0.8)));
    spec.linkages.body(screw.mass(mass));
    let model = RobotModel::new(&spec).unwrap();
    let (arm, pliers) = (model.part("arm").unwrap(), model.object("pliers").unwrap());
    let mut robot = Robot::new(&model);
    let (q, v, vdot) = ([0.3, -0.7], [0.5, 1.1], [-0.4, 0.2]);
    let (own, rates, accelerations) = ([0.6, 0.02], [1.5, 0.1], [-2.0, 0.3]);
    robot.set_q(&q).unwrap();
    robot.grasp(arm, pliers, Grasp::At(Pose::translation(0.1, 0.0, 0.0))).unwrap();
    robot.set_object_q(pliers, &own).unwrap();
    let (mut wanted, mut at_joints) = ([0.0; 2], [0.0; 2]);
    let moving = (&rates[..], &accelerations[..]);
    robot
        .feed_forward_with_object((&v, &vdot), pliers, moving, &[], &mut wanted, &mut at_joints)
        .unwrap();
    let ok = LwStatus::Ok;
    let (mut b, mut m, mut r) = (null_mut(), null_mut(), null_mut());
    let hinge_at = LwPose { position: [0.0, 0.0, 0.1], quaternion: [0.0, 0.0, 0.0, 1.0] };
    let grasp_at = LwPose { position: [0.1, 0.0, 0.0], ..hinge_at };
    // SAFETY: valid handles of the library, zero-terminated texts, arrays of the required lengths.
    unsafe {
        assert_eq!(lw_builder_new(&mut b), ok);
        assert_eq!(lw_builder_robot_text(b, ROBOT.as_ptr(), LW_ROOT_FIXED, 0), ok);
        let (base, hand, arm) = (c"base".as_ptr(), c"hand".as_ptr(), c"arm".as_ptr());
        assert_eq!(lw_builder_chain(b, arm, base, hand), ok);
        let (c, i) = (center.as_ptr(), inertia.as_ptr());
        let (tool, jaw, screw) = (c"pliers".as_ptr(), c"jaw".as_ptr(), c"screw".as_ptr());
        assert_eq!(lw_builder_object(b, tool, 0.4, c, i), ok);
        let hinge = |kind, axis| LwHinge { kind, axis, second: [0.0; 3], pitch: 0.0 };
        let pin =
            |hinge: LwHinge| lw_builder_object_body(b, jaw, tool, &hinge, &hinge_at, 0.4, c, i);
        let y = [0.0, 1.0, 0.0];
        assert_eq!(pin(hinge(99, y)), LwStatus::OutOfRange);
        assert_eq!(pin(hinge(LW_HINGE_PIN, y)), ok);
        let slide = hinge(LW_HINGE_SLIDER, [0.6, 0.0, 0.8]);
        let done = lw_builder_object_body(b, screw, jaw, &slide, null(), 0.4, c, i);
        assert_eq!(done, ok);
        assert_eq!(lw_builder_model(b, &mut m), ok);
        assert_eq!(lw_robot_new(m, &mut r), ok);
        assert_eq!(lw_robot_set_q(r, q.as_ptr(), 2), ok);
        let (mut tau, mut forces) = ([0.0; 2], [0.0; 2]);
        let (p, f) = (tau.as_mut_ptr(), forces.as_mut_ptr());
        let (v, a, rates, own_a) =
            (v.as_ptr(), vdot.as_ptr(), rates.as_ptr(), accelerations.as_ptr());
        let ask = |n, f| {
            lw_robot_feed_forward_with_object(r, v, a, 2, 0, rates, own_a, n, null(), 0, p, f)
        };
        assert_eq!(ask(2, f), LwStatus::NotHeld);
        assert_eq!(lw_robot_grasp(r, 0, 0, &grasp_at), ok);
        assert_eq!(lw_robot_set_object_q(r, 0, own.as_ptr(), 1), LwStatus::Length);
        assert_eq!(lw_robot_set_object_q(r, 0, [f64::NAN; 2].as_ptr(), 2), LwStatus::NotFinite);
        assert_eq!(lw_robot_set_object_q(r, 7, own.as_ptr(), 2), LwStatus::Foreign);
        assert_eq!(lw_robot_set_object_q(r, 0, own.as_ptr(), 2), ok);
        let mut told = [0.0; 2];
        assert_eq!(lw_robot_object_q(r, 0, told.as_mut_ptr(), 2), ok);
        assert_eq!(told, own);
        assert_eq!(ask(1, f), LwStatus::Length);
        assert_eq!(ask(2, p), LwStatus::Overlap);
        assert_eq!(ask(2, null_mut()), LwStatus::Null);
        assert_eq!(ask(2, f), ok);
        assert_eq!((tau, forces), (wanted, at_joints), "to the bit");
        lw_robot_free(r);
        lw_model_free(m);
        lw_builder_free(b);
    }
}

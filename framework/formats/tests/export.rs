//! URDF export: the text reads back as the same mechanism.

use crate::splitmix::splitmix;
use linkwork_dynamics::{Tree, Workspace, kinematics, mass_matrix};
use linkwork_formats::multibody::{
    BodySpec, Builder, Friction, Hinge, Limits, Multibody, Stop, SubhingeKind,
};
use linkwork_formats::spatial::{MassProperties, Mat3, Pose, Quat, Vec3};
use linkwork_formats::{Description, ExportFault, ReadOptions, read_file, read_urdf, write_urdf};

/// A seeded generator of numbers without zeros (splitmix64).
struct Rng(u64);

impl Rng {
    fn bits(&mut self) -> u64 {
        splitmix(&mut self.0)
    }
    fn signed(&mut self) -> f64 {
        let x = 0.1 + 0.9 * (self.bits() >> 11) as f64 / (1u64 << 53) as f64;
        if self.bits() & 1 == 0 { x } else { -x }
    }
    fn vec3(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
    fn pose(&mut self) -> Pose {
        // Every fourth pose has a pitch of ±90°, where roll and yaw cannot be distinguished.
        let turn = match self.bits() % 4 {
            0 => Quat::from_euler_angles(
                self.signed(),
                self.signed().signum() * std::f64::consts::FRAC_PI_2,
                self.signed(),
            ),
            _ => Quat::from_scaled_axis(self.vec3() * 2.0),
        };
        Pose::new(turn, self.vec3())
    }
    fn mass(&mut self) -> MassProperties {
        let s = self.vec3().abs() * 0.1;
        let principal = Mat3::from_diagonal(&Vec3::new(s.y + s.z, s.x + s.z, s.x + s.y));
        let R = Quat::from_scaled_axis(self.vec3()).to_rotation_matrix().into_inner();
        let I = R * principal * R.transpose();
        MassProperties::new(self.signed().abs(), self.vec3(), (I + I.transpose()) * 0.5)
    }
}

fn machine(seed: u64) -> Description {
    let mut r = Rng(seed);
    let mut b = Builder::new();
    for i in 0..12 {
        let parent = if r.bits().is_multiple_of(5) || i == 0 {
            "world".into()
        } else {
            format!("b{:02}", r.bits() % i)
        };
        let hinge = match r.bits() % 7 {
            0 => Hinge::free(),
            1 => Hinge::locked(),
            2 => Hinge::slider(r.vec3()).limits(Limits::position(-0.3, f64::INFINITY)),
            3 => Hinge::planar(),
            4 => Hinge::chain([SubhingeKind::Free, SubhingeKind::Pin { axis: r.vec3() }]),
            5 => Hinge::universal(r.vec3(), r.vec3()),
            _ => Hinge::pin(r.vec3()).limits(Limits {
                lower: -1.0 / 3.0,
                upper: 0.7,
                rate: 3.0,
                effort: 1e-3,
            }),
        };
        let inside = if r.bits().is_multiple_of(2) { r.pose() } else { Pose::identity() };
        b.body(
            BodySpec::new(format!("b{i:02}"), parent)
                .hinge_in_parent(r.pose())
                .hinge_in_body(inside)
                .hinge(hinge)
                .mass(r.mass()),
        );
    }
    Description { name: "made & <up>".into(), builder: b, ..Description::default() }
}

/// Returns q and v of one mechanism in the order of the other: by body, and by subhinge on the dummies before it.
fn coordinates(of: &Multibody, like: &Multibody) -> (Vec<usize>, Vec<usize>) {
    let (mut q, mut v) = (Vec::new(), Vec::new());
    for b in of.bodies() {
        // Collect the body's hinge in the other mechanism, with the dummy links between it and the
        // parent body in this one.
        let mut parts = Vec::new();
        let mut at = like.body(b.name());
        while let Some(id) = at {
            parts.push(id);
            at = like.get(id).parent().filter(|p| of.body(like.get(*p).name()).is_none());
        }
        for id in parts.into_iter().rev() {
            q.extend(like.get(id).q());
            v.extend(like.get(id).v());
        }
    }
    (q, v)
}

#[test]
fn random_machines_come_back_with_the_same_poses_and_mass_matrix() {
    let (mut worst_pose, mut worst_mass): (f64, f64) = (0.0, 0.0);
    for seed in 0..40 {
        let d = machine(seed);
        let written = write_urdf(&d).unwrap_or_else(|e| panic!("{e}"));
        assert!(written.left_out.is_empty(), "{:?}", written.left_out);
        let back = read_urdf(&written.text, &ReadOptions::default());
        let back = back.unwrap_or_else(|e| panic!("{e}\n{}", written.text));
        assert_eq!(back.name, d.name);
        let (one, two) = (d.builder.build().unwrap(), back.builder.build().unwrap());
        assert_eq!((one.nq(), one.nv()), (two.nq(), two.nv()));
        let (q_map, v_map) = coordinates(&one, &two);
        let mut r = Rng(seed + 1000);
        let mut q1 = vec![0.0; one.nq()];
        let dq: Vec<f64> = (0..one.nv()).map(|_| r.signed()).collect();
        one.integrate(&one.neutral_q(), &dq, &mut q1);
        let mut q2 = two.neutral_q();
        q_map.iter().zip(&q1).for_each(|(i, x)| q2[*i] = *x);
        let (poses1, poses2) = (one.body_poses(&q1), two.body_poses(&q2));
        for b in one.bodies() {
            let X = poses1[one.body(b.name()).unwrap().index()];
            let Y = poses2[two.body(b.name()).unwrap().index()];
            let turn = (X.rotation.to_rotation_matrix().matrix()
                - Y.rotation.to_rotation_matrix().matrix())
            .amax();
            let e = turn.max((X.position - Y.position).amax());
            assert!(e < 1e-14, "seed {seed}, {}: {e:e}", b.name());
            worst_pose = worst_pose.max(e);
            // Masses, axes and limits keep all digits.
            assert_eq!(b.mass_properties(), two.get(two.body(b.name()).unwrap()).mass_properties());
        }
        let matrix = |mbs: &Multibody, q: &[f64]| {
            let (tree, n) = (Tree::new(mbs), mbs.nv());
            let mut ws = Workspace::new(&tree);
            kinematics(&tree, &mut ws, q, &vec![0.0; n]);
            let mut M = vec![0.0; n * n];
            mass_matrix(&tree, &mut ws, &mut M);
            M
        };
        let (M1, M2, n) = (matrix(&one, &q1), matrix(&two, &q2), one.nv());
        for (i, a) in v_map.iter().enumerate() {
            for (j, b) in v_map.iter().enumerate() {
                let e = (M1[i * n + j] - M2[a * n + b]).abs();
                assert!(e < 1e-12, "seed {seed}: M differs by {e:e}");
                worst_mass = worst_mass.max(e);
            }
        }
        let all = |m: &Multibody| -> Vec<(Option<Vec3>, Limits)> {
            let of = |b: &str| {
                m.subhinges()
                    .filter(move |(id, _)| m.get(*id).name().starts_with(b))
                    .map(|(_, s)| (s.subhinge.kind.axis(), s.subhinge.limits))
                    .collect::<Vec<_>>()
            };
            one.bodies().iter().flat_map(|b| of(b.name())).filter(|a| a.0.is_some()).collect()
        };
        for ((a, l), (b, k)) in all(&one).into_iter().zip(all(&two)) {
            assert_eq!((a, l), (b, k));
        }
    }
    println!("poses within {worst_pose:e}, mass matrix within {worst_mass:e}");
}

#[test]
fn a_description_with_shapes_joints_and_mimics_comes_back() {
    let text = include_str!("data/arm.urdf");
    let first = read_urdf(text, &ReadOptions::default()).unwrap();
    let written = write_urdf(&first).unwrap_or_else(|e| panic!("{e}"));
    assert!(written.left_out.is_empty(), "{:?}", written.left_out);
    let second = read_urdf(&written.text, &ReadOptions::default()).unwrap();
    assert_eq!(first.shapes.len(), second.shapes.len());
    assert_eq!(first.shapes[0].color, second.shapes[0].color);
    assert_eq!(first.couplings, second.couplings);
    assert_eq!(first.joint("shoulder"), second.joint("shoulder"));
    // Writing twice gives the same text.
    assert_eq!(
        write_urdf(&second).unwrap().text,
        write_urdf(&read_urdf(&written.text, &ReadOptions::default()).unwrap()).unwrap().text
    );
}

#[test]
fn what_urdf_cannot_say_is_refused_or_told() {
    let with = |hinge: Hinge| {
        let mut b = Builder::new();
        b.body(BodySpec::new("a", "world").hinge(hinge));
        b.node("tip", "a", Pose::translation(1.0, 2.0, 3.0));
        Description { builder: b, ..Description::default() }
    };
    let error = write_urdf(&with(Hinge::ball())).expect_err("ball");
    assert_eq!(error.faults, [ExportFault::Ball { body: "a".into() }]);
    assert!(error.to_string().contains("a chain of three hinges is a different mechanism"));
    let error = write_urdf(&with(Hinge::screw(Vec3::x(), 0.1))).expect_err("screw");
    assert_eq!(error.faults, [ExportFault::Screw { body: "a".into() }]);
    let mut spaced = with(Hinge::free());
    spaced.builder.bodies_mut()[0].name = " a\u{1}".into();
    spaced.builder.nodes_mut()[0].body = " a\u{1}".into();
    assert!(matches!(write_urdf(&spaced).expect_err("name").faults[0], ExportFault::Name { .. }));
    let mut xacro = with(Hinge::free());
    xacro.name = "r${n}".into();
    let error = write_urdf(&xacro).expect_err("xacro");
    assert_eq!(error.faults, [ExportFault::Name { name: "r${n}".into() }]);
    assert!(error.to_string().contains("xacro's `${` or `$(`"), "{error}");
    let mut ring = with(Hinge::free());
    ring.builder.bodies_mut()[0].parent = "a".into();
    assert!(matches!(write_urdf(&ring).expect_err("ring").faults[0], ExportFault::Build(_)));

    let geared = with(Hinge::pin(Vec3::x()).armature(0.1).gear(20.0).prescribed());
    let written = write_urdf(&geared).unwrap();
    assert_eq!(written.left_out.len(), 3, "{:?}", written.left_out);
    // In URDF, a node is a separate link.
    let back = read_urdf(&written.text, &ReadOptions::default()).unwrap();
    let tip = back.builder.bodies().iter().find(|b| b.name == "tip").unwrap();
    assert_eq!((tip.parent.as_str(), tip.hinge_in_parent), ("a", Pose::translation(1.0, 2.0, 3.0)));
}

#[test]
fn mujoco_s_chains_become_links_of_urdf() {
    // The lab contains a ball, which URDF cannot express; without it, everything is written.
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/lab.xml");
    let mut d = read_file(path, &ReadOptions::default()).unwrap();
    assert!(matches!(write_urdf(&d).expect_err("ball").faults[..], [ExportFault::Ball { .. }]));
    d.builder.bodies_mut().retain(|b| b.name != "eye");
    d.loops.clear();
    let written = write_urdf(&d).unwrap_or_else(|e| panic!("{e}"));
    assert!(written.left_out.iter().any(|l| l.contains("armature 0.02")), "{:?}", written.left_out);
    let back = read_urdf(&written.text, &ReadOptions::default()).unwrap();
    assert_eq!(back.builder.build().unwrap().nv(), d.builder.build().unwrap().nv());
    assert_eq!(back.couplings.len(), 1);
}

#[test]
fn damping_and_friction_are_written_and_what_urdf_cannot_say_is_listed() {
    let friction = Friction { force: 0.2, rate: 0.01 };
    let mut b = Builder::new();
    let mass = MassProperties::new(1.0, Vec3::zeros(), Mat3::identity());
    b.body(BodySpec::new("base", "world").mass(mass));
    let pin = Hinge::pin(Vec3::y()).damping(0.7).friction(friction).stop(Stop::Off);
    b.body(BodySpec::new("arm", "base").hinge(pin).mass(mass));
    let d = Description::from(&b.build().unwrap());
    let made = write_urdf(&d).unwrap();
    let again = read_urdf(&made.text, &ReadOptions::default()).unwrap();
    let arm = again.builder.bodies().iter().find(|b| b.name == "arm").unwrap();
    let s = arm.hinge.subhinges[0];
    assert_eq!((s.damping, s.friction), (0.7, Friction { rate: 0.0, ..friction }));
    let list = ["body `arm`, subhinge 0: friction's rate 0.01", "body `arm`, subhinge 0: stop Off"];
    assert_eq!(made.left_out, list);
}

//! The mechanisms of the benchmarks. Their nodes are the feet (or hands) for Jacobians and compliance, at the origins of their bodies.

use crate::support;
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Vec3};

/// Returns names and mechanisms.
pub fn all() -> Vec<(&'static str, Multibody)> {
    let mut all = Vec::new();
    for (name, feet) in [
        ("ur5", &["wrist_3_joint"][..]),
        ("iiwa7", &["lbr_iiwa_joint_7"]),
        ("solo12_ff", &["FL_KFE", "FR_KFE", "HL_KFE", "HR_KFE"]),
    ] {
        if let Some(robot) = support::robot(name) {
            all.push((name, with_feet(robot.tree.multibody(), feet)));
        }
    }
    all.push(("humanoid37", humanoid()));
    all.push(("rover20", rover()));
    all.push(("tree31", binary_tree(5)));
    all.push(("tree127", binary_tree(7)));
    for (name, n) in [("chain10", 10), ("chain50", 50), ("chain200", 200)] {
        all.push((name, chain(n)));
    }
    all
}

/// Returns the same robot with one node at the origin of each of these bodies and no other nodes.
fn with_feet(mbs: &Multibody, feet: &[&str]) -> Multibody {
    let mut b = Builder::from(mbs);
    b.nodes_mut().clear();
    for (i, f) in feet.iter().enumerate() {
        b.node(format!("foot{i}"), *f, Pose::identity());
    }
    b.build().unwrap_or_else(|e| panic!("{e}"))
}

/// A chain of n links with pins about y; each link has 2 kg, diag(3, 2, 1) kg m² and 1 m.
pub fn chain(n: usize) -> Multibody {
    let mut b = Builder::new();
    let inertia = Mat3::from_diagonal(&Vec3::new(3.0, 2.0, 1.0));
    let name = |i: usize| format!("l{i:03}");
    for i in 0..n {
        let parent = if i == 0 { "world".to_owned() } else { name(i - 1) };
        b.body(
            BodySpec::new(name(i), parent)
                .hinge_in_parent(Pose::translation(if i == 0 { 0.0 } else { 1.0 }, 0.0, 0.0))
                .hinge(Hinge::pin(Vec3::y()))
                .mass(MassProperties::new(2.0, Vec3::new(0.5, 0.0, 0.0), inertia)),
        );
    }
    b.node("tip", name(n - 1), Pose::identity());
    b.build().expect("chain")
}

/// A binary tree with pins about x, y and z in turn, and nodes at two tips.
fn binary_tree(depth: u32) -> Multibody {
    let mut b = Builder::new();
    let inertia = Mat3::from_diagonal(&Vec3::new(0.02, 0.03, 0.04));
    let name = |i: usize| format!("l{i:03}");
    let n = 2usize.pow(depth) - 1;
    for i in 1..=n {
        let parent = if i == 1 { "world".to_owned() } else { name(i / 2) };
        let side = if i % 2 == 0 { 0.2 } else { -0.2 };
        b.body(
            BodySpec::new(name(i), parent)
                .hinge_in_parent(Pose::translation(0.3, side, 0.1))
                .hinge(Hinge::pin([Vec3::x(), Vec3::y(), Vec3::z()][i % 3]))
                .mass(MassProperties::new(1.0, Vec3::new(0.1, 0.02, -0.03), inertia)),
        );
    }
    b.node("first", name(n.div_ceil(2)), Pose::identity());
    b.node("last", name(n), Pose::identity());
    b.build().expect("tree")
}

/// Adds a link: name, parent, hinge frame in the parent, axis (`None`: free hinge), mass.
fn part(b: &mut Builder, name: &str, parent: &str, p: [f64; 3], axis: Option<Vec3>, m: f64) {
    let inertia = Mat3::from_diagonal(&Vec3::new(0.02 * m, 0.03 * m, 0.04 * m));
    b.body(
        BodySpec::new(name, parent)
            .hinge_in_parent(Pose::translation(p[0], p[1], p[2]))
            .hinge(axis.map_or_else(Hinge::free, Hinge::pin))
            .mass(MassProperties::new(m, Vec3::new(0.03, 0.02, -0.01), inertia)),
    );
}

/// A humanoid with 37 dof: free pelvis, two legs with six, waist with three, two arms with seven, head with two.
pub fn humanoid() -> Multibody {
    let mut b = Builder::new();
    let (x, y, z) = (Some(Vec3::x()), Some(Vec3::y()), Some(Vec3::z()));
    part(&mut b, "pelvis", "world", [0.0; 3], None, 10.0);
    let mut limb =
        |names: &[(&str, [f64; 3], Option<Vec3>, f64)], base: &str, side: &str, mirror| {
            let mut parent = base.to_owned();
            for (name, p, axis, m) in names {
                let name = format!("{name}{side}");
                part(&mut b, &name, &parent, [p[0], mirror * p[1], p[2]], *axis, *m);
                parent = name;
            }
        };
    limb(
        &[
            ("waist1", [0.0, 0.0, 0.1], z, 1.0),
            ("waist2", [0.0, 0.0, 0.05], x, 1.0),
            ("chest", [0.0, 0.0, 0.05], y, 12.0),
        ],
        "pelvis",
        "",
        1.0,
    );
    limb(&[("neck", [0.0, 0.0, 0.4], z, 0.5), ("head", [0.0, 0.0, 0.1], y, 3.0)], "chest", "", 1.0);
    for (side, mirror) in [("_l", 1.0), ("_r", -1.0)] {
        let leg = [
            ("hip1", [0.0, 0.09, -0.05], z, 1.0),
            ("hip2", [0.0, 0.0, -0.03], x, 1.0),
            ("thigh", [0.0, 0.0, -0.03], y, 5.0),
            ("shank", [0.0, 0.0, -0.4], y, 3.0),
            ("ankle", [0.0, 0.0, -0.4], y, 0.5),
            ("foot", [0.0, 0.0, -0.05], x, 1.0),
        ];
        limb(&leg, "pelvis", side, mirror);
        let arm = [
            ("shoulder1", [0.0, 0.2, 0.35], y, 1.0),
            ("shoulder2", [0.0, 0.05, 0.0], x, 1.0),
            ("upper", [0.0, 0.0, -0.1], z, 1.5),
            ("elbow", [0.0, 0.0, -0.2], y, 1.0),
            ("lower", [0.0, 0.0, -0.1], z, 1.0),
            ("wrist", [0.0, 0.0, -0.15], y, 0.3),
            ("hand", [0.0, 0.0, -0.05], x, 0.5),
        ];
        limb(&arm, "chest", side, mirror);
    }
    b.node("left", "foot_l", Pose::identity()).node("right", "foot_r", Pose::identity());
    let mbs = b.build().expect("humanoid");
    assert_eq!(mbs.nv(), 37);
    mbs
}

/// A rocker-bogie rover, 20 dof: floating chassis, 2 rockers, 2 bogies, 4 steers, 6 wheels.
pub fn rover() -> Multibody {
    let mut b = Builder::new();
    let (pitch, yaw) = (Some(Vec3::y()), Some(Vec3::z()));
    part(&mut b, "chassis", "world", [0.0; 3], None, 30.0);
    for (s, y) in [("l", 0.3), ("r", -0.3)] {
        let n = |x: &str| format!("{x}_{s}");
        let mut part = |name: &str, parent: &str, p, axis, m| {
            part(&mut b, &n(name), parent, p, axis, m);
        };
        part("rocker", "chassis", [0.1, y, 0.0], pitch, 1.2);
        part("bogie", &n("rocker"), [-0.3, 0.0, -0.1], pitch, 0.9);
        part("steer_f", &n("rocker"), [0.35, 0.0, -0.1], yaw, 1.3);
        part("wheel_f", &n("steer_f"), [0.0, 0.0, -0.13], pitch, 1.1);
        part("wheel_m", &n("bogie"), [0.2, 0.0, -0.1], pitch, 1.1);
        part("steer_b", &n("bogie"), [-0.2, 0.0, 0.0], yaw, 1.3);
        part("wheel_b", &n("steer_b"), [0.0, 0.0, -0.13], pitch, 1.1);
    }
    b.node("left", "wheel_f_l", Pose::identity()).node("right", "wheel_f_r", Pose::identity());
    let mbs = b.build().expect("rover");
    assert_eq!(mbs.nv(), 20);
    mbs
}

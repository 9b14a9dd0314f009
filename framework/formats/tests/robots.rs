//! Published robots: their URDF compared with Pinocchio's values for the same files, and two rovers without such values.

use linkwork_dynamics::{Tree, Workspace, forward_dynamics, inverse_dynamics};
use linkwork_formats::multibody::{BodyId, Multibody};
use linkwork_formats::spatial::nalgebra::Rotation3;
use linkwork_formats::spatial::{InertiaCheck, Mat3, Pose, Quat, RigidInertia, Vec3};
use linkwork_formats::{
    Description, Geometry, ReadOptions, Root, ShapeRole, Unphysical, read_file,
};
use serde_json::Value;
use std::path::PathBuf;

fn path(name: &str) -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/reference/robots"))
        .join(name)
}

/// Whether a file of the reference data exists; without it, the test prints a message and is skipped, and with `CI` it fails.
fn there(name: &str) -> bool {
    let there = path(name).is_file();
    if !there {
        assert!(std::env::var_os("CI").is_none(), "reference data robots/{name} are missing");
        println!("skipped: reference data robots/{name} are not here");
    }
    there
}

/// Returns the description and the reference values.
fn robot(name: &str) -> Option<(Description, Value)> {
    let file = format!("{name}.json");
    if !there(&file) {
        return None;
    }
    let json = std::fs::read_to_string(path(&file)).unwrap();
    let json: Value = serde_json::from_str(&json).unwrap();
    let root = if json["root"].is_null() { Root::Fixed } else { Root::Free };
    // Published robots contain impossible links.
    let inertia = InertiaCheck::PositiveMoments;
    let options = ReadOptions { root, inertia, ..ReadOptions::default() };
    let d = read_file(path(&format!("{name}.urdf")), &options);
    Some((d.unwrap_or_else(|e| panic!("{e}")), json))
}

fn nums(v: &Value) -> Vec<f64> {
    v.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn mat3(v: &Value) -> Mat3 {
    let rows: Vec<f64> = v.as_array().unwrap().iter().flat_map(nums).collect();
    Mat3::from_row_slice(&rows)
}

/// Returns the largest difference; NaN counts as infinite.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let worst = |w: f64, (x, y): (&f64, &f64)| match (x - y).abs() {
        d if d.is_nan() => f64::INFINITY,
        d => w.max(d),
    };
    a.iter().zip(b).fold(0.0, worst)
}

/// Returns the body and all bodies welded to it, about its frame.
fn merged(mbs: &Multibody, body: BodyId) -> RigidInertia {
    let mut sum = *mbs.get(body).inertia();
    for child in mbs.body_ids().filter(|b| mbs.get(*b).parent() == Some(body)) {
        let c = mbs.get(child);
        if c.v().is_empty() {
            let X = c.hinge_in_parent() * c.hinge_in_body().inverse();
            sum += merged(mbs, child).rotate(&X.rotation).shift_to_parent(&X.position);
        }
    }
    sum
}

/// Returns the body of a joint of the reference.
fn body_of(d: &Description, mbs: &Multibody, joint: &str) -> BodyId {
    match d.joint(joint) {
        Some(j) => mbs.body(&j.body).unwrap(),
        None => mbs.body_ids().find(|b| mbs.get(*b).v().len() == 6).unwrap(),
    }
}

/// Compares poses, axes and merged mass properties with the reference's table of joints.
fn check_structure(d: &Description, mbs: &Multibody, json: &Value) {
    let poses = mbs.body_poses(&mbs.neutral_q());
    let joints = json["joints"].as_array().unwrap();
    let mut expected: Vec<Pose> = vec![Pose::identity()];
    for j in joints {
        let name = j["name"].as_str().unwrap();
        let R =
            Quat::from_rotation_matrix(&Rotation3::from_matrix_unchecked(mat3(&j["placement_R"])));
        let X_PJ = Pose::new(R, Vec3::from_column_slice(&nums(&j["placement_p"])));
        expected.push(expected[j["parent"].as_u64().unwrap() as usize] * X_PJ);
        let (X, body) = (expected.last().unwrap(), body_of(d, mbs, name));
        let own = poses[body.index()];
        assert!(apart(own.position.as_slice(), X.position.as_slice()) < 1e-14, "{name}: place");
        let turn = own.rotation.angle_to(&X.rotation);
        // The precision of acos is low: an error of 1e-15 appears as 5e-8.
        assert!(turn < 1e-7, "{name}: turned by {turn}");
        let subhinge = mbs.get(body).subhinges()[0].subhinge.kind;
        let axis = match j["type"].as_str().unwrap() {
            "JointModelRX" => Some(Vec3::x()),
            "JointModelRY" => Some(Vec3::y()),
            "JointModelRZ" => Some(Vec3::z()),
            _ => subhinge.axis(), // the dynamics below test this axis
        };
        assert_eq!(subhinge.axis(), axis, "{name}: axis");
        let sum = merged(mbs, body);
        let mass = j["mass"].as_f64().unwrap();
        assert!((sum.mass() - mass).abs() <= 1e-14 * mass, "{name}: mass");
        assert!(apart(sum.com().as_slice(), &nums(&j["com"])) < 1e-14, "{name}: com");
        let (J, K) = (sum.inertia_com(), mat3(&j["inertia_com"]));
        assert!(apart(J.as_slice(), K.as_slice()) < 1e-14 + 1e-13 * K.abs().max(), "{name}: J");
    }
}

/// Returns the positions of the reference's numbers in ours: v and q.
fn maps(d: &Description, mbs: &Multibody, json: &Value) -> (Vec<usize>, Vec<usize>) {
    let (mut v, mut q) = (Vec::new(), Vec::new());
    for j in json["joints"].as_array().unwrap() {
        let b = mbs.get(body_of(d, mbs, j["name"].as_str().unwrap()));
        match b.v().len() {
            // The reference orders rates as [v; ω], Linkwork as [ω; v].
            6 => v.extend([3, 4, 5, 0, 1, 2].map(|i| b.v().start + i)),
            _ => v.extend(b.v()),
        }
        q.extend(b.q());
    }
    (v, q)
}

fn scatter(x: &Value, map: &[usize]) -> Vec<f64> {
    let mut out = vec![0.0; map.len()];
    for (x, i) in nums(x).iter().zip(map) {
        out[*i] = *x;
    }
    out
}

/// Compares forward and inverse dynamics in every state of the reference.
fn check_dynamics(d: &Description, mbs: &Multibody, json: &Value) -> f64 {
    let tree = Tree::new(mbs);
    let mut ws = Workspace::new(&tree);
    let (v_map, q_map) = maps(d, mbs, json);
    let mut worst: f64 = 0.0;
    for s in json["states"].as_array().unwrap() {
        let (q, v) = (scatter(&s["q"], &q_map), scatter(&s["v"], &v_map));
        let (mut tau, a) = (scatter(&s["tau"], &v_map), scatter(&s["a_in"], &v_map));
        let (mut vdot, mut out) = (vec![0.0; v.len()], vec![0.0; v.len()]);
        ws.clear_forces();
        ws.apply_uniform_gravity(Vec3::from_column_slice(&nums(&json["gravity"])));
        forward_dynamics(&tree, &mut ws, &q, &v, &mut tau, &mut vdot).unwrap();
        inverse_dynamics(&tree, &mut ws, &q, &v, &a, &mut out);
        for (got, want) in [(&vdot, "aba"), (&out, "rnea")] {
            let want = scatter(&s[want], &v_map);
            let scale = want.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            let e = apart(got, &want) / scale;
            assert!(e < 1e-11, "{}: {e:e}", json["name"]);
            worst = worst.max(e);
        }
    }
    worst
}

fn check(name: &str) {
    let Some((d, json)) = robot(name) else { return };
    let mbs = d.builder.build().unwrap();
    assert_eq!(mbs.nv(), json["nv"].as_u64().unwrap() as usize);
    check_structure(&d, &mbs, &json);
    let worst = check_dynamics(&d, &mbs, &json);
    println!("{name}: dynamics within {worst:e} of Pinocchio");
}

#[test]
fn double_pendulum() {
    check("double_pendulum");
}

#[test]
fn ur5() {
    check("ur5");
}

#[test]
fn iiwa7() {
    check("iiwa7");
}

#[test]
fn solo12_with_free_base() {
    check("solo12_ff");
}

#[test]
fn chain_of_ten() {
    check("chain10_rand");
}

/// Also without an option: its unphysical links are reported, with their numbers, and have the values of the file; on request they are rejected.
#[test]
fn iiwa7_is_read_with_warnings() {
    if !there("iiwa7.urdf") {
        return;
    }
    let d = read_file(path("iiwa7.urdf"), &ReadOptions::default()).unwrap();
    let told: Vec<String> = d.doubtful.iter().map(ToString::to_string).collect();
    assert!(!told.is_empty(), "the reference has such links");
    for line in &told {
        assert!(line.contains("link `lbr_iiwa_link_"), "{line}");
        assert!(
            line.chars().any(|c| c.is_ascii_digit())
                && (line.contains("unchanged")
                    || line.contains("replaced")
                    || line.contains("ignored")),
            "{line}"
        );
    }
    let inertia = InertiaCheck::PositiveMoments;
    let asked = read_file(path("iiwa7.urdf"), &ReadOptions { inertia, ..ReadOptions::default() });
    let masses = |d: &Description| -> Vec<_> {
        d.builder.bodies().iter().map(|b| b.mass.inertia_com).collect()
    };
    assert_eq!(masses(&d), masses(&asked.unwrap()));
    let strict = ReadOptions { unphysical: Unphysical::Refused, ..ReadOptions::default() };
    let refused = read_file(path("iiwa7.urdf"), &strict).unwrap_err().to_string();
    assert!(refused.contains("lbr_iiwa_link_"), "{refused}");
}

#[test]
fn husky_rolls_on_four_wheels() {
    if !there("husky.urdf") {
        return;
    }
    let options = ReadOptions { root: Root::Free, ..ReadOptions::default() };
    let d = read_file(path("husky.urdf"), &options).unwrap_or_else(|e| panic!("{e}"));
    let mbs = d.builder.build().unwrap();
    assert_eq!((mbs.nv(), d.name.as_str()), (6 + 4, "husky"));
    let wheels: Vec<_> = d.joints.iter().filter(|j| j.count == 1).collect();
    assert_eq!(wheels.len(), 4);
    for j in wheels {
        let b = mbs.get(mbs.body(&j.body).unwrap());
        assert_eq!(b.subhinges()[0].subhinge.kind.axis(), Some(Vec3::y()), "{}", j.name);
        assert_eq!(b.subhinges()[0].subhinge.limits.lower, f64::NEG_INFINITY);
        let tyre = d.shapes.iter().find(|s| s.body == j.body && s.role == ShapeRole::Collision);
        let Geometry::Cylinder { radius, length } = tyre.unwrap().geometry else {
            panic!("{:?}", tyre)
        };
        assert_eq!((radius, length), (0.1651, 0.1143));
    }
    // Meshes of a missing package are warnings.
    assert!(
        d.ignored.iter().any(|i| i.what.contains("specify the folder of their packages")),
        "{:?}",
        d.ignored
    );
    assert!(
        d.ignored
            .iter()
            .any(|i| i.what == "element <gazebo>" || i.what == "element <transmission>")
    );
}

#[test]
fn leo_has_a_differential_that_is_fixed() {
    if !there("leo.urdf") {
        return;
    }
    let d = read_file(path("leo.urdf"), &ReadOptions::default()).unwrap_or_else(|e| panic!("{e}"));
    let mbs = d.builder.build().unwrap();
    assert_eq!(mbs.nv(), 4);
    let fl = d.joint("wheel_FL_joint").unwrap();
    assert_eq!((fl.damping, fl.friction), (0.1, 0.3125));
    let s = mbs.get(mbs.body("wheel_FL_link").unwrap()).subhinges()[0].subhinge;
    assert_eq!(s.kind.axis(), Some(-Vec3::y()));
    assert_eq!((s.limits.rate, s.limits.effort), (6.0, 2.0));
    // The rocker joint is fixed in this file, so its mimic has no effect, which is reported.
    assert!(d.couplings.is_empty());
    let unused = d.ignored.iter().find(|i| i.path == "robot/joint[rocker_R_joint]/mimic").unwrap();
    assert_eq!(unused.what, "element <mimic>");
}

//! Nanoseconds per call beside Pinocchio's, in one run.
//!
//! `LINKWORK_PINOCCHIO_BENCH=path cargo bench -p linkwork-dynamics`; the path is the program that
//! `tests/benches/peers/install.sh` builds. Without it only our own times are printed. Each figure
//! is the best of 25 repeats over 256 random states; both sides run the same loop.
#![allow(non_snake_case)]

#[path = "../tests/support/mod.rs"]
mod support;

use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};

const STATES: usize = 256;
const LOOPS: usize = 16;
const REPEATS: usize = 25;
const KEYS: [&str; 4] = ["kinematics", "inverse", "forward", "mass_matrix"];

fn main() {
    let peer = std::env::var_os("LINKWORK_PINOCCHIO_BENCH").map(PathBuf::from);
    if peer.is_none() {
        println!("LINKWORK_PINOCCHIO_BENCH is not set: no peer (tests/benches/peers/install.sh)");
    }
    println!(
        "{:<10} {:<12} {:>10} {:>10} {:>7} {:>12} {:>12}",
        "mechanism", "algorithm", "peer ns", "f64 ns", "ratio", "f64x4 ns/st", "f64x8 ns/st"
    );
    for name in ["iiwa7", "solo12_ff"] {
        if let Some(robot) = support::robot(name) {
            table(name, &robot.tree, peer.as_deref());
        }
    }
    table("rover20", &Tree::new(&rover()), peer.as_deref());
}

fn table(name: &str, tree: &Tree, peer: Option<&Path>) {
    // Ours on both sides of the peer: the clock of a busy machine drifts.
    let before = ours(tree);
    let theirs = peer.map(|p| run_peer(p, tree)).unwrap_or_default();
    let after = ours(tree);
    let (four, eight) = (batch::<f64x4>(tree), batch::<f64x8>(tree));
    for key in KEYS {
        let ns = before[key].min(after[key]);
        let (p, ratio) = theirs
            .get(key)
            .map_or(("-".into(), "-".into()), |p| (format!("{p:.0}"), format!("{:.2}", ns / p)));
        println!(
            "{name:<10} {key:<12} {p:>10} {ns:>10.0} {ratio:>7} {:>12.0} {:>12.0}",
            four[key], eight[key]
        );
    }
}

#[allow(clippy::disallowed_methods)] // A benchmark reads the clock.
fn best_ns(mut call: impl FnMut(usize)) -> f64 {
    (0..REPEATS)
        .map(|_| {
            let start = std::time::Instant::now();
            for _ in 0..LOOPS {
                for i in 0..STATES {
                    call(i);
                }
            }
            start.elapsed().as_secs_f64() * 1e9 / (LOOPS * STATES) as f64
        })
        .fold(f64::INFINITY, f64::min)
}

fn states(n: usize, one: impl Fn(u64) -> Vec<f64>) -> Vec<Vec<f64>> {
    (0..n as u64).map(one).collect()
}

fn ours(tree: &Tree) -> BTreeMap<&'static str, f64> {
    let mbs = tree.multibody();
    let q = states(STATES, |i| mbs.random_q(i));
    let v = states(STATES, |i| mbs.random_v(i));
    let mut x = states(STATES, |i| mbs.random_v(i + 9999));
    let mut ws = Workspace::new(tree);
    ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
    let nv = tree.nv();
    let (mut out, mut M) = (vec![0.0; nv], vec![0.0; nv * nv]);
    let kin = best_ns(|i| {
        kinematics(tree, &mut ws, &q[i], &v[i]);
        black_box(&ws);
    });
    let inverse = best_ns(|i| {
        inverse_dynamics(tree, &mut ws, &q[i], &v[i], &x[i], &mut out);
        black_box(&out);
    });
    let mass = best_ns(|i| {
        poses(tree, &mut ws, &q[i]);
        mass_matrix(tree, &mut ws, &mut M);
        black_box(&M);
    });
    let forward = best_ns(|i| {
        forward_dynamics(tree, &mut ws, &q[i], &v[i], &mut x[i], &mut out).expect("regular");
        black_box(&out);
    });
    [kin, inverse, forward, mass].into_iter().zip(KEYS).map(|(x, k)| (k, x)).collect()
}

fn batch<L: Lane>(tree: &Tree) -> BTreeMap<&'static str, f64> {
    let mbs = tree.multibody();
    let lanes = |x: Vec<f64>| -> Vec<L> { x.into_iter().map(L::splat).collect() };
    let q: Vec<_> = (0..STATES as u64).map(|i| lanes(mbs.random_q(i))).collect();
    let v: Vec<_> = (0..STATES as u64).map(|i| lanes(mbs.random_v(i))).collect();
    let mut x: Vec<_> = (0..STATES as u64).map(|i| lanes(mbs.random_v(i + 9999))).collect();
    let mut work = Batch::<L>::new(tree);
    work.set_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
    let nv = tree.nv();
    let (mut out, mut M) = (lanes(vec![0.0; nv]), lanes(vec![0.0; nv * nv]));
    let kin = best_ns(|i| {
        work.kinematics(tree, &q[i], &v[i]);
        black_box(&work);
    });
    let inverse = best_ns(|i| {
        work.inverse_dynamics(tree, &q[i], &v[i], &x[i], &mut out);
        black_box(&out);
    });
    let mass = best_ns(|i| {
        work.poses(tree, &q[i]);
        work.mass_matrix(tree, &mut M);
        black_box(&M);
    });
    let forward = best_ns(|i| {
        work.forward_dynamics(tree, &q[i], &v[i], &mut x[i], &mut out).expect("regular");
        black_box(&out);
    });
    let per_state = |(x, k)| (k, x / L::WIDTH as f64);
    [kin, inverse, forward, mass].into_iter().zip(KEYS).map(per_state).collect()
}

/// Runs the peer on the same mechanism, written to a temporary file.
fn run_peer(program: &Path, tree: &Tree) -> BTreeMap<String, f64> {
    let path = std::env::temp_dir().join(format!("linkwork_peer_{}.txt", std::process::id()));
    std::fs::write(&path, joints(tree.multibody())).expect("temporary file");
    let out = std::process::Command::new(program).arg(&path).output().expect("peer runs");
    std::fs::remove_file(&path).ok();
    assert!(out.status.success(), "peer failed: {}", String::from_utf8_lossy(&out.stderr));
    let text = String::from_utf8(out.stdout).expect("text");
    let found: BTreeMap<String, f64> = text
        .lines()
        .filter_map(|l| l.split_once(' '))
        .map(|(k, x)| (k.to_owned(), x.parse().expect("number")))
        .collect();
    assert_eq!(found["dof"], tree.nv() as f64, "the peer read another mechanism");
    found
}

/// One line a joint, as `pinocchio_bench.cpp` says.
fn joints(mbs: &Multibody) -> String {
    let mut text = String::new();
    for b in mbs.bodies() {
        let kind = b.subhinges()[0].subhinge.kind;
        let axis = kind.axis().unwrap_or_default();
        let parent = b.parent().map_or(0, |p| p.index() + 1);
        let X = b.hinge_in_parent();
        let (R, I) = (X.rotation.to_rotation_matrix(), b.inertia());
        text += if kind.axis().is_some() { "pin" } else { "free" };
        let mut put = |m: &[f64]| m.iter().for_each(|x| write!(text, " {x}").expect("write"));
        put(axis.as_slice());
        put(&[parent as f64]);
        put(R.matrix().transpose().as_slice());
        put(X.position.as_slice());
        put(&[I.mass()]);
        put(I.com().as_slice());
        put(I.inertia_com().as_slice());
        text.push('\n');
    }
    text
}

/// A rocker-bogie rover, 20 dof: floating chassis, 2 rockers, 2 bogies, 4 steers, 6 wheels.
fn rover() -> Multibody {
    let mut b = Builder::new();
    let mut part = |name: &str, parent: &str, p: [f64; 3], axis: Option<Vec3>, m: f64| {
        let inertia = Mat3::from_diagonal(&Vec3::new(0.02 * m, 0.03 * m, 0.04 * m));
        b.body(
            BodySpec::new(name, parent)
                .hinge_in_parent(Pose::translation(p[0], p[1], p[2]))
                .hinge(axis.map_or_else(Hinge::free, Hinge::pin))
                .mass(MassProperties::new(m, Vec3::new(0.03, 0.02, -0.01), inertia)),
        );
    };
    part("chassis", "world", [0.0; 3], None, 30.0);
    for (s, y) in [("l", 0.3), ("r", -0.3)] {
        let n = |x: &str| format!("{x}_{s}");
        let (pitch, yaw) = (Some(Vec3::y()), Some(Vec3::z()));
        part(&n("rocker"), "chassis", [0.1, y, 0.0], pitch, 1.2);
        part(&n("bogie"), &n("rocker"), [-0.3, 0.0, -0.1], pitch, 0.9);
        part(&n("steer_f"), &n("rocker"), [0.35, 0.0, -0.1], yaw, 1.3);
        part(&n("wheel_f"), &n("steer_f"), [0.0, 0.0, -0.13], pitch, 1.1);
        part(&n("wheel_m"), &n("bogie"), [0.2, 0.0, -0.1], pitch, 1.1);
        part(&n("steer_b"), &n("bogie"), [-0.2, 0.0, 0.0], yaw, 1.3);
        part(&n("wheel_b"), &n("steer_b"), [0.0, 0.0, -0.13], pitch, 1.1);
    }
    let mbs = b.build().expect("rover");
    assert_eq!(mbs.nv(), 20);
    mbs
}

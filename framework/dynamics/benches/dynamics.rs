//! Nanoseconds per call beside Pinocchio's, in one run.
//!
//! `LINKWORK_PINOCCHIO_BENCH=path cargo bench -p linkwork-dynamics [-- words]`; the path is the
//! program that `tests/benches/peers/install.sh` builds; words choose mechanisms by part of their
//! name. Without the path only our own times are printed. Each figure is the best of 15 repeats over
//! 64 random states; both sides run the same loop, poses or kinematics included.
#![allow(non_snake_case)]

#[path = "../tests/support/mod.rs"]
mod support;

mod mechanisms;

use linkwork_dynamics::multibody::{Multibody, NodeId};
use linkwork_dynamics::spatial::Vec3;
use linkwork_dynamics::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::hint::black_box;
use std::path::{Path, PathBuf};

const STATES: usize = 64;
const REPEATS: usize = 15;
/// Seconds of one repeat.
const SLICE: f64 = 0.01;

/// Algorithms, what they may cost beside the peer, and what a state of a batch may.
const TARGETS: [(&str, f64); 10] = [
    ("kinematics", 0.6),
    ("inverse", 0.65),
    ("forward", 0.55),
    ("mass_matrix", 0.75),
    ("inverse_mass", 0.75),
    ("jacobian", 0.75),
    ("centroidal", 0.75),
    ("d_inverse", 0.5),
    ("d_forward", 0.5),
    ("compliance", 0.6),
];
const BATCH: f64 = 0.12;

type Times = BTreeMap<&'static str, f64>;

fn main() {
    let peer = std::env::var_os("LINKWORK_PINOCCHIO_BENCH").map(PathBuf::from);
    if peer.is_none() {
        println!("LINKWORK_PINOCCHIO_BENCH is not set: no peer (tests/benches/peers/install.sh)");
    }
    let words: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    println!(
        "{:<10} {:<13} {:>9} {:>9} {:>6} {:>6} {:>9} {:>9} {:>6} {:>6}",
        "mechanism",
        "algorithm",
        "peer ns",
        "f64 ns",
        "ratio",
        "target",
        "x4 ns/st",
        "x8 ns/st",
        "batch",
        "target"
    );
    let mut missed = Vec::new();
    for (name, mbs) in mechanisms::all() {
        if words.is_empty() || words.iter().any(|w| name.contains(w.as_str())) {
            table(name, &Tree::new(&mbs), peer.as_deref(), &mut missed);
        }
    }
    if peer.is_some() {
        println!("cells beyond their target: {}", missed.len());
        missed.iter().for_each(|m| println!("  {m}"));
    }
}

fn table(name: &str, tree: &Tree, peer: Option<&Path>, missed: &mut Vec<String>) {
    // Ours on both sides of the peer: the clock of a busy machine drifts.
    let before = ours(tree);
    let theirs = peer.map(|p| run_peer(p, tree)).unwrap_or_default();
    let after = ours(tree);
    let (four, eight) = (batch::<f64x4>(tree), batch::<f64x8>(tree));
    for (key, target) in TARGETS {
        let Some(ns) = before.get(key).map(|x| x.min(after[key])) else { continue };
        let peer = theirs.get(key).copied();
        let per_state = four[key].min(eight[key]);
        let ratio = |x: f64| peer.map_or("-".into(), |p| format!("{:.2}", x / p));
        println!(
            "{name:<10} {key:<13} {:>9} {ns:>9.0} {:>6} {target:>6.2} {:>9.0} {:>9.0} {:>6} {BATCH:>6.2}",
            peer.map_or("-".into(), |p| format!("{p:.0}")),
            ratio(ns),
            four[key],
            eight[key],
            ratio(per_state)
        );
        if let Some(p) = peer {
            for (what, x, target) in [("", ns, target), (", batch", per_state, BATCH)] {
                if x > target * p {
                    missed.push(format!("{name} {key}{what}: {:.2} × (target {target})", x / p));
                }
            }
        }
    }
}

#[allow(clippy::disallowed_methods)] // A benchmark reads the clock.
fn best_ns(mut call: impl FnMut(usize)) -> f64 {
    let mut pass = |loops: usize| {
        let start = std::time::Instant::now();
        for _ in 0..loops {
            for i in 0..STATES {
                call(i);
            }
        }
        start.elapsed().as_secs_f64() / (loops * STATES) as f64
    };
    let loops = (SLICE / (pass(1) * STATES as f64)).max(1.0) as usize;
    1e9 * (0..REPEATS).map(|_| pass(loops)).fold(f64::INFINITY, f64::min)
}

fn states(one: impl Fn(u64) -> Vec<f64>) -> Vec<Vec<f64>> {
    (0..STATES as u64).map(one).collect()
}

/// The nodes of the feet, in order.
fn feet(mbs: &Multibody) -> Vec<NodeId> {
    mbs.node_ids().collect()
}

fn ours(tree: &Tree) -> Times {
    let mbs = tree.multibody();
    let (q, v) = (states(|i| mbs.random_q(i)), states(|i| mbs.random_v(i)));
    let mut x = states(|i| mbs.random_v(i + 9999));
    let (mut ws, mut d) = (Workspace::new(tree), Derivatives::new(tree));
    ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
    let (nv, feet) = (tree.nv(), feet(mbs));
    let mut c = Compliance::new(tree, &feet);
    let (mut out, mut J) = (vec![0.0; nv], vec![0.0; 6 * nv]);
    let [mut M, mut N, mut O] = [(); 3].map(|()| vec![0.0; nv * nv]);
    let mut L = vec![0.0; c.size() * c.size()];
    let mut times = Times::new();
    times.insert(
        "kinematics",
        best_ns(|i| {
            kinematics(tree, &mut ws, &q[i], &v[i]);
            black_box(&ws);
        }),
    );
    times.insert(
        "inverse",
        best_ns(|i| {
            inverse_dynamics(tree, &mut ws, &q[i], &v[i], &x[i], &mut out);
            black_box(&out);
        }),
    );
    times.insert(
        "forward",
        best_ns(|i| {
            forward_dynamics(tree, &mut ws, &q[i], &v[i], &mut x[i], &mut out).expect("regular");
            black_box(&out);
        }),
    );
    times.insert(
        "mass_matrix",
        best_ns(|i| {
            poses(tree, &mut ws, &q[i]);
            mass_matrix(tree, &mut ws, &mut M);
            black_box(&M);
        }),
    );
    times.insert(
        "inverse_mass",
        best_ns(|i| {
            poses(tree, &mut ws, &q[i]);
            inverse_mass_matrix(tree, &mut ws, &mut M).expect("regular");
            black_box(&M);
        }),
    );
    times.insert(
        "centroidal",
        best_ns(|i| {
            poses(tree, &mut ws, &q[i]);
            centroidal_matrix(tree, &mut ws, &mut J);
            black_box(&J);
        }),
    );
    times.insert(
        "d_inverse",
        best_ns(|i| {
            kinematics(tree, &mut ws, &q[i], &v[i]);
            d.inverse_dynamics(tree, &mut ws, &v[i], &x[i], &mut M, &mut N);
            black_box((&M, &N));
        }),
    );
    times.insert(
        "d_forward",
        best_ns(|i| {
            kinematics(tree, &mut ws, &q[i], &v[i]);
            let all = ForwardDerivatives { dvdot_dq: &mut M, dvdot_dv: &mut N, dvdot_dtau: &mut O };
            d.forward_dynamics(tree, &mut ws, &v[i], &mut x[i], &mut out, all).expect("regular");
            black_box((&M, &N, &O));
        }),
    );
    if let Some(last) = feet.last() {
        times.insert(
            "jacobian",
            best_ns(|i| {
                node_jacobian_at(tree, &mut ws, &q[i], *last, &mut J);
                black_box(&J);
            }),
        );
        times.insert(
            "compliance",
            best_ns(|i| {
                poses(tree, &mut ws, &q[i]);
                c.compute(tree, &mut ws, &mut L).expect("regular");
                black_box(&L);
            }),
        );
    }
    times
}

fn batch<L: Lane>(tree: &Tree) -> Times {
    let mbs = tree.multibody();
    let lanes = |x: Vec<f64>| -> Vec<L> { x.into_iter().map(L::splat).collect() };
    let all = |one: &dyn Fn(u64) -> Vec<f64>| -> Vec<Vec<L>> {
        (0..STATES as u64).map(|i| lanes(one(i))).collect()
    };
    let (q, v) = (all(&|i| mbs.random_q(i)), all(&|i| mbs.random_v(i)));
    let mut x = all(&|i| mbs.random_v(i + 9999));
    let (mut work, mut d) = (Batch::<L>::new(tree), Derivatives::<L>::new(tree));
    work.set_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
    let (nv, feet) = (tree.nv(), feet(mbs));
    let mut c = Compliance::<L>::new(tree, &feet);
    let zeros = |n: usize| lanes(vec![0.0; n]);
    let (mut out, mut J) = (zeros(nv), zeros(6 * nv));
    let [mut M, mut N, mut O] = [(); 3].map(|()| zeros(nv * nv));
    let mut compliance_out = zeros(c.size() * c.size());
    let mut times = Times::new();
    times.insert(
        "kinematics",
        best_ns(|i| {
            work.kinematics(tree, &q[i], &v[i]);
            black_box(&work);
        }),
    );
    times.insert(
        "inverse",
        best_ns(|i| {
            work.inverse_dynamics(tree, &q[i], &v[i], &x[i], &mut out);
            black_box(&out);
        }),
    );
    times.insert(
        "forward",
        best_ns(|i| {
            work.forward_dynamics(tree, &q[i], &v[i], &mut x[i], &mut out).expect("regular");
            black_box(&out);
        }),
    );
    times.insert(
        "mass_matrix",
        best_ns(|i| {
            work.poses(tree, &q[i]);
            work.mass_matrix(tree, &mut M);
            black_box(&M);
        }),
    );
    times.insert(
        "inverse_mass",
        best_ns(|i| {
            work.poses(tree, &q[i]);
            work.inverse_mass_matrix(tree, &mut M).expect("regular");
            black_box(&M);
        }),
    );
    times.insert(
        "centroidal",
        best_ns(|i| {
            work.poses(tree, &q[i]);
            work.centroidal_matrix(tree, &mut J);
            black_box(&J);
        }),
    );
    times.insert(
        "d_inverse",
        best_ns(|i| {
            work.kinematics(tree, &q[i], &v[i]);
            d.inverse_dynamics_batch(tree, &mut work, &v[i], &x[i], &mut M, &mut N);
            black_box((&M, &N));
        }),
    );
    times.insert(
        "d_forward",
        best_ns(|i| {
            work.kinematics(tree, &q[i], &v[i]);
            let all = ForwardDerivatives { dvdot_dq: &mut M, dvdot_dv: &mut N, dvdot_dtau: &mut O };
            d.forward_dynamics_batch(tree, &mut work, &v[i], &mut x[i], &mut out, all)
                .expect("regular");
            black_box((&M, &N, &O));
        }),
    );
    if let Some(last) = feet.last() {
        times.insert(
            "jacobian",
            best_ns(|i| {
                work.poses(tree, &q[i]);
                work.node_jacobian(tree, *last, &mut J);
                black_box(&J);
            }),
        );
        times.insert(
            "compliance",
            best_ns(|i| {
                work.poses(tree, &q[i]);
                c.compute_batch(tree, &mut work, &mut compliance_out).expect("regular");
                black_box(&compliance_out);
            }),
        );
    }
    times.into_iter().map(|(k, x)| (k, x / L::WIDTH as f64)).collect()
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
    for n in mbs.nodes() {
        writeln!(text, "foot {}", n.body().index() + 1).expect("write");
    }
    text
}

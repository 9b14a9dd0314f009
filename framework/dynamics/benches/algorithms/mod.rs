//! The algorithms that the benchmarks run, by name, on one state or on a batch; and the description of the mechanism for the other library.

use linkwork_dynamics::multibody::{Multibody, NodeId};
use linkwork_dynamics::spatial::Vec3;
use linkwork_dynamics::*;
use std::fmt::Write as _;
use std::hint::black_box;

/// Number of states over which the calls cycle.
pub const STATES: usize = 64;

/// Runs one algorithm after another.
pub trait Run {
    /// Runs an algorithm by name; `call` takes the index of a state.
    fn run(&mut self, key: &'static str, call: impl FnMut(usize));
}

fn states(one: impl Fn(u64) -> Vec<f64>) -> Vec<Vec<f64>> {
    (0..STATES as u64).map(one).collect()
}

/// Returns the nodes of the feet, in order.
fn feet(mbs: &Multibody) -> Vec<NodeId> {
    mbs.node_ids().collect()
}

/// Runs every algorithm on one state at a time.
pub fn ours(tree: &Tree, run: &mut impl Run) {
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
    run.run("kinematics", |i| {
        kinematics(tree, &mut ws, &q[i], &v[i]);
        black_box(&ws);
    });
    run.run("inverse", |i| {
        inverse_dynamics(tree, &mut ws, &q[i], &v[i], &x[i], &mut out);
        black_box(&out);
    });
    run.run("forward", |i| {
        forward_dynamics(tree, &mut ws, &q[i], &v[i], &mut x[i], &mut out).expect("regular");
        black_box(&out);
    });
    run.run("mass_matrix", |i| {
        poses(tree, &mut ws, &q[i]);
        mass_matrix(tree, &mut ws, &mut M);
        black_box(&M);
    });
    run.run("inverse_mass", |i| {
        poses(tree, &mut ws, &q[i]);
        inverse_mass_matrix(tree, &mut ws, &mut M).expect("regular");
        black_box(&M);
    });
    run.run("centroidal", |i| {
        poses(tree, &mut ws, &q[i]);
        centroidal_matrix(tree, &mut ws, &mut J);
        black_box(&J);
    });
    run.run("d_inverse", |i| {
        kinematics(tree, &mut ws, &q[i], &v[i]);
        d.inverse_dynamics(tree, &mut ws, &v[i], &x[i], &mut M, &mut N);
        black_box((&M, &N));
    });
    run.run("d_forward", |i| {
        kinematics(tree, &mut ws, &q[i], &v[i]);
        let all = ForwardDerivatives { dvdot_dq: &mut M, dvdot_dv: &mut N, dvdot_dtau: &mut O };
        d.forward_dynamics(tree, &mut ws, &v[i], &mut x[i], &mut out, all).expect("regular");
        black_box((&M, &N, &O));
    });
    if let Some(last) = feet.last() {
        run.run("jacobian", |i| {
            node_jacobian_at(tree, &mut ws, &q[i], *last, &mut J);
            black_box(&J);
        });
        run.run("compliance", |i| {
            poses(tree, &mut ws, &q[i]);
            c.compute(tree, &mut ws, &mut L).expect("regular");
            black_box(&L);
        });
    }
}

/// Runs every algorithm on batches; one call is a batch of [`Lane::WIDTH`] states.
pub fn batch<L: Lane>(tree: &Tree, run: &mut impl Run) {
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
    let mut Lambda = zeros(c.size() * c.size());
    run.run("kinematics", |i| {
        work.kinematics(tree, &q[i], &v[i]);
        black_box(&work);
    });
    run.run("inverse", |i| {
        work.inverse_dynamics(tree, &q[i], &v[i], &x[i], &mut out);
        black_box(&out);
    });
    run.run("forward", |i| {
        work.forward_dynamics(tree, &q[i], &v[i], &mut x[i], &mut out).expect("regular");
        black_box(&out);
    });
    run.run("mass_matrix", |i| {
        work.poses(tree, &q[i]);
        work.mass_matrix(tree, &mut M);
        black_box(&M);
    });
    run.run("inverse_mass", |i| {
        work.poses(tree, &q[i]);
        work.inverse_mass_matrix(tree, &mut M).expect("regular");
        black_box(&M);
    });
    run.run("centroidal", |i| {
        work.poses(tree, &q[i]);
        work.centroidal_matrix(tree, &mut J);
        black_box(&J);
    });
    run.run("d_inverse", |i| {
        work.kinematics(tree, &q[i], &v[i]);
        d.inverse_dynamics_batch(tree, &mut work, &v[i], &x[i], &mut M, &mut N);
        black_box((&M, &N));
    });
    run.run("d_forward", |i| {
        work.kinematics(tree, &q[i], &v[i]);
        let all = ForwardDerivatives { dvdot_dq: &mut M, dvdot_dv: &mut N, dvdot_dtau: &mut O };
        d.forward_dynamics_batch(tree, &mut work, &v[i], &mut x[i], &mut out, all)
            .expect("regular");
        black_box((&M, &N, &O));
    });
    if let Some(last) = feet.last() {
        run.run("jacobian", |i| {
            work.node_jacobian_at(tree, &q[i], *last, &mut J);
            black_box(&J);
        });
        run.run("compliance", |i| {
            work.poses(tree, &q[i]);
            c.compute_batch(tree, &mut work, &mut Lambda).expect("regular");
            black_box(&Lambda);
        });
    }
}

/// Writes one line per joint, in the format of `tests/benches/peers/pinocchio_bench.cpp`.
pub fn joints(mbs: &Multibody) -> String {
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

//! Tables of states give the same results as single states, bit-identical for any number of threads.

use crate::support::{Shape, close, random_tree};
use linkwork_dynamics::multibody::Multibody;
use linkwork_dynamics::spatial::Vec3;
use linkwork_dynamics::*;
use std::sync::Arc;

fn mechanism(seed: u64, bodies: usize) -> Multibody {
    random_tree(seed, Shape { bodies, floating: true, prescribed: seed % 2 == 1, armature: true })
}

fn table(count: u64, row: impl Fn(u64) -> Vec<f64>) -> Vec<f64> {
    (0..count).flat_map(row).collect()
}

const G: [f64; 3] = [0.5, -0.2, -9.8];

/// Returns the tables of every algorithm, one after another.
fn all(e: &mut Ensemble, mbs: &Multibody, count: u64) -> Vec<Vec<f64>> {
    e.set_uniform_gravity(Vec3::from(G));
    let (n, N) = (mbs.nv(), count as usize);
    let nodes: Vec<_> = mbs.node_ids().step_by(3).collect();
    let q = table(count, |i| mbs.random_q(i));
    let v = table(count, |i| mbs.random_v(i));
    let mut tau = table(count, |i| mbs.random_v(i + 50));
    let mut vdot = table(count, |i| mbs.random_v(i + 90));
    let make = |width: usize| vec![f64::NAN; N * width];
    let (mut inverse, mut M, mut X) = (make(n), make(n * n), make(n * n));
    let (mut J, mut A, mut p) = (make(6 * n), make(6 * n), make(3));
    let mut L = make(36 * nodes.len() * nodes.len());
    let (mut dq, mut dv) = (make(n * n), make(n * n));
    let (mut aq, mut av, mut at) = (make(n * n), make(n * n), make(n * n));
    e.inverse_dynamics(&q, &v, &vdot, &mut inverse);
    e.inverse_dynamics_derivatives(&q, &v, &vdot, &mut dq, &mut dv);
    e.forward_dynamics(&q, &v, &mut tau, &mut vdot).unwrap();
    e.mass_matrix(&q, &mut M);
    e.inverse_mass_matrix(&q, &mut X).unwrap();
    e.node_position(&q, nodes[1], &mut p);
    e.node_jacobian(&q, nodes[1], &mut J);
    e.centroidal_matrix(&q, &mut A);
    e.compliance(&q, &nodes, &mut L).unwrap();
    let (mut tau2, mut vdot2) = (tau.clone(), vdot.clone());
    let out = ForwardDerivatives { dvdot_dq: &mut aq, dvdot_dv: &mut av, dvdot_dtau: &mut at };
    e.forward_dynamics_derivatives(&q, &v, &mut tau2, &mut vdot2, out).unwrap();
    vec![inverse, dq, dv, tau, vdot, M, X, p, J, A, L, aq, av, at]
}

/// Returns the same results state by state.
fn alone(mbs: &Multibody, count: u64) -> Vec<Vec<f64>> {
    let tree = Tree::new(mbs);
    let (mut ws, mut d) = (Workspace::new(&tree), Derivatives::new(&tree));
    ws.apply_uniform_gravity(Vec3::from(G));
    let nodes: Vec<_> = mbs.node_ids().step_by(3).collect();
    let mut c = Compliance::new(&tree, &nodes);
    let n = mbs.nv();
    let mut all = vec![Vec::new(); 14];
    for i in 0..count {
        let (q, v) = (mbs.random_q(i), mbs.random_v(i));
        let (mut tau, mut vdot) = (mbs.random_v(i + 50), mbs.random_v(i + 90));
        let [mut dq, mut dv, mut M, mut X, mut aq, mut av, mut at] =
            [(); 7].map(|()| vec![0.0; n * n]);
        let (mut inverse, mut J, mut A) = (vec![0.0; n], vec![0.0; 6 * n], vec![0.0; 6 * n]);
        let mut L = vec![0.0; c.size() * c.size()];
        inverse_dynamics(&tree, &mut ws, &q, &v, &vdot, &mut inverse);
        d.inverse_dynamics(&tree, &mut ws, &v, &vdot, &mut dq, &mut dv);
        forward_dynamics(&tree, &mut ws, &q, &v, &mut tau, &mut vdot).unwrap();
        mass_matrix(&tree, &mut ws, &mut M);
        inverse_mass_matrix(&tree, &mut ws, &mut X).unwrap();
        let p = ws.node_pose(&tree, nodes[1]).position;
        node_jacobian(&tree, &ws, nodes[1], &mut J);
        centroidal_matrix(&tree, &mut ws, &mut A);
        c.compute(&tree, &mut ws, &mut L).unwrap();
        let (mut tau2, mut vdot2) = (tau.clone(), vdot.clone());
        let out = ForwardDerivatives { dvdot_dq: &mut aq, dvdot_dv: &mut av, dvdot_dtau: &mut at };
        d.forward_dynamics(&tree, &mut ws, &v, &mut tau2, &mut vdot2, out).unwrap();
        let rows = [inverse, dq, dv, tau, vdot, M, X, p.as_slice().to_vec(), J, A, L, aq, av, at];
        all.iter_mut().zip(rows).for_each(|(to, row)| to.extend(row));
    }
    all
}

#[test]
fn a_table_holds_what_its_rows_give_alone() {
    for (seed, bodies, count) in [(1, 6, 5), (2, 14, 8), (3, 30, 13)] {
        let mbs = mechanism(seed, bodies);
        let mut e = Ensemble::new(Arc::new(Tree::new(&mbs)), 1);
        let together = all(&mut e, &mbs, count);
        for (i, (a, b)) in together.iter().zip(alone(&mbs, count)).enumerate() {
            // The order of sums differs between lanes; measured 2e-12.
            close(a, &b, 1e-10, &format!("seed {seed}, table {i}"));
        }
    }
}

#[test]
fn threads_do_not_change_bits() {
    let mbs = mechanism(2, 12);
    let tree = Arc::new(Tree::new(&mbs));
    let one = all(&mut Ensemble::new(tree.clone(), 1), &mbs, 29);
    for threads in [2, 3, 7] {
        let mut e = Ensemble::new(tree.clone(), threads);
        assert_eq!(all(&mut e, &mbs, 29), one, "{threads} threads");
        assert_eq!(all(&mut e, &mbs, 29), one, "{threads} threads, again");
    }
    let mut none = Ensemble::new(tree, 2);
    none.forward_dynamics(&[], &[], &mut [], &mut []).unwrap();
}

#[test]
fn a_singular_state_is_reported() {
    use multibody::{BodySpec, Builder, Hinge};
    let mut b = Builder::new();
    b.body(BodySpec::new("ghost", "world").hinge(Hinge::pin(Vec3::x())));
    let tree = Arc::new(Tree::new(&b.build().unwrap()));
    let mut e = Ensemble::new(tree, 2);
    let error = e.forward_dynamics(&[0.1; 9], &[0.2; 9], &mut [0.3; 9], &mut [0.0; 9]).unwrap_err();
    assert_eq!(error, DynamicsError::Singular { body: "ghost".into(), v: 0 });
}

#[test]
#[should_panic(expected = "not a multiple of 3 states")]
fn tables_of_different_lengths_are_refused() {
    let mbs = mechanism(2, 3);
    let mut e = Ensemble::new(Arc::new(Tree::new(&mbs)), 1);
    let q = table(3, |i| mbs.random_q(i));
    let (mut tau, mut vdot) = (vec![0.0; 3 * mbs.nv()], vec![0.0; 3 * mbs.nv()]);
    e.forward_dynamics(&q, &vec![0.0; 3 * mbs.nv() - 1], &mut tau, &mut vdot).ok();
}

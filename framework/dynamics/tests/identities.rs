//! Identity tests: two algorithms for the same numbers, on random trees with every kind of hinge.

use crate::support::{Rng, Shape, close, random_tree, relative_error, solve};
use linkwork_dynamics::spatial::{Force, RigidInertia, Vec3};
use linkwork_dynamics::*;

struct Case {
    tree: Tree,
    ws: Workspace,
    q: Vec<f64>,
    v: Vec<f64>,
    seed: u64,
}

fn case(seed: u64, prescribed: bool) -> Case {
    let shape = Shape {
        bodies: 9,
        floating: seed.is_multiple_of(2),
        prescribed,
        armature: seed.is_multiple_of(3),
    };
    let mbs = random_tree(seed, shape);
    let tree = Tree::new(&mbs);
    let (q, v) = (mbs.random_q(seed), mbs.random_v(seed));
    let mut ws = Workspace::new(&tree);
    kinematics(&tree, &mut ws, &q, &v);
    let mut r = Rng(seed ^ 77);
    ws.apply_uniform_gravity(r.vec3() * 5.0);
    for n in mbs.node_ids() {
        ws.add_wrench_at_node(&tree, n, Force::new(r.vec3(), r.vec3()));
    }
    Case { tree, ws, q, v, seed }
}

#[test]
fn inverse_inverts_forward_and_both_agree_with_the_mass_matrix() {
    for seed in 0..60 {
        let mut c = case(seed, false);
        let nv = c.tree.nv();
        let mut tau = Rng(seed + 5).vec(nv);
        let (mut vdot, mut back) = (vec![0.0; nv], vec![0.0; nv]);
        let given = tau.clone();
        forward_dynamics_given_kinematics(&c.tree, &mut c.ws, &mut tau, &mut vdot).unwrap();
        assert_eq!(given, tau, "seed {seed}: tau is only read at free coordinates");
        inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &vdot, &mut back);
        // Measured: at most 1e-12, because large forces cancel in some of these chains.
        close(&back, &tau, 1e-11, &format!("seed {seed}, inverse of forward"));

        // Solve M β̇ + C = τ with a dense matrix.
        let (mut M, mut C) = (vec![0.0; nv * nv], vec![0.0; nv]);
        mass_matrix(&c.tree, &mut c.ws, &mut M);
        inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &vec![0.0; nv], &mut C);
        let rhs: Vec<f64> = tau.iter().zip(&C).map(|(t, c)| t - c).collect();
        close(&vdot, &solve(&M, nv, &rhs), 1e-12, &format!("seed {seed}, dense solve"));

        // Compute the columns of M by inverse dynamics.
        for j in 0..nv {
            let mut e = vec![0.0; nv];
            e[j] = 1.0;
            inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &e, &mut back);
            let column: Vec<f64> = back.iter().zip(&C).map(|(t, c)| t - c).collect();
            let scale = M.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            for (i, x) in column.iter().enumerate() {
                let d = (x - M[i * nv + j]).abs();
                assert!(d <= 1e-13 * scale, "seed {seed}, M[{i},{j}] differs by {d:e}");
            }
        }
    }
}

#[test]
fn mixed_dynamics_agrees_with_the_partitioned_dense_system() {
    let mut prescribed_seen = 0;
    for seed in 0..60 {
        let mut c = case(seed, true);
        let nv = c.tree.nv();
        let mask = c.tree.multibody().prescribed();
        prescribed_seen += mask.iter().filter(|p| **p).count();
        let (mut M, mut C) = (vec![0.0; nv * nv], vec![0.0; nv]);
        mass_matrix(&c.tree, &mut c.ws, &mut M);
        inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &vec![0.0; nv], &mut C);
        let mut r = Rng(seed + 9);
        let (tau_in, vdot_in) = (r.vec(nv), r.vec(nv));
        let free: Vec<usize> = (0..nv).filter(|i| !mask[*i]).collect();
        let M_ff: Vec<f64> = free
            .iter()
            .flat_map(|i| free.iter().map(|j| M[i * nv + j]).collect::<Vec<_>>())
            .collect();
        let rhs: Vec<f64> = free
            .iter()
            .map(|i| {
                let known = (0..nv).filter(|j| mask[*j]).map(|j| M[i * nv + j] * vdot_in[j]);
                tau_in[*i] - C[*i] - known.sum::<f64>()
            })
            .collect();
        let x = if free.is_empty() { vec![] } else { solve(&M_ff, free.len(), &rhs) };
        let mut want_a = vdot_in.clone();
        for (i, x) in free.iter().zip(&x) {
            want_a[*i] = *x;
        }
        let mut want_tau = tau_in.clone();
        for i in (0..nv).filter(|i| mask[*i]) {
            want_tau[i] = C[i] + (0..nv).map(|j| M[i * nv + j] * want_a[j]).sum::<f64>();
        }
        let (mut tau, mut vdot) = (tau_in.clone(), vdot_in.clone());
        for i in 0..nv {
            if mask[i] { tau[i] = f64::NAN } else { vdot[i] = f64::NAN }
        }
        forward_dynamics_given_kinematics(&c.tree, &mut c.ws, &mut tau, &mut vdot).unwrap();
        close(&vdot, &want_a, 1e-12, &format!("seed {seed}, accelerations"));
        close(&tau, &want_tau, 1e-12, &format!("seed {seed}, forces"));
    }
    assert!(prescribed_seen > 100);
}

#[test]
fn momentum_and_energy_two_ways() {
    for seed in 0..40 {
        let mut c = case(seed, false);
        let (tree, nv) = (&c.tree, c.tree.nv());
        let mut M = vec![0.0; nv * nv];
        mass_matrix(tree, &mut c.ws, &mut M);
        let T = 0.5
            * (0..nv)
                .flat_map(|i| (0..nv).map(move |j| (i, j)))
                .map(|(i, j)| c.v[i] * M[i * nv + j] * c.v[j])
                .sum::<f64>();
        close(&[kinetic_energy(tree, &c.ws, &c.v)], &[T], 1e-12, &format!("seed {seed}, energy"));

        // Sum body by body from poses and velocities.
        let com = center_of_mass(tree, &c.ws);
        let (mut h, mut moment) = (Force::zero(), Vec3::zeros());
        for b in tree.multibody().body_ids() {
            let (X, V) = (c.ws.body_pose(tree, b), c.ws.body_velocity(tree, b));
            if tree.multibody().ancestors(b).all(|a| tree.multibody().get(a).v().is_empty()) {
                continue; // welded to the world
            }
            let I = tree.multibody().get(b).inertia().rotate(&X.rotation);
            h += I.apply(&V).shift_to_parent(&(X.position - com));
            moment += X.position * I.mass() + I.h();
        }
        close((moment / tree.total_mass()).as_slice(), com.as_slice(), 1e-13, "com");
        let got = momentum(tree, &c.ws);
        close(got.force.as_slice(), h.force.as_slice(), 1e-12, &format!("seed {seed}, linear"));
        close(got.moment.as_slice(), h.moment.as_slice(), 1e-12, &format!("seed {seed}, angular"));
        let v = com_velocity(tree, &c.ws) * tree.total_mass();
        close(v.as_slice(), h.force.as_slice(), 1e-12, "com velocity");
    }
}

#[test]
fn floating_tree_composite_inertia_is_the_root_block_of_the_mass_matrix() {
    for seed in (0..20).map(|s| 2 * s) {
        let mut c = case(seed, false);
        let (tree, nv) = (&c.tree, c.tree.nv());
        let root = tree.multibody().body_ids().next().unwrap();
        let body = tree.multibody().get(root);
        let mut M = vec![0.0; nv * nv];
        mass_matrix(tree, &mut c.ws, &mut M);
        // The free hinge's rates are the velocity of the hinge frame in its own axes.
        let X_WJ = c.ws.body_pose(tree, root) * body.hinge_in_body();
        let I: RigidInertia = subtree_inertia(tree, &c.ws, root)
            .shift_to_parent(&-(X_WJ.position - c.ws.body_pose(tree, root).position))
            .rotate(&X_WJ.rotation.inverse());
        for j in 0..6 {
            let e = |k: usize| if k == j { 1.0 } else { 0.0 };
            let V = spatial::Motion::new(Vec3::new(e(0), e(1), e(2)), Vec3::new(e(3), e(4), e(5)));
            let f = I.apply(&V);
            let want: Vec<f64> = f.moment.iter().chain(f.force.iter()).copied().collect();
            let got: Vec<f64> = (0..6).map(|i| M[i * nv + j]).collect();
            close(&got, &want, 1e-12, &format!("seed {seed}, column {j}"));
        }
    }
}

#[test]
fn velocities_and_accelerations_are_derivatives_of_poses() {
    for seed in 0..20 {
        let mut c = case(seed, false);
        let (mbs, nv) = (c.tree.multibody().clone(), c.tree.nv());
        let a = Rng(seed + 31).vec(nv);
        let mut sink = vec![0.0; nv];
        inverse_dynamics(&c.tree, &mut c.ws, &c.q, &c.v, &a, &mut sink);
        let h = 1e-5;
        let at = |t: f64| {
            // Move along a path with rates v + a t; second order is enough for central differences.
            let dv: Vec<f64> = c.v.iter().zip(&a).map(|(v, a)| v * t + 0.5 * a * t * t).collect();
            let v: Vec<f64> = c.v.iter().zip(&a).map(|(v, a)| v + a * t).collect();
            let mut q = c.q.clone();
            mbs.integrate(&c.q, &dv, &mut q);
            let mut ws = Workspace::new(&c.tree);
            kinematics(&c.tree, &mut ws, &q, &v);
            ws
        };
        let (minus, plus) = (at(-h), at(h));
        for n in mbs.node_ids() {
            let (Xm, Xp) = (minus.node_pose(&c.tree, n), plus.node_pose(&c.tree, n));
            let V = c.ws.node_velocity(&c.tree, n);
            let v = (Xp.position - Xm.position) / (2.0 * h);
            let w = (Xp.rotation * Xm.rotation.inverse()).scaled_axis() / (2.0 * h);
            near(V.linear.as_slice(), v.as_slice(), 1e-7, &format!("seed {seed}, velocity"));
            near(V.angular.as_slice(), w.as_slice(), 1e-7, &format!("seed {seed}, rate"));
            let A = c.ws.node_acceleration(&c.tree, n);
            let (Vm, Vp) = (minus.node_velocity(&c.tree, n), plus.node_velocity(&c.tree, n));
            let a = (Vp.linear - Vm.linear) / (2.0 * h);
            let al = (Vp.angular - Vm.angular) / (2.0 * h);
            near(A.linear.as_slice(), a.as_slice(), 1e-6, &format!("seed {seed}, acceleration"));
            near(A.angular.as_slice(), al.as_slice(), 1e-6, &format!("seed {seed}, angular"));
        }
    }
}

/// Like `close`, for numbers around one or much smaller.
#[track_caller]
fn near(a: &[f64], b: &[f64], tol: f64, what: &str) {
    let worst = a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    let scale = b.iter().fold(1.0, |s: f64, x| s.max(x.abs()));
    let finite = a.iter().chain(b).all(|x| x.is_finite());
    assert!(finite && worst <= tol * scale, "{what}: {worst:e}\n  got  {a:?}\n  want {b:?}");
}

#[test]
fn batches_agree_with_single_states() {
    for seed in 0..10 {
        let mbs = random_tree(
            seed,
            Shape {
                bodies: 8,
                floating: seed.is_multiple_of(2),
                prescribed: seed.is_multiple_of(3),
                armature: true,
            },
        );
        let tree = Tree::new(&mbs);
        batch(&tree, seed, f64x4::to_array);
        batch(&tree, seed, f64x8::to_array);
    }
}

fn batch<const N: usize, L: Lane + From<[f64; N]>>(
    tree: &Tree,
    seed: u64,
    lanes: impl Fn(L) -> [f64; N],
) {
    let (mbs, nv) = (tree.multibody(), tree.nv());
    let g = Vec3::new(0.5, -2.0, -9.0);
    let qs: Vec<_> = (0..N as u64).map(|j| mbs.random_q(100 * seed + j)).collect();
    let many = |salt: u64| -> Vec<Vec<f64>> {
        (0..N as u64).map(|j| mbs.random_v(1000 * seed + 50 * salt + j)).collect()
    };
    let (vs, ts, accs) = (many(1), many(2), many(3));
    let pack = |x: &[Vec<f64>]| -> Vec<L> {
        (0..x[0].len()).map(|i| L::from(std::array::from_fn(|j| x[j][i]))).collect()
    };
    let (q, v, mut tau, mut vdot) = (pack(&qs), pack(&vs), pack(&ts), pack(&accs));
    let mut work = Batch::<L>::new(tree);
    work.set_uniform_gravity(g);
    let node = mbs.node("n04").unwrap();
    let (moment, force) = (Vec3::new(0.4, -0.7, 1.1), Vec3::new(2.0, 0.6, -0.9));
    let splat = |x: Vec3| [L::splat(x.x), L::splat(x.y), L::splat(x.z)];
    work.kinematics(tree, &q, &v);
    work.add_wrench_at_node(tree, node, splat(moment), splat(force));
    work.forward_dynamics_given_kinematics(tree, &mut tau, &mut vdot).unwrap();
    let (mut inverse, mut M) = (tau.clone(), vec![L::splat(0.0); nv * nv]);
    work.inverse_dynamics(tree, &q, &v, &vdot, &mut inverse);
    work.mass_matrix(tree, &mut M);
    let mut ws = Workspace::new(tree);
    ws.apply_uniform_gravity(g);
    for j in 0..N {
        let (mut t, mut a, mut m) = (ts[j].clone(), accs[j].clone(), vec![0.0; nv * nv]);
        kinematics(tree, &mut ws, &qs[j], &vs[j]);
        ws.clear_forces();
        ws.apply_uniform_gravity(g);
        ws.add_wrench_at_node(tree, node, Force::new(moment, force));
        forward_dynamics_given_kinematics(tree, &mut ws, &mut t, &mut a).unwrap();
        let p = work.node_position(tree, node).map(|x| lanes(x)[j]);
        close(&p, ws.node_pose(tree, node).position.as_slice(), 1e-13, "node position");
        let v = work.node_velocity(tree, node).1.map(|x| lanes(x)[j]);
        close(&v, ws.node_velocity(tree, node).linear.as_slice(), 1e-13, "node velocity");
        mass_matrix(tree, &mut ws, &mut m);
        let lane = |x: &[L]| -> Vec<f64> { x.iter().map(|x| lanes(*x)[j]).collect() };
        let place = format!("seed {seed}, lane {j}");
        close(&lane(&vdot), &a, 1e-10, &place);
        close(&lane(&tau), &t, 1e-10, &place);
        close(&lane(&inverse), &t, 1e-10, &place);
        close(&lane(&M), &m, 1e-12, &place);
    }
}

#[test]
fn gravity_by_field_equals_uniform_gravity() {
    for seed in 0..20 {
        let mut c = case(seed, false);
        let nv = c.tree.nv();
        let g = Vec3::new(0.3, -1.1, -9.0);
        let (mut a, mut b) = (vec![0.0; nv], vec![0.0; nv]);
        c.ws.clear_forces();
        c.ws.apply_uniform_gravity(g);
        inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &vec![0.0; nv], &mut a);
        c.ws.clear_forces();
        c.ws.apply_gravity(&c.tree, &mut |_| g);
        inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &vec![0.0; nv], &mut b);
        assert!(relative_error(&a, &b) < 1e-12, "seed {}", c.seed);
        c.ws.clear_forces();
        for id in c.tree.multibody().body_ids() {
            let m = c.tree.multibody().get(id).inertia().mass();
            c.ws.add_force_at_com(&c.tree, id, g * m);
        }
        inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &vec![0.0; nv], &mut b);
        assert!(relative_error(&a, &b) < 1e-12, "seed {}", c.seed);
    }
}

//! Conservation and gradient tests: energy, momentum, gravity, the power of Coriolis forces.

use crate::support::{Rng, Shape, close, random_tree};
use linkwork_dynamics::multibody::Multibody;
use linkwork_dynamics::spatial::{Force, Vec3};
use linkwork_dynamics::*;

const G: [f64; 3] = [0.4, -1.3, -9.0];

fn floating(seed: u64) -> Multibody {
    random_tree(seed, Shape { bodies: 7, floating: true, prescribed: false, armature: false })
}

/// Makes one classical Runge–Kutta step on the elements of q and v.
fn rk4(tree: &Tree, ws: &mut Workspace, q: &mut [f64], v: &mut [f64], h: f64) {
    let (mbs, nv) = (tree.multibody(), v.len());
    let (q0, v0) = (q.to_vec(), v.to_vec());
    let (mut dq, mut dv) = (vec![0.0; q.len()], vec![0.0; nv]);
    let (mut sum_q, mut sum_v) = (vec![0.0; q.len()], vec![0.0; nv]);
    for (step, weight) in [(0.5, 1.0), (0.5, 2.0), (1.0, 2.0), (0.0, 1.0)] {
        forward_dynamics(tree, ws, q, v, &mut vec![0.0; nv], &mut dv).unwrap();
        mbs.qdot(q, v, &mut dq);
        for i in 0..q.len() {
            sum_q[i] += weight * dq[i];
            q[i] = q0[i] + step * h * dq[i];
        }
        for i in 0..nv {
            sum_v[i] += weight * dv[i];
            v[i] = v0[i] + step * h * dv[i];
        }
    }
    for i in 0..q.len() {
        q[i] = q0[i] + h / 6.0 * sum_q[i];
    }
    for i in 0..nv {
        v[i] = v0[i] + h / 6.0 * sum_v[i];
    }
    mbs.normalize(q);
}

fn energy(tree: &Tree, ws: &mut Workspace, q: &[f64], v: &[f64]) -> f64 {
    kinematics(tree, ws, q, v);
    kinetic_energy(tree, ws, v) - tree.total_mass() * Vec3::from(G).dot(&center_of_mass(tree, ws))
}

#[test]
fn energy_drift_falls_at_the_order_of_the_integrator() {
    for seed in [2, 4, 6] {
        let mbs = floating(seed);
        let tree = Tree::new(&mbs);
        let mut ws = Workspace::new(&tree);
        ws.apply_uniform_gravity(Vec3::from(G));
        let drift = |ws: &mut Workspace, n: usize| {
            let (mut q, mut v) = (mbs.random_q(seed), mbs.random_v(seed));
            let E0 = energy(&tree, ws, &q, &v);
            for _ in 0..n {
                rk4(&tree, ws, &mut q, &mut v, 0.1 / n as f64);
            }
            energy(&tree, ws, &q, &v) - E0
        };
        let errors = [40, 80, 160].map(|n| drift(&mut ws, n));
        // Halving the step divides the error by 16 for order 4 and by 32 for order 5 (energy often
        // gains one order). Measured: 15 to 25.
        for pair in errors.windows(2) {
            let ratio = (pair[0] / pair[1]).abs();
            assert!((12.0..45.0).contains(&ratio), "seed {seed}: {errors:?}, ratio {ratio}");
        }
    }
}

#[test]
fn momentum_of_a_floating_tree_does_not_change() {
    for seed in 0..10 {
        let mbs = floating(seed);
        let tree = Tree::new(&mbs);
        let mut ws = Workspace::new(&tree);
        let (q, v) = (mbs.random_q(seed), mbs.random_v(seed));
        // Apply internal forces only: no force acts on the free base.
        let mut tau = Rng(seed + 3).vec(tree.nv());
        tau[..6].fill(0.0);
        let mut vdot = vec![0.0; tree.nv()];
        forward_dynamics(&tree, &mut ws, &q, &v, &mut tau, &mut vdot).unwrap();
        // Rate of change of the momentum, body by body from the accelerations: Σ φ(com,b) d/dt(M
        // V).
        let com = center_of_mass(&tree, &ws);
        let (mut total, mut size) = (Force::zero(), 0.0_f64);
        for b in mbs.body_ids() {
            let (X, V) = (ws.body_pose(&tree, b), ws.body_velocity(&tree, b));
            let A = ws.body_acceleration(&tree, b);
            let I = mbs.get(b).inertia().rotate(&X.rotation);
            let (w, h) = (V.angular, I.h());
            let mut f = I.apply(&A);
            f.moment += w.cross(&(I.inertia() * w));
            f.force += w.cross(&w.cross(&h));
            let f = f.shift_to_parent(&(X.position - com));
            size = size.max(f.moment.norm()).max(f.force.norm());
            total += f;
        }
        let left = total.moment.norm().max(total.force.norm());
        // Measured: 4e-15.
        assert!(left <= 1e-12 * size, "seed {seed}: {left:e} of {size:e}");
        assert!(com_acceleration(&tree, &ws).norm() < 1e-11 * size, "seed {seed}");
    }
}

#[test]
fn momentum_stays_along_a_trajectory() {
    let mbs = floating(12);
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    let (mut q, mut v) = (mbs.random_q(12), mbs.random_v(12));
    kinematics(&tree, &mut ws, &q, &v);
    let before = momentum(&tree, &ws);
    for _ in 0..2000 {
        rk4(&tree, &mut ws, &mut q, &mut v, 5e-5);
    }
    kinematics(&tree, &mut ws, &q, &v);
    let after = momentum(&tree, &ws);
    close(after.force.as_slice(), before.force.as_slice(), 1e-12, "linear");
    close(after.moment.as_slice(), before.moment.as_slice(), 1e-12, "angular");
}

#[test]
fn gravity_force_is_the_gradient_of_potential_energy() {
    for seed in 0..20 {
        let mbs = random_tree(
            seed,
            Shape { bodies: 8, floating: seed.is_multiple_of(2), prescribed: true, armature: true },
        );
        let tree = Tree::new(&mbs);
        let nv = tree.nv();
        let mut ws = Workspace::new(&tree);
        ws.apply_uniform_gravity(Vec3::from(G));
        let (q, zero) = (mbs.random_q(seed), vec![0.0; nv]);
        let mut tau = vec![0.0; nv];
        inverse_dynamics(&tree, &mut ws, &q, &zero, &zero, &mut tau);
        let h = 1e-5;
        let gradient: Vec<f64> = (0..nv)
            .map(|i| {
                let mut U = |s: f64| {
                    let (mut dv, mut moved) = (zero.clone(), q.clone());
                    dv[i] = s * h;
                    mbs.integrate(&q, &dv, &mut moved);
                    energy(&tree, &mut ws, &moved, &zero)
                };
                (U(1.0) - U(-1.0)) / (2.0 * h)
            })
            .collect();
        // Measured: 4e-11, the error of the finite difference.
        close(&tau, &gradient, 1e-9, &format!("seed {seed}"));
    }
}

#[test]
fn coriolis_forces_balance_the_rate_of_the_mass_matrix() {
    // uᵀ (Ṁ u − 2 c) = 0, with c the velocity-dependent forces and Ṁ along the motion.
    for seed in 0..20 {
        let mbs = random_tree(
            seed,
            Shape {
                bodies: 8,
                floating: seed.is_multiple_of(2),
                prescribed: false,
                armature: true,
            },
        );
        let tree = Tree::new(&mbs);
        let nv = tree.nv();
        let mut ws = Workspace::new(&tree);
        let (q, v) = (mbs.random_q(seed), mbs.random_v(seed));
        let mut c = vec![0.0; nv];
        inverse_dynamics(&tree, &mut ws, &q, &v, &vec![0.0; nv], &mut c);
        let h = 1e-5;
        let mut twice_energy = |s: f64| {
            let dv: Vec<f64> = v.iter().map(|v| v * s * h).collect();
            let mut moved = q.clone();
            mbs.integrate(&q, &dv, &mut moved);
            let mut M = vec![0.0; nv * nv];
            kinematics(&tree, &mut ws, &moved, &v);
            mass_matrix(&tree, &mut ws, &mut M);
            (0..nv * nv).map(|k| v[k / nv] * M[k] * v[k % nv]).sum::<f64>()
        };
        let u_Mdot_u = (twice_energy(1.0) - twice_energy(-1.0)) / (2.0 * h);
        let u_c: f64 = v.iter().zip(&c).map(|(v, c)| v * c).sum();
        let size: f64 = v.iter().zip(&c).map(|(v, c)| (v * c).abs()).sum();
        let left = (u_Mdot_u - 2.0 * u_c).abs();
        assert!(left < 1e-8 * size, "seed {seed}: {left:e} of {size:e}");
    }
}

#[test]
fn external_power_is_the_rate_of_energy() {
    for seed in 0..20 {
        let mbs = random_tree(
            seed,
            Shape { bodies: 8, floating: seed.is_multiple_of(2), prescribed: true, armature: true },
        );
        let tree = Tree::new(&mbs);
        let nv = tree.nv();
        let mut ws = Workspace::new(&tree);
        let (q, v) = (mbs.random_q(seed), mbs.random_v(seed));
        kinematics(&tree, &mut ws, &q, &v);
        let mut r = Rng(seed + 1);
        let mut power = 0.0;
        for n in mbs.node_ids() {
            let f = Force::new(r.vec3(), r.vec3());
            ws.add_wrench_at_node(&tree, n, f);
            power += ws.node_velocity(&tree, n).dot(&f);
        }
        let (mut tau, mut vdot) = (r.vec(nv), r.vec(nv));
        forward_dynamics_given_kinematics(&tree, &mut ws, &mut tau, &mut vdot).unwrap();
        power += tau.iter().zip(&v).map(|(t, v)| t * v).sum::<f64>();
        let h = 1e-5;
        let mut T = |s: f64| {
            let dv: Vec<f64> =
                v.iter().zip(&vdot).map(|(v, a)| s * h * (v + 0.5 * s * h * a)).collect();
            let rates: Vec<f64> = v.iter().zip(&vdot).map(|(v, a)| v + s * h * a).collect();
            let mut moved = q.clone();
            mbs.integrate(&q, &dv, &mut moved);
            kinematics(&tree, &mut ws, &moved, &rates);
            kinetic_energy(&tree, &ws, &rates)
        };
        let rate = (T(1.0) - T(-1.0)) / (2.0 * h);
        let size = tau.iter().zip(&v).map(|(t, v)| (t * v).abs()).fold(1.0, f64::max);
        assert!((rate - power).abs() < 1e-6 * size, "seed {seed}: {rate} is not {power}");
    }
}

//! Analytic tests: Euler's equations, a screw, a slider, distance from the origin.
//! Whole motions are in `closed_forms.rs`.

use crate::support::{Rng, Shape, close, random_tree, relative_error};
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::{Force, MassProperties, Mat3, Vec3};
use linkwork_dynamics::*;

fn one(body: BodySpec) -> Multibody {
    let mut b = Builder::new();
    b.body(body);
    b.build().unwrap()
}

#[test]
fn euler_top_as_ball_and_as_free_body() {
    // J ω̇ = T − ω × Jω; free: m (v̇ + ω × v) = F, all in body axes.
    let J = Vec3::new(0.3, 0.5, 0.7);
    let mass = MassProperties::new(2.0, Vec3::zeros(), Mat3::from_diagonal(&J));
    let mut r = Rng(3);
    for hinge in [Hinge::ball(), Hinge::free()] {
        let mbs = one(BodySpec::new("top", "world").hinge(hinge).mass(mass));
        let tree = Tree::new(&mbs);
        let (mut ws, nv) = (Workspace::new(&tree), mbs.nv());
        let q = mbs.random_q(6);
        let (v, mut tau) = (r.vec(nv), r.vec(nv));
        let mut vdot = vec![0.0; nv];
        forward_dynamics(&tree, &mut ws, &q, &v, &mut tau, &mut vdot).unwrap();
        let (w, T) = (Vec3::from_column_slice(&v[..3]), Vec3::from_column_slice(&tau[..3]));
        let Jw = J.component_mul(&w);
        let mut want = (T - w.cross(&Jw)).component_div(&J).as_slice().to_vec();
        if nv == 6 {
            let (u, F) = (Vec3::from_column_slice(&v[3..]), Vec3::from_column_slice(&tau[3..]));
            want.extend_from_slice((F / 2.0 - w.cross(&u)).as_slice());
        }
        close(&vdot, &want, 1e-14, "Euler");
    }
}

#[test]
fn screw_slider_and_armature_by_hand() {
    // A nut of mass m and axial inertia J on a screw with pitch s, rotor A: (J + m s² + A) q̈ = T + s F.
    let (m, J, s, A, F, T) = (1.5, 0.2, 0.3, 0.07, 4.0, 1.1);
    let mass = MassProperties::new(m, Vec3::zeros(), Mat3::identity() * J);
    let axis = Vec3::new(1.0, 2.0, -2.0);
    let mbs =
        one(BodySpec::new("nut", "world").hinge(Hinge::screw(axis, s).armature(A)).mass(mass));
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    kinematics(&tree, &mut ws, &[0.8], &[2.0]);
    let nut = mbs.body("nut").unwrap();
    close(
        ws.body_pose(&tree, nut).position.as_slice(),
        (axis / 3.0 * s * 0.8).as_slice(),
        1e-14,
        "advance",
    );
    ws.add_force_at_com(&tree, nut, axis / 3.0 * F);
    let mut vdot = [0.0];
    forward_dynamics_given_kinematics(&tree, &mut ws, &mut [T], &mut vdot).unwrap();
    close(&vdot, &[(T + s * F) / (J + m * s * s + A)], 1e-14, "screw");
    let E = kinetic_energy(&tree, &ws, &[2.0]);
    close(&[E], &[0.5 * (J + m * s * s + A) * 4.0], 1e-14, "energy");

    let mbs = one(BodySpec::new("cart", "world").hinge(Hinge::slider(axis).armature(A)).mass(mass));
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    forward_dynamics(&tree, &mut ws, &[0.4], &[1.0], &mut [T], &mut vdot).unwrap();
    close(&vdot, &[T / (m + A)], 1e-14, "slider");
}

#[test]
fn distance_from_the_world_origin_does_not_matter() {
    for seed in 0..10 {
        let mbs = random_tree(
            2 * seed,
            Shape { bodies: 8, floating: true, prescribed: seed.is_multiple_of(2), armature: true },
        );
        let tree = Tree::new(&mbs);
        let nv = mbs.nv();
        let (q, v) = (mbs.random_q(seed), mbs.random_v(seed));
        let run = |far: f64| {
            let mut q = q.clone();
            for (x, k) in q[..3].iter_mut().zip([0.6, -0.5, 0.62]) {
                *x += far * k;
            }
            let mut ws = Workspace::new(&tree);
            let mut r = Rng(seed + 1);
            let (mut tau, mut vdot) = (r.vec(nv), r.vec(nv));
            kinematics(&tree, &mut ws, &q, &v);
            for n in mbs.node_ids() {
                ws.add_wrench_at_node(&tree, n, Force::new(r.vec3(), r.vec3()));
            }
            ws.apply_uniform_gravity(Vec3::new(0.1, 0.2, -3.0));
            forward_dynamics_given_kinematics(&tree, &mut ws, &mut tau, &mut vdot).unwrap();
            let mut back = vec![0.0; nv];
            inverse_dynamics_given_kinematics(&tree, &mut ws, &vdot, &mut back);
            vdot.extend(tau);
            vdot.extend(back);
            vdot
        };
        let near = run(0.0);
        for far in [1e3, 1e6, 1.5e11] {
            let e = relative_error(&run(far), &near);
            // Measured: 0, because the world position has no influence.
            assert!(e <= 1e-9, "seed {seed}, {far} m: {e:e}");
        }
    }
}

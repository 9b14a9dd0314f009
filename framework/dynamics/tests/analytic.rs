//! Analytic wall: double pendulum by hand, Euler's equations, a screw, distance from the origin.
#![allow(non_snake_case, clippy::unwrap_used)]

mod support;

use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::{Force, MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::*;
use support::{Rng, Shape, close, random_tree, relative_error};

fn one(body: BodySpec) -> Multibody {
    let mut b = Builder::new();
    b.body(body);
    b.build().unwrap()
}

#[test]
fn double_pendulum_by_hand() {
    // Point masses m1, m2 on massless rods a1, a2 turning about −y, hanging along −z at q = 0;
    // q2 is relative. Lagrange:
    //   M11 = (m1+m2) a1² + m2 a2² + 2 m2 a1 a2 c2,  M12 = m2 a2² + m2 a1 a2 c2,  M22 = m2 a2²
    //   C1 = −m2 a1 a2 s2 (2 u1 u2 + u2²),           C2 = m2 a1 a2 s2 u1²
    //   G1 = (m1+m2) g a1 s1 + m2 g a2 s12,          G2 = m2 g a2 s12
    let (m1, m2, a1, a2, g) = (1.3, 0.7, 0.9, 0.6, 9.81);
    let bob = |m: f64, a: f64| MassProperties::new(m, Vec3::new(0.0, 0.0, -a), Mat3::zeros());
    let mut b = Builder::new();
    b.body(BodySpec::new("upper", "world").hinge(Hinge::pin(-Vec3::y())).mass(bob(m1, a1)));
    b.body(
        BodySpec::new("lower", "upper")
            .hinge_in_parent(Pose::translation(0.0, 0.0, -a1))
            .hinge(Hinge::pin(-Vec3::y()))
            .mass(bob(m2, a2)),
    );
    let tree = Tree::new(&b.build().unwrap());
    let mut ws = Workspace::new(&tree);
    let mut r = Rng(8);
    for _ in 0..20 {
        let (q, u, mut tau) = (r.vec(2), r.vec(2), r.vec(2));
        let (s1, s2, c2, s12) = (q[0].sin(), q[1].sin(), q[1].cos(), (q[0] + q[1]).sin());
        let k = m2 * a1 * a2;
        let (M11, M12, M22) = (
            (m1 + m2) * a1 * a1 + m2 * a2 * a2 + 2.0 * k * c2,
            m2 * a2 * a2 + k * c2,
            m2 * a2 * a2,
        );
        let r1 = tau[0] + k * s2 * (2.0 * u[0] * u[1] + u[1] * u[1])
            - (m1 + m2) * g * a1 * s1
            - m2 * g * a2 * s12;
        let r2 = tau[1] - k * s2 * u[0] * u[0] - m2 * g * a2 * s12;
        let det = M11 * M22 - M12 * M12;
        let want = [(M22 * r1 - M12 * r2) / det, (M11 * r2 - M12 * r1) / det];
        let mut vdot = [0.0; 2];
        ws.clear_forces();
        ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -g));
        forward_dynamics(&tree, &mut ws, &q, &u, &mut tau, &mut vdot).unwrap();
        close(&vdot, &want, 1e-13, "double pendulum");
    }
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
            // Measured 0: the world position takes no part.
            assert!(e <= 1e-9, "seed {seed}, {far} m: {e:e}");
        }
    }
}

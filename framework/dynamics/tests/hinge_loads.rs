//! Hinge loads: sums over the outboard bodies, efforts of forward dynamics, closed forms; queries do not change the workspace.

use crate::support::{Rng, Shape, close, random_tree};
use linkwork_dynamics::multibody::{BodySpec, Builder, Coordinate, Hinge};
use linkwork_dynamics::spatial::{Force, MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::*;

fn load(loads: &HingeLoads, tree: &Tree, ws: &Workspace, body: &str) -> Force {
    loads.load(tree, ws, tree.multibody().body(body).unwrap())
}

/// Newton–Euler equations for each body outboard of a hinge, from poses, velocities and accelerations.
#[test]
fn a_load_is_the_sum_over_the_bodies_outboard() {
    let mut count = 0;
    for seed in 0..60 {
        let shape = Shape {
            bodies: 8,
            floating: seed % 2 == 0,
            prescribed: seed % 3 != 0,
            armature: seed % 5 == 0,
        };
        let mbs = random_tree(seed, shape);
        let tree = Tree::new(&mbs);
        let (q, v, nv) = (mbs.random_q(seed), mbs.random_v(seed), mbs.nv());
        let mut ws = Workspace::new(&tree);
        kinematics(&tree, &mut ws, &q, &v);
        let mut r = Rng(seed ^ 91);
        let g = r.vec3() * 5.0;
        ws.apply_uniform_gravity(g);
        let wrenches: Vec<Force> = mbs.node_ids().map(|_| Force::new(r.vec3(), r.vec3())).collect();
        for (n, w) in mbs.node_ids().zip(&wrenches) {
            ws.add_wrench_at_node(&tree, n, *w);
        }
        let (mut tau, mut vdot) = (r.vec(nv), r.vec(nv));
        forward_dynamics_given_kinematics(&tree, &mut ws, &mut tau, &mut vdot).unwrap();
        let before: Vec<_> = mbs.body_ids().map(|b| ws.body_acceleration(&tree, b)).collect();
        let external: Vec<_> = mbs.body_ids().map(|b| ws.external_wrench(&tree, b)).collect();
        let mut loads = HingeLoads::new(&tree);
        loads.begin(&ws);
        loads.find(&tree, &mut ws, &vdot);
        // The hinge efforts must equal the efforts of forward dynamics. Measured: at most 1e-12.
        close(loads.efforts(), &tau, 1e-11, &format!("seed {seed}, efforts"));
        for (b, a) in mbs.body_ids().zip(&before) {
            assert_eq!(ws.body_acceleration(&tree, b), *a, "seed {seed}: a trace is left");
            assert_eq!(ws.external_wrench(&tree, b), external[b.index()], "seed {seed}");
        }
        for body in mbs.body_ids().filter(|b| !mbs.get(*b).v().is_empty()) {
            let frame = ws.body_pose(&tree, body) * mbs.get(body).hinge_in_body();
            let (o, mut force, mut moment) = (frame.position, Vec3::zeros(), Vec3::zeros());
            for j in mbs.subtree(body) {
                let (I, X) = (mbs.get(j).mass_properties(), ws.body_pose(&tree, j));
                let (V, A) = (ws.body_velocity(&tree, j), ws.body_acceleration(&tree, j));
                let (R, w) = (X.rotation.to_rotation_matrix().into_inner(), V.angular);
                let c = R * I.com;
                let a = A.linear + A.angular.cross(&c) + w.cross(&w.cross(&c));
                let J = R * I.inertia_com * R.transpose();
                let f = (a - g) * I.mass;
                force += f;
                moment += J * A.angular + w.cross(&(J * w)) + (X.position + c - o).cross(&f);
            }
            for (n, w) in mbs.node_ids().zip(&wrenches) {
                if mbs.subtree(body).any(|j| j == mbs.get_node(n).body()) {
                    let p = ws.node_pose(&tree, n).position;
                    force -= w.force;
                    moment -= w.moment + (p - o).cross(&w.force);
                }
            }
            let found = loads.load(&tree, &ws, body);
            let back = frame.rotation.inverse();
            let got = [found.force, found.moment].map(|x| [x.x, x.y, x.z]).concat();
            let want = [back * force, back * moment].map(|x| [x.x, x.y, x.z]).concat();
            let size = force.norm() + moment.norm() + 100.0;
            let error = got.iter().zip(&want).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            // Measured: at most 2e-12.
            assert!(error < 1e-10 * size, "seed {seed} {body:?}: {got:?} {want:?}");
            count += 1;
        }
    }
    assert!(count > 300);
}

/// A mass m at the end of a massless arm of length r on a driven pin: m ω² r inwards, m r α tangentially, and the torque m r² α.
#[test]
fn a_spinning_arm_pulls_with_m_omega_squared_r() {
    let (m, r, w, alpha) = (2.0, 0.7, 3.0, 1.3);
    let mut hinge = Hinge::pin(Vec3::z());
    hinge.subhinges[0].coordinate = Coordinate::Prescribed;
    let mut b = Builder::new();
    let mass = MassProperties::new(m, Vec3::new(r, 0.0, 0.0), Mat3::identity() * 1e-12);
    b.body(BodySpec::new("arm", "world").hinge(hinge).mass(mass));
    let tree = Tree::new(&b.build().unwrap());
    let mut ws = Workspace::new(&tree);
    kinematics(&tree, &mut ws, &[0.4], &[w]);
    let (mut tau, mut vdot) = ([0.0], [alpha]);
    forward_dynamics_given_kinematics(&tree, &mut ws, &mut tau, &mut vdot).unwrap();
    let mut loads = HingeLoads::new(&tree);
    loads.begin(&ws);
    loads.find(&tree, &mut ws, &vdot);
    // The axes are fixed to the arm: x points outwards.
    let f = load(&loads, &tree, &ws, "arm");
    assert!((f.force - Vec3::new(-m * w * w * r, m * r * alpha, 0.0)).norm() < 1e-12, "{f:?}");
    assert!((f.moment - Vec3::new(0.0, 0.0, m * r * r * alpha)).norm() < 1e-11, "{f:?}");
    assert!((loads.efforts()[0] - m * r * r * alpha).abs() < 1e-11);
}

/// A cantilever of two bars on locked joints, written as fixed pins: the wall carries (m₁ + m₂) g and the moment of both weights.
#[test]
fn a_static_beam_carries_its_weight() {
    let (m, l, g) = ([3.0, 2.0], 0.8, 9.81);
    let mut held = Hinge::pin(Vec3::z());
    held.subhinges[0].coordinate = Coordinate::Prescribed;
    let mut b = Builder::new();
    for (k, parent) in ["world", "b0"].into_iter().enumerate() {
        let mass = MassProperties::new(m[k], Vec3::new(l / 2.0, 0.0, 0.0), Mat3::identity() * 0.1);
        let at = Pose::translation(if k == 0 { 0.0 } else { l }, 0.0, 0.0);
        let spec = BodySpec::new(format!("b{k}"), parent).hinge_in_parent(at);
        b.body(spec.hinge(held.clone()).mass(mass));
    }
    let tree = Tree::new(&b.build().unwrap());
    let mut ws = Workspace::new(&tree);
    kinematics(&tree, &mut ws, &[0.0; 2], &[0.0; 2]);
    ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -g));
    let mut loads = HingeLoads::new(&tree);
    loads.begin(&ws);
    loads.find(&tree, &mut ws, &[0.0; 2]);
    let [wall, joint] = ["b0", "b1"].map(|b| load(&loads, &tree, &ws, b));
    assert!((wall.force - Vec3::new(0.0, 0.0, (m[0] + m[1]) * g)).norm() < 1e-12, "{wall:?}");
    let moment = g * (m[0] * l / 2.0 + m[1] * 1.5 * l);
    assert!((wall.moment - Vec3::new(0.0, -moment, 0.0)).norm() < 1e-12, "{wall:?} {moment}");
    assert!((joint.force - Vec3::new(0.0, 0.0, m[1] * g)).norm() < 1e-12, "{joint:?}");
    assert!((joint.moment - Vec3::new(0.0, -m[1] * g * l / 2.0, 0.0)).norm() < 1e-12);
}

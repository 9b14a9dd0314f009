//! No algorithm allocates after set-up (law 9): counted by the global allocator.
#![allow(non_snake_case, clippy::unwrap_used)]

mod support;

use linkwork_dynamics::spatial::{Force, Vec3};
use linkwork_dynamics::*;
use std::hint::black_box;
use support::{Shape, random_tree};

#[test]
fn nothing_is_allocated_after_set_up() {
    let mbs =
        random_tree(10, Shape { bodies: 12, floating: true, prescribed: true, armature: true });
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    let (nv, n) = (mbs.nv(), mbs.node("n05").unwrap());
    let body = mbs.body("b03").unwrap();
    let (mut q, v) = (mbs.random_q(1), mbs.random_v(1));
    let (mut tau, mut vdot, mut M) = (mbs.random_v(2), mbs.random_v(3), vec![0.0; nv * nv]);
    let (mut moved, mut dv) = (q.clone(), v.clone());

    let counted = allocation_counter::measure(|| {
        poses(&tree, &mut ws, &q);
        kinematics(&tree, &mut ws, &q, &v);
        ws.clear_forces();
        ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
        ws.apply_gravity(&tree, &mut |p| -p * 1e-3);
        ws.add_wrench_at_node(&tree, n, Force::new(Vec3::x(), Vec3::y()));
        ws.add_force_at_com(&tree, body, Vec3::z());
        forward_dynamics_given_kinematics(&tree, &mut ws, &mut tau, &mut vdot).unwrap();
        inverse_dynamics(&tree, &mut ws, &q, &v, &vdot, &mut tau);
        mass_matrix(&tree, &mut ws, &mut M);
        black_box((ws.node_pose(&tree, n), ws.node_velocity(&tree, n)));
        black_box((ws.node_acceleration(&tree, n), ws.body_com(&tree, body)));
        black_box((momentum(&tree, &ws), kinetic_energy(&tree, &ws, &v)));
        black_box((center_of_mass(&tree, &ws), com_acceleration(&tree, &ws)));
        black_box(subtree_inertia(&tree, &ws, body));
        mbs.qdot(&q, &v, &mut moved);
        mbs.integrate(&q, &v, &mut moved);
        mbs.difference(&q, &moved, &mut dv);
        mbs.normalize(&mut q);
    });
    assert_eq!(counted.count_total, 0, "allocations while stepping");
    let seen = allocation_counter::measure(|| drop(black_box(vec![1])));
    assert_eq!(seen.count_total, 1, "the counter counts");
}

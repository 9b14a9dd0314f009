//! Algorithms do not allocate after set-up (rule 9 of ARCHITECTURE.md); the global allocator counts.

use crate::support::{Shape, random_tree};
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge};
use linkwork_dynamics::spatial::{Force, MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::*;
use std::hint::black_box;

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

    let [mut X, mut Dq, mut Dv] = [(); 3].map(|()| vec![0.0; nv * nv]);
    let (mut J, mut Y) = (vec![0.0; 6 * nv], vec![0.0; nv * PARAMETERS * mbs.bodies().len()]);
    let mut compliance = Compliance::new(&tree, &[n, mbs.node("n11").unwrap()]);
    let mut L = vec![0.0; compliance.size() * compliance.size()];
    let mut d = Derivatives::new(&tree);
    let (mut prediction, mut P) = (Prediction::new(&tree), vec![0.0; 4 * nv * nv]);
    let (density, given) = (vec![1.0; nv], vec![0.0; nv]);
    let (mut known_q, mut known_v) = (q.clone(), v.clone());

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
        inverse_mass_matrix(&tree, &mut ws, &mut X).unwrap();
        apply_inverse_mass(&tree, &mut ws, &mut tau).unwrap();
        node_jacobian(&tree, &ws, n, &mut J);
        body_jacobian(&tree, &ws, body, &mut J);
        node_jacobian_at(&tree, &mut ws, &q, n, &mut J);
        node_jacobian_rate(&tree, &ws, n, &mut J);
        node_jacobian_transpose_product(&tree, &ws, n, &Force::zero(), &mut tau);
        black_box(node_jacobian_product(&tree, &ws, n, &v));
        centroidal_matrix(&tree, &mut ws, &mut J);
        com_jacobian(&tree, &mut ws, &mut J[..3 * nv]);
        black_box((centroidal_bias(&tree, &ws), potential_energy(&tree, &ws)));
        compliance.compute(&tree, &mut ws, &mut L).unwrap();
        regressor(&tree, &ws, &mut Y);
        d.inverse_dynamics(&tree, &mut ws, &v, &vdot, &mut Dq, &mut Dv);
        let state = StateEstimate { q: &mut known_q, v: &mut known_v, covariance: &mut P };
        let gravity = Vec3::new(0.0, 0.0, -9.81);
        let drive = Drive { tau: &given, vdot: &given, density: &density, gravity, step: 1e-3 };
        prediction.step(&tree, &mut ws, state, drive).unwrap();
        kinematics(&tree, &mut ws, &q, &v);
        let out = ForwardDerivatives { dvdot_dq: &mut Dq, dvdot_dv: &mut Dv, dvdot_dtau: &mut X };
        d.forward_dynamics(&tree, &mut ws, &v, &mut tau, &mut vdot, out).unwrap();
        mbs.qdot(&q, &v, &mut moved);
        mbs.integrate(&q, &v, &mut moved);
        mbs.difference(&q, &moved, &mut dv);
        mbs.normalize(&mut q);
    });
    assert_eq!(counted.count_total, 0, "allocations while stepping");
    let seen = allocation_counter::measure(|| drop(black_box(vec![1])));
    assert_eq!(seen.count_total, 1, "the counter counts");
}

#[test]
fn nothing_is_allocated_with_flexible_bodies() {
    use linkwork_dynamics::multibody::Builder;
    use linkwork_dynamics::multibody::modes::{Attachment, Beam, BeamModes};
    let shape = Shape { bodies: 6, floating: true, prescribed: true, armature: true };
    let mut b = Builder::from(&random_tree(4, shape));
    let count = BeamModes { bending_y: 2, bending_z: 1, twist: 1, stretch: 1 };
    let mut modes = Beam::tube(1.0, 0.03, 0.02, 7e10, 0.3, 2700.0).modes(count).unwrap();
    modes.attachment = Attachment::Nearest { tolerance: 10.0 };
    b.bodies_mut().iter_mut().step_by(2).for_each(|b| b.modes = Some(modes.clone()));
    let mbs = b.build().unwrap();
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    let (nv, n, body) = (mbs.nv(), mbs.node("n04").unwrap(), mbs.body("b02").unwrap());
    let (q, v) = (mbs.random_q(1), mbs.random_v(1));
    let (mut tau, mut vdot, mut M) = (mbs.random_v(2), mbs.random_v(3), vec![0.0; nv * nv]);
    let (mut J, mut L) = (vec![0.0; 6 * nv], vec![0.0; 36]);
    let mut compliance = Compliance::new(&tree, &[n]);
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
        inverse_mass_matrix(&tree, &mut ws, &mut M).unwrap();
        apply_inverse_mass(&tree, &mut ws, &mut tau).unwrap();
        compliance.compute(&tree, &mut ws, &mut L).unwrap();
        node_jacobian(&tree, &ws, n, &mut J);
        node_jacobian_rate(&tree, &ws, n, &mut J);
        centroidal_matrix(&tree, &mut ws, &mut J);
        com_jacobian(&tree, &mut ws, &mut J[..3 * nv]);
        black_box((
            ws.node_pose(&tree, n),
            ws.node_velocity(&tree, n),
            ws.node_acceleration(&tree, n),
        ));
        black_box((
            momentum(&tree, &ws),
            kinetic_energy(&tree, &ws, &v),
            elastic_energy(&tree, &ws),
        ));
        black_box((
            center_of_mass(&tree, &ws),
            com_acceleration(&tree, &ws),
            ws.body_com(&tree, body),
        ));
        black_box((centroidal_bias(&tree, &ws), potential_energy(&tree, &ws)));
    });
    assert_eq!(counted.count_total, 0, "allocations while stepping");
}

#[test]
fn a_chain_with_a_node_on_each_body_takes_memory_in_proportion_to_its_length() {
    let bytes = |n: usize| {
        let mut b = Builder::new();
        for i in 0..n {
            let parent = if i == 0 { "world".to_string() } else { format!("b{}", i - 1) };
            let X = Pose::translation(0.1, 0.0, 0.0);
            let mass = MassProperties::new(1.0, Vec3::zeros(), Mat3::identity());
            let hinge = Hinge::pin(Vec3::y());
            b.body(
                BodySpec::new(format!("b{i}"), parent).hinge_in_parent(X).hinge(hinge).mass(mass),
            );
            b.node(format!("n{i}"), format!("b{i}"), X);
        }
        let mbs = b.build().unwrap();
        let counted = allocation_counter::measure(|| {
            black_box(Tree::new(&mbs));
        });
        counted.bytes_max as f64
    };
    let (half, whole) = (bytes(2000), bytes(4000));
    assert!(whole < 2.2 * half, "{half} bytes for half of {whole}");
}

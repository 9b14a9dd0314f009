//! External reference: compares every available quantity with Pinocchio 4.1, five robots × 20 states.

use crate::support;

use linkwork_dynamics::multibody::NodeId;
use linkwork_dynamics::spatial::nalgebra::{DMatrix, DVector};
use linkwork_dynamics::spatial::{Force, Mat3, Motion, Vec3};
use linkwork_dynamics::*;
use serde_json::Value;
use support::{Robot, close, nums, robot};

/// Relative to the largest entry. Measured at most 9e-15.
const TOL: f64 = 1e-13;
/// A dense solve with the compliance: measured 1e-12.
const TOL_HELD: f64 = 1e-10;
/// Inverses: measured 2e-13, with condition numbers of some thousands.
const TOL_INVERSE: f64 = 1e-11;

fn check(name: &str) {
    let Some(r) = robot(name) else { return };
    let mut ws = Workspace::new(&r.tree);
    for (i, s) in r.json["states"].as_array().expect("states").iter().enumerate() {
        state(&r, &mut ws, s, &format!("{name}, state {i}"));
    }
}

fn state(r: &Robot, ws: &mut Workspace, s: &Value, place: &str) {
    let (tree, nv) = (&r.tree, r.tree.nv());
    let g = Vec3::from_column_slice(&nums(&r.json["gravity"]));
    let (q, v, a) = (r.q(&s["q"]), r.v(&s["v"]), r.v(&s["a_in"]));
    let at = |what: &str| format!("{place}, {what}");
    let (mut tau, mut vdot) = (r.v(&s["tau"]), vec![0.0; nv]);

    ws.clear_forces();
    ws.apply_uniform_gravity(g);
    forward_dynamics(tree, ws, &q, &v, &mut tau, &mut vdot).expect("regular");
    close(&vdot, &r.v(&s["aba"]), TOL, &at("aba"));
    let mut out = vec![0.0; nv];
    inverse_dynamics(tree, ws, &q, &v, &vec![0.0; nv], &mut out);
    close(&out, &r.v(&s["nle"]), TOL, &at("nle"));
    inverse_dynamics(tree, ws, &q, &vec![0.0; nv], &vec![0.0; nv], &mut out);
    close(&out, &r.v(&s["gravity"]), TOL, &at("gravity"));
    inverse_dynamics(tree, ws, &q, &v, &a, &mut out);
    close(&out, &r.v(&s["rnea"]), TOL, &at("rnea"));

    // External forces are given in joint axes.
    for (name, f) in r.joints.iter().zip(s["fext_local"].as_array().expect("forces")) {
        let body = tree.multibody().body(name).expect("body");
        let (R, f) = (ws.body_rotation(tree, body), nums(f));
        let (force, moment) = (Vec3::from_column_slice(&f[..3]), Vec3::from_column_slice(&f[3..]));
        ws.add_wrench_at_body(tree, body, Force::new(R * moment, R * force));
    }
    inverse_dynamics_given_kinematics(tree, ws, &a, &mut out);
    close(&out, &r.v(&s["rnea_fext"]), TOL, &at("rnea with forces"));
    forward_dynamics_given_kinematics(tree, ws, &mut tau, &mut vdot).expect("regular");
    close(&vdot, &r.v(&s["aba_fext"]), TOL, &at("aba with forces"));

    let mut M = vec![0.0; nv * nv];
    mass_matrix(tree, ws, &mut M);
    close(&M, &r.matrix(&s["M_upper_rowmajor"]), TOL, &at("mass matrix"));
    close(center_of_mass(tree, ws).as_slice(), &nums(&s["com"]), TOL, &at("com"));
    close(com_velocity(tree, ws).as_slice(), &nums(&s["vcom"]), TOL, &at("com velocity"));
    let h = momentum(tree, ws);
    close(&pair(&h.force, &h.moment), &nums(&s["hg"]), TOL, &at("momentum"));
    close(&[kinetic_energy(tree, ws, &v)], &[s["kinetic"].as_f64().unwrap()], TOL, &at("kinetic"));
    let U = -tree.total_mass() * g.dot(&center_of_mass(tree, ws));
    close(&[U], &[s["potential"].as_f64().unwrap()], TOL, &at("potential"));

    matrices(r, ws, s, place);

    // Compare the accelerations of frames and of the centre of mass for a_in.
    inverse_dynamics_given_kinematics(tree, ws, &a, &mut out);
    close(com_acceleration(tree, ws).as_slice(), &nums(&s["acom"]), TOL, &at("com acceleration"));
    for (f, x) in
        r.json["contact_frames"].as_array().unwrap().iter().zip(s["frames"].as_array().unwrap())
    {
        let n = tree.multibody().node(f["name"].as_str().unwrap()).expect("node");
        let X = ws.node_pose(tree, n);
        let R = X.rotation.to_rotation_matrix();
        close(R.matrix().as_slice(), support::mat3(&x["R"]).as_slice(), TOL, &at("frame R"));
        close(X.position.as_slice(), &nums(&x["p"]), TOL, &at("frame p"));
        let V = ws.node_velocity(tree, n);
        close(&pair_m(&V), &nums(&x["v_lwa"]), TOL, &at("frame velocity"));
        let A = ws.node_acceleration(tree, n);
        close(&pair_m(&A), &nums(&x["ac_lwa"]), TOL, &at("frame acceleration"));
        // Compare in the frame's axes. Pinocchio's acceleration there is Featherstone's spatial acceleration, which
        // differs by ω × v.
        let local = |m: Motion| pair_m(&m.rotate(&X.rotation.inverse()));
        close(&local(V), &nums(&x["v_local"]), TOL, &at("frame velocity, own axes"));
        let spatial = Motion::new(A.angular, A.linear - V.angular.cross(&V.linear));
        close(&local(spatial), &nums(&x["a_local"]), TOL, &at("frame acceleration, own axes"));
    }
    let mut moved = vec![0.0; q.len()];
    let step: Vec<f64> = v.iter().map(|x| x * 0.01).collect();
    tree.multibody().integrate(&q, &step, &mut moved);
    close(&moved, &r.q(&s["q_integrated_v_0p01"]), TOL, &at("integrated q"));
}

/// M⁻¹, Jacobians, momentum rate, compliance of the contact frames.
fn matrices(r: &Robot, ws: &mut Workspace, s: &Value, place: &str) {
    let (tree, nv) = (&r.tree, r.tree.nv());
    let at = |what: &str| format!("{place}, {what}");
    let mut X = vec![0.0; nv * nv];
    inverse_mass_matrix(tree, ws, &mut X).expect("regular");
    if let Some(want) = s.get("Minv_upper_rowmajor") {
        close(&X, &r.matrix(want), TOL_INVERSE, &at("inverse mass matrix"));
    }
    let frames = r.json["contact_frames"].as_array().unwrap();
    let node = |f: &Value| tree.multibody().node(f["name"].as_str().unwrap()).expect("node");
    let mut J = vec![0.0; 6 * nv];
    node_jacobian(tree, ws, node(&frames[0]), &mut J);
    // Pinocchio has the linear rows first.
    let swapped = [&J[3 * nv..], &J[..3 * nv]].concat();
    close(&swapped, &r.columns(&s["J_lwa_frame0"]), TOL, &at("Jacobian"));
    let R = ws.node_pose(tree, node(&frames[0])).rotation.inverse();
    let mut local = vec![0.0; 6 * nv];
    for i in 0..nv {
        for block in 0..2 {
            let x = R * Vec3::new(
                swapped[3 * block * nv + i],
                swapped[(3 * block + 1) * nv + i],
                swapped[(3 * block + 2) * nv + i],
            );
            x.iter().enumerate().for_each(|(k, x)| local[(3 * block + k) * nv + i] = *x);
        }
    }
    close(&local, &r.columns(&s["J_local_frame0"]), TOL, &at("Jacobian in the frame's axes"));
    com_jacobian(tree, ws, &mut J[..3 * nv]);
    close(&J[..3 * nv], &r.columns(&s["Jcom"]), TOL, &at("Jacobian of the com"));
    centroidal_matrix(tree, ws, &mut J);
    let (a, b) = (r.v(&s["a_in"]), centroidal_bias(tree, ws));
    let row = |i: usize| J[i * nv..(i + 1) * nv].iter().zip(&a).map(|(x, a)| x * a).sum::<f64>();
    let force = Vec3::new(row(3), row(4), row(5)) + b.force;
    let moment = Vec3::new(row(0), row(1), row(2)) + b.moment;
    close(&pair(&force, &moment), &nums(&s["dhg"]), TOL, &at("momentum rate"));

    derivatives(r, ws, s, place);

    // The compliance is in the frames' axes, [linear; angular] or linear only, as in the file.
    let nodes: Vec<_> = frames.iter().map(node).collect();
    let mut compliance = Compliance::new(tree, &nodes);
    let size = compliance.size();
    let mut out = vec![0.0; size * size];
    compliance.compute(tree, ws, &mut out).expect("regular");
    let dim = r.json["contact_dim"].as_u64().unwrap() as usize;
    let n = dim * nodes.len();
    let rotate = |k: usize| ws.node_rotation(tree, nodes[k]);
    let block = |x: usize, bx: usize, y: usize, by: usize| {
        // Linkwork has the angular part first.
        let (i, j) = (6 * x + 3 * (1 - bx), 6 * y + 3 * (1 - by));
        let B = Mat3::from_fn(|a, b| out[(i + a) * size + j + b]);
        rotate(x).transpose() * B * rotate(y)
    };
    let mut found = Vec::new();
    for i in 0..n {
        for j in i..n {
            let (x, a, y, b) = (i / dim, i % dim, j / dim, j % dim);
            found.push(block(x, a / 3, y, b / 3)[(a % 3, b % 3)]);
        }
    }
    close(&found, &nums(&s["delassus_upper_rowmajor"]), TOL_INVERSE, &at("compliance"));

    let full = DMatrix::from_fn(n, n, |i, j| {
        let (x, a, y, b) = (i / dim, i % dim, j / dim, j % dim);
        block(x, a / 3, y, b / 3)[(a % 3, b % 3)]
    });
    held_frames(r, ws, s, place, &nodes, &full);
}

/// The same frames held by forces: accelerations without the forces, the forces, accelerations with them.
fn held_frames(
    r: &Robot,
    loaded: &Workspace,
    s: &Value,
    place: &str,
    nodes: &[NodeId],
    compliance: &DMatrix<f64>,
) {
    let (tree, nv) = (&r.tree, r.tree.nv());
    let at = |what: &str| format!("{place}, {what}");
    let dim = compliance.nrows() / nodes.len();
    let mut ws = loaded.clone();
    ws.clear_forces();
    ws.apply_uniform_gravity(Vec3::from_column_slice(&nums(&r.json["gravity"])));
    // Pinocchio gives the classical acceleration of a held point, but the spatial acceleration of a held frame.
    let in_frames = |ws: &Workspace, a: &dyn Fn(&Workspace, NodeId) -> Motion| -> Vec<f64> {
        let local = |n: &NodeId| {
            let R = ws.node_pose(tree, *n).rotation.inverse();
            let (mut A, V) = (a(ws, *n), ws.node_velocity(tree, *n));
            if dim == 6 {
                A.linear -= V.angular.cross(&V.linear);
            }
            pair_m(&A.rotate(&R))[..dim].to_vec()
        };
        nodes.iter().flat_map(local).collect()
    };
    let bias = in_frames(&ws, &|ws, n| ws.node_bias_acceleration(tree, n));
    close(&bias, &nums(&s["constraint_bias"]), TOL, &at("bias of the frames"));
    if s["kkt_ddq"].is_null() {
        return; // Two coordinates cannot hold three directions.
    }
    let (mut tau, mut vdot) = (r.v(&s["tau"]), vec![0.0; nv]);
    forward_dynamics_given_kinematics(tree, &mut ws, &mut tau, &mut vdot).expect("regular");
    let free = in_frames(&ws, &|ws, n| ws.node_acceleration(tree, n));
    let lambda = -compliance.clone().lu().solve(&DVector::from_vec(free)).expect("regular");
    close(lambda.as_slice(), &nums(&s["kkt_lambda"]), TOL_HELD, &at("forces of the frames"));
    for (n, f) in nodes.iter().zip(lambda.as_slice().chunks(dim)) {
        let R = ws.node_pose(tree, *n).rotation;
        let moment = if dim == 6 { Vec3::from_column_slice(&f[3..]) } else { Vec3::zeros() };
        let force = Vec3::from_column_slice(&f[..3]);
        ws.add_wrench_at_node(tree, *n, Force::new(R * moment, R * force));
    }
    forward_dynamics_given_kinematics(tree, &mut ws, &mut tau, &mut vdot).expect("regular");
    close(&vdot, &r.v(&s["kkt_ddq"]), TOL_HELD, &at("accelerations with held frames"));
}

/// The first states have derivatives, without external forces.
fn derivatives(r: &Robot, loaded: &Workspace, s: &Value, place: &str) {
    let (Some(rq), Some(aq)) = (s.get("drnea_dq"), s.get("daba_dq")) else { return };
    let (tree, nv) = (&r.tree, r.tree.nv());
    let at = |what: &str| format!("{place}, {what}");
    let mut ws = loaded.clone();
    ws.clear_forces();
    ws.apply_uniform_gravity(Vec3::from_column_slice(&nums(&r.json["gravity"])));
    let mut d = Derivatives::new(tree);
    let [mut dq, mut dv, mut dt] = [(); 3].map(|()| vec![0.0; nv * nv]);
    let v = r.v(&s["v"]);
    d.inverse_dynamics(tree, &mut ws, &v, &r.v(&s["a_in"]), &mut dq, &mut dv);
    close(&dq, &r.square(rq), TOL, &at("drnea_dq"));
    close(&dv, &r.square(&s["drnea_dv"]), TOL, &at("drnea_dv"));
    let (mut tau, mut vdot) = (r.v(&s["tau"]), vec![0.0; nv]);
    let out = ForwardDerivatives { dvdot_dq: &mut dq, dvdot_dv: &mut dv, dvdot_dtau: &mut dt };
    d.forward_dynamics(tree, &mut ws, &v, &mut tau, &mut vdot, out).expect("regular");
    close(&dq, &r.square(aq), TOL_INVERSE, &at("daba_dq"));
    close(&dv, &r.square(&s["daba_dv"]), TOL_INVERSE, &at("daba_dv"));
}

fn pair(linear: &Vec3, angular: &Vec3) -> Vec<f64> {
    linear.iter().chain(angular.iter()).copied().collect()
}

fn pair_m(m: &Motion) -> Vec<f64> {
    pair(&m.linear, &m.angular)
}

#[test]
fn double_pendulum() {
    check("double_pendulum");
}

#[test]
fn ur5() {
    check("ur5");
}

#[test]
fn iiwa7() {
    check("iiwa7");
}

#[test]
fn solo12_with_free_base() {
    check("solo12_ff");
}

#[test]
fn chain_of_ten_random_links() {
    check("chain10_rand");
}

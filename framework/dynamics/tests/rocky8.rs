//! External reference: Rocky 8 as published by its makers, compared with plain homogeneous transforms.

use crate::support::{Rng, close, mat3, reference_text, vec3};
use linkwork_dynamics::multibody::{BodySpec, Builder, Coordinate, Hinge, Multibody};
use linkwork_dynamics::spatial::nalgebra::{Matrix4, Rotation3, Unit};
use linkwork_dynamics::spatial::{InertiaCheck, MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::*;
use serde_json::Value;
use std::collections::BTreeMap;

fn bodies() -> Option<BTreeMap<String, Value>> {
    let json: Value = serde_json::from_str(&reference_text("rocky8/rocky8_mbody.json")?).unwrap();
    let bodies = json["R8Mbody"]["BODIES"].as_object().unwrap();
    Some(bodies.iter().map(|(k, v)| (k.clone(), v.clone())).collect())
}

fn parent(b: &Value) -> &str {
    match b["inbBody"].as_str() {
        Some(p) if !p.is_empty() && !p.to_lowercase().contains("inertial") => p,
        _ => "world",
    }
}

/// Reads an optional vector.
fn offset(v: &Value) -> Vec3 {
    if v.is_null() { Vec3::zeros() } else { vec3(v) }
}

fn is_free(b: &Value) -> bool {
    b["jointType"].as_str().unwrap().contains("6DOF")
}

fn build(bodies: &BTreeMap<String, Value>) -> Multibody {
    let mut builder = Builder::new();
    for (name, b) in bodies {
        let mut hinge =
            if is_free(b) { Hinge::free() } else { Hinge::pin(vec3(&b["jointAxes"][0])) };
        if b["prescribed"].as_bool().unwrap() {
            hinge = hinge.prescribed();
        }
        let position = |key: &str| Pose::new(Default::default(), offset(&b[key]));
        let m = b["mass"].as_f64().unwrap();
        builder.body(
            BodySpec::new(name, parent(b))
                .hinge_in_parent(position("inbToJoint"))
                .hinge_in_body(position("bodyToJoint"))
                .hinge(hinge)
                .mass(
                    // The wheels' 0.33 kg m² about the axle includes the reflected rotor inertia.
                    MassProperties::new(m, vec3(&b["bodyToCM"]), mat3(&b["cmInertia"]))
                        .with_check(InertiaCheck::PositiveMoments),
                ),
        );
    }
    builder.build().unwrap_or_else(|e| panic!("{e}"))
}

/// Pose of a body by multiplying 4 × 4 matrices from the base outward.
fn plain_pose(
    bodies: &BTreeMap<String, Value>,
    angles: &BTreeMap<String, f64>,
    base: &Matrix4<f64>,
    name: &str,
) -> Matrix4<f64> {
    let b = &bodies[name];
    let inboard = match parent(b) {
        "world" => Matrix4::identity(),
        p => plain_pose(bodies, angles, base, p),
    };
    let joint = if is_free(b) {
        *base
    } else {
        let axis = Unit::new_normalize(vec3(&b["jointAxes"][0]));
        Rotation3::from_axis_angle(&axis, angles[name]).to_homogeneous()
    };
    inboard
        * Matrix4::new_translation(&offset(&b["inbToJoint"]))
        * joint
        * Matrix4::new_translation(&-offset(&b["bodyToJoint"]))
}

#[test]
fn mass_centre_of_mass_wheels_and_composite_inertia() {
    let Some(bodies) = bodies() else { return };
    let mbs = build(&bodies);
    assert_eq!((mbs.bodies().len(), mbs.nv(), mbs.nq()), (17, 22, 23));
    let prescribed = mbs.prescribed().iter().filter(|p| **p).count();
    assert_eq!(prescribed, 6, "the six steering hinges");
    close(&[mbs.total_mass()], &[51.84], 1e-12, "total mass");

    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    for seed in 0..5 {
        let (q, v) = (mbs.random_q(seed), mbs.random_v(seed));
        kinematics(&tree, &mut ws, &q, &v);
        let mut angles = BTreeMap::new();
        let mut base = Matrix4::identity();
        for (id, s) in mbs.subhinges() {
            let body = mbs.get(id);
            if s.q.len() == 7 {
                let x = &q[s.q.clone()];
                let quat = spatial::nalgebra::Quaternion::new(x[6], x[3], x[4], x[5]);
                let R = spatial::Quat::from_quaternion(quat).to_homogeneous();
                base = Matrix4::new_translation(&Vec3::new(x[0], x[1], x[2])) * R;
            } else {
                angles.insert(body.name().to_owned(), q[s.q.start]);
            }
        }
        let (mut moment, mut mass) = (Vec3::zeros(), 0.0);
        for name in bodies.keys() {
            let X = plain_pose(&bodies, &angles, &base, name);
            let ours = ws.body_pose(&tree, mbs.body(name).unwrap());
            let p = X.fixed_view::<3, 1>(0, 3).into_owned();
            close(ours.position.as_slice(), p.as_slice(), 1e-12, &format!("{name}, position"));
            let R: Mat3 = X.fixed_view::<3, 3>(0, 0).into_owned();
            let ours_R = ours.rotation.to_rotation_matrix();
            close(ours_R.matrix().as_slice(), R.as_slice(), 1e-12, &format!("{name}, attitude"));
            let m = bodies[name]["mass"].as_f64().unwrap();
            moment += (p + R * vec3(&bodies[name]["bodyToCM"])) * m;
            mass += m;
        }
        let com = moment / mass;
        close(center_of_mass(&tree, &ws).as_slice(), com.as_slice(), 1e-12, "centre of mass");

        // Compute the composite inertia about the system's centre of mass, in world axes.
        let mut I = Mat3::zeros();
        for (name, b) in &bodies {
            let X = plain_pose(&bodies, &angles, &base, name);
            let R: Mat3 = X.fixed_view::<3, 3>(0, 0).into_owned();
            let r = X.fixed_view::<3, 1>(0, 3) + R * vec3(&b["bodyToCM"]) - com;
            let m = b["mass"].as_f64().unwrap();
            I += R * mat3(&b["cmInertia"]) * R.transpose()
                + (Mat3::identity() * r.norm_squared() - r * r.transpose()) * m;
        }
        let root = mbs.body("chassis").unwrap();
        let ours = subtree_inertia(&tree, &ws, root);
        close(ours.inertia_com().as_slice(), I.as_slice(), 1e-12, "composite inertia");
        close(&[ours.mass()], &[mass], 1e-14, "composite mass");
    }
}

#[test]
fn drives_with_prescribed_steering() {
    let Some(bodies) = bodies() else { return };
    let mbs = build(&bodies);
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    let (q, v) = (mbs.random_q(1), mbs.random_v(1));
    ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
    let mut r = Rng(4);
    let (mut tau, mut vdot) = (r.vec(22), r.vec(22));
    let mask = mbs.prescribed();
    let given: Vec<f64> = (0..22).map(|i| if mask[i] { vdot[i] } else { tau[i] }).collect();
    forward_dynamics(&tree, &mut ws, &q, &v, &mut tau, &mut vdot).unwrap();
    let kept: Vec<f64> = (0..22).map(|i| if mask[i] { vdot[i] } else { tau[i] }).collect();
    assert_eq!(given, kept);
    let mut back = vec![0.0; 22];
    inverse_dynamics_given_kinematics(&tree, &mut ws, &vdot, &mut back);
    close(&back, &tau, 1e-11, "forces");
    // Unlocking a hinge changes the structure and nothing else.
    let steer = mbs.body("SteerRockerSideLeft").unwrap();
    let edited = mbs.clone().with_coordinate(steer, Coordinate::Free);
    assert_eq!(edited.prescribed().iter().filter(|p| **p).count(), 5);
}

//! Grasped loads: grasp and release with collision filters, forces of a motion with a load, a load shared by two arms. If
//! `LINKWORK_ROBOT_QUERIES` names the peer's program, Linkwork and Pinocchio run alternately; the peer appends the load to a copy of its model.
//! A call begins with a configuration, so the time of its kinematics is included.
//!
//!     cargo bench -p linkwork-embedded --bench hold
#![allow(non_snake_case, clippy::unwrap_used)]

mod peer;
#[path = "../tests/support/mod.rs"]
mod support;

use linkwork_embedded::spatial::{MassProperties, Mat3, Vec3};
use linkwork_embedded::*;
use peer::{Peer, ROUNDS, row, us};
use std::hint::black_box;
use support::*;

fn main() {
    let Some(json) = reference("robodarts/dual_ur5_beam.json") else { return };
    let scene = reference("robodarts/dual_ur5_collisions.json").unwrap();
    let b = &json["beam"];
    let moments = Mat3::from_diagonal(&Vec3::from_column_slice(&numbers(&b["inertia_diagonal"])));
    let mass = MassProperties::new(b["mass"].as_f64().unwrap(), Vec3::zeros(), moments);
    let spec = ObjectSpec { name: "beam".into(), mass };
    let X = ["left_tip_in_beam", "right_tip_in_beam"].map(|k| pose(&numbers(&b[k])).inverse());
    let side = Shape::Box { half: Vec3::new(0.02, 0.25, 0.02) };
    let parts = [
        PartSpec::chain("left", "left_base_link", "left_tcp"),
        PartSpec::chain("right", "right_base_link", "right_tcp"),
    ];
    let path = "robodarts/dual_ur5.urdf";
    let bare = robot_in(path, &scene, &parts, vec![], vec![]);
    let more = vec![ColliderSpec::new("beam", "beam", side)];
    let model = robot_in(path, &scene, &parts, vec![spec], more);
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let beam = model.object("beam").unwrap();
    let at = places(&model, &names(&json["dof"]));
    let cases = json["cases"].as_array().unwrap();
    // Repeat the configurations that close the loop.
    let closed: Vec<Vec<f64>> =
        cases.iter().cycle().take(2000).map(|c| to_q(&model, &at, &numbers(&c["q"]))).collect();
    let peer = Peer::new(&Robot::new(&bare), &closed, ("left_tcp", &mass.validate().unwrap()));

    let mut robot = Robot::new(&model);
    let mut held = robot.clone();
    held.set_q(&closed[0]).unwrap();
    held.grasp(left, beam, Grasp::At(X[0])).unwrap();
    held.grasp(right, beam, Grasp::At(X[1])).unwrap();
    let nv = model.nv();
    let v: Vec<f64> = (0..nv).map(|i| -0.5 + 1.2 * i as f64 / (nv - 1) as f64).collect();
    let a: Vec<f64> = v.iter().map(|x| 2.0 * x).collect();
    let mut tau = vec![0.0; nv];
    let mut sides = [const { (Vec::new(), Vec::new()) }; 4];
    for _ in 0..ROUNDS {
        sides[0].0.push(us(&closed, |q| {
            robot.set_q(q).unwrap();
            robot.grasp(left, beam, Grasp::At(X[0])).unwrap();
            robot.ungrasp(beam).unwrap();
        }));
        sides[1].0.push(us(&closed, |q| {
            held.set_q(q).unwrap();
            held.feed_forward(&v, &a, &[], &mut tau).unwrap();
        }));
        sides[2].0.push(us(&closed, |q| {
            held.set_q(q).unwrap();
            held.gravity_forces(&mut tau).unwrap();
            black_box(held.balance(beam, Balance::Effort, &mut tau).unwrap());
        }));
        sides[3].0.push(us(&closed, |q| {
            held.set_q(q).unwrap();
            black_box(held.balance(beam, Balance::Effort, &mut tau).unwrap());
        }));
        let Some(peer) = &peer else { continue };
        let told = peer.run();
        sides[0].1.push(told.us["grasp"]);
        sides[1].1.push(told.us["rnea"]);
    }
    let rows = [
        ("grasp and ungrasp, with filters", "at most 60 µs"),
        ("feed-forward of 18 dofs with a load", "at most 1.5 µs"),
        ("gravity, and its load shared by two arms", ""),
        ("balance of two arms alone", "at most 10 µs"),
    ];
    for (side, (name, target)) in sides.iter().zip(rows) {
        row(name, &side.0, &side.1, target);
    }
}

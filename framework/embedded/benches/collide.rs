//! Collision queries: COL-1 and COL-2 (defined in the reference data), with every result checked. If `LINKWORK_ROBOT_QUERIES` names
//! the peer's program, Linkwork and coal run alternately. A call computes the poses for q and the result.
//!
//!     cargo bench -p linkwork-embedded --bench collide [-- COL-1 COL-2 seen]
#![allow(non_snake_case, clippy::unwrap_used)]

mod peer;
#[path = "../tests/support/mod.rs"]
mod support;

use linkwork_embedded::*;
use peer::{Peer, ROUNDS, row, us};
use serde_json::Value;
use std::hint::black_box;
use support::*;

/// Measures a call without a peer.
fn timed(name: &str, qs: &[Vec<f64>], mut call: impl FnMut(&[f64])) {
    let rounds: Vec<f64> = (0..ROUNDS).map(|_| us(qs, &mut call)).collect();
    row(name, &rounds, &[], "");
}

fn bench(name: &str, robot: &mut Robot, qs: &[Vec<f64>], expected: &[bool], hand: &str) {
    let wrong = |answers: &[bool]| answers.iter().zip(expected).filter(|(a, e)| a != e).count();
    let ours: Vec<bool> = qs.iter().map(|q| robot.collides(q).unwrap()).collect();
    println!("{name}: {} of {} answers wrong", wrong(&ours), qs.len());
    let load =
        *robot.model().multibody().get(robot.model().multibody().body(hand).unwrap()).inertia();
    let peer = Peer::new(robot, qs, (hand, &load));
    let (mut hits, mut apart, mut sum) = (Vec::new(), Vec::new(), 0.0);
    let mut sides = [const { (Vec::new(), Vec::new()) }; 4];
    for _ in 0..ROUNDS {
        sides[0].0.push(us(qs, |q| {
            let _ = black_box(robot.collides(q));
        }));
        sides[1].0.push(us(qs, |q| robot.hits(q, &mut hits).unwrap()));
        sides[2].0.push(us(qs, |q| {
            robot.distances(q, f64::INFINITY, &mut apart).unwrap();
            sum += apart.iter().map(|c| c.distance.distance).sum::<f64>();
        }));
        sides[3].0.push(us(qs, |q| {
            let _ = black_box(robot.clearance(q, f64::INFINITY));
        }));
        let Some(peer) = &peer else { continue };
        let told = peer.run();
        if sides[0].1.is_empty() {
            println!("{name}: {} of the peer's answers wrong", wrong(&told.hits));
        }
        for (side, key) in sides.iter_mut().zip(["tree", "all", "distances"]) {
            side.1.push(told.us[key]);
        }
    }
    black_box(sum);
    // Check all configurations as one table with two threads.
    let (table, mut out) = (qs.concat(), vec![false; qs.len()]);
    let mut robots = [robot.clone(), robot.clone()];
    let (mut one_by_one, mut together) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        one_by_one.push(us(qs, |q| {
            let _ = black_box(robot.collides(q));
        }));
        let all = us(std::slice::from_ref(&table), |q| {
            collides_all(&mut robots, q, &mut out).unwrap();
        });
        together.push(all / qs.len() as f64);
    }
    assert_eq!(out, ours);
    row(&format!("{name} collision check, in two threads; in one"), &together, &one_by_one, "");
    let asked = ["at most 0.4", "", "at most 0.4", ""];
    let names = ["collision check", "all colliding pairs", "all distances", "least distance"];
    for ((side, what), target) in sides.iter().zip(names).zip(asked) {
        row(&format!("{name} {what}"), &side.0, &side.1, target);
    }
}

/// Measures the arm among sensor data: a cloud of 20 000 balls, or 20 000 of 320 000 cells, on a shell about it and a wall beside it.
fn seen(json: &Value, qs: &[Vec<f64>]) {
    let mut rng = Rng(1);
    let n = [100, 100, 32];
    let (mut points, mut cells) = (Vec::new(), Vec::new());
    while points.len() < 20_000 {
        let p = [rng.within(-1.5, 1.5), rng.within(-1.5, 1.5), rng.within(0.0, 1.9)];
        let r = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (0.95..1.0).contains(&r) || (0.55..0.6).contains(&p[0]) {
            points.push([p[0], p[1], p[2], 0.01]);
        }
    }
    while cells.len() < 20_000 {
        let c = n.map(|n| rng.within(0.0, n as f64) as u32);
        let p = [0, 1, 2].map(|k| (f64::from(c[k]) + 0.5) * 0.03 - [1.5, 1.5, 0.0][k]);
        let r = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (0.9..1.05).contains(&r) || (0.5..0.65).contains(&p[0]) {
            cells.push(c);
        }
    }
    let cloud = Shape::PointCloud { points: vec![], room: 20_000 };
    let map = Shape::VoxelMap { cells: n, edge: 0.03, occupied: vec![] };
    let corner = spatial::Pose::translation(-1.5, -1.5, 0.0);
    let more = vec![
        ColliderSpec::new("cloud", "world", cloud),
        ColliderSpec::new("map", "world", map).at(corner),
    ];
    let model = robot_in("robots/iiwa7.urdf", json, &[], vec![], more);
    let [cloud, map] = ["cloud", "map"].map(|n| model.collider(n).unwrap());
    let empty = Robot::new(&model);
    for (name, id) in [("a cloud", cloud), ("a map", map)] {
        let mut robot = empty.clone();
        timed(&format!("{name} is set"), &qs[..20], |_| {
            if id == cloud {
                robot.set_points(cloud, &points).unwrap();
            } else {
                robot.clear_cells(map).unwrap();
                robot.set_cells(map, &cells, Occupancy::Occupied).unwrap();
            }
        });
        let hit = qs.iter().filter(|q| robot.collides(q).unwrap()).count();
        println!("{name}: {hit} of {} hit", qs.len());
        timed(&format!("{name} collision check"), qs, |q| {
            let _ = black_box(robot.collides(q));
        });
        timed(&format!("{name} least distance"), &qs[..500], |q| {
            let _ = black_box(robot.clearance(q, f64::INFINITY));
        });
    }
}

fn main() {
    let only: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    let wanted = |name: &str| only.is_empty() || only.iter().any(|o| o == name);
    let Some(json) = reference("robodarts/col1_scene.json") else { return };
    let model = robot_in("robots/iiwa7.urdf", &json, &[], vec![], vec![]);
    let mut robot = Robot::new(&model);
    let mut rng = Rng(json["seed"].as_u64().unwrap());
    let ik = reference("robodarts/ik_iiwa7.json").unwrap();
    let (low, high) = (numbers(&ik["lower"]), numbers(&ik["upper"]));
    let qs: Vec<Vec<f64>> =
        (0..5000).map(|_| (0..7).map(|i| rng.within(low[i], high[i])).collect()).collect();
    let expected: Vec<bool> =
        json["colliding"].as_str().unwrap().chars().map(|c| c == '1').collect();
    if wanted("COL-1") {
        bench("COL-1", &mut robot, &qs, &expected, "lbr_iiwa_link_7");
    }
    if wanted("seen") {
        seen(&json, &qs);
    }

    let json = reference("robodarts/dual_ur5_collisions.json").unwrap();
    let model = robot_in("robodarts/dual_ur5.urdf", &json, &[], vec![], vec![]);
    let at = places(&model, &names(&json["dof"]));
    let states = json["states"].as_array().unwrap();
    let qs: Vec<Vec<f64>> = states.iter().map(|s| to_q(&model, &at, &numbers(&s["q"]))).collect();
    let hit = |s: &Value| !s["fine"]["colliding"].as_array().unwrap().is_empty();
    let expected: Vec<bool> = states.iter().map(hit).collect();
    if wanted("COL-2") {
        bench("COL-2", &mut Robot::new(&model), &qs, &expected, "left_tcp");
    }
}

//! Point clouds and voxel maps as obstacles of a robot: the same queries, filters, padding, hiding and grasps as for other shapes; no allocation.

use crate::support::Rng;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Quat, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

const CELLS: [usize; 3] = [24, 24, 16];
const EDGE: f64 = 0.05;

/// Cells and points as separate obstacles, in addition to the map and the cloud with the same content.
struct Seen {
    points: Vec<[f64; 4]>,
    cells: Vec<[u32; 3]>,
}

impl Seen {
    fn new(seed: u64) -> Self {
        let mut rng = Rng(seed);
        let point = |rng: &mut Rng| {
            let p = [(); 3].map(|()| rng.within(-0.6, 0.6));
            [p[0], p[1], p[2] + 0.2, rng.within(0.0, 0.02)]
        };
        let cell = |rng: &mut Rng| CELLS.map(|n| rng.within(0.0, n as f64) as u32);
        Self {
            points: (0..150).map(|_| point(&mut rng)).collect(),
            cells: (0..120).map(|_| cell(&mut rng)).collect(),
        }
    }
}

/// Pose of the map's corner, rotated.
fn map_pose() -> Pose {
    Pose::new(Quat::from_scaled_axis(Vec3::new(0.1, -0.2, 0.4)), Vec3::new(-0.7, -0.4, -0.2))
}

/// An arm of three links, an object, a cloud and a map; with `single`, their spheres and cells as colliders.
fn arm(single: Option<&Seen>) -> Arc<RobotModel> {
    let mut mechanism = Builder::new();
    let limits = Limits::position(-3.0, 3.0);
    let mut parent = "world";
    for (name, axis) in [("one", Vec3::z()), ("two", Vec3::y()), ("three", Vec3::y())] {
        let hinge = Hinge::pin(axis).limits(limits);
        let at =
            if parent == "world" { Pose::identity() } else { Pose::translation(0.3, 0.0, 0.0) };
        mechanism.body(BodySpec::new(name, parent).hinge(hinge).hinge_in_parent(at));
        parent = name;
    }
    let link = Shape::Capsule { radius: 0.03, half_length: 0.1 };
    let turn = Pose::new(Quat::from_scaled_axis(Vec3::y() * 1.57), Vec3::new(0.15, 0.0, 0.0));
    let mut colliders: Vec<_> = ["one", "two", "three"]
        .map(|body| ColliderSpec::new(format!("on {body}"), body, link.clone()).at(turn))
        .into();
    let held = Shape::Box { half: Vec3::new(0.05, 0.04, 0.03) };
    colliders.push(ColliderSpec::new("on thing", "thing", held));
    let cloud = Shape::PointCloud { points: vec![], room: 150 };
    colliders.push(ColliderSpec::new("cloud", "world", cloud));
    let map = Shape::VoxelMap { cells: CELLS, edge: EDGE, occupied: vec![] };
    colliders.push(ColliderSpec::new("map", "world", map).at(map_pose()));
    if let Some(seen) = single {
        for (k, p) in seen.points.iter().enumerate() {
            let ball = Shape::Sphere { radius: p[3] };
            let at = Pose::translation(p[0], p[1], p[2]);
            colliders.push(ColliderSpec::new(format!("ball {k}"), "world", ball).at(at));
        }
        let cube = Shape::Box { half: Vec3::repeat(0.5 * EDGE) };
        for (k, c) in seen.cells.iter().enumerate() {
            let p = Vec3::from(c.map(|i| (f64::from(i) + 0.5) * EDGE));
            let at = map_pose() * Pose::translation(p.x, p.y, p.z);
            colliders.push(ColliderSpec::new(format!("cell {k}"), "world", cube.clone()).at(at));
        }
    }
    let mass = MassProperties::new(0.5, Vec3::zeros(), Mat3::identity() * 1e-3);
    let spec = ModelSpec {
        mechanism,
        colliders,
        objects: vec![ObjectSpec { name: "thing".into(), mass }],
        parts: vec![PartSpec::chain("arm", "world", "three")],
        rules: Rules { neighbours: Default::default(), ..Rules::default() },
        ..ModelSpec::default()
    };
    RobotModel::new(&spec).unwrap()
}

/// Returns an instance whose object is far away.
fn robot(model: &Arc<RobotModel>) -> Robot {
    let mut robot = Robot::new(model);
    robot.put(model.object("thing").unwrap(), Pose::translation(0.0, 0.0, 5.0)).unwrap();
    robot
}

fn ids<const N: usize>(model: &RobotModel, names: [&str; N]) -> [ColliderId; N] {
    names.map(|n| model.collider(n).unwrap())
}

fn see(robot: &mut Robot, seen: &Seen) {
    let [cloud, map] = ids(&robot.model().clone(), ["cloud", "map"]);
    robot.set_points(cloud, &seen.points).unwrap();
    robot.set_cells(map, &seen.cells, Occupancy::Occupied).unwrap();
}

/// Returns which of the robot's own colliders touch which others, with one name for all spheres and one for all cells.
fn touching(robot: &mut Robot, q: &[f64]) -> Vec<(String, String)> {
    let model = robot.model().clone();
    let mut out = Vec::new();
    robot.hits(q, &mut out).unwrap();
    let name = |id| {
        let name = model.collider_name(id);
        let group = if name.starts_with("ball") { "cloud" } else { "map" };
        if name.starts_with("ball") || name.starts_with("cell") { group } else { name }.to_owned()
    };
    let mut all: Vec<_> = (out.into_iter())
        .map(|(a, b)| {
            let (a, b) = (name(a), name(b));
            if a < b { (a, b) } else { (b, a) }
        })
        .collect();
    all.sort();
    all.dedup();
    all
}

#[test]
fn they_are_met_as_their_balls_and_cells_would_be() {
    let seen = Seen::new(3);
    let mut live = robot(&arm(None));
    let single = arm(Some(&seen));
    let mut brute = robot(&single);
    assert!(!live.collides(&[0.1, 0.2, 0.3]).unwrap(), "empty at first");
    see(&mut live, &seen);
    let part = single.part("arm").unwrap();
    let mut rng = Rng(8);
    let (mut hits, mut free, mut paths) = (0, 0, [0, 0]);
    for k in 0..400 {
        for robot in [&mut live, &mut brute] {
            let object = robot.model().object("thing").unwrap();
            match k {
                // From here on, the cloud is held; later it has padding, then it is hidden, and then one link
                // ignores the map.
                100 => {
                    robot.grasp(part, object, Grasp::At(Pose::translation(0.3, 0.0, 0.1))).unwrap()
                }
                200 => robot.pad(robot.model().collider("on three").unwrap(), 0.02).unwrap(),
                300 => {
                    let model = robot.model().clone();
                    for (id, name) in model.colliders() {
                        if name == "cloud" || name.starts_with("ball") {
                            robot.show(id, Visibility::Hidden).unwrap();
                        }
                        if name == "map" || name.starts_with("cell") {
                            let [three] = ids(&model, ["on three"]);
                            robot.look_at(three, id, Some(false)).unwrap();
                        }
                    }
                }
                _ => {}
            }
        }
        let q = [(); 3].map(|()| rng.within(-2.0, 2.0));
        let found = touching(&mut live, &q);
        assert_eq!(found, touching(&mut brute, &q), "{k}");
        assert_eq!(live.first_hit(&q).unwrap().is_some(), !found.is_empty());
        if found.is_empty() {
            free += 1
        } else {
            hits += 1
        }
        let [a, b] = [&mut live, &mut brute]
            .map(|r| r.clearance(&q, f64::INFINITY).unwrap().unwrap().distance);
        assert!((a.distance - b.distance).abs() < 1e-9, "{k}: {a:?} {b:?}");
        if k % 4 == 0 {
            let to = q.map(|x| x + rng.within(-0.4, 0.4));
            let [a, b] = [&mut live, &mut brute].map(|r| r.path_free(&q, &to, 1e-3).unwrap());
            match (a, b) {
                (Path::Free, Path::Free) => paths[0] += 1,
                (Path::Hit { at: s, .. }, Path::Hit { at: t, .. }) => {
                    assert_eq!(s, t);
                    paths[1] += 1;
                }
                // The position may differ, because the bounding sphere of a whole cloud is larger than its
                // spheres. All other results are equal.
                (Path::Undecided { .. }, Path::Undecided { .. }) => {}
                (a, b) => panic!("{k}: {a:?} {b:?}"),
            }
        }
    }
    assert!(hits > 50 && free > 50 && paths.iter().all(|n| *n > 10), "{hits} {free} {paths:?}");
}

#[test]
fn what_one_instance_sees_is_its_own_and_goes_with_clones() {
    let seen = Seen::new(5);
    let model = arm(None);
    let [cloud, map, three] = ids(&model, ["cloud", "map", "on three"]);
    let mut robot = robot(&model);
    let mut before = robot.clone();
    see(&mut robot, &seen);
    let mut twin = robot.clone();
    assert_eq!((robot.count(cloud), before.count(cloud)), (Ok(150), Ok(0)));
    assert_eq!(twin.cell(map, seen.cells[3]), Ok(Occupancy::Occupied));
    let mut rng = Rng(2);
    let mut hits = 0;
    for _ in 0..100 {
        let q = [(); 3].map(|()| rng.within(-2.0, 2.0));
        let [a, b] = [&mut robot, &mut twin].map(|r| r.clearance(&q, 1.0).unwrap());
        assert_eq!(a, b, "to the bit");
        hits += usize::from(robot.collides(&q).unwrap());
        assert!(!before.collides(&q).unwrap());
    }
    assert!(hits > 10);
    // The results after freeing the points equal the results before adding them.
    twin.set_points(cloud, &[]).unwrap();
    twin.set_cells(map, &seen.cells, Occupancy::Free).unwrap();
    robot.set_points(cloud, &[]).unwrap();
    robot.clear_cells(map).unwrap();
    for _ in 0..50 {
        let q = [(); 3].map(|()| rng.within(-2.0, 2.0));
        let fresh = before.clearance(&q, 1.0).unwrap();
        assert_eq!(twin.clearance(&q, 1.0).unwrap(), fresh);
        assert_eq!(robot.clearance(&q, 1.0).unwrap(), fresh);
    }
    let shape = |e: Result<(), RobotError>| match e {
        Err(RobotError::Shape(fault)) => fault,
        e => panic!("{e:?}"),
    };
    assert!(matches!(shape(robot.set_points(three, &[])), ShapeFault::Kind { .. }));
    assert!(matches!(shape(robot.set_points(cloud, &[[0.0; 4]; 151])), ShapeFault::Points { .. }));
    let outside = robot.set_cells(map, &[[0, 0, 16]], Occupancy::Occupied);
    assert!(matches!(shape(outside), ShapeFault::Outside { index: 0, .. }));
    assert!(matches!(shape(robot.clear_cells(cloud)), ShapeFault::Kind { .. }));
    assert!(matches!(robot.cell(map, [24, 0, 0]), Err(RobotError::Shape(_))));
    assert!(matches!(robot.count(three), Err(RobotError::Shape(_))));
}

/// A cloud on an object moves with it: the hand meets it at its new place, and on the path there.
#[test]
fn a_cloud_on_an_object_goes_with_the_hand() {
    let mut mechanism = Builder::new();
    let hinge = Hinge::pin(Vec3::z()).limits(Limits::position(-3.0, 3.0));
    mechanism.body(BodySpec::new("rod", "world").hinge(hinge));
    let mass = MassProperties::new(0.5, Vec3::zeros(), Mat3::identity() * 1e-3);
    let wall = Shape::Box { half: Vec3::new(0.05, 0.05, 0.05) };
    let spec = ModelSpec {
        mechanism,
        colliders: vec![
            ColliderSpec::new("cloud", "thing", Shape::PointCloud { points: vec![], room: 9 }),
            ColliderSpec::new("wall", "world", wall).at(Pose::translation(0.0, 1.3, 0.0)),
        ],
        objects: vec![ObjectSpec { name: "thing".into(), mass }],
        parts: vec![PartSpec::chain("arm", "world", "rod")],
        rules: Rules { neighbours: linkwork_collision::Neighbours::Collide, ..Rules::default() },
        ..ModelSpec::default()
    };
    let model = RobotModel::new(&spec).unwrap();
    let (arm, thing) = (model.part("arm").unwrap(), model.object("thing").unwrap());
    let [cloud] = ids(&model, ["cloud"]);
    let mut robot = Robot::new(&model);
    robot.set_points(cloud, &[[0.3, 0.0, 0.0, 0.01], [0.0, 0.2, 0.0, 0.01]]).unwrap();
    robot.grasp(arm, thing, Grasp::At(Pose::translation(1.0, 0.0, 0.0))).unwrap();
    assert!(!robot.collides(&[0.0]).unwrap());
    assert!(robot.collides(&[std::f64::consts::FRAC_PI_2]).unwrap());
    let path = robot.path_free(&[0.0], &[3.0], 1e-3).unwrap();
    let Path::Hit { at, .. } = path else { panic!("{path:?}") };
    assert!((3.0 * at - 1.57).abs() < 0.1);
    // The arm swings a point of zero size through a thin wall. Both ends of the swing are free.
    robot.set_points(cloud, &[[0.3, 0.0, 0.0, 0.0]]).unwrap();
    assert!(matches!(robot.path_free(&[0.0], &[3.0], 1e-4).unwrap(), Path::Hit { .. }));
    robot.set_points(cloud, &[[0.2, 0.0, 0.0, 0.0]]).unwrap();
    assert_eq!(robot.path_free(&[0.0], &[3.0], 1e-4).unwrap(), Path::Free);
    robot.ungrasp(thing).unwrap();
    assert!(!robot.collides(&[1.57]).unwrap());
}

#[test]
fn no_query_and_no_change_allocates() {
    let (seen, other) = (Seen::new(5), Seen::new(6));
    let model = arm(None);
    let [cloud, map, three] = ids(&model, ["cloud", "map", "on three"]);
    let mut robot = robot(&model).clone();
    let mut rng = Rng(2);
    let qs: Vec<_> = (0..60).map(|_| [(); 3].map(|()| rng.within(-2.0, 2.0))).collect();
    let mut out = Vec::with_capacity(100);
    let mut hits = 0;
    let counted = allocation_counter::measure(|| {
        for seen in [&seen, &other, &seen] {
            robot.set_points(cloud, &seen.points).unwrap();
            robot.set_cells(map, &seen.cells, Occupancy::Occupied).unwrap();
            for q in &qs {
                hits += usize::from(robot.collides(q).unwrap());
                robot.hits(q, &mut out).unwrap();
                robot.clearance(q, f64::INFINITY).unwrap();
            }
            robot.path_free(&qs[0], &qs[1], 1e-2).unwrap();
            robot.distance(&qs[0], cloud, map).unwrap();
            assert!(robot.looks_at(cloud, three).unwrap() && robot.count(cloud).unwrap() == 150);
            assert!(robot.cell(map, seen.cells[0]).is_ok() && robot.cell(cloud, [0; 3]).is_err());
            robot.set_cells(map, &seen.cells[..9], Occupancy::Free).unwrap();
            robot.clear_cells(map).unwrap();
            robot.set_points(cloud, &[[f64::NAN; 4]]).unwrap_err();
        }
    });
    assert!(hits > 20);
    assert_eq!(counted.count_total, 0, "{counted:?}");
}

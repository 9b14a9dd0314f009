//! Collisions at many configurations, and calls for several colliders at once.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

/// The arm among its shapes, 4999 configurations and their known results.
fn scene_of_an_arm() -> Option<(Arc<RobotModel>, Vec<f64>, Vec<bool>)> {
    let json = reference("robodarts/col1_scene.json")?;
    let chain = PartSpec::chain("arm", "lbr_iiwa_link_0", "lbr_iiwa_link_7");
    let mass = MassProperties::new(1.0, Vec3::zeros(), 0.03 * Mat3::identity());
    let bar = ObjectSpec { name: "bar".into(), mass };
    let ball = ColliderSpec::new("bar", "bar", Shape::Capsule { radius: 0.02, half_length: 0.3 });
    let model = robot_in("robots/iiwa7.urdf", &json, &[chain], vec![bar], vec![ball]);
    let ik = reference("robodarts/ik_iiwa7.json")?;
    let (low, high) = (numbers(&ik["lower"]), numbers(&ik["upper"]));
    let mut rng = Rng(json["seed"].as_u64().unwrap());
    let expected = json["colliding"].as_str().unwrap().chars().take(4999).map(|c| c == '1');
    let q = (0..4999).flat_map(|_| (0..7).map(|i| rng.within(low[i], high[i])).collect::<Vec<_>>());
    Some((model.clone(), q.collect(), expected.collect()))
}

#[test]
fn many_are_told_as_one_by_one_in_threads() {
    let Some((model, q, expected)) = scene_of_an_arm() else { return };
    let mut robot = Robot::new(&model);
    // The bar is far away first, and then in the hand.
    let bar = model.object("bar").unwrap();
    robot.put(bar, Pose::translation(0.0, 0.0, 50.0)).unwrap();
    let mut out = vec![true; 4999];
    robot.collides_all(&q, &mut out).unwrap();
    assert_eq!(out, expected);
    let arm = model.part("arm").unwrap();
    robot.grasp(arm, bar, Grasp::At(Pose::translation(0.0, 0.0, 0.1))).unwrap();
    let one_by_one: Vec<bool> = q.chunks(7).map(|q| robot.collides(q).unwrap()).collect();
    assert!(one_by_one != expected, "the bar hits more");
    robot.collides_all(&q, &mut out).unwrap();
    assert_eq!(out, one_by_one);
    // Runs may have different lengths, and there may be more robots than rows.
    for (threads, rows) in [(1, 4999), (3, 4999), (4, 6), (5, 3), (3, 0)] {
        let mut robots = vec![robot.clone(); threads];
        let mut out: Vec<bool> = one_by_one[..rows].iter().map(|hit| !hit).collect();
        collides_all(&mut robots, &q[..7 * rows], &mut out).unwrap();
        assert_eq!(out, one_by_one[..rows], "{threads} {rows}");
    }
}

#[test]
fn many_are_asked_without_memory_and_refused_whole() {
    let Some((model, q, _)) = scene_of_an_arm() else { return };
    let (mut robot, mut out) = (Robot::new(&model), vec![false; 10]);
    let mut bad = q[..70].to_vec();
    bad[65] = f64::NAN;
    let some: Vec<ColliderId> = model.colliders().map(|c| c.0).take(2).collect();
    let mut whole = out.clone();
    let counted = allocation_counter::measure(|| {
        robot.collides_all(&q[..70], &mut whole).unwrap();
        assert!(matches!(
            robot.collides_all(&bad, &mut out),
            Err(RobotError::NotFinite { index: 65, .. })
        ));
        assert!(matches!(
            robot.collides_all(&q[..69], &mut out),
            Err(RobotError::Length { wanted: 70, .. })
        ));
        robot.pad_all(&some, 0.001).unwrap();
        robot.pad_all(&some, -1.0).unwrap_err();
        robot.set_detail_of(some[0], Detail::Coarse).unwrap();
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert!(!out.contains(&true) && whole.contains(&true));
    let no = collides_all(&mut [], &[], &mut []).unwrap_err();
    assert!(matches!(no, RobotError::NoRoom { .. }), "{no}");
    let other = scene_of_an_arm().unwrap().0;
    let mut mixed = [robot, Robot::new(&other)];
    let no = collides_all(&mut mixed, &q[..70], &mut out).unwrap_err();
    assert!(matches!(no, RobotError::ForeignHandle), "{no}");
    let no = collides_all(&mut mixed[..1], &bad, &mut out).unwrap_err();
    assert!(matches!(no, RobotError::NotFinite { .. }), "{no}");
    assert!(!out.contains(&true));
}

#[test]
fn colliders_of_parts_and_objects_are_padded_and_coarse_together() {
    let Some((model, _, _)) = scene_of_an_arm() else { return };
    let (arm, bar) = (model.part("arm").unwrap(), model.object("bar").unwrap());
    let bodies = model.bodies(arm).unwrap();
    let own: Vec<ColliderId> = model.colliders_of_part(arm).unwrap().collect();
    let on = |id: &ColliderId| {
        model.multibody().body(&model.collider_spec(*id).body).is_some_and(|b| bodies.contains(&b))
    };
    let wanted: Vec<ColliderId> = model.colliders().map(|c| c.0).filter(on).collect();
    assert!(own == wanted && own.len() > 5, "{own:?}");
    let held: Vec<ColliderId> = model.colliders_of_object(bar).unwrap().collect();
    assert_eq!(held, [model.collider("bar").unwrap()]);
    // Between two colliders of the part, both paddings count. Between the part and the scene, only one
    // counts.
    let mut robot = Robot::new(&model);
    let q = model.multibody().neutral_q();
    let scene = model.colliders().map(|c| c.0).find(|c| !own.contains(c) && !held.contains(c));
    let scene = scene.unwrap();
    let gap = |robot: &mut Robot, a, b| robot.distance(&q, a, b).unwrap().unwrap().distance;
    let (first, last) = (own[0], own[own.len() - 1]);
    let before = [gap(&mut robot, first, last), gap(&mut robot, first, scene)];
    robot.pad_all(&own, 0.01).unwrap();
    let after = [gap(&mut robot, first, last), gap(&mut robot, first, scene)];
    assert!((before[0] - after[0] - 0.02).abs() < 1e-9, "{before:?} {after:?}");
    assert!((before[1] - after[1] - 0.01).abs() < 1e-9, "{before:?} {after:?}");
    // Second neighbours always touch at this padding, so it is rejected and all paddings stay unchanged.
    let no = robot.pad_all(&own, 5.0).unwrap_err();
    assert!(matches!(no, RobotError::NeverFree { .. }), "{no}");
    assert_eq!(gap(&mut robot, first, last), after[0]);
    // With this padding, either collider alone is accepted, but not both.
    let most = (1..400).map(|k| f64::from(k) * 0.01);
    let fits = |p: f64, ids: &[ColliderId]| Robot::new(&model).pad_all(ids, p).is_ok();
    let alone = most.clone().take_while(|p| own.iter().all(|id| fits(*p, &[*id]))).last().unwrap();
    let together = most.take_while(|p| fits(*p, &own)).last().unwrap();
    assert!(together < alone, "{together} {alone}");
}

#[test]
fn one_collider_may_be_coarse() {
    let ball = |radius| Shape::Sphere { radius };
    let mut spec = ModelSpec::default();
    for (name, y) in [("near", 0.5), ("far", -0.5)] {
        let mut c = ColliderSpec::new(name, "world", ball(0.1));
        c.coarse = Some(ball(0.45));
        spec.colliders.push(c.at(Pose::translation(0.0, y, 0.0)));
    }
    let mut mechanism = Builder::new();
    mechanism.body(BodySpec::new("cube", "world").hinge(Hinge::slider(Vec3::x())));
    let mut spec = ModelSpec { mechanism, ..spec };
    let half = Vec3::new(0.1, 0.1, 0.1);
    spec.colliders.push(ColliderSpec::new("cube", "cube", Shape::Box { half }));
    spec.rules.neighbours = Neighbours::Collide;
    let model = RobotModel::new(&spec).unwrap();
    let mut robot = Robot::new(&model);
    let [near, far, cube] = ["near", "far", "cube"].map(|n| model.collider(n).unwrap());
    let hits = |robot: &mut Robot| {
        let mut out = Vec::new();
        robot.hits(&[0.0], &mut out).unwrap();
        out
    };
    assert!(hits(&mut robot).is_empty());
    robot.set_detail_of(near, Detail::Coarse).unwrap();
    assert_eq!(hits(&mut robot), [(cube.min(near), cube.max(near))]);
    // A collider without a coarse shape gives the same results. A clone has the same setting.
    robot.set_detail_of(cube, Detail::Coarse).unwrap();
    assert_eq!(hits(&mut robot.clone()).len(), 1);
    robot.set_detail(Detail::Coarse);
    assert_eq!(hits(&mut robot).len(), 2);
    robot.set_detail_of(far, Detail::Fine).unwrap();
    robot.set_detail_of(near, Detail::Fine).unwrap();
    assert!(hits(&mut robot).is_empty());
}

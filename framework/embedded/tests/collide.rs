//! Collisions of a robot: every result of the reference, changes at run time, filters that follow held objects, paths.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

#[test]
fn a_scene_of_an_arm_is_told_right_five_thousand_times() {
    let Some(json) = reference("robodarts/col1_scene.json") else { return };
    let model = robot_in("robots/iiwa7.urdf", &json, &[], vec![], vec![]);
    let mut robot = Robot::new(&model);
    let ik = reference("robodarts/ik_iiwa7.json").unwrap();
    let (low, high) = (numbers(&ik["lower"]), numbers(&ik["upper"]));
    let mut rng = Rng(json["seed"].as_u64().unwrap());
    let mut wrong = 0;
    for (k, expected) in json["colliding"].as_str().unwrap().chars().enumerate() {
        let q: Vec<f64> = (0..7).map(|i| rng.within(low[i], high[i])).collect();
        if k < 3 {
            assert!(difference(&q, &numbers(&json["first_q"][k])) < 1e-12);
        }
        wrong += usize::from(robot.collides(&q).unwrap() != (expected == '1'));
    }
    assert_eq!(wrong, 0);
    // The model must check the same pairs as the reference.
    let pairs = json["pairs"].as_array().unwrap();
    assert_eq!(looked_at(&model, &robot), pairs.len());
    for p in pairs.iter().map(names) {
        let [a, b] = [0, 1].map(|i| model.collider(&p[i]).unwrap());
        assert!(robot.looks_at(a, b).unwrap(), "{p:?}");
    }
}

fn all(model: &RobotModel) -> Vec<ColliderId> {
    model.colliders().map(|c| c.0).collect()
}

fn looked_at(model: &RobotModel, robot: &Robot) -> usize {
    let ids = all(model);
    let pairs = ids.iter().flat_map(|a| ids.iter().map(move |b| (*a, *b))).filter(|(a, b)| a < b);
    pairs.filter(|(a, b)| robot.looks_at(*a, *b).unwrap()).count()
}

#[test]
fn two_arms_fine_padded_and_coarse_are_told_right_pair_by_pair() {
    let Some(json) = reference("robodarts/dual_ur5_collisions.json") else { return };
    let model = robot_in("robodarts/dual_ur5.urdf", &json, &[], vec![], vec![]);
    let at = places(&model, &names(&json["dof"]));
    let pairs: Vec<(ColliderId, ColliderId)> =
        (json["pairs"].as_array().unwrap().iter().map(names))
            .map(|p| {
                let [a, b] = [0, 1].map(|i| model.collider(&p[i]).unwrap());
                (a.min(b), a.max(b))
            })
            .collect();
    let fresh = Robot::new(&model);
    assert_eq!(looked_at(&model, &fresh), pairs.len());
    let (mut worst, mut distances) = (0.0_f64, 0);
    let mut sorted = pairs.clone();
    sorted.sort();
    let (mut apart, mut near) = (Vec::new(), Vec::new());
    let mut robot = fresh.clone();
    for (key, padding, detail) in [
        ("fine", 0.0, Detail::Fine),
        ("padded", json["padding"].as_f64().unwrap(), Detail::Fine),
        ("coarse", 0.0, Detail::Coarse),
        ("fine", 0.0, Detail::Fine),
    ] {
        for id in all(&model) {
            robot.pad(id, padding).unwrap();
        }
        robot.set_detail(detail);
        for state in json["states"].as_array().unwrap() {
            let q = to_q(&model, &at, &numbers(&state["q"]));
            let golden = &state[key];
            let mut expected: Vec<_> = (golden["colliding"].as_array().unwrap().iter())
                .map(|k| pairs[k.as_u64().unwrap() as usize])
                .collect();
            expected.sort();
            let mut ours = Vec::new();
            robot.hits(&q, &mut ours).unwrap();
            ours.sort();
            assert_eq!(ours, expected, "{key}");
            let first = robot.first_hit(&q).unwrap();
            assert_eq!(first.is_some(), !ours.is_empty());
            assert!(first.is_none_or(|p| ours.contains(&p)));
            let closest = robot.clearance(&q, f64::INFINITY).unwrap().unwrap();
            assert_eq!(closest.distance.distance <= 0.0, !ours.is_empty());
            robot.distances(&q, f64::INFINITY, &mut apart).unwrap();
            assert!(apart.iter().map(|c| (c.a, c.b)).eq(sorted.iter().copied()), "all pairs, once");
            let touching = apart.iter().filter(|c| c.distance.distance <= 0.0);
            assert!(touching.map(|c| (c.a, c.b)).eq(ours.iter().copied()), "{key}");
            let least = apart.iter().map(|c| c.distance.distance).fold(f64::INFINITY, f64::min);
            assert!((least - closest.distance.distance).abs() < 1e-9, "{least}");
            robot.distances(&q, 0.1, &mut near).unwrap();
            apart.retain(|c| c.distance.distance <= 0.1);
            assert!(near.iter().map(|c| (c.a, c.b)).eq(apart.iter().map(|c| (c.a, c.b))));
            if let Some(d) = golden["least_distance"].as_f64() {
                worst = worst.max((closest.distance.distance - d).abs());
                distances += 1;
                let pair = pairs[golden["least_pair"].as_u64().unwrap() as usize];
                assert_eq!((closest.a, closest.b), pair, "{key}");
                let between = closest.distance.point_b - closest.distance.point_a;
                assert!((between.norm() - d.abs()).abs() < 2e-6);
            }
        }
    }
    println!("{distances} least distances within {worst:.1e} m");
    assert!(distances > 50 && worst < 2e-6, "{distances} {worst}");
    // After the settings are restored, the results are bit-identical again.
    let (mut a, mut b) = (fresh, robot);
    for state in json["states"].as_array().unwrap().iter().take(50) {
        let q = to_q(&model, &at, &numbers(&state["q"]));
        assert_eq!(a.first_hit(&q).unwrap(), b.first_hit(&q).unwrap());
        assert_eq!(a.clearance(&q, 1.0).unwrap(), b.clearance(&q, 1.0).unwrap());
    }
}

#[test]
fn single_pairs_have_the_distances_of_the_reference() {
    let Some(json) = reference("robodarts/pair_distances.json") else { return };
    let (mut worst, mut count, mut skipped) = (0.0_f64, 0, 0);
    for case in json["cases"].as_array().unwrap() {
        let at = |k: &str| {
            let x = &case[k];
            pose(&[numbers(&x["position"]), numbers(&x["quaternion"])].concat())
        };
        let of = |k: &str| shape(&json["shapes"][case[k].as_str().unwrap()]);
        let mut mechanism = Builder::new();
        mechanism.body(BodySpec::new("mover", "world").hinge(Hinge::free()));
        let spec = ModelSpec {
            mechanism,
            colliders: vec![
                ColliderSpec::new("a", "mover", of("a")).at(at("pose_a")),
                ColliderSpec::new("b", "world", of("b")).at(at("pose_b")),
            ],
            ..ModelSpec::default()
        };
        let model = RobotModel::new(&spec).unwrap();
        let mut robot = Robot::new(&model);
        let [a, b] = ["a", "b"].map(|n| model.collider(n).unwrap());
        let q = model.multibody().neutral_q();
        let Some(golden) = case["distance"].as_f64() else {
            // Surfaces that intersect do not have a depth there, so only the boolean result counts.
            assert_eq!(robot.collides(&q).unwrap(), case["overlap"].as_bool().unwrap());
            skipped += 1;
            continue;
        };
        assert_eq!(robot.collides(&q).unwrap(), golden <= 0.0, "{case}");
        let found = robot.distance(&q, a, b).unwrap().unwrap();
        worst = worst.max((found.distance - golden).abs());
        let padding = numbers(&case["padding"]);
        if let Some(padded) = case["distance_padded"].as_f64() {
            robot.pad(a, padding[0]).unwrap();
            robot.pad(b, padding[1]).unwrap();
            worst = worst.max((robot.distance(&q, a, b).unwrap().unwrap().distance - padded).abs());
            assert_eq!(robot.collides(&q).unwrap(), padded <= 0.0);
        }
        count += 1;
    }
    println!(
        "{count} distances within {worst:.1e} m, {skipped} collision checks without a distance"
    );
    assert!(worst < 2e-6 && count + skipped == 168, "{worst} {count} {skipped}");
}

#[test]
fn filters_follow_what_is_held() {
    let Some(tasks) = reference("robodarts/tasks.json") else { return };
    let task = &tasks["tasks"]["hang_up_phone"];
    let json = reference("robodarts/dual_ur5_collisions.json").unwrap();
    let (h, c) = (&task["bodies"]["handset"], &task["bodies"]["cradle"]);
    let number = |v: &serde_json::Value, k: &str| v[k].as_f64().unwrap();
    let handset_shape =
        Shape::Capsule { radius: number(h, "radius"), half_length: number(h, "half_length") };
    let place = numbers(&c["position"]);
    let more = vec![
        ColliderSpec::new("handset", "handset", handset_shape),
        ColliderSpec::new(
            "cradle",
            "world",
            Shape::Box { half: Vec3::from_column_slice(&numbers(&c["half"])) },
        )
        .at(Pose::translation(place[0], place[1], place[2])),
    ];
    let mass = MassProperties::new(
        number(h, "mass"),
        Vec3::zeros(),
        Mat3::from_diagonal(&Vec3::from_column_slice(&numbers(&h["inertia"]))),
    );
    let parts = [PartSpec::chain("left", "left_base_link", "left_tcp")];
    let objects = vec![ObjectSpec { name: "handset".into(), mass }];
    let model = robot_in("robodarts/dual_ur5.urdf", &json, &parts, objects, more);
    let (left, object) = (model.part("left").unwrap(), model.object("handset").unwrap());
    let [handset, cradle] = ["handset", "cradle"].map(|n| model.collider(n).unwrap());
    let at = places(&model, &names(&task["dof"]));
    let expect = &task["expect"];
    let mut robot = Robot::new(&model);
    let other = robot.clone();
    let met = |robot: &Robot| -> Vec<String> {
        let looks = |id: &ColliderId| *id != handset && robot.looks_at(handset, *id).unwrap();
        all(&model).into_iter().filter(looks).map(|i| model.collider_name(i).to_owned()).collect()
    };
    let free = met(&robot);
    assert_eq!(free.len() as u64, expect["pairs_of_handset_when_free"].as_u64().unwrap());
    let X = pose(&numbers(&h["pose_in_tip"]));
    robot.set_q(&to_q(&model, &at, &numbers(&expect["q_up"]))).unwrap();
    robot.grasp(left, object, Grasp::At(X)).unwrap();
    let held = met(&robot);
    assert_eq!(held.len() as u64, expect["pairs_of_handset_when_held"].as_u64().unwrap());
    let mut dropped: Vec<String> = free.iter().filter(|n| !held.contains(n)).cloned().collect();
    dropped.sort();
    assert_eq!(dropped, names(&expect["dropped"]));
    // Compare distances with the handset above the cradle and on it.
    let mut apart = Vec::new();
    for (key, q) in [("up", "q_up"), ("on_cradle", "q_on")] {
        let q = to_q(&model, &at, &numbers(&expect[q]));
        let golden = &expect["distances"][key];
        let d = robot.distance(&q, handset, cradle).unwrap().unwrap().distance;
        let theirs = number(golden, "handset_to_cradle");
        assert!((d - theirs).abs() < 1e-8 * theirs, "{key} {d}");
        // The result is the distance and the name of the nearest collider other than the cradle.
        robot.distances(&q, f64::INFINITY, &mut apart).unwrap();
        let others =
            apart.iter().filter(|c| [c.a, c.b].contains(&handset) && ![c.a, c.b].contains(&cradle));
        let least = others.min_by(|a, b| a.distance.distance.total_cmp(&b.distance.distance));
        let least = least.unwrap();
        let theirs = &golden["handset_least_of_the_others"];
        let d = theirs[0].as_f64().unwrap();
        assert!((least.distance.distance - d).abs() < 1e-8 * d, "{key} {least:?}");
        let mut ours = [least.a, least.b].map(|c| model.collider_name(c));
        let mut theirs = [1, 2].map(|k| theirs[k].as_str().unwrap());
        ours.sort_unstable();
        theirs.sort_unstable();
        assert_eq!(ours, theirs, "{key}");
        assert!(!robot.hits_of(&q, handset));
    }
    // On its cradle the handset touches with a padding of 1 cm, until this pair is allowed.
    let on = to_q(&model, &at, &numbers(&expect["q_on"]));
    robot.pad(handset, 0.01).unwrap();
    assert!(robot.hits_of(&on, handset));
    robot.look_at(handset, cradle, Some(false)).unwrap();
    assert!(!robot.hits_of(&on, handset));
    robot.look_at(handset, cradle, None).unwrap();
    assert!(robot.hits_of(&on, handset));
    robot.show(handset, Visibility::Hidden).unwrap();
    assert!(!robot.hits_of(&on, handset));
    robot.show(handset, Visibility::Shown).unwrap();
    robot.ungrasp(object).unwrap();
    assert_eq!(met(&robot), free);
    assert_eq!(met(&other), free, "another instance has noticed nothing");
}

/// Contact between two held objects can be allowed; only this pair is ignored.
#[test]
fn two_held_objects_may_be_allowed_to_touch() {
    let mut mechanism = Builder::new();
    for (name, x) in [("left", -0.3), ("right", 0.3)] {
        let slider = |axis: Vec3| Hinge::slider(axis).limits(Limits::position(-1.0, 1.0));
        let (lift, at) = (format!("{name} lift"), Pose::translation(x, 0.0, 0.0));
        let body = BodySpec::new(&lift, "world").hinge_in_parent(at);
        mechanism.body(body.hinge(slider(Vec3::z())));
        mechanism.body(BodySpec::new(name, &lift).hinge(slider(Vec3::x())));
    }
    let unit = MassProperties::new(0.1, Vec3::zeros(), Mat3::identity() * 1e-3);
    let ball = |name: &str, on: &str| ColliderSpec::new(name, on, Shape::Sphere { radius: 0.1 });
    let spec = ModelSpec {
        mechanism,
        objects: ["bolt", "nut"].map(|n| ObjectSpec { name: n.into(), mass: unit }).to_vec(),
        parts: ["left", "right"].map(|n| PartSpec::chain(n, "world", n)).to_vec(),
        colliders: vec![
            ball("bolt", "bolt"),
            ball("nut", "nut"),
            ball("left", "left"),
            ball("right", "right"),
            ball("wall", "world").at(Pose::translation(0.0, 0.25, 0.0)),
        ],
        ..ModelSpec::default()
    };
    let model = RobotModel::new(&spec).unwrap();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let [bolt, nut] = ["bolt", "nut"].map(|o| model.object(o).unwrap());
    let id = |n: &str| model.collider(n).unwrap();
    let mut robot = Robot::new(&model);
    robot.grasp(left, bolt, Grasp::At(Pose::translation(0.15, 0.0, 0.0))).unwrap();
    robot.grasp(right, nut, Grasp::At(Pose::translation(-0.15, 0.0, 0.0))).unwrap();
    // At rest, the centres of the balls are 0.3 m apart and the hands 0.6 m.
    let pair = (id("bolt").min(id("nut")), id("bolt").max(id("nut")));
    let hits = |robot: &mut Robot, d: f64| {
        let mut out = Vec::new();
        robot.hits(&[0.0, d, 0.0, -d], &mut out).unwrap();
        out
    };
    assert_eq!(hits(&mut robot, 0.045), []);
    assert_eq!(hits(&mut robot, 0.06), [pair]);
    let other = robot.clone();
    robot.look_at(id("bolt"), id("nut"), Some(false)).unwrap();
    assert!(!robot.looks_at(id("bolt"), id("nut")).unwrap());
    assert_eq!(hits(&mut robot, 0.06), []);
    assert!(!robot.collides(&[0.0, 0.06, 0.0, -0.06]).unwrap());
    // All other pairs are checked: the nut hits the hand that holds the bolt, the bolt the hand that holds the nut, and both hit the wall.
    let mut crossed = hits(&mut robot, 0.18);
    let sorted = |a: &str, b: &str| (id(a).min(id(b)), id(a).max(id(b)));
    crossed.sort();
    let mut wanted = vec![sorted("bolt", "right"), sorted("nut", "left")];
    wanted.sort();
    assert_eq!(crossed, wanted);
    robot.pad(id("wall"), 0.06).unwrap();
    let near = hits(&mut robot, 0.15);
    assert!(near.contains(&sorted("bolt", "wall")) && near.contains(&sorted("nut", "wall")));
    robot.pad(id("wall"), 0.0).unwrap();
    // The permission persists through a new grasp until it is revoked; other instances do not have it.
    robot.ungrasp(nut).unwrap();
    robot.grasp(right, nut, Grasp::Here).unwrap();
    assert!(!robot.looks_at(id("bolt"), id("nut")).unwrap());
    robot.look_at(id("bolt"), id("nut"), None).unwrap();
    assert_eq!(hits(&mut robot, 0.06), [pair]);
    assert_eq!(hits(&mut other.clone(), 0.06), [pair]);
}

trait HitsOf {
    fn hits_of(&mut self, q: &[f64], id: ColliderId) -> bool;
}

impl HitsOf for Robot {
    fn hits_of(&mut self, q: &[f64], id: ColliderId) -> bool {
        let mut out = Vec::new();
        self.hits(q, &mut out).unwrap();
        out.iter().any(|(a, b)| *a == id || *b == id)
    }
}

/// A rod on a pin at the origin, and a plate so thin that a few samples of a swing miss it.
fn rod(plate_at: f64) -> Arc<RobotModel> {
    let mut mechanism = Builder::new();
    let hinge = Hinge::pin(Vec3::z()).limits(Limits::position(-3.0, 3.0));
    mechanism.body(BodySpec::new("rod", "world").hinge(hinge));
    let half = Vec3::new(0.5, 0.01, 0.01);
    let plate = Vec3::new(0.05, 0.0005, 0.05);
    let turn = spatial::Quat::from_scaled_axis(Vec3::z() * plate_at);
    let colliders = vec![
        ColliderSpec::new("rod", "rod", Shape::Box { half }).at(Pose::translation(0.5, 0.0, 0.0)),
        ColliderSpec::new("plate", "world", Shape::Box { half: plate })
            .at(Pose::new(turn, turn * Vec3::new(0.9, 0.0, 0.0))),
    ];
    let rules = Rules { collide: vec![["rod".into(), "plate".into()]], ..Rules::default() };
    let parts = vec![PartSpec::chain("arm", "world", "rod")];
    RobotModel::new(&ModelSpec { mechanism, colliders, rules, parts, ..ModelSpec::default() })
        .unwrap()
}

#[test]
fn a_path_jumps_over_nothing() {
    for plate in [0.3, 0.777, 1.234_567, 2.1] {
        let model = rod(plate);
        let mut robot = Robot::new(&model);
        // The arm is free at the ends of its swing and at nearly all of ten positions in between.
        let swing = |k: usize| [0.05 + 2.9 * k as f64 / 11.0];
        assert!((0..12).filter(|k| robot.collides(&swing(*k)).unwrap()).count() <= 1);
        let path = robot.path_free(&swing(0), &swing(11), 1e-4).unwrap();
        let Path::Hit { at, .. } = path else { panic!("{plate}: {path:?}") };
        assert!(robot.collides(&[0.05 + 2.9 * at]).unwrap());
        assert!((0.05 + 2.9 * at - plate).abs() < 0.05);
        // Before the plate the path is proven free; the first contact is approximately where geometry predicts it.
        let short = robot.path_free(&[-1.0], &[plate - 0.03], 1e-4).unwrap();
        assert_eq!(short, Path::Free, "{plate}");
        assert_eq!(robot.path_free(&[plate + 0.03], &[2.9], 1e-4).unwrap(), Path::Free);
        // Checking in portions gives a bit-identical result.
        for ends in [(swing(0), swing(11)), ([-1.0], [plate - 0.03])] {
            let (mut progress, mut portions) = (PathProgress::default(), 0);
            let told = loop {
                portions += 1;
                let on = robot.path_free_on(&ends.0, &ends.1, 1e-4, &mut progress, 1);
                if let Some(told) = on.unwrap() {
                    break told;
                }
            };
            assert!(portions > 1, "{portions} portions say nothing");
            assert_eq!(told, robot.path_free(&ends.0, &ends.1, 1e-4).unwrap());
        }
    }
}

#[test]
fn paths_agree_with_fine_sampling() {
    let Some(json) = reference("robodarts/col1_scene.json") else { return };
    let model = robot_in("robots/iiwa7.urdf", &json, &[], vec![], vec![]);
    let mut robot = Robot::new(&model);
    let mut rng = Rng(11);
    let (mut free, mut hit) = (0, 0);
    for _ in 0..60 {
        let a: Vec<f64> = (0..7).map(|_| rng.within(-1.5, 1.5)).collect();
        let b: Vec<f64> = a.iter().map(|x| x + rng.within(-0.3, 0.3)).collect();
        let path = robot.path_free(&a, &b, 1e-3).unwrap();
        let mut at = |t: f64| {
            let q: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a + t * (b - a)).collect();
            robot.collides(&q).unwrap()
        };
        let sampled = (0..=300).any(|k| at(f64::from(k) / 300.0));
        match path {
            Path::Free => {
                free += 1;
                assert!(!sampled, "said to be free");
            }
            Path::Hit { at: t, .. } => {
                hit += 1;
                assert!(at(t));
            }
            Path::Undecided { .. } => {}
        }
    }
    assert!(free > 5 && hit > 5, "{free} {hit}");
}

#[test]
fn mistakes_are_refused() {
    let model = rod(1.0);
    let mut robot = Robot::new(&model);
    let id = model.collider("rod").unwrap();
    assert!(matches!(robot.collides(&[f64::NAN]), Err(RobotError::NotFinite { .. })));
    assert!(matches!(robot.collides(&[]), Err(RobotError::Length { .. })));
    assert!(matches!(robot.pad(id, -0.1), Err(RobotError::OutOfRange { .. })));
    assert!(matches!(robot.pad(id, f64::NAN), Err(RobotError::OutOfRange { .. })));
    assert!(matches!(robot.path_free(&[0.0], &[1.0], 0.0), Err(RobotError::OutOfRange { .. })));
    assert!(robot.clearance(&[0.0], f64::NAN).is_err());
    assert_eq!(model.collider("rods"), None);
    let mut spec = ModelSpec { mechanism: Builder::new(), ..ModelSpec::default() };
    spec.colliders = vec![ColliderSpec::new("a", "nowhere", Shape::Sphere { radius: -1.0 })];
    let text = RobotModel::new(&spec).unwrap_err().to_string();
    assert!(text.contains("nowhere") && text.contains("radius"), "{text}");
}

#[test]
fn questions_allocate_nothing() {
    let Some(json) = reference("robodarts/dual_ur5_collisions.json") else { return };
    let model = robot_in("robodarts/dual_ur5.urdf", &json, &[], vec![], vec![]);
    let mut robot = Robot::new(&model).clone();
    let at = places(&model, &names(&json["dof"]));
    let states = json["states"].as_array().unwrap();
    let qs: Vec<Vec<f64>> = states.iter().map(|s| to_q(&model, &at, &numbers(&s["q"]))).collect();
    let (a, b) = (all(&model)[0], all(&model)[1]);
    let mut found = Vec::with_capacity(400);
    let counted = allocation_counter::measure(|| {
        for q in &qs {
            robot.collides(q).unwrap();
            robot.first_hit(q).unwrap();
            robot.distances(q, f64::INFINITY, &mut found).unwrap();
            robot.clearance(q, f64::INFINITY).unwrap();
        }
        robot.pad(a, 0.02).unwrap();
        robot.show(b, Visibility::Hidden).unwrap();
        robot.look_at(a, b, Some(false)).unwrap();
        robot.set_detail(Detail::Coarse);
        robot.collides(&qs[0]).unwrap();
        robot.path_free(&qs[0], &qs[1], 1e-2).unwrap();
        let mut progress = PathProgress::default();
        while robot.path_free_on(&qs[0], &qs[1], 1e-2, &mut progress, 3).unwrap().is_none() {}
        robot.collides(&[]).unwrap_err();
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
}

/// An arm of one revolute joint with all shape types of URDF, and an SRDF file.
const SHAPES: &str = r#"<robot name="r"><link name="base">
    <collision><geometry><box size="0.2 0.4 0.6"/></geometry></collision></link>
  <link name="rod"><collision name="tube"><origin xyz="1 0 0"/><geometry><cylinder radius="0.1" length="0.8"/></geometry></collision>
    <collision name="tube"><origin xyz="3 0 0"/><geometry><sphere radius="0.25"/></geometry></collision>
    <visual><geometry><sphere radius="9"/></geometry></visual></link>
  <link name="tool"><collision><geometry><sphere radius="0.1"/></geometry></collision></link>
  <joint name="turn" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 0 1"/></joint>
  <joint name="end" type="prismatic"><parent link="rod"/><child link="tool"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>"#;

#[test]
fn shapes_of_a_file_collide_and_its_pairs_do_not() {
    let d = formats::read_text(SHAPES, &options()).unwrap();
    let spec = || ModelSpec::from_description(&d).unwrap().shapes(&d).unwrap();
    let model = RobotModel::new(&spec()).unwrap();
    let names: Vec<&str> = model.colliders().map(|c| c.1).collect();
    assert_eq!(names, ["base/0", "rod/1", "tool/0", "tube"]);
    let mut robot = Robot::new(&model);
    let q = model.multibody().neutral_q();
    // The base and the tool are not neighbours, so the sphere at the centre of the box collides
    // with it.
    let [base, tool, tube] = ["base/0", "tool/0", "tube"].map(|n| model.collider(n).unwrap());
    assert_eq!(robot.first_hit(&q).unwrap(), Some((base, tool)));
    let gap = robot.distance(&q, base, tube).unwrap().unwrap().distance;
    assert!(
        (gap - (0.9 - 0.1)).abs() < 1e-12,
        "{gap}: the tube's side is at 0.9 m, the box's face at 0.1 m"
    );
    let srdf = r#"<robot name="r"><disable_collisions link1="tool" link2="base"/></robot>"#;
    let srdf = formats::read_srdf(srdf, &options()).unwrap();
    let model = RobotModel::new(&spec().groups(&srdf, &d).unwrap()).unwrap();
    assert_eq!(model.unused(), spec().unused);
    assert_eq!(Robot::new(&model).first_hit(&q).unwrap(), None);
    let text = SHAPES.replace("<box size=\"0.2 0.4 0.6\"/>", "<mesh filename=\"base.stl\"/>");
    let d = formats::read_text(&text, &options()).unwrap();
    let text = ModelSpec::from_description(&d).unwrap().shapes(&d).unwrap_err().to_string();
    assert!(
        text.contains("`base/0`") && text.contains("base.stl") && text.contains("help"),
        "{text}"
    );
    let srdf = r#"<robot name="r"><disable_collisions link1="tool" link2="basis"/></robot>"#;
    let srdf = formats::read_srdf(srdf, &options()).unwrap();
    let text = RobotModel::new(&spec().groups(&srdf, &d).unwrap()).unwrap_err().to_string();
    assert!(text.contains("basis") && text.contains("base"), "{text}");
}

/// Loads a URDF with its SRDF, a mesh, and a joint that mimics another.
#[test]
fn a_robot_is_loaded_with_its_shapes_and_couplings() {
    let folder = std::env::temp_dir().join(format!("linkwork_robot_{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.join(name), text).unwrap();
    // The mesh is a tetrahedron in mm, as STL and as OBJ; the URDF file scales it.
    let corners = ["0 0 0", "100 0 0", "0 100 0", "0 0 100"];
    let faces = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
    let facet = |f: &[usize; 3]| {
        let lines: String = f.iter().map(|k| format!("vertex {}\n", corners[*k])).collect();
        format!("facet normal 0 0 0\nouter loop\n{lines}endloop\nendfacet\n")
    };
    write(
        "tip.stl",
        &format!("solid t\n{}endsolid t\n", faces.iter().map(facet).collect::<String>()),
    );
    let vertices: String = corners.iter().map(|c| format!("v {c}\n")).collect();
    write("tip.obj", &format!("{vertices}f 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"));
    let text = |mesh: &str| {
        let mimic = "<limit lower=\"0\" upper=\"1\" effort=\"1\" velocity=\"1\"/><mimic joint=\"turn\" multiplier=\"0.5\"/>";
        SHAPES
            .replace("continuous", "revolute")
            .replace("<axis xyz=\"0 0 1\"/>", "<axis xyz=\"0 0 1\"/><limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/>")
            .replace("<limit lower=\"0\" upper=\"1\" effort=\"1\" velocity=\"1\"/>", mimic)
            .replace("<sphere radius=\"0.1\"/>", mesh)
    };
    write(
        "r.srdf",
        r#"<robot name="r"><group name="arm"><chain base_link="base" tip_link="tool"/></group>
        <disable_collisions link1="base" link2="rod"/></robot>"#,
    );
    let q = [0.2, 0.1];
    let [mut at_stl, mut at_obj] = ["tip.stl", "tip.obj"].map(|file| {
        write("r.urdf", &text(&format!("<mesh filename=\"{file}\" scale=\"0.001 0.001 0.001\"/>")));
        let groups = folder.join("r.srdf");
        let model = RobotModel::load(folder.join("r.urdf"), Some(&groups), &options()).unwrap();
        assert!(model.part("arm").is_some() && model.colliders().len() == 4);
        assert_eq!(model.multibody().couplings().len(), 1);
        Robot::new(&model)
    });
    let tool = at_stl.model().collider("tool/0").unwrap();
    let base = at_stl.model().collider("base/0").unwrap();
    assert_eq!(at_stl.first_hit(&q).unwrap(), Some((base, tool)));
    let tube = at_stl.model().collider("tube").unwrap();
    // The corner (0.2, 0, 0) in axes of the rod is nearest to the tube, whose side is at x = 0.9 on this axis.
    let gap = at_stl.distance(&q, tool, tube).unwrap().unwrap().distance;
    assert!((gap - 0.7).abs() < 1e-9, "{gap}");
    assert_eq!(at_obj.distance(&q, tool, tube).unwrap().unwrap().distance, gap);
    write("r.urdf", &text("<mesh filename=\"tip.dae\"/>"));
    write("tip.dae", "<COLLADA/>");
    let told = RobotModel::load(folder.join("r.urdf"), None, &options()).unwrap_err().to_string();
    assert!(told.contains("tip.dae`: it has no triangles"), "{told}");
    assert!(told.contains("help: give that body primitive shapes"), "{told}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// Colliders have the friction and restitution of the file; a file without them has 0.5 and 0.
#[test]
fn colliders_of_a_file_have_its_surfaces() {
    let text = r#"<sdf version="1.9"><model name="m"><link name="a"><collision name="plain"><geometry><sphere><radius>1</radius></sphere></geometry></collision>
<collision name="rubber"><geometry><sphere><radius>1</radius></sphere></geometry><surface><friction><ode><mu>0.9</mu></ode></friction><bounce><restitution_coefficient>0.7</restitution_coefficient></bounce></surface></collision></link></model></sdf>"#;
    let read = |text: &str| linkwork_formats::read_text(text, &Default::default()).unwrap();
    let found = colliders_of(&read(text)).unwrap();
    let of = |name: &str| found.iter().find(|c| c.name == name).unwrap().material;
    assert_eq!((of("plain").friction, of("plain").restitution), (0.5, 0.0));
    assert_eq!((of("rubber").friction, of("rubber").restitution), (0.9, 0.7));
    let text = r#"<mujoco><worldbody><body><joint/><geom name="g" size="1" condim="6" friction="0.8 0.02 0.003"/></body></worldbody></mujoco>"#;
    let found = colliders_of(&read(text)).unwrap();
    assert_eq!(found[0].material.friction, 0.8);
    assert_eq!((found[0].resistance.rolling, found[0].resistance.spinning), (0.003, 0.02));
}

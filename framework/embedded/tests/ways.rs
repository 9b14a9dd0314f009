//! Collision-free paths from one configuration to another.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

/// An arm of two links in a plane, 0.5 m each, a wall across its path with a gate of this height about y = 0, and an adjacent finger that the arm
/// does not move.
fn arm(gate: f64) -> Arc<RobotModel> {
    let mut mechanism = Builder::new();
    let mass = MassProperties::new(1.0, Vec3::zeros(), Mat3::identity());
    let mut colliders = Vec::new();
    for (name, parent, at) in [("upper", "world", 0.0), ("lower", "upper", 0.5)] {
        let hinge = Hinge::pin(Vec3::z()).limits(Limits::position(-3.0, 3.0));
        let body = BodySpec::new(name, parent).hinge(hinge).mass(mass);
        mechanism.body(body.hinge_in_parent(Pose::translation(at, 0.0, 0.0)));
        let rod = Shape::Box { half: Vec3::new(0.23, 0.02, 0.02) };
        colliders.push(ColliderSpec::new(name, name, rod).at(Pose::translation(0.25, 0.0, 0.0)));
    }
    mechanism.body(BodySpec::new("finger", "world").hinge(Hinge::slider(Vec3::x())).mass(mass));
    let half = Vec3::new(0.05, 0.5, 0.1);
    for (name, y) in [("above", 0.5 + gate / 2.0), ("below", -0.5 - gate / 2.0)] {
        let wall = ColliderSpec::new(name, "world", Shape::Box { half });
        colliders.push(wall.at(Pose::translation(0.75, y, 0.0)));
    }
    let parts = vec![PartSpec::chain("arm", "world", "lower")];
    RobotModel::new(&ModelSpec { mechanism, colliders, parts, ..ModelSpec::default() }).unwrap()
}

/// From above the wall to below it.
fn ends(model: &RobotModel) -> [Vec<f64>; 2] {
    let [upper, lower] = ["upper", "lower"].map(|b| {
        let id = model.multibody().body(b).unwrap();
        model.multibody().get(id).q().start
    });
    [[1.6, -0.4], [-1.6, 0.4]].map(|x| {
        let mut q = model.multibody().neutral_q();
        (q[upper], q[lower]) = (x[0], x[1]);
        q
    })
}

#[test]
fn a_way_is_free_and_the_same_each_time() {
    let model = arm(0.2);
    let (arm, [start, goal]) = (model.part("arm").unwrap(), ends(&model));
    let mut robot = Robot::new(&model);
    assert!(robot.path_free(&start, &goal, 1e-3).unwrap() != Path::Free, "not straight on");
    let mut planner = Planner::new(&robot, arm, 2000).unwrap();
    let mut ways: Vec<Vec<Vec<f64>>> = Vec::new();
    for seed in [1, 2, 3, 1] {
        let search = Search { seed, ..Search::default() };
        let found = planner.plan(&mut robot, &start, &goal, &search).unwrap();
        assert_eq!(found, PlanOutcome::Found, "seed {seed}");
        let way: Vec<Vec<f64>> = planner.path().map(<[f64]>::to_vec).collect();
        assert!(way.len() > 2 && way[0] == start && way[way.len() - 1] == goal);
        for pair in way.windows(2) {
            assert_eq!(robot.path_free(&pair[0], &pair[1], 1e-3).unwrap(), Path::Free);
            // Check samples of the path, too, as an independent test.
            for k in 0..=200 {
                let x = f64::from(k) / 200.0;
                let q: Vec<f64> =
                    pair[0].iter().zip(&pair[1]).map(|(a, b)| a + x * (b - a)).collect();
                assert!(!robot.collides(&q).unwrap());
            }
        }
        ways.push(way);
    }
    assert_eq!(ways[0], ways[3], "to the bit");
    assert!(ways[0] != ways[1]);
    // The straight path is free.
    let near: Vec<f64> = start.iter().map(|x| x * 1.01).collect();
    assert_eq!(
        planner.plan(&mut robot, &start, &near, &Search::default()).unwrap(),
        PlanOutcome::Found
    );
    assert_eq!(planner.path().len(), 2);
}

#[test]
fn a_search_in_portions_finds_the_same_to_the_bit() {
    let model = arm(0.2);
    let (arm, [start, goal]) = (model.part("arm").unwrap(), ends(&model));
    let (mut robot, mut other) = (Robot::new(&model), Robot::new(&model));
    let mut whole = Planner::new(&robot, arm, 2000).unwrap();
    let mut cut = Planner::new(&other, arm, 2000).unwrap();
    for (seed, places) in [(1, 1), (2, 3), (3, 7)] {
        let search = Search { seed, ..Search::default() };
        assert_eq!(whole.plan(&mut robot, &start, &goal, &search).unwrap(), PlanOutcome::Found);
        let mut told = cut.begin(&mut other, &start, &goal, &search).unwrap();
        let mut portions = 0;
        while told == PlanOutcome::Unfinished {
            told = cut.resume(&mut other, places).unwrap();
            portions += 1;
        }
        assert!(portions > 1, "{portions} portions say nothing");
        assert_eq!(told, PlanOutcome::Found);
        assert!(whole.path().eq(cut.path()), "seed {seed}");
        // The planner has no search to continue.
        assert_eq!(cut.resume(&mut other, 1).unwrap(), PlanOutcome::NotFound);
    }
}

#[test]
fn searches_allocate_nothing() {
    let model = arm(0.2);
    let (arm, [start, goal]) = (model.part("arm").unwrap(), ends(&model));
    let mut robot = Robot::new(&model);
    let mut planner = Planner::new(&robot, arm, 2000).unwrap();
    let counted = allocation_counter::measure(|| {
        let search = Search::default();
        assert_eq!(planner.plan(&mut robot, &start, &goal, &search).unwrap(), PlanOutcome::Found);
        planner.begin(&mut robot, &start, &goal, &search).unwrap();
        while planner.resume(&mut robot, 3).unwrap() == PlanOutcome::Unfinished {}
        assert!(planner.path().len() > 1);
        planner.plan(&mut robot, &start, &start[1..], &search).unwrap_err();
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
}

#[test]
fn what_cannot_be_is_told() {
    // The gate is closed: the arm, which can reach everywhere, stays on its side, and the work is bounded.
    let model = arm(0.0);
    let (arm_part, [start, goal]) = (model.part("arm").unwrap(), ends(&model));
    let mut robot = Robot::new(&model);
    let mut planner = Planner::new(&robot, arm_part, 20).unwrap();
    let search = Search { step: 0.1, ..Search::default() };
    assert_eq!(planner.plan(&mut robot, &start, &goal, &search).unwrap(), PlanOutcome::NotFound);
    assert_eq!(planner.path().len(), 0);
    let mut hit = goal.clone();
    let [upper, finger] = ["upper", "finger"].map(|b| {
        let id = model.multibody().body(b).unwrap();
        model.multibody().get(id).q().start
    });
    (hit[upper], hit[upper + 1]) = (0.2, 0.0);
    let pair = robot.first_hit(&hit).unwrap().unwrap();
    assert_eq!(
        planner.plan(&mut robot, &hit, &goal, &search),
        Ok(PlanOutcome::BlockedStart { pair })
    );
    assert_eq!(
        planner.plan(&mut robot, &start, &hit, &search),
        Ok(PlanOutcome::BlockedGoal { pair })
    );
    let mut plan = |start: &[f64], goal: &[f64], search: &Search| {
        planner.plan(&mut robot, start, goal, search).unwrap_err().to_string()
    };
    let mut off = goal.clone();
    off[finger] = 0.1;
    assert!(plan(&start, &off, &search).contains("does not belong to the part"));
    off[finger] = f64::NAN;
    assert!(plan(&start, &off, &search).contains("NaN"));
    let mut far = goal.clone();
    far[upper] = 3.5;
    assert!(plan(&start, &far, &search).contains("outside its limits"));
    assert!(plan(&start[1..], &goal, &search).contains("numbers"));
    assert!(plan(&start, &goal, &Search { step: 0.0, ..search }).contains("must be positive"));
    assert!(plan(&start, &goal, &Search { least: 0.0, ..search }).contains("fraction of the path"));
    assert!(Planner::new(&Robot::new(&model), arm_part, 1).is_err());
}

/// Self-collision of the two-armed robot: from one free configuration of the reference to another.
#[test]
fn an_arm_of_two_finds_its_way() {
    let Some(json) = reference("robodarts/dual_ur5_collisions.json") else { return };
    let parts = [PartSpec::chain("left", "left_base_link", "left_tcp")];
    let model = robot_in("robodarts/dual_ur5.urdf", &json, &parts, vec![], vec![]);
    let at = places(&model, &names(&json["dof"]));
    let left = model.part("left").unwrap();
    let mut robot = Robot::new(&model);
    let free: Vec<Vec<f64>> = (json["states"].as_array().unwrap().iter())
        .filter(|s| s["padded"]["colliding"].as_array().unwrap().is_empty())
        .map(|s| to_q(&model, &at, &numbers(&s["q"])))
        .collect();
    let mut planner = Planner::new(&robot, left, 1000).unwrap();
    let (mut found, mut corners) = (0, 0);
    for pair in free.windows(2).take(6) {
        let mut goal = pair[0].clone();
        for dof in model.dofs(left).unwrap() {
            // Each degree of freedom has one coordinate in q here.
            goal[*dof] = pair[1][*dof];
        }
        if robot.collides(&goal).unwrap() {
            continue;
        }
        let told = planner.plan(&mut robot, &pair[0], &goal, &Search::default()).unwrap();
        if told != PlanOutcome::Found {
            continue;
        }
        let way: Vec<Vec<f64>> = planner.path().map(<[f64]>::to_vec).collect();
        for pair in way.windows(2) {
            assert_eq!(robot.path_free(&pair[0], &pair[1], 1e-3).unwrap(), Path::Free);
        }
        found += 1;
        corners += way.len() - 2;
    }
    println!("{found} ways with {corners} corners");
    assert!(found >= 3 && corners >= 1, "{found} {corners}");
}

/// A path that would leave one of two hands behind is rejected; motion of the common carrier of both hands is allowed.
#[test]
fn nothing_tears_an_object_from_a_hand() {
    let mut spec = ModelSpec::default();
    let mass = MassProperties::new(1.0, Vec3::zeros(), Mat3::identity());
    let pin = || Hinge::pin(Vec3::z()).limits(Limits::position(-3.0, 3.0));
    spec.mechanism.body(BodySpec::new("waist", "world").hinge(pin()).mass(mass));
    for (name, y) in [("left", 0.3), ("right", -0.3)] {
        let body = BodySpec::new(name, "waist").hinge(pin()).mass(mass);
        spec.mechanism.body(body.hinge_in_parent(Pose::translation(0.0, y, 0.0)));
        let ball = ColliderSpec::new(name, name, Shape::Sphere { radius: 0.05 });
        spec.colliders.push(ball.at(Pose::translation(0.4, 0.0, 0.0)));
        spec.parts.push(PartSpec::chain(name, "waist", name));
    }
    spec.objects.push(ObjectSpec { name: "bar".into(), mass });
    let model = RobotModel::new(&spec).unwrap();
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let bar = model.object("bar").unwrap();
    let mut robot = Robot::new(&model);
    let q = robot.q().to_vec();
    let turned = |body: &str| {
        let mut q = q.clone();
        q[model.multibody().get(model.multibody().body(body).unwrap()).q().start] += 0.1;
        q
    };
    let mut planner = Planner::new(&robot, right, 100).unwrap();
    robot.grasp(left, bar, Grasp::Here).unwrap();
    // The other arm is free to move if only one hand holds the object.
    robot.path_free(&q, &turned("right"), 1e-2).unwrap();
    robot.grasp(right, bar, Grasp::Here).unwrap();
    let closure = Closure::Hands { object: 0 };
    let opens = RobotError::OpensClosure { what: "a straight path", closure };
    assert!(
        opens.to_string().contains("the grasp of object 0 by two hands\n  help: use `WholeBodyIk`")
    );
    assert_eq!(robot.path_free(&q, &turned("right"), 1e-2), Err(opens));
    let told = planner.plan(&mut robot, &q, &turned("right"), &Search::default());
    assert_eq!(told, Err(opens));
    assert_eq!(robot.path_free(&q, &turned("waist"), 1e-2).unwrap(), Path::Free);
    robot.release(right, bar).unwrap();
    robot.path_free(&q, &turned("right"), 1e-2).unwrap();
}

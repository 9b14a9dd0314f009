//! The reference beam in two hands, moved from each of its poses to each other with the loop closed.

use crate::support::*;
use linkwork_embedded::spatial::{MassProperties, Mat3, Vec3};
use linkwork_embedded::*;

/// Searches one pose of the reference from the configuration of another: reached, and the right hand is at its place on the beam.
#[test]
fn a_beam_goes_from_each_of_its_poses_to_each_other() {
    let Some(json) = reference("robodarts/dual_ur5_beam.json") else { return };
    let b = &json["beam"];
    let inertia = Mat3::from_diagonal(&Vec3::from_column_slice(&numbers(&b["inertia_diagonal"])));
    let mass = MassProperties::new(b["mass"].as_f64().unwrap(), Vec3::zeros(), inertia);
    let model = dual(vec![ObjectSpec { name: "beam".into(), mass }]).unwrap();
    let at = places(&model, &names(&json["dof"]));
    let in_beam = ["left_tip_in_beam", "right_tip_in_beam"].map(|k| pose(&numbers(&b[k])));
    let hands = ["left", "right"].map(|p| model.part(p).unwrap());
    let beam = model.object("beam").unwrap();
    let cases = json["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 4);
    let mut robot = Robot::new(&model);
    let mut search = WholeBodyIk::new(&robot, 1);
    for (i, held) in cases.iter().enumerate() {
        robot.set_q(&to_q(&model, &at, &numbers(&held["q"]))).unwrap();
        for (hand, X) in hands.iter().zip(&in_beam) {
            robot.grasp(*hand, beam, Grasp::At(X.inverse())).unwrap();
        }
        let X_beam = pose(&numbers(&held["beam_pose"]));
        let goal = Goal::pose(X_beam * in_beam[0]);
        for (j, other) in cases.iter().enumerate() {
            let mut q = to_q(&model, &at, &numbers(&other["q"]));
            let goals = [TipGoal::new(hands[0], goal)];
            let answer = search.solve(&robot, &goals, &Effort::default(), &mut q).unwrap();
            assert_eq!(answer.outcome, Outcome::Met, "{i} from {j}: {answer:?}");
            // Use the kinematics of another robot that holds nothing.
            let mut bare = Robot::new(&model);
            bare.set_q(&q).unwrap();
            let tips = hands.map(|h| bare.tip_pose(h).unwrap());
            for (what, tip, X) in [("goal", &tips[0], &in_beam[0]), ("loop", &tips[1], &in_beam[1])]
            {
                // Close the loop onto the beam at its pose in the left hand.
                let wanted = match what {
                    "goal" => X_beam * *X,
                    _ => tips[0] * in_beam[0].inverse() * *X,
                };
                let (p, R) = apart(tip, &wanted);
                assert!(p < 2e-9 && R < 2e-9, "{what}, {i} from {j}: {p:e} {R:e}");
            }
        }
        robot.ungrasp(beam).unwrap();
    }
}

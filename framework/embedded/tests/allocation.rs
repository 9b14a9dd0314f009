//! No call of a robot allocates after set-up, errors included.
#![allow(non_snake_case, clippy::unwrap_used)]

mod support;

use linkwork_embedded::spatial::Pose;
use linkwork_embedded::*;
use std::hint::black_box;
use support::*;

#[test]
fn no_call_allocates_after_set_up() {
    let Some(model) = dual(vec![]) else { return };
    let [left, gripper] = ["left", "left_gripper"].map(|p| model.part(p).unwrap());
    let mut robot = Robot::new(&model);
    let q = model.multibody().random_q(3);
    let (mut J, mut whole, mut g) = (vec![0.0; 36], vec![0.0; 6 * model.nv()], vec![0.0; 6]);
    let mut bad = q.clone();
    bad[3] = f64::NAN;
    let mut clamped = q.clone();
    let (start, far, near) = (model.multibody().neutral_q(), 9.0, 0.5);
    let counted = allocation_counter::measure(|| {
        robot.set_q(&q).unwrap();
        robot.clamp(&mut clamped).unwrap();
        black_box(robot.tip_pose(left).unwrap());
        black_box(robot.base_pose(left).unwrap());
        robot.jacobian(left, &mut J).unwrap();
        robot.whole_jacobian(left, &mut whole).unwrap();
        for rows in [Rows::All { length: 1.0 }, Rows::Linear, Rows::Angular] {
            black_box(robot.manipulability(left, rows, Some(&mut g)).unwrap());
        }
        black_box(robot.set_q(&bad).unwrap_err());
        for p in [far, near] {
            let goal = Goal::pose(Pose::translation(p, 0.4, 1.1));
            clamped.copy_from_slice(&start);
            black_box(robot.reach(left, &goal, &Effort::default(), &mut clamped).unwrap());
            black_box(robot.reach_on(left, 10, &mut clamped).unwrap());
            clamped.copy_from_slice(&start);
            let prefer = Prefer { manipulable: 0.1, ..Prefer::centred().starts(3) };
            let best =
                robot.reach_best(left, &goal, &prefer, &Effort::kinematics(3000), &mut clamped);
            black_box(best.unwrap());
        }
        let nan = Goal::position(spatial::Vec3::repeat(f64::NAN));
        black_box(robot.reach(left, &nan, &Effort::default(), &mut clamped).unwrap_err());
        black_box(robot.tip_pose(gripper).unwrap_err());
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
}

//! No call of a robot allocates after set-up, errors included.

use crate::support::*;
use linkwork_embedded::spatial::Pose;
use linkwork_embedded::*;
use std::hint::black_box;

#[test]
fn no_call_allocates_after_set_up() {
    let mass = spatial::MassProperties::new(8.0, spatial::Vec3::zeros(), spatial::Mat3::identity());
    let Some(model) = dual(vec![ObjectSpec { name: "beam".into(), mass }]) else { return };
    let (beam, right) = (model.object("beam").unwrap(), model.part("right").unwrap());
    let [left, gripper] = ["left", "left_gripper"].map(|p| model.part(p).unwrap());
    // A clone has memory of its own from the beginning.
    let first = Robot::new(&model);
    let mut robot = first.clone();
    let mut space = TaskSpace::new(&robot, &[left, right]).unwrap();
    let nv = model.nv();
    let (mut tau, v, mut inertia) = (vec![0.0; nv], model.multibody().random_v(1), [0.0; 144]);
    let q = model.multibody().random_q(3);
    let (mut J, mut whole, mut g) = (vec![0.0; 36], vec![0.0; 6 * model.nv()], vec![0.0; 6]);
    let mut M = vec![0.0; nv * nv];
    let tip = *model.bodies(left).unwrap().last().unwrap();
    let mut bad = q.clone();
    bad[3] = f64::NAN;
    let mut clamped = q.clone();
    let form = model.closed_form(left, None).unwrap();
    let mut all = vec![0.0; ClosedForm::MOST * model.nq()];
    let (start, far, near) = (model.multibody().neutral_q(), 9.0, 0.5);
    let (mut predictor, density) = (Predictor::new(&robot), vec![0.1; nv]);
    let (mut ahead, mut rates, mut P) = (q.clone(), v.clone(), vec![0.0; 4 * nv * nv]);
    let soft = Impedance::at(Pose::translation(0.5, 0.3, 1.0), [20.0, 500.0], [0.1, 4.0]);
    let (mut A, mut corners) = (vec![0.0; 6 * nv], [[0.0; 2]; 8]);
    let mut search = WholeReach::new(&robot, 2).clone();
    let wrist = model.dofs(right).unwrap()[5];
    let counted = allocation_counter::measure(|| {
        let state = Known { q: &mut ahead, v: &mut rates, covariance: &mut P };
        robot.predict(&mut predictor, state, &v, &[], 1e-3).unwrap_err();
        let state = Known { q: &mut ahead, v: &mut rates, covariance: &mut P };
        robot.predict(&mut predictor, state, &v, &density, 1e-3).unwrap();
        black_box(predictor.transition()[0]);
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
            black_box(
                robot.reach(left, &goal, Frame::World, &Effort::default(), &mut clamped).unwrap(),
            );
            black_box(robot.reach_on(left, 10, &mut clamped).unwrap());
            clamped.copy_from_slice(&start);
            let prefer = Prefer { manipulable: 0.1, ..Prefer::centred().starts(3) };
            black_box(robot.reach_all(&form, &goal, Frame::World, &q, &mut all).unwrap());
            let best = robot.reach_best(
                left,
                &goal,
                Frame::World,
                &prefer,
                &Effort::kinematics(3000),
                &mut clamped,
            );
            black_box(best.unwrap());
        }
        robot.grasp(left, beam, Grasp::Here).unwrap();
        robot.grasp(right, beam, Grasp::Here).unwrap();
        black_box(robot.grasp(right, beam, Grasp::Here).unwrap_err());
        // Two tips, and both hands on the beam: met, nearest, open, refused.
        for p in [far, near] {
            let goal = Goal::position(spatial::Vec3::new(p, 0.4, 1.1));
            let goals = [
                TipGoal::new(left, goal),
                TipGoal::new(
                    right,
                    Goal::pointing(Pointing::along(spatial::Vec3::x(), spatial::Vec3::z())),
                )
                .seen_from(Frame::Tip(left)),
            ];
            let effort = Effort { restarts: 2, ..Effort::default() };
            clamped.copy_from_slice(&start);
            black_box(search.reach(&robot, &goals, &effort, &mut clamped)).ok();
            black_box(search.go_on(10, &mut clamped)).ok();
            black_box(search.worst_case_steps(&goals, &effort));
            black_box((search.residuals()[0], search.closures().count()));
            clamped.copy_from_slice(&start);
            let prefer = Prefer { manipulable: 0.1, ..Prefer::centred().starts(2) };
            let bounded = Effort::kinematics(2000);
            black_box(search.best(&mut robot, &goals, &prefer, &bounded, &mut clamped)).ok();
            black_box(search.begin(&robot, &goals, &effort, &bad).unwrap_err());
        }
        for dof in 0..nv {
            search.keep(&[dof]).unwrap();
        }
        search.release(&[wrist]).unwrap();
        clamped.copy_from_slice(&start);
        black_box(search.reach(&robot, &[], &Effort::default(), &mut clamped).unwrap_err());
        black_box(search.keep(&[999]).unwrap_err());
        robot.update_grasp(left, beam, Pose::identity()).unwrap();
        let push = Push::new(left, spatial::Vec3::x(), spatial::Vec3::y());
        robot.feed_forward(&v, &v, &[push], &mut tau).unwrap();
        for kind in [Balance::Equal, Balance::Effort] {
            black_box(robot.balance(beam, kind, &mut tau).unwrap());
        }
        let wrenches = robot.squeeze(beam, 20.0, &mut tau).unwrap();
        robot.exert(beam, &wrenches, &mut tau).unwrap();
        let sides = [spatial::Vec3::x(), -spatial::Vec3::x()];
        let friction =
            sides.map(|normal| Friction { normal, coefficient: 0.5, radius: 0.02, most: 500.0 });
        black_box(robot.grip(beam, &wrenches, &friction).unwrap());
        let weights = HandWeights { hands: [1.0, 3.0], moment: 100.0 };
        black_box(robot.move_squeeze(beam, &wrenches, &weights).unwrap());
        robot.mass_matrix(&mut M).unwrap();
        black_box(robot.center_of_mass());
        space.inertia(&mut robot, &mut inertia).unwrap();
        space.forces(&mut robot, &v, &inertia[..12], Some(&v), &mut tau).unwrap();
        black_box((space.rows(), space.compliance(&mut robot).unwrap()[0]));
        space.impedance(&mut robot, &v, &[soft; 2], Some(&v), &mut tau).unwrap();
        space.impedance(&mut robot, &v, &[soft], None, &mut tau).unwrap_err();
        black_box((robot.composite_inertia(tip), robot.momentum(&v).unwrap()));
        robot.momentum(&bad[..2]).unwrap_err();
        robot.centroidal_matrix(&mut A).unwrap();
        let n = support_polygon(&mut [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], &mut corners);
        black_box(support_margin(&corners[..n], [0.2, 0.2]));
        let twist = spatial::Motion::new(spatial::Vec3::x(), spatial::Vec3::y());
        black_box(robot.rates(left, &twist, &mut tau).unwrap());
        let mut tips = [spatial::Motion::zero(); 2];
        robot.bias(&v, &[left, right], &mut tau, &mut tips).unwrap();
        robot.set_gravity(spatial::Vec3::z()).unwrap();
        robot.gravity_forces(&mut tau).unwrap();
        robot.held_still(&[push], &mut tau).unwrap();
        black_box(robot.body_pose(tip));
        black_box((robot.hold(beam).unwrap(), robot.object_q(beam).unwrap(), robot.q()[0]));
        black_box(robot.object_pose(beam).unwrap());
        black_box(robot.put(beam, Pose::identity()).unwrap_err());
        black_box(robot.set_object_q(beam, &[]).unwrap_err());
        robot.release(left, beam).unwrap();
        robot.ungrasp(beam).unwrap();
        let nan = Goal::position(spatial::Vec3::repeat(f64::NAN));
        black_box(
            robot.reach(left, &nan, Frame::World, &Effort::default(), &mut clamped).unwrap_err(),
        );
        black_box(robot.tip_pose(gripper).unwrap_err());
        robot.put(beam, Pose::identity()).unwrap();
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
}

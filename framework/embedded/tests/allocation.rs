//! Calls of a robot do not allocate after set-up, errors included.

use crate::support::*;
use linkwork_embedded::spatial::Pose;
use linkwork_embedded::*;
use std::hint::black_box;

/// The two-armed robot with objects, a tool with a jaw, and shapes.
fn trimmers(mass: spatial::MassProperties) -> Option<std::sync::Arc<RobotModel>> {
    let json = reference("robodarts/dual_ur5_collisions.json")?;
    let d = formats::read_file(file("robodarts/dual_ur5.urdf"), &options()).unwrap();
    let srdf = formats::read_srdf(DUAL, &formats::ReadOptions::default()).unwrap();
    let mut spec = ModelSpec::from_description(&d).unwrap().groups(&srdf, &d).unwrap();
    (spec.colliders, spec.rules) = scene(&json);
    let object = |name: &str| ObjectSpec { name: name.into(), mass };
    spec.objects = ["beam", "cup", "tool"].map(object).to_vec();
    let hinge = multibody::Hinge::pin(spatial::Vec3::z());
    spec.linkages.body(multibody::BodySpec::new("jaw", "tool").hinge(hinge).mass(mass));
    Some(RobotModel::new(&spec).unwrap())
}

/// Every public call of a robot, and of types that lend it memory, must be measured by one of the memory tests. Add new calls here.
#[test]
fn every_public_call_is_measured() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let read = |path: std::path::PathBuf| std::fs::read_to_string(path).unwrap();
    let tests = std::fs::read_dir(folder.join("tests")).unwrap();
    let tests: String = tests
        .filter_map(|f| Some(f.ok()?.path()).filter(|p| p.extension().is_some_and(|e| e == "rs")))
        .map(read)
        .collect();
    // Collect the code of all measured blocks, up to the line that reads the count.
    let measured: String = tests
        .split("allocation_counter::measure(")
        .skip(1)
        .filter_map(|rest| rest.split("counted.count_total").next())
        .collect();
    let mut calls = Vec::new();
    let sources = ["src/robot", "src/robot/timing"].map(|f| std::fs::read_dir(folder.join(f)));
    for file in sources.into_iter().flat_map(Result::unwrap) {
        let path = file.unwrap().path();
        // These files contain private parts of `Timing`, so their functions cannot be measured
        // directly.
        let inner = ["path.rs", "section.rs"].map(|n| folder.join("src/robot/timing").join(n));
        if path.extension().is_none_or(|e| e != "rs") || inner.contains(&path) {
            continue;
        }
        let text = read(path);
        for rest in text.split("    pub fn ").skip(1) {
            let name: String =
                rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            let takes: String = rest.split(')').next().unwrap_or("").split_whitespace().collect();
            if ["(&self", "(&mutself"].iter().any(|s| takes.contains(s)) {
                calls.push(name);
            }
        }
    }
    assert!(calls.len() > 70, "{calls:?}");
    let missing: Vec<&String> = calls
        .iter()
        .filter(|c| !measured.contains(&format!(".{c}(")))
        // These calls do not compute: they return the model, or copy and read numbers of a
        // workspace.
        .filter(|c| !["model", "mul", "fork"].contains(&c.as_str()))
        .collect();
    assert!(missing.is_empty(), "no test of memory calls {missing:?}");
}

#[test]
fn no_call_allocates_after_set_up() {
    let mass = spatial::MassProperties::new(8.0, spatial::Vec3::zeros(), spatial::Mat3::identity());
    let Some(model) = dual(vec![ObjectSpec { name: "beam".into(), mass }]) else { return };
    let (beam, right) = (model.object("beam").unwrap(), model.part("right").unwrap());
    let [left, gripper] = ["left", "left_gripper"].map(|p| model.part(p).unwrap());
    // A clone has separate memory from the start.
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
    let mut search = WholeBodyIk::new(&robot, 2).clone();
    let wrist = model.dofs(right).unwrap()[5];
    let counted = allocation_counter::measure(|| {
        let state = StateEstimate { q: &mut ahead, v: &mut rates, covariance: &mut P };
        robot.predict(&mut predictor, state, &v, &[], 1e-3).unwrap_err();
        let state = StateEstimate { q: &mut ahead, v: &mut rates, covariance: &mut P };
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
                robot
                    .inverse_kinematics(left, &goal, Frame::World, &Effort::default(), &mut clamped)
                    .unwrap(),
            );
            black_box(robot.resume_inverse_kinematics(left, 10, &mut clamped).unwrap());
            clamped.copy_from_slice(&start);
            let prefer = Prefer { manipulable: 0.1, ..Prefer::centred().starts(3) };
            black_box(
                robot.inverse_kinematics_all(&form, &goal, Frame::World, &q, &mut all).unwrap(),
            );
            let best = robot.inverse_kinematics_best(
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
        // Move two tips with both hands on the beam. The outcomes are: reached, nearest, loop open,
        // error.
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
            black_box(search.solve(&robot, &goals, &effort, &mut clamped)).ok();
            black_box(search.resume(10, &mut clamped)).ok();
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
        black_box(search.solve(&robot, &[], &Effort::default(), &mut clamped).unwrap_err());
        black_box(search.keep(&[999]).unwrap_err());
        robot.update_grasp(left, beam, Pose::identity()).unwrap();
        let push = Push::new(left, spatial::Vec3::x(), spatial::Vec3::y());
        robot.feed_forward(&v, &v, &[push], &mut tau).unwrap();
        for kind in [Balance::Equal, Balance::Effort] {
            black_box(robot.balance(beam, kind, &mut tau).unwrap());
        }
        let wrenches = robot.squeeze(beam, 20.0, &mut tau).unwrap();
        robot.add_hand_wrenches(beam, &wrenches, &mut tau).unwrap();
        let sides = [spatial::Vec3::x(), -spatial::Vec3::x()];
        let friction =
            sides.map(|normal| Friction { normal, coefficient: 0.5, radius: 0.02, most: 500.0 });
        black_box(robot.grip(beam, &wrenches, &friction).unwrap());
        let weights = HandWeights { hands: [1.0, 3.0], moment: 100.0 };
        black_box(robot.split_hand_wrenches(beam, &wrenches, &weights).unwrap());
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
        black_box(robot.attach(beam, beam, None, Grasp::Here).unwrap_err());
        black_box((robot.detach(beam).unwrap_err(), robot.mount(beam).unwrap()));
        let nan = Goal::position(spatial::Vec3::repeat(f64::NAN));
        black_box(
            robot
                .inverse_kinematics(left, &nan, Frame::World, &Effort::default(), &mut clamped)
                .unwrap_err(),
        );
        black_box(robot.tip_pose(gripper).unwrap_err());
        robot.put(beam, Pose::identity()).unwrap();
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
}

/// Calls every function that can return an error in a way that returns one.
#[test]
fn no_error_allocates() {
    let mass = spatial::MassProperties::new(2.0, spatial::Vec3::zeros(), spatial::Mat3::identity());
    let Some(model) = trimmers(mass) else { return };
    let [beam, cup, tool] = ["beam", "cup", "tool"].map(|o| model.object(o).unwrap());
    let [left, right, gripper] = ["left", "right", "left_gripper"].map(|p| model.part(p).unwrap());
    let mut robot = Robot::new(&model);
    let (nq, nv) = (model.nq(), model.nv());
    let q = model.multibody().neutral_q();
    robot.set_q(&q).unwrap();
    // The left hand holds the beam, and both hands hold the cup.
    robot.grasp(left, beam, Grasp::At(Pose::identity())).unwrap();
    robot.grasp(left, cup, Grasp::At(Pose::identity())).unwrap();
    robot.grasp(right, cup, Grasp::Here).unwrap();
    let handle = model.object_body(tool, "jaw").unwrap();
    let ids: Vec<ColliderId> = model.colliders().map(|c| c.0).collect();
    let (tau, mut v, mut J) = (vec![0.0; nv], vec![0.0; nv], vec![0.0; 6]);
    let (nan, short, mut to) = (vec![f64::NAN; nq], vec![0.0; nq - 1], q.clone());
    let bad_pose = Pose::translation(f64::NAN, 0.0, 0.0);
    let w = [spatial::Force::zero(); 2];
    let bad = [spatial::Force::new(spatial::Vec3::repeat(f64::NAN), spatial::Vec3::zeros()); 2];
    let flat = Friction { normal: spatial::Vec3::x(), coefficient: 0.0, radius: 0.01, most: 1.0 };
    let good = Friction { coefficient: 0.5, ..flat };
    let weights = HandWeights { hands: [1.0; 2], moment: 1.0 };
    let goal = Goal::pose(Pose::identity());
    let nowhere = Goal::position(spatial::Vec3::repeat(f64::NAN));
    let (effort, prefer) = (Effort::default(), Prefer::centred());
    let form = model.closed_form(left, None).unwrap();
    let (mut all, mut some) = (vec![0.0; ClosedForm::MOST * nq], Vec::with_capacity(64));
    let mut hits = Vec::with_capacity(64);
    let mut space = TaskSpace::new(&robot, &[left]).unwrap();
    let mut predictor = Predictor::new(&robot);
    let (mut ahead, mut rates, mut P) = (q.clone(), v.clone(), vec![0.0; 4 * nv * nv]);
    let mut control = RateControl::new(&robot, 1, 1);
    let mut whole = WholeBody::new(&robot, 1, 1);
    let mut planner = Planner::new(&robot, left, 4).unwrap();
    let mut timing = Timing::new(&robot, 2, 64).unwrap();
    let mut transfer = Transfer::new(&robot);
    let limits = MotionLimits::of(&model);
    let mut tips = [spatial::Motion::zero(); 2];
    let (soft, far) = (Impedance::at(bad_pose, [20.0, 500.0], [0.1, 4.0]), 40.0);
    let lost = Push::new(gripper, spatial::Vec3::x(), spatial::Vec3::x());
    let touch = Touch {
        part: gripper,
        at: spatial::Vec3::zeros(),
        normal: spatial::Vec3::z(),
        friction: 0.5,
        most: 100.0,
    };
    let mut forces = [spatial::Vec3::zeros(); 1];
    let mut vdot = v.clone();
    let objective = Objective::new(0, Aim::Posture(&tau));
    let (nobody, objectives) = (Objective::new(0, Aim::Posture(&[])), [objective, objective]);
    let guards = Guards { horizon: 0.1, manipulable: &[] };
    let never = Guards { horizon: f64::NAN, manipulable: &[] };
    let efforts = vec![10.0; nv];
    let mut outside = q.clone();
    let joint = model.dofs(left).unwrap()[0];
    outside[joint] = far;
    let state = MotionState { q: &nan, v: &v.clone(), vdot: &v.clone() };
    let mut own = vec![0.0; nv];
    let told = std::cell::Cell::new(0);
    // Returning an error does not allocate, because its text is created only when it is displayed.
    let no = |e: RobotError| {
        told.set(told.get() + 1);
        black_box(e);
    };
    let (mut out, mut nans) = (vec![0.0; nv], vec![f64::NAN; nv]);
    let counted = allocation_counter::measure(|| {
        no(robot.set_q(&nan).unwrap_err());
        no(robot.set_q(&short).unwrap_err());
        no(robot.clamp(&mut own[..1]).unwrap_err());
        no(robot.set_gravity(spatial::Vec3::repeat(f64::NAN)).unwrap_err());
        no(robot.tip_pose(gripper).unwrap_err());
        no(robot.base_pose(gripper).unwrap_err());
        no(robot.jacobian(left, &mut own[..2]).unwrap_err());
        no(robot.whole_jacobian(left, &mut own[..2]).unwrap_err());
        no(robot.manipulability(left, Rows::All { length: 0.0 }, None).unwrap_err());
        // Rejected searches do not allocate.
        no(robot.inverse_kinematics(left, &nowhere, Frame::World, &effort, &mut to).unwrap_err());
        no(robot.inverse_kinematics(left, &goal, Frame::World, &effort, &mut outside).unwrap_err());
        no(robot.inverse_kinematics(gripper, &goal, Frame::World, &effort, &mut to).unwrap_err());
        no(robot.resume_inverse_kinematics(right, 5, &mut to).unwrap_err());
        let best =
            robot.inverse_kinematics_best(left, &nowhere, Frame::World, &prefer, &effort, &mut to);
        no(best.unwrap_err());
        no(robot.inverse_kinematics_all(&form, &goal, Frame::World, &short, &mut all).unwrap_err());
        no(robot.rates(left, &tips[0], &mut own[..1]).unwrap_err());
        // Rejected calls for forces do not allocate.
        no(robot.gravity_forces(&mut own[..1]).unwrap_err());
        no(robot.held_still(&[lost], &mut out).unwrap_err());
        no(robot.feed_forward(&nan, &v, &[], &mut out).unwrap_err());
        no(robot.bias(&v, &[gripper], &mut out, &mut tips[..1]).unwrap_err());
        no(robot.mass_matrix(&mut own[..1]).unwrap_err());
        no(robot.momentum(&nan).unwrap_err());
        no(robot.centroidal_matrix(&mut own[..1]).unwrap_err());
        // Rejected calls for hands do not allocate.
        no(robot.grasp(left, beam, Grasp::Here).unwrap_err());
        no(robot.grasp(right, beam, Grasp::At(Pose::identity())).unwrap_err());
        no(robot.grasp(gripper, tool, Grasp::Here).unwrap_err());
        no(robot.grasp(left, tool, Grasp::At(bad_pose)).unwrap_err());
        no(robot.update_grasp(right, beam, Pose::identity()).unwrap_err());
        no(robot.update_grasp(left, tool, Pose::identity()).unwrap_err());
        no(robot.release(right, beam).unwrap_err());
        no(robot.release(left, tool).unwrap_err());
        no(robot.ungrasp(tool).unwrap_err());
        no(robot.put(beam, Pose::identity()).unwrap_err());
        no(robot.put(tool, bad_pose).unwrap_err());
        no(robot.set_object_q(beam, &[]).unwrap_err());
        no(robot.set_object_q(tool, &[f64::NAN]).unwrap_err());
        no(robot.object_body_pose(beam, handle).unwrap_err());
        no(robot.object_jacobian(beam, handle, &mut J).unwrap_err());
        no(robot.object_jacobian(tool, handle, &mut J[..1]).unwrap_err());
        no(robot.closure(Closing::Hands(beam)).unwrap_err());
        let onto = |free| Closing::Onto { hand: left, object: tool, body: handle, free };
        no(robot.closure(onto(&[])).unwrap_err());
        robot.closure(onto(&[true])).unwrap();
        robot.closure(Closing::Hands(cup)).unwrap();
        robot.object_jacobian(tool, handle, &mut J).unwrap();
        let (rest, turning) = ((&v[..], &v[..]), (&J[..1], &J[..1]));
        let asked =
            robot.feed_forward_with_object(rest, tool, turning, &[], &mut out, &mut own[..1]);
        no(asked.unwrap_err());
        no(robot.mass_matrix_with_object(tool, &mut own[..1]).unwrap_err());
        for object in [tool, beam] {
            // The tool is in no hand, and the beam is in one.
            no(robot.balance(object, Balance::Equal, &mut out).unwrap_err());
            no(robot.squeeze(object, 10.0, &mut out).unwrap_err());
            no(robot.add_hand_wrenches(object, &w, &mut out).unwrap_err());
            no(robot.grip(object, &w, &[good; 2]).unwrap_err());
            no(robot.split_hand_wrenches(object, &w, &weights).unwrap_err());
        }
        no(robot.balance(cup, Balance::Equal, &mut own[..1]).unwrap_err());
        no(robot.balance(cup, Balance::Equal, &mut nans).unwrap_err());
        no(robot.squeeze(cup, f64::NAN, &mut out).unwrap_err());
        no(robot.add_hand_wrenches(cup, &bad, &mut out).unwrap_err());
        no(robot.grip(cup, &bad, &[good; 2]).unwrap_err());
        no(robot.grip(cup, &w, &[flat; 2]).unwrap_err());
        let none = HandWeights { moment: 0.0, ..weights };
        no(robot.split_hand_wrenches(cup, &w, &none).unwrap_err());
        // Rejected calls for collisions do not allocate.
        no(robot.collides(&short).unwrap_err());
        no(robot.first_hit(&nan).unwrap_err());
        no(robot.hits(&nan, &mut hits).unwrap_err());
        no(robot.clearance(&q, f64::NAN).unwrap_err());
        no(robot.distances(&q, f64::NAN, &mut some).unwrap_err());
        no(robot.distance(&nan, ids[0], ids[1]).unwrap_err());
        no(robot.path_free(&q, &q, 0.0).unwrap_err());
        let mut progress = PathProgress::default();
        no(robot.path_free_on(&q, &nan, 1e-2, &mut progress, 1).unwrap_err());
        no(robot.pad(ids[0], -1.0).unwrap_err());
        no(robot.set_points(ids[0], &[]).unwrap_err());
        no(robot.set_cells(ids[0], &[], Occupancy::Free).unwrap_err());
        no(robot.clear_cells(ids[0]).unwrap_err());
        no(robot.cell(ids[0], [0; 3]).unwrap_err());
        no(robot.count(ids[0]).unwrap_err());
        // Calls of tools that have their own memory.
        no(space.inertia(&mut robot, &mut own[..1]).unwrap_err());
        no(space.forces(&mut robot, &v, &own[..1], None, &mut out).unwrap_err());
        no(space.impedance(&mut robot, &v, &[soft], None, &mut out).unwrap_err());
        let known = StateEstimate { q: &mut ahead, v: &mut rates, covariance: &mut P };
        no(robot.predict(&mut predictor, known, &v, &[], 1e-3).unwrap_err());
        no(control.solve(&mut robot, &objectives, &guards, &mut v, &mut J[..1]).unwrap_err());
        no(control.solve(&mut robot, &[nobody], &guards, &mut v, &mut J[..1]).unwrap_err());
        no(control.solve(&mut robot, &[objective], &never, &mut v, &mut J[..1]).unwrap_err());
        no(control.solve(&mut robot, &[objective], &guards, &mut v, &mut []).unwrap_err());
        for (touches, objectives, efforts) in [
            (&[touch][..], &[objective][..], &efforts[..]),
            (&[touch; 2], &[objective], &efforts),
            (&[], &objectives, &efforts),
            (&[], &[nobody], &efforts),
            (&[], &[objective], &efforts[..1]),
        ] {
            let n = touches.len().min(1);
            let found = (&mut out[..], &mut vdot[..], &mut forces[..n]);
            no(whole.solve(&mut robot, &v, touches, objectives, efforts, found).unwrap_err());
        }
        no(planner.plan(&mut robot, &q, &nan, &Search::default()).unwrap_err());
        no(planner.plan(&mut robot, &outside, &q, &Search::default()).unwrap_err());
        no(timing.plan(&mut robot, &short, &limits, 0.0).unwrap_err());
        no(timing.at(0.0, &mut to, &mut v, &mut vdot).unwrap_err());
        no(timing.place(f64::NAN, &mut to).unwrap_err());
        no(transfer.plan(&state, &state, &limits).unwrap_err());
        black_box((timing.duration(), transfer.duration()));
        no(transfer.at(0.0, &mut to, &mut v, &mut vdot).unwrap_err());
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert!(told.get() > 90, "{}", told.get());
}

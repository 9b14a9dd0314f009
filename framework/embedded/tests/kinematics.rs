//! Parts by name, their kinematics and manipulability, compared with the reference and with finite differences.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge};
use linkwork_embedded::spatial::{Pose, Vec3};
use linkwork_embedded::*;
use serde_json::Value;

/// Checks everything that the reference contains about the arms of a robot.
fn check(model: &std::sync::Arc<RobotModel>, json: &Value, worst: &mut [f64; 5]) {
    let at = places(model, &names(&json["dof"]));
    let mut robot = Robot::new(model);
    for state in json["states"].as_array().unwrap() {
        robot.set_q(&to_q(model, &at, &numbers(&state["q"]))).unwrap();
        for (frame, X) in state["frames"].as_object().unwrap() {
            let Some(body) = model.multibody().body(frame) else { panic!("{frame}") };
            let (p, R) = apart(&robot.body_pose(body), &pose(&numbers(X)));
            worst[0] = worst[0].max(p).max(R);
        }
        for (arm, expected) in state["arms"].as_object().unwrap() {
            let part = model.part(arm).unwrap();
            let tip = json["parts"][arm]["tip"].as_str().unwrap();
            let (p, R) =
                apart(&robot.tip_pose(part).unwrap(), &pose(&numbers(&state["frames"][tip])));
            worst[0] = worst[0].max(p).max(R);
            let nv = model.nv();
            let mut J = vec![0.0; 6 * nv];
            robot.whole_jacobian(part, &mut J).unwrap();
            let theirs = rows(&expected["jacobian"]);
            let ours: Vec<f64> = (0..6)
                .flat_map(|r| at.iter().map(move |(_, v)| (r, *v)))
                .map(|(r, v)| J[r * nv + v])
                .collect();
            worst[1] = worst[1].max(difference(&ours, &theirs));
            // The chain's columns equal the same columns of the whole Jacobian.
            let dofs = model.dofs(part).unwrap();
            let mut own = vec![0.0; 6 * dofs.len()];
            robot.jacobian(part, &mut own).unwrap();
            let same: Vec<f64> = (0..6)
                .flat_map(|r| dofs.iter().map(move |v| (r, *v)))
                .map(|(r, v)| J[r * nv + v])
                .collect();
            worst[1] = worst[1].max(difference(&own, &same));
            let mut gradient = vec![0.0; dofs.len()];
            let joints = places(model, &names(&json["parts"][arm]["joints"]));
            let order: Vec<usize> =
                joints.iter().map(|(_, v)| dofs.iter().position(|d| d == v).unwrap()).collect();
            let sets = [
                (Rows::All { length: 1.0 }, "manipulability", Some("gradient")),
                (Rows::Linear, "manipulability_linear", Some("gradient_linear")),
                (Rows::Angular, "manipulability_angular", None),
            ];
            for (rows, w, g) in sets {
                let m = robot.manipulability(part, rows, Some(&mut gradient)).unwrap();
                worst[2] = worst[2].max((m.w - expected[w].as_f64().unwrap()).abs());
                if let Some(g) = g {
                    let ours: Vec<f64> = order.iter().map(|i| gradient[*i]).collect();
                    worst[3] = worst[3].max(difference(&ours, &numbers(&expected[g])));
                }
                if rows == (Rows::All { length: 1.0 }) {
                    let theirs = numbers(&expected["singular_values"]);
                    worst[4] = worst[4].max(difference(&m.singular_values, &theirs));
                }
            }
        }
    }
}

#[test]
fn frames_jacobians_and_manipulability_are_those_of_the_reference() {
    let Some(json) = reference("robodarts/dual_ur5_kinematics.json") else { return };
    let mut worst = [0.0; 5];
    check(&dual(vec![]).unwrap(), &json, &mut worst);
    let json = reference("robodarts/mobile_iiwa_kinematics.json").unwrap();
    let parts = [PartSpec::chain("arm", "lbr_iiwa_link_0", "tcp")];
    check(&robot("robodarts/mobile_iiwa.urdf", &parts, vec![]), &json, &mut worst);
    println!("frames, Jacobians, w, gradients, singular values: {worst:?}");
    let [frames, J, w, gradient, values] = worst;
    assert!(frames < 1e-10 && J < 1e-10 && w < 1e-10, "{worst:?}");
    assert!(gradient < 1e-8 && values < 1e-10, "{worst:?}");
}

#[test]
fn golden_numbers_of_the_single_arm() {
    if reference("robodarts/ik_ur5.json").is_none() {
        return;
    }
    let model = robot("robots/ur5.urdf", &[PartSpec::chain("arm", "base_link", "ee_link")], vec![]);
    let arm = model.part("arm").unwrap();
    let mut robot = Robot::new(&model);
    robot.set_q(&[0.3, -1.2, 1.5, -0.9, 0.7, 0.2]).unwrap();
    let p = robot.tip_pose(arm).unwrap().position;
    let golden = Vec3::new(0.547120317375, 0.349386446631, 0.321176639129);
    assert!((p - golden).norm() < 1e-11, "{p}");
    let mut g = [0.0; 6];
    let m = robot.manipulability(arm, Rows::All { length: 1.0 }, Some(&mut g)).unwrap();
    assert!((m.w - 0.06236625851105).abs() < 1e-13, "{}", m.w);
    let golden = [0.0, 0.021648125, -0.016363605, -0.008368477, 0.074043831, 0.0];
    assert!(difference(&g, &golden) < 1e-9, "{g:?}");
    let linear = robot.manipulability(arm, Rows::Linear, None).unwrap();
    assert!((linear.w - 0.13904487755451).abs() < 1e-13, "{}", linear.w);
    // A length scale multiplies the three angular rows, so manipulability scales with its cube.
    let scaled = robot.manipulability(arm, Rows::All { length: 0.5 }, None).unwrap();
    assert!((scaled.w - m.w / 8.0).abs() < 1e-14);
}

/// A chain with hinges of every kind in series.
fn zoo() -> Builder {
    let hinges = [
        Hinge::pin(Vec3::new(0.2, 1.0, -0.3)),
        Hinge::slider(Vec3::new(1.0, 0.4, 0.1)),
        Hinge::ball(),
        Hinge::screw(Vec3::new(0.3, -0.5, 1.0), 0.07),
        Hinge::universal(Vec3::x(), Vec3::new(0.1, 1.0, 0.2)),
        Hinge::locked(),
    ];
    let mut b = Builder::new();
    let mut parent = "world".to_owned();
    for (i, hinge) in hinges.into_iter().enumerate() {
        let at = Pose::new(
            spatial::Quat::from_scaled_axis(Vec3::new(0.3, -0.2, 0.1)),
            Vec3::new(0.1, 0.2, 0.3),
        );
        let name = format!("b{i}");
        b.body(BodySpec::new(&name, &parent).hinge_in_parent(at).hinge(hinge));
        parent = name;
    }
    b
}

#[test]
fn gradients_of_manipulability_are_differences_for_every_hinge() {
    // Test chains with all kinds of hinges, and a chain with fewer columns than rows.
    for (base, tip) in [("world", "b5"), ("b0", "b5"), ("b2", "b4"), ("world", "b1")] {
        let spec = ModelSpec {
            mechanism: zoo(),
            parts: vec![PartSpec::chain("arm", base, tip)],
            ..ModelSpec::default()
        };
        let model = RobotModel::new(&spec).unwrap();
        let arm = model.part("arm").unwrap();
        let dofs = model.dofs(arm).unwrap().to_vec();
        let mut robot = Robot::new(&model);
        for seed in 0..8 {
            let q = model.multibody().random_q(seed);
            for rows in [Rows::All { length: 0.7 }, Rows::Linear, Rows::Angular] {
                let mut g = vec![0.0; dofs.len()];
                robot.set_q(&q).unwrap();
                let w = robot.manipulability(arm, rows, Some(&mut g)).unwrap().w;
                if w < 1e-9 {
                    assert!(g.iter().all(|x| *x == 0.0), "{rows:?} {base} {tip} {g:?}");
                    continue;
                }
                for (k, dof) in dofs.iter().enumerate() {
                    let mut side = |h: f64| {
                        let mut step = vec![0.0; model.nv()];
                        step[*dof] = h;
                        let mut moved = q.clone();
                        model.multibody().integrate(&q, &step, &mut moved);
                        robot.set_q(&moved).unwrap();
                        robot.manipulability(arm, rows, None).unwrap().w
                    };
                    let h = 1e-5;
                    let slope = (side(h) - side(-h)) / (2.0 * h);
                    assert!(
                        (slope - g[k]).abs() < 1e-7 * (1.0 + w / 1e-2),
                        "{rows:?} {base}..{tip} dof {k}: {slope} against {}, w {w}",
                        g[k]
                    );
                }
            }
        }
    }
}

#[test]
fn ellipsoids_bound_what_rates_and_torques_do() {
    let Some(model) = dual(vec![]) else { return };
    let left = model.part("left").unwrap();
    let mut robot = Robot::new(&model);
    let mut rng = Rng(7);
    for _ in 0..20 {
        let q: Vec<f64> = (0..model.nq()).map(|_| rng.within(-1.5, 1.5)).collect();
        robot.set_q(&q).unwrap();
        let m = robot.manipulability(left, Rows::Linear, None).unwrap();
        for i in 0..3 {
            let u: Vec<f64> = (0..3).map(|r| m.axes[(r, i)]).collect();
            assert!((m.velocity(&u) - m.singular_values[i]).abs() < 1e-12);
            assert!((m.force(&u) * m.singular_values[i] - 1.0).abs() < 1e-9);
        }
        let u = [rng.unit(), rng.unit(), rng.unit()];
        // The product of a force along u and the speed along u is at most the product of the axes.
        assert!(m.velocity(&u) * m.force(&u) <= 1.0 + 1e-12);
        assert!(m.velocity(&u) >= m.singular_values[2] - 1e-12);
        assert!(m.velocity(&u) <= m.singular_values[0] + 1e-12);
    }
}

#[test]
fn what_was_asked_before_leaves_no_trace_and_clones_are_independent() {
    let Some(model) = dual(vec![]) else { return };
    let [left, right] = ["left", "right"].map(|p| model.part(p).unwrap());
    let (mut a, mut b) = (Robot::new(&model), Robot::new(&model));
    let (q0, q1) = (model.multibody().random_q(1), model.multibody().random_q(2));
    for q in [&q1, &q0] {
        a.set_q(q).unwrap();
        let _ = (a.tip_pose(right).unwrap(), a.manipulability(left, Rows::Linear, None).unwrap());
    }
    b.set_q(&q0).unwrap();
    let mut c = b.clone();
    c.set_q(&q1).unwrap();
    assert_ne!(c.tip_pose(left).unwrap(), b.tip_pose(left).unwrap());
    assert_eq!(a.tip_pose(left).unwrap(), b.tip_pose(left).unwrap());
    let (mut Ja, mut Jb) = (vec![0.0; 36], vec![0.0; 36]);
    a.jacobian(right, &mut Ja).unwrap();
    std::thread::scope(|s| s.spawn(|| b.jacobian(right, &mut Jb).unwrap()).join().unwrap());
    assert_eq!(Ja, Jb);
}

#[test]
fn mistakes_are_told_with_place_and_remedy() {
    let spec = |parts: Vec<PartSpec>| ModelSpec { mechanism: zoo(), parts, ..ModelSpec::default() };
    let error = RobotModel::new(&spec(vec![
        PartSpec::chain("arm", "b3", "b1"),
        PartSpec::chain("arm", "world", "b9"),
        PartSpec::bodies("none", &[]),
    ]));
    let text = error.unwrap_err().to_string();
    for needle in [
        "two parts with the name `arm`",
        "`b3` is not between `b1`",
        "body `b9`",
        "part `none` has no",
    ] {
        assert!(text.contains(needle), "{needle}: {text}");
    }
    let model = RobotModel::new(&spec(vec![
        PartSpec::bodies("gripper", &["b1", "b4"]),
        PartSpec::bodies("follows", &["b2", "b1"]),
    ]))
    .unwrap();
    let gripper = model.part("gripper").unwrap();
    assert_eq!(model.part("gripped"), None);
    let mut robot = Robot::new(&model);
    assert_eq!(robot.tip_pose(gripper), Err(RobotError::NotAChain { part: 0 }));
    let follows = model.part("follows").unwrap();
    assert!(robot.tip_pose(follows).is_ok());
    let mut q = robot.q().to_vec();
    q[2] = f64::NAN;
    assert!(matches!(robot.set_q(&q), Err(RobotError::NotFinite { index: 2, .. })));
    assert!(matches!(robot.set_q(&q[1..]), Err(RobotError::Length { .. })));
    assert!(robot.q().iter().all(|x| x.is_finite()));
    let length = Rows::All { length: 0.0 };
    let refused = robot.manipulability(follows, length, None).unwrap_err();
    assert!(refused.to_string().contains("help: the length must be positive"));
    let other = RobotModel::new(&spec(vec![])).unwrap();
    assert_eq!(Robot::new(&other).tip_pose(gripper), Err(RobotError::ForeignHandle));
    // A loop is an error; it is not ignored silently.
    let mut looped = spec(vec![]);
    let closure = multibody::LoopClosure {
        name: "ring".into(),
        body_a: "b5".into(),
        frame_a: Pose::identity(),
        body_b: "world".into(),
        frame_b: Pose::identity(),
        hinge: Hinge::ball(),
    };
    looped.mechanism.loop_closure(closure);
    let text = RobotModel::new(&looped).unwrap_err().to_string();
    assert!(text.contains("an embedded model does not support loop `ring`"), "{text}");
}

#[test]
fn masses_of_a_file_that_no_body_has_are_told_or_refused() {
    let text = r#"<robot name="r"><link name="upper"><inertial><mass value="1"/>
        <inertia ixx="-3.5e-8" iyy="1e-3" izz="1e-3" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;
    let mut options = formats::ReadOptions::default();
    let spec = ModelSpec::from_description(&formats::read_text(text, &options).unwrap()).unwrap();
    let model = RobotModel::new(&spec).unwrap();
    let [line] = model.doubtful() else { panic!("{:?}", model.doubtful()) };
    assert!(line.contains("link `upper`") && line.contains("-0.000000035"), "{line}");
    options.unphysical = formats::Unphysical::Refused;
    let told = formats::read_text(text, &options).unwrap_err().to_string();
    assert!(told.contains("link `upper`"), "{told}");
}

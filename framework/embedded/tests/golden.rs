//! Compares with numbers of the design documents, to their printed digits: two hands on a beam, and the moving and squeezing parts of a load. Also
//! checks that every file of the reference is used.

use crate::support::*;
use linkwork_embedded::spatial::{Force, MassProperties, Mat3, Pose, Quat, Vec3, quat};
use linkwork_embedded::*;

fn near(ours: f64, golden: f64, digits: i32) {
    let room = 0.5 * 10f64.powi(-digits) * (1.0 + 1e-9);
    assert!((ours - golden).abs() <= room, "{ours} is not {golden}");
}

#[test]
fn a_beam_in_two_hands_costs_what_was_written_down() {
    let Some(json) = reference("robodarts/dual_ur5_beam.json") else { return };
    let b = &json["beam"];
    let inertia = Mat3::from_diagonal(&Vec3::from_column_slice(&numbers(&b["inertia_diagonal"])));
    let mass = MassProperties::new(b["mass"].as_f64().unwrap(), Vec3::zeros(), inertia);
    let model = dual(vec![ObjectSpec { name: "beam".into(), mass }]).unwrap();
    let (case, at) = (&json["cases"][0], places(&model, &names(&json["dof"])));
    let X = ["left_tip_in_beam", "right_tip_in_beam"].map(|k| pose(&numbers(&b[k])).inverse());
    let hands = ["left", "right"].map(|p| model.part(p).unwrap());
    let beam = model.object("beam").unwrap();
    let arms = ["left", "right"].map(|a| names(&json["arms"][a]["joints"])).concat();
    let arms = places(&model, &arms);
    let effort = to_v(&model, &at, &numbers(&json["effort"]));
    // Compute Σ τ² and the largest share of effort over the joints of both arms.
    let of = |tau: &[f64]| {
        let squares: f64 = arms.iter().map(|(_, v)| tau[*v] * tau[*v]).sum();
        let shares = arms.iter().map(|(_, v)| tau[*v].abs() / effort[*v]);
        (squares, shares.fold(0.0, f64::max))
    };
    let mut robot = Robot::new(&model);
    robot.set_q(&to_q(&model, &at, &numbers(&case["q"]))).unwrap();
    for i in 0..2 {
        robot.grasp(hands[i], beam, Grasp::At(X[i])).unwrap();
    }
    let mut alone = vec![0.0; model.nv()];
    robot.gravity_forces(&mut alone).unwrap();
    near(of(&alone).0, 7308.503, 3);
    near(of(&alone).1, 1.3285, 4);
    let mut tau = alone.clone();
    let equal = robot.balance(beam, Balance::Equal, &mut tau).unwrap();
    near(equal.cost, 5128.791, 3);
    near(of(&tau).0, 5128.791, 3);
    near(equal.largest_share, 0.5124, 4);
    near(of(&tau).1, 0.5124, 4);
    let mut tau = alone.clone();
    let effort = robot.balance(beam, Balance::Effort, &mut tau).unwrap();
    near(effort.largest_share, 0.2574, 4);
    near(of(&tau).1, 0.2574, 4);
    // This is the minimum over all grasp forces, so no balance may be below it.
    assert!(effort.largest_share > 0.2373);
    near(case["balance"]["least_largest_share"].as_f64().unwrap(), 0.2373, 4);

    let given = numbers(&case["given_wrenches"]);
    let force =
        |x: &[f64]| Force::new(Vec3::from_column_slice(&x[..3]), Vec3::from_column_slice(&x[3..6]));
    let weights = HandWeights { hands: [1.0, 3.0], moment: 100.0 };
    let given = [force(&given[..6]), force(&given[6..])];
    let told = robot.split_hand_wrenches(beam, &given, &weights).unwrap();
    let net = [3.9, 0.2, -0.85, 1.0, -5.0, 26.0];
    let (n, f) = (told.net.moment, told.net.force);
    for (ours, golden) in n.iter().chain(f.iter()).zip(net) {
        near(*ours, golden, 9);
    }
    for (side, golden) in
        [[1.945055, -3.75, 20.571429], [-0.945055, -1.25, 5.428571]].iter().enumerate()
    {
        for (ours, golden) in told.moving[side].force.iter().zip(golden) {
            near(*ours, *golden, 6);
        }
    }
}

/// The benchmark cell equals the scene: the arm of COL-1 among its shapes, with its stored configurations.
#[test]
fn the_cell_of_the_benchmarks_is_that_of_the_scene() {
    let Some(cell) = reference("robodarts/bench/cell.json") else { return };
    let scene = reference("robodarts/col1_scene.json").unwrap();
    let model = robot_in("robots/iiwa7.urdf", &cell, &[], vec![], vec![]);
    let mut robot = Robot::new(&model);
    let shape =
        |k: &serde_json::Value| cell["shapes"][k.as_u64().unwrap() as usize]["name"].clone();
    let pairs = cell["pairs"].as_array().unwrap();
    for pair in pairs {
        let [a, b] = [0, 1].map(|i| model.collider(shape(&pair[i]).as_str().unwrap()).unwrap());
        assert!(robot.looks_at(a, b).unwrap(), "{pair}");
    }
    assert_eq!(pairs.len(), scene["pairs"].as_array().unwrap().len());
    let answers = scene["colliding"].as_str().unwrap();
    let qs = cell["q"].as_array().unwrap();
    assert_eq!(qs.len(), answers.len());
    for (q, answer) in qs.iter().zip(answers.chars()) {
        assert_eq!(robot.collides(&numbers(q)).unwrap(), answer == '1', "{q}");
    }
}

/// The chains that the benchmark peer reads for inverse kinematics equal those of the robots: limits, and tip poses anywhere.
#[test]
fn the_chains_of_the_benchmarks_are_those_of_the_robots() {
    for (name, base, tip) in
        [("ur5", "base_link", "ee_link"), ("iiwa7", "lbr_iiwa_link_0", "lbr_iiwa_link_7")]
    {
        let path = format!("robodarts/bench/{name}.chain");
        let Ok(text) = std::fs::read_to_string(file(&path)) else {
            assert!(std::env::var_os("CI").is_none(), "reference data {path} are missing");
            println!("skipped: reference data {path} are not here");
            return;
        };
        let mut words = text.split_whitespace().map(|w| w.parse::<f64>().unwrap());
        let mut take = |n: usize| words.by_ref().take(n).collect::<Vec<f64>>();
        let pose_of = |x: &[f64]| {
            let p = Vec3::from_column_slice(&x[9..12]);
            Pose::new(quat(&Mat3::from_row_slice(&x[..9])), p)
        };
        let model =
            robot(&format!("robots/{name}.urdf"), &[PartSpec::chain("arm", base, tip)], vec![]);
        let limits: Vec<_> =
            (model.multibody().subhinges()).map(|(_, s)| s.subhinge.limits).collect();
        let n = take(1)[0] as usize;
        assert_eq!((n, limits.len()), (model.nq(), model.nq()));
        let joints: Vec<(usize, Pose)> = (0..n)
            .map(|i| {
                let row = take(15);
                let own = [limits[i].lower, limits[i].upper];
                assert!(difference(&own, &row[13..]) < 1e-9, "{name} {i}: {own:?} {row:?}");
                (row[0] as usize, pose_of(&row[1..13]))
            })
            .collect();
        let ends = [take(13), take(13)];
        assert!(words.next().is_none());
        let end = pose_of(&ends[1][1..]);
        let (part, mut own) = (model.part("arm").unwrap(), Robot::new(&model));
        let mut rng = Rng(7);
        for _ in 0..50 {
            let q: Vec<f64> = limits.iter().map(|l| rng.within(l.lower, l.upper)).collect();
            own.set_q(&q).unwrap();
            let at = joints.iter().zip(&q).fold(Pose::identity(), |X, ((axis, M), q)| {
                X * *M * Pose::new(Quat::from_scaled_axis(Vec3::ith(*axis, *q)), Vec3::zeros())
            });
            let (p, R) = apart(&own.tip_pose(part).unwrap(), &(at * end));
            assert!(p < 1e-9 && R < 1e-10, "{name}: {p} {R}");
        }
    }
}

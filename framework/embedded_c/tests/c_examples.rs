//! The examples in C and C++ print the same results as Rust for the same robot, and are built by one command.

use linkwork_embedded::formats::{ReadOptions, Root, read_file, read_srdf_file};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use linkwork_robot::LwStatus;
use std::path::PathBuf;
use std::process::Command;

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Returns the output of the C and C++ examples, built with the command of the README (`examples/build`) and the archive that cargo made next to the
/// test. `None` if there is no compiler, which is a failure if `CI` is set.
fn examples() -> Option<[String; 2]> {
    for compiler in ["cc", "c++"] {
        if Command::new(compiler).arg("--version").output().is_err() {
            assert!(std::env::var_os("CI").is_none(), "`{compiler}` is missing");
            println!("skipped: no `{compiler}` is here");
            return None;
        }
    }
    let test = std::env::current_exe().unwrap();
    let library = test.parent().unwrap().join("liblinkwork_robot.a");
    let scratch = tempfile::tempdir().unwrap();
    let mut build = Command::new(folder().join("examples/build"));
    build.env("LINKWORK_LIBRARY", library);
    Some(built(&mut build, scratch.path()))
}

/// Runs the build, and returns the output of the programs.
fn built(build: &mut Command, to: &std::path::Path) -> [String; 2] {
    let build = build.arg(to).env("CFLAGS", "-Werror").env_remove("CC").env_remove("CXX");
    let out = build.output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    ["arm_c.txt", "arm_cpp.txt"].map(|f| std::fs::read_to_string(to.join(f)).unwrap())
}

/// Computes in Rust what the examples print.
fn expected() -> String {
    use std::fmt::Write;
    let examples = folder().join("examples");
    let options = ReadOptions { root: Root::Fixed, ..ReadOptions::default() };
    let d = read_file(examples.join("arm.urdf"), &options).unwrap();
    let srdf = read_srdf_file(examples.join("arm.srdf")).unwrap();
    let spec = ModelSpec::from_description(&d).unwrap().groups(&srdf, &d).unwrap();
    let mut spec = spec.shapes(&d).unwrap();
    let inertia = Mat3::from_diagonal(&Vec3::new(2e-3, 2e-3, 1e-3));
    let mass = MassProperties::new(0.4, Vec3::zeros(), inertia);
    spec.objects.push(ObjectSpec { name: "cup".into(), mass });
    let can = Shape::Cylinder { radius: 0.04, half_length: 0.05 };
    let board = Shape::Box { half: Vec3::new(0.1, 0.4, 0.02) };
    let at = Pose::translation(0.6, 0.0, 0.9);
    spec.colliders.push(ColliderSpec::new("can", "cup", can));
    spec.colliders.push(ColliderSpec::new("shelf", "world", board).at(at));
    let model = RobotModel::new(&spec).unwrap();
    let (arm, cup) = (model.part("arm").unwrap(), model.object("cup").unwrap());
    let mut robot = Robot::new(&model);
    let mut out = String::new();
    let mut print = |what: &str, x: &[f64]| {
        let numbers: Vec<String> = x.iter().map(|x| format!("{x:e}")).collect();
        writeln!(out, "{what} {}", numbers.join(" ")).unwrap();
    };
    let (mut q, mut tau, mut J, mut M) = (vec![0.3, 0.8, -1.1], [0.0; 3], [0.0; 18], [0.0; 9]);
    robot.set_q(&q).unwrap();
    print("tip", robot.tip_pose(arm).unwrap().position.as_slice());
    robot.jacobian(arm, &mut J).unwrap();
    print("jacobian", &J);
    let goal = Goal::position(Vec3::new(0.5, 0.2, 0.5));
    robot.inverse_kinematics(arm, &goal, Frame::World, &Effort::default(), &mut q).unwrap();
    print("q", &q);
    robot.set_q(&q).unwrap();
    let m = robot.manipulability(arm, Rows::Linear, None).unwrap();
    print("manipulability", &[m.w]);
    let up = spatial::Motion::new(Vec3::zeros(), Vec3::new(0.0, 0.0, 0.2));
    let objective = Objective::new(0, Aim::Tip { part: arm, motion: up, rows: Rows::Linear });
    let (mut control, mut rates) = (RateControl::new(&robot, 1, 1), [0.0; 3]);
    let guards = Guards { horizon: 0.05, manipulable: &[(arm, 0.01)] };
    control.solve(&mut robot, &[objective], &guards, &mut rates, &mut [0.0]).unwrap();
    print("rates", &rates);
    robot.put(cup, Pose::translation(0.62, 0.25, 0.5)).unwrap();
    let mut planner = Planner::new(&robot, arm, 100).unwrap();
    let home = [1.2, 0.4, -0.9];
    let way = planner.plan(&mut robot, &q, &home, &Search::default()).unwrap();
    assert_eq!(way, PlanOutcome::Found);
    let way: Vec<f64> = planner.path().flatten().copied().collect();
    let mut timing = Timing::new(&robot, 16, 640).unwrap();
    let limits = MotionLimits::of(&model).acceleration(4.0);
    let timed = timing.plan(&mut robot, &way, &limits, 0.0).unwrap();
    let Timed::Found { duration } = timed else { panic!("{timed:?}") };
    print("duration", &[duration]);
    let (mut at, mut v, mut vdot) = ([0.0; 3], [0.0; 3], [0.0; 3]);
    timing.at(0.3, &mut at, &mut v, &mut vdot).unwrap();
    print("on_the_path", &[at, v, vdot].concat());
    robot.held_still(&[], &mut tau).unwrap();
    print("empty", &tau);
    robot.grasp(arm, cup, Grasp::At(Pose::translation(0.1, 0.0, 0.0))).unwrap();
    robot.held_still(&[], &mut tau).unwrap();
    print("loaded", &tau);
    robot.feed_forward(&[0.1, -0.2, 0.3], &[1.0, 0.5, -0.5], &[], &mut tau).unwrap();
    print("moving", &tau);
    robot.mass_matrix(&mut M).unwrap();
    print("mass_matrix", &M);
    let (mass, center) = robot.center_of_mass();
    print("mass", &[mass]);
    print("center", center.as_slice());
    print("clearance", &[robot.clearance(&q, 10.0).unwrap().unwrap().distance.distance]);
    let (a, b) = robot.first_hit(&[0.0, 1.2, -1.2]).unwrap().unwrap();
    let name = |id| model.collider_name(id);
    let refused = robot.set_q(&q[..2]).unwrap_err();
    let code = LwStatus::Length as i32;
    writeln!(out, "touch {} {}\nrefused {code}: {refused}", name(a), name(b)).unwrap();
    out
}

/// Checks that words are equal and numbers bit-identical.
fn same(ours: &str, expected: &str) {
    let lines = (ours.lines().count(), expected.lines().count());
    assert_eq!(lines.0, lines.1, "\n{ours}\n{expected}");
    for (a, b) in ours.lines().zip(expected.lines()) {
        let words = (a.split(' '), b.split(' '));
        assert_eq!(words.0.clone().count(), words.1.clone().count(), "{a} | {b}");
        for (x, y) in words.0.zip(words.1) {
            match (x.parse::<f64>(), y.parse::<f64>()) {
                (Ok(x), Ok(y)) => assert_eq!(x.to_bits(), y.to_bits(), "{a} | {b}"),
                _ => assert_eq!(x, y),
            }
        }
    }
}

#[test]
fn the_c_example_says_what_rust_says() {
    let Some([out, _]) = examples() else { return };
    same(&out, &expected());
    // Compare with the closed form of a cup of 0.4 kg on arms of 0.5 m and 0.45 m + 0.1 m.
    let row = |what: &str| -> Vec<f64> {
        let line = out.lines().find_map(|l| l.strip_prefix(&format!("{what} "))).unwrap();
        line.split(' ').map(|x| x.parse().unwrap()).collect()
    };
    let (q, empty, loaded) = (row("q"), row("empty"), row("loaded"));
    let lower = 0.55 * (q[1] + q[2]).cos();
    let weight = 0.4 * 9.81;
    for (k, arm) in [0.0, 0.5 * q[1].cos() + lower, lower].into_iter().enumerate() {
        assert!((loaded[k] - empty[k] - weight * arm).abs() < 1e-12, "{k}");
    }
    let sum: f64 = [4.0, 3.0, 2.0, 0.4].iter().sum();
    assert!((row("mass")[0] - sum).abs() < 1e-12);
}

#[test]
fn the_cpp_example_says_what_rust_says() {
    let Some([_, out]) = examples() else { return };
    same(&out, &expected());
}

//! Rocky 8 compared with data published by its makers: the committed files follow from the JSON files, masses and kinetic energy from an independent
//! reading of them, and the rover stands, drives and steers as it should.
use linkwork_dynamics::{Workspace, kinematics};
use linkwork_plant::PlanExt;
use linkwork_runtime::{Seconds, Simulation};
use linkwork_spatial::nalgebra::Matrix3;
use linkwork_spatial::{Quat, Vec3};
use serde_json::Value;
use std::collections::BTreeMap;

use crate::common;

/// Reads a reference file; `None` without reference data, which is a failure if CI=true.
fn reference(name: &str) -> Option<String> {
    let file = linkwork_tests::root().join("../shared/reference/rocky8").join(name);
    match std::fs::read_to_string(&file) {
        Ok(text) => Some(text),
        Err(e) => {
            assert!(std::env::var("CI").as_deref() != Ok("true"), "{}: {e}", file.display());
            println!("skipped: no reference file {name}");
            None
        }
    }
}

fn run(file: &str, set: &[&str], t: f64) -> Simulation {
    let mut sim = common::repository(file, set).unwrap();
    sim.run_until(Seconds::from_decimal(t).unwrap()).unwrap();
    sim
}

/// Returns the path of a model's variable by its last part.
fn get(sim: &Simulation, ending: &str) -> f64 {
    let mut found = sim.plan().variables.keys().filter(|k| k.ends_with(ending));
    let path = found.next().unwrap_or_else(|| panic!("{ending}"));
    assert_eq!(found.next(), None);
    sim.get(path).unwrap()
}

const BODY: &str = "R8.R8Hdw.R8Mbody/";
const POSE: &str = "localizationSensor_localization_sensor.localizationSensor_localization_sensor";

fn loads(sim: &Simulation) -> Vec<f64> {
    let paths = sim.plan().variables.keys().filter(|k| k.ends_with("_contact.normal_force"));
    let all: Vec<f64> = paths.map(|p| sim.get(p).unwrap()).collect();
    assert_eq!(all.len(), 6);
    all
}

#[test]
fn the_committed_files_follow_from_the_published_ones() {
    let (Some(mbody), Some(assembly)) =
        (reference("rocky8_mbody.json"), reference("rocky8_assembly.json"))
    else {
        return;
    };
    let files = linkwork_rocky8::convert(&mbody, &assembly).unwrap();
    assert_eq!(files.len(), 3);
    for (name, text) in files {
        let committed =
            std::fs::read_to_string(linkwork_tests::root().join("sims/rocky8").join(&name))
                .unwrap();
        assert!(committed == text, "{name} is not what the converter writes: run it again");
    }
    // The converter rejects unknown entries with their location.
    for (from, to, told) in [
        (
            "\"DCMotorVin\"",
            "\"DCMotorXY\"",
            "WheelBogeySideLeft_motor: models of the class DCMotorXY are not known",
        ),
        ("\"nonlinear\"", "\"quintic\"", "only \"nonlinear\" can be converted"),
        ("\"lower_bound\"", "\"lower\"", "PARAMS: `lower_bound` is missing"),
    ] {
        let e = linkwork_rocky8::convert(&mbody, &assembly.replace(from, to)).unwrap_err();
        assert!(e.contains(told), "{e}");
    }
    let e = linkwork_rocky8::convert(&mbody.replace("FULL6DOF", "BALL"), &assembly).unwrap_err();
    assert!(e.contains("BODIES/chassis: a hinge of the type BALL is not known"), "{e}");
    let e = linkwork_rocky8::convert(&mbody.replace("33.5", "33.4"), &assembly).unwrap_err();
    assert!(e.contains("the bodies of the two files differ"), "{e}");
}

/// A body in the makers' convention: axes with z down.
struct Theirs {
    name: String,
    parent: Option<usize>,
    at: Vec3,
    axis: Vec3,
    mass: f64,
    com: Vec3,
    inertia: Matrix3<f64>,
}

fn theirs(text: &str) -> Vec<Theirs> {
    let json: Value = serde_json::from_str(text).unwrap();
    let map = json["R8Mbody"]["BODIES"].as_object().unwrap();
    let v3 = |v: &Value| Vec3::from_fn(|i, _| v[i].as_f64().unwrap_or(0.0));
    let mut out: Vec<Theirs> = Vec::new();
    while out.len() < map.len() {
        for (name, b) in map {
            let inb = b["inbBody"].as_str();
            let parent = inb.and_then(|p| out.iter().position(|o| o.name == p));
            if out.iter().any(|o| o.name == *name) || (inb.is_some() && parent.is_none()) {
                continue;
            }
            out.push(Theirs {
                name: name.clone(),
                parent,
                at: v3(&b["inbToJoint"]),
                axis: v3(&b["jointAxes"][0]),
                mass: b["mass"].as_f64().unwrap(),
                com: v3(&b["bodyToCM"]),
                inertia: Matrix3::from_fn(|i, j| b["cmInertia"][i][j].as_f64().unwrap()),
            });
        }
    }
    out
}

/// Kinetic energy and centre of mass for a pose and velocity of the chassis and angles and rates by name.
fn energy(
    bodies: &[Theirs],
    root: (Vec3, Quat, Vec3, Vec3),
    hinges: &BTreeMap<String, (f64, f64)>,
) -> (f64, Vec3) {
    let (mut frames, mut sum, mut total, mut kinetic) = (Vec::new(), Vec3::zeros(), 0.0, 0.0);
    for b in bodies {
        let (p, r, w, v) = match b.parent {
            None => root,
            Some(k) => {
                let (p, r, w, v): (Vec3, Quat, Vec3, Vec3) = frames[k];
                let (angle, rate) = hinges[&b.name];
                let l = r * b.at;
                let r1 = r * Quat::from_scaled_axis(b.axis * angle);
                (p + l, r1, w + r1 * b.axis * rate, v + w.cross(&l))
            }
        };
        let c = r * b.com;
        let (vc, wb) = (v + w.cross(&c), r.inverse() * w);
        kinetic += 0.5 * (b.mass * vc.norm_squared() + wb.dot(&(b.inertia * wb)));
        sum += (p + c) * b.mass;
        total += b.mass;
        frames.push((p, r, w, v));
    }
    (kinetic, sum / total)
}

/// 22 rates in 60 random states: the kinetic energy and with it every element of the mass matrix.
#[test]
fn masses_centre_of_mass_and_kinetic_energy_are_the_makers() {
    let Some(text) = reference("rocky8_mbody.json") else { return };
    let bodies = theirs(&text);
    let sim = common::repository("rocky8/sim.ron", &[]).unwrap();
    let m = sim.plan().mechanism().unwrap();
    let (mb, tree) = (&m.multibody, &m.tree);
    assert_eq!((mb.bodies().len(), bodies.len(), mb.nv()), (17, 17, 22));
    let total: f64 = bodies.iter().map(|b| b.mass).sum();
    assert!((total - 51.84).abs() < 1e-12 && (tree.total_mass() - total).abs() < 1e-12);
    let prescribed = mb.prescribed().iter().filter(|p| **p).count();
    assert_eq!(prescribed, 6);
    let mut ws = Workspace::new(tree);
    let mut seed = 7u64;
    let mut random = || {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    let mut worst = [0.0f64; 2];
    for _ in 0..60 {
        let mut q = mb.neutral_q();
        let v: Vec<f64> = (0..mb.nv()).map(|_| random()).collect();
        let mut hinges = BTreeMap::new();
        let turn = Quat::from_scaled_axis(Vec3::new(random(), random(), random()));
        let place = Vec3::new(random(), random(), random());
        let mut root = (place, turn, Vec3::zeros(), Vec3::zeros());
        for id in mb.body_ids() {
            let b = mb.get(id);
            let name = b.name().strip_prefix(BODY).unwrap();
            let (at, rate) = (b.q().start, b.v().start);
            if name == "chassis" {
                q[at..at + 3].copy_from_slice(place.as_slice());
                q[at + 3..at + 7].copy_from_slice(turn.coords.as_slice());
                // The body axes are the makers' axes rotated by 180° about x; velocities are in the
                // world's axes.
                let half = Quat::from_scaled_axis(Vec3::x() * std::f64::consts::PI);
                let w = turn * Vec3::from_column_slice(&v[rate..rate + 3]);
                let u = turn * Vec3::from_column_slice(&v[rate + 3..rate + 6]);
                root = (place, turn * half, w, u);
            } else {
                q[at] = random();
                hinges.insert(name.to_string(), (q[at], v[rate]));
            }
        }
        kinematics(tree, &mut ws, &q, &v);
        let (mut ours, mut sum) = (0.0, Vec3::zeros());
        let mut matrix = vec![0.0; mb.nv() * mb.nv()];
        linkwork_dynamics::mass_matrix(tree, &mut ws, &mut matrix);
        for (i, row) in matrix.chunks_exact(mb.nv()).enumerate() {
            ours += 0.5 * v[i] * row.iter().zip(&v).map(|(a, b)| a * b).sum::<f64>();
        }
        for id in mb.body_ids() {
            let (pose, i) = (ws.body_pose(tree, id), mb.get(id).inertia());
            sum += pose.position * i.mass() + pose.rotation * i.h();
        }
        let (kinetic, com) = energy(&bodies, root, &hinges);
        worst[0] = worst[0].max((ours / kinetic - 1.0).abs());
        worst[1] = worst[1].max((sum / total - com).norm());
        assert!(ours.is_finite() && com.norm().is_finite());
    }
    println!("kinetic energy {:e}, centre of mass {:e} m", worst[0], worst[1]);
    // Measured: 1e-15 and 4e-16.
    assert!(worst[0] < 1e-12 && worst[1] < 1e-12, "{worst:?}");
}

#[test]
fn it_settles_on_its_wheels() {
    for set in [&[][..], &["R8.differential=spring"]] {
        let sim = run("rocky8/sim.ron", set, 4.0);
        let loads = loads(&sim);
        let sum: f64 = loads.iter().sum();
        let pair = ["Left", "Right"].map(|s| sim.get(&format!("{BODY}Rocker{s}.angle")).unwrap());
        println!("{set:?}: {sum} N, {loads:?}, rockers {pair:?}");
        // The rover has 51.84 kg, so its weight is 508.6 N at 9.81 m/s².
        assert!((sum / 508.6 - 1.0).abs() < 1e-3, "{sum}");
        assert!(loads.iter().all(|n| *n > 40.0));
        let sum = pair[0] + pair[1];
        if set.is_empty() {
            assert!(sum.abs() < 1e-12 && pair[0].abs() > 1e-6, "{pair:?}");
        } else {
            // The springs of the makers carry the chassis: 33.5 kg, 0.1044 m in front of the rockers' axis, on 2 · 1000
            // N m/rad.
            let wanted = -33.5 * 9.81 * (0.142 - 0.0376) / 2000.0;
            assert!((sum / wanted - 1.0).abs() < 0.02, "{sum} {wanted}");
        }
        let still = ["WheelCenterLeft", "WheelRockerSideRight", "BogeyLeft", "RockerLeft"];
        let rate = |b: &&str| sim.get(&format!("{BODY}{b}.rate")).unwrap().abs();
        assert!(still.iter().map(rate).all(|r| r < 1e-3));
    }
}

#[test]
fn it_drives_as_far_as_its_wheels_turn() {
    let start = run("rocky8/drive.ron", &[], 2.0);
    let end = run("rocky8/drive.ron", &[], 25.0);
    let went = get(&end, &format!("{POSE}.x")) - get(&start, &format!("{POSE}.x"));
    let odometry = get(&end, "Odometry.x") - get(&start, "Odometry.x");
    println!("went {went} m, odometry {odometry} m");
    // Measured: 1.0000008 and 1.0000006.
    assert!((went - 1.0).abs() < 2e-3 && (went - odometry).abs() < 1e-3);
    assert!(get(&end, &format!("{POSE}.heading")).abs() < 1e-3);
    let middle = run("rocky8/drive.ron", &[], 12.0);
    for wheel in ["RockerSideLeft", "CenterRight", "BogeySideLeft"] {
        let rate = middle.get(&format!("{BODY}Wheel{wheel}.rate")).unwrap();
        assert!((rate - 0.5).abs() < 5e-3, "{wheel}: {rate}");
        // The makers' motor model is u = R i + k n ω.
        let motor = format!("Wheel{wheel}_motor");
        let (u, i) =
            (get(&middle, &format!("{motor}.volts")), get(&middle, &format!("{motor}.current")));
        assert!((u - 4.81 * i - 0.0101 * 1620.0 * rate).abs() < 1e-9);
    }
    let pair = ["Left", "Right"].map(|s| middle.get(&format!("{BODY}Rocker{s}.angle")).unwrap());
    assert!((pair[0] + pair[1]).abs() < 1e-12, "{pair:?}");
}

#[test]
fn it_turns_in_place_with_its_wheels_as_prescribed() {
    let sim = run("rocky8/turn.ron", &[], 12.0);
    for (wheel, angle) in [
        ("RockerSideLeft", -48.699689),
        ("CenterLeft", 0.0),
        ("BogeySideLeft", 53.350047),
        ("RockerSideRight", 48.699689),
        ("CenterRight", 0.0),
        ("BogeySideRight", -53.350047),
    ] {
        let q = sim.get(&format!("{BODY}Steer{wheel}.angle")).unwrap().to_degrees();
        // Measured with RK4 at 2 ms: 1e-9.
        assert!((q - angle).abs() < 1e-7, "{wheel}: {q}");
    }
    let sim = run("rocky8/turn.ron", &[], 34.0);
    let [x, y, heading] = ["x", "y", "heading"].map(|n| get(&sim, &format!("{POSE}.{n}")));
    println!("x {x}, y {y}, heading {} deg", heading.to_degrees());
    // The rover turns in place by 90° to the left; wide wheels slip slightly.
    assert!((heading.to_degrees() - 90.0).abs() < 1.0 && x.hypot(y) < 3e-3);
    assert!((heading - get(&sim, "Odometry.heading")).to_degrees().abs() < 0.5);
}

/// Interrupted in the middle of a steering motion and resumed in a new folder: bit-identical.
#[test]
fn a_cut_in_a_steering_motion_leaves_no_trace() {
    let whole = run("rocky8/turn.ron", &[], 6.0);
    let half = run("rocky8/turn.ron", &[], 2.998);
    let saved = half.checkpoint("").unwrap();
    let mut rest = common::repository("rocky8/turn.ron", &[]).unwrap();
    rest.restore(&saved).unwrap();
    rest.run_until(Seconds::from_decimal(6.0).unwrap()).unwrap();
    assert_eq!(rest.hash(), whole.hash());
}

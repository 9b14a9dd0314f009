//! The simulations of robot arms agree with their READMEs: a button, a drill, a handset, a key and a door, a beam between two arms, a wire, a wheel;
//! and a standing quadruped.
use linkwork_runtime::Simulation;

use crate::common;

fn load(file: &str, set: &[&str]) -> Simulation {
    common::repository(file, set).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn get(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs until the arm succeeds or fails, and checks each sample. Returns the duration in seconds.
fn work(sim: &mut Simulation, longest: f64, look: impl FnMut(&Simulation)) -> f64 {
    work_of(sim, "Arm", longest, look)
}

fn work_of(
    sim: &mut Simulation,
    robot: &str,
    longest: f64,
    mut look: impl FnMut(&Simulation),
) -> f64 {
    let [done, failed] = ["done", "failed"].map(|o| format!("{robot}.Controller.{o}"));
    while get(sim, &done) < 0.5 && sim.time() < longest {
        let next = sim.time() + 0.01;
        sim.run_until(common::seconds(next)).unwrap();
        look(sim);
        assert!(get(sim, &failed) < 0.5, "failed at {:.2} s", sim.time());
    }
    assert!(get(sim, &done) > 0.5, "not done after {longest} s");
    sim.time()
}

/// The button clicks at 3 mm; the force on the finger there is preload and spring, 2.2 N, and 0.05 N of friction. If the controller assumes the
/// button 5 mm nearer or farther, it still finds it by touch.
#[test]
fn the_button_is_found_by_touch_and_clicks() {
    for wrong in [0.0, -0.005, 0.005] {
        let believed = format!("believed=[{}, 0.15, 0.45]", 0.55 + wrong);
        let mut sim = load("push_button/sim.ron", &[&believed]);
        let (mut click, mut travel) = (None, 0.0_f64);
        work(&mut sim, 12.0, |s| {
            let way = get(s, "button.displacement");
            travel = travel.max(way);
            if click.is_none() && way > 3e-3 {
                click = Some((way, -get(s, "finger.contact_force.x")));
            }
        });
        let (way, force) = click.unwrap();
        // The button is pressed slowly: the force includes the spring, friction and 2 N s/m
        // of damping at some mm/s.
        let spring = 400.0 * (way + 0.0025);
        println!("{wrong}: {:.2} N at {:.2} mm, to {:.2} mm", force, 1e3 * way, 1e3 * travel);
        assert!((force - spring).abs() < 0.5, "{force} N, spring {spring} N");
        assert!((travel - 4e-3).abs() < 5e-4, "{travel}");
        assert!(get(&sim, "button.displacement").abs() < 1e-4, "it is back");
    }
}

/// The hole is as deep as the plate is thick, and the work of the spindle equals that of the cutting model.
#[test]
fn the_drill_goes_through_and_stops_at_its_depth() {
    let mut sim = load("drill/sim.ron", &[]);
    let (mut most, mut deep, mut side) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut fed = Vec::new();
    work(&mut sim, 40.0, |s| {
        deep = deep.max(get(s, "Cut.depth"));
        most = most.max(get(s, "Cut.thrust"));
        side = side.max(get(s, "Cut.side"));
        let hole = get(s, "Cut.state.hole");
        if hole > 1.5e-3 && hole < 3.5e-3 {
            fed.push(get(s, "Cut.feed"));
        }
    });
    assert!((get(&sim, "Cut.state.hole") - 4e-3).abs() < 1e-5);
    // At 60 N the feed is f = 2 (60 − 15)/(K D) per revolution, at 120 rad/s; the tip's damper takes a small part
    // of the thrust.
    let feed = 2.0 * 45.0 / (0.8e9 * 6e-3) * 120.0 / std::f64::consts::TAU;
    let mean = fed.iter().sum::<f64>() / fed.len() as f64;
    println!(
        "feed {:.3} mm/s of {:.3}, {most:.0} N, {:.2} mm deep",
        1e3 * mean,
        1e3 * feed,
        1e3 * deep
    );
    assert!((mean / feed - 1.0).abs() < 0.05, "{mean} against {feed}");
    assert!(most < 80.0 && side < 15.0 && deep > 6e-3 && deep < 9e-3, "{most} {side} {deep}");
}

/// While it is carried, its weight does not cause control errors; when released, its weight is on the cradle.
#[test]
fn the_handset_is_hung_up_and_stays_there() {
    let mut sim = load("hang_up_phone/sim.ron", &[]);
    let (mut worst, mut hard) = (0.0_f64, 0.0_f64);
    work(&mut sim, 15.0, |s| {
        if get(s, "Arm.Controller.index") < 1.5 {
            worst = worst.max(get(s, "Arm.Controller.error"));
        }
        hard = hard.max(get(s, "handset.contact_force.z"));
    });
    println!("error while carried {:.2} mm, {hard:.1} N", 1e3 * worst);
    assert!(worst < 2e-3 && hard < 30.0, "{worst} {hard}");
    let next = sim.time() + 1.0;
    sim.run_until(common::seconds(next)).unwrap();
    let weight = 0.26 * 9.80665;
    let force = get(&sim, "handset.contact_force.z");
    assert!((force / weight - 1.0).abs() < 1e-3, "{force} N");
    let [x, y, z] = ["x", "y", "z"].map(|a| get(&sim, &format!("handset.position.{a}")));
    assert!((x - 0.5).abs() < 2e-3 && (y - 0.25).abs() < 2e-3 && (z - 0.2425).abs() < 1e-3);
    assert!(get(&sim, "handset.velocity.z").abs() < 1e-6);
}

/// The key rotates by 90°, the door moves with the hand as far as the arm leads it, and the key stays in the lock. An arm that assumes the lock 1 mm
/// off complies.
#[test]
fn the_key_turns_and_the_door_opens() {
    for wrong in [0.0, 1e-3] {
        let believed = format!("believed=[0.6, {}, 0.4]", 0.05 + wrong);
        let mut sim = load("key_and_door/sim.ron", &[&believed]);
        let (mut most, mut turned, mut early) = (0.0_f64, 0.0_f64, 0.0_f64);
        work(&mut sim, 20.0, |s| {
            // The phase starts where the key enters the displaced lock: the loop closes over a time.
            if get(s, "Arm.Controller.index") > 1.5 {
                most = most.max(get(s, "Arm.Controller.push"));
            }
            turned = turned.max(get(s, "cylinder.angle"));
            if get(s, "Arm.Controller.index") < 2.5 {
                early = early.max(get(s, "door.angle").abs());
            }
        });
        let door = get(&sim, "door.angle").to_degrees();
        println!("{wrong}: door {door:.2}°, key {:.2}°, {most:.1} N", turned.to_degrees());
        assert!((turned.to_degrees() - 90.0).abs() < 2.0 && (door + 30.0).abs() < 2.0);
        assert!(early < 1e-6, "the latch holds: {early}");
        assert!(most < 30.0, "{most} N");
        let moved = sim.variable("key.position.x").is_ok();
        assert!(moved, "the key is a body of its own at the end, in the lock");
    }
}

/// Two palms carry a beam of 8 kg. Both press as hard as friction needs, as the forces of the simulated grip confirm; all joints stay far from their
/// limits; and the beam ends at its target, also if it starts up to 5 mm off or is assumed 1 kg too light.
#[test]
fn two_arms_carry_a_beam_between_their_palms() {
    let at = |x: f64, y: f64, z: f64| format!("believed=[{x}, {y}, {z}]");
    let sets = [
        at(0.5, 0.0, 0.2),
        at(0.504, 0.005, 0.2),
        at(0.5, -0.004, 0.197),
        "mass_believed=7".into(),
    ];
    for set in sets {
        let mut sim = load("dual_arm_carry/sim.ron", &[&set]);
        let (mut needs, mut told, mut share, mut error) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
        let mut carried = 0;
        work_of(&mut sim, "Robot", 25.0, |s| {
            let index = get(s, "Robot.Controller.index");
            share = share.max(get(s, "Robot.Controller.share"));
            if s.phase() != "carried" {
                return;
            }
            // The right palm exerts this force on the beam, in axes of the tool: y points
            // towards the left palm.
            let [x, y, z] = [0, 1, 2].map(|k| get(s, &format!("Mechanism.grip.force[{k}]")));
            needs = needs.max(x.hypot(z) / y);
            told = told.max(get(s, "Robot.Controller.friction"));
            if (2.5..4.5).contains(&index) {
                error = error.max(get(s, "Robot.Controller.error"));
            }
            assert!(y > 20.0 && get(s, "Robot.Controller.slipping") < 0.5, "{} s: {y} N", s.time());
            carried += 1;
        });
        let [x, y, z] = ["x", "y", "z"].map(|a| get(&sim, &format!("beam.position.{a}")));
        let [i, j, k, w] = ["x", "y", "z", "w"].map(|a| get(&sim, &format!("beam.rotation.{a}")));
        let turned = 2.0 * (k / w).atan().to_degrees();
        let weight = get(&sim, "beam.contact_force.z") / (8.0 * 9.80665);
        println!(
            "{set}: friction {needs:.3} (told {told:.3}), share {share:.3}, error {:.2} mm, at [{x:.4}, {y:.4}, {z:.4}], {turned:.2}°, {weight:.5}",
            1e3 * error
        );
        assert!(carried > 700 && needs < 0.6 && told < 0.6 / 1.3 + 1e-6, "{needs} {told}");
        // The README states a friction of 0.43 nominally, and errors of 0.1 mm, or 0.7 mm if the
        // assumed mass is 1 kg too small.
        let light = set.starts_with("mass");
        assert!(share < 0.8 && error < if light { 7.5e-4 } else { 1.5e-4 }, "{share} {error}");
        assert!(light || (needs - 0.43).abs() < 5e-3, "{needs}");
        // The target is relative to the assumed pose of the beam, its pose in the hands to the true
        // one.
        assert!((x - 0.35).abs() < 8e-3 && y.abs() < 8e-3 && (z - 0.2795).abs() < 1e-3);
        assert!(
            (turned - 15.0).abs() < 0.5 && i.abs() < 2e-3 && j.abs() < 2e-3,
            "{turned} {i} {j}"
        );
        assert!((weight - 1.0).abs() < 1e-3, "{weight}");
    }
}

/// A finger closes the trimmers: the cutting force equals the shear strength of the wire, 62 MPa times 3.14 mm², the arm does not feel it, and the
/// cut end lies on the table. A finger that is too weak only dents the wire.
#[test]
fn the_wire_is_cut_and_its_end_drops() {
    for (set, grip) in
        [("grip=60", 60.0), ("believed=[0.502, 0.1, 0.303]", 60.0), ("grip=38", 38.0)]
    {
        let mut sim = load("cut_wire/sim.ron", &[set]);
        let (mut most, mut inside, mut push, mut torque) =
            (0.0_f64, 0.0_f64, 0.0_f64, [f64::INFINITY, f64::NEG_INFINITY]);
        work(&mut sim, 15.0, |s| {
            most = most.max(get(s, "Cut.force"));
            if get(s, "Cut.cut") > 0.1 {
                inside = inside.max(get(s, "Cut.force"));
            }
            push = push.max(get(s, "Arm.Controller.push"));
            let index = get(s, "Arm.Controller.index");
            if index == 2.0 {
                let now = get(s, "Arm.Joints2.Drive.load");
                torque = [torque[0].min(now), torque[1].max(now)];
            }
        });
        let cut = get(&sim, "Cut.cut");
        println!("{set}: {cut:.3}, {most:.1} N, push {push:.2} N, shoulder {torque:.2?} N m");
        // The arm does not feel the 6.6 N m about the pin, only the swinging handle.
        assert!(push < 3.0 && torque[1] - torque[0] < 1.0, "{push} {torque:?}");
        if grip < 50.0 {
            let least = 62e6 * std::f64::consts::PI * 1e-6;
            assert!(cut < 0.05 && most < least && most > 0.8 * least && sim.phase() == "whole");
            continue;
        }
        let strength = 62e6 * std::f64::consts::PI * 1e-6;
        // The cutting force follows from the wire's strength; it is larger for a moment when the edges hit the wire.
        assert!((inside / strength - 1.0).abs() < 0.02, "{inside} of {strength}");
        assert!(cut == 1.0 && most > strength && most < 1.15 * strength, "{most} of {strength}");
        assert_eq!(sim.phase(), "cut");
        let next = sim.time() + 1.0;
        sim.run_until(common::seconds(next)).unwrap();
        let (z, v) = (get(&sim, "far.position.z"), common::get(&sim, "far.velocity").norm());
        assert!((z - 0.151).abs() < 1e-3 && v < 2e-3, "{z} m, {v} m/s");
        let force = get(&sim, "far.contact_force.z") / (0.0013 * 9.80665);
        assert!((force - 1.0).abs() < 0.05, "{force}");
    }
}

/// The wheel is pushed onto the hub, and each nut ends on its stud within the hand's position accuracy; along the studs the hand feels contact.
#[test]
fn a_wheel_is_mounted_and_five_nuts_are_put_on() {
    let beside = "believed=[0.548, 0.002, 0.379]";
    for (set, off) in [("mass_believed=6.5", [0.0; 2]), (beside, [0.002, -0.001])] {
        let mut sim = load("tyre_change/sim.ron", &[set]);
        let (mut most, mut share, mut needs, mut mounted) = (0.0_f64, 0.0_f64, 0.0_f64, 0);
        work_of(&mut sim, "Robot", 60.0, |s| {
            share = share.max(get(s, "Robot.Controller.share"));
            if s.phase() == "carried" {
                most = most.max(get(s, "hub.contact_force.x"));
                let [x, y, z] = [0, 1, 2].map(|k| get(s, &format!("Mechanism.grip.force[{k}]")));
                needs = needs.max(x.hypot(z) / y);
            } else if s.phase() != "waiting" {
                // The wheel is on the hub, and their pair is ignored, so they do not press on each other.
                let force = common::get(s, "hub.contact_force").norm();
                assert!(force == 0.0, "{force} N in {}", s.phase());
                mounted += 1;
            }
        });
        assert!(mounted > 1000, "{mounted}");
        // The README states 0.54.
        assert!(set == beside || (needs - 0.54).abs() < 5e-3, "{needs}");
        let turned = get(&sim, "hub.angle").to_degrees();
        println!(
            "{set}: hub {most:.1} N, share {share:.3}, friction {needs:.3}, turned {turned:.3}°"
        );
        assert!(most > 20.0 && most < 150.0 && share < 0.8 && needs < 0.6 && turned.abs() < 0.5);
        for k in 1..=5 {
            let p = common::get(&sim, &format!("nut{k}.position"));
            println!("  nut {k} off its stud {:.2?} mm", [1e3 * p.x, 1e3 * p.y, 1e3 * p.z]);
            assert!(p.x.abs() < 4e-4, "{p}");
            let most = if set == beside { 6e-4 } else { 4e-4 };
            assert!((p.y - off[0]).abs() < most && (p.z - off[1]).abs() < most, "{p}");
        }
        // The wheel is 70 mm in front of the face, less half its thickness.
        let wheel = common::get(&sim, "wheel.position");
        assert!((wheel.x + 0.07).abs() < 5e-4 && (wheel.y - off[0]).abs() < 5e-4, "{wheel}");
    }
}

/// A quadruped stands up, is pushed to the left with 8 N for 0.2 s and sways; its feet stay in place, except for the rolling of their spheres. This
/// also works with a trunk a third heavier than assumed, and on slippery ground as assumed. Pushed with 12 N two feet lift for a moment; with 20 N it
/// falls and reports this.
#[test]
fn a_quadruped_stands_up_is_pushed_and_stays() {
    let settings = ["push=8", "mass=1.6 mass_believed=1.2", "friction=0.6", "push=12", "push=20"];
    for (which, set) in settings.into_iter().enumerate() {
        let sets: Vec<&str> = set.split(' ').collect();
        let mut sim = load("legged_stand/sim.ron", &sets);
        let (mut inside, mut tilt, mut low) = (f64::INFINITY, 0.0_f64, f64::INFINITY);
        let (mut pushed, mut side, mut stood) = (0.0_f64, [0.0_f64; 2], Vec::new());
        let feet = ["lf", "rf", "rh", "lh"].map(|leg| format!("Robot/{leg}_lower"));
        let places = |s: &Simulation| {
            feet.iter().map(|f| common::get(s, &format!("{f}.contact_point"))).collect::<Vec<_>>()
        };
        while sim.time() < 10.0 {
            let next = sim.time() + 0.01;
            sim.run_until(common::seconds(next)).unwrap();
            let com = common::get(&sim, "Robot.Controller.com");
            inside = inside.min(get(&sim, "Robot.Controller.inside"));
            tilt = tilt.max(get(&sim, "Robot.Controller.error_angle"));
            if sim.time() > 2.0 {
                low = low.min(com.z);
            }
            if stood.is_empty() && sim.time() > 2.5 {
                stood = places(&sim);
            }
            if (3.0..3.5).contains(&sim.time()) {
                pushed = pushed.max(com.y);
            }
            if sim.time() > 7.0 {
                side = [side[0].min(com.y), side[1].max(com.y)];
            }
        }
        let stands = get(&sim, "Robot.Controller.stands");
        let force = |f: &String| get(&sim, &format!("{f}.contact_force.z"));
        let mass = if set.starts_with("mass") { 3.0 } else { 2.6 };
        let weight = feet.iter().map(force).sum::<f64>() / (mass * 9.80665);
        let moved =
            places(&sim).iter().zip(&stood).map(|(a, b)| (a - b).xy().norm()).fold(0.0, f64::max);
        println!(
            "{set}: stands {stands}, inside {:.1} mm, tilt {:.2}°, low {:.1} mm, pushed by {:.1} mm, sways {:.1?} mm, feet moved {:.2} mm, {weight:.3} of its weight",
            1e3 * inside,
            tilt.to_degrees(),
            1e3 * low,
            1e3 * pushed,
            side.map(|x| 1e3 * x),
            1e3 * moved
        );
        if set == "push=20" {
            assert!(stands < 0.5 && inside < 0.0);
            continue;
        }
        // The README contains these numbers, which are not metrics of the file.
        let page = match set {
            "push=8" => Some([(pushed, 0.017), (side[1], 0.031), (moved, 2e-3)]),
            "push=12" => Some([(moved, 0.033); 3]),
            _ => None,
        };
        for (value, said) in page.into_iter().flatten() {
            assert!((value - said).abs() < 5e-4, "{set}: {value}, the page says {said}");
        }
        assert!(stands > 0.5 && inside > 0.08 && low > 0.2 && (weight - 1.0).abs() < 0.02);
        assert!(pushed > 0.015 && pushed < 0.04, "{pushed}");
        assert!((side[0] + 0.03).abs() < 4e-3 && (side[1] - 0.03).abs() < 4e-3, "{side:?}");
        let most = if which < 3 { [0.02, 3e-3] } else { [0.08, 0.04] };
        assert!(tilt < most[0] && moved < most[1], "{tilt} {moved}");
    }
}

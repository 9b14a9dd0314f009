//! What the simulations of robot arms say in their READMEs: a button, a drill, a handset, a key and a door.
#![allow(clippy::unwrap_used)]
use linkwork_runtime::Simulation;

#[path = "../common/mod.rs"]
mod common;

fn load(file: &str, set: &[&str]) -> Simulation {
    common::repository(file, set).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn get(sim: &Simulation, name: &str) -> f64 {
    sim.get(name).unwrap_or_else(|e| panic!("{e}"))
}

/// Runs until the arm is done or has failed, and looks at each row; seconds that it took.
fn work(sim: &mut Simulation, longest: f64, mut look: impl FnMut(&Simulation)) -> f64 {
    while get(sim, "Arm.Controller.done") < 0.5 && sim.time() < longest {
        let next = sim.time() + 0.01;
        sim.run_until(common::seconds(next)).unwrap();
        look(sim);
        assert!(get(sim, "Arm.Controller.failed") < 0.5, "failed at {:.2} s", sim.time());
    }
    assert!(get(sim, "Arm.Controller.done") > 0.5, "not done after {longest} s");
    sim.time()
}

/// The button clicks at 3 mm; what the finger feels there is preload and spring, 2.2 N, and the friction's 0.05 N. Where the
/// controller believes the button 5 mm nearer or farther, it finds it by touch all the same.
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
        // Slowly pressed: the spring's force, friction and 2 N s/m of damping at some mm/s.
        let spring = 400.0 * (way + 0.0025);
        println!("{wrong}: {:.2} N at {:.2} mm, to {:.2} mm", force, 1e3 * way, 1e3 * travel);
        assert!((force - spring).abs() < 0.5, "{force} N, spring {spring} N");
        assert!((travel - 4e-3).abs() < 5e-4, "{travel}");
        assert!(get(&sim, "button.displacement").abs() < 1e-4, "it is back");
    }
}

/// The hole is as deep as the plate is thick, and the drill cut it by its own law: work of the spindle is the cut's.
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
    // 60 N: f = 2 (60 − 15)/(K D) a turn, at 120 rad/s; the tip's damper takes a little of the thrust.
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

/// Carried it weighs nothing for the controller's errors; let go it lies on the cradle with its weight.
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

/// The key turns by 90°, the door goes with the hand as far as the arm leads it, and the key stays in the lock. An arm that
/// believes the lock 1 mm beside gives way.
#[test]
fn the_key_turns_and_the_door_opens() {
    for wrong in [0.0, 1e-3] {
        let believed = format!("believed=[0.6, {}, 0.4]", 0.05 + wrong);
        let mut sim = load("key_and_door/sim.ron", &[&believed]);
        let (mut most, mut turned, mut early) = (0.0_f64, 0.0_f64, 0.0_f64);
        work(&mut sim, 20.0, |s| {
            // After it has turned: where the key goes into a lock that stands beside, the tip is moved by that much at once.
            if get(s, "Arm.Controller.index") > 2.5 {
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

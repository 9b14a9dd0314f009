//! The entry of `sims/mars_edl/entry.ron`: a capsule in six degrees of freedom that knows what its navigation tells.
#![allow(clippy::unwrap_used, non_snake_case)]
use linkwork_runtime::Simulation;
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Quat, Vec3};

#[path = "../common/mod.rs"]
mod common;
use common::{Worst, get, rotation, seconds, velocity};

/// Errors of place (m), velocity (m/s) and attitude (rad) that navigation makes, W.
fn errors(sim: &Simulation) -> [Vec3; 3] {
    let estimate = |name: &str| get(sim, &format!("Navigation.estimate.{name}"));
    let q = |lane| sim.get(&format!("Navigation.estimate.rotation.{lane}")).unwrap();
    let told = Quat::from_quaternion(Quaternion::new(q("w"), q("x"), q("y"), q("z")));
    [
        estimate("position") - get(sim, "capsule.position"),
        estimate("velocity") - velocity(sim, "capsule"),
        (told * rotation(sim, "capsule").inverse()).scaled_axis(),
    ]
}

/// Errors in the deviations that the filter tells; it has no state for the scale of an instrument.
#[test]
fn a_capsule_is_guided_by_its_navigation_to_where_its_parachute_opens() {
    let mut sim = common::repository("mars_edl/entry.ron", &[]).unwrap();
    let number = |sim: &Simulation, name: &str| sim.get(name).unwrap();
    let mut wrong = [Worst(0.0); 3];
    let (mut trim, mut bank, mut greatest) = (Worst(0.0), Worst(0.0), 0.0_f64);
    while sim.phase() != "handed_over" && sim.before(seconds(1000.0)) {
        sim.step_event().unwrap();
        let row = sim.time() * 20.0;
        if sim.phase() != "entry" || (row - row.round()).abs() > 1e-6 {
            continue;
        }
        let names = ["position", "velocity", "attitude"];
        for ((worst, off), name) in wrong.iter_mut().zip(errors(&sim)).zip(names) {
            let deviation = get(&sim, &format!("Navigation.{name}_deviation"));
            worst.take(off.component_div(&deviation).amax());
        }
        greatest = greatest.max(number(&sim, "Aero.force"));
        if number(&sim, "Aero.dynamic_pressure") > 500.0 {
            trim.take((number(&sim, "Aero.alpha").to_degrees() + 16.0).abs());
            trim.take(number(&sim, "Aero.beta").to_degrees().abs());
            // Between reversals, of which the slewing of the command takes up to ten seconds.
            let slewing = number(&sim, "Bank.error").abs() > 0.3;
            bank.take(if slewing { 0.0 } else { number(&sim, "Bank.error").abs() });
        }
    }
    let [place, rates, tilt] = wrong;
    place.below(3.5, "error of the place, deviations");
    rates.below(3.5, "error of the velocity, deviations");
    tilt.below(4.0, "error of the attitude, deviations");
    trim.below(1.0, "angle of attack from its trim of −16°, and sideslip, deg");
    let miss = get(&sim, "Ground.offset").xy();
    let told = (get(&sim, "Ground.offset") + errors(&sim)[0]).xy();
    println!(
        "at {:.1} s, {:.0} m: {:.0} m east, {:.0} m north of the aim; in its own coordinates {:.0} and {:.0} m; {:.1} g, {} reversals, {:.0} N s",
        sim.time(),
        number(&sim, "Ground.height"),
        miss.x,
        miss.y,
        told.x,
        told.y,
        greatest / 3150.0 / 9.80665,
        number(&sim, "Guidance.reversals"),
        number(&sim, "Impulse.y"),
    );
    assert_eq!(sim.phase(), "handed_over");
    assert!(told.norm() < 1200.0 && miss.norm() < 2500.0, "{told} {miss}");
    assert!((9.0..13.0).contains(&(greatest / 3150.0 / 9.80665)), "{greatest} N");
    assert!((1.0..=5.0).contains(&number(&sim, "Guidance.reversals")));
    // Of jets of 220 s: 12 kg.
    assert!((15e3..35e3).contains(&number(&sim, "Impulse.y")));
}

//! The entry of `sims/mars_edl`: a capsule that trims off its axis and is guided by its navigation.
use linkwork_runtime::Simulation;
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Quat, Vec3};

/// `aim` of the file.
const AIM: [f64; 3] = [0.996781, -0.0033254, -0.0800987];

use crate::common;
use common::{Worst, get, rotation, seconds, velocity};

/// Errors of position (m), velocity (m/s) and attitude (rad) of navigation, W: at the inertial unit's node.
fn errors(sim: &Simulation) -> [Vec3; 3] {
    let turned = rotation(sim, "stage");
    let arm = Vec3::z() * -0.6;
    let moved = turned * get(sim, "stage.angular").cross(&arm);
    let estimate = |name: &str| get(sim, &format!("Navigation.estimate.{name}"));
    let q = |lane| sim.get(&format!("Navigation.estimate.rotation.{lane}")).unwrap();
    let told = Quat::from_quaternion(Quaternion::new(q("w"), q("x"), q("y"), q("z")));
    [
        estimate("position") - get(sim, "stage.position") - turned * arm,
        estimate("velocity") - velocity(sim, "stage") - moved,
        (told * turned.inverse()).scaled_axis(),
    ]
}

/// From the target to the position where range control ends, east and north (m), as in the file.
fn aim() -> Vec3 {
    let target = Vec3::new(0.996_778_878, 0.0, -0.080_198_924).normalize();
    let aim = Vec3::new(AIM[0], AIM[1], AIM[2]).normalize();
    let east = Vec3::z().cross(&target).normalize();
    Vec3::new(aim.dot(&east), aim.dot(&target.cross(&east)), 0.0) * 3_391_690.0
}

/// Returns the errors divided by the filter's standard deviations; the filter does not estimate the scale factor of an instrument.
#[test]
fn a_capsule_is_guided_by_its_navigation_to_where_its_parachute_opens() {
    let mut sim =
        common::repository("mars_edl/sim.ron", &["Rover.Environment.spacing=0.25"]).unwrap();
    let number = |sim: &Simulation, name: &str| sim.get(name).unwrap();
    let mut wrong = [Worst(0.0); 3];
    let (mut trim, mut slip, mut bank, mut greatest) =
        (Worst(0.0), Worst(0.0), Worst(0.0), 0.0_f64);
    let mut reversals = 0.0;
    while sim.phase() != "straight" && sim.before(seconds(1000.0)) {
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
        reversals = number(&sim, "Guidance.reversals");
        greatest = greatest.max(number(&sim, "Aero.force"));
        if number(&sim, "Aero.dynamic_pressure") > 500.0 {
            trim.take((number(&sim, "Aero.alpha").to_degrees() + 16.0).abs());
            slip.take(number(&sim, "Aero.beta").to_degrees().abs());
            // The error counts between reversals only, because after a reversal the bank angle
            // needs up to ten seconds.
            let slewing = number(&sim, "Bank.error").abs() > 0.3;
            bank.take(if slewing { 0.0 } else { number(&sim, "Bank.error").abs() });
        }
    }
    let [place, rates, tilt] = wrong;
    place.below(3.5, "error of the place, deviations");
    rates.below(3.5, "error of the velocity, deviations");
    tilt.below(4.0, "error of the attitude, deviations");
    trim.below(0.35, "angle of attack from its trim of −16°, deg");
    slip.below(1.0, "sideslip, deg");
    // Range control ends at the aim point; the axes of the target, 14 km away, agree with W to a few mrad.
    let miss = (get(&sim, "Ground.offset") - aim()).xy();
    let told = miss + errors(&sim)[0].xy();
    println!(
        "at {:.1} s, {:.0} m: {:.0} m east, {:.0} m north of the aim; in its own coordinates {:.0} and {:.0} m; {:.1} g, {} reversals, {:.0} N s",
        sim.time(),
        number(&sim, "Ground.height"),
        miss.x,
        miss.y,
        told.x,
        told.y,
        greatest / 3150.0 / 9.80665,
        reversals,
        number(&sim, "Impulse.y"),
    );
    assert_eq!(sim.phase(), "straight");
    assert!(told.norm() < 1200.0 && miss.norm() < 2500.0, "{told} {miss}");
    assert!((greatest / 3150.0 / 9.80665 - 10.4).abs() < 0.05, "{greatest} N");
    assert_eq!(reversals, 3.0);
    assert!((number(&sim, "Impulse.y") / 1e3 - 20.7).abs() < 0.5);
}

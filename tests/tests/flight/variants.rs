//! Variants of simulations: an orbit raised and inclined by planned burns, a gravity turn down to the Moon.
use crate::common::{get, repository, seconds, velocity};

/// μ of the Earth, m³/s², as in the file; standard gravity, m/s².
const MU: f64 = 3.986_004_418e14;
const G0: f64 = 9.80665;

/// Two Hohmann burns and one of 2°, compared with impulses: apses and plane are reached, and the losses due to the finite burn time are small.
#[test]
fn a_plan_of_burns_raises_an_orbit_and_turns_it() {
    let mut sim = repository("earth_orbit/burns.ron", &[]).unwrap();
    let (r1, r2) = (6_778_137.0_f64, 7_178_137.0_f64);
    let number = |sim: &linkwork_runtime::Simulation, name: &str| sim.get(name).unwrap();
    let mut done = vec![];
    while sim.before(seconds(16_000.0)) {
        sim.step().unwrap();
        if number(&sim, "Plan.done") as usize > done.len() {
            let used = (1050.0 / (800.0 + number(&sim, "Tank.propellant"))).ln() * 318.0 * G0;
            println!(
                "burn {} done at {} s: {used:.3} m/s so far, {:.3} by {:.3} km, {:.4} deg",
                done.len() + 1,
                sim.time(),
                number(&sim, "Orbit.pericentre") / 1e3,
                number(&sim, "Orbit.apocentre") / 1e3,
                number(&sim, "Orbit.inclination").to_degrees()
            );
            done.push(used);
        }
    }
    assert_eq!(done.len(), 3, "{done:?}");
    let speed = |r: f64, other: f64| (2.0 * MU * (1.0 / r - 1.0 / (r + other))).sqrt();
    let first = speed(r1, r2) - speed(r1, r1);
    let second = speed(r2, r2) - speed(r2, r1);
    let third = 2.0 * speed(r2, r2) * 1f64.to_radians().sin();
    println!("impulses: {first:.3}, {second:.3}, {third:.3} m/s");
    for (found, want, most) in [
        (done[0], first, 1.02),
        (done[1] - done[0], second, 1.02),
        (done[2] - done[1], third, 1.04),
    ] {
        assert!(found > 0.99 * want && found < most * want, "{found} m/s for {want}");
    }
    let heights = ["Orbit.pericentre", "Orbit.apocentre"].map(|n| number(&sim, n) / 1e3);
    let inclination = number(&sim, "Orbit.inclination").to_degrees();
    println!("{heights:?} km, {inclination} deg, {} kg left", number(&sim, "Tank.propellant"));
    assert!(heights.iter().all(|h| (h - 800.0).abs() < 5.0), "{heights:?}");
    assert!((inclination - 53.6).abs() < 0.005, "{inclination}");
}

/// The closed form of a gravity turn from ignition on: constant force over weight, and the remaining speed.
#[test]
fn a_gravity_turn_comes_down_upright_on_the_moon() {
    let mut sim = repository("lunar_landing/gravity_turn.ron", &[]).unwrap();
    let number = |sim: &linkwork_runtime::Simulation, name: &str| sim.get(name).unwrap_or(0.0);
    let (mut lit, mut slow, mut held) = (None, None, Vec::new());
    while sim.phase() == "descent" {
        sim.step_event().unwrap();
        let row = ["Ground.height", "Ground.speed", "Ground.path_angle"].map(|n| number(&sim, n));
        let phase = number(&sim, "Guidance.phase");
        if phase == 1.0 {
            lit.get_or_insert(row);
            if row[1] > 15.0 {
                held.push(number(&sim, "Guidance.needed"));
            }
        }
        if phase == 2.0 {
            slow.get_or_insert(row);
        }
    }
    let (lit, slow) = (lit.unwrap(), slow.unwrap());
    let upright = -slow[2].to_degrees();
    let most = held.iter().fold(0.0_f64, |most, n| most.max((n / held[0] - 1.0).abs()));
    println!("lit at {lit:?}, slow at {slow:?}, {upright} deg; N {} to {most:e}", held[0]);
    // The thrust at ignition is 0.8 of 4.5 kN on a tonne, and g the local gravity.
    let g = 4.9028e12 / (1_735_400.0 + lit[0]).powi(2);
    assert!((held[0] / (0.8 * 4500.0 / (1000.0 * g)) - 1.0).abs() < 0.02, "{}", held[0]);
    assert!(most < 0.01 && held.len() > 1000, "{most}");
    assert!((slow[0] - 10.0).abs() < 3.0 && slow[1] < 2.0 && upright > 60.0, "{slow:?}");
    let left = number(&sim, "Tank.propellant");
    let spent = 287.0 * G0 * (1000.0 / (800.0 + left)).ln();
    println!("{left} kg left, {spent} m/s spent, lit at {} m/s", lit[1]);
    // The engine must remove the initial speed and the gravity loss: V + g t, with t from the mean
    // deceleration.
    assert!(spent > lit[1] && spent < 2.5 * lit[1]);
    let down = velocity(&sim, "lander");
    assert!((down.z + 1.5).abs() < 0.02 && down.xy().norm() < 0.05, "{down}");
    sim.run_until(seconds(200.0)).unwrap();
    let (crushed, speed) = (number(&sim, "Leg1.crushed"), number(&sim, "Ground.speed"));
    println!("crushed {crushed} m, {speed} m/s at {}", get(&sim, "lander.position"));
    assert!(crushed > 0.05 && crushed < 0.26 && speed < 1e-6, "{crushed} {speed}");
}

/// Reference: a pulse of two jets changes the rate by M t/J. In the limit cycle the spacecraft drifts across the deadband between two pulses, one way
/// with one rate and back with the rest of this change.
#[test]
fn jets_on_the_lines_of_a_phase_plane_fall_into_their_limit_cycle() {
    let mut sim = repository("attitude/jets.ron", &[]).unwrap();
    let (torque, pulse, inertia, deadband) = (2.0, 0.05, 120.0, 0.5_f64.to_radians());
    let bit = torque * pulse / inertia;
    sim.run_until(seconds(600.0)).unwrap();
    let number = |sim: &linkwork_runtime::Simulation, name: &str| sim.get(name).unwrap();
    let (before, from) = (number(&sim, "Plane.pulses"), number(&sim, "Impulse.y"));
    let (mut low, mut high, mut wide) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
    while sim.before(seconds(3600.0)) {
        sim.step().unwrap();
        let w = number(&sim, "Motion.rate.x");
        (low, high) = (low.min(w), high.max(w));
        wide = wide.max(number(&sim, "Angle.y").abs());
    }
    let pulses = number(&sim, "Plane.pulses") - before;
    let spent = number(&sim, "Impulse.y") - from;
    println!("{pulses} pulses, {spent} N s, rates {low:e} to {high:e} of {bit:e}, {wide} rad");
    // In each pulse two jets of 1 N are open for 50 ms.
    assert!((spent / pulses - 2.0 * pulse).abs() < 1e-9, "{spent} {pulses}");
    assert!(((high - low) / bit - 1.0).abs() < 0.02 && low < 0.0 && high > 0.0, "{low} {high}");
    // The rotation reverses where θ + 5 s ω reaches the deadband: earlier on the side towards which it is
    // faster.
    let slower = high.min(-low);
    assert!((wide / (deadband - 5.0 * slower) - 1.0).abs() < 0.01, "{wide}");
    let across = 2.0 * deadband - 5.0 * (high - low);
    let by_rates = 3000.0 / (0.5 * across * (1.0 / high + 1.0 / -low));
    println!("{by_rates} by the rates");
    assert!((pulses / by_rates - 1.0).abs() < 0.02, "{pulses} {by_rates}");
}

/// Thrust and flow are p/p₀ times their initial values, p = p₀ V₀/(V₀ + x/ρ) after x kg: ẋ (V₀ + x/ρ) = c V₀, so the tank is empty at (x + x²/(2 ρ
/// V₀))/c. The velocity gain is that of the rocket equation, along the spin axis.
#[test]
fn a_tank_that_blows_down_is_dry_when_the_closed_form_says() {
    let mut sim = repository("attitude/blow_down.ron", &[]).unwrap();
    let number = |sim: &linkwork_runtime::Simulation, name: &str| sim.get(name).unwrap();
    let (exhaust, ullage, density) = (225.0 * G0, 0.02, 1008.0);
    let by_closed_form = |x: f64| (x + x * x / (2.0 * density * ullage)) / (20.0 / exhaust);
    sim.run_until(seconds(3000.0)).unwrap();
    let used = 40.0 - number(&sim, "Tank.propellant");
    assert!((by_closed_form(used) / 3000.0 - 1.0).abs() < 1e-6, "{used}");
    while number(&sim, "Tank.outlet.available") > 0.5 {
        sim.step_event().unwrap();
    }
    let (dry, pressure) = (sim.time(), number(&sim, "Gas.pressure") / 1e5);
    let want = by_closed_form(40.0);
    let v = get(&sim, "Motion.velocity");
    let gained = exhaust * (340.0_f64 / 300.0).ln();
    println!(
        "dry at {dry} s ({want} s) at {pressure} bar; {v:?} m/s, {gained} m/s by the rocket equation"
    );
    assert!((dry / want - 1.0).abs() < 1e-6, "{dry} {want}");
    assert!((pressure / (24.0 * ullage / (ullage + 40.0 / density)) - 1.0).abs() < 1e-9);
    // The off-axis engine would tip it over without spin; the coning loss is negligible.
    assert!(v.z < gained && v.z > 0.999 * gained && v.xy().norm() < 0.02 * gained, "{v}");
}

/// A cube with a face normal to a flow of fast molecules with diffuse reflection: C_D = 2 + 1/S² + √π/S √(T_w/T) for the front face, 1/(√π S) for
/// each of the four side faces, S = V √(M/2RT). Per revolution it descends by 2 π C_D A ρ a²/m, and per day by more than sixteen times that, since
/// the density increases.
#[test]
fn a_cube_in_low_orbit_is_braked_as_free_molecules_do() {
    let mut sim = repository("earth_orbit/panels.ron", &[]).unwrap();
    let number = |sim: &linkwork_runtime::Simulation, name: &str| sim.get(name).unwrap();
    // The reference is the standard atmosphere at 300 km.
    let (density, r0, z) = (1.915_68e-11_f64, 6356.766_f64, 300.0_f64);
    let temperature = 1000.0 - 640.0 * (-0.018_75 * (z - 120.0) * (r0 + 120.0) / (r0 + z)).exp();
    let (radius, face, mass) = (6_678_137.0_f64, 0.1, 20.0);
    let speed = (MU / radius).sqrt();
    let ratio = speed * (0.0177 / (2.0 * 8.314_462_618 * temperature)).sqrt();
    let root = std::f64::consts::PI.sqrt();
    let ahead = 2.0 + 1.0 / (ratio * ratio) + root / ratio * (300.0 / temperature).sqrt();
    let coefficient = ahead + 4.0 / (root * ratio);
    let drag = 0.5 * density * speed * speed * face * coefficient;
    let felt = get(&sim, "Panels.load.force");
    println!("S {ratio}, C_D {coefficient}: {drag} N, felt {felt:?}");
    assert!((-felt.y / drag - 1.0).abs() < 1e-4 && felt.x.abs() + felt.z.abs() < 1e-9 * drag);
    // The semi-major axis of a circle decreases by ȧ = −2 D a/(m v).
    let turn = 2.0 * std::f64::consts::PI * radius / speed;
    let axis = |sim: &linkwork_runtime::Simulation| -0.5 * MU / number(sim, "Orbit.energy");
    sim.run_until(seconds((turn * 1e3).round() / 1e3)).unwrap();
    let lost = radius - axis(&sim);
    let want = 2.0 * drag / mass * radius / speed * turn;
    println!("{lost} m a turn, {want} m by the formula");
    assert!((lost / want - 1.0).abs() < 0.01, "{lost} {want}");
    sim.run_until(seconds(86_400.0)).unwrap();
    let (down, turned) = (radius - axis(&sim), number(&sim, "Panels.alpha_total").to_degrees());
    println!("{down} m in a day, {turned} deg off the stream");
    // A day has sixteen revolutions, and the air below is denser: 2 % per kilometre.
    assert!(down > 15.9 * lost && down < 17.5 * lost && turned < 5.0, "{down} {turned}");
}

//! Grousers: closed forms of the two ways in which soil fails, their limits, period and work.

use super::*;
use crate::terramechanics::{Motion, Shear, WheelForces, WheelSoil};
use crate::test_soils::{golden_wheel, lunar};

/// The golden wheel with grousers on its rim; the tips define the shear radius.
fn wheel(count: u32, height: f64, phase: f64) -> WheelSoil {
    let rim = golden_wheel().rim.radius;
    let mut w = golden_wheel();
    w.rim.radius = rim + height;
    w.grousers = Some(Grousers { count, height, tips: rim + height, phase });
    w
}

fn smooth(height: f64) -> WheelSoil {
    WheelSoil { grousers: None, ..wheel(1, height, 0.0) }
}

fn parts(f: WheelForces) -> [f64; 3] {
    [f.fx, f.fz, f.torque]
}

/// A bar of 25 cm by 12.5 cm in clay with c = 20 kPa, φ = 6°, γ = 15.7 kN/m³. By hand: N_φ = 1.2335, ½ γ h² N_φ = 151.3 N/m,
/// 2 c h √N_φ = 5553.2 N/m; a pressure of 10 kPa adds σ h N_φ = 1541.9 N/m.
#[test]
fn a_single_bar_pushes_with_the_passive_earth_pressure() {
    let clay = Soil { cohesion: 20e3, friction_angle: 6f64.to_radians(), ..lunar() };
    let push = |sigma: f64| passive(&clay, 15.7e3, [0.25, 0.125], sigma);
    assert!((push(0.0) - 0.25 * 5704.5).abs() < 0.5, "{}", push(0.0));
    assert!((push(10e3) - 0.25 * 7246.4).abs() < 0.5, "{}", push(10e3));
}

/// Bekker's factors for h/b = 0.1: 1.2 on cohesion, 1 + 0.064 atan 10 = 1.094152 on friction.
#[test]
fn a_block_between_two_bars_has_bekkers_strength() {
    let soil = Soil { cohesion: 500.0, friction_angle: 0.25_f64.atan(), ..lunar() };
    let strength = block(&soil, [0.1, 0.01], 8000.0);
    assert!((strength - (600.0 + 2000.0 * 1.094_152)).abs() < 2e-3, "{strength}");
    assert_eq!(block(&soil, [0.1, 0.0], 8000.0), 2500.0);
}

#[test]
fn forces_repeat_from_bar_to_bar() {
    let apart = TAU / 18.0;
    for motion in [Motion::rolling(0.4, 0.0), Motion::rolling(-0.3, 0.2)] {
        let at = |phase: f64| parts(wheel(18, 0.01, phase).forces(0.02, &motion));
        let (first, next, half) = (at(0.1), at(0.1 + apart), at(0.1 + 0.5 * apart));
        for k in 0..3 {
            assert!((first[k] - next[k]).abs() < 1e-9 * first[k].abs(), "{first:?} {next:?}");
            assert!((first[k] - half[k]).abs() > 1e-3 * first[k].abs(), "{first:?} {half:?}");
        }
    }
}

/// The mean over all angles of the wheel is the integral of the force of one bar along the arc, over the distance of the bars. The stresses are
/// written down here once more.
#[test]
fn the_mean_is_the_integral_of_the_force_of_one_bar() {
    let (z, s, b, h, count) = (0.02, 0.4, 0.1, 0.01, 9_u32);
    let motion = Motion::rolling(s, 0.0);
    let soil = lunar();
    let (r, tan): (f64, f64) = (0.16, soil.friction_angle.tan());
    let front = (1.0 - z / r).acos();
    let (rear, middle) = (-(1.0 - soil.lambda * z / r).acos(), (soil.a0 + soil.a1 * s) * front);
    let apart = TAU / f64::from(count);
    let n = ((45.0 + 16.5_f64).to_radians()).tan().powi(2);
    let bar = |theta: f64| {
        let mirrored = match theta >= middle {
            true => theta,
            false => front - (theta - rear) / (middle - rear) * (front - middle),
        };
        let depth = r * (mirrored.cos() - front.cos());
        let sigma = (soil.k_c / b + soil.k_phi) * depth;
        let h = depth.min(h);
        let alone = b * h * (0.5 * 1600.0 * 9.81 * h * n + sigma * n + 340.0 * n.sqrt());
        let rim = 170.0 + sigma * tan;
        let sides =
            170.0 * (1.0 + 2.0 * h / b) + sigma * tan * (1.0 + 0.64 * (h / b) * (b / h).atan());
        let tips = 0.15 + h;
        let block = b * apart * (tips.max(r) * sides - r * rim);
        let j = r * ((front - theta) - (1.0 - s) * (front.sin() - theta.sin()));
        alone.min(block) * (1.0 - (-j / soil.shear_modulus).exp())
    };
    let steps = 20_000;
    let width = (front - rear) / f64::from(steps);
    let (mut force, mut turn) = (0.0, 0.0);
    for k in 0..steps {
        let theta = rear + (f64::from(k) + 0.5) * width;
        force += bar(theta) * theta.cos() * width / apart;
        turn += r * bar(theta) * width / apart;
    }
    let plain = smooth(h).forces(z, &motion);
    let phases = 400;
    let (mut fx, mut torque) = (0.0, 0.0);
    for k in 0..phases {
        let f = wheel(count, h, apart * f64::from(k) / f64::from(phases)).forces(z, &motion);
        fx += (f.fx - plain.fx) / f64::from(phases);
        torque += (f.torque - plain.torque) / f64::from(phases);
    }
    assert!(force > 1.0 && turn > 0.1, "{force} {turn}");
    assert!((fx / force - 1.0).abs() < 2e-3, "{fx} {force}");
    assert!((torque / turn - 1.0).abs() < 2e-3, "{torque} {turn}");
}

#[test]
fn low_grousers_make_a_smooth_wheel_and_many_make_an_even_one() {
    let motion = Motion::rolling(0.5, 0.1);
    let plain = parts(golden_wheel().forces(0.02, &motion));
    let low = parts(wheel(24, 1e-9, 0.3).forces(0.02, &motion));
    for k in 0..3 {
        assert!((low[k] - plain[k]).abs() < 1e-6 * plain[k].abs(), "{low:?} {plain:?}");
    }
    let ripple = |count: u32| {
        let apart = TAU / f64::from(count);
        let at = |k: u32| wheel(count, 0.01, apart * f64::from(k) / 40.0).forces(0.02, &motion).fx;
        let all: Vec<f64> = (0..40).map(at).collect();
        all.iter().copied().fold(f64::NEG_INFINITY, f64::max)
            - all.iter().copied().fold(f64::INFINITY, f64::min)
    };
    let ripples = [12, 48, 192, 720].map(ripple);
    assert!(ripples[0] > 0.3 && ripples[3] < 0.02 * ripples[0], "{ripples:?}");
    assert!(ripples.windows(2).all(|r| r[1] < r[0]), "{ripples:?}");
}

/// Sheared to its limit, cohesionless soil below a wheel with many grousers pulls Bekker's 1 + 0.64 (h/b) atan(b/h) times as hard. Only at the ends
/// of the arc, where the pressure is small, the bars are not completely in the ground.
#[test]
fn closely_spaced_grousers_pull_as_bekker_has_it() {
    let soil = Soil { cohesion: 0.0, shear_modulus: 1e-6, ..lunar() };
    let motion = Motion::rolling(0.9, 0.0);
    for (h, factor) in [(0.001, 1.009_989), (0.002, 1.019_850)] {
        let many = WheelSoil { soil, ..wheel(720, h, 0.0) }.forces(0.03, &motion);
        let plain = WheelSoil { soil, ..smooth(h) }.forces(0.03, &motion);
        let ratio = many.torque / plain.torque;
        assert!((ratio - factor).abs() < 0.03 * (factor - 1.0), "{h}: {ratio} {factor}");
    }
}

/// The soil takes at least the work that it takes from the same wheel without grousers; in skid and in a slip angle as well.
#[test]
fn grousers_never_drive_the_wheel() {
    let mut more = 0;
    for k in 0..4000_u32 {
        let part = |step: u32, of: u32| f64::from(k / step % of) / f64::from(of - 1);
        let (s, beta) = (-0.95 + 1.94 * part(1, 25), -0.7 + 1.4 * part(25, 8));
        let (z, phase) = (0.002 + 0.1 * part(200, 5), part(1000, 4));
        let motion = Motion::rolling(s, beta);
        let w = wheel(15, 0.02, phase);
        let r = w.rim.radius;
        // At 1 rad/s, v_x = r (1 − s) with the slip of the stresses, and v_y = r · lateral.
        let work =
            |f: WheelForces| f.torque - f.fx * r * (1.0 - motion.slip) - f.fy * r * motion.lateral;
        let [with, without] = [w, smooth(0.02)].map(|w| work(w.forces(z, &motion)));
        assert!(with >= without - 1e-9 * without.abs(), "{s} {beta} {z}: {with} {without}");
        more += u32::from(with > without + 1e-6);
    }
    assert!(more > 3000, "{more}");
}

#[test]
fn grousers_higher_than_the_radius_are_rejected() {
    let of = |height: f64| Some(GrouserParams { count: 24, height, share: 0.5 });
    assert!(check(0.25, &None).is_ok() && check(0.25, &of(0.01)).is_ok());
    let told = check(0.25, &of(0.3)).unwrap_err();
    assert!(told.message.contains("0.3 m high are higher than the radius of 0.25 m"), "{told:?}");
    assert_eq!((shear_radius(0.25, &None), shear_radius(0.25, &of(0.02))), (0.25, 0.26));
    // Both shear laws accept grousers.
    let independent = Shear::Independent { k_x: [0.0, 0.018], k_y: [0.0, 0.018] };
    let motion = Motion::rolling(0.4, 0.1);
    let pull = |w: WheelSoil| WheelSoil { shear: independent, ..w }.forces(0.02, &motion).fx;
    assert!(pull(wheel(18, 0.01, 0.0)) > pull(smooth(0.01)));
}

//! Stresses and forces of a wheel on soil against published and measured values.

use super::*;
use crate::test_soils::*;
use linkwork_spatial::nalgebra::{DMatrix, DVector};
use linkwork_surroundings::Soil;

fn at(w: &WheelSoil, load: f64, s: f64, beta_deg: f64) -> (f64, WheelForces) {
    let m = Motion::rolling(s, beta_deg.to_radians());
    let z = w.sinkage_under(load, &m).expect("the soil carries the load");
    (z, w.forces(z, &m))
}

/// Rows: slip, slip angle (deg) and what the page gives, to the digits given.
fn close(got: f64, want: f64, digits: i32, what: &str) {
    let tolerance = 0.51 * 10f64.powi(-digits);
    assert!((got - want).abs() <= tolerance, "{what}: {got} instead of {want}");
}

#[test]
fn straight_driving_matches_an_independent_code() {
    let rows = [
        (0.0, 19.460, -1.00353, 1.595494),
        (0.1, 19.645, 13.39794, 3.830330),
        (0.2, 19.821, 22.98745, 5.330925),
        (0.4, 20.203, 33.84910, 7.069681),
        (0.6, 20.664, 38.97604, 7.945018),
        (0.8, 21.217, 41.41025, 8.420862),
    ];
    for (s, z_mm, fx, torque) in rows {
        let (z, f) = at(&golden_wheel(), 100.0, s, 0.0);
        close(z * 1e3, z_mm, 3, "sinkage");
        close(f.fx, fx, 5, "drawbar pull");
        close(f.torque, torque, 6, "torque");
        close(f.fz, 100.0, 9, "load");
    }
}

#[test]
fn isotropic_shear_matches_an_independent_code() {
    let rows = [
        (0.1, 20.0, 2.81426, 43.25629),
        (0.2, 20.0, 14.36330, 37.84901),
        (0.4, 20.0, 30.37030, 24.67731),
        (0.6, 20.0, 37.96765, 14.05557),
        (0.8, 20.0, 41.24044, 6.78731),
        (0.2, 10.0, 19.79931, 22.04107),
        (0.4, 30.0, 26.50339, 35.64976),
    ];
    for (s, beta, fx, fy) in rows {
        let (_, f) = at(&golden_wheel(), 100.0, s, beta);
        close(f.fx, fx, 5, "drawbar pull");
        close(f.fy, -fy, 5, "side force");
    }
}

#[test]
fn independent_shear_matches_an_independent_code() {
    let shear = Shear::Independent { k_x: [0.0, 0.018], k_y: [0.0, 0.018] };
    let w = WheelSoil { shear, ..golden_wheel() };
    let rows =
        [(0.1, 43.47390), (0.2, 40.61475), (0.4, 33.95518), (0.6, 25.77029), (0.8, 15.40737)];
    for (s, fy) in rows {
        close(at(&w, 100.0, s, 20.0).1.fy, -fy, 5, "side force");
    }
}

#[test]
fn ishigami_case_matches_an_independent_code() {
    let w = WheelSoil {
        rim: Rim { radius: 0.09, width: 0.11 },
        soil: ishigami_simulant(),
        shear: Shear::Independent { k_x: [0.043, 0.036], k_y: [0.020, 0.013] },
        sinkage: Sinkage::Bekker,
        gravity: 9.81,
        approach: None,
        grousers: None,
    };
    let turned =
        [(0.1, 2.713, 27.356), (0.3, 10.463, 23.406), (0.5, 16.571, 18.567), (0.7, 21.337, 12.722)];
    for (s, pull, fy) in turned {
        let (_, f) = at(&w, 64.68, s, 15.0);
        close(f.fx, pull, 3, "drawbar pull");
        close(f.fy, -fy, 3, "side force");
    }
    let straight = [
        (0.0, -0.866),
        (0.1, 5.000),
        (0.2, 10.057),
        (0.3, 14.396),
        (0.5, 21.267),
        (0.7, 26.241),
        (0.9, 29.813),
    ];
    for (s, pull) in straight {
        close(at(&w, 64.68, s, 0.0).1.fx, pull, 3, "drawbar pull");
    }
    close(at(&w, 64.68, 0.0, 0.0).0 * 1e3, 15.07, 2, "sinkage");
    close(at(&w, 64.68, 0.9, 0.0).0 * 1e3, 17.30, 2, "sinkage");
}

#[test]
fn public_code_agrees_to_nine_digits() {
    // Reference: RoSE-lab code (quad) with r .15, b .10, z .02, s .3; c 170, φ 33°, K .018.
    let f = golden_wheel().forces(0.02, &Motion::rolling(0.3, 0.0));
    close(f.fz, 99.967897801, 8, "load");
    close(f.fx, 29.435818268, 8, "drawbar pull");
    close(f.torque, 6.353369400, 8, "torque");
}

#[test]
fn load_grows_with_sinkage_and_pull_grows_with_slip() {
    for beta in [0.0, 0.2, -0.5] {
        let mut last = 0.0;
        for i in 1..60 {
            let fz = golden_wheel().forces(0.001 * f64::from(i), &Motion::rolling(0.25, beta)).fz;
            assert!(fz > last, "F_z falls at {i} mm: {fz} after {last}");
            last = fz;
        }
        let mut last = f64::NEG_INFINITY;
        for i in -8..=19 {
            let (_, f) = at(&golden_wheel(), 100.0, 0.05 * f64::from(i), beta);
            assert!(f.fx > last, "pull falls at slip {}: {}", 0.05 * f64::from(i), f.fx);
            last = f.fx;
        }
    }
    for i in 1..9 {
        assert!(at(&golden_wheel(), 100.0, -0.1 * f64::from(i), 0.0).1.fx < 0.0);
    }
}

#[test]
fn left_and_right_are_mirror_images() {
    for s in [-0.6, -0.2, 0.0, 0.3, 0.9] {
        let (za, a) = at(&golden_wheel(), 100.0, s, 0.35);
        let (zb, b) = at(&golden_wheel(), 100.0, s, -0.35);
        assert!((za - zb).abs() < 1e-12);
        assert!((a.fy + b.fy).abs() < 1e-10 && a.fy < 0.0);
        assert!((a.fx - b.fx).abs() < 1e-10 && (a.mx + b.mx).abs() < 1e-10);
        assert!((a.mz + b.mz).abs() < 1e-10 && (a.torque - b.torque).abs() < 1e-10);
    }
}

#[test]
fn drive_power_pays_for_pull_and_dissipation() {
    // Power at ω = 1 rad/s: T = v F_x + v_y F_y + D with D ≥ 0.
    for s in [0.05, 0.2, 0.5, 0.8] {
        for beta in [0.0, 0.2, 0.5_f64] {
            let (_, f) = at(&golden_wheel(), 100.0, s, beta.to_degrees());
            let vx = 0.15 * (1.0 - s);
            let lost = f.torque - vx * f.fx - vx * beta.tan() * f.fy;
            assert!(lost > 0.0, "slip {s}, beta {beta}: {lost}");
        }
    }
}

#[test]
fn frictionless_wheel_pays_exactly_the_compaction_work() {
    // With c = φ = 0, θ_r = 0 and a₀ = a₁ = 0, F_x = −R_c = −b k z^(n+1)/(n+1), which is exact for
    // p = k zⁿ.
    for n in [1.0, 0.8, 1.1] {
        let soil = Soil {
            n,
            cohesion: 0.0,
            friction_angle: 0.0,
            lambda: 0.0,
            a0: 0.0,
            a1: 0.0,
            ..lunar()
        };
        let w = WheelSoil { soil, ..golden_wheel() };
        let z: f64 = 0.02;
        let want = -0.10 * w.modulus(n) * z.powf(n + 1.0) / (n + 1.0);
        let got = w.forces(z, &Motion::rolling(0.3, 0.0)).fx;
        let tolerance = if n == 1.0 { 1e-12 } else { 3e-4 };
        assert!((got / want - 1.0).abs() < tolerance, "n {n}: {got} {want}");
    }
}

#[test]
fn bekkers_towed_wheel_formula_is_a_few_percent_low() {
    for n in [0.8, 1.0, 1.1] {
        let soil = Soil {
            n,
            cohesion: 0.0,
            friction_angle: 0.0,
            lambda: 0.0,
            a0: 0.0,
            a1: 0.0,
            ..lunar()
        };
        let w = WheelSoil { soil, ..golden_wheel() };
        let load: f64 = 40.0;
        let z = w.sinkage_under(load, &Motion::rolling(0.3, 0.0)).unwrap();
        let base = 3.0 * load / (0.10 * (3.0 - n) * w.modulus(n) * 0.30f64.sqrt());
        let bekker = base.powf(2.0 / (2.0 * n + 1.0));
        // The source states 2 to 4 % low. Measured here: 0.5 % high for n = 1.1.
        assert!((0.95..1.01).contains(&(bekker / z)), "n {n}: {bekker} {z}");
    }
}

#[test]
fn reece_load_scales_with_gravity_and_bekker_does_not() {
    let soil = Soil { cohesion: 0.0, ..lunar() };
    let under = |gamma| {
        let w = WheelSoil { soil, sinkage: Sinkage::Reece { gamma }, ..golden_wheel() };
        w.modulus(1.0)
    };
    assert!((under(6000.0) / under(3000.0) - 2.0).abs() < 1e-12);
}

#[test]
fn forces_are_continuous_through_every_change_of_regime() {
    let w = golden_wheel();
    let base = [0.02, 0.0, 0.0, 1.0];
    let eval = |v: [f64; 4]| {
        let m = Motion { slip: v[1], lateral: v[2], rolling: v[3], beta: 0.0 };
        w.forces(v[0], &m)
    };
    // Vary the slip from hard skid to spinning, at several low speeds.
    for rolling in [0.0, 0.3, 1.0] {
        for lateral in [0.05, 0.3] {
            let mut last = eval([base[0], -3.0, lateral, rolling]);
            for i in 1..=8000 {
                let slip = -3.0 + 5e-4 * f64::from(i);
                let f = eval([base[0], slip, lateral, rolling]);
                let jump = (f.fx - last.fx).abs() + (f.fy - last.fy).abs() + (f.fz - last.fz).abs();
                assert!(jump < 1.0, "jump of {jump} N at slip {slip}, rolling {rolling}");
                last = f;
            }
        }
    }
}

#[test]
fn a_wheel_at_rest_is_symmetric() {
    let m = Motion { slip: 0.0, lateral: 0.0, rolling: 0.0, beta: 0.0 };
    let f = golden_wheel().forces(0.02, &m);
    assert!(f.fx.abs() < 1e-12 && f.torque.abs() < 1e-12 && f.fz > 0.0);
}

#[test]
fn a_load_beyond_the_soil_is_refused() {
    let m = Motion::rolling(0.1, 0.0);
    assert!(golden_wheel().sinkage_under(1e9, &m).is_none());
    assert!(golden_wheel().sinkage_under(f64::NAN, &m).is_none());
    assert_eq!(golden_wheel().sinkage_under(0.0, &m), Some(0.0));
}

/// A row of the measurements: slip angle (deg), slip, load (N), and F_x (N), F_y (N), z (mm).
type Measured = ([f64; 3], [f64; 3]);

/// The driven rows whose slip angle is one of `betas`. Without the reference data the test is skipped; with `CI=true` it fails.
fn measured(betas: &[f64]) -> Option<Vec<Measured>> {
    let path = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/reference/terramechanics/cmu_smooth_mean.csv"
    );
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(e) if std::env::var("CI").is_ok_and(|v| v == "true") => panic!("{path}: {e}"),
        Err(_) => {
            println!("SKIPPED: reference data absent");
            return None;
        }
    };
    let row = |line: &str| -> Vec<f64> { line.split(',').map(|x| x.parse().unwrap()).collect() };
    let rows = text.lines().skip(1).map(row).filter(|v| betas.contains(&v[0]) && v[2] >= 0.15);
    Some(rows.map(|v| ([v[0], v[2], v[8]], [v[4], v[6], v[10]])).collect())
}

/// Errors of F_x (N), F_y (N) and z (mm) of a row; `None` when the soil does not carry its load.
fn errors(w: &WheelSoil, ([beta, slip, load], want): &Measured) -> Option<[f64; 3]> {
    let m = Motion::rolling(*slip, beta.to_radians());
    let z = w.sinkage_under(*load, &m)?;
    let f = w.forces(z, &m);
    Some([f.fx - want[0], -f.fy - want[1], z * 1e3 - want[2]])
}

/// Root mean square errors over rows.
fn rms(w: &WheelSoil, rows: &[Measured]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for row in rows {
        let e = errors(w, row).unwrap();
        sum.iter_mut().zip(e).for_each(|(s, e)| *s += e * e);
    }
    assert!(!rows.is_empty());
    sum.map(|s| (s / rows.len() as f64).sqrt())
}

/// Root mean square errors (F_x N, F_y N, z mm) over the driven rows of the measurements whose
/// slip angle is one of `betas`, with the load of each row.
fn rms_against_measurements(w: &WheelSoil, betas: &[f64]) -> Option<[f64; 3]> {
    measured(betas).map(|rows| rms(w, &rows))
}

/// The smooth wheel of the measurements on a soil of nine numbers: ln k_φ, n, n₁, ln c, φ, ln K, a₀, a₁, λ.
fn smooth_wheel(x: &[f64; 9]) -> WheelSoil {
    let soil = Soil {
        k_c: 0.0,
        k_phi: x[0].exp(),
        n: x[1],
        n1: x[2],
        cohesion: x[3].exp(),
        friction_angle: x[4],
        shear_modulus: x[5].exp(),
        a0: x[6],
        a1: x[7],
        lambda: x[8],
        ..silica_sand()
    };
    let approach = Some((45.0f64 - 14.5).to_radians());
    WheelSoil { rim: Rim { radius: 0.058, width: 0.05 }, soil, approach, ..golden_wheel() }
}

/// Least squares over rows by Levenberg's method, from a soil that is not this one.
fn fitted(rows: &[Measured], start: [f64; 9]) -> [f64; 9] {
    // Weight the residuals so that 1 N of force counts as much as 5 mm of sinkage.
    let residuals = |x: &[f64; 9]| -> Option<DVector<f64>> {
        let w = smooth_wheel(x);
        let all: Option<Vec<_>> = rows.iter().map(|row| errors(&w, row)).collect();
        let all = all?.into_iter().flat_map(|[a, b, z]| [a, b, 0.2 * z]);
        Some(DVector::from_iterator(3 * rows.len(), all))
            .filter(|r| r.iter().all(|r| r.is_finite()))
    };
    let mut x = start;
    let mut r = residuals(&x).unwrap();
    let mut damping = 1e-2;
    for _ in 0..200 {
        let mut slopes = DMatrix::zeros(r.len(), 9);
        for k in 0..9 {
            let mut moved = x;
            moved[k] += 1e-5;
            slopes.set_column(k, &((residuals(&moved).unwrap() - &r) / 1e-5));
        }
        let normal = slopes.transpose() * &slopes;
        let held = &normal + DMatrix::from_diagonal(&normal.diagonal()) * damping;
        let held = held + DMatrix::identity(9, 9) * 1e-9;
        let step = held.cholesky().unwrap().solve(&(-slopes.transpose() * &r));
        let mut next = x;
        (0..9).for_each(|k| next[k] += step[k].clamp(-0.3, 0.3));
        // Reject parameters that no soil can have.
        let sane = next[1] > 0.3 && next[2] > -0.5 && (0.1..0.8).contains(&next[4]);
        let sane = sane && (0.05..0.95).contains(&next[6]) && (0.0..1.0).contains(&next[8]);
        match residuals(&next).filter(|_| sane) {
            Some(better) if better.norm() < r.norm() => {
                (x, r, damping) = (next, better, (0.3 * damping).max(1e-9));
            }
            _ => damping = (4.0 * damping).min(1e12),
        }
    }
    x
}

#[test]
fn fitted_to_one_half_of_the_measurements_it_predicts_the_other() {
    let (Some(half), Some(other)) = (measured(&[0.0, 30.0]), measured(&[15.0, 45.0])) else {
        return;
    };
    // Start from dry sand of the literature (Iagnemma).
    let (k_phi, c, shear) = (1.5234e6_f64, 1000.0_f64, 0.025_f64);
    let start = [k_phi.ln(), 1.1, 0.0, c.ln(), 30f64.to_radians(), shear.ln(), 0.4, 0.15, 0.5];
    let x = fitted(&half, start);
    let (before, fit) = (rms(&smooth_wheel(&start), &half), rms(&smooth_wheel(&x), &half));
    let told = rms(&smooth_wheel(&x), &other);
    println!("dry sand {before:.2?}; fitted {fit:.2?} on {} rows: {x:.3?}", half.len());
    println!(
        "predicts {} rows to F_x {:.2} N, F_y {:.2} N, z {:.2} mm",
        other.len(),
        told[0],
        told[1],
        told[2]
    );
    assert!(fit[0] < 0.6 && fit[1] < 0.6 && fit[2] < 3.0, "{fit:?}");
    // Measured: the fit has errors of 0.36 N, 0.32 N and 1.9 mm, and predicts to 0.51 N, 0.65 N and 3.0 mm; λ is at the
    // end of its range. An independent fit of the same kind predicts to 0.60 N, 1.08 N and 4.8 mm.
    assert!(told[0] <= 0.8 && told[1] <= 1.3 && told[2] <= 5.5, "{told:?}");
}

#[test]
fn measured_smooth_wheel_is_reproduced() {
    // The constants of the fit are published. The angle of approach belongs to the sand's own φ of
    // 29°.
    // Slip is measured along the heading: 1 − v_x/(rω), v_y = v_x tan β. The measured loads are
    // used row by row.
    let w = WheelSoil {
        rim: Rim { radius: 0.058, width: 0.05 },
        soil: silica_sand(),
        approach: Some((45.0f64 - 14.5).to_radians()),
        ..golden_wheel()
    };
    let Some(rms) = rms_against_measurements(&w, &[0.0, 15.0, 30.0, 45.0]) else {
        return;
    };
    println!("RMS: F_x {:.3} N, F_y {:.3} N, z {:.3} mm", rms[0], rms[1], rms[2]);
    close(rms[0], 0.52, 2, "RMS of F_x");
    close(rms[1], 0.45, 2, "RMS of F_y");
    close(rms[2], 2.5, 1, "RMS of z");
    let ishigami = Shear::Independent { k_x: [0.0, 0.0147], k_y: [0.0, 0.0147] };
    let rms = rms_against_measurements(&WheelSoil { shear: ishigami, ..w }, &[15.0, 30.0, 45.0]);
    println!("independent shear: {rms:?}");
    assert!(rms.unwrap()[1] > 0.9, "independent shear is known to overshoot: {rms:?}");
}

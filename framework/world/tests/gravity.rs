//! Gravity: golden numbers, gradient of the potential, Laplace, poles, an independent evaluator,
//! tides, third bodies.

use crate::support::*;
use linkwork_world::gravity::*;
use linkwork_world::spatial::{Mat3, Quat, Vec3};

fn ggm03s(degree: usize) -> Option<Coefficients> {
    let text = reference("gravity/basilisk_GGM03S.txt")?;
    Some(read(Format::Basilisk, "GGM03S", &text, Keep::Degree(degree)).unwrap())
}

/// A field without zeros and without symmetry.
fn random_field(degree: usize, order: usize, seed: u64) -> Coefficients {
    let mut random = Random(seed);
    let mut field = Coefficients::new(3.986004415e14, 6378136.3, degree, order).unwrap();
    for n in 1..=degree {
        for m in 0..=order.min(n) {
            let k = 1e-3 / (n * n) as f64;
            let s = if m == 0 { 0.0 } else { random.between(-k, k) };
            field.set(n, m, random.between(-k, k), s).unwrap();
        }
    }
    field
}

/// Computes V by associated Legendre functions with their factor cosᵐφ, in latitude and longitude, which shares only the definition with the code
/// under test.
fn potential_by_angles(field: &Coefficients, p: &Vec3) -> f64 {
    let (r, phi) = (p.norm(), (p.z / p.norm()).asin());
    let lambda = p.y.atan2(p.x);
    let (sin, cos) = phi.sin_cos();
    let mut sum = 0.0;
    for m in 0..=field.order() {
        // Compute unnormalised P_mm = (2m−1)!! cosᵐ, and then increase the degree.
        let mut last = (1..=m).fold(1.0, |p, k| p * (2 * k - 1) as f64 * cos);
        let mut before = 0.0;
        for n in m..=field.degree() {
            if n > m {
                let (nf, mf) = (n as f64, m as f64);
                let now = ((2.0 * nf - 1.0) * sin * last - (nf + mf - 1.0) * before) / (nf - mf);
                (before, last) = (last, now);
            }
            let (c, s) = field.get(n, m);
            let angle = m as f64 * lambda;
            let k = (field.radius / r).powi(n as i32) * normalisation(n, m);
            sum += k * last * (c * angle.cos() + s * angle.sin());
        }
    }
    field.mu / r * sum
}

/// Reference: GGM03S 20 × 20, checked there with 40 digits.
#[test]
fn ggm03s_gives_the_golden_numbers() {
    let Some(field) = ggm03s(20) else { return };
    let field = Harmonics::new(&field);
    let p = Vec3::new(4293652.41, -3955168.47, 3139356.57);
    let g = field.full(&p);
    let a = Vec3::new(-5.875854209940406, 5.412952212885677, -4.309099908085214);
    near3(&g.acceleration, &a, 4e-14, "acceleration");
    near(g.potential, 60145999.76783, 6e-6, "potential");
    assert_eq!(g.acceleration, field.acceleration(&p));
    assert_eq!(g.potential, field.potential(&p));
    let Some(golden) = golden() else { return };
    let cases = golden["gravity_GGM03S_20x20_body_fixed"].as_array().unwrap();
    assert_eq!(cases.len(), 3);
    for case in cases {
        let g = field.full(&vec3(&case["r_m"]));
        near3(&g.acceleration, &vec3(&case["acc_ms2"]), 2e-14, "acceleration, one is at the pole");
        relative(g.potential, number(&case["potential"]), 1e-15, "potential");
    }
}

#[test]
fn potential_agrees_with_legendre_functions_of_latitude() {
    let mut random = Random(1);
    for (degree, order) in [(1, 0), (2, 2), (3, 1), (5, 5), (20, 20), (21, 14), (40, 40)] {
        let field = random_field(degree, order, 7 + degree as u64);
        let ready = Harmonics::new(&field);
        for _ in 0..20 {
            let p = random.on_sphere(6.6e6);
            let V = potential_by_angles(&field, &p);
            relative(ready.potential(&p), V, 2e-14, &format!("{degree} × {order} at {p:?}"));
        }
    }
}

#[test]
fn acceleration_is_the_slope_of_the_potential_and_the_gradient_that_of_the_acceleration() {
    let mut random = Random(2);
    for (degree, order) in [(0, 0), (2, 0), (4, 3), (20, 20), (50, 33)] {
        let field = Harmonics::new(&random_field(degree, order, 3));
        for _ in 0..10 {
            let p = random.on_sphere(7e6);
            let g = field.full(&p);
            // Compare with differences of fourth order. Measured: 1e-9 and 4e-10 of the largest
            // entry.
            let a = gradient(|p| field.potential(p), &p, 2e3);
            near3(&g.acceleration, &a, 1e-8 * a.norm(), "a = ∂V/∂x");
            let H = slope(|p| field.acceleration(p), &p, 2e3);
            near33(&g.gradient, &H, 1e-8 * H.norm(), "∂a/∂x");
        }
    }
}

#[test]
fn the_gradient_is_symmetric_and_free_of_trace() {
    let mut random = Random(3);
    let field = Harmonics::new(&random_field(60, 60, 4));
    for _ in 0..50 {
        let H = field.full(&random.on_sphere(6.5e6)).gradient;
        near(H.trace(), 0.0, 1e-14 * H.norm(), "Laplace");
        near33(&H, &H.transpose(), 1e-15 * H.norm(), "symmetry");
    }
}

/// At a pole, next to it, and as the limit of its neighbourhood.
#[test]
fn the_poles_are_places_like_others() {
    let field = Harmonics::new(&random_field(70, 70, 5));
    for z in [6.7e6, -6.7e6] {
        let pole = field.full(&Vec3::new(0.0, 0.0, z));
        assert!(pole.gradient.iter().all(|x| x.is_finite()));
        for k in 0..8 {
            let (s, c) = (f64::from(k) * 0.8).sin_cos();
            let g = field.full(&Vec3::new(1e-3 * c, 1e-3 * s, z));
            let expected = pole.acceleration + pole.gradient * Vec3::new(1e-3 * c, 1e-3 * s, 0.0);
            near3(&g.acceleration, &expected, 2e-14, "one millimetre beside the pole");
        }
        let H = slope(|p| field.acceleration(p), &Vec3::new(0.0, 0.0, z), 2e3);
        near33(&pole.gradient, &H, 1e-8 * H.norm(), "∂a/∂x at the pole");
    }
}

/// Rotating the coefficients of order m by an angle about z rotates the field.
#[test]
fn turning_the_coefficients_turns_the_field() {
    let field = random_field(17, 17, 6);
    let angle: f64 = 0.7;
    let mut turned = field.clone();
    for n in 1..=17 {
        for m in 1..=n {
            let ((c, s), (sin, cos)) = (field.get(n, m), (m as f64 * angle).sin_cos());
            turned.set(n, m, c * cos - s * sin, s * cos + c * sin).unwrap();
        }
    }
    let R = Quat::from_axis_angle(&Vec3::z_axis(), angle);
    let p = Vec3::new(4e6, -3e6, 4.5e6);
    let (a, b) = (Harmonics::new(&field), Harmonics::new(&turned));
    near3(&(R * a.acceleration(&p)), &b.acceleration(&(R * p)), 2e-14, "turned by 0.7 rad");
}

/// High degrees near the pole, where functions without cosᵐφ are as large as 1e73.
#[test]
fn degree_360_stays_finite_and_harmonic() {
    let field = Harmonics::new(&random_field(360, 360, 8));
    let mut random = Random(9);
    let mut places: Vec<Vec3> = (0..10).map(|_| random.on_sphere(6378136.3)).collect();
    places.extend([1.0, 100.0, 1e4, 1e5].map(|x| Vec3::new(x, -0.3 * x, 6378136.3)));
    for p in places {
        let g = field.full(&p);
        near(g.gradient.trace(), 0.0, 1e-12 * g.gradient.norm(), &format!("trace at {p:?}"));
        let a = gradient(|p| field.potential(p), &p, 500.0);
        near3(&g.acceleration, &a, 1e-6 * a.norm(), "a = ∂V/∂x");
    }
}

#[test]
fn an_evaluation_takes_no_memory() {
    let field = Harmonics::new(&random_field(30, 30, 10));
    let p = Vec3::new(4e6, -3e6, 4.5e6);
    let info = allocation_counter::measure(|| {
        assert!(field.full(&p).potential > 0.0);
    });
    assert_eq!(info.count_total, 0);
}

#[test]
fn closed_forms_agree_with_harmonics() {
    let (mu, R) = (4.2828372e13, 3396190.0);
    let j = [1.9566e-3, 3.1e-5, -1.5e-5, 2.2e-5];
    let field = Harmonics::new(&Coefficients::zonal(mu, R, &j).unwrap());
    let ball = Harmonics::new(&Coefficients::new(mu, R, 0, 0).unwrap());
    let mut random = Random(11);
    for _ in 0..20 {
        let p = random.on_sphere(3.6e6);
        near3(&zonal(mu, R, &j, &p), &field.acceleration(&p), 2e-15 * 3.3, "zonal");
        let g = ball.full(&p);
        near3(&point_mass(mu, &p), &g.acceleration, 2e-15 * 3.3, "point mass");
        near33(&point_mass_gradient(mu, &p), &g.gradient, 1e-14 * g.gradient.norm(), "gradient");
    }
    near(Coefficients::zonal(mu, R, &j).unwrap().j(2), j[0], 1e-18, "J2");
}

/// Energy in rotating axes (Jacobi's integral) of an orbit in a random field, Runge–Kutta 4: its drift decreases by 2⁴ or more if the step is halved.
#[test]
fn energy_is_kept_at_the_order_of_the_integrator() {
    let field = Harmonics::new(&random_field(12, 12, 12));
    let drift = |steps: u32| {
        let h = 3000.0 / f64::from(steps);
        let mut x = (Vec3::new(7.2e6, 1e5, -2e5), Vec3::new(100.0, 5500.0, 5000.0));
        let energy = |x: &(Vec3, Vec3)| x.1.norm_squared() / 2.0 - field.potential(&x.0);
        let E = energy(&x);
        for _ in 0..steps {
            x = rk4(|_, p, _| field.acceleration(p), 0.0, x, h);
        }
        (energy(&x) - E).abs() / E.abs()
    };
    let (coarse, fine) = (drift(100), drift(200));
    assert!(coarse < 1e-5 && coarse / fine > 12.0, "{coarse:e}, {fine:e}");
}

/// Reference data quick_golden.json, third_body.
#[test]
fn third_body_is_exact_where_differences_are_not() {
    let r = Vec3::new(6778137.0, 1200000.0, -900000.0);
    let s = Vec3::new(388253608.33634883, 54719243.155547604, 53485455.28339934);
    let exact = Vec3::new(1.0477508278232455e-06, 1.2728961134523447e-07, 2.9703381763644265e-07);
    let mu = 4902800118000.0;
    let a = third_body(mu, &r, &s);
    // The reference has an accuracy of 2e-22.
    assert!((a - exact).norm() < 2.5e-22, "Battin: {:e}", (a - exact).norm());
    let plain = indirect(mu, &(s - r)) - indirect(mu, &s);
    assert!((plain - exact).norm() < 1e-19, "the plain difference is the same thing: {plain:?}");
    assert!((plain - exact).norm() > 10.0 * (a - exact).norm(), "and less exact");
}

/// quick_golden.json, gravity_gradient. Each is the derivative of its acceleration, symmetric, and has zero trace, like that of a harmonic field.
#[test]
fn gradients_for_variational_equations_are_slopes() {
    let mu = 4e14;
    let j = [1e-3, -2e-3, 3e-3, 1e-3];
    let (s, R) = (Vec3::new(3e8, -1e8, 2e8), 6.4e6);
    let raiser = TideRaiser { mu: 5e12, position: s };
    type Pair<'a> =
        (&'a str, &'a dyn Fn(&Vec3) -> Vec3, &'a dyn Fn(&Vec3) -> linkwork_world::spatial::Mat3);
    let all: [Pair<'_>; 4] = [
        ("point mass", &|p| point_mass(mu, p), &|p| point_mass_gradient(mu, p)),
        ("zonal", &|p| zonal(mu, R, &j, p), &|p| zonal_gradient(mu, R, &j, p)),
        ("third body", &|p| third_body(5e12, p, &s), &|p| third_body_gradient(5e12, p, &s)),
        ("tide", &|p| solid_tide(0.3, R, &raiser, p), &|p| solid_tide_gradient(0.3, R, &raiser, p)),
    ];
    for p in [Vec3::new(5e6, -3e6, 4e6), Vec3::new(-1e5, 2e5, -7e6), Vec3::new(0.0, 0.0, 8e6)] {
        for (name, a, gradient) in &all {
            let g = gradient(&p);
            let h = 2e3;
            let slope = |k: usize| {
                let mut e = Vec3::zeros();
                e[k] = h;
                let d = |s: f64| a(&(p + e * s)) - a(&(p - e * s));
                // This difference has fourth order.
                (d(1.0) * 8.0 - d(2.0)) / (12.0 * h)
            };
            let size = g.norm();
            for k in 0..3 {
                near3(
                    &Vec3::from(g.column(k)),
                    &slope(k),
                    2e-9 * size,
                    &format!("{name} {k} at {p}"),
                );
            }
            assert!((g - g.transpose()).norm() < 1e-14 * size, "{name} at {p}");
            assert!(g.trace().abs() < 1e-13 * size, "{name} at {p}");
        }
    }
    // Compare the gradient of zonal terms with the general series.
    let field = Harmonics::new(&Coefficients::zonal(mu, R, &j).unwrap());
    let p = Vec3::new(4e6, 3e6, -5e6);
    let (a, b) = (zonal_gradient(mu, R, &j, &p), field.full(&p).gradient);
    assert!((a - b).norm() < 1e-14 * b.norm(), "{a} {b}");
}

#[test]
fn torque_of_the_gradient() {
    let I = Mat3::new(900.0, 20.0, -15.0, 20.0, 1100.0, 30.0, -15.0, 30.0, 1500.0);
    let p = Vec3::new(3e6, -5e6, 4e6);
    let golden = Vec3::new(-0.0005239084965177083, -0.0004907625748529336, -0.00022052184617788614);
    near3(&torque(398600441800000.0, &I, &p), &golden, 1e-18, "torque");
    // The gravity forces on six masses with this inertia must give the same torque. The gradient is
    // constant here.
    let H = point_mass_gradient(398600441800000.0, &p);
    let second = Mat3::identity() * (I.trace() / 2.0) - I;
    let moment = |j: usize, k: usize| (0..3).map(|i| second[(j, i)] * H[(k, i)]).sum::<f64>();
    let sum = Vec3::new(
        moment(1, 2) - moment(2, 1),
        moment(2, 0) - moment(0, 2),
        moment(0, 1) - moment(1, 0),
    );
    near3(&sum, &golden, 1e-17, "sum of r × dF");
}

#[test]
fn the_tide_of_coefficients_is_that_of_the_closed_form() {
    let raisers = [
        TideRaiser { mu: 4.9028e12, position: Vec3::new(3.1e8, -1.7e8, 9e7) },
        TideRaiser { mu: 1.327e20, position: Vec3::new(-9e10, 1.1e11, 4.2e10) },
    ];
    let plain = random_field(4, 4, 13);
    let mut tidal = plain.clone();
    solid_tide_coefficients(0.3, &raisers, &mut tidal).unwrap();
    let p = Vec3::new(5e6, 4e6, -3e6);
    let by_coefficients =
        Harmonics::new(&tidal).acceleration(&p) - Harmonics::new(&plain).acceleration(&p);
    let closed: Vec3 = raisers.iter().map(|r| solid_tide(0.3, plain.radius, r, &p)).sum();
    assert!(closed.norm() > 1e-7 && closed.norm() < 1e-6, "{closed:?}");
    near3(&by_coefficients, &closed, 1e-14, "tide");
    let mut small = Coefficients::zonal(1.0, 1.0, &[1e-3]).unwrap();
    assert!(solid_tide_coefficients(0.3, &raisers, &mut small).is_err());
}

#[test]
fn wrong_fields_are_refused() {
    let why = |r: Result<Coefficients, linkwork_world::WorldError>| r.unwrap_err().to_string();
    assert!(why(Coefficients::new(-1.0, 1.0, 2, 2)).contains("mu"));
    assert!(why(Coefficients::new(f64::NAN, 1.0, 2, 2)).contains("mu"));
    assert!(why(Coefficients::new(1.0, 0.0, 2, 2)).contains("radius"));
    assert!(why(Coefficients::new(1.0, 1.0, 361, 2)).contains("degree 361 is more than 360"));
    assert!(why(Coefficients::new(1.0, 1.0, 3, 4)).contains("order 4 is more than 3"));
    let mut field = Coefficients::new(1.0, 1.0, 4, 2).unwrap();
    assert!(field.set(5, 0, 0.0, 0.0).unwrap_err().to_string().contains("degree 5"));
    assert!(field.set(4, 3, 0.0, 0.0).unwrap_err().to_string().contains("order 3"));
    assert!(field.set(4, 2, f64::NAN, 0.0).is_err());
    assert!(why(field.truncated(5, 2)).contains("help: read a larger field"));
}

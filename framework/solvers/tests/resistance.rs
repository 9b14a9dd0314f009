//! Rolling and spinning friction, and surfaces that move over their bodies, compared with closed forms.

use crate::scene::{Run, Scene, solid_ball, solid_box, turned};
use linkwork_collision::{ColliderSpec, Material, PairLaw, Resistance, Shape};
use linkwork_dynamics::spatial::{Pose, Vec3};
use linkwork_solvers::contact::Method;

const G: f64 = 9.81;
const R: f64 = 0.1;

fn rough() -> Material {
    Material { friction: 0.8, restitution: 0.0 }
}

/// A ball on the ground with body rates; the ground has the resistance.
fn ball(resistance: Resistance, rates: [f64; 6], method: Method) -> Run {
    let mut s = Scene::default();
    s.settings.solver.method = method;
    s.settings.solver.tolerance = 1e-8;
    s.ground(rough());
    s.colliders[0].resistance = resistance;
    let at = Pose::translation(0.0, 0.0, R);
    s.body("ball", solid_ball(2.0, R), Shape::Sphere { radius: R }, rough(), at, rates);
    s.run()
}

/// Returns the world velocity of a body's origin; rates are in the axes of the body.
fn velocity(run: &mut Run, body: &str) -> Vec3 {
    let X = run.pose(body);
    let v = run.rates(body);
    X.rotation * Vec3::new(v[3], v[4], v[5])
}

fn steps(run: &mut Run, n: usize) {
    for _ in 0..n {
        let report = run.step(1e-3);
        assert!(report.converged, "{report:?}");
    }
}

/// a = 5/7 g μ_r / r, along any direction, and rest at v₀²/2a.
#[test]
fn a_rolling_ball_slows_down_by_five_sevenths() {
    let (v0, mu) = (0.5, 0.004);
    let a = 5.0 / 7.0 * G * mu / R;
    for method in [Method::Auto, Method::GaussSeidel, Method::Newton] {
        for angle in [0.0, 0.6, 2.0_f64] {
            let (c, s) = (angle.cos() * v0, angle.sin() * v0);
            let resistance = Resistance { rolling: mu, spinning: 0.0 };
            let mut run = ball(resistance, [-s / R, c / R, 0.0, c, s, 0.0], method);
            steps(&mut run, 1000);
            let v = velocity(&mut run, "ball").norm();
            // Measured: an error of 1e-6 of 0.2803 m/s.
            assert!((v - (v0 - a)).abs() < 1e-5, "{method:?} {angle}: {v} {}", v0 - a);
            steps(&mut run, 1500);
            assert!(run.v.iter().all(|v| v.abs() < 1e-6), "{:?}", run.v);
            let way = run.pose("ball").position.xy().norm();
            let want = v0 * v0 / (2.0 * a);
            assert!((way - want).abs() < 1e-3 * want, "{way} {want}");
        }
    }
}

/// Without resistance a ball continues to roll.
#[test]
fn without_resistance_nothing_slows_down() {
    let mut run = ball(Resistance::default(), [0.0, 5.0, 0.0, 0.5, 0.0, 0.0], Method::Auto);
    steps(&mut run, 1000);
    let v = velocity(&mut run, "ball").norm();
    assert!((v - 0.5).abs() < 1e-9, "{v}");
    assert!(run.stepper.moments().is_empty());
}

/// A ball that spins on the spot stops after I ω / (μ_s m g).
#[test]
fn a_spinning_ball_stops_in_its_time() {
    let (w0, mu) = (30.0, 0.005);
    let stop = 0.4 * R * R * w0 / (mu * G);
    let resistance = Resistance { rolling: 0.0, spinning: mu };
    let mut run = ball(resistance, [0.0, 0.0, w0, 0.0, 0.0, 0.0], Method::Auto);
    steps(&mut run, 1000);
    let w = run.rates("ball")[2];
    assert!((w - w0 * (1.0 - 1.0 / stop)).abs() < 1e-6 * w0, "{w}");
    let moment = run.stepper.moments()[0] / 1e-3;
    // The moment acts on the ground, the second body of the pair.
    assert!((moment.z - mu * 2.0 * G).abs() < 1e-6, "{moment:?}");
    steps(&mut run, ((stop - 1.0) / 1e-3) as usize + 3);
    assert!(run.rates("ball")[2].abs() < 1e-9);
}

/// On a slope a ball stays at rest while tan α < μ_r / r; above, a = 5/7 g (sin α − μ_r/r cos α).
#[test]
fn on_a_slope_a_ball_stays_or_rolls() {
    let mu = 0.01;
    for (angle, stays) in [(0.09_f64, true), (0.15, false)] {
        let (mut s, q) = (Scene::default(), turned(Vec3::y(), angle));
        s.ground(rough());
        s.colliders[0].pose = Pose::rotation(q);
        let at = Pose::translation(R * angle.sin(), 0.0, R * angle.cos());
        s.body("ball", solid_ball(2.0, R), Shape::Sphere { radius: R }, rough(), at, [0.0; 6]);
        s.colliders[1].resistance.rolling = mu;
        let mut run = s.run();
        steps(&mut run, 1000);
        let v = velocity(&mut run, "ball").norm();
        let a = 5.0 / 7.0 * G * (angle.sin() - mu / R * angle.cos());
        let want = if stays { 0.0 } else { a };
        assert!((v - want).abs() < 2e-3, "{angle}: {v} {want}");
    }
}

/// Two balls roll on a plank that lies on the ground: several contacts share an island, and their pair has a contact law, which has priority.
#[test]
fn a_law_of_a_pair_goes_before_the_surfaces() {
    let mut s = Scene::default();
    s.ground(rough());
    s.colliders[0].resistance.rolling = 0.02;
    s.colliders[0].material_name = Some("carpet".into());
    for (k, mu) in [(0, "felt"), (1, "steel")] {
        let at = Pose::translation(0.0, f64::from(k), R);
        let (name, rates) = (format!("ball{k}"), [0.0, 5.0, 0.0, 0.5, 0.0, 0.0]);
        s.body(&name, solid_ball(2.0, R), Shape::Sphere { radius: R }, rough(), at, rates);
        s.colliders[1 + k as usize].material_name = Some(mu.into());
    }
    s.rules.laws.push(PairLaw {
        materials: ["carpet".into(), "steel".into()],
        friction: None,
        restitution: None,
        rolling: Some(0.002),
        spinning: None,
    });
    let mut run = s.run();
    steps(&mut run, 200);
    for (name, mu) in [("ball0", 0.02), ("ball1", 0.002)] {
        let want = 0.5 - 0.2 * 5.0 / 7.0 * G * mu / R;
        let v = velocity(&mut run, name).norm();
        assert!((v - want).abs() < 1e-3, "{name}: {v} {want}");
    }
}

/// A box placed on a belt slides for v / (μ g), then moves with it; the belt rotates with its body.
#[test]
fn a_box_on_a_belt_reaches_its_speed() {
    let (speed, mu, half) = (1.2, 0.4, Vec3::new(0.1, 0.1, 0.05));
    let turn = 0.7;
    let mut s = Scene::default();
    let mut belt = ColliderSpec::new("belt", "world", Shape::HalfSpace);
    belt.material = Material { friction: mu, restitution: 0.0 };
    // The component along the normal has no effect.
    belt.surface_velocity = turned(Vec3::z(), turn) * Vec3::new(speed, 0.0, 3.0);
    s.colliders.push(belt);
    let at = Pose::translation(0.0, 0.0, half.z);
    let own = Material { friction: mu, restitution: 0.0 };
    s.body("box", solid_box(2.0, half), Shape::Box { half }, own, at, [0.0; 6]);
    let mut run = s.run();
    let along = turned(Vec3::z(), turn) * Vec3::x();
    steps(&mut run, 200);
    let v = velocity(&mut run, "box");
    assert!((v - along * (mu * G * 0.2)).norm() < 1e-3, "{v:?}");
    // The box reaches the speed of the belt after v / (μ g) = 0.306 s.
    steps(&mut run, 110);
    let v = velocity(&mut run, "box");
    assert!((v - along * speed).norm() < 1e-6, "{v:?}");
    steps(&mut run, 690);
    let way = run.pose("box").position.dot(&along);
    let want = speed * 1.0 - speed * speed / (2.0 * mu * G);
    assert!((way - want).abs() < 2e-3, "{way} {want}");
}

/// Action and reaction: a belt on a cart that can roll pushes the cart back; momentum is conserved.
#[test]
fn a_belt_pushes_its_cart_back() {
    let half = Vec3::new(0.5, 0.2, 0.05);
    let mut s = Scene::default();
    s.settings.solver.tolerance = 1e-9;
    s.ground(Material { friction: 0.0, restitution: 0.0 });
    let smooth = Material { friction: 0.0, restitution: 0.0 };
    let at = Pose::translation(0.0, 0.0, half.z);
    s.body("cart", solid_box(4.0, half), Shape::Box { half }, smooth, at, [0.0; 6]);
    let rub = Material { friction: 0.5, restitution: 0.0 };
    let mut belt =
        ColliderSpec::new("track", "cart", Shape::Box { half: Vec3::new(0.5, 0.2, 0.01) })
            .at(Pose::translation(0.0, 0.0, half.z));
    belt.material = rub;
    belt.surface_velocity = Vec3::new(0.6, 0.0, 0.0);
    s.colliders.push(belt);
    let small = Vec3::new(0.05, 0.05, 0.05);
    let at = Pose::translation(0.0, 0.0, 2.0 * half.z + 0.01 + small.z);
    s.body("box", solid_box(2.0, small), Shape::Box { half: small }, rub, at, [0.0; 6]);
    let mut run = s.run();
    steps(&mut run, 500);
    let (cart, load) = (velocity(&mut run, "cart").x, velocity(&mut run, "box").x);
    assert!((load - cart - 0.6).abs() < 1e-6, "{load} {cart}");
    assert!((4.0 * cart + 2.0 * load).abs() < 1e-6, "{load} {cart}");
}

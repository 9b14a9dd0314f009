//! Ball hinges with limits and springs, springs of coordinates, and restitution at limits, as written in files. The cases: dimforge/rapier #379,
//! gazebosim/sdformat #860, DanielChappuis/reactphysics3d #242.
use crate::common;
use linkwork_runtime::{Seconds, Simulation};

const GRAVITY: &str = r#""Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] })"#;

fn sim(text: &str) -> Simulation {
    common::scene(text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

fn until(sim: &mut Simulation, t: f64) {
    sim.run_until(Seconds::from_decimal(t).unwrap()).unwrap();
}

/// Angle of the whole rotation, tilt of z, twist about z; rad.
fn angles(sim: &Simulation) -> [f64; 3] {
    let [x, y, z, w] = ["x", "y", "z", "w"].map(|c| sim.get(&format!("b.rotation.{c}")).unwrap());
    let whole = 2.0 * (x * x + y * y + z * z).sqrt().atan2(w.abs());
    let tilt = (1.0 - 2.0 * (x * x + y * y)).clamp(-1.0, 1.0).acos();
    let twist = 2.0 * (z * w.signum()).atan2(w.abs());
    [whole, tilt, twist.abs()]
}

/// A stick that stands on a ball hinge falls over, or rotates about itself: with contact it stays within each kind of limit.
#[test]
fn a_ball_hinge_keeps_its_limits() {
    let limit = 40.0_f64.to_radians();
    let tilted = r#"rotation: (rpy: ["10 deg", 0, 0])"#;
    for (limits, initial, which) in [
        (r#"lower: 0, upper: "40 deg""#, tilted, 0),
        (r#"cone: "40 deg""#, tilted, 1),
        (r#"cone: "100 deg", twist: "40 deg""#, "angular: [0, 0, 4]", 2),
    ] {
        let mut sim = sim(&format!(
            r#"Simulation(bodies: {{
                "b": (parent: "world", hinge: Ball(limits: ({limits})), mass: 1, com: [0, 0, 0.3], inertia: Sphere(0.05), initial: ({initial})) }},
                parts: {{ {GRAVITY} }}, contact: (), step: "1 ms", until: "3 s")"#
        ));
        let mut most: f64 = 0.0;
        for k in 1..=300 {
            until(&mut sim, f64::from(k) * 0.01);
            most = most.max(angles(&sim)[which]);
        }
        // The angle may exceed the limit by the slop of 1e-4 rad.
        assert!((most - limit).abs() < 1e-3, "{limits}: {most} {limit}");
    }
}

/// Without contact the default stop follows from the inertia along the direction in which the limit is exceeded. The sticks above, with inertias of
/// 0.091 and 0.001 kg m², exceed their limits by at most `5 v step + 50 a step²` of FORMAT.md. A stop from the smallest inertia let the first exceed
/// it by 9 degrees.
#[test]
fn the_usual_stop_of_a_ball_holds_in_every_direction() {
    let limit = 40.0_f64.to_radians();
    let tilted = r#"rotation: (rpy: ["10 deg", 0, 0])"#;
    for (limits, initial, which) in [
        (r#"lower: 0, upper: "40 deg""#, tilted, 0),
        (r#"cone: "40 deg""#, tilted, 1),
        (r#"cone: "100 deg", twist: "40 deg""#, "angular: [0, 0, 4]", 2),
    ] {
        let mut sim = sim(&format!(
            r#"Simulation(bodies: {{
                "b": (parent: "world", hinge: Ball(limits: ({limits})), mass: 1, com: [0, 0, 0.3], inertia: Sphere(0.05), initial: ({initial})) }},
                parts: {{ {GRAVITY} }}, integrator: "rk4", step: "1 ms", until: "3 s")"#
        ));
        let (mut most, mut fastest): (f64, f64) = (0.0, 0.0);
        for k in 1..=3000 {
            until(&mut sim, f64::from(k) * 0.001);
            most = most.max(angles(&sim)[which]);
            let w = ["x", "y", "z"].map(|c| sim.get(&format!("b.angular.{c}")).unwrap());
            fastest = fastest.max(w.iter().map(|w| w * w).sum::<f64>().sqrt());
        }
        let room = 5.0 * fastest * 1e-3 + 50.0 * (9.81 * 0.3 / 0.091) * 1e-6;
        println!("{limits}: past by {:.4} rad, at most {room:.4}", most - limit);
        assert!(most > limit && most - limit < room, "{limits}: {most} {limit}");
    }
}

/// A ball with a spring rotates about a principal axis as a torsion pendulum: φ = φ₀ cos √(k/I) t; a pin with a spring about its rest angle; a slider
/// too.
#[test]
fn springs_at_hinges_swing_with_their_frequency() {
    let text = |hinge: &str, initial: &str| {
        format!(
            r#"Simulation(gravity: "none", bodies: {{ "b": (parent: "world", hinge: {hinge}, mass: 2, inertia: [0.5, 0.5, 0.5], initial: ({initial})) }},
            step: "1 ms", integrator: "rk4", until: "2 s")"#
        )
    };
    let (t, w) = (0.7, (8.0_f64 / 0.5).sqrt());
    let mut ball = sim(&text(
        r#"Ball(spring: (stiffness: "8 N m/rad"))"#,
        r#"rotation: (axis: [1, 2, 2], angle: 0.9)"#,
    ));
    until(&mut ball, t);
    assert!((angles(&ball)[0] - (0.9 * (w * t).cos()).abs()).abs() < 1e-8);
    let mut pin = sim(&text(
        r#"Pin(axis: [0, 0, 1], spring: (stiffness: "8 N m/rad", rest: 0.4))"#,
        "angle: 1",
    ));
    until(&mut pin, t);
    assert!((pin.get("b.angle").unwrap() - (0.4 + 0.6 * (w * t).cos())).abs() < 1e-8);
    let mut slider = sim(&text(
        r#"Slider(axis: [0, 0, 1], spring: (stiffness: "8 N/m", rest: "1 cm"))"#,
        "position: 0.1",
    ));
    until(&mut slider, t);
    let want = 0.01 + 0.09 * (2.0 * t).cos();
    assert!((slider.get("b.displacement").unwrap() - want).abs() < 1e-8);
}

/// A bar without gravity hits a limit at rate 2 and returns with e times this rate, so with e² of the energy, by impulses and with a soft stop.
#[test]
fn restitution_at_a_limit_returns_its_part_of_the_energy() {
    for e in [0.0, 0.4, 0.8, 1.0] {
        for (hinge, initial, name) in [
            (
                format!(r#"Pin(axis: [0, 0, 1], limits: (upper: 0.5, restitution: {e}))"#),
                "rate: 2",
                "rate",
            ),
            (
                format!(r#"Slider(axis: [0, 0, 1], limits: (upper: 0.5, restitution: {e}))"#),
                "rate: 2",
                "speed",
            ),
            (
                format!(r#"Ball(limits: (cone: 0.5, restitution: {e}))"#),
                "angular: [2, 0, 0]",
                "angular.x",
            ),
        ] {
            for (contact, tolerance) in [("contact: (), ", 1e-6), (r#"integrator: "rk4", "#, 0.03)]
            {
                let mut sim = sim(&format!(
                    r#"Simulation(gravity: "none", bodies: {{ "b": (parent: "world", hinge: {hinge}, mass: 2, inertia: [0.5, 0.5, 0.5], initial: ({initial})) }},
                    {contact}step: "1 ms", until: "1 s")"#
                ));
                until(&mut sim, 0.2);
                let variable = format!("b.{name}");
                assert!((sim.get(&variable).unwrap() - 2.0).abs() < 1e-9);
                until(&mut sim, 0.4);
                let back = sim.get(&variable).unwrap();
                let returned = back * back / 4.0;
                assert!(
                    back <= 1e-9 && (returned - e * e).abs() < tolerance,
                    "{hinge} {contact}: {back} {e}"
                );
            }
        }
    }
}

#[test]
fn senseless_limits_and_springs_are_refused() {
    let text = |hinge: &str| {
        format!(
            r#"Simulation(gravity: "none", bodies: {{ "b": (parent: "world", hinge: {hinge}, mass: 2, inertia: [0.5, 0.5, 0.5]) }})"#
        )
    };
    for (hinge, wanted) in [
        ("Ball(limits: (lower: 0.1, upper: 1))", "`lower` of a ball is 0"),
        ("Ball(limits: (rate: 1))", "does not support limits of rate"),
        ("Ball(limits: (cone: -1))", "above 0"),
        ("Pin(axis: [0, 0, 1], limits: (cone: 1))", "only balls support"),
        ("Pin(axis: [0, 0, 1], limits: (restitution: 0.5))", "a coordinate with a limit"),
        (
            "Pin(axis: [0, 0, 1], limits: (upper: 1, restitution: 0.5), stop: (stiffness: 9, damping: 1))",
            "write either it",
        ),
        ("Pin(axis: [0, 0, 1], spring: (stiffness: -1))", "`stiffness` is -1"),
        ("Ball(spring: (stiffness: 1, rest: 1))", "neutral rotation"),
        ("Free(spring: (stiffness: 1))", "not on free"),
    ] {
        let told = common::scene(&text(hinge), &[]).err().unwrap_or_default();
        assert!(told.contains(wanted), "{hinge}: {told}");
    }
}

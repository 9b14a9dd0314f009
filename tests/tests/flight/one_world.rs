//! One world per simulation: its use by parts, in simulations with known results.
use crate::common;
use common::metrics_of;

/// Returns the metrics of a simulation that must run.
fn metrics(text: &str) -> impl Fn(&str) -> f64 + use<> {
    let all = metrics_of(text).unwrap_or_else(|e| panic!("{e}"));
    move |name| all[name]
}

/// On the Earth at 45° north an ideal gyroscope at rest measures 10.6°/h about the vertical, 2.95° in 1000 s. Neither the pose estimator nor odometry
/// with this gyroscope interprets it as rotation of the rover.
#[test]
fn navigation_at_rest_does_not_turn_with_the_planet() {
    let get = metrics(NAVIGATION);
    let (heading, deviation) = (get("heading"), get("deviation"));
    assert!(heading.abs() < deviation.min(1e-3), "{heading} rad, claimed {deviation}");
    assert!(get("odometry").abs() < 1e-9, "{}", get("odometry"));
}

const NAVIGATION: &str = r#"Simulation(
    world: (body: "earth", site: (latitude: "45 deg", longitude: 0)),
    bodies: { "deck": (parent: "world", mass: 1, inertia: Sphere(0.1), nodes: { "n": (position: [0, 0, 0]) }) },
    parts: {
        "Gravity": (model: "environment.point_mass_gravity"),
        "Imu": (model: "sensors.imu", rate: "10 Hz", params: { "grade": ideal }, bind: { "mount": "node:deck/n" }),
        "Zero": (model: "basics.constant", params: { "value": 0 }),
        "Est": (model: "navigation.pose_estimator", rate: "10 Hz"),
        "Odometry": (model: "control.odometry", rate: "10 Hz", params: { "gyro": true, "radius": 0.2, "wheels": [(position: [0.5, 0.5], steered: false), (position: [0.5, -0.5], steered: false)] }),
    },
    wires: ["Imu.rate -> Est.gyro", "Imu.force -> Est.force", "Zero.y -> Est.speed", "Imu.rate.z -> Odometry.yaw_rate", "Zero.y -> Odometry.wheels[*].rate"],
    step: "100 ms", until: "1000 s",
    metrics: { "heading": (of: "Est.heading", take: "last"), "deviation": (of: "Est.deviation.z", take: "last"), "odometry": (of: "Odometry.heading", take: "last") },
)"#;

/// A panel near the Earth gets the full 1361 W/m² of 1 AU in sunlight, corrected for the 7000 km distance, and nothing in the shadow. Air in space
/// does not attenuate it.
#[test]
fn a_panel_in_orbit_has_the_whole_sun_or_the_shadow() {
    let get = metrics(ORBIT);
    let d = 1.000_002_61 - 7e6 / linkwork_runtime::AU;
    assert!((get("day") - 1361.0 / (d * d)).abs() < 1e-6, "{}", get("day"));
    assert_eq!(get("night"), 0.0);
}

/// A panel that faces the Sun circles the Earth at 7000 km, 6300 km above the plane of the ecliptic, so that the shadow takes 264 s of 5829 s: its energy is the
/// same for any sampling. A shadow that was shorter than a step was once missed.
#[test]
fn a_panel_loses_the_energy_of_a_short_shadow_whatever_the_step() {
    let energy = |method: &str, step: &str| {
        let text = format!(
            r#"Simulation(
    world: (body: "earth"),
    bodies: {{
        "arm": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 1], initial: (rate: {RATE:?})),
        "panel": (parent: "arm", at: (position: [7e6, 0, 6.3e6]), hinge: Pin([0, 0, 1]), mass: 1e-6, inertia: [1, 1, 1], initial: (rate: -{RATE:?}), nodes: {{ "n": (rotation: (rpy: [0, "90 deg", 0])) }}),
    }},
    parts: {{
        "Sun": (model: "environment.fixed_sun", params: {{ "direction": [1, 0, 0] }}),
        "Panel": (model: "power.solar_panel", params: {{ "area": "1 m^2", "efficiency": 1 }}, bind: {{ "panel": "node:panel/n" }}),
        "Energy": (model: "basics.integrator"),
    }},
    wires: ["Panel.power -> Energy.u"],
    gravity: "none", step: "{step}", integrator: "{method}", until: "6000 s",
    metrics: {{ "energy": (of: "Energy.y"), "least": (of: "Panel.irradiance", take: "min"), "cosine": (of: "Panel.cosine", take: "min") }},
)"#
        );
        let get = metrics(&text);
        assert!(get("cosine") > 1.0 - 1e-7, "{}", get("cosine"));
        get("energy")
    };
    let fine = energy("rk4", "1 s");
    let full = 1361.0 * 6000.0;
    // The chord of a circle of 6378 km at a height of 6300 km, without the width of the penumbra.
    let half = (6378.137_f64.powi(2) - 6300.0_f64.powi(2)).sqrt() / 7000.0;
    let dark = 2.0 * half.asin() / RATE;
    let lost = 1.0 - fine / full;
    println!("{dark} s of shadow, {} s found", lost * 6000.0);
    assert!((lost * 6000.0 / dark - 1.0).abs() < 0.05, "{lost} {dark}");
    for (method, step) in [
        ("semi_implicit_euler", "1 s"),
        ("rk4", "60 s"),
        ("rk4", "600 s"),
        ("dormand_prince_54", "600 s"),
        ("dormand_prince_54", "6000 s"),
        ("verner_87", "6000 s"),
    ] {
        let y = energy(method, step);
        println!("{method} {step}: {:e} of the shadow", (y - fine) / (full - fine));
        // A fixed-step method passes the penumbra, in which the light is a curve, in one step. Measured: 2.2e-3 with rk4 and 600 s.
        assert!(((y - fine) / (full - fine)).abs() < 5e-3, "{method} {step}: {y} {fine}");
    }
}

/// Angular rate (rad/s) of the orbit of this panel.
const RATE: f64 = 1.077_9e-3;

const ORBIT: &str = r#"Simulation(
    world: (body: "earth"),
    bodies: {
        "day": (parent: "world", at: (position: [7e6, 0, 0], rotation: (rpy: [0, "90 deg", 0])), mass: 1, inertia: Sphere(0.1), nodes: { "n": (position: [0, 0, 0]) }),
        "night": (parent: "world", at: (position: [-7e6, 1e6, 0], rotation: (rpy: [0, "90 deg", 0])), mass: 1, inertia: Sphere(0.1), nodes: { "n": (position: [0, 0, 0]) }),
    },
    parts: {
        "Sun": (model: "environment.fixed_sun", params: { "direction": [1, 0, 0] }),
        "Day": (model: "power.solar_panel", params: { "area": "1 m^2", "efficiency": 1 }, bind: { "panel": "node:day/n" }),
        "Night": (model: "power.solar_panel", params: { "area": "1 m^2", "efficiency": 1 }, bind: { "panel": "node:night/n" }),
    },
    gravity: "none", step: "1 s", until: "2 s",
    metrics: { "day": (of: "Day.power", take: "last", unit: "W"), "night": (of: "Night.power", take: "max", unit: "W") },
)"#;

/// At the mean distance of Mars the irradiance is 586 W/m²; after sunset panels in any orientation get nothing.
#[test]
fn a_panel_on_the_ground_has_the_sun_of_its_planet_by_day_alone() {
    let get = metrics(GROUND);
    // The panel is closer to the Sun than the centre of Mars by the radius of Mars.
    let d = 1.523_710_34 - 3_396_191.0 / linkwork_runtime::AU;
    assert!((get("lit") - 1361.0 / (d * d)).abs() < 1e-3, "{}", get("lit"));
    assert_eq!(get("dark"), 0.0);
}

const GROUND: &str = r#"Simulation(
    world: (body: "mars", site: (latitude: 0, longitude: 0, turning: false)),
    bodies: { "deck": (parent: "world", at: (position: [0, 0, 1]), mass: 1, inertia: Sphere(0.1), nodes: { "up": (position: [0, 0, 0]) }), "side": (parent: "world", at: (position: [0, 0, 1], rotation: (rpy: [0, "90 deg", 0])), mass: 1, inertia: Sphere(0.1), nodes: { "n": (position: [0, 0, 0]) }) },
    parts: {
        "Noon": (model: "environment.fixed_sun", params: { "azimuth": 0, "elevation": "90 deg" }),
        "Dusk": (model: "environment.fixed_sun", params: { "azimuth": 0, "elevation": "-10 deg" }),
        "Lit": (model: "power.solar_panel", params: { "area": "1 m^2", "efficiency": 1, "sun": "Noon" }, bind: { "panel": "node:deck/up" }),
        "Dark": (model: "power.solar_panel", params: { "area": "1 m^2", "efficiency": 1, "sun": "Dusk" }, bind: { "panel": "node:side/n" }),
    },
    gravity: "none", step: "1 s", until: "2 s",
    metrics: { "lit": (of: "Lit.power", take: "last", unit: "W"), "dark": (of: "Dark.power", take: "max", unit: "W") },
)"#;

/// At ∛(μ/ω²), 20 427.6 km from the centre of Mars, a spacecraft is fixed over the ground.
#[test]
fn in_a_stationary_orbit_the_ground_stands_still() {
    let omega = 350.891_982_26_f64.to_radians() / 86_400.0;
    let r = (4.2828e13 / (omega * omega)).cbrt();
    let get = metrics(
        &STATIONARY
            .replace("20427.6e3", &format!("{r:?}"))
            .replace("1448", &format!("{:?}", omega * r)),
    );
    assert!(get("speed") < 1e-6 && get("inclination") < 1e-9, "{} m/s", get("speed"));
    assert!(get("latitude").abs() < 1e-9);
}

const STATIONARY: &str = r#"Simulation(
    world: (body: "mars", mu: 4.2828e13),
    bodies: { "craft": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), initial: (position: [20427.6e3, 0, 0], velocity: [0, 1448, 0])) },
    parts: {
        "Gravity": (model: "environment.point_mass_gravity"),
        "Ground": (model: "flight.ground_motion", bind: { "body": "node:craft" }),
        "Orbit": (model: "flight.orbit", bind: { "body": "node:craft" }),
    },
    step: "10 s", integrator: "dormand_prince_54", accuracy: (relative: 1e-10, absolute: 1e-6), until: "1 h",
    metrics: { "speed": (of: "Ground.speed", take: "max"), "inclination": (of: "Orbit.inclination", take: "last"), "latitude": (of: "Ground.latitude", take: "max") },
)"#;

/// Inclinations are relative to the planet's own equator: an orbit with the normal (1, 0, −1)/√2 around the pole of Mars, right ascension 317.68°,
/// declination 52.89° (IAU), has 104.4°, and the spacecraft reaches the corresponding latitude.
#[test]
fn an_inclination_counts_from_the_equator_of_the_body() {
    let get = metrics(INCLINED);
    let (ra, dec) = (317.681_f64.to_radians(), 52.887_f64.to_radians());
    let normal = (dec.cos() * ra.cos() - dec.sin()) / 2f64.sqrt();
    let wanted = normal.acos().to_degrees();
    assert!(get("least") < wanted && wanted < get("inclination"), "{wanted}");
    assert!(get("inclination") - get("least") < 0.1);
    // Geodetic latitudes are up to 0.34° larger than geocentric ones.
    let beyond = get("latitude") - (180.0 - wanted);
    assert!(beyond > 0.0 && beyond < 0.34, "{beyond}");
}

const INCLINED: &str = r#"Simulation(
    world: (body: "mars", epoch: "2024-06-21 00:00:00 UTC"),
    bodies: { "craft": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), initial: (position: [0, 4e6, 0], velocity: [2000, 0, 2000])) },
    parts: {
        "Gravity": (model: "environment.zonal_gravity", params: { "j2": 1.9566e-3 }),
        "Ground": (model: "flight.ground_motion", bind: { "body": "node:craft" }),
        "Orbit": (model: "flight.orbit", bind: { "body": "node:craft" }),
    },
    step: "10 s", integrator: "dormand_prince_54", accuracy: (relative: 1e-10, absolute: 1e-6), until: "3 h",
    metrics: { "least": (of: "Orbit.inclination", take: "min", unit: "deg"), "inclination": (of: "Orbit.inclination", take: "max", unit: "deg"), "latitude": (of: "Ground.latitude", take: "max", unit: "deg") },
)"#;

//! Terrain-relative navigation in a simulation: a lidar over generated ground, and a map of it.
use crate::common;
use common::{get, scene, seconds};
use linkwork_runtime::Simulation;
use linkwork_spatial::Vec3;

/// A lander that coasts over craters; the known state of navigation is a second object that moves with it.
fn over(ground: &str, map: &str) -> Simulation {
    let text = format!(
        r#"Simulation(
    bodies: {{ "lander": (
        parent: "world", hinge: Free, mass: 900, inertia: [400, 400, 500],
        initial: (position: [-10, 4, 55], velocity: [6, -2, -1.5], angular: [0.01, -0.02, 0.03]),
        nodes: {{ "lidar": (position: [0.4, 0, -0.8]), "known": (position: [7.7, -4.9, 2.3]) }},
    ) }},
    parts: {{
        "Ground": (model: "environment.generated_terrain", params: {{ {ground} }}),
        "Map": (model: "environment.generated_terrain", params: {{ {map} }}),
        "Lidar": (
            model: "sensors.lidar", rate: "2 Hz", bind: {{ "mount": "node:lander/lidar" }},
            params: {{ "columns": 16, "rows": 6, "elevation": ["-85 deg", "-55 deg"], "depth": 150, "reach": 1000, "sigma": "3 cm", "terrain": "Ground" }},
        ),
        "Fix": (
            model: "flight.terrain_fix", rate: "2 Hz", bind: {{ "estimate": "node:lander/known" }},
            params: {{ "columns": 16, "rows": 6, "elevation": ["-85 deg", "-55 deg"], "step": 1, "steps": 12, "apart": 2, "sigma": "12 cm", "map": "Map" }},
        ),
    }},
    wires: ["Lidar.range -> Fix.range"],
    step: "50 ms", until: "5 s", integrator: "rk4",
)"#
    );
    scene(&text, &[]).unwrap_or_else(|e| panic!("{e}"))
}

const CRATERS: &str = r#""seed": 5, "size": [240, 240], "spacing": 0.5, "relief": 2.5, "wavelength": "35 m", "craters": 160, "crater_diameters": [5, 30], "rock_cover": 0"#;

#[test]
fn a_lander_finds_its_place_on_the_map() {
    let mut sim = over(CRATERS, CRATERS);
    let mut matched = 0;
    for k in 0..=9 {
        sim.run_until(seconds(0.5 * f64::from(k))).unwrap();
        assert!(sim.get("Fix.matched").unwrap() > 0.5, "{k}: why {}", sim.get("Fix.why").unwrap());
        // The fix is the position of the lidar; `known` has the axes of the lander.
        let lander = get(&sim, "lander.position");
        let truth = lander + common::rotation(&sim, "lander") * Vec3::new(0.4, 0.0, -0.8);
        let error = get(&sim, "Fix.position") - truth;
        let told = get(&sim, "Fix.deviation");
        // The lidar sees triangles, but the map is smooth: the difference is a fraction of σ.
        for axis in 0..3 {
            let bound = 4.0 * told[axis];
            assert!(error[axis].abs() < bound && told[axis] < 0.3, "{k}: {error} {told}");
        }
        matched += 1;
    }
    assert_eq!(matched, 10);
}

#[test]
fn on_another_map_it_finds_nothing() {
    let other = CRATERS.replace("\"seed\": 5", "\"seed\": 6");
    let mut sim = over(CRATERS, &other);
    for k in 0..=9 {
        sim.run_until(seconds(0.5 * f64::from(k))).unwrap();
        assert_eq!(sim.get("Fix.matched").unwrap(), 0.0, "{k}");
        assert!(sim.get("Fix.why").unwrap() > 0.5);
        assert_eq!(get(&sim, "Fix.shift"), Vec3::zeros());
    }
}

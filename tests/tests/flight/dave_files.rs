//! The DAVE-ML files of NASA's check cases (NASA/TM-2015-218675), read as published: inertia, propulsion, aerodynamics.
use crate::common::{in_folder, reference_text, seconds};
use linkwork_runtime::Simulation;

/// Kilograms per slug, and kg m² per slug ft².
const SLUG: f64 = 14.593_902_937_206_364;
const SLUG_FOOT2: f64 = SLUG * 0.3048 * 0.3048;

/// Returns a simulation whose parts read a NASA file, after a tenth of a second; `None` without the reference data.
fn with(file: &str, scene: &str) -> Option<Simulation> {
    let text = reference_text(&format!("nesc/{file}"))?;
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("file.dml"), text).unwrap();
    let sim = dir.path().join("sim.ron");
    std::fs::write(&sim, format!("Simulation({scene} step: \"10 ms\", until: \"1 s\")")).unwrap();
    let mut sim = in_folder(&sim).unwrap_or_else(|e| panic!("{file}: {e}"));
    sim.run_until(seconds(0.1)).unwrap();
    Some(sim)
}

/// Checks a model of a file with constant inputs: each output must agree with the expected value to 1e-9 relative.
fn gives(file: &str, inputs: &[(&str, f64)], wanted: &[(&str, f64)]) {
    let constants = inputs.iter().map(|(name, x)| {
        format!("\"C{name}\": (model: \"basics.constant\", params: {{ \"value\": {x} }}),")
    });
    let wires: Vec<_> =
        inputs.iter().map(|(name, _)| format!("\"C{name}.y -> M.{name}\"")).collect();
    let scene = format!(
        "parts: {{ {} \"M\": (model: \"flight.dave_model\", params: {{ \"model\": \"file.dml\" }}) }}, wires: [{}],",
        constants.collect::<String>(),
        wires.join(", ")
    );
    let Some(sim) = with(file, &scene) else { return };
    for (name, wanted) in wanted {
        let found = sim.get(&format!("M.{name}")).unwrap();
        println!("{file}: {name} = {found}");
        assert!(
            (found - wanted).abs() <= 1e-9 * wanted.abs(),
            "{file}: {name} is {found} and not {wanted}"
        );
    }
}

/// Numbers of the report: masses in slugs, moments in slug ft², the rocket's in SI.
#[test]
fn inertia_and_propulsion_of_nasas_files_have_the_numbers_of_the_report() {
    let [mass, moment] = [SLUG, 3.6 * SLUG_FOOT2];
    gives(
        "cannonball_inertia.dml",
        &[],
        &[("XMASS", mass), ("XIXX", moment), ("XIZZ", moment), ("XIXY", 0.0)],
    );
    let brick =
        [("XMASS", 0.155_404_754 * SLUG), ("XIYY", 0.006_211_019 * SLUG_FOOT2), ("DXCG", 0.0)];
    gives("brick_inertia.dml", &[], &brick);
    // First half of the first stage's propellant is burnt, so its values are the means of full and empty; then the
    // second stage is alone, with a quarter of its propellant left.
    let rocket = "two-stage_package/twostage_inertia.dml";
    let half = [("stagedFlag", 0.0), ("stg1fuelUsed", 90_000.0), ("stg2fuelUsed", 0.0)];
    gives(rocket, &half, &[("stg1fuelFrac", 0.5), ("XIXX", 252_000.0)]);
    let staged = [("stagedFlag", 1.0), ("stg1fuelUsed", 180_000.0), ("stg2fuelUsed", 60_000.0)];
    gives(rocket, &staged, &[("stg2fuelFrac", 0.25), ("XIXX", 43_875.0)]);
    let engine = "two-stage_package/twostage_prop.dml";
    gives(
        engine,
        &[("stg1firing", 1.0), ("stg2firing", 0.0)],
        &[("thrust", 1.7e7), ("isp", 360.0)],
    );
    gives(engine, &[("stg1firing", 0.0), ("stg2firing", 1.0)], &[("thrust", 5e6), ("isp", 390.0)]);
    gives(engine, &[("stg1firing", 0.0), ("stg2firing", 0.0)], &[("thrust", 0.0), ("mdot", 0.0)]);
}

/// The sphere's drag coefficient is 0.1 on a circle with a diameter of half a foot.
#[test]
fn aerodynamics_of_nasas_files_act_on_a_body() {
    for file in ["cannonball_aero.dml", "brick_aero.dml", "two-stage_package/twostage_aero.dml"] {
        let scene = r#"bodies: { "craft": (parent: "world", hinge: Free, mass: "1000 kg", inertia: [1e4, 1e4, 1e4],
            initial: (position: [0, 0, 0], velocity: [100, 0, 0])) },
            parts: { "Air": (model: "environment.exponential_atmosphere", params: { "density": 1.2, "scale_height": "1e6 km",
                "temperature": "288.15 K", "gas_constant": 287.05, "heat_ratio": 1.4 }),
                "A": (model: "flight.dave_aerodynamics", params: { "model": "file.dml" }, bind: { "body": "node:craft" }) },"#;
        let Some(sim) = with(file, scene) else { return };
        let drag = -sim.get("A.load.force.x").unwrap();
        println!("{file}: drag {drag} N");
        assert!(
            drag.is_finite() && sim.get("craft.velocity.x").unwrap() <= 100.0,
            "{file}: {drag}"
        );
        if file.starts_with("cannonball") {
            let v = sim.get("craft.velocity.x").unwrap();
            let area = 0.196_349_5 * 0.3048 * 0.3048;
            let wanted = 0.5 * 1.2 * v * v * area * 0.1;
            assert!((drag - wanted).abs() < 2e-3 * wanted, "{drag} {wanted}");
        }
    }
}

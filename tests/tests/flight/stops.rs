//! `outside: stop` of the aerodynamic models and of the canopy: the run ends in order, with a message, where the flow leaves their tables.
use crate::common::{scene, seconds};
use linkwork_runtime::Simulation;

const DAVE: &str = r##"<DAVEfunc xmlns='http://daveml.org/2010/DAVEML'><fileHeader name='cone'/>
<variableDef name='referenceWingArea' varID='S' units='m2' initialValue='1'/>
<variableDef name='mach' varID='M' units='nd'><isInput/></variableDef>
<variableDef name='totalCoefficientOfDrag' varID='CD' units='nd'/>
<function name='drag'><independentVarPts varID='M'>0, 1</independentVarPts>
<dependentVarPts varID='CD'>1, 1.5</dependentVarPts></function></DAVEfunc>"##;

/// A body that falls along its x and tips about its y, too heavy for the air to matter: v = `speed` + 50 t, θ = 0.2 t.
fn text(
    model: &str,
    params: &str,
    outside: &str,
    (speed, pitch): (f64, f64),
    bind: &str,
) -> String {
    format!(
        r#"Simulation(
    bodies: {{ "craft": (parent: "world", hinge: Free, mass: 1e9, inertia: [1e9, 1e9, 1e9], initial: (position: [0, 0, 90000],
        velocity: [0, 0, -{speed}], rotation: (rpy: [0, "{pitch} deg", 0]), angular: [0, 0.2, 0])) }},
    parts: {{
        "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -50] }}),
        "Air": (model: "environment.exponential_atmosphere", params: {{ "temperature": 210, "density": 0.020, "scale_height": 11100, "gas_constant": 191.8, "heat_ratio": 1.33, "heating_constant": 1.9027e-4 }}),
        "Aero": (model: "flight.{model}", params: {{ {params}, "outside": {outside} }}, bind: {{ "{bind}": "node:craft" }}),
    }},
    step: "100 ms", integrator: "rk4", until: "5 s",
)"#
    )
}

/// Returns a model, its parameters with an end at Mach 1 or at 0.51 rad, the node, and the message.
fn models() -> Vec<(&'static str, String, &'static str, &'static str)> {
    let dave = format!("\"model\": (name: \"cone.dml\", text: {DAVE:?})");
    let of = |name, params: &str, bind, says| (name, params.to_string(), bind, says);
    vec![
        of(
            "entry_aerodynamics",
            r#""area": 1, "drag": [[0, 1], [1, 1.5]], "lift_to_drag": [[0, 0], [9, 0]]"#,
            "body",
            "the flow leaves the tables, `drag` from Mach 0 to 1 and `lift_to_drag` from Mach 0 to 9, here Mach 1.0000",
        ),
        of(
            "axisymmetric_aerodynamics",
            r#""area": 1, "length": 1, "angles": [0, 3], "machs": [0, 1], "axial": [[1, 1.5], [-1, -1.5]], "normal": [[0, 0], [0, 0]], "pitch": [[0, 0], [0, 0]]"#,
            "body",
            "the flow leaves the tables, which have angles of 0.00 to 171.89 deg, here 7.",
        ),
        of(
            "sphere_cone",
            r#""gamma": 1.4, "half_angle": 0.51, "bluntness": 0.5, "base_radius": 1"#,
            "body",
            "the flow goes on at a total angle of attack of 29.22 deg, above the half-angle of 29.22 deg",
        ),
        (
            "dave_aerodynamics",
            dave,
            "body",
            "the flow leaves the tables, those of cone.dml, at Mach 1.0000, α ",
        ),
        of(
            "canopy",
            r#""diameter": 10, "drag_coefficient": 0.67, "start": "0.1 s", "filling_time": "0.1 s", "efficiency": [[0, 1], [1, 0.8]]"#,
            "canopy",
            "Mach 1.0000 is beyond the rows of `efficiency`, which end at 1",
        ),
    ]
}

/// Speed (m/s) and pitch (deg) with the flow along x.
const START: (f64, f64) = (200.0, 90.0);

fn finite(sim: &Simulation) -> bool {
    let s = sim.state();
    s.x.iter().chain(&s.sig).chain(&s.d).all(|v| v.is_finite())
}

/// Stops exactly at the end of the tables, between two samples, and names the part's path; a clamped run reports the same fact and continues.
#[test]
fn where_its_tables_end_each_model_stops_the_run_with_words_or_tells_them() {
    for (model, params, bind, says) in models() {
        // The cone's table ends at Mach 1, too.
        let start = if model == "sphere_cone" { (300.0, 90.0) } else { START };
        let mut stopped = scene(&text(model, &params, "stop", start, bind), &[]).unwrap();
        stopped.check().unwrap();
        let e = stopped.run_until(seconds(5.0)).unwrap_err();
        println!("{model}: {e}");
        assert!(e.message.contains(&format!("`Aero`: {says}")) && e.path == "Aero", "{model}: {e}");
        assert!(e.help.as_ref().unwrap().contains("or write `outside: clamp`"), "{e}");
        assert!(finite(&stopped), "{model}: what a step tried beyond is a number");
        assert_eq!(stopped.get("Aero.state.outside").unwrap(), 0.0);
        // The speed of sound is about √(1.29 · 188.92 · 210) m/s; the flow's output gives the exact value.
        let at = match model {
            "sphere_cone" => 2.55,
            _ => {
                assert!((stopped.get("Aero.mach").unwrap() - 1.0).abs() < 1e-9, "{model}");
                (stopped.get("Aero.airspeed").unwrap() - 200.0) / 50.0
            }
        };
        assert!((e.time - at).abs() < 1e-6 && (e.time * 10.0).fract() > 0.0, "{e}");
        assert!(stopped.take_notices().is_empty());
        // A run that is resumed from a checkpoint stops bit-identically.
        let mut cut = scene(&text(model, &params, "stop", start, bind), &[]).unwrap();
        cut.run_until(seconds(0.3)).unwrap();
        let saved = cut.checkpoint("").unwrap();
        let mut rest = scene(&text(model, &params, "stop", start, bind), &[]).unwrap();
        rest.restore(&saved).unwrap();
        assert_eq!(rest.run_until(seconds(5.0)).unwrap_err(), e);
        assert_eq!((rest.state(), rest.hash()), (stopped.state(), stopped.hash()));
        // With `clamp` the run continues beyond the same instant.
        let mut clamped = scene(&text(model, &params, "clamp", start, bind), &[]).unwrap();
        clamped.run_until(seconds(5.0)).unwrap();
        let told = clamped.take_notices();
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(told[0].0 == e.time && told[0].1.message == e.message, "{told:?} {e}");
        assert!(told[0].1.help.as_ref().unwrap().contains("or write `outside: stop`"));
        assert_eq!(clamped.get("Aero.state.outside").unwrap(), 1.0);
    }
}

#[test]
fn a_start_beyond_the_tables_is_refused_with_the_same_words() {
    for (model, params, bind, _) in models() {
        // An open canopy is in the flow from the start; the cone starts at an angle of 30 deg.
        let params = match model {
            "canopy" => format!("{params}, \"packed\": 0.2"),
            "sphere_cone" => params.replace("0.51, \"bluntness\"", "0.05, \"bluntness\""),
            _ => params,
        };
        let begin = if model == "sphere_cone" { (300.0, 60.0) } else { (300.0, 90.0) };
        let text = |outside: &str| text(model, &params, outside, begin, bind);
        let mut sim = scene(&text("stop"), &[]).unwrap();
        let e = sim.check().unwrap_err();
        println!("{model}: {e}");
        let words = match model {
            "canopy" => "Mach 1.2962 is beyond the rows of `efficiency`, which end at 1",
            "sphere_cone" => {
                "the flow begins at a total angle of attack of 30.00 deg, above the half-angle"
            }
            _ => "the flow begins outside the tables, ",
        };
        assert!(e.time == 0.0 && e.message.contains(words), "{e}");
        assert_eq!(sim.step().unwrap_err(), e);
        // With `clamp` there is a warning at the start, and the run continues.
        let mut sim = scene(&text("clamp"), &[]).unwrap();
        let told = sim.startup_warnings();
        assert!(told.iter().any(|fault| fault.message == e.message), "{told:?} {e}");
        sim.run_until(seconds(0.5)).unwrap();
    }
}

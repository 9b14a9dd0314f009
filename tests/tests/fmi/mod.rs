//! FMUs of both versions and both kinds, compiled from C here: equal to the native model, bit-identical after interruptions, rejected with a message
//! if invalid.
mod bad;
mod clocks;
mod export;
mod saves;
mod support;

use support::{Bench, Model, compiler, run};

const VERSIONS: [u8; 2] = [2, 3];

/// The spring made of parts from `basics`, with the force of `Force`, and the FMU next to it.
fn spring(unit: &str, step: &str, wires: &str) -> String {
    format!(
        r#"Simulation(
    parts: {{
        "Force": (model: "basics.sine", params: {{ "amplitude": 2.0, "frequency": "0.8 Hz" }}),
        "Rate": (model: "basics.integrator"),
        "Place": (model: "basics.integrator", params: {{ "start": 1.0 }}),
        "Stiffness": (model: "basics.gain", params: {{ "k": -4.0 }}),
        "Damping": (model: "basics.gain", params: {{ "k": -0.4 }}),
        "Pull": (model: "basics.sum"),
        "Half": (model: "basics.gain", params: {{ "k": 0.5 }}),
        "Spring": ({unit}),
    }},
    wires: [
        "Force.y -> Pull.u", "Stiffness.y -> Pull.u", "Damping.y -> Pull.u",
        "Place.y -> Stiffness.u", "Rate.y -> Damping.u", "Rate.y -> Place.u",
        "Pull.y -> Half.u", "Half.y -> Rate.u", {wires}
    ],
    step: "{step}", integrator: "rk4", until: "10 s",
)"#
    )
}

/// With model exchange the FMU is part of the whole system: the same method with the same steps gives the native model up to round-off from a
/// different order of summation.
#[test]
fn a_spring_as_equations_is_the_native_spring() {
    if !compiler() {
        return;
    }
    for version in VERSIONS {
        let bench = Bench::new();
        bench.unit("spring.fmu", version, Model::Spring, |t| t);
        let unit = r#"model: "fmi.model_exchange", params: { "file": "spring.fmu", "start": { "mass": "2 kg" } }"#;
        let wires = r#""Force.y -> Spring.force""#;
        let mut sim = bench.sim(&spring(unit, "2 ms", wires)).unwrap();
        let mut worst = 0.0f64;
        for k in 1..=100 {
            run(&mut sim, 0.02 * f64::from(k));
            for (own, native) in
                [("Spring.x", "Place.y"), ("Spring.v", "Rate.y"), ("Spring.spring_a", "Half.y")]
            {
                let error = (sim.get(own).unwrap() - sim.get(native).unwrap()).abs();
                worst = if error.is_nan() { error } else { worst.max(error) };
            }
        }
        // Measured: 1e-15.
        println!("FMI {version}: {worst:e}");
        assert!(worst < 1e-14, "{worst}");
        assert_eq!(sim.variable("Spring.x").unwrap().unit, "m");
        assert_eq!(sim.variable("Spring.spring_a").unwrap().unit, "m s^-2");
        assert_eq!(sim.get("Spring.state.x").unwrap(), sim.get("Spring.x").unwrap());
    }
}

/// An FMU with its own solver gets its input held over a communication step, so the error is of first order in this step.
#[test]
fn co_simulation_comes_nearer_with_the_communication_step() {
    if !compiler() {
        return;
    }
    for version in VERSIONS {
        let bench = Bench::new();
        bench.unit("spring.fmu", version, Model::Spring, |t| t);
        let error = |step: &str| {
            let unit = format!(
                r#"model: "fmi.co_simulation", rate: "{step}", params: {{ "file": "spring.fmu", "start": {{ "mass": 2.0 }} }}"#
            );
            let wires = r#""Force.y -> Spring.force""#;
            let mut sim = bench.sim(&spring(&unit, "1 ms", wires)).unwrap();
            (1..=50).fold(0.0f64, |worst, k| {
                run(&mut sim, f64::from(40 * k) / 1000.0);
                let error = sim.get("Spring.x").unwrap() - sim.get("Place.y").unwrap();
                if error.is_nan() { error } else { worst.max(error.abs()) }
            })
        };
        let errors = ["40 ms", "20 ms", "10 ms", "5 ms"].map(error);
        println!("FMI {version}: {errors:?}");
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((ratio - 2.0).abs() < 0.1, "{errors:?}");
        }
        assert!(errors[3] < 1e-3, "{errors:?}");
        // Without inputs only the FMU's own solver has an error: it is of fourth order with steps
        // of 10 ms / 4.
        let alone =
            r#"model: "fmi.co_simulation", rate: "10 ms", params: { "file": "spring.fmu" }"#;
        let mut sim = bench.sim(&spring(alone, "10 ms", "")).unwrap();
        run(&mut sim, 2.0);
        let (zeta, t) = (0.2f64, 2.0f64);
        let w = (4.0 - zeta * zeta).sqrt();
        let exact = (-zeta * t).exp() * ((w * t).cos() + zeta / w * (w * t).sin());
        let x = sim.get("Spring.x").unwrap();
        assert!((x - exact).abs() < 1e-10, "{x} {exact}");
    }
}

fn ball(unit: &str, more: &str) -> String {
    format!(
        r#"Simulation(
    parts: {{
        "Native": (model: "basics.bouncing_ball", params: {{ "height": "1 m", "restitution": 0.8, "gravity": 9.81 }}),
        "Ball": ({unit}),
        {more}
    }},
    step: "50 ms", integrator: "dormand_prince_54", until: "10 s",
)"#
    )
}

/// Impacts are the FMU's event indicator, located like those of the native ball; a lamp switches on at a time event between two samples.
#[test]
fn a_ball_bounces_like_the_native_one() {
    if !compiler() {
        return;
    }
    for version in VERSIONS {
        let bench = Bench::new();
        bench.unit("ball.fmu", version, Model::Ball, |t| t);
        let text = ball(
            r#"model: "fmi.model_exchange", params: { "file": "ball.fmu", "start": { "on_at": "0.26 s" } }"#,
            "",
        );
        let mut sim = bench.sim(&text).unwrap();
        let (mut worst, mut lamp) = (0.0f64, None);
        while sim.time() < 2.0 {
            sim.step_event().unwrap();
            if sim.get("Ball.lamp").unwrap() > 0.5 && lamp.is_none() {
                lamp = Some(sim.time());
            }
            let error = (sim.get("Ball.h").unwrap() - sim.get("Native.height").unwrap()).abs();
            worst = if error.is_nan() { error } else { worst.max(error) };
        }
        println!("FMI {version}: {worst:e}, lamp at {lamp:?}");
        assert_eq!(sim.get("Ball.n").unwrap(), sim.get("Native.impacts").unwrap());
        assert!(sim.get("Ball.n").unwrap() >= 3.0);
        // Events are located to 1 ps, and the speed is 4.4 m/s.
        assert!(worst < 1e-10, "{worst}");
        assert!((lamp.unwrap() - 0.26).abs() < 1e-11, "{lamp:?}");

        // With its own solver the FMU gives equal values at the communication points.
        let text = ball(
            r#"model: "fmi.co_simulation", rate: "50 ms", params: { "file": "ball.fmu" }"#,
            "",
        );
        let mut sim = bench.sim(&text).unwrap();
        run(&mut sim, 2.0);
        let (h, native) = (sim.get("Ball.h").unwrap(), sim.get("Native.height").unwrap());
        assert_eq!(sim.get("Ball.n").unwrap(), sim.get("Native.impacts").unwrap());
        assert!((h - native).abs() < 1e-9, "{h} {native}");
    }
}

/// A co-simulation FMU with event mode stops at its impacts, which it handles in event mode; otherwise the ball would fall through the floor. Its
/// integer is set in event mode, outside of which the FMU rejects it.
#[test]
fn co_simulation_stops_at_the_events_of_a_unit() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    let events = |t: String| t.replace("<CoSimulation ", "<CoSimulation hasEventMode=\"true\" ");
    bench.unit("ball.fmu", 3, Model::Ball, events);
    let unit = r#"model: "fmi.co_simulation", rate: "50 ms", params: { "file": "ball.fmu" }"#;
    let mut sim = bench.sim(&ball(unit, "")).unwrap();
    run(&mut sim, 2.0);
    let (h, native) = (sim.get("Ball.h").unwrap(), sim.get("Native.height").unwrap());
    assert_eq!(sim.get("Ball.n").unwrap(), sim.get("Native.impacts").unwrap());
    assert!(sim.get("Ball.n").unwrap() >= 3.0);
    assert!((h - native).abs() < 1e-9, "{h} {native}");

    let dig = r#""Dig": (model: "basics.step", params: { "time": "0.3 s", "after": 2.0 }),"#;
    let text = ball(unit, dig).replace("step:", "wires: [\"Dig.y -> Ball.floor\"], step:");
    let mut sim = bench.sim(&text).unwrap();
    // A fall of 3 m takes 0.782 s.
    for (time, n) in [(0.75, 0.0), (0.85, 1.0)] {
        run(&mut sim, time);
        assert_eq!(sim.get("Ball.n").unwrap(), n);
    }
}

/// An integer input reaches a model-exchange FMU at an event.
#[test]
fn a_whole_number_acts_at_an_event() {
    if !compiler() {
        return;
    }
    for version in VERSIONS {
        let bench = Bench::new();
        bench.unit("ball.fmu", version, Model::Ball, |t| t);
        let text = ball(
            r#"model: "fmi.model_exchange", params: { "file": "ball.fmu" }"#,
            r#""Dig": (model: "basics.step", params: { "time": "0.3 s", "after": 2.0 }),"#,
        );
        let text = text.replace("step:", "wires: [\"Dig.y -> Ball.floor\"], step:");
        let mut sim = bench.sim(&text).unwrap();
        run(&mut sim, 0.25);
        assert_eq!(sim.get("Ball.gap").unwrap(), sim.get("Ball.h").unwrap());
        run(&mut sim, 0.4);
        assert_eq!(sim.get("Ball.gap").unwrap(), sim.get("Ball.h").unwrap() + 2.0);
        run(&mut sim, 0.75);
        // A fall of 3 m takes 0.78 s.
        assert_eq!(sim.get("Ball.n").unwrap(), 0.0);
        run(&mut sim, 0.85);
        assert_eq!(sim.get("Ball.n").unwrap(), 1.0);
    }
}

/// An input that acts at events starts with another value than the FMU's: one event transfers it, and the FMU's states after the event are those of
/// the run. The ball falls at 1 m/s where the floor is 2 m above it: it is put on the floor and bounces once.
#[test]
fn an_event_at_the_start_keeps_the_states_of_the_unit() {
    if !compiler() {
        return;
    }
    for version in VERSIONS {
        let bench = Bench::new();
        bench.unit("ball.fmu", version, Model::Ball, |t| t);
        let text = ball(
            r#"model: "fmi.model_exchange", params: { "file": "ball.fmu", "start": { "v": -1 } }"#,
            r#""Up": (model: "basics.constant", params: { "value": -2 }),"#,
        );
        let text = text.replace("step:", "wires: [\"Up.y -> Ball.floor\"], step:");
        let mut sim = bench.sim(&text).unwrap();
        let at = |sim: &linkwork_runtime::Simulation| {
            ["n", "h", "v"].map(|v| sim.get(&format!("Ball.{v}")).unwrap())
        };
        let [n, h, v] = at(&sim);
        assert!(n == 1.0 && (h - 2.0).abs() < 1e-12 && (v - 0.8).abs() < 1e-12, "{n} {h} {v}");
        run(&mut sim, 0.1);
        let [n, h, _] = at(&sim);
        let flown = 2.0 + 0.8 * 0.1 - 9.81 * 0.005;
        assert!(n == 1.0 && (h - flown).abs() < 1e-12, "FMI {version}: {n} {h} {flown}");
    }
}

/// A start value of an input is the value of the input without a wire. With a wire, an input that acts at events changes from this value to the value
/// of the wire at the start, also if the wire has the start value of the description.
#[test]
fn start_values_of_inputs_hold_without_a_wire() {
    if !compiler() {
        return;
    }
    for version in VERSIONS {
        let bench = Bench::new();
        bench.unit("spring.fmu", version, Model::Spring, |t| t);
        bench.unit("ball.fmu", version, Model::Ball, |t| t);
        // A constant force of 6 N holds a spring of 4 N/m at 1.5 m.
        for kind in
            [r#"model: "fmi.model_exchange""#, r#"model: "fmi.co_simulation", rate: "10 ms""#]
        {
            let text = format!(
                r#"Simulation(parts: {{ "Spring": ({kind}, params: {{ "file": "spring.fmu", "start": {{ "x": 1.5, "force": "6 N" }} }}) }},
                    step: "10 ms", integrator: "rk4", until: "1 s")"#
            );
            let mut sim = bench.sim(&text).unwrap();
            run(&mut sim, 1.0);
            let x = sim.get("Spring.x").unwrap();
            assert!((x - 1.5).abs() < 1e-12, "FMI {version}, {kind}: {x}");
        }
        let unit = r#"model: "fmi.model_exchange", params: { "file": "ball.fmu", "start": { "floor": 3 } }"#;
        for (value, gap) in [("0", 0.0), ("2", 2.0), ("3", 3.0)] {
            let floor =
                format!(r#""Floor": (model: "basics.constant", params: {{ "value": {value} }}),"#);
            let text =
                ball(unit, &floor).replace("step:", "wires: [\"Floor.y -> Ball.floor\"], step:");
            let mut sim = bench.sim(&text).unwrap();
            run(&mut sim, 0.1);
            let found = sim.get("Ball.gap").unwrap() - sim.get("Ball.h").unwrap();
            assert!((found - gap).abs() < 1e-12, "FMI {version}, {value}: {found}");
        }
    }
}

/// Arrays are expanded into signals; values are exchanged in SI whatever unit the file has, states too.
#[test]
fn arrays_are_lanes_and_units_are_converted() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    bench.unit("metres.fmu", 3, Model::Spring, |t| t);
    bench.unit("millimetres.fmu", 3, Model::Spring, |t| {
        t.replace("start=\"1\" unit=\"m\"", "start=\"1\" unit=\"mm\"")
    });
    let part = |file: &str, x: &str| {
        format!(
            r#"(model: "fmi.model_exchange", params: {{ "file": "{file}", "start": {{ "x": "{x}" }} }})"#
        )
    };
    let text = format!(
        r#"Simulation(parts: {{ "A": {}, "B": {} }}, step: "10 ms", integrator: "rk4", until: "1 s")"#,
        part("metres.fmu", "0.7 m"),
        part("millimetres.fmu", "700 mm")
    );
    let mut sim = bench.sim(&text).unwrap();
    assert_eq!(sim.get("A.both[0]").unwrap(), 0.7);
    assert!((sim.get("B.x").unwrap() - 0.7).abs() < 1e-15);
    assert!((sim.get("B.state.x").unwrap() - 0.7).abs() < 1e-15);
    run(&mut sim, 1.0);
    let (a, b) = (sim.get("A.x").unwrap(), sim.get("B.x").unwrap());
    assert!((a - b).abs() < 1e-14 && a < 0.5, "{a} {b}");
    assert_eq!(sim.get("A.both[1]").unwrap(), sim.get("A.v").unwrap());
    // The raw number is a thousand times larger.
    assert!((sim.get("B.both[0]").unwrap() - 1e3 * b).abs() < 1e-11);
}

/// The unit of a difference does not have an offset: FMI 2.0.4, 2.2.3 and FMI 3.0.2, 2.2.4 (`relativeQuantity`), requested in FMPy issue 865. v and
/// the stiffness are temperature differences, x and the damping are temperatures.
#[test]
fn differences_of_temperatures_have_no_offset() {
    if !compiler() {
        return;
    }
    for version in VERSIONS {
        for by_type in [false, true] {
            let bench = Bench::new();
            let celsius = "<UnitDefinitions><Unit name=\"Celsius\"><BaseUnit K=\"1\" offset=\"273.15\"/></Unit>";
            let of = "unit=\"Celsius\" relativeQuantity=\"true\"";
            let types = match version {
                2 => format!(
                    "<TypeDefinitions><SimpleType name=\"Change\"><Real {of}/></SimpleType></TypeDefinitions>"
                ),
                _ => format!(
                    "<TypeDefinitions><Float64Type name=\"Change\" {of}/></TypeDefinitions>"
                ),
            };
            let change = if by_type { "declaredType=\"Change\"" } else { of };
            let described = |text: String| {
                let edits = [
                    ("<UnitDefinitions>", celsius.to_string()),
                    ("</UnitDefinitions>", format!("</UnitDefinitions>{types}")),
                    ("start=\"1\" unit=\"m\"", "start=\"1\" unit=\"Celsius\"".into()),
                    ("start=\"0\" unit=\"m/s\"", format!("start=\"0\" {change}")),
                    ("start=\"4\"", format!("start=\"4\" {change}")),
                    ("start=\"0.4\"", "start=\"0.4\" unit=\"Celsius\"".into()),
                ];
                edits.iter().fold(text, |text, (a, b)| {
                    assert!(text.contains(a), "{a}");
                    text.replacen(a, b, 1)
                })
            };
            bench.unit("spring.fmu", version, Model::Spring, described);
            for (written, k) in [("7 Celsius", 7.0), ("7 degC", 7.0), ("7 K", 7.0)] {
                let unit = format!(
                    r#"model: "fmi.model_exchange", params: {{ "file": "spring.fmu", "start": {{ "stiffness": "{written}", "damping": "0.4 degC" }} }}"#
                );
                let sim =
                    bench.sim(&spring(&unit, "2 ms", r#""Force.y -> Spring.force""#)).unwrap();
                let found =
                    ["Spring.x", "Spring.v", "Spring.spring_a"].map(|name| sim.get(name).unwrap());
                assert_eq!(
                    found,
                    [274.15, 0.0, -k],
                    "FMI {version}, {written}, by type: {by_type}"
                );
            }
        }
    }
}

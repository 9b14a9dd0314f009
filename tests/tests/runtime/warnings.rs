//! Mistakes that are allowed: each gives a warning with location and remedy, and supplied simulations have none.
use linkwork_assemblies::library;
use std::path::{Path, PathBuf};

/// Returns the warnings of a text as `line: fact / remedy`.
pub(super) fn warnings(text: &str) -> Vec<String> {
    let ready = library().text("test.ron", text).map_err(|f| f.render(false)).unwrap();
    let told = ready.warnings();
    let line = |f: &linkwork_runtime::Fault| {
        ready.loaded.sources.place(f.origin).map_or(0, |place| place.1)
    };
    told.iter()
        .map(|f| format!("{}: {} / {}", line(f), f.message, f.help.as_ref().unwrap()))
        .collect()
}

fn only(text: &str) -> String {
    let all = warnings(text);
    assert_eq!(all.len(), 1, "{all:#?}");
    all[0].clone()
}

fn simulations(folder: &Path, out: &mut Vec<PathBuf>) {
    let mut all: Vec<PathBuf> =
        std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    all.sort();
    for path in all {
        if path.is_dir() {
            simulations(&path, out);
        } else if path.extension().is_some_and(|e| e == "ron")
            && std::fs::read_to_string(&path).unwrap().contains("Simulation(")
        {
            out.push(path);
        }
    }
}

#[test]
fn no_simulation_of_the_project_has_a_warning() {
    let mut files = Vec::new();
    simulations(&linkwork_tests::root().join("sims"), &mut files);
    assert!(files.len() > 15, "{files:?}");
    let mut found = Vec::new();
    // The READMEs of these describe a preparation step (an FMU, a class); in the arm the FMU's input is
    // open.
    let elsewhere = ["fmu/side_by_side.ron", "python_controller/cart_pole.ron", "fmu/arm.ron"];
    files.retain(|file| !elsewhere.iter().any(|e| file.ends_with(e)));
    for file in files {
        // A coarse grid of the ground is built faster, and gives the same warnings.
        let rovers = ["rover_traverse/sim.ron", "mars_edl/sim.ron"];
        let coarse = rovers.iter().any(|f| file.ends_with(f));
        let set = if coarse { vec!["Rover.Environment.spacing=0.5".to_string()] } else { vec![] };
        let ready = library().file(&file, &set, None).map_err(|f| f.render(false)).unwrap();
        println!("{}", file.display());
        for w in ready.warnings() {
            found.push(format!("{}: {} / {:?}", file.display(), w.message, w.help));
        }
    }
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

/// A wheel on a fork over flat ground.
fn wheel(axis: &str, height: f64, node: &str) -> String {
    format!(
        r#"Simulation(
            bodies: {{
                "fork": (parent: "world", at: (position: [0, 0, {height}]), hinge: Slider([0, 0, 1]), mass: 40, inertia: [1, 1, 1]),
                "wheel": (parent: "fork", hinge: Pin({axis}), mass: 2, inertia: Cylinder(radius: 0.2, length: 0.1, axis: {axis}), nodes: {{ "hub": (), "across": (rotation: (rpy: ["90 deg", 0, 0])) }}),
            }},
            parts: {{
                "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
                "Ground": (model: "environment.flat", params: {{ "size": "10 m", "soil": {{ "kind": "lunar" }} }}),
                "Contact": (model: "mobility.wheel_rigid", params: {{ "radius": 0.2, "width": 0.1 }}, bind: {{ "hub": "node:{node}" }}),
            }},
            step: "1 ms", until: "1 s",
        )"#
    )
}

#[test]
fn an_axle_across_its_wheel_is_told() {
    let across = only(&wheel("[0, 0, 1]", 0.2, "wheel"));
    assert!(across.starts_with("9: `Contact`: binding `hub`: the axle of `node wheel` is at 90° to the hinge axis of `wheel`"), "{across}");
    let node = only(&wheel("[0, 1, 0]", 0.2, "wheel/across"));
    assert!(
        node.contains("the axle of `node wheel/across` is at 90° to the hinge axis of `wheel`")
            && node.contains("whose axis is parallel to its hinge axis"),
        "{node}"
    );
    assert!(warnings(&wheel("[0, 1, 0]", 0.2, "wheel")).is_empty());
    assert!(warnings(&wheel("[0.1, 1, 0]", 0.2, "wheel/hub")).is_empty(), "a little camber");
    // Only pins have an axle.
    assert!(warnings(&wheel("[0, 1, 0]", 0.2, "fork")).is_empty());
}

#[test]
fn a_wheel_that_starts_in_the_ground_is_told() {
    let deep = only(&wheel("[0, 1, 0]", 0.17, "wheel"));
    assert!(
        deep.starts_with(
            "9: `Contact`: the wheel starts 0.030 m deep in the ground, 15 % of its radius"
        ),
        "{deep}"
    );
    assert!(deep.contains("let `place` put the machine on the ground"));
    assert!(warnings(&wheel("[0, 1, 0]", 0.195, "wheel")).is_empty());
    let soil = |h: f64| wheel("[0, 1, 0]", h, "wheel").replace("wheel_rigid", "wheel_soil");
    assert!(only(&soil(0.1)).contains("50 % of its radius"));
    assert!(warnings(&soil(0.18)).is_empty());
}

#[test]
fn a_sensor_that_nobody_reads_is_told() {
    let text = |more: &str| {
        format!(
            r#"Simulation(
                bodies: {{ "arm": (parent: "world", hinge: Pin([0, 1, 0]), mass: 1, inertia: [1, 1, 1]) }},
                parts: {{
                    "Encoder": (model: "sensors.encoder", rate: "10 Hz", bind: {{ "shaft": "hinge:arm" }}),
                    "Twice": (model: "basics.gain", params: {{ "k": 2 }}),
                }},
                until: "1 s", {more}
            )"#
        )
    };
    let wires = r#"wires: ["Encoder.angle -> Twice.u"],"#;
    let all = warnings(&text(wires));
    assert_eq!(all.len(), 1, "{all:?}");
    assert!(all[0].starts_with("5: no output of `Twice` is read / wire, log or plot"), "{all:?}");
    for reader in [
        r#"log: [(channels: ["Twice"])],"#,
        r#"log: [(channels: ["**"])],"#,
        r#"plots: [(title: "Turns", of: ["Twice.y"])],"#,
        r#"metrics: { "last": (of: "Twice.y", take: "last") },"#,
        r#"stop_when: "Twice.y","#,
        r#"start: "a", phases: { "a": (to: { "b": "Twice.y > 3" }), "b": () },"#,
    ] {
        let all = warnings(&text(&format!("{wires} {reader}")));
        assert!(all.is_empty(), "{reader}: {all:?}");
    }
    // The sensor is only read in a later phase.
    let later = r#"start: "a", phases: { "a": (to: { "b": "time > 1 s" }), "b": (wires: ["Twice.y -> Again.u"], parts: { "Again": (model: "basics.gain", params: { "k": 2 }) }) },"#;
    let all = warnings(&text(&format!("{wires} {later}")));
    assert!(all.is_empty(), "{all:?}");
}

#[test]
fn colliders_without_contact_are_told() {
    let text = |more: &str| {
        format!(
            r#"Simulation(
                bodies: {{
                    "ball": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), initial: (position: [0, 0, 1]), shapes: [(shape: Sphere(0.1), collide: true)]),
                }},
                colliders: {{ "floor": (on: "world", shape: HalfSpace) }},
                gravity: "none", until: "1 s", {more}
            )"#
        )
    };
    let told = only(&text(""));
    assert!(
        told.contains("2 shapes collide, but there is no `contact`, so nothing collides")
            && told.starts_with("3: "),
        "{told}"
    );
    assert!(told.contains("write `contact: ()`"));
    assert!(warnings(&text("contact: (),")).is_empty());
    let compliant = warnings(&text("contact: (compliant: ()),"));
    assert!(compliant.is_empty(), "{compliant:?}");
    let phase = r#"start: "flies", phases: { "flies": (to: { "lands": "time > 1 s" }), "lands": (contact: ()) },"#;
    assert!(warnings(&text(phase)).is_empty(), "contact in a later phase");
}

/// A mass on a spring, and an independent lag.
fn stiff(step: &str, more: &str) -> String {
    format!(
        r#"Simulation(
            bodies: {{ "mass": (parent: "world", hinge: Slider([1, 0, 0]), mass: 2, inertia: [1, 1, 1]) }},
            parts: {{
                "Spring": (model: "actuators.spring_damper", params: {{ "stiffness": 20000, "damping": 2 }}, bind: {{ "shaft": "hinge:mass" }}),
                "Wave": (model: "basics.sine"),
                "Lag": (model: "basics.lag", params: {{ "time_constant": "2 ms" }}),
            }},
            wires: ["Wave.y -> Lag.u"],
            log: [(channels: ["**"])],
            gravity: "none", until: "1 s", step: "{step}", {more}
        )"#
    )
}

#[test]
fn a_step_too_long_is_told_with_the_one_that_would_do() {
    // RK4 requires h / T < 2.785 for the lag, which is 5.57 ms; the spring's 100 rad/s would permit
    // 28 ms.
    let told = only(&stiff("6 ms", ""));
    assert!(
        told.starts_with(
            "6: the step of 0.006 s is too long: errors of `Lag.state.x` grow by a factor of 1.375 in each step"
        ),
        "{told}"
    );
    assert!(
        told.contains("write `step: \"0.0044 s\"` or less") && told.contains("rodas4p"),
        "{told}"
    );
    assert!(warnings(&stiff("4.4 ms", "")).is_empty());
    // Semi-implicit Euler requires h / T < 2, which is 4 ms.
    let euler = r#"integrator: "semi_implicit_euler","#;
    assert!(only(&stiff("4.4 ms", euler)).contains("`step: \"0.0032 s\"`"));
    assert!(warnings(&stiff("3.2 ms", euler)).is_empty());
    // The spring alone limits the step.
    let spring = |step: &str, more: &str| stiff(step, more).replace("2 ms\" }", "2 s\" }");
    let told = only(&spring("30 ms", ""));
    assert!(told.contains("`mass.") && told.contains("0.022 s"), "{told}");
    assert!(warnings(&spring("22 ms", "")).is_empty());
    assert!(only(&spring("30 ms", euler)).contains("`step: \"0.015 s\"`"));
    // Adaptive methods choose their steps.
    for integrator in ["dormand_prince_54", "rodas4p"] {
        assert!(warnings(&stiff("6 ms", &format!("integrator: \"{integrator}\","))).is_empty());
    }
    // In a complete mechanism the limit comes from the back-EMF, 55.6 N m s/rad on the 0.33 kg m² of a wheel, and from the ground
    // that it drives on.
    let set = ["step=30 ms".to_string()];
    let file = linkwork_tests::root().join("sims/rocky8/sim.ron");
    let ready = library().file(&file, &set, None).map_err(|f| f.render(false)).unwrap();
    let told = ready.warnings();
    assert_eq!(told.len(), 1, "{told:?}");
    let fact = &told[0].message;
    assert!(fact.contains("the step of 0.03 s is too long"), "{fact}");
    // The warning is correct: slightly above the stated step the run diverges, at this step it does
    // not.
    let end = |step: &str| {
        let ready =
            library().text("test.ron", &stiff(step, "")).map_err(|f| f.render(false)).unwrap();
        let mut sim = linkwork_runtime::Simulation::of(std::sync::Arc::new(ready.program));
        sim.run_until(linkwork_runtime::Seconds::from_decimal(6.0).unwrap())
            .map(|()| sim.get("Lag.y").unwrap())
    };
    assert!(end("4.4 ms").unwrap().abs() < 2.0);
    assert!(end("6 ms").map_or(true, |y| y.abs() > 1e3));
}

/// A box on a floor, with more of `contact` and of the simulation.
fn box_on_floor(contact: &str, more: &str) -> String {
    format!(
        r#"Simulation(bodies: {{ "box": (parent: "world", hinge: Free, mass: 1, inertia: Box([0.2, 0.2, 0.2]), initial: (position: [0, 0, 0.15], angular: [3, 2, 1]),
            shapes: [(shape: Box([0.2, 0.2, 0.2]), collide: true, name: "s")]) }}, colliders: {{ "floor": (on: "world", shape: HalfSpace) }},
            contact: ({contact}), parts: {{ "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}) }},
            step: "2 ms", until: "1 s",
            {more})"#
    )
}

#[test]
fn an_integrator_that_contact_replaces_is_told() {
    let told = only(&box_on_floor("", "integrator: \"dormand_prince_54\""));
    assert!(
        told.starts_with("5: `integrator: dormand_prince_54` does not move the bodies"),
        "{told}"
    );
    assert!(told.contains("write `compliant: true` in `contact`"), "{told}");
    // Nothing is replaced if the file does not write an `integrator`, if it writes the integrator of contact, or if the forces are
    // smooth and integrated.
    assert!(warnings(&box_on_floor("", "")).is_empty());
    assert!(warnings(&box_on_floor("", "integrator: \"semi_implicit_euler\"")).is_empty());
    assert!(warnings(&box_on_floor("compliant: true", "integrator: \"rk4\"")).is_empty());
}

/// Once per run, with the residual and the remedy.
#[test]
fn a_contact_step_that_was_not_solved_is_told() {
    let told = |contact: &str| {
        let text = box_on_floor(contact, "");
        let ready = library().text("test.ron", &text).map_err(|f| f.render(false)).unwrap();
        let mut sim = linkwork_runtime::Simulation::of(std::sync::Arc::new(ready.program));
        sim.run_until(linkwork_runtime::Seconds::from_decimal(0.5).unwrap()).unwrap();
        sim.take_notices()
    };
    assert!(told("").is_empty());
    let all = told("method: GaussSeidel, sweeps: 1, tolerance: 1e-12");
    assert_eq!(all.len(), 1, "{all:?}");
    let (fact, help) = (&all[0].1.message, all[0].1.help.as_ref().unwrap());
    assert!(
        fact.starts_with("`Mechanism`: a contact step did not converge: its residual"),
        "{fact}"
    );
    assert!(fact.contains("contact points in 1 islands"), "{fact}");
    assert!(help.starts_with("increase `sweeps`"), "{help}");
}

/// One report for everything: a unit, a parameter, a body, a connection, and a plot of a variable that does not exist.
#[test]
fn mistakes_of_all_kinds_are_in_one_report() {
    let told = |text: &str| library().text("test.ron", text).err().unwrap().render(false);
    let parts = "\"A\": (model: \"basics.constant\", params: { \"value\": 1 }),
        \"B\": (model: \"basics.gain\", params: { PARAMS }), \"D\": (model: \"basics.gain\", params: { MORE }),";
    let text = |params: &str, more: &str, wires: &str, log: &str| {
        let parts = parts.replace("PARAMS", params).replace("MORE", more);
        format!(
            "Simulation(until: \"1 s\", step: \"1 ms\", parts: {{ {parts} }}, wires: [{wires}],
            plots: [(title: \"Twice\", of: [\"B.yy\"])], log: [(channels: [{log}])])"
        )
    };
    // These mistakes are found while the file is read.
    let report = told(&text("\"k\": \"2 dge\"", "", "\"A.y -> B.u\"", "\"**\", \"B.state.x\""));
    for part in [
        "`dge` is not a unit: there is no such symbol",
        "`B.yy` matches no variable",
        "did you mean `B.y`?",
        "`B.state.x` matches no variable",
        "4 mistakes",
    ] {
        assert!(report.contains(part), "{part} is missing in\n{report}");
    }
    // These mistakes are found while the simulation is compiled.
    let report = told(&text("\"k\": 2", "\"kk\": 3", "\"A.y -> B.v\"", "\"A.*\""));
    for part in ["`D` has no parameter `kk`", "`B` has no input `v`", "`B.yy` matches no variable"]
    {
        assert!(report.contains(part), "{part} is missing in\n{report}");
    }
    // Consequences of other mistakes are not reported.
    let log = "\"chassis/body.angle\", \"C.*.y\"";
    let report = told(&text("\"k\": 2", "\"kk\": 3", "\"A.y -> B.v\"", log));
    assert_eq!(report.matches("matches no variable").count(), 1, "{report}");
}

/// Returns a simulation of a part `P` and the body `b` on a hinge, with a supply if `more` connects it.
fn with_part(part: &str, more: &str) -> String {
    let supply = match more.contains("Supply") {
        true => r#""Supply": (model: "power.ideal_supply", params: { "voltage": 28 }),"#,
        false => "",
    };
    format!(
        r#"Simulation(
            bodies: {{ "b": (parent: "world", hinge: Pin([0, 0, 1]), mass: 1, inertia: [1, 1, 1]) }}, gravity: "none",
            parts: {{
                {part},
                {supply}
            }},
            step: "1 ms", until: "1 s", log: [(channels: ["**"])], {more}
        )"#
    )
}

#[test]
fn parameters_without_an_effect_are_told() {
    let motor = |params: &str| {
        format!(
            r#""P": (model: "actuators.dc_motor", bind: {{ "shaft": "hinge:b" }}, params: {{ "resistance": 1, "torque_constant": 1, {params} }})"#
        )
    };
    let connect = r#"connect: [("P.supply", "Supply.terminal")]"#;
    let told = only(&with_part(&motor(r#""hold_stiffness": 300"#), connect));
    assert_eq!(
        told,
        "4: `P`: `hold_stiffness` has no effect: `coulomb` is 0 and `brake` is 0 and `efficiency` is 1 / remove it, or write `coulomb` or `brake` or `efficiency`"
    );
    for acts in [
        r#""hold_stiffness": 300, "coulomb": "2 N m""#,
        r#""hold_stiffness": 300, "efficiency": 0.9"#,
        r#""hold_stiffness": 10000"#,
    ] {
        let all = warnings(&with_part(&motor(acts), connect));
        assert!(all.is_empty(), "{acts}: {all:#?}");
    }
    // It acts in another phase.
    let phases = r#"start: "one", phases: { "one": (to: { "two": "time > 0.5 s" }), "two": (parts: { "P": (params: { "coulomb": 2 }) }) }"#;
    let text = with_part(&motor(r#""hold_stiffness": 300"#), &format!("{connect}, {phases}"));
    assert!(warnings(&text).is_empty(), "{:#?}", warnings(&text));
    for (part, more, fact) in [
        (
            r#""P": (model: "power.load", params: { "power_on": 3, "volts_rated": 12, "volts_min": 5 })"#,
            connect,
            "`volts_rated` has no effect: `law` is power",
        ),
        (
            r#""P": (model: "flight.reaction_wheel", bind: { "wheel": "node:b" }, params: { "inertia": 0.1, "coulomb": 0.1, "stribeck": 3 })"#,
            connect,
            "`stribeck` has no effect: `breakaway` is 0",
        ),
        (
            r#""P": (model: "actuators.spring_damper", bind: { "shaft": "hinge:b" }, params: { "damping": 1, "rest": "20 deg" })"#,
            "",
            "`rest` has no effect: `stiffness` is 0",
        ),
    ] {
        let told = warnings(&with_part(part, more));
        assert!(told.iter().any(|w| w.contains(fact)), "{told:#?}");
    }
}

#[test]
fn colours_of_the_view_without_an_object_are_told() {
    let ball = r#""P": (model: "basics.constant", params: { "value": 1 })"#;
    let told = warnings(&with_part(ball, "view: (ground: [1, 0, 0], planet: [0, 0, 1])"));
    assert!(
        told.len() == 2
            && told[0].contains("`ground` has no effect: the simulation has no terrain")
            && told[1].contains("`planet` has no effect: W is not a site on a planet"),
        "{told:#?}"
    );
    let planet = r#"view: (planet: [0, 0, 1], planet_radius: "6378 km")"#;
    assert!(warnings(&with_part(ball, planet)).is_empty());
}

//! Parameters without an effect, wires without an effect, and commands that nobody gives: each causes a warning with its reason, and none where it
//! acts.
use super::warnings::warnings;

/// A simulation with two free bodies. `parts` closes the map of parts and continues with other fields.
fn free(parts: &str) -> String {
    let gravity = if parts.contains("gravity\"") { "" } else { r#"gravity: "none","# };
    format!(
        r#"Simulation(bodies: {{ "s": (parent: "world", hinge: Free, mass: 100, inertia: [40, 40, 10]), "t": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), initial: (position: [0, 0, 5])) }},
            {gravity} parts: {{ {parts} step: "10 ms", until: "0.1 s", log: [(channels: ["**"])])"#
    )
}

/// Asserts that the only warning contains the fact; an empty fact: there is no warning.
fn told(text: &str, fact: &str) {
    let all = warnings(text);
    match fact {
        "" => assert!(all.is_empty(), "{text}: {all:#?}"),
        _ => assert!(all.len() == 1 && all[0].contains(fact), "{fact}: {all:#?}"),
    }
}

const FEED: &str = r#""F": (model: "flight.ideal_feed"), "Full": (model: "basics.constant", params: { "value": 1 }),"#;
const AIR: &str = r#""Air": (model: "environment.exponential_atmosphere", params: { "density": 1, "scale_height": 8000, "temperature": 280, "gas_constant": 287, "heat_ratio": 1.4, "heating_constant": 0 }), "G": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }),"#;

#[test]
fn commands_that_nobody_gives_are_told() {
    let motor = |params: &str| {
        format!(
            r#""F": (model: "flight.ideal_feed"), "M": (model: "flight.solid_motor", params: {{ "curve": [[0, 10], [1, 0]], "specific_impulse": 250, {params} }}, bind: {{ "nozzle": "node:s" }}), }}, connect: [("M.propellant", "F.outlet")],"#
        )
    };
    let fact = "`ignite` has no effect: no wire leads to `ignite`; `start` is not written, so the motor never ignites";
    told(&free(&motor("")), fact);
    told(&free(&motor(r#""start": 1"#)), "");
    let wired = r#""One": (model: "basics.constant", params: { "value": 1 }), "#;
    let text = free(&format!("{wired}{}", motor("")))
        .replace("step:", r#"wires: ["One.y -> M.ignite"], step:"#);
    told(&text, "");
    let both = free(&format!("{wired}{}", motor(r#""start": 1"#)));
    told(
        &both.replace("step:", r#"wires: ["One.y -> M.ignite"], step:"#),
        "`ignite` has no effect: `start` determines the ignition",
    );
    let canopy = format!(
        r#"{AIR} "C": (model: "flight.canopy", params: {{ "diameter": 1, "drag_coefficient": 1, "filling_time": 0.1 }}, bind: {{ "canopy": "node:s" }}) }},"#
    );
    told(&free(&canopy), "the canopy never opens");
    let pyro = r#""P": (model: "flight.pyro", params: { "impulse": 10 }, bind: { "a": "node:s", "b": "node:t" }) },"#;
    told(&free(pyro), "the device never fires");
    let thruster = r#""F": (model: "flight.ideal_feed"), "T": (model: "flight.thruster", params: { "thrust": 10 }, bind: { "nozzle": "node:s" }) }, connect: [("T.propellant", "F.outlet")],"#;
    told(
        &free(thruster),
        "`command` has no effect: no wire leads to `command`; the thruster never fires",
    );
    let load = r#""S": (model: "power.ideal_supply", params: { "voltage": 28 }), "L": (model: "power.load", params: { "power_on": 10 }) }, connect: [("L.supply", "S.terminal")],"#;
    told(&free(load), "`power_on` has no effect: no wire leads to `on`; the load never draws it");
}

#[test]
fn wires_and_limits_without_an_effect_are_told() {
    let engine = |params: &str, wires: &str| {
        free(&format!(
            r#"{FEED} "E": (model: "flight.engine", params: {{ "thrust": 10, "specific_impulse": 200, {params} }}, bind: {{ "nozzle": "node:s" }}) }},
            connect: [("E.propellant", "F.outlet")], wires: ["Full.y -> E.throttle", {wires}],"#
        ))
    };
    let gimbal = r#""Full.y -> E.gimbal_x""#;
    told(&engine("", ""), "");
    told(&engine("", gimbal), "`E`: `gimbal_x` has no effect: `gimbal_max` is 0");
    told(&engine(r#""gimbal_max": 0.1"#, gimbal), "");
    told(
        &engine(r#""gimbal_max": 0.1"#, ""),
        "`gimbal_max` has no effect: no wire leads to `gimbal_x` or `gimbal_y`",
    );
    let follower = |params: &str, wire: &str| {
        free(&format!(
            r#""X": (model: "basics.constant", params: {{ "value": 0 }}), "D": (model: "control.waypoint_follower", rate: "1 Hz", params: {{ "waypoints": [[3, 0]], "speed": 1, {params} }}) }},
            wires: ["X.y -> D.x", "X.y -> D.y", "X.y -> D.heading", {wire}],"#
        ))
    };
    told(
        &follower(r#""tilt_max": 0.3"#, ""),
        "`tilt_max` has no effect: no wire leads to `tilt`; the rover never stops at this limit",
    );
    told(&follower(r#""slip_max": 0.3"#, ""), "`slip_max` has no effect");
    told(&follower(r#""tilt_max": 0.3"#, r#""X.y -> D.tilt""#), "");
    let node = r#""N": (model: "power.thermal_node", params: { "capacity": 10, "temperature": 300 }), "T": (model: "basics.constant", params: { "value": 200 }) }, wires: ["T.y -> N.sky"],"#;
    told(&free(node), "`sky` has no effect: `emissivity` is 0");
    // In another phase the engine has a gimbal.
    let text = engine("", gimbal).replace(
        "step:",
        r#"start: "one", phases: { "one": (to: { "two": "time > 1 s" }), "two": (parts: { "E": (params: { "gimbal_max": 0.1 }) }) }, step:"#,
    );
    told(&text, "");
}

#[test]
fn parameters_that_need_others_are_told() {
    let terrain = |params: &str| {
        free(&format!(
            r#""T": (model: "environment.generated_terrain", params: {{ "size": [10, 10], "spacing": 1, "relief": 0, {params} }}) }},"#
        ))
    };
    for (params, name) in [
        (r#""hurst": 0.2"#, "hurst"),
        (r#""wavelength": 5"#, "wavelength"),
        (r#""crater_diffusivity_m2_myr": 8"#, "crater_diffusivity_m2_myr"),
        (r#""rock_burial": [0.1, 0.2]"#, "rock_burial"),
    ] {
        told(&terrain(params), &format!("`{name}` has no effect"));
    }
    told(&terrain(r#""rock_cover": 0.1, "rock_burial": [0.1, 0.2]"#), "");
    let canopy = |params: &str| {
        free(&format!(
            r#"{AIR} "C": (model: "flight.canopy", params: {{ "diameter": 1, "drag_coefficient": 1, "start": 1, {params} }}, bind: {{ "canopy": "node:s" }}) }},"#
        ))
    };
    told(
        &canopy(r#""filling_time": 0.1, "porosity": 12"#),
        "`porosity` has no effect: `filling_time` is 0.1",
    );
    told(&canopy(r#""porosity": 12"#), "");
    told(
        &canopy(r#""porosity": 12, "breathing_frequency": 3"#),
        "`breathing_frequency` has no effect: `breathing` is 0",
    );
    let airbag = |params: &str| {
        free(&format!(
            r#""A": (model: "flight.airbag", params: {{ "radius": 1, "pressure": 1e5, "ground": -10, {params} }}, bind: {{ "centre": "node:s" }}) }},"#
        ))
    };
    told(&airbag(r#""vent_area": 0.01"#), "`vent_area` has no effect: `vent` is not written");
    told(&airbag(r#""vent_area": 0.01, "vent": 2e5"#), "");
    let camera = |params: &str| {
        free(&format!(
            r#""T": (model: "environment.flat"), "C": (model: "sensors.camera", rate: "1 Hz", params: {{ "width": 20, "height": 10, {params} }}, bind: {{ "mount": "node:s" }}) }},"#
        ))
    };
    let text = camera(r#""disparities": 32"#);
    assert!(
        warnings(&text)
            .iter()
            .any(|w| w.contains("`disparities` has no effect: `baseline` is not written")),
        "{:#?}",
        warnings(&text)
    );
}

/// The events of the start release the spring and make the line taut; the warnings are about the states before.
#[test]
fn states_that_the_start_ends_at_once_are_told() {
    let between = |model: &str, params: &str| {
        free(&format!(
            r#""P": (model: "flight.{model}", params: {{ {params} }}, bind: {{ "a": "node:s", "b": "node:t" }}) }},"#
        ))
    };
    let released = "it is already released";
    told(&between("kickoff_spring", r#""stiffness": 100, "length": 0.5"#), released);
    told(&between("kickoff_spring", r#""stiffness": 100, "length": 6"#), "");
    told(
        &between("separation_spring", r#""stiffness": 100, "stroke": 0.5, "axis": [0, 0, 1]"#),
        released,
    );
    let line = |model: &str, length: f64, more: &str| {
        between(model, &format!(r#""length": {length:?}, "stiffness": 100, {more}"#))
    };
    let longer =
        "starts 1.000000 m longer than its unstretched length, so it pulls with 100.000 N at once";
    told(&line("line", 4.0, ""), longer);
    told(&line("line", 4.0, r#""taut": true"#), "");
    told(&line("line", 5.5, ""), "");
    told(&line("bridle", 4.0, r#""let_out": 1, "payout": 1"#), longer);
}

/// A value that an assembly passes on from the default of its own parameter requests nothing; the same value written by the user does.
#[test]
fn the_default_of_an_assembly_requests_nothing() {
    let yard = |params: &str| {
        format!(
            r#"Simulation(
                parts: {{ "Yard": (assembly: "worlds/moon_yard.ron", params: {{ "spacing": 0.5, "craters": 0, "rock_cover": 0, "relief": 0, {params} }}) }},
                step: "10 ms", until: "0.1 s",
            )"#
        )
    };
    told(&yard(""), "");
    told(
        &yard(r#""crater_diameters": [2, 5]"#),
        "`crater_diameters` has no effect: `craters` is 0 and `crater_age_gyr` is 0",
    );
    told(
        &yard(r#""rock_diameters": [0.2, 0.3]"#),
        "`rock_diameters` has no effect: `rock_cover` is 0",
    );
    told(&yard(r#""clear": [[0, 0, 3]]"#), "`clear` has no effect: `craters` is 0");
    told(&yard(r#""seed": 9"#), "`seed` has no effect: `relief` is 0");
    told(&yard(r#""seed": 9, "craters": 1"#).replacen(r#""craters": 0, "#, "", 1), "");
    let slope = |params: &str| {
        format!(
            r#"Simulation(parts: {{ "Ground": (assembly: "worlds/slope.ron", params: {{ {params} }}) }}, step: "10 ms", until: "0.1 s")"#
        )
    };
    told(&slope(r#""slope": 0"#), "");
    told(&slope(r#""slope": 0, "uphill": "30 deg""#), "`uphill` has no effect: `slope` is 0");
    told(&slope(r#""slope": 0.1, "uphill": "30 deg""#), "");
    let flat = |params: &str| {
        free(&format!(r#""T": (model: "environment.flat", params: {{ {params} }}) }},"#))
    };
    told(&flat(r#""uphill": 1"#), "`uphill` has no effect: `slope` is 0");
    told(&flat(r#""uphill": 1, "slope": 0.1"#), "");
}

//! Jumps and kinks of signals and forces end a step, so their integral is the same for every integrator and any sampling.
use crate::common;
use linkwork_assembly::{Options, load_text};
use linkwork_runtime::{Catalogue, Files, Seconds, Simulation};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Shape of an output between its jumps, which determines the methods that integrate it exactly for any step.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Between {
    /// Constant, or an average over the step: exact for all methods.
    Constant,
    /// Linear: exact except for the Euler method.
    Straight,
    /// Adaptive methods, and RK4 with short steps.
    Curved,
}
use Between::{Constant, Curved, Straight};

/// The integrated system: models that jump, and parts and connections that pass the signal to `I.u` or to the speed of a body, its integral.
struct Rig {
    models: &'static [&'static str],
    between: Between,
    parts: &'static str,
    connect: &'static str,
    wires: &'static str,
    /// The variables read at the end, and their expected values: speeds and integrals, propellant, charge, numbers of pulses.
    reads: &'static [(&'static str, f64)],
}

/// Standard gravity, m/s², which relates impulse and propellant.
const G0: f64 = 9.80665;

/// A triangle of height 2 between 0 and 2 s.
const TRIANGLE: &str = r#"
    "Clock": (model: "basics.ramp", params: { "slope": 1 }),
    "Triangle": (model: "basics.lookup", params: { "table": [[0, 0], [1, 2], [2, 0]] }),"#;
/// A pulse of height 1 between 0.55 s and 1.2 s.
const PULSE: &str = r#"
    "On": (model: "basics.step", params: { "time": 0.55 }),
    "Off": (model: "basics.step", params: { "time": 1.2, "after": -1 }),
    "Pulse": (model: "basics.sum"),"#;
const PULSE_WIRES: &str = r#""On.y -> Pulse.u", "Off.y -> Pulse.u","#;

/// Impulse (N s) of four pulses of 3, 20, 400 and 100 ms; see their rig.
const PULSES: f64 = 53.978_897_644_581_31;

const RIGS: &[Rig] = &[
    Rig {
        models: &["basics.step"],
        between: Constant,
        parts: "PULSE",
        connect: "",
        wires: r#"PULSE "Pulse.y -> I.u""#,
        reads: &[("I.y", 0.65)],
    },
    Rig {
        models: &["basics.ramp"],
        between: Straight,
        parts: r#"
            "A": (model: "basics.ramp", params: { "time": 0.3, "slope": 1 }),
            "B": (model: "basics.ramp", params: { "time": 0.8, "slope": -1 }),
            "C": (model: "basics.ramp", params: { "time": 1.5, "slope": -1 }),
            "D": (model: "basics.ramp", params: { "time": 2.0, "slope": 1 }),
            "Sum": (model: "basics.sum"),"#,
        connect: "",
        wires: r#""A.y -> Sum.u", "B.y -> Sum.u", "C.y -> Sum.u", "D.y -> Sum.u", "Sum.y -> I.u""#,
        reads: &[("I.y", 0.6)],
    },
    Rig {
        models: &["basics.lookup"],
        between: Straight,
        parts: r#"
            "Clock": (model: "basics.ramp", params: { "slope": 1 }),
            "Table": (model: "basics.lookup", params: { "table": [[0, 0], [0.5, 0], [0.501, 1], [1, 1], [1.001, 0]] }),"#,
        connect: "",
        wires: r#""Clock.y -> Table.u", "Table.y -> I.u""#,
        reads: &[("I.y", 0.5)],
    },
    Rig {
        models: &["basics.saturation"],
        between: Straight,
        parts: r#"TRIANGLE "Limits": (model: "basics.saturation", params: { "lower": 0, "upper": 1 }),"#,
        connect: "",
        wires: r#""Clock.y -> Triangle.u", "Triangle.y -> Limits.u", "Limits.y -> I.u""#,
        reads: &[("I.y", 1.5)],
    },
    Rig {
        models: &["basics.comparator"],
        between: Constant,
        parts: r#"TRIANGLE
            "One": (model: "basics.constant", params: { "value": 1 }),
            "Cold": (model: "basics.constant", params: { "value": 250 }),
            "Over": (model: "basics.comparator"),
            "Supply": (model: "power.ideal_supply", params: { "voltage": 28 }),
            "Box": (model: "power.thermal_boundary"),
            "Heater": (model: "power.heater", params: { "power": 10, "on_below": 270, "band": 5 }),"#,
        connect: r#"("Heater.supply", "Supply.terminal"), ("Heater.node", "Box.port")"#,
        wires: r#""Clock.y -> Triangle.u", "Triangle.y -> Over.a", "One.y -> Over.b", "Over.y -> Heater.enable", "Cold.y -> Box.temperature", "Heater.power -> I.u""#,
        reads: &[("I.y", 10.0), ("Supply.energy", 10.0)],
    },
    Rig {
        models: &["flight.engine"],
        between: Constant,
        parts: r#"PULSE
            "Feed": (model: "flight.ideal_feed"),
            "Engine": (model: "flight.engine", params: { "thrust": 20, "specific_impulse": 300 }, bind: { "nozzle": "node:body" }),"#,
        connect: r#"("Engine.propellant", "Feed.outlet")"#,
        wires: r#"PULSE "Pulse.y -> Engine.throttle""#,
        reads: &[("body.velocity.z", 1.3), ("Feed.drawn", 13.0 / (300.0 * G0))],
    },
    Rig {
        models: &["basics.relay"],
        between: Constant,
        parts: r#"TRIANGLE "Relay": (model: "basics.relay", params: { "on": 1, "off": 0.6 }),"#,
        connect: "",
        wires: r#""Clock.y -> Triangle.u", "Triangle.y -> Relay.u", "Relay.y -> I.u""#,
        reads: &[("I.y", 1.2)],
    },
    Rig {
        models: &["basics.quotient"],
        between: Curved,
        parts: r#"TRIANGLE
            "One": (model: "basics.constant", params: { "value": 1 }),
            "Ratio": (model: "basics.quotient", params: { "least": 0.5 }),"#,
        connect: "",
        wires: r#""Clock.y -> Triangle.u", "One.y -> Ratio.a", "Triangle.y -> Ratio.b", "Ratio.y -> I.u""#,
        // The integral is 2 ∫ dt/(2 t) from 0.25 to 1.
        reads: &[("I.y", 1.386_294_361_119_890_6)],
    },
    Rig {
        models: &["flight.sequence"],
        between: Constant,
        parts: r#""Rows": (model: "flight.sequence", params: { "rows": [[0, 0], [0.5, 1], [0.52, 0]] }),"#,
        connect: "",
        wires: r#""Rows.y -> I.u""#,
        reads: &[("I.y", 0.02)],
    },
    Rig {
        models: &["flight.body_load"],
        between: Constant,
        parts: r#""Load": (model: "flight.body_load", params: { "rows": [(time: 0), (time: 0.5, force: [0, 0, 10]), (time: 0.7)] }, bind: { "body": "node:body" }),"#,
        connect: "",
        wires: "",
        reads: &[("body.velocity.z", 0.2)],
    },
    Rig {
        models: &["flight.thruster"],
        between: Constant,
        parts: r#"
            "Rows": (model: "flight.sequence", params: { "rows": [[0, 0], [0.5, 1], [0.52, 0]] }),
            "Feed": (model: "flight.ideal_feed"),
            "Thruster": (model: "flight.thruster", params: { "thrust": 100 }, bind: { "nozzle": "node:body" }),"#,
        connect: r#"("Thruster.propellant", "Feed.outlet")"#,
        wires: r#""Rows.y -> Thruster.command""#,
        reads: &[
            ("body.velocity.z", 0.2),
            ("Thruster.impulse", 2.0),
            ("Thruster.pulses", 1.0),
            ("Feed.drawn", 2.0 / (220.0 * G0)),
        ],
    },
    Rig {
        models: &["flight.pyro"],
        between: Constant,
        parts: r#""Pyro": (model: "flight.pyro", params: { "impulse": 100, "after": 0.5 }, bind: { "a": "node:other", "b": "node:body" }),"#,
        connect: "",
        wires: "",
        reads: &[("body.velocity.x", 10.0)],
    },
    Rig {
        models: &["flight.solid_motor"],
        between: Constant,
        parts: r#""Feed": (model: "flight.ideal_feed"), "Motor": (model: "flight.solid_motor", params: { "curve": [[0, 0], [0.01, 1000], [1, 1000], [1.01, 0]], "specific_impulse": 250, "start": 0.5 }, bind: { "nozzle": "node:body" }),"#,
        connect: r#"("Motor.propellant", "Feed.outlet")"#,
        wires: "",
        reads: &[("body.velocity.z", 100.0), ("Feed.drawn", 1000.0 / (250.0 * G0))],
    },
    Rig {
        models: &["power.heater"],
        between: Constant,
        parts: r#"PULSE
            "Kelvin": (model: "basics.gain", params: { "k": -70, "offset": 320 }),
            "Supply": (model: "power.ideal_supply", params: { "voltage": 28 }),
            "Box": (model: "power.thermal_boundary"),
            "Heater": (model: "power.heater", params: { "power": 10, "on_below": 270, "band": 5 }),"#,
        connect: r#"("Heater.supply", "Supply.terminal"), ("Heater.node", "Box.port")"#,
        wires: r#"PULSE "Pulse.y -> Kelvin.u", "Kelvin.y -> Box.temperature", "Heater.power -> I.u""#,
        reads: &[("I.y", 6.5), ("Supply.energy", 6.5)],
    },
    Rig {
        models: &["power.load"],
        between: Constant,
        parts: r#"PULSE
            "Volts": (model: "basics.gain", params: { "k": 18, "offset": 10 }),
            "One": (model: "basics.constant", params: { "value": 1 }),
            "Zero": (model: "basics.constant", params: { "value": 0 }),
            "True": (model: "basics.comparator"),
            "Supply": (model: "power.programmable_supply"),
            "Load": (model: "power.load", params: { "power_on": 56, "volts_min": 20 }),"#,
        connect: r#"("Load.supply", "Supply.terminal")"#,
        wires: r#"PULSE "Pulse.y -> Volts.u", "Volts.y -> Supply.volts", "One.y -> True.a", "Zero.y -> True.b", "True.y -> Load.on", "Load.power -> I.u""#,
        reads: &[("I.y", 36.4)],
    },
    Rig {
        models: &["power.converter"],
        between: Constant,
        parts: r#"PULSE
            "Volts": (model: "basics.gain", params: { "k": 18, "offset": 10 }),
            "One": (model: "basics.constant", params: { "value": 1 }),
            "Zero": (model: "basics.constant", params: { "value": 0 }),
            "True": (model: "basics.comparator"),
            "Supply": (model: "power.programmable_supply"),
            "Converter": (model: "power.converter", params: { "voltage": 12, "volts_min": 20 }),
            "Load": (model: "power.load", params: { "power_on": 56, "volts_rated": 12, "volts_min": 10 }),"#,
        connect: r#"("Load.supply", "Converter.output"), ("Converter.input", "Supply.terminal")"#,
        wires: r#"PULSE "Pulse.y -> Volts.u", "Volts.y -> Supply.volts", "One.y -> True.a", "Zero.y -> True.b", "True.y -> Load.on", "Converter.power -> I.u""#,
        reads: &[("I.y", 36.4)],
    },
    // The charge that a load takes from a battery of 3.6 C, and the one that a source gives to a supply.
    Rig {
        models: &["power.battery"],
        between: Constant,
        parts: r#"PULSE
            "Half": (model: "basics.constant", params: { "value": 0.5 }),
            "Over": (model: "basics.comparator"),
            "Battery": (model: "power.battery", params: { "capacity_ah": 0.001, "charge": 0.8, "curve": [[0, 30], [1, 30]], "resistance": 0, "lag": "1e6 s" }),
            "Load": (model: "power.load", params: { "power_on": 60, "volts_min": 20 }),"#,
        connect: r#"("Load.supply", "Battery.terminal")"#,
        wires: r#"PULSE "Pulse.y -> Over.a", "Half.y -> Over.b", "Over.y -> Load.on""#,
        reads: &[("Battery.held", 0.8 * 3.6 - 2.0 * 0.65)],
    },
    Rig {
        models: &["power.source"],
        between: Constant,
        parts: r#"PULSE
            "Supply": (model: "power.ideal_supply", params: { "voltage": 28 }),
            "Source": (model: "power.source"),"#,
        connect: r#"("Source.output", "Supply.terminal")"#,
        wires: r#"PULSE "Pulse.y -> Source.power""#,
        reads: &[("Supply.energy", -0.65)],
    },
    // Propellant that is commanded to leave, and thrusters that follow a jump of their command.
    Rig {
        models: &["flight.drain"],
        between: Constant,
        parts: r#"PULSE
            "Tank": (model: "flight.propellant_tank", params: { "propellant": 1, "radius": 0.2 }, bind: { "bottom": "node:other" }),
            "Drain": (model: "flight.drain"),"#,
        connect: r#"("Drain.tank", "Tank.outlet")"#,
        wires: r#"PULSE "Pulse.y -> Drain.flow""#,
        reads: &[("Tank.propellant", 0.35)],
    },
    Rig {
        models: &["flight.held_thruster"],
        between: Constant,
        parts: r#"PULSE
            "Feed": (model: "flight.ideal_feed"),
            "Held": (model: "flight.held_thruster", params: { "thrust": 20 }, bind: { "nozzle": "node:body" }),"#,
        connect: r#"("Held.propellant", "Feed.outlet")"#,
        wires: r#"PULSE "Pulse.y -> Held.command""#,
        reads: &[
            ("body.velocity.z", 1.3),
            ("Held.impulse", 13.0),
            ("Feed.drawn", 13.0 / (220.0 * G0)),
        ],
    },
    Rig {
        models: &["flight.vector_thrust"],
        between: Constant,
        parts: r#"PULSE
            "Feed": (model: "flight.ideal_feed"),
            "Thrust": (model: "flight.vector_thrust", params: { "specific_impulse": 300 }, bind: { "body": "node:body" }),"#,
        connect: r#"("Thrust.propellant", "Feed.outlet")"#,
        wires: r#"PULSE "Pulse.y -> Thrust.command.z""#,
        reads: &[("body.velocity.z", 0.065), ("Feed.drawn", 0.65 / (300.0 * G0))],
    },
    // A number of pulses with dead time and unequal ramps: the shortest is shorter than its ramps. The impulse of a pulse of width w is
    // T (w + (fall − rise)(1 − e^(−w/rise))), which is 1.68 N s more than T w for the four pulses.
    Rig {
        models: &["flight.thruster"],
        between: Constant,
        parts: r#"
            "Rows": (model: "flight.sequence", params: { "rows": [[0, 0], [0.1, 1], [0.103, 0], [0.3, 1], [0.32, 0], [0.7, 1], [1.1, 0], [1.3, 1], [1.4, 0]] }),
            "Feed": (model: "flight.ideal_feed"),
            "Thruster": (model: "flight.thruster", params: { "thrust": 100, "dead_time": "5 ms", "rise": "6 ms", "fall": "11 ms" }, bind: { "nozzle": "node:body" }),"#,
        connect: r#"("Thruster.propellant", "Feed.outlet")"#,
        wires: r#""Rows.y -> Thruster.command""#,
        reads: &[
            ("Thruster.pulses", 4.0),
            ("Thruster.impulse", PULSES),
            ("body.velocity.z", PULSES / 10.0),
            ("Feed.drawn", PULSES / (220.0 * G0)),
        ],
    },
];

/// Models with guards whose outputs do not jump with time or inputs, with the reason.
const OTHERS: &[(&str, &str)] = &[
    ("basics.bouncing_ball", "its state jumps, by its own motion"),
    ("basics.hinge_trajectory", "meets its positions; a test of its own"),
    ("basics.slider_trajectory", "as the hinge's"),
    ("flight.airbag", "opens by its own pressure"),
    ("flight.axisymmetric_aerodynamics", "a corner of coefficients, by the motion"),
    ("flight.balloon", "a corner, by its own gas"),
    ("flight.blow_down", "ends by what is filled in"),
    ("flight.bridle", "taut by the motion"),
    ("flight.canopy", "fills smoothly from its events on"),
    ("flight.capture", "latches by the motion"),
    ("flight.crushable_leg", "touches by the motion"),
    ("flight.dave_aerodynamics", "a corner of coefficients, by the motion"),
    ("flight.entry_aerodynamics", "a corner of coefficients, by the motion"),
    ("flight.feed_line", "sets its smoothed levels at the start"),
    ("flight.glideslope", "a corner of the closing speed, by the motion"),
    ("flight.ground_station", "rises and sets by the motion"),
    ("flight.kickoff_spring", "ends by the motion"),
    ("flight.line", "taut by the motion"),
    ("flight.line_twist", "winds by the motion"),
    ("flight.panel_radiation_pressure", "edges of shadows, by the motion"),
    ("flight.pitch_program", "angles, not loads; rows are events"),
    ("flight.propellant_tank", "runs dry by what is drawn"),
    ("flight.radiation_pressure", "edges of shadows, by the motion"),
    ("flight.reaction_wheel", "reaches its greatest speed by its own motion; `limits.rs`"),
    ("flight.riser", "taut by the motion"),
    ("flight.separation_spring", "ends by the motion"),
    ("flight.sphere_cone", "a corner of coefficients, by the motion"),
    ("manipulation.cutting", "cuts by the motion"),
    ("manipulation.shearing", "cuts by the motion"),
    ("power.solar_panel", "edges of shadows, by the motion; `flight/one_world.rs`"),
    ("power.dust", "its state jumps at a gust"),
];

fn text(rig: &Rig, integrator: &str, row: f64, until: f64) -> String {
    let parts = rig.parts.replace("TRIANGLE", TRIANGLE).replace("PULSE", PULSE);
    let wires = rig.wires.replace("PULSE", PULSE_WIRES);
    let parts = match wires.contains("-> I.u") {
        true => parts,
        false => {
            format!(r#"{parts} "Nothing": (model: "basics.constant", params: {{ "value": 0 }}),"#)
        }
    };
    let wires = match wires.contains("-> I.u") {
        true => wires,
        false if wires.is_empty() => r#""Nothing.y -> I.u""#.to_string(),
        false => format!(r#"{wires}, "Nothing.y -> I.u""#),
    };
    let connect = rig.connect;
    format!(
        r#"Simulation(
            connect: [{connect}],
            bodies: {{
                "body": (parent: "world", hinge: Free, mass: 10, inertia: [1, 1, 1]),
                "other": (parent: "world", hinge: Free, mass: 10, inertia: [1, 1, 1]),
            }},
            parts: {{ {parts} "I": (model: "basics.integrator") }},
            wires: [{wires}], gravity: "none",
            step: {row}, integrator: "{integrator}", until: {until},
        )"#
    )
}

/// Returns the values of `reads` at the end of a run.
fn end(rig: &Rig, catalogue: &Catalogue, integrator: &str, row: f64) -> Result<Vec<f64>, String> {
    let until = row.max(3.0);
    let text = text(rig, integrator, row, until);
    let loaded =
        load_text("sim.ron", &text, &Options::new(catalogue)).map_err(|f| f.render(false))?;
    let program = loaded.compile(catalogue, &Files::default()).map_err(|e| e.to_string())?;
    let mut sim = Simulation::of(Arc::new(program));
    sim.run_until(Seconds::from_decimal(until).unwrap()).map_err(|e| e.to_string())?;
    rig.reads.iter().map(|(name, _)| sim.get(name).map_err(|e| e.to_string())).collect()
}

const METHODS: [&str; 6] = [
    "semi_implicit_euler",
    "rk4",
    "bogacki_shampine_32",
    "dormand_prince_54",
    "verner_87",
    "rodas4p",
];

const ROWS: [f64; 5] = [0.001, 0.01, 1.0, 60.0, 3600.0];

/// Returns the accepted relative error of a method with samples at this interval; `None` if the method itself is too inaccurate with the interval.
///
/// A step ends at every jump and corner, so each method integrates a constant exactly, and each but Euler's a straight line. With 1 s or more there is
/// only one step between two corners, in which the errors of Euler's method on a line, and of RK4 on a curve, are no lost pulses.
fn accepted(between: Between, method: &str, row: f64) -> Option<f64> {
    let fine = row <= 0.01;
    match (between, method) {
        (Constant, _) | (Straight, "rk4") => Some(EXACT),
        // Error of the first order: at most h/2 times the variation of the signal, which is 4 for a triangle of height 2.
        (Straight | Curved, "semi_implicit_euler") => fine.then_some(4.0 * row),
        (Curved, "rk4") => fine.then_some(EXACT),
        _ => Some(EXACT),
    }
}

/// Round-off, and the tolerance of adaptive methods.
const EXACT: f64 = 2e-7;

/// A pulse of half a second is not lost with samples of an hour, and no method evaluates beyond a jump within a step: impulse, propellant, charge and
/// number of pulses are those of the closed form, for every integrator and sampling. Before steps ended at jumps, 3600 s gave 0 with adaptive methods,
/// and RK4 gave 0.483 for a step at 0.55 s that integrates to 0.45.
#[test]
fn the_integral_of_what_jumps_is_that_of_the_closed_form() {
    let (catalogue, mut wrong, mut checked) = (common::catalogue(), Vec::new(), 0);
    for rig in RIGS {
        for (method, row) in METHODS.iter().flat_map(|m| ROWS.map(|row| (*m, row))) {
            let Some(relative) = accepted(rig.between, method, row) else { continue };
            let at = format!("{:?} {method}, row {row} s", rig.models);
            match end(rig, &catalogue, method, row) {
                Err(e) => wrong.push(format!("{at}: {e}")),
                Ok(all) => {
                    for (y, (read, want)) in all.iter().zip(rig.reads) {
                        checked += 1;
                        if !((y - want).abs() <= relative * want.abs()) {
                            wrong.push(format!("{at}: {read} = {y}, not {want}"));
                        }
                    }
                }
            }
        }
    }
    println!("{checked} numbers of {} simulations", RIGS.len());
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// A new model with guards must be put into one of the two lists.
#[test]
fn every_model_of_the_catalogue_that_has_events_is_considered() {
    let catalogue = common::catalogue();
    let tried: BTreeSet<&str> = RIGS.iter().flat_map(|r| r.models).copied().collect();
    let others: BTreeSet<&str> = OTHERS.iter().map(|o| o.0).collect();
    let with_events: BTreeSet<&str> = catalogue
        .iter()
        .filter(|entry| entry.description.functions.guards)
        .map(|entry| entry.description.name.as_ref())
        .filter(|name| !name.starts_with("fmi."))
        .collect();
    let missing: Vec<_> =
        with_events.iter().filter(|m| !tried.contains(*m) && !others.contains(*m)).collect();
    assert!(missing.is_empty(), "put into RIGS or OTHERS: {missing:?}");
    let gone: Vec<_> = others.difference(&with_events).collect();
    assert!(gone.is_empty(), "without events, or not there: {gone:?}");
    let twice: Vec<_> = others.intersection(&tried).collect();
    assert!(twice.is_empty(), "in both lists: {twice:?}");
    let catalogued = |name: &str| catalogue.iter().any(|e| e.description.name == name);
    let unknown: Vec<_> = tried.iter().filter(|name| !catalogued(name)).collect();
    assert!(unknown.is_empty(), "not in the catalogue: {unknown:?}");
}

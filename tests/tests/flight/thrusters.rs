//! Thrusters in simulations: no pulse is missed, and held pulses have the same effect on a body as real pulses.

use crate::common::{scene, seconds};

/// The command equals exactly one half at some steps, where it crosses; each pulse must be detected completely.
#[test]
fn a_thruster_sees_every_pulse_whatever_the_step() {
    for step in ["0.5 ms", "1 ms", "2 ms"] {
        let text = format!(
            r#"Simulation(
                bodies: {{ "body": (parent: "world", hinge: Slider([0, 0, 1]), mass: "20 kg", inertia: Sphere(0.5)) }},
                gravity: "none",
                parts: {{
                    "Command": (model: "basics.sine", params: {{ "frequency": 1 }}),
                    "Thruster": (model: "flight.thruster", params: {{ "thrust": "5 N", "dead_time": "50 ms", "rise": "40 ms", "fall": "80 ms" }}, bind: {{ "nozzle": "node:body" }}),
                    "Feed": (model: "flight.ideal_feed"),
                }},
                wires: ["Command.y -> Thruster.command"], connect: [("Thruster.propellant", "Feed.outlet")],
                step: "{step}", until: "4 s",
            )"#
        );
        let mut sim = scene(&text, &[]).unwrap();
        sim.run_until(seconds(4.0)).unwrap();
        // The valve is open from 1/12 s to 5/12 s of each second, 50 ms later; the last pulse is still decaying.
        let (w, rise, fall) = (1.0 / 3.0_f64, 0.04_f64, 0.08_f64);
        let reached = 1.0 - (-w / rise).exp();
        let left = fall * reached * (-(1.0 - 5.0 / 12.0 - 0.05) / fall).exp();
        let impulse = 5.0 * (4.0 * (w + (fall - rise) * reached) - left);
        let found = sim.get("Thruster.impulse").unwrap();
        println!("{step}: {found} N s of {impulse}");
        assert_eq!(sim.get("Thruster.pulses").unwrap(), 4.0, "{step}");
        assert!((found / impulse - 1.0).abs() < 1e-4, "{step}: {found} {impulse}");
    }
}

/// A sliding and a rotating body are pushed by the same samples, as pulses with ramps and as mean forces. After the last ramp, both have the same
/// impulse and speed; the pulses came later by dead time and ramp.
#[test]
fn held_pulses_do_what_pulses_do() {
    let body = |name: &str, hinge: &str| {
        format!(
            r#""{name}": (parent: "world", hinge: {hinge}, mass: "20 kg", inertia: [5, 6, 7],
                nodes: {{ "jet": (position: [-1.5, 0.2, 0.3], rotation: (rpy: [0, "20 deg", 0])) }}),"#
        )
    };
    let bodies: String = [("slid1", 0), ("slid2", 0), ("turned1", 1), ("turned2", 1)]
        .map(|(name, k)| body(name, ["Slider([0, 0, 1])", "Pin([0, 1, 0])"][k]))
        .concat();
    let text = format!(
        r#"Simulation(
            bodies: {{ {bodies} }},
            gravity: "none",
            parts: {{
                "Wave": (model: "basics.sine", params: {{ "frequency": 0.73, "phase": -0.5, "amplitude": 1e6 }}),
                "Whole": (model: "basics.saturation", params: {{ "lower": 0, "upper": 1 }}),
                "Command": (model: "basics.hold", rate: "10 Hz"),
                "Feed": (model: "flight.ideal_feed"),
                "Pulses": (
                    model: "flight.thruster", params: {{ "thrust": "5 N", "dead_time": "20 ms", "rise": "10 ms" }},
                    array: [(bind: {{ "nozzle": "node:slid1/jet" }}), (bind: {{ "nozzle": "node:turned1/jet" }})],
                ),
                "Held": (
                    model: "flight.held_thruster", params: {{ "thrust": "5 N" }},
                    array: [(bind: {{ "nozzle": "node:slid2/jet" }}), (bind: {{ "nozzle": "node:turned2/jet" }})],
                ),
            }},
            wires: ["Wave.y -> Whole.u", "Whole.y -> Command.u", "Command.y -> Pulses[*].command", "Command.y -> Held[*].command"],
            connect: [("Pulses[*].propellant", "Held[*].propellant", "Feed.outlet")],
            step: "50 ms", integrator: "dormand_prince_54", accuracy: (relative: 1e-12, absolute: 1e-13), until: "9 s",
        )"#
    );
    let mut sim = scene(&text, &[]).unwrap();
    // The run ends half a second after the last sample with thrust.
    sim.run_until(seconds(8.2)).unwrap();
    let number = |name: &str| sim.get(name).unwrap();
    let (pulses, held) = (number("Pulses1.impulse"), number("Held1.impulse"));
    println!("{} pulses, {pulses} N s; held {held} N s", number("Pulses1.pulses"));
    assert!(pulses > 15.0 && number("Pulses1.force") < 1e-15);
    assert!((held / pulses - 1.0).abs() < 1e-12);
    // The speed is the impulse over the mass along the slider; the rate is the impulse times the
    // jet's arm over the inertia about the pin.
    let (sine, cosine) = 20f64.to_radians().sin_cos();
    let slid = held * cosine / 20.0;
    let turned = held * (0.3 * sine + 1.5 * cosine) / 6.0;
    for (name, rate, place, want) in
        [("slid", "speed", "displacement", slid), ("turned", "rate", "angle", turned)]
    {
        let [a, b] = [1, 2]
            .map(|k| (number(&format!("{name}{k}.{rate}")), number(&format!("{name}{k}.{place}"))));
        println!("{name}: {a:?}, {b:?}, {want}");
        assert!((a.0 / want - 1.0).abs() < 1e-10 && (b.0 / want - 1.0).abs() < 1e-10, "{name}");
        // Each pulse acts 30 ms later than its mean force, so the body with mean forces is ahead by
        // this time.
        assert!(((b.1 - a.1) / (want * 0.03) - 1.0).abs() < 1e-8, "{name}");
    }
}

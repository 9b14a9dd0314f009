//! Sampled control loops are analysed at load: an unstable one gives a warning with a stable gain.
use crate::common;

/// Rotor and wheel of 5 g m² on a motor that reaches 10 rad/s and 5 N m, and the rate controller that `linkwork new rover` generated for it.
fn drive(kp: f64, rate: &str) -> String {
    format!(
        r#"Simulation(
            bodies: {{ "wheel": (parent: "world", hinge: Pin([0, 1, 0]), mass: 1, inertia: [0.005, 0.005, 0.005]) }},
            gravity: "none",
            parts: {{
                "Supply": (model: "power.ideal_supply", params: {{ "voltage": 24 }}),
                "Target": (model: "basics.constant", params: {{ "value": 3 }}),
                "Controller": (
                    model: "control.rate_controller", rate: "{rate}",
                    params: {{ "kp": {kp}, "ki": 7.2, "feed_forward": 2.4, "limit": 24 }},
                ),
                "Encoder": (model: "sensors.encoder", params: {{ "ticks": 4096 }}, rate: "{rate}", bind: {{ "shaft": "hinge:wheel" }}),
                "Motor": (
                    model: "actuators.dc_motor", bind: {{ "shaft": "hinge:wheel" }},
                    params: {{ "torque_constant": 2.4, "resistance": 11.52, "coulomb": 0.05, "hold_stiffness": 500, "hold_damping": 5 }},
                ),
            }},
            connect: [("Motor.supply", "Supply.terminal")],
            wires: ["Target.y -> Controller.target", "Encoder.rate -> Controller.rate", "Controller.volts -> Motor.volts"],
            step: "1 ms", integrator: "rk4", until: "4 s",
            metrics: {{ "swing": (of: "wheel.rate", take: "std"), "mean": (of: "wheel.rate", take: "mean") }},
        )"#
    )
}

fn warnings(text: &str) -> Vec<(String, String)> {
    let ready =
        linkwork_assemblies::library().text("test.ron", text).map_err(|f| f.render(false)).unwrap();
    let told = ready.warnings();
    told.iter().map(|f| (f.message.clone(), f.help.clone().unwrap())).collect()
}

fn swing(text: &str) -> (f64, f64) {
    let metrics = common::metrics_of(text).unwrap();
    (metrics["swing"], metrics["mean"])
}

#[test]
fn a_gain_that_is_too_high_is_reported_with_one_that_works() {
    // The time constant is J/(k²/R (1 + 1.7)) = 3.7 ms, so the loop is much faster than its sample
    // of 10 ms.
    let text = drive(1.7 * 2.4 * 2.0, "100 Hz");
    let all = warnings(&text);
    let [(fact, help)] = &all[..] else { panic!("{all:#?}") };
    assert!(
        fact.starts_with("the sampled loop of `Controller` (a sample every 0.01 s) is unstable"),
        "{fact}"
    );
    let gain = help.strip_prefix("write `kp: ").and_then(|h| h.split('`').next());
    let gain: f64 = gain.unwrap_or_else(|| panic!("{help}")).parse().unwrap();
    assert!(gain > 0.5 && gain < 6.0, "{gain}");
    // The rate oscillates between its limits; with the gain of the message it is steady.
    let (swings, _) = swing(&text);
    assert!(swings > 0.5, "{swings}");
    let calm = drive(gain, "100 Hz");
    let (still, mean) = swing(&calm);
    // The start from rest alone causes 0.18 rad/s.
    assert!(still < 0.25 && (mean - 3.0).abs() < 0.1, "{still} {mean}");
    assert!(warnings(&calm).is_empty());
    // With ten times as many samples the same loop is stable.
    assert!(warnings(&drive(1.7 * 2.4 * 2.0, "1 kHz")).is_empty());
}

#[test]
fn a_loop_near_its_limit_is_reported_as_such() {
    // Bisection of the warning itself gives the gain at which the loop becomes unstable.
    let unstable =
        |kp: f64| warnings(&drive(kp, "100 Hz")).iter().any(|w| w.0.contains(" is unstable"));
    let (mut low, mut high) = (0.5, 20.0);
    for _ in 0..8 {
        let middle = 0.5 * (low + high);
        if unstable(middle) { high = middle } else { low = middle }
    }
    let near = warnings(&drive(0.9 * low, "100 Hz"));
    assert!(near.len() == 1 && near[0].0.contains("nearly unstable"), "{near:?}");
    assert!(warnings(&drive(0.5 * low, "100 Hz")).is_empty());
    // The simulation has the same stability limit, except for the stabilizing friction.
    assert!(swing(&drive(0.6 * low, "100 Hz")).0 < 0.3);
    assert!(swing(&drive(1.3 * high, "100 Hz")).0 > 1.0);
}

//! Metrics are computed over time: closed forms for every integrator and any sampling, extremes between samples, fractions of time located inside a
//! step, units of differences; through checkpoints, and without influence on the run.
use crate::common;
use allocation_counter::measure;
use linkwork_runner::{Metrics, prepare};
use linkwork_runtime::{
    Integrator, Observer, ObserverRequest, Place, Seconds, Simulation, Stretch,
};
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

fn close(metrics: &BTreeMap<String, f64>, name: &str, wanted: f64, tolerance: f64) {
    let found = metrics[name];
    assert!((found - wanted).abs() <= tolerance, "{name}: {found:.9} against {wanted:.9}");
}

fn metrics(text: &str) -> BTreeMap<String, f64> {
    common::metrics_of(text).unwrap_or_else(|e| panic!("{e}"))
}

/// x = cos t by two integrators, and its square, with every metric.
fn oscillator(integrator: &str, step: &str, until: &str) -> String {
    format!(
        r#"Simulation(
    doc: "x = cos t.", step: "{step}", until: "{until}", integrator: "{integrator}", accuracy: "fixed",
    parts: {{
        "X": (model: "basics.integrator", params: {{ "start": 1 }}), "V": (model: "basics.integrator", params: {{ "k": -1 }}),
        "S": (model: "basics.product"),
    }},
    wires: ["V.y -> X.u", "X.y -> V.u", "X.y -> S.a", "X.y -> S.b"],
    metrics: {{
        "last": (of: "X.y"), "min": (of: "X.y", take: "min"), "max": (of: "X.y", take: "max"),
        "max_abs": (of: "X.y", take: "max_abs"), "range": (of: "X.y", take: "range"), "mean": (of: "X.y", take: "mean"),
        "rms": (of: "X.y", take: "rms"), "std": (of: "X.y", take: "std"),
        "p90": (of: "X.y", take: "percentile", percent: 90), "p50": (of: "X.y", take: "percentile", percent: 50),
        "at the minimum": (of: "X.y", take: "time_of_min"), "at the maximum": (of: "V.y", take: "time_of_max", unit: "min"),
        "at the greatest": (of: "V.y", take: "time_of_max_abs"),
        "rate at 1.25": (of: "V.y", at: "X.y < -0.5"),
        "share": (when: "X.y > 0.5", take: "mean"), "ever": (when: "X.y > 2", take: "max"), "least square": (of: "S.y", take: "min"),
        "mean square": (of: "S.y", take: "mean"),
    }},
)"#
    )
}

/// From 0 to 4 s: one minimum of x at π, one maximum of v = −sin t at the end, its largest magnitude at π/2.
fn check(f: &BTreeMap<String, f64>, tolerance: f64) {
    let end: f64 = 4.0;
    let mean = end.sin() / end;
    let square = 0.5 + (2.0 * end).sin() / (4.0 * end);
    close(f, "last", end.cos(), tolerance);
    close(f, "min", -1.0, tolerance);
    close(f, "max", 1.0, 0.0);
    close(f, "max_abs", 1.0, tolerance);
    close(f, "range", 2.0, tolerance);
    close(f, "mean", mean, tolerance);
    close(f, "rms", square.sqrt(), tolerance);
    close(f, "std", (square - mean * mean).sqrt(), tolerance);
    close(f, "mean square", square, tolerance);
    close(f, "least square", 0.0, tolerance);
    // The time of a parabola's maximum has the square root of the error.
    close(f, "at the minimum", PI, 10.0 * tolerance.sqrt());
    close(f, "at the greatest", PI / 2.0, 10.0 * tolerance.sqrt());
    close(f, "at the maximum", end / 60.0, tolerance);
    // The value is cos t = −1/2 at 2π/3, where −sin t = −√3/2; it is above 1/2 until π/3.
    close(f, "rate at 1.25", -(0.75_f64.sqrt()), tolerance);
    close(f, "share", PI / 3.0 / end, tolerance);
    close(f, "ever", 0.0, 0.0);
    // For these c, cos t is below c from arccos c to the end: at 50 % of 4 s for c = cos 2, at 90 % for c = cos 0.4.
    close(f, "p50", 2.0_f64.cos(), 10.0 * tolerance + 1e-3);
    close(f, "p90", 0.4_f64.cos(), 10.0 * tolerance + 1e-3);
}

#[test]
fn metrics_are_those_of_the_continuous_variable_for_every_integrator() {
    for (name, integrator) in Integrator::ALL {
        let order = integrator.method().order();
        // With fixed steps the method has an error.
        let fixed = oscillator(name, "10 ms", "4 s");
        let tolerance = if order == 1 {
            3e-2
        } else if order == 2 {
            3e-4
        } else {
            2e-5
        };
        check(&metrics(&fixed), tolerance);
        if integrator.method().error_order() > 0 {
            // With samples of 4 s everything happens between two samples.
            let accuracy = "accuracy: (relative: 1e-9, absolute: 1e-9)";
            let adaptive = oscillator(name, "4 s", "4 s").replace("accuracy: \"fixed\"", accuracy);
            check(&metrics(&adaptive), 2e-5);
        }
    }
}

/// Signal 1 for the first second of ten; the phases have steps of 1 ms and of 1 s.
#[test]
fn means_and_shares_do_not_count_rows() {
    let f = metrics(
        r#"Simulation(
    doc: "1 for the first second and 0 for the next nine.",
    parts: { "S": (model: "basics.step", params: { "time": "1 s", "before": 1, "after": 0 }), "H": (model: "basics.hold", rate: "0.3 s") },
    wires: ["S.y -> H.u"], until: "10 s", step: "1 ms", start: "a",
    phases: { "a": (to: { "b": "time > 1 s" }), "b": (step: "1 s") },
    metrics: {
        "mean": (of: "S.y", take: "mean"), "share": (when: "S.y > 0.5", take: "mean"), "rms": (of: "S.y", take: "rms"),
        "std": (of: "S.y", take: "std"), "p89": (of: "S.y", take: "percentile", percent: 89), "held": (of: "H.y", take: "mean"),
        "p91": (of: "H.y", take: "percentile", percent: 91), "p85": (of: "H.y", take: "percentile", percent: 85),
    },
)"#,
    );
    close(&f, "mean", 0.1, 1e-9);
    close(&f, "share", 0.1, 1e-9);
    close(&f, "rms", 0.1_f64.sqrt(), 1e-9);
    close(&f, "std", 0.3, 1e-9);
    close(&f, "p89", 0.0, 1e-9);
    // The variable is sampled at 0, 0.3, 0.6, 0.9 s, and constant until 1.2 s.
    close(&f, "held", 0.12, 1e-12);
    close(&f, "p85", 0.0, 0.0);
    close(&f, "p91", 1.0, 0.0);
}

/// Samples at 0.5, 0.99, 1, 1.5 s: a sine of 1 Hz is zero at most of them.
#[test]
fn rows_that_fall_unevenly_do_not_matter() {
    let f = metrics(
        r#"Simulation(
    doc: "Two sampled parts.",
    parts: { "S": (model: "basics.sine", params: { "frequency": "1 Hz" }), "H": (model: "basics.hold", rate: "0.99 s") },
    wires: ["S.y -> H.u"], until: "30 s", step: "0.5 s",
    metrics: { "mean": (of: "S.y", take: "mean"), "rms": (of: "S.y", take: "rms"), "max": (of: "S.y", take: "max"), "first": (of: "S.y", take: "time_of_max") },
)"#,
    );
    close(&f, "mean", 0.0, 1e-6);
    close(&f, "rms", FRAC_1_SQRT_2, 1e-5);
    close(&f, "max", 1.0, 1e-9);
    close(&f, "first", 0.25, 1e-4);
}

/// T = 10 sin(2πt) degC: the RMS of the displayed numbers, and differences without an offset.
#[test]
fn differences_of_temperatures_have_no_offset() {
    let f = metrics(
        r#"Simulation(
    doc: "A temperature that swings about 0 degC.",
    parts: { "Q": (model: "basics.sine", params: { "amplitude": 62.83185307179586, "frequency": "1 Hz", "phase": "90 deg" }),
             "H": (model: "power.heat_source"),
             "N": (model: "power.thermal_node", params: { "capacity": 1, "temperature": "0 degC" }) },
    wires: ["Q.y -> H.power"], connect: [("H.node", "N.port")], step: "1 ms", until: "1 s",
    metrics: {
        "rms": (of: "N.temperature", take: "rms", unit: "degC"), "max": (of: "N.temperature", take: "max", unit: "degC"),
        "std": (of: "N.temperature", take: "std", unit: "degC"), "range": (of: "N.temperature", take: "range", unit: "degC"),
        "mean": (of: "N.temperature", take: "mean", unit: "degC"), "max_abs": (of: "N.temperature", take: "max_abs", unit: "degC"),
        "kelvin": (of: "N.temperature", take: "rms", unit: "K"), "p100": (of: "N.temperature", take: "percentile", percent: 100, unit: "degC"),
    },
)"#,
    );
    close(&f, "rms", 50.0_f64.sqrt(), 1e-4);
    close(&f, "std", 50.0_f64.sqrt(), 1e-4);
    close(&f, "max", 10.0, 1e-5);
    close(&f, "max_abs", 10.0, 1e-5);
    close(&f, "range", 20.0, 1e-5);
    close(&f, "mean", 0.0, 1e-6);
    close(&f, "p100", 10.0, 1e-4);
    close(&f, "kelvin", (273.15_f64.powi(2) + 50.0).sqrt(), 1e-6);
}

/// A bouncing ball: its velocity jumps at each impact, and neither its mean nor its range treats the jump as a ramp.
#[test]
fn a_jump_at_an_event_is_no_ramp() {
    let f = metrics(
        r#"Simulation(
    doc: "From 1 m, g = 2 m/s²: impacts at 1, 3 s, of which each keeps all speed.", step: "0.7 s", until: "2.8 s", integrator: "rk4",
    parts: { "Ball": (model: "basics.bouncing_ball", params: { "height": 1, "gravity": 2, "restitution": 1 }) },
    metrics: {
        "mean height": (of: "Ball.height", take: "mean"), "mean speed": (of: "Ball.speed", take: "mean"),
        "fastest": (of: "Ball.speed", take: "max"), "at": (of: "Ball.speed", take: "time_of_max"),
        "highest": (of: "Ball.height", take: "max"), "lowest": (of: "Ball.height", take: "min"), "up": (when: "Ball.speed > 0 m/s", take: "mean"),
    },
)"#,
    );
    // The height is h = 1 − t² to 1 s, then 1 − (t − 2)²; the speed is v = −2t, then −2 (t − 2).
    close(&f, "fastest", 2.0, 1e-6);
    close(&f, "at", 1.0, 1e-9);
    close(&f, "highest", 1.0, 1e-9);
    close(&f, "lowest", 0.0, 1e-9);
    close(&f, "up", 1.0 / 2.8, 1e-9);
    close(&f, "mean height", (2.0 / 3.0 + 1.8 - (0.512 + 1.0) / 3.0) / 2.8, 1e-6);
    close(&f, "mean speed", (0.36 - 1.0) / 2.8, 1e-6);
}

/// Runs a text to an instant in fractions of a sample.
fn started(
    text: &str,
    until: f64,
    begin: Option<(&linkwork_runtime::Checkpoint, &[u8])>,
) -> Simulation {
    let (program, settings) = common::program_of(text).unwrap_or_else(|e| panic!("{e}"));
    let mut metrics = prepare(&program.phases[0].plan, &settings).unwrap().metrics;
    let mut sim = Simulation::of(program.into());
    if let Some((checkpoint, saved)) = begin {
        sim.restore(checkpoint).unwrap();
        metrics.restore(saved).unwrap();
    }
    metrics.observe(&mut sim);
    sim.observe_now();
    while sim.before(Seconds::from_decimal(until).unwrap()) {
        sim.step().unwrap();
        sim.observe_now();
    }
    sim
}

fn bits(sim: &Simulation) -> Vec<(String, u64)> {
    let results = Metrics::of(sim).unwrap().results();
    results.map(|(name, value, _)| (name.to_string(), value.to_bits())).collect()
}

#[test]
fn metrics_continue_through_a_checkpoint_and_with_other_metrics_beside_them() {
    let text = oscillator("rk4", "50 ms", "4 s");
    let straight = started(&text, 4.0, None);
    for cut in [0.0, 0.05, 1.0, 3.3, 4.0] {
        let first = started(&text, cut, None);
        let checkpoint = first.checkpoint(&text).unwrap();
        let saved = Metrics::of(&first).unwrap().save().unwrap();
        let then = started(&text, 4.0, Some((&checkpoint, &saved)));
        assert_eq!(bits(&straight), bits(&then), "cut at {cut} s");
        // A fork has one metric less and one more: the others are unchanged.
        let fewer = text.replace(
            "\"rms\": (of: \"X.y\", take: \"rms\"),",
            "\"new\": (of: \"V.y\", take: \"mean\"),",
        );
        let fork = started(&fewer, 4.0, Some((&checkpoint, &saved)));
        let (whole, forked) = (bits(&straight), bits(&fork));
        let kept = whole.iter().filter(|f| f.0 != "rms");
        assert!(kept.clone().count() > 10);
        kept.for_each(|f| assert!(forked.contains(f), "{} of a fork at {cut} s", f.0));
        assert!(forked.iter().any(|f| f.0 == "new"));
    }
}

/// Records everything at all samples.
struct Nosy {
    seen: f64,
    stretches: u64,
}

impl Observer for Nosy {
    fn instant(&mut self, _: linkwork_runtime::Times, values: &[f64]) {
        self.seen += values.iter().filter(|y| y.is_finite()).sum::<f64>();
    }
    fn stretch(&mut self, over: &mut Stretch<'_>) {
        self.stretches += 1;
        for part in [0.7, 0.1] {
            if let Some(values) = over.at(part) {
                self.seen += values.iter().filter(|y| y.is_finite()).sum::<f64>();
            }
        }
    }
}

#[test]
fn an_observer_changes_nothing() {
    let few = [
        "pendulum",
        "slider_crank",
        "rover_traverse",
        "mars_edl",
        "sol",
        "bouncing_ball",
        "capsule_landing",
        "attitude",
        "double_wishbone",
        "dual_arm_carry",
    ];
    for name in few {
        let run = |observed: bool| {
            let mut sim = common::repository(&format!("{name}/sim.ron"), &[]).unwrap();
            if observed {
                let places: Vec<Place> = sim.plan().variables.values().map(|v| v.place).collect();
                let wanted = ObserverRequest { places, ..ObserverRequest::default() };
                sim.observe(&wanted, Box::new(Nosy { seen: 0.0, stretches: 0 }));
            }
            for _ in 0..150 {
                sim.step().unwrap();
                sim.observe_now();
            }
            if observed {
                let nosy = sim.observer::<Nosy>().unwrap();
                assert!(nosy.stretches >= 150 && nosy.seen != 0.0, "{name}");
            }
            sim.hash()
        };
        assert_eq!(run(false), run(true), "{name}");
    }
}

#[test]
fn metrics_allocate_nothing_while_stepping() {
    let text = oscillator("rk4", "1 ms", "4 s");
    let mut sim = started(&text, 0.01, None);
    let counts = measure(|| {
        for _ in 0..2000 {
            sim.step().unwrap();
            sim.observe_now();
        }
    });
    assert_eq!(counts.count_total, 0, "{counts:?}");
}

#[test]
fn metrics_that_mean_nothing_are_rejected() {
    for (metric, wanted) in [
        ("of: \"S.y\", take: \"percentile\"", "`percent` is missing"),
        ("of: \"S.y\", take: \"percentile\", percent: 101", "`percent` is 101, above 100"),
        ("of: \"S.y\", take: \"mean\", percent: 50", "`percent` requires take"),
        ("of: \"S.y\", take: \"max\", at: \"time > 1 s\"", "`at` selects one value"),
        (
            "of: \"S.y\", take: \"time_of_max\", unit: \"m\"",
            "an instant needs a unit of time, but m is not one",
        ),
        ("of: \"S.y\", take: \"largest\"", "largest"),
        ("of: \"Q.y\"", "there is no variable `Q.y`"),
    ] {
        let text = format!(
            "Simulation(parts: {{ \"S\": (model: \"basics.sine\") }}, until: \"1 s\", metrics: {{ \"a\": ({metric}) }})"
        );
        let e = common::metrics_of(&text).unwrap_err();
        assert!(e.contains(wanted), "{metric}: {e}");
    }
}

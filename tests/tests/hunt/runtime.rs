//! Runtime and logs. The log is `tests/hunt/runtime.md`.
use super::{Case, Refused, hold, refuse};
use linkwork_assembly::{Options, load_text};

const CASES: &[Case] = &[
    Case {
        report: "FMPy #887, FMIKit-Simulink #133, #154, fmi-standard #575: 60 Hz for 1000 s, without a step too many or too few",
        text: r#"parts: { "C": (model: "basics.statistics", rate: "60 Hz"), "T": (model: "basics.ramp", params: { "slope": 1 }), "I": (model: "basics.integrator") },
        wires: ["T.y -> C.u", "T.y -> I.u"], step: "60 Hz", until: "1000 s",
        metrics: { "n": (of: "C.count"), "last": (of: "T.y"), "integral": (of: "I.y") }"#,
        want: &[("n", 60_000.0, 0.0), ("last", 1000.0, 0.0), ("integral", 500_000.0, 1e-6)],
    },
    Case {
        report: "FMIKit-Simulink #133: time is added up by floating-point steps of 0.04 s",
        text: r#"parts: { "C": (model: "basics.statistics", rate: "25 Hz"), "T": (model: "basics.ramp", params: { "slope": 1 }) },
        wires: ["T.y -> C.u"], step: "40 ms", until: "256 s",
        metrics: { "n": (of: "C.count"), "max": (of: "C.max"), "at": (of: "T.y", at: "time >= 255.96 s") }"#,
        want: &[("n", 6400.0, 0.0), ("max", 255.96, 1e-12), ("at", 255.96, 1e-9)],
    },
    Case {
        report: "Reference-FMUs #612: a stop within a step, without a step beyond it",
        text: r#"parts: { "T": (model: "basics.ramp", params: { "slope": 1 }), "I": (model: "basics.integrator") },
        wires: ["T.y -> I.u"], step: "10 ms", until: "2 s", stop_when: "time >= 1.005 s",
        metrics: { "last": (of: "T.y"), "integral": (of: "I.y") }"#,
        want: &[("last", 1.005, 1e-9), ("integral", 0.505_012_5, 1e-9)],
    },
    Case {
        report: "gz-sim, OpenModelica: samples faster than the step, and of a period that is no multiple of it",
        text: r#"parts: {
            "T": (model: "basics.ramp"), "F": (model: "basics.hold", rate: "1 kHz"), "S": (model: "basics.statistics", rate: "1 kHz"),
            "O": (model: "basics.statistics", rate: "7 Hz") },
        wires: ["T.y -> F.u", "F.y -> S.u", "T.y -> O.u"], step: "10 ms", until: "1 s",
        metrics: { "n": (of: "S.count"), "mean": (of: "S.mean"), "odd": (of: "O.count"), "odd mean": (of: "O.mean") }"#,
        // The samples are at 0, 1, .. 999 ms, and at 0, 1/7, .. 6/7 s.
        want: &[
            ("n", 1000.0, 0.0),
            ("mean", 0.4995, 1e-9),
            ("odd", 7.0, 0.0),
            ("odd mean", 3.0 / 7.0, 1e-12),
        ],
    },
    Case {
        report: "simulator #7, healthiar #690: two sensors with the same numbers have the same noise",
        text: r#"bodies: { "up": (parent: "world") },
        parts: {
            "A": (model: "sensors.attitude", rate: "100 Hz", params: { "rate_sigma": 1 }, bind: { "mount": "node:up" }), "B": (model: "sensors.attitude", rate: "100 Hz", params: { "rate_sigma": 1 }, bind: { "mount": "node:up" }),
            "P": (model: "basics.product") },
        wires: ["A.angular.x -> P.a", "B.angular.x -> P.b"], step: "10 ms", until: "100 s",
        metrics: { "correlation": (of: "P.y", take: "mean"), "a": (of: "A.angular.x", take: "std") }"#,
        want: &[("correlation", 0.0, 0.03), ("a", 1.0, 0.03)],
    },
    Case {
        report: "gz-sim (samples), textbook: the value of a sampled part at an instant at which it is sampled, and at the end of a run there",
        text: r#"parts: { "T": (model: "basics.ramp"), "H": (model: "basics.hold", rate: "10 Hz") },
        wires: ["T.y -> H.u"], step: "0.1 s", until: "2 s", stop_when: "time >= 0.5 s",
        metrics: { "end": (of: "H.y"), "at": (of: "H.y", at: "time >= 0.3 s"), "between": (of: "H.y", at: "time >= 0.25 s"), "itself": (of: "T.y", at: "H.y >= 0.4") }"#,
        want: &[
            ("end", 0.5, 1e-12),
            ("at", 0.3, 1e-12),
            ("between", 0.2, 1e-12),
            ("itself", 0.4, 1e-12),
        ],
    },
    Case {
        report: "textbook: percentiles of a ramp, also the first and the last",
        text: r#"parts: { "T": (model: "basics.ramp") }, step: "0.5 s", until: "10 s",
        metrics: { "low": (of: "T.y", take: "percentile", percent: 0), "quarter": (of: "T.y", take: "percentile", percent: 25), "high": (of: "T.y", take: "percentile", percent: 100) }"#,
        want: &[("low", 0.0, 1e-9), ("quarter", 2.5, 1e-9), ("high", 10.0, 1e-9)],
    },
    Case {
        report: "RON numbers with underscores: in a condition as everywhere else",
        text: r#"parts: { "T": (model: "basics.ramp", params: { "slope": 1_0 }) }, step: "0.1 s", until: "1 s",
        metrics: { "at": (of: "T.y", at: "time >= 0.500_0 s") }"#,
        want: &[("at", 5.0, 1e-9)],
    },
];

#[test]
fn runtime() {
    hold(CASES);
}

/// llnl/units #293, scopehal-apps #401, smarthomej #99, followthemoney PR 380, precice PR 805: units and decimal commas that could be misread.
#[test]
fn units_that_are_read_as_something_else() {
    for value in [
        "5 kM",
        "5 gramm",
        "2 Metres",
        "5 degrees C",
        "1,5",
        "1,5 m",
        "1e",
        "0x10",
        "5 m/s2",
        "1/3 m",
        "cm+cm",
        "nan",
        "inf",
        "3 M",
        "5 Min",
    ] {
        let text = format!(
            r#"parts: {{ "C": (model: "basics.constant", params: {{ "value": "{value}" }}) }}, until: 1"#
        );
        let text: &'static str = text.leak();
        refuse(&[Refused { report: "units", text, says: "C.value" }]);
    }
}

/// In MuJoCo, bodies on joints of the world collide with it; here they do not, which gives a warning.
#[test]
fn a_mass_on_a_slider_that_falls_through_the_floor_is_a_warning() {
    let scene = |contact: &str| {
        let text = format!(
            r#"Simulation(
                bodies: {{
                    "floor": (parent: "world", shapes: [(shape: Box([4, 4, 0.2]), collide: true, at: (position: [0, 0, -0.1]), name: "top")]),
                    "mass": (parent: "world", at: (position: [0, 0, 1]), hinge: Slider([0, 0, 1]), mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: true)]),
                    "near": (parent: "world", at: (position: [9, 0, 1]), hinge: Pin([0, 1, 0]), mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), collide: true)]),
                }},
                parts: {{ "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}) }},
                contact: ({contact}), until: "1 s", metrics: {{ "z": (of: "mass.displacement") }},
            )"#
        );
        let catalogue = crate::common::catalogue();
        let loaded = load_text("scene.ron", &text, &Options::new(&catalogue)).unwrap();
        let told: Vec<String> = loaded.warnings().iter().map(|w| w.message.clone()).collect();
        (told, crate::common::metrics_of(&text).unwrap()["z"])
    };
    let (told, z) = scene("");
    assert!(
        told.len() == 1
            && told[0].starts_with("`mass`: its shapes do not collide with `floor/top`"),
        "{told:?}"
    );
    assert!(z < -4.0);
    let (told, z) = scene(r#"collide: [["mass", "floor"]]"#);
    assert!(told.is_empty() && (z + 0.9).abs() < 2e-4, "{told:?} {z}");
    assert!(scene(r#"ignore: [["mass", "floor"]]"#).0.is_empty());
    // Bodies that collide in another phase may intentionally pass in the first.
    let phases = r#"start: "held", phases: { "held": (to: { "free": "time > 0.5 s" }), "free": (bodies: { "mass": (hinge: Free) }) }"#;
    assert!(scene(&format!("), {phases}, view: (")).0.is_empty());
}

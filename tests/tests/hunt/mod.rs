//! Public bug reports about other tools, tried on this one. Each is a small input with a known result from a closed form, a published number or a
//! reference program. `tests/hunt` lists the reports, with the first and the present results.

mod attitude;
mod combinations;
mod dynamics;
mod flight;
mod reported;
mod reviews;
mod rover;
mod runtime;
mod sensors;

use crate::common::metrics_of;

/// One report: the content of a `Simulation(..)`, and its metrics (name, expected value, tolerance).
struct Case {
    report: &'static str,
    text: &'static str,
    want: &'static [(&'static str, f64, f64)],
}

/// An input that must be rejected, and a part of the message.
struct Refused {
    report: &'static str,
    text: &'static str,
    says: &'static str,
}

/// Gravity of level ground, the wheels of a small car whose rear wheels do not steer, and a switch that is on, with its wires.
const WORDS: [(&str, &str); 4] = [
    (
        "SWITCH",
        r#""One": (model: "basics.constant", params: { "value": 1 }), "Zero": (model: "basics.constant", params: { "value": 0 }), "On": (model: "basics.comparator")"#,
    ),
    ("CLOSES", r#""One.y -> On.a", "Zero.y -> On.b""#),
    (
        "EARTH",
        r#""Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] })"#,
    ),
    (
        "WHEELS",
        "[(position: [1, 0.3]), (position: [1, -0.3]), (position: [0, 0.3], steered: false), (position: [0, -0.3], steered: false)]",
    ),
];

fn whole(text: &str) -> String {
    let inside = WORDS.iter().fold(text.to_string(), |text, (word, is)| text.replace(word, is));
    format!("Simulation(\n{inside},\n)\n")
}

/// Checks all metrics of all cases, and reports all deviations in one message.
fn hold(cases: &[Case]) {
    let mut wrong = Vec::new();
    for case in cases {
        let metrics = match metrics_of(&whole(case.text)) {
            Ok(metrics) => metrics,
            Err(e) => {
                wrong.push(format!("{}: {e}", case.report));
                continue;
            }
        };
        assert_eq!(metrics.len(), case.want.len(), "{}: a metric is not looked at", case.report);
        for (name, want, within) in case.want {
            match metrics.get(*name) {
                Some(y) if (y - want).abs() <= *within => {}
                y => wrong
                    .push(format!("{}: {name} is {y:?}, not {want} within {within}", case.report)),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Checks that all are rejected with their messages.
fn refuse(cases: &[Refused]) {
    for case in cases {
        match metrics_of(&whole(case.text)) {
            Ok(metrics) => panic!("{}: accepted: {metrics:?}", case.report),
            Err(e) => assert!(e.contains(case.says), "{}: {e}", case.report),
        }
    }
}

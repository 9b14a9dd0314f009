//! Settings that have no effect are warnings with place, fact and remedy, unless another phase uses them.
use crate::common::*;
use linkwork_assembly::*;
use linkwork_runtime::Files;

/// Returns the warnings of all phases as `line: message`. Each has a remedy.
fn warnings(text: &str) -> Vec<String> {
    let catalogue = catalogue();
    let loaded = load_text("s.ron", text, &Options::new(&catalogue));
    let loaded = loaded.unwrap_or_else(|f| panic!("{f}\n{text}"));
    let program = loaded.compile(&catalogue, &Files::default()).unwrap_or_else(|f| panic!("{f:?}"));
    let of_phases = program.phases.iter().flat_map(|p| p.plan.warnings.clone());
    let all = loaded.warnings().into_iter().chain(of_phases);
    let line = |w: &linkwork_runtime::Fault| {
        assert!(w.help.is_some(), "{w:?}");
        loaded.sources.place(w.origin).map_or(0, |place| place.1)
    };
    all.map(|w| format!("{}: {}", line(&w), w.message)).collect()
}

/// A simulation with one body on line 2.
fn one(hinge: &str, fields: &str, more: &str) -> String {
    format!(
        "Simulation(step: \"1 ms\", gravity: \"none\",
        bodies: {{ \"arm\": (parent: \"world\", hinge: {hinge}, mass: 1, inertia: [1, 1, 1], {fields}) }},
        {more})"
    )
}

const PIN: &str = "Pin([0, 1, 0])";
const LIMITS: &str = "limits: (lower: -1, upper: 1)";

#[test]
fn settings_of_prescribed_hinges_are_reported() {
    let all = "prescribed: true, spring: (stiffness: 3), damping: 0.1, friction: (force: 1, rate: 0.1), limits: (lower: -1, upper: 1, restitution: 0.5), armature: 0.2, gear: 3";
    assert_eq!(
        warnings(&one(PIN, all, "")),
        [
            "2: body `arm`: `spring`, `damping`, `friction`, `limits` and `restitution` have no effect: the hinge is prescribed"
        ]
    );
    // A free hinge uses all of these settings. The rotor affects the effort of a prescribed hinge.
    assert!(warnings(&one(PIN, &all.replace("true", "false"), "")).is_empty());
    assert!(warnings(&one(PIN, "prescribed: true, armature: 0.2, gear: 3", "")).is_empty());
    // Limits of rate and effort are never reported, because models read them.
    let read = "prescribed: true, limits: (rate: 1, effort: 2)";
    assert!(warnings(&one(PIN, read, "")).is_empty());
    let chain = "Chain(Pin(axis: [0, 0, 1], damping: 1), Slider(axis: [1, 0, 0], prescribed: true, damping: 2))";
    assert_eq!(
        warnings(&one(chain, "", "")),
        ["2: body `arm`, hinge 2 of its chain: `damping` has no effect: the hinge is prescribed"]
    );
    let ball = "prescribed: true, limits: (cone: 1), spring: (stiffness: 1)";
    assert_eq!(
        warnings(&one("Ball", ball, "")),
        ["2: body `arm`: `spring` and `limits` have no effect: the hinge is prescribed"]
    );
}

#[test]
fn a_setting_that_one_phase_uses_is_not_reported() {
    let phases = |other: &str| {
        format!(
            "start: \"a\", phases: {{ \"a\": (to: {{ \"b\": \"time > 1 s\" }}), \"b\": ({other}) }}"
        )
    };
    let held = "prescribed: true, damping: 0.1, friction: 2";
    let let_go = phases("bodies: { \"arm\": (prescribed: false) }");
    // The hinge is free in one phase, but its dry friction would need contact there.
    assert_eq!(
        warnings(&one(PIN, held, &let_go)),
        ["2: body `arm`: `friction` has no effect: the hinge is prescribed"]
    );
    let touched = phases("bodies: { \"arm\": (prescribed: false) }, contact: ()");
    assert!(warnings(&one(PIN, held, &touched)).is_empty());
    assert_eq!(
        warnings(&one(PIN, held, &phases(""))),
        ["2: body `arm`: `damping` and `friction` have no effect: the hinge is prescribed"]
    );
}

#[test]
fn settings_that_need_others_are_reported() {
    let soft = "stop: (stiffness: 100)";
    let limited = |more: &str| format!("{LIMITS}, {more}");
    let bouncing = "limits: (lower: -1, upper: 1, restitution: 0.5), stop: false";
    for (fields, more, expected) in [
        (soft, "", "`stop` has no effect: the hinge has no limits"),
        (&limited(soft), "", ""),
        (&limited(soft), "contact: (compliant: true),", ""),
        (&limited(soft), "contact: (),", "`stop` has no effect: with `contact`, limits are rigid"),
        (
            &limited("stop: false"),
            "contact: (),",
            "`stop` has no effect: `contact` enforces limits",
        ),
        (&limited("stop: false"), "contact: (limits: false),", ""),
        (&limited("stop: false"), "", ""),
        (
            bouncing,
            "",
            "`restitution` has no effect: `stop: false` lets the coordinate pass its limits",
        ),
        ("gear: 50", "", "`gear` has no effect: it only scales `armature`, which is 0"),
        ("gear: 50, armature: 1e-3", "", ""),
        (
            "friction: 1",
            "",
            "`friction` has no effect: it is dry friction, which only contact by impulses supports",
        ),
        ("friction: 1", "contact: (),", ""),
    ] {
        let found = warnings(&one(PIN, fields, more));
        match expected {
            "" => assert!(found.is_empty(), "{fields} {more}: {found:?}"),
            _ => assert_eq!(found, [format!("2: body `arm`: {expected}")], "{fields} {more}"),
        }
    }
}

#[test]
fn settings_of_the_other_kind_of_contact_are_reported() {
    let ball = "shapes: [(shape: Sphere(0.1), collide: (material: \"skin\", restitution: 0.3))]";
    let impulses = "margin: 0.01, slop: 1e-4, correction: 0.1, push_max: 1, bounce_min: 0.1, restitution: 0.1, limits: false, method: Newton, tolerance: 1e-4, sweeps: 5, steps: 5, relaxation: 1, directions: 8, pairs: [(a: \"skin\", b: \"skin\", restitution: 0.4)]";
    let text = |compliant: &str| {
        let contact = format!("contact: ({compliant} {impulses})");
        one("Free", ball, &contact)
    };
    assert!(warnings(&text("")).is_empty());
    let reason = "compliant contact does not use them";
    assert_eq!(
        warnings(&text("compliant: true,")),
        [
            format!("2: collider `arm/shape1`: `restitution` has no effect: {reason}"),
            format!(
                "3: `contact`: `margin`, `slop`, `correction`, `push_max`, `bounce_min`, `restitution`, `limits`, `method`, `tolerance`, `sweeps`, `steps`, `relaxation` and `directions` have no effect: {reason}"
            ),
            format!(
                "3: `contact`: pair of `skin` and `skin`: `restitution` has no effect: {reason}"
            ),
        ]
    );
    // Friction, rolling friction and neighbours apply to both kinds of contact.
    let both =
        "contact: (compliant: true, friction: 0.4, rolling_friction: 1e-3, neighbours: Collide)";
    assert!(warnings(&one("Free", &ball.replace(", restitution: 0.3", ""), both)).is_empty());
}

//! Loops, couplings and modes of a text: read, run, resolved, rejected.
use crate::common::*;
use linkwork_assembly::*;
use linkwork_collision::Shape;
use linkwork_multibody::{Hinge, SubhingeKind};
use linkwork_plant::SpecExt;
use linkwork_runtime::{BindTarget, Files, compile};
use linkwork_solvers::ConstraintMethod;
use linkwork_spatial::Vec3;

const BAR: &str = "mass: 1, inertia: [1e-3, 2e-3, 3e-3], com: [0, 0, 0.07]";

/// A four-bar linkage in an assembly `Arm`, whose pins are nodes, and a separate rail.
fn linkage(more: &str) -> String {
    format!(
        r#"Simulation(parts: {{ "Arm": (
        params: {{ "reach": (default: 0.3, unit: "m") }},
        bodies: {{
            "crank": (parent: "world", hinge: Pin([0, 1, 0]), {BAR}, initial: (angle: "20 deg"),
                nodes: {{ "pin": (position: [0, 0, 0.1]) }}),
            "rod": (parent: "crank/pin", hinge: Pin([0, 1, 0]), {BAR}, initial: (angle: "70 deg"),
                nodes: {{ "end": (position: [0, 0, 0.3], rotation: (rpy: [0, 0, "90 deg"])) }}),
            "rocker": (parent: "world", at: (position: ["$reach", 0, 0]), hinge: Pin([0, 1, 0]), {BAR}),
            "rail": (parent: "world", at: (position: [0, 1, 0]), hinge: Slider([1, 0, 0]), {BAR}),
            "turret": (parent: "world", hinge: Chain(Pin([0, 0, 1]), Locked, Pin([1, 0, 0])), {BAR}),
        }},
        {more}
    ) }})"#
    )
}

const LOOPS: &str = r#"loops: {
    "coupler": (a: "rod/end", at_a: (rotation: (rpy: [0, 0, "-90 deg"])), b: "rocker", at_b: (position: [0, 0, 0.1]),
        hinge: Pin([0, 1, 0]), solve: Embed),
    "motor": (b: "world", at_b: (position: [0, 1, 0]), a: "rail", hinge: Slider([-1, 0, 0]), prescribed: true,
        initial: (position: "2 cm", rate: "0.1 m/s")),
},
couplings: {
    "pan": (mimic: "turret", of: "rocker", ratio: -2, offset: "5 deg", solve: Augment),
    "tilt": (terms: { "turret[1]": 2, "crank": -1 }, constant: "10 deg"),
},
parts: { "Push": (model: "test.push", params: { "acceleration": 0.2 }, bind: { "motion": "loop:motor" }) }"#;

#[test]
fn every_field_of_loops_and_couplings_is_read() {
    let loaded = good(&linkage(LOOPS));
    let m = spec(&loaded);
    let mb = &m.multibody;
    let [coupler, motor] = [&mb.loops()[0].closure, &mb.loops()[1].closure];
    assert_eq!(
        (coupler.name.as_str(), coupler.hinge.clone()),
        ("Arm/coupler", Hinge::pin(Vec3::y()))
    );
    assert_eq!([&coupler.body_a, &coupler.body_b], ["Arm/rod", "Arm/rocker"]);
    // The pose of the node is applied first, and then the frame's own pose, whose rotation cancels
    // the node's.
    assert!((coupler.frame_a.position - Vec3::new(0.0, 0.0, 0.3)).amax() < 1e-15);
    assert!(coupler.frame_a.rotation.angle() < 1e-15);
    assert_eq!(coupler.frame_b.position.z, 0.1);
    assert_eq!([&motor.body_a, &motor.body_b], ["Arm/rail", "world"]);
    assert_eq!(m.motions.len(), 1);
    assert_eq!((m.motions[0].position, m.motions[0].rate), (0.02, 0.1));
    let constraint_method = |name: &str| m.constraint_methods[name];
    assert_eq!(constraint_method("Arm/coupler"), ConstraintMethod::Embed);
    assert_eq!(constraint_method("Arm/pan"), ConstraintMethod::Augment);
    assert_eq!(constraint_method("Arm/tilt"), ConstraintMethod::Auto);
    let [pan, tilt] = [&mb.couplings()[0].coupling, &mb.couplings()[1].coupling];
    let terms = |c: &linkwork_multibody::Coupling| -> Vec<(String, usize, f64)> {
        let one = |t: &linkwork_multibody::Term| {
            (t.coordinate.body.clone(), t.coordinate.subhinge, t.factor)
        };
        c.terms.iter().map(one).collect()
    };
    assert_eq!(terms(pan), [("Arm/turret".into(), 0, 1.0), ("Arm/rocker".into(), 0, 2.0)]);
    assert_eq!(pan.constant, 5f64.to_radians());
    // The turret's coordinate is in subhinge 2, because the locked one counts. The order of the map
    // does not matter.
    assert_eq!(terms(tilt), [("Arm/crank".into(), 0, -1.0), ("Arm/turret".into(), 2, 2.0)]);
    let bound = BindTarget::Loop { name: "Arm/motor".into(), index: 0 };
    assert_eq!(loaded.spec.binds[0].target, bound);
    resolves(&loaded);
}

#[test]
fn a_run_keeps_loops_and_couplings() {
    let loaded = good(&linkage(LOOPS));
    let sim = run(&loaded.spec, 0.5);
    let get = |name: &str| sim.get(name).unwrap();
    for name in ["coupler", "motor", "pan", "tilt"] {
        let error = get(&format!("Mechanism.Arm/{name}.error"));
        assert!(error.abs() < 1e-9, "{name}: {error}");
    }
    let pan = get("Arm/turret[0].angle") + 2.0 * get("Arm/rocker.angle");
    assert!((pan - 5f64.to_radians()).abs() < 1e-9, "{pan}");
    // Frame B, which is the world, moves along −x of the rail, so the rail is at x = u = 0.02 + 0.1
    // t + 0.1 t².
    let want = 0.02 + 0.1 * 0.5 + 0.1 * 0.25;
    assert!((get("Arm/rail.displacement") - want).abs() < 1e-9, "{}", get("Arm/rail.displacement"));
}

#[test]
fn overrides_reach_into_loops_couplings_and_colliders() {
    let more = format!(
        "{LOOPS}, colliders: {{ \"floor\": (on: \"world\", shape: HalfSpace) }},
         overrides: {{ \"coupler.solve\": Augment, \"pan.ratio\": 3 }}"
    );
    let text = linkage(&more).replacen(
        "Simulation(",
        "Simulation(overrides: { \"Arm/floor.friction\": 0.9 }, contact: (), ",
        1,
    );
    let loaded = good(&text);
    let m = spec(&loaded);
    assert_eq!(m.constraint_methods["Arm/coupler"], ConstraintMethod::Augment);
    assert_eq!(m.multibody.couplings()[0].coupling.terms[1].factor, -3.0);
    let colliders = loaded.colliders.as_ref().unwrap();
    assert_eq!(colliders.spec(colliders.find("Arm/floor").unwrap()).material.friction, 0.9);
    faults(
        &linkage(&format!("{LOOPS}, overrides: {{ \"/coupler.solv\": 1 }}")),
        &[
            "override `/coupler.solv` matches nothing",
            "+loop `coupler` has no such field. fields: a, b,",
        ],
    );
}

#[test]
fn a_mount_may_be_an_end_and_a_coordinate() {
    let inner = r#"Assembly(
        mounts: { "left": "one side", "right": "the other" },
        couplings: { "differential": (terms: { "left": 1, "right": 1 }) },
        loops: { "rope": (a: "left", b: "right", hinge: Chain(Slider([1, 0, 0]), Slider([0, 1, 0]), Slider([0, 0, 1]))) },
    )"#;
    let text = format!(
        r#"Simulation(bodies: {{
            "l": (parent: "world", hinge: Pin([0, 1, 0]), {BAR}),
            "r": (parent: "world", hinge: Pin([0, 1, 0]), {BAR}, nodes: {{ "n": () }}),
        }}, parts: {{ "D": (assembly: "d.ron", mounts: {{ "left": "l", "right": "r" }}) }})"#
    );
    let catalogue = catalogue();
    let options = Options::new(&catalogue).embed("d.ron", inner);
    let loaded = load_text("s.ron", &text, &options).unwrap_or_else(|f| panic!("{f}"));
    let c = &spec(&loaded).multibody.couplings()[0].coupling;
    assert_eq!((c.name.as_str(), c.terms[1].coordinate.body.as_str()), ("D/differential", "r"));
    assert_eq!(spec(&loaded).multibody.loops()[0].closure.body_b, "r");
    resolves(&loaded);
    // A node does not have a hinge.
    let wrong = text.replace("\"right\": \"r\"", "\"right\": \"r/n\"");
    let error = load_text("s.ron", &wrong, &options).err().unwrap().to_string();
    assert!(error.contains("coupling `D/differential`: `right` is the node `n` of `r`"), "{error}");
}

#[test]
fn mistakes_in_loops_have_places_and_remedies() {
    let loops = |fields: &str| linkage(&format!("loops: {{\n\"l\": ({fields}),\n}}"));
    let place = "sim.ron:13:2\n";
    for (fields, expected) in [
        (
            "a: \"rot\", b: \"rocker\", hinge: Pin([0, 1, 0])",
            &["loop `Arm/l`: `a`: there is no body `rot`", "+did you mean `rod`?"][..],
        ),
        (
            "a: \"rod/ent\", b: \"rocker\"",
            &["`a`: body `Arm/rod` has no node `ent`", "+did you mean `end`?"],
        ),
        ("a: \"rod\"", &["loop `Arm/l` has no `b`", "+write `b: \"a body or node\"`"]),
        (
            "a: \"rod\", b: \"rocker\", hinge: Pinn([0, 1, 0])",
            &["there is no hinge `Pinn`", "+did you mean `Pin`?"],
        ),
        (
            "a: \"rod\", b: \"rocker\", solve: Embedd",
            &["`solve`: there is no word `Embedd`", "+did you mean `Embed`?"],
        ),
        (
            "a: \"rod\", b: \"rocker\", att: ()",
            &["loop `Arm/l` has no field `att`", "+help: did you mean"],
        ),
        (
            "a: \"rod\", b: \"rocker\", initial: (angle: 1)",
            &[
                "`initial` is for prescribed subhinges, but there are none",
                "+write `prescribed: true`",
            ],
        ),
        (
            "a: \"rod\", b: \"rocker\", hinge: Pin(axis: [0, 1, 0], prescribed: true), initial: (angel: 1)",
            &["`initial` has no field `angel`", "+did you mean `angle`?"],
        ),
        (
            "a: \"rod\", b: \"rocker\", hinge: Free",
            &[
                "loop `Arm/l`: its hinge permits every motion",
                "+sim.ron:13:2\n",
                "+remove the loop",
            ],
        ),
        (
            "a: \"rod\", b: \"rod\", hinge: Pin([0, 1, 0])",
            &[
                "loop `Arm/l`: both ends are on `Arm/rod`",
                "+sim.ron:13:2\n",
                "+a loop joins two bodies",
            ],
        ),
        (
            "a: \"rod\", b: \"rocker\", hinge: Pin(axis: [0, 1, 0], armature: 1)",
            &["has armature or limits", "+sim.ron:13:2\n"],
        ),
        (
            "a: \"rod\", b: \"rocker\", hinge: Pin(axis: [0, 1, 0], gear: 0)",
            &["loop `Arm/l`, subhinge 0: gear ratio 0", "+sim.ron:13:2\n"],
        ),
        (
            "a: \"rod\", b: \"rocker\", hinge: Chain(Pin([0, 1, 0]), Slider([1, 0, 0]))",
            &["has a slider after a rotation", "+sim.ron:13:2\n"],
        ),
    ] {
        faults(&loops(fields), expected);
        assert!(bad(&loops(fields)).contains("sim.ron:13:"), "{place} {fields}");
    }
    // All mistakes are reported at once, each with its line.
    faults(
        &linkage(
            "loops: {\n\"l\": (a: \"rot\", b: \"rod\"),\n\"m\": (a: \"rod\", b: \"wrold\") },\ncouplings: {\n\"c\": (terms: { \"cranc\": 1 }) }",
        ),
        &[
            "sim.ron:13:10\n",
            "loop `Arm/m`: `b`: there is no body `wrold`\n  --> sim.ron:14:20\n  help: did you mean `world`?",
            "coupling `Arm/c`: there is no body `cranc`\n  --> sim.ron:16:17\n  help: did you mean `crank`?",
        ],
    );
    faults(
        &linkage(
            "loops: { \"x\": (a: \"rod\", b: \"rocker\") }, couplings: { \"x\": (terms: { \"crank\": 1 }) }",
        ),
        &["`Arm/x` is both a loop and a coupling", "+rename one of them"],
    );
}

#[test]
fn mistakes_in_couplings_have_places_and_remedies() {
    let couplings = |fields: &str| linkage(&format!("couplings: {{\n\"c\": ({fields}),\n}}"));
    for (fields, expected) in [
        (
            "terms: {}",
            &["coupling `Arm/c` lacks `terms`", "+sim.ron:13:2\n", "+write `terms: { \"left\": 1"]
                [..],
        ),
        ("constant: 1", &["coupling `Arm/c` lacks `terms`"]),
        (
            "terms: { \"crank\": 0, \"rod\": 0 }",
            &["coupling `Arm/c` has no nonzero term", "+sim.ron:13:2\n"],
        ),
        (
            "terms: { \"crank\": 1, \"crank[0]\": 1 }",
            &["subhinge 0 of `Arm/crank` appears twice", "+sim.ron:13:2\n", "+add the factors"],
        ),
        (
            "terms: { \"crank[1]\": 1 }",
            &[
                "the hinge of `Arm/crank` has 1 one-dof coordinates, not 2",
                "+use a pin, slider or screw",
            ],
        ),
        ("terms: { \"crank[x]\": 1 }", &["`x` is not the number of a coordinate"]),
        ("terms: { \"world\": 1 }", &["the world has neither nodes nor hinges"]),
        (
            "terms: { \"crank\": \"1 m\" }",
            &["`crank`: `1 m` is in m, but a plain number is expected"],
        ),
        (
            "terms: { \"crank\": 1 }, constant: \"1 m\"",
            &["`constant`: `1 m` is in m, but rad is expected"],
        ),
        (
            "terms: { \"rail\": 1 }, constant: \"1 deg\"",
            &["`constant`: `1 deg` is in deg, but m is expected"],
        ),
        ("terms: { \"crank\": 1 }, ratio: 2", &["coupling `Arm/c` has both `terms` and `ratio`"]),
        ("mimic: \"crank\"", &["coupling `Arm/c` lacks `of`", "+a = ratio · b + offset"]),
        (
            "mimic: \"crank\", of: \"rocket\"",
            &["there is no body `rocket`", "+did you mean `rocker`?"],
        ),
        (
            "mimic: \"rail\", of: \"crank\", offset: \"1 deg\"",
            &["`offset`: `1 deg` is in deg, but m is expected"],
        ),
        ("terms: [(factor: 1)]", &["`terms`: item 1 has no `of`\n  --> sim.ron:13:15\n"]),
    ] {
        faults(&couplings(fields), expected);
        assert!(bad(&couplings(fields)).contains("sim.ron:13:"), "{fields}");
    }
}

#[test]
fn a_loop_is_bound_by_its_name_and_a_wrong_one_is_told() {
    let bound = |target: &str| {
        linkage(&LOOPS.replace("loop:motor", target)).replacen(
            "parts: { \"Arm\"",
            "parts: {\n\"Arm\"",
            1,
        )
    };
    for good_name in ["loop:motor", "loop:motor[0]", "loop:Arm/motor", "loop:/Arm/motor"] {
        let loaded = good(&bound(good_name));
        assert!(
            matches!(&loaded.spec.binds[0].target, BindTarget::Loop { name, .. } if name == "Arm/motor")
        );
    }
    faults(
        &bound("loop:moter"),
        &["`Arm.Push`: binding `motion`: there is no loop `moter`", "+help: did you mean `motor`?"],
    );
    let error = |target: &str| {
        let loaded = good(&bound(target));
        let faults = compile(&loaded.spec, &catalogue(), &Files::default()).err().unwrap();
        show_faults(&faults.0, &loaded.sources, Look::Plain)
    };
    let shown = error("loop:coupler");
    assert!(shown.contains("loop `Arm/coupler` has 0 prescribed subhinges, not 1"), "{shown}");
    assert!(
        shown.contains("write `prescribed: true`") && shown.contains("--> sim.ron:"),
        "{shown}"
    );
    assert!(error("loop:motor[1]").contains("has 1 prescribed subhinges, not 2"));
}

#[test]
fn a_loop_that_cannot_close_has_its_place() {
    let loaded = good(&linkage(LOOPS).replace("default: 0.3", "default: 5"));
    let faults = compile(&loaded.spec, &catalogue(), &Files::default()).err().unwrap();
    let shown = show_faults(&faults.0, &loaded.sources, Look::Plain);
    assert!(shown.contains("error: loop `Arm/coupler` does not close: an error of"), "{shown}");
    assert!(shown.contains("--> sim.ron:13:6\n  help: start nearer"), "{shown}");
}

#[test]
fn modes_are_read_and_their_mistakes_told() {
    let boom = |modes: &str| {
        format!(
            "Simulation(bodies: {{\n\"boom\": (parent: \"world\", hinge: Pin([0, 0, 1]),\nmodes: {modes}, nodes: {{\n\"tip\": (position: [2, 0, 0]) }}) }})"
        )
    };
    let beam = "Beam(length: 2, diameter: \"3 cm\", inner: \"2 cm\", young: \"70 GPa\", poisson: 0.33, density: 2700, damping_ratio: 0.01, ends: ClampedFree, count: (bending_y: 2, twist: 1))";
    let loaded = good(&boom(beam));
    let made = {
        use linkwork_multibody::modes::{Beam, BeamModes};
        let beam = Beam { damping_ratio: 0.01, ..Beam::tube(2.0, 0.03, 0.02, 7e10, 0.33, 2700.0) };
        beam.modes(BeamModes { bending_y: 2, twist: 1, ..BeamModes::default() }).unwrap()
    };
    let mb = &spec(&loaded).multibody;
    assert_eq!(mb.spec(mb.body("boom").unwrap()).modes.as_ref(), Some(&made));
    resolves(&loaded);
    // A simulation reads modes from a file; the resolved text does not need this file.
    let text = ron::to_string(&made).unwrap();
    let catalogue = catalogue();
    let options = Options::new(&catalogue).embed("boom.modes.ron", text);
    let filed = load_text("sim.ron", &boom("File(\"boom.modes.ron\")"), &options);
    let filed = filed.unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(spec(&filed).multibody, *mb);
    resolves(&filed);
    let plate = "Plate(length: 2, width: 1, thickness: 0.01, young: 7e10, poisson: 0.3, density: 2700, attach: [[2, 0]], count: 3)";
    assert_eq!(spec(&good(&boom(plate))).multibody.nv(), 4);
    for (modes, expected) in [
        (
            beam.replace("length: 2,", ""),
            &["`Beam` has no `length`\n  --> sim.ron:3:8\n", "+write `length: ..` in m"][..],
        ),
        (
            beam.replace("length: 2", "length: -2"),
            &["beam: `length` is -2\n  --> sim.ron:3:8\n", "+> 0"],
        ),
        (
            beam.replace("inner", "innner"),
            &["`Beam` has no field `innner`\n", "+did you mean `inner`?"],
        ),
        (beam.replace("twist: 1", "twist: 1.5"), &["`twist` is 1.5\n", "+an integer"]),
        (
            beam.replace("ClampedFree", "ClampedFre"),
            &["`ends`: there is no word `ClampedFre`\n", "+did you mean `ClampedFree`?"],
        ),
        (
            beam.replace("Beam", "Beem"),
            &["there is no kind of modes `Beem`\n", "+did you mean `Beam`?"],
        ),
        (
            beam.replace("length: 2", "length: 1.5"),
            &["on flexible body `boom`", "+  --> sim.ron:4:2\n"],
        ),
        (plate.replace("0.3", "0.7"), &["`poisson` is 0.7\n"]),
        ("File(\"x.ron\")".into(), &["there is no file `x.ron`\n"]),
        (
            "Modes(stiffness: [-1], stations: [(translation: [[0, 0, 1]])])".into(),
            &["body `boom`, modes:", "+  --> sim.ron:3:8\n"],
        ),
    ] {
        let shown = bad(&boom(&modes));
        for part in expected {
            let part = part.trim_start_matches('+');
            assert!(shown.contains(part), "\n{part}\nis not in\n{shown}");
        }
    }
}

#[test]
fn a_program_writes_the_same() {
    let body = || {
        let ball = Shape::Sphere { radius: 0.1 };
        Body::on("world").hinge(Hinge::pin(Vec3::y())).mass(1.0).inertia(ball)
    };
    let seen = vec![fields! { shape: variant("Sphere", 0.1), collide: true }];
    let mut built = Assembly::new();
    built
        .body("l", body().set("shapes", seen))
        .body("r", body())
        .coupling("d", fields! { terms: fields! { l: 1.0, r: 1.0 } })
        .loop_closure("w", fields! { a: "l", b: "r", hinge: variant("Ball", Value::Null) })
        .collider("floor", fields! { on: "world", shape: variant("HalfSpace", Value::Null) })
        .set("contact", fields! {});
    let loaded = built.load().unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(good(&built.to_ron()).resolved, loaded.resolved);
    let m = spec(&loaded);
    assert_eq!((m.multibody.loops().len(), m.multibody.couplings().len()), (1, 1));
    assert_eq!(m.multibody.loops()[0].closure.hinge.subhinges[0].kind, SubhingeKind::Ball);
    assert!(m.contact.is_some() && loaded.colliders.as_ref().unwrap().len() == 2);
    resolves(&loaded);
}
#[test]
fn every_mixture_of_treatments_starts_on_the_constraints() {
    let all = ["Embed", "Augment", "Auto"];
    for k in 0..27 {
        let [a, b, c] = [all[k % 3], all[k / 3 % 3], all[k / 9]];
        let text = linkage(LOOPS)
            .replace("solve: Augment", &format!("solve: {a}"))
            .replace("constant: \"10 deg\"", &format!("constant: \"10 deg\", solve: {b}"))
            .replace("solve: Embed", &format!("solve: {c}"));
        run(&good(&text).spec, 0.0);
    }
}

#[test]
fn compliant_contact_replaces_impulses() {
    let with = |contact: &str| {
        format!(
            r#"Simulation(
                bodies: {{ "ball": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), initial: (position: [0, 0, 0.3]), shapes: [(shape: Sphere(0.1), collide: true)]) }},
                colliders: {{ "floor": (on: "world", shape: HalfSpace) }},
                contact: ({contact}), until: "1 s",
            )"#
        )
    };
    let m = good(&with("compliant: (stiffness: 2e5, exponent: 1.5, relaxation: \"2 ms\")"));
    let m = m.spec.mechanism().cloned().unwrap();
    assert!(m.contact.is_none());
    let (colliders, laws) = m.compliant.unwrap();
    let settings = laws.usual;
    assert_eq!(colliders.len(), 2);
    assert_eq!((settings.stiffness, settings.exponent), (2e5, 1.5));
    assert_eq!(settings.relaxation, 2e-3);
    assert!(good(&with("")).spec.mechanism().cloned().unwrap().compliant.is_none());
    let text = bad(&with("compliant: (stifness: 2e5, exponent: 0.5)"));
    assert!(text.contains("stifness") && text.contains("did you mean `stiffness`"), "{text}");
    assert!(text.contains("`exponent`"), "{text}");
}

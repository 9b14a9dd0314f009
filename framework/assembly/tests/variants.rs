//! Variants of assemblies, elements of lists in arithmetic, bars.
use crate::common::*;
use linkwork_assembly::*;
use linkwork_plant::SpecExt;

const BASE: &str = r#"Assembly(
    doc: "An arm.",
    params: {
        "mass": (unit: "kg", default: 2, range: (1, 10), doc: "Mass."),
        "tip": (unit: "m", default: [3, 4, 0], doc: "Where it ends."),
    },
    bodies: {
        "arm": (
            parent: "world", hinge: Pin([0, 0, 1]), mass: "$mass", inertia: Sphere(0.1), com: ["$tip[0] / 2", "-$tip[1]", "$tip[2]"],
            shapes: [(shape: Bar(to: "$tip", width: 0.1, height: "20 cm"), at: (position: [0, 0, 1]), name: "rod")],
        ),
    },
    parts: { "Motor": (model: "test.motor", params: { "resistance": 1 }, bind: { "shaft": "hinge:arm" }) },
)"#;

fn simulation(file: &str) -> String {
    format!("Simulation(parts: {{ \"Arm\": (assembly: \"{file}\") }}, until: \"1 s\")")
}

fn loaded(variant: &str) -> Result<Loaded, String> {
    let catalogue = catalogue();
    let options =
        Options::new(&catalogue).embed("parts/base.ron", BASE).embed("own/heavy.ron", variant);
    load_text("s.ron", &simulation("own/heavy.ron"), &options).map_err(|f| f.render(false))
}

#[test]
fn a_variant_is_the_same_assembly_with_other_defaults() {
    let own = r#"Assembly(like: "parts/base.ron", params: { "mass": (default: "5 kg") }, overrides: { "Motor.gear": 7 })"#;
    let loaded = loaded(own).unwrap_or_else(|e| panic!("{e}"));
    let mechanism = loaded.spec.mechanism().cloned().unwrap();
    assert_eq!(mechanism.multibody.bodies()[0].inertia().mass(), 5.0);
    assert_eq!(loaded.spec.parts[0].params.get("gear").unwrap().value.to_string(), "7.0");
    // The centre of mass is at half of 3 m along x and at −4 m along y.
    let com = mechanism.multibody.bodies()[0].inertia().com();
    assert_eq!((com.x, com.y), (1.5, -4.0));
    // Load a variant of a variant. From outside, the parameter is still a parameter.
    let catalogue = catalogue();
    let options =
        Options::new(&catalogue).embed("parts/base.ron", BASE).embed("own/heavy.ron", own).embed(
            "own/longer.ron",
            r#"Assembly(like: "heavy.ron", params: { "tip": (default: [6, 8, 0]) })"#,
        );
    let text = simulation("own/longer.ron");
    let longer = load_text("s.ron", &text, &options.clone().set("Arm.mass=6 kg"));
    let longer = longer.unwrap_or_else(|f| panic!("{f}"));
    let body = &longer.spec.mechanism().unwrap().multibody.bodies()[0];
    assert_eq!((body.inertia().mass(), body.inertia().com().x), (6.0, 3.0));
    let alone = load_file("own/longer.ron", &options).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(alone.spec.mechanism().unwrap().multibody.bodies()[0].inertia().mass(), 5.0);
    // The resolved text does not need either file.
    let again = load_text("r.ron", &longer.resolved, &Options::new(&catalogue));
    assert!(again.is_ok(), "{:?}", again.err().map(|f| f.render(false)));
}

#[test]
fn a_bar_is_a_box_from_a_point_to_another() {
    let loaded = loaded(r#"Assembly(like: "parts/base.ron")"#).unwrap_or_else(|e| panic!("{e}"));
    let bar = &loaded.shapes[0];
    let linkwork_collision::VisualShape::Shape(linkwork_collision::Shape::Box { half }) =
        &bar.shape
    else {
        panic!("{:?}", bar.shape);
    };
    assert!((half - linkwork_spatial::Vec3::new(2.5, 0.05, 0.1)).norm() < 1e-15, "{half}");
    // The ends of the bar's axis must be the two given points.
    for (end, wanted) in [(-2.5, [0.0, 0.0, 1.0]), (2.5, [3.0, 4.0, 1.0])] {
        let point =
            bar.pose.rotation * linkwork_spatial::Vec3::new(end, 0.0, 0.0) + bar.pose.position;
        assert!((point - linkwork_spatial::Vec3::from(wanted)).norm() < 1e-14, "{point}");
    }
}

#[test]
fn what_a_variant_may_not_say_is_told() {
    for (own, said) in [
        (
            r#"Assembly(like: "parts/base.ron", params: { "mas": (default: 5) })"#,
            "did you mean `mass`?",
        ),
        (
            r#"Assembly(like: "parts/base.ron", params: { "mass": (default: 50) })"#,
            "out of range 1",
        ),
        (
            r#"Assembly(like: "parts/base.ron", params: { "mass": (default: 5, unit: "g") })"#,
            "remove `unit` and `range`",
        ),
        (r#"Assembly(like: "parts/base.ron", bodies: {})"#, "`bodies`"),
        (r#"Assembly(like: "parts/bass.ron")"#, "there is no assembly file `parts/bass.ron`"),
        (r#"Assembly(like: "heavy.ron")"#, "`like` is circular"),
        (
            r#"Assembly(like: "parts/base.ron", params: { "tip": (default: [1, 2]) })"#,
            "`$tip` has 2 elements",
        ),
        (
            r#"Assembly(like: "parts/base.ron", params: { "tip": (default: [0, 0, 0]) })"#,
            "has the length zero",
        ),
        (
            r#"Assembly(like: "parts/base.ron", params: { "tip": (default: 3) })"#,
            "so [0] does not exist",
        ),
    ] {
        let error = loaded(own).err().unwrap_or_else(|| panic!("{own} loads"));
        assert!(error.contains(said), "{own}: {error}");
    }
}

//! Values of bodies: solids compared with integrals, hinges of every kind, starts, fan-out, expressions.
use crate::common::*;
use linkwork_multibody::{Coordinate, SubhingeKind};
use linkwork_plant::{MechanismSpec, SpecExt};
use linkwork_runtime::BindTarget;

fn mechanism(bodies: &str) -> MechanismSpec {
    let text = format!("Simulation(parts: {{ \"R\": (bodies: {{ {bodies} }}) }})");
    good(&text).spec.mechanism().cloned().unwrap()
}

/// Returns the moments about x and z of a solid of revolution about z, from slices of radius ρ(z), each with ρ²/4 + z² and ρ²/2 per mass.
fn slices(rho: impl Fn(f64) -> f64, half: f64, mass: f64) -> (f64, f64) {
    let n = 200_000;
    let (mut m, mut x, mut zz) = (0.0, 0.0, 0.0);
    for k in 0..n {
        let z = half * (2.0 * (k as f64 + 0.5) / n as f64 - 1.0);
        let r2 = rho(z).powi(2);
        m += r2;
        x += r2 * (r2 / 4.0 + z * z);
        zz += r2 * r2 / 2.0;
    }
    (mass * x / m, mass * zz / m)
}

#[test]
fn solids_have_the_inertia_of_their_integral() {
    let round = |z: f64, r: f64, l: f64| {
        let beyond = (z.abs() - l / 2.0).max(0.0);
        (r * r - beyond * beyond).max(0.0).sqrt()
    };
    let (r, l, m) = (0.3, 0.7, 2.5);
    for (solid, rho, half) in [
        (
            format!("Cylinder(radius: {r}, length: {l})"),
            Box::new(move |_| r) as Box<dyn Fn(f64) -> f64>,
            l / 2.0,
        ),
        (format!("Sphere({r})"), Box::new(move |z| round(z, r, 0.0)), r),
        (
            format!("Capsule(radius: {r}, length: {l})"),
            Box::new(move |z| round(z, r, l)),
            l / 2.0 + r,
        ),
    ] {
        let spec = mechanism(&format!("\"b\": (parent: \"world\", mass: {m}, inertia: {solid})"));
        let i = spec.multibody.bodies()[0].inertia().inertia_com();
        let (x, z) = slices(rho, half, m);
        for (got, want) in [(i[(0, 0)], x), (i[(1, 1)], x), (i[(2, 2)], z)] {
            assert!((got - want).abs() < 1e-6 * want, "{solid}: {got} is not {want}");
        }
    }
    let spec = mechanism("\"b\": (parent: \"world\", mass: 12, inertia: Box([1, 2, 3]))");
    let i = spec.multibody.bodies()[0].inertia().inertia_com();
    assert_eq!([i[(0, 0)], i[(1, 1)], i[(2, 2)]], [13.0, 10.0, 5.0]);
}

#[test]
fn six_numbers_are_xx_yy_zz_xy_xz_yz() {
    let spec = mechanism("\"b\": (parent: \"world\", mass: 1, inertia: [4, 5, 6, 0.1, 0.2, 0.3])");
    let i = spec.multibody.bodies()[0].inertia().inertia_com();
    assert_eq!([i[(0, 1)], i[(0, 2)], i[(1, 2)]], [0.1, 0.2, 0.3]);
    assert_eq!(i, i.transpose());
}

#[test]
fn hinges_of_every_kind() {
    for (hinge, nq, nv) in [
        ("Pin([0, 1, 0])", 1, 1),
        ("Pin(axis: [0, 1, 0], armature: \"2 kg m^2\", prescribed: true)", 1, 1),
        ("Slider([1, 0, 0])", 1, 1),
        ("Screw(axis: [0, 0, 1], pitch: \"1 mm/rev\")", 1, 1),
        ("Ball", 4, 3),
        ("Free", 7, 6),
        ("Locked", 0, 0),
        ("Universal([1, 0, 0], [0, 1, 0])", 2, 2),
        ("Cylindrical([0, 0, 1])", 2, 2),
        ("Gimbal", 3, 3),
        ("Planar", 3, 3),
        ("Chain(Pin([1, 0, 0]), Slider([0, 0, 1]))", 2, 2),
        ("Chain([Pin([1, 0, 0]), Ball])", 5, 4),
        ("Chain([Pin([1, 0, 0])])", 1, 1),
    ] {
        let spec = mechanism(&format!("\"b\": (parent: \"world\", hinge: {hinge})"));
        assert_eq!((spec.multibody.nq(), spec.multibody.nv()), (nq, nv), "{hinge}");
        let first = spec.multibody.bodies()[0].subhinges().first();
        if hinge.contains("armature") {
            let s = first.unwrap().subhinge;
            assert_eq!((s.armature, s.coordinate), (2.0, Coordinate::Prescribed));
        }
        if let Some(SubhingeKind::Screw { pitch, .. }) = first.map(|s| s.subhinge.kind) {
            assert!((pitch - 1e-3 / (2.0 * std::f64::consts::PI)).abs() < 1e-18);
        }
    }
}

#[test]
fn starts() {
    let q = |body: &str| {
        let spec = mechanism(&format!("\"b\": (parent: \"world\", {body})"));
        (spec.q, spec.v)
    };
    let slider = q("hinge: Slider([1, 0, 0]), initial: (position: \"3 cm\", rate: \"-1 m/s\")");
    assert_eq!(slider, (vec![0.03], vec![-1.0]));
    let chain =
        q("hinge: Planar, initial: (coordinates: [1, \"2 m\", \"180 deg\"], rates: [0, 0, 5])");
    assert_eq!(chain, (vec![1.0, 2.0, std::f64::consts::PI], vec![0.0, 0.0, 5.0]));
    let s = std::f64::consts::FRAC_1_SQRT_2;
    let (ball, w) = q(
        "hinge: Ball, initial: (rotation: (axis: [0, 0, 2], angle: \"90 deg\"), angular: [1, 2, 3])",
    );
    assert!((ball[2] - s).abs() < 1e-15 && (ball[3] - s).abs() < 1e-15, "{ball:?}");
    assert_eq!(w, [1.0, 2.0, 3.0]);
    let (free, v) = q(
        "hinge: Free, initial: (rotation: (quat: [0, 1, 0, 0]), angular: [1, 2, 3], velocity: [4, 5, 6])",
    );
    assert_eq!(free, [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    // The body is rotated by half a turn about y, so x and z change sign.
    assert_eq!(v, [1.0, 2.0, 3.0, -4.0, 5.0, -6.0]);
    // Roll, pitch and yaw rotate about the fixed axes x, then y, then z, so the yaw rotates x to y.
    let spec =
        mechanism("\"b\": (parent: \"world\", at: (rotation: (rpy: [\"30 deg\", 0, \"90 deg\"])))");
    let x = spec.multibody.bodies()[0].hinge_in_parent().rotation * linkwork_spatial::Vec3::x();
    assert!((x - linkwork_spatial::Vec3::y()).norm() < 1e-15, "{x}");
}

#[test]
fn fan_out_and_coordinates_of_a_hinge_survive_the_resolved_text() {
    let text = r#"Simulation(parts: { "R": (
        bodies: { "arm": (parent: "world", hinge: Universal([1, 0, 0], [0, 1, 0])) },
        parts: {
            "D": (model: "test.drive"),
            "M": (model: "test.motor", params: { "resistance": 1 }, array: [
                (name: "A", bind: { "shaft": "hinge:arm" }), (name: "B", bind: { "shaft": "hinge:arm[1]" })]),
        },
        wires: ["D.volts[1] -> M[*].volts"],
    ) })"#;
    let first = good(text);
    let again = good(&first.resolved);
    assert_eq!(digest(&first.spec), digest(&again.spec));
    let wires: Vec<String> =
        first.spec.wires.iter().map(|w| format!("{} -> {}", w.from, w.to)).collect();
    assert_eq!(wires, ["R.D.volts[1] -> R.A.volts", "R.D.volts[1] -> R.B.volts"]);
    let arm = "R/arm".to_string();
    assert_eq!(again.spec.binds[1].target, BindTarget::Hinge { body: arm, index: 1 });
}

#[test]
fn parameters_reach_texts_lists_and_nested_assemblies_in_place() {
    let text = r#"Simulation(
        params: { "world": (default: { "level": "5 V" }), "side": (default: "left"), "k": (unit: "V", default: "2 kV"), "kind": (default: "drive") },
        bodies: { "left_leg": (parent: "world", nodes: { "hub": () }) },
        parts: { "In": (parts: {
            "P": (model: "test.pad", bind: { "hub": "node:${side}_leg/hub" }),
            "E": (model: "test.drive", params: "$world"),
            "F": (model: "test.drive", params: "$world", array: [(), (params: { "level": 6 })]),
            "D": (model: "test.${kind}", params: { "level": "$k / 4 + 1" }),
        }) },
    )"#;
    let loaded = good(text);
    assert_eq!(loaded.spec.parts[0].model, "test.drive");
    let level = loaded.spec.parts[0].params.get("level").unwrap();
    assert_eq!(level.value.to_string(), "\"501.0 kg m^2 s^-3 A^-1\"");
    let levels =
        loaded.spec.parts[1..4].iter().map(|p| p.params.get("level").unwrap().value.to_string());
    assert_eq!(levels.collect::<Vec<_>>(), ["\"5 V\"", "\"5 V\"", "6.0"]);
    assert_eq!(loaded.spec.binds[0].target, BindTarget::Node("left_leg/hub".into()));
    assert_eq!(digest(&good(&loaded.resolved).spec), digest(&loaded.spec));
}

//! Loading of valid files: expansion, numbers, references, canonical order, the resolved text.
use crate::common::*;
use linkwork_assembly::form::Take;
use linkwork_assembly::*;
use linkwork_plant::SpecExt;
use linkwork_runtime::{BindTarget, Integrator, Seconds};

#[test]
fn a_simulation_expands_to_parts_wires_bindings_and_a_mechanism() {
    let loaded = good(SIM);
    let spec = &loaded.spec;
    let paths: Vec<&str> = spec.parts.iter().map(|p| p.path.as_str()).collect();
    assert_eq!(
        paths,
        [
            "Rover.Drive",
            "Rover.Hardware.Battery",
            "Rover.Hardware.Wheel1.Contact",
            "Rover.Hardware.Wheel1.Motor",
            "Rover.Hardware.Wheel2.Contact",
            "Rover.Hardware.Wheel2.Motor",
        ]
    );
    let wires: Vec<String> = spec.wires.iter().map(|w| format!("{} -> {}", w.from, w.to)).collect();
    assert_eq!(
        wires,
        [
            "Rover.Hardware.Wheel1.Motor.current -> Rover.Hardware.Battery.load",
            "Rover.Hardware.Wheel2.Motor.current -> Rover.Hardware.Battery.load",
            "Rover.Drive.volts[0] -> Rover.Hardware.Wheel1.Motor.volts",
            "Rover.Drive.volts[1] -> Rover.Hardware.Wheel2.Motor.volts",
        ]
    );
    let bind = |part: &str| &spec.binds.iter().find(|b| b.part == part).unwrap().target;
    let wheel = "Rover.Hardware.Wheel1/wheel".to_string();
    assert_eq!(
        *bind("Rover.Hardware.Wheel1.Motor"),
        BindTarget::Hinge { body: wheel.clone(), index: 0 }
    );
    assert_eq!(*bind("Rover.Hardware.Wheel1.Contact"), BindTarget::Node(format!("{wheel}/hub")));
    assert_eq!(spec.parts[0].rate, Some(Seconds { num: 1, den: 50 }));
    assert_eq!(spec.parts[0].offset, Seconds { num: 1, den: 200 });
    assert_eq!(spec.parts[3].params.get("gear"), None);
    assert_eq!(spec.parts[5].params.get("gear").unwrap().value.to_string(), "20.0");
    assert_eq!((spec.integrator, spec.seed), (Integrator::SemiImplicitEuler, 7));
    assert_eq!(loaded.simulation.until, Some(Seconds { num: 120, den: 1 }));
    assert_eq!(loaded.simulation.log[0].channels[0].text, "Rover.**");
    assert_eq!(loaded.simulation.metrics[0].take, Take::Max);
    assert_eq!(loaded.tree.children[0].children[1].name, "Hardware");
}

#[test]
fn the_mechanism_has_the_numbers_of_the_files() {
    let loaded = good(SIM);
    let m = loaded.spec.mechanism().cloned().unwrap();
    let mb = &m.multibody;
    let wheel = mb.get(mb.body("Rover.Hardware.Wheel1/wheel").unwrap());
    assert_eq!(mb.get(wheel.parent().unwrap()).name(), "Rover/chassis");
    // The wheel is mounted on a node: the pose of the node is applied first, and then the pose of
    // the axle.
    let p = wheel.hinge_in_parent().position;
    assert_eq!([p.x, p.y, p.z], [0.5, 0.5, -0.125]);
    assert_eq!(wheel.inertia().mass(), 10.0);
    let i = wheel.inertia().inertia_com();
    assert!((i[(1, 1)] - 0.5 * 10.0 * 0.25 * 0.25).abs() < 1e-12, "{i}");
    assert!((i[(0, 0)] - 10.0 * (3.0 * 0.0625 + 0.01) / 12.0).abs() < 1e-12, "{i}");
    assert_eq!(wheel.subhinges()[0].subhinge.armature, 0.01);
    assert_eq!(m.q[wheel.q()], [5f64.to_radians()]);
    assert!((m.v[wheel.v().start] - 2.0 * std::f64::consts::PI / 60.0).abs() < 1e-15);
    // The velocity is given in world axes, but β contains it in body axes, which are rotated by
    // −90° about z.
    let chassis = mb.get(mb.body("Rover/chassis").unwrap());
    let v = &m.v[chassis.v()];
    assert!((v[3]).abs() < 1e-15 && (v[4] + 1.0).abs() < 1e-15, "{v:?}");
    let shapes: Vec<(&str, &str)> =
        loaded.shapes.iter().map(|s| (s.body.as_str(), s.name.as_str())).collect();
    assert_eq!(shapes[0], ("Rover.Hardware.Wheel1/wheel", "tyre"));
    assert_eq!(shapes.len(), 4);
}

#[test]
fn the_resolved_text_loads_to_the_same_spec_alone() {
    let first = good(SIM);
    let catalogue = catalogue();
    let again = load_text("resolved.ron", &first.resolved, &Options::new(&catalogue))
        .unwrap_or_else(|f| panic!("{}\n{}", f.show(Look::Plain), first.resolved));
    assert_eq!(digest(&again.spec), digest(&first.spec), "{}", first.resolved);
    assert_eq!(again.resolved, first.resolved);
    assert_eq!(again.shapes, first.shapes);
    assert_eq!(again.simulation.metrics.len(), 1);
}

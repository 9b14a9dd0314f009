//! Connections with a delay and solved algebraic loops, written in a file; also in the resolved text and in phases, and their errors.
use linkwork_assembly::{Options, load_text};
use linkwork_runtime::{Files, Seconds, Simulation};
use std::sync::Arc;

use crate::common;

const FILE: &str = r#"Simulation(
    parts: {
        "One": (model: "basics.ramp", params: { "slope": 1 }),
        "Sum": (model: "basics.sum"),
        "Half": (model: "basics.gain", params: { "k": 0.5 }),
        "Late": (model: "basics.gain", params: { "k": 1 }),
    },
    wires: ["One.y -> Sum.u", "Sum.y -> Half.u", WIRE, (wire: "One.y -> Late.u", delay: 30, initial: [-1])],
    step: "10 ms", until: "2 s",
    start: "a", phases: { "a": (to: { "b": "time > 1 s" }), "b": () },
)"#;

fn run(text: &str) -> Result<(Simulation, String), String> {
    let catalogue = common::catalogue();
    let loaded =
        load_text("sim.ron", text, &Options::new(&catalogue)).map_err(|f| f.render(false))?;
    let program = loaded.compile(&catalogue, &Files::default());
    let program = program.map_err(|faults| {
        let told = faults.0.iter().map(|f| format!("{}\n  help: {:?}", f.message, f.help));
        told.collect::<Vec<_>>().join("\n")
    })?;
    let mut sim = Simulation::of(Arc::new(program));
    sim.run_until(Seconds::from_decimal(2.0).unwrap()).map_err(|e| e.to_string())?;
    Ok((sim, loaded.resolved.to_string()))
}

#[test]
fn a_file_delays_and_solves_wires_and_its_resolved_text_too() {
    for (wire, want) in [
        // The loop is y = t + y/2.
        (r#"(wire: "Half.y -> Sum.u", solve: 1e-12)"#, 4.0),
        // The loop is y_k = t_k + y_(k−1)/2, which becomes 2 t − 2 h after a long time.
        (r#"(wire: "Half.y -> Sum.u", delay: 1)"#, 3.98),
    ] {
        let text = FILE.replace("WIRE", wire);
        let (sim, resolved) = run(&text).unwrap();
        let y = sim.get("Sum.y").unwrap();
        assert!((y - want).abs() < 1e-10, "{wire}: {y}");
        assert!((sim.get("Late.y").unwrap() - 1.7).abs() < 1e-12);
        let (again, same) = run(&resolved).unwrap_or_else(|e| panic!("{e}\n{resolved}"));
        assert_eq!((again.hash(), same), (sim.hash(), resolved));
    }
}

#[test]
fn mistakes_in_such_wires_are_told() {
    for (wire, parts) in [
        (r#""Half.y -> Sum.u""#, &["algebraic loop", "`delay: 1`", "`solve: 1e-10`"][..]),
        (r#"(wire: "Half.y -> Sum.u", delay: 0)"#, &["`delay`", "from 1 to 100000"]),
        (r#"(wire: "Half.y -> Sum.u", delay: 1.5)"#, &["`delay`", "integer"]),
        (r#"(wire: "Half.y -> Sum.u", delay: "1 s")"#, &["`delay`"]),
        (r#"(wire: "Half.y -> Sum.u", solve: 2)"#, &["`solve`"]),
        (r#"(wire: "Half.y -> Sum.u", solve: 1e-9, delay: 1)"#, &["has both `delay` and `solve`"]),
        (r#"(wire: "Half.y -> Sum.u", initial: [1])"#, &["`initial` but lacks `delay`"]),
        (r#"(delay: 1)"#, &["wire", "write (wire:"]),
        (r#"(wire: "Half.y -> Sum.u", dealy: 1)"#, &["dealy", "delay"]),
        (r#"(wire: "Half.y -> Sum.u", delay: 1, initial: [1, 2])"#, &["it carries 1 numbers"]),
        (r#"(wire: "Half.y -> Sum.v", delay: 1)"#, &["has no input `v`"]),
    ] {
        let told = run(&FILE.replace("WIRE", wire)).map(|_| ()).unwrap_err();
        for part in parts {
            assert!(told.contains(part), "{wire}: `{part}` is missing in\n{told}");
        }
        assert!(told.contains("elp: "), "{told}");
    }
}

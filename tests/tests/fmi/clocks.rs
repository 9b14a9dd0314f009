//! Clocks of FMI 3.0: periodic and countdown input clocks tick at their times, and triggered output clocks are counted.
use crate::fmi::support::{Bench, TOKEN, binary, compiler, pack, run};
use std::path::PathBuf;
use std::process::Command;

/// Clock 1 ticks every 0.25 s from the start, clock 2 every 3/10 s from 1/10 s on.
const CLOCKS: &str = r#"<Clock name="first" valueReference="1" causality="input" variability="discrete" intervalVariability="constant" intervalDecimal="0.25"/>
<Clock name="second" valueReference="2" causality="input" variability="discrete" intervalVariability="fixed" supportsFraction="true" resolution="10" intervalCounter="3" shiftCounter="1"/>
<Clock name="third" valueReference="3" causality="input" variability="discrete" intervalVariability="countdown"/>
<Clock name="fourth" valueReference="4" causality="output" variability="discrete" intervalVariability="triggered"/>"#;

/// A unit with the description of its clocks, and with or without event mode of co-simulation.
fn unit(bench: &Bench, clocks: &str, events: bool) {
    let source = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/fmi/c/clocks.c");
    let library = bench.path("clocks.so");
    let status = Command::new("cc")
        .args(["-shared", "-fPIC", "-O1", "-o"])
        .arg(&library)
        .arg(format!("-DGUID=\"{TOKEN}\""))
        .arg(source)
        .arg("-lm")
        .status();
    assert!(status.unwrap().success(), "cc failed");
    let description = format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="3.0" modelName="clocks" instantiationToken="{TOKEN}">
<ModelExchange modelIdentifier="unit"/>
<CoSimulation modelIdentifier="unit" canHandleVariableCommunicationStepSize="true" hasEventMode="{events}"/>
<ModelVariables>{clocks}
<Float64 name="input" valueReference="10" causality="input" variability="discrete" clocks="2" start="0"/>
<Float64 name="x" valueReference="11" causality="output" variability="continuous" initial="exact" start="0"/>
<Float64 name="sum" valueReference="12" causality="output" variability="discrete" clocks="2"/>
<Float64 name="der(x)" valueReference="13" derivative="11"/>
<Int32 name="n1" valueReference="21" causality="output" clocks="1"/>
<Int32 name="n2" valueReference="22" causality="output" clocks="2"/>
<Int32 name="n3" valueReference="23" causality="output" clocks="3"/></ModelVariables>
<ModelStructure><Output valueReference="11"/><Output valueReference="12"/><Output valueReference="21"/><Output valueReference="22"/>
<Output valueReference="23"/><ContinuousStateDerivative valueReference="13"/></ModelStructure></fmiModelDescription>"#
    );
    let code = std::fs::read(&library).unwrap();
    let entries: [(&str, &[u8]); 2] =
        [("modelDescription.xml", description.as_bytes()), (&binary(3), &code)];
    pack(&bench.path("clocks.fmu"), &entries);
}

const EXCHANGE: &str = r#"model: "fmi.model_exchange""#;

fn simulation(kind: &str) -> String {
    format!(
        r#"Simulation(parts: {{ "Unit": ({kind}, params: {{ "file": "clocks.fmu" }}), "Step": (model: "basics.step", params: {{ "time": "0.5 s", "after": 5.0 }}) }},
            wires: ["Step.y -> Unit.input"], step: "50 ms", integrator: "rk4", until: "2 s")"#
    )
}

/// Numbers of ticks at an instant, by counting: three periodic and countdown clocks, the output clock, the sum of the sampled inputs, and the integral of
/// the number of ticks of the first clock.
fn expected(t: f64) -> [f64; 6] {
    let until = |from: f64, every: f64, most: usize| -> Vec<f64> {
        (0..most).map(|k| from + k as f64 * every).filter(|tick| *tick <= t + 1e-6).collect()
    };
    let (first, second) = (until(0.0, 0.25, 1000), until(0.1, 0.3, 1000));
    let third = until(0.25 + 0.07, 1.0, 1);
    let sum = 5.0 * second.iter().filter(|tick| **tick > 0.5).count() as f64;
    let x: f64 = first.iter().map(|tick| t - tick).sum();
    let total = first.len() + second.len() + third.len();
    [first.len(), second.len(), third.len(), total / 3]
        .map(|n| n as f64)
        .into_iter()
        .chain([sum, x])
        .collect::<Vec<_>>()
        .try_into()
        .unwrap()
}

#[test]
fn clocks_tick_at_their_times() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    unit(&bench, CLOCKS, true);
    let steps =
        ["50 ms", "40 ms", "0.35 s"].map(|h| format!(r#"model: "fmi.co_simulation", rate: "{h}""#));
    for kind in steps.iter().map(String::as_str).chain([EXCHANGE]) {
        let text = simulation(kind).replace(
            "\"50 ms\", integrator",
            if kind.contains("0.35") {
                "\"0.35 s\", integrator"
            } else if kind.contains("40") {
                "\"40 ms\", integrator"
            } else {
                "\"50 ms\", integrator"
            },
        );
        let mut sim = bench.sim(&text).unwrap();
        for t in [0.0, 0.2, 0.6, 1.4] {
            // A communication step of 0.35 s ends at 0 s and 1.4 s of these.
            if kind.contains("0.35") && (0.1..1.0).contains(&t) {
                continue;
            }
            run(&mut sim, t);
            let found = ["n1", "n2", "n3", "fourth", "sum", "x"]
                .map(|v| sim.get(&format!("Unit.{v}")).unwrap());
            let mut want = expected(t);
            if kind.contains("0.35") && t > 0.7 {
                // The input is held from the beginning of a step: the tick at 0.7 s belongs to the step from 0.35 s.
                want[4] -= 5.0;
            }
            for (a, b) in found.iter().zip(want) {
                assert!((a - b).abs() < 1e-9, "{kind} at {t}: {found:?}, expected {want:?}");
            }
        }
    }
}

/// Two ticks of one instant are one event, and adaptive steps end at ticks.
#[test]
fn ticks_end_the_steps_of_every_integrator() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    unit(&bench, CLOCKS, true);
    for integrator in ["rk4", "dormand_prince_54", "bogacki_shampine_32"] {
        let text = simulation(EXCHANGE)
            .replace("\"rk4\"", &format!("\"{integrator}\""))
            .replace("step: \"50 ms\"", "step: \"0.4 s\"");
        let mut sim = bench.sim(&text).unwrap();
        run(&mut sim, 2.0);
        let found = ["n1", "n2", "n3", "x"].map(|v| sim.get(&format!("Unit.{v}")).unwrap());
        let [n1, n2, n3, .., x] = expected(2.0);
        for (a, b) in found.iter().zip([n1, n2, n3, x]) {
            assert!((a - b).abs() < 1e-9, "{integrator}: {found:?} {n1} {n2} {n3} {x}");
        }
    }
}

/// Clocks that cannot tick are named; wrong clocks are rejected.
#[test]
fn clocks_that_never_tick_are_a_warning() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    let warnings = |text: &str| -> String {
        let program = bench.program(text).unwrap();
        let all = program.phases.iter().flat_map(|p| &p.plan.warnings);
        all.map(|f| format!("{} / {}\n", f.message, f.help.as_deref().unwrap_or_default()))
            .collect()
    };
    let co = simulation(r#"model: "fmi.co_simulation", rate: "50 ms""#);
    unit(&bench, CLOCKS, true);
    for text in [&co, &simulation(EXCHANGE)] {
        assert!(!warnings(text).contains("clock"), "{}", warnings(text));
    }
    let changing = CLOCKS.replace("\"countdown\"", "\"changing\"");
    unit(&bench, &changing, true);
    let told = warnings(&co);
    assert!(told.contains("input clock `third`, which never ticks / "), "{told}");
    assert!(!told.contains("`first`") && told.contains("countdown clocks"), "{told}");
    for (from, to, fact) in [
        ("intervalDecimal=\"0.25\"", "intervalDecimal=\"0\"", "a positive interval"),
        ("\"countdown\"", "\"sometimes\"", "sometimes"),
        (" intervalVariability=\"countdown\"", "", "intervalVariability"),
    ] {
        unit(&bench, &CLOCKS.replace(from, to), true);
        let told = bench.sim(&co).err().unwrap();
        assert!(told.contains(fact), "{told}");
    }
}

//! Invalid FMUs: rejected at load with location, fact and remedy, or an orderly end of the run.
use super::support::{
    Bench, Model, TOKEN, binary, compiler, description, library, pack, platform, seconds,
};

const PART: &str = r#"Simulation(
    parts: { "Spring": (model: "fmi.co_simulation", rate: "10 ms", params: { "file": "unit.fmu" }) },
    step: "10 ms", until: "1 s",
)"#;

/// Checks that the report of a load names the line of the part, the fact and a remedy.
fn refused(bench: &Bench, text: &str, phrases: &[&str]) {
    match bench.sim(text) {
        Ok(_) => panic!("taken, but should say {phrases:?}"),
        Err(told) => {
            for phrase in phrases.iter().chain(&["sim.ron:", "Help"]) {
                let there = told.to_lowercase().contains(&phrase.to_lowercase());
                assert!(there, "{phrase:?} is not in\n{told}");
            }
        }
    }
}

#[test]
fn archives_that_are_none() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    refused(&bench, PART, &["there is no file `unit.fmu`"]);
    let file = bench.path("unit.fmu");
    std::fs::write(&file, b"no archive at all").unwrap();
    refused(&bench, PART, &["`unit.fmu` is not a readable unit archive"]);
    bench.unit("unit.fmu", 2, Model::Spring, |t| t);
    let good = std::fs::read(&file).unwrap();
    assert!(bench.sim(PART).is_ok());
    std::fs::write(&file, &good[..good.len() / 2]).unwrap();
    refused(&bench, PART, &["`unit.fmu` is not a readable unit archive"]);
    // One byte of the library's compressed content is flipped.
    let mut flipped = good.clone();
    let at = good.len() / 2;
    flipped[at] ^= 0x55;
    std::fs::write(&file, &flipped).unwrap();
    refused(&bench, PART, &["`unit.fmu` is not a readable unit archive"]);
    pack(&file, &[("readme.txt", b"hello")]);
    refused(&bench, PART, &["lacks modelDescription.xml"]);
    pack(&file, &[("modelDescription.xml", b"<fmiModelDescription")]);
    refused(&bench, PART, &["unit.fmu/modelDescription.xml:1:", "well-formed"]);
}

#[test]
fn units_for_another_platform_or_kind() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    let text = description(2, Model::Spring);
    let (file, code) = (bench.path("unit.fmu"), library(bench.dir.path(), 2, Model::Spring));
    pack(&file, &[("modelDescription.xml", text.as_bytes()), ("binaries/plan9/unit.so", b"x")]);
    refused(&bench, PART, &["another platform", "plan9", &platform(2)]);
    pack(&file, &[("modelDescription.xml", text.as_bytes()), (&binary(2), b"no library")]);
    refused(&bench, PART, &["cannot be loaded"]);
    // The library is for the other version, whose functions have other names.
    let other = library(bench.dir.path(), 3, Model::Spring);
    pack(&file, &[("modelDescription.xml", text.as_bytes()), (&binary(2), &other)]);
    refused(&bench, PART, &["lacks the function `fmi2Instantiate`"]);
    // The description contains only model exchange.
    let equations: String = text.lines().filter(|l| !l.contains("<CoSim")).collect();
    pack(&file, &[("modelDescription.xml", equations.as_bytes()), (&binary(2), &code)]);
    refused(&bench, PART, &["not a unit for co-simulation", "fmi.model_exchange"]);
    let scheduled = text
        .replace("<CoSimulation", "<ScheduledExecution")
        .replace("</CoSim", "</ScheduledExecution");
    let scheduled: String = scheduled.lines().filter(|l| !l.contains("<ModelExchange")).collect();
    pack(&file, &[("modelDescription.xml", scheduled.as_bytes()), (&binary(2), &code)]);
    refused(&bench, PART, &["scheduled execution only", "export the unit for co-simulation"]);
    // The description was changed after the library was built.
    let changed = text.replace(TOKEN, "{another}");
    pack(&file, &[("modelDescription.xml", changed.as_bytes()), (&binary(2), &code)]);
    refused(&bench, PART, &["cannot be instantiated", "the guid is of another model"]);
}

#[test]
fn start_values_that_cannot_be() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    for version in [2, 3] {
        bench.unit("unit.fmu", version, Model::Spring, |t| t);
        let start = |values: &str| {
            PART.replace(
                "\"file\": \"unit.fmu\"",
                &format!("\"file\": \"unit.fmu\",\n \"start\": {{ {values} }}"),
            )
        };
        for (values, phrases) in [
            ("\"mas\": 2", vec!["not have a variable `mas`", "did you mean `mass`", "sim.ron:3"]),
            ("\"mass\": \"2 s\"", vec!["`mass` is in kg"]),
            ("\"mass\": true", vec!["`mass` must be a number"]),
            ("\"mass\": [1, 2]", vec!["requires 1 values, but there are 2"]),
            ("\"spring.a\": 2", vec!["cannot be set", "computes it"]),
            ("\"fault\": 1.5", vec!["a whole number", "1.5"]),
            ("\"stiffness\": \"3 N/m\"", vec!["does not define the unit"]),
            ("\"mass\": 2, \"mass\": 3", vec!["mass"]),
            ("\"fault\": 1", vec!["EnterInitializationMode", "returned error"]),
        ] {
            refused(&bench, &start(values), &phrases);
        }
    }
    let rateless = PART.replace("rate: \"10 ms\", ", "");
    refused(&bench, &rateless, &["rate"]);
    let unknown = PART.replace("step:", "wires: [\"Spring.y -> Spring.force\"], step:");
    refused(&bench, &unknown, &["Spring.y", "spring_a"]);
    let typo = PART.replace("\"file\"", "\"fil\"");
    refused(&bench, &typo, &["no parameter `fil`"]);
}

/// An error during the run ends it with time, path, the FMU's message, and a remedy.
#[test]
fn units_that_fail_on_the_way() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    for version in [2, 3] {
        bench.unit("unit.fmu", version, Model::Spring, |t| t);
        let sim = |kind: &str, fault: u8| {
            let text = PART.replace(
                "\"file\": \"unit.fmu\"",
                &format!("\"file\": \"unit.fmu\", \"start\": {{ \"fault\": {fault} }}"),
            );
            let text = match kind {
                "me" => {
                    text.replace("fmi.co_simulation\", rate: \"10 ms\"", "fmi.model_exchange\"")
                }
                _ => text,
            };
            bench.sim(&text).unwrap()
        };
        let mut cases = vec![
            ("cs", 2, vec!["`Spring`", "DoStep", "error", "the step failed"]),
            ("cs", 3, vec!["`Spring.", "NaN"]),
            ("cs", 4, vec!["`Spring`", "discard", "shorter communication step"]),
            ("cs", 5, vec!["`Spring`", "fatal"]),
            ("me", 2, vec!["`Spring`", "Derivatives", "error"]),
            ("me", 3, vec!["Spring", "NaN"]),
            ("me", 5, vec!["`Spring`", "fatal"]),
        ];
        // The importer of FMI 2.0 queries a model-exchange FMU after each step; in 3.0, a co-simulation FMU returns it.
        cases.push((
            if version == 2 { "me" } else { "cs" },
            6,
            vec!["`Spring`", "requests the end of the simulation"],
        ));
        for (kind, fault, phrases) in cases {
            let mut run = sim(kind, fault);
            let error = run.run_until(seconds(1.0)).unwrap_err();
            let told = error.to_string();
            for phrase in phrases {
                assert!(told.contains(phrase), "FMI {version} {kind} {fault}: {phrase:?}\n{told}");
            }
            assert!((0.04..0.09).contains(&error.time), "FMI {version} {kind} {fault}: {told}");
            // The failed FMU is not called again.
            let again = run.run_until(seconds(1.0)).unwrap_err().to_string();
            assert!(again.contains("Spring"), "{again}");
        }
    }
}

/// A communication step that the FMU does not support.
#[test]
fn a_rate_that_the_unit_cannot_take() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    bench.unit("unit.fmu", 3, Model::Spring, |t| {
        t.replace(
            "canHandleVariableCommunicationStepSize=\"true\"",
            "fixedInternalStepSize=\"0.004\"",
        )
    });
    let told = bench.sim(PART).err().unwrap();
    assert!(told.contains("not a multiple of the unit's own step 0.004 s"), "{told}");
    assert!(bench.sim(&PART.replace("rate: \"10 ms\"", "rate: \"20 ms\"")).is_ok());
}

/// Texts, binaries and clocks have no port: a warning names those that the file does not set.
#[test]
fn variables_without_a_port_are_a_warning() {
    if !compiler() {
        return;
    }
    let bench = Bench::new();
    let warnings = |text: &str| -> Vec<String> {
        let program = bench.program(text).unwrap();
        let line = |f: &linkwork_runtime::Fault| {
            format!("{} / {}", f.message, f.help.as_deref().unwrap_or_default())
        };
        let all = program.phases.iter().flat_map(|p| &p.plan.warnings).map(line);
        all.filter(|w| w.contains("have no port")).collect()
    };
    bench.unit("unit.fmu", 3, Model::Spring, |t| t);
    assert!(warnings(PART).is_empty());
    let more = r#"<String name="note" valueReference="40" causality="input"><Start value="a"/></String>
<Binary name="frame" valueReference="41" causality="output"/><Clock name="tick" valueReference="42" causality="input" intervalVariability="triggered"/>
<String name="title" valueReference="43" causality="parameter"><Start value="b"/></String></ModelVariables>"#;
    bench.unit("unit.fmu", 3, Model::Spring, |t| t.replace("</ModelVariables>", more));
    let told = warnings(PART);
    assert_eq!(told.len(), 1, "{told:#?}");
    assert!(told[0].starts_with("`Spring`: ports transfer numbers and booleans only, so these variables of `unit.fmu` have no port: input `note` (String), output `frame` (Binary) / "), "{told:#?}");
    let all = bench.program(PART).unwrap();
    let mut clocks = all.phases.iter().flat_map(|p| &p.plan.warnings);
    let clock = clocks.find(|w| w.message.contains("clocks of")).unwrap();
    assert!(clock.message.contains("input clock `tick`, which never ticks"), "{clock:?}");
    assert!(clock.help.as_deref().is_some_and(|h| h.contains("time events")), "{clock:?}");
    // In FMI 2.0, a text that the file sets is not named.
    let more = r#"<ScalarVariable name="note" valueReference="40" causality="input" variability="discrete"><String start="a"/></ScalarVariable></ModelVariables>"#;
    bench.unit("unit.fmu", 2, Model::Spring, |t| t.replace("</ModelVariables>", more));
    let told = warnings(PART);
    assert!(told.len() == 1 && told[0].contains("input `note` (String)"), "{told:#?}");
    let set = PART.replace("\"unit.fmu\"", "\"unit.fmu\", \"start\": { \"note\": \"b\" }");
    assert!(warnings(&set).is_empty());
}

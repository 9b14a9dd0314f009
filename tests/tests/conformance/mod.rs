//! Every model of every library keeps the rules of a model: one generated suite.
mod checks;
mod rig;
mod sample;
mod toys;
mod world;

use linkwork_assemblies::libraries;
use linkwork_runtime::Entry;

#[test]
fn every_model_conforms() {
    let services = world::services();
    let all = libraries().concat();
    let (models, providers): (Vec<_>, Vec<_>) =
        all.iter().partition(|e| e.service_kind().is_none());
    assert!(models.len() > 15 && providers.len() > 4, "{} and {}", models.len(), providers.len());
    let found: Vec<String> = all.iter().flat_map(|e| checks::all(e, &services)).collect();
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn names_are_unique_and_say_their_library() {
    let catalogue = linkwork_runtime::Catalogue::new(libraries());
    for entry in catalogue.iter() {
        let (library, model) = entry.description.name.split_once('.').unwrap();
        assert!(!library.is_empty() && !model.is_empty());
    }
}

#[test]
fn each_check_can_fail() {
    let services = world::services();
    let found = |entry: Entry| checks::all(&entry, &services).join("\n");
    assert_eq!(found(Entry::model::<toys::Good>()), "");
    for (entry, phrases) in [
        (Entry::model::<toys::Impure>(), vec!["it is not pure"]),
        (Entry::model::<toys::Forgetful>(), vec!["its store forgets"]),
        (Entry::model::<toys::Greedy>(), vec!["200 allocations"]),
        (
            Entry::model::<toys::Sloppy>(),
            vec![
                "the model has no documentation",
                "port `u` has no documentation",
                "port `u` has no unit",
                "furlong",
                "two variables are called `u`",
                "far = NaN from finite inputs",
            ],
        ),
        (
            Entry::model::<toys::Fussy>(),
            vec!["k = 4: in the range, and refused: `bench.part.k`: too far"],
        ),
    ] {
        let text = found(entry);
        for phrase in phrases {
            assert!(text.contains(phrase), "{phrase:?} is not in\n{text}");
        }
    }
}

/// What the message about a loop advises makes it compile.
#[test]
fn the_remedy_for_a_loop_exists() {
    use linkwork_runtime::{
        Catalogue, Files, Origin, PartSpec, PortRef, Spec, WireSpec, WireTiming,
    };
    let catalogue = Catalogue::new(libraries());
    let end =
        |part: &str, port: &str| PortRef { part: part.into(), port: port.into(), index: None };
    let gain = catalogue.find("basics.gain", Origin::NONE, "test").unwrap();
    let (d, params) = (&gain.description, sample::params(gain));
    let (u, y) = (&*d.feedthrough_inputs[0].name, &*d.feedthrough_outputs[0].name);
    let wire = |from, to| WireSpec {
        timing: Default::default(),
        from: end(from, y),
        to: end(to, u),
        text: String::new(),
        origin: Origin::NONE,
    };
    let spec = Spec {
        parts: ["a", "b"].map(|p| PartSpec::new(p, "basics.gain", params.clone())).into(),
        wires: vec![wire("a", "b"), wire("b", "a")],
        ..Spec::default()
    };
    let faults = compile_error(&spec, &catalogue, &Files::default());
    assert!(faults.contains("`delay: 1`") && faults.contains("`solve: 1e-10`"), "{faults}");
    let delay = WireTiming::Delayed { samples: 1, initial: Vec::new() };
    for timing in [delay, WireTiming::Solved { tolerance: 1e-10 }] {
        let mut spec = spec.clone();
        spec.wires[1].timing = timing;
        assert!(linkwork_runtime::compile(&spec, &catalogue, &Files::default()).is_ok());
    }
}

fn compile_error(
    spec: &linkwork_runtime::Spec,
    catalogue: &linkwork_runtime::Catalogue,
    files: &linkwork_runtime::Files,
) -> String {
    match linkwork_runtime::compile(spec, catalogue, files) {
        Ok(_) => panic!("compiled, but should not"),
        Err(faults) => faults.0.iter().filter_map(|f| f.help.clone()).collect(),
    }
}

//! Every example of FORMAT.md loads.
use crate::common::*;
use linkwork_assembly::form::Take;
use linkwork_assembly::*;
use linkwork_plant::SpecExt;
use linkwork_runtime::{Files, Seconds, Simulation};

#[test]
fn the_examples_of_the_page_load() {
    let page = include_str!("../FORMAT.md");
    let examples: Vec<&str> = page
        .split("```ron\n")
        .skip(1)
        .map(|piece| piece.split("```").next().unwrap_or_default())
        .collect();
    assert_eq!(examples.len(), 9);
    let catalogue = catalogue();
    let options = Options::new(&catalogue).embed("wheel.ron", examples[0]);
    // The rover to which the companion file belongs is a base with two arms.
    let rover = include_str!("../../../tests/fuzz/corpus/rover.urdf");
    let linkage = load_text("FORMAT.md", examples[1], &options).unwrap_or_else(|f| panic!("{f}"));
    let spec = linkage.spec.mechanism().cloned().unwrap();
    assert_eq!((spec.multibody.loops().len(), spec.multibody.couplings().len()), (2, 2));
    assert_eq!(spec.motions.len(), 1);
    run(&linkage.spec, 5.0);
    let ball = load_text("FORMAT.md", examples[2], &options).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(ball.colliders.clone().unwrap().len(), 4);
    run(&ball.spec, 0.01);
    let boom = load_text("FORMAT.md", examples[3], &options).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(boom.spec.mechanism().cloned().unwrap().multibody.nv(), 1 + 4 + 3);
    run(&boom.spec, 0.002);
    let examples = &examples[3..];
    let beside = options.clone().embed("rover.urdf", rover).embed("car.ron", examples[2]);
    let text = examples[1].replace("root: Free", "root: Free, companion: \"car.ron\"");
    let rover = load_text("FORMAT.md", &text, &beside).unwrap_or_else(|f| panic!("{f}"));
    let said = &rover.imports[0].description;
    assert_eq!((said.couplings.len(), said.loops.len(), said.wheels.len()), (1, 1, 1));
    assert_eq!(rover.spec.mechanism().cloned().unwrap().multibody.nv(), 8);
    let two = load_text("FORMAT.md", examples[3], &options).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(two.spec.wires.len(), 4);
    assert_eq!(two.spec.parts[3].params.get("gear").unwrap().value.to_string(), "20.0");
    let three = load_text("FORMAT.md", examples[4], &options).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(three.simulation.metrics[0].take, Take::MaxAbs);
    assert_eq!(three.spec.mechanism().cloned().unwrap().multibody.bodies().len(), 2);
    let apart = load_text("FORMAT.md", examples[5], &options);
    let apart = apart.unwrap_or_else(|f| panic!("{f}"));
    let names: Vec<&str> = apart.phases.iter().map(|p| p.name.as_str()).collect();
    assert_eq!(names, ["together", "apart", "spent"]);
    let program = apart.compile(&catalogue, &Files::default()).unwrap_or_else(|f| panic!("{f}"));
    let mut sim = Simulation::of(std::sync::Arc::new(program));
    sim.run_until(Seconds { num: 10, den: 1 }).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(sim.phase(), "spent");
}

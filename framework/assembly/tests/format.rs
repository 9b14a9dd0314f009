//! Every example of FORMAT.md loads.
mod common;
use common::*;
use linkwork_assembly::*;

#[test]
fn the_examples_of_the_page_load() {
    let page = include_str!("../FORMAT.md");
    let examples: Vec<&str> = page
        .split("```ron\n")
        .skip(1)
        .map(|piece| piece.split("```").next().unwrap_or_default())
        .collect();
    assert_eq!(examples.len(), 3);
    let catalogue = catalogue();
    let options = Options::new(&catalogue).embed("wheel.ron", examples[0]);
    let two = load_text("FORMAT.md", examples[1], &options).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(two.spec.wires.len(), 4);
    assert_eq!(two.spec.parts[3].params.get("gear").unwrap().value.to_string(), "20.0");
    let three = load_text("FORMAT.md", examples[2], &options).unwrap_or_else(|f| panic!("{f}"));
    assert_eq!(three.simulation.figures[0].take, Take::Max);
    assert_eq!(three.spec.mechanism.unwrap().multibody.bodies().len(), 2);
}

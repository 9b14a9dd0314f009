//! Damaged texts never cause a panic; every error has a message that can be displayed.
use crate::common::*;
use linkwork_assembly::*;

/// Loads a simulation with one of the three texts damaged.
fn survives(catalogue: &linkwork_runtime::Catalogue, which: &str, text: &str) {
    let (sim, options) = match which {
        "sim" => (text, options(catalogue)),
        file => (SIM, options(catalogue).embed(file, text)),
    };
    if let Err(failure) = load_text("sim.ron", sim, &options) {
        assert!(!failure.faults.is_empty());
        assert!(failure.render(false).contains("error"));
        assert!(failure.faults.iter().all(|f| !f.message.is_empty()));
    }
}

#[test]
fn cut_texts_and_texts_without_or_with_another_character() {
    let catalogue = catalogue();
    for (which, text) in [("sim", SIM), ("rover.ron", ROVER), ("parts/wheel.ron", WHEEL)] {
        let places: Vec<usize> = text.char_indices().map(|(k, _)| k).collect();
        for (n, &k) in places.iter().enumerate() {
            if n % 3 == 0 {
                survives(&catalogue, which, &text[..k]);
            }
            let other = ["", "$", "é", ")", "\"", "*", "[", "0", ".", "/", "-"][n % 11];
            survives(&catalogue, which, &format!("{}{other}{}", &text[..k], &text[k + 1..]));
        }
    }
}

#[test]
fn empty_pieces() {
    let catalogue = catalogue();
    for piece in [
        "parts: { \"\": () }",
        "parts: { \"A\": (parts: { \"B\": (model: \"test.pad\", bind: { \"hub\": \"\" }) }) }",
        "parts: { \"A\": (model: \"test.pad\", array: [1, (name: 3)]) }",
        "wires: [\"\", \"->\", \".->.\", \"a.->.b\", \"a[*] -> b[\", \"[*].x -> [0].y\", \"/.x -> y.z\"]",
        "overrides: { \"\": 1, \".\": 2, \"/\": 3, \"*\": 4, \"a./b.c\": 5, \"**.x\": 6 }",
        "bodies: { \"a\": (parent: \"/\"), \"b\": (parent: \"a/\"), \"c\": (parent: \"\"), \"d\": (parent: \"d\") }",
        "params: { \"a\": (default: \"$b\"), \"b\": (default: \"$a\"), \"c\": (default: \"$\"), \"d\": (default: \"${\"), \"e\": (default: [\"$e\"]) }",
        "params: { \"a\": (unit: \"x\", range: (1, \"y\"), default: {}) }",
        "bodies: { \"a\": (parent: \"world\", hinge: Universal([1, 0, 0]), inertia: Mesh(file: \"\"), shapes: [Box(1)], initial: 3) }",
        "bodies: { \"a\": (parent: \"world\", hinge: Chain, mass: -1, inertia: []) }",
        "log: 1, metrics: 2, plots: 3, view: 4, place: 5, seed: (), step: (), mechanism: 7",
        "assembly: \"\", name: \"\"",
    ] {
        survives(&catalogue, "sim", &format!("Simulation({piece})"));
    }
}

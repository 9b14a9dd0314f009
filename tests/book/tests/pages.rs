//! Every model has a page that says what it is, and the source that it comes from.
#![allow(clippy::unwrap_used)]
use linkwork_book::headers::headers;
use linkwork_book::models::{Behaviour, page};
use linkwork_book::summary::{MODELS, libraries, library_page, summary};
use linkwork_book::{SOURCES, catalogue, root};

#[test]
fn every_model_has_a_page_with_its_ports_parameters_and_source() {
    let (catalogue, headers) = (catalogue(), headers(&root(), &SOURCES).unwrap());
    let mut found = Vec::new();
    for entry in catalogue.iter() {
        let (d, header) = (&entry.description, headers.get(&*entry.description.name));
        match header {
            None => found.push(format!("{}: no file declares it", d.name)),
            Some(h) if h.text.len() < 20 => found.push(format!("{}: its header is empty", d.name)),
            Some(_) => {}
        }
        let text = page(entry, header, None);
        assert!(text.starts_with(&format!("# {}\n", d.name)), "{text}");
        let ports = d.all_inputs().chain(d.all_outputs()).map(|p| p.name.to_string());
        for name in d.params.iter().map(|p| p.name.to_string()).chain(ports) {
            if !text.contains(&format!("| `{name}` |")) {
                found.push(format!("{}: `{name}` is not on its page", d.name));
            }
        }
    }
    assert!(catalogue.iter().count() > 60);
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn the_page_of_a_motor_is_whole() {
    let (catalogue, headers) = (catalogue(), headers(&root(), &SOURCES).unwrap());
    let motor = catalogue.iter().find(|e| e.description.name == "actuators.dc_motor").unwrap();
    let behaviour = Behaviour { ron: "Simulation()\n".into(), plots: "x.svg".into() };
    let text = page(motor, headers.get("actuators.dc_motor"), Some(&behaviour));
    for wanted in [
        "## Parameters",
        "| `resistance` | ohm | required |",
        "## Outputs with feedthrough",
        "| `volts` | V | 1 | default 0 |",
        "| `shaft` |",
        "![Plots of the simulation below](x.svg)",
        "```ron\nSimulation()\n```",
        "Source: `components/actuators/src/dc_motor.rs`",
    ] {
        assert!(text.contains(wanted), "`{wanted}` is not in\n{text}");
    }
    // Rows of a table have as many cells as its head.
    let mut wide = None;
    for line in text.lines() {
        let cells = line.replace("\\|", "").matches('|').count();
        if line.starts_with('|') {
            assert_eq!(*wide.get_or_insert(cells), cells, "{line}");
        } else {
            wide = None;
        }
    }
}

#[test]
fn the_list_of_chapters_gets_a_line_for_each_model() {
    let catalogue = catalogue();
    let hand = std::fs::read_to_string(root().join("framework/book/src/SUMMARY.md")).unwrap();
    let whole = summary(&hand, &catalogue).unwrap();
    for entry in catalogue.iter() {
        let name = &entry.description.name;
        assert!(whole.contains(&format!("    - [{name}](models/{name}.md)")), "{name}");
    }
    assert!(summary("# Summary\n", &catalogue).unwrap_err().contains(MODELS));
    let all = libraries(&catalogue);
    let (library, names) = all.iter().next().unwrap();
    let text = library_page(library, names, &catalogue);
    assert_eq!(text.matches("\n| [`").count(), names.len(), "{text}");
}

/// A behaviour belongs to a model that there is.
#[test]
fn behaviours_are_of_models() {
    let catalogue = catalogue();
    for entry in std::fs::read_dir(root().join("assemblies/behaviours")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        assert!(
            catalogue.iter().any(|e| *e.description.name == name),
            "there is no model `{name}`"
        );
    }
}

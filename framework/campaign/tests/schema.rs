//! Compares the JSON Schema of campaign files with the files in the repository, and with the reader.
use crate::misfit::misfit;
use linkwork_assembly::read_value;
use linkwork_assembly::schema::plain;
use linkwork_campaign::{Form, schema};
use std::path::{Path, PathBuf};

fn why(text: &str) -> Option<String> {
    let (value, _) = read_value("c.ron", text).unwrap_or_else(|e| panic!("{text}: {e}"));
    let schema = schema();
    misfit(&plain(&value.value), &schema, &schema, "")
}

fn is_read(text: &str) -> bool {
    Form::text("c.ron", text, Path::new("")).is_ok()
}

fn campaigns(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        match path.is_dir() {
            true if !path.ends_with("runs") => campaigns(&path, out),
            _ if path.extension().is_some_and(|e| e == "ron") => out.push(path),
            _ => {}
        }
    }
}

#[test]
fn campaigns_that_ship_fit() {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut files = Vec::new();
    campaigns(&top.join("sims"), &mut files);
    campaigns(&top.join("tests/fuzz/corpus/campaign"), &mut files);
    let mut seen = 0;
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        // The corpus also contains invalid files.
        if text.starts_with("Campaign(") && (is_read(&text) || file.starts_with(top.join("sims"))) {
            assert!(is_read(&text), "{} is refused", file.display());
            assert_eq!(why(&text), None, "{}", file.display());
            seen += 1;
        }
    }
    assert!(seen >= 4, "{seen}");
}

/// Examples that the schema and the reader both reject, and examples that both accept.
#[test]
fn the_schema_refuses_what_the_reader_refuses() {
    let with = |more: &str| format!("Campaign(simulation: \"sim.ron\", runs: 3, {more})");
    for (more, wanted) in [
        ("run: 3", "/run is not in"),
        ("seed: -1", "out of range"),
        ("sampling: Sobel", "none of"),
        ("noise: \"own\"", "none of"),
        ("vary: { \"a\": Normal(mean: 1) }", "no `deviation`"),
        ("vary: { \"a\": Uniform(from: 1, to: 2, two: 3) }", "two is not in"),
        ("vary: { \"a\": [0, (b: Normal(mean: true, deviation: 1))] }", "is no"),
        ("vary: { \"a\": Choice(of: 3) }", "is no"),
        ("correlate: [(of: [\"a\"])]", "no `matrix`"),
        ("limits: (time: -1)", "out of range"),
        ("limits: (times: 1)", "times is not in"),
        ("scatter: [(\"a\", \"b\", \"c\")]", "3 items"),
        ("retain: (of: [\"a\"])", "no `every`"),
    ] {
        let text = with(more);
        assert!(!is_read(&text), "the reader takes {more}");
        let why = why(&text).unwrap_or_default();
        assert!(why.contains(wanted), "{more}: `{why}`");
    }
    for text in [
        "Campaign(runs: 3)",
        "Campaign(simulation: \"s\", runs: 1.5)",
        "Campaign(simulation: \"s\")",
        "Simulation()",
    ] {
        assert!(!is_read(text) && why(text).is_some(), "{text}");
    }
    for more in [
        "vary: { \"a\": Choice([\"x\", 2]), \"b\": (c: [1, LogNormal(median: \"1 kg\", sigma: 0.1)]) }",
        "vary: { \"a\": TruncatedNormal(mean: 0, deviation: 1, from: -1) }, limits: (wall: \"2 min\")",
        "sampling: Sobol, noise: Own, seed: 0, doc: \"x\", set: { \"a.b\": Pin([0, 1, 0]) }",
    ] {
        let text = with(more);
        assert!(is_read(&text), "the reader refuses {more}");
        assert_eq!(why(&text), None, "{more}");
    }
}

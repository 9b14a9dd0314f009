//! The file format as a JSON Schema.
use crate::expand::variant::VariantForm;
use crate::form::assembly::AssemblyFields;
use crate::form::settings;
use crate::machine::companion;
use crate::schema::describe::{Parameters, Schema, document};
use crate::schema::record::Record;

/// Returns the JSON Schema (draft 2020-12) of the files that this crate reads: `Simulation(..)`, `Assembly(..)`, `Companion(..)`, for JSON as serde
/// would write their RON: `(a: 1)` is an object, `Name` is `"Name"`, `Name(x)` is `{ "Name": x }`. Units of numbers are in the descriptions; the
/// catalogue describes the parameters of models.
#[must_use]
pub fn schema() -> serde_json::Value {
    let simulation = Schema::Record("simulation", settings::schema_fields);
    let files = vec![
        Schema::Variant("Simulation", Box::new(simulation)),
        Schema::Variant(
            "Assembly",
            Box::new(Schema::Any(vec![AssemblyFields::describe(), VariantForm::describe()])),
        ),
        companion::schema(),
    ];
    document(
        "Linkwork simulation, assembly or companion file",
        &Schema::Any(files),
        Parameters::Allowed,
    )
}

#[cfg(test)]
#[path = "../../../../tests/common/misfit.rs"]
mod misfit;

#[cfg(test)]
mod tests {
    use super::misfit::misfit;
    use super::*;
    use crate::schema::describe::plain;
    use crate::text::parse::parse;
    use crate::text::report::Cx;
    use serde_json::Value as Json;
    use std::collections::BTreeSet;
    use std::path::{Path, PathBuf};

    fn read(text: &str) -> Json {
        let mut cx = Cx::default();
        let file = cx.sources.add("t", text);
        plain(&parse(&mut cx, file).expect("RON").value)
    }

    fn found(folder: &Path, out: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            match path.is_dir() {
                true if !path.ends_with("runs") => found(&path, out),
                _ if path.extension().is_some_and(|e| e == "ron") => out.push(path),
                _ => {}
            }
        }
    }

    fn page() -> &'static str {
        include_str!("../../FORMAT.md")
    }

    #[test]
    fn all_files_of_the_repository_and_of_the_page_fit() {
        let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let mut files = Vec::new();
        ["sims", "assemblies"].iter().for_each(|f| found(&top.join(f), &mut files));
        assert!(files.len() > 20, "{files:?}");
        let mut texts: Vec<(String, String)> = Vec::new();
        for f in files {
            let text = std::fs::read_to_string(&f).expect("a text");
            // Campaigns and telemetry define their own forms in crates above this one.
            if !["Campaign(", "Telemetry("].iter().any(|own| text.starts_with(own)) {
                texts.push((f.display().to_string(), text));
            }
        }
        let examples = page().split("```ron\n").skip(1);
        texts.extend(examples.map(|e| {
            ("FORMAT.md".to_string(), e.split("```").next().unwrap_or_default().to_string())
        }));
        let schema = schema();
        let wrong: Vec<String> = (texts.iter())
            .filter_map(|(name, text)| {
                Some(format!("{name}: {}", misfit(&read(text), &schema, &schema, "")?))
            })
            .collect();
        assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    }

    #[test]
    fn what_the_reader_refuses_does_not_fit() {
        let schema = schema();
        for (text, why) in [
            ("Simulation(bodys: {})", "/bodys is not in"),
            ("Simulation(bodies: { \"b\": (parent: \"world\", mas: 1) })", "/mas is not in"),
            ("Simulation(bodies: { \"b\": (mass: 1) })", "no `parent`"),
            ("Simulation(view: (eye: [0, 1]))", "2 items"),
            ("Simulation(contact: (method: Newten))", "is none of"),
            ("Simulation(contact: (restitution: 2))", "out of range"),
            ("Simulation(parts: { \"P\": (model: 3) })", "is no [\"string\"]"),
        ] {
            let misfit = misfit(&read(text), &schema, &schema, "").unwrap_or_default();
            assert!(misfit.contains(why), "{text}: {misfit}");
        }
    }

    /// Returns all names of fields, variants and words.
    fn names(s: &Json, fields: &mut BTreeSet<String>, words: &mut BTreeSet<String>) {
        match s {
            Json::Object(map) => {
                let properties = map.get("properties").and_then(Json::as_object);
                fields.extend(properties.into_iter().flatten().map(|(k, _)| k.clone()));
                let all = map.get("enum").and_then(Json::as_array);
                words.extend(all.into_iter().flatten().filter_map(Json::as_str).map(String::from));
                map.values().for_each(|v| names(v, fields, words));
            }
            Json::Array(all) => all.iter().for_each(|v| names(v, fields, words)),
            _ => {}
        }
    }

    #[test]
    fn the_page_names_every_field_and_no_other() {
        let (mut fields, mut words) = (BTreeSet::new(), BTreeSet::new());
        names(&schema(), &mut fields, &mut words);
        assert!(fields.len() > 150, "{}", fields.len());
        let split = |text: &str| -> BTreeSet<String> {
            text.split(|c: char| !(c.is_alphanumeric() || c == '_')).map(String::from).collect()
        };
        // These fields occur only in resolved texts.
        let own = ["resolved", "whole", "folder"];
        let said = split(page());
        let lost: Vec<_> =
            fields.iter().filter(|f| !said.contains(*f) && !own.contains(&f.as_str())).collect();
        assert!(lost.is_empty(), "FORMAT.md does not say: {lost:?}");
        // Check the first column of the tables of fields.
        let mut odd = Vec::new();
        for row in page().lines().filter(|l| l.starts_with("| `")) {
            let cell = row.trim_start_matches("| ").split(" | ").next().unwrap_or_default();
            for name in cell.split('`').skip(1).step_by(2) {
                let plain = name.chars().all(|c| c.is_alphanumeric() || c == '_');
                if plain && !fields.contains(name) && !words.contains(name) {
                    odd.push(name);
                }
            }
        }
        assert!(odd.is_empty(), "FORMAT.md has fields that are not there: {odd:?}");
    }
}

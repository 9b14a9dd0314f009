//! The list of chapters: that of `framework/book/src/SUMMARY.md`, with the models.
use linkwork::runtime::Catalogue;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The line of SUMMARY.md behind which the models come.
pub const MODELS: &str = "- [The models](models.md)";

/// Names of the models by library.
#[must_use]
pub fn libraries(catalogue: &Catalogue) -> BTreeMap<String, Vec<String>> {
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for entry in catalogue.iter() {
        let name = entry.description.name.to_string();
        let library = name.split('.').next().unwrap_or_default().to_string();
        found.entry(library).or_default().push(name);
    }
    found.values_mut().for_each(|names| names.sort());
    found
}

/// SUMMARY.md with a page for each library and each model.
///
/// # Errors
/// A text without the line [`MODELS`].
pub fn summary(text: &str, catalogue: &Catalogue) -> Result<String, String> {
    let (head, tail) =
        text.split_once(MODELS).ok_or(format!("SUMMARY.md has no line `{MODELS}`"))?;
    let mut out = format!("{head}{MODELS}");
    for (library, names) in libraries(catalogue) {
        let _ = write!(out, "\n  - [{library}](models/{library}.md)");
        for name in names {
            let _ = write!(out, "\n    - [{name}](models/{name}.md)");
        }
    }
    Ok(out + tail)
}

/// The page of a library: its models, each with the first line of its documentation.
#[must_use]
pub fn library_page(library: &str, names: &[String], catalogue: &Catalogue) -> String {
    let mut out = format!("# {library}\n\n| model | what it is |\n|---|---|\n");
    for entry in catalogue.iter().filter(|e| names.contains(&e.description.name.to_string())) {
        let d = &entry.description;
        let first = linkwork::runtime::doc::first_sentence(&d.doc).replace('|', "\\|");
        let _ = writeln!(out, "| [`{0}`]({0}.md) | {first} |", d.name);
    }
    out
}

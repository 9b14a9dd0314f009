//! `linkwork new model`: a file in a library, and its line in the catalogue.
use super::{Refusal, failed, identifier, model_text, wrong};
use crate::program::program;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Adds a model to the library in a folder. Returns the new or changed files.
pub fn model(name: &str, folder: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let name = identifier(name, "model")?;
    let (manifest, root) = (folder.join("Cargo.toml"), folder.join("src/lib.rs"));
    let none = |what: String| {
        let help = format!(
            "change to the folder of a library, or give one with --library; `{} new library NAME` creates one",
            program().name
        );
        wrong(format!("`{}` is not a model library: {what}", folder.display()), help)
    };
    let read = |path: &Path| {
        std::fs::read_to_string(path).map_err(|e| none(format!("`{}`: {e}", path.display())))
    };
    let (manifest, text) = (read(&manifest)?, read(&root)?);
    let Some(package) = package(&manifest) else {
        return Err(none("its Cargo.toml does not define a package".into()));
    };
    let Some(prelude) = prelude(&manifest) else {
        return Err(none(
            "its Cargo.toml depends neither on `linkwork` nor on `linkwork-runtime`".into(),
        ));
    };
    let Some(changed) = with_model(&text, name) else {
        return Err(none("`src/lib.rs` lacks a function `catalogue` that contains `vec![`".into()));
    };
    let file = folder.join("src").join(format!("{name}.rs"));
    let module = text.lines().any(|l| has_module(l, name));
    if file.symlink_metadata().is_ok() || module {
        let fact = format!("the library already has `{name}`");
        return Err(wrong(fact, "choose another name"));
    }
    // Names of Linkwork's own libraries omit the prefix of the project.
    let library = package.strip_prefix("linkwork-").unwrap_or(package).replace('-', "_");
    let new = std::fs::File::create_new(&file);
    new.and_then(|mut f| f.write_all(model_text(&library, name, prelude).as_bytes()))
        .map_err(|e| failed(&file, "written", &e))?;
    if let Err(e) = std::fs::write(&root, changed) {
        let _ = std::fs::remove_file(&file);
        return Err(failed(&root, "written", &e));
    }
    Ok(vec![file, root])
}

/// Returns the name in the table `[package]`.
fn package(manifest: &str) -> Option<&str> {
    let table = manifest.split("[package]").nth(1)?;
    let mut lines = table.lines().take_while(|l| !l.trim_start().starts_with('['));
    let value =
        lines.find_map(|l| l.trim().strip_prefix("name")?.trim_start().strip_prefix('='))?;
    value.trim().strip_prefix('"')?.split('"').next()
}

/// Returns the imports of a model: from `linkwork` or from the runtime, depending on the library's dependencies.
fn prelude(manifest: &str) -> Option<&'static str> {
    let depends = |name: &str| {
        manifest.lines().any(|l| {
            let rest = l.trim().strip_prefix(name);
            rest.is_some_and(|r| r.starts_with([' ', '=', '.']))
        })
    };
    match (depends("linkwork"), depends("linkwork-runtime")) {
        (true, _) => Some("linkwork::model::prelude::*"),
        (_, true) => Some("linkwork_runtime::prelude::*"),
        _ => None,
    }
}

fn has_module(line: &str, name: &str) -> bool {
    let rest = line.trim().trim_start_matches("pub ").strip_prefix("mod ");
    rest.is_some_and(|r| r.trim_end_matches([';', '{', ' ']) == name)
}

/// Returns `src/lib.rs` with the module and its entry; `None` without a catalogue.
fn with_model(text: &str, name: &str) -> Option<String> {
    let function = text.find("fn catalogue()")?;
    let list = function + text[function..].find("vec![")? + "vec![".len();
    let entry = format!("Entry::model::<{name}::{}>()", super::camel(name));
    let lines = text[list..].starts_with('\n');
    let end = text[list..].trim_start().starts_with(']');
    let entry = match (lines, end) {
        (true, _) => format!("\n        {entry},"),
        (false, true) => entry,
        (false, false) => format!("{entry}, "),
    };
    // Insert after the last module declaration, or before the first import.
    let starts =
        |from: usize| [0].into_iter().chain(text[..from].match_indices('\n').map(|m| m.0 + 1));
    let written = || starts(function).map(|at| (at, text[at..].lines().next().unwrap_or_default()));
    let declares = |line: &str| line.starts_with("pub mod ") && line.ends_with(';');
    let after = written().filter(|(_, l)| declares(l)).map(|(at, l)| at + l.len() + 1).next_back();
    let imports = |line: &str| line.starts_with("use ") || line.starts_with("pub use ");
    let place = after.or_else(|| written().find(|(_, l)| imports(l)).map(|(at, _)| at))?;
    let gap = if after.is_some() { "" } else { "\n" };
    let (head, middle) = (&text[..place], &text[place..list]);
    Some(format!("{head}pub mod {name};\n{gap}{middle}{entry}{}", &text[list..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_catalogue_takes_a_model_in_lines_in_a_line_and_as_the_first() {
        let head = "//! Models.\n\npub mod a;\n\nuse x::Entry;\n\npub fn catalogue() -> Vec<Entry> {\n    vec![";
        let text = with_model(&format!("{head}Entry::model::<a::A>()]\n}}\n"), "pump").unwrap();
        assert!(text.contains("pub mod a;\npub mod pump;\n"), "{text}");
        assert!(text.contains("vec![Entry::model::<pump::Pump>(), Entry::model::<a::A>()]"));
        let text = with_model(&format!("{head}\n        Entry::model::<a::A>(),\n    ]"), "pump");
        assert!(
            text.unwrap().contains("vec![\n        Entry::model::<pump::Pump>(),\n        Entry")
        );
        let text = with_model("//! M.\n\nuse x::E;\n\nfn catalogue() -> Vec<E> { vec![] }", "pump");
        let text = text.unwrap();
        assert!(text.contains("pub mod pump;\n\nuse x::E;"), "{text}");
        assert!(text.contains("vec![Entry::model::<pump::Pump>()]"), "{text}");
        assert_eq!(with_model("use a;\nfn list() {}", "pump"), None);
        // Comments and the contents of other modules are not suitable positions.
        let text = "//! Parts for use in pumps.\n\npub mod util {\n    pub mod deep;\n}\n\nuse x::E;\n\nfn catalogue() -> Vec<E> { vec![] }";
        let text = with_model(text, "pump").unwrap();
        assert!(text.contains("}\n\npub mod pump;\n\nuse x::E;"), "{text}");
    }

    #[test]
    fn manifests_say_name_and_way_in() {
        let own = "[package]\nname = \"linkwork-power\"\n[dependencies]\nlinkwork-runtime.workspace = true";
        assert_eq!(package(own), Some("linkwork-power"));
        assert_eq!(prelude(own), Some("linkwork_runtime::prelude::*"));
        let theirs = "[workspace]\n[package]\nname=\"windmill\"\n[dependencies]\nlinkwork = \"1\"";
        assert_eq!(package(theirs), Some("windmill"));
        assert_eq!(prelude(theirs), Some("linkwork::model::prelude::*"));
        assert_eq!(
            (package("[workspace]"), prelude("[dependencies]\nserde = \"1\"")),
            (None, None)
        );
    }
}

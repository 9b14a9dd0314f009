//! `linkwork new library`: a workspace for your own models, with program, FMI unit and Python package.
use super::{Refusal, filled, folder_with, identifier, wrong};
use crate::load;
use crate::program::program;
use std::path::{Path, PathBuf};

/// The example model of a new library.
const MODEL: &str = "motor";

/// File in the library → template with words between `@`.
const TEXTS: [(&str, &str); 14] = [
    ("Cargo.toml", include_str!("../../templates/library/workspace.toml")),
    ("README.md", include_str!("../../templates/library/readme.txt")),
    ("src/lib.rs", include_str!("../../templates/library/src/lib.rs")),
    ("src/@model@.rs", include_str!("../../templates/library/src/motor.rs")),
    ("tests/spin_up.rs", include_str!("../../templates/library/tests/spin_up.rs")),
    ("sims/spin_up/sim.ron", include_str!("../../templates/library/sim/sim.txt")),
    ("program/Cargo.toml", include_str!("../../templates/library/program/program.toml")),
    ("program/src/main.rs", include_str!("../../templates/library/program/src/main.rs")),
    ("unit/Cargo.toml", include_str!("../../templates/library/unit/unit.toml")),
    ("unit/src/lib.rs", include_str!("../../templates/library/unit/src/lib.rs")),
    ("python/Cargo.toml", include_str!("../../templates/library/python/python.toml")),
    ("python/src/lib.rs", include_str!("../../templates/library/python/src/lib.rs")),
    ("python/pyproject.toml", include_str!("../../templates/library/python/pyproject.txt")),
    ("python/tests/test_@name@.py", include_str!("../../templates/library/python/tests/test.txt")),
];

/// Files copied from Linkwork: locked versions, compiler flags, formatting, ignored files.
const COPIED: [&str; 4] = ["Cargo.lock", ".cargo/config.toml", ".gitignore", ".rustfmt.toml"];

/// Files of the Python package that are copied from Linkwork.
const PYTHON: [&str; 8] = [
    "__init__.py",
    "__main__.py",
    "_choose.py",
    "_linkwork.pyi",
    "_show.py",
    "live.py",
    "py.typed",
    "ray.py",
];

/// Creates a library and returns its files.
pub fn library(folder: &Path, linkwork: Option<&Path>) -> Result<Vec<PathBuf>, Refusal> {
    let Some(name) = folder.file_name().and_then(|n| n.to_str()) else {
        let fact = format!("`{}` does not have a name that a library can use", folder.display());
        return Err(wrong(
            fact,
            format!("give a folder: `{} new library windmill`", program().name),
        ));
    };
    let name = identifier(name, "library")?;
    let catalogue = load::catalogue();
    let taken = catalogue.iter().any(|e| e.description.name.split('.').next() == Some(name));
    if taken || name == "linkwork" {
        let fact = format!(
            "`{name}` cannot be the name of a library, because `{}` already has one with that name",
            program().name
        );
        return Err(wrong(fact, "choose another name"));
    }
    let source = sources(linkwork)?;
    let profiles = profiles(&read(&source.join("Cargo.toml"))?);
    let shown = toml_text(&source)?;
    let words = [
        ("name", name),
        ("library", name),
        ("prelude", "linkwork::model::prelude::*"),
        ("model", MODEL),
        ("Model", "Motor"),
        ("linkwork", shown.as_str()),
        ("rust", env!("CARGO_PKG_RUST_VERSION")),
        ("profiles", profiles.as_str()),
    ];
    let mut files: Vec<(String, String)> =
        TEXTS.iter().map(|(file, text)| (filled(file, &words), filled(text, &words))).collect();
    for file in PYTHON {
        let text = read(&source.join("sims/python/python/linkwork").join(file))?;
        files.push((format!("python/{name}/{file}"), text));
    }
    for file in COPIED {
        files.push((file.to_string(), read(&source.join(file))?));
    }
    folder_with(folder, &files)
}

/// Returns the folder with Linkwork's sources.
fn sources(given: Option<&Path>) -> Result<PathBuf, Refusal> {
    let built = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folder = given.unwrap_or(&built);
    let whole =
        folder.canonicalize().ok().filter(|f| f.join("framework/program/Cargo.toml").is_file());
    whole.ok_or_else(|| {
        let fact = format!("the sources of Linkwork are not in `{}`", folder.display());
        wrong(fact, "a library needs them to build: give their folder with --linkwork FOLDER")
    })
}

/// A file of Linkwork's sources.
fn read(path: &Path) -> Result<String, Refusal> {
    std::fs::read_to_string(path).map_err(|e| {
        let fact = format!("`{}` cannot be read: {e}", path.display());
        wrong(fact, "download the complete sources again")
    })
}

/// Packages of Linkwork's own workspace on which no other workspace depends; cargo would warn of their profiles.
const NOT_LIBRARIES: [&str; 4] =
    ["linkwork-cli", "linkwork-embedded-c", "linkwork-outsider", "linkwork-python-module"];

/// Returns the tables of the profiles dev and release in a manifest, with the packages on which a model library can depend.
fn profiles(manifest: &str) -> String {
    let mut wanted = false;
    let mut lines = Vec::new();
    for line in manifest.lines().filter(|l| !l.trim().is_empty() && !l.starts_with('#')) {
        if line.starts_with('[') {
            wanted = ["[profile.dev", "[profile.release"].iter().any(|p| line.starts_with(p));
            if wanted && !lines.is_empty() {
                lines.push("");
            }
        }
        let package = line.split_whitespace().next().unwrap_or_default();
        if wanted && !NOT_LIBRARIES.contains(&package) {
            lines.push(line);
        }
    }
    lines.join("\n") + "\n"
}

/// Returns a path for a quoted string in TOML.
fn toml_text(path: &Path) -> Result<String, Refusal> {
    match path.to_str() {
        Some(text) if !text.contains(['"', '@']) && !text.contains(char::is_control) => {
            Ok(text.replace('\\', "/"))
        }
        _ => Err(wrong(
            format!("the path `{}` cannot be written in a Cargo.toml", path.display()),
            "move Linkwork to a folder without quotes, `@` and control characters in its path",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_are_those_of_the_manifest() {
        let text = "[a]\nx = 1\n\n[profile.dev]\nopt-level = 1\n\n[profile.release.package.b]\n# why\ny = 2\n\n[profile.release.package]\nviewer = { opt-level = 0 }\nlinkwork-cli = { opt-level = 0 }\n\n[profile.bench]\nz = 3\n";
        let wanted = "[profile.dev]\nopt-level = 1\n\n[profile.release.package.b]\ny = 2\n\n[profile.release.package]\nviewer = { opt-level = 0 }\n";
        assert_eq!(profiles(text), wanted);
    }

    #[test]
    fn paths_that_no_manifest_can_hold_are_refused() {
        assert_eq!(toml_text(Path::new("/a/b c")).ok().as_deref(), Some("/a/b c"));
        for bad in ["/a\"b", "/a@b", "/a\nb"] {
            assert!(toml_text(Path::new(bad)).is_err(), "{bad}");
        }
    }
}

//! `linkwork new`: creates a simulation, a rover, a model or a library that runs and passes its tests without changes.
//!
//! The templates are in `framework/program/templates`; words between `@` are replaced. Existing files are never overwritten.
mod library;
mod model;
mod rover;

use crate::exit;
use crate::program::program;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Kind of the item to create.
#[derive(clap::Subcommand, Clone, Debug)]
pub enum Kind {
    /// A folder with a small simulation: an arm that a servo moves, with suggestions for changes.
    Simulation {
        /// The folder, which must not exist yet. Its name becomes that of the simulation.
        folder: PathBuf,
    },
    /// A folder with a rover from a URDF, MJCF or SDF file that drives: wheels, steering and suspension are detected, motors are sized.
    Rover {
        /// The folder, which must not exist yet. Its name becomes that of the simulation.
        folder: PathBuf,
        /// The file that describes the machine. A companion file next to it can define its wheels.
        #[arg(long, value_name = "FILE")]
        from: PathBuf,
    },
    /// A model in a library: a file with its parameters, ports, state and tests, and its line in the catalogue.
    Model {
        /// Its name, e.g. `pump`, which is also the name of its file. Simulations use it with the name of the library (`windmill.pump`).
        name: String,
        /// The library: a folder with Cargo.toml and src/lib.rs.
        #[arg(long, value_name = "FOLDER", default_value = ".")]
        library: PathBuf,
    },
    /// Your own model library, with a program that has all commands, an FMI unit, and tests.
    Library {
        /// The folder, which must not exist yet. Its name becomes that of the library.
        folder: PathBuf,
        /// Folder of the sources of Linkwork (default: those from which this program was built).
        #[arg(long, value_name = "FOLDER")]
        linkwork: Option<PathBuf>,
    },
}

/// Exit code, fact, remedy (empty if the fact contains it).
type Refusal = (u8, String, String);

/// Creates it, and prints the new or changed files.
pub fn make(kind: &Kind) -> u8 {
    let made = match kind {
        Kind::Simulation { folder } => simulation(folder),
        Kind::Rover { folder, from } => rover::rover(folder, from),
        Kind::Model { name, library } => model::model(name, library),
        Kind::Library { folder, linkwork } => library::library(folder, linkwork.as_deref()),
    };
    match made {
        Ok(files) => {
            for file in files {
                say!("{}", file.display());
            }
            exit::OK
        }
        Err((code, fact, help)) if help.is_empty() => {
            tell!("error: {fact}");
            code
        }
        Err((code, fact, help)) => {
            tell!("error: {fact}\n  help: {help}");
            code
        }
    }
}

fn wrong(fact: impl Into<String>, help: impl Into<String>) -> Refusal {
    (exit::INPUT, fact.into(), help.into())
}

fn failed(path: &Path, what: &str, e: &std::io::Error) -> Refusal {
    let fact = format!("`{}` cannot be {what}: {e}", path.display());
    (exit::FAILED, fact, "choose a writable path".into())
}

/// Returns the text with `@word@` replaced, for each pair (word, replacement).
fn filled(text: &str, words: &[(&str, &str)]) -> String {
    words
        .iter()
        .fold(text.to_string(), |text, (word, meaning)| text.replace(&format!("@{word}@"), meaning))
}

/// Creates a new folder with files. After an error, no files remain.
fn folder_with(folder: &Path, files: &[(String, String)]) -> Result<Vec<PathBuf>, Refusal> {
    let shown = folder.display();
    if folder.symlink_metadata().is_ok() {
        return Err(wrong(format!("`{shown}` already exists"), "choose another name"));
    }
    std::fs::create_dir_all(folder).map_err(|e| failed(folder, "created", &e))?;
    let write = |(name, text): &(String, String)| {
        let path = folder.join(name);
        let parent = path.parent().unwrap_or(folder);
        let made = std::fs::create_dir_all(parent).and_then(|()| std::fs::File::create_new(&path));
        made.and_then(|mut f| f.write_all(text.as_bytes()))
            .map_err(|e| failed(&path, "written", &e))?;
        Ok(path)
    };
    files.iter().map(write).collect::<Result<_, _>>().inspect_err(|_| {
        // The folder was created here, so it can be removed.
        let _ = std::fs::remove_dir_all(folder);
    })
}

fn simulation(folder: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let Some(name) = folder.file_name().and_then(|n| n.to_str()) else {
        let fact = format!("`{}` does not have a name that a simulation can use", folder.display());
        return Err(wrong(
            fact,
            format!("give a folder: `{} new simulation swing`", program().name),
        ));
    };
    let words = [("name", name), ("program", program().name)];
    let texts = [
        ("sim.ron", include_str!("../../templates/simulation/sim.txt")),
        ("README.md", include_str!("../../templates/simulation/readme.txt")),
    ];
    let files = texts.map(|(file, text)| (file.to_string(), filled(text, &words)));
    folder_with(folder, &files)
}

/// Words of Rust.
const RUST: &str = "as async await break const continue crate dyn else enum extern false fn for gen if impl in \
    let loop match mod move mut pub ref return self static struct super trait true type unsafe \
    use where while abstract become box do final macro override priv try typeof unsized \
    virtual yield";

/// Keywords of Python, because a library is also a Python package.
const PYTHON: &str = "and assert class def del elif except finally from global import is lambda nonlocal not or \
    pass raise with";

/// Names that cause conflicts as a crate, module or package.
const NAMES: &str = "alloc core std test tests catalogue library numpy pytest ray";

/// Checks that a name is valid for a Rust module and in files: `pump`, `relief_valve`.
fn identifier<'a>(name: &'a str, what: &str) -> Result<&'a str, Refusal> {
    let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let good = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(letters)
        && !name.ends_with('_')
        && !name.contains("__");
    if !good {
        let help = "use lower-case letters, digits and single `_`, beginning with a letter: `relief_valve`";
        return Err(wrong(format!("`{name}` cannot be the name of a {what}"), help));
    }
    if [RUST, PYTHON, NAMES].iter().any(|words| words.split_whitespace().any(|word| word == name)) {
        let fact =
            format!("`{name}` cannot be the name of a {what}: it is reserved in Rust or Python");
        return Err(wrong(fact, "choose another name"));
    }
    Ok(name)
}

/// `relief_valve` → `ReliefValve`.
fn camel(name: &str) -> String {
    let capital = |word: &str| {
        let (head, tail) = word.split_at(word.len().min(1));
        head.to_ascii_uppercase() + tail
    };
    name.split('_').map(capital).collect()
}

/// A model's file.
fn model_text(library: &str, model: &str, prelude: &str) -> String {
    let name = camel(model);
    let words =
        [("library", library), ("model", model), ("Model", name.as_str()), ("prelude", prelude)];
    filled(include_str!("../../templates/model/model.rs"), &words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_identifiers() {
        for good in ["pump", "relief_valve", "a2"] {
            assert!(identifier(good, "model").is_ok(), "{good}");
        }
        for bad in
            ["", "Pump", "2a", "_a", "a_", "a__b", "a-b", "a b", "ä", "a.b", "fn", "std", "lambda"]
        {
            assert!(identifier(bad, "model").is_err(), "{bad}");
        }
        assert_eq!((camel("relief_valve"), camel("a2")), ("ReliefValve".into(), "A2".into()));
    }

    #[test]
    fn nothing_is_left_to_fill_in() {
        assert!(!model_text("windmill", "pump", "linkwork::model::prelude::*").contains('@'));
    }
}

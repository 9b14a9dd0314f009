//! `linkwork new`: a simulation, a rover, a model or a library to begin from, which runs and is tested as it is.
//!
//! The texts are in `framework/program/templates`; words between `@` are filled in. What is there already is never written over.
mod library;
mod model;
mod rover;

use crate::exit;
use crate::program::program;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What there is to make.
#[derive(clap::Subcommand, Clone, Debug)]
pub enum Kind {
    /// A folder with a small simulation that runs: an arm that a servo swings, and what to change next.
    Simulation {
        /// The folder, which must not be there yet. Its name becomes that of the simulation.
        folder: PathBuf,
    },
    /// A folder with a rover from a URDF, MJCF or SDF file that drives: wheels, steering and suspension are found, motors chosen.
    Rover {
        /// The folder, which must not be there yet. Its name becomes that of the simulation.
        folder: PathBuf,
        /// The file that describes the machine; a side-car beside it may name its wheels.
        #[arg(long, value_name = "FILE")]
        from: PathBuf,
    },
    /// A model in a library: a file with its parameters, ports, state and tests, and its line in the catalogue.
    Model {
        /// Its name, e.g. `pump`: of the file, and behind the library's in simulations (`windmill.pump`).
        name: String,
        /// The library: a folder with Cargo.toml and src/lib.rs.
        #[arg(long, value_name = "FOLDER", default_value = ".")]
        library: PathBuf,
    },
    /// A library of models of one's own: with a program that has every command, an FMI unit, tests.
    Library {
        /// The folder, which must not be there yet. Its name becomes that of the library.
        folder: PathBuf,
        /// Where the sources of Linkwork are; those that this program was built from unless given.
        #[arg(long, value_name = "FOLDER")]
        linkwork: Option<PathBuf>,
    },
}

/// Exit code, fact, remedy (empty where the fact has it).
type Refusal = (u8, String, String);

/// Makes it, and prints the files that are new or changed.
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
    (exit::FAILED, fact, "name a place that can be written".into())
}

/// The text with `@word@` replaced, for each pair (word, meaning).
fn filled(text: &str, words: &[(&str, &str)]) -> String {
    words
        .iter()
        .fold(text.to_string(), |text, (word, meaning)| text.replace(&format!("@{word}@"), meaning))
}

/// Makes a folder that is not there, with files at paths in it. Either all of it or nothing stays.
fn folder_with(folder: &Path, files: &[(String, String)]) -> Result<Vec<PathBuf>, Refusal> {
    let shown = folder.display();
    if folder.symlink_metadata().is_ok() {
        return Err(wrong(format!("`{shown}` is there already"), "give another name"));
    }
    std::fs::create_dir_all(folder).map_err(|e| failed(folder, "made", &e))?;
    let write = |(name, text): &(String, String)| {
        let path = folder.join(name);
        let parent = path.parent().unwrap_or(folder);
        let made = std::fs::create_dir_all(parent).and_then(|()| std::fs::File::create_new(&path));
        made.and_then(|mut f| f.write_all(text.as_bytes()))
            .map_err(|e| failed(&path, "written", &e))?;
        Ok(path)
    };
    files.iter().map(write).collect::<Result<_, _>>().inspect_err(|_| {
        // It was made here, a moment ago.
        let _ = std::fs::remove_dir_all(folder);
    })
}

fn simulation(folder: &Path) -> Result<Vec<PathBuf>, Refusal> {
    let Some(name) = folder.file_name().and_then(|n| n.to_str()) else {
        let fact = format!("`{}` has no name that a simulation can take", folder.display());
        return Err(wrong(
            fact,
            format!("name a folder: `{} new simulation swing`", program().name),
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

/// Words of Python, in which a library is a package.
const PYTHON: &str = "and assert class def del elif except finally from global import is lambda nonlocal not or \
    pass raise with";

/// Names that a crate, module or package cannot take without trouble.
const NAMES: &str = "alloc core std test tests catalogue library numpy pytest ray";

/// Checks that a name can be that of a Rust module and stand in a file: `pump`, `relief_valve`.
fn identifier<'a>(name: &'a str, what: &str) -> Result<&'a str, Refusal> {
    let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let good = name.starts_with(|c: char| c.is_ascii_lowercase())
        && name.chars().all(letters)
        && !name.ends_with('_')
        && !name.contains("__");
    if !good {
        let help = "small letters, digits and single `_`, beginning with a letter: `relief_valve`";
        return Err(wrong(format!("`{name}` cannot be the name of a {what}"), help));
    }
    if [RUST, PYTHON, NAMES].iter().any(|words| words.split_whitespace().any(|word| word == name)) {
        let fact =
            format!("`{name}` cannot be the name of a {what}: it is taken in Rust or Python");
        return Err(wrong(fact, "give another name"));
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

//! The header of a model's source file, where its equations are.
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A source file's header.
#[derive(Clone, Debug)]
pub struct Header {
    /// The file, from the top of the repository.
    pub file: String,
    /// The text of its `//!` lines, Markdown.
    pub text: String,
}

/// Name of a model → header of the file that declares it, for all files below some folders of the repository.
///
/// # Errors
/// A folder or file that cannot be read.
pub fn headers(root: &Path, folders: &[&str]) -> std::io::Result<BTreeMap<String, Header>> {
    let mut found = BTreeMap::new();
    for folder in folders {
        for file in sources(&root.join(folder))? {
            let text = std::fs::read_to_string(&file)?;
            let shown =
                file.strip_prefix(root).unwrap_or(&file).to_string_lossy().replace('\\', "/");
            let header = Header { file: shown, text: header(&text) };
            found.extend(declared(&text).into_iter().map(|name| (name, header.clone())));
        }
    }
    Ok(found)
}

fn sources(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(sources(&path)?);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// The text of the `//!` lines at the top.
fn header(text: &str) -> String {
    let lines = text.lines().map_while(|l| l.strip_prefix("//!"));
    let lines: Vec<&str> = lines.map(|l| l.strip_prefix(' ').unwrap_or(l)).collect();
    lines.join("\n")
}

/// Names that a file declares: `#[model("a.b")]`, `#[service("a.b", ..)]`, `#[field("a.b")]`, `NAME: &'static str = "a.b"`,
/// `Entry::given(..)` and others by their name as a text of its own.
fn declared(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]").next().unwrap_or(text);
    let word = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let name = |t: &str| {
        t.split_once('.').is_some_and(|(a, b)| {
            !a.is_empty() && !b.is_empty() && a.chars().all(word) && b.chars().all(word)
        })
    };
    let lines = code.lines().filter(|l| !l.trim_start().starts_with("//"));
    let texts = lines.flat_map(|l| l.split('"').skip(1).step_by(2));
    texts.filter(|t| name(t)).map(str::to_string).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_headers_are_read() {
        let text = "//! `a.b`: two lines\n//!\n//! of text.\n\n// \"c.d\"\n#[model(\"a.b\")]\nconst N: &str = \"a.c\";\n\
                    let not = \"A.b\";\n#[cfg(test)]\nlet test = \"t.t\";";
        assert_eq!(header(text), "`a.b`: two lines\n\nof text.");
        assert_eq!(declared(text), ["a.b", "a.c"]);
    }
}

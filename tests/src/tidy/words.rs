//! Phrases that a reader has to translate (`framework/STYLE.md`), counted per kind of text. Their numbers may only fall.

/// Phrases in lower case. `beside` and `goes on`, for example, stand for several of the field's terms.
#[rustfmt::skip]
const PHRASES: [&str; 30] = [
    "are refused", "are told", "beside", "bit for bit", "by itself", "by themselves", "go on",
    "goes on", "has not", "have not", "is no", "is refused", "is told", "last digits", "lets go", "of its own", "of their own", "refuses", "tells", "that of", "that which", "those of",
    "to be wished", "to the bit", "unless written", "unwritten", "was refused", "was told",
    "what is", "what it is",
];

/// Kinds of texts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Pages in Markdown.
    Page,
    /// Documentation of Rust items and files.
    Documentation,
    /// Comments in Rust code.
    Comment,
}

/// Counts the phrases in the texts of one kind of a file.
pub fn count(name: &str, text: &str, kind: Kind) -> usize {
    let mut fenced = false;
    let mut found = 0;
    for line in text.lines() {
        let Some(words) = words(name, line.trim_start(), kind) else { continue };
        if words.trim_start().starts_with("```") {
            fenced = !fenced;
        } else if !fenced {
            found += phrases(words);
        }
    }
    found
}

/// The text of a line, if it is of this kind.
fn words<'t>(name: &str, line: &'t str, kind: Kind) -> Option<&'t str> {
    if name.ends_with(".md") {
        return (kind == Kind::Page).then_some(line);
    }
    let documentation = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
    match kind {
        Kind::Page => None,
        Kind::Documentation => documentation,
        Kind::Comment if documentation.is_some() => None,
        Kind::Comment => line.strip_prefix("//"),
    }
}

/// Counts the phrases of a line outside of code spans.
fn phrases(line: &str) -> usize {
    let plain: String = line.split('`').step_by(2).collect::<Vec<_>>().join(" x ").to_lowercase();
    let ends = |c: Option<char>| c.is_none_or(|c| !c.is_alphanumeric());
    let here = |phrase: &&str| {
        plain
            .match_indices(phrase)
            .filter(|(at, _)| {
                ends(plain[..*at].chars().next_back())
                    && ends(plain[at + phrase.len()..].chars().next())
            })
            .count()
    };
    PHRASES.iter().map(here).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phrases_are_found_in_their_kind_and_outside_of_code() {
        let rust = "//! It tells `what is` here.\n/// Beside it.\n// A tale; goes on.\nlet tells = \"is told\";\n";
        assert_eq!(count("a.rs", rust, Kind::Documentation), 2);
        assert_eq!(count("a.rs", rust, Kind::Comment), 1);
        assert_eq!(count("a.rs", rust, Kind::Page), 0);
        let page = "It is told.\n```text\nIt is told.\n```\nNobody retells `is told`.\n";
        assert_eq!(count("a.md", page, Kind::Page), 1);
        assert_eq!(count("a.md", page, Kind::Comment), 0);
    }
}

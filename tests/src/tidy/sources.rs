//! Source files: header, length, marks of unfinished work; and what lies at the top level.

/// Lines that no file exceeds.
pub const LINES_MAX: usize = 700;

/// Marks of work put off. In two pieces, so that this file has none.
const MARKS: [&str; 5] = [
    concat!("TO", "DO"),
    concat!("FIX", "ME"),
    concat!("to", "do!("),
    concat!("unimple", "mented!("),
    concat!("#[ig", "nore"),
];

/// Calls that do not come back from every number, which no lint can name (it is a method of an alias), and what to call.
const ENDLESS: (&str, &str) = (concat!("Quat::from", "_matrix("), "linkwork_spatial::quat");

/// Findings in one source file.
pub fn file(path: &str, text: &str) -> Vec<String> {
    let mut found = Vec::new();
    if path.ends_with(".rs") && !text.starts_with("//!") {
        found.push(format!("{path}:1: begin with `//!` and say what the file is for"));
    }
    // Documentation of items does not count, so that the docstrings of Python can be as long as
    // necessary.
    let lines = text.lines().filter(|line| !line.trim_start().starts_with("///")).count();
    if lines > LINES_MAX {
        found.push(format!("{path}: {lines} lines; split it by idea (at most {LINES_MAX})"));
    }
    for (k, line) in text.lines().enumerate() {
        for mark in MARKS.iter().filter(|m| has_word(line, m)) {
            found.push(format!("{path}:{}: `{mark}`: finish it or take it out", k + 1));
        }
        if line.contains(ENDLESS.0) {
            let (call, instead) = ENDLESS;
            found.push(format!("{path}:{}: `{call}` has no end in NaN: call `{instead}`", k + 1));
        }
    }
    found
}

/// True when `mark` occurs and is not the tail or head of a longer word.
fn has_word(line: &str, mark: &str) -> bool {
    let word = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    line.match_indices(mark).any(|(at, _)| {
        let (before, after) = (&line[..at], &line[at + mark.len()..]);
        let open = !mark.ends_with(char::is_alphanumeric);
        !word(before.chars().next_back()) && (open || !word(after.chars().next()))
    })
}

/// What may lie at the top level, besides names that begin with a dot and what git ignores.
const TOP: [&str; 11] = [
    "Cargo.toml",
    "Cargo.lock",
    "README.md",
    "LICENSE-APACHE",
    "CONTRIBUTING.md",
    "LICENSE-MIT",
    "framework",
    "components",
    "assemblies",
    "sims",
    "tests",
];

/// Names at the top level that do not belong there.
pub fn top_level<'a>(names: impl IntoIterator<Item = &'a str>, gitignore: &str) -> Vec<String> {
    let ignored = |name: &str| gitignore.lines().any(|l| l.trim().trim_matches('/') == name);
    names
        .into_iter()
        .filter(|n| !n.starts_with('.') && !TOP.contains(n) && !ignored(n))
        .map(|n| format!("`{n}` lies at the top level: move it to the folder of its concept"))
        .collect()
}

/// Files that no `mod` names, so that they are never compiled: of the tests of one crate (`main.rs` and what is beside and
/// below it), each with its path from there.
pub fn unnamed(files: &[(&str, &str)]) -> Vec<String> {
    let text = |path: &str| files.iter().find(|(name, _)| *name == path).map_or("", |(_, t)| t);
    let named = |path: &&str| {
        let module = path.strip_suffix("/mod.rs").or(path.strip_suffix(".rs")).unwrap_or(path);
        let (folder, name) = module.rsplit_once('/').unwrap_or(("", module));
        let parent = if folder.is_empty() { "main.rs" } else { &format!("{folder}/mod.rs") };
        text(parent).lines().any(|l| l.trim_start_matches("pub ") == format!("mod {name};"))
            || text("main.rs").contains(&format!("#[path = \"{path}\"]"))
    };
    let paths = files.iter().map(|(path, _)| *path);
    paths
        .filter(|path| path.ends_with(".rs") && *path != "main.rs")
        .filter(|path| !named(path))
        .map(|path| format!("{path}: no `mod` names it, so that it is never compiled"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_of_tests_that_nothing_names_are_found() {
        let main = "mod here;\nmod folder;\n#[path = \"there/by_path.rs\"]\nmod by_path;\n";
        let files = [
            ("main.rs", main),
            ("here.rs", ""),
            ("lost.rs", "mod here;"),
            ("folder/mod.rs", "pub mod inner;"),
            ("folder/inner.rs", ""),
            ("folder/lost.rs", ""),
            ("there/by_path.rs", ""),
            ("data.txt", ""),
        ];
        let found = unnamed(&files);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].starts_with("lost.rs") && found[1].starts_with("folder/lost.rs"));
    }

    #[test]
    fn each_rule_can_fail() {
        assert_eq!(file("a.rs", "//! Good.\nfn f() {}\n"), Vec::<String>::new());
        assert!(file("a.rs", "fn f() {}")[0].contains("begin with"));
        assert!(file("a.py", "x = 1").is_empty());
        let long = format!("//! Long.\n{}", "\n".repeat(LINES_MAX));
        assert!(file("a.rs", &long)[0].contains("701 lines"));
        for mark in MARKS {
            let text = format!("//! Bad.\n    {mark} later");
            assert_eq!(file("a.rs", &text).len(), 1, "{mark}");
        }
        let endless = format!("//! Bad.\nlet R = {}&m);", ENDLESS.0);
        assert!(file("a.rs", &endless)[0].contains("has no end"));
        let inside = format!("//! A word that holds it.\nlet MAS{}S = 1;", MARKS[0]);
        assert!(file("a.rs", &inside).is_empty());
    }

    #[test]
    fn strangers_at_the_top_are_found() {
        let names = ["Cargo.toml", ".ci", "target", "notes.txt", "tests"];
        let found = top_level(names, "/target\n*.mcap\n");
        assert!(found.len() == 1 && found[0].contains("notes.txt"), "{found:?}");
    }
}

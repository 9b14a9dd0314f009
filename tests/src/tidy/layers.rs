//! Modules of one crate in layers: which files import which, read from the paths in their code.
use std::collections::{BTreeMap, BTreeSet};

/// Source files of a crate by their path below `src`, each with its text.
pub type Files = BTreeMap<String, String>;

/// Code without comments; strings stay.
fn code(text: &str) -> String {
    let lines = text.lines().map(|l| l.split("//").next().unwrap_or_default());
    lines.collect::<Vec<_>>().join("\n")
}

/// All module paths behind `crate::` in a text: `crate::a::{b::C, d}` gives `a::b::C` and `a::d`.
pub fn paths(text: &str) -> Vec<String> {
    let code = code(text);
    let mut out = Vec::new();
    for (at, _) in code.match_indices("crate::") {
        let before = code[..at].chars().next_back();
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_' || c == '$') {
            continue;
        }
        branches("", &code[at + "crate::".len()..], &mut out);
    }
    out
}

/// Reads one tree of a path; gives how many bytes it took.
fn branches(head: &str, text: &str, out: &mut Vec<String>) -> usize {
    let word = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
    let path =
        if head.is_empty() { text[..word].into() } else { format!("{head}::{}", &text[..word]) };
    let rest = &text[word..];
    if word > 0 && rest.starts_with("::") {
        return word + 2 + branches(&path, &rest[2..], out);
    }
    if word == 0 && rest.starts_with('{') {
        let mut at = 1;
        loop {
            at += rest[at..].len() - rest[at..].trim_start_matches([' ', '\n', ',']).len();
            match rest[at..].chars().next() {
                None => return at,
                Some('}') => return at + 1,
                // `C as D` only renames an item.
                _ if rest[at..].starts_with("as ") => {
                    let renamed = rest[at..].find([',', '}']);
                    at += renamed.unwrap_or(rest.len() - at);
                }
                _ => at += branches(head, &rest[at..], out).max(1),
            }
        }
    }
    out.push(path);
    word
}

/// The file of a module path: `a::b::C` is in `a/b.rs`, `a/b/mod.rs`, `a.rs` or `a/mod.rs`.
fn file_of(path: &str, files: &Files) -> Option<String> {
    let pieces: Vec<&str> = path.split("::").collect();
    (1..=pieces.len()).rev().find_map(|n| {
        let stem = pieces[..n].join("/");
        [format!("{stem}.rs"), format!("{stem}/mod.rs")].into_iter().find(|f| files.contains_key(f))
    })
}

/// File → files that it imports, itself left out. A `mod.rs` imports a child when it names what is in it.
pub fn imports(files: &Files) -> BTreeMap<String, BTreeSet<String>> {
    let one = |(name, text): (&String, &String)| {
        let mut to: BTreeSet<String> =
            paths(text).iter().filter_map(|p| file_of(p, files)).collect();
        if let Some(folder) = name.strip_suffix("mod.rs") {
            let code = code(text);
            let children = files.keys().filter_map(|f| f.strip_prefix(folder)?.strip_suffix(".rs"));
            let named = children.filter(|c| !c.contains('/') && *c != "mod");
            let named = named.filter(|c| code.contains(&format!(" {c}::")));
            to.extend(named.map(|c| format!("{folder}{c}.rs")));
        }
        to.remove(name);
        (name.clone(), to)
    };
    files.iter().map(one).collect()
}

/// Files that import each other in a circle, each circle as a line.
pub fn circles(files: &Files) -> Vec<String> {
    let imports = imports(files);
    let reach = |from: &String| {
        let (mut seen, mut open) = (BTreeSet::new(), vec![from]);
        while let Some(next) = open.pop() {
            for to in imports.get(next).into_iter().flatten() {
                if seen.insert(to) {
                    open.push(to);
                }
            }
        }
        seen
    };
    let reached: BTreeMap<&String, _> = imports.keys().map(|f| (f, reach(f))).collect();
    let on = |f: &String| reached[f].contains(f);
    let mut told = BTreeSet::new();
    for f in imports.keys().filter(|f| on(f)) {
        let ring: Vec<&str> = (imports.keys())
            .filter(|g| reached[f].contains(*g) && reached[*g].contains(f))
            .map(String::as_str)
            .collect();
        told.insert(format!("a circle: {}", ring.join(", ")));
    }
    told.into_iter().collect()
}

/// Folder → folders whose files its files import.
pub fn folders(files: &Files) -> BTreeMap<String, BTreeSet<String>> {
    let folder = |f: &str| f.split_once('/').map(|(head, _)| head.to_string());
    let mut out: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for (from, to) in imports(files) {
        let Some(from) = folder(&from) else { continue };
        let to = to.iter().filter_map(|t| folder(t)).filter(|t| *t != from);
        out.entry(from.clone()).or_default().extend(to);
    }
    out
}

/// Where the folders differ from a list of who imports whom, in which each names only those above it.
pub fn layers(files: &Files, list: &[(&str, &[&str])]) -> Vec<String> {
    let mut found = Vec::new();
    for (k, (name, to)) in list.iter().enumerate() {
        let above: Vec<&str> = list[..k].iter().map(|l| l.0).collect();
        let up = to.iter().filter(|t| !above.contains(t));
        found.extend(
            up.map(|t| format!("the list: `{name}` may not import `{t}`, which is not above it")),
        );
    }
    let folders = folders(files);
    for (name, to) in &folders {
        let Some((_, listed)) = list.iter().find(|l| l.0 == name) else {
            found.push(format!("`{name}` is in no layer: add it to the list in tidy"));
            continue;
        };
        let more = to.iter().filter(|t| !listed.contains(&t.as_str()));
        found.extend(more.map(|t| format!("`{name}` imports `{t}`, which the list does not say")));
        let less = listed.iter().filter(|l| !to.contains(**l));
        found.extend(less.map(|l| format!("`{name}` does not import `{l}`: take it off the list")));
    }
    let gone = list.iter().filter(|l| !folders.contains_key(l.0));
    found.extend(gone.map(|l| format!("there is no folder `{}`", l.0)));
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn files(all: &[(&str, &str)]) -> Files {
        all.iter().map(|(f, t)| ((*f).to_string(), (*t).to_string())).collect()
    }

    #[test]
    fn paths_of_all_forms_are_found() {
        let text = "use crate::a::{b::{C, d as e}, self};\n// use crate::no::X;\nfn f() { crate::g::h() }\n$crate::m!()";
        assert_eq!(paths(text), ["a::b::C", "a::b::d", "a::self", "g::h"]);
    }

    #[test]
    fn circles_and_upward_imports_are_named() {
        let good = files(&[
            ("low/mod.rs", "mod x;\npub use x::X;"),
            ("low/x.rs", "pub struct X;"),
            ("high/mod.rs", "use crate::low::X;"),
        ]);
        let list: [(&str, &[&str]); 2] = [("low", &[]), ("high", &["low"])];
        assert_eq!(layers(&good, &list), Vec::<String>::new());
        assert_eq!(circles(&good), Vec::<String>::new());
        let mut bad = good.clone();
        bad.insert("low/x.rs".into(), "use crate::low::y; use crate::high::Z;".into());
        bad.insert("low/y.rs".into(), "use crate::low::x::X;".into());
        assert_eq!(layers(&bad, &list), ["`low` imports `high`, which the list does not say"]);
        assert!(
            circles(&bad)[0].contains("high/mod.rs, low/mod.rs, low/x.rs, low/y.rs"),
            "{:?}",
            circles(&bad)
        );
        let list: [(&str, &[&str]); 3] = [("low", &["high"]), ("high", &[]), ("gone", &[])];
        assert_eq!(layers(&good, &list).len(), 4);
    }
}

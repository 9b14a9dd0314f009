//! A path that a document names exists, and so does the test `path::name`.

/// How a word that means a repository path begins.
const ROOTS: [&str; 6] = ["framework/", "components/", "assemblies/", "sims/", "tests/", ".ci/"];

/// A path that a document names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Named {
    /// Line, from 1.
    pub line: usize,
    /// From the top of the repository.
    pub path: String,
    /// What follows `::`, the name of a test or function.
    pub item: Option<String>,
}

/// The repository paths that a Markdown text names, with their lines: words of inline code and of
/// code blocks. Placeholders (`<…>`, `{…}`, `…`) do not count; `a/b*` counts as `a`.
pub fn paths(text: &str) -> Vec<Named> {
    let mut found = Vec::new();
    let mut fenced = false;
    for (k, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
            continue;
        }
        let code: Vec<&str> =
            if fenced { vec![line] } else { line.split('`').skip(1).step_by(2).collect() };
        for word in code.iter().flat_map(|c| c.split_whitespace()) {
            let word = word.trim_matches(|c: char| ",;()[]\"'".contains(c));
            if ROOTS.iter().any(|r| word.starts_with(r)) && !word.contains(['<', '{', '…']) {
                let item = word.split_once("::").map(|(_, item)| item.to_string());
                found.push(Named { line: k + 1, path: path_of(word), item });
            }
        }
    }
    found
}

/// Without `:line`, `::name`, `#anchor`, a trailing slash or stop, and what follows a wildcard.
fn path_of(word: &str) -> String {
    let word = word.split([':', '#']).next().unwrap_or(word);
    let word = match word.split_once('*') {
        Some((head, _)) => head.rsplit_once('/').map_or(head, |(folder, _)| folder),
        None => word,
    };
    word.trim_end_matches(['/', '.']).to_string()
}

/// Findings in one document. `read` answers for a path from the top of the repository: `None` when
/// it does not exist, an empty text for a folder.
pub fn missing(name: &str, text: &str, read: &dyn Fn(&str) -> Option<String>) -> Vec<String> {
    let finding = |Named { line, path, item }: Named| match (read(&path), item) {
        (None, _) => Some(format!("{name}:{line}: there is no `{path}`")),
        (Some(source), Some(item)) if !source.contains(&format!("fn {item}(")) => {
            Some(format!("{name}:{line}: `{path}` has no function `{item}`"))
        }
        _ => None,
    };
    paths(text).into_iter().filter_map(finding).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_that_do_not_exist_are_found() {
        let text = "See `framework/spatial/` and `framework/gone.rs:12`; sims/none is prose.\n\
                    `linkwork run sims/x --until 5s`, `sims/<name>`, `tests/tests/*.rs`.\n\
                    ```sh\ncd components/lost\n```\n`.ci/run`, `tests/a.rs::holds`, `tests/a.rs::fails`";
        let read = |p: &str| {
            let known = ["framework/spatial", "tests/tests", ".ci/run", "tests/a.rs"].contains(&p);
            known.then(|| "fn holds() {}".to_string())
        };
        let found = missing("a.md", text, &read);
        assert_eq!(
            found,
            [
                "a.md:1: there is no `framework/gone.rs`",
                "a.md:2: there is no `sims/x`",
                "a.md:4: there is no `components/lost`",
                "a.md:6: `tests/a.rs` has no function `fails`",
            ]
        );
    }
}

//! A path that a document names exists.

/// How a word that means a repository path begins.
const ROOTS: [&str; 6] = ["framework/", "components/", "assemblies/", "sims/", "tests/", ".ci/"];

/// The repository paths that a Markdown text names, with their lines: words of inline code and of
/// code blocks. Placeholders (`<…>`, `{…}`, `…`) do not count; `a/b*` counts as `a`.
pub fn paths(text: &str) -> Vec<(usize, String)> {
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
                found.push((k + 1, path_of(word)));
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

/// Findings in one document; `exists` answers for a path from the top of the repository.
pub fn missing(name: &str, text: &str, exists: &dyn Fn(&str) -> bool) -> Vec<String> {
    paths(text)
        .into_iter()
        .filter(|(_, path)| !exists(path))
        .map(|(line, path)| format!("{name}:{line}: there is no `{path}`"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_that_do_not_exist_are_found() {
        let text = "See `framework/spatial/` and `framework/gone.rs:12`; sims/none is prose.\n\
                    `linkwork run sims/x --until 5s`, `sims/<name>`, `tests/tests/*.rs`.\n\
                    ```sh\ncd components/lost\n```\n`.ci/run`";
        let exists = |p: &str| ["framework/spatial", "tests/tests", ".ci/run"].contains(&p);
        let found = missing("a.md", text, &exists);
        assert_eq!(
            found,
            [
                "a.md:1: there is no `framework/gone.rs`",
                "a.md:2: there is no `sims/x`",
                "a.md:4: there is no `components/lost`",
            ]
        );
    }
}

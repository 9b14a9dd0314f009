//! Patterns for paths of variables: their matches, and patterns without a match.
use crate::text::value::Text;
pub use linkwork_runtime::pattern::path_matches;
pub(crate) use linkwork_runtime::pattern::segment_matches;
use linkwork_runtime::{Catalogue, Fault, Files, Spec, did_you_mean, known_variables};

fn no_match<S: AsRef<str>>(p: &Text, names: &[S]) -> Fault {
    let plain = p.text.replace("**", "").replace('*', "");
    let guess = did_you_mean(&plain, names.iter().map(AsRef::as_ref));
    Fault::new(p.origin, format!("`{}` matches no variable", p.text)).help(format!(
        "{}`*` matches one segment of a path, `**` any number; \
         `linkwork list` shows all {} variables",
        guess.map(|g| format!("{g} ")).unwrap_or_default(),
        names.len()
    ))
}

/// Returns faults for patterns that cannot match, in a simulation without a plan because of other mistakes: variables that a known part does not
/// have. Bodies and unknown parts are not checked.
pub fn misspelt(
    patterns: &[Text],
    spec: &Spec,
    catalogue: &Catalogue,
    files: &Files,
) -> Vec<Fault> {
    let (names, dark) = known_variables(spec, catalogue, files);
    let known = |part: &str| !dark.iter().any(|d| d == part);
    let mut faults = Vec::new();
    // A star may match a part that could not be read.
    for p in patterns.iter().filter(|p| !p.text.contains(['*', '/'])) {
        let owner = spec.parts.iter().find(|part| {
            let below = p.text.strip_prefix(&part.path);
            below.is_some_and(|rest| rest.starts_with('.')) && known(&part.path)
        });
        let below = format!("{}.**", p.text);
        let is = |name: &String| {
            path_matches(&p.text, name)
                || path_matches(&below, name)
                || name.starts_with(&format!("{}[", p.text))
        };
        if owner.is_some() && !names.iter().any(is) {
            faults.push(no_match(p, &names));
        }
    }
    faults
}

/// Returns the indices of the names that any pattern matches, in the order of the names.
///
/// A pattern without a star also matches everything below it: `Rover.Motor` matches `Rover.Motor.current`.
///
/// # Errors
/// One fault for each pattern without a match.
pub fn match_patterns<S: AsRef<str>>(
    patterns: &[Text],
    names: &[S],
) -> Result<Vec<usize>, Vec<Fault>> {
    let mut chosen = vec![false; names.len()];
    let mut faults = Vec::new();
    for p in patterns {
        let found = matches(&p.text, names);
        if found.is_empty() {
            faults.push(no_match(p, names));
        }
        for k in found {
            chosen[k] = true;
        }
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    Ok((0..names.len()).filter(|k| chosen[*k]).collect())
}

/// Returns the indices of the names that a pattern matches, in order; empty without a match. [`match_patterns`] reports an error with the most
/// similar name, which takes far longer to find.
pub fn matches<S: AsRef<str>>(pattern: &str, names: &[S]) -> Vec<usize> {
    let plain = !pattern.contains('*');
    let (below, element) = (format!("{pattern}.**"), format!("{pattern}["));
    let chosen = |name: &str| {
        path_matches(pattern, name)
            || (plain && (path_matches(&below, name) || name.starts_with(&element)))
    };
    (0..names.len()).filter(|k| chosen(names[*k].as_ref())).collect()
}

//! Patterns over paths of variables: `*` stands for one segment or a piece of one, `**` for any
//! number. Dots and slashes both end a segment, so `Rover.**` takes the bodies of `Rover` too.
use crate::context::Text;
use linkwork_runtime::{Fault, did_you_mean};

/// True when a pattern of one segment matches a name: `Wheel*`, `*`, `Motor`.
pub(crate) fn segment_matches(pattern: &str, name: &str) -> bool {
    let Some((head, tail)) = pattern.split_once('*') else { return pattern == name };
    let Some(rest) = name.strip_prefix(head) else { return false };
    (0..=rest.len())
        .filter(|k| rest.is_char_boundary(*k))
        .any(|k| segment_matches(tail, &rest[k..]))
}

/// True when a pattern matches a path.
pub fn path_matches(pattern: &str, path: &str) -> bool {
    let pattern: Vec<&str> = pattern.split(['.', '/']).collect();
    let path: Vec<&str> = path.split(['.', '/']).collect();
    segments(&pattern, &path)
}

fn segments(pattern: &[&str], path: &[&str]) -> bool {
    match pattern.split_first() {
        None => path.is_empty(),
        Some((&"**", rest)) => (0..=path.len()).any(|k| segments(rest, &path[k..])),
        Some((first, rest)) => path
            .split_first()
            .is_some_and(|(head, tail)| segment_matches(first, head) && segments(rest, tail)),
    }
}

/// Indices of the names that any pattern matches, in the order of the names.
///
/// A pattern without a star also matches what lies below it: `Rover.Motor` takes
/// `Rover.Motor.current`.
///
/// # Errors
/// One fault for each pattern that matches nothing.
pub fn match_patterns<S: AsRef<str>>(
    patterns: &[Text],
    names: &[S],
) -> Result<Vec<usize>, Vec<Fault>> {
    let mut chosen = vec![false; names.len()];
    let mut faults = Vec::new();
    for p in patterns {
        let below = format!("{}.**", p.text);
        let plain = !p.text.contains('*');
        let mut any = false;
        for (k, name) in names.iter().enumerate() {
            let name = name.as_ref();
            if path_matches(&p.text, name)
                || (plain
                    && (path_matches(&below, name) || name.starts_with(&format!("{}[", p.text))))
            {
                chosen[k] = true;
                any = true;
            }
        }
        if !any {
            let fault = Fault::new(p.origin, format!("`{}` matches no variable", p.text));
            let guess = did_you_mean(
                &p.text.replace("**", "").replace('*', ""),
                names.iter().map(AsRef::as_ref),
            );
            faults.push(fault.help(format!(
                "{}`*` stands for one part of a path, `**` for any number; \
                 `linkwork list` shows all {} variables",
                guess.map(|g| format!("{g} ")).unwrap_or_default(),
                names.len()
            )));
        }
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    Ok((0..names.len()).filter(|k| chosen[*k]).collect())
}

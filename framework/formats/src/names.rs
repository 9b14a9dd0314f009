//! The nearest name, for messages.

/// `did you mean ..`, or all names when there are few.
pub(crate) fn suggest<'a>(name: &str, kind: &str, all: impl Iterator<Item = &'a str>) -> String {
    let all: Vec<&str> = all.collect();
    let best = all
        .iter()
        .map(|c| (strsim::jaro_winkler(name, c), *c))
        .filter(|(score, _)| *score > 0.7)
        .max_by(|a, b| a.0.total_cmp(&b.0));
    match best {
        Some((_, c)) => format!("did you mean `{c}`?"),
        None if all.is_empty() => format!("there is no {kind} at all"),
        None if all.len() <= 12 => format!("one of: {}", all.join(", ")),
        None => format!("define the {kind}, or correct the name"),
    }
}

//! Suggestions for misspelt names: the nearest known name as a question, or the list of known names.
//!
//! ```
//! assert_eq!(linkwork_names::did_you_mean("raduis", ["radius", "mass"]).as_deref(), Some("did you mean `radius`?"));
//! ```

/// Returns the known name most similar to a misspelt one, if it is similar enough. In names with dots, the last part counts for a third. One wrong
/// letter or two swapped letters are similar enough in a name of three letters or more. `a[2]` is another name of `a.z`.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let indexed = component(name);
    known
        .into_iter()
        .map(|k| {
            let (a, b) = (name.to_lowercase(), k.to_lowercase());
            let tail = |s: &str| s.rsplit('.').next().unwrap_or(s).to_owned();
            let whole = strsim::jaro_winkler(&a, &b);
            let tail = strsim::jaro_winkler(&tail(&a), &tail(&b));
            let slip = indexed.as_deref() == Some(k)
                || indexed.is_none()
                    && name.chars().count() > 2
                    && strsim::osa_distance(name, k) == 1;
            (slip, 0.7 * whole + 0.3 * tail, k)
        })
        .filter(|(slip, like, _)| *slip || *like > 0.75)
        .min_by(|a, b| b.0.cmp(&a.0).then(b.1.total_cmp(&a.1)).then(a.2.cmp(b.2)))
        .map(|(_, _, k)| k)
}

/// Returns the name of a component that is written with an index: `a.z` for `a[2]`.
fn component(name: &str) -> Option<String> {
    let (vector, index) = name.strip_suffix(']')?.rsplit_once('[')?;
    let axis = ["x", "y", "z", "w"].get(index.parse::<usize>().ok()?)?;
    Some(format!("{vector}.{axis}"))
}

/// Returns the nearest name as a question.
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<String> {
    nearest(name, known).map(|k| format!("did you mean `{k}`?"))
}

/// Returns the nearest name as a question. If none is near, returns the list of up to 12 known names, or a hint to define it. `kind` is one word for
/// what is named.
pub fn suggest<'a>(name: &str, kind: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    match did_you_mean(name, known.iter().copied()) {
        Some(question) => question,
        None if known.is_empty() => format!("no {kind} exists"),
        None if known.len() <= 12 => format!("one of: {}", known.join(", ")),
        None => format!("define the {kind}, or correct the name"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_is_told_and_another_word_is_not() {
        let known = ["run", "resume", "Rover.Wheels.Wheel1", "Rover.Wheels.Motor1", "wheel_radius"];
        for (said, meant) in [
            ("rnu", Some("run")),
            ("rum", Some("run")),
            ("resme", Some("resume")),
            ("RESUME", Some("resume")),
            ("Rover.Wheels.Weel1", Some("Rover.Wheels.Wheel1")),
            ("whel_radius", Some("wheel_radius")),
            ("zq", None),
            ("", None),
            ("battery", None),
        ] {
            assert_eq!(nearest(said, known), meant, "{said}");
        }
        assert_eq!(nearest("x", []), None);
    }

    #[test]
    fn an_index_is_a_component() {
        let known = ["bob.angular.x", "bob.angular.y", "bob.angular.z", "bob.angular.w", "bob[7]"];
        for (written, meant) in [
            ("bob.angular[0]", "bob.angular.x"),
            ("bob.angular[2]", "bob.angular.z"),
            ("bob.angular[3]", "bob.angular.w"),
            ("bob[8]", "bob[7]"),
        ] {
            assert_eq!(nearest(written, known), Some(meant), "{written}");
        }
    }

    /// Among equally near names, the alphabetically first is returned, independent of their order. A single typing error has priority over general
    /// similarity.
    #[test]
    fn the_order_of_names_does_not_count() {
        assert_eq!(nearest("rnu", ["rn_unit", "run"]), Some("run"));
        assert_eq!(nearest("arm3", ["arm2", "arm1"]), Some("arm1"));
        assert_eq!(nearest("arm3", ["arm1", "arm2"]), Some("arm1"));
    }

    #[test]
    fn few_names_are_listed() {
        assert_eq!(suggest("lnik", "link", ["link", "foot"]), "did you mean `link`?");
        assert_eq!(suggest("xyz", "link", ["hand", "foot"]), "one of: hand, foot");
        assert_eq!(suggest("xyz", "link", []), "no link exists");
        let many: Vec<String> = (0..13).map(|k| format!("part{k}")).collect();
        let many = many.iter().map(String::as_str);
        assert_eq!(suggest("xyz", "link", many), "define the link, or correct the name");
    }
}

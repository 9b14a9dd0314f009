//! Patterns over paths of variables, as users write them: what they choose, and which choose nothing.
use crate::text::value::Text;
pub use linkwork_runtime::pattern::path_matches;
pub(crate) use linkwork_runtime::pattern::segment_matches;
use linkwork_runtime::{Fault, did_you_mean};

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

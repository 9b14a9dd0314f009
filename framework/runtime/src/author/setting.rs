//! Settings of the file that have no effect in any phase.
//!
//! A setting may act in one phase only: the damping of a hinge that another phase prescribes. The warning is therefore made from all phases together.
use crate::author::error::BuildError;
use crate::author::value::{Fault, Origin};
use std::collections::BTreeMap;

/// A setting of one phase, and whether it acts there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Setting {
    /// Owner in words, which begins the warning: ``body `arm` ``.
    pub owner: String,
    /// Name of the setting: `damping`.
    pub name: &'static str,
    /// Where it is written. Together with owner and name it identifies the setting in all phases.
    pub origin: Origin,
    /// The reason for which it does not act, and the remedy; `None`: it acts.
    pub idle: Option<(String, String)>,
}

/// Returns whether an input of the part has a source. A name such as `torque` stands for `torque` and for each `wheels[i].torque`.
pub type IsWired<'a> = &'a dyn Fn(&str) -> bool;

/// Something of a part that may have no effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Judge {
    /// The parameter with this name; it counts if the file states another value than the default.
    Param(&'static str),
    /// The input with this name, wired or not.
    Input(&'static str),
}

/// Parameters and inputs of a part, each with the reason for which it has no effect and the remedy, or `None` if it acts.
pub type Judged = Vec<(Judge, Option<BuildError>)>;

/// Returns the reason for which something has no effect while an input has no source; `so` states the consequence. `None` if it has one.
pub fn unwired(wired: IsWired<'_>, input: &str, so: &str) -> Option<BuildError> {
    (!wired(input)).then(|| {
        BuildError::new(format!("no wire leads to `{input}`; {so}"))
            .help(format!("wire `{input}`, or set it from a program"))
    })
}

/// Returns a warning for each owner and reason, with the settings that act in none of the phases that have them.
pub(crate) fn without_effect(phases: &[Vec<Setting>]) -> Vec<Fault> {
    let all = || phases.iter().flatten();
    let same =
        |a: &Setting, b: &Setting| (a.origin, &a.owner, a.name) == (b.origin, &b.owner, b.name);
    let mut found: BTreeMap<(Origin, &str, &str), (Vec<&str>, &str)> = BTreeMap::new();
    for setting in all() {
        let Some((reason, remedy)) = &setting.idle else { continue };
        if all().any(|other| same(setting, other) && other.idle.is_none()) {
            continue;
        }
        // If a setting has no effect for several reasons, report only the first one.
        let first = all().find(|other| same(setting, other)).and_then(|s| s.idle.as_ref());
        if first.is_some_and(|(first, _)| first != reason) {
            continue;
        }
        let entry = found.entry((setting.origin, &setting.owner, reason));
        let (names, _) = entry.or_insert((Vec::new(), remedy));
        if !names.contains(&setting.name) {
            names.push(setting.name);
        }
    }
    let warning =
        |((origin, owner, reason), (names, remedy)): ((_, &str, &str), (Vec<&str>, &str))| {
            let names: Vec<String> = names.iter().map(|n| format!("`{n}`")).collect();
            let (list, have) = match &names[..] {
                [one] => (one.clone(), "has"),
                [all @ .., last] => (format!("{} and {last}", all.join(", ")), "have"),
                [] => (String::new(), "has"),
            };
            Fault::new(origin, format!("{owner}: {list} {have} no effect: {reason}")).help(remedy)
        };
    found.into_iter().map(warning).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setting(name: &'static str, idle: Option<&str>) -> Setting {
        let idle = idle.map(|reason| (reason.to_string(), format!("remedy of {reason}")));
        Setting { owner: "body `a`".into(), name, origin: Origin::NONE, idle }
    }

    #[test]
    fn settings_that_act_in_one_phase_are_not_reported() {
        let first = vec![setting("damping", Some("held")), setting("spring", Some("held"))];
        let all = without_effect(std::slice::from_ref(&first));
        assert_eq!(all.len(), 1, "{all:?}");
        assert_eq!(all[0].message, "body `a`: `damping` and `spring` have no effect: held");
        assert_eq!(all[0].help.as_deref(), Some("remedy of held"));
        let second = vec![setting("damping", None)];
        let all = without_effect(&[first.clone(), second]);
        assert_eq!(all.len(), 1, "{all:?}");
        assert_eq!(all[0].message, "body `a`: `spring` has no effect: held");
        // If the reason differs between phases, the first one is reported.
        let all = without_effect(&[first, vec![setting("spring", Some("absent"))]]);
        let messages: Vec<&str> = all.iter().map(|f| f.message.as_str()).collect();
        assert_eq!(messages, ["body `a`: `damping` and `spring` have no effect: held"]);
    }
}

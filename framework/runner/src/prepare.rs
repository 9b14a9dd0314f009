//! What is looked up before a run: nothing is written before all of it is right.
use crate::figures::Figures;
use linkwork_assembly::{LogRule, Settings, match_patterns};
use linkwork_runtime::{Fault, Place, Plan, Seconds};

/// What a simulation's file names, found in the plan.
pub struct Prepared {
    /// Variables to log, and the period of their rows.
    pub groups: Vec<(Seconds, Vec<String>)>,
    /// Figures.
    pub figures: Figures,
    /// The variable that stops the run.
    pub stop_when: Option<Place>,
}

/// Looks up the patterns and variables that the file names.
///
/// # Errors
/// Every name that is not there, and every unit that does not fit.
pub fn prepare(plan: &Plan, file: &Settings) -> Result<Prepared, Vec<Fault>> {
    let mut faults: Vec<Fault> = Vec::new();
    let groups = groups(plan, &file.log).unwrap_or_else(|mut f| {
        faults.append(&mut f);
        Vec::new()
    });
    let figures = Figures::new(plan, &file.figures).unwrap_or_else(|mut f| {
        faults.append(&mut f);
        Figures::default()
    });
    let stop_when = file.stop_when.as_ref().and_then(|t| match plan.variable(&t.text) {
        Ok(v) => Some(v.place),
        Err(e) => {
            faults.push(Fault::new(t.origin, format!("stop_when: {}", e.message)).help(e.help));
            None
        }
    });
    if faults.is_empty() { Ok(Prepared { groups, figures, stop_when }) } else { Err(faults) }
}

/// Variables by path for each rule of a log; a rule without a rate takes every step.
fn groups(plan: &Plan, rules: &[LogRule]) -> Result<Vec<(Seconds, Vec<String>)>, Vec<Fault>> {
    let names: Vec<&str> = plan.variables.keys().map(String::as_str).collect();
    let (mut groups, mut faults) = (Vec::new(), Vec::new());
    for rule in rules {
        match match_patterns(&rule.channels, &names) {
            Ok(found) => groups.push((
                rule.rate.unwrap_or(plan.step),
                found.iter().map(|&k| names[k].to_string()).collect(),
            )),
            Err(mut f) => faults.append(&mut f),
        }
    }
    if faults.is_empty() { Ok(groups) } else { Err(faults) }
}

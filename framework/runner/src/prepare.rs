//! What is looked up before a run: nothing is written before all of it is right.
use crate::figures::Figures;
use linkwork_assembly::Text;
use linkwork_assembly::form::{AroundForm, LogRule, Settings};
use linkwork_assembly::patterns::match_patterns;
use linkwork_runtime::{Around, Condition, Fault, Plan, Rule};

/// What a simulation's file names, found in the plan.
pub struct Prepared {
    /// What to log.
    pub groups: Vec<Rule>,
    /// Figures.
    pub figures: Figures,
    /// The condition that stops the run, by its place among those that it watches.
    pub stop_when: Option<u32>,
}

/// Looks up the patterns and variables that the file names.
///
/// # Errors
/// Every name that is not there, and every unit that does not fit.
pub fn prepare(plan: &Plan, file: &Settings) -> Result<Prepared, Vec<Fault>> {
    let mut faults: Vec<Fault> = Vec::new();
    let groups = log_rules(plan, &file.log).unwrap_or_else(|mut f| {
        faults.append(&mut f);
        Vec::new()
    });
    let figures = Figures::new(plan, &file.figures).unwrap_or_else(|mut f| {
        faults.append(&mut f);
        Figures::default()
    });
    // It was read when the program was compiled.
    let stop_when = file.stop_when.as_ref().map(|_| 0);
    if faults.is_empty() { Ok(Prepared { groups, figures, stop_when }) } else { Err(faults) }
}

/// The variables and conditions of each rule of a log; a rule without a rate takes every step.
///
/// # Errors
/// Patterns that match nothing, conditions that cannot be read or never change, rows that would take too much memory
/// while they wait for an event: all of them.
pub fn log_rules(plan: &Plan, rules: &[LogRule]) -> Result<Vec<Rule>, Vec<Fault>> {
    let names: Vec<&str> = plan.variables.keys().map(String::as_str).collect();
    let (mut found, mut faults) = (Vec::new(), Vec::new());
    for rule in rules {
        let paths = match_patterns(&rule.channels, &names).unwrap_or_else(|mut f| {
            faults.append(&mut f);
            Vec::new()
        });
        let period = rule.rate.unwrap_or(plan.step);
        let around = rule.around.as_ref().and_then(|form| {
            let around = around(plan, form).and_then(|around| {
                around.check(period, paths.len()).map_err(|(fact, help)| {
                    Fault::new(form.origin, format!("log: {fact}")).help(help)
                })?;
                Ok(around)
            });
            around.map_err(|fault| faults.push(fault)).ok()
        });
        let paths = paths.iter().map(|&k| names[k].to_string()).collect();
        found.push(Rule { paths, period, on_change: rule.on_change, around });
    }
    if faults.is_empty() { Ok(found) } else { Err(faults) }
}

fn around(plan: &Plan, form: &AroundForm) -> Result<Around, Fault> {
    let when = condition(plan, &form.when, "log")?;
    Ok(Around { when, before: form.before, after: form.after })
}

/// A condition over the variables of a plan; one in which nothing ever changes is refused.
pub(crate) fn condition(plan: &Plan, text: &Text, of: &str) -> Result<Condition, Fault> {
    let fault =
        |fact: String, help: &str| Fault::new(text.origin, format!("{of}: {fact}")).help(help);
    let when =
        Condition::parse(&text.text, &plan.variables).map_err(|e| fault(e.to_string(), &e.help))?;
    if !when.timed() && when.places().next().is_none() {
        let fact = format!("condition `{}`: nothing in it ever changes", text.text);
        return Err(fault(fact, "test a state, an output that varies, or `time`"));
    }
    Ok(when)
}

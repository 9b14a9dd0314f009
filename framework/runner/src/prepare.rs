//! Resolution of names before a run: no file is written before all names are correct.
use crate::conditions::condition;
use crate::metrics::Metrics;
use linkwork_assembly::form::{AroundForm, LogRule, Settings};
use linkwork_assembly::patterns::match_patterns;
use linkwork_runtime::{Around, Fault, Plan, Rule};

/// The names in a simulation's file, resolved in the plan.
pub struct Prepared {
    /// Rules of the log.
    pub groups: Vec<Rule>,
    /// Metrics.
    pub metrics: Metrics,
    /// Index of the condition that stops the run, among the watched conditions.
    pub stop_when: Option<u32>,
}

/// Resolves the patterns and variables in the file.
///
/// # Errors
/// All names that do not exist, and all units of another quantity.
pub fn prepare(plan: &Plan, file: &Settings) -> Result<Prepared, Vec<Fault>> {
    let mut faults: Vec<Fault> = Vec::new();
    let groups = log_rules(plan, &file.log).unwrap_or_else(|mut f| {
        faults.append(&mut f);
        Vec::new()
    });
    let metrics = Metrics::new(plan, &file.metrics).unwrap_or_else(|mut f| {
        faults.append(&mut f);
        Metrics::default()
    });
    // The condition was parsed when the program was compiled, and it has the number 0.
    let stop_when = file.stop_when.as_ref().map(|_| 0);
    if faults.is_empty() { Ok(Prepared { groups, metrics, stop_when }) } else { Err(faults) }
}

/// Returns the variables and conditions of each rule of a log. A rule without a rate samples every step.
///
/// # Errors
/// All of: patterns without a match, conditions with syntax errors, constant conditions, rules that would need too much memory for samples before an
/// event.
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

//! Conditions over the variables of a plan.
use linkwork_assembly::Text;
use linkwork_runtime::{Condition, Fault, Plan};

/// Returns a condition over the variables of a plan; a condition that never changes is an error.
pub(crate) fn condition(plan: &Plan, text: &Text, of: &str) -> Result<Condition, Fault> {
    let fault =
        |fact: String, help: &str| Fault::new(text.origin, format!("{of}: {fact}")).help(help);
    let when =
        Condition::parse(&text.text, &plan.variables).map_err(|e| fault(e.to_string(), &e.help))?;
    if !when.timed() && when.places().next().is_none() {
        let fact = format!("condition `{}`: its value never changes", text.text);
        return Err(fault(fact, "test a state, an output that varies, or `time`"));
    }
    Ok(when)
}

//! Log rules from Python: they are equal to those of a file, and so is the recording that they define.
use crate::error::{refuse, refuse_with};
use crate::values::seconds;
use linkwork_assembly::Text;
use linkwork_assembly::form::{AroundForm, LogRule};
use linkwork_record::LogSpec;
use linkwork_runner::log_rules;
use linkwork_runtime::{Fault, Origin, Plan, Recorder, Rule, Seconds, Simulation, Sources};
use pyo3::prelude::*;
use std::path::Path;

/// Converts the mistakes in a rule that does not come from a file.
pub fn refused(faults: &[Fault]) -> PyErr {
    refuse(linkwork_assembly::show_faults(
        faults,
        &Sources::default(),
        linkwork_assembly::Look::Plain,
    ))
}

pub fn text(text: &str) -> Text {
    Text { text: text.into(), origin: Origin::NONE }
}

/// Reads `around`, `before` and `after` of a log.
pub fn window(
    around: Option<String>,
    before: Option<&Bound<'_, PyAny>>,
    after: Option<&Bound<'_, PyAny>>,
) -> PyResult<Option<AroundForm>> {
    let read = |given: Option<&Bound<'_, PyAny>>, what: &str| {
        given.map_or(Ok(Seconds::ZERO), |t| seconds(t, what))
    };
    match around {
        None if before.is_some() || after.is_some() => Err(refuse_with(
            "`before` and `after` require `around`",
            "give around=\"Part.output > 1 N\"",
        )),
        None => Ok(None),
        Some(when) => Ok(Some(AroundForm {
            when: text(&when),
            before: read(before, "before")?,
            after: read(after, "after")?,
            origin: Origin::NONE,
        })),
    }
}

/// Resolves the variables of a log rule.
pub fn rule(
    plan: &Plan,
    channels: &[String],
    rate: Option<Seconds>,
    on_change: bool,
    around: Option<AroundForm>,
) -> PyResult<Rule> {
    let channels = channels.iter().map(|c| text(c)).collect();
    let rule = LogRule { channels, rate, on_change, around, origin: Origin::NONE };
    let found = log_rules(plan, &[rule]).map_err(|faults| refused(&faults))?;
    found.into_iter().next().ok_or_else(|| refuse("a log rule was not resolved"))
}

/// Creates a recorder that writes an MCAP file: variables by path with their sample periods, and the poses of all bodies.
pub fn recording(
    sim: &Simulation,
    path: &Path,
    groups: Vec<Rule>,
    configuration: &str,
) -> Result<Recorder, String> {
    let spec = LogSpec {
        groups,
        transforms: Some(Seconds { num: 1, den: 20 }),
        configuration: configuration.to_string(),
        about: [("program".to_string(), "the Python package".to_string())].into(),
        start: None,
    };
    let (log, groups) =
        linkwork_record::Log::create(path, sim.program(), &spec).map_err(|e| e.to_string())?;
    Recorder::start(sim, groups, 256, Box::new(log)).map_err(|e| e.to_string())
}

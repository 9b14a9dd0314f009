//! Requirements of a campaign: bounds of metrics, each with the cause under which violations are counted.
use super::{Reader, describe};
use linkwork_runtime::{Located, Origin, Value};

/// A bound of a metric.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound {
    /// The number.
    pub number: f64,
    /// Its unit; empty: that of the metric.
    pub unit: String,
}

/// A requirement on a metric. Runs that violate it are counted under this cause.
#[derive(Clone, Debug, PartialEq)]
pub struct Requirement {
    /// Description of the failure, in words.
    pub cause: String,
    /// Name of the metric.
    pub metric: String,
    /// Smallest acceptable value; `None`: no lower bound.
    pub least: Option<Bound>,
    /// Largest acceptable value; `None`: no upper bound.
    pub most: Option<Bound>,
    /// Position in the file.
    pub origin: Origin,
}

impl Reader {
    pub(super) fn require(&mut self, v: &Located) -> Vec<Requirement> {
        let help = "write require: { \"it came down too fast\": (metric: \"speed at the end\", most: \"1 m/s\") }";
        let Value::Map(entries) = &v.value else {
            self.fault(v.origin, format!("`require` holds {}", v.value.what()), help);
            return Vec::new();
        };
        let mut out = Vec::new();
        for (cause, item) in entries {
            let what = format!("`require`: `{cause}`");
            self.fields(item, &what, &describe::requirement());
            let mut bound = |field: &str| {
                let (number, unit) =
                    self.number(item.get(field)?, &format!("{what}: `{field}`"))?;
                Some(Bound { number, unit })
            };
            let (least, most) = (bound("least"), bound("most"));
            let metric = item.get("metric").map(|f| self.text(f, "metric"));
            if metric.is_none() {
                self.fault(item.origin, format!("{what} lacks a `metric`"), help);
            }
            if item.get("least").is_none() && item.get("most").is_none() {
                let fact = format!("{what} lacks a bound");
                self.fault(item.origin, fact, "write least, most or both");
            }
            let Some(Some(metric)) = metric else { continue };
            out.push(Requirement {
                cause: cause.clone(),
                metric,
                least,
                most,
                origin: item.origin,
            });
        }
        out
    }
}

//! What a campaign requires of its runs: bounds of figures, each with the cause that a run beyond them is counted by.
use super::{Reader, describe};
use linkwork_runtime::{Located, Origin, Value};

/// A bound of a figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Bound {
    /// The number.
    pub number: f64,
    /// Its unit; empty: that of the figure.
    pub unit: String,
}

/// What a figure has to be. A run of which it is not has missed, by this cause.
#[derive(Clone, Debug, PartialEq)]
pub struct Requirement {
    /// What is wrong with a run that misses it, in words.
    pub cause: String,
    /// Name of the figure.
    pub figure: String,
    /// Least value that is good; none: no bound below.
    pub least: Option<Bound>,
    /// Greatest value that is good; none: no bound above.
    pub most: Option<Bound>,
    /// Where it is written.
    pub origin: Origin,
}

impl Reader {
    pub(super) fn require(&mut self, v: &Located) -> Vec<Requirement> {
        let help = "write require: { \"it came down too fast\": (figure: \"speed at the end\", most: \"1 m/s\") }";
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
            let figure = item.get("figure").map(|f| self.text(f, "figure"));
            if figure.is_none() {
                self.fault(item.origin, format!("{what} has no `figure`"), help);
            }
            if item.get("least").is_none() && item.get("most").is_none() {
                let fact = format!("{what} has no bound");
                self.fault(item.origin, fact, "write least, most or both");
            }
            let Some(Some(figure)) = figure else { continue };
            out.push(Requirement {
                cause: cause.clone(),
                figure,
                least,
                most,
                origin: item.origin,
            });
        }
        out
    }
}

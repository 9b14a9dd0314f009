//! How a run ended, and its results.
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// Reason for which a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// The simulation's own `until`.
    Until,
    /// The simulation's `stop_when`.
    StopWhen,
    /// The campaign's limit of simulated time, before the simulation's own end.
    TimeLimit,
    /// The campaign's limit of wall time.
    WallLimit,
    /// A state diverged.
    Failed,
    /// The drawn configuration is not valid.
    Refused,
    /// Bug in the program: a model or the framework panicked.
    Panicked,
}

impl Cause {
    /// Returns its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Cause::Until => "until",
            Cause::StopWhen => "stop_when",
            Cause::TimeLimit => "time_limit",
            Cause::WallLimit => "wall_limit",
            Cause::Failed => "failed",
            Cause::Refused => "refused",
            Cause::Panicked => "panicked",
        }
    }

    /// Returns whether the run ended normally, so that its metrics are included in the statistics.
    pub fn is_orderly(self) -> bool {
        matches!(self, Cause::Until | Cause::StopWhen | Cause::TimeLimit)
    }
}

/// The outcome of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Its number, from 0.
    pub run: u64,
    /// Reason for which the run ended.
    pub ended: Cause,
    /// Error message; empty without an error.
    pub why: String,
    /// Simulated time at the end (s).
    #[serde(with = "exact")]
    pub time: f64,
    /// Seed of its noise.
    pub seed: u64,
    /// Hash of its last state; 0 without a state.
    pub hash: u64,
    /// Wall time (s). It is not in any table, because it is not reproducible.
    #[serde(with = "exact")]
    pub wall: f64,
    /// Metrics, in their order and units; empty if the run did not have any.
    #[serde(with = "exact_list")]
    pub metrics: Vec<f64>,
    /// Last start of each phase of the campaign (s); NaN for a phase that did not begin. Missing in journals of earlier versions.
    #[serde(with = "exact_list", default)]
    pub phases: Vec<f64>,
    /// CRC-32 of its history file; `None` without one.
    pub history: Option<u32>,
}

impl Outcome {
    /// Converts it to a line of the journal: JSON with numbers as texts that convert back bit-identically.
    ///
    /// # Errors
    /// Errors of the JSON writer.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self)
    }

    /// Reads the text of [`Outcome::to_text`].
    ///
    /// # Errors
    /// The text is not an outcome.
    pub fn from_text(text: &str) -> Result<Outcome, serde_json::Error> {
        serde_json::from_str(text)
    }

    /// Returns whether this is the outcome of the same run, repeated: equal except for the wall time.
    pub fn is_again(&self, other: &Outcome) -> bool {
        let bits = |o: &Outcome| o.metrics.iter().map(|y| y.to_bits()).collect::<Vec<_>>();
        let all =
            |o: &Outcome| (o.run, o.ended, o.time.to_bits(), o.seed, o.hash, bits(o), o.history);
        all(self) == all(other)
    }

    /// Returns the cause under which failures are counted. Digits are replaced, because variables and numbers of similar failures differ only in
    /// digits.
    pub fn kind(&self) -> String {
        let first = self.why.lines().next().unwrap_or_default();
        let mut kind = String::new();
        let mut number = false;
        for c in first.chars() {
            number = c.is_ascii_digit() || (number && ".eE+-".contains(c));
            match (number, kind.ends_with('#')) {
                (true, true) => {}
                (true, false) => kind.push('#'),
                (false, _) => kind.push(c),
            }
        }
        match kind.is_empty() {
            true => self.ended.name().into(),
            false => format!("{}: {kind}", self.ended.name()),
        }
    }
}

/// Serializes a number as the shortest text that converts back bit-identically.
mod exact {
    use super::*;

    pub fn serialize<S: Serializer>(x: &f64, s: S) -> Result<S::Ok, S::Error> {
        s.serialize_str(&format!("{x:?}"))
    }
    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<f64, D::Error> {
        String::deserialize(d)?.parse().map_err(de::Error::custom)
    }
}

mod exact_list {
    use super::*;

    pub fn serialize<S: Serializer>(x: &[f64], s: S) -> Result<S::Ok, S::Error> {
        s.collect_seq(x.iter().map(|x| format!("{x:?}")))
    }
    pub fn deserialize<'de, D: Deserializer<'de>>(d: D) -> Result<Vec<f64>, D::Error> {
        let texts = Vec::<String>::deserialize(d)?;
        texts.iter().map(|t| t.parse().map_err(de::Error::custom)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failures_that_differ_in_digits_are_of_one_kind() {
        let of = |why: &str| Outcome {
            run: 0,
            ended: Cause::Failed,
            why: why.into(),
            time: 0.0,
            seed: 0,
            hash: 0,
            wall: 0.0,
            metrics: Vec::new(),
            phases: Vec::new(),
            history: None,
        };
        let a = of("`bob.rate` became 1.5e17 at t = 0.25 s\n  help: a smaller step");
        let b = of("`bob.rate` became 22.75e-3 at t = 12 s\n  help: a smaller step");
        assert_eq!(a.kind(), b.kind());
        assert_ne!(a.kind(), of("`bob.angle` became 1.5e17 at t = 0.25 s").kind());
        assert_eq!(Outcome { ended: Cause::Until, ..of("") }.kind(), "until");
    }
}

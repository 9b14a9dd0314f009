//! How a run ended, and what came out of it.
use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// Why a run came to its end.
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
    /// A state left the numbers.
    Failed,
    /// The configuration drawn does not load.
    Refused,
    /// The program has a mistake: a model or the framework panicked.
    Panicked,
}

impl Cause {
    /// In the words of tables.
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

    /// Whether the run came to an end that it was meant to have: its metrics are among the statistics.
    pub fn is_orderly(self) -> bool {
        matches!(self, Cause::Until | Cause::StopWhen | Cause::TimeLimit)
    }
}

/// A run that ended.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Its number, from 0.
    pub run: u64,
    /// Why it ended.
    pub ended: Cause,
    /// What exactly went wrong; empty when nothing did.
    pub why: String,
    /// Simulated time at the end (s).
    #[serde(with = "exact")]
    pub time: f64,
    /// Seed of its noise.
    pub seed: u64,
    /// Hash of its last state; 0 when it had none.
    pub hash: u64,
    /// Wall time that it took (s). It is in no table: it differs from time to time.
    #[serde(with = "exact")]
    pub wall: f64,
    /// Metrics, in their order and units; none when it had none.
    #[serde(with = "exact_list")]
    pub metrics: Vec<f64>,
    /// When each phase of the campaign began last (s); NaN for one that has not begun. None in journals of earlier versions.
    #[serde(with = "exact_list", default)]
    pub phases: Vec<f64>,
    /// CRC-32 of the file of its history; `None` when it left none.
    pub history: Option<u32>,
}

impl Outcome {
    /// As in the journal: JSON, its numbers as texts that read back to the same bits.
    ///
    /// # Errors
    /// What the writer of JSON says.
    pub fn to_text(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string(self)
    }

    /// What [`Outcome::to_text`] wrote.
    ///
    /// # Errors
    /// It is none.
    pub fn from_text(text: &str) -> Result<Outcome, serde_json::Error> {
        serde_json::from_str(text)
    }

    /// Whether this is the same run, made again: the same in all but the wall time that it took.
    pub fn is_again(&self, other: &Outcome) -> bool {
        let bits = |o: &Outcome| o.metrics.iter().map(|y| y.to_bits()).collect::<Vec<_>>();
        let all =
            |o: &Outcome| (o.run, o.ended, o.time.to_bits(), o.seed, o.hash, bits(o), o.history);
        all(self) == all(other)
    }

    /// The cause as failures are counted by: variables and numbers of runs of one kind differ in digits alone.
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

/// A number as the shortest text that reads back to its bits.
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

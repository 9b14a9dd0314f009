//! Values of a campaign: constants, distributions, and lists and maps that contain distributions.
use super::describe::{self, KINDS};
use super::{Drawn, Reader, Template};
use crate::distribution::Distribution;
use linkwork_runtime::{Located, Origin, Unit, Value, remedy, split_quantity};

impl Reader {
    /// Reads a number and its unit.
    pub(super) fn number(&mut self, v: &Located, what: &str) -> Option<(f64, String)> {
        let read = match &v.value {
            Value::Number(x) => Some((*x, String::new())),
            Value::Text(t) => split_quantity(t).map(|(x, u)| (x, u.to_string())),
            _ => None,
        };
        let Some((x, unit)) = read.filter(|(x, _)| !x.is_nan()) else {
            let message = format!("{what} is {}", v.value);
            self.fault(v.origin, message, "write a number, or a quantity in quotes: \"50 g\"");
            return None;
        };
        if let Err(e) = (!unit.is_empty()).then(|| Unit::parse(&unit)).transpose() {
            self.fault(v.origin, format!("{what}: {e}"), "write a unit such as kg, m/s or deg");
            return None;
        }
        Some((x, unit))
    }

    pub(super) fn template(&mut self, v: &Located, name: &str) -> Template {
        match &v.value {
            Value::Variant(kind, inner) if KINDS.contains(&kind.as_str()) => {
                match self.distribution(kind, inner, v.origin, name) {
                    Some((of, unit)) => {
                        self.drawn.push(Drawn { name: name.into(), of, unit, origin: v.origin });
                        Template::Drawn(self.drawn.len() - 1)
                    }
                    None => Template::Constant(Value::Null),
                }
            }
            Value::List(items) => {
                let one = |(k, item)| self.template(item, &format!("{name}[{k}]"));
                Template::List(items.iter().enumerate().map(one).collect())
            }
            Value::Map(entries) => {
                let mut entries: Vec<&(String, Located)> = entries.iter().collect();
                entries.sort_by(|a, b| a.0.cmp(&b.0));
                let one = |(k, v): &(String, Located)| {
                    (k.clone(), self.template(v, &format!("{name}.{k}")))
                };
                Template::Map(entries.into_iter().map(one).collect())
            }
            // `Pin(..)` or `Free` can be a variant of the simulation's format. A misspelt distribution is reported here, not by a run.
            Value::Variant(kind, _) if likely(kind) => {
                let message = format!("there is no distribution `{kind}`");
                self.fault(v.origin, message, remedy(kind, "distributions", &KINDS));
                Template::Constant(Value::Null)
            }
            other => Template::Constant(other.clone()),
        }
    }

    fn distribution(
        &mut self,
        kind: &str,
        inner: &Located,
        origin: Origin,
        name: &str,
    ) -> Option<(Distribution, String)> {
        if kind == "Choice" {
            return self.choice(inner, origin, name).map(|d| (d, String::new()));
        }
        let fields = describe::distribution(kind)();
        let what = format!("`{name}`: {kind}");
        self.fields(inner, &what, &fields);
        let wanted = describe::names(&fields);
        let mut read: Vec<Option<(f64, String)>> = Vec::new();
        for field in &wanted {
            let open = kind == "TruncatedNormal" && ["from", "to"].contains(field);
            read.push(match inner.get(field) {
                Some(v) => self.number(v, &format!("{what}: `{field}`")),
                None if open => Some((
                    if *field == "from" { f64::NEG_INFINITY } else { f64::INFINITY },
                    String::new(),
                )),
                None => {
                    self.fault(
                        origin,
                        format!("{what} lacks `{field}`"),
                        format!("write {field}: .."),
                    );
                    None
                }
            });
        }
        let read: Vec<(f64, String)> = read.into_iter().collect::<Option<_>>()?;
        let unit = read[0].1.clone();
        let mut x = Vec::new();
        for (field, (number, own)) in wanted.iter().zip(&read) {
            // A deviation is a difference, such as 5 K for a mean of 20 degC, so the offset of its unit does not count.
            let difference = *field == "deviation";
            match in_unit(*number, own, &unit, difference) {
                _ if *field == "sigma" && own.is_empty() => x.push(*number),
                Some(y) => x.push(y),
                // An infinite bound does not have a unit.
                None if number.is_infinite() => x.push(*number),
                None => {
                    let (a, b) = (shown(own), shown(&unit));
                    let message = format!("{what}: `{field}` is in {a}, `{}` in {b}", wanted[0]);
                    let help = match *field {
                        "sigma" => "sigma is the standard deviation of the logarithm, a number without a unit".into(),
                        _ => format!("write both in units of the same quantity, for example {b}"),
                    };
                    self.fault(origin, message, help);
                    return None;
                }
            }
        }
        let d = match kind {
            "Uniform" => Distribution::Uniform { from: x[0], to: x[1] },
            "Normal" => Distribution::Normal { mean: x[0], deviation: x[1] },
            "LogNormal" => Distribution::LogNormal { median: x[0], sigma: x[1] },
            _ => {
                Distribution::TruncatedNormal { mean: x[0], deviation: x[1], from: x[2], to: x[3] }
            }
        };
        if let Some((fact, help)) = unsupported(&d) {
            self.fault(origin, format!("{what} {fact}"), help);
            return None;
        }
        Some((d, unit))
    }

    fn choice(&mut self, inner: &Located, origin: Origin, name: &str) -> Option<Distribution> {
        let what = format!("`{name}`: Choice");
        // This is the short form, `Choice(["a", "b"])`.
        let of = match &inner.value {
            Value::List(_) => Some(inner),
            _ => {
                self.fields(inner, &what, &describe::distribution("Choice")());
                inner.get("of")
            }
        };
        let Some(Value::List(items)) = of.map(|v| &v.value) else {
            self.fault(
                origin,
                format!("{what} lacks a list `of`"),
                "write Choice(of: [\"a\", \"b\"])",
            );
            return None;
        };
        if items.is_empty() {
            self.fault(
                origin,
                format!("{what} does not have values to choose from"),
                "write at least one value",
            );
            return None;
        }
        let weights = match inner.get("weights").map(|v| &v.value) {
            None => vec![1.0; items.len()],
            Some(Value::List(list)) => {
                let numbers = list.iter().filter_map(|v| match v.value {
                    Value::Number(x) if x >= 0.0 && x.is_finite() => Some(x),
                    _ => None,
                });
                numbers.collect()
            }
            Some(_) => Vec::new(),
        };
        let sum: f64 = weights.iter().sum();
        if weights.len() != items.len() || !(sum > 0.0) || !sum.is_finite() {
            let message =
                format!("{what}: `weights` must be {} numbers that are not negative", items.len());
            self.fault(
                origin,
                message,
                "write one weight for each value, not negative, and not all zero",
            );
            return None;
        }
        let of = items.iter().map(|i| i.value.clone()).collect();
        Some(Distribution::Choice { of, weights: weights.iter().map(|w| w / sum).collect() })
    }
}

/// Returns whether a word is probably a misspelt distribution.
fn likely(kind: &str) -> bool {
    linkwork_runtime::nearest(kind, KINDS).is_some()
}

fn shown(unit: &str) -> &str {
    if unit.is_empty() { "no unit" } else { unit }
}

/// Converts `x own` to `unit`; `None` if their quantities differ.
pub(crate) fn in_unit(x: f64, own: &str, unit: &str, difference: bool) -> Option<f64> {
    if own == unit {
        return Some(x);
    }
    let parse = |u: &str| if u.is_empty() { Some(Unit::ONE) } else { Unit::parse(u).ok() };
    let (a, b) = (parse(own)?, parse(unit)?);
    if !a.same_quantity(&b) {
        return None;
    }
    Some(match difference {
        true => x * a.scale / b.scale,
        false => (a.to_si(x) - b.offset) / b.scale,
    })
}

/// Returns why nothing can be drawn from a distribution.
fn unsupported(d: &Distribution) -> Option<(String, String)> {
    let told = |fact: String, help: &str| Some((fact, help.to_string()));
    match *d {
        Distribution::Uniform { from, to } if !(from < to && (to - from).is_finite()) => {
            told(format!("runs from {from} to {to}"), "write finite bounds with `from` below `to`")
        }
        Distribution::Normal { mean, deviation }
        | Distribution::TruncatedNormal { mean, deviation, .. }
            if !(deviation > 0.0 && deviation.is_finite() && mean.is_finite()) =>
        {
            told(
                format!("has the mean {mean} and the deviation {deviation}"),
                "write finite numbers and a positive deviation; write constant values in `set`",
            )
        }
        Distribution::TruncatedNormal { mean, deviation, from, to } => {
            if !(from < to) {
                return told(format!("runs from {from} to {to}"), "write `from` below `to`");
            }
            let (alpha, beta) = ((from - mean) / deviation, (to - mean) / deviation);
            let p = Distribution::between(alpha, beta);
            (!(p >= Distribution::LEAST_SUPPORT)).then(|| {
                (
                    format!("is empty: the normal distribution has the probability {p:.1e} between {from} and {to}"),
                    "move the bounds closer to the mean, or use Uniform".to_string(),
                )
            })
        }
        Distribution::LogNormal { median, sigma }
            if !(median > 0.0 && median.is_finite() && sigma > 0.0 && sigma.is_finite()) =>
        {
            told(format!("has the median {median} and sigma {sigma}"), "write positive numbers")
        }
        _ => None,
    }
}

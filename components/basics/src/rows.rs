//! Rows of (time, value) as a parameter: written in place, or from a column of a CSV file.
//! ```text
//! [["0 s", "0 deg"], ["2 s", "30 deg"]]                rows
//! (file: "steering.csv", column: "left front")         time in the first column
//! ```
//! The first line of such a file names its columns, each with its unit in brackets: `time [s], left front [deg]`;
//! without a unit a column is in SI. Lines that begin with `#` say nothing.

use linkwork_runtime::prelude::*;
use linkwork_runtime::{
    Located, Origin, Param, ParamSpec, ReadCx, Unit, Value, remedy, split_quantity,
};

/// Rows (time, value) in SI.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Time (s) and value.
    pub rows: Vec<[f64; 2]>,
    /// Unit of the values as written; `None`: bare numbers.
    pub unit: Option<String>,
}

/// Two rows nearer than this (s) are one instant to the location of events.
const APART: f64 = 1e-6;

impl Rows {
    /// Two rows at least, numbers, times rising.
    ///
    /// # Errors
    /// The first row that is wrong.
    pub fn check(&self) -> Result<(), BuildError> {
        let rows = &self.rows;
        if let Some(k) = rows.iter().position(|r| !r[0].is_finite() || !r[1].is_finite()) {
            let fact = format!("row {} is ({}, {})", k + 1, rows[k][0], rows[k][1]);
            return Err(BuildError::new(fact).help("write finite numbers"));
        }
        if rows.len() < 2 {
            let fact = format!("{} row(s): a profile goes from one row to another", rows.len());
            return Err(BuildError::new(fact).help("write two rows or more"));
        }
        let late = rows.windows(2).position(|w| !(w[1][0] - w[0][0] >= APART));
        if let Some(k) = late {
            let (a, b) = (rows[k][0], rows[k + 1][0]);
            let fact = format!("row {} at {b} s does not come after row {} at {a} s", k + 2, k + 1);
            return Err(BuildError::new(fact).help("sort the rows by time, 1 µs apart at least"));
        }
        Ok(())
    }

    /// That the values are in this unit (`rad`, `m/s`, ..).
    ///
    /// # Errors
    /// When another was written.
    pub fn check_unit(&self, wanted: &str) -> Result<(), BuildError> {
        let given = self.unit.as_deref().unwrap_or(wanted);
        match (Unit::parse(given), Unit::parse(wanted)) {
            (Ok(a), Ok(b)) if a.same_quantity(&b) => Ok(()),
            _ => Err(BuildError::new(format!("the values are in {given}, but {wanted} is wanted"))
                .help(format!("write numbers in {wanted}, or texts such as \"1 {wanted}\""))),
        }
    }

    fn read_rows(items: &[Located], spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Rows> {
        let mut out = Rows::default();
        let mut bare = false;
        for item in items {
            let at = format!("`{}.{}`", cx.path, spec.name);
            let Value::List(pair) = &item.value else {
                let fact = format!("{at}: a row is (time, value), this is {}", item.value.what());
                cx.fault(item.origin, fact, None);
                return None;
            };
            let [time, value] = &pair[..] else {
                let fact = format!("{at}: a row is (time, value), this has {} numbers", pair.len());
                cx.fault(item.origin, fact, None);
                return None;
            };
            let seconds = ParamSpec { unit: Some("s"), range: None, ..spec.clone() };
            let t = cx.number(time, &seconds)?;
            let (y, unit) = quantity(value, spec, cx)?;
            if let (Some(old), Some(new)) = (&out.unit, &unit)
                && let (Ok(a), Ok(b)) = (Unit::parse(old), Unit::parse(new))
                && !a.same_quantity(&b)
            {
                let fact = format!("{at}: one value is in {old}, another in {new}");
                cx.fault(value.origin, fact, Some("write all values in one unit".into()));
                return None;
            }
            bare |= unit.is_none();
            out.unit = out.unit.or(unit);
            out.rows.push([t, y]);
        }
        // Bare numbers are in SI, whatever stands beside them.
        debug_assert!(bare || out.unit.is_some() || out.rows.is_empty());
        Some(out)
    }

    fn read_file(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Rows> {
        let at = format!("`{}.{}`", cx.path, spec.name);
        let Value::Map(entries) = &v.value else { return None };
        let known = ["file", "column"];
        for (key, value) in entries {
            if !known.contains(&key.as_str()) {
                let fact = format!("{at} has no field `{key}`");
                cx.fault(value.origin, fact, Some(remedy(key, "fields", &known)));
                return None;
            }
        }
        let text = |key: &str| match v.get(key).map(|l| (&l.value, l.origin)) {
            Some((Value::Text(t), origin)) => Some((t.clone(), origin)),
            _ => None,
        };
        let Some((name, origin)) = text("file") else {
            cx.fault(
                v.origin,
                format!("{at}: the name of a file is missing"),
                Some("write `file: \"motion.csv\"`".into()),
            );
            return None;
        };
        if v.get("column").is_some() && text("column").is_none() {
            cx.fault(v.origin, format!("{at}: `column` is a text"), None);
            return None;
        }
        let content = cx.text(&name, origin)?;
        match read_csv(&name, &content, text("column").map(|c| c.0).as_deref()) {
            Ok(rows) => Some(rows),
            Err((fact, help)) => {
                let origin = text("column").map_or(origin, |c: (String, Origin)| c.1);
                cx.fault(origin, format!("{at}: {fact}"), Some(help));
                None
            }
        }
    }
}

/// A number, or a text with a unit: the value in SI, and the unit.
fn quantity(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<(f64, Option<String>)> {
    if let Value::Text(text) = &v.value
        && let Some((number, unit_text)) = split_quantity(text)
        && !unit_text.is_empty()
    {
        let at = format!("`{}.{}`", cx.path, spec.name);
        return match Unit::parse(unit_text) {
            Ok(unit) => Some((unit.to_si(number), Some(unit_text.to_string()))),
            Err(e) => {
                cx.fault(v.origin, format!("{at}: {e}"), None);
                None
            }
        };
    }
    let plain = ParamSpec { unit: None, range: None, ..spec.clone() };
    cx.number(v, &plain).map(|y| (y, None))
}

/// Name and unit of a column: `left front [deg]`.
fn heading(text: &str) -> (&str, Option<&str>) {
    match text.split_once('[') {
        Some((name, unit)) => (name.trim(), Some(unit.trim_end().trim_end_matches(']').trim())),
        None => (text.trim(), None),
    }
}

/// Time and one column of a CSV text; the error is a fact with its remedy.
fn read_csv(name: &str, text: &str, column: Option<&str>) -> Result<Rows, (String, String)> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let broken =
        |e: csv::Error| (format!("{name}: {e}"), "write one line for each row".to_string());
    let headings = reader.headers().map_err(broken)?.clone();
    let all: Vec<(&str, Option<&str>)> = headings.iter().map(heading).collect();
    let names: Vec<&str> = all.iter().skip(1).map(|h| h.0).collect();
    let k = match column {
        Some(c) => {
            all.iter().skip(1).position(|h| h.0 == c).map(|k| k + 1).ok_or_else(|| {
                (format!("{name} has no column `{c}`"), remedy(c, "columns", &names))
            })?
        }
        None if all.len() == 2 => 1,
        None => {
            let fact = format!("{name} has {} columns beside the time", names.len());
            return Err((fact, format!("write `column: ..`, one of: {}", names.join(", "))));
        }
    };
    let unit = |k: usize| -> Result<Option<Unit>, (String, String)> {
        let parse =
            |u| Unit::parse(u).map_err(|e| (format!("{name}: {e}"), "write e.g. [deg]".into()));
        all[k].1.map(parse).transpose()
    };
    let (time, value) = (unit(0)?, unit(k)?);
    if let (Some(t), Ok(s)) = (&time, Unit::parse("s"))
        && !t.same_quantity(&s)
    {
        let fact = format!("{name}: the first column, `{}`, is not a time", &headings[0]);
        return Err((fact, "write the time first: `time [s]`".into()));
    }
    let mut out = Rows { rows: Vec::new(), unit: all[k].1.map(String::from) };
    for record in reader.records() {
        let record = record.map_err(broken)?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |k: usize, unit: &Option<Unit>| {
            let text = record.get(k).unwrap_or("");
            let wrong = || {
                let fact = format!("{name}:{line}: `{text}` in column `{}` is no number", all[k].0);
                (fact, "write a number".to_string())
            };
            let y: f64 = text.parse().map_err(|_| wrong())?;
            if y.is_finite() { Ok(unit.map_or(y, |u| u.to_si(y))) } else { Err(wrong()) }
        };
        out.rows.push([number(0, &time)?, number(k, &value)?]);
    }
    Ok(out)
}

impl Param for Rows {
    fn kind() -> String {
        "list of rows (time, value), or (file, column)".into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Rows> {
        match &v.value {
            Value::List(items) => Rows::read_rows(items, spec, cx),
            Value::Map(_) => Rows::read_file(v, spec, cx),
            other => {
                let fact = format!(
                    "`{}.{}` is rows (time, value) or a file, this is {}",
                    cx.path,
                    spec.name,
                    other.what()
                );
                let help = "write [[0, 0], [\"2 s\", 1]] or (file: \"motion.csv\")";
                cx.fault(v.origin, fact, Some(help.into()));
                None
            }
        }
    }
    fn show(&self) -> Value {
        let unit = |y: f64| match &self.unit {
            // In SI the number has all its digits; the unit beside it keeps the quantity.
            Some(u) if Unit::parse(u).is_ok_and(|u| u.scale == 1.0 && u.offset == 0.0) => {
                Value::Text(format!("{y:?} {u}"))
            }
            _ => Value::Number(y),
        };
        let row = |r: &[f64; 2]| Value::List(vec![Value::Number(r[0]).into(), unit(r[1]).into()]);
        Value::List(self.rows.iter().map(|r| row(r).into()).collect())
    }
}

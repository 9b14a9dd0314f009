//! Rows of (time, value) as a parameter: written in place, or from a column of a CSV file.
//! ```text
//! [["0 s", "0 deg"], ["2 s", "30 deg"]]                rows
//! (file: "steering.csv", column: "left front")         time in the first column
//! ```
//! [`linkwork_runtime::columns`] describes how such a file is read.

use linkwork_runtime::columns::Columns;
use linkwork_runtime::prelude::*;
use linkwork_runtime::{Located, Param, ParamSpec, ReadCx, Unit, Value, split_quantity};

/// Rows (time, value) in SI.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Time (s) and value.
    pub rows: Vec<[f64; 2]>,
    /// Unit of the values as written; `None`: numbers without a unit.
    pub unit: Option<String>,
}

/// Rows that are nearer to each other than this (s) count as one instant in the location of events.
const APART: f64 = 1e-6;

impl Rows {
    /// Checks that there are at least two rows, with finite numbers and increasing times.
    ///
    /// # Errors
    /// The first faulty row.
    pub fn check(&self) -> Result<(), BuildError> {
        let rows = &self.rows;
        if let Some(k) = rows.iter().position(|r| !r[0].is_finite() || !r[1].is_finite()) {
            let fact =
                format!("row {} is ({}, {}), which is not finite", k + 1, rows[k][0], rows[k][1]);
            return Err(BuildError::new(fact).help("write finite numbers"));
        }
        if rows.len() < 2 {
            let fact = format!("{} row(s), but a profile needs at least two", rows.len());
            return Err(BuildError::new(fact).help("write at least two rows"));
        }
        let late = rows.windows(2).position(|w| !(w[1][0] - w[0][0] >= APART));
        if let Some(k) = late {
            let (a, b) = (rows[k][0], rows[k + 1][0]);
            let fact = format!("row {} at {b} s does not come after row {} at {a} s", k + 2, k + 1);
            return Err(BuildError::new(fact).help("sort the rows by time, 1 µs apart at least"));
        }
        Ok(())
    }

    /// Returns an error if the values are not compatible with this unit (`rad`, `m/s`, ..).
    ///
    /// # Errors
    /// Another unit was written.
    pub fn check_unit(&self, wanted: &str) -> Result<(), BuildError> {
        let given = self.unit.as_deref().unwrap_or(wanted);
        match (Unit::parse(given), Unit::parse(wanted)) {
            (Ok(a), Ok(b)) if a.same_quantity(&b) => Ok(()),
            _ => Err(BuildError::new(format!(
                "the values are in {given}, which is not compatible with {wanted}"
            ))
            .help(format!("write numbers in {wanted}, or texts such as \"1 {wanted}\""))),
        }
    }

    fn read_rows(items: &[Located], spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Rows> {
        let mut out = Rows::default();
        let mut bare = false;
        for item in items {
            let at = format!("`{}.{}`", cx.path, spec.name);
            let Value::List(pair) = &item.value else {
                let fact =
                    format!("{at}: a row must be (time, value), but this is {}", item.value.what());
                cx.fault(item.origin, fact, None);
                return None;
            };
            let [time, value] = &pair[..] else {
                let fact = format!(
                    "{at}: a row must be (time, value), but this has {} numbers",
                    pair.len()
                );
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
        // Numbers without a unit are in SI, regardless of the units of other values.
        debug_assert!(bare || out.unit.is_some() || out.rows.is_empty());
        Some(out)
    }

    fn read_file(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Rows> {
        let table = Columns::open(v, &["file", "column"], spec, cx)?;
        let at = format!("`{}.{}`", cx.path, spec.name);
        let k = match v.get("column").map(|l| (&l.value, l.origin)) {
            Some((Value::Text(name), origin)) => match table.find(name) {
                Ok(k) => k,
                Err((fact, help)) => {
                    cx.fault(origin, format!("{at}: {fact}"), Some(help));
                    return None;
                }
            },
            Some((_, origin)) => {
                cx.fault(origin, format!("{at}: `column` must be a text"), None);
                return None;
            }
            None if table.headings().len() == 2 => 1,
            None => {
                let names: Vec<&str> = table.headings().skip(1).map(|h| h.0).collect();
                let fact =
                    format!("{at}: the file has {} columns in addition to the time", names.len());
                let help = format!("write `column: ..`, one of: {}", names.join(", "));
                cx.fault(v.origin, fact, Some(help));
                return None;
            }
        };
        let mut out = Rows::default();
        for row in 0..table.lines().len() {
            let pair = vec![table.cell(row, 0, v.origin), table.cell(row, k, v.origin)];
            let item = Located { value: Value::List(pair), origin: v.origin };
            let from = cx.faults.len();
            let read = Rows::read_rows(&[item], spec, cx);
            table.name_line(row, from, cx);
            let read = read?;
            out.rows.extend(read.rows);
            out.unit = out.unit.or(read.unit);
        }
        Some(out)
    }
}

/// Reads a number or a text with a unit; returns the value in SI and the unit.
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

impl Param for Rows {
    fn kind() -> String {
        r#"list of rows (time, value), or (file: "..", column: "..")"#.into()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Rows> {
        match &v.value {
            Value::List(items) => Rows::read_rows(items, spec, cx),
            Value::Map(_) => Rows::read_file(v, spec, cx),
            other => {
                let fact = format!(
                    "`{}.{}` must be rows (time, value) or a file, but it is {}",
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
            // The SI number has all its digits. A column with an SI unit keeps its quantity.
            Some(u) if Unit::parse(u).is_ok_and(|u| u.scale == 1.0 && u.offset == 0.0) => {
                Value::Text(format!("{y:?} {u}"))
            }
            _ => Value::Number(y),
        };
        let row = |r: &[f64; 2]| Value::List(vec![Value::Number(r[0]).into(), unit(r[1]).into()]);
        Value::List(self.rows.iter().map(|r| row(r).into()).collect())
    }
}

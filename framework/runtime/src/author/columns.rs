//! Reading of list parameters from the columns of a CSV file.
//! ```text
//! (file: "drag.csv", column: "CD")                 a list of numbers
//! (file: "drag.csv", columns: ["0 deg", "5 deg"])  a list of rows, one for each line of the file
//! ```
//! The first line names the columns, each with its unit in brackets: `time [s], left front [deg]`; a column without a unit is in SI. Lines that
//! begin with `#` are comments. Columns are separated by commas, semicolons or tabs; if they are not separated by commas, numbers may have a decimal
//! comma. A byte order mark, a line `sep=;` and rows without any content, which spreadsheet programs write, are skipped.

use crate::author::params::{Param, ParamSpec, ReadCx, list};
use crate::author::value::{Located, Origin, Value, remedy};

/// A CSV file with its headings.
#[derive(Debug)]
pub struct Columns {
    file: String,
    /// Name and unit of each column.
    headings: Vec<(String, Option<String>)>,
    /// Line number in the file, and cells of each row.
    records: Vec<(u64, Vec<String>)>,
    decimal_comma: bool,
}

/// Name and unit of a column: `left front [deg]`.
fn heading(text: &str) -> (String, Option<String>) {
    match text.split_once('[') {
        Some((name, unit)) => {
            (name.trim().into(), Some(unit.trim_end().trim_end_matches(']').trim().into()))
        }
        None => (text.trim().into(), None),
    }
}

/// The cells of a CSV text.
#[derive(Clone, Debug, PartialEq)]
pub struct Records {
    /// Cells of the first line.
    pub titles: Vec<String>,
    /// Line number in the text, from 1, and cells of each row. Rows without any content are left out.
    pub rows: Vec<(u64, Vec<String>)>,
    /// Numbers may have a decimal comma, because columns are not separated by commas.
    pub decimal_comma: bool,
}

impl Records {
    /// Reads a text; `comment` begins lines that are skipped. A byte order mark and a first line `sep=;`, both of which spreadsheet programs write,
    /// are skipped.
    ///
    /// # Errors
    /// Rows have different numbers of cells; the error names the line and the remedy.
    pub fn parse(text: &str, comment: Option<u8>) -> Result<Records, String> {
        let whole = text;
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let stated = text.lines().next().and_then(|l| l.trim_end().strip_prefix("sep="));
        let stated = stated.filter(|s| s.len() == 1).and_then(|s| s.bytes().next());
        let text = match stated {
            Some(_) => text.split_once('\n').map_or("", |(_, rest)| rest),
            None => text,
        };
        let separator = stated.unwrap_or_else(|| separator(text, comment));
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(separator)
            .comment(comment)
            .trim(csv::Trim::All)
            .flexible(true)
            .from_reader(text.as_bytes());
        let titles: Vec<String> =
            reader.headers().map_err(|e| e.to_string())?.iter().map(String::from).collect();
        let (mut rows, mut line, mut counted) = (Vec::new(), 1, 0);
        for record in reader.records() {
            let record = record.map_err(|e| e.to_string())?;
            if record.iter().all(str::is_empty) {
                continue;
            }
            // A position may precede the end of the line before, and blank lines.
            let at = whole.len() - text.len() + record.position().map_or(0, |p| p.byte() as usize);
            let begin = |c: char| !c.is_whitespace();
            let at = at + whole.get(at..).and_then(|rest| rest.find(begin)).unwrap_or(0);
            let between = whole.as_bytes().get(counted..at).unwrap_or_default();
            line += between.iter().filter(|c| **c == b'\n').count() as u64;
            counted = at;
            if record.len() != titles.len() {
                let (found, wanted) = (record.len(), titles.len());
                let help = match separator {
                    b',' if found == 2 * wanted => {
                        "; separate columns by semicolons if numbers have a decimal comma"
                    }
                    _ => "",
                };
                return Err(format!("line {line} has {found} cells, not {wanted}{help}"));
            }
            rows.push((line, record.iter().map(String::from).collect()));
        }
        Ok(Records { titles, rows, decimal_comma: separator != b',' })
    }
}

/// Finds the separator of the columns of a text: the first of semicolon, tab and comma that is equally often in the first two lines, or else the one
/// that is in the first line.
fn separator(text: &str, comment: Option<u8>) -> u8 {
    let content =
        |l: &&str| !l.trim().is_empty() && comment.is_none_or(|c| l.as_bytes().first() != Some(&c));
    let mut lines = text.lines().filter(content);
    let (first, second) = (lines.next().unwrap_or(""), lines.next().unwrap_or(""));
    let count = |line: &str, c: u8| line.bytes().filter(|b| *b == c).count();
    let known = [b';', b'\t', b','];
    let both = |c: &&u8| count(first, **c) > 0 && count(first, **c) == count(second, **c);
    let one = |c: &&u8| count(first, **c) > 0;
    let found = known.iter().find(both).or_else(|| known.iter().rev().find(one));
    found.copied().unwrap_or(b',')
}

impl Columns {
    /// Reads a text; the error names the line.
    ///
    /// # Errors
    /// Rows have different lengths, or the text has only headings.
    pub fn parse(file: &str, text: &str) -> Result<Columns, String> {
        let records = Records::parse(text, Some(b'#')).map_err(|e| format!("{file}: {e}"))?;
        let headings = records.titles.iter().map(|t| heading(t)).collect();
        if records.rows.is_empty() {
            return Err(format!("{file} has no rows below its headings"));
        }
        let (records, decimal_comma) = (records.rows, records.decimal_comma);
        Ok(Columns { file: file.into(), headings, records, decimal_comma })
    }

    /// Name and unit of each column.
    pub fn headings(&self) -> impl ExactSizeIterator<Item = (&str, Option<&str>)> {
        self.headings.iter().map(|(name, unit)| (name.as_str(), unit.as_deref()))
    }

    /// Returns the index of a column; the error lists the existing columns.
    ///
    /// # Errors
    /// No column, or more than one, has the name; returns fact and remedy.
    pub fn find(&self, name: &str) -> Result<usize, (String, String)> {
        let mut found = self.headings.iter().enumerate().filter(|(_, h)| h.0 == name);
        match (found.next(), found.next()) {
            (Some((k, _)), None) => Ok(k),
            (Some(_), Some(_)) => Err((
                format!("{} has two columns `{name}`", self.file),
                "rename one of them".to_string(),
            )),
            (None, _) => {
                let names: Vec<&str> = self.headings.iter().map(|h| h.0.as_str()).collect();
                let fact = format!("{} has no column `{name}`", self.file);
                Err((fact, remedy(name, "columns", &names)))
            }
        }
    }

    /// Returns the line numbers of the rows in the file.
    pub fn lines(&self) -> impl ExactSizeIterator<Item = u64> {
        self.records.iter().map(|(line, _)| *line)
    }

    /// Returns the value in row `row` and column `k` as if it were written in the configuration: a number with the unit of its column.
    pub fn cell(&self, row: usize, k: usize, origin: Origin) -> Located {
        let text = self.records[row].1.get(k).map_or("", String::as_str);
        let parsed = text.parse::<f64>().ok();
        let number = match parsed {
            None if self.decimal_comma => text.replacen(',', ".", 1).parse().ok(),
            parsed => parsed,
        };
        // A value that is not finite is written as text, not as a number.
        let value = match (number.filter(|x| x.is_finite()), &self.headings[k].1, text) {
            (Some(x), None, _) => Value::Number(x),
            (Some(x), Some(unit), _) => Value::Text(format!("{x:?} {unit}")),
            (None, _, "true") => Value::Bool(true),
            (None, _, "false") => Value::Bool(false),
            (None, _, text) => Value::Text(text.to_string()),
        };
        Located { value, origin }
    }

    /// Adds `file:line` to the faults from the `from`-th on.
    pub fn name_line(&self, row: usize, from: usize, cx: &mut ReadCx<'_>) {
        for fault in cx.faults.iter_mut().skip(from) {
            fault.message = format!("{}:{}: {}", self.file, self.records[row].0, fault.message);
        }
    }

    /// Opens the file that a map `(file: .., ..)` names; other fields than `known` are faults.
    pub fn open(
        v: &Located,
        known: &[&str],
        spec: &ParamSpec,
        cx: &mut ReadCx<'_>,
    ) -> Option<Columns> {
        let Value::Map(entries) = &v.value else { return None };
        let at = format!("`{}.{}`", cx.path, spec.name);
        for (key, value) in entries {
            if !known.contains(&key.as_str()) {
                let fact = format!("{at} has no field `{key}`");
                cx.fault(value.origin, fact, Some(remedy(key, "fields", known)));
                return None;
            }
        }
        let Some((name, origin)) = text_of(v, "file") else {
            let fact = format!("{at}: the name of a file is missing");
            cx.fault(v.origin, fact, Some("write `file: \"table.csv\"`".into()));
            return None;
        };
        let text = cx.text(&name, origin)?;
        match Columns::parse(&name, &text) {
            Ok(columns) => Some(columns),
            Err(fact) => {
                let help = "write headings in the first line and one line for each row";
                cx.fault(origin, format!("{at}: {fact}"), Some(help.into()));
                None
            }
        }
    }

    /// Returns the columns that a map names: one or several.
    fn wanted(&self, v: &Located, at: &str, cx: &mut ReadCx<'_>) -> Option<(Vec<usize>, bool)> {
        let (names, single): (Vec<(String, Origin)>, bool) =
            match (v.get("column"), v.get("columns")) {
                (Some(_), None) => (vec![text_of(v, "column")?], true),
                (None, Some(Located { value: Value::List(items), .. })) => {
                    let name = |item: &Located| match &item.value {
                        Value::Text(t) => Some((t.clone(), item.origin)),
                        Value::Number(x) => Some((x.to_string(), item.origin)),
                        _ => None,
                    };
                    (items.iter().map(name).collect::<Option<_>>()?, false)
                }
                (None, None) if self.headings.len() == 1 => return Some((vec![0], true)),
                _ => {
                    let names: Vec<&str> = self.headings.iter().map(|h| h.0.as_str()).collect();
                    let help =
                        format!("write `column: ..` or `columns: [..]`, of: {}", names.join(", "));
                    cx.fault(
                        v.origin,
                        format!("{at}: one column or a list of columns is expected"),
                        Some(help),
                    );
                    return None;
                }
            };
        let mut found = Vec::new();
        for (name, origin) in names {
            match self.find(&name) {
                Ok(k) => found.push(k),
                Err((fact, help)) => {
                    cx.fault(origin, format!("{at}: {fact}"), Some(help));
                    return None;
                }
            }
        }
        Some((found, single))
    }
}

/// A text of a map.
fn text_of(v: &Located, key: &str) -> Option<(String, Origin)> {
    match v.get(key).map(|l| (&l.value, l.origin)) {
        Some((Value::Text(t), origin)) => Some((t.clone(), origin)),
        _ => None,
    }
}

impl<T: Param> Param for Vec<T> {
    fn kind() -> String {
        format!("list of {}", T::kind())
    }
    fn fields() -> Vec<ParamSpec> {
        T::fields()
    }
    fn read(v: &Located, spec: &ParamSpec, cx: &mut ReadCx<'_>) -> Option<Vec<T>> {
        if v.get("file").is_some() {
            return read_list(v, spec, cx);
        }
        let items = list(v, spec, cx)?;
        let read: Vec<Option<T>> = items.iter().map(|item| T::read(item, spec, cx)).collect();
        read.into_iter().collect()
    }
    fn show(&self) -> Value {
        Value::List(self.iter().map(|t| t.show().into()).collect())
    }
}

/// A list from a file: `(file: .., column: ..)` or `(file: .., columns: [..])`.
pub(crate) fn read_list<T: Param>(
    v: &Located,
    spec: &ParamSpec,
    cx: &mut ReadCx<'_>,
) -> Option<Vec<T>> {
    let table = Columns::open(v, &["file", "column", "columns"], spec, cx)?;
    let at = format!("`{}.{}`", cx.path, spec.name);
    let before = cx.faults.len();
    let Some((wanted, single)) = table.wanted(v, &at, cx) else {
        if cx.faults.len() == before {
            cx.fault(v.origin, format!("{at}: names of columns must be texts"), None);
        }
        return None;
    };
    let mut out = Vec::with_capacity(table.records.len());
    for row in 0..table.records.len() {
        let mut cells: Vec<Located> =
            wanted.iter().map(|k| table.cell(row, *k, v.origin)).collect();
        let item = match single {
            true => cells.swap_remove(0),
            false => Located { value: Value::List(cells), origin: v.origin },
        };
        let from = cx.faults.len();
        let read = T::read(&item, spec, cx);
        let in_units = wanted.iter().any(|k| table.headings[*k].1.is_some());
        for help in cx.faults.iter_mut().skip(from).filter_map(|f| f.help.as_mut()) {
            if in_units {
                *help += "; the heading of the column has the unit of its numbers";
            }
        }
        table.name_line(row, from, cx);
        // Stop at the first faulty line, because a wrong column would cause an error in every line.
        out.push(read?);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table in the forms in which spreadsheet programs of several countries write it.
    #[test]
    fn a_table_is_the_same_with_every_separator_and_line_end() {
        let plain = "time [s],y\n0.5,-1.25\n2,3e-1\n";
        let german = "time [s];y\n0,5;-1,25\n2;3e-1\n";
        let want = Records::parse(plain, Some(b'#')).unwrap();
        assert_eq!(want.titles, ["time [s]", "y"]);
        assert_eq!(want.rows[1], (3, vec!["2".to_string(), "3e-1".to_string()]));
        for (text, first) in [
            (format!("\u{feff}{plain}"), 2),
            (plain.replace('\n', "\r\n"), 2),
            (plain.replace(',', "\t"), 2),
            (format!("{plain}\n  \n,\n"), 2),
            (format!("# a; b\n{plain}"), 3),
            (german.to_string(), 2),
            (format!("\u{feff}sep=;\r\n{}", german.replace('\n', "\r\n")), 3),
            (format!("{german};\n;\n"), 2),
            // A comma in a title is not a separator.
            (german.replace("time [s]", "time, from launch [s]"), 2),
            (plain.replace("\n0", "\n\n0"), 3),
        ] {
            let found =
                Records::parse(&text, Some(b'#')).unwrap_or_else(|e| panic!("{text:?}: {e}"));
            assert_eq!(found.rows.len(), 2, "{text:?}");
            assert_eq!(found.rows[0].0, first, "{text:?}");
            let table = Columns::parse("t.csv", &text).unwrap();
            let cell = |row, k| match table.cell(row, k, Origin::NONE).value {
                Value::Number(x) => x,
                Value::Text(t) => t.trim_end_matches(" s").parse().unwrap(),
                other => panic!("{other:?}"),
            };
            assert_eq!(
                [cell(0, 0), cell(0, 1), cell(1, 0), cell(1, 1)],
                [0.5, -1.25, 2.0, 0.3],
                "{text:?}"
            );
        }
    }

    #[test]
    fn a_decimal_comma_between_commas_is_named_with_its_line() {
        let e = Columns::parse("t.csv", "a,b\r\n1,2\r\n0,5,1,5\r\n").unwrap_err();
        assert!(e.contains("line 3 has 4 cells, not 2") && e.contains("semicolons"), "{e}");
    }
}

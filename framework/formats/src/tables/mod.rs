//! Elements and attributes in the specifications of the formats, with their status.
//!
//! The tables are text files in this folder, in the form described in `mjcf.txt`. The readers mark each element and attribute that they read. The
//! others are listed, and names that are not in the table are reported as not part of the format. Tests compare every line of the tables with the
//! readers.

#[cfg(test)]
mod tests;

use crate::Format;
use crate::xml::{Element, Names};
use linkwork_names::suggest;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// Status of an element or attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Status {
    /// Read, with its meaning in the format.
    Equal,
    /// Rejected with a message.
    Rejected,
    /// Ignored with a warning.
    Ignored,
}

/// A line of a table.
#[derive(Clone, Debug)]
pub(crate) struct Row {
    /// Status of the element itself.
    pub status: Status,
    /// Whether the contents are treated like the element.
    pub whole: bool,
    /// Status of each attribute, with a value for the test.
    pub attributes: BTreeMap<String, (Status, Option<String>)>,
}

/// A table: rows by `parent/element`.
pub(crate) struct Table {
    pub rows: BTreeMap<String, Row>,
    /// Elements with the same contents as another.
    alias: fn(&str) -> &str,
}

static MJCF: LazyLock<Table> = LazyLock::new(|| {
    Table::read(include_str!("mjcf.txt"), |name| match name {
        "worldbody" | "frame" | "replicate" | "mujocoinclude" => {
            if name == "mujocoinclude" {
                "mujoco"
            } else {
                "body"
            }
        }
        other => other,
    })
});
static URDF: LazyLock<Table> = LazyLock::new(|| Table::read(include_str!("urdf.txt"), |n| n));
static SDF: LazyLock<Table> = LazyLock::new(|| Table::read(include_str!("sdf.txt"), |n| n));

/// Returns the table of a format.
pub(crate) fn of(format: Format) -> &'static Table {
    match format {
        Format::Urdf => &URDF,
        Format::Mjcf => &MJCF,
        Format::Sdf => &SDF,
    }
}

impl Table {
    fn read(text: &str, alias: fn(&str) -> &str) -> Self {
        let lines = text.lines().filter(|l| !l.starts_with('#') && !l.trim().is_empty());
        let rows = lines.map(row).collect();
        Self { rows, alias }
    }

    /// Returns the row of an element inside another.
    pub fn row(&self, parent: Option<&str>, element: &str) -> Option<&Row> {
        match parent {
            Some(parent) => self.rows.get(&format!("{}/{element}", (self.alias)(parent))),
            None => self.rows.get((self.alias)(element)),
        }
    }
}

impl Names for Table {
    /// The note has the nearest name.
    fn strange_element(&self, parent: &Element, element: &str) -> Option<String> {
        // Names with a prefix are extensions of other programs, which formats permit.
        if element.contains(':') || self.row(Some(&parent.name), element).is_some() {
            return None;
        }
        let inside = format!("{}/", (self.alias)(&parent.name));
        let known = self.rows.keys().filter_map(|k| k.strip_prefix(inside.as_str()));
        let near = suggest(element, "element", known.clone());
        let near =
            if near.starts_with("did you mean") { format!("; {near}") } else { String::new() };
        // If the table does not have a line for the parent, it has none for its elements either.
        (known.count() > 0).then(|| format!("is not part of the format{near}"))
    }

    fn strange_attribute(&self, parent: Option<&str>, element: &str, name: &str) -> Option<String> {
        let row = self.row(parent, element)?;
        if name.contains(':')
            || name.starts_with("xmlns")
            || row.whole
            || row.attributes.contains_key(name)
        {
            return None;
        }
        let near = suggest(name, "attribute", row.attributes.keys().map(String::as_str));
        let near =
            if near.starts_with("did you mean") { format!("; {near}") } else { String::new() };
        Some(format!("is not part of the format{near}"))
    }
}

/// `parent/element = a="1" b - c d`.
fn row(line: &str) -> (String, Row) {
    let (key, rest) = line.split_once(' ').unwrap_or((line, ""));
    let mut row = Row { status: Status::Equal, whole: false, attributes: BTreeMap::new() };
    let mut status = Status::Equal;
    for word in pieces(rest) {
        match word {
            "=" => status = Status::Equal,
            "!" => status = Status::Rejected,
            "-" => status = Status::Ignored,
            "-*" => (row.status, row.whole) = (Status::Ignored, true),
            "!*" => (row.status, row.whole) = (Status::Rejected, true),
            attribute => {
                let (name, value) = match attribute.split_once('=') {
                    Some((name, value)) => (name, Some(value.trim_matches('"').to_owned())),
                    None => (attribute, None),
                };
                row.attributes.insert(name.to_owned(), (status, value));
            }
        }
    }
    (key.to_owned(), row)
}

/// Words of a line; a quoted value with spaces belongs to its word.
fn pieces(line: &str) -> Vec<&str> {
    let (mut out, mut start, mut quoted) = (Vec::new(), 0, false);
    for (at, c) in line.char_indices().chain([(line.len(), ' ')]) {
        quoted ^= c == '"';
        if c == ' ' && !quoted {
            out.extend(line.get(start..at).filter(|w| !w.is_empty()));
            start = at + 1;
        }
    }
    out
}

//! RON text to located values: every piece knows its bytes, keys are unique, variants keep names.
//!
//! `ron` checks the grammar and cuts the text into raw pieces; the place of a piece is where its
//! slice lies in the text.
use crate::text::parsed::Once;
use crate::text::pieces::{KEY, Key, Piece, Pieces};
use crate::text::quick;
use crate::text::report::Cx;
use linkwork_runtime::{Located, Origin, Value};
use ron::Deserializer;
use ron::value::RawValue;
use serde::de;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// Reads a whole text; on a mistake records it and gives `None`. A text that another load has read at the same place
/// among its sources is not read again.
pub(crate) fn parse(cx: &mut Cx, file: u32) -> Option<Located> {
    match parse_once(cx, file) {
        Some(once) => Some(once.value.clone()),
        None => read(cx, file),
    }
}

/// The same, shared with other loads; `None` when nothing is shared, or the text has mistakes.
pub(crate) fn parse_once(cx: &mut Cx, file: u32) -> Option<Arc<Once>> {
    if let Some((_, once)) = cx.shared.iter().find(|(known, _)| *known == file) {
        return Some(once.clone());
    }
    let parsed = cx.parsed.clone()?;
    let (name, text) = cx.sources.files.get(file as usize)?;
    let once = match parsed.get(name, file, text) {
        Some(once) => once,
        None => {
            let (name, text) = (name.clone(), text.clone());
            let (faults, others) = (cx.faults.len(), std::mem::take(&mut cx.keys));
            let value = read(cx, file);
            let keys = std::mem::replace(&mut cx.keys, others);
            let Some(value) = value.filter(|_| cx.faults.len() == faults) else {
                // It is read again, and told, by whoever asks without sharing.
                cx.faults.truncate(faults);
                return None;
            };
            let once = Arc::new(Once { text, value, keys, form: OnceLock::new() });
            parsed.keep(name, file, once.clone());
            once
        }
    };
    cx.shared.push((file, once.clone()));
    Some(once)
}

fn read(cx: &mut Cx, file: u32) -> Option<Located> {
    let text = &cx.sources.files.get(file as usize)?.1;
    if let Some((value, keys)) = quick::read(text, file) {
        if cx.keys.is_empty() {
            // All at once: they need no place one by one.
            cx.keys = keys.into_iter().collect();
        } else {
            cx.keys.extend(keys);
        }
        return Some(value);
    }
    read_pieces(cx, file)
}

/// The same, of every text that is RON, with faults where it is not.
pub(crate) fn read_pieces(cx: &mut Cx, file: u32) -> Option<Located> {
    let text = cx.sources.files.get(file as usize)?.1.clone();
    if let Err(error) = ron::from_str::<&RawValue>(&text) {
        let at = offset(&text, error.span.start.line, error.span.start.col);
        let end = at + text[at..].chars().next().map_or(0, char::len_utf8);
        let origin = Origin::in_file(file, at as u32, end as u32);
        let message = format!("not RON: {}", lower(&error.code.to_string()));
        let help = match (&error.code, unclosed(&text)) {
            (ron::Error::ExpectedStringEnd, _) => {
                "close the text that starts here with `\"`".into()
            }
            (_, Some((open, at))) => {
                let here = Origin::in_file(file, at as u32, at as u32 + 1);
                format!("the `{open}` at {} is never closed", cx.place(here))
            }
            (ron::Error::Eof, _) => "begin the file with `Simulation(` or `Assembly(`".into(),
            (ron::Error::ExpectedComma, _) => {
                "put a comma before this; a quantity with a unit stands in quotes: \"1 ms\"".into()
            }
            _ => "look for a missing comma, quote or bracket just before this place".into(),
        };
        cx.fault(origin, message, help);
        return None;
    }
    let mut reader = Reader { cx, text: &text, file };
    reader.value(&text)
}

fn lower(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or(String::new(), |c| c.to_lowercase().chain(chars).collect())
}

fn offset(text: &str, line: usize, column: usize) -> usize {
    let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    let rest = &text[start..];
    let skip: usize = rest.chars().take(column.saturating_sub(1)).map(char::len_utf8).sum();
    (start + skip).min(text.len())
}

/// Length of leading whitespace and comments.
fn blank(text: &str) -> usize {
    let mut at = 0;
    loop {
        let rest = &text[at..];
        let trimmed = rest.trim_start();
        at += rest.len() - trimmed.len();
        if trimmed.starts_with("//") {
            at += trimmed.find('\n').unwrap_or(trimmed.len());
        } else if trimmed.starts_with("/*") {
            at += block_comment(trimmed);
        } else {
            return at;
        }
    }
}

fn block_comment(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        if text[at..].starts_with("/*") {
            depth += 1;
            at += 2;
        } else if text[at..].starts_with("*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            at += text[at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    text.len()
}

/// The innermost bracket that is never closed, and its byte.
fn unclosed(text: &str) -> Option<(char, usize)> {
    let mut open: Vec<(char, usize)> = Vec::new();
    let mut at = 0;
    while at < text.len() {
        at += blank(&text[at..]);
        let Some(c) = text[at..].chars().next() else { break };
        match c {
            '(' | '[' | '{' => open.push((c, at)),
            ')' | ']' | '}' => {
                let (o, place) = open.pop()?;
                if !matches!((o, c), ('(', ')') | ('[', ']') | ('{', '}')) {
                    return Some((o, place));
                }
            }
            '"' => {
                let mut escaped = false;
                let close = text[at + 1..].char_indices().find(|&(_, c)| {
                    let end = c == '"' && !escaped;
                    escaped = c == '\\' && !escaped;
                    end
                });
                at += 1 + close.map(|(k, _)| k)?;
            }
            _ => {}
        }
        at += c.len_utf8().min(text.len() - at);
    }
    open.pop()
}

struct Reader<'c, 't> {
    cx: &'c mut Cx,
    text: &'t str,
    file: u32,
}

impl<'t> Reader<'_, 't> {
    /// Bytes of a slice of the text.
    fn origin(&self, piece: &str) -> Origin {
        let start = piece.as_ptr() as usize - self.text.as_ptr() as usize;
        Origin::in_file(self.file, start as u32, (start + piece.len()) as u32)
    }

    fn value(&mut self, raw: &'t str) -> Option<Located> {
        let raw = &raw[blank(raw)..];
        let word = raw.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(raw.len());
        let starts = raw.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let plain = ["true", "false", "None", "inf", "NaN", "inff64", "NaNf64"];
        let quoted = raw[word..].starts_with(['"', '#', '\'']);
        if starts && !quoted && !plain.contains(&&raw[..word]) {
            return self.variant(raw, word);
        }
        let mut de = Deserializer::from_str(raw).map_err(|e| self.refuse(raw, &e.code)).ok()?;
        let piece = match de::Deserializer::deserialize_any(&mut de, Pieces) {
            Ok(piece) => piece,
            Err(e) => {
                self.refuse(raw, &e);
                return None;
            }
        };
        let origin = self.origin(raw[..raw.len() - de.remainder().len()].trim_end());
        let value = match piece {
            Piece::Value(value) => value,
            Piece::List(items) => {
                let items: Vec<Option<Located>> =
                    items.into_iter().map(|item| self.value(item)).collect();
                Value::List(items.into_iter().collect::<Option<_>>()?)
            }
            Piece::Map(entries) => Value::Map(self.entries(entries)?),
        };
        Some(Located { value, origin })
    }

    fn entries(&mut self, raw: Vec<(Key<'t>, &'t str)>) -> Option<Vec<(String, Located)>> {
        let mut out: Vec<(String, Located)> = Vec::with_capacity(raw.len());
        let mut seen: BTreeMap<String, Origin> = BTreeMap::new();
        let mut whole = true;
        for (key, piece) in raw {
            let value = self.value(piece);
            let fallback = value.as_ref().map_or(self.origin(piece), |v| v.origin);
            let (name, place) = match key {
                Key::Borrowed(k) => (k.to_string(), self.origin(k)),
                Key::Owned(k) => (k, fallback),
            };
            if let Some(first) = seen.get(&name) {
                let message = format!("`{name}` is written twice");
                let help =
                    format!("keep one of the two; the first is at {}", self.cx.place(*first));
                self.cx.fault(place, message, help);
                whole = false;
            }
            match value {
                Some(v) => {
                    self.cx.keys.insert(v.origin, place);
                    seen.entry(name.clone()).or_insert(place);
                    out.push((name, v));
                }
                None => whole = false,
            }
        }
        whole.then_some(out)
    }

    fn variant(&mut self, raw: &'t str, word: usize) -> Option<Located> {
        let (name, rest) = raw.split_at(word);
        let inner = &rest[blank(rest)..];
        if !inner.starts_with('(') {
            let value = Value::Variant(name.into(), Box::new(Value::Null.into()));
            return Some(Located { value, origin: self.origin(name) });
        }
        let mut content = self.value(inner)?;
        let end = content.origin.end;
        let origin = Origin { end, ..self.origin(name) };
        if let Value::List(items) = &mut content.value {
            // `Name(x)` holds x itself; `Name()` holds nothing.
            match items.len() {
                0 => content.value = Value::Null,
                1 => content = items.remove(0),
                _ => {}
            }
        }
        let value = match name {
            "Some" => return Some(content),
            _ => Value::Variant(name.into(), Box::new(content)),
        };
        Some(Located { value, origin })
    }

    fn refuse(&mut self, raw: &str, error: &ron::Error) {
        let text = error.to_string();
        let whole = self.origin(raw);
        let origin = Origin { end: whole.end.min(whole.start + 1), ..whole };
        if text.contains(KEY) {
            let help = "write { \"name\": .. } or (name: ..)";
            self.cx.fault(origin, "the keys of `{ .. }` are texts in quotes", help);
        } else {
            self.cx.fault(origin, format!("not RON: {}", lower(&text)), "");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> (Option<Located>, Cx) {
        let mut cx = Cx::default();
        let file = cx.sources.add("t", text);
        let value = parse(&mut cx, file);
        (value, cx)
    }

    #[test]
    fn every_kind_of_value() {
        let text = r##"A(
            // a comment
            n: -1.5e3, hex: 0x10, big: 1_000, no: None, yes: Some(true), unit: (), pair: (1, "a"),
            raw: r#"q"q"#, escaped: "tab\t\"é", free: Free, pin: Pin([0, 1]), box: Box(a: 1), inf: inf,
            nested: { "k": /* inner */ [ /* lead */ Deep(Deeper(1, 2)), ] }, "trailing": 2 /* end */ ,
        )"##;
        let text = text.replace("\"trailing\"", "trailing");
        let (value, cx) = of(&text);
        let value = value.unwrap_or_else(|| panic!("{:?}", cx.faults));
        let shown = value.value.to_string();
        let expected = concat!(
            r#"A({"n": -1500.0, "hex": 16.0, "big": 1000.0, "no": None, "yes": true, "unit": None, "#,
            r#""pair": [1.0, "a"], "raw": "q\"q", "escaped": "tab\t\"é", "free": Free, "#,
            r#""pin": Pin([0.0, 1.0]), "box": Box({"a": 1.0}), "inf": inf, "#,
            r#""nested": {"k": [Deep(Deeper([1.0, 2.0]))]}, "trailing": 2.0})"#
        );
        assert_eq!(shown, expected);
        // Printed, it reads back the same.
        assert_eq!(of(&shown).0.unwrap().value.to_string(), shown);
    }

    #[test]
    fn places_are_those_of_the_pieces() {
        let text = "A(\n  // é\n  b: { \"c\": [1, Pin([0, 1]) , \"x\"] },\n)";
        let (value, cx) = of(text);
        let Value::Variant(_, inner) = value.unwrap().value else { panic!() };
        let c = inner.get("b").unwrap().get("c").unwrap();
        let slice = |o: Origin| &text[o.start as usize..o.end as usize];
        assert_eq!(slice(c.origin), "[1, Pin([0, 1]) , \"x\"]");
        let Value::List(items) = &c.value else { panic!() };
        assert_eq!(slice(items[1].origin), "Pin([0, 1])");
        assert_eq!(slice(items[2].origin), "\"x\"");
        assert_eq!(slice(cx.key(c)), "c");
        assert_eq!(cx.place(items[2].origin), "t:3:31");
    }
}

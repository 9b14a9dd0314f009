//! Converts RON text to located values: each value has its byte range, keys are unique, and variants keep their names.
//!
//! If the [`Reader`] stops at an error, `ron` reads the text again, so that the message is that of the RON library.
use crate::text::parsed::Once;
use crate::text::reader::{Reader, Stop, blank};
use crate::text::report::Cx;
use crate::text::scalar::lower;
use linkwork_runtime::{Located, Origin};
use ron::value::RawValue;
use std::sync::{Arc, OnceLock};

/// Parses a whole text; after a mistake adds a fault and returns `None`. A text that another load has parsed at the same index of its sources is
/// reused.
pub(crate) fn parse(cx: &mut Cx, file: u32) -> Option<Located> {
    match parse_once(cx, file) {
        Some(once) => Some(once.value.clone()),
        None => read(cx, file),
    }
}

/// Parses a text for several loads; `None` if there is no shared cache, or the text has mistakes.
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
                // Discard the faults: the caller reads the text again without sharing and reports
                // them then.
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

/// Reads a text and adds the places of its keys, or faults, to `cx`.
fn read(cx: &mut Cx, file: u32) -> Option<Located> {
    let text = cx.sources.files.get(file as usize)?.1.clone();
    let mut reader = Reader::new(&text, file);
    let value = reader.whole();
    let Reader { keys, twice, .. } = reader;
    let value = match value {
        Ok(value) => value,
        Err(stop) => {
            not_read(cx, file, &text, stop);
            return None;
        }
    };
    for (name, place, first) in &twice {
        let help = format!("keep one of the two; the first is at {}", cx.place(*first));
        cx.fault(*place, format!("`{name}` is written twice"), help);
    }
    if cx.keys.is_empty() {
        // Build the map from all keys at once, which is faster than inserting them one by one.
        cx.keys = keys.into_iter().collect();
    } else {
        cx.keys.extend(keys);
    }
    twice.is_empty().then_some(value)
}

/// Reports why a text cannot be read: the message of `ron`, or, if the text is valid RON, the reason for which the reader stopped.
fn not_read(cx: &mut Cx, file: u32, text: &str, stop: Stop) {
    let at = |start: usize| {
        let end = start + text[start..].chars().next().map_or(0, char::len_utf8);
        Origin::in_file(file, start as u32, end as u32)
    };
    let Err(error) = ron::from_str::<&RawValue>(text) else {
        cx.fault(at(stop.at.min(text.len())), stop.fact, stop.help);
        return;
    };
    let message = format!("not RON: {}", lower(&error.code.to_string()));
    let help = match (&error.code, unclosed(text)) {
        (ron::Error::ExpectedStringEnd, _) => "close the text that starts here with `\"`".into(),
        (_, Some((open, place))) => {
            format!("the `{open}` at {} is never closed", cx.place(at(place)))
        }
        (ron::Error::Eof, _) => "begin the file with `Simulation(` or `Assembly(`".into(),
        (ron::Error::ExpectedComma, _) => {
            "put a comma before this; write a quantity with a unit in quotes: \"1 ms\"".into()
        }
        _ => "check for a missing comma, quote or bracket just before this position".into(),
    };
    let start = offset(text, error.span.start.line, error.span.start.col);
    cx.fault(at(start), message, help);
}

fn offset(text: &str, line: usize, column: usize) -> usize {
    let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    let rest = &text[start..];
    let skip: usize = rest.chars().take(column.saturating_sub(1)).map(char::len_utf8).sum();
    (start + skip).min(text.len())
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

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_runtime::Value;

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
        // The printed text reads back the same.
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

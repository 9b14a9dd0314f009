//! The reader of the notation: one pass over the text, in which every value gets the place of its bytes.
//!
//! It accepts the part of RON that files of Linkwork use: no attributes (`#![enable(..)]`) and no raw names (`r#name`). Tokens with
//! escapes, bases or suffixes are read by `ron`.
use crate::text::scalar::{lower, scalar};
use linkwork_runtime::{Located, Origin, Value};
use std::collections::BTreeMap;

/// Greatest number of brackets inside each other; `ron` rejects more than 128.
const DEPTH: usize = 100;

/// Longer maps look for keys that are written twice in an index.
const FEW: usize = 16;

/// White space of RON (Unicode's `Pattern_White_Space`).
const WHITE_SPACE: [char; 11] = [
    ' ', '\t', '\n', '\r', '\u{b}', '\u{c}', '\u{85}', '\u{200e}', '\u{200f}', '\u{2028}',
    '\u{2029}',
];

/// Length of leading white space and comments; a comment that does not end is not part of it.
pub(super) fn blank(text: &str) -> usize {
    let mut at = 0;
    loop {
        let rest = &text[at..];
        // Skip white space of one byte first, because nearly all white space is of this kind.
        let spaces = rest.bytes().take_while(|c| matches!(c, b' ' | b'\n' | b'\r' | b'\t')).count();
        let rest = &rest[spaces..];
        at += spaces;
        match rest.as_bytes() {
            [b'/', b'/', ..] => at += rest.find('\n').unwrap_or(rest.len()),
            [b'/', b'*', ..] => match block_comment(rest) {
                Some(length) => at += length,
                None => return at,
            },
            _ => {
                let more = rest.len() - rest.trim_start_matches(WHITE_SPACE).len();
                if more == 0 {
                    return at;
                }
                at += more;
            }
        }
    }
}

/// Length of a comment in `/*` and `*/`, which may hold others; `None` when it does not end.
fn block_comment(text: &str) -> Option<usize> {
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        if text[at..].starts_with("/*") {
            depth += 1;
            at += 2;
        } else if text[at..].starts_with("*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return Some(at);
            }
        } else {
            at += text[at..].chars().next().map_or(1, char::len_utf8);
        }
    }
    None
}

/// Where and why the reader stopped.
pub(super) struct Stop {
    pub at: usize,
    pub fact: String,
    pub help: &'static str,
}

pub(super) type Read<T> = Result<T, Stop>;

pub(super) struct Reader<'t> {
    text: &'t str,
    file: u32,
    /// The next byte.
    at: usize,
    /// Brackets that are open.
    depth: usize,
    /// Origin of each value in a map, and that of its key.
    pub keys: Vec<(Origin, Origin)>,
    /// Keys that are written again in one map: name, place, place of the first.
    pub twice: Vec<(String, Origin, Origin)>,
}

impl<'t> Reader<'t> {
    pub fn new(text: &'t str, file: u32) -> Self {
        Reader { text, file, at: 0, depth: 0, keys: Vec::new(), twice: Vec::new() }
    }

    /// Reads the whole text.
    pub fn whole(&mut self) -> Read<Located> {
        let value = self.value()?;
        self.blank();
        match self.at == self.text.len() {
            true => Ok(value),
            false => Err(self.stop("text after the end of the value", "remove it")),
        }
    }

    fn stop(&self, fact: impl Into<String>, help: &'static str) -> Stop {
        Stop { at: self.at, fact: fact.into(), help }
    }

    fn next(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn origin(&self, start: usize) -> Origin {
        Origin::in_file(self.file, start as u32, self.at as u32)
    }

    /// Moves over a character if it is the next one.
    fn is(&mut self, c: u8) -> bool {
        let found = self.next() == Some(c);
        self.at += usize::from(found);
        found
    }

    /// Moves over a character that must be there.
    fn expect(&mut self, c: u8) -> Read<()> {
        if self.is(c) {
            return Ok(());
        }
        Err(self.stop(format!("expected `{}`", char::from(c)), ""))
    }

    /// Moves over the bytes of a kind; returns them.
    fn skip(&mut self, of: impl Fn(u8) -> bool) -> &'t str {
        let start = self.at;
        let rest = self.text.as_bytes().get(start..).unwrap_or_default();
        self.at += rest.iter().position(|c| !of(*c)).unwrap_or(rest.len());
        self.text.get(start..self.at).unwrap_or_default()
    }

    /// Moves over a name; returns it.
    fn name(&mut self) -> &'t str {
        let start = self.at;
        self.skip(|c| c.is_ascii_alphanumeric() || c == b'_');
        if self.next().is_some_and(|c| !c.is_ascii()) {
            let rest = &self.text[self.at..];
            let more = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'));
            self.at += more.unwrap_or(rest.len());
        }
        &self.text[start..self.at]
    }

    fn blank(&mut self) {
        self.at += blank(&self.text[self.at..]);
    }

    fn value(&mut self) -> Read<Located> {
        self.blank();
        let start = self.at;
        let value = match self.next() {
            Some(b'"') => self.quoted()?,
            Some(b'[') => Value::List(self.items(b']')?),
            Some(b'{') => self.map(b'}')?,
            Some(b'(') => self.brackets()?,
            Some(b'\'') => self.character()?,
            Some(b'#') => {
                let help = "remove it: files of Linkwork need no extensions of RON";
                return Err(self.stop("attributes are not read", help));
            }
            Some(c) if c.is_ascii_alphabetic() || c == b'_' || !c.is_ascii() => return self.word(),
            _ => self.number()?,
        };
        Ok(Located { value, origin: self.origin(start) })
    }

    /// The value of the token from `start` to here.
    fn token(&mut self, start: usize) -> Read<Value> {
        let token = &self.text[start..self.at];
        scalar(token).map_err(|error| Stop {
            at: start,
            fact: format!("not RON: {}", lower(&error)),
            help: "",
        })
    }

    fn quoted(&mut self) -> Read<Value> {
        let start = self.at;
        self.at += 1;
        loop {
            self.skip(|c| c != b'"' && c != b'\\');
            match self.next() {
                Some(b'"') => break,
                Some(_) => self.at += 2,
                None => return Err(self.stop("a text is never closed", "close it with `\"`")),
            }
        }
        self.at += 1;
        match self.text.get(start + 1..self.at - 1) {
            Some(inner) if !inner.contains('\\') => Ok(Value::Text(inner.to_owned())),
            _ => self.token(start),
        }
    }

    /// A text without escapes: `r"..."`, `r#"..."#`. The `r` is read.
    fn raw(&mut self, start: usize) -> Read<Value> {
        let hashes = self.skip(|c| c == b'#').len();
        let end = format!("\"{}", "#".repeat(hashes));
        let rest = &self.text[self.at..];
        let close = rest.get(1..).and_then(|inner| inner.find(&end));
        match close {
            Some(close) if rest.starts_with('"') => {
                self.at += 1 + close + end.len();
                self.token(start)
            }
            _ => Err(self.stop("expected a text in quotes", "write names without `r#`")),
        }
    }

    fn character(&mut self) -> Read<Value> {
        let start = self.at;
        let inner = self.text[start + 1..].char_indices();
        let close = inner.skip(1).find(|(_, c)| *c == '\'');
        match close {
            Some((k, _)) => {
                self.at += k + 2;
                self.token(start)
            }
            None => Err(self.stop("a character is never closed", "close it with `'`")),
        }
    }

    fn number(&mut self) -> Read<Value> {
        let start = self.at;
        let digits = self.skip(|c| matches!(c, b'0'..=b'9' | b'-' | b'+' | b'.' | b'e' | b'E'));
        let whole = digits.bytes().all(|c| c.is_ascii_digit()) && (1..16).contains(&digits.len());
        let ends = self.next().is_none_or(|c| b",)]}/ \n\r\t".contains(&c));
        let fraction = digits.contains('.') && !digits.contains("..");
        if ends
            && (whole || fraction)
            && let Ok(number) = digits.parse()
        {
            return Ok(Value::Number(number));
        }
        // A number may have a sign, another base or a suffix.
        self.skip(|c| c.is_ascii_alphanumeric() || b"_+-.".contains(&c));
        if self.at == start {
            return Err(self.stop("expected a value", ""));
        }
        self.token(start)
    }

    /// Reads a name: that of a variant, or a word that is a value itself.
    fn word(&mut self) -> Read<Located> {
        let start = self.at;
        let name = self.name();
        let value = match (name, self.next()) {
            ("r" | "br", Some(b'"' | b'#')) | ("b", Some(b'"' | b'\'')) => self.raw(start)?,
            ("true", _) => Value::Bool(true),
            ("false", _) => Value::Bool(false),
            ("None", _) => Value::Null,
            ("inf" | "NaN" | "inff64" | "NaNf64", _) => self.token(start)?,
            ("Some", _) => return self.option(),
            ("", _) => return Err(self.stop("expected a value", "")),
            _ => return self.variant(start, name),
        };
        Ok(Located { value, origin: self.origin(start) })
    }

    /// The value of `Some(x)`: x.
    fn option(&mut self) -> Read<Located> {
        self.blank();
        let help = "write the value without `Some`";
        if self.next() != Some(b'(') {
            return Err(self.stop("`Some` without a value", help));
        }
        let items: Result<[Located; 1], _> = self.items(b')')?.try_into();
        items.map(|[item]| item).map_err(|_| self.stop("`Some` holds one value", help))
    }

    fn variant(&mut self, start: usize, name: &str) -> Read<Located> {
        let end = self.at;
        self.blank();
        if self.next() != Some(b'(') {
            self.at = end;
            let value = Value::Variant(name.to_owned(), Box::new(Value::Null.into()));
            return Ok(Located { value, origin: self.origin(start) });
        }
        let open = self.at;
        let value = self.brackets()?;
        let mut content = Located { value, origin: self.origin(open) };
        if let Value::List(items) = &mut content.value {
            // `Name(x)` contains x itself, and `Name()` contains no value.
            match items.len() {
                0 => content.value = Value::Null,
                1 => content = items.remove(0),
                _ => {}
            }
        }
        let value = Value::Variant(name.to_owned(), Box::new(content));
        Ok(Located { value, origin: self.origin(start) })
    }

    /// `(..)`: fields when the first thing is a name with a colon, else a list.
    fn brackets(&mut self) -> Read<Value> {
        let open = self.at;
        self.at += 1;
        if self.is(b')') {
            return Ok(Value::Null);
        }
        self.blank();
        let name = self.name();
        self.blank();
        let named = !name.is_empty() && self.next() == Some(b':');
        self.at = open;
        if named { self.map(b')') } else { self.items(b')').map(Value::List) }
    }

    /// Moves over the opening bracket, one thing after another, and the closing bracket.
    fn each(&mut self, close: u8, mut one: impl FnMut(&mut Self) -> Read<()>) -> Read<()> {
        self.at += 1;
        self.depth += 1;
        if self.depth > DEPTH {
            let fact = format!("more than {DEPTH} brackets inside each other");
            return Err(self.stop(fact, "move the inner parts to a file of their own"));
        }
        loop {
            self.blank();
            if self.is(close) {
                break;
            }
            one(self)?;
            self.blank();
            if !self.is(b',') {
                self.expect(close)?;
                break;
            }
        }
        self.depth -= 1;
        Ok(())
    }

    fn items(&mut self, close: u8) -> Read<Vec<Located>> {
        let mut items = Vec::new();
        self.each(close, |reader| {
            items.push(reader.value()?);
            Ok(())
        })?;
        Ok(items)
    }

    /// Texts in quotes are the keys of `{..}`, names those of `(..)`.
    fn map(&mut self, close: u8) -> Read<Value> {
        let mut entries: Vec<(String, Located)> = Vec::new();
        let mut places: Vec<Origin> = Vec::new();
        self.each(close, |reader| {
            let (key, place) = if close == b'}' { reader.text_key()? } else { reader.field()? };
            reader.blank();
            reader.expect(b':')?;
            let value = reader.value()?;
            reader.keys.push((value.origin, place));
            places.push(place);
            entries.push((key, value));
            Ok(())
        })?;
        self.note_twice(&entries, &places);
        Ok(Value::Map(entries))
    }

    fn text_key(&mut self) -> Read<(String, Origin)> {
        let start = self.at;
        let word = self.next().is_some_and(|c| c == b'r');
        if self.next() != Some(b'"') && !word {
            let help = "write { \"name\": .. } or (name: ..)";
            return Err(self.stop("the keys of `{ .. }` must be texts in quotes", help));
        }
        let value = if word { self.word()?.value } else { self.quoted()? };
        match value {
            // The origin of a key is the text between its quotes.
            Value::Text(key) if !word => {
                let origin = self.origin(start);
                Ok((key, Origin { start: origin.start + 1, end: origin.end - 1, ..origin }))
            }
            Value::Text(key) => Ok((key, self.origin(start))),
            _ => {
                let help = "write { \"name\": .. } or (name: ..)";
                Err(Stop {
                    at: start,
                    fact: "the keys of `{ .. }` must be texts in quotes".into(),
                    help,
                })
            }
        }
    }

    fn field(&mut self) -> Read<(String, Origin)> {
        let start = self.at;
        let key = self.name();
        if key.is_empty() || key.starts_with(|c: char| c.is_numeric()) {
            return Err(Stop { at: start, fact: "expected the name of a field".into(), help: "" });
        }
        Ok((key.to_owned(), self.origin(start)))
    }

    /// Notes the keys of a map that are written twice.
    fn note_twice(&mut self, entries: &[(String, Located)], places: &[Origin]) {
        let few = entries.len() <= FEW;
        if few && (1..entries.len()).all(|k| entries[..k].iter().all(|e| e.0 != entries[k].0)) {
            return;
        }
        let mut seen: BTreeMap<&str, Origin> = BTreeMap::new();
        for ((name, _), place) in entries.iter().zip(places) {
            match seen.get(&**name) {
                Some(first) => self.twice.push((name.clone(), *place, *first)),
                None => drop(seen.insert(name, *place)),
            }
        }
    }
}

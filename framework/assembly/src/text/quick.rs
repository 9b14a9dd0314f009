//! The notation as nearly every text has it, read in one pass: `ron`'s pieces are read again at every level of nesting.
//!
//! What stands here is a part of RON; a text that goes beyond it in a single place (attributes, raw texts and raw names,
//! characters, `Some`, a key that is written twice, and all that is no RON) is left to [`parse`](super::parse) as a whole, which
//! tells what is wrong. Both give the same values at the same places.
use crate::text::pieces::scalar;
use linkwork_runtime::{Located, Origin, Value};
use std::collections::BTreeSet;

/// Brackets within each other that are read here; `ron` refuses more than 128.
const DEPTH: usize = 100;

/// Maps of more entries look for keys that are written twice in an index.
const FEW: usize = 16;

/// The value of a whole text, and for each value in a map its place and that of its key.
pub(crate) fn read(text: &str, file: u32) -> Option<(Located, Vec<(Origin, Origin)>)> {
    let mut reader = Quick { text, file, at: 0, depth: 0, keys: Vec::new() };
    let value = reader.value()?;
    reader.blank()?;
    (reader.at == text.len()).then_some((value, reader.keys))
}

struct Quick<'t> {
    text: &'t str,
    file: u32,
    /// The next byte.
    at: usize,
    depth: usize,
    keys: Vec<(Origin, Origin)>,
}

impl<'t> Quick<'t> {
    fn next(&self) -> Option<u8> {
        self.text.as_bytes().get(self.at).copied()
    }

    fn origin(&self, start: usize) -> Origin {
        Origin::in_file(self.file, start as u32, self.at as u32)
    }

    /// Over a character that must be there.
    fn expect(&mut self, c: u8) -> Option<()> {
        self.is(c).then_some(())
    }

    /// Over a character, when it is there.
    fn is(&mut self, c: u8) -> bool {
        let found = self.next() == Some(c);
        self.at += usize::from(found);
        found
    }

    /// To the first byte that is not of a kind.
    fn skip(&mut self, of: impl Fn(u8) -> bool) -> &'t str {
        let start = self.at;
        let rest = self.text.as_bytes().get(start..).unwrap_or_default();
        self.at += rest.iter().position(|c| !of(*c)).unwrap_or(rest.len());
        self.text.get(start..self.at).unwrap_or_default()
    }

    /// Over white space and comments.
    fn blank(&mut self) -> Option<()> {
        loop {
            self.skip(|c| matches!(c, b' ' | b'\n' | b'\r' | b'\t'));
            match &self.text.as_bytes()[self.at..] {
                [b'/', b'/', ..] => self.at += self.text[self.at..].find('\n')?,
                [b'/', b'*', ..] => {
                    let inner = &self.text[self.at + 2..];
                    let end = inner.find("*/")?;
                    // Comments within comments.
                    if inner[..end].contains("/*") {
                        return None;
                    }
                    self.at += end + 4;
                }
                _ => return Some(()),
            }
        }
    }

    fn value(&mut self) -> Option<Located> {
        self.blank()?;
        let start = self.at;
        let value = match self.next()? {
            b'"' => self.quoted()?,
            b'[' => Value::List(self.items(b']')?),
            b'{' => self.map(b'}')?,
            b'(' => self.brackets()?,
            b'a'..=b'z' | b'A'..=b'Z' | b'_' => self.word()?,
            _ => self.number()?,
        };
        Some(Located { value, origin: self.origin(start) })
    }

    fn quoted(&mut self) -> Option<Value> {
        let start = self.at;
        self.at += 1;
        loop {
            self.skip(|c| c != b'"' && c != b'\\');
            match self.next()? {
                b'"' => break,
                _ => self.at += 2,
            }
        }
        self.at += 1;
        let inner = self.text.get(start + 1..self.at - 1)?;
        match inner.contains('\\') {
            true => scalar(self.text.get(start..self.at)?),
            false => Some(Value::Text(inner.to_owned())),
        }
    }

    fn number(&mut self) -> Option<Value> {
        let digits = self.skip(|c| matches!(c, b'0'..=b'9' | b'-' | b'+' | b'.' | b'e' | b'E'));
        let whole = digits.bytes().all(|c| c.is_ascii_digit()) && digits.len() < 16;
        let ends = self.next().is_none_or(|c| b",)]}/ \n\r\t".contains(&c));
        let fraction = digits.contains('.') && !digits.contains("..");
        if ends && (whole || fraction) {
            return Some(Value::Number(digits.parse().ok()?));
        }
        // Whole numbers with signs, other bases, suffixes.
        self.at -= digits.len();
        let token = self.skip(|c| c.is_ascii_alphanumeric() || b"_+-.".contains(&c));
        scalar(token)
    }

    /// A name: of a variant, or a word that stands for itself.
    fn word(&mut self) -> Option<Value> {
        let name = self.skip(|c| c.is_ascii_alphanumeric() || c == b'_');
        match name {
            "true" => return Some(Value::Bool(true)),
            "false" => return Some(Value::Bool(false)),
            "None" => return Some(Value::Null),
            "inf" | "NaN" | "inff64" | "NaNf64" => return scalar(name),
            "Some" => return None,
            _ => {}
        }
        let end = self.at;
        self.blank()?;
        if self.next() != Some(b'(') {
            self.at = end;
            return Some(Value::Variant(name.to_owned(), Box::new(Value::Null.into())));
        }
        let open = self.at;
        let value = self.brackets()?;
        let mut content = Located { value, origin: self.origin(open) };
        if let Value::List(items) = &mut content.value {
            // `Name(x)` holds x itself; `Name()` holds nothing.
            match items.len() {
                0 => content.value = Value::Null,
                1 => content = items.remove(0),
                _ => {}
            }
        }
        Some(Value::Variant(name.to_owned(), Box::new(content)))
    }

    /// `(..)`: fields when the first thing is a name with a colon, else a list.
    fn brackets(&mut self) -> Option<Value> {
        let open = self.at;
        self.at += 1;
        if self.is(b')') {
            return Some(Value::Null);
        }
        self.blank()?;
        let name = self.skip(|c| c.is_ascii_alphanumeric() || c == b'_');
        self.blank()?;
        let named = !name.is_empty() && self.next() == Some(b':');
        self.at = open;
        if named { self.map(b')') } else { self.items(b')').map(Value::List) }
    }

    /// Over the opening bracket, one thing after another, and over the closing bracket.
    fn each(&mut self, close: u8, mut one: impl FnMut(&mut Self) -> Option<()>) -> Option<()> {
        self.at += 1;
        self.depth += 1;
        if self.depth > DEPTH {
            return None;
        }
        loop {
            self.blank()?;
            if self.is(close) {
                break;
            }
            one(self)?;
            self.blank()?;
            if !self.is(b',') {
                self.expect(close)?;
                break;
            }
        }
        self.depth -= 1;
        Some(())
    }

    fn items(&mut self, close: u8) -> Option<Vec<Located>> {
        let mut items = Vec::new();
        self.each(close, |reader| {
            items.push(reader.value()?);
            Some(())
        })?;
        Some(items)
    }

    /// Texts in quotes are the keys of `{..}`, names those of `(..)`.
    fn map(&mut self, close: u8) -> Option<Value> {
        let mut entries: Vec<(String, Located)> = Vec::new();
        self.each(close, |reader| {
            let quoted = close == b'}';
            if quoted {
                reader.expect(b'"')?;
            }
            let start = reader.at;
            let key = match quoted {
                true => reader.skip(|c| c != b'"' && c != b'\\'),
                false => reader.skip(|c| c.is_ascii_alphanumeric() || c == b'_'),
            };
            let place = reader.origin(start);
            if quoted {
                reader.expect(b'"')?;
            } else if key.starts_with(|c: char| c.is_ascii_digit()) || key.is_empty() {
                return None;
            }
            reader.blank()?;
            reader.expect(b':')?;
            let value = reader.value()?;
            reader.keys.push((value.origin, place));
            entries.push((key.to_owned(), value));
            Some(())
        })?;
        let once = match entries.len() {
            0..=FEW => (1..entries.len()).all(|k| entries[..k].iter().all(|e| e.0 != entries[k].0)),
            n => entries.iter().map(|(key, _)| key.as_str()).collect::<BTreeSet<_>>().len() == n,
        };
        once.then_some(Value::Map(entries))
    }
}

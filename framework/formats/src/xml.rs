//! XML text as a tree of elements that store their position and whether they were read.
//!
//! No list of unsupported elements is necessary: elements that no reader requested are reported as ignored.
//!
//! Functions of this file do not recurse, because a chain of bodies in MJCF may be deep, and stacks of threads may be small.

use crate::error::{FaultKind, FileFault, FilePlace};
use crate::{FormatError, Ignored};
use std::cell::Cell;
use std::rc::Rc;

/// Depth of elements above which files are rejected. Readers of these formats recurse, with large frames in builds without optimization.
pub(crate) const DEPTH: usize = 100;
/// Depth of elements above which MJCF files are rejected: a chain of bodies is a chain of nested elements. The reader does not recurse.
pub(crate) const CHAIN: usize = 1000;

/// The names of a format.
pub(crate) trait Names {
    /// Returns a note about an attribute that the format does not have.
    fn strange_attribute(
        &self,
        parent: Option<&str>,
        element: &str,
        attribute: &str,
    ) -> Option<String>;
    /// Returns a note about an element that the format does not have inside `parent`.
    fn strange_element(&self, parent: &Element, element: &str) -> Option<String>;
}

/// An attribute.
#[derive(Clone)]
pub(crate) struct Attribute {
    pub name: String,
    pub value: String,
    pub line: u32,
    pub column: u32,
    used: Cell<bool>,
}

/// An element.
pub(crate) struct Element {
    pub name: String,
    pub attributes: Vec<Attribute>,
    pub children: Vec<Element>,
    /// All text directly inside, trimmed.
    pub text: String,
    pub file: Rc<str>,
    pub line: u32,
    pub column: u32,
    /// Index of the settings that apply to it, in a file composed of several models.
    pub scope: usize,
    used: Cell<bool>,
}

impl Element {
    /// Returns the position of its first character.
    pub fn place(&self) -> FilePlace {
        FilePlace { file: self.file.to_string(), line: self.line, column: self.column }
    }

    /// Returns the position of an attribute, or of the element if it does not have the attribute.
    pub fn place_of(&self, name: &str) -> FilePlace {
        match self.attributes.iter().find(|a| a.name == name) {
            Some(a) => FilePlace { file: self.file.to_string(), line: a.line, column: a.column },
            None => self.place(),
        }
    }

    /// Returns the value of an attribute.
    pub fn attr(&self, name: &str) -> Option<&str> {
        self.used.set(true);
        let a = self.attributes.iter().find(|a| a.name == name)?;
        a.used.set(true);
        Some(a.value.trim())
    }

    /// Returns the first child with a name.
    pub fn child(&self, name: &str) -> Option<&Element> {
        self.used.set(true);
        let c = self.children.iter().find(|c| c.name == name)?;
        c.used.set(true);
        Some(c)
    }

    /// Returns the text of the first child with a name.
    pub fn child_text(&self, name: &str) -> Option<(&Element, &str)> {
        self.child(name).map(|c| (c, c.text.as_str()))
    }

    /// Returns all children with a name.
    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Element> {
        self.used.set(true);
        self.children.iter().filter(move |c| c.name == name).inspect(|c| c.used.set(true))
    }

    /// Adds an attribute that the file does not have; it counts as read, and its position is that of the element.
    pub fn set(&mut self, name: &str, value: String) {
        let (line, column) = (self.line, self.column);
        let used = Cell::new(true);
        self.attributes.push(Attribute { name: name.into(), value, line, column, used });
    }

    /// Writes an attribute in the place of one that may be there.
    pub fn replace(&mut self, name: &str, value: String) {
        self.attributes.retain(|a| a.name != name);
        self.set(name, value);
    }

    /// Creates an empty element, marked as read, at the position of another.
    pub fn like(other: &Element, name: &str) -> Element {
        Element {
            name: name.into(),
            attributes: Vec::new(),
            children: Vec::new(),
            text: String::new(),
            file: other.file.clone(),
            line: other.line,
            column: other.column,
            scope: other.scope,
            used: Cell::new(true),
        }
    }

    /// Marks it as read.
    pub fn touch(&self) {
        self.used.set(true);
    }

    /// Marks it and everything inside as read, when another entry reports it.
    pub fn touch_all(&self) {
        for (e, _) in self.walk() {
            e.used.set(true);
            e.attributes.iter().for_each(|a| a.used.set(true));
        }
    }

    /// Returns this element and everything inside, in the order of the text, each with its depth: 1 for this element.
    pub fn walk(&self) -> impl Iterator<Item = (&Element, usize)> {
        let mut todo = vec![(self, 1)];
        std::iter::from_fn(move || {
            let (e, depth) = todo.pop()?;
            todo.extend(e.children.iter().rev().map(|c| (c, depth + 1)));
            Some((e, depth))
        })
    }

    /// Calls a function with this element and everything inside, in the order of the text, each with its depth. The function may replace the
    /// children, which follow.
    pub fn for_each(&mut self, mut f: impl FnMut(&mut Element, usize)) {
        let mut todo = vec![(self, 1)];
        while let Some((e, depth)) = todo.pop() {
            f(e, depth);
            todo.extend(e.children.iter_mut().rev().map(|c| (c, depth + 1)));
        }
    }

    /// Calls a function with everything inside, and then with this element: children before the element that contains them.
    pub fn for_each_inside_first(&mut self, mut f: impl FnMut(&mut Element)) {
        let open = |mut e: Element| {
            let mut todo = std::mem::take(&mut e.children);
            todo.reverse();
            (e, todo)
        };
        let whole = std::mem::replace(self, Element::like(self, ""));
        let (mut outer, mut now) = (Vec::new(), open(whole));
        loop {
            if let Some(child) = now.1.pop() {
                outer.push(std::mem::replace(&mut now, open(child)));
                continue;
            }
            let mut done = now.0;
            f(&mut done);
            let Some(parent) = outer.pop() else {
                *self = done;
                return;
            };
            now = parent;
            now.0.children.push(done);
        }
    }

    /// Builds a tree: `make` returns an element without children, and `sources` the sources of its children.
    fn build<S>(root: S, make: impl Fn(&S) -> Element, sources: impl Fn(&S) -> Vec<S>) -> Element {
        let open = |source: S| {
            let mut todo = sources(&source);
            todo.reverse();
            (make(&source), todo)
        };
        let (mut outer, mut now) = (Vec::new(), open(root));
        loop {
            if let Some(source) = now.1.pop() {
                outer.push(std::mem::replace(&mut now, open(source)));
                continue;
            }
            let Some(parent) = outer.pop() else { return now.0 };
            let done = std::mem::replace(&mut now, parent).0;
            now.0.children.push(done);
        }
    }

    /// Returns `link[arm]`, or `link` without a name.
    pub fn label(&self) -> String {
        match self.attributes.iter().find(|a| a.name == "name") {
            Some(a) => format!("{}[{}]", self.name, a.value),
            None => self.name.clone(),
        }
    }

    /// Returns an entry about this element.
    pub fn ignored(&self, path: impl Into<String>, what: impl Into<String>) -> Ignored {
        Ignored {
            file: self.file.to_string(),
            line: self.line,
            path: path.into(),
            what: what.into(),
        }
    }

    /// Returns all unread contents, outermost first. A note marks names that the format does not have.
    pub fn unread(&self, names: Option<&dyn Names>) -> Vec<Ignored> {
        let with = |fact: String, strange: Option<String>| match strange {
            Some(strange) => format!("{fact} {strange}"),
            None => fact,
        };
        let mut out = Vec::new();
        let mut todo: Vec<(&Element, Option<&Element>, String)> =
            vec![(self, None, self.name.clone())];
        while let Some((e, parent, path)) = todo.pop() {
            if let Some(parent) = parent.filter(|_| !e.used.get()) {
                let strange = names.and_then(|n| n.strange_element(parent, &e.name));
                out.push(e.ignored(path, with(format!("element <{}>", e.name), strange)));
                continue;
            }
            for a in e.attributes.iter().filter(|a| !a.used.get()) {
                let outer = parent.map(|p| p.name.as_str());
                let strange = names.and_then(|n| n.strange_attribute(outer, &e.name, &a.name));
                let fact = format!("attribute {}=\"{}\"", a.name, a.value);
                let mut entry = e.ignored(path.as_str(), with(fact, strange));
                entry.line = a.line;
                out.push(entry);
            }
            let inside = e.children.iter().rev();
            todo.extend(inside.map(|c| (c, Some(e), format!("{path}/{}", c.label()))));
        }
        out
    }
}

impl Clone for Element {
    fn clone(&self) -> Self {
        let own = |e: &&Element| Element {
            name: e.name.clone(),
            attributes: e.attributes.clone(),
            children: Vec::with_capacity(e.children.len()),
            text: e.text.clone(),
            file: e.file.clone(),
            line: e.line,
            column: e.column,
            scope: e.scope,
            used: e.used.clone(),
        };
        Element::build(self, own, |e| e.children.iter().collect())
    }
}

impl Drop for Element {
    fn drop(&mut self) {
        let mut todo = std::mem::take(&mut self.children);
        while let Some(mut e) = todo.pop() {
            todo.append(&mut e.children);
        }
    }
}

/// Number of bytes between two marks of a long line.
const APART: usize = 512;

/// Converts offsets to lines and columns. Marks are at starts of lines and at intervals in long lines, so a conversion needs a binary search and a
/// few characters, also if the text is a single line.
struct Lines<'a> {
    text: &'a str,
    /// Offset, line and column, from 1.
    marks: Vec<(usize, u32, u32)>,
    added: Added,
}

impl<'a> Lines<'a> {
    /// Creates marks of the original text; offsets are those of the text with what was `added`.
    fn new(text: &'a str, added: Added) -> Self {
        let (mut marks, mut line, mut column) = (vec![(0, 1, 1)], 1, 1);
        let mut last = 0;
        for (at, c) in text.char_indices() {
            if at - last >= APART {
                marks.push((at, line, column));
                last = at;
            }
            column += 1;
            if c == '\n' {
                (line, column, last) = (line + 1, 1, at + 1);
                marks.push((last, line, column));
            }
        }
        Self { text, marks, added }
    }

    fn at(&self, offset: usize) -> (u32, u32) {
        let offset = self.added.original(offset);
        let mark = self.marks.partition_point(|m| m.0 <= offset).max(1);
        let (start, line, column) = self.marks[mark - 1];
        let before = self.text.get(start..offset).unwrap_or_default();
        (line, before.chars().count() as u32 + column)
    }
}

/// Text inserted by [`with_prefixes`]: position and length in bytes.
#[derive(Clone, Copy, Default)]
struct Added {
    at: usize,
    bytes: usize,
}

impl Added {
    /// Returns the offset in the original text.
    fn original(self, offset: usize) -> usize {
        if offset < self.at { offset } else { offset.saturating_sub(self.bytes).max(self.at) }
    }
}

/// Maximum number of undeclared prefixes of a file that are declared automatically.
const PREFIXES: usize = 16;

/// Returns the text with a declaration for each undeclared prefix, and the inserted part. Robot files contain such names (`drake:acceleration`), and
/// readers of other programs accept them. Elements that no reader requests are listed as ignored.
fn with_prefixes(text: &str, declarations: Declarations) -> (String, Added) {
    let Some(at) = end_of_first_name(text) else { return (text.into(), Added::default()) };
    let (before, after) = text.split_at(at);
    let (mut out, mut names) = (text.to_owned(), String::new());
    for _ in 0..PREFIXES {
        let Err(roxmltree::Error::UnknownNamespace(prefix, _)) = read(&out, declarations) else {
            break;
        };
        names += &format!(" xmlns:{prefix}=\"{prefix}\"");
        out = format!("{before}{names}{after}");
    }
    (out, Added { at, bytes: names.len() })
}

fn read(
    text: &str,
    declarations: Declarations,
) -> Result<roxmltree::Document<'_>, roxmltree::Error> {
    let options = roxmltree::ParsingOptions {
        allow_dtd: declarations == Declarations::Allowed,
        ..roxmltree::ParsingOptions::default()
    };
    roxmltree::Document::parse_with_options(text, options)
}

/// Returns the end of the name of the outermost element.
fn end_of_first_name(text: &str) -> Option<usize> {
    let mut from = 0;
    loop {
        let start = from + text.get(from..)?.find('<')?;
        let rest = &text[start + 1..];
        let end = match rest.as_bytes().first()? {
            b'?' => "?>",
            b'!' if rest.starts_with("!--") => "-->",
            b'!' => ">",
            _ => {
                let ends = |c: char| c.is_whitespace() || c == '/' || c == '>';
                return Some(start + 1 + rest.find(ends)?);
            }
        };
        from = start + 1 + rest.find(end)? + end.len();
    }
}

/// Whether a text may declare its document type. Declarations are never downloaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Declarations {
    Refused,
    Allowed,
}

/// Returns the outermost element of a text.
pub(crate) fn parse(text: &str, file: &str) -> Result<Element, FormatError> {
    parse_with(text, file, Declarations::Refused, DEPTH)
}

/// Returns the outermost element of a text that may be nested to some depth and may declare its document type.
pub(crate) fn parse_with(
    text: &str,
    file: &str,
    declarations: Declarations,
    limit: usize,
) -> Result<Element, FormatError> {
    let one = |line, column, kind| FormatError {
        faults: vec![FileFault { place: FilePlace { file: file.into(), line, column }, kind }],
    };
    if let Some(offset) = too_crowded(text) {
        let (line, column) = Lines::new(text, Added::default()).at(offset);
        return Err(one(line, column, FaultKind::TooCrowded { limit: ATTRIBUTES }));
    }
    let declared;
    let (mut doc, mut shown, mut added) = (read(text, declarations), text, Added::default());
    if let Err(roxmltree::Error::UnknownNamespace(..)) = doc {
        (declared, added) = with_prefixes(text, declarations);
        (doc, shown) = (read(&declared, declarations), &declared);
    }
    let lines = Lines::new(text, added);
    let doc = doc.map_err(|e| {
        let p = e.pos();
        let reason = match &e {
            roxmltree::Error::UnknownNamespace(prefix, _) => format!(
                "the prefix `{prefix}:` is not declared (write xmlns:{prefix}=\"..\" on the \
                 outermost element)"
            ),
            roxmltree::Error::DtdDetected => "document type declarations are not supported".into(),
            other => other.to_string(),
        };
        let (row, column) = lines.at(offset_of(shown, p));
        one(row, column, FaultKind::Xml { reason })
    })?;
    if let Some(offset) = too_deep(&doc, limit) {
        let (line, column) = lines.at(offset);
        return Err(one(line, column, FaultKind::TooDeep { limit }));
    }
    let root = convert(doc.root_element(), &Rc::from(file), &lines);
    root.used.set(true);
    Ok(root)
}

/// Returns the number of bytes before a row and column, both from 1 and the column in characters.
fn offset_of(text: &str, p: roxmltree::TextPos) -> usize {
    let rows = text.split_inclusive('\n');
    let start: usize = rows.clone().take(p.row as usize - 1).map(str::len).sum();
    let row = rows.clone().nth(p.row as usize - 1).unwrap_or_default();
    start + row.char_indices().nth(p.col as usize - 1).map_or(row.len(), |(i, _)| i)
}

/// Maximum number of attributes of an element: the parser compares each with all earlier ones.
const ATTRIBUTES: usize = 1000;

/// Returns where the first element with more attributes than that begins. The time is linear in the length of the text.
fn too_crowded(text: &str) -> Option<usize> {
    let mut from = 0;
    while let Some(start) = text.get(from..)?.find('<').map(|k| from + k) {
        let rest = &text[start..];
        let skipped = [("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>")];
        if let Some((_, end)) = skipped.iter().find(|(begin, _)| rest.starts_with(begin)) {
            from = start + rest.find(end)? + end.len();
            continue;
        }
        let (mut quote, mut count, mut end) = (None, 0, rest.len());
        for (k, b) in rest.bytes().enumerate().skip(1) {
            match (quote, b) {
                (Some(q), _) if q == b => quote = None,
                (Some(_), _) => {}
                (None, b'"' | b'\'') => quote = Some(b),
                (None, b'=') => count += 1,
                (None, b'>') => {
                    end = k + 1;
                    break;
                }
                _ => {}
            }
            if count > ATTRIBUTES {
                return Some(start);
            }
        }
        from = start + end;
    }
    None
}

/// Returns the first node that is nested too deeply. The parser does not recurse either.
fn too_deep(doc: &roxmltree::Document<'_>, limit: usize) -> Option<usize> {
    let mut depths: Vec<usize> = Vec::new();
    for node in doc.descendants() {
        let depth = node.parent().map_or(0, |p| depths[p.id().get_usize()] + 1);
        if depth > limit {
            return Some(node.range().start);
        }
        depths.push(depth);
        debug_assert_eq!(depths.len(), node.id().get_usize() + 1);
    }
    None
}

fn convert<'a>(root: roxmltree::Node<'a, 'a>, file: &Rc<str>, lines: &Lines<'_>) -> Element {
    let inside = |node: &roxmltree::Node<'a, 'a>| -> Vec<roxmltree::Node<'a, 'a>> {
        node.children().filter(roxmltree::Node::is_element).collect()
    };
    Element::build(root, |node| alone(*node, file, lines), inside)
}

/// Returns an element without its children.
fn alone(node: roxmltree::Node<'_, '_>, file: &Rc<str>, lines: &Lines<'_>) -> Element {
    let (line, column) = lines.at(node.range().start);
    let prefixed = |namespace: Option<&str>, name: &str| {
        let prefix = namespace.and_then(|uri| node.lookup_prefix(uri)).unwrap_or_default();
        if prefix.is_empty() { name.to_owned() } else { format!("{prefix}:{name}") }
    };
    let attributes = node.attributes().map(|a| {
        let (line, column) = lines.at(a.range().start);
        let name = prefixed(a.namespace(), a.name());
        Attribute { name, value: a.value().to_owned(), line, column, used: Cell::new(false) }
    });
    // An element between two texts separates them, as in <cn>1.2<sep/>-3</cn>.
    let text: String = (node.children())
        .filter_map(|c| if c.is_element() { Some(" ") } else { c.text().filter(|_| c.is_text()) })
        .collect();
    Element {
        name: prefixed(node.tag_name().namespace(), node.tag_name().name()),
        attributes: attributes.collect(),
        children: Vec::new(),
        text: text.trim().to_owned(),
        file: file.clone(),
        line,
        column,
        scope: 0,
        used: Cell::new(false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 40 000 attributes took 9 s.
    #[test]
    fn an_element_with_many_attributes_is_refused_at_once_with_its_place() {
        let of = |n: usize, quote: char| {
            let all: String = (0..n).map(|k| format!(" a{k}={quote}1 > = '{quote}")).collect();
            format!("<?xml version=\"1.0\"?><!-- a='' --><robot>\n <link{all}/></robot>")
        };
        let read = |text: &str| parse(text, "r.urdf").err().map(|e| e.faults[0].clone());
        assert!(read(&of(ATTRIBUTES, '"')).is_none());
        for n in [ATTRIBUTES + 1, 40_000] {
            let fault = read(&of(n, '"')).unwrap();
            assert_eq!((fault.place.line, fault.place.column), (2, 2));
            assert_eq!(fault.kind, FaultKind::TooCrowded { limit: ATTRIBUTES });
        }
        // The parser reports elements without an end.
        for text in ["<", "<!-- ", "<![CDATA[", "<?", "<a b='", "", "x"] {
            assert_eq!(too_crowded(text), None, "{text}");
        }
    }

    /// Compared with counting from the beginning, in short and long lines, with multi-byte characters; no count is long.
    #[test]
    fn places_are_those_of_counting() {
        let long = "<é a='ü'/>€".repeat(900);
        let text = format!("one\ntwo\r\n{long}\n\nfive {long}");
        let lines = Lines::new(&text, Added::default());
        for (offset, _) in text.char_indices().step_by(7) {
            let before = &text[..offset];
            let line = before.matches('\n').count() + 1;
            let start = before.rfind('\n').map_or(0, |n| n + 1);
            let column = before[start..].chars().count() + 1;
            assert_eq!(lines.at(offset), (line as u32, column as u32), "{offset}");
        }
        let far = lines.marks.windows(2).map(|m| m[1].0 - m[0].0).max();
        assert!(far.is_some_and(|far| far < APART + 8) && lines.marks[0].0 == 0, "{far:?}");
        assert!(text.len() - lines.marks[lines.marks.len() - 1].0 < APART + 8);
        assert_eq!(Lines::new("", Added::default()).at(0), (1, 1));
    }
}

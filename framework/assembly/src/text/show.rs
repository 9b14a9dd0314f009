//! Faults as text: plain (`error: …` / `  --> file:line:column` / `  help: …`), or with the
//! source line drawn.
use ariadne::{CharSet, Color, Config, Label, Report, ReportKind, Source};
use linkwork_runtime::{Fault, Sources};
use std::ops::Range;

/// All mistakes of a load, at least one.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The faults, sorted by position.
    pub faults: Vec<Fault>,
    /// The texts to which they refer.
    pub sources: Sources,
}

/// Format of faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Three lines each, for logs and tests.
    Plain,
    /// The message with the source line.
    Drawn,
    /// With the source line, in colour.
    Coloured,
}

impl Failure {
    /// Returns the faults as text; see [`Look`].
    pub fn show(&self, look: Look) -> String {
        show_faults(&self.faults, &self.sources, look)
    }

    /// Returns the faults with the source lines, optionally coloured for a terminal.
    pub fn render(&self, color: bool) -> String {
        self.show(if color { Look::Coloured } else { Look::Drawn })
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.show(Look::Plain))
    }
}

impl std::error::Error for Failure {}

/// Returns any faults as text, including those of `compile`.
pub fn show_faults(faults: &[Fault], sources: &Sources, look: Look) -> String {
    let mut out = String::new();
    for fault in faults {
        match look {
            Look::Plain => out.push_str(&plain(fault, sources)),
            Look::Drawn | Look::Coloured => out.push_str(&drawn(fault, sources, look)),
        }
    }
    if faults.len() > 1 && look != Look::Plain {
        out.push_str(&format!("{} mistakes\n", faults.len()));
    }
    out
}

fn plain(fault: &Fault, sources: &Sources) -> String {
    let mut out = format!("error: {}\n", fault.message);
    if let Some((name, line, column)) = sources.place(fault.origin) {
        out.push_str(&format!("  --> {name}:{line}:{column}\n"));
    }
    if let Some(help) = &fault.help {
        out.push_str(&format!("  help: {help}\n"));
    }
    out
}

fn drawn(fault: &Fault, sources: &Sources, look: Look) -> String {
    let Some((name, text)) = sources.files.get(fault.origin.file as usize) else {
        return plain(fault, sources) + "\n";
    };
    // Offsets are bytes, whereas ariadne counts characters by default. A span must not be empty or
    // extend over many lines.
    let whole =
        |at: u32| (0..=(at as usize).min(text.len())).rev().find(|k| text.is_char_boundary(*k));
    let start = whole(fault.origin.start).unwrap_or(0);
    let end = whole(fault.origin.end).unwrap_or(0).max(start);
    let line_end = text[start..end].find('\n').map_or(end, |n| start + n);
    let config = Config::new()
        .with_index_type(ariadne::IndexType::Byte)
        .with_char_set(if look == Look::Coloured { CharSet::Unicode } else { CharSet::Ascii })
        .with_color(look == Look::Coloured);
    let span: (String, Range<usize>) = (name.clone(), start..line_end);
    let red = Color::Red;
    let mut report = Report::build(ReportKind::Custom("error", red), span.clone())
        .with_config(config)
        .with_message(&fault.message)
        .with_label(Label::new(span).with_message("here").with_color(red));
    if let Some(help) = &fault.help {
        report = report.with_help(help);
    }
    let mut bytes = Vec::new();
    let cache = (name.clone(), Source::from(text.as_str()));
    match report.finish().write(cache, &mut bytes) {
        Ok(()) => {
            let text = String::from_utf8_lossy(&bytes).into_owned() + "\n";
            if look == Look::Coloured { text } else { without_escapes(&text) }
        }
        Err(_) => plain(fault, sources) + "\n",
    }
}

/// Removes terminal colours, because a custom kind of report is coloured despite the configuration.
fn without_escapes(text: &str) -> String {
    let mut pieces = text.split('\u{1b}');
    let first = pieces.next().unwrap_or("").to_string();
    pieces.fold(first, |out, piece| out + piece.split_once('m').map_or(piece, |(_, rest)| rest))
}

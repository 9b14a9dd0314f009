//! Output to the terminal: lost output is remembered, and texts of files cannot control the terminal.
//!
//! Texts of a file can contain escape sequences that would move the cursor, rename the window or hide text. They are printed as `\u{1b}`. Numbers
//! with hundreds of digits are printed as powers of ten.
use crate::exit;
use linkwork_assembly::{Failure, Look};
use std::borrow::Cow;
use std::fmt::Arguments;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether some standard output was lost. It is static because standard output belongs to the process.
static LOST: AtomicBool = AtomicBool::new(false);

/// Prints a line to standard output.
#[macro_export]
macro_rules! say {
    ($($t:tt)*) => { $crate::voice::say_text(format_args!("{}\n", format_args!($($t)*))) };
}

/// Prints a line to standard error.
#[macro_export]
macro_rules! tell {
    ($($t:tt)*) => { $crate::voice::tell_text(format_args!("{}\n", format_args!($($t)*))) };
}

/// Prints text to standard output. A reader that has closed the pipe (`linkwork list | head`) is not an error; other errors are remembered
/// ([`exit_code`]).
pub fn say_text(text: Arguments<'_>) {
    let text = text.to_string();
    note(std::io::stdout().write_all(clean(&text).as_bytes()));
}

fn note(written: std::io::Result<()>) {
    if written.is_err_and(|e| e.kind() != ErrorKind::BrokenPipe) {
        LOST.store(true, Ordering::Relaxed);
    }
}

/// Prints text to standard error, if possible; the exit code contains the same information.
pub fn tell_text(text: Arguments<'_>) {
    let text = text.to_string();
    let _ = std::io::stderr().write_all(clean(&text).as_bytes());
}

/// Returns the exit code of the process: not 0 if standard output could not be written.
pub fn exit_code(code: u8) -> u8 {
    note(std::io::stdout().flush());
    if code == exit::OK && LOST.load(Ordering::Relaxed) {
        tell!("error: standard output cannot be written\n  help: check whether the disk is full");
        return exit::FAILED;
    }
    code
}

/// Largest number of printed mistakes or warnings of one file; more are only counted.
pub(crate) const MOST: usize = 100;

/// Prints a failure to standard error: drawn on a terminal, otherwise in three plain lines.
pub fn report(failure: &Failure) -> u8 {
    let no_color = std::env::var_os("NO_COLOR").is_some_and(|v| !v.is_empty());
    let look = match (std::io::stderr().is_terminal(), no_color) {
        (false, _) => Look::Plain,
        (true, true) => Look::Drawn,
        (true, false) => Look::Coloured,
    };
    // Remove the escape sequences of the file first, because the drawing adds its own.
    let mut failure = harmless(failure);
    let more = failure.faults.len().saturating_sub(MOST);
    failure.faults.truncate(MOST);
    let mut text = failure.show(look);
    if more > 0 {
        text.push_str(&format!("error: and {more} more mistakes\n  help: correct these first\n"));
    }
    let text = if look == Look::Coloured { Cow::Owned(text) } else { clean(&text) };
    let _ = std::io::stderr().write_all(text.as_bytes());
    exit::INPUT
}

/// Returns the failure without control characters. The texts keep their length, because positions in them are counted in bytes.
fn harmless(failure: &Failure) -> Failure {
    let mut failure = failure.clone();
    for fault in &mut failure.faults {
        fault.message = clean(&fault.message).into_owned();
        fault.help = fault.help.take().map(|h| clean(&h).into_owned());
    }
    for (name, text) in &mut failure.sources.files {
        *name = clean(name).into_owned();
        if text.contains(obeyed) {
            *text = text
                .chars()
                .map(|c| if obeyed(c) { "?".repeat(c.len_utf8()) } else { c.to_string() })
                .collect();
        }
    }
    failure
}

/// Returns whether a terminal interprets a character instead of showing it, except line ends and tabs: control characters, and those that change the
/// direction of writing.
fn obeyed(c: char) -> bool {
    let turns =
        matches!(c, '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    (c.is_control() && c != '\n' && c != '\t') || turns
}

/// Largest number of consecutive digits that a number needs.
const DIGITS: usize = 25;

/// Returns the text with every character shown and no number longer than a line.
pub fn clean(text: &str) -> Cow<'_, str> {
    let long = text.len() >= DIGITS && has_long_number(text);
    if !text.contains(obeyed) && !long {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let digits = number_length(rest);
        if digits >= DIGITS {
            match rest[..digits].parse::<f64>() {
                Ok(x) => out.push_str(&format!("{x:e}")),
                Err(_) => out.push_str(&rest[..digits]),
            }
            rest = &rest[digits..];
            continue;
        }
        // Copy a short number as a whole.
        let n = digits.max(c.len_utf8());
        if obeyed(c) {
            out.extend(c.escape_unicode());
        } else {
            out.push_str(&rest[..n]);
        }
        rest = &rest[n..];
    }
    Cow::Owned(out)
}

/// Returns the number of bytes of digits, with at most one point, at the start of the text.
fn number_length(text: &str) -> usize {
    let mut points = 0;
    text.bytes()
        .take_while(|b| {
            points += usize::from(*b == b'.');
            b.is_ascii_digit() || (*b == b'.' && points == 1)
        })
        .count()
}

fn has_long_number(text: &str) -> bool {
    let mut run = 0;
    text.bytes().any(|b| {
        run = if b.is_ascii_digit() || b == b'.' { run + 1 } else { 0 };
        run >= DIGITS
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_runtime::{Fault, Origin, Sources};

    #[test]
    fn nothing_is_obeyed() {
        assert_eq!(clean("a\u{1b}[31mred\u{7}\n\tb"), "a\\u{1b}[31mred\\u{7}\n\tb");
        assert_eq!(clean("\u{9b}2J\u{202e}\r"), "\\u{9b}2J\\u{202e}\\u{d}");
        assert!(matches!(clean("plain text, täglich 1.5 µs"), Cow::Borrowed(_)));
    }

    #[test]
    fn numbers_keep_a_sane_length() {
        let long = format!("became {} at", 1e308);
        assert!(long.len() > 300);
        assert_eq!(clean(&long), "became 1e308 at");
        let small = format!("x = {} m", -1.5e-300);
        assert_eq!(clean(&small), "x = -1.5e-300 m");
        // Hashes, versions and ordinary numbers stay unchanged.
        for same in ["0123456789abcdef", "1.2.3", "299792458.123456789", "t = 3."] {
            assert_eq!(clean(same), same);
        }
    }

    #[test]
    fn a_failure_shows_no_escape_sequence_of_the_file_and_keeps_its_places() {
        let mut sources = Sources::default();
        let text = "a: \"\u{1b}]0;owned\u{7}\",\n  b: \u{202e}2\n";
        let file = sources.add("sim\u{1b}[2J.ron", text);
        let at = text.find('2').unwrap() as u32;
        let origin = Origin::in_file(file, at, at + 1);
        let fault = Fault::new(origin, "no \u{1b}[8msecret").help("\u{1b}c");
        let safe = harmless(&Failure { faults: vec![fault], sources });
        for look in [Look::Plain, Look::Drawn] {
            let shown = safe.show(look);
            assert!(!shown.contains(obeyed), "{shown:?}");
            assert!(shown.contains(":2:"), "the place has moved: {shown}");
        }
        let coloured = safe.show(Look::Coloured);
        assert!(!coloured.contains("\u{1b}]0") && !coloured.contains("\u{1b}[8m"), "{coloured:?}");
    }
}

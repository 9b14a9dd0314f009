//! `.cof` files of GMAT. They have fixed columns, so that numbers may touch.
//!
//! ```text
//! columns   1-8      9-11  12-14  15-38  39-
//!           POTFIELD n     m      flag, mu, R, normalised (1) or not (0), apart by blanks
//!           RECOEF   n     m      C      S (absent for m = 0)
//!           COMMENT, lines of C, END
//! ```

use super::{Header, Keep, Norm, Reading, float, whole, wrong};
use crate::error::WorldError;
use crate::gravity::coefficients::{Coefficients, TideSystem};

pub(super) fn read(file: &str, text: &str, keep: Keep) -> Result<Coefficients, WorldError> {
    let mut reading: Option<Reading> = None;
    let mut ended = false;
    for (k, raw) in text.lines().enumerate() {
        let (line, raw) = (k + 1, raw.trim_end());
        let word = raw.get(..6).unwrap_or(raw).trim_end();
        match (word, &mut reading) {
            ("POTFIE", None) => {
                let header = header(file, line, raw)?;
                reading = Some(Reading::new(file, line, header, keep)?);
            }
            ("POTFIE", Some(r)) => {
                let fact = format!("a second POTFIELD; the first is on line {}", r.at);
                return Err(wrong(file, line, fact, "write one field per file"));
            }
            ("RECOEF", None) => {
                let fact = "RECOEF before POTFIELD".to_string();
                return Err(wrong(file, line, fact, "the header comes first"));
            }
            ("RECOEF", Some(r)) => {
                let n = whole(file, line, "degree", cut(raw, 8, 11))?;
                let m = whole(file, line, "order", cut(raw, 11, 14))?;
                let c = float(file, line, "C", cut(raw, 14, 38))?;
                let s = cut(raw, 38, raw.len());
                let s = if s.trim().is_empty() && m == 0 { "0" } else { s };
                r.take(line, n, m, c, float(file, line, "S", s)?)?;
            }
            ("END", _) => {
                ended = true;
                break;
            }
            ("", _) => {}
            (w, _) if w.starts_with("COMMEN") || w.starts_with('C') => {}
            (w, _) => {
                let fact = format!("`{w}` is not a keyword");
                return Err(wrong(file, line, fact, "expected COMMENT, POTFIELD, RECOEF or END"));
            }
        }
    }
    let help = "check that this is a .cof file of GMAT";
    let Some(reading) = reading else {
        return Err(wrong(file, 0, "there is no POTFIELD".to_string(), help));
    };
    if !ended {
        return Err(wrong(file, 0, "there is no END".to_string(), "the file was truncated"));
    }
    reading.done()
}

fn header(file: &str, line: usize, raw: &str) -> Result<Header, WorldError> {
    let words: Vec<&str> = cut(raw, 14, raw.len()).split_whitespace().collect();
    let [_, mu, radius, norm] = words[..] else {
        let fact = format!("POTFIELD has {} numbers after the order, not 4", words.len());
        return Err(wrong(file, line, fact, "flag, mu, radius, normalisation"));
    };
    let norm = float(file, line, "normalisation", norm)?;
    Ok(Header {
        mu: float(file, line, "mu", mu)?,
        radius: float(file, line, "radius", radius)?,
        degree: whole(file, line, "degree", cut(raw, 8, 11))?,
        order: whole(file, line, "order", cut(raw, 11, 14))?,
        norm: if norm == 1.0 { Norm::Full } else { Norm::None },
        tide: TideSystem::Unknown,
        order_is_written: true,
    })
}

/// Returns columns `from` … `to`, as far as the line reaches; empty beyond its end.
fn cut(line: &str, from: usize, to: usize) -> &str {
    line.get(from..to.min(line.len())).unwrap_or("")
}

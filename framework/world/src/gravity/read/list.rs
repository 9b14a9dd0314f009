//! Comma-separated lists: SHADR of the Planetary Data System, in km, and Basilisk's format, in m.
//!
//! ```text
//! R, mu, (σ of mu, or rotation rate), degree, order, normalised (1) or not (0), longitude, latitude
//! n, m, C, S, σ_C, σ_S
//! ```
//! Longitude and latitude of the reference must be zero.

use super::{Header, Keep, Norm, Reading, float, whole, wrong};
use crate::error::WorldError;
use crate::gravity::coefficients::{Coefficients, TideSystem};

/// Returns whether a trimmed line is neither empty nor a comment.
fn content(line: &str) -> bool {
    !line.is_empty() && !line.starts_with('#')
}

/// Unit of length in the header.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Length {
    Metres,
    Kilometres,
}

pub(super) fn read(
    file: &str,
    text: &str,
    keep: Keep,
    length: Length,
) -> Result<Coefficients, WorldError> {
    let mut lines =
        text.lines().enumerate().map(|(k, l)| (k + 1, l.trim())).filter(|(_, l)| content(l));
    let Some((line, first)) = lines.next() else {
        return Err(wrong(file, 0, "the file is empty".to_string(), "give a header and a list"));
    };
    let header = header(file, line, first, length)?;
    let mut reading = Reading::new(file, line, header, keep)?;
    for (line, text) in lines {
        let words: Vec<&str> = text.split(',').collect();
        if !matches!(words.len(), 4 | 6) {
            let fact = format!("{} numbers, not 4 or 6", words.len());
            return Err(wrong(
                file,
                line,
                fact,
                "expected n, m, C, S and optionally two deviations",
            ));
        }
        let n = whole(file, line, "degree", words[0])?;
        let m = whole(file, line, "order", words[1])?;
        let c = float(file, line, "C", words[2])?;
        reading.take(line, n, m, c, float(file, line, "S", words[3])?)?;
    }
    reading.done()
}

fn header(file: &str, line: usize, text: &str, length: Length) -> Result<Header, WorldError> {
    let words: Vec<&str> = text.split(',').collect();
    if words.len() != 8 {
        let fact = format!("the header has {} numbers, not 8", words.len());
        let help = "R, mu, sigma or rate, degree, order, normalised, longitude, latitude";
        return Err(wrong(file, line, fact, help));
    }
    let number = |what: &str, k: usize| float(file, line, what, words[k]);
    for (what, k) in [("reference longitude", 6), ("reference latitude", 7)] {
        if number(what, k)? != 0.0 {
            let fact = format!("{what} is {}, not 0", words[k].trim());
            return Err(wrong(file, line, fact, "rotate the coefficients to the body's own axes"));
        }
    }
    let norm = match number("normalisation", 5)? {
        1.0 => Norm::Full,
        0.0 => Norm::None,
        x => {
            let fact = format!("normalisation is {x}");
            return Err(wrong(file, line, fact, "1: fully normalised, 0: not"));
        }
    };
    let (radius, mu) = (number("radius", 0)?, number("mu", 1)?);
    if length == Length::Kilometres && radius > 1e5 {
        let fact = format!("a radius of {radius} km is larger than Jupiter's");
        return Err(wrong(file, line, fact, "if it is in metres, read it as Basilisk's format"));
    }
    let k = if length == Length::Kilometres { 1e3 } else { 1.0 };
    Ok(Header {
        mu: mu * k * k * k,
        radius: radius * k,
        degree: whole(file, line, "degree", words[3])?,
        order: whole(file, line, "order", words[4])?,
        norm,
        tide: TideSystem::Unknown,
        order_is_written: true,
    })
}

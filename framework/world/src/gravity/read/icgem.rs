//! `.gfc` of the International Centre for Global Earth Models: keywords until `end_of_head`, then a
//! list (Barthelmes & Förste, *The ICGEM-format*, 2011).
//!
//! ```text
//! earth_gravity_constant, radius, max_degree, norm (fully_normalized unless said), tide_system
//! gfc n m C S [deviations]
//! ```
//! The field's order is the highest of the list, so a file with only zonal terms has order 0. Time-variable fields (`gfct`, `trnd`, `asin`, `acos`)
//! are rejected, because an evaluation does not have a date, and silently ignoring the variation would defeat the purpose of the file.

use super::{Header, Keep, Norm, Reading, float, whole, wrong};
use crate::error::WorldError;
use crate::gravity::coefficients::{Coefficients, TideSystem};

pub(super) fn read(file: &str, text: &str, keep: Keep) -> Result<Coefficients, WorldError> {
    let (header, end) = header(file, text)?;
    let mut reading = Reading::new(file, end, header, keep)?;
    for (k, text) in text.lines().enumerate().skip(end) {
        let line = k + 1;
        let words: Vec<&str> = text.split_whitespace().collect();
        match words[..] {
            [] => {}
            [first, ..] if first.starts_with('#') => {}
            ["gfc", n, m, c, s, ..] => {
                let n = whole(file, line, "degree", n)?;
                let m = whole(file, line, "order", m)?;
                let c = float(file, line, "C", c)?;
                reading.take(line, n, m, c, float(file, line, "S", s)?)?;
            }
            [key @ ("gfct" | "trnd" | "dot" | "asin" | "acos"), ..] => {
                let fact = format!("`{key}`: the field changes with time");
                return Err(wrong(
                    file,
                    line,
                    fact,
                    "use a static field, or write its value at one date",
                ));
            }
            _ => {
                let fact = format!("`{}` is not a line of a list", text.trim());
                return Err(wrong(file, line, fact, "lines are `gfc n m C S …`"));
            }
        }
    }
    reading.done()
}

/// Reads the header. Returns it with its number of lines.
fn header(file: &str, text: &str) -> Result<(Header, usize), WorldError> {
    let (mut mu, mut radius, mut degree) = (None, None, None);
    let (mut norm, mut tide) = (Norm::Full, TideSystem::Unknown);
    for (k, raw) in text.lines().enumerate() {
        let line = k + 1;
        let mut words = raw.split_whitespace();
        let (key, value) = (words.next().unwrap_or(""), words.next().unwrap_or(""));
        match key {
            "earth_gravity_constant" | "gravity_constant" => {
                mu = Some(float(file, line, key, value)?);
            }
            "radius" => radius = Some(float(file, line, key, value)?),
            "max_degree" => degree = Some(whole(file, line, key, value)?),
            "norm" => norm = norm_of(file, line, value)?,
            "tide_system" => tide = tide_of(value),
            "end_of_head" => {
                let missing = |what: &str| {
                    let fact = format!("the header has no `{what}`");
                    wrong(file, line, fact, "it must be before `end_of_head`")
                };
                let degree = degree.ok_or_else(|| missing("max_degree"))?;
                let mu = mu.ok_or_else(|| missing("earth_gravity_constant"))?;
                let radius = radius.ok_or_else(|| missing("radius"))?;
                let order_is_written = false;
                let header =
                    Header { mu, radius, degree, order: degree, norm, tide, order_is_written };
                return Ok((header, line));
            }
            _ => {}
        }
    }
    Err(wrong(
        file,
        0,
        "`end_of_head` is missing".to_string(),
        "check that this is a .gfc file of ICGEM",
    ))
}

fn norm_of(file: &str, line: usize, value: &str) -> Result<Norm, WorldError> {
    match value {
        "fully_normalized" => Ok(Norm::Full),
        "unnormalized" => Ok(Norm::None),
        _ => {
            let fact = format!("norm is `{value}`");
            Err(wrong(file, line, fact, "`fully_normalized` or `unnormalized`"))
        }
    }
}

fn tide_of(value: &str) -> TideSystem {
    match value {
        "tide_free" => TideSystem::TideFree,
        "zero_tide" => TideSystem::ZeroTide,
        "mean_tide" => TideSystem::MeanTide,
        _ => TideSystem::Unknown,
    }
}

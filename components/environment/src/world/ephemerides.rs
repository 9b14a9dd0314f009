//! Starts from files of orbits: two-line elements and orbit ephemeris messages, at the epoch of the world.

use super::{Centre, Inner};
use linkwork_runtime::prelude::*;
use linkwork_surroundings::{StartFrame, TwoLineSource};
use linkwork_world::orbit::{Segment, TwoLine, read_oem};
use linkwork_world::planet::PointMotion;

impl Inner {
    /// Returns position and velocity (TEME) of an Earth satellite at t = 0.
    pub(super) fn by_two_lines(
        &self,
        from: &TwoLineSource,
        satellite: Option<&str>,
    ) -> Result<PointMotion, BuildError> {
        if self.params.body != Centre::Earth {
            let fact = "two-line elements describe satellites of the Earth, but the `body` of `world` is another one";
            return Err(BuildError::new(fact).help("write `elements` or `state`"));
        }
        let epoch = self.params.epoch("a start by two-line elements")?;
        let (file, text) = match from {
            TwoLineSource::File(file) => (file.as_str(), self.files.text(file)?),
            TwoLineSource::Lines(lines) => ("`tle`", lines.join("\n")),
        };
        let mut all = TwoLine::read(file, &text).map_err(|e| BuildError::of(&e))?;
        let is = |t: &TwoLine| {
            satellite.is_none_or(|s| t.name.as_deref() == Some(s) || t.number.to_string() == s)
        };
        let known: Vec<String> = all.iter().map(TwoLine::called).collect();
        all.retain(is);
        // A file may contain several epochs of one satellite. The nearest epoch is used.
        let number = all.first().map(|t| t.number);
        if all.iter().any(|t| Some(t.number) != number) || all.is_empty() {
            return Err(choose("satellite", satellite, file, &known));
        }
        let away = |t: &TwoLine| t.epoch.since(&epoch).abs();
        all.sort_by(|a, b| away(a).total_cmp(&away(b)));
        all[0].state(&epoch).map_err(|e| BuildError::of(&e))
    }

    /// Returns axes, position and velocity of a spacecraft at t = 0.
    pub(super) fn by_message(
        &self,
        file: &str,
        object: Option<&str>,
    ) -> Result<(StartFrame, PointMotion), BuildError> {
        let epoch = self.params.epoch("a start by an orbit ephemeris message")?;
        let mut all = read_oem(file, &self.files.text(file)?).map_err(|e| BuildError::of(&e))?;
        let known: Vec<String> = all.iter().map(|s| s.object.clone()).collect();
        all.retain(|s| object.is_none_or(|o| s.object == o));
        let one = all.first().map(|s| s.object.clone());
        if all.is_empty() || all.iter().any(|s| Some(&s.object) != one.as_ref()) {
            return Err(choose("object", object, file, &known));
        }
        let Some((segment, state)) = all.iter().find_map(|s| Some((s, s.state(&epoch)?))) else {
            let covers: Vec<String> = all
                .iter()
                .filter_map(Segment::covers)
                .map(|(a, b)| format!("{a} to {b}"))
                .collect();
            let fact = format!("`{file}` has no state at the epoch of the world, {epoch}");
            return Err(BuildError::new(fact).help(format!("it covers {}", covers.join("; "))));
        };
        let own = self.params.body.word();
        if !segment.centre.eq_ignore_ascii_case(own) {
            let fact = format!(
                "`{file}` is about `{}`, but the body of the world is `{own}`",
                segment.centre
            );
            return Err(BuildError::new(fact).help("use a message with the same `CENTER_NAME`"));
        }
        Ok((axes(file, segment)?, state))
    }
}

/// The axes of a segment.
fn axes(file: &str, segment: &Segment) -> Result<StartFrame, BuildError> {
    let frame = match segment.frame.as_str() {
        "ICRF" | "GCRF" => return Ok(StartFrame::Icrf),
        "EME2000" => return Ok(StartFrame::Eme2000),
        frame => frame,
    };
    if let Some(epoch) = &segment.frame_epoch {
        let fact = format!(
            "`{file}`: the frame {frame} is frozen at {epoch} (`REF_FRAME_EPOCH`), which is not supported"
        );
        return Err(BuildError::new(fact).help("convert it to ICRF, GCRF or EME2000"));
    }
    Ok(match frame {
        "TEME" => StartFrame::Teme,
        frame if frame.starts_with("ITRF") => StartFrame::Itrf,
        frame => {
            let fact = format!("`{file}`: `REF_FRAME = {frame}` is not supported");
            return Err(
                BuildError::new(fact).help("convert it to ICRF, GCRF, EME2000, ITRF or TEME")
            );
        }
    })
}

/// Returns the error for a file in which one of several names must be selected.
fn choose(field: &str, written: Option<&str>, file: &str, known: &[String]) -> BuildError {
    let fact = match written {
        Some(name) => format!("{file} has no `{name}`"),
        None => format!("{file} has several, and `{field}` does not select one"),
    };
    let mut names = known.to_vec();
    names.dedup();
    let more = names.len().saturating_sub(8);
    names.truncate(8);
    let and = if more > 0 { format!(" and {more} more") } else { String::new() };
    BuildError::new(fact).help(format!("write `{field}` with one of: {}{and}", names.join(", ")))
}

#[cfg(test)]
mod tests;

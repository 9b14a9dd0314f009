//! Lengths of units, and coordinate systems in well-known text.

use super::HeightsError;
use super::degrees::Ellipsoid;
use super::projection::{self, Projection};

/// Returns the length in metres of a unit, with names of labels and bands: `METERS`, `m/pixel`, `KM`, `US survey foot`.
pub(super) fn metres(place: &str, unit: &str) -> Result<f64, HeightsError> {
    let name = unit.split('/').next().unwrap_or_default().trim().to_lowercase();
    match name.as_str() {
        "" | "m" | "meter" | "meters" | "metre" | "metres" => Ok(1.0),
        "km" | "kilometer" | "kilometers" | "kilometre" | "kilometres" => Ok(1000.0),
        "cm" | "centimeter" | "centimeters" => Ok(0.01),
        "mm" | "millimeter" | "millimeters" => Ok(0.001),
        "ft" | "foot" | "feet" | "international foot" => Ok(0.3048),
        "us survey foot" | "us survey feet" | "us-ft" | "ftus" | "ft_us" | "foot_us" | "ussft"
        | "us_survey_foot" => Ok(1200.0 / 3937.0),
        _ => Err(HeightsError::at(
            place,
            format!("`{unit}` is not a known unit of length"),
            "write m, km, cm, mm, ft or US survey foot",
        )),
    }
}

/// Returns the length of a linear unit with an EPSG code, in metres.
pub(super) fn epsg(code: u16) -> Option<f64> {
    match code {
        9001 => Some(1.0),
        9002 => Some(0.3048),
        9003 => Some(1200.0 / 3937.0),
        9036 => Some(1000.0),
        9005 => Some(0.304_797_265_4),
        9030 => Some(1852.0),
        9093 => Some(1609.344),
        9096 => Some(0.9144),
        1025 => Some(0.001),
        1033 => Some(0.01),
        _ => None,
    }
}

/// The coordinates of a map according to well-known text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WellKnown {
    /// Coordinates.
    pub horizontal: Horizontal,
    /// Length of the unit of heights, in metres.
    pub vertical: f64,
}

/// Horizontal coordinates in well-known text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Horizontal {
    /// Lengths: their unit in metres, and a projection that stretches them with its false northing.
    Lengths(f64, Option<(Projection, f64)>),
    /// Degrees on an ellipsoid, if the text specifies one.
    Degrees(Option<Ellipsoid>),
}

/// Reads well-known text; an empty text means metres.
pub(super) fn well_known(text: &str) -> Result<WellKnown, HeightsError> {
    let upper = text.to_uppercase();
    let vertical = node(&upper, &["VERTCS[", "VERT_CS[", "VERTCRS[", "VERTICALCRS["]);
    let vertical = vertical.map_or(Ok(1.0), unit)?;
    if let Some(projected) = node(&upper, &["PROJCS[", "PROJCRS[", "PROJECTEDCRS["]) {
        let projection = projection::of_text(projected, ellipsoid(projected));
        return Ok(WellKnown {
            horizontal: Horizontal::Lengths(unit(projected)?, projection),
            vertical,
        });
    }
    let geographic = node(&upper, &["GEOGCS[", "GEOGCRS[", "GEOGRAPHICCRS[", "GEODCRS["]);
    let horizontal = match geographic {
        None => Horizontal::Lengths(1.0, None),
        Some(inner) => Horizontal::Degrees(ellipsoid(inner)),
    };
    Ok(WellKnown { horizontal, vertical })
}

/// Returns the text inside the brackets of the first node with one of these heads.
fn node<'a>(text: &'a str, heads: &[&str]) -> Option<&'a str> {
    let from = heads.iter().filter_map(|h| text.find(h).map(|at| at + h.len())).min()?;
    let mut depth = 1;
    for (at, c) in text[from..].char_indices() {
        depth += match c {
            '[' => 1,
            ']' => -1,
            _ => 0,
        };
        if depth == 0 {
            return Some(&text[from..from + at]);
        }
    }
    Some(&text[from..])
}

/// Returns the length in metres of the last unit directly inside a node; units of angles are in separate nodes.
fn unit(inside: &str) -> Result<f64, HeightsError> {
    let (mut depth, mut unit) = (0, None);
    for (at, c) in inside.char_indices() {
        match c {
            '[' => {
                if depth == 0 && inside[..at].ends_with("UNIT") {
                    let number = inside[at + 1..].split(',').nth(1).unwrap_or_default();
                    unit = number.split(']').next();
                }
                depth += 1;
            }
            ']' => depth -= 1,
            _ => {}
        }
    }
    match unit.map(|u| u.trim().parse::<f64>()) {
        None => Ok(1.0),
        Some(Ok(metres)) if metres > 0.0 && metres.is_finite() => Ok(metres),
        Some(_) => Err(HeightsError::at(
            "the .prj file",
            "its unit of length is not a number",
            "write `UNIT[\"metre\",1]`, or remove the file",
        )),
    }
}

/// Returns the ellipsoid of a node with degrees: `SPHEROID["name",a,1/f]`.
fn ellipsoid(inside: &str) -> Option<Ellipsoid> {
    let inner = node(inside, &["SPHEROID[", "ELLIPSOID["])?;
    let mut numbers = inner.split(',').skip(1).map(|n| n.trim().parse::<f64>());
    let (Some(Ok(major)), Some(Ok(inverse))) = (numbers.next(), numbers.next()) else {
        return None;
    };
    let flattening = if inverse > 1.0 { 1.0 / inverse } else { 0.0 };
    (major > 0.0 && major.is_finite()).then_some(Ellipsoid { major, flattening })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_of_a_projection_is_not_that_of_its_angles() {
        let feet = r#"PROJCS["x",GEOGCS["y",DATUM["d",SPHEROID["s",1,2]],PRIMEM["g",0],UNIT["Degree",0.0174532925]],PROJECTION["p"],UNIT["Foot_US",0.3048006]]"#;
        let lengths = |horizontal, vertical| WellKnown {
            horizontal: Horizontal::Lengths(horizontal, None),
            vertical,
        };
        assert_eq!(well_known(feet).unwrap(), lengths(0.3048006, 1.0));
        // A vertical system has its own unit, which does not change the unit of the coordinates.
        let vertical =
            r#",VERTCS["NAVD88",VDATUM["v"],PARAMETER["Direction",1],UNIT["Foot",0.3048]]"#;
        let in_metres = feet.replace("0.3048006", "1");
        assert_eq!(well_known(&(in_metres.clone() + vertical)).unwrap(), lengths(1.0, 0.3048));
        let compound = format!(r#"COMPD_CS["both",{in_metres}{vertical}]"#);
        assert_eq!(well_known(&compound).unwrap(), lengths(1.0, 0.3048));
        let degrees =
            r#"GEOGCS["y",DATUM["d",SPHEROID["s",3396190,169.894]],UNIT["Degree",0.0174532925]]"#;
        let mars = Ellipsoid { major: 3396190.0, flattening: 1.0 / 169.894 };
        let horizontal = Horizontal::Degrees(Some(mars));
        assert_eq!(well_known(degrees).unwrap(), WellKnown { horizontal, vertical: 1.0 });
        assert_eq!(well_known("").unwrap(), lengths(1.0, 1.0));
        assert!(well_known(r#"PROJCS["x",UNIT["m",zero]]"#).is_err());
        assert_eq!(metres("UNIT", "KM/PIXEL").unwrap(), 1000.0);
        assert!(metres("UNIT", "furlong").unwrap_err().to_string().contains("furlong"));
    }
}

//! Lengths of units, and what well-known text says of coordinates.

use super::HeightsError;

/// Metres of a unit's name, as labels write it: `METERS`, `m/pixel`, `KM`.
pub(super) fn metres(place: &str, unit: &str) -> Result<f64, HeightsError> {
    let name = unit.split('/').next().unwrap_or_default().trim().to_lowercase();
    match name.as_str() {
        "" | "m" | "meter" | "meters" | "metre" | "metres" => Ok(1.0),
        "km" | "kilometer" | "kilometers" | "kilometre" | "kilometres" => Ok(1000.0),
        "cm" | "centimeter" | "centimeters" => Ok(0.01),
        "mm" | "millimeter" | "millimeters" => Ok(0.001),
        _ => Err(HeightsError::at(
            place,
            format!("`{unit}` is no unit of length that is known here"),
            "it is m, km, cm or mm",
        )),
    }
}

/// Metres of a linear unit by its EPSG code.
pub(super) fn epsg(code: u16) -> Option<f64> {
    match code {
        9001 => Some(1.0),
        9002 => Some(0.3048),
        9003 => Some(1200.0 / 3937.0),
        9036 => Some(1000.0),
        1025 => Some(0.001),
        1033 => Some(0.01),
        _ => None,
    }
}

/// That coordinates described by well-known text are lengths; metres of their unit.
pub(super) fn well_known(text: &str) -> Result<Option<f64>, HeightsError> {
    let upper = text.to_uppercase();
    let projected = ["PROJCS[", "PROJCRS[", "PROJECTEDCRS["].iter().any(|k| upper.contains(k));
    let geographic = ["GEOGCS[", "GEOGCRS[", "GEODCRS["].iter().any(|k| upper.contains(k));
    if geographic && !projected {
        return Ok(None);
    }
    // The last unit at the outermost level is that of the coordinates.
    let mut unit = None;
    let mut depth = 0;
    for (at, c) in upper.char_indices() {
        match c {
            '[' => {
                depth += 1;
                let head = &upper[..at];
                if depth == 2 && (head.ends_with("UNIT")) {
                    let inner = &upper[at + 1..];
                    let number = inner.split(',').nth(1).unwrap_or_default();
                    unit = number
                        .trim_end_matches(|c: char| c == ']' || c.is_whitespace())
                        .split(']')
                        .next();
                }
            }
            ']' => depth -= 1,
            _ => {}
        }
    }
    match unit.map(|u| u.trim().parse::<f64>()) {
        None => Ok(Some(1.0)),
        Some(Ok(metres)) if metres > 0.0 && metres.is_finite() => Ok(Some(metres)),
        Some(_) => Err(HeightsError::at(
            "the .prj file",
            "its unit of length is no number",
            "write `UNIT[\"metre\",1]`, or take the file away",
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_of_a_projection_is_not_that_of_its_angles() {
        let feet = r#"PROJCS["x",GEOGCS["y",DATUM["d",SPHEROID["s",1,2]],PRIMEM["g",0],UNIT["Degree",0.0174532925]],PROJECTION["p"],UNIT["Foot_US",0.3048006]]"#;
        assert_eq!(well_known(feet).unwrap(), Some(0.3048006));
        let degrees = r#"GEOGCS["y",DATUM["d",SPHEROID["s",1,2]],UNIT["Degree",0.0174532925]]"#;
        assert_eq!(well_known(degrees).unwrap(), None);
        assert_eq!(well_known("").unwrap(), Some(1.0));
        assert!(well_known(r#"PROJCS["x",UNIT["m",zero]]"#).is_err());
        assert_eq!(metres("UNIT", "KM/PIXEL").unwrap(), 1000.0);
        assert!(metres("UNIT", "furlong").unwrap_err().to_string().contains("furlong"));
    }
}

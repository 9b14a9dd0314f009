//! ESRI ASCII grids (.asc): a header of names and numbers, then the heights, the northern row first.
//! ```text
//! xllcorner, yllcorner   south-west corner of the south-west cell: its node is half a cell from there
//! xllcenter, yllcenter   its node
//! cellsize               or dx and dy
//! ```
//! Coordinates and heights are in metres unless a `.prj` file next to it specifies other units.

use super::degrees::degrees_apart;
use super::units::Horizontal;
use super::{Heights, HeightsError, HeightsOptions, bounded, datum, length, text, units};

const KEYS: [&str; 10] = [
    "ncols",
    "nrows",
    "xllcorner",
    "xllcenter",
    "yllcorner",
    "yllcenter",
    "cellsize",
    "dx",
    "dy",
    "nodata_value",
];

/// Reads the grid of a text; `projection`: well-known text of its coordinates.
pub(super) fn grid(
    bytes: &[u8],
    projection: Option<&[u8]>,
    options: &HeightsOptions,
) -> Result<Heights, HeightsError> {
    let whole = text(bytes);
    let mut header: [Option<f64>; KEYS.len()] = [None; KEYS.len()];
    let mut lines = whole.lines().enumerate().peekable();
    while let Some((at, line)) = lines.peek().copied() {
        let line = line.trim();
        let first = line.chars().next();
        if first.is_some_and(|c| !c.is_ascii_alphabetic()) || is_value(line) {
            break;
        }
        lines.next();
        if line.is_empty() {
            continue;
        }
        let place = format!("line {}", at + 1);
        let (name, number) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let key = name.to_lowercase();
        let Some(k) = KEYS.iter().position(|k| *k == key) else {
            let known = KEYS.join(", ");
            return Err(HeightsError::at(
                place,
                format!("`{name}` is not an entry of the header"),
                format!("entries: {known}"),
            ));
        };
        let value = number.trim().parse::<f64>().map_err(|_| {
            HeightsError::at(
                &place,
                format!("`{number}` is not a number"),
                "write one number with a decimal point after a name",
            )
        })?;
        if header[k].replace(value).is_some() {
            return Err(HeightsError::at(
                place,
                format!("`{name}` is written twice"),
                "write it once",
            ));
        }
    }
    let of = |key: &str| KEYS.iter().position(|k| *k == key).and_then(|k| header[k]);
    let count = |key: &str| {
        let fault = |fact: String| HeightsError::at(key, fact, "write their number, 2 or more");
        let n = of(key).ok_or_else(|| fault("it is missing from the header".into()))?;
        match (1.0..=1e9).contains(&n) && n.fract() == 0.0 {
            true => Ok(n as u64),
            false => Err(fault(format!("{n} is not a valid number of nodes"))),
        }
    };
    let (nx, ny) = (count("ncols")?, count("nrows")?);
    // Each height takes at least one digit and a space.
    bounded(bytes.len() as u64, nx, ny, 1)?;
    let missing = of("nodata_value");
    let (nx, ny) = (nx as usize, ny as usize);
    let known = units::well_known(&text(projection.unwrap_or_default()))?;
    let mut heights = vec![0.0; nx * ny];
    let (mut read, mut datum) = (0, None);
    for (at, line) in lines {
        for word in line.split_whitespace() {
            let place = || format!("line {}", at + 1);
            let value = word.parse::<f64>().map_err(|_| {
                HeightsError::at(
                    place(),
                    format!("`{word}` is not a height"),
                    "heights must be numbers with a decimal point, separated by blanks",
                )
            })?;
            if read == nx * ny {
                return Err(HeightsError::at(
                    place(),
                    format!("there are more heights than {nx} by {ny}"),
                    "correct ncols and nrows",
                ));
            }
            let gone = value.is_nan() || missing.is_some_and(|m| value == m);
            let (row, column) = (read / nx, read % nx);
            let height = value * known.vertical;
            heights[(ny - 1 - row) * nx + column] = match gone {
                true => f32::NAN,
                false => (height - *datum.get_or_insert_with(|| datum::of(height))) as f32,
            };
            read += 1;
        }
    }
    if read < nx * ny {
        return Err(HeightsError::content(
            format!("it ends after {read} heights of {nx} by {ny}"),
            "correct ncols and nrows, or use the complete file",
        ));
    }
    let size = |key: &str| of(key).or(of("cellsize"));
    let own = match (size("dx"), size("dy")) {
        (Some(x), Some(y)) => Some([length("cellsize", x)?, length("cellsize", y)?]),
        _ => None,
    };
    let (spacing, origin) = match (options.spacing, own) {
        (Some(spacing), _) => (spacing, [0.0, 0.0]),
        (None, None) => return Err(HeightsError::NoScale { what: "the ASCII grid" }),
        (None, Some(own)) => {
            let first = |centre: &str, corner: &str, size: f64| match (of(centre), of(corner)) {
                (Some(at), _) => at,
                (None, Some(at)) => at + 0.5 * size,
                (None, None) => 0.0,
            };
            let x = first("xllcenter", "xllcorner", own[0]);
            let y = first("yllcenter", "yllcorner", own[1]);
            match known.horizontal {
                Horizontal::Degrees(ellipsoid) => {
                    (degrees_apart(ellipsoid, own, y, ny)?, [0.0, 0.0])
                }
                // Such files have nodes that are 1 or 3 arc seconds apart (0.0003 or 0.0008 degrees), whereas no map
                // has nodes less than a millimetre apart.
                Horizontal::Lengths(..) if projection.is_none() && own[0].max(own[1]) < 1e-3 => {
                    return Err(HeightsError::Degrees { x: own[0], y: own[1] });
                }
                Horizontal::Lengths(unit, stretched) => {
                    let (spacing, origin) = (own.map(|s| s * unit), [x * unit, y * unit]);
                    match stretched {
                        Some((map, northing)) => map.apart(spacing, origin, northing * unit, ny)?,
                        None => (spacing, origin),
                    }
                }
            }
        }
    };
    Ok(Heights { nx, ny, heights, datum: datum.unwrap_or(0.0), spacing, origin })
}

/// A row of heights may begin with a word for a number: `nan`, `inf`.
fn is_value(line: &str) -> bool {
    line.split_whitespace().next().is_some_and(|word| word.parse::<f64>().is_ok())
}

//! Lists of points (.xyz): `x y z` per line, in any order, on a regular grid; other points are rejected.
//! ```text
//! i = (x − x_min)/s_x,  s_x: the least distance of two x that differ     |i − round(i)| ≤ 0.01
//! ```
//! Columns are separated by blanks, commas or semicolons; a number in a line with semicolons may have a decimal comma. Lines that begin with `#` or `//` are comments, and the first line may contain names of the
//! columns. Nodes without a point have no data.

use super::{Heights, HeightsError, HeightsOptions, NODES_MAX, bounded, datum, length, text};

/// Maximum distance of a point from a node because of rounding, relative to the spacing.
const ASIDE: f64 = 0.01;

/// Maximum number of nodes per point: a nearly empty grid is not a grid.
const EMPTY: u64 = 100;

/// Reads the grid of a list.
pub(super) fn points(bytes: &[u8], options: &HeightsOptions) -> Result<Heights, HeightsError> {
    let whole = text(bytes);
    let mut points: Vec<([f64; 2], f32, u32)> = Vec::new();
    let mut datum = None;
    let mut begun = false;
    for (at, line) in whole.lines().enumerate() {
        if points.len() as u64 == NODES_MAX {
            return Err(HeightsError::at(
                format!("line {}", at + 1),
                "there are more than 64 million points",
                "grid them to a GeoTIFF (`gdal_grid`) and convert it to tiles: `linkwork terrain convert`",
            ));
        }
        let line = line.trim();
        // Spreadsheet programs write separators in rows without content.
        let empty = line.trim_matches([',', ';', ' ', '\t']).is_empty();
        if empty || line.starts_with('#') || line.starts_with("//") {
            continue;
        }
        let decimal_comma = line.contains(';');
        let between = |c: char| c.is_whitespace() || c == ';' || (c == ',' && !decimal_comma);
        let words = || line.split(between).filter(|w| !w.is_empty());
        let number = |w: &str| match decimal_comma {
            true => w.replacen(',', ".", 1).parse::<f64>(),
            false => w.parse::<f64>(),
        };
        let mut numbers = words().map(number);
        let three = (numbers.next(), numbers.next(), numbers.next(), numbers.next());
        match three {
            (Some(Ok(x)), Some(Ok(y)), Some(Ok(z)), None) if x.is_finite() && y.is_finite() => {
                let datum: f64 = *datum.get_or_insert_with(|| datum::of(z));
                points.push(([x, y], (z - datum) as f32, at as u32 + 1));
            }
            _ if !begun && words().all(|w| number(w).is_err()) => {}
            _ => {
                return Err(HeightsError::at(
                    format!("line {}", at + 1),
                    "it is not a point".to_string(),
                    "write three numbers per line: x, y and height, separated by semicolons if they have a decimal comma",
                ));
            }
        }
        begun = true;
    }
    if points.is_empty() {
        return Err(HeightsError::content(
            "it does not contain points",
            "write three numbers per line: x y z",
        ));
    }
    let axes = [axis(&points, 0)?, axis(&points, 1)?];
    let (nx, ny) = (axes[0].nodes, axes[1].nodes);
    bounded(points.len() as u64, nx, ny, EMPTY)?;
    let (nx, ny) = (nx as usize, ny as usize);
    let mut heights = vec![f32::NAN; nx * ny];
    let mut from = vec![0u32; nx * ny];
    for ([x, y], z, line) in &points {
        let (i, j) = (axes[0].place(*x), axes[1].place(*y));
        for (name, place, axis, at) in [("x", i, axes[0], x), ("y", j, axes[1], y)] {
            if (place - place.round()).abs() > ASIDE {
                return Err(HeightsError::at(
                    format!("line {line}"),
                    format!(
                        "{name} = {at} is not at a node: nodes are {} apart, beginning at {}",
                        axis.spacing, axis.first
                    ),
                    "convert irregular points to a grid (`gdal_grid`)",
                ));
            }
        }
        let at = (j.round() as usize).min(ny - 1) * nx + (i.round() as usize).min(nx - 1);
        if from[at] > 0 && heights[at] != *z {
            return Err(HeightsError::at(
                format!("line {line}"),
                format!("line {} has another height for the same node", from[at]),
                "write one height per node",
            ));
        }
        (heights[at], from[at]) = (*z, *line);
    }
    let (spacing, origin) = match options.spacing {
        Some(spacing) => (spacing, [0.0, 0.0]),
        None => (axes.map(|a| a.spacing), axes.map(|a| a.first)),
    };
    Ok(Heights { nx, ny, heights, datum: datum.unwrap_or(0.0), spacing, origin })
}

#[derive(Clone, Copy)]
struct Axis {
    first: f64,
    spacing: f64,
    nodes: u64,
}

impl Axis {
    fn place(self, value: f64) -> f64 {
        (value - self.first) / self.spacing
    }
}

/// Returns the first node, spacing and number of nodes along an axis.
fn axis(points: &[([f64; 2], f32, u32)], k: usize) -> Result<Axis, HeightsError> {
    let name = ["x", "y"][k];
    let mut values: Vec<f64> = points.iter().map(|p| p.0[k]).collect();
    values.sort_by(f64::total_cmp);
    let (first, last) = (values[0], values[values.len() - 1]);
    // Rounding can split one value into two: such gaps are not the spacing.
    let noise = 1e-9 * first.abs().max(last.abs());
    let gaps = || values.windows(2).map(|w| w[1] - w[0]).filter(|g| *g > noise);
    let least = gaps().fold(f64::INFINITY, f64::min);
    if !least.is_finite() {
        return Err(HeightsError::content(
            format!("all points have the same {name}"),
            "a grid must have at least two rows and two columns",
        ));
    }
    let nodes = ((last - first) / least).round() + 1.0;
    if !(nodes <= NODES_MAX as f64) {
        return Err(HeightsError::content(
            format!(
                "points from {name} = {first} to {last} are at least {least} apart: {nodes:.0} nodes"
            ),
            "convert irregular points to a grid (`gdal_grid`)",
        ));
    }
    // The mean of all steps is more precise than the smallest one.
    let spacing = length(name, (last - first) / (nodes - 1.0))?;
    Ok(Axis { first, spacing, nodes: nodes as u64 })
}

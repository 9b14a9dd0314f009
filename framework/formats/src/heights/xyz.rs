//! Lists of points (.xyz): `x y z` a line, in any order, on a regular grid; other points are refused.
//! ```text
//! i = (x − x_min)/s_x,  s_x: the least distance of two x that differ     |i − round(i)| ≤ 0.01
//! ```
//! Columns are separated by blanks, commas or semicolons. Lines that begin with `#` or `//` are notes, and the first line may
//! name the columns. Nodes that no point names have no data.

use super::{Heights, HeightsError, HeightsOptions, NODES_MAX, bounded, datum, length, text};

/// How far from a node a point may be, in distances of nodes: digits that were cut off.
const ASIDE: f64 = 0.01;

/// Nodes for each point that there may be: a grid that is nearly empty is none.
const EMPTY: u64 = 100;

/// The grid of a list.
pub(super) fn points(bytes: &[u8], options: &HeightsOptions) -> Result<Heights, HeightsError> {
    let whole = text(bytes);
    let mut points: Vec<([f64; 2], f32, u32)> = Vec::new();
    let mut datum = None;
    let mut begun = false;
    for (at, line) in whole.lines().enumerate() {
        if points.len() as u64 == NODES_MAX {
            return Err(HeightsError::at(
                format!("line {}", at + 1),
                "there are more than 64 million points before it",
                "grid them to a GeoTIFF (`gdal_grid`) and make tiles of that: `linkwork terrain convert`",
            ));
        }
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') || line.starts_with("//") {
            continue;
        }
        let words = || {
            line.split(|c: char| c.is_whitespace() || c == ',' || c == ';')
                .filter(|w| !w.is_empty())
        };
        let mut numbers = words().map(str::parse::<f64>);
        let three = (numbers.next(), numbers.next(), numbers.next(), numbers.next());
        match three {
            (Some(Ok(x)), Some(Ok(y)), Some(Ok(z)), None) if x.is_finite() && y.is_finite() => {
                let datum: f64 = *datum.get_or_insert_with(|| datum::of(z));
                points.push(([x, y], (z - datum) as f32, at as u32 + 1));
            }
            _ if !begun && words().all(|w| w.parse::<f64>().is_err()) => {}
            _ => {
                return Err(HeightsError::at(
                    format!("line {}", at + 1),
                    "it is no point".to_string(),
                    "a line is three numbers: x, y and height",
                ));
            }
        }
        begun = true;
    }
    if points.is_empty() {
        return Err(HeightsError::content("it has no points", "a line is three numbers: x y z"));
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
                        "{name} = {at} is on no node: they are {} apart from {} on",
                        axis.spacing, axis.first
                    ),
                    "points of no regular grid have to be gridded (`gdal_grid`)",
                ));
            }
        }
        let at = (j.round() as usize).min(ny - 1) * nx + (i.round() as usize).min(nx - 1);
        if from[at] > 0 && heights[at] != *z {
            return Err(HeightsError::at(
                format!("line {line}"),
                format!("line {} gives the same node another height", from[at]),
                "give each node one height",
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

/// First node, spacing and number of nodes along an axis.
fn axis(points: &[([f64; 2], f32, u32)], k: usize) -> Result<Axis, HeightsError> {
    let name = ["x", "y"][k];
    let mut values: Vec<f64> = points.iter().map(|p| p.0[k]).collect();
    values.sort_by(f64::total_cmp);
    let (first, last) = (values[0], values[values.len() - 1]);
    // Rounding makes two of one value: such gaps are no distance of nodes.
    let noise = 1e-9 * first.abs().max(last.abs());
    let gaps = || values.windows(2).map(|w| w[1] - w[0]).filter(|g| *g > noise);
    let least = gaps().fold(f64::INFINITY, f64::min);
    if !least.is_finite() {
        return Err(HeightsError::content(
            format!("all points have one {name}"),
            "a grid has two rows and two columns at least",
        ));
    }
    let nodes = ((last - first) / least).round() + 1.0;
    if !(nodes <= NODES_MAX as f64) {
        return Err(HeightsError::content(
            format!(
                "points from {name} = {first} to {last} are {least} apart at least: {nodes:.0} nodes"
            ),
            "points of no regular grid have to be gridded (`gdal_grid`)",
        ));
    }
    // The mean of all steps has more digits than the least one.
    let spacing = length(name, (last - first) / (nodes - 1.0))?;
    Ok(Axis { first, spacing, nodes: nodes as u64 })
}

//! The figure of the main plots: one SVG file with a panel for each.
use crate::replace::{Durable, replace};
use plotters::prelude::*;
use std::path::Path;

/// One curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Points.
    pub points: Vec<(f64, f64)>,
    /// Draw only points, without a line.
    pub dots: bool,
}

/// One panel.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Title.
    pub title: String,
    /// Label of the horizontal axis.
    pub x: String,
    /// Label of the vertical axis.
    pub y: String,
    /// Curves.
    pub curves: Vec<Curve>,
    /// Equal scales on both axes (for maps).
    pub equal: bool,
}

/// A figure cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum PlotError {
    /// Error of the plotting library.
    #[error("picture `{path}`: {why}")]
    Drawing {
        /// The file.
        path: String,
        /// The reason.
        why: String,
    },
    /// The file cannot be written.
    #[error("{0}")]
    Writing(String),
}

/// Units of a drawing per pixel: the library rounds coordinates to whole units, and whole pixels would make steps in a smooth curve.
const FINE: u32 = 10;
/// Size of a panel.
const PANEL: (u32, u32) = (640 * FINE, 360 * FINE);

/// Draws the panels in two columns.
///
/// # Errors
/// The file cannot be written.
pub fn draw(path: &Path, plots: &[Plot]) -> Result<(), PlotError> {
    let fail = |why: String| PlotError::Drawing { path: path.display().to_string(), why };
    let columns = plots.len().clamp(1, 2);
    let rows = plots.len().div_ceil(columns).max(1);
    let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32);
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
        root.fill(&WHITE).map_err(|e| fail(e.to_string()))?;
        for (area, plot) in root.split_evenly((rows, columns)).iter().zip(plots) {
            panel(area, plot).map_err(|e| fail(e.to_string()))?;
        }
        root.present().map_err(|e| fail(e.to_string()))?;
    }
    // The picture has a pixel for `FINE` units.
    let (width, height) = size;
    let text = text.replacen(
        &format!("width=\"{width}\" height=\"{height}\""),
        &format!("width=\"{}\" height=\"{}\"", width / FINE, height / FINE),
        1,
    );
    replace(path, text.as_bytes(), Durable::Now).map_err(PlotError::Writing)
}

/// Values beyond this are not drawn, because the arithmetic of axes overflows long before that of numbers.
const LARGEST: f64 = 1e30;

fn can_be_drawn(p: &(f64, f64)) -> bool {
    p.0.abs() <= LARGEST && p.1.abs() <= LARGEST // false for NaN
}

/// Returns the range of an axis: wide enough that its tick labels differ.
fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (lo, hi) =
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if lo > hi {
        return (0.0, 1.0);
    }
    let size = lo.abs().max(hi.abs());
    if size < 1e-30 {
        return (-1e-3, 1e-3);
    }
    let pad = if hi - lo > 1e-9 * size { 0.05 * (hi - lo) } else { 0.5 * size };
    (lo - pad, hi + pad)
}

/// Returns the pieces of a curve between points that cannot be drawn.
fn stretches(points: &[(f64, f64)]) -> impl Iterator<Item = &[(f64, f64)]> {
    points.split(|p| !can_be_drawn(p)).filter(|s| !s.is_empty())
}

/// Colours of curves, repeated: ten colours that are distinguishable on white (Tableau 10).
const COLORS: [RGBColor; 10] = [
    RGBColor(31, 119, 180),
    RGBColor(255, 127, 14),
    RGBColor(44, 160, 44),
    RGBColor(214, 39, 40),
    RGBColor(148, 103, 189),
    RGBColor(140, 86, 75),
    RGBColor(227, 119, 194),
    RGBColor(127, 127, 127),
    RGBColor(188, 189, 34),
    RGBColor(23, 190, 207),
];

/// Text size of a legend, and height of a row.
const LEGEND: (u32, u32) = (12 * FINE, 18 * FINE);
/// Lengths in a legend: of the line that shows a colour, and between entries.
const SAMPLE: (i32, i32) = (16 * FINE as i32, 18 * FINE as i32);
/// Length between a sample of a line and its name in a legend.
const GAP: i32 = 6 * FINE as i32;
/// Margin around a panel, and space for the tick labels left of its axis.
const MARGIN: (u32, u32) = (12 * FINE, 64 * FINE);
/// Radius of a dot.
const DOT: u32 = 3 * FINE;

/// Returns the legend entry of a curve, if it has one.
fn entry(plot: &Plot, curve: &Curve) -> Option<String> {
    let lost = curve.points.iter().filter(|p| !can_be_drawn(p)).count();
    match lost {
        0 if plot.curves.len() < 2 => None,
        0 => Some(curve.name.clone()),
        n => Some(format!("{} ({n} points beyond 1e30 or NaN)", curve.name)),
    }
}

/// Draws the legend in rows between title and chart, so that it does not hide curves. Returns the remaining area.
fn legend<B: DrawingBackend>(
    area: &DrawingArea<B, plotters::coord::Shift>,
    plot: &Plot,
) -> Result<DrawingArea<B, plotters::coord::Shift>, DrawingAreaErrorKind<B::ErrorType>> {
    let font = ("sans-serif", LEGEND.0).into_text_style(area);
    let (left, right) = ((MARGIN.0 + MARGIN.1) as i32, (PANEL.0 - MARGIN.0) as i32);
    let (mut x, mut row) = (left, 0);
    let mut entries = Vec::new();
    for (k, curve) in plot.curves.iter().enumerate() {
        let Some(name) = entry(plot, curve) else { continue };
        let width = SAMPLE.0 + GAP + area.estimate_text_size(&name, &font)?.0 as i32;
        if x > left && x + width > right {
            (x, row) = (left, row + 1);
        }
        entries.push((k, name, x, row * LEGEND.1 as i32 + 8 * FINE as i32));
        x += width + SAMPLE.1;
    }
    if entries.is_empty() {
        return Ok(area.clone());
    }
    let (above, rest) = area.split_vertically((row + 1) * LEGEND.1 as i32);
    for (k, name, x, y) in entries {
        let color = COLORS[k % COLORS.len()].stroke_width(2 * FINE);
        if plot.curves[k].dots {
            above.draw(&Circle::new((x + SAMPLE.0 / 2, y), DOT, color.filled()))?;
        } else {
            above.draw(&PathElement::new(vec![(x, y), (x + SAMPLE.0, y)], color))?;
        }
        above.draw(&Text::new(
            name,
            (x + SAMPLE.0 + GAP, y - LEGEND.0 as i32 / 2),
            font.clone(),
        ))?;
    }
    Ok(rest)
}

fn panel<B: DrawingBackend>(
    area: &DrawingArea<B, plotters::coord::Shift>,
    plot: &Plot,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let points = || plot.curves.iter().flat_map(|c| &c.points).filter(|p| can_be_drawn(p));
    let (mut x, mut y) = (span(points().map(|p| p.0)), span(points().map(|p| p.1)));
    let area = area.margin(5 * FINE, 0, 0, 0);
    let area = legend(&area.titled(&plot.title, ("sans-serif", 18 * FINE))?, plot)?;
    if plot.equal {
        let (width, height) = area.dim_in_pixel();
        let aspect =
            f64::from(width - 100 * FINE) / f64::from(height.saturating_sub(60 * FINE).max(1));
        let (w, h) = (x.1 - x.0, y.1 - y.0);
        if w / h < aspect {
            let grow = 0.5 * (h * aspect - w);
            x = (x.0 - grow, x.1 + grow);
        } else {
            let grow = 0.5 * (w / aspect - h);
            y = (y.0 - grow, y.1 + grow);
        }
    }
    let mut chart = ChartBuilder::on(&area)
        .margin(MARGIN.0)
        .x_label_area_size(36 * FINE)
        .y_label_area_size(MARGIN.1)
        .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
    let font = ("sans-serif", 12 * FINE);
    chart
        .configure_mesh()
        .x_desc(&plot.x)
        .y_desc(&plot.y)
        .label_style(font)
        .axis_desc_style(font)
        .axis_style(BLACK.stroke_width(FINE))
        .bold_line_style(BLACK.mix(0.2).stroke_width(FINE))
        .light_line_style(WHITE)
        .set_all_tick_mark_size(5 * FINE)
        .draw()?;
    for (k, curve) in plot.curves.iter().enumerate() {
        let color = COLORS[k % COLORS.len()];
        for stretch in stretches(&curve.points) {
            if curve.dots {
                let dots = stretch.iter().map(|p| Circle::new(*p, DOT, color.filled()));
                chart.draw_series(dots)?;
            } else {
                chart.draw_series(LineSeries::new(
                    stretch.iter().copied(),
                    color.stroke_width(FINE),
                ))?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::channel;
    use std::time::Duration;

    fn drawn(values: &[f64], equal: bool) -> String {
        let points = values.iter().enumerate().map(|(k, y)| (k as f64, *y)).collect();
        let curves = vec![Curve { name: "curve".into(), points, dots: false }];
        let (x, y) = ("x".into(), "y".into());
        let plot = Plot { title: "Plot".into(), x, y, curves, equal };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plot.svg");
        draw(&path, &[plot]).unwrap();
        std::fs::read_to_string(path).unwrap()
    }

    #[test]
    fn any_numbers_make_a_picture_soon() {
        let cases: [&[f64]; 14] = [
            &[0.0, 1e308, 0.0],
            &[-1.7e308, 1.7e308],
            &[f64::NAN, f64::NAN],
            &[1.0, f64::NAN, 2.0, f64::INFINITY, f64::NEG_INFINITY],
            &[1e15, 1e15 + 0.125],
            &[1e29, 1e29 * (1.0 + 1e-15)],
            &[5e-324, 0.0],
            &[-5e-324, 5e-324],
            &[1e-320, 2e-320],
            &[1.0, 1.0 + f64::EPSILON],
            &[0.0, 0.0],
            &[],
            &[1e30, -1e30],
            &[1e-29, 3e-29],
        ];
        for values in cases {
            for equal in [false, true] {
                let (done, wait) = channel();
                let own = values.to_vec();
                std::thread::spawn(move || {
                    let _ = done.send(drawn(&own, equal));
                });
                // A failing plot would hang, whereas a working one takes some milliseconds.
                let svg = wait
                    .recv_timeout(Duration::from_secs(20))
                    .unwrap_or_else(|_| panic!("no picture of {values:?}, equal {equal}"));
                assert!(svg.contains("</svg>") && svg.contains("Plot"), "{values:?}");
                assert!(svg.len() < 200_000, "{values:?}: {} bytes", svg.len());
            }
        }
    }

    #[test]
    fn a_smooth_curve_has_no_steps() {
        let values: Vec<f64> = (0..2000).map(|k| (f64::from(k) * 1e-3).cos()).collect();
        let svg = drawn(&values, false);
        assert!(svg.contains("<svg width=\"640\" height=\"360\" viewBox=\"0 0 6400 3600\""));
        let curve = svg.split("<polyline").skip(1).max_by_key(|l| l.len()).unwrap();
        let points = curve.split("points=\"").nth(1).unwrap().split('"').next().unwrap();
        let points: Vec<(f64, f64)> = points
            .split_whitespace()
            .map(|p| p.split_once(',').unwrap())
            .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
            .collect();
        let [first, last] = [points[0], points[points.len() - 1]];
        // In pixels, each point lies within a tenth of the cosine through the first and the last point.
        let across = (last.0 - first.0) / 1.999;
        let up = (last.1 - first.1) / (1.999_f64.cos() - 1.0);
        for (x, y) in points {
            let exact = first.1 + up * (((x - first.0) / across).cos() - 1.0);
            assert!((y - exact).abs() < 0.1 * f64::from(FINE) + 1.0, "{x} {y} {exact}");
        }
    }

    #[test]
    fn what_is_not_drawn_is_said_and_the_rest_keeps_its_scale() {
        let svg = drawn(&[1.0, 2.0, f64::NAN, 1e300, 3.0, 4.0], false);
        assert!(svg.contains("2 points beyond 1e30 or NaN"), "{svg}");
        assert_eq!(
            svg.matches("<polyline").count(),
            drawn(&[1.0, 4.0], false).matches("<polyline").count() + 1 + 1
        );
        assert!(svg.contains("4.0") && !drawn(&[1.0, 4.0], false).contains("or NaN"));
    }

    /// Returns the numbers of an attribute of every element of one kind.
    fn numbers(svg: &str, element: &str, attribute: &str) -> Vec<f64> {
        let all = svg.split('<').filter(|e| e.starts_with(element));
        let value =
            |e: &str| e.split(&format!(" {attribute}=\"")).nth(1)?.split('"').next()?.parse().ok();
        all.filter_map(value).collect()
    }

    #[test]
    fn a_legend_lies_above_its_curves_and_within_its_panel() {
        let curve = |k: usize| Curve {
            name: format!("legend of wheel {k}, front left"),
            points: vec![(0.0, 0.0), (1.0, k as f64)],
            dots: k == 0,
        };
        let curves: Vec<Curve> = (0..9).map(curve).collect();
        let plot = |equal| {
            let (x, y) = ("x".into(), "y".into());
            Plot { title: "Loads".into(), x, y, curves: curves.clone(), equal }
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("plot.svg");
        for equal in [false, true] {
            draw(&path, &[plot(equal), plot(equal)]).unwrap();
            let svg = std::fs::read_to_string(&path).unwrap();
            let texts: Vec<&str> = svg.split("<text").filter(|t| t.contains("legend of")).collect();
            assert_eq!(texts.len(), 2 * 9);
            let texts = texts.iter().map(|t| format!("<text{t}")).collect::<String>();
            let (xs, ys) = (numbers(&texts, "text", "x"), numbers(&texts, "text", "y"));
            // Circles and lines of curves begin below the lowest row.
            let lowest = ys.iter().copied().fold(0.0, f64::max) + f64::from(LEGEND.0);
            let dots = numbers(&svg, "circle", "cy");
            assert_eq!(dots.len(), 2 * (1 + 2), "a sample and two points in each panel");
            assert_eq!(dots.iter().filter(|y| **y > lowest).count(), 2 * 2);
            let lines = svg.split('<').filter(|l| l.starts_with("polyline"));
            let lines = lines.filter(|l| l.contains(&format!("stroke-width=\"{FINE}\"")));
            let ends = lines.filter_map(|l| l.split("points=\"").nth(1)?.split('"').next());
            let highest = ends
                .flat_map(|e| {
                    e.split_whitespace().filter_map(|p| p.split(',').nth(1)?.parse().ok())
                })
                .fold(f64::INFINITY, f64::min);
            assert!(highest > lowest, "{highest} {lowest}");
            let width = f64::from(PANEL.0);
            assert!(
                xs.iter().all(|x| x % width > 0.11 * width && x % width < 0.76 * width),
                "{xs:?}"
            );
        }
    }
}

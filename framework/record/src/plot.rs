//! The picture of the main plots: one SVG with a panel for each.
use plotters::prelude::*;
use std::path::Path;

/// One curve.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Points.
    pub points: Vec<(f64, f64)>,
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
    /// One unit of x is as long as one of y (maps).
    pub equal: bool,
}

/// A picture cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[error("picture `{path}`: {why}")]
pub struct PlotError {
    path: String,
    why: String,
}

const PANEL: (u32, u32) = (640, 360);

/// Draws the panels two abreast.
///
/// # Errors
/// When the file cannot be written.
pub fn draw(path: &Path, plots: &[Plot]) -> Result<(), PlotError> {
    let fail = |why: String| PlotError { path: path.display().to_string(), why };
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
    std::fs::write(path, text).map_err(|e| fail(e.to_string()))
}

/// Values beyond this are not drawn: the arithmetic of axes overflows long before that of numbers.
const LARGEST: f64 = 1e30;

fn can_be_drawn(p: &(f64, f64)) -> bool {
    p.0.abs() <= LARGEST && p.1.abs() <= LARGEST // false for NaN
}

/// The range of an axis: wide enough that its marks are different numbers.
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

/// Stretches of a curve without the points that cannot be drawn.
fn stretches(points: &[(f64, f64)]) -> impl Iterator<Item = &[(f64, f64)]> {
    points.split(|p| !can_be_drawn(p)).filter(|s| !s.is_empty())
}

fn panel<B: DrawingBackend>(
    area: &DrawingArea<B, plotters::coord::Shift>,
    plot: &Plot,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let points = || plot.curves.iter().flat_map(|c| &c.points).filter(|p| can_be_drawn(p));
    let (mut x, mut y) = (span(points().map(|p| p.0)), span(points().map(|p| p.1)));
    if plot.equal {
        let aspect = f64::from(PANEL.0 - 100) / f64::from(PANEL.1 - 80);
        let (w, h) = (x.1 - x.0, y.1 - y.0);
        if w / h < aspect {
            let grow = 0.5 * (h * aspect - w);
            x = (x.0 - grow, x.1 + grow);
        } else {
            let grow = 0.5 * (w / aspect - h);
            y = (y.0 - grow, y.1 + grow);
        }
    }
    let mut chart = ChartBuilder::on(area)
        .caption(&plot.title, ("sans-serif", 18))
        .margin(12)
        .x_label_area_size(36)
        .y_label_area_size(64)
        .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
    chart.configure_mesh().x_desc(&plot.x).y_desc(&plot.y).light_line_style(WHITE).draw()?;
    for (k, curve) in plot.curves.iter().enumerate() {
        let color = Palette99::pick(k).to_rgba();
        // More points than pixels say nothing more.
        let stride = curve.points.len().div_ceil(4000).max(1);
        for stretch in stretches(&curve.points) {
            chart.draw_series(LineSeries::new(stretch.iter().step_by(stride).copied(), &color))?;
        }
        let lost = curve.points.iter().filter(|p| !can_be_drawn(p)).count();
        if plot.curves.len() > 1 || lost > 0 {
            let name = match lost {
                0 => curve.name.clone(),
                n => format!("{} ({n} points beyond 1e30 or no numbers)", curve.name),
            };
            let none = LineSeries::new(std::iter::empty::<(f64, f64)>(), &color);
            chart.draw_series(none)?.label(name).legend(move |(x, y)| {
                PathElement::new(vec![(x, y), (x + 16, y)], color.stroke_width(2))
            });
        }
    }
    let all = plot.curves.iter().map(|c| c.points.len()).sum();
    if plot.curves.len() > 1 || points().count() < all {
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .label_font(("sans-serif", 12))
            .draw()?;
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
        let curves = vec![Curve { name: "curve".into(), points }];
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
                // A hang is the failure: the picture itself takes some milliseconds.
                let svg = wait
                    .recv_timeout(Duration::from_secs(20))
                    .unwrap_or_else(|_| panic!("no picture of {values:?}, equal {equal}"));
                assert!(svg.contains("</svg>") && svg.contains("Plot"), "{values:?}");
                assert!(svg.len() < 200_000, "{values:?}: {} bytes", svg.len());
            }
        }
    }

    #[test]
    fn what_is_not_drawn_is_said_and_the_rest_keeps_its_scale() {
        let svg = drawn(&[1.0, 2.0, f64::NAN, 1e300, 3.0, 4.0], false);
        assert!(svg.contains("2 points beyond 1e30 or no numbers"), "{svg}");
        assert_eq!(
            svg.matches("<polyline").count(),
            drawn(&[1.0, 4.0], false).matches("<polyline").count() + 1 + 1
        );
        assert!(svg.contains("4.0") && !drawn(&[1.0, 4.0], false).contains("no numbers"));
    }
}

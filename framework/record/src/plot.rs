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

fn span(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (lo, hi) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if lo > hi {
        return (0.0, 1.0);
    }
    let pad = if hi > lo { 0.05 * (hi - lo) } else { 0.5 * lo.abs().max(1e-3) };
    (lo - pad, hi + pad)
}

fn panel<B: DrawingBackend>(
    area: &DrawingArea<B, plotters::coord::Shift>,
    plot: &Plot,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let points = || plot.curves.iter().flat_map(|c| &c.points);
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
        let line = LineSeries::new(curve.points.iter().step_by(stride).copied(), &color);
        let drawn = chart.draw_series(line)?;
        if plot.curves.len() > 1 {
            drawn.label(&curve.name).legend(move |(x, y)| {
                PathElement::new(vec![(x, y), (x + 16, y)], color.stroke_width(2))
            });
        }
    }
    if plot.curves.len() > 1 {
        chart
            .configure_series_labels()
            .background_style(WHITE.mix(0.8))
            .border_style(BLACK.mix(0.3))
            .label_font(("sans-serif", 12))
            .draw()?;
    }
    Ok(())
}

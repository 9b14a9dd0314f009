//! A plot of curves on two logarithmic axes, with panels side by side, as SVG text.

use std::fmt::Write as _;

/// One curve.
pub struct Curve {
    /// Its name, equal in each panel that contains it.
    pub name: String,
    /// Colour in CSS notation.
    pub color: String,
    /// Points, both coordinates positive.
    pub points: Vec<(f64, f64)>,
}

/// One panel.
pub struct Panel {
    /// Quantity that is plotted, with its unit.
    pub title: String,
    /// The curves.
    pub curves: Vec<Curve>,
    /// Start value, at the left, of the dashed lines that grow as x and as x³.
    pub low: f64,
}

const WIDTH: f64 = 340.0;
const HEIGHT: f64 = 300.0;
/// Left, right, top and bottom of the plot inside its panel.
const BOX: [f64; 4] = [62.0, 326.0, 34.0, 256.0];

/// Returns all panels with one legend below them.
pub fn svg(x_name: &str, panels: &[Panel]) -> String {
    let (width, height) = (WIDTH * panels.len() as f64, HEIGHT + 60.0);
    let mut s = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
         viewBox=\"0 0 {width} {height}\" font-family=\"DejaVu Sans, Verdana, sans-serif\" \
         font-size=\"12\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n"
    );
    let mut seen: Vec<(&str, &str)> = Vec::new();
    for (k, panel) in panels.iter().enumerate() {
        put(&mut s, &format!("<g transform=\"translate({} 0)\">", WIDTH * k as f64));
        draw(&mut s, x_name, panel);
        put(&mut s, "</g>");
        for c in &panel.curves {
            if !seen.iter().any(|(name, _)| *name == c.name) {
                seen.push((&c.name, &c.color));
            }
        }
    }
    for (k, (name, color)) in seen.iter().enumerate() {
        let (x, y) = (62.0 + 300.0 * (k % 3) as f64, HEIGHT + 14.0 + 22.0 * (k / 3) as f64);
        put(
            &mut s,
            &line((x, y), (x + 26.0, y), &format!("stroke=\"{color}\" stroke-width=\"2\"")),
        );
        put(&mut s, &text(x + 34.0, y + 4.0, "start", name));
    }
    let k = seen.len();
    let (x, y) = (62.0 + 300.0 * (k % 3) as f64, HEIGHT + 14.0 + 22.0 * (k / 3) as f64);
    put(&mut s, &line((x, y), (x + 26.0, y), DASHED));
    put(&mut s, &text(x + 34.0, y + 4.0, "start", "growth as n and as n³"));
    s + "</svg>\n"
}

const DASHED: &str = "stroke=\"#888888\" stroke-dasharray=\"4 4\"";

fn put(s: &mut String, line: &str) {
    writeln!(s, "{line}").expect("text");
}

fn line((x1, y1): (f64, f64), (x2, y2): (f64, f64), style: &str) -> String {
    format!("<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" {style}/>")
}

fn text(x: f64, y: f64, anchor: &str, text: &str) -> String {
    format!("<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>")
}

fn draw(s: &mut String, x_name: &str, panel: &Panel) {
    let [left, right, top, bottom] = BOX;
    let points = || panel.curves.iter().flat_map(|c| &c.points);
    let largest = |at: fn(&(f64, f64)) -> f64| points().map(at).fold(1.0_f64, f64::max);
    let (x_end, y_end) = (largest(|p| p.0), 10_f64.powf(largest(|p| p.1).log10().ceil()));
    let y_start = 10_f64.powf(points().map(|p| p.1).fold(y_end, f64::min).log10().floor());
    let x_at = |x: f64| left + (right - left) * x.log2() / x_end.log2();
    let y_at = |y: f64| bottom - (bottom - top) * (y / y_start).log10() / (y_end / y_start).log10();
    put(s, &text(0.5 * (left + right), 20.0, "middle", &panel.title));
    let mut x = 1.0;
    while x <= x_end {
        put(s, &line((x_at(x), top), (x_at(x), bottom), "stroke=\"#eeeeee\""));
        if (x as u64).ilog2() % 2 == 1 || x == 1.0 {
            put(s, &text(x_at(x), bottom + 16.0, "middle", &format!("{x}")));
        }
        x *= 2.0;
    }
    put(s, &text(0.5 * (left + right), bottom + 34.0, "middle", &format!("{x_name}, n")));
    for power in y_start.log10().round() as i32..=y_end.log10().round() as i32 {
        let y = 10_f64.powi(power);
        put(s, &line((left, y_at(y)), (right, y_at(y)), "stroke=\"#dddddd\""));
        put(s, &text(left - 6.0, y_at(y) + 4.0, "end", &label(power)));
    }
    put(
        s,
        &format!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#444444\"/>",
            right - left,
            bottom - top
        ),
    );
    for power in [1, 3] {
        // Lines start at the left or bottom border and end at the right or top border.
        let x_of = |y: f64| (y / panel.low).powf(1.0 / f64::from(power));
        let y_of = |x: f64| panel.low * x.powi(power);
        let start = if panel.low < y_start { (x_of(y_start), y_start) } else { (1.0, panel.low) };
        let end = if y_of(x_end) > y_end { (x_of(y_end), y_end) } else { (x_end, y_of(x_end)) };
        let place = |(x, y): (f64, f64)| (x_at(x), y_at(y));
        put(s, &line(place(start), place(end), DASHED));
    }
    for c in &panel.curves {
        let place = |(x, y): &(f64, f64)| format!("{:.1},{:.1}", x_at(*x), y_at(*y));
        let all: Vec<String> = c.points.iter().map(place).collect();
        put(
            s,
            &format!(
                "<polyline points=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>",
                all.join(" "),
                c.color
            ),
        );
    }
}

/// Returns the label of a power of 10, written in full while it is short.
fn label(power: i32) -> String {
    let digits = ["⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"];
    match power {
        -2..=3 => format!("{}", 10_f64.powi(power)),
        4.. => format!("10{}", digits[power as usize % 10]),
        _ => format!("10⁻{}", digits[-power as usize % 10]),
    }
}

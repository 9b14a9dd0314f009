//! Drawings of the report as SVG: histograms, scatter plots with ellipses, bars.
use crate::histories::Band;
use crate::statistics::{Ellipse, percentile};
use linkwork_formats::escaped;
use std::fmt::Write;

const WIDTH: f64 = 460.0;
const HEIGHT: f64 = 280.0;
/// Left, right, top and bottom of the frame.
const FRAME: (f64, f64, f64, f64) = (66.0, 446.0, 30.0, 236.0);

/// Formats a number with four or five digits.
pub fn short(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return format!("{x}");
    }
    if !(1e-3..1e6).contains(&x.abs()) {
        let text = format!("{x:.4e}");
        return match text.split_once('e') {
            Some((m, e)) => format!("{}e{e}", m.trim_end_matches('0').trim_end_matches('.')),
            None => text,
        };
    }
    let digits = (4 - x.abs().log10().floor() as i32).clamp(0, 8) as usize;
    let text = format!("{x:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => text,
    }
}

/// An axis from the smallest to the largest value, with a small margin and round ticks.
#[derive(Clone, Debug)]
struct Axis {
    low: f64,
    high: f64,
    ticks: Vec<f64>,
    begin: f64,
    end: f64,
}

impl Axis {
    fn new(values: impl Iterator<Item = f64>, begin: f64, end: f64) -> Axis {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.filter(|v| v.is_finite()) {
            (low, high) = (low.min(v), high.max(v));
        }
        if low > high {
            (low, high) = (0.0, 1.0);
        }
        if low == 0.0 && high == 0.0 {
            // All values are zero or missing, so the range is arbitrary.
            (low, high) = (-1.0, 1.0);
        }
        // Use half of the difference, because the difference can overflow.
        let half =
            (high / 2.0 - low / 2.0).max(1e-9 * low.abs().max(high.abs())).max(f64::MIN_POSITIVE);
        (low, high) = (low - 0.1 * half, high + 0.1 * half);
        Axis { low, high, ticks: ticks(low, high), begin, end }
    }

    fn at(&self, v: f64) -> f64 {
        let share = (v / 2.0 - self.low / 2.0) / (self.high / 2.0 - self.low / 2.0);
        self.begin + share.clamp(0.0, 1.0) * (self.end - self.begin)
    }
}

/// Returns three to seven round numbers between two; none if the numbers are too close for round ones.
fn ticks(low: f64, high: f64) -> Vec<f64> {
    let span = high - low;
    let rough = span / 5.0;
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].map(|m| m * power).into_iter().find(|s| *s >= rough);
    let Some(step) = step.filter(|s| s.is_finite() && *s > 0.0 && span.is_finite()) else {
        return vec![low, high];
    };
    let first = (low / step).ceil();
    (0..12).map(|k| (first + f64::from(k)) * step).take_while(|t| *t <= high).collect()
}

struct Picture(String);

impl Picture {
    fn new(title: &str) -> Picture {
        let title = escaped(title);
        Picture(format!(
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{title}\"><text class=\"title\" x=\"{:.1}\" \
             y=\"18\">{title}</text>",
            FRAME.0
        ))
    }

    fn put(&mut self, text: std::fmt::Arguments<'_>) {
        let _ = self.0.write_fmt(text);
    }

    fn axes(&mut self, x: &Axis, y: &Axis, xs: &str, ys: &str) {
        let (left, right, top, bottom) = FRAME;
        for t in &x.ticks {
            let at = x.at(*t);
            self.put(format_args!(
                "<path class=\"grid\" d=\"M{at:.1} {top}V{bottom}\"/><text class=\"tick\" x=\"{at:.1}\" y=\"{:.1}\" \
                 text-anchor=\"middle\">{}</text>",
                bottom + 14.0,
                short(*t)
            ));
        }
        for t in &y.ticks {
            let at = y.at(*t);
            self.put(format_args!(
                "<path class=\"grid\" d=\"M{left} {at:.1}H{right}\"/><text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\" \
                 text-anchor=\"end\">{}</text>",
                left - 5.0,
                at + 3.0,
                short(*t)
            ));
        }
        self.put(format_args!(
            "<path class=\"frame\" d=\"M{left} {top}V{bottom}H{right}\"/><text class=\"label\" x=\"{:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\">{}</text><text class=\"label\" transform=\"translate(12 {:.1}) rotate(-90)\" \
             text-anchor=\"middle\">{}</text>",
            (left + right) / 2.0,
            bottom + 32.0,
            escaped(xs),
            (top + bottom) / 2.0,
            escaped(ys)
        ));
    }

    fn end(mut self) -> String {
        self.0.push_str("</svg>");
        self.0
    }
}

/// Draws a histogram with lines at 5 %, 50 % and 95 %. The bin width is that of Freedman and Diaconis, with 5 to 60 bins.
pub fn histogram(title: &str, label: &str, values: &[f64]) -> String {
    let mut y: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    y.sort_by(f64::total_cmp);
    let mut p = Picture::new(title);
    let (left, right, top, bottom) = FRAME;
    let x = Axis::new(y.iter().copied(), left, right);
    let width = 2.0 * (percentile(&y, 0.75) - percentile(&y, 0.25)) / (y.len() as f64).cbrt();
    let wanted = ((x.high - x.low) / width).ceil();
    let bins = if wanted.is_finite() { wanted.clamp(5.0, 60.0) as usize } else { 20 };
    let mut counts = vec![0usize; bins];
    for v in &y {
        let share = (v / 2.0 - x.low / 2.0) / (x.high / 2.0 - x.low / 2.0);
        counts[((share * bins as f64) as usize).min(bins - 1)] += 1;
    }
    let most = counts.iter().copied().max().unwrap_or(0).max(1) as f64;
    let up = Axis {
        low: 0.0,
        high: 1.05 * most,
        ticks: ticks(0.0, 1.05 * most),
        begin: bottom,
        end: top,
    };
    p.axes(&x, &up, label, "runs");
    let wide = (right - left) / bins as f64;
    for (k, n) in counts.iter().enumerate().filter(|(_, n)| **n > 0) {
        let (at, high) = (left + k as f64 * wide, up.at(*n as f64));
        p.put(format_args!(
            "<rect class=\"bar\" x=\"{:.2}\" y=\"{high:.2}\" width=\"{:.2}\" height=\"{:.2}\"><title>{n} runs</title></rect>",
            at + 0.5,
            (wide - 1.0).max(0.5),
            bottom - high
        ));
    }
    for (q, name) in [(0.05, "5 %"), (0.5, "50 %"), (0.95, "95 %")] {
        if !y.is_empty() {
            let at = x.at(percentile(&y, q));
            p.put(format_args!(
                "<path class=\"mark\" d=\"M{at:.1} {top}V{bottom}\"/><text class=\"tick\" x=\"{:.1}\" y=\"{:.1}\">{name}</text>",
                at + 2.0,
                top + 8.0
            ));
        }
    }
    p.end()
}

/// Draws percentiles over time: two bands, the median, the limits. Instants without a value are omitted.
pub fn band(title: &str, label: &str, of: &Band) -> String {
    let (left, right, top, bottom) = FRAME;
    let [min, p5, p25, median, p75, p95, max] = &of.levels;
    let there: Vec<usize> =
        (0..of.times.len()).filter(|k| min[*k].is_finite() && max[*k].is_finite()).collect();
    let x = Axis::new(there.iter().map(|k| of.times[*k]), left, right);
    let y = Axis::new(there.iter().flat_map(|k| [min[*k], max[*k]]), bottom, top);
    let mut p = Picture::new(title);
    p.axes(&x, &y, "time [s]", label);
    let point =
        |k: &usize, level: &[f64]| format!("{:.1} {:.1}", x.at(of.times[*k]), y.at(level[*k]));
    let line = |level: &[f64]| there.iter().map(|k| point(k, level)).collect::<Vec<_>>();
    if there.is_empty() {
        return p.end();
    }
    for (class, low, high) in [("wide", p5, p95), ("close", p25, p75)] {
        let mut around = line(low);
        around.extend(line(high).into_iter().rev());
        p.put(format_args!("<path class=\"{class}\" d=\"M{}Z\"/>", around.join("L")));
    }
    for (class, level) in [("limit", min), ("limit", max), ("middle", median)] {
        p.put(format_args!("<path class=\"{class}\" d=\"M{}\"/>", line(level).join("L")));
    }
    p.end()
}

/// Largest number of points in a drawing; of more points, every k-th is drawn.
const POINTS: usize = 3000;

/// Draws points, optionally with the ellipses of one, two and three standard deviations.
pub fn scatter(
    title: &str,
    (xs, ys): (&str, &str),
    x: &[f64],
    y: &[f64],
    ellipses: Option<Ellipse>,
) -> String {
    let (left, right, top, bottom) = FRAME;
    let pairs: Vec<(f64, f64)> = x
        .iter()
        .copied()
        .zip(y.iter().copied())
        .filter(|(a, b)| a.is_finite() && b.is_finite())
        .collect();
    let turn = |k: i32| f64::from(k) * std::f64::consts::TAU / 72.0;
    let rings: Vec<Vec<(f64, f64)>> = ellipses
        .iter()
        .flat_map(|e| (1..=3).map(|w| (0..=72).map(|k| e.point(f64::from(w), turn(k))).collect()))
        .collect();
    let all = || pairs.iter().chain(rings.iter().flatten());
    let across = Axis::new(all().map(|p| p.0), left, right);
    let up = Axis::new(all().map(|p| p.1), bottom, top);
    let mut p = Picture::new(title);
    p.axes(&across, &up, xs, ys);
    // Few points are drawn larger.
    let size = if pairs.len() > 300 { 1.8 } else { 2.8 };
    for (a, b) in pairs.iter().step_by(pairs.len().div_ceil(POINTS).max(1)) {
        p.put(format_args!(
            "<circle class=\"dot\" cx=\"{:.1}\" cy=\"{:.1}\" r=\"{size}\"/>",
            across.at(*a),
            up.at(*b)
        ));
    }
    for ring in &rings {
        let points: Vec<String> =
            ring.iter().map(|(a, b)| format!("{:.1} {:.1}", across.at(*a), up.at(*b))).collect();
        p.put(format_args!("<path class=\"ring\" d=\"M{}\"/>", points.join("L")));
    }
    p.end()
}

/// Draws bars from −1 to 1, the largest first.
pub fn bars(title: &str, list: &[(String, f64)]) -> String {
    let mut list: Vec<&(String, f64)> = list.iter().filter(|(_, r)| r.is_finite()).collect();
    list.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()).then(a.0.cmp(&b.0)));
    list.truncate(12);
    let (left, right, top, bottom) = (252.0, FRAME.1, FRAME.2, FRAME.3);
    let across = Axis {
        low: -1.0,
        high: 1.0,
        ticks: vec![-1.0, -0.5, 0.0, 0.5, 1.0],
        begin: left,
        end: right,
    };
    let mut p = Picture::new(title);
    for t in &across.ticks {
        let at = across.at(*t);
        p.put(format_args!(
            "<path class=\"grid\" d=\"M{at:.1} {top}V{bottom}\"/><text class=\"tick\" x=\"{at:.1}\" y=\"{:.1}\" \
             text-anchor=\"middle\">{t}</text>",
            bottom + 14.0
        ));
    }
    let high = (bottom - top) / list.len().max(6) as f64;
    for (k, (name, r)) in list.iter().enumerate() {
        let (at, zero, end) = (top + (k as f64 + 0.5) * high, across.at(0.0), across.at(*r));
        p.put(format_args!(
            "<rect class=\"bar\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/><text class=\"tick\" x=\"{:.1}\" \
             y=\"{:.1}\" text-anchor=\"end\">{} ({r:+.2})<title>{}</title></text>",
            zero.min(end),
            at - 0.35 * high,
            (end - zero).abs().max(0.5),
            0.7 * high,
            left - 6.0,
            at + 3.0,
            escaped(&ending(name)),
            escaped(name)
        ));
    }
    p.end()
}

/// Returns the end of a long path, beginning at one of its names, because it is more informative than the beginning.
fn ending(name: &str) -> String {
    const ROOM: usize = 29;
    let fits = |text: &str| text.chars().count() <= ROOM;
    if fits(name) {
        return name.to_string();
    }
    let mut rest = name;
    while let Some((_, after)) = rest.split_once('.') {
        rest = after;
        if fits(rest) {
            return format!("…{rest}");
        }
    }
    format!("…{}", rest.chars().skip(rest.chars().count() - ROOM).collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_few() {
        assert_eq!(ticks(-1.0, 9.0), [0.0, 2.0, 4.0, 6.0, 8.0]);
        for (low, high) in [
            (1e-12, 3e-12),
            (-1e300, 1e300),
            (1e9, 1e9 + 1.0),
            (f64::MIN, f64::MAX),
            (5e-324, 1e-323),
        ] {
            let t = ticks(low, high);
            assert!(!t.is_empty() && t.len() <= 12, "{low} {high}: {t:?}");
        }
    }

    #[test]
    fn zeros_alone_have_an_axis_of_ordinary_numbers() {
        let svg = histogram("t", "y", &[0.0; 7]);
        assert!(
            svg.contains(">-1</text>") && svg.contains(">1</text>") && !svg.contains("e-3"),
            "{svg}"
        );
    }

    #[test]
    fn every_value_is_in_a_bin_and_numbers_of_any_size_are_drawn() {
        let counted = |values: &[f64]| -> usize {
            let svg = histogram("t", "y", values);
            svg.split("<title>")
                .skip(1)
                .map(|s| s.split(' ').next().unwrap().parse::<usize>().unwrap())
                .sum()
        };
        let normal: Vec<f64> =
            (1..1000).map(|k| crate::distribution::deviate(f64::from(k) / 1000.0)).collect();
        assert_eq!(counted(&normal), 999);
        assert_eq!(counted(&[3.0; 40]), 40);
        assert_eq!(counted(&[-1e308, 0.0, 1e308, f64::NAN, f64::INFINITY]), 3);
        assert_eq!(counted(&[]), 0);
        for wild in [&[-1e308, 1e308][..], &[0.0, 0.0], &[f64::NAN], &[1e-320, 2e-320]] {
            let drawn = scatter("t", ("x", "y"), wild, wild, Ellipse::of(wild, wild))
                + &bars("b", &[("a".into(), wild[0])]);
            assert!(!drawn.contains("NaN") && !drawn.contains("inf\""), "{drawn}");
        }
    }

    #[test]
    fn numbers_and_names_are_short() {
        let numbers = [
            (3.33e6, "3.33e6"),
            (-1e-7, "-1e-7"),
            (0.25, "0.25"),
            (123.456_78, "123.46"),
            (1e20, "1e20"),
        ];
        for (x, text) in numbers {
            assert_eq!(short(x), text);
        }
        assert_eq!(ending("Capsule.Environment.Atmosphere.density"), "…Atmosphere.density");
        assert_eq!(ending("Capsule.mass"), "Capsule.mass");
        assert_eq!(ending(&"é".repeat(40)).chars().count(), 30);
    }

    #[test]
    fn names_are_shown_and_not_obeyed() {
        let svg = histogram("<script>alert(1)</script>", "a & \"b\"", &[1.0, 2.0]);
        assert!(
            !svg.contains("<script")
                && svg.contains("&lt;script&gt;")
                && svg.contains("a &amp; &quot;b&quot;")
        );
    }
}

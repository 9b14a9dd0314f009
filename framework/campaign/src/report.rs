//! The report: one self-contained HTML page with its drawings.
use crate::campaign::Campaign;
use crate::results::{NAMES, Results, few};
use crate::sampling::Sampling;
use crate::statistics::Ellipse;
use crate::svg::{band, bars, histogram, scatter, short};
use linkwork_formats::escaped;
use linkwork_record::titled;
use linkwork_record::{Durable, replace};
use std::fmt::Write;
use std::path::Path;

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:1440px;padding:0 1rem;color:#1c2733;background:#fff}
h1{font-size:1.5rem}h2{font-size:1.15rem;margin-top:2rem;border-bottom:1px solid #d8dee6}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;display:block;overflow-x:auto}
td,th{padding:.2rem .6rem;text-align:right;border-bottom:1px solid #e4e9ef;white-space:nowrap}
td:first-child,th:first-child{text-align:left}td.text{text-align:left;white-space:normal}
.plots{display:flex;flex-wrap:wrap;gap:1rem}.plots svg{width:clamp(380px,calc((100% - 2rem)/3),460px);max-width:100%}
svg text{font:11px system-ui,sans-serif;fill:#3a4754}svg .title{font-size:13px;font-weight:600}svg .label{font-size:12px}
.grid{stroke:#e4e9ef;fill:none}.frame{stroke:#8593a3;fill:none}.bar{fill:#4c7fb0}.dot{fill:#1f4f7d;fill-opacity:.5}
svg .wide{fill:#4c7fb0;fill-opacity:.18}svg .close{fill:#4c7fb0;fill-opacity:.4}.middle{stroke:#1f4f7d;stroke-width:1.5;fill:none}.limit{stroke:#8593a3;stroke-dasharray:2 3;fill:none}.mark{stroke:#c2553a;stroke-dasharray:3 3;fill:none}.ring{stroke:#c2553a;fill:none;stroke-width:1.3}code{background:#f2f5f8;padding:0 .25em}";

/// Writes the report.
///
/// # Errors
/// A message with the file.
pub fn write(path: &Path, campaign: &Campaign, results: &Results) -> Result<(), String> {
    replace(path, page(campaign, results).as_bytes(), Durable::Now)
}

/// Returns the report as text.
pub fn page(campaign: &Campaign, results: &Results) -> String {
    let form = campaign.form();
    let mut out = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" \
         content=\"width=device-width\"><title>{0}</title><style>{STYLE}</style></head><body>\n<h1>{0}</h1>\n<p>{1}</p>\n",
        escaped(&form.name),
        escaped(&form.doc)
    );
    let how = match form.sampling {
        Sampling::Random => "independent draws",
        Sampling::LatinHypercube => "a Latin hypercube",
        Sampling::Sobol => "a scrambled Sobol sequence",
    };
    let done = results.done();
    let _ = write!(
        out,
        "<p>{done} of {} runs of <code>{}</code>, {how}, seed {}. Campaign {:016x}, linkwork {}.</p>\n<h2>How runs \
         ended</h2>\n<table><tr><th>cause</th><th>runs</th><th>share</th></tr>",
        form.runs,
        escaped(&campaign.simulation().display().to_string()),
        form.seed,
        campaign.identity(),
        env!("CARGO_PKG_VERSION")
    );
    for (cause, n) in &results.causes {
        let share = 100.0 * *n as f64 / done.max(1) as f64;
        let _ = write!(out, "<tr><td>{}</td><td>{n}</td><td>{share:.2} %</td></tr>", cause.name());
    }
    out.push_str("</table>\n");
    requirements(&mut out, results);
    failures(&mut out, results);
    statistics(&mut out, results);
    metrics(&mut out, results);
    together(&mut out, campaign, results);
    histories(&mut out, results);
    out.push_str("</body></html>\n");
    out
}

/// Writes how many runs satisfied the requirements, and why the others did not.
fn requirements(out: &mut String, results: &Results) {
    if results.missed.is_empty() {
        return;
    }
    let (kept, interval) = results.success();
    let interval = interval.map_or_else(String::new, |[from, to]| {
        format!(", with 95 % confidence {:.2} to {:.2} %", 100.0 * from, 100.0 * to)
    });
    let _ = write!(
        out,
        "<h2>Requirements</h2>\n<p>{} of {} runs satisfied all requirements: {:.2} %{interval}. A run can violate several requirements; <i>alone</i>: only this one.</p>\n<table><tr><th>cause</th><th>required</th><th>runs</th>\
         <th>share</th><th>alone</th><th>which</th></tr>",
        results.kept,
        results.done(),
        100.0 * kept
    );
    for m in &results.missed {
        let share = 100.0 * results.share(m);
        let _ = write!(
            out,
            "<tr><td class=\"text\">{}</td><td class=\"text\">{}</td><td>{}</td><td>{share:.2} %</td><td>{}</td><td class=\"text\">{}</td></tr>",
            escaped(&m.cause),
            escaped(&results.required(m)),
            m.runs.len(),
            m.alone,
            few(&m.runs, 12)
        );
    }
    out.push_str("</table>\n");
}

fn failures(out: &mut String, results: &Results) {
    if results.failures.is_empty() {
        return;
    }
    out.push_str(
        "<h2>Failures by cause</h2>\n<table><tr><th>cause</th><th>runs</th><th>which</th></tr>",
    );
    for (kind, runs) in &results.failures {
        let (kind, which) = (escaped(kind), few(runs, 12));
        let _ = write!(
            out,
            "<tr><td class=\"text\">{kind}</td><td>{}</td><td class=\"text\">{which}</td></tr>",
            runs.len()
        );
    }
    out.push_str("</table>\n<p>Digits are shown as #. The files of each failed run are in <code>failures</code>.</p>\n");
}

fn statistics(out: &mut String, results: &Results) {
    out.push_str("<h2>Metrics</h2>\n<table><tr><th>metric</th><th>unit</th><th>n</th><th>mean</th><th>± error</th><th>deviation</th>");
    for name in NAMES {
        let _ = write!(out, "<th>{name}</th>");
    }
    out.push_str("</tr>");
    for ((name, unit, _), s) in results.metrics.iter().zip(&results.summaries) {
        let _ = write!(
            out,
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>",
            escaped(name),
            escaped(unit),
            s.n,
            short(s.mean),
            if s.error.is_nan() { "n/a".into() } else { short(s.error) },
            short(s.deviation)
        );
        for p in s.percentiles {
            let _ = write!(out, "<td>{}</td>", short(p));
        }
        out.push_str("</tr>");
    }
    out.push_str("</table>\n");
    if results.sampling != Sampling::Random {
        let _ = writeln!(
            out,
            "<p>The runs of {} are not independent, so the error of a mean cannot be estimated from one campaign. Repeat \
             it with other seeds: the standard deviation of the means is the error of one of them.</p>",
            results.sampling.words()
        );
    }
}

/// Writes the distribution of each metric, its sensitivities, and a plot against the most influential value.
fn metrics(out: &mut String, results: &Results) {
    for (k, (name, unit, y)) in results.metrics.iter().enumerate() {
        let own = titled(name, unit);
        let _ = write!(out, "<h2>{}</h2>\n<div class=\"plots\">", escaped(name));
        out.push_str(&histogram("Distribution", &own, y));
        let ranked: Vec<(String, f64)> = results
            .drawn
            .iter()
            .map(|d| d.0.clone())
            .zip(results.sensitivity[k].iter().copied())
            .collect();
        if ranked.iter().any(|r| r.1.is_finite()) {
            out.push_str(&bars("Sensitivity (rank correlation)", &ranked));
        }
        let first = (0..ranked.len())
            .filter(|j| ranked[*j].1.is_finite())
            .max_by(|a, b| ranked[*a].1.abs().total_cmp(&ranked[*b].1.abs()));
        if let Some(j) = first {
            let (drawn, x) = &results.drawn[j];
            out.push_str(&scatter(
                "Against the most influential parameter",
                (drawn, &own),
                x,
                y,
                None,
            ));
        }
        out.push_str("</div>\n");
    }
}

/// Draws the scatter plots, with a table of their ellipses.
fn together(out: &mut String, campaign: &Campaign, results: &Results) {
    let form = campaign.form();
    // Returns the values, the title, and whether it is a metric.
    let values = |name: &str| {
        let metric = results.metrics.iter().find(|f| f.0 == name);
        let drawn = || {
            let title =
                form.drawn.iter().find(|d| d.name == name).map(|d| titled(name, &d.unit))?;
            results.drawn.iter().find(|d| d.0 == title)
        };
        match metric {
            Some((name, unit, x)) => Some((titled(name, unit), x, true)),
            None => drawn().map(|(title, x)| (title.clone(), x, false)),
        }
    };
    if results.scatter.is_empty() {
        return;
    }
    out.push_str("<h2>Scatter plots</h2>\n<p>Ellipses of one, two and three standard deviations if both are metrics. They contain 39.3 %, 86.5 % and 98.9 % of a normal distribution.</p>\n<div class=\"plots\">");
    for [a, b] in &results.scatter {
        let (Some((xs, x, first)), Some((ys, y, second))) = (values(a), values(b)) else {
            continue;
        };
        let ellipse = if first && second { Ellipse::of(x, y) } else { None };
        out.push_str(&scatter(&format!("{b} against {a}"), (&xs, &ys), x, y, ellipse));
    }
    out.push_str("</div>\n");
    ellipses(out, results);
}

/// Writes a table of the ellipses.
fn ellipses(out: &mut String, results: &Results) {
    if results.ellipses.is_empty() {
        return;
    }
    out.push_str(
        "<h2>Ellipses</h2>\n<table><tr><th>ellipse of</th><th>centre</th><th>half axes, 1σ</th><th>half axes, 99 %</th>\
         <th>angle of the long axis</th><th>runs in 99 %</th></tr>",
    );
    for f in &results.ellipses {
        let [(a, u, _), (b, ..)] = f.of.map(|k| &results.metrics[k]);
        let (e, (inside, n)) = (f.ellipse, f.within);
        let both = |x: f64, y: f64| format!("{} × {} {}", short(x), short(y), escaped(u));
        let _ = write!(
            out,
            "<tr><td>{}, {}</td><td>{}, {}</td><td>{}</td><td>{}</td><td>{}°</td><td>{inside} of {n}</td></tr>",
            escaped(&titled(a, u)),
            escaped(&titled(b, u)),
            short(e.centre.0),
            short(e.centre.1),
            both(e.axes.0, e.axes.1),
            both(f.half_axes().0, f.half_axes().1),
            short(e.angle.to_degrees())
        );
    }
    out.push_str(
        "</table>\n<p>The ellipse of 99 % is the one that contains this share of a normal distribution with the covariance of the runs. If the last column \
         differs much from 99 %, the distribution is not normal. The angle is from the first metric to the second.</p>\n",
    );
}

/// Draws the retained variables over time.
fn histories(out: &mut String, results: &Results) {
    if results.bands.is_empty() {
        return;
    }
    let (kept, orderly) = results.bands_of;
    let _ = write!(
        out,
        "<h2>Over time</h2>\n<p>Histories of {kept} of {orderly} runs that ended normally: median, from 25 % to 75 % and \
         from 5 % to 95 %; dashed: smallest and largest.</p>\n<div class=\"plots\">"
    );
    for b in &results.bands {
        out.push_str(&band(&b.name, &titled(&b.name, &b.unit), b));
    }
    out.push_str("</div>\n");
}

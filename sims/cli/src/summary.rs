//! `summary.json`, the picture of the plots, and what is said at the end of a run.
use crate::figures::{Figures, Thinned};
use linkwork_record::{Curve, Plot, draw};
use linkwork_runtime::{Place, Simulation};
use linkwork_viz::{Marker, Scene};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// How a run ended.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    /// The time given by `until`.
    Until,
    /// The variable given by `stop_when` became true.
    StopWhen,
    /// Ctrl-C.
    Interrupted,
    /// A state left the numbers.
    Failed(String),
    /// The log could not be written on.
    LogFailed(String),
}

/// What summary.json holds.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Name of the simulation.
    pub simulation: String,
    /// How it ended.
    pub ended: Ending,
    /// Simulated time at the end (s).
    pub time: f64,
    /// Hash of the state at the end.
    pub state_hash: String,
    /// Wall time of stepping (s).
    pub wall_time: f64,
    /// Simulated over wall time, of this process.
    pub real_time_factor: f64,
    /// Seed of all noise.
    pub seed: u64,
    /// The simulation's own figures: value and unit.
    pub figures: BTreeMap<String, (f64, String)>,
    /// Files written.
    pub files: Vec<PathBuf>,
}

/// Curves for the picture, in fixed memory.
pub struct Picture {
    curves: Vec<Vec<(String, Place, f64, Thinned)>>,
    titles: Vec<String>,
    map: Option<(Place, Place, Thinned)>,
    markers: Vec<Marker>,
    next: f64,
}

/// Time between points of the picture (s).
const EVERY: f64 = 0.05;

impl Picture {
    /// Of the panels of a scene, and the map of the followed body.
    pub fn new(sim: &Simulation, scene: &Scene) -> Picture {
        let plan = sim.plan();
        let curves = scene
            .panels
            .iter()
            .map(|p| {
                p.series
                    .iter()
                    .filter_map(|(label, path, factor)| {
                        let place = plan.variables.get(path)?.place;
                        Some((label.clone(), place, *factor, Thinned::new()))
                    })
                    .collect()
            })
            .collect();
        let map = scene
            .follow
            .as_ref()
            .and_then(|b| crate::scene::position(plan, b))
            .map(|(x, y)| (x, y, Thinned::new()));
        let titles = scene.panels.iter().map(|p| p.title.clone()).collect();
        Picture { curves, titles, map, markers: scene.markers.clone(), next: sim.time() }
    }

    /// Takes points when they are due.
    #[inline]
    pub fn sample(&mut self, sim: &Simulation) {
        let t = sim.time();
        if t < self.next {
            return;
        }
        self.next = t + EVERY;
        for (_, place, factor, points) in self.curves.iter_mut().flatten() {
            points.add(t, sim.value(*place) * *factor);
        }
        if let Some((x, y, points)) = &mut self.map {
            points.add(sim.value(*x), sim.value(*y));
        }
    }

    /// Draws it.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn draw(&self, path: &Path) -> Result<(), String> {
        let mut plots = Vec::new();
        if let Some((_, _, points)) = &self.map {
            let mut curves = vec![Curve { name: "driven".into(), points: points.points.clone() }];
            if !self.markers.is_empty() {
                let points = self.markers.iter().map(|m| (m.at.x, m.at.y)).collect();
                curves.push(Curve { name: "waypoints".into(), points });
            }
            let (x, y) = ("x [m]".into(), "y [m]".into());
            plots.push(Plot { title: "Map".into(), x, y, curves, equal: true });
        }
        for (title, curves) in self.titles.iter().zip(&self.curves) {
            let curves = curves
                .iter()
                .map(|(name, _, _, t)| Curve { name: name.clone(), points: t.points.clone() })
                .collect();
            let (x, y) = ("time [s]".into(), String::new());
            plots.push(Plot { title: title.clone(), x, y, curves, equal: false });
        }
        if plots.is_empty() {
            return Ok(());
        }
        draw(path, &plots).map_err(|e| e.to_string())
    }
}

/// Figures as name → (value, unit).
pub fn figures(figures: &Figures) -> BTreeMap<String, (f64, String)> {
    figures.results().map(|(n, v, u)| (n.to_string(), (v, u.to_string()))).collect()
}

/// Prints a summary for a person.
pub fn print(s: &Summary) {
    let how = match &s.ended {
        Ending::Until => "reached its end".to_string(),
        Ending::StopWhen => "stopped by its own condition".to_string(),
        Ending::Interrupted => "interrupted".to_string(),
        Ending::Failed(_) => "FAILED".to_string(),
        Ending::LogFailed(_) => "STOPPED, the log could not be written on,".to_string(),
    };
    say!("{}: {how} at t = {:.3} s", s.simulation, s.time);
    say!(
        "  {:.2} s of wall time, {:.0} times real time; state {}",
        s.wall_time,
        s.real_time_factor,
        s.state_hash
    );
    let width = s.figures.keys().map(String::len).max().unwrap_or(0);
    for (name, (value, unit)) in &s.figures {
        let unit = if unit == "1" { "" } else { unit };
        say!("  {name:width$}  {} {unit}", number(*value));
    }
    if s.files.is_empty() {
        return;
    }
    say!("files:");
    for file in &s.files {
        let hint = match file.extension().and_then(|e| e.to_str()) {
            Some("rrd") => "   open with: rerun <file>     (pip install rerun-sdk==0.36.3)",
            Some("mcap") => "   open with Rerun, Foxglove or PlotJuggler",
            Some("svg") => "   open with a browser",
            Some("lwck") => "   go on with: linkwork resume <file>",
            _ => "",
        };
        say!("  {}{hint}", file.display());
    }
}

/// Six digits, without trailing zeros.
fn number(v: f64) -> String {
    if v == 0.0 || (1e-3..1e6).contains(&v.abs()) {
        let digits = (5 - v.abs().max(1e-3).log10().floor() as i32).clamp(0, 8) as usize;
        let text = format!("{v:.digits$}");
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_string()
        } else {
            text
        }
    } else {
        format!("{v:.4e}")
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn numbers_are_short() {
        for (v, text) in [
            (0.0, "0"),
            (1.5, "1.5"),
            (123.456_789, "123.457"),
            (1e9, "1.0000e9"),
            (-0.25, "-0.25"),
        ] {
            assert_eq!(super::number(v), text);
        }
    }
}

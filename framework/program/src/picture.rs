//! The picture of the plots: its curves, taken in passing, in fixed memory.
use linkwork_record::{Curve, Plot, draw};
use linkwork_runtime::{Place, Simulation};
use linkwork_viz::{InUnit, Marker, Scene};
use std::fmt::Write;
use std::path::Path;
use textplots::{Chart, Plot as _, Shape};

/// Curves for the picture, in fixed memory.
pub struct Picture {
    curves: Vec<Vec<(String, Place, InUnit, Thinned)>>,
    titles: Vec<String>,
    map: Option<(Place, Place, Thinned)>,
    markers: Vec<Marker>,
    next: f64,
    /// Time between points, s.
    every: f64,
}

/// Time between points of a long run, s; a short one has [`POINTS`].
const EVERY: f64 = 0.05;
/// Points of a short run.
const POINTS: f64 = 500.0;
/// Runs longer than this have a time axis in hours, s.
const HOURS: f64 = 36_000.0;
/// Size of a curve in a terminal, in dots: eight to a character.
const TERMINAL: [u32; 2] = [120, 40];

impl Picture {
    /// Of the panels of a scene, and the map of the followed body, of a run to `until` (s), when that is known.
    pub fn new(sim: &Simulation, scene: &Scene, until: Option<f64>) -> Picture {
        let plan = sim.plan();
        let curves = scene
            .panels
            .iter()
            .map(|p| {
                p.series
                    .iter()
                    .filter_map(|(label, path, shown)| {
                        let place = plan.variables.get(path)?.place;
                        Some((label.clone(), place, *shown, Thinned::new()))
                    })
                    .collect()
            })
            .collect();
        let map = scene
            .follow
            .as_ref()
            .and_then(|b| crate::scene::position(plan, b))
            .map(|[x, y, _]| (x, y, Thinned::new()));
        let titles = scene.panels.iter().map(|p| p.title.clone()).collect();
        let next = sim.time();
        let every = until.map_or(EVERY, |until| EVERY.min((until - next).max(0.0) / POINTS));
        Picture { curves, titles, map, markers: scene.markers.clone(), next, every }
    }

    /// Takes points when they are due.
    #[inline]
    pub fn sample(&mut self, sim: &Simulation) {
        let t = sim.time();
        if t < self.next {
            return;
        }
        self.next = t + self.every;
        for (_, place, shown, points) in self.curves.iter_mut().flatten() {
            let value = sim.value(*place);
            if !value.is_nan() {
                points.add(t, shown.of(value));
            }
        }
        if let Some((x, y, points)) = &mut self.map {
            points.add(sim.value(*x), sim.value(*y));
        }
    }

    /// Whether there is anything to draw.
    pub fn is_empty(&self) -> bool {
        self.map.is_none() && self.titles.is_empty()
    }

    /// Draws it.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn draw(&self, path: &Path) -> Result<(), String> {
        draw(path, &self.plots()).map_err(|e| e.to_string())
    }

    /// The map, then the panels; time is in hours when the run is long.
    fn plots(&self) -> Vec<Plot> {
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
        let last = self.curves.iter().flatten().filter_map(|c| c.3.points.last());
        let end = last.fold(0.0_f64, |end, p| end.max(p.0));
        let (unit, name) = if end > HOURS { (3600.0, "h") } else { (1.0, "s") };
        for (title, curves) in self.titles.iter().zip(&self.curves) {
            let curves = curves
                .iter()
                .map(|(name, _, _, t)| {
                    let points = t.points.iter().map(|(t, y)| (t / unit, *y)).collect();
                    Curve { name: name.clone(), points }
                })
                .collect();
            let (x, y) = (format!("time [{name}]"), String::new());
            plots.push(Plot { title: title.clone(), x, y, curves, equal: false });
        }
        plots
    }

    /// The curves over time as text for a terminal, one under the other.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        for (title, curves) in self.titles.iter().zip(&self.curves) {
            for (name, _, _, thinned) in curves {
                let points: Vec<(f32, f32)> =
                    thinned.points.iter().map(|&(t, y)| (t as f32, y as f32)).collect();
                let (Some(first), Some(last)) = (points.first(), points.last()) else { continue };
                if points.iter().all(|p| p.1 == first.1) {
                    let _ = writeln!(out, "\n{title}: {name} stays at {}", first.1);
                    continue;
                }
                let line = Shape::Lines(&points);
                let [width, height] = TERMINAL;
                let mut chart = Chart::new(width, height, first.0, last.0);
                let chart = chart.lineplot(&line);
                chart.axis();
                chart.figures();
                let _ = write!(out, "\n{title}: {name}, over time [s]\n{chart}");
            }
        }
        out
    }
}

/// Points of a curve, thinned to a fixed number however long the run.
#[derive(Clone, Debug, Default)]
pub struct Thinned {
    /// Points kept.
    pub points: Vec<(f64, f64)>,
    every: u64,
    seen: u64,
}

impl Thinned {
    const MOST: usize = 4096;

    /// Room for all points it will ever keep.
    pub fn new() -> Self {
        Thinned { points: Vec::with_capacity(Self::MOST), every: 1, seen: 0 }
    }

    /// Takes a point, or passes it over.
    pub fn add(&mut self, x: f64, y: f64) {
        if self.seen.is_multiple_of(self.every) {
            if self.points.len() == Self::MOST {
                let mut k = 0;
                self.points.retain(|_| {
                    k += 1;
                    k % 2 == 1
                });
                self.every *= 2;
            }
            if self.seen.is_multiple_of(self.every) {
                self.points.push((x, y));
            }
        }
        self.seen += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_memory_and_the_shape() {
        let mut t = Thinned::new();
        for k in 0..1_000_000 {
            t.add(f64::from(k), f64::from(k) * 2.0);
        }
        assert!(t.points.len() <= 4096 && t.points.len() > 2000);
        assert_eq!(t.points.capacity(), 4096);
        let gaps: Vec<f64> = t.points.windows(2).map(|w| w[1].0 - w[0].0).collect();
        assert!(gaps.iter().all(|g| *g == gaps[0]), "evenly spaced");
    }

    #[test]
    fn numbers_are_in_the_unit_of_the_panel_and_long_runs_in_hours() {
        let celsius = InUnit { offset: 273.15, factor: 1.0 };
        assert!((celsius.of(263.15) + 10.0).abs() < 1e-12);
        assert_eq!(InUnit { offset: 0.0, factor: 0.01 }.of(250.0), 2.5);
        for (end, name, last) in [(7200.0, "time [s]", 7200.0), (72_000.0, "time [h]", 20.0)] {
            let mut points = Thinned::new();
            points.add(0.0, 1.0);
            points.add(end, 2.0);
            let picture = Picture {
                curves: vec![vec![("a".into(), Place::X(0), celsius, points)]],
                titles: vec!["Temperature [degC]".into()],
                map: None,
                markers: Vec::new(),
                next: 0.0,
                every: 1.0,
            };
            let plots = picture.plots();
            assert_eq!((plots.len(), plots[0].x.as_str()), (1, name));
            assert_eq!(plots[0].curves[0].points, [(0.0, 1.0), (last, 2.0)]);
        }
    }
}

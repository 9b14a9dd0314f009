//! The metric of the plots. Its curves are sampled during the run, with constant memory.
use linkwork_record::{Curve, Plot, draw};
use linkwork_runtime::{Place, Simulation};
use linkwork_viz::{InUnit, Marker, Scene};
use std::fmt::Write;
use std::path::Path;
use textplots::{Chart, Plot as _, Shape};

/// Curves of the metric, with constant memory.
pub struct Picture {
    curves: Vec<Vec<Series>>,
    titles: Vec<String>,
    map: Option<(Place, Place, Thinned)>,
    markers: Vec<Marker>,
    next: f64,
    /// Time between points of the map, s.
    every: f64,
}

/// One curve of a panel.
struct Series {
    name: String,
    place: Place,
    unit: InUnit,
    rows: Envelope,
}

/// Time between points of a long run, s; a short run has [`POINTS`].
const EVERY: f64 = 0.05;
/// Points of a short run.
const POINTS: f64 = 500.0;
/// Runs longer than this have a time axis in hours, s.
const HOURS: f64 = 36_000.0;
/// Size of a curve in a terminal, in dots: eight to a character.
const TERMINAL: [u32; 2] = [120, 40];

impl Picture {
    /// Creates the curves of the panels of a scene, and the map of the followed body, for a run to `until` (s), if it is known.
    pub fn new(sim: &Simulation, scene: &Scene, until: Option<f64>) -> Picture {
        let plan = sim.plan();
        let next = sim.time();
        let every = until.map_or(EVERY, |until| EVERY.min((until - next).max(0.0) / POINTS));
        let series = |(name, path, unit): &(String, String, InUnit)| {
            let place = plan.variables.get(path)?.place;
            let rows = Envelope::new(every);
            Some(Series { name: name.clone(), place, unit: *unit, rows })
        };
        let curves =
            scene.panels.iter().map(|p| p.series.iter().filter_map(series).collect()).collect();
        let map = scene
            .follow
            .as_ref()
            .and_then(|b| crate::scene::position(plan, b))
            .map(|[x, y, _]| (x, y, Thinned::new()));
        let titles = scene.panels.iter().map(|p| p.title.clone()).collect();
        Picture { curves, titles, map, markers: scene.markers.clone(), next, every }
    }

    /// Takes a sample: every one is used for the curves, some are points of the map.
    #[inline]
    pub fn sample(&mut self, sim: &Simulation) {
        let t = sim.time();
        for series in self.curves.iter_mut().flatten() {
            let value = sim.value(series.place);
            if !value.is_nan() {
                series.rows.add(t, value);
            }
        }
        if t < self.next {
            return;
        }
        self.next = t + self.every;
        if let Some((x, y, points)) = &mut self.map {
            let (x, y) = (sim.value(*x), sim.value(*y));
            // The value is missing in phases that do not have the body.
            if !x.is_nan() && !y.is_nan() {
                points.add(x, y);
            }
        }
    }

    /// Returns whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.map.is_none() && self.titles.is_empty()
    }

    /// Draws the metric.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn draw(&self, path: &Path) -> Result<(), String> {
        draw(path, &self.plots()).map_err(|e| e.to_string())
    }

    /// Returns the map, then the panels. Time is in hours if the run is long.
    fn plots(&self) -> Vec<Plot> {
        let mut plots = Vec::new();
        if let Some((_, _, points)) = &self.map {
            let mut curves =
                vec![Curve { name: "driven".into(), points: points.points.clone(), dots: false }];
            if !self.markers.is_empty() {
                let points = self.markers.iter().map(|m| (m.at.x, m.at.y)).collect();
                curves.push(Curve { name: "waypoints".into(), points, dots: true });
            }
            let (x, y) = ("x [m]".into(), "y [m]".into());
            plots.push(Plot { title: "Map".into(), x, y, curves, equal: true });
        }
        let last = self.curves.iter().flatten().filter_map(|c| c.rows.last());
        let end = last.fold(0.0_f64, f64::max);
        let (unit, name) = if end > HOURS { (3600.0, "h") } else { (1.0, "s") };
        for (title, curves) in self.titles.iter().zip(&self.curves) {
            let curves = curves
                .iter()
                .map(|c| {
                    let points = c.rows.points();
                    let points = points.map(|(t, y)| (t / unit, c.unit.of(y))).collect();
                    Curve { name: c.name.clone(), points, dots: false }
                })
                .collect();
            let (x, y) = (format!("time [{name}]"), String::new());
            plots.push(Plot { title: title.clone(), x, y, curves, equal: false });
        }
        plots
    }

    /// Returns the curves over time as text for a terminal, one below the other.
    #[must_use]
    pub fn text(&self) -> String {
        let mut out = String::new();
        for (title, curves) in self.titles.iter().zip(&self.curves) {
            for series in curves {
                let (name, shown) = (&series.name, |(t, y)| (t as f32, series.unit.of(y) as f32));
                let points: Vec<(f32, f32)> = series.rows.points().map(shown).collect();
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

/// A curve over time, stored by the smallest and largest samples of intervals, so that peaks are kept, with constant memory for runs of any length.
#[derive(Clone, Debug)]
struct Envelope {
    bins: Vec<Bin>,
    /// Length of an interval, s.
    length: f64,
}

/// Samples of one interval, each as (time, value).
#[derive(Clone, Copy, Debug)]
struct Bin {
    first: (f64, f64),
    least: (f64, f64),
    greatest: (f64, f64),
    last: (f64, f64),
}

impl Bin {
    fn of(row: (f64, f64)) -> Bin {
        Bin { first: row, least: row, greatest: row, last: row }
    }

    fn add(&mut self, row: (f64, f64)) {
        if row.1 < self.least.1 {
            self.least = row;
        }
        if row.1 > self.greatest.1 {
            self.greatest = row;
        }
        self.last = row;
    }
}

impl Envelope {
    /// Largest number of intervals; a panel draws at most four points per interval, 4000 in total.
    const MOST: usize = 1000;

    /// Creates a curve with intervals of the length `every` (s), which doubles whenever the memory is full.
    fn new(every: f64) -> Envelope {
        Envelope { bins: Vec::with_capacity(Self::MOST), length: every.max(1e-9) }
    }

    #[inline]
    fn add(&mut self, t: f64, value: f64) {
        match self.bins.last_mut() {
            Some(bin) if t - bin.first.0 < self.length => bin.add((t, value)),
            _ => self.open((t, value)),
        }
    }

    /// Begins an interval. If the memory is full, pairs of intervals are merged first.
    fn open(&mut self, row: (f64, f64)) {
        while self.bins.len() == Self::MOST {
            self.length *= 2.0;
            self.bins.dedup_by(|next, bin| {
                let one = next.last.0 - bin.first.0 < self.length;
                if one {
                    bin.add(next.least);
                    bin.add(next.greatest);
                    bin.last = next.last;
                }
                one
            });
        }
        self.bins.push(Bin::of(row));
    }

    /// Returns the time of the last sample, s.
    fn last(&self) -> Option<f64> {
        self.bins.last().map(|bin| bin.last.0)
    }

    /// Returns the points of the curve in the order of time: the first, last, smallest and largest sample of each interval.
    fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        let mut before = (f64::NAN, f64::NAN);
        let of = |bin: &Bin| {
            let (a, b) = (bin.least, bin.greatest);
            let (a, b) = if a.0 <= b.0 { (a, b) } else { (b, a) };
            [bin.first, a, b, bin.last]
        };
        self.bins.iter().flat_map(of).filter(move |p| std::mem::replace(&mut before, *p) != *p)
    }
}

/// Points of a line, thinned to a fixed number.
#[derive(Clone, Debug, Default)]
pub struct Thinned {
    /// Points kept.
    pub points: Vec<(f64, f64)>,
    every: u64,
    seen: u64,
}

impl Thinned {
    const MOST: usize = 4096;

    /// Allocates memory for all points that it can contain.
    pub fn new() -> Self {
        Thinned { points: Vec::with_capacity(Self::MOST), every: 1, seen: 0 }
    }

    /// Adds a point, or skips it.
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
    fn no_peak_is_missed_and_memory_stays() {
        let rows = 1_000_000_u32;
        // The peaks are farther apart than the length of the final intervals, at any position in
        // them.
        let (up, down) = (|k: u32| k % 7193 == 5000, |k: u32| k % 8311 == 6000);
        let value = |k: u32| match f64::from(k) {
            x if up(k) => 9.0 + x * 1e-6,
            x if down(k) => -7.0 - x * 1e-6,
            x => (x * 1e-5).sin(),
        };
        let mut e = Envelope::new(0.05);
        for k in 0..rows {
            e.add(f64::from(k) * 1e-3, value(k));
        }
        let points: Vec<(f64, f64)> = e.points().collect();
        for k in (0..rows).filter(|k| up(*k) || down(*k)) {
            assert!(points.contains(&(f64::from(k) * 1e-3, value(k))), "peak of row {k}");
        }
        assert!(points.len() <= 4 * Envelope::MOST && points.len() > Envelope::MOST);
        assert_eq!(e.bins.capacity(), Envelope::MOST);
        assert!(points.windows(2).all(|w| w[0].0 < w[1].0), "in the order of time");
        for &(t, y) in &points {
            assert_eq!(y, value((t * 1e3).round() as u32), "rows as they were");
        }
        let gaps = points.windows(2).map(|w| w[1].0 - w[0].0).fold(0.0, f64::max);
        assert!(gaps <= 2.0 * e.length, "no gap: {gaps} of {}", e.length);
        assert_eq!((points[0].0, e.last()), (0.0, Some(999.999)));
    }

    #[test]
    fn a_jump_at_one_instant_is_seen_and_a_gap_of_hours_is_one_step() {
        let mut e = Envelope::new(0.05);
        for row in [(10.0, 1.0), (10.01, 1.0), (10.01, 5.0), (10.01, 1.0), (36_010.0, 2.0)] {
            e.add(row.0, row.1);
        }
        let points: Vec<(f64, f64)> = e.points().collect();
        assert_eq!(points, [(10.0, 1.0), (10.01, 5.0), (10.01, 1.0), (36_010.0, 2.0)]);
    }

    #[test]
    fn numbers_are_in_the_unit_of_the_panel_and_long_runs_in_hours() {
        let celsius = InUnit { offset: 273.15, factor: 1.0 };
        assert!((celsius.of(263.15) + 10.0).abs() < 1e-12);
        assert_eq!(InUnit { offset: 0.0, factor: 0.01 }.of(250.0), 2.5);
        for (end, name, last) in [(7200.0, "time [s]", 7200.0), (72_000.0, "time [h]", 20.0)] {
            let mut rows = Envelope::new(0.05);
            rows.add(0.0, 1.0);
            rows.add(end, 1.5);
            let unit = InUnit { offset: 0.5, factor: 2.0 };
            let series = Series { name: "a".into(), place: Place::X(0), unit, rows };
            let picture = Picture {
                curves: vec![vec![series]],
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

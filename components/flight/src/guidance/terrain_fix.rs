//! `flight.terrain_fix`: terrain-relative navigation. It estimates the position of a lander by matching lidar ranges with a height map.
//! ```text
//! places   q_k = p̂ + R̂ d_k r_k              of the echoes, from the estimate (p̂, R̂)
//! misfit   e_k(s) = h_map(x_k + s_x, y_k + s_y) − z_k        s: shift over the ground;  ē: their mean, the shift upwards
//! cost     J(s) = Σ (e_k − ē)²/σ²,   n − 3 in the mean for the true s
//! search   a lattice of `step`, `steps` to each side; from the best node Gauss-Newton with the map's slopes
//! fix      p̂ + (s*, ē)     covariance (Σ g_k g_kᵀ/σ²)⁻¹, g: slopes less their means; vertical σ²/n and what the slopes add
//! ```
//! A match is rejected when it may be false; the output `why` has the reason: 1: there are fewer echoes than `echoes_min`, or less than half of them
//! are on the map. 2: the ground is too flat, so a standard deviation exceeds `step`. 3: a rival exists, that is, another shift more than `apart`
//! steps from the best one whose cost is less than `gate`² above the best cost. 4: the best fit is poor, J/(n − 3) exceeds `misfit_max`. 5: the best
//! shift is at the edge of the search, so the true shift may be outside. σ is the standard deviation of a height residual: lidar noise, map error,
//! and attitude error times range. W must be a site (z up) or flat ground. Objects that are not in the map increase the misfit. The model is sampled.
//! A sample evaluates (2 steps + 1)² map heights per echo; the 2 apart + 1 rows around the best shift are evaluated twice.

use linkwork_spatial::nalgebra::{Matrix2, Vector2};
use linkwork_surroundings::prelude::*;

/// Lidar beams, search lattice and acceptance limits.
#[derive(Params, Clone, Debug)]
pub struct TerrainFixParams {
    /// Number of beam columns of the lidar.
    #[param(default = 36, range = 1.0..=4096.0)]
    pub columns: u32,
    /// Number of beam rows of the lidar.
    #[param(default = 1, range = 1.0..=256.0)]
    pub rows: u32,
    /// Azimuth range of the columns, from x towards y.
    #[param(unit = "rad", default = [-std::f64::consts::PI, std::f64::consts::PI])]
    pub azimuth: [f64; 2],
    /// Elevation range of the rows, positive upwards.
    #[param(unit = "rad", default = [-0.4, 0.0])]
    pub elevation: [f64; 2],
    /// Spacing of the shifts that are tried; must be smaller than the terrain features.
    #[param(unit = "m", default = 1.0, range = 1e-3..)]
    pub step: f64,
    /// Number of shifts to each side along x and along y; the search covers ± `steps` · `step`.
    #[param(default = 30, range = 2.0..=500.0)]
    pub steps: u32,
    /// Shifts within this many steps of the best one belong to the same minimum and are not rivals.
    #[param(default = 1, range = 1.0..)]
    pub apart: u32,
    /// Standard deviation σ of a height against the map.
    #[param(unit = "m", default = 0.1, range = 1e-6..)]
    pub sigma: f64,
    /// Fewest echoes of a match.
    #[param(default = 20, range = 4.0..)]
    pub echoes_min: u32,
    /// A match is rejected if a rival is less than this many standard deviations worse.
    #[param(default = 5.0, range = 0.0..)]
    pub gate: f64,
    /// Greatest J/(n − 3) of an accepted match.
    #[param(default = 2.0, range = 1.0..)]
    pub misfit_max: f64,
    /// Height map.
    #[param(service)]
    pub map: Handle<dyn Terrain>,
}

/// Estimated state; the ranges of the beams follow as further inputs.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TerrainFixIn {
    /// Estimated state of the lidar from navigation, W.
    #[port(bind = "estimate")]
    pub estimate: NodeState,
}

/// The fix.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TerrainFixOut {
    /// Position of the lidar, W; equal to the estimate without a match.
    #[port("m")]
    pub position: Vec3,
    /// Position minus estimate.
    #[port("m")]
    pub shift: Vec3,
    /// Standard deviation of each component of the position; 0 without a match.
    #[port("m")]
    pub deviation: Vec3,
    /// The match is accepted.
    #[port]
    pub matched: bool,
    /// Reason for a rejection: 0 accepted, 1 too few echoes, 2 flat ground, 3 rival, 4 poor fit, 5 edge of the search.
    #[port("1")]
    pub why: f64,
    /// J/(n − 3) of the best shift.
    #[port("1")]
    pub misfit: f64,
    /// Cost difference between the best rival and the best shift, in standard deviations.
    #[port("1")]
    pub rival: f64,
    /// Echoes that were used.
    #[port("1")]
    pub echoes: f64,
}

/// Reason for which a match is rejected; the values are those of `why`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Refusal {
    Echoes = 1,
    Even = 2,
    Rival = 3,
    Fit = 4,
    Edge = 5,
}

/// Result of the lattice search.
struct Search {
    best: [i32; 2],
    cost: f64,
    /// Least cost of the nodes more than `apart` steps from the best one.
    rival: f64,
}

/// Echo points on the ground for an estimated state. They are computed on the fly, so that no memory is allocated.
struct EchoPoints<'a> {
    beams: &'a [Vec3],
    ranges: &'a [f64],
    estimate: &'a NodeState,
}

impl EchoPoints<'_> {
    fn places(&self) -> impl Iterator<Item = Vec3> + '_ {
        let place =
            |(d, r): (&Vec3, &f64)| self.estimate.position + self.estimate.rotation * (d * *r);
        self.beams.iter().zip(self.ranges).filter(|(_, r)| **r > 0.0).map(place)
    }
    fn count(&self) -> usize {
        self.ranges.iter().filter(|r| **r > 0.0).count()
    }
}

/// Matches ranges with a map.
pub struct TerrainFix {
    p: TerrainFixParams,
    beams: Vec<Vec3>,
}

/// Rows of the largest lattice: `steps` is 500 at most.
const ROWS_MAX: usize = 1001;

/// Greatest number of Gauss-Newton steps, and the step length at which they end (m).
const STEPS: usize = 12;
const STILL: f64 = 1e-9;

impl TerrainFix {
    /// Returns J at a shift, the mean ē (m), and the number of echo points on the map.
    fn cost(&self, seen: &EchoPoints<'_>, s: [f64; 2]) -> (f64, f64, usize) {
        // Residuals are relative to the first one, because heights may be large compared with their differences.
        let (mut all, mut n, mut sum, mut squares, mut first) = (0_usize, 0_usize, 0.0, 0.0, 0.0);
        for q in seen.places() {
            all += 1;
            let Some(g) = self.p.map.ground(q.x + s[0], q.y + s[1]) else { continue };
            let e = g.height - q.z;
            if n == 0 {
                first = e;
            }
            n += 1;
            sum += e - first;
            squares += (e - first) * (e - first);
        }
        let count = n.max(1) as f64;
        let mean = sum / count;
        // Leave out points outside of the map, and scale the cost of the others to the full number.
        let share = all as f64 / count;
        let cost = (squares - mean * sum).max(0.0) * share / (self.p.sigma * self.p.sigma);
        (cost, mean + first, n)
    }

    /// Returns the cost of a lattice node; infinite if less than half of the echo points are on the map.
    fn node_cost(&self, seen: &EchoPoints<'_>, all: usize, node: [i32; 2]) -> f64 {
        let (cost, _, n) = self.cost(seen, node.map(|k| f64::from(k) * self.p.step));
        if 2 * n < all { f64::INFINITY } else { cost }
    }

    /// Returns the best node of the lattice and its rival; `None` if for every shift less than half of the echo points are on the map. The least cost
    /// of each row is kept, so that only rows near the best node are evaluated again.
    fn search(&self, seen: &EchoPoints<'_>) -> Option<Search> {
        let (half, apart, all) = (self.p.steps as i32, self.p.apart as i32, seen.count());
        let mut least = [f64::INFINITY; ROWS_MAX];
        let (mut best, mut cost) = ([0; 2], f64::INFINITY);
        for (i, row) in (-half..=half).zip(&mut least) {
            for j in -half..=half {
                let now = self.node_cost(seen, all, [i, j]);
                *row = row.min(now);
                if now < cost {
                    (best, cost) = ([i, j], now);
                }
            }
        }
        if !cost.is_finite() {
            return None;
        }
        let mut rival = f64::INFINITY;
        for (i, row) in (-half..=half).zip(&least) {
            if (i - best[0]).abs() > apart {
                rival = rival.min(*row);
                continue;
            }
            for j in (-half..=half).filter(|j| (j - best[1]).abs() > apart) {
                rival = rival.min(self.node_cost(seen, all, [i, j]));
            }
        }
        Some(Search { best, cost, rival })
    }

    /// Returns the normal equations Σ g gᵀ/σ² and Σ g (e − ē)/σ² at a shift, where g is the map gradient minus its mean; then the mean gradient and
    /// the number of points.
    fn normal(
        &self,
        seen: &EchoPoints<'_>,
        s: [f64; 2],
    ) -> (Matrix2<f64>, Vector2<f64>, Vector2<f64>, f64) {
        let on_map = || {
            let relief = |q: Vec3| Some((self.p.map.ground(q.x + s[0], q.y + s[1])?.relief(), q.z));
            seen.places().filter_map(relief)
        };
        let n = on_map().count().max(1) as f64;
        let (mut slope, mut mean) = (Vector2::zeros(), 0.0);
        for ([h, a, b], z) in on_map() {
            slope += Vector2::new(a, b) / n;
            mean += (h - z) / n;
        }
        let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for ([h, a, b], z) in on_map() {
            let g = Vector2::new(a, b) - slope;
            matrix += g * g.transpose();
            right += g * (h - z - mean);
        }
        let weight = 1.0 / (self.p.sigma * self.p.sigma);
        (matrix * weight, right * weight, slope, n)
    }

    /// Refines a lattice node to the nearest minimum by Gauss-Newton steps, within one lattice step.
    fn refine(&self, seen: &EchoPoints<'_>, node: [f64; 2]) -> [f64; 2] {
        let mut s = node;
        let mut cost = self.cost(seen, s).0;
        for _ in 0..STEPS {
            let (matrix, right, ..) = self.normal(seen, s);
            let Some(inverse) = matrix.try_inverse() else { break };
            let mut d = -(inverse * right);
            // Halve the step until the cost decreases, because the terrain is not linear.
            let mut better = false;
            for _ in 0..STEPS {
                let next = [s[0] + d.x, s[1] + d.y];
                let near = (0..2).all(|k| (next[k] - node[k]).abs() <= self.p.step);
                let now = if near { self.cost(seen, next).0 } else { f64::INFINITY };
                if now < cost {
                    (s, cost, better) = (next, now, true);
                    break;
                }
                d *= 0.5;
            }
            if !better || d.norm() < STILL {
                break;
            }
        }
        s
    }

    /// Computes the fix for an estimated state and measured ranges (m).
    fn find(&self, estimate: &NodeState, ranges: &[f64]) -> TerrainFixOut {
        let seen = EchoPoints { beams: &self.beams, ranges, estimate };
        let places = seen.count();
        let mut out = TerrainFixOut {
            position: estimate.position,
            shift: Vec3::zeros(),
            deviation: Vec3::zeros(),
            matched: false,
            why: f64::from(Refusal::Echoes as u8),
            misfit: 0.0,
            rival: 0.0,
            echoes: places as f64,
        };
        if places < self.p.echoes_min as usize {
            return out;
        }
        let Some(found) = self.search(&seen) else { return out };
        let s = self.refine(&seen, found.best.map(|k| f64::from(k) * self.p.step));
        let (cost, up, n) = self.cost(&seen, s);
        out.misfit = cost / (n as f64 - 3.0);
        // Compare with the cost of the best node before refinement, because the rival is not refined either.
        out.rival = (found.rival - found.cost).clamp(0.0, 1e12).sqrt();
        let (matrix, _, slope, count) = self.normal(&seen, s);
        let covariance = matrix.try_inverse().filter(|c| c[(0, 0)] > 0.0 && c[(1, 1)] > 0.0);
        let half = self.p.steps as i32;
        let even = covariance.is_none_or(|c| c[(0, 0)].max(c[(1, 1)]).sqrt() > self.p.step);
        let refused = if even {
            Some(Refusal::Even)
        } else if found.best.iter().any(|k| k.abs() == half) {
            Some(Refusal::Edge)
        } else if !(out.misfit <= self.p.misfit_max) {
            Some(Refusal::Fit)
        } else if out.rival < self.p.gate {
            Some(Refusal::Rival)
        } else {
            None
        };
        out.why = refused.map_or(0.0, |r| f64::from(r as u8));
        if let (None, Some(c)) = (refused, covariance) {
            let vertical = self.p.sigma * self.p.sigma / count + (slope.transpose() * c * slope)[0];
            out.matched = true;
            out.shift = Vec3::new(s[0], s[1], up);
            out.position += out.shift;
            out.deviation = Vec3::new(c[(0, 0)], c[(1, 1)], vertical).map(f64::sqrt);
        }
        out
    }
}

/// Greatest number of shifts times beams: limits the computing time of a sample.
const WORK_MAX: f64 = 1e8;

/// Terrain-relative navigation: estimates the position of a lander by matching lidar ranges with a height map; doubtful matches are rejected and
/// reported; sampled.
#[model("flight.terrain_fix")]
impl SizedModel for TerrainFix {
    type Params = TerrainFixParams;

    fn ports(p: &TerrainFixParams) -> SizedPorts {
        let count = p.columns as usize * p.rows as usize;
        let range = PortSpec::named("range", PortKind::Numbers, count)
            .unit_of("m")
            .doc_of("Range of each beam in the order of `sensors.lidar`; 0 without an echo.");
        SizedPorts {
            feedthrough_inputs: TerrainFixIn::specs()
                .into_iter()
                .chain(std::iter::once(range))
                .collect(),
            feedthrough_outputs: TerrainFixOut::specs(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: TerrainFixParams) -> Result<Self, BuildError> {
        let side = 2.0 * f64::from(p.steps) + 1.0;
        let work = side * side * f64::from(p.columns) * f64::from(p.rows);
        if work > WORK_MAX {
            let beams = p.columns * p.rows;
            let fact = format!(
                "{side} × {side} shifts of {beams} beams need {work:.0} map heights per sample"
            );
            let help = "reduce `steps` or the number of beams; the limit is 1e8";
            return Err(BuildError::new(fact).help(help).at("steps"));
        }
        if p.apart >= p.steps {
            let fact = format!(
                "`steps` is {}, so no shift can be more than `apart` = {} steps from the best one",
                p.steps, p.apart
            );
            return Err(BuildError::new(fact)
                .help("increase `steps` or reduce `apart`")
                .at("apart"));
        }
        let middle = |[from, to]: [f64; 2], count: u32, k: u32| {
            from + (to - from) * (f64::from(k) + 0.5) / f64::from(count)
        };
        let mut beams = Vec::new();
        for column in 0..p.columns {
            for row in 0..p.rows {
                let (sa, ca) = middle(p.azimuth, p.columns, column).sin_cos();
                let (se, ce) = middle(p.elevation, p.rows, row).sin_cos();
                beams.push(Vec3::new(ca * ce, sa * ce, se));
            }
        }
        Ok(TerrainFix { p, beams })
    }

    fn feedthrough(&self, u: &[f64], y: &mut [f64]) {
        let (input, ranges) = u.split_at(TerrainFixIn::N);
        self.find(&TerrainFixIn::get(input).estimate, ranges).put(y);
    }
}

#[cfg(test)]
#[path = "terrain_fix_tests.rs"]
mod tests;

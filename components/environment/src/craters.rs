//! Craters of a surface of a given age: their number follows from the size-frequency law of the Moon, and each has degraded since its formation.
//! ```text
//! production   N(> D) = N₁(T) 10^(Σ_k a_k (log₁₀ D)^k), k = 1 … 11      craters on a km², D in km
//!              from 10 m on (Neukum, Ivanov, Hartmann 2001); narrower ones with the slope that it has at 10 m
//! chronology   N₁(T) = 5.44e−14 (e^(6.93 T) − 1) + 8.38e−4 T            wider than 1 km, T in Gyr
//! degradation  ∂h/∂t = κ ∇²h,  τ = κ t/R²                              profile of x = ρ/R and τ, tabulated
//!              κ = κ₁ D/1 km
//! forgotten    when a twentieth of the depth is left
//! ```
//! The Moon's maria have κ₁ ≈ 5.5 m²/Myr on the mean of 3 Gyr, found on craters of 0.8 to 5 km (Fassett, Thomson 2014). κ grows with the diameter;
//! therefore small craters, which form as D⁻³, reach the observed equilibrium N(> D) ∝ D⁻² at a few percent of geometric saturation (Minton and
//! others 2019). A crater that has degraded completely is not generated.

use crate::random::Random;

/// Coefficients a₁ … a₁₁ of the production function.
const PRODUCTION: [f64; 11] = [
    -3.557528, 0.781027, 1.021521, -0.156012, -0.444058, 0.019977, 0.086850, -0.005874, -0.006809,
    8.25e-4, 5.54e-5,
];

/// Returns the number of craters wider than 1 km per km² of a surface of the age `age` (Gyr).
pub fn chronology(age: f64) -> f64 {
    5.44e-14 * ((6.93 * age).exp() - 1.0) + 8.38e-4 * age
}

/// Returns the ratio of the number of craters wider than `d` (m) to the number wider than 1 km.
pub fn production(d: f64) -> f64 {
    let polynomial = |x: f64| PRODUCTION.iter().rev().fold(0.0, |sum, a| (sum + a) * x);
    let (x, least) = ((d / 1000.0).log10(), -2.0);
    if x >= least {
        return 10f64.powf(polynomial(x));
    }
    let slope = (polynomial(least + 1e-4) - polynomial(least)) / 1e-4;
    10f64.powf(polynomial(least) + slope * (x - least))
}

/// Fraction of its original depth at which a crater counts as completely degraded.
const FORGOTTEN: f64 = 0.05;

/// Step and end of the table, in radii.
const STEP: f64 = 0.02;
const END: usize = 400;

/// Profiles of a crater of radius 1 as it degrades.
#[derive(Clone, Debug)]
pub struct Degraded {
    /// τ of each profile; the first is 0.
    taus: Vec<f64>,
    /// Heights at the middle of rings of the width [`STEP`].
    profiles: Vec<Vec<f64>>,
    /// Number of radii beyond which a crater has no visible effect.
    reaches: Vec<f64>,
}

impl Degraded {
    /// Solves the diffusion equation on rings. Cost: some 10⁷ operations.
    pub fn new() -> Degraded {
        let mut h: Vec<f64> = (0..END).map(|i| crater_profile(2.0, ring(i))).collect();
        let depth = |h: &[f64]| h.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b)) - h[0];
        let fresh = depth(&h);
        let mut out = Degraded { taus: vec![], profiles: vec![], reaches: vec![] };
        out.keep(0.0, &h);
        // Use a quarter of the largest stable time step, so that h changes little in a step.
        let dt = 0.25 * STEP * STEP;
        let (mut tau, mut next) = (0.0, 1e-3);
        while depth(&h) > FORGOTTEN * fresh {
            // Each ring changes by the flow through its edges divided by its area, so that the volume is conserved.
            let mut inflow = 0.0;
            for i in 0..END {
                let edge = (i + 1) as f64 * STEP;
                let outflow = if i + 1 < END { edge * (h[i + 1] - h[i]) / STEP } else { 0.0 };
                h[i] += dt * (outflow - inflow) / (ring(i) * STEP);
                inflow = outflow;
            }
            tau += dt;
            if tau >= next {
                out.keep(tau, &h);
                next *= 1.25;
            }
        }
        out.keep(tau, &h);
        out
    }

    fn keep(&mut self, tau: f64, h: &[f64]) {
        let seen = h.iter().rposition(|h| h.abs() > 5e-4).unwrap_or(0);
        self.taus.push(tau);
        self.reaches.push(ring(seen) + STEP);
        self.profiles.push(h.to_vec());
    }

    /// Returns the degradation at which a crater counts as completely degraded.
    pub fn last(&self) -> f64 {
        self.taus[self.taus.len() - 1]
    }

    /// Returns the index of the profile below τ, and the fraction of the interval to the next one.
    fn between(&self, tau: f64) -> (usize, f64) {
        let k = self.taus.partition_point(|t| *t <= tau).clamp(1, self.taus.len() - 1) - 1;
        let (a, b) = (self.taus[k], self.taus[k + 1]);
        (k, ((tau - a) / (b - a)).clamp(0.0, 1.0))
    }

    /// Returns the height above the ground at x radii from the middle, in radii.
    pub fn height(&self, x: f64, tau: f64) -> f64 {
        let (k, f) = self.between(tau);
        let at = (x / STEP - 0.5).max(0.0);
        let (i, g) = (at as usize, at.fract());
        if i + 1 >= END {
            return 0.0;
        }
        let along = |h: &[f64]| h[i] + g * (h[i + 1] - h[i]);
        along(&self.profiles[k]) * (1.0 - f) + along(&self.profiles[k + 1]) * f
    }

    /// Returns the radius up to which the crater changes the ground, in crater radii.
    pub fn reach(&self, tau: f64) -> f64 {
        let (k, _) = self.between(tau);
        self.reaches[k].max(self.reaches[k + 1])
    }
}

impl Default for Degraded {
    fn default() -> Self {
        Degraded::new()
    }
}

/// Returns the middle of ring `i`, in radii.
fn ring(i: usize) -> f64 {
    (i as f64 + 0.5) * STEP
}

/// A crater of the law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aged {
    /// Centre, m.
    pub x: f64,
    /// Centre, m.
    pub y: f64,
    /// Diameter at its formation, m.
    pub diameter: f64,
    /// Degradation τ = κ t/R².
    pub tau: f64,
}

/// A surface with craters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// x_min, y_min, x_max, y_max, m.
    pub bounds: [f64; 4],
    /// Age, Gyr.
    pub age: f64,
    /// Topographic diffusivity κ₁ of craters of 1 km, m²/Myr.
    pub diffusivity: f64,
    /// Smallest and largest diameter, m.
    pub diameters: [f64; 2],
}

impl Surface {
    /// For a fine series of diameters from the smallest on: number of wider craters on the surface that are not completely degraded.
    fn ladder(&self, forgotten: f64) -> Vec<(f64, f64)> {
        let [low, high] = self.diameters;
        let [x0, y0, x1, y1] = self.bounds;
        let area = (x1 - x0) * (y1 - y0) * 1e-6;
        let n = 400;
        let d = |k: usize| low * (high / low).powf(k as f64 / n as f64);
        let mut out = vec![(high, 0.0)];
        let mut wider = 0.0;
        for k in (0..n).rev() {
            let middle = (d(k) * d(k + 1)).sqrt();
            let made = chronology(self.oldest(middle, forgotten))
                * (production(d(k)) - production(d(k + 1)));
            wider += made * area;
            out.push((d(k), wider));
        }
        out.reverse();
        out
    }

    /// Returns the age (Gyr) of the oldest crater of a diameter that is not completely degraded.
    fn oldest(&self, d: f64, forgotten: f64) -> f64 {
        (forgotten / self.degradation(d, 1.0)).min(self.age)
    }

    /// Returns τ of a crater of the diameter `d` (m) at an age (Gyr).
    fn degradation(&self, d: f64, age: f64) -> f64 {
        self.diffusivity * d * 1e-3 * age * 1e3 / (0.25 * d * d)
    }

    /// Returns the mean number of craters.
    pub fn wanted(&self, degraded: &Degraded) -> f64 {
        self.ladder(degraded.last())[0].1
    }

    /// Returns its craters in the order in which they were drawn.
    pub fn craters(&self, degraded: &Degraded, seed: u64) -> Vec<Aged> {
        let ladder = self.ladder(degraded.last());
        let mut random = Random::new(seed, 5);
        let [x0, y0, x1, y1] = self.bounds;
        let all = ladder[0].1;
        let mut out = Vec::new();
        for _ in 0..all.round() as usize {
            let (x, y) = (random.between(x0, x1), random.between(y0, y1));
            let wider = random.uniform() * all;
            let k = ladder.partition_point(|(_, n)| *n > wider).clamp(1, ladder.len() - 1);
            let ((da, a), (db, b)) = (ladder[k - 1], ladder[k]);
            let f = if a > b { (a - wider) / (a - b) } else { 0.0 };
            let diameter = da * (db / da).powf(f);
            let age = age_of(random.uniform() * chronology(self.oldest(diameter, degraded.last())));
            let tau = self.degradation(diameter, age);
            out.push(Aged { x, y, diameter, tau });
        }
        out
    }
}

/// Returns the age (Gyr) at which the chronology has a value, by bisection between 0 and 5 Gyr.
fn age_of(made: f64) -> f64 {
    let (mut low, mut high) = (0.0, 5.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if chronology(middle) < made { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Profile of a crater of the diameter `d` at the distance `rho` from its centre, m.
pub fn crater_profile(d: f64, rho: f64) -> f64 {
    let (radius, depth, rim) = (0.5 * d, 0.2 * d, 0.04 * d);
    let x = rho / radius;
    if x < 1.0 {
        return rim - depth + depth * x * x;
    }
    let fade = (1.0 - (x - 1.0) / 1.5).max(0.0);
    rim / (x * x * x) * fade * fade * (3.0 - 2.0 * fade)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Known values of the law: its value at 1 km, its slopes, and those of the Moon's maria.
    #[test]
    fn the_law_is_that_of_the_moon() {
        assert_eq!(production(1000.0), 1.0);
        assert!((chronology(1.0) - 8.38e-4).abs() < 1e-6, "{}", chronology(1.0));
        // At 3.8 Gyr the exponential term dominates; N₁ of the oldest maria is some 1e-2.
        assert!(
            (chronology(3.8) - (5.44e-14 * (6.93f64 * 3.8).exp() + 8.38e-4 * 3.8)).abs() < 1e-9
        );
        let slope = |d: f64| (production(1.01 * d) / production(d)).log10() / 1.01f64.log10();
        // The slope is steep between 0.3 and 1 km, about −3 at 10 m, and constant below.
        assert!((slope(500.0) + 3.8).abs() < 0.2, "{}", slope(500.0));
        assert!((slope(10.5) + 3.0).abs() < 0.2, "{}", slope(10.5));
        assert!((slope(2.0) - slope(9.8)).abs() < 1e-6);
        let jump = production(9.999_999) / production(10.000_001);
        assert!((jump - 1.0).abs() < 1e-5, "{jump}");
    }

    #[test]
    fn diffusion_keeps_the_volume_and_only_fills() {
        let d = Degraded::new();
        let volume = |h: &[f64]| h.iter().enumerate().map(|(i, h)| h * ring(i) * STEP).sum::<f64>();
        let (first, last) = (volume(&d.profiles[0]), volume(&d.profiles[d.profiles.len() - 1]));
        assert!((first - last).abs() < 1e-12, "{first} {last}");
        for pair in d.profiles.windows(2) {
            let depth = |h: &[f64]| h.iter().copied().fold(f64::MIN, f64::max) - h[0];
            assert!(depth(&pair[1]) < depth(&pair[0]));
        }
        // The profile is still zero at the end of the table.
        assert!(d.profiles[d.profiles.len() - 1][END - 1].abs() < 1e-4);
        assert!((d.height(0.3, 0.0) - crater_profile(2.0, 0.3)).abs() < 1e-3);
        println!("forgotten at tau {}", d.last());
    }

    /// Far from its rim a crater is a bowl: h = d x² − c, of which ∇²h = 4 d, so its floor rises by 4 d τ at first.
    #[test]
    fn the_floor_rises_as_the_equation_says() {
        let d = Degraded::new();
        let tau = 0.002;
        let risen = d.height(0.0, tau) - d.height(0.0, 0.0);
        assert!((risen / tau - 4.0 * 0.4).abs() < 0.02, "{}", risen / tau);
    }

    /// Fassett and Thomson (2014): with 5.5 m²/Myr, after 3 Gyr, a crater of 1 km has 52 % of its depth, one of 300 m 7 %. Their model begins with
    /// another profile; the parabola with rim used here gives 59 % and 6.6 %.
    #[test]
    fn depths_after_three_billion_years_are_those_of_the_maria() {
        let table = Degraded::new();
        let depth = |tau: f64| {
            let h = |k: i32| table.height(f64::from(k) * 0.01, tau);
            (0..300).map(h).fold(f64::MIN, f64::max) - h(0)
        };
        let left = |diameter: f64| depth(5.5 * 3000.0 / (0.25 * diameter * diameter)) / depth(0.0);
        println!("1 km: {:.3}, 300 m: {:.3}", left(1000.0), left(300.0));
        assert!((left(1000.0) - 0.52).abs() < 0.1, "{}", left(1000.0));
        assert!((left(300.0) - 0.07).abs() < 0.01, "{}", left(300.0));
    }

    #[test]
    fn craters_are_as_many_as_the_law_says_and_none_is_forgotten() {
        let table = Degraded::new();
        let surface = Surface {
            bounds: [-500.0, -400.0, 500.0, 400.0],
            age: 3.0,
            diffusivity: 5.5,
            diameters: [2.0, 200.0],
        };
        let craters = surface.craters(&table, 3);
        assert_eq!(craters.len() as f64, surface.wanted(&table).round());
        assert!(craters.iter().all(|c| c.tau >= 0.0 && c.tau <= table.last() * 1.02));
        assert!(craters.iter().all(|c| c.diameter >= 2.0 && c.diameter <= 200.0));
        // Craters of the last 20 Myr are too young and too wide to have vanished, so their number
        // follows the bare law.
        let age = |c: &Aged| c.tau / surface.degradation(c.diameter, 1.0);
        let young = craters.iter().filter(|c| c.diameter > 10.0 && age(c) < 0.05).count() as f64;
        let want = (production(10.0) - production(200.0)) * chronology(0.05) * 0.8;
        println!("{} craters, {young} young ones wider than 10 m, wanted {want:.1}", craters.len());
        assert!((young - want).abs() < 4.0 * want.sqrt().max(1.0), "{young} {want}");
        // Small craters are in the observed equilibrium (Minton and others 2019): their number is proportional to D⁻²,
        // a few percent of geometric saturation, which is 1.54 D⁻² per square metre. Count craters that have at least a
        // fifth of their depth.
        let depth = |tau: f64| {
            let h = |k: i32| table.height(f64::from(k) * 0.02, tau);
            (0..150).map(h).fold(f64::MIN, f64::max) - h(0)
        };
        let fifth =
            (0..1000).map(|k| 1e-3 * f64::from(k)).find(|t| depth(*t) < 0.2 * depth(0.0)).unwrap();
        let wider =
            |d: f64| craters.iter().filter(|c| c.diameter > d && c.tau < fifth).count() as f64;
        let slope = (wider(8.0) / wider(2.0)).ln() / 4f64.ln();
        let share = wider(4.0) / 8e5 * 16.0 / 1.54;
        println!("slope of what is left {slope:.2}, share of saturation {share:.3}");
        assert!((slope + 2.0).abs() < 0.25, "{slope}");
        assert!(share > 0.01 && share < 0.1, "{share}");
    }
}

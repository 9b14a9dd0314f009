//! Lidar: beam directions, ranges and echoes.
//! ```text
//! echo     e = ρ |n·d| (R/r)²        ρ albedo (luminance), r range; R: range limit for a white surface that faces the beam
//! detected e ≥ 1, r within the limits, and not dropped (probability p)
//! reading  r + σ n,  n ~ N(0, 1), rounded to the resolution
//! ```
//! The sensor's frame has x forward, y left, z up. All beams of a scan have the same time and zero width. Noise is a pure function of (key, scan,
//! beam). A time-of-flight sensor is a lidar with a single beam.

use crate::error::{RenderError, number};
use crate::light::luminance;
use crate::scene::{FAR, Scene, check_pose};
use linkwork_runtime::noise;
use linkwork_spatial::{Pose, Vec3};

/// Maximum number of beams of a scan.
const BEAMS_MAX: usize = 4_000_000;

/// A lidar.
#[derive(Clone, Debug, PartialEq)]
pub struct Lidar {
    /// Unit directions, sensor's frame.
    pub beams: Vec<Vec3>,
    /// Smallest and largest range that is measured, m.
    pub limits: [f64; 2],
    /// Maximum range R at which a white surface that faces the beam is detected, m.
    pub reach: f64,
    /// Standard deviation of the range noise, m.
    pub sigma: f64,
    /// Quantization step of ranges, m; 0: no quantization.
    pub resolution: f64,
    /// Probability that an echo is lost.
    pub drop_out: f64,
}

/// Result of one beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Echo {
    /// Measured range, m; ∞ without an echo.
    pub range: f64,
    /// Strength e of the echo; 0 without one.
    pub strength: f64,
    /// Object that was hit, numbered as in a mask; 0 without an echo.
    pub object: u16,
}

/// No echo.
const NONE: Echo = Echo { range: f64::INFINITY, strength: 0.0, object: 0 };

/// Returns the directions of a spinning head: all elevations (rad, upwards) for each azimuth (rad, from x towards y).
#[must_use]
pub fn spinning(azimuths: &[f64], elevations: &[f64]) -> Vec<Vec3> {
    let one = |a: f64, e: f64| Vec3::new(a.cos() * e.cos(), a.sin() * e.cos(), e.sin());
    azimuths.iter().flat_map(|a| elevations.iter().map(move |e| one(*a, *e))).collect()
}

/// Returns the centres of `count` equal parts of the angle from `from` to `to` (rad), so that no direction of a full revolution occurs twice.
#[must_use]
pub fn middles(from: f64, to: f64, count: usize) -> Vec<f64> {
    (0..count).map(|k| from + (to - from) * (k as f64 + 0.5) / count as f64).collect()
}

/// Returns the directions of a flash lidar: the pixels of a flat image of `width` by `height` square pixels, row by row from the top left, with the
/// field of view `view` (rad, less than π) across the width.
#[must_use]
pub fn flash(width: usize, height: usize, view: f64) -> Vec<Vec3> {
    let f = 0.5 * width as f64 / (0.5 * view).tan();
    let middle = |n: usize| 0.5 * (n as f64 - 1.0);
    (0..height)
        .flat_map(|y| (0..width).map(move |x| (x as f64, y as f64)))
        .map(|(x, y)| Vec3::new(f, middle(width) - x, middle(height) - y).normalize())
        .collect()
}

impl Lidar {
    /// Checks the parameters of the lidar.
    ///
    /// # Errors
    /// No beams or too many, directions that are not unit vectors, numbers out of range.
    pub fn check(&self) -> Result<(), RenderError> {
        let many = |n: f64| (1.0..=BEAMS_MAX as f64).contains(&n);
        number("number of beams", self.beams.len() as f64, many, "use 1 to 4 million")?;
        let unit = |v: &Vec3| {
            number(
                "length of a beam's direction",
                v.norm(),
                |n| (n - 1.0).abs() < 1e-6,
                "it must be 1",
            )
        };
        self.beams.iter().try_for_each(unit)?;
        let [near, far] = self.limits;
        number("smallest range (m)", near, |v| v >= 0.0, "it must not be negative")?;
        number(
            "greatest range (m)",
            far,
            |v| v > near && v <= FAR,
            "it must be above the smallest range, and at most 1e7",
        )?;
        number("reach (m)", self.reach, |v| v > 0.0, "it must be positive")?;
        number("standard deviation (m)", self.sigma, |v| v >= 0.0, "it must not be negative")?;
        number("resolution (m)", self.resolution, |v| v >= 0.0, "it must not be negative")?;
        number(
            "probability of a drop-out",
            self.drop_out,
            |v| (0.0..=1.0).contains(&v),
            "it must be from 0 to 1",
        )
    }

    /// Computes a scan from a pose (`X_WS`) with one echo per beam; `out` is overwritten. `key` and `count` (the index of the scan) select the noise.
    ///
    /// # Errors
    /// An invalid pose, or a scene that is not settled. Call [`Lidar::check`] to check the lidar itself.
    pub fn scan(
        &self,
        scene: &Scene,
        X_WS: &Pose,
        key: u64,
        count: u64,
        out: &mut Vec<Echo>,
    ) -> Result<(), RenderError> {
        check_pose("lidar", X_WS)?;
        scene.check()?;
        out.clear();
        out.extend((0..self.beams.len()).map(|k| self.echo(scene, X_WS, key, count, k)));
        Ok(())
    }

    /// Computes only the echo of beam `k` of that scan, bit-identical to the scan.
    #[must_use]
    pub fn echo(&self, scene: &Scene, X_WS: &Pose, key: u64, count: u64, k: usize) -> Echo {
        let d = X_WS.transform_vector(&self.beams[k]);
        self.measured(scene, &X_WS.position, &d, key, count, k as u32).unwrap_or(NONE)
    }

    fn measured(
        &self,
        scene: &Scene,
        o: &Vec3,
        d: &Vec3,
        key: u64,
        count: u64,
        lane: u32,
    ) -> Option<Echo> {
        let hit = scene.cast(o, d, self.limits[1])?;
        let look = scene.look(hit.object)?;
        let albedo = luminance(look.albedo_at(&scene.local(hit.object, &(o + d * hit.distance))));
        let strength = albedo * hit.normal.dot(d).abs() * (self.reach / hit.distance).powi(2);
        let lost = self.drop_out > 0.0 && noise::uniform(key, count, lane) < self.drop_out;
        if lost || hit.distance < self.limits[0] || !(strength >= 1.0) {
            return None;
        }
        let mut range = hit.distance;
        if self.sigma > 0.0 {
            range += self.sigma * noise::normal(key, count, lane);
        }
        if self.resolution > 0.0 {
            range = (range / self.resolution).round() * self.resolution;
        }
        Some(Echo { range: range.max(0.0), strength, object: hit.object })
    }
}

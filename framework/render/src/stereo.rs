//! Depth from two images of a stereo pair.
//! ```text
//! census     for each pixel 9 × 7 − 1 bits: which neighbours are darker than it
//! cost       C(x, y, d): number of different bits between left (x, y) and right (x − d, y), summed over a window
//! disparity  d of the smallest cost; refined by the parabola through it and both neighbours
//! accepted   when the right image agrees within a pixel, and every d that is not a neighbour costs at least 1 + u times the smallest
//! depth      Z = f B/d;  σ_Z = Z² σ_d/(f B)
//! ```
//! Zabih & Woodfill, "Non-parametric local transforms for computing visual correspondence", ECCV 1994. The images are rectified: the right camera is
//! displaced by `baseline` along the left camera's x axis and has the same pinhole lens without distortion.

use crate::detector::Image;
use crate::error::{RenderError, number};
use crate::lens::{Brown, Lens};
use linkwork_spatial::Pose;

/// Half sizes of the neighbourhood of the census transform.
const CENSUS: [usize; 2] = [4, 3];

/// Maximum memory for the costs of a pair, bytes.
const BYTES_MAX: u128 = 1 << 30;

/// Parameters of stereo matching.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matcher {
    /// Number of disparities that are tested: 0 to one less than this, pixels.
    pub disparities: usize,
    /// Half the edge of the window, pixels.
    pub half_window: usize,
    /// Required margin u of the best disparity over all others, as a fraction of its cost.
    pub uniqueness: f64,
}

impl Default for Matcher {
    fn default() -> Self {
        Self { disparities: 64, half_window: 4, uniqueness: 0.1 }
    }
}

/// Disparities, row by row from the top; NaN where none was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Disparities {
    /// Number of columns.
    pub width: usize,
    /// Number of rows.
    pub height: usize,
    /// Left column minus right column, pixels.
    pub data: Vec<f32>,
}

/// Returns the pose of the right camera of a pair: `baseline` (m) along the left camera's x axis.
#[must_use]
pub fn right_of(X_WC: &Pose, baseline: f64) -> Pose {
    *X_WC * Pose::translation(baseline, 0.0, 0.0)
}

impl Disparities {
    /// Computes depth along the optical axis, m; ∞ where no disparity was found or it is 0.
    ///
    /// # Errors
    /// A lens with distortion, a baseline that is not positive.
    pub fn depth(&self, lens: &Lens, baseline: f64) -> Result<Vec<f64>, RenderError> {
        number("baseline (m)", baseline, |b| b > 0.0, "it must be positive")?;
        let Lens::Brown(Brown { focal, radial: [0.0, 0.0, 0.0], tangential: [0.0, 0.0], .. }) =
            lens
        else {
            let fact = "depth from disparity requires a pinhole lens without distortion".into();
            return Err(RenderError::Pair { fact });
        };
        let depth =
            |d: &f32| if *d > 0.0 { focal[0] * baseline / f64::from(*d) } else { f64::INFINITY };
        Ok(self.data.iter().map(depth).collect())
    }
}

impl Matcher {
    /// Computes the disparities of a pair of grey images, in the left image.
    ///
    /// # Errors
    /// Images that differ in size or bits or are not grey; more disparities than columns; costs that would take more than 1 GiB.
    pub fn match_pair(&self, left: &Image, right: &Image) -> Result<Disparities, RenderError> {
        let (width, height) = (left.width, left.height);
        let fault = |fact: String| Err(RenderError::Pair { fact });
        if (width, height) != (right.width, right.height) || left.bits != right.bits {
            return fault(format!(
                "{width} by {height} pixels of {} bits on the left, {} by {} of {} bits on the right",
                left.bits, right.width, right.height, right.bits
            ));
        }
        if left.channels != 1 || right.channels != 1 {
            return fault("an image has colours".into());
        }
        if left.data.len() != width * height || right.data.len() != width * height {
            return fault("an image does not have one number per pixel".into());
        }
        let most = width as f64;
        number(
            "number of disparities",
            self.disparities as f64,
            |d| d >= 3.0 && d <= most,
            "use a value from 3 to the width of the images",
        )?;
        number(
            "half window (pixels)",
            self.half_window as f64,
            |w| (1.0..=15.0).contains(&w),
            "write 1 to 15",
        )?;
        number("uniqueness", self.uniqueness, |u| u >= 0.0, "it must not be negative")?;
        let bytes = 2 * self.disparities as u128 * left.data.len() as u128;
        if bytes > BYTES_MAX {
            return fault(format!(
                "the costs of {} disparities take {} MB, more than 1 GiB",
                self.disparities,
                bytes >> 20
            ));
        }
        let costs = self.costs(&census(left), &census(right), width, height);
        Ok(Disparities { width, height, data: self.choose(&costs, width, height) })
    }

    /// Computes the costs in windows, one image for each disparity; the largest value where a window extends beyond an image.
    fn costs(&self, left: &[u64], right: &[u64], width: usize, height: usize) -> Vec<u16> {
        let w = self.half_window;
        let (mx, my) = (CENSUS[0] + w, CENSUS[1] + w);
        let mut costs = vec![u16::MAX; self.disparities * width * height];
        let mut sums = vec![0u32; (width + 1) * (height + 1)];
        for (d, image) in costs.chunks_mut(width * height).enumerate() {
            // Compute sums over rectangles from the corner (summed-area table).
            for y in 0..height {
                let mut row = 0;
                for x in 0..width {
                    if x >= d {
                        row += (left[y * width + x] ^ right[y * width + x - d]).count_ones();
                    }
                    sums[(y + 1) * (width + 1) + x + 1] = sums[y * (width + 1) + x + 1] + row;
                }
            }
            let sum = |x: usize, y: usize| sums[y * (width + 1) + x];
            for y in my..height.saturating_sub(my) {
                for x in (mx + d)..width.saturating_sub(mx) {
                    let (x0, x1, y0, y1) = (x - w, x + w + 1, y - w, y + w + 1);
                    let window = sum(x1, y1).wrapping_add(sum(x0, y0));
                    let window = window.wrapping_sub(sum(x0, y1)).wrapping_sub(sum(x1, y0));
                    image[y * width + x] = window as u16;
                }
            }
        }
        costs
    }

    fn choose(&self, costs: &[u16], width: usize, height: usize) -> Vec<f32> {
        let n = width * height;
        let cost = |p: usize, d: usize| costs[d * n + p];
        let best = |cost: &dyn Fn(usize) -> u16| {
            (0..self.disparities).min_by_key(|d| cost(*d)).unwrap_or(0)
        };
        let mut out = vec![f32::NAN; n];
        for (p, out) in out.iter_mut().enumerate() {
            let (x, d) = (p % width, best(&|d| cost(p, d)));
            let least = cost(p, d);
            // The parabola is undefined at an end of the disparity range, because the minimum may lie outside.
            if least == u16::MAX
                || d == 0
                || d + 1 == self.disparities
                || cost(p, d + 1) == u16::MAX
            {
                continue;
            }
            let rival =
                (0..self.disparities).filter(|e| e.abs_diff(d) > 1).map(|e| cost(p, e)).min();
            if rival.is_some_and(|r| f64::from(r) <= f64::from(least) * (1.0 + self.uniqueness)) {
                continue;
            }
            let seen = |e: usize| if x - d + e < width { cost(p - d + e, e) } else { u16::MAX };
            if best(&seen).abs_diff(d) > 1 {
                continue;
            }
            let [a, b, c] = [cost(p, d - 1), least, cost(p, d + 1)].map(f64::from);
            let bend = a - 2.0 * b + c;
            let shift = if bend > 0.0 { 0.5 * (a - c) / bend } else { 0.0 };
            *out = (d as f64 + shift) as f32;
        }
        out
    }
}

/// Computes the bits of darker neighbours; neighbours beyond the border count as not darker.
fn census(image: &Image) -> Vec<u64> {
    let (width, height) = (image.width, image.height);
    let [rx, ry] = CENSUS;
    let mut out = vec![0; width * height];
    for y in ry..height.saturating_sub(ry) {
        for x in rx..width.saturating_sub(rx) {
            let here = image.data[y * width + x];
            let mut bits = 0u64;
            for v in y - ry..=y + ry {
                for u in x - rx..=x + rx {
                    if (u, v) != (x, y) {
                        bits = bits << 1 | u64::from(image.data[v * width + u] < here);
                    }
                }
            }
            out[y * width + x] = bits;
        }
    }
    out
}

//! Corners of an image, and where they are in the next one.
//! ```text
//! strength    least eigenvalue of Σ ∇I ∇Iᵀ over a square: how little the square can be moved without being noticed
//! corners     the strongest pixel of each square of a grid, where it is strong enough
//! search      the whole pixel of greatest normalised cross-correlation c with the patch, within a square about the guess; c ≥ `least`
//! refined     Σ (a J(p + d) + b − I(p))² → least, over d, a, b by Gauss–Newton: exposure and shade may change
//! ```
//! Shi & Tomasi, "Good features to track", CVPR 1994; Lucas & Kanade, IJCAI 1981. Grey images; all sums have a fixed order, so the results for equal
//! images are bit-identical.

use linkwork_render::Image;
use linkwork_spatial::nalgebra::{Matrix4, Vector4};

/// Settings of corner detection and tracking.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Features {
    /// Edge of the squares of which each has one corner at most, pixels.
    pub spacing: usize,
    /// Least strength: the mean square of the gradient over the square, (numbers a pixel)².
    pub strength: f64,
    /// Half the edge of a patch, pixels.
    pub half_patch: usize,
    /// So far from the guess it is looked for, pixels.
    pub search: usize,
    /// Least correlation of a match.
    pub least: f64,
}

/// Half the edge of the square of a corner's strength, pixels.
const HALF: usize = 2;
/// Steps of the refinement at most, and the step (pixels) from which one more changes nothing.
const REFINE: (usize, f64) = (12, 0.003);
/// Refined farther than this from the whole pixel (pixels) it is another thing.
const STRAY: f64 = 1.5;

impl Features {
    /// Corners of a grey image, row by row: column and row of their pixels. `usable`: whether a pixel may be one.
    #[must_use]
    pub fn corners(&self, image: &Image, usable: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
        let (w, h) = (image.width, image.height);
        let border = self.half_patch + 1;
        if w <= 2 * border || h <= 2 * border {
            return vec![];
        }
        let (columns, rows) = (w.div_ceil(self.spacing), h.div_ceil(self.spacing));
        let mut best = vec![(self.strength, None); columns * rows];
        let gradients = gradients(image);
        let count = ((2 * HALF + 1) * (2 * HALF + 1)) as f64;
        for y in border..h - border {
            for x in border..w - border {
                let place = y / self.spacing * columns + x / self.spacing;
                let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
                for v in y - HALF..=y + HALF {
                    for [gx, gy] in &gradients[v * w + x - HALF..=v * w + x + HALF] {
                        (xx, xy, yy) = (xx + gx * gx, xy + gx * gy, yy + gy * gy);
                    }
                }
                let middle = 0.5 * (xx + yy);
                let least = (middle - (0.5 * (xx - yy)).hypot(xy)) / count;
                if least > best[place].0 && usable(y * w + x) {
                    best[place] = (least, Some([x, y]));
                }
            }
        }
        best.into_iter().filter_map(|(_, place)| place).collect()
    }

    /// Returns the position in `to` of the patch around a corner of `from`, pixels; `guess`: its expected position. `None` when nothing there is like
    /// it.
    #[must_use]
    pub fn follow(
        &self,
        from: &Image,
        corner: [usize; 2],
        to: &Image,
        guess: [f64; 2],
    ) -> Option<[f64; 2]> {
        let half = self.half_patch as i64;
        let patch = Patch::of(from, corner.map(|c| c as i64), half)?;
        let middle = guess.map(|g| g.round());
        if !middle.iter().all(|g| g.abs() < 1e6) {
            return None;
        }
        let middle = middle.map(|g| g as i64);
        let reach = self.search as i64;
        let mut best: Option<(f64, [i64; 2])> = None;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let at = [middle[0] + dx, middle[1] + dy];
                let Some(other) = Patch::of(to, at, half) else { continue };
                let c = patch.correlation(&other);
                if c >= self.least && best.is_none_or(|(b, _)| c > b) {
                    best = Some((c, at));
                }
            }
        }
        let (_, at) = best?;
        refined(&patch, to, at, half)
    }
}

/// Central differences; 0 at the border.
fn gradients(image: &Image) -> Vec<[f64; 2]> {
    let (w, h) = (image.width, image.height);
    let mut out = vec![[0.0; 2]; w * h];
    let at = |k: usize| f64::from(image.data[k]);
    for y in 1..h - 1 {
        for x in 1..w - 1 {
            let k = y * w + x;
            out[k] = [0.5 * (at(k + 1) - at(k - 1)), 0.5 * (at(k + w) - at(k - w))];
        }
    }
    out
}

/// The numbers about a pixel, less their mean, and the root of the sum of their squares.
struct Patch {
    numbers: Vec<f64>,
    size: f64,
}

impl Patch {
    fn of(image: &Image, [x, y]: [i64; 2], half: i64) -> Option<Patch> {
        let (w, h) = (image.width as i64, image.height as i64);
        let inside = x - half >= 1 && y - half >= 1 && x + half < w - 1 && y + half < h - 1;
        if !inside {
            return None;
        }
        let mut numbers = Vec::with_capacity(((2 * half + 1) * (2 * half + 1)) as usize);
        for v in y - half..=y + half {
            let row = (v * w + x - half) as usize;
            let row = &image.data[row..row + (2 * half + 1) as usize];
            numbers.extend(row.iter().map(|n| f64::from(*n)));
        }
        let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
        numbers.iter_mut().for_each(|n| *n -= mean);
        let size = numbers.iter().map(|n| n * n).sum::<f64>().sqrt();
        Some(Patch { numbers, size })
    }

    fn correlation(&self, other: &Patch) -> f64 {
        let sum: f64 = self.numbers.iter().zip(&other.numbers).map(|(a, b)| a * b).sum();
        let size = self.size * other.size;
        if size > 0.0 { sum / size } else { -1.0 }
    }
}

/// The place of a patch to parts of a pixel.
fn refined(patch: &Patch, to: &Image, at: [i64; 2], half: i64) -> Option<[f64; 2]> {
    let w = to.width;
    let number = |x: i64, y: i64| f64::from(to.data[y as usize * w + x as usize]);
    let mut place = at.map(|a| a as f64);
    let (mut gain, mut offset) = (1.0, 0.0);
    for n in 0..REFINE.0 {
        let low = place.map(f64::floor);
        let [fx, fy] = [place[0] - low[0], place[1] - low[1]];
        let [x0, y0] = low.map(|l| l as i64);
        let (right, down) = (to.width as i64 - 3, to.height as i64 - 3);
        if x0 - half < 1 || y0 - half < 1 || x0 + half > right || y0 + half > down {
            return None;
        }
        let sample = |x: i64, y: i64| {
            let upper = number(x, y) * (1.0 - fx) + number(x + 1, y) * fx;
            let lower = number(x, y + 1) * (1.0 - fx) + number(x + 1, y + 1) * fx;
            upper * (1.0 - fy) + lower * fy
        };
        if n == 0 {
            // Subtract the mean at this position, because the gain is relative to it.
            let all = (-half..=half).flat_map(|v| (-half..=half).map(move |u| [u, v]));
            let sum: f64 = all.map(|[u, v]| sample(x0 + u, y0 + v)).sum();
            offset = -sum / patch.numbers.len() as f64;
        }
        let (mut square, mut side) = (Matrix4::zeros(), Vector4::zeros());
        let mut k = 0;
        for v in -half..=half {
            for u in -half..=half {
                let (x, y) = (x0 + u, y0 + v);
                let here = sample(x, y);
                let gx = 0.5 * (sample(x + 1, y) - sample(x - 1, y));
                let gy = 0.5 * (sample(x, y + 1) - sample(x, y - 1));
                let off = gain * (here + offset) - patch.numbers[k];
                let row = Vector4::new(gain * gx, gain * gy, here + offset, gain);
                square += row * row.transpose();
                side -= row * off;
                k += 1;
            }
        }
        let step = square.cholesky()?.solve(&side);
        place = [place[0] + step[0], place[1] + step[1]];
        gain += step[2];
        offset += step[3];
        let off = (place[0] - at[0] as f64).hypot(place[1] - at[1] as f64);
        if !(off <= STRAY) {
            return None;
        }
        if step[0].hypot(step[1]) < REFINE.1 {
            return Some(place);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const FEATURES: Features =
        Features { spacing: 12, strength: 4.0, half_patch: 5, search: 4, least: 0.8 };

    /// A smooth texture without a pattern, moved by a distance (pixels), with a gain and an offset.
    fn image(shift: [f64; 2], gain: f64, offset: f64) -> Image {
        let (width, height) = (96, 72);
        let wave = |x: f64, y: f64| {
            (0.61 * x + 0.23 * y).sin()
                + (0.37 * y - 0.45 * x + 1.0).sin()
                + (0.71 * y + 0.1 * x + 2.0).sin()
                + (0.29 * x - 0.83 * y).cos()
        };
        let data = (0..width * height)
            .map(|k| {
                let (x, y) = ((k % width) as f64 - shift[0], (k / width) as f64 - shift[1]);
                (offset + gain * (2000.0 + 300.0 * wave(x, y))).round() as u16
            })
            .collect();
        Image { width, height, channels: 1, bits: 12, data }
    }

    #[test]
    fn a_shift_is_found_to_two_hundredths_of_a_pixel_whatever_the_exposure() {
        let from = image([0.0; 2], 1.0, 0.0);
        let corners = FEATURES.corners(&from, |_| true);
        assert!(corners.len() > 25, "{}", corners.len());
        for (shift, gain, offset) in
            [([0.0, 0.0], 1.0, 0.0), ([2.37, -1.61], 0.8, 100.0), ([-0.5, 3.1], 1.3, -300.0)]
        {
            let to = image(shift, gain, offset);
            // Use the corners whose patches stay inside the image.
            let moved = |c: &[usize; 2]| [c[0] as f64 + shift[0], c[1] as f64 + shift[1]];
            let inside = |p: &[f64; 2]| (9.0..86.0).contains(&p[0]) && (9.0..62.0).contains(&p[1]);
            let mut worst = 0.0_f64;
            let mut count = 0;
            for corner in corners.iter().filter(|c| inside(&moved(c))) {
                let guess = [corner[0] as f64 + 1.0, corner[1] as f64 - 0.6];
                let (p, want) = (FEATURES.follow(&from, *corner, &to, guess), moved(corner));
                let off = p.map_or(f64::INFINITY, |p| (p[0] - want[0]).hypot(p[1] - want[1]));
                worst = if off <= worst { worst } else { off };
                count += 1;
            }
            println!("{count} of {}, {worst:.4} pixels off", corners.len());
            assert!(count > 25 && worst < 0.02, "{count} {worst}");
        }
    }

    #[test]
    fn what_is_flat_an_edge_or_elsewhere_is_no_match() {
        let flat = Image { data: vec![700; 96 * 72], ..image([0.0; 2], 1.0, 0.0) };
        assert!(FEATURES.corners(&flat, |_| true).is_empty());
        let edge = (0..96 * 72).map(|k| if k % 96 < 50 { 400 } else { 1800 }).collect();
        assert!(FEATURES.corners(&Image { data: edge, ..flat.clone() }, |_| true).is_empty());
        let from = image([0.0; 2], 1.0, 0.0);
        let corner = FEATURES.corners(&from, |_| true)[10];
        let at = corner.map(|c| c as f64);
        assert!(FEATURES.follow(&from, corner, &flat, at).is_none());
        // The image is shifted by twenty pixels, so no match is within four pixels of the guess; a guess outside the image has none.
        let far = image([20.0, 17.0], 1.0, 0.0);
        let near = |p: Option<[f64; 2]>| p.is_some_and(|p| (p[0] - at[0] - 20.0).abs() < 1.0);
        assert!(!near(FEATURES.follow(&from, corner, &far, at)));
        assert!(FEATURES.follow(&from, corner, &from, [-50.0, 1e9]).is_none());
        assert!(FEATURES.follow(&from, corner, &from, [f64::NAN, 0.0]).is_none());
    }
}

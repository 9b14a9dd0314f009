//! Gradient noise on a square lattice, and octaves of it, whose sum is the relief of generated terrain.
//! ```text
//! n(x, y) = √2 Σ_k g_k · (p − p_k) w(u, v)     over the four corners k of the cell, w from the fade t³(t(6t − 15) + 10)
//! ```
//! Rows of nodes are computed with four SIMD lanes; the results are bit-identical to [`Cell::noise`].

use crate::random::mix;
use wide::f64x4;

/// Current cell of the noise lattice with the gradients at its corners, and a cache of earlier gradients, because the next row of nodes uses most of
/// them again.
pub(crate) struct Cell {
    at: [f64; 2],
    seed: u64,
    /// cos and sin at (0, 0), (1, 0), (0, 1), (1, 1).
    gradients: [[f64; 2]; 4],
    /// Cache, indexed by the low bits of the column and row of a lattice point, so that neighbouring points are neighbours in memory: column and row,
    /// and cos and sin of the gradient there.
    known: Vec<([i64; 2], [f64; 2])>,
}

/// Lattice points of the cache along each axis, a power of two.
const SIDE: usize = 1 << 7;

impl Cell {
    pub(crate) fn new(seed: u64) -> Cell {
        let known = vec![([i64::MIN; 2], [0.0; 2]); SIDE * SIDE];
        Cell { at: [f64::NAN; 2], seed, gradients: [[0.0; 2]; 4], known }
    }

    fn move_to(&mut self, i: f64, j: f64) {
        let (before, [oi, oj]) = (self.gradients, self.at);
        self.at = [i, j];
        self.gradients = CORNERS.map(|[di, dj]| {
            let (i, j) = (i + di, j + dj);
            // Copy the corners that the cell shares with the previous one. The comparisons are false for the
            // initial NaN.
            let (a, b) = (i - oi, j - oj);
            if (a == 0.0 || a == 1.0) && (b == 0.0 || b == 1.0) {
                return before[a as usize + 2 * b as usize];
            }
            let (column, row) = (i as i64, j as i64);
            let known = &mut self.known[row as usize % SIDE * SIDE + column as usize % SIDE];
            if known.0 != [column, row] {
                let key = (column as u64).wrapping_mul(0x8da6_b343)
                    ^ (row as u64).wrapping_mul(0xd816_3841_0000_0001);
                *known = ([column, row], turned(mix(key ^ self.seed)));
            }
            known.1
        });
    }

    /// Returns the gradients at the corners of the cell `i`, `j`.
    fn corners(&mut self, i: f64, j: f64) -> &[[f64; 2]; 4] {
        if self.at != [i, j] {
            self.move_to(i, j);
        }
        &self.gradients
    }

    /// Returns gradient noise with a C² fade, about −1 to 1.
    pub(crate) fn noise(&mut self, x: f64, y: f64) -> f64 {
        let (i, j) = (x.floor(), y.floor());
        let (u, v) = (x - i, y - j);
        let gradients = *self.corners(i, j);
        let fade = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
        let corner = |k: usize| {
            let ([cos, sin], [di, dj]) = (gradients[k], CORNERS[k]);
            cos * (u - di) + sin * (v - dj)
        };
        let (fu, fv) = (fade(u), fade(v));
        let low = corner(0) * (1.0 - fu) + corner(1) * fu;
        let high = corner(2) * (1.0 - fu) + corner(3) * fu;
        (low * (1.0 - fv) + high * fv) * std::f64::consts::SQRT_2
    }
}

/// Returns cos and sin of the angle that is derived from a hash.
fn turned(hash: u64) -> [f64; 2] {
    let turn = (hash >> 11) as f64 / (1u64 << 53) as f64;
    let (sin, cos) = (turn * std::f64::consts::TAU).sin_cos();
    [cos, sin]
}

const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];

/// Noise of one wavelength, rotated and scaled.
pub(crate) struct Octave {
    /// Wavelength, m.
    pub length: f64,
    /// Factor of the noise.
    pub gain: f64,
    /// sin and cos of the angle between the axes of the map and those of the lattice.
    pub turn: (f64, f64),
    /// Seed of the [`Cell`].
    pub seed: u64,
}

impl Octave {
    /// Adds the octave at `xs[k]`, `y` (m) to `sum[k]`. `cell` has the seed of the octave.
    pub(crate) fn add(&self, cell: &mut Cell, xs: &[f64], y: f64, sum: &mut [f64]) {
        let (sin, cos) = self.turn;
        let (sin_y, cos_y) = (sin * y, cos * y);
        let place = |x: f64| ((cos * x - sin_y) / self.length, (sin * x + cos_y) / self.length);
        let (fours, rest) = xs.as_chunks::<4>();
        let (sum_fours, sum_rest) = sum.as_chunks_mut::<4>();
        for (x, sum) in fours.iter().zip(sum_fours) {
            let x = f64x4::from(*x);
            let length = f64x4::splat(self.length);
            let u = (x * cos - f64x4::splat(sin_y)) / length;
            let v = (x * sin + f64x4::splat(cos_y)) / length;
            *sum = (f64x4::from(*sum) + noise_of_four(cell, u, v) * self.gain).to_array();
        }
        for (x, sum) in rest.iter().zip(sum_rest) {
            let (u, v) = place(*x);
            *sum += self.gain * cell.noise(u, v);
        }
    }
}

/// [`Cell::noise`] at four points.
fn noise_of_four(cell: &mut Cell, x: f64x4, y: f64x4) -> f64x4 {
    let (i, j) = (x.floor(), y.floor());
    let (iu, jv) = (i.to_array(), j.to_array());
    // Compute cos and sin at each corner, with one SIMD lane per point.
    let mut gradients = [[f64x4::ZERO; 2]; 4];
    if iu == [iu[0]; 4] && jv == [jv[0]; 4] {
        let corners = cell.corners(iu[0], jv[0]);
        for (lanes, corner) in gradients.iter_mut().zip(corners) {
            *lanes = corner.map(f64x4::splat);
        }
    } else {
        let mut by_point = [[[0.0; 4]; 2]; 4];
        for point in 0..4 {
            let corners = cell.corners(iu[point], jv[point]);
            for (lanes, corner) in by_point.iter_mut().zip(corners) {
                lanes[0][point] = corner[0];
                lanes[1][point] = corner[1];
            }
        }
        for (lanes, corner) in gradients.iter_mut().zip(by_point) {
            *lanes = corner.map(f64x4::from);
        }
    }
    let (u, v) = (x - i, y - j);
    let fade = |t: f64x4| t * t * t * (t * (t * 6.0 - f64x4::splat(15.0)) + 10.0);
    let corner = |k: usize| {
        let ([cos, sin], [di, dj]) = (gradients[k], CORNERS[k]);
        cos * (u - f64x4::splat(di)) + sin * (v - f64x4::splat(dj))
    };
    let (fu, fv) = (fade(u), fade(v));
    let one = f64x4::ONE;
    let low = corner(0) * (one - fu) + corner(1) * fu;
    let high = corner(2) * (one - fu) + corner(3) * fu;
    (low * (one - fv) + high * fv) * std::f64::consts::SQRT_2
}

#[cfg(test)]
mod tests {
    use super::*;

    /// SIMD rows that begin anywhere are bit-identical to single points, for lattices coarser and finer than the node spacing.
    #[test]
    fn four_points_at_a_time_have_the_bits_of_one_at_a_time() {
        for (length, step) in [(40.0, 0.05), (0.11, 0.05), (3.0, 1.0), (1e-3, 0.25)] {
            let octave = Octave { length, gain: 0.37, turn: 2.6_f64.sin_cos(), seed: 17 };
            let xs: Vec<f64> = (0..1003).map(|k| -20.0 + f64::from(k) * step).collect();
            let mut sum = vec![0.25; xs.len()];
            octave.add(&mut Cell::new(octave.seed), &xs, 3.7, &mut sum);
            // Each reference point uses a new cell, so that a difference would show an error of the cache.
            for (x, sum) in xs.iter().zip(&sum) {
                let mut alone = [0.25];
                octave.add(&mut Cell::new(octave.seed), &[*x], 3.7, &mut alone);
                assert_eq!(sum.to_bits(), alone[0].to_bits(), "{length} m at {x} m");
            }
        }
    }
}

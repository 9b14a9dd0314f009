//! Geometry of a path: straight pieces, and parabolas at the corners that are tangent to them.
//!
//! ```text
//! straight      q = a + u s,                   q′ = u,  q″ = 0            u: unit vector
//! corner c      q = c + (s − h) u  …  c + (s − h) w  over s = 0 … 2 h, the parabola with the tangents u and w
//!               q′ = u + (w − u) s/(2 h),  q″ = (w − u)/(2 h)
//!               it cuts the corner by h |w − u|/4
//! ```
//! s is the length in the space of all coordinates (rad and m are added without scaling). q′ is continuous where corners are rounded.

/// One piece of a path: a quadratic function of the length along it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Position at which it begins, and length.
    pub s: f64,
    pub length: f64,
    /// True if the motion is at rest at its end: at a corner that is not rounded, and at the end of the path.
    pub stop: bool,
}

/// A path in pieces. `q0`, `d1` and `d2` have one row of n numbers for each piece: q = q0 + d1 σ + d2 σ²/2.
#[derive(Clone, Debug)]
pub(super) struct Geometry {
    pub n: usize,
    pub pieces: Vec<Piece>,
    q0: Vec<f64>,
    d1: Vec<f64>,
    d2: Vec<f64>,
    u: Vec<f64>,
    w: Vec<f64>,
}

impl Geometry {
    /// Reserves memory for n coordinates and paths of up to `corners` configurations, including both ends.
    pub fn new(n: usize, corners: usize) -> Self {
        let room = 2 * corners;
        let rows = || Vec::with_capacity(n * room);
        let (q0, d1, d2) = (rows(), rows(), rows());
        let pieces = Vec::with_capacity(room);
        Self { n, pieces, q0, d1, d2, u: vec![0.0; n], w: vec![0.0; n] }
    }

    /// Returns the length of the whole path.
    pub fn length(&self) -> f64 {
        self.pieces.last().map_or(0.0, |p| p.s + p.length)
    }

    /// Returns true for a straight piece, false for a rounded corner.
    pub fn is_straight(&self, piece: usize) -> bool {
        self.d2[self.n * piece..self.n * (piece + 1)].iter().all(|x| *x == 0.0)
    }

    /// Divides a path (rows of n numbers, within the reserved memory) into pieces. A rounded corner is at most `round` away from the corner itself.
    pub fn make<'a>(&mut self, mut rows: impl Iterator<Item = &'a [f64]>, round: f64) {
        self.pieces.clear();
        [&mut self.q0, &mut self.d1, &mut self.d2].into_iter().for_each(Vec::clear);
        let apart = |a: &[f64], b: &[f64]| {
            a.iter().zip(b).map(|(a, b)| (b - a) * (b - a)).sum::<f64>().sqrt()
        };
        // A corner uses at most half of each adjacent straight piece. Repeated rows count as one.
        let Some(mut from) = rows.next() else { return };
        let mut next_other = |at: &[f64]| rows.find(|r| apart(at, r) > 0.0);
        let Some(mut to) = next_other(from) else { return };
        let (mut s, mut used) = (0.0, 0.0);
        loop {
            let length = apart(from, to);
            for (u, (a, b)) in self.u.iter_mut().zip(from.iter().zip(to)) {
                *u = (b - a) / length;
            }
            let after = next_other(to);
            let mut h = 0.0;
            let mut bend = 0.0;
            if let Some(after) = after {
                let further = apart(to, after);
                for (w, (a, b)) in self.w.iter_mut().zip(to.iter().zip(after)) {
                    *w = (b - a) / further;
                }
                bend = apart(&self.u, &self.w);
                if bend > 1e-9 && round > 0.0 {
                    h = (4.0 * round / bend).min(0.5 * length).min(0.5 * further);
                }
            }
            let straight = length - used - h;
            // Two adjacent corners that use a whole straight piece leave no straight piece between them.
            if straight > 1e-12 * length {
                let stop = h == 0.0 && (after.is_none() || bend > 1e-9);
                self.pieces.push(Piece { s, length: straight, stop });
                for (a, u) in from.iter().zip(&self.u) {
                    self.q0.push(a + u * used);
                    self.d1.push(*u);
                    self.d2.push(0.0);
                }
                s += straight;
            }
            if h > 0.0 {
                self.pieces.push(Piece { s, length: 2.0 * h, stop: false });
                for (c, (u, w)) in to.iter().zip(self.u.iter().zip(&self.w)) {
                    self.q0.push(c - u * h);
                    self.d1.push(*u);
                    self.d2.push((w - u) / (2.0 * h));
                }
                s += 2.0 * h;
            }
            used = h;
            let Some(after) = after else { return };
            (from, to) = (to, after);
        }
    }

    /// Writes q, q′ and q″ (n each) at σ from the beginning of a piece.
    pub fn at(&self, piece: usize, sigma: f64, q: &mut [f64], d1: &mut [f64], d2: &mut [f64]) {
        let row = self.n * piece..self.n * (piece + 1);
        let rows = self.q0[row.clone()].iter().zip(&self.d1[row.clone()]).zip(&self.d2[row]);
        for (i, ((a, b), c)) in rows.enumerate() {
            q[i] = a + sigma * (b + 0.5 * sigma * c);
            d1[i] = b + sigma * c;
            d2[i] = *c;
        }
    }
}

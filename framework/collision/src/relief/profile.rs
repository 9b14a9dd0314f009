//! The ground below a disc of a wheel as a curve in its plane, and the points where it is nearest to the centre.
//! ```text
//! profile   cubics through heights and slopes of posts, s along the disc, ζ up, from its centre
//! peaks     local maxima of d = r − √(s² + ζ²):  E = s + ζ ζ' = 0 from − to +;  E' = 1 + ζ'² + ζ ζ''
//! ```
//! A piece whose control points lie below the rim is skipped. A piece on which E' is positive has at most one maximum, found by two Newton steps from
//! the zero of the chord of E. All other pieces are divided into parts. The result is continuous in the posts.

use wide::f64x4;

/// Number of posts of the profile.
pub(crate) const POSTS: usize = 9;
/// Their positions, relative to the radius.
pub(crate) const PLACES: [f64; POSTS] = [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0];
/// √(1 − position²): height of the rim, relative to the radius.
pub(crate) const RIM: [f64; POSTS] = [
    0.0,
    0.661_437_827_766_147_7,
    0.866_025_403_784_438_6,
    0.968_245_836_551_854_2,
    1.0,
    0.968_245_836_551_854_2,
    0.866_025_403_784_438_6,
    0.661_437_827_766_147_7,
    0.0,
];
/// Maximum number of local maxima of d that are tracked, including those without contact.
const PEAKS: usize = 6;
/// Maximum number of posts, including those at peaks.
pub(crate) const POSTS_MAX: usize = POSTS + 2 * PEAKS;
/// Number of parts of a piece in which the sign of E is tested.
const PARTS: usize = 4;
/// Number of Newton steps.
const NEWTON: usize = 2;
/// Slope that a piece may always have at its end; a larger one is limited in proportion to the rise of the piece.
const SLOPE_FREE: f64 = 1.0;

/// The profile of the ground at one position: s, ζ, dζ/ds, and the ground's slope along the axle.
#[derive(Clone, Copy)]
pub(crate) struct Post {
    pub s: f64,
    pub z: f64,
    pub slope: f64,
    pub side: f64,
}

pub(crate) const NO_POST: Post = Post { s: 0.0, z: 0.0, slope: 0.0, side: 0.0 };

/// The profile: posts sorted by s.
pub(crate) struct Profile {
    pub posts: [Post; POSTS_MAX],
    pub count: usize,
}

/// A local maximum of d, with its weight.
#[derive(Clone, Copy)]
pub(crate) struct Peak {
    pub at: Post,
    pub d: f64,
    pub share: f64,
    /// Smallest d between this maximum and the next.
    pub saddle: f64,
}

/// Local maxima sorted by s.
pub(crate) struct Peaks {
    pub peaks: [Peak; PEAKS],
    pub count: usize,
    /// Radius, and clearance within which maxima are kept, m.
    pub r: f64,
    pub margin: f64,
}

impl Peaks {
    /// Creates an empty list.
    #[inline]
    pub fn new(r: f64) -> Peaks {
        let none = Peak { at: NO_POST, d: 0.0, share: 0.0, saddle: 0.0 };
        Peaks { peaks: [none; PEAKS], count: 0, r, margin: 0.0 }
    }

    pub fn found(&self) -> &[Peak] {
        &self.peaks[..self.count]
    }

    /// Adds a maximum at u of a piece, unless it is far from the ground or the ground is seen from inside.
    #[inline]
    fn push(&mut self, piece: &Piece, u: f64) {
        let at = piece.at(u);
        let d = self.r - (at.s * at.s + at.z * at.z).sqrt();
        let faces = at.s * at.slope > at.z;
        if d > -self.margin && faces && self.count < PEAKS {
            self.peaks[self.count] = Peak { at, d, share: 1.0, saddle: f64::INFINITY };
            self.count += 1;
        }
    }

    /// Records that d falls to this value between the last maximum and the next.
    #[inline]
    fn saddle(&mut self, d: f64) {
        if let Some(last) = self.count.checked_sub(1) {
            self.peaks[last].saddle = self.peaks[last].saddle.min(d);
        }
    }

    /// Processes a part of a piece from (u, E) to (u, E): a change of sign of E is a maximum or a saddle.
    #[inline(always)]
    fn step(&mut self, piece: &Piece, from: (f64, f64), to: (f64, f64)) {
        if (from.1 < 0.0) == (to.1 < 0.0) {
            return;
        }
        // Regula falsi, because its result depends continuously on the data.
        let between = |a: (f64, f64), b: (f64, f64)| a.0 + (b.0 - a.0) * (a.1 / (a.1 - b.1));
        let (mut a, mut b) = (from, to);
        let mut u = between(a, b);
        if b.0 > a.0 {
            for _ in 0..3 {
                let e = piece.error(u);
                if (e < 0.0) == (a.1 < 0.0) {
                    a = (u, e);
                } else {
                    b = (u, e);
                }
                u = between(a, b);
            }
        }
        if to.1 < 0.0 {
            let at = piece.at(u);
            self.saddle(self.r - (at.s * at.s + at.z * at.z).sqrt());
        } else {
            self.push(piece, u);
        }
    }

    /// Joins peaks by saddles, the highest first: each group keeps what is above the saddle, and what is below it is shared in proportion. The order
    /// of equal saddles has no effect.
    #[inline]
    fn share(&mut self) {
        let (n, margin) = (self.count, self.margin);
        if n < 2 {
            return;
        }
        // Groups are consecutive peaks; `total` is the total of the group of each peak.
        let mut total: [f64; PEAKS] = std::array::from_fn(|k| self.peaks[k].d + margin);
        let mut group: [usize; PEAKS] = std::array::from_fn(|k| k);
        let mut open: [f64; PEAKS] = std::array::from_fn(|k| {
            if k + 1 < n { self.peaks[k].saddle + margin } else { f64::NEG_INFINITY }
        });
        loop {
            let mut top = 0;
            for k in 1..n {
                if open[k] > open[top] {
                    top = k;
                }
            }
            let q = open[top];
            if q.is_nan() || q <= 0.0 {
                return;
            }
            open[top] = f64::NEG_INFINITY;
            let (a, b) = (group[top], group[top + 1]);
            let (over_a, over_b) = ((total[a] - q).max(0.0), (total[b] - q).max(0.0));
            let over = over_a + over_b;
            let part = |mine: f64| if over > 0.0 { mine * (1.0 + q / over) } else { 0.5 * q };
            let (keep_a, keep_b) = (part(over_a) / total[a], part(over_b) / total[b]);
            for k in 0..n {
                if group[k] == a {
                    self.peaks[k].share *= keep_a;
                } else if group[k] == b {
                    self.peaks[k].share *= keep_b;
                    group[k] = a;
                }
            }
            total[a] = over + q;
        }
    }
}

impl Profile {
    /// Inserts a post between others, at the position of a peak: `weight` times the exact one, plus the rest of the profile there. Returns its index,
    /// or that of an existing post.
    #[inline]
    pub fn insert(&mut self, had: &Post, exact: &Post, weight: f64, same: f64) -> usize {
        let mix = |a: f64, b: f64| a + weight * (b - a);
        let post = Post {
            s: had.s,
            z: mix(had.z, exact.z),
            slope: mix(had.slope, exact.slope),
            side: mix(had.side, exact.side),
        };
        let near = self.posts[..self.count].iter().position(|p| (p.s - had.s).abs() < same);
        if let Some(k) = near {
            return k;
        }
        if self.count == POSTS_MAX {
            return 0;
        }
        let mut k = self.count;
        while k > 0 && self.posts[k - 1].s > post.s {
            self.posts[k] = self.posts[k - 1];
            k -= 1;
        }
        self.posts[k] = post;
        self.count += 1;
        k
    }

    /// Finds the maxima of d above −margin on the pieces between the first posts, with their weights. The result equals that of `peaks`, but the part
    /// that most pieces need is vectorized.
    #[inline]
    pub fn first_peaks(&self, out: &mut Peaks) {
        const N: usize = POSTS - 1;
        let length = out.r / (N / 2) as f64;
        let (inverse, reach) = (1.0 / length, out.r + out.margin);
        let z: [f64; POSTS] = std::array::from_fn(|k| self.posts[k].z);
        let slope: [f64; POSTS] = std::array::from_fn(|k| self.posts[k].slope * length);
        let four =
            |of: &[f64; POSTS], k: usize| f64x4::new([of[k], of[k + 1], of[k + 2], of[k + 3]]);
        let (mut below, mut once) = (0, 0);
        let mut ends = [[0.0; N]; 2];
        for k in [0, 4] {
            let (z0, z1) = (four(&z, k), four(&z, k + 1));
            let rise = z1 - z0;
            let most = (rise.abs() * 3.0).fast_max(f64x4::splat(SLOPE_FREE * length));
            let m0 = four(&slope, k).fast_min(most).fast_max(-most);
            let m1 = four(&slope, k + 1).fast_min(most).fast_max(-most);
            let (c2, c3) = (rise * 3.0 - m0 * 2.0 - m1, m0 + m1 - rise * 2.0);
            let (low, high) = (z0 + m0 * (1.0 / 3.0), z1 - m1 * (1.0 / 3.0));
            let top = z0.fast_max(z1).fast_max(low).fast_max(high);
            let s: [f64x4; 2] = [k, k + 1].map(|k| four(&PLACES, k) * out.r);
            let near = s[0].abs().fast_min(s[1].abs());
            let far = (top * top + near * near).simd_gt(f64x4::splat(reach * reach));
            below |= (top.simd_lt(f64x4::ZERO) & far).to_bitmask() << k;
            let bend = (c2 * 2.0).abs().fast_max((c2 * 2.0 + c3 * 6.0).abs());
            let size = z0.abs().fast_max(z1.abs()).fast_max(low.abs()).fast_max(high.abs());
            once |= (bend * size).simd_lt(f64x4::splat(length * length)).to_bitmask() << k;
            ends[0][k..k + 4].copy_from_slice((s[0] + z0 * m0 * inverse).as_array());
            ends[1][k..k + 4].copy_from_slice((s[1] + z1 * m1 * inverse).as_array());
        }
        let mut before = None;
        for k in 0..N {
            let (from, to) = (ends[0][k], ends[1][k]);
            let (below, once) = (below >> k & 1 == 1, once >> k & 1 == 1);
            let kink = before.is_some_and(|e: f64| (e < 0.0) != (from < 0.0));
            let quiet = once && !kink && !(from < 0.0 && to >= 0.0);
            if below {
                before = None;
                out.saddle(f64::NEG_INFINITY);
            } else if quiet && 0 < k && k + 1 < N {
                before = Some(to);
            } else {
                before = self.search(k, before, out);
            }
        }
        out.share();
    }

    /// Finds the maxima of d above −margin on some pieces, with their weights.
    #[inline]
    pub fn peaks(&self, pieces: std::ops::Range<usize>, out: &mut Peaks) {
        let mut before = None;
        for k in pieces {
            before = self.search(k, before, out);
        }
        out.share();
    }

    /// Finds the maxima of d on one piece. `before` is E at the end of the previous piece, `None` after a skipped one. Returns that of this piece.
    #[inline]
    fn search(&self, k: usize, before: Option<f64>, out: &mut Peaks) -> Option<f64> {
        let piece = Piece::of(&self.posts[k], &self.posts[k + 1]);
        if piece.below(out.r + out.margin) {
            out.saddle(f64::NEG_INFINITY);
            return None;
        }
        let mut from = (0.0, piece.error(0.0));
        if let Some(e) = before {
            // At a kink, the slope on one side differs from the slope on the other.
            out.step(&piece, (0.0, e), from);
        } else if k == 0 && from.1 > 0.0 {
            out.push(&piece, 0.0);
        }
        if piece.turns_once() {
            let to = (1.0, piece.error(1.0));
            if from.1 < 0.0 && to.1 >= 0.0 {
                let mut u = from.1 / (from.1 - to.1);
                for _ in 0..NEWTON {
                    u = piece.newton(u);
                }
                out.push(&piece, u);
            }
            from = to;
        } else {
            for i in 1..=PARTS {
                let u = i as f64 / PARTS as f64;
                let to = (u, piece.error(u));
                out.step(&piece, from, to);
                from = to;
            }
        }
        if k + 2 == self.count && from.1 < 0.0 {
            out.push(&piece, 1.0);
        }
        Some(from.1)
    }
}

/// A cubic between two posts, with u from 0 to 1.
struct Piece {
    s: f64,
    length: f64,
    /// 1/length.
    inverse: f64,
    /// Coefficients of ζ by powers of u.
    c: [f64; 4],
    /// Control heights between the ends.
    control: [f64; 2],
    z_end: f64,
    side: [f64; 2],
}

impl Piece {
    #[inline(always)]
    fn of(a: &Post, b: &Post) -> Piece {
        let length = b.s - a.s;
        let rise = b.z - a.z;
        // End slopes that are too steep for the rise would create ground that does not exist.
        let most = (3.0 * rise.abs()).max(SLOPE_FREE * length);
        let (m0, m1) =
            ((a.slope * length).clamp(-most, most), (b.slope * length).clamp(-most, most));
        Piece {
            s: a.s,
            length,
            inverse: 1.0 / length,
            c: [a.z, m0, 3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise],
            control: [a.z + m0 / 3.0, b.z - m1 / 3.0],
            z_end: b.z,
            side: [a.side, b.side],
        }
    }

    /// Returns true if no point is within `reach` (m) of the centre, because all control points are below that circle.
    #[inline(always)]
    fn below(&self, reach: f64) -> bool {
        let top = self.c[0].max(self.control[0]).max(self.control[1]).max(self.z_end);
        let end = self.s + self.length;
        let near = if self.s > 0.0 { self.s } else { (-end).max(0.0) };
        top < 0.0 && top * top + near * near > reach * reach
    }

    /// Returns true if E increases over the piece: E' = 1 + ζ'² + ζ ζ'' is positive.
    #[inline(always)]
    fn turns_once(&self) -> bool {
        let [c0, _, c2, c3] = self.c;
        let bend = (2.0 * c2).abs().max((2.0 * c2 + 6.0 * c3).abs());
        let ends = c0.abs().max(self.z_end.abs());
        let size = ends.max(self.control[0].abs()).max(self.control[1].abs());
        bend * size < self.length * self.length
    }

    /// Returns ζ and ζ'.
    #[inline(always)]
    fn height(&self, u: f64) -> (f64, f64) {
        let [c0, c1, c2, c3] = self.c;
        let z = c3.mul_add(u, c2).mul_add(u, c1).mul_add(u, c0);
        let slope = (3.0 * c3).mul_add(u, 2.0 * c2).mul_add(u, c1) * self.inverse;
        (z, slope)
    }

    /// Returns E = s + ζ ζ'.
    #[inline(always)]
    fn error(&self, u: f64) -> f64 {
        let (z, slope) = self.height(u);
        z.mul_add(slope, u.mul_add(self.length, self.s))
    }

    /// Performs a Newton step from u, kept within the piece.
    #[inline(always)]
    fn newton(&self, u: f64) -> f64 {
        let (z, slope) = self.height(u);
        let [.., c2, c3] = self.c;
        let bend = (2.0 * c2 + 6.0 * c3 * u) * self.inverse * self.inverse;
        let e = z.mul_add(slope, u.mul_add(self.length, self.s));
        let rise = z.mul_add(bend, slope.mul_add(slope, 1.0)) * self.length;
        (u - e / rise).clamp(0.0, 1.0)
    }

    fn at(&self, u: f64) -> Post {
        let (z, slope) = self.height(u);
        Post {
            s: self.s + u * self.length,
            z,
            slope,
            side: self.side[0] + u * (self.side[1] - self.side[0]),
        }
    }
}

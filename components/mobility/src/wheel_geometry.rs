//! Where a wheel touches a height field: patches on the rims of a few discs across its width.
//! ```text
//! profile     ζ(s): the ground in the plane of a disc, s along e₁, ζ along e₂, from the disc's centre
//!             e₂: W's z made perpendicular to the axle;  e₁ = axle × e₂
//! distance    D² = s² + ζ²,  d = r − D;   patches: local maxima of d, E = s + ζ ζ' = 0 from − to +
//! depth       δ = d cos λ,  normal  n = −cos λ (s e₁ + ζ e₂)/D + axle sin λ
//! ```
//! λ is the slope of the ground across the disc. The profile is made of cubics through the heights and slopes of nine
//! posts over the whole diameter and of one more at each patch; a piece whose control points lie below the
//! rim is skipped, the others are searched by arithmetic. Nothing is followed from step to step.
//!
//! Depth is a distance to the profile, so a wall counts by how far the wheel was driven into it, not by its height. A patch next
//! to a deeper one counts by what it stands out above the saddle between them, and both share what is below
//! the saddle; so patches come and go with no weight. The floor and a step face, with air between them, count in full each.
//! Depth changes by 3 times the motion at most on ground of slopes up to 3, by 10 times at the edges of steeper
//! faces (the tests hold this), where a cubic over a quarter of the radius is not yet the ground. Where a deep contact
//! has two minima of nearly one depth, as soil has at an edge along the heading, its direction may turn at once by part of
//! their difference. Ground between discs (a third of the width) and features much narrower than the distance of posts
//! (a quarter of the radius) are met late. Where the hub itself is in the ground, it is one patch, as deep as the
//! radius, along the normal over the hub.

use linkwork_spatial::Vec3;

/// Discs across the width.
pub const DISCS: usize = 3;
/// Most patches of a disc.
pub const PATCHES: usize = 4;

/// A ground by height (m) and unit normal at x, y; `None` where there is none.
pub trait Ground: Fn(f64, f64) -> Option<(f64, Vec3)> {}
impl<T: Fn(f64, f64) -> Option<(f64, Vec3)>> Ground for T {}

/// Posts of the profile.
const POSTS: usize = 9;
/// Their places over the radius.
const PLACES: [f64; POSTS] = [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0];
/// √(1 − place²): height of the rim over the radius.
const RIM: [f64; POSTS] = [
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
/// Clearance within which ground is looked at closely, as a fraction of the radius.
const NEAR: f64 = 0.2;
/// Clearance below which a saddle parts two patches altogether, as a fraction of the radius.
const APART: f64 = 0.05;
/// Distance below which two posts are one, as a fraction of the radius.
const SAME: f64 = 1e-3;
/// Most local maxima of d that are followed, those without contact among them.
const PEAKS: usize = 6;
/// Posts with those at peaks.
const POSTS_MAX: usize = POSTS + 2 * PEAKS;
/// Errors of the profile, over the radius, at which a second round begins and counts in full.
const OFF: [f64; 2] = [4e-4, 4e-3];
/// Parts of a piece in which the sign of E is looked at.
const PARTS: usize = 4;
/// Slope that a piece may have at its end whatever its rise: more only in proportion to the rise.
const SLOPE_FREE: f64 = 1.0;
/// Least component of a ground normal in the disc's plane and up: walls have a slope of 50.
const UP_MIN: f64 = 0.02;

/// One patch of a disc against the ground; W frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Penetration along the normal, m; positive.
    pub depth: f64,
    /// Share with which it counts beside the other patches, 0 to 1.
    pub share: f64,
    /// Ground normal, unit.
    pub normal: Vec3,
    /// The rim point, m.
    pub point: Vec3,
}

/// Patches of one disc, from behind to ahead.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscContact {
    patches: [Patch; PATCHES],
    count: usize,
}

impl DiscContact {
    /// No contact.
    pub const NONE: DiscContact = DiscContact {
        patches: [Patch {
            depth: 0.0,
            share: 0.0,
            normal: Vec3::new(0.0, 0.0, 1.0),
            point: Vec3::new(0.0, 0.0, 0.0),
        }; PATCHES],
        count: 0,
    };

    /// The patches, in which the disc is in the ground.
    pub fn patches(&self) -> &[Patch] {
        &self.patches[..self.count]
    }

    /// Depth of all patches together, m: the size of the press; 0 without contact.
    pub fn depth(&self) -> f64 {
        self.press().norm()
    }

    /// Sum of depth times share times normal, m: what a linear spring would feel.
    pub fn press(&self) -> Vec3 {
        self.patches().iter().fold(Vec3::zeros(), |a, p| a + p.normal * (p.depth * p.share))
    }

    fn push(&mut self, patch: Patch) {
        if self.count < PATCHES {
            self.patches[self.count] = patch;
            self.count += 1;
        }
    }
}

/// A cylinder by radius and width, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Radius, m.
    pub radius: f64,
    /// Width along the axle, m.
    pub width: f64,
}

impl Cylinder {
    /// Contacts of the discs of a wheel at `centre` (m) with the unit `axle`, from right to left. `ground` gives
    /// height (m) and unit normal at x, y, or `None` off the map (nothing is touched there). Cost: nine ground queries a disc
    /// and one more for each patch that is in or near the ground.
    pub fn discs(&self, centre: Vec3, axle: Vec3, ground: &impl Ground) -> [DiscContact; DISCS] {
        let up = Vec3::z() - axle * axle.z;
        let length = up.norm();
        if length < 1e-3 {
            return [DiscContact::NONE; DISCS]; // the wheel lies on its side
        }
        let e2 = up / length;
        let e1 = axle.cross(&e2);
        // Discs at the middles of equal strips.
        std::array::from_fn(|i| {
            let across = (i as f64 - 0.5 * (DISCS - 1) as f64) * self.width / DISCS as f64;
            Disc { r: self.radius, c: centre + axle * across, e1, e2, axle }.contact(ground)
        })
    }
}

/// A disc in its plane.
struct Disc {
    r: f64,
    c: Vec3,
    e1: Vec3,
    e2: Vec3,
    axle: Vec3,
}

/// The profile of the ground at one place: s, ζ, dζ/ds, and the ground's slope along the axle.
#[derive(Clone, Copy)]
struct Post {
    s: f64,
    z: f64,
    slope: f64,
    side: f64,
}

const NO_POST: Post = Post { s: 0.0, z: 0.0, slope: 0.0, side: 0.0 };

/// The profile: posts by growing s.
struct Profile {
    posts: [Post; POSTS_MAX],
    count: usize,
}

/// A local maximum of d, with what it counts.
#[derive(Clone, Copy)]
struct Peak {
    at: Post,
    d: f64,
    share: f64,
    /// Least d between this and the next.
    saddle: f64,
}

/// Local maxima by growing s.
struct Peaks {
    peaks: [Peak; PEAKS],
    count: usize,
    /// Radius and clearance within which maxima are kept, m.
    r: f64,
    margin: f64,
}

impl Disc {
    fn contact(&self, ground: &impl Ground) -> DiscContact {
        let mut profile = Profile { posts: [NO_POST; POSTS_MAX], count: POSTS };
        let mut any = false;
        for (post, (place, rim)) in profile.posts.iter_mut().zip(PLACES.into_iter().zip(RIM)) {
            let (s, z) = (place * self.r, -rim * self.r);
            match self.post(s, z, ground) {
                Some(found) => {
                    *post = found;
                    any = true;
                }
                // The edge of the map is a cliff.
                None => *post = Post { s, z: -10.0 * self.r, slope: 0.0, side: 0.0 },
            }
        }
        let mut out = DiscContact::NONE;
        if !any {
            return out;
        }
        let middle = profile.posts[POSTS / 2];
        if middle.z > 0.0 {
            let up =
                (self.e2 - self.e1 * middle.slope) / (1.0 + middle.slope * middle.slope).sqrt();
            out.push(self.patch(up, &middle, self.r, 1.0));
            return out;
        }
        // A second round only where the first found the profile to be off.
        let mut urgency = 1.0;
        let mut pieces = 0..POSTS - 1;
        for _ in 0..2 {
            let rough = profile.peaks(pieces.clone(), self.r, NEAR * self.r);
            if rough.count == 0 {
                return out;
            }
            let (mut off, mut at) = (0.0_f64, 0);
            for p in rough.found() {
                // A peak that has only just come, or come near, does not change the profile at once.
                let weight = urgency * (2.0 * p.share * (p.d / (NEAR * self.r) + 1.0)).min(1.0);
                if let Some(exact) = self.post(p.at.s, p.at.z, ground) {
                    off = off.max(weight * (exact.z - p.at.z).abs());
                    at = profile.insert(&p.at, &exact, weight, SAME * self.r);
                }
            }
            // The pieces beside the only peak are all that has changed, and no other has one.
            pieces = match rough.count {
                1 => at.saturating_sub(1)..(at + 1).min(profile.count - 1),
                _ => 0..profile.count - 1,
            };
            urgency = ((off / self.r - OFF[0]) / (OFF[1] - OFF[0])).min(1.0);
            if urgency <= 0.0 {
                break;
            }
        }
        let peaks = profile.peaks(pieces, self.r, APART * self.r);
        for p in peaks.found() {
            if p.d > 0.0 {
                let inward =
                    -(self.e1 * p.at.s + self.e2 * p.at.z) / (self.r - p.d).max(1e-9 * self.r);
                out.push(self.patch(inward, &p.at, p.d, p.share));
            }
        }
        out
    }

    /// The ground of this plane near s, ζ.
    #[inline(always)]
    fn post(&self, s: f64, z: f64, ground: &impl Ground) -> Option<Post> {
        let q = self.c + self.e1 * s + self.e2 * z;
        let (h, n) = ground(q.x, q.y)?;
        let up = 1.0 / n.dot(&self.e2).max(UP_MIN);
        let (slope, side) = (-n.dot(&self.e1) * up, n.dot(&self.axle) * up);
        Some(Post { s, z: z + (h - q.z) * n.z * up, slope, side })
    }

    /// The patch that pushes along `inward` (unit, in the plane), `d` (m) deep.
    fn patch(&self, inward: Vec3, at: &Post, d: f64, share: f64) -> Patch {
        let side = at.side / (1.0 + at.slope * at.slope).sqrt();
        let cos = 1.0 / (1.0 + side * side).sqrt();
        Patch {
            depth: d * cos,
            share,
            normal: (inward + self.axle * side) * cos,
            point: self.c - inward * self.r,
        }
    }
}

impl Peaks {
    fn found(&self) -> &[Peak] {
        &self.peaks[..self.count]
    }

    /// A maximum at u of a piece; what is far from the ground, or ground seen from inside, is none.
    fn push(&mut self, piece: &Piece, u: f64) {
        let at = piece.at(u);
        let d = self.r - (at.s * at.s + at.z * at.z).sqrt();
        let faces = at.s * at.slope > at.z;
        if d > -self.margin && faces && self.count < PEAKS {
            self.peaks[self.count] = Peak { at, d, share: 1.0, saddle: f64::INFINITY };
            self.count += 1;
        }
    }

    /// The ground between the last maximum and the next falls to d.
    fn saddle(&mut self, d: f64) {
        if let Some(last) = self.count.checked_sub(1) {
            self.peaks[last].saddle = self.peaks[last].saddle.min(d);
        }
    }

    /// A part of a piece from (u, E) to (u, E): a maximum or a saddle where E changes its sign.
    #[inline(always)]
    fn step(&mut self, piece: &Piece, from: (f64, f64), to: (f64, f64)) {
        if (from.1 < 0.0) == (to.1 < 0.0) {
            return;
        }
        // Regula falsi, continuous in its data.
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

    /// Peaks joined by saddles, the highest first: each group keeps what stands out above the saddle, and what
    /// is below it is shared in proportion. The order of equal saddles does not matter.
    fn share(&mut self) {
        let (n, margin) = (self.count, self.margin);
        if n < 2 {
            return;
        }
        // Groups are runs of peaks; total of the group of each peak.
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
    /// A post between others, at the place of a peak: `weight` of the exact one, the rest what the profile had there. Gives its
    /// index, or that of a post already there.
    fn insert(&mut self, had: &Post, exact: &Post, weight: f64, same: f64) -> usize {
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

    /// The maxima of d above −margin on some pieces, with their shares.
    fn peaks(&self, pieces: std::ops::Range<usize>, r: f64, margin: f64) -> Peaks {
        let none = Peak { at: NO_POST, d: 0.0, share: 0.0, saddle: 0.0 };
        let mut out = Peaks { peaks: [none; PEAKS], count: 0, r, margin };
        // E at the end of the piece before; none after one that is skipped.
        let mut before = None;
        for k in pieces {
            let piece = Piece::of(&self.posts[k], &self.posts[k + 1]);
            if piece.below(r + out.margin) {
                before = None;
                out.saddle(f64::NEG_INFINITY);
                continue;
            }
            let mut from = (0.0, piece.error(0.0));
            if let Some(e) = before {
                // At a kink both sides have their own slope.
                out.step(&piece, (0.0, e), from);
            } else if k == 0 && from.1 > 0.0 {
                out.push(&piece, 0.0);
            }
            if piece.turns_once() {
                // At most one maximum: its quarter is found by halves.
                let to = (1.0, piece.error(1.0));
                if from.1 < 0.0 && to.1 >= 0.0 {
                    let (mut low, mut high) = (from, to);
                    for half in [0.5, 0.25] {
                        let middle = (low.0 + half, piece.error(low.0 + half));
                        if middle.1 < 0.0 { low = middle } else { high = middle }
                    }
                    out.step(&piece, low, high);
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
            before = Some(from.1);
            if k + 2 == self.count && from.1 < 0.0 {
                out.push(&piece, 1.0);
            }
        }
        out.share();
        out
    }
}

/// A cubic between two posts, u from 0 to 1.
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
        // Steeper ends than the rise has use for would make ground that is not there.
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

    /// Whether no point is within `reach` (m) of the centre: the control points are below that circle.
    #[inline(always)]
    fn below(&self, reach: f64) -> bool {
        let top = self.c[0].max(self.control[0]).max(self.control[1]).max(self.z_end);
        let end = self.s + self.length;
        let near = if self.s > 0.0 { self.s } else { (-end).max(0.0) };
        top < 0.0 && top * top + near * near > reach * reach
    }

    /// Whether E grows over the piece: E' = 1 + ζ'² + ζ ζ'' is positive.
    #[inline(always)]
    fn turns_once(&self) -> bool {
        let [c0, _, c2, c3] = self.c;
        let bend = (2.0 * c2).abs().max((2.0 * c2 + 6.0 * c3).abs());
        let ends = c0.abs().max(self.z_end.abs());
        let size = ends.max(self.control[0].abs()).max(self.control[1].abs());
        bend * size < self.length * self.length
    }

    /// E = s + ζ ζ'.
    #[inline(always)]
    fn error(&self, u: f64) -> f64 {
        let [c0, c1, c2, c3] = self.c;
        let z = c0 + u * (c1 + u * (c2 + u * c3));
        let slope = (c1 + u * (2.0 * c2 + u * 3.0 * c3)) * self.inverse;
        self.s + u * self.length + z * slope
    }

    fn at(&self, u: f64) -> Post {
        let [c0, c1, c2, c3] = self.c;
        Post {
            s: self.s + u * self.length,
            z: c0 + u * (c1 + u * (c2 + u * c3)),
            slope: (c1 + u * (2.0 * c2 + u * 3.0 * c3)) * self.inverse,
            side: self.side[0] + u * (self.side[1] - self.side[0]),
        }
    }
}

#[cfg(test)]
#[path = "wheel_geometry_tests.rs"]
mod tests;

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

use super::Relief;
use super::profile::{NO_POST, PLACES, POSTS, POSTS_MAX, Peaks, Post, Profile, RIM};
use linkwork_multibody::spatial::Vec3;

/// Discs across the width.
pub const DISCS: usize = 3;
/// Most patches of a disc.
pub const PATCHES: usize = 4;

/// Clearance within which ground is looked at closely, as a fraction of the radius.
const NEAR: f64 = 0.2;
/// Clearance below which a saddle parts two patches altogether, as a fraction of the radius.
const APART: f64 = 0.05;
/// Distance below which two posts are one, as a fraction of the radius.
const SAME: f64 = 1e-3;
/// Errors of the profile, over the radius, at which a second round begins and counts in full.
const OFF: [f64; 2] = [4e-4, 4e-3];
/// Least component of a ground normal in the disc's plane and up: walls have a slope of 50.
const UP_MIN: f64 = 0.02;

/// One patch of a disc against the ground; W frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Penetration along the normal, m; positive, but where a margin was asked for.
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

    /// The patches, in which the disc is in the ground, or within the margin.
    #[inline]
    pub fn patches(&self) -> &[Patch] {
        &self.patches[..self.count]
    }

    /// Depth of all patches together, m: the size of the press; 0 without contact.
    #[inline]
    pub fn depth(&self) -> f64 {
        self.press().norm()
    }

    /// Sum of depth times share times normal, m: what a linear spring would feel.
    #[inline]
    pub fn press(&self) -> Vec3 {
        self.patches().iter().fold(Vec3::zeros(), |a, p| a + p.normal * (p.depth * p.share))
    }

    /// With a patch more; one at the place of the last (nearer than `same`, m) is the same, found on both sides of a post, and each has its share.
    #[inline]
    fn add(&mut self, patch: Patch, same: f64) {
        match self.patches[..self.count].last_mut() {
            Some(last) if (last.point - patch.point).norm() < same => last.share += patch.share,
            _ => self.push(patch),
        }
    }

    #[inline]
    fn push(&mut self, patch: Patch) {
        if self.count < PATCHES {
            self.patches[self.count] = patch;
            self.count += 1;
        }
    }
}

/// A wheel by radius and width, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    /// Radius, m.
    pub radius: f64,
    /// Width along the axle, m.
    pub width: f64,
}

impl Wheel {
    /// Contacts of the discs of a wheel at `centre` (m) with the unit `axle`, from right to left. `ground` gives
    /// height (m) and unit normal at x, y, or `None` off the map (nothing is touched there). Cost: nine ground queries a disc
    /// and one more for each patch that is in or near the ground.
    pub fn discs(
        &self,
        centre: Vec3,
        axle: Vec3,
        ground: &(impl Relief + ?Sized),
    ) -> [DiscContact; DISCS] {
        let Some([e1, e2]) = in_plane(&axle) else { return [DiscContact::NONE; DISCS] };
        // Discs at the middles of equal strips.
        let discs: [Plane; DISCS] = std::array::from_fn(|i| {
            let across = (i as f64 - 0.5 * (DISCS - 1) as f64) * self.width / DISCS as f64;
            Plane { r: self.radius, c: centre + axle * across, e1, e2, axle, margin: 0.0 }
        });
        // The posts of all of them in one call.
        let (mut at, mut relief) = ([[0.0; 2]; DISCS * POSTS], [[0.0; 3]; DISCS * POSTS]);
        for (k, at) in at.iter_mut().enumerate() {
            let (disc, k) = (&discs[k / POSTS], k % POSTS);
            *at = disc.place(PLACES[k] * self.radius, -RIM[k] * self.radius);
        }
        ground.relief(&at, &mut relief);
        let mut profile = Profile { posts: [NO_POST; POSTS_MAX], count: POSTS };
        let mut peaks = Peaks::new(self.radius);
        let mut contacts = [DiscContact::NONE; DISCS];
        for ((disc, first), out) in discs.iter().zip(relief.chunks(POSTS)).zip(&mut contacts) {
            profile.count = POSTS;
            if disc.posts(&mut profile, first) {
                disc.contact(&mut profile, &mut peaks, ground, out);
            }
        }
        contacts
    }
}

/// Directions e₁ and e₂ in the plane across a unit `axle`; `None` where it is upright.
#[inline]
fn in_plane(axle: &Vec3) -> Option<[Vec3; 2]> {
    let up = Vec3::z() - axle * axle.z;
    let length = up.norm();
    let e2 = up / length;
    (length >= 1e-3).then(|| [axle.cross(&e2), e2])
}

/// One disc that meets the ground within a margin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Radius, m.
    pub radius: f64,
    /// Middle, m.
    pub centre: Vec3,
    /// Unit vector across it.
    pub axle: Vec3,
    /// Ground so near is told as a patch of negative depth, m; not negative.
    pub margin: f64,
}

impl Disc {
    /// Its patches; none where it lies on its side. Cost: nine ground queries, and one more for each patch in or near the ground.
    pub fn contact(&self, ground: &(impl Relief + ?Sized)) -> DiscContact {
        let mut contact = DiscContact::NONE;
        let Some([e1, e2]) = in_plane(&self.axle) else { return contact };
        let Disc { radius: r, centre: c, axle, margin } = *self;
        let plane = Plane { r, c, e1, e2, axle, margin };
        let (mut at, mut relief) = ([[0.0; 2]; POSTS], [[0.0; 3]; POSTS]);
        for (k, at) in at.iter_mut().enumerate() {
            *at = plane.place(PLACES[k] * r, -RIM[k] * r);
        }
        ground.relief(&at, &mut relief);
        let mut profile = Profile { posts: [NO_POST; POSTS_MAX], count: POSTS };
        if plane.posts(&mut profile, &relief) {
            plane.contact(&mut profile, &mut Peaks::new(r), ground, &mut contact);
        }
        contact
    }
}

/// A disc in its plane.
struct Plane {
    r: f64,
    c: Vec3,
    e1: Vec3,
    e2: Vec3,
    axle: Vec3,
    margin: f64,
}

impl Plane {
    /// Adds the patches to `out`. `profile`: that of the first posts; `rough` is work space.
    fn contact(
        &self,
        profile: &mut Profile,
        rough: &mut Peaks,
        ground: &(impl Relief + ?Sized),
        out: &mut DiscContact,
    ) {
        let middle = profile.posts[POSTS / 2];
        if middle.z > 0.0 {
            let up =
                (self.e2 - self.e1 * middle.slope) / (1.0 + middle.slope * middle.slope).sqrt();
            out.push(self.patch(up, &middle, self.r, 1.0));
            return;
        }
        // A second round only where the first found the profile to be off.
        let mut urgency = 1.0;
        let mut pieces = 0..POSTS - 1;
        let near = (NEAR * self.r).max(2.0 * self.margin);
        rough.margin = near;
        for round in 0..2 {
            rough.count = 0;
            if round == 0 {
                profile.first_peaks(rough);
            } else {
                profile.peaks(pieces.clone(), rough);
            }
            if rough.count == 0 {
                return;
            }
            let (mut off, mut at) = (0.0_f64, 0);
            for p in rough.found() {
                // A peak that has only just come, or come near, does not change the profile at once.
                let weight = urgency * (2.0 * p.share * (p.d / near + 1.0)).min(1.0);
                let mut relief = [[f64::NAN; 3]];
                ground.relief(&[self.place(p.at.s, p.at.z)], &mut relief);
                if let Some(exact) = self.post(p.at.s, p.at.z, &relief[0]) {
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
        (rough.count, rough.margin) = (0, (APART * self.r).max(self.margin));
        profile.peaks(pieces, rough);
        for p in rough.found() {
            if p.d > -self.margin {
                let inward =
                    -(self.e1 * p.at.s + self.e2 * p.at.z) / (self.r - p.d).max(1e-9 * self.r);
                out.add(self.patch(inward, &p.at, p.d, p.share), SAME * self.r);
            }
        }
    }

    /// The first posts, by the ground there; whether any has ground.
    #[inline]
    fn posts(&self, profile: &mut Profile, first: &[[f64; 3]]) -> bool {
        let mut usual = true;
        for (k, (post, [h, sx, sy])) in profile.posts.iter_mut().zip(first).enumerate() {
            let along = |v: &Vec3| v.z - sx * v.x - sy * v.y;
            let (s, z, up) = (PLACES[k] * self.r, -RIM[k] * self.r, along(&self.e2));
            usual &= (up > 0.0) & (up * up >= UP_MIN * UP_MIN * (1.0 + sx * sx + sy * sy));
            usual &= !h.is_nan();
            let over = 1.0 / up;
            let rise = (h - (self.c.z + self.e1.z * s + self.e2.z * z)) * over;
            let (slope, side) = (-along(&self.e1) * over, along(&self.axle) * over);
            *post = Post { s, z: z + rise, slope, side };
        }
        if usual {
            return true;
        }
        let mut any = false;
        for (k, (post, relief)) in profile.posts.iter_mut().zip(first).enumerate() {
            let (s, z) = (PLACES[k] * self.r, -RIM[k] * self.r);
            match self.post(s, z, relief) {
                Some(found) => {
                    *post = found;
                    any = true;
                }
                // The edge of the map is a cliff.
                None => *post = Post { s, z: -10.0 * self.r, slope: 0.0, side: 0.0 },
            }
        }
        any
    }

    /// x, y under s, ζ.
    #[inline(always)]
    fn place(&self, s: f64, z: f64) -> [f64; 2] {
        [self.c.x + self.e1.x * s + self.e2.x * z, self.c.y + self.e1.y * s + self.e2.y * z]
    }

    /// The ground of this plane near s, ζ, by height and slopes at x, y there.
    #[inline(always)]
    fn post(&self, s: f64, z: f64, [h, sx, sy]: &[f64; 3]) -> Option<Post> {
        if h.is_nan() {
            return None;
        }
        // n (−h_x, −h_y, 1) with the length of the last.
        let n = Vec3::new(-sx, -sy, 1.0);
        let (up, size) = (n.dot(&self.e2), n.norm_squared());
        let steep = up < 0.0 || up * up < UP_MIN * UP_MIN * size;
        let up = 1.0 / if steep { UP_MIN * size.sqrt() } else { up };
        let (slope, side) = (-n.dot(&self.e1) * up, n.dot(&self.axle) * up);
        let q = self.c.z + self.e1.z * s + self.e2.z * z;
        Some(Post { s, z: z + (h - q) * up, slope, side })
    }

    /// The patch that pushes along `inward` (unit, in the plane), `d` (m) deep.
    #[inline]
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

#[cfg(test)]
#[path = "tests.rs"]
mod tests;

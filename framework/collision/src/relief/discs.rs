//! Contact of a wheel with a height field: patches on the rims of a few discs across its width.
//! ```text
//! profile     ζ(s): the ground in the plane of a disc, s along e₁, ζ along e₂, from the disc's centre
//!             e₂: W's z made perpendicular to the axle;  e₁ = axle × e₂
//! distance    D² = s² + ζ²,  d = r − D;   patches: local maxima of d, E = s + ζ ζ' = 0 from − to +
//! depth       δ = d cos λ,  normal  n = −cos λ (s e₁ + ζ e₂)/D + axle sin λ
//! ```
//! λ is the slope of the ground across the disc. The profile consists of cubics through the heights and slopes of nine posts over the whole diameter
//! and one additional post at each patch. A piece whose control points lie below the rim is skipped; the others are searched with a fixed sequence of
//! operations. No state is carried from step to step.
//!
//! Depth is the distance to the profile, so a wall contributes the penetration of the wheel, not its own height. A patch next to a deeper
//! one contributes by its height above the saddle between them, and both share what is below the saddle. Patches therefore appear and disappear with
//! zero weight. A floor and the face of a step, with air between them, both contribute fully. Depth changes by at most 3 times the motion on ground
//! with slopes up to 3, and by at most 10 times at the edges of steeper faces (tests verify this), where a cubic over a quarter of the radius does
//! not yet follow the ground. Where a deep contact has two minima of nearly equal depth, as soil has at an edge along the heading, its direction may
//! jump by a part of their difference. Ground between discs (a third of the width), and features much narrower than the post spacing (a quarter of
//! the radius), are detected late. If the hub itself is in the ground, there is one patch, as deep as the radius, along the normal over the hub.
//! radius, along the normal over the hub.

use super::Relief;
use super::profile::{NO_POST, PLACES, POSTS, POSTS_MAX, Peaks, Post, Profile, RIM};
use linkwork_multibody::spatial::Vec3;

/// Number of discs across the width.
pub const DISCS: usize = 3;
/// Maximum number of patches of a disc.
pub const PATCHES: usize = 4;

/// Clearance within which the ground is evaluated in detail, as a fraction of the radius.
const NEAR: f64 = 0.2;
/// Clearance below which a saddle separates two patches completely, as a fraction of the radius.
const APART: f64 = 0.05;
/// Distance below which two posts are merged, as a fraction of the radius.
const SAME: f64 = 1e-3;
/// Errors of the profile, relative to the radius, at which a second round begins and at which it has full weight.
const OFF: [f64; 2] = [4e-4, 4e-3];
/// Smallest component of a ground normal in the disc's plane and upwards: walls have a slope of 50.
const UP_MIN: f64 = 0.02;

/// One contact patch of a disc with the ground; W frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// Penetration along the normal, m; positive, unless a margin was given.
    pub depth: f64,
    /// Weight of the patch among the other patches, 0 to 1.
    pub share: f64,
    /// Unit normal of the ground.
    pub normal: Vec3,
    /// The rim point, m.
    pub point: Vec3,
}

/// Patches of one disc, from rear to front.
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

    /// Returns the patches in which the disc is in the ground or within the margin.
    #[inline]
    pub fn patches(&self) -> &[Patch] {
        &self.patches[..self.count]
    }

    /// Returns the resultant depth of all patches, m: the length of [`press`](Self::press); 0 without contact.
    #[inline]
    pub fn depth(&self) -> f64 {
        self.press().norm()
    }

    /// Returns the sum of depth times weight times normal, m, which is proportional to the force of a linear spring.
    #[inline]
    pub fn press(&self) -> Vec3 {
        self.patches().iter().fold(Vec3::zeros(), |a, p| a + p.normal * (p.depth * p.share))
    }

    /// Adds a patch. A patch within `same` (m) of the last one was found on both sides of a post; the two are merged and their weights added.
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

/// A wheel with its radius and width, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wheel {
    /// Radius, m.
    pub radius: f64,
    /// Width along the axle, m.
    pub width: f64,
}

impl Wheel {
    /// Computes the contacts of the discs of a wheel at `centre` (m) with the unit `axle`, from right to left. `ground` returns height (m) and unit
    /// normal at x, y, or `None` outside the map (no contact there). Cost: nine ground queries per disc, and one more for each patch that is in or
    /// near the ground.
    pub fn discs(
        &self,
        centre: Vec3,
        axle: Vec3,
        ground: &(impl Relief + ?Sized),
    ) -> [DiscContact; DISCS] {
        let Some([e1, e2]) = in_plane(&axle) else { return [DiscContact::NONE; DISCS] };
        // Place the discs at the centres of equal strips.
        let discs: [Plane; DISCS] = std::array::from_fn(|i| {
            let across = (i as f64 - 0.5 * (DISCS - 1) as f64) * self.width / DISCS as f64;
            Plane { r: self.radius, c: centre + axle * across, e1, e2, axle, margin: 0.0 }
        });
        // Evaluate the posts of all discs in one call.
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

/// Returns the directions e₁ and e₂ in the plane perpendicular to a unit `axle`; `None` if it is vertical.
#[inline]
fn in_plane(axle: &Vec3) -> Option<[Vec3; 2]> {
    let up = Vec3::z() - axle * axle.z;
    let length = up.norm();
    let e2 = up / length;
    (length >= 1e-3).then(|| [axle.cross(&e2), e2])
}

/// One disc that detects the ground within a margin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    /// Radius, m.
    pub radius: f64,
    /// Centre, m.
    pub centre: Vec3,
    /// Unit normal of the disc.
    pub axle: Vec3,
    /// Distance up to which ground is reported as a patch of negative depth, m; not negative.
    pub margin: f64,
}

impl Disc {
    /// Computes its patches; none if it lies on its side. Cost: nine ground queries, and one more for each patch in or near the ground.
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
    /// Adds the patches to `out`. `profile` contains the first posts; `rough` is work memory.
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
        // Do a second round only where the first found the profile to be inaccurate.
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
                // A new or barely near peak has a small weight, so that the profile changes continuously.
                let weight = urgency * (2.0 * p.share * (p.d / near + 1.0)).min(1.0);
                let mut relief = [[f64::NAN; 3]];
                ground.relief(&[self.place(p.at.s, p.at.z)], &mut relief);
                if let Some(exact) = self.post(p.at.s, p.at.z, &relief[0]) {
                    off = off.max(weight * (exact.z - p.at.z).abs());
                    at = profile.insert(&p.at, &exact, weight, SAME * self.r);
                }
            }
            // Only the pieces next to the only peak have changed, and no other piece has a peak.
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

    /// Computes the first posts from the ground there. Returns whether any of them has ground.
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
                // Beyond the edge of the map the ground drops like a cliff.
                None => *post = Post { s, z: -10.0 * self.r, slope: 0.0, side: 0.0 },
            }
        }
        any
    }

    /// Returns x, y below s, ζ.
    #[inline(always)]
    fn place(&self, s: f64, z: f64) -> [f64; 2] {
        [self.c.x + self.e1.x * s + self.e2.x * z, self.c.y + self.e1.y * s + self.e2.y * z]
    }

    /// Returns the ground in this plane near s, ζ from the height and slopes at x, y there.
    #[inline(always)]
    fn post(&self, s: f64, z: f64, [h, sx, sy]: &[f64; 3]) -> Option<Post> {
        if h.is_nan() {
            return None;
        }
        // n is (−h_x, −h_y, 1) with the length of the last component.
        let n = Vec3::new(-sx, -sy, 1.0);
        let (up, size) = (n.dot(&self.e2), n.norm_squared());
        let steep = up < 0.0 || up * up < UP_MIN * UP_MIN * size;
        let up = 1.0 / if steep { UP_MIN * size.sqrt() } else { up };
        let (slope, side) = (-n.dot(&self.e1) * up, n.dot(&self.axle) * up);
        let q = self.c.z + self.e1.z * s + self.e2.z * z;
        Some(Post { s, z: z + (h - q) * up, slope, side })
    }

    /// Returns the patch with the direction `inward` (unit vector in the plane) and the depth `d` (m).
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

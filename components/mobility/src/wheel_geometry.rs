//! Where a wheel touches a height field: the deepest rim points of a few discs across its width.
//! ```text
//! rim point   q(t) = c + r (e₁ t − e₂)/√(1 + t²)     t: tangent of the rim angle; c: centre of the disc, W
//! e₂: W's z made perpendicular to the axle;  e₁ = axle × e₂
//! depth       g(t) = (h(q) − q_z) n_z(q)
//! error       e(t) = −n·e₁/n·e₂ − t                 positive where g grows with t
//! ```
//! Coarse: nine rim points 15° apart, none missed that is wider than the grid of a typical map. Where e falls
//! through zero between two of them there is a deepest point; two secant steps find it (the first is
//! exact on a plane). Where a wheel bridges a gap or meets a rock there are several: they are blended
//! by depth into one contact whose normal is between theirs. A deepest point counts by how far it stands out above
//! the saddle next to it, so none comes or goes at once, and depth, point and normal are continuous in the
//! pose. Cost: 11 ground queries a disc, 2 more for each further deepest point.

use linkwork_spatial::Vec3;

/// Discs across the width.
pub const DISCS: usize = 3;

/// Rim points of the coarse search.
const COARSE: usize = 9;
/// Tangent and cosine of the rim angles of the coarse search, −60° to 60°.
const RIM: [(f64, f64); COARSE] = [
    (-1.732_050_807_568_877_2, 0.5),
    (-1.0, std::f64::consts::FRAC_1_SQRT_2),
    (-0.577_350_269_189_625_8, 0.866_025_403_784_438_6),
    (-0.267_949_192_431_122_7, 0.965_925_826_289_068_3),
    (0.0, 1.0),
    (0.267_949_192_431_122_7, 0.965_925_826_289_068_3),
    (0.577_350_269_189_625_8, 0.866_025_403_784_438_6),
    (1.0, std::f64::consts::FRAC_1_SQRT_2),
    (1.732_050_807_568_877_2, 0.5),
];
/// Difference of depth over which two deepest points share the contact, as a fraction of the radius.
const SOFTNESS: f64 = 0.015;
/// Height above the saddle at which a deepest point counts in full, as a fraction of the radius.
const PROMINENCE: f64 = 0.01;
/// Steepest ground that the search follows, as the tangent of the rim angle.
const TANGENT_MAX: f64 = 4.0;

/// One disc against the ground; W frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscContact {
    /// Penetration of the deepest rim point along the ground normal, m (negative: clearance).
    pub depth: f64,
    /// Ground normal there, unit, upwards.
    pub normal: Vec3,
    /// The deepest rim point, m.
    pub point: Vec3,
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
    /// Contacts of the discs of a wheel at `centre` (m) with the unit `axle`. `ground` gives height
    /// (m) and unit normal at x, y, or `None` off the map (a disc there has no contact).
    pub fn discs(
        &self,
        centre: Vec3,
        axle: Vec3,
        ground: &impl Fn(f64, f64) -> Option<(f64, Vec3)>,
    ) -> [Option<DiscContact>; DISCS] {
        // Discs at the middles of three equal strips.
        [-1.0, 0.0, 1.0].map(|i| self.disc(centre + axle * (i * self.width / 3.0), axle, ground))
    }

    fn disc(
        &self,
        c: Vec3,
        axle: Vec3,
        ground: &impl Fn(f64, f64) -> Option<(f64, Vec3)>,
    ) -> Option<DiscContact> {
        let r = self.radius;
        let up = Vec3::z() - axle * axle.z;
        let length = up.norm();
        if length < 1e-3 {
            return None; // the wheel lies on its side
        }
        let e2 = up / length;
        let e1 = axle.cross(&e2);
        // Angles are carried as their tangents: no trigonometry.
        let touch = |t: f64, cos: f64| {
            let q = c + (e1 * t - e2) * (r * cos);
            let (h, n) = ground(q.x, q.y)?;
            let best = -n.dot(&e1) / n.dot(&e2).max(1e-3);
            let error = best.clamp(-TANGENT_MAX, TANGENT_MAX) - t;
            Some(Touch { depth: (h - q.z) * n.z, error, normal: n, point: q })
        };
        let bottom = touch(0.0, 1.0)?;
        // Far above: the ground cannot rise to it.
        if bottom.depth < -r {
            return Some(bottom.contact());
        }
        let mut coarse = [(-r, 0.0); COARSE];
        for (k, (found, (t, cos))) in coarse.iter_mut().zip(RIM).enumerate() {
            if k == COARSE / 2 {
                *found = (bottom.depth, bottom.error);
            } else if let Some(p) = touch(t, cos) {
                *found = (p.depth, p.error);
            }
        }
        let peaks = Peaks::of(&coarse);
        let mut found = [None; PEAKS];
        for (found, (k, share)) in found.iter_mut().zip(peaks.shares(&coarse, r)) {
            if share > 0.0 {
                *found = refine(&coarse, k, &touch).map(|touch| (touch, share));
            }
        }
        Some(blend(&found, SOFTNESS * r).unwrap_or_else(|| bottom.contact()))
    }
}

/// A rim point against the ground.
#[derive(Clone, Copy)]
struct Touch {
    depth: f64,
    /// Tangent that the normal asks for, less its own.
    error: f64,
    normal: Vec3,
    point: Vec3,
}

impl Touch {
    fn contact(&self) -> DiscContact {
        DiscContact { depth: self.depth, normal: self.normal, point: self.point }
    }
}

/// Depth and error of the coarse rim points.
type Coarse = [(f64, f64); COARSE];
/// Most deepest points: the error changes its sign at most this often among so few points.
const PEAKS: usize = COARSE / 2 + 1;

/// Where the error falls through zero: between the coarse points k − 1 and k.
struct Peaks {
    at: [usize; PEAKS],
    count: usize,
}

/// Tangent and error of the coarse point before k and of the one at k; the ends reach to TANGENT_MAX.
fn bracket(coarse: &Coarse, k: usize) -> [(f64, f64); 2] {
    let low = if k == 0 { (-TANGENT_MAX, 1.0) } else { (RIM[k - 1].0, coarse[k - 1].1) };
    let high = if k == COARSE { (TANGENT_MAX, -1.0) } else { (RIM[k].0, coarse[k].1) };
    [low, high]
}

impl Peaks {
    fn of(coarse: &Coarse) -> Peaks {
        let mut peaks = Peaks { at: [0; PEAKS], count: 0 };
        for k in 0..=COARSE {
            let [low, high] = bracket(coarse, k);
            if low.1 > 0.0 && high.1 <= 0.0 && peaks.count < PEAKS {
                peaks.at[peaks.count] = k;
                peaks.count += 1;
            }
        }
        peaks
    }

    /// How much each counts: by its height over the saddle to another, and not when it is far less deep.
    fn shares(&self, coarse: &Coarse, r: f64) -> [(usize, f64); PEAKS] {
        let mut out = [(0, 0.0); PEAKS];
        let at = &self.at[..self.count];
        let depth = |k: usize| coarse[k.saturating_sub(1)].0.max(coarse[k.min(COARSE - 1)].0);
        let deepest = at.iter().fold(f64::NEG_INFINITY, |a, &k| a.max(depth(k)));
        for (out, &k) in out.iter_mut().zip(at) {
            let mut saddle = f64::NEG_INFINITY;
            for &other in at.iter().filter(|&&o| o != k) {
                let between = &coarse[k.min(other)..k.max(other)];
                let low = between.iter().fold(f64::INFINITY, |a, b| a.min(b.0));
                saddle = saddle.max(low);
            }
            let stands_out = ((depth(k) - saddle) / (PROMINENCE * r)).clamp(1e-9, 1.0);
            let near = 1.0 - (deepest - depth(k)) / (8.0 * SOFTNESS * r);
            *out = (k, if self.count == 1 { 1.0 } else { stands_out * near.max(0.0) });
        }
        out
    }
}

/// Two secant steps to where the error is zero.
#[inline(always)]
fn refine(coarse: &Coarse, k: usize, touch: &impl Fn(f64, f64) -> Option<Touch>) -> Option<Touch> {
    let between =
        |[low, high]: [(f64, f64); 2]| low.0 + (high.0 - low.0) * (low.1 / (low.1 - high.1));
    let at = |t: f64| touch(t, 1.0 / (1.0 + t * t).sqrt());
    let [low, high] = bracket(coarse, k);
    let t = between([low, high]);
    let first = (t, at(t)?.error);
    at(between(if first.1 > 0.0 { [first, high] } else { [low, first] }))
}

/// One contact from the deepest points, by depth and share.
fn blend(found: &[Option<(Touch, f64)>], softness: f64) -> Option<DiscContact> {
    let deepest = found.iter().flatten().map(|f| f.0.depth).fold(f64::NEG_INFINITY, f64::max);
    let mut sum = DiscContact { depth: 0.0, normal: Vec3::zeros(), point: Vec3::zeros() };
    let mut total = 0.0;
    for (touch, share) in found.iter().flatten() {
        let x = (touch.depth - deepest) / softness;
        let w = share / ((1.0 + x * x) * (1.0 + x * x));
        sum.depth += w * touch.depth;
        sum.normal += touch.normal * w;
        sum.point += touch.point * w;
        total += w;
    }
    if total <= 0.0 {
        return None;
    }
    let normal = sum.normal.normalize();
    Some(DiscContact { depth: sum.depth / total, normal, point: sum.point / total })
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHEEL: Cylinder = Cylinder { radius: 0.25, width: 0.4 };

    fn unit(x: f64, y: f64, z: f64) -> Vec3 {
        Vec3::new(x, y, z).normalize()
    }

    #[test]
    fn plane_is_exact_at_any_attitude() {
        let n = unit(0.2, -0.1, 1.0);
        let plane = |x: f64, y: f64| Some((-(n.x * x + n.y * y) / n.z, n));
        for yaw in [0.0, 0.7, 2.0] {
            for roll in [0.0, 0.1, -0.3] {
                let axle = unit(-f64::sin(yaw), f64::cos(yaw), roll);
                let down = -(n - axle * n.dot(&axle)).normalize();
                let centre = Vec3::new(0.3, 0.1, 0.2);
                for (disc, i) in WHEEL.discs(centre, axle, &plane).iter().zip([-1.0, 0.0, 1.0]) {
                    let point = centre + axle * (i * 0.4 / 3.0) + down * 0.25;
                    let d = disc.unwrap();
                    assert!((d.depth + n.dot(&point)).abs() < 1e-12, "{d:?}");
                    assert!((d.point - point).norm() < 1e-9, "{d:?} {point}");
                }
            }
        }
    }

    #[test]
    fn ball_and_bowl_are_close_to_the_closed_form() {
        // A wheel in the plane y = 0 on the top or side of a cylinder across its path.
        for (radius, sign) in [(0.3, 1.0), (0.15, 1.0), (2.0, -1.0), (0.6, -1.0)] {
            let ground = |x: f64, _: f64| {
                let rest = radius * radius - x * x;
                if rest <= 0.0 {
                    return Some((0.0, Vec3::z()));
                }
                let z = sign * rest.sqrt();
                Some((z, Vec3::new(x, 0.0, z) / radius * sign))
            };
            for angle in [-0.5, -0.2, 0.0, 0.3_f64] {
                let reach = if sign > 0.0 { radius + 0.249 } else { -(radius - 0.249) };
                let centre = Vec3::new(reach * angle.sin(), 0.0, reach * angle.cos());
                let d = WHEEL.discs(centre, Vec3::y(), &ground)[1].unwrap();
                // Depth along the normal is 1 mm; the vertical measure agrees to second order.
                assert!((d.depth - 0.001).abs() < 4e-4, "R {radius} {sign} at {angle}: {d:?}");
            }
        }
    }

    #[test]
    fn contact_moves_continuously_over_a_bumpy_ground() {
        let ground = |x: f64, y: f64| {
            let h = 0.08 * (5.0 * x).sin() * (4.0 * y).cos() + 0.03 * (13.0 * x + 1.0).sin();
            let hx = 0.4 * (5.0 * x).cos() * (4.0 * y).cos() + 0.39 * (13.0 * x + 1.0).cos();
            let hy = -0.32 * (5.0 * x).sin() * (4.0 * y).sin();
            Some((h, Vec3::new(-hx, -hy, 1.0).normalize()))
        };
        let mut last: Option<[Option<DiscContact>; DISCS]> = None;
        for i in 0..40_000 {
            let x = 5e-5 * f64::from(i);
            let now = WHEEL.discs(Vec3::new(x, 0.2, 0.26), unit(0.05, 1.0, 0.05), &ground);
            if let Some(last) = last {
                for (a, b) in now.iter().zip(last) {
                    let (a, b) = (a.unwrap(), b.unwrap());
                    if a.depth < -0.02 {
                        continue;
                    }
                    assert!((a.depth - b.depth).abs() < 2e-4, "depth jumps at {x}: {a:?} {b:?}");
                    assert!((a.point - b.point).norm() < 0.02, "point jumps at {x}: {a:?} {b:?}");
                }
            }
            last = Some(now);
        }
    }

    #[test]
    fn depth_is_that_of_an_exhaustive_search() {
        let ground = |x: f64, y: f64| {
            let h = 0.08 * (3.0 * x).sin() * (4.0 * y).cos() + 0.01 * (9.0 * x + 1.0).sin();
            let hx = 0.24 * (3.0 * x).cos() * (4.0 * y).cos() + 0.09 * (9.0 * x + 1.0).cos();
            let hy = -0.32 * (3.0 * x).sin() * (4.0 * y).sin();
            Some((h, Vec3::new(-hx, -hy, 1.0).normalize()))
        };
        let mut worst = 0.0_f64;
        for i in 0..400 {
            let c = Vec3::new(0.01 * f64::from(i), 0.2, 0.3);
            let d = WHEEL.discs(c, Vec3::y(), &ground)[1].unwrap();
            let brute = (-900..900)
                .map(|k| {
                    let (sin, cos) = (1e-3 * f64::from(k)).sin_cos();
                    let q = c + Vec3::new(sin, 0.0, -cos) * 0.25;
                    let (h, n) = ground(q.x, q.y).unwrap();
                    (h - q.z) * n.z
                })
                .fold(f64::NEG_INFINITY, f64::max);
            worst = worst.max((brute - d.depth).abs() / (1.0 + 100.0 * d.depth.abs()));
        }
        println!("worst difference {worst}");
        assert!(worst < 2e-3);
    }

    #[test]
    fn off_the_map_there_is_no_contact() {
        let discs = WHEEL.discs(Vec3::zeros(), Vec3::y(), &|_, _| None);
        assert!(discs.iter().all(Option::is_none));
    }
}

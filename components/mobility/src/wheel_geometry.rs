//! Where a wheel touches a height field: the deepest rim point of a few discs across its width.
//! ```text
//! rim point   q(φ) = c + r (e₁ sin φ − e₂ cos φ)          c: centre of the disc in W
//! e₂: the normal n of the ground under c, made perpendicular to the axle;  e₁ = axle × e₂
//! depth       g(φ) = (h(q) − q_z) n_z(q)
//! ```
//! Coarse: rim angles 22.5° apart; a soft maximum gives a start that is continuous in the pose. Fine:
//! at the deepest point the ground normal, projected into the disc, points along −(q − c), so
//! `t ← t + e(t)` with t = tan φ and e the difference of the two; the second step is a secant step, which also
//! converges on ground that curves more than the wheel (rocks). Every map is continuous, so the contact
//! does not jump where two rim points are equally deep. Cost: 9 ground queries a disc.

use linkwork_spatial::Vec3;

/// Discs across the width.
pub const DISCS: usize = 3;

/// Coarse search: tangent, sine and cosine of the rim angles −45°, −22.5°, 0, 22.5°, 45°.
const COARSE: [(f64, f64, f64); 5] = [
    (-1.0, -std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2),
    (-0.414_213_562_373_095, -0.382_683_432_365_09, 0.923_879_532_511_287),
    (0.0, 0.0, 1.0),
    (0.414_213_562_373_095, 0.382_683_432_365_09, 0.923_879_532_511_287),
    (1.0, std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2),
];
/// Depths (as a fraction of the radius) that the coarse search regards as equal.
const SOFTNESS: f64 = 0.015;
/// Steepest ground that the search follows, as the tangent of the angle to the disc's bottom.
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
        let (h, n) = ground(c.x, c.y)?;
        // Far above: the ground cannot rise to it.
        if (c.z - h) * n.z > 2.0 * r {
            return Some(DiscContact { depth: -(c.z - h) * n.z + r, normal: n, point: c - n * r });
        }
        let up = n - axle * n.dot(&axle);
        let length = up.norm();
        if length < 1e-3 {
            return None; // the wheel lies on its side
        }
        let e2 = up / length;
        let e1 = axle.cross(&e2);
        // Angles are carried as their tangents: no trigonometry.
        let rim = |t: f64| c + (e1 * t - e2) * (r / (1.0 + t * t).sqrt());
        let mut depths = [0.0; COARSE.len()];
        for (d, (_, sin, cos)) in depths.iter_mut().zip(COARSE) {
            let q = c + (e1 * sin - e2 * cos) * r;
            *d = match ground(q.x, q.y) {
                Some((h, n)) => (h - q.z) * n.z,
                None => -r,
            };
        }
        let deepest = depths.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
        let (mut sum, mut mean) = (0.0, 0.0);
        for (d, (t, ..)) in depths.iter().zip(COARSE) {
            let x = (d - deepest) / (SOFTNESS * r);
            let w = 1.0 / (1.0 + x * x);
            sum += w * w;
            mean += w * w * t;
        }
        let start = mean / sum;
        let error = |t: f64| {
            let q = rim(t);
            let (_, n) = ground(q.x, q.y)?;
            // −n in the disc is along (e₁ t* − e₂) for the best tangent t*.
            let best = -n.dot(&e1) / n.dot(&e2).max(1e-3);
            Some(best.clamp(-TANGENT_MAX, TANGENT_MAX) - t)
        };
        let e0 = error(start)?;
        let e1_ = error(start + e0)?;
        // Secant on e: exact for constant curvature; bounded so that it stays continuous.
        let stretch = if (e0 - e1_).abs() > 1e-12 { e0 / (e0 - e1_) } else { 1.0 };
        let t = start + e0 * if stretch > 0.0 { stretch.clamp(0.2, 2.0) } else { 2.0 };
        let q = rim(t);
        let (h, n) = ground(q.x, q.y)?;
        Some(DiscContact { depth: (h - q.z) * n.z, normal: n, point: q })
    }
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

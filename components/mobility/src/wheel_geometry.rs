//! Where a wheel touches a height field: the deepest rim point of a few discs across its width.
//! ```text
//! rim point   q(φ) = c + r (e₁ sin φ − e₂ cos φ)          c: centre of the disc in W
//! e₂: the normal n of the ground under c, made perpendicular to the axle;  e₁ = axle × e₂
//! depth       g(φ) = (h(q) − q_z) n_z(q)
//! ```
//! Coarse: rim angles 22.5° apart; their softmax gives a start that is continuous in the pose. Fine:
//! at the deepest point the ground normal, projected into the disc, points along −(q − c), so
//! `φ ← φ + e(φ)` with `e` the angle between the two; the second step is a secant step, which also
//! converges on ground that curves more than the wheel (rocks). Every map is continuous, so the contact
//! does not jump where two rim points are equally deep. Cost: 9 ground queries a disc.

use crate::math::Vec3;

/// Discs across the width.
pub const DISCS: usize = 3;

/// Rim angles of the coarse search, rad.
const COARSE: [f64; 5] = [-0.785_398, -0.392_699, 0.0, 0.392_699, 0.785_398];
/// Depths (as a fraction of the radius) that the coarse search regards as equal.
const SOFTNESS: f64 = 0.015;

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
        let rim = |phi: f64| {
            let (sin, cos) = phi.sin_cos();
            c + (e1 * sin - e2 * cos) * r
        };
        let mut depths = [0.0; COARSE.len()];
        for (d, phi) in depths.iter_mut().zip(COARSE) {
            let q = rim(phi);
            *d = match ground(q.x, q.y) {
                Some((h, n)) => (h - q.z) * n.z,
                None => -r,
            };
        }
        let deepest = depths.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
        let (mut sum, mut mean) = (0.0, 0.0);
        for (d, phi) in depths.iter().zip(COARSE) {
            let w = ((d - deepest) / (SOFTNESS * r)).exp();
            sum += w;
            mean += w * phi;
        }
        let start = mean / sum;
        let error = |phi: f64| {
            let q = rim(phi);
            let (_, n) = ground(q.x, q.y)?;
            // −n in the disc is (e₁ sin φ* − e₂ cos φ*) at the best angle φ*.
            Some((-n.dot(&e1)).atan2(n.dot(&e2)) - phi)
        };
        let e0 = error(start)?;
        let e1_ = error(start + e0)?;
        // Secant on e: exact for constant curvature; bounded so that it stays continuous.
        let stretch = if (e0 - e1_).abs() > 1e-12 { e0 / (e0 - e1_) } else { 1.0 };
        let phi = start + e0 * if stretch > 0.0 { stretch.clamp(0.2, 2.0) } else { 2.0 };
        let q = rim(phi);
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
                assert!((d.depth - 0.001).abs() < 2e-4, "R {radius} {sign} at {angle}: {d:?}");
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
                    assert!((a.depth - b.depth).abs() < 2e-4, "depth jumps at {x}: {a:?} {b:?}");
                    assert!((a.point - b.point).norm() < 0.02, "point jumps at {x}: {a:?} {b:?}");
                }
            }
            last = Some(now);
        }
    }

    #[test]
    fn off_the_map_there_is_no_contact() {
        let discs = WHEEL.discs(Vec3::zeros(), Vec3::y(), &|_, _| None);
        assert!(discs.iter().all(Option::is_none));
    }
}

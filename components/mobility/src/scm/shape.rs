//! Shapes on deformable ground: height of the lower side of a rim or a flat sole above a point of the plane, in closed form.
//! ```text
//! rim    |d − a (a·d)|² = r²,  d = (x, y, z) − c:   z² (1 − a_z²) − 2 m a_z z + D² − m² − r² = 0,  m = a·D
//! sole   (p − c)·n = 0
//! share  how much of a cell the width, or the edge of a sole, covers: a ramp over one cell
//! ```

use crate::rigid_contact::Hub;
use linkwork_spatial::Vec3;

/// Form and size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Form {
    /// Rim of a wheel with radius and width, m; its axle is that of the hub.
    Rim {
        /// Radius, m.
        radius: f64,
        /// Width along the axle, m.
        width: f64,
    },
    /// Flat round sole with this radius, m; its normal is the axle of the hub.
    Disc {
        /// Radius, m.
        radius: f64,
    },
    /// Flat rectangular sole with its length along the heading of the hub and its width, m; its normal is the axle of the hub.
    Plate {
        /// Length along the heading, m.
        length: f64,
        /// Width across, m.
        width: f64,
    },
}

/// A body above the ground: its shape, pose and motion. The axle of the hub of a sole is its upward normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Presser {
    /// Form and size.
    pub form: Form,
    /// Pose and motion.
    pub hub: Hub,
    /// Unit vector along the length of a rectangular sole, W; `None` for other shapes.
    pub along: Vec3,
}

/// The lower side above a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Under {
    /// Height, m, W.
    pub z: f64,
    /// Unit normal towards the body, W.
    pub normal: Vec3,
    /// Covered fraction of a cell.
    pub share: f64,
}

/// Least vertical component of a unit normal towards the body; steeper faces exert no pressure.
const DOWN_MIN: f64 = 0.1;

impl Presser {
    /// Returns the shorter side of the contact face, m: b of Bekker's k_c/b.
    pub fn narrow(&self) -> f64 {
        match self.form {
            Form::Rim { width, .. } => width,
            Form::Disc { radius } => radius,
            Form::Plate { length, width } => length.min(width),
        }
    }

    /// Returns x_min, y_min, x_max, y_max, m, of the region with a lower side.
    pub fn bounds(&self, cell: f64) -> [f64; 4] {
        let (a, c) = (self.hub.axle, self.hub.position);
        let flat = |v: f64| (1.0 - v * v).max(0.0).sqrt();
        let half = match self.form {
            Form::Rim { radius, width } => [
                radius * flat(a.x) + 0.5 * width * a.x.abs(),
                radius * flat(a.y) + 0.5 * width * a.y.abs(),
            ],
            Form::Disc { radius } => [radius * flat(a.x), radius * flat(a.y)],
            Form::Plate { length, width } => {
                let across = a.cross(&self.along);
                [0, 1].map(|k| 0.5 * (length * self.along[k].abs() + width * across[k].abs()))
            }
        };
        let [hx, hy] = half.map(|h| h + cell);
        [c.x - hx, c.y - hy, c.x + hx, c.y + hy]
    }

    /// Returns whether the body is certainly above ground of the height `h` (m) at x, y, because a rim is above the parabola at its lowest line.
    #[inline(always)]
    pub fn clears(&self, x: f64, y: f64, h: f64) -> bool {
        let Form::Rim { radius, width } = self.form else { return false };
        let (a, c) = (self.hub.axle, self.hub.position);
        let (dx, dy) = (x - c.x, y - c.y);
        let flat = a.x * a.x + a.y * a.y;
        // `across`² is the squared distance from the axle in plan view. The lowest line of the rim descends
        // by a_z over the width.
        let across = dx * a.y - dy * a.x;
        let lowest = radius - 0.5 * across * across / (flat * radius).max(1e-12);
        let fall = lowest.max(0.0) + (0.5 * width) * a.z.abs();
        (c.z - h) * (c.z - h) * flat > fall * fall && c.z > h
    }

    /// Returns the lower side over x, y on cells of an edge (m); `None` outside the shape, and where it is too steep to press.
    #[inline(always)]
    pub fn under(&self, x: f64, y: f64, cell: f64) -> Option<Under> {
        let (a, c) = (self.hub.axle, self.hub.position);
        let (dx, dy) = (x - c.x, y - c.y);
        // Returns the share of a cell that is inside, where `over` (m) is the distance from its
        // centre to the edge.
        let ramp = |over: f64| (over / cell + 0.5).clamp(0.0, 1.0);
        match self.form {
            Form::Rim { radius, width } => {
                let m = a.x * dx + a.y * dy;
                if m.abs() > 0.5 * (width + cell) + radius * a.z.abs() {
                    return None;
                }
                let up = 1.0 - a.z * a.z;
                let rest = (m * a.z).powi(2) - up * (dx * dx + dy * dy - m * m - radius * radius);
                if !(rest > 0.0 && up > 1e-6) {
                    return None;
                }
                let z = (m * a.z - rest.sqrt()) / up;
                let t = m + z * a.z;
                let share = ramp(0.5 * width - t.abs());
                let d = Vec3::new(dx, dy, z);
                let normal = (a * t - d) / radius;
                (share > 0.0 && normal.z > DOWN_MIN).then(|| Under { z: c.z + z, normal, share })
            }
            Form::Disc { radius } => {
                let z = self.sole(dx, dy)?;
                let share = ramp(radius - Vec3::new(dx, dy, z).norm());
                (share > 0.0).then(|| Under { z: c.z + z, normal: a, share })
            }
            Form::Plate { length, width } => {
                let z = self.sole(dx, dy)?;
                let d = Vec3::new(dx, dy, z);
                let (s, t) = (d.dot(&self.along), d.dot(&a.cross(&self.along)));
                let share = ramp(0.5 * length - s.abs()) * ramp(0.5 * width - t.abs());
                (share > 0.0).then(|| Under { z: c.z + z, normal: a, share })
            }
        }
    }

    /// Returns the height of the plane of a sole relative to its centre, m.
    fn sole(&self, dx: f64, dy: f64) -> Option<f64> {
        let a = self.hub.axle;
        (a.z > DOWN_MIN).then(|| -(a.x * dx + a.y * dy) / a.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn presser(form: Form, axle: Vec3) -> Presser {
        let hub = Hub {
            position: Vec3::new(0.3, -0.2, 0.5),
            axle,
            velocity: Vec3::zeros(),
            angular: Vec3::zeros(),
        };
        Presser { form, hub, along: Vec3::x() }
    }

    #[test]
    fn a_rims_lower_side_is_on_the_cylinder() {
        let axle = Vec3::new(0.2, 0.9, 0.15).normalize();
        let p = presser(Form::Rim { radius: 0.25, width: 0.4 }, axle);
        let mut seen = 0;
        for k in 0..2500 {
            let (x, y) = (0.3 - 0.4 + 0.016 * f64::from(k % 50), -0.6 + 0.016 * f64::from(k / 50));
            let Some(u) = p.under(x, y, 0.01) else { continue };
            seen += 1;
            let d = Vec3::new(x, y, u.z) - p.hub.position;
            let off = d - axle * d.dot(&axle);
            assert!((off.norm() - 0.25).abs() < 1e-12, "{off}");
            assert!((u.normal + off / 0.25).norm() < 1e-12 && u.normal.z > 0.0);
            assert!(d.dot(&axle).abs() < 0.205);
            let [x0, y0, x1, y1] = p.bounds(0.01);
            assert!(x > x0 && x < x1 && y > y0 && y < y1);
        }
        // In plan view the area is 0.5 m by 0.4 m, except for the steepest hundredth.
        let area = f64::from(seen) * 0.016 * 0.016;
        assert!((area - 0.2).abs() < 0.01, "{area}");
    }

    #[test]
    fn what_it_clears_it_does_not_touch() {
        let form = Form::Rim { radius: 0.25, width: 0.4 };
        let mut cleared = 0;
        for k in 0..20_000 {
            let at = |a: i32, b: i32| f64::from(k / a % b) / f64::from(b) - 0.5;
            let axle = Vec3::new(at(1, 7), 1.0 + at(7, 3), at(21, 5)).normalize();
            let p = presser(form, axle);
            let (x, y, h) =
                (0.3 + 0.6 * at(105, 11), -0.2 + 0.6 * at(1155, 5), 0.35 + 0.4 * at(5775, 4));
            if p.clears(x, y, h) {
                cleared += 1;
                assert!(p.under(x, y, 0.01).is_none_or(|u| u.z >= h), "{axle} {x} {y} {h}");
            }
        }
        assert!(cleared > 4000 && cleared < 19_000, "{cleared}");
    }

    #[test]
    fn shares_of_cells_add_up_to_the_area() {
        for (form, area) in [
            (Form::Plate { length: 0.23, width: 0.11 }, 0.23 * 0.11),
            (Form::Disc { radius: 0.12 }, std::f64::consts::PI * 0.0144),
        ] {
            let p = presser(form, Vec3::z());
            let cell = 0.01;
            let mut sum = 0.0;
            for i in -40..=40 {
                for j in -40..=40 {
                    let at = [0.3 + 0.003 + cell * f64::from(i), -0.2 + cell * f64::from(j)];
                    sum += p.under(at[0], at[1], cell).map_or(0.0, |u| u.share) * cell * cell;
                }
            }
            assert!((sum / area - 1.0).abs() < 2e-3, "{form:?}: {sum} instead of {area}");
        }
    }
}

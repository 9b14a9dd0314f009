//! Mesh of the planet: a sphere through the origin of W if W is a site, or a sphere about the origin of W.
//! ```text
//! p(s, a) = R sin θ (cos a, sin a, 0) − 2 R sin²(θ/2) ẑ      θ = s/R; s: distance over the ground from the origin; ẑ: up there
//! ```
//! The spacing of the rings of nodes grows with their distance, so the mesh is fine near the origin. The formula avoids differences of large
//! numbers, so single precision has a resolution of micrometres at the origin. A planet about the origin has equally spaced rings. The colours are random noise.
use crate::scene::Planet;
use crate::shapes::f3;
use linkwork_spatial::{Quat, Vec3};
use re_sdk_types::archetypes::Mesh3D;

/// Number of nodes around a ring.
const SECTORS: u32 = 160;
/// Number of rings between the origin and the antipode.
const RINGS: u32 = 180;
/// Distance of the first ring from the origin (m).
const FIRST: f64 = 5.0;

impl Planet {
    /// Returns the up direction at a point of W.
    fn up(&self, p: &Vec3) -> Vec3 {
        (p - self.centre).try_normalize(1e-9).unwrap_or_else(Vec3::z)
    }

    /// Returns the shortest rotation from z of W to the up direction at `p`.
    pub fn level(&self, p: &Vec3) -> Quat {
        let flip = || Quat::from_scaled_axis(Vec3::x() * std::f64::consts::PI);
        Quat::rotation_between(&Vec3::z(), &self.up(p)).unwrap_or_else(flip)
    }

    /// Returns whether the origin of W is on the planet's ground.
    fn is_under_site(&self) -> bool {
        self.centre.norm() > 0.5 * self.radius
    }

    /// Returns the mesh of the sphere, lowered by `sink` (m) within the distance `clear` (m) of the origin, where other ground is shown.
    pub fn mesh(&self, sink: f64, clear: f64) -> Mesh3D {
        let (radius, site) = (self.radius, self.is_under_site());
        let level = self.level(&Vec3::zeros());
        // Centre of the rings in W: the origin of W, or the top of the sphere.
        let top = if site { Vec3::zeros() } else { self.centre + Vec3::z() * radius };
        let growth = (radius * std::f64::consts::PI / FIRST).powf(1.0 / f64::from(RINGS - 1));
        let (mut points, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
        for ring in 0..=RINGS {
            let way = match ring {
                0 => 0.0,
                ring if site => FIRST * growth.powf(f64::from(ring - 1)),
                ring => radius * std::f64::consts::PI * f64::from(ring) / f64::from(RINGS),
            };
            let (sin, cos) = (way / radius).sin_cos();
            // This is the spacing between rings.
            let even = radius * std::f64::consts::PI / f64::from(RINGS);
            let apart = if site { (way * (growth - 1.0)).max(FIRST) } else { even };
            let down = sink * (2.0 - way / clear.max(1e-9)).clamp(0.0, 1.0);
            let drop = 2.0 * (0.5 * way / radius).sin().powi(2);
            for k in 0..SECTORS {
                let (b, a) = (std::f64::consts::TAU * f64::from(k) / f64::from(SECTORS)).sin_cos();
                let normal = Vec3::new(sin * a, sin * b, cos);
                let p = Vec3::new(sin * a, sin * b, -drop) * radius - normal * down;
                points.push(f3(&(top + level * p)));
                normals.push(f3(&(level * normal)));
                colors.push(self.shade(&(normal * radius), apart));
            }
        }
        let mut triangles = Vec::new();
        for ring in 0..RINGS {
            for k in 0..SECTORS {
                let (i, j) = (ring * SECTORS, (k + 1) % SECTORS);
                let [p, q, r, s] = [i + k, i + j, i + SECTORS + k, i + SECTORS + j];
                triangles.push([p, r, s]);
                triangles.push([p, s, q]);
            }
        }
        Mesh3D::new(points)
            .with_triangle_indices(triangles)
            .with_vertex_normals(normals)
            .with_vertex_colors(colors)
    }

    /// Returns noise with patches of all sizes that nodes at this distance (m) can represent.
    fn shade(&self, p: &Vec3, apart: f64) -> [u8; 3] {
        let (mut sum, mut weights, mut size) = (0.0, 0.0, self.radius);
        while size > 2.0 * apart {
            // Waves with a size close to the distance of nodes have the largest weight.
            sum = 0.8 * sum + noise(&(p / size));
            weights = 0.8 * weights + 1.0;
            size *= 0.5;
        }
        let bright = if weights > 0.0 { sum / weights } else { 0.5 };
        self.color.map(|c| (f64::from(c) * (0.35 + 0.9 * bright)).clamp(0.0, 255.0) as u8)
    }
}

/// Returns smooth noise from 0 to 1 over cells of size 1.
fn noise(p: &Vec3) -> f64 {
    let corner = p.map(f64::floor);
    let f = (p - corner).map(|x| x * x * (3.0 - 2.0 * x));
    let cell = |k: u32| {
        let bit = |axis: u32| f64::from(k >> axis & 1);
        let weight: f64 = (0..3)
            .map(|a| if bit(a) > 0.5 { f[a as usize] } else { 1.0 - f[a as usize] })
            .product();
        let at = [0, 1, 2].map(|a| (corner[a as usize] + bit(a)) as i64);
        weight * hashed(at)
    };
    (0..8).map(cell).sum()
}

/// Returns a pseudo-random number from 0 to 1 for a cell.
fn hashed(cell: [i64; 3]) -> f64 {
    let mix = |h: u64, c: i64| {
        let h = (h ^ c.cast_unsigned()).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        h ^ (h >> 29)
    };
    let h = cell.into_iter().fold(0x51_7C_C1_B7, mix).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    (h >> 40) as f64 / (1_u64 << 24) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mars() -> Planet {
        let centre = Vec3::new(3e5, -2e5, -3.37e6);
        Planet { centre, radius: centre.norm(), color: [190, 120, 80] }
    }

    #[test]
    fn the_sphere_goes_through_the_origin_and_all_around() {
        let planet = mars();
        let mesh = planet.mesh(0.0, 0.0);
        let radius = planet.centre.norm();
        let positions = positions(&mesh);
        assert_eq!(positions.len() as u32, (RINGS + 1) * SECTORS);
        let (mut lowest, mut off) = (f64::INFINITY, 0.0_f64);
        for p in &positions {
            let p = Vec3::new(p[0].into(), p[1].into(), p[2].into());
            off = off.max(((p - planet.centre).norm() - radius).abs());
            lowest = lowest.min(planet.up(&Vec3::zeros()).dot(&p));
        }
        // The tolerance is single precision at a distance of two radii.
        assert!(off < 1.0 && (lowest / (-2.0 * radius) - 1.0).abs() < 1e-6, "{off} {lowest}");
        assert_eq!(positions[0], [0.0; 3]);
    }

    #[test]
    fn a_planet_about_the_origin_is_a_sphere_there() {
        let earth = Planet { centre: Vec3::zeros(), radius: 6.378e6, color: [60, 90, 140] };
        let (mut off, mut turns) = (0.0_f64, Vec::new());
        for p in positions(&earth.mesh(0.0, 0.0)) {
            let p = Vec3::new(p[0].into(), p[1].into(), p[2].into());
            off = off.max((p.norm() - earth.radius).abs());
            turns.push(p.z);
        }
        assert!(off < 1.0, "{off}");
        // The rings go all around at equal angles.
        let z = |ring: usize| turns[ring * SECTORS as usize] / earth.radius;
        for ring in [0, 45, 90, 180] {
            let angle = std::f64::consts::PI * ring as f64 / f64::from(RINGS);
            assert!((z(ring) - angle.cos()).abs() < 1e-6, "{ring}: {}", z(ring));
        }
    }

    fn positions(mesh: &Mesh3D) -> Vec<[f32; 3]> {
        let array = mesh.vertex_positions.as_ref().map(|b| b.array.clone());
        array.map(|a| rerun_positions(&*a)).unwrap_or_default()
    }

    fn rerun_positions(array: &dyn re_sdk_types::external::arrow::array::Array) -> Vec<[f32; 3]> {
        use re_sdk::Loggable as _;
        re_sdk_types::components::Position3D::from_arrow(array)
            .into_iter()
            .flatten()
            .map(|p| [p.x(), p.y(), p.z()])
            .collect()
    }

    #[test]
    fn level_is_up_from_the_centre() {
        let planet = mars();
        for p in [Vec3::zeros(), Vec3::new(2e6, 1e6, -1e6), Vec3::new(-4e6, 5.0, 9e5)] {
            let up = (p - planet.centre).normalize();
            assert!((planet.level(&p) * Vec3::z() - up).norm() < 1e-12);
        }
        // At the antipode of the camera, the level is also defined.
        let below = Planet { centre: Vec3::z() * 5.0, radius: 5.0, ..planet };
        assert!((below.level(&Vec3::zeros()) * Vec3::z() + Vec3::z()).norm() < 1e-12);
    }

    #[test]
    fn noise_is_smooth_and_between_nought_and_one() {
        let mut last = None;
        for k in 0..1000 {
            let v = noise(&Vec3::new(0.01 * f64::from(k), 2.3, -4.7));
            assert!((0.0..=1.0).contains(&v));
            assert!(last.is_none_or(|l: f64| (v - l).abs() < 0.03), "{k}: {v}");
            last = Some(v);
        }
    }
}

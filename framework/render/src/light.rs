//! Light and matter: the Sun, the sky, and how surfaces give light back.
//! ```text
//! L = ρ/π (E_s max(0, n·s) V + E_d ½ (1 + n_z))        Lambert; V = 0 in the shadow of anything, else 1
//! ρ = ρ₀ (1 + c w(p/ℓ))                                 w: value noise of three octaves, −1 to 1
//! sky    L = L_h + (L_z − L_h) d_z  above the horizon, L_h below it
//! ```
//! Radiance L in W/(m² sr), irradiance E in W/m², for red, green and blue each. Light that surfaces throw on each other
//! is left out, but for E_d, the same everywhere. The Sun is a point: shadows are hard.

use crate::error::{RenderError, number};
use crate::scene::check_direction;
use linkwork_runtime::noise;
use linkwork_spatial::Vec3;

/// Red, green, blue.
pub type Rgb = [f64; 3];

/// Luminance of Rec. 709.
pub(crate) fn luminance([r, g, b]: Rgb) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The light of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Unit vector to the Sun, W.
    pub sun: Vec3,
    /// Irradiance of the Sun on a surface that faces it, W/m².
    pub sun_irradiance: Rgb,
    /// Irradiance of the sky on level ground, W/m².
    pub sky_irradiance: Rgb,
    /// Radiance of the sky at the horizon, W/(m² sr).
    pub horizon: Rgb,
    /// Radiance of the sky at the zenith, W/(m² sr).
    pub zenith: Rgb,
}

impl Default for Light {
    /// A high Sun at Mars' mean distance (590 W/m², 1361 W/m² over 1.52² in round numbers) under a clear dusty sky, whose shares are a
    /// choice of ours.
    fn default() -> Self {
        Self {
            sun: Vec3::new(0.5, 0.3, 0.8).normalize(),
            sun_irradiance: [400.0; 3],
            sky_irradiance: [110.0, 90.0, 70.0],
            horizon: [50.0, 40.0, 30.0],
            zenith: [22.0, 18.0, 15.0],
        }
    }
}

impl Light {
    /// Refuses what is no light.
    ///
    /// # Errors
    /// A direction that is no unit vector, an irradiance or radiance below 0.
    pub fn check(&self) -> Result<(), RenderError> {
        check_direction("direction of the Sun", &self.sun)?;
        for (what, rgb) in [
            ("irradiance of the Sun", self.sun_irradiance),
            ("irradiance of the sky", self.sky_irradiance),
            ("radiance of the horizon", self.horizon),
            ("radiance of the zenith", self.zenith),
        ] {
            rgb.iter().try_for_each(|v| number(what, *v, |v| v >= 0.0, "it must be from 0 up"))?;
        }
        Ok(())
    }

    /// Radiance of the sky along a unit direction, W/(m² sr). The Sun's disc is not in it.
    #[must_use]
    pub fn sky(&self, d: &Vec3) -> Rgb {
        let up = d.z.max(0.0);
        std::array::from_fn(|k| self.horizon[k] + (self.zenith[k] - self.horizon[k]) * up)
    }

    /// Radiance of a surface with a unit normal that is lit or shaded, W/(m² sr).
    #[must_use]
    pub fn reflected(&self, albedo: &Rgb, normal: &Vec3, lit: bool) -> Rgb {
        let sun = if lit { normal.dot(&self.sun).max(0.0) } else { 0.0 };
        let sky = 0.5 * (1.0 + normal.z);
        std::array::from_fn(|k| {
            let e = self.sun_irradiance[k] * sun + self.sky_irradiance[k] * sky;
            albedo[k] * e * std::f64::consts::FRAC_1_PI
        })
    }
}

/// How a surface looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Part of the light that comes back, 0 to 1.
    pub albedo: Rgb,
    /// Contrast of its texture c, 0 to 1.
    pub contrast: f64,
    /// Length of its coarsest texture ℓ, m; the others have a half and a quarter.
    pub grain: f64,
    /// Its number in a semantic mask.
    pub class: u16,
}

impl Look {
    /// One albedo everywhere, class 0.
    #[must_use]
    pub fn plain(albedo: Rgb) -> Self {
        Self { albedo, contrast: 0.0, grain: 1.0, class: 0 }
    }

    /// Regolith of Mars as a mottled red brown; the numbers are a choice of ours.
    #[must_use]
    pub fn soil() -> Self {
        Self { albedo: [0.30, 0.19, 0.12], contrast: 0.35, grain: 0.15, class: 1 }
    }

    /// Refuses what no surface has.
    pub(crate) fn check(&self) -> Result<(), RenderError> {
        let share = |v: f64| (0.0..=1.0).contains(&v);
        for a in self.albedo {
            number("albedo", a, share, "it must be from 0 to 1")?;
        }
        number("contrast of a texture", self.contrast, share, "it must be from 0 to 1")?;
        number("grain of a texture (m)", self.grain, |v| v > 0.0, "it must be positive")
    }

    /// Albedo at a point of the surface's own frame, m.
    #[must_use]
    pub fn albedo_at(&self, p: &Vec3) -> Rgb {
        if self.contrast == 0.0 {
            return self.albedo;
        }
        let q = p / self.grain;
        let w = (value_noise(&q) + 0.5 * value_noise(&(2.0 * q)) + 0.25 * value_noise(&(4.0 * q)))
            / 1.75;
        self.albedo.map(|a| (a * (1.0 + self.contrast * w)).clamp(0.0, 1.0))
    }
}

/// Random values at whole numbers, between them a C¹ cubic; −1 to 1.
fn value_noise(p: &Vec3) -> f64 {
    let cell = p.map(f64::floor);
    let f = (p - cell).map(|t| t * t * (3.0 - 2.0 * t));
    let i = cell.map(|v| v as i64);
    let at = |dx: i64, dy: i64, dz: i64| {
        let n = [i.x + dx, i.y + dy, i.z + dz].map(|v| v as u32);
        f64::from(noise::philox([n[0], n[1], n[2], 0], [0x7465_7874, 0])[0]) / f64::from(u32::MAX)
            * 2.0
            - 1.0
    };
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    let plane = |dz: i64| {
        let low = mix(at(0, 0, dz), at(1, 0, dz), f.x);
        mix(low, mix(at(0, 1, dz), at(1, 1, dz), f.x), f.y)
    };
    if f.z == 0.0 { plane(0) } else { mix(plane(0), plane(1), f.z) }
}

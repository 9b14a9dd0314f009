//! Light and materials: the Sun, the sky, and reflection by surfaces.
//! ```text
//! L = ρ/π (E_s max(0, n·s) V + E_d ½ (1 + n_z))        Lambert; V = 0 in a shadow, otherwise 1
//! ρ = ρ₀ (1 + c w(p/ℓ))                                 w: value noise of three octaves, −1 to 1
//! sky    L = L_h + (L_z − L_h) d_z  above the horizon, L_h below it
//! ```
//! Radiance L is in W/(m² sr), irradiance E in W/m², each for red, green and blue. Light that surfaces reflect onto each other is not simulated; E_d
//! is the same everywhere. The Sun is a point source, so shadows are hard.

use crate::error::check_direction;
use crate::error::{RenderError, number};
use linkwork_runtime::noise;
use linkwork_spatial::Vec3;

/// Red, green, blue.
pub type Rgb = [f64; 3];

/// Returns the luminance of Rec. 709.
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
    /// A high Sun at the mean distance of Mars (590 W/m², about 1361 W/m² / 1.52²) under a clear dusty sky. The division between Sun and sky is an
    /// assumption.
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
    /// Checks the values of the light.
    ///
    /// # Errors
    /// A direction that is not a unit vector, a negative irradiance or radiance.
    pub fn check(&self) -> Result<(), RenderError> {
        check_direction("direction of the Sun", &self.sun)?;
        for (what, rgb) in [
            ("irradiance of the Sun", self.sun_irradiance),
            ("irradiance of the sky", self.sky_irradiance),
            ("radiance of the horizon", self.horizon),
            ("radiance of the zenith", self.zenith),
        ] {
            rgb.iter()
                .try_for_each(|v| number(what, *v, |v| v >= 0.0, "it must not be negative"))?;
        }
        Ok(())
    }

    /// Returns the radiance of the sky along a unit direction, W/(m² sr), without the Sun's disc.
    #[must_use]
    pub fn sky(&self, d: &Vec3) -> Rgb {
        let up = d.z.max(0.0);
        std::array::from_fn(|k| self.horizon[k] + (self.zenith[k] - self.horizon[k]) * up)
    }

    /// Returns the radiance of a lit or shaded surface with a unit normal, W/(m² sr).
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

/// Optical properties of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Reflected fraction of the light, 0 to 1.
    pub albedo: Rgb,
    /// Texture contrast c, 0 to 1.
    pub contrast: f64,
    /// Length scale of the coarsest texture octave ℓ, m; the others have a half and a quarter of it.
    pub grain: f64,
    /// Class number in a semantic mask.
    pub class: u16,
}

impl Look {
    /// Creates a uniform surface of class 0.
    #[must_use]
    pub fn plain(albedo: Rgb) -> Self {
        Self { albedo, contrast: 0.0, grain: 1.0, class: 0 }
    }

    /// Creates a mottled red-brown surface that resembles regolith of Mars. The numbers are an assumption.
    #[must_use]
    pub fn soil() -> Self {
        Self { albedo: [0.30, 0.19, 0.12], contrast: 0.35, grain: 0.15, class: 1 }
    }

    /// Checks the values of the surface.
    pub(crate) fn check(&self) -> Result<(), RenderError> {
        let share = |v: f64| (0.0..=1.0).contains(&v);
        for a in self.albedo {
            number("albedo", a, share, "it must be from 0 to 1")?;
        }
        number("contrast of a texture", self.contrast, share, "it must be from 0 to 1")?;
        number("grain of a texture (m)", self.grain, |v| v > 0.0, "it must be positive")
    }

    /// Returns the albedo at a point of the surface's own frame, m.
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

/// Returns value noise from −1 to 1: random values at integer points, interpolated by a C¹ cubic.
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

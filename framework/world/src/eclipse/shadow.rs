//! Conical shadow: the discs of Sun and planet in the sky of the satellite.
//!
//! ```text
//! a = asin(R☉/d), b = asin(R/r), c the angle between their centres
//! c ≥ a + b: all of the Sun;  c ≤ b − a: nothing;  c ≤ a − b: a ring, 1 − b²/a²;  else
//! x = (c² + a² − b²)/2c,  y = √(a² − x²)
//! ν = 1 − [a² acos(x/a) + b² acos((c − x)/b) − c y]/(π a²)
//! ```
//! Montenbruck & Gill, *Satellite Orbits*, section 3.4.2: discs are treated as planar, atmosphere and oblateness of the planet are neglected.

use linkwork_spatial::Vec3;
use std::f64::consts::PI;

/// The discs of Sun and planet, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discs {
    /// a, angular radius of the Sun.
    pub sun: f64,
    /// b, angular radius of the planet; π/2 on its surface and inside.
    pub body: f64,
    /// c, angle between their centres.
    pub separation: f64,
}

impl Discs {
    /// Computes the discs seen from `r`, with the Sun at `s`, both from the planet's centre, m, any axes; radii in m.
    #[must_use]
    pub fn seen(r: &Vec3, s: &Vec3, radius: f64, radius_sun: f64) -> Self {
        let to_sun = s - r;
        // Use the tangent, because an arc cosine loses half of the digits for small angles.
        let separation = to_sun.cross(&-r).norm().atan2(to_sun.dot(&-r));
        Self {
            sun: (radius_sun / to_sun.norm()).min(1.0).asin(),
            body: (radius / r.norm()).min(1.0).asin(),
            separation,
        }
    }

    /// Returns ν, the visible fraction of the Sun's disc: 1 in sunlight, 0 in the umbra.
    #[must_use]
    pub fn visible_fraction(&self) -> f64 {
        let Self { sun: a, body: b, separation: c } = *self;
        if c >= a + b {
            1.0
        } else if c <= b - a {
            0.0
        } else if c <= a - b {
            1.0 - (b / a) * (b / a)
        } else {
            let x = ((c - b) * (c + b) + a * a) / (2.0 * c);
            let y = (a * a - x * x).max(0.0).sqrt();
            // Arc tangents are accurate even for discs of very different sizes, in contrast to arc
            // cosines.
            1.0 - (a * a * y.atan2(x) + b * b * y.atan2(c - x) - c * y) / (PI * a * a)
        }
    }

    /// Returns c − a − b: positive in sunlight. Its zeros are the outer edges of the penumbra. An integrator should stop there, because otherwise the
    /// position error grows to centimetres within hours.
    #[must_use]
    pub fn penumbra_edge(&self) -> f64 {
        self.separation - self.sun - self.body
    }

    /// Returns c − |b − a|: negative in the umbra and in the antumbra.
    #[must_use]
    pub fn umbra_edge(&self) -> f64 {
        self.separation - (self.body - self.sun).abs()
    }
}

/// Returns ν at `r` with the Sun at `s`, both from the planet's centre, m, any axes; radii in m.
#[must_use]
pub fn visible_fraction(r: &Vec3, s: &Vec3, radius: f64, radius_sun: f64) -> f64 {
    Discs::seen(r, s, radius, radius_sun).visible_fraction()
}

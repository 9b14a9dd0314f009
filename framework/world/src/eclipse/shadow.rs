//! Conical shadow: two discs in the sky of the satellite.
//!
//! ```text
//! a = asin(R☉/d), b = asin(R/r), c the angle between their centres
//! c ≥ a + b: all of the Sun;  c ≤ b − a: nothing;  c ≤ a − b: a ring, 1 − b²/a²;  else
//! x = (c² + a² − b²)/2c,  y = √(a² − x²)
//! ν = 1 − [a² acos(x/a) + b² acos((c − x)/b) − c y]/(π a²)
//! ```
//! Montenbruck & Gill, *Satellite Orbits*, section 3.4.2: discs as if on a plane, no air, a round planet.

use linkwork_spatial::Vec3;
use std::f64::consts::PI;

/// The discs of Sun and planet, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Discs {
    /// a, the Sun's half width.
    pub sun: f64,
    /// b, the planet's half width; π/2 on its surface and inside.
    pub body: f64,
    /// c, between their centres.
    pub separation: f64,
}

impl Discs {
    /// As seen from `r`, with the Sun at `s`, both from the planet's centre, m, any axes; radii in m.
    #[must_use]
    pub fn seen(r: &Vec3, s: &Vec3, radius: f64, radius_sun: f64) -> Self {
        let to_sun = s - r;
        // Through the tangent: an arc cosine would lose half of the digits of small angles.
        let separation = to_sun.cross(&-r).norm().atan2(to_sun.dot(&-r));
        Self {
            sun: (radius_sun / to_sun.norm()).min(1.0).asin(),
            body: (radius / r.norm()).min(1.0).asin(),
            separation,
        }
    }

    /// ν, the part of the Sun's disc that is seen: 1 in the light, 0 in the umbra.
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
            // Tangents instead of the cosines above: exact for a large disc beside a small one.
            1.0 - (a * a * y.atan2(x) + b * b * y.atan2(c - x) - c * y) / (PI * a * a)
        }
    }

    /// c − a − b: above zero in the light; its zeros are the outer edges of the penumbra, where an
    /// integrator should stop (else centimetres are lost in some hours).
    #[must_use]
    pub fn penumbra_edge(&self) -> f64 {
        self.separation - self.sun - self.body
    }

    /// c − |b − a|: below zero in the umbra and in the ring of the antumbra.
    #[must_use]
    pub fn umbra_edge(&self) -> f64 {
        self.separation - (self.body - self.sun).abs()
    }
}

/// ν at `r` with the Sun at `s`, both from the planet's centre, m, any axes; radii in m.
#[must_use]
pub fn visible_fraction(r: &Vec3, s: &Vec3, radius: f64, radius_sun: f64) -> f64 {
    Discs::seen(r, s, radius, radius_sun).visible_fraction()
}

//! Sunlight at a point: the fraction of the Sun's disc that bodies and the horizon hide.
//! ```text
//! ν = 1 − Σ (1 − ν_k)      ν_k: visible part of the disc past body k alone (conical shadow; Montenbruck & Gill, 3.4.2)
//! E = S (AU/d)²            S at 1 AU, d from the point to the Sun
//! ```
//! If two bodies overlap as seen from the point, only the one that hides more of the Sun counts. Bodies are spheres without an atmosphere.

use linkwork_surroundings::prelude::*;
use linkwork_world::eclipse::Discs;
use linkwork_world::planet::{AU, RADIUS_SUN};
use std::f64::consts::{FRAC_PI_2, PI};

/// The Sun as seen from a point, and the bodies that hide it.
pub(crate) struct SunView {
    /// Vector from the point to the Sun (m, W).
    sun: Vec3,
    distance: f64,
    irradiance: f64,
    visible: f64,
    penumbra: f64,
    umbra: f64,
    /// Direction and angular radius of the bodies that hide a part of it.
    before: Option<(Vec3, f64)>,
}

impl SunView {
    /// Creates the light of an unobstructed Sun; `constant` is the solar irradiance at 1 AU (W/m²).
    pub fn new(sun: &Vec3, constant: f64) -> SunView {
        let distance = sun.norm();
        let irradiance = constant * (AU / distance).powi(2);
        let (visible, penumbra, umbra) = (1.0, PI, PI);
        SunView { sun: *sun, distance, irradiance, visible, penumbra, umbra, before: None }
    }

    /// Adds a spherical body at `r` from the point (m, W), which may cover the disc.
    pub fn behind(&mut self, r: &Vec3, radius: f64) {
        let sun = (RADIUS_SUN / self.distance).min(1.0).asin();
        let body = (radius / r.norm()).min(1.0).asin();
        let separation = self.sun.cross(r).norm().atan2(self.sun.dot(r));
        // A body behind the Sun does not hide any part of it.
        if r.norm() - radius > self.distance {
            return;
        }
        self.add(Discs { sun, body, separation }, *r);
    }

    /// Level ground hides the part of the Sun below the horizontal plane of W.
    pub fn horizon(&mut self) {
        let sun = (RADIUS_SUN / self.distance).min(1.0).asin();
        let across = (self.sun.x * self.sun.x + self.sun.y * self.sun.y).sqrt();
        let separation = FRAC_PI_2 + self.sun.z.atan2(across);
        self.add(Discs { sun, body: FRAC_PI_2, separation }, -Vec3::z());
    }

    fn add(&mut self, discs: Discs, r: Vec3) {
        self.penumbra = self.penumbra.min(discs.penumbra_edge());
        self.umbra = self.umbra.min(discs.umbra_edge());
        let visible = discs.visible_fraction();
        if visible >= 1.0 {
            return;
        }
        let together = self.before.is_some_and(|(other, width)| {
            other.cross(&r).norm().atan2(other.dot(&r)) < width + discs.body
        });
        self.visible = match together {
            true => self.visible.min(visible),
            false => (self.visible + visible - 1.0).max(0.0),
        };
        self.before = Some((r, discs.body));
    }

    /// The light.
    pub fn light(&self) -> Light {
        Light {
            direction: self.sun / self.distance,
            distance: self.distance,
            irradiance: self.irradiance,
            visible: self.visible,
            penumbra: self.penumbra,
            umbra: self.umbra,
        }
    }
}

//! Pole and prime meridian from the IAU Working Group on Cartographic Coordinates and Rotational Elements.
//!
//! ```text
//! R_PI = R₃(W) R₁(90° − δ) R₃(90° + α)          (turns of axes; R_IP is its transpose)
//! α = α₀ + α₁ T + α₂ T² + Σ aᵢ sin Eᵢ,   δ = δ₀ + δ₁ T + δ₂ T² + Σ dᵢ cos Eᵢ
//! W = w₀ + w₁ d + w₂ d² + Σ wᵢ sin Eᵢ,   Eᵢ = Eᵢ₀ + Eᵢ₁ d + Eᵢ₂ d²;   d days, T centuries of TDB past J2000
//! ω = α̇ ẑ_I − δ̇ n̂ + Ẇ ẑ_P,   n̂ = (−sin α, cos α, 0) the node of the equator
//! ```
//! Constants are those of 2009 (Archinal et al., *Celest. Mech. Dyn. Astr.* 109 (2011)), as in SPICE's `pck00010`. The periodic terms that the 2015
//! set has for Mars are not included.

use super::{Spin, about_x, about_z, phase};
use linkwork_spatial::{Vec3, nalgebra};
use std::f64::consts::TAU;

/// One periodic term; degrees, degrees per day and per day².
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IauTerm {
    /// E₀, its rate, and the coefficient of d².
    pub angle_deg: [f64; 3],
    /// Coefficients of sin E in α, cos E in δ, and sin E in W.
    pub ra_dec_w_deg: [f64; 3],
}

/// Pole and prime meridian, starting at an epoch.
#[derive(Clone, Debug)]
pub struct IauRotation {
    ra: [f64; 3],
    dec: [f64; 3],
    /// W₀, its rate and second-order coefficient; radians and seconds, from the epoch.
    w: [f64; 3],
    /// Days of TDB past J2000 at the epoch.
    days: f64,
    terms: Vec<IauTerm>,
}

const DAY: f64 = 86400.0;
const CENTURY: f64 = 36525.0;

impl IauRotation {
    /// Creates the rotation from published polynomials, in degrees: `ra_deg` and `dec_deg` with rates per century and per century², `w_deg` with
    /// rates per day and per day². `tdb_days` past J2000 (whole, fraction) is the epoch of t = 0.
    #[must_use]
    pub fn new(
        ra_deg: [f64; 3],
        dec_deg: [f64; 3],
        w_deg: [f64; 3],
        terms: &[IauTerm],
        tdb_days: (f64, f64),
    ) -> Self {
        let (whole, fraction) = tdb_days;
        let d = whole + fraction;
        // Drop whole revolutions before converting to radians.
        let w0 = (w_deg[0] + (w_deg[1] * whole) % 360.0 + w_deg[1] * fraction + w_deg[2] * d * d)
            % 360.0;
        let rate = (w_deg[1] + 2.0 * w_deg[2] * d) / DAY;
        let w = [w0, rate, w_deg[2] / (DAY * DAY)].map(f64::to_radians);
        Self {
            ra: ra_deg.map(f64::to_radians),
            dec: dec_deg.map(f64::to_radians),
            w,
            days: d,
            terms: terms.to_vec(),
        }
    }

    /// Returns the rotation of Mars.
    #[must_use]
    pub fn mars(tdb_days: (f64, f64)) -> Self {
        let (ra, dec) = ([317.68143, -0.1061, 0.0], [52.88650, -0.0609, 0.0]);
        Self::new(ra, dec, [176.630, 350.89198226, 0.0], &[], tdb_days)
    }

    /// Returns the rotation of the Moon (mean Earth/rotation axes).
    #[must_use]
    pub fn moon(tdb_days: (f64, f64)) -> Self {
        let (ra, dec) = ([269.9949, 0.0031, 0.0], [66.5392, 0.0130, 0.0]);
        Self::new(ra, dec, [38.3213, 13.17635815, -1.4e-12], &MOON, tdb_days)
    }

    /// Returns the spin `t` seconds after the epoch. TT and TDB are assumed to have the same rate (3e-10).
    #[must_use]
    pub fn at(&self, t: f64) -> Spin {
        let d = self.days + t / DAY;
        let T = d / CENTURY;
        let mut ra = self.ra[0] + self.ra[1] * T + self.ra[2] * T * T;
        let mut dec = self.dec[0] + self.dec[1] * T + self.dec[2] * T * T;
        let mut w = self.w[0] + phase(self.w[1] / TAU, t) + self.w[2] * t * t;
        let rate = |c: &[f64; 3]| (c[1] + 2.0 * c[2] * T) / CENTURY / DAY;
        let (mut dra, mut ddec) = (rate(&self.ra), rate(&self.dec));
        let mut dw = self.w[1] + 2.0 * self.w[2] * t;
        for term in &self.terms {
            let [e0, e1, e2] = term.angle_deg;
            let rate = (e1 + 2.0 * e2 * d).to_radians() / DAY;
            let (sin, cos) = (e0 + e1 * d + e2 * d * d).to_radians().sin_cos();
            let [a, b, c] = term.ra_dec_w_deg.map(f64::to_radians);
            ra += a * sin;
            dec += b * cos;
            w += c * sin;
            dra += a * cos * rate;
            ddec -= b * sin * rate;
            dw += c * cos * rate;
        }
        let quarter = std::f64::consts::FRAC_PI_2;
        let R_IP = about_z(ra + quarter) * about_x(quarter - dec) * about_z(w);
        let node = Vec3::new(-ra.sin(), ra.cos(), 0.0);
        let pole: Vec3 = R_IP * nalgebra::Vector3::z();
        Spin { R_IP, omega_I: Vec3::z() * dra - node * ddec + pole * dw }
    }
}

const fn term(e0: f64, e1: f64, ra: f64, dec: f64, w: f64) -> IauTerm {
    IauTerm { angle_deg: [e0, e1, 0.0], ra_dec_w_deg: [ra, dec, w] }
}

/// E1 … E13.
const MOON: [IauTerm; 13] = [
    term(125.045, -0.0529921, -3.8787, 1.5419, 3.5610),
    term(250.089, -0.1059842, -0.1204, 0.0239, 0.1208),
    term(260.008, 13.0120009, 0.0700, -0.0278, -0.0642),
    term(176.625, 13.3407154, -0.0172, 0.0068, 0.0158),
    term(357.529, 0.9856003, 0.0, 0.0, 0.0252),
    term(311.589, 26.4057084, 0.0072, -0.0029, -0.0066),
    term(134.963, 13.0649930, 0.0, 0.0009, -0.0047),
    term(276.617, 0.3287146, 0.0, 0.0, -0.0046),
    term(34.226, 1.7484877, 0.0, 0.0, 0.0028),
    term(15.134, -0.1589763, -0.0052, 0.0008, 0.0052),
    term(119.743, 0.0036096, 0.0, 0.0, 0.0040),
    term(239.961, 0.1643573, 0.0, 0.0, 0.0019),
    term(25.053, 12.9590088, 0.0043, -0.0009, -0.0044),
];

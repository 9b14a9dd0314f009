//! Lens models: map pixels to rays and back. Pinhole with Brown's distortion, CAHV, CAHVOR, CAHVORE.
//! ```text
//! pixel    x to the right, y down; (0, 0) is the centre of the first pixel
//! Brown    axes of the camera: x right, y down, z along the optical axis;  a = X/Z, b = Y/Z, ρ = a² + b²
//!          q = 1 + k₁ρ + k₂ρ² + k₃ρ³
//!          x = f_x (a q + 2p₁ab + p₂(ρ + 2a²)) + c_x     y = f_y (b q + p₁(ρ + 2b²) + 2p₂ab) + c_y
//! CAHV     x = (P − C)·H / (P − C)·A,  y = (P − C)·V / (P − C)·A
//! CAHVOR   ζ = (P − C)·O,  λ = P − C − ζO,  τ = |λ|²/ζ²;  CAHV applied to  C + ζO + (1 + r₀ + r₁τ + r₂τ²) λ
//! CAHVORE  the centre moves along O with the angle θ of the ray:  s(θ) = (θ/sin θ − 1)(e₀ + e₁θ² + e₂θ⁴)
//!          χ = tan(Lθ)/L, θ for L = 0, sin(Lθ)/L for L < 0;  CAHV applied to  C + |λ|/χ O + (1 + r₀ + r₁χ² + r₂χ⁴) λ
//! ```
//! Brown, "Close-range camera calibration", Photogrammetric Engineering 37(8), 1971; the coefficients have the order of OpenCV. The CAHV family
//! follows JPL's library cmod and reproduces its numbers (`tests/lenses.rs`). L is 1 for its perspective type, 0 for its fisheye type, and the
//! parameter of its general type. Gennery, "Generalized camera calibration including fish-eye lenses", IJCV 68, 2006. All vectors of these models are
//! in one frame, the camera's frame C, which need not be aligned with the lens. A model is valid where its polynomial increases; a point beyond this
//! range or behind the camera has no pixel, and a pixel beyond it has no ray.

use crate::error::{RenderError, number};
use linkwork_spatial::Vec3;
use serde::{Deserialize, Serialize};

/// Newton's method ends at this change, and fails after this number of steps.
const CLOSE: f64 = 1e-15;
const STEPS: usize = 50;

/// Ray of a pixel, in the camera's frame C.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensRay {
    /// Origin, m.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

/// Pinhole with Brown's distortion. Lengths in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Brown {
    /// Focal lengths f_x, f_y.
    pub focal: [f64; 2],
    /// Principal point c_x, c_y.
    pub centre: [f64; 2],
    /// Radial k₁, k₂, k₃.
    pub radial: [f64; 3],
    /// Tangential p₁, p₂.
    pub tangential: [f64; 2],
}

/// The CAHV model: the vectors C, A, H, V.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cahv {
    /// Centre of projection, m.
    pub c: Vec3,
    /// Unit vector perpendicular to the image plane.
    pub a: Vec3,
    /// Horizontal vector, pixels.
    pub h: Vec3,
    /// Vertical vector, pixels.
    pub v: Vec3,
}

/// The CAHVOR model: CAHV with radial distortion about O.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cahvor {
    /// C, A, H, V.
    pub cahv: Cahv,
    /// Optical axis, unit.
    pub o: Vec3,
    /// r₀, r₁, r₂.
    pub r: [f64; 3],
}

/// The CAHVORE model: CAHVOR with a moving entrance pupil and any linearity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cahvore {
    /// The CAHVOR part.
    pub cahvor: Cahvor,
    /// e₀, e₁, e₂, m.
    pub e: [f64; 3],
    /// L: 1 perspective, 0 fisheye.
    pub linearity: f64,
}

impl Default for Lens {
    /// One pixel with a field of view of 1 rad.
    fn default() -> Self {
        Lens::Brown(Brown::ideal(1, 1, 1.0))
    }
}

/// A lens model.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Lens {
    /// Pinhole with Brown's distortion.
    Brown(Brown),
    /// CAHV, without distortion.
    Cahv(Cahv),
    /// CAHVOR, with radial distortion.
    Cahvor(Cahvor),
    /// CAHVORE, with a moving entrance pupil.
    Cahvore(Cahvore),
}

impl Brown {
    /// Creates a pinhole without distortion: `width` by `height` square pixels, with the field of view `view` across the width (rad, less than π).
    #[must_use]
    pub fn ideal(width: usize, height: usize, view: f64) -> Self {
        let f = 0.5 * width as f64 / (0.5 * view).tan();
        let centre = [0.5 * (width as f64 - 1.0), 0.5 * (height as f64 - 1.0)];
        Self { focal: [f, f], centre, radial: [0.0; 3], tangential: [0.0; 2] }
    }

    /// Returns distorted coordinates and their derivatives with respect to a and b.
    fn distort(&self, a: f64, b: f64) -> ([f64; 2], [[f64; 2]; 2]) {
        let ([k1, k2, k3], [p1, p2]) = (self.radial, self.tangential);
        let rho = a * a + b * b;
        let q = 1.0 + rho * (k1 + rho * (k2 + rho * k3));
        let dq = k1 + rho * (2.0 * k2 + rho * 3.0 * k3);
        let at = [
            a * q + 2.0 * p1 * a * b + p2 * (rho + 2.0 * a * a),
            b * q + p1 * (rho + 2.0 * b * b) + 2.0 * p2 * a * b,
        ];
        let cross = 2.0 * a * b * dq + 2.0 * p1 * a + 2.0 * p2 * b;
        let by = [
            [q + 2.0 * a * a * dq + 2.0 * p1 * b + 6.0 * p2 * a, cross],
            [cross, q + 2.0 * b * b * dq + 6.0 * p1 * b + 2.0 * p2 * a],
        ];
        (at, by)
    }

    /// Returns true if the distortion is invertible up to a point: its Jacobian determinant stays positive from the axis to the point.
    fn holds(&self, a: f64, b: f64) -> bool {
        const PIECES: usize = 16;
        (1..=PIECES).all(|k| {
            let s = k as f64 / PIECES as f64;
            let (_, m) = self.distort(s * a, s * b);
            m[0][0] * m[1][1] - m[0][1] * m[1][0] > 0.0 && m[0][0] + m[1][1] > 0.0
        })
    }

    fn project(&self, p: &Vec3) -> Option<[f64; 2]> {
        if !(p.z > 0.0) {
            return None;
        }
        let (a, b) = (p.x / p.z, p.y / p.z);
        let ([x, y], _) = self.distort(a, b);
        let at = [self.focal[0] * x + self.centre[0], self.focal[1] * y + self.centre[1]];
        (self.is_plain() || self.holds(a, b)).then_some(at)
    }

    fn is_plain(&self) -> bool {
        self.radial == [0.0; 3] && self.tangential == [0.0; 2]
    }

    fn ray(&self, [x, y]: [f64; 2]) -> Option<LensRay> {
        let want = [(x - self.centre[0]) / self.focal[0], (y - self.centre[1]) / self.focal[1]];
        let [mut a, mut b] = want;
        if !self.is_plain() {
            let mut close = false;
            for _ in 0..STEPS {
                let (at, m) = self.distort(a, b);
                let (ex, ey) = (at[0] - want[0], at[1] - want[1]);
                let det = m[0][0] * m[1][1] - m[0][1] * m[1][0];
                let (da, db) =
                    ((m[1][1] * ex - m[0][1] * ey) / det, (m[0][0] * ey - m[1][0] * ex) / det);
                (a, b) = (a - da, b - db);
                if da.abs().max(db.abs()) <= 4.0 * CLOSE * (1.0 + a.abs().max(b.abs())) {
                    close = true;
                    break;
                }
            }
            if !close || !self.holds(a, b) {
                return None;
            }
        }
        Some(LensRay { origin: Vec3::zeros(), direction: Vec3::new(a, b, 1.0).normalize() })
    }
}

impl Cahv {
    fn image(&self, p: &Vec3) -> Option<[f64; 2]> {
        let depth = p.dot(&self.a);
        (depth > 0.0).then(|| [p.dot(&self.h) / depth, p.dot(&self.v) / depth])
    }

    /// Returns the undistorted ray of a pixel, scaled to a component of 1 along A.
    fn line(&self, [x, y]: [f64; 2]) -> Vec3 {
        let (f, g) = (self.v - self.a * y, self.h - self.a * x);
        let line = f.cross(&g);
        line / line.dot(&self.a)
    }
}

impl Cahvor {
    fn project(&self, p: &Vec3) -> Option<[f64; 2]> {
        let p = p - self.cahv.c;
        let zeta = p.dot(&self.o);
        if !(zeta > 0.0) {
            return None;
        }
        let lambda = p - self.o * zeta;
        let tau = lambda.norm_squared() / (zeta * zeta);
        let scale = grown(&self.r, tau.sqrt())?;
        self.cahv.image(&(self.o * zeta + lambda * scale))
    }

    fn ray(&self, pixel: [f64; 2]) -> Option<LensRay> {
        let (zeta, lambda) = self.split(pixel)?;
        let size = lambda.norm() / zeta;
        let direction = match size {
            0.0 => self.o,
            _ => (self.o + lambda * (shrunk(&self.r, size)? / (size * zeta))).normalize(),
        };
        Some(LensRay { origin: self.cahv.c, direction })
    }

    /// Splits the undistorted ray into its parts along O and perpendicular to O.
    fn split(&self, pixel: [f64; 2]) -> Option<(f64, Vec3)> {
        let line = self.cahv.line(pixel);
        let zeta = line.dot(&self.o);
        (zeta > 0.0).then(|| (zeta, line - self.o * zeta))
    }
}

/// Returns 1 + r₀ + r₁χ² + r₂χ⁴ if χ times it increases with χ up to there.
fn grown(r: &[f64; 3], chi: f64) -> Option<f64> {
    const PIECES: usize = 16;
    let grows = (1..=PIECES).all(|k| {
        let s = chi * k as f64 / PIECES as f64;
        let s = s * s;
        1.0 + r[0] + s * (3.0 * r[1] + s * 5.0 * r[2]) > 0.0
    });
    let s = chi * chi;
    grows.then_some(1.0 + r[0] + s * (r[1] + s * r[2]))
}

/// Returns χ for a given value of χ (1 + r₀ + r₁χ² + r₂χ⁴).
fn shrunk(r: &[f64; 3], given: f64) -> Option<f64> {
    let mut chi = given;
    for _ in 0..STEPS {
        let s = chi * chi;
        let value = chi * (1.0 + r[0] + s * (r[1] + s * r[2])) - given;
        let step = value / (1.0 + r[0] + s * (3.0 * r[1] + s * 5.0 * r[2]));
        chi -= step;
        if step.abs() <= 4.0 * CLOSE * (1.0 + chi.abs()) {
            return (chi > 0.0 && grown(r, chi).is_some()).then_some(chi);
        }
    }
    None
}

impl Cahvore {
    /// Returns e₀ + e₁θ² + e₂θ⁴ and its derivative.
    fn pupil(&self, theta: f64) -> [f64; 2] {
        let (e, s) = (&self.e, theta * theta);
        [e[0] + s * (e[1] + s * e[2]), theta * (2.0 * e[1] + s * 4.0 * e[2])]
    }

    fn chi(&self, theta: f64) -> Option<f64> {
        let l = self.linearity;
        let good = theta * l.abs() < std::f64::consts::FRAC_PI_2;
        let chi = match () {
            () if l > SMALL => (l * theta).tan() / l,
            () if l < -SMALL => (l * theta).sin() / l,
            () => theta,
        };
        good.then_some(chi)
    }

    fn theta(&self, chi: f64) -> Option<f64> {
        let l = self.linearity;
        let theta = match () {
            () if l > SMALL => (l * chi).atan() / l,
            () if l < -SMALL => (l * chi).asin() / l,
            () => chi,
        };
        (theta.is_finite() && theta < std::f64::consts::PI).then_some(theta)
    }

    fn project(&self, p: &Vec3) -> Option<[f64; 2]> {
        let Cahvor { cahv, o, r } = &self.cahvor;
        let p = p - cahv.c;
        let zeta = p.dot(o);
        let lambda = p - o * zeta;
        let size = lambda.norm();
        if size < 1e-12 * p.norm() {
            return if zeta > 0.0 { cahv.image(o) } else { None };
        }
        // Solve for the ray through the point from the pupil position that belongs to its own angle:
        // (ζ − s) sin θ = |λ| cos θ,  s sin θ = (θ − sin θ) e(θ).
        let mut theta = size.atan2(zeta);
        let mut close = false;
        for _ in 0..STEPS {
            let (sin, cos) = theta.sin_cos();
            let [e, de] = self.pupil(theta);
            let value = zeta * sin - size * cos - (theta - sin) * e;
            let slope = zeta * cos + size * sin - (1.0 - cos) * e - (theta - sin) * de;
            let step = value / slope;
            theta -= step;
            if step.abs() <= 4.0 * CLOSE {
                close = true;
                break;
            }
        }
        if !close || !(theta > 0.0) {
            return None;
        }
        let chi = self.chi(theta)?;
        cahv.image(&(o * (size / chi) + lambda * grown(r, chi)?))
    }

    fn ray(&self, pixel: [f64; 2]) -> Option<LensRay> {
        let Cahvor { cahv, o, r } = &self.cahvor;
        let (zeta, lambda) = self.cahvor.split(pixel)?;
        let size = lambda.norm();
        let given = size / zeta;
        if given < 1e-12 {
            return Some(LensRay { origin: cahv.c, direction: *o });
        }
        let theta = self.theta(shrunk(r, given)?)?;
        let [e, _] = self.pupil(theta);
        let origin = cahv.c + o * ((theta / theta.sin() - 1.0) * e);
        let direction = lambda * (theta.sin() / size) + o * theta.cos();
        Some(LensRay { origin, direction: direction.normalize() })
    }
}

/// A smaller linearity counts as 0.
const SMALL: f64 = 1e-15;

impl Lens {
    /// Returns the ray of a pixel; `None` where the model is not valid.
    #[must_use]
    pub fn ray(&self, pixel: [f64; 2]) -> Option<LensRay> {
        let ray = match self {
            Lens::Brown(m) => m.ray(pixel),
            Lens::Cahv(m) => Some(LensRay { origin: m.c, direction: m.line(pixel).normalize() }),
            Lens::Cahvor(m) => m.ray(pixel),
            Lens::Cahvore(m) => m.ray(pixel),
        };
        ray.filter(|r| r.origin.iter().chain(r.direction.iter()).all(|v| v.is_finite()))
    }

    /// Returns the pixel of a point in the camera's frame C, m; `None` behind the camera and where the model is not valid.
    #[must_use]
    pub fn project(&self, p_C: &Vec3) -> Option<[f64; 2]> {
        let at = match self {
            Lens::Brown(m) => m.project(p_C),
            Lens::Cahv(m) => m.image(&(p_C - m.c)),
            Lens::Cahvor(m) => m.project(p_C),
            Lens::Cahvore(m) => m.project(p_C),
        };
        at.filter(|p| p.iter().all(|v| v.is_finite()))
    }

    /// Returns the centre of projection and the unit axis along which depth is measured, both in C.
    #[must_use]
    pub fn axis(&self) -> (Vec3, Vec3) {
        match self {
            Lens::Brown(_) => (Vec3::zeros(), Vec3::z()),
            Lens::Cahv(m) => (m.c, m.a),
            Lens::Cahvor(m) => (m.cahv.c, m.cahv.a),
            Lens::Cahvore(m) => (m.cahvor.cahv.c, m.cahvor.cahv.a),
        }
    }

    /// Checks the parameters of the model.
    ///
    /// # Errors
    /// Numbers that are not finite, axes that are not unit vectors, vectors that do not define an image.
    pub fn check(&self) -> Result<(), RenderError> {
        let vectors = |m: &Cahv, o: Option<&Vec3>, rest: &[f64]| {
            let all = m.c.iter().chain(m.a.iter()).chain(m.h.iter()).chain(m.v.iter());
            for v in all.chain(o.into_iter().flat_map(|o| o.iter())).chain(rest) {
                number("a number of the camera model", *v, |_| true, "it must be finite")?;
            }
            for (name, v) in [("A", Some(&m.a)), ("O", o)] {
                if let Some(v) = v.filter(|v| (v.norm() - 1.0).abs() > 1e-6) {
                    let fact = format!("{name} has the length {}", v.norm());
                    return Err(RenderError::Lens { fact, help: "A and O are unit vectors" });
                }
            }
            let volume = m.a.dot(&m.h.cross(&m.v));
            if !(volume > 1e-9 * m.h.norm() * m.v.norm()) {
                let fact = "A, H and V are in one plane, or left-handed".to_string();
                return Err(RenderError::Lens {
                    fact,
                    help: "choose them so that A · (H × V) is positive: x to the right, y down",
                });
            }
            Ok(())
        };
        match self {
            Lens::Brown(m) => {
                for f in m.focal {
                    number("focal length (pixels)", f, |f| f > 0.0, "it must be positive")?;
                }
                let rest = m.centre.iter().chain(&m.radial).chain(&m.tangential);
                let mut rest = rest.copied();
                rest.try_for_each(|v| {
                    number("a number of the lens", v, |_| true, "it must be finite")
                })
            }
            Lens::Cahv(m) => vectors(m, None, &[]),
            Lens::Cahvor(m) => vectors(&m.cahv, Some(&m.o), &m.r),
            Lens::Cahvore(m) => {
                number("linearity", m.linearity, |l| l.abs() <= 1.0, "it must be from -1 to 1")?;
                let rest: Vec<f64> = m.cahvor.r.iter().chain(&m.e).copied().collect();
                vectors(&m.cahvor.cahv, Some(&m.cahvor.o), &rest)
            }
        }
    }
}

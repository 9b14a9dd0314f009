//! SPK segments of orbits about one centre: discrete states with two-body motion between them (type 5), and equinoctial elements with constant rates
//! (type 17: moons).
//!
//! NAIF, *SPK Required Reading*:
//! ```text
//! 5    N states of 6 numbers, N epochs, a directory of every hundredth epoch, GM (km³/s²), N
//!      x = w x₁ + (1 − w) x₂,  w = ½ + ½ cos(π (t − t₁) / (t₂ − t₁))       x₁, x₂: two-body motion from the states around t
//! 17   epoch, a, h, k, λ, p, q, ϖ̇, λ̇, Ω̇, right ascension and declination of the pole of the reference plane
//!      h = e sin ϖ, k = e cos ϖ, p = tan(i/2) sin Ω, q = tan(i/2) cos Ω      ϖ = Ω + ω, mean longitude λ = ϖ + M
//! ```
//! Both give the derivative of the position as the velocity. x of the reference plane is the direction of pole × Z, turned to the ascending node of
//! the plane on the equator.

use crate::orbit::propagate;
use crate::planet::PointMotion;
use linkwork_spatial::{Mat3, Vec3};
use std::f64::consts::{PI, TAU};

/// Type 5.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Discrete {
    /// TDB seconds past J2000.
    epochs: Vec<f64>,
    /// Positions (km) and velocities (km/s).
    states: Vec<PointMotion>,
    /// GM, km³/s².
    mu: f64,
}

impl Discrete {
    /// Reads the words of a segment. The error is the fact.
    pub(super) fn read(words: &[f64]) -> Result<Self, String> {
        let (count, mu) = (words[words.len() - 1] as usize, words[words.len() - 2]);
        let epochs = count.saturating_sub(1) / 100;
        let length = count.checked_mul(7).and_then(|n| n.checked_add(epochs + 2));
        if count == 0 || length != Some(words.len()) {
            return Err(format!("{count} states do not match its length"));
        }
        if !(mu > 0.0 && mu.is_finite()) {
            return Err(format!("its GM is {mu} km³/s²"));
        }
        let epochs = words[6 * count..7 * count].to_vec();
        if !epochs.windows(2).all(|w| w[0] < w[1]) {
            return Err("its epochs are not strictly increasing".into());
        }
        let state = |s: &[f64]| PointMotion {
            position: Vec3::new(s[0], s[1], s[2]),
            velocity: Vec3::new(s[3], s[4], s[5]),
        };
        let states: Vec<PointMotion> = words[..6 * count].chunks_exact(6).map(state).collect();
        // Report states without a two-body motion here, because a query cannot return an error.
        let moves = |s: &PointMotion| propagate(mu, s, 1.0).is_ok();
        match states.iter().position(|s| !moves(s)) {
            Some(k) => Err(format!("its state {} has no two-body motion", k + 1)),
            None => Ok(Self { epochs, states, mu }),
        }
    }

    /// Returns position (km) and velocity (km/s).
    pub(super) fn at(&self, et: f64) -> [Vec3; 2] {
        let n = self.epochs.len();
        let above = self.epochs.partition_point(|e| *e <= et).min(n - 1);
        // The state of the first epoch is used before it, and the state of the last epoch after it.
        let low = if self.epochs[above] <= et { above } else { above.saturating_sub(1) };
        let from = |k: usize| {
            let moved = propagate(self.mu, &self.states[k], et - self.epochs[k]);
            moved.map_or([Vec3::repeat(f64::NAN); 2], |m| [m.position, m.velocity])
        };
        let [p1, v1] = from(low);
        if low == above {
            return [p1, v1];
        }
        let [p2, v2] = from(above);
        let length = self.epochs[above] - self.epochs[low];
        let (sin, cos) = (PI * (et - self.epochs[low]) / length).sin_cos();
        let (w, rate) = (0.5 + 0.5 * cos, -0.5 * sin * PI / length);
        [p2 + (p1 - p2) * w, v2 + (v1 - v2) * w + (p1 - p2) * rate]
    }
}

/// Type 17.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Equinoctial {
    epoch: f64,
    /// a (km), h, k, λ, p, q.
    elements: [f64; 6],
    /// ϖ̇, λ̇, Ω̇, rad/s.
    rates: [f64; 3],
    /// Columns: axes of the reference plane.
    axes: Mat3,
}

impl Equinoctial {
    /// Reads the words of a segment. The error is the fact.
    pub(super) fn read(words: &[f64]) -> Result<Self, String> {
        let Ok([epoch, a, h, k, l, p, q, apsis, mean, node, ra, dec]) =
            <[f64; 12]>::try_from(words)
        else {
            return Err(format!("{} numbers instead of 12", words.len()));
        };
        let square = h * h + k * k;
        if !(a > 0.0 && square < 1.0 && mean != 0.0 && words.iter().all(|x| x.is_finite())) {
            let e = square.sqrt();
            return Err(format!(
                "semi-major axis {a} km, eccentricity {e}, mean motion {mean} rad/s"
            ));
        }
        let ((sa, ca), (sd, cd)) = (ra.sin_cos(), dec.sin_cos());
        let axes = Mat3::new(-sa, -ca * sd, ca * cd, ca, -sa * sd, sa * cd, 0.0, cd, sd);
        let (elements, rates) = ([a, h, k, l, p, q], [apsis, mean, node]);
        Ok(Self { epoch, elements, rates, axes })
    }

    /// Returns position (km) and velocity (km/s).
    pub(super) fn at(&self, et: f64) -> [Vec3; 2] {
        let ([a, h0, k0, l0, p0, q0], [apsis, mean, node]) = (self.elements, self.rates);
        let dt = et - self.epoch;
        let turned = |x: f64, y: f64, angle: f64| {
            let (s, c) = angle.sin_cos();
            (x * c + y * s, y * c - x * s)
        };
        let (h, k) = turned(h0, k0, dt * apsis);
        let (p, q) = turned(p0, q0, dt * node);
        let F = longitude(l0 + (dt * mean) % TAU, h, k);
        let (sin, cos) = F.sin_cos();
        let b = 1.0 / (1.0 + (1.0 - h * h - k * k).sqrt());
        let x = a * ((1.0 - b * h * h) * cos + (h * k * b * sin - k));
        let y = a * ((1.0 - b * k * k) * sin + (h * k * b * cos - h));
        // Differentiate: the mean anomaly moves the body along the orbit, and the precession of the
        // line of apsides rotates it.
        let rb = h * sin + k * cos;
        let speed = (mean - apsis) * a / (1.0 - rb);
        let dx = speed * (h * b * rb - sin) - apsis * y;
        let dy = speed * (cos - k * b * rb) + apsis * x;
        let scale = 1.0 / (1.0 + p * p + q * q);
        let f = Vec3::new(1.0 - p * p + q * q, 2.0 * p * q, -2.0 * p) * scale;
        let g = Vec3::new(2.0 * p * q, 1.0 + p * p - q * q, 2.0 * q) * scale;
        let position = f * x + g * y;
        // With the node, f and g rotate about the pole, and by the opposite rate about the normal
        // of the orbit.
        let turn = (Vec3::z() - f.cross(&g)) * node;
        let velocity = f * dx + g * dy + turn.cross(&position);
        [self.axes * position, self.axes * velocity]
    }
}

/// Solves λ = F + h cos F − k sin F by Newton's method.
fn longitude(mean: f64, h: f64, k: f64) -> f64 {
    let mut F = mean;
    for _ in 0..50 {
        let (s, c) = F.sin_cos();
        let step = (F + h * c - k * s - mean) / (1.0 - h * s - k * c);
        F -= step;
        if step.abs() < 1e-15 * (1.0 + F.abs()) {
            break;
        }
    }
    F
}

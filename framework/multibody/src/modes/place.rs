//! Finds the station or cross-section that carries a frame on a flexible body.
//!
//! Beam, between stations a and b, h apart, s = (x − x_a)/h:
//! ```text
//! y: Hermite cubic of y and slope θ_z        z: of z and slope −θ_y        G: of G and φ_i'·φ_j'
//! θ_z = y',  θ_y = −z'                       x, θ_x: Lagrange cubics of the four nearest stations
//! ```
//! This is exact for the finite elements of [`Beam`](crate::Beam), whose nodes are stations.

use super::{Attachment, Modes, Shortening, Station};
use linkwork_spatial::{MassProperties, Pose, Quat, Vec3};
use thiserror::Error;

/// The carrier of a frame on a flexible body, and the pose of the frame on it.
#[derive(Clone, Debug, PartialEq)]
pub enum Carrier {
    /// A station of the body.
    Station {
        /// Index of the station.
        station: usize,
        /// The frame in the station's frame.
        pose: Pose,
    },
    /// A cross-section between two stations.
    Between {
        /// The cross-section, as a station without mass in the body's axes.
        station: Box<Station>,
        /// The frame in the frame of the cross-section.
        pose: Pose,
    },
}

/// Reason why no station carries a frame.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum AttachmentFault {
    /// No station is near enough.
    #[error(
        "the nearest station is {distance} m away, beyond the tolerance of {tolerance} m\n  help: move \
         the frame to a station, add a station there, or raise the tolerance"
    )]
    Far {
        /// Distance, m.
        distance: f64,
        /// Tolerance, m.
        tolerance: f64,
    },
    /// The frame is not between the ends of the beam.
    #[error(
        "x = {x} m is not on the beam, whose stations reach from {from} to {to} m\n  help: place the \
         frame between them, or add a station"
    )]
    OffBeam {
        /// Position, m.
        x: f64,
        /// Start of the stations, m.
        from: f64,
        /// End of the stations, m.
        to: f64,
    },
}

impl Modes {
    /// Finds the carrier of the frame `X` (given in the undeformed body), and the pose on it. Assumes valid modes. O(stations).
    ///
    /// # Errors
    /// [`AttachmentFault`] if no station is near, or if the frame is beyond the ends of the beam.
    pub fn place(&self, X: &Pose) -> Result<Carrier, AttachmentFault> {
        match self.attachment {
            Attachment::Nearest { tolerance } => self.nearest(X, tolerance),
            Attachment::Beam => self.on_beam(X),
        }
    }

    /// Returns the pose in the body frame, at modal coordinates η, of the frame `X` of the undeformed body. Returns `X` itself if no station carries
    /// it.
    pub(crate) fn carried(&self, X: &Pose, eta: &[f64]) -> Pose {
        match self.place(X) {
            Ok(Carrier::Station { station, pose }) => self.stations[station].moved(eta) * pose,
            Ok(Carrier::Between { station, pose }) => station.moved(eta) * pose,
            Err(_) => *X,
        }
    }

    fn on_station(&self, station: usize, X: &Pose) -> Carrier {
        Carrier::Station { station, pose: self.stations[station].pose.inverse() * *X }
    }

    fn nearest(&self, X: &Pose, tolerance: f64) -> Result<Carrier, AttachmentFault> {
        let distance = |i: usize| (self.stations[i].pose.position - X.position).norm();
        let near = (0..self.stations.len()).min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        match near {
            Some(i) if distance(i) <= tolerance => Ok(self.on_station(i, X)),
            _ => {
                let distance = near.map_or(f64::INFINITY, distance);
                Err(AttachmentFault::Far { distance, tolerance })
            }
        }
    }

    fn on_beam(&self, X: &Pose) -> Result<Carrier, AttachmentFault> {
        let at = |i: usize| self.stations[i].pose.position.x;
        let mut order: Vec<usize> = (0..self.stations.len()).collect();
        order.sort_by(|a, b| at(*a).total_cmp(&at(*b)));
        let (Some(first), Some(last)) = (order.first(), order.last()) else {
            return Err(AttachmentFault::Far { distance: f64::INFINITY, tolerance: 0.0 });
        };
        let (x, from, to) = (X.position.x, at(*first), at(*last));
        let slack = 1e-9 * (to - from);
        if !(x >= from - slack && x <= to + slack) {
            return Err(AttachmentFault::OffBeam { x, from, to });
        }
        if let Some(i) = order.iter().find(|i| (at(**i) - x).abs() <= slack) {
            return Ok(self.on_station(*i, X));
        }
        let right = order.partition_point(|i| at(*i) < x).clamp(1, order.len() - 1);
        let start = right.saturating_sub(2).min(order.len().saturating_sub(4));
        let four = &order[start..(start + 4).min(order.len())];
        let station = self.between(order[right - 1], order[right], four, x);
        let pose = station.pose.inverse() * *X;
        Ok(Carrier::Between { station: Box::new(station), pose })
    }

    /// Returns the cross-section at x between stations a and b.
    fn between(&self, a: usize, b: usize, four: &[usize], x: f64) -> Station {
        let n = self.count();
        let (a, b) = (&self.stations[a], &self.stations[b]);
        let (x0, h) = (a.pose.position.x, b.pose.position.x - a.pose.position.x);
        let cubic = Cubic::new((x - x0) / h, h);
        let turn = |s: &Station, i: usize| s.rotation.get(i).copied().unwrap_or_default();
        let slope = |s: &Station, i: usize| Vec3::new(0.0, turn(s, i).z, -turn(s, i).y);
        let weights = lagrange(four.iter().map(|i| self.stations[*i].pose.position.x), x);
        let smooth = |of: &dyn Fn(&Station) -> f64| -> f64 {
            four.iter().zip(&weights).map(|(i, w)| w * of(&self.stations[*i])).sum()
        };
        let (mut translation, mut rotation) = (Vec::new(), Vec::new());
        for i in 0..n {
            let ends = [a.translation[i], b.translation[i]];
            let (p, d) = cubic.of(&ends, &[slope(a, i), slope(b, i)]);
            translation.push(Vec3::new(smooth(&|s| s.translation[i].x), p.y, p.z));
            rotation.push(Vec3::new(smooth(&|s| turn(s, i).x), -d.z, d.y));
        }
        let shortening = a.shortening.as_ref().zip(b.shortening.as_ref()).map(|(ga, gb)| {
            let entry = |i: usize, j: usize| {
                let rate = |s: &Station| Vec3::x() * slope(s, i).dot(&slope(s, j));
                let ends = [Vec3::x() * ga.matrix[i * n + j], Vec3::x() * gb.matrix[i * n + j]];
                cubic.of(&ends, &[rate(a), rate(b)]).0.x
            };
            let matrix = (0..n * n).map(|k| entry(k / n, k % n)).collect();
            Shortening { axis: ga.axis, matrix }
        });
        Station {
            pose: Pose::translation(x, 0.0, 0.0),
            mass: MassProperties::massless(),
            translation,
            rotation,
            shortening,
        }
    }
}

impl Station {
    /// Returns the pose of the station in the body frame at modal coordinates η, by the equations of the module.
    #[must_use]
    pub fn moved(&self, eta: &[f64]) -> Pose {
        let sum = |all: &[Vec3]| all.iter().zip(eta).map(|(v, x)| v * *x).sum::<Vec3>();
        let mut p = self.pose.position + sum(&self.translation);
        if let Some(g) = &self.shortening {
            let n = eta.len();
            let twice: f64 = (0..n * n).map(|k| eta[k / n] * g.matrix[k] * eta[k % n]).sum();
            p -= g.axis * (0.5 * twice);
        }
        Pose::new(Quat::from_scaled_axis(sum(&self.rotation)) * self.pose.rotation, p)
    }
}

/// The Hermite cubic on 0 … h at one point: weights of the end values and end slopes, for value and slope.
pub(super) struct Cubic {
    value: [f64; 4],
    slope: [f64; 4],
    curve: [f64; 4],
}

impl Cubic {
    /// Computes the weights at `s` from 0 to 1.
    pub fn new(s: f64, h: f64) -> Self {
        Self {
            value: [
                1.0 - s * s * (3.0 - 2.0 * s),
                s * s * (3.0 - 2.0 * s),
                h * s * (1.0 - s) * (1.0 - s),
                -h * s * s * (1.0 - s),
            ],
            slope: [
                -6.0 * s * (1.0 - s) / h,
                6.0 * s * (1.0 - s) / h,
                (1.0 - s) * (1.0 - 3.0 * s),
                s * (3.0 * s - 2.0),
            ],
            curve: [
                (12.0 * s - 6.0) / (h * h),
                (6.0 - 12.0 * s) / (h * h),
                (6.0 * s - 4.0) / h,
                (6.0 * s - 2.0) / h,
            ],
        }
    }

    /// Returns value and slope from the values and slopes at both ends.
    fn of(&self, ends: &[Vec3; 2], slopes: &[Vec3; 2]) -> (Vec3, Vec3) {
        let sum =
            |w: &[f64; 4]| ends[0] * w[0] + ends[1] * w[1] + slopes[0] * w[2] + slopes[1] * w[3];
        (sum(&self.value), sum(&self.slope))
    }

    /// Returns the weights of value, slope and curvature, in the order of an element's unknowns (value, slope, value, slope).
    pub fn weights(&self) -> [[f64; 4]; 3] {
        [self.value, self.slope, self.curve].map(|w| [w[0], w[2], w[1], w[3]])
    }
}

/// Returns the weights, at x, of the values at `places` for the polynomial through them.
fn lagrange(places: impl Iterator<Item = f64>, x: f64) -> Vec<f64> {
    let places: Vec<f64> = places.collect();
    let weight = |(i, a): (usize, &f64)| {
        let others = places.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, b)| (x - b) / (a - b)).product()
    };
    places.iter().enumerate().map(weight).collect()
}

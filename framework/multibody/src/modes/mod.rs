//! Flexible bodies with assumed modes.
//!
//! A flexible body is a body frame, carried by the hinge as for any other body, and *stations*: points of the undeformed body that the modal
//! coordinates η displace. In body axes:
//! ```text
//! p(η) = p₀ + Φ_t η − ½ x̂ ηᵀ G η       Φ_t: `translation`;  x̂, G: `shortening`, if any
//! R(η) = exp(Φ_r η) R₀                 Φ_r: `rotation`, as rotation vectors
//! ```
//! Stations carry all the mass that deforms. Modal mass and all coupling terms follow from the motion of the stations, so you give no shape
//! integrals. The dynamics includes the modal forces −K η − C η̇.
//!
//! A child hinge or node on the body is attached to a station, chosen by [`Attachment`]. The model is for small strain: shapes are constant, and the
//! only second-order terms are `shortening` and exp.

mod beam;
mod check;
mod eigen;
mod place;
mod plate;
mod validate;

pub use beam::{Beam, BeamModes, Ends};
pub use place::{AttachmentFault, Carrier};
pub use plate::Plate;
pub use validate::{GeneratorFault, ModesFault};

use linkwork_spatial::{MassProperties, Pose, Vec3};
use serde::{Deserialize, Serialize};

/// Modes of a flexible body, from a generator ([`Beam`], [`Plate`]) or from a file: this structure in RON, JSON or any other serde format.
///
/// ```ron
/// (
///     stiffness: [1.2e4, 3.0e5],                  // diagonal, or all n × n numbers
///     damping: [0.8, 5.0],                        // the same; may be left out
///     attachment: Nearest(tolerance: 0.002),
///     stations: [
///         (   pose: (position: (0.5, 0, 0), rotation: (0, 0, 0, 1)),
///             mass: (mass: 0.3, com: (0, 0, 0), inertia_com: (0, 0, 0, 0, 0, 0, 0, 0, 0)),
///             translation: [(0, 0.34, 0), (0, -0.71, 0)],       // one vector a mode
///             rotation: [(0, 0, 1.1), (0, 0, -0.2)],            // the same; may be left out
///         ),
///     ],
/// )
/// ```
/// (Vectors and poses have the serde form of the spatial crate.)
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Modes {
    /// K: n numbers (diagonal) or n × n, row by row. Modal coordinates have the unit that gives metres for `translation` times η; K η then has the
    /// dual unit.
    pub stiffness: Vec<f64>,
    /// C, with the layout of `stiffness`; empty for none.
    #[serde(default)]
    pub damping: Vec<f64>,
    /// Points with mass, and points where other bodies or nodes may be attached.
    pub stations: Vec<Station>,
    /// Rule by which a frame attached to the body is assigned to a station.
    #[serde(default)]
    pub attachment: Attachment,
}

/// A point of the undeformed body, and its motion in each mode.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Station {
    /// Pose of the station in the undeformed body, body frame.
    #[serde(default)]
    pub pose: Pose,
    /// Mass that moves with the station, in the station's own frame: a slice, or a node of a mesh.
    #[serde(default)]
    pub mass: MassProperties,
    /// Φ_t: one vector for each mode, body axes, m per unit of η.
    pub translation: Vec<Vec3>,
    /// Φ_r: one rotation vector for each mode, body axes, rad per unit of η; empty for none.
    #[serde(default)]
    pub rotation: Vec<Vec3>,
    /// Loss of length between body frame and station due to deflection; none if omitted.
    #[serde(default)]
    pub shortening: Option<Shortening>,
}

/// Foreshortening: −½ x̂ ηᵀ G η. It gives the stiffening of a spinning beam (Kane, Ryan and Banerjee 1987). Without it, the beam softens and becomes
/// unstable at high speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shortening {
    /// x̂: unit vector along the undeformed body, away from its frame.
    pub axis: Vec3,
    /// G = ∫ φ_i'·φ_j' dx from the body frame to the station, n × n, row by row, symmetric; unit: 1/m times the units of η.
    pub matrix: Vec<f64>,
}

/// Rule by which a child's hinge frame or a node is assigned to the station that carries it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Attachment {
    /// Rigidly attached to the nearest station; an error if that is farther than `tolerance`.
    Nearest {
        /// Largest distance, m.
        tolerance: f64,
    },
    /// The stations lie on the body's x axis, which bends as a beam. The frame is rigidly attached to the cross-section at its own x, between two
    /// stations. Deflections are cubics of values and slopes; stretch and twist are cubics through four stations. A position beyond the outermost
    /// stations is an error.
    Beam,
}

impl Default for Attachment {
    /// Nearest station, within 1 mm.
    fn default() -> Self {
        Self::Nearest { tolerance: 1e-3 }
    }
}

impl Modes {
    /// Returns the number of modes n, which is the number of vectors of the first station.
    #[must_use]
    pub fn count(&self) -> usize {
        self.stations.first().map_or(0, |s| s.translation.len())
    }

    /// Returns K, n × n, row by row.
    #[must_use]
    pub fn stiffness_matrix(&self) -> Vec<f64> {
        square(&self.stiffness, self.count())
    }

    /// Returns C, n × n, row by row.
    #[must_use]
    pub fn damping_matrix(&self) -> Vec<f64> {
        square(&self.damping, self.count())
    }

    /// Returns the mass of all stations, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.stations.iter().map(|s| s.mass.mass).sum()
    }

    /// Computes the modal mass matrix of the undeformed body with its frame fixed, n × n, row by row: Σ Φᵀ M Φ over the stations. It is diagonal if
    /// the modes are orthogonal, which is not required.
    #[must_use]
    pub fn mass_matrix(&self) -> Vec<f64> {
        let n = self.count();
        let mut M = vec![0.0; n * n];
        for s in &self.stations {
            let R = s.pose.rotation.to_rotation_matrix().into_inner();
            let (c, J) = (R * s.mass.com, R * s.mass.inertia_com * R.transpose());
            let turn = |i: usize| s.rotation.get(i).copied().unwrap_or_default();
            // Compute the velocity of the centre of mass and the angular velocity for a unit of
            // each rate.
            let v: Vec<Vec3> = (0..n).map(|i| s.translation[i] + turn(i).cross(&c)).collect();
            for i in 0..n {
                for j in 0..n {
                    M[i * n + j] += s.mass.mass * v[i].dot(&v[j]) + turn(i).dot(&(J * turn(j)));
                }
            }
        }
        M
    }

    /// Returns the modes with modal damping ratio ζ for each: C = 2 ζ √(K M) on the diagonal, exact for orthogonal modes.
    #[must_use]
    pub fn with_damping_ratio(mut self, ratio: f64) -> Self {
        let (n, K, M) = (self.count(), self.stiffness_matrix(), self.mass_matrix());
        let diagonal = |A: &[f64], i: usize| A[i * n + i].max(0.0);
        self.damping =
            (0..n).map(|i| 2.0 * ratio * (diagonal(&K, i) * diagonal(&M, i)).sqrt()).collect();
        self
    }
}

/// Returns an n × n matrix from an empty list, a diagonal, or all elements.
fn square(given: &[f64], n: usize) -> Vec<f64> {
    if given.len() == n * n {
        return given.to_vec();
    }
    let mut all = vec![0.0; n * n];
    for (i, x) in given.iter().enumerate().take(n) {
        all[i * n + i] = *x;
    }
    all
}

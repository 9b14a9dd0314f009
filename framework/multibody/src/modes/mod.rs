//! Flexible bodies by assumed modes: what a body adds to its frame when it bends.
//!
//! A flexible body is a body frame, carried by the hinge as that of any other body, and *stations*:
//! places of the undeformed body that the modal coordinates η move. In body axes:
//! ```text
//! p(η) = p₀ + Φ_t η − ½ x̂ ηᵀ G η       Φ_t: `translation`;  x̂, G: `shortening`, if any
//! R(η) = exp(Φ_r η) R₀                 Φ_r: `rotation`, as rotation vectors
//! ```
//! Stations carry all mass that bends, so modal mass and every coupling follow from the stations'
//! motion and no shape integrals are given. Forces on η: −K η − C η̇, inside the dynamics.
//!
//! What hangs on the body hangs on a station: [`Attachment`] says on which. A model of small strain:
//! shapes are constant, and second-order terms are those of `shortening` and of exp alone.

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

/// The modes of a flexible body, as from a generator ([`Beam`], [`Plate`]) or from a file: this
/// structure itself in RON, JSON or any other format of serde.
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
/// (Vectors and poses as serde writes those of the spatial crate.)
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Modes {
    /// K: n numbers (diagonal) or n × n, row after row. Modal coordinates have the unit that makes
    /// `translation` times η metres; K η is then in their dual.
    pub stiffness: Vec<f64>,
    /// C: as `stiffness`; empty for none.
    #[serde(default)]
    pub damping: Vec<f64>,
    /// Where mass is, and where other things may hang.
    pub stations: Vec<Station>,
    /// How a frame that hangs on the body finds its station.
    #[serde(default)]
    pub attachment: Attachment,
}

/// A place on the undeformed body, and how each mode moves it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Station {
    /// The station in the undeformed body, body frame.
    #[serde(default)]
    pub pose: Pose,
    /// What moves with it, in the station's own frame: a slice, or a node of a mesh.
    #[serde(default)]
    pub mass: MassProperties,
    /// Φ_t: one vector for each mode, body axes, m per unit of η.
    pub translation: Vec<Vec3>,
    /// Φ_r: one rotation vector for each mode, body axes, rad per unit of η; empty for none.
    #[serde(default)]
    pub rotation: Vec<Vec3>,
    /// What deflection takes from the length between body frame and station; none when left out.
    #[serde(default)]
    pub shortening: Option<Shortening>,
}

/// Foreshortening: −½ x̂ ηᵀ G η. With it a spinning beam stiffens as it must (Kane, Ryan and
/// Banerjee 1987); without it it softens, and gives way at high speed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shortening {
    /// x̂: along the undeformed body, away from its frame; of unit length.
    pub axis: Vec3,
    /// G = ∫ φ_i'·φ_j' dx from the body frame to the station, n × n, row after row, symmetric;
    /// 1/m times units of η.
    pub matrix: Vec<f64>,
}

/// How a child's hinge frame, or a node, finds the station that carries it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Attachment {
    /// The nearest station, as if glued to it; refused when that is farther than `tolerance`.
    Nearest {
        /// m.
        tolerance: f64,
    },
    /// The stations lie on the body's x axis, which bends as a beam: the frame is glued to the cross-section
    /// at its own x, between two stations. Deflections by cubics from values and slopes, stretch and
    /// twist by cubics through four stations. Refused beyond the outermost stations.
    Beam,
}

impl Default for Attachment {
    /// Nearest, within 1 mm.
    fn default() -> Self {
        Self::Nearest { tolerance: 1e-3 }
    }
}

impl Modes {
    /// Number of modes, n: as many as the first station has vectors.
    #[must_use]
    pub fn count(&self) -> usize {
        self.stations.first().map_or(0, |s| s.translation.len())
    }

    /// K, n × n, row after row.
    #[must_use]
    pub fn stiffness_matrix(&self) -> Vec<f64> {
        square(&self.stiffness, self.count())
    }

    /// C, n × n, row after row.
    #[must_use]
    pub fn damping_matrix(&self) -> Vec<f64> {
        square(&self.damping, self.count())
    }

    /// Mass of all stations, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.stations.iter().map(|s| s.mass.mass).sum()
    }

    /// The modal mass matrix of the undeformed body with its frame held, n × n, row after row:
    /// Σ Φᵀ M Φ over the stations. Diagonal when the modes are orthogonal, which they need not be.
    #[must_use]
    pub fn mass_matrix(&self) -> Vec<f64> {
        let n = self.count();
        let mut M = vec![0.0; n * n];
        for s in &self.stations {
            let R = s.pose.rotation.to_rotation_matrix().into_inner();
            let (c, J) = (R * s.mass.com, R * s.mass.inertia_com * R.transpose());
            let turn = |i: usize| s.rotation.get(i).copied().unwrap_or_default();
            // Velocity of the centre of mass, and rate of turning, for a unit of each rate.
            let v: Vec<Vec3> = (0..n).map(|i| s.translation[i] + turn(i).cross(&c)).collect();
            for i in 0..n {
                for j in 0..n {
                    M[i * n + j] += s.mass.mass * v[i].dot(&v[j]) + turn(i).dot(&(J * turn(j)));
                }
            }
        }
        M
    }

    /// The same modes with modal damping ζ for each: C = 2 ζ √(K M) on the diagonal, exact for
    /// orthogonal modes.
    #[must_use]
    pub fn with_damping_ratio(mut self, ratio: f64) -> Self {
        let (n, K, M) = (self.count(), self.stiffness_matrix(), self.mass_matrix());
        let diagonal = |A: &[f64], i: usize| A[i * n + i].max(0.0);
        self.damping =
            (0..n).map(|i| 2.0 * ratio * (diagonal(&K, i) * diagonal(&M, i)).sqrt()).collect();
        self
    }
}

/// n × n of what was given: nothing, a diagonal, or all.
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

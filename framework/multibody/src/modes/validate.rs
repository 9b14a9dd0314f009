//! Faults of modes, and of the parameters of mode generators.
//!
//! Modes need not be orthogonal, because the dynamics uses the full modal mass matrix. They must be independent (M positive definite), and K and C
//! must not add energy (positive semidefinite).

use super::eigen::least;
use super::{Attachment, Modes};
use linkwork_spatial::InertiaError;
use thiserror::Error;

/// Modes count as independent if the smallest eigenvalue of the modal mass matrix, scaled to a unit diagonal, is at least this.
const INDEPENDENT: f64 = 1e-10;

/// A fault of modes.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ModesFault {
    /// The list of stations is empty.
    #[error("no stations\n  help: give at least one, with mass")]
    NoStations,
    /// The length of a list does not match the number of modes.
    #[error(
        "{place}: {got} numbers or vectors, but {modes} modes need {want}\n  help: the first station's `translation` \
        defines the number of modes"
    )]
    Length {
        /// Location.
        place: String,
        /// Number given.
        got: usize,
        /// Number of modes.
        modes: usize,
        /// Required length, in words.
        want: String,
    },
    /// A number that is NaN or infinite.
    #[error("{place}: a number is NaN or infinite\n  help: give finite numbers")]
    NotFinite {
        /// Location.
        place: String,
    },
    /// A matrix is not symmetric.
    #[error("{place}: not symmetric, mirrored entries differ by {by}\n  help: give (A + Aᵀ)/2")]
    NotSymmetric {
        /// Location.
        place: String,
        /// Largest difference.
        by: f64,
    },
    /// A stiffness or damping matrix would add energy.
    #[error(
        "{place}: the smallest eigenvalue is {eigenvalue}, mostly of mode {mode} (from 0)\n  help: it must not be \
         negative; check signs, and remove modes of negative stiffness"
    )]
    Negative {
        /// Location.
        place: String,
        /// The eigenvalue.
        eigenvalue: f64,
        /// The mode with the largest component in the eigenvector.
        mode: usize,
    },
    /// Two modes are the same motion of the mass, or one moves no mass.
    #[error(
        "modes are not independent: the motion of all masses in mode {mode} (from 0) is a combination of other modes \
        (smallest eigenvalue of the scaled modal mass matrix {eigenvalue})\n  help: remove it, or add mass to the \
        stations that it moves; orthogonality is not needed"
    )]
    Dependent {
        /// The mode with the largest component in the eigenvector.
        mode: usize,
        /// Measure of independence, 0 … 1.
        eigenvalue: f64,
    },
    /// Invalid mass properties of a station.
    #[error(
        "station {station}: {error}\n  help: correct `mass` of the station; it is in the station's own frame"
    )]
    Inertia {
        /// Index of the station, from 0.
        station: usize,
        /// Fault.
        error: InertiaError,
    },
    /// The axis of shortening is not of unit length.
    #[error(
        "station {station}: the axis of `shortening` has length {length}\n  help: give a unit vector"
    )]
    Axis {
        /// Index of the station, from 0.
        station: usize,
        /// Its length.
        length: f64,
    },
    /// The stations do not form a beam, or the tolerance is invalid.
    #[error("attachment: {fact}\n  help: {help}")]
    Attachment {
        /// Fact.
        fact: String,
        /// Remedy.
        help: &'static str,
    },
}

/// A fault of the parameters of a generator.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum GeneratorFault {
    /// A number that must be positive is not.
    #[error("{what}: `{name}` is {value}\n  help: it must be finite and > 0")]
    NotPositive {
        /// Beam or plate.
        what: &'static str,
        /// The parameter.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A damping ratio that is negative or not finite.
    #[error("{what}: `damping_ratio` is {ratio}\n  help: it must be finite and ≥ 0")]
    Damping {
        /// Beam or plate.
        what: &'static str,
        /// Its value.
        ratio: f64,
    },
    /// A Poisson's ratio is impossible for an isotropic solid.
    #[error("plate: `poisson` is {value}\n  help: it must be above −1 and below 0.5")]
    Poisson {
        /// Its value.
        value: f64,
    },
    /// More modes than the series resolves.
    #[error("{what}: {wanted} modes of one kind requested\n  help: at most {most} are accurate")]
    TooMany {
        /// Beam or plate.
        what: &'static str,
        /// Number requested.
        wanted: usize,
        /// Maximum.
        most: usize,
    },
    /// A point is not on the plate.
    #[error("plate: [{}, {}] is not on it\n  help: 0 ≤ x ≤ length, |y| ≤ width/2", at[0], at[1])]
    OffPlate {
        /// x, y, m.
        at: [f64; 2],
    },
    /// The eigenvalue problem has no solution in double precision.
    #[error(
        "{what}: no modes found\n  help: parameters differ by too many orders of magnitude; check their \
         units"
    )]
    NoModes {
        /// Beam or plate.
        what: &'static str,
    },
}

impl GeneratorFault {
    /// Returns the faults of numbers that must be positive.
    pub(super) fn positive(what: &'static str, numbers: &[(&'static str, f64)]) -> Vec<Self> {
        let bad = numbers.iter().filter(|(_, x)| !(x.is_finite() && *x > 0.0));
        bad.map(|(name, value)| Self::NotPositive { what, name, value: *value }).collect()
    }
}

impl Modes {
    /// Checks every property that the dynamics relies on. O(stations × modes²).
    ///
    /// # Errors
    /// All [`ModesFault`]s found. Later kinds of fault are checked only if earlier ones do not make them meaningless.
    pub fn validate(&self) -> Result<(), Vec<ModesFault>> {
        let mut faults = Vec::new();
        if self.stations.is_empty() {
            faults.push(ModesFault::NoStations);
        }
        self.check_lengths(&mut faults);
        self.check_stations(&mut faults);
        if faults.is_empty() {
            self.check_attachment(&mut faults);
            self.check_matrix("stiffness", &self.stiffness_matrix(), &mut faults);
            self.check_matrix("damping", &self.damping_matrix(), &mut faults);
            self.check_mass(&mut faults);
        }
        if faults.is_empty() { Ok(()) } else { Err(faults) }
    }

    fn check_lengths(&self, faults: &mut Vec<ModesFault>) {
        let n = self.count();
        let mut length = |place: String, got: usize, wants: &[usize]| {
            if !wants.contains(&got) {
                let want = wants.iter().map(ToString::to_string).collect::<Vec<_>>().join(" or ");
                faults.push(ModesFault::Length { place, got, modes: n, want });
            }
        };
        length("stiffness".into(), self.stiffness.len(), &[n, n * n]);
        length("damping".into(), self.damping.len(), &[0, n, n * n]);
        for (i, s) in self.stations.iter().enumerate() {
            length(format!("station {i}, translation"), s.translation.len(), &[n]);
            length(format!("station {i}, rotation"), s.rotation.len(), &[0, n]);
            if let Some(g) = &s.shortening {
                length(format!("station {i}, shortening"), g.matrix.len(), &[n * n]);
            }
        }
    }

    fn check_stations(&self, faults: &mut Vec<ModesFault>) {
        let numbers = self.stiffness.iter().chain(&self.damping);
        if numbers.into_iter().any(|x| !x.is_finite()) {
            faults.push(ModesFault::NotFinite { place: "stiffness or damping".into() });
        }
        for (station, s) in self.stations.iter().enumerate() {
            let vectors = s.translation.iter().chain(&s.rotation).flat_map(|v| v.iter());
            let g = s.shortening.as_ref();
            let matrix = g.map_or(&[][..], |g| &g.matrix);
            let finite = vectors.chain(matrix).all(|x| x.is_finite()) && s.pose.is_finite();
            if !finite {
                faults.push(ModesFault::NotFinite { place: format!("station {station}") });
            }
            if let Err(error) = s.mass.validate() {
                faults.push(ModesFault::Inertia { station, error });
            }
            if let Some(g) = g {
                let length = g.axis.norm();
                if !((length - 1.0).abs() < 1e-9) {
                    faults.push(ModesFault::Axis { station, length });
                }
                symmetric(
                    &format!("station {station}, shortening"),
                    &g.matrix,
                    self.count(),
                    faults,
                );
            }
        }
    }

    fn check_attachment(&self, faults: &mut Vec<ModesFault>) {
        let mut fault = |fact, help| faults.push(ModesFault::Attachment { fact, help });
        match self.attachment {
            Attachment::Nearest { tolerance } => {
                if !(tolerance.is_finite() && tolerance >= 0.0) {
                    fault(format!("tolerance {tolerance} m"), "it must be finite and ≥ 0");
                }
            }
            Attachment::Beam => {
                let mut x: Vec<f64> = self.stations.iter().map(|s| s.pose.position.x).collect();
                x.sort_by(f64::total_cmp);
                let length = x.last().copied().unwrap_or(0.0) - x.first().copied().unwrap_or(0.0);
                if x.len() < 2 || x.windows(2).any(|w| !(w[1] - w[0] > 1e-9 * length)) {
                    let help = "a beam needs two stations or more, each at its own x";
                    fault("two stations share one x, or there is one station".into(), help);
                }
                let off = |p: &linkwork_spatial::Vec3| p.y.hypot(p.z) > 1e-9 * length;
                if let Some(i) = self.stations.iter().position(|s| off(&s.pose.position)) {
                    let help = "a beam's stations lie on the body's x axis; use Nearest for others";
                    fault(format!("station {i} is not on the x axis"), help);
                }
            }
        }
    }

    /// Checks that a matrix is symmetric and positive semidefinite.
    fn check_matrix(&self, place: &str, A: &[f64], faults: &mut Vec<ModesFault>) {
        let n = self.count();
        let before = faults.len();
        symmetric(place, A, n, faults);
        let scale = A.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
        if let (true, Some((eigenvalue, x))) = (faults.len() == before, least(A, n))
            && eigenvalue < -1e-9 * scale
        {
            let mode = x.iamax();
            faults.push(ModesFault::Negative { place: place.into(), eigenvalue, mode });
        }
    }

    fn check_mass(&self, faults: &mut Vec<ModesFault>) {
        let (n, mut M) = (self.count(), self.mass_matrix());
        let root: Vec<f64> = (0..n).map(|i| M[i * n + i].sqrt()).collect();
        let largest = root.iter().fold(0.0, |m: f64, x| m.max(*x));
        if let Some(mode) = root.iter().position(|x| !(*x > 1e-12 * largest)) {
            faults.push(ModesFault::Dependent { mode, eigenvalue: 0.0 });
            return;
        }
        for i in 0..n {
            for j in 0..n {
                M[i * n + j] /= root[i] * root[j];
            }
        }
        if let Some((eigenvalue, x)) = least(&M, n)
            && !(eigenvalue > INDEPENDENT)
        {
            faults.push(ModesFault::Dependent { mode: x.iamax(), eigenvalue });
        }
    }
}

fn symmetric(place: &str, A: &[f64], n: usize, faults: &mut Vec<ModesFault>) {
    let scale = A.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
    let differ = |(i, j): (usize, usize)| match (A.get(i * n + j), A.get(j * n + i)) {
        (Some(a), Some(b)) => (a - b).abs(),
        _ => 0.0,
    };
    let by = pairs.map(differ).fold(0.0, f64::max);
    if by > 1e-9 * scale {
        faults.push(ModesFault::NotSymmetric { place: place.into(), by });
    }
}

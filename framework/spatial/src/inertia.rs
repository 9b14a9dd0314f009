//! Rigid-body inertia: checked mass properties, parallel axis, rotation, sum.

use crate::{Force, Mat3, Motion, Quat, Vec3, skew};
use serde::{Deserialize, Serialize};

/// Strictness of the check of mass properties.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum InertiaCheck {
    /// A set of point masses with this inertia must exist: each principal moment is at most the sum of the other two.
    #[default]
    Physical,
    /// Principal moments need only be ≥ 0. Use this for published data in which the reflected rotor inertia of a gear motor is lumped into the wheel;
    /// an armature on the subhinge is better.
    PositiveMoments,
}

/// Mass, centre of mass and inertia as in a data sheet. Any values can be stored; [`MassProperties::validate`] checks whether such a body can exist.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MassProperties {
    /// Mass, kg. Zero is allowed for a body that only carries frames.
    pub mass: f64,
    /// Centre of mass in the body frame, m.
    pub com: Vec3,
    /// Inertia about the centre of mass, body axes, kg m². Off-diagonal terms are −∫xy dm.
    pub inertia_com: Mat3,
    /// Check to apply.
    #[serde(default)]
    pub check: InertiaCheck,
}

impl Default for MassProperties {
    fn default() -> Self {
        Self::massless()
    }
}

/// A fault of mass properties.
#[derive(Clone, Debug, PartialEq)]
pub enum InertiaFault {
    /// A number is NaN or infinite.
    NotFinite,
    /// The mass, kg, is below zero.
    NegativeMass(f64),
    /// The mass is zero, but a moment of inertia has this value, kg m².
    MasslessButInertia(f64),
    /// The mass is zero, but the first moment has this value, kg m.
    MasslessButMoment(f64),
    /// The inertia matrix is not symmetric; the largest difference, kg m².
    NotSymmetric(f64),
    /// The smallest principal moment, kg m², is below zero.
    NegativePrincipalMoment(f64),
    /// The largest principal moment exceeds the sum of the others.
    Triangle {
        /// Principal moments in rising order, kg m².
        moments: [f64; 3],
        /// Excess, kg m².
        excess: f64,
    },
}

impl std::fmt::Display for InertiaFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NotFinite => write!(f, "a mass property is NaN or infinite"),
            Self::NegativeMass(m) => write!(f, "mass {m} kg is negative"),
            Self::MasslessButInertia(i) => {
                write!(f, "mass is zero but a moment of inertia is {i} kg m²")
            }
            Self::MasslessButMoment(h) => {
                write!(f, "mass is zero but its first moment is {h} kg m")
            }
            Self::NotSymmetric(d) => {
                write!(f, "inertia is not symmetric: mirrored entries differ by {d} kg m²")
            }
            Self::NegativePrincipalMoment(i) => {
                write!(f, "smallest principal moment of inertia is {i} kg m², below zero")
            }
            Self::Triangle { moments: [a, b, c], excess } => write!(
                f,
                "largest principal moment {c} kg m² exceeds the sum of the others ({a} + {b}) by \
                 {excess} kg m²; is it about the centre of mass, with −∫xy dm off the diagonal? \
                 A geared rotor belongs in the subhinge's armature"
            ),
        }
    }
}

/// Reasons why mass properties are invalid.
#[derive(Clone, Debug, PartialEq)]
pub struct InertiaError {
    /// The faults, at least one.
    pub faults: Vec<InertiaFault>,
}

impl std::fmt::Display for InertiaError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (i, fault) in self.faults.iter().enumerate() {
            write!(f, "{}{fault}", if i == 0 { "" } else { "; " })?;
        }
        Ok(())
    }
}

impl std::error::Error for InertiaError {}

impl MassProperties {
    /// Returns a body without mass, which only carries frames.
    #[must_use]
    pub fn massless() -> Self {
        Self::new(0.0, Vec3::zeros(), Mat3::zeros())
    }

    /// Returns mass properties from mass (kg), centre of mass (body frame, m) and inertia about it (body axes, kg m²).
    #[must_use]
    pub fn new(mass: f64, com: Vec3, inertia_com: Mat3) -> Self {
        Self { mass, com, inertia_com, check: InertiaCheck::Physical }
    }

    /// Returns the same values with another check.
    #[must_use]
    pub fn with_check(self, check: InertiaCheck) -> Self {
        Self { check, ..self }
    }

    /// Computes the inertia about the body origin.
    ///
    /// # Errors
    /// All faults found, each with its size. The tolerance is 1e-9 of the largest entry.
    pub fn validate(&self) -> Result<RigidInertia, InertiaError> {
        let faults = self.faults();
        if !faults.is_empty() {
            return Err(InertiaError { faults });
        }
        let C = skew(&self.com);
        let inertia = (self.inertia_com + self.inertia_com.transpose()) * 0.5;
        Ok(RigidInertia {
            mass: self.mass,
            h: self.com * self.mass,
            // Parallel axis theorem: J = J_c − m c~ c~, where c~ c~ is negative semidefinite.
            inertia: inertia - C * C * self.mass,
        })
    }

    fn faults(&self) -> Vec<InertiaFault> {
        let I = &self.inertia_com;
        let numbers = || self.com.iter().chain(I.iter());
        if !self.mass.is_finite() || numbers().any(|x| !x.is_finite()) {
            return vec![InertiaFault::NotFinite];
        }
        let mut faults = Vec::new();
        let scale = I.abs().max();
        // Reject numbers whose sums overflow, because the search for eigenvalues would not end.
        if !(2.0 * scale + self.mass.abs() * self.com.norm_squared()).is_finite() {
            return vec![InertiaFault::NotFinite];
        }
        let tolerance = 1e-9 * scale;
        if self.mass < 0.0 {
            faults.push(InertiaFault::NegativeMass(self.mass));
        }
        if self.mass == 0.0 && scale > 0.0 {
            faults.push(InertiaFault::MasslessButInertia(scale));
        }
        let asymmetry = (I - I.transpose()).abs().max();
        if asymmetry > tolerance {
            faults.push(InertiaFault::NotSymmetric(asymmetry));
        }
        let mut m: [f64; 3] = ((I + I.transpose()) * 0.5).symmetric_eigenvalues().into();
        m.sort_by(f64::total_cmp);
        let excess = m[2] - m[0] - m[1];
        if m[0] < -tolerance {
            faults.push(InertiaFault::NegativePrincipalMoment(m[0]));
        } else if excess > tolerance && self.check == InertiaCheck::Physical {
            faults.push(InertiaFault::Triangle { moments: m, excess });
        }
        faults
    }
}

/// Inertia of a rigid body about the origin of the axes in which it is given:
/// ```text
/// M = [[J, m c~], [−m c~, m 1]]      h = m c
/// ```
/// [`MassProperties::validate`] creates it, so it always belongs to a possible body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RigidInertia {
    mass: f64,
    h: Vec3,
    inertia: Mat3,
}

impl RigidInertia {
    /// Returns the inertia from mass (kg), centre of mass (m) and inertia about it (kg m²).
    ///
    /// # Errors
    /// As [`MassProperties::validate`].
    pub fn new(mass: f64, com: Vec3, inertia_com: Mat3) -> Result<Self, InertiaError> {
        MassProperties::new(mass, com, inertia_com).validate()
    }

    /// Returns the inertia from mass (kg), first moment (kg m) and inertia matrix (kg m²; only its upper half is read), both about the origin. These
    /// quantities add up over the pieces of a body. Allocates nothing if they are valid.
    ///
    /// # Errors
    /// As [`MassProperties::validate`]; the tolerance is 1e-9 of the largest entry about the origin.
    pub fn from_moments(mass: f64, h: Vec3, inertia: Mat3) -> Result<Self, InertiaError> {
        let inertia = Mat3::from_fn(|i, j| inertia[(i.min(j), i.max(j))]);
        let body = Self { mass, h, inertia };
        let J = body.inertia_com();
        // The second moment ∫ r rᵀ dm about the centre of mass is positive semidefinite exactly when the principal moments are not negative and obey
        // the triangle inequality.
        let half = 0.5 * J.trace();
        let tolerance = 1e-9 * (inertia.abs().max() + f64::MIN_POSITIVE);
        let S = Mat3::from_diagonal_element(half + tolerance) - J;
        let minor = S[(0, 0)] * S[(1, 1)] - S[(0, 1)] * S[(0, 1)];
        let possible = mass > 0.0 && S[(0, 0)] >= 0.0 && minor >= 0.0 && S.determinant() >= 0.0;
        let empty = mass == 0.0 && h == Vec3::zeros() && inertia == Mat3::zeros();
        if (possible && mass.is_finite()) || empty {
            return Ok(body);
        }
        let as_given = MassProperties::new(mass, body.com(), J).validate();
        // The test above failed, so the exact test or the mass determines the fault.
        match as_given {
            Err(error) => Err(error),
            Ok(_) if mass > 0.0 => Ok(body),
            Ok(_) => Err(InertiaError { faults: vec![InertiaFault::MasslessButMoment(h.norm())] }),
        }
    }

    /// Returns zero inertia.
    #[must_use]
    pub fn zero() -> Self {
        Self::default()
    }

    /// Returns the mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// Returns the first moment m c about the origin, kg m.
    #[must_use]
    pub fn h(&self) -> Vec3 {
        self.h
    }

    /// Returns the inertia matrix about the origin, kg m².
    #[must_use]
    pub fn inertia(&self) -> Mat3 {
        self.inertia
    }

    /// Returns the centre of mass from the origin, m; zero for a body without mass.
    #[must_use]
    pub fn com(&self) -> Vec3 {
        if self.mass > 0.0 { self.h / self.mass } else { Vec3::zeros() }
    }

    /// Returns the inertia about the centre of mass, kg m².
    #[must_use]
    pub fn inertia_com(&self) -> Mat3 {
        let C = skew(&self.com());
        self.inertia + C * C * self.mass
    }

    /// Returns the inertia of the same body about a new origin, from which the old origin lies at `l` (m, same axes): φ M φ*.
    #[must_use]
    pub fn shift_to_parent(&self, l: &Vec3) -> Self {
        let (L, C) = (skew(l), skew(&self.h));
        Self {
            mass: self.mass,
            h: self.h + l * self.mass,
            inertia: self.inertia - L * C - C * L - L * L * self.mass,
        }
    }

    /// Returns the inertia in other axes: `R_AB` takes the present axes B to A.
    #[must_use]
    pub fn rotate(&self, R_AB: &Quat) -> Self {
        self.rotate_by(R_AB.to_rotation_matrix().matrix())
    }

    /// Returns the inertia in other axes, by a rotation matrix.
    #[must_use]
    pub fn rotate_by(&self, R: &Mat3) -> Self {
        Self { mass: self.mass, h: R * self.h, inertia: R * self.inertia * R.transpose() }
    }

    /// Computes the momentum about the origin (kg m²/s, kg m/s) at velocity `V`: M V.
    #[must_use]
    pub fn apply(&self, V: &Motion) -> Force {
        Force {
            moment: self.inertia * V.angular + self.h.cross(&V.linear),
            force: V.linear * self.mass - self.h.cross(&V.angular),
        }
    }
}

impl std::ops::Add for RigidInertia {
    type Output = Self;
    /// Returns the inertia of two joined bodies; both about the same origin and in the same axes.
    fn add(self, o: Self) -> Self {
        Self { mass: self.mass + o.mass, h: self.h + o.h, inertia: self.inertia + o.inertia }
    }
}

impl std::ops::AddAssign for RigidInertia {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

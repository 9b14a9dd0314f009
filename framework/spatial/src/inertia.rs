//! Rigid-body inertia: checked mass properties, parallel axis, rotation, sum.

use crate::{Force, Mat3, Motion, Quat, Vec3, skew};
use serde::{Deserialize, Serialize};

/// Which bodies are refused.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum InertiaCheck {
    /// A set of point masses must exist that has this inertia: each principal moment is at most
    /// the sum of the other two.
    #[default]
    Physical,
    /// Principal moments need only be ≥ 0. For published data in which a gear motor's reflected
    /// rotor inertia is lumped into the wheel; prefer an armature on the subhinge.
    PositiveMoments,
}

/// Mass, centre of mass and inertia as a data sheet gives them. Every value can be written down;
/// [`MassProperties::validate`] says whether such a body can exist.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MassProperties {
    /// Mass, kg. Zero is allowed for a body that only carries frames.
    pub mass: f64,
    /// Centre of mass in the body frame, m.
    pub com: Vec3,
    /// Inertia about the centre of mass, body axes, kg m². Off-diagonal terms are −∫xy dm.
    pub inertia_com: Mat3,
    /// How strictly to check.
    #[serde(default)]
    pub check: InertiaCheck,
}

impl Default for MassProperties {
    fn default() -> Self {
        Self::massless()
    }
}

/// One thing wrong with a set of mass properties.
#[derive(Clone, Debug, PartialEq)]
pub enum InertiaFault {
    /// A number is NaN or infinite.
    NotFinite,
    /// The mass, kg, is below zero.
    NegativeMass(f64),
    /// No mass, but a moment of inertia of this size, kg m².
    MasslessButInertia(f64),
    /// No mass, but a first moment of this size, kg m.
    MasslessButMoment(f64),
    /// The inertia matrix is not symmetric; the largest difference, kg m².
    NotSymmetric(f64),
    /// The smallest principal moment, kg m², is below zero.
    NegativePrincipalMoment(f64),
    /// The largest principal moment exceeds the sum of the others.
    Triangle {
        /// Principal moments in rising order, kg m².
        moments: [f64; 3],
        /// By how much, kg m².
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

/// Why mass properties were refused: all the reasons.
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
    /// A body without mass: it only carries frames.
    #[must_use]
    pub fn massless() -> Self {
        Self::new(0.0, Vec3::zeros(), Mat3::zeros())
    }

    /// Mass (kg), centre of mass (body frame, m), inertia about it (body axes, kg m²).
    #[must_use]
    pub fn new(mass: f64, com: Vec3, inertia_com: Mat3) -> Self {
        Self { mass, com, inertia_com, check: InertiaCheck::Physical }
    }

    /// The same numbers, checked as `check` says.
    #[must_use]
    pub fn with_check(self, check: InertiaCheck) -> Self {
        Self { check, ..self }
    }

    /// The inertia about the body origin.
    ///
    /// # Errors
    /// Every fault found, each with its size. Tolerance: 1e-9 of the largest entry.
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
            // Parallel axis: J = J_c − m c~ c~, and c~ c~ is negative.
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
        // Numbers whose sums are none any more, and on which eigenvalues are looked for without end.
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

/// The inertia of a rigid body about the origin of the axes it is given in:
/// ```text
/// M = [[J, m c~], [−m c~, m 1]]      h = m c
/// ```
/// Made by [`MassProperties::validate`], so it always belongs to a possible body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RigidInertia {
    mass: f64,
    h: Vec3,
    inertia: Mat3,
}

impl RigidInertia {
    /// From mass (kg), centre of mass (m) and inertia about it (kg m²).
    ///
    /// # Errors
    /// As [`MassProperties::validate`].
    pub fn new(mass: f64, com: Vec3, inertia_com: Mat3) -> Result<Self, InertiaError> {
        MassProperties::new(mass, com, inertia_com).validate()
    }

    /// From mass (kg), first moment (kg m) and inertia matrix (kg m²; its upper half is read), both about
    /// the origin: what adds up over the pieces of a body. Allocates nothing when they are possible.
    ///
    /// # Errors
    /// As [`MassProperties::validate`]; the tolerance is 1e-9 of the largest entry about the origin.
    pub fn from_moments(mass: f64, h: Vec3, inertia: Mat3) -> Result<Self, InertiaError> {
        let inertia = Mat3::from_fn(|i, j| inertia[(i.min(j), i.max(j))]);
        let body = Self { mass, h, inertia };
        let J = body.inertia_com();
        // ∫ r rᵀ dm about the centre of mass: no direction has a negative part of it exactly when the
        // principal moments are not negative and obey the triangle inequality.
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
        // What the test above does not let pass is told by the exact one, or by the mass.
        match as_given {
            Err(error) => Err(error),
            Ok(_) if mass > 0.0 => Ok(body),
            Ok(_) => Err(InertiaError { faults: vec![InertiaFault::MasslessButMoment(h.norm())] }),
        }
    }

    /// No mass.
    #[must_use]
    pub fn zero() -> Self {
        Self::default()
    }

    /// Mass, kg.
    #[must_use]
    pub fn mass(&self) -> f64 {
        self.mass
    }

    /// First moment m c about the origin, kg m.
    #[must_use]
    pub fn h(&self) -> Vec3 {
        self.h
    }

    /// Inertia matrix about the origin, kg m².
    #[must_use]
    pub fn inertia(&self) -> Mat3 {
        self.inertia
    }

    /// Centre of mass from the origin, m; zero for a body without mass.
    #[must_use]
    pub fn com(&self) -> Vec3 {
        if self.mass > 0.0 { self.h / self.mass } else { Vec3::zeros() }
    }

    /// Inertia about the centre of mass, kg m².
    #[must_use]
    pub fn inertia_com(&self) -> Mat3 {
        let C = skew(&self.com());
        self.inertia + C * C * self.mass
    }

    /// The same body about an origin displaced so that the old origin lies at `l` (m, same axes)
    /// from the new one: φ M φ*.
    #[must_use]
    pub fn shift_to_parent(&self, l: &Vec3) -> Self {
        let (L, C) = (skew(l), skew(&self.h));
        Self {
            mass: self.mass,
            h: self.h + l * self.mass,
            inertia: self.inertia - L * C - C * L - L * L * self.mass,
        }
    }

    /// The same body in other axes: `R_AB` takes the present axes B to A.
    #[must_use]
    pub fn rotate(&self, R_AB: &Quat) -> Self {
        self.rotate_by(R_AB.to_rotation_matrix().matrix())
    }

    /// The same body in other axes, by a rotation matrix.
    #[must_use]
    pub fn rotate_by(&self, R: &Mat3) -> Self {
        Self { mass: self.mass, h: R * self.h, inertia: R * self.inertia * R.transpose() }
    }

    /// Momentum about the origin (kg m²/s, kg m/s) at velocity `V`: M V.
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
    /// Two bodies joined; both about the same origin and in the same axes.
    fn add(self, o: Self) -> Self {
        Self { mass: self.mass + o.mass, h: self.h + o.h, inertia: self.inertia + o.inertia }
    }
}

impl std::ops::AddAssign for RigidInertia {
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}

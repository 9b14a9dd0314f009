//! Gravity field of a body from a file of spherical harmonics: axes of the coefficients and permanent tide.
//! ```text
//! a_P = R_PF ∇V(R_PFᵀ p)                R_PF: from the field's axes to those of the body's rotation
//! Moon: R_PF = R_x(0.30″) R_y(78.56″) R_z(67.92″)      principal axes to mean-Earth axes, DE421 (Archinal and others, 2011)
//! C̄₂₀ = C̄₂₀(tide-free) + k₂ A₀H₀       zero tide:    A₀H₀ = 4.4228e-8 · (−0.31460)  (IERS Conventions 2010, eq. 6.13)
//!                        + A₀H₀          mean tide
//! ```
//! Fields of the Moon from Lunar Prospector and GRAIL are given in principal axes, but the IAU rotation of the Moon refers to mean-Earth axes. The
//! difference is 1.7 km at the surface.

use crate::third::Third;
use crate::world::{Centre, Inner, Turning, fault};
use linkwork_spatial::Mat3;
use linkwork_surroundings::prelude::*;
use linkwork_world::gravity::{Coefficients, Format, Harmonics, Keep, TideSystem, read};

/// Gravity field of a third body that the run comes close to.
#[derive(Params, Clone, Debug)]
pub struct ThirdField {
    /// Body, one of `third_bodies`: earth, mars, moon.
    pub body: Centre,
    /// File of coefficients; its μ replaces the μ of the ephemeris.
    pub file: String,
    /// Format of the file: gmat, basilisk, icgem, shadr.
    pub format: FieldFormat,
    /// Highest degree.
    #[param(default = 20, range = 0.0..=360.0)]
    pub degree: usize,
    /// Highest order; default: the degree.
    #[param(range = 0.0..=360.0)]
    pub order: Option<usize>,
    /// Axes of the coefficients; default: principal axes for the Moon, otherwise the axes of the IAU rotation.
    pub axes: Option<FieldAxes>,
}

/// Spherical harmonics of a planet, third bodies and tides.
#[derive(Params, Clone, Debug)]
pub struct HarmonicsParams {
    /// File of coefficients.
    pub file: String,
    /// Format of the file: gmat, basilisk, icgem, shadr.
    pub format: FieldFormat,
    /// Highest degree.
    #[param(default = 20, range = 0.0..=360.0)]
    pub degree: usize,
    /// Highest order; default: the degree.
    #[param(range = 0.0..=360.0)]
    pub order: Option<usize>,
    /// Axes of the coefficients; default: principal axes for the Moon with `turns: iau`, otherwise the axes of the world's rotation.
    pub axes: Option<FieldAxes>,
    /// Permanent tide in the coefficients; default: as the file states, otherwise `tide_free`.
    pub tide_system: Option<Permanent>,
    /// The world, whose body has this field.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Bodies whose gravity acts in addition: sun, moon, earth, venus, mars, jupiter; needs an epoch in `world`.
    #[param(default = Vec::new())]
    pub third_bodies: Vec<Third>,
    /// Gravity fields of third bodies that the run comes close to, for example on a transfer from the Earth to an orbit about the Moon. Each body
    /// rotates according to the IAU model; W has ICRF axes.
    #[param(default = Vec::new())]
    pub fields: Vec<ThirdField>,
    /// Love number k₂ of the solid tide that the third bodies raise on the planet: the Earth 0.3, Mars 0.17; 0: no tide.
    #[param(default = 0.0, range = 0.0..=1.5)]
    pub love: f64,
}

/// Formats of coefficient files.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldFormat {
    /// `.cof` of GMAT.
    Gmat,
    /// Text of Basilisk: header, then n, m, C, S; metres.
    Basilisk,
    /// `.gfc` of ICGEM.
    Icgem,
    /// SHADR of the Planetary Data System; kilometres.
    Shadr,
}

/// Axes in which coefficients are given.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldAxes {
    /// Axes of the body's rotation; mean-Earth axes for the Moon, according to the IAU model.
    Rotation,
    /// The Moon's principal axes of inertia.
    Principal,
}

impl FieldAxes {
    /// Returns the usual axes of published fields of a body.
    pub(crate) fn of(body: Centre, turning: Turning) -> FieldAxes {
        match (body, turning) {
            (Centre::Moon, Turning::Iau) => FieldAxes::Principal,
            _ => FieldAxes::Rotation,
        }
    }

    /// Returns an error for principal axes of a body or rotation for which they are not known.
    pub(crate) fn known(self, body: Centre, turning: Turning) -> Result<(), BuildError> {
        if (self, body, turning) == (FieldAxes::Principal, Centre::Moon, Turning::Iau)
            || self == FieldAxes::Rotation
        {
            return Ok(());
        }
        let fact = "`axes: principal` is only supported for the Moon with `turns: iau`";
        Err(BuildError::new(fact).help("write `rotation`, or an `epoch` in `world`").at("axes"))
    }

    /// Returns R_PF, or `None` for the identity.
    fn turn(self) -> Option<Quat> {
        let arcsec = std::f64::consts::PI / 648_000.0;
        let about = |axis: Vec3, angle: f64| Quat::from_scaled_axis(axis * (angle * arcsec));
        (self == FieldAxes::Principal)
            .then(|| about(Vec3::x(), 0.30) * about(Vec3::y(), 78.56) * about(Vec3::z(), 67.92))
    }
}

/// Parts of the permanent tide of Sun and Moon that C̄₂₀ includes.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Permanent {
    /// No permanent tide.
    TideFree,
    /// Includes the permanent deformation of the body.
    ZeroTide,
    /// Includes the permanent deformation and the mean attraction of Sun and Moon.
    MeanTide,
}

/// Gravity field of a body, evaluated in the axes of its rotation.
pub struct BodyField {
    field: Harmonics,
    /// R_PF; `None` for the identity.
    turn: Option<Quat>,
}

impl BodyField {
    pub(crate) fn new(coefficients: &Coefficients, axes: FieldAxes) -> BodyField {
        BodyField { field: Harmonics::new(coefficients), turn: axes.turn() }
    }

    pub(crate) fn degree(&self) -> usize {
        self.field.degree()
    }

    /// Returns the reference radius, m.
    pub(crate) fn radius(&self) -> f64 {
        self.field.radius()
    }

    /// Returns the acceleration (m/s²) at `p` (m), axes of the body's rotation.
    pub(crate) fn acceleration(&self, p: &Vec3) -> Vec3 {
        match &self.turn {
            Some(R) => R * self.field.acceleration(&(R.inverse() * p)),
            None => self.field.acceleration(p),
        }
    }

    /// Returns the gradient ∂a/∂p (1/s²) at `p` (m), axes of the body's rotation.
    pub(crate) fn gradient(&self, p: &Vec3) -> Mat3 {
        match &self.turn {
            Some(turn) => {
                let R = turn.to_rotation_matrix().into_inner();
                R * self.field.full(&(turn.inverse() * p)).gradient * R.transpose()
            }
            None => self.field.full(p).gradient,
        }
    }
}

/// Reads coefficients from a file and truncates them at a degree and order.
pub(crate) fn coefficients(
    file: &str,
    format: FieldFormat,
    (degree, order): (usize, Option<usize>),
    files: &Files,
) -> Result<Coefficients, BuildError> {
    let path = files.resolve(file).map_err(|e| e.at("file"))?;
    let text = linkwork_formats::whole_text(&path).map_err(|e| {
        BuildError::new(format!("`{file}`: {e}")).help("`file` must name a text file").at("file")
    })?;
    let format = match format {
        FieldFormat::Gmat => Format::Gmat,
        FieldFormat::Basilisk => Format::Basilisk,
        FieldFormat::Icgem => Format::Icgem,
        FieldFormat::Shadr => Format::Shadr,
    };
    let all = read(format, file, &text, Keep::Degree(degree)).map_err(|e| fault(&e, "file"))?;
    let order = order.unwrap_or_else(|| degree.min(all.order()));
    all.truncated(degree, order).map_err(|e| fault(&e, "order"))
}

/// A₀H₀ of Sun and Moon: the change of C̄₂₀ by their mean tide for k₂ = 1.
const MEAN_TIDE: [(Third, f64); 2] = [(Third::Sun, -4.4024e-9), (Third::Moon, -9.5120e-9)];

/// Removes from the coefficients the permanent tide that the model computes from the third bodies, because it would be counted twice.
pub(crate) fn take_permanent_tide(
    coefficients: &mut Coefficients,
    p: &HarmonicsParams,
    world: &Inner,
) -> Result<(), BuildError> {
    let of_file = match coefficients.tide {
        TideSystem::Unknown | TideSystem::TideFree => Permanent::TideFree,
        TideSystem::ZeroTide => Permanent::ZeroTide,
        TideSystem::MeanTide => Permanent::MeanTide,
    };
    let share = match p.tide_system.unwrap_or(of_file) {
        Permanent::TideFree => return Ok(()),
        Permanent::ZeroTide => p.love,
        Permanent::MeanTide => 1.0 + p.love,
    };
    if share == 0.0 || p.third_bodies.is_empty() || coefficients.degree() < 2 {
        return Ok(());
    }
    if world.params.body != Centre::Earth {
        let fact = format!(
            "the field includes a permanent tide, whose size is not known for `{}`",
            world.params.body.word()
        );
        let help = "use a tide-free field, or remove `love`";
        return Err(BuildError::new(fact).help(help).at("tide_system"));
    }
    let raised = MEAN_TIDE.iter().filter(|(third, _)| p.third_bodies.contains(third));
    let mean: f64 = raised.map(|(_, mean)| mean).sum();
    let (c, s) = coefficients.get(2, 0);
    coefficients.set(2, 0, c - share * mean, s).map_err(|e| fault(&e, "file"))
}

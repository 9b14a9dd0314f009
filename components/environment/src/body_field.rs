//! The field of a body from a file of harmonics: its axes, and the permanent tide within it.
//! ```text
//! a_P = R_PF ∇V(R_PFᵀ p)                R_PF: from the field's axes to those of the body's rotation
//! Moon: R_PF = R_x(0.30″) R_y(78.56″) R_z(67.92″)      principal axes to mean-Earth axes, DE421 (Archinal and others, 2011)
//! C̄₂₀ = C̄₂₀(tide-free) + k₂ A₀H₀       zero tide:    A₀H₀ = 4.4228e-8 · (−0.31460)  (IERS Conventions 2010, eq. 6.13)
//!                        + A₀H₀          mean tide
//! ```
//! Fields of the Moon from Lunar Prospector and GRAIL are given in principal axes, and the rotation of the IAU is that of
//! mean-Earth axes: 1.7 km apart at the surface.

use crate::third::Third;
use crate::world::{Centre, Inner, Turning, fault};
use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;
use linkwork_world::gravity::{Coefficients, Format, Harmonics, Keep, TideSystem, read};

/// The field of a third body that the run comes near to.
#[derive(Params, Clone, Debug)]
pub struct ThirdField {
    /// Which of `third_bodies`: earth, mars, moon.
    pub body: Centre,
    /// File of coefficients, whose μ goes before that of the ephemeris.
    pub file: String,
    /// Its layout: gmat, basilisk, icgem, shadr.
    pub format: FieldFormat,
    /// Highest degree.
    #[param(default = 20, range = 0.0..=360.0)]
    pub degree: usize,
    /// Highest order; default: the degree.
    #[param(range = 0.0..=360.0)]
    pub order: Option<usize>,
    /// Axes of its coefficients; default: of the Moon principal, else those of its IAU rotation.
    pub axes: Option<FieldAxes>,
}

/// A field of harmonics, the planet that carries it, and who else pulls.
#[derive(Params, Clone, Debug)]
pub struct HarmonicsParams {
    /// File of coefficients.
    pub file: String,
    /// Its layout: gmat, basilisk, icgem, shadr.
    pub format: FieldFormat,
    /// Highest degree.
    #[param(default = 20, range = 0.0..=360.0)]
    pub degree: usize,
    /// Highest order; default: the degree.
    #[param(range = 0.0..=360.0)]
    pub order: Option<usize>,
    /// Axes of its coefficients; default: of the Moon with `turns: iau` principal, else those of the world's rotation.
    pub axes: Option<FieldAxes>,
    /// Whether the permanent tide is within the coefficients; default: as the file says, else `tide_free`.
    pub tide_system: Option<Permanent>,
    /// The world, whose body has this field.
    #[param(service)]
    pub world: Handle<dyn World>,
    /// Who else pulls: sun, moon, earth, venus, mars, jupiter; needs an epoch in `world`.
    #[param(default = Vec::new())]
    pub third_bodies: Vec<Third>,
    /// Fields of third bodies that the run comes near to: so that it has several centres, as on the way from the Earth to an orbit about
    /// the Moon. Each turns by the IAU; W is in the axes of the ICRF.
    #[param(default = Vec::new())]
    pub fields: Vec<ThirdField>,
    /// Love number k₂ of the solid tide that the third bodies raise on the planet: the Earth 0.3, Mars 0.17; 0: none.
    #[param(default = 0.0, range = 0.0..=1.5)]
    pub love: f64,
}

/// Layouts of coefficient files.
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
    /// Those of the body's rotation; of the Moon by the IAU the mean-Earth axes.
    Rotation,
    /// The Moon's principal axes of inertia.
    Principal,
}

impl FieldAxes {
    /// Those of published fields of a body.
    pub(crate) fn of(body: Centre, turning: Turning) -> FieldAxes {
        match (body, turning) {
            (Centre::Moon, Turning::Iau) => FieldAxes::Principal,
            _ => FieldAxes::Rotation,
        }
    }

    /// Refuses principal axes of a body, or of a rotation, beside which they are not known.
    pub(crate) fn known(self, body: Centre, turning: Turning) -> Result<(), BuildError> {
        if (self, body, turning) == (FieldAxes::Principal, Centre::Moon, Turning::Iau)
            || self == FieldAxes::Rotation
        {
            return Ok(());
        }
        let fact = "`principal` is known for the Moon that rotates by the IAU alone";
        Err(BuildError::new(fact).help("write `rotation`, or an `epoch` in `world`").at("axes"))
    }

    /// R_PF.
    fn turn(self) -> Option<Quat> {
        let arcsec = std::f64::consts::PI / 648_000.0;
        let about = |axis: Vec3, angle: f64| Quat::from_scaled_axis(axis * (angle * arcsec));
        (self == FieldAxes::Principal)
            .then(|| about(Vec3::x(), 0.30) * about(Vec3::y(), 78.56) * about(Vec3::z(), 67.92))
    }
}

/// Whether C̄₂₀ has the permanent tide of Sun and Moon in it.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Permanent {
    /// It has not.
    TideFree,
    /// It has the deformation of the body.
    ZeroTide,
    /// It has the attraction of Sun and Moon, too.
    MeanTide,
}

/// Coefficients in the axes of a body's rotation, ready to be evaluated.
pub struct BodyField {
    field: Harmonics,
    /// R_PF, where it is not the identity.
    turn: Option<Quat>,
}

impl BodyField {
    pub(crate) fn new(coefficients: &Coefficients, axes: FieldAxes) -> BodyField {
        BodyField { field: Harmonics::new(coefficients), turn: axes.turn() }
    }

    pub(crate) fn degree(&self) -> usize {
        self.field.degree()
    }

    /// m.
    pub(crate) fn radius(&self) -> f64 {
        self.field.radius()
    }

    /// m/s² at `p` (m), axes of the body's rotation.
    pub(crate) fn acceleration(&self, p: &Vec3) -> Vec3 {
        match &self.turn {
            Some(R) => R * self.field.acceleration(&(R.inverse() * p)),
            None => self.field.acceleration(p),
        }
    }

    /// ∂a/∂p, 1/s².
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

/// Coefficients from a file, cut at a degree and order.
pub(crate) fn coefficients(
    file: &str,
    format: FieldFormat,
    (degree, order): (usize, Option<usize>),
    files: &Files,
) -> Result<Coefficients, BuildError> {
    let path = files.resolve(file).map_err(|e| e.at("file"))?;
    let text = linkwork_formats::whole_text(&path).map_err(|e| {
        BuildError::new(format!("`{file}`: {e}")).help("a text file is wanted").at("file")
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

/// Takes the permanent tide out of the coefficients that the third bodies bring along themselves: their solid tide has a mean, too.
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
            "a permanent tide is in the field, and that of `{}` is not known",
            world.params.body.word()
        );
        let help = "use a tide-free field, or leave `love` out";
        return Err(BuildError::new(fact).help(help).at("tide_system"));
    }
    let raised = MEAN_TIDE.iter().filter(|(third, _)| p.third_bodies.contains(third));
    let mean: f64 = raised.map(|(_, mean)| mean).sum();
    let (c, s) = coefficients.get(2, 0);
    coefficients.set(2, 0, c - share * mean, s).map_err(|e| fault(&e, "file"))
}

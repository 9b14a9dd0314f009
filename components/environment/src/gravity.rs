//! Gravity of planets: `environment.spherical_harmonics`, `environment.zonal_gravity`.
//! ```text
//! a_I = R_IP ∇V(R_IPᵀ p)  +  Σ_k third body k             R_IP at the time of the stage
//! V   = μ/r Σ_n (R/r)ⁿ Σ_m P̄_nm(sin φ)(C̄_nm cos mλ + S̄_nm sin mλ)        Pines 1973, no singular poles
//! third body:  `third_bodies.rs`; with a field of its own: another centre
//! solid tide:  a = k₂ μ₃ R⁵/(2 s³ r⁴) [(3 − 15 c²) r̂ + 6 c ŝ]     c = r̂ · ŝ: how the planet answers to it
//! in a site:   r from the planet's centre
//! zonal: V = μ/r (1 − Σ J_n (R/r)ⁿ P_n(z/r))
//! ```
//! A series of high degree diverges below the planet's surface.

use crate::body_field::{BodyField, coefficients, take_permanent_tide};
pub use crate::body_field::{FieldAxes, FieldFormat, HarmonicsParams, Permanent, ThirdField};
pub use crate::third::Third;
use crate::third_bodies::{Puller, pullers};
use crate::world::{PlanetWorld, Turning, WorldParams, around, gradient_around};
use linkwork_spatial::Mat3;
use linkwork_surroundings::prelude::*;
use linkwork_world::gravity::{TideRaiser, solid_tide, solid_tide_gradient, zonal, zonal_gradient};

/// Spherical harmonics of a rotating planet, and third bodies.
pub struct SphericalHarmonics {
    field: BodyField,
    world: PlanetWorld,
    pullers: Vec<Puller>,
    /// Love number k₂, and its reference radius, m.
    love: (f64, f64),
}

impl SphericalHarmonics {
    /// Returns the vector from the planet's centre to a third body, m, W; NaN outside the span of the ephemeris.
    fn towards(&self, third: &Puller, t: f64) -> Vec3 {
        third.towards(self.world.planet.site.as_ref(), t)
    }

    /// Returns the vector from the planet's centre to a point (m, W).
    fn around_centre(&self, p: &Vec3) -> Vec3 {
        self.world.planet.site.map_or(*p, |s| s.relative_to_centre(p))
    }

    /// Returns the acceleration (m/s²) of the planet's field alone at `p` (m), both in W; at a site it includes the centrifugal part.
    pub fn field(&self, t: f64, p: Vec3) -> Vec3 {
        self.world.planet.gravity(t, p, |p| self.field.acceleration(p))
    }

    /// Returns the accelerations (m/s², W) relative to the planet due to each third body, in the order of the file; `p` in W.
    pub fn thirds(&self, t: f64, p: Vec3) -> impl Iterator<Item = Vec3> + '_ {
        let r = self.around_centre(&p);
        self.pullers.iter().map(move |k| k.pull(self.world.planet.site.as_ref(), t, &r))
    }

    /// Returns the acceleration (m/s², W) at `p` (m, W) due to the solid tide that the third bodies raise on the planet.
    pub fn tide(&self, t: f64, p: Vec3) -> Vec3 {
        let (k2, radius) = self.love;
        if k2 == 0.0 {
            return Vec3::zeros();
        }
        let raiser = |k: &Puller| TideRaiser { mu: k.mu, position: self.towards(k, t) };
        let r = self.around_centre(&p);
        self.pullers.iter().map(|k| solid_tide(k2, radius, &raiser(k), &r)).sum()
    }
}

impl Gravity for SphericalHarmonics {
    fn acceleration(&self, t: f64, p: Vec3) -> Vec3 {
        let rigid = self.thirds(t, p).fold(self.field(t, p), |a, b| a + b);
        if self.love.0 == 0.0 { rigid } else { rigid + self.tide(t, p) }
    }
    fn gradient(&self, t: f64, p: Vec3) -> Option<Mat3> {
        let own = self.world.planet.gradient(t, p, |p| self.field.gradient(p));
        let r = self.around_centre(&p);
        let (k2, radius) = self.love;
        let others = self.pullers.iter().map(|k| {
            let rigid = k.gradient(self.world.planet.site.as_ref(), t, &r);
            if k2 == 0.0 {
                return rigid;
            }
            let raiser = TideRaiser { mu: k.mu, position: self.towards(k, t) };
            rigid + solid_tide_gradient(k2, radius, &raiser, &r)
        });
        Some(others.fold(own, |a, b| a + b))
    }
    fn scale(&self, t: f64, p: Vec3) -> f64 {
        let r = self.around_centre(&p);
        let own = r.norm() / (self.field.degree() + 2) as f64;
        let others = self.pullers.iter().map(|k| k.scale(self.world.planet.site.as_ref(), t, &r));
        others.fold(own, f64::min)
    }
    fn failure(&self, t: f64) -> Option<BuildError> {
        self.pullers.iter().find_map(|k| k.failure(t))
    }
    fn axes(&self) -> Axes {
        self.world.planet.axes()
    }
}

/// Returns the third bodies with their gravity fields.
fn sources(
    p: &HarmonicsParams,
    world: &PlanetWorld,
    files: &Files,
) -> Result<Vec<Puller>, BuildError> {
    let mut all = pullers(world, &p.third_bodies, None)?;
    let own_params = &world.params;
    for (k, own) in p.fields.iter().enumerate() {
        let body = own.body.body();
        let of_body = |third: &Third| Some(third.body().0) == body;
        let (Some(at), false) = (
            p.third_bodies.iter().position(of_body),
            p.fields[..k].iter().any(|before| before.body == own.body),
        ) else {
            let fact = format!(
                "`fields` has an entry for `{}`, which is not a third body here, or has two entries",
                own.body.word()
            );
            let help = "list the body in `third_bodies`, and its field once in `fields`";
            return Err(BuildError::new(fact).help(help).at("fields"));
        };
        let turns = WorldParams { epoch: own_params.epoch.clone(), ..WorldParams::of(own.body) };
        let (dut1, pole, span) = (own_params.dut1, own_params.pole, own_params.span);
        let turns = WorldParams { turns: Some(Turning::Iau), dut1, pole, span, ..turns };
        let (size, axes) = ((own.degree, own.order), own.axes);
        let coefficients =
            coefficients(&own.file, own.format, size, files).map_err(|e| e.at("fields"))?;
        let axes = axes.unwrap_or_else(|| FieldAxes::of(own.body, Turning::Iau));
        axes.known(own.body, Turning::Iau).map_err(|e| e.at("fields"))?;
        let field = BodyField::new(&coefficients, axes);
        all[at].mu = coefficients.mu;
        all[at].field = Some((field, turns.rotation(files)?));
    }
    Ok(all)
}

/// Greatest relative difference of the gravitational parameters of file and world, first if `mu` is written in the world, then if it comes from
/// `body`.
const SAME: (f64, f64) = (1e-6, 0.02);

/// Returns an error if a field from a file does not belong to the body of the world.
fn of_the_world(mu: f64, file: &str, world: &PlanetWorld) -> Result<(), BuildError> {
    let off = |other: f64| (mu / other - 1.0).abs();
    let wrong = match (world.params.mu, world.params.body.mu()) {
        (Some(written), _) if off(written) > SAME.0 => {
            format!("`mu` of `world` is {written:e} m³/s²")
        }
        (None, Some(own)) if off(own) > SAME.1 => {
            format!("`body` of `world` is `{}`, which has {own:e} m³/s²", world.params.body.word())
        }
        _ => return Ok(()),
    };
    let fact = format!("`{file}` is the field of a body of {mu:e} m³/s², but {wrong}");
    Err(BuildError::new(fact).help("use the field of that body, or change `world`").at("file"))
}

/// Gravity of a planet from a file of spherical harmonics, rotating with the planet, and of third bodies. W is inertial with the planet at its
/// origin, or a site. With `turns: iau` or third bodies inertial axes are ICRF axes. Third bodies at a site need `turns: iau`.
#[service("environment.spherical_harmonics", Gravity)]
impl Service for SphericalHarmonics {
    type Params = HarmonicsParams;
    fn build(p: HarmonicsParams, files: &Files) -> Result<Self, BuildError> {
        let world = PlanetWorld::of(&p.world)?;
        let mut coefficients = coefficients(&p.file, p.format, (p.degree, p.order), files)?;
        of_the_world(coefficients.mu, &p.file, &world)?;
        let pullers = sources(&p, &world, files)?;
        if p.love > 0.0 && pullers.is_empty() {
            return Err(BuildError::new(
                "`love` needs third bodies, which raise the tide, but there are none",
            )
            .help("write third_bodies: [\"sun\", \"moon\"], or remove `love`")
            .at("love"));
        }
        take_permanent_tide(&mut coefficients, &p, &world)?;
        let (body, turning) = (world.params.body, world.params.turning());
        let axes = p.axes.unwrap_or_else(|| FieldAxes::of(body, turning));
        axes.known(body, turning)?;
        let field = BodyField::new(&coefficients, axes);
        let love = (p.love, field.radius());
        Ok(SphericalHarmonics { field, world, pullers, love })
    }
}

/// Returns the distance (m) of a point in W from the planet's centre.
pub(crate) fn relative_to_centre(site: Option<&Site>, p: Vec3) -> f64 {
    site.map_or(p, |s| s.relative_to_centre(&p)).norm()
}

/// Zonal harmonics of the world's body.
#[derive(Params, Clone, Debug)]
pub struct ZonalParams {
    /// Reference radius of the coefficients; default: equatorial radius of the world's body.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: Option<f64>,
    /// J₂, not normalised: the Earth 1.08262982e-3, Mars 1.9566e-3, the Moon 2.033e-4.
    pub j2: f64,
    /// J₃, not normalised.
    #[param(default = 0.0)]
    pub j3: f64,
    /// J₄, not normalised.
    #[param(default = 0.0)]
    pub j4: f64,
    /// The world, whose body has these coefficients.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// Point mass and J₂ to J₄.
pub struct ZonalGravity {
    mu: f64,
    radius: f64,
    /// J₂ and higher coefficients up to the last one that is not zero.
    j: Vec<f64>,
    world: PlanetWorld,
    /// W is inertial, and its z is not the pole of the body.
    leans: bool,
}

impl Gravity for ZonalGravity {
    fn acceleration(&self, t: f64, p: Vec3) -> Vec3 {
        let field = |p: &Vec3| zonal(self.mu, self.radius, &self.j, p);
        match self.leans {
            true => self.world.planet.gravity(t, p, field),
            false => around(&self.world.planet, p, field),
        }
    }
    fn gradient(&self, t: f64, p: Vec3) -> Option<Mat3> {
        let own = |p: &Vec3| zonal_gradient(self.mu, self.radius, &self.j, p);
        Some(match self.leans {
            true => self.world.planet.gradient(t, p, own),
            false => gradient_around(&self.world.planet, p, own),
        })
    }
    fn scale(&self, _: f64, p: Vec3) -> f64 {
        // The length scale is the same as for a series of degree 4.
        relative_to_centre(self.world.planet.site.as_ref(), p) / 6.0
    }
    fn axes(&self) -> Axes {
        self.world.planet.axes()
    }
}

/// Point mass and zonal harmonics J₂, J₃, J₄ of the world's body, about its pole.
#[service("environment.zonal_gravity", Gravity)]
impl Service for ZonalGravity {
    type Params = ZonalParams;
    fn build(p: ZonalParams, _: &Files) -> Result<Self, BuildError> {
        let world = PlanetWorld::of(&p.world)?;
        let mu = world.needs_mu()?;
        let radius = p.radius.unwrap_or_else(|| world.planet.ellipsoid.equatorial_radius());
        let mut j = vec![p.j2, p.j3, p.j4];
        j.truncate(j.iter().rposition(|j| *j != 0.0).map_or(0, |last| last + 1));
        let leans = world.planet.site.is_none() && world.params.turning() == Turning::Iau;
        Ok(ZonalGravity { mu, radius, j, world, leans })
    }
}

#[cfg(test)]
mod tests;

//! Parameters of the world, and the planet that they describe.
use super::body::Centre;
use crate::third::Third;
use linkwork_spatial::Mat3;
use linkwork_surroundings::SOLAR_CONSTANT;
use linkwork_surroundings::prelude::*;
use linkwork_world::WorldError;
use linkwork_world::planet::rotation::{
    Earth, EarthOrientation, EarthParameters, FixedRate, PckConstants, PckKernel,
};
use linkwork_world::planet::{self as world, Ellipsoid, Epoch, Geodetic, Rotation, Spin};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Default of [`WorldParams::span`], s.
const SPAN: f64 = 172_800.0;

fn told(e: &WorldError) -> BuildError {
    BuildError::of(e)
}

/// Converts an error of the physics library to an error of the runtime, with the parameter.
pub(crate) fn fault(e: &WorldError, param: &str) -> BuildError {
    BuildError::of(e).at(param)
}

/// Rotation of a planet in W.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turning {
    /// No rotation: the planet's axes are fixed in W at `angle`.
    Still,
    /// Rotation about z of W at a constant rate.
    Fixed,
    /// Pole and prime meridian of the IAU; needs an epoch.
    Iau,
}

/// Site on the ellipsoid, with local axes.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub struct SiteParams {
    /// Geodetic latitude, north positive.
    #[param(unit = "rad", range = -FRAC_PI_2..=FRAC_PI_2)]
    pub latitude: f64,
    /// East longitude.
    #[param(unit = "rad", range = -TAU..=TAU)]
    pub longitude: f64,
    /// Height of the origin above the ellipsoid.
    #[param(unit = "m", default = 0.0)]
    pub height: f64,
    /// Angle of x from east towards north: y is north for 0.
    #[param(unit = "rad", default = 0.0, range = -TAU..=TAU)]
    pub heading: f64,
    /// `false`: level ground without the centrifugal and Coriolis accelerations of the planet's rotation.
    #[param(default = true)]
    pub turning: bool,
}

/// Parameters of the world of a simulation: body, rotation, epoch and frame W.
#[derive(Params, Clone, Debug)]
pub struct WorldParams {
    /// Central body of the simulation: earth, mars, moon. With `other` write `radius`, `rate` (or `turns: still`), and `mu` if gravity needs it.
    pub body: Centre,
    /// Gravitational parameter; default: value of the body.
    #[param(unit = "m^3/s^2", range = 1e-12..)]
    pub mu: Option<f64>,
    /// Rotation: still, fixed (about z of W), iau (inertial axes are then the ICRF). Default: iau with an `epoch`, otherwise fixed.
    pub turns: Option<Turning>,
    /// Rotation rate about z of W for `fixed`; default: value of the body.
    #[param(unit = "rad/s")]
    pub rate: Option<f64>,
    /// Angle from x of W (at a site: of the inertial axes) to the prime meridian at t = 0, for `still` and `fixed`; default: 0. Required for `fixed`
    /// with an `epoch`.
    #[param(unit = "rad")]
    pub angle: Option<f64>,
    /// Date of t = 0, such as 2012-08-06 05:17:57 UTC (or TAI, TT, TDB).
    #[param(default = None)]
    pub epoch: Option<String>,
    /// SPK kernel (.bsp, such as de440.bsp of NAIF, or one of a small body or spacecraft: types 1, 2, 3, 5, 8, 9, 12, 13, 17, 21) for the positions of Sun,
    /// Moon and planets; default: series for 1900 to 2100 (Sun, Earth, Moon, some km) and ellipses for 1800 to 2050 (planets, 27″ for Mars).
    #[param(default = None)]
    pub kernel: Option<String>,
    /// Time span of the interpolation tables for the Earth's axis, Sun and Moon. At later times every query is computed directly, which is a thousand
    /// times slower.
    #[param(unit = "s", default = SPAN, range = 1.0..=1e9)]
    pub span: f64,
    /// UT1 − UTC at the epoch, for the Earth. The default 0 is wrong by up to 0.9 s, which is 400 m on the ground.
    #[param(unit = "s", default = 0.0, range = -1.0..=1.0)]
    pub dut1: f64,
    /// Coordinates x, y of the Earth's pole, rad.
    #[param(default = [0.0, 0.0])]
    pub pole: [f64; 2],
    /// File with UT1, the pole and its offsets day by day, for the Earth with `turns: iau`: finals2000A or EOP 20 C04 of the IERS,
    /// EOP-All.csv of CelesTrak. It replaces `dut1` and `pole`.
    #[param(default = None)]
    pub orientation: Option<String>,
    /// Kernel of planetary constants. A text kernel (.tpc, such as pck00011.tpc of NAIF) has pole and prime meridian of the body `naif` with `turns: iau`,
    /// and its radii as defaults. A binary kernel (.bpc, such as moon_pa_de440_200625.bpc) has the rotation by Chebyshev polynomials.
    #[param(default = None)]
    pub constants: Option<String>,
    /// NAIF ID of the body in `constants`, such as 499 for Mars, 2000001 for Ceres; in a binary kernel the number of the axes, such as 31008 for the
    /// Moon's principal axes of DE440.
    #[param(default = None)]
    pub naif: Option<u32>,
    /// Equatorial radius for heights; default: value of the body (WGS 84, IAU).
    #[param(unit = "m", range = 1.0..)]
    pub radius: Option<f64>,
    /// Flattening for heights; default: value of the body.
    #[param(range = 0.0..=0.5)]
    pub flattening: Option<f64>,
    /// Site of W on the planet; default: W is inertial, with the body's centre at its origin.
    pub site: Option<SiteParams>,
    /// Mean distance of the Sun in AU, for a Sun without an ephemeris; default: value of the body.
    #[param(range = 1e-3..)]
    pub sun_distance: Option<f64>,
    /// Solar irradiance at 1 AU; the solar radiation pressure is this value over the speed of light.
    #[param(unit = "W/m^2", default = SOLAR_CONSTANT, range = 0.0..)]
    pub solar_constant: f64,
    /// Bodies that eclipse the Sun in addition to the central one; need an `epoch`: moon, earth, venus, mars, jupiter. Default: the Moon for the
    /// Earth, the Earth for the Moon.
    #[param(default = None)]
    pub shadows: Option<Vec<Third>>,
}

impl WorldParams {
    /// Returns the parameters of a body with default values.
    pub fn of(body: Centre) -> WorldParams {
        WorldParams {
            body,
            mu: None,
            turns: None,
            rate: None,
            angle: None,
            sun_distance: None,
            solar_constant: SOLAR_CONSTANT,
            shadows: None,
            epoch: None,
            kernel: None,
            span: SPAN,
            dut1: 0.0,
            pole: [0.0, 0.0],
            orientation: None,
            constants: None,
            naif: None,
            radius: None,
            flattening: None,
            site: None,
        }
    }

    /// Returns the kind of rotation, by default from `epoch`.
    pub(crate) fn turning(&self) -> Turning {
        let of_date = self.epoch.is_some() && self.body != Centre::Other;
        let otherwise = if of_date { Turning::Iau } else { Turning::Fixed };
        self.turns.unwrap_or(otherwise)
    }

    /// Checks that directions from an ephemeris are defined: a site needs the pole of the IAU, but `fixed` and `still` define another pole.
    pub(crate) fn among_the_stars(&self, what: &str) -> Result<(), BuildError> {
        if self.site.is_none() || self.turning() == Turning::Iau {
            return Ok(());
        }
        let fact = format!(
            "{what} from an ephemeris needs the inertial direction of the planet's pole, which the `site` of `world` does not define"
        );
        let help =
            "write `turns: iau` in `world`; a Sun without an ephemeris is `environment.fixed_sun`";
        Err(BuildError::new(fact).help(help))
    }

    /// Returns the epoch; `why` names the feature that needs it.
    pub fn epoch(&self, why: &str) -> Result<Epoch, BuildError> {
        let Some(text) = &self.epoch else {
            return Err(BuildError::new(format!("{why} needs an epoch, but `world` has none"))
                .help("write `epoch: \"2012-08-06 05:17:57 UTC\"` in `world`"));
        };
        Epoch::parse(text).map_err(|e| told(&e))
    }

    /// Returns the Earth's rotation by the table `orientation`, if one is written.
    fn by_day(&self, epoch: &Epoch, files: &Files) -> Result<Option<Earth>, BuildError> {
        let Some(file) = &self.orientation else { return Ok(None) };
        if self.dut1 != 0.0 || self.pole != [0.0, 0.0] {
            let fact = format!(
                "`dut1` or `pole` is written in addition to the table `{file}`, which contains both"
            );
            return Err(BuildError::new(fact).help("remove them, or `orientation`"));
        }
        let text = files.text(file)?;
        let table = EarthOrientation::read(file, &text).map_err(|e| told(&e))?;
        Earth::by_day(epoch, &table, self.span).map(Some).map_err(|e| told(&e))
    }

    /// Returns the kernel in `constants`, and the NAIF ID of the body.
    fn constants(&self, files: &Files) -> Result<Option<(Constants, u32)>, BuildError> {
        match (&self.constants, self.naif) {
            (None, None) => Ok(None),
            (Some(file), Some(body)) => {
                if let Some(bytes) = binary(file, files)? {
                    let kernel = PckKernel::parse(file, &bytes).map_err(|e| told(&e))?;
                    return Ok(Some((Constants::Binary(kernel), body)));
                }
                let text = files.text(file)?;
                let pck = PckConstants::read(file, &text).map_err(|e| told(&e))?;
                Ok(Some((Constants::Text(pck), body)))
            }
            _ => {
                let fact = "`constants` and `naif` must be written together";
                let help = "write both, such as constants: \"pck00011.tpc\", naif: 499";
                Err(BuildError::new(fact).help(help))
            }
        }
    }

    pub(crate) fn rotation(&self, files: &Files) -> Result<Rotation, BuildError> {
        self.rotation_with(self.constants(files)?, files)
    }

    fn rotation_with(
        &self,
        constants: Option<(Constants, u32)>,
        files: &Files,
    ) -> Result<Rotation, BuildError> {
        let turns = self.turning();
        if self.orientation.is_some() && (turns, self.body) != (Turning::Iau, Centre::Earth) {
            let fact = "`orientation` requires the Earth with `turns: iau`";
            let help = "remove `orientation`, or write `body: earth` and `turns: iau`";
            return Err(BuildError::new(fact).help(help));
        }
        let fixed =
            |rate: f64| FixedRate::about_z(self.angle.unwrap_or(0.0), rate).map(Rotation::Fixed);
        if let (Turning::Iau, Some(_)) = (turns, self.angle) {
            let fact =
                "`angle` is written, but `turns: iau` computes the prime meridian from the epoch";
            return Err(BuildError::new(fact).help("remove `angle`, or write `turns: fixed`"));
        }
        if (turns, self.angle, self.epoch.is_some()) == (Turning::Fixed, None, true) {
            let fact = "there is an `epoch`, but `turns: fixed` does not define the prime meridian at that date";
            let help = "write `turns: iau` to compute it from the epoch, or the `angle` from x of W to the prime meridian";
            return Err(BuildError::new(fact).help(help));
        }
        if let Some((constants, body)) = constants {
            if (turns, self.body == Centre::Earth) != (Turning::Iau, false) {
                let fact = "`constants` is written, but the rotation of the body does not use it";
                let help = "write `turns: iau` and a body other than earth, or remove `constants`";
                return Err(BuildError::new(fact).help(help));
            }
            let epoch = self.epoch("`constants`")?;
            let days = epoch.tdb_days();
            let made = match constants {
                Constants::Text(pck) => pck.rotation(body, days).map(Rotation::Iau),
                Constants::Binary(kernel) => {
                    kernel.rotation(body.cast_signed(), days).map(Rotation::Kernel)
                }
            };
            return made.map_err(|e| told(&e));
        }
        let made = match (turns, self.body) {
            (Turning::Still, _) => fixed(0.0),
            (Turning::Fixed, body) => match self.rate.or_else(|| body.rate()) {
                Some(rate) => fixed(rate),
                None => {
                    let fact = "`body: other` has no `rate` of rotation";
                    return Err(BuildError::new(fact).help("write `rate`, or `turns: still`"));
                }
            },
            (Turning::Iau, Centre::Other) => {
                let fact = "`turns: iau` without `constants` is only supported for the Earth, Mars and the Moon";
                return Err(BuildError::new(fact).help(
                    "write `constants: \"pck00011.tpc\", naif: 499`, `turns: fixed` with `rate` and `angle`, or `turns: still`",
                ));
            }
            (Turning::Iau, Centre::Mars) => Ok(Rotation::mars(&self.epoch("`turns: iau`")?)),
            (Turning::Iau, Centre::Moon) => Ok(Rotation::moon(&self.epoch("`turns: iau`")?)),
            (Turning::Iau, Centre::Earth) => {
                let epoch = self.epoch("`turns: iau`")?;
                if let Some(earth) = self.by_day(&epoch, files)? {
                    return Ok(Rotation::Earth(Box::new(earth)));
                }
                let bulletin = EarthParameters {
                    dut1: self.dut1,
                    pole: self.pole,
                    ..EarthParameters::default()
                };
                Earth::new(&epoch, bulletin, self.span).map(|e| Rotation::Earth(Box::new(e)))
            }
        };
        made.map_err(|e| told(&e))
    }

    /// Checks that the rotation uses the parameters of the Earth's orientation, and that the tables are used, if these are written.
    fn of_the_earth(&self) -> Result<(), BuildError> {
        let rotates = (self.turning(), self.body) == (Turning::Iau, Centre::Earth);
        let written = [("dut1", self.dut1 != 0.0), ("pole", self.pole != [0.0, 0.0])];
        if let Some((name, _)) = written.iter().find(|w| w.1 && !rotates) {
            let fact = format!(
                "`{name}` is written, but only the rotation of the Earth with `turns: iau` uses it"
            );
            let help = format!("remove `{name}`, or write `body: earth` and an `epoch`");
            return Err(BuildError::new(fact).help(help).at(*name));
        }
        if self.span != SPAN && self.epoch.is_none() {
            let fact = "`span` is written, but tables over time need an `epoch`";
            let help = "remove `span`, or write an `epoch`";
            return Err(BuildError::new(fact).help(help).at("span"));
        }
        Ok(())
    }

    /// Checks it and makes its tables; `files` has the one of `orientation`.
    pub fn planet(&self, files: &Files) -> Result<Planet, BuildError> {
        if self.rate.is_some() && self.turning() != Turning::Fixed {
            return Err(BuildError::new(
                "`rate` is written, but the rotation of the planet does not use it",
            )
            .help("remove `rate`, or write `turns: fixed`"));
        }
        self.of_the_earth()?;
        let constants = self.constants(files)?;
        let own = match &constants {
            Some((Constants::Text(pck), body)) => match pck.radii(*body) {
                // Heights use the mean of the two equatorial radii.
                Some([x, y, z]) if 2.0 * z <= x + y => {
                    let equator = 0.5 * (x + y);
                    Some(Ellipsoid::new(equator, 1.0 - z / equator).map_err(|e| told(&e))?)
                }
                _ => self.body.ellipsoid(),
            },
            _ => self.body.ellipsoid(),
        };
        let Some(radius) = self.radius.or(own.map(|o| o.equatorial_radius())) else {
            let fact = "`body: other` has no `radius`";
            return Err(BuildError::new(fact)
                .help("write the equatorial radius above which heights are measured"));
        };
        let flattening = self.flattening.or(own.map(|o| o.flattening())).unwrap_or(0.0);
        let ellipsoid = Ellipsoid::new(radius, flattening).map_err(|e| told(&e))?;
        let rotation = self.rotation_with(constants, files)?;
        let place = self.site.map(|s| site(&s, &ellipsoid, &rotation)).transpose()?;
        let turning = self.site.is_none_or(|s| s.turning);
        let epoch = self.epoch.clone();
        if let Some(text) = &epoch {
            Epoch::parse(text).map_err(|e| told(&e))?;
        }
        Ok(Planet { ellipsoid, rotation, site: place, turning, epoch })
    }
}

/// Kernel of planetary constants.
enum Constants {
    /// Pole, prime meridian and radii.
    Text(PckConstants),
    /// Euler angles.
    Binary(PckKernel),
}

/// Returns the bytes of a file that is a binary kernel.
fn binary(file: &str, files: &Files) -> Result<Option<Vec<u8>>, BuildError> {
    let Some(path) = files.resolve(file).ok().filter(|path| path.is_file()) else {
        return Ok(None);
    };
    let bytes = std::fs::read(path)
        .map_err(|e| BuildError::new(format!("the file `{file}` cannot be read: {e}")))?;
    Ok(PckKernel::is_binary(&bytes).then_some(bytes))
}

/// Returns the site of W on a planet that continues to rotate as at t = 0.
fn site(s: &SiteParams, ellipsoid: &Ellipsoid, rotation: &Rotation) -> Result<Site, BuildError> {
    let place = Geodetic { latitude: s.latitude, longitude: s.longitude, altitude: s.height };
    let pose = world::Site::new(ellipsoid, place, s.heading).pose;
    if !(s.height > -ellipsoid.polar_radius() && pose.position.norm().is_finite()) {
        let fact = format!("a site at a height of {} m is beyond the planet's centre", s.height);
        let help = "write its height above the ellipsoid, negative below it";
        return Err(BuildError::new(fact).help(help));
    }
    let spin = rotation.at(0.0);
    // Use the rate of the file itself, without round-off from a conversion.
    let rate = if let Rotation::Fixed(f) = rotation { f.rate } else { spin.omega_P().z };
    Ok(Site { pose, rate, start: spin.R_IP })
}

/// Wind relative to the ground at one height.
#[derive(Params, Clone, Debug)]
pub struct WindLayer {
    /// Height above the ellipsoid.
    #[param(unit = "m")]
    pub altitude: f64,
    /// Velocity of the air to the east: a wind *from* the west is positive.
    #[param(unit = "m/s", default = 0.0)]
    pub east: f64,
    /// Velocity of the air to the north.
    #[param(unit = "m/s", default = 0.0)]
    pub north: f64,
    /// Velocity of the air upwards.
    #[param(unit = "m/s", default = 0.0)]
    pub up: f64,
}

/// Factor on the density of an atmosphere model at one height.
#[derive(Params, Clone, Debug)]
pub struct DensityLayer {
    /// Height above the ellipsoid.
    #[param(unit = "m")]
    pub altitude: f64,
    /// Ratio of the density to the model's density; the pressure has the same factor.
    #[param(default = 1.0, range = 0.0..)]
    pub factor: f64,
}

/// Shape and rotation of the planet, prepared for evaluation.
#[derive(Clone, Debug)]
pub struct Planet {
    /// Shape for heights.
    pub ellipsoid: Ellipsoid,
    /// Rotation in inertial axes; without a site these are W.
    pub rotation: Rotation,
    /// Site, if W is on the planet.
    pub site: Option<Site>,
    /// The dynamics at a site include the rotation of the planet.
    pub turning: bool,
    /// Date of t = 0 as in the file.
    pub epoch: Option<String>,
}

impl Planet {
    /// Returns an error if the rotation is not known at t (s). At a site only its start counts.
    pub(crate) fn failure(&self, t: f64) -> Option<BuildError> {
        let Rotation::Kernel(kernel) = &self.rotation else { return None };
        let [first, last] = kernel.range();
        if self.site.is_some() || (first..=last).contains(&t) {
            return None;
        }
        let fact = format!(
            "the kernel `{}` has the rotation of the body from t = {first:.0} s to {last:.0} s, but not at {t} s",
            kernel.file()
        );
        let help = format!(
            "end the run before t = {:.0} s, or write a kernel in `constants` that covers this date",
            last.floor()
        );
        Some(BuildError::new(fact).help(help))
    }

    /// Returns the type of W.
    pub fn axes(&self) -> Axes {
        match (self.site, self.turning) {
            (None, _) => Axes::Inertial,
            (Some(site), true) => Axes::Site(site),
            (Some(site), false) => Axes::Level(site),
        }
    }

    /// Returns the rotation state at t (s) and the geodetic position of a point (m, W), which is `None` within 43 km of the centre. At a site the
    /// planet is at rest in W: its axes are constant and its angular velocity is zero.
    pub fn place(&self, t: f64, p: Vec3) -> (Spin, Option<Geodetic>) {
        if let Some(site) = &self.site {
            let place = self.ellipsoid.geodetic(&site.to_planet(&p)).ok();
            let still = Spin { R_IP: site.pose.rotation.inverse(), omega_I: Vec3::zeros() };
            return (still, place);
        }
        let spin = self.rotation.at(t);
        let place = self.ellipsoid.geodetic(&(spin.R_IP.inverse() * p)).ok();
        (spin, place)
    }

    /// Returns `R_WP` at t (s), the rotation from planet-fixed axes to W.
    pub fn axes_at(&self, t: f64) -> Quat {
        match &self.site {
            Some(site) => site.pose.rotation.inverse(),
            None => self.rotation.at(t).R_IP,
        }
    }

    /// Returns the acceleration (m/s², W) at `p` (m, W) of a field in planet-fixed axes, including the centrifugal part at a site.
    pub fn gravity(&self, t: f64, p: Vec3, field: impl Fn(&Vec3) -> Vec3) -> Vec3 {
        if self.site.is_some() {
            return crate::world::around(self, p, field);
        }
        let R_IP = self.rotation.at(t).R_IP;
        R_IP * field(&(R_IP.inverse() * p))
    }

    /// Returns the gradient ∂a/∂p (1/s², W) of [`Planet::gravity`] from the gradient of the field in planet-fixed axes.
    pub fn gradient(&self, t: f64, p: Vec3, gradient: impl Fn(&Vec3) -> Mat3) -> Mat3 {
        if self.site.is_some() {
            return crate::world::gradient_around(self, p, gradient);
        }
        let R_IP = self.rotation.at(t).R_IP;
        let R = R_IP.to_rotation_matrix().into_inner();
        R * gradient(&(R_IP.inverse() * p)) * R.transpose()
    }
}

/// Returns the acceleration (m/s², W) of a field in planet-fixed axes, including the centrifugal part if W is a rotating site; without a site the
/// field is in axes of W.
pub(crate) fn around(planet: &Planet, p: Vec3, field: impl Fn(&Vec3) -> Vec3) -> Vec3 {
    match &planet.site {
        Some(s) => {
            let own = s.from_planet_axes(&field(&s.to_planet(&p)));
            if planet.turning { own + s.centrifugal(&p) } else { own }
        }
        None => field(&p),
    }
}

/// Returns the gradient ∂a/∂p (1/s²) of [`around`] from the gradient of the field.
pub(crate) fn gradient_around(planet: &Planet, p: Vec3, gradient: impl Fn(&Vec3) -> Mat3) -> Mat3 {
    let Some(s) = &planet.site else { return gradient(&p) };
    let (R, omega) = (s.pose.rotation.to_rotation_matrix().into_inner(), s.omega());
    let own = R.transpose() * gradient(&s.to_planet(&p)) * R;
    match planet.turning {
        true => own + Mat3::identity() * omega.norm_squared() - omega * omega.transpose(),
        false => own,
    }
}

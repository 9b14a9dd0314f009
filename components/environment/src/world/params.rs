//! Parameters of the world, and the planet that they describe.
use super::body::Centre;
use crate::third::Third;
use linkwork_runtime::SOLAR_CONSTANT;
use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;
use linkwork_world::WorldError;
use linkwork_world::planet::rotation::{
    Earth, EarthOrientation, EarthParameters, FixedRate, PckConstants,
};
use linkwork_world::planet::{self as world, Ellipsoid, Epoch, Geodetic, Rotation, Spin};
use std::f64::consts::{FRAC_PI_2, TAU};

fn told(e: &WorldError) -> BuildError {
    BuildError::of(e)
}

/// A mistake that the physics found, as the runtime reports it: the fact, the remedy, the parameter.
pub(crate) fn fault(e: &WorldError, param: &str) -> BuildError {
    BuildError::of(e).at(param)
}

/// How a planet turns in W.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turning {
    /// Not at all: W is fixed to the planet's axes at `angle`.
    Still,
    /// About z of W at one rate.
    Fixed,
    /// Pole and meridian of the IAU; needs an epoch.
    Iau,
}

/// A place of the ellipsoid, with axes there.
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
    /// `false`: level ground, on which the centrifugal and Coriolis accelerations of the planet's rotation are left out.
    #[param(default = true)]
    pub turning: bool,
}

/// The world of a simulation: a body, its rotation, the date, and what W is.
#[derive(Params, Clone, Debug)]
pub struct WorldParams {
    /// Body around which the simulation is: earth, mars, moon; other: write `radius`, `rate` (or `turns: still`), and `mu` where it is needed.
    pub body: Centre,
    /// Gravity parameter; default: the body's.
    #[param(unit = "m^3/s^2", range = 1e-12..)]
    pub mu: Option<f64>,
    /// How it turns: still, fixed (about z of W), iau (W is then the ICRF). Default: iau where there is an `epoch`, else fixed.
    pub turns: Option<Turning>,
    /// Rate about z of W for `fixed`; default: the body's own.
    #[param(unit = "rad/s")]
    pub rate: Option<f64>,
    /// Angle from x of W (in a site: of the inertial axes) to the prime meridian at t = 0, for `still` and `fixed`; default: 0. `fixed` with an `epoch` needs it.
    #[param(unit = "rad")]
    pub angle: Option<f64>,
    /// Date of t = 0, such as 2012-08-06 05:17:57 UTC (or TAI, TT, TDB).
    #[param(default = None)]
    pub epoch: Option<String>,
    /// SPK kernel (.bsp, such as de440.bsp of NAIF, or one of a small body or spacecraft: types 1, 2, 3, 8, 9, 12, 13, 21) by which Sun, Moon and planets move; default: by series for
    /// 1900 to 2100 (Sun, Earth, Moon, some km) and ellipses for 1800 to 2050 (planets, 27″ for Mars).
    #[param(default = None)]
    pub kernel: Option<String>,
    /// How long tables of the Earth's axis and of Sun and Moon are made for; beyond it they are computed
    /// anew at each look, a thousand times slower.
    #[param(unit = "s", default = 172_800.0, range = 1.0..=1e9)]
    pub span: f64,
    /// UT1 − UTC at the epoch, for the Earth; 0 is wrong by up to 0.9 s, 400 m on the ground.
    #[param(unit = "s", default = 0.0, range = -1.0..=1.0)]
    pub dut1: f64,
    /// Coordinates x, y of the Earth's pole, rad.
    #[param(default = [0.0, 0.0])]
    pub pole: [f64; 2],
    /// File with UT1, the pole and its offsets day by day, for the Earth with `turns: iau`: finals2000A or EOP 20 C04 of the IERS,
    /// EOP-All.csv of CelesTrak. It takes the place of `dut1` and `pole`.
    #[param(default = None)]
    pub orientation: Option<String>,
    /// Text kernel of planetary constants (.tpc, such as pck00011.tpc of NAIF): pole and prime meridian of the body `naif` with `turns: iau`,
    /// and its radii where they are not written.
    #[param(default = None)]
    pub constants: Option<String>,
    /// NAIF's number of the body in `constants`, such as 499 for Mars, 2000001 for Ceres.
    #[param(default = None)]
    pub naif: Option<u32>,
    /// Equatorial radius for heights; default: the body's (WGS 84, IAU).
    #[param(unit = "m", range = 1.0..)]
    pub radius: Option<f64>,
    /// Flattening for heights; default: the body's.
    #[param(range = 0.0..=0.5)]
    pub flattening: Option<f64>,
    /// Where W is on the planet; default: W is inertial, with the body's centre at its origin.
    pub site: Option<SiteParams>,
    /// Mean distance of the Sun in AU, for a Sun without an ephemeris; default: the body's.
    #[param(range = 1e-3..)]
    pub sun_distance: Option<f64>,
    /// Power of sunlight at 1 AU; its pressure is this over the speed of light.
    #[param(unit = "W/m^2", default = SOLAR_CONSTANT, range = 0.0..)]
    pub solar_constant: f64,
    /// Bodies that hide the Sun in addition to the central one, with an `epoch`: moon, earth, venus, mars, jupiter. Default: the Moon at the
    /// Earth, the Earth at the Moon.
    #[param(default = None)]
    pub shadows: Option<Vec<Third>>,
}

impl WorldParams {
    /// A body that turns about z of W at its own rate.
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
            span: 172_800.0,
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

    /// How it turns, where that is not written.
    pub(crate) fn turning(&self) -> Turning {
        let of_date = self.epoch.is_some() && self.body != Centre::Other;
        let otherwise = if of_date { Turning::Iau } else { Turning::Fixed };
        self.turns.unwrap_or(otherwise)
    }

    /// Directions by an ephemeris are known from a site whose pole is that of the IAU: `fixed` and `still` have a pole of their own.
    pub(crate) fn among_the_stars(&self, what: &str) -> Result<(), BuildError> {
        if self.site.is_none() || self.turning() == Turning::Iau {
            return Ok(());
        }
        let fact = format!(
            "{what} by an ephemeris needs the planet's pole among the stars, and the `site` of `world` has another"
        );
        let help =
            "write `turns: iau` in `world`; a Sun without an ephemeris is `environment.fixed_sun`";
        Err(BuildError::new(fact).help(help))
    }

    /// The epoch; `why` says what needs it.
    pub fn epoch(&self, why: &str) -> Result<Epoch, BuildError> {
        let Some(text) = &self.epoch else {
            return Err(BuildError::new(format!("{why} needs an epoch, and there is none"))
                .help("write `epoch: \"2012-08-06 05:17:57 UTC\"` in `world`"));
        };
        Epoch::parse(text).map_err(|e| told(&e))
    }

    /// The Earth by its table, where one is written.
    fn by_day(&self, epoch: &Epoch, files: &Files) -> Result<Option<Earth>, BuildError> {
        let Some(file) = &self.orientation else { return Ok(None) };
        if self.dut1 != 0.0 || self.pole != [0.0, 0.0] {
            let fact =
                format!("`dut1` or `pole` is written beside the table `{file}`, which has both");
            return Err(BuildError::new(fact).help("remove them, or `orientation`"));
        }
        let text = files.text(file)?;
        let table = EarthOrientation::read(file, &text).map_err(|e| told(&e))?;
        Earth::by_day(epoch, &table, self.span).map(Some).map_err(|e| told(&e))
    }

    /// The constants of `constants`, and the body's number in them.
    fn constants(&self, files: &Files) -> Result<Option<(PckConstants, u32)>, BuildError> {
        match (&self.constants, self.naif) {
            (None, None) => Ok(None),
            (Some(file), Some(body)) => {
                let text = files.text(file)?;
                let pck = PckConstants::read(file, &text).map_err(|e| told(&e))?;
                Ok(Some((pck, body)))
            }
            _ => {
                let fact = "`constants` and `naif` belong together";
                let help = "write both, such as constants: \"pck00011.tpc\", naif: 499";
                Err(BuildError::new(fact).help(help))
            }
        }
    }

    pub(crate) fn rotation(&self, files: &Files) -> Result<Rotation, BuildError> {
        let turns = self.turning();
        if self.orientation.is_some() && (turns, self.body) != (Turning::Iau, Centre::Earth) {
            let fact = "`orientation` is written, but this is no Earth that turns by the IAU";
            let help = "remove `orientation`, or write `body: earth` and `turns: iau`";
            return Err(BuildError::new(fact).help(help));
        }
        let fixed =
            |rate: f64| FixedRate::about_z(self.angle.unwrap_or(0.0), rate).map(Rotation::Fixed);
        if let (Turning::Iau, Some(_)) = (turns, self.angle) {
            let fact = "`angle` is written, and `turns: iau` has the meridian of the date";
            return Err(BuildError::new(fact).help("remove `angle`, or write `turns: fixed`"));
        }
        if (turns, self.angle, self.epoch.is_some()) == (Turning::Fixed, None, true) {
            let fact = "there is an `epoch`, and `turns: fixed` does not say where the prime meridian is at that date";
            let help = "write `turns: iau`, by which it follows from the date, or the `angle` from x of W to the prime meridian";
            return Err(BuildError::new(fact).help(help));
        }
        if let Some((pck, body)) = self.constants(files)? {
            if (turns, self.body == Centre::Earth) != (Turning::Iau, false) {
                let fact = "`constants` is written, and the body does not turn by them";
                let help = "write `turns: iau` and a body other than earth, or remove `constants`";
                return Err(BuildError::new(fact).help(help));
            }
            let epoch = self.epoch("`constants`")?;
            let made = pck.rotation(body, epoch.tdb_days());
            return made.map(Rotation::Iau).map_err(|e| told(&e));
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
                let fact = "`turns: iau` is known for the Earth, Mars and the Moon";
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

    /// Checks it and makes its tables; `files` has the one of `orientation`.
    pub fn planet(&self, files: &Files) -> Result<Planet, BuildError> {
        if self.rate.is_some() && self.turning() != Turning::Fixed {
            return Err(BuildError::new("`rate` is written, but the planet does not turn by it")
                .help("remove `rate`, or write `turns: fixed`"));
        }
        let own = match self.constants(files)? {
            Some((pck, body)) => match pck.radii(body) {
                // The mean of the two radii of the equator, which heights are counted from.
                Some([x, y, z]) if 2.0 * z <= x + y => {
                    let equator = 0.5 * (x + y);
                    Some(Ellipsoid::new(equator, 1.0 - z / equator).map_err(|e| told(&e))?)
                }
                _ => self.body.ellipsoid(),
            },
            None => self.body.ellipsoid(),
        };
        let Some(radius) = self.radius.or(own.map(|o| o.equatorial_radius())) else {
            let fact = "`body: other` has no `radius`";
            return Err(BuildError::new(fact).help("write the radius from which heights count"));
        };
        let flattening = self.flattening.or(own.map(|o| o.flattening())).unwrap_or(0.0);
        let ellipsoid = Ellipsoid::new(radius, flattening).map_err(|e| told(&e))?;
        let rotation = self.rotation(files)?;
        let place = self.site.map(|s| site(&s, &ellipsoid, &rotation)).transpose()?;
        let turning = self.site.is_none_or(|s| s.turning);
        let epoch = self.epoch.clone();
        if let Some(text) = &epoch {
            Epoch::parse(text).map_err(|e| told(&e))?;
        }
        Ok(Planet { ellipsoid, rotation, site: place, turning, epoch })
    }
}

/// W at a place of a planet that turns on as it does at t = 0.
fn site(s: &SiteParams, ellipsoid: &Ellipsoid, rotation: &Rotation) -> Result<Site, BuildError> {
    let place = Geodetic { latitude: s.latitude, longitude: s.longitude, altitude: s.height };
    let pose = world::Site::new(ellipsoid, place, s.heading).pose;
    if !(s.height > -ellipsoid.polar_radius() && pose.position.norm().is_finite()) {
        let fact = format!("a site at a height of {} m is inside the planet's centre", s.height);
        let help = "write its height above the ellipsoid, negative below it";
        return Err(BuildError::new(fact).help(help));
    }
    let spin = rotation.at(0.0);
    // The rate that is written, no digit changed, where one is.
    let rate = if let Rotation::Fixed(f) = rotation { f.rate } else { spin.omega_P().z };
    Ok(Site { pose, rate, start: spin.R_IP })
}

/// A layer of wind over the ground.
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

/// How the air at a height differs from its model's.
#[derive(Params, Clone, Debug)]
pub struct DensityLayer {
    /// Height above the ellipsoid.
    #[param(unit = "m")]
    pub altitude: f64,
    /// Density over that of the model; the pressure has the same factor.
    #[param(default = 1.0, range = 0.0..)]
    pub factor: f64,
}

/// Shape and rotation, ready to be evaluated.
#[derive(Clone, Debug)]
pub struct Planet {
    /// Shape for heights.
    pub ellipsoid: Ellipsoid,
    /// Rotation in inertial axes, which W is without a site.
    pub rotation: Rotation,
    /// W, when it stands on the planet.
    pub site: Option<Site>,
    /// W turns with the planet in the dynamics, where it stands on it.
    pub turning: bool,
    /// The date of t = 0, as written.
    pub epoch: Option<String>,
}

impl Planet {
    /// What W is.
    pub fn axes(&self) -> Axes {
        match (self.site, self.turning) {
            (None, _) => Axes::Inertial,
            (Some(site), true) => Axes::Site(site),
            (Some(site), false) => Axes::Level(site),
        }
    }

    /// The spin at t (s) and the geodetic place of a point (m, W); no place within 43 km of the centre.
    /// Seen from a site the planet stands still: its axes in W, and no angular velocity.
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

    /// `R_WP` at t (s): the planet's axes in W.
    pub fn axes_at(&self, t: f64) -> Quat {
        match &self.site {
            Some(site) => site.pose.rotation.inverse(),
            None => self.rotation.at(t).R_IP,
        }
    }

    /// Acceleration (m/s², W) at `p` (m, W) in a field that is fixed to the planet and given in its axes, with the
    /// centrifugal part where W is a site.
    pub fn gravity(&self, t: f64, p: Vec3, field: impl Fn(&Vec3) -> Vec3) -> Vec3 {
        if self.site.is_some() {
            return crate::world::around(self, p, field);
        }
        let R_IP = self.rotation.at(t).R_IP;
        R_IP * field(&(R_IP.inverse() * p))
    }

    /// ∂a/∂p (1/s², W) of [`Planet::gravity`], given that of the field in the planet's axes.
    pub fn gradient(&self, t: f64, p: Vec3, gradient: impl Fn(&Vec3) -> Mat3) -> Mat3 {
        if self.site.is_some() {
            return crate::world::gradient_around(self, p, gradient);
        }
        let R_IP = self.rotation.at(t).R_IP;
        let R = R_IP.to_rotation_matrix().into_inner();
        R * gradient(&(R_IP.inverse() * p)) * R.transpose()
    }
}

/// A field (m/s²) that is given in axes of the planet, at a site that W is, with the centrifugal part where W turns; without a site, in axes of W.
pub(crate) fn around(planet: &Planet, p: Vec3, field: impl Fn(&Vec3) -> Vec3) -> Vec3 {
    match &planet.site {
        Some(s) => {
            let own = s.from_planet_axes(&field(&s.to_planet(&p)));
            if planet.turning { own + s.centrifugal(&p) } else { own }
        }
        None => field(&p),
    }
}

/// ∂a/∂p (1/s²) of the same, given that of the field.
pub(crate) fn gradient_around(planet: &Planet, p: Vec3, gradient: impl Fn(&Vec3) -> Mat3) -> Mat3 {
    let Some(s) = &planet.site else { return gradient(&p) };
    let (R, omega) = (s.pose.rotation.to_rotation_matrix().into_inner(), s.omega());
    let own = R.transpose() * gradient(&s.to_planet(&p)) * R;
    match planet.turning {
        true => own + Mat3::identity() * omega.norm_squared() - omega * omega.transpose(),
        false => own,
    }
}

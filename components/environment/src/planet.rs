//! The planet around which a simulation is: what gravity and air fixed to a planet share.
//! ```text
//! W = I     inertial axes, origin at the planet's centre; t = 0 is the epoch, t counts seconds of TT
//! p_P = R_IPᵀ p_I                       fixed: R_IP = R_z(angle + rate t)
//!                                       iau:   Earth IAU 2006/2000A (W = GCRS), Mars and Moon IAU 2009 (W = ICRF)
//! v_air = ω_I × p_I + R_IP R_PE w       w: wind over the ground, east-north-up
//! ```
//! With a site W is not inertial: it stands on the planet and turns with it (x east, y north, z up at a place of the
//! ellipsoid). Field and air are then those of the planet's own axes, gravity has its centrifugal part, and
//! air at rest has no velocity in W:
//! ```text
//! p_P = X_PW p      a = R_WP g(p_P) − ω × (ω × (p − c))      v_air = R_WP R_PE w
//! R_IW = R_IP(0) R_z(rate t) R_PW       directions of stars, the Sun and third bodies
//! ```
//! A site turns about one axis at one rate. With `turns: iau` these are the pole and the rate of t = 0; the true ones leave them by
//! 3e-8 rad (Mars), 7e-7 rad (the Earth) and 2e-4 rad (the Moon, whose libration it is) in a day.
//! Everything is evaluated at the time that the caller names, which is the integrator's stage.

use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;
use linkwork_world::WorldError;
use linkwork_world::ephemeris::Body;
use linkwork_world::planet::rotation::{Earth, EarthOrientation, EarthParameters, FixedRate};
use linkwork_world::planet::{self as world, Ellipsoid, Epoch, Geodetic, Rotation, Spin};
use std::f64::consts::FRAC_PI_2;

/// A mistake that the physics found, as the runtime tells it: the fact, the remedy, the parameter.
pub(crate) fn fault(e: &WorldError, param: &str) -> BuildError {
    BuildError::of(e).at(param)
}

/// Bodies that have a shape and a rotation here.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Centre {
    /// The Earth.
    Earth,
    /// Mars.
    Mars,
    /// The Moon.
    Moon,
}

impl Centre {
    /// As the ephemerides name it.
    pub fn body(self) -> Body {
        match self {
            Centre::Earth => Body::Earth,
            Centre::Mars => Body::Mars,
            Centre::Moon => Body::Moon,
        }
    }

    /// Mean sidereal rate, rad/s: IERS; IAU 2009 (350.89198226 and 13.17635815 deg/day).
    pub fn rate(self) -> f64 {
        match self {
            Centre::Earth => 7.292_115e-5,
            Centre::Mars => 350.891_982_26_f64.to_radians() / 86_400.0,
            Centre::Moon => 13.176_358_15_f64.to_radians() / 86_400.0,
        }
    }

    /// Ellipsoid for heights.
    pub fn ellipsoid(self) -> Ellipsoid {
        match self {
            Centre::Earth => Ellipsoid::wgs84(),
            Centre::Mars => Ellipsoid::mars(),
            Centre::Moon => Ellipsoid::moon(),
        }
    }
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
    #[param(unit = "rad")]
    pub longitude: f64,
    /// Height of the origin above the ellipsoid.
    #[param(unit = "m", default = 0.0)]
    pub height: f64,
    /// Angle of x from east towards north: y is north for 0.
    #[param(unit = "rad", default = 0.0)]
    pub heading: f64,
}

/// A planet: shape, rotation, and when the simulation begins.
#[derive(Params, Clone, Debug)]
pub struct PlanetParams {
    /// Which body.
    #[param(default = Centre::Earth)]
    pub body: Centre,
    /// How it turns: still, fixed (about z of W), iau (W is then the ICRF).
    #[param(default = Turning::Fixed)]
    pub turns: Turning,
    /// Rate about z of W for `fixed`; unwritten: the body's own.
    #[param(unit = "rad/s")]
    pub rate: Option<f64>,
    /// Angle from x of W (in a site: of the inertial axes) to the prime meridian at t = 0, for `still` and `fixed`.
    #[param(unit = "rad", default = 0.0)]
    pub angle: f64,
    /// Date of t = 0, such as 2012-08-06 05:17:57 UTC (or TAI, TT, TDB).
    #[param(default = None)]
    pub epoch: Option<String>,
    /// SPK kernel (.bsp, types 2 and 3, such as de440.bsp of NAIF) by which Sun, Moon and planets move; unwritten: by series for
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
    /// Equatorial radius for heights; unwritten: the body's (WGS 84, IAU).
    #[param(unit = "m", range = 1.0..)]
    pub radius: Option<f64>,
    /// Flattening for heights; unwritten: the body's.
    #[param(range = 0.0..=0.5)]
    pub flattening: Option<f64>,
    /// Where W is on the planet, when it turns with it; unwritten: W is inertial.
    pub site: Option<SiteParams>,
}

impl PlanetParams {
    /// A body that turns about z of W at its own rate.
    pub fn of(body: Centre) -> PlanetParams {
        PlanetParams {
            body,
            turns: Turning::Fixed,
            rate: None,
            angle: 0.0,
            epoch: None,
            kernel: None,
            span: 172_800.0,
            dut1: 0.0,
            pole: [0.0, 0.0],
            orientation: None,
            radius: None,
            flattening: None,
            site: None,
        }
    }

    /// What has its place among the stars is known from a site whose pole is: `fixed` and `still` have one of their own.
    pub fn among_the_stars(&self, what: &str) -> Result<(), BuildError> {
        if self.site.is_none() || self.turns == Turning::Iau {
            return Ok(());
        }
        let fact = format!(
            "{what} by an ephemeris needs the planet's pole among the stars, and its `site` has another"
        );
        let help = "write `turns: iau`; a Sun without an ephemeris is `environment.fixed_sun` or `environment.mars_sun`";
        Err(BuildError::new(fact).help(help).at("planet"))
    }

    /// The epoch; `why` says what needs it.
    pub fn epoch(&self, why: &str) -> Result<Epoch, BuildError> {
        let Some(text) = &self.epoch else {
            return Err(BuildError::new(format!("{why} needs an epoch, and there is none"))
                .help("write `epoch: \"2012-08-06 05:17:57 UTC\"` in `planet`")
                .at("planet"));
        };
        Epoch::parse(text).map_err(|e| fault(&e, "planet"))
    }

    /// The Earth by its table, where one is written.
    fn by_day(&self, epoch: &Epoch, files: &Files) -> Result<Option<Earth>, BuildError> {
        let Some(file) = &self.orientation else { return Ok(None) };
        if self.dut1 != 0.0 || self.pole != [0.0, 0.0] {
            let fact =
                format!("`dut1` or `pole` is written beside the table `{file}`, which has both");
            return Err(BuildError::new(fact).help("remove them, or `orientation`").at("planet"));
        }
        let text = files.text(file).map_err(|e| e.at("planet"))?;
        let table = EarthOrientation::read(file, &text).map_err(|e| fault(&e, "planet"))?;
        Earth::by_day(epoch, &table, self.span).map(Some).map_err(|e| fault(&e, "planet"))
    }

    pub(crate) fn rotation(&self, files: &Files) -> Result<Rotation, BuildError> {
        if self.orientation.is_some() && (self.turns, self.body) != (Turning::Iau, Centre::Earth) {
            let fact = "`orientation` is written, but this is no Earth that turns by the IAU";
            let help = "remove `orientation`, or write `body: earth` and `turns: iau`";
            return Err(BuildError::new(fact).help(help).at("planet"));
        }
        let fixed = |rate: f64| FixedRate::about_z(self.angle, rate).map(Rotation::Fixed);
        let made = match (self.turns, self.body) {
            (Turning::Still, _) => fixed(0.0),
            (Turning::Fixed, body) => fixed(self.rate.unwrap_or_else(|| body.rate())),
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
        made.map_err(|e| fault(&e, "planet"))
    }

    /// The planet, for a field that is round about its z; without a site z of W is the planet's axis.
    pub fn about_z(&self, files: &Files) -> Result<Planet, BuildError> {
        if self.turns == Turning::Iau && self.site.is_none() {
            let fact = "this field has the planet's axis along z of W, which `turns: iau` has not";
            let help = "write `turns: fixed`, or take `environment.spherical_harmonics`";
            return Err(BuildError::new(fact).help(help).at("planet"));
        }
        self.planet(files)
    }

    /// Checks it and makes its tables; `files` has the one of `orientation`.
    pub fn planet(&self, files: &Files) -> Result<Planet, BuildError> {
        if self.rate.is_some() && self.turns != Turning::Fixed {
            return Err(BuildError::new("`rate` is written, but the planet does not turn by it")
                .help("remove `rate`, or write `turns: fixed`")
                .at("planet"));
        }
        let own = self.body.ellipsoid();
        let radius = self.radius.unwrap_or_else(|| own.equatorial_radius());
        let flattening = self.flattening.unwrap_or_else(|| own.flattening());
        let ellipsoid = Ellipsoid::new(radius, flattening).map_err(|e| fault(&e, "planet"))?;
        let rotation = self.rotation(files)?;
        let site = self.site.map(|s| site(&s, &ellipsoid, &rotation)).transpose()?;
        let epoch = self.epoch.clone();
        if let Some(text) = &epoch {
            Epoch::parse(text).map_err(|e| fault(&e, "planet"))?;
        }
        Ok(Planet { ellipsoid, rotation, site, epoch })
    }
}

/// W at a place of a planet that turns on as it does at t = 0.
fn site(s: &SiteParams, ellipsoid: &Ellipsoid, rotation: &Rotation) -> Result<Site, BuildError> {
    let place = Geodetic { latitude: s.latitude, longitude: s.longitude, altitude: s.height };
    let pose = world::Site::new(ellipsoid, place, s.heading).pose;
    if !(s.height > -ellipsoid.polar_radius() && pose.position.norm().is_finite()) {
        let fact = format!("a site at a height of {} m is inside the planet's centre", s.height);
        let help = "write its height above the ellipsoid, negative below it";
        return Err(BuildError::new(fact).help(help).at("planet"));
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
    #[param(default = 1.0)]
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
    /// The date of t = 0, as written.
    pub epoch: Option<String>,
}

impl Planet {
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
            return crate::gravity::around(self.site.as_ref(), p, field);
        }
        let R_IP = self.rotation.at(t).R_IP;
        R_IP * field(&(R_IP.inverse() * p))
    }

    /// ∂a/∂p (1/s², W) of [`Planet::gravity`], given that of the field in the planet's axes.
    pub fn gradient(&self, t: f64, p: Vec3, gradient: impl Fn(&Vec3) -> Mat3) -> Mat3 {
        if self.site.is_some() {
            return crate::gravity::gradient_around(self.site.as_ref(), p, gradient);
        }
        let R_IP = self.rotation.at(t).R_IP;
        let R = R_IP.to_rotation_matrix().into_inner();
        R * gradient(&(R_IP.inverse() * p)) * R.transpose()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(p: &PlanetParams) -> BuildError {
        p.planet(&Files::default()).err().unwrap()
    }

    #[test]
    fn bodies_turn_at_their_own_rate_or_the_written_one() {
        for (body, day) in
            [(Centre::Earth, 86_164.1), (Centre::Mars, 88_642.66), (Centre::Moon, 2_360_591.5)]
        {
            let planet = PlanetParams::of(body).planet(&Files::default()).unwrap();
            let turn = planet.rotation.at(day).R_IP * Vec3::x();
            assert!((turn - Vec3::x()).norm() < 1e-5, "{body:?}: {turn}");
            // A quarter of a day later east is where the meridian points: the turning is eastward.
            assert!((planet.rotation.at(day / 4.0).R_IP * Vec3::x() - Vec3::y()).norm() < 1e-5);
        }
        let p = PlanetParams { rate: Some(0.01), angle: 0.5, ..PlanetParams::of(Centre::Mars) };
        let x = p.planet(&Files::default()).unwrap().rotation.at(20.0).R_IP * Vec3::x();
        assert!((x - Vec3::new(0.7f64.cos(), 0.7f64.sin(), 0.0)).norm() < 1e-15);
    }

    #[test]
    fn the_iau_rotation_is_the_bodys_own() {
        let epoch = Some("2007-11-20 00:00:00 UTC".to_string());
        for (body, rate) in [(Centre::Earth, 7.292_115e-5), (Centre::Mars, 7.088_218e-5)] {
            let p = PlanetParams {
                turns: Turning::Iau,
                epoch: epoch.clone(),
                ..PlanetParams::of(body)
            };
            let point = Vec3::new(0.0, 7e6, 1e6);
            let (spin, place) = p.planet(&Files::default()).unwrap().place(3600.0, point);
            assert!((spin.omega_I.norm() - rate).abs() < 1e-10, "{}", spin.omega_I.norm());
            // Latitude counts from the body's own equator; geodetic and geocentric are 0.3° apart.
            let sine = (spin.R_IP * Vec3::z()).dot(&point) / point.norm();
            assert!((place.unwrap().latitude.sin() - sine).abs() < 0.005);
        }
        // The pole of Mars leans by 37° from that of the Earth.
        let p = PlanetParams { turns: Turning::Iau, epoch, ..PlanetParams::of(Centre::Mars) };
        let pole = p.planet(&Files::default()).unwrap().rotation.at(0.0).R_IP * Vec3::z();
        assert!((pole.z - 52.88_f64.to_radians().sin()).abs() < 1e-3, "{pole}");
    }

    const HERE: SiteParams =
        SiteParams { latitude: 0.4, longitude: -1.1, height: -2e3, heading: 0.3 };

    /// How far a site is turned from where its planet has it, rad, at t (s).
    fn apart(p: &PlanetParams, t: f64) -> f64 {
        let planet = p.planet(&Files::default()).unwrap();
        let site = planet.site.unwrap();
        (planet.rotation.at(t).R_IP * site.pose.rotation).angle_to(&site.to_inertial(t))
    }

    #[test]
    fn a_site_stands_among_the_stars_where_its_planet_has_it() {
        let site = Some(HERE);
        for (turns, rate) in [(Turning::Still, None), (Turning::Fixed, Some(3e-3))] {
            let p =
                PlanetParams { turns, rate, angle: 0.7, site, ..PlanetParams::of(Centre::Mars) };
            assert!(apart(&p, 4321.0) < 1e-12, "{turns:?}");
            assert_eq!(
                p.about_z(&Files::default()).unwrap().site.unwrap().rate,
                rate.unwrap_or(0.0)
            );
        }
        // By the IAU its pole and rate are those of the start: what the pole, tides and libration do in a day is left out.
        let epoch = Some("2026-11-02 00:00:00 UTC".to_string());
        for (body, day) in [(Centre::Mars, 3e-8), (Centre::Earth, 7e-7), (Centre::Moon, 2e-4)] {
            let p = PlanetParams {
                turns: Turning::Iau,
                epoch: epoch.clone(),
                site,
                ..PlanetParams::of(body)
            };
            let (hour, whole) = (apart(&p, 3600.0), apart(&p, 86_400.0));
            println!("{body:?}: {hour:.1e} rad in an hour, {whole:.1e} rad in a day");
            assert!(apart(&p, 0.0) < 1e-15 && whole < 1.5 * day && whole > 0.2 * day, "{body:?}");
            assert!(hour < 0.1 * whole.max(day), "{body:?}");
        }
    }

    /// Rows of IERS's finals2000A: MJD, x, y (″), UT1 − UTC (s), dX, dY (mas), in its columns.
    fn finals(first: i64) -> String {
        let row = |k: i64| {
            let (mjd, x, y, ut) = (first + k, 0.1 + 1e-3 * k as f64, 0.2, -0.3 - 1e-3 * k as f64);
            format!(
                "{:7}{mjd:5}.00 I {x:9.6} 0.000050 {y:9.6} 0.000050  I{ut:10.7} 0.0000042  0.6887 0.0028  I {:9.3} {:8.3} {:9.3} {:8.3}\n",
                "", 0.1, 0.09, -0.2, 0.1
            )
        };
        (0..10).map(row).collect()
    }

    #[test]
    fn the_earth_turns_by_a_table() {
        let folder = std::env::temp_dir().join(format!("linkwork_eop_{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("finals2000A.all"), finals(56_000)).unwrap();
        let files = Files::of(vec![folder.clone()]);
        // MJD 56001 is 2012-03-15.
        let p = PlanetParams {
            turns: Turning::Iau,
            epoch: Some("2012-03-15 00:00:00 UTC".into()),
            orientation: Some("finals2000A.all".into()),
            ..PlanetParams::of(Centre::Earth)
        };
        let by_day = p.planet(&files).unwrap();
        let arcsec = std::f64::consts::TAU / 1_296_000.0;
        let written = PlanetParams {
            orientation: None,
            dut1: -0.301,
            pole: [0.101 * arcsec, 0.2 * arcsec],
            ..p.clone()
        };
        let still = written.planet(&files).unwrap();
        // At a midnight they differ by dX and dY, 0.22 mas; a day later by a millisecond of UT1, too.
        let apart = |t: f64| by_day.rotation.at(t).R_IP.angle_to(&still.rotation.at(t).R_IP);
        assert!((apart(0.0) - 0.2236e-3 * arcsec).abs() < 1e-5 * arcsec, "{}", apart(0.0) / arcsec);
        assert!((apart(86_400.0) - 1e-3 * 7.2921e-5).abs() < 0.1e-7, "{}", apart(86_400.0));

        let refused = |p: PlanetParams, fact: &str| {
            let e = p.planet(&files).err().unwrap();
            assert!(e.message.contains(fact) && e.help.is_some(), "{}", e.message);
            assert_eq!(e.param.as_deref(), Some("planet"));
        };
        refused(PlanetParams { dut1: 0.1, ..p.clone() }, "`dut1` or `pole` is written beside");
        refused(PlanetParams { turns: Turning::Fixed, ..p.clone() }, "no Earth that turns");
        refused(PlanetParams { body: Centre::Mars, ..p.clone() }, "no Earth that turns");
        refused(PlanetParams { span: 1e6, ..p.clone() }, "is from 2012-03-14");
        let early = Some("2011-03-15 00:00:00 UTC".to_string());
        refused(PlanetParams { epoch: early, ..p.clone() }, "asked for from 2011-03-15");
        refused(PlanetParams { orientation: Some("finals.txt".into()), ..p }, "finals.txt");
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn mistakes_have_fact_and_remedy() {
        let iau = PlanetParams { turns: Turning::Iau, ..PlanetParams::of(Centre::Earth) };
        let e = refused(&iau);
        assert!(e.message.contains("needs an epoch") && e.help.unwrap().contains("epoch: "));
        let e = refused(&PlanetParams { epoch: Some("noon".into()), ..iau.clone() });
        assert!(e.message.contains("`noon` is no epoch") && e.help.unwrap().contains("UTC"));
        assert_eq!(e.param.as_deref(), Some("planet"));
        let date = Some("2012-08-06 05:17:57 UTC".to_string());
        let e = refused(&PlanetParams { epoch: date.clone(), pole: [0.3, 0.2], ..iau.clone() });
        assert!(e.message.contains("pole"), "arc seconds taken for radians: {}", e.message);
        let e = refused(&PlanetParams { epoch: date, rate: Some(1e-4), ..iau });
        assert!(e.message.contains("`rate`") && e.help.unwrap().contains("fixed"));
    }
}

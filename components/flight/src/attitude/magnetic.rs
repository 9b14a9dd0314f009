//! `flight.magnetic_field`, `flight.magnetic_torquer`: coils that push against a planet's field.
//! ```text
//! dipole   B = (a/r)³ (3 (m · r̂) r̂ − m)      a = 6371.2 km, m = (g₁¹, h₁¹, g₁⁰) in the planet's axes, which turn about z of W,
//!                                            or are those of the site that W is: then the field stands still in W
//! degree   B = −∇V, V = a Σ (a/r)ⁿ⁺¹ Σ P̃_nm(sin φ)(g cos mλ + h sin mλ): IGRF-14 at the epoch, to the degree that is written
//! M = d × B                                  d: the dipole of the coils, body axes, within its limit by axis
//! ```
//! The field of the epoch is kept: it changes by some 100 nT a year. Currents in the ionosphere and beyond are not in it.

use linkwork_runtime::prelude::*;
use linkwork_world::WorldError;
use linkwork_world::magnetic::{self, Igrf, dipole};
use linkwork_world::planet::Epoch;
use linkwork_world::planet::rotation::{Earth, EarthParameters, Rotation};

/// How the planet of a field turns in W.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum FieldTurning {
    /// About z of W at `rate`, from `angle`.
    Fixed,
    /// The Earth of IAU 2006/2000A, as a planet with `turns: iau`; W has the axes of the GCRS.
    Iau,
}

/// A planet's dipole, or the reference field of the Earth.
#[derive(Params, Clone, Debug)]
pub struct FieldParams {
    /// (g₁¹, h₁¹, g₁⁰); unwritten, and without `degree`: as it stands of the Earth in 2020 (IGRF).
    #[param(unit = "T")]
    pub dipole: Option<Vec3>,
    /// Degree of IGRF-14 instead of a dipole, 13 at the most; needs `epoch`.
    #[param(range = 1.0..=13.0)]
    pub degree: Option<usize>,
    /// Date of t = 0, 1900 to 2030, for `degree` and `turns: iau`; as that of the planet.
    #[param(default = None)]
    pub epoch: Option<String>,
    /// How the planet turns in W: fixed (about z), iau (the Earth, needs `epoch`). From a site it does as the site.
    #[param(default = FieldTurning::Fixed)]
    pub turns: FieldTurning,
    /// Rate of the planet about z of W; unwritten: the Earth's, and in a site the site's.
    #[param(unit = "rad/s")]
    pub rate: Option<f64>,
    /// Angle from x of W to its prime meridian at t = 0; unwritten: 0, and in a site the site's.
    #[param(unit = "rad")]
    pub angle: Option<f64>,
    /// With `turns: iau`: UT1 − UTC at the epoch, as that of the planet.
    #[param(unit = "s", default = 0.0, range = -1.0..=1.0)]
    pub dut1: f64,
    /// With `turns: iau`: how long the table of the Earth's axis is made for, as that of the planet.
    #[param(unit = "s", default = 172_800.0, range = 1.0..=1e9)]
    pub span: f64,
    /// Gravity, which knows the site that W may be.
    #[param(service)]
    pub gravity: Option<Handle<dyn Gravity>>,
}

/// Where.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FieldIn {
    /// Where the field is wanted; the planet is at the origin of W, or under the site that W is.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// The field.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FieldOut {
    /// Flux density, W.
    #[port("T")]
    pub field: Vec3,
    /// Flux density in the axes of the node: what a magnetometer shows.
    #[port("T")]
    pub in_body: Vec3,
}

/// What the field is in the planet's axes.
enum Source {
    Dipole(Vec3),
    Reference(Box<magnetic::MagneticField>),
}

impl Source {
    /// B (T) at `p` (m), the planet's axes.
    fn at(&self, p: &Vec3) -> Vec3 {
        match self {
            Source::Dipole(m) => dipole(m, p),
            Source::Reference(field) => field.at(p),
        }
    }
}

/// How its axes stand in W.
enum Turn {
    /// As those of the site that W is.
    Site(Site),
    /// Rate (rad/s) and angle (rad) at t = 0 about z of W.
    AboutZ(f64, f64),
    /// By the IAU.
    Iau(Box<Rotation>),
}

/// A magnetic field.
pub struct MagneticField {
    source: Source,
    turn: Turn,
}

/// Of the Earth, rad/s.
const RATE: f64 = 7.292_115e-5;
/// Of the Earth in 2020, T.
const DIPOLE: Vec3 = Vec3::new(-1.4509e-6, 4.6525e-6, -2.94048e-5);

/// A mistake that the physics found, with its parameter.
fn fault(e: &WorldError, param: &str) -> BuildError {
    BuildError::of(e).at(param)
}

impl FieldParams {
    /// The epoch, which `why` needs.
    fn epoch(&self, why: &str) -> Result<Epoch, BuildError> {
        let Some(text) = &self.epoch else {
            return Err(BuildError::new(format!("`{why}` needs an epoch, and there is none"))
                .help("write that of the planet, e.g. epoch: \"2025-01-01 00:00:00 UTC\"")
                .at("epoch"));
        };
        Epoch::parse(text).map_err(|e| fault(&e, "epoch"))
    }

    fn source(&self) -> Result<Source, BuildError> {
        let Some(degree) = self.degree else {
            return Ok(Source::Dipole(self.dipole.unwrap_or(DIPOLE)));
        };
        if self.dipole.is_some() {
            return Err(BuildError::new("`dipole` and `degree` are both written")
                .help("take one of them out")
                .at("dipole"));
        }
        let igrf = Igrf::v14().truncated(degree).map_err(|e| fault(&e, "degree"))?;
        let field = igrf.at(&self.epoch("degree")?).map_err(|e| fault(&e, "epoch"))?;
        Ok(Source::Reference(Box::new(field)))
    }

    fn turn(&self) -> Result<Turn, BuildError> {
        let site = self.gravity.as_ref().and_then(|g| g.site());
        let iau = self.turns == FieldTurning::Iau;
        for (name, written) in [("rate", self.rate), ("angle", self.angle)] {
            let fact = match (&self.gravity, site, written) {
                (_, _, None) => continue,
                (Some(gravity), Some(_), _) => {
                    format!("`{name}` is written, and `{}` knows the site", gravity.path())
                }
                _ if iau => format!("`{name}` is written, and the planet turns by the IAU"),
                _ => continue,
            };
            return Err(BuildError::new(fact).help(format!("take `{name}` out")).at(name));
        }
        match (site, iau) {
            (Some(site), false) => Ok(Turn::Site(site)),
            (None, false) => Ok(Turn::AboutZ(self.rate.unwrap_or(RATE), self.angle.unwrap_or(0.0))),
            (Some(_), true) => Err(BuildError::new(
                "`turns` is written, and gravity knows the site, which turns as its planet does",
            )
            .help("take `turns` out")
            .at("turns")),
            (None, true) => {
                let bulletin = EarthParameters { dut1: self.dut1, ..EarthParameters::default() };
                let earth = Earth::new(&self.epoch("turns: iau")?, bulletin, self.span);
                let earth = earth.map_err(|e| fault(&e, "epoch"))?;
                Ok(Turn::Iau(Box::new(Rotation::Earth(Box::new(earth)))))
            }
        }
    }
}

/// The magnetic field of a planet that turns with it: a tilted dipole, or the Earth's reference field IGRF-14.
#[model("flight.magnetic_field")]
impl Model for MagneticField {
    type Params = FieldParams;
    type Ud = FieldIn;
    type Yd = FieldOut;
    fn build(p: FieldParams) -> Result<Self, BuildError> {
        Ok(MagneticField { source: p.source()?, turn: p.turn()? })
    }
    fn direct(&self, c: &Clock, _: &(), _: &(), u: &FieldIn) -> FieldOut {
        let p = &u.body.position;
        let turned = |turn: Quat| turn * self.source.at(&(turn.inverse() * p));
        let field = match &self.turn {
            Turn::Site(site) => site.from_planet_axes(&self.source.at(&site.to_planet(p))),
            Turn::AboutZ(rate, angle) => {
                turned(Quat::from_scaled_axis(Vec3::z() * (angle + rate * c.t)))
            }
            Turn::Iau(rotation) => turned(rotation.at(c.t).R_IP),
        };
        FieldOut { field, in_body: u.body.rotation.inverse() * field }
    }
}

/// Coils.
#[derive(Params, Clone, Debug)]
pub struct TorquerParams {
    /// Greatest dipole about each axis.
    #[param(unit = "A m^2", range = 0.0..)]
    pub dipole_max: f64,
}

/// Body, command and field.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TorquerIn {
    /// Node with the axes of the coils.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Dipole that is asked for, axes of the node.
    #[port("A m^2")]
    pub dipole: Vec3,
    /// Flux density, W.
    #[port("T")]
    pub field: Vec3,
}

/// Load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TorquerOut {
    /// On the body.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Dipole that there is, axes of the node.
    #[port("A m^2")]
    pub given: Vec3,
}

/// Three coils.
pub struct MagneticTorquer {
    p: TorquerParams,
}

/// Three coils whose dipole feels a torque in a magnetic field.
#[model("flight.magnetic_torquer")]
impl Model for MagneticTorquer {
    type Params = TorquerParams;
    type Ud = TorquerIn;
    type Yd = TorquerOut;
    fn direct(&self, _: &Clock, _: &(), _: &(), u: &TorquerIn) -> TorquerOut {
        let limit = self.p.dipole_max;
        let given = u.dipole.map(|d| d.clamp(-limit, limit));
        let moment = (u.body.rotation * given).cross(&u.field);
        TorquerOut { load: Wrench { moment, force: Vec3::zeros() }, given }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::tests::fast_site;

    fn params() -> FieldParams {
        FieldParams {
            dipole: None,
            degree: None,
            epoch: None,
            turns: FieldTurning::Fixed,
            rate: None,
            angle: None,
            dut1: 0.0,
            span: 172_800.0,
            gravity: None,
        }
    }

    #[test]
    fn the_field_turns_with_the_planet() {
        let p = FieldParams { rate: Some(1e-4), angle: Some(0.3), ..params() };
        let m = MagneticField::build(p).unwrap();
        // Computed elsewhere, in the planet's axes.
        let r = Vec3::new(6.9e6, 1.0e6, 2.0e6);
        let want =
            Vec3::new(-1.6128006771743223e-05, -5.633075575567971e-06, 1.4968916584129132e-05);
        let turn = Quat::from_scaled_axis(Vec3::z() * (0.3 + 1e-4 * 500.0));
        let rotation = Quat::from_scaled_axis(Vec3::new(0.4, 0.2, -0.6));
        let body = NodeState { position: turn * r, rotation, ..NodeState::identity() };
        let y = m.direct(&Clock::at(500.0, 0.1, 0), &(), &(), &FieldIn { body }, &());
        assert!((turn.inverse() * y.field - want).norm() < 1e-18, "{}", y.field);
        assert!((rotation * y.in_body - y.field).norm() < 1e-20);
    }

    #[test]
    fn from_a_site_it_is_the_field_of_inertial_axes() {
        let (site, gravity) = fast_site();
        let p = FieldParams { gravity: Some(gravity), ..params() };
        // Axes in which the planet turns about z, as the other one has them.
        let about_z = Site { start: Quat::from_scaled_axis(Vec3::z() * 0.3), ..site };
        let (rate, angle) = (Some(site.rate), Some(0.3));
        let body = NodeState {
            position: Vec3::new(3e5, -2e5, 1e5),
            rotation: Quat::from_euler_angles(0.4, 0.2, -0.6),
            ..NodeState::identity()
        };
        for (degree, epoch) in
            [(None, None), (Some(13), Some("2025-01-01 00:00:00 UTC".to_string()))]
        {
            let p = FieldParams { degree, epoch, ..p.clone() };
            let here = MagneticField::build(p.clone()).unwrap();
            let there =
                MagneticField::build(FieldParams { rate, angle, gravity: None, ..p }).unwrap();
            for t in [0.0, 40.0] {
                let turn = about_z.to_inertial(t);
                let (position, rotation) =
                    (turn * site.from_centre(&body.position), turn * body.rotation);
                let outside = NodeState { position, rotation, ..body };
                let c = Clock::at(t, 0.1, 0);
                let a = here.direct(&c, &(), &(), &FieldIn { body }, &());
                let b = there.direct(&c, &(), &(), &FieldIn { body: outside }, &());
                assert!((turn * a.field - b.field).norm() < 1e-17, "{} {}", a.field, b.field);
                assert!((a.in_body - b.in_body).norm() < 1e-17 && a.field.norm() > 1e-6);
            }
        }
        for (wrong, name) in [
            (FieldParams { rate: Some(0.05), ..p.clone() }, "rate"),
            (FieldParams { angle: Some(0.3), ..p }, "angle"),
        ] {
            let e = MagneticField::build(wrong).err().unwrap();
            assert!(e.message.contains("`gravity` knows the site"), "{}", e.message);
            assert!(e.param.as_deref() == Some(name) && e.help.unwrap().contains(name));
        }
    }

    /// North, east, down (nT) of the cases of EDL.md, j (ppigrf), through the model: the Earth turns about z, and by the IAU.
    #[test]
    fn the_reference_field_has_the_golden_numbers() {
        use linkwork_world::planet::{Ellipsoid, Geodetic};
        for (date, lat, lon, h, want, near) in [
            ("2020-01-01", 0.0, 0.0, 4e5, [22639.778, -1986.686, -11680.552], 0.6),
            ("2025-01-01", 60.0, -30.0, 5e5, [11941.127, -2695.961, 40152.011], 0.01),
        ] {
            let place = Geodetic::from_degrees(lat, lon, h);
            let r = Ellipsoid::wgs84().position(&place);
            let epoch = format!("{date} 00:00:00 UTC");
            let earth = Earth::new(&Epoch::parse(&epoch).unwrap(), EarthParameters::default(), 1e4);
            let earth = Rotation::Earth(Box::new(earth.unwrap()));
            let p = FieldParams { degree: Some(13), epoch: Some(epoch), ..params() };
            let iau = FieldParams { turns: FieldTurning::Iau, span: 1e4, ..p.clone() };
            let fixed = FieldParams { angle: Some(0.4), ..p };
            let t = 3000.0;
            let about_z = Quat::from_scaled_axis(Vec3::z() * (0.4 + RATE * t));
            for (p, turn) in [(fixed, about_z), (iau, earth.at(t).R_IP)] {
                let m = MagneticField::build(p).unwrap();
                let body = NodeState { position: turn * r, ..NodeState::identity() };
                let y = m.direct(&Clock::at(t, 0.1, 0), &(), &(), &FieldIn { body }, &());
                let b = place.east_north_up().inverse() * (turn.inverse() * y.field) * 1e9;
                let off = (Vec3::new(b.y, b.x, -b.z) - Vec3::from(want)).amax();
                assert!(off < near, "{date}: {b}");
            }
        }
    }

    #[test]
    fn what_is_no_reference_field_is_refused() {
        let (_, gravity) = fast_site();
        let date = || Some("2025-01-01 00:00:00 UTC".to_string());
        let iau = FieldParams { turns: FieldTurning::Iau, epoch: date(), ..params() };
        for (p, name) in [
            (FieldParams { degree: Some(13), ..params() }, "epoch"),
            (FieldParams { degree: Some(13), epoch: Some("noon".into()), ..params() }, "epoch"),
            (
                FieldParams {
                    degree: Some(3),
                    epoch: Some("2031-01-01 00:00:00 UTC".into()),
                    ..params()
                },
                "epoch",
            ),
            (FieldParams { degree: Some(14), epoch: date(), ..params() }, "degree"),
            (
                FieldParams { degree: Some(2), epoch: date(), dipole: Some(DIPOLE), ..params() },
                "dipole",
            ),
            (FieldParams { epoch: None, ..iau.clone() }, "epoch"),
            (FieldParams { angle: Some(0.1), ..iau.clone() }, "angle"),
            (FieldParams { gravity: Some(gravity), ..iau }, "turns"),
        ] {
            let e = MagneticField::build(p).err().unwrap();
            assert!(e.param.as_deref() == Some(name) && e.help.is_some(), "{name}: {}", e.message);
        }
    }

    #[test]
    fn coils_push_across_the_field_within_their_limit() {
        let m = MagneticTorquer { p: TorquerParams { dipole_max: 10.0 } };
        let rotation = Quat::from_scaled_axis(Vec3::new(0.4, 0.2, -0.6));
        let field = Vec3::new(1e-5, -2e-5, 3e-5);
        let body = NodeState { rotation, ..NodeState::identity() };
        let u = TorquerIn { body, dipole: Vec3::new(4.0, -30.0, 1.0), field };
        let y = m.direct(&Clock::at(0.0, 0.1, 0), &(), &(), &u, &());
        assert_eq!(y.given, Vec3::new(4.0, -10.0, 1.0));
        let want = (rotation * y.given).cross(&field);
        assert!((y.load.moment - want).norm() < 1e-20 && y.load.moment.dot(&field).abs() < 1e-20);
    }
}

//! `flight.magnetic_field`, `flight.magnetic_torquer`: coils that push against a planet's field.
//! ```text
//! dipole   B = (a/r)³ (3 (m · r̂) r̂ − m)      a = 6371.2 km, m = (g₁¹, h₁¹, g₁⁰) in the planet's axes
//! degree   B = −∇V, V = a Σ (a/r)ⁿ⁺¹ Σ P̃_nm(sin φ)(g cos mλ + h sin mλ): IGRF-14 at the epoch, to the degree that is written
//! M = d × B                                  d: the dipole of the coils, body axes, within its limit by axis
//! ```
//! Axes and epoch are those of the planet that gravity has, so that the two cannot disagree; in a site the field stands still in W. Where gravity knows
//! none, the planet turns about z of W. The field of the epoch is kept: it changes by some 100 nT a year. Currents in the ionosphere and
//! beyond are not in it.

use linkwork_runtime::prelude::*;
use linkwork_world::WorldError;
use linkwork_world::magnetic::{self, Igrf, dipole};
use linkwork_world::planet::Epoch;

/// A planet's dipole, or the reference field of the Earth.
#[derive(Params, Clone, Debug)]
pub struct FieldParams {
    /// (g₁¹, h₁¹, g₁⁰); unwritten, and without `degree`: as it stands of the Earth in 2020 (IGRF).
    #[param(unit = "T")]
    pub dipole: Option<Vec3>,
    /// Degree of IGRF-14 instead of a dipole, 13 at the most; needs an epoch.
    #[param(range = 1.0..=13.0)]
    pub degree: Option<usize>,
    /// Date of t = 0, 1900 to 2030, for `degree`, where the `planet` of gravity has none.
    #[param(default = None)]
    pub epoch: Option<String>,
    /// Rate of the planet about z of W where gravity has no `planet`; unwritten: the Earth's.
    #[param(unit = "rad/s")]
    pub rate: Option<f64>,
    /// Angle from x of W to its prime meridian at t = 0 where gravity has no `planet`; unwritten: 0.
    #[param(unit = "rad")]
    pub angle: Option<f64>,
    /// Gravity, whose planet has this field.
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
    /// As those of the planet that gravity has, and the site that W may be.
    Planet(Handle<dyn Gravity>, Option<Site>),
    /// Rate (rad/s) and angle (rad) at t = 0 about z of W.
    AboutZ(f64, f64),
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
    /// The epoch of gravity's planet, or else the one that is written.
    fn epoch(&self) -> Result<Epoch, BuildError> {
        let known = self.gravity.as_ref().and_then(|g| Some((g.path(), g.epoch()?)));
        let text = match (known, &self.epoch) {
            (Some((path, _)), Some(_)) => {
                let fact = format!("`epoch` is written, and the planet of `{path}` has one");
                return Err(BuildError::new(fact).help("take `epoch` out").at("epoch"));
            }
            (Some((_, text)), None) => text,
            (None, Some(text)) => text,
            (None, None) => {
                return Err(BuildError::new("`degree` needs an epoch, and there is none")
                    .help("write one in the `planet` of gravity, e.g. epoch: \"2025-01-01 00:00:00 UTC\"")
                    .at("epoch"));
            }
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
        let field = igrf.at(&self.epoch()?).map_err(|e| fault(&e, "epoch"))?;
        Ok(Source::Reference(Box::new(field)))
    }

    fn turn(&self) -> Result<Turn, BuildError> {
        let turning = self.gravity.as_ref().filter(|g| g.planet_axes(0.0).is_some());
        let Some(gravity) = turning else {
            return Ok(Turn::AboutZ(self.rate.unwrap_or(RATE), self.angle.unwrap_or(0.0)));
        };
        for (name, written) in [("rate", self.rate), ("angle", self.angle)] {
            if written.is_some() {
                let fact =
                    format!("`{name}` is written, and `{}` knows its planet", gravity.path());
                return Err(BuildError::new(fact).help(format!("take `{name}` out")).at(name));
            }
        }
        Ok(Turn::Planet(gravity.clone(), gravity.site()))
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
        let p = u.body.position;
        let (turn, r) = match &self.turn {
            Turn::Planet(gravity, site) => {
                let axes = gravity.planet_axes(c.t).unwrap_or_else(Quat::identity);
                (axes, site.map_or(p, |s| s.from_centre(&p)))
            }
            Turn::AboutZ(rate, angle) => {
                (Quat::from_scaled_axis(Vec3::z() * (angle + rate * c.t)), p)
            }
        };
        let field = turn * self.source.at(&(turn.inverse() * r));
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
    use std::sync::Arc;

    /// A planet that turns about an axis of its own at 1e-3 rad/s.
    struct Turning(f64);
    impl Turning {
        fn at(&self, t: f64) -> Quat {
            Quat::from_euler_angles(self.0, -0.4, 0.0)
                * Quat::from_scaled_axis(Vec3::z() * (1e-3 * t))
        }
    }
    /// Its gravity, with a date.
    struct Dated(Turning, &'static str);
    impl Gravity for Dated {
        fn acceleration(&self, _: f64, _: Vec3) -> Vec3 {
            Vec3::zeros()
        }
        fn planet_axes(&self, t: f64) -> Option<Quat> {
            Some(self.0.at(t))
        }
        fn epoch(&self) -> Option<&str> {
            Some(self.1)
        }
    }

    fn params() -> FieldParams {
        FieldParams {
            dipole: None,
            degree: None,
            epoch: None,
            rate: None,
            angle: None,
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
            assert!(e.message.contains("`gravity` knows its planet"), "{}", e.message);
            assert!(e.param.as_deref() == Some(name) && e.help.unwrap().contains(name));
        }
    }

    /// North, east, down (nT) of the cases of EDL.md, j (ppigrf), through the model: the Earth turns about z, and as gravity knows it, whose
    /// epoch is the field's.
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
            let p = FieldParams { degree: Some(13), ..params() };
            // An Earth that leans and turns as no other, known to gravity alone.
            let (own, day): (_, &'static str) = (
                Turning(0.7),
                if h > 4.5e5 { "2025-01-01 00:00:00 UTC" } else { "2020-01-01 00:00:00 UTC" },
            );
            assert_eq!(day, epoch);
            let gravity = Handle::new("gravity", Arc::new(Dated(own, day)) as Arc<dyn Gravity>);
            let known = FieldParams { gravity: Some(gravity), ..p.clone() };
            let fixed = FieldParams { angle: Some(0.4), epoch: Some(epoch), ..p };
            let t = 3000.0;
            let about_z = Quat::from_scaled_axis(Vec3::z() * (0.4 + RATE * t));
            for (p, turn) in [(fixed, about_z), (known, Turning(0.7).at(t))] {
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
        let dated =
            |day| Handle::new("gravity", Arc::new(Dated(Turning(0.1), day)) as Arc<dyn Gravity>);
        let known = |day| FieldParams { degree: Some(3), gravity: Some(dated(day)), ..params() };
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
            (FieldParams { epoch: date(), ..known("2025-01-01 00:00:00 UTC") }, "epoch"),
            (FieldParams { rate: Some(1e-3), ..known("2025-01-01 00:00:00 UTC") }, "rate"),
            (FieldParams { gravity: Some(gravity), angle: Some(0.1), ..params() }, "angle"),
            (known("2031-01-01 00:00:00 UTC"), "epoch"),
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

//! `flight.magnetic_field`, `flight.magnetic_torquer`: magnetic field of a planet, and magnetorquers.
//! ```text
//! dipole   B = (a/r)³ (3 (m · r̂) r̂ − m)      m = (g₁¹, h₁¹, g₁⁰) in the planet's axes for the radius a; the Earth's a is 6371.2 km
//! degree   B = −∇V, V = a Σ (a/r)ⁿ⁺¹ Σ P̃_nm(sin φ)(g cos mλ + h sin mλ): IGRF-14 at the epoch, to the degree that is written
//! M = d × B                                  d: the dipole of the coils, body axes, within its limit by axis
//! P = Σ P_max (d/d_max)² + M · ω             i = P/V of the supply; without a supply (V = 0) d = 0
//! ```
//! Axes and epoch come from the world. At a site the field is constant in W. The field is evaluated at the epoch and kept during the run; it changes
//! by about 100 nT a year. Fields of ionospheric and magnetospheric currents are not included.

use linkwork_surroundings::prelude::*;
use linkwork_world::WorldError;
use linkwork_world::magnetic::{self, Igrf, dipole};
use linkwork_world::planet::Epoch;

/// Dipole of a planet, or the reference field of the Earth.
#[derive(Params, Clone, Debug)]
pub struct FieldParams {
    /// Dipole coefficients (g₁¹, h₁¹, g₁⁰); default without `degree`: the Earth's dipole of 2020 (IGRF).
    #[param(unit = "T")]
    pub dipole: Option<Vec3>,
    /// Reference radius a of these coefficients in their source (Jupiter: 71 492 km). Default: 6371.2 km for the Earth; required for the `dipole` of
    /// another body.
    #[param(unit = "m", range = 1.0..)]
    pub dipole_radius: Option<f64>,
    /// Degree of IGRF-14 instead of a dipole, at most 13; requires `body: earth` and an epoch from 1900 to 2030.
    #[param(range = 1.0..=13.0)]
    pub degree: Option<usize>,
    /// The world, whose body has this field.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// Node of the field.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FieldIn {
    /// Node at which the field is evaluated; the planet is at the origin of W, or W is a site on it.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// Magnetic field.
#[derive(Ports, Clone, Copy, Debug)]
pub struct FieldOut {
    /// Flux density, W.
    #[port("T")]
    pub field: Vec3,
    /// Flux density in the axes of the node, as a magnetometer measures it.
    #[port("T")]
    pub in_body: Vec3,
}

/// Field model in planet-fixed axes.
enum Source {
    /// Coefficients (T) and their reference radius (m).
    Dipole(Vec3, f64),
    Reference(Box<magnetic::MagneticField>),
}

impl Source {
    /// Returns B (T) at `p` (m), both in planet-fixed axes.
    fn at(&self, p: &Vec3) -> Vec3 {
        match self {
            Source::Dipole(m, radius) => dipole(m, *radius, p),
            Source::Reference(field) => field.at(p),
        }
    }
}

/// Magnetic field of a planet.
pub struct MagneticField {
    source: Source,
    world: Handle<dyn World>,
}

/// Dipole of the Earth in 2020, T.
const DIPOLE: Vec3 = Vec3::new(-1.4509e-6, 4.6525e-6, -2.94048e-5);

/// Converts an error of the physics library and names the parameter.
fn fault(e: &WorldError, param: &str) -> BuildError {
    BuildError::of(e).at(param)
}

impl FieldParams {
    /// Returns an error if the body is not the Earth; `what` names the model that is valid for the Earth only.
    fn at_the_earth(&self, what: &str, param: &str) -> Result<(), BuildError> {
        match self.world.body() {
            "earth" => Ok(()),
            other => {
                let fact =
                    format!("{what} is valid for the Earth, but `body` of `world` is `{other}`");
                Err(BuildError::new(fact).help("write the `dipole` of that body").at(param))
            }
        }
    }

    /// Returns an error for a radius without coefficients.
    fn no_radius_alone(&self) -> Result<(), BuildError> {
        if self.dipole_radius.is_none() || self.dipole.is_some() {
            return Ok(());
        }
        let fact = "`dipole_radius` is the radius of the coefficients in `dipole`, but `dipole` is not written";
        Err(BuildError::new(fact)
            .help("write `dipole`, or remove `dipole_radius`")
            .at("dipole_radius"))
    }

    /// Returns the reference radius (m) of the coefficients. Sources differ in it, and the field is proportional to its third power.
    fn reference_radius(&self) -> Result<f64, BuildError> {
        if let Some(radius) = self.dipole_radius {
            return Ok(radius);
        }
        match self.world.body() {
            "earth" => Ok(magnetic::RADIUS),
            other => {
                let fact =
                    format!("the reference radius of the `dipole` of `{other}` is not written");
                let help = "write `dipole_radius`, the radius for which its source gives the coefficients, e.g. \"71492 km\" for Jupiter";
                Err(BuildError::new(fact).help(help).at("dipole_radius"))
            }
        }
    }

    fn source(&self) -> Result<Source, BuildError> {
        let Some(degree) = self.degree else {
            let Some(dipole) = self.dipole else {
                self.no_radius_alone()?;
                self.at_the_earth("the default dipole", "dipole")?;
                return Ok(Source::Dipole(DIPOLE, magnetic::RADIUS));
            };
            return self.reference_radius().map(|radius| Source::Dipole(dipole, radius));
        };
        self.no_radius_alone()?;
        if self.dipole.is_some() {
            return Err(BuildError::new("`dipole` and `degree` are both written")
                .help("remove one of them")
                .at("dipole"));
        }
        self.at_the_earth("IGRF-14", "degree")?;
        let Some(epoch) = self.world.epoch() else {
            return Err(BuildError::new("`degree` needs an epoch, but the world has none")
                .help("write one in `world`, e.g. epoch: \"2025-01-01 00:00:00 UTC\"")
                .at("degree"));
        };
        let epoch = Epoch::parse(epoch).map_err(|e| fault(&e, "degree"))?;
        let igrf = Igrf::v14().truncated(degree).map_err(|e| fault(&e, "degree"))?;
        Ok(Source::Reference(Box::new(igrf.at(&epoch).map_err(|e| fault(&e, "degree"))?)))
    }
}

/// Magnetic field of a planet, rotating with it: a tilted dipole, or the Earth's reference field IGRF-14.
#[model("flight.magnetic_field")]
impl Model for MagneticField {
    type Params = FieldParams;
    type FeedthroughInputs = FieldIn;
    type FeedthroughOutputs = FieldOut;
    fn build(p: FieldParams) -> Result<Self, BuildError> {
        Ok(MagneticField { source: p.source()?, world: p.world })
    }
    fn feedthrough(&self, clock: &Clock, u: &FieldIn) -> FieldOut {
        let (turn, r) =
            (self.world.planet_axes(clock.t), self.world.relative_to_centre(&u.body.position));
        let field = turn * self.source.at(&(turn.inverse() * r));
        FieldOut { field, in_body: u.body.rotation.inverse() * field }
    }
}

/// Limits of the magnetorquers.
#[derive(Params, Clone, Debug)]
pub struct TorquerParams {
    /// Greatest dipole about each axis.
    #[param(unit = "A m^2", range = 0.0..)]
    pub dipole_max: f64,
    /// Power of the coil of one axis at its greatest dipole.
    #[param(unit = "W", default = 0.0, range = 0.0..)]
    pub power_max: f64,
}

/// Body, command and field.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TorquerIn {
    /// Node with the axes of the coils.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Supply of the coils.
    #[port(connector)]
    pub supply: Voltage,
    /// Commanded dipole, axes of the node.
    #[port("A m^2")]
    pub dipole: Vec3,
    /// Flux density, W.
    #[port("T")]
    pub field: Vec3,
}

/// Torque, dipole and power.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TorquerOut {
    /// Torque on the body.
    #[port(bind = "body")]
    pub load: Wrench,
    /// Actual dipole after limiting, axes of the node.
    #[port("A m^2")]
    pub given: Vec3,
    /// Supply of the coils.
    #[port(connector)]
    pub supply: Current,
    /// Electrical power taken from the supply: heat, and the work on the body.
    #[port("W")]
    pub power: f64,
    /// Outlet of the heat of the coils, for the port of a thermal node. If it is not connected, the heat goes to the surroundings.
    #[port(connector)]
    pub case: HeatFlow,
}

/// Three orthogonal magnetorquers.
pub struct MagneticTorquer {
    p: TorquerParams,
}

/// Three orthogonal magnetorquers: torque of their commanded dipole in a magnetic field.
#[model("flight.magnetic_torquer")]
impl Model for MagneticTorquer {
    type Params = TorquerParams;
    type FeedthroughInputs = TorquerIn;
    type FeedthroughOutputs = TorquerOut;
    fn feedthrough(&self, u: &TorquerIn) -> TorquerOut {
        let limit = u.supply.limit(self.p.dipole_max);
        let given = u.dipole.map(|d| d.clamp(-limit, limit));
        let moment = (u.body.rotation * given).cross(&u.field);
        let share = |d: f64| if limit > 0.0 { (d / limit).powi(2) } else { 0.0 };
        let heat = self.p.power_max * given.iter().map(|d| share(*d)).sum::<f64>();
        let power = heat + moment.dot(&u.body.angular);
        let load = Wrench { moment, force: Vec3::zeros() };
        TorquerOut {
            load,
            given,
            supply: u.supply.current_of(power),
            power,
            case: HeatFlow { heat },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::attitude::tests::fast_site;
    use linkwork_surroundings::PlainWorld;
    use std::sync::Arc;

    /// World with an epoch and given planet axes.
    struct Dated {
        body: &'static str,
        epoch: Option<&'static str>,
        own: PlainWorld,
    }
    impl World for Dated {
        fn body(&self) -> &str {
            self.body
        }
        fn mu(&self) -> Option<f64> {
            None
        }
        fn radius(&self) -> f64 {
            1.0
        }
        fn flattening(&self) -> f64 {
            0.0
        }
        fn epoch(&self) -> Option<&str> {
            self.epoch
        }
        fn axes(&self) -> Axes {
            self.own.axes
        }
        fn planet_axes(&self, t: f64) -> Quat {
            self.own.planet_axes(t)
        }
        fn planet_rate(&self, t: f64) -> Vec3 {
            self.own.planet_rate(t)
        }
        fn geographic(&self, _: f64, _: Vec3) -> Option<Geographic> {
            None
        }
        fn as_any(&self) -> &dyn std::any::Any {
            self
        }
    }

    /// An Earth whose axes are `start` at t = 0.
    fn turning(start: Quat, rate: f64) -> PlainWorld {
        PlainWorld { start, ..PlainWorld::inertial(1.0, 1.0, rate) }
    }

    fn earth(own: PlainWorld, epoch: Option<&'static str>) -> FieldParams {
        let world = Arc::new(Dated { body: "earth", epoch, own }) as Arc<dyn World>;
        FieldParams {
            dipole: None,
            dipole_radius: None,
            degree: None,
            world: Handle::new("world", world),
        }
    }

    #[test]
    fn the_field_turns_with_the_planet() {
        let start = Quat::from_scaled_axis(Vec3::z() * 0.3);
        let m = MagneticField::build(earth(turning(start, 1e-4), None)).unwrap();
        // The reference value is from an independent computation, in planet-fixed axes.
        let r = Vec3::new(6.9e6, 1.0e6, 2.0e6);
        let want =
            Vec3::new(-1.6128006771743223e-05, -5.633075575567971e-06, 1.4968916584129132e-05);
        let turn = Quat::from_scaled_axis(Vec3::z() * (0.3 + 1e-4 * 500.0));
        let rotation = Quat::from_scaled_axis(Vec3::new(0.4, 0.2, -0.6));
        let body = NodeState { position: turn * r, rotation, ..NodeState::identity() };
        let y = m.feedthrough(&Clock::at(500.0, 0.1, 0), &FieldIn { body });
        assert!((turn.inverse() * y.field - want).norm() < 1e-18, "{}", y.field);
        assert!((rotation * y.in_body - y.field).norm() < 1e-20);
    }

    #[test]
    fn from_a_site_it_is_the_field_of_inertial_axes() {
        let (site, _) = fast_site();
        // In these axes the planet rotates about z.
        let start = Quat::from_scaled_axis(Vec3::z() * 0.3);
        let about_z = Site { start, ..site };
        let body = NodeState {
            position: Vec3::new(3e5, -2e5, 1e5),
            rotation: Quat::from_euler_angles(0.4, 0.2, -0.6),
            ..NodeState::identity()
        };
        for degree in [None, Some(13)] {
            let epoch = Some("2025-01-01 00:00:00 UTC");
            let of =
                |own| MagneticField::build(FieldParams { degree, ..earth(own, epoch) }).unwrap();
            let here = of(PlainWorld::of_site(1.0, 1.0, site));
            let there = of(turning(start, site.rate));
            for t in [0.0, 40.0] {
                let turn = about_z.to_inertial(t);
                let (position, rotation) =
                    (turn * site.relative_to_centre(&body.position), turn * body.rotation);
                let outside = NodeState { position, rotation, ..body };
                let c = Clock::at(t, 0.1, 0);
                let a = here.feedthrough(&c, &FieldIn { body });
                let b = there.feedthrough(&c, &FieldIn { body: outside });
                assert!((turn * a.field - b.field).norm() < 1e-17, "{} {}", a.field, b.field);
                assert!((a.in_body - b.in_body).norm() < 1e-17 && a.field.norm() > 1e-6);
            }
        }
    }

    /// North, east, down (nT) of the reference cases (ppigrf), through the model, for an Earth with a tilted pole.
    #[test]
    fn the_reference_field_has_the_golden_numbers() {
        use linkwork_world::planet::{Ellipsoid, Geodetic};
        for (date, lat, lon, h, want, near) in [
            ("2020-01-01 00:00:00 UTC", 0.0, 0.0, 4e5, [22639.778, -1986.686, -11680.552], 0.6),
            ("2025-01-01 00:00:00 UTC", 60.0, -30.0, 5e5, [11941.127, -2695.961, 40152.011], 0.01),
        ] {
            let place = Geodetic::from_degrees(lat, lon, h);
            let r = Ellipsoid::wgs84().position(&place);
            let own = turning(Quat::from_euler_angles(0.7, -0.4, 0.0), 1e-3);
            let t = 3000.0;
            let turn = own.planet_axes(t);
            let p = FieldParams { degree: Some(13), ..earth(own, Some(date)) };
            let m = MagneticField::build(p).unwrap();
            let body = NodeState { position: turn * r, ..NodeState::identity() };
            let y = m.feedthrough(&Clock::at(t, 0.1, 0), &FieldIn { body });
            let b = place.east_north_up().inverse() * (turn.inverse() * y.field) * 1e9;
            let off = (Vec3::new(b.y, b.x, -b.z) - Vec3::from(want)).amax();
            assert!(off < near, "{date}: {b}");
        }
    }

    #[test]
    fn what_is_no_reference_field_is_refused() {
        let own = turning(Quat::identity(), 0.0);
        let of = |body, epoch| {
            let world = Arc::new(Dated { body, epoch, own }) as Arc<dyn World>;
            FieldParams {
                dipole: None,
                dipole_radius: None,
                degree: Some(3),
                world: Handle::new("world", world),
            }
        };
        let date = Some("2025-01-01 00:00:00 UTC");
        for (p, name, word) in [
            (of("earth", None), "degree", "needs an epoch"),
            (of("earth", Some("2031-01-01 00:00:00 UTC")), "degree", "2031"),
            (FieldParams { degree: Some(14), ..of("earth", date) }, "degree", "14"),
            (FieldParams { dipole: Some(DIPOLE), ..of("earth", date) }, "dipole", "both"),
            (of("mars", date), "degree", "`mars`"),
            (FieldParams { degree: None, ..of("moon", date) }, "dipole", "`moon`"),
            (other_dipole(None, of("moon", date)), "dipole_radius", "`moon`"),
            (
                FieldParams { dipole_radius: Some(7e7), ..of("earth", date) },
                "dipole_radius",
                "not written",
            ),
        ] {
            let e = MagneticField::build(p).err().unwrap();
            assert!(e.param.as_deref() == Some(name) && e.help.is_some(), "{name}: {}", e.message);
            assert!(e.message.contains(word), "{word}: {}", e.message);
        }
        // At the poles of a dipole, at its reference radius, the field is twice its coefficient.
        let m = MagneticField::build(other_dipole(Some(2e7), of("moon", date))).unwrap();
        let position = DIPOLE.normalize() * 2e7;
        let body = NodeState { position, ..NodeState::identity() };
        let y = m.feedthrough(&Clock::at(0.0, 0.1, 0), &FieldIn { body });
        assert!((y.field - 2.0 * DIPOLE).norm() < 1e-18, "{}", y.field);
    }

    fn other_dipole(dipole_radius: Option<f64>, p: FieldParams) -> FieldParams {
        FieldParams { degree: None, dipole: Some(DIPOLE), dipole_radius, ..p }
    }

    #[test]
    fn coils_push_across_the_field_within_their_limit() {
        let m = MagneticTorquer { p: TorquerParams { dipole_max: 10.0, power_max: 5.0 } };
        let rotation = Quat::from_scaled_axis(Vec3::new(0.4, 0.2, -0.6));
        let field = Vec3::new(1e-5, -2e-5, 3e-5);
        let body = NodeState { rotation, ..NodeState::identity() };
        let supply = Voltage { voltage: 28.0 };
        let u = TorquerIn { body, supply, dipole: Vec3::new(4.0, -30.0, 1.0), field };
        let y = m.feedthrough(&u);
        assert_eq!(y.given, Vec3::new(4.0, -10.0, 1.0));
        let want = (rotation * y.given).cross(&field);
        assert!((y.load.moment - want).norm() < 1e-20 && y.load.moment.dot(&field).abs() < 1e-20);
        // The coil of an axis takes 5 W at its limit, and less with the square of the dipole.
        let heat = 5.0 * (0.16 + 1.0 + 0.01);
        assert!(
            (y.case.heat - heat).abs() < 1e-12 && (y.supply.current * 28.0 - heat).abs() < 1e-12
        );
        let dark = TorquerIn { supply: Voltage { voltage: 0.0 }, ..u };
        let y = m.feedthrough(&dark);
        assert_eq!((y.given, y.power, y.supply.current), (Vec3::zeros(), 0.0, 0.0));
    }
}

//! `flight.pitch_program`, `flight.gravity_turn`: open-loop guidance for the first minutes of an ascent.
//! ```text
//! pitch_program   d = cos θ up + sin θ (sin A east + cos A north)      θ(t): table, linear between rows; A: azimuth
//! gravity_turn    d = v_air/|v_air|                                    F = T d
//! ```
//! up, east and north are the axes of the site W: planet-fixed, with up along the normal of the ellipsoid. Rows of the table are events, so that no
//! integration step crosses a kink.

use crate::program::{NextRow, Passed, Times};
use crate::table::Curve;
use linkwork_surroundings::prelude::*;

/// Row of a pitch program.
#[derive(Params, Clone, Debug)]
pub struct PitchRow {
    /// Time of the simulation.
    #[param(unit = "s")]
    pub time: f64,
    /// Angle θ from the vertical.
    #[param(unit = "rad")]
    pub pitch: f64,
}

/// Pitch table, azimuth and thrust.
#[derive(Params, Clone, Debug)]
pub struct PitchParams {
    /// Pitch angle over time, in ascending order of time; constant before the first row and after the last.
    pub rows: Vec<PitchRow>,
    /// Launch azimuth A, from north towards east.
    #[param(unit = "rad", default = std::f64::consts::FRAC_PI_2)]
    pub azimuth: f64,
    /// Magnitude T of the force.
    #[param(unit = "N", range = 0.0..)]
    pub thrust: f64,
    /// The world with the launch site. Default: W has x east, y north, z up.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Force command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct PitchOut {
    /// Commanded force, W.
    #[port("N")]
    pub force: Vec3,
    /// Angle from the vertical of the site.
    #[port("rad")]
    pub pitch: f64,
}

/// Pitch program.
pub struct PitchProgram {
    p: PitchParams,
    times: Times,
    curve: Curve,
    /// Unit vectors upwards and along the launch azimuth, W.
    up: Vec3,
    ahead: Vec3,
}

/// Open-loop ascent guidance: the thrust direction is rotated from the vertical towards an azimuth by a table over time.
#[model("flight.pitch_program")]
impl Model for PitchProgram {
    type Params = PitchParams;
    type FeedthroughOutputs = PitchOut;
    type DiscreteState = Passed;
    type Guards = NextRow;
    fn build(p: PitchParams) -> Result<Self, BuildError> {
        let east = match p.world.as_ref().map_or(Axes::Any, |w| w.axes()) {
            Axes::Any => Vec3::x(),
            // East does not depend on the heading of the site. At a pole, use the x axis of the planet, as in the other
            // guidance laws.
            Axes::Site(s) | Axes::Level(s) => {
                let axis = s.from_planet_axes(&Vec3::z());
                let east = axis.cross(&Vec3::z());
                let at_pole = east.norm() < 1e-9;
                if at_pole { s.from_planet_axes(&Vec3::x()) } else { east.normalize() }
            }
            Axes::Inertial => {
                let fact = "W is inertial, so the vertical of a launch site is not fixed in it";
                return Err(
                    BuildError::new(fact).help("write the launch site as `site` in `world`")
                );
            }
        };
        let times = Times::new(p.rows.iter().map(|r| r.time).collect(), "rows")?;
        let curve =
            Curve::new(&p.rows.iter().map(|r| [r.time, r.pitch]).collect::<Vec<_>>(), "rows")?;
        let north = Vec3::z().cross(&east);
        let ahead = east * p.azimuth.sin() + north * p.azimuth.cos();
        Ok(PitchProgram { p, times, curve, up: Vec3::z(), ahead })
    }
    fn feedthrough(&self, clock: &Clock) -> PitchOut {
        let pitch = self.curve.at(clock.t);
        let direction = self.up * pitch.cos() + self.ahead * pitch.sin();
        PitchOut { force: direction * self.p.thrust, pitch }
    }
    fn guards(&self, clock: &Clock, d: &Passed) -> NextRow {
        self.times.since(clock, d)
    }
    fn handle_event(&self, clock: &Clock, d: &Passed) -> ((), Passed) {
        ((), self.times.pass(clock, d))
    }
}

/// Thrust and atmosphere.
#[derive(Params, Clone, Debug)]
pub struct TurnParams {
    /// Magnitude T of the force.
    #[param(unit = "N", range = 0.0..)]
    pub thrust: f64,
    /// Atmosphere, for the airspeed.
    #[param(service)]
    pub atmosphere: Handle<dyn Atmosphere>,
}

/// The vehicle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TurnIn {
    /// Node on the vehicle.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// Force command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TurnOut {
    /// Commanded force, W; zero while the airspeed is zero.
    #[port("N")]
    pub force: Vec3,
    /// Airspeed.
    #[port("m/s")]
    pub airspeed: f64,
}

/// Gravity turn.
pub struct GravityTurn {
    p: TurnParams,
}

/// Gravity turn: the thrust is along the airspeed, so that gravity bends the trajectory and the angle of attack stays zero.
#[model("flight.gravity_turn")]
impl Model for GravityTurn {
    type Params = TurnParams;
    type FeedthroughInputs = TurnIn;
    type FeedthroughOutputs = TurnOut;
    fn feedthrough(&self, clock: &Clock, u: &TurnIn) -> TurnOut {
        let through = u.body.velocity - self.p.atmosphere.air(clock.t, u.body.position).wind;
        let airspeed = through.norm();
        let direction = if airspeed > 0.0 { through / airspeed } else { Vec3::zeros() };
        TurnOut { force: direction * self.p.thrust, airspeed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::PlainWorld;
    use linkwork_surroundings::testing;

    fn program(axes: Option<Site>, rows: Vec<[f64; 2]>) -> Result<PitchProgram, BuildError> {
        let world = match axes {
            Some(site) => PlainWorld::of_site(4e14, 6.4e6, site),
            None => PlainWorld::inertial(4e14, 6.4e6, 0.0),
        };
        let world = Some(world.handle());
        let rows =
            rows.iter().map(|[time, pitch]| PitchRow { time: *time, pitch: *pitch }).collect();
        PitchProgram::build(PitchParams { rows, azimuth: 0.6, thrust: 10.0, world })
    }

    fn site(latitude: f64, heading: f64) -> Site {
        let place = linkwork_world::planet::Geodetic { latitude, longitude: -1.4, altitude: 10.0 };
        let ellipsoid = linkwork_world::planet::Ellipsoid::wgs84();
        let pose = linkwork_world::planet::Site::new(&ellipsoid, place, heading).pose;
        Site { pose, rate: 7.29e-5, start: Quat::identity() }
    }

    #[test]
    fn it_leans_towards_its_azimuth_whatever_the_heading_of_the_site() {
        let rows = vec![[10.0, 0.0], [22.0, 0.12], [40.0, 0.12]];
        for heading in [0.0, 1.1] {
            let m = program(Some(site(0.5, heading)), rows.clone()).unwrap();
            let at = |t: f64| m.feedthrough(&Clock::at(t, 0.1, 0));
            assert_eq!(at(3.0).force, Vec3::z() * 10.0);
            let y = at(16.0);
            assert!((y.pitch - 0.06).abs() < 1e-15 && (y.force.norm() - 10.0).abs() < 1e-14);
            // The azimuth of W's x is 90° minus the heading.
            let azimuth = std::f64::consts::FRAC_PI_2 - heading - y.force.y.atan2(y.force.x);
            assert!((azimuth - 0.6).abs() < 1e-12, "{azimuth}");
            assert!((at(99.0).pitch - 0.12).abs() < 1e-15);
        }
        let pole = program(Some(site(std::f64::consts::FRAC_PI_2, 0.0)), rows).unwrap();
        assert!((pole.ahead.norm() - 1.0).abs() < 1e-12 && pole.ahead.z.abs() < 1e-12);
    }

    #[test]
    fn its_rows_are_events() {
        let m = program(Some(site(0.5, 0.0)), vec![[0.0, 0.0], [10.0, 0.0], [22.0, 0.1]]).unwrap();
        let c = Clock::at(9.0, 0.1, 0);
        let d = Passed { rows: 0.0 };
        assert!((m.guards(&c, &d).since + 1.0).abs() < 1e-12);
        let d = m.handle_event(&Clock::at(10.0, 0.1, 0), &d).1;
        assert!((m.guards(&Clock::at(10.0, 0.1, 0), &d).since + 12.0).abs() < 1e-9);
    }

    #[test]
    fn axes_without_a_vertical_and_rows_that_do_not_rise_are_refused() {
        let e = program(None, vec![[0.0, 0.0]]).err().unwrap();
        assert!(e.message.contains("inertial") && e.help.unwrap().contains("`site` in `world`"));
        for rows in [vec![], vec![[3.0, 0.0], [3.0, 0.1]]] {
            let e = program(Some(site(0.5, 0.0)), rows).err().unwrap();
            assert!(e.param.as_deref() == Some("rows") && e.help.is_some());
        }
    }

    #[test]
    fn a_gravity_turn_follows_the_air() {
        let atmosphere = testing::air(|_, _| {
            let wind = Vec3::new(0.0, -30.0, 0.0);
            Air { density: 1.0, pressure: 1e5, temperature: 288.0, speed_of_sound: 340.0, wind }
        });
        let m = GravityTurn { p: TurnParams { thrust: 500.0, atmosphere } };
        let at = |velocity: Vec3| {
            let body = NodeState { velocity, ..NodeState::identity() };
            m.feedthrough(&Clock::at(0.0, 0.1, 0), &TurnIn { body })
        };
        let y = at(Vec3::new(40.0, -30.0, 0.0));
        assert!(y.airspeed == 40.0 && (y.force - Vec3::x() * 500.0).norm() < 1e-12);
        assert_eq!(at(Vec3::new(0.0, -30.0, 0.0)).force, Vec3::zeros());
    }
}

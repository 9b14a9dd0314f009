//! `flight.ground_station`: range, azimuth and elevation of a vehicle as seen from a station on the ground.
//! ```text
//! d = r − r_S,   ρ = |d|                            r_S turns with the body of the world
//! sin e = d · up / ρ        A = atan2(d · east, d · north)        up: normal of the ellipsoid at the station
//! ρ̇ = d · (v − ω × r)/ρ                             v over the turning ground
//! ```
//! Light time, refraction and hills are not included. The vehicle becomes visible, and invisible, at an event.

use linkwork_surroundings::prelude::*;
use linkwork_world::planet::{Ellipsoid, Geodetic};
use std::f64::consts::{FRAC_PI_2, TAU};

/// The station.
#[derive(Params, Clone, Debug)]
pub struct GroundStationParams {
    /// Geodetic latitude, north positive.
    #[param(unit = "rad", range = -FRAC_PI_2..=FRAC_PI_2)]
    pub latitude: f64,
    /// East longitude.
    #[param(unit = "rad", range = -TAU..=TAU)]
    pub longitude: f64,
    /// Height above the ellipsoid.
    #[param(unit = "m", default = 0.0)]
    pub height: f64,
    /// Least elevation at which the vehicle is visible.
    #[param(unit = "rad", default = 0.0, range = -FRAC_PI_2..=FRAC_PI_2)]
    pub elevation_min: f64,
    /// The world, on whose body the station is.
    #[param(service)]
    pub world: Handle<dyn World>,
}

/// The vehicle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GroundStationIn {
    /// Node on the vehicle.
    #[port(bind = "body")]
    pub body: NodeState,
}

/// The vehicle as seen from the station.
#[derive(Ports, Clone, Copy, Debug)]
pub struct GroundStationOut {
    /// Distance.
    #[port("m")]
    pub range: f64,
    /// Rate of the distance.
    #[port("m/s")]
    pub range_rate: f64,
    /// Azimuth, from north towards east, 0 to 2π; 0 in the zenith.
    #[port("rad")]
    pub azimuth: f64,
    /// Elevation above the horizontal plane.
    #[port("rad")]
    pub elevation: f64,
    /// The elevation is at least `elevation_min`.
    #[port("1")]
    pub visible: bool,
}

/// Whether the vehicle is visible.
#[derive(State, Clone, Copy, Debug)]
pub struct Sight {
    /// It is visible.
    #[port]
    pub visible: bool,
}

/// Height over the cone of the least elevation.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SightGuards {
    /// Sine of the elevation minus the sine of the least elevation.
    #[port("1", rising)]
    pub rises: f64,
    /// The same.
    #[port("1", falling)]
    pub sets: f64,
}

/// Distance from the station below which directions are undefined, m.
const NEAREST: f64 = 1e-9;

/// A station on the ground.
pub struct GroundStation {
    world: Handle<dyn World>,
    /// Position (m) in the axes of the body, and rotation from east, north, up to these axes.
    position: Vec3,
    axes: Quat,
    sine_min: f64,
}

impl GroundStation {
    /// Returns the distance (m), the distance vector in east, north, up of the station (m), and the rate of the distance (m/s).
    fn seen(&self, t: f64, body: &NodeState) -> (f64, Vec3, f64) {
        let turned = self.world.planet_axes(t);
        let r = self.world.relative_to_centre(&body.position);
        let d = r - turned * self.position;
        let over = body.velocity - self.world.planet_rate(t).cross(&r);
        let range = d.norm();
        let rate = if range > NEAREST { d.dot(&over) / range } else { over.norm() };
        (range, (turned * self.axes).inverse() * d, rate)
    }

    /// Returns the sine of the elevation minus the sine of the least elevation.
    fn over(&self, clock: &Clock, u: &GroundStationIn) -> f64 {
        let (range, d, _) = self.seen(clock.t, &u.body);
        d.z / range.max(NEAREST) - self.sine_min
    }
}

/// Range, azimuth and elevation of a vehicle as seen from a station on the ground, and whether it is visible; true values.
#[model("flight.ground_station")]
impl Model for GroundStation {
    const MODES: bool = true;
    type Params = GroundStationParams;
    type FeedthroughInputs = GroundStationIn;
    type FeedthroughOutputs = GroundStationOut;
    type DiscreteState = Sight;
    type Guards = SightGuards;
    fn build(p: GroundStationParams) -> Result<Self, BuildError> {
        let place = Geodetic { latitude: p.latitude, longitude: p.longitude, altitude: p.height };
        let ellipsoid = Ellipsoid::new(p.world.radius(), p.world.flattening())
            .map_err(|e| BuildError::of(&e))?;
        let position = ellipsoid.position(&place);
        Ok(GroundStation {
            world: p.world,
            position,
            axes: place.east_north_up(),
            sine_min: p.elevation_min.sin(),
        })
    }
    fn feedthrough(&self, clock: &Clock, d: &Sight, u: &GroundStationIn) -> GroundStationOut {
        let (range, seen, range_rate) = self.seen(clock.t, &u.body);
        GroundStationOut {
            range,
            range_rate,
            azimuth: seen.x.atan2(seen.y).rem_euclid(TAU),
            elevation: (seen.z / range.max(NEAREST)).clamp(-1.0, 1.0).asin(),
            visible: d.visible,
        }
    }
    fn mode(&self, clock: &Clock, u: &GroundStationIn) -> Sight {
        Sight { visible: self.over(clock, u) >= 0.0 }
    }
    fn guards(&self, clock: &Clock, u: &GroundStationIn) -> SightGuards {
        let over = self.over(clock, u);
        SightGuards { rises: over, sets: over }
    }
    fn handle_event(&self, fired: Fired<'_>, d: &Sight) -> ((), Sight) {
        ((), Sight { visible: fired.rose(0) || (d.visible && !fired.fell(1)) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_surroundings::PlainWorld;

    const R: f64 = 6_378_137.0;

    fn station(world: PlainWorld, latitude: f64) -> GroundStation {
        let world = world.handle();
        let (longitude, height, elevation_min) = (0.4, 0.0, 0.1);
        let p = GroundStationParams { latitude, longitude, height, elevation_min, world };
        GroundStation::build(p).unwrap()
    }

    fn at(s: &GroundStation, t: f64, position: Vec3, velocity: Vec3) -> GroundStationOut {
        let clock = Clock::at(t, 0.1, 0);
        let u = GroundStationIn { body: NodeState { position, velocity, ..NodeState::identity() } };
        let d = s.mode(&clock, &u);
        s.feedthrough(&clock, &d, &u)
    }

    /// A geostationary satellite over the meridian of a station at the latitude φ: ρ² = R² + a² − 2 R a cos φ and tan e = (cos φ − R/a)/sin φ.
    #[test]
    fn a_geostationary_satellite_stands_where_the_triangle_says() {
        let (rate, a, latitude) = (7.292_115e-5, 42_164e3, 0.8_f64);
        let s = station(PlainWorld::inertial(3.986e14, R, rate), latitude);
        for t in [0.0, 3e4] {
            let angle = 0.4 + rate * t;
            let position = Vec3::new(angle.cos(), angle.sin(), 0.0) * a;
            let y = at(&s, t, position, Vec3::z().cross(&position) * rate);
            let range = (R * R + a * a - 2.0 * R * a * latitude.cos()).sqrt();
            let elevation = ((latitude.cos() - R / a) / latitude.sin()).atan();
            assert!((y.range - range).abs() < 1e-4 && y.range_rate.abs() < 1e-7, "{y:?}");
            assert!((y.elevation - elevation).abs() < 1e-9, "{} {elevation}", y.elevation);
            assert!((y.azimuth - TAU / 2.0).abs() < 1e-9 && y.visible, "{y:?}");
        }
    }

    /// Over a station that moves with W, the vehicle flies straight up, then in the east, where it is below the least elevation.
    #[test]
    fn directions_from_a_site() {
        let up = Vec3::new(0.4_f64.cos(), 0.4_f64.sin(), 0.0);
        let (east, north) = (Vec3::z().cross(&up), Vec3::z());
        let axes = linkwork_spatial::Mat3::from_columns(&[east, north, up]);
        let pose = linkwork_spatial::Pose::new(linkwork_spatial::quat(&axes), up * R);
        let site = Site { pose, rate: 7e-5, start: Quat::identity() };
        let s = station(PlainWorld::of_site(3.986e14, R, site), 0.0);
        let y = at(&s, 50.0, Vec3::z() * 2e3, Vec3::z() * 30.0);
        assert!((y.range - 2e3).abs() < 1e-6 && (y.range_rate - 30.0).abs() < 1e-9, "{y:?}");
        assert!((y.elevation - FRAC_PI_2).abs() < 1e-6 && y.visible);
        let y = at(&s, 50.0, Vec3::new(1e5, 0.0, 5e3), Vec3::new(-100.0, 0.0, 0.0));
        assert!((y.azimuth - FRAC_PI_2).abs() < 1e-9 && !y.visible, "{y:?}");
        assert!((y.elevation - 0.05_f64.atan()).abs() < 1e-9, "{y:?}");
    }
}

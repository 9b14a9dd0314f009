//! Initial states: converts orbital elements, states in named frames and geodetic states to position and velocity in W at t = 0.
//! ```text
//! inertial   r_I, v_I                                      elements: R_z(Ω) R_x(i) R_z(ω) of the conic about the body
//! fixed      r_I = R_IP r_P,  v_I = R_IP v_P + ω × r_I     geodetic: r_P of the ellipsoid, v_P from east, north, up
//! W a site   r = R_WI r_I − c,  v = R_WI v_I − ω × (R_WI r_I)      c: from the centre of the body to the origin of W
//! ```

use super::{Inner, Turning};
use crate::world::Centre;
use linkwork_surroundings::prelude::*;
use linkwork_surroundings::{Anomaly, Start, StartFrame};
use linkwork_world::orbit::{Elements, propagate};
use linkwork_world::planet::rotation::{eme2000_to_gcrs, teme_to_gcrs};
use linkwork_world::planet::{Geodetic, PointMotion};

/// Largest angle between the pole of the body and z of the inertial axes for elements without a `frame`, rad. The Earth's pole stays within it for a
/// century and a half around J2000.
const NEAR_POLE: f64 = 0.017_453;

impl Inner {
    /// Returns position (m) and velocity (m/s) in W at t = 0.
    pub(super) fn started(&self, start: &Start) -> Result<(Vec3, Vec3), BuildError> {
        match start {
            Start::Elements { frame, .. } => {
                let state = self.on_orbit(start)?;
                let frame = frame.map_or_else(|| self.usual_frame(), Ok)?;
                self.in_frame(frame, state.position, state.velocity)
            }
            Start::State { frame, position, velocity } => {
                self.in_frame(*frame, *position, *velocity)
            }
            Start::Geodetic { latitude, longitude, height, velocity } => {
                let place =
                    Geodetic { latitude: *latitude, longitude: *longitude, altitude: *height };
                let position = self.planet.ellipsoid.position(&place);
                Ok(self.of_body(position, place.east_north_up() * velocity))
            }
            Start::TwoLine { from, satellite } => {
                let state = self.by_two_lines(from, satellite.as_deref())?;
                self.in_frame(StartFrame::Teme, state.position, state.velocity)
            }
            Start::Ephemeris { file, object } => {
                let (frame, state) = self.by_message(file, object.as_deref())?;
                self.in_frame(frame, state.position, state.velocity)
            }
        }
    }

    /// Transforms position and velocity from named axes at the centre of the body to W.
    fn in_frame(&self, frame: StartFrame, r: Vec3, v: Vec3) -> Result<(Vec3, Vec3), BuildError> {
        self.named(frame)?;
        match frame {
            StartFrame::Inertial | StartFrame::Icrf => self.of_inertial(r, v),
            StartFrame::Equator => {
                let R = self.planet.rotation.at(0.0).R_IP;
                self.of_inertial(R * r, R * v)
            }
            StartFrame::Fixed | StartFrame::Itrf => Ok(self.of_body(r, v)),
            StartFrame::Eme2000 => {
                let R = eme2000_to_gcrs();
                self.of_inertial(R * r, R * v)
            }
            StartFrame::Teme => {
                let R = teme_to_gcrs(&self.params.epoch("`frame: teme`")?);
                self.of_inertial(R * r, R * v)
            }
        }
    }

    /// Returns an error if the frame is not defined in this world.
    fn named(&self, frame: StartFrame) -> Result<(), BuildError> {
        let iau = self.params.turning() == Turning::Iau;
        let earth = self.params.body == Centre::Earth;
        let (name, there) = match frame {
            StartFrame::Inertial | StartFrame::Equator | StartFrame::Fixed => return Ok(()),
            StartFrame::Icrf => ("icrf", iau),
            StartFrame::Eme2000 => ("eme2000", iau),
            StartFrame::Itrf => ("itrf", iau && earth),
            StartFrame::Teme => ("teme", iau && earth),
        };
        if there {
            return Ok(());
        }
        let of = if matches!(frame, StartFrame::Icrf | StartFrame::Eme2000) {
            "a body"
        } else {
            "the Earth"
        };
        let fact = format!(
            "`frame: {name}` requires {of} with `turns: iau`, which this world does not have"
        );
        let help = "write `epoch` in `world` (with `body: earth` for itrf and teme), or `frame: inertial` or `fixed`";
        Err(BuildError::new(fact).help(help))
    }

    /// Returns the axes of elements without a `frame`.
    ///
    /// # Errors
    /// The pole of the body is far from z of the inertial axes, so that inclinations differ: an orbit over the poles of Mars has an
    /// inclination between 53° and 127° in the ICRF.
    fn usual_frame(&self) -> Result<StartFrame, BuildError> {
        let pole = self.planet.rotation.at(0.0).R_IP * Vec3::z();
        if pole.z >= NEAR_POLE.cos() {
            return Ok(StartFrame::Inertial);
        }
        let fact = format!(
            "`elements`: the pole of the body is {:.1} degrees from the z axis of the inertial axes, and `frame` does not say to which of them the angles refer",
            pole.z.acos().to_degrees()
        );
        let help = "write `frame: equator` (of the body) or `frame: inertial` in `elements`";
        Err(BuildError::new(fact).help(help))
    }

    /// Returns the state on an orbit about the body, axes of the elements.
    fn on_orbit(&self, start: &Start) -> Result<PointMotion, BuildError> {
        let Start::Elements {
            frame: _,
            semi_major_axis,
            eccentricity,
            inclination,
            ascending_node,
            pericentre,
            anomaly,
        } = *start
        else {
            unreachable!("elements alone come here")
        };
        let mu = self.needs_mu()?;
        let told = |e| BuildError::of(&e);
        let at = |anomaly: f64| {
            Elements::with_axis(
                semi_major_axis,
                eccentricity,
                inclination,
                ascending_node,
                pericentre,
                anomaly,
            )
        };
        match anomaly {
            Anomaly::True(angle) => {
                let elements = at(angle).map_err(told)?;
                if 1.0 + eccentricity * angle.cos() <= 0.0 {
                    let fact = format!(
                        "a hyperbola of eccentricity {eccentricity} has no point at the true anomaly {angle} rad"
                    );
                    return Err(BuildError::new(fact).help("write an anomaly closer to 0"));
                }
                Ok(elements.state(mu))
            }
            Anomaly::Mean(mean) => {
                // The mean anomaly is proportional to the time since the pericentre.
                let rate = (mu / semi_major_axis.abs().powi(3)).sqrt();
                let pericentre = at(0.0).map_err(told)?.state(mu);
                let turns =
                    if eccentricity < 1.0 { mean.rem_euclid(std::f64::consts::TAU) } else { mean };
                propagate(mu, &pericentre, turns / rate).map_err(told)
            }
        }
    }

    /// Transforms position and velocity from inertial axes at the centre of the body to W.
    fn of_inertial(&self, r: Vec3, v: Vec3) -> Result<(Vec3, Vec3), BuildError> {
        let Some(site) = &self.planet.site else { return Ok((r, v)) };
        if !self.planet.turning {
            let fact =
                "`turning: false` of the world makes the ground level, so W has no inertial axes";
            return Err(BuildError::new(fact)
                .help("remove `turning: false`, or write `geodetic` or `frame: fixed`"));
        }
        let R = site.to_inertial(0.0).inverse();
        let (r, v) = (R * r, R * v);
        Ok((r - site.relative_to_centre(&Vec3::zeros()), v - site.omega().cross(&r)))
    }

    /// Transforms position and velocity from axes fixed to the body to W; the velocity is relative to these axes.
    fn of_body(&self, r: Vec3, v: Vec3) -> (Vec3, Vec3) {
        if let Some(site) = &self.planet.site {
            let r = site.from_planet_axes(&r);
            return (r - site.relative_to_centre(&Vec3::zeros()), site.from_planet_axes(&v));
        }
        let spin = self.planet.rotation.at(0.0);
        let r = spin.R_IP * r;
        (r, spin.R_IP * v + spin.omega_I.cross(&r))
    }
}

#[cfg(test)]
mod tests {
    use crate::world::{Centre, SiteParams, Turning, WorldParams, handle};
    use linkwork_surroundings::prelude::*;
    use linkwork_surroundings::{Anomaly, Start, StartFrame};
    use linkwork_world::orbit::Elements;
    use linkwork_world::planet::PointMotion;

    const MU: f64 = 3.986_004_418e14;

    fn elements(anomaly: Anomaly) -> Start {
        Start::Elements {
            frame: None,
            semi_major_axis: 7e6,
            eccentricity: 0.01,
            inclination: 98f64.to_radians(),
            ascending_node: 10f64.to_radians(),
            pericentre: 90f64.to_radians(),
            anomaly,
        }
    }

    fn earth() -> WorldParams {
        WorldParams {
            epoch: Some("2004-04-06 07:51:28.386009 UTC".into()),
            ..WorldParams::of(Centre::Earth)
        }
    }

    fn site(turning: bool) -> WorldParams {
        let here =
            SiteParams { latitude: 0.7, longitude: -1.2, height: 300.0, heading: 0.4, turning };
        WorldParams { site: Some(here), ..earth() }
    }

    #[test]
    fn elements_come_back_and_a_mean_anomaly_is_keplers() {
        let world = handle(earth());
        // At the pericentre, r = a (1 − e) and v = √(μ/a (1 + e)/(1 − e)).
        let (r, v) = world.start(&elements(Anomaly::True(0.0))).unwrap();
        assert!((r.norm() - 6.93e6).abs() < 1e-6);
        assert!((v.norm() - (MU / 7e6 * 1.01 / 0.99).sqrt()).abs() < 1e-9);
        for (anomaly, eccentric) in [(0.5, None), (2.8, None), (0.0, Some(1.3_f64))] {
            let start = match eccentric {
                None => Anomaly::True(anomaly),
                Some(e) => Anomaly::Mean(e - 0.01 * e.sin()),
            };
            let (position, velocity) = world.start(&elements(start)).unwrap();
            let back = Elements::of(MU, &PointMotion { position, velocity }).unwrap();
            let want = eccentric
                .map_or(anomaly, |e| 2.0 * ((1.01_f64 / 0.99).sqrt() * (0.5 * e).tan()).atan());
            assert!((back.anomaly - want).abs() < 1e-9, "{} {want}", back.anomaly);
            assert!((back.inclination.to_degrees() - 98.0).abs() < 1e-9);
            assert!((back.ascending_node.to_degrees() - 10.0).abs() < 1e-9);
            assert!((back.pericentre.to_degrees() - 90.0).abs() < 1e-7);
        }
        let open = Start::Elements {
            frame: None,
            semi_major_axis: 7e6,
            eccentricity: 1.2,
            inclination: 0.0,
            ascending_node: 0.0,
            pericentre: 0.0,
            anomaly: Anomaly::True(0.0),
        };
        let e = world.start(&open).err().unwrap();
        assert!(e.message.contains("eccentricity"), "{}", e.message);
    }

    /// The pole of Mars is 37° from z of the ICRF, so elements must say to which of them they refer. About the equator, the plane of an orbit over
    /// the poles contains the pole, and the node is on the given side of the prime meridian, for every type of W.
    #[test]
    fn elements_at_mars_refer_to_named_axes() {
        let mars = WorldParams { body: Centre::Mars, ..earth() };
        let on = |frame| Start::Elements {
            frame,
            semi_major_axis: 3.8e6,
            eccentricity: 0.01,
            inclination: 90f64.to_radians(),
            ascending_node: 25f64.to_radians(),
            pericentre: 0.0,
            anomaly: Anomaly::True(0.0),
        };
        let e = handle(mars.clone()).start(&on(None)).err().unwrap();
        assert!(e.message.contains("37.") && e.help.unwrap().contains("frame: equator"));
        // Without a date, the pole of a body is z.
        assert!(handle(WorldParams::of(Centre::Mars)).start(&on(None)).is_ok());
        let here =
            SiteParams { latitude: 0.3, longitude: 1.4, height: -2e3, heading: 0.4, turning: true };
        for site in [None, Some(here)] {
            let world = handle(WorldParams { site, ..mars.clone() });
            let (r, v) = world.start(&on(Some(StartFrame::Equator))).unwrap();
            let place = world.geographic(0.0, r).unwrap();
            // The body is at the node, which is at 25° east, and moves north.
            assert!((place.longitude.to_degrees() - 25.0).abs() < 1e-6, "{}", place.longitude);
            assert!(place.latitude.abs() < 1e-8);
            let pole = world.planet_axes(0.0) * Vec3::z();
            let over = v - world.planet_rate(0.0).cross(&world.relative_to_centre(&r));
            let north = (4.282_837e13 / 3.8e6 * 1.01 / 0.99_f64).sqrt();
            assert!((over.dot(&pole) - north).abs() < 0.1, "{} {north}", over.dot(&pole));
            let (_, v) = world.start(&on(Some(StartFrame::Inertial))).unwrap();
            assert!((v.dot(&pole) - north).abs() > 100.0);
        }
    }

    /// Vallado's worked example of TEME (AIAA 2006-6753): 6 April 2004. Astropy's TEME to GCRS gives 5102.508959, 6123.011403, 6378.136925 km.
    #[test]
    fn teme_is_that_of_the_worked_example() {
        let start = Start::State {
            frame: StartFrame::Teme,
            position: Vec3::new(5_094.180_162_1, 6_127.644_659_5, 6_380.344_532_7) * 1e3,
            velocity: Vec3::new(-4.746_131_487, 0.785_818_041, 5.531_931_288) * 1e3,
        };
        let (r, v) = handle(earth()).start(&start).unwrap();
        let want = Vec3::new(5_102.508_959, 6_123.011_403, 6_378.136_925) * 1e3;
        assert!((r - want).norm() < 3.0, "{}", (r - want).norm());
        let want = Vec3::new(-4.743_220_16, 0.790_536_50, 5.533_755_73) * 1e3;
        assert!((v - want).norm() < 3e-3, "{}", (v - want).norm());
    }

    /// A body at rest relative to the ground has the velocity of the ground; W as a site gives the same motion.
    #[test]
    fn a_place_over_the_ground_is_that_of_every_world() {
        let start = Start::Geodetic {
            latitude: 0.7,
            longitude: -1.2,
            height: 2300.0,
            velocity: Vec3::new(30.0, -20.0, 5.0),
        };
        let (world, on_it) = (handle(earth()), handle(site(true)));
        let (r, v) = world.start(&start).unwrap();
        let place = world.geographic(0.0, r).unwrap();
        assert!((place.latitude - 0.7).abs() < 1e-12 && (place.longitude + 1.2).abs() < 1e-12);
        assert!((place.altitude - 2300.0).abs() < 1e-6);
        let over = v - world.planet_rate(0.0).cross(&r);
        assert!((over.norm() - (900.0 + 400.0 + 25.0_f64).sqrt()).abs() < 1e-9);
        assert!((over.dot(&r.normalize()) - 5.0).abs() < 0.1, "up, but for the flattening");
        let Axes::Site(turns) = on_it.axes() else { panic!() };
        let (r1, v1) = on_it.start(&start).unwrap();
        // The position is straight above the origin. The x axis is rotated by 0.4 from east towards
        // north.
        assert!((r1 - Vec3::z() * 2000.0).norm() < 1e-6, "{r1}");
        let (sin, cos) = 0.4_f64.sin_cos();
        let want = Vec3::new(30.0 * cos - 20.0 * sin, -30.0 * sin - 20.0 * cos, 5.0);
        assert!((v1 - want).norm() < 1e-9, "{v1} {want}");
        // The state is equal to the one given in inertial axes.
        for start in [
            Start::State { frame: StartFrame::Icrf, position: r, velocity: v },
            Start::State {
                frame: StartFrame::Itrf,
                position: turns.to_planet(&r1),
                velocity: turns.pose.rotation * v1,
            },
        ] {
            let (r2, v2) = on_it.start(&start).unwrap();
            // A site rotates about z of the body; the rotation axis of the Earth deviates by about 1e-11 rad/s.
            assert!((r2 - r1).norm() < 1e-3 && (v2 - v1).norm() < 1e-3, "{r2} {v2}");
            let (r3, v3) = world.start(&start).unwrap();
            assert!((r3 - r).norm() < 1e-3 && (v3 - v).norm() < 1e-3, "{r3} {v3}");
        }
        let level = handle(site(false));
        assert!((level.start(&start).unwrap().0 - r1).norm() < 1e-9);
        let e = level.start(&elements(Anomaly::True(0.0))).err().unwrap();
        assert!(e.message.contains("level") && e.help.is_some());
    }

    #[test]
    fn axes_that_a_world_does_not_have_are_refused() {
        let of = |frame| Start::State { frame, position: Vec3::x() * 7e6, velocity: Vec3::y() };
        let plain = handle(WorldParams::of(Centre::Earth));
        for frame in [StartFrame::Icrf, StartFrame::Itrf, StartFrame::Teme] {
            let e = plain.start(&of(frame)).err().unwrap();
            assert!(e.message.contains("`turns: iau`") && e.help.is_some(), "{}", e.message);
        }
        let mars = WorldParams { body: Centre::Mars, ..earth() };
        assert!(handle(mars.clone()).start(&of(StartFrame::Teme)).is_err());
        assert!(handle(mars).start(&of(StartFrame::Icrf)).is_ok());
        assert!(plain.start(&of(StartFrame::Fixed)).is_ok());
        let nowhere = WorldParams {
            radius: Some(1e3),
            turns: Some(Turning::Still),
            ..WorldParams::of(Centre::Other)
        };
        let e = handle(nowhere).start(&elements(Anomaly::True(0.0))).err().unwrap();
        assert!(e.help.unwrap().contains("`mu`"));
    }
}

//! Conversion from the axes of a table to W.
use super::form::{Attitude, Axes, BodyForm, PlanetForm, Position, Telemetry};
use linkwork_runtime::Fault;
use linkwork_spatial::nalgebra::Quaternion;
use linkwork_spatial::{Pose, Quat, Vec3};
use linkwork_surroundings::Site;
use linkwork_world::planet::{Ellipsoid, Geodetic};

/// Pose of the planet of a table in W.
pub struct Frames {
    site: Option<Site>,
    /// Rate and angle at time 0 about z.
    turn: (f64, f64),
    ellipsoid: Option<Ellipsoid>,
}

/// Two rotation rates of one planet may differ by this round-off (rad/s).
const SAME_RATE: f64 = 1e-12;

fn about_z(angle: f64) -> Quat {
    Quat::from_euler_angles(0.0, 0.0, angle)
}

/// Returns which data of the planet the columns of a body need.
fn needs(body: &BodyForm) -> (bool, bool, bool) {
    let geodetic = matches!(body.position, Position::Geodetic(_));
    let mut axes: Vec<Axes> = body.attitude.iter().map(|a| a.axes).collect();
    if let Position::Cartesian(a, _) = body.position {
        axes.push(a);
    }
    let local = axes.iter().any(|a| matches!(a, Axes::NorthEastDown | Axes::EastNorthUp));
    let planet = geodetic || local || axes.contains(&Axes::Planet);
    (planet, axes.contains(&Axes::Inertial), geodetic || local)
}

impl Frames {
    /// Checks that the file defines the data of its planet that its columns need and W does not define.
    ///
    /// # Errors
    /// The missing data, or the contradiction to W.
    pub fn new(telemetry: &Telemetry, site: Option<Site>) -> Result<Frames, Vec<Fault>> {
        let PlanetForm { ellipsoid, turn, origin } = telemetry.planet;
        let place = origin.unwrap_or(telemetry.origin);
        let mut faults = Vec::new();
        let mut need = |body: &BodyForm, what: &str, like: &str| {
            let fact = format!("body `{}`: its columns need {what}", body.name);
            faults.push(Fault::new(body.origin, fact).help(format!("write planet: ({like}, ..)")));
        };
        for body in &telemetry.bodies {
            let (planet, inertial, surface) = needs(body);
            if turn.is_none() && planet && site.is_none() {
                need(
                    body,
                    "the rotation of the planet, because W is inertial",
                    "rate: .., angle: ..",
                );
            }
            if turn.is_none() && inertial && site.is_some() {
                need(
                    body,
                    "the orientation of the planet at time 0, because W rotates with it",
                    "rate: .., angle: ..",
                );
            }
            if surface && ellipsoid.is_none() {
                need(body, "the planet's ellipsoid", "radius: .., flattening: ..");
            }
        }
        if let (Some(site), Some((rate, _))) = (&site, turn)
            && (site.rate - rate).abs() > SAME_RATE
        {
            let fact = format!(
                "`planet` rotates at {rate} rad/s, but the simulation's planet at {}",
                site.rate
            );
            faults.push(Fault::new(place, fact).help("write the rate of the simulation"));
        }
        // The ellipsoid was checked when the file was read.
        let ellipsoid = ellipsoid.and_then(|(a, f)| Ellipsoid::new(a, f).ok());
        if faults.is_empty() {
            Ok(Frames { site, turn: turn.unwrap_or_default(), ellipsoid })
        } else {
            Err(faults)
        }
    }

    /// Returns X_WP at a time (s): pose of the planet-fixed axes.
    fn planet(&self, t: f64) -> Pose {
        match &self.site {
            Some(site) => site.pose.inverse(),
            None => Pose::new(about_z(self.turn.1 + self.turn.0 * t), Vec3::zeros()),
        }
    }

    /// Returns X_WA of axes whose origin is the planet's centre or that of W.
    fn pose(&self, axes: Axes, t: f64) -> Pose {
        match axes {
            Axes::Planet => self.planet(t),
            Axes::Inertial if self.site.is_some() => {
                let back = about_z(-(self.turn.1 + self.turn.0 * t));
                self.planet(t) * Pose::new(back, Vec3::zeros())
            }
            _ => Pose::identity(),
        }
    }

    /// Returns a position in W (m) from the three numbers of a row in SI.
    pub fn position(&self, of: &Position, t: f64, row: [f64; 3]) -> Vec3 {
        match of {
            Position::Cartesian(axes, _) => self.pose(*axes, t).transform_point(&Vec3::from(row)),
            Position::Geodetic(_) => {
                let [latitude, longitude, height] = row;
                let place = Geodetic { latitude, longitude, altitude: height };
                let p = self.ellipsoid.map_or(Vec3::zeros(), |e| e.position(&place));
                self.planet(t).transform_point(&p)
            }
        }
    }

    /// Returns R_WA: the axes of an attitude at a position in W (m).
    ///
    /// # Errors
    /// A position so close to the centre of the planet that it does not have a vertical direction.
    fn axes(&self, axes: Axes, t: f64, at: &Vec3) -> Result<Quat, String> {
        let local = match axes {
            Axes::EastNorthUp => Quat::identity(),
            // The axes are x north, y east, z down, expressed in east, north, up.
            Axes::NorthEastDown => {
                let half = std::f64::consts::FRAC_1_SQRT_2;
                Quat::new_normalize(Quaternion::new(0.0, half, half, 0.0))
            }
            _ => return Ok(self.pose(axes, t).rotation),
        };
        let planet = self.planet(t);
        let Some(ellipsoid) = self.ellipsoid else { return Ok(local) };
        let place = ellipsoid.geodetic(&planet.inverse().transform_point(at));
        let place = place.map_err(|e| e.to_string())?;
        Ok(planet.rotation * place.east_north_up() * local)
    }

    /// Returns R_WB of a body at a position in W (m), from R_AT of a row.
    ///
    /// # Errors
    /// Errors of its axes.
    pub fn attitude(
        &self,
        body: &BodyForm,
        of: &Attitude,
        (t, at, row): (f64, &Vec3, Quat),
    ) -> Result<Quat, String> {
        let row = if of.to_body { row.inverse() } else { row };
        Ok(self.axes(of.axes, t, at)? * row * body.turned.inverse())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// A body over the equator at longitude 0 of a planet that has rotated by a quarter turn.
    const FILE: &str = "Telemetry(table: \"t.csv\", time: (column: \"t\"), PLANET bodies: { \"b\": (
        position: (latitude: [\"a\", \"deg\"], longitude: [\"b\", \"deg\"], height: [\"c\", \"m\"]),
        attitude: (axes: \"north_east_down\", yaw: [\"d\", \"deg\"], pitch: [\"e\", \"deg\"], roll: [\"f\", \"deg\"]),
    ) })";

    fn read(planet: &str) -> Telemetry {
        Telemetry::text("t.ron", &FILE.replace("PLANET", planet), Path::new("")).unwrap()
    }

    fn near(a: &Vec3, b: &Vec3) {
        assert!((a - b).norm() < 1e-9 * (1.0 + b.norm()), "{a} {b}");
    }

    #[test]
    fn places_and_axes_turn_with_the_planet() {
        let quarter = std::f64::consts::FRAC_PI_2;
        let telemetry = read("planet: (radius: 1000, rate: 0.01, angle: 0.5),");
        let frames = Frames::new(&telemetry, None).unwrap();
        let body = &telemetry.bodies[0];
        let t = (quarter - 0.5) / 0.01;
        let p = frames.position(&body.position, t, [0.0, 0.0, 10.0]);
        near(&p, &Vec3::new(0.0, 1010.0, 0.0));
        // At this position a yaw of 90° points east, which is −x of W; the right side of the body points south (−z), and its down axis to the centre
        // of the planet (−y).
        let attitude = body.attitude.as_ref().unwrap();
        let yaw = Quat::from_euler_angles(0.0, 0.0, quarter);
        let r = frames.attitude(body, attitude, (t, &p, yaw)).unwrap();
        near(&(r * Vec3::x()), &-Vec3::x());
        near(&(r * Vec3::y()), &-Vec3::z());
        near(&(r * Vec3::z()), &-Vec3::y());
        let back = Attitude { to_body: true, ..attitude.clone() };
        let r = frames.attitude(body, &back, (t, &p, yaw.inverse())).unwrap();
        near(&(r * Vec3::x()), &-Vec3::x());
        let turned = BodyForm { turned: yaw, ..body.clone() };
        let r = frames.attitude(&turned, attitude, (t, &p, yaw)).unwrap();
        near(&(r * Vec3::y()), &-Vec3::x());
    }

    #[test]
    fn a_site_knows_where_its_planet_is() {
        // W is on the equator at longitude 90°, with x east, y north, z up.
        let place =
            Geodetic { latitude: 0.0, longitude: std::f64::consts::FRAC_PI_2, altitude: 0.0 };
        let pose = Pose::new(place.east_north_up(), Vec3::new(0.0, 1000.0, 0.0));
        let site = Site { pose, rate: 0.01, start: Quat::identity() };
        let telemetry = read("planet: (radius: 1000),");
        let frames = Frames::new(&telemetry, Some(site)).unwrap();
        let p = frames.position(
            &telemetry.bodies[0].position,
            77.0,
            [0.0, std::f64::consts::FRAC_PI_2, 25.0],
        );
        near(&p, &Vec3::new(0.0, 0.0, 25.0));
        // Inertial axes stay fixed while W rotates to the east.
        let telemetry = read("planet: (radius: 1000, rate: 0.01, angle: 0.2),");
        let frames = Frames::new(&telemetry, Some(site)).unwrap();
        let t = (std::f64::consts::FRAC_PI_2 - 0.2) / 0.01;
        let near_pole =
            frames.pose(Axes::Inertial, t).transform_point(&Vec3::new(-1010.0, 0.0, 3.0));
        near(&near_pole, &Vec3::new(0.0, 3.0, 10.0));
    }

    #[test]
    fn what_columns_need_and_nobody_says_is_told() {
        let told = |planet: &str, site: Option<Site>| {
            let faults = Frames::new(&read(planet), site).err().unwrap();
            faults
                .iter()
                .map(|f| f.message.clone() + f.help.as_deref().unwrap())
                .collect::<String>()
        };
        let all = told("", None);
        assert!(all.contains("the rotation of the planet") && all.contains("ellipsoid"), "{all}");
        assert!(all.contains("write planet: (radius"), "{all}");
        let site = Site { pose: Pose::identity(), rate: 7e-5, start: Quat::identity() };
        let all = told("planet: (radius: 1e6, rate: 8e-5),", Some(site));
        assert!(
            all.contains("rotates at 0.00008 rad/s, but the simulation's planet at 0.00007"),
            "{all}"
        );
    }
}

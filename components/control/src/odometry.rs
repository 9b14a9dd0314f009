//! `control.odometry`: dead reckoning from the wheels (least squares of `geometry`), optionally with a gyro.
//! ```text
//! ṗ = R_z(ψ) R_y(θ) R_x(φ) (v_x, v_y, 0),  ψ̇ = ω cos φ/cos θ          midpoint heading over a sample; φ: `roll`, θ: `pitch`
//! ```
//! Roll and pitch of the deck are defined as in `sensors.pose` and `sensors.inclinometer`. Without them the ground is assumed level; on a slope of
//! 15° x and y are then 3.5 % too large. With a gyro, ω is its rate minus the planet's rotation about the vertical, if W is a rotating site.

use crate::geometry::{Layout, WheelPlace};
use linkwork_surroundings::prelude::*;

/// Wheels and start.
#[derive(Params, Clone, Debug)]
pub struct OdometryParams {
    /// The wheels, in the order of the inputs.
    pub wheels: Vec<WheelPlace>,
    /// Radius of all wheels for which `wheels` does not state a radius.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// x, y (m) and heading (rad) at the start.
    #[param(default = [0.0, 0.0, 0.0])]
    pub start: [f64; 3],
    /// Whether the turn rate comes from `yaw_rate` instead of the wheels.
    #[param(default = false)]
    pub gyro: bool,
    /// The world: a gyro on a planet also measures its rotation about the vertical, which is subtracted.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
}

/// Estimated pose.
#[derive(Ports, Clone, Copy, Debug)]
pub struct OdometryOut {
    /// x in W.
    #[port("m")]
    pub x: f64,
    /// y in W.
    #[port("m")]
    pub y: f64,
    /// Height above the start, W.
    #[port("m")]
    pub z: f64,
    /// Heading from x towards y.
    #[port("rad")]
    pub heading: f64,
    /// Forward speed.
    #[port("m/s")]
    pub speed: f64,
    /// Turn rate.
    #[port("rad/s")]
    pub turn_rate: f64,
    /// Path length.
    #[port("m")]
    pub path: f64,
}

/// Estimate.
#[derive(State, Clone, Copy, Debug)]
pub struct OdometryState {
    /// x, y in W.
    #[port("m")]
    pub position: [f64; 2],
    /// Height above the start.
    #[port("m")]
    pub height: f64,
    /// Heading.
    #[port("rad")]
    pub heading: f64,
    /// Forward speed.
    #[port("m/s")]
    pub speed: f64,
    /// Turn rate.
    #[port("rad/s")]
    pub turn_rate: f64,
    /// Path length.
    #[port("m")]
    pub path: f64,
}

/// Wheel odometry.
pub struct Odometry {
    p: OdometryParams,
    /// Rate of the planet about z of W, rad/s.
    turning: f64,
    layout: Layout,
}

/// Dead reckoning of a rover on any number of wheels from wheel rates and steering angles.
#[model("control.odometry")]
impl SizedModel for Odometry {
    type Params = OdometryParams;

    fn ports(p: &OdometryParams) -> SizedPorts {
        let number = |name: String, unit: &'static str, doc: &'static str| {
            PortSpec::named(name, PortKind::Numbers, 1).unit_of(unit).doc_of(doc)
        };
        let mut inputs = Vec::new();
        for (k, wheel) in p.wheels.iter().enumerate() {
            inputs.push(number(format!("wheels[{k}].rate"), "rad/s", "Measured wheel rate."));
            if wheel.steered {
                let doc = "Measured steering angle, to the left.";
                inputs.push(number(format!("wheels[{k}].steer"), "rad", doc).or(0.0));
            }
        }
        let doc = "Turn rate of the gyro about the vertical.";
        let yaw_rate = number("yaw_rate".into(), "rad/s", doc);
        inputs.push(if p.gyro { yaw_rate } else { yaw_rate.or(0.0) });
        inputs.push(
            number("roll".into(), "rad", "Roll angle of the deck, about its x axis.").or(0.0),
        );
        inputs.push(
            number(
                "pitch".into(),
                "rad",
                "Pitch angle of the deck, about its y axis; positive with x down.",
            )
            .or(0.0),
        );
        SizedPorts {
            inputs,
            outputs: OdometryOut::specs(),
            discrete: OdometryState::specs(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let idle = (!self.p.gyro && wired("yaw_rate")).then(|| {
            BuildError::new("`gyro` is false, so the turn rate comes from the wheels")
                .help("write `gyro: true`, or remove the wire")
        });
        vec![(Judge::Input("yaw_rate"), idle)]
    }
    fn build(p: OdometryParams) -> Result<Self, BuildError> {
        let layout = Layout::new(&p.wheels, p.radius)?;
        if layout.twist(|_| [0.0, 0.0]).is_none() {
            let fact = BuildError::new(
                "the wheels do not determine a turn rate: all are at one position or on one line",
            );
            return Err(fact.help("write at least two wheels side by side").at("wheels"));
        }
        let site = p.world.as_ref().and_then(|w| w.axes().site());
        let turning = site.map_or(0.0, |s| s.omega().z);
        Ok(Odometry { p, turning, layout })
    }

    fn initial(&self, _: &mut [f64], d: &mut [f64]) {
        let [x, y, heading] = self.p.start;
        OdometryState {
            position: [x, y],
            heading,
            height: 0.0,
            speed: 0.0,
            turn_rate: 0.0,
            path: 0.0,
        }
        .put(d);
    }

    fn outputs(&self, d: &[f64], y: &mut [f64]) {
        let OdometryState { position: [px, py], height, heading, speed, turn_rate, path } =
            OdometryState::get(d);
        OdometryOut { x: px, y: py, z: height, heading, speed, turn_rate, path }.put(y);
    }

    fn update(&self, clock: &Clock, d: &mut [f64], u: &[f64]) {
        let before = OdometryState::get(d);
        // Read the rate of each wheel, and the angle of those that steer.
        let measured = |i: usize| {
            let before = self.layout.wheels()[..i].iter().map(|w| 1 + usize::from(w.steered));
            let at: usize = before.sum();
            [if self.layout.wheels()[i].steered { u[at + 1] } else { 0.0 }, u[at]]
        };
        // `build` has checked that the wheels determine the twist, so the default is never used.
        let [vx, vy, wheels] = self.layout.twist(measured).unwrap_or([0.0; 3]);
        let [yaw_rate, roll, pitch] = std::array::from_fn(|k| u[u.len() - 3 + k]);
        let ((sr, cr), (sp, cp)) = (roll.sin_cos(), pitch.sin_cos());
        // Subtract the planet's rotation about the deck's z axis.
        let about_deck = if self.p.gyro { yaw_rate - self.turning * cr * cp } else { wheels };
        // A vertical deck has no heading, so limit the divisor.
        let turn_rate = about_deck * cr / cp.max(1e-3);
        let (sin, cos) = (before.heading + 0.5 * turn_rate * clock.dt).sin_cos();
        // Compute the components along the heading, across it and upwards.
        let (ahead, left, up) = (vx * cp + vy * sr * sp, vy * cr, vy * sr * cp - vx * sp);
        OdometryState {
            position: [
                before.position[0] + clock.dt * (ahead * cos - left * sin),
                before.position[1] + clock.dt * (ahead * sin + left * cos),
            ],
            height: before.height + clock.dt * up,
            heading: before.heading + turn_rate * clock.dt,
            speed: vx,
            turn_rate,
            path: before.path + clock.dt * vx.hypot(vy),
        }
        .put(d);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tests::{curiosity, places};

    #[test]
    fn a_circle_closes() {
        let four = places(
            &[[0.7, 0.5], [0.7, -0.5], [-0.6, 0.5], [-0.6, -0.5]].map(|place| (place, true)),
        );
        for wheels in [curiosity(), four] {
            let (v, rho) = (0.1, 4.0);
            let l = Layout::new(&wheels, 0.25).unwrap();
            let p = OdometryParams {
                wheels,
                radius: 0.25,
                start: [1.0, 2.0, 0.5],
                gyro: false,
                world: None,
            };
            let ports = Odometry::ports(&p).inputs;
            let mut u = vec![0.0; ports.len()];
            for (lane, port) in u.iter_mut().zip(&ports) {
                for i in 0..l.count() {
                    let [steer, rate] = l.command(i, v, v / rho);
                    if port.name == format!("wheels[{i}].rate") {
                        *lane = rate;
                    } else if port.name == format!("wheels[{i}].steer") {
                        *lane = steer;
                    }
                }
            }
            let o = Odometry::build(p).unwrap();
            let steps = 5000;
            let dt = std::f64::consts::TAU * rho / v / steps as f64;
            let mut d = [0.0; 7];
            o.initial(&mut [], &mut d);
            for n in 0..steps {
                o.update(&Clock::at(0.0, dt, n), &mut d, &u);
            }
            assert!((d[0] - 1.0).abs() < 1e-6 && (d[1] - 2.0).abs() < 1e-6, "{d:?}");
            assert!((d[3] - 0.5 - std::f64::consts::TAU).abs() < 1e-9);
        }
    }

    /// On a plane of 15° that rises towards x: motions up the slope, across it, and a turn on it, whose exact motions are known.
    #[test]
    fn a_slope_is_as_long_as_its_map() {
        let slope = 15f64.to_radians();
        let wheels =
            places(&[[0.5, 0.4], [0.5, -0.4], [-0.5, 0.4], [-0.5, -0.4]].map(|p| (p, false)));
        let p = OdometryParams { wheels, radius: 0.2, start: [0.0; 3], gyro: true, world: None };
        let o = Odometry::build(p).unwrap();
        let mut d = [0.0; 7];
        let (speed, turn, dt) = (0.1, 0.01, 0.02);
        // The deck is on the plane, at an angle `a` from uphill.
        let deck = |a: f64| {
            Quat::from_axis_angle(&Vec3::y_axis(), -slope)
                * Quat::from_axis_angle(&Vec3::z_axis(), a)
        };
        let mut place = Vec3::zeros();
        for n in 0..20_000 {
            let a = turn * dt * (f64::from(n) + 0.5);
            let turn_of = deck(a);
            place += turn_of * Vec3::x() * (speed * dt);
            let (roll, pitch, _) = turn_of.euler_angles();
            let rate = speed / 0.2;
            let u = [rate, rate, rate, rate, turn, roll, pitch];
            o.update(&Clock::at(0.0, dt, n as u64), &mut d, &u);
        }
        // The rover drives two thirds of a circle of 10 m.
        let error = Vec3::new(d[0], d[1], d[2]) - place;
        assert!(place.norm() > 5.0 && error.norm() < 2e-3, "{error} {place}");
    }

    #[test]
    fn wheels_in_one_line_are_refused() {
        let wheels = places(&[([0.5, 0.0], false), ([-0.5, 0.0], false)]);
        let p = OdometryParams { wheels, radius: 0.25, start: [0.0; 3], gyro: true, world: None };
        assert!(Odometry::build(p).is_err());
    }
}

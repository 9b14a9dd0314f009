//! `control.odometry`: dead reckoning from six wheels (least squares of `geometry`), optionally with a gyro.
//! ```text
//! ẋ = v_x cos ψ − v_y sin ψ,  ẏ = v_x sin ψ + v_y cos ψ,  ψ̇ = ω          midpoint heading over a sample
//! ```

use crate::geometry::{Command, Layout};
use linkwork_runtime::prelude::*;

/// Wheels and start.
#[derive(Params, Clone, Debug)]
pub struct OdometryParams {
    /// x (forward) and y (left) of the wheels LF, RF, LM, RM, LR, RR, m.
    pub wheels: [[f64; 2]; 6],
    /// Wheel radius.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// x, y (m) and heading (rad) at the start.
    #[param(default = [0.0, 0.0, 0.0])]
    pub start: [f64; 3],
    /// Takes the turn rate from `yaw_rate` instead of the wheels.
    #[param(default = false)]
    pub gyro: bool,
}

/// Measured wheels.
#[derive(Ports, Clone, Copy, Debug)]
pub struct OdometryIn {
    /// Steering, left front.
    #[port("rad", default = 0.0)]
    pub steer_lf: f64,
    /// Steering, right front.
    #[port("rad", default = 0.0)]
    pub steer_rf: f64,
    /// Steering, left rear.
    #[port("rad", default = 0.0)]
    pub steer_lr: f64,
    /// Steering, right rear.
    #[port("rad", default = 0.0)]
    pub steer_rr: f64,
    /// Wheel rate, left front.
    #[port("rad/s")]
    pub rate_lf: f64,
    /// Wheel rate, right front.
    #[port("rad/s")]
    pub rate_rf: f64,
    /// Wheel rate, left middle.
    #[port("rad/s")]
    pub rate_lm: f64,
    /// Wheel rate, right middle.
    #[port("rad/s")]
    pub rate_rm: f64,
    /// Wheel rate, left rear.
    #[port("rad/s")]
    pub rate_lr: f64,
    /// Wheel rate, right rear.
    #[port("rad/s")]
    pub rate_rr: f64,
    /// Turn rate of the gyro about the vertical.
    #[port("rad/s", default = 0.0)]
    pub yaw_rate: f64,
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
}

/// Dead reckoning of a six-wheeled rover from wheel rates and steering angles.
#[model("control.odometry")]
impl Model for Odometry {
    type Params = OdometryParams;
    type U = OdometryIn;
    type Ym = OdometryOut;
    type D = OdometryState;
    fn build(p: OdometryParams) -> Result<Self, BuildError> {
        let layout = Layout { wheels: p.wheels, radius: p.radius };
        if layout.twist(&Command::default()).is_none() {
            return Err(BuildError::new("the wheels are all in one place").at("wheels"));
        }
        Ok(Odometry { p })
    }
    fn init_d(&self) -> OdometryState {
        let [x, y, heading] = self.p.start;
        OdometryState { position: [x, y], heading, speed: 0.0, turn_rate: 0.0, path: 0.0 }
    }
    fn moore(&self, _: &Clock, _: &(), d: &OdometryState) -> OdometryOut {
        OdometryOut {
            x: d.position[0],
            y: d.position[1],
            heading: d.heading,
            speed: d.speed,
            turn_rate: d.turn_rate,
            path: d.path,
        }
    }
    fn update(&self, c: &Clock, _: &(), d: &OdometryState, u: &OdometryIn) -> OdometryState {
        let layout = Layout { wheels: self.p.wheels, radius: self.p.radius };
        let measured = Command {
            steer: [u.steer_lf, u.steer_rf, 0.0, 0.0, u.steer_lr, u.steer_rr],
            rate: [u.rate_lf, u.rate_rf, u.rate_lm, u.rate_rm, u.rate_lr, u.rate_rr],
        };
        let [vx, vy, wheels] = layout.twist(&measured).unwrap_or([0.0; 3]);
        let turn_rate = if self.p.gyro { u.yaw_rate } else { wheels };
        let (sin, cos) = (d.heading + 0.5 * turn_rate * c.dt).sin_cos();
        OdometryState {
            position: [
                d.position[0] + c.dt * (vx * cos - vy * sin),
                d.position[1] + c.dt * (vx * sin + vy * cos),
            ],
            heading: d.heading + turn_rate * c.dt,
            speed: vx,
            turn_rate,
            path: d.path + c.dt * vx.hypot(vy),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::tests::curiosity;

    #[test]
    fn a_circle_closes() {
        let l = curiosity();
        let (v, rho) = (0.1, 4.0);
        let k = l.command(v, v / rho).unwrap();
        let p =
            OdometryParams { wheels: l.wheels, radius: 0.25, start: [1.0, 2.0, 0.5], gyro: false };
        let o = Odometry::build(p).unwrap();
        let u = OdometryIn {
            steer_lf: k.steer[0],
            steer_rf: k.steer[1],
            steer_lr: k.steer[4],
            steer_rr: k.steer[5],
            rate_lf: k.rate[0],
            rate_rf: k.rate[1],
            rate_lm: k.rate[2],
            rate_rm: k.rate[3],
            rate_lr: k.rate[4],
            rate_rr: k.rate[5],
            yaw_rate: 0.0,
        };
        let steps = 5000;
        let dt = std::f64::consts::TAU * rho / v / steps as f64;
        let mut d = o.init_d();
        for n in 0..steps {
            d = o.update(&Clock::at(0.0, dt, n), &(), &d, &u, &(), &mut ());
        }
        assert!((d.position[0] - 1.0).abs() < 1e-6 && (d.position[1] - 2.0).abs() < 1e-6, "{d:?}");
        assert!((d.heading - 0.5 - std::f64::consts::TAU).abs() < 1e-9);
    }
}

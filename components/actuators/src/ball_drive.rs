//! `actuators.ball_drive`: an ideal drive of a ball hinge.
//! ```text
//! e = rotation vector of R_tᵀ R                            R: rotation of the hinge, R_t: the wanted one
//! τ = sat(−k e − d (ω − ω_t) + τ_f)                        on the body, axes of the hinge's frame on the body; |τ| ≤ τ_max
//! P = τ · ω,   i = P/V of the supply;   without a supply (V = 0) τ = 0: the joint is free
//! ```
//! Spring and damper act equally about all axes. The spring has the potential ½ k |e|², because e · ω = |e| d|e|/dt for a target that rests, so that
//! without damping and limit energy is kept at rotations of any size below π; at π the direction of e jumps. If k and d are zero, the drive exerts
//! only the commanded torque. The drive has no losses and feeds power back when the hinge drives it.

use linkwork_runtime::prelude::*;

/// Stiffness, damping and limit.
#[derive(Params, Clone, Debug)]
pub struct BallDriveParams {
    /// Torque per rad of error.
    #[param(unit = "N m/rad", default = 0.0, range = 0.0..)]
    pub stiffness: f64,
    /// Torque per rad/s of error.
    #[param(unit = "N m s/rad", default = 0.0, range = 0.0..)]
    pub damping: f64,
    /// Greatest torque.
    #[param(unit = "N m", default = 1e9, range = 0.0..)]
    pub torque_max: f64,
}

/// Command and hinge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BallDriveIn {
    /// Supply of the drive.
    #[port(connector)]
    pub supply: Voltage,
    /// Commanded rotation of the hinge's frame on the body relative to its frame on the parent.
    #[port("1", default = Quat::identity())]
    pub rotation: Quat,
    /// Commanded angular velocity, axes of the hinge's frame on the body.
    #[port("rad/s", default = Vec3::zeros())]
    pub rate: Vec3,
    /// Commanded torque, added to the torques of spring and damper; axes of the hinge's frame on the body.
    #[port("N m", default = Vec3::zeros())]
    pub torque: Vec3,
    /// The hinge.
    #[port(bind = "ball")]
    pub ball: BallState,
}

/// Torque and power.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BallDriveOut {
    /// Torque on the hinge.
    #[port(bind = "ball")]
    pub load: BallTorque,
    /// Angle between the present and the commanded rotation.
    #[port("rad")]
    pub error: f64,
    /// Size of the torque.
    #[port("N m")]
    pub size: f64,
    /// Power taken from the supply and given to the hinge; negative: fed back.
    #[port("W")]
    pub power: f64,
    /// Supply of the drive.
    #[port(connector)]
    pub supply: Current,
}

/// A drive of a ball hinge.
pub struct BallDrive {
    p: BallDriveParams,
}

/// Ideal drive of a ball hinge: spring and damper towards a commanded rotation, and a commanded torque, limited.
#[model("actuators.ball_drive")]
impl Model for BallDrive {
    type Params = BallDriveParams;
    type FeedthroughInputs = BallDriveIn;
    type FeedthroughOutputs = BallDriveOut;
    fn feedthrough(&self, u: &BallDriveIn) -> BallDriveOut {
        let (p, ball) = (&self.p, &u.ball);
        // The length of a wired quaternion may differ from 1.
        let wanted = Quat::new_normalize(*u.rotation.quaternion());
        let e = (wanted.inverse() * ball.rotation).scaled_axis();
        let whole = u.torque - e * p.stiffness - (ball.rate - u.rate) * p.damping;
        let (size, limit) = (whole.norm(), u.supply.limit(p.torque_max));
        let torque = if size > limit { whole * (limit / size) } else { whole };
        let power = torque.dot(&ball.rate);
        BallDriveOut {
            load: BallTorque { torque },
            error: e.norm(),
            size: torque.norm(),
            power,
            supply: u.supply.current_of(power),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input() -> BallDriveIn {
        BallDriveIn {
            supply: Voltage { voltage: 28.0 },
            rotation: Quat::from_scaled_axis(Vec3::new(0.2, -0.5, 0.9)),
            rate: Vec3::zeros(),
            torque: Vec3::zeros(),
            ball: BallState {
                rotation: Quat::from_scaled_axis(Vec3::new(-0.7, 0.3, 1.1)),
                rate: Vec3::new(0.4, -0.8, 0.6),
            },
        }
    }

    fn drive(p: BallDriveParams, u: &BallDriveIn) -> BallDriveOut {
        BallDrive { p }.feedthrough(u)
    }

    /// The power of the spring equals −d/dt of ½ k |e|², computed by a finite difference along the motion of the ball.
    #[test]
    fn the_spring_has_a_potential() {
        let p = BallDriveParams { stiffness: 30.0, damping: 0.0, torque_max: 1e9 };
        let (u, h) = (input(), 1e-6);
        let at = |h: f64| {
            let turn = Quat::from_scaled_axis(u.ball.rate * h);
            let ball = BallState { rotation: u.ball.rotation * turn, ..u.ball };
            let e = drive(p.clone(), &BallDriveIn { ball, ..u }).error;
            0.5 * p.stiffness * e * e
        };
        let rate = (at(h) - at(-h)) / (2.0 * h);
        let power = drive(p.clone(), &u).power;
        assert!(power.abs() > 1.0 && (power + rate).abs() < 1e-6 * power.abs(), "{power} {rate}");
    }

    #[test]
    fn it_is_limited_fed_and_commanded() {
        let p = BallDriveParams { stiffness: 30.0, damping: 4.0, torque_max: 6.0 };
        let u = input();
        let y = drive(p.clone(), &u);
        assert!((y.size - 6.0).abs() < 1e-12 && (y.load.torque.norm() - 6.0).abs() < 1e-12);
        assert!((y.supply.current - y.power / 28.0).abs() < 1e-12);
        let off = BallDriveIn { supply: Voltage { voltage: 0.0 }, ..u };
        let y = drive(p, &off);
        assert_eq!((y.load.torque, y.power, y.supply.current), (Vec3::zeros(), 0.0, 0.0));
        let p = BallDriveParams { stiffness: 0.0, damping: 2.0, torque_max: 1e9 };
        let torque = Vec3::new(1.0, 2.0, 3.0);
        let y = drive(p, &BallDriveIn { torque, rate: u.ball.rate, ..u });
        assert!((y.load.torque - torque).norm() < 1e-12);
    }
}

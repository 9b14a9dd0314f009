//! `flight.thrust_vector_control`: rotates a vehicle to a commanded thrust direction by gimballing its engine.
//! ```text
//! e = angle from z to d, along z × d             d: direction that is wanted, body axes
//! τ = J (ω_n² e − 2 ζ ω_n ω)                     across z; nothing turns it about z
//! f = z × τ/(l T)                                part of the thrust across, at the nozzle, l behind the centre of mass
//! δ_y = asin f_x,  δ_x = −asin f_y               cut off at the gimbal's end
//! ```
//! With the actual J, l and T of the vehicle, errors decay as e^(−ζ ω_n t). With J and l of the full vehicle, the loop becomes faster as propellant
//! is used. A direction that rotates at Ω is followed with a lag of 2 ζ Ω/ω_n.

use linkwork_runtime::prelude::*;

/// Vehicle properties and control gains.
#[derive(Params, Clone, Debug)]
pub struct ThrustVectorParams {
    /// Moment of inertia J about axes perpendicular to z, about the centre of mass.
    #[param(unit = "kg m^2", range = 1e-9..)]
    pub inertia: f64,
    /// Distance l from the nozzle to the centre of mass.
    #[param(unit = "m", range = 1e-6..)]
    pub arm: f64,
    /// Thrust T.
    #[param(unit = "N", range = 1e-9..)]
    pub thrust: f64,
    /// Natural frequency ω_n of the loop.
    #[param(unit = "rad/s", default = 1.0, range = 1e-9..)]
    pub frequency: f64,
    /// Damping ratio ζ.
    #[param(default = 1.0, range = 0.0..)]
    pub damping: f64,
    /// Greatest gimbal angle about each axis.
    #[param(unit = "rad", default = 0.1, range = 0.0..=1.5)]
    pub gimbal_max: f64,
}

/// Attitude and command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThrustVectorIn {
    /// Node on the vehicle; its z is along the nozzle, opposite to the exhaust.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Commanded force, W; only its direction is used. Zero: the gimbal is centred.
    #[port("N")]
    pub command: Vec3,
}

/// Gimbal angles and error.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ThrustVectorOut {
    /// Angle of the gimbal about x.
    #[port("rad")]
    pub gimbal_x: f64,
    /// Angle of the gimbal about y.
    #[port("rad")]
    pub gimbal_y: f64,
    /// Angle from z to the commanded direction.
    #[port("rad")]
    pub error: f64,
}

/// Thrust vector control.
pub struct ThrustVectorControl {
    p: ThrustVectorParams,
}

/// Thrust vector control: rotates a vehicle so that its z axis points along a commanded direction, by gimballing its engine.
#[model("flight.thrust_vector_control")]
impl Model for ThrustVectorControl {
    type Params = ThrustVectorParams;
    type FeedthroughInputs = ThrustVectorIn;
    type FeedthroughOutputs = ThrustVectorOut;
    fn feedthrough(&self, u: &ThrustVectorIn) -> ThrustVectorOut {
        let p = &self.p;
        let size = u.command.norm();
        if size == 0.0 {
            return ThrustVectorOut { gimbal_x: 0.0, gimbal_y: 0.0, error: 0.0 };
        }
        let to_body = u.body.rotation.inverse();
        let d = to_body * (u.command / size);
        let across = Vec3::z().cross(&d);
        let (sine, error) = (across.norm(), across.norm().atan2(d.z));
        // The rotation axis is undefined for a direction opposite to z; x is chosen.
        let e = match (sine > 0.0, d.z < 0.0) {
            (true, _) => across * (error / sine),
            (false, true) => Vec3::x() * error,
            (false, false) => Vec3::zeros(),
        };
        let w = to_body * u.body.angular;
        let n = p.frequency;
        let torque = (e * (n * n) - w * (2.0 * p.damping * n)) * p.inertia;
        let f = Vec3::z().cross(&torque) / (p.arm * p.thrust);
        let angle = |x: f64| x.clamp(-1.0, 1.0).asin().clamp(-p.gimbal_max, p.gimbal_max);
        ThrustVectorOut { gimbal_x: -angle(f.y), gimbal_y: angle(f.x), error }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::{Burning, Engine, EngineIn, EngineParams};

    const INERTIA: f64 = 3e6;
    const ARM: f64 = 12.0;
    const THRUST: f64 = 1e6;

    fn law() -> ThrustVectorControl {
        let p = ThrustVectorParams {
            inertia: INERTIA,
            arm: ARM,
            thrust: THRUST,
            frequency: 0.8,
            damping: 1.0,
            gimbal_max: 0.1,
        };
        ThrustVectorControl { p }
    }

    fn command(body: NodeState, command: Vec3) -> ThrustVectorOut {
        let u = ThrustVectorIn { body, command };
        law().feedthrough(&u)
    }

    /// A rigid body rotated by the gimballed engine approaches the direction according to the closed form.
    #[test]
    fn an_error_decays_as_its_closed_form() {
        let engine = Engine {
            p: EngineParams {
                thrust: THRUST,
                specific_impulse: 300.0,
                exit_area: 0.0,
                flow_path: Vec3::zeros(),
                throttle_min: 0.0,
                gimbal_max: 0.1,
            },
        };
        let wanted = Vec3::new(0.3, -0.5, 0.9).normalize();
        let side = Vec3::new(-0.7, -0.2, 0.4).cross(&wanted).normalize();
        let start = Quat::from_scaled_axis(side * 0.02)
            * Quat::rotation_between(&Vec3::z(), &wanted).unwrap();
        let (mut q, mut w, h) = (start, Vec3::zeros(), 1e-4);
        let mut t = 0.0;
        for k in 0..50_000 {
            let torque = |q: &Quat, w: &Vec3| {
                let nozzle = NodeState { rotation: *q, angular: *w, ..NodeState::identity() };
                let y = command(nozzle, wanted * 5.0);
                let u = EngineIn {
                    nozzle,
                    throttle: 1.0,
                    propellant: Propellant { available: true },
                    pressure: 0.0,
                    gimbal_x: y.gimbal_x,
                    gimbal_y: y.gimbal_y,
                };
                let load = engine.feedthrough(&Burning { burns: true }, &u).load;
                (q * Vec3::z() * -ARM).cross(&load.force)
            };
            let half = w + torque(&q, &w) * (0.5 * h / INERTIA);
            q = Quat::from_scaled_axis(half * h) * q;
            w = half + torque(&q, &half) * (0.5 * h / INERTIA);
            t += h;
            if k % 5000 == 0 {
                let angle = (q * Vec3::z()).cross(&wanted).norm().asin();
                let x = 0.8 * t;
                let want = 0.02 * (1.0 + x) * (-x).exp();
                assert!((angle - want).abs() < 2e-6, "{t}: {angle} {want}");
            }
        }
        assert!(t > 4.9 && (q * Vec3::z()).dot(&wanted) > 1.0 - 2e-6);
    }

    #[test]
    fn it_pushes_to_its_end_and_not_without_a_command() {
        let y = command(NodeState::identity(), Vec3::zeros());
        assert_eq!((y.gimbal_x, y.gimbal_y, y.error), (0.0, 0.0, 0.0));
        let y = command(NodeState::identity(), -Vec3::z());
        assert!((y.error - std::f64::consts::PI).abs() < 1e-15);
        assert!(y.gimbal_x.hypot(y.gimbal_y) > 0.09, "it begins to turn: {y:?}");
        // The nozzle is behind the centre of mass, so it pushes in the opposite direction to rotate
        // the body towards x.
        let y = command(NodeState::identity(), Vec3::new(1.0, 0.0, 0.0));
        assert_eq!((y.gimbal_x, y.gimbal_y), (0.0, -0.1));
        // The rotation about z is not controlled.
        let spin = NodeState { angular: Vec3::z() * 0.3, ..NodeState::identity() };
        assert_eq!(command(spin, Vec3::z()).gimbal_y, 0.0);
    }
}

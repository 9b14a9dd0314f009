//! `flight.bank_control`: attitude control of an entry capsule: rotates the lift about the velocity, and damps pitch and yaw.
//! ```text
//! e = u/|u|, u: velocity over the ground      n: nose, W; up = p/|p|, from the planet's centre
//! l  = −(n − (n·e) e), made unit              lift of a blunt nose: to the side from which the nose leans away
//! l₀ = up − (up·e) e, made unit               σ = atan2(l · (e × l₀), l · l₀)        0: lift up, positive to the right
//! w  = sat(k (σ_c − σ), w_max) e              rate that is wanted, W; the shorter way
//! M  = J λ (Rᵀ w − ω) + ω × J ω               body axes, cut off at torque_max by axis
//! ```
//! Angle of attack and sideslip follow the aerodynamic trim: the torque only damps them, with the time constant 1/λ. The bank error decays as the
//! second-order system s² + λ s + λ k; λ = 4 k is critical damping. If the nose is along the velocity (sine below 1e-3) or the flight is vertical,
//! the bank angle is undefined and w = 0. The rotation rate of the trajectory (g cos γ/V, mrad/s) is not fed forward.

use super::super::guidance::planet::Frame;
use linkwork_surroundings::prelude::*;

/// Inertia, gains and limits.
#[derive(Params, Clone, Debug)]
pub struct BankControlParams {
    /// Principal moments of inertia J, body axes.
    #[param(unit = "kg m^2")]
    pub inertia: Vec3,
    /// Direction of the nose, body axes.
    #[param(default = Vec3::x())]
    pub nose: Vec3,
    /// Gain k: bank rate per bank error.
    #[param(unit = "1/s", default = 0.3, range = 0.0..)]
    pub gain: f64,
    /// Gain λ: angular acceleration per rate error.
    #[param(unit = "1/s", default = 1.2, range = 0.0..)]
    pub damping: f64,
    /// Greatest bank rate.
    #[param(unit = "rad/s", default = 0.35, range = 0.0..)]
    pub rate_max: f64,
    /// Greatest torque about each axis.
    #[param(unit = "N m", default = f64::INFINITY, range = 0.0..)]
    pub torque_max: f64,
    /// The world; without a world the ground is level.
    #[param(service)]
    pub world: Option<Handle<dyn World>>,
    /// Gravity, for the vertical of level ground.
    #[param(service)]
    pub gravity: Option<Handle<dyn Gravity>>,
}

/// Estimated state of the capsule, and bank command.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BankControlIn {
    /// Estimated state of the capsule from navigation.
    #[port(bind = "body")]
    pub body: NodeState,
    /// Commanded bank angle.
    #[port("rad")]
    pub bank: f64,
}

/// Torque command and bank error.
#[derive(Ports, Clone, Copy, Debug)]
pub struct BankControlOut {
    /// Commanded torque, body axes.
    #[port("N m")]
    pub torque: Vec3,
    /// Present bank angle.
    #[port("rad")]
    pub measured: f64,
    /// Commanded minus present bank angle, in the shorter direction.
    #[port("rad")]
    pub error: f64,
}

/// Bank angle control.
pub struct BankControl {
    p: BankControlParams,
    nose: Vec3,
    frame: Frame,
}

/// Returns the bank angle (rad) of a body with the nose direction `n`, and the unit velocity; `None` if the bank angle is undefined.
fn bank(n: &Vec3, velocity: &Vec3, up: &Vec3) -> Option<(f64, Vec3)> {
    let speed = velocity.norm();
    if !(speed > 0.0) {
        return None;
    }
    let e = velocity / speed;
    let lift = e * n.dot(&e) - n;
    let level = up - e * up.dot(&e);
    if lift.norm() < 1e-3 || level.norm() < 1e-6 * up.norm() {
        return None;
    }
    Some((lift.dot(&e.cross(&level)).atan2(lift.dot(&level)), e))
}

/// Bank angle control of an entry capsule: rotates its lift about the velocity and damps pitch and yaw.
#[model("flight.bank_control")]
impl Model for BankControl {
    type Params = BankControlParams;
    type FeedthroughInputs = BankControlIn;
    type FeedthroughOutputs = BankControlOut;
    fn build(p: BankControlParams) -> Result<Self, BuildError> {
        if p.inertia.iter().any(|j| !(*j > 0.0)) {
            return Err(BuildError::new("the components of `inertia` must be greater than 0")
                .help("write the three principal moments of inertia, e.g. inertia: [5600, 4100, 4100]")
                .at("inertia"));
        }
        if !(p.nose.norm() > 1e-9) {
            return Err(BuildError::new("`nose` is the zero vector")
                .help("write a direction in body axes, e.g. nose: [1, 0, 0]")
                .at("nose"));
        }
        let frame = Frame::new(p.world.as_ref(), p.gravity.as_ref())?;
        Ok(BankControl { nose: p.nose.normalize(), frame, p })
    }
    fn feedthrough(&self, clock: &Clock, u: &BankControlIn) -> BankControlOut {
        let p = &self.p;
        let body = &u.body;
        let over = self.frame.over_ground(body);
        let to_body = body.rotation.inverse();
        let found =
            bank(&(body.rotation * self.nose), &over, &self.frame.up(clock.t, &body.position));
        let (measured, wanted) = found.unwrap_or((0.0, Vec3::zeros()));
        let turn = u.bank - measured;
        let error = if found.is_some() { turn.sin().atan2(turn.cos()) } else { 0.0 };
        let rate = to_body * wanted * (p.gain * error).clamp(-p.rate_max, p.rate_max);
        let (w, j) = (to_body * body.angular, p.inertia);
        let torque = j.component_mul(&(rate - w)) * p.damping + w.cross(&j.component_mul(&w));
        let most = p.torque_max;
        BankControlOut { torque: torque.map(|m| m.clamp(-most, most)), measured, error }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::aerodynamics::entry::force;
    use super::*;
    use linkwork_surroundings::PlainWorld;

    fn params() -> BankControlParams {
        BankControlParams {
            inertia: Vec3::new(5600.0, 4100.0, 3900.0),
            nose: Vec3::x(),
            gain: 0.3,
            damping: 1.2,
            rate_max: 0.35,
            torque_max: f64::INFINITY,
            world: Some(PlainWorld::inertial(4.282_837e13, 3.39e6, 0.0).handle()),
            gravity: None,
        }
    }

    /// A capsule with its nose 16° from the velocity, at a bank.
    fn capsule(bank: f64) -> NodeState {
        let (position, velocity) = (Vec3::new(3.4e6, 2e5, -1e5), Vec3::new(-1100.0, 5100.0, 700.0));
        // The lift direction of a point mass with this bank angle is opposite to the side of the nose.
        let lift = force(&velocity, &position, bank, 1.0, 0.0);
        let (e, a) = (velocity.normalize(), 16f64.to_radians());
        let nose = e * a.cos() - lift * a.sin();
        let side = nose.cross(&lift).normalize();
        let axes = linkwork_spatial::Mat3::from_columns(&[nose, side, nose.cross(&side)]);
        let turned = linkwork_spatial::nalgebra::Rotation3::from_matrix_unchecked(axes);
        NodeState {
            position,
            velocity,
            rotation: Quat::from_rotation_matrix(&turned),
            angular: Vec3::zeros(),
        }
    }

    fn at(m: &BankControl, body: NodeState, bank: f64) -> BankControlOut {
        m.feedthrough(&Clock::at(0.0, 0.05, 0), &BankControlIn { body, bank })
    }

    #[test]
    fn the_bank_is_that_of_the_lift_of_a_point() {
        let m = BankControl::build(params()).unwrap();
        for want in [0.0, 0.7, -1.2, 2.9, -3.0] {
            let y = at(&m, capsule(want), 0.0);
            assert!((y.measured - want).abs() < 1e-12, "{} {want}", y.measured);
        }
        // The shorter direction passes 180°.
        assert!((at(&m, capsule(-3.0), 3.0).error + (std::f64::consts::TAU - 6.0)).abs() < 1e-12);
    }

    /// A free body under the control law alone: the bank angle follows the second-order system, and there is no other rotation.
    #[test]
    fn the_error_decays_as_its_closed_form() {
        let m = BankControl::build(params()).unwrap();
        let (mut body, mut w) = (capsule(0.4), Vec3::zeros());
        let (want, h) = (0.5, 1e-3);
        for _ in 0..4000 {
            let torque = at(&m, body, want).torque;
            let gyro = w.cross(&params().inertia.component_mul(&w));
            w += (torque - gyro).component_div(&params().inertia) * h;
            body.rotation *= Quat::from_scaled_axis(w * h);
            body.angular = body.rotation * w;
        }
        // With λ = 4 k, the error decays as (1 + λ t/2) e^(−λ t/2); here t = 4 s.
        let x = 0.5 * 1.2 * 4.0_f64;
        let left = want - at(&m, body, want).measured;
        assert!((left / (0.1 * (1.0 + x) * (-x).exp()) - 1.0).abs() < 2e-3, "{left}");
        let e = body.velocity.normalize();
        let nose = body.rotation * Vec3::x();
        assert!((nose.dot(&e) - 16f64.to_radians().cos()).abs() < 1e-4, "{}", nose.dot(&e));
    }

    #[test]
    fn limits_hold_and_what_makes_no_sense_is_refused() {
        let m = BankControl::build(BankControlParams { torque_max: 50.0, ..params() }).unwrap();
        let y = at(&m, capsule(0.0), 2.0);
        assert!(y.torque.amax() == 50.0 && (y.error - 2.0).abs() < 1e-12, "{}", y.torque);
        // The lift is zero while the nose is along the velocity, so only the rates are controlled.
        let mut body = capsule(0.0);
        body.rotation = Quat::rotation_between(&Vec3::x(), &body.velocity).unwrap();
        assert_eq!(at(&m, body, 1.0).torque, Vec3::zeros());
        let wrong = BankControlParams { inertia: Vec3::zeros(), ..params() };
        assert!(BankControl::build(wrong).is_err_and(|e| e.param.as_deref() == Some("inertia")));
        let wrong = BankControlParams { nose: Vec3::zeros(), ..params() };
        assert!(BankControl::build(wrong).is_err_and(|e| e.param.as_deref() == Some("nose")));
    }
}

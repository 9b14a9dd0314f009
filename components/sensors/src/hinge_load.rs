//! `sensors.hinge_load`: exact force and moment through a hinge, for controllers that are tested without an instrument.
//! ```text
//! force   Rᵀ f        moment   Rᵀ (n − p × f)        f, n: force and moment on the body through its hinge, about the origin and in the axes
//!                                                     of the hinge's frame on the body; p, R: the sensor's frame in that frame
//! ```
//! `sensors.force_torque` has the errors of an instrument. Bind `tool` to the body that the sensor carries. A locked hinge needs `reaction: true`.

use linkwork_render::spatial::nalgebra::Quaternion;
use linkwork_runtime::prelude::*;

/// The sensor's frame.
#[derive(Params, Clone, Debug)]
pub struct HingeLoadParams {
    /// Position in the hinge's frame on the body.
    #[param(default = [0.0, 0.0, 0.0])]
    pub position: [f64; 3],
    /// Attitude in that frame, a unit quaternion x, y, z, w.
    #[param(default = [0.0, 0.0, 0.0, 1.0])]
    pub attitude: [f64; 4],
}

/// Load of the hinge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HingeLoadIn {
    /// Load of the hinge of the body that the sensor carries.
    #[port(bind = "tool")]
    pub load: HingeLoad,
}

/// Readings.
#[derive(Ports, Clone, Copy, Debug)]
pub struct HingeLoadOut {
    /// Force on the body, axes of the sensor.
    #[port("N")]
    pub force: Vec3,
    /// Moment on the body about the origin of the sensor, axes of the sensor.
    #[port("N m")]
    pub torque: Vec3,
}

/// Exact load of a hinge.
pub struct HingeLoadSensor {
    position: Vec3,
    back: Quat,
}

/// Force and moment through a hinge, exact and continuous.
#[model("sensors.hinge_load")]
impl Model for HingeLoadSensor {
    type Params = HingeLoadParams;
    type FeedthroughInputs = HingeLoadIn;
    type FeedthroughOutputs = HingeLoadOut;
    fn build(p: HingeLoadParams) -> Result<Self, BuildError> {
        let square: f64 = p.attitude.iter().map(|x| x * x).sum();
        if !((square - 1.0).abs() < 1e-6) {
            let fact = format!("the length of the quaternion is {}, not 1", square.sqrt());
            let help = "write a unit quaternion x, y, z, w";
            return Err(BuildError::new(fact).help(help).at("attitude"));
        }
        if !p.position.iter().all(|x| x.is_finite()) {
            let fact = format!("the position is {:?} m, which is not finite", p.position);
            return Err(BuildError::new(fact).help("write finite numbers").at("position"));
        }
        let [x, y, z, w] = p.attitude;
        let turn = Quat::new_normalize(Quaternion::new(w, x, y, z));
        Ok(HingeLoadSensor { position: Vec3::from(p.position), back: turn.inverse() })
    }
    fn feedthrough(&self, u: &HingeLoadIn) -> HingeLoadOut {
        let HingeLoad { force, moment } = u.load;
        HingeLoadOut {
            force: self.back * force,
            torque: self.back * (moment - self.position.cross(&force)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A force of 2 N along y at x = 0.3 m, measured at x = 0.1 m in axes that are rotated by 90° about z.
    #[test]
    fn a_force_is_read_about_the_sensor_in_its_axes() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let p = HingeLoadParams { position: [0.1, 0.0, 0.0], attitude: [0.0, 0.0, half, half] };
        let m = HingeLoadSensor::build(p).unwrap();
        let force = Vec3::new(0.0, 2.0, 0.0);
        let moment = Vec3::new(0.3, 0.0, 0.0).cross(&force);
        let y = m.feedthrough(&HingeLoadIn { load: HingeLoad { force, moment } });
        assert!((y.force - Vec3::new(2.0, 0.0, 0.0)).norm() < 1e-15, "{}", y.force);
        assert!((y.torque - Vec3::new(0.0, 0.0, 0.4)).norm() < 1e-15, "{}", y.torque);
        let p = HingeLoadParams { position: [0.0; 3], attitude: [0.0, 0.0, 0.0, 1.1] };
        assert!(HingeLoadSensor::build(p).is_err());
    }
}

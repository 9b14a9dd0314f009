//! `sensors.joint_motion`: exact angle and rate of a joint, for controllers that are tested without an encoder.

use linkwork_runtime::prelude::*;

/// The joint.
#[derive(Ports, Clone, Copy, Debug)]
pub struct JointMotionIn {
    /// The joint.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
}

/// Its motion.
#[derive(Ports, Clone, Copy, Debug)]
pub struct JointMotionOut {
    /// Angle, or displacement of a slider.
    #[port("rad", slider = "m")]
    pub angle: f64,
    /// Rate of the angle or displacement.
    #[port("rad/s", slider = "m/s")]
    pub rate: f64,
}

/// Exact motion of a joint.
pub struct JointMotion {}

/// Angle and rate of a joint, exact and continuous.
#[model("sensors.joint_motion")]
impl Model for JointMotion {
    type FeedthroughInputs = JointMotionIn;
    type FeedthroughOutputs = JointMotionOut;
    fn feedthrough(&self, u: &JointMotionIn) -> JointMotionOut {
        JointMotionOut { angle: u.shaft.angle, rate: u.shaft.rate }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_joint_is_read_as_it_is() {
        let shaft = HingeState { angle: 0.3, rate: -2.0 };
        let y = JointMotion {}.feedthrough(&JointMotionIn { shaft });
        assert_eq!((y.angle, y.rate), (0.3, -2.0));
    }
}

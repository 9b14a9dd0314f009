//! Passive elements on hinges: spring-damper, soft stop, differential.
//! ```text
//! spring-damper   τ = −k (q − q₀) − c q̇,   energy ½ k (q − q₀)²,   loss c q̇²
//! soft stop       τ = ∓ k δ (1 + d δ̇)₊          δ: how far beyond the stop (Hunt, Crossley)
//! differential    e = q_l + n q_r,   τ_l = −k e − c ė,   τ_r = n τ_l
//! ```
//! The differential does work only on e: with n = 1 the two rockers rotate in opposite directions, and the chassis keeps their mean angle.

use linkwork_multibody::Spring;
use linkwork_runtime::prelude::*;

/// A hinge.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ShaftIn {
    /// The hinge.
    #[port(bind = "shaft")]
    pub shaft: HingeState,
}

/// A torque.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ShaftOut {
    /// Torque on the hinge.
    #[port(bind = "shaft")]
    pub torque: HingeTorque,
}

/// Spring and damper.
#[derive(Params, Clone, Debug)]
pub struct SpringDamperParams {
    /// Stiffness.
    #[param(unit = "N m/rad", slider = "N/m", default = 0.0, range = 0.0..)]
    pub stiffness: f64,
    /// Damping.
    #[param(unit = "N m s/rad", slider = "N s/m", default = 0.0, range = 0.0..)]
    pub damping: f64,
    /// Coordinate at rest.
    #[param(unit = "rad", slider = "m", default = 0.0, needs = "stiffness")]
    pub rest: f64,
}

/// Torque, energy and loss of a spring-damper.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SpringDamperOut {
    /// Torque on the hinge.
    #[port(bind = "shaft")]
    pub torque: HingeTorque,
    /// Elastic energy of the spring.
    #[port("J", stored)]
    pub energy: f64,
    /// Power that the damper dissipates.
    #[port("W", lost)]
    pub loss: f64,
}

/// A spring-damper.
pub struct SpringDamper {
    p: SpringDamperParams,
}

/// Linear spring and damper on a hinge. A body's hinge has the same law in its fields `spring` and `damping`. In addition, the outputs of the part
/// can be logged, and a phase can remove it.
#[model("actuators.spring_damper")]
impl Model for SpringDamper {
    type Params = SpringDamperParams;
    type FeedthroughInputs = ShaftIn;
    type FeedthroughOutputs = SpringDamperOut;
    fn feedthrough(&self, u: &ShaftIn) -> SpringDamperOut {
        let p = &self.p;
        let (q, rate) = (u.shaft.angle, u.shaft.rate);
        let spring = Spring { stiffness: p.stiffness, rest: p.rest };
        SpringDamperOut {
            torque: HingeTorque(spring.force(q) - p.damping * rate),
            energy: spring.energy(q),
            loss: p.damping * rate * rate,
        }
    }
}

/// Two stops.
#[derive(Params, Clone, Debug)]
pub struct SoftStopParams {
    /// Lower stop.
    #[param(unit = "rad", slider = "m")]
    pub lower: f64,
    /// Upper stop.
    #[param(unit = "rad", slider = "m")]
    pub upper: f64,
    /// Stiffness beyond a stop.
    #[param(unit = "N m/rad", slider = "N/m", default = 1e4, range = 0.0..)]
    pub stiffness: f64,
    /// Dissipation: the torque increases by this fraction per rad/s (m/s) into the stop.
    #[param(unit = "s/rad", slider = "s/m", default = 1.0, range = 0.0..)]
    pub dissipation: f64,
}

/// Soft stops.
pub struct SoftStop {
    p: SoftStopParams,
}

/// Elastic stops of a hinge with Hunt-Crossley dissipation; they never pull, and their torque is continuous.
#[model("actuators.soft_stop")]
impl Model for SoftStop {
    type Params = SoftStopParams;
    type FeedthroughInputs = ShaftIn;
    type FeedthroughOutputs = ShaftOut;
    fn build(p: SoftStopParams) -> Result<Self, BuildError> {
        if p.lower >= p.upper {
            return Err(BuildError::new("the lower stop must lie below the upper one").at("lower"));
        }
        Ok(SoftStop { p })
    }
    fn feedthrough(&self, u: &ShaftIn) -> ShaftOut {
        let p = &self.p;
        let push = |depth: f64, speed: f64| {
            p.stiffness * depth.max(0.0) * (1.0 + p.dissipation * speed).max(0.0)
        };
        let HingeState { angle, rate } = u.shaft;
        let torque = push(p.lower - angle, -rate) - push(angle - p.upper, rate);
        ShaftOut { torque: HingeTorque(torque) }
    }
}

/// A rocker differential.
#[derive(Params, Clone, Debug)]
pub struct DifferentialParams {
    /// Ratio n of `left + n right = 0`.
    #[param(default = 1.0)]
    pub ratio: f64,
    /// Stiffness of the mechanism.
    #[param(unit = "N m/rad", slider = "N/m", default = 1e5, range = 0.0..)]
    pub stiffness: f64,
    /// Damping of the mechanism.
    #[param(unit = "N m s/rad", slider = "N s/m", default = 2e3, range = 0.0..)]
    pub damping: f64,
}

/// Two hinges.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DifferentialIn {
    /// Left rocker.
    #[port(bind = "left")]
    pub left: HingeState,
    /// Right rocker.
    #[port(bind = "right")]
    pub right: HingeState,
}

/// Two torques.
#[derive(Ports, Clone, Copy, Debug)]
pub struct DifferentialOut {
    /// Torque on the left rocker.
    #[port(bind = "left")]
    pub left_torque: HingeTorque,
    /// Torque on the right rocker.
    #[port(bind = "right")]
    pub right_torque: HingeTorque,
    /// Error of the constraint.
    #[port("rad", slider = "m")]
    pub error: f64,
}

/// A differential.
pub struct Differential {
    p: DifferentialParams,
}

/// Rover differential as a stiff spring-damper between two hinges: left + ratio · right is held at zero.
#[model("actuators.differential")]
impl Model for Differential {
    type Params = DifferentialParams;
    type FeedthroughInputs = DifferentialIn;
    type FeedthroughOutputs = DifferentialOut;
    fn feedthrough(&self, u: &DifferentialIn) -> DifferentialOut {
        let p = &self.p;
        let error = u.left.angle + p.ratio * u.right.angle;
        let speed = u.left.rate + p.ratio * u.right.rate;
        let torque = -p.stiffness * error - p.damping * speed;
        DifferentialOut {
            left_torque: HingeTorque(torque),
            right_torque: HingeTorque(p.ratio * torque),
            error,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shaft(angle: f64, rate: f64) -> ShaftIn {
        ShaftIn { shaft: HingeState { angle, rate } }
    }

    #[test]
    fn spring_pulls_back_to_rest() {
        let p = SpringDamperParams { stiffness: 10.0, damping: 2.0, rest: 0.1 };
        let y = SpringDamper { p }.feedthrough(&shaft(0.4, 0.5));
        assert!((y.torque.0 + 4.0).abs() < 1e-12);
        // The energy is ½ 10 · 0.3² and the loss 2 · 0.5².
        assert!((y.energy - 0.45).abs() < 1e-12 && (y.loss - 0.5).abs() < 1e-12);
    }

    #[test]
    fn stops_push_inwards_and_never_pull() {
        let p = SoftStopParams { lower: -1.0, upper: 0.5, stiffness: 100.0, dissipation: 2.0 };
        let stop = SoftStop::build(p.clone()).unwrap();
        let torque = |a, r| stop.feedthrough(&shaft(a, r)).torque.0;
        assert_eq!(torque(0.0, 9.0), 0.0);
        assert!(
            (torque(0.6, 0.0) + 10.0).abs() < 1e-12 && (torque(-1.1, 0.0) - 10.0).abs() < 1e-12
        );
        assert!(torque(0.6, 0.1) < torque(0.6, 0.0), "entering is resisted more");
        assert_eq!(torque(0.6, -5.0), 0.0, "leaving fast does not stick");
        assert!(SoftStop::build(SoftStopParams { lower: 1.0, ..p }).is_err());
    }

    #[test]
    fn differential_ignores_opposite_turns_and_does_no_work_on_them() {
        let p = DifferentialParams { ratio: 1.0, stiffness: 1e3, damping: 10.0 };
        let d = Differential { p };
        let at = |l: f64, r: f64| {
            let u = DifferentialIn {
                left: HingeState { angle: l, rate: 0.0 },
                right: HingeState { angle: r, rate: 0.0 },
            };
            d.feedthrough(&u)
        };
        assert_eq!(at(0.2, -0.2).left_torque.0, 0.0);
        let y = at(0.2, 0.1);
        assert!((y.left_torque.0 + 300.0).abs() < 1e-9 && y.left_torque == y.right_torque);
    }
}

//! `mobility.wheel_rigid_quasi_static`: a rigid wheel on rigid ground without inertia.
//! ```text
//! R = μ N / max(|u|, V/100)      Coulomb's friction against the velocity of the rim, and creep below it
//! z = (N/k)^(1/e)
//! ```
use super::{QuasiStaticIn, Sliding, idle};
use crate::wheel_rigid::WheelRigidParams;
use linkwork_runtime::prelude::*;

/// Traction, load and quantities for plots.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RigidQuasiStaticOut {
    /// Traction for the force balance of the machine.
    #[port(bind = "hub")]
    pub traction: Traction,
    /// Normal force; negative if the wheel would have to be pulled down.
    #[port("N")]
    pub normal_force: f64,
    /// Slip (rω − v)/max(|rω|, |v|), signed.
    #[port("1")]
    pub slip: f64,
    /// Angle of the hub's velocity to the heading.
    #[port("rad")]
    pub slip_angle: f64,
    /// Penetration.
    #[port("m")]
    pub sinkage: f64,
    /// Point where the load acts, W.
    #[port("m")]
    pub contact_point: Vec3,
    /// Force of the ground, W.
    #[port("N")]
    pub contact_force: Vec3,
    /// Drive torque on the axle.
    #[port("N m")]
    pub torque: f64,
    /// Power dissipated in the contact.
    #[port("W")]
    pub power: f64,
}

/// Slip below which friction is proportional to the slip; over some decimetres the bristles of a wheel yield by a similar amount before they slide.
const CREEP: f64 = 1e-2;

/// A rigid wheel without inertia.
pub struct WheelRigidQuasiStatic {
    p: WheelRigidParams,
}

/// A rigid wheel on rigid ground, for quasi-static machines: Coulomb friction with a creep of a hundredth of the speed,
/// and the penetration of its spring. The parameters for damping and bristles have no effect.
#[model("mobility.wheel_rigid_quasi_static")]
impl Model for WheelRigidQuasiStatic {
    type Params = WheelRigidParams;
    fn without_effect(&self, _: IsWired<'_>) -> Judged {
        let names = ["dissipation", "tangential_stiffness", "tangential_damping"];
        idle(names, "damping nor bristles", "mobility.wheel_rigid")
    }
    fn build(p: WheelRigidParams) -> Result<Self, BuildError> {
        p.ground()?;
        Ok(WheelRigidQuasiStatic { p })
    }
    type FeedthroughInputs = QuasiStaticIn;
    type FeedthroughOutputs = RigidQuasiStaticOut;
    fn feedthrough(&self, u: &QuasiStaticIn) -> RigidQuasiStaticOut {
        let p = &self.p;
        let wheel = Sliding::of(u, p.radius, &*p.terrain);
        let at = wheel.hub.position;
        let friction = p.friction.unwrap_or_else(|| p.terrain.soil(at.x, at.y).friction);
        let [ahead, side] = wheel.slides;
        let limit = friction * wheel.carries;
        let resists = limit / ahead.hypot(side).max(CREEP * wheel.scale);
        let sinkage = (wheel.carries / p.stiffness).powf(1.0 / p.exponent);
        let force = u.load.force;
        let spin = wheel.hub.angular.dot(&wheel.hub.axle);
        let turns = if spin == 0.0 { 0.0 } else { spin.signum() };
        let rolling = p.rolling_resistance * wheel.carries;
        RigidQuasiStaticOut {
            traction: Traction {
                force: Vec3::zeros(),
                moment: Vec3::zeros(),
                resistance: [resists; 2],
                limit: [limit; 2],
                sinkage,
            },
            normal_force: force.dot(&wheel.normal),
            slip: wheel.slip(),
            slip_angle: wheel.slip_angle(),
            sinkage,
            contact_point: u.load.point,
            contact_force: force,
            torque: wheel.radius * (force.dot(&wheel.axes[0]) + rolling * turns),
            power: resists * (ahead * ahead + side * side) + wheel.radius * rolling * spin.abs(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wheel_rigid::tests::plane;

    fn wheel() -> WheelRigidQuasiStatic {
        WheelRigidQuasiStatic {
            p: WheelRigidParams {
                radius: 0.25,
                width: 0.4,
                stiffness: 4e5,
                exponent: 1.0,
                dissipation: 0.0,
                tangential_stiffness: 2e5,
                tangential_damping: 1500.0,
                friction: Some(0.6),
                rolling_resistance: 0.0,
                terrain: plane(0.0),
            },
        }
    }

    /// Wheel with a rim speed of 0.25 m/s and the velocity `u` (m/s) relative to the ground.
    fn slides(u: [f64; 2]) -> RigidQuasiStaticOut {
        let hub = NodeState {
            position: Vec3::new(0.0, 0.0, 0.249),
            rotation: Quat::identity(),
            angular: Vec3::y(),
            velocity: Vec3::new(0.249 + u[0], u[1], 0.0),
        };
        let load = ContactLoad { force: Vec3::new(30.0, 0.0, 400.0), point: Vec3::zeros() };
        wheel().feedthrough(&QuasiStaticIn { hub, load })
    }

    #[test]
    fn beyond_its_creep_friction_has_one_size_in_all_directions() {
        for u in [[0.1, 0.0], [-0.03, 0.04], [0.0, -0.2]] {
            let t = slides(u).traction;
            let force = Vec3::new(t.resistance[0] * u[0], t.resistance[1] * u[1], 0.0);
            assert!((force.norm() - 0.6 * 400.0).abs() < 1e-9, "{force:?}");
            assert_eq!(t.force, Vec3::zeros());
        }
        let y = slides([-0.03, 0.04]);
        assert!((y.power - 0.6 * 400.0 * 0.05).abs() < 1e-9, "{}", y.power);
        assert!((y.sinkage - 1e-3).abs() < 1e-15 && (y.torque - 0.249 * 30.0).abs() < 1e-12);
        assert!((y.slip - 0.03 / 0.249).abs() < 1e-12, "{}", y.slip);
    }

    #[test]
    fn below_it_resists_like_a_thick_fluid() {
        let y = slides([1e-5, 0.0]);
        assert!((y.traction.resistance[0] - 0.6 * 400.0 / 0.249_01e-2).abs() < 1.0, "{y:?}");
    }

    #[test]
    fn in_the_air_there_is_no_traction() {
        let hub = NodeState::identity();
        let load = ContactLoad { force: -Vec3::z(), point: Vec3::zeros() };
        let y = wheel().feedthrough(&QuasiStaticIn { hub, load });
        assert_eq!((y.traction.resistance, y.sinkage), ([0.0; 2], 0.0));
        assert!((y.normal_force + 1.0).abs() < 1e-15);
    }
}

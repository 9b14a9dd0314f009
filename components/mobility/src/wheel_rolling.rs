//! `mobility.wheel_rolling`: load of a wheel that rolls without slip, for machines that move by kinematics.
//! ```text
//! N = F · n                     normal force;   F: the load of the wheel at rest, n: the ground's normal where it acts
//! τ = r (c_rr N sign ω + F · t)   torque of the drive: rolling resistance, and the part of F along the heading t, which drives
//! ```
//! Its outputs have the names of those of the models with forces, so that plots and software work with either model.

use crate::wheel_rigid::{hub_of, slip_of};
use linkwork_surroundings::prelude::*;

/// Wheel and ground.
#[derive(Params, Clone, Debug)]
pub struct WheelRollingParams {
    /// Radius of the rim.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// Width along the axle; without effect in this model.
    #[param(unit = "m", range = 1e-3..)]
    pub width: f64,
    /// Coefficient of rolling resistance c_rr: ratio of resistance to normal force.
    #[param(default = 0.05, range = 0.0..=1.0)]
    pub resistance: f64,
    /// The ground.
    #[param(service)]
    pub terrain: Handle<dyn Terrain>,
}

/// Hub and load.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RollingIn {
    /// Hub of the wheel: its y axis is the axle.
    #[port(bind = "hub", axle = "y")]
    pub hub: NodeState,
    /// Contact load of the wheel.
    #[port(bind = "hub")]
    pub load: ContactLoad,
}

/// Load, torque and slip of the wheel.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RollingOut {
    /// Normal force; negative where only a pull would keep the wheel down.
    #[port("N")]
    pub normal_force: f64,
    /// Slip (rω − v)/max(|rω|, |v|), signed; it results from wheels whose speeds do not agree.
    #[port("1")]
    pub slip: f64,
    /// Angle of the hub's velocity to the heading.
    #[port("rad")]
    pub slip_angle: f64,
    /// Greatest penetration: none.
    #[port("m")]
    pub sinkage: f64,
    /// Point where the load acts, W.
    #[port("m")]
    pub contact_point: Vec3,
    /// Force of the ground, W.
    #[port("N")]
    pub contact_force: Vec3,
    /// Torque that the drive gives to the axle.
    #[port("N m")]
    pub torque: f64,
    /// Power dissipated by rolling resistance.
    #[port("W")]
    pub power: f64,
}

/// A wheel that rolls.
pub struct WheelRolling {
    p: WheelRollingParams,
}

/// Wheel of a machine that moves by kinematics, with its load at rest and the torque of its drive.
#[model("mobility.wheel_rolling")]
impl Model for WheelRolling {
    type Params = WheelRollingParams;
    type FeedthroughInputs = RollingIn;
    type FeedthroughOutputs = RollingOut;
    fn feedthrough(&self, u: &RollingIn) -> RollingOut {
        let (hub, p) = (hub_of(&u.hub), &self.p);
        let ContactLoad { force, point } = u.load;
        let normal = p.terrain.ground(point.x, point.y).map_or_else(Vec3::z, |g| g.normal);
        let heading = hub.axle.cross(&normal).try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        let (normal_force, rate) = (force.dot(&normal), hub.angular.dot(&hub.axle));
        let (slip, slip_angle) = slip_of(&hub, p.radius, &normal);
        let resists = p.resistance * normal_force.max(0.0);
        let turns = if rate == 0.0 { 0.0 } else { rate.signum() };
        RollingOut {
            normal_force,
            slip,
            slip_angle,
            sinkage: 0.0,
            contact_point: point,
            contact_force: force,
            torque: p.radius * (resists * turns + force.dot(&heading)),
            power: p.radius * resists * rate.abs(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wheel_rigid::tests::plane;

    fn wheel(slope: f64, rate: f64) -> RollingOut {
        let p =
            WheelRollingParams { radius: 0.25, width: 0.4, resistance: 0.1, terrain: plane(slope) };
        let heading = Vec3::new(1.0, 0.0, slope).normalize();
        let hub = NodeState {
            position: Vec3::new(0.0, 0.0, 0.25),
            rotation: Quat::identity(),
            angular: Vec3::y() * rate,
            velocity: heading * (0.25 * rate),
        };
        let load = ContactLoad { force: Vec3::z() * 100.0, point: Vec3::zeros() };
        WheelRolling { p }.feedthrough(&RollingIn { hub, load })
    }

    #[test]
    fn on_the_level_it_takes_the_torque_of_rolling_resistance() {
        let y = wheel(0.0, 0.8);
        assert!((y.normal_force - 100.0).abs() < 1e-12 && y.slip.abs() < 1e-12);
        assert!((y.torque - 0.25 * 10.0).abs() < 1e-12 && (y.power - 0.8 * 2.5).abs() < 1e-12);
        assert!((wheel(0.0, -0.8).torque + 2.5).abs() < 1e-12);
    }

    #[test]
    fn uphill_its_torque_lifts_the_load() {
        // The load is 100 N on a slope of 0.3. The power of the torque minus the resistance equals the power
        // of lifting.
        let y = wheel(0.3, 0.8);
        let lifts = 100.0 * 0.25 * 0.8 * 0.3 / 1.09_f64.sqrt();
        assert!((y.torque * 0.8 - y.power - lifts).abs() < 1e-12, "{}", y.torque);
        assert!((y.normal_force - 100.0 / 1.09_f64.sqrt()).abs() < 1e-12);
    }
}

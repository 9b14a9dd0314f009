//! `mobility.wheel_rigid`: rigid wheel on rigid ground with the contact of `rigid_contact`.
//! ```text
//! rolling resistance   M = −k ζ − d ω, cut to |M| ≤ c_rr N r      about the axle, ω: rate of the rim; ζ: a bristle as of dry friction
//!                      k = k_t r², d = d_t r²                     k_t, d_t: tangential stiffness and damping
//! ```
//! With rolling resistance a free wheel stays at rest on slopes up to tan⁻¹ c_rr, and a vehicle with light wheels coasts with the deceleration c_rr
//! g.
//!
//! The node of the hub may rotate with the wheel or not; the model uses only the direction of its y axis (the axle, to the left) and its angular
//! velocity.

use crate::rigid_contact::{Bristles, Hub, RigidContact};
use linkwork_collision::relief::Wheel;
use linkwork_solvers::contact_law::gives_way;
use linkwork_surroundings::prelude::*;

/// Wheel, ground and contact parameters.
#[derive(Params, Clone, Debug)]
pub struct WheelRigidParams {
    /// Radius of the rim.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// Width along the axle.
    #[param(unit = "m", range = 1e-3..)]
    pub width: f64,
    /// Normal stiffness k, N/m^p with the exponent p.
    #[param(default = 4e5, range = 1.0..)]
    pub stiffness: f64,
    /// Exponent p of the normal force: 1 for a flat contact, 1.5 for a sphere.
    #[param(default = 1.0, range = 1.0..=2.0)]
    pub exponent: f64,
    /// Hunt-Crossley dissipation.
    #[param(unit = "s/m", default = 3.0, range = 0.0..)]
    pub dissipation: f64,
    /// Tangential stiffness.
    #[param(unit = "N/m", default = 2e5, range = 1.0..)]
    pub tangential_stiffness: f64,
    /// Tangential damping.
    #[param(unit = "N s/m", default = 1500.0, range = 0.0..)]
    pub tangential_damping: f64,
    /// Coulomb friction coefficient; default: from the soil of the terrain.
    #[param(default = None, range = 0.0..)]
    pub friction: Option<f64>,
    /// Coefficient of rolling resistance c_rr: ratio of resistance to normal force.
    #[param(default = 0.0, range = 0.0..=1.0)]
    pub rolling_resistance: f64,
    /// Terrain of the ground.
    #[param(service)]
    pub terrain: Handle<dyn Terrain>,
}

impl WheelRigidParams {
    /// Checks that a friction coefficient is given.
    ///
    /// # Errors
    /// Neither the wheel nor the terrain has a friction coefficient.
    pub(crate) fn ground(&self) -> Result<(), BuildError> {
        if self.friction.is_some() {
            return Ok(());
        }
        self.terrain.needs_soil().map_err(|e| {
            let help = e.help.unwrap_or_default();
            BuildError::new(format!("{}, and the wheel does not define `friction`", e.message))
                .help(format!("write `friction`, or {help}"))
                .at("friction")
        })
    }
}

/// Hub of the wheel.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WheelIn {
    /// Hub of the wheel: its y axis is the axle.
    #[port(bind = "hub", axle = "y")]
    pub hub: NodeState,
}

/// Contact load, slip and rates of the bristles.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RigidOut {
    /// Load of the ground on the wheel.
    #[port(bind = "hub")]
    pub load: Wrench,
    /// Sum of the normal forces.
    #[port("N")]
    pub normal_force: f64,
    /// Slip (rω − v)/max(|rω|, |v|), signed.
    #[port("1")]
    pub slip: f64,
    /// Angle of the hub's velocity to the heading.
    #[port("rad")]
    pub slip_angle: f64,
    /// Greatest penetration.
    #[port("m")]
    pub sinkage: f64,
    /// Point at which the load acts, W.
    #[port("m")]
    pub contact_point: Vec3,
    /// Force of the ground, W.
    #[port("N")]
    pub contact_force: Vec3,
    /// Power dissipated in the contact.
    #[port("W")]
    pub power: f64,
    /// Rate of the right disc's bristle, W.
    #[port("m/s")]
    pub right_rate: Vec3,
    /// Rate of the middle disc's bristle, W.
    #[port("m/s")]
    pub middle_rate: Vec3,
    /// Rate of the left disc's bristle, W.
    #[port("m/s")]
    pub left_rate: Vec3,
    /// Moment of rolling resistance about the axle.
    #[port("N m")]
    pub rolling_moment: f64,
    /// Rate of the bristle of rolling resistance.
    #[port("rad/s")]
    pub rolling_rate: f64,
}

/// Deflections of the bristles of the three discs.
#[derive(State, Clone, Copy, Debug)]
pub struct BristleState {
    /// Right disc, W.
    #[port("m")]
    pub right: Vec3,
    /// Middle disc, W.
    #[port("m")]
    pub middle: Vec3,
    /// Left disc, W.
    #[port("m")]
    pub left: Vec3,
    /// Bristle of rolling resistance.
    #[port("rad")]
    pub rolling: f64,
}

impl BristleState {
    fn array(&self) -> Bristles {
        [self.right, self.middle, self.left]
    }
}

/// Rigid wheel on rigid ground: Hunt-Crossley normal force and elasto-plastic bristle friction on three discs.
pub struct WheelRigid {
    p: WheelRigidParams,
}

/// Depth relative to the radius above which a wheel at the start causes a warning, because the contact would throw it out.
const STARTS_IN: f64 = 0.1;

/// Returns a warning for a wheel that starts deep in the ground.
pub(crate) fn in_the_ground(depth: f64, radius: f64, most: f64) -> Vec<BuildError> {
    if !(depth > most * radius) {
        return Vec::new();
    }
    let fact = format!(
        "the wheel starts {depth:.3} m deep in the ground, {:.0} % of its radius; the contact force will throw it out",
        100.0 * depth / radius
    );
    let help = "start higher, or let `place` put the machine on the ground";
    vec![BuildError::new(fact).help(help)]
}

/// Converts the state of a node to the hub state of the contact models.
pub(crate) fn hub_of(n: &NodeState) -> Hub {
    Hub {
        position: n.position,
        axle: n.rotation * Vec3::y(),
        velocity: n.velocity,
        angular: n.angular,
    }
}

/// Returns slip and slip angle (rad) of a wheel of radius `r` (m) on ground with the normal `n`.
pub(crate) fn slip_of(hub: &Hub, r: f64, n: &Vec3) -> (f64, f64) {
    const STANDING: f64 = 1e-3; // m/s
    let heading = hub.axle.cross(n);
    let side = n.cross(&heading);
    let (vx, vy) = (hub.velocity.dot(&heading), hub.velocity.dot(&side));
    let u = r * hub.angular.dot(&hub.axle);
    let slip = (u - vx) / u.abs().max(vx.abs()).max(STANDING);
    let angle = if vx.hypot(vy) > STANDING { vy.atan2(vx.abs()) } else { 0.0 };
    (slip, angle)
}

impl WheelRigid {
    /// Returns the moment of rolling resistance (N m), the rate of its bristle `z` (rad/s), and the dissipated power (W).
    fn rolls(&self, z: f64, spin: f64, normal: f64) -> [f64; 3] {
        let p = &self.p;
        if p.rolling_resistance == 0.0 {
            return [0.0; 3];
        }
        let square = p.radius * p.radius;
        let (k, d) = (p.tangential_stiffness * square, p.tangential_damping * square);
        let most = p.rolling_resistance * normal.max(0.0) * p.radius;
        let moment = (-k * z - d * spin).clamp(-most, most);
        let rate = spin - gives_way(z.abs(), spin * z.signum(), most / k) * z;
        [moment, rate, -moment * spin - k * z * rate]
    }

    fn contact(&self, hub: &Hub) -> RigidContact {
        let p = &self.p;
        let friction =
            p.friction.unwrap_or_else(|| p.terrain.soil(hub.position.x, hub.position.y).friction);
        RigidContact {
            wheel: Wheel { radius: p.radius, width: p.width },
            stiffness: p.stiffness,
            exponent: p.exponent,
            dissipation: p.dissipation,
            tangential_stiffness: p.tangential_stiffness,
            tangential_damping: p.tangential_damping,
            friction,
        }
    }
}

/// Rigid wheel on rigid ground: Hunt-Crossley normal force and elasto-plastic bristle friction on three
/// discs across the width. A parked wheel does not creep.
#[model("mobility.wheel_rigid")]
impl Model for WheelRigid {
    type Params = WheelRigidParams;
    fn build(p: WheelRigidParams) -> Result<Self, BuildError> {
        p.ground()?;
        Ok(WheelRigid { p })
    }
    type FeedthroughInputs = WheelIn;
    type FeedthroughOutputs = RigidOut;
    type State = BristleState;
    fn feedthrough(&self, x: &BristleState, u: &WheelIn) -> RigidOut {
        let hub = hub_of(&u.hub);
        let (load, [right_rate, middle_rate, left_rate]) =
            self.contact(&hub).evaluate(&hub, &x.array(), &*self.p.terrain);
        let (slip, slip_angle) = slip_of(&hub, self.p.radius, &load.normal);
        let spin = hub.angular.dot(&hub.axle);
        let [rolling_moment, rolling_rate, lost] = self.rolls(x.rolling, spin, load.normal_force);
        RigidOut {
            load: Wrench { moment: load.moment + hub.axle * rolling_moment, force: load.force },
            normal_force: load.normal_force,
            slip,
            slip_angle,
            sinkage: load.depth,
            contact_point: load.point,
            contact_force: load.force,
            power: load.dissipation + lost,
            right_rate,
            middle_rate,
            left_rate,
            rolling_moment,
            rolling_rate,
        }
    }
    fn derivatives(&self, y: &RigidOut) -> BristleState {
        BristleState {
            right: y.right_rate,
            middle: y.middle_rate,
            left: y.left_rate,
            rolling: y.rolling_rate,
        }
    }
    fn startup_warnings(&self, x: &BristleState, u: &WheelIn) -> Vec<BuildError> {
        let depth = self.feedthrough(x, u).sinkage;
        in_the_ground(depth, self.p.radius, STARTS_IN)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use linkwork_surroundings::testing::{self, Plane};

    /// Gravity along −z, m/s².
    pub(crate) fn gravity(g: f64) -> Handle<dyn Gravity> {
        testing::gravity(move |_, _| Vec3::new(0.0, 0.0, -g))
    }

    pub(crate) fn plane(slope: f64) -> Handle<dyn Terrain> {
        let soil = crate::test_soils::lunar();
        Plane { slope, soil, ..Plane::default() }.handle()
    }

    #[test]
    fn model_gives_the_contacts_load_and_the_grounds_friction() {
        let model = WheelRigid {
            p: WheelRigidParams {
                radius: 0.25,
                width: 0.4,
                stiffness: 4e5,
                exponent: 1.0,
                dissipation: 0.0,
                tangential_stiffness: 2e5,
                tangential_damping: 1500.0,
                friction: None,
                rolling_resistance: 0.0,
                terrain: plane(0.0),
            },
        };
        let mut hub = NodeState::identity();
        hub.position.z = 0.249;
        // The rotation angle about the axle has no effect.
        hub.rotation = Quat::from_axis_angle(&Vec3::y_axis(), 2.0);
        hub.velocity.x = 1.0;
        let x = BristleState::zero();
        let y = model.feedthrough(&x, &WheelIn { hub });
        assert!((y.normal_force - 400.0).abs() < 1e-6);
        assert!((y.load.force.x + 0.65 * 400.0).abs() < 1e-6, "{:?}", y.load);
        assert!((y.slip + 1.0).abs() < 1e-12 && y.power > 0.0);
        let rate = model.derivatives(&y);
        assert!((rate.middle - Vec3::x()).norm() < 1e-12);
    }
}

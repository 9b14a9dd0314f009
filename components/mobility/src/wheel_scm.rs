//! `mobility.wheel_scm`: a wheel on deformable ground, node by node (`scm`). It needs a `mobility.scm_ground` in the simulation.
//!
//! The soil constants are those of the terrain under the hub. The slip for the soil is smoothed below 1 cm/s, so that no force depends on the sign of
//! a small speed.

use crate::grousers::{self, GrouserParams};
use crate::rigid_contact::Hub;
use crate::scm::contact::{Bars, Damping, GroundLoad, Law};
use crate::scm::ground::{Imprint, ScmGround, Touched};
use crate::scm::shape::{Form, Presser};
use crate::terramechanics::presses_back;
use crate::wheel_rigid::{WheelIn, hub_of, in_the_ground, slip_of};
use linkwork_surroundings::prelude::*;

/// Wheel, ground and contact constants.
#[derive(Params, Clone, Debug)]
pub struct WheelScmParams {
    /// Radius of the rim.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// Width along the axle.
    #[param(unit = "m", range = 1e-3..)]
    pub width: f64,
    /// Grousers; a smooth wheel does not have any.
    pub grousers: Option<GrouserParams>,
    /// Damping time of the shear; it moves the soil by a twentieth of its shear modulus at most.
    #[param(unit = "s", default = 0.02, range = 0.0..)]
    pub shear_damping: f64,
    /// Normal damping: the pressure grows by this fraction for each m/s of approach.
    #[param(unit = "s/m", default = 4.0, range = 0.0..)]
    pub normal_damping: f64,
    /// The ground.
    #[param(service)]
    pub terrain: Handle<dyn Terrain>,
    /// Gravity, for the weight of the soil that grousers push.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// Loads from the ground, and the footprint.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ScmOut {
    /// Load of the ground on the body.
    #[port(bind = "hub")]
    pub load: Wrench,
    /// Force along the mean normal of the ground.
    #[port("N")]
    pub normal_force: f64,
    /// Slip (rω − v)/max(|rω|, |v|), signed.
    #[port("1")]
    pub slip: f64,
    /// Angle of the hub's velocity to the heading.
    #[port("rad")]
    pub slip_angle: f64,
    /// Greatest sinkage below the previous surface, including heaped soil.
    #[port("m")]
    pub sinkage: f64,
    /// Area that is pressed.
    #[port("m^2")]
    pub area: f64,
    /// Point where the pressure acts, W.
    #[port("m")]
    pub contact_point: Vec3,
    /// Force of the ground, W.
    #[port("N")]
    pub contact_force: Vec3,
    /// Power transferred to the ground.
    #[port("W")]
    pub power: f64,
    /// Middle, for the ground, W.
    #[port("m", bind = "field")]
    pub print_middle: Vec3,
    /// Unit vector of the axle or normal, W, for the ground.
    #[port("1", bind = "field")]
    pub print_axle: Vec3,
    /// Unit vector along the length, W, for the ground.
    #[port("1", bind = "field")]
    pub print_along: Vec3,
    /// Velocity of the middle, W, for the ground.
    #[port("m/s", bind = "field")]
    pub print_velocity: Vec3,
    /// Angular velocity, W, for the ground.
    #[port("rad/s", bind = "field")]
    pub print_angular: Vec3,
    /// Radius, for the ground.
    #[port("m", bind = "field")]
    pub print_radius: f64,
    /// Width, for the ground.
    #[port("m", bind = "field")]
    pub print_width: f64,
    /// Length, for the ground.
    #[port("m", bind = "field")]
    pub print_length: f64,
    /// Slip, for the ground.
    #[port("1", bind = "field")]
    pub print_slip: f64,
}

impl ScmOut {
    /// Returns the outputs of a body with this load, print, slip and slip angle (rad).
    pub(crate) fn of(load: &GroundLoad, print: &Imprint, [slip, slip_angle]: [f64; 2]) -> ScmOut {
        ScmOut {
            load: Wrench { moment: load.moment, force: load.force },
            normal_force: load.normal_force,
            slip,
            slip_angle,
            sinkage: load.sinkage,
            area: load.area,
            contact_point: load.point,
            contact_force: load.force,
            power: load.power,
            print_middle: print.print_middle,
            print_axle: print.print_axle,
            print_along: print.print_along,
            print_velocity: print.print_velocity,
            print_angular: print.print_angular,
            print_radius: print.print_radius,
            print_width: print.print_width,
            print_length: print.print_length,
            print_slip: print.print_slip,
        }
    }
}

/// A wheel on deformable ground.
pub struct WheelScm {
    p: WheelScmParams,
}

/// Speed below which the slip for the soil is smoothed, m/s.
const CREEPING: f64 = 0.01;
/// Depth at the start above which a warning is given: soft ground carries a wheel at about a fifth of its radius, and a wheel that starts deeper is
/// thrown out.
const STARTS_IN: f64 = 0.4;

/// Returns the smoothed slip for the soil.
fn soft_slip(hub: &Hub, radius: f64, n: &Vec3) -> f64 {
    let heading = hub.axle.cross(n).try_normalize(1e-9).unwrap_or_else(Vec3::x);
    let (u, v) = (radius * hub.angular.dot(&hub.axle), hub.velocity.dot(&heading));
    (u - v) / u.abs().max(v.abs()).hypot(CREEPING)
}

/// Returns an error if there is no deformable ground for the body.
pub(crate) fn without_ground(ground: &View<Touched>) -> Vec<BuildError> {
    if ground.get().is_some() {
        return Vec::new();
    }
    let fact = "there is no `mobility.scm_ground`, so no ground carries the wheel";
    let help = "add one, as in `parts/ruts_scm.ron`; the rovers of Linkwork include it with `Environment.ruts: \"scm\"` (on the command line `--set Rover.Environment.ruts=scm`)";
    vec![BuildError::new(fact).help(help)]
}

impl WheelScm {
    /// Returns the radius at which the soil is sheared, m.
    fn shear_radius(&self) -> f64 {
        grousers::shear_radius(self.p.radius, &self.p.grousers)
    }

    /// Returns the grousers on a soil at a time (s), if the wheel has any.
    fn bars(&self, t: f64, hub: &NodeState, soil: &Soil) -> Option<Bars> {
        let p = &self.p;
        p.grousers.map(|g| Bars {
            grousers: g.on(p.radius),
            spoke: hub.rotation * Vec3::x(),
            face: [p.width, self.shear_radius()],
            soil: *soil,
            gamma: soil.density * p.gravity.acceleration(t, hub.position).norm(),
        })
    }
}

/// Wheel on deformable ground, with pressure, shear, rut and heaps of each node under its rim. It needs a `mobility.scm_ground`.
#[model("mobility.wheel_scm")]
impl Model for WheelScm {
    type Params = WheelScmParams;
    fn build(p: WheelScmParams) -> Result<Self, BuildError> {
        p.terrain.needs_soil()?;
        grousers::check(p.radius, &p.grousers)?;
        let soils = p.terrain.soils();
        soils.iter().try_for_each(|soil| presses_back(soil, p.width, "width"))?;
        Ok(WheelScm { p })
    }
    type FeedthroughInputs = WheelIn;
    type FeedthroughOutputs = ScmOut;
    type Store = View<Touched>;
    fn feedthrough(&self, clock: &Clock, u: &WheelIn, store: &View<Touched>) -> ScmOut {
        let (p, radius) = (&self.p, self.shear_radius());
        let form = Form::Rim { radius, width: p.width };
        let presser = Presser { form, hub: hub_of(&u.hub), along: Vec3::zeros() };
        let (hub, at) = (&presser.hub, presser.hub.position);
        let up = p.terrain.ground(at.x, at.y).map_or_else(Vec3::z, |g| g.normal);
        let slip = soft_slip(hub, radius, &up);
        let soil = p.terrain.soil(at.x, at.y);
        let bars = self.bars(clock.t, &u.hub, soil);
        let law = Law { bars, ..Law::of(soil, presser.narrow(), slip) };
        let damping = Damping { shear: p.shear_damping, normal: p.normal_damping };
        let load = match store.with::<ScmGround>() {
            Some((field, data)) => field.load(data, &presser, &law, &damping, clock.t),
            None => GroundLoad::none(at),
        };
        let (told, angle) = slip_of(hub, radius, &load.normal);
        ScmOut::of(&load, &Imprint::of(&presser, slip), [told, angle])
    }
    fn startup_warnings(
        &self,
        clock: &Clock,
        u: &WheelIn,
        store: &View<Touched>,
    ) -> Vec<BuildError> {
        let depth = self.feedthrough(clock, u, store).sinkage;
        let mut all = without_ground(store);
        all.extend(in_the_ground(depth, self.p.radius, STARTS_IN));
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wheel_rigid::tests::plane;

    #[test]
    fn without_deformable_ground_it_is_told() {
        let p = WheelScmParams {
            radius: 0.25,
            width: 0.4,
            grousers: None,
            shear_damping: 0.02,
            normal_damping: 4.0,
            terrain: plane(0.0),
            gravity: crate::wheel_rigid::tests::gravity(9.81),
        };
        let mut hub = NodeState::identity();
        hub.position.z = 0.24;
        let (clock, u) = (Clock::at(0.0, 1e-3, 0), WheelIn { hub });
        let told = WheelScm { p }.startup_warnings(&clock, &u, &View::default());
        assert!(told.len() == 1 && told[0].message.contains("mobility.scm_ground"), "{told:?}");
    }
}

//! `mobility.wheel_soil`: wheel on soft ground with the contact of `soil_contact`.
//!
//! The soil's constants come from the terrain under the hub. With a `mobility.ruts` field in the simulation, the wheel runs in the ruts of earlier
//! passes and leaves its own rut. Without it, every wheel runs on undisturbed ground.

use crate::grousers::{self, GrouserParams};
use crate::rigid_contact::Hub;
use crate::ruts::{Ruts, Tracks};
use crate::soil_contact::{SoilContact, SoilState};
use crate::terramechanics::{Rim, Shear, Sinkage, WheelSoil};
use crate::wheel_rigid::{WheelIn, hub_of, in_the_ground};
use linkwork_collision::relief::Wheel;
use linkwork_surroundings::prelude::*;

/// Shear law for the two directions in the contact plane.
#[derive(Params, Clone, Copy, Debug, PartialEq)]
pub enum ShearLaw {
    /// A common Mohr-Coulomb limit for the vector of shear stress.
    Isotropic,
    /// Independent limits for both axes (Ishigami), with the same shear modulus.
    Independent,
}

/// Wheel, ground and contact parameters.
#[derive(Params, Clone, Debug)]
pub struct WheelSoilParams {
    /// Radius of the rim.
    #[param(unit = "m", range = 1e-3..)]
    pub radius: f64,
    /// Width along the axle.
    #[param(unit = "m", range = 1e-3..)]
    pub width: f64,
    /// Grousers; a smooth wheel does not have any.
    pub grousers: Option<GrouserParams>,
    /// Shear law: isotropic, independent.
    #[param(default = ShearLaw::Isotropic)]
    pub shear: ShearLaw,
    /// Damping time of the shear deflection.
    #[param(unit = "s", default = 0.02, range = 0.0..)]
    pub shear_damping: f64,
    /// Ratio of the stiffness during unloading to that during loading, for shear and rolling resistance.
    #[param(default = 20.0, range = 1.0..=1000.0)]
    pub shear_unloading: f64,
    /// Normal damping: the load increases by this fraction per m/s of approach.
    #[param(unit = "s/m", default = 4.0, range = 0.0..)]
    pub normal_damping: f64,
    /// Stiffness of unloading and reloading, for depths less than the deepest one.
    #[param(unit = "N/m", default = 3e5, range = 0.0..)]
    pub unloading_stiffness: f64,
    /// Terrain of the ground.
    #[param(service)]
    pub terrain: Handle<dyn Terrain>,
    /// Gravity, for the weight of the bulldozed soil.
    #[param(service)]
    pub gravity: Handle<dyn Gravity>,
}

/// Contact load, slip, print, and rates of the soil's state.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SoilOut {
    /// Load of the ground on the wheel.
    #[port(bind = "hub")]
    pub load: Wrench,
    /// Sum of the normal forces.
    #[port("N")]
    pub normal_force: f64,
    /// Slip that the stress model uses, signed.
    #[port("1")]
    pub slip: f64,
    /// Slip angle that the stress model uses.
    #[port("rad")]
    pub slip_angle: f64,
    /// Sinkage below the undisturbed surface.
    #[port("m", bind = "field")]
    pub sinkage: f64,
    /// Depth of the rut under the wheel.
    #[port("m")]
    pub rut: f64,
    /// Point where the load acts, W.
    #[port("m", bind = "field")]
    pub contact_point: Vec3,
    /// Force of the ground, W.
    #[port("N")]
    pub contact_force: Vec3,
    /// Power dissipated in the soil.
    #[port("W")]
    pub power: f64,
    /// Ground normal, unit, W.
    #[port("1", bind = "field")]
    pub print_normal: Vec3,
    /// Heading of the wheel in the ground plane, unit, W.
    #[port("1", bind = "field")]
    pub print_heading: Vec3,
    /// Radius of the rim, for the print.
    #[port("m", bind = "field")]
    pub print_radius: f64,
    /// Width of the rim, for the print.
    #[port("m", bind = "field")]
    pub print_width: f64,
    /// Sinkage modulus of the print, N/m^(n+2).
    #[port("1", bind = "field")]
    pub print_modulus: f64,
    /// Sinkage exponent of the print.
    #[port("1", bind = "field")]
    pub print_exponent: f64,
    /// Rate of the shear deflection along the heading.
    #[port("m/s")]
    pub shear_x_rate: f64,
    /// Rate of the shear deflection along the axle.
    #[port("m/s")]
    pub shear_y_rate: f64,
    /// Rate of the greatest depth.
    #[port("m/s")]
    pub pressed_rate: f64,
    /// Rate of the footprint's shape.
    #[port("1/s")]
    pub rolled_rate: f64,
    /// Rate of the deflection by which the soil resists rolling.
    #[port("m/s")]
    pub rolling_rate: f64,
}

/// State of the soil under the wheel.
#[derive(State, Clone, Copy, Debug)]
pub struct SoilLanes {
    /// Shear deflection along the heading.
    #[port("m")]
    pub shear_x: f64,
    /// Shear deflection along the axle.
    #[port("m")]
    pub shear_y: f64,
    /// Greatest depth to which the soil under the wheel was pressed.
    #[port("m")]
    pub pressed: f64,
    /// Shape of the footprint: 0 after vertical loading, ±1 in rolling.
    #[port("1")]
    pub rolled: f64,
    /// Deflection by which the soil resists rolling.
    #[port("m")]
    pub rolling: f64,
}

impl SoilLanes {
    fn state(&self) -> SoilState {
        SoilState {
            xi_x: self.shear_x,
            xi_y: self.shear_y,
            pressed: self.pressed,
            rolled: self.rolled,
            rolling: self.rolling,
        }
    }
}

/// Wheel on soft soil.
pub struct WheelSoilModel {
    p: WheelSoilParams,
}

impl WheelSoilModel {
    pub(crate) fn params(&self) -> &WheelSoilParams {
        &self.p
    }

    /// Returns the contact model at a time (s) on a soil.
    /// `spoke` points from the axle to one of its grousers (unit, W).
    pub(crate) fn contact(&self, soil: &Soil, t: f64, hub: &Hub, spoke: Vec3) -> SoilContact {
        let p = &self.p;
        let radius = grousers::shear_radius(p.radius, &p.grousers);
        let k = [0.0, soil.shear_modulus];
        SoilContact {
            wheel: Wheel { radius, width: p.width },
            shear: match p.shear {
                ShearLaw::Isotropic => Shear::Isotropic,
                ShearLaw::Independent => Shear::Independent { k_x: k, k_y: k },
            },
            gravity: p.gravity.acceleration(t, hub.position).norm(),
            shear_damping: p.shear_damping,
            shear_unloading: p.shear_unloading,
            normal_damping: p.normal_damping,
            unloading_stiffness: p.unloading_stiffness,
            grousers: p.grousers.map(|g| (g.on(p.radius), spoke)),
        }
    }

    /// Returns the stress model of the rim on a soil.
    fn steady(&self, soil: &Soil) -> WheelSoil {
        WheelSoil {
            rim: Rim { radius: self.p.radius, width: self.p.width },
            soil: *soil,
            shear: Shear::Isotropic,
            sinkage: Sinkage::Bekker,
            gravity: 0.0,
            approach: None,
            grousers: None,
        }
    }

    /// Returns the soil under a hub.
    pub(crate) fn soil(&self, hub: &Hub) -> &Soil {
        self.p.terrain.soil(hub.position.x, hub.position.y)
    }
}

/// Wheel on soft soil: Bekker pressure with slip sinkage, Wong-Reece normal stress, Janosi shear, bulldozing,
/// as eight-node integrals over the contact arc. A wheel at rest does not creep.
#[model("mobility.wheel_soil")]
impl Model for WheelSoilModel {
    type Params = WheelSoilParams;
    type FeedthroughInputs = WheelIn;
    type FeedthroughOutputs = SoilOut;
    type State = SoilLanes;
    fn build(p: WheelSoilParams) -> Result<Self, BuildError> {
        p.terrain.needs_soil()?;
        grousers::check(p.radius, &p.grousers)?;
        let soils = p.terrain.soils();
        let model = WheelSoilModel { p };
        soils.iter().try_for_each(|soil| model.steady(soil).check())?;
        Ok(model)
    }
    type Store = View<Tracks>;
    fn feedthrough(
        &self,
        clock: &Clock,
        x: &SoilLanes,
        u: &WheelIn,
        store: &View<Tracks>,
    ) -> SoilOut {
        let hub = hub_of(&u.hub);
        let soil = self.soil(&hub);
        let ground = &*self.p.terrain;
        let contact = self.contact(soil, clock.t, &hub, u.hub.rotation * Vec3::x());
        let past = store.with::<Ruts>().map(|(store, tracks)| store.past(tracks));
        let (load, rate) = contact.evaluate(soil, &hub, &x.state(), ground, past);
        SoilOut {
            load: Wrench { moment: load.moment, force: load.force },
            normal_force: load.local.fz,
            slip: load.slip,
            slip_angle: load.slip_angle,
            sinkage: load.sinkage,
            rut: load.rut,
            contact_point: load.point,
            contact_force: load.force,
            power: load.power,
            print_normal: load.normal,
            print_heading: load.heading,
            print_radius: contact.wheel.radius,
            print_width: contact.wheel.width,
            print_modulus: load.press.0,
            print_exponent: load.press.1,
            shear_x_rate: rate.xi_x,
            shear_y_rate: rate.xi_y,
            pressed_rate: rate.pressed,
            rolled_rate: rate.rolled,
            rolling_rate: rate.rolling,
        }
    }
    fn derivatives(&self, y: &SoilOut) -> SoilLanes {
        SoilLanes {
            shear_x: y.shear_x_rate,
            shear_y: y.shear_y_rate,
            pressed: y.pressed_rate,
            rolled: y.rolled_rate,
            rolling: y.rolling_rate,
        }
    }
    fn startup_warnings(
        &self,
        clock: &Clock,
        x: &SoilLanes,
        u: &WheelIn,
        store: &View<Tracks>,
    ) -> Vec<BuildError> {
        let depth = self.feedthrough(clock, x, u, store).sinkage;
        in_the_ground(depth, self.p.radius, STARTS_IN)
    }
}

/// Depth relative to the radius above which a wheel at the start causes a warning. Soft ground supports a wheel at a sinkage of about a fifth of its
/// radius.
const STARTS_IN: f64 = 0.4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wheel_rigid::tests::plane;

    #[test]
    fn model_carries_the_load_of_the_stress_integral() {
        let model = WheelSoilModel {
            p: WheelSoilParams {
                radius: 0.15,
                width: 0.1,
                grousers: None,
                shear: ShearLaw::Isotropic,
                shear_damping: 0.02,
                shear_unloading: 20.0,
                normal_damping: 0.0,
                unloading_stiffness: 0.0,
                terrain: plane(0.0),
                gravity: crate::wheel_rigid::tests::gravity(9.81),
            },
        };
        // Use the case of the public code: r .15, b .10, z .02, s .3, with steady rolling and no damping of
        // the state.
        let mut hub = NodeState::identity();
        hub.position.z = 0.13;
        hub.angular.y = 1.0;
        hub.velocity.x = 0.15 * 0.7;
        let length = 0.15 * 0.5 * ((1.0 - 0.02 / 0.15f64).acos() + (1.0 - 0.01 / 0.15f64).acos());
        let slide = 0.15 * 0.3;
        let x = SoilLanes {
            shear_x: slide * (length / 0.15 - 0.02),
            shear_y: 0.0,
            pressed: 0.02,
            rolled: 1.0,
            rolling: length / 20.0,
        };
        let y = model.feedthrough(&Clock::at(0.0, 1e-3, 0), &x, &WheelIn { hub }, &View::default());
        assert!((y.normal_force - 99.967897801).abs() < 1e-8, "{y:?}");
        assert!((y.load.force.x - 29.435818268).abs() < 1e-8);
        assert!((y.load.moment.y + 6.353369400).abs() < 1e-8);
        let rate = model.derivatives(&y);
        assert!(rate.shear_x.abs() < 1e-12 && rate.rolled.abs() < 1e-12);
        assert!(rate.rolling.abs() < 1e-12);
    }
}

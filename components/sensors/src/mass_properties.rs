//! `sensors.mass_properties`: exact mass, centre of mass and inertia of a whole vehicle, for control software that knows them, for metrics and for
//! logs.
//! ```text
//! vehicle    all bodies that hang on the same body of the world as the node's body, with the mass that tanks and other parts add
//! ```
//! Bodies that are connected only by a loop are not part of the vehicle.

use linkwork_runtime::prelude::*;

/// The vehicle.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MassPropertiesIn {
    /// Node of the vehicle; the outputs are relative to it, in its axes.
    #[port(bind = "node")]
    pub vehicle: VehicleMass,
}

/// Its mass properties.
#[derive(Ports, Clone, Copy, Debug)]
pub struct MassPropertiesOut {
    /// Mass.
    #[port("kg")]
    pub mass: f64,
    /// Centre of mass relative to the node, axes of the node.
    #[port("m")]
    pub centre: Vec3,
    /// Moments of inertia xx, yy, zz about the centre of mass, axes of the node.
    #[port("kg m^2")]
    pub inertia: Vec3,
    /// Products of inertia xy, xz, yz about the centre of mass, with −∫ x y dm, axes of the node.
    #[port("kg m^2")]
    pub products: Vec3,
}

/// Mass properties of a vehicle.
pub struct MassProperties {}

/// Mass, centre of mass and inertia of a whole vehicle, exact and continuous.
#[model("sensors.mass_properties")]
impl Model for MassProperties {
    type FeedthroughInputs = MassPropertiesIn;
    type FeedthroughOutputs = MassPropertiesOut;
    fn feedthrough(&self, u: &MassPropertiesIn) -> MassPropertiesOut {
        let [xx, yy, zz, xy, xz, yz] = u.vehicle.inertia;
        MassPropertiesOut {
            mass: u.vehicle.mass,
            centre: u.vehicle.com,
            inertia: Vec3::new(xx, yy, zz),
            products: Vec3::new(xy, xz, yz),
        }
    }
}

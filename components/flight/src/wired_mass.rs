//! `flight.wired_mass`: mass, centre of mass and moments of inertia of a body from wires, for example from a table over the burnt propellant.
//! ```text
//! added to the body: m, m c, J + m (c² 1 − c cᵀ)          J about the centre of mass, in the node's axes
//! ```
//! The body itself has no mass in the file, or only the mass that the table does not include. Mass that leaves the body has the velocity of the body.

use linkwork_runtime::prelude::*;

/// Mass properties from wires.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WiredMassIn {
    /// Mass.
    #[port("kg")]
    pub mass: f64,
    /// Centre of mass from the node, x.
    #[port("m", default = 0.0)]
    pub x: f64,
    /// Centre of mass from the node, y.
    #[port("m", default = 0.0)]
    pub y: f64,
    /// Centre of mass from the node, z.
    #[port("m", default = 0.0)]
    pub z: f64,
    /// Moment of inertia about the centre of mass, axis x.
    #[port("kg m^2", default = 0.0)]
    pub inertia_x: f64,
    /// Moment of inertia about the centre of mass, axis y.
    #[port("kg m^2", default = 0.0)]
    pub inertia_y: f64,
    /// Moment of inertia about the centre of mass, axis z.
    #[port("kg m^2", default = 0.0)]
    pub inertia_z: f64,
}

/// Mass properties that are added to the body.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WiredMassOut {
    /// Mass about the node.
    #[port(bind = "body")]
    pub added: AddedMass,
}

/// Mass by wires.
pub struct WiredMass {}

/// Mass, centre of mass and moments of inertia of a body from wires.
#[model("flight.wired_mass")]
impl Model for WiredMass {
    type FeedthroughInputs = WiredMassIn;
    type FeedthroughOutputs = WiredMassOut;
    fn feedthrough(&self, u: &WiredMassIn) -> WiredMassOut {
        let com = Vec3::new(u.x, u.y, u.z);
        let central = Vec3::new(u.inertia_x, u.inertia_y, u.inertia_z);
        WiredMassOut { added: AddedMass::of(u.mass, &com, &central) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_moved_from_the_centre_of_mass_to_the_node() {
        let u = WiredMassIn {
            mass: 2.0,
            x: 0.0,
            y: 0.0,
            z: 3.0,
            inertia_x: 1.0,
            inertia_y: 1.5,
            inertia_z: 0.5,
        };
        let y = WiredMass {}.feedthrough(&u);
        assert_eq!(y.added.first_moment, Vec3::new(0.0, 0.0, 6.0));
        assert_eq!(y.added.inertia, [19.0, 19.5, 0.5, 0.0, 0.0, 0.0]);
    }
}

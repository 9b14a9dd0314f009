//! Values of composite ports: rest, zero load, mass of a body.
use crate::author::ports::{AddedMass, BodyMass, NodeState, Wrench};
use linkwork_spatial::{Mat3, Quat, Vec3};

impl NodeState {
    /// Returns the state at rest at the origin of W.
    pub fn identity() -> Self {
        NodeState {
            position: Vec3::zeros(),
            rotation: Quat::identity(),
            angular: Vec3::zeros(),
            velocity: Vec3::zeros(),
        }
    }
}

impl AddedMass {
    /// Returns zero.
    pub fn zero() -> Self {
        AddedMass { mass: 0.0, first_moment: Vec3::zeros(), inertia: [0.0; 6] }
    }

    /// Returns the mass properties of a body of `mass` kg with its centre at `com` (m, node axes) and principal moments `central` about it (kg m²,
    /// node axes).
    pub fn of(mass: f64, com: &Vec3, central: &Vec3) -> Self {
        let (c, m) = (com, mass);
        AddedMass {
            mass,
            first_moment: c * m,
            inertia: [
                central.x + m * (c.y * c.y + c.z * c.z),
                central.y + m * (c.x * c.x + c.z * c.z),
                central.z + m * (c.x * c.x + c.y * c.y),
                -m * c.x * c.y,
                -m * c.x * c.z,
                -m * c.y * c.z,
            ],
        }
    }
}

impl BodyMass {
    /// Returns the inertia matrix about the centre of mass, N axes (kg m²).
    pub fn inertia_matrix(&self) -> Mat3 {
        let [xx, yy, zz, xy, xz, yz] = self.inertia;
        Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}

impl Wrench {
    /// Returns zero.
    pub fn zero() -> Self {
        Wrench { moment: Vec3::zeros(), force: Vec3::zeros() }
    }
}

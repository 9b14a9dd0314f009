//! Mass, centre of mass and inertia of whole vehicles at an instant.
//!
//! ```text
//! vehicle of a node N    all bodies that hang on the same body of the world: its base, and what is outboard of it
//! sum                    of their inertias with what wires add to them, about N, axes of N
//! ```
//! Bodies that only a loop joins to them are not part of the vehicle.
use crate::block::MechanismBlock;
use crate::frame::Frame;
use linkwork_multibody::{BodyId, Multibody};
use linkwork_runtime::{Lane, VehicleMass};
use linkwork_spatial::RigidInertia;

/// Returns the root body, attached to the world, of the tree of a body.
fn base(mb: &Multibody, mut body: BodyId) -> BodyId {
    while let Some(parent) = mb.get(body).parent() {
        body = parent;
    }
    body
}

/// Bodies of the vehicle of each frame, in the order of the mechanism.
pub(crate) fn members(mb: &Multibody, frames: &[Frame]) -> Vec<Vec<BodyId>> {
    let of = |frame: &Frame| mb.subtree(base(mb, frame.body(mb))).collect();
    frames.iter().map(of).collect()
}

impl MechanismBlock {
    /// Writes the mass properties of vehicles, after kinematics.
    pub(crate) fn put_vehicles(&self, sig: &mut [f64]) {
        let ports = &self.plan.ports;
        if ports.vehicles.is_empty() {
            return;
        }
        let [.., accels] = self.output_lanes();
        let before = ports.accels.len() + ports.contacts.len() + ports.loads.len();
        let lanes = sig[accels + 6 * before..].chunks_exact_mut(VehicleMass::N);
        for ((frame, members), lanes) in ports.vehicles.iter().zip(&self.plan.vehicles).zip(lanes) {
            let own = match frame {
                Frame::Node(n) => self.ws.node_pose(&self.tree, *n),
                Frame::Body(b) => self.ws.body_pose(&self.tree, *b),
            };
            let back = own.inverse();
            let mut sum = RigidInertia::zero();
            for body in members {
                // Compute moments relative to the node first, because moments about a distant origin of
                // W would lose all digits.
                let there = back * self.ws.body_pose(&self.tree, *body);
                let inertia = self.tree.multibody().get(*body).inertia();
                sum += inertia.rotate(&there.rotation).shift_to_parent(&there.position);
            }
            let about = sum.inertia_com();
            VehicleMass {
                mass: sum.mass(),
                com: sum.com(),
                inertia: [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|at| about[at]),
            }
            .put(lanes);
        }
    }
}

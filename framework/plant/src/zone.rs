//! Zones of bodies: the sum of the normal forces of contacts that lie in a solid at a node, or whose line of action leaves the body through the solid.
//! ```text
//! f = Σ fₖ over the contacts of the node's body for which the ray from the contact point, along the normal away from the body, meets the solid
//! ```
//! The ray counts points that overlap of the surfaces has moved out of the solid, like `touch` of MuJoCo.
use crate::block::MechanismBlock;
use crate::frame::Frame;
use linkwork_collision::{Shape, Target};
use linkwork_multibody::{BodyId, Multibody};
use linkwork_runtime::{ContactZone, Lane, PortSpec, VehicleMass};
use linkwork_solvers::{ContactStepper, NormalLoad};
use linkwork_spatial::{Pose, Vec3};
use std::sync::Arc;

/// A solid at a node.
#[derive(Clone, Debug)]
pub struct Zone {
    /// Name of its port.
    pub(crate) name: String,
    frame: Frame,
    solid: Arc<Target>,
}

impl Zone {
    /// Returns the zone of a port at a frame, and the name of its port. `None`: the port has no zone, or its size is not positive.
    pub(crate) fn of(port: &PortSpec, frame: Frame) -> Option<(Self, String)> {
        let zone = port.zone?;
        let shape = match zone {
            ContactZone::Ellipsoid(half) => Shape::Ellipsoid { half: Vec3::from(half) },
            ContactZone::Box(half) => Shape::Box { half: Vec3::from(half) },
            ContactZone::Cylinder([radius, half_length]) => Shape::Cylinder { radius, half_length },
            ContactZone::Capsule([radius, half_length]) => Shape::Capsule { radius, half_length },
        };
        let solid = Arc::new(Target::new(&shape).ok()?);
        let at = match frame {
            Frame::Node(n) => format!("node:{}", n.index()),
            Frame::Body(b) => format!("body:{}", b.index()),
        };
        let name = format!("zone:{at}:{zone:?}");
        Some((Self { name: name.clone(), frame, solid }, name))
    }

    /// Returns the body of the zone.
    fn body(&self, mb: &Multibody) -> BodyId {
        self.frame.body(mb)
    }

    /// Returns whether the ray from a point along a unit vector, both in W, meets the solid at a pose.
    fn meets(&self, pose: &Pose, point: &Vec3, direction: &Vec3) -> bool {
        let back = pose.rotation.inverse();
        let (o, d) = (back * (point - pose.position), back * direction);
        self.solid.cast(&o, &d, f64::INFINITY).is_some()
    }
}

/// Computes the mean normal forces of a step of `h` s from impulses.
fn of_impulses(stepper: &ContactStepper, h: f64) -> impl Iterator<Item = NormalLoad> + Clone {
    let impulses = stepper.warm().iter().zip(stepper.impacts());
    stepper.points().iter().zip(impulses).map(move |(p, (steady, impact))| NormalLoad {
        body_a: p.body_a,
        body_b: p.body_b,
        point: p.point,
        normal: p.normal,
        force: ((steady.impulse + impact) / h).dot(&p.normal).max(0.0),
    })
}

impl MechanismBlock {
    /// Writes the normal forces in zones; `step`: after a step with contact its length.
    pub(crate) fn put_zones(&self, step: Option<f64>, sig: &mut [f64]) {
        let ports = &self.plan.ports;
        if ports.zones.is_empty() {
            return;
        }
        let [.., accels] = self.output_lanes();
        let sixes = ports.accels.len() + ports.contacts.len() + ports.loads.len();
        let first = accels + 6 * sixes + VehicleMass::N * ports.vehicles.len();
        let lanes = &mut sig[first..first + ports.zones.len()];
        match (&self.compliant, &self.stepper, step) {
            (Some(contact), ..) => self.sum_zones(contact.normals().iter().copied(), lanes),
            (_, Some(stepper), Some(h)) => self.sum_zones(of_impulses(stepper, h), lanes),
            _ => lanes.fill(0.0),
        }
    }

    fn sum_zones(&self, loads: impl Iterator<Item = NormalLoad> + Clone, lanes: &mut [f64]) {
        for (zone, lane) in self.plan.ports.zones.iter().zip(lanes) {
            let body = Some(zone.body(&self.plan.multibody));
            let pose = match zone.frame {
                Frame::Node(n) => self.ws.node_pose(&self.tree, n),
                Frame::Body(b) => self.ws.body_pose(&self.tree, b),
            };
            let within = |load: &NormalLoad| {
                let away = if load.body_a == body { load.normal } else { -load.normal };
                (load.body_a == body || load.body_b == body)
                    && load.force > 0.0
                    && zone.meets(&pose, &load.point, &away)
            };
            *lane = loads.clone().filter(within).map(|load| load.force).sum();
        }
    }
}

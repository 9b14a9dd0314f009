//! Variable masses during a run: a body's own inertia, and inertia that is added through wires.
use crate::frame::Frame;
use crate::ports::MechanismPorts;
use linkwork_multibody::{BodyId, Multibody};
use linkwork_runtime::BodyMass;
use linkwork_spatial::{Mat3, Pose, RigidInertia, Vec3};

impl Frame {
    /// Returns the specified mass of the body of a frame, relative to this frame.
    pub(crate) fn mass(self, mb: &Multibody) -> BodyMass {
        let (body, pose) = match self {
            Frame::Body(b) => (b, Pose::identity()),
            Frame::Node(n) => (mb.get_node(n).body(), mb.get_node(n).pose()),
        };
        let own = mb.get(body).inertia();
        if own.mass() <= 0.0 {
            return BodyMass { mass: 0.0, com: Vec3::zeros(), inertia: [0.0; 6] };
        }
        let back = pose.rotation.inverse();
        let central = own.rotate(&back).inertia_com();
        BodyMass {
            mass: own.mass(),
            com: back * (own.com() - pose.position),
            inertia: [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|at| central[at]),
        }
    }
}

/// A body with added mass.
#[derive(Clone, Debug)]
pub(crate) struct Varying {
    pub body: BodyId,
    /// Frames on it about which the moments are given, each with the first of its ten lanes among the feedthrough inputs of the mechanism.
    frames: Vec<(Pose, usize)>,
}

impl Varying {
    /// Returns them in the order of the bodies.
    pub fn all(mb: &Multibody, ports: &MechanismPorts) -> Vec<Varying> {
        let mut all: Vec<Varying> = Vec::new();
        for (i, frame) in ports.masses.iter().enumerate() {
            let (body, pose) = match *frame {
                Frame::Body(b) => (b, Pose::identity()),
                Frame::Node(n) => (mb.get_node(n).body(), mb.get_node(n).pose()),
            };
            match all.iter_mut().find(|v| v.body == body) {
                Some(v) => v.frames.push((pose, 10 * i)),
                None => all.push(Varying { body, frames: vec![(pose, 10 * i)] }),
            }
        }
        all.sort_by_key(|v| v.body.index());
        all
    }

    /// Returns the inertia of the body with added masses about its origin, body axes; `lane` reads an input.
    ///
    /// # Errors
    /// The inertia is physically impossible; returns fact and remedy.
    pub fn inertia(
        &self,
        mb: &Multibody,
        lane: impl Fn(usize) -> f64,
    ) -> Result<RigidInertia, (String, String)> {
        let mut sum = *mb.get(self.body).inertia();
        for (pose, first) in &self.frames {
            let at = |k: usize| lane(first + k);
            let h = Vec3::new(at(1), at(2), at(3));
            let [xx, yy, zz, xy, xz, yz] = std::array::from_fn(|k| at(4 + k));
            #[rustfmt::skip]
            let inertia = Mat3::new(xx, xy, xz,  xy, yy, yz,  xz, yz, zz);
            let added = RigidInertia::from_moments(at(0), h, inertia).map_err(|e| {
                let name = mb.get(self.body).name();
                (
                    format!("mass added to `{name}`: {e}"),
                    "check the parts whose bindings add it: their mass must not be negative, and their moments must be possible for a rigid body"
                        .to_string(),
                )
            })?;
            sum += added.rotate(&pose.rotation).shift_to_parent(&pose.position);
        }
        Ok(sum)
    }
}

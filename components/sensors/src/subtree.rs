//! `sensors.subtree`: exact mass, centre of mass, velocity and angular momentum of several bodies, such as an arm or all bodies of a robot.
//! ```text
//! c = Σ mᵢ cᵢ / m        v = Σ mᵢ vᵢ / m        h = Σ Iᵢ ωᵢ + mᵢ (cᵢ − c) × (vᵢ − v)        cᵢ, vᵢ: centre of mass of body i and its velocity, W
//! ```
//! Mass that wires add to the bodies is not included. `sensors.mass_properties` reads a whole vehicle with this mass.

use linkwork_runtime::Lane;
use linkwork_runtime::prelude::*;
use linkwork_spatial::Mat3;

/// Maximum number of bodies.
const MOST: u32 = 4096;

/// Lanes of one body: its motion and its mass.
const BODY: usize = <NodeState as Lane>::N + <BodyMass as Lane>::N;

/// The bodies.
#[derive(Params, Clone, Debug)]
pub struct SubtreeParams {
    /// Number of bodies; bind `body1`, `body2`, .. to them.
    #[param(default = 1, range = 1.0..=4096.0)]
    pub bodies: u32,
}

/// Motion of all bodies together.
#[derive(Ports, Clone, Copy, Debug)]
pub struct SubtreeOut {
    /// Sum of the masses.
    #[port("kg")]
    pub mass: f64,
    /// Centre of mass, W; the origin of the first body if no body has a mass.
    #[port("m")]
    pub centre: Vec3,
    /// Velocity of the centre of mass, W; 0 if no body has a mass.
    #[port("m/s")]
    pub velocity: Vec3,
    /// Angular momentum about the centre of mass, W.
    #[port("N m s")]
    pub angular_momentum: Vec3,
}

/// Momentum of several bodies.
pub struct Subtree {}

/// Returns motion and mass of each body.
fn bodies(u: &[f64]) -> impl Iterator<Item = (NodeState, BodyMass)> + '_ {
    let split = <NodeState as Lane>::N;
    u.chunks_exact(BODY).map(move |s| (NodeState::get(s), BodyMass::get(&s[split..])))
}

/// Mass, centre of mass, velocity and angular momentum of several bodies, exact and continuous.
#[model("sensors.subtree")]
impl SizedModel for Subtree {
    type Params = SubtreeParams;

    fn ports(p: &SubtreeParams) -> SizedPorts {
        let port = |k: u32, name: &str, kind: PortKind, lanes: usize, doc: &'static str| PortSpec {
            bind: Some(format!("body{k}").into()),
            ..PortSpec::named(format!("{name}{k}"), kind, lanes).doc_of(doc)
        };
        let inputs = (1..=p.bodies.min(MOST)).flat_map(|k| {
            let motion = PortKind::NodeState;
            [
                port(k, "body", motion, <NodeState as Lane>::N, "A body."),
                port(k, "own", PortKind::BodyMass, <BodyMass as Lane>::N, "Its mass."),
            ]
        });
        SizedPorts {
            feedthrough_inputs: inputs.collect(),
            feedthrough_outputs: SubtreeOut::specs().into_iter().collect(),
            ..SizedPorts::default()
        }
    }

    fn build(_: SubtreeParams) -> Result<Self, BuildError> {
        Ok(Subtree {})
    }

    fn feedthrough(&self, u: &[f64], y: &mut [f64]) {
        let Some((first, _)) = bodies(u).next() else { return };
        let place = |(n, own): &(NodeState, BodyMass)| {
            let arm = n.rotation * own.com;
            (n.position + arm, n.velocity + n.angular.cross(&arm))
        };
        // Sums are relative to the first body, because a distant origin of W would cost digits.
        let base = first.position;
        let (mut mass, mut centre, mut velocity) = (0.0, Vec3::zeros(), Vec3::zeros());
        for body in bodies(u) {
            let ((c, v), m) = (place(&body), body.1.mass);
            mass += m;
            centre += (c - base) * m;
            velocity += v * m;
        }
        if mass > 0.0 {
            centre /= mass;
            velocity /= mass;
        }
        let mut angular_momentum = Vec3::zeros();
        for body in bodies(u) {
            let ((c, v), (n, own)) = (place(&body), &body);
            let [xx, yy, zz, xy, xz, yz] = own.inertia;
            let inertia = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
            let spin = n.rotation * (inertia * (n.rotation.inverse() * n.angular));
            angular_momentum += spin + (c - base - centre).cross(&(v - velocity)) * own.mass;
        }
        SubtreeOut { mass, centre: base + centre, velocity, angular_momentum }.put(y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(all: &[(NodeState, BodyMass)]) -> SubtreeOut {
        let mut u = vec![0.0; BODY * all.len()];
        for ((n, own), s) in all.iter().zip(u.chunks_exact_mut(BODY)) {
            n.put(s);
            own.put(&mut s[<NodeState as Lane>::N..]);
        }
        let mut y = [f64::NAN; SubtreeOut::N];
        Subtree::build(SubtreeParams { bodies: all.len() as u32 }).unwrap().feedthrough(&u, &mut y);
        SubtreeOut::get(&y)
    }

    /// Two point masses, as two bodies and as one body with the same inertia that rotates like a rigid body.
    #[test]
    fn two_masses_on_a_rod_have_the_momentum_of_the_rod() {
        let rotation = Quat::from_scaled_axis(Vec3::new(0.4, -0.9, 0.3));
        let (angular, velocity) = (Vec3::new(0.7, 1.9, -0.4), Vec3::new(3.0, -1.0, 2.0));
        let rod = NodeState { position: Vec3::new(1e3, -2e3, 5e2), rotation, angular, velocity };
        let (a, b) = (Vec3::new(0.5, 0.0, 0.0), Vec3::new(-1.0, 0.0, 0.0));
        let (ma, mb) = (2.0, 1.0); // the centre of mass is the origin of the rod
        let point = |arm: Vec3, mass: f64| {
            // The body frame is 0.1 m away from the mass.
            let shift = Vec3::new(0.0, 0.1, 0.0);
            let at = rotation * (arm - shift);
            let node = NodeState {
                position: rod.position + at,
                velocity: velocity + angular.cross(&at),
                ..rod
            };
            (node, BodyMass { mass, com: shift, inertia: [0.0; 6] })
        };
        let two = read(&[point(a, ma), point(b, mb)]);
        let moment = ma * 0.25 + mb;
        let inertia = [0.0, moment, moment, 0.0, 0.0, 0.0];
        let one = read(&[(rod, BodyMass { mass: 3.0, com: Vec3::zeros(), inertia })]);
        for y in [two, one] {
            assert!((y.mass - 3.0).abs() < 1e-15 && (y.centre - rod.position).norm() < 1e-12);
            assert!((y.velocity - velocity).norm() < 1e-14);
            let moments = Vec3::new(0.0, moment, moment);
            let want = rotation * moments.component_mul(&(rotation.inverse() * angular));
            assert!((y.angular_momentum - want).norm() < 1e-12, "{}", y.angular_momentum);
        }
    }

    #[test]
    fn bodies_without_mass_have_the_place_of_the_first() {
        let n = NodeState { position: Vec3::new(1.0, 2.0, 3.0), ..NodeState::identity() };
        let y = read(&[(n, BodyMass { mass: 0.0, com: Vec3::zeros(), inertia: [0.0; 6] })]);
        assert_eq!(
            (y.centre, y.velocity, y.angular_momentum),
            (n.position, Vec3::zeros(), Vec3::zeros())
        );
    }
}

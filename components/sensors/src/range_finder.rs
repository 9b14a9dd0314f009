//! `sensors.range_finder`: the exact distance to the first surface along the z axis of a node, for programs that are tested without an instrument.
//! ```text
//! r = min { t ≥ 0 : p + t z is on a shape in `sees` or on the terrain },  −1 without a hit        p, z: origin and z axis of the mount, W
//! ```
//! Without `sees`, the sensor sees the shapes of all bodies, including the shapes on the body of its mount, unless `"!./body"` excludes them. The distance is 0
//! if the origin is inside a shape. `sensors.radar` and `sensors.lidar` have the errors of instruments.

use linkwork_render::{Look, Surroundings};
use linkwork_runtime::Lane;
use linkwork_surroundings::prelude::*;

/// The seen bodies.
#[derive(Params, Clone, Debug)]
pub struct RangeFinderParams {
    /// Greatest distance of a hit.
    #[param(unit = "m", default = 1e6, range = 1e-6..=1e6)]
    pub reach: f64,
    /// Patterns of the names of visible bodies; `!` before a pattern excludes bodies, `./` stands for the assembly of the sensor. Default: all bodies.
    #[param(service)]
    pub sees: Scenery,
    /// The ground (optional).
    #[param(service)]
    pub terrain: Option<Handle<dyn Terrain>>,
}

/// Reading.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RangeFinderOut {
    /// Distance to the first surface along the z axis of the mount; −1 without a hit.
    #[port("m")]
    pub distance: f64,
    /// Unit normal of the surface at the hit, against the ray, W; 0 without a hit.
    #[port("1")]
    pub normal: Vec3,
}

/// An exact range finder.
pub struct RangeFinder {
    reach: f64,
    around: Surroundings,
}

/// Distance to the first surface along the z axis of a node, exact and continuous.
#[model("sensors.range_finder")]
impl SizedModel for RangeFinder {
    type Params = RangeFinderParams;

    fn ports(p: &RangeFinderParams) -> SizedPorts {
        let mut mount = PortSpec::named("mount", PortKind::NodeState, <NodeState as Lane>::N)
            .doc_of("The node from which the ray begins, along its z axis.");
        mount.bind = Some("mount".into());
        SizedPorts {
            feedthrough_inputs: std::iter::once(mount).chain(p.sees.ports()).collect(),
            feedthrough_outputs: RangeFinderOut::specs().into_iter().collect(),
            ..SizedPorts::default()
        }
    }

    fn build(p: RangeFinderParams) -> Result<Self, BuildError> {
        let around = Surroundings::new(p.terrain.as_ref(), Look::plain([0.2; 3]), p.sees)?;
        Ok(Self { reach: p.reach, around })
    }

    fn feedthrough(&self, u: &[f64], y: &mut [f64]) {
        let mount = NodeState::get(u);
        let Some(scene) = self.around.now(&u[<NodeState as Lane>::N..]) else {
            // A non-finite pose gives NaN outputs, which stop the run with an error.
            y.fill(f64::NAN);
            return;
        };
        let hit = scene.cast(&mount.position, &(mount.rotation * Vec3::z()), self.reach);
        let none = RangeFinderOut { distance: -1.0, normal: Vec3::zeros() };
        hit.map_or(none, |h| RangeFinderOut { distance: h.distance, normal: h.normal }).put(y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_ground;

    fn read(p: RangeFinderParams, mount: &NodeState, others: &[NodeState]) -> RangeFinderOut {
        let m = RangeFinder::build(p).map_err(|e| e.message).unwrap();
        let n = <NodeState as Lane>::N;
        let mut u = vec![0.0; n * (1 + others.len())];
        for (state, lanes) in std::iter::once(mount).chain(others).zip(u.chunks_exact_mut(n)) {
            state.put(lanes);
        }
        let mut y = [f64::NAN; 4];
        m.feedthrough(&u, &mut y);
        RangeFinderOut::get(&y)
    }

    /// A ray that is tilted by 0.3 rad meets a plane with the slope −0.25 along x and a sphere above it at the distances of plane geometry.
    #[test]
    fn distances_are_those_of_geometry() {
        let down = Quat::from_scaled_axis(Vec3::y() * (std::f64::consts::PI - 0.3));
        let d = down * Vec3::z();
        let mount = NodeState {
            position: Vec3::new(4.0, -2.0, 60.0),
            rotation: down,
            ..NodeState::identity()
        };
        let terrain = Some(test_ground::slope(4000.0));
        let plain =
            |sees: Scenery, reach| RangeFinderParams { reach, sees, terrain: terrain.clone() };
        let found = read(plain(Scenery::default(), 1e6), &mount, &[]);
        let normal = Vec3::new(-0.25, 0.0, 1.0);
        let want = -normal.dot(&mount.position) / normal.dot(&d);
        assert!((found.distance - want).abs() < 1e-9, "{} {want}", found.distance);
        assert!((found.normal - normal.normalize()).norm() < 1e-6, "{}", found.normal);
        let short = read(plain(Scenery::default(), 0.5 * want), &mount, &[]);
        assert_eq!((short.distance, short.normal), (-1.0, Vec3::zeros()));
        let sphere = linkwork_render::collision::Shape::Sphere { radius: 3.0 };
        let sight = linkwork_surroundings::Sight {
            body: "rock".into(),
            name: "rock".into(),
            pose: linkwork_render::spatial::Pose::identity(),
            form: linkwork_render::collision::VisualShape::Shape(sphere),
            color: [1.0; 3],
        };
        let rock = NodeState {
            position: mount.position + d * 20.0 + Vec3::y() * 1.8,
            ..NodeState::identity()
        };
        let found = read(plain(Scenery::of(vec![sight]), 1e6), &mount, &[rock]);
        assert!((found.distance - (20.0 - 2.4)).abs() < 1e-12, "{}", found.distance);
    }
}

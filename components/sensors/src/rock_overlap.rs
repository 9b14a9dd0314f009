//! `sensors.rock_overlap`: rocks that a machine has driven over. This is a true value for the evaluation of navigation software, not an instrument.
//! ```text
//! rectangle    l × w about a mount, level, its width along the mount's y axis as seen from above
//! overlap      the nearest point of the rectangle is within D/2 of the rock's centre
//! highest      height of the highest rock that a rectangle has overlapped       touched: number of overlapped rocks that are higher than `clearance`
//! ```
//! The rocks are those that the terrain lists, as `environment.generated_terrain` does. Maps from files list no rocks; their rocks are part of the
//! ground. A wheel's axle is its y axis, so that its rectangle does not rotate with the wheel.

use linkwork_runtime::Lane;
use linkwork_surroundings::prelude::*;

/// Maximum number of mounts.
const MOUNTS_MAX: usize = 64;

/// Rectangles and their ground clearance.
#[derive(Params, Clone, Debug)]
pub struct RockOverlapParams {
    /// Length and width (m) of the rectangle about each mount: `mount1`, `mount2`, ….
    pub rectangles: Vec<[f64; 2]>,
    /// Ground clearance: higher rocks are counted.
    #[param(unit = "m", range = 0.0..)]
    pub clearance: f64,
    /// The ground.
    #[param(service)]
    pub terrain: Handle<dyn Terrain>,
}

/// Overlaps since the start.
#[derive(Ports, Clone, Copy, Debug)]
pub struct RockOverlapOut {
    /// Height of the highest rock; 0 before the first.
    #[port("m")]
    pub highest: f64,
    /// Number of overlapped rocks that are higher than the clearance.
    #[port("1")]
    pub touched: f64,
}

/// Rectangles over rocks.
pub struct RockOverlap {
    p: RockOverlapParams,
    rocks: Vec<Rock>,
}

/// A rectangle about a mount, from above.
struct Rectangle {
    middle: [f64; 2],
    /// Direction of its width; `None` for a vertical axle, for which a circle is used.
    across: Option<[f64; 2]>,
    size: [f64; 2],
}

impl Rectangle {
    fn about(mount: &NodeState, size: [f64; 2]) -> Self {
        let axle = mount.rotation * Vec3::y();
        let level = axle.x.hypot(axle.y);
        let across = (level >= 1e-9).then(|| [axle.x / level, axle.y / level]);
        Rectangle { middle: [mount.position.x, mount.position.y], across, size }
    }

    fn overlaps(&self, rock: &Rock) -> bool {
        let [length, width] = self.size;
        let (dx, dy) = (rock.x - self.middle[0], rock.y - self.middle[1]);
        let Some([lx, ly]) = self.across else {
            return dx.hypot(dy) <= 0.5 * (length.hypot(width) + rock.diameter);
        };
        let off = |d: f64, edge: f64| (d.abs() - 0.5 * edge).max(0.0);
        let (left, ahead) = (off(dx * lx + dy * ly, width), off(dx * ly - dy * lx, length));
        left.hypot(ahead) <= 0.5 * rock.diameter
    }
}

/// Highest rock that rectangles about nodes have passed over, and number of rocks above the clearance; a true value, not an instrument.
#[model("sensors.rock_overlap")]
impl SizedModel for RockOverlap {
    type Params = RockOverlapParams;
    /// Sorted indices of the overlapped rocks in the terrain's list.
    type Store = Vec<usize>;

    fn ports(p: &RockOverlapParams) -> SizedPorts {
        let mount = |k: usize| {
            let name = format!("mount{}", k + 1);
            let mut mount =
                PortSpec::named(name.clone(), PortKind::NodeState, <NodeState as Lane>::N)
                    .doc_of("Centre of a rectangle.");
            mount.bind = Some(name.into());
            mount
        };
        SizedPorts {
            inputs: (0..p.rectangles.len().min(MOUNTS_MAX)).map(mount).collect(),
            outputs: RockOverlapOut::specs(),
            sampled: true,
            ..SizedPorts::default()
        }
    }

    fn build(p: RockOverlapParams) -> Result<Self, BuildError> {
        let wrong = |fact: String, help: &str| {
            Err(BuildError::new(fact).help(help.to_string()).at("rectangles"))
        };
        if p.rectangles.is_empty() || p.rectangles.len() > MOUNTS_MAX {
            return wrong(
                format!("{} rectangles", p.rectangles.len()),
                "write 1 to 64, for example rectangles: [[2.8, 2.8]] with bind: { \"mount1\": \"node:…\" }",
            );
        }
        if let Some(r) = p.rectangles.iter().find(|r| !r.iter().all(|v| *v >= 0.0 && v.is_finite()))
        {
            return wrong(format!("{r:?} is not a rectangle"), "write [length, width] in metres");
        }
        let rocks = p.terrain.rocks();
        Ok(RockOverlap { p, rocks })
    }

    fn outputs(&self, store: &[usize], y: &mut [f64]) {
        let heights = || store.iter().filter_map(|k| self.rocks.get(*k)).map(|rock| rock.height);
        RockOverlapOut {
            highest: heights().fold(0.0, f64::max),
            touched: heights().filter(|h| *h > self.p.clearance).count() as f64,
        }
        .put(y);
    }

    fn update(&self, u: &[f64], store: &mut Vec<usize>) {
        let mounts = u.chunks_exact(<NodeState as Lane>::N).map(NodeState::get);
        for (mount, size) in mounts.zip(&self.p.rectangles) {
            let rectangle = Rectangle::about(&mount, *size);
            for (k, rock) in self.rocks.iter().enumerate() {
                if rectangle.overlaps(rock)
                    && let Err(place) = store.binary_search(&k)
                {
                    store.insert(place, k);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_ground::strewn;

    fn model(rectangles: &[[f64; 2]], rocks: &[[f64; 4]]) -> RockOverlap {
        let rock = |[x, y, diameter, height]: [f64; 4]| Rock { x, y, diameter, height };
        let terrain = strewn(rocks.iter().copied().map(rock).collect());
        let p = RockOverlapParams { rectangles: rectangles.to_vec(), clearance: 0.4, terrain };
        RockOverlap::build(p).unwrap()
    }

    fn told(model: &RockOverlap, mounts: &[[f64; 3]], store: &mut Vec<usize>) -> [f64; 2] {
        let mut u = vec![0.0; mounts.len() * <NodeState as Lane>::N];
        for (lanes, [x, y, turn]) in u.chunks_exact_mut(<NodeState as Lane>::N).zip(mounts) {
            let mut at = NodeState::identity();
            at.position = Vec3::new(*x, *y, 0.7);
            // The wheel is also rotated about its axle, which must not matter.
            at.rotation = Quat::from_axis_angle(&Vec3::z_axis(), *turn)
                * Quat::from_axis_angle(&Vec3::y_axis(), 1.1);
            at.put(lanes);
        }
        model.update(&u, store);
        let mut y = [0.0; 2];
        model.outputs(store, &mut y);
        y
    }

    #[test]
    fn edges_and_corners_of_a_rectangle_that_is_turned() {
        // The rectangle is 2 m × 1 m with a heading of 30°; rocks of 0.6 m are next to an edge, in
        // front of an end, and off a corner.
        let (s, c) = 30f64.to_radians().sin_cos();
        let place =
            |ahead: f64, left: f64| [5.0 + c * ahead - s * left, 3.0 + s * ahead + c * left];
        let corner = 0.3 / 2f64.sqrt();
        for (ahead, left) in
            [(0.4, 0.8), (-0.9, -0.8), (1.3, 0.2), (-1.3, 0.1), (1.0 + corner, 0.5 + corner)]
        {
            for (off, want) in [(0.998, [0.5, 1.0]), (1.002, [0.0, 0.0])] {
                let [x, y] = place(ahead * off, left * off);
                let m = model(&[[2.0, 1.0]], &[[x, y, 0.6, 0.5]]);
                let y = told(&m, &[[5.0, 3.0, 30f64.to_radians()]], &mut vec![]);
                assert_eq!(y, want, "{ahead} {left} {off}");
            }
        }
    }

    #[test]
    fn rocks_count_once_and_low_ones_only_for_the_highest() {
        let m = model(
            &[[1.0, 1.0], [0.5, 0.5]],
            &[[0.0, 0.0, 0.2, 0.3], [4.0, 0.0, 0.4, 0.41], [8.0, 0.0, 0.4, 0.9]],
        );
        let mut store = vec![];
        assert_eq!(told(&m, &[[0.0, 0.0, 0.0], [2.0, 5.0, 0.0]], &mut store), [0.3, 0.0]);
        for _ in 0..3 {
            assert_eq!(told(&m, &[[3.5, 0.0, 0.0], [4.2, 0.1, 2.0]], &mut store), [0.41, 1.0]);
        }
        assert_eq!(told(&m, &[[3.5, 0.0, 0.0], [8.2, 0.1, 2.0]], &mut store), [0.9, 2.0]);
        assert_eq!(store, [0, 1, 2]);
    }

    #[test]
    fn what_is_no_rectangle_is_refused() {
        let refused = |rectangles: Vec<[f64; 2]>| {
            let p = RockOverlapParams { rectangles, clearance: 0.4, terrain: strewn(vec![]) };
            RockOverlap::build(p).err().unwrap().message
        };
        assert!(refused(vec![]).contains("0 rectangles"));
        assert!(refused(vec![[1.0, f64::NAN]]).contains("is not a rectangle"));
        assert!(refused(vec![[1.0, -1.0]]).contains("is not a rectangle"));
    }
}

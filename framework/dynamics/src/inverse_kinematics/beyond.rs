//! Detects unreachable targets without a search: a node always stays within a region that follows from the lengths of the links.
//!
//! ```text
//! the region: within a sphere about c of radius ρ, and within a cylinder. From the node inward, for each hinge with any limits:
//! pin       sphere: about the foot of c on the pin's axis, radius |c⊥| + ρ, or about the point of the cylinder's axis that is nearest to it, whichever is smaller
//!           cylinder about the pin's axis: radius |c⊥| + ρ, heights c∥ ± ρ; for a parallel cylinder its own radius plus the distance of the axes
//! slider    extended by its travel
//! ball      the sphere about the hinge
//! free      unbounded
//! ```

use crate::tree::Tree;
use linkwork_multibody::{BodyId, Multibody, NodeId, SubhingeKind};
use linkwork_spatial::{Pose, Vec3};

/// Directions closer than this count as parallel.
const PARALLEL: f64 = 1e-12;

/// A cylinder about the line through `at` along `axis`, with heights relative to `at`.
#[derive(Clone, Copy, Debug)]
struct Cylinder {
    at: Vec3,
    axis: Vec3,
    radius: f64,
    low: f64,
    high: f64,
}

impl Cylinder {
    /// Returns a sphere around it, about the point of its axis that is nearest to the line through the origin along `b`, which is not parallel.
    fn ball(&self, b: &Vec3) -> (Vec3, f64) {
        let across = |v: &Vec3| v - b * b.dot(v);
        let (p, d) = (across(&self.at), across(&self.axis));
        let h = -p.dot(&d) / d.norm_squared();
        let farthest = (self.high - h).abs().max((h - self.low).abs());
        (self.at + self.axis * h, self.radius.hypot(farthest))
    }
}

/// Region of possible positions of a point, in one frame: the intersection of sphere and cylinder.
#[derive(Clone, Copy, Debug)]
struct Region {
    ball: (Vec3, f64),
    cylinder: Option<Cylinder>,
}

impl Region {
    /// Transforms the region to the frame in which the present frame has the pose X.
    fn seen_from(mut self, X: &Pose) -> Self {
        self.ball.0 = X.transform_point(&self.ball.0);
        if let Some(c) = &mut self.cylinder {
            (c.at, c.axis) = (X.transform_point(&c.at), X.rotation * c.axis);
        }
        self
    }

    /// Returns the region after a rotation by any angle about the line through the origin along `b`.
    fn turned(self, b: &Vec3) -> Self {
        let swept = |(c, radius): (Vec3, f64)| {
            let up = b.dot(&c);
            (b * up, radius + (c - b * up).norm())
        };
        let (own, radius) = self.ball;
        let up = b.dot(&own);
        let mut ball = swept(self.ball);
        let mut turned = Cylinder {
            at: Vec3::zeros(),
            axis: *b,
            radius: ball.1,
            low: up - radius,
            high: up + radius,
        };
        if let Some(c) = self.cylinder {
            if c.axis.cross(b).norm() < PARALLEL {
                let (up, sign) = (b.dot(&c.at), c.axis.dot(b).signum());
                let ends = [up + sign * c.low, up + sign * c.high];
                turned.radius = turned.radius.min(c.radius + (c.at - b * up).norm());
                turned.low = turned.low.max(ends[0].min(ends[1]));
                turned.high = turned.high.min(ends[0].max(ends[1]));
            } else {
                let other = swept(c.ball(b));
                if other.1 < ball.1 {
                    ball = other;
                }
                turned.radius = turned.radius.min(other.1);
            }
        }
        Self { ball, cylinder: Some(turned) }
    }

    /// Returns the region after a translation along `u` by any distance between two limits, m.
    fn shifted(self, u: &Vec3, (lower, upper): (f64, f64)) -> Self {
        let (lower, upper) = (lower.min(upper), lower.max(upper));
        let (c, radius) = self.ball;
        let ball = (c + u * (0.5 * (lower + upper)), radius + 0.5 * (upper - lower));
        let along = |c: &Cylinder| c.axis.cross(u).norm() < PARALLEL;
        let cylinder = self.cylinder.filter(along).map(|c| {
            let sign = c.axis.dot(u).signum();
            let (a, b) = (sign * lower, sign * upper);
            Cylinder { low: c.low + a.min(b), high: c.high + a.max(b), ..c }
        });
        Self { ball, cylinder }
    }

    /// Returns true if a point is outside by more than `margin`, m.
    fn lacks(&self, p: &Vec3, margin: f64) -> bool {
        let (centre, radius) = self.ball;
        let outside = |c: &Cylinder| {
            let r = p - c.at;
            let h = c.axis.dot(&r);
            let beside = (r - c.axis * h).norm() - c.radius;
            beside > margin || c.low - h > margin || h - c.high > margin
        };
        (p - centre).norm() > radius + margin || self.cylinder.as_ref().is_some_and(outside)
    }
}

/// Returns the region in the world in which a node is at all configurations; `None` where it is unbounded. `kept` returns the coordinate of a degree
/// of freedom that does not move.
fn region(
    mbs: &Multibody,
    node: NodeId,
    kept: impl Fn(usize, usize) -> Option<f64>,
) -> Option<Region> {
    let node = &mbs.nodes()[node.index()];
    let mut region = Region { ball: (node.pose().position, 0.0), cylinder: None };
    let mut next: Option<BodyId> = Some(node.body());
    while let Some(id) = next {
        let body = mbs.get(id);
        if body.modes().is_some() {
            return None;
        }
        region = region.seen_from(&body.hinge_in_body().inverse());
        for s in body.subhinges().iter().rev() {
            let l = s.subhinge.limits;
            // A coordinate that does not move may be outside its limits.
            let still = (s.v.len() == 1).then(|| kept(s.v.start, s.q.start)).flatten();
            let ends = still.map_or((l.lower, l.upper), |x| (x, x));
            let travel = |factor: f64| {
                let ends = (factor * ends.0, factor * ends.1);
                (ends.0.is_finite() && ends.1.is_finite()).then_some(ends)
            };
            region = match &s.subhinge.kind {
                SubhingeKind::Locked => region,
                SubhingeKind::Pin { axis } => region.turned(axis),
                SubhingeKind::Slider { axis } => region.shifted(axis, travel(1.0)?),
                SubhingeKind::Screw { axis, pitch } => {
                    region.turned(axis).shifted(axis, travel(*pitch)?)
                }
                SubhingeKind::Ball => {
                    let (c, radius) = region.ball;
                    Region { ball: (Vec3::zeros(), radius + c.norm()), cylinder: None }
                }
                SubhingeKind::Free => return None,
            };
        }
        region = region.seen_from(&body.hinge_in_parent());
        next = body.parent();
    }
    Some(region)
}

/// Returns true if the link lengths prove that a node is farther than `margin` (m) from a point of the world at every configuration within the limits
/// of sliders. False means undecided. `kept` as in [`region`], with indices in β and in q.
pub(super) fn beyond(
    tree: &Tree,
    node: NodeId,
    kept: impl Fn(usize, usize) -> Option<f64>,
    point: &Vec3,
    margin: f64,
) -> bool {
    // The margin covers nearly parallel axes that were treated as parallel, and round-off of lengths.
    let margin = margin + 1e-9 * (1.0 + point.norm());
    region(tree.multibody(), node, kept).is_some_and(|r| r.lacks(point, margin))
}

#[cfg(test)]
mod tests {
    use super::*;
    use linkwork_multibody::{BodySpec, Builder, Hinge, Limits};
    use linkwork_spatial::Quat;

    /// Random numbers from −1 to 1.
    struct Draw(u64);

    impl Draw {
        fn next(&mut self) -> f64 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
        }
        fn vector(&mut self) -> Vec3 {
            Vec3::from_fn(|_, _| self.next())
        }
        fn pose(&mut self) -> Pose {
            Pose::new(Quat::from_scaled_axis(self.vector() * 3.0), self.vector())
        }
    }

    fn chain(hinges: Vec<(Hinge, [Pose; 2])>, tip: Pose) -> Tree {
        let mut b = Builder::new();
        let mut parent = "world".to_owned();
        for (k, (hinge, [at, own])) in hinges.into_iter().enumerate() {
            let name = format!("link {k}");
            let body = BodySpec::new(&name, &parent).hinge(hinge);
            b.body(body.hinge_in_parent(at).hinge_in_body(own));
            parent = name;
        }
        b.node("tip", &parent, tip);
        Tree::new(&b.build().unwrap())
    }

    fn tip(tree: &Tree) -> NodeId {
        tree.multibody().node("tip").unwrap()
    }

    fn all_move(_: usize, _: usize) -> Option<f64> {
        None
    }

    /// The tip is never at a position that is reported as unreachable, for all kinds of hinges; and most unreachable positions are detected.
    #[test]
    fn no_place_that_is_reached_is_said_to_be_beyond() {
        let mut draw = Draw(7);
        let mut known = 0;
        for case in 0..300 {
            let limits = Limits::position(-0.4, 0.9);
            let hinges = (0..1 + case % 6).map(|_| {
                // Some axes are parallel, as in real arms.
                let axis = [Vec3::x(), -Vec3::x(), Vec3::z(), draw.vector()][case % 4];
                let kind = (draw.next() * 4.0).abs() as usize;
                let hinge = match kind {
                    0 => Hinge::slider(axis).limits(limits),
                    1 if case % 3 == 0 => Hinge::ball(),
                    1 if case % 3 == 1 => Hinge::universal(axis, Vec3::y()),
                    2 if case % 3 == 1 => Hinge::screw(axis, 0.2 * draw.next()).limits(limits),
                    _ => Hinge::pin(axis),
                };
                let poses = [draw.pose(), draw.pose()];
                let straight = |p: Pose| Pose::new(Quat::identity(), p.position);
                (hinge, if case % 2 == 0 { poses.map(straight) } else { poses })
            });
            let tree = chain(hinges.collect(), draw.pose());
            let node = tip(&tree);
            let mut ws = crate::Workspace::new(&tree);
            let mut longest = 0.0_f64;
            for seed in 0..40 {
                let q = tree.multibody().random_q_within_limits(seed);
                crate::poses(&tree, &mut ws, &q);
                let p = ws.node_pose(&tree, node).position;
                assert!(!beyond(&tree, node, all_move, &p, 0.0), "case {case}: {p:?}");
                longest = longest.max(p.norm());
            }
            // The first coordinate is kept at its value, which may be outside its limits.
            let first = tree.multibody().bodies()[0].v();
            let mut q = tree.multibody().random_q_within_limits(99);
            let own = tree.multibody().bodies()[0].q().start;
            if first.len() == 1 {
                q[own] += 3.0;
                crate::poses(&tree, &mut ws, &q);
                let p = ws.node_pose(&tree, node).position;
                let kept = |dof: usize, at: usize| (dof == first.start).then(|| q[at]);
                assert!(!beyond(&tree, node, kept, &p, 0.0), "case {case}, kept");
            }
            let direction = draw.vector().normalize();
            known += usize::from(beyond(
                &tree,
                node,
                all_move,
                &(direction * (2.0 * longest + 3.0)),
                0.0,
            ));
        }
        // Measured out of 300 cases.
        assert!(known > 240, "{known}");
    }

    /// In a plane and outside of it, the bound equals the geometric result.
    #[test]
    fn a_flat_arm_reaches_as_far_as_it_is_long() {
        let link = Pose::translation(0.5, 0.0, 0.1);
        let own = Pose::identity();
        let pins = [own, link, link].map(|at| (Hinge::pin(Vec3::z()), [at, own]));
        let tree = chain(pins.to_vec(), link);
        let node = tip(&tree);
        let at =
            |x: f64, z: f64| beyond(&tree, node, all_move, &Vec3::new(0.6 * x, -0.8 * x, z), 0.0);
        assert!(!at(1.4999, 0.3) && at(1.5001, 0.3));
        assert!(at(1.0, 0.2999) && at(1.0, 0.3001), "it stays in its plane");
        assert!(
            !beyond(&tree, node, all_move, &Vec3::new(1.51, 0.0, 0.3), 0.02),
            "within the margin"
        );
    }
}

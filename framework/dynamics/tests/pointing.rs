//! Inverse kinematics of parts of a pose: axes, cones, planes, lines, pointing at a point.

use linkwork_dynamics::inverse_kinematics::{Place, Pointing, Towards};
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, NodeId};
use linkwork_dynamics::spatial::{Pose, Quat, Vec3};
use linkwork_dynamics::*;

use crate::support::splitmix;

struct Rng(u64);

impl Rng {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((splitmix::splitmix(&mut self.0) >> 11) as f64 / (1u64 << 53) as f64)
    }
    fn vec3(&mut self, size: f64) -> Vec3 {
        Vec3::from_fn(|_, _| self.within(-size, size))
    }
    fn unit(&mut self) -> Vec3 {
        self.vec3(1.0).normalize()
    }
}

/// Six hinges without symmetry, a tip, and a frame on the second link.
fn arm() -> (Tree, NodeId, NodeId) {
    let (mut b, mut rng) = (Builder::new(), Rng(3));
    for k in 0..6 {
        let parent = if k == 0 { "world".to_owned() } else { format!("l{}", k - 1) };
        let at = Pose::new(Quat::from_scaled_axis(rng.vec3(0.3)), rng.vec3(0.1) + Vec3::z() * 0.25);
        let hinge =
            Hinge::pin(([Vec3::z(), Vec3::y(), Vec3::x()][k % 3] + rng.vec3(0.2)).normalize());
        b.body(BodySpec::new(format!("l{k}"), parent).hinge(hinge).hinge_in_parent(at));
    }
    b.node("tip", "l5", Pose::new(Quat::from_scaled_axis(rng.vec3(0.4)), rng.vec3(0.1)));
    b.node("side", "l1", Pose::new(Quat::from_scaled_axis(rng.vec3(0.4)), rng.vec3(0.1)));
    let mbs = b.build().unwrap();
    let (tip, side) = (mbs.node("tip").unwrap(), mbs.node("side").unwrap());
    (Tree::new(&mbs), tip, side)
}

fn pose_of(tree: &Tree, q: &[f64], node: NodeId) -> Pose {
    let mut ws = Workspace::new(tree);
    poses(tree, &mut ws, q);
    ws.node_pose(tree, node)
}

/// Returns the angle between the tip's axis and its required direction, and the position error, from geometry alone.
fn off(tree: &Tree, q: &[f64], t: &Target) -> (f64, f64) {
    let base = t.relative_to.map_or(Pose::identity(), |n| pose_of(tree, q, n));
    let X = base.inverse() * pose_of(tree, q, t.node);
    let turn = t.goal.pointing.map_or(0.0, |p| {
        let a = match p.to {
            Towards::Direction(a) => a,
            Towards::Point(x) => (x - X.position).normalize(),
        };
        let d = X.rotation * p.axis;
        (d.cross(&a).norm().atan2(d.dot(&a)) - p.within).max(0.0)
    });
    let d = t.goal.position.map_or(Vec3::zeros(), |p| p - X.position);
    let place = match t.goal.place {
        Place::Point => d.norm(),
        Place::Plane(n) => d.dot(&n).abs(),
        Place::Line(u) => (d - u * d.dot(&u)).norm(),
    };
    (turn, place)
}

#[test]
fn parts_of_a_pose_are_met_and_the_rest_is_free() {
    let (tree, tip, side) = arm();
    let mut ik = InverseKinematics::new(&tree);
    let mut count = [0usize; 7];
    let cases = 40;
    for seed in 0..cases {
        let mut rng = Rng(1000 + seed);
        // The goal is the pose of some configuration, so it is feasible.
        let there: Vec<f64> = (0..6).map(|_| rng.within(-2.0, 2.0)).collect();
        for (kind, count) in count.iter_mut().enumerate() {
            let base = if seed % 2 == 0 { None } else { Some(side) };
            let X_B = base.map_or(Pose::identity(), |n| pose_of(&tree, &there, n));
            let X = X_B.inverse() * pose_of(&tree, &there, tip);
            let axis = rng.unit();
            let d = X.rotation * axis;
            let target = match kind {
                0 => Target::new(tip, Goal::pointing(Pointing::along(axis, d))),
                1 => Target::new(
                    tip,
                    Goal::position(X.position).and_pointing(Pointing::along(axis, d)),
                ),
                2 => Target::new(
                    tip,
                    Goal::pointing(Pointing::at(axis, X.position + d * rng.within(0.3, 2.0))),
                ),
                3 => Target::new(
                    tip,
                    Goal::position(X.position)
                        .and_pointing(Pointing::at(axis, X.position + d * 0.7)),
                ),
                4 => Target::new(tip, Goal::pointing(Pointing::along(axis, d).within(0.3))),
                5 => Target::new(tip, Goal::position(X.position).place(Place::Plane(rng.unit()))),
                _ => Target::new(
                    tip,
                    Goal::position(X.position)
                        .place(Place::Line(rng.unit()))
                        .and_pointing(Pointing::at(axis, X.position + d).within(0.1)),
                ),
            };
            let target = base.map_or(target, |n| target.relative_to(n));
            let start: Vec<f64> = there.iter().map(|q| q + rng.within(-0.5, 0.5)).collect();
            let mut q = start.clone();
            let found =
                ik.solve(&tree, &[target], &mut q).unwrap_or_else(|e| panic!("{kind} {seed}: {e}"));
            let (turn, place) = off(&tree, &q, &target);
            // An angle that is computed from the sine between vectors has a precision of 1e-9.
            assert!(turn < 3e-9 && place < 1e-9, "{kind} {seed}: {turn:.1e} {place:.1e}");
            *count += found.kinematics;
            // The target has fewer components than a pose, and free components are not forced back.
            if kind != 1 && kind != 3 {
                let same = q.iter().zip(&there).all(|(a, b)| (a - b).abs() < 1e-4);
                assert!(!same, "{kind} {seed}");
            }
        }
    }
    let mean = count.map(|c| c as f64 / cases as f64);
    println!("kinematics a target: {mean:?}");
    // Steps converge quadratically; with a wrong Jacobian they take many more, or never converge.
    assert!(mean.iter().all(|m| *m < 16.0), "{mean:?}");
}

#[test]
fn within_its_cone_an_axis_may_stay() {
    let (tree, tip, _) = arm();
    let mut ik = InverseKinematics::new(&tree);
    let q0 = [0.3, -0.4, 0.5, 0.2, 0.7, -0.1];
    let X = pose_of(&tree, &q0, tip);
    let mut q = q0;
    let near = X.rotation * Quat::from_scaled_axis(Vec3::y() * 0.2) * Vec3::z();
    let target = Target::new(tip, Goal::pointing(Pointing::along(Vec3::z(), near).within(0.25)));
    ik.solve(&tree, &[target], &mut q).unwrap();
    assert_eq!(q, q0, "it is there already");
    // From a start outside the cone, the result is at the edge of the cone.
    let target = Target::new(tip, Goal::pointing(Pointing::along(Vec3::z(), near).within(0.1)));
    ik.solve(&tree, &[target], &mut q).unwrap();
    let angle = (pose_of(&tree, &q, tip).rotation * Vec3::z()).angle(&near);
    assert!((angle - 0.1).abs() < 1e-8, "{angle}");
    // The search also converges from the opposite direction.
    let mut q = q0;
    let away = Pointing::along(Vec3::z(), -(X.rotation * Vec3::z()));
    ik.solve(&tree, &[Target::new(tip, Goal::pointing(away))], &mut q).unwrap();
}

#[test]
fn what_points_nowhere_is_refused() {
    let (tree, tip, _) = arm();
    let mut ik = InverseKinematics::new(&tree);
    let mut q = [0.0; 6];
    let mut say = |t: Target| ik.solve(&tree, &[t], &mut q).unwrap_err().to_string();
    let z = Vec3::z();
    assert!(
        say(Target::new(tip, Goal::pointing(Pointing::along(z * 2.0, z)))).contains("length 1")
    );
    assert!(
        say(Target::new(tip, Goal::pointing(Pointing::along(z, z * 0.0)))).contains("length 1")
    );
    assert!(
        say(Target::new(tip, Goal::pointing(Pointing::along(z, z).within(-0.1)))).contains("cone")
    );
    assert!(
        say(Target::new(tip, Goal::pointing(Pointing::along(z, z).within(f64::NAN))))
            .contains("cone")
    );
    assert!(
        say(Target::new(tip, Goal::pointing(Pointing::at(z, z * f64::NAN)))).contains("points")
    );
    let both = Goal { pointing: Some(Pointing::along(z, z)), ..Goal::pose(Pose::identity()) };
    assert!(say(Target::new(tip, both)).contains("one of them"));
    assert!(
        say(Target::new(tip, Goal::position(z).place(Place::Plane(z * 3.0)))).contains("length 1")
    );
}

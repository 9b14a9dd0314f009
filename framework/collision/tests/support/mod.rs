//! Scenes of free bodies with one collider each, and random numbers.
#![allow(dead_code)]

#[path = "../../../../tests/common/splitmix.rs"]
mod splitmix;
use linkwork_collision::multibody::spatial::nalgebra::Quaternion;
use linkwork_collision::multibody::spatial::{Motion, Pose, Quat, Vec3};
use linkwork_collision::multibody::{BodyId, BodySpec, Builder, Hinge, Multibody};
use linkwork_collision::*;
use splitmix::splitmix;

/// SplitMix64.
pub struct Random(pub u64);

impl Random {
    /// In (−1, 1).
    pub fn signed(&mut self) -> f64 {
        (splitmix(&mut self.0) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    pub fn between(&mut self, lo: f64, hi: f64) -> f64 {
        lo + (hi - lo) * (self.signed() + 1.0) / 2.0
    }

    pub fn vec(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    pub fn unit(&mut self) -> Vec3 {
        loop {
            let v = self.vec();
            if (0.1..1.0).contains(&v.norm()) {
                return v.normalize();
            }
        }
    }

    pub fn rotation(&mut self) -> Quat {
        let (v, w) = (self.vec(), self.signed());
        Quat::from_quaternion(Quaternion::new(w, v.x, v.y, v.z + 2.0))
    }

    pub fn pose(&mut self, reach: f64) -> Pose {
        let p = self.vec() * reach;
        Pose::new(self.rotation(), p)
    }
}

/// Free bodies `a00`, `a01`, … with a collider of the same name each.
pub struct Scene {
    pub multibody: Multibody,
    pub colliders: Colliders,
    pub scratch: Scratch,
}

pub fn free_bodies(n: usize) -> Multibody {
    let mut builder = Builder::new();
    for i in 0..n {
        builder.body(BodySpec::new(format!("a{i:02}"), "world").hinge(Hinge::free()));
    }
    builder.build().unwrap()
}

pub fn scene(shapes: &[Shape]) -> Scene {
    let multibody = free_bodies(shapes.len());
    let named = |i| format!("a{i:02}");
    let specs = shapes
        .iter()
        .enumerate()
        .map(|(i, s)| ColliderSpec::new(named(i), named(i), s.clone()))
        .collect();
    scene_of(specs, multibody)
}

pub fn scene_of(specs: Vec<ColliderSpec>, multibody: Multibody) -> Scene {
    let colliders = Colliders::new(specs, Rules::default(), &multibody).unwrap();
    let scratch = Scratch::new(&colliders);
    Scene { multibody, colliders, scratch }
}

/// Poses by the order of bodies; the world is the identity.
pub fn at(poses: &[Pose]) -> impl Fn(Option<BodyId>) -> Pose + '_ {
    |b| b.map_or(Pose::identity(), |b| poses[b.index()])
}

impl Scene {
    pub fn contacts(&mut self, margin: f64, poses: &[Pose]) -> Vec<ContactPoint> {
        let mut out = Vec::new();
        self.colliders.contacts(&mut self.scratch, &Query::margin(margin), at(poses), &mut out);
        for c in &out {
            assert!((c.normal.norm() - 1.0).abs() < 1e-9, "unit normal: {c:?}");
            assert!(c.gap.is_finite() && c.point.iter().all(|x| x.is_finite()), "{c:?}");
        }
        for w in out.windows(2) {
            assert!(
                (w[0].a, w[0].b, w[0].feature) < (w[1].a, w[1].b, w[1].feature),
                "ordered, names unique: {w:#?}"
            );
        }
        out
    }

    pub fn distance(&mut self, poses: &[Pose]) -> Option<Distance> {
        let ids: Vec<ColliderId> = self.colliders.ids().collect();
        self.colliders.distance(&mut self.scratch, ids[0], ids[1], Detail::Fine, at(poses))
    }
}

/// The point with the smallest gap.
pub fn deepest(points: &[ContactPoint]) -> Option<&ContactPoint> {
    points.iter().min_by(|p, q| p.gap.total_cmp(&q.gap))
}

/// A pose moved for a time by a twist in world axes at its own origin.
pub fn moved(X: &Pose, V: &Motion, t: f64) -> Pose {
    Pose::new(Quat::from_scaled_axis(V.angular * t) * X.rotation, X.position + V.linear * t)
}

pub fn cube(h: f64) -> Shape {
    Shape::Box { half: Vec3::new(h, h, h) }
}

/// The surface of a box as a mesh.
pub fn box_mesh(half: Vec3) -> Shape {
    let vertices = (0..8)
        .map(|i| half.component_mul(&Vec3::new(sign(i), sign(i >> 1), sign(i >> 2))))
        .collect();
    let triangles = vec![
        [0, 4, 6],
        [0, 6, 2],
        [1, 3, 7],
        [1, 7, 5],
        [0, 1, 5],
        [0, 5, 4],
        [2, 6, 7],
        [2, 7, 3],
        [0, 2, 3],
        [0, 3, 1],
        [4, 5, 7],
        [4, 7, 6],
    ];
    Shape::Mesh { vertices, triangles }
}

fn sign(bit: u32) -> f64 {
    if bit & 1 == 1 { 1.0 } else { -1.0 }
}

/// One of each convex kind.
pub fn convex_shapes() -> Vec<Shape> {
    let mut r = Random(77);
    let points = (0..12).map(|_| r.unit().component_mul(&Vec3::new(0.5, 0.4, 0.6))).collect();
    vec![
        Shape::Sphere { radius: 0.4 },
        Shape::Box { half: Vec3::new(0.5, 0.3, 0.4) },
        Shape::Capsule { radius: 0.2, half_length: 0.35 },
        Shape::Cylinder { radius: 0.3, half_length: 0.45 },
        Shape::ConvexHull { points },
        Shape::Ellipsoid { half: Vec3::new(0.5, 0.35, 0.2) },
    ]
}

//! Scenes of bodies in contact for the benchmarks.

use crate::mechanisms;
use linkwork_collision::{ColliderSpec, Colliders, Material, Rules, Shape};
use linkwork_dynamics::multibody::{
    BodySpec, Builder, Coupling, Hinge, HingeCoordinate, Multibody,
};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Quat, Vec3};

/// A mechanism with shapes, initial state, applied forces and duration.
pub struct Scene {
    /// Name in the table.
    pub name: String,
    /// The mechanism.
    pub mbs: Multibody,
    /// The shapes of the bodies.
    pub shapes: Vec<ColliderSpec>,
    /// Shape of the ground.
    pub ground: ColliderSpec,
    /// Whether bodies collide with each other, or only with the ground.
    pub meet: Meet,
    /// q at the start.
    pub q: Vec<f64>,
    /// β at the start.
    pub v: Vec<f64>,
    /// Force on each coordinate.
    pub applied: Vec<f64>,
    /// Damping of each rate, N m s.
    pub damping: Vec<f64>,
    /// Rotor inertia of pins, kg m².
    pub armature: f64,
    /// Step, s.
    pub h: f64,
    /// Number of steps.
    pub steps: usize,
}

/// Pairs that can collide.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Meet {
    /// All.
    All,
    /// Only pairs with the ground.
    Ground,
}

/// Coefficient of friction of all colliders.
pub const FRICTION: f64 = 0.8;

impl Scene {
    /// Returns the colliders of the scene.
    pub fn colliders(&self) -> Colliders {
        let mut all: Vec<ColliderSpec> = self.shapes.clone();
        all.push(self.ground.clone());
        let ground = all.len() - 1;
        for (i, c) in all.iter_mut().enumerate() {
            c.material = Material { friction: FRICTION, restitution: 0.0 };
            c.groups = if i == ground { 2 } else { 1 };
            c.collides_with = if self.meet == Meet::All || i == ground { 3 } else { 2 };
        }
        Colliders::new(all, Rules::default(), &self.mbs).expect("colliders")
    }

    fn new(name: &str, mbs: Multibody, shapes: Vec<ColliderSpec>) -> Self {
        let (q, nv) = (mbs.neutral_q(), mbs.nv());
        let ground = ColliderSpec::new("ground", "world", Shape::HalfSpace);
        Self {
            name: name.into(),
            mbs,
            shapes,
            ground,
            meet: Meet::Ground,
            q,
            v: vec![0.0; nv],
            applied: vec![0.0; nv],
            damping: vec![0.0; nv],
            armature: 0.0,
            h: 2e-3,
            steps: 2500,
        }
    }
}

/// Returns every scene with its variants, because falling boxes are chaotic and so is the time of their steps.
pub fn all() -> Vec<Vec<Scene>> {
    vec![vec![humanoid()], (0..8).map(pile).collect(), vec![rover()]]
}

/// Returns a capsule along z of its body, from its origin downwards.
fn limb(body: &str, radius: f64, length: f64) -> ColliderSpec {
    let shape = Shape::Capsule { radius, half_length: 0.5 * length };
    ColliderSpec::new(body, body, shape).at(Pose::translation(0.0, 0.0, -0.5 * length))
}

fn ball(body: &str, radius: f64) -> ColliderSpec {
    ColliderSpec::new(body, body, Shape::Sphere { radius })
}

/// A humanoid with 37 degrees of freedom and damped joints, dropped on its feet: it falls over and comes to rest.
fn humanoid() -> Scene {
    let armature = 0.01;
    let mut b = Builder::from(&mechanisms::humanoid());
    for body in b.bodies_mut().iter_mut().filter(|b| b.hinge.nv() == 1) {
        body.hinge = body.hinge.clone().armature(armature);
    }
    let mut shapes = vec![ball("pelvis", 0.12), ball("chest", 0.13), ball("head", 0.1)];
    for side in ["_l", "_r"] {
        let n = |x: &str| format!("{x}{side}");
        shapes.push(limb(&n("thigh"), 0.06, 0.34));
        shapes.push(limb(&n("shank"), 0.05, 0.3));
        let sole = Shape::Box { half: Vec3::new(0.1, 0.05, 0.02) };
        shapes.push(ColliderSpec::new(n("foot"), n("foot"), sole));
        shapes.push(limb(&n("upper"), 0.04, 0.16));
        shapes.push(limb(&n("lower"), 0.035, 0.14));
        shapes.push(ball(&n("hand"), 0.04));
    }
    let mut s = Scene::new("humanoid on the ground", b.build().expect("humanoid"), shapes);
    s.q[2] = 1.0;
    s.armature = armature;
    s.damping[6..].fill(0.5);
    s
}

/// 20 boxes of three sizes that fall on a heap, with other orientations in each variant.
fn pile(variant: u32) -> Scene {
    let start = |i: u32, f: f64| {
        Vec3::new(0.12 * (2.1 * f).sin(), 0.12 * (2.1 * f).cos(), 0.15 + 0.14 * f64::from(i))
    };
    boxes("20 boxes in a pile", 20, 20 * variant, start)
}

/// Any number of the same boxes, from a block of layers that are three times as wide as the block is high.
pub fn heap(number: u32) -> Scene {
    let side = (f64::from(number) / 3.0).cbrt().mul_add(1.5, 0.5).round().max(1.0) as u32;
    let start = |i: u32, f: f64| {
        let (x, y, z) = (i % side, i / side % side, i / (side * side));
        let at = |k: u32| 0.27 * (f64::from(k) - 0.5 * f64::from(side - 1));
        let aside = Vec3::new((2.1 * f).sin(), (2.1 * f).cos(), 0.0) * 0.03;
        Vec3::new(at(x), at(y), 0.2 + 0.27 * f64::from(z)) + aside
    };
    let mut s = boxes(&format!("heap of {number} boxes"), number, 0, start);
    s.steps = if number > 300 { 500 } else { 1000 };
    s
}

fn boxes(name: &str, number: u32, from: u32, start: impl Fn(u32, f64) -> Vec3) -> Scene {
    let mut b = Builder::new();
    let (mut shapes, mut starts) = (Vec::new(), Vec::new());
    for i in 0..number {
        let f = f64::from(i + from);
        let half = Vec3::new(0.1, 0.08 + 0.02 * f64::from(i % 3), 0.06 + 0.02 * f64::from(i % 2));
        let m = 1000.0 * half.x * half.y * half.z;
        let (x, y, z) = (half.x * half.x, half.y * half.y, half.z * half.z);
        let J = Mat3::from_diagonal(&(Vec3::new(y + z, x + z, x + y) * (m / 3.0)));
        let name = format!("box{i:04}");
        b.body(BodySpec::new(&name, "world").hinge(Hinge::free()).mass(MassProperties::new(
            m,
            Vec3::zeros(),
            J,
        )));
        shapes.push(ColliderSpec::new(&name, &name, Shape::Box { half }));
        let turn = Quat::from_scaled_axis(Vec3::new(0.3 * f.sin(), 0.3 * f.cos(), f));
        starts.push((start(i, f), turn));
    }
    let mut s = Scene::new(name, b.build().expect("boxes"), shapes);
    s.meet = Meet::All;
    for (i, (p, r)) in starts.iter().enumerate() {
        s.q[7 * i..7 * i + 3].copy_from_slice(p.as_slice());
        s.q[7 * i + 3..7 * i + 7].copy_from_slice(r.coords.as_slice());
    }
    s
}

/// The rover with its differential, driven over waves of 10 cm.
fn rover() -> Scene {
    let mut b = Builder::from(&mechanisms::rover());
    let at = |body: &str| HingeCoordinate { body: body.into(), subhinge: 0 };
    b.coupling(Coupling::differential("differential", at("rocker_l"), at("rocker_r")));
    let mbs = b.build().expect("rover");
    let mut shapes = Vec::new();
    for wheel in mbs.bodies().iter().map(|b| b.name()).filter(|n| n.starts_with("wheel")) {
        let shape = Shape::Cylinder { radius: 0.1, half_length: 0.06 };
        let on_its_side = Quat::from_scaled_axis(Vec3::x() * std::f64::consts::FRAC_PI_2);
        let X = Pose::new(on_its_side, Vec3::zeros());
        shapes.push(ColliderSpec::new(wheel, wheel, shape).at(X));
    }
    let mut s = Scene::new("rover on a height field", mbs, shapes);
    let (n, d) = (81, 0.1);
    let height = |i: usize, j: usize| {
        let (x, y) = (d * i as f64 - 4.0, d * j as f64 - 4.0);
        0.1 * (1.0 + 0.5 * (2.0 * x).sin() + 0.5 * (1.7 * y + x).sin())
    };
    let heights = (0..n * n).map(|k| height(k % n, k / n)).collect();
    let field = Shape::HeightField { x: n, y: n, spacing: [d, d], heights };
    s.ground = ColliderSpec::new("ground", "world", field);
    s.q[0] = -1.0;
    s.q[2] = 0.65;
    for body in s.mbs.bodies() {
        let v = body.v();
        if v.len() == 1 {
            let wheel = body.name().starts_with("wheel");
            s.damping[v.start] = if wheel { 1.0 } else { 2.0 };
            s.applied[v.start] = if wheel { 2.0 } else { 0.0 };
        }
    }
    s
}

/// A falling chain whose links turn slowly relative to each other, without contact.
pub fn falling_chain(links: usize) -> Scene {
    let mut s = Scene::new(&format!("chain of {links} links"), chain(links), Vec::new());
    s.v[6..].iter_mut().enumerate().for_each(|(k, v)| *v = 0.2 * (k as f64).sin());
    s.steps = (200_000 / links).clamp(50, 5000);
    s
}

/// Links in a row on a free base, with pins about z.
pub fn chain(links: usize) -> Multibody {
    let mut b = Builder::new();
    let J = Mat3::from_diagonal(&Vec3::new(0.01, 0.02, 0.02));
    for i in 0..links {
        let parent = if i == 0 { "world".to_owned() } else { format!("link{:03}", i - 1) };
        let hinge = match i {
            0 => Hinge::free(),
            _ => Hinge::pin(Vec3::z()),
        };
        let x = if i == 0 { 0.0 } else { 0.3 };
        b.body(
            BodySpec::new(format!("link{i:03}"), parent)
                .hinge_in_parent(Pose::translation(x, 0.0, 0.0))
                .hinge(hinge)
                .mass(MassProperties::new(1.0, Vec3::new(0.15, 0.0, 0.0), J)),
        );
    }
    b.build().expect("chain")
}

//! Random mechanisms with closed loops, and consistent states of them with forces.
#![allow(dead_code)]

use crate::dynamics_support::{Rng, Shape, random_tree};
use linkwork_dynamics::multibody::{
    Builder, Coordinate, Coupling, Hinge, HingeCoordinate, LoopClosure, LoopMotion, Multibody,
    Subhinge, SubhingeKind, Term,
};
use linkwork_dynamics::spatial::{Force, Vec3};
use linkwork_dynamics::{Tree, Workspace, kinematics};
use linkwork_solvers::{ConstrainedSolver, ConstraintMethod, Projector};

pub fn closing_hinge(r: &mut Rng) -> Hinge {
    match r.below(8) {
        0 => Hinge::pin(r.vec3()),
        1 => Hinge::slider(r.vec3()),
        2 => Hinge::ball(),
        3 => Hinge::universal(r.vec3(), r.vec3()),
        4 => Hinge::cylindrical(r.vec3()),
        5 => Hinge::planar(),
        6 => Hinge::screw(r.vec3(), r.signed()),
        _ => Hinge::chain([SubhingeKind::Slider { axis: r.vec3() }, SubhingeKind::Ball]),
    }
}

/// A random tree with loops that close at the returned configuration.
pub fn looped(seed: u64, shape: Shape, loops: usize) -> (Multibody, Vec<f64>) {
    let tree = random_tree(seed, shape);
    let mut r = Rng(seed ^ 0x100b);
    let q = tree.random_q(seed);
    let poses = tree.body_poses(&q);
    let mut b = Builder::from(&tree);
    let name = |i: usize| tree.bodies()[i].name().to_owned();
    for k in 0..loops {
        let i = r.below(poses.len());
        let j = (i + 1 + r.below(poses.len() - 1)) % poses.len();
        let (frame_a, to_world) = (r.pose(), r.below(4) == 0);
        let place = poses[i] * frame_a;
        let (body_a, frame_a) = if to_world { ("world".into(), place) } else { (name(i), frame_a) };
        b.loop_closure(LoopClosure {
            name: format!("loop{k}"),
            body_a,
            frame_a,
            body_b: name(j),
            frame_b: poses[j].inverse() * place,
            hinge: closing_hinge(&mut r),
        });
    }
    let mut single: Vec<(HingeCoordinate, usize)> = Vec::new();
    for body in tree.bodies() {
        for (i, s) in body.subhinges().iter().enumerate() {
            if s.subhinge.kind.nv() == 1 {
                let at = HingeCoordinate { body: body.name().into(), subhinge: i };
                single.push((at, s.q.start));
            }
        }
    }
    if single.len() >= 2 {
        let i = r.below(single.len());
        let j = (i + 1 + r.below(single.len() - 1)) % single.len();
        let (a, c) = (r.signed(), r.signed());
        let term = |i: usize, factor| Term { coordinate: single[i].0.clone(), factor };
        let constant = a * q[single[i].1] + c * q[single[j].1];
        b.coupling(Coupling::linear("gear", vec![term(i, a), term(j, c)], constant));
    }
    (b.build().unwrap_or_else(|e| panic!("seed {seed}: {e}")), q)
}

pub const SHAPES: [Shape; 3] = [
    Shape { bodies: 9, floating: true, prescribed: false, armature: true },
    Shape { bodies: 11, floating: false, prescribed: false, armature: false },
    Shape { bodies: 12, floating: true, prescribed: true, armature: true },
];

pub struct Case {
    pub mbs: Multibody,
    pub tree: Tree,
    pub ws: Workspace,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub tau: Vec<f64>,
    pub vdot: Vec<f64>,
    /// Motions of prescribed subhinges of loops.
    pub motions: Vec<LoopMotion>,
}

/// A consistent state with forces.
pub fn case(seed: u64, shape: Shape, loops: usize) -> Case {
    let (mbs, q) = looped(seed, shape, loops);
    prepare(seed, mbs, q)
}

/// The case with prescribed subhinges in the loops, where their hinges allow it.
pub fn driven(seed: u64, shape: Shape, loops: usize) -> Case {
    let (mbs, q) = looped(seed, shape, loops);
    let mut b = Builder::from(&mbs);
    for l in b.loops_mut() {
        let single = |s: &&mut Subhinge| {
            matches!(s.kind, SubhingeKind::Pin { .. } | SubhingeKind::Slider { .. })
        };
        let turns = |s: &Subhinge| matches!(s.kind, SubhingeKind::Pin { .. });
        if l.hinge.subhinges.iter().filter(|s| turns(s)).count() < 2 {
            l.hinge
                .subhinges
                .iter_mut()
                .find(single)
                .into_iter()
                .for_each(|s| s.coordinate = Coordinate::Prescribed);
        }
    }
    prepare(seed, b.build().unwrap_or_else(|e| panic!("seed {seed}: {e}")), q)
}

fn prepare(seed: u64, mbs: Multibody, q: Vec<f64>) -> Case {
    let mut r = Rng(seed ^ 0xd12e);
    let motions: Vec<LoopMotion> = (0..mbs.motions())
        .map(|_| LoopMotion { position: 0.0, rate: r.signed(), acceleration: r.signed() })
        .collect();
    let tree = Tree::new(&mbs);
    let mut ws = Workspace::new(&tree);
    let mut v = mbs.random_v(seed);
    // Prescribed rates may contradict the loops, so set them to zero.
    for (v, p) in v.iter_mut().zip(mbs.prescribed()) {
        if p {
            *v = 0.0;
        }
    }
    let mut solver = ConstrainedSolver::new(&tree, |_| ConstraintMethod::Augment);
    Projector::new(&tree).rates(&tree, &mut ws, &mut solver, &motions, &q, &mut v).unwrap();
    let mut r = Rng(seed ^ 77);
    let tau = r.vec(mbs.nv());
    let vdot = vec![0.0; mbs.nv()];
    kinematics(&tree, &mut ws, &q, &v);
    ws.apply_uniform_gravity(Vec3::new(0.3, -0.7, -9.1));
    for n in mbs.node_ids() {
        ws.add_wrench_at_node(&tree, n, Force::new(r.vec3(), r.vec3()));
    }
    Case { mbs, tree, ws, q, v, tau, vdot, motions }
}

//! Mechanisms with closed loops for the benchmarks, each with closed states, and the file that Pinocchio's program reads
//! (`tests/benches/peers/pinocchio_constrained.cpp`).

use crate::{algorithms, mechanisms, support};
use linkwork_dynamics::multibody::{
    BodySpec, Builder, Hinge, Loop, LoopClosure, Multibody, NodeId,
};
use linkwork_dynamics::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::{Tree, Workspace};
use linkwork_solvers::{ConstrainedSolver, ConstraintMethod, Projector};
use std::fmt::Write as _;

/// Number of states that the calls cycle through.
pub const STATES: usize = 16;

/// A mechanism and a closed configuration of it.
pub struct Case {
    /// Name in the tables.
    pub name: String,
    /// The mechanism with its loops.
    pub mbs: Multibody,
    /// A closed configuration.
    pub start: Vec<f64>,
}

/// Position, rate and force of one state. Position and rate satisfy the loops.
pub struct State {
    /// q.
    pub q: Vec<f64>,
    /// β.
    pub v: Vec<f64>,
    /// T.
    pub tau: Vec<f64>,
}

impl Case {
    /// Returns closed states near the start.
    pub fn states(&self, tree: &Tree) -> Vec<State> {
        let mut ws = Workspace::new(tree);
        let mut solver = ConstrainedSolver::new(tree, |_| ConstraintMethod::Augment);
        let mut close = Projector::new(tree);
        let one = |i: u64| {
            // Take the state as far from the start as projection can still close it.
            let q = [0.2, 0.05, 0.01, 2e-3, 5e-4].into_iter().find_map(|scale| {
                let mut q = self.start.clone();
                let step: Vec<f64> = self.mbs.random_v(i).iter().map(|x| scale * x).collect();
                self.mbs.integrate(&self.start, &step, &mut q);
                let closed = close.positions(tree, &mut ws, &mut solver, &[], &mut q);
                closed.is_ok().then_some(q)
            });
            let q = q.unwrap_or_else(|| panic!("{} does not close", self.name));
            let mut v = self.mbs.random_v(i + 1000);
            close.rates(tree, &mut ws, &mut solver, &[], &q, &mut v).expect("closes");
            State { q, v, tau: self.mbs.random_v(i + 9999) }
        };
        (0..STATES as u64).map(one).collect()
    }

    /// Returns the text for Pinocchio's program; `answers` are the accelerations of the states.
    pub fn text(&self, states: &[State], answers: &[Vec<f64>]) -> String {
        let mut text: String = algorithms::joints(&self.mbs)
            .lines()
            .filter(|l| !l.starts_with("foot"))
            .flat_map(|l| [l, "\n"])
            .collect();
        for Loop { a, b, rows, .. } in self.mbs.loops() {
            write!(text, "loop {}", rows.len()).expect("text");
            for end in [a, b] {
                let joint = end.body.map_or(0, |b| b.index() + 1);
                write!(text, " {joint}").expect("text");
                let R = end.pose.rotation.to_rotation_matrix();
                put(&mut text, R.matrix().transpose().as_slice());
                put(&mut text, end.pose.position.as_slice());
            }
            text.push('\n');
        }
        for (s, a) in states.iter().zip(answers) {
            text += "state";
            put(&mut text, &s.q);
            for x in [&s.v, &s.tau, a] {
                put(&mut text, &linear_first(&self.mbs, x));
            }
            text.push('\n');
        }
        text
    }
}

fn put(text: &mut String, x: &[f64]) {
    x.iter().for_each(|x| write!(text, " {x:e}").expect("text"));
}

/// Returns rates with those of free hinges as [v; ω].
fn linear_first(mbs: &Multibody, x: &[f64]) -> Vec<f64> {
    let mut out = x.to_vec();
    for b in mbs.bodies().iter().filter(|b| b.v().len() == 6) {
        out[b.v()].rotate_left(3);
    }
    out
}

/// Returns all cases that are timed.
pub fn all() -> Vec<Case> {
    let mut all = Vec::new();
    if let Some(robot) = support::robot("solo12_ff") {
        all.push(held("quadruped, 4 point feet", robot.tree.multibody(), Hinge::ball, 1));
    }
    all.push(held("humanoid, 2 feet of 6 rows", &mechanisms::humanoid(), Hinge::locked, 2));
    if let Some(robot) = support::robot("iiwa7") {
        let arm = robot.tree.multibody();
        all.push(held("arm, hand pinned, 3 rows", arm, Hinge::ball, 3));
        all.push(held("arm, hand held, 6 rows", arm, Hinge::locked, 3));
    }
    for branches in [1, 2, 4] {
        for depth in [1, 2, 4] {
            all.push(four_bars(branches, depth));
        }
    }
    for depth in [5, 10, 20, 40] {
        for size in [2, 5, 10, 20, 40].into_iter().filter(|s| *s <= depth) {
            all.push(parallel_chains(depth, size));
        }
    }
    all
}

/// Returns a robot whose nodes are fixed at their poses in a random configuration.
fn held(name: &str, mbs: &Multibody, hinge: impl Fn() -> Hinge, seed: u64) -> Case {
    let start = mbs.random_q(seed);
    let poses = mbs.body_poses(&start);
    let mut b = Builder::from(mbs);
    let nodes: Vec<NodeId> = mbs.node_ids().collect();
    for (i, n) in nodes.iter().enumerate() {
        let node = &mbs.nodes()[n.index()];
        b.loop_closure(LoopClosure {
            name: format!("foot{i}"),
            body_a: "world".into(),
            frame_a: poses[node.body().index()] * node.pose(),
            body_b: mbs.bodies()[node.body().index()].name().into(),
            frame_b: node.pose(),
            hinge: hinge(),
        });
    }
    Case { name: name.into(), mbs: b.build().expect("held robot"), start }
}

/// Returns branches of four-bars in series on a free base of 5 kg, each attached to the coupler before it. Ground side and coupler have 1 m, cranks
/// 0.5 m. A ball connects the far crank's tip to the coupler: three rows, one of which repeats the constraint of the pins.
pub fn four_bars(branches: usize, depth: usize) -> Case {
    let mut b = Builder::new();
    let cube = Mat3::from_diagonal(&Vec3::new(0.02, 0.02, 0.02));
    let base = MassProperties::new(5.0, Vec3::zeros(), cube);
    b.body(BodySpec::new("base", "world").hinge(Hinge::free()).mass(base));
    let inertia = Mat3::from_diagonal(&Vec3::new(0.011253, 0.036203, 0.042673));
    let mut link = |name: &str, parent: &str, at: [f64; 3], half: f64| {
        b.body(
            BodySpec::new(name, parent)
                .hinge_in_parent(Pose::translation(at[0], at[1], at[2]))
                .hinge(Hinge::pin(Vec3::y()))
                .mass(MassProperties::new(3.3, Vec3::new(half, 0.0, 0.0), inertia)),
        );
    };
    let mut loops = Vec::new();
    for branch in 0..branches {
        let mut ground = "base".to_owned();
        for level in 0..depth {
            let name = |what: &str| format!("{what}_{branch}_{level}");
            let y = if level == 0 { 0.3 * branch as f64 } else { 0.0 };
            link(&name("crank"), &ground, [0.0, y, 0.0], 0.25);
            link(&name("coupler"), &name("crank"), [0.5, 0.0, 0.0], 0.5);
            link(&name("rocker"), &ground, [1.0, y, 0.0], 0.25);
            loops.push((name("loop"), name("rocker"), name("coupler")));
            ground = name("coupler");
        }
    }
    for (name, rocker, coupler) in loops {
        b.loop_closure(LoopClosure {
            name,
            body_a: coupler,
            frame_a: Pose::translation(1.0, 0.0, 0.0),
            body_b: rocker,
            frame_b: Pose::translation(0.5, 0.0, 0.0),
            hinge: Hinge::ball(),
        });
    }
    let mbs = b.build().expect("four-bars");
    let mut start = mbs.neutral_q();
    for body in mbs.bodies() {
        let angle = if body.name().starts_with("coupler") { 1.1 } else { -1.1 };
        if body.q().len() == 1 {
            start[body.q().start] = angle;
        }
    }
    Case { name: format!("four-bars {branches} × {depth}"), mbs, start }
}

/// Returns two parallel chains, connected at the tip of every loop of `size` links per side. Both continue from there on the last link of the first
/// chain, until `depth` links follow each other. Pins alternate between y and x, so that the three rows of a ball are independent.
pub fn parallel_chains(depth: usize, size: usize) -> Case {
    let mut b = Builder::new();
    let inertia = Mat3::from_diagonal(&Vec3::new(3.0, 2.0, 1.0));
    let name = |side: char, k: usize| format!("{side}{k:02}");
    for k in 0..depth {
        for side in ['a', 'b'] {
            let inner = if k % size == 0 { 'a' } else { side };
            let parent = if k == 0 { "world".to_owned() } else { name(inner, k - 1) };
            let x = if k == 0 { 0.0 } else { 1.0 };
            // The two chains are side by side on their common parent.
            let y = if side == 'b' && k % size == 0 { 0.7 } else { 0.0 };
            b.body(
                BodySpec::new(name(side, k), parent)
                    .hinge_in_parent(Pose::translation(x, y, 0.0))
                    .hinge(Hinge::pin(if k % 2 == 0 { Vec3::y() } else { Vec3::x() }))
                    .mass(MassProperties::new(2.0, Vec3::new(0.5, 0.0, 0.0), inertia)),
            );
        }
    }
    let open = b.build().expect("chains");
    let start: Vec<f64> = open.random_q(7).iter().map(|x| 0.3 * x).collect();
    let poses = open.body_poses(&start);
    let pose = |n: &str| poses[open.body(n).expect("body").index()];
    for k in (0..depth).filter(|k| k % size == size - 1) {
        let (a, c) = (name('a', k), name('b', k));
        let tip = Pose::translation(1.0, 0.0, 0.0);
        b.loop_closure(LoopClosure {
            name: format!("tie{k:02}"),
            frame_a: pose(&a).inverse() * pose(&c) * tip,
            body_a: a,
            frame_b: tip,
            body_b: c,
            hinge: Hinge::ball(),
        });
    }
    let mbs = b.build().expect("tied chains");
    Case { name: format!("chains {depth}, loops of {size}"), mbs, start }
}

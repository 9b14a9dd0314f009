//! Problems A01 … A05 of the IFToMM library of computational benchmark problems (rigid), and their independent solutions; `references` has results of
//! others.
//!
//! Data: the library's specifications (A02: 2N + 1 links of 1 m and 1 kg, ẋ of B0 1 m/s; A05: shaft and rods 1 × 0.01 × 0.01 m, slider 0.1 m cube,
//! 3000 kg/m³, point masses 5 kg, s = 0.5 m, α = 30°). A03 follows the test set for initial value problem solvers (problem Andrews; Hairer and
//! Wanner, *Solving Ordinary Differential Equations II*), and is compared with its solution at 0.03 s.
#![allow(dead_code)]

pub mod references;

use linkwork_dynamics::multibody::{
    BodySpec, Builder, Hinge, LoopClosure, Multibody, SubhingeKind,
};
use linkwork_dynamics::spatial::{Force, MassProperties, Mat3, Pose, Vec3};
use linkwork_dynamics::{Tree, Workspace, kinematics, kinetic_energy, potential_energy};
use linkwork_integrate::{Field, Integrator, Method};
use linkwork_solvers::{ConstrainedSolver, ConstraintMethod, FullyAugmentedSolver, Projector};

/// Adds forces in addition to gravity: wrenches to the workspace, forces to `tau`. Called after kinematics.
type Forces = fn(&Tree, &mut Workspace, &mut [f64]);

pub struct Problem {
    pub mbs: Multibody,
    pub q: Vec<f64>,
    pub v: Vec<f64>,
    pub gravity: Vec3,
    pub forces: Forces,
}

/// Method that computes accelerations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum With {
    Rows,
    Embedded,
    FullyAugmented,
}

enum Solver {
    Constrained(Box<ConstrainedSolver>),
    FullyAugmented(Box<FullyAugmentedSolver>),
}

/// A problem during integration: classical Runge–Kutta on (q, β), projected after each step.
pub struct Run {
    problem: Problem,
    pub tree: Tree,
    pub ws: Workspace,
    solver: Solver,
    closer: ConstrainedSolver,
    projector: Projector,
    rk: Integrator,
    tau: Vec<f64>,
    /// q, then β.
    pub x: Vec<f64>,
    pub t: f64,
    /// Largest number of rows left out at a step.
    pub lost: usize,
    pub contradiction: f64,
}

impl Run {
    pub fn new(problem: Problem, with: With) -> Self {
        let tree = Tree::new(&problem.mbs);
        let constraint_method = if with == With::Embedded {
            ConstraintMethod::Embed
        } else {
            ConstraintMethod::Augment
        };
        let closer = ConstrainedSolver::new(&tree, |_| constraint_method);
        let solver = match with {
            With::FullyAugmented => {
                Solver::FullyAugmented(Box::new(FullyAugmentedSolver::new(&tree).unwrap()))
            }
            _ => Solver::Constrained(Box::new(closer.clone())),
        };
        let mut x = problem.q.clone();
        x.extend(&problem.v);
        Self {
            ws: Workspace::new(&tree),
            projector: Projector::new(&tree),
            rk: rk4(x.len()),
            tau: vec![0.0; tree.nv()],
            closer,
            solver,
            tree,
            problem,
            x,
            t: 0.0,
            lost: 0,
            contradiction: 0.0,
        }
    }

    pub fn step(&mut self, h: f64) {
        let Self { problem, tree, ws, solver, tau, rk, x, t, lost, contradiction, .. } = self;
        let nq = tree.nq();
        let f = |_: f64, x: &[f64], out: &mut [f64]| {
            let (q, v) = x.split_at(nq);
            let (qdot, vdot) = out.split_at_mut(nq);
            kinematics(tree, ws, q, v);
            ws.clear_forces();
            ws.apply_uniform_gravity(problem.gravity);
            tau.fill(0.0);
            (problem.forces)(tree, ws, tau);
            let report = match solver {
                Solver::Constrained(s) => {
                    s.forward_given_kinematics(tree, ws, (q, v), &[], tau, vdot)
                }
                Solver::FullyAugmented(s) => {
                    s.forward_given_kinematics(tree, ws, (q, v), &[], tau, vdot)
                }
            }
            .unwrap();
            *lost = (*lost).max(report.rows - report.rank);
            *contradiction = contradiction.max(report.contradiction);
            tree.multibody().qdot(q, v, qdot);
        };
        rk.step_fixed(&mut Field(f), *t, h, x, None).unwrap();
        self.t += h;
        let (q, v) = self.x.split_at_mut(nq);
        let (ws, p) = (&mut self.ws, &mut self.projector);
        p.positions(&self.tree, ws, &mut self.closer, &[], q).unwrap();
        p.rates(&self.tree, ws, &mut self.closer, &[], q, v).unwrap();
    }

    pub fn to(&mut self, end: f64, h: f64) -> &mut Self {
        while self.t < end - 0.5 * h {
            self.step(h);
        }
        self
    }

    pub fn q(&self) -> &[f64] {
        &self.x[..self.tree.nq()]
    }

    pub fn v(&self) -> &[f64] {
        &self.x[self.tree.nq()..]
    }

    /// Returns kinetic plus potential energy, J.
    pub fn energy(&mut self) -> f64 {
        let nq = self.tree.nq();
        kinematics(&self.tree, &mut self.ws, &self.x[..nq], &self.x[nq..]);
        self.ws.clear_forces();
        self.ws.apply_uniform_gravity(self.problem.gravity);
        kinetic_energy(&self.tree, &self.ws, &self.x[nq..]) + potential_energy(&self.tree, &self.ws)
    }

    /// Returns the position of a node.
    pub fn place(&mut self, node: &str) -> Vec3 {
        let nq = self.tree.nq();
        kinematics(&self.tree, &mut self.ws, &self.x[..nq], &self.x[nq..]);
        let node = self.tree.multibody().node(node).unwrap();
        self.ws.node_pose(&self.tree, node).position
    }

    /// Returns position and velocity of A02's B0, [x, y, ẋ, ẏ].
    pub fn tip(&mut self) -> [f64; 4] {
        let p = self.place("B0");
        let node = self.tree.multibody().node("B0").unwrap();
        let v = self.ws.node_velocity(&self.tree, node).linear;
        [p.x, p.y, v.x, v.y]
    }

    /// Returns the position of the frame and the quaternion of every body, one after another.
    pub fn coordinates(&mut self) -> Vec<f64> {
        let nq = self.tree.nq();
        kinematics(&self.tree, &mut self.ws, &self.x[..nq], &self.x[nq..]);
        let mbs = self.tree.multibody();
        let mut all = Vec::new();
        for body in mbs.bodies() {
            let X = self.ws.body_pose(&self.tree, mbs.body(body.name()).unwrap());
            all.extend(X.position.iter().chain(X.rotation.coords.iter()));
        }
        all
    }

    /// Returns A05's height of the slider, angle of a rod from straight down, and rate of the shaft.
    pub fn governor(&self) -> [f64; 3] {
        let mbs = self.tree.multibody();
        let q = |name: &str| self.q()[mbs.get(mbs.body(name).unwrap()).q().start];
        [q("slider"), q("rod east"), self.v()[mbs.hinge("shaft").unwrap().start]]
    }
}

fn nothing(_: &Tree, _: &mut Workspace, _: &mut [f64]) {}

fn rod(mass: f64, com: Vec3, along: Vec3, length: f64, width: f64) -> MassProperties {
    // The body is a prism with a square cross-section.
    let (across, axial) =
        (mass * (length * length + width * width) / 12.0, mass * width * width / 6.0);
    let I = Mat3::from_diagonal(&along.map(|a| if a == 0.0 { across } else { axial }));
    MassProperties::new(mass, com, I)
}

/// A hinge that constrains only x and y of its frames.
fn in_plane() -> Hinge {
    Hinge::chain([SubhingeKind::Slider { axis: Vec3::z() }, SubhingeKind::Ball])
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose::translation(x, y, z)
}

/// A01 with constraints: a body that is free in the plane, whose pivot a pin constrains. It is dynamically equal to the point mass at 1 m: J + m c² =
/// m c · 1 m. Starts from the horizontal at rest.
pub fn a01() -> Problem {
    let mut b = Builder::new();
    let c = 0.8;
    let I = Mat3::identity() * (c * (1.0 - c));
    let mass = MassProperties::new(1.0, Vec3::new(c, 0.0, 0.0), I);
    b.body(BodySpec::new("rod", "world").hinge(Hinge::planar()).mass(mass));
    b.node("P", "rod", at(1.0, 0.0, 0.0));
    b.loop_closure(LoopClosure {
        name: "pivot".into(),
        body_a: "world".into(),
        frame_a: Pose::identity(),
        body_b: "rod".into(),
        frame_b: Pose::identity(),
        hinge: in_plane(),
    });
    let gravity = Vec3::new(0.0, -9.81, 0.0);
    Problem { mbs: b.build().unwrap(), q: vec![0.0; 3], v: vec![0.0; 3], gravity, forces: nothing }
}

/// Returns the angle from the downward vertical of a pendulum released at the horizontal, from Jacobi's elliptic functions: sin(θ/2) = k cd(ω t), k²
/// = ½.
pub fn pendulum_angle(t: f64) -> f64 {
    let k = 0.5_f64.sqrt();
    let (mut a, mut b, mut c) = (vec![1.0], (1.0 - k * k).sqrt(), vec![k]);
    while c[c.len() - 1] > 1e-16 {
        let last = a[a.len() - 1];
        c.push(0.5 * (last - b));
        (a, b) = ([&a[..], &[0.5 * (last + b)]].concat(), (last * b).sqrt());
    }
    let n = a.len() - 1;
    let quarter = std::f64::consts::FRAC_PI_2 / a[n];
    let mut phi = 2_f64.powi(n as i32) * a[n] * (9.81_f64.sqrt() * t + quarter);
    for i in (1..=n).rev() {
        phi = 0.5 * (phi + (c[i] / a[i] * phi.sin()).asin());
    }
    2.0 * (k * phi.sin()).asin()
}

/// A02 with N windows: uprights on the ground at 0 … N, couplers between them, all upright at the start, and B0 moves at 1 m/s along x.
pub fn a02(windows: usize) -> Problem {
    let mut b = Builder::new();
    // The link is slender: m l²/12 about z is the only relevant inertia.
    let link = MassProperties::new(1.0, Vec3::new(0.5, 0.0, 0.0), Mat3::identity() / 12.0);
    let mut hung = Vec::new();
    for i in 0..=windows {
        b.body(
            BodySpec::new(format!("up{i:02}"), "world")
                .hinge_in_parent(at(i as f64, 0.0, 0.0))
                .hinge(Hinge::pin(Vec3::z()))
                .mass(link),
        );
        if i == windows {
            break;
        }
        b.body(
            BodySpec::new(format!("over{i:02}"), format!("up{i:02}"))
                .hinge_in_parent(at(1.0, 0.0, 0.0))
                .hinge(Hinge::pin(Vec3::z()))
                .mass(link),
        );
        hung.push(i);
        b.loop_closure(LoopClosure {
            name: format!("window{i:02}"),
            body_a: format!("over{i:02}"),
            frame_a: at(1.0, 0.0, 0.0),
            body_b: format!("up{:02}", i + 1),
            frame_b: at(1.0, 0.0, 0.0),
            hinge: in_plane(),
        });
    }
    b.node("B0", "up00", at(1.0, 0.0, 0.0));
    let mbs = b.build().unwrap();
    let (mut q, mut v) = (vec![0.0; mbs.nq()], vec![0.0; mbs.nv()]);
    let upright = std::f64::consts::FRAC_PI_2;
    for body in mbs.bodies() {
        let (angle, rate) =
            if body.name().starts_with("up") { (upright, -1.0) } else { (-upright, 1.0) };
        (q[body.q().start], v[body.v().start]) = (angle, rate);
    }
    let gravity = Vec3::new(0.0, -9.81, 0.0);
    Problem { mbs, q, v, gravity, forces: nothing }
}

/// Returns the uprights' angle from x and its rate at `t`: those of one pendulum, since couplers only translate.
pub fn a02_angle(windows: usize, t: f64) -> [f64; 2] {
    let n = windows as f64;
    let (inertia, moment) = ((n + 1.0) / 3.0 + n, 9.81 * (0.5 * (n + 1.0) + n));
    let f = |_: f64, x: &[f64], d: &mut [f64]| {
        (d[0], d[1]) = (x[1], -moment / inertia * x[0].cos());
    };
    let mut x = [std::f64::consts::FRAC_PI_2, -1.0];
    integrate(&mut x, t, 1e-4, f);
    x
}

fn integrate(x: &mut [f64], t: f64, h: f64, f: impl Fn(f64, &[f64], &mut [f64])) {
    let n = (t / h).ceil() as usize;
    let (h, mut rk) = (t / n as f64, rk4(x.len()));
    for _ in 0..n {
        rk.step_fixed(&mut Field(&f), 0.0, h, x, None).unwrap();
    }
}

fn rk4(n: usize) -> Integrator {
    Integrator::new(Method::by_name("rk4").unwrap(), n)
}

/// A03: Andrews' squeezer. Coordinates by name of body: K1 β, K2 θ, K3 γ, K4 φ, K5 δ, K6 Ω, K7 ε.
pub fn a03() -> Problem {
    let mut b = Builder::new();
    let mut body = |name: &str, parent: &str, place: [f64; 2], m: f64, com: [f64; 2], i: f64| {
        b.body(
            BodySpec::new(name, parent)
                .hinge_in_parent(at(place[0], place[1], 0.0))
                .hinge(Hinge::pin(Vec3::z()))
                .mass(MassProperties::new(m, Vec3::new(com[0], com[1], 0.0), Mat3::identity() * i)),
        );
    };
    let (A, B) = ([-0.06934, -0.00227], [-0.03635, 0.03273]);
    body("K1", "world", [0.0, 0.0], 0.04325, [0.00092, 0.0], 2.194e-6);
    body("K2", "K1", [0.007, 0.0], 0.00365, [-0.0115, 0.0], 4.410e-7);
    body("K3", "world", B, 0.02373, [0.01043, -0.01874], 5.255e-6);
    body("K5", "world", A, 0.07050, [0.02308, 0.00916], 1.169e-5);
    body("K4", "K5", [0.04, 0.0], 0.00706, [0.0, 0.01421 - 0.02], 5.667e-7);
    body("K7", "world", A, 0.05498, [0.01228, -0.00449], 1.912e-5);
    body("K6", "K7", [0.0, -0.04], 0.00706, [0.02 - 0.01421, 0.0], 5.667e-7);
    for (other, frame) in
        [("K3", at(0.0, -0.035, 0.0)), ("K4", at(0.0, -0.02, 0.0)), ("K6", at(0.02, 0.0, 0.0))]
    {
        b.loop_closure(LoopClosure {
            name: format!("E on {other}"),
            body_a: "K2".into(),
            frame_a: at(-0.028, 0.0, 0.0),
            body_b: other.into(),
            frame_b: frame,
            hinge: in_plane(),
        });
    }
    b.node("D", "K3", at(0.02, -0.018, 0.0));
    let mbs = b.build().unwrap();
    let mut q = vec![0.0; 7];
    for (name, x) in ANDREWS.into_iter().zip(ANDREWS_START) {
        q[mbs.get(mbs.body(name).unwrap()).q().start] = x;
    }
    let forces: Forces = |tree, ws, tau| {
        let mbs = tree.multibody();
        let (Some(k1), Some(d)) = (mbs.hinge("K1"), mbs.node("D")) else { panic!("not A03") };
        tau[k1.start] = 0.033;
        let arm = ws.node_pose(tree, d).position - Vec3::new(0.014, 0.072, 0.0);
        let f = arm * (-4530.0 * (1.0 - 0.07785 / arm.norm()));
        ws.add_wrench_at_node(tree, d, Force::new(Vec3::zeros(), f));
    };
    Problem { mbs, q, v: vec![0.0; 7], gravity: Vec3::zeros(), forces }
}

/// Bodies in the order β θ γ φ δ Ω ε of the published values.
pub const ANDREWS: [&str; 7] = ["K1", "K2", "K3", "K4", "K5", "K6", "K7"];
const ANDREWS_START: [f64; 7] = [
    -0.061_713_890_014_276_45,
    0.0,
    0.455_279_819_163_070_4,
    0.222_668_390_165_885_9,
    0.487_364_979_543_842_55,
    -0.222_668_390_165_885_9,
    1.230_547_444_549_821_2,
];
/// Published values at t = 0.03 s.
pub const ANDREWS_END: [f64; 7] = [
    15.810_771_196_299_04,
    -15.756_371_059_842_98,
    0.040_822_240_130_731_01,
    -0.534_730_116_322_694_8,
    0.524_409_965_880_530_4,
    0.534_730_116_322_694_8,
    1.048_080_741_042_263,
];

/// A04: Bricard's mechanism: five rods of 1 m and 1 kg, 0.1 m square, and six pins along y z x y z x at the corners of a cube. Starts at rest. P3 is
/// the joint of the third and fourth rod.
pub fn a04() -> Problem {
    let mut b = Builder::new();
    let (x, y, z) = (Vec3::x(), Vec3::y(), Vec3::z());
    let rods = [(x, y), (-y, z), (z, x), (-x, y), (y, z)];
    let mut before = Vec3::zeros();
    for (i, (along, axis)) in rods.into_iter().enumerate() {
        let parent = if i == 0 { "world".to_owned() } else { format!("rod{i}") };
        b.body(
            BodySpec::new(format!("rod{}", i + 1), parent)
                .hinge_in_parent(Pose::translation(before.x, before.y, before.z))
                .hinge(Hinge::pin(axis))
                .mass(rod(1.0, along * 0.5, along, 1.0, 0.1)),
        );
        before = along;
    }
    b.node("P3", "rod3", at(0.0, 0.0, 1.0));
    b.loop_closure(LoopClosure {
        name: "last pin".into(),
        body_a: "world".into(),
        frame_a: at(0.0, 0.0, 1.0),
        body_b: "rod5".into(),
        frame_b: at(0.0, 1.0, 0.0),
        hinge: Hinge::pin(x),
    });
    let mbs = b.build().unwrap();
    let gravity = Vec3::new(0.0, -9.81, 0.0);
    Problem { q: vec![0.0; 5], v: vec![0.0; 5], mbs, gravity, forces: nothing }
}

/// A05: flyball governor. Shaft about z at 2π rad/s, slider at s = 0.5 m, rods at 30° below the
/// horizontal, 5 kg at their tips, springs with dampers from the slider to the rods' middles.
pub fn a05() -> Problem {
    let mut b = Builder::new();
    let (z, up) = (Vec3::z(), Vec3::new(0.0, 0.0, 0.5));
    b.body(BodySpec::new("shaft", "world").hinge(Hinge::pin(z)).mass(rod(0.3, up, z, 1.0, 0.01)));
    let cube = MassProperties::new(3.0, Vec3::zeros(), Mat3::identity() * 0.005);
    b.body(BodySpec::new("slider", "shaft").hinge(Hinge::slider(z)).mass(cube));
    for (name, side) in [("east", 1.0), ("west", -1.0)] {
        // Turn the hinge frame of the west rod by 180°, so that both rods hang straight down at angle 0 and swing outward with increasing angle.
        let out = Pose::new(
            linkwork_dynamics::spatial::Quat::from_axis_angle(
                &Vec3::z_axis(),
                if side > 0.0 { 0.0 } else { std::f64::consts::PI },
            ),
            Vec3::new(0.05 * side, 0.0, 1.0),
        );
        let r = format!("rod {name}");
        b.body(
            BodySpec::new(r.as_str(), "shaft")
                .hinge_in_parent(out)
                .hinge(Hinge::pin(-Vec3::y()))
                .mass(rod(0.3, Vec3::new(0.0, 0.0, -0.5), z, 1.0, 0.01)),
        );
        let ball = MassProperties::new(5.0, Vec3::zeros(), Mat3::zeros());
        b.body(
            BodySpec::new(format!("ball {name}"), r.as_str())
                .hinge_in_parent(at(0.0, 0.0, -1.0))
                .mass(ball),
        );
        b.node(format!("middle {name}"), r, at(0.0, 0.0, -0.5));
        b.node(format!("foot {name}"), "slider", at(0.05 * side, 0.0, 0.0));
    }
    let mbs = b.build().unwrap();
    let (mut q, mut v) = (vec![0.0; 4], vec![0.0; 4]);
    for (name, x) in [("slider", 0.5), ("rod east", THIRD), ("rod west", THIRD)] {
        q[mbs.get(mbs.body(name).unwrap()).q().start] = x;
    }
    v[mbs.hinge("shaft").unwrap().start] = std::f64::consts::TAU;
    let forces: Forces = |tree, ws, _| {
        let mbs = tree.multibody();
        for (a, b) in [("middle east", "foot east"), ("middle west", "foot west")] {
            let (Some(a), Some(b)) = (mbs.node(a), mbs.node(b)) else { panic!("not A05") };
            let arm = ws.node_pose(tree, a).position - ws.node_pose(tree, b).position;
            let rate = ws.node_velocity(tree, a).linear - ws.node_velocity(tree, b).linear;
            let (l, n) = (arm.norm(), arm.normalize());
            let f = n * (8e5 * (l - 0.5) + 4e4 * n.dot(&rate));
            ws.add_wrench_at_node(tree, a, Force::new(Vec3::zeros(), -f));
            ws.add_wrench_at_node(tree, b, Force::new(Vec3::zeros(), f));
        }
    };
    Problem { mbs, q, v, gravity: Vec3::new(0.0, 0.0, -9.81), forces }
}

const THIRD: f64 = std::f64::consts::FRAC_PI_3;

/// A05 by Lagrange's equations in (ψ, a, s): both rods at one angle a from straight down. Returns
/// [s, a, ψ̇] at `t`.
pub fn a05_symmetric(t: f64, h: f64) -> [f64; 3] {
    let (w, m, ball, slider) = (0.01_f64, 0.3, 5.0, 3.0);
    // `across` and `slim` are the moments of inertia of rod and ball about the pin and of the rod
    // about its own axis, `first` is their first moment about the pin, and `fixed` is the constant
    // part of the inertia about the shaft.
    let across = m * (1.0 + w * w) / 12.0 + m * 0.25 + ball;
    let (slim, first) = (m * w * w / 6.0, m * 0.5 + ball);
    let fixed = m * w * w / 6.0 + slider * 0.01 / 6.0;
    let f = move |_: f64, x: &[f64], d: &mut [f64]| {
        let (a, s, psi1, a1, s1) = (x[0], x[1], x[2], x[3], x[4]);
        let (sin, cos) = a.sin_cos();
        // This is the inertia about the shaft, and its derivative with respect to a.
        let J = fixed
            + 2.0
                * (across * sin * sin + slim * cos * cos + 0.1 * first * sin + 0.0025 * (m + ball));
        let dJ = 2.0 * (2.0 * (across - slim) * sin * cos + 0.1 * first * cos);
        // The spring extends from (0.05, s) to the rod's middle.
        let arm = [0.5 * sin, 1.0 - 0.5 * cos - s];
        let l = arm[0].hypot(arm[1]);
        let (la, ls) = ((arm[0] * 0.5 * cos + arm[1] * 0.5 * sin) / l, -arm[1] / l);
        let force = 8e5 * (l - 0.5) + 4e4 * (la * a1 + ls * s1);
        (d[0], d[1]) = (a1, s1);
        d[2] = -dJ * a1 * psi1 / J;
        d[3] = (0.25 * dJ * psi1 * psi1 - first * 9.81 * sin - force * la) / across;
        d[4] = -9.81 - 2.0 * force * ls / slider;
    };
    let mut x = [THIRD, 0.5, std::f64::consts::TAU, 0.0, 0.0];
    integrate(&mut x, t, h, f);
    [x[1], x[0], x[2]]
}

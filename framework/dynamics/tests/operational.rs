//! M⁻¹, Jacobians, compliance and centroidal quantities: identities on random trees with every kind
//! of hinge and prescribed subsets, gradients, far from the origin, subgraphs.

use crate::support::{Rng, Shape, close, random_tree};
use linkwork_dynamics::multibody::Multibody;
use linkwork_dynamics::spatial::nalgebra::DMatrix;
use linkwork_dynamics::spatial::{Force, Motion, Pose, Vec3};
use linkwork_dynamics::*;

fn shapes() -> impl Iterator<Item = (u64, Multibody)> {
    (0..40_u64).map(|seed| {
        let shape = Shape {
            bodies: 2 + seed as usize % 13,
            floating: seed.is_multiple_of(2),
            prescribed: seed.is_multiple_of(3),
            armature: seed % 5 > 1,
        };
        (seed, random_tree(seed + 100, shape))
    })
}

struct Case {
    tree: Tree,
    ws: Workspace,
    q: Vec<f64>,
    v: Vec<f64>,
}

impl Case {
    fn new(mbs: &Multibody, seed: u64) -> Self {
        let tree = Tree::new(mbs);
        let mut ws = Workspace::new(&tree);
        let (q, v) = (mbs.random_q(seed), mbs.random_v(seed));
        kinematics(&tree, &mut ws, &q, &v);
        Self { tree, ws, q, v }
    }
    fn nv(&self) -> usize {
        self.tree.nv()
    }
    fn mass(&mut self) -> DMatrix<f64> {
        let n = self.nv();
        let mut M = vec![0.0; n * n];
        mass_matrix(&self.tree, &mut self.ws, &mut M);
        DMatrix::from_row_slice(n, n, &M)
    }
    fn inverse(&mut self) -> DMatrix<f64> {
        let n = self.nv();
        let mut M = vec![0.0; n * n];
        inverse_mass_matrix(&self.tree, &mut self.ws, &mut M).unwrap();
        DMatrix::from_row_slice(n, n, &M)
    }
    fn jacobian(&mut self, node: &str) -> DMatrix<f64> {
        let n = self.tree.multibody().node(node).unwrap();
        let mut J = vec![0.0; 6 * self.nv()];
        node_jacobian(&self.tree, &self.ws, n, &mut J);
        DMatrix::from_row_slice(6, self.nv(), &J)
    }
}

fn six(m: &Motion) -> Vec<f64> {
    m.angular.iter().chain(m.linear.iter()).copied().collect()
}

fn times(A: &DMatrix<f64>, x: &[f64]) -> Vec<f64> {
    (A * DMatrix::from_column_slice(x.len(), 1, x)).as_slice().to_vec()
}

#[test]
fn the_inverse_is_that_of_the_free_block() {
    for (seed, mbs) in shapes() {
        let mut c = Case::new(&mbs, seed);
        let (M, X, n) = (c.mass(), c.inverse(), c.nv());
        let fixed = mbs.prescribed();
        // Remove rows and columns of prescribed coordinates from M, and put ones in their place.
        let mut free = M.clone();
        for i in (0..n).filter(|i| fixed[*i]) {
            free.row_mut(i).fill(0.0);
            free.column_mut(i).fill(0.0);
            free[(i, i)] = 1.0;
        }
        let mut want = free.clone().try_inverse().unwrap();
        for i in (0..n).filter(|i| fixed[*i]) {
            want[(i, i)] = 0.0;
        }
        // Measured: 3e-13, with condition numbers of some 1e4.
        close(X.as_slice(), want.as_slice(), 1e-11, &format!("seed {seed}, inverse"));
        let mut x = Rng(seed).vec(n);
        let want = times(&X, &x);
        apply_inverse_mass(&c.tree, &mut c.ws, &mut x).unwrap();
        close(&x, &want, 1e-12, &format!("seed {seed}, product"));
    }
}

#[test]
fn jacobians_give_velocities_accelerations_and_forces() {
    for (seed, mbs) in shapes() {
        let mut c = Case::new(&mbs, seed);
        let n = c.nv();
        let name = format!("n{:02}", mbs.nodes().len() - 1);
        let node = mbs.node(&name).unwrap();
        let J = c.jacobian(&name);
        let at = |what: &str| format!("seed {seed}, {what}");
        let V = six(&c.ws.node_velocity(&c.tree, node));
        close(&times(&J, &c.v), &V, 1e-13, &at("velocity"));
        let product = six(&node_jacobian_product(&c.tree, &c.ws, node, &c.v));
        close(&product, &V, 1e-13, &at("product"));

        let mut rate = vec![0.0; 6 * n];
        node_jacobian_rate(&c.tree, &c.ws, node, &mut rate);
        let rate = DMatrix::from_row_slice(6, n, &rate);
        let vdot = mbs.random_v(seed + 7);
        inverse_dynamics(&c.tree, &mut c.ws, &c.q, &c.v, &vdot, &mut vec![0.0; n]);
        let sum: Vec<f64> =
            times(&J, &vdot).iter().zip(times(&rate, &c.v)).map(|(a, b)| a + b).collect();
        let A = six(&c.ws.node_acceleration(&c.tree, node));
        close(&sum, &A, 1e-12, &at("acceleration"));
        // The rate must equal the derivative of the Jacobian along the motion.
        let moved = |h: f64| {
            let dv: Vec<f64> = c.v.iter().map(|x| x * h).collect();
            let mut q = c.q.clone();
            mbs.integrate(&c.q, &dv, &mut q);
            let mut ws = Workspace::new(&c.tree);
            let mut J = vec![0.0; 6 * n];
            node_jacobian_at(&c.tree, &mut ws, &q, node, &mut J);
            DMatrix::from_row_slice(6, n, &J)
        };
        let h = 1e-5;
        let difference = (moved(h) - moved(-h)) / (2.0 * h);
        // Measured: 1e-8, which is the truncation of central differences at this step.
        close(rate.as_slice(), difference.as_slice(), 1e-7, &at("rate"));
        close(moved(0.0).as_slice(), J.as_slice(), 1e-13, &at("along the path"));

        let wrench = Force::new(Rng(seed).vec3(), Rng(seed + 1).vec3());
        let mut tau = vec![0.0; n];
        node_jacobian_transpose_product(&c.tree, &c.ws, node, &wrench, &mut tau);
        let f: Vec<f64> = wrench.moment.iter().chain(wrench.force.iter()).copied().collect();
        close(&tau, &times(&J.transpose(), &f), 1e-13, &at("forces"));
    }
}

#[test]
fn compliance_is_that_of_the_dense_matrices() {
    for (seed, mbs) in shapes() {
        let mut c = Case::new(&mbs, seed);
        let names: Vec<String> =
            (0..mbs.nodes().len()).rev().step_by(2).map(|i| format!("n{i:02}")).collect();
        let nodes: Vec<_> = names.iter().map(|n| mbs.node(n).unwrap()).collect();
        let mut J = DMatrix::zeros(6 * nodes.len(), c.nv());
        for (i, n) in names.iter().enumerate() {
            J.view_mut((6 * i, 0), (6, c.nv())).copy_from(&c.jacobian(n));
        }
        let X = c.inverse();
        let want = &J * X * J.transpose();
        let mut compliance = Compliance::new(&c.tree, &nodes);
        let mut out = vec![0.0; compliance.size() * compliance.size()];
        compliance.compute(&c.tree, &mut c.ws, &mut out).unwrap();
        // Measured: 2e-14.
        close(&out, want.transpose().as_slice(), 1e-12, &format!("seed {seed}"));
    }
}

#[test]
fn centroidal_quantities_are_those_of_the_bodies() {
    for (seed, mbs) in shapes() {
        let mut c = Case::new(&mbs, seed);
        let n = c.nv();
        let at = |what: &str| format!("seed {seed}, {what}");
        let (mut A, mut Jc) = (vec![0.0; 6 * n], vec![0.0; 3 * n]);
        centroidal_matrix(&c.tree, &mut c.ws, &mut A);
        com_jacobian(&c.tree, &mut c.ws, &mut Jc);
        let (A, Jc) = (DMatrix::from_row_slice(6, n, &A), DMatrix::from_row_slice(3, n, &Jc));
        let h = momentum(&c.tree, &c.ws);
        let h: Vec<f64> = h.moment.iter().chain(h.force.iter()).copied().collect();
        close(&times(&A, &c.v), &h, 1e-12, &at("momentum"));
        let vc = com_velocity(&c.tree, &c.ws);
        close(&times(&Jc, &c.v), vc.as_slice(), 1e-12, &at("com velocity"));
        // A β̇ + bias is the rate of the momentum.
        let vdot = mbs.random_v(seed + 7);
        let bias = centroidal_bias(&c.tree, &c.ws);
        let mut rate = times(&A, &vdot);
        let bias: Vec<f64> = bias.moment.iter().chain(bias.force.iter()).copied().collect();
        rate.iter_mut().zip(&bias).for_each(|(a, b)| *a += b);
        let momentum_at = |h: f64| {
            let dv: Vec<f64> = c.v.iter().map(|x| x * h).collect();
            let mut q = c.q.clone();
            mbs.integrate(&c.q, &dv, &mut q);
            let v: Vec<f64> = c.v.iter().zip(&vdot).map(|(v, a)| v + a * h).collect();
            let mut ws = Workspace::new(&c.tree);
            kinematics(&c.tree, &mut ws, &q, &v);
            let h = momentum(&c.tree, &ws);
            Vec::from_iter(h.moment.iter().chain(h.force.iter()).copied())
        };
        let h = 1e-5;
        let difference: Vec<f64> = (momentum_at(h).iter().zip(momentum_at(-h)))
            .map(|(a, b)| (a - b) / (2.0 * h))
            .collect();
        close(&rate, &difference, 1e-7, &at("momentum rate"));
    }
}

#[test]
fn far_from_the_origin_nothing_changes() {
    let mbs =
        random_tree(3, Shape { bodies: 9, floating: true, prescribed: false, armature: true });
    let nodes: Vec<_> = ["n03", "n08"].iter().map(|n| mbs.node(n).unwrap()).collect();
    let mut answers = Vec::new();
    for distance in [0.0, 1e3, 1e6, 1.5e11] {
        let mut c = Case::new(&mbs, 4);
        (c.q[0], c.q[1]) = (distance, -0.3 * distance);
        kinematics(&c.tree, &mut c.ws, &c.q, &c.v);
        let mut compliance = Compliance::new(&c.tree, &nodes);
        let mut out = vec![0.0; compliance.size() * compliance.size()];
        compliance.compute(&c.tree, &mut c.ws, &mut out).unwrap();
        out.extend(c.inverse().iter());
        out.extend(c.mass().iter());
        out.extend(c.jacobian("n08").iter());
        answers.push(out);
    }
    for a in &answers {
        assert_eq!(a, &answers[0], "bits depend on the distance");
    }
}

#[test]
fn a_subgraph_gives_the_rows_of_the_whole() {
    for seed in 0..20 {
        let mbs = random_tree(
            seed + 300,
            Shape { bodies: 10, floating: true, prescribed: false, armature: true },
        );
        let mut whole = Case::new(&mbs, seed);
        let n = mbs.nv();
        let vdot = mbs.random_v(seed + 1);
        let mut tau = vec![0.0; n];
        inverse_dynamics(&whole.tree, &mut whole.ws, &whole.q, &whole.v, &vdot, &mut tau);
        let M = whole.mass();
        let root = mbs.bodies().iter().position(|b| b.parent().is_some()).unwrap();
        let body = mbs.body_ids().nth(root + 1).unwrap();
        let sub = mbs.subtree_graph(body);
        if sub.v.is_empty() {
            continue;
        }
        let gather = |x: &[f64]| multibody::Subgraph::gather(&sub.v, x);
        let part = Tree::new(&sub.multibody);
        let mut ws = Workspace::new(&part);
        let base = sub.base.unwrap();
        ws.set_base(
            &whole.ws.body_pose(&whole.tree, base),
            &whole.ws.body_velocity(&whole.tree, base),
            &whole.ws.body_acceleration(&whole.tree, base),
        );
        let q = multibody::Subgraph::gather(&sub.q, &whole.q);
        let (v, a, nv) = (gather(&whole.v), gather(&vdot), sub.v.len());
        let mut out = vec![0.0; nv];
        inverse_dynamics(&part, &mut ws, &q, &v, &a, &mut out);
        close(&out, &gather(&tau), 1e-12, &format!("seed {seed}, forces"));
        let mut found = vec![0.0; nv];
        forward_dynamics(&part, &mut ws, &q, &v, &mut out, &mut found).unwrap();
        close(&found, &a, 1e-10, &format!("seed {seed}, accelerations"));
        let mut m = vec![0.0; nv * nv];
        mass_matrix(&part, &mut ws, &mut m);
        for (i, a) in sub.v.iter().enumerate() {
            for (j, b) in sub.v.iter().enumerate() {
                let e = (m[i * nv + j] - M[(*a, *b)]).abs();
                assert!(e < 1e-12, "seed {seed}: mass matrix differs by {e:e}");
            }
        }
    }
}

#[test]
fn other_algorithms_on_a_subgraph_are_blocks_of_the_whole() {
    for seed in 0..20 {
        let shape = Shape { bodies: 10, floating: true, prescribed: false, armature: true };
        let mbs = random_tree(seed + 300, shape);
        let leaf = mbs.body_ids().last().unwrap();
        let arm = mbs.ancestors(leaf).find(|b| mbs.subtree(*b).len() > 2).unwrap();
        let (sub, n) = (mbs.subtree_graph(arm), mbs.nv());
        let Some(base) = sub.base.filter(|_| !sub.v.is_empty()) else { continue };
        // For the compliance, all other coordinates of the whole mechanism are prescribed.
        let mut held = mbs.clone();
        for b in mbs.body_ids().filter(|b| !sub.bodies.contains(b)) {
            held = held.with_coordinate(b, multibody::Coordinate::Prescribed);
        }
        let mut whole = Case::new(&held, seed);
        let vdot = mbs.random_v(seed + 1);
        let mut tau = vec![0.0; n];
        inverse_dynamics(&whole.tree, &mut whole.ws, &whole.q, &whole.v, &vdot, &mut tau);

        let part = Tree::new(&sub.multibody);
        let mut ws = Workspace::new(&part);
        ws.set_base(
            &whole.ws.body_pose(&whole.tree, base),
            &whole.ws.body_velocity(&whole.tree, base),
            &whole.ws.body_acceleration(&whole.tree, base),
        );
        let gather = multibody::Subgraph::gather;
        let (q, v, m) = (gather(&sub.q, &whole.q), gather(&sub.v, &whole.v), sub.v.len());
        kinematics(&part, &mut ws, &q, &v);
        let block = |rows: &[usize], of: &[f64]| -> Vec<f64> {
            rows.iter().flat_map(|i| sub.v.iter().map(move |j| of[i * n + j])).collect()
        };
        let at = |what: &str| format!("seed {seed}, {what}");
        let name = sub.multibody.nodes().last().unwrap().name();
        let (here, there) = (sub.multibody.node(name).unwrap(), mbs.node(name).unwrap());
        let (mut J, mut K) = (vec![0.0; 6 * m], vec![0.0; 6 * n]);
        node_jacobian(&part, &ws, here, &mut J);
        node_jacobian(&whole.tree, &whole.ws, there, &mut K);
        close(&J, &block(&[0, 1, 2, 3, 4, 5], &K), 1e-12, &at("Jacobian"));
        let (mut X, mut Y) = (vec![0.0; m * m], vec![0.0; n * n]);
        inverse_mass_matrix(&part, &mut ws, &mut X).unwrap();
        inverse_mass_matrix(&whole.tree, &mut whole.ws, &mut Y).unwrap();
        close(&X, &block(&sub.v, &Y), 1e-11, &at("inverse mass matrix"));
        let (mut a, mut b) = (vec![0.0; 36], vec![0.0; 36]);
        Compliance::new(&part, &[here]).compute(&part, &mut ws, &mut a).unwrap();
        Compliance::new(&whole.tree, &[there]).compute(&whole.tree, &mut whole.ws, &mut b).unwrap();
        close(&a, &b, 1e-11, &at("compliance"));
        let (mut dq, mut dv) = (vec![0.0; m * m], vec![0.0; m * m]);
        let (mut Dq, mut Dv) = (vec![0.0; n * n], vec![0.0; n * n]);
        let given = gather(&sub.v, &vdot);
        Derivatives::new(&part).inverse_dynamics(&part, &mut ws, &v, &given, &mut dq, &mut dv);
        Derivatives::new(&whole.tree).inverse_dynamics(
            &whole.tree,
            &mut whole.ws,
            &whole.v,
            &vdot,
            &mut Dq,
            &mut Dv,
        );
        close(&dq, &block(&sub.v, &Dq), 1e-11, &at("derivative by q"));
        close(&dv, &block(&sub.v, &Dv), 1e-11, &at("derivative by rates"));
    }
}

#[test]
fn a_base_may_move() {
    // On a rotating base, a mechanism has the same forces as with the rotation as a prescribed hinge.
    use multibody::{BodySpec, Builder, Hinge};
    let arm = |hinge: Hinge| {
        let mut r = Rng(5);
        let mut b = Builder::new();
        b.body(BodySpec::new("table", "world").hinge(hinge).mass(r.mass()));
        for (name, parent) in [("a", "table"), ("b", "a"), ("c", "a")] {
            b.body(
                BodySpec::new(name, parent)
                    .hinge_in_parent(r.pose())
                    .hinge(Hinge::universal(r.vec3(), r.vec3()))
                    .mass(r.mass()),
            );
        }
        b.build().unwrap()
    };
    let turning = arm(Hinge::pin(Vec3::z()).prescribed());
    let c = Case::new(&turning, 1);
    let n = turning.nv();
    let (mut tau, mut vdot) = (turning.random_v(2), turning.random_v(3));
    let mut ws = c.ws.clone();
    forward_dynamics(&c.tree, &mut ws, &c.q, &c.v, &mut tau, &mut vdot).unwrap();

    let part = arm(Hinge::locked());
    let tree = Tree::new(&part);
    let mut moved = Workspace::new(&tree);
    let turn = spatial::Quat::from_scaled_axis(Vec3::z() * c.q[0]);
    let axis = |x: f64| Motion::new(Vec3::z() * x, Vec3::zeros());
    moved.set_base(&Pose::rotation(turn), &axis(c.v[0]), &axis(vdot[0]));
    let mut out = vec![0.0; n - 1];
    forward_dynamics(&tree, &mut moved, &c.q[1..], &c.v[1..], &mut tau[1..].to_vec(), &mut out)
        .unwrap();
    close(&out, &vdot[1..], 1e-12, "accelerations on a moving base");
}

#[test]
fn forces_are_linear_in_the_inertial_parameters() {
    for (seed, mbs) in shapes() {
        let mut c = Case::new(&mbs, seed);
        let n = c.nv();
        let vdot = mbs.random_v(seed + 7);
        c.ws.apply_uniform_gravity(Vec3::new(1.0, 2.0, -9.0));
        let mut tau = vec![0.0; n];
        inverse_dynamics(&c.tree, &mut c.ws, &c.q, &c.v, &vdot, &mut tau);
        let pi: Vec<f64> =
            mbs.bodies().iter().flat_map(|b| inertial_parameters(b.inertia())).collect();
        let mut Y = vec![0.0; n * pi.len()];
        regressor(&c.tree, &c.ws, &mut Y);
        let mut found = times(&DMatrix::from_row_slice(n, pi.len(), &Y), &pi);
        for (_, s) in mbs.subhinges() {
            for i in s.v.clone() {
                found[i] += s.subhinge.reflected_inertia() * vdot[i];
            }
        }
        close(&found, &tau, 1e-12, &format!("seed {seed}"));
    }
}

//! Flexible bodies in every tree algorithm: random trees with random non-orthogonal modes, with shortening, stiffness and damping. Compares each
//! algorithm with another, or with differences.

use crate::support::{Rng, Shape, close, random_tree, solve};
use linkwork_dynamics::multibody::modes::{Attachment, Modes, Shortening, Station};
use linkwork_dynamics::multibody::{BodySpec, Builder, Coordinate, Hinge, LoopClosure, Multibody};
use linkwork_dynamics::spatial::nalgebra::DMatrix;
use linkwork_dynamics::spatial::{Force, MassProperties, Motion, Pose, Vec3};
use linkwork_dynamics::*;

const G: Vec3 = Vec3::new(0.4, -1.3, -9.0);

/// Random independent modes; they need not belong to a beam.
fn random_modes(r: &mut Rng) -> Modes {
    let n = 1 + r.below(3);
    let gram = |r: &mut Rng, size: f64| -> Vec<f64> {
        let A = DMatrix::from_vec(n, n, r.vec(n * n));
        (A.transpose() * A * size).as_slice().to_vec()
    };
    let station = |r: &mut Rng, mass: MassProperties| Station {
        pose: r.pose(),
        mass,
        translation: (0..n).map(|_| r.vec3() * 0.2).collect(),
        rotation: if r.below(4) == 0 { vec![] } else { (0..n).map(|_| r.vec3() * 0.4).collect() },
        shortening: (r.below(3) > 0).then(|| {
            let axis = r.vec3().normalize();
            Shortening { axis, matrix: gram(r, 0.1) }
        }),
    };
    let mut stations: Vec<Station> = (0..3)
        .map(|_| {
            let mass = r.mass();
            station(r, mass)
        })
        .collect();
    stations.insert(r.below(4), station(r, MassProperties::massless()));
    Modes {
        stiffness: gram(r, 5.0),
        damping: gram(r, 0.5),
        stations,
        attachment: Attachment::Nearest { tolerance: 10.0 },
    }
}

/// A random tree in which every second body bends.
fn flexible(seed: u64, shape: Shape) -> Multibody {
    let mut r = Rng(seed ^ 0xf1e8);
    let mut b = Builder::from(&random_tree(seed, shape));
    for (i, body) in b.bodies_mut().iter_mut().enumerate() {
        if (i + seed as usize).is_multiple_of(2) {
            body.modes = Some(random_modes(&mut r));
        }
    }
    b.build().unwrap_or_else(|e| panic!("seed {seed}: {e}"))
}

fn shape(seed: u64) -> Shape {
    let floating = seed.is_multiple_of(2);
    Shape { bodies: 7, floating, prescribed: seed % 3 == 1, armature: seed % 5 > 1 }
}

/// A tree with its state, gravity, a moving base and a wrench on every node.
struct Case {
    tree: Tree,
    ws: Workspace,
    q: Vec<f64>,
    v: Vec<f64>,
    wrenches: Vec<Force>,
}

impl Case {
    fn new(seed: u64) -> Self {
        let mbs = flexible(seed, shape(seed));
        let (tree, mut r) = (Tree::new(&mbs), Rng(seed));
        let mut ws = Workspace::new(&tree);
        let motion = |r: &mut Rng| Motion::new(r.vec3(), r.vec3());
        ws.set_base(&r.pose(), &motion(&mut r), &motion(&mut r));
        let wrenches = mbs.nodes().iter().map(|_| Force::new(r.vec3(), r.vec3())).collect();
        let mut case = Self { q: mbs.random_q(seed), v: mbs.random_v(seed), tree, ws, wrenches };
        case.load();
        case
    }

    /// The case without a moving base, gravity or wrenches.
    fn plain(seed: u64) -> Self {
        let mbs = flexible(seed, shape(seed));
        let tree = Tree::new(&mbs);
        let mut ws = Workspace::new(&tree);
        let (q, v) = (mbs.random_q(seed), mbs.random_v(seed));
        kinematics(&tree, &mut ws, &q, &v);
        Self { q, v, tree, ws, wrenches: vec![] }
    }

    fn load(&mut self) {
        kinematics(&self.tree, &mut self.ws, &self.q, &self.v);
        self.ws.clear_forces();
        self.ws.apply_uniform_gravity(G);
        for (n, f) in self.tree.multibody().node_ids().zip(&self.wrenches) {
            self.ws.add_wrench_at_node(&self.tree, n, *f);
        }
    }

    fn inverse(&mut self, vdot: &[f64]) -> Vec<f64> {
        let mut tau = vec![0.0; self.tree.nv()];
        inverse_dynamics_given_kinematics(&self.tree, &mut self.ws, vdot, &mut tau);
        tau
    }

    /// Computes the rate of a quantity by differences at times ±h along the motion with constant β.
    fn rate(&mut self, mut f: impl FnMut(&Tree, &mut Workspace) -> Vec<f64>) -> Vec<f64> {
        let h = 1e-5;
        let mut at = |t: f64| {
            let dv: Vec<f64> = self.v.iter().map(|v| v * t).collect();
            let mut q = self.q.clone();
            self.tree.multibody().integrate(&self.q, &dv, &mut q);
            kinematics(&self.tree, &mut self.ws, &q, &self.v);
            f(&self.tree, &mut self.ws)
        };
        let (a, b) = (at(-h), at(h));
        let rate = a.iter().zip(&b).map(|(a, b)| (b - a) / (2.0 * h)).collect();
        kinematics(&self.tree, &mut self.ws, &self.q, &self.v);
        rate
    }
}

fn six(m: &Motion) -> Vec<f64> {
    m.angular.iter().chain(m.linear.iter()).copied().collect()
}

fn mass(tree: &Tree, ws: &mut Workspace) -> Vec<f64> {
    let mut M = vec![0.0; tree.nv() * tree.nv()];
    mass_matrix(tree, ws, &mut M);
    M
}

#[test]
fn velocities_and_biases_are_rates_of_poses_and_velocities() {
    for seed in 0..30 {
        let mut c = Case::plain(seed);
        for n in c.tree.multibody().node_ids() {
            let V = c.ws.node_velocity(&c.tree, n);
            let p = c.rate(|t, ws| ws.node_pose(t, n).position.as_slice().to_vec());
            close(&p, V.linear.as_slice(), 1e-7, "velocity");
            let R = c.rate(|t, ws| ws.node_rotation(t, n).as_slice().to_vec());
            let W = linkwork_dynamics::spatial::skew(&V.angular) * c.ws.node_rotation(&c.tree, n);
            close(&R, W.as_slice(), 1e-7, "angular velocity");
            let A = c.ws.node_bias_acceleration(&c.tree, n);
            let rate = c.rate(|t, ws| six(&ws.node_velocity(t, n)));
            close(&rate, &six(&A), 1e-6, &format!("seed {seed}, bias"));
            // The poses that the mechanism computes without a workspace must be equal.
            let node = c.tree.multibody().get_node(n);
            let poses = c.tree.multibody().body_poses(&c.q);
            let body = c.ws.body_pose(&c.tree, node.body()).position;
            close(body.as_slice(), poses[node.body().index()].position.as_slice(), 1e-13, "pose");
        }
    }
}

#[test]
fn jacobians_and_their_rates_are_those_of_the_motion() {
    for seed in 0..30 {
        let mut c = Case::plain(seed);
        let nv = c.tree.nv();
        for n in c.tree.multibody().node_ids() {
            let (mut J, mut dJ) = (vec![0.0; 6 * nv], vec![0.0; 6 * nv]);
            node_jacobian(&c.tree, &c.ws, n, &mut J);
            let times = |J: &[f64], v: &[f64]| -> Vec<f64> {
                J.chunks(nv).map(|r| r.iter().zip(v).map(|(a, b)| a * b).sum()).collect()
            };
            close(&times(&J, &c.v), &six(&c.ws.node_velocity(&c.tree, n)), 1e-12, "J v");
            let V = node_jacobian_product(&c.tree, &c.ws, n, &c.v);
            close(&six(&V), &times(&J, &c.v), 1e-13, "product");
            node_jacobian_rate(&c.tree, &c.ws, n, &mut dJ);
            let A = c.ws.node_bias_acceleration(&c.tree, n);
            close(&times(&dJ, &c.v), &six(&A), 1e-11, &format!("seed {seed}, rate times v"));
            let rate = c.rate(|t, ws| {
                let mut J = vec![0.0; 6 * nv];
                node_jacobian(t, ws, n, &mut J);
                J
            });
            close(&dJ, &rate, 1e-6, &format!("seed {seed}, rate"));
            let mut tau = vec![0.0; nv];
            let f = Force::new(Vec3::new(0.3, -0.4, 0.7), Vec3::new(-0.9, 0.2, 0.5));
            node_jacobian_transpose_product(&c.tree, &c.ws, n, &f, &mut tau);
            let power: f64 = tau.iter().zip(&c.v).map(|(a, b)| a * b).sum();
            close(&[power], &[V.dot(&f)], 1e-12, "power");
            let mut at = vec![0.0; 6 * nv];
            node_jacobian_at(&c.tree, &mut Workspace::new(&c.tree), &c.q, n, &mut at);
            close(&at, &J, 1e-14, "at q");
        }
        for body in c.tree.multibody().body_ids() {
            let mut J = vec![0.0; 6 * nv];
            body_jacobian(&c.tree, &c.ws, body, &mut J);
            let V: Vec<f64> =
                J.chunks(nv).map(|r| r.iter().zip(&c.v).map(|(a, b)| a * b).sum()).collect();
            close(&V, &six(&c.ws.body_velocity(&c.tree, body)), 1e-12, "of a body");
        }
    }
}

#[test]
fn mass_matrix_is_kinetic_energy_and_inverse_dynamics() {
    for seed in 0..30 {
        let mut c = Case::new(seed);
        let nv = c.tree.nv();
        let M = mass(&c.tree, &mut c.ws);
        let zero = c.inverse(&vec![0.0; nv]);
        for i in 0..nv {
            let mut unit = vec![0.0; nv];
            unit[i] = 1.0;
            let column: Vec<f64> = c.inverse(&unit).iter().zip(&zero).map(|(a, b)| a - b).collect();
            close(&column, &M[i * nv..(i + 1) * nv], 1e-11, &format!("seed {seed}, column {i}"));
        }
        let mut c = Case::plain(seed);
        let M = mass(&c.tree, &mut c.ws);
        let Mv = M.chunks(nv).map(|r| r.iter().zip(&c.v).map(|(a, b)| a * b).sum::<f64>());
        let T: f64 = 0.5 * Mv.zip(&c.v).map(|(a, b)| a * b).sum::<f64>();
        close(&[kinetic_energy(&c.tree, &c.ws, &c.v)], &[T], 1e-12, "energy");
    }
}

#[test]
fn forward_inverts_inverse_with_prescribed_coordinates() {
    for seed in 0..40 {
        let mut c = Case::new(seed);
        let (nv, mask) = (c.tree.nv(), c.tree.multibody().prescribed());
        let want = Rng(seed + 7).vec(nv);
        let tau = c.inverse(&want);
        let nodes: Vec<_> = c.tree.multibody().node_ids().collect();
        let felt: Vec<Vec<f64>> =
            nodes.iter().map(|n| six(&c.ws.node_acceleration(&c.tree, *n))).collect();
        let (mut t, mut a) = (tau.clone(), want.clone());
        for i in 0..nv {
            if mask[i] { t[i] = 99.0 } else { a[i] = 99.0 }
        }
        forward_dynamics_given_kinematics(&c.tree, &mut c.ws, &mut t, &mut a).unwrap();
        // Measured: 4e-13.
        close(&a, &want, 1e-10, &format!("seed {seed}, accelerations"));
        close(&t, &tau, 1e-10, &format!("seed {seed}, forces"));
        for (n, felt) in nodes.iter().zip(&felt) {
            close(&six(&c.ws.node_acceleration(&c.tree, *n)), felt, 1e-9, "node");
        }
    }
}

#[test]
fn inverse_mass_and_compliance_are_those_of_dense_algebra() {
    for seed in 0..20 {
        let mut c = Case::plain(seed);
        let (nv, mask) = (c.tree.nv(), c.tree.multibody().prescribed());
        let mut M = mass(&c.tree, &mut c.ws);
        for i in (0..nv).filter(|i| mask[*i]) {
            for j in 0..nv {
                (M[i * nv + j], M[j * nv + i]) = (0.0, 0.0);
            }
            M[i * nv + i] = 1.0;
        }
        let column = |b: &[f64]| {
            let mut b = b.to_vec();
            (0..nv).filter(|i| mask[*i]).for_each(|i| b[i] = 0.0);
            solve(&M, nv, &b)
        };
        let nodes: Vec<_> = c.tree.multibody().node_ids().take(3).collect();
        let mut J = vec![0.0; 18 * nv];
        for (J, n) in J.chunks_mut(6 * nv).zip(&nodes) {
            node_jacobian(&c.tree, &c.ws, *n, J);
        }
        let want: Vec<f64> = J
            .chunks(nv)
            .flat_map(|a| {
                let x = column(a);
                J.chunks(nv).map(move |b| b.iter().zip(&x).map(|(a, b)| a * b).sum::<f64>())
            })
            .collect();
        let mut got = vec![0.0; 18 * 18];
        Compliance::new(&c.tree, &nodes).compute(&c.tree, &mut c.ws, &mut got).unwrap();
        close(&got, &want, 1e-9, &format!("seed {seed}, compliance"));
        let mut inverse = vec![0.0; nv * nv];
        inverse_mass_matrix(&c.tree, &mut c.ws, &mut inverse).unwrap();
        let mut x = c.v.clone();
        apply_inverse_mass(&c.tree, &mut c.ws, &mut x).unwrap();
        close(&x, &column(&c.v), 1e-10, "product");
        for (i, row) in inverse.chunks(nv).enumerate() {
            let mut unit = vec![0.0; nv];
            unit[i] = 1.0;
            close(row, &column(&unit), 1e-9, &format!("seed {seed}, row {i}"));
        }
    }
}

#[test]
fn momentum_its_matrix_and_its_rate_agree() {
    for seed in 0..30 {
        let mut c = Case::plain(seed);
        let nv = c.tree.nv();
        let pair =
            |f: Force| -> Vec<f64> { f.moment.iter().chain(f.force.iter()).copied().collect() };
        let h = pair(momentum(&c.tree, &c.ws));
        let (mut A, mut Jc) = (vec![0.0; 6 * nv], vec![0.0; 3 * nv]);
        centroidal_matrix(&c.tree, &mut c.ws, &mut A);
        com_jacobian(&c.tree, &mut c.ws, &mut Jc);
        let times = |J: &[f64]| -> Vec<f64> {
            J.chunks(nv).map(|r| r.iter().zip(&c.v).map(|(a, b)| a * b).sum()).collect()
        };
        close(&times(&A), &h, 1e-11, "A v");
        let u = com_velocity(&c.tree, &c.ws);
        close(&times(&Jc), u.as_slice(), 1e-11, "com");
        let bias = pair(centroidal_bias(&c.tree, &c.ws));
        let v = c.rate(|t, ws| center_of_mass(t, ws).as_slice().to_vec());
        close(&v, u.as_slice(), 1e-7, &format!("seed {seed}, com velocity"));
        let rate = c.rate(|t, ws| pair(momentum(t, ws)));
        close(&rate, &bias, 1e-6, &format!("seed {seed}, bias"));
        // Sum the masses and centres of mass of the subtrees.
        let mbs = c.tree.multibody();
        let (mut m, mut sum) = (0.0, Vec3::zeros());
        for b in mbs.body_ids().filter(|b| mbs.get(*b).parent().is_none()) {
            let I = subtree_inertia(&c.tree, &c.ws, b);
            m += I.mass();
            sum += c.ws.body_pose(&c.tree, b).position * I.mass() + I.h();
        }
        if (m - c.tree.total_mass()).abs() < 1e-12 {
            close(
                (sum / m).as_slice(),
                center_of_mass(&c.tree, &c.ws).as_slice(),
                1e-12,
                "subtrees",
            );
        }
    }
}

#[test]
fn forces_at_rest_are_gradients_of_potential_and_elastic_energy() {
    for seed in 0..20 {
        let mut c = Case::plain(seed);
        let (nv, q0) = (c.tree.nv(), c.q.clone());
        c.ws.apply_uniform_gravity(G);
        c.v.fill(0.0);
        kinematics(&c.tree, &mut c.ws, &c.q, &c.v);
        let tau = c.inverse(&vec![0.0; nv]);
        let h = 1e-5;
        let gradient: Vec<f64> = (0..nv)
            .map(|i| {
                let mut energy = |h: f64| {
                    let (mut dv, mut q) = (vec![0.0; nv], q0.clone());
                    dv[i] = h;
                    c.tree.multibody().integrate(&q0, &dv, &mut q);
                    poses(&c.tree, &mut c.ws, &q);
                    potential_energy(&c.tree, &c.ws) + elastic_energy(&c.tree, &c.ws)
                };
                (energy(h) - energy(-h)) / (2.0 * h)
            })
            .collect();
        close(&gradient, &tau, 1e-8, &format!("seed {seed}"));
        // Gravity acts as a field, evaluated at each station, and as an equal force on each.
        kinematics(&c.tree, &mut c.ws, &c.q, &c.v);
        c.ws.clear_forces();
        c.ws.apply_gravity(&c.tree, &mut |_| G);
        close(&c.inverse(&vec![0.0; nv]), &tau, 1e-11, "field");
    }
}

#[test]
fn power_of_the_forces_goes_into_energy_less_what_dampers_take() {
    for seed in 0..20 {
        let mut c = Case::plain(seed);
        let (nv, mbs) = (c.tree.nv(), c.tree.multibody().clone());
        let vdot = Rng(seed + 9).vec(nv);
        let tau = c.inverse(&vdot);
        let mut power: f64 = tau.iter().zip(&c.v).map(|(a, b)| a * b).sum();
        for b in mbs.bodies().iter().filter(|b| b.modes().is_some()) {
            let (C, v) = (b.modes().unwrap().damping_matrix(), &c.v[b.modes_v()]);
            let n = v.len();
            power -= (0..n * n).map(|k| v[k / n] * C[k] * v[k % n]).sum::<f64>();
        }
        let h = 1e-5;
        let mut energy = |t: f64| {
            // Move along the motion: q to second order and β to first order in t.
            let dv: Vec<f64> = (0..nv).map(|i| t * (c.v[i] + 0.5 * t * vdot[i])).collect();
            let v: Vec<f64> = (0..nv).map(|i| c.v[i] + t * vdot[i]).collect();
            let mut q = c.q.clone();
            mbs.integrate(&c.q, &dv, &mut q);
            kinematics(&c.tree, &mut c.ws, &q, &v);
            kinetic_energy(&c.tree, &c.ws, &v) + elastic_energy(&c.tree, &c.ws)
        };
        let rate = (energy(h) - energy(-h)) / (2.0 * h);
        close(&[rate], &[power], 1e-6, &format!("seed {seed}"));
    }
}

/// Bodies in slices, without modes.
fn sliced(seed: u64) -> (Multibody, Multibody) {
    let rigid = random_tree(seed, shape(seed));
    let mut b = Builder::from(&rigid);
    let mut r = Rng(seed + 1);
    for body in b.bodies_mut() {
        // Put the body's mass at one station with a random pose.
        let X = r.pose();
        let I = body.mass.validate().unwrap();
        let R = X.rotation.to_rotation_matrix().into_inner();
        let J = R.transpose() * I.inertia_com() * R;
        let com = X.inverse().transform_point(&I.com());
        let mass = MassProperties::new(I.mass(), com, (J + J.transpose()) * 0.5);
        body.modes = Some(Modes {
            stations: vec![Station { pose: X, mass, ..Station::default() }],
            attachment: Attachment::Nearest { tolerance: 10.0 },
            ..Modes::default()
        });
        body.mass = MassProperties::massless();
    }
    (rigid, b.build().unwrap())
}

#[test]
fn without_modes_a_flexible_body_is_rigid() {
    for seed in 0..20 {
        let (rigid, slices) = sliced(seed);
        let (q, v, a) = (rigid.random_q(seed), rigid.random_v(seed), rigid.random_v(seed + 1));
        let run = |mbs: &Multibody| {
            let tree = Tree::new(mbs);
            let mut ws = Workspace::new(&tree);
            kinematics(&tree, &mut ws, &q, &v);
            ws.apply_uniform_gravity(G);
            for n in mbs.node_ids() {
                let f = Force::new(Vec3::new(0.1, 0.2, -0.3), Vec3::new(0.5, -0.4, 0.6));
                ws.add_wrench_at_node(&tree, n, f);
            }
            let mut tau = vec![0.0; mbs.nv()];
            inverse_dynamics_given_kinematics(&tree, &mut ws, &a, &mut tau);
            let (mut t, mut x) = (tau.clone(), a.clone());
            forward_dynamics_given_kinematics(&tree, &mut ws, &mut t, &mut x).unwrap();
            let M = mass(&tree, &mut ws);
            let mut more: Vec<f64> = M;
            more.extend(t.iter().chain(&x));
            for n in mbs.node_ids() {
                more.extend(ws.node_pose(&tree, n).position.iter());
                more.extend(six(&ws.node_velocity(&tree, n)));
                more.extend(six(&ws.node_acceleration(&tree, n)));
            }
            for b in mbs.body_ids() {
                more.extend(ws.body_com(&tree, b).iter());
                more.extend(subtree_inertia(&tree, &ws, b).inertia().iter());
            }
            more
        };
        close(&run(&slices), &run(&rigid), 1e-11, &format!("seed {seed}"));
    }
}

#[test]
fn batches_and_ensembles_give_the_same_bits() {
    let mbs = flexible(6, shape(6));
    let (tree, nv, nq) = (std::sync::Arc::new(Tree::new(&mbs)), mbs.nv(), mbs.nq());
    let (count, node) = (7, mbs.node("n05").unwrap());
    let table = |f: &dyn Fn(u64) -> Vec<f64>| (0..count).flat_map(f).collect::<Vec<f64>>();
    let (q, v) = (table(&|s| mbs.random_q(s)), table(&|s| mbs.random_v(s)));
    let a = table(&|s| Rng(s + 40).vec(nv));
    let rows = count as usize;
    let mut e = Ensemble::new(tree.clone(), 2);
    e.set_uniform_gravity(G);
    let [mut tau, mut found] = [vec![0.0; rows * nv], vec![0.0; rows * nv]];
    let (mut M, mut J) = (vec![0.0; rows * nv * nv], vec![0.0; rows * 6 * nv]);
    let (mut A, mut p, mut X) = (J.clone(), vec![0.0; rows * 3], M.clone());
    let mut L = vec![0.0; rows * 36];
    e.inverse_dynamics(&q, &v, &a, &mut tau);
    let mut given = tau.clone();
    e.forward_dynamics(&q, &v, &mut given, &mut found).unwrap();
    e.mass_matrix(&q, &mut M);
    e.node_jacobian(&q, node, &mut J);
    e.centroidal_matrix(&q, &mut A);
    e.node_position(&q, node, &mut p);
    e.inverse_mass_matrix(&q, &mut X).unwrap();
    e.compliance(&q, &[node], &mut L).unwrap();
    for i in 0..rows {
        let row = |t: &[f64], n: usize| t[i * n..(i + 1) * n].to_vec();
        let mut ws = Workspace::new(&tree);
        ws.apply_uniform_gravity(G);
        let (q, v, a) = (row(&q, nq), row(&v, nv), row(&a, nv));
        let (mut t, mut x) = (vec![0.0; nv], vec![0.0; nv]);
        inverse_dynamics(&tree, &mut ws, &q, &v, &a, &mut t);
        assert_eq!(t, row(&tau, nv));
        forward_dynamics_given_kinematics(&tree, &mut ws, &mut t, &mut x).unwrap();
        assert_eq!(x, row(&found, nv));
        let (mut one, mut six) = (vec![0.0; nv * nv], vec![0.0; 6 * nv]);
        mass_matrix(&tree, &mut ws, &mut one);
        assert_eq!(one, row(&M, nv * nv));
        node_jacobian(&tree, &ws, node, &mut six);
        assert_eq!(six, row(&J, 6 * nv));
        centroidal_matrix(&tree, &mut ws, &mut six);
        assert_eq!(six, row(&A, 6 * nv));
        assert_eq!(ws.node_pose(&tree, node).position.as_slice(), row(&p, 3));
        inverse_mass_matrix(&tree, &mut ws, &mut one).unwrap();
        assert_eq!(one, row(&X, nv * nv));
        let mut l = vec![0.0; 36];
        Compliance::new(&tree, &[node]).compute(&tree, &mut ws, &mut l).unwrap();
        assert_eq!(l, row(&L, 36));
    }
    // A batch with separate forces in each state.
    let mut b = Batch::<f64x4>::new(&tree);
    let pack = |t: &[f64], n: usize| -> Vec<f64x4> {
        (0..n).map(|i| f64x4::from([0, 1, 2, 3].map(|s| t[s * n + i]))).collect()
    };
    b.kinematics(&tree, &pack(&q, nq), &pack(&v, nv));
    let f = f64x4::from([0.1, 0.2, 0.3, 0.4]);
    b.add_wrench_at_node(&tree, node, [f, -f, f], [f, f, -f]);
    let (mut t, mut x) = (pack(&tau, nv), vec![f64x4::default(); nv]);
    b.forward_dynamics_given_kinematics(&tree, &mut t, &mut x).unwrap();
    let (w, u) = b.node_velocity(&tree, node);
    for s in 0..4 {
        let mut ws = Workspace::new(&tree);
        kinematics(&tree, &mut ws, &q[s * nq..(s + 1) * nq], &v[s * nv..(s + 1) * nv]);
        let f = 0.1 * (s + 1) as f64;
        let (moment, force) = (Vec3::new(f, -f, f), Vec3::new(f, f, -f));
        ws.add_wrench_at_node(&tree, node, Force::new(moment, force));
        let (mut t, mut y) = (tau[s * nv..(s + 1) * nv].to_vec(), vec![0.0; nv]);
        forward_dynamics_given_kinematics(&tree, &mut ws, &mut t, &mut y).unwrap();
        let of = |x: &[f64x4]| x.iter().map(|x| x.to_array()[s]).collect::<Vec<f64>>();
        close(&of(&x), &y, 1e-14, "batch");
        assert_eq!([of(&w), of(&u)].concat(), six(&ws.node_velocity(&tree, node)));
    }
}

#[test]
fn inverse_kinematics_moves_hinges_and_leaves_modes() {
    let c = Case::plain(9);
    let node = c.tree.multibody().node("n06").unwrap();
    let mut ik = InverseKinematics::new(&c.tree);
    let mut to = c.q.clone();
    let dv: Vec<f64> = c.v.iter().map(|v| 0.05 * v).collect();
    c.tree.multibody().integrate(&c.q, &dv, &mut to);
    for b in c.tree.multibody().bodies() {
        to[b.modes_q()].copy_from_slice(&c.q[b.modes_q()]);
        for s in b.subhinges().iter().filter(|s| s.subhinge.coordinate == Coordinate::Prescribed) {
            to[s.q.clone()].copy_from_slice(&c.q[s.q.clone()]);
        }
    }
    let mut ws = Workspace::new(&c.tree);
    poses(&c.tree, &mut ws, &to);
    let (target, mut q) = (ws.node_pose(&c.tree, node), c.q.clone());
    ik.solve(&c.tree, &[Target::new(node, Goal::pose(target))], &mut q).unwrap();
    poses(&c.tree, &mut ws, &q);
    let reached = ws.node_pose(&c.tree, node);
    assert!((reached.position - target.position).norm() < 1e-6);
    for b in c.tree.multibody().bodies() {
        assert_eq!(q[b.modes_q()], c.q[b.modes_q()]);
    }
}

/// A loop between the world and a body beyond or on flexible bodies: closed at the deflected configuration of q, as the dynamics kernels confirm.
#[test]
fn inverse_kinematics_closes_loops_through_bent_bodies_and_refuses_to_bend_them() {
    let (mut bent, mut closed) = (0, 0);
    for seed in 0..24 {
        let c = Case::plain(seed);
        let mbs = c.tree.multibody();
        let node = mbs.get_node(mbs.node("n06").unwrap());
        let X = c.ws.node_pose(&c.tree, mbs.node("n06").unwrap());
        let mut b = Builder::from(mbs);
        let hinge = if seed % 3 == 0 { Hinge::pin(Vec3::z()) } else { Hinge::ball() };
        b.loop_closure(LoopClosure {
            name: "held".into(),
            body_a: "world".into(),
            frame_a: X,
            body_b: mbs.get(node.body()).name().into(),
            frame_b: node.pose(),
            hinge,
        });
        let mbs = b.build().unwrap();
        let tree = Tree::new(&mbs);
        let mut ik = InverseKinematics::new(&tree);
        let mut q = c.q.clone();
        let mask = mbs.prescribed();
        let mut dv: Vec<f64> =
            c.v.iter().zip(&mask).map(|(v, held)| if *held { 0.0 } else { 0.05 * v }).collect();
        for b in mbs.bodies() {
            dv[b.modes_v()].fill(0.0);
        }
        mbs.integrate(&c.q, &dv, &mut q);
        let errors = |q: &[f64]| {
            let (units, mut ws) = (
                units::Units::new(&tree, |_| units::ConstraintMethod::Augment),
                Workspace::new(&tree),
            );
            let mut uw = units::UnitsWork::new(&tree, &units);
            kinematics(&tree, &mut ws, q, &vec![0.0; tree.nv()]);
            let mut most = 0.0_f64;
            units.loop_errors(&tree, &ws, &mut uw, 0, &[], |d, _| most = most.max(d.abs()));
            most
        };
        let before = errors(&q);
        let solved = ik.solve(&tree, &[], &mut q);
        solved.unwrap_or_else(|e| panic!("seed {seed}: {e}"));
        assert!(errors(&q) <= 2e-9, "seed {seed}: {:e}", errors(&q));
        closed += usize::from(before > 1e-4);
        for b in mbs.bodies() {
            assert_eq!(q[b.modes_q()], c.q[b.modes_q()], "modes stay");
        }
        // The path to the loop contains a flexible body; moving its modes is an error that names it.
        let on_path =
            |b: multibody::BodyId| mbs.on_path(b, mbs.body(mbs.get(node.body()).name()).unwrap());
        bent += usize::from(mbs.body_ids().any(|b| mbs.get(b).modes().is_some() && on_path(b)));
        let soft = mbs.bodies().iter().find(|b| b.modes().is_some()).unwrap();
        ik.release(soft.modes_v());
        let error = ik.solve(&tree, &[], &mut q).unwrap_err();
        let InverseKinematicsError::Flexible { body } = &error else { panic!("{error}") };
        assert_eq!(body, soft.name());
        assert!(error.to_string().contains("help: "));
    }
    assert!(bent >= 12 && closed >= 12, "{bent} {closed}");
}

#[test]
fn what_is_only_for_rigid_mechanisms_says_so() {
    let mut c = Case::plain(4);
    let (mbs, nv) = (c.tree.multibody().clone(), c.tree.nv());
    let body = mbs.bodies().iter().find(|b| b.modes().is_some()).unwrap().name().to_owned();
    let said = |e: String| {
        assert!(e.contains(&format!("body `{body}` is flexible")) && e.contains("help: "), "{e}");
    };
    said(linkwork_operators::Operators::new(&c.tree, &c.ws).unwrap_err().to_string());
    said(c.tree.check_rigid("regressor").unwrap_err().to_string());
    said(Frames::new().add_mechanism("m", &mbs, Frames::new().world()).unwrap_err().to_string());
    said(Edit::new(&mbs, &c.q, &c.v).unwrap_err().to_string());
    let mut d = Derivatives::new(&c.tree);
    let [mut a, mut b, mut e] = [vec![0.0; nv * nv], vec![0.0; nv * nv], vec![0.0; nv * nv]];
    let out = ForwardDerivatives { dvdot_dq: &mut a, dvdot_dv: &mut b, dvdot_dtau: &mut e };
    let (mut tau, mut vdot) = (vec![0.0; nv], vec![0.0; nv]);
    let v = c.v.clone();
    let got = d.forward_dynamics(&c.tree, &mut c.ws, &v, &mut tau, &mut vdot, out);
    said(got.unwrap_err().to_string());
    let rigid = Tree::new(&random_tree(4, shape(4)));
    assert!(rigid.check_rigid("regressor").is_ok() && !rigid.is_flexible());
}

#[test]
fn a_mode_with_nothing_to_move_behind_a_prescribed_hinge_or_a_free_one_is_named() {
    // Two masses have a single mode, a rigid rotation; the pin permits the same rotation.
    let at = |x: f64| Station {
        pose: Pose::translation(x, 0.0, 0.0),
        mass: MassProperties::new(1.0, Vec3::zeros(), linkwork_dynamics::spatial::Mat3::zeros()),
        translation: vec![Vec3::y() * x],
        ..Station::default()
    };
    let modes =
        Modes { stiffness: vec![1.0], stations: vec![at(0.5), at(1.0)], ..Modes::default() };
    let run = |hinge: Hinge| {
        let mut b = Builder::new();
        b.body(BodySpec::new("rod", "world").hinge(hinge).modes(modes.clone()));
        let mbs = b.build().unwrap();
        let tree = Tree::new(&mbs);
        let [mut tau, mut vdot] = [[0.1, 0.2], [0.0, 0.0]];
        let mut ws = Workspace::new(&tree);
        forward_dynamics(&tree, &mut ws, &[0.0, 0.0], &[0.0, 0.0], &mut tau, &mut vdot)
            .map(|()| vdot)
    };
    let error = run(Hinge::pin(Vec3::z())).unwrap_err();
    assert_eq!(error, DynamicsError::Singular { body: "rod".into(), v: 0 });
    assert!((run(Hinge::pin(Vec3::z()).prescribed()).unwrap()[1] - 0.16).abs() < 1e-15);
}

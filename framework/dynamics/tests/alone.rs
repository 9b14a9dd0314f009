//! Free-floating bodies, solved in closed form about their centres of mass, compared with inverse dynamics, the mass matrix and the recursion over a
//! tree.

use crate::support::{Rng, close, solve};
use linkwork_dynamics::multibody::{BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::{Force, MassProperties, Motion, Pose, RigidInertia, Vec3};
use linkwork_dynamics::*;

/// Three vehicles on free hinges, the first at the start of the mechanism and the others anywhere, the last with a body locked to it. With `chain`
/// also an arm of two pins.
fn craft(seed: u64, chain: bool) -> Multibody {
    let mut r = Rng(seed);
    let mut b = Builder::new();
    let mut body = |r: &mut Rng, name: &str, parent: &str, hinge: Hinge, placed: bool| {
        let place = |r: &mut Rng| if placed { r.pose() } else { Pose::identity() };
        let (X_PJ, X_BJ) = (place(r), place(r));
        let spec = BodySpec::new(name, parent).hinge_in_parent(X_PJ).hinge_in_body(X_BJ);
        b.body(spec.hinge(hinge).mass(r.mass()));
    };
    body(&mut r, "a", "world", Hinge::free(), false);
    if chain {
        body(&mut r, "arm", "world", Hinge::pin(Vec3::new(0.3, -0.7, 0.5)), true);
        body(&mut r, "hand", "arm", Hinge::pin(Vec3::new(0.9, 0.2, 0.5)), true);
    }
    body(&mut r, "b", "world", Hinge::free(), true);
    body(&mut r, "c", "world", Hinge::free(), true);
    body(&mut r, "locked", "c", Hinge::locked(), true);
    for name in ["a", "b", "locked"] {
        b.node(format!("{name}_node"), name, r.pose());
    }
    b.build().unwrap()
}

struct Case {
    tree: Tree,
    ws: Workspace,
    q: Vec<f64>,
    v: Vec<f64>,
    tau: Vec<f64>,
}

fn case(mbs: &Multibody, seed: u64) -> Case {
    let tree = Tree::new(mbs);
    let (q, v, tau) = (mbs.random_q(seed), mbs.random_v(seed), Rng(seed + 7).vec(mbs.nv()));
    Case { ws: Workspace::new(&tree), tree, q, v, tau }
}

impl Case {
    /// Computes kinematics and sets forces.
    fn load(&mut self) {
        kinematics(&self.tree, &mut self.ws, &self.q, &self.v);
        self.ws.clear_forces();
        self.ws.apply_uniform_gravity(Vec3::new(0.5, -2.0, -9.0));
        let mut r = Rng(17);
        for b in self.tree.multibody().body_ids() {
            self.ws.add_wrench_at_body(&self.tree, b, Force::new(r.vec3(), r.vec3()));
        }
    }

    fn forward(&mut self) -> Vec<f64> {
        self.load();
        let mut vdot = vec![0.0; self.tree.nv()];
        let given = self.tau.clone();
        let done =
            forward_dynamics_given_kinematics(&self.tree, &mut self.ws, &mut self.tau, &mut vdot);
        done.unwrap();
        assert_eq!(self.tau, given, "forces are only read");
        vdot
    }
}

#[test]
fn they_move_as_inverse_dynamics_and_the_mass_matrix_say() {
    for seed in 0..40 {
        let mut c = case(&craft(seed, seed % 2 == 1), seed);
        let vdot = c.forward();
        let nv = vdot.len();
        let (mut back, mut bias, mut M) = (vec![0.0; nv], vec![0.0; nv], vec![0.0; nv * nv]);
        inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &vdot, &mut back);
        close(&back, &c.tau, 1e-12, &format!("seed {seed}, inverse of forward"));
        mass_matrix(&c.tree, &mut c.ws, &mut M);
        inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &vec![0.0; nv], &mut bias);
        let rhs: Vec<f64> = c.tau.iter().zip(&bias).map(|(t, b)| t - b).collect();
        close(&vdot, &solve(&M, nv, &rhs), 1e-12, &format!("seed {seed}, dense solve"));
    }
}

/// With an additional chain, which makes the recursion visit all links, the accelerations of the same bodies are bit-identical. Queries of bodies and
/// nodes agree with the recursion over a tree, in which each vehicle carries a prescribed massless body.
#[test]
fn they_move_as_in_a_sweep_over_a_tree() {
    for seed in 0..20 {
        let mbs = craft(seed, false);
        let mut b = Builder::new();
        for id in mbs.body_ids() {
            let body = mbs.get(id);
            let parent = body.parent().map_or("world", |p| mbs.get(p).name());
            let hinge = if body.is_free() { Hinge::free() } else { Hinge::locked() };
            let I = body.inertia();
            let mass = MassProperties::new(I.mass(), I.com(), I.inertia_com());
            let spec = BodySpec::new(body.name(), parent)
                .hinge_in_parent(body.hinge_in_parent())
                .hinge_in_body(body.hinge_in_body());
            b.body(spec.hinge(hinge).mass(mass));
        }
        for name in ["a", "b", "c"] {
            let pin = Hinge::pin(Vec3::new(0.1, 0.9, 0.3)).prescribed();
            let spec = BodySpec::new(format!("{name}_pin"), name).hinge(pin);
            b.body(spec.mass(MassProperties::new(0.0, Vec3::zeros(), Default::default())));
        }
        let tree = b.build().unwrap();
        let (mut alone, mut swept) = (case(&mbs, seed), case(&tree, seed));
        for x in [&mut swept.q, &mut swept.v, &mut swept.tau] {
            x.fill(0.0);
        }
        for name in ["a", "b", "c"] {
            let [from, to] = [&mbs, &tree].map(|m| m.get(m.body(name).unwrap()).clone());
            swept.q[to.q()].copy_from_slice(&alone.q[from.q()]);
            swept.v[to.v()].copy_from_slice(&alone.v[from.v()]);
            swept.tau[to.v()].copy_from_slice(&alone.tau[from.v()]);
        }
        for case in [&mut alone, &mut swept] {
            kinematics(&case.tree, &mut case.ws, &case.q, &case.v);
            case.ws.clear_forces();
            case.ws.apply_uniform_gravity(Vec3::new(0.5, -2.0, -9.0));
            let mut r = Rng(17);
            for name in ["a", "b", "c", "locked"] {
                let body = case.tree.multibody().body(name).unwrap();
                case.ws.add_wrench_at_body(&case.tree, body, Force::new(r.vec3(), r.vec3()));
            }
            let mut vdot = vec![0.0; case.tree.nv()];
            forward_dynamics_given_kinematics(&case.tree, &mut case.ws, &mut case.tau, &mut vdot)
                .unwrap();
        }
        for name in ["a", "b", "c", "locked"] {
            let [x, y] = [&alone, &swept].map(|c| {
                let body = c.tree.multibody().body(name).unwrap();
                let a = c.ws.body_acceleration(&c.tree, body);
                let (pose, V) = c.ws.body_state(&c.tree, body);
                assert_eq!(V, c.ws.body_velocity(&c.tree, body));
                let off = pose.position - c.ws.body_pose(&c.tree, body).position;
                let turn = pose.rotation.angle_to(&c.ws.body_pose(&c.tree, body).rotation);
                assert!(off.norm() < 1e-15 && turn < 1e-7, "{off} {turn}");
                [a.angular, a.linear, V.angular, V.linear, pose.position].map(|v| [v.x, v.y, v.z])
            });
            close(x.as_flattened(), y.as_flattened(), 1e-12, &format!("seed {seed}, {name}"));
        }
    }
    // The vehicles still count as isolated next to a chain.
    let (lone, beside) = (craft(5, false), craft(5, true));
    let (mut x, mut y) = (case(&lone, 1), case(&beside, 1));
    let [from, to] = [&lone, &beside].map(|m| m.get(m.body("a").unwrap()).clone());
    y.q[to.q()].copy_from_slice(&x.q[from.q()]);
    y.v[to.v()].copy_from_slice(&x.v[from.v()]);
    y.tau[to.v()].copy_from_slice(&x.tau[from.v()]);
    // In both mechanisms, the first body has the first external wrench.
    assert_eq!(x.forward()[from.v()], y.forward()[to.v()]);
}

/// On a frame that is elsewhere and moves, as a part of a mechanism on its base body.
#[test]
fn they_hang_on_a_base_that_moves() {
    for seed in 0..20 {
        let mut c = case(&craft(seed, seed % 2 == 1), seed);
        let rest = c.forward();
        let mut r = Rng(seed + 31);
        let pose = r.pose();
        let mut motion = || Motion::new(r.vec3(), r.vec3());
        c.ws.set_base(&pose, &motion(), &motion());
        let vdot = c.forward();
        assert!(vdot != rest, "seed {seed}");
        let mut back = vec![0.0; vdot.len()];
        inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &vdot, &mut back);
        close(&back, &c.tau, 1e-12, &format!("seed {seed}, inverse of forward"));
        c.ws.set_base(&pose, &Motion::zero(), &Motion::zero());
        let place = |c: &mut Case| {
            c.load();
            let a = c.tree.multibody().body("a").unwrap();
            c.ws.body_pose(&c.tree, a)
        };
        let moved = place(&mut c);
        c.ws.set_base(&Pose::identity(), &Motion::zero(), &Motion::zero());
        let want = pose * place(&mut c);
        assert!((moved.position - want.position).norm() < 1e-13, "seed {seed}");
        assert_eq!(c.forward(), rest, "seed {seed}: the world again");
    }
}

/// A body that loses its inertia is named in the error; with inertia again, it moves as before.
#[test]
fn changes_of_mass_are_followed() {
    let mbs = craft(3, false);
    let mut c = case(&mbs, 3);
    let before = c.forward();
    let b = mbs.body("b").unwrap();
    let was = *mbs.get(b).inertia();
    let half =
        RigidInertia::from_moments(0.5 * was.mass(), was.h() * 0.5, was.inertia() * 0.5).unwrap();
    c.tree.set_inertia(b, half).unwrap();
    let halved = c.forward();
    let own = mbs.get(b).v();
    assert!(halved[own.clone()] != before[own.clone()]);
    let (mut back, nv) = (vec![0.0; before.len()], before.len());
    inverse_dynamics_given_kinematics(&c.tree, &mut c.ws, &halved, &mut back);
    close(&back, &c.tau, 1e-12, "half the inertia");
    c.tree.set_inertia(b, RigidInertia::zero()).unwrap();
    c.load();
    let mut vdot = vec![0.0; nv];
    let refused =
        forward_dynamics_given_kinematics(&c.tree, &mut c.ws, &mut c.tau.clone(), &mut vdot);
    let Err(DynamicsError::Singular { body, .. }) = refused else { panic!("{refused:?}") };
    assert_eq!(body, "b");
    c.tree.set_inertia(b, was).unwrap();
    assert_eq!(c.forward(), before);
}

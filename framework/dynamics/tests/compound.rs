//! Bodies that are locked together, treated as one, compared with the recursion over each of them.

use crate::support::{Rng, close};
use linkwork_dynamics::multibody::{BodyId, BodySpec, Builder, Hinge, Multibody};
use linkwork_dynamics::spatial::{Force, RigidInertia, Vec3};
use linkwork_dynamics::*;

/// A floating vehicle and an arm on a pin, with nine and six bodies fixed to them, some of them to each other. `fixed` creates the hinges of these
/// bodies.
fn rig(seed: u64, fixed: impl Fn(&mut Rng) -> Hinge) -> Multibody {
    let mut r = Rng(seed);
    let mut b = Builder::new();
    let mut body = |r: &mut Rng, name: String, parent: String, hinge: Hinge| {
        let (X_PJ, X_BJ) = (r.pose(), r.pose());
        let spec = BodySpec::new(name, parent).hinge_in_parent(X_PJ).hinge_in_body(X_BJ);
        b.body(spec.hinge(hinge).mass(r.mass()));
    };
    body(&mut r, "craft".into(), "world".into(), Hinge::free());
    body(&mut r, "craft_arm".into(), "craft".into(), Hinge::pin(Vec3::new(0.3, -0.7, 0.5)));
    for (base, n) in [("craft", 9), ("craft_arm", 6)] {
        let mut names = vec![base.to_owned()];
        for k in 0..n {
            let parent = names[r.below(names.len())].clone();
            let (name, hinge) = (format!("{base}_{k}"), fixed(&mut r));
            body(&mut r, name.clone(), parent, hinge);
            names.push(name);
        }
    }
    b.build().unwrap()
}

/// With the bodies locked, and with each on a prescribed pin at rest.
fn both(seed: u64) -> [Multibody; 2] {
    let axis = |r: &mut Rng| r.vec3();
    [
        rig(seed, |r| {
            let _ = axis(r);
            Hinge::locked()
        }),
        rig(seed, |r| Hinge::pin(axis(r)).prescribed()),
    ]
}

struct Moving {
    tree: Tree,
    ws: Workspace,
    v: Vec<f64>,
}

/// Far from a planet's centre, spinning and swinging.
fn moving(mbs: &Multibody, seed: u64, height: f64, drift: f64) -> Moving {
    let mut r = Rng(seed ^ 0xa5);
    let (mut q, mut v) = (mbs.neutral_q(), vec![0.0; mbs.nv()]);
    let [craft, arm] = ["craft", "craft_arm"].map(|n| mbs.get(mbs.body(n).unwrap()).clone());
    let turn = r.quat();
    let place = r.vec3().normalize() * height;
    q[craft.q()].copy_from_slice(&[place.x, place.y, place.z, turn.i, turn.j, turn.k, turn.w]);
    q[arm.q()][0] = r.signed();
    for (k, at) in craft.v().enumerate() {
        v[at] = r.signed() * if k < 3 { 1.0 } else { drift };
    }
    v[arm.v()][0] = r.signed();
    let tree = Tree::new(mbs);
    let mut ws = Workspace::new(&tree);
    kinematics(&tree, &mut ws, &q, &v);
    Moving { tree, ws, v }
}

const GM: f64 = 4e12;
const OMEGA: [f64; 3] = [3e-3, -2e-3, 5e-3];

/// A field around the origin, including the centrifugal part of rotating axes.
fn field(p: &Vec3) -> Vec3 {
    let omega = Vec3::from(OMEGA);
    -p * (GM / p.norm().powi(3)) - omega.cross(&omega.cross(p))
}

fn scale(p: &Vec3) -> f64 {
    0.5 * p.norm()
}

/// Returns accelerations of vehicle and arm, and of every body, under gravity, Coriolis forces and wrenches.
fn accelerations(m: &mut Moving, smooth: bool) -> (Vec<f64>, Vec<f64>) {
    let nv = m.tree.nv();
    let (mut tau, mut vdot) = (vec![0.0; nv], vec![0.0; nv]);
    m.ws.clear_forces();
    if smooth {
        m.ws.apply_smooth_gravity(&m.tree, &scale, &mut |p| field(p));
    } else {
        m.ws.apply_gravity(&m.tree, &mut |p| field(p));
    }
    m.ws.apply_coriolis(&m.tree, &Vec3::from(OMEGA));
    let mut r = Rng(17);
    for b in m.tree.multibody().body_ids() {
        m.ws.add_wrench_at_body(&m.tree, b, Force::new(r.vec3(), r.vec3()));
    }
    forward_dynamics_given_kinematics(&m.tree, &mut m.ws, &mut tau, &mut vdot).unwrap();
    let mbs = m.tree.multibody();
    let free = ["craft", "craft_arm"].map(|n| mbs.get(mbs.body(n).unwrap()).v());
    let of_bodies = mbs.body_ids().flat_map(|b| {
        let a = m.ws.body_acceleration(&m.tree, b);
        [a.angular, a.linear].map(|v| [v.x, v.y, v.z])
    });
    (free.into_iter().flatten().map(|i| vdot[i]).collect(), of_bodies.flatten().collect())
}

#[test]
fn what_is_locked_moves_as_what_is_held_at_rest() {
    for seed in 0..30 {
        let [locked, held] = both(seed);
        assert!(locked.nv() == 7 && held.nv() == 7 + 15);
        let [mut a, mut b] = [moving(&locked, seed, 1e6, 1.0), moving(&held, seed, 1e6, 1.0)];
        let (ours, theirs) = (accelerations(&mut a, true), accelerations(&mut b, false));
        close(&ours.0, &theirs.0, 2e-12, &format!("seed {seed}, free coordinates"));
        close(&ours.1, &theirs.1, 2e-12, &format!("seed {seed}, bodies"));
    }
}

fn wrench(m: &mut Moving, scale: f64) -> [Force; 2] {
    m.ws.clear_forces();
    m.ws.apply_smooth_gravity(&m.tree, &|_| scale, &mut |p| field(p));
    let mbs = m.tree.multibody();
    ["craft", "craft_arm"].map(|n| m.ws.external_wrench(&m.tree, mbs.body(n).unwrap()))
}

/// If the field varies within the size of the vehicle, or its scale is unknown, gravity is evaluated at each body.
#[test]
fn only_small_things_are_asked_for_as_a_whole() {
    let [locked, _] = both(3);
    let mut m = moving(&locked, 3, 1e6, 1.0);
    let each = wrench(&mut m, 0.0);
    assert_eq!(wrench(&mut m, 1e3), each, "a craft of 1 m where the field changes in 1 km");
    let whole = wrench(&mut m, 5e5);
    assert!(whole != each);
    let mut asked = 0;
    m.ws.apply_smooth_gravity(&m.tree, &scale, &mut |p| {
        asked += 1;
        field(p)
    });
    assert_eq!(asked, 8, "four points of each of two links");
    for (a, b) in whole.iter().zip(&each) {
        assert!((a.force - b.force).norm() < 1e-13 * b.force.norm());
        assert!((a.moment - b.moment).norm() < 1e-12 * b.moment.norm());
    }
}

/// The work of gravity equals the loss of potential energy of all bodies as points, including the rotation of the vehicle due to the gradient of the
/// field, which is the only motion here.
#[test]
fn gravity_of_a_whole_is_the_gradient_of_the_energy_of_its_bodies() {
    for seed in 0..10 {
        let [locked, _] = both(seed);
        let mut m = moving(&locked, seed, 3e5, 0.0);
        let pull = |p: &Vec3| -p * (GM / p.norm().powi(3));
        m.ws.clear_forces();
        m.ws.apply_smooth_gravity(&m.tree, &scale, &mut |p| pull(p));
        let mbs = m.tree.multibody().clone();
        let mut power = 0.0;
        for name in ["craft", "craft_arm"] {
            let b = mbs.body(name).unwrap();
            let (F, V) = (m.ws.external_wrench(&m.tree, b), m.ws.body_velocity(&m.tree, b));
            power += F.moment.dot(&V.angular) + F.force.dot(&V.linear);
        }
        // The power is Σ m μ v·∇(1/r), with the velocity of each body's own centre of mass.
        let mut want = 0.0;
        for b in mbs.body_ids() {
            let (V, R) = (m.ws.body_velocity(&m.tree, b), m.ws.body_rotation(&m.tree, b));
            let inertia = mbs.get(b).inertia();
            let v = V.linear + V.angular.cross(&(R * inertia.com()));
            want += inertia.mass() * pull(&m.ws.body_com(&m.tree, b)).dot(&v);
        }
        // The gradient of the field contributes 1e-3 of the power. The four points differ from the bodies in the next
        // order only.
        assert!((power - want).abs() < 5e-10 * want.abs(), "seed {seed}: {power} {want}");
        assert!(m.v.iter().any(|v| *v != 0.0));
    }
}

/// After any change of mass, the result equals that of a mechanism with this mass, independent of earlier values and of which bodies vary.
#[test]
fn changes_of_mass_leave_no_trace() {
    for seed in 0..10 {
        let [locked, _] = both(seed);
        let names = ["craft_2", "craft_arm_4", "craft_5"];
        let ids: Vec<BodyId> = names.iter().map(|n| locked.body(n).unwrap()).collect();
        let mut r = Rng(seed + 900);
        let mut inertia = || {
            let m = r.mass();
            RigidInertia::from_moments(m.mass, Vec3::zeros(), m.inertia_com).unwrap()
        };
        let (old, new) = (inertia(), [inertia(), inertia(), inertia()]);
        let mut other = locked.clone();
        (ids.iter().zip(&new)).for_each(|(b, i)| other.set_inertia(*b, *i));
        let mut want = moving(&other, seed, 1e6, 1.0);
        let want = accelerations(&mut want, true);
        for varying in [vec![], ids.clone(), vec![ids[0]]] {
            let mut m = moving(&locked, seed, 1e6, 1.0);
            m.tree.vary(&varying);
            let mut once = moving(&locked, seed, 1e6, 1.0);
            once.tree.vary(&varying);
            for b in &ids {
                m.tree.set_inertia(*b, old).unwrap();
            }
            for (b, i) in ids.iter().zip(&new) {
                m.tree.set_inertia(*b, *i).unwrap();
            }
            for (b, i) in ids.iter().zip(&new).rev() {
                once.tree.set_inertia(*b, *i).unwrap();
            }
            let (a, b) = (accelerations(&mut m, true), accelerations(&mut once, true));
            assert_eq!(a, b, "seed {seed}: the order of changes");
            close(&a.0, &want.0, 1e-12, &format!("seed {seed}"));
            close(&a.1, &want.1, 1e-12, &format!("seed {seed}"));
        }
    }
}

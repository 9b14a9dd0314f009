//! Closed loops through flexible bodies: the solver's results compared with node accelerations, and with the plain tree with the constraint forces as
//! wrenches; a truss of beams at rest.

use crate::dynamics_support::{Rng, Shape, close, random_tree};
use linkwork_dynamics::multibody::modes::{Attachment, Beam, BeamModes, Modes, Station};
use linkwork_dynamics::multibody::{
    BodySpec, Builder, Coordinate, Coupling, Hinge, HingeCoordinate, LoopClosure, LoopRow,
    Multibody,
};
use linkwork_dynamics::spatial::{Force, Pose, Vec3};
use linkwork_dynamics::units::{RowSet, Units, UnitsWork};
use linkwork_dynamics::{
    Compliance, Tree, Workspace, forward_dynamics, forward_dynamics_given_kinematics, kinematics,
};
use linkwork_solvers::{ConstrainedSolver, ConstraintMethod, Projector};

fn modes(r: &mut Rng) -> Modes {
    let station = |r: &mut Rng| Station {
        pose: r.pose(),
        mass: r.mass(),
        translation: vec![r.vec3() * 0.3, r.vec3() * 0.2],
        rotation: vec![r.vec3() * 0.4, r.vec3() * 0.3],
        shortening: None,
    };
    Modes {
        stiffness: vec![4.0, 0.3, 0.3, 7.0],
        damping: vec![0.2, 0.1],
        stations: vec![station(r), station(r), station(r)],
        attachment: Attachment::Nearest { tolerance: 10.0 },
    }
}

/// A random tree in which every second body bends, two ball loops and a gear; loops close where η = 0.
fn machine(seed: u64) -> (Multibody, Vec<f64>) {
    let shape = Shape {
        bodies: 8,
        floating: seed.is_multiple_of(2),
        prescribed: seed.is_multiple_of(3),
        armature: true,
    };
    let mut r = Rng(seed ^ 0x77);
    let mut b = Builder::from(&random_tree(seed, shape));
    for (i, body) in b.bodies_mut().iter_mut().enumerate() {
        if (i + seed as usize).is_multiple_of(2) {
            body.modes = Some(modes(&mut r));
        }
    }
    let tree = b.build().unwrap();
    let mut q = tree.random_q(seed);
    tree.bodies().iter().for_each(|b| q[b.modes_q()].fill(0.0));
    let poses = tree.body_poses(&q);
    for (k, (i, j)) in [(2, 6), (4, 7)].into_iter().enumerate() {
        let frame_a = r.pose();
        let frame_b = poses[j].inverse() * poses[i] * frame_a;
        let name = |i: usize| tree.bodies()[i].name().to_owned();
        b.node(format!("a{k}"), name(i), frame_a);
        b.node(format!("b{k}"), name(j), frame_b);
        b.loop_closure(LoopClosure {
            name: format!("loop{k}"),
            body_a: name(i),
            frame_a,
            body_b: name(j),
            frame_b,
            hinge: Hinge::ball(),
        });
    }
    let mut single = Vec::new();
    for body in tree.bodies() {
        for (i, s) in body.subhinges().iter().enumerate().filter(|(_, s)| s.v.len() == 1) {
            if s.subhinge.coordinate == Coordinate::Free {
                single.push(HingeCoordinate { body: body.name().into(), subhinge: i });
            }
        }
    }
    if let [first, .., last] = &single[..] {
        b.coupling(Coupling::mimic("gear", first.clone(), last.clone(), 0.6, 0.0));
    }
    (b.build().unwrap(), q)
}

#[test]
fn loops_through_flexible_bodies_hold_and_their_forces_do_the_same_on_the_tree() {
    for seed in 0..24 {
        let (mbs, q) = machine(seed);
        let tree = Tree::new(&mbs);
        let (nv, mut ws) = (mbs.nv(), Workspace::new(&tree));
        let mut v = mbs.random_v(seed);
        // Embedding is requested, but paths with modes become rows.
        let mut solver = ConstrainedSolver::new(&tree, |_| ConstraintMethod::Embed);
        assert!(!solver.units().augmented().is_empty());
        Projector::new(&tree).rates(&tree, &mut ws, &mut solver, &[], &q, &mut v).unwrap();
        ws.clear_forces();
        ws.apply_uniform_gravity(Vec3::new(0.3, -0.7, -9.0));
        let given = Rng(seed + 3).vec(nv);
        let (mut tau, mut vdot) = (given.clone(), given.clone());
        let report = solver.forward(&tree, &mut ws, (&q, &v), &[], &mut tau, &mut vdot).unwrap();
        assert!(report.rate < 1e-9 && report.contradiction < 1e-7, "seed {seed}: {report:?}");
        let mut wrenches = Vec::new();
        for (k, id) in mbs.constraints().take(2).enumerate() {
            let at = |n: &str| mbs.node(&format!("{n}{k}")).unwrap();
            let (A, B) =
                (ws.node_acceleration(&tree, at("a")), ws.node_acceleration(&tree, at("b")));
            let off = (A.linear - B.linear).norm();
            assert!(off < 1e-8 * (1.0 + A.linear.norm()), "seed {seed}, loop {k}: {off:e}");
            let R = ws.node_rotation(&tree, at("a"));
            let mut f = Vec3::zeros();
            for (row, x) in mbs.loops()[k].rows.iter().zip(solver.forces(&tree, id)) {
                let LoopRow::Slide { axis, .. } = row else { panic!("a ball only slides") };
                f += R * axis * *x;
            }
            wrenches.push((at("a"), -f));
            wrenches.push((at("b"), f));
        }
        // The gear's force acts on its two coordinates.
        let mut applied = given.clone();
        if let Some((id, c)) = mbs.constraints().nth(2).zip(mbs.couplings().first()) {
            for (_, iv, factor) in &c.terms {
                applied[*iv] += factor * solver.forces(&tree, id)[0];
            }
        }
        kinematics(&tree, &mut ws, &q, &v);
        for (node, f) in wrenches {
            ws.add_wrench_at_node(&tree, node, Force::new(Vec3::zeros(), f));
        }
        let mut plain = given.clone();
        forward_dynamics_given_kinematics(&tree, &mut ws, &mut applied, &mut plain).unwrap();
        // Measured: 2e-11.
        close(&plain, &vdot, 1e-8, &format!("seed {seed}"));
        for i in (0..nv).filter(|i| mbs.prescribed()[*i]) {
            assert!(
                (applied[i] - tau[i]).abs() < 1e-7 * (1.0 + tau[i].abs()),
                "seed {seed}, T {i}"
            );
        }
    }
}

#[test]
fn a_contact_on_a_flexible_body_moves_with_the_nearest_station() {
    for seed in 0..12 {
        let (mbs, q) = machine(seed);
        let mut q = q;
        mbs.bodies().iter().for_each(|b| q[b.modes_q()].fill(0.2));
        let tree = Tree::new(&mbs);
        let mut ws = Workspace::new(&tree);
        let (v, nv) = (mbs.random_v(seed), mbs.nv());
        kinematics(&tree, &mut ws, &q, &v);
        let units = Units::new(&tree, |_| ConstraintMethod::Augment);
        let mut uw = UnitsWork::new(&tree, &units);
        let zero = vec![0.0; nv];
        units.gather(&tree, &mut ws, &mut uw, &zero, &zero, &[]).unwrap();
        for id in mbs.body_ids().filter(|b| mbs.get(*b).modes().is_some()) {
            // Add a node at each station of the body, and check its velocity and compliance.
            for s in &mbs.get(id).modes().unwrap().stations {
                let mut b = Builder::from(&mbs);
                b.node("at", mbs.get(id).name(), s.pose);
                let with = b.build().unwrap();
                let (node, other) = (with.node("at").unwrap(), Tree::new(&with));
                let mut ws2 = Workspace::new(&other);
                kinematics(&other, &mut ws2, &q, &v);
                let point = ws2.node_pose(&other, node).position;
                let axes = [Vec3::x(), Vec3::new(0.6, 0.0, 0.8)];
                let mut rows = RowSet::default();
                rows.clear();
                rows.add_point(&tree, &units, &ws, &uw, (None, Some(id)), &point, &axes);
                let V = ws2.node_velocity(&other, node).linear;
                close(&rows.groups()[0].rate[..2], &axes.map(|n| n.dot(&V)), 1e-11, "rate");
                let mut L = vec![0.0; 36];
                Compliance::new(&other, &[node]).compute(&other, &mut ws2, &mut L).unwrap();
                let entry = |a: Vec3, b: Vec3| -> f64 {
                    (0..9).map(|k| a[k / 3] * L[(3 + k / 3) * 6 + 3 + k % 3] * b[k % 3]).sum()
                };
                let W = rows.block(0, 0);
                let want =
                    [entry(axes[0], axes[0]), entry(axes[0], axes[1]), entry(axes[1], axes[1])];
                close(&[W[0][0], W[0][1], W[1][1]], &want, 1e-9, &format!("seed {seed}"));
            }
        }
    }
}

#[test]
fn a_truss_of_two_beams_carries_its_load() {
    // Two rods are pinned to the world and to a common tip. They only stretch, with F / (2 cos φ)
    // each.
    let beam = Beam::tube(1.0, 0.02, 0.018, 7e10, 0.3, 2700.0);
    let count = BeamModes { stretch: 8, ..BeamModes::default() };
    let mut b = Builder::new();
    for (name, x, turn) in
        [("left", 0.0, 1.0_f64), ("right", 2.0 * 1.0_f64.cos(), std::f64::consts::PI - 1.0)]
    {
        let place = Pose::new(
            linkwork_dynamics::spatial::Quat::from_axis_angle(&Vec3::z_axis(), turn),
            Vec3::new(x, 0.0, 0.0),
        );
        b.body(
            BodySpec::new(name, "world")
                .hinge_in_parent(place)
                .hinge(Hinge::pin(Vec3::z()))
                .modes(beam.modes(count).unwrap()),
        );
    }
    let tip = Pose::translation(1.0, 0.0, 0.0);
    b.node("tip", "left", tip);
    b.loop_closure(LoopClosure {
        name: "joint".into(),
        body_a: "left".into(),
        frame_a: tip,
        body_b: "right".into(),
        frame_b: tip,
        hinge: Hinge::ball(),
    });
    let mbs = b.build().unwrap();
    let (tree, nv) = (Tree::new(&mbs), mbs.nv());
    let (mut ws, mut solver) =
        (Workspace::new(&tree), ConstrainedSolver::new(&tree, |_| ConstraintMethod::Auto));
    // Each rod stretches under its share of the load: η = φ(tip) N / k.
    let F = 1000.0;
    let N = F / (2.0 * 1.0_f64.sin());
    let modes = mbs.bodies()[0].modes().unwrap();
    let last = modes.stations.last().unwrap();
    let eta: Vec<f64> = (0..8).map(|i| last.translation[i].x * N / modes.stiffness[i]).collect();
    let mut q = vec![0.0; mbs.nq()];
    mbs.bodies().iter().for_each(|b| q[b.modes_q()].copy_from_slice(&eta));
    let longer: f64 = eta.iter().zip(&last.translation).map(|(x, t)| x * t.x).sum();
    // Rotate both so that the tips meet again: 1.0 cos 1 = (1 + longer) cos(1 + turn).
    let turn = (1.0_f64.cos() / (1.0 + longer)).acos() - 1.0;
    (q[mbs.bodies()[0].q().start], q[mbs.bodies()[1].q().start]) = (turn, -turn);
    let v = vec![0.0; nv];
    kinematics(&tree, &mut ws, &q, &v);
    let up = Force::new(Vec3::zeros(), Vec3::y() * F);
    ws.add_wrench_at_node(&tree, mbs.node("tip").unwrap(), up);
    let (mut tau, mut vdot) = (vec![0.0; nv], vec![0.0; nv]);
    let report = solver
        .forward_given_kinematics(&tree, &mut ws, (&q, &v), &[], &mut tau, &mut vdot)
        .unwrap();
    assert!(report.error < 1e-12, "{report:?}");
    // The truss is in equilibrium to first order in the stretch (4e-5): the accelerations of an unloaded start are 1e5
    // times larger.
    let greatest = |a: &[f64]| {
        a.iter().fold(0.0, |m: f64, x| if x.is_nan() { f64::INFINITY } else { m.max(x.abs()) })
    };
    let held = greatest(&vdot);
    let still = vec![0.0; mbs.nq()];
    let (mut tau, mut vdot) = (vec![0.0; nv], vec![0.0; nv]);
    kinematics(&tree, &mut ws, &still, &v);
    ws.clear_forces();
    ws.add_wrench_at_node(&tree, mbs.node("tip").unwrap(), up);
    solver
        .forward_given_kinematics(&tree, &mut ws, (&still, &v), &[], &mut tau, &mut vdot)
        .unwrap();
    assert!(held < 1e-4 * greatest(&vdot), "{held} of {}", greatest(&vdot));
    let length = F / (2.0 * 1.0_f64.sin()) / (beam.young * beam.area);
    // The modes from the ninth on would contribute Σ 2/(π² (k − ½)²) = 2.5 % of N L / E A.
    assert!((longer / length - 0.9747).abs() < 1e-3, "{}", longer / length);
    let mut free = vec![0.0; nv];
    forward_dynamics(&tree, &mut ws, &still, &v, &mut tau, &mut free).unwrap();
    assert!((free[0] - vdot[0]).abs() > 1.0, "without the joint they part");
}

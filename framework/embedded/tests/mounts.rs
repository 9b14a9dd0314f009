//! Objects attached to objects: they move with them, add to their load, and ignore collisions with them and their neighbours; after detaching,
//! everything is as before.

use crate::support::*;

use linkwork_collision::{ColliderSpec, Shape};
use linkwork_embedded::dynamics::{Tree, Workspace, inverse_dynamics, mass_matrix};
use linkwork_embedded::multibody::{BodySpec, Builder, Hinge, Limits, Multibody};
use linkwork_embedded::spatial::{Pose, Vec3};
use linkwork_embedded::*;
use std::sync::Arc;

/// Poses: the tool in the hand, the brick on the tool's blade, the chip on the brick.
struct Places {
    tool: Pose,
    brick: Pose,
    chip: Pose,
}

/// An arm of three joints; a tool with a blade on a pin and a slider on the blade; a brick and a chip. Also the mechanism in which the tool is welded
/// to the hand, the brick to the blade and the chip to the brick.
fn both() -> (Arc<RobotModel>, Multibody, Places) {
    let mut rng = Rng(11);
    let at = Places { tool: place(&mut rng), brick: place(&mut rng), chip: place(&mut rng) };
    let mut mechanism = Builder::new();
    let mut parent = "world";
    for (k, name) in ["a1", "a2", "hand"].into_iter().enumerate() {
        let hinge = Hinge::pin(Vec3::ith(k, 1.0)).limits(Limits::position(-2.0, 2.0));
        let body = BodySpec::new(name, parent).hinge(hinge).hinge_in_parent(place(&mut rng));
        mechanism.body(body.mass(mass(&mut rng, 2.0)));
        parent = name;
    }
    let [tool, brick, chip] = [0.7, 0.5, 0.2].map(|m| mass(&mut rng, m));
    let mut one = |name: &str, parent: &str, hinge: Hinge| {
        let body = BodySpec::new(name, parent).hinge(hinge).hinge_in_parent(place(&mut rng));
        body.hinge_in_body(place(&mut rng)).mass(mass(&mut rng, 0.4))
    };
    let links = [
        one("blade", "tool", Hinge::pin(Vec3::new(0.6, 0.0, 0.8))),
        one("slide", "blade", Hinge::slider(Vec3::y())),
    ];
    let mut whole = mechanism.clone();
    whole.body(BodySpec::new("tool", "hand").hinge_in_parent(at.tool).mass(tool));
    let mut linkages = Builder::new();
    for b in links {
        whole.body(b.clone());
        linkages.body(b);
    }
    whole.body(BodySpec::new("brick", "blade").hinge_in_parent(at.brick).mass(brick));
    whole.body(BodySpec::new("chip", "brick").hinge_in_parent(at.chip).mass(chip));
    let ball = |name: &str, on: &str| ColliderSpec::new(name, on, Shape::Sphere { radius: 0.02 });
    let spec = ModelSpec {
        mechanism,
        linkages,
        objects: [("chip", chip), ("brick", brick), ("tool", tool)]
            .map(|(name, mass)| ObjectSpec { name: name.into(), mass })
            .to_vec(),
        parts: vec![
            PartSpec::chain("arm", "world", "hand"),
            PartSpec::chain("fore", "world", "a2"),
        ],
        colliders: ["a1", "a2", "hand", "tool", "blade", "slide", "brick", "chip", "world"]
            .map(|on| ball(&format!("ball of {on}"), on))
            .to_vec(),
        ..ModelSpec::default()
    };
    (RobotModel::new(&spec).unwrap(), whole.build().unwrap(), at)
}

struct Things {
    arm: Part,
    chip: Object,
    brick: Object,
    tool: Object,
    blade: linkwork_embedded::multibody::BodyId,
}

fn things(model: &RobotModel) -> Things {
    let [chip, brick, tool] = ["chip", "brick", "tool"].map(|o| model.object(o).unwrap());
    let blade = model.object_body(tool, "blade").unwrap();
    Things { arm: model.part("arm").unwrap(), chip, brick, tool, blade }
}

/// All results that could depend on earlier attachments, as bits.
fn traces(robot: &mut Robot, model: &RobotModel) -> Vec<u64> {
    let (nv, q) = (model.nv(), robot.q().to_vec());
    let (v, mut tau, mut M) = (vec![0.3; nv], vec![0.0; nv], vec![0.0; nv * nv]);
    robot.feed_forward(&v, &v, &[], &mut tau).unwrap();
    robot.mass_matrix(&mut M).unwrap();
    let mut all = Vec::new();
    robot.distances(&q, f64::INFINITY, &mut all).unwrap();
    let mut out: Vec<f64> = tau.into_iter().chain(M).collect();
    for c in all {
        out.extend([c.a.index() as f64, c.b.index() as f64, c.distance.distance]);
    }
    out.into_iter().map(f64::to_bits).collect()
}

#[test]
fn what_is_attached_goes_along_and_loads_what_it_is_attached_to() {
    let (model, whole, at) = both();
    let Things { arm, chip, brick, tool, blade } = things(&model);
    let tree = Tree::new(&whole);
    let mut robot = Robot::new(&model);
    let mut rng = Rng(5);
    // Attach in an order in which each object's carrier is attached later.
    robot.attach(chip, brick, None, Grasp::At(at.chip)).unwrap();
    robot.attach(brick, tool, Some(blade), Grasp::At(at.brick)).unwrap();
    robot.grasp(arm, tool, Grasp::At(at.tool)).unwrap();
    let mount = Mount { on: tool, body: Some(blade), pose: at.brick };
    assert_eq!(robot.mount(brick).unwrap(), Some(mount));
    let nv = model.nv();
    for k in 0..20 {
        // The coordinates are the arm's three and then the tool's two, as in the whole mechanism.
        let mut numbers = |_| (0..5).map(|_| rng.within(-1.0, 1.0)).collect::<Vec<f64>>();
        let [q, v, vdot] = [0, 1, 2].map(&mut numbers);
        robot.set_q(&q[..nv]).unwrap();
        robot.set_object_q(tool, &q[nv..]).unwrap();
        // A clone must have its own copies of everything.
        let mut robot = if k % 2 == 0 { robot.clone() } else { robot.clone().clone() };
        let mut ws = Workspace::new(&tree);
        ws.apply_uniform_gravity(Vec3::new(0.0, 0.0, -9.81));
        let mut theirs = vec![0.0; 5];
        inverse_dynamics(&tree, &mut ws, &q, &v, &vdot, &mut theirs);
        for (object, name) in [(chip, "chip"), (brick, "brick"), (tool, "tool")] {
            let there = ws.body_pose(&tree, whole.body(name).unwrap());
            let (p, R) = apart(&robot.object_pose(object).unwrap(), &there);
            assert!(p < 1e-14 && R < 1e-7, "{name}: {p:e} {R:e}");
        }
        let (mut tau, mut forces) = (vec![0.0; nv], vec![0.0; 2]);
        let (rv, ra) = ((&v[..nv], &vdot[..nv]), (&v[nv..], &vdot[nv..]));
        robot.feed_forward_with_object(rv, tool, ra, &[], &mut tau, &mut forces).unwrap();
        let ours = [&tau[..], &forces].concat();
        assert!(difference(&ours, &theirs) < 1e-12, "{ours:?} {theirs:?}");
        let (mut M, mut M_whole) = (vec![0.0; 25], vec![0.0; 25]);
        robot.mass_matrix_with_object(tool, &mut M).unwrap();
        mass_matrix(&tree, &mut ws, &mut M_whole);
        assert!(difference(&M, &M_whole) < 1e-12, "{k}");
    }
    // A new pose of the tool in the hand moves all attached objects.
    let before = robot.object_pose(chip).unwrap();
    let moved = at.tool * Pose::translation(0.0, 0.1, 0.0);
    let X_WT = robot.tip_pose(arm).unwrap();
    robot.update_grasp(arm, tool, moved).unwrap();
    let wanted = X_WT * moved * at.tool.inverse() * X_WT.inverse() * before;
    let (p, R) = apart(&robot.object_pose(chip).unwrap(), &wanted);
    assert!(p < 1e-14 && R < 1e-7, "{p:e} {R:e}");
}

#[test]
fn what_was_attached_leaves_no_trace() {
    let (model, _, at) = both();
    let Things { arm, chip, brick, tool, blade } = things(&model);
    let mut robot = Robot::new(&model);
    robot.set_q(&[0.3, -0.5, 0.7]).unwrap();
    robot.put(chip, Pose::translation(0.4, 0.5, 0.6)).unwrap();
    robot.put(brick, Pose::translation(-0.4, 0.5, 0.6)).unwrap();
    robot.put(tool, Pose::translation(-0.4, -0.5, 0.6)).unwrap();
    robot.set_object_q(tool, &[0.4, 0.01]).unwrap();
    let bare = traces(&mut robot, &model);
    robot.grasp(arm, tool, Grasp::At(at.tool)).unwrap();
    let held = traces(&mut robot, &model);
    assert_ne!(bare, held);
    for _ in 0..1000 {
        robot.attach(brick, tool, Some(blade), Grasp::At(at.brick)).unwrap();
        robot.attach(chip, brick, None, Grasp::At(at.chip)).unwrap();
        robot.detach(brick).unwrap();
        robot.detach(chip).unwrap();
        robot.put(chip, Pose::translation(0.4, 0.5, 0.6)).unwrap();
        robot.put(brick, Pose::translation(-0.4, 0.5, 0.6)).unwrap();
    }
    assert_eq!(traces(&mut robot, &model), held);
    robot.ungrasp(tool).unwrap();
    robot.put(tool, Pose::translation(-0.4, -0.5, 0.6)).unwrap();
    assert_eq!(traces(&mut robot, &model), bare);
    // A detached object stays where it is, and an object on an object in the world moves with it.
    robot.attach(brick, tool, Some(blade), Grasp::Here).unwrap();
    let there = robot.object_pose(brick).unwrap();
    assert!(apart(&there, &Pose::translation(-0.4, 0.5, 0.6)).0 < 1e-15);
    robot.set_object_q(tool, &[0.9, 0.01]).unwrap();
    let gone = robot.object_pose(brick).unwrap();
    assert!(apart(&there, &gone).0 > 0.1, "it goes with the blade");
    robot.detach(brick).unwrap();
    robot.set_object_q(tool, &[0.4, 0.01]).unwrap();
    assert_eq!(robot.object_pose(brick).unwrap(), gone);
}

/// Checked pairs: parts of one rigid piece are ignored, and so are bodies that a hinge joins to it; other pairs are unchanged.
#[test]
fn what_is_attached_does_not_meet_what_carries_it() {
    let (model, _, at) = both();
    let Things { arm, chip, brick, tool, blade } = things(&model);
    let mut robot = Robot::new(&model);
    let id = |on: &str| model.collider(&format!("ball of {on}")).unwrap();
    let pairs = |robot: &Robot| {
        let names = ["a1", "a2", "hand", "tool", "blade", "slide", "brick", "chip", "world"];
        let mut out = Vec::new();
        for (i, a) in names.iter().enumerate() {
            for b in &names[i + 1..] {
                if robot.looks_at(id(a), id(b)).unwrap() {
                    out.push(format!("{a} {b}"));
                }
            }
        }
        out
    };
    let free = pairs(&robot);
    let gone = |now: Vec<String>| {
        assert!(now.iter().all(|p| free.contains(p)), "{now:?}");
        free.iter().filter(|p| !now.contains(p)).cloned().collect::<Vec<_>>()
    };
    // The brick on the blade ignores the blade, and also the tool and the slider, which hinges connect to the blade.
    // The chip on the brick ignores the same bodies and the brick.
    robot.attach(brick, tool, Some(blade), Grasp::At(at.brick)).unwrap();
    assert_eq!(gone(pairs(&robot)), ["tool brick", "blade brick", "slide brick"]);
    robot.attach(chip, brick, None, Grasp::At(at.chip)).unwrap();
    let all = [
        "tool brick",
        "tool chip",
        "blade brick",
        "blade chip",
        "slide brick",
        "slide chip",
        "brick chip",
    ];
    assert_eq!(gone(pairs(&robot)), all);
    // The tool in the hand is rigid with it, so both ignore the same bodies. The blade and the objects on it are
    // connected to it, so the hand ignores them, too.
    robot.grasp(arm, tool, Grasp::At(at.tool)).unwrap();
    let held = gone(pairs(&robot));
    let more: Vec<&String> = held.iter().filter(|p| !all.contains(&p.as_str())).collect();
    assert_eq!(more, ["a2 tool", "hand tool", "hand blade", "hand brick", "hand chip"]);
    // The order of grasping and attaching does not matter.
    let mut other = Robot::new(&model);
    other.grasp(arm, tool, Grasp::At(at.tool)).unwrap();
    other.attach(chip, brick, None, Grasp::At(at.chip)).unwrap();
    other.attach(brick, tool, Some(blade), Grasp::At(at.brick)).unwrap();
    assert_eq!(gone(pairs(&other)), held);
    robot.detach(brick).unwrap();
    robot.ungrasp(tool).unwrap();
    assert_eq!(gone(pairs(&robot)), ["brick chip"]);
    robot.detach(chip).unwrap();
    assert!(gone(pairs(&robot)).is_empty());
}

/// Distances and swept paths equal those of the object placed there, and those of one held directly.
#[test]
fn collisions_are_where_it_is() {
    let (model, _, at) = both();
    let Things { arm, chip, brick, tool, blade } = things(&model);
    let id = |on: &str| model.collider(&format!("ball of {on}")).unwrap();
    let mut robot = Robot::new(&model);
    robot.set_object_q(tool, &[0.4, 0.02]).unwrap();
    robot.grasp(arm, tool, Grasp::At(at.tool)).unwrap();
    robot.attach(brick, tool, Some(blade), Grasp::At(at.brick)).unwrap();
    robot.attach(chip, brick, None, Grasp::At(at.chip)).unwrap();
    let mut other = Robot::new(&model);
    for k in 0..10 {
        let q = [0.1 * k as f64, -0.2 * k as f64, 0.15 * k as f64];
        robot.set_q(&q).unwrap();
        other.put(chip, robot.object_pose(chip).unwrap()).unwrap();
        let [ours, theirs] = [&mut robot, &mut other]
            .map(|r| r.distance(&q, id("chip"), id("a1")).unwrap().unwrap().distance);
        assert!((ours - theirs).abs() < 1e-14, "{ours} {theirs}");
    }
    // The sphere in the world finds the chip along a path exactly as if the hand held it directly.
    let (qa, qb, middle) = ([0.0; 3], [1.2, 0.0, 0.0], [0.6, 0.0, 0.0]);
    robot.set_q(&middle).unwrap();
    let X_TC = robot.tip_pose(arm).unwrap().inverse() * robot.object_pose(chip).unwrap();
    let mut direct = Robot::new(&model);
    direct.grasp(arm, chip, Grasp::At(X_TC)).unwrap();
    let told = [&mut robot, &mut direct].map(|r| {
        for on in ["a1", "a2", "hand", "tool", "blade", "slide", "brick"] {
            r.show(id(on), linkwork_collision::Visibility::Hidden).unwrap();
        }
        let apart = r.clearance(&middle, f64::INFINITY).unwrap().unwrap().distance.distance;
        assert_eq!(r.path_free(&middle, &middle, 1e-4).unwrap(), Path::Free);
        r.pad(id("chip"), apart + 1e-6).unwrap();
        let Path::Hit { at, pair } = r.path_free(&qa, &qb, 1e-4).unwrap() else { panic!() };
        assert!(pair == (id("chip"), id("world")), "{pair:?}");
        (at, apart)
    });
    assert!((told[0].1 - told[1].1).abs() < 1e-14 && told[0].0 == told[1].0, "{told:?}");
}

#[test]
fn mistakes_are_typed_and_change_nothing() {
    let (model, _, at) = both();
    let Things { arm, chip, brick, tool, blade } = things(&model);
    let mut robot = Robot::new(&model);
    robot.attach(chip, brick, None, Grasp::Here).unwrap();
    robot.attach(brick, tool, None, Grasp::Here).unwrap();
    let before = traces(&mut robot, &model);
    let on = |object: Object, on: Object| RobotError::Attached {
        object: object.index(),
        on: on.index(),
    };
    let here = Grasp::Here;
    assert_eq!(robot.attach(chip, tool, None, here), Err(on(chip, brick)));
    assert_eq!(robot.grasp(arm, chip, here), Err(on(chip, brick)));
    assert_eq!(robot.put(brick, Pose::identity()), Err(on(brick, tool)));
    let circle = robot.attach(tool, chip, None, here).unwrap_err();
    assert!(matches!(circle, RobotError::OutOfRange { .. }), "{circle}");
    let itself = robot.attach(tool, tool, Some(blade), here).unwrap_err();
    assert!(itself.to_string().contains("not attached to it"), "{itself}");
    let none = RobotError::NotAttached { object: tool.index() };
    assert_eq!(robot.detach(tool), Err(none));
    robot.detach(brick).unwrap();
    let rigid = robot.attach(tool, brick, Some(blade), here);
    assert_eq!(rigid, Err(RobotError::NoJoints { object: brick.index() }));
    let nan = Pose::translation(f64::NAN, 0.0, 0.0);
    assert!(matches!(
        robot.attach(brick, tool, None, Grasp::At(nan)),
        Err(RobotError::NotFinite { .. })
    ));
    robot.grasp(arm, tool, Grasp::At(at.tool)).unwrap();
    assert_eq!(
        robot.attach(tool, brick, None, here),
        Err(RobotError::Held { object: tool.index() })
    );
    robot.ungrasp(tool).unwrap();
    robot.put(tool, Pose::identity()).unwrap();
    robot.attach(brick, tool, None, Grasp::At(Pose::identity())).unwrap();
    assert_eq!(traces(&mut robot, &model), before);
}

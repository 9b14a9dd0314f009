//! The six tasks of the reference, step by step. After every step, everything that the step should not change is bit-identical, other instances are
//! unaffected, and after all objects are released the robot is as before.
//!
//! Each step names its changes. All other queries of a robot are compared: its numbers; for each part pose, Jacobian, forces at rest and in motion,
//! inertia; for each object its holder, pose, joints, and the shapes it touches; and hits and distances.

use crate::support::*;
use linkwork_embedded::multibody::{BodySpec, Hinge, Limits};
use linkwork_embedded::spatial::{MassProperties, Mat3, Pose, Vec3};
use linkwork_embedded::*;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// All results by name, as bits.
type Answers = BTreeMap<String, Vec<u64>>;

fn bits(x: &[f64]) -> Vec<u64> {
    x.iter().map(|x| x.to_bits()).collect()
}

fn bits_of(X: &Pose) -> Vec<u64> {
    bits(&[X.position.as_slice(), X.rotation.coords.as_slice()].concat())
}

/// Makes all queries of a robot on a copy, so that the robot is unchanged.
fn answers(robot: &Robot) -> Answers {
    let model = robot.model().clone();
    let (mut r, nv) = (robot.clone(), model.nv());
    let mut out = Answers::new();
    out.insert("q".into(), bits(r.q()));
    let v: Vec<f64> = (0..nv).map(|i| 0.3 - 0.1 * i as f64).collect();
    let [mut rest, mut moving] = [vec![0.0; nv], vec![0.0; nv]];
    let mut M = vec![0.0; nv * nv];
    r.gravity_forces(&mut rest).unwrap();
    r.feed_forward(&v, &v, &[], &mut moving).unwrap();
    r.mass_matrix(&mut M).unwrap();
    let M = &M;
    let mut left: BTreeSet<usize> = (0..nv).collect();
    let mut forces = |name: &str, dofs: &[usize], out: &mut Answers| {
        let pick = |x: &[f64]| dofs.iter().map(|i| x[*i]).collect::<Vec<f64>>();
        out.insert(format!("{name}: forces at rest"), bits(&pick(&rest)));
        out.insert(format!("{name}: forces in motion"), bits(&pick(&moving)));
        let block = dofs.iter().flat_map(|i| dofs.iter().map(move |j| M[i * nv + j]));
        out.insert(format!("{name}: inertia"), bits(&block.collect::<Vec<f64>>()));
        dofs.iter().for_each(|i| _ = left.remove(i));
    };
    for (part, name) in model.parts() {
        let Ok(dofs) = model.dofs(part) else { continue };
        forces(name, dofs, &mut out);
        out.insert(format!("{name}: tip"), bits_of(&r.tip_pose(part).unwrap()));
        let mut J = vec![0.0; 6 * dofs.len()];
        r.jacobian(part, &mut J).unwrap();
        out.insert(format!("{name}: Jacobian"), bits(&J));
    }
    // Joints outside of all parts, such as fingers, are listed by body.
    for body in model.multibody().bodies().iter().filter(|b| left.contains(&b.v().start)) {
        let both: Vec<f64> = body.v().flat_map(|i| [rest[i], moving[i]]).collect();
        out.insert(format!("{}: forces", body.name()), bits(&both));
    }
    for (object, name) in model.objects() {
        let pose = |p: (Part, Pose)| [vec![p.0.index() as u64], bits_of(&p.1)].concat();
        let hold = r.hold(object).unwrap();
        let hands = hold.map(|h| [pose(h.hand), h.second.map_or(vec![], pose)].concat());
        let on = |m: Mount| [vec![m.on.index() as u64], bits_of(&m.pose)].concat();
        out.insert(format!("{name}: on"), r.mount(object).unwrap().map_or(vec![], on));
        out.insert(format!("{name}: hands"), hands.unwrap_or_default());
        out.insert(format!("{name}: place"), bits_of(&r.object_pose(object).unwrap()));
        out.insert(format!("{name}: joints"), r.object_q(object).map_or(vec![], bits));
    }
    let mut met: BTreeMap<String, Vec<u64>> = BTreeMap::new();
    let ids: Vec<ColliderId> = model.colliders().map(|c| c.0).collect();
    for a in &ids {
        let on = model.collider_spec(*a).body.clone();
        let object = model.object(&on).is_some();
        let of = met.entry(if object { on } else { "robot and world".into() }).or_default();
        let looks = ids.iter().filter(|b| *b != a && (object || !on_object(&model, **b)));
        of.extend(looks.map(|b| u64::from(r.looks_at(*a, *b).unwrap())));
    }
    out.extend(met.into_iter().map(|(on, said)| (format!("{on}: pairs"), said)));
    let (q, mut apart) = (r.q().to_vec(), Vec::new());
    r.distances(&q, f64::INFINITY, &mut apart).unwrap();
    let mut near: BTreeMap<String, Vec<u64>> = BTreeMap::new();
    for c in &apart {
        let of =
            |id| Some(model.collider_spec(id).body.clone()).filter(|b| model.object(b).is_some());
        let name = of(c.a).or(of(c.b)).unwrap_or_else(|| "robot and world".into());
        let d = &c.distance;
        let x = [&[d.distance][..], d.point_a.as_slice(), d.point_b.as_slice()].concat();
        near.entry(name).or_default().extend(bits(&x));
    }
    out.extend(near.into_iter().map(|(on, d)| (format!("{on}: distances"), d)));
    out
}

fn on_object(model: &RobotModel, id: ColliderId) -> bool {
    model.object(&model.collider_spec(id).body).is_some()
}

/// A running task.
struct Scene {
    json: Value,
    model: Arc<RobotModel>,
    places: Vec<(usize, usize)>,
    robot: Robot,
    /// The state before the first step, and its results.
    start: Vec<f64>,
    first: Answers,
}

impl Scene {
    /// Starts the task at its configuration `q`, with the joints of the parts `moving` at zero.
    fn new(
        name: &str,
        q: &str,
        moving: &[&str],
        change: impl Fn(&Value, &mut ModelSpec),
    ) -> Option<Self> {
        let json = reference("robodarts/tasks.json")?["tasks"][name].clone();
        let dual = json["robot"] == "dual_ur5.urdf";
        let d =
            formats::read_file(file(&format!("robodarts/{}", json["robot"].as_str()?)), &options());
        let d = d.unwrap();
        let mut spec = ModelSpec::from_description(&d).unwrap();
        if dual {
            let srdf = formats::read_srdf(DUAL, &formats::ReadOptions::default()).unwrap();
            spec = spec.groups(&srdf, &d).unwrap();
            let scene_file = reference("robodarts/dual_ur5_collisions.json")?;
            (spec.colliders, spec.rules) = scene(&scene_file);
        } else {
            spec.parts = vec![PartSpec::chain("arm", "world", "tcp")];
            let ball = |body: &str| ColliderSpec::new(body, body, Shape::Sphere { radius: 0.05 });
            spec.colliders = ["lbr_iiwa_link_4", "lbr_iiwa_link_7", "tcp"].map(ball).to_vec();
        }
        change(&json["bodies"], &mut spec);
        let model = RobotModel::new(&spec).unwrap();
        let places = places(&model, &names(&json["dof"]));
        let mut start = to_q(&model, &places, &numbers(&json["expect"][q]));
        for dof in moving.iter().flat_map(|p| model.dofs(model.part(p).unwrap()).unwrap()) {
            // Each degree of freedom has one coordinate in q here.
            start[*dof] = 0.0;
        }
        assert_eq!(model.nq(), model.nv());
        let mut robot = Robot::new(&model);
        robot.set_q(&start).unwrap();
        let first = answers(&robot);
        Some(Self { json, model, places, robot, start, first })
    }

    fn q(&self, key: &str) -> Vec<f64> {
        to_q(&self.model, &self.places, &numbers(&self.json["expect"][key]))
    }

    fn part(&self, name: &str) -> Part {
        self.model.part(name).unwrap()
    }

    fn object(&self, name: &str) -> Object {
        self.model.object(name).unwrap()
    }

    fn collider(&self, name: &str) -> ColliderId {
        self.model.collider(name).unwrap()
    }

    /// Makes one step, which changes the named results (a prefix stands for all names that start with it) and nothing else. Names after `~` may
    /// change by round-off, because a pose is now computed from another body.
    fn step(&mut self, what: &str, changes: &[&str], step: impl FnOnce(&mut Robot)) {
        let before = answers(&self.robot);
        let twin = self.robot.clone();
        step(&mut self.robot);
        let after = answers(&self.robot);
        assert_eq!(answers(&twin), before, "{what}: an instance made before it has noticed it");
        let named = |k: &str| changes.iter().any(|c| k.starts_with(c.trim_start_matches('~')));
        let changed: Vec<&String> =
            after.keys().filter(|k| before.get(*k) != after.get(*k)).collect();
        let unasked: Vec<_> = changed.iter().filter(|k| !named(k)).collect();
        assert!(unasked.is_empty(), "{what} changed {unasked:?}");
        for c in changes.iter().filter(|c| !c.starts_with('~')) {
            assert!(changed.iter().any(|k| k.starts_with(c)), "{what}: {c} is as before");
        }
    }

    /// Checks, after everything was released, that all results except the poses of the objects are as before the first step.
    fn ends(mut self, objects: &[&str]) {
        for name in objects {
            self.robot.put(self.object(name), Pose::identity()).unwrap();
        }
        self.robot.set_q(&self.start).unwrap();
        let last = answers(&self.robot);
        let differs: Vec<_> = last.keys().filter(|k| self.first.get(*k) != last.get(*k)).collect();
        assert!(differs.is_empty(), "not as before the task: {differs:?}");
    }
}

fn thing(name: &str, mass: f64, com: &[f64], moments: &[f64]) -> ObjectSpec {
    let I = Mat3::from_diagonal(&Vec3::from_column_slice(moments));
    let mass = MassProperties::new(mass, Vec3::from_column_slice(com), I);
    ObjectSpec { name: name.into(), mass }
}

fn number(v: &Value, key: &str) -> f64 {
    v[key].as_f64().unwrap()
}

/// Results that change when only the left arm moves, including its fingers but not the object in its hand.
const LEFT_MOVES: [&str; 4] = ["q", "left:", "left_finger", "robot and world: distances"];

#[test]
fn key_and_door() {
    let Some(mut s) = Scene::new("key_and_door", "q_grasp", &["arm"], |b, spec| {
        let (m, h) = (number(&b["key"], "mass"), numbers(&b["key"]["half"]));
        let side = |i: usize, j: usize| m / 3.0 * (h[i] * h[i] + h[j] * h[j]);
        let key = thing("key", m, &[0.0; 3], &[side(1, 2), side(0, 2), side(0, 1)]);
        spec.objects = vec![key, thing("frame", 10.0, &[0.0; 3], &[0.1; 3])];
        let half = Vec3::from_column_slice(&h);
        spec.colliders.push(ColliderSpec::new("key", "key", Shape::Box { half }));
        // The scene has a frame, in it a door on a pin, and in the door the cylinder of the lock.
        for (name, parent, at) in
            [("door", "frame", None), ("lock", "door", Some("origin_in_door"))]
        {
            let axis = Vec3::from_column_slice(&numbers(&b[name]["axis"]));
            let p = at.map_or(vec![0.0; 3], |k| numbers(&b[name][k]));
            let mass = MassProperties::new(1.0, Vec3::zeros(), Mat3::identity() * 0.01);
            let body = BodySpec::new(name, parent).hinge(Hinge::pin(axis)).mass(mass);
            spec.linkages.body(body.hinge_in_parent(Pose::translation(p[0], p[1], p[2])));
        }
        let half = Vec3::from_column_slice(&numbers(&b["door"]["half"]));
        let p = numbers(&b["door"]["shape_centre"]);
        let leaf = ColliderSpec::new("leaf", "door", Shape::Box { half });
        spec.colliders.push(leaf.at(Pose::translation(p[0], p[1], p[2])));
        // Ignore this pair, because the key is inserted into the lock.
        spec.rules.ignore.push(["key".into(), "leaf".into()]);
    }) else {
        return;
    };
    let (arm, key, frame) = (s.part("arm"), s.object("key"), s.object("frame"));
    let p = numbers(&s.json["bodies"]["door"]["origin"]);
    s.robot.put(frame, Pose::translation(p[0], p[1], p[2])).unwrap();
    let begin = answers(&s.robot);
    s.first = begin;
    let lock = s.model.object_body(frame, "lock").unwrap();
    let joint = |name: &str| {
        let own = s.model.object_multibody(frame).unwrap();
        own.get(own.body(name).unwrap()).v().start - 6
    };
    let [at_door, at_lock] = ["door", "lock"].map(joint);
    let theta = |door: f64, turned: f64| {
        let mut theta = [0.0; 2];
        (theta[at_door], theta[at_lock]) = (door, turned);
        theta
    };
    let X = pose(&numbers(&s.json["bodies"]["key"]["pose_in_tip"]));
    let [grasp, turned, opened] = ["q_grasp", "q_turned", "q_opened"].map(|k| s.q(k));
    // The key stays in place until it is grasped.
    let approach = ["q", "arm:", "finger", "robot and world: distances", "key: distances"];
    s.step("approach", &approach, |r| r.set_q(&grasp).unwrap());
    let load = ["arm: forces", "arm: inertia", "key:"];
    s.step("key on the tip", &load, |r| r.grasp(arm, key, Grasp::At(X)).unwrap());
    // Closing the loop onto the lock and reading its freedom and forces changes nothing.
    s.step("insert", &[], |r| {
        for free in [theta(0.0, 1.0), theta(1.0, 1.0)].map(|t| t.map(|t| t > 0.5)) {
            let onto = Closing::Onto { hand: arm, object: frame, body: lock, free: &free };
            let closure = r.closure(onto).unwrap();
            let moving = free.iter().filter(|f| **f).count();
            assert_eq!(closure, ClosureRank { rows: 6, rank: 6, mobility: 4 + moving });
        }
        let mut J = vec![0.0; 12];
        r.object_jacobian(frame, lock, &mut J).unwrap();
        assert!((J[at_lock].abs() - 1.0).abs() < 1e-12, "{J:?}");
    });
    let arm_moves =
        ["q", "arm:", "finger", "robot and world: distances", "key: place", "key: distances"];
    let lock_turns = "frame: joints";
    let moves = [&arm_moves[..], &[lock_turns]].concat();
    s.step("turn", &moves, |r| {
        r.set_q(&turned).unwrap();
        r.set_object_q(frame, &theta(0.0, 0.5 * std::f64::consts::PI)).unwrap();
    });
    // The shape of the door belongs to an object, so its distances are listed together with the distances between robot and world.
    s.step("open", &moves, |r| {
        r.set_q(&opened).unwrap();
        let door = -30.0_f64.to_radians();
        r.set_object_q(frame, &theta(door, 0.5 * std::f64::consts::PI)).unwrap();
    });
    let left = ["arm: forces", "arm: inertia", "key: hands", "key: pairs", "key: distances"];
    s.step("the arm lets go", &left, |r| r.ungrasp(key).unwrap());
    let stays = ["key: on", "key: place", "key: distances"];
    s.step("the key stays", &stays, |r| r.attach(key, frame, Some(lock), Grasp::Here).unwrap());
    let along = ["frame: joints", "robot and world: distances", "key: place", "key: distances"];
    s.step("the door closes", &along, |r| r.set_object_q(frame, &[0.0; 2]).unwrap());
    s.robot.detach(key).unwrap();
    s.ends(&["key"]);
}

#[test]
fn hang_up_phone() {
    let Some(mut s) = Scene::new("hang_up_phone", "q_up", &["left"], |b, spec| {
        let (h, c) = (&b["handset"], &b["cradle"]);
        spec.objects =
            vec![thing("handset", number(h, "mass"), &[0.0; 3], &numbers(&h["inertia"]))];
        let shape =
            Shape::Capsule { radius: number(h, "radius"), half_length: number(h, "half_length") };
        spec.colliders.push(ColliderSpec::new("handset", "handset", shape));
        let (p, half) = (numbers(&c["position"]), Vec3::from_column_slice(&numbers(&c["half"])));
        let cradle = ColliderSpec::new("cradle", "world", Shape::Box { half });
        spec.colliders.push(cradle.at(Pose::translation(p[0], p[1], p[2])));
    }) else {
        return;
    };
    let (left, handset) = (s.part("left"), s.object("handset"));
    let [shape, cradle] = ["handset", "cradle"].map(|c| s.collider(c));
    let X = pose(&numbers(&s.json["bodies"]["handset"]["pose_in_tip"]));
    let [up, on] = ["q_up", "q_on"].map(|k| s.q(k));
    s.step("up", &[&LEFT_MOVES[..], &["handset: distances"]].concat(), |r| r.set_q(&up).unwrap());
    let load = ["left: forces", "left: inertia", "handset:"];
    s.step("handset held", &load, |r| r.grasp(left, handset, Grasp::At(X)).unwrap());
    let touch = ["handset: pairs", "handset: distances"];
    s.step("it may touch", &touch, |r| r.look_at(shape, cradle, Some(false)).unwrap());
    let lower = [&LEFT_MOVES[..], &["handset: place", "handset: distances"]].concat();
    s.step("lower", &lower, |r| r.set_q(&on).unwrap());
    let free =
        ["left: forces", "left: inertia", "handset: hands", "handset: pairs", "handset: distances"];
    s.step("ungrasp", &free, |r| r.ungrasp(handset).unwrap());
    s.step("it may not touch", &touch, |r| r.look_at(shape, cradle, None).unwrap());
    s.ends(&["handset"]);
}

#[test]
fn drill_hole() {
    let Some(mut s) = Scene::new("drill_hole", "q", &["left"], |b, spec| {
        for name in ["driver", "battery"] {
            let o = &b[name];
            let [com, I] = ["com", "I"].map(|k| numbers(&o[k]));
            spec.objects.push(thing(name, number(o, "mass"), &com, &I));
            let half = Vec3::new(0.02, 0.03, 0.04);
            spec.colliders.push(ColliderSpec::new(name, name, Shape::Box { half }));
        }
    }) else {
        return;
    };
    let left = s.part("left");
    let [driver, battery] = ["driver", "battery"].map(|o| s.object(o));
    let bodies = &s.json["bodies"];
    let X = pose(&numbers(&bodies["driver"]["pose_in_tip"]));
    let X_battery = pose(&numbers(&bodies["battery"]["pose_in_driver"]));
    let better = pose(&numbers(&s.json["expect"]["estimator_pose_in_tip"]));
    let q = s.q("q");
    // Both objects are in the world, and the arm moves.
    let far = ["driver: distances", "battery: distances"];
    s.step("reach", &[&LEFT_MOVES[..], &far].concat(), |r| r.set_q(&q).unwrap());
    let load = ["left: forces", "left: inertia"];
    // Distances between two objects are listed for the one whose name comes first, here the
    // battery.
    let takes = [&load[..], &["driver:", "battery: distances"]].concat();
    s.step("grasp the driver", &takes, |r| r.grasp(left, driver, Grasp::At(X)).unwrap());
    // The battery is rigid with the driver from now on, so their pair is ignored.
    let takes = [&load[..], &["battery:", "driver: pairs"]].concat();
    s.step("attach the battery", &takes, |r| {
        r.attach(battery, driver, None, Grasp::At(X_battery)).unwrap()
    });
    let push = Push::new(left, Vec3::x(), Vec3::z());
    s.step("press", &[], |r| {
        let mut tau = vec![0.0; r.q().len()];
        r.held_still(&[push], &mut tau).unwrap();
        r.manipulability(left, Rows::Linear, None).unwrap();
    });
    let moved = |o: &str| ["hands", "place", "distances"].map(|k| format!("{o}: {k}"));
    // The battery moves with the driver, and keeps its place in it.
    let names = [moved("driver"), moved("battery")].concat();
    let names = names.iter().map(String::as_str).filter(|n| *n != "battery: hands");
    let names: Vec<&str> = load.iter().copied().chain(names).collect();
    s.step("estimate of the driver", &names, |r| r.update_grasp(left, driver, better).unwrap());
    let off = ["battery: on", "battery: pairs", "battery: distances", "driver: pairs"];
    s.step("battery off", &[&load[..], &off].concat(), |r| r.detach(battery).unwrap());
    let off = ["driver: hands", "driver: pairs", "driver: distances"];
    s.step("driver off", &[&load[..], &off].concat(), |r| r.ungrasp(driver).unwrap());
    s.ends(&["driver", "battery"]);
}

#[test]
fn change_tyre() {
    let Some(mut s) = Scene::new("change_tyre", "q", &["left", "right"], |b, spec| {
        let t = &b["tyre"];
        spec.objects = vec![thing("tyre", number(t, "mass"), &[0.0; 3], &numbers(&t["inertia"]))];
        let (radius, half_length) = (number(t, "radius"), number(t, "half_length"));
        let tyre = Shape::Cylinder { radius, half_length };
        spec.colliders.push(ColliderSpec::new("tyre", "tyre", tyre));
        let n = &b["nuts"];
        for k in 0..n["count"].as_u64().unwrap() {
            spec.objects.push(thing(&format!("nut {k}"), number(n, "mass"), &[0.0; 3], &[1e-6; 3]));
        }
        // The hub rotates on the axle.
        spec.objects.push(thing("axle", 10.0, &[0.0; 3], &[0.1; 3]));
        let steel = MassProperties::new(4.0, Vec3::zeros(), Mat3::identity() * 0.01);
        spec.linkages.body(BodySpec::new("hub", "axle").hinge(Hinge::pin(Vec3::z())).mass(steel));
        spec.parts.retain(|p| p.name() != "neck");
    }) else {
        return;
    };
    let [left, right] = ["left", "right"].map(|p| s.part(p));
    let tyre = s.object("tyre");
    let X = ["left_tip_in_tyre", "right_tip_in_tyre"]
        .map(|k| pose(&numbers(&s.json["bodies"]["tyre"][k])).inverse());
    let q = s.q("q");
    let reach = [&LEFT_MOVES[..], &["right:", "right_finger", "tyre: distances"]].concat();
    s.step("reach", &reach, |r| r.set_q(&q).unwrap());
    let load = ["left: forces", "left: inertia", "tyre:"];
    s.step("left hand", &load, |r| r.grasp(left, tyre, Grasp::At(X[0])).unwrap());
    // The grasp of the second hand does not attach the tyre to the tree: it closes a loop and adds pairs that collision checks ignore.
    let closes = ["tyre: hands", "tyre: pairs", "tyre: distances"];
    s.step("right hand", &closes, |r| r.grasp(right, tyre, Grasp::At(X[1])).unwrap());
    s.step("carry, press", &[], |r| {
        let mut tau = vec![0.0; r.model().nv()];
        r.gravity_forces(&mut tau).unwrap();
        r.balance(tyre, Balance::Effort, &mut tau).unwrap();
        r.squeeze(tyre, 98.1, &mut tau).unwrap();
    });
    let off = ["left: forces", "left: inertia", "tyre: hands", "tyre: pairs", "tyre: distances"];
    s.step("both let go", &off, |r| r.ungrasp(tyre).unwrap());
    let axle = s.object("axle");
    let hub = s.model.object_body(axle, "hub").unwrap();
    let X = pose(&numbers(&s.json["bodies"]["hub"]["pose"]));
    s.step("the axle", &["axle: place"], |r| r.put(axle, X).unwrap());
    let welded = ["tyre: on", "~tyre: place", "~tyre: distances"];
    s.step("weld to the hub", &welded, |r| r.attach(tyre, axle, Some(hub), Grasp::Here).unwrap());
    for (k, p) in s.json["expect"]["nut_positions"].as_array().unwrap().clone().iter().enumerate() {
        let (name, p) = (format!("nut {k}"), numbers(p));
        let nut = s.object(&name);
        let [hands, place] = ["hands", "place"].map(|x| format!("{name}: {x}"));
        let takes = ["left: forces", "left: inertia", &hands, &place];
        s.step(&name, &takes, |r| r.grasp(left, nut, Grasp::At(Pose::identity())).unwrap());
        s.step(&name, &takes[..3], |r| r.ungrasp(nut).unwrap());
        let X = Pose::translation(p[0], p[1], p[2]);
        s.step("nut on its stud", &[&place], |r| r.put(nut, X).unwrap());
        let on = format!("{name}: on");
        s.step("weld the nut", &[&on, &format!("~{place}")], |r| {
            r.attach(nut, axle, Some(hub), Grasp::Here).unwrap()
        });
    }
    let nuts: Vec<String> = (0..5).map(|k| format!("nut {k}")).collect();
    let all: Vec<&str> =
        ["tyre", "axle"].into_iter().chain(nuts.iter().map(String::as_str)).collect();
    // All objects that are attached to the hub rotate with it. Then they are detached again.
    let turned: Vec<String> = (all.iter().filter(|o| **o != "axle"))
        .map(|o| format!("{o}: place"))
        .chain(["axle: joints".into(), "tyre: distances".into()])
        .collect();
    let turned: Vec<&str> = turned.iter().map(String::as_str).collect();
    s.step("turn the hub", &turned, |r| r.set_object_q(axle, &[0.4]).unwrap());
    s.step("turn it back", &turned, |r| r.set_object_q(axle, &[0.0]).unwrap());
    for name in all.iter().filter(|o| **o != "axle") {
        let (object, on) = (s.object(name), format!("{name}: on"));
        let place = format!("~{name}: place");
        s.step("take it off", &[&on, &place, "~tyre: distances"], |r| r.detach(object).unwrap());
    }
    s.ends(&all);
}

#[test]
fn cut_wire() {
    let Some(mut s) = Scene::new("cut_wire", "q", &["left"], |b, spec| {
        let [a, other] = ["handle_a", "handle_b"].map(|h| {
            let [com, I] = ["com", "I"].map(|k| numbers(&b[h][k]));
            thing(h, number(&b[h], "mass"), &com, &I)
        });
        let pin = &b["pin"];
        let p = numbers(&pin["origin_in_a"]);
        let limits = numbers(&pin["limits"]);
        let hinge = Hinge::pin(Vec3::from_column_slice(&numbers(&pin["axis"])))
            .limits(Limits::position(limits[0], limits[1]));
        let body = BodySpec::new("handle_b", "handle_a").hinge(hinge).mass(other.mass);
        spec.linkages.body(body.hinge_in_parent(Pose::translation(p[0], p[1], p[2])));
        spec.objects.push(a);
        let w = &b["wire"];
        let (radius, half_length) = (number(w, "radius"), number(w, "half_length"));
        let p = numbers(&w["position"]);
        let shape = Shape::Capsule { radius, half_length };
        let at = Pose::translation(p[0], p[1], p[2]);
        spec.colliders.push(ColliderSpec::new("wire", "world", shape).at(at));
        // While it is clamped, the wire is one object. After the cut it is two objects, and each has the
        // mass of its piece of copper.
        let half_length = 0.5 * half_length;
        let mass = 8960.0 * std::f64::consts::PI * radius * radius * 2.0 * half_length;
        let across = mass * half_length * half_length / 3.0;
        let moments = [across, across, 0.5 * mass * radius * radius];
        for name in ["wire near", "wire far"] {
            spec.objects.push(thing(name, mass, &[0.0; 3], &moments));
            let shape = Shape::Capsule { radius, half_length };
            spec.colliders.push(ColliderSpec::new(name, name, shape));
        }
        let jaw = Shape::Box { half: Vec3::new(0.01, 0.01, 0.02) };
        spec.colliders.push(ColliderSpec::new("handle_a", "handle_a", jaw.clone()));
        spec.colliders.push(ColliderSpec::new("handle_b", "handle_b", jaw));
    }) else {
        return;
    };
    let (left, tool) = (s.part("left"), s.object("handle_a"));
    let [wire, near, far] = ["wire", "wire near", "wire far"].map(|w| s.collider(w));
    let X = pose(&numbers(&s.json["bodies"]["pin"]["a_in_tip"]));
    let q = s.q("q");
    for half in [near, far] {
        s.robot.show(half, Visibility::Hidden).unwrap();
    }
    let begin = answers(&s.robot);
    s.first = begin;
    let load = ["left: forces", "left: inertia"];
    // Pairs and distances of the second handle, which belongs to the object, are listed together with the pairs of robot and world.
    let takes = ["handle_a:", "robot and world: pairs", "robot and world: distances"];
    let takes = [&load[..], &takes].concat();
    s.step("grasp handle a", &takes, |r| r.grasp(left, tool, Grasp::At(X)).unwrap());
    let jaws = ["handle_a: joints", "robot and world: distances"];
    let opens = [&load[..], &jaws].concat();
    s.step("open", &opens[..], |r| r.set_object_q(tool, &[0.5]).unwrap());
    let reach = [&LEFT_MOVES[..], &["handle_a: place", "handle_a: distances"]].concat();
    s.step("reach over the wire", &reach, |r| r.set_q(&q).unwrap());
    s.step("close", &opens, |r| r.set_object_q(tool, &[0.0]).unwrap());
    let w = &s.json["bodies"]["wire"];
    let (p, quarter) = (numbers(&w["position"]), 0.5 * number(w, "half_length"));
    let radius = number(w, "radius");
    let cut = [
        "robot and world: distances",
        "handle_a: distances",
        "wire near: place",
        "wire near: distances",
        "wire far: place",
        "wire far: distances",
    ];
    let halves = ["wire near", "wire far"].map(|w| s.object(w));
    s.step("the wire is two", &cut, |r| {
        r.show(wire, Visibility::Hidden).unwrap();
        for (half, shape, side) in [(halves[0], near, -1.0), (halves[1], far, 1.0)] {
            r.show(shape, Visibility::Shown).unwrap();
            r.put(half, Pose::translation(p[0], p[1], p[2] + side * quarter)).unwrap();
        }
    });
    // The lower piece of wire drops onto the table. The other hand grasps the upper piece, which
    // has mass.
    let drops = ["wire near: place", "wire near: distances", "handle_a: distances"];
    let drops = [&drops[..], &["wire far: distances"]].concat();
    let lying = spatial::Quat::from_scaled_axis(Vec3::x() * std::f64::consts::FRAC_PI_2);
    let on_table = Pose::new(lying, Vec3::new(p[0], p[1], 0.72 + radius + 1e-6));
    let held_at = Vec3::new(p[0], p[1], p[2] + quarter);
    s.step("the near end drops", &drops, |r| r.put(halves[0], on_table).unwrap());
    let right = s.part("right");
    // The pose of the piece now follows from the hand with round-off, so distances change by
    // round-off, too.
    let takes = ["right: forces", "right: inertia", "wire far:", "handle_a: distances"];
    s.step("the far end is taken", &takes, |r| r.grasp(right, halves[1], Grasp::Here).unwrap());
    let there = s.robot.object_pose(halves[1]).unwrap().position;
    assert!((there - held_at).norm() < 1e-14, "{there}");
    let lets = ["right: forces", "right: inertia", "wire far: hands"];
    let lets = [&lets[..], &["wire far: pairs", "wire far: distances"]].concat();
    s.step("and let go", &lets, |r| r.ungrasp(halves[1]).unwrap());
    let off = ["handle_a: hands", "handle_a: pairs", "handle_a: distances"];
    let off = [&load[..], &off, &["robot and world: pairs", "robot and world: distances"]].concat();
    s.step("ungrasp", &off, |r| r.ungrasp(tool).unwrap());
    for (w, to) in
        [(wire, Visibility::Shown), (near, Visibility::Hidden), (far, Visibility::Hidden)]
    {
        s.robot.show(w, to).unwrap();
    }
    s.ends(&["handle_a", "wire near", "wire far"]);
}

#[test]
fn push_button() {
    let Some(mut s) = Scene::new("push_button", "q_touch", &["left"], |b, spec| {
        // The button slides in a panel whose face is 10 mm behind the face of the button.
        let (button, half) = (&b["button"], Vec3::new(0.01, 0.01, 0.01));
        let limits = numbers(&button["limits"]);
        let hinge = Hinge::slider(Vec3::from_column_slice(&numbers(&button["axis"])))
            .limits(Limits::position(limits[0], limits[1]));
        let mass = thing("button", number(button, "mass"), &[0.0; 3], &[1e-6; 3]).mass;
        spec.linkages.body(BodySpec::new("button", "panel").hinge(hinge).mass(mass));
        spec.objects = vec![thing("panel", 10.0, &[0.0; 3], &[0.1; 3])];
        let at = |x: f64| Pose::translation(x, 0.0, 0.0);
        let cap = ColliderSpec::new("button", "button", Shape::Box { half });
        spec.colliders.push(cap.at(at(0.01)));
        let half = Vec3::new(0.01, 0.06, 0.06);
        let plate = ColliderSpec::new("panel", "panel", Shape::Box { half });
        spec.colliders.push(plate.at(at(0.02)));
    }) else {
        return;
    };
    let (left, panel) = (s.part("left"), s.object("panel"));
    let face = Vec3::from_column_slice(&numbers(&s.json["bodies"]["button"]["face"]));
    let travel = number(&s.json["bodies"]["button"], "travel");
    let [button, plate, finger] = ["button", "panel", "left_finger_a"].map(|c| s.collider(c));
    // Close one finger to the middle of the hand, so that it points forward next to the other
    // finger.
    let at_finger = s.model.coordinate("left_finger_a_joint").unwrap().0;
    let [touch, press] = ["q_touch", "q_press"].map(|k| {
        let mut q = s.q(k);
        q[at_finger] = 0.0;
        q
    });
    s.robot.put(panel, Pose::translation(face.x, face.y, face.z)).unwrap();
    let begin = answers(&s.robot);
    s.first = begin;
    let arm_moves = [&LEFT_MOVES[..], &["panel: distances"]].concat();
    s.step("approach", &arm_moves, |r| r.set_q(&touch).unwrap());
    s.step("ask on the way", &[], |r| {
        let q = r.q().to_vec();
        let mut v = vec![0.0; r.model().nv()];
        r.clearance(&q, 1.0).unwrap();
        let ahead = spatial::Motion::new(Vec3::zeros(), Vec3::x());
        r.rates(left, &ahead, &mut v).unwrap();
    });
    // The hand starts 50 mm in front of the button and advances by the free distance until this distance is zero.
    // `clearance` monitors it.
    let X = s.robot.tip_pose(left).unwrap();
    let before = |x: f64| Pose::new(X.rotation, X.position - Vec3::x() * x);
    let to = |r: &mut Robot, X: Pose| {
        let mut q = touch.clone();
        let effort = Effort { tolerances: [1e-12; 2], ..Effort::default() };
        let answer =
            r.inverse_kinematics(left, &Goal::pose(X), Frame::World, &effort, &mut q).unwrap();
        assert_eq!(answer.outcome, Outcome::Met);
        r.set_q(&q).unwrap();
        q
    };
    s.step("back off", &arm_moves, |r| _ = to(r, before(0.05)));
    let mut way = 0.0;
    s.step("guarded move", &arm_moves, |r| {
        let mut q = r.q().to_vec();
        for k in 0.. {
            assert!(k < 20, "it does not come to the button");
            let nearest = r.clearance(&q, f64::INFINITY).unwrap().unwrap();
            let free = nearest.distance.distance;
            assert!(free > -1e-9, "it is in the button by {free} m");
            if free < 1e-9 {
                let met = [nearest.a, nearest.b];
                assert!(met.contains(&button) && met.contains(&finger), "{met:?}");
                break;
            }
            way += free;
            q = to(r, before(0.05 - way));
        }
    });
    // The end of the finger coincides with the tip, so the travel equals the initial free distance.
    assert!((way - 0.05).abs() < 1e-9, "{way}");
    assert!((s.robot.tip_pose(left).unwrap().position - face).norm() < 1e-9);
    assert_eq!(s.robot.q(), touch, "its face, and the way back to it from there is none");
    // Pressing without permission hits the button and nothing else.
    let hits = |r: &Robot, q: &[f64]| {
        let mut out = Vec::new();
        r.clone().hits(q, &mut out).unwrap();
        out
    };
    let pair = |a: ColliderId, b: ColliderId| (a.min(b), a.max(b));
    assert_eq!(hits(&s.robot, &press), [pair(finger, button)]);
    assert!(s.robot.clone().collides(&press).unwrap());
    let allowed = ["robot and world: pairs", "robot and world: distances"];
    s.step("it may touch", &allowed, |r| r.look_at(finger, button, Some(false)).unwrap());
    assert!(!s.robot.looks_at(finger, button).unwrap());
    assert!(s.robot.looks_at(finger, plate).unwrap(), "the panel is not let off");
    let pressed = [&arm_moves[..], &["panel: joints"]].concat();
    s.step("press", &pressed, |r| {
        r.set_q(&press).unwrap();
        r.set_object_q(panel, &[travel]).unwrap();
    });
    for slid in [0.0, travel] {
        s.robot.set_object_q(panel, &[slid]).unwrap();
        assert_eq!(hits(&s.robot, &press), []);
        assert!(!s.robot.clone().collides(&press).unwrap());
    }
    // At a depth of 10 mm too much, the finger is inside of the panel, and so is the other finger.
    let other = s.collider("left_finger_b");
    let too_deep = to(&mut s.robot.clone(), before(-travel - 0.01));
    let both = [pair(finger, plate), pair(other, plate)];
    assert_eq!(hits(&s.robot, &too_deep), both);
    assert!(both.contains(&s.robot.clone().first_hit(&too_deep).unwrap().unwrap()));
    s.step("it may not touch", &allowed, |r| r.look_at(finger, button, None).unwrap());
    s.robot.set_object_q(panel, &[0.0]).unwrap();
    assert!(s.robot.clone().collides(&press).unwrap());
    s.ends(&[]);
}

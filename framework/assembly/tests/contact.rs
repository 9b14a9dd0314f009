//! Colliders and contact of a text: read, run, resolved, rejected.
use crate::common::*;
use linkwork_assembly::form::AssemblyForm;
use linkwork_assembly::*;
use linkwork_collision::{Shape as Solid, Visibility};
use linkwork_plant::SpecExt;
use linkwork_solvers::JointLimits;
use linkwork_solvers::contact::Method;
use linkwork_spatial::Vec3;

const SOLIDS: &str = r#"bodies: {
    "lift": (parent: "world", hinge: Slider(axis: [0, 0, 1], limits: (lower: -1, upper: 1)), mass: 1, inertia: Sphere(0.1)),
    "deck": (parent: "lift", hinge: Ball, mass: 1, inertia: Sphere(0.1), shapes: [
        (shape: Cylinder(radius: 0.2, length: 1, axis: [0, 1, 0]), at: (position: [1, 0, 0]), name: "roll",
            collide: (padding: "1 mm", group: ["wheels", "hard"], meets: ["ground", "default"], friction: 0.7, restitution: 0.2, hidden: true, coarse: Sphere(0.5))),
        (shape: Box([1, 2, 3]), collide: true, visible: false),
        Capsule(radius: 0.1, length: 0.4),
        (shape: ConvexHull(points: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), collide: true, name: "hull"),
        (shape: Mesh(file: "tetra.stl", scale: 0.001), collide: true, name: "mesh"),
        (shape: Sphere(1), collide: (shape: ConvexHull(file: "tetra.stl")), name: "inside"),
    ]),
    "pivot": (parent: "deck", hinge: Pin([0, 1, 0]), mass: 1, inertia: Sphere(0.1), nodes: { "foot": (position: [0, 0, -1]) }),
},
colliders: {
    "floor": (on: "world", shape: HalfSpace, at: (position: [0, 0, -2]), group: "ground"),
    "wall": (on: "world", shape: Box([1, 1, 1]), color: [1, 0, 0]),
    "foot": (on: "pivot/foot", shape: Sphere(0.1), visible: false, at: (position: [0, 0, 0.5])),
    "hill": (on: "world", shape: HeightField(spacing: [1, 2], rows: 2, columns: 3, heights: [0, 1, 2, 3, 4, 5])),
    "soup": (on: "world", shape: Mesh(vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], triangles: [[0, 1, 2]])), "seen": (on: "world", shape: PointCloud(points: [[1, 2, 3, 0.1], [4, 5, 6, 0]], room: 50)), "map": (on: "world", shape: VoxelMap(cells: [4, 5, 6], edge: "5 cm", occupied: [[0, 0, 0], [3, 4, 5]]), at: (position: [9, 0, 0])),
},
contact: (margin: "2 cm", slop: "0.2 mm", correction: 0.3, push_max: 2, bounce_min: 0.02, friction: 0.4, restitution: 0.1,
    limits: false, dry: { "hinge:pivot": "2 N m", "lift": "3 N" }, method: Newton, tolerance: 1e-8, sweeps: 20, steps: 30,
    relaxation: 1.1, directions: 6, neighbours: Pass, ignore: [["deck", "wall"]], collide: [["deck/hull", "foot"]])"#;

const TETRA: &str = "solid t
facet normal 0 0 0 outer loop\nvertex 0 0 0\nvertex 0 1000 0\nvertex 1000 0 0\nendloop endfacet
facet normal 0 0 0 outer loop\nvertex 0 0 0\nvertex 1000 0 0\nvertex 0 0 1000\nendloop endfacet
facet normal 0 0 0 outer loop\nvertex 0 0 0\nvertex 0 0 1000\nvertex 0 1000 0\nendloop endfacet
facet normal 0 0 0 outer loop\nvertex 1000 0 0\nvertex 0 1000 0\nvertex 0 0 1000\nendloop endfacet
endsolid";

fn solids(text: &str) -> Result<Loaded, Failure> {
    let catalogue = catalogue();
    let options = Options::new(&catalogue).embed("tetra.stl", TETRA);
    load_text("sim.ron", &format!("Simulation(\n{text})"), &options)
}

#[test]
fn every_field_of_colliders_and_contact_is_read() {
    let loaded = solids(SOLIDS).unwrap_or_else(|f| panic!("{f}"));
    let colliders = loaded.colliders.clone().unwrap();
    let id = |name: &str| colliders.find(name).unwrap_or_else(|| panic!("{name}"));
    let of = |name: &str| colliders.spec(id(name));
    let roll = of("deck/roll");
    assert_eq!(roll.fine, Solid::Cylinder { radius: 0.2, half_length: 0.5 });
    assert!((roll.pose.transform_vector(&Vec3::z()) - Vec3::y()).amax() < 1e-15);
    assert_eq!(roll.pose.position, Vec3::x());
    assert_eq!(roll.coarse, Some(Solid::Sphere { radius: 0.5 }));
    assert_eq!((roll.padding, roll.hidden), (1e-3, Visibility::Hidden));
    assert_eq!((roll.material.friction, roll.material.restitution), (0.7, 0.2));
    // The bits follow the names of the groups: default, ground, hard, wheels.
    assert_eq!((roll.groups, roll.collides_with), (0b1100, 0b0011));
    let block = of("deck/shape2");
    assert_eq!(block.fine, Solid::Box { half: Vec3::new(0.5, 1.0, 1.5) });
    assert_eq!((block.material.friction, block.material.restitution), (0.4, 0.1));
    assert_eq!((block.groups, block.collides_with), (1, u128::MAX));
    assert!(matches!(&of("deck/hull").fine, Solid::ConvexHull { points } if points.len() == 4));
    let Solid::Mesh { vertices, triangles } = &of("deck/mesh").fine else { panic!() };
    assert_eq!((vertices.len(), triangles.len(), vertices[1]), (12, 4, Vec3::y()));
    let Solid::ConvexHull { points } = &of("deck/inside").fine else { panic!() };
    assert_eq!(points[1], 1000.0 * Vec3::y());
    assert_eq!((of("floor").body.as_str(), of("floor").pose.position.z), ("world", -2.0));
    assert_eq!((of("foot").body.as_str(), of("foot").pose.position.z), ("pivot", -0.5));
    let Solid::HeightField { x, y, spacing, heights } = &of("hill").fine else { panic!() };
    assert_eq!((*x, *y, *spacing, heights[4]), (3, 2, [1.0, 2.0], 4.0));
    let Solid::PointCloud { points, room } = &of("seen").fine else { panic!() };
    assert_eq!((&points[..], *room), (&[[1.0, 2.0, 3.0, 0.1], [4.0, 5.0, 6.0, 0.0]][..], 50));
    let map = Solid::VoxelMap { cells: [4, 5, 6], edge: 0.05, occupied: vec![[0; 3], [3, 4, 5]] };
    assert_eq!((&of("map").fine, of("map").pose.position.x), (&map, 9.0));
    assert_eq!(colliders.len(), 12);
    // The pairs that collide follow from groups, neighbours and lists.
    let meet = |a, b| colliders.meet(id(a), id(b));
    assert!(meet("deck/roll", "floor") && !meet("deck/hull", "wall"), "ignored");
    assert!(
        !meet("deck/shape2", "foot") && meet("deck/hull", "foot"),
        "neighbours, but one listed"
    );
    assert!(meet("foot", "wall"));
    // These shapes are visible.
    let seen: Vec<_> = loaded.shapes.iter().map(|s| (s.body.as_str(), s.name.as_str())).collect();
    let on_deck = ["roll", "shape3", "mesh", "inside"].map(|n| ("deck", n));
    assert_eq!(seen[..4], on_deck);
    assert_eq!(seen[4..], [("world", "wall")]);
    let settings = &spec(&loaded).contact.as_ref().unwrap().settings;
    assert_eq!((settings.margin, settings.slop, settings.correction), (0.02, 2e-4, 0.3));
    assert_eq!((settings.push_max, settings.bounce_min), (2.0, 0.02));
    assert_eq!(settings.limits, JointLimits::Ignore);
    assert_eq!(settings.dry, [(0, 3.0), (4, 2.0)]);
    let s = settings.solver;
    assert_eq!((s.method, s.tolerance, s.sweeps, s.steps), (Method::Newton, 1e-8, 20, 30));
    assert_eq!((s.relaxation, s.directions), (1.1, 6));
    // The resolved text does not need the STL file.
    let catalogue = catalogue();
    let resolved = &loaded.resolved;
    let again = load_text("r.ron", resolved, &Options::new(&catalogue));
    let again = again.unwrap_or_else(|f| panic!("{f}\n{resolved}"));
    assert_eq!(digest(&again.spec), digest(&loaded.spec));
    assert_eq!(shown(&again.colliders.unwrap()), shown(&colliders));
    assert_eq!(again.shapes, loaded.shapes);
}

#[test]
fn the_outermost_contact_counts_and_none_is_no_contact() {
    let text = |outer: &str, inner: &str| {
        format!(
            "Simulation({outer} parts: {{ \"A\": (bodies: {{ \"b\": (parent: \"world\", hinge: Free, mass: 1, inertia: Sphere(1),
                shapes: [(shape: Sphere(1), collide: true)]) }}, {inner}) }})"
        )
    };
    let friction = |outer: &str, inner: &str| {
        let loaded = good(&text(outer, inner));
        let on = spec(&loaded).contact.is_some();
        let colliders = loaded.colliders.clone().unwrap();
        resolves(&loaded);
        on.then(|| colliders.spec(colliders.ids().next().unwrap()).material.friction)
    };
    assert_eq!(friction("", ""), None);
    assert_eq!(friction("contact: (),", ""), Some(0.5));
    assert_eq!(friction("contact: true,", ""), Some(0.5));
    assert_eq!(friction("", "contact: (friction: 0.3)"), Some(0.3));
    assert_eq!(friction("contact: (friction: 0.2),", "contact: (friction: 0.3)"), Some(0.2));
    assert_eq!(friction("contact: false,", "contact: (friction: 0.3)"), None);
    let neither = ["`contact: None` is ambiguous", "+write `contact: false`"];
    faults(&text("contact: None,", ""), &neither);
    let two = text("", "contact: ()").replace(") })", "), \"B\": (contact: (), bodies: {}) })");
    faults(&two, &["`A` and `B` both write `contact`", "+write it once, in the simulation"]);
}

#[test]
fn mistakes_in_colliders_have_places_and_remedies() {
    let told = |from: &str, to: &str, expected: &[&str]| {
        assert!(SOLIDS.contains(from), "{from}");
        let shown = solids(&SOLIDS.replacen(from, to, 1))
            .err()
            .unwrap_or_else(|| panic!("{to}"))
            .to_string();
        for part in expected {
            assert!(shown.contains(part), "\n{part}\nis not in\n{shown}");
        }
        assert_eq!(shown.matches("error: ").count(), 1, "{shown}");
    };
    told(
        "padding: \"1 mm\"",
        "padding: -1",
        &["shape 1: `collide`: `padding` is -1 m\n  --> sim.ron:6:32\n", "help: write 0 or more"],
    );
    told("padding: \"1 mm\"", "pading: 1", &["has no field `pading`\n", "did you mean `padding`?"]);
    told("restitution: 0.2", "restitution: 2", &["`restitution` is 2\n", "from 0 to 1"]);
    told(
        "meets: [\"ground\"",
        "meets: [\"grund\"",
        &[
            "collider `deck/roll`: no collider is in the group `grund`\n  --> sim.ron:6:",
            "did you mean `ground`?",
        ],
    );
    told(
        "coarse: Sphere(0.5)",
        "coarse: Capsule(radius: 1, length: 1, axis: [1, 0, 0])",
        &["`axis` is not allowed"],
    );
    told(
        "collide: true, visible: false",
        "collide: 3",
        &["`collide` cannot be a number\n", "write `collide: true`"],
    );
    told(
        "[0, 0, 1]]), collide: true, name: \"hull\"",
        "[1, 1, 0]]), collide: true, name: \"hull\"",
        &[
            "collider `deck/hull`, fine shape: the 4 points of the hull lie in one plane",
            "--> sim.ron:9:9\n",
        ],
    );
    told(
        "triangles: [[0, 1, 2]])",
        "triangles: [[0, 1, 2]]), coarse: Mesh()",
        &["`coarse`: `Mesh` has neither\n", "`file: \"part.stl\"`"],
    );
    told(
        "Capsule(radius: 0.1, length: 0.4)",
        "HalfSpace",
        &["this shape cannot be shown\n  --> sim.ron:8:9\n", "add `collide: true`"],
    );
    told(
        "ConvexHull(file: \"tetra.stl\")",
        "ConvexHull(file: \"tetre.stl\")",
        &["there is no file `tetre.stl`\n"],
    );
    told(
        "ConvexHull(file: \"tetra.stl\")",
        "ConvexHull()",
        &["has neither", "`points: [[x, y, z], ..]`"],
    );
    told(
        "on: \"pivot/foot\", shape: Sphere(0.1), visible: false, at: (position: [0, 0, 0.5])),",
        "on: \"pivot\", shape: Sphere(0.1), at: (pos: 1)),",
        &["collider `foot`: `at` has no field `pos`\n"],
    );
    told(
        "\"wall\": (on: \"world\"",
        "\"slab\": (on: \"pivot/fot\", shape: Sphere(1)), \"wall\": (on: \"world\"",
        &["collider `slab`: `on`: body `pivot` has no node `fot`", "did you mean `foot`?"],
    );
    told(
        "on: \"world\", shape: HalfSpace",
        "shape: HalfSpace",
        &["collider `floor` has no `on`\n  --> sim.ron:16:6\n"],
    );
    told("shape: HalfSpace", "shape: HalfSpac", &["there is no shape `HalfSpac`", "HalfSpace"]);
    told(
        "heights: [0, 1, 2, 3, 4, 5]",
        "heights: [0, 1, 2, 3, 4]",
        &[
            "collider `hill`",
            "the height field has 3 by 2 points and 5 heights",
            "--> sim.ron:19:6\n",
        ],
    );
    told(
        "heights: [0, 1, 2, 3, 4, 5]",
        "heights: [[0, 1, 2], [3, 4]]",
        &["a row has 2 numbers, but the first has 3"],
    );
    told(
        "triangles: [[0, 1, 2]]",
        "triangles: [[0, 1, 3]]",
        &["collider `soup`", "--> sim.ron:20:6\n"],
    );
    told(
        "\"wall\": (on",
        "\"a b\": (on: \"world\", shape: Sphere(1)), \"wall\": (on",
        &["`a b` cannot be the name of a collider"],
    );
    told(
        "margin: \"2 cm\"",
        "margin: \"2 s\"",
        &["`contact`: `margin`: `2 s` is in s, but m is expected\n  --> sim.ron:22:19\n"],
    );
    told(
        "margin: \"2 cm\"",
        "margins: 2",
        &["`contact` has no field `margins`", "did you mean `margin`?"],
    );
    told(
        "method: Newton",
        "method: Newten",
        &["`method`: there is no word `Newten`", "did you mean `Newton`?"],
    );
    told("sweeps: 20", "sweeps: 2.5", &["`sweeps` is 2.5", "an integer"]);
    told("correction: 0.3", "correction: 1.5", &["`correction` is 1.5", "from 0 to 1"]);
    told(
        "\"hinge:pivot\": \"2 N m\"",
        "\"hinge:pivot\": \"2 N\"",
        &["`2 N` is in N, but N m is expected"],
    );
    told(
        "\"hinge:pivot\"",
        "\"hinge:pivit\"",
        &["`dry`: `hinge:pivit`: there is no body `pivit`", "did you mean `pivot`?"],
    );
    told(
        "ignore: [[\"deck\", \"wall\"]]",
        "ignore: [[\"deck\", \"wal\"]]",
        &["`contact`: `ignore`: there is no collider or body `wal`", "did you mean `wall`?"],
    );
    told(
        "ignore: [[\"deck\", \"wall\"]]",
        "ignore: [\"deck\"]",
        &["`ignore`: item 1 must be a list, but it is a text"],
    );
    told(
        "collide: [[\"deck/hull\"",
        "collide: [[\"pivot/foot\"",
        &["`pivot/foot` is the node `foot` of `pivot`", "use a body or a collider"],
    );
}

/// A machine without collisions between its bodies, twice in one world, with other bodies.
fn machines(machine: &str, simulation: &str) -> String {
    let ball = "mass: 1, inertia: Sphere(1), shapes: [(shape: Sphere(1), collide: true)]";
    let free = format!("(parent: \"world\", hinge: Free, {ball})");
    let inner = format!("(bodies: {{ \"c\": {free} }})");
    let one = format!(
        "({machine} bodies: {{ \"a\": {free}, \"b\": {free} }}, parts: {{ \"In\": {inner} }})"
    );
    format!(
        "Simulation({simulation} bodies: {{ \"stone\": {free} }}, colliders: {{ \"floor\": (on: \"world\", shape: HalfSpace) }},
        parts: {{ \"One\": {one}, \"Other\": {one}, \"Others\": (parts: {{ \"In\": {inner} }}) }})"
    )
}

#[test]
fn a_machine_whose_bodies_do_not_meet_meets_all_else() {
    let pairs = |text: &str| {
        let loaded = good(text);
        resolves(&loaded);
        let again = load_text("r.ron", &loaded.resolved, &Options::new(&catalogue())).unwrap();
        let all = loaded.colliders.clone().unwrap();
        assert_eq!(again.colliders.unwrap().rules(), all.rules());
        let mut found = Vec::new();
        for a in all.ids() {
            let meet = all.ids().filter(|b| *b > a && all.meet(a, *b));
            found.extend(meet.map(|b| [&all.spec(a).body, &all.spec(b).body].map(String::clone)));
        }
        found
    };
    let every = pairs(&machines("", "contact: (),"));
    assert_eq!(every.len(), 9 * 8 / 2, "eight balls and a floor");
    let own = pairs(&machines("self_collision: false,", "contact: (),"));
    let machine = |body: &str| {
        ["One", "Other"]
            .into_iter()
            .find(|m| body.starts_with(&format!("{m}.")) || body.starts_with(&format!("{m}/")))
    };
    let left: Vec<_> = every
        .iter()
        .filter(|[a, b]| machine(a).is_none() || machine(a) != machine(b))
        .cloned()
        .collect();
    assert_eq!(own, left, "three pairs of each machine are gone");
    assert_eq!(every.len() - own.len(), 6);
    // Pairs in `collide` collide nevertheless; without contact, the rule applies to queries.
    let but = pairs(&machines(
        "self_collision: false,",
        "contact: (collide: [[\"One/a\", \"One.In/c\"]]),",
    ));
    assert_eq!(but.len(), own.len() + 1);
    assert_eq!(pairs(&machines("self_collision: false,", "")), own);
    assert_eq!(pairs(&machines("self_collision: true,", "")), every);
    let none = pairs(&machines("", "self_collision: false,"));
    assert_eq!(none.len(), 8, "of the whole simulation: each body and the floor");
    // A parameter or the builder can also set it.
    let by =
        machines("self_collision: \"$own\",", "params: { \"own\": (default: false, doc: \"\") },");
    assert_eq!(pairs(&by), own);
    let text = "Assembly(self_collision: false)";
    let read = AssemblyForm::from_ron("a.ron", text).unwrap();
    let again = AssemblyForm::from_ron("a.ron", &read.to_ron()).unwrap();
    assert_eq!(again.self_collision.unwrap().value, Value::Bool(false));
}

#[test]
fn self_collision_is_a_flag_and_not_contradicted_inside() {
    let told = |machine: &str, simulation: &str, parts: &[&str]| {
        let text = bad(&machines(machine, simulation));
        for part in parts {
            assert!(text.contains(part), "`{part}`: {text}");
        }
    };
    told("self_collision: \"no\",", "", &["`One`: `self_collision`", "it is a text"]);
    told("self_colision: false,", "", &["did you mean `self_collision`?"]);
    told(
        "self_collision: true,",
        "self_collision: false,",
        &[
            "`One`: `self_collision` is true, but it is false in `simulation`, which contains it",
            "`collide` of `contact` lists pairs that collide nevertheless",
        ],
    );
}

#[test]
fn a_ball_comes_to_rest_on_the_floor_of_a_text() {
    let text = r#"Simulation(
        bodies: { "ball": (parent: "world", hinge: Free, mass: 2, inertia: Sphere(0.1), initial: (position: [0, 0, 0.15], velocity: [1, 0, 0]),
            shapes: [(shape: Sphere(0.1), collide: true)], nodes: { "middle": () }) },
        colliders: { "floor": (on: "world", shape: HalfSpace) },
        parts: { "Pull": (model: "test.pad", bind: { "hub": "ball" }) },
        contact: (friction: 1))"#;
    let loaded = good(text);
    assert!(run(&loaded.spec, 1.5).get("Mechanism.contact.points").unwrap() >= 1.0);
}

#[test]
fn bodies_that_a_loop_joins_are_neighbours() {
    let meet = |fields: &str, contact: &str| {
        let ball = "(parent: \"world\", hinge: Free, mass: 1, inertia: Sphere(1), shapes: [(shape: Sphere(1), collide: true)])";
        let loaded = good(&format!(
            "Simulation(bodies: {{ \"a\": {ball}, \"b\": {ball} }}, {fields} contact: ({contact}))"
        ));
        let colliders = loaded.colliders.unwrap();
        let [a, b] = ["a/shape1", "b/shape1"].map(|n| colliders.find(n).unwrap());
        colliders.meet(a, b)
    };
    let joined = "loops: { \"l\": (a: \"a\", b: \"b\", hinge: Ball) },";
    assert!(meet("", "") && !meet(joined, ""));
    assert!(meet(joined, "neighbours: Collide") && meet(joined, "collide: [[\"a\", \"b\"]]"));
}

/// A wheel, a rock and a plank, with `pairs` and other fields of `contact`.
fn of_materials(pairs: &str, more: &str) -> Result<Loaded, Failure> {
    let text = format!(
        r#"bodies: {{
    "wheel": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), name: "tyre", collide: (material: "rubber", friction: 0.9))]),
    "rock": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), name: "skin", collide: (material: "basalt"))]),
    "plank": (parent: "world", hinge: Free, mass: 1, inertia: Sphere(0.1), shapes: [(shape: Sphere(0.1), name: "side", collide: true)]),
}},
contact: (friction: 0.4, pairs: [{pairs}], {more})"#
    );
    solids(&text)
}

#[test]
fn pairs_of_materials_have_laws_of_their_own() {
    let pairs = r#"(a: "basalt", b: "rubber", friction: 0.6, stiffness: 5e5), (a: "basalt", b: "basalt", restitution: 0.3), (a: "rubber", b: "terrain", damping: 2)"#;
    let loaded = of_materials(pairs, "compliant: (stiffness: 2e5, exponent: 1.5)").unwrap();
    let mechanism = loaded.spec.mechanism().cloned().unwrap();
    let (colliders, laws) = mechanism.compliant.unwrap();
    let id = |name: &str| colliders.find(name).unwrap();
    let law = |a: &str, b: &str| colliders.law(id(a), id(b));
    assert_eq!(law("wheel/tyre", "rock/skin"), Some(0));
    assert_eq!(law("rock/skin", "wheel/tyre"), Some(0));
    assert_eq!(law("wheel/tyre", "plank/side"), None);
    assert_eq!(colliders.rules().laws[0].friction, Some(0.6));
    assert_eq!(colliders.rules().laws[1].restitution, Some(0.3));
    // Values without a pair are the default for all pairs.
    assert_eq!((laws.of_laws[0].stiffness, laws.of_laws[0].exponent), (5e5, 1.5));
    assert_eq!((laws.of_laws[2].stiffness, laws.of_laws[2].damping), (2e5, 2.0));
    // The resolved text has the same laws.
    let again =
        load_text("resolved.ron", &loaded.resolved.to_string(), &Options::new(&catalogue()));
    let again = again.unwrap_or_else(|f| panic!("{f}")).spec.mechanism().cloned().unwrap();
    let (of_again, laws_again) = again.compliant.unwrap();
    assert_eq!((of_again.rules().laws.clone(), laws_again), (colliders.rules().laws.clone(), laws));
    assert_eq!(
        of_again.spec(of_again.find("rock/skin").unwrap()).material_name.as_deref(),
        Some("basalt")
    );
}

#[test]
fn mistakes_in_pairs_are_told_with_their_remedies() {
    let told = |pairs: &str, more: &str| of_materials(pairs, more).err().unwrap().to_string();
    let text = told(r#"(a: "rubbr", b: "basalt", friction: 0.6)"#, "");
    assert!(text.contains("no collider is of the material `rubbr`"), "{text}");
    assert!(text.contains("did you mean `rubber`"), "{text}");
    let text = told(r#"(a: "rubber", b: "basalt", friction: -1)"#, "");
    assert!(text.contains("friction"), "{text}");
    let text = told(r#"(a: "rubber", friction: 1)"#, "");
    assert!(text.contains("write the `material` of a collider"), "{text}");
    let text = told(r#"(a: "rubber", b: "basalt"), (a: "basalt", b: "rubber")"#, "");
    assert!(text.contains("are listed twice"), "{text}");
    let text = told(r#"(a: "rubber", b: "basalt", stiffness: 1e5)"#, "");
    assert!(text.contains("stiffness without compliant contact"), "{text}");
}

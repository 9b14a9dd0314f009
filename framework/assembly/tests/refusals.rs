//! Mistakes are rejected: message, line, column and remedy of each.
use crate::common::*;
use linkwork_assembly::*;

/// A simulation with these fields; the first line of `fields` is line 2.
fn sim(fields: &str) -> String {
    format!("Simulation(\n{fields}\n)")
}

/// A simulation whose only part is a rover with these fields, from line 3 on.
fn rover(fields: &str) -> String {
    sim(&format!("parts: {{ \"Rover\": (\n{fields}\n) }}"))
}

const MOTOR: &str = r#""Motor": (model: "test.motor", params: { "resistance": 1 }),"#;

/// Expects exactly these faults, in this order.
#[track_caller]
fn refused(text: &str, expected: &[&str]) {
    let shown = bad(text);
    let count = shown.matches("error: ").count();
    assert_eq!(count, expected.iter().filter(|e| !e.starts_with('+')).count(), "{shown}");
    let expected = expected.iter().map(|e| e.trim_start_matches('+'));
    for part in expected {
        assert!(shown.contains(part), "\n{part}\nis not in\n{shown}\nof\n{text}");
    }
}

#[test]
fn syntax_error() {
    refused(
        "Simulation(\n    step: \"1 ms\"\n    until: 3,\n)",
        &["error: not RON: expected comma", "+  --> sim.ron:3:5\n"],
    );
    refused(
        "Simulation(\n    parts: {\n        \"A\": (doc: \"x\"),\n)",
        &["sim.ron:4:1\n", "+help: the `{` at sim.ron:2:12 is never closed"],
    );
}

#[test]
fn slips_of_the_pen() {
    refused(
        "Simulation(step: 1 ms)",
        &[
            "not RON: expected comma\n  --> sim.ron:1:20\n  help: put a comma before this; write a quantity with a unit in quotes",
        ],
    );
    refused(
        "Simulation(\n parts: { A: (model: \"x\") })",
        &[
            "error: the keys of `{ .. }` must be texts in quotes\n  --> sim.ron:2:11\n  help: write { \"name\": .. } or (name: ..)",
        ],
    );
    refused(
        "Simulation(\n doc: \"x, step: 1)",
        &["expected end of string\n  --> sim.ron:2:7\n  help: close the text"],
    );
    for end in ["", "\n", " // the rest is missing\n"] {
        refused(
            &format!("Simulation(step: \"1 ms\", parts: {{{end}"),
            &["unexpected end of RON\n", "+help: the `{` at sim.ron:1:33 is never closed"],
        );
    }
    refused(
        "",
        &["unexpected end of RON\n  --> sim.ron:1:1\n  help: begin the file with `Simulation(`"],
    );
}

#[test]
fn duplicate_keys_of_maps_and_structs() {
    refused(
        &sim(
            "step: \"1 ms\",\nuntil: 3,\nstep: 4,\nparts: {\n  \"A\": (parts: {}),\n  \"A\": (parts: {}),\n}",
        ),
        &[
            "error: `step` is written twice\n  --> sim.ron:4:1\n  help: keep one of the two; the first is at sim.ron:2:1\n",
            "error: `A` is written twice\n  --> sim.ron:7:4\n  help: keep one of the two; the first is at sim.ron:6:4\n",
        ],
    );
}

#[test]
fn unknown_fields() {
    refused(
        &sim("stepp: \"1 ms\",\nparts: { \"A\": (model: \"test.pad\", binds: {}) }"),
        &[
            "error: simulation has no field `stepp`\n  --> sim.ron:2:1\n  help: did you mean `step`?",
            "error: part `A` has no field `binds`\n  --> sim.ron:3:35\n  help: did you mean `bind`?",
        ],
    );
    refused(
        &rover("bodies: { \"b\": (parent: \"world\",\n  hinje: Free) }"),
        &[
            "error: body `Rover/b` has no field `hinje`\n  --> sim.ron:4:3\n  help: did you mean `hinge`?",
        ],
    );
}

#[test]
fn wrong_kinds_of_values() {
    refused(
        &sim(
            "parts: { \"W\": (assembly: \"parts/wheel.ron\", params: 3, mounts: []), \"X\": 5, \"Y\": () }",
        ),
        &[
            "error: part `W`: `params` must be a map, but it is a number\n  --> sim.ron:2:53\n  help: write { \"name\": .. }",
            "error: part `W`: `mounts` must be a map, but it is a list\n  --> sim.ron:2:64\n",
            "error: `W`: required parameter `mass`",
            "error: `W`: mount `strut` is not bound",
            "error: part `X` must be `(field: ..)`, but it is a number\n  --> sim.ron:2:74\n",
            "error: part `Y` must be `(field: ..)`, but it is nothing\n  --> sim.ron:2:82\n  help: write (model:",
        ],
    );
    refused(
        &rover(
            "bodies: { \"b\": (parent: 3, at: [0, 0, 1], hinge: [0, 1, 0], nodes: { \"a b\": () }) }, wires: \"x\"",
        ),
        &[
            "`parent` must be a text, but it is a number\n  --> sim.ron:3:25\n  help: write it in double quotes",
            "`at` must be `(field: ..)`, but it is a list\n  --> sim.ron:3:32\n  help: fields: position, rotation",
            "`hinge` must be a hinge, but it is a list\n  --> sim.ron:3:50\n  help: one of: Pin, Slider",
            "`a b` cannot be the name of a node\n  --> sim.ron:3:71\n",
            "`wires` must be a list, but it is a text\n",
        ],
    );
    refused(
        "Rover(a: 1)",
        &[
            "`sim.ron` contains `Rover(..)`, which is not a simulation\n  --> sim.ron:1:1\n  help: begin the file with `Simulation(`",
        ],
    );
    refused(
        "Campaign(runs: 3)",
        &[
            "`sim.ron` contains `Campaign(..)`, which is not a simulation\n  --> sim.ron:1:1\n  help: run a campaign with the command `campaign`",
        ],
    );
    refused(
        &sim(
            "parts: {}, step: \"1 m\", integrator: rk5, log: [(rate: 1)], metrics: { \"f\": (of: \"x\", take: \"lst\", unit: \"metre\") }",
        ),
        &[
            "`step`: `1 m` is not a time\n  --> sim.ron:2:18\n",
            "there is no integrator `rk5`\n  --> sim.ron:2:37\n  help: did you mean `rk4`?",
            "`log`: item 1 has no `channels`\n",
            "`take`: there is no word `lst`",
            "`metre` is not a unit",
        ],
    );
    refused(
        &sim(
            "parts: {}, metrics: { \"a\": (take: last), \"b\": (of: \"x\", when: \"x > 1\"), \"c\": (when: \"x > 1\", unit: \"m\"), \"d\": (when: \"x > 1\", at: \"x > 2\") }",
        ),
        &[
            "metric `a`: it lacks a variable or a condition\n  --> sim.ron:2:24\n  help: write of: \"Part.output\", or when: \"Part.output > 1 N\"",
            "metric `b`: it has both a variable and a condition",
            "metric `c`: a condition does not have a unit",
            "metric `d`: `at` requires a variable",
        ],
    );
}

#[test]
fn a_field_of_the_wrong_record_is_found_in_the_right_one() {
    refused(
        &sim("bodies: { \"c\": (parent: \"world\", at: (rpy: [0, 0, 0], wide: 1)) }"),
        &[
            "`at` has no field `rpy`\n  --> sim.ron:2:39\n  help: write `rotation: (rpy: ..)`",
            "`at` has no field `wide`\n  --> sim.ron:2:55\n  help: fields: position, rotation",
        ],
    );
}

#[test]
fn assembly_parameters() {
    let wheel = |params: &str| {
        sim(&format!(
            "bodies: {{ \"c\": (parent: \"world\") }},\nparts: {{ \"W\": (assembly: \"parts/wheel.ron\",\n  mounts: {{ \"strut\": \"c\" }}, params: {{ {params} }}) }}"
        ))
    };
    good(&wheel("\"mass\": 1"));
    refused(
        &wheel(""),
        &[
            "error: `W`: required parameter `mass` is missing (Mass of the wheel, in kg)\n  --> sim.ron:3:11\n  help: write `params: { \"mass\": .. }`",
        ],
    );
    refused(
        &wheel("\"mass\": 1, \"radus\": 2"),
        &[
            "error: `W` has no parameter `radus`\n  --> sim.ron:4:51\n  help: did you mean `radius`?",
        ],
    );
    refused(
        &wheel("\"mass\": \"3 m\""),
        &["error: `W.mass`: `3 m` is in m, but kg is expected\n  --> sim.ron:4:47\n"],
    );
    refused(
        &wheel("\"mass\": 1, \"radius\": \"700 cm\""),
        &[
            "error: `W.radius` = 700 cm is out of range 0.001 .. 5 m\n  --> sim.ron:4:60\n  help: Rolling radius.",
        ],
    );
    refused(&wheel("\"mass\": NaN"), &["error: `W.mass` is not a number\n  --> sim.ron:4:47\n"]);
}

#[test]
fn a_unit_mistake_inside_an_assembly_points_at_the_value() {
    // A parameter with a unit of length cannot be a mass.
    refused(
        &rover(
            "params: { \"l\": (unit: \"m\", default: 2, doc: \"Length.\") },\nbodies: { \"b\": (parent: \"world\", mass: \"$l * 2\", inertia: [1, 1, 1]) }",
        ),
        &[
            "error: body `Rover/b`: `mass`: `4.0 m` is in m, but kg is expected\n  --> sim.ron:4:40\n",
        ],
    );
    refused(
        &rover(
            "params: { \"l\": (unit: \"m\", default: 2) },\nbodies: { \"b\": (parent: \"world\", com: [0, \"$ll / 2\", \"$l + \"]) }",
        ),
        &[
            "error: `$ll / 2`: there is no parameter `ll`\n  --> sim.ron:4:43\n  help: did you mean `l`?",
            "error: `$l + `: a number or a $name is missing at the end\n  --> sim.ron:4:54\n",
        ],
    );
}

#[test]
fn files_and_mounts() {
    refused(
        &sim("parts: { \"W\": (assembly: \"parts/weel.ron\") }"),
        &[
            "error: `W`: there is no assembly file `parts/weel.ron`\n  --> sim.ron:2:26\n  help: did you mean `parts/wheel.ron`? tried: embedded:",
        ],
    );
    refused(
        &sim("parts: { \"W\": (assembly: \"parts/wheel.ron\", params: { \"mass\": 1 }) }"),
        &[
            "error: `W`: mount `strut` is not bound (the body that carries the axle)\n  --> sim.ron:2:11\n  help: write `mounts: { \"strut\":",
        ],
    );
    let wheel = |mounts: &str| {
        sim(&format!(
            "bodies: {{ \"c\": (parent: \"world\") }},\nparts: {{ \"W\": (assembly: \"parts/wheel.ron\", params: {{ \"mass\": 1 }},\nmounts: {{ {mounts} }}) }}"
        ))
    };
    refused(
        &wheel("\"strut\": \"c\", \"stroot\": \"c\""),
        &[
            "error: `W` does not have a mount `stroot`\n  --> sim.ron:4:26\n  help: did you mean `strut`?",
        ],
    );
    refused(
        &wheel("\"strut\": \"chassis\""),
        &["error: `W`: mount `strut`: there is no body `chassis`\n  --> sim.ron:4:20\n"],
    );
    refused(
        &wheel("\"strut\": \"c/left\""),
        &[
            "error: `W`: mount `strut`: body `c` has no node `left`\n  --> sim.ron:4:20\n  help: there are no nodes",
        ],
    );
}

#[test]
fn recursion_of_assemblies() {
    let catalogue = catalogue();
    let a = "Assembly(parts: {\n \"B\": (assembly: \"b.ron\") })";
    let b = "Assembly(parts: {\n \"A\": (assembly: \"a.ron\") })";
    let options = Options::new(&catalogue).embed("a.ron", a).embed("b.ron", b);
    let f = load_text("s.ron", "Simulation(assembly: \"a.ron\")", &options).err().unwrap();
    let shown = f.show(Look::Plain);
    assert!(
        shown.contains("contains itself: a.ron -> b.ron -> a.ron\n  --> b.ron:2:18\n"),
        "{shown}"
    );
    // The assembly is also rejected if it is loaded directly.
    let f = load_text("a.ron", a, &options).err().unwrap().show(Look::Plain);
    assert!(f.contains("contains itself"), "{f}");
}

#[test]
fn bindings_and_parents() {
    let bodies = "bodies: { \"wheel\": (parent: \"world\", hinge: Pin([0,1,0]), nodes: { \"hub\": () }) },\n";
    let with = |bind: &str| {
        rover(&format!("{bodies}parts: {{ \"P\": (model: \"test.pad\", bind: {{ {bind} }}) }}"))
    };
    good(&with("\"hub\": \"node:wheel/hub\""));
    refused(
        &with("\"hub\": \"node:whel/hub\""),
        &[
            "error: `Rover.P`: binding `hub`: there is no body `whel/hub`\n  --> sim.ron:4:50\n  help: did you mean `wheel`?",
        ],
    );
    refused(
        &with("\"hub\": \"node:wheel/hob\""),
        &[
            "binding `hub`: body `Rover/wheel` has no node `hob`\n  --> sim.ron:4:50\n  help: did you mean `hub`? nodes: hub",
        ],
    );
    refused(
        &with("\"hub\": \"hinge:wheel/hub\""),
        &[
            "is the node `hub` of `Rover/wheel`; a hinge is named by its body",
            "+write \"hinge:wheel\"",
        ],
    );
    refused(
        &rover("bodies: { \"a\": (parent: \"b\"), \"c\": (parent: \"cassis\") }"),
        &[
            "error: body `Rover/a`: parent: there is no body `b`\n  --> sim.ron:3:25\n",
            "`cassis`\n  --> sim.ron:3:45\n",
        ],
    );
    refused(
        &rover("bodies: { \"a\": (parent: \"b\"), \"b\": (parent: \"a\") }"),
        &[
            "error: bodies form a cycle: Rover/a -> Rover/b -> Rover/a\n  --> sim.ron:3:25\n  help: attach one of them to `world`",
        ],
    );
}

#[test]
fn wires_and_exports() {
    let with = |wire: &str| {
        rover(&format!(
            "parts: {{ {MOTOR} \"D\": (model: \"test.drive\"), \"In\": (parts: {{ {MOTOR} }}, exports: {{ \"volts\": \"Motor.volts\" }}),\n  \"M\": (model: \"test.motor\", params: {{ \"resistance\": 1 }}, array: [(), (), ()]) }},\nwires: [ {wire} ]"
        ))
    };
    good(&with("\"D.volts[0] -> In.volts\""));
    refused(
        &with("\"D.volts -> Motr.volts\""),
        &[
            "error: wire `D.volts -> Motr.volts`: there is no part `Motr` here\n  --> sim.ron:5:10\n  help: did you mean `Motor`? parts:",
        ],
    );
    refused(
        &with("\"D.volts[0] -> In.vlts\""),
        &[
            "`Rover.In` does not export `vlts`\n  --> sim.ron:5:10\n  help: did you mean `volts`? exports: volts",
        ],
    );
    refused(
        &with("\"D.volts[0] -> In.Meter.x\""),
        &["`Rover.In` has no part `Meter`\n  --> sim.ron:5:10\n"],
    );
    refused(
        &with("\"D.volts In.volts\""),
        &[
            "a wire must have one `->`\n  --> sim.ron:5:10\n  help: write \"Part.output -> Part.input\"",
        ],
    );
    refused(&with("\"D.volts -> \""), &["is not the path of a port\n  --> sim.ron:5:10\n"]);
    refused(
        &with("\"D.volts[x] -> In.volts\""),
        &["`[x]` is neither a number nor `*`\n  --> sim.ron:5:10\n"],
    );
    refused(
        &with("\"D.volts[*] -> M[*].volts\""),
        &[
            "`[*]` is 2 on the left but 3 on the right\n  --> sim.ron:5:10\n  help: use equal numbers on both sides",
        ],
    );
    refused(
        &with("\"D.volts -> M.volts\""),
        &[
            "`M` is an array of parts\n  --> sim.ron:5:10\n  help: write `M[*]`, or one of: M1, M2, M3",
        ],
    );
    refused(
        &rover(&format!(
            "parts: {{ {MOTOR} }},\nexports: {{ \"a\": \"Motor.volt\", \"b\": \"Moter.volts\" }}"
        )),
        &[
            "error: export `a: \"Motor.volt\"`: `Rover.Motor` (test.motor) has no port `volt`\n  --> sim.ron:4:17\n  help: did you mean `volts`?",
            "error: export `b: \"Moter.volts\"`: `Rover` has no part `Moter`\n  --> sim.ron:4:36\n  help: did you mean `Motor`?",
        ],
    );
}

#[test]
fn overrides() {
    let with = |o: &str| {
        rover(&format!(
            "parts: {{ {MOTOR} \"In\": (parts: {{ {MOTOR} }}) }},\noverrides: {{ {o} }}"
        ))
    };
    good(&with("\"In.Motor.gear\": 2, \"*.gear\": 3, \"*.*.gear\": 4"));
    refused(
        &with("\"In.Moter.gear\": 2"),
        &[
            "error: override `In.Moter.gear` matches nothing\n  --> sim.ron:4:15\n  help: did you mean `Motor`? `Rover.In` has no part `Moter`; parts: Motor",
        ],
    );
    refused(
        &with("\"In.Motor.geer\": 2"),
        &[
            "error: override `In.Motor.geer` matches nothing\n  --> sim.ron:4:15\n  help: `Rover.In.Motor` (test.motor) has no such parameter. did you mean `gear`?",
        ],
    );
    refused(
        &with("\"In.Motor\": 2, \"/b.mass\": 1, \"In\": 3"),
        &[
            "`Rover.In.Motor` (test.motor) is a part: add a parameter. parameters: resistance, gear",
            "help: `Rover` has no body `b`. there are no bodies",
            "help: `Rover.In` is an assembly: add a parameter. there are no parameters",
        ],
    );
    refused(
        &with("\"*.*.*.gear\": 2"),
        &["override `*.*.*.gear` matches nothing\n  --> sim.ron:4:15\n"],
    );
    let catalogue = catalogue();
    let set = |what: &str| {
        let o = options(&catalogue).set(what);
        load_text("sim.ron", SIM, &o)
    };
    assert!(set("Rover.Hardware.Wheel1.Motor.resistance=0.7 ohm").is_ok());
    let f = set("Rover.Hardwear.Wheel1.mass=3 kg").err().unwrap().show(Look::Plain);
    assert!(
        f.contains("matches nothing\n  --> --set:1:1\n  help: did you mean `Hardware`?"),
        "{f}"
    );
    let f = set("Rover.Hardware.Wheel1.mass=3 m").err().unwrap().show(Look::Plain);
    assert!(f.contains("`3 m` is in m, but kg is expected\n  --> --set:1:28\n"), "{f}");
    let f = set("Rover.Hardware.Wheel1.Motor.rate=5Hz").err().unwrap().show(Look::Plain);
    let wanted = "`rate` is not a parameter of `Rover.Hardware.Wheel1.Motor` (test.motor), but a field in the file that contains the part";
    assert!(f.contains(wanted) && f.contains("parameters: resistance, gear"), "{f}");
    let f = set("seed").err().unwrap().show(Look::Plain);
    assert!(f.contains("has no `=`\n  --> --set:1:1\n"), "{f}");
}

#[test]
fn bodies_that_cannot_exist() {
    refused(
        &rover("bodies: { \"b\": (parent: \"world\", mass: 1,\n  inertia: [1, 1, 5]) }"),
        &["error: body `Rover/b`: largest principal moment 5 kg m² exceeds", "+--> sim.ron:4:12\n"],
    );
    refused(
        &rover("bodies: { \"b\": (parent: \"world\", mass: 1) }"),
        &[
            "error: body `Rover/b` has mass but lacks `inertia`\n  --> sim.ron:3:12\n  help: write `inertia:",
        ],
    );
    refused(
        &rover("bodies: { \"b\": (parent: \"world\", hinge: Pin([0, 0, 0])) }"),
        &[
            "error: body `Rover/b`: `hinge`: `Pin`: `axis` has the length zero\n  --> sim.ron:3:45\n  help: write for example [0, 0, 1]",
        ],
    );
    refused(
        &rover("bodies: { \"b\": (parent: \"world\", hinge: Pinn([0, 0, 1])) }"),
        &[
            "error: body `Rover/b`: `hinge`: there is no hinge `Pinn`\n  --> sim.ron:3:41\n  help: did you mean `Pin`?",
        ],
    );
    refused(
        &rover("bodies: { \"b\": (parent: \"world\", hinge: Locked, initial: (angle: 1)) }"),
        &["`initial` cannot be set for this hinge\n  --> sim.ron:3:58\n"],
    );
    refused(
        &rover(
            "bodies: { \"b\": (parent: \"world\", at: (position: [0, NaN, \"1 kg\"], rotation: (quat: [1, 1, 0, 0]))) }",
        ),
        &[
            "`position` is NaN\n  --> sim.ron:3:53\n",
            "`1 kg` is in kg, but m is expected\n  --> sim.ron:3:58\n",
            "`quat` has length 1.41",
        ],
    );
}

#[test]
fn all_mistakes_are_reported_together_in_the_order_of_the_files() {
    let catalogue = catalogue();
    let wheel =
        WHEEL.replace("parent: \"strut\"", "parent: \"strutt\"").replace("600 mohm", "$ohms");
    let options = options(&catalogue).embed("parts/wheel.ron", wheel);
    let text = SIM
        .replace("until: \"120 s\"", "until: \"120 m\"")
        .replace("rk4", "rk5")
        .replace("seed: 7", "seed: 7.5");
    let f = load_text("sim.ron", &text, &options).err().unwrap();
    let shown = f.show(Look::Plain);
    assert_eq!(f.faults.len(), 4, "{shown}");
    assert!(shown.contains("(and 1 more like it)"), "{shown}");
    let places: Vec<_> = f.faults.iter().map(|x| x.origin).collect();
    assert!(places.is_sorted(), "{shown}");
    for look in [Look::Drawn, Look::Coloured] {
        assert!(f.show(look).contains("4 mistakes"));
    }
    assert!(f.render(true).contains('\u{1b}') && !f.render(false).contains('\u{1b}'));
}

#[test]
fn numbers_of_place_and_view_have_units_and_are_never_zero_by_mistake() {
    let place = "body: \"b\", at: [0, 0], wheels: [\"b\"], radius: \"25 cm\"";
    let ok = good(&format!(
        "Simulation(parts: {{}}, place: ({place}, heading: \"90 deg\"), \
         view: (eye: [\"10 cm\", 0, 1], rate: \"20 Hz\", arrows: [(at: \"a\", along: \"b\", scale: 0.5)]))"
    ));
    let (place_form, view) = (&ok.simulation.place[0], ok.simulation.view.unwrap());
    assert_eq!(place_form.radius, [0.25]);
    assert_eq!(place_form.heading, std::f64::consts::FRAC_PI_2);
    assert_eq!((view.eye.unwrap().x, view.arrows[0].scale), (0.1, 0.5));
    for (fields, fact) in [
        ("place: (PLACE, heading: \"north\")", "`heading`: `north` is not a quantity\n"),
        ("place: (PLACE, heading: \"1 m\")", "`1 m` is in m, but rad is expected"),
        ("place: (body: \"b\", at: [0, 0], wheels: [], radius: \"0.25 kg\")", "`0.25 kg` is in kg"),
        ("place: (body: \"b\", at: [0, 0], wheels: [], radius: 0)", "`radius` is 0 m\n"),
        ("place: (body: \"b\", at: [0, 0], wheels: [], radius: [0.1, 0])", "item 2 is 0 m\n"),
        (
            "place: (body: \"b\", at: [0], wheels: [], radius: 1)",
            "`at` must have 2 numbers, but it has 1",
        ),
        ("place: (body: \"b\", at: [0, 0], wheels: [])", "`place` has no `radius`\n"),
        ("place: (PLACE, headng: 0)", "`place` has no field `headng`\n"),
        ("place: (PLACE, joints: [3])", "`joints`: item 1 must be a text, but it is a number"),
        ("view: (rate: \"often\")", "`rate`: `often` is not a time\n"),
        ("view: (eye: [0, 1])", "`eye` must have 3 numbers, but it has 2"),
        (
            "view: (arrows: [(at: \"a\", along: \"b\", scale: \"big\")])",
            "`scale`: `big` is not a quantity",
        ),
        ("view: (arrows: [(at: \"a\", along: \"b\", color: [2, 0, 0])])", "outside 0 .. 1"),
        (
            "view: (arrows: [(at: \"a\", along: \"b\", color: [1, 0])])",
            "must be a colour, but it has 2 numbers",
        ),
        ("view: (arrows: [(along: \"b\")])", "`arrows`: item 1 has no `at`\n"),
        (
            "accuracy: (absolute: \"tiny\"), integrator: \"dormand_prince_54\"",
            "`tiny` is not a quantity",
        ),
    ] {
        faults(&format!("Simulation(parts: {{}}, {})", fields.replace("PLACE", place)), &[fact]);
    }
}

#[test]
fn a_misspelt_parameter_is_one_mistake() {
    let motor = "Simulation(parts: { \"M\": (model: \"test.motor\", params: { \"resistanse\": 1 }) }, x: 1)";
    faults(
        motor,
        &["`M` has no parameter `resistanse`\n", "+did you mean `resistance`?", "no field `x`"],
    );
    let both = motor.replace("\"resistanse\"", "\"gaer\"");
    faults(&both, &["`M` has no parameter `gaer`", "`resistance` is missing", "no field `x`"]);
}

#[test]
fn what_a_hinge_does_not_take_is_refused() {
    for (hinge, fact) in [
        ("Ball(3)", "`hinge`: `Ball` accepts only fields, but there is a number"),
        ("Ball(axis: [0, 0, 1])", "`Ball` has no field `axis`"),
        ("Pin(axis: [0, 0, 1], pitch: 1)", "`Pin` has no field `pitch`"),
        ("Pin", "`Pin` has no `axis`"),
    ] {
        let text = format!("Simulation(bodies: {{ \"b\": (parent: \"world\", hinge: {hinge}) }})");
        faults(&text, &[fact]);
    }
}

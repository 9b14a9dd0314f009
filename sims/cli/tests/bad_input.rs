//! Every mistake is reported before anything is written, with its position, both ends and a remedy.
use crate::common;
use common::{Lab, edited, names, sim};

/// Runs an edited file: the exit code is 2, each of `wanted` is printed once, and nothing is written.
#[track_caller]
fn refused(edits: &[(&str, &str)], wanted: &[&str]) -> String {
    let lab = Lab::new();
    lab.write("bad.ron", &edited(edits));
    let said = lab.run("bad.ron", "out", &[]).code(2).tells(wanted);
    assert_eq!(lab.files(), ["bad.ron"], "something was written");
    assert!(!said.err.contains('\u{1b}') && !said.err.contains(",-["), "not plain:\n{}", said.err);
    assert_eq!(said.out, "");
    said.err
}

/// One mistake gives one message; its consequences are not reported.
#[track_caller]
fn one(edits: &[(&str, &str)], wanted: &[&str]) {
    let err = refused(edits, wanted);
    assert_eq!(err.matches("error: ").count(), 1, "one mistake, several messages:\n{err}");
    assert!(err.contains("help: "), "no remedy:\n{err}");
}

#[test]
fn the_base_file_runs() {
    let lab = Lab::new();
    lab.write("good.ron", common::BASE);
    lab.run("good.ron", "out", &[]).code(0);
    assert_eq!(names(&lab.path("out")), ["plots.svg", "run.mcap", "summary.json"]);
}

#[test]
fn misspelt_names() {
    one(
        &[("\"damping\"", "\"dampign\"")],
        &["`Friction` has no parameter `dampign`", "--> bad.ron:10:", "did you mean `damping`?"],
    );
    one(
        &[("basics.gain", "basics.gian")],
        &[
            "`Gain`: there is no model `basics.gian`",
            "--> bad.ron:12:25",
            "did you mean `basics.gain`?",
        ],
    );
    one(
        &[("Source.y -> Gain.u", "Source.z -> Gain.u")],
        &[
            "wire `Source.z -> Gain.u`: `Source` has no output `z`",
            "--> bad.ron:15:13",
            "outputs: y",
        ],
    );
    one(
        &[("Source.y -> Gain.u", "Sauce.y -> Gain.u")],
        &[
            "wire `Sauce.y -> Gain.u`: there is no part `Sauce`",
            "--> bad.ron:15:13",
            "did you mean `Source`?",
        ],
    );
    one(
        &[("until:", "untill:")],
        &["simulation has no field `untill`", "--> bad.ron:16:5", "did you mean `until`?"],
    );
    one(
        &[("parent: \"world\"", "parent: \"wrld\"")],
        &[
            "body `bob`: parent: there is no body `wrld`",
            "--> bad.ron:4:21",
            "did you mean `world`?",
        ],
    );
    one(
        &[("until:", "integrator: \"euler\", until:")],
        &["there is no integrator `euler`", "--> bad.ron:16:17", "semi_implicit_euler"],
    );
    let err = refused(
        &[("Source.y -> Gain.u", "Source.y -> Gain.w")],
        &["`Gain` has no input `w`", "inputs: u"],
    );
    assert_eq!(err.matches("--> bad.ron:15:13").count(), 1, "{err}");
}

#[test]
fn written_twice() {
    one(
        &[("\"Gain\": (model", "\"Source\": (model")],
        &["`Source` is written twice", "--> bad.ron:12:10", "the first is at bad.ron:11:10"],
    );
    one(
        &[("mass: \"1 kg\",", "mass: \"1 kg\", mass: 2,")],
        &["`mass` is written twice", "--> bad.ron:5:27", "bad.ron:5:13"],
    );
    one(
        &[("\"damping\": 0.05", "\"damping\": 0.05, \"damping\": 0.1")],
        &["`damping` is written twice", "--> bad.ron:10:84", "bad.ron:10:67"],
    );
}

#[test]
fn wrong_values() {
    one(
        &[("mass: \"1 kg\"", "mass: \"1 m\"")],
        &[
            "body `bob`: `mass`: `1 m` is in m, but kg is expected",
            "--> bad.ron:5:19",
            "a text with a unit such as \"1 kg\"",
        ],
    );
    one(
        &[("\"1 s\" }", "\"1 kg\" }")],
        &["`Lag.time_constant`: `1 kg` is in kg, but s is expected", "--> bad.ron:13:65"],
    );
    one(
        &[("\"1 s\" }", "\"0 s\" }")],
        &["`Lag.time_constant` = 0 s is out of range 1e-9 ..", "--> bad.ron:13:65"],
    );
    one(&[("\"k\": 2", "\"k\": NaN")], &["`Gain.k` is not a number (NaN)", "--> bad.ron:12:55"]);
    one(
        &[("\"k\": 2", "\"k\": \"two\"")],
        &["`Gain.k`: `two` is not a quantity", "--> bad.ron:12:55"],
    );
    one(
        &[("until: \"1 s\"", "until: \"1 m\"")],
        &["`until`: `1 m` is not a time", "--> bad.ron:16:12", "min"],
    );
    one(
        &[("until:", "step: 0, until:")],
        &["the integration step is zero", "--> bad.ron:16:11", "\"1 ms\""],
    );
    one(
        &[("rate: \"20 Hz\")", "rate: \"20 kg\")")],
        &["`view`: `rate`: `20 kg` is not a time", "--> bad.ron:20:33", "help: "],
    );
}

#[test]
fn bodies_that_cannot_be() {
    one(
        &[("inertia: Sphere(0.1)", "inertia: [1, 1, 3]")],
        &[
            "body `bob`: largest principal moment 3 kg m² exceeds the sum of the others",
            "--> bad.ron:5:53",
            "about the centre of mass",
        ],
    );
    one(
        &[("inertia: Sphere(0.1)", "inertia: [-1, 1, 1]")],
        &[
            "body `bob`: smallest principal moment of inertia is -1 kg m², below zero",
            "--> bad.ron:5:",
        ],
    );
    one(
        &[("mass: \"1 kg\"", "mass: \"-1 kg\"")],
        &["body `bob`: mass -1 kg is negative", "--> bad.ron:5:"],
    );
    one(
        &[("mass: \"1 kg\"", "mass: 0")],
        &["`bob`", "its hinge moves no mass", "--> bad.ron:", "armature"],
    );
}

#[test]
fn wires_that_cannot_be() {
    one(
        &[("\"Gain.y -> Lag.u\"", "\"Gain.y -> Lag.u\", \"Source.y -> Lag.u\"")],
        &[
            "wire `Source.y -> Lag.u`: input `Lag.u` is wired twice; the other wire is `Gain.y -> Lag.u`",
            "--> bad.ron:15:54",
        ],
    );
    one(
        &[("\"Source.y -> Gain.u\", ", "")],
        &["required input `Gain.u` is not wired", "--> bad.ron:12:10", "add a wire `… -> Gain.u`"],
    );
    let circle = [
        (
            "\"Source\": (model: \"basics.constant\", params: { \"value\": 1 })",
            "\"Source\": (model: \"basics.gain\", params: { \"k\": 1 })",
        ),
        ("\"Source.y -> Gain.u\"", "\"Source.y -> Gain.u\", \"Gain.y -> Source.u\""),
    ];
    one(
        &circle,
        &[
            "algebraic loop of feedthrough outputs through Gain, Source: `Gain.y -> Source.u`, `Source.y -> Gain.u`",
            "--> bad.ron:15:",
            "`delay: 1`",
        ],
    );
}

#[test]
fn the_remedy_for_a_loop_works() {
    let lab = Lab::new();
    lab.write(
        "delayed.ron",
        &edited(&[
            (
                "\"Source\": (model: \"basics.constant\", params: { \"value\": 1 })",
                "\"Source\": (model: \"basics.gain\", params: { \"k\": 1 })",
            ),
            (
                "\"Source.y -> Gain.u\"",
                "\"Source.y -> Gain.u\", (wire: \"Gain.y -> Source.u\", delay: 1)",
            ),
        ]),
    );
    lab.run("delayed.ron", "out", &[]).code(0);
}

#[test]
fn patterns_and_bindings_that_match_nothing() {
    one(
        &[("until:", "overrides: { \"Gian.k\": 3 },\n    until:")],
        &["override `Gian.k` matches nothing", "--> bad.ron:16:19", "did you mean `Gain`?"],
    );
    one(
        &[("[\"**\"]", "[\"Nothing.**\"]")],
        &["`Nothing.**` matches no variable", "--> bad.ron:17:23", "linkwork list"],
    );
    one(
        &[("\"bob.rate\"", "\"bob.rat\"")],
        &[
            "metric `largest speed`: there is no variable `bob.rat`",
            "--> bad.ron:18:38",
            "did you mean `bob.rate`?",
        ],
    );
    one(
        &[("[\"bob.angle\"]", "[\"bub.*\"]")],
        &["`bub.*` matches no variable", "--> bad.ron:19:35"],
    );
    one(
        &[("follow: \"bob\"", "follow: \"bub\"")],
        &["`view`: `follow`: `bub` matches no body", "--> bad.ron:20:20", "did you mean `bob`?"],
    );
    one(
        &[("\"hinge:bob\"", "\"hinge:bub\"")],
        &[
            "`Friction`: binding `shaft`: there is no body `bub`",
            "--> bad.ron:10:102",
            "did you mean `bob`?",
        ],
    );
    one(
        &[("\"hinge:bob\"", "\"node:bob\"")],
        &[
            "binding `shaft` is served by a hinge, but `node bob` is not one",
            "--> bad.ron:10:102",
            "hinge:",
        ],
    );
    one(
        &[("until: \"1 s\"", "stop_when: \"bob.done\"")],
        &["stop_when: there is no variable `bob.done`", "--> bad.ron:16:16"],
    );
    one(
        &[("unit: \"rad/s\"", "unit: \"kg\"")],
        &[
            "metric `largest speed`: `bob.rate` is in rad/s, which is a different quantity than kg",
            "--> bad.ron:18:",
        ],
    );
    one(
        &[("unit: \"deg\"", "unit: \"kg\"")],
        &[
            "plot `Angle`: `bob.angle` is in rad, which is a different quantity than kg",
            "--> bad.ron:19:",
        ],
    );
}

#[test]
fn several_mistakes_in_one_report() {
    let err = refused(
        &[
            ("\"k\": 2", "\"k\": \"two\""),
            ("\"damping\"", "\"dampign\""),
            ("\"1 s\" }", "\"1 kg\" }"),
        ],
        &["bad.ron:10:", "bad.ron:12:55", "bad.ron:13:65"],
    );
    assert_eq!(err.matches("error: ").count(), 3, "{err}");
    let err = refused(
        &[
            ("\"bob.rate\"", "\"bob.rat\""),
            ("[\"**\"]", "[\"No.**\"]"),
            ("[\"bob.angle\"]", "[\"bub.*\"]"),
            ("follow: \"bob\", rate", "follow: \"bub\", trails: \"bib\", rate"),
        ],
        &[
            "bad.ron:17:",
            "bad.ron:18:",
            "bad.ron:19:",
            "`bub` matches no body",
            "`bib` matches no body",
        ],
    );
    assert_eq!(err.matches("error: ").count(), 5, "{err}");
}

/// A file whose values would fill the memory, or whose mistakes would fill the terminal.
#[test]
fn what_grows_without_end_is_refused_or_counted() {
    let lab = Lab::new();
    let doubling = |one: &dyn Fn(usize) -> String| {
        let params: String =
            (1..40).map(|k| format!("\"p{k}\": (default: {}), ", one(k - 1))).collect();
        format!(
            "Simulation(params: {{\"p0\": (default: \"x\"), {params}}}, parts: {{\"A\": (model: \"basics.constant\", \
             params: {{\"value\": \"$p39\"}})}}, until: \"1 s\")"
        )
    };
    for one in [(&|k| format!("\"${{p{k}}}${{p{k}}}\"")) as &dyn Fn(usize) -> String, &|k| {
        format!("[\"$p{k}\", \"$p{k}\"]")
    }] {
        lab.write("double.ron", &doubling(one));
        lab.linkwork(&["check", "double.ron"]).code(2).tells(&["is larger than 1 MiB", "help: "]);
    }
    // Assemblies that contain the next one twice, or a long chain of assemblies.
    for (depth, times, fact) in [
        (25, 2, "has more than 500000 parts and bodies"),
        (2000, 1, "nested in 100 other assemblies"),
    ] {
        for k in 0..depth {
            let part = |n: usize| format!("\"P{n}\": (assembly: \"a{}.ron\"), ", k + 1);
            let parts: String = (0..times).map(part).collect();
            lab.write(&format!("a{k}.ron"), &format!("Assembly(parts: {{{parts}}})"));
        }
        lab.write(&format!("a{depth}.ron"), "Assembly(bodies: { \"b\": (parent: \"world\", hinge: Free, mass: 1, inertia: [1, 1, 1]) })");
        lab.write(
            "nested.ron",
            "Simulation(parts: { \"A\": (assembly: \"a0.ron\") }, until: \"1 s\")",
        );
        let said = lab.linkwork(&["check", "nested.ron"]).code(2);
        assert!(said.err.contains(fact) && said.err.contains("help: "), "{}", said.err);
        assert_eq!(said.err.matches("error: ").count(), 1, "{}", said.err);
    }
    let many = |model: &str| {
        let parts: String = (0..2000)
            .map(|k| format!("\"P{k}\": (model: \"{model}\", params: {{\"value\": 1}}),\n"))
            .collect();
        format!("Simulation(parts: {{{parts}}}, until: \"1 s\")")
    };
    lab.write("many.ron", &many("basics.konstant"));
    let said = lab.linkwork(&["check", "many.ron"]).code(2);
    assert_eq!(said.err.matches("error: ").count(), 101);
    assert!(said.err.contains("and 1900 more mistakes"), "{}", said.err);
    lab.write("many.ron", &many("basics.constant"));
    let said = lab.linkwork(&["check", "many.ron"]).code(0);
    assert_eq!(said.err.matches("warning: ").count(), 101);
    assert!(said.err.contains("and 1900 more warnings"), "{}", said.err);
}

/// A device never ends, and reading a pipe waits for its writer.
#[cfg(unix)]
#[test]
fn only_regular_files_are_read() {
    let lab = Lab::new();
    let pipe = lab.path("pipe.png");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
    assert!(made.success());
    lab.linkwork(&["check", "/dev/zero"]).code(2).tells(&["not a regular file"]);
    lab.linkwork(&["check", "pipe.png"]).code(2).tells(&["not a regular file"]);
    let field = |file: &str| {
        edited(&[(
            "\"Source\": (",
            &format!(
                "\"Ground\": (model: \"environment.height_field\", params: {{ \"file\": \"{file}\", \"spacing\": \
                 (1, 1) }}), \"Source\": ("
            ),
        )])
    };
    for file in ["/dev/zero", "pipe.png"] {
        lab.write("sim.ron", &field(file));
        lab.linkwork(&["check", "sim.ron"]).code(2).tells(&["neither a file nor a folder"]);
    }
    let mesh = edited(&[(
        "inertia: Sphere(0.1),",
        "inertia: Sphere(0.1), shapes: [(shape: Hull(file: \"/dev/zero\"))],",
    )]);
    lab.write("sim.ron", &mesh);
    let said = lab.linkwork(&["check", "sim.ron"]).code(2);
    assert!(said.err.contains("error: "), "{}", said.err);
}

#[test]
fn text_that_is_no_ron() {
    one(
        &[("until: \"1 s\",", "until: \"1 s\"")],
        &["expected comma", "--> bad.ron:17:5", "put a comma before this"],
    );
    one(
        &[("    wires: [", "    wires: (")],
        &["--> bad.ron:15:52", "the `(` at bad.ron:15:12 is never closed"],
    );
}

#[test]
fn a_folder_without_sim_ron_lists_its_simulations() {
    let lab = Lab::new();
    let run = |wanted: &str| {
        lab.linkwork(&["run", "site"]).code(2).tells(&["there is no simulation", wanted]);
    };
    std::fs::create_dir(lab.path("site")).unwrap();
    run("give a sim.ron file or the folder that contains it");
    lab.write("site/note.ron", "Assembly()");
    lab.write("site/b.ron", &format!("// A hill.\n\n{}", common::BASE.trim_start()));
    run("help: give the simulation in this folder: `site/b.ron`");
    lab.write("site/a.ron", "Simulation()");
    run("help: give a simulation in this folder: `site/a.ron`, `site/b.ron`");
}

#[test]
fn files_that_are_missing() {
    let lab = Lab::new();
    lab.run("none", "out", &[]).code(2).tells(&["none", "help: "]);
    lab.run("none.ron", "out", &[]).code(2).tells(&["none.ron", "help: "]);
    lab.resume("none.lwck", "out", &[]).code(2).tells(&["none.lwck", "help: "]);
    lab.linkwork(&["diff", "a.mcap", "b.mcap"]).code(2).tells(&["a.mcap", "b.mcap"]);
    assert!(lab.files().is_empty());
    one(
        &[(
            "\"Gain\": (model: \"basics.gain\", params: { \"k\": 2 })",
            "\"Gain\": (assembly: \"gian.ron\")",
        )],
        &["`Gain`: there is no assembly file `gian.ron`", "--> bad.ron:12:28", "tried: "],
    );
    one(
        &[(
            "\"Source\": (",
            "\"Ground\": (model: \"environment.height_field\", params: { \"file\": \"none.tif\" }),\n\"Source\": (",
        )],
        &["`Ground", "none.tif", "--> bad.ron:11:"],
    );
}

/// A grey GeoTIFF of 64-bit heights, 1 m apart, with GDAL's no-data value.
fn geotiff(nx: u16, ny: u16, missing: f32, heights: &[f32]) -> Vec<u8> {
    let (n, entries) = (heights.len() * 4, 13u16);
    let extra = 8 + 2 + 12 * entries as usize + 4;
    let (scale, tie, pixels) = (extra, extra + 24, extra + 72);
    let text = format!("{missing}\0");
    let (nodata, total) = (pixels + n, pixels + n + text.len());
    let mut out = b"II*\0\x08\0\0\0".to_vec();
    out.extend(entries.to_le_bytes());
    let mut tag = |id: u16, kind: u16, count: usize, value: usize| {
        out.extend(id.to_le_bytes());
        out.extend(kind.to_le_bytes());
        out.extend((count as u32).to_le_bytes());
        out.extend((value as u32).to_le_bytes());
    };
    for (id, value) in [(256, nx as usize), (257, ny as usize), (258, 32), (259, 1), (262, 1)] {
        tag(id, 3, 1, value);
    }
    tag(273, 4, 1, pixels);
    tag(277, 3, 1, 1);
    tag(278, 3, 1, ny as usize);
    tag(279, 4, 1, n);
    tag(339, 3, 1, 3);
    tag(33550, 12, 3, scale);
    tag(33922, 12, 6, tie);
    tag(42113, 2, text.len(), nodata);
    out.extend([0; 4]);
    for v in [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, -10.0, f64::from(ny) - 11.0, 0.0] {
        out.extend(f64::to_le_bytes(v));
    }
    out.extend(heights.iter().flat_map(|h| h.to_le_bytes()));
    out.extend(text.bytes());
    assert_eq!(out.len(), total);
    out
}

const CART: &str = r#"Simulation(
    bodies: {
        "cart": (parent: "world", hinge: Free, mass: 100, inertia: Box([2, 1, 0.5])),
        "left": (parent: "cart", at: (position: [0, 0.5, 0]), hinge: Pin([0, 1, 0]), mass: 5, inertia: Cylinder(radius: 0.25, length: 0.1, axis: [0, 1, 0])),
        "right": (parent: "cart", at: (position: [0, -4.5, 0]), hinge: Pin([0, 1, 0]), mass: 5, inertia: Cylinder(radius: 0.25, length: 0.1, axis: [0, 1, 0])),
    },
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -3.72076] }),
        "Ground": (model: "environment.height_field", params: { "file": "dem.tif", "soil": { "kind": "lunar" } }),
    },
    until: "0.1 s",
    place: (body: "cart", at: [0, 0], wheels: ["left", "right"], radius: "0.25 m"),
)
"#;

#[test]
fn no_ground_under_a_wheel() {
    let lab = Lab::new();
    lab.write("machine/sim.ron", CART);
    let put = |heights: &[f32]| {
        std::fs::write(lab.path("machine/dem.tif"), geotiff(21, 21, -9999.0, heights)).unwrap();
    };
    let flat = [0.0; 21 * 21];
    put(&flat);
    // The map is in the folder of the simulation file, wherever the command is run.
    lab.run("machine", "flat", &[]).code(0);
    // Rows run from north to south, so y decreases from 10 to -10.
    let mut hole = flat;
    for row in 13..16 {
        hole[row * 21..(row + 1) * 21].fill(-9999.0);
    }
    put(&hole);
    lab.run("machine", "out", &[]).code(2).tells(&[
        "no ground under `right` at (0.000, -4.500)",
        "sim.ron:12:12",
        "help: ",
    ]);
    put(&[-9999.0; 21 * 21]);
    lab.run("machine", "out", &[]).code(2).tells(&["help: "]);
    std::fs::write(lab.path("machine/dem.tif"), b"II*\0 no picture").unwrap();
    lab.run("machine", "out", &[]).code(2).tells(&["`Ground", "dem.tif", "TIFF", "sim.ron:9:"]);
    assert_eq!(lab.files(), ["flat", "machine"]);
}

#[test]
fn a_bad_command_line() {
    let lab = Lab::new();
    let pendulum = sim("pendulum");
    let run = |more: &[&str], wanted: &[&str]| {
        lab.run(&pendulum, "out", more).code(2).tells(wanted);
        assert!(lab.files().is_empty(), "{more:?} wrote something");
    };
    run(&["--set", "Friction.dampign=0.1"], &["Friction.dampign", "did you mean `damping`?"]);
    run(&["--set", "Fiction.damping=0.1"], &["Fiction.damping", "did you mean `Friction`?"]);
    run(&["--set", "Friction.damping"], &["Friction.damping", "help: ", "="]);
    run(&["--set", "Friction.damping=1 kg"], &["`1 kg`", "N m s/rad", "--set"]);
    run(&["--set", "Friction.damping=[1"], &["--set", "help: "]);
    run(&["--set", "Friction.damping=NaN"], &["Friction.damping", "NaN"]);
    for bad in ["soon", "3 kg", "-3", "NaN", "inf", ""] {
        run(&["--until", bad], &["--until", "help: write 20"]);
        run(&["--checkpoint-every", bad], &["--checkpoint-every", "help: write 20"]);
    }
    run(&["--checkpoint-every", "0"], &["--checkpoint-every", "help: "]);
    run(&["--sett", "a=1"], &["--sett", "--set"]);
    run(&["--seed", "1.5"], &["--seed", "1.5"]);
    lab.linkwork(&["runn", &pendulum]).code(2).tells(&["no command `runn`", "did you mean `run`?"]);
    lab.linkwork(&[]).code(2).tells(&["Usage"]);
    lab.linkwork(&["describe", "actuators.dc_moter"])
        .code(2)
        .tells(&["did you mean `actuators.dc_motor`?"]);
    lab.linkwork(&["list", &pendulum, "Nothing.*"])
        .code(2)
        .tells(&["`Nothing.*` matches no variable"]);
    lab.linkwork(&["tree", "nothing"]).code(2).tells(&["nothing"]);
    let campaign = format!("{}/dispersions.ron", sim("ballistic_entry"));
    lab.linkwork(&["check", &campaign]).code(2).tells(&["`Campaign(..)`", "command `campaign`"]);
    let file = format!("{pendulum}/sim.ron");
    lab.linkwork(&["diff", &file, &file]).code(2).tells(&["neither a log", "two folders of runs"]);
    lab.linkwork(&["diff", &pendulum, &pendulum])
        .code(2)
        .tells(&["summary.json", "two folders of"]);
    assert!(lab.files().is_empty());
}

#[test]
fn nothing_says_when_to_stop() {
    let lab = Lab::new();
    lab.write("bad.ron", &edited(&[("until: \"1 s\",", "")]));
    lab.run("bad.ron", "out", &[]).code(2).tells(&["the end time is missing", "--until"]);
    assert_eq!(lab.files(), ["bad.ron"]);
}

#[test]
fn damaged_checkpoints() {
    let lab = Lab::new();
    lab.run(&sim("pendulum"), "out", &["--until", "2s", "--checkpoint-every", "1s"]).code(0);
    let good = std::fs::read(lab.path("out/checkpoint_1.lwck")).unwrap();
    let resume = |name: &str, bytes: &[u8], wanted: &str| {
        std::fs::write(lab.path(name), bytes).unwrap();
        lab.resume(name, "again", &["--until", "2s"]).code(2).tells(&[name, wanted, "help: "]);
        assert!(!lab.path("again").exists(), "{name} wrote something");
    };
    for keep in [0, 7, 15, 16, 40, good.len() / 2, good.len() - 1] {
        resume("short.lwck", &good[..keep], "is not a readable checkpoint");
    }
    for at in [0, 9, 20, good.len() / 2, good.len() - 1] {
        let mut bad = good.clone();
        bad[at] ^= 0x10;
        resume("damaged.lwck", &bad, "is not a readable checkpoint");
    }
    resume(
        "foreign.lwck",
        &std::fs::read(lab.path("out/run.mcap")).unwrap(),
        "it does not begin with the signature of a checkpoint",
    );
    lab.resume("out/run.mcap", "again", &[]).code(2).tells(&["run.mcap"]);
    lab.resume("out", "again", &[]).code(2).tells(&["`out`"]);
    // The undamaged checkpoint continues.
    lab.resume("out/checkpoint_1.lwck", "again", &["--until", "2s"]).code(0);
    // Its time has passed.
    lab.resume("out/checkpoint_1.lwck", "past", &["--until", "0.5s"])
        .code(2)
        .tells(&["0.5", "1 s", "--until"]);
    assert!(!lab.path("past").exists());
}

#[test]
fn a_free_body_without_mass_that_carries_others_is_told() {
    let lab = Lab::new();
    let sim = |mass: &str| {
        format!(
            r#"Simulation(gravity: "none", step: "1 ms", until: "1 s", bodies: {{
    "chassis": (parent: "world", hinge: Free, {mass} shapes: [Box([1, 1, 1])]),
    "wheel0": (parent: "chassis", at: (position: [1, 1, 0]), hinge: Pin(axis: [0, 1, 0]), mass: "3 kg", inertia: Sphere(0.2)),
    "wheel1": (parent: "chassis", at: (position: [1, -1, 0]), hinge: Pin(axis: [0, 1, 0]), mass: "3 kg", inertia: Sphere(0.2)),
    "wheel2": (parent: "chassis", at: (position: [-1, 0, 0]), hinge: Pin(axis: [0, 1, 0]), mass: "3 kg", inertia: Sphere(0.2)),
}})"#
        )
    };
    lab.write("without.ron", &sim(""));
    let said = lab.linkwork(&["check", "without.ron"]).code(0);
    let said =
        said.tells(&["warning: `chassis` is free, but it has no mass", "help: write its `mass`"]);
    assert_eq!(said.err.matches("warning: ").count(), 1, "{}", said.err);
    lab.write("with.ron", &sim("mass: \"20 kg\", inertia: Box([1, 1, 1]),"));
    assert_eq!(lab.linkwork(&["check", "with.ron"]).code(0).err, "");
}

/// A box that slides over the edge of a map gives one warning; a box that stays on it and one that flies above the ground beside it give none.
#[test]
fn a_machine_that_leaves_its_map_says_so_once() {
    let lab = Lab::new();
    let sim = |x: f64, speed: f64, height: f64, until: f64| {
        format!(
            r#"Simulation(
    bodies: {{ "box": (
        parent: "world", hinge: Free, mass: "2 kg", inertia: Box([0.4, 0.3, 0.2]),
        initial: (position: [{x}, 0, {height}], velocity: [{speed}, 0, 0]),
        shapes: [(shape: Box([0.4, 0.3, 0.2]), collide: true)],
    ) }},
    parts: {{
        "Gravity": (model: "environment.uniform_gravity", params: {{ "acceleration": [0, 0, -9.81] }}),
        "Ground": (model: "environment.flat", params: {{ "size": "6 m", "soil": {{ "kind": "lunar" }} }}),
    }},
    contact: (friction: 0.1),
    step: "2 ms", until: "{until} s",
)"#
        )
    };
    lab.write("off.ron", &sim(2.0, 6.0, 0.1, 3.0));
    lab.linkwork(&["run", "off.ron", "--no-log", "--save-rrd", "off"]).code(0).tells(&[
        "warning: `box` is at (",
        "where no ground supports it: `Ground` extends from (-3.0, -3.0) to (3.0, 3.0) m",
        "help: make the map larger",
    ]);
    for (name, text) in
        [("on.ron", sim(0.0, 0.0, 0.1, 3.0)), ("above.ron", sim(9.0, 6.0, 1.0, 1.0))]
    {
        lab.write(name, &text);
        let said = lab.linkwork(&["run", name, "--no-log", "--save-rrd", "off"]).code(0);
        assert!(!said.err.contains("no ground supports it"), "{name}: {}", said.err);
    }
}

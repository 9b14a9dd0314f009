//! Commands that inspect without running: tree, lists, graphs, checks and help.
use crate::common::{Lab, edited, root, sim};
use std::collections::{BTreeMap, BTreeSet};

/// Returns, for every line of a drawn tree, the path (`Rover/Hardware/Chassis`) and the text after the name.
fn paths(drawn: &str) -> BTreeMap<String, String> {
    let mut stack: Vec<String> = Vec::new();
    let mut out = BTreeMap::new();
    for line in drawn.lines().skip(1) {
        let lead = line.chars().take_while(|c| "│├└─ ".contains(*c)).count();
        let rest: String = line.chars().skip(lead).collect();
        let (name, what) = rest.split_once(' ').unwrap_or((&rest, ""));
        stack.truncate(lead / 4 - 1);
        stack.push(name.to_string());
        out.insert(stack.join("/"), what.trim().to_string());
    }
    out
}

#[test]
fn the_tree_of_the_rover_has_its_names_and_levels() {
    let lab = Lab::new();
    let tree = paths(&lab.linkwork(&["tree", &sim("rover_traverse")]).code(0).out);
    let below = |path: &str| -> BTreeSet<&str> {
        let lead = if path.is_empty() { String::new() } else { format!("{path}/") };
        let found = tree.keys().filter_map(|k| k.strip_prefix(&lead));
        found.filter(|n| !n.contains('/')).collect()
    };
    let set = |names: &[&'static str]| names.iter().copied().collect::<BTreeSet<&str>>();
    assert_eq!(below(""), set(&["Rover"]));
    assert_eq!(
        below("Rover"),
        set(&[
            "Environment",
            "Localisation",
            "LocomotionSoftware",
            "NavigationSoftware",
            "Hardware"
        ])
    );
    assert_eq!(below("Rover/Environment"), set(&["Place", "Terrain", "Ruts"]));
    assert_eq!(below("Rover/LocomotionSoftware"), set(&["Ackermann", "Monitor", "Odometry"]));
    assert_eq!(below("Rover/NavigationSoftware"), set(&["Follower"]));
    assert_eq!(below("Rover/Hardware"), set(&["Chassis", "Mast", "Wheels", "Sensors", "Power"]));
    assert_eq!(below("Rover/Hardware/Sensors"), set(&["IMU", "SunSensor", "Pose"]));
    let wheels = below("Rover/Hardware/Wheels");
    for k in 1..=6 {
        assert!(wheels.contains(format!("Wheel{k}").as_str()), "{wheels:?}");
        assert_eq!(
            below(&format!("Rover/Hardware/Wheels/Wheel{k}")),
            set(&["Motor", "SurfaceContact", "Controller", "Encoder"])
        );
    }
    assert_eq!(wheels.len(), 10, "six wheels, four steering actuators: {wheels:?}");
    assert_eq!(tree["Rover/Hardware/Sensors/IMU"], "sensors.imu");
}

#[test]
fn every_model_is_listed_and_described() {
    let lab = Lab::new();
    let list = lab.linkwork(&["list"]).code(0).out;
    let models: Vec<&str> = list.lines().filter_map(|l| l.split(' ').next()).collect();
    assert!(models.len() > 40 && models.is_sorted(), "{models:?}");
    for (model, line) in models.iter().zip(list.lines()) {
        assert!(line.len() > model.len() + 10, "`{model}` has no words: {line}");
        let text = lab.linkwork(&["describe", model]).code(0).out;
        assert!(text.starts_with(&format!("{model}\n")), "{text}");
        let known = ["parameters\n", "inputs (", "outputs (", "A service: provides "];
        assert!(known.iter().any(|k| text.contains(k)), "{text}");
    }
    let some = lab.linkwork(&["list", "sensors.*"]).code(0).out;
    assert!(some.lines().count() > 2 && some.lines().all(|l| l.starts_with("sensors.")), "{some}");
}

/// The rover on coarse ground, which loads fast.
fn coarse(lab: &Lab) -> String {
    let text = std::fs::read_to_string(root().join("sims/rover_traverse/sim.ron")).unwrap();
    let edited = text.replace("\"world_params\": {", "\"world_params\": { \"spacing\": 0.5,");
    assert_ne!(text, edited);
    lab.write("rover_traverse/sim.ron", &edited);
    "rover_traverse".into()
}

#[test]
fn variables_are_listed_by_pattern() {
    let lab = Lab::new();
    let rover = coarse(&lab);
    let all = lab.linkwork(&["list", &rover]).code(0).out.lines().count();
    let slips = lab.linkwork(&["list", &rover, "Rover.**.SurfaceContact.slip"]).code(0).out;
    assert_eq!(slips.lines().count(), 6, "{slips}");
    assert!(all > 500, "{all} variables");
    let torque = lab.linkwork(&["list", &rover, "Rover.**.Motor.shaft_torque"]).code(0).out;
    assert!(torque.lines().all(|l| l.contains(" N m ") && l.contains(" output ")), "{torque}");
}

#[test]
fn graphs_parse() {
    let lab = Lab::new();
    for name in [coarse(&lab), sim("pendulum"), sim("ballistic_entry")] {
        let dot = lab.linkwork(&["graph", &name]).code(0).out;
        assert!(dot.starts_with("digraph ") && dot.trim_end().ends_with('}'), "{dot}");
        let count = |c: char| dot.chars().filter(|x| *x == c).count();
        assert_eq!((count('{'), count('[')), (count('}'), count(']')), "{name}: not balanced");
        assert_eq!(count('"') % 2, 0, "{name}: quotes");
        let (mut nodes, mut ends) = (BTreeSet::new(), BTreeSet::new());
        for line in dot.lines().map(str::trim).filter(|l| l.starts_with('n') && l.ends_with("];")) {
            let head = line.split(" [").next().unwrap();
            match head.split_once(" -> ") {
                Some((a, b)) => ends.extend([a.to_string(), b.to_string()]),
                None => {
                    assert!(nodes.insert(head.to_string()), "`{head}` is declared twice");
                }
            }
        }
        assert!(!ends.is_empty() && ends.is_subset(&nodes), "{name}: {ends:?} of {nodes:?}");
        let mermaid = lab.linkwork(&["graph", &name, "--format", "mermaid"]).code(0).out;
        assert!(mermaid.starts_with("flowchart LR\n"), "{mermaid}");
        let arrows = mermaid.lines().filter(|l| l.contains("-->") || l.contains("-.->")).count();
        assert_eq!(arrows, dot.lines().filter(|l| l.contains(" -> ")).count(), "{name}");
    }
}

#[test]
fn the_page_holds_every_phase_part_and_wire() {
    let lab = Lab::new();
    for (name, phases) in [(coarse(&lab), 1), (sim("staging"), 3), (sim("mars_edl"), 12)] {
        let page = lab.linkwork(&["graph", &name, "--format", "html"]).code(0).out;
        assert!(page.starts_with("<!DOCTYPE html>") && page.trim_end().ends_with("</html>"));
        // The page does not load anything from elsewhere.
        for outside in ["src=", "href=", "@import", "fetch("] {
            assert!(!page.contains(outside), "{name}: {outside}");
        }
        let data = page.split_once("id=\"data\">").unwrap().1.split_once("</script>").unwrap().0;
        let data: serde_json::Value = serde_json::from_str(data).unwrap();
        let list = |v: &serde_json::Value, key: &str| v[key].as_array().unwrap().clone();
        let all = list(&data, "phases");
        assert_eq!(all.len(), phases, "{name}");
        let names: BTreeSet<_> = all.iter().map(|p| p["name"].to_string()).collect();
        let mut wires = 0;
        for phase in &all {
            let parts: BTreeMap<_, _> =
                list(phase, "parts").into_iter().map(|p| (p["path"].to_string(), p)).collect();
            for wire in list(phase, "wires") {
                wires += 1;
                for (end, ports) in [(&wire["from"], "outputs"), (&wire["to"], "inputs")] {
                    if end[0].is_null() {
                        continue;
                    }
                    let part = &parts[&end[0].to_string()];
                    let port = end[1].as_str().unwrap();
                    let known = list(part, ports);
                    let is = |p: &serde_json::Value| {
                        let own = p["name"].as_str().unwrap();
                        port == own
                            || port.starts_with(&format!("{own}["))
                            || port.starts_with(&format!("{own}."))
                    };
                    assert!(known.iter().any(is), "{name}: {wire}");
                }
            }
            for to in list(phase, "to") {
                assert!(names.contains(&to[0].to_string()), "{name}: {to}");
            }
        }
        assert!(wires > phases, "{name}: {wires}");
        let ways: usize = all.iter().map(|p| list(p, "to").len()).sum();
        assert_eq!(ways > 0, phases > 1, "{name}: transitions");
    }
}

#[test]
fn every_simulation_is_right() {
    let lab = Lab::new();
    let mut n = 0;
    for entry in std::fs::read_dir(root().join("sims")).unwrap() {
        let folder = entry.unwrap().path();
        if folder.join("sim.ron").exists() {
            let said = lab.linkwork(&["check", &folder.display().to_string()]).code(0);
            assert!(said.out.starts_with("ok: ") && said.err.is_empty(), "{said:?}");
            n += 1;
        }
    }
    assert!(n >= 3, "{n} simulations");
}

/// Alone, or with the parts that its documentation requires.
#[test]
fn every_assembly_is_right() {
    let lab = Lab::new();
    let mut n = 0;
    for folder in ["arms", "flight", "legs", "parts", "rovers", "worlds"] {
        for entry in std::fs::read_dir(root().join("assemblies").join(folder)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|e| e != "ron") {
                continue;
            }
            let set: &[&str] = match path.file_stem().unwrap().to_str().unwrap() {
                "capsule" => &[
                    "--set",
                    "Capsule.position=[4e6, 0, 0]",
                    "--set",
                    "Capsule.velocity=[0, 0, 0]",
                ],
                "navigation_waypoints" => &["--set", "NavigationWaypoints.waypoints=[[1, 0]]"],
                "navigation_autonav" => &["--set", "NavigationAutonav.waypoints=[[1, 0]]"],
                "six_axis" => &["--set", "SixAxis.moves=[(name: \"stay\", duration: 1)]"],
                "dual_six_axis" => &["--set", "DualSixAxis.moves=[(name: \"stay\", duration: 1)]"],
                "rocker_bogie" => &["--set", "RockerBogie.waypoints=[[1, 0]]"],
                "mer" => &["--set", "Mer.waypoints=[[1, 0]]"],
                "sojourner" => &["--set", "Sojourner.waypoints=[[1, 0]]"],
                "four_wheeler" => &["--set", "FourWheeler.waypoints=[[1, 0]]"],
                "eight_wheeler" => &["--set", "EightWheeler.waypoints=[[1, 0]]"],
                "articulated" => &["--set", "Articulated.waypoints=[[1, 0]]"],
                "locomotion" => {
                    &["--set", "Locomotion.wheels=[(position: [0, 1]), (position: [0, -1])]"]
                }
                _ => &[],
            };
            let said = lab.linkwork(&[&["check", &path.display().to_string()], set].concat());
            // The command `linkwork new rover` mounts these assemblies on existing bodies: sims/cli/tests/make.rs
            // checks them completely. The solar panel is attached to a body and requires a sun.
            let mounted = ["wheel_drive", "wheel_idle", "steering_drive", "power_solar"];
            if mounted.iter().any(|m| path.file_stem().unwrap() == *m) {
                said.code(2).tells(&["error: ", "help: "]);
            } else if [
                "wheel_dynamics",
                "wheel_kinematics",
                "wheel_quasi_static",
                "ruts_on",
                "ruts_scm",
            ]
            .iter()
            .any(|m| path.file_stem().unwrap() == *m)
            {
                // A wheel requires ground, and so do ruts; the motor of a wheel requires a supply.
                let said = said.code(2).tells(&["`: needs a terrain service", "help: "]);
                let driven = said.err.contains("supply` is not connected");
                assert_eq!(driven, path.to_string_lossy().contains("wheel_"), "{}", said.err);
                assert_eq!(
                    said.err.matches("error: ").count(),
                    1 + usize::from(driven),
                    "{}",
                    said.err
                );
            } else if path.to_string_lossy().contains("parts/steering_") {
                // The servo of a steering unit requires a supply.
                let said = said.code(2).tells(&["Servo.supply` is not connected", "help: "]);
                assert_eq!(said.err.matches("error: ").count(), 1, "{}", said.err);
            } else if path.ends_with("parts/power_outside.ron") {
                // This power system requires the supply of a larger one.
                let said = said.code(2).tells(&["Converter.input` is not connected", "help: "]);
                assert_eq!(said.err.matches("error: ").count(), 1, "{}", said.err);
            } else if path.ends_with("parts/navigation_autonav.ron") {
                // The assembly alone fails: its camera is attached to a node of the world, and the world is empty.
                let said =
                    said.code(2).tells(&["the world has neither nodes nor hinges", "help: "]);
                assert_eq!(said.err.matches("error: ").count(), 1, "{}", said.err);
            } else if path.to_string_lossy().contains("parts/localisation_") {
                // The assembly connects parts of the rover that it is mounted on.
                said.code(2).tells(&["there is no part `Hardware` here", "help: "]);
            } else if path.ends_with("parts/navigation_plan.ron") {
                // The assembly connects to the locomotion software of the rover that it is mounted
                // on.
                said.code(2).tells(&["there is no part `LocomotionSoftware` here", "help: "]);
            } else if let Some(inputs) =
                [("navigation_waypoints", 3), ("locomotion", 2), ("suspension_arm", 2)]
                    .into_iter()
                    .find(|(kind, _)| path.ends_with(format!("parts/{kind}.ron")))
            {
                // The assembly alone lacks inputs for its pose, the rates of wheels and gyro, or the desired
                // angle.
                let said = said.code(2).tells(&["is not wired", "help: "]);
                assert_eq!(said.err.matches("error: ").count(), inputs.1, "{}", said.err);
            } else if ["parts/differential_", "parts/torque_joint"]
                .iter()
                .any(|p| path.to_string_lossy().contains(p))
            {
                // The assembly alone fails: it requires two hinges of the world, and the world is empty.
                let said =
                    said.code(2).tells(&["the world has neither nodes nor hinges", "help: "]);
                assert_eq!(said.err.matches("error: ").count(), 2, "{}", said.err);
            } else {
                said.code(0);
            }
            n += 1;
        }
    }
    assert!(n >= 6, "{n} assemblies");
}

#[test]
fn an_assembly_without_its_parameters_says_which() {
    let lab = Lab::new();
    let capsule = root().join("assemblies/flight/capsule.ron").display().to_string();
    lab.linkwork(&["check", &capsule]).code(2).tells(&[
        "required parameter `position` is missing",
        "required parameter `velocity` is missing",
        "use `--set 'Capsule.velocity=..'`, or use it as a part of a simulation",
    ]);
    // The consequences of a missing input are not reported as further mistakes.
    let wheel = root().join("assemblies/parts/wheel_drive.ron").display().to_string();
    let said = lab.linkwork(&["check", &wheel]).code(2);
    let said = said.tells(&["required parameter `rate` is missing", "--set 'WheelDrive.rate=..'"]);
    for follows in ["is not a quantity", "is not a unit"] {
        assert!(!said.err.contains(follows), "{}", said.err);
    }
}

#[test]
fn a_word_that_is_no_command_is_told_what_there_is() {
    let lab = Lab::new();
    let said = lab.linkwork(&["rnu", "sims/pendulum"]).code(2);
    said.tells(&["no command `rnu`\n  help: did you mean `run`? commands: run, resume"]);
    let said = lab.linkwork(&["new", "rovre", "scout"]).code(2);
    said.tells(&["no command `rovre`\n  help: did you mean `rover`? commands: simulation, rover"]);
}

#[test]
fn warnings_of_one_place_in_six_wheels_are_one() {
    let lab = Lab::new();
    let rover = root().join("assemblies/rovers/rocker_bogie.ron").display().to_string();
    let said = lab.linkwork(&["check", &rover, "--set", "RockerBogie.waypoints=[[1, 1]]"]).code(0);
    assert_eq!(said.err.matches("deep in the ground").count(), 1, "{}", said.err);
    said.tells(&["the contact force will throw it out (and 5 more like it)"]);
}

#[test]
fn check_finds_what_run_would_refuse() {
    let lab = Lab::new();
    for edit in [
        ("\"bob.rate\"", "\"bob.rat\""),
        ("follow: \"bob\"", "follow: \"bub\""),
        ("\"k\": 2", "\"k\": NaN"),
    ] {
        lab.write("bad.ron", &edited(&[edit]));
        let (check, run) =
            (lab.linkwork(&["check", "bad.ron"]).code(2), lab.run("bad.ron", "out", &[]).code(2));
        assert_eq!(check.err, run.err);
    }
    assert_eq!(lab.files(), ["bad.ron"]);
}

#[test]
fn the_schema_is_json() {
    let out = Lab::new().linkwork(&["schema"]).code(0).out;
    let schema: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(schema["$defs"]["body"]["properties"]["mass"]["anyOf"][0]["description"], "in kg");
    assert_eq!(schema["$defs"]["body"]["required"], serde_json::json!(["parent"]));
    let out = Lab::new().linkwork(&["schema", "campaign"]).code(0).out;
    let schema: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(schema["$defs"]["normal"]["required"], serde_json::json!(["mean", "deviation"]));
    Lab::new().linkwork(&["schema", "robot"]).code(2).tells(&["simulation", "campaign"]);
}

#[test]
fn shells_and_manuals_know_every_command() {
    let lab = Lab::new();
    let commands = ["run", "resume", "campaign", "check", "replay", "diff", "completions", "man"];
    for (shell, mark) in [("bash", "complete -F"), ("zsh", "#compdef"), ("fish", "complete -c")] {
        let script = lab.linkwork(&["completions", shell]).code(0).out;
        assert!(script.contains(mark), "{shell}");
        for command in commands {
            assert!(script.contains(command), "{shell}: {command}");
        }
    }
    lab.linkwork(&["completions", "cobra"]).code(2);
    lab.linkwork(&["man", "pages"]).code(0);
    let page = |name: &str| std::fs::read_to_string(lab.path("pages").join(name)).unwrap();
    assert!(page("linkwork.1").contains(".TH linkwork 1"));
    for command in commands {
        page(&format!("linkwork-{command}.1"));
    }
    assert!(page("linkwork-run.1").contains("checkpoint\\-every"));
    lab.write("taken", "");
    lab.linkwork(&["man", "taken"]).code(1).tells(&["`taken` cannot be written", "help: "]);
}

#[test]
fn help_has_examples() {
    let lab = Lab::new();
    let help = lab.linkwork(&["--help"]).code(0).out;
    for command in ["run", "resume", "check", "list", "describe", "tree", "graph", "schema", "diff"]
    {
        assert!(
            help.contains(&format!("  linkwork {command} ")),
            "no example of `{command}`:\n{help}"
        );
        let own = lab.linkwork(&[command, "--help"]).code(0).out;
        assert!(own.contains("Usage: linkwork"), "{own}");
    }
    // The example of --set uses an existing parameter.
    let example = help.split("--set ").nth(1).and_then(|t| t.split_whitespace().next()).unwrap();
    lab.run(&sim("pendulum"), "out", &["--until", "0.1s", "--set", example]).code(0);
}

/// A new user's first simulation: it passes the check without a warning, runs, and is never overwritten.
#[test]
fn a_new_simulation_runs_as_it_is() {
    let lab = Lab::new();
    let made = lab.linkwork(&["new", "simulation", "first/swing"]).code(0);
    assert_eq!(made.out, "first/swing/sim.ron\nfirst/swing/README.md\n");
    let checked = lab.linkwork(&["check", "first/swing"]).code(0);
    assert!(!format!("{}{}", checked.out, checked.err).contains("warning"), "{checked:?}");
    lab.linkwork(&["run", "first/swing", "--until", "1s", "--set", "length=0.8"]).code(0);
    assert!(lab.path("runs/swing/run.mcap").exists());
    lab.linkwork(&["new", "simulation", "first/swing"])
        .code(2)
        .tells(&["`first/swing` already exists", "help: "]);
    lab.linkwork(&["new", "simulation", ".."])
        .code(2)
        .tells(&["does not have a name that a simulation can use"]);
    lab.linkwork(&["new", "simulation", "/dev/null/swing"])
        .code(1)
        .tells(&["cannot be created", "help: "]);
}

/// A word finds models by their names and descriptions; a name without its library is completed.
#[test]
fn models_are_found_by_a_word_and_by_a_short_name() {
    let lab = Lab::new();
    let found = lab.linkwork(&["list", "parachute"]).code(0).out;
    assert!(found.contains("flight.canopy ") && found.contains("flight.riser "), "{found}");
    let short = lab.linkwork(&["describe", "dc_motor"]).code(2).err;
    assert!(short.contains("did you mean `actuators.dc_motor`?"), "{short}");
    let word = lab.linkwork(&["describe", "parachute"]).code(2).err;
    assert!(word.contains("models for that word: `flight."), "{word}");
    let none = lab.linkwork(&["list", "xylophone"]).code(2).err;
    assert!(none.contains("`xylophone` is not a simulation"), "{none}");
    // Texts that span several source lines are complete.
    let whole = lab.linkwork(&["describe", "environment.height_field"]).code(0).out;
    assert!(whole.contains("PDS3 (.lbl, .img), PDS4 (.xml). (required)"), "{whole}");
}

/// The plot of a step has dots at its bottom, from before the step, and at its top.
#[test]
fn describe_plots_what_a_model_does() {
    let told = Lab::new().linkwork(&["describe", "basics.step"]).code(0).out;
    let (_, plot) = told.split_once("\nbehaviour\n").expect("no behaviour");
    assert!(plot.contains("`behaviours/basics.step.ron`"), "{plot}");
    let dots = |line: &str| line.chars().filter(|c| ('\u{2801}'..='\u{28ff}').contains(c)).count();
    let drawn: Vec<usize> = plot.lines().map(dots).filter(|n| *n > 0).collect();
    assert!(drawn.len() > 5, "{plot}");
    assert!(drawn[0] > 10 && drawn[drawn.len() - 1] > 10, "{plot}");
    let bare = Lab::new().linkwork(&["describe", "mobility.ruts"]).code(0).out;
    assert!(!bare.contains("behaviour\n"), "{bare}");
}

#[test]
fn a_model_whose_ports_follow_from_parameters_says_so() {
    let lab = Lab::new();
    let told = |model: &str| lab.linkwork(&["describe", model]).code(0).out;
    let word = "Its ports depend on its parameters";
    assert!(told("control.ackermann").contains(word) && told("fmi.co_simulation").contains(word));
    for model in ["actuators.dc_motor", "environment.flat", "mobility.ruts", "basics.sine"] {
        assert!(!told(model).contains(word), "{model}");
    }
}

#[test]
fn the_doctor_tells_of_processor_build_viewer_and_python() {
    let told = Lab::new().linkwork(&["doctor"]).code(0).out;
    for what in [
        "processor",
        "instructions",
        "cores",
        "memory",
        "build",
        "recordings",
        "Rust",
        "viewer",
        "Python",
    ] {
        assert!(told.lines().any(|l| l.starts_with(what) && l.len() > 15), "{what}: {told}");
    }
    let cores = std::thread::available_parallelism().unwrap().get();
    assert!(told.contains(&format!("cores          {cores}")), "{told}");
}

//! `linkwork new`: a simulation to begin from, which runs as it is.
use crate::exit;
use std::io::Write;
use std::path::{Path, PathBuf};

/// What there is to make.
#[derive(clap::Subcommand, Clone, Debug)]
pub enum Kind {
    /// A folder with a small simulation that runs: an arm that a servo swings, and what to change next.
    Simulation {
        /// The folder, which must not be there yet. Its name becomes that of the simulation.
        folder: PathBuf,
    },
}

const SIMULATION: &str = r#"Simulation(
    doc: "An arm that a servo swings.",
    params: {
        "mass": (unit: "kg", default: 2, range: (0.01, 1000), doc: "Mass of the arm."),
        "length": (unit: "m", default: 0.5, range: (0.01, 10), doc: "Its length."),
    },
    bodies: {
        // One body on a hinge about y. Others hang on it by `parent: "arm"`.
        "arm": (
            parent: "world", hinge: Pin([0, 1, 0]),
            mass: "$mass", com: [0, 0, "-$length / 2"], inertia: Box([0.04, 0.04, "$length"]),
            shapes: [(shape: Box([0.04, 0.04, "$length"]), at: (position: [0, 0, "-$length / 2"]), color: [0.9, 0.5, 0.2])],
        ),
    },
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.81] }),
        // `linkwork list` shows all models, `linkwork describe basics.sine` the parameters of one.
        "Target": (model: "basics.sine", params: { "amplitude": 0.6, "frequency": 0.4 }),
        "Servo": (
            model: "actuators.position_servo",
            params: { "stiffness": 60, "damping": 6, "torque_max": 20 },
            bind: { "shaft": "hinge:arm" },
        ),
    },
    wires: ["Target.y -> Servo.angle"],
    step: "1 ms",
    until: "10 s",
    log: [(channels: ["**"], rate: "100 Hz")],
    view: (eye: [0, -2, 0.2]),
    figures: { "largest torque": (of: "Servo.torque", take: "max", unit: "N m") },
    plots: [
        (title: "Angle", of: ["Target.y", "arm.angle"], unit: "deg"),
        (title: "Torque", of: ["Servo.torque"], unit: "N m"),
    ],
)
"#;

const README: &str = "# NAME
An arm that a servo swings. `sim.ron` is all of it.

```sh
linkwork check NAME                      # every mistake, with line and column
linkwork run NAME                        # files in runs/NAME; plots.svg opens in a browser, run.rrd in Rerun
linkwork run NAME --set length=0.8 --set Servo.stiffness=90
linkwork list NAME '**'                  # its variables
linkwork list                            # all models there are
```
";

/// Makes it. What is there already is never written over.
pub fn make(kind: &Kind) -> u8 {
    let Kind::Simulation { folder } = kind;
    match simulation(folder) {
        Ok(()) => {
            say!("{}", folder.join("sim.ron").display());
            say!("{}", folder.join("README.md").display());
            exit::OK
        }
        Err((code, fact, help)) => {
            tell!("error: {fact}\n  help: {help}");
            code
        }
    }
}

type Refusal = (u8, String, &'static str);

fn simulation(folder: &Path) -> Result<(), Refusal> {
    let shown = folder.display();
    let Some(name) = folder.file_name().and_then(|n| n.to_str()) else {
        let fact = format!("`{shown}` has no name that a simulation can take");
        return Err((exit::INPUT, fact, "name a folder: `linkwork new simulation swing`"));
    };
    let failed = |e: std::io::Error| {
        let fact = format!("`{shown}` cannot be made: {e}");
        (exit::FAILED, fact, "name a folder that can be made")
    };
    if folder.symlink_metadata().is_ok() {
        return Err((exit::INPUT, format!("`{shown}` is there already"), "give another name"));
    }
    std::fs::create_dir_all(folder).map_err(failed)?;
    for (file, text) in
        [("sim.ron", SIMULATION.to_string()), ("README.md", README.replace("NAME", name))]
    {
        let new = std::fs::File::create_new(folder.join(file));
        new.and_then(|mut f| f.write_all(text.as_bytes())).map_err(failed)?;
    }
    Ok(())
}

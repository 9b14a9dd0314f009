//! A program with every command, over a library of models: `linkwork` itself, and those that `linkwork new library`
//! makes.
use crate::attach::{self, AttachCommand};
use crate::campaign::{self, CampaignOptions};
use crate::diff::{self, DiffOptions};
use crate::export::{self, ExportOptions};
use crate::fork::{self, ForkOptions};
use crate::graph::{self, GraphFormat};
use crate::options::RunOptions;
use crate::view::{self, ViewOptions};
use crate::wheel_test::{self, WheelTestOptions};
use crate::{check, doctor, exit, inspect, load, make, pages, replay, run, voice};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use linkwork_runner::Library;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::OnceLock;

/// What a program is called, and which models and assemblies it brings.
#[derive(Clone, Copy, Debug)]
pub struct Program {
    /// Name of the command, of its completions and of its manual pages.
    pub name: &'static str,
    /// Its version.
    pub version: &'static str,
    /// What it is for, in a line.
    pub about: &'static str,
    /// What follows the list of commands in its help: examples.
    pub examples: &'static str,
    /// Everything that a simulation may name.
    pub library: fn() -> Library,
    /// The package whose shared library goes into the units of `export`.
    pub unit: &'static str,
}

/// A process is one program.
static PROGRAM: OnceLock<Program> = OnceLock::new();

/// The program that this process is: `linkwork`, unless [`Program::main`] has begun another.
pub fn program() -> &'static Program {
    PROGRAM.get_or_init(|| LINKWORK)
}

impl Program {
    /// Reads the arguments of the process and does what they say. To be called once, at the start.
    pub fn main(self) -> ExitCode {
        if PROGRAM.set(self).is_err() {
            tell!(
                "error: a process is one program\n  help: call `Program::main` once, first in `main`"
            );
            return ExitCode::from(exit::FAILED);
        }
        survive_size_limits();
        let cli = command().try_get_matches().and_then(|m| Cli::from_arg_matches(&m));
        match cli {
            Ok(cli) => ExitCode::from(voice::exit_code(execute(cli.command))),
            // Help and version, or what is wrong with the arguments.
            Err(e) => {
                let code = u8::try_from(e.exit_code()).unwrap_or(exit::INPUT);
                let lost = e.print().is_err() && code == exit::OK;
                ExitCode::from(if lost { exit::FAILED } else { voice::exit_code(code) })
            }
        }
    }
}

/// Linkwork's own.
pub const LINKWORK: Program = Program {
    name: "linkwork",
    version: env!("CARGO_PKG_VERSION"),
    about: "Simulate machines made of parts: rovers, landers, spacecraft, arms.",
    examples: EXAMPLES,
    library: load::linkwork,
    unit: "linkwork-unit",
};

const EXAMPLES: &str = "Examples:
  linkwork run sims/rover_traverse                      run, log, picture; files in runs/rover_traverse
  linkwork run sims/pendulum --until 5s --set Friction.damping=0.3
  linkwork run sims/rover_traverse --checkpoint-every 10s
  linkwork resume runs/rover_traverse/checkpoint_10.lwck --until 20s
  linkwork fork runs/pendulum/checkpoint_2.lwck --set Friction.damping=0.3 --until 5s     from there on with a change
  linkwork run sims/pendulum --serve --realtime          and in another terminal:
  linkwork attach runs/pendulum watch '**.angle'        what it does; set, pin, pause, step, go, checkpoint, quit
  linkwork campaign sims/ballistic_entry/dispersions.ron     many runs with drawn values, tables and a report
  linkwork campaign sims/ballistic_entry/dispersions.ron --run 17 --log     one of them again
  linkwork new simulation swing                         a small one to begin from
  linkwork new library windmill                         models of your own, with a program and tests
  linkwork new model pump                               another model, in the folder of a library
  linkwork check sims/rover_traverse                    every mistake, with line and column
  linkwork tree sims/rover_traverse                     the parts, as they are nested
  linkwork list sims/rover_traverse 'Rover.**.torque'   variables by pattern
  linkwork describe actuators.dc_motor                  parameters, ports, units
  linkwork graph sims/pendulum --format mermaid         the wires as a picture
  linkwork export sims/pendulum --fmu pendulum.fmu      as a unit of FMI 3.0
  linkwork export runs/rover/run.mcap --parquet run.parquet   a log as a table
  linkwork schema > linkwork.schema.json                the file format, for editors and programs
  linkwork replay runs/rover/run.mcap --verify         simulate again and compare every number
  linkwork view runs/rover/run.mcap --out rover.rrd     a recording from a log, for Rerun
  linkwork diff a/run.mcap b/run.mcap --rel 1e-9        compare logs or checkpoints
  linkwork wheel-test --soil mars_drift --load 560       pull, torque and sinkage of a wheel on a soil";

/// The declaration of all commands under the program's name.
fn command() -> clap::Command {
    let Program { name, version, about, examples, .. } = program();
    Cli::command().name(*name).bin_name(*name).version(*version).about(*about).after_help(*examples)
}

#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a simulation: a sim.ron file or the folder that holds it.
    Run {
        /// A sim.ron file, or the folder that holds it.
        sim: PathBuf,
        #[command(flatten)]
        options: RunOptions,
        /// Set a parameter (repeatable): Rover.Hardware.Wheels.Wheel1.Motor.resistance="0.7 ohm".
        #[arg(long = "set", value_name = "PATH=VALUE")]
        set: Vec<String>,
        /// Seed of all noise, in place of the file's.
        #[arg(long)]
        seed: Option<u64>,
    },
    /// Go on from a checkpoint; it holds the whole configuration.
    Resume {
        /// A .lwck file.
        checkpoint: PathBuf,
        #[command(flatten)]
        options: RunOptions,
    },
    /// Go on from a checkpoint with other parameters, or as another simulation: states go over by path.
    Fork {
        /// A .lwck file.
        checkpoint: PathBuf,
        #[command(flatten)]
        fork: ForkOptions,
        #[command(flatten)]
        options: RunOptions,
    },
    /// Watch and steer a run that was started with --serve.
    Attach {
        /// The folder of the run.
        run: PathBuf,
        #[command(subcommand)]
        command: AttachCommand,
    },
    /// Many runs of one simulation with values drawn from distributions. Given again, it goes on where it stopped.
    Campaign {
        /// A campaign file: `Campaign(simulation: "sim.ron", runs: 1000, vary: {..})`.
        file: PathBuf,
        #[command(flatten)]
        options: CampaignOptions,
    },
    /// Load and compile, and report every mistake.
    Check {
        /// A sim.ron or assembly file, or a folder with a sim.ron.
        sim: PathBuf,
        /// Set a parameter (repeatable).
        #[arg(long = "set", value_name = "PATH=VALUE")]
        set: Vec<String>,
    },
    /// List the models of the catalogue, or the variables of a simulation.
    List {
        /// A simulation; without it the catalogue is listed.
        sim: Option<PathBuf>,
        /// Only what matches: `Rover.**.torque`, `actuators.*`.
        pattern: Option<String>,
    },
    /// Describe a model: what it does, parameters, ports, units, states.
    Describe {
        /// Name in the catalogue, for example actuators.dc_motor.
        model: String,
    },
    /// Show the assembly tree.
    Tree {
        /// A simulation.
        sim: PathBuf,
    },
    /// Print parts and wires as a graph: `linkwork graph SIM --format html > graph.html` opens in a browser.
    Graph {
        /// A simulation.
        sim: PathBuf,
        /// Which language.
        #[arg(long, value_enum, default_value_t = GraphFormat::Dot)]
        format: GraphFormat,
    },
    /// Write a simulation as a co-simulation unit of FMI 3.0, or a log as a Parquet table, for other programs.
    Export {
        /// With --fmu: a sim.ron file, or the folder that holds it. With --parquet: a .mcap file that a run wrote.
        from: PathBuf,
        #[command(flatten)]
        options: ExportOptions,
    },
    /// Print a script that completes commands and options in a shell: `linkwork completions bash > FILE`.
    Completions {
        /// The shell.
        #[arg(value_enum)]
        shell: clap_complete::Shell,
    },
    /// Write the manual pages into a folder: `man FOLDER/linkwork-run.1`.
    Man {
        /// The folder, made when it is not there.
        folder: PathBuf,
    },
    /// Print the JSON Schema of a kind of files.
    Schema {
        /// Of simulations, assemblies and side-cars, or of campaigns.
        #[arg(value_enum, default_value_t)]
        kind: inspect::Kind,
    },
    /// Make something to begin from, which runs as it is.
    New {
        #[command(subcommand)]
        kind: make::Kind,
    },
    /// Tell what of this machine and this build matters: processor, memory, viewer, Python.
    Doctor,
    /// Simulate again what a log holds. Exit code 1 when a number differs, with the first tick and variable.
    Replay {
        /// A .mcap file that a run wrote; it holds the whole configuration.
        log: PathBuf,
        /// Compare every logged number, bit for bit.
        #[arg(long, required = true)]
        verify: bool,
    },
    /// Make a Rerun recording from a log, without simulating.
    View {
        /// A .mcap file that a run wrote; it holds the whole configuration.
        log: PathBuf,
        #[command(flatten)]
        options: ViewOptions,
    },
    /// Compare two logs (.mcap), checkpoints (.lwck) or recordings (.rrd). Exit code 1 when they differ.
    Diff {
        /// The first.
        a: PathBuf,
        /// The second.
        b: PathBuf,
        #[command(flatten)]
        options: DiffOptions,
    },
    /// What a single-wheel rig would measure: pull, torque and sinkage against slip, slip against slope.
    WheelTest(WheelTestOptions),
}

/// A limit on the size of files is an error of the write that meets it, not the end of the
/// process. Fails only where there is no such signal.
#[cfg(unix)]
fn survive_size_limits() {
    let met = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, met);
}

#[cfg(not(unix))]
fn survive_size_limits() {}

fn execute(command: Command) -> u8 {
    match command {
        Command::Run { sim, options, set, seed } => run::run(&sim, &options, &set, seed),
        Command::Resume { checkpoint, options } => run::resume(&checkpoint, &options),
        Command::Fork { checkpoint, fork, options } => fork::fork(&checkpoint, &fork, &options),
        Command::Attach { run, command } => attach::attach(&run, command),
        Command::Campaign { file, options } => campaign::campaign(&file, &options),
        Command::Check { sim, set } => check::check(&sim, &set),
        Command::List { sim, pattern } => inspect::list(sim.as_deref(), pattern.as_deref()),
        Command::Describe { model } => inspect::describe(&model),
        Command::Tree { sim } => inspect::tree(&sim),
        Command::Graph { sim, format } => graph::graph(&sim, format),
        Command::Export { from, options } => export::export(&from, &options),
        Command::Completions { shell } => pages::completions(shell, &mut self::command()),
        Command::Man { folder } => pages::man(&folder, self::command()),
        Command::Schema { kind } => inspect::schema(kind),
        Command::New { kind } => make::make(&kind),
        Command::Doctor => doctor::doctor(),
        Command::Replay { log, .. } => replay::verify(&log),
        Command::View { log, options } => view::view(&log, &options),
        Command::Diff { a, b, options } => diff::diff(&a, &b, &options),
        Command::WheelTest(options) => wheel_test::wheel_test(&options),
    }
}

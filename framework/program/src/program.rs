//! A complete command-line program for a model library: `linkwork` itself, and the programs that `linkwork new library` creates.
use crate::attach::{self, AttachCommand};
use crate::campaign::{self, CampaignOptions};
use crate::diff::{self, DiffOptions};
use crate::export::{self, ExportOptions};
use crate::fork::{self, ForkOptions};
use crate::graph::{self, GraphFormat};
use crate::options::RunOptions;
use crate::view::{self, ViewOptions};
use crate::{check, doctor, exit, inspect, make, pages, replay, run, voice};
use clap::error::{ContextKind, ContextValue};
use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, Subcommand};
use linkwork_runner::Library;
use linkwork_runtime::{Catalogue, remedy};
use std::ffi::OsString;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::OnceLock;

/// Name, models and assemblies of a program.
#[derive(Clone, Copy, Debug)]
pub struct Program {
    /// Name of the command, of its completions and of its manual pages.
    pub name: &'static str,
    /// Its version.
    pub version: &'static str,
    /// Its purpose, in one line.
    pub about: &'static str,
    /// Text after the list of commands in its help: examples.
    pub examples: &'static str,
    /// Returns all models and assemblies that a simulation can name.
    pub library: fn() -> Library,
    /// The package whose shared library is part of the units of `export`.
    pub unit: &'static str,
    /// Additional commands.
    pub tools: &'static [Tool],
}

/// An additional command of a program.
#[derive(Clone, Copy, Debug)]
pub struct Tool {
    /// Its declaration: name, help, arguments.
    pub command: fn() -> clap::Command,
    /// Executes it and returns an exit code ([`exit`]).
    pub run: fn(&ArgMatches) -> u8,
}

/// A process runs one program.
static PROGRAM: OnceLock<Program> = OnceLock::new();

/// The program before [`Program::main`], without models.
const NONE: Program = Program {
    name: "linkwork",
    version: env!("CARGO_PKG_VERSION"),
    about: "",
    examples: "",
    library: || Library { catalogue: Catalogue::new([]), embedded: Default::default() },
    unit: "linkwork-unit",
    tools: &[],
};

/// Returns the program that [`Program::main`] has set.
pub(crate) fn program() -> &'static Program {
    PROGRAM.get().unwrap_or(&NONE)
}

impl Program {
    /// Reads the arguments of the process and does what they say. To be called once, at the start.
    pub fn main(self) -> ExitCode {
        ExitCode::from(self.execute(std::env::args_os().collect()))
    }

    /// Like [`Program::main`], with these arguments: the name of the program, then what the user typed. Returns the exit code.
    pub fn execute(self, arguments: Vec<OsString>) -> u8 {
        if PROGRAM.set(self).is_err() {
            tell!(
                "error: the program was started twice in one process\n  help: call `main` or `execute` once"
            );
            return exit::FAILED;
        }
        survive_size_limits();
        // Names are used in logs, summaries and messages, which are text.
        let unreadable = arguments.iter().skip(1).find(|arg| arg.to_str().is_none());
        if let Some(arg) = unreadable {
            tell!(
                "error: the argument `{}` is not UTF-8\n  help: give the file or folder a name in UTF-8",
                arg.to_string_lossy()
            );
            return voice::exit_code(exit::INPUT);
        }
        let done = command().try_get_matches_from(&arguments).and_then(|matches| {
            let (called, own) = matches.subcommand().unzip();
            let tool = self.tools.iter().find(|t| called == Some((t.command)().get_name()));
            match (tool, own) {
                (Some(tool), Some(own)) => Ok((tool.run)(own)),
                _ => Cli::from_arg_matches(&matches).map(|cli| execute(cli.command)),
            }
        });
        match done {
            Ok(code) => voice::exit_code(code),
            // The user requested help or the version, or an argument is invalid.
            Err(e) => {
                let code = u8::try_from(e.exit_code()).unwrap_or(exit::INPUT);
                if let Some(ContextValue::String(word)) = e.get(ContextKind::InvalidSubcommand) {
                    tell!("error: {}", no_command(word, &arguments));
                    return voice::exit_code(code);
                }
                let lost = e.print().is_err() && code == exit::OK;
                if lost { exit::FAILED } else { voice::exit_code(code) }
            }
        }
    }
}

/// Returns the message for an unknown command, with the available commands of its level.
fn no_command(word: &str, arguments: &[OsString]) -> String {
    let mut level = command();
    for arg in arguments.iter().skip(1).take_while(|arg| *arg != word) {
        if let Some(next) = level.find_subcommand(arg) {
            level = next.clone();
        }
    }
    let names: Vec<&str> = level.get_subcommands().map(clap::Command::get_name).collect();
    format!("there is no command `{word}`\n  help: {}", remedy(word, "commands", &names))
}

/// Returns the declaration of all commands under the program's name.
fn command() -> clap::Command {
    let Program { name, version, about, examples, tools, .. } = program();
    let all = Cli::command().subcommands(tools.iter().map(|tool| (tool.command)()));
    all.name(*name).bin_name(*name).version(*version).about(*about).after_help(*examples)
}

#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Run a simulation: a sim.ron file or its folder.
    Run {
        /// A sim.ron file, or its folder.
        sim: PathBuf,
        #[command(flatten)]
        options: RunOptions,
        /// Set a parameter (repeatable): Rover.Hardware.Wheels.Wheel1.Motor.resistance="0.7 ohm".
        #[arg(long = "set", value_name = "PATH=VALUE")]
        set: Vec<String>,
        /// Seed of all noise; replaces that of the file.
        #[arg(long)]
        seed: Option<u64>,
    },
    /// Continue from a checkpoint, which contains the whole configuration.
    Resume {
        /// A .lwck file.
        checkpoint: PathBuf,
        #[command(flatten)]
        options: RunOptions,
    },
    /// Continue from a checkpoint with other parameters, or as another simulation: states are transferred by path.
    Fork {
        /// A .lwck file.
        checkpoint: PathBuf,
        #[command(flatten)]
        fork: ForkOptions,
        #[command(flatten)]
        options: RunOptions,
    },
    /// Watch and control a run that was started with --serve.
    Attach {
        /// The folder of the run.
        run: PathBuf,
        #[command(subcommand)]
        command: AttachCommand,
    },
    /// Make many runs of one simulation with values drawn from distributions. The same command continues a stopped campaign.
    Campaign {
        /// A campaign file: `Campaign(simulation: "sim.ron", runs: 1000, vary: {..})`.
        file: PathBuf,
        #[command(flatten)]
        options: CampaignOptions,
    },
    /// Load and compile a simulation, and report all mistakes.
    Check {
        /// A sim.ron or assembly file, or a folder with a sim.ron.
        sim: PathBuf,
        /// Set a parameter (repeatable).
        #[arg(long = "set", value_name = "PATH=VALUE")]
        set: Vec<String>,
    },
    /// List the models of the catalogue, or the variables of a simulation.
    List {
        /// A simulation (default: list the catalogue).
        sim: Option<PathBuf>,
        /// Only names that match: `Rover.**.torque`, `actuators.*`.
        pattern: Option<String>,
    },
    /// Describe a model: behaviour, parameters, ports, units, states.
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
        /// Language of the graph.
        #[arg(long, value_enum, default_value_t = GraphFormat::Dot)]
        format: GraphFormat,
    },
    /// Write a simulation as a co-simulation unit of FMI 3.0, or a log as a table (Parquet, CSV), for other programs.
    Export {
        /// With --fmu: a sim.ron file, or its folder. With --parquet or --csv: a .mcap file that a run wrote.
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
        /// The folder; it is created if it does not exist.
        folder: PathBuf,
    },
    /// Print the JSON Schema of a file format.
    Schema {
        /// Simulations, assemblies and companion files, or campaigns.
        #[arg(value_enum, default_value_t)]
        kind: inspect::Kind,
    },
    /// Create a simulation, rover, model or library that runs as it is.
    New {
        #[command(subcommand)]
        kind: make::Kind,
    },
    /// Report properties of this machine and this build: processor, memory, viewer, Python.
    Doctor,
    /// Repeat the simulation of a log. Exit code 1 if a number differs, with the first tick and variable.
    Replay {
        /// A .mcap file that a run wrote, which contains the whole configuration.
        log: PathBuf,
        /// Compare every logged number, bit by bit.
        #[arg(long, required = true)]
        verify: bool,
    },
    /// Create a Rerun recording from a log, or from a table of external telemetry, without simulating.
    View {
        /// A .mcap file that a run wrote, which contains the whole configuration; or a telemetry file (RON) with a table and the simulation in whose
        /// view it is shown.
        log: PathBuf,
        #[command(flatten)]
        options: ViewOptions,
    },
    /// Compare two runs (folders, or summary.json): their settings and metrics; or two logs (.mcap), checkpoints (.lwck) or recordings (.rrd): every number. Exit code 1 if they differ.
    Diff {
        /// The first.
        a: PathBuf,
        /// The second.
        b: PathBuf,
        #[command(flatten)]
        options: DiffOptions,
    },
}

/// Ignores the signal for the limit on the file size, so that exceeding the limit is an error of the write and does not end the process. Fails only
/// on systems without this signal.
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
    }
}

//! The program `linkwork`: the commands of `linkwork_program` over all models and assemblies that ship, and its own.
pub mod terrain;
pub mod wheel_test;

use linkwork_program::Program;
use linkwork_runner::Library;

/// Every model and service of the component libraries, foreign units, assemblies.
pub fn library() -> Library {
    linkwork_assemblies::library().with(linkwork_fmi::catalogue())
}

/// The program `linkwork`.
pub const LINKWORK: Program = Program {
    name: "linkwork",
    version: env!("CARGO_PKG_VERSION"),
    about: "Simulate machines made of parts: rovers, landers, spacecraft, arms.",
    examples: EXAMPLES,
    library,
    unit: "linkwork-unit",
    tools: &[wheel_test::WHEEL_TEST, terrain::TERRAIN],
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
  linkwork wheel-test --soil mars_drift --load 560       pull, torque and sinkage of a wheel on a soil
  linkwork terrain show hill.tif                        size, heights and a picture of a map
  linkwork terrain convert hill.tif hill.tiles          tiles, which are read as they are driven on";

//! The program `linkwork`: the commands of `linkwork_program` and some additional ones, with all models and assemblies of the component libraries.
pub mod terrain;
pub mod wheel_test;

use linkwork_program::Program;
use linkwork_runner::Library;

/// Returns every model, service and assembly of the component libraries, and the models for foreign FMI units.
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
  linkwork fork runs/pendulum/checkpoint_2.lwck --set Friction.damping=0.3 --until 5s     continue with a change
  linkwork run sims/pendulum --serve --realtime          and in another terminal:
  linkwork attach runs/pendulum watch '**.angle'        print values; set, pin, pause, step, go, checkpoint, quit
  linkwork campaign sims/ballistic_entry/dispersions.ron     many runs with sampled values, tables and a report
  linkwork campaign sims/ballistic_entry/dispersions.ron --run 17 --log     repeat one of them
  linkwork new simulation swing                         a small simulation to start from
  linkwork new library windmill                         your own models, with a program and tests
  linkwork new model pump                               another model, in the folder of a library
  linkwork check sims/rover_traverse                    list every mistake, with line and column
  linkwork tree sims/rover_traverse                     the tree of parts
  linkwork list sims/rover_traverse 'Rover.**.torque'   variables by pattern
  linkwork describe actuators.dc_motor                  parameters, ports, units
  linkwork graph sims/pendulum --format mermaid         the wires as a diagram
  linkwork export sims/pendulum --fmu pendulum.fmu      as a unit of FMI 3.0
  linkwork export runs/rover/run.mcap --parquet run.parquet   a log as a table
  linkwork schema > linkwork.schema.json                the file format, for editors and programs
  linkwork replay runs/rover/run.mcap --verify         simulate again and compare every number
  linkwork view runs/rover/run.mcap --out rover.rrd     a recording from a log, for Rerun
  linkwork diff a/run.mcap b/run.mcap --rel 1e-9        compare logs or checkpoints
  linkwork wheel-test --soil mars_drift --load 560       pull, torque and sinkage of a wheel on a soil
  linkwork terrain show hill.tif                        size, heights and a picture of a map
  linkwork terrain convert hill.tif hill.tiles          tiles, which are read when a machine drives on them";

//! Complete runs of simulations: load → compile → place → recorders → run → stop.
//!
//! The command line and the Python package use this crate, so runs are identical in both. There is one time loop, [`Runner::go`]:
//! ```text
//! at each tick:   calls due → watcher → samples of the recorders → checkpoint due → stop? → step
//! ```
//! A sample therefore contains the values that a call has set, and a checkpoint is written after the samples of its tick. Only the step and the calls change the state
//! (rule 6 of ARCHITECTURE.md).
//!
//! | module | content |
//! |---|---|
//! | `prepare` | resolves all names of the file; reports all mistakes at once |
//! | `recording` | variables of a run over time, in memory |
//! | `run` | the time loop, with its recorders |
//! | `change` | set and pin variables during the run |
//! | `saves` | times, names and additional contents of checkpoints |
//! | `folder` | the output folder of a run: one run at a time, without interference from earlier runs |
//! | `balance` | balances of energy, mass and charge, integrated during a run |
//! | `metrics` | metrics of a simulation, with constant memory |
//! | `built` | the build of the program, for logs, checkpoints and summaries |
//! | `pace` | pacing to real time or a multiple of it; lateness of ticks |
//!
//! Viewers are recorders that the program passes in; this crate does not depend on any.
mod balance;
mod built;
mod change;
mod conditions;
mod folder;
mod metrics;
mod pace;
mod prepare;
mod recording;
mod run;
mod saves;
mod stop;

pub use balance::{Balance, Balances, Part as PartBalance, Report};
pub use built::built;
pub use change::{assignment, changed};
pub use folder::{Folder, FolderError};
pub use linkwork_assembly::{Library, Ready, Shared, sim_file};
pub use metrics::{Metrics, Tracked};
pub use pace::{Lateness, Pace, Realtime, SystemClock, WallClock};
pub use prepare::{Prepared, log_rules, prepare};
pub use recording::{Columns, Recording};
pub use run::{Ended, Goal, Need, Pause, RecorderEnd, Runner, Watch, recorder_entry};
pub use saves::{BUILT, Extra, Saves, signal_names, time_name};
pub use stop::Stop;

//! A run from file to end, as one library: load → compile → place → recorders → run → stop.
//!
//! The command line and the Python package are thin programs on it, so that a run means the same
//! in both. There is one time loop, [`Runner::go`]:
//! ```text
//! at each tick:   calls due → watcher → rows of the recorders → checkpoint due → stop? → step
//! ```
//! What a row shows is therefore what a call has set, and a checkpoint comes after the rows of its
//! tick. Nothing in the loop but the step and the calls changes the state (rule 6 of ARCHITECTURE.md).
//!
//! | module | what it holds |
//! |---|---|
//! | `load` | files → a compiled simulation with what else its file says |
//! | `prepare` | every name of the file looked up, all mistakes at once |
//! | `run` | the loop, with its recorders |
//! | `change` | variables set and pinned while it runs |
//! | `saves` | when checkpoints are written, their names, what they carry |
//! | `folder` | the folder of a run: one run at a time, nothing of another run in the way |
//! | `balance` | balances of energy, mass and charge, integrated during a run |
//! | `metrics` | a simulation's own metrics, in fixed memory |
//! | `built` | what built the program, for logs, checkpoints and summaries |
//! | `pace` | as fast as real time, or a multiple of it; how late ticks were |
//!
//! Viewers are recorders that the program hands in; this crate knows none.
mod balance;
mod built;
mod change;
mod folder;
mod load;
mod metrics;
mod pace;
mod prepare;
mod run;
mod saves;
mod unread;

pub use balance::{Balance, Balances, Part as PartBalance, Report};
pub use built::built;
pub use change::{assignment, changed};
pub use folder::{Folder, FolderError};
pub use load::{Library, Ready, Shared, sim_file};
pub use metrics::{Metrics, Tracked};
pub use pace::{Lateness, Pace, Realtime, SystemClock, WallClock};
pub use prepare::{Prepared, log_rules, prepare};
pub use run::{Ended, Goal, Need, Pause, RecorderEnd, Runner, Stop, Watch, recorder_entry};
pub use saves::{BUILT, Extra, Saves, signal_names, time_name};
